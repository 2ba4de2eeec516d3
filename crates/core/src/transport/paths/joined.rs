//! Next-event estimation at the first visible surfaces, for pictures.

use glam::Vec3;

use super::{
    choice::{LightChoice, Place},
    next_event_density, toward,
    vertex::Vertex,
    visibility,
};
use crate::{
    math::{
        geometry::Ray,
        rng::Stream,
        spectrum::{Lanes, Spectrum},
    },
    scene::{
        light::LightHit,
        material::{Interaction, Scatterer, Transport},
        world::{Arrived, Scene},
    },
};

/// Returns one path's estimate of the radiance that comes along `ray` towards its origin, per band,
/// W/m2/sr or umol/m2/s/sr. Tests compare pictures with it.
#[doc(hidden)]
pub fn radiance<L: Lanes>(scene: &Scene, ray: Ray, rng: &mut Stream) -> Spectrum<L> {
    let camera = Vertex::new(scene, ray.origin);
    let leg = super::Leg { at: camera, ray, density: None, aimed: None, unbroken: true };
    let pilot = &super::Pilot::NONE;
    super::Path { scene, pilot, rng, rays: 0, cut_off: false }.follow(leg, &mut ())
}

/// A point of a scattering surface, to be joined with the lamps, also through thin panes. It serves
/// callers that sample directions at the point and follow them themselves.
#[derive(Clone, Copy)]
pub struct Joined<'a> {
    scene: &'a Scene,
    seen: Arrived<'a>,
    at: Vertex,
}

impl<'a> Joined<'a> {
    /// Takes a point that a camera ray meets. It is of the material that is given with it, which
    /// may be another than that of the surface.
    pub fn new(scene: &'a Scene, seen: Arrived<'a>) -> Self {
        let (point, surface) = (seen.hit.point, &seen.surface);
        let one_sided = (!seen.material.transmits_diffusely()).then_some(seen.interaction.normal);
        let choice = LightChoice::new(scene, Place { point, one_sided });
        let step = Some((surface.normal, surface.offset_at(point)));
        let at = Vertex { point, step, one_sided, arrival: None, choice };
        Self { scene, seen, at }
    }

    /// Estimates, with one light point, the radiance that the surface sends back along the camera
    /// ray, without the part that [`weight`](Self::weight) leaves to sampled directions; and the
    /// mean of the radiance that arrives straight from lamps over the directions of a further
    /// `lobe`, which gives their density, 1/sr, without the part that
    /// [`weight_in`](Self::weight_in) leaves to them.
    pub fn radiance<L: Lanes>(
        &self,
        lobe: impl Fn(Vec3) -> f32,
        rng: &mut Stream,
    ) -> [Spectrum<L>; 2] {
        let none = || Spectrum::splat(self.scene.lanes(), 0.0);
        let Some((towards, radiance, own)) = self.light_point::<L>(rng) else {
            return [none(), none()];
        };
        let Arrived { material, interaction, .. } = &self.seen;
        let weight = |density: f32| own.map_or(1.0, |own| own / (own + density));
        let density = lobe(towards);
        let in_lobe = radiance.clone().scaled(density * weight(density));
        let Some((arriving, cos)) = self.arriving(towards) else { return [none(), in_lobe] };
        let weight = weight(material.pdf(interaction, Transport::Importance, towards));
        let f = material.evaluate(&arriving, -interaction.direction);
        [f.scaled(cos * weight) * radiance, in_lobe]
    }

    /// Chooses a light point as [`Path::next_event`] does. Returns the direction towards it, and its
    /// radiance divided by the density of the choice. That density, 1/sr, comes with it where the
    /// light has a size.
    fn light_point<L: Lanes>(&self, rng: &mut Stream) -> Option<(Vec3, Spectrum<L>, Option<f32>)> {
        let Self { scene, at, .. } = self;
        let (light, chance) = at.choose(scene, None, rng)?;
        let sample = scene.sample_toward::<L>(light, at.point, rng)?;
        let towards = toward(at, &sample)?;
        let visible = visibility(scene, light, at, &sample, towards)?;
        let own = sample.pdf.map(|pdf| pdf * chance);
        Some((towards, sample.radiance_over_pdf.scaled(1.0 / chance) * visible, own))
    }

    /// Returns how light from a direction, a unit vector, arrives, and the cosine by which its
    /// irradiance counts. It is that to the normal of the interaction, which a picture may have
    /// smoothed. `None` if the light comes to different sides of this normal and of the triangle, so
    /// that none leaks to a triangle that turns away from it.
    fn arriving(&self, towards: Vec3) -> Option<(Interaction, f32)> {
        let Arrived { interaction: seen, hit, .. } = &self.seen;
        let (flat, smooth) = (self.seen.facing(), seen.normal);
        if flat == smooth {
            let arriving = self.seen.along(-towards);
            return Some((arriving, arriving.cos));
        }
        let [own, cos] = [flat, smooth].map(|normal| normal.dot(towards));
        let front = if seen.front { smooth } else { -smooth };
        let arriving = Interaction::new(-towards, front).on(hit.triangle);
        (own * cos > 0.0).then_some((arriving, arriving.cos))
    }

    /// Returns the weight, in [0, 1], of a light that a sampled direction meets, straight or
    /// through panes.
    pub fn weight(&self, ray: &Ray, hit: &LightHit) -> f32 {
        let Arrived { material, interaction, .. } = &self.seen;
        self.weight_in(material.pdf(interaction, Transport::Importance, ray.direction), ray, hit)
    }

    /// Returns this weight for a direction that was sampled with a `density`, 1/sr.
    pub fn weight_in(&self, density: f32, ray: &Ray, hit: &LightHit) -> f32 {
        let all = density + next_event_density(self.scene, &self.at, ray, hit);
        density / all.max(f32::MIN_POSITIVE)
    }
}
