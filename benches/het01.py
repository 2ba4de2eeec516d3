#!/usr/bin/env python3
"""Runs HET01 of RAMI, the canopy of floating spheres, and checks it with a tracer of its own (docs/validation.md).

The scene is that of https://rami-benchmark.jrc.ec.europa.eu: a cell of 100 x 100 m with 15 spheres of 10 m, each with
50,000 discs of 0.1 m, whose middles are uniform in the sphere but 0.2 m apart, and whose normals are uniform in
direction. Here all spheres are one crown, turned. In phylux a disc is a hexagon of the same area.

    cargo build --release
    pip install numpy
    python3 benches/het01.py                  # the runs of phylux
    python3 benches/het01.py --check discs    # the same discs, by the tracer below
    python3 benches/het01.py --check turbid   # spheres of infinitely small leaves
"""

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
from itertools import product
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
RADIUS, LEAVES, DISC, APART = 10.0, 50_000, 0.1, 0.2
CENTRES = np.array([
    [-24.8302, 11.6110, 15.6210], [-38.3380, -9.06342, 17.6094], [-31.3562, 32.5297, 14.3051],
    [11.9126, 8.32062, 12.1220], [39.4855, 37.1247, 16.3647], [-8.30999, -4.39422, 14.4241],
    [12.2769, -25.1402, 12.4492], [32.4756, -26.9023, 16.3684], [-7.46991, -32.2138, 12.6678],
    [-27.4794, -32.0266, 15.9146], [33.5709, -6.31039, 14.5332], [-5.24326, 39.8405, 16.8247],
    [18.1699, 35.8223, 11.5683], [-5.26569, 18.9618, 17.2535], [37.8226, 14.6769, 11.5936],
])
TURNS = 24.0 * np.arange(15)  # degrees about z
BANDS = ["red", "NIR"]
LEAF_R, LEAF_T, SOIL = np.array([0.0546, 0.4957]), np.array([0.0149, 0.4409]), np.array([0.127, 0.159])
SUNS = [20, 50]  # zenith angles
PART = 20_000  # photons that the tracer follows at once


def directions(draw, n):
    """n directions, uniform over the sphere."""
    z, turn = draw.uniform(-1, 1, n), draw.uniform(0, 2 * math.pi, n)
    s = np.sqrt(1 - z * z)
    return np.stack([s * np.cos(turn), s * np.sin(turn), z], 1)


def across(axes):
    """Two directions at right angles to each axis, and to each other."""
    aside = np.where(np.abs(axes[:, 2:]) < 0.7, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    u = np.cross(aside, axes)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    return u, np.cross(axes, u)


def drawn(apart):
    """Middles and normals of the discs of a sphere about the origin. No two middles are nearer than `apart`."""
    draw = np.random.default_rng(1)
    cells, middles = {}, []
    while len(middles) < LEAVES:
        middle = (directions(draw, 1)[0] * RADIUS * np.cbrt(draw.random())).tolist()
        i, j, k = (math.floor(x / APART) for x in middle)
        near = (cells.get(cell, []) for cell in product((i - 1, i, i + 1), (j - 1, j, j + 1), (k - 1, k, k + 1)))
        if all(math.dist(middle, other) >= apart for others in near for other in others):
            cells.setdefault((i, j, k), []).append(middle)
            middles.append(middle)
    return np.array(middles), directions(draw, LEAVES)


def listed(path):
    """The same of RAMI's file of leaves: radius, middle and normal."""
    rows = np.loadtxt(path)
    return rows[:, 1:4], rows[:, 4:] / np.linalg.norm(rows[:, 4:], axis=1, keepdims=True)


def write(folder, suns, middles, normals):
    """Writes the scene, once for each zenith angle of the sun."""
    u, v = across(normals)
    edge = DISC * math.sqrt(2 * math.pi / (3 * math.sqrt(3)))
    corners = np.stack([middles + edge * (math.cos(a) * u + math.sin(a) * v) for a in np.arange(6) * math.pi / 3], 1)
    faces = np.zeros(len(middles), [("corners", "u1"), ("corner", "<i4", 6)])
    faces["corners"], faces["corner"] = 6, np.arange(corners.size // 3).reshape(-1, 6)
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {corners.size // 3}",
            *(f"property float {axis}" for axis in "xyz"), f"element face {len(faces)}",
            "property list uchar int vertex_indices", "end_header\n"]
    (folder / "crown.ply").write_bytes("\n".join(head).encode() + corners.astype("<f4").tobytes() + faces.tobytes())
    rows = [",".join(map(str, [*centre, turn])) for centre, turn in zip(CENTRES, TURNS)]
    (folder / "spheres.csv").write_text("\n".join(["x,y,z,turn_deg", *rows]) + "\n")
    (folder / "soil.obj").write_text("v -50 -50 0\nv 50 -50 0\nv 50 50 0\nv -50 50 0\nf 1 2 3 4\n")
    leaf = {"type": "leaf", "ior": 1, "reflectance": list(LEAF_R), "transmittance": list(LEAF_T)}
    for sun in suns:
        scene = {
            "periodic": {"x": [-50, 50], "y": [-50, 50]},
            "bands": [{"name": band} for band in BANDS],
            "materials": {"leaf": leaf, "soil": {"type": "lambert", "reflectance": list(SOIL)}},
            "objects": [
                {"name": "crown", "obj": "crown.ply", "material": "leaf", "captor": "instance",
                 "instances": {"csv": "spheres.csv"}},
                {"name": "soil", "obj": "soil.obj", "material": "soil", "captor": True, "ground": True},
            ],
            "sun_at": {"elevation_deg": 90 - sun, "azimuth_deg": 90},
            "lights": [{"type": "sun", "irradiance": 1, "half_angle_deg": 0}],
        }
        (folder / f"het01-{sun}.json").write_text(json.dumps(scene, indent=1))


class Discs:
    """The discs of the crown, in a grid of cells."""

    radius, cell = RADIUS + DISC, 0.4

    def __init__(self, middles, normals):
        self.middles, self.normals = middles, normals
        self.n = math.ceil(2 * self.radius / self.cell)
        reach = DISC * np.sqrt(1 - normals**2)
        low, high = ((middles + side * reach + self.radius) / self.cell for side in (-1, 1))
        low, high = np.floor(low).astype(int), np.floor(high).astype(int)
        cells, leaves = [], []
        for step in np.ndindex(2, 2, 2):
            at = low + step
            there = (at <= high).all(1) & (at < self.n).all(1) & (at >= 0).all(1)
            cells.append(at[there] @ [self.n**2, self.n, 1])
            leaves.append(np.flatnonzero(there))
        cells, leaves = np.concatenate(cells), np.concatenate(leaves)
        self.leaves = leaves[np.argsort(cells, kind="stable")]
        self.start = np.concatenate([[0], np.cumsum(np.bincount(cells, minlength=self.n**3))])

    def hit(self, o, d, end, skip, draw):
        """The first disc (or -1) that each ray meets before `end`, at which distance, and its normal."""
        found, far = np.full(len(o), -1), np.full(len(o), np.inf)
        with np.errstate(divide="ignore", invalid="ignore"):
            at = np.clip(((o + self.radius) / self.cell).astype(int), 0, self.n - 1)
            step = np.where(d > 0, 1, -1)
            stride = self.cell / np.abs(d)
            border = np.where(d == 0, np.inf, ((at + (d > 0)) * self.cell - self.radius - o) / d)
        rays = np.arange(len(o))
        while len(rays):
            where = at[rays] @ [self.n**2, self.n, 1]
            entry, last, ray = self.start[where], self.start[where + 1], rays
            while True:
                more = entry < last
                entry, last, ray = entry[more], last[more], ray[more]
                if not len(ray):
                    break
                leaf = self.leaves[entry]
                normal, way = self.normals[leaf], self.middles[leaf] - o[ray]
                with np.errstate(divide="ignore", invalid="ignore"):
                    t = (way * normal).sum(1) / (d[ray] * normal).sum(1)
                away = way - t[:, None] * d[ray]
                good = (t > 0) & (t < far[ray]) & ((away * away).sum(1) < DISC**2) & (leaf != skip[ray])
                far[ray[good]], found[ray[good]] = t[good], leaf[good]
                entry = entry + 1
            axis = border[rays].argmin(1)
            leave = border[rays, axis]
            on = (far[rays] > leave) & (leave < end[rays])
            rays, axis = rays[on], axis[on]
            at[rays, axis] += step[rays, axis]
            border[rays, axis] += stride[rays, axis]
            inside = (at[rays, axis] >= 0) & (at[rays, axis] < self.n)
            rays = rays[inside]
        return found, far, self.normals[found]


class Turbid:
    """A medium of infinitely small leaves in place of the discs."""

    radius = RADIUS
    density = LEAVES * math.pi * DISC**2 / (4 / 3 * math.pi * RADIUS**3)

    def hit(self, o, d, end, skip, draw):
        """As above: a leaf, met with the odds of its projected area, has no number."""
        far = draw.exponential(2 / self.density, len(o))
        u, v = across(d)
        cosine, turn = np.sqrt(draw.random((len(o), 1))), draw.uniform(0, 2 * math.pi, (len(o), 1))
        normal = cosine * d + np.sqrt(1 - cosine**2) * (np.cos(turn) * u + np.sin(turn) * v)
        return np.where(far < end, 0, -1), far, normal


def fly(crown, o, d, sphere, leaf, draw):
    """Follows rays from points of the cell (on `leaf` of `sphere`, or -1) to what they meet.

    Returns what it is (-2: the sky, -1: the soil, else the sphere), the leaf, the point and the normal there.
    """
    o, leaf, came = o.copy(), leaf.copy(), sphere.copy()
    kind, normal = np.full(len(o), -3), np.tile([0.0, 0.0, 1.0], (len(o), 1))
    passed = np.full(len(o), -1)
    rays = np.arange(len(o))
    while len(rays):
        p, v = o[rays], d[rays]
        with np.errstate(divide="ignore", invalid="ignore"):
            walls = np.where(v == 0, np.inf, (np.sign(v) * [50, 50, 15] + [0, 0, 15] - p) / v)
        side = walls.argmin(1)
        wall = walls[np.arange(len(rays)), side]
        along = (CENTRES[None] - p[:, None]) @ v[:, :, None]
        along = along[:, :, 0]
        apart = ((CENTRES[None] - p[:, None]) ** 2).sum(2) - along**2
        half = np.sqrt(np.maximum(crown.radius**2 - apart, 0))
        enter = np.where((half > 0) & (along + half > 0), np.maximum(along - half, 0), np.inf)
        beyond = passed[rays]
        enter[beyond >= 0, beyond[beyond >= 0]] = np.inf
        near = enter.argmin(1)
        start = enter[np.arange(len(rays)), near]
        meets = start < wall
        # Rays that meet no sphere before a wall pass into the next cell, or end.
        out, at, side = rays[~meets], wall[~meets], side[~meets]
        o[out] += at[:, None] * d[out]
        passed[out] = came[out] = -1
        up = side == 2
        kind[out[up]] = np.where(d[out[up], 2] > 0, -2, -1)
        over = out[~up]
        o[over, side[~up]] = -50 * np.sign(d[over, side[~up]])
        # The others cross the sphere.
        into, near, start = rays[meets], near[meets], start[meets]
        o[into] += start[:, None] * d[into]
        end = (along + half)[meets, near] - start
        turn = np.radians(TURNS[near])
        c, s = np.cos(turn), np.sin(turn)

        def turned(a, sign):
            return np.stack([c * a[:, 0] + sign * s * a[:, 1], c * a[:, 1] - sign * s * a[:, 0], a[:, 2]], 1)

        skip = np.where(came[into] == near, leaf[into], -1)
        found, far, face = crown.hit(turned(o[into] - CENTRES[near], 1), turned(d[into], 1), end, skip, draw)
        met = found >= 0
        face = turned(face, -1)
        hit = into[met]
        o[hit] += far[met, None] * d[hit]
        kind[hit], leaf[hit], normal[hit] = near[met], found[met], face[met]
        miss = into[~met]
        o[miss] += end[~met, None] * d[miss]
        passed[miss], came[miss] = near[~met], -1
        rays = np.flatnonzero(kind == -3)
    return kind, leaf, o, normal


def lambert(normal, draw):
    """Directions about normals, as a Lambertian surface sends light."""
    u, v = across(normal)
    square, turn = draw.random((len(normal), 1)), draw.uniform(0, 2 * math.pi, (len(normal), 1))
    return np.sqrt(square) * (np.cos(turn) * u + np.sin(turn) * v) + np.sqrt(1 - square) * normal


def traced(crown, sun, views, seed):
    """The shares of the light that leaves absorb, that leave upwards and that arrive on the soil, and reflectance
    factors (BRF) towards zenith angles in the plane of the sun, positive on its side; in each band, of one part."""
    draw = np.random.default_rng(seed)
    o = np.concatenate([draw.uniform(-50, 50, (PART, 2)), np.full((PART, 1), 30.0)], 1)
    angle = math.radians(sun)
    d = np.tile([-math.sin(angle), 0.0, -math.cos(angle)], (PART, 1))
    weight = np.full((PART, 2), 1 / PART)
    sphere = leaf = np.full(PART, -1)
    shares, factors = np.zeros((3, 2)), np.zeros((len(views), 2))
    while len(o):
        kind, leaf, o, normal = fly(crown, o, d, sphere, leaf, draw)
        shares[1] += weight[kind == -2].sum(0)
        shares[2] += weight[kind == -1].sum(0)
        shares[0] += (weight[kind >= 0] * (1 - LEAF_R - LEAF_T)).sum(0)
        on = kind > -2
        o, d, leaf, normal, weight, sphere = o[on], d[on], leaf[on], normal[on], weight[on], kind[on]
        soil = (sphere < 0)[:, None]
        front = np.where((d * normal).sum(1, keepdims=True) < 0, normal, -normal)
        for i, view in enumerate(np.radians(views)):
            to = np.tile([math.sin(view), 0.0, math.cos(view)], (len(o), 1))
            cosine = (to * front).sum(1, keepdims=True)
            seen = fly(crown, o, to, sphere, leaf, draw)[0] == -2
            sent = np.where(soil, SOIL, np.where(cosine > 0, LEAF_R, LEAF_T)) * weight * np.abs(cosine) / math.cos(view)
            factors[i] += sent[seen].sum(0)
        # The near infrared decides which way, the red is weighted.
        odds = LEAF_R[1] / (LEAF_R + LEAF_T)[1]
        back = draw.random((len(o), 1)) < odds
        weight = weight * np.where(soil, SOIL, np.where(back, LEAF_R / odds, LEAF_T / (1 - odds)))
        d = lambert(np.where(soil | back, front, -front), draw)
        faint = weight.max(1) < 0.05 / PART
        weight[faint] *= 2
        on = ~faint | (draw.random(len(o)) < 0.5)
        o, d, leaf, weight, sphere = o[on], d[on], leaf[on], weight[on], sphere[on]
    return np.concatenate([shares, factors])


def run(program: str, scene: Path, photons: int) -> tuple[dict, float, float]:
    """Runs photons on one thread. Returns the shares of the light, CPU seconds, and the peak of the memory in MB."""
    output = scene.with_suffix(".results.json")
    command = [program, "run", scene, "--photons", str(photons), "--threads", "1", "--k", "0", "-o", output]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    if status:
        sys.exit(f"{' '.join(map(str, command))} failed")
    return json.loads(output.read_text())["canopy"], used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default=str(ROOT / "target/release/phylux"))
    parser.add_argument("--leaves", help="RAMI's file of the leaves of a sphere, in place of leaves drawn here")
    parser.add_argument("--apart", type=float, default=APART, help="least distance of leaves drawn here, at most 0.2 m")
    parser.add_argument("--photons", type=float, default=1e7)
    parser.add_argument("--check", choices=["discs", "turbid"], help="use the tracer of this script, not phylux")
    parser.add_argument("--suns", type=int, nargs="+", default=SUNS, help="zenith angles of the sun, degrees")
    parser.add_argument("--views", type=float, nargs="+", default=[], help="with --check: zenith angles of BRF")
    options = parser.parse_args()
    leaves = listed(options.leaves) if options.leaves else drawn(options.apart)
    names = ["absorbed", "reflected", "transmitted", *(f"BRF {view:g}" for view in options.views)]
    print("| sun | | red | NIR |\n|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        write(Path(folder), options.suns, *leaves)
        for sun in options.suns:
            if options.check:
                crown = Discs(*leaves) if options.check == "discs" else Turbid()
                parts = max(2, round(options.photons / PART))
                found = np.array([traced(crown, sun, options.views, seed) for seed in range(parts)])
                mean, error = found.mean(0), found.std(0, ddof=1) / math.sqrt(parts)
            else:
                scene = Path(folder) / f"het01-{sun}.json"
                _, load, memory = run(options.program, scene, 1000)
                found, whole, _ = run(options.program, scene, round(options.photons))
                mean, error = (np.array([found[name + end] for name in names]) for end in ("", "_se"))
            for name, row, errors in zip(names, mean, error):
                values = (f"{x:.5f} ± {e:.5f}" for x, e in zip(row, errors))
                print(f"| {sun} | {name} |", " | ".join(values), "|", flush=True)
            if not options.check:
                print(f"load {load:.1f} s, {memory:.0f} MB; {1e6 * (whole - load) / options.photons:.1f} us per photon")


if __name__ == "__main__":
    main()
