//! Rooms in the format of Radiance: polygons, round shapes, materials and lamps (Ward and Shakespeare, Rendering with Radiance, 1998;
//! its manual "materials.1" and "ray.html"). Of commands only `!xform` and `!cat` are followed, here and not by a shell.

mod content;
mod lexer;
mod scan;
mod shapes;
#[cfg(test)]
mod tests;
mod xform;

use std::path::Path;

pub use content::{Dialect, RadFile, RadMaterial};

use crate::error::Result;
use scan::Scan;

impl RadFile {
    /// From the `bytes` of the file at `path`; `load` fetches the bytes of files that its commands name, by their path.
    ///
    /// # Errors
    /// At the line of a file: a primitive that is not known, without its arguments or with wrong ones, a modifier that no line
    /// has defined, a command that is not followed, a file that names itself.
    pub fn parse(
        bytes: &[u8],
        path: &Path,
        dialect: Dialect,
        load: &dyn Fn(&Path) -> std::result::Result<Vec<u8>, String>,
    ) -> Result<Self> {
        Scan::new(dialect, load).whole(bytes, path)
    }
}
