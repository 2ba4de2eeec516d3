"""Scenes: built in Python, checked, run, shown, saved."""

from __future__ import annotations

import datetime
import filecmp
import functools
import json
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from . import _native, geometry, html, shown
from .errors import InputError, missing, say, wrong
from .histories import Histories
from .result import Result, same_file
from .studies import Calibration, Chart
from .values import arguments as _arguments
from .values import cells, columns, csv_table, finite, is_missing, numbers, plain, span, texts
from .values import name as checked
from .years import Year, find, find_by_shards

#: keys of a scene file whose texts are not names of files
_NAMES = ("name", "material", "group", "type")
#: options of `phylux run` that name files to write, and the methods of a result that write these files
_OUTPUTS = {"output": "save", "csv": "save_csv", "per_captor": "save_per_captor"}
#: the name of the table of `Scene.weather`, which no table of captors or copies takes
_WEATHER = "weather"


class Scene:
    """A scene, with exactly the keys of a scene file (docs/scene-format.md).

    Args:
        name: a title, which the results repeat.
        unit: unit of every length in the scene: ``"m"``, ``"cm"`` or ``"mm"``. Results are always in metres.
        quantity: unit of the powers of the lights: ``"W"`` or ``"umol/s"``.
        bands: ``{name: (from_nm, to_nm)}``, ``[name, ...]``, or as in a scene file; if not given, one band ``all``.
        keys: any other key of a scene file, such as ``sums``, ``camera``, ``settings``, ``site``.

    >>> scene = Scene("box", bands={"blue": (400, 500), "red": (600, 700)})
    >>> scene.material("grey", type="lambert", reflectance=[0.5, 0.6])
    >>> scene.add("floor", [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], material="grey", captor=True)
    >>> scene.light("lamp", type="point", position=[0.2, 0.2, 1], power=[20, 80])
    >>> result = scene.run(photons=1000, k=0)
    >>> result.ids
    ['floor/floor']
    >>> result.irradiance.shape  # captor, face, band
    (1, 2, 2)
    """

    def __init__(
        self,
        name: str,
        *,
        unit: str = "m",
        quantity: str = "W",
        bands: Any = None,
        **keys: Any,
    ) -> None:
        self._keys: dict[str, Any] = {"name": name, "unit": unit, "quantity": quantity}
        if bands is not None:
            self._keys["bands"] = _bands(bands)
        self._meshes: dict[str, geometry.Mesh] = {}
        self._tables: dict[str, bytes] = {}
        self._path, self._is_read = Path("scene"), False
        self._keys.update({key: self._plain(value, key) for key, value in keys.items()})

    def __repr__(self) -> str:
        parts = [f"{len(self._keys.get(key, ()))} {key}" for key in ("materials", "objects", "lights", "captors")]
        return f"<Scene {self._keys.get('name', str(self._path))!r}: {', '.join(parts)}>"

    def _repr_html_(self) -> str:
        rows = []
        for key in ("materials", "objects", "lights", "captors", "groups"):
            parts = self._keys.get(key, ())
            names = [str(part.get("name", "") if isinstance(part, Mapping) else part) for part in parts]
            more = f" and {len(names) - html.MOST} more" if len(names) > html.MOST else ""
            rows.append((key, len(names), ", ".join(names[: html.MOST]) + more))
        return html.table(repr(self), ("", "number", "names"), rows, of=len(rows))

    def _plain(self, value: Any, *place: object) -> Any:
        """Returns a value of the scene as JSON has it; errors name it by its place in the scene."""
        keys = [str(key).replace("~", "~0").replace("/", "~1") for key in place]
        return plain(value, f"{self._path}: /{'/'.join(keys)}")

    def _next(self, key: str) -> tuple[str, int]:
        """Returns the place of what will be added to a list of the scene."""
        return key, len(self._keys.get(key, ()))

    def _document(self) -> dict[str, Any]:
        """Returns the scene as its file has it. Error: something in it has no form there."""
        return {key: self._plain(value, key) for key, value in self._keys.items()}

    def __getstate__(self) -> dict[str, Any]:
        # to another process go plain values, for which it needs no package
        return {**self.__dict__, "_keys": self._document()}

    @property
    def keys(self) -> dict[str, Any]:
        """The scene as the content of its JSON file. Change it in place as you like.

        In it, meshes in memory are called ``"mesh:NAME"``, and tables of sensors in memory ``"table:NAME"``.
        """
        return self._keys

    def material(self, name: str, **keys: Any) -> None:
        """Adds a material: ``material("leaf", type="leaf", reflectance=[0.05, 0.06], transmittance=0.01)``.

        Args:
            name: the name that objects use.
            keys: as in a scene file; values per band are one number, or one number for each band, in [0, 1].
        """
        name = checked(name, str(self._path), "a material")
        self._keys.setdefault("materials", {})[name] = self._plain(keys, "materials", name)

    def add(self, name: str, shape: Any, *, material: str | None = None, **keys: Any) -> None:
        """Adds an object.

        Args:
            name: the first part of the ids of its captors.
            shape: lengths are in the scene's unit, and the front is where corners run counter-clockwise; one of

                - ``(vertices, faces)``: (n, 3) numbers and (m, 3) whole numbers counted from 0;
                - triangles: (m, 3, 3) numbers;
                - ``{id: any of these}``: each id is a group with a captor of its own (CARIBU's form);
                - a mesh or scene of trimesh, PolyData or MultiBlock of PyVista, a scene of PlantGL;
                - the path of an OBJ, PLY, STL or glTF file.
            material: a material of the scene, for all of the shape; OBJ and glTF files may name their own.
            keys: as in a scene file: ``captor`` (True: one per group; ``"triangle"``: one per triangle), ``group``,
                ``transform``, ``instances``, ``share`` (whether the copies share the triangles). ``instances`` may
                also be (n, 3) numbers x, y, z, with ``turn_deg`` (n, 4) and ``scale`` (n, 5); (n, 3, 4) or (n, 4, 4)
                numbers, a matrix for each copy; or a DataFrame with the columns of the CSV file.
        """
        name = checked(name, str(self._path), "an object")
        instances = keys.get("instances")
        table = _copies(instances, name) if _is_table(instances) else None
        if table is not None:
            del keys["instances"]
        entry: dict[str, Any] = {"name": name, "obj": "", "material": material, **self._plain(keys, *self._next("objects"))}
        if material is None:
            del entry["material"]
        entry["obj"] = self._shape(name, shape, group=name)
        if table is not None:
            entry["instances"] = {"csv": self._table(name, table)}
        self._keys.setdefault("objects", []).append(entry)

    def light(self, name: str, *, start: Any = None, shape: Any = None, **keys: Any) -> None:
        """Adds a light: ``light("lamp", type="tube", start=[0, 0, 2], to=[1, 0, 2], radius=0.01, power=40)``.

        Args:
            name: the name in results by light.
            start: the key ``from`` of a tube, because ``from`` is a reserved word in Python.
            shape: the surface of an area light, in any of the forms of `add`, instead of ``vertices``.
            keys: as in a scene file; ``power`` in W or umol/s, one number or one number for each band.
        """
        name = checked(name, str(self._path), "a light")
        if start is not None:
            keys["from"] = start
        entry: dict[str, Any] = {"name": name, **self._plain(keys, *self._next("lights"))}
        if shape is not None:
            entry["obj"] = self._shape(name, shape)
        self._keys.setdefault("lights", []).append(entry)

    def captor(self, name: str, *, discs: Any = None, shape: Any = None, **keys: Any) -> None:
        """Adds virtual captors: sensors that count light and do not disturb it.

        Args:
            name: the first part of the ids of the captors.
            discs: (n, 7) numbers x, y, z, radius, nx, ny, nz in the scene's unit, as `grid` makes them, or a
                DataFrame with these columns and, if you like, ``id``; other columns only if ``ignore`` names them.
                The ids are ``name/0``, ``name/1``, ...
            shape: surfaces that count light, with one captor per group, in any of the forms of `add`.
            keys: as in a scene file: ``disc``, ``sphere``, ``grid``, ``line``, ``csv``, ``obj``, ``response``, ``sides``
                (``"front"`` or ``"both"``), ``group``.
        """
        name = checked(name, str(self._path), "a captor")
        entry: dict[str, Any] = {"name": name, **self._plain(keys, *self._next("captors"))}
        if discs is not None:
            if "ignore" in entry:
                entry["ignore"] = texts(entry["ignore"], f"{name}: ignore")
            entry["csv"] = self._table(name, _table(discs, name, entry.get("ignore", ())))
        if shape is not None:
            entry["obj"] = self._shape(name, shape)
        self._keys.setdefault("captors", []).append(entry)

    def group(self, name: str, *patterns: str) -> None:
        """Makes a group of captors by patterns of their ids: ``group("rank 3", "plant/leaf3#*")``.

        Args:
            name: name of the group, in `Result.groups`.
            patterns: ``*`` stands for any characters. A captor counts once, and each pattern must match a captor.
        """
        name = checked(name, str(self._path), "a group")
        self._keys.setdefault("groups", {})[name] = self._plain(list(patterns), "groups", name)

    def weather(self, table: Any, *, stamp: str, **keys: Any) -> None:
        """Takes the weather from a DataFrame, as pvlib reads it from many sources.

        Args:
            table: a DataFrame of pandas whose index has times with a time zone, or one of polars or arrow with these in
                the column ``time``, with columns of irradiances, W/m2: ``ghi`` (global horizontal), ``dni`` (direct
                normal), ``dhi`` (diffuse horizontal); two of them are enough. Missing values are those of hours of
                which nothing is known. Other columns are not used. Or all that pvlib's readers return: such a DataFrame, and metadata whose
                latitude and longitude, wherever they stand in it, become the ``site`` of a scene that has none.
            stamp: which moment of its interval the time of a row is: ``"start"``, ``"middle"`` or ``"end"``.
            keys: other keys of ``weather``, such as ``shift_h``.

        >>> import pandas as pd
        >>> times = pd.date_range("2025-06-21T10:00", periods=3, freq="h", tz="Europe/Berlin")
        >>> scene = Scene("open", quantity="umol/s", bands={"PAR": (400, 700)}, time="2025-06-21T11:30+02:00")
        >>> scene.keys["site"] = {"latitude": 52, "longitude": 13}
        >>> scene.weather(pd.DataFrame({"ghi": [610, 700, 760], "dhi": [150, 160, 165]}, index=times), stamp="start")
        >>> scene.light("sun", type="sun")
        >>> scene.keys["weather"]
        {'file': 'table:weather', 'stamp': 'start'}
        """
        place = None
        if isinstance(table, tuple) and table:
            table, place = table[0], _place(table[1:])
        given = self._plain({"file": f"table:{_WEATHER}", "stamp": stamp, **keys}, "weather")
        self._tables[_WEATHER] = _weather(table)
        self._keys["weather"] = given
        if place is not None:
            site = self._keys.setdefault("site", {})
            if not {"latitude", "longitude"} & site.keys():
                site.update(place)

    def check(self) -> Check:
        """Returns the text of ``phylux check``, which describes the scene; ``.warnings`` says what looks wrong in it, and
        ``.data`` has all of it as data."""
        return Check(*self._load(quiet=True).check(html.width()))

    def run(
        self,
        photons: float | None = None,
        seed: int | None = None,
        *,
        estimator: str | None = None,
        tolerance: float | None = None,
        of: str | Sequence[str] | None = None,
        max_time: float | None = None,
        k: int | None = None,
        map_photons: float | None = None,
        guiding: str | None = None,
        by_light: bool = False,
        sensitivity: bool | str | Sequence[str] | None = None,
        checkpoint: str | os.PathLike[str] | None = None,
        checkpoint_every: float | None = None,
        threads: int | None = None,
        progress: bool | Callable[[int, int | None], object] = False,
        **options: Any,
    ) -> Result:
        """Runs the scene. The same scene, options and seed give the same numbers, and the same bytes as ``phylux run``.

        Ctrl-C ends the run with KeyboardInterrupt. Other threads of Python continue during the run.

        Args:
            photons: number of photons, or of paths over all captors; with a tolerance, the largest number.
            seed: seed of the random numbers.
            estimator: ``"photons"``, ``"paths"``, ``"complete"`` or ``"auto"`` (default: the scene's, or ``"auto"``).
            tolerance: continue until every captor's relative standard error is at most this, in (0, 1).
            of: the values that the tolerance applies to, instead of the irradiance of all faces:
                ``"pattern[:quantity[:band]]"`` or a list of these, as ``["plant*:absorbed:PAR", "bench"]``; quantities
                are ``irradiance``, ``back`` and ``absorbed``.
            max_time: end soon after this time, s.
            k: number of photons in a k-nearest estimate; 0 makes no estimates and saves time and memory.
            map_photons: the largest number of arrivals that are stored for these estimates.
            guiding: ``"off"``, ``"aim"`` (some flights are aimed at sensors, in addition to photons), ``"full"``
                (photons are also split and ended by their importance) or ``"auto"`` (a short trial finds which of
                these is cheapest).
            by_light: also return the part of each light, for `Result.mix`.
            sensitivity: True finds how much results depend on all materials and lights, a list of names on
                these alone (`Result.sensitivity`), False on none; by default the scene's key says it.
            checkpoint: a file that keeps the work done. After a kill or Ctrl-C, the same run continues from it and
                finds the same results. The file is removed when the result is complete.
            checkpoint_every: the shortest time between two times of writing the checkpoint, s; 60 if not given.
            threads: number of threads; 0 uses all processors. The results do not depend on it.
            progress: True shows a tqdm progress bar; a function is called as ``progress(done, of)``, where ``of`` is
                None if it is not known.
            options: any other option of ``phylux run``: ``--such-a-one=1`` is ``such_a_one=1``.

        Options that are not given have the values in the scene's ``settings``, or else the defaults of the command.
        """
        for name in options:
            if name in _OUTPUTS:
                raise wrong(name, "names a file to write", f"call {_OUTPUTS[name]} of the result")
            if name in ("shard", "stats"):
                raise wrong(name, "is for the command alone", "save the scene, and run it with `phylux run`")
        given = {
            "photons": photons,
            "seed": seed,
            "estimator": estimator,
            "tolerance": tolerance,
            "of": None if of is None else texts(of, "of"),
            "max_time": max_time,
            "k": k,
            "map_photons": map_photons,
            "guiding": guiding,
            "by_light": by_light,
            "checkpoint": checkpoint,
            "checkpoint_every": checkpoint_every,
            "threads": threads,
            **options,
        }
        scene = self
        if sensitivity is not None:
            scene = self.copy()
            several = isinstance(sensitivity, Iterable)
            scene.keys["sensitivity"] = texts(sensitivity, "sensitivity") if several else sensitivity
        loaded = scene._load()
        with shown.Progress(progress) as tell:
            found, warned = loaded.run(_arguments(given), tell)
        result = Result(found, loaded)
        say(*warned)
        # those about files were said when the scene was read
        say(*(warning for warning in result.warnings if warning not in loaded.warnings))
        return result

    def year(
        self,
        output: str | os.PathLike[str],
        *,
        control: Mapping[str, Any] | str | os.PathLike[str] | None = None,
        patches: int | None = None,
        photons: float | None = None,
        seed: int | None = None,
        guiding: str | None = None,
        csv: bool = False,
        hours: str | None = None,
        results: bool = False,
        sun_rays: int | None = None,
        checkpoint: str | os.PathLike[str] | None = None,
        from_: str | os.PathLike[str] | None = None,
        keep_light: bool = False,
        width: float | None = None,
        png: bool = False,
        shards: int | None = None,
        executor: Any = None,
        threads: int | None = None,
        progress: bool | Callable[[int, int | None], object] = False,
    ) -> Year:
        """Calculates daylight and lamps by the hour, and daily light integrals of days, months and the whole period, from
        one run.

        Args:
            output: a folder for the tables, which is created; docs/year.md lists the tables.
            control: when lamps are on: the keys of a control file, or its path; without it the lamps are off.
            patches: number of patches of the sky: 577, which is the default, or 145.
            photons: number of photons, for all hours together.
            seed: seed of the random numbers.
            guiding: as for `run`.
            csv: write the tables of hours, days, months and the period as CSV and not as Parquet.
            hours: whose hours are written: ``"groups"``, ``"all"``, ``"none"`` or a pattern of ids; without it all
                of up to 1,000 ids, else those of groups.
            results: also write the mean light of each month as results, for `Year.result` and maps.
            sun_rays: number of points of each captor from which the sun of an hour is looked for.
            checkpoint: a file that keeps what is done: after a kill, the same call goes on from there.
            from_: the folder of an earlier year of this scene, whose light is taken: another control of the lamps then takes
                seconds, and traces nothing. Settings of the light are those of that year.
            keep_light: keep the light for ``from_``, however large it is; up to 256 MB of it are always kept.
            width: width of the plots, inches: 7, which is the default, or 3.5.
            png: write the plots as PNG and not as SVG.
            shards: with ``executor``: the number of shards into which the work is divided.
            executor: as for `sweep`: does the shards on other machines, which see the folder of ``output``, or in
                other processes; give ``threads`` with it. The tables have the same bytes.
            threads: number of threads; 0 uses all processors. The results do not depend on it.
            progress: as for `run`, without an executor; it counts anew for each part of the work.

        Returns:
            the tables ``hours``, ``days``, ``months``, ``total``, ``lamps`` and others, as DataFrames.
        """
        if (executor is None) != (shards is None):
            raise wrong("shards", "goes with `executor`", "give both, or neither")
        if executor is not None and from_ is not None:
            raise wrong("from_", "nothing is traced, so that there is nothing to share out", "leave out `executor` and `shards`")
        # beside the tables, where all machines see it
        near = Path(output).absolute().parent if executor is not None else None
        given: dict[str, Any] = {"patches": patches, "photons": photons, "seed": seed, "guiding": guiding, "csv": csv}
        given |= {"hours": hours, "results": results, "sun_rays": sun_rays, "threads": threads, "keep_light": keep_light}
        kept, style = None if checkpoint is None else Path(checkpoint), _arguments({"width": width, "png": png})
        with tempfile.TemporaryDirectory(dir=near) as folder:
            scene = Path(folder, "scene.json")
            self.save(scene)
            file = None if control is None else self._control(control, Path(folder))
            if executor is not None:
                warned = find_by_shards(scene, file, Path(output), _arguments(given), style, kept, shards or 1, executor)
            else:
                with shown.Progress(progress) as tell:
                    warned = find(scene, file, Path(output), _arguments(given), style, kept, light=from_, progress=tell)
        say(*warned)
        return Year(output)

    def calibrate(
        self,
        readings: Any = None,
        *,
        even: str | None = None,
        mean: float | None = None,
        minimum: float | None = None,
        band: str | None = None,
        result: Result | None = None,
        model: str = "auto",
        prior: float | None = 0.2,
        groups: Sequence[str] = (),
        vary: Mapping[str, tuple[float, float]] | None = None,
        photons: float | None = None,
        seed: int | None = None,
        tolerance: float | None = None,
        guiding: str | None = None,
        threads: int | None = None,
        progress: bool | Callable[[int, int | None], object] = False,
    ) -> Calibration:
        """Fits the powers of the lamps to readings of an instrument, or finds those that light captors evenly.

        docs/calibration.md explains the readings, the models and what is found.

        Args:
            readings: a DataFrame (of pandas, polars or arrow) with the columns ``captor`` (or ``x``, ``y``, ``z``), ``band``, ``value`` and, if you
                like, ``sd``, ``face``, ``use``, ``block``; or the path of a CSV file with them.
            even: in place of readings, a pattern of the groups or captors to light evenly, as in ``"bench*"``.
            mean: with `even`, the mean irradiance to reach; if not given, the present one.
            minimum: with `even`, the least irradiance of each captor, reached with the least power, in place of `mean`.
            band: with `even`, the band or sum that counts; if not given, the only band, or the first sum.
            result: a result of this scene with ``by_light=True``, so that nothing is traced.
            model: how the factors may differ: ``"common"``, ``"bands"``, ``"product"``, ``"lamps"`` or ``"auto"``.
            prior: relative standard deviation of the lamps' factors about the common one; None for no prior.
            groups: patterns of names of lights that share their factors.
            vary: numbers of the scene to fit, too: ``{"/materials/wall/reflectance": (0.7, 0.85)}``.
            photons, seed, tolerance, guiding, threads, progress: as for `run`; the progress is that of each run.

        >>> scene = Scene("bench", quantity="umol/s")
        >>> for name, x in (("left", -1), ("right", 1)):
        ...     scene.light(name, type="point", position=[x, 0, 1], power=100 if name == "left" else 50)
        ...     scene.captor(name, disc={"center": [x, 0, 0], "normal": [0, 0, 1], "radius": 0.1}, group="bench")
        >>> found = scene.calibrate(even="bench", mean=10, photons=4000)
        >>> [round(found.report[when]["mean"], 6) for when in ("after",)]
        [10.0]
        >>> found.factors["left"][0] < found.factors["right"][0]
        True
        """
        if (readings is None) == (even is None):
            raise wrong("readings", "neither readings nor `even`" if even is None else "both readings and `even`", "give one of them")
        given: dict[str, Any] = {"even": even, "mean": mean, "minimum": minimum, "band": band, "groups": texts(groups, "groups")}
        given |= {"photons": photons, "seed": seed, "tolerance": tolerance, "guiding": guiding, "threads": threads}
        if even is None:
            ranges = [[place, *span(ends, f"vary/{place}")] for place, ends in (vary or {}).items()]
            given |= {"model": model, "prior": prior, "vary": ranges}
        elif vary:
            raise wrong("vary", "goes with readings only", "leave it out")
        if result is not None:
            traced = [name for name in ("photons", "seed", "tolerance", "guiding", "threads") if given[name] is not None]
            if traced or vary:
                raise wrong([*traced, "vary"][0], "goes without `result`, of which nothing is traced", "leave it out")
        table, loaded = None if readings is None else _readings(readings), self._load(quiet=True)
        with shown.Progress(progress) as tell:
            found = None if result is None else result._found
            scene, report, warned = _native.calibrate(loaded, _arguments(given), table, found, tell)
        calibrated = self.copy()
        calibrated._keys = json.loads(scene)
        say(*warned)
        read = [*loaded.files, *([Path(readings)] if isinstance(readings, (str, os.PathLike)) else [])]
        return Calibration(json.loads(report), calibrated, warned, read)

    def chart(
        self,
        output: str | os.PathLike[str],
        *,
        truth: str | os.PathLike[str] | None = None,
        photons: float | None = None,
        seed: int | None = None,
        seeds: int | None = None,
        k: Sequence[int] | None = None,
        width: float | None = None,
        png: bool = False,
        threads: int | None = None,
        progress: bool | Callable[[int, int | None], object] = False,
    ) -> Chart:
        """Charts the error of every estimator against its cost; docs/accuracy.md explains the charts.

        Args:
            output: a folder for the charts and their numbers, which is created.
            truth: a table (CSV) of true irradiances; without it, a run of 16 times the largest budget stands in for it.
            photons: photons of the largest budget.
            seed: seed of the first run of each budget.
            seeds: number of runs for each budget.
            k: values of k for the k-nearest estimates.
            width: width of the charts, inches: 7, which is the default, or 3.5.
            png: write the charts as PNG and not as SVG.
            threads: number of threads; 0 uses all processors.
            progress: as for `run`.
        """
        given = {"photons": photons, "seed": seed, "seeds": seeds, "k": k, "threads": threads}
        style = _arguments({"width": width, "png": png})
        with shown.Progress(progress) as tell:
            true = None if truth is None else Path(truth)
            warned = _native.charts(self._load(quiet=True), Path(output), true, _arguments(given), style, tell)
        say(*warned)
        return Chart(output)

    def export(
        self,
        path: str | os.PathLike[str],
        *,
        result: Result | None = None,
        trace: bool = True,
        quantity: str | None = None,
        band: str | None = None,
        range: tuple[float, float] | None = None,
        log: bool = False,
        threads: int | None = None,
    ) -> None:
        """Writes the scene and its light for other programs.

        Args:
            path: the file; its ending chooses the form: ``.vtp``, ``.vtu`` (all values, for ParaView and PyVista),
                ``.glb`` (coloured by one value, for Blender and browsers), ``.ply`` (photons).
            result: the result of a run of this scene, for the captors; without it the scene is run first.
            trace: False traces no rays: surfaces that are not captors then have no values.
            quantity: what the colours of a ``.glb`` show: ``"irradiance"`` or ``"absorbed"``.
            band: the band or sum of a ``.glb``; if not given, the first sum, or the first band.
            range: the values at the first and the last colour of a ``.glb``.
            log: colour a ``.glb`` by the logarithm of the values.
            threads: number of threads; 0 uses all processors.
        """
        shown.export(self._load(), path, _found(result), trace=trace, quantity=quantity, band=band, range=range, log=log, threads=threads)

    def to_pyvista(self, *, result: Result | None = None, trace: bool = True, threads: int | None = None) -> Any:
        """Returns the surfaces and captors with their light as PolyData of PyVista; docs/view.md lists its arrays.

        Args:
            result, trace, threads: as for `export`.
        """
        return shown.to_pyvista(self._load(), _found(result), trace=trace, threads=threads)

    def render(self, *, numbers: bool = False, **options: Any) -> Any:
        """Renders a picture of the scene.

        Args:
            numbers: return the light on surfaces instead of colours: (height, width, bands), W/m2/sr with
                ``show="radiance"`` and W/m2 otherwise (or the same in umol/s); 0 where no surface is seen.
            options: options of ``phylux render``, which docs/pictures.md explains. What is shown: ``show``
                (``"radiance"``, ``"irradiance"``, ``"absorbed"``, ``"error"``, ``"captors"``, ``"photons"``),
                ``band="red"``, ``log=True``, ``range=(0, 100)``, ``exposure``, ``white_balance="none"``,
                ``sensors="off"``, ``denoise="off"``, ``results=result``, and for photons ``colour="lamp"``, ``ground="light"``,
                ``paths=50``. From where: ``position=[x, y, z]``, ``look_at=[x, y, z]``, ``up=[x, y, z]``,
                ``fov_deg``, ``width``, ``height``. How well: ``rays``, ``max_time``, ``gather``, ``map_photons``,
                ``k``, ``photons``, ``seed``, ``threads``.

        Returns:
            (height, width, 3), red, green and blue from 0 to 255, for ``matplotlib.pyplot.imshow``.
        """
        if "output" in options:
            raise wrong("output", "names a file to write", "save the array that is returned: matplotlib.pyplot.imsave")
        results = options.pop("results", None)
        if isinstance(results, Result):
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder, "results.json")
                results.save(path)
                return self.render(numbers=numbers, results=path, **options)
        given = {**options, "results": results}
        for name, separator in (("position", ","), ("look_at", ","), ("up", ","), ("range", ":")):
            if given.get(name) is not None:
                numbers_of = given[name].split(separator) if isinstance(given[name], str) else _several(given[name], name)
                given[name] = [finite(number, name) for number in numbers_of]
        width, pixels, found = self._load().render(_arguments(given))
        if not numbers:
            return pixels.reshape(-1, width, 3)
        if found is None:
            raise wrong("numbers", "a picture of captors or photons has none", "leave it out, or change `show`")
        width, bands, values = found
        return values.reshape(-1, width, bands)

    def histories(
        self,
        captor: str,
        *,
        face: str | None = None,
        band: str | None = None,
        lines: int | None = None,
        photons: float | None = None,
        seed: int | None = None,
        threads: int | None = None,
        progress: bool | Callable[[int, int | None], object] = False,
    ) -> Histories:
        """Finds on which ways light reaches a captor or a group: from which lamp, by which last surface.

        Args:
            captor: the name of the captor, or of a group of captors.
            face: the face at which light counts: ``"front"``, ``"back"`` or, if not given, all that count light.
            band: the band or sum by which lines are drawn and rows are sorted; if not given, the first sum, or the first
                band.
            lines: the most histories that are kept as lines; 500 if not given.
            photons: number of photons to trace; if not given, that of the scene's settings.
            seed: seed of the random numbers: the same seed gives the same histories.
            threads: number of threads; 0 uses all processors.
            progress: as for `run`.

        >>> scene = Scene("two lamps")
        >>> for name, x, power in (("left", -1, 4), ("right", 1, 1)):
        ...     scene.light(name, type="point", position=[x, 0, 1], power=power)
        >>> scene.captor("sensor", disc={"center": [0, 0, 0], "normal": [0, 0, 1], "radius": 0.1})
        >>> found = scene.histories("sensor", photons=10_000)
        >>> [(group["light"], group["last_surface"], round(group["share"][0], 1)) for group in found.report["groups"]]
        [('left', 'direct', 0.8), ('right', 'direct', 0.2)]
        """
        given = {"to": captor, "face": face, "band": band, "lines": lines, "photons": photons, "seed": seed, "threads": threads}
        return shown.histories(self._load(), given, progress)

    def view(
        self,
        path: str | os.PathLike[str] = "view.html",
        *,
        result: Result | None = None,
        trace: bool = True,
        threads: int | None = None,
        to: str | None = None,
        inline: bool = False,
        width: int | str = "100%",
        height: int = 600,
    ) -> Any:
        """Writes a page that shows the scene and its light in a browser; in a notebook it is shown below the cell.

        Args:
            path: the page to write; it needs no network.
            result: the result of a run of this scene, for the captors; without it the scene is run first.
            trace: False traces no rays: surfaces that are not captors then have no values.
            threads: number of threads; 0 uses all processors.
            to: a captor or a group: the page shows on which ways light reaches it. If not given, it shows that of all
                captors of a scene that has at most 64.
            inline: put the whole page into the notebook (megabytes), and not a link to the file.
            width, height: size of the frame in a notebook, pixels or ``"100%"``.

        Returns:
            a frame of IPython if it is installed, otherwise the path.
        """
        return shown.view(self._load(), Path(path), _found(result), trace, threads, to, inline, width, height)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the scene file, with an OBJ file for each mesh and a CSV file for each table beside it.

        ``phylux run`` with this file gives the same bytes as `run`. Files that the scene names stay where they are.
        Nothing but the scene file is replaced: where a file with other content has the name of a mesh or table, that gets
        another name. Errors: the scene reads the file at ``path``; something cannot be written, and then nothing is.
        """
        self._save(path)

    def _save(self, path: str | os.PathLike[str]) -> dict[str, str]:
        """Saves the scene. Returns the names of the files of its meshes and tables."""
        document, loaded = self._document(), self._load(quiet=True)
        target, new = Path(path), []
        names: dict[str, str] = {}
        # the file that the scene was loaded from is its own
        read = [file for file in loaded.files if not same_file(file, self._path)]
        writers: dict[str, Callable[[Path], object]] = {}
        for key, mesh in self._meshes.items():
            writers[f"mesh:{key}"] = functools.partial(_native.write_obj, mesh=mesh.parts(key))
        for key, table in self._tables.items():
            writers[f"table:{key}"] = functools.partial(Path.write_bytes, data=table)
        try:
            for own, write in writers.items():
                kind, _, key = own.partition(":")
                names[own], is_new = _write_beside(target, key, "obj" if kind == "mesh" else "csv", write)
                new += [target.parent / names[own]] if is_new else []
            moved = _moved(document, names, self._path.parent, target.parent)
            text = json.dumps(moved, indent=2, allow_nan=False, ensure_ascii=False) + "\n"
            _native.write_file(target, text.encode(), read)
        except BaseException:
            for file in new:
                file.unlink(missing_ok=True)
            raise
        return names

    def _control(self, control: Mapping[str, Any] | str | os.PathLike[str], folder: Path) -> Path:
        """Writes a control file into the folder where the scene was saved, and returns its path.

        Its tables are relative to it (or to the working directory), the files of its changes to the scene's file.
        """
        if isinstance(control, Mapping):
            keys, place = plain(control, "control"), Path()
        else:
            keys, place = _read(Path(control)), Path(control).parent
        states = keys.get("states")
        changes = [state.get("changes") if isinstance(state, dict) else None for state in states] if isinstance(states, list) else []
        moved = _moved(keys, {}, place.absolute(), folder)
        for state, own in zip(moved.get("states") or [], changes):
            if own is not None:
                state["changes"] = _moved(own, {}, self._path.parent.absolute(), folder)
        path = folder / "control.json"
        path.write_text(json.dumps(moved), encoding="utf-8")
        return path

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Scene:
        """Reads a scene file. Errors: it cannot be read, or is not JSON; `check` and `run` report errors inside it."""
        place = Path(path)
        scene = cls.__new__(cls)
        scene._keys = _read(place)
        scene._meshes, scene._tables, scene._path, scene._is_read = {}, {}, place, True
        return scene

    def copy(self) -> Scene:
        """Returns a copy of the scene, which can be changed without changing this one. Meshes are shared."""
        scene = type(self).__new__(type(self))
        scene._keys = self._document()
        scene._meshes, scene._tables = dict(self._meshes), dict(self._tables)
        scene._path, scene._is_read = self._path, self._is_read
        return scene

    def _shape(self, name: str, shape: Any, group: str | None = None) -> str:
        if isinstance(shape, (str, os.PathLike)):
            return os.fspath(shape)
        key = _free(name, self._meshes)
        self._meshes[key] = geometry.mesh(shape, name, group)
        return f"mesh:{key}"

    def _table(self, name: str, table: bytes) -> str:
        """Keeps a table of captors or copies, and returns how the scene calls it."""
        key = _free(name, {*self._tables, _WEATHER})
        self._tables[key] = table
        return f"table:{key}"

    def _load(self, quiet: bool = False) -> _native.Loaded:
        text = json.dumps(self._document())
        meshes = [mesh.parts(key) for key, mesh in self._meshes.items()]
        loaded = _native.load(text, self._path, meshes, self._tables, self._is_read)
        if not quiet:
            say(*loaded.warnings)
        return loaded


class Check(str):
    """The text of ``phylux check``; ``.warnings`` is a list of its warnings as sentences, and ``.data`` all that it says as
    the data of ``phylux check --json``: surfaces, objects, lights with their powers, captors, groups."""

    warnings: list[str]
    data: dict[str, Any]
    _text: str

    def __new__(cls, text: str, warnings: list[str], data: str) -> Check:
        check = super().__new__(cls, text + "".join(f"warning: {warning}\n" for warning in warnings))
        check._text, check.warnings, check.data = text, warnings, json.loads(data)
        return check

    def __reduce__(self) -> Any:
        return Check, (self._text, self.warnings, json.dumps(self.data))

    def _repr_html_(self) -> str:
        return html.text(self._text, self.warnings)


def _bands(bands: Any) -> list[Any]:
    if isinstance(bands, Mapping):
        return [{"name": str(name), **_ends(name, ends)} for name, ends in bands.items()]
    found = plain(bands, "bands")
    if not isinstance(found, list) or not all(isinstance(band, (str, dict)) for band in found):
        raise wrong("bands", f"{found!r} are no bands", "give {name: (from_nm, to_nm)} or [name, ...]")
    return [{"name": band} if isinstance(band, str) else band for band in found]


def _ends(name: str, ends: Any) -> dict[str, float]:
    """Returns the ends of a band as a scene file has them; none where a band has no wavelengths."""
    if ends is None:
        return {}
    place = f"bands/{name}"
    try:
        found = [] if isinstance(ends, (str, Mapping)) else [finite(end, place) for end in _several(ends, place)]
    except InputError:
        found = []
    if len(found) != 2:
        raise wrong(place, f"{ends!r} are no ends of a band", "give two wavelengths: (from_nm, to_nm)")
    return {"from_nm": found[0], "to_nm": found[1]}


def _several(values: Any, place: str) -> list[Any]:
    """Returns several values as a list."""
    found = plain(values, place)
    if not isinstance(found, list):
        raise wrong(place, f"{values!r} is one value", "give a list")
    return found


def _readings(readings: Any) -> tuple[bytes, Path]:
    """Returns readings as the bytes of a CSV file, and its path, which stands for `readings` where there is no file."""
    table = columns(readings, "readings")
    if table is not None:
        found = {name: [_cell(value) for value in cells(table[name], f"readings: column {name}")] for name in table}
        return csv_table(found), Path("readings")
    if not isinstance(readings, (str, os.PathLike)):
        raise wrong("readings", f"a {type(readings).__name__}", "give a DataFrame, or the path of a CSV file")
    path = Path(readings)
    return _content(path, "name a file that you may read"), path


def _content(path: Path, remedy: str) -> bytes:
    """Returns the bytes of a file. Errors: it cannot be read; it is a device or a pipe, whose reading may never end."""
    try:
        if path.exists() and not path.is_file():
            raise wrong(str(path), "is not a regular file", remedy)
        return path.read_bytes()
    except OSError as error:
        raise wrong(str(path), f"cannot be read: {error.strerror}", remedy) from None


def _cell(value: Any) -> Any:
    """Returns a value of a table of readings as a text, a number or None."""
    return value if value is None or isinstance(value, (str, float, int)) and not isinstance(value, bool) else str(value)


def _table(discs: Any, name: str, ignore: Sequence[str] = ()) -> bytes:
    """Returns discs as the bytes of a CSV file; columns of a table that are to be ignored are left out."""
    needed = ["x", "y", "z", "radius", "nx", "ny", "nz"]
    ids: dict[str, list[str]] = {}
    table = columns(discs, name)
    if table is not None:
        lacking = [column for column in needed if column not in table]
        if lacking:
            raise wrong(name, f"discs without the column {lacking[0]}", f"they need {', '.join(needed)}")
        other = [column for column in table if column not in (*needed, "id", *ignore)]
        if other:
            remedy = f'leave it out, or give the captor `ignore=["{other[0]}"]`'
            raise wrong(name, f"discs with the column {other[0]}, which says nothing here", remedy)
        if "id" in table:
            found = cells(table["id"], name)
            if None in found:
                raise wrong(name, f"disc {found.index(None)} has no id", "give each one, or leave the column out")
            # an id that files cannot hold as it is would be another one in results
            ids = {"id": [checked(str(id), name, "a disc") for id in found]}
        rows = np.column_stack([numbers(table[column], name, f"discs, column {column},") for column in needed])
    else:
        rows = numbers(discs, name, "discs")
    if rows.ndim != 2 or rows.shape[1] != 7:
        raise wrong(name, f"discs of shape {rows.shape}", "they must be (n, 7): x, y, z, radius, nx, ny, nz")
    return csv_table({**ids, **_columns(rows, needed, name, "disc")})


def _columns(rows: Any, names: Sequence[str], place: str, what: str) -> dict[str, list[float]]:
    """Returns the columns of rows of numbers by name. Error: one of them is not finite."""
    wrongs = ~np.isfinite(rows)
    if wrongs.any():
        row, column = np.argwhere(wrongs)[0]
        raise wrong(place, f"{what} {row}: {names[column]} is {rows[row, column]}, no finite number", "give one, or leave the row out")
    return dict(zip(names, rows.T.tolist(), strict=True))


def _is_table(instances: Any) -> bool:
    """Returns whether copies are numbers or a table, and not the keys of a scene file."""
    if isinstance(instances, (list, tuple)):
        return not all(isinstance(copy, Mapping) for copy in instances)
    return hasattr(instances, "__array__") and np.ndim(instances) > 0 or columns(instances, "instances") is not None


def _copies(instances: Any, name: str) -> bytes:
    """Returns copies as the bytes of a CSV file."""
    placed, matrix = ["x", "y", "z", "turn_deg", "scale"], [f"m{row}{column}" for row in range(3) for column in range(4)]
    table = columns(instances, name)
    if table is not None:
        rows = np.column_stack([numbers(table[column], name, f"instances, column {column},") for column in table])
        return csv_table(_columns(rows, list(table), name, "copy"))
    rows = numbers(instances, name, "instances")
    if rows.shape == (4, 4) and (rows[3] == [0, 0, 0, 1]).all():
        raise wrong(name, "instances that are one matrix", "give a list of matrices, if only of one: shape (1, 4, 4)")
    if rows.ndim == 3 and rows.shape[1:] in ((3, 4), (4, 4)):
        if rows.shape[1] == 4 and not (rows[:, 3] == [0, 0, 0, 1]).all():
            raise wrong(name, "matrices whose last row is not 0 0 0 1", "they must turn, scale, shear and move alone")
        return csv_table(_columns(rows[:, :3].reshape(len(rows), 12), matrix, name, "copy"))
    if rows.ndim != 2 or not 3 <= rows.shape[1] <= 5:
        remedy = "they must be (n, 3): x, y, z; (n, 4) with turn_deg; (n, 5) with scale; (n, 3, 4) or (n, 4, 4): matrices"
        raise wrong(name, f"instances of shape {rows.shape}", remedy)
    return csv_table(_columns(rows, placed[: rows.shape[1]], name, "copy"))


def _place(metadata: Any) -> dict[str, float] | None:
    """Returns the first latitude and longitude in the metadata of a reader of pvlib, which PVGIS has in
    ``inputs`` and ``location``, and NSRDB with capitals."""
    if isinstance(metadata, Mapping):
        named = {str(key).lower(): value for key, value in metadata.items()}
        try:
            return {key: float(named[key]) for key in ("latitude", "longitude")}
        except (KeyError, TypeError, ValueError):
            metadata = tuple(metadata.values())
    if not isinstance(metadata, (tuple, list)):
        return None
    found = (_place(part) for part in metadata if isinstance(part, (Mapping, tuple)))
    return next((place for place in found if place is not None), None)


def _times(table: Any, found: Mapping[str, Any]) -> list[Any]:
    """Returns the times of a table's rows, from the index of pandas or the column of a table without one."""
    index = getattr(table, "index", None)
    of_column = "time" in found and getattr(index, "tz", None) is None
    if of_column:
        times = cells(found["time"], "weather: column time")
    elif index is None:
        raise wrong("weather", "rows without times of a time zone", "give them a column time")
    else:
        times = list(index)
    if not times:
        raise wrong("weather", "a table without rows", "give it those of the hours that are needed")
    if not all(isinstance(time, datetime.datetime) and not is_missing(time) and time.tzinfo is not None for time in times):
        if of_column:
            raise wrong("weather: column time", "is without times of a time zone in some rows", "give each row one")
        raise wrong("weather", "an index without times of a time zone", 'give it one: table.tz_localize("Etc/GMT-1")')
    return times


def _weather(table: Any) -> bytes:
    """Returns the irradiances of a table as the bytes of a CSV file."""
    found = columns(table, "weather")
    if found is None:
        raise wrong("weather", "no DataFrame", "give one, or what a reader of pvlib returns")
    kinds = [column for column in ("ghi", "dni", "dhi") if column in found]
    if not kinds:
        raise wrong("weather", "no column ghi, dni or dhi", "rename the irradiances, or let pvlib do it: map_variables=True")
    times = _times(table, found)
    written: dict[str, list[Any]] = {"time": [time.isoformat() for time in times]}
    for column in kinds:
        place = f"weather: column {column}"
        values = enumerate(cells(found[column], place))
        written[column] = [None if value is None else finite(value, f"{place}, row {i}") for i, value in values]
    return csv_table(written)


def _found(result: Result | None) -> _native.Found | None:
    return None if result is None else result._found


def _free(name: str, taken: Iterable[str]) -> str:
    """Returns the name, with a number after it if it is taken."""
    key, n = name, 1
    while key in taken:
        n += 1
        key = f"{name}~{n}"
    return key


def _write_beside(target: Path, key: str, ending: str, write: Callable[[Path], object]) -> tuple[str, bool]:
    """Writes a file beside the scene file under a name that is free, unless a file with this content is there.

    Returns its name, and whether it is new.
    """
    # other letters have other names in files whose system does not write UTF-8
    letters = str.isalnum if sys.getfilesystemencoding() == "utf-8" else lambda c: c.isascii() and c.isalnum()
    safe = "".join(c if letters(c) or c in "-_.#~" else "_" for c in f"{target.stem}-{key}")
    safe = safe.encode()[:200].decode(errors="ignore")
    try:
        folder = tempfile.TemporaryDirectory(prefix=".phylux-", dir=target.parent)
    except OSError as error:
        raise wrong(str(target), f"cannot be written: {error.strerror}", "write elsewhere") from None
    with folder as unfinished:
        content = Path(unfinished, "content")
        write(content)
        file, n = target.parent / f"{safe}.{ending}", 1
        while not _put(content, file):
            if file.is_file() and filecmp.cmp(content, file, shallow=False):
                return file.name, False
            n += 1
            file = target.parent / f"{safe}~{n}.{ending}"
        return file.name, True


def _put(content: Path, file: Path) -> bool:
    """Gives a complete file its name. Returns whether it was free."""
    if os.path.lexists(file):
        return False
    try:
        os.link(content, file)
    except FileExistsError:
        return False
    except OSError:
        # a system of files without links
        with content.open("rb") as source, file.open("xb") as copy:
            shutil.copyfileobj(source, copy)
    return True


def _moved(value: Any, names: Mapping[str, str], before: Path, after: Path, key: str = "") -> Any:
    """Returns the same keys for a scene file in the folder ``after``: names of files are changed accordingly."""
    if isinstance(value, dict):
        return {own: _moved(entry, names, before, after, own) for own, entry in value.items()}
    if isinstance(value, list):
        return [_moved(entry, names, before, after) for entry in value]
    if isinstance(value, str) and key not in _NAMES:
        if value in names:
            return names[value]
        # every file that a scene names has an ending in its name
        if os.path.splitext(value)[1] and not os.path.isabs(value) and (before / value).is_file():
            try:
                return Path(os.path.relpath(before / value, after)).as_posix()
            except ValueError:
                # another drive
                return (before / value).resolve().as_posix()
    return value


def _read(path: Path) -> dict[str, Any]:
    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        keys = dict(pairs)
        if len(keys) < len(pairs):
            names = [name for name, _ in pairs]
            twice = next(name for name in names if names.count(name) > 1)
            raise wrong(str(path), f"the key `{twice}` stands twice in one object", "leave one of them out")
        return keys

    content = _content(path, "name a scene file (JSON)")
    try:
        keys = json.loads(content, object_pairs_hook=once)
    except (ValueError, RecursionError) as error:
        if hasattr(error, "place"):
            raise
        raise wrong(str(path), f"is no JSON: {error}", "name a scene file (JSON)") from None
    if not isinstance(keys, dict):
        raise wrong(str(path), "is no scene: it holds no object", "name a scene file (JSON)")
    return keys
