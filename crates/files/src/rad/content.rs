//! The content of a Radiance file.

use std::path::PathBuf;

use glam::DVec3;

use phylux_core::error::Error;

/// The program that defines the meaning of materials.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Dialect {
    /// Radiance itself.
    #[default]
    Radiance,
    /// SEC2, where the colour of a material is its whole reflectance.
    Sec2,
}

/// A room: its surfaces, materials and lamps.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RadFile {
    /// The surfaces that are not lamps, in file order; neighbours with the same identifier and
    /// material form one part.
    pub parts: Vec<RadPart>,
    /// The materials, in file order. If several have the same name, a surface has the last one
    /// before it.
    pub materials: Vec<RadMaterial>,
    /// The lamps.
    pub lamps: Vec<RadLamp>,
    /// Messages for the user.
    pub warnings: Vec<String>,
}

/// Surfaces with one identifier and one material.
#[derive(Clone, Debug, PartialEq)]
pub struct RadPart {
    /// Name of the surfaces.
    pub identifier: String,
    /// Index into [`RadFile::materials`].
    pub material: usize,
    /// File and line of the first surface.
    pub place: String,
    /// Corners of the triangles in the file's unit, counter-clockwise seen from the front.
    pub triangles: Vec<[DVec3; 3]>,
}

/// A material.
#[derive(Clone, Debug, PartialEq)]
pub struct RadMaterial {
    /// Name of the material.
    pub name: String,
    /// Type of the material: plastic, metal, trans, glass, dielectric, mirror, BSDF, light or glow;
    /// empty where the file uses the material but does not define it.
    pub kind: String,
    /// The real arguments of the material.
    pub numbers: Vec<f64>,
    /// File and line of the material.
    pub place: String,
    /// What a BSDF names besides.
    pub bsdf: Option<RadBsdf>,
    /// Why the material is not read: an error only where a surface has it and the scene has no
    /// material of its name.
    pub problem: Option<Error>,
}

/// A measured material in a file of its own.
#[derive(Clone, Debug, PartialEq)]
pub struct RadBsdf {
    /// Where the file may be, in this order.
    pub files: Vec<PathBuf>,
    /// The direction that the azimuth of 90 degrees lies nearest to.
    pub up: DVec3,
    /// Whether the values reach through a device of some thickness, or hold a part that goes straight
    /// through.
    pub through: bool,
}

impl RadMaterial {
    /// Returns whether surfaces of this material are lamps.
    pub fn is_lamp(&self) -> bool {
        matches!(self.kind.as_str(), "light" | "glow")
    }
}

/// A surface that emits light.
#[derive(Clone, Debug, PartialEq)]
pub struct RadLamp {
    /// Name of the surface.
    pub identifier: String,
    /// Index into [`RadFile::materials`].
    pub material: usize,
    /// Ends and radius of a cylinder, in the file's unit; `None` for other surfaces.
    pub tube: Option<(DVec3, DVec3, f64)>,
    /// Corners of the triangles in the file's unit.
    pub triangles: Vec<[DVec3; 3]>,
}
