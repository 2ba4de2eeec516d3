//! Pictures of a scene: what a camera sees, its light in false colour, or the photons themselves.
//! `job` says which picture is asked for, and `camera` from where; `task` has what all pictures need,
//! and `light`, `captors` and `photons` make them. `channels` names their numbers in a file.

mod camera;
mod captors;
mod channels;
pub mod job;
mod light;
mod photons;
mod task;

pub use camera::PictureCamera;
pub use channels::channels;
pub use task::Made;
