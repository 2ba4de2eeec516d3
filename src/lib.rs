//! Photon mapping for plant science: how much light every sensor and every leaf of a greenhouse or
//! growth chamber receives.
//!
//! A scene comes from a file ([`load`]) or is made in memory
//! ([`SceneBuilder`](formats::SceneBuilder)). Photons travel from its lights, and those that meet a
//! captor are counted and stored ([`simulate`](fn@simulate)); or paths go back from the captors to
//! the lights ([`Estimator`]). [`RunResult`] tells what each captor received, [`FlatResult`] the same
//! as arrays.
//!
//! ```
//! use phylux::{Control, RunResult, load, simulate};
//!
//! let loaded = load("scenes/box.json".as_ref())?;
//! let simulation = simulate(&loaded.scene, &loaded.settings, &Control::default())?;
//! let result = RunResult::new(&simulation);
//! let (sensor, front) = (&result.captors[0].id, &result.captors[0].front);
//! println!("{sensor} {:?} +- {:?} W/m2", front.irradiance, front.irradiance_se);
//! # Ok::<(), phylux::Error>(())
//! ```
//!
//! Each module shows what a program needs of it. In the order in which light meets them: [`scene`]
//! (surfaces, lights, captors), [`transport`] (the [photon loop](fn@transport::trace), which reports
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

// what each module promises; crates/ holds the code

/// Vectors, frames, random streams, spectra, statistics and units.
pub mod math {
    pub use phylux_core::math::{
        Curve, Estimate, Extent, Frame, Lanes, LengthUnit, Quantity, Ray, Running, Spectrum,
        Stream, Transform, Triangle, UnitNames, WeightedUnit, Wide,
    };
}

/// Surfaces, materials, lights and captors, and the validated scene of them.
pub mod scene {
    pub use phylux_core::scene::{
        Area, Arrived, Asked, Band, BandRatio, BandSum, Basis, Bsdf, BsdfFaces, BsdfSample,
        CHANNELS, Camera, Captor, CaptorKind, CaptorPart, Channel, Cone, CopyPart, Cover, CoverRow,
        Crossing, Dielectric, Emission, EmittedRadiance, EmitterHit, FaceValues, Factor, Intensity,
        IntensityTable, Interaction, IsotropicLine, Kernel, Lambert, Lamp, Lattice, Leaf, LeafFace,
        LeafSpectra, Light, LightHit, LightPart, LightSample, LightSource, LobeKind, Luminaire,
        LuminaireArea, Material, Mirror, NamedMaterial, PairValues, Pane, Parameter,
        ParameterIndex, Parameters, Patches, Period, Phong, PhongFractions, Prospect, Response,
        Scatterer, Scene, SceneParts, Sensor, Sent, SharedCopy, SharedPart, Standing, Start,
        Strata, Surface, SurfaceHit, SurfacePart, Table, Toward, Transport, Triangles, Tube,
        Unplaced, View, daylight,
    };
}

/// The photon loop and its events, runs, estimators, tallies and photon maps.
pub mod transport {
    pub use phylux_core::transport::{
        Accuracy, Arrival, Choice, Contribution, Control, Counted, Dark, End, Estimator, Event,
        FaceBand, Flight, Goal, Guide, Guiding, Histories, HistoryLine, LastSurface, Ledger,
        MapLimit, NearestCount, Neighbour, Onward, Origin, PackedDirection, PhotonCount, PhotonMap,
        Progress, Settings, Shard, Simulation, StoredPhoton, SurfaceLight, Target, ThreadCount,
        TimeLimit, Tolerance, Totals, Turn, Unseen, Way, Worst, found_and_unseen, light_surfaces,
        simulate, trace, trace_histories,
    };
}

/// What a run found, with standard errors: values by captor, group and layer, and comparisons.
pub mod results {
    pub use phylux_results::{
        Absorbed, AbsorbedByFace, Account, BandResult, BudgetResult, ByLight, Calibration,
        CanopyResult, CaptorResult, Column, Comparison, DarkResult, Deviations, Difference,
        Electricity, Energy, Errors, EvenPowers, Extras, FaceResult, Factor, FactorErrors,
        FlatResult, GroupElectricity, GroupResult, HistoriesBand, HistoriesLine, HistoriesPart,
        HistoriesResult, InputResult, LampElectricity, LayerResult, LightSensitivity, Lit,
        MapResult, Measure, Model, ModelErrors, NearestResult, OfLights, Own, Per, PerBand, PerKwh,
        PlaneElectricity, Provenance, QUANTITIES, Quantity, RatioResult, RatioSensitivity, Ratios,
        ReadingResult, Row, RunResult, RunSettings, SensitivityResult, Share, Shares,
        SlopeIntercept, SumUnit, ToleranceResult, UncertainInput, Uniformity, Varied, Warning,
        When, Whole, WorstResult, YearFacts,
    };
}

/// Files, and descriptions of scenes.
///
/// A scene that is made in memory:
/// ```
/// use phylux::{Control, FlatResult, Settings, formats::{SceneBuilder, spec::*}, math::Quantity, simulate, transport::PhotonCount};
///
/// let loaded = SceneBuilder::new()
///     .quantity(Quantity::Micromole)
///     .band("PAR", 400.0, 700.0)
///     .light(PointSpec::new([0.0, 0.0, 2.0], 100.0))
///     .captor(CaptorSpec::disc("sensor", [0.0; 3], [0.0, 0.0, 1.0], 0.02))
///     .build()?;
/// let settings = Settings { photons: Some(PhotonCount::new(100_000)?), ..Settings::default() };
/// let run = simulate(&loaded.scene, &settings, &Control::default())?;
/// let (flux, error) = FlatResult::new(&run).get(0, phylux::scene::Channel::Front, 0);
/// // a disc far below a point: 100 umol/s / (4 pi (2 m)^2)
/// let expected = 100.0 / (16.0 * std::f64::consts::PI) * loaded.scene.captors()[0].area;
/// assert!((flux - expected).abs() < 4.0 * error + 1e-3 * expected);
/// # Ok::<(), phylux::Error>(())
/// ```
pub mod formats {
    pub use phylux_files::{
        ControlFile, DimFile, Face, FilesRead, HourlyLight, HourlyLights, HourlySun, InMemory,
        LampControl, LoadedScene, MeasuredAt, MeasuredRow, Mesh, MeshGroup, OpenField, OutputFile,
        OutputFolder, Parameter, Run, SceneBuilder, SceneSource, SeriesFile, SkyDivision,
        SpectrumAverage, StateControl, Sweep, TableNote, TableSettings, TrackerControl, Turn,
        WhenKeys, YearTable, iso8601, load, load_by_hour, load_from, load_with, parse_json,
        parse_readings, read_arguments, read_json, spec, weather, write_csv, write_json,
    };
}

/// Pictures, charts, plots, pages and files for other programs.
#[cfg(feature = "show")]
pub mod show {
    pub use phylux_show::{
        Chart, Colours, ExportFormat, FirstVisible, Followed, Following, Fragments, Gather, Legend,
        Picture, Pixels, Plot, PlotJob, PlotKind, PlotLight, PlotStyle, PlotWhat, RenderPlan,
        RenderStage, RenderedScene, Sampling, Scale, Series, Show, Shown, Stroke, Viewpoint,
        VtkKind, Width, YearLight, YearPlotKind, check_export, check_view, painted, render,
        write_export, write_view,
    };
}

/// Work that takes more than one run, or none: sweeps, years, convergence, checks.
#[cfg(feature = "studies")]
pub mod studies {
    pub use phylux_studies::{
        Bounces, ConvergencePlan, ConvergenceStudy, EvenPlan, Forecast, HoursOf, Kept, Lamp,
        LeafOptics, LeafSummary, MaterialSummary, Needs, ObjectSummary, Outcome, Places, Reference,
        Row, Rung, SceneSummary, State, StateScene, Step, SweepControl, SweepPlan, SweepProgress,
        TrueValue, Value, Values, Within, Year, YearOptions, YearScenes,
        calibrate::{
            CalibrationPlan, Vary,
            job::{Calibrated, CalibrationGoal, CalibrationLight, CalibrationReport, calibrated},
        },
        check, check_meshes,
        convergence::job::{ChartRuns, chart},
        desk::{Desk, DeskState, Listener},
        even,
        histories::{self, HistoriesJob},
        join, load_base, merge,
        mix::Mix,
        picture::{
            Made, PictureCamera,
            job::{PhotonColour, PictureJob, PictureOf},
        },
        run::{ReadyRun, RunJob},
        study, sweep,
        text::{
            Page,
            comparison::{WORST, text as comparison},
            scene::{as_json, describe},
            summary::{Summary, summary},
        },
        year::job::{MadeYear, YearJob},
    };
}

#[cfg(feature = "cli")]
pub mod cli;

pub use formats::{LoadedScene, load};
pub use phylux_core::error::{Error, ErrorKind, Problem, Result};

/// Errors as texts, and sentences whose names of settings each interface spells in its own way.
pub mod words {
    pub use phylux_core::error::{
        Call, CommandLine, Said, Setting, SettingValue, Spelling, ToWords, Words, call, setting,
    };
}
pub use results::{FlatResult, RunResult};
pub use scene::Scene;
pub use transport::{Control, Estimator, Guiding, Settings, Simulation, Target, simulate};
