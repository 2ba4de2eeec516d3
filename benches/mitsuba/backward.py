"""Backward paths in Mitsuba, from all captors in one launch (import after `mitsuba.set_variant`).

The algorithm is that of its `path` integrator (light sampling and multiple importance sampling at each
vertex, Russian roulette from the third: cheapest here), with the captor as a first vertex of its own: an
`irradiancemeter` before `path` would not sample the lamps there.
"""

import drjit as dr
import mitsuba as mi
import numpy as np

from build import areas, build

ROULETTE = 3  # roulette from this vertex on


class Backward:
    """Paths from the captors for some bands."""

    def __init__(self, world, bands, sampler):
        self.scene = build(world, bands)
        self.faces = Faces(world.faces)
        self.sampler = mi.load_dict({"type": sampler})

    def render(self, samples, seed):
        """Mean irradiance per face and channel, with so many paths from each face."""
        self.sampler.set_sample_count(samples)
        self.sampler.set_samples_per_wavefront(samples)
        self.sampler.seed(seed, len(self.faces) * samples)
        found = self.paths(samples)
        totals = [dr.block_sum(channel, samples) for channel in found]
        dr.eval(*totals)
        dr.sync_thread()
        return np.stack([np.array(total) for total in totals], axis=1) / samples

    def paths(self, samples):
        """The irradiance that each path finds."""
        scene, sampler = self.scene, self.sampler
        face = dr.arange(mi.UInt32, len(self.faces) * samples) // samples
        start, frame = self.faces.start(face, sampler)
        to_lamp, light = scene.sample_emitter_direction(start, sampler.next_2d(), True)
        cos = dr.maximum(dr.dot(to_lamp.d, frame.n), 0)
        weight = to_lamp.pdf / (to_lamp.pdf + cos / dr.pi)
        direct = dr.select(to_lamp.pdf > 0, light * cos * weight, 0)
        local = mi.warp.square_to_cosine_hemisphere(sampler.next_2d())
        ray = start.spawn_ray(frame.to_world(local))
        return direct + dr.pi * radiance(scene, sampler, start, ray, local.z / dr.pi)


@dr.syntax
def radiance(scene, sampler, start, ray, density):
    """Radiance along a ray whose direction was chosen with a density."""
    ctx = mi.BSDFContext()
    ray, prev = mi.Ray3f(ray), mi.Interaction3f(start)
    prev_pdf, prev_delta = mi.Float(density), mi.Bool(False)
    found, throughput = mi.Spectrum(0), mi.Spectrum(1)
    vertices, active = mi.UInt32(1), mi.Bool(True)
    while active:
        si = scene.ray_intersect(ray, active)
        hit = mi.DirectionSample3f(scene, si, prev)
        otherwise = scene.pdf_emitter_direction(prev, hit, ~prev_delta & active)
        weight = dr.select(prev_pdf > 0, prev_pdf / (prev_pdf + otherwise), 0)
        found += throughput * hit.emitter.eval(si, active) * weight
        active &= si.is_valid()

        bsdf = si.bsdf(ray)
        smooth = active & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
        to_lamp, light = scene.sample_emitter_direction(si, sampler.next_2d(), True, smooth)
        smooth &= to_lamp.pdf > 0
        value, pdf, next, factor = bsdf.eval_pdf_sample(
            ctx, si, si.to_local(to_lamp.d), sampler.next_1d(), sampler.next_2d(), active)
        share = dr.select(smooth, to_lamp.pdf / (to_lamp.pdf + pdf), 0)
        found += throughput * dr.select(smooth, value * light, 0) * share

        throughput *= factor
        ray = si.spawn_ray(si.to_world(next.wo))
        prev = mi.Interaction3f(si)
        prev_pdf = next.pdf
        prev_delta = mi.has_flag(next.sampled_type, mi.BSDFFlags.Delta)
        largest = dr.max(throughput)
        active &= largest > 0
        survival = dr.select(vertices >= ROULETTE, dr.minimum(largest, 0.95), 1)
        active &= sampler.next_1d() < survival
        throughput /= dr.maximum(survival, 1e-12)
        vertices += 1
    return found


class Faces:
    """The triangles of all faces, to start paths from."""

    def __init__(self, faces):
        self.count = len(faces)
        triangles = np.concatenate([face.triangles for face in faces])
        share = [np.cumsum(areas(face.triangles)) / areas(face.triangles).sum() for face in faces]
        # face number + share of its area so far
        self.upto = mi.Float(np.concatenate([number + part for number, part in enumerate(share)]))
        self.corners = [mi.Point3f(triangles[:, corner].T) for corner in range(3)]

    def __len__(self):
        return self.count

    def start(self, face, sampler):
        """Points uniform on their faces, with frames about the normals."""
        u = mi.Float(face) + dr.minimum(sampler.next_1d(), 0.99999)
        last = len(self.upto) - 1
        upto = self.upto
        triangle = dr.binary_search(0, last, lambda index: dr.gather(mi.Float, upto, index) <= u)
        a, b, c = (dr.gather(mi.Point3f, corner, triangle) for corner in self.corners)
        weights = mi.warp.square_to_uniform_triangle(sampler.next_2d())
        frame = mi.Frame3f(dr.normalize(dr.cross(b - a, c - a)))
        start = dr.zeros(mi.Interaction3f, dr.width(face))
        start.p = a + weights.x * (b - a) + weights.y * (c - a)
        start.n = frame.n
        return start, frame
