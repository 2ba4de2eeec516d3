"""Writes the canopies of level leaves that canopies.py runs: black, in PAR and in near infrared.

    python benches/mitsuba/leaves.py FOLDER

382 discs of 5 cm at random in a cell of 1 x 1 x 1 m that repeats (leaf area index 3), over soil, in the
sun 60 degrees from the zenith.
"""

import json
import math
import random
import sys
from pathlib import Path

LEAVES, RADIUS, SIDES = 382, 0.05, 12
SEED = 2026
# reflectance and transmittance of the leaves, reflectance of the soil
OPTICS = {"black": (0.0, 0.0, 0.0), "PAR": (0.09, 0.05, 0.15), "NIR": (0.45, 0.45, 0.15)}


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    for path in write(Path(sys.argv[1])):
        print(path)


def write(folder):
    """Writes both meshes and a scene for each of `OPTICS`; returns the scenes' paths."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "leaves.obj").write_text(leaves())
    (folder / "soil.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\ng soil\nf 1 2 3 4\n")
    paths = []
    for name, optics in OPTICS.items():
        paths.append(folder / f"leaves-{name}.json")
        paths[-1].write_text(json.dumps(scene(name, *optics), indent=1))
    return paths


def leaves():
    """Level discs as polygons of the same area, one group each; they may stick out of the cell."""
    draw = random.Random(SEED)
    rim = RADIUS * math.sqrt(2 * math.pi / SIDES / math.sin(2 * math.pi / SIDES))
    lines = []
    for number in range(LEAVES):
        x, y, z = (draw.random() for _ in range(3))
        turns = [2 * math.pi * side / SIDES for side in range(SIDES)]
        lines += [f"v {x + rim * math.cos(t):.9f} {y + rim * math.sin(t):.9f} {z:.9f}" for t in turns]
        corners = " ".join(str(number * SIDES + side + 1) for side in range(SIDES))
        lines += [f"g leaf{number:04}", f"f {corners}"]
    return "\n".join(lines) + "\n"


def scene(name, reflectance, transmittance, soil):
    """The scene of phylux: 1 W/m2 come in on the level."""
    return {
        "name": f"level leaves, {name}",
        "bands": [{"name": name}],
        "periodic": {"x": [0, 1], "y": [0, 1]},
        "materials": {
            "leaf": {"type": "leaf", "ior": 1, "reflectance": reflectance, "transmittance": transmittance},
            "soil": {"type": "lambert", "reflectance": soil},
        },
        "objects": [
            {"name": "leaves", "obj": "leaves.obj", "material": "leaf", "captor": True},
            {"name": "ground", "obj": "soil.obj", "material": "soil", "ground": True},
        ],
        "sun_at": {"elevation_deg": 30, "azimuth_deg": 60},
        "lights": [{"type": "sun", "irradiance": 2, "half_angle_deg": 0}],
    }


if __name__ == "__main__":
    main()
