"""Wall and CPU time to 1 % standard error, phylux against Mitsuba 3, on one phylux scene.

    python benches/mitsuba/compare.py scenes/greenhouse.json

README.md beside this file says what is compared and how.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

try:
    import drjit as dr
    import mitsuba as mi
    import numpy as np
except ImportError as missing:
    print(f"skipped: {missing.name} is not installed (pip install mitsuba numpy)")
    sys.exit(0)

GOAL = 0.01
HERE = Path(__file__).resolve()


def main():
    options = arguments()
    if options.startup:
        return start_mitsuba(options)
    if not Path(options.phylux).exists():
        sys.exit(f"{options.phylux}: no such program; build it (cargo build --release) or give --phylux")
    if options.seeds < 8:
        sys.exit(f"--seeds {options.seeds}: a deviation needs at least 8")
    with tempfile.TemporaryDirectory() as folder:
        import scene  # numpy is needed for it

        folder = Path(folder)
        variant = folder / "scene.json"
        scene.variant(options.scene, variant)
        world = scene.load(variant)
        ours = {"photons": ["--estimator", "photons", "--guiding", "off"], "paths": ["--estimator", "paths"],
                "photons, aimed": ["--estimator", "photons", "--guiding", "aim"]}
        methods = [Phylux(name, own, options, variant, world) for name, own in ours.items()]
        for name in options.variants.split(","):
            for tracer in ("forward", "backward"):
                methods.append(Mitsuba(name, tracer, options, variant, world))
        methods = [method for method in methods if any(word in method.name for word in options.only.split(","))]
        bands = ", ".join(world.bands)
        print(f"{options.scene}: {len(world.faces)} faces of captors, bands {bands}", flush=True)
        for method in methods:
            method.prepare(options.seconds)
        for seed in range(1, options.seeds + 1):
            for method in methods:  # in alternation: the machine is shared
                method.measure(seed)
        report(world, methods)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene")
    parser.add_argument("--phylux", default=HERE.parents[2] / "target/release/phylux", help="the program")
    parser.add_argument("--seeds", type=int, default=16, help="runs of each method, at least 8")
    parser.add_argument("--seconds", type=float, default=2.0, help="CPU time of one run on each thread")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--variants", default="llvm_ad_mono", help="of Mitsuba, with commas between")
    parser.add_argument("--only", default="", help="methods whose names contain one of these, with commas between")
    parser.add_argument("--sampler", default="multijitter", help="of Mitsuba's backward paths")
    # this variant and tracer are started and no more
    parser.add_argument("--startup", nargs=2, help=argparse.SUPPRESS)
    return parser.parse_args()


@dataclass
class Clock:
    """Wall and CPU seconds of this process or of its children."""

    who: int = resource.RUSAGE_SELF
    wall: float = field(default_factory=time.perf_counter)

    def __post_init__(self):
        self.cpu = self.processor()

    def processor(self):
        usage = resource.getrusage(self.who)
        return usage.ru_utime + usage.ru_stime

    def read(self):
        return np.array([time.perf_counter() - self.wall, self.processor() - self.cpu])


class Method:
    """What one method has found: per seed the irradiance of each face and band, and the time of each group
    of bands that is rendered together."""

    def __init__(self, name, groups):
        self.name, self.groups, self.found, self.times, self.start = name, groups, [], [], {}

    def errors(self):
        """Mean over the lit faces of the relative deviation of one run, per band."""
        found = np.array(self.found)
        mean, spread = found.mean(axis=0), found.std(axis=0, ddof=1)
        return np.array([np.mean(spread[mean[:, b] > 0, b] / mean[mean[:, b] > 0, b])
                         for b in range(mean.shape[1])])

    def to_goal(self):
        """Wall and CPU seconds until that is 1 % in every band, once started."""
        errors, times = self.errors(), np.median(self.times, axis=0)
        return sum(times[g] * max((errors[b] / GOAL) ** 2 for b in group)
                   for g, group in enumerate(self.groups))


def captors_of(command, out):
    """Runs phylux; returns its captors by their ids, and the times of the run."""
    clock = Clock(resource.RUSAGE_CHILDREN)
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(done.stderr)
    whole = clock.read()
    return {captor["id"]: captor for captor in json.loads(out.read_text())["captors"]}, whole


class Phylux(Method):
    """Photons or paths; all bands in one run."""

    def __init__(self, name, own, options, variant, world):
        super().__init__(f"phylux {name}", [list(range(len(world.bands)))])
        self.own, self.options, self.variant, self.world = own, options, variant, world

    def run(self, histories, seed):
        out = self.variant.with_name("results.json")
        command = [self.options.phylux, "run", self.variant, *self.own, "--photons",
                   histories, "--seed", seed, "--k", 0, "--threads", self.options.threads,
                   "-o", out]
        captors, whole = captors_of(command, out)
        found = [captors[face.name[0]][face.name[1]]["irradiance"] for face in self.world.faces]
        return np.array(found), whole

    def prepare(self, seconds):
        least = 200 * len(self.world.faces)
        self.start = {"": np.median([self.run(least, 1)[1] for _ in range(5)], axis=0)}
        self.histories = 20 * least
        for share in (0.2, 1.0):  # the first guess is rough
            whole = self.run(self.histories, 1)[1][1]
            # what a guided run takes before its first photon depends on how many photons there are
            taken = max(whole - self.start[""][1], whole / 5)
            self.histories = int(self.histories / taken * seconds * self.options.threads * share)

    def measure(self, seed):
        found, whole = self.run(self.histories, seed)
        self.found.append(found)
        # warm: less what a run of next to nothing takes
        self.times.append([np.maximum(whole - self.start[""], 1e-3)])

    def traced(self):
        return self.histories


class Mitsuba(Method):
    """Photons (forward) or paths (backward); a run for each band, or for each three."""

    def __init__(self, name, tracer, options, variant, world):
        channels = 3 if "rgb" in name else 1
        bands = list(range(len(world.bands)))
        groups = [bands[b:b + channels] for b in bands[::channels]]
        super().__init__(f"Mitsuba {tracer}" + (", rgb" if channels == 3 else ""), groups)
        self.tracer = tracer
        self.each = len(world.faces) if tracer == "backward" else 1  # paths start from each face
        self.variant, self.options, self.scene_file, self.world = name, options, variant, world
        self.channels = channels

    def renders(self):
        """One Mitsuba scene for each group of bands."""
        mi.set_variant(self.variant)
        dr.set_thread_count(self.options.threads)
        for module in ("materials", "build", "backward", "forward"):  # they hold the variant's types
            sys.modules.pop(module, None)
        full = [group + group[-1:] * (self.channels - len(group)) for group in self.groups]
        if self.tracer == "forward":
            from forward import Forward

            return [Forward(self.world, group) for group in full]
        from backward import Backward

        return [Backward(self.world, group, self.options.sampler) for group in full]

    def prepare(self, seconds):
        self.scenes = self.renders()
        samples = 4096 * len(self.world.faces) // self.each
        self.scenes[0].render(samples // 64, 0)
        self.scenes[0].render(samples, 0)
        clock = Clock()
        self.scenes[0].render(samples, 0)
        wanted = samples * seconds * self.options.threads / len(self.groups) / clock.read()[1]
        # squares suit the stratified samplers; the limit keeps a launch in memory
        most = 2e7 / self.each if self.tracer == "backward" else wanted
        self.histories = int(min(wanted, most) ** 0.5) ** 2
        for scene in self.scenes:
            scene.render(self.histories, 0)
        with tempfile.TemporaryDirectory() as home:  # compiled kernels are kept there
            for label, times in (("first ever", 1), ("kernels kept", 5)):
                self.start[label] = np.median([self.started(home) for _ in range(times)], axis=0)

    def started(self, home):
        command = [sys.executable, HERE, self.scene_file, "--startup", self.variant, self.tracer,
                   "--sampler", self.options.sampler, "--threads", str(self.options.threads)]
        clock = Clock(resource.RUSAGE_CHILDREN)
        subprocess.run([str(word) for word in command], check=True, env={**os.environ, "HOME": home})
        return clock.read()

    def measure(self, seed):
        mi.set_variant(self.variant)
        parts, times = [], []
        for group, scene in zip(self.groups, self.scenes):
            clock = Clock()
            parts.append(scene.render(self.histories, seed)[:, :len(group)])
            times.append(clock.read())
        self.found.append(np.concatenate(parts, axis=1))
        self.times.append(times)

    def traced(self):
        return self.histories * self.each * len(self.groups)


def start_mitsuba(options):
    """All that Mitsuba does before it is warm: import, scenes, kernels."""
    import scene

    world = scene.load(options.scene)
    for render in Mitsuba(*options.startup, options, options.scene, world).renders():
        render.render(4, 0)


def report(world, methods):
    """Agreement, then time."""
    reference = methods[-1]
    mean, error = moments(reference.found)
    lit = mean > 0
    print(f"\nagreement with {reference.name}, over all faces and bands")
    for method in methods[:-1]:
        own_mean, own_error = moments(method.found)
        both = np.sqrt(own_error ** 2 + error ** 2)[lit]
        z = (own_mean - mean)[lit] / both
        print(f"  {method.name}: rms z {np.sqrt(np.mean(z ** 2)):.2f}, largest {np.abs(z).max():.1f}"
              f" of {z.size}, median error of a difference {np.median(both / mean[lit]):.2%}")
        # faces share photons: the error of their sum comes from the seeds
        totals = [moments(np.sum(m.found, axis=1)) for m in (method, reference)]
        ratios = totals[0][0] / totals[1][0]
        relative = np.hypot(*(error / total for total, error in totals))
        for band, ratio, error_of_it in zip(world.bands, ratios, ratios * relative):
            print(f"    sum over the faces, {band}: ratio {ratio:.4f} +- {error_of_it:.4f}")

    print(f"\ntime to {GOAL:.0%} averaged over the captors, in each band, s"
          "\n  method                   warm: wall      cpu   from the shell: wall      cpu")
    for method in methods:
        warm = method.to_goal()
        for label, start in method.start.items():
            whole = warm + start
            times = f"{warm[0]:13.2f} {warm[1]:8.2f} {whole[0]:22.2f} {whole[1]:8.2f}"
            print(f"  {method.name:22} {times}   {label}".rstrip())
    print("\n  method                 a run: histories    wall     cpu   error per band")
    for method in methods:
        times = np.median(method.times, axis=0).sum(axis=0)
        errors = " ".join(f"{error:.2%}" for error in method.errors())
        print(f"  {method.name:24} {method.traced():14.3g} {times[0]:7.2f} {times[1]:7.2f}   {errors}")


def moments(found):
    """Mean and its standard error over the seeds."""
    return np.mean(found, axis=0), np.std(found, axis=0, ddof=1) / np.sqrt(len(found))


if __name__ == "__main__":
    main()
