//! The shapes of a captor, for points that are drawn on them.

use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::{Scene, triangles::located};
use crate::{
    math::{
        geometry::Triangle,
        rng::Stream,
        round::Round,
        sampling::{Discrete, uniform_triangle},
    },
    scene::captor::{Captor, CaptorKind},
};

/// The shapes of a captor: triangles, or one disc or sphere. Copies that share their triangles take
/// no memory of their own.
pub struct Outline<'s> {
    scene: &'s Scene,
    /// Index of the first triangle among those of all surfaces, where they are shared.
    first: usize,
    /// The triangles, where they are not shared; else empty.
    own: &'s [Triangle],
    /// Their areas, or those of shared triangles.
    areas: Option<Arc<Discrete>>,
    round: Option<&'s Round>,
}

/// A shape of a captor.
pub enum Shape<'s> {
    /// A triangle.
    Triangle(Triangle),
    /// A disc or sphere.
    Round(&'s Round),
}

impl Shape<'_> {
    /// Returns the point that numbers have chosen, rounded: the barycentric weights of the corners b
    /// and c of a triangle, or the numbers of [`Round::point`].
    pub fn point(&self, at: Vec2) -> Vec3 {
        match self {
            Self::Triangle(triangle) => triangle.point(at.x, at.y),
            Self::Round(round) => round.point(at).as_vec3(),
        }
    }

    /// Returns the unit normal of the front at a point.
    pub fn normal_at(&self, point: Vec3) -> Vec3 {
        match self {
            Self::Triangle(triangle) => triangle.normal(),
            Self::Round(round) => round.normal_at(point),
        }
    }
}

impl<'s> Outline<'s> {
    /// Draws a place, uniform over the area: the index of a shape, and the numbers of a
    /// [point](Shape::point) on it.
    #[inline]
    pub fn choose(&self, rng: &mut Stream) -> (usize, Vec2) {
        let first = rng.uniform_fine();
        match &self.areas {
            Some(areas) => {
                let chosen = areas.choose(first);
                (chosen.index, uniform_triangle(Vec2::new(chosen.rest, rng.uniform())))
            }
            None => (0, Vec2::new(first as f32, rng.uniform())),
        }
    }

    /// Returns a shape of the captor.
    #[inline]
    pub fn shape(&self, index: usize) -> Shape<'s> {
        match (self.round, self.own.get(index)) {
            (Some(round), _) => Shape::Round(round),
            (None, Some(triangle)) => Shape::Triangle(*triangle),
            (None, None) => Shape::Triangle(self.scene.triangles().at(self.first + index)),
        }
    }

    /// Returns the triangles, where they are not shared; else nothing.
    pub fn own(&self) -> &'s [Triangle] {
        self.own
    }
}

impl Scene {
    /// Returns the shapes of a captor, for points that are drawn on them.
    pub fn outline(&self, captor: &Captor) -> Outline<'_> {
        let range = captor.triangles.clone();
        let first = range.start;
        if let Some(round) = self.round(captor) {
            return Outline { scene: self, first, own: &[], areas: None, round: Some(round) };
        }
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
                    &self.objects.common[located.prototype],
                    &self.shapes.placed.prototypes[located.prototype],
                );
                let captor = common.surfaces[located.triangle].captor().unwrap_or_default();
                let triangles = located.triangle..located.triangle + range.len();
                // the areas of all copies are in the same proportion
                let areas = || areas_of(&prototype.triangles[triangles]);
                common.areas[captor].get_or_init(areas).clone()
            }
        };
        let own = own.unwrap_or_default();
        Outline { scene: self, first, own, areas: Some(areas), round: None }
    }
}
