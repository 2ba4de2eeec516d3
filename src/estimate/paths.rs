//! Backward paths: what arrives at a captor, found from the captor's side.
//!
//! A path starts at a point uniform on a captor's face, along a direction with density cos / pi.
//! At each point on its way, a light is chosen in proportion to what it may contribute, and joined
//! by a shadow ray (next-event estimation); the path itself may meet a light too, and where both
//! could, each counts by the balance heuristic (Veach 1997, ch. 9). What it cannot find is light of
//! a point or a line that comes by way of a mirror or refraction: [`Unseen`] says how much that is.

mod choice;
mod unseen;

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use crate::{
    captor::{Captor, CaptorKind, Channel},
    geometry::{Frame, Ray, Triangle},
    material::{Encounter, Material, Onward, Transport},
    rng::Stream,
    sampling::{
        Chosen, cosine_hemisphere, cosine_hemisphere_density, uniform_triangle, weighted_choice,
    },
    scene::{LightHit, Scene, Surface},
    spectrum::Spectrum,
    trace::{MAX_INTERACTIONS, MAX_TOTAL_REFLECTIONS},
};
use choice::LightChoice;
pub use unseen::Unseen;

/// What one path says about a face, per band in W or umol/s.
#[derive(Clone, Copy, Debug)]
pub struct PathScore<const N: usize> {
    /// Estimate of the flux on the face.
    pub flux: Spectrum<N>,
    /// Estimate of the power that a surface absorbs of it; zero for a virtual captor.
    pub absorbed: Spectrum<N>,
    /// Rays traced.
    pub rays: u32,
    /// Whether a length limit ended it: what it could still have found is missing.
    pub cut_off: bool,
}

/// The face of a captor that paths start from.
pub struct Face<'a> {
    /// Index of the captor.
    pub captor: usize,
    /// Front or back.
    pub channel: Channel,
    scene: &'a Scene,
    area: f32,
    triangles: &'a [Triangle],
    cumulative_area: Vec<f64>,
}

impl<'a> Face<'a> {
    /// The front or back of a captor of `scene`.
    pub fn new(scene: &'a Scene, captor: usize, channel: Channel) -> Self {
        let of: &Captor = &scene.captors[captor];
        let triangles = scene.triangles_of(of);
        let mut sum = 0.0;
        let add = |triangle: &Triangle| {
            sum += f64::from(triangle.area());
            sum
        };
        let cumulative_area = triangles.iter().map(add).collect();
        Self { captor, channel, scene, area: of.area as f32, triangles, cumulative_area }
    }

    /// Follows one path back from the face.
    pub fn path<const N: usize>(&self, rng: &mut Stream) -> PathScore<N> {
        let Start { triangle, point, normal } = self.start(rng);
        let at = Vertex { point, step: None, one_sided: Some(normal) };
        let density = |direction: Vec3| cosine_hemisphere_density(direction.dot(normal));
        let mut path = Path { scene: self.scene, rng, rays: 0, cut_off: false };

        let direct = path.next_event::<N>(&at, density);
        let direct = direct.map(|(towards, irradiance)| {
            (towards, irradiance.scaled(self.area * towards.dot(normal).max(0.0)))
        });
        let local = cosine_hemisphere(path.rng.square());
        let direction = Frame::new(normal).to_world(local);
        let ray = Ray { origin: point, direction };
        let radiance = path.follow::<N>(at, ray, Some(cosine_hemisphere_density(local.z)));
        let indirect = (direction, radiance.scaled(self.area * PI));

        let Path { rays, cut_off, .. } = path;
        let nothing = Spectrum::ZERO;
        let mut score = PathScore { flux: nothing, absorbed: nothing, rays, cut_off };
        for (direction, flux) in direct.into_iter().chain([indirect]) {
            score.flux = score.flux + flux;
            score.absorbed = score.absorbed + self.absorbed(triangle, direction, flux, rng);
        }
        score
    }

    /// A point of the face, as far off it and from its edges as photons that leave it.
    fn start(&self, rng: &mut Stream) -> Start {
        let scene = self.scene;
        let Chosen { index: triangle, rest } =
            weighted_choice(&self.cumulative_area, rng.uniform_fine());
        let shape = &self.triangles[triangle];
        let front = shape.normal();
        let normal = if self.channel == Channel::Back { -front } else { front };
        let (off, margins) = match self.surface(triangle) {
            Some(surface) => (scene.ray_offset() * normal, surface.margins),
            None => (scene.lift(self.captor) * front, shape.margins(scene.ray_offset())),
        };
        let weights = uniform_triangle(Vec2::new(rest, rng.uniform()));
        let point = shape.point_within(weights.x, weights.y, margins) + off;
        Start { triangle, point, normal }
    }

    /// The surface of a surface captor's triangle.
    fn surface(&self, triangle: usize) -> Option<&'a Surface> {
        let captor = &self.scene.captors[self.captor];
        let surface = || self.scene.surface(captor.triangles.start + triangle);
        (captor.kind == CaptorKind::Surface).then(surface)
    }

    /// What a surface captor absorbs of `flux` that comes from `direction`.
    fn absorbed<const N: usize>(
        &self,
        triangle: usize,
        direction: Vec3,
        flux: Spectrum<N>,
        rng: &mut Stream,
    ) -> Spectrum<N> {
        let Some(surface) = self.surface(triangle) else { return Spectrum::ZERO };
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

/// For pictures to be compared with: one path's estimate of the radiance that comes along `ray` towards its origin, per band, W/m2/sr or
/// umol/m2/s/sr.
#[cfg(test)]
pub fn radiance<const N: usize>(scene: &Scene, ray: Ray, rng: &mut Stream) -> Spectrum<N> {
    let eye = Vertex { point: ray.origin, step: None, one_sided: None };
    Path { scene, rng, rays: 0, cut_off: false }.follow(eye, ray, None)
}

/// A surface that scatters, joined with the lamps, also through thin panes: for whoever follows its
/// scattering further.
pub struct Joined<'a> {
    scene: &'a Scene,
    surface: &'a Surface,
    encounter: Encounter,
    at: Vertex,
}

impl<'a> Joined<'a> {
    /// A `point` of a `surface`, met by a path from an eye.
    pub fn new(scene: &'a Scene, surface: &'a Surface, encounter: Encounter, point: Vec3) -> Self {
        let one_sided = !scene.material(surface).transmits_diffusely();
        let one_sided = one_sided.then_some(encounter.normal);
        Self {
            scene,
            surface,
            encounter,
            at: Vertex { point, step: Some(surface.normal), one_sided },
        }
    }

    /// One light point's estimate of the radiance sent back along the path, less what
    /// [`weight`](Self::weight) leaves to directions that are sampled.
    pub fn radiance<const N: usize>(&self, rng: &mut Stream) -> Spectrum<N> {
        let material = self.scene.material(self.surface);
        let along = |d| material.density(&self.encounter, Transport::Importance, d);
        let mut path = Path { scene: self.scene, rng, rays: 0, cut_off: false };
        let Some((towards, irradiance)) = path.next_event::<N>(&self.at, along) else {
            return Spectrum::ZERO;
        };
        let arriving = Encounter::new(-towards, self.surface.normal);
        let f = material.evaluate(&arriving, -self.encounter.direction);
        f.scaled(arriving.cos) * irradiance
    }

    /// What a lamp counts that a sampled direction meets straight or through panes.
    pub fn weight(&self, ray: &Ray, hit: &LightHit) -> f32 {
        let material = self.scene.material(self.surface);
        let density = material.density(&self.encounter, Transport::Importance, ray.direction);
        density / (density + next_event_density(self.scene, &self.at, ray, hit))
    }
}

/// Where a path starts.
struct Start {
    /// Index among the captor's triangles.
    triangle: usize,
    point: Vec3,
    /// Normal of the face.
    normal: Vec3,
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

struct Path<'a, 'r> {
    scene: &'a Scene,
    rng: &'r mut Stream,
    rays: u32,
    cut_off: bool,
}

impl Path<'_, '_> {
    /// Light from one light point: the direction towards it, and its irradiance across that
    /// direction over the density of the choice, weighted against `otherwise`, the density with
    /// which a path would go there by itself.
    fn next_event<const N: usize>(
        &mut self,
        at: &Vertex,
        otherwise: impl Fn(Vec3) -> f32,
    ) -> Option<(Vec3, Spectrum<N>)> {
        let scene = self.scene;
        let (light, chance) = LightChoice::new(&scene.lights, at).choose(self.rng.uniform())?;
        let light = &scene.lights[light];
        let sample = light.illuminate(at.point, scene.ray_offset(), self.rng)?;
        let towards = (sample.point - at.point).try_normalize()?;
        let step = |normal: Vec3| scene.ray_offset() * normal * normal.dot(towards).signum();
        let origin = at.point + at.step.map_or(Vec3::ZERO, step);
        self.rays += 1;
        let visible: Spectrum<N> = scene.visibility(origin, sample.point)?;
        let weight = match sample.density {
            Some(density) => density * chance / (density * chance + otherwise(towards)),
            None => 1.0,
        };
        let power = power::<N>(&light.power);
        Some((towards, power.scaled(sample.irradiance * weight / chance) * visible))
    }

    /// Radiance that arrives along `ray`, whose direction was chosen at `at` with `density` (none from
    /// a mirror or an eye, which no light point is joined with): all of it but what a light point
    /// chosen at `at` counts for.
    fn follow<const N: usize>(
        &mut self,
        mut at: Vertex,
        mut ray: Ray,
        mut density: Option<f32>,
    ) -> Spectrum<N> {
        let scene = self.scene;
        let (mut radiance, mut throughput) = (Spectrum::ZERO, Spectrum::ONE);
        let mut total_reflections = 0;
        for _ in 0..MAX_INTERACTIONS {
            self.rays += 1;
            let hit = scene.closest(&ray);
            // a light with a material lies in a surface: reach as far as its lift
            let t_max = hit.map_or(f32::INFINITY, |hit| hit.t + scene.ray_offset());
            scene.lights_hit(&ray, t_max, |hit| {
                let weight = density.map_or(1.0, |density| {
                    density / (density + next_event_density(scene, &at, &ray, &hit))
                });
                let power = power::<N>(&scene.lights[hit.light].power);
                radiance = radiance + throughput * power.scaled(weight * hit.shine.radiance);
            });

            let Some(hit) = hit else { return radiance };
            let surface = scene.surface(hit.triangle);
            let material = scene.material(surface);
            let encounter = Encounter::new(ray.direction, surface.normal);
            let here = Vertex {
                point: hit.point,
                step: Some(surface.normal),
                one_sided: matches!(material, Material::Lambert(_)).then_some(encounter.normal),
            };
            let along = |d| material.density(&encounter, Transport::Importance, d);
            if material.is_diffuse()
                && let Some((towards, irradiance)) = self.next_event::<N>(&here, along)
            {
                let arriving = Encounter::new(-towards, surface.normal);
                let f: Spectrum<N> = material.evaluate(&arriving, -ray.direction);
                radiance = radiance + throughput * f.scaled(arriving.cos) * irradiance;
            }

            let scatter = material.sample::<N>(&encounter, Transport::Importance, self.rng);
            let Some(scatter) = scatter else { return radiance };
            throughput = throughput * scatter.factor;
            total_reflections = if scatter.total_reflection { total_reflections + 1 } else { 0 };
            if throughput.is_zero() {
                return radiance;
            }
            if total_reflections == MAX_TOTAL_REFLECTIONS {
                break;
            }
            match scatter.onward {
                // what is beyond a pane can be joined with the vertex before it
                Onward::Straight => {}
                Onward::Specular => density = None,
                Onward::Diffuse => (at, density) = (here, Some(along(scatter.direction))),
            }
            let side = if scatter.crosses { -encounter.normal } else { encounter.normal };
            ray = scene.leave(hit.point, side, scatter.direction);
        }
        self.cut_off = true;
        radiance
    }
}

/// Density with which [`Path::next_event`] at `at` chooses the direction of `hit`.
fn next_event_density(scene: &Scene, at: &Vertex, ray: &Ray, hit: &LightHit) -> f32 {
    let chance = LightChoice::new(&scene.lights, at).chance(hit.light);
    let d2 = ray.at(hit.t).distance_squared(at.point);
    chance * d2 / (hit.shine.area * hit.cos)
}

/// A light's power in lanes.
pub fn power<const N: usize>(power: &[f64]) -> Spectrum<N> {
    Spectrum(std::array::from_fn(|b| power.get(b).map_or(0.0, |p| *p as f32)))
}
