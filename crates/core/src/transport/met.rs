//! How often light has met the [parameters](crate::scene::parameter) of a scene.
//!
//! A history that brings the power c to a captor, after it has met a parameter n times, counts c n in
//! the moment of that parameter there. The elasticity is the moment over the sum of all c. What a
//! captor absorbs is less the more its own surface sends on: where light arrives on a surface that
//! sends on the part r of it by a parameter's way, c r is taken off the moment of what it absorbs.

use crate::{
    math::spectrum::{Lanes, Spectrum},
    scene::{
        material::LobeKind,
        parameter::{ParameterIndex, Parameters, Sent},
        world::Arrived,
    },
    transport::trace::{Event, Turn},
};

/// The parameters that some light has met, each with how often.
#[derive(Debug, Default)]
pub struct Met(Vec<(ParameterIndex, u32)>);

impl Clone for Met {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }

    fn clone_from(&mut self, other: &Self) {
        self.0.clone_from(&other.0);
    }
}

impl Met {
    /// Counts one more meeting, if there is one.
    pub fn add(&mut self, parameter: Option<ParameterIndex>) {
        let Some(parameter) = parameter else { return };
        match self.0.iter_mut().find(|(known, _)| *known == parameter) {
            Some((_, times)) => *times += 1,
            None => self.0.push((parameter, 1)),
        }
    }

    /// Returns the parameters with how often they were met.
    pub fn each(&self) -> impl Iterator<Item = (ParameterIndex, f32)> + '_ {
        self.0.iter().map(|&(parameter, times)| (parameter, times as f32))
    }
}

/// The material and the face that a photon has come to last.
type Place = Option<(u32, bool)>;

/// Keeps account of what the photons of one history have met, one after the other.
#[derive(Debug, Default)]
pub struct Account {
    /// What the photon has met so far, what it had met before the surface that it came to last, and
    /// that surface.
    now: Met,
    before: Met,
    at: Place,
    /// What the flight that accompanies it has met.
    aimed: Met,
    /// What copies that wait had met before the surface where they wait, and that surface.
    waiting: Vec<(Met, Place)>,
}

impl Account {
    /// Starts with a photon of a light.
    pub fn start(&mut self, light: Option<ParameterIndex>) {
        self.now.0.clear();
        self.now.add(light);
        self.before.clone_from(&self.now);
        self.aimed.clone_from(&self.now);
        self.at = None;
        self.waiting.clear();
    }

    /// Returns what the light had met of which an event tells.
    pub fn of<L>(&self, event: &Event<'_, L>) -> &Met {
        match event {
            Event::Crossing { carried: None, .. } => &self.aimed,
            _ => &self.now,
        }
    }

    /// Takes in an event, once it has been counted.
    pub fn then<L>(&mut self, parameters: &Parameters, event: &Event<'_, L>) {
        let of_lobe = |(material, front): (u32, bool), lobe: LobeKind| {
            parameters.of_way(material, front, Sent::by(lobe)?)
        };
        match *event {
            Event::Arrival { at, lobe, .. } => {
                let place = (at.surface.material, at.interaction.front);
                self.before.clone_from(&self.now);
                self.at = Some(place);
                self.now.add(lobe.and_then(|lobe| of_lobe(place, lobe)));
            }
            Event::Turn(Turn::Aimed { crosses }) => {
                self.aimed.clone_from(&self.before);
                self.aimed.add(self.at.and_then(|(material, front)| {
                    parameters.of_way(material, front, Sent::scattered(crosses))
                }));
            }
            Event::Turn(Turn::SentOn { material, front, lobe, .. }) => {
                self.aimed.add(of_lobe((material, front), lobe));
            }
            Event::Turn(Turn::Waits) => self.waiting.push((self.before.clone(), self.at)),
            Event::Turn(Turn::Copy { lobe, last }) => {
                let Some((before, at)) = self.waiting.last() else { return };
                self.now.clone_from(before);
                self.now.add(at.zip(lobe).and_then(|(at, lobe)| of_lobe(at, lobe)));
                if last {
                    self.waiting.pop();
                }
            }
            _ => {}
        }
    }
}

/// Keeps account of what a backward path has met, and of the moments of what it finds. The account
/// `()` does nothing, and costs nothing.
pub trait Along<L: Lanes> {
    /// Counts that the path has been sent on by a lobe of a surface.
    #[inline(always)]
    fn sent_on(&mut self, _parameters: &Parameters, _at: &Arrived, _lobe: LobeKind) {}

    /// Returns the moments of light that has come by no surface; `None` if no account is kept.
    #[inline(always)]
    fn moments(
        _moments: impl FnOnce() -> Vec<(ParameterIndex, Spectrum<L>)>,
    ) -> Option<Moments<L>> {
        None
    }

    /// Returns the moments of what was found, times a factor; `None` if no account is kept.
    #[inline(always)]
    fn into_moments(self, _factor: f32) -> Option<Moments<L>>
    where
        Self: Sized,
    {
        None
    }

    /// Counts light that the path has found, which has met these parameters, too.
    #[inline(always)]
    fn found(&mut self, _light: &Spectrum<L>, _met: impl FnOnce() -> [Option<ParameterIndex>; 3]) {}
}

impl<L: Lanes> Along<L> for () {}

/// The moments of what a path has found, as far as they are not 0.
#[derive(Clone, Debug)]
pub struct Moments<L>(pub Vec<(ParameterIndex, Spectrum<L>)>);

impl<L> Default for Moments<L> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<L: Lanes> Moments<L> {
    /// Adds to the moment of a parameter.
    pub fn add(&mut self, parameter: ParameterIndex, moment: Spectrum<L>) {
        match self.0.iter_mut().find(|(known, _)| *known == parameter) {
            Some((_, sum)) => *sum += moment,
            None => self.0.push((parameter, moment)),
        }
    }
}

/// What a path has met so far, and the moments of what it has found.
#[derive(Debug)]
pub struct PathAccount<L> {
    met: Met,
    /// The moments of the light that was found.
    pub moments: Moments<L>,
}

impl<L> Default for PathAccount<L> {
    fn default() -> Self {
        Self { met: Met::default(), moments: Moments::default() }
    }
}

impl<L: Lanes> Along<L> for PathAccount<L> {
    fn sent_on(&mut self, parameters: &Parameters, at: &Arrived, lobe: LobeKind) {
        self.met.add(way_back(parameters, at, lobe));
    }

    fn moments(moments: impl FnOnce() -> Vec<(ParameterIndex, Spectrum<L>)>) -> Option<Moments<L>> {
        Some(Moments(moments()))
    }

    fn into_moments(self, factor: f32) -> Option<Moments<L>> {
        let scaled = self.moments.0.into_iter().map(|(met, sum)| (met, sum.scaled(factor)));
        Some(Moments(scaled.collect()))
    }

    fn found(&mut self, light: &Spectrum<L>, met: impl FnOnce() -> [Option<ParameterIndex>; 3]) {
        for (parameter, times) in self.met.each() {
            self.moments.add(parameter, light.clone().scaled(times));
        }
        for parameter in met().into_iter().flatten() {
            self.moments.add(parameter, light.clone());
        }
    }
}

/// Returns the parameter of light that has come to `at` and is sent on by a lobe.
pub fn way_on(parameters: &Parameters, at: &Arrived, lobe: LobeKind) -> Option<ParameterIndex> {
    parameters.of_way(at.surface.material, at.interaction.front, Sent::by(lobe)?)
}

/// Returns the parameter of light that a surface sends against the direction of a path, which has
/// come to `at` and goes on by a lobe: the light comes to the face to which the path goes on.
pub fn way_back(parameters: &Parameters, at: &Arrived, lobe: LobeKind) -> Option<ParameterIndex> {
    let front = at.interaction.front != lobe.crosses();
    parameters.of_way(at.surface.material, front, Sent::by(lobe)?)
}
