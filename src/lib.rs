//! Photon mapping for plant science: how much light every sensor and every leaf of a greenhouse or
//! growth chamber receives.
//!
//! A scene comes from a file ([`load`]) or is made in memory ([`Scene::builder`]). Photons travel
//! from its lights, and those that meet a captor are counted and stored ([`simulate`]); or paths go
//! back from the captors to the lights ([`Estimator`]). [`RunResult`] tells what each captor
//! received, [`FlatResult`] the same as arrays.
//!
//! ```
//! use phylux::{Control, RunResult, load, simulate};
//!
//! let loaded = load("scenes/box.json".as_ref())?;
//! let simulation = simulate(&loaded.scene, &loaded.settings, &Control::default())?;
//! let result = RunResult::new(&loaded.scene, &loaded.settings, &simulation);
//! let (sensor, front) = (&result.captors[0].id, &result.captors[0].front);
//! println!("{sensor} {:?} +- {:?} W/m2", front.irradiance, front.irradiance_se);
//! # Ok::<(), phylux::Error>(())
//! ```
//!
//! Each module shows what a program needs of it. In the order in which light meets them: [`scene`]
//! (surfaces, lights, captors), [`transport`] (the [photon loop](transport::trace), which reports
//! [events](transport::Event) to a tally of your own; runs, estimators, photon maps), [`results`],
//! [`formats`] (files, and [descriptions](formats::spec) of scenes), [`show`] (pictures, plots,
//! pages), [`studies`] (sweeps, years, convergence), over [`math`].
//!
//! Examples, in the folder `examples`:
//!
//! | example | shows |
//! |---|---|
//! | `chamber.rs` | a scene made in memory, and its PPFD |
//! | `own_tally.rs` | a tally of one's own over the events of the photon loop |
//! | `materials.rs` | many scenes in parallel: five covers of a greenhouse |
//! | `field.rs` | plants made in memory, in a field without an edge, absorbed light by layer |
//!
//! Cargo features: `cli` (the command line), `studies` (sweeps, convergence studies, checks),
//! `show` (pictures, charts, pages, exports), `exr` and `parquet` (support for these two file
//! formats). All features are on by default. With `default-features = false` there remain scenes,
//! transport and results, and their files.

#![deny(missing_docs)]
#![deny(unnameable_types)]
#![deny(unsafe_code)]
// without the command line, the code that it alone uses is dead
#![cfg_attr(not(feature = "cli"), allow(dead_code, unused_imports))]

mod error;

// each of these modules uses only those declared above it
pub mod math;

pub mod scene;

pub mod transport;

pub mod results;

pub mod formats;

#[cfg(feature = "show")]
pub mod show;

#[cfg(feature = "studies")]
pub mod studies;

#[cfg(feature = "cli")]
pub mod cli;

pub use error::{Error, ErrorKind, Problem, Result};
pub use formats::{LoadedScene, load};
pub use results::{FlatResult, RunResult};
pub use scene::Scene;
pub use transport::{Control, Estimator, Guiding, Settings, Simulation, Target, simulate};
