//! Reads the files of meshes: OBJ, PLY, STL and glTF, told apart by the ending of their names. All
//! of them become an [`ObjFile`].
//!
//! PLY, STL and glTF are read here and not by crates (ply-rs-bw 4.0, stl_io 0.11, gltf 1.4 were
//! tried), because these lose data without a word or panic: surplus numbers and properties of one
//! name in a PLY file, digits of its text, every solid of an STL file but the first, binary STL
//! files that begin with `solid`, and glTF files with indices that do not exist.

mod gltf;
mod ply;
mod stl;

use std::path::Path;

use crate::{
    error::{Error, Result},
    formats::{
        input::quoted,
        obj::{MeshGroup, ObjFile},
    },
};

/// Reads the `bytes` of the file at `path`. `fetch` gets the bytes of a file that this one names
/// (MTL, the buffers of a glTF), or says why it cannot.
///
/// # Errors
/// At the file, and its line or place: it holds no face, or cannot be understood.
pub fn parse(
    bytes: &[u8],
    path: &Path,
    fetch: impl FnMut(&Path) -> std::result::Result<Vec<u8>, String>,
) -> Result<ObjFile> {
    let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
    let name = path.display().to_string();
    match ending.to_str() {
        Some("ply") => ply::parse(bytes, &name),
        Some("stl") => stl::parse(bytes, &name),
        Some("gltf" | "glb") => gltf::parse(bytes, path, fetch),
        _ => ObjFile::parse(bytes, path, fetch),
    }
}

/// Whether the file at `path` is read as OBJ: the only one with line numbers and MTL files.
pub fn is_obj(path: &Path) -> bool {
    let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
    !["ply", "stl", "gltf", "glb"].iter().any(|known| ending == *known)
}

/// Returns groups in the form of an OBJ file. Error: there is no triangle; `holds` says what there
/// is in the file called `name`.
fn of_groups(groups: Vec<MeshGroup>, name: &str, holds: &str) -> Result<ObjFile> {
    let found = ObjFile::from(groups);
    match found.parts.is_empty() {
        true => Err(Error::input(name, format!("holds no face ({holds})"))
            .remedy("a scene needs surfaces; mesh the points first")),
        false => Ok(found),
    }
}

/// Reads a text as a finite number; the error is the problem alone, in words.
fn number(word: &str) -> std::result::Result<f64, String> {
    let found = word.parse().ok().filter(|x: &f64| x.is_finite());
    found.ok_or_else(|| format!("{} is not a finite number", quoted(word)))
}

#[cfg(test)]
mod tests;
