"""Many runs: calls a function, or runs a scene, with many values of some of its numbers, here or on other machines."""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from . import _native, html
from .errors import pandas as _pandas
from .errors import missing, wrong
from .result import Result
from .scene import Scene
from .shown import Progress
from .values import cells, columns, plain


class Sweep(Sequence[Result]):
    """The results of a sweep, in the order of its runs.

    Attributes:
        values: for each run, the value of each parameter by name.
        results: one result for each run.
    """

    def __init__(self, values: list[dict[str, Any]], results: list[Result]) -> None:
        self.values = values
        self.results = results

    def __len__(self) -> int:
        return len(self.results)

    def __getitem__(self, run: Any) -> Any:
        return self.results[run]

    def __repr__(self) -> str:
        return f"<Sweep of {len(self)} runs over {', '.join(self.values[0]) if self.values else 'nothing'}>"

    def _repr_html_(self) -> str:
        names = list(self.values[0]) if self.values else []
        rows = [(run, *values.values()) for run, values in enumerate(self.values[: html.MOST])]
        return html.table(repr(self), ("run", *names), rows, len(self))

    @property
    def frame(self) -> Any:
        """`Result.frame` of all runs, with a column ``run`` and a column for each parameter before the other columns."""
        return self._joined([result.frame for result in self.results])

    @property
    def groups(self) -> Any:
        """`Result.groups` of all runs, with the same additional columns as `frame`."""
        return self._joined([result.groups for result in self.results])

    def _joined(self, tables: list[Any]) -> Any:
        pd = _pandas("a DataFrame")
        named = []
        for run, (values, table) in enumerate(zip(self.values, tables)):
            table = table.copy()
            for place, (name, value) in enumerate({"run": run, **values}.items()):
                table.insert(place, name, value if pd.api.types.is_scalar(value) else str(value))
            named.append(table)
        return pd.concat(named, ignore_index=True)


def sweep(
    build: Callable[..., Scene | Result] | Scene,
    values: Mapping[str, Any] | Iterable[Mapping[str, Any]],
    *,
    combine: str | Mapping[str, Any] = "grid",
    executor: Any = None,
    progress: bool | Callable[[int, int | None], object] = False,
    **options: Any,
) -> Sweep:
    """Runs a scene with many values of some of its numbers.

    Args:
        build: a function that is called with the values by name and returns a `Scene` (or a `Result` of its own); or a
            scene, in which names that begin with ``/`` are JSON pointers such as ``"/lights/0/power"``, other names are
            options of `Scene.run`, or parameters as in a sweep file (docs/sweep.md).
        values: for each name a list of values, or, as in a sweep file, ``{"from": 0, "to": 1, "steps": 5}``, in samples
            ``{"from": 0, "to": 1}``, and for a scene ``{"at": ["/lights/*/position/2"], ...}``. In a scene, texts such as
            ``"=1.2 * x + rise"`` are expressions of the number that stands there and of other parameters. Or a list of
            ``{name: value}`` with one entry for each run, or a DataFrame with one row for each.
        combine: ``"grid"`` combines each value with each value of the other names, where the last name changes first;
            ``"zip"`` the first values, the second ones, and so on; ``{"sample": "sobol", "count": 64, "seed": 1}`` and
            ``{"sample": "latin-hypercube", ...}`` are samples.
        executor: an object with a ``submit`` like those of ``concurrent.futures``: a pool of processes or threads,
            joblib's loky, Dask's ``client.get_executor()``, dask-jobqueue on a cluster. Without an executor the runs
            are done one after the other.
        progress: True shows a tqdm progress bar; a function is called as ``progress(done, of)``.
        options: options of `Scene.run`. With an executor on this machine, give ``threads``, so that its workers share
            the processors. All runs have the same seed unless ``seed`` is among the values.

    >>> def box(height):
    ...     scene = Scene("box")
    ...     scene.light("lamp", type="point", position=[0, 0, height], power=1)
    ...     scene.captor("sensor", disc={"center": [0, 0, 0], "normal": [0, 0, 1], "radius": 0.1})
    ...     return scene
    >>> found = sweep(box, {"height": [1, 2]}, photons=1000, k=0)
    >>> found.values
    [{'height': 1}, {'height': 2}]
    >>> found = sweep(box(1), {"rise": [0, 0.5], "/lights/*/position/2": ["=x + rise"]}, photons=1000, k=0)
    >>> found.values
    [{'rise': 0, '/lights/*/position/2': '=x + rise'}, {'rise': 0.5, '/lights/*/position/2': '=x + rise'}]
    >>> sample = {"sample": "sobol", "count": 4}
    >>> len(sweep(box, {"height": {"from": 1, "to": 2}}, combine=sample, photons=1000, k=0))
    4
    """
    named, scenes = _planned(build, values, combine)
    results: list[Result] = []
    with Progress(progress) as tell:
        if executor is None:
            for run, values_of_run in enumerate(named):
                results.append(_run(build, values_of_run, scenes(run), options))
                if tell is not None:
                    tell(len(results), len(named))
            return Sweep(named, results)
        futures = [executor.submit(_run, build, values_of_run, scenes(run), options) for run, values_of_run in enumerate(named)]
        try:
            for future in futures:
                results.append(future.result())
                if tell is not None:
                    tell(len(results), len(named))
        except BaseException:
            for future in futures:
                future.cancel()
            raise
    return Sweep(named, results)


#: columns of the tables of all runs, which no parameter may be named as
_COLUMNS = ("run", "captor", "group", "face", "band", "quantity", "value", "standard_error", "model_se")
#: the place of what is no part of the scene in the documents of runs
_OPTIONS = "options of runs"


def _rows(values: Any) -> list[dict[str, Any]]:
    """Returns the values of each run, from a list of them or a table with a row for each. Error: it is neither."""
    table = columns(values, "sweep")
    if table is not None:
        listed = {name: cells(column, f"sweep: column {name}") for name, column in table.items()}
        rows = [dict(zip(listed, row)) for row in zip(*listed.values(), strict=True)]
    elif isinstance(values, Iterable):
        rows = list(values)
    else:
        raise wrong("sweep", f"a {type(values).__name__}", "give {name: values}, or a list of {name: value}")
    if not rows:
        raise wrong("sweep", "has no run", "give the values of one at least")
    for run, row in enumerate(rows):
        if not isinstance(row, Mapping):
            raise wrong(f"sweep: run {run}", f"a {type(row).__name__}", "give {name: value}")
    return [dict(row) for row in rows]


def _planned(build: Any, values: Any, combine: Any) -> tuple[list[dict[str, Any]], Callable[[int], str]]:
    """Returns the values of each run, and a function that makes the scene of a run by its index, as JSON: of many runs
    together they would need much memory. The scene is empty for a function."""
    if not isinstance(values, Mapping):
        rows = _rows(values)

        def single(run: int) -> tuple[list[dict[str, Any]], Callable[[int], str]]:
            return _planned(build, {name: [value] for name, value in rows[run].items()}, "grid")

        for run in range(len(rows)):
            # an error in any of them comes before the first run
            single(run)
        return rows, lambda run: single(run)[1](0)
    taken = next((name for name in values if name in _COLUMNS), None)
    if taken is not None:
        raise wrong("sweep", f"a parameter named `{taken}`, as a column of the tables", "name it otherwise")
    document = build._document() if isinstance(build, Scene) else {}
    if not values:
        return [{}], lambda _: json.dumps(document)
    options = inspect.signature(Scene.run).parameters
    scene: dict[str, Any] = {**document, _OPTIONS: {}}
    vary: dict[str, Any] = {}
    lists: dict[str, list[Any]] = {}
    labels: dict[str, str] = {name: name for name in values}
    for name, given in values.items():
        if isinstance(given, str) or not isinstance(given, Iterable):
            raise wrong(f"sweep: {name}", f"{given!r} is one value", "give a list of values")
        form = dict(given) if isinstance(given, Mapping) else {"values": list(given)}
        if not isinstance(build, Scene) or (name in options and "at" not in form):
            # the values of arguments may be anything, and only their indices are planned
            key = name.replace("~", "~0").replace("/", "~1")
            form["at"], scene[_OPTIONS][name] = [f"/{_OPTIONS}/{key}"], 0
            # the tables of a sweep have columns of some names
            labels[name] = f"argument {name}"
            if "values" in form:
                lists[name] = list(form["values"])
                form["values"] = list(range(len(lists[name])))
        vary[labels[name]] = form
    file = {"scene": "scene", "vary": plain(vary, "sweep: /vary"), "combine": plain(combine, "sweep: /combine")}
    plan = _native.Planned(json.dumps(file), json.dumps(scene))
    named = []
    for run in range(len(plan)):
        chosen = json.loads(plan.values(run))
        found = {name: chosen[labels[name]] for name in values}
        named.append({name: lists[name][value] if name in lists else value for name, value in found.items()})
    return named, plan.scene if isinstance(build, Scene) else lambda _: "{}"


def _run(build: Any, values: Mapping[str, Any], planned: str, options: Mapping[str, Any]) -> Result:
    """Does one run; executors call it in other processes too."""
    if isinstance(build, Scene):
        known = inspect.signature(Scene.run).parameters
        scene = _scene(build, planned)
        return scene.run(**{**options, **{name: value for name, value in values.items() if name in known}})
    made = build(**values)
    return made if isinstance(made, Result) else made.run(**options)


def _scene(build: Scene, planned: str) -> Scene:
    """Returns the scene of a run."""
    scene, keys = build.copy(), json.loads(planned)
    keys.pop(_OPTIONS, None)
    # the plan names a seed, which is that of the run anyway
    settings = build.keys.get("settings")
    if settings is None:
        keys.pop("settings", None)
    elif isinstance(settings, Mapping) and "seed" not in settings:
        keys["settings"].pop("seed", None)
    scene.keys.clear()
    scene.keys.update(keys)
    return scene
