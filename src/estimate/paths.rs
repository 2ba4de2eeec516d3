//! Backward paths: the same irradiance as the photons', from the captor's side.
//!
//! A path starts at a point uniform on a captor's face, along a direction with density cos / pi.
//! At each point on its way, one light is chosen in proportion to what it may contribute, and
//! joined by a shadow ray (next-event estimation); the path itself may meet a light too, and
//! where both could, each counts by the balance heuristic (Veach 1997, ch. 9). What it cannot find
//! is light of a point or a line that comes by way of a mirror or refraction: [`unseen`] says how
//! much that is.

use std::f32::consts::PI;

use glam::Vec3;

use crate::{
    captor::{Captor, CaptorKind, Channel},
    geometry::{Frame, Ray, Triangle},
    light::{Light, Strata},
    material::{Encounter, Material, Transport},
    rng::Stream,
    sampling::{cosine_hemisphere, uniform_triangle},
    scene::{LightHit, Scene},
    spectrum::Spectrum,
    trace::{Event, Onward, trace},
};

/// Interactions after which a path is given up.
const MAX_INTERACTIONS: u32 = 10_000;

/// What one path says about a face: flux that arrives and, for a surface, power absorbed, per
/// band in W or umol/s.
#[derive(Clone, Copy, Debug)]
pub struct PathScore<const N: usize> {
    /// Estimate of the flux on the face.
    pub flux: Spectrum<N>,
    /// Estimate of the power absorbed from that flux.
    pub absorbed: Spectrum<N>,
    /// Rays traced.
    pub rays: u32,
}

/// The face of a captor that paths start from.
pub struct Face<'a> {
    scene: &'a Scene,
    triangles: &'a [Triangle],
    first_triangle: usize,
    cumulative_area: Vec<f64>,
    /// 1 for the front, -1 for the back.
    side: f32,
    surface: bool,
    lift: f32,
}

impl<'a> Face<'a> {
    /// The front or back of a captor of `scene`.
    pub fn new(scene: &'a Scene, captor: usize, face: Channel) -> Self {
        let index = captor;
        let captor: &Captor = &scene.captors[captor];
        let triangles = scene.triangles_of(captor);
        let mut area = 0.0;
        let cumulative_area = triangles
            .iter()
            .map(|t| {
                area += f64::from(t.area());
                area
            })
            .collect();
        Self {
            scene,
            triangles,
            first_triangle: captor.triangles.start,
            cumulative_area,
            side: if face == Channel::Back { -1.0 } else { 1.0 },
            surface: captor.kind == CaptorKind::Surface,
            lift: scene.lift(index),
        }
    }

    /// Follows one path back from the face.
    pub fn path<const N: usize>(&self, rng: &mut Stream) -> PathScore<N> {
        let scene = self.scene;
        let area = self.cumulative_area[self.cumulative_area.len() - 1];
        let target = rng.uniform_fine() * area;
        let chosen = self.cumulative_area.partition_point(|a| *a <= target);
        let chosen = chosen.min(self.triangles.len() - 1);
        let triangle = &self.triangles[chosen];
        let weights = uniform_triangle(rng.square());
        let front = triangle.normal();
        let normal = self.side * front;
        let mut point = triangle.point(weights.x, weights.y) + self.lift * front;
        if self.surface {
            point += scene.ray_offset() * normal;
        }

        let mut path = Path { scene, rng, rays: 0 };
        let mut score = PathScore { flux: Spectrum::ZERO, absorbed: Spectrum::ZERO, rays: 0 };
        let area = area as f32;
        let absorb = |direction: Vec3, flux: Spectrum<N>, rng: &mut Stream| match self.surface {
            true => self.absorbed(chosen, direction, flux, rng),
            false => Spectrum::ZERO,
        };

        // light that comes straight: a sampled light point against a cosine-distributed direction
        let at = Vertex { point, step: None, one_sided: Some(normal) };
        if let Some((towards, light)) = path.next_event(&at, |d| d.dot(normal).max(0.0) / PI) {
            let flux = light.scaled(area * towards.dot(normal).max(0.0));
            score.flux = add(score.flux, flux);
            score.absorbed = add(score.absorbed, absorb(towards, flux, path.rng));
        }
        let local = cosine_hemisphere(path.rng.square());
        let direction = Frame::new(normal).to_world(local);
        let start = Start { at, ray: Ray { origin: point, direction }, density: local.z / PI };
        let flux = path.follow(start, Spectrum([area * PI; N]));
        score.flux = add(score.flux, flux);
        score.absorbed = add(score.absorbed, absorb(direction, flux, path.rng));
        score.rays = path.rays;
        score
    }

    /// What a surface captor absorbs of `flux` that comes from `direction`.
    fn absorbed<const N: usize>(
        &self,
        triangle: usize,
        direction: Vec3,
        flux: Spectrum<N>,
        rng: &mut Stream,
    ) -> Spectrum<N> {
        let surface = self.scene.surface(self.first_triangle + triangle);
        let encounter = Encounter::new(-direction, surface.normal);
        let material = self.scene.material(surface);
        match material.absorptance(&encounter) {
            Some(absorptance) => flux * absorptance,
            // no closed form: what one photon would leave behind
            None => match material.sample::<N>(&encounter, Transport::Light, rng) {
                Some(scatter) => flux.zip(scatter.factor, |f, factor| f * (1.0 - factor)),
                None => flux,
            },
        }
    }
}

/// Histories of the run that tells what paths cannot find.
const TRIAL: u64 = 50_000;

/// The share per band of the flux on captors that comes from a point or line light by way of a
/// mirror or refraction before its first diffuse scattering: no path can find it. From a short
/// photon run; none where the scene has no such light, or nothing smooth.
pub fn unseen<const N: usize>(scene: &Scene, seed: u64) -> Option<Vec<f64>> {
    let smooth = scene.materials.iter().any(|m| m.material.has_mirror());
    if !smooth || !scene.lights.iter().any(Light::is_delta) {
        return None;
    }
    let bands = scene.bands.len();
    let (mut all, mut hidden) = (vec![0.0; bands], vec![0.0; bands]);
    let strata = Strata::new(&scene.lights, TRIAL.max(2 * scene.lights.len() as u64), N);
    for index in 0..strata.histories() {
        let l = strata.light(index);
        let weights = strata.weights(l);
        let light = &scene.lights[l];
        let mut rng = Stream::new(seed, 0, index);
        let ray = light.emit(scene.ray_offset(), &mut rng);
        let power = Spectrum(std::array::from_fn(|b| f32::from(weights[b] > 0.0)));
        let (mut mirrored, mut diffused) = (false, false);
        trace(scene, ray, power, &mut rng, |event: Event<'_, N>| {
            let (counts, power) = match &event {
                Event::Crossing { power, .. } => (true, power),
                Event::Arrival { surface, power, .. } => (surface.captor().is_some(), power),
                Event::Escaped(_) | Event::Lost(_) => return,
            };
            if counts {
                let is_hidden = light.is_delta() && mirrored;
                for b in 0..bands {
                    let flux = f64::from(power.0[b]) * weights[b];
                    all[b] += flux;
                    hidden[b] += if is_hidden { flux } else { 0.0 };
                }
            }
            if let Event::Arrival { onward, .. } = event {
                mirrored |= onward == Some(Onward::Specular) && !diffused;
                diffused |= onward == Some(Onward::Diffuse);
            }
        });
    }
    Some(hidden.iter().zip(&all).map(|(h, a)| if *a > 0.0 { h / a } else { 0.0 }).collect())
}

fn add<const N: usize>(a: Spectrum<N>, b: Spectrum<N>) -> Spectrum<N> {
    a.zip(b, |a, b| a + b)
}

/// A point that light is gathered at.
#[derive(Clone, Copy)]
struct Vertex {
    point: Vec3,
    /// Normal of the surface that a shadow ray must step off, on either side.
    step: Option<Vec3>,
    /// Normal of the only side that light counts from.
    one_sided: Option<Vec3>,
}

/// A direction chosen at a vertex, and its density; 0 stands for a mirror.
struct Start {
    at: Vertex,
    ray: Ray,
    density: f32,
}

struct Path<'a, 'r> {
    scene: &'a Scene,
    rng: &'r mut Stream,
    rays: u32,
}

impl Path<'_, '_> {
    /// Light from one light point: the direction towards it, and radiance x solid angle / density,
    /// weighted against `density`, with which that direction would be chosen otherwise.
    fn next_event<const N: usize>(
        &mut self,
        at: &Vertex,
        density: impl Fn(Vec3) -> f32,
    ) -> Option<(Vec3, Spectrum<N>)> {
        let scene = self.scene;
        let choice = LightChoice::new(scene, at);
        let mut rest = self.rng.uniform();
        let chances = (0..scene.lights.len()).map(|l| (l, choice.chance(l)));
        let (l, chance) = chances.filter(|(_, chance)| *chance > 0.0).find(|(_, chance)| {
            rest -= chance;
            rest < 0.0
        })?;
        let light = &scene.lights[l];
        let sample = light.illuminate(at.point, scene.ray_offset(), self.rng)?;
        let towards = (sample.point - at.point).normalize();
        let step = |normal: Vec3| scene.ray_offset() * normal * normal.dot(towards).signum();
        let origin = at.point + at.step.map_or(Vec3::ZERO, step);
        self.rays += 1;
        let visible: Spectrum<N> = scene.visibility(origin, sample.point)?;
        let otherwise = density(towards);
        let weight = match sample.density {
            Some(own) => own * chance / (own * chance + otherwise),
            None => 1.0,
        };
        let scale = sample.irradiance * weight / chance;
        let power = |b: usize| light.power.get(b).map_or(0.0, |p| *p as f32);
        let light = Spectrum(std::array::from_fn(|b| power(b) * scale));
        Some((towards, light * visible))
    }

    /// Follows a path and adds up the light that it finds, times `throughput`.
    fn follow<const N: usize>(&mut self, start: Start, mut throughput: Spectrum<N>) -> Spectrum<N> {
        let scene = self.scene;
        let mut found = Spectrum::ZERO;
        let Start { mut at, mut ray, mut density } = start;
        for _ in 0..MAX_INTERACTIONS {
            self.rays += 1;
            let hit = scene.closest(&ray);
            // a light with a material lies in a surface: reach as far as its lift
            let t_max = hit.map_or(f32::INFINITY, |hit| hit.t + scene.ray_offset());
            scene.lights_hit(&ray, t_max, |hit| {
                let light = &scene.lights[hit.light];
                let other = if density > 0.0 { self.light_density(&at, &hit) } else { 0.0 };
                let weight = if other > 0.0 { density / (density + other) } else { 1.0 };
                let scale = weight * hit.shine.radiance;
                for b in 0..light.power.len() {
                    found.0[b] += throughput.0[b] * light.power[b] as f32 * scale;
                }
            });

            let Some(hit) = hit else { break };
            let surface = scene.surface(hit.triangle);
            let material = scene.material(surface);
            let encounter = Encounter::new(ray.direction, surface.normal);
            let opaque = matches!(material, Material::Lambert(_));
            at = Vertex {
                point: hit.point,
                step: Some(surface.normal),
                one_sided: opaque.then_some(encounter.normal),
            };
            if material.is_diffuse() {
                let density = |d| material.density(&encounter, Transport::Importance, d);
                if let Some((towards, light)) = self.next_event(&at, density) {
                    let arriving = Encounter::new(-towards, surface.normal);
                    let f: Spectrum<N> = material.evaluate(&arriving, -ray.direction);
                    found = add(found, throughput * f.scaled(arriving.cos) * light);
                }
            }
            let Some(scatter) = material.sample::<N>(&encounter, Transport::Importance, self.rng)
            else {
                break;
            };
            throughput = throughput * scatter.factor;
            if throughput.is_zero() {
                break;
            }
            density = match scatter.specular {
                true => 0.0,
                false => material.density(&encounter, Transport::Importance, scatter.direction),
            };
            let side = if scatter.crosses { -encounter.normal } else { encounter.normal };
            ray = scene.leave(hit.point, side, scatter.direction);
        }
        found
    }

    /// Density with which [`next_event`](Self::next_event) at `at` chooses the direction of `hit`.
    fn light_density(&self, at: &Vertex, hit: &LightHit) -> f32 {
        let chance = LightChoice::new(self.scene, at).chance(hit.light);
        chance * hit.t * hit.t / (hit.shine.area * hit.cos)
    }
}

/// The chances of the lights at a vertex: one half in proportion to what each may contribute
/// there; the other half alike, for a dim lamp in a room that a bright one does not reach.
struct LightChoice<'a> {
    scene: &'a Scene,
    at: Vertex,
    total: f32,
    count: usize,
}

impl<'a> LightChoice<'a> {
    fn new(scene: &'a Scene, at: &Vertex) -> Self {
        let mut choice = Self { scene, at: *at, total: 0.0, count: 0 };
        for l in 0..scene.lights.len() {
            let importance = choice.importance(l);
            choice.total += importance;
            choice.count += usize::from(importance > 0.0);
        }
        choice
    }

    /// About the irradiance of light `l` at the vertex; zero only where it sheds none directly.
    fn importance(&self, l: usize) -> f32 {
        let light = &self.scene.lights[l];
        let power = light.power.iter().copied().fold(0.0, f64::max) as f32;
        if power > 0.0 { power * light.importance(self.at.point, self.at.one_sided) } else { 0.0 }
    }

    fn chance(&self, l: usize) -> f32 {
        let importance = self.importance(l);
        if importance == 0.0 {
            return 0.0;
        }
        0.5 * (importance / self.total + 1.0 / self.count as f32)
    }
}
