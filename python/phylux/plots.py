"""Plots of results with matplotlib; each function returns the axes that it has drawn into.

New axes have the style of ``phylux plot``: the width of a page, or that of a column within ``with style(3.5):``.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import missing, wrong

if TYPE_CHECKING:
    from .result import Result, Values

# Colours that colour-blind readers can tell apart (Okabe and Ito 2008), letters of 8 points, no frame, pale lines at the
# numbers of the y axis.
_COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#5a5a5a"]
_STYLE = {
    "font.family": "sans-serif", "font.sans-serif": ["Arial", "Helvetica", "Arimo", "Liberation Sans", "DejaVu Sans"],
    "font.size": 8, "axes.labelsize": 8, "axes.titlesize": 9, "axes.titlelocation": "left", "xtick.labelsize": 8,
    "ytick.labelsize": 8, "legend.fontsize": 8, "legend.frameon": False, "axes.spines.top": False,
    "axes.spines.right": False, "axes.linewidth": 0.75, "axes.grid": True, "axes.grid.axis": "y", "axes.grid.which": "major",
    "axes.axisbelow": True, "grid.color": "#e6e6e6", "grid.linewidth": 0.75, "lines.linewidth": 1.1, "lines.markersize": 4,
    "savefig.dpi": 300, "figure.dpi": 110, "svg.fonttype": "none", "pdf.fonttype": 42,
}
_WIDTH: ContextVar[float] = ContextVar("width", default=7.0)


@contextmanager
def style(width: float = 7.0) -> Iterator[None]:
    """Gives plots that are made within it the style of ``phylux plot``, your own plots of matplotlib too.

    Args:
        width: of new figures, inches; a page of a journal has some 7, a column 3.5.
    """
    if not 1 <= width <= 50:
        raise wrong("width", f"{width} inches", "give 1 to 50; a page has some 7, a column 3.5")
    plt = _pyplot()
    height = width * (0.57 if width > 5 else 0.77)
    more = {"figure.figsize": (width, height), "axes.prop_cycle": plt.cycler(color=_COLOURS)}
    token = _WIDTH.set(width)
    try:
        with plt.rc_context({**_STYLE, **more}):
            yield
    finally:
        _WIDTH.reset(token)


def _styled(draw: Callable[..., Any]) -> Callable[..., Any]:
    """Lets a plot have the style where it makes its own axes."""

    @functools.wraps(draw)
    def drawn(*arguments: Any, ax: Any = None, **options: Any) -> Any:
        if ax is not None:
            return draw(*arguments, ax=ax, **options)
        with style(_WIDTH.get()):
            return draw(*arguments, **options)

    return drawn


@_styled
def captor_map(
    result: Result,
    *,
    band: str | None = None,
    face: str = "front",
    captors: str | Sequence[str] | None = None,
    axes: str | None = None,
    contours: bool | None = None,
    ax: Any = None,
    **options: Any,
) -> Any:
    """Draws the irradiance of captors over the plane in which they lie: colours with contours, linear between the captors
    over Delaunay triangles. Where such a map is not possible, the captors are drawn as dots at their places.

    Args:
        band: a band or sum; if not given, the first sum, or the first band.
        face: ``"front"`` or ``"back"``.
        captors: ids, or the beginning of ids; if not given, the sensors of the plane that has most of them, or all captors
            if there are no sensors.
        axes: the coordinates to the right and upwards, such as ``"xz"``; if not given, those of the plane.
        contours: whether colours and contours fill the space between the captors; if not given, they do where the
            captors are sensors in one plane and no option is one of dots (``s``, ``marker``).
        ax: the axes to draw into; if not given, new ones.
        options: options of matplotlib's ``tricontourf``, or of ``scatter`` for dots.
    """
    rows, column = _plane(result) if captors is None else _rows(result, captors), _band(result, band)
    center, values = result.center[rows], result.irradiance[rows, _face(face), column]
    extent = np.ptp(center, axis=0)
    if axes is None:
        # the plane is perpendicular to the direction of the smallest extent
        axes = "".join("xyz"[axis] for axis in range(3) if axis != 2 - int(np.argmin(extent[::-1])))
    across, up = ("xyz".index(name) for name in axes)
    left = 3 - across - up
    x, y, known = center[:, across], center[:, up], np.isfinite(values)
    if contours is None:
        flat = extent[left] <= 1e-3 * max(extent.max(), 1e-9)
        sensors = not result.is_surface[rows].any()
        dots = {"s", "marker"} & options.keys()
        contours = bool(flat and sensors and not dots and _spans(x[known], y[known]))
    elif contours and not _spans(x[known], y[known]):
        raise wrong("contours", "fewer than three captors that are not in a line", "leave it out: dots show them")
    ax = _axes(ax)
    if contours:
        triangles = (x[known], y[known])
        drawn = ax.tricontourf(*triangles, values[known], **{"levels": 64, **options})
        drawn.set_edgecolor("face")
        lines = ax.tricontour(*triangles, values[known], levels=8, colors="black", linewidths=0.6)
        ax.clabel(lines, fontsize="small")
        ax.plot(x, y, "k.", markersize=2)
        ax.set_title(f"{'xyz'[left]} = {center[:, left].mean():.4g} m")
    else:
        drawn = ax.scatter(x, y, c=values, **options)
    ax.figure.colorbar(drawn, ax=ax, label=_label(result, column), **({"ticks": lines.levels} if contours else {}))
    ax.set(xlabel=f"{axes[0]}, m", ylabel=f"{axes[1]}, m", aspect="equal")
    ax.grid(visible=False)
    return ax


def _plane(result: Result) -> list[int]:
    """Returns the sensors of the plane that has most of them; all captors if there are no sensors."""
    sensors = np.flatnonzero(~result.is_surface)
    if not len(sensors):
        return list(range(len(result.ids)))
    normal, center = result.normal[sensors], result.center[sensors]
    # a plane by its normal and by its distance from the origin, in steps of a millimetre
    planes = np.round(np.column_stack([normal, (normal * center).sum(axis=1)]), 3)
    _, of, counts = np.unique(planes, axis=0, return_inverse=True, return_counts=True)
    return [int(row) for row in sensors[of.ravel() == np.argmax(counts)]]


def _spans(x: Any, y: Any) -> bool:
    """Returns whether there are three points that are not on one line."""
    if len(x) < 3:
        return False
    points = np.stack([x, y], axis=1)
    sizes = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(sizes[1] > 1e-6 * sizes[0])


@_styled
def profile(
    result: Result,
    *,
    band: str | None = None,
    quantity: str = "irradiance",
    face: str = "front",
    captors: str | Sequence[str] | None = None,
    ax: Any = None,
    **options: Any,
) -> Any:
    """Draws values per area over height: the mean of the captors at each height, weighted by area, with error bars of
    one standard error. The errors are added in squares, as if captors were independent.

    Args:
        quantity: ``"irradiance"``, or ``"absorbed"`` (absorbed power per area).
        band, face, captors, ax: as for `captor_map`.
        options: options of matplotlib's ``errorbar``.

    Heights are rounded to a millimetre; if there are more than 12, the captors are put into 12 equal slices between the
    lowest and the highest.
    """
    if quantity not in ("irradiance", "absorbed"):
        raise wrong("quantity", f"no quantity `{quantity}` per area", "there are irradiance and absorbed")
    ax = _axes(ax)
    rows, column = _rows(result, captors), _band(result, band)
    values, errors = (numbers[rows, column] for numbers in _numbers(result, quantity, face))
    height, area = result.center[rows, 2], result.area[rows]
    if quantity == "irradiance":
        values, errors = values * area, errors * area
    known = np.isfinite(values)
    if not known.any():
        raise wrong("captors", f"none of them has a value of {quantity}", "name others, or another quantity or face")
    values, errors, height, area = values[known], np.nan_to_num(errors[known]), height[known], area[known]
    slices = np.round(height, 3)
    if len(np.unique(slices)) > 12:
        edges = np.linspace(height.min(), height.max(), 13)
        slices = np.clip(np.digitize(height, edges) - 1, 0, 11)
    parts = [slices == one for one in np.unique(slices)]
    whole = np.array([area[part].sum() for part in parts])
    means = np.array([values[part].sum() for part in parts]) / whole
    spread = np.array([np.sqrt((errors[part] ** 2).sum()) for part in parts]) / whole
    heights = np.array([(area[part] * height[part]).sum() for part in parts]) / whole
    usual = {"fmt": "o-", "capsize": 3, "label": result.bands[column]}
    ax.errorbar(means, heights, xerr=spread, **{**usual, **options})
    label = _label(result, column)
    if quantity == "absorbed":
        label = _with_unit(f"absorbed per area, {result.bands[column]}", _unit(result, column)["irradiance"])
    ax.set(xlabel=label, ylabel="height z, m")
    ax.set_xlim(left=0)
    return ax


@_styled
def rank(
    result: Result,
    *,
    band: str | None = None,
    quantity: str = "irradiance",
    face: str = "front",
    captors: str | Sequence[str] | None = None,
    ax: Any = None,
    **options: Any,
) -> Any:
    """Draws the values of captors, such as the leaves of a plant, in their order, with error bars of one standard error. A
    line joins captors that are asked for.

    Args:
        quantity: ``"irradiance"``, ``"flux"`` or ``"absorbed"``.
        band, face, captors, ax: as for `captor_map`.
        options: options of matplotlib's ``errorbar``.
    """
    ax = _axes(ax)
    rows, column = _rows(result, captors), _band(result, band)
    values, errors = _numbers(result, quantity, face)
    usual = {"fmt": "." if captors is None else "o-", "capsize": 0 if len(rows) > 40 else 3, "label": result.bands[column]}
    ranks = np.arange(1, len(rows) + 1)
    ax.errorbar(ranks, values[rows, column], errors[rows, column], **{**usual, **options})
    label = "number of the captor" if captors is None else "rank"
    ax.set(xlabel=label, ylabel=_label(result, column, quantity))
    ax.set_ylim(bottom=0)
    _whole_numbers(ax)
    return ax


@_styled
def plants(
    result: Result,
    *,
    band: str | None = None,
    by: str = "plant",
    captors: str | Sequence[str] | None = None,
    ax: Any = None,
    **options: Any,
) -> Any:
    """Draws the power that plants absorbed, with error bars of one standard error. The errors are added in
    squares, as if captors were independent.

    Args:
        by: ``"plant"`` shows each plant, in the order of the file; ``"rank"`` shows, for each rank of leaves, the mean
            over the plants, and the plants as dots.
        band, captors, ax: as for `captor_map`.
        options: options of matplotlib's ``errorbar``.

    A plant is an instance of an object (``tomato-1/leaf3#10`` belongs to the plant ``tomato-1#10``). A rank is the number
    at the end of the name of the group in the OBJ file (3).
    """
    if by not in ("plant", "rank"):
        raise wrong("by", f"no `{by}`", "there are plant and rank")
    ax = _axes(ax)
    rows, column = _rows(result, captors), _band(result, band)
    values, errors = result.absorbed[:, column], np.nan_to_num(result.absorbed_se[:, column])
    objects: dict[str, dict[str, dict[int | None, list[float]]]] = {}
    for row in rows:
        parts = _ORGAN.fullmatch(result.ids[row])
        if parts is None or not np.isfinite(values[row]):
            continue
        rank = int(parts["rank"]) if parts["rank"] else None
        plant = objects.setdefault(parts["object"], {}).setdefault(parts["instance"] or "", {})
        power = plant.setdefault(rank, [0.0, 0.0])
        power[0] += float(values[row])
        power[1] += float(errors[row]) ** 2
    if not objects:
        raise wrong("captors", "none of them is a surface that absorbs", "let objects of the scene be captors")
    start = 1
    for i, (name, instances) in enumerate(objects.items()):
        colour = _COLOURS[i % len(_COLOURS)]
        usual = {"fmt": "o", "capsize": 3, "color": colour, "label": name}
        if by == "plant":
            sums = np.array([np.sum(list(ranks.values()), axis=0) for ranks in instances.values()])
            places = np.arange(start, start + len(sums))
            start += len(sums)
            means, spread = sums[:, 0], np.sqrt(sums[:, 1])
        else:
            numbers = sorted({rank for ranks in instances.values() for rank in ranks if rank is not None})
            if not numbers:
                continue
            of_rank = [np.array([r[n] for r in instances.values() if n in r]) for n in numbers]
            for number, own in zip(numbers, of_rank, strict=True):
                ax.plot([number] * len(own), own[:, 0], ".", color=colour, alpha=0.25)
            places, usual["fmt"] = np.array(numbers), "o-"
            means = np.array([own[:, 0].mean() for own in of_rank])
            spread = np.array([np.sqrt(own[:, 1].sum()) / len(own) for own in of_rank])
        ax.errorbar(places, means, spread, **{**usual, **options})
    ax.set(xlabel=by, ylabel=_label(result, column, "absorbed"))
    ax.set_ylim(bottom=0)
    _whole_numbers(ax)
    if len(objects) > 1:
        ax.legend()
    return ax


# OBJECT/PART#INSTANCE, followed by a number for a single triangle; the rank is the number at the end of PART
_ORGAN = re.compile(r"(?P<object>[^/]*)(/.*?(?P<rank>\d*)(#(?P<instance>\d+)(/\d+)?)?)?", re.DOTALL)


@_styled
def spectrum(
    result: Result,
    *,
    captors: str | Sequence[str] | None = None,
    face: str = "front",
    ax: Any = None,
    **options: Any,
) -> Any:
    """Draws irradiance over the bands, with a line for each captor and error bars of one standard error.

    Args:
        captors: ids, or the beginning of ids; if not given, all, or up to 7 groups if there are more captors.
        face, ax: as for `captor_map`.
        options: options of matplotlib's ``errorbar``.

    Bands with wavelengths are drawn at their middles, in nm, others in their order. Sums are left out. Of more than 12 lines
    there is no legend.
    """
    ax = _axes(ax)
    bands = [(i, band) for i, band in enumerate(result.head["bands"]) if "sum_of" not in band]
    columns = [i for i, _ in bands]
    middles = [(band.get("from_nm", np.nan) + band.get("to_nm", np.nan)) / 2 for _, band in bands]
    known = not np.isnan(middles).any()
    places = middles if known else columns
    shown, rows, note = _shown(result, captors, 7)
    for row in rows:
        values, errors = shown.irradiance[row, _face(face), columns], shown.irradiance_se[row, _face(face), columns]
        usual = {"fmt": "o-", "capsize": 3, "label": shown.ids[row]}
        ax.errorbar(places, values, errors, **{**usual, **options})
    if len(rows) <= 12:
        ax.legend()
    ax.set_title(note)
    if not known:
        ax.set_xticks(columns, [result.bands[i] for i in columns])
    ax.set_ylim(bottom=0)
    ax.set(xlabel="wavelength, nm" if known else "band", ylabel=_with_unit("irradiance", result.unit["irradiance"]))
    return ax


@_styled
def bars(
    result: Result,
    *,
    band: str | None = None,
    quantity: str = "irradiance",
    face: str = "front",
    captors: str | Sequence[str] | None = None,
    ax: Any = None,
    **options: Any,
) -> Any:
    """Draws values by the names of the captors, as bars with errors of one standard error.

    Args:
        quantity: ``"irradiance"``, ``"flux"`` or ``"absorbed"``.
        captors: ids, or the beginning of ids; if not given, all, or up to 24 groups if there are more captors.
        band, face, ax: as for `captor_map`. New axes are as high as the bars need.
        options: options of matplotlib's ``barh``.
    """
    shown, rows, note = _shown(result, captors, 24)
    column = _band(result, band)
    if ax is None:
        ax = _axes(ax)
        width = ax.figure.get_size_inches()[0]
        ax.figure.set_size_inches(width, min(0.6 + 0.2 * len(rows), 200))
    values, errors = _numbers(shown, quantity, face)
    ax.barh([shown.ids[row] for row in rows], values[rows, column], xerr=errors[rows, column], **options)
    ax.set_ylim(len(rows) - 0.4, -0.6)
    ax.set_title(note)
    ax.set(xlabel=_label(result, column, quantity))
    ax.set_xlim(left=0)
    ax.grid(visible=False)
    return ax


def canopy(result: Result, *, band: str | None = None, ax: Any = None, **options: Any) -> Any:
    """Draws the power that surfaces absorbed in each layer of a scene with ``layers``, per area of leaf, over height, with
    error bars of one standard error. The title says the share that the plants take, where it is known.

    Args:
        band, ax: as for `captor_map`.
        options: options of matplotlib's ``barh``.
    """
    layers = result.layers
    if layers is None:
        raise wrong(result.scene, "results without layers", 'give the scene `"layers": {"dz": 0.1}`')
    column = _band(result, band)
    name = result.bands[column]
    layers = layers[(layers["band"] == name) & (layers["area"] > 0)]
    if len(layers) == 0:
        raise wrong(result.scene, "no surface captor in any layer", 'give the plants `"captor": true`')
    ax = _axes(ax)
    area, heights = layers["area"].to_numpy(), layers["to_m"].to_numpy() - layers["from_m"].to_numpy()
    errors = np.nan_to_num(layers["standard_error"].to_numpy(dtype=float)) / area
    usual = {"height": 0.9 * heights, "align": "center", "capsize": 3}
    middles = layers["from_m"].to_numpy() + heights / 2
    ax.barh(middles, layers["per_area"].to_numpy(), xerr=errors, **{**usual, **options})
    ax.set(xlabel=_with_unit(f"absorbed per area of leaf, {name}", _unit(result, column)["irradiance"]), ylabel="height, m")
    if result.canopy is not None:
        ax.set_title(f"the plants absorb {100 * result.canopy['absorbed'][name]:.1f} % of {name}")
    return ax


def _shown(result: Result, captors: str | Sequence[str] | None, most: int) -> tuple[Values, list[int], str]:
    """Returns values, which of them are drawn, and a title: of the captors that are asked for; of all of them if there are at
    most so many; else of groups, each set of captors once, copies (`plant#0`) only where no group has all of them; else of the
    first captors."""
    if captors is not None or len(result.ids) <= most:
        return result.values, _rows(result, captors), ""
    groups = result.group_values
    first: dict[bytes, int] = {}
    for row, name in enumerate(groups.ids):
        if "#" in name and name.rpartition("#")[0] in groups.ids:
            continue
        first.setdefault(groups.flux[row].tobytes() + groups.area[row].tobytes(), row)
    shown, of = (groups, "groups") if first else (result.values, "captors")
    rows = list(first.values()) if first else list(range(len(result.ids)))
    return shown, rows[:most], "" if len(rows) <= most else f"the first {most} of {len(rows)} {of}"


def _whole_numbers(ax: Any) -> None:
    """Puts the numbers of the axis to the right at whole numbers."""
    from matplotlib.ticker import MaxNLocator

    ax.xaxis.set_major_locator(MaxNLocator(integer=True))


def _axes(ax: Any) -> Any:
    if ax is not None:
        return ax
    return _pyplot().subplots(layout="constrained")[1]


def _pyplot() -> Any:
    try:
        import matplotlib.pyplot as plt
    except ImportError:
        raise missing("matplotlib", "a plot") from None
    return plt


def _rows(result: Result, captors: str | Sequence[str] | None) -> list[int]:
    """Returns the indices of captors, given the beginning of their ids, a pattern with ``*``, or a list of ids."""
    if captors is None:
        rows = list(range(len(result.ids)))
    elif isinstance(captors, str):
        pattern = ".*".join(re.escape(part) for part in captors.removesuffix("*").split("*"))
        rows = [row for row, id in enumerate(result.ids) if re.match(pattern, id)]
    else:
        index = {id: row for row, id in enumerate(result.ids)}
        lacking = [id for id in captors if id not in index]
        if lacking:
            raise wrong("captors", f"there is no captor `{lacking[0]}`", "the ids are in result.ids")
        rows = [index[id] for id in captors]
    if not rows:
        raise wrong("captors", f"no captor begins with {captors!r}", "the ids are in result.ids")
    return rows


def _band(result: Result, band: str | None) -> int:
    if band is None:
        return next((i for i, own in enumerate(result.head["bands"]) if "sum_of" in own), 0)
    if band not in result.bands:
        raise wrong("band", f"no band or sum `{band}`", f"there are {', '.join(result.bands)}")
    return result.bands.index(band)


def _face(face: str) -> int:
    if face not in ("front", "back"):
        raise wrong("face", f"no face `{face}`", "there are front and back")
    return int(face == "back")


def _numbers(result: Result | Values, quantity: str, face: str) -> tuple[Any, Any]:
    if quantity == "absorbed":
        return result.absorbed, result.absorbed_se
    if quantity not in ("irradiance", "flux"):
        raise wrong("quantity", f"no quantity `{quantity}`", "there are irradiance, flux and absorbed")
    values, errors = getattr(result, quantity), getattr(result, f"{quantity}_se")
    return values[:, _face(face)], errors[:, _face(face)]


def _label(result: Result, column: int, quantity: str = "irradiance") -> str:
    unit = _unit(result, column)["irradiance" if quantity == "irradiance" else "flux"]
    name = "PPFD" if quantity == "irradiance" and _is_par(result, column) else quantity
    return _with_unit(f"{name}, {result.bands[column]}", unit)


def _unit(result: Result, column: int) -> dict[str, str]:
    """Returns the units of flux and irradiance of a band or sum."""
    return dict(result.head["bands"][column].get("unit", result.unit))


def _with_unit(label: str, unit: str) -> str:
    """Returns a label with its unit as it is printed: umol/m2/s is µmol/m²/s."""
    return f"{label}, {unit.replace('umol', 'µmol').replace('m2', 'm²')}"


def _is_par(result: Result, column: int) -> bool:
    """Returns whether a column counts only photons of 400 to 700 nm, and each of them once."""
    bands = result.head["bands"]
    if "weights" in bands[column]:
        return False
    parts = bands[column].get("sum_of", [bands[column]["name"]])
    parts = [band for band in bands if band["name"] in parts]
    inside = all(band.get("from_nm", 0) >= 400 and band.get("to_nm", np.inf) <= 700 for band in parts)
    return bool(result.unit["flux"] == "umol/s" and inside)
