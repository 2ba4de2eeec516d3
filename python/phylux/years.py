"""Daylight by the hour: runs ``phylux year`` and reads its tables."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np

from .commands import command
from .commands import pandas as _pandas
from .errors import missing
from .result import Result

#: columns of text in the tables
_TEXTS = ["captor", "time", "day", "month", "period", "unit", "light", "state", "kind", "groups", "ratio"]


class Year:
    """The light that every captor and group receives hour by hour, and its integrals over days, months and the period.

    The tables have a row for each captor or group and time. For each band there are columns such as ``PAR_front``,
    ``PAR_back`` and ``PAR_absorbed``, as far as any captor counts these, each with its standard error
    (``PAR_front_se``); ``sunlit`` is the fraction of the area that sees the sun. What a captor does not count is missing.

    The tables are files in ``folder`` (docs/year.md). Each is read when it is used, which needs pandas.
    """

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self.folder = Path(folder)

    def __repr__(self) -> str:
        return f"<Year in {self.folder}>"

    @property
    def hours(self) -> Any:
        """Irradiance, or PPFD for scenes in umol/s: captor, time (start of the hour), and values by band."""
        return self._table("hours")

    @property
    def days(self) -> Any:
        """Daily light integrals: captor, day, unit, and values by band."""
        return self._table("days")

    @property
    def months(self) -> Any:
        """Daily light integrals, averaged over the days of each month: captor, month, unit, and values by band."""
        return self._table("months")

    @property
    def total(self) -> Any:
        """Daily light integrals, averaged over the whole period: captor, period, unit, and values by band."""
        return self._table("year")

    @property
    def lamps(self) -> Any:
        """Operation of the lamps: light, month (or ``all``), hours, kwh."""
        return self._table("lamps")

    @property
    def states(self) -> Any:
        """When the states of the control file held: state, month (or ``all``), hours."""
        return self._table("states")

    @property
    def ratios(self) -> Any:
        """Ratios of the light of each day, each month and the whole period (``all``): captor, period, ratio, front,
        front_se, back, absorbed."""
        return self._table("ratios")

    @property
    def hour_ratios(self) -> Any:
        """Ratios of the light of each hour: captor, time, ratio, front, front_se, back, absorbed. Written where the scene
        has ratios."""
        return self._table("hour-ratios")

    @property
    def captors(self) -> Any:
        """Captors and groups: captor, kind, x, y, z, nx, ny, nz, area, groups."""
        return self._table("captors")

    @property
    def facts(self) -> dict[str, Any]:
        """How the light was found: scene, seed, photons, period, bands, units, warnings."""
        found: dict[str, Any] = json.loads((self.folder / "year.json").read_text(encoding="utf-8"))
        return found

    def result(self, month: str | None = None) -> Result:
        """Returns the mean light of a month such as ``"2025-06"``, or of the whole period, as a `Result`; the year was made
        with ``results=True``."""
        return Result.load(self.folder / f"results-{month or 'all'}.json")

    def plot(self, path: str | os.PathLike[str], **options: Any) -> None:
        """Draws the year as SVG or PNG: months (``show="months"``), hours over days (``"carpet"``), a ``"day"``, or with
        ``results=True`` a ``"map"``, ``"profile"`` or ``"plants"`` of a ``month``.

        Args:
            path: the picture; its ending decides on the format.
            options: those of ``phylux plot`` (docs/plot.md): ``show``, ``band``, ``captors``, ``quantity``, ``day``,
                ``month``, ``range=(low, high)``.
        """
        given: list[str] = []
        for name, value in options.items():
            # several captors have an option each
            values = value if name == "captors" and isinstance(value, (list, tuple)) else [value]
            for one in values:
                text = ":".join(str(end) for end in one) if name == "range" else str(one)
                given += [f"--{name.replace('_', '-')}", text]
        command("plot", [self.folder], ["-o", os.fspath(path), *given])

    def xarray(self, table: str = "hours") -> Any:
        """Returns ``"hours"``, ``"days"`` or ``"months"`` as an ``xarray.Dataset``: ``front``, ``back``, ``absorbed`` and
        their ``_se`` by time, captor and band, and ``sunlit`` by time and captor."""
        try:
            import xarray as xr
        except ImportError:
            raise missing("xarray", "a dataset") from None
        frame = getattr(self, table)
        time = frame.columns[1]
        numbers = [name for name in frame.columns if name not in _TEXTS]
        bands = [name.removesuffix("_front") for name in numbers if name.endswith("_front")]
        order = {"time": list(dict.fromkeys(frame[time])), "captor": list(dict.fromkeys(frame.captor))}
        shape = tuple(len(names) for names in order.values())
        values = {name: frame[name].to_numpy(dtype=float).reshape(shape) for name in numbers}
        data: dict[str, Any] = {name: (("time", "captor"), values[name]) for name in ("sunlit", "sunlit_se")}
        for face in ("front", "back", "absorbed"):
            for name in (face, f"{face}_se"):
                if f"{bands[0]}_{name}" in values:
                    stacked = np.stack([values[f"{band}_{name}"] for band in bands], axis=-1)
                    data[name] = (("time", "captor", "band"), stacked)
        coords: dict[str, Any] = {**order, "band": bands}
        coords["time"] = _pandas().to_datetime(coords["time"]).tz_localize(None)
        return xr.Dataset(data, coords=coords)

    def _table(self, name: str) -> Any:
        if not (self.folder / "year.json").is_file():
            raise FileNotFoundError(f"{self.folder} holds no whole year: run `phylux year` again")
        whole = self.folder / f"{name}.parquet"
        if whole.is_file():
            return _pandas().read_parquet(whole)
        # a captor may be named "NA", which must not be read as a missing value
        path = self.folder / f"{name}.csv"
        heads = _pandas().read_csv(path, nrows=0).columns
        empty = {column: [""] for column in heads if column not in _TEXTS}
        return _pandas().read_csv(path, keep_default_na=False, na_values=empty)


def run_year(scene: Path, output: Path, options: list[str]) -> tuple[Year, list[str]]:
    """Runs ``phylux year``. Returns its tables and its warnings."""
    warned = command("year", [scene], ["-o", os.fspath(output), *options])
    return Year(output), warned


def run_shards(
    scene: Path, output: Path, options: list[str], style: list[str], shards: int, executor: Any
) -> tuple[Year, list[str]]:
    """Runs the shards of ``phylux year`` by an executor, and merges them with plots in the style that options name.

    All workers see the folder of ``scene``.
    """
    files = [scene.parent / f"shard{i + 1}" for i in range(shards)]
    shares = [["-o", os.fspath(file), *options, "--shard", f"{i + 1}/{shards}"] for i, file in enumerate(files)]
    for done in [executor.submit(command, "year", [scene], share) for share in shares]:
        done.result()
    return Year(output), command("merge", files, ["-o", os.fspath(output), *style])
