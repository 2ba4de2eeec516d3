//! What leaves do with the light of each band.

use glam::Vec3;
use serde::Serialize;

use phylux_core::{
    math::spectrum::{Lanes, with_lanes},
    scene::{
        material::{Interaction, Material, Scatterer, Transport},
        world::Scene,
    },
};

/// What a leaf reflects, transmits and absorbs at normal incidence.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LeafSummary {
    /// Name of the material.
    pub material: String,
    /// Light that comes to the front.
    pub front: LeafOptics,
    /// Light that comes to the back; `None` where both faces are alike.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub back: Option<LeafOptics>,
}

/// Fractions of the light along the normal, per band, with the cuticle. They add up to 1.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LeafOptics {
    /// What goes back, mirrored and scattered.
    pub reflectance: Vec<f64>,
    /// What comes out of the other face.
    pub transmittance: Vec<f64>,
    /// What the leaf absorbs.
    pub absorptance: Vec<f64>,
}

/// Returns the leaves of a scene in the order of its materials.
pub(super) fn leaves(scene: &Scene) -> Vec<LeafSummary> {
    let materials = scene.materials().iter();
    let leaves = materials.filter(|named| matches!(named.material, Material::Leaf(_)));
    let of = |material: &Material, along: Vec3| {
        let bands = scene.bands().len();
        with_lanes!(scene.lanes(), L => optics::<L>(material, along, bands))
    };
    let summary = |material: &Material, name: &str| {
        let [front, back] = [Vec3::NEG_Z, Vec3::Z].map(|along| of(material, along));
        let back = (back != front).then_some(back);
        LeafSummary { material: name.to_owned(), front, back }
    };
    leaves.map(|named| summary(&named.material, &named.name)).collect()
}

/// Finds what the face does with light that comes `along` the z axis to a leaf whose front points
/// up. Along the normal both scattered lobes of a leaf have the same factors of the cuticle, so that
/// they share what is neither mirrored nor absorbed as their values there.
fn optics<L: Lanes>(material: &Material, along: Vec3, bands: usize) -> LeafOptics {
    let at = Interaction::new(along, Vec3::Z);
    let values = |band: usize, of: &[f32]| f64::from(of[band]);
    let absorbed = material.absorptance::<L>(&at);
    let ways = material.smooth_ways::<L>(&at, Transport::Light);
    let [back, through] = [-along, along].map(|outgoing| material.evaluate::<L>(&at, outgoing));
    let fractions = (0..bands).map(|band| {
        let absorbed = absorbed.as_ref().map_or(0.0, |all| values(band, all.values()));
        let mirrored = ways.iter().flatten().map(|way| values(band, way.weight.values()));
        let mirrored: f64 = mirrored.sum();
        let [back, through] = [&back, &through].map(|f| values(band, f.values()));
        let scattered = (1.0 - mirrored - absorbed).max(0.0);
        let share = if through > 0.0 { through / (back + through) } else { 0.0 };
        [mirrored + scattered * (1.0 - share), scattered * share, absorbed]
    });
    let fractions: Vec<[f64; 3]> = fractions.collect();
    let [reflectance, transmittance, absorptance] =
        [0, 1, 2].map(|kind| fractions.iter().map(|of| rounded(of[kind])).collect());
    LeafOptics { reflectance, transmittance, absorptance }
}

/// Rounds to the digits that single precision has.
fn rounded(fraction: f64) -> f64 {
    (fraction * 1e6).round() / 1e6
}
