"""Daylight by the hour: runs ``phylux year`` and reads its tables."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

from .errors import InputError, RunError, missing

#: the command, run in a way that does not need its installed script to be on the PATH
_COMMAND = [sys.executable, "-c", "import sys; from phylux import _cli; sys.exit(_cli())"]

#: columns of numbers that may be missing
_NUMBERS = ["x", "y", "z", "nx", "ny", "nz", "standard_error", "back", "back_se", "absorbed", "absorbed_se", "sunlit", "sunlit_se", "kwh"]


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
    def captors(self) -> Any:
        """Captors and groups: captor, kind, x, y, z, nx, ny, nz, area, groups."""
        return self._table("captors")

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
    """Runs ``phylux year`` in a separate process, which Ctrl-C ends too. Returns its tables and its warnings.

    In messages, the scene's file and the file of the lamps' control beside it are called ``scene`` and ``control``.
    """
    done = subprocess.run([*_COMMAND, "year", os.fspath(scene), "-o", os.fspath(output), *options], capture_output=True, text=True, stdin=subprocess.DEVNULL)
    lines = re.sub(re.escape(os.fspath(scene.parent)) + r"/(\w+)\.json", r"\1", done.stderr).splitlines()
    said = {kind: [line.removeprefix(kind) for line in lines if line.startswith(kind)] for kind in ("error: ", "warning: ")}
    if done.returncode != 0:
        sentence = (said["error: "] or [done.stderr.strip() or f"phylux year ended with {done.returncode}"])[-1]
        # the place is a file with a JSON pointer or a line in it, or an option
        found = re.match(r"[^:]+: /[^:]*(?=: )|[^:]+:\d+(?=: )", sentence)
        option = re.search(r"'--([\w-]+)", sentence)
        if option is not None and found is None:
            place = option[1].replace("-", "_")
            known = re.search(r"\[possible values: (.*)\]", done.stderr)
            sentence = f"{place}: {sentence}" + (f"; there are {known[1]}" if known is not None else "")
        else:
            place = found[0] if found is not None else sentence.split(": ")[0]
        raise (InputError if done.returncode == 2 else RunError)(sentence, place)
    return Year(output), said["warning: "]


def _pandas() -> Any:
    try:
        import pandas as pd
    except ImportError:
        raise missing("pandas", "a table") from None
    return pd
