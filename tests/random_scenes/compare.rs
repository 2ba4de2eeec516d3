//! One room by photons and by paths.

use std::sync::atomic::AtomicBool;

use phylux::{Control, Estimator, Running, Scene, Settings};

/// Batches that both errors come from.
pub const BATCHES: u64 = 128;
/// Histories of a batch: photons, and paths from each face.
const PHOTONS: u64 = 800;
const PATHS: u64 = 48;
/// Relative error of photons above which a value is not compared: that of 100 histories.
const ROUGH: f64 = 0.1;
/// Errors that two estimates of the same may differ by, in two runs of different seeds.
const LIMIT: f64 = 4.0;
/// As in the results: what few batches have found.
const CONCENTRATED: f64 = 0.25;

/// Times the usual photons and paths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Length {
    pub photons: u64,
    pub paths: u64,
}

impl Length {
    pub fn times(self, factor: u64) -> Self {
        Self { photons: factor * self.photons, paths: factor * self.paths }
    }
}

/// Why a value is left out. All reasons but the last know nothing of the difference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LeftOut {
    /// Fewer than 100 photons found it, about.
    FewPhotons,
    /// The paths call it uncertain themselves (`few_paths`): few of them found most of it ...
    FewPaths,
    /// ... or they know of more light that they find by chance alone than their error does.
    ByChance,
    /// It is beyond the limit, and left out in the repeat: of no use to tell wrong from chance.
    InRepeat,
}

/// One value of a scene as both estimators find it.
pub struct Compared {
    /// The captor's name.
    pub captor: String,
    /// What of it.
    pub what: String,
    /// Errors between them.
    pub z: Result<f64, LeftOut>,
}

/// Whether a value so many errors off is beyond the limit.
pub fn beyond(z: f64) -> bool {
    z.abs() > LIMIT
}

/// All values that are not zero to both: of photons in a scene, and of paths in another, which is the same.
pub fn compare(scene: &Scene, of_paths: &Scene, seed: u64, length: Length) -> Vec<Compared> {
    let photons = phylux::found_and_unseen(scene, BATCHES, length.photons * PHOTONS, seed);
    let found = &photons.parts()[0];
    let faces: usize = scene.captors.iter().map(|captor| captor.kind.faces().len()).sum();
    let settings = Settings {
        estimator: Estimator::Paths,
        photons: Some(length.paths * PATHS * BATCHES * faces as u64),
        seed,
        threads: 1,
        ..Settings::default()
    };
    let control = Control { stop: &AtomicBool::new(false), progress: &|_| {} };
    let run = phylux::simulate(of_paths, &settings, &control).expect("a run of paths");
    let uncertain = |channel: usize| {
        let concentrated = |r: &Running| r.concentration(BATCHES) > CONCENTRATED;
        if run.totals.running(channel).iter().any(concentrated) {
            return Some(LeftOut::FewPaths);
        }
        run.too_small.get(channel).is_some_and(|&it| it).then_some(LeftOut::ByChance)
    };
    let mut all = Vec::new();
    for captor in &scene.captors {
        let faces: Vec<_> = (0..captor.kind.faces().len())
            .map(|face| uncertain(captor.first_channel + face))
            .collect();
        for (c, name) in ["front", "back", "absorbed"][..captor.kind.channels()].iter().enumerate()
        {
            let channel = captor.first_channel + c;
            // what is absorbed comes to all faces
            let uncertain = faces.get(c).copied().unwrap_or(faces.iter().copied().flatten().next());
            for (b, band) in scene.bands.iter().enumerate() {
                let [x, y] = [found, &run.totals].map(|totals| totals.running(channel)[b]);
                if let Some(z) = z(&x, &y) {
                    let z = z.and_then(|z| uncertain.map_or(Ok(z), Err));
                    let what = format!("{} {name} {}", captor.id, band.name);
                    all.push(Compared { captor: captor.id.clone(), what, z });
                }
            }
        }
    }
    all
}

/// Errors between two estimates that are not both zero, if photons are enough. Their square roots are
/// compared, as counts have errors that grow with them: those of the square roots do not, and are nearly
/// normal from 100 counts on (Bartlett 1936).
pub fn z(photons: &Running, paths: &Running) -> Option<Result<f64, LeftOut>> {
    let [x, y] = [photons, paths].map(|running| running.estimate(BATCHES));
    if x.mean == 0.0 && y.mean == 0.0 {
        return None;
    }
    let error = |e: &phylux::Estimate| e.standard_error.unwrap_or(0.0);
    if error(&x) > ROUGH * x.mean || x.mean == 0.0 {
        return Some(Err(LeftOut::FewPhotons));
    }
    let of_root = |e: &phylux::Estimate| match e.mean > 0.0 {
        true => 0.5 * error(e) / e.mean.sqrt(),
        false => 0.0,
    };
    // single precision and the offset of rays move values by some 1e-5
    let rounding = 1e-4 * x.mean.max(y.mean).sqrt();
    let apart = (y.mean.sqrt() - x.mean.sqrt()).abs() - rounding;
    let errors = apart.max(0.0) / of_root(&x).hypot(of_root(&y)).max(f64::MIN_POSITIVE);
    Some(Ok(errors.copysign(y.mean - x.mean)))
}
