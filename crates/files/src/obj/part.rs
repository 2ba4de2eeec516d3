//! The parts of an OBJ file: its groups and its runs of faces.

use glam::DVec3;

/// A group: all faces under one name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ObjGroup {
    /// The name on the last `o` or `g` line (`default` where that line has no name); `None` for the
    /// faces before any such line.
    pub name: Option<String>,
}

/// One run of faces with one group and one material.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjPart {
    /// Index into [`ObjFile::groups`](super::ObjFile::groups).
    pub group: usize,
    /// The name after `usemtl`, as written; `None` before any `usemtl` line and after one without a
    /// name.
    pub material: Option<String>,
    /// Line of the first face, from 1.
    pub line: usize,
    /// Corners of the triangles in the file's unit, all finite, counter-clockwise seen from the
    /// front; at least one triangle, possibly without area.
    pub triangles: Vec<[DVec3; 3]>,
    /// Number of faces with an outline that crosses itself, so that it is unclear what they cover.
    pub tangled: usize,
    /// Number of faces whose corners are not in one plane.
    pub bent: usize,
}
