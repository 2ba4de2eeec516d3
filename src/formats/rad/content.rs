//! What such a file holds.

use glam::DVec3;

/// How materials are meant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Dialect {
    /// As in Radiance.
    #[default]
    Radiance,
    /// As in SEC2, where the colour is the whole reflectance.
    Sec2,
}

/// A room.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RadFile {
    /// Surfaces that are no lamps, in order, side by side where identifier and material are the same.
    pub parts: Vec<RadPart>,
    /// The materials, in order; of the same name the last one before a surface is its own.
    pub materials: Vec<RadMaterial>,
    /// The lamps.
    pub lamps: Vec<RadLamp>,
    /// What a user should know.
    pub warnings: Vec<String>,
}

/// Surfaces of one identifier and material.
#[derive(Clone, Debug, PartialEq)]
pub struct RadPart {
    /// Their name.
    pub identifier: String,
    /// Index of the material.
    pub material: usize,
    /// File and line of the first.
    pub place: String,
    /// Corners in the file's unit, counter-clockwise seen from the front.
    pub triangles: Vec<[DVec3; 3]>,
}

/// A material.
#[derive(Clone, Debug, PartialEq)]
pub struct RadMaterial {
    /// Its name.
    pub name: String,
    /// plastic, metal, trans, glass, dielectric, mirror, light or glow.
    pub kind: String,
    /// Its real arguments.
    pub numbers: Vec<f64>,
    /// File and line.
    pub place: String,
}

impl RadMaterial {
    /// Whether its surfaces are lamps.
    pub fn is_lamp(&self) -> bool {
        matches!(self.kind.as_str(), "light" | "glow")
    }
}

/// A surface that shines.
#[derive(Clone, Debug, PartialEq)]
pub struct RadLamp {
    /// Its name.
    pub identifier: String,
    /// Index of the material.
    pub material: usize,
    /// Of a cylinder its ends and its radius, in the file's unit.
    pub tube: Option<(DVec3, DVec3, f64)>,
    /// Of others the corners.
    pub triangles: Vec<[DVec3; 3]>,
}
