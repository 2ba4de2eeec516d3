//! The parts of an OBJ file: its groups, and runs of faces.

use glam::DVec3;

/// The faces under one name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ObjGroup {
    /// What the last `o` or `g` line named (`default` where it gave no name); none for the faces
    /// before any such line.
    pub name: Option<String>,
}

/// One run of faces with one group and one material.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjPart {
    /// Index into [`ObjFile::groups`](super::ObjFile::groups).
    pub group: usize,
    /// The name after `usemtl`, as written.
    pub material: Option<String>,
    /// Line of its first face, from 1.
    pub line: usize,
    /// Corners in the file's unit, all finite, counter-clockwise seen from the front; at least one
    /// triangle, possibly without area.
    pub triangles: Vec<[DVec3; 3]>,
    /// How many of its faces have an outline that crosses itself, so that it is unclear what they
    /// cover.
    pub tangled: usize,
    /// How many of its faces have corners that are not in one plane.
    pub bent: usize,
}
