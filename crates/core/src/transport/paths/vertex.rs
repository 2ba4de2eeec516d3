//! The points of a path at which light is gathered.

use glam::Vec3;

use super::choice::{LightChoice, Place};
use crate::{
    math::rng::Stream,
    scene::{
        material::{Material, Scatterer},
        world::{Arrived, Scene},
    },
};

/// The way by which a path came to a point.
#[derive(Clone, Copy)]
pub(super) struct Arrival {
    /// The previous point of the path or, at the start of a path, the middle of the captor.
    pub from: Vec3,
    /// Density of the points to which the path might have come from there, 1/m2.
    pub density: f32,
}

/// A point at which light is gathered.
#[derive(Clone, Copy)]
pub(super) struct Vertex {
    pub point: Vec3,
    /// Normal of the surface that a shadow ray must step off, towards either side, and how far, m.
    /// `None` if the point is not on a surface, or is off it already.
    pub step: Option<(Vec3, f32)>,
    /// Normal of the only side from which light counts. `None` if light counts from both sides.
    pub one_sided: Option<Vec3>,
    /// How a path came here. `None` where no photon can be sent.
    pub arrival: Option<Arrival>,
    /// The chances of the lights to be joined with the point.
    pub choice: LightChoice,
}

impl Vertex {
    /// Creates a point that is on no surface: light counts from all directions.
    pub fn new(scene: &Scene, point: Vec3) -> Self {
        let choice = LightChoice::new(scene, Place { point, one_sided: None });
        Self { point, step: None, one_sided: None, arrival: None, choice }
    }

    /// Creates a point of a surface, to which a path has come.
    #[inline(always)]
    pub fn on(scene: &Scene, at: &Arrived) -> Self {
        let (point, surface) = (at.hit.point, &at.surface);
        let one_sided =
            matches!(at.material, Material::Lambert(_)).then_some(at.interaction.normal);
        // a surface that only mirrors or transmits is joined with no light
        let choice = match at.material.is_diffuse() {
            true => LightChoice::new(scene, Place { point, one_sided }),
            false => LightChoice::default(),
        };
        let step = Some((surface.normal, surface.offset_at(point)));
        Self { point, step, one_sided, arrival: None, choice }
    }

    /// Chooses a light to be joined with the point, as [`LightChoice::choose`].
    #[inline]
    pub fn choose(
        &self,
        scene: &Scene,
        number: Option<f32>,
        rng: &mut Stream,
    ) -> Option<(usize, f32)> {
        self.choice.choose(scene, self.place(), number, rng)
    }

    /// Returns the chance with which a light is chosen, in [0, 1].
    #[inline]
    pub fn chance(&self, scene: &Scene, light: usize) -> f32 {
        self.choice.chance(scene, self.place(), light)
    }

    fn place(&self) -> Place {
        Place { point: self.point, one_sided: self.one_sided }
    }

    /// Returns the point, off its surface on the side of a direction.
    pub fn off(&self, direction: Vec3) -> Vec3 {
        let step = |(normal, offset): (Vec3, f32)| offset * normal.dot(direction).signum() * normal;
        self.point + self.step.map_or(Vec3::ZERO, step)
    }

    /// Returns the absolute cosine between a direction and the normal of the surface; 0 without a
    /// surface.
    pub fn cos(&self, direction: Vec3) -> f32 {
        let normal = self.step.map(|(normal, _)| normal);
        normal.or(self.one_sided).map_or(0.0, |normal| normal.dot(direction).abs())
    }
}
