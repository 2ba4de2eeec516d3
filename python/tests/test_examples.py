"""Runs the examples if the packages that they need are installed; pytest -rs names those that are left out."""

import importlib.util
import json
from pathlib import Path

import pytest

import phylux as px

EXAMPLES = Path(__file__).parent.parent / "examples"


def example(name):
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def few_photons(monkeypatch):
    run = px.Scene.run
    monkeypatch.setattr(px.Scene, "run", lambda self, photons=None, *a, **o: run(self, 20_000, *a, **o))
    year = px.Scene.year
    monkeypatch.setattr(px.Scene, "year", lambda self, *a, photons=None, **o: year(self, *a, photons=300_000, sun_rays=4, **o))


def test_from_plantgl(few_photons):
    pytest.importorskip("openalea.plantgl", reason="openalea.plantgl is not installed (it is not on PyPI)")
    found = example("from_plantgl").main([])
    assert found.ids == [f"plant/{id}" for id in range(4)]
    assert (found.absorbed > 0).all()


def test_from_lpy(few_photons, tmp_path):
    pytest.importorskip("openalea.lpy", reason="openalea.lpy is not installed (it is not on PyPI)")
    (tmp_path / "stem.lpy").write_text("Axiom: F(10)\nderivation length: 1\nproduction:\nendlsystem\n")
    assert (example("from_plantgl").main([str(tmp_path / "stem.lpy")]).absorbed > 0).all()


def test_from_blender(few_photons):
    pytest.importorskip("bpy", reason="bpy (Blender) is not installed")
    # the file that Blender opens by default: a cube of 2 m, a camera and a point light
    found = example("from_blender").main([])
    assert found.ids == ["Cube/Cube"]
    assert found.area[0] == pytest.approx(24)


def test_the_plant_without_plantgl(few_photons):
    """The scene of the example works with triangles in CARIBU's form."""
    blade = [[(0, 0, 10), (5, -2, 11), (10, 0, 10)], [(0, 0, 10), (10, 0, 10), (5, 2, 11)]]
    found = example("from_plantgl").light({1: blade}).run(k=0)
    assert found.ids == ["plant/1"] and found.absorbed[0, 0] > 0


@pytest.fixture
def drawing(tmp_path, monkeypatch):
    """A folder for the pictures of examples."""
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    monkeypatch.chdir(tmp_path)
    yield tmp_path
    matplotlib.pyplot.close("all")


def test_calibration(drawing):
    """The true factors are within 5 standard errors of those found: odds below 1e-5 for the seeds, which are fixed."""
    module = example("calibration")
    factors, errors = module.main(photons=300_000)
    assert (abs(factors - list(module.TRUE.values())) < 5 * errors).all() and (errors < 0.1).all()
    assert (drawing / "calibration.png").stat().st_size > 10_000


def test_lamp_height(drawing):
    """Light gets less and more even with height, up to where the sides shade."""
    mean, even = example("lamp_height").main(photons=50_000)
    assert (mean[:-1] > mean[1:]).all() and even[4] > even[0]
    assert (drawing / "lamp_height.png").stat().st_size > 10_000


def test_white_floors(drawing):
    """White walls bring more than a white floor, and both some light; by how much the one run at 0.5 says of the walls, within a tenth."""
    elasticity, ppfd = example("white_floors").main(photons=50_000)
    assert set(elasticity) == {"floor", "walls", "ceiling", "crop"} and all(value > 0 for value in elasticity.values())
    assert all((light[1:] > light[:-1]).all() for light in ppfd.values())
    assert ppfd["walls"][-1] / ppfd["walls"][0] > ppfd["floor"][-1] / ppfd["floor"][0]
    slope = (ppfd["walls"][3] - ppfd["walls"][1]) / 0.4 * 0.5 / ppfd["walls"][2]
    assert abs(slope / elasticity["walls"] - 1) < 0.1
    assert (drawing / "white_floors.png").stat().st_size > 10_000


def test_leaf_spectra(drawing):
    """Green light tells pale leaves from dark ones, red light hardly does."""
    shares = example("leaf_spectra").main(photons=50_000)
    pale, green, dark = (shares[name] for name in ("pale", "green", "dark"))
    assert (pale[4:8] < green[4:8]).all() and (green[4:8] < dark[4:8]).all()
    assert (dark - pale)[4:8].mean() > 2 * (dark - pale)[10:11].mean()
    assert (drawing / "leaf_spectra.png").stat().st_size > 10_000


def test_panels(drawing):
    """Some of the light is taken, most where the panels stand, and no place has more than the open field."""
    for tilt, share in example("panels").main(photons=5_000).items():
        assert 0.5 < share.mean() < 0.9 and share.max() < 1.1, tilt
    assert (drawing / "panels.png").stat().st_size > 10_000


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.ipynb")), ids=lambda path: path.stem)
def test_notebooks(path, few_photons, tmp_path, monkeypatch):
    """The cells of the notebooks run in order, with few photons. Stored outputs come from more photons and are not
    compared."""
    for package in ("matplotlib", "pandas", "xarray", "trimesh"):
        pytest.importorskip(package)
    import matplotlib

    matplotlib.use("Agg")
    # beside the shipped scenes, as in the repository
    (tmp_path / "scenes").symlink_to(EXAMPLES.parent.parent / "scenes")
    (tmp_path / "python" / "examples").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "python" / "examples")
    notebook = json.loads(path.read_text(encoding="utf-8"))
    code = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert any(output["output_type"] == "display_data" for cell in code for output in cell["outputs"])
    assert path.stat().st_size < 500_000
    space = {"__name__": "__main__"}
    for cell in code:
        exec(compile("".join(cell["source"]), str(path), "exec"), space)
    space["plt"].close("all")
