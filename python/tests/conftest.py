"""Scenes that several tests use."""

import numpy as np
import pytest

import phylux as px

ROOM_VERTICES = np.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)], dtype=float)
_WALLS = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
ROOM_FACES = np.array([t for a, b, c, d in _WALLS for t in ([a, b, c], [a, c, d])])


def chamber() -> px.Scene:
    """Makes a room of 1 m with two leaves, two lights and four sensors."""
    scene = px.Scene("chamber", quantity="umol/s", bands={"blue": (400, 500), "red": (600, 700)}, sums={"PAR": ["blue", "red"]})
    scene.material("wall", type="lambert", reflectance=[0.70, 0.78])
    scene.material("leaf", type="leaf", reflectance=[0.05, 0.06], transmittance=[0.01, 0.03])
    scene.add("room", (ROOM_VERTICES, ROOM_FACES), material="wall")
    leaf = np.array([[-0.08, 0, 0], [0, -0.05, 0.02], [0.08, 0, 0], [0, 0.05, 0.02]])
    corners = np.array([[0, 1, 2], [0, 2, 3]])
    organs = {f"leaf{i}": (leaf + [0.1 * i, 0, 0.1 * i], corners) for i in range(2)}
    scene.add("plant", organs, material="leaf", captor="triangle", transform={"translate": [0.4, 0.5, 0.3]})
    scene.light("lamp", type="tube", start=[0.1, 0.5, 0.9], to=[0.9, 0.5, 0.9], radius=0.013, power=[20, 80])
    scene.light("spot", type="point", position=[0.5, 0.2, 0.8], power=[5, 5])
    scene.captor("grid", discs=px.grid([0.25, 0.75], [0.25, 0.75], z=0.1, radius=0.05), sides="both")
    return scene


@pytest.fixture
def scene() -> px.Scene:
    return chamber()


@pytest.fixture(scope="session")
def result() -> px.Result:
    """The result of 20,000 photons, split by light."""
    return chamber().run(photons=20_000, seed=1, by_light=True)
