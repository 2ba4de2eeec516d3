"""What is made of a scene, or of the scene of a result: pages, files for other programs, histories."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from . import _native
from .errors import missing, say, wrong
from .histories import Histories
from .values import arguments, count, span, text


def export(
    loaded: _native.Loaded,
    path: str | os.PathLike[str],
    found: _native.Found | None,
    *,
    trace: bool = True,
    quantity: str | None = None,
    band: str | None = None,
    range: tuple[float, float] | None = None,
    log: bool = False,
    threads: int | None = None,
) -> None:
    """Writes a scene and its light for other programs."""
    of = None if quantity is None else text(quantity, "quantity")
    if of not in (None, "irradiance", "absorbed"):
        raise wrong("quantity", f"no quantity `{of}`", "there are irradiance and absorbed")
    absorbed, ends = None if of is None else of == "absorbed", None if range is None else span(range, "range")
    of_band, at_once = None if band is None else text(band, "band"), None if threads is None else count(threads, "threads")
    loaded.export(os.fspath(path), found, bool(trace), at_once, absorbed, of_band, ends, bool(log))


def histories(
    loaded: _native.Loaded, given: Mapping[str, Any], progress: bool | Callable[[int, int | None], object]
) -> Histories:
    """Finds on which ways light reaches a captor."""
    with Progress(progress) as tell:
        report, warned = loaded.histories(arguments(given), tell)
    say(*warned)
    return Histories(report, warned)


def to_pyvista(loaded: _native.Loaded, found: _native.Found | None, *, trace: bool = True, threads: int | None = None) -> Any:
    """Returns a scene with its light as PolyData of PyVista."""
    try:
        import pyvista
    except ImportError:
        raise missing("pyvista", "PolyData") from None
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "scene.vtp")
        export(loaded, path, found, trace=trace, threads=threads)
        return pyvista.read(path)


class Progress:
    """Provides the function that is told the progress of a run, and closes its progress bar at the end."""

    def __init__(self, wanted: bool | Callable[[int, int | None], object]) -> None:
        self._wanted = wanted
        self._bar: Any = None

    def __enter__(self) -> Callable[[int, int | None], object] | None:
        if callable(self._wanted):
            return self._wanted
        if not self._wanted:
            return None
        try:
            from tqdm.auto import tqdm
        except ImportError:
            raise missing("tqdm", "progress=True") from None
        self._bar = tqdm(unit=" photons", unit_scale=True)
        return self._tell

    def _tell(self, done: int, of: int | None) -> None:
        if done < self._bar.n:
            # another part of the work has begun
            self._bar.reset()
        if of is not None:
            self._bar.total = of
        self._bar.update(done - self._bar.n)

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.close()


def view(
    loaded: _native.Loaded,
    path: Path,
    found: _native.Found | None,
    trace: bool,
    threads: int | None,
    to: str | None,
    inline: bool,
    width: int | str,
    height: int,
) -> Any:
    at_once, captor = None if threads is None else count(threads, "threads"), None if to is None else text(to, "to")
    loaded.view(path, found, bool(trace), at_once, captor)
    try:
        from IPython.display import HTML, IFrame
    except ImportError:
        return path
    if inline:
        from html import escape

        page = escape(path.read_text(encoding="utf-8"))
        return HTML(f'<iframe srcdoc="{page}" width="{width}" height="{height}" style="border:0"></iframe>')
    return IFrame(str(path), width, height)
