"""What guided photons are worth where light hardly reaches the sensors: figures of merit.

    python benches/guiding.py target/release/phylux
    python benches/guiding.py target/release/phylux --scenes folder     # only writes the scenes

Six scenes are made: a slit between two rooms, a labyrinth, spots behind solid glass, a tube behind glass and louvres, the sun
through a vent, and an overcast sky through a window; walls reflect half. Each is run by photons alone, with aimed flights, with
importance, by what a trial of these finds cheapest, and by paths, with seeds 1 to 5 (`--seeds`) on one thread. Printed are figures of merit,
1 / (mean over the sensors of the squared relative spread between the seeds x CPU seconds, with all that is learned before): 1 %
takes 1e4 of them in seconds.
A sensor that one of the runs has no light for counts with the spread of what the runs found.
"""

import argparse
import json
import pathlib
import resource
import statistics
import subprocess
import tempfile

WALL = {"type": "lambert", "reflectance": 0.5}
GLASS = {"type": "transparent", "ior": 1.52}
# photons, or paths, of each way
WAYS = {
    "off": 2e6,
    "aim": 3e5,
    "full": 5e5,
    "auto": 5e5,
    "paths": 5e5,
}


class Mesh:
    """Polygons, counter-clockwise seen from the front."""

    def __init__(self):
        self.corners, self.polygons = [], []

    def rectangle(self, corner, u, v):
        at = lambda s, t: [corner[i] + s * u[i] + t * v[i] for i in range(3)]
        first = len(self.corners) + 1
        self.corners += [at(0, 0), at(1, 0), at(1, 1), at(0, 1)]
        self.polygons.append(range(first, first + 4))
        return self

    def box(self, low, high, inside=False, without=()):
        """Its sides are named by axis and whether they are the upper one."""
        for axis in range(3):
            u, v = [0, 0, 0], [0, 0, 0]
            j, k = (axis + 1) % 3, (axis + 2) % 3
            u[j], v[k] = high[j] - low[j], high[k] - low[k]
            for upper in (0, 1):
                corner = list(low)
                corner[axis] = (low, high)[upper][axis]
                if (axis, upper) not in without:
                    self.rectangle(corner, *((u, v) if upper != inside else (v, u)))
        return self

    def wall(self, axis, at, low, high, hole):
        """Across an axis, between two corners of the two others, looking to lower places, around a hole."""
        j, k = (axis + 1) % 3, (axis + 2) % 3
        (j0, k0), (j1, k1) = hole
        pieces = [(low[0], low[1], j0, high[1]), (j1, low[1], high[0], high[1]), (j0, low[1], j1, k0), (j0, k1, j1, high[1])]
        for a, b, c, d in pieces:
            if c > a and d > b:
                corner, u, v = [0, 0, 0], [0, 0, 0], [0, 0, 0]
                corner[axis], corner[j], corner[k] = at, a, b
                u[j], v[k] = c - a, d - b
                self.rectangle(corner, v, u)
        return self

    def obj(self):
        corners = "".join("v {} {} {}\n".format(*corner) for corner in self.corners)
        return corners + "".join("f " + " ".join(map(str, polygon)) + "\n" for polygon in self.polygons)


def grid(x, y, z, columns, rows):
    place = lambda ends, i, n: ends[0] + (ends[1] - ends[0]) * i / (n - 1)
    return [[place(x, i, columns), place(y, j, rows), z] for i in range(columns) for j in range(rows)]


def sensors(places, radius):
    return [{"disc": {"center": place, "normal": [0, 0, 1], "radius": radius}} for place in places]


def panel(x, y, z, power):
    """An area lamp that looks down."""
    return {"type": "area", "vertices": [[x[0], y[0], z], [x[0], y[1], z], [x[1], y[1], z], [x[1], y[0], z]], "power": power}


def slit():
    rooms = Mesh().box([0, 0, 0], [3, 3, 3], True, [(0, 1)]).box([3, 0, 0], [6, 3, 3], True, [(0, 0)])
    rooms.wall(0, 3, (0, 0), (3, 3), ((1.495, 1), (1.505, 2)))
    dark = sensors(grid((3.75, 5.25), (0.5, 1.5), 0.5, 3, 3), 0.05) + sensors(grid((3.75, 4.75), (0.6, 1.2), 0.8, 2, 2), 0.005)
    return {"wall": WALL}, {"wall": rooms}, [panel((1.25, 1.75), (0.25, 0.75), 2.99, 1000)], dark


def labyrinth():
    maze = Mesh().box([0, 0, 0], [4, 2, 2], True)
    for x, hole in [(1, (0, 0.2)), (2, (1.8, 2)), (3, (0, 0.2))]:
        maze.wall(0, x, (0, 0), (2, 2), ((hole[0], 0), (hole[1], 2)))
    return {"wall": WALL}, {"wall": maze}, [panel((0.3, 0.7), (0.8, 1.2), 1.99, 1000)], sensors(grid((3.3, 3.7), (0.5, 1.5), 0.5, 2, 3), 0.05)


def spots():
    plates, lamps = Mesh(), []
    for x, y in [(2.5, 2.5), (2.5, 7.5), (7.5, 2.5), (7.5, 7.5)]:
        plates.box([x - 0.15, y - 0.15, 4.85], [x + 0.15, y + 0.15, 4.86])
        lamps.append({"type": "spot", "position": [x, y, 4.9], "direction": [0, 0, -1], "half_angle_deg": 55, "power": 1000})
    hall = Mesh().box([0, 0, 0], [10, 10, 5], True)
    return {"wall": WALL, "glass": GLASS}, {"wall": hall, "glass": plates}, lamps, sensors(grid((1, 9), (1, 9), 1, 5, 5), 0.01)


def louvre():
    case = Mesh().box([1.4, 1.8, 2.7], [2.6, 2.2, 2.95], True, [(2, 0)])
    plate = Mesh().box([1.405, 1.805, 2.69], [2.595, 2.195, 2.696])
    blades = Mesh()
    for i in range(1, 12):
        blades.rectangle([1.4 + 0.1 * i, 1.8, 2.6], [0, 0.4, 0], [0, 0, 0.08])
    lamp = {"type": "tube", "from": [1.5, 2, 2.85], "to": [2.5, 2, 2.85], "radius": 0.013, "power": 100}
    materials = {"wall": WALL, "glass": GLASS, "white": {"type": "lambert", "reflectance": 0.9}, "black": {"type": "lambert", "reflectance": 0}}
    meshes = {"wall": Mesh().box([0, 0, 0], [4, 4, 3], True), "glass": plate, "white": case, "black": blades}
    return materials, meshes, [lamp], sensors(grid((0.5, 3.5), (0.5, 3.5), 0.8, 5, 5), 0.01)


def vent():
    room = Mesh().box([0, 0, 0], [4, 4, 3], True, [(2, 1)]).wall(2, 3, (0, 0), (4, 4), ((1.95, 1.95), (2.05, 2.05)))
    sun = {"type": "spot", "position": [2, 2, 52], "direction": [0, 0, -1], "half_angle_deg": 5, "power": 1e5}
    return {"wall": WALL}, {"wall": room}, [sun], sensors(grid((0.5, 3.5), (0.6, 3.2), 0.8, 3, 3), 0.01)


def window():
    room = Mesh().box([0, 0, 0], [4, 6, 3], True, [(1, 0)]).wall(1, 0, (0, 0), (3, 4), ((1, 1), (2.5, 3)))
    sky = {"type": "sky", "model": "overcast", "irradiance": 100}
    return {"wall": WALL}, {"wall": room}, [sky], sensors(grid((0.8, 3.2), (0.75, 5.25), 0.8, 3, 4), 0.1)


SCENES = {"slit": slit, "labyrinth": labyrinth, "spots": spots, "louvre": louvre, "vent": vent, "window": window}


def write(folder, name):
    materials, meshes, lights, captors = SCENES[name]()
    for material, mesh in meshes.items():
        (folder / f"{name}-{material}.obj").write_text(mesh.obj())
    objects = [{"name": material, "obj": f"{name}-{material}.obj", "material": material} for material in meshes]
    captors = [{"name": f"sensor {i + 1}", **captor} for i, captor in enumerate(captors)]
    scene = {"name": name, "materials": materials, "objects": objects, "lights": lights, "captors": captors}
    path = folder / f"{name}.json"
    path.write_text(json.dumps(scene, indent=1))
    return path


def cpu():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def merit(program, scene, way, photons, seeds):
    """The figure of merit of a way, and what guided it."""
    option = ["--estimator", "paths"] if way == "paths" else ["--guiding", way]
    out, found, seconds = scene.with_suffix(".out"), [], []
    for seed in seeds:
        before = cpu()
        command = [program, "run", scene, *option, "--photons", str(int(photons)), "--seed", str(seed)]
        subprocess.run([*command, "--k", "0", "--threads", "1", "--quiet", "-o", out], check=True, capture_output=True)
        seconds.append(cpu() - before)
        result = json.loads(out.read_text())
        found.append([captor["front"]["irradiance"][0] for captor in result["captors"]])
    lit = [values for values in zip(*found) if any(values)]
    spread = [statistics.variance(values) / statistics.mean(values) ** 2 for values in lit]
    figure = 1 / (statistics.mean(spread) * statistics.mean(seconds)) if spread else 0
    return figure, f"{len(lit)} of {len(found[0])} lit", result["settings"].get("guiding", "")


def main():
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    words.add_argument("program", type=pathlib.Path)
    words.add_argument("--scenes", type=pathlib.Path, help="write the scenes into this folder, and end")
    words.add_argument("--only", nargs="*", choices=list(SCENES), default=list(SCENES))
    words.add_argument("--seeds", type=int, default=5, help="how many seeds (5)")
    words = words.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = words.scenes or pathlib.Path(temporary)
        for name in words.only:
            scene = write(folder, name)
            if words.scenes:
                continue
            for way, photons in WAYS.items():
                figure, lit, chosen = merit(words.program.resolve(), scene, way, photons, range(1, words.seeds + 1))
                print(f"{name:10} {way:6} {photons:.0e} {figure:10.3g}  {lit}  {chosen if way == 'auto' else ''}", flush=True)


if __name__ == "__main__":
    main()
