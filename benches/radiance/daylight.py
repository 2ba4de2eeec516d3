"""CPU time to 1 % by day, phylux beside Radiance, on the sensors of a phylux scene.

    pip install pyradiance numpy
    python benches/radiance/daylight.py target/release/phylux scenes/greenhouse-day.json

Both get the same surfaces, one band, nothing glossy, under a sun of 800 W/m2 and a uniform sky of 100 W/m2; sensors are
the discs of the scene's tables. Each method runs twice, with other random numbers. Printed are CPU seconds of a run, its
spread (half the mean square of the relative difference between both runs, over the sensors, as a root), how far the mean
of both is off the paths of phylux (the middle sensor, and the root mean square over all), and the CPU seconds in which the spread
would be 1 %. Radiance measures in points: 64 of each disc, of which the mean is taken. Without pyradiance it says so and ends well.
"""

import argparse
import json
import os
import pathlib
import resource
import subprocess
import sys
import tempfile

try:
    import numpy as np
    import pyradiance
except ImportError as missing:
    sys.exit(print(f"skipped: no {missing.name} here"))

HERE = pathlib.Path(__file__).resolve().parent
sys.path.append(str(HERE.parent / "mitsuba"))
import scene as reader  # noqa: E402: the comparison with Mitsuba reads the same scenes

HOME = pathlib.Path(pyradiance.__file__).parent
GOAL = 0.01
SUN, SKY = 800.0, 100.0  # W/m2: of the sun across its rays, of the sky on the ground
ELEVATION, AZIMUTH, HALF_ANGLE = 69.8, 180.0, 0.2666  # degrees
TREGENZA = [30, 30, 24, 24, 18, 12, 6, 1]  # patches of the sky, row by row


def main():
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    words.add_argument("phylux")
    words.add_argument("scene")
    words.add_argument("--photons", type=float, default=1e6, help="of phylux and of mkpmap")
    words.add_argument("--paths", type=float, default=1e6)
    words.add_argument("--points", type=int, default=64, help="that Radiance takes of each sensor")
    words.add_argument("--divisions", type=int, default=16, help="rays of Radiance at each of these (-ad)")
    words.add_argument("--bounces", type=int, default=6, help="of Radiance (-ab)")
    words.add_argument("--only", default="", help="methods whose name contains this")
    options = words.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        case = Case(pathlib.Path(folder), options)
        print(f"{options.scene}: {len(case.names)} sensors, {case.triangles} triangles")
        print(f"{'method':34} {'CPU s':>8} {'spread':>8} {'off':>7} {'rms off':>8} {'CPU s to 1 %':>13}")
        reference = None
        for name, method in case.methods().items():
            if reference is not None and options.only not in name:
                continue
            try:
                runs = [method(seed) for seed in (1, 2)]
            except RuntimeError as failed:
                print(f"{name:34} {failed}")
                continue
            (a, _), (b, _) = runs
            seconds, mean = np.mean([seconds for _, seconds in runs]), (a + b) / 2
            reference = mean if reference is None else reference
            seen = reference > 0
            spread = np.sqrt(np.mean(((a - b)[seen] / mean[seen]) ** 2) / 2)
            off = mean[seen] / reference[seen] - 1
            print(f"{name:34} {seconds:8.1f} {spread:8.2%} {np.median(off):+7.2%} {np.sqrt(np.mean(off ** 2)):8.2%}"
                  f" {seconds * (spread / GOAL) ** 2:13.1f}", flush=True)


class Case:
    """The scene in the words of both programs, in a folder."""

    def __init__(self, folder, options):
        self.folder, self.options = folder, options
        path = pathlib.Path(options.scene).resolve()
        given = json.loads(path.read_text())
        self.unit = reader.UNITS[given.get("unit", "m")]
        self.scene = variant(given, path.parent)
        (folder / "scene.json").write_text(json.dumps(self.scene))
        faces = [face for entry in self.scene["captors"] for face in reader.captor_faces(entry, self.unit)]
        self.names = [face.name[0] for face in faces]
        self.discs = [face.triangles for face in faces]
        surfaces = self.surfaces()
        self.triangles = sum(" polygon " in line for line in surfaces)
        (folder / "scene.rad").write_text("\n".join(surfaces) + "\n")
        (folder / "day.rad").write_text(sun() + sky())
        self.tool("oconv", "scene.rad", "day.rad", out="day.oct")

    def surfaces(self):
        lines = []
        for name, material in self.scene["materials"].items():
            reflected, passed = material.get("reflectance", 0), material.get("transmittance", 0)
            colour = reflected + passed
            if material["type"] == "transparent":
                lines.append(f"void glass {name} 0 0 3 1 1 1")
            elif passed > 0:
                lines.append(f"void trans {name} 0 0 7 {colour} {colour} {colour} 0 0 {passed / colour} 0")
            else:
                lines.append(f"void plastic {name} 0 0 5 {reflected} {reflected} {reflected} 0 0")
        for part in self.scene["objects"]:
            for _, material, triangles in reader.read_obj(part["obj"]):
                for at in reader.places(part):
                    for triangle in reader.move(triangles * self.unit, at, self.unit):
                        corners = " ".join(f"{x:.9g}" for x in triangle.flat)
                        lines.append(f"{part.get('material', material)} polygon p{len(lines)} 0 0 9 {corners}")
        return lines

    def points(self, seed):
        """Points uniform on each disc, with its normal, a line each."""
        rng, lines = np.random.default_rng(seed), []
        for triangles in self.discs:
            normal = np.cross(triangles[0][1] - triangles[0][0], triangles[0][2] - triangles[0][0])
            normal = " ".join(f"{x:.6g}" for x in normal / np.linalg.norm(normal))
            for k in range(self.options.points):
                a, b, c = triangles[k % len(triangles)]
                u, v = rng.random(2)
                s = np.sqrt(u)
                at = (1 - s) * a + s * (1 - v) * b + s * v * c
                lines.append(" ".join(f"{x:.9g}" for x in at) + " " + normal)
        return ("\n".join(lines) + "\n").encode()

    def means(self, output):
        values = [float(line.split()[0]) for line in output.decode().splitlines() if line.strip()]
        return np.array(values).reshape(len(self.names), self.options.points).mean(axis=1)

    def tool(self, program, *words, given=b"", out=None):
        """Runs a program of Radiance; its output, and CPU seconds."""
        place = HOME / "bin" / program
        environment = {**os.environ, "RAYPATH": f".:{HOME / 'lib'}", "PATH": f"{HOME / 'bin'}:{os.environ['PATH']}"}
        before = spent()
        done = subprocess.run([str(place), *map(str, words)], input=given, capture_output=True, cwd=self.folder, env=environment)
        if done.returncode:
            raise RuntimeError(f"{program}: {done.stderr.decode().strip()}")
        if out:
            (self.folder / out).write_bytes(done.stdout)
        return done.stdout, spent() - before

    def phylux(self, estimator, histories, seed):
        before = spent()
        words = ["run", "scene.json", "--estimator", estimator, "--photons", int(histories), "--seed", seed, "--k", 0,
                 "--threads", 1, "--quiet"]
        program = pathlib.Path(self.options.phylux).resolve()
        done = subprocess.run([str(program), *map(str, words)], cwd=self.folder, capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError(done.stderr)
        results = json.loads((self.folder / "results.json").read_text())
        captors = {captor["id"]: captor["front"]["irradiance"][0] for captor in results["captors"]}
        return np.array([captors[name] for name in self.names]), spent() - before

    def methods(self):
        return {
            "phylux paths": lambda seed: self.phylux("paths", self.options.paths, seed),
            "phylux photons": lambda seed: self.phylux("photons", self.options.photons, seed),
            "rtrace, uncached": self.rtrace,
            "mkpmap, rtrace -ap": self.photon_map,
            "rcontrib, dctimestep, 145 patches": self.coefficients,
        }

    def ambient(self):
        return ["-aa", 0, "-as", 0, "-ab", self.options.bounces, "-ad", self.options.divisions, "-lw", 1e-4, "-lr", -10]

    def rtrace(self, seed):
        output, seconds = self.tool("rtrace", "-I", "-h", "-u+", "-dt", 0, "-dc", 1, "-dj", 1, *self.ambient(), "day.oct",
                                    given=self.points(seed))
        return self.means(output), seconds

    def photon_map(self, seed):
        """Density of the 50 nearest photons, at the end of one bounce from each point."""
        (self.folder / "day.gpm").unlink(missing_ok=True)
        _, made = self.tool("mkpmap", "-fo+", "-apr", seed, "-apg", "day.gpm", int(self.options.photons), "day.oct")
        output, seconds = self.tool("rtrace", "-I", "-h", "-aa", 0, "-as", 0, "-u+", "-dt", 0, "-ab", 1, "-ad",
                                    self.options.divisions, "-ap", "day.gpm", 50, "day.oct", given=self.points(seed))
        return self.means(output), made + seconds

    def coefficients(self, seed):
        """Daylight coefficients, then one hour: the sun in the patch in which it stands."""
        (self.folder / "sky.rad").write_text("#@rfluxmtx h=r1 u=Y\nvoid glow sky 0 0 4 1 1 1 0\nsky source dome 0 0 4 0 0 1 180\n")
        _, made = self.tool("rfluxmtx", "-I+", "-y", len(self.names) * self.options.points, "-u+", *self.ambient(), "-", "sky.rad",
                            "scene.rad", given=self.points(seed), out="day.mtx")
        patches = "\n".join(" ".join([f"{x:.9g}"] * 3) for x in of_patches())
        head = f"#?RADIANCE\nNROWS={len(of_patches())}\nNCOLS=1\nNCOMP=3\nFORMAT=ascii\n\n"
        (self.folder / "day.sky").write_text(head + patches + "\n")
        output, seconds = self.tool("dctimestep", "-h", "day.mtx", "day.sky")
        return self.means(output), made + seconds


def spent():
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime


def variant(given, folder):
    """What both programs can have alike: one band, diffuse surfaces and clear panes, discs, sun and sky."""
    def mean(value):
        return float(np.mean(value))

    materials = {}
    for name, material in given["materials"].items():
        if material["type"] == "transparent":
            materials[name] = {"type": "transparent", "ior": 1.52, "thin": True}
        else:
            reflected = mean(material.get("reflectance", 0)) + mean(material.get("specular", 0))
            materials[name] = {"type": "phong", "reflectance": reflected, "transmittance": mean(material.get("transmittance", 0))}
    objects = []
    for part in given["objects"]:
        kept = {key: value for key, value in part.items() if key not in ("captor", "group")}
        objects.append({**kept, "obj": str((folder / part["obj"]).resolve())})
    captors = [{key: value for key, value in entry.items() if key != "sides"} for entry in given["captors"] if "obj" not in entry]
    for entry in captors:
        if "csv" in entry:
            entry["csv"] = str((folder / entry["csv"]).resolve())
    return {"unit": given.get("unit", "m"), "materials": materials, "objects": objects, "captors": captors,
            "sun_at": {"elevation_deg": ELEVATION, "azimuth_deg": AZIMUTH},
            "lights": [{"type": "sun", "irradiance": SUN, "half_angle_deg": HALF_ANGLE},
                       {"type": "sky", "model": "uniform", "irradiance": SKY}]}


def sun():
    h, a = np.radians([ELEVATION, AZIMUTH])
    toward = f"{np.sin(a) * np.cos(h)} {np.cos(a) * np.cos(h)} {np.sin(h)}"
    radiance = SUN / (np.pi * np.sin(np.radians(HALF_ANGLE)) ** 2)
    return f"void light solar 0 0 3 {radiance} {radiance} {radiance}\nsolar source sun 0 0 4 {toward} {2 * HALF_ANGLE}\n"


def sky():
    level = SKY / np.pi
    return f"void glow dome 0 0 4 {level} {level} {level} 0\ndome source sky 0 0 4 0 0 1 180\n"


def of_patches():
    """Radiance of the patches, from north through east, from the horizon up."""
    edges = np.radians([*range(0, 85, 12), 90])
    radiance = [SKY / np.pi] * sum(TREGENZA)
    row = min(int(ELEVATION / 12), 7)
    column = int(AZIMUTH / 360 * TREGENZA[row] + 0.5) % TREGENZA[row]
    solid_angle = 2 * np.pi * (np.sin(edges[row + 1]) - np.sin(edges[row])) / TREGENZA[row]
    radiance[sum(TREGENZA[:row]) + column] += SUN / solid_angle
    return radiance


main()
