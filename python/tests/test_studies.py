"""Tests of calibrations, comparisons, charts, exports, sweeps with designs, weather from a DataFrame, and plots of these."""

import concurrent.futures
import json
import time
import tracemalloc

import numpy as np
import pytest

import phylux as px
from test_manners import options_of


def bench(**keys: object) -> px.Scene:
    """Makes two lamps of 100 umol/s over a bench, with a sensor below each and one between."""
    scene = px.Scene("bench", quantity="umol/s", **keys)
    for name, x in (("left", -1.0), ("right", 1.0)):
        scene.light(name, type="point", position=[x, 0, 1], power=100)
    discs = px.grid([-1, 0, 1], 0, 0, radius=0.1)
    scene.captor("bench", discs=discs)
    return scene


def test_powers_are_found_from_readings(tmp_path):
    pd = pytest.importorskip("pandas")
    scene = bench()
    scene.material("grey", type="lambert", reflectance=0.2)
    scene.add("shelf", [[[-9, -9, -1], [9, -9, -1], [0, 9, -1]]], material="grey")
    result = scene.run(photons=200_000, seed=1, by_light=True, k=0)
    # an instrument that reads what the lamps give at 0.8 and 1.3 times their powers
    truth = result.mix({"left": 0.8, "right": 1.3})
    # the scale repeats, so that there are 3 readings for each lamp
    readings = pd.DataFrame({"captor": truth.ids, "value": truth.irradiance[:, 0, 0], "sd": 1e-3})
    found = scene.calibrate(readings, result=result, model="lamps", prior=None)
    assert found.factors["left"][0] == pytest.approx(0.8, rel=1e-3)
    assert found.factors["right"][0] == pytest.approx(1.3, rel=1e-3)
    assert set(found.factors_se) == {"left", "right"}
    assert found.report["model"] == "lamps" and found.report["prior"] is None
    assert list(found.readings.columns[:4]) == ["captor", "face", "band", "use"] and len(found.readings) == 3
    assert (found.readings.low < found.readings.calibrated).all()
    # the scene has the new powers, the same meshes in memory, and runs
    assert found.scene.keys["lights"][0]["power"] == pytest.approx([80], rel=1e-3)
    assert found.scene.keys["objects"] == scene.keys["objects"] and found.scene.keys["captors"] == scene.keys["captors"]
    assert found.scene.run(photons=1000, k=0).ids == truth.ids and scene.keys["lights"][0]["power"] == 100
    # a mix takes the factors, from the object or from its file
    found.save(tmp_path / "c.json")
    mixed = result.mix(calibration=found)
    assert mixed.irradiance == pytest.approx(truth.irradiance, rel=2e-3, nan_ok=True)
    assert mixed.to_json() == result.mix(calibration=tmp_path / "c.json").to_json()
    readings.to_csv(tmp_path / "r.csv", index=False)
    again = scene.calibrate(tmp_path / "r.csv", result=result, model="lamps", prior=None)
    assert again.factors == found.factors


def test_even_light_is_that_of_a_result():
    scene = bench()
    scene.keys["lights"][1]["power"] = 50
    result = scene.run(photons=100_000, seed=3, by_light=True, k=0)
    found = scene.calibrate(even="bench", mean=10, result=result)
    assert found.report == result.even("bench", mean=10)
    # the lattice is symmetric, so both lamps must have the same power
    powers = [light["power"][0] for light in found.scene.keys["lights"]]
    assert powers[0] == pytest.approx(powers[1], rel=0.05)
    assert found.factors_se is None and len(found.readings) == 0
    fewer = scene.calibrate(even="bench", minimum=5, groups=["*"], photons=20_000, seed=3, threads=1)
    assert fewer.factors["left"] == fewer.factors["right"] and fewer.report["minimum"] == 5


def test_wrong_calibrations_say_why(tmp_path):
    pd = pytest.importorskip("pandas")
    scene = bench()
    with pytest.raises(px.InputError, match="readings: neither readings nor `even`"):
        scene.calibrate()
    with pytest.raises(px.InputError, match="both readings and `even`"):
        scene.calibrate(tmp_path / "r.csv", even="bench")
    with pytest.raises(px.InputError, match="vary: goes with readings only"):
        scene.calibrate(even="bench", vary={"/lights/0/power": (1, 2)})
    with pytest.raises(px.InputError, match="no captor") as caught:
        scene.calibrate(pd.DataFrame({"captor": ["none"], "value": [1.0]}), photons=1000)
    assert str(caught.value).startswith("readings:2"), str(caught.value)
    with pytest.raises(px.InputError, match="mean"):
        scene.calibrate(even="bench", mean=-1)


def test_results_are_compared():
    pytest.importorskip("pandas")
    scene = bench()
    a, b = (scene.run(photons=50_000, seed=seed, k=0) for seed in (1, 2))
    same = a.compare(b)
    assert same.agrees and not same.dependent and same.unmatched == [] and same.few_paths == 0
    assert list(same.frame.columns) == ["captor", "what", "band", "a", "b", "z"] and len(same.frame) == 3
    assert same.frame.z.abs().max() < same.limit and "they agree within their errors" in str(same)
    scene.keys["lights"][0]["power"] = 150
    other = a.compare(scene.run(photons=50_000, seed=2, k=0))
    assert not other.agrees and other.frame.captor.iloc[0] == "bench/0" and "differ by more than chance" in str(other)
    assert a.compare(a).dependent
    watts = px.Scene("bench")
    watts.light("lamp", type="point", position=[0, 0, 1], power=1)
    watts.captor("bench", discs=px.grid(0, 0, 0, radius=0.1))
    with pytest.raises(px.InputError, match="one is in umol/s, the other in W"):
        a.compare(watts.run(photons=1000, k=0))


def test_a_check_is_data():
    checked = bench().check()
    assert [light["name"] for light in checked.data["lights"]] == ["left", "right"]
    assert checked.data["captors"] == {"virtual": 3, "surface": 0} and checked.data["warnings"] == checked.warnings


def test_a_chart_is_a_folder(tmp_path):
    pytest.importorskip("pandas")
    chart = bench().chart(tmp_path / "chart", photons=2000, seeds=2, k=[20], threads=1)
    assert {"k", "seed"} & set(chart.rows.columns) and len(chart.pictures) >= 2
    assert chart.study and all(picture.read_text().startswith("<svg") for picture in chart.pictures)
    drawn = bench().chart(tmp_path / "png", photons=2000, seeds=2, k=[20], threads=1, width=3.5, png=True)
    names = [picture.stem for picture in chart.pictures]
    assert [picture.name for picture in drawn.pictures] == [f"{name}.png" for name in names]
    with pytest.raises(px.InputError, match="seeds"):
        bench().chart(tmp_path / "other", seeds=1)


def test_exports_are_those_of_the_command(scene, tmp_path):
    result = scene.run(photons=5000, k=0)
    result.export(tmp_path / "a.vtp", trace=False)
    scene.export(tmp_path / "b.vtp", result=result, trace=False)
    assert (tmp_path / "a.vtp").read_bytes() == (tmp_path / "b.vtp").read_bytes()
    scene.export(tmp_path / "a.glb", result=result, quantity="absorbed", band="red", range=(0, 10), log=False)
    assert (tmp_path / "a.glb").read_bytes()[:4] == b"glTF"
    with pytest.raises(px.InputError, match="names no format"):
        scene.export(tmp_path / "a.txt")
    with pytest.raises(px.InputError, match="no band `green`"):
        scene.export(tmp_path / "a.glb", band="green")
    with pytest.raises(px.InputError, match="there are irradiance and absorbed"):
        scene.export(tmp_path / "a.glb", quantity="colour")
    result.save(tmp_path / "r.json")
    with pytest.raises(px.InputError, match="know no scene; use scene.export"):
        px.load(tmp_path / "r.json").export(tmp_path / "c.vtp")


def test_light_as_polydata(scene):
    pytest.importorskip("pyvista")
    result = scene.run(photons=5000, k=0)
    mesh = result.to_pyvista(trace=False)
    assert mesh.n_cells > 12 and any("irradiance" in name for name in mesh.cell_data)


def lamp(height, power=1.0):
    scene = px.Scene("lamp")
    scene.light("lamp", type="point", position=[0, 0, height], power=power)
    scene.captor("sensor", disc={"center": [0, 0, 0], "normal": [0, 0, 1], "radius": 0.1})
    return scene


def test_sweeps_have_the_designs_of_the_command(tmp_path):
    few = {"photons": 1000, "k": 0}
    sample = {"sample": "sobol", "count": 8, "seed": 3}
    found = px.sweep(lamp, {"height": {"from": 1, "to": 2}, "power": [1.0, 2.0]}, combine=sample, **few)
    heights = [values["height"] for values in found.values]
    assert sorted(int(8 * (height - 1)) for height in heights) == list(range(8))
    assert {values["power"] for values in found.values} == {1.0, 2.0}
    # the same points as those of a scene, whose documents the command would run
    scene = px.sweep(lamp(1), {"/lights/0/position/2": {"from": 1, "to": 2}, "/lights/0/power": [1.0, 2.0]}, combine=sample, **few)
    assert [result.to_json() for result in scene] == [result.to_json() for result in found]
    zipped = px.sweep(lamp, {"height": [1, 2], "power": [3, 4]}, combine="zip", **few)
    assert zipped.values == [{"height": 1, "power": 3}, {"height": 2, "power": 4}]
    steps = px.sweep(lamp, {"height": {"from": 1, "to": 2, "steps": 3}}, **few)
    assert steps.values == [{"height": 1}, {"height": 1.5}, {"height": 2}]
    # expressions, in other processes too
    vary = {"rise": [0, 0.5], "/lights/*/position/2": ["=x + rise"], "seed": [7]}
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        risen = px.sweep(lamp(1), vary, executor=pool, threads=1, **few)
    assert [result.to_json() for result in risen] == [lamp(height).run(seed=7, **few).to_json() for height in (1, 1.5)]
    arrays = px.sweep(lambda shape: lamp(len(shape)), {"shape": [np.zeros(1), np.zeros(2)]}, **few)
    assert [len(values["shape"]) for values in arrays.values] == [1, 2]


def test_runs_of_a_table():
    pd = pytest.importorskip("pandas")
    few = {"photons": 500, "k": 0, "threads": 1}
    columns = {"/lights/0/position/2": [1.0, 1.5], "seed": [3, 4]}
    rows = [{"/lights/0/position/2": 1.0, "seed": 3}, {"/lights/0/position/2": 1.5, "seed": 4}]
    there = [found.to_json() for found in px.sweep(lamp(1), rows, **few)]
    for table in (pd.DataFrame(columns), pd.DataFrame(columns).convert_dtypes()):
        found = px.sweep(lamp(1), table, **few)
        assert found.values == rows and [one.to_json() for one in found] == there
    # what is no number or text stands as a text in the table
    table = px.sweep(lambda shape: lamp(len(shape)), {"shape": [np.zeros(1), {1, 2}]}, **few).frame
    assert table["shape"].unique().tolist() == ["[0.]", "{1, 2}"]


def test_scenes_of_runs_are_made_one_by_one():
    """Those of many runs together would need gigabytes."""
    scene = lamp(1)
    scene.keys["groups"] = {f"group {i}": ["sensor*"] for i in range(200)}

    class Enough(Exception):
        pass

    def first(done, of):
        assert (done, of) == (1, 5000)
        raise Enough

    tracemalloc.start()
    try:
        with pytest.raises(Enough):
            px.sweep(scene, {"/lights/0/position/2": {"from": 1, "to": 2, "steps": 5000}}, progress=first, photons=500, k=0, threads=1)
        assert tracemalloc.get_traced_memory()[1] < 10e6
    finally:
        tracemalloc.stop()


def test_wrong_sweeps_say_why():
    with pytest.raises(px.InputError, match="the scene has no `/lights/0/powr`; the nearest that it has is /lights/0/power"):
        px.sweep(lamp(1), {"/lights/0/powr": [1]})
    with pytest.raises(px.InputError, match="does not say where in the scene its value goes"):
        px.sweep(lamp(1), {"rise": [1, 2]})
    with pytest.raises(px.InputError, match="there is no parameter `z`"):
        px.sweep(lamp(1), {"/lights/0/power": ["=2 * z"]})
    with pytest.raises(px.InputError, match="grid, zip, or an object"):
        px.sweep(lamp, {"height": [1]}, combine=3)
    for values, words in [
        ({"height": 5}, "sweep: height: 5 is one value; give a list"),
        ({"height": "12"}, "sweep: height: '12' is one value"),
        ([], "sweep: has no run"),
        ([1], "sweep: run 0: a int"),
        (None, "sweep: a NoneType"),
    ]:
        with pytest.raises(px.InputError, match=words):
            px.sweep(lamp, values)


def sunny() -> px.Scene:
    scene = px.Scene("open", quantity="umol/s", bands={"PAR": (400, 700)}, time="2025-06-21T11:30+02:00")
    scene.light("sun", type="sun")
    scene.light("sky", type="sky")
    scene.captor("sensor", disc={"center": [0, 0, 0], "normal": [0, 0, 1], "radius": 0.1})
    return scene


def test_weather_of_a_frame(tmp_path):
    pd = pytest.importorskip("pandas")
    times = pd.date_range("2025-06-21T10:00", periods=3, freq="h", tz="Europe/Berlin")
    table = pd.DataFrame({"temp_air": [20, 21, 22], "dni": [500.0, 640.0, np.nan], "dhi": [150.0, 160.0, 165.0]}, index=times)
    scene = sunny()
    # pvlib's readers return the table and its metadata
    scene.weather((table, {"latitude": 52, "longitude": 13, "altitude": 30}), stamp="start")
    assert scene.keys["site"] == {"latitude": 52, "longitude": 13}
    given = sunny()
    given.keys["site"] = {"latitude": 52, "longitude": 13}
    given.keys["weather"] = {"direct_normal": 640, "diffuse_horizontal": 160}
    options = {"photons": 5000, "k": 0, "seed": 1}
    assert scene.run(**options).to_json() == given.run(**options).to_json()
    # so do those of PVGIS and of NSRDB, each in its way
    for more in [
        ([1, 2], {"location": {"latitude": 52, "longitude": 13}}, {"inputs": {}}),
        ({"inputs": {"location": {"latitude": 52.0, "longitude": 13.0, "elevation": 30.0}, "meteo_data": {}}},),
        ({"Source": "NSRDB", "Latitude": "52", "Longitude": "13", "Time Zone": 1},),
    ]:
        other = sunny()
        other.weather((table, *more), stamp="start")
        assert other.keys["site"] == {"latitude": 52, "longitude": 13}, more
    unknown = sunny()
    unknown.weather((table, {"station": "roof"}), stamp="start")
    assert "site" not in unknown.keys
    # the saved scene has the table beside it
    scene.save(tmp_path / "open.json")
    assert json.loads((tmp_path / "open.json").read_text())["weather"]["file"] == "open-weather.csv"
    assert px.load(tmp_path / "open.json").run(**options).to_json() == scene.run(**options).to_json()
    # a second table takes the place of the first
    scene.weather(table.assign(dni=0.0), stamp="start")
    assert scene.run(**options).irradiance[0, 0, 0] < given.run(**options).irradiance[0, 0, 0]


def test_wrong_weather_says_why():
    pd = pytest.importorskip("pandas")
    scene = sunny()
    times = pd.date_range("2025-06-21T10:00", periods=2, freq="h")
    with pytest.raises(px.InputError, match="weather: no DataFrame"):
        scene.weather([1, 2], stamp="start")
    with pytest.raises(px.InputError, match="no column ghi, dni or dhi"):
        scene.weather(pd.DataFrame({"GHI": [1, 2]}, index=times.tz_localize("UTC")), stamp="start")
    with pytest.raises(px.InputError, match="without times of a time zone"):
        scene.weather(pd.DataFrame({"ghi": [1, 2]}, index=times), stamp="start")
    scene.weather(pd.DataFrame({"ghi": [1, 2]}, index=times.tz_localize("UTC")), stamp="now")
    with pytest.raises(px.InputError, match="stamp"):
        scene.check()
    scene.keys["weather"] = {"file": "table:none", "stamp": "start"}
    with pytest.raises(px.InputError, match="there is no table `none` in memory"):
        scene.check()


def test_studies_tell_how_far_they_are_and_end_when_asked_to(tmp_path):
    told = []
    bench().calibrate(even="bench", photons=400_000, threads=1, progress=lambda done, of: told.append((done, of)))
    bench().chart(tmp_path / "chart", photons=20_000, seeds=2, k=[20], threads=1, progress=lambda done, of: told.append((done, of)))
    assert told and all(of is None or done <= of for done, of in told) and told[-1][0] > 0

    class Enough(Exception):
        pass

    def enough(done, of):
        raise Enough

    with pytest.raises(Enough):
        bench().chart(tmp_path / "never", photons=1e9, progress=enough)
    until = time.monotonic() + 60
    while (tmp_path / "never").exists() and time.monotonic() < until:
        time.sleep(0.05)
    # what it had begun to write is gone
    assert not (tmp_path / "never").exists()


def test_every_option_of_the_studies_is_an_argument():
    import inspect

    alone = {"calibrate": {"help", "quiet", "output", "results", "group"}, "chart": {"help", "quiet", "output"}}
    own = {"calibrate": {"readings", "result", "groups", "progress"}, "chart": {"output", "progress"}}
    for name, left_out in alone.items():
        arguments = set(inspect.signature(getattr(px.Scene, name)).parameters) - {"self"} - own[name]
        assert arguments == options_of(name) - left_out, name
    # photons are those of the run whose result is exported
    of_a_run = {"photons", "map_photons", "seed"}
    assert options_of("export") - {"help", "quiet", "output", "results", "no_trace"} - of_a_run <= set(
        inspect.signature(px.Scene.export).parameters
    )


def test_names_of_the_package_are_those_for_users():
    assert dir(px) == sorted([*px.__all__, "__version__"])


def test_plots_of_a_canopy():
    pytest.importorskip("pandas")
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    sun_at = {"elevation_deg": 90, "azimuth_deg": 180}
    cell = {"layers": {"dz": 0.1}, "periodic": {"x": [0, 1], "y": [0, 1]}, "sunlit": True, "sun_at": sun_at}
    scene = px.Scene("field", quantity="umol/s", bands={"PAR": (400, 700)}, **cell)
    scene.material("leaf", type="leaf", reflectance=0.06, transmittance=0.03)
    scene.material("soil", type="lambert", reflectance=0.1)
    scene.add("soil", [[[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 0, 0], [1, 1, 0], [0, 1, 0]]], material="soil", captor=True, ground=True)
    for i in range(3):
        z = 0.25 + 0.1 * i
        scene.add(f"leaf{i}", [[[0.1, 0.1, z], [0.9, 0.1, z], [0.5, 0.9, z]]], material="leaf", captor=True)
    scene.light("sky", type="sky", model="uniform", irradiance=1000)
    scene.light("sun", type="sun", irradiance=500)
    result = scene.run(photons=20_000, seed=1, k=0)
    axes = result.plot("canopy")
    per_area = result.layers[result.layers.area > 0].per_area.tolist()
    # equal leaves one above the other, below the sun: the highest shades the others
    leaves = result.layers[result.layers.area > 0]
    assert leaves.sunlit.tolist() == pytest.approx([0, 0, 1], abs=0.01) and (leaves.sunlit_se < 0.005).all()
    assert [bar.get_width() for bar in axes.patches] == pytest.approx(per_area)
    assert "the plants absorb" in axes.get_title() and "µmol/m²/s" in axes.get_xlabel()
    with pytest.raises(px.InputError, match="results without layers"):
        bench().run(photons=1000, k=0).plot("canopy")


def test_sensitivities_are_a_table():
    pd = pytest.importorskip("pandas")
    assert bench().run(photons=1000, k=0).sensitivity is None
    scene = bench(sensitivity=True)
    table = scene.run(photons=20_000, seed=1, k=0).sensitivity
    assert list(table.columns) == [
        "captor", "group", "face", "parameter", "band", "elasticity", "elasticity_se", "derivative", "derivative_se"
    ]
    # the light of all lamps together is all light
    lamps = table[table.parameter.str.startswith("/lights/")].fillna({"captor": "", "group": ""})
    sums = lamps.groupby(["captor", "group", "face", "band"]).elasticity.sum()
    assert len(sums) > 0 and sums.to_numpy() == pytest.approx(1)
    assert isinstance(table, pd.DataFrame) and table.elasticity_se.dtype == float
    # the option takes the place of the key, and leaves the scene as it is
    pd.testing.assert_frame_equal(bench().run(photons=20_000, seed=1, k=0, sensitivity=True).sensitivity, table)
    assert scene.run(photons=1000, k=0, sensitivity=False).sensitivity is None
    assert scene.keys["sensitivity"] is True
    left = bench().run(photons=20_000, seed=1, k=0, sensitivity="left").sensitivity
    assert set(left.parameter) == {"/lights/0/power"}
    with pytest.raises(px.InputError, match="no material or light `lef`.*did you mean `left`"):
        bench().run(photons=1000, k=0, sensitivity=["lef"])
    with pytest.raises(px.InputError, match="must be true, false or a list of names"):
        bench().run(photons=1000, k=0, sensitivity=5)


def test_a_mix_has_sensitivities_and_a_budget():
    pytest.importorskip("pandas")
    scene = bench(sensitivity=True, uncertain={"/lights/left/power": 5, "/lights/right/power": 10})
    split = scene.run(photons=20_000, seed=1, k=0, guiding="off", by_light=True)
    mixed = split.mix({"left": 0.5, "right": 2})
    table = mixed.sensitivity.fillna({"captor": "", "group": ""})
    sums = table.groupby(["captor", "group", "face", "band"]).elasticity.sum()
    assert len(sums) > 0 and sums.to_numpy() == pytest.approx(1)
    assert "model_se" in mixed.frame and (mixed.budget.se > 0).all()
    # one lamp alone is all light, and stays uncertain by the same share of its power
    right = split.mix({"left": 0, "right": 3})
    assert set(right.sensitivity.parameter) == {"/lights/1/power"}
    assert right.sensitivity.elasticity.to_numpy() == pytest.approx(1)
    group = right.frame[(right.frame.quantity == "irradiance") & (right.frame.value > 0)]
    # without what the noise of the run would add to the square
    square = (group.value**2 - group.standard_error**2).clip(lower=0)
    assert len(group) > 0 and (group.model_se**2 / 0.1**2).to_numpy() == pytest.approx(square.to_numpy(), rel=1e-3)
    assert bench().run(photons=1000, k=0, by_light=True).mix({}).sensitivity is None


def test_ratios_have_sensitivities():
    pytest.importorskip("pandas")
    bands = {"red": (600, 700), "far": (700, 800)}
    ratios = {"r_fr": {"numerator": "red", "denominator": "far"}}
    scene = px.Scene("two lamps", quantity="umol/s", bands=bands, ratios=ratios)
    scene.light("red", type="point", position=[0, 0, 1], power=[100, 0])
    scene.light("both", type="point", position=[0, 0, 1], power=[100, 100])
    scene.captor("sensor", discs=px.grid(0, 0, 0, radius=0.1))
    table = scene.run(photons=200_000, seed=1, k=0, guiding="off", sensitivity=True).sensitivity
    found = table[table.group.notna() & (table.face == "front")].set_index(["parameter", "band"]).elasticity
    # half of the red light is that of the lamp that has no other
    assert found["/lights/0/power", "r_fr"] == pytest.approx(found["/lights/0/power", "red"])
    assert found["/lights/0/power", "r_fr"] == pytest.approx(0.5, abs=0.1)
    assert found["/lights/1/power", "r_fr"] == pytest.approx(-found["/lights/0/power", "r_fr"])


def test_sums_have_units_of_their_own():
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    bands = {"blue": (400, 500), "green": (500, 600), "red": (600, 700)}
    scene = px.Scene("lux", quantity="umol/s", bands=bands, sums={"PAR": list(bands), "bright": "photopic"})
    scene.light("lamp", type="point", position=[0, 0, 1], power=[1, 1, 1])
    scene.captor("grid", discs=px.grid([-1, 0, 1], [-1, 0, 1], z=0, radius=0.1))
    with pytest.warns(px.SceneWarning, match="much within band"):
        result = scene.run(photons=20_000)
    # the first sum of the scene, not the first by the alphabet
    assert [result.plot("rank").get_ylabel(), result.plot("rank", band="bright").get_ylabel()] == [
        "PPFD, µmol/m²/s",
        "illuminance, bright, lx",
    ]
    pytest.importorskip("xarray")
    data = result.xarray()
    assert "units" not in data.irradiance.attrs
    assert data.irradiance_unit.sel(band=["red", "bright"]).values.tolist() == ["umol/m2/s", "lx"]
