//! What a run leaves to short trials: what is to guide its photons, and whether paths do better.
//!
//! Cost is work, never time: rays x relative variance, meaned over the faces of all captors. What is decided depends on
//! the scene and the seed alone, so that a run of as many photons as another one had finds the same bytes.

use super::{
    Choice, Control, Keep, Run,
    pilot::Pilot,
    tried::{Found, RAYS, affordable, of_a_trial},
};
use crate::{
    error::Result,
    math::rng::Purpose,
    scene::{
        captor::{Captor, CaptorKind},
        world::Scene,
    },
    transport::{
        guiding::Guidance,
        settings::{Estimator, Guiding, Settings},
        tally::Totals,
    },
};

/// Photons that each way is tried with first; four times as many as long as they see too little and trace few rays, up
/// to ...
const FIRST: u64 = 1 << 12;
/// ... this number, or where plain photons leave most faces dark ...
const MOST: u64 = 1 << 14;
/// ... this one.
const MOST_IN_THE_DARK: u64 = 1 << 16;
/// Histories that must have come to a face for its variance to say something.
const SEEN: u64 = 30;
/// A way must be so much cheaper to be chosen: a trial is rough.
const GAIN: f64 = 0.8;

/// How a run is done, with nothing left to a trial.
#[derive(Clone)]
pub struct Plan<'a> {
    /// Neither the estimator nor `guiding` is `Auto`.
    pub settings: Settings,
    /// Why, where the estimator was chosen.
    pub choice: Option<Choice>,
    /// What guides photons.
    pub(super) guidance: Option<Guidance<'a>>,
}

impl<'a> Plan<'a> {
    /// Of a run of `scene` with these settings. Errors: those of a run.
    pub fn make(scene: &'a Scene, settings: &Settings, control: &Control) -> Result<Self> {
        let control = &Control { progress: &|_| {}, ..*control };
        let mut settings = settings.clone();
        if settings.estimator == Estimator::Paths || scene.captors.is_empty() {
            settings.guiding = Guiding::Off;
        }
        let guidance = match settings.guiding {
            Guiding::Off => None,
            Guiding::Aim => Guidance::aim(scene),
            Guiding::Full => Pilot::new(scene, &settings, control)?.learn()?,
            Guiding::Auto => decide(scene, &settings, control)?,
        };
        if settings.guiding == Guiding::Auto {
            settings.guiding = guidance.as_ref().map_or(Guiding::Off, Guidance::guiding);
        }
        let choice = match settings.estimator {
            Estimator::Auto => Some(Choice::make(scene, &settings, guidance.clone(), control)?),
            _ => None,
        };
        settings.estimator = choice.as_ref().map_or(settings.estimator, |choice| choice.estimator);
        Ok(Self { settings, choice, guidance })
    }
}

/// What is cheapest: nothing, flights aimed at virtual captors or, where a trial of both has seen little, these with
/// importance.
fn decide<'a>(
    scene: &'a Scene,
    settings: &Settings,
    control: &Control,
) -> Result<Option<Guidance<'a>>> {
    let aim = Guidance::aim(scene);
    let first = FIRST.max(scene.sources() as u64);
    let (mut photons, mut rays) = (affordable(scene, settings, control, first)?, 0);
    let (plain, aimed) = loop {
        let plain = tried(scene, settings, None, photons, control)?;
        let aimed = match &aim {
            Some(_) => tried(scene, settings, aim.clone(), photons, control)?,
            None => plain.clone(),
        };
        rays += plain.found.rays + aimed.found.rays;
        let most = if plain.found.is_dark() { MOST_IN_THE_DARK } else { MOST };
        if aimed.seen || 4 * photons > most || rays > RAYS {
            break (plain, aimed);
        }
        photons *= 4;
    };
    let gains = |one: &Found, other: &Found| {
        let work = |one: &Found, other| one.rays as f64 * one.mean(other);
        work(one, other) < GAIN * work(other, one)
    };
    let pays = gains(&aimed.found, &plain.found);
    let best = if pays { &aimed.found } else { &plain.found };
    let guidance = aim.filter(|_| pays);
    if aimed.seen {
        return Ok(guidance);
    }
    let full_gains = |full: &Guidance<'a>| -> Result<bool> {
        let full = tried(scene, settings, Some(full.clone()), photons, control)?;
        Ok(gains(&full.found, best))
    };
    let mut pilot = Pilot::new(scene, settings, control)?;
    // a rough one tells whether the rest of it may pay, but where light hardly goes
    pilot.round()?;
    let rough = pilot.guidance();
    let tells = !rough.starved && !plain.found.is_dark();
    if tells && !(rough.guiding() == Guiding::Full && full_gains(&rough)?) {
        return Ok(guidance);
    }
    match pilot.learn()? {
        Some(full) if full.guiding() == Guiding::Full && full_gains(&full)? => Ok(Some(full)),
        _ => Ok(guidance),
    }
}

/// What a trial of photons has found.
#[derive(Clone)]
struct Tried {
    found: Found,
    /// Whether it has seen enough.
    seen: bool,
}

/// What so many photons find, guided so.
fn tried<'a>(
    scene: &'a Scene,
    settings: &Settings,
    guidance: Option<Guidance<'a>>,
    photons: u64,
    control: &Control,
) -> Result<Tried> {
    let settings = of_a_trial(settings);
    let run = Run::new(scene, &settings, Vec::new(), Keep::OnCaptors, control)?;
    let run = Run { purpose: Purpose::Guiding, ..run.guided_by(guidance) };
    let mut totals = run.totals();
    run.rounds(&run.schedule(photons)?, (0, 0, 0), 0..1, None, &mut totals, None)?;
    let found = Found::new(scene, &totals, totals.histories, channels(scene));
    Ok(Tried { seen: sees_enough(scene, &totals), found })
}

/// Whether enough histories have come to half of the faces: of the virtual captors, if there are any.
fn sees_enough(scene: &Scene, totals: &Totals) -> bool {
    let any_virtual = scene.has_virtual_captors();
    let counts = |captor: &&Captor| !any_virtual || captor.kind != CaptorKind::Surface;
    let (mut all, mut lit) = (0, 0);
    for captor in scene.captors.iter().filter(counts) {
        for &face in captor.kind.faces() {
            let channel = captor.first_channel + face as usize;
            let histories = totals.histories_in(channel).unwrap_or(totals.photons(channel));
            all += 1;
            lit += usize::from(histories >= SEEN);
        }
    }
    2 * lit >= all
}

/// The channels of all faces.
fn channels(scene: &Scene) -> impl Iterator<Item = usize> {
    let of = |captor: &Captor| {
        let first = captor.first_channel;
        captor.kind.faces().iter().map(move |&face| first + face as usize)
    };
    scene.captors.iter().flat_map(of)
}
