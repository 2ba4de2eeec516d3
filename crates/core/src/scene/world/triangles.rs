//! The triangles of a scene by their indices: its own, then those of copies that share them.

use std::ops::Range;

use super::shapes::Shapes;
use crate::{
    math::geometry::{Extent, Triangle},
    scene::instances::{Located, Placed},
};

/// The triangles of all surfaces: first those that are no shared copies, then the copies, one by one.
#[derive(Clone, Copy, Debug)]
pub struct Triangles<'s> {
    own: &'s [Triangle],
    placed: &'s Placed,
}

impl<'s> Triangles<'s> {
    pub(super) fn new(shapes: &'s Shapes) -> Self {
        Self { own: &shapes.triangles, placed: &shapes.placed }
    }

    /// Returns their number.
    pub fn len(&self) -> usize {
        self.own.len() + self.placed.count()
    }

    /// Returns whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the triangle of this index, m from the centre of the scene. It must be below the
    /// number of triangles.
    #[inline]
    pub fn at(&self, index: usize) -> Triangle {
        match self.own.get(index) {
            Some(triangle) => *triangle,
            None => self.placed.triangle(&located(self.placed, index)),
        }
    }

    /// Returns a box around all of them, m from the centre of the scene. Where copies share their
    /// triangles it may be a little wider than needed.
    pub fn extent(&self) -> Extent {
        let own = Extent::of_triangles(self.own);
        self.placed.boxes().into_iter().fold(own, Extent::join)
    }

    /// Returns all of them in their order.
    pub fn iter(self) -> impl ExactSizeIterator<Item = Triangle> + Clone + use<'s> {
        (0..self.len()).map(move |index| self.at(index))
    }
}

/// Triangles that stand for all copies of them.
#[derive(Clone, Debug)]
pub struct Standing {
    /// Their indices.
    pub triangles: Range<usize>,
    /// Number of copies for which each of them stands, itself included.
    pub copies: usize,
    /// The area of all copies over their own.
    pub area: f64,
}

/// Copies of one object that share its triangles.
pub struct Alike {
    /// The triangles of the first copy.
    pub triangles: Range<usize>,
    /// The area of each copy over that of the first.
    pub areas: Vec<f64>,
}

/// A copy that shares its triangles.
#[derive(Clone, Copy, Debug)]
pub struct SharedCopy {
    /// Index of its first triangle.
    pub first: usize,
    /// Number of its triangles.
    pub triangles: usize,
    /// A box around it, m from the centre of the scene, a little wider than needed.
    pub extent: Extent,
}

/// Returns what the index of a copy's triangle means.
pub(super) fn located(placed: &Placed, triangle: usize) -> Located {
    placed.locate(triangle).expect("a triangle of the scene")
}
