"""Tests of scenes built in Python: the same results as from files, errors, forms of geometry."""

import json
import pickle
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import phylux as px
from conftest import ROOM_FACES, ROOM_VERTICES, chamber


def command(*arguments, **options):
    """Runs the command that the package installs."""
    return subprocess.run([str(Path(sys.executable).parent / "phylux"), *map(str, arguments)], **options)


@pytest.mark.parametrize("options", [{}, {"by_light": True, "k": 0}, {"estimator": "paths"}, {"estimator": "complete"}, {"tolerance": 0.2, "k": 2}])
def test_a_saved_scene_gives_the_same_bytes_by_the_command(scene, tmp_path, options):
    options = {"photons": 20_000, "seed": 3, **options}
    scene.run(**options).save(tmp_path / "python.json")
    scene.save(tmp_path / "chamber.json")
    given = [f"--{name.replace('_', '-')}" if value is True else f"--{name.replace('_', '-')}={value}" for name, value in options.items()]
    done = command("run", tmp_path / "chamber.json", "-o", tmp_path / "command.json", *given, stdout=subprocess.DEVNULL)
    # exit code 3: the result was written, but the tolerance was not met
    assert done.returncode in (0, 3 if "tolerance" in options else 0)
    assert (tmp_path / "python.json").read_bytes() == (tmp_path / "command.json").read_bytes()


def test_a_scene_that_is_loaded_gives_the_same_bytes(scene, tmp_path):
    scene.save(tmp_path / "chamber.json")
    once_more = px.load(tmp_path / "chamber.json")
    assert isinstance(once_more, px.Scene)
    assert once_more.run(photons=5000).to_json() == scene.run(photons=5000).to_json()
    # saved in another folder, while the files stay where they are
    (tmp_path / "below").mkdir()
    once_more.save(tmp_path / "below" / "again.json")
    again = px.Scene.load(tmp_path / "below" / "again.json")
    assert again.run(photons=5000).to_json() == scene.run(photons=5000).to_json()
    assert json.loads((tmp_path / "below" / "again.json").read_text())["objects"][0]["obj"] == "../chamber-room.obj"


def test_scenes_travel_to_other_processes(scene):
    there = pickle.loads(pickle.dumps(scene))
    assert there.run(photons=1000).to_json() == scene.run(photons=1000).to_json()
    copy = scene.copy()
    copy.keys["lights"][0]["power"] = 1
    assert scene.keys["lights"][0]["power"] == [20, 80]


def test_all_forms_of_geometry_are_the_same():
    triangles = ROOM_VERTICES[ROOM_FACES]
    forms = {
        "arrays": (ROOM_VERTICES, ROOM_FACES),
        "lists": (ROOM_VERTICES.tolist(), ROOM_FACES.tolist()),
        "float32": (ROOM_VERTICES.astype(np.float32), ROOM_FACES.astype(np.int32)),
        "fortran order": (np.asfortranarray(ROOM_VERTICES), np.asfortranarray(ROOM_FACES)),
        "triangles": triangles,
        "tuples": [[tuple(point) for point in triangle] for triangle in triangles.tolist()],
        "caribu": {"room": [[tuple(point) for point in triangle] for triangle in triangles.tolist()]},
    }

    def run(shape):
        scene = px.Scene("room")
        scene.material("grey", type="lambert", reflectance=0.5)
        scene.add("room", shape, material="grey", captor=True)
        scene.light("lamp", type="point", position=[0.5, 0.5, 0.5], power=100)
        return scene.run(photons=1000, k=0)

    found = {name: run(shape).to_json() for name, shape in forms.items()}
    assert len(set(found.values())) == 1, [name for name in found if found[name] != found["arrays"]]
    assert run(forms["caribu"]).ids == ["room/room"]


def test_a_room_of_grey_walls_receives_what_the_closed_form_says():
    """Each photon arrives 1 / (1 - 0.5) = 2 times. With seed 1 and 1e5 photons the flux must be within 4 standard errors;
    the odds of a false alarm are 1e-4."""
    scene = px.Scene("room")
    scene.material("grey", type="lambert", reflectance=0.5)
    scene.add("room", (ROOM_VERTICES, ROOM_FACES), material="grey", captor=True)
    scene.light("lamp", type="point", position=[0.5, 0.5, 0.5], power=100)
    found = scene.run(photons=1e5, seed=1, k=0)
    assert abs(found.flux[0, 0, 0] - 200) < 4 * found.flux_se[0, 0, 0]
    assert found.flux_se[0, 0, 0] < 1
    assert found.absorbed[0, 0] == pytest.approx(100, rel=1e-2)


@pytest.mark.parametrize(
    ("shape", "sentence"),
    [
        (([[0, 0, 0], [1, 0, 0]], [[0, 1, 2]]), "face 0 has the corners [0, 1, 2], but there are 2 vertices"),
        (([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, -1]]), "face 0 has the corners [0, 1, -1]"),
        (([[0, 0], [1, 0], [0, 1]], [[0, 1, 2]]), "vertices of shape (3, 2)"),
        (([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2, 0]]), "cut polygons into triangles"),
        (([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0.0, 1.0, 2.0]]), "faces of type float64"),
        ({}, "has no triangle"),
        ({"leaf": "leaf.obj"}, "'leaf.obj' is no mesh"),
        ({"two\nlines": [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]]}, "a group named 'two\\nlines'"),
        (7, "triangles of shape ()"),
    ],
)
def test_wrong_geometry_is_refused_where_it_is_added(shape, sentence):
    scene = px.Scene("wrong")
    with pytest.raises(px.InputError) as caught:
        scene.add("plant", shape, material="leaf")
    assert sentence in str(caught.value)
    assert caught.value.place.startswith("plant")
    assert "objects" not in scene.keys


def test_errors_say_where(scene, tmp_path):
    scene.material("leaf", type="leaf", reflectance=0.9, transmittance=0.3)
    with pytest.raises(px.InputError) as caught:
        scene.check()
    assert caught.value.place == "scene: /materials/leaf"
    assert "must be at most 1" in str(caught.value)
    assert isinstance(caught.value, ValueError)
    error = pickle.loads(pickle.dumps(caught.value))
    assert (str(error), error.place) == (str(caught.value), caught.value.place)

    for options, place in [({"photons": 0}, "photons"), ({"max_time": -1}, "max_time"), ({"fotons": 1}, "fotons"), ({"csv": "a.csv"}, "csv")]:
        with pytest.raises(px.InputError) as caught:
            chamber().run(**options)
        assert caught.value.place == place, caught.value
    with pytest.raises(px.InputError) as caught:
        px.load(tmp_path / "none.json")
    assert caught.value.place.endswith("none.json")
    (tmp_path / "twice.json").write_text('{"name": "a", "name": "b"}')
    with pytest.raises(px.InputError, match="stands twice"):
        px.load(tmp_path / "twice.json")
    with pytest.raises(px.RunError) as failed:
        raise px.RunError("full", "disk")
    assert failed.value.place == "disk"


def test_nan_in_vertices_is_refused(scene):
    scene.add("hole", [[[0, 0, np.nan], [1, 0, 0], [0, 1, 0]]], material="leaf")
    with pytest.raises(px.InputError, match="no finite number"):
        scene.check()
    with pytest.raises(px.InputError, match="no finite number"):
        scene.save("never.json")
    assert not Path("never.json").exists()


def test_check_is_the_text_of_the_command(scene, tmp_path):
    scene.save(tmp_path / "chamber.json")
    text = command("check", tmp_path / "chamber.json", check=True, capture_output=True, text=True, encoding="utf-8").stdout
    check = scene.check()
    text, verdict = text[: text.rindex("\n\n") + 1], text.splitlines()[-1]
    count = len(check.warnings)
    assert verdict == (f"{count} warning{'s' * (count > 1)}, see above" if count else "no problems found")
    assert str(check).startswith(text)
    assert check.warnings == [line.removeprefix("warning: ") for line in str(check)[len(text) :].splitlines()]


def test_the_command_is_there(tmp_path):
    assert command("--version", check=True, capture_output=True, text=True).stdout.startswith("phylux ")
    wrong = command("run", tmp_path / "none.json", capture_output=True, text=True)
    assert wrong.returncode == 2 and wrong.stderr.startswith("error: ")


def test_discs_from_a_table(scene):
    pd = pytest.importorskip("pandas")
    table = pd.DataFrame(px.grid(0.5, 0.5, [0.1, 0.2], 0.05), columns=["x", "y", "z", "radius", "nx", "ny", "nz"])
    table["id"] = ["low", 'a "quoted", one']
    scene.captor("named", discs=table)
    assert scene.run(photons=1000, k=0).ids[-2:] == ["named/low", 'named/a "quoted", one']
    with pytest.raises(px.InputError, match="without the column radius"):
        scene.captor("other", discs=table.drop(columns="radius"))
    table["plot"] = [3, 4]
    with pytest.raises(px.InputError, match="with the column plot"):
        scene.captor("other", discs=table)
    scene.captor("other", discs=table, ignore=["plot"])
    assert scene.run(photons=1000, k=0).ids[-2:] == ["other/low", 'other/a "quoted", one']


def test_warnings_are_warnings(scene):
    """Warnings appear at the line of the caller, even where the package calls its own functions."""
    scene.captor("inside", disc={"center": [5, 5, 5], "normal": [0, 0, 1], "radius": 0.01})
    for run in (lambda: scene.run(photons=1000, k=0), lambda: px.sweep(scene, {"seed": [1]}, photons=1000, k=0)):
        with pytest.warns(px.SceneWarning, match="no photon") as warned:
            run()
        assert {one.filename for one in warned} == {__file__}


def test_lengths_have_the_scene_s_unit():
    def run(unit, size):
        scene = px.Scene("room", unit=unit)
        scene.material("grey", type="lambert", reflectance=0.5)
        scene.add("room", (ROOM_VERTICES * size, ROOM_FACES), material="grey", captor=True)
        scene.light("lamp", type="point", position=[0.5 * size] * 3, power=100)
        return scene.run(photons=1000, k=0)

    assert run("mm", 1000).area[0] == pytest.approx(6)
    assert run("m", 1).area[0] == pytest.approx(6)


def test_trimesh(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    room = trimesh.Trimesh(ROOM_VERTICES, ROOM_FACES, process=False)
    both = trimesh.Scene()
    both.add_geometry(room, geom_name="room", node_name="here")
    both.add_geometry(room, geom_name="room", node_name="there", transform=trimesh.transformations.translation_matrix([2, 0, 0]))
    scene = px.Scene("rooms")
    scene.material("grey", type="lambert", reflectance=0.5)
    scene.add("one", room, material="grey", captor=True, transform={"translate": [0, 3, 0]})
    scene.add("both", both, material="grey", captor=True)
    scene.light("lamp", type="point", position=[0.5, 0.5, 0.5], power=100)
    found = scene.run(photons=1000, k=0)
    assert found.ids == ["one/one", "both/here", "both/there"]
    assert found.center[:, 0].tolist() == pytest.approx([0.5, 0.5, 2.5])


LEAF = [[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], [[0, 1, 2], [0, 2, 3]]


def below_the_sun(shape, **keys):
    """Returns the light that a leaf absorbs below a zenith sun of 100 W/m2: its front reflects 0.1, its back 0.6. With
    20,000 photons of seed 1, 3 W are more than 6 standard errors."""
    scene = px.Scene("leaf", sun_at={"elevation_deg": 90, "azimuth_deg": 0})
    scene.material("two", type="leaf", ior=1, reflectance=0.1, transmittance=0, back={"reflectance": 0.6})
    scene.add("plant", shape, material="two", captor=True, **keys)
    scene.light("sun", type="sun", irradiance=100, half_angle_deg=0)
    return pytest.approx(scene.run(photons=20_000, seed=1, k=0).absorbed[:, 0], abs=3)


def test_mirrored_parts_of_trimesh_keep_their_fronts(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    leaf = trimesh.Trimesh(*LEAF, process=False)
    for factors, absorbed in [([-1, 1, 1], 90), ([1, -2, 1], 180), ([-1, -1, 1], 90), ([1, 1, -1], 40), ([1, 1, 1], 90)]:
        both = trimesh.Scene()
        both.add_geometry(leaf, node_name="part", transform=np.diag([*factors, 1.0]))
        # a mirror across the leaf's own plane turns it over
        assert below_the_sun(both) == [absorbed], factors
    both.export(tmp_path / "leaf.glb")
    # the file says that y points up, but this leaf was drawn with z up
    assert below_the_sun(tmp_path / "leaf.glb", up="z") == [90]
    leaf.export(tmp_path / "leaf.ply")
    assert below_the_sun(tmp_path / "leaf.ply") == [90]
    leaf.export(tmp_path / "leaf.stl")
    assert below_the_sun(str(tmp_path / "leaf.stl")) == [90]
    both.add_geometry(trimesh.load_path([[0, 0, 0], [1, 1, 1]]), node_name="line")
    with pytest.warns(px.SceneWarning, match="'line' has no faces") as warned:
        px.Scene("lines").add("plant", both)
    assert {one.filename for one in warned} == {__file__}


class Like:
    """An object with these attributes, like those of packages that are not installed."""

    def __init__(self, **attributes):
        self.__dict__.update(attributes)


def test_shapes_of_plantgl_that_are_mirrored_or_clockwise_keep_their_fronts(monkeypatch):
    """PlantGL itself is not needed: objects with the attributes of its own stand for it."""

    class Tesselator:
        def __init__(self):
            self.triangulation = None

    def shape(ccw, *scales):
        clockwise = [corners[::-1] for corners in LEAF[1]]
        faces = LEAF[1] if ccw else clockwise
        points = np.array(LEAF[0], dtype=float)
        geometry = Like(pointList=points, indexList=faces, ccw=ccw)
        for scale in scales:
            points *= scale
            geometry = Like(scale=scale, geometry=Like(angle=0, geometry=geometry))
        found = Like(pointList=points, indexList=faces, ccw=ccw)
        return Like(geometry=geometry, apply=lambda tesselator: setattr(tesselator, "triangulation", found))

    for name in ("openalea", "openalea.plantgl"):
        monkeypatch.setitem(sys.modules, name, Like(__path__=[]))
    monkeypatch.setitem(sys.modules, "openalea.plantgl.all", Like(Tesselator=Tesselator))
    for made in [shape(True), shape(False), shape(True, (-1, 1, 1)), shape(False, (1, -1, 1)), shape(True, (-1, 1, 1), (1, -1, 1))]:
        assert below_the_sun(Like(todict=lambda: {7: [made]})) == [90]
    assert below_the_sun(Like(todict=lambda: {7: [shape(True, (1, 1, -1))]})) == [40]


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: px.Scene("x", bands={"PAR": [400, 700, 3]}), "bands/PAR: [400, 700, 3] are no ends of a band"),
        (lambda: px.Scene("x", bands={"PAR": (400,)}), "bands/PAR: (400,) are no ends"),
        (lambda: px.Scene("x", bands={"PAR": "47"}), "bands/PAR: '47' are no ends"),
        (lambda: px.Scene("x", bands={"PAR": 400}), "bands/PAR: 400 are no ends"),
        (lambda: px.Scene("x", bands={"PAR": (400, None)}), "bands/PAR: (400, None) are no ends"),
        (lambda: px.grid(0, 0, 0, 0.1, normal=[0, 0, 1, 5]), "grid: a normal of 4 numbers"),
        (lambda: px.grid(0, 0, 0, 0.1, normal=[0, 1]), "grid: a normal of 2 numbers"),
        (lambda: px.Scene("x").add("plant", {1: LEAF, "1": LEAF}), "plant: two ids that are '1' as text"),
        (lambda: px.Scene("x").material("m", reflectance={1: 0.5, "1": 0.6}), "two keys that are '1' as text"),
        (lambda: px.Scene("x").captor("c", discs=px.grid(0, 0, 0, 0.1)[:, :6]), "c: discs of shape (1, 6)"),
        (lambda: px.Scene("x").captor("c", discs=np.ones((1, 8))), "c: discs of shape (1, 8)"),
    ],
)
def test_numbers_and_names_too_many_are_errors(make, sentence):
    with pytest.raises(px.InputError) as caught:
        make()
    assert sentence in str(caught.value)


def test_bands_with_two_ends_or_none():
    bands = px.Scene("x", bands={"PAR": np.array([400, 700]), "all": None}).keys["bands"]
    assert bands == [{"name": "PAR", "from_nm": 400.0, "to_nm": 700.0}, {"name": "all"}]


@pytest.mark.parametrize("key", ["position", "power"])
def test_numbers_too_many_in_a_scene_are_errors(scene, key):
    scene.light("one", type="point", **{"position": [0.5, 0.5, 0.5], "power": [1, 2], key: [0.1, 0.2, 0.3, 0.4]})
    with pytest.raises(px.InputError) as caught:
        scene.check()
    assert caught.value.place.startswith("scene: /lights/2")


def test_pyvista():
    pv = pytest.importorskip("pyvista")
    scene = px.Scene("ball")
    scene.material("grey", type="lambert", reflectance=0.5)
    scene.add("cube", pv.Cube(), material="grey", captor=True)
    scene.add("blocks", pv.MultiBlock({"a": pv.Sphere(center=(3, 0, 0)), "b": pv.Plane(center=(0, 3, 0))}), material="grey", captor=True)
    scene.light("lamp", type="point", position=[0, 0, 3], power=100)
    found = scene.run(photons=1000, k=0)
    assert found.ids == ["cube/cube", "blocks/a", "blocks/b"]
    assert found.area[0] == pytest.approx(6)


def test_plantgl():
    pgl = pytest.importorskip("openalea.plantgl.all", reason="openalea.plantgl is not installed (conda-forge has it)")
    triangles = pgl.TriangleSet(ROOM_VERTICES.tolist(), ROOM_FACES.tolist())
    plant = pgl.Scene([pgl.Shape(triangles, pgl.Material(), 7), pgl.Shape(pgl.Translated(2, 0, 0, triangles), pgl.Material(), 8)])
    scene = px.Scene("plants")
    scene.material("grey", type="lambert", reflectance=0.5)
    scene.add("plant", plant, material="grey", captor=True)
    scene.light("lamp", type="point", position=[0.5, 0.5, 0.5], power=100)
    assert scene.run(photons=1000, k=0).ids == ["plant/7", "plant/8"]


def test_render_gives_pixels(scene):
    picture = scene.render(show="irradiance", width=40, height=30, map_photons=2000, rays=1, position=[0.5, 0.05, 0.5], look_at=[0.5, 1, 0.5])
    assert picture.dtype == np.uint8 and picture.shape[2] == 3 and picture.shape[0] >= 30
    numbers = scene.render(numbers=True, width=40, height=30, map_photons=2000, rays=1, gather=0)
    assert numbers.shape == (30, 40, 2) and np.isfinite(numbers).all() and numbers.max() > 0
    found = scene.run(photons=2000, k=0)
    assert scene.render(show="captors", results=found, width=40, height=30, rays=1).shape[2] == 3
    with pytest.raises(px.InputError) as caught:
        scene.render(show="captors", gather=3)
    assert caught.value.place == "gather"


def test_view_writes_a_page(scene, tmp_path):
    found = scene.run(photons=2000, k=0)
    found.view(tmp_path / "a.html", trace=False)
    assert "</html>" in (tmp_path / "a.html").read_text(encoding="utf-8")
    scene.view(tmp_path / "b.html", result=found, trace=False)
    assert (tmp_path / "a.html").read_bytes() == (tmp_path / "b.html").read_bytes()
    with pytest.raises(px.InputError, match="know no scene"):
        pickle.loads(pickle.dumps(found)).view(tmp_path / "c.html")


def test_copies_are_arrays(tmp_path):
    triangle = [[[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]]]
    placed = np.array([[0, 0, 0, 0, 1], [0.5, 0, 0, 90, 2]], dtype=float)
    matrices = np.array([np.eye(4), [[0, -2, 0, 0.5], [2, 0, 0, 0], [0, 0, 2, 0], [0, 0, 0, 1]]])
    keys = [{"translate": [0, 0, 0]}, {"translate": [0.5, 0, 0], "rotate_deg": [0, 0, 90], "scale": 2}]
    forms = [keys, placed, placed.tolist(), matrices, matrices[:, :3]]
    pd = pytest.importorskip("pandas")
    forms.append(pd.DataFrame(placed, columns=["x", "y", "z", "turn_deg", "scale"]))
    found = []
    for copies in forms:
        scene = px.Scene("field")
        scene.material("leaf", type="leaf", reflectance=0.1, transmittance=0.1)
        scene.add("plant", triangle, material="leaf", captor="instance", instances=copies)
        scene.light("sky", type="sky", model="uniform", irradiance=1)
        scene.save(tmp_path / "field.json")
        for own in (scene, px.Scene.load(tmp_path / "field.json")):
            found.append(own.run(photons=20_000, k=0))
    for one in found:
        assert one.ids == found[0].ids and len(one.ids) == 2
        np.testing.assert_allclose(one.center, found[0].center, atol=1e-6)
        np.testing.assert_allclose(one.area, [0.005, 0.02], rtol=1e-6)
    wrong = {"of shape (2, 2)": np.ones((2, 2)), "no numbers": [["a", 0, 0]], "last row": 2 * matrices, "one matrix": np.eye(4)}
    for words, copies in wrong.items():
        with pytest.raises(px.InputError, match=re.escape(words)):
            scene.add("more", triangle, material="leaf", instances=copies)
    scene.add("none", triangle, material="leaf", instances=3)
    with pytest.raises(px.InputError, match="instances"):
        scene.check()
