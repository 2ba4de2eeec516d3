//! Where light is gathered.

use glam::Vec3;

/// A point that light is gathered at.
#[derive(Clone, Copy)]
pub(super) struct Vertex {
    pub point: Vec3,
    /// Normal of the surface that a shadow ray must step off, on either side.
    pub step: Option<Vec3>,
    /// Normal of the only side that light counts from.
    pub one_sided: Option<Vec3>,
}
