//! Backward paths: what arrives at a captor, found from the captor's side.
//!
//! A path starts at a point uniform on a captor's face, along a direction with density cos / pi.
//! At each point on its way, a light is chosen in proportion to what it may contribute, and joined
//! by a shadow ray (next-event estimation); the path itself may meet a light too, and where both
//! could, each counts by the balance heuristic (Veach 1997, ch. 9). So it is, too, with directions that
//! are aimed at the reflectors of lamps ([`Reflectors`]), and with light that lamps send to what is close to them ([`Spots`]). The sun is looked for in flat panes and mirrors, too. What a
//! path cannot find is light of a point or a line that comes by way of a mirror or refraction, and the sun by others than
//! one of those: [`Unseen`] says how much that is. What paths find by chance alone, as a small lamp in a mirror, may be more
//! than their errors know: `chance` tells where.

mod chance;
mod choice;
mod face;
mod joined;
mod reflectors;
mod spots;
#[cfg(test)]
mod tests;
mod unseen;
mod vertex;

use glam::Vec3;

use crate::{
    math::{
        geometry::Ray,
        rng::Stream,
        spectrum::{Lanes, Spectrum},
    },
    scene::{
        light::{LightHit, Toward},
        material::{Interaction, LobeKind, Transport},
        world::{ChosenImage, FlatMirrors, Scene, SurfaceHit},
    },
    transport::trace::{MAX_INTERACTIONS, MAX_TOTAL_REFLECTIONS, roulette},
};
pub use face::{Face, PathScore};
pub use joined::Joined;
#[cfg(test)]
pub use joined::radiance;
use reflectors::Reflectors;
use spots::Spots;
pub use unseen::{Finding, Told, Unseen};
use vertex::{Arrival, Vertex};

/// Where surfaces have left less of a path than this, it goes on by Russian roulette, with this much.
const LEAST: f32 = 1.0 / 3.0;

/// Share of the points at which the sun is looked for in flat mirrors: it costs rays at each, and brings little.
const MIRRORS_TRIED: f32 = 0.25;

/// How a path goes on from a point.
struct Leg {
    /// Where its direction was chosen.
    at: Vertex,
    ray: Ray,
    /// Density of that choice where it was free, 1/sr, times the chance that it was; none after a
    /// mirror, which no other point can be joined with.
    density: Option<f32>,
    /// The triangle that it was aimed at.
    aimed: Option<usize>,
    /// Whether no pane lies between.
    unbroken: bool,
}

/// Where a path goes on to.
enum Aim {
    /// Wherever the surface scatters.
    Free,
    /// To a point of a triangle.
    At(usize, Vec3),
    /// To no reflector, for there is none.
    Nowhere,
}

/// What photons have found out about a scene before paths start.
pub struct Pilot {
    reflectors: Option<Reflectors>,
    spots: Option<Spots>,
}

impl Pilot {
    /// Nothing to aim at.
    const NONE: Self = Self { reflectors: None, spots: None };

    /// Traces them.
    pub fn run(scene: &Scene, seed: u64) -> Self {
        let reflectors = Reflectors::find(scene, seed);
        let spots = Spots::find(scene, reflectors.as_ref(), seed);
        Self { reflectors, spots }
    }
}

struct Path<'a, 'r> {
    scene: &'a Scene,
    pilot: &'a Pilot,
    rng: &'r mut Stream,
    rays: u32,
    cut_off: bool,
}

impl Path<'_, '_> {
    /// Light from one light, chosen by what each may contribute: the direction towards it, and its irradiance across
    /// that direction over the density of the choice, weighted against `otherwise`, the density with which a path would
    /// go there by itself.
    fn next_event<L: Lanes>(
        &mut self,
        at: &Vertex,
        otherwise: impl Fn(Vec3) -> f32,
    ) -> Option<(Vec3, Spectrum<L>)> {
        let scene = self.scene;
        let (l, chance) = at.choice.choose(&scene.lights, || self.rng.uniform())?;
        let sample = scene.lights[l].sample_toward::<L>(at.point, scene.ray_offset(), self.rng)?;
        let toward = match sample.target {
            Toward::Point(point) => (point - at.point).try_normalize()?,
            Toward::Direction(toward) => toward,
        };
        if at.one_sided.is_some_and(|normal| normal.dot(toward) <= 0.0) {
            return None;
        }
        let step = |normal: Vec3| scene.ray_offset() * normal * normal.dot(toward).signum();
        let origin = at.point + at.step.map_or(Vec3::ZERO, step);
        self.rays += 1;
        let visible: Spectrum<L> = match sample.target {
            Toward::Point(point) => scene.visibility(origin, point)?,
            Toward::Direction(_) => scene.sky_visibility(l, &Ray { origin, direction: toward })?,
        };
        let sent = self.sent_density(l, at, toward, sample.per_watt);
        let weight = match sample.pdf {
            Some(pdf) => {
                let own = pdf * chance;
                own / (own + otherwise(toward) + pdf * sent)
            }
            None => chance / (chance + sent),
        };
        Some((toward, sample.radiance_over_pdf.scaled(weight / chance) * visible))
    }

    /// How many times as likely light is [sent](Self::sent) to a point as a path comes to it, times the irradiance of a light
    /// point or its radiance.
    fn sent_density(&self, light: usize, at: &Vertex, towards: Vec3, brings: f32) -> f32 {
        let spots = self.pilot.spots.as_ref();
        spots.map_or(0.0, |spots| spots.rival(self.scene, light, at, towards, brings))
    }

    /// Light that a lamp sends to what it lights from close by, joined from there with a point: the direction to where it landed, and
    /// its irradiance across that direction, weighted against what paths would find that come there along directions of the density `along`.
    #[inline]
    fn sent<L: Lanes>(
        &mut self,
        at: &Vertex,
        along: impl Fn(Vec3) -> f32,
    ) -> Option<(Vec3, Spectrum<L>)> {
        let spots = self.pilot.spots.as_ref()?;
        self.sent_to(spots, at, along)
    }

    /// Out of the way of paths in scenes without such lamps.
    #[inline(never)]
    fn sent_to<L: Lanes>(
        &mut self,
        spots: &Spots,
        at: &Vertex,
        along: impl Fn(Vec3) -> f32,
    ) -> Option<(Vec3, Spectrum<L>)> {
        let scene = self.scene;
        let (light, chance) = spots.choose(scene, at.point, self.rng);
        let ray = scene.lights[light].emit(scene.ray_offset(), self.rng);
        self.rays += 1;
        let (hit, through) = spots::straight::<L>(scene, ray, |_, _| ())?;
        let surface = scene.surface(hit.triangle);
        let material = scene.material(surface);
        let away = hit.point - at.point;
        let (towards, d2) = (away.try_normalize()?, away.length_squared());
        if at.one_sided.is_some_and(|normal| normal.dot(towards) <= 0.0) {
            return None;
        }
        let arriving = Interaction::new(ray.direction, surface.normal).on(hit.triangle);
        let f: Spectrum<L> = material.evaluate(&arriving, -towards);
        if f.is_zero() {
            return None;
        }
        let seen = Interaction::new(towards, surface.normal);
        let step = |normal: Vec3| scene.ray_offset() * normal * normal.dot(towards).signum();
        let start = at.point + at.step.map_or(Vec3::ZERO, step);
        let end = scene.leave(hit.point, seen.normal, seen.normal).origin;
        self.rays += 1;
        let visible: Spectrum<L> = scene.visibility(start, end)?;
        let arrival = Arrival { from: at.point, density: along(towards) * seen.cos / d2 };
        let there = Vertex::on(&scene.lights, surface, material, &seen, hit.point);
        let there = Vertex { arrival: Some(arrival), ..there };
        let origin = spots::origin(scene, light, &ray, hit.point)?;
        let free = self.free_share();
        let share = spots.share(scene, &there, &origin, |d| {
            free * material.pdf(&seen, Transport::Importance, d)
        });
        let power = scene.lights[light].spectrum::<L>();
        Some((towards, (power * through * f * visible).scaled(seen.cos / d2 * share / chance)))
    }

    /// Light of the sun by way of one flat pane or mirror: the direction towards an image of it, and its irradiance
    /// across that direction over the density of the choice. A path that is mirrored by chance does not look for
    /// the sun, so that it counts once.
    #[inline]
    fn mirrored_sun<L: Lanes>(&mut self, at: &Vertex) -> Option<(Vec3, Spectrum<L>)> {
        let mirrors = self.scene.flat_mirrors()?;
        self.sun_by_way_of(mirrors, at)
    }

    /// Out of the way of paths in scenes without.
    #[inline(never)]
    fn sun_by_way_of<L: Lanes>(
        &mut self,
        mirrors: &FlatMirrors,
        at: &Vertex,
    ) -> Option<(Vec3, Spectrum<L>)> {
        let scene = self.scene;
        let number = self.rng.uniform() / MIRRORS_TRIED;
        if number >= 1.0 {
            return None;
        }
        let suns = mirrors.suns();
        let sun = match suns.len() {
            1 => suns[0],
            more => suns[(self.rng.uniform() * more as f32) as usize % more],
        };
        let (toward_sun, irradiance) =
            scene.lights[sun].entrance()?.light.sample_suns::<L>(self.rng)?;
        let ChosenImage { image, toward, chance } =
            scene.choose_image::<L>(mirrors, at.point, at.one_sided, toward_sun, number)?;
        let step = |normal: Vec3| scene.ray_offset() * normal * normal.dot(toward).signum();
        let origin = at.point + at.step.map_or(Vec3::ZERO, step);
        let mut ray = Ray { origin, direction: toward };
        let [mut arriving, mut through] =
            [0.0, 1.0].map(|value| Spectrum::<L>::splat(scene.lanes(), value));
        // panes on the way may show the image too, and let through what those behind them show
        for _ in 0..MAX_INTERACTIONS {
            if !mirrors.may_be_met(image, &ray) {
                break;
            }
            self.rays += 1;
            let Some(hit) = scene.closest(&ray) else { break };
            let surface = scene.surface(hit.triangle);
            let material = scene.material(surface);
            let at_pane = Interaction::new(toward, surface.normal);
            let [mirrored, onward] = material.smooth_ways::<L>(&at_pane, Transport::Importance);
            if mirrors.image_of(hit.triangle) == Some(image)
                && let Some(mirrored) = mirrored
            {
                let ray = scene.leave(hit.point, at_pane.normal, toward_sun);
                self.rays += 1;
                if let Some(visible) = scene.sky_visibility::<L>(sun, &ray) {
                    arriving += mirrored.weight * &through * visible;
                }
            }
            match onward {
                Some(onward) if onward.lobe == LobeKind::Straight => {
                    through = through * onward.weight;
                }
                _ => break,
            }
            ray = scene.leave(hit.point, -at_pane.normal, toward);
        }
        let factor = suns.len() as f32 / (MIRRORS_TRIED * chance);
        (!arriving.is_zero()).then(|| (toward, arriving * irradiance.scaled(factor)))
    }

    /// Radiance of a light that a leg meets, but what counts where its beginning was joined with the light, or light was
    /// sent there. After a mirror nothing else could. The sun is too small for chance then:
    /// [`mirrored_sun`](Self::mirrored_sun) finds what it can, and [`Unseen`] says how much is left.
    fn met<L: Lanes>(&self, leg: &Leg, hit: &LightHit) -> Spectrum<L> {
        let (light, on) = (&self.scene.lights[hit.light], hit.on.as_ref());
        let Some(density) = leg.density else {
            return light.radiance_without_suns(&leg.ray, on);
        };
        let joined = next_event_density(self.scene, &leg.at, &leg.ray, hit);
        let sent = on.map_or(0.0, |on| {
            self.sent_density(hit.light, &leg.at, leg.ray.direction, on.emitted.radiance)
        });
        light.radiance(&leg.ray, on).scaled(density / (density + joined + sent))
    }

    /// Chance that a direction is not aimed at a reflector.
    fn free_share(&self) -> f32 {
        self.pilot.reflectors.as_ref().map_or(1.0, |reflectors| 1.0 - reflectors.share)
    }

    /// Chooses where to go on to from a point.
    fn aim(&mut self, from: &Vertex) -> Aim {
        let Some(reflectors) = &self.pilot.reflectors else { return Aim::Free };
        let u = self.rng.uniform();
        if u >= reflectors.share {
            return Aim::Free;
        }
        let target = reflectors.choose(self.scene, from, u / reflectors.share, self.rng);
        target.map_or(Aim::Nowhere, |(triangle, point)| Aim::At(triangle, point))
    }

    /// Radiance that arrives by `leg`: all of it but what a light point chosen at its beginning counts
    /// for. By an aimed leg the part that aiming counts for, over its density.
    fn follow<L: Lanes>(&mut self, mut leg: Leg) -> Spectrum<L> {
        let scene = self.scene;
        let [mut radiance, mut throughput] =
            [0.0, 1.0].map(|value| Spectrum::splat(scene.lanes(), value));
        let mut total_reflections = 0;
        // what surfaces have left of the path; how its directions were chosen is no reason to end it
        let mut kept = 1.0;
        for _ in 0..MAX_INTERACTIONS {
            self.rays += 1;
            let hit = scene.closest(&leg.ray);
            if leg.aimed.is_none() {
                // a light with a material lies in a surface: reach as far as its lift
                let t_max = hit.map_or(f32::INFINITY, |hit| hit.t + scene.ray_offset());
                scene.lights_met(&leg.ray, t_max, |hit| {
                    radiance += self.met::<L>(&leg, &hit) * &throughput;
                });
            }
            let Some(hit) = hit else { return radiance };
            let surface = scene.surface(hit.triangle);
            let material = scene.material(surface);
            let interaction = Interaction::new(leg.ray.direction, surface.normal).on(hit.triangle);
            match self.arrival_weight(&leg, &hit, interaction.cos) {
                Some(weight) => throughput = throughput.scaled(weight),
                None => return radiance,
            }
            let mut here = Vertex::on(&scene.lights, surface, material, &interaction, hit.point);
            // what passes light straight is none that light is sent to
            if self.pilot.spots.is_some()
                && material.straight::<L>(leg.ray.direction, surface.normal).is_none()
            {
                here.arrival = leg.density.map(|density| {
                    let (from, d2) = (leg.at.point, leg.at.point.distance_squared(hit.point));
                    Arrival { from, density: density * interaction.cos / d2 }
                });
            }
            let free = if material.is_diffuse() { self.free_share() } else { 1.0 };
            let along = |d| free * material.pdf(&interaction, Transport::Importance, d);
            let scattered = |towards: Vec3| {
                let arriving = Interaction::new(-towards, surface.normal).on(hit.triangle);
                let f: Spectrum<L> = material.evaluate(&arriving, -interaction.direction);
                f.scaled(arriving.cos)
            };
            if material.is_diffuse()
                && let Some((towards, irradiance)) = self.next_event::<L>(&here, along)
            {
                radiance += scattered(towards) * &throughput * irradiance;
            }
            if material.is_diffuse()
                && let Some((towards, irradiance)) = self.mirrored_sun::<L>(&here)
            {
                radiance += scattered(towards) * &throughput * irradiance;
            }

            if material.is_diffuse()
                && let Some((towards, irradiance)) = self.sent::<L>(&here, along)
            {
                radiance += scattered(towards) * &throughput * irradiance;
            }

            let aim = if material.is_diffuse() { self.aim(&here) } else { Aim::Free };
            match aim {
                Aim::Nowhere => return radiance,
                Aim::At(triangle, target) => {
                    let side = (target - hit.point).dot(surface.normal).signum() * surface.normal;
                    let origin = scene.leave(hit.point, side, side).origin;
                    let direction = (target - origin).normalize_or_zero();
                    throughput = throughput * scattered(direction);
                    let density = Some(along(direction));
                    let ray = Ray { origin, direction };
                    leg = Leg { at: here, ray, density, aimed: Some(triangle), unbroken: true };
                    total_reflections = 0;
                }
                Aim::Free => {
                    let scatter =
                        material.sample::<L>(&interaction, Transport::Importance, self.rng);
                    let Some(scatter) = scatter else { return radiance };
                    let before = throughput.largest();
                    throughput = throughput * &scatter.weight;
                    // what a solid takes from radiance on entry it gives back on exit
                    if scatter.lobe != LobeKind::Refraction {
                        kept *= throughput.largest() / before;
                    }
                    if kept < LEAST {
                        let onward = roulette(throughput, kept / LEAST, self.rng);
                        let Some(onward) = onward else { return radiance };
                        (throughput, kept) = (onward, LEAST);
                    }
                    throughput = throughput.scaled(1.0 / free);
                    total_reflections = if scatter.lobe == LobeKind::TotalReflection {
                        total_reflections + 1
                    } else {
                        0
                    };
                    if total_reflections == MAX_TOTAL_REFLECTIONS {
                        break;
                    }
                    let side = if scatter.lobe.crosses() {
                        -interaction.normal
                    } else {
                        interaction.normal
                    };
                    let ray = scene.leave(hit.point, side, scatter.direction);
                    leg = match scatter.lobe {
                        // what is beyond a pane can be joined with the vertex before it
                        LobeKind::Straight => Leg { ray, unbroken: false, aimed: None, ..leg },
                        lobe if lobe.is_specular() => {
                            Leg { ray, density: None, aimed: None, ..leg }
                        }
                        _ => {
                            let density = Some(along(scatter.direction));
                            Leg { at: here, ray, density, aimed: None, unbroken: true }
                        }
                    };
                }
            }
            if throughput.is_zero() {
                return radiance;
            }
        }
        // where surfaces have left but a part, it counts as cut off that often
        self.cut_off = self.rng.uniform() < kept;
        radiance
    }

    /// What the light that comes along a leg from `hit` counts: a free choice could have gone there
    /// and, to a reflector, an aimed one too. None where an aimed one has not reached its triangle.
    fn arrival_weight(&self, leg: &Leg, hit: &SurfaceHit, cos: f32) -> Option<f32> {
        let (Some(reflectors), Some(free)) = (&self.pilot.reflectors, leg.density) else {
            return Some(1.0);
        };
        let aimed = || reflectors.density(self.scene, &leg.at, hit.triangle) * hit.t * hit.t / cos;
        match leg.aimed {
            Some(triangle) => (triangle == hit.triangle).then(|| 1.0 / (free + aimed())),
            None if !leg.unbroken => Some(1.0),
            None => match aimed() {
                0.0 => Some(1.0),
                aimed => Some(free / (free + aimed)),
            },
        }
    }
}

/// Density with which [`Path::next_event`] at `at` chooses the direction of a ray that meets a light.
fn next_event_density(scene: &Scene, at: &Vertex, ray: &Ray, hit: &LightHit) -> f32 {
    let chance = at.choice.chance(&scene.lights, hit.light);
    chance * scene.lights[hit.light].pdf_toward(at.point, ray, hit.on.as_ref())
}
