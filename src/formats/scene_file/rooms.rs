//! Lamps of rooms in the format of Radiance, which wait for a light of the scene.

use crate::scene::light::LightShape;

/// The lamps of one material in an object.
pub(super) struct RoomLamps {
    pub(super) object: String,
    pub(super) material: String,
    /// JSON pointer of the object.
    pub(super) pointer: String,
    /// Whether a light has made them shine.
    pub(super) lit: bool,
    pub(super) lamps: Vec<RoomLamp>,
}

/// One of them.
pub(super) struct RoomLamp {
    pub(super) identifier: String,
    /// m2
    pub(super) area: f64,
    pub(super) shape: LightShape,
}
