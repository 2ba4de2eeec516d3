//! Bright spots: what a lamp lights from close by. From afar a path seldom meets so small a patch, and finds it very
//! bright then. So light is sent from such a lamp as well, and joined with the path where it first lands: another
//! way to the same points, weighed against the path's own by the balance heuristic.

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
        light::{EmitterHit, Light},
        material::{Interaction, Transport},
        world::{Crossing, Scene, SurfaceHit},
    },
    transport::trace::MAX_INTERACTIONS,
};

/// Photons of each light that tell what it lights, and about the most of all lights.
const PHOTONS: u64 = 1024;
const MOST_PHOTONS: u64 = 1 << 17;
/// How many times as likely, in the mean over a lamp's light, it is to land at a point as a path is to come there, from
/// which on light is sent: about what the lamp would add to the relative variance of a path.
const WORTH: f32 = 100.0;
/// The least cosine at the next surface that such a path is taken to have.
const LEAST_COS: f32 = 0.1;

/// The lamps that make bright spots.
pub struct Spots {
    /// Their indices.
    lamps: Vec<usize>,
}

/// A point of a lamp as its light finds it from where it has come to.
pub(super) struct Origin {
    pub light: usize,
    /// Unit vector to it.
    pub towards: Vec3,
    /// As in a [`LightSample`](crate::scene::light::LightSample): 1/m2 per W, times the density of the point.
    irradiance: f32,
    /// 1/sr; none of a point or a line.
    density: Option<f32>,
}

impl Origin {
    /// What it brings to a surface with this normal, 1/m2 per W.
    pub fn irradiance_on(&self, normal: Vec3) -> f32 {
        self.irradiance * self.towards.dot(normal).abs()
    }
}

impl Spots {
    /// Whether light is sent from it.
    pub(super) fn has(&self, light: usize) -> bool {
        self.lamps.binary_search(&light).is_ok()
    }

    /// Finds them by photons that go to their first surface, and on to the next; none where there are none. Where paths
    /// aim at `reflectors`, they come there often enough.
    pub fn find(scene: &Scene, reflectors: Option<&Reflectors>, seed: u64) -> Option<Self> {
        let photons = PHOTONS.min((MOST_PHOTONS / scene.lights.len().max(1) as u64).max(64));
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
        let lamps = (0..scene.lights.len()).filter(|&light| shines(&scene.lights[light]));
        let lamps: Vec<usize> = lamps.filter(is_spot).collect();
        (!lamps.is_empty()).then_some(Self { lamps })
    }

    /// The lamp that light is sent from, for a path at a point, and its chance.
    pub(super) fn choose(&self, scene: &Scene, at: Vec3, rng: &mut Stream) -> (usize, f32) {
        if let [lamp] = self.lamps[..] {
            return (lamp, 1.0);
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

    /// The chance of a light to be chosen.
    fn chance(&self, scene: &Scene, light: usize, at: Vec3) -> f32 {
        match self.lamps[..] {
            [lamp] => f32::from(u8::from(lamp == light)),
            _ if !self.has(light) => 0.0,
            _ => self.chance_of(scene, light, at, self.all(scene, at)),
        }
    }

    /// One half in proportion to power over squared distance, the other half alike.
    fn chance_of(&self, scene: &Scene, lamp: usize, at: Vec3, all: f32) -> f32 {
        0.5 * (near(&scene.lights[lamp], at) / all + 1.0 / self.lamps.len() as f32)
    }

    fn all(&self, scene: &Scene, at: Vec3) -> f32 {
        self.lamps.iter().map(|&lamp| near(&scene.lights[lamp], at)).sum()
    }

    /// How many times as likely light is sent to a point, from a light point that `brings` so much irradiance per W across the line of
    /// sight, as a path comes there. For a radiance instead of an irradiance, the same per sr.
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

    /// The share of light that counts where it was sent to a point, in [0, 1]; `otherwise`: density with which a path would
    /// go on towards its light, 1/sr.
    pub(super) fn share(
        &self,
        scene: &Scene,
        at: &Vertex,
        origin: &Origin,
        otherwise: impl Fn(Vec3) -> f32,
    ) -> f32 {
        let &Origin { light, towards, irradiance, density } = origin;
        let sent = self.rival(scene, light, at, towards, irradiance);
        let chance = at.choice.chance(&scene.lights, light);
        let met = density.map_or(0.0, |density| otherwise(towards) / density);
        // also where no path comes by itself, and it is infinite
        if sent > 0.0 { 1.0 / (1.0 + (chance + met) / sent) } else { 0.0 }
    }
}

/// Power over squared distance, W/m2.
fn near(lamp: &Light, at: Vec3) -> f32 {
    lamp.power.iter().copied().fold(0.0, f64::max) as f32 * lamp.nearness(at)
}

/// The light point at the origin of a ray as seen from a point of it.
pub(super) fn origin(scene: &Scene, light: usize, ray: &Ray, point: Vec3) -> Option<Origin> {
    let away = point - ray.origin;
    let towards = -away.try_normalize()?;
    if let Some(irradiance) = scene.lights[light].irradiance(away) {
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

/// Follows light straight, also through panes and covers, to what else it meets, and what of it comes there; `cross` is told the faces of
/// captors on its way.
pub(super) fn straight<L: Lanes>(
    scene: &Scene,
    mut ray: Ray,
    mut cross: impl FnMut(&Crossing, &Spectrum<L>),
) -> Option<(SurfaceHit, Spectrum<L>)> {
    let mut through = Spectrum::splat(scene.lanes(), 1.0);
    for _ in 0..MAX_INTERACTIONS {
        let hit = scene.meet(&ray, |crossing| cross(&crossing, &through))?;
        let surface = scene.surface(hit.triangle);
        let interaction = Interaction::new(ray.direction, surface.normal);
        if let Some(captor) = surface.captor() {
            let (triangle, front, point) = (hit.triangle, interaction.front, hit.point);
            cross(&Crossing { captor, triangle, front, point }, &through);
        }
        let passed = scene.material(surface).straight::<L>(ray.direction, surface.normal);
        let Some(passed) = passed else { return Some((hit, through)) };
        through = through * passed;
        ray = scene.leave(hit.point, -interaction.normal, ray.direction);
    }
    None
}

/// Follows one photon: for each place where it lands, `on` is told how many times as likely that is as that a path comes
/// there, from the captor it is or from where the light goes to next; and what of the photon this is.
fn follow<L: Lanes>(
    scene: &Scene,
    reflectors: Option<&Reflectors>,
    light: usize,
    rng: &mut Stream,
    mut on: impl FnMut(f32, f32),
) {
    let ray = scene.lights[light].emit(scene.ray_offset(), rng);
    let ratio = |point: Vec3, normal: Vec3, density: f32| {
        let origin = origin(scene, light, &ray, point)?;
        let cos = origin.towards.dot(normal).abs();
        let met = origin.density.map_or(0.0, |density| cos / (std::f32::consts::PI * density));
        Some(origin.irradiance * cos / (density * (1.0 + met)))
    };
    let landed = straight::<L>(scene, ray, |crossing, _| {
        let captor = &scene.captors[crossing.captor];
        let triangle = scene.triangles_of(captor)[crossing.triangle - captor.triangles.start];
        let density = 1.0 / captor.area as f32;
        if let Some(ratio) = ratio(crossing.point, triangle.normal(), density)
            && (crossing.front || captor.kind.has_back())
        {
            on(ratio, 1.0);
        }
    });
    let Some((hit, _)) = landed else { return };
    let surface = scene.surface(hit.triangle);
    let interaction = Interaction::new(ray.direction, surface.normal).on(hit.triangle);
    let scatter = scene.material(surface).sample::<L>(&interaction, Transport::Light, rng);
    let Some(scatter) = scatter.filter(|scatter| scatter.lobe.is_diffuse()) else { return };
    let side = if scatter.lobe.crosses() { -interaction.normal } else { interaction.normal };
    let onward = scene.leave(hit.point, side, scatter.direction);
    let mut next: Option<(Vec3, f32)> = None;
    let wall = scene.meet(&onward, |crossing| {
        let captor = &scene.captors[crossing.captor];
        let normal = scene.captor_triangles()[crossing.triangle].normal();
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
    let at = Vertex::new(&scene.lights, next);
    let aimed = reflectors.map_or(0.0, |reflectors| reflectors.density(scene, &at, hit.triangle));
    if let Some(ratio) = ratio(hit.point, surface.normal, free + aimed) {
        on(ratio, scatter.weight.largest());
    }
}
