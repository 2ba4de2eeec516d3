//! What a scene is made of, as files or a program give it.

use std::{collections::BTreeMap, ops::Range};

use glam::DVec3;

use crate::{
    math::{geometry::Transform, units::Quantity},
    scene::{
        captor::{CaptorKind, Sensor},
        light::LightShape,
        material::Material,
    },
};

/// A wavelength interval that is traced apart.
#[derive(Clone, Debug, PartialEq)]
pub struct Band {
    /// Unique name.
    pub name: String,
    /// Where it begins, nm, at least 0 and below `to_nm`.
    pub from_nm: Option<f64>,
    /// Where it ends, nm.
    pub to_nm: Option<f64>,
}

/// A total over bands, reported like a band.
#[derive(Clone, Debug, PartialEq)]
pub struct BandSum {
    /// Unique among bands and sums.
    pub name: String,
    /// Indices of its bands, at least one and each once.
    pub bands: Vec<usize>,
}

/// A material with its name.
#[derive(Clone, Debug)]
pub struct NamedMaterial {
    /// Unique name.
    pub name: String,
    /// What it does with light; one value for each band.
    pub material: Material,
}

/// Triangles of one material, and of one captor if they count.
#[derive(Clone, Debug)]
pub struct SurfacePart {
    /// Index of the object that it is part of, if it has a name.
    pub object: Option<usize>,
    /// Index of the material.
    pub material: usize,
    /// Index of the surface captor.
    pub captor: Option<usize>,
    /// Corners, m from the user's origin.
    pub triangles: Vec<[DVec3; 3]>,
}

/// Surfaces that are one of several copies of an object.
#[derive(Clone, Debug)]
pub struct CopyPart {
    /// Indices of its surfaces, the same ones in the same order in each copy.
    pub surfaces: Range<usize>,
    /// Where it was put.
    pub transform: Transform,
}

/// A light to be.
#[derive(Clone, Debug)]
pub struct LightPart {
    /// Unique name.
    pub name: String,
    /// Emitted flux per band, 0 or from 1e-30 to 1e30 W or umol/s; of a light at infinity it is found
    /// from the scene's extent, whatever stands here.
    pub power: Vec<f64>,
    /// Shape, m from the user's origin.
    pub shape: LightShape,
}

/// A captor to be.
#[derive(Clone, Debug)]
pub struct CaptorPart {
    /// Unique name.
    pub id: String,
    /// Virtual or surface.
    pub kind: CaptorKind,
    /// Corners of a virtual captor, m; a surface captor's are the parts that name it.
    pub triangles: Vec<[DVec3; 3]>,
    /// Indices of the groups that it belongs to, each once.
    pub groups: Vec<usize>,
    /// Its shape and response, where they are special; of virtual captors only.
    pub sensor: Sensor,
}

/// What a scene is made of, as files or a program give it.
#[derive(Clone, Debug, Default)]
pub struct SceneParts {
    /// Title.
    pub name: String,
    /// What the photons carry.
    pub quantity: Quantity,
    /// Whether its daylight is the mean over a period, nights included, so that a sum of a day follows from
    /// a result.
    pub is_period: bool,
    /// At least one.
    pub bands: Vec<Band>,
    /// Totals over bands.
    pub sums: Vec<BandSum>,
    /// The materials, with names of their own.
    pub materials: Vec<NamedMaterial>,
    /// Names of the objects.
    pub objects: Vec<String>,
    /// The surfaces.
    pub surfaces: Vec<SurfacePart>,
    /// Which of them are copies, each object's one after the other; for showing them, rays do not know of it.
    pub copies: Vec<CopyPart>,
    /// Of surfaces (by index) whose material is a table that is turned about the normal: where azimuth 0 is on each of their
    /// triangles.
    pub tangents: BTreeMap<usize, Vec<DVec3>>,
    /// The lights, at least one.
    pub lights: Vec<LightPart>,
    /// The captors.
    pub captors: Vec<CaptorPart>,
    /// Names of the groups, unique.
    pub groups: Vec<String>,
}
