//! The triangles of a captor, for points that are drawn on them.

use std::sync::Arc;

use super::{Scene, triangles::located};
use crate::{
    math::{
        geometry::Triangle,
        sampling::{Chosen, Discrete},
    },
    scene::captor::{Captor, CaptorKind},
};

/// The triangles of a captor. Copies that share their triangles take no memory of their own.
pub struct Outline<'s> {
    scene: &'s Scene,
    /// Index of the first triangle among those of all surfaces, where they are shared.
    first: usize,
    /// The triangles, where they are not shared; else empty.
    own: &'s [Triangle],
    areas: Arc<Discrete>,
}

impl Outline<'_> {
    /// Chooses a triangle in proportion to its area, by a number in [0, 1).
    #[inline]
    pub fn choose(&self, u: f64) -> Chosen {
        self.areas.choose(u)
    }

    /// Returns a triangle of the captor.
    #[inline]
    pub fn triangle(&self, index: usize) -> Triangle {
        match self.own.get(index) {
            Some(triangle) => *triangle,
            None => self.scene.triangles().at(self.first + index),
        }
    }

    /// Returns the triangles, where they are not shared; else nothing.
    pub fn own(&self) -> &[Triangle] {
        self.own
    }
}

impl Scene {
    /// Returns the triangles of a captor, for points that are drawn on them.
    pub fn outline(&self, captor: &Captor) -> Outline<'_> {
        let range = captor.triangles.clone();
        let own = match captor.kind {
            CaptorKind::Virtual { .. } => self.captor_triangles().get(range.clone()),
            CaptorKind::Surface => self.shapes.triangles.get(range.clone()),
        };
        let areas_of = |triangles: &[Triangle]| {
            Arc::new(Discrete::new(triangles.iter().map(|triangle| f64::from(triangle.area()))))
        };
        let areas = match own {
            Some(triangles) => areas_of(triangles),
            None => {
                let located = located(&self.shapes.placed, range.start);
                let (common, prototype) = (
                    &self.common[located.prototype],
                    &self.shapes.placed.prototypes[located.prototype],
                );
                let captor = common.surfaces[located.triangle].captor().unwrap_or_default();
                let triangles = located.triangle..located.triangle + range.len();
                // the areas of all copies are in the same proportion
                let areas = || areas_of(&prototype.triangles[triangles]);
                common.areas[captor].get_or_init(areas).clone()
            }
        };
        Outline { scene: self, first: range.start, own: own.unwrap_or_default(), areas }
    }
}
