//! What a viewpoint sees: rays go on through panes and glass and by mirrors, both ways where light does
//! (Whitted, Communications of the ACM 23 (6), 1980), and see lamps; where a surface scatters, the
//! photons there tell how bright it is.

use super::{
    shared::{PIXELS, Shared},
    viewpoint::Viewpoint,
};
use crate::{
    math::{geometry::Ray, rng::Stream, spectrum::Spectrum},
    scene::{
        material::{Interaction, LobeKind, Transport},
        world::{LightHit, Surface, SurfaceHit},
    },
    transport::{
        paths::{Joined, power},
        surface_light::SurfaceLight,
    },
};

/// Surfaces on a ray's way after which it is given up.
const MOST_SURFACES: u32 = 100;
/// A way that carries less than this goes on by chance, and counts for more where it does.
const SMALL: f32 = 0.005;

/// Radiance along camera rays.
pub(super) struct Whitted<'a, const N: usize> {
    pub light: &'a SurfaceLight<'a>,
    pub viewpoint: &'a Viewpoint<'a>,
}

/// A ray on its way, and what it carries of what it will find.
struct Way<const N: usize> {
    ray: Ray,
    throughput: Spectrum<N>,
    surfaces: u32,
    /// Its length from its start, m.
    length: f32,
    /// Whether it started at the viewpoint.
    from_eye: bool,
    /// Whether it comes straight from its start.
    straight: bool,
}

impl<const N: usize> Way<N> {
    fn new(ray: Ray, from_eye: bool) -> Self {
        Self { ray, throughput: Spectrum::ONE, surfaces: 0, length: 0.0, from_eye, straight: true }
    }
}

/// A place that scatters, as seen along a ray.
struct Place<'a> {
    hit: SurfaceHit,
    surface: &'a Surface,
    interaction: Interaction,
    /// How far another point may be that looks alike, m.
    reach: f32,
}

impl<const N: usize> Whitted<'_, N> {
    /// Radiance along a ray from the viewpoint.
    pub fn radiance(
        &self,
        ray: Ray,
        gather: u32,
        shared: &mut Shared,
        rng: &mut Stream,
    ) -> Spectrum<N> {
        let start = Way::new(ray, true);
        self.follow(
            start,
            rng,
            |_, _| 1.0,
            |way| {
                let lights = self.light.scene.infinite_lights();
                lights.fold(Spectrum::ZERO, |sum, (_, l)| sum + l.radiance(way.ray.direction))
            },
            |place, rng| match gather {
                0 => {
                    let front = place.interaction.front;
                    let find = || self.seen(place);
                    load(shared.value(&place.hit, front, place.reach, find))
                }
                _ => self.gathered(place, gather, rng),
            },
        )
    }

    /// Follows a ray both ways at every smooth surface and sums what is `seen` where it is scattered,
    /// and the lamps on its way as much as they count.
    fn follow(
        &self,
        start: Way<N>,
        rng: &mut Stream,
        lamp: impl Fn(&Way<N>, &LightHit) -> f32,
        sky: impl Fn(&Way<N>) -> Spectrum<N>,
        mut seen: impl FnMut(&Place, &mut Stream) -> Spectrum<N>,
    ) -> Spectrum<N> {
        let scene = self.light.scene;
        let mut radiance = Spectrum::ZERO;
        let mut ways = vec![start];
        while let Some(way) = ways.pop() {
            let Way { ray, throughput, surfaces, length, from_eye, straight } = way;
            let hit = if from_eye && straight {
                self.viewpoint.closest(&ray)
            } else {
                scene.closest(&ray)
            };
            // a light with a material lies in a surface: reach as far as its lift
            let t_max = hit.map_or(f32::INFINITY, |hit| hit.t + scene.ray_offset());
            scene.lights_hit(&ray, t_max, |hit| {
                let brightness = lamp(&way, &hit) * hit.shine.radiance;
                let power = power::<N>(&scene.lights[hit.light].power);
                radiance = radiance + throughput * power.scaled(brightness);
            });
            let Some(hit) = hit else {
                if scene.has_daylight() {
                    radiance = radiance + throughput * sky(&way);
                }
                continue;
            };
            let surface = scene.surface(hit.triangle);
            let material = scene.material(surface);
            let interaction = Interaction::new(ray.direction, surface.normal);
            let length = length + hit.t;
            if material.is_diffuse() {
                let reach = PIXELS * self.viewpoint.camera.pixel() * length;
                let place = Place { hit, surface, interaction, reach };
                radiance = radiance + throughput * seen(&place, rng);
            }
            if surfaces == MOST_SURFACES {
                continue;
            }
            let smooth = material.smooth_ways::<N>(&interaction, Transport::Importance);
            for scatter in smooth.into_iter().flatten() {
                let throughput = throughput * scatter.weight;
                let chance = (throughput.largest() / SMALL).min(1.0);
                if chance == 0.0 || (chance < 1.0 && rng.uniform() >= chance) {
                    continue;
                }
                let side = if scatter.crosses { -interaction.normal } else { interaction.normal };
                ways.push(Way {
                    ray: scene.leave(hit.point, side, scatter.direction),
                    throughput: throughput.scaled(1.0 / chance),
                    surfaces: surfaces + 1,
                    length,
                    from_eye,
                    straight: straight && scatter.lobe == LobeKind::Straight,
                });
            }
        }
        radiance
    }

    /// From the photons there.
    fn seen(&self, place: &Place) -> Vec<f64> {
        let outgoing = -place.interaction.direction;
        self.light.radiance(place.hit.triangle, place.hit.point, outgoing)
    }

    /// From the lamps, from photons that came by mirrors alone, and from the photons where other
    /// directions lead (Jensen, Realistic Image Synthesis Using Photon Mapping, 2001, ch. 8).
    fn gathered(&self, place: &Place, directions: u32, rng: &mut Stream) -> Spectrum<N> {
        let scene = self.light.scene;
        let Place { hit, surface, interaction, .. } = place;
        let outgoing = -interaction.direction;
        let material = scene.material(surface);
        let joined = Joined::new(scene, surface, *interaction, hit.point);
        // lamps by way of mirrors are left to photons
        let lamp = |way: &Way<N>, hit: &LightHit| {
            if way.straight { joined.weight(&way.ray, hit) } else { 0.0 }
        };
        let sky = |way: &Way<N>| match way.straight {
            true => joined.sky(way.ray.direction),
            false => Spectrum::ZERO,
        };
        let mut sum = Spectrum::ZERO;
        for _ in 0..directions {
            sum = sum + joined.radiance(rng);
            let scatter = material.sample::<N>(interaction, Transport::Importance, rng);
            let Some(scatter) = scatter.filter(|s| s.lobe == LobeKind::Diffuse) else { continue };
            let side = if scatter.crosses { -interaction.normal } else { interaction.normal };
            let ray = scene.leave(hit.point, side, scatter.direction);
            let start = Way::new(ray, false);
            let there = self.follow(start, rng, lamp, sky, |place, _| load(&self.seen(place)));
            sum = sum + scatter.weight * there;
        }
        let caustic = self.light.caustic_radiance(hit.triangle, hit.point, outgoing);
        load::<N>(&caustic) + sum.scaled(1.0 / directions as f32)
    }
}

fn load<const N: usize>(values: &[f64]) -> Spectrum<N> {
    Spectrum(std::array::from_fn(|b| values.get(b).map_or(0.0, |v| *v as f32)))
}
