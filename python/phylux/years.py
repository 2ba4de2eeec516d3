"""Daylight by the hour: runs ``phylux year`` and reads its tables."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from .commands import command
from .commands import pandas as _pandas
from .errors import missing, wrong

#: columns of numbers that may be missing
_NUMBERS = ["x", "y", "z", "nx", "ny", "nz", "standard_error", "back", "back_se", "absorbed", "absorbed_se", "sunlit", "sunlit_se", "kwh", "front", "front_se"]


class Year:
    """The light that every captor and group receives hour by hour, and its integrals over days, months and the period.

    ``value`` is the light on the front; ``back`` and ``absorbed`` are those of leaves, and ``sunlit`` is the fraction of
    the area that sees the sun. Each has its standard error (``back_se``, ...), and is missing where it does not exist.

    The tables are files in ``folder`` (docs/year.md). Each is read when it is used, which needs pandas.
    """

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self.folder = Path(folder)

    def __repr__(self) -> str:
        return f"<Year in {self.folder}>"

    @property
    def hours(self) -> Any:
        """Irradiance, or PPFD for scenes in umol/s: captor, time (start of the hour), band, value, standard_error, back, absorbed, sunlit."""
        whole = self.folder / "hours.parquet"
        return _pandas().read_parquet(whole) if whole.is_file() else self._table("hours")

    @property
    def days(self) -> Any:
        """Daily light integrals: captor, day, band, unit, value, standard_error, back, absorbed, sunlit."""
        return self._table("days")

    @property
    def months(self) -> Any:
        """Daily light integrals, averaged over the days of each month: captor, month, band, unit, value,
        standard_error, back, absorbed, sunlit."""
        return self._table("months")

    @property
    def total(self) -> Any:
        """Daily light integrals, averaged over the whole period: captor, period, band, unit, value, standard_error, back, absorbed, sunlit."""
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
    def captors(self) -> Any:
        """Captors and groups: captor, kind, x, y, z, nx, ny, nz, area, groups."""
        return self._table("captors")

    def plot(self, kind: str = "months", **options: Any) -> Any:
        """Draws with matplotlib and returns the axes; `phylux.plots` has the options of each kind.

        Args:
            kind: ``"months"`` or ``"days"`` (daily light integrals with error bars, a line for each captor or group),
                ``"hours"`` (the hours of one captor in colours, over days and hours of the day).
        """
        from . import plots

        if kind == "hours":
            return plots.year_carpet(self.hours, **options)
        if kind not in ("months", "days"):
            raise wrong("kind", f"no plot `{kind}`", "there are months, days, hours")
        return plots.year_bars(self.months if kind == "months" else self.days, column=kind[:-1], **options)

    def xarray(self) -> Any:
        """Returns the hours as an ``xarray.Dataset``: ``front``, ``back``, ``absorbed`` and their ``_se`` by time, captor
        and band, and ``sunlit`` by time and captor."""
        try:
            import xarray as xr
        except ImportError:
            raise missing("xarray", "a dataset") from None
        hours = self.hours.rename(columns={"value": "front", "standard_error": "front_se"})
        order = {key: list(dict.fromkeys(hours[key])) for key in ("time", "captor", "band")}
        shape = tuple(len(names) for names in order.values())
        dims = tuple(order)
        data = {name: (dims, hours[name].to_numpy(dtype=float).reshape(shape)) for name in hours.columns[3:]}
        for name in ("sunlit", "sunlit_se"):
            data[name] = (dims[:2], data[name][1][..., 0])
        order["time"] = _pandas().to_datetime(order["time"]).tz_localize(None)
        return xr.Dataset(data, coords=order)

    def _table(self, name: str) -> Any:
        # a captor may be named "NA", which must not be read as a missing value
        return _pandas().read_csv(self.folder / f"{name}.csv", keep_default_na=False, na_values={column: [""] for column in _NUMBERS})


def run_year(scene: Path, output: Path, options: list[str]) -> tuple[Year, list[str]]:
    """Runs ``phylux year``. Returns its tables and its warnings."""
    warned = command("year", [scene], ["-o", os.fspath(output), *options])
    return Year(output), warned
