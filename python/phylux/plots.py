"""Plots of results with matplotlib; each function returns the axes that it has drawn into.

New axes have the style of ``phylux plot``: the width of a page, or that of a column within ``with style(3.5):``.
"""

from __future__ import annotations

import functools
import json
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
_COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#000000", "#5a5a5a"]
_STYLE = {
    "font.family": "sans-serif", "font.sans-serif": ["Arial", "Helvetica", "Arimo", "Liberation Sans", "DejaVu Sans"],
    "font.size": 8, "axes.labelsize": 8, "axes.titlesize": 9, "axes.titlelocation": "left", "xtick.labelsize": 8,
    "ytick.labelsize": 8, "legend.fontsize": 8, "legend.frameon": True, "legend.framealpha": 1.0,
    "legend.facecolor": "white", "legend.edgecolor": "none", "legend.borderpad": 0.3, "axes.spines.top": False,
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
    """Draws the irradiance of captors over the plane in which they lie: colours with contours. Between the captors of a grid
    they are smooth; between others they are linear over Delaunay triangles. Gaps wider
    than three times the usual distance of the captors stay blank, and nothing is drawn beyond them. No step of colours or
    contours is finer than twice the median standard error, which the title says; where the captors differ by no more than
    their errors explain, the map has one colour. Where such a map is not possible, the captors are drawn as dots at their
    places, with their values where they are few.

    Args:
        band: a band or sum; if not given, the first sum, or the first band.
        face: ``"front"`` or ``"back"``.
        captors: ids, or the beginning of ids; if not given, the sensors of the plane that has most of them, or all captors
            if there are no sensors.
        axes: the coordinates to the right and upwards, such as ``"xz"``; if not given, those of the plane.
        contours: whether colours and contours fill the space between the captors; if not given, they do where the
            captors are four sensors or more in one plane, not all in a line, and no option is one of dots (``s``,
            ``marker``).
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
        contours = bool(flat and sensors and not dots and known.sum() > 3 and _spans(x[known], y[known]))
    elif contours and not _spans(x[known], y[known]):
        raise wrong("contours", "fewer than three captors that are not in a line", "leave it out: dots show them")
    own, ax = ax is None, _axes(ax)
    bar: dict[str, Any] = {}
    if contours:
        sets = np.unique([result.ids[row].rpartition("/")[0] for row in rows], return_inverse=True)[1][known]
        errors = result.irradiance_se[rows, _face(face), column][known]
        mean, error = _even(values[known], errors)
        title = f"{'xyz'[left]} = {center[:, left].mean():.4g} m"
        if error > 0:
            unit = _printed(_unit(result, column)["irradiance"])
            of = f"{_rounded(error, error)} {unit}"
            title += f": median error {of}" if mean is None else f": {_rounded(mean, error)} ± {of}, even within its error"
        field = _field(x[known], y[known], values[known], sets)
        drawn, numbers = _contours(ax, field, error, mean, options)
        bar = {} if "levels" in options else {"ticks": numbers}
        ax.plot(x, y, "k.", markersize=2)
        margin = 0.03 * max(np.ptp(x), np.ptp(y))
        ax.set(xlim=(x.min() - margin, x.max() + margin), ylim=(y.min() - margin, y.max() + margin))
        ax.set_title(title)
    else:
        few = len(rows) <= _NUMBERED
        drawn = ax.scatter(x, y, c=values, **{**({"s": 30, "vmin": min(0.0, np.nanmin(values))} if few else {}), **options})
        if few:
            for place in zip(x, y, values, strict=True):
                ax.annotate(f"{place[2]:.3g}", place[:2], (0, 6), textcoords="offset points", ha="center", va="bottom")
            # room for the numbers, also where all captors are in a line
            room = 0.15 * max(np.ptp(x), np.ptp(y), 1e-9) or 0.5
            ax.set(xlim=(x.min() - room, x.max() + room), ylim=(y.min() - room, y.max() + 1.5 * room))
            bar = {"shrink": 0.6, "aspect": 12}
    ax.set(xlabel=f"{axes[0]}, m", ylabel=f"{axes[1]}, m", aspect="equal")
    (low, high), (bottom, top), (wide, tall) = ax.get_xlim(), ax.get_ylim(), ax.figure.get_size_inches()
    flat = (wide - 1.35) * (top - bottom) / max(high - low, 1e-9)
    if own and contours:
        # a figure as high as its map, with its title and the letters below
        tall = float(np.clip(flat + 0.75, 0.3 * wide, 1.1 * wide))
        ax.figure.set_figheight(tall)
        bar = {"shrink": float(np.clip((flat + 0.1) / (tall - 0.65), 0.3, 1)), **bar}
    elif len(ax.figure.axes) == 1:
        # the bar is about as high as a map that is wider than its place
        bar = {"shrink": float(np.clip(flat / (0.8 * tall), 0.5, 1)), **bar}
    ax.figure.colorbar(drawn, ax=ax, label=_label(result, column), **bar)
    ax.grid(visible=False)
    return ax


# so many captors have their numbers beside their dots
_NUMBERED = 12


def _even(values: Any, errors: Any) -> tuple[float | None, float]:
    """Returns the mean of values that differ by no more than their standard errors explain (the sum of their squared
    deviations in errors is less than two standard deviations above what chance makes it), or none if they differ by more;
    and the median error, 0 if none is known."""
    known = np.isfinite(errors) & (errors > 0)
    if not known.any():
        return None, 0.0
    error = float(np.sort(errors[known])[known.sum() // 2])
    free = len(values) - 1
    if not known.all() or free < 1:
        return None, error
    mean = float(values.mean())
    even = (((values - mean) / errors) ** 2).sum() <= free + 2 * (2 * free) ** 0.5
    return (mean if even else None), error


def _rounded(value: float, error: float) -> str:
    """Writes a value with the digits that its error leaves: one of the error, or two if the first is 1."""
    power = np.floor(np.log10(error))
    decimals = int(-power + (np.floor(error / 10**power) < 2))
    return f"{value:.{max(decimals, 0)}f}" if -9 <= decimals < 7 else f"{value:.1e}"


def _contours(ax: Any, field: Any, error: float, mean: float | None, options: dict[str, Any]) -> tuple[Any, Any]:
    """Fills the plane with colours, from 0 unless the least value is more than half of the greatest, and draws contours with
    a number on each where there is room, no step finer than twice the error; returns the colours and the numbers of their
    bar. Of a mean there is one colour, and no contour."""
    from matplotlib.ticker import MaxNLocator
    from matplotlib.tri import Triangulation

    x, y, values, triangles = field
    plane = Triangulation(x, y, triangles)
    least, most = (values.min(), max(values.max(), 1e-30)) if mean is None else (0.0, mean)
    top = np.asarray(MaxNLocator(8).tick_values(least if 0.5 * most < least < most else min(0.0, least), most))
    count = int(min(64, (top[-1] - top[0]) / (2 * error))) if error > 0 else 64
    if count < 64 and mean is None:
        # steps are round numbers
        step = _round_up(2 * error)
        low = 0.0 if top[0] == 0 else np.floor(least / step + 1e-9)
        top = step * np.arange(low, max(np.ceil(most / step - 1e-9), low + 1) + 0.5)
        count = len(top) - 1
    usual = {"levels": np.linspace(top[0], top[-1], max(count, 1) + 1)}
    numbers = top[:: max(1, -(-len(top) // 11))]
    drawn = ax.tricontourf(plane, values if mean is None else np.full(len(values), mean), **{**usual, **options})
    drawn.set_edgecolor("face")
    low, high = drawn.get_clim()
    steps = numbers if count < 64 else MaxNLocator(6).tick_values(values.min(), values.max())
    levels = [level for level in steps if mean is None and values.min() < level < values.max()]
    if not levels:
        return drawn, numbers
    # white on dark colours
    inks = ["white" if level < 0.5 * (low + high) else "black" for level in levels]
    lines = ax.tricontour(plane, values, levels=levels, colors=inks, linewidths=0.6)
    # about how large a number is, in metres
    inch = max(np.ptp(x) / (0.6 * ax.figure.get_figwidth()), np.ptp(y) / (0.7 * ax.figure.get_figheight()))
    size = np.array([0.4 * inch, 0.18 * inch])
    ends = np.array([[x.min(), y.min()], [x.max(), y.max()]]) + np.outer([0.5, -0.5], size)
    taken: list[Any] = []
    for path in lines.get_paths():
        places = path.vertices
        inside = ((places > ends[0]) & (places < ends[1])).all(axis=1)
        free = [place for place in places[inside] if all((np.abs(place - other) > size).any() for other in taken)]
        if free:
            taken.append(free[len(free) // 2])
    if taken:
        ax.clabel(lines, fontsize=7, manual=[tuple(place) for place in taken], inline_spacing=2)
    return drawn, numbers


def _round_up(value: float) -> float:
    """Returns the least of 1, 2, 2.5, 5 or 10 times a power of ten that is not below a number."""
    power = 10 ** np.floor(np.log10(value))
    return float(next(step for step in (1, 2, 2.5, 5, 10) if step * power >= value * (1 - 1e-9)) * power)


# a gap is wider than so many times the usual distance of captors
_GAP = 3.0


def _near(x: Any, y: Any, sets: Any) -> Any:
    """Returns the triangles between points, but for those that span a gap. Points of one of the ``sets`` belong together, as
    those of a grid do; their usual distance along each axis is the median of that to the nearest neighbour."""
    from matplotlib.tri import Triangulation

    points = np.column_stack([x, y])
    triangles = Triangulation(x, y).triangles
    sides = np.concatenate([triangles[:, pair] for pair in ([0, 1], [1, 2], [2, 0])])
    lengths = np.abs(points[sides[:, 0]] - points[sides[:, 1]])
    axis = (lengths[:, 1] > lengths[:, 0]).astype(int)
    own = sets[sides[:, 0]] == sets[sides[:, 1]]
    nearest = np.full(points.shape, np.inf)
    for end in (0, 1):
        np.minimum.at(nearest, (sides[own, end], axis[own]), lengths[own, axis[own]])
    steps = np.zeros((sets.max() + 1, 2))
    for number in np.unique(sets):
        of_set = [np.sort(column[np.isfinite(column)]) for column in nearest[sets == number].T]
        known = [float(column[len(column) // 2]) if len(column) else np.nan for column in of_set]
        # a single row of points has one distance
        steps[number] = [np.nan_to_num(known[i] if np.isfinite(known[i]) else known[1 - i]) for i in (0, 1)]
    far = lengths > (_GAP + 1e-6) * np.maximum(steps[sets[sides[:, 0]]], steps[sets[sides[:, 1]]])
    return triangles[~far.any(axis=1).reshape(3, -1).any(axis=0)]


def _field(x: Any, y: Any, values: Any, sets: Any) -> tuple[Any, Any, Any, Any]:
    """Returns points with their values and the triangles between them: those of a finer grid where points are one, and
    none where gaps are."""
    near = _near(x, y, sets)
    part = np.arange(len(x))
    before = None
    while before is None or (part != before).any():
        before = part.copy()
        np.minimum.at(part, near, part[near].min(axis=1)[:, None])
        part = part[part]
    field: list[list[Any]] = [[x], [y], [values], [np.empty((0, 3), int)]]
    count = len(x)
    for number in np.unique(part[near]):
        own = np.flatnonzero(part == number)
        found = _smooth(x[own], y[own], values[own])
        if found is None:
            field[3].append(near[part[near[:, 0]] == number])
            continue
        *columns, triangles = found
        for all_, more in zip(field, [*columns, triangles + count], strict=True):
            all_.append(more)
        count += len(columns[0])
    across, up, of, triangles = (np.concatenate(parts) for parts in field)
    return across, up, of, triangles


# a smooth map has about so many points
_SMOOTH = 6000


def _smooth(x: Any, y: Any, values: Any) -> tuple[Any, Any, Any, Any] | None:
    """Returns a finer grid than that of the points, with its triangles: values follow monotone cubics along both axes, so
    that none lies beyond its neighbours; none if the points are no grid."""
    grid, place = zip(*(_lines(at) for at in (x, y)), strict=True)
    table = np.full([len(lines) for lines in grid], np.nan)
    table[place] = values
    steps = max(1, min(16, int((_SMOOTH / len(values)) ** 0.5)))
    if table.size != len(values) or np.isnan(table).any() or min(table.shape) < 2:
        return None
    finer = []
    for lines in grid:
        finer.append(np.interp(np.arange((len(lines) - 1) * steps + 1) / steps, np.arange(len(lines)), lines))
        # the other axis comes next
        table = _smoothly(lines, table, finer[-1]).T
    across, up = np.meshgrid(*finer, indexing="ij")
    corner = np.arange(table.size).reshape(table.shape)
    a, b, c, d = (corner[i : i - 1 or None, j : j - 1 or None].ravel() for i, j in ((0, 0), (1, 0), (1, 1), (0, 1)))
    triangles = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return across.ravel(), up.ravel(), table.ravel(), triangles


def _lines(at: Any) -> tuple[Any, Any]:
    """Returns the distinct coordinates of the lines of a grid, and the number of the line of each point."""
    order = np.argsort(at, kind="stable")
    first = np.append(True, np.diff(at[order]) > 1e-6 * max(np.ptp(at), 1e-30))
    line = np.empty(len(at), int)
    line[order] = np.cumsum(first) - 1
    return at[order][first], line


def _smoothly(x: Any, values: Any, at: Any) -> Any:
    """Interpolates the columns of ``values``, given at two places ``x`` or more, by cubics that rise and fall only where
    the values do (Fritsch and Butland 1984); but where the values of neighbours curve the same way they follow the parabola
    through three places, so that hills and hollows are round. Amounts stay above 0."""
    width = np.diff(x)[:, None]
    slope = np.diff(values, axis=0) / width
    if len(x) == 2:
        return values[:1] + (at - x[0])[:, None] * slope
    # at a place between two others: a weighted harmonic mean of the slopes beside it; 0 at a hill or in a hollow
    weight = [2 * width[1:] + width[:-1], width[1:] + 2 * width[:-1]]
    before, after = slope[:-1], slope[1:]
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = (weight[0] + weight[1]) / (weight[0] / before + weight[1] / after)
    middle = np.where(before * after > 0, mean, 0.0)
    if len(x) > 3:
        # the curves at a place and at its neighbours
        curve = np.sign(after - before)
        same = np.vstack([curve[:1], curve]) * np.vstack([curve, curve[-1:]])
        round_ = (same[:-1] > 0) & (same[1:] > 0)
        parabola = (width[1:] * before + width[:-1] * after) / (width[:-1] + width[1:])
        middle = np.where(round_, parabola, middle)
    # at the ends: as the parabola through three places, but not against the slope there, nor steeper than three times it
    ends = []
    for near, next_, h, g in ((slope[0], slope[1], *width[:2, 0]), (slope[-1], slope[-2], *width[:-3:-1, 0])):
        end = ((2 * h + g) * near - h * next_) / (h + g)
        end = np.where(end * near > 0, end, 0.0)
        ends.append(np.where(np.abs(end) > 3 * np.abs(near), 3 * near, end))
    tangent = np.vstack([ends[0], middle, ends[1]])
    i = np.clip(np.searchsorted(x, at, side="right") - 1, 0, len(x) - 2)
    h, t = width[i], ((at - x[i]) / width[i, 0])[:, None]
    smooth = ((1 + 2 * t) * values[i] + h * t * tangent[i]) * (1 - t) ** 2 + (
        (3 - 2 * t) * values[i + 1] - h * (1 - t) * tangent[i + 1]
    ) * t**2
    return np.maximum(smooth, 0.0) if (values >= 0).all() else smooth


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
    one standard error. The errors are added in squares, as if captors were independent. Sensors that face one way have a
    line, and so have surfaces, those of each object if these are two or three.

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
    kinds = _kinds(result, np.array(rows)[known])
    values, errors, height, area = (numbers[known] for numbers in (values, np.nan_to_num(errors), height, area))
    for name, (own, alike) in kinds.items():
        means, heights, spread = _slices(values[own], errors[own], height[own], area[own])
        usual = {"fmt": "o-" if alike else "o", "capsize": 3, "label": name if len(kinds) > 1 else result.bands[column]}
        ax.errorbar(means, heights, xerr=spread, **{**usual, **options})
    if len(kinds) > 1:
        ax.legend()
    label = _label(result, column)
    if quantity == "absorbed":
        label = _with_unit(f"absorbed per area, {result.bands[column]}", _unit(result, column)["irradiance"])
    ax.set(xlabel=label, ylabel="height z, m")
    _from_zero(ax, "x")
    return ax


def _kinds(result: Result, rows: Any) -> dict[str, tuple[Any, bool]]:
    """Returns which of the rows are sensors that face one way, or surfaces of one object if these are few, and whether
    their light at different heights can be compared."""
    ways = {"up": (0, 0, 1), "down": (0, 0, -1), "+x": (1, 0, 0), "-x": (-1, 0, 0), "+y": (0, 1, 0), "-y": (0, -1, 0)}
    is_surface = result.is_surface[rows]
    kinds = {f"sensors facing {name}": (~is_surface & (result.normal[rows] @ axis > 0.999), True) for name, axis in ways.items()}
    others = ~is_surface & ~np.any([own for own, _ in kinds.values()], axis=0)
    kinds["sensors facing other ways"] = others, False
    kinds = {name: kind for name, kind in kinds.items() if kind[0].any()}
    if len(kinds) == 1:
        kinds = {"sensors": kind for kind in kinds.values()}
    objects = np.array([result.ids[row].partition("/")[0] for row in rows])
    names = list(dict.fromkeys(objects[is_surface]))
    if 2 <= len(names) <= 3:
        kinds |= {name: (is_surface & (objects == name), True) for name in names}
    elif names:
        kinds["surfaces"] = is_surface, True
    return kinds


def _slices(values: Any, errors: Any, height: Any, area: Any) -> tuple[Any, Any, Any]:
    """Returns the means over the area of captors at each height or in 12 slices, their heights and their errors."""
    slices = np.round(height, 3)
    if len(np.unique(slices)) > 12:
        edges = np.linspace(height.min(), height.max(), 13)
        slices = np.clip(np.digitize(height, edges) - 1, 0, 11)
    parts = [slices == one for one in np.unique(slices)]
    whole = np.array([area[part].sum() for part in parts])
    means = np.array([values[part].sum() for part in parts]) / whole
    spread = np.array([np.sqrt((errors[part] ** 2).sum()) for part in parts]) / whole
    heights = np.array([(area[part] * height[part]).sum() for part in parts]) / whole
    return means, heights, spread


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
    line joins captors that are asked for; if none are, each object has a colour.

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
    objects = np.array([result.ids[row].partition("/")[0] for row in rows])
    names = list(dict.fromkeys(objects)) if captors is None else []
    for name in names if 1 < len(names) <= 12 else [None]:
        own = np.full(len(rows), True) if name is None else objects == name
        of = np.array(rows)[own]
        named = usual if name is None else {**usual, "label": name}
        ax.errorbar(ranks[own], values[of, column], errors[of, column], **{**named, **options})
    if 1 < len(names) <= 12:
        _legend_above(ax)
    label = "number of the captor" if captors is None else "rank"
    ax.set(xlabel=label, ylabel=_label(result, column, quantity))
    _from_zero(ax, "y")
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
    at the end of the name of the group in the OBJ file (3). The ground, which is what lies flat below all else, and has
    neither instances nor ranks, is left out unless ``captors`` are given.
    """
    if by not in ("plant", "rank"):
        raise wrong("by", f"no `{by}`", "there are plant and rank")
    ax = _axes(ax)
    rows, column = _rows(result, captors), _band(result, band)
    values, errors = result.absorbed[:, column], np.nan_to_num(result.absorbed_se[:, column])
    objects: dict[str, dict[str, dict[int | None, list[float]]]] = {}
    ground = set() if captors is not None else _ground(result)
    for row in rows:
        if row in ground:
            continue
        if not np.isfinite(values[row]):
            continue
        name, instance, rank = _organ(result.ids[row])
        plant = objects.setdefault(name, {}).setdefault(instance, {})
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
    _from_zero(ax, "y")
    _whole_numbers(ax)
    if len(objects) > 1:
        ax.legend()
    return ax


def _ground(result: Result) -> set[int]:
    """Returns the surfaces of objects that are ground: the lowest, without instances and without ranks, that are flat, or
    that face up or down and have light on one side alone. One object at least is left."""
    objects: dict[str, list[int]] = {}
    for row in np.flatnonzero(result.is_surface):
        objects.setdefault(result.ids[row].partition("/")[0], []).append(int(row))
    extent = max(np.ptp(result.center, axis=0))
    of_object: list[tuple[float, bool, list[int]]] = []
    for rows in objects.values():
        weights = result.area[rows]
        height, steepness = (float(np.average(column[rows, 2], weights=weights)) for column in (result.center, result.normal))
        bare = all(_organ(result.ids[row])[1:] == ("", None) for row in rows)
        flat = abs(steepness) > 1 - 1e-4 and (np.abs(result.center[rows, 2] - height) <= 1e-4 * extent).all()
        lit = np.any(np.nan_to_num(result.flux[rows]) > 0, axis=2)
        one_sided = abs(steepness) > 0.7 and not np.all(lit, axis=1).any()
        of_object.append((height, bare and bool(flat or one_sided), rows))
    of_object.sort(key=lambda own: own[0])
    found: list[list[int]] = []
    for height, is_ground, rows in of_object:
        if not is_ground or height - of_object[0][0] > 0.05 * extent:
            break
        found.append(rows)
    return {row for rows in found for row in rows} if len(found) < len(of_object) else set()


def _organ(id: str) -> tuple[str, str, int | None]:
    """Returns the object, the instance (empty without instances) and the rank of a captor, by its id: OBJECT/PART#INSTANCE,
    or OBJECT#INSTANCE, followed by / and a number for a single triangle; the rank is the number at the end of PART."""
    name, _, part = id.partition("/")
    before, _, number = part.rpartition("/")
    if before and re.fullmatch("[0-9]+", number):
        part = before
    copy = re.fullmatch("(.*)#([0-9]+)", part or name, re.DOTALL)
    instance = copy[2] if copy else ""
    if not part:
        return copy[1] if copy else name, instance, None
    rank = re.search("[0-9]*\\Z", copy[1] if copy else part)
    return name, instance, int(rank[0]) if rank and rank[0] else None


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
        options: options of matplotlib's ``errorbar``; those of lines hold for the steps too.

    Bands with wavelengths are steps of irradiance per nanometre from their first to their last wavelength, with a gap where
    there is no band; others stand in their order. Sums are left out. Of more than 12 lines there is no legend.
    """
    ax = _axes(ax)
    bands = [(i, band) for i, band in enumerate(result.head["bands"]) if "sum_of" not in band]
    ends = [(band.get("from_nm", np.nan), band.get("to_nm", np.nan)) for _, band in bands]
    known = not np.isnan(ends).any()
    if known:
        order = sorted(range(len(bands)), key=lambda i: ends[i])
        bands, ends = [bands[i] for i in order], [ends[i] for i in order]
    columns = [i for i, _ in bands]
    shown, rows, note = _shown(result, captors, 7)
    cycle = _pyplot().rcParams["axes.prop_cycle"].by_key().get("color", _COLOURS)
    for number, row in enumerate(rows):
        values, errors = shown.irradiance[row, _face(face), columns], shown.irradiance_se[row, _face(face), columns]
        usual = {"fmt": "o-", "capsize": 3, "label": shown.ids[row]}
        if not known:
            ax.errorbar(range(len(columns)), values, errors, **{**usual, **options})
            continue
        width = np.diff(ends, axis=1)[:, 0]
        values, errors = values / width, errors / width
        chosen = {"color": cycle[number % len(cycle)], **usual, "fmt": "none", "capsize": 2, **options}
        like = {"linestyle": "ls", "linewidth": "lw", "color": "c", "alpha": "alpha", "zorder": "zorder"}
        steps = {name: options[key] for name, short in like.items() for key in (name, short) if key in options}
        # a run of bands, each of which begins where the one before ends, is one line
        starts = [i for i in range(len(ends)) if i == 0 or ends[i][0] != ends[i - 1][1]]
        for start, end in zip(starts, [*starts[1:], len(ends)], strict=True):
            edges = [ends[start][0], *(to for _, to in ends[start:end])]
            label = chosen["label"] if start == 0 else None
            ax.stairs(values[start:end], edges, baseline=None, label=label, **{"color": chosen["color"], "linewidth": 1.1, **steps})
        ax.errorbar(np.mean(ends, axis=1), values, errors, **{**chosen, "label": None})
    if len(rows) == 1:
        ax.set_title(shown.ids[rows[0]])
    elif len(rows) <= 12:
        _legend_above(ax)
    if note:
        ax.text(1, 1, note, transform=ax.transAxes, ha="right", va="top")
    if not known:
        ax.set_xticks(range(len(columns)), [result.bands[i] for i in columns])
    _from_zero(ax, "y")
    unit = result.unit["irradiance"] + ("/nm" if known else "")
    ax.set(xlabel="wavelength, nm" if known else "band", ylabel=_with_unit(_light_word(result.unit["flux"]), unit))
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
    _from_zero(ax, "x")
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
    most so many; else of groups, each set of captors once, copies (`plant#0`) only where no group has all of them, and no
    parts of larger groups; else of the first captors."""
    if captors is not None or len(result.ids) <= most:
        return result.values, _rows(result, captors), ""
    groups = result.group_values
    first: dict[bytes, int] = {}
    for row, name in enumerate(groups.ids):
        if "#" in name and name.rpartition("#")[0] in groups.ids:
            continue
        first.setdefault(groups.flux[row].tobytes() + groups.area[row].tobytes(), row)
    shown, of = (groups, "groups") if first else (result.values, "captors")
    rows = _apart(result, list(first.values())) if first else list(range(len(result.ids)))
    return shown, rows[:most], "" if len(rows) <= most else f"the first {most} of {len(rows)} {of}"


def _apart(result: Result, groups: list[int]) -> list[int]:
    """Leaves out groups all of whose captors belong to a larger one, but for one of all captors. Very large results, whose
    table of captors would take long to read, keep all."""
    if not 1 < len(groups) <= 200 or len(result.ids) > 50_000:
        return groups
    names = result.group_values.ids
    members: dict[str, set[int]] = {names[row]: set() for row in groups}
    for row, captor in enumerate(json.loads(result.to_json())["captors"]):
        for name in captor.get("groups", []):
            if name in members:
                members[name].add(row)
    larger = [own for own in members.values() if len(own) < len(result.ids)]
    return [row for row in groups if not members[names[row]] or not any(members[names[row]] < other for other in larger)]


def _from_zero(ax: Any, axis: str) -> None:
    """Lets an axis of amounts begin at 0 and end beyond all that is drawn; bars of errors may add half the greatest value."""
    number = 0 if axis == "x" else 1
    end = (ax.dataLim.intervalx if axis == "x" else ax.dataLim.intervaly)[1]
    # values without their bars, whose ends are marks of their own
    values = [np.asarray(line.get_data()[number], float) for line in ax.lines if line.get_marker() not in ("|", "_")]
    for patch in ax.patches:
        steps = hasattr(patch, "get_data")
        own = patch.get_data().values if steps else patch.get_width() if axis == "x" else patch.get_height()
        values.append(np.atleast_1d(np.asarray(own, float)))
    known = [column[np.isfinite(column)].max() for column in values if np.isfinite(column).any()]
    if known and max(known) > 0:
        end = min(end, 1.5 * max(known))
    if np.isfinite(end) and end > 0:
        getattr(ax, f"set_{axis}lim")(0, 1.05 * end)


def _legend_above(ax: Any) -> None:
    """Puts a legend above the axes, where it covers nothing."""
    names = [str(name) for name in ax.get_legend_handles_labels()[1]]
    if len(names) < 2:
        return
    # in characters of 8 points
    room = 15 * ax.figure.get_figwidth() * ax.get_position().width
    columns = max(1, min(len(names), int(room // (3 + max(map(len, names))))))
    ax.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=columns, borderaxespad=0.2, columnspacing=1, handlelength=1.3)


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
    """Returns the indices of captors, given ids, patterns with ``*``, the beginning of ids (one that is no id), or names of
    groups, which stand for their captors."""
    if captors is None:
        return list(range(len(result.ids)))
    wanted = [captors] if isinstance(captors, str) else list(captors)
    rows: dict[int, None] = {}
    for name in wanted:
        pattern = ".*".join(re.escape(part) for part in name.removesuffix("*").split("*"))
        begins = isinstance(captors, str) or "*" in name
        end = "" if begins and (name.endswith("*") or "*" not in name) else r"\Z"
        own = [row for row, id in enumerate(result.ids) if re.match(pattern + end, id, re.DOTALL)]
        if name in result.group_values.ids:
            own += _members(result, name)
        if not own:
            problem = f"no captor begins with {name!r}" if begins else f"there is no captor or group `{name}`"
            raise wrong("captors", problem, "the ids are in result.ids")
        rows.update(dict.fromkeys(own))
    return sorted(rows) if isinstance(captors, str) else list(rows)


def _members(result: Result, group: str) -> list[int]:
    captors = json.loads(result.to_json())["captors"]
    return [row for row, captor in enumerate(captors) if group in captor.get("groups", [])]


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
    par = quantity == "irradiance" and _is_par(result, column)
    own = result.head["bands"][column]
    whole = "sum_of" in own or (own.get("from_nm", 0) <= 401 and own.get("to_nm", np.inf) >= 699)
    # a band is named if there are others, and PPFD does not say which it is
    of = "" if len(result.bands) == 1 or (par and whole) else f", {result.bands[column]}"
    word = _light_word(_unit(result, column)["flux"]) if quantity == "irradiance" else quantity
    return _with_unit(f"{'PPFD' if par else word}{of}", unit)


def _light_word(flux: str) -> str:
    """Returns the word for light per area by the unit of its flux: photon flux density where photons are counted."""
    return {"umol/s": "PFD", "lm": "illuminance"}.get(flux, "irradiance")


def _unit(result: Result, column: int) -> dict[str, str]:
    """Returns the units of flux and irradiance of a band or sum."""
    return dict(result.head["bands"][column].get("unit", result.unit))


def _with_unit(label: str, unit: str) -> str:
    return f"{label}, {_printed(unit)}"


def _printed(unit: str) -> str:
    """Returns a unit as it is printed: umol/m2/s is µmol/m²/s."""
    return unit.replace("umol", "µmol").replace("m2", "m²")


def _is_par(result: Result, column: int) -> bool:
    """Returns whether a column counts only photons of 400 to 700 nm (those of a band PAR without wavelengths), and each once."""
    bands = result.head["bands"]
    if "weights" in bands[column]:
        return False
    parts = bands[column].get("sum_of", [bands[column]["name"]])
    parts = [band for band in bands if band["name"] in parts]
    bare = [band["name"].upper() == "PAR" and not {"from_nm", "to_nm"} & band.keys() for band in parts]
    within = [band.get("from_nm", 0) >= 400 and band.get("to_nm", np.inf) <= 700 for band in parts]
    inside = all(np.logical_or(bare, within))
    return bool(result.unit["flux"] == "umol/s" and inside)
