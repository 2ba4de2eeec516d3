"""Daylight by the hour: finds a year and reads its tables."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from . import _native, html
from .errors import missing, say, wrong
from .errors import pandas as _pandas
from .result import OWN, Result
from .values import arguments as _arguments
from .values import span, texts

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
        given = dict(options)
        if given.get("captors") is not None:
            given["captors"] = texts(given["captors"], "captors")
        if given.get("range") is not None:
            given["range"] = span(given["range"].split(":") if isinstance(given["range"], str) else given["range"], "range")
        say(*_native.plot(self.folder, path, _arguments(given)))

    def xarray(self, table: str = "hours") -> Any:
        """Returns ``"hours"``, ``"days"`` or ``"months"`` as an ``xarray.Dataset``: ``front``, ``back``, ``absorbed`` and
        their ``_se`` by time, captor and band, and ``sunlit`` by time and captor, with units.

        ``time`` is the start of each hour in UTC, which no change of clocks doubles; the coordinate ``local_time`` is what
        the clock shows then, and ``utc_offset`` how far that is ahead, h. Of days and months, ``time`` is the date.
        """
        try:
            import xarray as xr
        except ImportError:
            raise missing("xarray", "a dataset") from None
        if table not in ("hours", "days", "months"):
            raise wrong("table", f"no table `{table}`", "there are hours, days and months")
        frame, facts = getattr(self, table), self.facts
        numbers = [name for name in frame.columns if name not in _TEXTS]
        bands = [name.removesuffix("_front") for name in numbers if name.endswith("_front")]
        times, captors = (list(dict.fromkeys(frame[name].astype(str))) for name in (frame.columns[1], "captor"))
        shape = (len(times), len(captors))
        values = {name: frame[name].to_numpy(dtype=float).reshape(shape) for name in numbers}
        if "unit" in frame:
            units = list(dict.fromkeys(frame["unit"].astype(str)))
        else:
            own = {band["name"]: band.get("unit") for band in facts["bands"]}
            units = [(own.get(band) or facts["unit"])["irradiance"] for band in bands]
        units = units[:1] if len(set(units)) == 1 else units
        data: dict[str, Any] = {}
        for name in (name for name in values if name in OWN):
            data[name] = (("time", "captor"), values[name], _attributes(name, "1"))
        for face in ("front", "back", "absorbed"):
            for name in (face, f"{face}_se"):
                if f"{bands[0]}_{name}" in values:
                    stacked = np.stack([values[f"{band}_{name}"] for band in bands], axis=-1)
                    data[name] = (("time", "captor", "band"), stacked, _attributes(name, units[0] if len(units) == 1 else None))
        coords: dict[str, Any] = {**_clock(times, table), "captor": captors, "band": bands}
        if len(units) == len(bands) > 1:
            # sums in units of their own say them band by band
            coords["unit"] = ("band", units)
        about = {name: facts[name] for name in ("scene", "phylux", "seed", "photons", "from")}
        return xr.Dataset(data, coords, {**about, "table": table})

    def _repr_html_(self) -> str:
        try:
            facts = self.facts
        except (OSError, ValueError):
            return html.text(repr(self))
        rows = [(name, str(facts[name])) for name in ("scene", "from", "hours", "photons", "seed") if name in facts]
        return html.table(repr(self), ("", ""), rows, len(rows), list(facts.get("warnings", ())))

    def _table(self, name: str) -> Any:
        if not (self.folder / "year.json").is_file():
            raise FileNotFoundError(f"{self.folder} holds no whole year: make it again with `Scene.year`")
        whole = self.folder / f"{name}.parquet"
        if whole.is_file():
            return _pandas().read_parquet(whole)
        # a captor may be named "NA" or "007", which is neither a missing value nor a number
        path = self.folder / f"{name}.csv"
        heads = _pandas().read_csv(path, nrows=0).columns
        empty = {column: [""] for column in heads if column not in _TEXTS}
        named = {column: str for column in heads if column in _TEXTS}
        table = _pandas().read_csv(path, keep_default_na=False, na_values=empty, dtype=named)
        for column in named:
            # an apostrophe stands before what a spreadsheet would run as a formula
            table[column] = table[column].str.removeprefix("'")
        return table


def _attributes(name: str, unit: str | None) -> dict[str, str]:
    """Returns the attributes of an array of a year."""
    error = {"long_name": f"standard error (1 sigma) of {name[:-3]}"} if name.endswith("_se") else {}
    return {**({} if unit is None else {"units": unit}), **error}


def _clock(times: list[str], table: str) -> dict[str, Any]:
    """Returns the coordinates of time: of hours in UTC, with what the clock shows."""
    pd = _pandas()
    if table != "hours":
        return {"time": ("time", pd.to_datetime(times).to_numpy(), {"long_name": "date by the clock of the hours"})}
    moments = [pd.Timestamp(time) for time in times]
    offsets = [moment.utcoffset() for moment in moments]
    local = pd.DatetimeIndex([moment.tz_localize(None) for moment in moments])
    utc = local - pd.TimedeltaIndex([pd.Timedelta(offset or 0) for offset in offsets])
    hours = np.array([0.0 if offset is None else offset.total_seconds() / 3600 for offset in offsets])
    return {
        "time": ("time", utc.to_numpy(), {"long_name": "start of the hour, UTC"}),
        "local_time": ("time", local.to_numpy(), {"long_name": "start of the hour by the clock"}),
        "utc_offset": ("time", hours, {"units": "h", "long_name": "how far the clock is ahead of UTC"}),
    }


def find(
    scene: Path,
    control: Path | None,
    output: Path,
    arguments: str,
    style: str = "{}",
    checkpoint: Path | None = None,
    shard: str | None = None,
    light: str | os.PathLike[str] | None = None,
    progress: Callable[[int, int | None], object] | None = None,
) -> list[str]:
    """Finds a year, or does the work of a shard of it; with ``light``, from the light in that folder. Returns the warnings."""
    return _native.year(scene, control, output, arguments, style, checkpoint, shard, light, progress)


def find_by_shards(
    scene: Path,
    control: Path | None,
    output: Path,
    arguments: str,
    style: str,
    checkpoint: Path | None,
    shards: int,
    executor: Any,
) -> list[str]:
    """Lets an executor do the shards of a year, and merges them. Returns the warnings.

    All workers see the folder of ``scene``.
    """
    files = [scene.parent / f"shard{i + 1}" for i in range(shards)]
    work = []
    for i, file in enumerate(files):
        kept = None if checkpoint is None else checkpoint.with_name(f"{checkpoint.name}-{i + 1}")
        work.append(executor.submit(find, scene, control, file, arguments, "{}", kept, f"{i + 1}/{shards}"))
    for done in work:
        done.result()
    return _native.merged_year(files, output, style)
