//! The hot loop: follow one photon from its light to its end.

#[cfg(test)]
mod tests;

use glam::Vec3;

use crate::{
    math::{
        geometry::Ray,
        rng::Stream,
        spectrum::{Lanes, Spectrum},
    },
    scene::{
        captor::{Captor, Channel},
        material::{BsdfSample, Interaction, LobeKind, Material, Transport},
        world::{Crossing, Scene, Surface, SurfaceHit},
    },
};

/// Interactions after which a path is given up as lost.
pub const MAX_INTERACTIONS: u32 = 10_000;
/// Total internal reflections in a row after which it is given up as lost.
pub const MAX_TOTAL_REFLECTIONS: u32 = 1_000;

/// What happens to a photon. Its power is a fraction of what it was emitted with, per band.
#[derive(Debug)]
pub enum Event<'a, L> {
    /// It crosses a virtual captor, or a flight that is sent out beside it does.
    Crossing {
        /// Where, and which.
        crossing: Crossing,
        /// The way it travels.
        direction: Vec3,
        /// What that counts.
        power: &'a Spectrum<L>,
        /// What the photon itself carries; none of a flight beside it.
        carried: Option<&'a Spectrum<L>>,
    },
    /// A straight flight beside it ends.
    FlightBeside,
    /// It arrives at a surface; what it does not carry on is absorbed there.
    Arrival {
        /// Where, and which triangle.
        hit: &'a SurfaceHit,
        /// That triangle.
        surface: &'a Surface,
        /// How it comes.
        interaction: &'a Interaction,
        /// What it brings.
        power: &'a Spectrum<L>,
        /// What it carries on.
        scattered: &'a Spectrum<L>,
        /// How it goes on, if it does.
        lobe: Option<LobeKind>,
    },
    /// It goes on as several, or not, by a game of chance that counts in no other event.
    Chance {
        /// What would have gone on without the game.
        before: &'a Spectrum<L>,
        /// What goes on.
        after: &'a Spectrum<L>,
    },
    /// It leaves the scene.
    Escaped {
        /// What it carries.
        power: &'a Spectrum<L>,
        /// Whether it has met no surface.
        missed: bool,
    },
    /// Its path is longer than the limits allow.
    Lost(&'a Spectrum<L>),
}

/// What an event counts for at a captor.
pub struct Counted<'e, L> {
    /// The captor.
    pub captor: &'e Captor,
    /// The face that it comes to.
    pub face: Channel,
    /// What it brings.
    pub power: &'e Spectrum<L>,
}

impl<L: Lanes> Counted<'_, L> {
    /// Index of the face's channel.
    pub fn channel(&self) -> usize {
        self.captor.first_channel + self.face as usize
    }
}

impl<L: Lanes> Event<'_, L> {
    /// Cosine of the angle at which it comes to a surface or captor; 1 elsewhere.
    pub fn cosine(&self, scene: &Scene) -> f32 {
        match *self {
            Self::Crossing { crossing, direction, .. } => {
                let triangle = &scene.captor_triangles()[crossing.triangle];
                triangle.normal().dot(direction).abs()
            }
            Self::Arrival { interaction, .. } => interaction.cos,
            Self::FlightBeside | Self::Chance { .. } | Self::Escaped { .. } | Self::Lost(_) => 1.0,
        }
    }

    /// Where it counts; nowhere off captors, and behind captors of one side.
    #[inline]
    pub fn counted<'e>(&'e self, scene: &'e Scene) -> Option<Counted<'e, L>> {
        let (captor, front, power) = match *self {
            Self::Crossing { crossing, power, .. } => (crossing.captor, crossing.front, power),
            Self::Arrival { surface, interaction, power, .. } => {
                (surface.captor()?, interaction.front, power)
            }
            Self::FlightBeside | Self::Chance { .. } | Self::Escaped { .. } | Self::Lost(_) => {
                return None;
            }
        };
        let captor = &scene.captors[captor];
        let face = if front { Channel::Front } else { Channel::Back };
        (front || captor.kind.has_back()).then_some(Counted { captor, face, power })
    }
}

/// What helps photons to captors that they hardly reach, or ends them early; `()` is nothing, and costs nothing.
pub trait Guide<'s, L: Lanes> {
    /// Tells `on` that the photon crosses a virtual captor.
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

    /// How the photon goes on from a surface, as far as the surface decides; what it carries then is `scattered`.
    #[inline(always)]
    fn scatter(
        &mut self,
        arrived: &Arrived<'_, 's>,
        power: &Spectrum<L>,
        scattered: &mut Spectrum<L>,
        rng: &mut Stream,
    ) -> Option<BsdfSample<L>> {
        scatter(arrived.material, arrived.interaction, power, scattered, rng)
    }

    /// The photon has brought `power` to a surface; how it goes `onward`, and with what, may be changed.
    #[inline(always)]
    fn arrive(
        &mut self,
        _arrived: &Arrived<'_, 's>,
        _power: &Spectrum<L>,
        _onward: (&mut Option<BsdfSample<L>>, &mut Spectrum<L>),
        _rng: &mut Stream,
        _on: &mut impl FnMut(Event<'_, L>),
    ) {
    }

    /// A copy of the photon that is still to be followed, once the one before it has ended.
    #[inline(always)]
    fn next(&mut self, _rng: &mut Stream, _on: &mut impl FnMut(Event<'_, L>)) -> Option<Flight<L>> {
        None
    }
}

impl<L: Lanes> Guide<'_, L> for () {}

/// Ends photons where a surface without a glossy lobe has scattered them diffusely.
pub struct UntilDiffused;

impl<'s, L: Lanes> Guide<'s, L> for UntilDiffused {
    #[inline(always)]
    fn scatter(
        &mut self,
        arrived: &Arrived<'_, 's>,
        power: &Spectrum<L>,
        scattered: &mut Spectrum<L>,
        rng: &mut Stream,
    ) -> Option<BsdfSample<L>> {
        scatter(arrived.material, arrived.interaction, power, scattered, rng)
            .filter(|sample| !sample.lobe.is_diffuse() || arrived.material.glossy() > 0.0)
    }
}

/// A photon that leaves a light or a surface.
pub struct Flight<L> {
    /// Where it starts, and which way.
    pub ray: Ray,
    /// What it carries.
    pub power: Spectrum<L>,
    /// Its interactions so far.
    pub interactions: u32,
}

/// Where a photon has arrived.
#[derive(Clone, Copy)]
pub struct Arrived<'h, 's> {
    /// Where, and which triangle.
    pub hit: &'h SurfaceHit,
    /// That triangle.
    pub surface: &'s Surface,
    /// The material there.
    pub material: &'s Material,
    /// How it comes.
    pub interaction: &'h Interaction,
    /// Its interactions before.
    pub interactions: u32,
}

/// Follows a photon along `ray`, and its copies if a guide makes any, and tells `on` what happens to them, and to what
/// is sent out beside them.
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
            return on(Event::Escaped { power: &power, missed: interactions == 0 });
        };
        let surface = scene.surface(hit.triangle);
        let material = scene.material(surface);
        let interaction = Interaction::new(direction, surface.normal).on(hit.triangle);
        let (hit, interaction) = (&hit, &interaction);
        let arrived = Arrived { hit, surface, material, interaction, interactions };
        let mut scattered = power.zero();
        let mut onward = guide.scatter(&arrived, &power, &mut scattered, rng);
        let lobe = onward.as_ref().map(|sample| sample.lobe);
        on(Event::Arrival {
            hit,
            surface,
            interaction,
            power: &power,
            scattered: &scattered,
            lobe,
        });

        guide.arrive(&arrived, &power, (&mut onward, &mut scattered), rng, &mut on);
        let Some(sample) = onward else { return };
        power = scattered;
        let total = sample.lobe == LobeKind::TotalReflection;
        total_reflections = if total { total_reflections + 1 } else { 0 };
        if total_reflections == MAX_TOTAL_REFLECTIONS {
            break;
        }
        ray = leave(scene, hit, interaction, &sample);
    }
    on(Event::Lost(&power));
}

/// How a photon goes on from a surface; what it carries then is `scattered`, as it was where it ends here. The largest
/// weight among the bands that it still carries is its chance to go on: a band without power keeps no photon alive,
/// and none grows but by a weight above 1.
#[inline(always)]
pub fn scatter<L: Lanes>(
    material: &Material,
    interaction: &Interaction,
    power: &Spectrum<L>,
    scattered: &mut Spectrum<L>,
    rng: &mut Stream,
) -> Option<BsdfSample<L>> {
    let mut onward = material.sample::<L>(interaction, Transport::Light, rng);
    if let Some(sample) = &onward {
        let survival = sample.weight.largest_within(power);
        match roulette(sample.weight.clone() * power, survival, rng) {
            Some(carried) => *scattered = carried,
            None => onward = None,
        }
    }
    onward
}

/// Russian roulette (Arvo and Kirk, "Particle Transport and Image Synthesis", SIGGRAPH 1990): with the chance
/// `survival`, which is certain from 1 on, a path goes on, and what it carries is divided by it; so the mean stays.
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

/// The ray of a photon that goes on.
#[inline]
pub fn leave<L: Lanes>(
    scene: &Scene,
    hit: &SurfaceHit,
    interaction: &Interaction,
    sample: &BsdfSample<L>,
) -> Ray {
    let side = if sample.lobe.crosses() { -interaction.normal } else { interaction.normal };
    scene.leave(hit.point, side, sample.direction)
}
