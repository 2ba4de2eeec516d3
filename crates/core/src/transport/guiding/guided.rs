//! Guides one photon: aimed flights accompany it, and weight windows split or end it.
//!
//! A photon of power w arrives at a place of importance J. On average m = w J / R photons leave it,
//! each with 1 / m of the power that the surface scatters. The product of power and importance
//! therefore stays near R, its usual value where photons first meet a diffuse surface. Splitting
//! (m > 1) and roulette (m < 1) are one game (weight windows: Booth, "Monte Carlo variance
//! reduction approaches for non-Boltzmann tallies", LA-12433, 1992), which replaces the roulette of
//! absorption. Where both would let nearly the same number of photons go on, the roulette of
//! absorption is kept: splitting that gains nothing only costs time.

use std::sync::Arc;

use glam::Vec3;

use super::{Aimed, Importance, Lamps, Targets, targets::Seen};
use crate::{
    math::{
        rng::Stream,
        spectrum::{Lanes, Spectrum},
    },
    scene::{
        light::Emission,
        material::{BsdfSample, Scatterer, Transport},
        world::{Arrived, Crossing, Scene},
    },
    transport::{
        settings::Guiding,
        trace::{Event, Flight, Guide, Onward, Turn, scatter, trace},
    },
};

/// The dead band: the game is played only where it lets at least this many times as many photons go
/// on as the roulette of absorption would, or at most the inverse of it.
const BAND: f32 = 5.0;
/// A photon that survives games carries at most this many times the power that it would carry without
/// all of them. Where nothing matters, a bound for each game alone would let ever fewer photons carry
/// ever more.
const MOST_GAIN: f32 = 20.0;
/// The most photons into which one is split at a place: more of them would bring nearly the same.
const MOST_COPIES: f32 = 300.0;
/// Once a history has more than this many photons, none of them is split any more.
const MOST_PHOTONS: u32 = 1000;

/// What guides the photons of a run.
#[derive(Clone, Default)]
pub struct Guidance<'a> {
    /// The captors at which flights are aimed, where there are any.
    pub targets: Option<Targets>,
    /// Weight windows, where they pay.
    pub windows: Option<Windows<'a>>,
    /// How lamps emit, where that pays.
    pub lamps: Option<Arc<Lamps>>,
    /// Whether the pilot found too little light to say how the lamps should emit.
    pub starved: bool,
}

impl<'a> Guidance<'a> {
    /// Returns a guidance that only aims flights at the virtual captors of a scene; `None` if there
    /// are none.
    pub fn aim(scene: &Scene) -> Option<Self> {
        Targets::of(scene).map(|targets| Self { targets: Some(targets), ..Self::default() })
    }

    /// Returns the name of this kind of guiding.
    pub fn guiding(&self) -> Guiding {
        match self {
            Self { windows: None, lamps: None, targets: None, .. } => Guiding::Off,
            Self { windows: None, lamps: None, .. } => Guiding::Aim,
            _ => Guiding::Full,
        }
    }

    /// Follows a photon that was emitted with this density over that without guiding. `flights` is
    /// `None` where none accompanies it; otherwise it has the emission without guiding from which the
    /// first one leaves, if that is not the photon itself.
    pub fn trace<'s, L: Lanes>(
        &'s self,
        scene: &'s Scene,
        (photon, density): (Emission<'_, L>, f32),
        flights: Option<Option<&Emission<'_, L>>>,
        copies: &mut Vec<Copies<'s, L>>,
        rng: &mut Stream,
        mut on: impl FnMut(Event<'_, L>),
    ) {
        let power = photon.power.clone().scaled(1.0 / density);
        if photon.start.is_some() && density != 1.0 {
            on(Event::Chance { before: &photon.power, after: &power });
        }
        let mut aimed = self.targets.as_ref().map(|targets| Aimed::new(scene, targets));
        if let (Some(aimed), Some(other)) = (&mut aimed, flights) {
            aimed.start(&photon, other, rng, &mut on);
        }
        let windows = self.windows.as_ref().map(|windows| {
            let largest = photon.weights.iter().copied().fold(0.0, f64::max);
            (&*windows.importance, largest as f32 / windows.usual)
        });
        copies.clear();
        trace(scene, photon.ray, power, Guided::new(aimed, windows, copies), rng, on);
    }

    /// Whether photons are guided, or a warning must say why they are not.
    pub fn guides(&self) -> bool {
        self.guiding() != Guiding::Off || self.starved
    }
}

/// Weight windows.
#[derive(Clone)]
pub struct Windows<'a> {
    /// The importance J of every face.
    pub importance: Arc<Importance<'a>>,
    /// The usual product R of power and importance, in W or umol/s.
    pub usual: f32,
}

/// Guides one photon.
pub struct Guided<'a, 'p, L> {
    /// Sends the aimed flights, where there are captors to aim at.
    pub aimed: Option<Aimed<'a>>,
    /// The importance J, and the factor by which the product of power and importance gives m.
    pub windows: Option<(&'a Importance<'a>, f32)>,
    /// Copies that are still to be followed; there are none at first.
    pub copies: &'p mut Vec<Copies<'a, L>>,
    /// The game at the surface where the photon is, if one is played there.
    game: Option<Game>,
    /// How many photons this history has had, copies included.
    photons: u32,
    /// How many times the power that it would carry without games the photon carries.
    carries: f32,
}

/// Copies of a photon that are still to be followed, and the place from which they start.
pub struct Copies<'a, L> {
    at: Arrived<'a>,
    /// How often the photon had been scattered before it arrived here.
    interactions: u32,
    seen: Seen,
    /// The power that each copy brings to the surface.
    power: Spectrum<L>,
    /// How many times the power that it would carry without games each copy carries.
    carries: f32,
    /// How many copies are left.
    left: u32,
}

/// How many photons go on from a place, where the game is played.
#[derive(Clone, Copy)]
struct Game {
    /// Their mean number, m.
    mean: f32,
    /// Their mean number over the mean number with the roulette of absorption.
    gain: f32,
}

impl<'a, 'p, L: Lanes> Guided<'a, 'p, L> {
    /// Starts with a photon that leaves a light.
    pub fn new(
        aimed: Option<Aimed<'a>>,
        windows: Option<(&'a Importance<'a>, f32)>,
        copies: &'p mut Vec<Copies<'a, L>>,
    ) -> Self {
        Self { aimed, windows, copies, game: None, photons: 1, carries: 1.0 }
    }

    fn game(&self, at: &Arrived<'a>, power: &Spectrum<L>) -> Option<Game> {
        let (importance, scale) = self.windows.filter(|_| at.material.is_diffuse())?;
        let kept = importance.kept(at.surface.material);
        let mean = scale * power.largest() * importance.at(&at.hit, at.interaction.front);
        let gain = (mean / kept).max(self.carries / MOST_GAIN);
        let leave_alone = !(gain >= BAND || gain <= 1.0 / BAND);
        let too_many = gain > 1.0 && self.photons > MOST_PHOTONS;
        let mean = (gain * kept).min(MOST_COPIES);
        // the mean is 0 where the surface sends nothing on: no game is played there
        (!leave_alone && !too_many && mean > 0.0).then_some(Game { mean, gain: mean / kept })
    }
}

impl<'a, L: Lanes> Guide<'a, L> for Guided<'a, '_, L> {
    #[inline]
    fn cross(
        &mut self,
        crossing: Crossing,
        direction: Vec3,
        power: &Spectrum<L>,
        on: &mut impl FnMut(Event<'_, L>),
    ) {
        match &mut self.aimed {
            Some(aimed) => aimed.cross(crossing, direction, power, on),
            None => on(Event::Crossing { crossing, direction, power, carried: Some(power) }),
        }
    }

    #[inline]
    fn scatter(
        &mut self,
        at: &Arrived<'a>,
        power: &Spectrum<L>,
        scattered: &mut Spectrum<L>,
        rng: &mut Stream,
    ) -> Option<Onward> {
        self.game = self.game(at, power);
        if self.game.is_none() {
            return scatter(at.material, &at.interaction, power, scattered, rng);
        }
        let BsdfSample { direction, weight, lobe } =
            at.material.sample::<L>(&at.interaction, Transport::Light, rng)?;
        *scattered = weight * power;
        Some(Onward { direction, lobe })
    }

    #[inline]
    fn arrive(
        &mut self,
        at: &Arrived<'a>,
        interactions: u32,
        power: &Spectrum<L>,
        (onward, scattered): (&mut Option<Onward>, &mut Spectrum<L>),
        rng: &mut Stream,
        on: &mut impl FnMut(Event<'_, L>),
    ) {
        let mut seen = Seen::default();
        let gain = self.game.map_or(1.0, |game| game.gain);
        if let Some(aimed) = self.aimed.as_mut().filter(|_| at.material.is_diffuse()) {
            // aimed flights leave from here as though the photon had been split, or ended, before
            // it arrived
            let each = power.clone().scaled(1.0 / gain);
            let flights = if self.game.is_some() { gain + rng.uniform() } else { 1.0 };
            for _ in 0..flights as u32 {
                seen = aimed.arrive(at, &each, rng, on);
            }
            aimed.leave(at, seen, *onward);
        }
        let Some(game) = self.game else { return };
        let number = (game.mean + rng.uniform()) as u32;
        if onward.is_some() {
            let after = scattered.clone().scaled(if number > 0 { 1.0 / game.mean } else { 0.0 });
            on(Event::Chance { before: scattered, after: &after });
            *scattered = after;
        }
        if number == 0 {
            *onward = None;
        }
        self.carries /= game.gain;
        if number > 1 {
            let power = power.clone().scaled(1.0 / game.mean);
            self.photons += number - 1;
            let (left, carries) = (number - 1, self.carries);
            on(Event::Turn(Turn::Waits));
            self.copies.push(Copies { at: *at, interactions, seen, power, carries, left });
        }
    }

    fn next(&mut self, rng: &mut Stream, on: &mut impl FnMut(Event<'_, L>)) -> Option<Flight<L>> {
        loop {
            let copies = self.copies.last_mut()?;
            let Copies { at, interactions, seen, carries, .. } = *copies;
            self.carries = carries;
            let sample = at.material.sample::<L>(&at.interaction, Transport::Light, rng);
            let onward = sample.map(|BsdfSample { direction, weight, lobe }| {
                (weight * &copies.power, Onward { direction, lobe })
            });
            copies.left -= 1;
            let last = copies.left == 0;
            if last {
                self.copies.pop();
            }
            let lobe = onward.as_ref().map(|(_, onward)| onward.lobe);
            on(Event::Turn(Turn::Copy { lobe, last }));
            let Some((power, onward)) = onward else { continue };
            on(Event::Chance { before: &power.zero(), after: &power });
            if let Some(aimed) = &mut self.aimed {
                aimed.leave(&at, seen, Some(onward));
            }
            let ray = at.leave(onward.lobe, onward.direction);
            return Some(Flight { ray, power, interactions: interactions + 1 });
        }
    }
}
