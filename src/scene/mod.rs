//! The scene as it stands before a photon flies: the surfaces and what they do with light
//! ([`material`]), the lights ([`light`], and sun and sky in [`daylight`]), the captors
//! ([`captor`]), the camera ([`camera`]), and the validated [`world::Scene`], which arranges all of
//! them for the tracing of rays ([`bvh`]), where it repeats in a [`lattice`]. [`patches`] and [`tiles`] divide surfaces into pieces:
//! for photon maps on surfaces, and for display. [`stand`] holds what is summed of plants as a whole.
//!
//! Read `material` and `light` for the physics, then `world`. Code that follows light further than
//! one interaction, or that reads a file, may not enter.

pub mod bvh;
pub mod camera;
pub mod captor;
pub mod daylight;
pub mod lattice;
pub mod light;
pub mod material;
pub mod patches;
pub mod stand;
pub mod tiles;
pub mod world;
