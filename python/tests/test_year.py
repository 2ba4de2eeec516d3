"""Tests of daylight by the hour."""

import numpy as np
import pytest

import phylux as px


@pytest.fixture
def greenhouse(tmp_path) -> px.Scene:
    """Makes a sensor over a floor by day, with a lamp, and the weather of one day in June."""
    sun = np.clip(np.sin(np.pi * (np.arange(24) + 0.5 - 4) / 16), 0, None)
    rows = [f"2025-06-21T{hour:02}:00+00:00,{600 * sun[hour]:.0f},{150 * sun[hour]:.0f}" for hour in range(24)]
    (tmp_path / "weather.csv").write_text("\n".join(["time,dni,dhi", *rows, ""]))
    scene = px.Scene(
        "day",
        quantity="umol/s",
        bands={"PAR": (400, 700)},
        site={"latitude": 44, "longitude": 0},
        time={"from": "2025-06-21T00:00+00:00", "to": "2025-06-22T00:00+00:00"},
        weather={"file": str(tmp_path / "weather.csv"), "stamp": "start"},
    )
    scene.material("floor", type="lambert", reflectance=0.2)
    scene.add("floor", [[[-2, -2, 0], [2, -2, 0], [2, 2, 0]], [[-2, -2, 0], [2, 2, 0], [-2, 2, 0]]], material="floor")
    scene.light("sun", type="sun")
    scene.light("sky", type="sky")
    scene.light("lamp", type="point", position=[0, 0, 2], power=1_000_000)
    scene.captor("sensor", discs=px.grid([0], [0], z=1, radius=0.3))
    return scene


def test_a_year_is_that_of_the_command(greenhouse, tmp_path):
    pytest.importorskip("pandas")
    lamps = {"lamps": [{"lights": "lamp", "watts": 60, "hours": [20, 24]}]}
    year = greenhouse.year(tmp_path / "lit", control=lamps, photons=300_000, seed=1, threads=1)
    dark = greenhouse.year(tmp_path / "unlit", photons=300_000, seed=1, csv=True)
    assert list(year.hours.columns) == ["captor", "time", "PAR_front", "PAR_front_se", "sunlit", "sunlit_se"]
    # it is sunlit while the sun shines
    assert year.hours.sunlit.max() == 1 and year.hours.sunlit.isna().any() and float(dark.total.sunlit.iloc[0]) == 1
    assert year.facts["photons"] == 300_000 and year.facts["unit"]["irradiance"] == "umol/m2/s"
    assert year.captors.captor.iloc[0] == "sensor/0" and float(year.captors.z.iloc[0]) == 1 and year.states.empty
    assert len(year.hours) == len(dark.hours) and year.hours.captor.iloc[0] == "sensor/0"
    # four hours of a lamp of 1e6 umol/s at 1 m: 0.0036 x 4 x 1e6 / (4 pi) mol, a little less at the rim; error 5 %
    added = float(year.total.PAR_front.iloc[0] - dark.total.PAR_front.iloc[0])
    assert 0.8 < added / (0.0036 * 4 * 1e6 / (4 * np.pi)) < 1.1
    assert float(dark.days.PAR_front.iloc[0]) == pytest.approx(float(dark.months.PAR_front.iloc[0]))
    whole = year.lamps[year.lamps.month == "all"]
    assert whole.hours.tolist() == [4] and whole.kwh.tolist() == [0.24]


def test_hours_as_arrays_and_states(greenhouse, tmp_path):
    pytest.importorskip("pandas")
    pytest.importorskip("xarray")
    greenhouse.keys["objects"][0]["present"] = True
    change = {"name": "gone", "changes": {"/objects/0/present": False}, "hours": [10, 14]}
    year = greenhouse.year(tmp_path / "year", control={"states": [change]}, photons=20_000, seed=1, sun_rays=32)
    data = year.xarray()
    assert dict(data.sizes) == {"time": 24, "captor": len(year.captors), "band": 1}
    assert float(data.front.sel(band="PAR").isel(captor=0).max()) == pytest.approx(year.hours.PAR_front.max())
    assert data.sunlit.dims == ("time", "captor") and int(data.time.dt.hour[5]) == 5
    assert year.states.hours.tolist() == [4, 4]
    days = year.xarray("days")
    assert dict(days.sizes) == {"time": 1, "captor": len(year.captors), "band": 1}
    assert float(days.front[0, 0, 0]) == pytest.approx(float(year.days.PAR_front.iloc[0]))


def test_results_and_plots_of_a_year(greenhouse, tmp_path):
    pytest.importorskip("pandas")
    year = greenhouse.year(tmp_path / "year", photons=20_000, seed=1, results=True)
    found = year.result("2025-06")
    # the mean of the day, in umol/m2/s, times its seconds, in mol
    assert 0.0864 * float(found.irradiance[0, 0, 0]) == pytest.approx(float(year.months.PAR_front.iloc[0]), rel=1e-5)
    year.plot(tmp_path / "day.svg", show="day")
    year.plot(tmp_path / "carpet.png", show="carpet", range=(0, 1000))
    assert "hour of the day" in (tmp_path / "day.svg").read_text() and (tmp_path / "carpet.png").stat().st_size > 1000
    with pytest.raises(px.InputError, match="no band or sum `UV`"):
        year.plot(tmp_path / "none.svg", band="UV")


def test_shards_by_an_executor_make_the_same_year(greenhouse, tmp_path):
    from concurrent.futures import ThreadPoolExecutor

    pytest.importorskip("pandas")
    options = {"photons": 20_000, "seed": 1, "threads": 1}
    one = greenhouse.year(tmp_path / "one", checkpoint=tmp_path / "kept", **options)
    with ThreadPoolExecutor(2) as executor:
        both = greenhouse.year(tmp_path / "both", width=3.5, png=True, shards=2, executor=executor, **options)
    assert list(one.folder.glob("*.svg")) and not list(both.folder.glob("*.svg")) and list(both.folder.glob("*.png"))
    assert one.hours.equals(both.hours) and one.total.equals(both.total) and not (tmp_path / "kept").exists()
    with pytest.raises(px.InputError, match="goes with `executor`"):
        greenhouse.year(tmp_path / "no", shards=2)


def test_errors_say_where(greenhouse, tmp_path):
    with pytest.raises(TypeError, match="fotons"):
        greenhouse.year(tmp_path / "year", fotons=1)
    with pytest.raises(px.InputError, match="there are 145, 577") as caught:
        greenhouse.year(tmp_path / "year", patches=7)
    assert caught.value.place == "patches"
    with pytest.raises(px.InputError) as caught:
        greenhouse.year(tmp_path / "year", control={"lamps": [{"lights": "none"}]})
    assert caught.value.place.startswith("control: /lamps/0"), str(caught.value)
    del greenhouse.keys["weather"]
    with pytest.raises(px.InputError) as caught:
        greenhouse.year(tmp_path / "year", photons=1000)
    assert str(caught.value).startswith("scene: /"), str(caught.value)
    assert caught.value.place.startswith("scene: /")


def test_errors_of_folders(greenhouse, tmp_path):
    with pytest.raises(px.InputError) as caught:
        greenhouse.year(tmp_path / "no" / "year", photons=1000)
    assert caught.value.place.endswith("year") and "no folder" in str(caught.value)
    assert not (tmp_path / "no").exists()


def test_plots_of_a_year(greenhouse, tmp_path):
    year = greenhouse.year(tmp_path / "year", photons=20_000, seed=1, sun_rays=32)
    for show, words in (("months", "mol/m²/d"), ("carpet", "hour"), ("day", "hour of the day")):
        picture = tmp_path / f"{show}.svg"
        year.plot(picture, show=show)
        assert words in picture.read_text(encoding="utf-8")
    for wrong, words in (({"show": "weeks"}, "months"), ({"captors": "none"}, "no captor or group"), ({"band": "red"}, "no band")):
        with pytest.raises(px.InputError, match=words):
            year.plot(tmp_path / "wrong.svg", **wrong)
    assert not (tmp_path / "wrong.svg").exists()
