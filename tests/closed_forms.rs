//! Compares whole scenes with closed forms. None of the exact values was computed with phylux.

mod canopy;
mod cie;
mod daylight;
mod furnace;
pub mod glass;
mod leaf;
pub mod lights;
mod rounds;
mod sheets;
mod view_factors;
