//! What takes more than one run, or none: many runs as tables ([`sweep`]), error against cost
//! ([`convergence`]), what looks wrong in a scene ([`check`]), powers of lamps
//! from measured readings ([`calibrate`]), the parts of a run joined ([`join`]),
//! daylight and lamps by the hour ([`year`]).

pub mod calibrate;
pub mod check;
pub mod convergence;
pub mod join;
pub mod sweep;
mod table;
pub mod year;
