"""Tests of saving: nothing is lost, what is saved is what was run, and the command is found on every system."""

import json
import os
import pickle
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import phylux as px
from conftest import chamber

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
FEW = {"photons": 2000, "k": 0, "threads": 1}


def square(size, x=0.0):
    return np.array([[x, 0, 0], [x + size, 0, 0], [x + size, size, 0], [x, size, 0]]), [[0, 1, 2], [0, 2, 3]]


def room(name, size):
    scene = px.Scene("room")
    scene.material("grey", type="lambert", reflectance=0.5)
    scene.add(name, square(size), material="grey", captor=True)
    scene.light("bulb", type="point", position=[0.1, 0.1, 2], power=100)
    return scene


def contents(folder):
    return {file.name: file.read_bytes() for file in folder.iterdir()}


def test_a_mesh_that_the_scene_reads_is_not_replaced(tmp_path):
    room("lamp", 0.2).save(tmp_path / "a.json")
    before = contents(tmp_path)
    scene = px.load(tmp_path / "a.json")
    scene.light("lamp", type="area", shape=square(0.6, 3), power=10)
    scene.captor("lamp-b", discs=px.grid([0, 0.1], 0, z=1, radius=0.1))
    found = scene.run(**FEW)
    scene.save(tmp_path / "a.json")
    after = contents(tmp_path)
    assert after["a-lamp.obj"] == before["a-lamp.obj"] and set(after) == {"a.json", "a-lamp.obj", "a-lamp~2.obj", "a-lamp-b.csv"}
    assert px.load(tmp_path / "a.json").run(**FEW).to_json() == found.to_json()


def test_a_mesh_that_another_scene_wrote_is_not_replaced(tmp_path):
    first, second = room("b-c", 1.0), room("c", 0.3)
    first.save(tmp_path / "a.json")
    second.save(tmp_path / "a-b.json")
    for scene, name in ((first, "a"), (second, "a-b")):
        assert px.load(tmp_path / f"{name}.json").run(**FEW).to_json() == scene.run(**FEW).to_json()


def test_saving_again_changes_nothing(tmp_path):
    scene = room("wall", 1.0)
    scene.captor("g", discs=px.grid([0, 0.1], 0, z=1, radius=0.1))
    scene.save(tmp_path / "a.json")
    before = contents(tmp_path)
    scene.save(tmp_path / "a.json")
    assert contents(tmp_path) == before
    # another mesh gets a name of its own, and who holds the first scene keeps its mesh
    shutil.copy(tmp_path / "a.json", tmp_path / "copy.json")
    room("wall", 2.0).save(tmp_path / "a.json")
    assert px.load(tmp_path / "a.json").run(**FEW).area[0] == pytest.approx(4)
    assert px.load(tmp_path / "copy.json").run(**FEW).area[0] == pytest.approx(1)


def test_meshes_of_any_kind_stand_in_the_way(tmp_path):
    """A folder, a link to nowhere and a file of somebody else have the names that the meshes would have."""
    (tmp_path / "a-wall.obj").mkdir()
    if hasattr(os, "symlink") and sys.platform != "win32":
        os.symlink(tmp_path / "nowhere", tmp_path / "a-wall~2.obj")
    (tmp_path / "a-wall~3.obj").write_text("mine")
    room("wall", 1.0).save(tmp_path / "a.json")
    assert (tmp_path / "a-wall~3.obj").read_text() == "mine" and not (tmp_path / "nowhere").exists()
    assert px.load(tmp_path / "a.json").run(**FEW).area[0] == pytest.approx(1)


def test_files_that_are_read_are_not_replaced_where_asked_for(tmp_path, monkeypatch):
    pytest.importorskip("pandas")
    monkeypatch.chdir(tmp_path)
    Path("leaf.obj").write_text(TRIANGLE)
    scene = px.Scene("s")
    scene.material("grey", type="lambert", reflectance=0.5)
    scene.light("bulb", type="point", position=[0.3, 0.3, 1], power=1)
    scene.add("leaf", "leaf.obj", material="grey", captor=True)
    scene.add("other", square(1, 5), material="grey")
    found = scene.run(**FEW)
    pytest.importorskip("pyarrow")
    writes = [found.save, found.save_csv, found.to_parquet, scene.save, lambda path: found.view(path, trace=False)]
    if sys.platform != "win32":
        os.symlink("leaf.obj", "link.obj")
    before = contents(tmp_path)
    names = [name for name in ("leaf.obj", "./leaf.obj", tmp_path / "leaf.obj", "link.obj") if Path(name).exists()]
    for write in writes:
        for name in names:
            with pytest.raises(px.InputError):
                write(name)
            assert contents(tmp_path) == before, (write, name)


def test_the_file_that_a_scene_was_loaded_from_is_not_replaced_by_results(tmp_path):
    room("wall", 1.0).save(tmp_path / "a.json")
    before = contents(tmp_path)
    loaded = px.load(tmp_path / "a.json")
    for scene in (loaded, loaded.copy(), pickle.loads(pickle.dumps(loaded))):
        found = scene.run(**FEW, by_light=True)
        for write in (found.save, found.save_csv, found.to_parquet, found.mix({"bulb": 2}).save, lambda path: found.view(path, trace=False)):
            with pytest.raises(px.InputError, match="is a file that is read"):
                write(tmp_path / "a.json")
            assert contents(tmp_path) == before
        # but a changed scene goes back to its file
        scene.save(tmp_path / "a.json")


def test_a_calibration_replaces_nothing_that_was_read(tmp_path):
    scene = room("wall", 1.0)
    scene.captor("g", discs=px.grid([0, 0.1], 0, z=1, radius=0.1))
    scene.save(tmp_path / "a.json")
    (tmp_path / "readings.csv").write_text("captor,value\ng/0,1\ng/1,1\n")
    before = contents(tmp_path)
    for found in (
        px.load(tmp_path / "a.json").calibrate(tmp_path / "readings.csv", photons=4000, threads=1),
        pickle.loads(pickle.dumps(px.load(tmp_path / "a.json").calibrate(tmp_path / "readings.csv", photons=4000, threads=1))),
    ):
        for name in before:
            with pytest.raises(px.InputError, match="is a file that is read"):
                found.save(tmp_path / name)
        assert contents(tmp_path) == before
    found.save(tmp_path / "report.json")
    assert json.loads((tmp_path / "report.json").read_bytes())["factors"]


def test_a_scene_is_saved_whole_or_not_at_all(tmp_path, monkeypatch):
    scene = room("wall", 1.0)
    scene.save(tmp_path / "a.json")
    before = contents(tmp_path)
    scene.captor("g", discs=px.grid([0, 0.1], 0, z=1, radius=0.1))

    def full(*_):
        raise px.RunError("the disk is full", "a.json")

    with monkeypatch.context() as patched:
        patched.setattr(px._native, "write_file", full)
        with pytest.raises(px.RunError):
            scene.save(tmp_path / "a.json")
    assert contents(tmp_path) == before
    for wrong in (tmp_path / "none" / "a.json", tmp_path):
        with pytest.raises(px.InputError):
            scene.save(wrong)
    assert contents(tmp_path) == before


def test_the_weather_takes_no_table_of_captors(tmp_path):
    pd = pytest.importorskip("pandas")
    times = pd.date_range("2025-06-21T10:00", periods=3, freq="h", tz="Etc/GMT-2")
    table = pd.DataFrame({"ghi": [610, 700, 760], "dhi": [150, 160, 165]}, index=times)
    found = []
    for first in (True, False):
        keys = {"time": "2025-06-21T11:30+02:00", "site": {"latitude": 52, "longitude": 13}}
        scene = px.Scene("w", quantity="umol/s", bands={"PAR": (400, 700)}, **keys)
        calls = [lambda: scene.captor("weather", discs=px.grid([0, 1], [0, 1], z=0, radius=0.1)), lambda: scene.weather(table, stamp="start")]
        for call in calls if first else reversed(calls):
            call()
        scene.light("sun", type="sun")
        found.append(scene.run(**FEW))
        scene.save(tmp_path / "w.json")
        assert px.load(tmp_path / "w.json").run(**FEW).to_json() == found[-1].to_json()
    assert found[0].ids == [f"weather/{i}" for i in range(4)] and found[0].to_json() == found[1].to_json()


@pytest.mark.parametrize("kind", ["float64", "Float64", "float64[pyarrow]", "object", "polars", "arrow", "masked"])
def test_weather_of_any_table(kind):
    pd = pytest.importorskip("pandas")
    values = [None, 700.0, 760.0]
    times = pd.date_range("2025-06-21T10:00", periods=3, freq="h", tz="Europe/Berlin")
    plain = pd.DataFrame({"ghi": [np.nan, 700.0, 760.0], "dhi": [150, 160, 165]}, index=times)
    if kind in ("polars", "arrow", "masked"):
        columns = {"time": list(times.to_pydatetime()), "ghi": values, "dhi": [150, 160, 165]}
        if kind == "polars":
            table = pytest.importorskip("polars").DataFrame(columns)
        elif kind == "arrow":
            table = pytest.importorskip("pyarrow").table(columns)
        else:
            table = np.ma.zeros(3, dtype=[("time", object), ("ghi", float), ("dhi", float)])
            for name, column in columns.items():
                table[name] = [0 if value is None else value for value in column]
            table["ghi"][0] = np.ma.masked
    else:
        if "pyarrow" in kind:
            pytest.importorskip("pyarrow")
        table = plain.assign(ghi=pd.Series(values, index=times, dtype=kind))
    found = []
    for given in (plain, table):
        scene = px.Scene("w", quantity="umol/s", bands={"PAR": (400, 700)}, time="2025-06-21T11:30+02:00", site={"latitude": 52, "longitude": 13})
        scene.weather(given, stamp="start")
        scene.light("sun", type="sun")
        scene.captor("g", discs=px.grid(0, 0, z=0, radius=0.1))
        found.append(scene.run(**FEW).to_json())
    assert found[0] == found[1]


def test_weather_that_is_no_number_says_where():
    pd = pytest.importorskip("pandas")
    times = pd.date_range("2025-06-21T10:00", periods=2, freq="h", tz="UTC")
    for value, words in (("n/a", "row 1: 'n/a' is no number"), (np.inf, "row 1: inf is no finite number"), (1j, "is no number"), (True, "row 1: True is no number")):
        with pytest.raises(px.InputError, match=words) as caught:
            px.Scene("w").weather(pd.DataFrame({"ghi": pd.Series([1, value], index=times, dtype=object)}), stamp="start")
        assert caught.value.place.startswith("weather: column ghi")
    polars = pytest.importorskip("polars")
    for table in (polars.DataFrame({"ghi": [1.0]}), polars.DataFrame({"time": ["2025"], "ghi": [1.0]})):
        with pytest.raises(px.InputError, match="without times"):
            px.Scene("w").weather(table, stamp="start")
    with pytest.raises(px.InputError, match="weather: column time: .*in some rows"):
        px.Scene("w").weather(polars.DataFrame({"time": [times[0].to_pydatetime(), None], "ghi": [1.0, 2.0]}), stamp="start")
    with pytest.raises(px.InputError, match="a table without rows"):
        px.Scene("w").weather(pd.DataFrame({"ghi": []}, index=times[:0]), stamp="start")
    with pytest.raises(px.InputError, match="collect it first"):
        px.Scene("w").weather(polars.LazyFrame({"ghi": [1.0]}), stamp="start")


def test_readings_of_any_table():
    pd = pytest.importorskip("pandas")
    scene = px.Scene("bench", quantity="umol/s")
    for name, x in (("007", -1.0), ("7", 1.0)):
        scene.light(f"lamp {name}", type="point", position=[x, 0, 1], power=100)
        scene.captor(name, disc={"center": [x, 0, 0], "normal": [0, 0, 1], "radius": 0.1})
    result = scene.run(photons=20_000, by_light=True, **{"k": 0, "threads": 1})
    columns = {"captor": ["007", "7"], "value": [9.5, None], "sd": [0.5, 0.5]}
    tables = [pd.DataFrame(columns), pd.DataFrame(columns).convert_dtypes()]
    for package, make in (("polars", "DataFrame"), ("pyarrow", "table")):
        tables.append(getattr(pytest.importorskip(package), make)(columns))
    found = [scene.calibrate(table, result=result) for table in tables]
    assert found[0].readings.captor.tolist() == ["007", "7"]
    assert all(one.factors == found[0].factors for one in found)


def run_python(code, folder, *arguments, **variables):
    """Runs a Python without the site's packages, to which the package was only given as a folder."""
    python = Path(sys.base_prefix, "bin", "python3")
    python = python if python.is_file() else Path(sys.executable)
    environment = {"PATH": os.environ.get("PATH", ""), "SYSTEMROOT": os.environ.get("SYSTEMROOT", ""), **variables}
    paths = [str(Path(px.__file__).parents[1]), str(Path(np.__file__).parents[1])]
    code = f"import sys; sys.path[:0] = {paths!r}\n{code}"
    line = [str(python), "-c", code, *map(str, arguments)]
    return subprocess.run(line, cwd=folder, env=environment, capture_output=True, encoding="utf-8", errors="replace")


CALIBRATED = """
import phylux as px
s = px.Scene("k\\xe4se", bands={"PAR": (400, 700)})
s.light("L\\xe4mpchen", type="point", position=[0, 0, 1], power=1)
s.captor("Gr\\xfcn", discs=px.grid([0, 0.1], [0], z=0, radius=0.05))
found = s.calibrate(even="Gr\\xfcn", mean=1, photons=2000, threads=1)
print(ascii(list(found.factors)), found.factors["L\\xe4mpchen"][0] > 0)
try:
    s.calibrate(even="\\xc1rger*", photons=2000, threads=1)
except px.InputError as error:
    print(ascii(str(error)))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="the programs of other systems stand for those in which Python is embedded")
@pytest.mark.parametrize("executable", ["sys.executable", "None", "''", "'/bin/true'", "'/no/python'", "'/bin'"])
def test_studies_are_done_where_python_is_embedded(executable, tmp_path):
    # what stands in the folder where the program runs is not loaded
    for name in ("numpy", "phylux", "json", "importlib"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('the wrong file')")
    code = f"import sys; sys.path.remove(''); import os; sys.executable = {executable}\n{CALIBRATED}"
    done = run_python(code, tmp_path)
    assert done.stdout.splitlines()[0] == r"['L\xe4mpchen'] True", done.stdout + done.stderr
    assert r"\xc1rger*" in done.stdout.splitlines()[1]


@pytest.mark.skipif(sys.platform == "win32", reason="locales have other names there")
@pytest.mark.parametrize("locale", ["C", "POSIX", "de_DE.ISO-8859-1", "C.UTF-8"])
def test_studies_are_done_in_any_locale(locale, tmp_path):
    variables = {"LC_ALL": locale, "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    made = shutil.which("localedef")
    if locale.startswith("de_") and made is not None:
        subprocess.run([made, "-i", "de_DE", "-f", "ISO-8859-1", f"./{locale}"], cwd=tmp_path, capture_output=True)
        variables["LOCPATH"] = str(tmp_path)
    code = "s.add('T\\xf6pfe', [[[-1, -1, -1], [1, -1, -1], [0, 1, -1]]])\n"
    for text in (CALIBRATED, CALIBRATED.replace("found = ", code + "s.material('m', type='lambert', reflectance=0.1)\ns.keys['objects'][0]['material'] = 'm'\nfound = ")):
        done = run_python(text, tmp_path, **variables)
        assert done.stdout.splitlines()[:1] == [r"['L\xe4mpchen'] True"], done.stdout + done.stderr
        assert r"\xc1rger*" in done.stdout.splitlines()[1]


def test_sweeps_with_meshes_on_a_dask_cluster():
    distributed = pytest.importorskip("distributed", reason="dask.distributed is not installed")
    # functions of the tests are known to no other process, but scenes are
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        with distributed.Client(cluster) as client:
            found = px.sweep(chamber(), {"/lights/1/position/2": [0.5, 0.7], "seed": [1, 2]}, executor=client.get_executor(), **FEW)
    here = px.sweep(chamber(), {"/lights/1/position/2": [0.5, 0.7], "seed": [1, 2]}, **FEW)
    assert [one.to_json() for one in found] == [one.to_json() for one in here]


def test_a_saved_scene_holds_no_names_of_this_machine(tmp_path):
    scene = room("wall", 1.0)
    scene.save(tmp_path / "a.json")
    assert json.loads((tmp_path / "a.json").read_text(encoding="utf-8"))["objects"][0]["obj"] == "a-wall.obj"
    assert not [file for file in tmp_path.iterdir() if file.name.startswith(".")]
