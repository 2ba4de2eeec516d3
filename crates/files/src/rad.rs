//! Reads rooms in the format of Radiance: polygons, round shapes, materials and lamps (Ward and
//! Shakespeare, Rendering with Radiance, 1998; its manual "materials.1" and "ray.html"). Of the
//! commands in a file only `!xform` and `!cat` are carried out, by this module and not by a shell.

mod content;
mod lexer;
mod scan;
mod shapes;
#[cfg(test)]
mod tests;
mod xform;

use std::path::Path;

pub use content::{Dialect, RadBsdf, RadFile, RadMaterial};

use phylux_core::error::Result;
use scan::Scan;

impl RadFile {
    /// Reads the `bytes` of the file at `path`; `load` fetches the bytes of the files that its
    /// commands name, by their paths.
    ///
    /// # Errors
    /// At the line of a file: a primitive is unknown or its arguments are missing or wrong, an alias
    /// names something undefined, a command is not supported, or a file includes itself; at the
    /// file, that it has no surface. What is wrong with a material stands in its `problem`.
    pub fn parse(
        bytes: &[u8],
        path: &Path,
        dialect: Dialect,
        load: &dyn Fn(&Path) -> std::result::Result<Vec<u8>, String>,
    ) -> Result<Self> {
        Scan::new(dialect, load).whole(bytes, path)
    }
}
