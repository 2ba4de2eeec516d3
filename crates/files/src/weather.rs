//! Weather files: hourly irradiances of the whole spectrum, W/m2, and the selection of hours for an
//! instant or a period.
//!
//! The formats are EPW, TMY3 and TMY2 (typical years in local standard time, where the years of the
//! rows do not affect their order), CSV with the columns `time` (with offset from UTC), `ghi`, `dni`
//! and `dhi`, and the tables of PVGIS, NSRDB, Open-Meteo and NASA POWER. Read `record` first, then
//! `cells`, `read`, `heads` and `tables`; `calendar` and `period` select rows, `split` makes direct and
//! diffuse light of their columns, and `clock` checks a file's times.

mod calendar;
mod cells;
mod clock;
mod heads;
mod period;
mod read;
mod record;
mod split;
mod tables;
#[cfg(test)]
mod tests;

use std::path::Path;

pub use clock::{ClockCheck, Evidence};
pub use period::{Period, Selected, Slot};
pub use record::{Site, Stamp, Weather};

use phylux_core::error::Result;

impl Weather {
    /// Reads the `bytes` of the weather file at `path`; its first lines decide its format. `stamp`
    /// is for tables only: CSV files need it, and tables that say it themselves do not.
    ///
    /// An irradiance that is empty, above 2000 W/m2, below -20 W/m2 or no number is missing (values
    /// from -20 to 0 count as 0); what is no usual word or code for that stands in `notes`.
    ///
    /// # Errors
    /// At `path:LINE`: a row has the wrong form, or a time does not exist or is repeated. At the
    /// file: it has no rows, a CSV file comes without `stamp`, or an EPW, TMY3 or TMY2 file comes
    /// with it.
    pub fn parse(bytes: &[u8], path: &Path, stamp: Option<Stamp>) -> Result<Self> {
        read::parse(bytes, path, stamp)
    }
}
