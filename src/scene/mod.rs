//! What there is before a photon flies: surfaces and what they do with light ([`material`]), lights
//! ([`light`]), captors, the camera, and the validated [`world::Scene`], which arranges them for rays
//! ([`bvh`]).
//!
//! Read `material` and `light` for the physics, then `world`. Nothing here follows light further than
//! one interaction, and nothing here reads a file.

pub mod bvh;
pub mod camera;
pub mod captor;
pub mod daylight;
pub mod light;
pub mod material;
pub mod patches;
pub mod tiles;
pub mod world;
