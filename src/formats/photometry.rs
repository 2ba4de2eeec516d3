//! Intensity distributions of measured lamps, in the IES format (ANSI/IES LM-63, 1986 to 2019, type
//! C) and in EULUMDAT.
//!
//! Both formats give intensities at vertical angles (0 is the direction in which the lamp aims) for
//! horizontal angles C. The file of a symmetric lamp has only part of the circle of horizontal
//! angles; `symmetry` completes it.

mod eulumdat;
mod file;
mod lm63;
mod symmetry;
#[cfg(test)]
mod tests;

use std::path::Path;

pub use file::Photometry;

use crate::error::Result;
use file::File;

impl Photometry {
    /// Reads the `bytes` of the file at `path`. A file with a line that begins with `TILT=` is read
    /// as LM-63, any other as EULUMDAT; a file whose name ends with `.ies` must have such a line.
    ///
    /// # Errors
    /// At the line of the file: it is in neither of the two formats, does not use coordinates of
    /// type C, or has a tilt; numbers are missing, not finite, negative or left over; angles do not
    /// increase or do not fit the symmetry; or the lamp emits no light.
    pub fn parse(bytes: &[u8], path: &Path) -> Result<Self> {
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        // names may be in any encoding, but numbers are ASCII in all of them
        let text = String::from_utf8_lossy(bytes);
        let file = File { path, lines: text.lines().collect() };
        match file.lines.iter().position(|line| line.trim_start().starts_with("TILT=")) {
            Some(tilt) => lm63::read(&file, tilt),
            None if path.extension().is_some_and(|end| end.eq_ignore_ascii_case("ies")) => {
                let problem = "has no line that begins with `TILT=`";
                Err(file.error(file.lines.len().saturating_sub(1), problem).remedy(file::FETCH))
            }
            None => eulumdat::read(&file),
        }
    }
}
