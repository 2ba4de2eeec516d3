//! Sums of the [moments](crate::transport::met) of the parameters of a scene.

use serde::{Deserialize, Serialize};

use crate::{
    math::{
        spectrum::{Lanes, Spectrum},
        stats::is_possible,
    },
    scene::{parameter::ParameterIndex, world::Scene},
    transport::met::Met,
};

/// Sums over some histories of the moments of all parameters, per band of the channels in which any
/// were counted. The parameters of a channel lie side by side, as light that arrives has met several.
#[derive(Clone, Debug)]
pub struct MomentTally {
    bands: usize,
    /// The number of sums of a channel: of all parameters that are counted, each per band.
    width: usize,
    /// For each channel its place in the next two lists, plus one; 0 where nothing was counted.
    places: Vec<u32>,
    touched: Vec<u32>,
    /// Per place, parameter and band.
    sums: Vec<f64>,
}

/// The contents of such a tally in the form in which they are sent and stored, for each channel in
/// which anything was counted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MomentSums {
    channels: Vec<u32>,
    /// Per channel, parameter and band.
    sums: Vec<f64>,
}

impl MomentTally {
    /// Returns an empty tally of the first parameters of a scene, in this number; `None` if there are
    /// none.
    pub fn new(scene: &Scene, parameters: usize) -> Option<Self> {
        let bands = scene.bands().len();
        let width = parameters * bands;
        let places = vec![0; scene.channels()];
        (width > 0).then(|| Self { bands, width, places, touched: Vec::new(), sums: Vec::new() })
    }

    /// Returns about how many bytes it takes for so many parameters when anything was counted in at
    /// most `touched` channels.
    pub fn bytes(scene: &Scene, parameters: usize, touched: usize) -> usize {
        let width = parameters * scene.bands().len();
        let of_channel = width * size_of::<f64>() + size_of::<u32>();
        let places = scene.channels() * size_of::<u32>();
        if width > 0 { touched.min(scene.channels()) * of_channel + places } else { 0 }
    }

    /// Adds the moments of light that has met these parameters and comes to a channel, as far as they
    /// are counted.
    #[inline]
    pub fn add_met<'a, L: Lanes>(
        &mut self,
        channel: usize,
        weights: impl IntoIterator<Item = &'a f64> + Clone,
        light: &Spectrum<L>,
        met: &Met<L>,
    ) {
        let (bands, width) = (self.bands, self.width);
        let row = self.row(channel);
        met.moments(light, |parameter, moment| {
            let first = usize::from(parameter) * bands;
            if first < width {
                accumulate(&mut row[first..][..bands], weights.clone(), &moment);
            }
        });
    }

    /// Adds to the moment of one parameter in a channel.
    #[inline]
    pub fn add<'a, L: Lanes>(
        &mut self,
        channel: usize,
        parameter: ParameterIndex,
        weights: impl IntoIterator<Item = &'a f64>,
        moment: &Spectrum<L>,
    ) {
        let bands = self.bands;
        let row = self.row(channel);
        accumulate(&mut row[usize::from(parameter) * bands..][..bands], weights, moment);
    }

    /// Returns the sums of a channel; a new channel gets a place at the end.
    #[inline]
    fn row(&mut self, channel: usize) -> &mut [f64] {
        if self.places[channel] == 0 {
            self.touched.push(channel as u32);
            self.sums.resize(self.touched.len() * self.width, 0.0);
            self.places[channel] = self.touched.len() as u32;
        }
        &mut self.sums[(self.places[channel] as usize - 1) * self.width..][..self.width]
    }

    /// Takes out everything that the tally holds, in the order of the channels.
    pub fn take(&mut self) -> MomentSums {
        let mut channels = std::mem::take(&mut self.touched);
        channels.sort_unstable();
        let mut sums = Vec::with_capacity(self.sums.len());
        for &channel in &channels {
            let place = std::mem::take(&mut self.places[channel as usize]) as usize - 1;
            sums.extend_from_slice(&self.sums[place * self.width..][..self.width]);
        }
        self.sums.clear();
        MomentSums { channels, sums }
    }

    /// Adds the contents of another tally of the same scene, of other histories.
    pub fn add_sums(&mut self, theirs: &MomentSums) {
        let rows = theirs.sums.chunks_exact(self.width);
        for (&channel, theirs) in theirs.channels.iter().zip(rows) {
            let mine = self.row(channel as usize);
            mine.iter_mut().zip(theirs).for_each(|(a, b)| *a += b);
        }
    }

    /// Returns whether these can be the contents of a tally of the same scene.
    pub fn fits(&self, MomentSums { channels, sums }: &MomentSums) -> bool {
        channels.is_sorted_by(|a, b| a < b)
            && channels.last().is_none_or(|last| (*last as usize) < self.places.len())
            && sums.len() == channels.len() * self.width
            && sums.iter().all(|sum| is_possible(*sum))
    }
}

impl MomentSums {
    /// Returns the channels in which anything was counted, in order, each with its sums: of the first
    /// parameter per band, of the second, and so on.
    pub fn rows(&self) -> impl Iterator<Item = (usize, &[f64])> {
        let width = self.sums.len().checked_div(self.channels.len()).unwrap_or(0).max(1);
        self.channels.iter().map(|&channel| channel as usize).zip(self.sums.chunks_exact(width))
    }
}

/// Adds the powers of light, weighted, to sums per band.
#[inline]
pub(super) fn accumulate<'a, L: Lanes>(
    sums: &mut [f64],
    weights: impl IntoIterator<Item = &'a f64>,
    power: &Spectrum<L>,
) {
    for ((sum, weight), power) in sums.iter_mut().zip(weights).zip(power.values()) {
        *sum += weight * f64::from(*power);
    }
}
