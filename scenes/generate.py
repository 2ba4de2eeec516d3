#!/usr/bin/env python3
"""Write the meshes (OBJ) and captor tables (CSV) of the shipped scenes.

    python3 scenes/generate.py

writes beside itself and in ../captors, always the same bytes. The scene files
(JSON) are written by hand and are not touched, but greenhouse-day.json and
greenhouse-year.json, which are greenhouse.json under another light, and their weather,
season.json, which is canopy.json in a greenhouse, and the glasshouse by day and by night.

Lengths are metres, or centimetres where a function says so (the growth chamber);
angles are degrees; z is up. The front of a triangle is its counter-clockwise side: the
outside of a solid, the inside of a room, the adaxial (upper) side of a leaf.
"""

import datetime
import json
import math
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

SCENES = Path(__file__).resolve().parent
CAPTORS = SCENES.parent / "captors"

# Divergence of successive leaves in the common spiral phyllotaxis, 360 / golden ratio
# squared (Prusinkiewicz & Lindenmayer 1990, The Algorithmic Beauty of Plants, ch. 4).
GOLDEN_ANGLE = 137.508

# Leaf outlines, left half. One row per lateral vein: where it leaves the midrib (m) and
# where it meets the margin (x along the midrib, y across), in lamina lengths; base at 0,
# tip at 1. Drawn by eye after the usual form of the species.
TOMATO_LEAFLET = [  # ovate, coarsely toothed: tooth, notch, tooth, notch ...
    (0.00, 0.00, 0.00), (0.05, 0.07, 0.17), (0.14, 0.19, 0.20), (0.21, 0.33, 0.31),
    (0.34, 0.40, 0.21), (0.42, 0.61, 0.24), (0.62, 0.67, 0.12), (1.00, 1.00, 0.00)]
CUCUMBER_LEAF = [  # cordate, five-angled, toothed
    (0.00, -0.13, 0.07), (0.00, -0.23, 0.28), (0.00, -0.08, 0.40), (0.00, 0.03, 0.54),
    (0.03, 0.15, 0.45), (0.08, 0.36, 0.53), (0.20, 0.44, 0.39), (0.32, 0.60, 0.37),
    (0.48, 0.66, 0.24), (0.62, 0.80, 0.20), (0.78, 0.85, 0.09), (1.00, 1.00, 0.00)]
LETTUCE_LEAF = [  # spatulate, broad and round at the top
    (0.00, 0.02, 0.05), (0.06, 0.16, 0.11), (0.16, 0.30, 0.20), (0.28, 0.46, 0.30), (0.42, 0.62, 0.37),
    (0.56, 0.78, 0.38), (0.70, 0.90, 0.31), (0.84, 0.98, 0.17), (0.98, 1.00, 0.00)]

# The greenhouse bay (m): where things stand. greenhouse.json uses the same numbers.
BAY_LENGTH, BAY_WIDTH, EAVE, RIDGE, PLINTH = 6.4, 4.8, 2.5, 4.0, 0.40
BENCH_START, BENCH_LENGTH, BENCH_WIDTH, BENCH_TOP = 0.95, 4.5, 1.1, 0.80
BENCH_CENTRES_Y = (0.85, 2.40, 3.95)
PLANT_START, PLANT_STEP, PLANT_ROW = 1.4, 0.64, 0.26  # two rows, the second half a step on

# -------------------------------------------------------------------------- vectors and frames
def add(point, *terms):
    """Point plus weighted vectors, given as (weight, vector) pairs."""
    return tuple(p + sum(w * v[i] for w, v in terms) for i, p in enumerate(point))


def cross(a, b):
    """Vector product."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(v):
    """The vector of length 1 in the direction of v."""
    length = math.hypot(*v)
    return tuple(x / length for x in v)


def spin(a, b, angle):
    """Turn the perpendicular unit vectors a and b in their plane, a towards b."""
    c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    return add((0, 0, 0), (c, a), (s, b)), add((0, 0, 0), (c, b), (-s, a))


@dataclass(frozen=True)
class Frame:
    """A place and an orientation: where an organ starts, and which way it grows."""

    origin: tuple = (0.0, 0.0, 0.0)
    forward: tuple = (1.0, 0.0, 0.0)
    left: tuple = (0.0, 1.0, 0.0)
    up: tuple = (0.0, 0.0, 1.0)

    def point(self, x, y, z):
        """The point x forward, y left, z up from the origin."""
        return add(self.origin, (x, self.forward), (y, self.left), (z, self.up))

    def moved(self, x, y, z):
        """The same orientation, x forward, y left, z up from here."""
        return Frame(self.point(x, y, z), self.forward, self.left, self.up)

    def turned(self, yaw=0.0, pitch=0.0, roll=0.0):
        """Turned to the left, then nose up, then about the way forward (left side up)."""
        forward, left = spin(self.forward, self.left, yaw)
        forward, up = spin(forward, self.up, pitch)
        left, up = spin(left, up, roll)
        return Frame(self.origin, forward, left, up)

    def along(self, distance, bend):
        """The frame `distance` on, along an arc that bends down by `bend` per unit length."""
        angle = math.radians(bend) * distance
        straight = abs(angle) < 1e-9
        ahead = distance if straight else distance * math.sin(angle) / angle
        down = 0.0 if straight else distance * (1 - math.cos(angle)) / angle
        return self.moved(ahead, 0, -down).turned(pitch=-math.degrees(angle))


# --------------------------------------------------------------- solids and sheets (triangles)
def polygon(*points):
    """A convex polygon, counter-clockwise from its front, as a fan of triangles."""
    return [(points[0], points[i], points[i + 1]) for i in range(1, len(points) - 1)]


def room(low, high):
    """The six walls of a closed room, normals in: name -> triangles."""
    (x, y, z), (X, Y, Z) = low, high
    return {
        "floor": polygon((x, y, z), (X, y, z), (X, Y, z), (x, Y, z)),
        "ceiling": polygon((x, y, Z), (x, Y, Z), (X, Y, Z), (X, y, Z)),
        "west": polygon((x, y, z), (x, Y, z), (x, Y, Z), (x, y, Z)),
        "east": polygon((X, y, z), (X, y, Z), (X, Y, Z), (X, Y, z)),
        "south": polygon((x, y, z), (x, y, Z), (X, y, Z), (X, y, z)),
        "north": polygon((x, Y, z), (X, Y, z), (X, Y, Z), (x, Y, Z)),
    }


def flipped(triangles):
    """The same triangles, seen from behind."""
    return [(a, c, b) for a, b, c in triangles]


def box(low, high):
    """A closed box, normals out."""
    return flipped(t for wall in room(low, high).values() for t in wall)


def loft(rows):
    """The surface between rows of points, each to the next; front to the right of the rows'
    order. Where points coincide it closes to a fan."""
    triangles = []
    for near, far in zip(rows, rows[1:]):
        for j in range(len(near) - 1):
            triangles += polygon(near[j], near[j + 1], far[j + 1], far[j])
    return [t for t in triangles if len(set(t)) == 3]


def ring(centre, radius, a, b, sides, start=0.0):
    """A closed row of points around a centre, from a towards b."""
    turns = [2 * math.pi * (k % sides + start) / sides for k in range(sides + 1)]
    return [add(centre, (radius * math.cos(t), a), (radius * math.sin(t), b)) for t in turns]


def tube(path, radii, sides):
    """A closed prism along a polyline, with one radius per point (stems, bars)."""
    rings = []
    first = unit(add(path[1], (-1, path[0])))
    reference = (1.0, 0.0, 0.0) if abs(first[2]) > 0.9 else (0.0, 0.0, 1.0)
    for i, (centre, radius) in enumerate(zip(path, radii)):
        tangent = unit(add(path[min(i + 1, len(path) - 1)], (-1, path[max(i - 1, 0)])))
        a = unit(cross(reference, tangent))
        rings.append(ring(centre, radius, a, cross(tangent, a), sides, start=0.5))
    return polygon(*rings[0][:0:-1]) + loft(rings) + polygon(*rings[-1][1:])


def bar(start, end, width):
    """A closed bar of square section."""
    return tube([start, end], [width / math.sqrt(2)] * 2, 4)


def lathe(profile, sides):
    """The surface that a profile of (radius, z) sweeps about the z axis: normals point to
    the right of the way the profile goes (from the bottom, outward and up: outside)."""
    return loft([ring((0, 0, z), radius, (1, 0, 0), (0, 1, 0), sides) for radius, z in profile])


def lamina(base, length, veins, bend, fold, cells=1):
    """A leaf blade: a thin sheet in the outline `veins`, `length` long, whose midrib bends
    down by `bend` from base to tip and whose halves are folded up by `fold`.
    Each vein is cut into `cells` parts."""
    def point(x, y, side):
        rise = math.radians(fold)
        here = base.along(x * length, bend / length)
        return here.point(0, side * y * length * math.cos(rise), y * length * math.sin(rise))

    def half(side):
        return loft([[point(m + (x - m) * j / cells, y * j / cells, side) for j in range(cells + 1)]
                     for m, x, y in veins])

    return flipped(half(1)) + half(-1)


def spline(points, steps):
    """Points on the smooth curve through `points` (a Catmull-Rom spline), `steps` to each piece,
    each with its place: 0 at the first point, 1 at the second."""
    ends = [points[0], *points, points[-1]]
    curve = [(0.0, tuple(points[0]))]
    for i in range(len(points) - 1):
        before, start, end, after = ends[i:i + 4]
        for k in range(1, steps + 1):
            t = k / steps
            weights = (-t + 2 * t**2 - t**3) / 2, (2 - 5 * t**2 + 3 * t**3) / 2, \
                      (t + 4 * t**2 - 3 * t**3) / 2, (t**3 - t**2) / 2
            curve.append((i + t, add((0, 0, 0), *zip(weights, (before, start, end, after)))))
    return curve


def blade(base, length, veins, bend, fold, cells=7, steps=6, quilt=0.03, wave=0.035, turn=0.0):
    """A leaf blade as `lamina` makes it, but fine: its outline is round and toothed, its surface
    swells between the veins (by `quilt` of the length), its margin waves (by `wave`, from the angle
    `turn` on), and the midrib and the lateral veins are strips of a material of their own.
    Returns material -> triangles."""
    rise, reach = math.radians(fold), max(y for _, _, y in veins)
    lines, start = [], 0.0  # (place along the margin, where on the midrib it starts, its end)
    for k, (place, (m, x, y)) in enumerate(spline(veins, steps)):
        start = max(start, m)  # the midrib does not turn back
        tooth = 1.045 if k % 2 and k > steps else 1.0
        lines.append((place, start, start + (x - start) * tooth, y * tooth))
    rows = []  # a line, and the one that it leans to, as the two edges of a vein do
    for k, line in enumerate(lines):
        vein = k % steps == 0 and k // steps % 2 and line != lines[-1]
        rows += [(line, lines[k + lean]) for lean in ((-1, 1) if vein else (0,))]

    def point(line, other, j, side):
        inner = min(0.4, 0.006 * (1 - 0.7 * line[1]) / line[3]) if line[3] > 1e-9 else 0.0  # half of the midrib
        u = 0.0 if j == 0 else inner + (1 - inner) * (j - 1) / cells
        lean = 0.36 * (1 - u)
        place, m, x, y = add((0, 0, 0, 0), (1 - lean, line), (lean, other))
        across, between = y * u, math.pi * (place - 1) / 2
        swell = quilt * abs(math.sin(between)) ** 0.7 * math.sqrt(4 * u * (1.1 - u))
        swell += quilt / 5 * math.sin(4 * between) * math.sin(5 * math.pi * u)
        swell += wave * u**2 * math.sin(1.9 * place + turn + side)
        droop = 0.55 * across**2 / reach * math.sin(rise)
        here = base.along((m + (x - m) * u**1.2) * length, bend / length)
        return here.point(0, side * across * length * math.cos(rise),
                          length * (across * math.sin(rise) - droop + swell * min(1, y / 0.15)))

    parts = defaultdict(list)
    for side in (1, -1):
        grid = [[point(*row, j, side) for j in range(cells + 2)] for row in rows]
        turned = flipped if side > 0 else list
        parts["vein"] += turned(loft([row[:2] for row in grid]))
        for near, far, (line, _), (next_line, _) in zip(grid, grid[1:], rows, rows[1:]):
            parts["vein" if line is next_line else "leaf"] += turned(loft([near[1:], far[1:]]))
    return parts


# ------------------------------------------------------------------------------------ OBJ, CSV
def save(path, lines):
    """Write lines, alike on every system."""
    path.write_bytes("".join(line + "\n" for line in lines).encode("ascii"))


def write_obj(path, title, parts, decimals=5):
    """Write an OBJ file; `parts` maps (group, material) to triangles. Shared vertices once;
    no material for captors."""
    vertices, faces, last = {}, [], None
    for (group, material), triangles in parts.items():
        faces += ([f"g {group}"] if group != last else []) + ([f"usemtl {material}"] if material else [])
        last = group
        for triangle in triangles:
            corners = [" ".join(f"{round(c, decimals) + 0.0:.{decimals}f}" for c in p) for p in triangle]
            if len(set(corners)) < 3:
                continue  # nothing is left of it
            faces.append("f " + " ".join(str(vertices.setdefault(c, len(vertices) + 1)) for c in corners))
    save(path, [f"# {title}", "# written by scenes/generate.py", *(f"v {v}" for v in vertices), *faces])


def write_discs(path, rows, decimals=3):
    """Write a captor table; a row is (id, position, radius, normal)."""
    lines = ["id,x,y,z,radius,nx,ny,nz"]
    for name, position, radius, normal in rows:
        numbers = [f"{v:.{decimals}f}" for v in (*position, radius)] + [f"{v:g}" for v in normal]
        lines.append(",".join([name, *numbers]))
    save(path, lines)


# -------------------------------------------------------------------------------------- plants
def wobble(i):
    """A number in [-1, 1) that looks irregular from one i to the next, and never changes."""
    return (i * 0.6180339887 + 0.3) % 1.0 * 2 - 1


def grow_stem(parts, count, internode, sway, radius):
    """Add a stem that starts 1 cm below the soil and tapers to 40 % of its radius, with
    internodes that shorten to the top (m). Returns its nodes."""
    nodes, z = [(0.0, 0.0, -0.01)], 0.02
    for i in range(count):
        z += internode * (1 - 0.6 * i / count)
        nodes.append((sway * wobble(i), sway * wobble(i + 7), z))
    parts["stem", "stem"] += tube(nodes, [radius * (1 - 0.6 * i / count) for i in range(count + 1)], 6)
    return nodes[1:]


def sheet(fine, youngest, **shape):
    """A blade for scenes to measure in, of one material; or one for pictures, whose green is light
    on the `youngest` leaves, and whose veins are lighter still."""
    if not fine:
        return {"leaf": lamina(**shape)}
    triangles = blade(**shape)
    return {"young" if youngest else "leaf": triangles["leaf"], "vein": triangles["vein"]}


def tomato(fine=False):
    """A young tomato plant (Solanum lycopersicum), 0.47 m tall: seven pinnate leaves of
    five or seven leaflets. Origin at the soil."""
    parts = defaultdict(list)
    nodes = grow_stem(parts, 7, internode=0.075, sway=0.006, radius=0.005)
    lengths = [0.20, 0.24, 0.26, 0.26, 0.22, 0.16, 0.10]  # petiole and rachis, oldest first
    for i, (node, length) in enumerate(zip(nodes, lengths)):
        youth = i / 6
        start = Frame(node).turned(yaw=GOLDEN_ANGLE * i, pitch=27 + 35 * youth + 4 * wobble(i))
        bend = (68 - 18 * youth) / length
        thick = 0.0030 - 0.0014 * youth
        path = [start.along(length * t, bend).origin for t in (0, 0.3, 0.65, 1)]
        parts["stem", "stem"] += tube(path, [thick * f for f in (1, 0.8, 0.6, 0.4)], 3)
        pairs = [(0.40, 0.36), (0.66, 0.40), (0.90, 0.34)] if length > 0.22 else [(0.45, 0.38), (0.84, 0.38)]
        leaflets = [(1.0, 0, 0.44)] + [(t, side, size) for t, size in pairs for side in (1, -1)]
        for k, (t, side, size) in enumerate(leaflets):
            # left and right leaflets leave the rachis a little apart, on stalks, and slope down
            here = start.along(length * (t - 0.02 * (side < 0)), bend).turned(
                yaw=side * (62 + 5 * wobble(k + i)), pitch=-4 - 6 * abs(side), roll=5 * wobble(3 * k + i))
            stalk = 0.05 * length * abs(side)
            if side:
                parts["stem", "stem"] += tube([here.origin, here.point(stalk, 0, 0)], [0.0008, 0.0006], 3)
            shape = {"cells": 4, "steps": 4, "turn": 2.4 * k + i} if fine else {}
            leaflet = sheet(
                fine, i > 4, base=here.moved(stalk, 0, 0), length=size * length * (1 + 0.06 * wobble(5 * k + i)),
                veins=TOMATO_LEAFLET, bend=32 + 8 * wobble(k), fold=14 + 4 * wobble(k + 2 * i), **shape)
            for material, triangles in leaflet.items():
                parts[f"leaf{i}", material] += triangles
    name, kind = ("tomato-fine", " with round, veined leaves") if fine else ("tomato", "")
    write_obj(SCENES / f"{name}.obj", f"young tomato plant{kind}, m; origin at the soil", parts)


def cucumber(fine=False):
    """A young cucumber plant (Cucumis sativus), 0.49 m tall: eight simple leaves on long
    petioles. Origin at the soil."""
    parts = defaultdict(list)
    nodes = grow_stem(parts, 8, internode=0.072, sway=0.008, radius=0.0045)
    lengths = [0.105, 0.125, 0.140, 0.145, 0.140, 0.120, 0.090, 0.060]  # lamina, oldest first
    for i, (node, length) in enumerate(zip(nodes, lengths)):
        youth = i / 7
        petiole = 0.85 * length
        start = Frame(node).turned(yaw=GOLDEN_ANGLE * i, pitch=28 + 30 * youth + 4 * wobble(i))
        bend = 40 / petiole
        path = [start.along(petiole * t, bend).origin for t in (0, 0.35, 0.7, 1)]
        parts["stem", "stem"] += tube(path, [0.0030 - 0.0014 * youth - 0.0003 * k for k in range(4)], 4)
        base = start.along(petiole, bend).turned(pitch=-18 - 10 * (1 - youth), roll=6 * wobble(2 * i + 1))
        shape = {"cells": 7, "steps": 6, "turn": 2.4 * i} if fine else {"cells": 2}
        leaf = sheet(fine, i > 5, base=base, length=length, veins=CUCUMBER_LEAF, bend=42, fold=12 + 8 * youth, **shape)
        for material, triangles in leaf.items():
            parts[f"leaf{i}", material] += triangles
    name, kind = ("cucumber-fine", " with round, veined leaves") if fine else ("cucumber", "")
    write_obj(SCENES / f"{name}.obj", f"young cucumber plant{kind}, m; origin at the soil", parts)


def lettuce():
    """A head of lettuce (Lactuca sativa), 0.31 m wide: 24 leaves in a rosette, the inner ones upright, small
    and light, with margins that wave. Origin at the soil."""
    parts = defaultdict(list)
    for i in range(24):
        youth = i / 23
        base = Frame((0, 0, 0.002 + 0.02 * youth)).turned(yaw=GOLDEN_ANGLE * i, pitch=22 + 52 * youth + 5 * wobble(i))
        leaf = blade(base.moved(0.006, 0, 0), 0.165 - 0.095 * youth**1.3, LETTUCE_LEAF, bend=38 - 70 * youth, fold=22,
                     cells=5 if i < 12 else 3, steps=2, quilt=0.045, wave=0.11, turn=2.4 * i)
        for material, triangles in leaf.items():
            parts[f"leaf{i}", "heart" if material == "leaf" and i > 11 else material] += triangles
    write_obj(SCENES / "lettuce.obj", "head of lettuce, m; origin at the soil", parts)


def pot(fine=False):
    """A 13 cm flower pot with its soil; together they are closed. Origin at the bottom."""
    parts, rim, level, sides = defaultdict(list), 0.058, 0.100, 48 if fine else 12
    collar = [(0.0615, 0.084), (0.066, 0.086)] if fine else []
    outside = [(0, 0), (0.048, 0), *collar, (0.067 if fine else 0.065, 0.112)]
    parts["pot", "pot"] += lathe([*outside, (0.060, 0.112), (rim, level)], sides)
    parts["soil", "soil"] += lathe([(rim, level), (0, level)], sides)
    name, title = ("pot-fine", "flower pot with a collar") if fine else ("pot", "flower pot")
    write_obj(SCENES / f"{name}.obj", f"{title}, m; origin at the bottom, soil at 0.1", parts)


# ---------------------------------------------------------------------------- the scenes' rest
def unit_room():
    """The room of box.json: a cube of 1 m, normals in, one group per wall."""
    parts = defaultdict(list)
    for name, wall in room((0, 0, 0), (1, 1, 1)).items():
        parts[name, "wall"] += wall
    write_obj(SCENES / "box.obj", "closed room, 1 m; 12 triangles, normals in", parts, decimals=0)


def greenhouse():
    """The bay: floor, plinth, frame of closed bars, panes. A pane reaches to the centre lines
    of the bars around it, so its edges lie inside them: no gap, nothing coincident."""
    parts, middle = defaultdict(list), BAY_WIDTH / 2
    parts["floor", "concrete"] += room((0, 0, 0), (BAY_LENGTH, BAY_WIDTH, RIDGE))["floor"]
    for y in (0, BAY_WIDTH):
        parts["plinth", "concrete"] += box((0, y - 0.05, -0.05), (BAY_LENGTH, y + 0.05, PLINTH))
    for x in (0, BAY_LENGTH):
        low, high = (x - 0.06, -0.06, -0.06), (x + 0.06, BAY_WIDTH + 0.06, PLINTH + 0.01)
        parts["plinth", "concrete"] += box(low, high)

    sill = PLINTH - 0.05  # columns and panes start inside the plinth
    stations = [BAY_LENGTH * k / 8 for k in range(9)]
    for y, width in ((0, 0.09), (middle, 0.08), (BAY_WIDTH, 0.09)):
        z = RIDGE if y == middle else EAVE
        parts["frame", "aluminium"] += bar((-0.06, y, z), (BAY_LENGTH + 0.06, y, z), width)
    for y in (0, BAY_WIDTH):
        for x in stations:
            parts["frame", "aluminium"] += bar((x, y, sill), (x, y, EAVE), 0.06)
            parts["frame", "aluminium"] += bar((x, y, EAVE), (x, middle, RIDGE), 0.05)
        for x, X in zip(stations, stations[1:]):
            for (v, z), (V, Z) in (((y, sill), (y, EAVE)), ((y, EAVE), (middle, RIDGE))):
                parts["panes", "glass"] += polygon((x, v, z), (X, v, z), (X, V, Z), (x, V, Z))

    def roof(y):
        return EAVE + (RIDGE - EAVE) * (1 - abs(y - middle) / middle)

    posts = [BAY_WIDTH * k / 4 for k in range(5)]
    for x in (0, BAY_LENGTH):
        for y in posts[1:-1]:
            parts["frame", "aluminium"] += bar((x, y, sill), (x, y, roof(y)), 0.045)
        for y, Y in zip(posts, posts[1:]):
            parts["panes", "glass"] += polygon((x, y, sill), (x, Y, sill), (x, Y, roof(Y)), (x, y, roof(y)))
    write_obj(SCENES / "greenhouse.obj", "greenhouse bay, 6.4 x 4.8 x 4 m; z up, a corner at the origin", parts)


def bench():
    """A bench: a polystyrene top on aluminium legs. Origin on the floor below its centre."""
    parts, x, y = defaultdict(list), BENCH_LENGTH / 2, BENCH_WIDTH / 2
    parts["top", "polystyrene"] += box((-x, -y, BENCH_TOP - 0.05), (x, y, BENCH_TOP))
    for lx in (-x + 0.3, 0, x - 0.3):
        for ly in (-y + 0.1, y - 0.1):
            parts["legs", "aluminium"] += bar((lx, ly, -0.02), (lx, ly, BENCH_TOP - 0.02), 0.04)
    write_obj(SCENES / "bench.obj", "bench, 4.5 x 1.1 x 0.8 m; origin on the floor below its centre", parts)


def reflector():
    """A lamp's reflector: a hood of thin sheet, open below. Origin at the lamp's centre."""
    parts = defaultdict(list)
    top, edge = ([(x, y, z) for x, y in ((-a, -b), (a, -b), (a, b), (-a, b), (-a, -b))]
                 for a, b, z in ((0.16, 0.06, 0.06), (0.20, 0.12, -0.07)))
    parts["sheet", "reflector"] += polygon(*top[:4]) + loft([edge, top])
    write_obj(SCENES / "reflector.obj", "lamp reflector, m; origin at the lamp's centre", parts)


def chamber():
    """The growth chamber, in cm: walls, a shelf held by the side walls, a mirror in the back wall."""
    parts = defaultdict(list)
    for name, wall in room((0, 0, 0), (120, 80, 150)).items():
        parts[name, "wall"] += wall
    parts["shelf", "shelf"] += box((-1, 6, 38), (121, 74, 40))
    parts["mirror", "mirror"] += box((20, 79.5, 60), (100, 81, 110))
    write_obj(SCENES / "chamber.obj", "growth chamber, cm; normals in; shelf top at z = 40", parts, decimals=3)

    strip = defaultdict(list)
    strip["strip", "housing"] += box((-1, -2, -30), (1, 2, 30))
    write_obj(SCENES / "strip.obj", "strip lamp, cm; a closed box around the origin", strip, decimals=3)


def beaker():
    """A beaker and the water in it, in cm: two closed solids, 0.05 cm apart (outside every solid
    is air, so solids must not touch)."""
    parts, inner, gap = defaultdict(list), 3.2, 0.05
    glass = [(0, 0), (3.5, 0), (3.5, 10), (inner, 10), (inner, 0.3), (0, 0.3)]
    water = [(0, 0.3 + gap), (inner - gap, 0.3 + gap), (inner - gap, 7), (0, 7)]
    parts["glass", "glass"] += lathe(glass, 32)
    parts["water", "water"] += lathe(water, 32)
    write_obj(SCENES / "beaker.obj", "beaker of water, cm; two closed solids", parts, decimals=4)


# ------------------------------------------------------------------------------------- captors
def rows():
    """One cell of a field of tomato rows, and one of a field under panels: ground, plants, a panel."""
    for name, what, x, y in (("row-ground", "two rows of tomatoes", 1.6, 1.2), ("field-ground", "panels", 6, 2)):
        parts = defaultdict(list)
        parts["ground", None] += room((0, 0, 0), (x, y, 1))["floor"]
        write_obj(SCENES / f"{name}.obj", f"ground of a cell of {what}, {x} x {y} m; normals up", parts)
    parts = defaultdict(list)
    parts["front", "cell"] += polygon((-1.15, -1, 0), (1.15, -1, 0), (1.15, 1, 0), (-1.15, 1, 0))
    parts["back", "backsheet"] += polygon((-1.15, -1, -0.03), (-1.15, 1, -0.03), (1.15, 1, -0.03), (1.15, -1, -0.03))
    write_obj(SCENES / "panel.obj", "solar panels, 2.3 m wide, 2 m of a row along y; axis at the origin", parts)
    # plants stand in two rows 0.5 m apart, 0.3 m from each other; each is turned and grown otherwise
    lines = ["x,y,z,turn_deg,scale"]
    for i in range(8):
        x, y = 0.55 + 0.5 * (i // 4), 0.15 + 0.3 * (i % 4)
        lines.append(f"{x:.2f},{y:.2f},0.03,{GOLDEN_ANGLE * i % 360:.1f},{2.3 + 0.1 * (i * 5 % 4):.1f}")
    save(SCENES / "rows.csv", lines)
    # the same plants when they are younger
    for name, size in (("young", 0.35), ("half", 0.65)):
        grown = [line.rsplit(",", 1) for line in lines[1:]]
        smaller = [f"{rest},{size * float(scale):.2f}" for rest, scale in grown]
        save(SCENES / f"rows-{name}.csv", [lines[0], *smaller])


def greenhouse_captors():
    """Discs on the benches, within the canopy and below it, and a plane over each bench."""
    up, down, bench_grid, inside, below, planes = (0, 0, 1), (0, 0, -1), [], [], [], defaultdict(list)
    for b, y in enumerate(BENCH_CENTRES_Y, start=1):
        # 1 cm over the bench, on its centre line, at every half step of the plants
        for k in range(12):
            x = PLANT_START + PLANT_STEP * k / 2
            bench_grid.append((f"bench{b}-{k:02}", (x, y, BENCH_TOP + 0.01), 0.04, up))
        # at mid-height on the centre line: up, down, along and across the bench
        for k in range(4):
            x = PLANT_START + PLANT_STEP * (0.5 + 1.5 * k)
            for name, normal in (("up", up), ("down", down), ("east", (1, 0, 0)), ("north", (0, 1, 0))):
                inside.append((f"bench{b}-{k}-{name}", (x, y, 1.15), 0.04, normal))
        # under most leaves, between the pots of one row
        for k in range(5):
            x = PLANT_START + PLANT_STEP * (k + 0.5)
            below.append((f"bench{b}-{k}", (x, y - PLANT_ROW, 0.95), 0.05, up))
        x, w = BENCH_START, BENCH_WIDTH / 2
        planes[f"bench{b}", None] += room((x, y - w, 1.6), (x + BENCH_LENGTH, y + w, 2))["floor"]
    write_discs(CAPTORS / "bench-grid.csv", bench_grid)
    write_discs(CAPTORS / "inside-canopy.csv", inside)
    write_discs(CAPTORS / "below-canopy.csv", below)
    write_obj(CAPTORS / "canopy-top.obj", "a plane over each bench of the greenhouse, m; normals up", planes)


def chamber_captors():
    """Discs 1 cm over the shelf of the growth chamber, in cm."""
    rows = [(f"{row}{i}", (15 + 18 * i, y, 41), 3, (0, 0, 1))
            for row, y in (("a", 18), ("b", 40), ("c", 62)) for i in range(6)]
    write_discs(CAPTORS / "shelf-grid.csv", rows, decimals=1)


def crop_captors():
    """Discs 5 cm over the floor of the growth room, 30 cm apart."""
    rows = [(f"{row}{i}", (0.75 + 0.3 * i, y, 0.05), 0.1, (0, 0, 1))
            for row, y in zip("abcd", (1.05, 1.35, 1.65, 1.95)) for i in range(6)]
    write_discs(CAPTORS / "crop-grid.csv", rows)


# ------------------------------------------------------------------ a glasshouse in a meadow
# The glasshouse (m): its floor begins at the origin, its ridge runs along x. The meadow around it.
HOUSE_LENGTH, HOUSE_WIDTH, HOUSE_EAVE, HOUSE_RIDGE, WALL = 12.8, 6.4, 2.7, 4.3, 0.35
TONES = ("", "pale ", "dark ")  # of stones and slats
TABLES_Y, TABLE_TOP, TABLE_WIDTH = (1.30, 5.10), 0.76, 1.9
MEADOW = (-19.0, 43.0, -24.0, 30.0)


def away(x, y):
    """How far a place is from the house, m."""
    return math.hypot(max(-x, 0, x - HOUSE_LENGTH), max(-y, 0, y - HOUSE_WIDTH))


def relief(x, y):
    """Height of the meadow, m: even below the house, uneven around it, and hills far away."""
    rough = 0.05 * math.sin(1.3 * x + 0.4 * y) + 0.06 * math.sin(0.9 * y - 0.5 * x + 1) + 0.03 * math.sin(2.3 * y + x)
    hill = max(0, away(x, y) - 8) / 24
    height = hill**2 * (5 + 2 * math.sin(0.09 * x + 0.8) + 1.5 * math.sin(0.11 * y + 2))
    return -0.03 + min(1, away(x, y)) * (rough - 0.08) + height


def spread(i):
    """The i-th of places that fill a unit square evenly (a Kronecker sequence with the plastic number)."""
    return (i * 0.7548776662 + 0.5) % 1, (i * 0.5698402910 + 0.5) % 1


def meadow():
    """The ground, a tuft of grass, and the places of tufts and trees."""
    low_x, high_x, low_y, high_y = MEADOW

    def steps(low, high, count):  # closer to each other around the middle
        return [low + (high - low) * (0.5 + (t + 3 * t**3) / 8) for t in (2 * i / count - 1 for i in range(count + 1))]

    xs, ys = steps(low_x, high_x, 44), steps(low_y, high_y, 44)
    parts = {("meadow", "turf"): loft([[(x, y, relief(x, y)) for x in xs] for y in ys])}
    write_obj(SCENES / "meadow.obj", "meadow around the glasshouse, m; normals up", parts, decimals=2)

    blades = defaultdict(list)
    for i in range(90):
        turn, reach = GOLDEN_ANGLE * i, 0.30 * math.sqrt((i + 0.5) / 90)
        foot = (reach * math.cos(math.radians(turn)), reach * math.sin(math.radians(turn)), -0.02)
        start = Frame(foot).turned(yaw=turn + 70 * wobble(i), pitch=72 + 14 * wobble(3 * i))
        length, bend = 0.17 + 0.07 * wobble(2 * i + 1), 150 + 120 * wobble(5 * i)
        ends = [start.along(length * t, bend) for t in (0, 0.5, 1)]
        left, right = ([end.point(0, side * w, 0) for end, w in zip(ends, (0.004, 0.003))] for side in (1, -1))
        blades["blades", "grass" if i % 3 else "straw"] += polygon(right[0], right[1], left[1], left[0])
        blades["blades", "grass" if i % 3 else "straw"] += polygon(right[1], ends[2].origin, left[1])
    write_obj(SCENES / "grass.obj", "tuft of grass, m; origin at its foot", blades, decimals=3)

    lines = ["x,y,z,turn_deg,scale"]
    for i in range(9000):
        u, v = spread(i)
        x, y = -11 + 36 * u, -11 + 28 * v
        far = away(x, y)
        if 0.35 < far < 11 and (i * 0.618034) % 1 > far / 16:
            lines.append(f"{x:.2f},{y:.2f},{relief(x, y):.2f},{137 * i % 360},{1 + 0.35 * wobble(i) + 0.04 * far:.2f}")
    save(SCENES / "grass.csv", lines)

    lines = ["x,y,z,turn_deg,scale"]
    for i in range(110):
        u, v = spread(i)
        x, y = low_x + 2 + (high_x - low_x - 4) * u, low_y + 2 + (high_y - low_y - 4) * v
        if away(x, y) > 9.5:
            lines.append(f"{x:.2f},{y:.2f},{relief(x, y) - 0.1:.2f},{137 * i % 360},{1 + 0.3 * wobble(3 * i):.2f}")
    save(SCENES / "trees.csv", lines)


def tree():
    """A broad-leaved tree, 5.8 m tall: each branch ends in three, and the last ones bear leaves."""
    parts, count = defaultdict(list), 0

    def branch(start, length, radius, order):
        nonlocal count
        count += 1
        here = start.along(length, 12 * wobble(count) / length)
        parts["tree", "bark"] += tube([start.origin, here.origin], [radius, radius * 0.72], 5 if order > 2 else 3)
        if order:
            for k in range(3):
                lean = 34 + 9 * wobble(7 * count + k)
                about = here.turned(roll=120 * k + 60 * order + 30 * wobble(count + k)).turned(pitch=lean)
                branch(about, length * (0.76 + 0.12 * wobble(5 * count + k)), radius * 0.62, order - 1)
            return
        for k in range(11):
            at = start.along(length * (0.25 + 0.95 * k / 11), 0).turned(roll=GOLDEN_ANGLE * k, pitch=58 + 25 * wobble(3 * k))
            at = at.moved(0.02, 0, 0).turned(roll=60 * wobble(k + count))
            size = 0.2 + 0.05 * wobble(11 * k + count)
            parts["tree", "foliage"] += polygon(
                at.origin, at.point(size / 2, -0.3 * size, 0), at.point(size, 0, -0.02), at.point(size / 2, 0.3 * size, 0))

    branch(Frame((0, 0, -0.2)).turned(pitch=88), 1.6, 0.13, 5)
    write_obj(SCENES / "tree.obj", "broad-leaved tree, m; origin at its foot", parts, decimals=3)


def glasshouse():
    """The house: wall, floor, white steel frame, panes between its bars; and a table of slats."""
    parts, middle = defaultdict(list), HOUSE_WIDTH / 2
    parts["floor", "gravel"] += box((0, 0, -0.3), (HOUSE_LENGTH, HOUSE_WIDTH, 0.0))
    for k in range(16):  # flagstones of the path
        x = 0.05 + 0.8 * k
        parts["path", TONES[k * 5 % 3] + "stone"] += box((x, middle - 0.62, -0.02), (x + 0.78, middle + 0.62, 0.02))
    for y in (0, HOUSE_WIDTH):
        parts["wall", "brick"] += box((-0.1, y - 0.1, -0.4), (HOUSE_LENGTH + 0.1, y + 0.1, WALL))
    for x in (0, HOUSE_LENGTH):
        parts["wall", "brick"] += box((x - 0.1, 0.1, -0.4), (x + 0.1, HOUSE_WIDTH - 0.1, WALL))

    def roof(y):
        return HOUSE_EAVE + (HOUSE_RIDGE - HOUSE_EAVE) * (1 - abs(y - middle) / middle)

    sill, bays = WALL - 0.03, 16
    stations = [HOUSE_LENGTH * k / bays for k in range(bays + 1)]
    for y, z, width in ((0, HOUSE_EAVE, 0.10), (middle, HOUSE_RIDGE, 0.09), (HOUSE_WIDTH, HOUSE_EAVE, 0.10)):
        parts["frame", "paint"] += bar((-0.06, y, z), (HOUSE_LENGTH + 0.06, y, z), width)
    for y in (middle / 2, 1.5 * middle):
        parts["frame", "paint"] += bar((0, y, roof(y) - 0.05), (HOUSE_LENGTH, y, roof(y) - 0.05), 0.045)
    for k, x in enumerate(stations):
        main = k % 4 == 0
        for y in (0, HOUSE_WIDTH):
            parts["frame", "paint"] += bar((x, y, sill), (x, y, HOUSE_EAVE), 0.075 if main else 0.035)
            parts["frame", "paint"] += bar((x, y, HOUSE_EAVE), (x, middle, HOUSE_RIDGE), 0.075 if main else 0.035)
        if main and 0 < k < bays:  # a truss
            parts["frame", "paint"] += bar((x, 0, HOUSE_EAVE), (x, HOUSE_WIDTH, HOUSE_EAVE), 0.05)
            for y in (middle / 2, middle, 1.5 * middle):
                parts["frame", "paint"] += bar((x, y, HOUSE_EAVE), (x, y, roof(y) - 0.05), 0.03)
    for y in (0, HOUSE_WIDTH):
        for x, X in zip(stations, stations[1:]):
            for (v, z), (V, Z) in (((y, sill), (y, HOUSE_EAVE)), ((y, HOUSE_EAVE), (middle, HOUSE_RIDGE))):
                parts["panes", "glass"] += polygon((x, v, z), (X, v, z), (X, V, Z), (x, V, Z))
    posts = [HOUSE_WIDTH * k / 8 for k in range(9)]
    for x in (0, HOUSE_LENGTH):
        parts["frame", "paint"] += bar((x, 0, HOUSE_EAVE), (x, HOUSE_WIDTH, HOUSE_EAVE), 0.06)
        for y in posts[1:-1]:
            parts["frame", "paint"] += bar((x, y, sill), (x, y, roof(y)), 0.06 if y in (posts[3], posts[5]) else 0.035)
        for y, Y in zip(posts, posts[1:]):
            parts["panes", "glass"] += polygon((x, y, sill), (x, Y, sill), (x, Y, roof(Y)), (x, y, roof(y)))
    write_obj(SCENES / "glasshouse.obj", "glasshouse, 12.8 x 6.4 x 4.3 m; a corner of its floor at the origin", parts, 3)

    parts, x, y = defaultdict(list), 5.6, TABLE_WIDTH / 2
    for k in range(13):
        v = -y + TABLE_WIDTH * k / 13
        parts["slats", TONES[k * 5 % 3] + "wood"] += box((-x, v + 0.012, TABLE_TOP - 0.025), (x, v + 0.134, TABLE_TOP))
    for k in range(7):
        u = -x + 0.3 + (2 * x - 0.6) * k / 6
        parts["rails", "wood"] += box((u - 0.03, -y + 0.05, TABLE_TOP - 0.09), (u + 0.03, y - 0.05, TABLE_TOP - 0.024))
        for v in (-y + 0.12, y - 0.12):
            parts["legs", "aluminium"] += bar((u, v, -0.02), (u, v, TABLE_TOP - 0.08), 0.05)
    write_obj(SCENES / "table.obj", "table of slats, 11.2 x 1.9 x 0.76 m; origin on the floor below its centre", parts, 3)

    # plants in pots on the tables: four rows, by turns, each turned and grown otherwise
    tables = {name: ["x,y,z,turn_deg,scale"] for name in ("house-pots", "house-tomatoes", "house-cucumbers")}
    for side, y in enumerate(TABLES_Y):
        for row in range(3):
            for k in range(15):
                i = k + 15 * row + 45 * side
                x, v = 1.3 + 0.72 * k + 0.36 * (row % 2) + 0.05 * wobble(i), y + 0.6 * (row - 1) + 0.05 * wobble(2 * i)
                tables["house-pots"].append(f"{x:.3f},{v:.3f},{TABLE_TOP + 0.001},0,1.3")
                kind = "house-cucumbers" if side else "house-tomatoes"
                tables[kind].append(f"{x:.3f},{v:.3f},{TABLE_TOP + 0.131:.3f},{GOLDEN_ANGLE * i % 360:.0f},{1.75 + 0.3 * wobble(3 * i):.2f}")
    for name, lines in tables.items():
        save(SCENES / f"{name}.csv", lines)


# Light of a deep blue sky in the same bands, umol per J of its whole light: the sun's spectrum scattered by air (three quarters at 550 nm,
# by Rayleigh's law as wavelength to the -4) and by fine haze (to the -1.3, after Angstrom), with as much of it visible as
# of the standard's clear sky.
CLEAR_SKY = [0.515, 0.521, 0.414, 0.334, 0.271, 0.216]
# The sun's light near the horizon, likewise: the standard's (ASTM G173-03) after another 4.1 of the air's depth, by
# the same laws with a haze of 0.08 at 1000 nm, over 0.43, the fraction of all its energy that is left.
LOW_SUN = [0.051, 0.136, 0.217, 0.301, 0.377, 0.432]
HOUSE_BANDS = {
    "bands": [{"name": str(low), "from_nm": low, "to_nm": low + 50} for low in range(400, 700, 50)],
    "sums": {"PAR": [str(low) for low in range(400, 700, 50)]},
}
# Optical values of bands of 50 nm from 400 to 700 nm. Those of leaves are the means of what
# PROSPECT-D makes of (chlorophyll, ug/cm2) 42 (leaf), 30 (young), 28 (grass), 16 (straw), 36 (foliage) and,
# with a structure of 1.8 for 1.5, 20 (vein); carotenoids are a fifth of chlorophyll.
HOUSE_MATERIALS = {
    "leaf": {"type": "leaf", "reflectance": [0.042, 0.042, 0.113, 0.109, 0.060, 0.046],
             "transmittance": [0.001, 0.006, 0.103, 0.105, 0.047, 0.023]},
    "young": {"type": "leaf", "reflectance": [0.042, 0.047, 0.147, 0.144, 0.082, 0.058],
              "transmittance": [0.002, 0.015, 0.141, 0.146, 0.077, 0.041]},
    "vein": {"type": "leaf", "reflectance": [0.048, 0.069, 0.223, 0.224, 0.142, 0.095],
             "transmittance": [0.006, 0.026, 0.160, 0.167, 0.100, 0.058]},
    "grass": {"type": "leaf", "reflectance": [0.043, 0.048, 0.154, 0.152, 0.088, 0.061],
              "transmittance": [0.003, 0.018, 0.149, 0.155, 0.085, 0.046]},
    "straw": {"type": "leaf", "reflectance": [0.048, 0.071, 0.221, 0.222, 0.144, 0.097],
              "transmittance": [0.015, 0.051, 0.219, 0.229, 0.152, 0.095]},
    "foliage": {"type": "leaf", "reflectance": [0.042, 0.044, 0.128, 0.124, 0.069, 0.051],
                "transmittance": [0.001, 0.010, 0.120, 0.123, 0.060, 0.031]},
    "stem": {"type": "lambert", "reflectance": [0.07, 0.08, 0.18, 0.20, 0.14, 0.10]},
    "turf": {"type": "lambert", "reflectance": [0.025, 0.035, 0.085, 0.085, 0.055, 0.045]},
    "bark": {"type": "lambert", "reflectance": [0.06, 0.08, 0.10, 0.13, 0.15, 0.17]},
    "soil": {"type": "lambert", "reflectance": [0.04, 0.05, 0.07, 0.09, 0.11, 0.12]},
    "pot": {"type": "lambert", "reflectance": [0.08, 0.10, 0.14, 0.24, 0.38, 0.42]},
    "brick": {"type": "lambert", "reflectance": [0.10, 0.11, 0.14, 0.22, 0.33, 0.36]},
    "stone": {"type": "lambert", "reflectance": [0.22, 0.24, 0.26, 0.27, 0.28, 0.28]},
    "pale stone": {"type": "lambert", "reflectance": [0.24, 0.26, 0.28, 0.30, 0.31, 0.31]},
    "dark stone": {"type": "lambert", "reflectance": [0.18, 0.20, 0.22, 0.23, 0.24, 0.24]},
    "gravel": {"type": "lambert", "reflectance": [0.16, 0.17, 0.19, 0.21, 0.22, 0.23]},
    "wood": {"type": "lambert", "reflectance": [0.17, 0.20, 0.25, 0.30, 0.34, 0.36]},
    "pale wood": {"type": "lambert", "reflectance": [0.20, 0.24, 0.29, 0.34, 0.38, 0.40]},
    "dark wood": {"type": "lambert", "reflectance": [0.14, 0.17, 0.21, 0.26, 0.30, 0.32]},
    "paint": {"type": "lambert", "reflectance": [0.70, 0.80, 0.82, 0.82, 0.81, 0.81]},
    "aluminium": {"type": "phong", "reflectance": 0.3, "specular": 0.45, "exponent": 20},
    "glass": {"type": "transparent", "ior": 1.52, "tint": [0.975, 0.98, 0.985, 0.985, 0.98, 0.97], "thin": True},
}


def glasshouses():
    """The glasshouse at noon on a clear day in June, and at nightfall under rows of diodes."""
    scene = {
        "name": "", "unit": "m", "quantity": "umol/s", **HOUSE_BANDS,
        "materials": HOUSE_MATERIALS,
        "objects": [
            {"name": "house", "obj": "glasshouse.obj"},
            {"name": "tables", "obj": "table.obj",
             "instances": [{"translate": [HOUSE_LENGTH / 2, y, 0]} for y in TABLES_Y]},
            {"name": "pots", "obj": "pot-fine.obj", "instances": {"csv": "house-pots.csv"}},
            {"name": "tomato", "obj": "tomato-fine.obj", "instances": {"csv": "house-tomatoes.csv"}, "captor": "instance"},
            {"name": "cucumber", "obj": "cucumber-fine.obj", "instances": {"csv": "house-cucumbers.csv"}, "captor": "instance"},
        ],
        "lights": [],
        "captors": [
            {"name": f"table {name}",
             "grid": {"x": [1, 11.8], "y": [y - 0.8, y + 0.8], "nx": 13, "ny": 3, "z": 1.7, "radius": 0.05}}
            for name, y in zip("AB", TABLES_Y)],
        "camera": {"position": [0.6, 3.3, 1.7], "look_at": [8.0, 3.15, 1.2], "up": [0, 0, 1], "fov_deg": 72,
                   "width": 1600, "height": 900},
        "settings": {"photons": 4000000, "seed": 1},
    }
    outside = [
        {"name": "meadow", "obj": "meadow.obj"},
        {"name": "grass", "obj": "grass.obj", "instances": {"csv": "grass.csv"}},
        {"name": "trees", "obj": "tree.obj", "instances": {"csv": "trees.csv"}},
    ]
    noon = {
        "name": "glasshouse at noon in June", "objects": scene["objects"] + outside,
        "site": {"latitude": LATITUDE, "longitude": LONGITUDE}, "time": "2025-06-21T13:20+02:00",
        "weather": {"direct_normal": 880, "diffuse_horizontal": 95},
        "lights": [{"type": "sun", "ground": 0.1}, {"type": "sky", "share": CLEAR_SKY, "ground": 0.1}],
    }
    save_scene(SCENES / "glasshouse-noon.json", {**scene, **noon})
    # bars of 1.5 m with 150 umol/s: 19 % blue around 450 nm, 63 % red around 660 nm, and some white, without
    # which leaves are black to the eye; behind the panes the last light of a clear evening
    lamps = [
        {"type": "area", "name": f"bar {row}{k + 1}", "power": [14, 14, 8, 9, 10, 95],
         "vertices": [[1.2 + 1.8 * k, y - 0.02, 2.45], [1.2 + 1.8 * k, y + 0.02, 2.45],
                      [2.7 + 1.8 * k, y + 0.02, 2.45], [2.7 + 1.8 * k, y - 0.02, 2.45]]}
        for row, y in zip("abcd", (0.85, 1.75, 4.65, 5.55)) for k in range(6)]
    indoors = {name: keys for name, keys in HOUSE_MATERIALS.items() if name not in ("grass", "straw", "turf", "bark", "foliage")}
    dusk = {"type": "sky", "name": "dusk", "model": "uniform", "ground": 0.03,
            "irradiance": [0.24, 0.26, 0.13, 0.05, 0.03, 0.03]}
    night = {"name": "glasshouse at nightfall under diodes", "materials": indoors, "lights": lamps + [dusk]}
    save_scene(SCENES / "glasshouse-night.json", {**scene, **night})


def evening_sky():
    """The sky of a low sun, umol/m2/s: a glow about the sun (CIE sky 13), and an even blue above all (CIE sky 5).

    The light of both has gone farther through the air than that of a high sun: what is left of it is redder as
    the cube of the wavelength, and what was scattered on the way bluer."""
    def light(name, cie_type, share, power, total):
        values = [s * ((425 + 50 * i) / 550) ** power for i, s in enumerate(share)]
        return {"type": "sky", "name": name, "model": "cie", "cie_type": cie_type,
                "irradiance": [round(total * value / sum(values), 1) for value in values]}
    return [light("glow", 13, LOW_SUN, 3, 40), light("blue", 5, CLEAR_SKY, -3, 45)]


def evening():
    """A field of tomato rows without end, in low sun: 48 plants in a cell of three pairs of rows."""
    x, y = 4.8, 2.4
    parts = {("ground", "soil"): room((0, 0, 0), (x, y, 1))["floor"]}
    write_obj(SCENES / "evening-ground.obj", f"ground of a cell of tomato rows, {x} x {y} m; normals up", parts)
    lines = ["x,y,z,turn_deg,scale"]
    for i in range(48):
        across = 0.55 + 0.5 * (i // 8 % 2) + 1.6 * (i // 16) + 0.05 * wobble(5 * i)
        along = 0.15 + 0.3 * (i % 8) + 0.05 * wobble(7 * i + 3)
        lines.append(f"{across:.2f},{along:.2f},0.03,{GOLDEN_ANGLE * i % 360:.0f},{2.2 + 0.3 * wobble(3 * i):.2f}")
    save(SCENES / "evening-rows.csv", lines)
    needed = ("leaf", "young", "vein", "stem")
    save_scene(SCENES / "evening.json", {
        "name": "rows of tomatoes in the evening", "unit": "m", "quantity": "umol/s", **HOUSE_BANDS,
        "periodic": {"x": [0, x], "y": [0, y]},
        "materials": {**{name: HOUSE_MATERIALS[name] for name in needed},
                      "soil": {"type": "lambert", "reflectance": [0.06, 0.08, 0.11, 0.15, 0.19, 0.21]}},
        "objects": [
            {"name": "tomato", "obj": "tomato-fine.obj", "instances": {"csv": "evening-rows.csv"}, "captor": True},
            {"name": "ground", "obj": "evening-ground.obj", "captor": True, "ground": True}],
        "site": {"latitude": LATITUDE, "longitude": LONGITUDE}, "time": "2025-06-21T20:34+02:00",
        "weather": {"direct_normal": 450, "diffuse_horizontal": 45},
        "lights": [{"type": "sun", "share": LOW_SUN}, *evening_sky()],
        "camera": {"position": [1.75, -1.2, 1.8], "look_at": [0.6, 3.5, 1.45], "up": [0, 0, 1], "fov_deg": 62,
                   "width": 1200, "height": 675},
        "settings": {"photons": 2000000, "seed": 1},
    })


# --------------------------------------------------------------------------- a vertical farm
# Two racks of the farm (m) with an aisle between them: each has tiers of trays, with bars of diodes above.
FARM_LENGTH, TIERS, TIER_LOW, TIER_STEP, TRAY = 6.0, 4, 0.35, 0.62, 0.66
RACKS_Y = (0.75, 2.85)


def vertical_farm():
    """A vertical farm: a white room with two racks of four tiers, 384 heads of lettuce, and diodes over them."""
    half, length = TRAY / 2, FARM_LENGTH
    parts = defaultdict(list)
    for name, wall in room((-0.8, 0, 0), (length + 0.8, 3.6, 3.0)).items():
        parts[name, "floor" if name == "floor" else "wall"] += wall
    for y in RACKS_Y:
        for x in (0.0, length / 3, 2 * length / 3, length):
            for v in (y - half - 0.03, y + half + 0.03):
                parts["posts", "steel"] += bar((x, v, -0.02), (x, v, 2.85), 0.04)
        for tier in range(TIERS):
            z = TIER_LOW + TIER_STEP * tier
            for v in (y - half - 0.03, y + half + 0.03):
                parts["beams", "steel"] += bar((0, v, z - 0.03), (length, v, z - 0.03), 0.035)
            parts["trays", "tray"] += box((0.03, y - half, z - 0.05), (length - 0.03, y + half, z))
            # a board that bears the bars, and reflects what comes from below
            parts["boards", "tray"] += box((0.03, y - half, z + 0.52), (length - 0.03, y + half, z + 0.53))
    write_obj(SCENES / "farm.obj", "vertical farm, 7.6 x 3.6 x 3 m: room and racks; normals of the room in", parts, 3)

    lines = ["x,y,z,turn_deg,scale"]
    for k in range(2 * TIERS * 48):
        rack, tier, row, place = k // (TIERS * 48), k // 48 % TIERS, k % 2, k // 2 % 24
        x, y = 0.17 + 0.246 * place, RACKS_Y[rack] + 0.165 * (2 * row - 1)
        z = TIER_LOW + TIER_STEP * tier
        lines.append(f"{x + 0.01 * wobble(k):.3f},{y + 0.01 * wobble(3 * k):.3f},{z + 0.001:.3f},{GOLDEN_ANGLE * k % 360:.0f},{0.95 + 0.1 * wobble(5 * k):.2f}")
    save(SCENES / "farm-lettuces.csv", lines)

    lamps = [
        {"type": "area", "name": f"{rack}{tier + 1}{row}{k + 1}", "power": [14, 16, 18, 19, 21, 22],
         "vertices": [[round(c, 3) for c in corner] for corner in (
             (x, v - 0.012, z), (x, v + 0.012, z), (x + 1.16, v + 0.012, z), (x + 1.16, v - 0.012, z))]}
        for rack, y in zip("AB", RACKS_Y) for tier in range(TIERS)
        for row, v in zip("lr", (y - 0.165, y + 0.165)) for k in range(5)
        for x, z in [(0.02 + 1.2 * k, TIER_LOW + TIER_STEP * tier + 0.515)]]
    save_scene(SCENES / "vertical-farm.json", {
        "name": "a vertical farm", "unit": "m", "quantity": "umol/s", **HOUSE_BANDS,
        "materials": {"leaf": HOUSE_MATERIALS["grass"], "vein": HOUSE_MATERIALS["vein"], "heart": HOUSE_MATERIALS["straw"],
                      "wall": {"type": "lambert", "reflectance": 0.75}, "tray": {"type": "lambert", "reflectance": 0.8},
                      "floor": {"type": "phong", "reflectance": 0.3, "specular": 0.12, "exponent": 60},
                      "steel": {"type": "phong", "reflectance": 0.35, "specular": 0.3, "exponent": 25}},
        "objects": [
            {"name": "farm", "obj": "farm.obj"},
            {"name": "lettuce", "obj": "lettuce.obj", "instances": {"csv": "farm-lettuces.csv"}, "captor": "instance"}],
        "lights": lamps,
        "captors": [
            {"name": f"tier {rack}{tier + 1}", "grid": {
                "x": [0.2, length - 0.2], "y": [y - 0.25, y + 0.25], "nx": 15, "ny": 2,
                "z": round(TIER_LOW + TIER_STEP * tier + 0.15, 3), "radius": 0.04}}
            for rack, y in zip("AB", RACKS_Y) for tier in range(TIERS)],
        "camera": {"position": [-0.6, 1.75, 1.62], "look_at": [3.2, 1.95, 1.25], "up": [0, 0, 1], "fov_deg": 72,
                   "width": 1200, "height": 675},
        "settings": {"photons": 4000000, "seed": 1},
    })


# ------------------------------------------------------------------------------------ daylight
LATITUDE, LONGITUDE = 43.61, 3.88
# How much of the light above the air comes down, day after day, in turns: in the mean of December and of
# June, and how far from it; a clear month has fewer dull days.
CLEARNESS = {"winter": (0.46, 0.26), "summer": (0.61, 0.18)}


def sun(time):
    """Sine of the sun's elevation, and the day's extraterrestrial irradiance (W/m2). (The
    Astronomical Almanac's formulas after Michalsky 1988, Solar Energy 40:227; Spencer 1971.)"""
    n = (time - datetime.datetime(2000, 1, 1, 12, tzinfo=datetime.timezone.utc)).total_seconds() / 86400
    anomaly = math.radians(357.528 + 0.9856003 * n)
    ecliptic = math.radians(280.460 + 0.9856474 * n + 1.915 * math.sin(anomaly) + 0.020 * math.sin(2 * anomaly))
    tilt = math.radians(23.439 - 4e-7 * n)
    ascension = math.atan2(math.cos(tilt) * math.sin(ecliptic), math.cos(ecliptic))
    sine = math.sin(tilt) * math.sin(ecliptic)
    hour = math.radians(15 * (6.697375 + 0.0657098242 * n + (24 * (n + 0.5)) % 24) + LONGITUDE) - ascension
    latitude = math.radians(LATITUDE)
    height = sine * math.sin(latitude) + math.sqrt(1 - sine * sine) * math.cos(latitude) * math.cos(hour)
    day = 2 * math.pi * (time.timetuple().tm_yday - 1) / 365
    return height, 1367 * (1.00011 + 0.034221 * math.cos(day) + 0.00128 * math.sin(day)
                           + 0.000719 * math.cos(2 * day) + 0.000077 * math.sin(2 * day))


def weather():
    """A made-up year of hours in the south of France: not measured, of the usual size. Days differ in
    clearness; global light is split into direct and diffuse after Erbs et al. 1982, Solar Energy 28:293."""
    zone = datetime.timezone(datetime.timedelta(hours=1))
    first, rows = datetime.datetime(2025, 1, 1, tzinfo=zone), ["time,ghi,dni,dhi"]
    for day in range(365):
        season = 0.5 - 0.5 * math.cos(2 * math.pi * (day + 10) / 365)
        mean, spread = (w + (s - w) * season for w, s in zip(CLEARNESS["winter"], CLEARNESS["summer"]))
        turn = (day * 0.6180339887498949 + 0.1) % 1
        clearness = mean + spread * math.sin(2 * math.pi * turn) * (0.75 + 0.25 * math.cos(0.9 * day))
        for hour in range(24):
            start = first + datetime.timedelta(days=day, hours=hour)
            height, above = sun(start + datetime.timedelta(minutes=30))
            if height <= -0.15 and not (day == 0 and hour == 0 or day == 364 and hour == 23):
                continue
            # long ways through the air dim what is low
            k = clearness * (0.35 + 0.65 * min(1, max(height, 0) / 0.35)) if height > 0 else 0
            if k <= 0.22:
                part = 1 - 0.09 * k
            else:
                part = 0.9511 - 0.1604 * k + 4.388 * k**2 - 16.638 * k**3 + 12.336 * k**4
            overall = k * above * max(height, 0)
            diffuse = round(overall * part) if height > 0.05 else round(overall)
            direct = round((overall - diffuse) / height) if height > 0.05 else 0
            direct = max(direct, 0)
            overall = round(direct * max(height, 0) + diffuse)
            rows.append(f"{start.isoformat(timespec='minutes')},{overall},{direct},{diffuse}")
    save(SCENES / "montpellier.csv", rows)


# Optical values of blue, green and red light (400 to 700 nm by the hundred), of which those of
# PAR in greenhouse.json are about the mean.
BY_DAY = {
    "leaf": {"reflectance": [0.05, 0.12, 0.06], "transmittance": [0.02, 0.10, 0.04],
             "back": {"reflectance": [0.09, 0.18, 0.11]}},
    "stem": {"reflectance": [0.07, 0.18, 0.10]},
    "soil": {"reflectance": [0.05, 0.08, 0.11]},
    "pot": {"reflectance": [0.10, 0.20, 0.36]},
    "concrete": {"reflectance": [0.27, 0.30, 0.32]},
    "polystyrene": {"reflectance": 0.88},
    "glass": {"tint": [0.98, 0.985, 0.975]},
}
# A 600 W high-pressure sodium lamp: 1080 umol/s, mostly yellow and red.
LAMP = [55, 515, 510]


def greenhouse_by_day():
    """greenhouse.json under sun and sky, in umol/s: without lamps at noon in June, and a year with them."""
    scene = json.loads((SCENES / "greenhouse.json").read_text())
    lamps = [dict(lamp, power=LAMP) for lamp in scene["lights"]]
    for name, values in BY_DAY.items():
        scene["materials"][name].update(values)
    daylight = [{"type": "sun", "ground": 0.2}, {"type": "sky", "ground": 0.2}]
    names = ["blue", "green", "red"]
    scene.update({
        "quantity": "umol/s",
        "bands": [{"name": n, "from_nm": f, "to_nm": f + 100} for n, f in zip(names, (400, 500, 600))],
        "sums": {"PAR": names},
        "site": {"latitude": LATITUDE, "longitude": LONGITUDE},
        "weather": {"file": "montpellier.csv", "stamp": "start"},
    })
    for name, title, time, lights in [
            ("greenhouse-day", "greenhouse bay by day", "2025-06-21T13:46+02:00", daylight),
            ("greenhouse-year", "greenhouse bay in a year", "year", daylight + lamps)]:
        save_scene(SCENES / f"{name}.json", {**scene, "name": title, "time": time, "lights": lights})


def season():
    """A cell of a greenhouse without end, in a tomato season from winter to summer: canopy.json's rows
    under a glass roof with bars, light-emitting diodes and an energy screen, which is open at first."""
    scene = json.loads((SCENES / "canopy.json").read_text())
    x, y, roof, screen = 1.6, 1.2, 4.2, 3.8
    for name, title, z in (("roof", "glass roof", roof), ("screen", "energy screen", screen)):
        parts = defaultdict(list)
        pane = polygon((0, 0, z), (x, 0, z), (x, y, z), (0, y, z))
        if name == "roof":
            parts["panes", "glass"] += pane
            # an eighth of the roof is bars and gutter
            low, high = ((0.1, 0, z + 0.01), (0.3, 0, z + 0.01)), ((0.1, 0, z + 0.1), (0.3, 0, z + 0.1))
            for a, b in ((low[1], low[0]), (high[0], high[1]), (low[0], high[0]), (high[1], low[1])):
                parts["bars", "aluminium"] += polygon(a, b, (b[0], y, b[2]), (a[0], y, a[2]))
        else:
            parts["screen", "screen"] += pane
        write_obj(SCENES / f"season-{name}.obj", f"{title} of a cell of {x} x {y} m", parts)
    materials = {name: {key: cut(value) for key, value in material.items()}
                 for name, material in scene["materials"].items()}
    materials["glass"] = {"type": "transparent", "thin": True, "ior": 1.52, "tint": 0.95}
    materials["aluminium"] = {"type": "lambert", "reflectance": 0.6}
    materials["screen"] = {"type": "leaf", "ior": 1, "reflectance": 0.2, "transmittance": 0.7}
    lamps = [{"type": "area", "name": f"LED {i + 1}", "power": [20, 0, 180], "watts": 61,
              "vertices": [[at, 0.1, 3.3], [at, 1.1, 3.3], [at + 0.06, 1.1, 3.3], [at + 0.06, 0.1, 3.3]]}
             for i, at in enumerate((0.37, 1.17))]
    tomato, ground = scene["objects"]
    names = ["blue", "green", "red"]
    save_scene(SCENES / "season.json", {
        "name": "a tomato season",
        "quantity": "umol/s",
        "bands": scene["bands"][:3],
        "sums": {"PAR": names},
        "periodic": scene["periodic"],
        "materials": materials,
        "objects": [dict(tomato, group="tomato"), ground, {"name": "roof", "obj": "season-roof.obj"},
                    {"name": "screen", "obj": "season-screen.obj", "present": False}],
        "lights": [{"type": "sun"}, {"type": "sky"}, *lamps],
        "captors": [{"name": "top", "grid": {"x": [0, x], "y": [0, y], "z": 1.6, "nx": 4, "ny": 3,
                                             "radius": 0.1, "normal": [0, 0, 1]}}],
        "site": {"latitude": LATITUDE, "longitude": LONGITUDE},
        "weather": {"file": "montpellier.csv", "stamp": "start"},
        "time": {"from": "2025-01-01T00:00+01:00", "to": "2025-07-01T00:00+01:00"},
        "settings": {"photons": 4000000, "seed": 1},
    })


def cut(value):
    """A property of canopy.json without its last band, which is not in season.json."""
    if isinstance(value, dict):
        return {key: cut(entry) for key, entry in value.items()}
    return value[:3] if isinstance(value, list) else value


def save_scene(path, scene):
    """A scene with a line for each entry of its lists and objects, and of an object's instances."""
    def entries(values, depth):
        pad = "  " * depth
        if isinstance(values, dict):
            lines = [f"{json.dumps(k)}: {text(v, depth + 1)}" for k, v in values.items()]
            return "{\n" + ",\n".join(pad + "  " + line for line in lines) + f"\n{pad}}}"
        return "[\n" + ",\n".join(pad + "  " + text(v, depth + 1) for v in values) + f"\n{pad}]"

    def text(value, depth):
        flat = json.dumps(value)
        short = len(flat) <= 110
        return flat if short or not isinstance(value, (dict, list)) else entries(value, depth)

    lines = [f"  {json.dumps(k)}: {text(v, 1)}" for k, v in scene.items()]
    save(path, ["{", *",\n".join(lines).split("\n"), "}"])


def main():
    """Write every file."""
    CAPTORS.mkdir(exist_ok=True)
    for make in (tomato, cucumber, pot, unit_room, greenhouse, bench, reflector, chamber, beaker, rows,
                 greenhouse_captors, chamber_captors, crop_captors, weather, greenhouse_by_day, season,
                 meadow, tree, glasshouse, glasshouses, evening, lettuce, vertical_farm):
        make()
    for make in (tomato, cucumber, pot):
        make(fine=True)


if __name__ == "__main__":
    main()
