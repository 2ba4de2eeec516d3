//! What a viewpoint sees: rays go on through panes and glass and by mirrors, both ways where light does
//! (Whitted, Communications of the ACM 23 (6), 1980), and see lamps; where a surface scatters, light is gathered, or the
//! photons there tell how bright it is.

use std::ops::{AddAssign, Mul};

use super::viewpoint::Viewpoint;
use crate::{
    math::{
        geometry::Ray,
        rng::Stream,
        spectrum::{Lanes, Spectrum},
    },
    scene::{
        light::LightHit,
        material::{Interaction, LobeKind, Material, Transport},
        world::{Surface, SurfaceHit},
    },
    transport::surface_light::SurfaceLight,
};

/// Surfaces on a ray's way after which it is given up.
const MOST_SURFACES: u32 = 100;
/// Radiance along camera rays.
pub(super) struct Whitted<'a> {
    pub light: &'a SurfaceLight<'a>,
    pub viewpoint: &'a Viewpoint<'a>,
}

/// What is found along a ray, per band: radiance, W/m2/sr or umol/m2/s/sr, or what arrives or is absorbed, W/m2 or umol/m2/s.
pub(super) struct Found<L> {
    /// All of it.
    pub value: Spectrum<L>,
    /// Standard error of what of it the nearest photons tell: this noise is alike in pixels side by side.
    pub deviation: Spectrum<L>,
    /// What of it was gathered: its noise is each ray's own.
    pub gathered: Spectrum<L>,
}

impl<L: Lanes> Found<L> {
    /// What the nearest photons tell with a relative standard error.
    pub fn told(told: Spectrum<L>, error: f32) -> Self {
        Self { deviation: told.clone().scaled(error), gathered: told.zero(), value: told }
    }

    /// The same and what was gathered.
    pub fn with(self, gathered: Spectrum<L>) -> Self {
        Self { value: self.value + &gathered, gathered, ..self }
    }

    /// In a band what was found, the standard error of what photons tell, and what was gathered.
    pub fn in_band(&self, band: usize) -> [f32; 3] {
        [&self.value, &self.deviation, &self.gathered].map(|found| found.values()[band])
    }
}

impl<L: Lanes> Mul<&Spectrum<L>> for Found<L> {
    type Output = Self;

    fn mul(self, share: &Spectrum<L>) -> Self {
        let Self { value, deviation, gathered } = self;
        Self { value: value * share, deviation: deviation * share, gathered: gathered * share }
    }
}

impl<L: Lanes> AddAssign for Found<L> {
    fn add_assign(&mut self, other: Self) {
        self.value += other.value;
        self.deviation += other.deviation;
        self.gathered += other.gathered;
    }
}

/// A ray on its way, and what it carries of what it will find.
pub(super) struct Way<L> {
    pub ray: Ray,
    throughput: Spectrum<L>,
    surfaces: u32,
    /// Its length from its start, m.
    length: f32,
    /// Whether it started at the viewpoint.
    from_eye: bool,
    /// Whether it comes straight from its start.
    pub straight: bool,
    /// What it carries if it goes on where it carries less than that: by chance.
    small: f32,
}

impl<L: Lanes> Way<L> {
    pub fn new(ray: Ray, lanes: usize, from_eye: bool, small: f32) -> Self {
        let throughput = Spectrum::splat(lanes, 1.0);
        Self { ray, throughput, surfaces: 0, length: 0.0, from_eye, straight: true, small }
    }
}

/// A place that scatters, as seen along a ray.
pub(super) struct Place<'a> {
    pub hit: SurfaceHit,
    pub surface: &'a Surface,
    /// What it is of.
    pub material: &'a Material,
    pub interaction: Interaction,
    /// Length of the ray's way, m.
    pub length: f32,
    /// The largest share over bands that is seen of it.
    pub share: f32,
}

impl Whitted<'_> {
    /// Follows a ray both ways at every smooth surface and sums what is `seen` where it is scattered,
    /// and the lights on its way as much as they count.
    pub fn follow<L: Lanes>(
        &self,
        start: Way<L>,
        rng: &mut Stream,
        share: impl Fn(&Way<L>, &LightHit) -> f32,
        mut seen: impl FnMut(&Place, &mut Stream) -> Found<L>,
    ) -> Found<L> {
        let scene = self.light.scene;
        let zero = || start.throughput.zero();
        let mut sum = Found { value: zero(), deviation: zero(), gathered: zero() };
        let mut ways = vec![start];
        while let Some(way) = ways.pop() {
            let Way { ray, ref throughput, surfaces, length, from_eye, straight, small } = way;
            let hit = if from_eye && straight {
                self.viewpoint.closest(&ray)
            } else {
                scene.closest(&ray)
            };
            // a light with a material lies in a surface: reach as far as its lift
            let t_max = hit.map_or(f32::INFINITY, |hit| hit.t + scene.ray_offset());
            scene.lights_met(&ray, t_max, |hit| {
                let met = scene.lights[hit.light].radiance::<L>(&ray, hit.on.as_ref());
                sum.value += met.scaled(share(&way, &hit)) * throughput;
            });
            let Some(hit) = hit else { continue };
            let surface = scene.surface(hit.triangle);
            let material = scene.material(surface);
            let interaction = Interaction::new(ray.direction, surface.normal).on(hit.triangle);
            let length = length + hit.t;
            if material.is_diffuse() {
                let share = throughput.largest();
                let place = Place { hit, surface, material, interaction, length, share };
                sum += seen(&place, rng) * throughput;
            }
            if surfaces == MOST_SURFACES {
                continue;
            }
            let smooth = material.smooth_ways::<L>(&interaction, Transport::Importance);
            for scatter in smooth.into_iter().flatten() {
                let throughput = scatter.weight * throughput;
                let chance = (throughput.largest() / small).min(1.0);
                if chance == 0.0 || (chance < 1.0 && rng.uniform() >= chance) {
                    continue;
                }
                let side =
                    if scatter.lobe.crosses() { -interaction.normal } else { interaction.normal };
                ways.push(Way {
                    ray: scene.leave(hit.point, side, scatter.direction),
                    throughput: throughput.scaled(1.0 / chance),
                    surfaces: surfaces + 1,
                    length,
                    from_eye,
                    straight: straight && scatter.lobe == LobeKind::Straight,
                    small,
                });
            }
        }
        sum
    }
}

pub(super) fn load<L: Lanes>(values: &[f64]) -> Spectrum<L> {
    Spectrum::from_fn(values.len(), |b| values.get(b).map_or(0.0, |v| *v as f32))
}
