//! Studies: work that takes more than one run, or none. These are many runs as tables ([`sweep`]),
//! error against cost ([`convergence`]), mistakes in a scene ([`check`]), powers of lamps from
//! measured readings ([`calibrate`]), the shards of a run joined to one ([`join`]), and daylight and
//! lamps by the hour ([`year`]). The modules do not depend on each other's results, so any of them
//! can be read first; `table` holds what the tables of sweeps and years share. Nothing here prints
//! to the terminal.

pub mod calibrate;
pub mod check;
pub mod convergence;
pub mod join;
pub mod sweep;
mod table;
pub mod year;
