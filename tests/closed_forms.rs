//! Whole scenes against closed forms: nothing here was computed with phylux.

mod canopy;
mod cie;
mod furnace;
mod glass;
mod leaf;
mod lights;
mod sheets;
mod view_factors;
