//! Photon mapping for plant science: how much light every sensor and every leaf of a greenhouse or
//! growth chamber receives.
//!
//! Light leaves a lamp ([`Light`]), photons travel ([`simulate`]), those that meet a captor are
//! counted and stored ([`PhotonMap`]), and captors are read ([`RunResult`]). Or paths go back from
//! the captors to the lights ([`Estimator`]). A scene comes from a file ([`load`]) or from parts made
//! in memory ([`Scene::new`]). For pictures photons are stored on all surfaces ([`light_surfaces`]), and
//! seen through a camera ([`render()`]).
//!
//! ```no_run
//! use std::{path::Path, sync::atomic::AtomicBool};
//!
//! let loaded = phylux::load(Path::new("scenes/box.json"))?;
//! let control = phylux::Control { stop: &AtomicBool::new(false), progress: &|_| {} };
//! let simulation = phylux::simulate(&loaded.scene, &loaded.settings, &control)?;
//! let result = phylux::RunResult::new(&loaded.scene, &loaded.settings, &simulation);
//! println!("{} {:?}", result.captors[0].id, result.captors[0].front.irradiance);
//! # Ok::<(), phylux::Error>(())
//! ```

#![deny(missing_docs)]
#![deny(unsafe_code)]

mod error;
mod geometry;
mod input;
mod output;
mod rng;
mod sampling;
mod spectrum;
mod stats;
mod units;

mod bvh;
mod obj;
mod photon_map;

mod camera;
mod captor;
mod light;
mod material;

mod scene;

mod patches;
mod tiles;

mod estimate;
mod render;
mod result;
mod settings;
mod shard;
mod simulate;
mod tally;
mod trace;

mod captor_csv;
mod chart;
mod exhibit;
mod glb;
mod json;
mod picture;
mod ply;
mod result_file;
mod scene_file;
mod share_file;
mod sweep_file;
mod view;
mod vtk;

mod check;
mod compare;
mod export;
mod join;
mod study;
mod sweep;

pub mod cli;

#[cfg(test)]
mod odds;
#[cfg(test)]
mod spoil;

pub use bvh::Kernel;
pub use camera::{Camera, View};
pub use captor::{CHANNELS, Captor, CaptorKind, Channel};
pub use chart::{Chart, Series, Stroke};
pub use check::{MaterialSummary, SceneSummary, check, check_meshes};
pub use compare::{Comparison, Difference};
pub use error::{Error, ErrorKind, Result};
pub use estimate::{paths::Unseen, surface::SurfaceLight};
pub use exhibit::{Exhibit, ExhibitPlan, ExhibitStage};
pub use export::{Colours, ExportFormat, check_export, write_export};
pub use geometry::{Extent, Frame, Ray, Transform, Triangle};
pub use glb::Shown;
pub use join::join;
pub use light::{Light, LightSample, LightShape, Shine, TubeHit};
pub use material::{
    Dielectric, Encounter, Lambert, Leaf, LeafFace, Material, Mirror, Onward, Pane, Phong,
    PhongFractions, Scatter, Transport,
};
pub use output::{OpenFile, OutputFile};
pub use patches::Patches;
pub use photon_map::{Arrival, Neighbour, PackedDirection, PhotonMap, StoredPhoton, Way};
pub use picture::{BandColours, Exposure, Legend, Picture, Scale};
pub use render::{
    Dot, Eye, Pixels, Sampling, Show, Sight, painted, path_dots, photon_dots, render,
};
pub use result::{
    Absorbed, BandResult, ByLight, CaptorResult, Energy, FaceResult, GroupResult, MapResult,
    NearestResult, RunResult, Warning,
};
pub use result_file::{OutputFolder, ResultsFile, read_json, write_csv, write_json};
pub use rng::Stream;
pub use scene::{
    Band, BandSum, CaptorPart, Crossing, LightHit, LightPart, NamedMaterial, Scene, SceneParts,
    Surface, SurfaceHit, SurfacePart,
};
pub use scene_file::{LoadedScene, load};
pub use settings::{Estimator, Settings};
pub use shard::Shard;
pub use simulate::{Choice, Control, End, Progress, Simulation, light_surfaces, simulate};
pub use spectrum::Spectrum;
pub use stats::{Estimate, Running};
pub use study::{Bounces, Reference, Row, Rung, Study, StudyPlan, TrueValue, Within, study};
pub use sweep::{
    Forecast, Outcome, State, Step, SweepControl, SweepPlan, SweepProgress, load_base, merge, sweep,
};
pub use sweep_file::{Parameter, Run, Sweep};
pub use tally::{Ledger, Totals};
pub use tiles::{TilePart, Tiles};
pub use units::{LengthUnit, Quantity, UnitNames};
pub use view::{check_view, write_view};
pub use vtk::VtkKind;
