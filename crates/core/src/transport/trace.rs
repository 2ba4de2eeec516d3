//! The hot loop: follows one photon from its light to its end.

#[cfg(test)]
mod tests;

use glam::{Vec2, Vec3};

use crate::{
    math::{
        geometry::Ray,
        rng::Stream,
        spectrum::{Lanes, Spectrum},
    },
    scene::{
        captor::{Captor, Channel},
        material::{BsdfSample, Interaction, Lambert, LobeKind, Material, Scatterer, Transport},
        world::{Arrived, Crossing, Scene, SurfaceHit},
    },
};

/// Number of interactions after which a photon or path is given up as lost.
pub const MAX_INTERACTIONS: u32 = 10_000;
/// Number of total internal reflections in a row after which a photon or path is given up as lost.
pub const MAX_TOTAL_REFLECTIONS: u32 = 1_000;

/// An event in the life of a photon. Powers are fractions, per band, of the power with which the
/// photon was emitted.
#[derive(Debug)]
pub enum Event<'a, L> {
    /// The photon, or a flight aimed at captors that accompanies it, crosses a virtual captor.
    Crossing {
        /// The point, the captor and its face.
        crossing: Crossing,
        /// Direction of flight, a unit vector.
        direction: Vec3,
        /// The power that the crossing counts for.
        power: &'a Spectrum<L>,
        /// The power that the photon itself carries; `None` for a flight that accompanies it.
        carried: Option<&'a Spectrum<L>>,
    },
    /// A straight flight that accompanies the photon has ended.
    FlightBeside,
    /// A flight that accompanies the photon arrives at a surface. Only flights that are also aimed at
    /// surfaces tell of it.
    ArrivalBeside {
        /// The point, the surface and its material, and how the flight comes there.
        at: &'a Arrived<'a>,
        /// The power that the arrival counts for.
        power: &'a Spectrum<L>,
    },
    /// The photon arrives at a surface, which absorbs what the photon does not carry on.
    Arrival {
        /// The point, the surface and its material, and how the photon comes there.
        at: &'a Arrived<'a>,
        /// The power that the photon brings.
        power: &'a Spectrum<L>,
        /// The power that it carries on.
        scattered: &'a Spectrum<L>,
        /// The lobe by which it is scattered; `None` if it ends here.
        lobe: Option<LobeKind>,
    },
    /// The photon goes on as several, or ends, by a game of chance that no other event counts.
    Chance {
        /// The power that would have gone on without the game.
        before: &'a Spectrum<L>,
        /// The power that goes on.
        after: &'a Spectrum<L>,
    },
    /// What is told from here on is of other light than before. Only guided photons turn.
    Turn(Turn),
    /// The photon leaves the scene.
    Escaped {
        /// The power that it carries.
        power: &'a Spectrum<L>,
        /// Whether it has met no surface at all.
        missed: bool,
        /// Its direction, a unit vector.
        direction: Vec3,
    },
    /// The photon, with this power, is given up because its path is longer than the limits allow.
    Lost(&'a Spectrum<L>),
}

/// Whose light it is that the next events tell of, for those who keep account of where light has been.
#[derive(Clone, Copy, Debug)]
pub enum Turn {
    /// That of a flight aimed from where the photon is: from a surface, which the flight leaves on the
    /// side that it came from or, if it `crosses` the surface, on the other.
    Aimed {
        /// Whether the flight crosses the surface.
        crosses: bool,
    },
    /// That of the same flight, which a surface without diffuse scattering has sent on.
    SentOn {
        /// Where it has met the surface.
        hit: SurfaceHit,
        /// Index of the material.
        material: u32,
        /// How the flight has come there.
        at: Interaction,
        /// The lobe by which it goes on.
        lobe: LobeKind,
    },
    /// That of the photon as before; but copies of it wait here, to be followed later.
    Waits,
    /// That of a copy of those that wait where copies began to wait last.
    Copy {
        /// The lobe by which it goes on; `None` if it ends at once.
        lobe: Option<LobeKind>,
        /// Whether it is the last that waits there.
        last: bool,
    },
}

/// What an event counts for at a captor.
pub struct Counted<'e, L> {
    /// The captor.
    pub captor: &'e Captor,
    /// The face at which the photon arrives.
    pub face: Channel,
    /// The power that arrives.
    pub power: &'e Spectrum<L>,
}

impl<L: Lanes> Counted<'_, L> {
    /// Returns the index of the face's channel.
    pub fn channel(&self) -> usize {
        self.captor.first_channel + self.face as usize
    }
}

impl<L: Lanes> Event<'_, L> {
    /// Returns the cosine of the angle at which the photon meets a surface or captor; 1 for other
    /// events.
    pub fn cosine(&self, scene: &Scene) -> f32 {
        match *self {
            Self::Crossing { crossing, direction, .. } => {
                scene.crossed_normal(&crossing).dot(direction).abs()
            }
            Self::Arrival { at, .. } | Self::ArrivalBeside { at, .. } => at.interaction.cos,
            Self::FlightBeside
            | Self::Chance { .. }
            | Self::Turn(_)
            | Self::Escaped { .. }
            | Self::Lost(_) => 1.0,
        }
    }

    /// Returns whether a flight that accompanies the photon starts, or crosses a captor: it carries light
    /// that was scattered.
    #[inline(always)]
    pub fn is_beside(&self) -> bool {
        matches!(self, Self::FlightBeside | Self::Crossing { carried: None, .. })
    }

    /// Returns the captor, face and power for which the event counts. `None` away from captors, and
    /// behind captors that count one side only.
    #[inline]
    pub fn counted<'e>(&'e self, scene: &'e Scene) -> Option<Counted<'e, L>> {
        let (captor, front, power) = match *self {
            Self::Crossing { crossing, power, .. } => (crossing.captor, crossing.front, power),
            Self::Arrival { at, power, .. } | Self::ArrivalBeside { at, power } => {
                (at.surface.captor()?, at.interaction.front, power)
            }
            Self::FlightBeside
            | Self::Chance { .. }
            | Self::Turn(_)
            | Self::Escaped { .. }
            | Self::Lost(_) => {
                return None;
            }
        };
        let captor = &scene.captors()[captor];
        let face = if front { Channel::Front } else { Channel::Back };
        (front || captor.kind.has_back()).then_some(Counted { captor, face, power })
    }
}

/// Steers photons: helps them to captors that they hardly reach, or ends them early. The guide `()`
/// does nothing, and costs nothing.
pub trait Guide<'s, L: Lanes> {
    /// Reports to `on` that the photon crosses a virtual captor.
    #[inline(always)]
    fn cross(
        &mut self,
        crossing: Crossing,
        direction: Vec3,
        power: &Spectrum<L>,
        on: &mut impl FnMut(Event<'_, L>),
    ) {
        on(Event::Crossing { crossing, direction, power, carried: Some(power) });
    }

    /// Chooses how the photon goes on from a surface, as far as the surface decides. The power that
    /// it then carries is written to `scattered`. `None` if the photon ends.
    #[inline(always)]
    fn scatter(
        &mut self,
        at: &Arrived<'s>,
        power: &Spectrum<L>,
        scattered: &mut Spectrum<L>,
        rng: &mut Stream,
    ) -> Option<Onward> {
        scatter(at.material, &at.interaction, power, scattered, rng)
    }

    /// Is called once the photon has brought `power` to a surface, after so many `interactions`. It
    /// may change whether and how the photon goes `onward`, and with what power.
    #[inline(always)]
    fn arrive(
        &mut self,
        _at: &Arrived<'s>,
        _interactions: u32,
        _power: &Spectrum<L>,
        _onward: (&mut Option<Onward>, &mut Spectrum<L>),
        _rng: &mut Stream,
        _on: &mut impl FnMut(Event<'_, L>),
    ) {
    }

    /// Returns a copy of the photon that is still to be followed, once the one before it has ended.
    #[inline(always)]
    fn next(&mut self, _rng: &mut Stream, _on: &mut impl FnMut(Event<'_, L>)) -> Option<Flight<L>> {
        None
    }
}

impl<L: Lanes> Guide<'_, L> for () {}

/// Ends photons once they have been scattered diffusely by a surface without a glossy lobe.
pub struct UntilDiffused;

impl<'s, L: Lanes> Guide<'s, L> for UntilDiffused {
    #[inline(always)]
    fn scatter(
        &mut self,
        at: &Arrived<'s>,
        power: &Spectrum<L>,
        scattered: &mut Spectrum<L>,
        rng: &mut Stream,
    ) -> Option<Onward> {
        scatter(at.material, &at.interaction, power, scattered, rng)
            .filter(|onward| !onward.lobe.is_diffuse() || at.material.glossy() > 0.0)
    }
}

/// A photon that leaves a light or a surface.
pub struct Flight<L> {
    /// Where it starts, and its direction.
    pub ray: Ray,
    /// The power that it carries.
    pub power: Spectrum<L>,
    /// Number of its interactions so far.
    pub interactions: u32,
}

/// How a photon leaves a surface.
#[derive(Clone, Copy)]
pub struct Onward {
    /// The new direction, unit vector.
    pub direction: Vec3,
    /// The lobe of the surface by which it goes on.
    pub lobe: LobeKind,
}

/// Follows a photon along `ray`, and its copies if `guide` makes any. Reports to `on` what happens
/// to them, and to the flights that accompany them.
#[inline]
pub fn trace<'s, L: Lanes>(
    scene: &'s Scene,
    ray: Ray,
    power: Spectrum<L>,
    mut guide: impl Guide<'s, L>,
    rng: &mut Stream,
    mut on: impl FnMut(Event<'_, L>),
) {
    let mut flight = Flight { ray, power, interactions: 0 };
    loop {
        follow(scene, flight, &mut guide, rng, &mut on);
        match guide.next(rng, &mut on) {
            Some(next) => flight = next,
            None => return,
        }
    }
}

/// Follows one photon to its end.
#[inline(always)]
fn follow<'s, L: Lanes>(
    scene: &'s Scene,
    Flight { mut ray, mut power, interactions: before }: Flight<L>,
    guide: &mut impl Guide<'s, L>,
    rng: &mut Stream,
    mut on: &mut impl FnMut(Event<'_, L>),
) {
    let mut total_reflections = 0;
    for interactions in before..MAX_INTERACTIONS {
        let direction = ray.direction;
        let hit = scene.meet(&ray, |crossing| guide.cross(crossing, direction, &power, &mut on));
        let Some(hit) = hit else {
            if scene.is_endless(&ray) {
                break;
            }
            return on(Event::Escaped { power: &power, missed: interactions == 0, direction });
        };
        let at = &scene.arrived(hit, direction);
        let mut scattered = power.zero();
        let mut onward = guide.scatter(at, &power, &mut scattered, rng);
        let lobe = onward.map(|onward| onward.lobe);
        on(Event::Arrival { at, power: &power, scattered: &scattered, lobe });
        guide.arrive(at, interactions, &power, (&mut onward, &mut scattered), rng, &mut on);
        let Some(onward) = onward else { return };
        power = scattered;
        let total = onward.lobe == LobeKind::TotalReflection;
        total_reflections = if total { total_reflections + 1 } else { 0 };
        if total_reflections == MAX_TOTAL_REFLECTIONS {
            break;
        }
        ray = at.leave(onward.lobe, onward.direction);
    }
    on(Event::Lost(&power));
}

/// Draws how a photon goes on from a surface, by a BSDF sample and Russian roulette. The power that
/// it then carries is written to `scattered`, which stays unchanged if the photon ends here. The
/// chance to go on is the largest BSDF weight among the bands in which the photon still carries
/// power: a band without power keeps no photon alive. Power grows only where a weight is above 1.
#[inline(always)]
pub fn scatter<L: Lanes>(
    material: &Material,
    interaction: &Interaction,
    power: &Spectrum<L>,
    scattered: &mut Spectrum<L>,
    rng: &mut Stream,
) -> Option<Onward> {
    let (weight, direction, lobe) = match material {
        Material::Lambert(wall) => {
            let (weight, numbers) = wall.draw::<L>(rng)?;
            (weight, Direction::Numbers(numbers), LobeKind::DiffuseReflection)
        }
        _ => {
            let BsdfSample { direction, weight, lobe } =
                material.sample::<L>(interaction, Transport::Light, rng)?;
            (weight, Direction::Known(direction), lobe)
        }
    };
    let survival = weight.largest_within(power);
    *scattered = roulette(weight * power, survival, rng)?;
    let direction = match direction {
        Direction::Known(direction) => direction,
        Direction::Numbers(numbers) => Lambert::direction(interaction, numbers),
    };
    Some(Onward { direction, lobe })
}

/// The direction of a photon of which it is not yet known whether it goes on.
enum Direction {
    Known(Vec3),
    /// The numbers that determine how a Lambertian wall reflects. Such walls end most photons, and
    /// the directions of these are never computed.
    Numbers(Vec2),
}

/// Plays Russian roulette (Arvo and Kirk, "Particle Transport and Image Synthesis", SIGGRAPH 1990).
/// The path goes on with the chance `survival` (surely, from 1 on), and what it carries is then
/// divided by that chance, so that the mean stays the same. `None` if the path ends.
#[inline]
pub fn roulette<L: Lanes>(
    carried: Spectrum<L>,
    survival: f32,
    rng: &mut Stream,
) -> Option<Spectrum<L>> {
    if survival >= 1.0 {
        return Some(carried);
    }
    (rng.uniform() < survival).then(|| carried.map(|value| value / survival))
}
