#!/usr/bin/env python3
"""Measures what fields of copies cost: time to load, memory, and time per photon.

The plant has 1,000 leaves of 50 triangles in a crown of 0.4 m. Fields of it stand below a uniform sky, one captor for
each plant. Copies that share their triangles are compared with copies that have their own, as far as memory goes.

    cargo build --release
    python3 benches/copies.py --chart docs/charts/copies.svg

The chart needs matplotlib and the Python package (`pip install ./python`).
"""

import argparse
import json
import math
import os
import random
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def plant(path: Path, leaves: int, parts: int = 50) -> None:
    """Writes leaves as fans of triangles, turned at random."""
    draw = random.Random(1)
    lines = []
    for leaf in range(leaves):
        while True:
            place = [draw.uniform(-0.4, 0.4) for _ in range(3)]
            if sum(x * x for x in place) < 0.16:
                break
        turn, tilt = draw.uniform(0, 2 * math.pi), math.acos(draw.uniform(-1, 1))
        along = [math.cos(turn) * math.cos(tilt), math.sin(turn) * math.cos(tilt), -math.sin(tilt)]
        across = [-math.sin(turn), math.cos(turn), 0.0]
        middle = [place[0], place[1], place[2] + 0.5]
        lines.append("v {:.5f} {:.5f} {:.5f}".format(*middle))
        for part in range(parts):
            c, s = (0.02 * f(2 * math.pi * part / parts) for f in (math.cos, math.sin))
            lines.append("v {:.5f} {:.5f} {:.5f}".format(*(m + c * u + s * v for m, u, v in zip(middle, along, across))))
        first = leaf * (parts + 1) + 1
        lines += [f"f {first} {first + 1 + part} {first + 1 + (part + 1) % parts}" for part in range(parts)]
    path.write_text("\n".join(lines) + "\n")


def field(folder: Path, number: int, spacing: float, mesh: str, share: bool) -> Path:
    """Writes a square of plants."""
    side = math.ceil(math.sqrt(number))
    rows = [f"{i % side * spacing},{i // side * spacing},0,{i * 37 % 360}" for i in range(number)]
    (folder / "field.csv").write_text("\n".join(["x,y,z,turn_deg", *rows]) + "\n")
    scene = {
        "materials": {"leaf": {"type": "leaf", "reflectance": 0.1, "transmittance": 0.05}},
        "objects": [
            {"name": "plant", "obj": mesh, "material": "leaf", "captor": "instance", "share": share,
             "instances": {"csv": "field.csv"}}
        ],
        "lights": [{"type": "sky", "model": "uniform", "irradiance": 1}],
    }
    path = folder / "field.json"
    path.write_text(json.dumps(scene))
    return path


def run(program: str, scene: Path, photons: int) -> tuple[float, float]:
    """Runs photons on one thread. Returns CPU seconds, and the peak of the memory in MB."""
    output = scene.with_name("results.json")
    command = [program, "run", scene, "--photons", str(photons), "--threads", "1", "--guiding", "off", "--k", "0", "-o", output]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    if status:
        sys.exit(f"{' '.join(map(str, command))} failed")
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def chart(found: list[tuple[str, int, float, float, float]], path: str) -> None:
    """Draws the time to load, the memory and the time per photon over the number of copies."""
    import matplotlib.pyplot as plt
    from phylux.plots import style

    with style():
        figure, axes = plt.subplots(1, 3, figsize=(7, 2.6), layout="constrained")
        for place, label in enumerate(["time to load, s", "memory, MB", "time per photon, µs"]):
            for kind, mark in (("own", "o--"), ("shared", "o-")):
                points = [(row[1], row[2 + place]) for row in found if row[0] == kind]
                axes[place].plot(*zip(*points), mark, label=f"{kind} triangles")
            axes[place].set(xscale="log", xlabel="copies", title=label)
            axes[place].set(**({"ylim": (0, None)} if place == 2 else {"yscale": "log"}))
        axes[2].legend(loc="lower right")
        figure.savefig(path, metadata={"Date": None} if path.endswith(".svg") else None)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default=str(ROOT / "target/release/phylux"))
    parser.add_argument("--photons", type=int, default=1_000_000)
    parser.add_argument("--most-own", type=int, default=100, help="the most copies with triangles of their own")
    parser.add_argument("--chart", metavar="FILE", help="draw the plants 1 m apart as a chart, too")
    options = parser.parse_args()
    found = []
    cases = [(1, 1.0), (10, 1.0), (100, 1.0), (1_000, 1.0), (10_000, 1.0), (100, 0.5), (10_000, 0.5)]
    print("| copies, spacing | triangles | load, s | memory, MB | us per photon |\n|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        plant(folder / "plant.obj", 1_000)
        plant(folder / "small.obj", 10)
        all_cases = [(n, s, "plant.obj") for n, s in cases] + [(1_000, 0.3, "small.obj")]
        for number, spacing, mesh in all_cases:
            for share in (False, True):
                if not share and number > options.most_own and mesh == "plant.obj":
                    continue
                scene = field(folder, number, spacing, mesh, share)
                few = options.photons // 100
                (load, _), (whole, memory) = run(options.program, scene, few), run(options.program, scene, options.photons)
                each = 1e6 * (whole - load) / (options.photons - few)
                small = " of 500 triangles" if mesh == "small.obj" else ""
                kind = "shared" if share else "own"
                print(f"| {number}{small}, {spacing:g} m | {kind} | {load:.2f} | {memory:.0f} | {each:.2f} |", flush=True)
                if mesh == "plant.obj" and spacing == 1.0:
                    found.append((kind, number, load, memory, each))
    if options.chart:
        chart(found, options.chart)


if __name__ == "__main__":
    main()
