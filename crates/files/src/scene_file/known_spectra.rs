//! What is known of a scene's spectra while it is loaded: the light that averages are weighted
//! with, the tables that were read, and the averages that were made.

use std::{cell::RefCell, collections::BTreeMap, sync::Arc};

use super::spec::*;
use crate::spectrum_file::Measured;
use phylux_core::{math::curve::Curve, scene::daylight::DaylightSource};

/// The mean of a spectrum over each band of a scene.
#[derive(Clone, Debug)]
pub struct SpectrumAverage {
    /// Where the scene file has the spectrum, as a JSON pointer.
    pub pointer: String,
    /// Mean over each band, weighted with the light of the scene.
    pub means: Vec<f64>,
    /// For each band, the mean of the square over the square of the mean, both weighted like
    /// `means`. It says how far one number is from the spectrum for light that meets the surface
    /// twice: the fraction that remains of such light, over the fraction that the mean gives.
    pub spreads: Vec<f64>,
}

/// The spectra of a scene, as far as they are known.
#[derive(Default)]
pub(super) struct Spectra {
    pub(super) weight: Vec<Part>,
    /// Names of lights without a spectrum, which count as flat over each band.
    pub(super) flat: Vec<String>,
    pub(super) curves: RefCell<BTreeMap<String, Arc<Measured>>>,
    /// Means per band of spectra that were averaged, by the text of their entry in the scene file.
    pub(super) means: RefCell<BTreeMap<String, Vec<f64>>>,
    pub(super) averages: RefCell<Vec<SpectrumAverage>>,
    /// What is odd about the tables: their places and problems.
    pub(super) warnings: RefCell<Vec<(String, String)>>,
}

/// One source of the light that averages are weighted with, per nm in the scene's quantity.
pub(super) enum Part {
    Lamp {
        curve: Arc<Curve>,
        unit: SpectralUnitSpec,
        scale: f64,
    },
    Daylight(DaylightSource),
    /// Power in each band, spread evenly over the band.
    Flat(Vec<f64>),
}
