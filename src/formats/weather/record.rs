//! What weather files hold: records by the hour, and where they were taken.

use std::path::PathBuf;

use crate::scene::daylight::Timestamp;

pub(super) const HOUR: f64 = 3600.0;
pub(super) const DAY: f64 = 24.0 * HOUR;
/// Seconds of a year without leap day.
pub(super) const YEAR: f64 = 365.0 * DAY;

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
    pub(super) path: PathBuf,
    /// Where it was measured, if it says so.
    pub site: Option<Site>,
    pub(super) clock: Clock,
    pub(super) records: Vec<Record>,
}

/// What the times of a file's records are counted from, s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Clock {
    /// From the start of a year of 365 days, in standard time, which is `zone` seconds before UTC.
    TypicalYear { zone: f64 },
    /// From 1970-01-01T00:00Z.
    Unix,
}

/// One row: means over an interval.
#[derive(Clone, Copy, Debug)]
pub(super) struct Record {
    pub(super) line: u64,
    /// When it starts and ends, on the file's clock.
    pub(super) from: f64,
    pub(super) to: f64,
    /// When it really started, as the row says.
    pub(super) start: Timestamp,
    /// Global, direct normal and diffuse horizontal irradiance; none where missing.
    pub(super) global: Option<f64>,
    pub(super) direct: Option<f64>,
    pub(super) diffuse: Option<f64>,
}
