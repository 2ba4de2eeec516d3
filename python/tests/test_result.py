"""Tests of results: arrays, tables, labelled arrays, files."""

import json
import pickle
import warnings

import numpy as np
import pytest

import phylux as px
from conftest import chamber


def test_arrays_say_what_the_file_says(result, tmp_path):
    result.save(tmp_path / "r.json")
    file = json.loads((tmp_path / "r.json").read_text())
    assert result.ids == [captor["id"] for captor in file["captors"]]
    assert result.bands == ["blue", "red", "PAR"]
    for c, captor in enumerate(file["captors"]):
        for f, face in enumerate(px.Result.faces):
            values = captor.get(face)
            if values is None:
                assert np.isnan(result.flux[c, f]).all()
                continue
            assert result.flux[c, f].tolist() == values["flux"]
            assert result.irradiance[c, f].tolist() == values["irradiance"]
            known = [np.nan if error is None else error for error in values["flux_se"]]
            np.testing.assert_array_equal(result.flux_se[c, f], known)
            assert result.values.photons[c, f] == values["photons"]
        np.testing.assert_array_equal(result.absorbed[c], captor.get("absorbed", [np.nan] * 3))
        assert (result.area[c], result.center[c].tolist()) == (captor["area"], captor["center"])
    assert {**result.head, "captors": file["captors"], "groups": file["groups"]} == file


def test_arrays_are_views_and_do_not_change(result):
    assert result.flux is result.flux
    assert result.irradiance.base is not None and not result.irradiance.flags.owndata
    with pytest.raises(ValueError, match="read-only"):
        result.flux[0] = 1


def test_the_frame_is_the_table_of_the_command(tmp_path):
    pd = pytest.importorskip("pandas")
    found = chamber().run(photons=20_000, k=50)
    found.save_csv(tmp_path / "r.csv")
    table = pd.read_csv(tmp_path / "r.csv", dtype={"captor": str, "band": str})
    # the rows of groups come last
    table = table[~table.quantity.isin(["min_over_mean", "cv"])]
    frame = found.frame
    assert list(frame.columns) == ["captor", "face", "band", "quantity", "value", "standard_error"]
    assert len(frame) == len(table) > 100
    for column in ("captor", "face", "band", "quantity"):
        assert frame[column].astype(object).where(frame[column].notna(), None).tolist() == table[column].astype(object).where(table[column].notna(), None).tolist()
    np.testing.assert_array_equal(frame.value, table.value)
    np.testing.assert_array_equal(frame.standard_error, table.standard_error)
    assert set(frame.quantity) == {"flux", "irradiance", "knn_irradiance", "knn_radiance", "absorbed"}


def test_uncertain_inputs_are_in_frames(tmp_path):
    pd = pytest.importorskip("pandas")
    scene = chamber()
    scene.keys["ratios"] = {"red over blue": {"numerator": "red", "denominator": "blue"}}
    plain = scene.run(photons=20_000, k=0)
    assert plain.budget is None and plain.values.flux_model_se is None and "model_se" not in plain.frame
    scene.keys["uncertain"] = {"/materials/wall/reflectance": 0.02, "/lights/lamp/power": [1, 4]}
    found = scene.run(photons=20_000, k=0)
    found.save_csv(tmp_path / "r.csv")
    table = pd.read_csv(tmp_path / "r.csv")
    table = table[~table.quantity.isin(["min_over_mean", "cv"]) & table.captor.isin(found.ids)]
    np.testing.assert_array_equal(found.frame.value, table.value)
    np.testing.assert_array_equal(found.frame.model_se, table.model_se)
    assert (found.frame.model_se > 0).any()
    values = found.values
    np.testing.assert_allclose(values.flux_model_se[:, 0], values.irradiance_model_se[:, 0] * values.area[:, None])
    assert values.ratios_model_se.shape == values.ratios.shape
    # two inputs, independent of each other, make all of it
    for _, rows in found.budget.groupby(["captor", "group", "face", "band"], dropna=False):
        assert len(rows) <= 2 and list(rows["rank"]) == list(range(len(rows)))
        np.testing.assert_allclose(np.sqrt((rows.se**2).sum()), rows.model_se.iloc[0])


def test_groups(result):
    pytest.importorskip("pandas")
    groups = result.groups
    assert list(groups.columns) == ["group", "face", "band", "quantity", "value", "standard_error"]
    assert set(groups.group) == {"plant", "grid"}
    row = groups[(groups.group == "plant") & (groups.quantity == "absorbed") & (groups.band == "red")]
    assert row.value.item() == pytest.approx(np.nansum(result.absorbed[:, 1]), rel=1e-9)
    assert (groups.quantity == "irradiance_min").any()
    grid = groups[(groups.group == "grid") & (groups.face == "front") & (groups.band == "red")]
    even = grid.set_index("quantity")
    ratio = even.value["irradiance_min"] / even.value["irradiance"]
    assert even.value["min_over_mean"] == pytest.approx(ratio, rel=1e-9)
    assert 0 < even.standard_error["min_over_mean"] and 0 < even.standard_error["cv"] < 1


def test_groups_by_pattern():
    scene = chamber()
    scene.group("some", "grid/0", "grid/1")
    found = scene.run(photons=2000, k=0, tolerance=0.5, of=["some", "plant:absorbed:red"])
    assert "some" in set(found.groups.group)
    assert found.head["settings"]["of"] == ["some:irradiance", "plant:absorbed:red"]


def test_triangles(result):
    leaf = result.triangles("plant/leaf0")
    assert leaf.ids == ["plant/leaf0/0", "plant/leaf0/1"]
    assert leaf.absorbed.shape == (2, 3) and leaf.irradiance.shape == (2, 2, 3)
    assert (leaf.absorbed > 0).all()
    with pytest.raises(px.InputError, match="plant/leaf1"):
        result.triangles("plant")
    with pytest.raises(px.InputError, match="plant/leaf0"):
        result.triangles("leaf")


def test_a_triangle_without_area_has_no_numbers():
    scene = px.Scene("gap")
    scene.material("grey", type="lambert", reflectance=0.5)
    corners = [[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 0, 0]] * 3, [[1, 1, 0], [0, 1, 0], [1, 0, 0]]]
    scene.add("floor", corners, material="grey", captor="triangle")
    scene.light("lamp", type="point", position=[0.3, 0.3, 1], power=1)
    with pytest.warns(px.SceneWarning, match="has no area"):
        found = scene.run(photons=1000, k=0)
    floor = found.triangles("floor")
    assert floor.ids == ["floor/floor/0", "", "floor/floor/2"]
    assert np.isnan(floor.absorbed[:, 0]).tolist() == [False, True, False]


def test_xarray(result):
    pytest.importorskip("xarray")
    data = result.xarray()
    assert data.irradiance.dims == ("captor", "face", "band", "light")
    assert data.light.values.tolist() == ["lamp", "spot"]
    whole = result.xarray(by_light=False)
    assert whole.irradiance.dims == ("captor", "face", "band")
    np.testing.assert_allclose(data.flux.sum("light", skipna=False), whole.flux, rtol=1e-9)
    np.testing.assert_allclose(data.absorbed.sum("light", skipna=False), whole.absorbed, rtol=1e-9)
    assert whole.irradiance.sel(face="front", band="red", captor="grid/0").item() == result.irradiance[result.ids.index("grid/0"), 0, 1]
    assert whole.flux.attrs["units"] == "umol/s" and whole.irradiance_se.attrs["units"] == "umol/m2/s"
    assert (whole.attrs["seed"], whole.attrs["photons"]) == (1, 20_000)
    assert whole.from_nm.values.tolist()[:2] == [400, 600]
    assert {"area", "x", "y", "z", "nx", "ny", "nz", "to_nm"} <= set(whole.coords)
    with pytest.raises(px.InputError, match="not split by light"):
        chamber().run(photons=1000, k=0).xarray(by_light=True)


def test_netcdf(result, tmp_path):
    xr = pytest.importorskip("xarray")
    pytest.importorskip("netCDF4")
    data = result.xarray()
    data.to_netcdf(tmp_path / "r.nc")
    with xr.open_dataset(tmp_path / "r.nc") as again:
        xr.testing.assert_identical(again.load(), data)


def test_mix_is_linear(result):
    half = result.mix({"lamp": 0.5, "sp*": 0})
    np.testing.assert_allclose(half.flux, 0.5 * result.light("lamp").flux, rtol=1e-12, equal_nan=True)
    assert half.head["mixed"] == {"lamp": 0.5, "spot": 0}
    assert half.mix({}).lights == result.lights
    bands = result.mix({"lamp": [0.5, 1], "spot": 0})
    blue, red = bands.flux[..., 0], bands.flux[..., 1]
    np.testing.assert_allclose(blue, 0.5 * result.light("lamp").flux[..., 0], rtol=1e-12, equal_nan=True)
    np.testing.assert_allclose(red, result.light("lamp").flux[..., 1], rtol=1e-12, equal_nan=True)
    with pytest.raises(px.InputError, match="3 factors of light `lamp` for 2 bands"):
        result.mix({"lamp": [1, 2, 3]})
    with pytest.raises(px.InputError, match="nothing.json"):
        result.mix(calibration="nothing.json")
    with pytest.raises(px.InputError, match="did you mean `lamp`"):
        result.mix({"lapm": 0.5})
    with pytest.raises(px.InputError, match="not split by light"):
        chamber().run(photons=1000, k=0).mix({"lamp": 0.5})


def test_results_travel_and_are_saved(result, tmp_path):
    result.save(tmp_path / "r.json")
    for other in (px.load(tmp_path / "r.json"), pickle.loads(pickle.dumps(result))):
        assert isinstance(other, px.Result)
        np.testing.assert_array_equal(other.flux, result.flux)
        assert other.to_json() == (tmp_path / "r.json").read_bytes()
    result.save_per_captor(tmp_path / "captors")
    assert len(list((tmp_path / "captors").iterdir())) == len(result.ids)
    with pytest.raises(px.InputError):
        result.save(tmp_path / "none" / "r.json")


def test_parquet(result, tmp_path):
    pd = pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    result.to_parquet(tmp_path / "r.parquet")
    again = pd.read_parquet(tmp_path / "r.parquet")
    np.testing.assert_array_equal(again.value, result.frame.value)
    assert again.captor.tolist() == result.frame.captor.tolist()


def test_nearest_estimates():
    found = chamber().run(photons=20_000, k=20)
    assert found.nearest["knn_irradiance"].shape == (8, 2, 3)
    assert (found.nearest["k"][:, 0] == 20).all()
    assert chamber().run(photons=1000, k=0).nearest == {}


def test_words(result):
    assert str(result).startswith("chamber: 20000 photons in 128 batches, seed 1")
    assert repr(result) == "<Result of 'chamber': 20000 photons, 8 captors>"
    energy = result.energy
    np.testing.assert_allclose(energy["emitted"], np.add(np.add(energy["absorbed"], energy["escaped"]), energy["lost"]), rtol=1e-9)


@pytest.mark.parametrize(
    ("kind", "options"),
    [
        ("map", {"captors": "grid", "band": "red"}),
        ("map", {"captors": "plant", "axes": "xz", "s": 4}),
        ("plants", {"captors": "plant", "band": "red"}),
        ("profile", {"captors": "grid", "band": "red"}),
        ("rank", {"captors": "plant", "quantity": "absorbed"}),
        ("spectrum", {"captors": ["grid/0", "grid/1"]}),
        ("bars", {"captors": "grid", "face": "back"}),
    ],
)
def test_plots_return_axes(result, kind, options):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    ax = result.plot(kind, **options)
    assert isinstance(ax, matplotlib.axes.Axes)
    assert "µmol" in ax.get_xlabel() + ax.get_ylabel() + "".join(a.get_ylabel() for a in ax.figure.axes)
    assert result.plot(kind, ax=ax, **options) is ax
    with pytest.raises(px.InputError):
        result.plot(kind, captors="none", ax=ax)
    with pytest.raises(px.InputError, match="no plot"):
        result.plot("pie")


def test_a_map_has_contours_and_says_ppfd():
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    scene = px.Scene("rows", quantity="umol/s", bands={"PAR": (400, 700), "far": (700, 800)})
    scene.light("lamp", type="point", position=[0, 0, 1], power=[100, 10])
    scene.captor("grid", discs=px.grid([0, 1, 2], [0, 1], z=0.5, radius=0.2))
    rows = scene.run(photons=100_000)
    ax = rows.plot("map")
    assert (ax.get_xlabel(), ax.get_ylabel(), ax.get_title(loc="left")[:9]) == ("x, m", "y, m", "z = 0.5 m")
    assert "median error " in ax.get_title(loc="left")
    assert ax.figure.axes[-1].get_ylabel() == "PPFD, µmol/m²/s"
    # colours and lines, where every line lies between the sensors
    colours, lines = ax.collections[:2]
    assert len(colours.get_paths()) > 20 and any(len(path) for path in lines.get_paths())
    for path in lines.get_paths():
        assert (path.vertices >= -1e-9).all() and (path.vertices <= [2 + 1e-9, 1 + 1e-9]).all()
    assert rows.plot("map", band="far").figure.axes[-1].get_ylabel() == "PFD, far, µmol/m²/s"
    # an option of dots selects dots instead of contours
    assert [len(rows.plot("map", **{option: value}).collections) for option, value in (("s", 9), ("marker", "s"))] == [1, 1]
    # captors in one line do not span a plane
    dots = rows.plot("map", captors=["grid/0", "grid/1"])
    assert len(dots.collections) == 1
    with pytest.raises(px.InputError, match="in a line"):
        rows.plot("map", captors=["grid/0", "grid/1"], contours=True)


def test_plants_absorb_what_their_leaves_do():
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    leaf = np.array([[[0, 0, 0], [0.2, 0, 0], [0, 0.2, 0]]], float)
    scene = px.Scene("plants")
    scene.material("leaf", type="lambert", reflectance=0.2)
    scene.add("plant", {"leaf1": leaf, "leaf2": leaf + [0, 0.3, 0.1]}, material="leaf", captor=True,
              instances=[{"translate": [0, 0, 0]}, {"translate": [0.3, 0, 0]}])
    scene.light("lamp", type="point", position=[0, 0, 0.5], power=100)
    found = scene.run(photons=100_000)
    absorbed = dict(zip(found.ids, found.absorbed[:, 0], strict=True))
    ax = found.plot("plants")
    expected = [absorbed[f"plant/leaf1#{i}"] + absorbed[f"plant/leaf2#{i}"] for i in range(2)]
    np.testing.assert_allclose(ax.containers[0].lines[0].get_ydata(), expected)
    ranks = found.plot("plants", by="rank")
    expected = [(absorbed[f"plant/leaf{n}#0"] + absorbed[f"plant/leaf{n}#1"]) / 2 for n in (1, 2)]
    np.testing.assert_allclose(ranks.containers[0].lines[0].get_ydata(), expected)
    with pytest.raises(px.InputError, match="no `leaf`"):
        found.plot("plants", by="leaf")


def test_grounds_are_no_plants():
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    flat = np.array([[[-1, -1, 0], [1, -1, 0], [1, 1, 0]], [[-1, -1, 0], [1, 1, 0], [-1, 1, 0]]], float)
    leaf = np.array([[[0, 0, 0.5], [0.1, 0, 0.5], [0, 0.1, 0.5]]])
    scene = px.Scene("two grounds")
    scene.material("grey", type="lambert", reflectance=0.5)
    scene.add("plant", {"leaf1": leaf, "leaf2": leaf + [0, 0.2, 0.1]}, material="grey", captor=True)
    # a path beside a bank that rises by a half
    scene.add("path", flat, material="grey", captor=True)
    scene.add("bank", flat @ [[1, 0, 0.02], [0, 1, 0], [0, 0, 1]] + [2, 0, 0.01], material="grey", captor="triangle")
    scene.light("lamp", type="point", position=[0.5, 0, 2], power=100)
    found = scene.run(photons=20_000, seed=1)
    assert [line.get_label() for line in found.plot("plants").containers] == ["plant"]


def test_a_map_of_lamps_is_round():
    plots = pytest.importorskip("phylux.plots")
    x = np.arange(6.0)
    hill = plots._smoothly(x, (10 - (x - 2.5) ** 2)[:, None], np.array([1.5, 2.5, 3.5]))[:, 0]
    np.testing.assert_allclose(hill, [9, 10, 9])
    # the edge of a shadow has no seam
    edge = plots._smoothly(x, np.array([0.0, 0, 7, 7, 0, 0])[:, None], np.linspace(0, 5, 101))
    assert edge.min() == 0 and edge.max() < 7 + 1e-9


def test_plots_leave_out_what_would_mislead():
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    leaf = np.array([[[0, 0, 0.3], [0.1, 0, 0.3], [0, 0.1, 0.3]]], float)
    ground = [[[-1, -1, 0], [1, -1, 0], [1, 1, 0]], [[-1, -1, 0], [1, 1, 0], [-1, 1, 0]]]
    scene = px.Scene("parts", bands={"blue": (400, 500), "red": (600, 700)})
    scene.material("leaf", type="lambert", reflectance=0.2)
    scene.add("plant", {f"leaf{i}": leaf + [0.1 * i, 0, 0] for i in range(8)}, material="leaf", captor=True)
    scene.add("soil", ground, material="leaf", captor=True)
    scene.captor("line", discs=px.grid([0, 0.5, 1], [0], 0.5, radius=0.1))
    scene.group("some leaves", "plant/leaf1*", "plant/leaf2*")
    scene.light("lamp", type="point", position=[0, 0, 2], power=100)
    found = scene.run(photons=20_000, seed=1)
    # parts of a larger group are not drawn; there is a gap between bands that do not meet
    spectrum = found.plot("spectrum")
    assert "some leaves" not in [line.get_text() for line in spectrum.get_legend().get_texts()]
    assert [list(patch.get_data().edges) for patch in spectrum.patches[:2]] == [[400, 500], [600, 700]]
    # the ground is no plant, unless it is asked for
    assert [line.get_label() for line in found.plot("plants").containers] == ["plant"]
    assert [line.get_label() for line in found.plot("plants", captors="soil").containers] == ["soil"]
    # groups stand for their captors, beside patterns and ids
    assert [len(found.plot("rank", captors=names).containers[0].lines[0].get_ydata())
            for names in ("some leaves", ["some leaves", "plant/leaf3*"], ["plant/leaf1*"])] == [2, 3, 1]
    with pytest.raises(px.InputError, match="no captor or group `leaves`"):
        found.plot("rank", captors=["some leaves", "leaves"])
    # three sensors in a line are dots with their values
    dots = found.plot("map", captors="line")
    assert len(dots.collections) == 1 and len(dots.texts) == 3


def test_a_map_leaves_gaps_blank_and_ends_with_its_captors():
    pytest.importorskip("matplotlib")
    from phylux.plots import _field

    x, y = (of.ravel().astype(float) for of in np.meshgrid(0.6 * np.arange(8), 0.2 * np.arange(3)))
    sets = np.zeros(48, int)
    for gap, filled in ((0.59, 4.2 * (0.8 + 0.59)), (0.61, 2 * 4.2 * 0.4)):
        two = np.append(x, x), np.append(y, y + 0.4 + gap)
        across, up, _, triangles = _field(*two, 100 * two[0], sets)
        assert [across.min(), across.max()] == pytest.approx([0, 4.2]) and up.max() == pytest.approx(0.8 + gap)
        a, b, c = (np.column_stack([across, up])[triangles[:, i]] for i in range(3))
        areas = np.abs(np.cross(b - a, c - a)) / 2
        assert areas.sum() == pytest.approx(filled)
    star = [np.array(of, float) for of in ([0, 1, 2, 1, 1], [1, 0, 1, 2, 1], [1, 2, 3, 4, 5])]
    assert len(_field(*star, np.zeros(5, int))[0]) == 5


def test_a_map_has_no_step_finer_than_two_errors():
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    from phylux.plots import _contours, _even, _field

    x, y = (of.ravel().astype(float) for of in np.meshgrid(np.arange(6), np.arange(4)))
    noise = np.where(np.arange(24) % 2, 7.0, -7.0)
    mean, error = _even(400 + noise, np.full(24, 7.0))
    assert mean == pytest.approx(400) and error == 7
    assert _even(400 + noise + 10 * x, np.full(24, 7.0)) == (None, 7)
    for error in (0.01, 1.0, 4.0, 30.0):
        ax = matplotlib.figure.Figure().add_subplot()
        field = _field(x, y, 50 + 10 * x - 3 * y, np.zeros(24, int))
        drawn, numbers = _contours(ax, field, error, None, {})
        assert np.diff(drawn.levels).min() >= 2 * error * (1 - 1e-9)
        assert np.diff(numbers).min() >= 2 * error * (1 - 1e-9)


def test_a_map_of_a_grid_is_smooth():
    from phylux.plots import _smooth

    # five columns, in disorder; the cubic between 0 and 7 has slopes of 10.5, of the parabola through 0, 7, 7, and 0
    x, y = (at.ravel() for at in np.meshgrid(np.arange(5.0), np.arange(4.0)))
    order = np.random.default_rng(1).permutation(20)
    values = np.array([0.0, 7.0, 7.0, 9.0, 4.0])[x.astype(int)]
    fine = _smooth(x[order], y[order], values[order])
    for place in zip(x, y, values, strict=True):
        own = np.hypot(fine[0] - place[0], fine[1] - place[1]).argmin()
        np.testing.assert_allclose([at[own] for at in fine[:3]], place, atol=1e-12)
    np.testing.assert_allclose(fine[2][np.isclose(fine[0], 0.5)], 10.5 / 8 + 3.5)
    assert fine[2].min() > -1e-12 and fine[2].max() < 9 + 1e-12
    # a plane stays one, and points that are no grid have no finer one
    fine = _smooth(x, y, 3 * x - 2 * y)
    np.testing.assert_allclose(fine[2], 3 * fine[0] - 2 * fine[1], atol=1e-12)
    assert _smooth(x[:-1], y[:-1], values[:-1]) is None


def test_a_profile_has_the_means_over_area(result):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    grid = [row for row, id in enumerate(result.ids) if id.startswith("grid")]
    line = result.plot("profile", captors="grid", band="PAR").lines[0]
    heights = np.unique(np.round(result.center[grid, 2], 3))
    np.testing.assert_allclose(line.get_ydata(), heights)
    area = result.area[grid]
    for height, mean in zip(heights, line.get_xdata(), strict=True):
        at = np.round(result.center[grid, 2], 3) == height
        np.testing.assert_allclose(mean, np.average(result.irradiance[grid, 0, 2][at], weights=area[at]))
    with pytest.raises(px.InputError, match="none of them has a value of absorbed"):
        result.plot("profile", captors="grid", quantity="absorbed")


def test_daily_light_integrals(tmp_path):
    pd = pytest.importorskip("pandas")
    hours = [f"2025-06-21T{hour:02}:00+00:00,{max(0, 900 - 150 * abs(hour - 12))}" for hour in range(24)]
    (tmp_path / "day.csv").write_text("time,ghi\n" + "\n".join(hours) + "\n")
    scene = px.Scene(
        "day",
        quantity="umol/s",
        bands={"PAR": (400, 700), "NIR": (700, 800)},
        site={"latitude": 44, "longitude": 0},
        time={"from": "2025-06-21T00:00+00:00", "to": "2025-06-22T00:00+00:00"},
        weather={"file": tmp_path / "day.csv", "stamp": "start"},
    )
    scene.light("sun", type="sun")
    scene.light("sky", type="sky")
    scene.captor("sensor", disc={"center": [0, 0, 0], "normal": [0, 0, 1], "radius": 1})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = scene.run(photons=10_000, k=0)
    np.testing.assert_allclose(found.values.dli[0, 0, 0], 0.0864 * found.irradiance[0, 0, 0], rtol=1e-12)
    assert np.isnan(found.values.dli[0, 0, 1])
    assert found.xarray().dli.attrs["units"] == "mol/m2/d"
    found.save_csv(tmp_path / "r.csv")
    table = pd.read_csv(tmp_path / "r.csv")
    assert found.frame.quantity.astype(str).tolist() == table.quantity.tolist()
    np.testing.assert_array_equal(found.frame.value, table.value)


def test_ratios_and_weighted_sums(tmp_path):
    scene = chamber()
    scene.keys["sums"] = {"PAR": ["blue", "red"], "lux": "photopic", "YPFD": "YPF"}
    scene.keys["ratios"] = {"b:r": {"numerator": "blue", "denominator": "red"}, "yield": {"numerator": "YPFD", "denominator": "PAR"}}
    found = scene.run(photons=5_000, seed=1, by_light=True)
    assert found.ratios == ["b:r", "yield"]
    assert found.bands == ["blue", "red", "PAR", "lux", "YPFD"]
    expected = found.flux[:, :, 0] / np.where(found.flux[:, :, 1] > 0, found.flux[:, :, 1], np.nan)
    np.testing.assert_allclose(found.values.ratios[:, :, 0], expected, rtol=1e-12)
    assert (found.values.ratios_se[~np.isnan(expected)] >= 0).all()
    sole = found.light("lamp").ratios
    np.testing.assert_allclose(sole[:, :, 0][~np.isnan(sole[:, :, 0])], (found.light("lamp").flux[:, :, 0] / found.light("lamp").flux[:, :, 1])[~np.isnan(sole[:, :, 0])], rtol=1e-12)
    dimmed = found.mix({"lamp": 0.5})
    assert not np.allclose(dimmed.values.ratios, found.values.ratios, equal_nan=True)
    found.save_csv(tmp_path / "r.csv")
    import pandas as pd

    table = pd.read_csv(tmp_path / "r.csv", dtype={"band": str})
    table = table[table.captor.isin(found.ids)]
    assert table.quantity.tolist() == found.frame.quantity.astype(str).tolist()
    assert table.band.tolist() == found.frame.band.astype(str).tolist()
    np.testing.assert_array_equal(table.value, found.frame.value)
    np.testing.assert_array_equal(table.standard_error, found.frame.standard_error)
    assert set(found.groups.quantity) >= {"ratio", "absorbed_ratio"}
    assert found.xarray().ratios.dims == ("captor", "face", "ratio", "light")


def test_electricity_and_absorbed_by_face(tmp_path):
    scene = chamber()
    scene.keys["absorbed_by_face"] = True
    for light in scene.keys["lights"]:
        light["watts"] = 40
    found = scene.run(photons=5_000, seed=1)
    assert found.electricity["watts"] == 80
    shares = found.electricity["shares"]
    every = [*shares["absorbed_by"].values(), shares["outside"], shares["lost"]]
    np.testing.assert_allclose(np.sum([one["share"] for one in every], axis=0), 1, rtol=1e-9)
    faces = found.values.absorbed_by_face
    surface = found.is_surface
    np.testing.assert_allclose(faces[surface].sum(axis=1), found.absorbed[surface], rtol=1e-12)
    assert np.isnan(faces[~surface]).all()
    found.save_csv(tmp_path / "r.csv")
    import pandas as pd

    table = pd.read_csv(tmp_path / "r.csv", dtype={"band": str})
    table = table[table.captor.isin(found.ids)]
    assert table.quantity.tolist() == found.frame.quantity.astype(str).tolist()
    np.testing.assert_array_equal(table.value, found.frame.value)


def test_sunlit_shares(tmp_path):
    pd = pytest.importorskip("pandas")
    scene = px.Scene("leaf in the sun", sunlit=True, sun_at={"elevation_deg": 90, "azimuth_deg": 180})
    scene.material("leaf", type="lambert", reflectance=0.1)
    shade = [[0, 0, 1], [0.5, 0, 1], [0.5, 1, 1], [0, 1, 1]]
    floor = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    for name, corners in (("shade", shade), ("floor", floor)):
        scene.add(name, (np.array(corners, float), [[0, 1, 2], [0, 2, 3]]), material="leaf", captor=True)
    scene.light("sun", type="sun", irradiance=800)
    found = scene.run(photons=2_000)
    np.testing.assert_allclose(found.values.sunlit, [1, 0.5], atol=0.1)
    assert (found.values.sunlit_se < 0.1).all()
    assert found.xarray().sunlit.dims == ("captor",)
    found.save_csv(tmp_path / "r.csv")
    table = pd.read_csv(tmp_path / "r.csv", dtype={"band": str})
    table = table[table.captor.isin(found.ids)]
    assert table.quantity.tolist() == found.frame.quantity.astype(str).tolist()
    np.testing.assert_array_equal(table.value, found.frame.value)
    night = px.Scene("night", sunlit=True)
    night.light("lamp", type="point", position=[0, 0, 1], power=1)
    with pytest.raises(px.InputError, match="0 suns, must be 1"):
        night.run(photons=100)


def test_even_light():
    scene = px.Scene("row")
    for i in range(3):
        scene.light(f"l{i}", type="point", position=[0.5 * i, 0, 0.5], power=100, watts=10)
    scene.captor("line", discs=px.grid(np.linspace(0, 1, 9), [0.0], z=0, radius=0.03))
    found = scene.run(photons=20_000, by_light=True)
    report = found.even("line", mean=30)
    assert report["after"]["cv"] < report["before"]["cv"]
    assert abs(report["after"]["mean"] - 30) < 1e-6
    mixed = found.mix(report["factors"])
    assert abs(mixed.irradiance[:, 0, 0].mean() - 30) < 1e-6
    assert report["after"]["watts"] is not None
    with pytest.raises(ValueError, match="no group and no captor"):
        found.even("nothing")
    with pytest.raises(ValueError, match="a mean is given"):
        found.even("line", mean=1, minimum=1)


def test_plots_of_many_captors_show_groups_and_one_plane():
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    leaf = np.array([[[0, 0, 0.2], [0.2, 0, 0.2], [0, 0.2, 0.2]]], float)
    scene = px.Scene("many", bands={"PAR": (400, 700), "far": (700, 800)})
    scene.material("leaf", type="lambert", reflectance=0.2)
    places = [{"translate": [0.3 * i, 0, 0]} for i in range(3)]
    scene.add("plant", {f"leaf{i}": leaf + [0, 0, 0.1 * i] for i in range(9)}, material="leaf", captor=True, instances=places)
    scene.captor("grid", discs=px.grid([0, 0.5, 1], [0, 0.5, 1], 0, radius=0.1))
    scene.captor("above", discs=px.grid([0, 0.5], [0, 0.5], 1, radius=0.1))
    scene.light("lamp", type="point", position=[0.5, 0.5, 2], power=[100, 10])
    found = scene.run(photons=20_000, seed=1)
    assert len(found.ids) == 40
    spectrum = found.plot("spectrum")
    assert [line.get_text() for line in spectrum.get_legend().get_texts()] == ["plant", "grid", "above"]
    row = found.group_values.ids.index("plant")
    # steps per nanometre between the wavelengths of the bands
    values, edges, _ = spectrum.patches[0].get_data()
    np.testing.assert_allclose(values, found.group_values.irradiance[row, 0] / [300, 100])
    np.testing.assert_allclose(edges, [400, 700, 800])
    assert spectrum.get_ylabel() == "irradiance, W/m²/nm"
    bars = found.plot("bars")
    assert [label.get_text() for label in bars.get_yticklabels()] == ["plant", "grid", "above"]
    # the nine sensors at z = 0, not the four above them, nor leaves
    grid = found.plot("map")
    assert grid.get_title(loc="left").startswith("z = 0 m: median error 0.0")
    assert sum(len(line.get_xdata()) for line in grid.lines) == 9
    # sensors and surfaces have a profile each
    assert [line.get_label() for line in found.plot("profile").containers] == ["sensors", "surfaces"]
    # each object has a colour of its own
    assert [line.get_label() for line in found.plot("rank").containers] == ["plant", "grid", "above"]
    # only captors that are asked for are joined by a line
    assert found.plot("rank").containers[0].lines[0].get_linestyle() == "None"
    assert found.plot("rank", captors="grid").containers[0].lines[0].get_linestyle() == "-"
