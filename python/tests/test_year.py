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


def test_another_control_takes_the_light_of_a_year(greenhouse, tmp_path):
    lamps = {"lamps": [{"lights": "lamp", "hours": [4, 8], "watts": 50}]}
    dark = greenhouse.year(tmp_path / "dark", photons=20_000, seed=1, sun_rays=32)
    lit = greenhouse.year(tmp_path / "lit", control=lamps, from_=dark.folder)
    anew = greenhouse.year(tmp_path / "anew", control=lamps, photons=20_000, seed=1, sun_rays=32)
    names = sorted(path.name for path in anew.folder.iterdir())
    assert "light.work" in names and names == sorted(path.name for path in lit.folder.iterdir())
    for name in names:
        assert (lit.folder / name).read_bytes() == (anew.folder / name).read_bytes(), name
    with pytest.raises(px.InputError, match="from"):
        greenhouse.year(tmp_path / "wrong", from_=dark.folder, photons=1000)
    greenhouse.keys["lights"][-1]["power"] = 500
    with pytest.raises(px.InputError, match="of another scene.*leave out `from_`"):
        greenhouse.year(tmp_path / "wrong", from_=dark.folder)


def test_ids_are_texts(greenhouse, tmp_path):
    pytest.importorskip("pandas")
    ids = ["007", "7", "1e3", "NA", "true", "2025-06-21"]
    for i, name in enumerate(ids):
        greenhouse.captor(name, disc={"center": [0.1 * i, 0, 1], "normal": [0, 0, 1], "radius": 0.04}, group="00")
    options = {"photons": 20_000, "seed": 1, "patches": 145, "sun_rays": 2, "threads": 1}
    years = [greenhouse.year(tmp_path / name, csv=csv, **options) for name, csv in (("parquet", False), ("csv", True))]
    for year in years:
        for name in ("hours", "days", "months", "total", "captors"):
            assert list(dict.fromkeys(getattr(year, name).captor))[1 : len(ids) + 1] == ids, name
        assert "00" in year.captors.captor.tolist() and "00; 7" in year.captors.groups.tolist()
        assert len(year.days.merge(year.captors, on="captor")) == len(year.days)
    assert years[0].hours.captor.tolist() == years[1].hours.captor.tolist()


def test_arrays_of_a_change_of_clocks(greenhouse, tmp_path):
    """The night in which summer time ends has its second hour twice, one hour after the other."""
    pd = pytest.importorskip("pandas")
    xr = pytest.importorskip("xarray")
    times = pd.date_range("2025-10-25T00:00", periods=73, freq="h", tz="Europe/Zurich")
    light = [max(0.0, 300 - 12 * (time.hour - 13) ** 2) for time in times]
    greenhouse.weather(pd.DataFrame({"ghi": light, "dhi": light}, index=times), stamp="start")
    greenhouse.keys["time"] = {"from": "2025-10-25T00:00+02:00", "to": "2025-10-28T00:00+01:00"}
    options = {"photons": 20_000, "seed": 1, "patches": 145, "sun_rays": 2, "threads": 1}
    for csv in (False, True):
        year = greenhouse.year(tmp_path / f"year{csv}", csv=csv, **options)
        data = year.xarray()
        assert data.sizes["time"] == len(year.hours.time.unique())
        steps = np.diff(data.time.values)
        assert (steps == steps[0]).all() and steps[0] == np.timedelta64(1, "h")
        # what the tables say: the clock, and how far it is ahead of UTC
        told = [pd.Timestamp(time) for time in dict.fromkeys(year.hours.time.astype(str))]
        assert data.local_time.values.tolist() == pd.DatetimeIndex([time.tz_localize(None) for time in told]).as_unit(np.datetime_data(data.local_time.dtype)[0]).values.tolist()
        assert data.utc_offset.values.tolist() == [time.utcoffset().total_seconds() / 3600 for time in told]
        assert (data.time + data.utc_offset * np.timedelta64(3600, "s") == data.local_time).all()
        assert "UTC" in data.time.attrs["long_name"] and data.utc_offset.attrs["units"] == "h"
        assert data.front.attrs["units"] == data.front_se.attrs["units"] == "umol/m2/s" and data.sunlit.attrs["units"] == "1"
        days = year.xarray("days")
        assert days.front.attrs["units"] == "mol/m2/d" and days.sizes["time"] == len(year.days.day.unique())
        assert data.attrs["seed"] == 1 and data.attrs["scene"] == "day"
        if not csv:
            pytest.importorskip("netCDF4")
            data.to_netcdf(tmp_path / "year.nc")
            with xr.open_dataset(tmp_path / "year.nc") as again:
                xr.testing.assert_identical(again.load(), data)
    with pytest.raises(px.InputError, match="there are hours, days and months"):
        year.xarray("weeks")


def test_sums_of_a_year_say_their_units(greenhouse, tmp_path):
    pytest.importorskip("pandas")
    pytest.importorskip("xarray")
    greenhouse.keys["bands"] = [{"name": name, "from_nm": low, "to_nm": low + 100} for name, low in (("blue", 400), ("green", 500), ("red", 600))]
    greenhouse.keys["sums"] = {"PAR": ["blue", "green", "red"], "bright": "photopic"}
    year = greenhouse.year(tmp_path / "year", photons=20_000, seed=1, patches=145, sun_rays=2, threads=1)
    data = year.xarray()
    assert "units" not in data.front.attrs and data.unit.sel(band=["red", "bright"]).values.tolist() == ["umol/m2/s", "lx"]


@pytest.mark.parametrize("csv", [False, True])
def test_ids_that_a_spreadsheet_would_run_are_those_of_the_scene(greenhouse, tmp_path, csv):
    """In tables in CSV an apostrophe stands before them."""
    pytest.importorskip("pandas")
    pytest.importorskip("xarray")
    names = ["-1", "+45 deg", "=1+1", "@home", "'q", "''", "7"]
    for name in names:
        greenhouse.captor(name, disc={"center": [0, 0, 1], "normal": [0, 0, 1], "radius": 0.3})
    greenhouse.group("-g", "7", "@home")
    year = greenhouse.year(tmp_path / "year", photons=20_000, patches=145, sun_rays=2, csv=csv, threads=1)
    ids = ["sensor/0", *names, "sensor", "-g"]
    assert year.captors.captor.tolist() == year.hours.captor.unique().tolist() == year.xarray().captor.values.tolist() == ids
    assert len(year.days.merge(year.captors, on="captor")) == len(ids)
