//! The result of a trial: the variance that a way to find the light would have.

use super::{BATCHES, Control, Keep, Run};
use crate::{
    error::Result,
    math::{rng::Purpose, stats::Estimate},
    scene::world::Scene,
    transport::{settings::Settings, tally::Totals},
};

/// The most rays that the photons of one trial should trace. Between walls that absorb nothing, one
/// photon takes 10,000.
pub(super) const RAYS: u64 = 1 << 20;

/// Returns the settings of a trial: photons of the same seed, which are counted and not stored.
pub(super) fn of_a_trial(settings: &Settings) -> Settings {
    Settings { k: Some(0), seed: settings.seed, threads: settings.threads, ..Settings::default() }
}

/// Returns the number of photons that a trial can afford: `photons` or, where paths are long, only
/// as many as trace about [`RAYS`], but at least one for each batch and source. That many are
/// traced to measure how long paths are. Errors: those of a run.
pub(super) fn affordable(
    scene: &Scene,
    settings: &Settings,
    control: &Control,
    photons: u64,
) -> Result<u64> {
    let settings = of_a_trial(settings);
    let run = Run::new(scene, &settings, Vec::new(), Keep::OnCaptors, control)?;
    let run = Run { purpose: Purpose::Guiding, ..run };
    let mut totals = run.totals();
    let few = BATCHES.max(scene.sources() as u64);
    run.rounds(&run.schedule(few)?, (0, 0, 0), 0..1, None, &mut totals, None)?;
    Ok(photons.min((RAYS * few / totals.segments.max(1)).max(few)))
}

/// What a trial has found.
#[derive(Clone)]
pub(super) struct Found {
    /// Number of rays that it traced.
    pub(super) rays: u64,
    histories: f64,
    /// For each channel that was asked for, and each band, the relative variance of one history;
    /// `None` where nothing arrived.
    variances: Vec<Option<f64>>,
}

impl Found {
    /// Evaluates the totals of a trial of so many histories, in some channels.
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

    /// Returns the relative variance of one history for each channel that was asked for, and each
    /// band; `None` where nothing arrived.
    pub(super) fn each(&self) -> impl Iterator<Item = Option<f64>> {
        self.variances.iter().copied()
    }

    /// Returns the same with other relative variances.
    pub(super) fn with(&self, variances: Vec<Option<f64>>) -> Self {
        Self { variances, ..*self }
    }

    /// Returns whether no light arrived in most of the channels and bands.
    pub(super) fn is_dark(&self) -> bool {
        2 * self.variances.iter().flatten().count() < self.variances.len()
    }

    /// Returns the relative variance of one history wherever this trial or the other has found
    /// light, in rising order. Where this trial has missed light it takes the number of its own
    /// histories, because the variance is at least about that large.
    pub(super) fn variances(&self, other: &Self) -> Vec<f64> {
        let both = self.variances.iter().zip(&other.variances);
        let lit = both.filter(|(mine, theirs)| mine.is_some() || theirs.is_some());
        let mut all: Vec<f64> = lit.map(|(mine, _)| mine.unwrap_or(self.histories)).collect();
        all.sort_unstable_by(f64::total_cmp);
        if all.is_empty() { vec![self.histories] } else { all }
    }

    /// Returns the mean of [`variances`](Self::variances).
    pub(super) fn mean(&self, other: &Self) -> f64 {
        let all = self.variances(other);
        all.iter().sum::<f64>() / all.len() as f64
    }
}

#[cfg(test)]
mod tests {

    use glam::DVec3;

    use super::*;
    use crate::scene::{
        light::LightShape,
        material::{Lambert, Material},
        world::{Band, LightPart, NamedMaterial, SceneParts, SurfacePart},
    };

    /// A tetrahedron with a lamp in it. Where the walls absorb everything, each photon ends at the
    /// first wall, and as many are traced as were asked for. Where they absorb nothing a photon
    /// takes 10,000 rays, and one photon for each batch is traced. Chance plays no part in this.
    #[test]
    fn fewer_photons_are_tried_where_paths_are_long() {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let photons = |reflectance: f32| {
            let wall = Material::Lambert(Lambert::new(&[reflectance]));
            let shape = LightShape::Point { position: DVec3::splat(0.1) };
            let scene = Scene::new(SceneParts {
                bands: vec![Band { name: "PAR".into(), from_nm: None, to_nm: None }],
                lights: vec![LightPart { name: "lamp".into(), power: vec![1.0], shape }],
                materials: vec![NamedMaterial { name: "wall".into(), material: wall }],
                surfaces: vec![SurfacePart {
                    object: None,
                    material: 0,
                    captor: None,
                    triangles: [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]
                        .map(|face| face.map(|corner: usize| corners[corner]))
                        .to_vec(),
                }],
                ..SceneParts::default()
            });
            let control = Control::default();
            affordable(&scene.unwrap(), &Settings::default(), &control, 4096).unwrap()
        };
        assert_eq!(photons(0.0), 4096);
        assert_eq!(photons(1.0), BATCHES);
    }
}
