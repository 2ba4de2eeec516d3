//! Tube lights that a ray may meet.

use glam::{BVec3, Vec3};

use crate::{
    math::geometry::{Extent, Ray, Triangle, closeness},
    scene::{bvh::Bvh, light::Light},
};

/// Number of lights from which on a tree chooses one of them, and of tubes from which on a search
/// structure finds those that a ray may meet.
pub const MANY: usize = 32;

/// The tubes among the lights and, where they are many, boxes around them by which those that a ray
/// may meet are found.
#[derive(Debug)]
pub struct Tubes {
    /// Indices of the lights, in rising order.
    lights: Vec<usize>,
    /// The boxes, twelve triangles each.
    boxes: Option<Bvh>,
}

impl Tubes {
    /// Finds the tubes.
    pub fn new(lights: &[Light]) -> Self {
        let is_tube = |light: &usize| lights[*light].radius() > 0.0;
        let tubes: Vec<usize> = (0..lights.len()).filter(is_tube).collect();
        if tubes.len() <= MANY {
            return Self { lights: tubes, boxes: None };
        }
        let mut triangles = Vec::with_capacity(12 * tubes.len());
        for &tube in &tubes {
            let extent = lights[tube].extent();
            let reach = extent.min.abs().max(extent.max.abs());
            let Extent { min, max } = extent.wider(4.0 * closeness(reach));
            let corner = |i: usize| {
                let high = BVec3::new(i & 1 != 0, i & 2 != 0, i & 4 != 0);
                Vec3::select(high, max, min)
            };
            // the faces of a cube by the bits of its corners, counter-clockwise from outside
            for [a, b, c, d] in
                [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
            {
                let [a, b, c, d] = [a, b, c, d].map(corner);
                triangles.extend([[a, b, c], [a, c, d]].map(Triangle::from));
            }
        }
        Self { lights: tubes, boxes: Some(Bvh::build(&triangles)) }
    }

    /// Visits the lights that a ray may meet, in rising order.
    #[inline]
    pub fn near(&self, ray: &Ray, mut visit: impl FnMut(usize)) {
        match &self.boxes {
            None => self.lights.iter().for_each(|&light| visit(light)),
            Some(boxes) => {
                let mut met = Vec::new();
                boxes.crossings(ray, f32::INFINITY, |hit| {
                    met.push(self.lights[hit.triangle as usize / 12]);
                });
                met.sort_unstable();
                met.dedup();
                met.into_iter().for_each(visit);
            }
        }
    }
}
