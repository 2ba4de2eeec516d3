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

/// Light has met a parameter.
#[derive(Debug)]
pub struct Meeting<L> {
    /// The parameter.
    pub parameter: ParameterIndex,
    /// The powers with which the parameter has entered, per band; `None` where it has entered once.
    powers: Option<Spectrum<L>>,
}

impl<L: Lanes> Meeting<L> {
    /// Returns the meeting of light with a lobe of a material, given by its index, that has sent it
    /// on from a face. It came as the interaction tells, or goes so, against the direction of a path.
    #[inline]
    fn of_way(
        scene: &Scene,
        (material, front): (u32, bool),
        at: &Interaction,
        lobe: LobeKind,
    ) -> Option<Self> {
        let parameter = scene.parameters().of_way(material, front, Sent::by(lobe)?)?;
        let powers = scene.materials()[material as usize].material.powers::<L>(at, lobe);
        Some(Self { parameter, powers })
    }

    /// Returns the meeting of light that has come to a surface and is sent on by a lobe; `None` if
    /// the lobe belongs to no parameter.
    #[inline]
    pub fn sent_on(scene: &Scene, place: Place, lobe: LobeKind) -> Option<Self> {
        Self::of_way(scene, (place.material, place.at.front), &place.at, lobe)
    }

    /// Returns the moment of the parameter in light that has met it here.
    pub fn moment(&self, light: &Spectrum<L>) -> Spectrum<L> {
        match &self.powers {
            None => light.clone(),
            Some(powers) => light.clone() * powers,
        }
    }
}

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

    /// Counts a meeting, if there is one.
    fn join(&mut self, meeting: Option<Meeting<L>>) {
        match meeting {
            Some(Meeting { parameter, powers: None }) => self.add_times(parameter, 1),
            Some(Meeting { parameter, powers: Some(powers) }) => self.add_powers(parameter, powers),
            None => {}
        }
    }

    /// Counts light that has come to a surface and is sent on by a lobe.
    pub fn sent_on(&mut self, scene: &Scene, place: Place, lobe: LobeKind) {
        self.join(Meeting::sent_on(scene, place, lobe));
    }

    /// Counts light that a surface sends against the direction of a path, which has come to it and
    /// goes on by a lobe: the light comes to the face to which the path goes on.
    pub fn sent_back(&mut self, scene: &Scene, place: Place, lobe: LobeKind) {
        let front = place.at.front != lobe.crosses();
        self.join(Meeting::of_way(scene, (place.material, front), &place.at, lobe));
    }

    /// Counts light that has gone these ways.
    fn add_steps(&mut self, scene: &Scene, steps: &[Step]) {
        for &Step { place, lobe } in steps {
            if let Some(lobe) = lobe {
                self.sent_on(scene, place, lobe);
            }
        }
    }

    /// Forgets all, and counts light as it is emitted.
    fn start(&mut self, light: Option<ParameterIndex>) {
        self.times.clear();
        self.powers.clear();
        self.add(light);
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

/// A surface that a photon has come to.
#[derive(Clone, Copy, Debug)]
struct Step {
    place: Place,
    /// The lobe by which it goes on from there; `None` if it does not.
    lobe: Option<LobeKind>,
}

/// Keeps account of where the photons of one history have been, one after the other. What they have
/// met there is found only where someone asks, as most photons come to no captor any more.
#[derive(Debug)]
pub struct Account<L> {
    light: Option<ParameterIndex>,
    /// The surfaces that the photon has come to, in order.
    steps: Vec<Step>,
    /// How many of these the flight that accompanies the photon has been at, too, and those that only
    /// the flight has been at: first where it leaves the photon.
    shared: usize,
    beside: Vec<Step>,
    /// Where copies wait: the number of the surface.
    waiting: Vec<usize>,
    /// What the photon has met at so many of its surfaces, which may be [unknown](Self::UNKNOWN).
    met: Met<L>,
    counted: usize,
    /// What the flight has met.
    met_beside: Met<L>,
}

impl<L> Default for Account<L> {
    fn default() -> Self {
        let [met, met_beside] = [(); 2].map(|()| Met::default());
        let (steps, beside, waiting) = (Vec::new(), Vec::new(), Vec::new());
        Self { light: None, steps, shared: 0, beside, waiting, met, counted: 0, met_beside }
    }
}

impl<L: Lanes> Account<L> {
    /// More surfaces than any photon comes to, where `met` is of another photon or way.
    const UNKNOWN: usize = usize::MAX;

    /// Starts with a photon of a light.
    pub fn start(&mut self, light: Option<ParameterIndex>) {
        self.light = light;
        self.waiting.clear();
        self.go_back_to(0);
        self.counted = Self::UNKNOWN;
    }

    /// Goes back to where the photon had been at so many surfaces.
    fn go_back_to(&mut self, steps: usize) {
        self.steps.truncate(steps);
        self.shared = steps;
        self.beside.clear();
        if self.counted > steps {
            self.counted = Self::UNKNOWN;
        }
    }

    /// Counts what the photon has met at so many of its surfaces.
    fn count(&mut self, scene: &Scene, steps: usize) {
        if self.counted > steps {
            self.met.start(self.light);
            self.counted = 0;
        }
        self.met.add_steps(scene, &self.steps[self.counted..steps]);
        self.counted = steps;
    }

    /// Returns what the photon has met so far.
    pub fn now(&mut self, scene: &Scene) -> &Met<L> {
        self.count(scene, self.steps.len());
        &self.met
    }

    /// Returns what the light had met of which an event tells.
    pub fn of(&mut self, scene: &Scene, event: &Event<'_, L>) -> &Met<L> {
        let Event::Crossing { carried: None, .. } = event else { return self.now(scene) };
        self.count(scene, self.shared);
        self.met_beside.clone_from(&self.met);
        self.met_beside.add_steps(scene, &self.beside);
        &self.met_beside
    }

    /// Takes in an event, once it has been counted.
    #[inline]
    pub fn then(&mut self, event: &Event<'_, L>) {
        match *event {
            Event::Arrival { at, lobe, .. } => self.steps.push(Step { place: at.into(), lobe }),
            Event::Turn(turn) => self.turn(turn),
            _ => {}
        }
    }

    /// Takes in that the next events tell of other light.
    fn turn(&mut self, turn: Turn) {
        match turn {
            Turn::Aimed { crosses } => {
                let lobe = Some(LobeKind::diffuse(crosses));
                self.beside.clear();
                self.beside.extend(self.steps.last().map(|last| Step { lobe, ..*last }));
                self.shared = self.steps.len() - self.beside.len();
            }
            Turn::SentOn { material, at, lobe, .. } => {
                self.beside.push(Step { place: Place { material, at }, lobe: Some(lobe) });
            }
            Turn::Waits => self.waiting.extend(self.steps.len().checked_sub(1)),
            Turn::Copy { lobe, last } => {
                let Some(&at) = self.waiting.last() else { return };
                let place = self.steps[at].place;
                self.go_back_to(at);
                self.steps.push(Step { place, lobe });
                if last {
                    self.waiting.pop();
                }
            }
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
