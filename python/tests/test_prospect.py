"""PROSPECT-D against the package prosail, which its authors' code is compared with."""

import numpy as np
import pytest

import phylux as px


def test_two_hundred_random_leaves_are_those_of_prosail():
    prosail = pytest.importorskip("prosail")
    rng = np.random.default_rng(1)
    for _ in range(200):
        n = rng.uniform(1, 3)
        chlorophyll, carotenoids, anthocyanins = rng.uniform(0, 100), rng.uniform(0, 25), rng.uniform(0, 20)
        brown, water, dry_matter = rng.uniform(0, 1), rng.uniform(0.001, 0.05), rng.uniform(0.001, 0.03)
        found = px.prospect(n, chlorophyll, water, dry_matter, carotenoids=carotenoids, anthocyanins=anthocyanins, brown=brown)
        nm, reflectance, transmittance = prosail.run_prospect(
            n, chlorophyll, carotenoids, brown, water, dry_matter, ant=anthocyanins, prospect_version="D"
        )
        assert np.array_equal(found.nm, nm)
        assert np.abs(found.reflectance - reflectance).max() < 1e-4
        assert np.abs(found.transmittance - transmittance).max() < 1e-4
