//! Next-event estimation at the first visible surfaces, for pictures.

use glam::Vec3;

use super::{
    Path, Pilot,
    choice::{LightChoice, Place},
    next_event_density,
    vertex::Vertex,
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
#[cfg(test)]
pub fn radiance<L: Lanes>(scene: &Scene, ray: Ray, rng: &mut Stream) -> Spectrum<L> {
    let camera = Vertex::new(scene, ray.origin);
    let leg = super::Leg { at: camera, ray, density: None, aimed: None, unbroken: true };
    Path { scene, pilot: &Pilot::NONE, rng, rays: 0, cut_off: false }.follow(leg)
}

/// A point of a scattering surface, to be joined with the lamps, also through thin panes. It serves
/// callers that sample directions at the point and follow them themselves.
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
        let step = Some((surface.normal, surface.offset));
        let at = Vertex { point, step, one_sided, arrival: None, choice };
        Self { scene, seen, at }
    }

    /// Estimates, with one light point, the radiance that the surface sends back along the camera
    /// ray, without the part that [`weight`](Self::weight) leaves to sampled directions.
    pub fn radiance<L: Lanes>(&self, rng: &mut Stream) -> Spectrum<L> {
        let Arrived { material, interaction, .. } = &self.seen;
        let along = |d| material.pdf(interaction, Transport::Importance, d);
        let mut path =
            Path { scene: self.scene, pilot: &Pilot::NONE, rng, rays: 0, cut_off: false };
        let Some((towards, irradiance)) = path.next_event::<L>(&self.at, along) else {
            return Spectrum::splat(self.scene.lanes(), 0.0);
        };
        let Some((arriving, cos)) = self.arriving(towards) else { return irradiance.zero() };
        let f = material.evaluate(&arriving, -interaction.direction);
        f.scaled(cos) * irradiance
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
        let density = material.pdf(interaction, Transport::Importance, ray.direction);
        density / (density + next_event_density(self.scene, &self.at, ray, hit))
    }
}
