"""Measured lamps against Radiance: IES files of every symmetry, by phylux and by ies2rad + rtrace, on a floor grid.

    pip install pyradiance
    python benches/radiance/photometry.py target/release/phylux

Prints for each file the largest difference of the illuminance at 25 places, relative to the largest there, and ends with an
error where it is above 0.5 %. Radiance takes intensities linear in both angles too; the lamp is a sphere of 5 mm there, a point
here. Without pyradiance it says so and ends well.
"""

import json
import math
import pathlib
import subprocess
import sys
import tempfile

try:
    import pyradiance
except ImportError:
    sys.exit(print("skipped: no pyradiance here"))

TOOLS = pathlib.Path(pyradiance.__file__).parent / "bin"
LIBRARY = {"RAYPATH": ".:" + str(pathlib.Path(pyradiance.__file__).parent / "lib")}
LUMENS_PER_WATT = 179  # of Radiance
HEIGHT = 2.0
PLACES = [(x, y) for x in (-1.5, -0.6, 0.1, 0.8, 1.6) for y in (-1.4, -0.7, 0.2, 0.9, 1.5)]


def candela(c, v):
    """Of no symmetry until it is mirrored; dark beyond 80 degrees."""
    c, v = math.radians(c), math.radians(v)
    around = 1 + 0.5 * math.cos(c) + 0.3 * math.sin(2 * c) + 0.2 * math.sin(c)
    return 1000 * max(0.0, math.cos(v) ** 1.5) * (1 + (around - 1) * math.sin(v))


def folded(symmetry, c):
    """The angle of the file that the lamp has its intensity of at the angle c."""
    if symmetry == "axial":
        return 0
    if symmetry == "quadrant":
        c %= 180
        return min(c, 180 - c)
    if symmetry == "bilateral":
        return min(c % 360, 360 - c % 360)
    return c


HORIZONTAL = {"axial": [0], "quadrant": range(0, 91, 15), "bilateral": range(0, 181, 15), "none": range(0, 361, 15)}


def ies(symmetry, horizontal):
    vertical = range(0, 91, 5)
    rows = [" ".join(f"{candela(folded(symmetry, c % 360), v):.4f}" for v in vertical) for c in horizontal]
    head = f"IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 {len(vertical)} {len(rows)} 1 2 0 0 0\n1 1 50\n"
    return head + " ".join(map(str, vertical)) + "\n" + " ".join(map(str, horizontal)) + "\n" + "\n".join(rows) + "\n"


def by_phylux(program, folder):
    captors = [
        {"name": str(i), "disc": {"center": [x, y, 0], "normal": [0, 0, 1], "radius": 0.001}}
        for i, (x, y) in enumerate(PLACES)
    ]
    light = {"type": "point", "position": [0, 0, HEIGHT], "photometry": "lamp.ies", "power": "file"}
    (folder / "scene.json").write_text(json.dumps({"lights": [light], "captors": captors}))
    command = [program, "run", "scene.json", "--estimator", "paths", "--photons", "2000", "--quiet"]
    subprocess.run(command, cwd=folder, check=True)
    results = json.loads((folder / "results.json").read_text())
    return [captor["front"]["irradiance"][0] for captor in results["captors"]]


def by_radiance(folder):
    def run(name, *arguments, **more):
        done = subprocess.run([TOOLS / name, *arguments], cwd=folder, env=LIBRARY, check=True, capture_output=True, **more)
        return done.stdout

    run("ies2rad", "-i", "0.005", "-o", "lamp", "lamp.ies")
    (folder / "lamp.rad").write_text(
        (folder / "lamp.rad").read_text().replace("0 0 0 0.005", f"0 0 {HEIGHT} 0.005")
    )
    (folder / "room.oct").write_bytes(run("oconv", "lamp.rad"))
    rays = "".join(f"{x} {y} 0 0 0 1\n" for x, y in PLACES)
    options = ["-h", "-I", "-ab", "0", "-ds", "0", "-dc", "1", "-dt", "0", "-dj", "0"]
    lines = run("rtrace", *options, "room.oct", input=rays.encode()).decode().split("\n")
    colours = [[float(value) for value in line.split()] for line in lines if line.strip()]
    return [LUMENS_PER_WATT * (0.265 * r + 0.670 * g + 0.065 * b) for r, g, b in colours]


def main():
    program = str(pathlib.Path(sys.argv[1]).resolve())
    worst = 0.0
    for symmetry, horizontal in HORIZONTAL.items():
        for what, angles in [("its part", horizontal), ("the whole circle", HORIZONTAL["none"])]:
            with tempfile.TemporaryDirectory() as folder:
                folder = pathlib.Path(folder)
                (folder / "lamp.ies").write_text(ies(symmetry, list(angles)))
                ours, theirs = by_phylux(program, folder), by_radiance(folder)
            largest = max(theirs)
            difference = max(abs(a - b) for a, b in zip(ours, theirs)) / largest
            print(f"{symmetry}, {what}: {largest:.2f} lx at most, differs by {100 * difference:.3f} %")
            worst = max(worst, difference)
    if worst > 0.005:
        sys.exit("the lamps differ")


main()
