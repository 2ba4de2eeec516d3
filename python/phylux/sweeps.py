"""Many runs: calls a function, or runs a scene, with many values of some of its numbers, here or on other machines."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from .errors import missing, wrong
from .result import Result
from .scene import Scene


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

    @property
    def frame(self) -> Any:
        """`Result.frame` of all runs, with a column ``run`` and a column for each parameter before the other columns."""
        return self._joined([result.frame for result in self.results])

    @property
    def groups(self) -> Any:
        """`Result.groups` of all runs, with the same additional columns as `frame`."""
        return self._joined([result.groups for result in self.results])

    def _joined(self, tables: list[Any]) -> Any:
        try:
            import pandas as pd
        except ImportError:
            raise missing("pandas", "a DataFrame") from None
        named = []
        for run, (values, table) in enumerate(zip(self.values, tables)):
            table = table.copy()
            for place, (name, value) in enumerate({"run": run, **values}.items()):
                if isinstance(value, (list, tuple, dict)):
                    value = str(value)
                table.insert(place, name, value)
            named.append(table)
        return pd.concat(named, ignore_index=True)


def sweep(
    build: Callable[..., Scene | Result] | Scene,
    values: Mapping[str, Iterable[Any]] | Iterable[Mapping[str, Any]],
    *,
    executor: Any = None,
    progress: bool | Callable[[int, int | None], object] = False,
    **options: Any,
) -> Sweep:
    """Runs a scene with many values of some of its numbers.

    Args:
        build: a function that is called with the values by name and returns a `Scene` (or a `Result` of its own); or a
            scene, in which each name is a JSON pointer such as ``"/lights/0/power"``.
        values: ``{name: [values]}`` combines each value with each value of the other names, where the last name
            changes first; a list of ``{name: value}`` has one entry for each run.
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
    """
    if isinstance(values, Mapping):
        names = list(values)
        runs = [dict(zip(names, row)) for row in itertools.product(*values.values())]
    else:
        runs = [dict(row) for row in values]
    results: list[Result] = []
    from .scene import _progress

    with _progress(progress) as tell:
        if executor is None:
            for values_of_run in runs:
                results.append(_run(build, values_of_run, options))
                if tell is not None:
                    tell(len(results), len(runs))
            return Sweep(runs, results)
        futures = [executor.submit(_run, build, values_of_run, options) for values_of_run in runs]
        try:
            for future in futures:
                results.append(future.result())
                if tell is not None:
                    tell(len(results), len(runs))
        except BaseException:
            for future in futures:
                future.cancel()
            raise
    return Sweep(runs, results)


def _run(build: Any, values: Mapping[str, Any], options: Mapping[str, Any]) -> Result:
    """Does one run; executors call it in other processes too."""
    if isinstance(build, Scene):
        given = {**options, **{name: value for name, value in values.items() if not name.startswith("/")}}
        scene = build.copy()
        for pointer, value in values.items():
            if pointer.startswith("/"):
                _put(scene.keys, pointer, value)
        return scene.run(**given)
    made = build(**values)
    return made if isinstance(made, Result) else made.run(**options)


def _put(keys: Any, pointer: str, value: Any) -> None:
    """Puts a value at a JSON pointer, which must exist."""
    *path, last = [part.replace("~1", "/").replace("~0", "~") for part in pointer[1:].split("/")]
    at = keys
    for part in [*path, last]:
        inside, at = at, _entry(at, part, pointer)
    if isinstance(inside, list):
        inside[int(last)] = value
    else:
        inside[last] = value


def _entry(at: Any, part: str, pointer: str) -> Any:
    if isinstance(at, dict) and part in at:
        return at[part]
    if isinstance(at, list) and part.isdecimal() and int(part) < len(at):
        return at[int(part)]
    raise wrong(pointer, "is not in the scene", "write the default into the scene, or correct the pointer")
