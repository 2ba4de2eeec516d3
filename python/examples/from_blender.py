"""Calculates how much light each object of a Blender file receives.

Needs Blender, or its module: `pip install bpy`. Inside Blender: `blender plant.blend --background --python
from_blender.py`, with phylux installed into Blender's Python. Outside Blender: `python from_blender.py plant.blend`.

Each mesh object becomes a captor with the name that it has in Blender. Objects with a material whose name begins with
`leaf` are leaves, all others are grey. As in phylux, lengths in Blender are metres, and z points up.
"""

import sys

import bpy
import numpy as np

import phylux as px


def mesh(thing, graph):
    """Returns the vertices and triangles of an object as it is shown, in world coordinates."""
    shown = thing.evaluated_get(graph)
    data = shown.to_mesh()
    data.calc_loop_triangles()
    vertices = np.empty(3 * len(data.vertices))
    data.vertices.foreach_get("co", vertices)
    corners = np.empty(3 * len(data.loop_triangles), dtype=np.int32)
    data.loop_triangles.foreach_get("vertices", corners)
    shown.to_mesh_clear()
    matrix = np.array(thing.matrix_world)
    return vertices.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3], corners.reshape(-1, 3)


def scene():
    """Makes a scene of the open file, with its point lights; a lamp of 1 W in Blender emits 1 W here."""
    made = px.Scene(bpy.context.scene.name)
    made.material("leaf", type="leaf", reflectance=0.07, transmittance=0.04)
    made.material("grey", type="lambert", reflectance=0.5)
    graph = bpy.context.evaluated_depsgraph_get()
    for thing in bpy.context.scene.objects:
        if thing.type == "MESH":
            material = thing.active_material.name if thing.active_material else ""
            made.add(thing.name, mesh(thing, graph), material="leaf" if material.startswith("leaf") else "grey", captor=True)
        elif thing.type == "LIGHT" and thing.data.type == "POINT":
            made.light(thing.name, type="point", position=list(thing.matrix_world.translation), power=thing.data.energy)
    return made


def main(arguments):
    if arguments:
        bpy.ops.wm.open_mainfile(filepath=arguments[0])
    found = scene().run(photons=1e6, k=0)
    for name, front, error in zip(found.ids, found.irradiance[:, 0, 0], found.irradiance_se[:, 0, 0]):
        print(f"{name:<24} {front:.3f} +- {error:.3f} {found.unit['irradiance']}")
    return found


if __name__ == "__main__":
    main([argument for argument in sys.argv[1:] if argument.endswith(".blend")])
