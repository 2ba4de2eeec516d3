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
        material::{Interaction, LobeKind, Scatterer},
        parameter::{ParameterIndex, Parameters, Sent, Variant},
        world::{Arrived, Scene},
    },
    transport::trace::{Event, Turn},
};

/// The parameters that some light has met.
#[derive(Debug)]
pub struct Met<L> {
    /// Those of which each meeting counts once, each with how often it was met.
    times: Vec<(ParameterIndex, u32)>,
    /// The others, each with the sum of the powers with which it has entered, per band.
    powers: Vec<(ParameterIndex, Spectrum<L>)>,
}

impl<L> Default for Met<L> {
    fn default() -> Self {
        Self { times: Vec::new(), powers: Vec::new() }
    }
}

impl<L: Lanes> Clone for Met<L> {
    fn clone(&self) -> Self {
        Self { times: self.times.clone(), powers: self.powers.clone() }
    }

    fn clone_from(&mut self, other: &Self) {
        self.times.clone_from(&other.times);
        self.powers.clone_from(&other.powers);
    }
}

impl<L: Lanes> Met<L> {
    /// Counts one more meeting, if there is one.
    pub fn add(&mut self, parameter: Option<ParameterIndex>) {
        if let Some(parameter) = parameter {
            self.add_times(parameter, 1);
        }
    }

    fn add_times(&mut self, parameter: ParameterIndex, more: u32) {
        match self.times.iter_mut().find(|(known, _)| *known == parameter) {
            Some((_, times)) => *times += more,
            None => self.times.push((parameter, more)),
        }
    }

    fn add_powers(&mut self, parameter: ParameterIndex, more: Spectrum<L>) {
        match self.powers.iter_mut().find(|(known, _)| *known == parameter) {
            Some((_, powers)) => *powers += more,
            None => self.powers.push((parameter, more)),
        }
    }

    /// Counts that a lobe of a material, given by its index, has sent on light that came to a face
    /// of it. It came as the interaction tells, or goes so, against the direction of a path.
    fn add_way(
        &mut self,
        scene: &Scene,
        (material, front): (u32, bool),
        at: &Interaction,
        lobe: LobeKind,
    ) {
        let way = Sent::by(lobe).and_then(|sent| scene.parameters().of_way(material, front, sent));
        let Some(parameter) = way else { return };
        match scene.materials()[material as usize].material.powers::<L>(at, lobe) {
            None => self.add_times(parameter, 1),
            Some(more) => self.add_powers(parameter, more),
        }
    }

    /// Counts light that has come to a surface and is sent on by a lobe.
    pub fn sent_on(&mut self, scene: &Scene, place: Place, lobe: LobeKind) {
        self.add_way(scene, (place.material, place.at.front), &place.at, lobe);
    }

    /// Counts light that a surface sends against the direction of a path, which has come to it and
    /// goes on by a lobe: the light comes to the face to which the path goes on.
    pub fn sent_back(&mut self, scene: &Scene, place: Place, lobe: LobeKind) {
        let front = place.at.front != lobe.crosses();
        self.add_way(scene, (place.material, front), &place.at, lobe);
    }

    /// Adds all that other light has met.
    pub fn add_all(&mut self, other: &Self) {
        for &(parameter, times) in &other.times {
            self.add_times(parameter, times);
        }
        for (parameter, powers) in &other.powers {
            self.add_powers(*parameter, powers.clone());
        }
    }

    /// Returns by what light that has met these is multiplied in a variant of the scene. Parameters
    /// that enter by other powers are the same in all variants.
    pub fn factor(&self, variant: &Variant, lanes: usize) -> Spectrum<L> {
        let one = Spectrum::splat(lanes, 1.0);
        self.times.iter().fold(one, |all, &(parameter, times)| {
            let factor = Spectrum::<L>::load(variant.factor(parameter));
            all * factor.map(|factor| factor.powi(times as i32))
        })
    }

    /// Adds light that has met these to the sums of which there is one for each variant of the scene,
    /// or, where it has none, to the moments of its parameters.
    fn count(&self, parameters: &Parameters, light: &Spectrum<L>, sums: &mut Moments<L>) {
        if parameters.variants().is_empty() {
            self.moments(light, |parameter, moment| sums.add(parameter.into(), moment));
        }
        for (v, variant) in parameters.variants().iter().enumerate() {
            sums.add(v, self.factor(variant, light.values().len()) * light);
        }
    }

    /// Tells the moment of each parameter in light that has met these.
    pub fn moments(&self, light: &Spectrum<L>, mut on: impl FnMut(ParameterIndex, Spectrum<L>)) {
        for &(parameter, times) in &self.times {
            on(parameter, light.clone().scaled(times as f32));
        }
        for (parameter, powers) in &self.powers {
            on(*parameter, light.clone() * powers);
        }
    }
}

/// A surface, and how light has come to it.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Index of the material.
    pub material: u32,
    /// The direction from which the light, or a path, comes, and the face.
    pub at: Interaction,
}

impl From<&Arrived<'_>> for Place {
    fn from(at: &Arrived<'_>) -> Self {
        Self { material: at.surface.material, at: at.interaction }
    }
}

/// Keeps account of what the photons of one history have met, one after the other.
#[derive(Debug)]
pub struct Account<L> {
    /// What the photon has met so far, what it had met before the surface that it came to last, and
    /// that surface.
    now: Met<L>,
    before: Met<L>,
    at: Option<Place>,
    /// What the flight that accompanies it has met.
    aimed: Met<L>,
    /// What copies that wait had met before the surface where they wait, and that surface.
    waiting: Vec<(Met<L>, Option<Place>)>,
}

impl<L> Default for Account<L> {
    fn default() -> Self {
        let [now, before, aimed] = [(); 3].map(|()| Met::default());
        Self { now, before, at: None, aimed, waiting: Vec::new() }
    }
}

impl<L: Lanes> Account<L> {
    /// Starts with a photon of a light.
    pub fn start(&mut self, light: Option<ParameterIndex>) {
        self.now.times.clear();
        self.now.powers.clear();
        self.now.add(light);
        self.before.clone_from(&self.now);
        self.aimed.clone_from(&self.now);
        self.at = None;
        self.waiting.clear();
    }

    /// Returns what the photon has met so far.
    pub fn now(&self) -> &Met<L> {
        &self.now
    }

    /// Returns what the light had met of which an event tells.
    pub fn of(&self, event: &Event<'_, L>) -> &Met<L> {
        match event {
            Event::Crossing { carried: None, .. } => &self.aimed,
            _ => &self.now,
        }
    }

    /// Takes in an event, once it has been counted.
    pub fn then(&mut self, scene: &Scene, event: &Event<'_, L>) {
        match *event {
            Event::Arrival { at, lobe, .. } => {
                self.before.clone_from(&self.now);
                self.at = Some(at.into());
                if let Some(lobe) = lobe {
                    self.now.sent_on(scene, at.into(), lobe);
                }
            }
            Event::Turn(Turn::Aimed { crosses }) => {
                self.aimed.clone_from(&self.before);
                if let Some(at) = self.at {
                    self.aimed.sent_on(scene, at, LobeKind::diffuse(crosses));
                }
            }
            Event::Turn(Turn::SentOn { material, at, lobe, .. }) => {
                self.aimed.sent_on(scene, Place { material, at }, lobe);
            }
            Event::Turn(Turn::Waits) => self.waiting.push((self.before.clone(), self.at)),
            Event::Turn(Turn::Copy { lobe, last }) => {
                let Some((before, at)) = self.waiting.last() else { return };
                self.now.clone_from(before);
                if let (Some(at), Some(lobe)) = (*at, lobe) {
                    self.now.sent_on(scene, at, lobe);
                }
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
pub trait Along<L: Lanes>: Clone + Default {
    /// Whether an account is kept.
    const KEEPS: bool = false;

    /// Counts that the path has been sent on by a lobe of a surface.
    #[inline(always)]
    fn sent_on(&mut self, _scene: &Scene, _at: &Arrived, _lobe: LobeKind) {}

    /// Counts that light which comes to the path has been sent on by a lobe of a surface.
    #[inline(always)]
    fn sent_forth(&mut self, _scene: &Scene, _at: &Arrived, _lobe: LobeKind) {}

    /// Returns the sums of what was found, times a factor; `None` if no account is kept.
    #[inline(always)]
    fn into_sums(self, _factor: f32) -> Option<Moments<L>> {
        None
    }

    /// Counts light that the path has found. `more` adds what it has met elsewhere than on the
    /// path.
    #[inline(always)]
    fn found(&mut self, _scene: &Scene, _light: &Spectrum<L>, _more: impl FnOnce(&mut Met<L>)) {}
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
#[derive(Clone, Debug)]
pub struct PathAccount<L: Lanes> {
    met: Met<L>,
    /// What the light has met that was found last.
    all: Met<L>,
    sums: Moments<L>,
}

impl<L: Lanes> Default for PathAccount<L> {
    fn default() -> Self {
        Self { met: Met::default(), all: Met::default(), sums: Moments::default() }
    }
}

impl<L: Lanes> Along<L> for PathAccount<L> {
    const KEEPS: bool = true;

    fn sent_on(&mut self, scene: &Scene, at: &Arrived, lobe: LobeKind) {
        self.met.sent_back(scene, at.into(), lobe);
    }

    fn sent_forth(&mut self, scene: &Scene, at: &Arrived, lobe: LobeKind) {
        self.met.sent_on(scene, at.into(), lobe);
    }

    fn into_sums(self, factor: f32) -> Option<Moments<L>> {
        let scaled = self.sums.0.into_iter().map(|(index, sum)| (index, sum.scaled(factor)));
        Some(Moments(scaled.collect()))
    }

    fn found(&mut self, scene: &Scene, light: &Spectrum<L>, more: impl FnOnce(&mut Met<L>)) {
        self.all.clone_from(&self.met);
        more(&mut self.all);
        self.all.count(scene.parameters(), light, &mut self.sums);
    }
}
