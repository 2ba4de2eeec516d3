//! What a point of the scene sees of the lights.

use glam::Vec3;

use super::Scene;
use crate::{
    math::{
        geometry::Ray,
        spectrum::{Lanes, Spectrum},
    },
    scene::{
        daylight::InfiniteLight,
        light::EmittedRadiance,
        material::{Interaction, Material},
    },
};

/// A ray's meeting with the bright side of a light.
#[derive(Clone, Copy, Debug)]
pub struct LightHit {
    /// Index of the light.
    pub light: usize,
    /// Distance along the ray, m.
    pub t: f32,
    /// Cosine to the light's normal, above 0.
    pub cos: f32,
    /// How bright it is.
    pub shine: EmittedRadiance,
}

impl Scene {
    /// Every light surface that a ray meets on its bright side before `t_max`, in any order.
    pub fn lights_hit(&self, ray: &Ray, t_max: f32, mut visit: impl FnMut(LightHit)) {
        for (light, shape) in self.lights.iter().enumerate() {
            if let Some(hit) = shape.tube_hit(ray).filter(|hit| hit.t < t_max) {
                visit(LightHit { light, t: hit.t, cos: hit.cos, shine: hit.shine });
            }
        }
        if self.light_triangles.is_empty() {
            return;
        }
        self.light_bvh.crossings(ray, t_max, |hit| {
            let light = self.light_of_triangle[hit.triangle as usize] as usize;
            let normal = self.light_triangles[hit.triangle as usize].normal();
            let cos = -ray.direction.dot(normal);
            if let Some(shine) = self.lights[light].shine(ray.direction, cos) {
                visit(LightHit { light, t: hit.t, cos: cos.abs(), shine });
            }
        });
    }

    /// The lights at infinity, with their indices.
    pub fn infinite_lights(&self) -> impl Iterator<Item = (usize, &InfiniteLight)> {
        let infinite = self.infinite.iter();
        infinite.filter_map(|&l| Some((l, &self.lights[l].entrance()?.light)))
    }

    /// What of the light goes straight from one point to another, per band: all, nothing, or what
    /// thin panes let through.
    pub fn visibility<L: Lanes>(&self, from: Vec3, to: Vec3) -> Option<Spectrum<L>> {
        let distance = from.distance(to);
        let ray = Ray { origin: from, direction: (to - from) / distance };
        self.visibility_along(&ray, distance)
    }

    /// The same along a ray, as far as `distance`, m.
    pub fn visibility_along<L: Lanes>(&self, ray: &Ray, distance: f32) -> Option<Spectrum<L>> {
        let mut through = Spectrum::splat(self.lanes(), 1.0);
        let occluded = self.shapes.surface_bvh.occluded(ray, distance, |hit| {
            let surface = &self.surfaces[hit.triangle as usize];
            let Material::Pane(pane) = self.material(surface) else { return true };
            // an edge between two triangles of a pane counts once
            if hit.owned {
                let interaction = Interaction::new(ray.direction, surface.normal);
                through = through.clone() * pane.transmittance(&interaction);
            }
            false
        });
        (!occluded).then_some(through)
    }
}
