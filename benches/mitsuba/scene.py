"""A phylux scene file as plain arrays: triangles by material, lamps, and the faces of captors."""

import csv
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001}
TUBE_SIDES = 64  # of the prism that phylux makes of a tube with a material
DISC_SIDES = 32  # of the fan of triangles that it makes of a disc
BLACK = "mitsuba comparison black"


@dataclass
class Lamp:
    """Triangles that shine from their front, and their power per band, W."""

    triangles: np.ndarray
    power: np.ndarray


@dataclass
class Face:
    """One side of a captor: triangles whose front is the side that counts."""

    name: tuple
    triangles: np.ndarray


@dataclass
class World:
    """All of a scene that the comparison needs, in metres."""

    bands: list
    materials: dict
    surfaces: dict  # material name -> triangles (n, 3, 3)
    lamps: list
    faces: list


def variant(path, out):
    """Writes the scene that both programs run: captors that are sensors only, and lamps that are black
    obstacles (in Mitsuba every lamp is one)."""
    path = Path(path).resolve()
    scene = json.loads(path.read_text())
    for part in scene.get("objects", []) + scene["lights"] + scene["captors"]:
        for key in ("obj", "csv"):
            if key in part:
                part[key] = str((path.parent / part[key]).resolve())
    for part in scene.get("objects", []):
        part.pop("captor", None)
        part.pop("group", None)
    scene["materials"][BLACK] = {"type": "lambert", "reflectance": 0}
    for light in scene["lights"]:
        light["material"] = BLACK
    Path(out).write_text(json.dumps(scene, indent=1))


def load(path):
    """Reads what `variant` wrote."""
    scene = json.loads(Path(path).read_text())
    bands = [band["name"] for band in scene.get("bands", [{"name": "all"}])]
    unit = UNITS[scene.get("unit", "m")]
    surfaces = {}
    for part in scene.get("objects", []):
        for _, material, triangles in read_obj(part["obj"]):
            placed = [move(triangles * unit, at, unit) for at in places(part)]
            surfaces.setdefault(part.get("material", material), []).extend(placed)
    surfaces = {name: np.concatenate(parts) for name, parts in surfaces.items()}
    lamps, caps = [], []
    for light in scene["lights"]:
        triangles, cap = lamp_triangles(light, unit)
        lamps.append(Lamp(triangles, per_band(light["power"], bands)))
        caps.append(cap)
    surfaces[BLACK] = np.concatenate(caps)
    surfaces = {name: triangles for name, triangles in surfaces.items() if len(triangles)}
    faces = [face for entry in scene["captors"] for face in captor_faces(entry, unit)]
    return World(bands, scene["materials"], surfaces, lamps, faces)


def per_band(value, bands):
    """One number for all bands, or one for each."""
    return np.broadcast_to(np.asarray(value, float), (len(bands),))


def read_obj(path):
    """Triangles of an OBJ file by group and material."""
    vertices, parts, group, material = [], {}, Path(path).stem, None
    for line in Path(path).read_text().splitlines():
        key, *words = line.split("#")[0].split() or [""]
        if key == "v":
            vertices.append([float(word) for word in words[:3]])
        elif key in ("o", "g"):
            group = " ".join(words)
        elif key == "usemtl":
            material = " ".join(words)
        elif key == "f":
            corners = [int(word.split("/")[0]) for word in words]
            corners = [c - 1 if c > 0 else len(vertices) + c for c in corners]
            fan = [[corners[0], b, c] for b, c in zip(corners[1:], corners[2:])]
            parts.setdefault((group, material), []).extend(fan)
    vertices = np.array(vertices)
    return [(*key, vertices[np.array(fans)]) for key, fans in parts.items()]


def places(part):
    """Where an object stands."""
    return part.get("instances") or [part.get("transform", {})]


def move(triangles, at, unit):
    """Scale, then turn about x, y and z, then shift."""
    turned = triangles * at.get("scale", 1.0)
    for axis, degrees in enumerate(at.get("rotate_deg", [0, 0, 0])):
        sin, cos = np.sin(np.radians(degrees)), np.cos(np.radians(degrees))
        a, b = (axis + 1) % 3, (axis + 2) % 3
        turn = np.eye(3)
        turn[a, a], turn[a, b], turn[b, a], turn[b, b] = cos, -sin, sin, cos
        turned = turned @ turn.T
    return turned + np.array(at.get("translate", [0, 0, 0])) * unit


def fan(corners):
    """Triangles of a convex polygon."""
    return np.array([[corners[0], b, c] for b, c in zip(corners[1:], corners[2:])])


def lamp_triangles(light, unit):
    """What shines, and the black caps of a tube."""
    none = np.zeros((0, 3, 3))
    if light["type"] == "area" and not light.get("two_sided"):
        if "vertices" in light:
            return fan(np.array(light["vertices"]) * unit), none
        parts = [triangles for *_, triangles in read_obj(light["obj"])]
        return np.concatenate([move(p * unit, at, unit) for p in parts for at in places(light)]), none
    if light["type"] == "tube" and light.get("radius", 0) > 0:
        return prism(*(np.array(light[end]) * unit for end in ("from", "to")), light["radius"] * unit)
    raise SystemExit(f"a light of type {light['type']}: compare one-sided areas and thick tubes only")


def prism(start, end, radius):
    """The closed prism of the lateral area of a tube, normals out: sides and caps."""
    axis = (end - start) / np.linalg.norm(end - start)
    corners = circle(axis, TUBE_SIDES) * radius * (np.pi / TUBE_SIDES) / np.sin(np.pi / TUBE_SIDES)
    sides, caps = [], []
    for p, q in zip(corners, np.roll(corners, -1, axis=0)):
        sides += [[start + p, start + q, end + q], [start + p, end + q, end + p]]
        caps += [[end, end + p, end + q], [start, start + q, start + p]]
    return np.array(sides), np.array(caps)


def circle(normal, sides):
    """Unit vectors about a normal, counter-clockwise."""
    normal = normal / np.linalg.norm(normal)
    tangent = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    tangent /= np.linalg.norm(tangent)
    turn = 2 * np.pi * np.arange(sides)[:, None] / sides
    return np.cos(turn) * tangent + np.sin(turn) * np.cross(normal, tangent)


def disc(center, normal, radius):
    """A fan of the disc's true area."""
    rim = radius * np.sqrt(2 * np.pi / DISC_SIDES / np.sin(2 * np.pi / DISC_SIDES))
    corners = center + rim * circle(normal, DISC_SIDES)
    return np.array([[center, p, q] for p, q in zip(corners, np.roll(corners, -1, axis=0))])


def captor_faces(entry, unit):
    """The faces of one entry of a scene's captors, named (id, "front" or "back")."""
    shapes = []
    if "csv" in entry:
        stem = entry.get("name", Path(entry["csv"]).stem)
        with open(entry["csv"], newline="") as file:
            for number, row in enumerate(csv.DictReader(file)):
                center, normal = (np.array([float(row[key]) for key in keys]) for keys in
                                  (("x", "y", "z"), ("nx", "ny", "nz")))
                shape = disc(center * unit, normal, float(row["radius"]) * unit)
                shapes.append((f"{stem}/{row.get('id') or number}", shape))
    elif "obj" in entry:
        stem, groups = entry.get("name", Path(entry["obj"]).stem), {}
        for group, _, triangles in read_obj(entry["obj"]):
            groups.setdefault(group, []).append(triangles * unit)
        shapes = [(f"{stem}/{group}", np.concatenate(parts)) for group, parts in groups.items()]
    else:
        of = entry["disc"]
        shape = disc(np.array(of["center"]) * unit, np.array(of["normal"]), of["radius"] * unit)
        shapes.append((entry["name"], shape))
    for name, triangles in shapes:
        yield Face((name, "front"), triangles)
        if entry.get("sides") == "both":
            yield Face((name, "back"), triangles[:, ::-1])
