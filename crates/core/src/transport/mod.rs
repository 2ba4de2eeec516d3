//! Light transport: photons, backward paths, and what is counted of them.
//!
//! Read `trace` first: it is the loop that follows one photon. `guiding` adds flights that are
//! aimed at captors which photons hardly reach. `paths` traces backward paths, from the captors
//! to the lights. `tally` and `photon_map` hold what is counted and stored; `nearest` and
//! `surface_light` make radiance estimates of the stored photons; `direct_sun` finds direct
//! sunlight by shadow rays, `sunlit` the shares in the sun; `histories` tells on which ways light
//! reaches a captor.
//!
//! `met` keeps account of how often light has met the parameters on which results depend.
//!
//! `simulate` cuts a run into batches and tasks, for threads and machines, and decides when it
//! ends. `settings` says how a run is to be done, `shard` which part of it a machine does.
//!
//! Nothing in this module reads or writes files or draws pictures.

pub mod direct_sun;
pub mod guiding;
pub mod histories;
pub mod met;
pub mod nearest;
pub mod paths;
pub mod photon_map;
pub mod settings;
pub mod shard;
pub mod simulate;
pub mod sunlit;
pub mod surface_light;
pub mod tally;
pub mod trace;

pub use histories::{
    Contribution, Goal, Histories, HistoryLine, LastSurface, Origin, trace_histories,
};
pub use paths::Unseen;
pub use photon_map::{Arrival, Neighbour, PackedDirection, PhotonMap, StoredPhoton, Way};
pub use settings::{
    Estimator, Guiding, MapLimit, NearestCount, PhotonCount, Settings, Target, ThreadCount,
    TimeLimit, Tolerance,
};
pub use shard::Shard;
pub use simulate::{
    Accuracy, Choice, Control, Dark, End, FaceBand, Progress, Simulation, Worst, found_and_unseen,
    light_surfaces, simulate,
};
pub use surface_light::SurfaceLight;
pub use tally::{Ledger, Totals};
pub use trace::{Counted, Event, Flight, Guide, Onward, Turn, trace};
