"""A phylux scene in Mitsuba (import after `mitsuba.set_variant`)."""

import mitsuba as mi
import numpy as np

import materials


def build(world, bands, more=None):
    """The scene for some bands, as many as the variant has channels, and what else is to be in it."""
    at_bands = lambda value: np.broadcast_to(np.asarray(value, float), (len(world.bands),))[bands]
    objects = {"type": "scene", **(more or {})}
    for number, (name, triangles) in enumerate(world.surfaces.items()):
        bsdf = materials.bsdf(name, world.materials[name], at_bands)
        objects[f"surface{number}"] = mesh(triangles, bsdf)
    black = mi.load_dict({"type": "diffuse", "reflectance": materials.colour([0.0] * len(bands))})
    for number, lamp in enumerate(world.lamps):
        radiance = lamp.power[bands] / (np.pi * areas(lamp.triangles).sum())
        emitter = mi.load_dict({"type": "area", "radiance": materials.colour(radiance)})
        objects[f"lamp{number}"] = mesh(lamp.triangles, black, emitter)
    return mi.load_dict(objects)


def areas(triangles):
    """Areas of triangles (n, 3, 3)."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def mesh(triangles, bsdf, emitter=None):
    """Triangles without shared corners as one flat-shaded mesh."""
    props = mi.Properties()
    props["bsdf"] = bsdf
    if emitter is not None:
        props["emitter"] = emitter
    result = mi.Mesh("triangles", 3 * len(triangles), len(triangles), props=props)
    params = mi.traverse(result)
    params["vertex_positions"] = mi.Float(triangles.ravel())
    params["faces"] = mi.UInt32(np.arange(3 * len(triangles)))
    params.update()
    return result
