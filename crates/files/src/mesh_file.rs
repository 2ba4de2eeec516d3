//! Reads the files of meshes: OBJ, PLY, STL and glTF, told apart by the ending of their names. All
//! of them become an [`ObjFile`].
//!
//! PLY, STL and glTF are read here and not by crates (ply-rs-bw 4.0, stl_io 0.11, gltf 1.4 were
//! tried), because these lose data without a word or panic: surplus numbers and properties of one
//! name in a PLY file, digits of its text, every solid of an STL file but the first, binary STL
//! files that begin with `solid`, and glTF files with indices that do not exist.

mod gltf;
mod ply;
mod shared;
mod stl;

use std::path::Path;

use crate::obj::ObjFile;
use phylux_core::error::Result;

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

#[cfg(test)]
mod tests;
