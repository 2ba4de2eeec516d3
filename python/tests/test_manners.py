"""Tests of progress, Ctrl-C, threads, memory, sweeps, messages and types."""

import concurrent.futures
import doctest
import importlib
import inspect
import multiprocessing
import os
import pydoc
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

import phylux as px
from conftest import ROOM_FACES, ROOM_VERTICES, chamber

MODULES = ["phylux", "phylux.studies", "phylux.scene", "phylux.result", "phylux.geometry", "phylux.leaves", "phylux.sweeps", "phylux.years", "phylux.plots", "phylux.errors", "phylux.shown", "phylux.values"]


def native_threads():
    """Returns the number of threads of this process according to the system, including those of the native part."""
    return len(os.listdir("/proc/self/task"))


def interrupted(run):
    """Sends Ctrl-C once the run has begun, and returns the time until the run has ended, s."""
    begun = []

    def tell(done, of):
        if not begun:
            begun.append(time.perf_counter())
            threading.Timer(0.0, lambda: os.kill(os.getpid(), signal.SIGINT)).start()

    # a process that was started in the background ignores Ctrl-C from the beginning
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            run(tell)
    finally:
        signal.signal(signal.SIGINT, before)
    return time.perf_counter() - begun[0]


@pytest.mark.skipif(sys.platform == "win32", reason="signals are sent in another way there")
def test_ctrl_c_ends_a_run_and_leaves_no_thread(scene):
    run = lambda tell: scene.run(photons=1e12, k=0, progress=tell)  # noqa: E731
    interrupted(run)
    time.sleep(0.5)
    if not Path("/proc/self/task").is_dir():
        return
    before = native_threads()
    for _ in range(5):
        interrupted(run)
    deadline = time.monotonic() + 10
    while native_threads() > before and time.monotonic() < deadline:
        time.sleep(0.05)
    assert native_threads() <= before
    # later runs work as before
    assert scene.run(photons=1000, k=0).photons == 1000


def test_an_exception_of_the_callback_ends_the_run(scene):
    def tell(done, of):
        raise LookupError("enough")

    with pytest.raises(LookupError, match="enough"):
        scene.run(photons=1e12, k=0, progress=tell)


def test_other_threads_go_on(scene):
    counted, told = [0], []
    stop = threading.Event()

    def count():
        while not stop.is_set():
            counted[0] += 1
            time.sleep(0.001)

    def tell(done, of):
        told.append((done, of, counted[0]))
        if len(told) > 5:
            raise StopIteration

    thread = threading.Thread(target=count)
    thread.start()
    try:
        with pytest.raises(StopIteration):
            scene.run(photons=1e12, k=0, estimator="photons", progress=tell)
    finally:
        stop.set()
        thread.join()
    assert told[-1][2] > told[0][2]
    assert all(of == 1e12 for _, of, _ in told) and told[-1][0] > told[0][0]


def test_runs_of_several_threads_do_not_disturb_each_other(scene):
    with concurrent.futures.ThreadPoolExecutor(3) as pool:
        found = list(pool.map(lambda seed: scene.run(photons=2000, k=0, seed=seed, threads=1).to_json(), [1, 2, 1]))
    assert found[0] == found[2] != found[1]


def test_progress_of_tqdm(scene, capsys):
    pytest.importorskip("tqdm")
    scene.run(photons=20_000, k=0, progress=True)
    assert "100%" in capsys.readouterr().err


def build(height, seed):
    scene = chamber()
    scene.keys["lights"][1]["position"] = [0.5, 0.2, height]
    return scene.run(photons=2000, k=0, seed=seed, threads=1)


def test_sweep_over_a_function():
    pytest.importorskip("pandas")
    grid = {"height": [0.6, 0.8], "seed": [1, 2]}
    found = px.sweep(build, grid)
    assert found.values == [{"height": h, "seed": s} for h in (0.6, 0.8) for s in (1, 2)]
    frame = found.frame
    assert list(frame.columns[:4]) == ["run", "height", "seed", "captor"]
    assert len(frame) == sum(len(result.frame) for result in found)
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        spread = px.sweep(build, grid, executor=pool)
    assert [result.to_json() for result in spread] == [result.to_json() for result in found]
    rows = px.sweep(build, [{"height": 0.6, "seed": 1}])
    assert rows[0].to_json() == found[0].to_json()


def test_sweep_over_pointers(scene):
    told = []
    found = px.sweep(scene, {"/lights/0/power/1": [0, 80], "seed": [5]}, photons=2000, k=0, progress=lambda *now: told.append(now))
    assert told == [(1, 2), (2, 2)]
    assert found[1].seed == 5 and found[0].energy["power"][1] == 5
    assert scene.keys["lights"][0]["power"] == [20, 80]
    with pytest.raises(px.InputError, match="the scene has no `/lights/7/power`"):
        px.sweep(scene, {"/lights/7/power": [1]})


def test_sweep_in_other_processes():
    spawn = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(1, mp_context=spawn) as pool:
        found = px.sweep(build, {"height": [0.6], "seed": [1, 2]}, executor=pool)
    assert found[0].to_json() == build(0.6, 1).to_json()
    with pytest.raises(px.InputError) as caught:
        with concurrent.futures.ProcessPoolExecutor(1, mp_context=spawn) as pool:
            px.sweep(build, {"height": ["high"], "seed": [1]}, executor=pool)
    assert caught.value.place == "scene: /lights/1/position/2"


def test_sweep_by_joblib():
    loky = pytest.importorskip("joblib.externals.loky", reason="joblib is not installed")
    found = px.sweep(build, {"height": [0.6], "seed": [1, 2]}, executor=loky.get_reusable_executor(1))
    assert found[1].to_json() == build(0.6, 2).to_json()


def test_sweep_on_a_dask_cluster():
    distributed = pytest.importorskip("distributed", reason="dask.distributed is not installed")
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        with distributed.Client(cluster) as client:
            found = px.sweep(build, {"height": [0.6], "seed": [1, 2]}, executor=client.get_executor())
    assert found[1].to_json() == build(0.6, 2).to_json()


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_memory_does_not_grow(scene):
    """
    A hundred runs after a hundred others take no memory that they keep. One result of this scene takes about 20 kB, so
    that a leak would take 2 MB in each of three tries; what the allocator keeps once is not in all of them.
    """

    def resident():
        return int(re.search(r"VmRSS:\s+(\d+) kB", Path("/proc/self/status").read_text())[1])

    def runs():
        for seed in range(100):
            found = scene.run(photons=500, k=0, seed=seed, threads=1)
            assert found.flux.shape == (8, 2, 3)

    runs()
    grown = []
    for _ in range(3):
        before = resident()
        runs()
        grown.append(resident() - before)
    assert min(grown) < 1000, grown


def options_of(command):
    """Returns the options that the help of a command names, in the spelling of Python, without `--full`."""
    line = [sys.executable, "-c", "import sys; from phylux import _cli; sys.exit(_cli())", command, "--help"]
    help = subprocess.run(line, check=True, capture_output=True, text=True).stdout
    names = {name.replace("-", "_") for name in re.findall(r"^ +(?:-\w, )?--([a-z-]+)", help, re.MULTILINE)}
    # tables on the terminal are the command's alone
    return names - {"full"}


def test_every_option_of_the_command_is_an_argument():
    """Exceptions are options that name files to write, and options about messages during the run."""
    alone = {
        "run": {"help", "quiet", "output", "csv", "per_captor", "stats", "shard"},
        "year": {"help", "quiet", "shard"},
    }
    for name, left_out in alone.items():
        # words that are reserved in Python have a `_` behind them
        arguments = {argument.rstrip("_") for argument in inspect.signature(getattr(px.Scene, name)).parameters}
        options = options_of(name)
        assert left_out <= options, name
        assert arguments - {"self", "progress", "options", "shards", "executor"} == options - left_out, name
    told = px.Scene.render.__doc__
    unknown = [name for name in options_of("render") - {"help", "quiet", "output"} if f"``{name}" not in told]
    assert not unknown


def test_a_run_is_kept_and_gone_on_with(scene, tmp_path):
    kept = tmp_path / "kept"

    def until_kept(done, of):
        if kept.exists():
            raise LookupError("kept")

    with pytest.raises(LookupError, match="kept"):
        scene.run(photons=2e6, k=0, checkpoint=kept, checkpoint_every=0.001, progress=until_kept)
    # the run ends only some time after the exception
    time.sleep(0.5)
    found = scene.run(photons=2e6, k=0, checkpoint=kept)
    assert not kept.exists()
    assert found.to_json() == scene.run(photons=2e6, k=0).to_json()


@pytest.mark.parametrize("name", MODULES)
def test_doctests(name):
    found = doctest.testmod(importlib.import_module(name), optionflags=doctest.NORMALIZE_WHITESPACE)
    assert found.failed == 0


def test_help_says_units_and_shapes():
    text = pydoc.render_doc(px.Result)
    for word in ("W/m2", "(captors, 2, bands)", "m2", "1 sigma"):
        assert word in text + pydoc.render_doc(px.Values), word
    for name in px.__all__:
        thing = getattr(px, name)
        assert thing.__doc__, name
        for member, value in vars(thing).items() if isinstance(thing, type) else ():
            if not member.startswith("_") and (callable(value) or isinstance(value, property)):
                assert value.__doc__, f"{name}.{member}"


def test_types(tmp_path):
    pytest.importorskip("mypy")
    config = Path(__file__).parent.parent / "pyproject.toml"
    checks = [
        [sys.executable, "-m", "mypy", "--config-file", str(config), "-p", "phylux"],
        [sys.executable, "-m", "mypy.stubtest", "--mypy-config-file", str(config), "phylux._native"],
    ]
    for check in checks:
        done = subprocess.run(check, cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr


ROOT = Path(__file__).parents[2]
NAMED = [ROOT / name for name in ("README.md", "python/README.md", "docs/python.md")]
FOLDERS = [page for folder in ("coming-from", "python") for page in sorted(ROOT.glob(f"docs/{folder}/*.md"))]
PAGES = [path for path in [*NAMED, *FOLDERS] if path.is_file() and "import phylux" in path.read_text(encoding="utf-8")]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_the_examples_of_the_pages_run(page, tmp_path, monkeypatch):
    """All Python blocks of a page run in order, in a separate folder, with few photons."""
    others = ["pyvista"] if page.name == "pyvista.md" else []
    for package in ("pandas", "xarray", "trimesh", "tqdm", "matplotlib", *others):
        pytest.importorskip(package)
    import matplotlib

    matplotlib.use("Agg")
    text = page.read_text(encoding="utf-8")
    # a comment stands before the blocks that need something else
    found = re.findall(r"(-->\n\n)?```python\n(.*?)```", text, re.DOTALL)
    blocks = [block for other, block in found if not other and ("phylux" in block or "px." in block)]
    assert blocks
    monkeypatch.chdir(tmp_path)
    run = px.Scene.run
    monkeypatch.setattr(px.Scene, "run", lambda self, photons=None, *a, **o: run(self, 5000, *a, **{**o, "tolerance": None}))
    room = "".join(f"v {x} {y} {z}\n" for x, y, z in ROOM_VERTICES * [1200, 1800, 2200])
    faces = "".join("f {} {} {}\n".format(*face) for face in ROOM_FACES + 1)
    Path("room.obj").write_text(room + faces)
    space = {"__name__": "__main__"}
    for block in blocks:
        exec(compile(block, str(page), "exec"), space)


TUTORIAL = Path(__file__).parents[2] / "docs/tutorial.md"


@pytest.mark.skipif(not TUTORIAL.is_file(), reason="the pages are not beside the tests")
def test_the_python_of_the_tutorial(tmp_path, monkeypatch):
    """The tutorial works for a reader who makes its files, does a short run, and pastes its Python blocks in order."""
    for package in ("pandas", "matplotlib"):
        pytest.importorskip(package)
    import matplotlib

    matplotlib.use("Agg")
    monkeypatch.chdir(tmp_path)
    Path("scenes").mkdir()
    text = TUTORIAL.read_text(encoding="utf-8")
    for name, content in re.findall(r"`([\w.]+)`:\n\n```\w+\n(.*?)```", text, re.DOTALL):
        Path("scenes", name).write_text(content)
    px.load("scenes/rack.json").run(photons=20_000, k=0).save_csv("rack.csv")
    space = {"__name__": "__main__"}
    for block in re.findall(r"```python\n(.*?)```", text, re.DOTALL):
        exec(compile(block, str(TUTORIAL), "exec"), space)
    assert len(space["leaves"]) == 12 and len(space["sensors"]) == 4
    assert Path("leaves.png").stat().st_size > 0 and Path("sensors.png").stat().st_size > 0
    scene = px.Scene.load("scenes/rack.json")
    scene.keys["objects"][1]["obj"] = "five-leaves.obj"
    assert len(scene.run(photons=1000, k=0).ids) == 24
