//! Emission into the scene, and the lights that a point or a ray of the scene sees.

use glam::Vec3;

use super::{Scene, Surface};
use crate::{
    math::{
        geometry::{Ray, closeness},
        rng::Stream,
        spectrum::{Lanes, Spectrum},
    },
    scene::{
        daylight::InfiniteLight,
        lattice::Lattice,
        light::{Emission, EmitterHit, Light, LightHit, LightSample, Strata, Toward},
        material::Scatterer,
    },
};

impl Scene {
    /// Emits history `index` of some strata. A photon of light that enters through openings keeps
    /// its power only if the way back to the sky meets neither a surface nor another opening;
    /// otherwise it has no power.
    #[inline(always)]
    pub fn emit<'s, L: Lanes>(
        &self,
        strata: &'s Strata,
        index: u64,
        rng: &mut Stream,
    ) -> Emission<'s, L> {
        self.admitted(strata.emit(&self.lighting.lights, index, rng))
    }

    #[inline(always)]
    fn admitted<'s, L: Lanes>(&self, mut emission: Emission<'s, L>) -> Emission<'s, L> {
        let Ray { origin, direction } = emission.ray;
        let back = Ray { origin, direction: -direction };
        if self.lighting.has_openings && !self.is_last_opening(emission.light, &back) {
            emission.power = Spectrum::splat(self.lanes(), 0.0);
        }
        emission
    }

    /// Returns whether the light at infinity of index `light` may start at the origin of `back`, a
    /// ray to the sky.
    #[cold]
    fn is_last_opening(&self, light: usize, back: &Ray) -> bool {
        let entrance =
            self.lighting.lights[light].entrance().filter(|entrance| entrance.has_openings());
        entrance.is_none_or(|_| {
            self.last_opening_in_cells(light, back, closeness(back.origin)).is_none()
                && self.closest(back).is_none()
        })
    }

    /// Returns whether a ray that meets no surface ends in the hill on whose side the cells of the
    /// scene lie, from where no light comes.
    pub fn ends_in_hill(&self, direction: Vec3) -> bool {
        self.lattice().is_some_and(Lattice::slopes) && !self.rises(direction)
    }

    /// Returns whether the light at infinity of index `light` arrives along a ray that leaves the
    /// scene. From below a slope comes none. If the light has openings, the ray must pass one of them
    /// towards the sky, and meet nothing beyond the last one.
    pub fn is_let_in(&self, light: usize, ray: &Ray) -> bool {
        if self.ends_in_hill(ray.direction) {
            return false;
        }
        let entrance =
            self.lighting.lights[light].entrance().filter(|entrance| entrance.has_openings());
        entrance.is_none_or(|_| match self.last_opening_in_cells(light, ray, 0.0) {
            Some((t, true)) => {
                let beyond = Ray { origin: ray.at(t), direction: ray.direction };
                self.closest(&beyond).is_none()
            }
            _ => false,
        })
    }

    /// Visits every light that a ray meets: before `t_max` the light surfaces that it meets on
    /// their bright side, in any order, and, if `t_max` is infinite, the lights at infinity that
    /// arrive along the ray.
    pub fn lights_met(&self, ray: &Ray, t_max: f32, mut visit: impl FnMut(LightHit)) {
        self.emitters_met(ray, t_max, |light, hit| visit(LightHit { light, on: Some(hit) }));
        if t_max == f32::INFINITY {
            let seen = self.lighting.infinite.iter().filter(|&&light| self.is_let_in(light, ray));
            seen.for_each(|&light| visit(LightHit { light, on: None }));
        }
    }

    /// Visits every light surface that a ray meets on its bright side before `t_max`, in any order.
    pub fn emitters_met(&self, ray: &Ray, t_max: f32, mut visit: impl FnMut(usize, EmitterHit)) {
        if let Some(repeats) = &self.shapes.repeats {
            return self.emitters_in_cells(repeats, ray, t_max, &mut visit);
        }
        self.lighting.tubes.near(ray, |light| {
            if let Some(hit) = self.lighting.lights[light].hit(ray).filter(|hit| hit.t < t_max) {
                visit(light, hit);
            }
        });
        if self.lighting.shapes.triangles.is_empty() {
            return;
        }
        self.lighting.shapes.bvh.crossings(ray, t_max, |hit| {
            if let Some((light, hit)) = self.emitter_hit(ray, hit.triangle, hit.t) {
                visit(light, hit);
            }
        });
    }

    /// Returns the light to which a triangle that a ray meets belongs, and how it shines there;
    /// `None` on its dark side.
    pub(super) fn emitter_hit(
        &self,
        ray: &Ray,
        triangle: u32,
        t: f32,
    ) -> Option<(usize, EmitterHit)> {
        let light = self.lighting.shapes.of_triangle[triangle as usize] as usize;
        let cos = -ray.direction.dot(self.lighting.shapes.triangles[triangle as usize].normal());
        let emitted = self.lighting.lights[light].emitted_radiance(ray.direction, cos)?;
        Some((light, EmitterHit { t, cos: cos.abs(), emitted, image: [0, 0] }))
    }

    /// Samples a direction in which `point` may see a light, as
    /// [`Light::sample_toward`](crate::scene::light::Light::sample_toward). In a scene that repeats
    /// it is that of any image of the light, chosen by chance.
    #[inline]
    pub fn sample_toward<L: Lanes>(
        &self,
        light: usize,
        point: Vec3,
        rng: &mut Stream,
    ) -> Option<LightSample<L>> {
        let light = &self.lighting.lights[light];
        match self.lattice() {
            Some(lattice) if light.entrance().is_none() => sample_image(lattice, light, point, rng),
            _ => light.sample_toward(point, rng),
        }
    }

    /// Returns the density, 1/sr, with which [`sample_toward`](Self::sample_toward) from `point`
    /// samples the direction of a ray that comes from there, straight or through panes, and meets a
    /// light.
    #[inline]
    pub fn pdf_toward(&self, point: Vec3, ray: &Ray, hit: &LightHit) -> f32 {
        let light = &self.lighting.lights[hit.light];
        let pdf = light.pdf_toward(point, ray, hit.on.as_ref());
        match (self.lattice(), &hit.on) {
            (Some(lattice), Some(on)) => {
                let (middle, radius) = light.ball();
                pdf * lattice.probability(point, middle, radius, on.image)
            }
            _ => pdf,
        }
    }

    /// Returns an estimate of the irradiance that a light brings to `point` per W of its power,
    /// 1/m2, as [`Light::importance`](crate::scene::light::Light::importance). Where the scene
    /// repeats it is never 0, as an image may shine where the light itself does not.
    #[inline]
    pub fn importance(&self, light: usize, point: Vec3, normal: Option<Vec3>) -> f32 {
        let light = &self.lighting.lights[light];
        match self.lattice().filter(|_| light.entrance().is_none()) {
            None => light.importance(point, normal),
            Some(lattice) => {
                let (middle, radius) = light.ball();
                let d2 = lattice.nearest_squared(point, middle);
                1.0 / d2.max(radius * radius).max(f32::MIN_POSITIVE)
                    + lattice.area().map_or(0.0, |area| (1.0 / area) as f32)
            }
        }
    }

    /// Returns the lights at infinity, with their indices.
    pub fn infinite_lights(&self) -> impl Iterator<Item = (usize, &InfiniteLight)> {
        let infinite = self.lighting.infinite.iter();
        infinite.filter_map(|&l| Some((l, &self.lighting.lights[l].entrance()?.light)))
    }

    /// Returns the fraction of light that goes straight from one point to another, per band: 1, or
    /// what thin panes and covers let through. `None` if something opaque is in between.
    pub fn visibility<L: Lanes>(&self, from: Vec3, to: Vec3) -> Option<Spectrum<L>> {
        let distance = from.distance(to);
        let ray = Ray { origin: from, direction: (to - from) / distance };
        self.visibility_along(&ray, distance)
    }

    /// Returns the same fraction for light that arrives along a ray from the light at infinity of
    /// index `light`.
    pub fn sky_visibility<L: Lanes>(&self, light: usize, ray: &Ray) -> Option<Spectrum<L>> {
        let visible = self.visibility_along(ray, f32::INFINITY)?;
        self.is_let_in(light, ray).then_some(visible)
    }

    /// Returns the same fraction along a ray, as far as `distance`, m, which may be infinite.
    pub fn visibility_along<L: Lanes>(&self, ray: &Ray, distance: f32) -> Option<Spectrum<L>> {
        if distance == f32::INFINITY && self.ends_in_hill(ray.direction) {
            return None;
        }
        let mut through = Spectrum::splat(self.lanes(), 1.0);
        let passes = self.passes_straight(ray, distance, |_, straight| {
            through = through.clone() * straight;
        });
        passes.then_some(through)
    }

    /// Returns whether light goes straight along a ray, as far as `distance`, m, which may be
    /// infinite. `pass` is told of each pane and cover on the way, in any order, with what it lets
    /// through.
    #[inline(always)]
    pub fn passes_straight<L: Lanes>(
        &self,
        ray: &Ray,
        distance: f32,
        mut pass: impl FnMut(&Surface, Spectrum<L>),
    ) -> bool {
        if !self.shapes.is_plain {
            return self.passes_in_pieces(ray, distance, &mut pass);
        }
        let occluded = self.shapes.surface_bvh.occluded(ray, distance, |hit| {
            let surface = &self.objects.surfaces[hit.triangle as usize];
            let straight = self.material(surface).straight::<L>(ray.direction, surface.normal);
            let Some(straight) = straight else { return true };
            // at the edge between two triangles of a pane only one of them counts
            if hit.owned {
                pass(surface, straight);
            }
            false
        });
        !occluded
    }
}

/// Samples a direction in which `point` may see any image of a light, chosen by chance.
#[cold]
#[inline(never)]
fn sample_image<L: Lanes>(
    lattice: &Lattice,
    light: &Light,
    point: Vec3,
    rng: &mut Stream,
) -> Option<LightSample<L>> {
    let (middle, radius) = light.ball();
    let cell = lattice.choose_image(point, middle, radius, rng);
    let shift = lattice.shift(cell).as_vec3();
    let chance = lattice.probability(point, middle, radius, cell);
    let sample = light.sample_toward::<L>(point - shift, rng)?;
    let target = match sample.target {
        Toward::Point { point, end } => Toward::Point { point: point + shift, end: end + shift },
        direction @ Toward::Direction(_) => direction,
    };
    Some(LightSample {
        target,
        radiance_over_pdf: sample.radiance_over_pdf.scaled(1.0 / chance),
        pdf: sample.pdf.map(|pdf| pdf * chance),
        per_watt: sample.per_watt / chance,
    })
}
