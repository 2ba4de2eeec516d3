//! Measured lamps: intensity distributions in the IES format (ANSI/IES LM-63, 1986 to 2019, type C) and in EULUMDAT.
//!
//! Both give intensities at vertical angles (0 is where the lamp aims) for horizontal angles C, of which a
//! symmetric lamp needs but a part; the reader completes the circle.

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
    /// Reads the `bytes` of the file at `path`; a line that begins with `TILT=` makes it LM-63, and so does the ending
    /// `.ies`, without which line it is an error.
    ///
    /// # Errors
    /// At the line of the file: neither of both formats, other coordinates than type C, a tilt, numbers that are
    /// missing, not finite, negative or left over, angles that do not rise or do not fit the symmetry, no light.
    pub fn parse(bytes: &[u8], path: &Path) -> Result<Self> {
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        // names are in any encoding; numbers are ASCII in all of them
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
