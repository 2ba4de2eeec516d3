//! What the readers of meshes share.

use crate::{
    input::quoted,
    obj::{MeshGroup, ObjFile},
};
use phylux_core::error::{Error, Result};

/// Returns groups in the form of an OBJ file. Error: there is no triangle; `holds` says what there
/// is in the file called `name`.
pub fn of_groups(groups: Vec<MeshGroup>, name: &str, holds: &str) -> Result<ObjFile> {
    let found = ObjFile::from(groups);
    match found.parts.is_empty() {
        true => Err(Error::input(name, format!("holds no face ({holds})"))
            .remedy("a scene needs surfaces; mesh the points first")),
        false => Ok(found),
    }
}

/// Reads a text as a finite number; the error is the problem alone, in words.
pub fn number(word: &str) -> std::result::Result<f64, String> {
    let found = word.parse().ok().filter(|x: &f64| x.is_finite());
    found.ok_or_else(|| format!("{} is not a finite number", quoted(word)))
}
