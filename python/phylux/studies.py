"""What studies of a scene find: calibrations, comparisons of results, charts of errors against costs."""

from __future__ import annotations

import copy
import json
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _native, html
from .errors import pandas

if TYPE_CHECKING:
    from .scene import Scene


@dataclass(frozen=True)
class Calibration:
    """The powers of lamps that `Scene.calibrate` has found.

    Attributes:
        report: all that was found, as docs/calibration.md lists it.
        scene: the scene with these powers.
        warnings: sentences to read before you trust the powers.
    """

    report: dict[str, Any]
    scene: Scene
    warnings: list[str]
    _read: Sequence[Path] = field(default=(), repr=False)

    @property
    def factors(self) -> dict[str, list[float]]:
        """For each light, the factor on its power in each band."""
        return copy.deepcopy(dict(self.report["factors"]))

    @property
    def factors_se(self) -> dict[str, list[float | None]] | None:
        """Standard errors of `factors`; None for the powers that light captors evenly."""
        found: dict[str, list[float | None]] | None = self.report.get("factors_se")
        return found

    @property
    def readings(self) -> Any:
        """A DataFrame of the readings: captor, face, band, use, measured, simulated, calibrated, low, high (the ends of
        the 95 % interval), leverage. It has no rows for the powers that light captors evenly."""
        columns = ["captor", "face", "band", "use", "measured", "simulated", "calibrated", "low", "high", "leverage"]
        rows = [{**reading, **dict(zip(("low", "high"), reading["interval"]))} for reading in self.report.get("readings", [])]
        return pandas().DataFrame(rows, columns=columns)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the report (JSON), which ``phylux mix --calibration`` reads. Error: the scene or the readings are in the
        file at ``path``."""
        _native.write_file(os.fspath(path), (json.dumps(self.report, indent=2) + "\n").encode(), list(self._read))

    def _repr_html_(self) -> str:
        errors = self.factors_se or {}
        rows = [
            (name, ", ".join(f"{value:.4g}" for value in factors), ", ".join("" if e is None else f"{e:.2g}" for e in errors.get(name, [])))
            for name, factors in self.factors.items()
        ]
        heads = ("light", "factors", "standard errors")
        return html.table("Calibration", heads, rows[: html.MOST], len(rows), self.warnings)


class Comparison:
    """The values of two results a and b side by side; its text is that of ``phylux compare``.

    Attributes:
        agrees: whether both have the same captors, and no value differs by more than chance explains.
        limit: the \\|z\\| that chance exceeds anywhere among the values with odds below 1/1000.
        unmatched: the values that only one of the results has.
        few_paths: number of common values that are left out because their errors say little.
        dependent: whether both have the same estimator and seed, and so share random numbers: z is then too small.
    """

    def __init__(self, found: tuple[str, str, list[str], int, float, bool, bool]) -> None:
        text, values, self.unmatched, self.few_paths, self.limit, self.agrees, self.dependent = found
        self._text = text
        self._values: list[dict[str, Any]] = json.loads(values)

    def __str__(self) -> str:
        return self._text

    def __repr__(self) -> str:
        return f"<Comparison of {len(self._values)} values: {'they agree' if self.agrees else 'they differ'}>"

    def _repr_html_(self) -> str:
        return html.text(self._text)

    @property
    def frame(self) -> Any:
        """A DataFrame of the values, worst first: captor, what (``front`` or ``back``, the irradiance of that face, or
        ``absorbed``), band, a, b, z (the difference over its standard error, NaN where that is not known)."""
        return pandas().DataFrame(self._values, columns=["captor", "what", "band", "a", "b", "z"])


class Chart:
    """The error of each estimator against its cost, as `Scene.chart` has found it.

    The charts and their numbers are files in ``folder``; ``pictures`` has the paths of the charts.
    """

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self.folder = Path(folder)

    def __repr__(self) -> str:
        return f"<Chart in {self.folder}>"

    def _repr_html_(self) -> str:
        names = [picture.name for picture in self.pictures] if self.folder.is_dir() else []
        return html.text("\n".join([repr(self), *names]))

    @property
    def rows(self) -> Any:
        """A DataFrame with a row for each run, as docs/accuracy.md explains it."""
        return pandas().read_csv(self.folder / "rows.csv", keep_default_na=False, na_values=[""], dtype={"estimator": str})

    @property
    def study(self) -> dict[str, Any]:
        """All that was found."""
        found: dict[str, Any] = json.loads((self.folder / "study.json").read_bytes())
        return found

    @property
    def pictures(self) -> Sequence[Path]:
        """The charts, SVG or PNG."""
        return sorted(path for path in self.folder.iterdir() if path.suffix in (".svg", ".png"))
