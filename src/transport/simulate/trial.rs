//! A short trial of both estimators on the scene itself, to pick the cheaper one.
//!
//! Cost is counted as work, never by the clock: rays x relative variance, which is the number of
//! rays for a relative standard error of 1, and falls as 1 / error^2.

use super::{BATCHES, Control, Keep, Run, faces};
use crate::{
    error::Result,
    math::{
        rng::{Purpose, Streams},
        spectrum::with_lanes,
        stats::Estimate,
    },
    scene::world::Scene,
    transport::{
        paths::{Face, Pilot, Unseen},
        settings::{Estimator, Settings},
    },
};

/// Photons, and paths from all faces together, of a trial.
const TRIAL: u64 = 1 << 16;
/// It ends sooner where paths are so long that they take more rays.
const RAYS: u64 = 1 << 20;
/// The least number of paths from a face.
const LEAST: u64 = 16;
/// The most faces that paths are tried from, spread over all captors.
const FACES: usize = 64;
/// Share of the light on captors that paths may miss; where they would miss more, photons do it.
const MISSED: f64 = 1e-3;
/// The error that work is told for, where no tolerance is asked for.
const GOAL: f64 = 0.01;

/// An estimator and why it was chosen.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// Photons or paths.
    pub estimator: Estimator,
    /// A sentence for the user.
    pub why: String,
}

impl Choice {
    /// Picks the cheaper estimator for the tolerance of `settings` on each captor or, without one, for
    /// the root mean square error over captors. Errors: those of a run.
    pub(super) fn make(scene: &Scene, settings: &Settings, control: &Control) -> Result<Self> {
        make(scene, settings, control)
    }
}

fn make(scene: &Scene, settings: &Settings, control: &Control) -> Result<Choice> {
    if settings.by_light {
        let why = "only photons know which light they come from".into();
        return Ok(Choice { estimator: Estimator::Photons, why });
    }
    let missed = Unseen::find(scene, settings.seed).map_or(0.0, |unseen| unseen.share());
    if missed > MISSED {
        let why = format!("paths cannot find {:.2} % of the light on the captors", 100.0 * missed);
        return Ok(Choice { estimator: Estimator::Photons, why });
    }
    if scene.captors.is_empty() {
        let why = "there is no captor for paths to start from".into();
        return Ok(Choice { estimator: Estimator::Photons, why });
    }
    let settings = Settings { estimator: Estimator::Photons, max_time: None, ..settings.clone() };
    let run = Run::new(scene, &settings, Vec::new(), Keep::OnCaptors, control)?;
    let run = Run { purpose: Purpose::Trial, ..run };
    // one photon of each light in each batch, then twice as many, ...
    let mut histories = BATCHES * scene.sources() as u64;
    let totals = loop {
        let mut totals = run.totals();
        run.rounds(&run.schedule(histories)?, (0, 0, 0), 0..1, None, &mut totals, None)?;
        if histories >= TRIAL || totals.segments >= RAYS {
            break totals;
        }
        histories *= 2;
    };
    let all = faces(scene);
    let number = all.len();
    let tried: Vec<Face> = all.into_iter().step_by(number.div_ceil(FACES)).collect();
    let mut photons_found = Found { rays: totals.segments, ..Found::default() };
    for face in &tried {
        let channel = scene.captors[face.captor].first_channel + face.channel as usize;
        for running in &totals.running(channel)[..scene.bands.len()] {
            let Estimate { mean, standard_error } = running.estimate(totals.batches);
            let relative = standard_error.unwrap_or(mean) / mean;
            photons_found.add(mean, relative.powi(2) * histories as f64);
        }
    }

    let mut paths_found = Found::default();
    let bands = scene.bands.len();
    let nothing = || vec![vec![0.0; bands]; tried.len()];
    let (mut sums, mut squares) = (nothing(), nothing());
    let mut paths = 0;
    // the photons had the batches before
    let streams = Streams::new(settings.seed, Purpose::Trial, BATCHES);
    let pilot = Pilot::run(scene, settings.seed);
    while paths < LEAST || (paths < TRIAL / tried.len() as u64 && paths_found.rays < RAYS) {
        for (f, face) in tried.iter().enumerate() {
            let mut rng = streams.history(paths * tried.len() as u64 + f as u64);
            let (rays, flux) = with_lanes!(scene.lanes(), L => {
                let score = face.path::<L>(&pilot, &mut rng);
                (score.rays, score.flux.values()[..bands].to_vec())
            });
            paths_found.rays += u64::from(rays);
            for (b, flux) in flux.into_iter().map(f64::from).enumerate() {
                sums[f][b] += flux;
                squares[f][b] += flux * flux;
            }
        }
        run.check_stopped()?;
        paths += 1;
    }
    for (sum, square) in sums.iter().zip(&squares) {
        for (sum, square) in sum.iter().zip(square).take(scene.bands.len()) {
            paths_found.add(*sum, square * paths as f64 / (sum * sum) - 1.0);
        }
    }

    // photons serve all faces at once, a path one
    let photon = photons_found.rays as f64 / totals.histories as f64;
    let path = number as f64 * paths_found.rays as f64 / (paths * tried.len() as u64) as f64;
    let goal = settings.tolerance.unwrap_or(GOAL);
    let hardest = settings.tolerance.is_some();
    let photons = photon * photons_found.variance(&paths_found, histories, hardest) / goal.powi(2);
    let paths = path * paths_found.variance(&photons_found, paths, hardest) / goal.powi(2);
    let estimator = if paths < photons { Estimator::Paths } else { Estimator::Photons };
    let of = if hardest { "on every captor" } else { "over all captors" };
    let percent = 100.0 * goal;
    let why =
        format!("for {percent} % {of} photons take about {photons:.1e} rays, paths {paths:.1e}");
    Ok(Choice { estimator, why })
}

/// What a trial of one estimator has found.
#[derive(Default)]
pub(super) struct Found {
    /// Rays that it took.
    pub(super) rays: u64,
    /// For each face and band the relative variance of one history; none where nothing arrived.
    pub(super) variances: Vec<Option<f64>>,
}

impl Found {
    pub(super) fn add(&mut self, mean: f64, variance: f64) {
        self.variances.push((mean > 0.0).then_some(variance));
    }

    /// The greatest or the mean relative variance, where this trial or the other has found light. Of
    /// what it has missed in so many histories that number is the least.
    pub(super) fn variance(&self, other: &Self, histories: u64, greatest: bool) -> f64 {
        let both = self.variances.iter().zip(&other.variances);
        let lit = both.filter(|(mine, theirs)| mine.is_some() || theirs.is_some());
        let values: Vec<f64> = lit.map(|(mine, _)| mine.unwrap_or(histories as f64)).collect();
        match greatest {
            true => values.into_iter().fold(0.0, f64::max),
            false => values.iter().sum::<f64>() / values.len().max(1) as f64,
        }
    }
}
