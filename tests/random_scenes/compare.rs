//! Compares one room by photons, by paths and by complete paths.

use phylux::{
    Control, Estimator, Scene, Settings,
    math::Running,
    transport::{PhotonCount, ThreadCount, Totals},
};

/// Number of batches from which both errors come.
pub const BATCHES: u64 = 128;
/// Histories of a batch: photons in all, and paths from each face.
const PHOTONS: u64 = 800;
const PATHS: u64 = 48;
/// A value is not compared if the relative error of photons is larger than this, which is the error
/// of 100 histories.
const ROUGH: f64 = 0.1;
/// Two estimates of the same value may differ by this many errors. A value that exceeds it in two
/// runs of different seeds is wrong.
const LIMIT: f64 = 4.0;
/// As in the results: a larger concentration means that few batches found most of the light.
const CONCENTRATED: f64 = 0.25;

/// The length of a run, in multiples of the usual numbers of photons and paths.
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

/// Why a value is left out. No reason but the last depends on the difference between photons and
/// paths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LeftOut {
    /// Fewer than about 100 photons found it.
    FewPhotons,
    /// The paths call it uncertain (`few_paths`), because few of them found most of the light.
    FewPaths,
    /// The paths call it uncertain, because it has more light that they find by chance only than
    /// their error accounts for.
    ByChance,
    /// It is beyond the limit and was left out in the repeat, so it cannot be told whether it is
    /// wrong or chance.
    InRepeat,
}

/// One value of a scene, with the difference between both estimators.
pub struct Compared {
    /// The captor's name.
    pub captor: String,
    /// The captor, the face or `absorbed`, and the band.
    pub what: String,
    /// The difference in standard errors, or why the value is left out.
    pub z: Result<f64, LeftOut>,
}

/// Returns whether a difference of this many errors is beyond the limit.
pub fn beyond(z: f64) -> bool {
    z.abs() > LIMIT
}

/// Compares all values that are not zero in both estimates. Photons are traced in `scene` and paths
/// in `of_paths`; the two are the same unless a test wants to see a fault found. With `complete`,
/// all light of photons is also compared with complete paths.
pub fn compare(
    scene: &Scene,
    of_paths: &Scene,
    seed: u64,
    length: Length,
    complete: bool,
) -> Vec<Compared> {
    let photons =
        phylux::transport::found_and_unseen(scene, BATCHES, length.photons * PHOTONS, seed);
    let mut all = against(scene, &photons.parts()[0], of_paths, (Estimator::Paths, seed), length);
    if complete {
        let complete = (Estimator::Complete, seed);
        all.extend(against(scene, &photons, of_paths, complete, length));
    }
    all
}

/// Compares what photons have found with an estimator.
fn against(
    scene: &Scene,
    found: &Totals,
    of_paths: &Scene,
    (estimator, seed): (Estimator, u64),
    length: Length,
) -> Vec<Compared> {
    let faces: usize = scene.captors().iter().map(|captor| captor.kind.faces().len()).sum();
    let settings = Settings {
        estimator,
        photons: PhotonCount::new(length.paths * PATHS * BATCHES * faces as u64).ok(),
        seed,
        threads: ThreadCount::ONE,
        ..Settings::default()
    };
    let control = Control::default();
    let run = phylux::simulate(of_paths, &settings, &control).expect("a run of paths");
    let uncertain = |channel: usize| {
        let concentrated = |r: &Running| r.concentration(BATCHES) > CONCENTRATED;
        if run.totals().running(channel).iter().any(concentrated) {
            return Some(LeftOut::FewPaths);
        }
        run.too_small().get(channel).is_some_and(|&it| it).then_some(LeftOut::ByChance)
    };
    let mut all = Vec::new();
    for captor in scene.captors() {
        let faces: Vec<_> = (0..captor.kind.faces().len())
            .map(|face| uncertain(captor.first_channel + face))
            .collect();
        for (c, name) in ["front", "back", "absorbed"][..captor.kind.channels()].iter().enumerate()
        {
            let channel = captor.first_channel + c;
            // the power absorbed comes from all faces
            let uncertain = faces.get(c).copied().unwrap_or(faces.iter().copied().flatten().next());
            for (b, band) in scene.bands().iter().enumerate() {
                let [x, y] = [found, run.totals()].map(|totals| totals.running(channel)[b]);
                if let Some(z) = z(&x, &y) {
                    let z = z.and_then(|z| uncertain.map_or(Ok(z), Err));
                    let what = format!("{} {name} {}, {estimator}", captor.id, band.name);
                    all.push(Compared { captor: captor.id.clone(), what, z });
                }
            }
        }
    }
    all
}

/// Returns the difference between two estimates in standard errors; `None` if both are zero. The
/// square roots are compared, because the errors of counts grow with the counts, while those of
/// their square roots do not, and are nearly normal from 100 counts on (Bartlett 1936).
///
/// Error: photons are too few.
pub fn z(photons: &Running, paths: &Running) -> Option<Result<f64, LeftOut>> {
    let [x, y] = [photons, paths].map(|running| running.estimate(BATCHES));
    if x.mean == 0.0 && y.mean == 0.0 {
        return None;
    }
    let error = |e: &phylux::math::Estimate| e.standard_error.unwrap_or(0.0);
    if error(&x) > ROUGH * x.mean || x.mean == 0.0 {
        return Some(Err(LeftOut::FewPhotons));
    }
    let of_root = |e: &phylux::math::Estimate| match e.mean > 0.0 {
        true => 0.5 * error(e) / e.mean.sqrt(),
        false => 0.0,
    };
    // single precision and the offset of rays move values by about 1e-5
    let rounding = 1e-4 * x.mean.max(y.mean).sqrt();
    let apart = (y.mean.sqrt() - x.mean.sqrt()).abs() - rounding;
    let errors = apart.max(0.0) / of_root(&x).hypot(of_root(&y)).max(f64::MIN_POSITIVE);
    Some(Ok(errors.copysign(y.mean - x.mean)))
}
