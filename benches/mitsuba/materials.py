"""The materials of phylux in Mitsuba. Lambert and panes are its own; leaf and phong, which it lacks, are
written here and compiled into the same kernel as its own (import after `mitsuba.set_variant`)."""

import drjit as dr
import mitsuba as mi
import numpy as np

BOTH = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide


def colour(values):
    """A texture of as many values as the variant has channels."""
    if len(values) == 1:
        return {"type": "uniform", "value": float(values[0])}
    return {"type": "rgb", "value": [float(value) for value in values]}


def spectrum(values):
    """The same as numbers, kept out of the compiled kernel so that bands share it."""
    result = mi.UnpolarizedSpectrum(*(float(value) for value in values))
    dr.make_opaque(result)
    return result


def bsdf(name, material, at_bands):
    """The Mitsuba material; `at_bands` picks the values of the bands that are rendered."""
    kind = material["type"]
    value = lambda key, of=material: at_bands(of.get(key, material.get(key, 0)))
    if kind == "lambert":
        diffuse = {"type": "diffuse", "reflectance": colour(value("reflectance"))}
        return mi.load_dict({"type": "twosided", "bsdf": diffuse})
    if kind == "transparent" and material.get("thin"):
        return mi.load_dict({"type": "thindielectric", "int_ior": material["ior"], "ext_ior": 1.0,
                             "specular_transmittance": colour(at_bands(material.get("tint", 1)))})
    if kind == "phong" and "exponent" in material and not material.get("transmittance"):
        return Phong(value("reflectance"), value("specular"), material["exponent"])
    if kind == "leaf" and material.get("thin", True):
        faces = [(value("reflectance", of), value("transmittance", of))
                 for of in (material, material.get("back", {}))]
        return Leaf(material.get("ior", 1.425), *faces)
    raise SystemExit(f"material {name}: a {kind} of this form has no counterpart here")


class Leaf(mi.BSDF):
    """A cuticle over a sheet that reflects and transmits diffusely (docs/method.md)."""

    def __init__(self, ior, front, back):
        super().__init__(mi.Properties())
        self.ior = mi.Float(ior)
        dr.make_opaque(self.ior)
        f0 = ((ior - 1) / (ior + 1)) ** 2
        inside = lambda a: spectrum(np.clip(np.asarray(a) / (1 - f0), 0, 1))
        self.r = [inside(np.asarray(r) - f0) for r, _ in (front, back)]
        self.t = [inside(t) for _, t in (front, back)]
        cos = (np.arange(4096) + 0.5) / 4096
        mean = float(np.mean(2 * cos * np.array(mi.fresnel(mi.Float(cos), ior)[0])))
        self.out = mi.Float(1 / (1 - mean))
        dr.make_opaque(self.out)
        self.m_components = [mi.BSDFFlags.DeltaReflection | BOTH, mi.BSDFFlags.DiffuseReflection | BOTH,
                             mi.BSDFFlags.DiffuseTransmission | BOTH]
        self.m_flags = self.m_components[0] | self.m_components[1] | self.m_components[2]

    def lobes(self, ctx, si):
        """Mirrored fraction, and the diffuse ones: t belongs to the face that the light enters."""
        front = mi.Frame3f.cos_theta(si.wi) > 0
        enters = front if ctx.mode == mi.TransportMode.Importance else ~front
        f = mi.fresnel(dr.abs(mi.Frame3f.cos_theta(si.wi)), self.ior)[0]
        return f, dr.select(front, self.r[0], self.r[1]), dr.select(enters, self.t[0], self.t[1])

    def leaves(self, cos):
        return (1 - mi.fresnel(dr.abs(cos), self.ior)[0]) * self.out

    def sample(self, ctx, si, sample1, sample2, active=True):
        f, r, t = self.lobes(ctx, si)
        rest = 1 - f
        chance_r, chance_t = rest * dr.max(r), rest * dr.max(t)
        total = f + chance_r + chance_t
        u = sample1 * total
        mirror, reflect = u < f, u < f + chance_r
        side = mi.Float(dr.select(reflect, 1.0, -1.0)) * dr.sign(mi.Frame3f.cos_theta(si.wi))
        local = mi.warp.square_to_cosine_hemisphere(sample2)
        cos = local.z
        bs = mi.BSDFSample3f()
        bs.wo = dr.select(mirror, mi.reflect(si.wi), mi.Vector3f(local.x, local.y, local.z * side))
        bs.eta = 1.0
        bs.pdf = dr.select(mirror, f, dr.select(reflect, chance_r, chance_t) * cos / dr.pi) / total
        flag = lambda n: mi.UInt32(+self.m_components[n])
        bs.sampled_type = dr.select(mirror, flag(0), dr.select(reflect, flag(1), flag(2)))
        bs.sampled_component = dr.select(mirror, mi.UInt32(0), dr.select(reflect, mi.UInt32(1), mi.UInt32(2)))
        lobe = dr.select(reflect, r / dr.maximum(dr.max(r), 1e-9), t / dr.maximum(dr.max(t), 1e-9))
        weight = dr.select(mirror, mi.UnpolarizedSpectrum(total), lobe * total * self.leaves(cos))
        return bs, dr.select(active & (bs.pdf > 0), weight, 0)

    def eval(self, ctx, si, wo, active=True):
        return self.eval_pdf(ctx, si, wo, active)[0]

    def pdf(self, ctx, si, wo, active=True):
        return self.eval_pdf(ctx, si, wo, active)[1]

    def eval_pdf(self, ctx, si, wo, active=True):
        f, r, t = self.lobes(ctx, si)
        cos = mi.Frame3f.cos_theta(wo)
        same = cos * mi.Frame3f.cos_theta(si.wi) > 0
        lobe = dr.select(same, r, t)
        shape = dr.abs(cos) / dr.pi
        total = f + (1 - f) * (dr.max(r) + dr.max(t))
        value = lobe * ((1 - f) * self.leaves(cos) * shape)
        density = (1 - f) * dr.max(lobe) * shape / total
        return dr.select(active, value, 0), dr.select(active, density, 0)

    def to_string(self):
        return "Leaf[]"


class Phong(mi.BSDF):
    """Lambert and a lobe ks (n+2) / (2 pi) cos^n about the mirror direction, alike on both faces."""

    def __init__(self, diffuse, specular, exponent):
        super().__init__(mi.Properties())
        self.diffuse, self.specular = spectrum(diffuse), spectrum(specular)
        self.n = mi.Float(exponent)
        dr.make_opaque(self.n)
        self.m_components = [mi.BSDFFlags.DiffuseReflection | BOTH, mi.BSDFFlags.GlossyReflection | BOTH]
        self.m_flags = self.m_components[0] | self.m_components[1]

    def sample(self, ctx, si, sample1, sample2, active=True):
        chance = dr.max(self.specular) / (dr.max(self.specular) + dr.max(self.diffuse))
        glossy = sample1 < chance
        local = mi.warp.square_to_cosine_hemisphere(sample2)
        local.z *= dr.sign(mi.Frame3f.cos_theta(si.wi))
        cos = sample2.x ** (1 / (self.n + 1))
        sin = dr.safe_sqrt(1 - cos * cos)
        turn_sin, turn_cos = dr.sincos(dr.two_pi * sample2.y)
        lobe = mi.Frame3f(mi.reflect(si.wi)).to_world(mi.Vector3f(sin * turn_cos, sin * turn_sin, cos))
        bs = mi.BSDFSample3f()
        bs.wo = dr.select(glossy, lobe, local)
        bs.eta = 1.0
        flag = lambda n: mi.UInt32(+self.m_components[n])
        bs.sampled_type = dr.select(glossy, flag(1), flag(0))
        bs.sampled_component = dr.select(glossy, mi.UInt32(1), mi.UInt32(0))
        value, bs.pdf = self.eval_pdf(ctx, si, bs.wo, active)
        return bs, dr.select(bs.pdf > 0, value / bs.pdf, 0)

    def eval(self, ctx, si, wo, active=True):
        return self.eval_pdf(ctx, si, wo, active)[0]

    def pdf(self, ctx, si, wo, active=True):
        return self.eval_pdf(ctx, si, wo, active)[1]

    def eval_pdf(self, ctx, si, wo, active=True):
        cos = mi.Frame3f.cos_theta(wo)
        active = active & (cos * mi.Frame3f.cos_theta(si.wi) > 0)
        chance = dr.max(self.specular) / (dr.max(self.specular) + dr.max(self.diffuse))
        lobe = dr.maximum(dr.dot(wo, mi.reflect(si.wi)), 0) ** self.n / dr.two_pi
        value = (self.diffuse / dr.pi + self.specular * (self.n + 2) * lobe) * dr.abs(cos)
        density = (1 - chance) * dr.abs(cos) / dr.pi + chance * (self.n + 1) * lobe
        return dr.select(active, value, 0), dr.select(active, density, 0)

    def to_string(self):
        return "Phong[]"
