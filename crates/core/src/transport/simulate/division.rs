//! How complete paths divide their work: from which faces paths start, and how many photons are
//! traced beside them.
//!
//! A path serves one face, and a photon serves all of them. So paths pay at small faces, and photons
//! at large ones. A trial finds, for each face, the relative variance p of a path, h of a photon that
//! counts where paths leave light to it, and u of a photon that always counts. With n photons beside
//! one path from each face from which paths start, the relative variance of a run of one such history
//! is p + h / n at these faces, and u / n at the others. Its work is k c + n c', where k is the number
//! of these faces, and c and c' the work of a path and of a photon. The product of the work and of the
//! geometric mean of the variances is made as small as it can be or, where every face must meet a
//! tolerance, the product of the work and of the largest variance.
//!
//! A photon of power w has the relative variance w / F at a face of flux F, and one of the light that
//! paths leave, a fraction s of F, has s w / F. So what paths have found there tells how photons find
//! it, even if none of the trial has come.

use std::{array::from_fn, sync::Arc};

use super::{
    Arrivals, Control, Run, TASK, channel, faces,
    histories::Histories,
    schedule::{Beside, Schedule},
    tried::{FEWEST, Judged, Size, Tried, Value, affordable, of_a_trial, of_photons, paths_of},
};
use crate::{
    error::Result,
    math::rng::Purpose,
    scene::{
        captor::{CaptorKind, Channel},
        material::Scatterer,
        world::Scene,
    },
    transport::{
        nearest,
        paths::{Face, Pilot},
        settings::Settings,
        tally::Totals,
    },
};

/// Photons take at least and at most this fraction of the work.
const LEAST_PHOTONS: f64 = 1.0 / 64.0;
const MOST_PHOTONS: f64 = 0.875;
/// Where they are stored for k-nearest estimates, or count alone at some faces, they take at least this
/// fraction: such a face has at most ten times the variance that the same photons would have with all of
/// the counted work.
const LEAST_NEEDED: f64 = 0.1;
/// Paths are taken to leave up to so many times as much light to photons at one face as at all of them.
const UNEVEN: f64 = 8.0;
/// At a face that fewer photons of the trial have come to, their variance is taken to be in
/// proportion to its area.
const KNOWN: u64 = 100;
/// So many photons that bring light which paths leave to them show how they find it.
const LEFT: u64 = 30;
/// Photons that take less than this fraction of the work need not be known better.
const LITTLE: f64 = 0.125;

/// How complete paths divide their work.
#[derive(Clone, Debug)]
pub struct Division {
    /// Number of photons beside one path from each face from which paths start: a power of two.
    pub photons: f64,
    /// For each channel of the captors whether no paths start from this face, so that all photons
    /// count there. Empty if paths start from all faces.
    pub by_photons: Arc<[bool]>,
}

/// What a trial of complete paths has found.
pub(super) struct TriedComplete {
    /// What pilot photons have found for the paths.
    pub pilot: Arc<Pilot>,
    pub division: Division,
    pub tried: Tried,
    /// What photons alone would find.
    pub photons: Tried,
    /// Fraction of the light on the captors that paths leave to photons, in [0, 1]: the largest over
    /// the bands.
    pub left: f64,
    /// Whether enough photons have shown how they find that light, or they take little of the work.
    pub is_left_known: bool,
    /// Work of these trials.
    pub spent: f64,
}

impl TriedComplete {
    /// Tries paths and photons beside them, and divides the work. Errors: those of a run.
    pub fn new(
        scene: &Scene,
        settings: &Settings,
        pilot: &Arc<Pilot>,
        size: Size,
        control: &Control,
    ) -> Result<Self> {
        let paths = paths_of(scene, settings, pilot, size, control)?;
        let photons = TriedPhotons::new(scene, settings, pilot, size, control)?;
        let spent = paths.spent + photons.spent;
        let goal = match Judged::of(scene, settings) {
            Judged::Hardest => Goal::Worst,
            Judged::All | Judged::Sum => Goal::Typical,
        };
        let variances = Variances::new(scene, (&paths, &photons), size, goal);
        let number = variances.faces.len();
        let work = Work { path: paths.work / number as f64, photon: photons.work };
        // what paths leave is known as a mean of all faces; that where most is left decides the worst
        let uneven = if goal == Goal::Worst { UNEVEN } else { 1.0 };
        let uneven = |of: Variance| Variance { beside: (uneven * of.beside).min(of.photon), ..of };
        let all: Vec<_> = variances.all().into_iter().map(|of| of.map(uneven)).collect();
        let stored = settings.keeps_map() && nearest::any_estimates(scene);
        let least = if stored { LEAST_NEEDED } else { LEAST_PHOTONS };
        let may_serve_alone = pilot.may_serve_alone();
        let Divided { photons: each, alone } = divide(&all, work, least, goal, may_serve_alone);
        let starts = alone.iter().filter(|&&alone| !alone).count();
        let mut by_photons = Vec::new();
        if starts < number {
            by_photons = vec![false; scene.channels()];
            let channels = variances.faces.iter().map(|face| channel(scene, face));
            channels.zip(&alone).for_each(|(channel, &alone)| by_photons[channel] = alone);
            // so is what a captor absorbs, if photons alone count at its faces
            for captor in scene.captors() {
                let all = captor.first_channel..captor.first_channel + captor.channels();
                let faces = captor.kind.faces().iter();
                if faces.map(|&face| captor.first_channel + face as usize).all(|c| by_photons[c]) {
                    by_photons[all].fill(true);
                }
            }
        }
        let bands = scene.bands().len();
        let of = |variance: &dyn Fn(usize, Variance) -> f64| {
            let value = |i: usize| {
                let face = i / bands * variances.step;
                variances.of(face, i % bands).map_or_else(Value::default, |found| Value {
                    flux: found.flux,
                    variance: variance(face, found),
                    is_rough: false,
                })
            };
            paths.found.with((0..paths.found.each().len()).map(value).collect())
        };
        let found = of(&|face, found| found.with(each, alone[face]));
        let left = variances.left();
        let all = starts as f64 * work.path + each * work.photon;
        let is_left_known = each * work.photon <= LITTLE * all || variances.is_left_known();
        let tried = Tried { found, work: all, unit: starts as u64, ..paths.clone() };
        let division = Division { photons: each, by_photons: by_photons.into() };
        // the variances of photons alone come from the same model, so that what is not known of them
        // does not decide
        let photons = of(&|_, found| found.photon);
        let photons = Tried { found: photons, work: work.photon, unit: 1, ..paths.clone() };
        Ok(Self { pilot: pilot.clone(), division, tried, photons, left, is_left_known, spent })
    }
}

/// What is known of a face.
#[derive(Clone, Copy, Debug)]
struct Variance {
    /// The flux, W or umol/s.
    flux: f64,
    /// Relative variance of a path, p.
    path: f64,
    /// Of a photon that counts where paths leave light to it, h.
    beside: f64,
    /// Of a photon that always counts, u.
    photon: f64,
}

impl Variance {
    /// Returns the relative variance of so many photons, `alone` or beside one path.
    fn with(self, photons: f64, alone: bool) -> f64 {
        if alone { self.photon / photons } else { self.path + self.beside / photons }
    }
}

/// Work of a path and of a photon.
#[derive(Clone, Copy)]
struct Work {
    path: f64,
    photon: f64,
}

/// The best way to divide the work.
struct Divided {
    /// Number of photons beside one path from each face from which paths start.
    photons: f64,
    /// For each face whether no paths start from it.
    alone: Vec<bool>,
}

/// What is made as small as it can be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Goal {
    /// The work times the geometric mean of the variances.
    Typical,
    /// The work times the largest variance.
    Worst,
}

/// Divides the work among paths and photons. At a face without a variance nothing has arrived.
/// Photons take at least the share `least` of the work, or more where they count alone. Unless they
/// `may_serve_alone`, paths start from all faces.
fn divide(
    variances: &[Option<Variance>],
    work: Work,
    least: f64,
    goal: Goal,
    may_serve_alone: bool,
) -> Divided {
    let lit: Vec<(usize, Variance)> =
        variances.iter().enumerate().filter_map(|(face, found)| Some((face, (*found)?))).collect();
    let dark = (variances.len() - lit.len()) as f64;
    let log = |variance: f64| variance.max(f64::MIN_POSITIVE).ln();
    // the number of photons that take this share of the work beside paths from so many faces
    let of_share =
        |share: f64, starts: f64| share / (1.0 - share) * starts * work.path / work.photon;
    let all = variances.len() as f64;
    let first = of_share(least, 1.0).log2().ceil() as i32;
    let last = of_share(MOST_PHOTONS, all).log2().floor().max(first.into()) as i32;
    let mut best = (f64::INFINITY, Divided { photons: 1.0, alone: vec![false; variances.len()] });
    for exponent in first..=last {
        let photons = f64::from(exponent).exp2();
        let [by_paths, alone] =
            [false, true].map(|alone| move |of: &Variance| log(of.with(photons, alone)));
        // the more paths gain at a face, the earlier it gets them; for the worst face those that paths
        // make better in the order of their variance, then the others by how little they lose
        let mut order: Vec<((bool, f64), usize, Variance)> = lit
            .iter()
            .map(|&(face, of)| {
                let (path, photon) = (by_paths(&of), alone(&of));
                let key = match goal {
                    Goal::Typical => (false, path - photon),
                    Goal::Worst if path < photon => (false, -photon),
                    Goal::Worst => (true, path),
                };
                (key, face, of)
            })
            .collect();
        order.sort_unstable_by(|(a, face, _), (b, other, _)| {
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(face.cmp(other))
        });
        // the worst of those from some place in that order on, all left to photons
        let mut left = vec![f64::NEG_INFINITY; order.len() + 1];
        for (i, (_, _, of)) in order.iter().enumerate().rev() {
            left[i] = left[i + 1].max(alone(of));
        }
        let mut logs: f64 = lit.iter().map(|(_, of)| alone(of)).sum();
        let mut worst = f64::NEG_INFINITY;
        let mut most = None;
        for (starts, &rest) in left.iter().enumerate() {
            if let Some((_, _, of)) = starts.checked_sub(1).map(|last| &order[last]) {
                logs += by_paths(of) - alone(of);
                worst = worst.max(by_paths(of));
            }
            let paths = starts as f64 + dark;
            let least = if rest > f64::NEG_INFINITY { least.max(LEAST_NEEDED) } else { least };
            let fits = of_share(least, paths)..=of_share(MOST_PHOTONS, paths);
            let is_allowed = may_serve_alone || starts == order.len();
            if paths == 0.0 || !is_allowed || !fits.contains(&photons) {
                continue;
            }
            let all = (paths * work.path + photons * work.photon).ln();
            let cost = match goal {
                Goal::Typical => logs + lit.len() as f64 * all,
                Goal::Worst => all + worst.max(rest),
            };
            if cost < best.0 {
                best.0 = cost;
                most = Some(starts);
            }
        }
        if let Some(starts) = most {
            let mut alone = vec![false; variances.len()];
            order[starts..].iter().for_each(|&(_, face, _)| alone[face] = true);
            best.1 = Divided { photons, alone };
        }
    }
    best.1
}

/// What photons have found in a trial.
struct TriedPhotons {
    /// Where they count while paths leave their light to them.
    beside: Totals,
    /// Where they always count.
    all: Totals,
    /// Work of a photon.
    work: f64,
    /// Work of the whole trial of photons.
    spent: f64,
    /// Fraction of the arrivals at all surfaces that are light which paths leave to photons; 0 if they
    /// can leave none.
    left: f64,
}

impl TriedPhotons {
    fn new(
        scene: &Scene,
        settings: &Settings,
        pilot: &Arc<Pilot>,
        size: Size,
        control: &Control,
    ) -> Result<Self> {
        let settings = of_a_trial(settings);
        let least = scene.sources() as u64;
        let most = (size.histories(), size.rays);
        let photons = affordable(scene, &settings, control, most)?.max(FEWEST * least);
        let beside = Some(Beside { ratio: 1.0, least });
        let schedule = Schedule { beside, ..Schedule::new(photons, least, TASK.max(least)) };
        let totals = |by_photons: Arc<[bool]>| {
            let run = Run::new(scene, &settings, Vec::new(), Arrivals::OnCaptors, control)?;
            let work = super::Work::Paths(Vec::new(), pilot.clone());
            let histories = Histories { work, beside, by_photons, ..run.histories };
            let run = Run { histories, purpose: Purpose::Trial, ..run };
            let totals = run.round(2, &schedule)?;
            let [all, left] = run.shared.arrivals.map(|count| count.into_inner() as f64);
            // one half of an arrival counts as come
            Ok((totals, (left + 0.5) / (all + 1.0)))
        };
        let channels = scene.channels();
        let (all, left) = totals(vec![true; channels].into())?;
        let spent = all.work() as f64;
        let work = spent / all.histories as f64;
        // without mirrors nothing is left, and there is nothing to count
        let may_leave = scene.materials().iter().any(|named| named.material.has_mirror());
        let (beside, left, spent) = match may_leave {
            true => (totals(vec![false; channels].into())?.0, left, 2.0 * spent),
            false => {
                let mut none = Totals::new(scene, 0);
                (none.batches, none.histories) = (all.batches, all.histories);
                (none, 0.0, spent)
            }
        };
        Ok(Self { beside, all, work, spent, left })
    }
}

/// What the trials say of all faces.
struct Variances<'t> {
    scene: &'t Scene,
    faces: Vec<Face<'t>>,
    paths: &'t Tried,
    photons: &'t TriedPhotons,
    /// Every so many faces one was tried by paths.
    step: usize,
    goal: Goal,
    /// The factor on the variances of paths that their differences from photons show, at least 1.
    excess: f64,
    /// Per band, what holds for all faces.
    of_all: Vec<OfAll>,
}

/// Paths that differ from photons are taken to vary more than they have shown where the squares of these
/// differences exceed what both should give by more than this many of their own standard deviations.
const DIFFERENT: f64 = 4.0;
/// The difference at a face says something where paths tell that at least so many photons come there,
/// or where so many have come that fewer could hardly have been meant. Faces where a few came by chance
/// would all differ from paths in the same way.
const COMPARED: f64 = 4.0;
const SURELY: u64 = 16;

/// What holds for all faces, in a band.
struct OfAll {
    /// Median of the relative variances of a path, for each [kind](Variances::kind) of face.
    path: [f64; 4],
    /// Variance of a photon that counts where paths leave light to it, for each unit of all light,
    /// W or umol/s.
    beside: f64,
    /// The same for a photon that always counts, at the faces that few photons have come to.
    photon: f64,
    /// Irradiance of the faces that few photons have come to, W/m2 or umol/m2/s.
    irradiance: f64,
}

impl<'t> Variances<'t> {
    fn new(
        scene: &'t Scene,
        (paths, photons): (&'t Tried, &'t TriedPhotons),
        size: Size,
        goal: Goal,
    ) -> Self {
        let faces = faces(scene);
        let step = size.step(faces.len());
        let (excess, of_all) = (1.0, Vec::new());
        let all = Self { scene, faces, paths, photons, step, goal, excess, of_all };
        let all = Self { excess: all.excess(), ..all };
        let of_all = (0..scene.bands().len()).map(|band| all.of_all(band)).collect();
        Self { of_all, ..all }
    }

    /// Returns how many times larger the variances of paths are than those that the paths have shown,
    /// as their differences from photons say. Where each of many small lamps is drawn seldom, most
    /// paths of a trial miss the nearest, and vary little as long as they do.
    fn excess(&self) -> f64 {
        let (mut squares, mut of_paths, mut of_both, mut fourth) = (0.0, 0.0, 0.0, 0.0);
        for face in (0..self.faces.len()).step_by(self.step) {
            let came = self.photons.all.histories_in(channel(self.scene, &self.faces[face]));
            if came.unwrap_or(0) < SURELY && self.meant(face) < COMPARED {
                continue;
            }
            // all bands of a face may vary as one
            let mut of_face = 0.0;
            for band in 0..self.scene.bands().len() {
                let [of_left, of_photons] = [&self.photons.beside, &self.photons.all]
                    .map(|totals| estimate(self.scene, totals, &self.faces[face], band));
                let Some(Value { flux, variance, .. }) = self.tried(face, band) else { continue };
                // relative to all light there is, so that no face counts for more than others
                let all = flux + of_left[0] + of_photons[0];
                if all == 0.0 {
                    continue;
                }
                let own = variance * flux * flux / self.paths.histories as f64;
                let expected = (own + of_left[1] + of_photons[1]) / (all * all);
                squares += ((flux + of_left[0] - of_photons[0]) / all).powi(2);
                of_paths += own / (all * all);
                of_face += expected;
            }
            of_both += of_face;
            fourth += 2.0 * of_face * of_face;
        }
        let more = squares - of_both;
        let is_sure = of_paths > 0.0 && more > DIFFERENT * fourth.sqrt();
        if is_sure { 1.0 + more / of_paths } else { 1.0 }
    }

    /// Returns how many photons of the trial come to a face from which paths were tried, on average, if
    /// the light there is what paths have found and what they leave to photons.
    fn meant(&self, face: usize) -> f64 {
        let photons = self.photons.all.histories as f64;
        let powers = of_photons(self.scene).into_iter().enumerate();
        let of_band = |(band, power): (usize, f64)| {
            let flux = self.flux(face, band).filter(|_| power > 0.0)?;
            Some(photons * flux / power)
        };
        powers.filter_map(of_band).fold(0.0, f64::max)
    }

    fn of_all(&self, band: usize) -> OfAll {
        let photons = self.photons.all.histories as f64;
        let own: Vec<usize> = (0..self.faces.len()).step_by(self.step).collect();
        let median = |is_of: &dyn Fn(usize) -> bool| {
            let tried = own.iter().filter(|&&face| is_of(face));
            let mut tried: Vec<f64> = tried.filter_map(|&face| self.path(face, band)).collect();
            tried.sort_unstable_by(f64::total_cmp);
            tried.get(tried.len() / 2).copied()
        };
        let of_any = median(&|_| true).unwrap_or(0.0);
        let path = from_fn(|kind| median(&|face| self.kind(face) == kind).unwrap_or(of_any));
        let (mut left, mut light) = (0.0, 0.0);
        let (mut variance, mut came, mut of_unknown) = (0.0, 0.0, [0.0; 2]);
        for (f, face) in self.faces.iter().enumerate() {
            let [of_left, of_all] = [&self.photons.beside, &self.photons.all]
                .map(|totals| estimate(self.scene, totals, face, band));
            left += of_left[1] * photons;
            light += of_all[0];
            if !self.is_known(face) {
                variance += of_all[1] * photons;
                came += of_all[0];
                if f.is_multiple_of(self.step) {
                    of_unknown[0] += self.flux(f, band).unwrap_or(of_all[0]);
                    of_unknown[1] += self.scene.captors()[face.captor].area;
                }
            }
        }
        let ratio = |over: f64, under: f64| if under > 0.0 { over / under } else { 0.0 };
        let photon = if came > 0.0 { variance / came } else { of_photons(self.scene)[band] };
        // that no photon has come of the light that is left does not say that there is none
        let (one, share) = (photon / photons, self.photons.left);
        let beside = match self.goal {
            // one more photon counts as come, of which paths leave as much as of the light on all
            // surfaces
            Goal::Typical => ratio(left + share * photon * one, light + one),
            // where one captor decides, one more of the light that is left, and as much other light as
            // comes with it to all surfaces
            Goal::Worst if share > 0.0 => ratio(left + photon * one, light + one / share),
            Goal::Worst => 0.0,
        };
        OfAll {
            path,
            beside: beside.min(photon),
            photon,
            irradiance: ratio(of_unknown[0], of_unknown[1]),
        }
    }

    /// Returns the kind of a face, in 0..4: the front or back of a sensor, or of a surface. Faces of one
    /// kind are alike: backs of leaves are darker than fronts.
    fn kind(&self, face: usize) -> usize {
        let Face { captor, channel, .. } = &self.faces[face];
        let is_surface = self.scene.captors()[*captor].kind == CaptorKind::Surface;
        2 * usize::from(is_surface) + usize::from(*channel == Channel::Back)
    }

    /// Returns the fraction of the light on all faces that paths leave to photons, in [0, 1]: the
    /// largest over the bands.
    fn left(&self) -> f64 {
        let share = |band: usize| {
            let [left, all] = [&self.photons.beside, &self.photons.all].map(|totals| {
                let flux = |face: &Face| estimate(self.scene, totals, face, band)[0];
                self.faces.iter().map(flux).sum::<f64>()
            });
            if all > 0.0 { (left / all).min(1.0) } else { 0.0 }
        };
        (0..self.scene.bands().len()).map(share).fold(0.0, f64::max)
    }

    /// Returns whether no light is left to photons, or enough photons of it have come to all faces
    /// together.
    fn is_left_known(&self) -> bool {
        let came = |face| self.photons.beside.photons(channel(self.scene, face));
        self.photons.left == 0.0 || self.faces.iter().map(came).sum::<u64>() >= LEFT
    }

    /// Returns whether enough photons have come to a face to tell how much they differ.
    fn is_known(&self, face: &Face) -> bool {
        let counted = self.photons.all.histories_in(channel(self.scene, face));
        counted.is_some_and(|photons| photons >= KNOWN)
    }

    /// Returns whether neither the paths that were tried from a face nor any photon have found light
    /// there.
    fn is_dark(&self, face: usize, band: usize) -> bool {
        let photons = || estimate(self.scene, &self.photons.all, &self.faces[face], band)[0];
        self.tried(face, band).is_some_and(|tried| tried.flux == 0.0) && photons() == 0.0
    }

    /// Returns the flux at a face from which paths were tried: what these have found, and what they
    /// leave to photons. `None` where paths were not tried, or have found nothing.
    fn flux(&self, face: usize, band: usize) -> Option<f64> {
        let left = estimate(self.scene, &self.photons.beside, &self.faces[face], band)[0];
        self.tried(face, band).filter(|tried| tried.flux > 0.0).map(|tried| tried.flux + left)
    }

    /// Returns what paths have found at a face from which they were tried.
    fn tried(&self, face: usize, band: usize) -> Option<Value> {
        let at = face / self.step * self.scene.bands().len() + band;
        face.is_multiple_of(self.step).then(|| self.paths.found.each()[at])
    }

    /// Returns the relative variance of a path from a face from which paths were tried. Where these
    /// have stayed dark, and photons found light that they do not leave to photons, it is at least
    /// about the number of paths. `None` where neither has found any.
    fn path(&self, face: usize, band: usize) -> Option<f64> {
        let [left, all] = [&self.photons.beside, &self.photons.all]
            .map(|totals| estimate(self.scene, totals, &self.faces[face], band)[0]);
        let Value { flux: own, variance, .. } = self.tried(face, band)?;
        match own > 0.0 {
            true => Some(self.excess * variance * (own / (own + left)).powi(2)),
            false => {
                let missed = ((all - left) / all).max(0.0);
                (all > 0.0).then(|| self.paths.histories as f64 * missed.powi(2))
            }
        }
    }

    /// Returns what is known of a face in a band; `None` where there is no light.
    fn of(&self, face: usize, band: usize) -> Option<Variance> {
        let all = &self.of_all[band];
        let place = &self.faces[face];
        if self.is_dark(face, band) {
            return None;
        }
        let path = self.path(face, band).unwrap_or(all.path[self.kind(face)]);
        let (flux, photon) = if self.is_known(place) {
            let [flux, variance] = estimate(self.scene, &self.photons.all, place, band);
            (flux, variance * self.photons.all.histories as f64 / (flux * flux))
        } else {
            let area = self.scene.captors()[place.captor].area;
            let flux = self.flux(face, band).unwrap_or(all.irradiance * area);
            (flux, all.photon / flux)
        };
        (flux > 0.0).then_some(Variance { flux, path, beside: all.beside / flux, photon })
    }

    /// Returns the relative variances at each face, averaged over the bands that have light.
    fn all(&self) -> Vec<Option<Variance>> {
        let mean = |face: usize| {
            let bands = (0..self.scene.bands().len()).filter_map(|band| self.of(face, band));
            let bands: Vec<Variance> = bands.collect();
            let of = |part: fn(&Variance) -> f64| {
                bands.iter().map(part).sum::<f64>() / bands.len() as f64
            };
            let (path, beside, photon) = (of(|v| v.path), of(|v| v.beside), of(|v| v.photon));
            (!bands.is_empty()).then_some(Variance { flux: of(|v| v.flux), path, beside, photon })
        };
        (0..self.faces.len()).map(mean).collect()
    }
}

/// Returns the mean that a trial has found at a face in a band, and the variance of this mean.
fn estimate(scene: &Scene, totals: &Totals, face: &Face, band: usize) -> [f64; 2] {
    let found = totals.estimates(channel(scene, face)).nth(band).expect("it has all bands");
    [found.mean, found.standard_error.unwrap_or(found.mean).powi(2)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rng::{Purpose, Streams};

    /// Of every division of seven faces, by every number of photons that is allowed, the best is
    /// found. A face without light gets paths. Chance plays no part, as the stream is fixed.
    #[test]
    fn the_best_division_is_found() {
        for case in 0..50 {
            let mut rng = Streams::new(1, Purpose::Run, 0).history(case);
            let mut number = |least: f64, factor: f64| least * factor.powf(rng.uniform().into());
            let work = Work { path: number(1.0, 30.0), photon: number(1.0, 30.0) };
            let mut faces: Vec<Option<Variance>> = (0..7)
                .map(|_| {
                    let path = number(0.1, 1e3);
                    let (beside, photon) = (number(0.01, 1e3), number(1.0, 1e5));
                    Some(Variance { flux: 1.0, path, beside, photon })
                })
                .collect();
            faces.push(None);
            let cost = |photons: f64, alone: &[bool], goal: Goal| {
                let starts = alone.iter().filter(|&&alone| !alone).count() as f64;
                let rays = starts * work.path + photons * work.photon;
                let share = photons * work.photon / rays;
                let lit =
                    faces.iter().zip(alone).filter_map(|(face, &alone)| Some(((*face)?, alone)));
                let logs = lit.map(|(face, alone)| face.with(photons, alone).ln());
                let variances = match goal {
                    Goal::Typical => logs.sum::<f64>() / 7.0,
                    Goal::Worst => logs.fold(f64::NEG_INFINITY, f64::max),
                };
                let any = alone[..7].contains(&true);
                let least = if any { LEAST_NEEDED } else { LEAST_PHOTONS };
                let fits = (least..=MOST_PHOTONS).contains(&share);
                if fits { variances + rays.ln() } else { f64::INFINITY }
            };
            for goal in [Goal::Typical, Goal::Worst] {
                let mut least = f64::INFINITY;
                for exponent in -20..=20 {
                    for subset in 0..128u32 {
                        let mut alone: Vec<bool> =
                            (0..7).map(|face| subset >> face & 1 == 1).collect();
                        alone.push(false);
                        least = least.min(cost(f64::from(exponent).exp2(), &alone, goal));
                    }
                }
                let Divided { photons, alone } = divide(&faces, work, LEAST_PHOTONS, goal, true);
                let found = cost(photons, &alone, goal);
                let off = (found - least).abs();
                assert!(!alone[7] && off < 1e-9, "{case}, {goal:?}: {found} {least}");
            }
        }
    }
}
