"""Measures the cost of using phylux from Python: `python python/benches/figures.py [SCENE] [PHOTONS]`, with the package
installed.

Prints times that users notice: a run in Python compared with the command (medians of pairs), handing over triangles, and
making a DataFrame of results. Also prints the memory over 200 runs, the delay after Ctrl-C, and the number of threads
that remain. Needs pandas, and Linux for /proc.
"""

import os
import re
import signal
import statistics
import subprocess
import sys
import threading
import time
import warnings
from pathlib import Path

import numpy as np

import phylux as px

warnings.simplefilter("ignore", px.SceneWarning)


def timed(work):
    start = time.perf_counter()
    done = work()
    return time.perf_counter() - start, done


def measured(work):
    """Returns the time by the clock and the processor time as a text, and the result of ``work``."""
    spent = time.process_time()
    clock, done = timed(work)
    return f"{clock:.2f} s ({time.process_time() - spent:.2f} s of processor time)", done


def processor(work):
    """Returns the processor time of ``work`` in seconds, including child processes."""
    start = sum(os.times()[:4])
    work()
    return sum(os.times()[:4]) - start


def overhead(path, photons, pairs=7):
    """Compares a run of a saved scene by the command with the same run in Python. The time of the command includes its
    start; that of Python does not include the start of Python.

    Prints seconds by the clock, and seconds of processor time, which other load on the machine changes less.
    """
    command = [str(Path(sys.executable).parent / "phylux"), "run", str(path), f"--photons={photons}", "--threads=1", "-o", "/tmp/figures.json"]
    binary = os.environ.get("PHYLUX_BINARY")
    if binary:
        command[0] = binary
    ways = {
        "command": lambda: subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL),
        "Python": lambda: px.Scene.load(path).run(photons=photons, threads=1).save("/tmp/figures-python.json"),
    }
    clock, spent = {name: [] for name in ways}, {name: [] for name in ways}
    for _ in range(pairs):
        for name, way in ways.items():
            spent[name].append(processor(lambda: clock[name].append(timed(way)[0])))
    assert Path("/tmp/figures.json").read_bytes() == Path("/tmp/figures-python.json").read_bytes()
    for what, seconds in (("by the clock", clock), ("of processor time", spent)):
        c, p = (statistics.median(seconds[name]) for name in ways)
        print(
            f"a run of {photons:.0e} photons, {what}: command {c:.3f} s, load + run + save in Python {p:.3f} s, "
            f"{p - c:+.3f} s ({p / c - 1:+.1%})"
        )


def million(photons=100_000):
    side = 708
    x, y = np.meshgrid(np.linspace(0, 10, side), np.linspace(0, 10, side))
    vertices = np.column_stack([x.ravel(), y.ravel(), 0.1 * np.sin(3 * x).ravel()])
    i = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
    faces = np.vstack([np.column_stack([i, i + 1, i + side]), np.column_stack([i + 1, i + side + 1, i + side])])
    scene = px.Scene("million")
    scene.material("leaf", type="leaf", reflectance=0.1, transmittance=0.1)
    scene.light("lamp", type="point", position=[5, 5, 5], power=100)
    added, _ = measured(lambda: scene.add("field", (vertices, faces), material="leaf", captor="triangle"))
    from phylux import _native

    parts = next(iter(scene._meshes.values())).parts("field")
    # a scene of one small triangle, so that only the hand-over is timed and not building the hierarchy for rays
    small = '{"materials": {"grey": {"type": "lambert", "reflectance": 0.5}}, "lights": [{"type": "point", "position": [0, 0, 1], "power": 1}]}'
    handed, _ = measured(lambda: _native.load(small, "scene", [parts], {}, False))
    print(f"{len(faces)} triangles: add {added}, handed over {handed}")
    loaded, _ = measured(lambda: scene._load(quiet=True))
    print(f"  scene of them as captors, with the hierarchy for rays: {loaded}")
    ran, found = measured(lambda: scene.run(photons=photons, k=0))
    framed, frame = measured(lambda: found.frame)
    print(f"  run of {photons} photons {ran}; DataFrame of {len(frame)} rows {framed}")
    arrays, _ = measured(lambda: px.Result(found._found).irradiance)
    print(f"  numpy arrays alone {arrays}")


def resident():
    return int(re.search(r"VmRSS:\s+(\d+) kB", Path("/proc/self/status").read_text())[1])


def threads():
    return len(os.listdir("/proc/self/task"))


def memory(path):
    scene, sizes = px.Scene.load(path), []
    for seed in range(200):
        scene.run(photons=1000, k=0, seed=seed)
        if seed % 40 == 39:
            sizes.append(resident())
    print(f"resident memory after 40, 80, ... 200 runs, kB: {sizes}")


def interrupts(path, count=20):
    scene, latencies = px.Scene.load(path), []
    before = threads()

    def interrupt():
        sent.append(time.perf_counter())
        os.kill(os.getpid(), signal.SIGINT)

    for n in range(count):
        sent = []
        # some interrupts come while the scene is read, others while photons are traced
        timer = threading.Timer(0.05 + 0.02 * n, interrupt)
        timer.start()
        try:
            scene.run(photons=1e12, k=0)
        except KeyboardInterrupt:
            latencies.append(time.perf_counter() - sent[0])
        timer.join()
    time.sleep(0.5)
    print(f"{count} interrupts: back after {statistics.median(latencies):.3f} s (median), {max(latencies):.3f} s (most); threads {before} -> {threads()}")


if __name__ == "__main__":
    scene = sys.argv[1] if len(sys.argv) > 1 else "scenes/greenhouse.json"
    photons = int(float(sys.argv[2])) if len(sys.argv) > 2 else 400_000
    overhead(scene, photons)
    interrupts(scene)
    memory(scene)
    million()
