//! Plans a run: decides by short trials whether its photons are guided, and whether paths do
//! better.
//!
//! Cost is work, counted and never timed, times the relative variance, averaged over the faces of all
//! captors. The decisions depend on the scene and the seed alone, so that two runs
//! with the same number of photons find the same bytes.

use std::{sync::Arc, time::Instant};

use super::{
    Arrivals, Choice, Control, Run,
    division::{Division, TriedComplete},
    pilot::ImportancePilot,
    trial::{Chosen, OfPaths, asked},
    tried::{FEWEST, Found, RAYS, Size, affordable, of_a_trial, of_photons},
    within::within,
};
use crate::{
    error::{Error, Result},
    math::rng::Purpose,
    scene::{
        captor::{Captor, CaptorKind},
        world::Scene,
    },
    transport::{
        guiding::Guidance,
        paths,
        settings::{Estimator, Guiding, MAX_PHOTONS, PhotonCount, Settings},
        tally::Totals,
    },
};

/// Number of photons with which each kind of guiding is tried first. It is multiplied by four as
/// long as aimed photons reach too few faces and few rays have been traced.
const FIRST: u64 = 1 << 12;
/// The most photons of such a trial, unless unguided photons leave most faces dark.
const MOST: u64 = 1 << 14;
/// The most photons of such a trial where unguided photons leave most faces dark.
const MOST_IN_THE_DARK: u64 = 1 << 16;
/// Number of histories that must have reached a face for its variance to be meaningful.
const SEEN: u64 = 30;
/// A kind of guiding is chosen only if its cost is below this fraction of the other's, because a
/// trial is rough.
const GAIN: f64 = 0.8;
/// Importance is learned, and tried, with about so many rays.
const LEARNING: f64 = (1u64 << 21) as f64;
/// What takes more [work](crate::math::effort) than this, about a second, is done before no run that
/// takes less.
const LONG: f64 = 1e9;
/// Where the time is limited, the choice of guiding, and then that of the estimator, have used up at
/// most this fraction of it.
const FOR_GUIDING: f64 = 0.25;
const FOR_PLANNING: f64 = 0.5;

/// How a run is done, once nothing is left to a trial.
#[derive(Clone)]
pub struct Plan<'a> {
    /// The settings; neither `estimator` nor `guiding` is `Auto`.
    pub settings: Settings,
    /// The reason for the estimator, if a trial has chosen it.
    pub choice: Option<Choice>,
    /// What guides the photons; `None` if they are not guided.
    pub(super) guidance: Option<Guidance<'a>>,
    /// What pilot photons have found for paths, if a trial of paths has needed it.
    pub(super) of_paths: Option<Arc<paths::Pilot>>,
    /// For complete paths: how they divide their work.
    pub(super) division: Option<Division>,
    /// When planning began, from where a limit on time counts.
    pub(super) started: Instant,
}

impl<'a> Plan<'a> {
    /// Plans a run of `scene` with these settings. Where its time is limited, planning takes at most
    /// half of it, and what is not known by then is done without: flights are aimed at captors, where
    /// there are any to aim at, and photons are not compared with paths. Errors: those of a run.
    pub fn make(scene: &'a Scene, settings: &Settings, control: &Control) -> Result<Self> {
        Self::again(scene, settings, None, control)
    }

    /// Plans the run of `settings` that come from an earlier plan, which has chosen the estimator.
    pub(super) fn again(
        scene: &'a Scene,
        settings: &Settings,
        chosen: Option<Choice>,
        control: &Control,
    ) -> Result<Self> {
        let started = Instant::now();
        let control = &Control { progress: &|_| {}, ..*control };
        let mut settings = settings.clone();
        let of_paths = matches!(settings.estimator, Estimator::Paths | Estimator::Complete);
        if of_paths || scene.captors().is_empty() {
            settings.guiding = Guiding::Off;
        }
        if scene.lattice().is_some() {
            settings.guiding = unguided(settings.guiding)?;
        }
        let until =
            |share: f64| settings.max_time.map(|limit| started + limit.get().mul_f64(share));
        let for_guiding = until(FOR_GUIDING);
        let guidance = match settings.guiding {
            Guiding::Off => None,
            Guiding::Aim => Guidance::aim(scene),
            Guiding::Full => {
                let learn =
                    |control: &Control| ImportancePilot::new(scene, &settings, control)?.learn();
                within(for_guiding, control, learn)?.unwrap_or_else(|| Guidance::aim(scene))
            }
            Guiding::Auto => decide(scene, &settings, for_guiding, control)?,
        };
        if settings.guiding == Guiding::Auto {
            settings.guiding = guidance.as_ref().map_or(Guiding::Off, Guidance::guiding);
        }
        let (choice, of_paths) = match settings.estimator {
            Estimator::Auto => {
                let choose =
                    |control: &Control| Chosen::make(scene, &settings, guidance.clone(), control);
                let late = || "the time is too short to compare photons with paths".into();
                let Chosen { choice, of_paths, per_photon } =
                    within(until(FOR_PLANNING), control, choose)?
                        .unwrap_or_else(|| Chosen::photons(&settings, late()));
                settings.estimator = choice.estimator;
                let as_much = |photons: u64| {
                    let number = (photons as f64 * per_photon).round() as u64;
                    PhotonCount::new(number.clamp(1, MAX_PHOTONS))
                };
                settings.photons = Some(as_much(settings.photons_or_default())?);
                let limit = settings.tolerance_limit.map(|limit| as_much(limit.get()));
                settings.tolerance_limit = limit.transpose()?;
                (Some(choice), of_paths)
            }
            Estimator::Complete if !scene.captors().is_empty() => {
                let tried = chosen.as_ref().map(|choice| Size::of(choice.trial));
                let size = tried.unwrap_or(Size::USUAL);
                let pilot = Arc::new(paths::Pilot::beside_photons(scene, settings.seed));
                let TriedComplete { pilot, division, .. } =
                    TriedComplete::new(scene, &settings, &pilot, size, control)?;
                (chosen, Some(OfPaths { pilot, division }))
            }
            _ => (chosen, None),
        };
        let (of_paths, division) =
            of_paths.map(|OfPaths { pilot, division }| (pilot, division)).unzip();
        let guidance = guidance.filter(|_| settings.estimator == Estimator::Photons);
        Ok(Self { settings, choice, guidance, of_paths, division, started })
    }
}

/// Returns that photons are not guided, in a scene that repeats: captors and lamps have images
/// without end there. Error: guiding is asked for.
fn unguided(asked: Guiding) -> Result<Guiding> {
    match asked {
        Guiding::Off | Guiding::Auto => Ok(Guiding::Off),
        Guiding::Aim | Guiding::Full => {
            let problem = "photons of a scene that repeats (`periodic`) are not guided";
            Err(Error::input("guiding", problem)
                .remedy("leave guiding out, or take paths as the estimator"))
        }
    }
}

/// Chooses the cheapest kind of guiding: none, flights aimed at virtual captors or, where a trial
/// of these two has reached too few faces, importance too, unless learning it takes longer than the
/// run. `None` means no guiding. If the first trial does not end by the time `until`, flights are
/// aimed: they find what nothing else may find.
fn decide<'a>(
    scene: &'a Scene,
    settings: &Settings,
    until: Option<Instant>,
    control: &Control,
) -> Result<Option<Guidance<'a>>> {
    let aim = Guidance::aim(scene);
    if aim.is_none() && channels(scene).count() as u64 > MOST_IN_THE_DARK {
        // no trial has a photon for each face, and where captors are everywhere guiding gains little
        return Ok(None);
    }
    let first = |control: &Control| try_aiming(scene, settings, aim.as_ref(), control);
    let Some(Aiming { plain, aimed, photons }) = within(until, control, first)? else {
        return Ok(aim);
    };
    let pays = gains(&aimed, &plain);
    let guidance = aim.filter(|_| pays);
    let best = if pays { &aimed } else { &plain };
    let learning = LEARNING * best.work / best.rays as f64;
    let of_run =
        asked(settings).map_or(f64::INFINITY, |asked| best.work / photons as f64 * asked as f64);
    if aimed.seen || learning > LONG.max(of_run) {
        return Ok(guidance);
    }
    let is_dark = plain.is_dark();
    let learn =
        |control: &Control| try_importance(scene, settings, (photons, best, is_dark), control);
    Ok(within(until, control, learn)?.flatten().or(guidance))
}

/// Returns whether one way to guide costs clearly less than another. One that has found no light does
/// not: it may be cheap because its photons end early.
fn gains(one: &TriedGuiding, other: &TriedGuiding) -> bool {
    one.finds_light() && one.cost(other) < GAIN * other.cost(one)
}

/// Trials of photons without a guide and with aimed flights.
struct Aiming {
    plain: TriedGuiding,
    aimed: TriedGuiding,
    /// Number of photons of each of them.
    photons: u64,
}

/// Tries photons without a guide and, if there are captors to aim at, with aimed flights: with ever
/// more photons, until enough faces are reached or enough rays traced, or a long trial has as many
/// photons as the run.
fn try_aiming<'a>(
    scene: &'a Scene,
    settings: &Settings,
    aim: Option<&Guidance<'a>>,
    control: &Control,
) -> Result<Aiming> {
    // with fewer photons of each lamp the batches of a trial would differ by their lamps, which those of
    // a run share out evenly
    let first = FIRST.max(FEWEST * scene.sources() as u64);
    let (mut photons, mut rays) = (affordable(scene, settings, control, (first, RAYS))?, 0);
    let (of_run, mut work) = (asked(settings).unwrap_or(u64::MAX), 0.0);
    loop {
        let plain = try_guiding(scene, settings, None, photons, control)?;
        let aimed = match aim {
            Some(aim) => try_guiding(scene, settings, Some(aim.clone()), photons, control)?,
            None => plain.clone(),
        };
        rays += plain.rays + aimed.rays;
        work += plain.work + aimed.work;
        let is_long = work > LONG && 4 * photons > of_run;
        let most = if plain.is_dark() { MOST_IN_THE_DARK } else { MOST };
        if aimed.seen || 4 * photons > most || rays > RAYS || is_long {
            return Ok(Aiming { plain, aimed, photons });
        }
        photons *= 4;
    }
}

/// Learns importance, and tries it with so many photons. Returns it if it costs less than the `best`
/// way so far.
fn try_importance<'a>(
    scene: &'a Scene,
    settings: &Settings,
    (photons, best, is_dark): (u64, &TriedGuiding, bool),
    control: &Control,
) -> Result<Option<Guidance<'a>>> {
    let full_gains = |full: &Guidance<'a>| -> Result<bool> {
        let full = try_guiding(scene, settings, Some(full.clone()), photons, control)?;
        Ok(gains(&full, best))
    };
    let mut pilot = ImportancePilot::new(scene, settings, control)?;
    // one round shows whether the rest of the pilot may pay, except where light hardly gets
    pilot.round()?;
    let rough = pilot.guidance();
    let tells = !rough.starved && !is_dark;
    if tells && !(rough.guiding() == Guiding::Full && full_gains(&rough)?) {
        return Ok(None);
    }
    match pilot.learn()? {
        Some(full) if full.guiding() == Guiding::Full && full_gains(&full)? => Ok(Some(full)),
        _ => Ok(None),
    }
}

/// The result of a trial of photons.
#[derive(Clone)]
struct TriedGuiding {
    /// What was found at virtual captors, and at surfaces, where there are such captors.
    found: Vec<Found>,
    /// Number of rays, and the work.
    rays: u64,
    work: f64,
    /// Whether enough histories have reached enough faces.
    seen: bool,
}

impl TriedGuiding {
    /// Returns whether no light arrived at most of the faces: those of virtual captors, if there are
    /// any.
    fn is_dark(&self) -> bool {
        self.found.first().is_some_and(Found::is_dark)
    }

    /// Returns whether light arrived at any of the faces.
    fn finds_light(&self) -> bool {
        self.found.iter().any(Found::finds_light)
    }

    /// Returns the work for a relative error of 1. Virtual captors count as much as all surfaces,
    /// however many there are of these: flights that are aimed bring nothing to plants, and may be
    /// all that comes to the sensors among them.
    fn cost(&self, other: &Self) -> f64 {
        let kinds = self.found.iter().zip(&other.found);
        let logs: f64 = kinds.map(|(own, other)| own.typical(other).ln()).sum();
        self.work * (logs / self.found.len() as f64).exp()
    }
}

/// Runs a trial of so many photons, with this guidance.
fn try_guiding<'a>(
    scene: &'a Scene,
    settings: &Settings,
    guidance: Option<Guidance<'a>>,
    photons: u64,
    control: &Control,
) -> Result<TriedGuiding> {
    let settings = of_a_trial(settings);
    let run = Run::new(scene, &settings, Vec::new(), Arrivals::OnCaptors, control)?;
    let run = Run { purpose: Purpose::Guiding, ..run.guided_by(guidance) };
    let totals = run.round(0, &run.histories.schedule(run.scene, photons)?)?;
    let kinds = [false, true].map(|surfaces| channels_of(scene, surfaces).collect::<Vec<usize>>());
    let of = |channels: Vec<usize>| {
        Found::new(scene, &totals, totals.histories, channels.into_iter(), of_photons(scene))
    };
    let found = kinds.into_iter().filter(|channels| !channels.is_empty()).map(of).collect();
    let (rays, work) = (totals.segments, totals.work() as f64);
    Ok(TriedGuiding { found, rays, work, seen: sees_enough(scene, &totals) })
}

/// Returns whether at least [`SEEN`] histories have reached at least half of the faces. If there
/// are virtual captors, only their faces count.
fn sees_enough(scene: &Scene, totals: &Totals) -> bool {
    let any_virtual = scene.has_virtual_captors();
    let counts = |captor: &&Captor| !any_virtual || captor.kind != CaptorKind::Surface;
    let (mut all, mut lit) = (0, 0);
    for captor in scene.captors().iter().filter(counts) {
        for &face in captor.kind.faces() {
            let channel = captor.first_channel + face as usize;
            let histories = totals.histories_in(channel).unwrap_or(totals.photons(channel));
            all += 1;
            lit += usize::from(histories >= SEEN);
        }
    }
    2 * lit >= all
}

/// Returns the channels of all faces.
fn channels(scene: &Scene) -> impl Iterator<Item = usize> {
    [false, true].into_iter().flat_map(|surfaces| channels_of(scene, surfaces))
}

/// Returns the channels of the faces of all captors that are `surfaces`, or that are virtual.
fn channels_of(scene: &Scene, surfaces: bool) -> impl Iterator<Item = usize> {
    let counts = move |captor: &&Captor| (captor.kind == CaptorKind::Surface) == surfaces;
    let of = |captor: &Captor| {
        let first = captor.first_channel;
        captor.kind.faces().iter().map(move |&face| first + face as usize)
    };
    scene.captors().iter().filter(counts).flat_map(of)
}
