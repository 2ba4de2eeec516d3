//! Studies: work that takes more than one run, or none. These are many runs as tables (`sweep`),
//! error against cost (`convergence`), mistakes in a scene (`check`), powers of lamps from
//! measured readings (`calibrate`), the shards of a run joined to one (`join`), and daylight and
//! lamps by the hour (`year`). The modules do not depend on each other's results, so any of them
//! can be read first; `table` holds what the tables of sweeps and years share. Nothing here prints
//! to the terminal.

#![deny(unsafe_code)]

pub mod calibrate;
pub mod check;
pub mod convergence;
pub mod desk;
pub mod join;
pub mod sweep;
mod table;
pub mod year;

pub use calibrate::{EvenPlan, even};
pub use check::{
    LeafOptics, LeafSummary, MaterialSummary, ObjectSummary, SceneSummary, check, check_meshes,
};
pub use convergence::{
    Bounces, ConvergencePlan, ConvergenceStudy, Reference, Row, Rung, TrueValue, Within, study,
};
pub use join::join;
pub use sweep::{
    Forecast, Outcome, State, Step, SweepControl, SweepPlan, SweepProgress, load_base, merge, sweep,
};
pub use year::{
    HoursOf, Kept, Lamp, Needs, Places, StateScene, Value, Values, Year, YearOptions, YearScenes,
};
