//! Flights that are aimed at chosen captors, beside photons that nothing else guides.

use std::cell::Cell;

use crate::{
    math::{
        rng::Stream,
        spectrum::{Lanes, Spectrum},
    },
    scene::{
        material::Scatterer,
        world::{Arrived, Crossing},
    },
    transport::{
        guiding::Aimed,
        trace::{Event, Guide, Onward, scatter},
    },
};

/// Aims flights beside one photon.
pub struct Steered<'a, 'p> {
    /// Sends the flights.
    pub aimed: Aimed<'a>,
    /// For each captor the indices of the goals that it belongs to: those of surfaces among them are
    /// aimed at.
    pub goals_of: &'p [Vec<usize>],
    /// Receives the weight with which the photon's own arrival on such a surface counts.
    pub share: &'p Cell<f32>,
}

impl<'a, L: Lanes> Guide<'a, L> for Steered<'a, '_> {
    fn cross(
        &mut self,
        crossing: Crossing,
        direction: glam::Vec3,
        power: &Spectrum<L>,
        on: &mut impl FnMut(Event<'_, L>),
    ) {
        self.aimed.cross(crossing, direction, power, on);
    }

    fn scatter(
        &mut self,
        at: &Arrived<'a>,
        power: &Spectrum<L>,
        scattered: &mut Spectrum<L>,
        rng: &mut Stream,
    ) -> Option<Onward> {
        // before the photon leaves: the weight is that of the flight that brought it here
        if at.surface.captor().is_some_and(|captor| !self.goals_of[captor].is_empty()) {
            self.share.set(self.aimed.share::<L>());
        }
        scatter(at.material, &at.interaction, power, scattered, rng)
    }

    fn arrive(
        &mut self,
        at: &Arrived<'a>,
        _interactions: u32,
        power: &Spectrum<L>,
        (onward, _): (&mut Option<Onward>, &mut Spectrum<L>),
        rng: &mut Stream,
        on: &mut impl FnMut(Event<'_, L>),
    ) {
        if at.material.is_diffuse() {
            let seen = self.aimed.arrive(at, power, rng, on);
            self.aimed.leave(at, seen, *onward);
        }
    }
}
