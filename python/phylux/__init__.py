"""Photon mapping for plant science: how much light every sensor and every leaf receives, and how certain that is.

A `Scene` is built with the keys of a scene file. `Scene.run` returns a `Result`, which has numpy arrays, a pandas
``frame``, an ``xarray()``, plots, a page for the browser, and the files that the command ``phylux`` writes.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

from . import _native, plots
from .errors import InputError, RunError, SceneWarning
from .geometry import Mesh, grid
from .histories import Histories
from .leaves import LeafSpectra, prospect
from .result import Result, Values
from .scene import Check, Scene
from .studies import Calibration, Chart, Comparison
from .sweeps import Sweep, sweep
from .years import Year

__version__ = _native.__version__
__all__ = [
    "Calibration",
    "Chart",
    "Check",
    "Comparison",
    "Histories",
    "InputError",
    "LeafSpectra",
    "Mesh",
    "Result",
    "RunError",
    "Scene",
    "SceneWarning",
    "Sweep",
    "Values",
    "Year",
    "grid",
    "load",
    "plots",
    "prospect",
    "sweep",
]


def __dir__() -> list[str]:
    return [*__all__, "__version__"]


def load(path: str | os.PathLike[str]) -> Scene | Result:
    """Reads a scene file or a results file, and returns a `Scene` or a `Result`."""
    from .scene import _read

    keys = _read(Path(path))
    return Result.load(path) if "phylux" in keys and "energy" in keys else Scene.load(path)


def _cli() -> int:
    """Runs the command ``phylux`` and returns its exit code."""
    return _native.main(["phylux", *sys.argv[1:]])
