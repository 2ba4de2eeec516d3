"""Photons in Mitsuba: emitted by the lamps, scattered by the surfaces, counted where they cross captors
(import after `mitsuba.set_variant`).

Captors are invisible triangles of the scene: a photon that meets one is counted and goes straight on. Roulette as in
`backward.py`, by what is left of the photon's power.
"""

import drjit as dr
import mitsuba as mi
import numpy as np

from build import areas, build, mesh

ROULETTE = 3  # roulette from this surface on (1, 2, 3 and 5 tried: alike)
LIFT = 1e-3  # m; a ray that goes on from one captor starts beyond another at the same place
LAUNCH = 1 << 21  # photons at once, at most, so that they fit into memory


class Forward:
    """Photons for some bands."""

    def __init__(self, world, bands):
        self.captors = Captors(world.faces)
        self.scene = build(world, bands, {"captors": self.captors.mesh})
        self.sampler = mi.load_dict({"type": "independent"})

    def render(self, photons, seed):
        """Mean irradiance per face and channel, with so many photons from all lamps together."""
        launches = -(-photons // LAUNCH)
        lanes = photons // launches
        totals = self.captors.totals = [dr.zeros(mi.Float, self.captors.slots) for _ in mi.Spectrum(0)]
        for launch in range(launches):
            self.sampler.seed(seed * 1_000_003 + launch, lanes)
            trace(self.scene, self.sampler, self.captors)
            dr.eval(*totals)
        dr.sync_thread()
        power = np.stack([np.array(total) for total in totals], axis=1)[1:]
        return power / (launches * lanes) / self.captors.areas[:, None]


@dr.syntax
def trace(scene, sampler, captors):
    """Follows a photon in each lane."""
    ctx = mi.BSDFContext(mi.TransportMode.Importance)
    ray, power, _ = scene.sample_emitter_ray(
        mi.Float(0), sampler.next_1d(), sampler.next_2d(), sampler.next_2d(), mi.Bool(True))
    emitted = dr.max(power)
    surfaces, active = mi.UInt32(0), mi.Bool(True)
    while active:
        si = scene.ray_intersect(ray, active)
        active &= si.is_valid()
        captor = active & (si.shape == captors.shape)
        captors.count(si, power, captor)

        surface = active & ~captor
        bsdf = si.bsdf(ray)
        next, factor = bsdf.sample(ctx, si, sampler.next_1d(surface), sampler.next_2d(surface), surface)
        power[surface] = power * factor
        surfaces[surface] = surfaces + 1
        ray = si.spawn_ray(dr.select(captor, ray.d, si.to_world(next.wo)))
        left = dr.max(power) / emitted
        active &= left > 0
        survival = dr.select(surface & (surfaces >= ROULETTE), dr.minimum(left, 0.95), 1)
        active &= sampler.next_1d() < survival
        power /= dr.maximum(survival, 1e-12)


class Captors:
    """The triangles of all captors, each with the slots of its front and back: the number of the face + 1, or 0
    for a side that does not count."""

    def __init__(self, faces):
        fronts = [(number, face) for number, face in enumerate(faces) if face.name[1] == "front"]
        backs = {face.name[0]: number for number, face in enumerate(faces) if face.name[1] == "back"}
        sizes = [len(face.triangles) for _, face in fronts]
        slot = lambda numbers: mi.UInt32(np.repeat([number + 1 for number in numbers], sizes))
        self.front = slot(number for number, _ in fronts)
        self.back = slot(backs.get(face.name[0], -1) for _, face in fronts)
        triangles = [face.triangles if face.name[0] in backs else lifted(face) for _, face in fronts]
        self.mesh = mesh(np.concatenate(triangles), mi.load_dict({"type": "null"}))
        self.shape = mi.ShapePtr(self.mesh)
        self.areas = np.array([areas(face.triangles).sum() for face in faces])
        self.slots = 1 + len(faces)

    def count(self, si, power, active):
        """Adds what meets them to `totals`."""
        front = dr.gather(mi.UInt32, self.front, si.prim_index, active)
        back = dr.gather(mi.UInt32, self.back, si.prim_index, active)
        slot = dr.select(mi.Frame3f.cos_theta(si.wi) > 0, front, back)
        for total, part in zip(self.totals, power):
            dr.scatter_reduce(dr.ReduceOp.Add, total, part, slot, active)


def lifted(face):
    """Its triangles, a little to the side that counts."""
    a, b, c = face.triangles[0]
    normal = np.cross(b - a, c - a)
    return face.triangles + LIFT * normal / np.linalg.norm(normal)
