"""Calculates how much light each organ of a plant from PlantGL or L-Py absorbs.

Needs openalea.plantgl, and openalea.lpy for L-systems: `mamba install -c openalea3 -c conda-forge openalea.lpy`.
`python from_plantgl.py` uses a plant with three leaves; `python from_plantgl.py plant.lpy` uses what an L-system draws.
"""

import sys

import phylux as px


def plant():
    """Returns a plant of three leaves of 10 cm around a stem of 30 cm, in cm; ids 0 (stem) to 3."""
    from openalea.plantgl.all import AxisRotated, Cylinder, Material, Scene, Shape, Translated, TriangleSet

    blade = TriangleSet([(0, 0, 0), (5, -2, 1), (10, 0, 0), (5, 2, 1)], [(0, 1, 2), (0, 2, 3)])
    shapes = [Shape(Cylinder(0.4, 30), Material(), 0)]
    for rank in range(1, 4):
        turned = AxisRotated((0, 0, 1), 2.4 * rank, blade)
        shapes.append(Shape(Translated(0, 0, 8 * rank, turned), Material(), rank))
    return Scene(shapes)


def lsystem(path):
    """Returns the geometry that the last step of an L-system draws."""
    from openalea.lpy import Lsystem

    system = Lsystem(path)
    return system.sceneInterpretation(system.derive())


def light(geometry):
    """Makes a scene of the plant under a lamp of 2 x 2 m, in cm."""
    scene = px.Scene("plant", unit="cm", quantity="umol/s", bands={"PAR": (400, 700)})
    scene.material("leaf", type="leaf", reflectance=0.07, transmittance=0.04)
    scene.add("plant", geometry, material="leaf", captor=True)
    corners = [[-100, -100, 150], [-100, 100, 150], [100, 100, 150], [100, -100, 150]]
    scene.light("lamp", type="area", vertices=corners, power=2000)
    return scene


def main(arguments):
    geometry = lsystem(arguments[0]) if arguments else plant()
    found = light(geometry).run(photons=1e6, k=0)
    for name, power, error in zip(found.ids, found.absorbed[:, 0], found.absorbed_se[:, 0]):
        print(f"{name:<12} absorbs {power:.4f} +- {error:.4f} umol/s")
    return found


if __name__ == "__main__":
    main(sys.argv[1:])
