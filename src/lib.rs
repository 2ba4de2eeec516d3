//! phylux
mod error;
mod geometry;
pub use error::{Error, ErrorKind, Result};
pub use geometry::{Frame, Ray, Transform, Triangle};
