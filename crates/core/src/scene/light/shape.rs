//! Lights before they are in a scene: valid, and in metres from the user's origin.

use std::{fmt, sync::Arc};

use glam::DVec3;

/// Where a light may be met, m from the user's origin.
#[derive(Clone, Debug)]
pub enum Outline {
    /// Points that no ray meets: a point, or the ends of a line.
    Points(Vec<DVec3>),
    /// All that is within a radius, m, of the line between two points.
    Around([DVec3; 2], f64),
    /// Triangles.
    Triangles(Arc<[[DVec3; 3]]>),
}

impl Outline {
    /// Returns the triangles; the list is empty for other outlines.
    pub fn triangles(&self) -> &[[DVec3; 3]] {
        match self {
            Self::Triangles(triangles) => triangles,
            _ => &[],
        }
    }

    /// Returns the points that no ray meets.
    pub fn points(&self) -> &[DVec3] {
        match self {
            Self::Points(points) => points,
            _ => &[],
        }
    }

    /// Returns the line that the light is around.
    pub fn line(&self) -> Option<&[DVec3]> {
        match self {
            Self::Around(ends, _) => Some(ends),
            _ => None,
        }
    }

    /// Returns the corners of what a ray may meet: the triangles, or triangles from one end of a line
    /// to the other that span the boxes around both ends and all heights between.
    pub fn pieces(&self) -> impl Iterator<Item = [DVec3; 3]> {
        let around = match self {
            Self::Around(ends, radius) => Some((*ends, *radius)),
            _ => None,
        };
        let around = around.into_iter().flat_map(|([from, to], radius)| {
            let diagonals = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
            diagonals.into_iter().flat_map(move |(x, y)| {
                let across = radius * DVec3::new(x, y, 1.0);
                [
                    [from - across, from + across, to + across],
                    [from - across, to - across, to + across],
                ]
            })
        });
        self.triangles().iter().copied().chain(around)
    }
}

/// A light that is not in a scene yet: its outline, and how it becomes an emitter in coordinates
/// relative to the scene's centre, once this is known. The constructors of emitters make it, and
/// refuse what could not shine; whether coordinates are finite is checked with the scene.
#[derive(Clone)]
pub struct Unplaced<E> {
    outline: Outline,
    place: Arc<dyn Fn(DVec3) -> E + Send + Sync>,
}

impl<E: 'static> Unplaced<E> {
    /// Makes a light that `place` turns into an emitter, given the centre of the scene.
    pub(super) fn new(
        outline: Outline,
        place: impl Fn(DVec3) -> E + Send + Sync + 'static,
    ) -> Self {
        Self { outline, place: Arc::new(place) }
    }

    /// Returns the same light as one of any kind.
    pub fn of_any_kind<A: From<E> + 'static>(self) -> Unplaced<A> {
        let place = self.place;
        Unplaced { outline: self.outline, place: Arc::new(move |center| place(center).into()) }
    }

    /// Returns where the light may be met.
    pub fn outline(&self) -> &Outline {
        &self.outline
    }

    /// Makes the emitter, in coordinates relative to `center`.
    pub(super) fn place(&self, center: DVec3) -> E {
        (self.place)(center)
    }
}

impl<E> fmt::Debug for Unplaced<E> {
    fn fmt(&self, to: &mut fmt::Formatter) -> fmt::Result {
        self.outline.fmt(to)
    }
}
