"""The results of a run: numpy arrays, tables, labelled arrays, files."""

from __future__ import annotations

import copy
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from . import _native, html, plots, shown
from .errors import pandas as _pandas
from .errors import missing, wrong
from .histories import Histories
from .studies import Calibration, Comparison
from .values import finite, plain, text, texts

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

FACES = ("front", "back")
_NOT_SPLIT, _SPLIT = "these results are not split by light", "run the scene with by_light=True"
_NO_SCENE = "results from a file know no scene"
_Array = TypeVar("_Array", bound=npt.NDArray[Any])


class _Quantity(NamedTuple):
    """An entry of the registry of quantities."""

    #: name in tables
    name: str
    #: name of arrays
    array: str
    #: what it has a value for: ``band`` (or sum), ``ratio``, or nothing but the captor
    per: str
    #: key of its unit; empty for shares and ratios
    unit: str
    #: whether it has a value for each face
    of_faces: bool
    #: whether all results have it
    always: bool
    #: whether it is known by its name alone
    own: bool
    #: part of the table in which it stands
    part: int | None


_QUANTITIES = [_Quantity(*entry) for entry in _native.quantities()]
#: arrays of quantities that are known by their names alone
OWN = {f"{quantity.array}{ending}" for quantity in _QUANTITIES if quantity.own for ending in ("", "_se")}


@dataclass(frozen=True)
class Values:
    """The light that captors (or groups) received, as read-only arrays; NaN where there is no value.

    The second index is the face: 0 is the front, which light meets against the normal, and 1 is the back. The last
    index is the band, in the order of `Result.bands`: the bands, then the sums over bands. Arrays with the ending
    ``_se`` are standard errors, 1 sigma.

    Attributes:
        ids: names of the captors or groups.
        area: (n,), area of one side, m2.
        flux, flux_se: (n, 2, bands), power that arrived, W or umol/s.
        irradiance, irradiance_se: (n, 2, bands), flux per area, W/m2 or umol/m2/s.
        photons: (n, 2), number of photons counted.
        absorbed, absorbed_se: (n, bands), power that surfaces absorbed, both faces together, W or umol/s.
        has_back: (n,), whether light on the back is counted.
        ratios, ratios_se: (n, 2, ratios), ratios of the light that arrived, in the order of `Result.ratios`; None except
            in scenes with ``ratios``.
        absorbed_ratios, absorbed_ratios_se: (n, ratios), the same of the light that surfaces absorbed.
        absorbed_by_face, absorbed_by_face_se: (n, 2, bands), what surfaces absorbed of the light on each face; None except
            in scenes with ``absorbed_by_face``.
        dli, dli_se: (n, 2, bands), daily light integral, mol/m2/d; None except in scenes in umol/s over a period.
        flux_model_se, irradiance_model_se, absorbed_model_se, ratios_model_se, absorbed_ratios_model_se: standard deviations
            by uncertain inputs, in the shape of the values; None except in scenes with ``uncertain``.
        more: further quantities of captors or groups by their names in docs/results.md, with ``_se``: (n,). Each is an
            attribute, too, which is None where the results do not have it.
    """

    ids: list[str]
    area: Floats
    flux: Floats
    flux_se: Floats
    irradiance: Floats
    irradiance_se: Floats
    photons: Ints
    absorbed: Floats
    absorbed_se: Floats
    has_back: npt.NDArray[np.bool_]
    dli: Floats | None = None
    dli_se: Floats | None = None
    ratios: Floats | None = None
    ratios_se: Floats | None = None
    absorbed_ratios: Floats | None = None
    absorbed_ratios_se: Floats | None = None
    absorbed_by_face: Floats | None = None
    absorbed_by_face_se: Floats | None = None
    flux_model_se: Floats | None = None
    irradiance_model_se: Floats | None = None
    absorbed_model_se: Floats | None = None
    ratios_model_se: Floats | None = None
    absorbed_ratios_model_se: Floats | None = None
    more: Mapping[str, Floats] = field(default_factory=dict)

    def __getattr__(self, name: str) -> Floats | None:
        if name in OWN:
            return self.more.get(name)
        raise AttributeError(f"no quantity `{name}`", name=name, obj=self)

    def __len__(self) -> int:
        return len(self.ids)

    def take(self, rows: Any) -> Values:
        """Returns the rows with these indices; the index -1 gives a row without values (NaN, and 0 for counts)."""
        index = np.asarray(rows, dtype=np.intp)
        known = index >= 0

        def take(values: Any) -> Any:
            taken = values[index]
            taken[~known] = np.nan if taken.dtype.kind == "f" else 0
            return _fixed(taken)

        more = {name: take(values) for name, values in self.more.items()}
        arrays = {name: take(getattr(self, name)) for name in _FIELDS if getattr(self, name) is not None}
        return Values([self.ids[i] if i >= 0 else "" for i in index.tolist()], **arrays, more=more)


#: arrays that `Values` names
_FIELDS = [one.name for one in fields(Values) if one.name not in ("ids", "more")]


class Result:
    """The results of a run.

    Arrays have the indices captor, face (front, back) and band, as in `Values`; ``ids``, ``faces`` and ``bands`` name
    their entries. Lengths are in metres, flux is in W or umol/s, irradiance is flux per m2: see ``unit``.
    """

    faces = FACES

    def __init__(self, found: _native.Found, loaded: _native.Loaded | None = None) -> None:
        self._found = found
        self._loaded = loaded
        self._head: dict[str, Any] = json.loads(found.head)

    # --- the run

    @property
    def scene(self) -> str:
        """The name of the scene."""
        return str(self._head["scene"])

    @property
    def photons(self) -> int:
        """Number of photons traced, or of paths over all captors."""
        return int(self._head["photons"])

    @property
    def photons_beside(self) -> int:
        """Number of photons traced beside complete paths; 0 for other estimators."""
        return int(self._head.get("photons_beside", 0))

    @property
    def seed(self) -> int:
        """Seed of the random numbers."""
        return int(self._head["seed"])

    @property
    def estimator(self) -> str:
        """The estimator: ``photons``, ``paths`` or ``complete``."""
        return str(self._head["estimator"])

    @property
    def unit(self) -> dict[str, str]:
        """Names of the units: ``length``, ``flux``, ``irradiance``, ``radiance``."""
        return dict(self._head["unit"])

    @property
    def bands(self) -> list[str]:
        """Names of the bands, then of the sums over bands."""
        return [band["name"] for band in self._head["bands"]]

    @property
    def ratios(self) -> list[str]:
        """Names of the ratios of sums over bands; empty where the scene has none."""
        return [ratio["name"] for ratio in self._head.get("ratios", [])]

    @property
    def energy(self) -> dict[str, Any]:
        """Balance of the power, per band: emitted = absorbed + escaped + lost; see docs/results.md."""
        return copy.deepcopy(dict(self._head["energy"]))

    @property
    def electricity(self) -> dict[str, Any] | None:
        """What the light costs and where it goes, in scenes with ``watts`` of lights; see docs/results.md."""
        found: dict[str, Any] | None = copy.deepcopy(self._head.get("electricity"))
        return found

    @property
    def tolerance(self) -> dict[str, Any] | None:
        """For a run with a tolerance: whether it was ``met``, and the value that is farthest from it; otherwise None."""
        found: dict[str, Any] | None = copy.deepcopy(self._head.get("tolerance"))
        return found

    @property
    def head(self) -> dict[str, Any]:
        """All fields of the results file except ``captors`` and ``groups``."""
        return copy.deepcopy(self._head)

    @property
    def lights(self) -> list[str]:
        """Names of the lights that the results are split by; empty unless the run had ``by_light=True``."""
        return list(self._head["energy"].get("by_light") or {})

    @cached_property
    def _summary(self) -> tuple[str, list[str]]:
        text, warnings = self._found.summary(html.width())
        return text, warnings

    @property
    def warnings(self) -> list[str]:
        """Sentences to read before you trust these results."""
        return list(self._summary[1])

    def __str__(self) -> str:
        return self._summary[0]

    def _repr_html_(self) -> str:
        """A table of the light on groups, or on captors where there is none."""
        values = self.group_values if self._found.ids(True) else self.values
        rows = []
        for i, name in enumerate(values.ids[: html.MOST]):
            for face in range(2 if values.has_back[i] else 1):
                found = zip(values.irradiance[i, face], values.irradiance_se[i, face])
                rows.append((name, FACES[face], *(f"{value:.4g}" + ("" if np.isnan(se) else f" ± {se:.1g}") for value, se in found)))
        heads = ("group" if values is not self.values else "captor", "face", *self.bands)
        title = f"{self!r}: irradiance, {self.unit['irradiance']}"
        return html.table(title, heads, rows, len(values), self.warnings)

    def __repr__(self) -> str:
        return f"<Result of {self.scene!r}: {self.photons} {self.estimator}, {len(self.ids)} captors>"

    # --- arrays

    @property
    def ids(self) -> list[str]:
        """Ids of the captors."""
        return list(self._ids)

    @cached_property
    def _ids(self) -> list[str]:
        return self._found.ids(False)

    @cached_property
    def values(self) -> Values:
        """The light that the captors received."""
        return self._values(False, None)

    @cached_property
    def group_values(self) -> Values:
        """The light that the captors of each group received together, with the standard errors of these sums."""
        return self._values(True, None)

    def light(self, name: str, groups: bool = False) -> Values:
        """Returns what captors, or groups, received from one light alone, in a run with ``by_light=True``."""
        if not self.lights:
            raise wrong(self.scene, _NOT_SPLIT, _SPLIT)
        if name not in self.lights:
            raise wrong(self.scene, f"no light `{name}`", f"there are {', '.join(self.lights)}")
        return self._values(groups, self.lights.index(name))

    @property
    def flux(self) -> Floats:
        """Power that arrived: (captors, 2, bands), W or umol/s."""
        return self.values.flux

    @property
    def flux_se(self) -> Floats:
        """Standard errors of `flux`."""
        return self.values.flux_se

    @property
    def irradiance(self) -> Floats:
        """Flux per area: (captors, 2, bands), W/m2 or umol/m2/s."""
        return self.values.irradiance

    @property
    def irradiance_se(self) -> Floats:
        """Standard errors of `irradiance`."""
        return self.values.irradiance_se

    @property
    def absorbed(self) -> Floats:
        """Absorbed power: (captors, bands), W or umol/s; NaN for virtual captors."""
        return self.values.absorbed

    @property
    def absorbed_se(self) -> Floats:
        """Standard errors of `absorbed`."""
        return self.values.absorbed_se

    @property
    def area(self) -> Floats:
        """Area of one side: (captors,), m2."""
        return self.values.area

    @cached_property
    def _places(self) -> dict[str, npt.NDArray[Any]]:
        return self._found.places()

    @property
    def center(self) -> Floats:
        """Centres of the captors: (captors, 3), m."""
        return _fixed(self._places["center"].reshape(-1, 3))

    @property
    def normal(self) -> Floats:
        """Direction that each front faces: (captors, 3); 0 where the normals of a captor cancel."""
        return _fixed(self._places["normal"].reshape(-1, 3))

    @property
    def is_surface(self) -> npt.NDArray[np.bool_]:
        """Whether each captor is a surface (True) or virtual (False): (captors,)."""
        return _fixed(self._places["surface"].astype(bool))

    @property
    def nearest(self) -> dict[str, Any]:
        """The k-nearest estimates: ``knn_irradiance``, ``knn_radiance`` and their ``_se`` (captors, 2, bands), ``k``,
        ``radius`` (m) and ``coverage`` (captors, 2). The dictionary is empty if there are none."""
        return dict(self._nearest)

    @cached_property
    def _nearest(self) -> dict[str, Any]:
        arrays = self._found.nearest()
        shapes = {name: (-1, 2, len(self.bands)) if name.startswith("knn") else (-1, 2) for name in arrays}
        return {name: _fixed(array.reshape(shapes[name])) for name, array in arrays.items()}

    def triangles(self, name: str) -> Values:
        """Returns the light on the triangles of a group, in their order, for an object with ``captor="triangle"``.

        Args:
            name: ``object/group``, for instances ``object/group#0``; or only the object, if it has one group.

        Triangles without area are not captors; their values are NaN.
        """
        name = text(name, "triangles")
        found = self._triangles.get(name)
        if found is None:
            below = [known for known in self._triangles if known.startswith((f"{name}/", f"{name}#"))]
            if len(below) == 1:
                return self.triangles(below[0])
            known = ", ".join((below or list(self._triangles))[:20])
            remedy = f"there are {known}" if known else 'give the object captor="triangle"'
            raise wrong(self.scene, f"no triangles of `{name}`", remedy)
        rows = np.full(max(found) + 1, -1, dtype=np.intp)
        rows[list(found)] = list(found.values())
        return self.values.take(rows)

    @cached_property
    def _triangles(self) -> dict[str, dict[int, int]]:
        """For each group by name, the index of the captor of each triangle."""
        surface = self.is_surface
        found: dict[str, dict[int, int]] = {}
        for row, id in enumerate(self._ids):
            group, _, number = id.rpartition("/")
            if surface[row] and number.isdecimal() and "/" in group:
                found.setdefault(group, {})[int(number)] = row
        return found

    # --- tables and labelled arrays

    @property
    def frame(self) -> Any:
        """A tidy pandas DataFrame: captor, face, band, quantity, value, standard_error; in scenes with ``uncertain`` also
        model_se, the standard deviation by uncertain inputs. These are the rows of captors in the table of ``--csv``.

        ``quantity`` is flux, irradiance, dli, knn_irradiance, knn_radiance or absorbed, in the units of `unit` (of sums
        with units of their own, in those); of ratios, whose names stand as ``band``, it is ratio or absorbed_ratio;
        ``face`` is missing for absorbed and absorbed_ratio; ``standard_error`` is NaN where it is not known. Names are categories.
        """
        return self._frame.copy()

    @cached_property
    def _frame(self) -> Any:
        return self._tidy("captor", self._ids, {**self._arrays(False, None), **self._nearest})

    @property
    def groups(self) -> Any:
        """A tidy pandas DataFrame of the groups of captors: group, face, band, quantity, value, standard_error.

        The quantities are those of `frame` without the k-nearest estimates, ratios included. Groups of several captors have more:
        ``irradiance_min`` and ``irradiance_max``, the smallest and the largest irradiance among the captors, and
        ``min_over_mean`` and ``cv`` (coefficient of variation), which say how uniform the light is.
        """
        return self._groups.copy()

    @cached_property
    def _groups(self) -> Any:
        return self._tidy("group", self._found.ids(True), self._arrays(True, None))

    def _tidy(self, key: str, ids: list[str], arrays: Mapping[str, Any]) -> Any:
        """Returns the table of these arrays: first what all captors have, then part by part the rest."""
        table = self._first(key, ids, arrays)
        for part in sorted({quantity.part for quantity in _QUANTITIES if quantity.part}):
            found = [quantity for quantity in _QUANTITIES if quantity.part == part and quantity.array in arrays]
            if not found:
                continue
            faces = [face for quantity in found for face in (FACES if quantity.of_faces else (None,))]
            kinds = tuple(quantity.name for quantity in found for _ in range(2 if quantity.of_faces else 1))

            def joined(ending: str, found: list[_Quantity] = found) -> Any:
                count, width = len(ids), self._width(found[0])
                of_faces = (arrays[f"{one.array}{ending}"].reshape(count, 2 if one.of_faces else 1, width) for one in found)
                return np.concatenate(list(of_faces), axis=1)

            names: Sequence[str | None] = {"band": self.bands, "ratio": self.ratios}.get(found[0].per, [None])
            model = joined("_model_se") if f"{found[0].array}_model_se" in arrays else None
            table = _with_rows(table, key, ids, names, kinds, joined(""), joined("_se"), tuple(faces), model)
        return table

    @property
    def layers(self) -> Any:
        """A pandas DataFrame of what surface captors absorbed by layers, from the lowest up; None without layers.

        Columns: from_m, to_m, area (m2, one side), band, absorbed, standard_error, and per_area (absorbed over area); also what else the results know of each layer (docs/results.md), each with ``_se``.
        """
        return None if self._layers is None else self._layers.copy()

    @cached_property
    def _layers(self) -> Any:
        found = self._head.get("layers")
        if found is None:
            return None
        pd = _pandas("a table of layers")
        rows = [
            (layer["from"], layer["to"], layer["area"], band, value, np.nan if se is None else se)
            for layer in found
            for band, value, se in zip(self.bands, layer["absorbed"], layer["absorbed_se"], strict=True)
        ]
        frame = pd.DataFrame(rows, columns=["from_m", "to_m", "area", "band", "absorbed", "standard_error"])
        frame["per_area"] = frame["absorbed"] / frame["area"]
        for name in (f"{quantity.array}{ending}" for quantity in _QUANTITIES if quantity.own for ending in ("", "_se")):
            if any(name in layer for layer in found):
                frame[name] = np.repeat([layer.get(name, np.nan) for layer in found], len(self.bands))
        return frame

    @property
    def sensitivity(self) -> Any:
        """A pandas DataFrame of how much captors and groups depend on materials and lights; None unless the scene asks for it.

        Columns: captor, group (one of both is None), face, parameter, band (or ratio), elasticity (by how many per cent the light or the ratio changes for 1 % more of the parameter), elasticity_se, derivative (change of irradiance, absorbed power or ratio for one unit of the parameter) and derivative_se. What light has never met is left out.
        """
        found = self._head.get("sensitivity")
        if found is None:
            return None
        pd = _pandas("a table of sensitivities")
        values = ["elasticity", "elasticity_se", "derivative", "derivative_se"]
        rows = [
            (of.get("captor"), of.get("group"), of["face"], of["parameter"], band, *numbers)
            for of in found
            for names, part in ((self.bands, of), (self.ratios, of.get("ratios")))
            if part is not None
            for band, *numbers in zip(names, *(part[name] for name in values), strict=True)
        ]
        frame = pd.DataFrame(rows, columns=["captor", "group", "face", "parameter", "band", *values])
        return frame.astype(dict.fromkeys(values, float))

    @property
    def budget(self) -> Any:
        """A pandas DataFrame of how uncertain groups (captors, where there are no groups) are because inputs are, and which inputs make most of it; None unless the scene has ``uncertain``.

        Columns: captor, group (one of both is None), face, band (or ratio), model_se (standard deviation by all uncertain inputs together), rank (0 for the input that makes most of it), parameter, and se, the standard deviation that it makes.
        """
        found = self._head.get("budget")
        if found is None:
            return None
        pd = _pandas("a table of uncertainties")
        rows = [
            (of.get("captor"), of.get("group"), of["face"], of["band"], of["model_se"], rank, by["parameter"], by["se"])
            for of in found
            for rank, by in enumerate(of["largest"])
        ]
        names = ["captor", "group", "face", "band", "model_se", "rank", "parameter", "se"]
        return pd.DataFrame(rows, columns=names)

    @property
    def canopy(self) -> dict[str, dict[str, float]] | None:
        """The shares of the light of sun and sky by band: absorbed, reflected, transmitted, ground, each with `_se`.

        None unless the scene repeats along x and y, has no lamp, and was traced by photons. ``incident`` is the power that comes into one cell. Without a standard error the entry is NaN.
        """
        found = self._head.get("canopy")
        if found is None:
            return None
        number = lambda value: float("nan") if value is None else float(value)  # noqa: E731
        return {name: dict(zip(self.bands, map(number, values), strict=True)) for name, values in found.items()}

    def _first(self, key: str, ids: list[str], arrays: Mapping[str, Any]) -> Any:
        """Returns the table of what arrives on faces and of the absorbed power, by band."""
        pd = _pandas("a DataFrame")
        first = [one for one in _QUANTITIES if one.of_faces and one.per == "band" and not one.part and one.array in arrays]
        cells = [[arrays.get(f"{one.array}{ending}") for ending in ("", "_se", "_model_se")] for one in first]
        count, bands, quantities = len(ids), len(self.bands), [quantity.name for quantity in first]
        width = 2 * bands * len(cells)
        endings = ("", "_se", "_model_se") if "absorbed_model_se" in arrays else ("", "_se")
        absorbed = [arrays[f"absorbed{ending}"] for ending in endings]
        # columns: face, then band, then quantity; after them the absorbed power per band
        numbers = np.empty((len(absorbed), count, width + bands))
        unknown = np.full_like(arrays["flux"], np.nan)
        for which, of_absorbed in enumerate(absorbed):
            of_cells = (cell[which] for cell in cells)
            arrived = np.stack([unknown if array is None else array for array in of_cells], axis=-1)
            numbers[which, :, :width] = arrived.reshape(count, width)
            numbers[which, :, width:] = of_absorbed
        there = ~np.isnan(numbers[0])
        face = np.repeat([0, 1, -1], [width // 2, width // 2, bands])
        band = np.concatenate([np.tile(np.repeat(np.arange(bands), len(cells)), 2), np.arange(bands)])
        quantity = np.concatenate([np.tile(np.arange(len(cells)), 2 * bands), np.full(bands, len(cells))])
        whole = there.all(axis=0)
        if (whole == there.any(axis=0)).all():
            # all entries have the same quantities, so one list of columns serves for all
            picked = np.flatnonzero(whole)
            rows, columns = np.repeat(np.arange(count), len(picked)), np.tile(picked, count)
            found = numbers[:, :, picked].reshape(len(absorbed), -1)
        else:
            rows, columns = np.nonzero(there)
            found = numbers[:, there]

        def categories(codes: Any, names: Sequence[str]) -> Any:
            return pd.Categorical.from_codes(codes, pd.Index(names, dtype="object"))

        table = {
            key: categories(rows.astype(np.int32), ids),
            "face": categories(face.astype(np.int8)[columns], FACES),
            "band": categories(band.astype(np.int16)[columns], self.bands),
            "quantity": categories(quantity.astype(np.int8)[columns], [*quantities, "absorbed"]),
            "value": found[0],
            "standard_error": found[1],
        }
        if len(absorbed) > 2:
            table["model_se"] = found[2]
        return pd.DataFrame(table, copy=False)

    def xarray(self, by_light: bool | None = None) -> Any:
        """Returns a labelled xarray Dataset, which its ``to_netcdf`` saves.

        ``flux``, ``irradiance`` and their ``_se`` have the dimensions captor, face and band; ``photons`` has captor and
        face; ``absorbed`` and its ``_se`` have captor and band. The coordinates ``area``, ``x``, ``y``, ``z``, ``nx``,
        ``ny``, ``nz`` belong to captor, ``from_nm`` and ``to_nm`` to band. The attributes hold the units; where sums have
        units of their own, the coordinates ``flux_unit`` and ``irradiance_unit`` hold those of each band.

        Args:
            by_light: whether the arrays also have the dimension ``light``. If not given, they have it if the run had
                ``by_light=True``. The sum over it is the value for all light; the errors of lights are independent,
                so their squares add up.
        """
        try:
            import xarray as xr
        except ImportError:
            raise missing("xarray", "a labelled array") from None
        split = bool(self.lights) if by_light is None else by_light
        parts = [self.light(name) for name in self.lights] if split else [self.values]
        if split and not parts:
            self.light("")
        unit, units = self.unit, {"length": "m", "area": "m2"}
        last = ("light",) if split else ()

        def stacked(name: str) -> Any:
            arrays = [getattr(part, name) for part in parts]
            return np.stack(arrays, axis=-1) if split else arrays[0]

        there = [one for one in _QUANTITIES if getattr(self.values, one.array, None) is not None]
        # photons stand behind what all faces have
        there.sort(key=lambda one: (not one.always, not one.of_faces and one.always))
        measures: dict[str, str] = {}
        names: dict[str, tuple[str, ...]] = {}
        for one in there:
            if not one.of_faces:
                names.setdefault("photons", ("captor", "face"))
            dims = ("captor", *(["face"] if one.of_faces else []), *([one.per] if one.per else []))
            names |= {one.array: dims, f"{one.array}_se": dims}
            measures |= {f"{one.array}{ending}": one.unit for ending in ("", "_se", "_model_se")}
        names |= {
            f"{name}_model_se": dims
            for name, dims in names.items()
            if not split and getattr(self.values, f"{name}_model_se", None) is not None
        }
        own = [band.get("unit", unit) for band in self._head["bands"]]
        kinds = ("flux", "irradiance") if any("unit" in band for band in self._head["bands"]) else ()
        of_bands = {f"{kind}_unit": ("band", [of[kind] for of in own]) for kind in kinds}
        data = {}
        for name, dims in names.items():
            attributes = {}
            # sums in units of their own say them band by band
            if measures.get(name) and not of_bands:
                attributes["units"] = unit[measures[name]]
            if name.endswith("_model_se"):
                attributes["long_name"] = f"standard deviation of {name[:-9]} by uncertain inputs"
            elif name.endswith("_se"):
                attributes["long_name"] = f"standard error (1 sigma) of {name[:-3]}"
            data[name] = ((*dims, *last), stacked(name), attributes)
        nm = {
            end: ("band", [float(band.get(end, np.nan)) for band in self._head["bands"]], {"units": "nm"})
            for end in ("from_nm", "to_nm")
        }
        center, normal = self.center, self.normal
        places = {name: ("captor", center[:, i], {"units": units["length"]}) for i, name in enumerate("xyz")}
        normals = {name: ("captor", normal[:, i]) for i, name in enumerate(("nx", "ny", "nz"))}
        coords: dict[str, Any] = {
            "captor": self.ids,
            "face": list(FACES),
            "band": self.bands,
            **({"ratio": self.ratios} if self.ratios else {}),
            **({"light": self.lights} if split else {}),
            "area": ("captor", self.area, {"units": units["area"]}),
            **places,
            **normals,
            **nm,
            **of_bands,
        }
        about = {
            "scene": self.scene,
            "phylux": self._head["phylux"],
            "version": self._head["phylux"],
            "seed": self.seed,
            "photons": self.photons,
            "estimator": self.estimator,
            "units": f"flux {unit['flux']}, irradiance {unit['irradiance']}, lengths {unit['length']}",
        }
        return xr.Dataset(data, coords, about)

    def plot(self, kind: str = "map", **options: Any) -> Any:
        """Draws with matplotlib and returns the axes; `phylux.plots` has the options of each kind.

        Args:
            kind: ``"map"`` (sensors over their plane, in colours with contours), ``"profile"`` (means over area at
                each height, with error bars), ``"plants"`` (power absorbed by each plant or, with ``by="rank"``, by
                each rank of leaves, with error bars), ``"canopy"`` (power absorbed by each layer), ``"rank"`` (values of captors in their order, with error bars),
                ``"spectrum"`` (irradiance over the bands), ``"bars"`` (values with error bars by name).
        """
        kinds = {
            "map": plots.captor_map,
            "profile": plots.profile,
            "plants": plots.plants,
            "canopy": plots.canopy,
            "rank": plots.rank,
            "spectrum": plots.spectrum,
            "bars": plots.bars,
        }
        if kind not in kinds:
            raise wrong("kind", f"no plot `{kind}`", f"there are {', '.join(kinds)}")
        return kinds[kind](self, **options)

    # --- other powers, files, pages

    def mix(
        self,
        factors: Mapping[str, float | Sequence[float]] | None = None,
        *,
        calibration: Calibration | str | os.PathLike[str] | None = None,
    ) -> Result:
        """Returns the exact results that the run would have with other powers of its lights; it needs ``by_light=True``.

        Args:
            factors: for the name of each light, the factor on its power, at least 0: one number for all bands or a list
                with one number per band. ``"row 1*"`` stands for all lights whose names begin with ``row 1``. Lights
                that are not named keep their power.
            calibration: what `Scene.calibrate` has found, or a file of factors per band that ``phylux calibrate`` has
                written; `factors` multiply them.

        Standard errors of sums over bands with different factors, and of most ratios of them, are upper bounds.
        """
        given = []
        if factors is not None and not hasattr(factors, "items"):
            raise wrong("factors", f"a {type(factors).__name__}", "give {name of a light: factor}")
        for name, factor in () if factors is None else factors.items():
            place = f"factors/{name}"
            found = plain(factor, place)
            given.append((str(name), [finite(one, place) for one in found] if isinstance(found, list) else finite(found, place)))
        if not self.lights:
            raise wrong(self.scene, _NOT_SPLIT, _SPLIT)
        if isinstance(calibration, Calibration):
            import tempfile

            with tempfile.TemporaryDirectory() as folder:
                path = os.path.join(folder, "calibration.json")
                calibration.save(path)
                return self.mix(factors, calibration=path)
        file = None if calibration is None else os.fspath(calibration)
        return Result(self._found.mix(given, file), self._loaded)

    def even(
        self,
        captors: str,
        *,
        mean: float | None = None,
        minimum: float | None = None,
        band: str | None = None,
        groups: Sequence[str] = (),
    ) -> dict[str, Any]:
        """Finds the powers of lamps that light captors most evenly; it needs ``by_light=True``.

        Args:
            captors: a pattern of groups or, where no group fits, of captors, as in ``"bench*"``; their fronts count.
            mean: the mean irradiance to reach; if not given, the present one.
            minimum: the least irradiance of each captor, which is reached with the least power, in place of `mean`.
            band: the band or sum that counts; if not given, the only band, or the first sum.
            groups: patterns of names of lights that share a factor.

        Returns:
            The report of ``phylux calibrate --even``: ``factors`` for each light (one for each band), and ``before``
            and ``after``. ``result.mix(report["factors"])`` is the result with these powers.
        """
        mean, minimum = (None if value is None else finite(value, name) for name, value in (("mean", mean), ("minimum", minimum)))
        for name, value in (("mean", mean), ("minimum", minimum)):
            if value is not None and not 1e-30 <= value <= 1e30:
                raise wrong(name, f"{value} is no irradiance above 0", "give a number above 0")
        if mean is not None and minimum is not None:
            raise wrong("minimum", "a mean is given, too", "give one of them")
        if not self.lights:
            raise wrong(self.scene, _NOT_SPLIT, _SPLIT)
        lamps = (self.electricity or {}).get("lights", {})
        watts = {name: float(lamp["watts"]) for name, lamp in lamps.items()}
        of_band = None if band is None else text(band, "band")
        found = self._found.even(text(captors, "captors"), watts, mean, minimum, of_band, texts(groups, "groups"))
        report: dict[str, Any] = json.loads(found)
        return report

    def compare(self, other: Result) -> Comparison:
        """Compares these results (a) with others (b) captor by captor: do they differ by more than chance explains?

        Errors: they have nothing in common; their units differ.
        """
        return Comparison(self._found.compare(other._found, html.width()))

    def export(self, path: str | os.PathLike[str], **options: Any) -> None:
        """Writes the scene with these results for other programs; `Scene.export` has the options.

        Results that were loaded from a file do not contain their scene: use ``scene.export(path, result=result)``.
        """
        if self._loaded is None:
            raise wrong(self.scene, _NO_SCENE, "use scene.export(path, result=result)")
        shown.export(self._loaded, path, self._found, **options)

    def to_pyvista(self, **options: Any) -> Any:
        """Returns the surfaces and captors with this light as PolyData of PyVista; `Scene.to_pyvista` has the options."""
        if self._loaded is None:
            raise wrong(self.scene, _NO_SCENE, "use scene.to_pyvista(result=result)")
        return shown.to_pyvista(self._loaded, self._found, **options)

    def histories(self, captor: str, **options: Any) -> Histories:
        """Finds on which ways light reaches a captor or a group; `Scene.histories` has the options.

        It traces photons of its own. Results that were loaded from a file do not contain their scene: use
        ``scene.histories(captor)`` for them.
        """
        if self._loaded is None:
            raise wrong(self.scene, _NO_SCENE, "use scene.histories(captor)")
        progress = options.pop("progress", False)
        return shown.histories(self._loaded, {"to": captor, **options}, progress)

    def view(self, path: str | os.PathLike[str] = "view.html", **options: Any) -> Any:
        """Writes a page for the browser with the scene and these results; `Scene.view` has the options.

        Results that were loaded from a file do not contain their scene: use ``scene.view(result=result)`` for them.
        """
        if self._loaded is None:
            raise wrong(self.scene, _NO_SCENE, "use scene.view(result=result)")
        usual = {"trace": True, "threads": None, "to": None, "inline": False, "width": "100%", "height": 600}
        return shown.view(self._loaded, Path(path), self._found, **{**usual, **options})

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the results file (JSON), completely or not at all, with the same bytes as ``phylux run -o``.

        Error: the scene was read from the file at ``path``.
        """
        self._found.write(os.fspath(path))

    def to_json(self) -> bytes:
        """Returns the bytes that `save` writes."""
        return self._found.to_json()

    def save_csv(self, path: str | os.PathLike[str]) -> None:
        """Writes the tidy table of ``phylux run --csv``."""
        self._found.write_csv(os.fspath(path))

    def save_per_captor(self, folder: str | os.PathLike[str]) -> None:
        """Writes one JSON file for each captor, as ``phylux run --per-captor`` does."""
        self._found.write_per_captor(os.fspath(folder))

    def to_parquet(self, path: str | os.PathLike[str], **options: Any) -> None:
        """Writes `frame` as Parquet; the options are passed to ``DataFrame.to_parquet``, which needs pyarrow."""
        refuse_read(path, self._found.files)
        self.frame.to_parquet(path, **options)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Result:
        """Reads a results file."""
        return cls(_native.Found.read(os.fspath(path)))

    def __reduce__(self) -> Any:
        return _from_json, (self._found.to_json(),)

    def _width(self, quantity: _Quantity) -> int:
        """Returns the number of values of a quantity for each face or captor."""
        return {"band": len(self.bands), "ratio": len(self.ratios)}.get(quantity.per, 1)

    def _arrays(self, groups: bool, light: int | None) -> dict[str, Any]:
        """Returns all arrays of captors or groups in their shapes."""
        arrays = dict(self._found.arrays(groups, light))
        for quantity in _QUANTITIES:
            shape = [-1, *([2] if quantity.of_faces else []), *([self._width(quantity)] if quantity.per else [])]
            for name in (f"{quantity.array}{ending}" for ending in ("", "_se", "_model_se")):
                if name in arrays:
                    arrays[name] = arrays[name].reshape(shape)
        return arrays | {"photons": arrays["photons"].reshape(-1, 2), "has_back": arrays["has_back"].astype(bool)}

    def _values(self, groups: bool, light: int | None) -> Values:
        arrays = {name: _fixed(array) for name, array in self._arrays(groups, light).items()}
        more = {name: array for name, array in arrays.items() if name in OWN}
        ids = self._found.ids(True) if groups else list(self._ids)
        return Values(ids, **{name: arrays[name] for name in _FIELDS if name in arrays}, more=more)


def refuse_read(path: str | os.PathLike[str], read: Sequence[Path]) -> None:
    """Raises an error if output at ``path`` would replace one of the files that a scene was read from."""
    if any(same_file(path, file) for file in read):
        raise wrong(os.fspath(path), "is a file that is read, which the output would replace", "write elsewhere")


def same_file(a: str | os.PathLike[str], b: str | os.PathLike[str]) -> bool:
    """Returns whether both paths name one file that is there."""
    try:
        return os.path.samefile(a, b)
    except OSError:
        return False


def _with_rows(
    table: Any,
    key: str,
    ids: list[str],
    bands: Sequence[str | None],
    kinds: tuple[str, ...],
    found: Floats,
    errors: Floats,
    faces: tuple[str | None, ...] = (*FACES, None),
    model: Floats | None = None,
) -> Any:
    """Returns the table with a row for each value of captors, faces and bands; what is None has no name."""
    import pandas as pd

    rows, face, band = np.nonzero(~np.isnan(found))
    names = {
        key: np.array(ids, dtype=object)[rows],
        "face": np.array(faces, dtype=object)[face],
        "band": np.array(bands, dtype=object)[band],
        "quantity": np.array(kinds, dtype=object)[face],
    }
    whole: dict[str, Any] = {}
    for name, more in names.items():
        known = [*table[name].cat.categories, *(one for one in more if one is not None)]
        joined = np.concatenate([table[name].astype(object).to_numpy(), more])
        whole[name] = pd.Categorical(joined, categories=list(dict.fromkeys(known)))
    whole["value"] = np.concatenate([table["value"], found[rows, face, band]])
    whole["standard_error"] = np.concatenate([table["standard_error"], errors[rows, face, band]])
    if "model_se" in table:
        more = np.full(len(rows), np.nan) if model is None else model[rows, face, band]
        whole["model_se"] = np.concatenate([table["model_se"], more])
    return pd.DataFrame(whole, copy=False)


def _fixed(array: _Array) -> _Array:
    array.setflags(write=False)
    return array


def _from_json(json: bytes) -> Result:
    """Makes a result of the bytes that another process has sent."""
    return Result(_native.Found.from_json(json))
