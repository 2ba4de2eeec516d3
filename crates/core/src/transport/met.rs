//! How often light has met the [parameters](crate::scene::parameter) of a scene.
//!
//! A history that brings the power c to a captor, after it has met a parameter n times, counts c n in
//! the moment of that parameter there. The elasticity is the moment over the sum of all c. What a
//! captor absorbs is less the more its own surface sends on: where light arrives on a surface that
//! sends on the part r of it by a parameter's way, c r is taken off the moment of what it absorbs.
//!
//! Where the scene has variants, a run counts what the light brings in each of them in place of the
//! moments: c times the factor of each parameter to the power of n.

use crate::{
    math::spectrum::{Lanes, Spectrum},
    scene::{
        material::LobeKind,
        parameter::{ParameterIndex, Parameters, Sent, Variant},
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

    /// Takes back one meeting that was counted, if there is one.
    fn take(&mut self, parameter: Option<ParameterIndex>) {
        let Some(parameter) = parameter else { return };
        let known = self.0.iter().position(|(known, _)| *known == parameter);
        if let Some(place) = known {
            self.0[place].1 -= 1;
            if self.0[place].1 == 0 {
                self.0.swap_remove(place);
            }
        }
    }

    /// Returns by what light that has met these is multiplied in a variant of the scene.
    pub fn factor<L: Lanes>(&self, variant: &Variant, lanes: usize) -> Spectrum<L> {
        let one = Spectrum::splat(lanes, 1.0);
        self.0.iter().fold(one, |all, &(parameter, times)| {
            let factor = Spectrum::<L>::load(variant.factor(parameter));
            all * factor.map(|factor| factor.powi(times as i32))
        })
    }

    /// Adds light that has met these to the sums of which there is one for each variant of the scene,
    /// or, where it has none, to the moments of its parameters.
    fn count<L: Lanes>(&self, parameters: &Parameters, light: &Spectrum<L>, sums: &mut Moments<L>) {
        if parameters.variants().is_empty() {
            for (parameter, times) in self.each() {
                sums.add(parameter.into(), light.clone().scaled(times));
            }
        }
        for (v, variant) in parameters.variants().iter().enumerate() {
            sums.add(v, self.factor::<L>(variant, light.values().len()) * light);
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

    /// Returns what the photon has met so far.
    pub fn now(&self) -> &Met {
        &self.now
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

/// Keeps account of what a backward path has met, and of the sums of what it finds. The account `()`
/// does nothing, and costs nothing.
pub trait Along<L: Lanes> {
    /// Counts that the path has been sent on by a lobe of a surface.
    #[inline(always)]
    fn sent_on(&mut self, _parameters: &Parameters, _at: &Arrived, _lobe: LobeKind) {}

    /// Returns the sums of light that has met these parameters; `None` if no account is kept.
    #[inline(always)]
    fn sums_of(
        _parameters: &Parameters,
        _light: &Spectrum<L>,
        _met: impl FnOnce() -> [Option<ParameterIndex>; 2],
    ) -> Option<Moments<L>> {
        None
    }

    /// Returns the sums of what was found, times a factor; `None` if no account is kept.
    #[inline(always)]
    fn into_sums(self, _factor: f32) -> Option<Moments<L>>
    where
        Self: Sized,
    {
        None
    }

    /// Counts light that the path has found, which has met these parameters, too.
    #[inline(always)]
    fn found(
        &mut self,
        _parameters: &Parameters,
        _light: &Spectrum<L>,
        _met: impl FnOnce() -> [Option<ParameterIndex>; 3],
    ) {
    }
}

impl<L: Lanes> Along<L> for () {}

/// The moments of parameters, or the light in each variant of the scene, as far as they are not 0:
/// the index of each, and its sum.
#[derive(Clone, Debug)]
pub struct Moments<L>(pub Vec<(usize, Spectrum<L>)>);

impl<L> Default for Moments<L> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<L: Lanes> Moments<L> {
    /// Adds to the sum of this index.
    pub fn add(&mut self, index: usize, more: Spectrum<L>) {
        match self.0.iter_mut().find(|(known, _)| *known == index) {
            Some((_, sum)) => *sum += more,
            None => self.0.push((index, more)),
        }
    }
}

/// What a path has met so far, and the sums of what it has found.
#[derive(Debug)]
pub struct PathAccount<L> {
    met: Met,
    sums: Moments<L>,
}

impl<L> Default for PathAccount<L> {
    fn default() -> Self {
        Self { met: Met::default(), sums: Moments::default() }
    }
}

impl<L: Lanes> Along<L> for PathAccount<L> {
    fn sent_on(&mut self, parameters: &Parameters, at: &Arrived, lobe: LobeKind) {
        self.met.add(way_back(parameters, at, lobe));
    }

    fn sums_of(
        parameters: &Parameters,
        light: &Spectrum<L>,
        met: impl FnOnce() -> [Option<ParameterIndex>; 2],
    ) -> Option<Moments<L>> {
        let (mut all, mut sums) = (Met::default(), Moments::default());
        met().into_iter().for_each(|parameter| all.add(parameter));
        all.count(parameters, light, &mut sums);
        Some(sums)
    }

    fn into_sums(self, factor: f32) -> Option<Moments<L>> {
        let scaled = self.sums.0.into_iter().map(|(index, sum)| (index, sum.scaled(factor)));
        Some(Moments(scaled.collect()))
    }

    fn found(
        &mut self,
        parameters: &Parameters,
        light: &Spectrum<L>,
        met: impl FnOnce() -> [Option<ParameterIndex>; 3],
    ) {
        let met = met();
        met.iter().for_each(|parameter| self.met.add(*parameter));
        self.met.count(parameters, light, &mut self.sums);
        met.iter().for_each(|parameter| self.met.take(*parameter));
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
