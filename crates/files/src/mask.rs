//! Masks: pictures that say which part of a textured triangle is there. The triangles are cut along
//! the mask's outline when a scene is loaded, so that all that follows (photons, paths, areas,
//! pictures, exports) meets plain triangles.
//!
//! `picture` reads the texels of a `bitmap`, `outline` follows their edge and simplifies it, and `cut` clips
//! triangles.

mod bitmap;
mod cut;
mod outline;
mod picture;

pub use bitmap::Bitmap;
pub use cut::Mask;
pub use picture::{Channel, Picture};

#[cfg(test)]
mod tests;
