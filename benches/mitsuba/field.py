"""Canopies in Mitsuba: a cell that repeats as instances of itself around, sun and sky, and what leaves absorb
(import after `mitsuba.set_variant`).

Objects of copies are shape groups. Surfaces are described by numbers that the loops look up (`Sheets`), which is
faster than materials of Mitsuba; normals are general. Emission and counting are ours as in `forward.py`.
"""

import drjit as dr
import mitsuba as mi
import numpy as np

from build import mesh

ROULETTE = 3  # roulette from this surface on
LAUNCH = 1 << 21  # histories at once, at most, so that they fit into memory


class Field:
    """The cell of a `canopy.Canopy` with so many cells around it, for some bands."""

    def __init__(self, canopy, bands, around):
        self.canopy = canopy
        cells = range(-around, around + 1)
        self.sheets = Sheets([part.material for group in canopy.groups for part in group.parts],
                             len(canopy.bands), bands)
        objects, firsts, null = {"type": "scene"}, {}, mi.load_dict({"type": "null"})
        shapes = 0
        for number, group in enumerate(canopy.groups):
            meshes = {f"part{i}": mesh(part.triangles, null) for i, part in enumerate(group.parts)}
            objects[f"group{number}"] = {"type": "shapegroup", **meshes}
            for place, (matrix, first) in enumerate(zip(group.places, group.firsts)):
                for x in cells:
                    for y in cells:
                        name = f"i{number}_{place}_{x}_{y}"
                        shift = np.diag([1.0] * 4)
                        shift[:2, 3] = x * canopy.size[0], y * canopy.size[1]
                        objects[name] = {"type": "instance", "to_world": mi.ScalarTransform4f(shift @ matrix),
                                         "group": {"type": "ref", "id": f"group{number}"}}
                        firsts[name] = shapes, first, matrix
            shapes += len(group.parts)
        self.scene = mi.load_dict(objects)
        self.register(firsts)
        self.light = Light(canopy, bands)

    def register(self, firsts):
        """Tables by Mitsuba's numbers of instances, by shapes and by triangles: which captor is met, what it is
        made of, and its normal."""
        number = lambda shape: int(dr.reinterpret_array(mi.UInt32, mi.ShapePtr(shape))[0])
        instances = {number(shape): firsts[shape.id()] for shape in self.scene.shapes()}
        size = 1 + max(instances)
        shape, first, turn = np.zeros(size, np.uint32), np.zeros(size, np.uint32), np.zeros((size, 3, 3))
        for instance, (own_shape, own_first, matrix) in instances.items():
            shape[instance], first[instance] = own_shape, own_first
            turn[instance] = matrix[:3, :3] / np.cbrt(np.linalg.det(matrix[:3, :3]))
        parts = [part for group in self.canopy.groups for part in group.parts]
        base = np.cumsum([0] + [len(part.slots) for part in parts[:-1]])
        self.shape, self.first, self.base = mi.UInt32(shape), mi.UInt32(first), mi.UInt32(base)
        self.turn = mi.Float(turn.ravel())
        self.slots = mi.UInt32(np.concatenate([part.slots for part in parts]))
        self.normals = mi.Float(np.concatenate([normals(part.triangles) for part in parts]).ravel())

    def meet(self, ray, active):
        """What a ray meets next. The scene's `ray_intersect` compiles code for each instance; tables do not."""
        pi = self.scene.ray_intersect_preliminary(ray, False, active=active)
        active = active & pi.is_valid()
        instance = dr.reinterpret_array(mi.UInt32, pi.instance)
        shape = dr.gather(mi.UInt32, self.shape, instance, active) + pi.shape_index
        triangle = dr.gather(mi.UInt32, self.base, shape, active) + pi.prim_index
        turn = dr.gather(mi.Matrix3f, self.turn, instance, active)
        normal = turn @ dr.gather(mi.Vector3f, self.normals, triangle, active)
        met = Met(self.sheets, shape, normal, ray.d, active)
        met.place.p = ray(pi.t)
        own = dr.gather(mi.UInt32, self.slots, triangle, active)
        met.slot = dr.select(own > 0, own + dr.gather(mi.UInt32, self.first, instance, active), 0)
        return met, active


def normals(triangles):
    """Unit normals."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    across = np.cross(b - a, c - a)
    return across / np.linalg.norm(across, axis=1, keepdims=True)


class Sheets:
    """Thin sheets by number: what each face reflects and transmits below its cuticle, and the cuticle."""

    def __init__(self, materials, count, bands):
        r, t, iors = [], [], []
        for material in materials:
            ior = material.get("ior", 1.425) if material["type"] == "leaf" else 1.0
            f0 = ((ior - 1) / (ior + 1)) ** 2
            for of in (material, material.get("back", {})):
                at = lambda key: per_band(of.get(key, material.get(key, 0)), count)[bands]
                r.append((at("reflectance") - f0) / (1 - f0))
                t.append(at("transmittance") / (1 - f0))
            iors.append(ior)
        self.r, self.t = (mi.Float(np.array(values).clip(0, 1).ravel()) for values in (r, t))
        self.cuticle = any(ior != 1 for ior in iors)
        self.ior = mi.Float(iors)
        self.out = mi.Float([1 / (1 - mean_mirrored(ior)) for ior in iors])


def per_band(value, count):
    """One number for all bands, or one for each."""
    return np.broadcast_to(np.asarray(value, float), (count,))


def mean_mirrored(ior):
    """Of diffuse light."""
    cos = (np.arange(4096) + 0.5) / 4096
    return float(np.mean(2 * cos * np.array(mi.fresnel(mi.Float(cos), ior)[0]))) if ior != 1 else 0.0


class Met:
    """A sheet and the direction in which it is met, with the formulas of `materials.Leaf`."""

    def __init__(self, sheets, sheet, normal, direction, active):
        cos = -dr.dot(direction, normal)
        front = cos > 0
        self.cos = dr.abs(cos)
        self.place = dr.zeros(mi.Interaction3f)
        self.place.n = normal
        self.normal = dr.select(front, normal, -normal)
        at = 2 * sheet + dr.select(front, mi.UInt32(0), mi.UInt32(1))
        self.r = dr.gather(mi.Spectrum, sheets.r, at, active)
        self.t = dr.gather(mi.Spectrum, sheets.t, at, active)
        self.mirrored = mi.Float(0)
        self.sheets = sheets
        if sheets.cuticle:
            self.ior = dr.gather(mi.Float, sheets.ior, sheet, active)
            self.out = dr.gather(mi.Float, sheets.out, sheet, active)
            self.mirrored = mi.fresnel(self.cos, self.ior)[0]

    def absorbed(self):
        """The absorbed fraction of light that comes so."""
        return (1 - self.mirrored) * (1 - self.r - self.t)

    def leaves(self, cos):
        """How light leaves the sheet, by angle."""
        if not self.sheets.cuticle:
            return mi.Float(1)
        return (1 - mi.fresnel(dr.abs(cos), self.ior)[0]) * self.out

    def sample(self, incident, u, uv):
        """A direction, and what of the power goes there."""
        rest = 1 - self.mirrored
        r, t = rest * dr.max(self.r), rest * dr.max(self.t)
        total = self.mirrored + r + t
        at = u * total
        mirror, reflect = at < self.mirrored, at < self.mirrored + r
        local = mi.warp.square_to_cosine_hemisphere(uv)
        cos = local.z
        local.z = dr.select(reflect, cos, -cos)
        direction = mi.Frame3f(self.normal).to_world(local)
        lobe = dr.select(reflect, self.r / dr.maximum(dr.max(self.r), 1e-9),
                         self.t / dr.maximum(dr.max(self.t), 1e-9))
        weight = lobe * (total * self.leaves(cos))
        if self.sheets.cuticle:
            direction = dr.select(mirror, incident + 2 * self.cos * self.normal, direction)
            weight = dr.select(mirror, mi.Spectrum(total), weight)
        return direction, weight


class Light:
    """Sun and uniform sky."""

    def __init__(self, canopy, bands):
        self.sun = mi.Spectrum(*canopy.sun[bands].tolist())  # on a plane that faces it
        self.sky = mi.Spectrum(*(canopy.sky[bands] / np.pi).tolist())  # radiance
        dr.make_opaque(self.sun, self.sky)
        self.to_sun = mi.Vector3f(*canopy.to_sun.tolist())
        self.frame = mi.Frame3f(self.to_sun)
        self.cos = float(np.cos(canopy.half_angle))
        self.disc = canopy.half_angle > 0
        self.has_sky = bool(np.any(canopy.sky[bands]))
        self.size, self.top = canopy.size, canopy.top
        level = canopy.sun[bands] * canopy.to_sun[2]
        self.share = float(np.mean(level / (level + canopy.sky[bands])))

    def toward_sun(self, uv):
        """A direction to its disc."""
        if not self.disc:
            return self.to_sun
        return self.frame.to_world(mi.warp.square_to_uniform_cone(uv, self.cos))

    def strata(self, lanes):
        """Strata along each axis, for `emit`, of the photons of sun and of sky of a launch."""
        sides = [int((share * lanes) ** 0.5) for share in (self.share, 1 - self.share)]
        return sides if self.has_sky else [sides[0], 0]

    def emit(self, sampler, sides, strata):
        """Photons that come in by one cell above all leaves, their places in strata or at random; powers add up
        to the mean irradiance."""
        of_sun_and_sky = [mi.UInt32(max(side, 1)) for side in sides]
        dr.make_opaque(of_sun_and_sky)  # one kernel for any number
        suns, skies = (side * side for side in of_sun_and_sky)
        lane = dr.arange(mi.UInt32, sum(side * side for side in sides))
        of_sun = lane < suns if self.has_sky else mi.Bool(True)
        row = dr.select(of_sun, lane, lane - suns)
        side = dr.select(of_sun, *of_sun_and_sky)
        u, v = sampler.next_2d()
        if strata:
            u, v = ((row % side) + u) / side, ((row // side) + v) / side
        down = -self.toward_sun(sampler.next_2d())
        power = self.sun * (-down.z / suns)
        if self.has_sky:
            local = -mi.warp.square_to_cosine_hemisphere(sampler.next_2d())
            down = dr.select(of_sun, down, local)
            power = dr.select(of_sun, power, self.sky * (dr.pi / skies))
        return mi.Ray3f(mi.Point3f(u * self.size[0], v * self.size[1], self.top), down), power


class Forward:
    """Photons: what each captor absorbs, W."""

    def __init__(self, canopy, bands, around, strata=True):
        self.field = Field(canopy, bands, around)
        self.strata = strata
        self.captors = canopy.captors
        self.area = canopy.size[0] * canopy.size[1]
        self.sampler = mi.load_dict({"type": "independent"})

    def render(self, photons, seed):
        launches = -(-photons // LAUNCH)
        sides = self.field.light.strata(photons // launches)
        totals = [dr.zeros(mi.Float, 1 + len(self.captors)) for _ in mi.Spectrum(0)]
        for launch in range(launches):
            self.sampler.seed(seed * 1_000_003 + launch, sum(side * side for side in sides))
            photons_through(self.field, self.sampler, sides, self.strata, totals)
            dr.eval(*totals)
        dr.sync_thread()
        return np.stack([np.array(total) for total in totals], axis=1)[1:] * self.area / launches


@dr.syntax
def photons_through(field, sampler, sides, strata, totals):
    """Follows a photon in each lane."""
    ray, power = field.light.emit(sampler, sides, strata)
    emitted = dr.max(power)
    surfaces, active = mi.UInt32(0), mi.Bool(True)
    while active:
        met, hit = field.meet(ray, active)
        active &= hit
        taken = power * met.absorbed()
        for total, part in zip(totals, taken):
            dr.scatter_reduce(dr.ReduceOp.Add, total, part, met.slot, active)
        direction, weight = met.sample(ray.d, sampler.next_1d(active), sampler.next_2d(active))
        power *= weight
        surfaces += 1
        ray = met.place.spawn_ray(direction)
        left = dr.max(power) / emitted
        active &= left > 0
        survival = dr.select(surfaces >= ROULETTE, dr.minimum(left, 0.95), 1)
        active &= sampler.next_1d(active) < survival
        power /= dr.maximum(survival, 1e-12)
