"""The native part of phylux. Use the functions and classes of `phylux` instead; this part may change."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, final

import numpy as np
import numpy.typing as npt

__all__ = [
    "Found",
    "Loaded",
    "Planned",
    "__version__",
    "calibrate",
    "charts",
    "load",
    "main",
    "merged_year",
    "plot",
    "prospect",
    "quantities",
    "write_file",
    "write_obj",
    "year",
]

__version__: str

_Path = str | os.PathLike[str]
_Group = tuple[str | None, str | None, int, int]
_Mesh = tuple[str, npt.NDArray[np.float64], npt.NDArray[np.int64], list[_Group]]

def main(arguments: list[str]) -> int: ...
def prospect(contents: list[float]) -> list[npt.NDArray[np.float64]]: ...
def load(json: str, path: _Path, meshes: list[_Mesh], tables: dict[str, bytes], is_read: bool) -> Loaded: ...
def year(
    scene: Path,
    control: Path | None,
    output: Path,
    arguments: str,
    style: str,
    checkpoint: Path | None = None,
    shard: str | None = None,
    light: _Path | None = None,
    progress: Callable[[int, int | None], object] | None = None,
) -> list[str]: ...
def merged_year(shards: list[Path], output: Path, style: str) -> list[str]: ...
def plot(folder: Path, output: _Path, arguments: str) -> list[str]: ...
def calibrate(
    scene: Loaded,
    arguments: str,
    readings: tuple[bytes, Path] | None,
    result: Found | None,
    progress: Callable[[int, int | None], object] | None = None,
) -> tuple[str, str, list[str]]: ...
def charts(
    scene: Loaded,
    output: Path,
    truth: Path | None,
    arguments: str,
    style: str,
    progress: Callable[[int, int | None], object] | None = None,
) -> list[str]: ...
def write_file(path: _Path, content: bytes, read: list[Path]) -> None: ...
def write_obj(path: _Path, mesh: _Mesh) -> None: ...
@final
class Loaded:
    @property
    def warnings(self) -> list[str]: ...
    @property
    def files(self) -> list[Path]: ...
    def check(self, width: int) -> tuple[str, list[str], str]: ...
    def run(self, arguments: str, progress: Callable[[int, int | None], object] | None = None) -> tuple[Found, list[str]]: ...
    def render(
        self, arguments: str
    ) -> tuple[int, npt.NDArray[np.uint8], tuple[int, int, npt.NDArray[np.float32]] | None]: ...
    def export(
        self,
        path: _Path,
        results: Found | None,
        trace: bool,
        threads: int | None,
        absorbed: bool | None,
        band: str | None,
        range: tuple[float, float] | None,
        log: bool,
    ) -> None: ...
    def histories(
        self, arguments: str, progress: Callable[[int, int | None], object] | None = None
    ) -> tuple[str, list[str]]: ...
    def view(
        self, path: _Path, results: Found | None, trace: bool, threads: int | None, to: str | None
    ) -> None: ...

@final
class Planned:
    def __new__(cls, sweep: str, scene: str) -> Planned: ...
    def __len__(self) -> int: ...
    def values(self, run: int) -> str: ...
    def scene(self, run: int) -> str: ...

def quantities() -> list[tuple[str, str, str, str, bool, bool, bool, int | None]]: ...

@final
class Found:
    @staticmethod
    def read(path: _Path) -> Found: ...
    @staticmethod
    def from_json(json: bytes) -> Found: ...
    @property
    def files(self) -> list[Path]: ...
    @property
    def head(self) -> str: ...
    def to_json(self) -> bytes: ...
    def write(self, path: _Path) -> None: ...
    def write_csv(self, path: _Path) -> None: ...
    def write_per_captor(self, folder: _Path) -> None: ...
    def summary(self, width: int) -> tuple[str, list[str]]: ...
    def mix(
        self, factors: list[tuple[str, float | list[float]]], calibration: str | None = None
    ) -> Found: ...
    def even(
        self,
        captors: str,
        watts: dict[str, float],
        mean: float | None = None,
        minimum: float | None = None,
        band: str | None = None,
        groups: list[str] = ...,
    ) -> str: ...
    def compare(self, other: Found, width: int) -> tuple[str, str, list[str], int, float, bool, bool]: ...
    def ids(self, groups: bool) -> list[str]: ...
    def arrays(self, groups: bool, light: int | None = None) -> dict[str, Any]: ...
    def places(self) -> dict[str, Any]: ...
    def nearest(self) -> dict[str, Any]: ...
