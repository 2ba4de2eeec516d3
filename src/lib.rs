//! Photon mapping for plant science: how much light every sensor and every leaf of a greenhouse or
//! growth chamber receives.
//!
//! Light leaves a lamp ([`Light`]), photons travel ([`simulate`]), those that meet a captor are
//! counted and stored ([`PhotonMap`]), and the result tells what each captor received
//! ([`RunResult`]). In place of photons, paths can go back from the captors to the lights
//! ([`Estimator`]). A scene comes from a file ([`load`]) or from parts made in memory
//! ([`Scene::new`]). For pictures, photons are stored on all surfaces ([`light_surfaces`]), and a
//! camera looks at this light ([`render()`]).
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
//!
//! Cargo features: `cli` (the command line), `studies` (sweeps, convergence studies, checks),
//! `show` (pictures, charts, pages, exports), `exr` and `parquet` (support for these two file
//! formats). All features are on by default. With `default-features = false` there remain scenes,
//! transport and results, and their files.

#![deny(missing_docs)]
#![deny(unsafe_code)]
// without the command line, the code that it alone uses is dead
#![cfg_attr(not(feature = "cli"), allow(dead_code, unused_imports))]

mod error;

// each of these modules uses only those declared above it
mod math;

mod scene;

mod transport;

mod results;

mod formats;

#[cfg(feature = "show")]
mod show;

#[cfg(feature = "studies")]
mod studies;

#[cfg(feature = "cli")]
pub mod cli;

pub use error::{Error, ErrorKind, Problem, Result};
pub use formats::control_file::{ControlFile, LampControl};
pub use formats::hours_file::HoursFile;
pub use formats::obj::{Mesh, MeshGroup};
pub use formats::output::{FilesRead, OpenFile, OutputFile};
pub use formats::result_file::{OutputFolder, parse_json, read_json, write_csv, write_json};
pub use formats::scene_file::{
    HourlyLight, HourlyLights, HourlySun, InMemory, LoadedScene, OpenField, SkyDivision, load,
    load_by_hour, load_from, load_with,
};
pub use formats::sweep_file::{Parameter, Run, Sweep};
pub use formats::{environment_map, iso8601, weather};
pub use math::curve::Curve;
pub use math::geometry::{Extent, Frame, Ray, Transform, Triangle};
pub use math::rng::Stream;
pub use math::spectrum::{Lanes, Spectrum, Wide};
pub use math::stats::{Estimate, Running};
pub use math::units::{LengthUnit, Quantity, UnitNames};
pub use results::calibration::{
    Calibration, EvenPowers, Lit, Model, ModelErrors, ReadingResult, SlopeIntercept, Varied,
};
pub use results::compare::{Comparison, Difference};
pub use results::flat::FlatResult;
pub use results::result::{
    Absorbed, AbsorbedByFace, BandResult, ByLight, CaptorResult, DarkResult, Electricity, Energy,
    FaceResult, Factor, GroupElectricity, GroupResult, LampElectricity, MapResult, NearestResult,
    RatioResult, Ratios, RunResult, RunSettings, Share, Shares, SumUnit, ToleranceResult,
    Uniformity, Warning, WorstResult,
};
pub use results::saved::ResultsFile;
pub use scene::bvh::Kernel;
pub use scene::camera::{Camera, View};
pub use scene::captor::{CHANNELS, Captor, CaptorKind, Channel, Response, Sensor};
pub use scene::daylight;
pub use scene::light::{
    EmittedRadiance, EmitterHit, Intensity, IntensityTable, Light, LightHit, LightSample,
    LightShape, Toward,
};
pub use scene::material::{
    BsdfSample, Dielectric, Interaction, Lambert, Leaf, LeafFace, LeafSpectra, LobeKind, Material,
    Mirror, Pane, Phong, PhongFractions, Prospect, Transport,
};
pub use scene::patches::Patches;
pub use scene::tiles::{TileCopies, TilePart, Tiles};
pub use scene::world::{
    Band, BandRatio, BandSum, CaptorPart, CopyPart, Crossing, FlushLight, LightPart, NamedMaterial,
    ObjectCopy, Scene, SceneParts, Surface, SurfaceHit, SurfacePart,
};
#[cfg(feature = "show")]
pub use show::chart::{Chart, Series, Stroke};
#[cfg(feature = "show")]
pub use show::export::{Colours, ExportFormat, check_export, write_export};
#[cfg(feature = "show")]
pub use show::glb::Shown;
#[cfg(feature = "show")]
pub use show::picture::{BandColours, Exposure, Legend, Picture, Scale};
#[cfg(feature = "show")]
pub use show::plot::{Plot, PlotKind, PlotRequest};
#[cfg(feature = "show")]
pub use show::render::{
    Dot, FirstVisible, Fragments, Gather, Pixels, Sampling, Show, Viewpoint, painted, path_dots,
    photon_dots, render,
};
#[cfg(feature = "show")]
pub use show::rendered::{RenderPlan, RenderStage, RenderedScene};
#[cfg(feature = "show")]
pub use show::view::{check_view, write_view};
#[cfg(feature = "show")]
pub use show::vtk::VtkKind;
#[cfg(feature = "studies")]
pub use studies::calibrate::{EvenPlan, even};
#[cfg(feature = "studies")]
pub use studies::check::{MaterialSummary, ObjectSummary, SceneSummary, check, check_meshes};
#[cfg(feature = "studies")]
pub use studies::convergence::{
    Bounces, ConvergencePlan, ConvergenceStudy, Reference, Row, Rung, TrueValue, Within, study,
};
#[cfg(feature = "studies")]
pub use studies::join::join;
#[cfg(feature = "studies")]
pub use studies::sweep::{
    Forecast, Outcome, State, Step, SweepControl, SweepPlan, SweepProgress, load_base, merge, sweep,
};
#[cfg(feature = "studies")]
pub use studies::year::{
    HoursOf, Lamp, Needs, Places, StateScene, Value, Values, Year, YearOptions, YearScenes,
    tables::YearTables,
};
pub use transport::photon_map::{
    Arrival, Neighbour, PackedDirection, PhotonMap, StoredPhoton, Way,
};
pub use transport::settings::{Estimator, Guiding, Settings, Target};
pub use transport::shard::Shard;
pub use transport::simulate::{
    Accuracy, Choice, Control, Dark, End, FaceBand, Progress, Simulation, Worst, found_and_unseen,
    light_surfaces, simulate,
};
pub use transport::tally::{Ledger, Totals};
pub use transport::{paths::Unseen, surface_light::SurfaceLight};
