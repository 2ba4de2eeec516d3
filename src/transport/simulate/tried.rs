//! What a trial of a way to find the light says of it.

use crate::{
    math::stats::Estimate,
    scene::world::Scene,
    transport::{settings::Settings, tally::Totals},
};

/// Photons of this seed, counted and not kept.
pub(super) fn of_a_trial(settings: &Settings) -> Settings {
    Settings { k: Some(0), seed: settings.seed, threads: settings.threads, ..Settings::default() }
}

/// What was found by so many histories.
#[derive(Clone)]
pub(super) struct Found {
    /// Rays that it took.
    pub(super) rays: u64,
    histories: f64,
    /// For each channel that was asked for, and band, the relative variance of one history; none where nothing arrived.
    variances: Vec<Option<f64>>,
}

impl Found {
    /// What totals of so many histories say of some channels.
    pub(super) fn new(
        scene: &Scene,
        totals: &Totals,
        histories: u64,
        channels: impl Iterator<Item = usize>,
    ) -> Self {
        let histories = histories as f64;
        let bands = channels.flat_map(|channel| &totals.running(channel)[..scene.bands.len()]);
        let variance = |estimate: Estimate| {
            let Estimate { mean, standard_error } = estimate;
            let relative = standard_error.unwrap_or(mean) / mean;
            (mean > 0.0).then_some(relative.powi(2) * histories)
        };
        let variances = bands.map(|band| variance(band.estimate(totals.batches))).collect();
        Self { rays: totals.segments, histories, variances }
    }

    /// Whether there was no light on most of them.
    pub(super) fn is_dark(&self) -> bool {
        2 * self.variances.iter().flatten().count() < self.variances.len()
    }

    /// The relative variance of one history where this trial or the other has found light, the least first. Of what this
    /// one has missed it is at least as many as there were.
    pub(super) fn variances(&self, other: &Self) -> Vec<f64> {
        let both = self.variances.iter().zip(&other.variances);
        let lit = both.filter(|(mine, theirs)| mine.is_some() || theirs.is_some());
        let mut all: Vec<f64> = lit.map(|(mine, _)| mine.unwrap_or(self.histories)).collect();
        all.sort_unstable_by(f64::total_cmp);
        if all.is_empty() { vec![self.histories] } else { all }
    }

    /// Their mean.
    pub(super) fn mean(&self, other: &Self) -> f64 {
        let all = self.variances(other);
        all.iter().sum::<f64>() / all.len() as f64
    }
}
