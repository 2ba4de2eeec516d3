//! Weather files: irradiances of the whole spectrum by the hour, and what a period takes of them.
//!
//! EPW and TMY3 (typical years: local standard time, the year of a row says nothing about the order), and CSV
//! with columns `time` (with offset), `ghi`, `dni`, `dhi`. All in W/m2.

mod clock;
mod period;
mod read;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};

pub use clock::ClockCheck;
pub use period::{Period, Selected};

use crate::{error::Result, scene::daylight::Timestamp};

const HOUR: f64 = 3600.0;
const DAY: f64 = 24.0 * HOUR;
/// Seconds of a year without leap day.
const YEAR: f64 = 365.0 * DAY;

/// Where in its interval the time of a CSV row stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stamp {
    /// At its start.
    Start,
    /// In its middle.
    Middle,
    /// At its end.
    End,
}

/// A place on the earth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Site {
    /// Degrees, north is positive, -90 to 90.
    pub latitude: f64,
    /// Degrees, east is positive, -180 to 180.
    pub longitude: f64,
}

/// A weather file.
#[derive(Clone, Debug)]
pub struct Weather {
    path: PathBuf,
    /// Where it was measured, if it says so.
    pub site: Option<Site>,
    clock: Clock,
    records: Vec<Record>,
}

/// What the times of a file's records are counted from, s.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Clock {
    /// From the start of a year of 365 days, in standard time, which is `zone` seconds before UTC.
    TypicalYear { zone: f64 },
    /// From 1970-01-01T00:00Z.
    Unix,
}

/// One row: means over an interval.
#[derive(Clone, Copy, Debug)]
struct Record {
    line: u64,
    /// When it starts and ends, on the file's clock.
    from: f64,
    to: f64,
    /// When it really started, as the row says.
    start: Timestamp,
    /// Global, direct normal and diffuse horizontal irradiance; none where missing.
    global: Option<f64>,
    direct: Option<f64>,
    diffuse: Option<f64>,
}

impl Weather {
    /// Reads the `bytes` of the weather file at `path`; what it is, is told by its first lines. `stamp` is for
    /// CSV alone.
    ///
    /// # Errors
    /// At `path:LINE`: a row that is no such row, a time that does not exist or comes twice, values above
    /// 2000 W/m2 or below -20 (a little below 0 is taken for 0); a file without rows; CSV without
    /// `stamp`, or `stamp` with another file.
    pub fn parse(bytes: &[u8], path: &Path, stamp: Option<Stamp>) -> Result<Self> {
        read::parse(bytes, path, stamp)
    }
}
