"""Makes meshes of triangles from other forms: arrays, dictionaries, trimesh, PyVista, PlantGL."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import missing, say, wrong
from .values import Floats, finite, first_twice, is_masked, is_missing, numbers, plain
from .values import name as checked

Ints = npt.NDArray[np.int64]

#: the most sensors of a grid, of which some may be left out before a scene takes the others
_MOST = 100_000_000


@dataclass(frozen=True)
class Group:
    """The triangles ``start`` to ``stop`` of a mesh, under one name; material: the name of one in the scene, or None."""

    name: str | None
    material: str | None
    start: int
    stop: int


@dataclass(frozen=True)
class Mesh:
    """Triangles in named groups, as in an OBJ file.

    Attributes:
        vertices: (n, 3), in the scene's unit of length.
        faces: (m, 3), the corners of each triangle, counter-clockwise seen from the front.
        groups: the name and the triangles of each group.
    """

    vertices: Floats
    faces: Ints
    groups: tuple[Group, ...]

    def parts(self, name: str) -> tuple[str, Floats, Ints, list[tuple[str | None, str | None, int, int]]]:
        """Returns the mesh in the form that the native part takes."""
        # what comes from another process may lie at any place in memory
        vertices = np.require(self.vertices, np.float64, ["C", "A"])
        faces = np.require(self.faces, np.int64, ["C", "A"])
        return name, vertices, faces, [(g.name, g.material, g.start, g.stop) for g in self.groups]


def mesh(geometry: Any, place: str = "mesh", group: str | None = None) -> Mesh:
    """Makes a mesh from any of the forms that `Scene.add` takes. Errors name ``place``. Triangles without a name of
    their own form a group with the name ``group``."""
    if isinstance(geometry, Mesh):
        for part in geometry.groups:
            for own, what in ((part.name, "a group"), (part.material, "a material")):
                if own is not None:
                    checked(own, place, what)
        return geometry
    named = list(_named(geometry, place))
    if not named:
        raise wrong(place, "has no triangle", "give it one, or leave the object out")
    vertices, faces, groups = [], [], []
    before = triangles = 0
    for name, (own_vertices, own_faces) in named:
        if name is not None:
            checked(name, place, "a group")
        vertices.append(own_vertices)
        faces.append(own_faces + before)
        groups.append(Group(group if name is None else name, None, triangles, triangles + len(own_faces)))
        before += len(own_vertices)
        triangles += len(own_faces)
    return Mesh(np.concatenate(vertices), np.concatenate(faces), tuple(groups))


def grid(x: Any, y: Any, z: Any, radius: float, normal: Iterable[float] = (0.0, 0.0, 1.0)) -> Floats:
    """Returns sensors in a grid: a disc at each of the places (x, y, z), for ``Scene.captor(name, discs=...)``.

    Args:
        x, y, z: coordinates in the scene's unit, each a number or a list; the last one changes first.
        radius: radius of every disc, in the scene's unit.
        normal: direction that the fronts of the discs face; (0, 0, 1) is up.

    Returns:
        (n, 7): x, y, z, radius, nx, ny, nz of each disc.

    >>> grid([0, 1], 2, [3, 4], radius=0.1)[:, :4]
    array([[0. , 2. , 3. , 0.1],
           [0. , 2. , 4. , 0.1],
           [1. , 2. , 3. , 0.1],
           [1. , 2. , 4. , 0.1]])
    """
    facing = numbers(plain(normal, "grid: normal"), "grid", "a normal").ravel()
    if len(facing) != 3:
        raise wrong("grid", f"a normal of {len(facing)} numbers", "it has three: x, y and z")
    axes = [np.atleast_1d(numbers(values, "grid", axis)).ravel() for axis, values in zip("xyz", (x, y, z))]
    count = math.prod(len(axis) for axis in axes)
    if count > _MOST:
        raise wrong("grid", f"{count:.3g} sensors, must be at most {_MOST:.0e}", "give fewer coordinates")
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    rest = np.broadcast_to([finite(radius, "grid: radius"), *facing], (len(places), 4))
    return np.hstack([places, rest])


def _named(geometry: Any, place: str) -> Iterable[tuple[str | None, tuple[Floats, Ints]]]:
    """Yields the names of groups with their vertices and faces."""
    if isinstance(geometry, Mapping):
        if any(map(is_missing, geometry)):
            raise wrong(place, "an id that has no value", "give each one, or leave it out")
        names = [str(key) for key in geometry]
        twice = first_twice(names)
        if twice is not None:
            raise wrong(place, f"two ids that are {twice!r} as text", "give each its own")
        for name, value in zip(names, geometry.values(), strict=True):
            for _, arrays in _named(value, f"{place}/{name}"):
                yield name, arrays
    elif hasattr(geometry, "todict") and not hasattr(geometry, "faces"):
        yield from _plantgl(geometry, place)
    elif hasattr(geometry, "graph") and hasattr(geometry, "geometry"):
        # a scene of trimesh: its graph says where each geometry is placed
        for node in geometry.graph.nodes_geometry:
            matrix, key = geometry.graph[node]
            part = geometry.geometry[key]
            if hasattr(part, "faces"):
                vertices, faces = _arrays(part.vertices, part.faces, place)
                matrix = np.asarray(matrix, dtype=np.float64)
                # a mirrored part keeps its fronts, so its corners run the other way
                mirrored = np.linalg.det(matrix[:3, :3]) < 0
                yield str(node), (vertices @ matrix[:3, :3].T + matrix[:3, 3], _turned(faces, mirrored))
            else:
                say(f"{place}: the part {str(node)!r} has no faces (it is a {type(part).__name__}), and is left out")
    elif hasattr(geometry, "vertices") and hasattr(geometry, "faces"):
        yield None, _arrays(geometry.vertices, geometry.faces, place)
    elif hasattr(geometry, "points") and hasattr(geometry, "triangulate"):
        surface = geometry if hasattr(geometry, "faces") else geometry.extract_surface()
        surface = surface.triangulate()
        yield None, _arrays(surface.points, np.asarray(surface.faces).reshape(-1, 4)[:, 1:], place)
    elif hasattr(geometry, "combine") and hasattr(geometry, "keys"):
        # a PyVista MultiBlock
        # blocks may have no name, or the same one
        names = [f"block{i}" if key is None else str(key) for i, key in enumerate(geometry.keys())]
        twice = first_twice(names)
        if twice is not None:
            raise wrong(place, f"two blocks named {twice!r}", "give each a name of its own")
        for i, name in enumerate(names):
            block = geometry[i]
            if block is not None:
                for _, arrays in _named(block, f"{place}/{name}"):
                    yield name, arrays
    elif isinstance(geometry, tuple) and len(geometry) == 2 and np.ndim(geometry[0]) == 2:
        yield None, _arrays(*geometry, place)
    else:
        yield None, _triangles(geometry, place)


def _turned(faces: Ints, turn: bool) -> Ints:
    """Returns the faces with their corners in the opposite order, if they are to be turned."""
    return np.ascontiguousarray(faces[:, ::-1]) if turn else faces


def _arrays(vertices: Any, faces: Any, place: str) -> tuple[Floats, Ints]:
    points = _numbers(vertices, place, "vertices")
    corners = _whole(faces, place)
    if points.ndim != 2 or points.shape[1] != 3:
        raise wrong(place, f"vertices of shape {points.shape}", "they must be (n, 3)")
    if corners.ndim != 2 or corners.shape[1] != 3:
        raise wrong(place, f"faces of shape {corners.shape}", "they must be (m, 3): cut polygons into triangles")
    if not np.issubdtype(corners.dtype, np.integer):
        raise wrong(place, f"faces of type {corners.dtype}", "corners are whole numbers, counted from 0")
    indices = np.ascontiguousarray(corners, dtype=np.int64)
    if indices.size and (indices.min() < 0 or indices.max() >= len(points)):
        bad = int(np.argmax(((indices < 0) | (indices >= len(points))).any(axis=1)))
        problem = f"face {bad} has the corners {indices[bad].tolist()}, but there are {len(points)} vertices"
        raise wrong(place, problem, "corners are counted from 0")
    return np.ascontiguousarray(points), indices


def _triangles(triangles: Any, place: str) -> tuple[Floats, Ints]:
    """Makes vertices and faces of a list of triangles with three points each, the form that CARIBU uses."""
    points = _numbers(triangles, place, "triangles")
    if points.ndim == 2 and points.shape == (3, 3):
        points = points[np.newaxis]
    if points.ndim != 3 or points.shape[1:] != (3, 3):
        remedy = "give (vertices, faces), triangles of shape (n, 3, 3), {name: triangles}, or a mesh of trimesh"
        raise wrong(place, f"triangles of shape {points.shape}", remedy)
    return np.ascontiguousarray(points.reshape(-1, 3)), np.arange(3 * len(points), dtype=np.int64).reshape(-1, 3)


def _numbers(values: Any, place: str, what: str) -> Floats:
    if isinstance(values, (str, bytes)):
        raise wrong(place, f"{values!r} is no mesh", "a path is a text that stands alone, as in add(name, 'room.obj')")
    return numbers(values, place, what)


def _whole(faces: Any, place: str) -> npt.NDArray[Any]:
    """Returns the corners of faces, which must be whole numbers."""
    if is_masked(faces):
        raise wrong(place, "faces of which some are masked", "leave these out")
    try:
        corners = np.asarray(faces)
    except (TypeError, ValueError) as error:
        raise wrong(place, f"faces that are no numbers ({error})", "they must be (m, 3)") from None
    if corners.dtype == object and all(isinstance(corner, (int, np.integer)) for corner in corners.flat):
        # a number beyond all integers of 64 bits is beyond all vertices, too
        corners = np.clip(corners, -1, np.iinfo(np.int64).max).astype(np.int64)
    return corners


def _plantgl(scene: Any, place: str) -> Iterable[tuple[str, tuple[Floats, Ints]]]:
    """Yields the shapes of a PlantGL scene, by their ids."""
    try:
        from openalea.plantgl.all import Tesselator
    except ImportError:
        raise missing("openalea.plantgl", "a PlantGL scene") from None
    tesselator = Tesselator()
    for key, shapes in scene.todict().items():
        for shape in shapes if isinstance(shapes, (list, tuple)) else [shapes]:
            shape.apply(tesselator)
            found = tesselator.triangulation
            points = [tuple(point) for point in found.pointList]
            vertices, faces = _arrays(points, [tuple(index) for index in found.indexList], f"{place}/{key}")
            # corners that run clockwise seen from the front, or a mirrored shape: not both
            clockwise = not getattr(found, "ccw", True)
            yield str(key), (vertices, _turned(faces, clockwise != _mirrored(shape)))


def _mirrored(shape: Any) -> bool:
    """Whether the scalings around a shape of PlantGL mirror it: they leave the order of its corners as it is."""
    mirrored, part = False, getattr(shape, "geometry", None)
    # each transformation holds what it applies to
    for _ in range(1000):
        scale = getattr(part, "scale", None)
        if scale is not None:
            mirrored ^= bool(np.prod([float(factor) for factor in scale]) < 0)
        part = getattr(part, "geometry", None)
        if part is None:
            break
    return mirrored
