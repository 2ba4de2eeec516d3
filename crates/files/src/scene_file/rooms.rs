//! Lamps of rooms in the format of Radiance, kept until a light of the scene gives them power.

use phylux_core::scene::light::{AnyEmitter, Unplaced};

/// The lamps of one material in an object.
pub(super) struct RoomLamps {
    pub(super) object: String,
    pub(super) material: String,
    /// JSON pointer of the object.
    pub(super) pointer: String,
    /// Whether a light of the scene has given the lamps power.
    pub(super) lit: bool,
    pub(super) lamps: Vec<RoomLamp>,
}

/// One lamp of a room.
pub(super) struct RoomLamp {
    pub(super) identifier: String,
    /// Area that emits, m2.
    pub(super) area: f64,
    pub(super) emitter: Unplaced<AnyEmitter>,
}
