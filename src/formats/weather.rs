//! Weather files: hourly irradiances of the whole spectrum, W/m2, and the selection of hours for an
//! instant or a period.
//!
//! The formats are EPW and TMY3 (typical years in local standard time, where the years of the rows
//! do not affect their order), and CSV with the columns `time` (with offset from UTC), `ghi`, `dni`
//! and `dhi`. Read `record` first, then `read` and `period`; `clock` checks a file's times.

mod clock;
mod period;
mod read;
mod record;
#[cfg(test)]
mod tests;

use std::path::Path;

pub use clock::ClockCheck;
pub use period::{Period, Selected, Slot};
pub use record::{Site, Stamp, Weather};

use crate::error::Result;

impl Weather {
    /// Reads the `bytes` of the weather file at `path`; its first lines decide its format. `stamp`
    /// is for CSV files only.
    ///
    /// # Errors
    /// At `path:LINE`: a row has the wrong form, a time does not exist or is repeated, or a value
    /// is above 2000 W/m2 or below -20 W/m2 (values from -20 to 0 count as 0). At the file: it has
    /// no rows, a CSV file comes without `stamp`, or another file comes with it.
    pub fn parse(bytes: &[u8], path: &Path, stamp: Option<Stamp>) -> Result<Self> {
        read::parse(bytes, path, stamp)
    }
}
