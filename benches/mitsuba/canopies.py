"""CPU time to 1 % standard error at the median leaf, phylux against Mitsuba 3, in canopies that repeat.

    python benches/mitsuba/canopies.py                       # leaves.py's three canopies
    python benches/mitsuba/canopies.py scenes/canopy.json

README.md beside this file says what is compared and how.
"""

import argparse
import sys
import tempfile
from pathlib import Path

from compare import GOAL, HERE, Clock, Method, captors_of, moments

import drjit as dr
import mitsuba as mi
import numpy as np

OURS = {"photons": ["--estimator", "photons", "--guiding", "off", "--k", "0"],
        "paths": ["--estimator", "paths", "--k", "0"],
        "complete": ["--estimator", "complete", "--k", "0"],
        "default": []}
THEIRS = {"forward": True, "forward, at random": False}  # whether photons start in strata
PILOTS = 4  # runs that tell how many histories 1 % takes


def main():
    options = arguments()
    if not Path(options.phylux).exists():
        sys.exit(f"{options.phylux}: no such program; build it (cargo build --release) or give --phylux")
    with tempfile.TemporaryDirectory() as folder:
        import leaves

        for path in options.scenes or leaves.write(Path(folder) / "leaves"):
            compare(path, Path(folder) / "scene.json", options)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="*", help="scenes of phylux [default: those of leaves.py]")
    parser.add_argument("--phylux", default=HERE.parents[2] / "target/release/phylux", help="the program")
    parser.add_argument("--share", type=float, default=1.0,
                        help="of the histories that 1 %% takes, for a run; photons in strata take all")
    parser.add_argument("--seeds", type=int, default=11, help="runs of each method")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--around", type=int, default=10, help="cells on each side of the middle one, in Mitsuba")
    parser.add_argument("--variants", default="llvm_ad_mono", help="of Mitsuba, with commas between")
    parser.add_argument("--ours", default="photons,complete,default", help=f"of {', '.join(OURS)}")
    return parser.parse_args()


def compare(path, scene, options):
    """One table for one scene."""
    import canopy

    canopy.variant(path, scene)
    world = canopy.load(scene)
    methods = [Ours(name, options, scene, world) for name in options.ours.split(",")]
    for variant in options.variants.split(","):
        methods += [Theirs(name, variant, options, world) for name in THEIRS]
    print(f"\n{Path(path).name}: {len(world.captors)} leaves, bands {', '.join(world.bands)}", flush=True)
    for method in methods:
        method.prepare()
        print(f"  {method.name}: {method.histories}", file=sys.stderr, flush=True)
    for seed in range(1, options.seeds + 1):
        for method in methods:  # in alternation: the machine is shared
            method.measure(seed)
    report(world, methods)


class AtMedian(Method):
    """A method judged by the error of the median leaf, run with as many histories as 1 % takes."""

    def errors(self):
        return median_errors(self.found)

    def prepare(self):
        self.histories = [self.least] * len(self.groups)
        for number, group in enumerate(self.groups):
            for _ in range(self.rounds):
                found = [self.render(number, 1000 + seed) for seed in range(PILOTS)]
                error = max(median_errors(found)[:len(group)])
                wanted = self.histories[number] * (error / GOAL) ** 2
                self.histories[number] = int(max(wanted, self.least / 10))
            self.histories[number] = int(self.histories[number] * self.share)


def median_errors(found):
    """Over the lit leaves the median relative deviation of one run, per band."""
    mean, spread = np.mean(found, axis=0), np.std(found, axis=0, ddof=1)
    return np.array([np.median(spread[mean[:, b] > 0, b] / mean[mean[:, b] > 0, b])
                     for b in range(mean.shape[1])])


class Ours(AtMedian):
    """phylux; all bands in one run."""

    least, rounds = 20_000, 1

    def __init__(self, name, options, scene, world):
        super().__init__(f"phylux {name}", [list(range(len(world.bands)))])
        self.own, self.options, self.scene, self.world = OURS[name], options, scene, world
        self.share = options.share
        self.start = np.median([self.run(200, seed)[1] for seed in range(1, 6)], axis=0)

    def run(self, histories, seed):
        out = self.scene.with_name("results.json")
        command = [self.options.phylux, "run", self.scene, *self.own, "--photons", histories,
                   "--seed", seed, "--threads", self.options.threads, "-q", "-o", out]
        captors, whole = captors_of(command, out)
        return np.array([captors[name]["absorbed"] for name in self.world.captors]), whole

    def render(self, _, seed):
        return self.run(self.histories[0], seed)[0]

    def measure(self, seed):
        found, whole = self.run(self.histories[0], seed)
        self.found.append(found)
        # warm: less what a run of next to nothing takes
        self.times.append([np.maximum(whole - self.start, 1e-3)])


class Theirs(AtMedian):
    """Photons of Mitsuba; a run for each band, or for each three."""

    least, rounds = 100_000, 2

    def __init__(self, name, variant, options, world):
        channels = 3 if "rgb" in variant else 1
        bands = list(range(len(world.bands)))
        groups = [bands[b:b + channels] for b in bands[::channels]]
        super().__init__(f"Mitsuba {name}" + (", rgb" if channels == 3 else ""), groups)
        self.variant = variant
        self.share = 1.0 if THEIRS[name] else options.share
        self.use()
        dr.set_thread_count(options.threads)
        import field

        full = [group + group[-1:] * (channels - len(group)) for group in groups]
        clock = Clock()
        self.scenes = [field.Forward(world, group, options.around, THEIRS[name]) for group in full]
        for scene in self.scenes:
            scene.render(self.least, 0)
        self.start = clock.read()

    def use(self):
        """Mitsuba's types of this variant."""
        if mi.variant() != self.variant:
            mi.set_variant(self.variant)
            for module in ("build", "materials", "field"):  # they hold the variant's types
                sys.modules.pop(module, None)

    def render(self, number, seed):
        self.use()
        return self.scenes[number].render(self.histories[number], seed)

    def measure(self, seed):
        parts, times = [], []
        self.use()
        for number, group in enumerate(self.groups):
            clock = Clock()
            parts.append(self.render(number, seed)[:, :len(group)])
            times.append(clock.read())
        self.found.append(np.concatenate(parts, axis=1))
        self.times.append(times)


def report(world, methods):
    """Time, and agreement with the first method."""
    print("  method                       CPU s to 1 %   start   a run   error per band   all leaves absorb, W")
    for method in methods:
        run = np.median(method.times, axis=0).sum(axis=0)[1]
        errors = " ".join(f"{error:.2%}" for error in method.errors())
        sums = ", ".join(f"{total:.5g} ± {error:.1g}" for total, error in
                         zip(*moments(np.sum(method.found, axis=1))))
        print(f"  {method.name:28} {method.to_goal()[1]:12.3f} {method.start[1]:7.2f} {run:7.3f}   {errors}   {sums}")
    mean, error = moments(methods[0].found)
    for method in methods[1:]:
        own, own_error = moments(method.found)
        lit = (mean > 0) & (own > 0)
        z = (own - mean)[lit] / np.hypot(error, own_error)[lit]
        print(f"  {method.name}: RMS z to {methods[0].name} {np.sqrt(np.mean(z ** 2)):.2f},"
              f" largest {np.abs(z).max():.1f} of {z.size}", flush=True)


if __name__ == "__main__":
    main()
