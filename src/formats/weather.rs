//! Weather files: irradiances of the whole spectrum by the hour, and what a period takes of them.
//!
//! EPW and TMY3 (typical years: local standard time, the year of a row says nothing about the order), and CSV
//! with columns `time` (with offset), `ghi`, `dni`, `dhi`. All in W/m2.

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
