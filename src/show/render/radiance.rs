//! What a viewpoint sees: rays go on through panes and glass and by mirrors, both ways where light does
//! (Whitted, Communications of the ACM 23 (6), 1980), and see lamps; where a surface scatters, the
//! photons there tell how bright it is.

use super::{
    shared::{PIXELS, Shared},
    viewpoint::Viewpoint,
};
use crate::{
    math::{
        geometry::Ray,
        rng::Stream,
        spectrum::{Lanes, Spectrum},
    },
    scene::{
        light::LightHit,
        material::{Interaction, LobeKind, Transport},
        world::{Surface, SurfaceHit},
    },
    transport::{paths::Joined, surface_light::SurfaceLight},
};

/// Surfaces on a ray's way after which it is given up.
const MOST_SURFACES: u32 = 100;
/// A way that carries less than this goes on by chance, and counts for more where it does.
const SMALL: f32 = 0.005;

/// Radiance along camera rays.
pub(super) struct Whitted<'a> {
    pub light: &'a SurfaceLight<'a>,
    pub viewpoint: &'a Viewpoint<'a>,
}

/// A ray on its way, and what it carries of what it will find.
struct Way<L> {
    ray: Ray,
    throughput: Spectrum<L>,
    surfaces: u32,
    /// Its length from its start, m.
    length: f32,
    /// Whether it started at the viewpoint.
    from_eye: bool,
    /// Whether it comes straight from its start.
    straight: bool,
}

impl<L: Lanes> Way<L> {
    fn new(ray: Ray, lanes: usize, from_eye: bool) -> Self {
        let throughput = Spectrum::splat(lanes, 1.0);
        Self { ray, throughput, surfaces: 0, length: 0.0, from_eye, straight: true }
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

impl Whitted<'_> {
    /// Radiance along a ray from the viewpoint.
    pub fn radiance<L: Lanes>(
        &self,
        ray: Ray,
        gather: u32,
        shared: &mut Shared,
        rng: &mut Stream,
    ) -> Spectrum<L> {
        let start = Way::new(ray, self.light.scene.lanes(), true);
        self.follow(
            start,
            rng,
            |_, _| 1.0,
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
    /// and the lights on its way as much as they count.
    fn follow<L: Lanes>(
        &self,
        start: Way<L>,
        rng: &mut Stream,
        share: impl Fn(&Way<L>, &LightHit) -> f32,
        mut seen: impl FnMut(&Place, &mut Stream) -> Spectrum<L>,
    ) -> Spectrum<L> {
        let scene = self.light.scene;
        let mut radiance = start.throughput.zero();
        let mut ways = vec![start];
        while let Some(way) = ways.pop() {
            let Way { ray, ref throughput, surfaces, length, from_eye, straight } = way;
            let hit = if from_eye && straight {
                self.viewpoint.closest(&ray)
            } else {
                scene.closest(&ray)
            };
            // a light with a material lies in a surface: reach as far as its lift
            let t_max = hit.map_or(f32::INFINITY, |hit| hit.t + scene.ray_offset());
            scene.lights_met(&ray, t_max, |hit| {
                let met = scene.lights[hit.light].radiance::<L>(&ray, hit.on.as_ref());
                radiance += met.scaled(share(&way, &hit)) * throughput;
            });
            let Some(hit) = hit else { continue };
            let surface = scene.surface(hit.triangle);
            let material = scene.material(surface);
            let interaction = Interaction::new(ray.direction, surface.normal).on(hit.triangle);
            let length = length + hit.t;
            if material.is_diffuse() {
                let reach = PIXELS * self.viewpoint.camera.pixel() * length;
                let place = Place { hit, surface, interaction, reach };
                radiance += seen(&place, rng) * throughput;
            }
            if surfaces == MOST_SURFACES {
                continue;
            }
            let smooth = material.smooth_ways::<L>(&interaction, Transport::Importance);
            for scatter in smooth.into_iter().flatten() {
                let throughput = scatter.weight * throughput;
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
    fn gathered<L: Lanes>(&self, place: &Place, directions: u32, rng: &mut Stream) -> Spectrum<L> {
        let scene = self.light.scene;
        let Place { hit, surface, interaction, .. } = place;
        let outgoing = -interaction.direction;
        let material = scene.material(surface);
        let joined = Joined::new(scene, surface, *interaction, hit.point);
        // lights by way of mirrors are left to photons
        let share = |way: &Way<L>, hit: &LightHit| {
            if way.straight { joined.weight(&way.ray, hit) } else { 0.0 }
        };
        let mut sum = Spectrum::splat(scene.lanes(), 0.0);
        for _ in 0..directions {
            sum += joined.radiance(rng);
            let scatter = material.sample::<L>(interaction, Transport::Importance, rng);
            let Some(scatter) = scatter.filter(|s| s.lobe == LobeKind::Diffuse) else { continue };
            let side = if scatter.crosses { -interaction.normal } else { interaction.normal };
            let ray = scene.leave(hit.point, side, scatter.direction);
            let start = Way::new(ray, scene.lanes(), false);
            let there = self.follow(start, rng, share, |place, _| load(&self.seen(place)));
            sum += scatter.weight * there;
        }
        let caustic = self.light.caustic_radiance(hit.triangle, hit.point, outgoing);
        load::<L>(&caustic) + sum.scaled(1.0 / directions as f32)
    }
}

fn load<L: Lanes>(values: &[f64]) -> Spectrum<L> {
    Spectrum::from_fn(values.len(), |b| values.get(b).map_or(0.0, |v| *v as f32))
}
