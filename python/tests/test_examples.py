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


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.ipynb")), ids=lambda path: path.stem)
def test_notebooks(path, few_photons, tmp_path, monkeypatch):
    """The cells of the notebooks run in order, with few photons. Stored outputs come from more photons and are not
    compared."""
    for package in ("matplotlib", "pandas", "xarray", "trimesh"):
        pytest.importorskip(package)
    import matplotlib

    matplotlib.use("Agg")
    monkeypatch.chdir(tmp_path)
    notebook = json.loads(path.read_text(encoding="utf-8"))
    code = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert any(output["output_type"] == "display_data" for cell in code for output in cell["outputs"])
    assert path.stat().st_size < 500_000
    space = {"__name__": "__main__"}
    for cell in code:
        exec(compile("".join(cell["source"]), str(path), "exec"), space)
    space["plt"].close("all")
