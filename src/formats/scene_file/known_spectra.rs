//! Spectra of a scene while it is read.

use std::{cell::RefCell, collections::BTreeMap, sync::Arc};

use super::format::*;
use crate::{math::curve::Curve, scene::daylight::DaylightSource};

/// What a spectrum is in each band of a scene.
#[derive(Clone, Debug)]
pub struct SpectrumAverage {
    /// Where the scene file has it, as a JSON pointer.
    pub pointer: String,
    /// Mean over each band, weighted by the light.
    pub means: Vec<f64>,
    /// For each band the mean square over the square of the mean, weighted alike: how far one number is from the
    /// spectrum after two passages.
    pub spreads: Vec<f64>,
}

/// The spectra of a scene, as far as they are known.
#[derive(Default)]
pub(super) struct Spectra {
    pub(super) weight: Vec<Part>,
    /// Lights that count as flat for want of a spectrum.
    pub(super) flat: Vec<String>,
    pub(super) curves: RefCell<BTreeMap<String, Arc<Curve>>>,
    /// By what stands in the scene file.
    pub(super) means: RefCell<BTreeMap<String, Vec<f64>>>,
    pub(super) averages: RefCell<Vec<SpectrumAverage>>,
}

/// Light that is carried, per nm in the scene's quantity.
pub(super) enum Part {
    Lamp {
        curve: Arc<Curve>,
        unit: SpectralUnitFile,
        scale: f64,
    },
    Daylight(DaylightSource),
    /// Of each band.
    Flat(Vec<f64>),
}
