//! Backward paths: the light that arrives at a captor, estimated by following paths from the captor
//! back to the lights.
//!
//! A path starts at a point uniform on a captor's face, in a direction of density cos / pi. At each
//! point of the path a light is chosen in proportion to what it may contribute, and is joined with
//! the point by a shadow ray (next-event estimation). The path itself may also meet a light. Where
//! both ways could find the same light, each is weighted by the balance heuristic (Veach 1997, ch.
//! 9). The same holds for directions that are aimed at the reflectors of lamps ([`Reflectors`]) and
//! for photons that lamps send to surfaces close to them ([`Spots`]). Paths also search flat panes
//! and mirrors for images of the sun.
//!
//! Two kinds of light need care. A path cannot find the light of a point or a line that comes by
//! way of a mirror or a refraction, nor the light of the sun by way of anything but one flat pane
//! or mirror: [`Unseen`] measures how much light that is. Other light is found by chance alone, for
//! example that of a small lamp in a mirror, and the standard errors of a run may then be too
//! small: `chance` finds the captors concerned.
//!
//! Reading order: `face` (where paths start), `walk` (how they go on), `vertex` and
//! `choice` (how a point is joined with a light), `course` (what that light has met), `reflectors`
//! and `spots` (what the pilot run learns), `unseen` and `chance` (what paths miss), `joined` (the
//! use of next-event estimation for pictures).

mod chance;
mod choice;
mod course;
mod face;
mod joined;
mod mirrored;
mod near;
mod reflectors;
mod spots;
#[cfg(test)]
mod tests;
mod unseen;
mod vertex;
mod walk;

use glam::Vec3;

use crate::{
    math::{
        effort,
        geometry::{ROUNDING, Ray},
        rng::Stream,
        spectrum::{Lanes, Spectrum},
    },
    scene::{
        light::{Emission, Light, LightHit, LightSample, Strata, Toward},
        material::{Scatterer, Transport},
        world::{Arrived, ChosenImage, FlatMirrors, Scene, SurfaceHit},
    },
};
use course::{Course, Lit};
pub use face::{Face, PathScore};
pub use joined::Joined;
#[doc(hidden)]
pub use joined::radiance;
use mirrored::{Step, by_way_of};
use near::Near;
use reflectors::Reflectors;
use spots::Spots;
pub use unseen::{Finding, Told, Unseen, reached, unaimed};
use vertex::{Arrival, Vertex};

/// When surfaces have left less than this fraction of a path, Russian roulette decides whether it
/// goes on; a path that survives then goes on with this fraction.
const LEAST: f32 = 1.0 / 3.0;

/// Fraction of the points of a path at which flat mirrors are searched for the sun. The search
/// costs rays at every point and seldom finds anything.
const MIRRORS_TRIED: f32 = 0.25;

/// A straight piece of a path, with the choice of its direction.
struct Leg {
    /// The point at which the direction was chosen.
    at: Vertex,
    ray: Ray,
    /// Density with which a free choice takes this direction, 1/sr, times the chance that the
    /// choice is free. `None` after a mirror or a refraction, because no other point can be joined
    /// to it, and for a camera ray.
    density: Option<f32>,
    /// The triangle at which the direction was aimed; `None` if the choice was free.
    aimed: Option<usize>,
    /// Whether no pane lies between `at` and the origin of the ray.
    unbroken: bool,
}

/// How the next direction of a path is chosen.
enum Aim {
    /// Freely: in the way in which the surface scatters.
    Free,
    /// Aimed at a point of the triangle of this index.
    At(usize, Vec3),
    /// Aimed at a reflector, although the chosen light has none: the path ends.
    Nowhere,
}

/// A source of light is small if the product of its exitance per watt and the squared radius of the
/// scene is above this. From that radius away, it fills less than about a tenth of a steradian.
/// Larger sources are found by enough paths to show in the standard errors.
const SMALL: f32 = 10.0;
/// Photons beside paths whose light is never left to them, which are traced for the balance of
/// energy alone, have this fraction of the share that their power would give them.
const BALANCE: f64 = 0.125;

/// Results of the pilot run: photons traced before the paths, to learn which surfaces lamps light
/// strongly.
pub struct Pilot {
    reflectors: Option<Reflectors>,
    spots: Option<Spots>,
    /// For each light, whether paths leave its light to photons where it was mirrored or refracted
    /// before it first met something diffuse. Empty if paths leave nothing to photons.
    left: Vec<bool>,
    /// For each stratum of the lights, its share of the photons beside the paths.
    shares: Vec<f64>,
    /// The box about the captors through which photons are sent, where it gains much.
    near: Option<Near>,
}

impl Pilot {
    /// A pilot without results: paths then aim at nothing.
    const NONE: Self =
        Self { reflectors: None, spots: None, left: Vec::new(), shares: Vec::new(), near: None };

    /// Traces the photons of the pilot run.
    pub fn run(scene: &Scene, seed: u64) -> Self {
        if scene.lattice().is_some() {
            // what is aimed at there may lie in any cell
            return Self::NONE;
        }
        let reflectors = Reflectors::find(scene, seed);
        let spots = Spots::find(scene, reflectors.as_ref(), seed);
        Self { reflectors, spots, near: Near::find(scene), ..Self::NONE }
    }

    /// Traces the photons of the pilot run of paths beside which photons are traced: these paths
    /// leave to the photons what they would find by chance alone of lights that are small, unless
    /// photons would find the captors by less chance than paths find the light.
    pub fn beside_photons(scene: &Scene, seed: u64) -> Self {
        let faces =
            scene.captors().iter().flat_map(|c| c.kind.faces().iter().map(|_| c.area_of_face()));
        let area = faces.sum::<f64>() as f32;
        let is_left = |light: &Light| {
            let exitance = light.exitance().unwrap_or(0.0);
            is_small(scene, exitance) && exitance * area > 1.0
        };
        let left: Vec<bool> = scene.lights().iter().map(is_left).collect();
        let strata = Strata::new(scene.lights(), scene.sources() as u64, scene.lanes());
        let mut shares = Vec::with_capacity(strata.sources());
        for (light, &left) in scene.lights().iter().zip(&left) {
            for source in 0..light.sources() {
                let power = light.source_power(source).iter().copied().fold(0.0, f64::max);
                let counts = left || strata.is_delta(scene.lights(), shares.len());
                shares.push(if counts { power } else { BALANCE * power });
            }
        }
        Self { left, shares, ..Self::run(scene, seed) }
    }

    /// Returns the strata of so many photons beside so many paths from each face, by whose number
    /// their sums are divided. Lights of which nothing is left to photons have few of them, unless
    /// `all` light counts somewhere.
    pub fn strata(&self, scene: &Scene, photons: u64, paths: u64, all: bool) -> Strata {
        let shares = Some(&self.shares[..]).filter(|_| !all);
        Strata::shared(scene.lights(), photons, scene.lanes(), shares).divided_by(paths)
    }

    /// Emits history `index` of the photons beside the paths. Returns with it the power that it
    /// would have without the choice of its place, where that differs, as [`Near::emit`].
    pub fn emit<'s, L: Lanes>(
        &self,
        scene: &Scene,
        strata: &'s Strata,
        index: u64,
        rng: &mut Stream,
    ) -> (Emission<'s, L>, Option<Spectrum<L>>) {
        match &self.near {
            Some(near) => near.emit(scene, strata, index, rng),
            None => (scene.emit(strata, index, rng), None),
        }
    }

    /// Returns how many times the usual power a photon beside the paths may have at most.
    pub fn most_gain(&self) -> f64 {
        if self.near.is_some() { Near::MOST_GAIN } else { 1.0 }
    }

    /// Returns whether photons beside the paths can serve a face alone. Where they are sent [near](Near)
    /// the captors, light that comes from beside the box arrives with few photons that count for much,
    /// which neither a trial nor a run may meet, so that an error would say too little.
    pub fn may_serve_alone(&self) -> bool {
        self.near.is_none()
    }

    /// Returns whether photons are traced beside the paths.
    fn has_photons(&self) -> bool {
        !self.left.is_empty()
    }

    /// Returns whether paths leave the light of a light to photons where it was mirrored or
    /// refracted before it first met something diffuse.
    pub fn leaves(&self, light: usize) -> bool {
        self.left.get(light).is_some_and(|&left| left)
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
    /// Chooses one light by what each light may contribute at a point, and joins a point of it by a
    /// shadow ray. Returns the direction towards the light, and the irradiance across that
    /// direction divided by the density of the choice, weighted by the balance heuristic.
    /// `otherwise` gives the density with which the path itself takes a direction, 1/sr. `None`
    /// where no light arrives.
    fn next_event<L: Lanes>(
        &mut self,
        at: &Vertex,
        otherwise: impl Fn(Vec3) -> f32,
    ) -> Option<Lit<L>> {
        let scene = self.scene;
        effort::spend(effort::VERTEX);
        let (l, chance) = at.choose(scene, None, self.rng)?;
        if effort::is_counted() && scene.lights()[l].entrance().is_some() {
            effort::spend(effort::SKY);
        }
        let sample = scene.sample_toward::<L>(l, at.point, self.rng)?;
        let toward = toward(at, &sample)?;
        self.rays += 1;
        let visible = visibility(scene, l, at, &sample, toward)?;
        let sent = self.sent_density(l, at, toward, sample.per_watt);
        let weight = match sample.pdf {
            Some(pdf) => {
                let own = pdf * chance;
                own / (own + otherwise(toward) + pdf * sent)
            }
            None => chance / (chance + sent),
        };
        Some(Lit {
            towards: toward,
            irradiance: sample.radiance_over_pdf.scaled(weight / chance) * visible,
            light: l,
            course: Course::Straight(sample.target),
        })
    }

    /// Returns how many times as likely a photon is [sent](Self::sent) to a point as a path comes
    /// to it. `brings` is the irradiance of the light point per W, 1/m2. If it is a radiance
    /// instead, 1/(m2 sr), the result is per sr.
    fn sent_density(&self, light: usize, at: &Vertex, towards: Vec3, brings: f32) -> f32 {
        let spots = self.pilot.spots.as_ref();
        spots.map_or(0.0, |spots| spots.rival(self.scene, light, at, towards, brings))
    }

    /// Sends a photon from a lamp that lights a surface from close by, and joins the place where
    /// the photon lands with a point. Returns the direction to that place, and its irradiance
    /// across that direction, weighted by the balance heuristic against the paths that come to that
    /// place by themselves. `along` gives the density of their directions at the point, 1/sr.
    #[inline]
    fn sent<L: Lanes>(&mut self, at: &Vertex, along: impl Fn(Vec3) -> f32) -> Option<Lit<L>> {
        let spots = self.pilot.spots.as_ref()?;
        self.sent_to(spots, at, along)
    }

    /// Does the work of [`sent`](Self::sent), out of line so that paths in scenes without such
    /// lamps do not pay for it.
    #[inline(never)]
    fn sent_to<L: Lanes>(
        &mut self,
        spots: &Spots,
        at: &Vertex,
        along: impl Fn(Vec3) -> f32,
    ) -> Option<Lit<L>> {
        let scene = self.scene;
        let (light, chance) = spots.choose(scene, at.point, self.rng);
        let ray = scene.lights()[light].emit(self.rng);
        self.rays += 1;
        let (landed, through) = spots::straight::<L>(scene, ray, |_, _| ())?;
        let point = landed.hit.point;
        let away = point - at.point;
        let (towards, d2) = (away.try_normalize()?, away.length_squared());
        if at.one_sided.is_some_and(|normal| normal.dot(towards) <= 0.0) {
            return None;
        }
        let f: Spectrum<L> = landed.material.evaluate(&landed.interaction, -towards);
        if f.is_zero() {
            return None;
        }
        let seen = Arrived { interaction: landed.along(towards), ..landed };
        let (normal, cos) = (seen.interaction.normal, seen.interaction.cos);
        let start = at.off(towards);
        // off the place by the error of the ray's own end, too
        let end = scene.leave(&landed.hit, normal, normal).origin + ROUNDING * d2.sqrt() * normal;
        self.rays += 1;
        let visible: Spectrum<L> = scene.visibility(start, end)?;
        let arrival = Arrival { from: at.point, density: along(towards) * cos / d2 };
        let there = Vertex { arrival: Some(arrival), ..Vertex::on(scene, &seen) };
        let origin = spots::origin(scene, light, &ray, point)?;
        let free = self.free_share();
        let share = spots.share(scene, &there, &origin, |d| {
            free * seen.material.pdf(&seen.interaction, Transport::Importance, d)
        });
        let power = scene.lights()[light].spectrum::<L>();
        Some(Lit {
            towards,
            irradiance: (power * through * f * visible).scaled(cos / d2 * share / chance),
            light,
            course: Course::Sent { ray, from: end },
        })
    }

    /// Searches one flat pane or mirror for the sun. Returns the direction towards the image of the
    /// sun, and its irradiance across that direction divided by the density of the choice. A path
    /// that is mirrored by chance does not count the sun that it meets, so the sun counts only
    /// once.
    #[inline]
    fn mirrored_sun<L: Lanes>(&mut self, at: &Vertex) -> Option<Lit<L>> {
        let mirrors = self.scene.flat_mirrors()?;
        self.sun_by_way_of(mirrors, at)
    }

    /// Does the work of [`mirrored_sun`](Self::mirrored_sun), out of line so that paths in scenes
    /// without flat mirrors under a sun do not pay for it.
    #[inline(never)]
    fn sun_by_way_of<L: Lanes>(&mut self, mirrors: &FlatMirrors, at: &Vertex) -> Option<Lit<L>> {
        let scene = self.scene;
        effort::spend(effort::VERTEX);
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
            scene.lights()[sun].entrance()?.light.sample_suns::<L>(self.rng)?;
        let ChosenImage { image, toward, chance } =
            scene.choose_image::<L>(mirrors, at.point, at.one_sided, toward_sun, number)?;
        let ray = Ray { origin: at.off(toward), direction: toward };
        let shines = |ray: &Ray| scene.sky_visibility::<L>(sun, ray);
        let (arriving, rays) =
            by_way_of(scene, mirrors, image, ray, toward_sun, shines, |_: Step<L>| ());
        self.rays += rays;
        let factor = suns.len() as f32 / (MIRRORS_TRIED * chance);
        (!arriving.is_zero()).then(|| Lit {
            towards: toward,
            irradiance: arriving * irradiance.scaled(factor),
            light: sun,
            course: Course::Image { image, toward_sun },
        })
    }

    /// Returns the radiance of a light that a leg meets, weighted by the balance heuristic against
    /// next-event estimation at the beginning of the leg and against photons sent there. After a
    /// mirror neither of these could find the light, so its radiance counts in full, except that of
    /// the sun: [`mirrored_sun`](Self::mirrored_sun) finds the sun where it can, and [`Unseen`]
    /// measures the rest. Light that is left to photons does not count.
    fn met<L: Lanes>(&self, leg: &Leg, hit: &LightHit) -> Spectrum<L> {
        let (light, on) = (&self.scene.lights()[hit.light], hit.on.as_ref());
        let Some(density) = leg.density else {
            return match self.pilot.leaves(hit.light) {
                true => Spectrum::splat(self.scene.lanes(), 0.0),
                false => light.radiance_without_suns(&leg.ray, on),
            };
        };
        let joined = next_event_density(self.scene, &leg.at, &leg.ray, hit);
        let sent = on.map_or(0.0, |on| {
            self.sent_density(hit.light, &leg.at, leg.ray.direction, on.emitted.radiance)
        });
        light.radiance(&leg.ray, on).scaled(density / (density + joined + sent))
    }

    /// Returns the chance that a direction is chosen freely, and not aimed at a reflector.
    fn free_share(&self) -> f32 {
        self.pilot.reflectors.as_ref().map_or(1.0, |reflectors| 1.0 - reflectors.share)
    }

    /// Chooses how the path goes on from a point.
    fn aim(&mut self, from: &Vertex) -> Aim {
        let Some(reflectors) = &self.pilot.reflectors else { return Aim::Free };
        let u = self.rng.uniform();
        if u >= reflectors.share {
            return Aim::Free;
        }
        let target = reflectors.choose(self.scene, from, u / reflectors.share, self.rng);
        target.map_or(Aim::Nowhere, |(triangle, point)| Aim::At(triangle, point))
    }

    /// Returns the weight of the light that comes along a leg from `hit`. A free choice could have
    /// found `hit` and, if it lies on a reflector, an aimed choice could too, so the balance
    /// heuristic applies. `None` if an aimed leg has not reached its triangle.
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

/// Returns the direction from a point to a point of a light. `None` if no light counts from there.
#[inline(always)]
fn toward<L: Lanes>(at: &Vertex, sample: &LightSample<L>) -> Option<Vec3> {
    let toward = match sample.target {
        Toward::Point { point, .. } => (point - at.point).try_normalize()?,
        Toward::Direction(toward) => toward,
    };
    at.one_sided.is_none_or(|normal| normal.dot(toward) > 0.0).then_some(toward)
}

/// Casts a shadow ray from a point to a point of a light. Returns the fraction of its light that
/// arrives, per band; `None` if none does.
#[inline(always)]
fn visibility<L: Lanes>(
    scene: &Scene,
    light: usize,
    at: &Vertex,
    sample: &LightSample<L>,
    toward: Vec3,
) -> Option<Spectrum<L>> {
    let origin = at.off(toward);
    match sample.target {
        Toward::Point { end, .. } => scene.visibility(origin, end),
        Toward::Direction(_) => scene.sky_visibility(light, &Ray { origin, direction: toward }),
    }
}

/// Returns the density, 1/sr, with which [`Path::next_event`] at `at` chooses the direction of a
/// ray that meets a light.
fn next_event_density(scene: &Scene, at: &Vertex, ray: &Ray, hit: &LightHit) -> f32 {
    let chance = at.chance(scene, hit.light);
    chance * scene.pdf_toward(at.point, ray, hit)
}

/// Returns whether a source of this exitance per watt (1/m2) is so small that few paths meet it by
/// chance.
fn is_small(scene: &Scene, exitance: f32) -> bool {
    exitance * scene.radius() * scene.radius() > SMALL
}
