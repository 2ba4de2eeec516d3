//! How light travels: photons from the lights ([`trace`]: the loop to read first), flights beside them for captors that
//! they hardly reach ([`guiding`]), paths back from the captors ([`paths`]), what they are counted in ([`tally`], [`photon_map`]) and what is estimated from
//! that ([`nearest`], [`surface_light`]).
//!
//! [`simulate`] cuts a run into batches for threads and machines and decides when it ends. Nothing here
//! knows files or pictures.

pub mod direct_sun;
pub mod guiding;
pub mod nearest;
pub mod paths;
pub mod photon_map;
pub mod settings;
pub mod shard;
pub mod simulate;
pub mod surface_light;
pub mod tally;
pub mod trace;
