//! Intensity distributions of measured lamps, in the IES format (ANSI/IES LM-63, 1986 to 2019, type
//! C), in EULUMDAT, and in ANSI/IES TM-33 (XML).
//!
//! All formats give intensities at vertical angles (0 is the direction in which the lamp aims) for
//! horizontal angles C. The file of a symmetric lamp has only part of the circle of horizontal
//! angles; `symmetry` completes it.

mod eulumdat;
mod file;
mod lm63;
mod symmetry;
#[cfg(test)]
mod tests;
mod tm33;

use std::path::Path;

pub use file::{FluxUnit, MeasuredLamp, Photometry};

use crate::{input::from_utf16, xml};
use file::File;
use phylux_core::error::Result;

impl Photometry {
    /// Reads the `bytes` of the file at `path`. A file of XML is read as TM-33, one with a line that begins with `TILT=` is read
    /// as LM-63, any other as EULUMDAT; a file whose name ends with `.ies` must have such a line.
    /// Lines may end in any way, and the text may be UTF-16.
    ///
    /// # Errors
    /// At the line of the file: it is in neither of the two formats, does not use coordinates of
    /// type C, or has a tilt in another file; numbers are missing, not finite, negative or left
    /// over; angles do not increase or do not fit the symmetry; or the lamp emits no light.
    pub fn parse(bytes: &[u8], path: &Path) -> Result<Self> {
        if xml::is_xml(bytes) {
            return tm33::read(bytes, path);
        }
        let text = decoded(bytes);
        let file = File { path, lines: text.lines().collect() };
        match file.lines.iter().position(|line| lm63::tilt(line).is_some()) {
            Some(tilt) => lm63::read(&file, tilt),
            None if path.extension().is_some_and(|end| end.eq_ignore_ascii_case("ies")) => {
                let problem = "has no line that begins with `TILT=`";
                Err(file.error(file.lines.len().saturating_sub(1), problem).remedy(file::FETCH))
            }
            None => eulumdat::read(&file),
        }
    }
}

/// Returns the text of a file, with lines that end as ours do. Names may be in any encoding, but
/// numbers are ASCII in all of them, except in UTF-16, where every other byte of them is zero.
fn decoded(bytes: &[u8]) -> String {
    let text = from_utf16(bytes).unwrap_or_else(|| String::from_utf8_lossy(bytes).into_owned());
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    match text.contains('\n') {
        true => text.to_string(),
        false => text.replace('\r', "\n"),
    }
}
