"""A phylux scene of one cell that repeats, in sun and sky, as plain arrays."""

import csv
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scene import UNITS, move, per_band, read_obj


@dataclass
class Part:
    """The triangles of one material in an object, and for each its captor within the object + 1, or 0."""

    material: dict
    triangles: np.ndarray
    slots: np.ndarray


@dataclass
class Group:
    """Parts that are placed together: matrices, and for each the number of captors before its own."""

    parts: list
    places: list
    firsts: list


@dataclass
class Canopy:
    """All of a scene that the comparison needs, in metres and W/m2."""

    bands: list
    size: tuple
    top: float  # above all leaves
    groups: list
    captors: list  # names
    sun: np.ndarray
    sky: np.ndarray
    to_sun: np.ndarray
    half_angle: float


def variant(path, out):
    """Writes the scene that both programs run: what plants absorb is asked, and nothing else."""
    path = Path(path).resolve()
    scene = json.loads(path.read_text())
    for key in ("captors", "layers", "sunlit", "sums", "camera"):
        scene.pop(key, None)
    for part in scene["objects"]:
        part["obj"] = str((path.parent / part["obj"]).resolve())
        if isinstance(part.get("instances"), dict):
            part["instances"]["csv"] = str((path.parent / part["instances"]["csv"]).resolve())
        part["captor"] = not part.get("ground", False)
    Path(out).write_text(json.dumps(scene, indent=1))


def load(path):
    """Reads what `variant` wrote."""
    scene = json.loads(Path(path).read_text())
    unit = UNITS[scene.get("unit", "m")]
    bands = [band["name"] for band in scene["bands"]]
    groups, captors = [], []
    for entry in scene["objects"]:
        groups.append(read_group(entry, scene["materials"], unit, captors))
    sun, sky = (sum((per_band(light["irradiance"], bands) for light in scene["lights"] if light["type"] == kind),
                    np.zeros(len(bands))) for kind in ("sun", "sky"))
    [disc] = [light.get("half_angle_deg", 0.2666) for light in scene["lights"] if light["type"] == "sun"]
    up, turn = (np.radians(scene["sun_at"][key]) for key in ("elevation_deg", "azimuth_deg"))
    to_sun = np.array([np.sin(turn) * np.cos(up), np.cos(turn) * np.cos(up), np.sin(up)])
    size = tuple((np.subtract(*scene["periodic"][axis][::-1]) * unit).item() for axis in "xy")
    heights = [(part.triangles @ at[2, :3] + at[2, 3]).max()
               for group in groups for part in group.parts for at in group.places]
    return Canopy(bands, size, float(max(heights)) + 1e-3, groups, captors, sun, sky, to_sun, np.radians(disc))


def read_group(entry, materials, unit, captors):
    """An object; the names of its captors are added to `captors`."""
    own = {}
    for name, material, triangles in read_obj(entry["obj"]):
        own.setdefault(entry.get("material", material), []).append((name, triangles * unit))
    names = list(dict.fromkeys(name for parts in own.values() for name, _ in parts))
    parts, count = [], len(names) if entry["captor"] else 0
    for material, pieces in own.items():
        slots = [np.full(len(t), names.index(name) + 1 if count else 0, np.uint32) for name, t in pieces]
        parts.append(Part(materials[material], np.concatenate([t for _, t in pieces]), np.concatenate(slots)))
    places = matrices(entry, unit)
    firsts = [len(captors) + count * place for place in range(len(places))]
    for number in range(len(places)):
        copy = f"#{number}" if "instances" in entry else ""
        captors += [f"{entry['name']}/{name}{copy}" for name in names[:count]]
    return Group(parts, places, firsts)


def matrices(entry, unit):
    """Where an object stands: `transform`, then each of its `instances`."""
    copies = entry.get("instances", [{}])
    if isinstance(copies, dict):
        with open(copies["csv"], newline="") as file:
            copies = [{"scale": float(row.get("scale") or 1), "rotate_deg": [0, 0, float(row.get("turn_deg") or 0)],
                       "translate": [float(row[axis]) for axis in "xyz"]} for row in csv.DictReader(file)]
    return [matrix(copy, unit) @ matrix(entry.get("transform", {}), unit) for copy in copies]


def matrix(at, unit):
    corners = move(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float), at, unit)
    result = np.eye(4)
    result[:3, 3] = corners[0]
    result[:3, :3] = (corners[1:] - corners[0]).T
    return result
