//! How a year is to be found.

use std::path::PathBuf;

use super::{hours_of::HoursOf, kept::Kept};
use phylux_files::control_file::ControlFile;

/// How a year is to be found.
#[derive(Clone)]
pub struct YearOptions<'a> {
    /// A control file and its name.
    pub control: Option<(&'a ControlFile, &'a str)>,
    /// The captors and groups whose hours are wanted.
    pub hours: HoursOf,
    /// Number of points of each captor from which the sun is looked for in each hour; `None` takes
    /// as many as the number of captors allows.
    pub sun_rays: Option<u64>,
    /// Work that is done already, and where what is done is kept.
    pub kept: Kept<'a>,
    /// A folder on a disk that has room for what does not fit into memory.
    pub scratch: PathBuf,
    /// Is told what is done next: what the progress counts from here on.
    pub phase: &'a (dyn Fn(&str) + Sync),
}

impl Default for YearOptions<'_> {
    fn default() -> Self {
        let scratch = std::env::temp_dir();
        let hours = HoursOf::default();
        let kept = Kept::default();
        Self { control: None, hours, sun_rays: None, kept, scratch, phase: &|_| {} }
    }
}
