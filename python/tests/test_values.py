"""Tests of values: whatever holds numbers and texts is taken as such, or refused where it is given."""

import array
import collections
import copy
import datetime
import decimal
import enum
import fractions
import os
import pickle
import subprocess
import sys

import numpy as np
import pytest

import phylux as px
from conftest import chamber

MASKED = np.ma.masked_array([1.0, 2.0], mask=[False, True])


class Half(enum.IntEnum):
    ONE = 1


def lamp(power=1.0, **keys):
    scene = px.Scene("lamp", bands={"blue": (400, 500), "red": (600, 700)})
    scene.light("lamp", **{"type": "point", "position": [0, 0, 1], "power": power, **keys})
    scene.captor("sensor", discs=px.grid(0, 0, 0, radius=0.1))
    return scene


def series(package, *values, **options):
    return getattr(pytest.importorskip(package), "Series" if package != "pyarrow" else "array")(list(values), **options)


TAKEN = [
    ((20.0, 80.0), [20, 80]),
    (range(20, 81, 60), [20, 80]),
    (np.array([20, 80], dtype=np.float32), [20, 80]),
    (np.float16(2), 2),
    (np.array(3), 3),
    (np.longdouble(2), 2),
    (np.array([20, 80.5], dtype=np.longdouble), [20, 80.5]),
    (np.ma.masked_array([20, 80]), [20, 80]),
    ([np.int8(20), decimal.Decimal("80.5")], [20, 80.5]),
    (fractions.Fraction(1, 4), 0.25),
    (Half.ONE, 1),
    (collections.deque([20, 80]), [20, 80]),
    (array.array("d", [20, 80]), [20, 80]),
    ({"a": 20, "b": 80}.values(), [20, 80]),
    (lambda: series("pandas", 20.0, 80.0), [20, 80]),
    (lambda: series("pandas", 20, 80, dtype="Int64"), [20, 80]),
    (lambda: series("pandas", 20, 80, index=[5, 3]), [20, 80]),
    (lambda: series("polars", 20, 80), [20, 80]),
    (lambda: series("pyarrow", 20, 80), [20, 80]),
    (lambda: pytest.importorskip("xarray").DataArray([20, 80]), [20, 80]),
]


@pytest.mark.parametrize("given", TAKEN, ids=lambda given: type(given[0]).__name__)
def test_values_of_all_packages_are_plain(given, tmp_path):
    value, plain = given
    scene = lamp(value() if callable(value) else value)
    assert scene.keys["lights"][0]["power"] == plain
    assert type(scene.keys["lights"][0]["power"]) is type(plain) or not isinstance(plain, list)
    # the same in place, wherever the scene is used
    other = lamp()
    other.keys["lights"][0]["power"] = value() if callable(value) else value
    found = [one.run(photons=1000, k=0, threads=1).to_json() for one in (scene, other, other.copy(), copy.deepcopy(other))]
    other.save(tmp_path / "s.json")
    found.append(px.load(tmp_path / "s.json").run(photons=1000, k=0, threads=1).to_json())
    found.append(px.sweep(other, {"seed": [1]}, photons=1000, k=0, threads=1)[0].to_json())
    assert len(set(found)) == 1
    other.check()


REFUSED = [
    (MASKED, "masked"),
    ([1, np.ma.masked], "masked"),
    ({1, 2}, "of type set"),
    ((power for power in (1, 2)), "of type generator"),
    (1j, "of type complex"),
    (np.clongdouble(1), "of type clongdouble"),
    ({None: 1}, "a key without a value"),
    ({"a": {float("nan"): 1}}, "a key without a value"),
    (b"1", "of type bytes"),
    (object(), "of type object"),
    (datetime.timedelta(1), "of type timedelta"),
    (np.array(["2025-06-21"], dtype="M8[ns]"), "times without a time zone"),
    (float("nan"), "nan is no finite number"),
    ([1, np.inf], "inf is no finite number"),
    (decimal.Decimal("NaN"), "no finite number"),
    (10**400, "is beyond 1.8e.308"),
    ([1, -(10**5000)], "is beyond 1.8e.308"),
    (fractions.Fraction(10**400), "is beyond 1.8e.308"),
    (np.array([1, None]), "has no value"),
    ("\ud800", "no text of Unicode"),
    (lambda: series("pandas", 1, None, dtype="Float64"), "has no value"),
    (lambda: series("polars", 1, None), "has no value"),
    (lambda: series("pyarrow", 1, None), "has no value"),
    (lambda: pytest.importorskip("pandas").NA, "has no value"),
    (lambda: pytest.importorskip("pandas").NaT, "has no value"),
]


@pytest.mark.parametrize("given", REFUSED, ids=lambda given: given[1])
def test_other_values_are_refused_where_they_are_given(given):
    value, words = given
    value = value() if value is not None and type(value).__name__ == "function" else value
    scene = lamp()
    calls = {
        "/lights/1/power": lambda: scene.light("next", type="point", power=value),
        "/materials/a~1b/reflectance": lambda: scene.material("a/b", type="lambert", reflectance=value),
        "/objects/0/group": lambda: scene.add("leaf", [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], group=value),
        "/captors/1/disc/radius": lambda: scene.captor("more", disc={"radius": value}),
        "/camera": lambda: px.Scene("s", camera=value),
    }
    for place, call in calls.items():
        with pytest.raises(px.InputError, match=words) as caught:
            call()
        assert caught.value.place.startswith(f"scene: {place}")
    # nothing of what was refused has stayed
    assert [len(scene.keys.get(key, ())) for key in ("lights", "materials", "objects", "captors")] == [1, 0, 0, 1]
    assert not scene._meshes
    scene.keys["lights"][0]["power"] = value
    for use in (scene.check, scene.copy, scene.run, lambda: scene.save("never.json")):
        with pytest.raises(px.InputError, match=words) as caught:
            use()
        assert caught.value.place.startswith("scene: /lights/0/power")


def test_a_value_that_holds_itself_is_refused():
    held = []
    held.append(held)
    with pytest.raises(px.InputError, match="holds itself") as caught:
        lamp(held)
    assert caught.value.place.startswith("scene: /lights/0")


def test_options_take_the_same_values():
    scene, plain = lamp(), {"photons": 2000, "seed": 3, "k": 0}
    one = scene.run(**plain).to_json()
    for made in (np.int64, np.float32, decimal.Decimal, np.array):
        assert scene.run(**{name: made(value) for name, value in plain.items()}).to_json() == one
    for value in (MASKED, np.nan, {1}, object()):
        with pytest.raises(px.InputError) as caught:
            scene.run(photons=value)
        assert caught.value.place.startswith("photons")
    found = scene.run(**plain, by_light=True)
    mixed = found.mix({"lamp": 2}).to_json()
    assert found.mix({"lamp": decimal.Decimal(2)}).to_json() == found.mix({"lamp": np.float32(2)}).to_json() == mixed
    assert found.mix({"lamp": range(1, 3)}).to_json() == found.mix({"lamp": [1, 2]}).to_json()
    for value, place in (({"lamp": MASKED}, "factors/lamp/"), ({"lamp": [1, None]}, "factors/lamp"), ({"lamp": "x"}, "factors/lamp")):
        with pytest.raises(px.InputError) as caught:
            found.mix(value)
        assert caught.value.place.startswith(place.rstrip("/"))
    with pytest.raises(px.InputError, match="mean: "):
        found.even("sensor", mean=MASKED)
    with pytest.raises(px.InputError, match="prospect: water"):
        px.prospect(1.5, 40, MASKED[1], 0.01)
    with pytest.raises(px.InputError, match="vary//lights/0/power"):
        scene.calibrate("readings.csv", vary={"/lights/0/power": (1, None)})
    with pytest.raises(px.InputError, match="readings: a list"):
        scene.calibrate([1, 2])


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda grid: np.ma.masked_array(grid, mask=grid == 1), "masked"),
        (lambda grid: [np.ma.masked_array(row, mask=row == 1) for row in grid], "masked"),
        (lambda grid: np.where(grid == 1, np.nan, grid), "disc 1: x is nan"),
        (lambda grid: grid + 1j, "complex"),
        (lambda grid: grid > 0, "of type bool"),
        (lambda grid: object(), "no numbers|of shape"),
    ],
)
def test_discs_without_numbers_are_refused(make, words):
    scene = px.Scene("s")
    with pytest.raises(px.InputError, match=words) as caught:
        scene.captor("g", discs=make(px.grid([0, 1], [0], z=2, radius=0.1, normal=[0, 0, 3])))
    assert caught.value.place == "g" and "captors" not in scene.keys and not scene._tables


def test_discs_and_copies_from_tables_of_all_packages():
    names = ["x", "y", "z", "radius", "nx", "ny", "nz"]
    grid = px.grid([0, 1], [0], z=0, radius=0.1)
    ids = ["007", "a, \"b\""]
    columns = {"id": ids, **dict(zip(names, grid.T.tolist()))}
    fields = np.zeros(2, dtype=[(name, object if name == "id" else float) for name in columns])
    for name, values in columns.items():
        fields[name] = values
    tables = [fields]
    for package, make in (("pandas", "DataFrame"), ("polars", "DataFrame"), ("pyarrow", "table")):
        try:
            tables.append(getattr(__import__(package), make)(columns))
        except ImportError:
            continue
    for table in tables:
        scene = px.Scene("s")
        scene.light("lamp", type="point", position=[0, 0, 1], power=1)
        scene.captor("g", discs=table)
        assert scene.run(photons=500, k=0, threads=1).ids == [f"g/{id}" for id in ids]
    pd = pytest.importorskip("pandas")
    table = pd.DataFrame(columns)
    for ignored in ("row", ["row"], pd.Series(["row"])):
        scene = px.Scene("s")
        scene.light("lamp", type="point", position=[0, 0, 1], power=1)
        scene.captor("g", discs=table.assign(row=1), ignore=ignored)
        assert scene.run(photons=500, k=0, threads=1).ids == [f"g/{id}" for id in ids]
    for wrong, words in [
        (table.assign(id=["a", None]), "disc 1 has no id"),
        (table.assign(id=["a", " b"]), "a disc named ' b'"),
        (table.assign(id=["a", "b\nc"]), "on one line"),
        (table.assign(x=pd.array([0, None], dtype="Float64")), "no numbers|x is nan"),
        (pd.concat([table, table[["x"]]], axis=1), "two columns x"),
    ]:
        with pytest.raises(px.InputError, match=words):
            px.Scene("s").captor("g", discs=wrong)
    scene = px.Scene("s")
    with pytest.raises(px.InputError, match="masked"):
        scene.add("p", [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], instances=np.ma.masked_array(np.ones((2, 3)), mask=[[0, 0, 1]] * 2))
    with pytest.raises(px.InputError, match="copy 0: z is nan"):
        scene.add("p", [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], instances=[[0, 0, np.nan]])
    assert not scene._tables and not scene._meshes and "objects" not in scene.keys


def test_meshes_with_masks_are_refused():
    points, faces = np.ma.masked_array(np.eye(3)), np.ma.masked_array([[0, 1, 2], [0, 2, 1]])
    scene = px.Scene("s")
    scene.add("whole", (points, faces))
    points[0, 0] = np.ma.masked
    faces[1] = np.ma.masked
    for shape in ((points, faces.data), (points.data, faces), points, {"leaf": points}):
        with pytest.raises(px.InputError, match="masked"):
            scene.add("leaf", shape)
    with pytest.raises(px.InputError, match="faces of type"):
        scene.add("leaf", (np.eye(3), np.array([[0, 1, 1.5]], dtype=object)))


@pytest.mark.parametrize("faces", [[[0, 1, 2**70]], np.array([[0, 1, -(2**70)]], dtype=object)])
def test_corners_beyond_all_numbers_of_vertices_are_refused(faces):
    with pytest.raises(px.InputError, match="but there are 3 vertices"):
        px.Scene("s").add("leaf", (np.eye(3), faces))


def test_ids_without_a_value_are_refused():
    triangle = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    for key in (None, float("nan"), getattr(pytest.importorskip("pandas"), "NA")):
        with pytest.raises(px.InputError, match="leaf: an id that has no value"):
            px.Scene("s").add("leaf", {"a": [triangle], key: [triangle]})


def test_grids_of_sensors():
    axes = np.array([0.5, 1]), range(3), decimal.Decimal("2")
    found = px.grid(*axes, radius=np.float32(0.5), normal=(0, decimal.Decimal(1), 0))
    assert found.tolist() == [[x, y, 2, 0.5, 0, 1, 0] for x in (0.5, 1) for y in range(3)]
    assert px.grid([], 0, 0, radius=1).shape == (0, 7)
    for words, call in {
        "1e.12 sensors": lambda: px.grid(range(10**6), range(10**6), 0, radius=0.1),
        "x that are no numbers": lambda: px.grid(True, 0, 0, radius=0.1),
        "radius: True is no number": lambda: px.grid(0, 0, 0, radius=True),
        "a normal of 1 numbers": lambda: px.grid(0, 0, 0, radius=0.1, normal=5),
    }.items():
        with pytest.raises(px.InputError, match=words):
            call()


def test_texts_and_ranges_of_any_kind(tmp_path):
    pd = pytest.importorskip("pandas")
    scene = chamber()
    found = scene.run(photons=2000, k=0, by_light=True, threads=1)
    # one text is one pattern, and not one for each of its letters
    names = [np.str_("*"), pd.Series(["*"]), ("*",), {"*": 1}.keys()]
    for groups in names:
        assert found.even("grid", band="PAR", groups=groups) == found.even("grid", band="PAR", groups=["*"])
        even = scene.calibrate(even="grid", band="PAR", groups=groups, result=found)
        assert even.factors["lamp"] == even.factors["spot"]
    for call in (lambda groups: found.even("grid", band="PAR", groups=groups), lambda groups: scene.calibrate(even="grid", band="PAR", groups=groups, result=found)):
        with pytest.raises(px.InputError, match="no light fits `spotlamp`"):
            call("spotlamp")
    assert found.mix(pd.Series({"lamp": 2.0})).to_json() == found.mix({"lamp": 2}).to_json()
    for ends in ([0, 1], np.array([0, 1]), range(2), pd.Series([0, 1], dtype="Int64"), [decimal.Decimal(0), 1]):
        found.export(tmp_path / "a.glb", range=ends, trace=False, threads=np.float64(1))
    refused = {
        "range": lambda value: found.export(tmp_path / "a.glb", range=value, trace=False),
        "threads": lambda value: found.export(tmp_path / "a.glb", threads=value),
        "to": lambda value: scene.view(tmp_path / "a.html", to=value),
        "band": lambda value: found.even("grid", band=value),
        "captors": lambda value: found.even(value),
        "triangles": lambda value: found.triangles(value),
        "groups": lambda value: found.even("grid", groups=value),
        "factors": lambda value: found.mix(value),
    }
    for place, call in refused.items():
        for value in (-1.5, pd.NA, np.ma.masked, [1, 2, 3]):
            with pytest.raises(px.InputError) as caught:
                call(value)
            assert caught.value.place.startswith(place), (place, value, str(caught.value))
            assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["", " ", " a", "a ", "\ta", "a\n", "a\tb", "a\nb", "a\rb", "a\0b", "a\x85b", "a\u2028b", "a\\", "\u00a0a"])
def test_names_that_files_cannot_hold_are_refused(name):
    scene, triangle = px.Scene("s"), [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]]
    calls = [
        lambda: scene.add(name, triangle, material="m"),
        lambda: scene.add("leaf", {name: triangle}, material="m"),
        lambda: scene.light(name, type="point"),
        lambda: scene.captor(name, shape=triangle),
        lambda: scene.group(name, "*"),
        lambda: scene.material(name, type="lambert"),
        lambda: scene.add("leaf", px.Mesh(np.eye(3), np.array([[0, 1, 2]]), (px.geometry.Group(name, None, 0, 1),))),
    ]
    for call in calls:
        with pytest.raises(px.InputError, match="on one line"):
            call()
    assert set(scene.keys) == {"name", "unit", "quantity"}
    for call in (lambda: scene.add(7, triangle), lambda: scene.light(None)):
        with pytest.raises(px.InputError, match="give it a text"):
            call()


@pytest.mark.parametrize("name", ["a b", "a  b", "a#1", "# a", "#", "käse", "葉" * 200, "a\\b", "g", "v 1 2 3", '"', "a/b", "%s", "..", "á" * 130])
def test_other_names_are_those_after_saving(name, tmp_path):
    scene = px.Scene("s")
    scene.material("grey", type="lambert", reflectance=0.5)
    scene.light("lamp", type="point", position=[0, 0, 1], power=1)
    scene.add(name, [[[-1, -1, 0], [1, -1, 0], [0, 1, 0]]], material="grey", captor=True)
    scene.captor(f"{name}.", discs=px.grid([0], [0, 0.1], z=0.5, radius=0.1))
    found = scene.run(photons=1000, k=0, threads=1)
    scene.save(tmp_path / "s.json")
    again = px.load(tmp_path / "s.json").run(photons=1000, k=0, threads=1)
    assert again.to_json() == found.to_json() and found.ids[0].startswith(name)


def test_what_comes_from_other_processes_may_lie_anywhere():
    """Buffers of a message lie at odd places, as those of Dask do."""
    scene = chamber()
    buffers = []
    message = pickle.dumps(scene, protocol=5, buffer_callback=buffers.append)
    assert buffers
    odd = [memoryview(bytearray(b"x" + bytes(buffer.raw())))[1:] for buffer in buffers]
    there = pickle.loads(message, buffers=odd)
    assert there.run(photons=1000, k=0).to_json() == scene.run(photons=1000, k=0).to_json()


def test_checks_and_tables_are_copied_and_sent():
    scene = chamber()
    scene.captor("far", disc={"center": [9, 9, 9], "normal": [0, 0, 1], "radius": 0.1})
    check = scene.check()
    assert check.warnings
    for again in (copy.copy(check), copy.deepcopy(check), pickle.loads(pickle.dumps(check))):
        assert (str(again), again.warnings, again.data) == (str(check), check.warnings, check.data)


def test_what_a_result_gives_away_is_not_shared():
    pytest.importorskip("pandas")
    scene = chamber()
    found = scene.run(photons=2000, k=5, by_light=True, threads=1)
    for name in ("head", "energy", "unit", "nearest"):
        getattr(found, name).clear()
        assert getattr(found, name)
    found.energy["emitted"].clear()
    found.head["bands"].clear()
    assert found.energy["emitted"] and found.head["bands"] and found.bands
    for name in ("ids", "warnings", "bands", "lights"):
        getattr(found, name).append("more")
        assert "more" not in getattr(found, name)
    for name in ("frame", "groups"):
        before = getattr(found, name).value.tolist()
        getattr(found, name)["value"] = 0.0
        assert getattr(found, name).value.tolist() == before
    assert len(found.values.ids) == len(found.ids)


def test_words_are_those_of_python():
    scene = chamber()
    with pytest.raises(px.InputError) as caught:
        scene.run(of="plant")
    assert caught.value.place == "of" and str(caught.value) == "of: no tolerance is asked for; add `tolerance=0.02`"
    with pytest.raises(px.InputError) as caught:
        scene.run(fotons=1)
    assert "did you mean `photons`?" in str(caught.value)
    with pytest.raises(px.InputError) as caught:
        scene.render(show="captors", gather=3)
    assert "--" not in str(caught.value)
    with pytest.raises(px.InputError) as caught:
        scene.calibrate(even="none", photons=1000)
    assert caught.value.place == "even" and "--" not in str(caught.value)
    with pytest.raises(px.InputError) as caught:
        scene.calibrate(even="grid", groups=["none"], photons=1000)
    assert caught.value.place == "groups"
    # few captors for the lamps, and few readings for them
    few = [scene.calibrate(even="grid/0", photons=1000, threads=1)]
    readings = {"captor": ["grid/0", "grid/1"], "band": ["blue", "blue"], "value": [1.0, 2.0]}
    few.append(scene.calibrate(pytest.importorskip("pandas").DataFrame(readings), model="lamps", photons=1000, threads=1))
    for found in few:
        assert any("join lamps in groups" in warning for warning in found.warnings)
        assert not any("--" in warning.replace("light---even", "") for warning in found.warnings)
    scene.keys["sunlit"] = True
    with pytest.raises(px.InputError, match="sunlit") as caught:
        scene.run()
    assert "phylux" not in str(caught.value)


def test_errors_have_their_parts(tmp_path):
    scene = chamber()
    with pytest.raises(px.InputError) as caught:
        scene.calibrate(even="grid", result=scene.run(photons=2000, k=0, threads=1))
    error = caught.value
    assert error.problem == "these results are not split by light" and error.remedy == "run the scene again with `by_light=True`"
    assert str(error) == f"{error.place}: {error.problem}; {error.remedy}"
    for copied in (pickle.loads(pickle.dumps(error)), copy.copy(error)):
        assert (str(copied), copied.place, copied.problem, copied.remedy) == (str(error), error.place, error.problem, error.remedy)
    # a call with an argument, an argument with a value, and text of the user as it is
    with pytest.raises(px.InputError) as caught:
        px.Year(tmp_path).plot(tmp_path / "plot.svg", show="map")
    assert caught.value.remedy == "write it with `Scene.year(results=True)`"
    with pytest.raises(px.InputError) as caught:
        scene.run(of="plant")
    assert caught.value.remedy == "add `tolerance=0.02`"
    with pytest.raises(px.InputError) as caught:
        scene.render(band="--by-light", width=40, height=30)
    assert (caught.value.place, caught.value.problem) == ("band", "the scene has no band or sum `--by-light`")
    # errors of the package's own part, and without a remedy
    with pytest.raises(px.InputError) as caught:
        scene.run(csv="a.csv")
    assert (caught.value.place, caught.value.problem) == ("csv", "names a file to write") and caught.value.remedy
    with pytest.raises(px.InputError) as caught:
        scene.render(width=0)
    assert (caught.value.place, caught.value.remedy) == ("width", None)
    assert px.RunError("full").remedy is None


def test_objects_show_themselves_in_notebooks(tmp_path):
    scene = chamber()
    scene.keys["name"] = "<b>"
    found = scene.run(photons=2000, k=0, threads=1)
    other = scene.run(photons=2000, k=0, seed=2, threads=1)
    swept = px.sweep(scene, {"seed": list(range(12))}, photons=500, k=0, threads=1)
    for thing, words in [
        (scene, "&lt;b&gt;"),
        (found, "umol/m2/s"),
        (scene.check(), "&lt;b&gt;"),
        (swept, "and 2 more"),
        (found.compare(other), "<pre>"),
        (px.Year(tmp_path), "Year in"),
        (scene.calibrate(even="grid", photons=2000, threads=1), "lamp"),
    ]:
        shown = thing._repr_html_()
        assert words in shown and "<b>:" not in shown, type(thing)
        assert shown.count("<table>") == shown.count("</table>")


def test_parameters_are_not_named_as_columns():
    with pytest.raises(px.InputError, match="a parameter named `captor`"):
        px.sweep(lambda captor: lamp(captor), {"captor": [1, 2]})
    with pytest.raises(px.InputError, match="a parameter named `run`"):
        px.sweep(lambda run: lamp(run), [{"run": 1}])
    # this one is a column where inputs are uncertain
    with pytest.raises(px.InputError, match="a parameter named `model_se`"):
        px.sweep(lambda model_se: lamp(model_se), {"model_se": [1, 2]})
    with pytest.raises(px.InputError, match="sweep: /vary/.*/values/1"):
        px.sweep(lamp(), {"/lights/0/power": [1, np.nan]})


def test_devices_are_not_read():
    with pytest.raises(px.InputError, match="is not a regular file"):
        px.load("/dev/zero" if sys.platform != "win32" else "NUL")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes")
def test_pipes_are_not_read(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    scene = chamber()
    for call in (px.load, scene.calibrate, lambda path: scene.year(tmp_path / "year", control=path)):
        with pytest.raises(px.InputError, match="is not a regular file"):
            call(tmp_path / "pipe")


def test_pictures_are_not_written_by_render(capfd):
    scene = chamber()
    with pytest.raises(px.InputError, match="output: names a file") as caught:
        scene.render(output="picture.png", width=40, height=30)
    assert caught.value.place == "output"
    scene.render(width=40, height=30, rays=1, map_photons=2000)
    assert capfd.readouterr().err == ""
