//! The content of weather files: hourly records, and the place where they were measured.

use std::path::PathBuf;

use phylux_core::scene::daylight::{SunPosition, Timestamp};

pub(super) const HOUR: f64 = 3600.0;
pub(super) const DAY: f64 = 24.0 * HOUR;
/// Seconds of a year without a leap day.
pub(super) const YEAR: f64 = 365.0 * DAY;

/// The position of a CSV row's time within the interval of the row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stamp {
    /// At the start of the interval.
    Start,
    /// In the middle of the interval.
    Middle,
    /// At the end of the interval.
    End,
}

/// A place on the earth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Site {
    /// Latitude, degrees, -90 to 90, positive to the north.
    pub latitude: f64,
    /// Longitude, degrees, -180 to 180, positive to the east.
    pub longitude: f64,
}

/// The content of a weather file.
#[derive(Clone, Debug)]
pub struct Weather {
    pub(super) path: PathBuf,
    /// The place where it was measured, if the file says it.
    pub site: Option<Site>,
    /// Warnings about what stands in the file but could not be used.
    pub notes: Vec<String>,
    pub(super) clock: Clock,
    pub(super) records: Vec<Record>,
}

/// The instant from which the times of a file's records are counted, s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Clock {
    /// The start of a year of 366 days, in standard time, which is `zone` seconds ahead of UTC.
    TypicalYear { zone: f64 },
    /// 1970-01-01T00:00Z.
    Unix,
}

/// One row: means over an interval, W/m2.
#[derive(Clone, Copy, Debug)]
pub(super) struct Record {
    pub(super) line: u64,
    /// Start and end of the interval on the file's clock, s.
    pub(super) from: f64,
    pub(super) to: f64,
    /// The real time of the start, according to the row.
    pub(super) start: Timestamp,
    /// Global, direct normal and diffuse horizontal irradiance; `None` where missing.
    pub(super) global: Option<f64>,
    pub(super) direct: Option<f64>,
    pub(super) diffuse: Option<f64>,
}

impl Record {
    pub(super) fn length(&self) -> f64 {
        self.to - self.from
    }
}

impl Site {
    /// Returns the position of the sun `later` seconds after `start`.
    pub(super) fn sun(self, start: Timestamp, later: f64) -> SunPosition {
        let time = Timestamp { unix: start.unix + later, ..start };
        SunPosition::at(time, self.latitude.to_radians(), self.longitude.to_radians())
    }
}
