"""Optics of leaves from what they are made of."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from . import _native
from .values import finite


class LeafSpectra(NamedTuple):
    """What an integrating sphere measures of a leaf near normal incidence."""

    nm: npt.NDArray[np.float64]
    """wavelengths, each nm from 400 to 2500"""
    reflectance: npt.NDArray[np.float64]
    """share of the light that comes back, the reflection of the surface included"""
    transmittance: npt.NDArray[np.float64]
    """share of the light that passes"""


def prospect(
    n: float,
    chlorophyll: float,
    water: float,
    dry_matter: float,
    *,
    carotenoids: float = 0.0,
    anthocyanins: float = 0.0,
    brown: float = 0.0,
) -> LeafSpectra:
    """Computes the spectra of a leaf from its contents by PROSPECT-D (Feret et al. 2017).

    A leaf of a scene takes the same contents: ``scene.material("leaf", type="leaf", prospect={"n": 1.5, ...})``.

    >>> leaf = prospect(n=1.5, chlorophyll=40, carotenoids=8, water=0.01, dry_matter=0.009)
    >>> green = leaf.nm == 550
    >>> round(float(leaf.reflectance[green][0]), 3), round(float(leaf.transmittance[green][0]), 3)
    (0.151, 0.15)

    Args:
        n: structure parameter, the number of layers, 1 to 10; 1.2 to 2.5 in most leaves.
        chlorophyll: chlorophyll a and b, ug/cm2.
        water: cm, the same as g/cm2.
        dry_matter: g/cm2.
        carotenoids: ug/cm2.
        anthocyanins: ug/cm2.
        brown: brown pigments in arbitrary units, 0 (none) to about 1.

    Raises:
        InputError: ``n`` is not from 1 to 10, or an amount is negative or not finite.
    """
    contents = {"n": n, "chlorophyll": chlorophyll, "carotenoids": carotenoids, "anthocyanins": anthocyanins}
    contents |= {"brown": brown, "water": water, "dry_matter": dry_matter}
    return LeafSpectra(*_native.prospect([finite(value, f"prospect: {name}") for name, value in contents.items()]))
