"""How light reaches a captor: which lamps and last surfaces it comes from, and some of its ways as lines."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from . import html
from .errors import pandas

_COLUMNS = ["light", "last_surface", "material", "band", "share", "share_se", "flux", "flux_se", "histories"]


class Histories:
    """The histories that bring light to a captor or a group, as `Scene.histories` has found them.

    Attributes:
        to: the captor or the group.
        face: the face at which light counts: ``"front"``, ``"back"`` or ``"both"``.
        band: the band or sum by which lines are drawn.
        photons: number of photons that were traced.
        histories: number of arrivals, each with its way from the lamp.
        report: all that was found, as docs/view.md lists it.
        warnings: sentences to read before you trust the shares.
    """

    def __init__(self, found: str, warnings: list[str]) -> None:
        self.report: dict[str, Any] = json.loads(found)
        self.warnings = warnings
        self.to, self.face, self.band = self.report["to"], self.report["face"], self.report["band"]
        self.photons, self.histories = self.report["photons"], self.report["whole"]["histories"]

    def __repr__(self) -> str:
        return f"<Histories to {self.to}: {self.histories} of {self.photons} photons>"

    def _repr_html_(self) -> str:
        band = next(i for i, band in enumerate(self.report["bands"]) if band["name"] == self.band)
        groups = self.report["groups"]
        rows = [
            (
                group["light"],
                group["last_surface"],
                group.get("material", ""),
                *("" if share is None else f"{100 * share:.3g}" for share in (group["share"][band], group["share_se"][band])),
                str(group["histories"]),
            )
            for group in groups[: html.MOST]
        ]
        heads = ("light", "last surface", "material", f"share of {self.band}, %", "standard error, %", "histories")
        return html.table(f"How light reaches {self.to}", heads, rows, len(groups), self.warnings)

    @property
    def frame(self) -> Any:
        """A tidy pandas DataFrame with a row for each light, last surface and band: light, last_surface (the object that
        scattered or mirrored the light last, or ``"direct"``), material, band, share (in [0, 1]) with share_se, flux with
        flux_se, histories. The shares of a band add up to 1; the largest of the band of the lines come first."""
        return self._table("groups", _COLUMNS)

    @property
    def by_light(self) -> Any:
        """The same by light alone, with errors of its own."""
        return self._table("by_light", [name for name in _COLUMNS if name not in ("last_surface", "material")])

    @property
    def by_surface(self) -> Any:
        """The same by last surface alone, with errors of its own."""
        return self._table("by_surface", [name for name in _COLUMNS if name != "light"])

    @property
    def lines(self) -> list[dict[str, Any]]:
        """Some histories, each drawn with a chance in proportion to what it brings in `band`, so that each stands for about
        the same light: light, last_surface, material (None for direct light), captor, face, points (n, 3) in m (on the
        lamp, or where light from afar comes into the scene; on each surface; on the captor) and met, the object and the
        material of each surface between."""
        lines = self.report["lines"]
        return [{**line, "material": line.get("material"), "points": np.array(line["points"])} for line in lines]

    def _table(self, key: str, columns: list[str]) -> Any:
        numbers = ("share", "share_se", "flux", "flux_se")
        rows = [
            {**part, "material": part.get("material", ""), "band": band["name"], **{name: part[name][i] for name in numbers}}
            for part in self.report[key]
            for i, band in enumerate(self.report["bands"])
        ]
        frame = pandas().DataFrame(rows, columns=columns)
        return frame.astype(dict.fromkeys(numbers, float))
