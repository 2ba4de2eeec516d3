//! What a scene is made of.

use std::{
    ops::Range,
    sync::{Arc, OnceLock},
};

use glam::DVec3;

use super::{
    parts::{Band, BandRatio, BandSum},
    surface::Surface,
};
use crate::{
    math::{geometry::Transform, sampling::Discrete, units::Quantity},
    scene::{light::Prism, stand::Stand},
};

/// What a scene is called, and what its numbers mean.
#[derive(Debug)]
pub(super) struct Head {
    pub name: String,
    pub quantity: Quantity,
    pub period_h: Option<f64>,
    pub bands: Vec<Band>,
    pub sums: Vec<BandSum>,
    pub ratios: Vec<BandRatio>,
}

/// The objects of a scene and the surfaces that they are made of.
#[derive(Debug)]
pub(super) struct Objects {
    pub names: Vec<String>,
    /// The first triangle of each surface part, and the index of its object.
    pub parts: Vec<(usize, Option<usize>)>,
    /// The surfaces that are copies of an object, and share no triangles.
    pub copies: Vec<ObjectCopy>,
    /// Of the triangles that are no shared copies.
    pub surfaces: Vec<Surface>,
    /// What copies that share triangles have in common, object by object.
    pub common: Vec<Common>,
}

/// Where a scene is and how far it reaches.
#[derive(Debug)]
pub(super) struct Place {
    /// The middle, m from the user's origin.
    pub center: DVec3,
    /// The radius, m, of a ball around it that holds the scene.
    pub radius: f32,
    /// The prism by whose faces light from infinitely far away comes in.
    pub inside: Prism,
    pub stand: Stand,
}

/// One of several copies of an object.
#[derive(Clone, Debug)]
pub struct ObjectCopy {
    /// Index of the object.
    pub object: Option<usize>,
    /// Its range among the triangles of all surfaces; each copy has the same triangles in the same
    /// order.
    pub triangles: Range<usize>,
    /// The transform that placed it, m from the user's origin.
    pub transform: Transform,
}

/// What the copies of an object have in common besides their triangles.
#[derive(Debug)]
pub(super) struct Common {
    /// Its surfaces; a captor is numbered among those of a copy.
    pub surfaces: Vec<Surface>,
    /// Index of the object, if it has a name.
    pub object: Option<usize>,
    /// Index of the first captor of the first copy.
    pub first_captor: usize,
    /// Number of captors of each copy.
    pub captors: usize,
    /// The areas of the triangles of each captor, once they are asked for.
    pub areas: Vec<OnceLock<Arc<Discrete>>>,
}
