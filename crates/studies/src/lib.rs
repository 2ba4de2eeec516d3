//! Studies: what is done with scenes and results, from its beginning to what a person reads. These
//! are a run with a checkpoint (`run`), many runs as tables (`sweep`), error against cost
//! (`convergence`), mistakes in a scene (`check`), powers of lamps from measured readings
//! (`calibrate`), other powers of lamps (`mix`), the shards of a run joined to one (`join`),
//! daylight and lamps by the hour (`year`), pictures (`picture`), and the ways of light to a captor
//! (`histories`). The modules do not depend on each other's results, so any of them can be read
//! first; `desk` is where work is done that may be ended early, and `table` holds what the tables of
//! sweeps and years share. Nothing here prints to the terminal.

#![deny(unsafe_code)]

pub mod calibrate;
pub mod check;
pub mod convergence;
pub mod desk;
pub mod histories;
pub mod join;
pub mod mix;
pub mod picture;
pub mod run;
pub mod sweep;
mod table;
pub mod text;
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
