//! Bright spots: places that a lamp lights from close by. Such a patch is small and bright, and a
//! path from afar seldom meets it. The lamp therefore also sends photons, and the place where a
//! photon first lands is joined with the path. This is a second way to the same points, weighted
//! against the path's own way by the balance heuristic.

use glam::Vec3;

use super::{
    reflectors::Reflectors,
    vertex::{Arrival, Vertex},
};
use crate::{
    math::{
        geometry::Ray,
        rng::{Purpose, Stream, Streams},
        spectrum::{Lanes, Spectrum, with_lanes},
    },
    scene::{
        captor::CaptorKind,
        light::{EmitterHit, Light},
        material::{LobeKind, Scatterer, Transport},
        world::{Arrived, Crossing, Scene, SurfaceHit},
    },
    transport::trace::MAX_INTERACTIONS,
};

/// Number of photons of each light, which decide whether it makes bright spots, and the approximate
/// largest number for all lights together.
const PHOTONS: u64 = 1024;
const MOST_PHOTONS: u64 = 1 << 15;
/// A lamp sends photons if one of them is more than this many times as likely to land at a point as
/// a path is to come there, in the mean over the lamp's photons. This ratio is about what the lamp
/// would otherwise add to the relative variance of a path.
const WORTH: f32 = 100.0;
/// Number of lamps that send photons from which on all have the same chance: to weigh each by its
/// distance would take longer than it gains.
const MANY: usize = 32;
/// Least cosine assumed at the next surface, where the way back to a bright spot starts.
const LEAST_COS: f32 = 0.1;

/// The lamps that make bright spots.
pub struct Spots {
    /// Indices of the lamps among the lights of the scene, in rising order.
    lamps: Vec<usize>,
}

/// A point of a lamp, as seen from a point that its light has reached.
pub(super) struct Origin {
    pub light: usize,
    /// Unit vector towards the point of the lamp.
    pub towards: Vec3,
    /// Irradiance across the line of sight, 1/m2 per W of the lamp's power. For a lamp with a
    /// surface, it is the radiance divided by `density`, as in a
    /// [`LightSample`](crate::scene::light::LightSample).
    irradiance: f32,
    /// Density with which next-event estimation chooses the point on this lamp, 1/sr; `None` for a
    /// point or a line.
    density: Option<f32>,
}

impl Origin {
    /// Returns the irradiance on a surface with this normal, 1/m2 per W of the lamp's power.
    pub fn irradiance_on(&self, normal: Vec3) -> f32 {
        self.irradiance * self.towards.dot(normal).abs()
    }
}

impl Spots {
    /// Returns whether a light sends photons.
    pub(super) fn has(&self, light: usize) -> bool {
        self.lamps.binary_search(&light).is_ok()
    }

    /// Finds the lamps that make bright spots, by photons that are followed to their second
    /// surface. `None` if there is no such lamp. The spots that paths find often enough because
    /// they aim at `reflectors` do not count.
    pub fn find(scene: &Scene, reflectors: Option<&Reflectors>, seed: u64) -> Option<Self> {
        let photons = PHOTONS.min((MOST_PHOTONS / scene.lights().len().max(1) as u64).max(16));
        let streams = Streams::new(seed, Purpose::Spots, 0);
        let is_spot = |&light: &usize| {
            let first = light as u64 * photons;
            let (mut contrast, mut all) = (0.0, 0.0);
            for photon in first..first + photons {
                let rng = &mut streams.history(photon);
                with_lanes!(scene.lanes(), L => follow::<L>(scene, reflectors, light, rng, |one, weight| {
                    contrast += weight * one;
                    all += weight;
                }));
            }
            contrast > WORTH * all
        };
        let shines =
            |light: &Light| light.entrance().is_none() && light.power.iter().any(|&p| p > 0.0);
        let lamps = (0..scene.lights().len()).filter(|&light| shines(&scene.lights()[light]));
        let lamps: Vec<usize> = lamps.filter(is_spot).collect();
        (!lamps.is_empty()).then_some(Self { lamps })
    }

    /// Chooses a lamp to send a photon for a path that is at a point. Returns the index of the lamp
    /// and its chance.
    pub(super) fn choose(&self, scene: &Scene, at: Vec3, rng: &mut Stream) -> (usize, f32) {
        if let [lamp] = self.lamps[..] {
            return (lamp, 1.0);
        }
        if self.lamps.len() > MANY {
            let number = rng.uniform_fine() * self.lamps.len() as f64;
            let lamp = self.lamps[(number as usize).min(self.lamps.len() - 1)];
            return (lamp, 1.0 / self.lamps.len() as f32);
        }
        let (mut rest, all) = (rng.uniform(), self.all(scene, at));
        let mut chosen = (0, 0.0);
        for &lamp in &self.lamps {
            chosen = (lamp, self.chance_of(scene, lamp, at, all));
            rest -= chosen.1;
            if rest < 0.0 {
                break;
            }
        }
        chosen
    }

    /// Returns the chance with which a light is chosen at a point; 0 for a light that sends no
    /// photons.
    fn chance(&self, scene: &Scene, light: usize, at: Vec3) -> f32 {
        match self.lamps[..] {
            [lamp] => f32::from(u8::from(lamp == light)),
            _ if !self.has(light) => 0.0,
            _ if self.lamps.len() > MANY => 1.0 / self.lamps.len() as f32,
            _ => self.chance_of(scene, light, at, self.all(scene, at)),
        }
    }

    /// Returns the chance of a lamp that sends photons: one half in proportion to power over
    /// squared distance, the other half the same for all these lamps. `all` is the sum of power
    /// over squared distance over these lamps.
    fn chance_of(&self, scene: &Scene, lamp: usize, at: Vec3, all: f32) -> f32 {
        0.5 * (near(&scene.lights()[lamp], at) / all + 1.0 / self.lamps.len() as f32)
    }

    fn all(&self, scene: &Scene, at: Vec3) -> f32 {
        self.lamps.iter().map(|&lamp| near(&scene.lights()[lamp], at)).sum()
    }

    /// Returns how many times as likely a photon is sent to a point as a path comes there. `brings`
    /// is the irradiance of the lamp's point across the line of sight per W, 1/m2. If it is a
    /// radiance instead, the result is per sr.
    pub(super) fn rival(
        &self,
        scene: &Scene,
        light: usize,
        at: &Vertex,
        towards: Vec3,
        brings: f32,
    ) -> f32 {
        let Some(Arrival { from, density }) = at.arrival else { return 0.0 };
        let sent = self.chance(scene, light, from) * brings * at.cos(towards);
        if sent > 0.0 { sent / density } else { 0.0 }
    }

    /// Returns the weight, in [0, 1], of a photon that was sent to a point, by the balance
    /// heuristic. `otherwise` gives the density with which a path would go on from there in a
    /// direction, 1/sr.
    pub(super) fn share(
        &self,
        scene: &Scene,
        at: &Vertex,
        origin: &Origin,
        otherwise: impl Fn(Vec3) -> f32,
    ) -> f32 {
        let &Origin { light, towards, irradiance, density } = origin;
        let sent = self.rival(scene, light, at, towards, irradiance);
        let chance = at.chance(scene, light);
        let met = density.map_or(0.0, |density| otherwise(towards) / density);
        // this form also holds where no path comes by itself, so that `sent` is infinite
        if sent > 0.0 { 1.0 / (1.0 + (chance + met) / sent) } else { 0.0 }
    }
}

/// Returns power over squared distance, W/m2.
fn near(lamp: &Light, at: Vec3) -> f32 {
    lamp.power.iter().copied().fold(0.0, f64::max) as f32 * lamp.nearness(at)
}

/// Returns the point of a lamp at which a ray starts, as seen from a `point` of the ray.
pub(super) fn origin(scene: &Scene, light: usize, ray: &Ray, point: Vec3) -> Option<Origin> {
    let away = point - ray.origin;
    let towards = -away.try_normalize()?;
    if let Some(irradiance) = scene.lights()[light].irradiance(away) {
        return Some(Origin { light, towards, irradiance, density: None });
    }
    let distance = away.length();
    let mut nearest: Option<EmitterHit> = None;
    let back = Ray { origin: point, direction: towards };
    scene.emitters_met(&back, f32::INFINITY, |met, hit| {
        let off = |hit: EmitterHit| (hit.t - distance).abs();
        if met == light && nearest.is_none_or(|before| off(hit) < off(before)) {
            nearest = Some(hit);
        }
    });
    let hit = nearest?;
    let density = hit.pdf_toward(point, &back);
    let irradiance = hit.emitted.radiance / density;
    Some(Origin { light, towards, irradiance, density: Some(density) })
}

/// What a ray that goes straight comes to.
pub(super) enum Passage<'a> {
    /// A face of a captor.
    To(&'a Crossing),
    /// A pane or cover, through which it goes.
    Through(&'a Arrived<'a>),
}

/// Follows a ray straight, also through panes and covers, to the first surface that does not let
/// light straight through. Returns its arrival there, and the fraction of the light that comes
/// there, per band. `None` if the ray leaves the scene. `on` receives each face of a captor, pane
/// and cover on the way, with the fraction of the light that comes to it.
pub(super) fn straight<L: Lanes>(
    scene: &Scene,
    mut ray: Ray,
    mut on: impl FnMut(Passage<'_>, &Spectrum<L>),
) -> Option<(Arrived<'_>, Spectrum<L>)> {
    let mut through = Spectrum::splat(scene.lanes(), 1.0);
    for _ in 0..MAX_INTERACTIONS {
        let hit = scene.meet(&ray, |crossing| on(Passage::To(&crossing), &through))?;
        let at = scene.arrived(hit, ray.direction);
        if let Some(captor) = at.surface.captor() {
            let SurfaceHit { t, triangle, point } = hit;
            let front = at.interaction.front;
            on(Passage::To(&Crossing { t, captor, triangle, front, point }), &through);
        }
        let passed = at.material.straight::<L>(ray.direction, at.surface.normal);
        let Some(passed) = passed else { return Some((at, through)) };
        on(Passage::Through(&at), &through);
        through = through * passed;
        ray = at.leave(LobeKind::Straight, ray.direction);
    }
    None
}

/// Follows one photon. For each place where it lands, `on` receives two numbers: how many times as
/// likely the photon is to land there as a path is to come there, and the fraction of the photon's
/// power that the place stands for. If the place is a captor, paths start on it; otherwise they
/// come from where the photon goes to next.
fn follow<L: Lanes>(
    scene: &Scene,
    reflectors: Option<&Reflectors>,
    light: usize,
    rng: &mut Stream,
    mut on: impl FnMut(f32, f32),
) {
    let ray = scene.lights()[light].emit(rng);
    let ratio = |point: Vec3, normal: Vec3, density: f32| {
        let origin = origin(scene, light, &ray, point)?;
        let cos = origin.towards.dot(normal).abs();
        let met = origin.density.map_or(0.0, |density| cos / (std::f32::consts::PI * density));
        Some(origin.irradiance * cos / (density * (1.0 + met)))
    };
    let landed = straight::<L>(scene, ray, |passage, _| {
        let Passage::To(crossing) = passage else { return };
        let captor = &scene.captors()[crossing.captor];
        // of a captor that is a copy its one triangle is placed, and not all of them
        let normal = match captor.kind {
            CaptorKind::Virtual { .. } => scene.crossed_normal(crossing),
            CaptorKind::Surface => scene.triangles().at(crossing.triangle).normal(),
        };
        let density = 1.0 / captor.area as f32;
        if let Some(ratio) = ratio(crossing.point, normal, density)
            && (crossing.front || captor.kind.has_back())
        {
            on(ratio, 1.0);
        }
    });
    let Some((at, _)) = landed else { return };
    let Arrived { hit, surface, .. } = at;
    let scatter = at.material.sample::<L>(&at.interaction, Transport::Light, rng);
    let Some(scatter) = scatter.filter(|scatter| scatter.lobe.is_diffuse()) else { return };
    let onward = at.leave(scatter.lobe, scatter.direction);
    let mut next: Option<(Vec3, f32)> = None;
    let wall = scene.meet(&onward, |crossing| {
        let captor = &scene.captors()[crossing.captor];
        let normal = scene.crossed_normal(&crossing);
        if crossing.front || captor.kind.has_back() {
            next = Some((crossing.point, normal.dot(scatter.direction)));
        }
    });
    if let Some(wall) = wall {
        let normal = scene.surface(wall.triangle).normal;
        next = Some((wall.point, normal.dot(scatter.direction)));
    }
    let Some((next, cos)) = next else { return };
    let cos_here = scatter.direction.dot(surface.normal).abs();
    let free = cos.abs().max(LEAST_COS) * cos_here
        / (std::f32::consts::PI * next.distance_squared(hit.point));
    let rough = |reflectors: &Reflectors| reflectors.rough_density(scene, next, hit.triangle);
    let aimed = reflectors.map_or(0.0, rough);
    if let Some(ratio) = ratio(hit.point, surface.normal, free + aimed) {
        on(ratio, scatter.weight.largest());
    }
}
