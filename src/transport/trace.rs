//! The hot loop: follow one photon from its light to its end.

#[cfg(test)]
mod tests;

use glam::Vec3;

use crate::{
    math::{geometry::Ray, rng::Stream, spectrum::Spectrum},
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
pub enum Event<'a, const N: usize> {
    /// It crosses a virtual captor, in one of the flights that it is split into.
    Crossing {
        /// Where, and which.
        crossing: Crossing,
        /// The way it travels.
        direction: Vec3,
        /// What it carries, shared among these flights.
        power: &'a Spectrum<N>,
    },
    /// It arrives at a surface; what it does not carry on is absorbed there.
    Arrival {
        /// Where, and which triangle.
        hit: &'a SurfaceHit,
        /// That triangle.
        surface: &'a Surface,
        /// How it comes.
        interaction: &'a Interaction,
        /// What it brings.
        power: &'a Spectrum<N>,
        /// What it carries on.
        scattered: &'a Spectrum<N>,
        /// How it goes on, if it does.
        lobe: Option<LobeKind>,
    },
    /// It leaves the scene.
    Escaped {
        /// What it carries.
        power: &'a Spectrum<N>,
        /// Whether it has met no surface.
        missed: bool,
    },
    /// Its path is longer than the limits allow.
    Lost(&'a Spectrum<N>),
}

/// What an event counts for at a captor.
pub struct Counted<'e, const N: usize> {
    /// The captor.
    pub captor: &'e Captor,
    /// The face that it comes to.
    pub face: Channel,
    /// What it brings.
    pub power: &'e Spectrum<N>,
}

impl<const N: usize> Counted<'_, N> {
    /// Index of the face's channel.
    pub fn channel(&self) -> usize {
        self.captor.first_channel + self.face as usize
    }
}

impl<const N: usize> Event<'_, N> {
    /// Where it counts; nowhere off captors, and behind captors of one side.
    #[inline]
    pub fn counted<'e>(&'e self, scene: &'e Scene) -> Option<Counted<'e, N>> {
        let (captor, front, power) = match *self {
            Self::Crossing { crossing, power, .. } => (crossing.captor, crossing.front, power),
            Self::Arrival { surface, interaction, power, .. } => {
                (surface.captor()?, interaction.front, power)
            }
            Self::Escaped { .. } | Self::Lost(_) => return None,
        };
        let captor = &scene.captors[captor];
        let face = if front { Channel::Front } else { Channel::Back };
        (front || captor.kind.has_back()).then_some(Counted { captor, face, power })
    }
}

/// Follows a photon along `ray`, one of `flights` that start there, and tells `on` what happens. Where it
/// arrives it is split into as many.
#[inline]
pub fn trace<const N: usize>(
    scene: &Scene,
    mut ray: Ray,
    mut power: Spectrum<N>,
    flights: usize,
    rng: &mut Stream,
    mut on: impl FnMut(Event<'_, N>),
) {
    let share = 1.0 / flights as f32;
    let mut total_reflections = 0;
    for interactions in 0..MAX_INTERACTIONS {
        let direction = ray.direction;
        let shared = &power.scaled(share);
        let hit =
            scene.meet(&ray, |crossing| on(Event::Crossing { crossing, direction, power: shared }));
        let Some(hit) = &hit else {
            return on(Event::Escaped { power: &power, missed: interactions == 0 });
        };
        let surface = scene.surface(hit.triangle);
        let interaction = &Interaction::new(direction, surface.normal);
        let onward = scatter(scene.material(surface), interaction, &power, rng);
        let scattered = &onward.map_or(Spectrum::ZERO, |(_, power)| power);
        let lobe = onward.map(|(sample, _)| sample.lobe);
        on(Event::Arrival { hit, surface, interaction, power: &power, scattered, lobe });

        if flights > 1 {
            split_at_surface(scene, hit, interaction, shared, flights, rng, &mut on);
        }
        let Some((sample, scattered)) = onward else { return };
        power = scattered;
        total_reflections = if sample.total_reflection { total_reflections + 1 } else { 0 };
        if total_reflections == MAX_TOTAL_REFLECTIONS {
            break;
        }
        ray = leave(scene, hit, interaction, &sample);
    }
    on(Event::Lost(&power));
}

/// How a photon goes on from a surface, and with what. The largest weight among the bands that it still carries is
/// its chance to go on: a band without power keeps no photon alive, and none grows but by a weight above 1.
#[inline(always)]
fn scatter<const N: usize>(
    material: &Material,
    interaction: &Interaction,
    power: &Spectrum<N>,
    rng: &mut Stream,
) -> Option<(BsdfSample<N>, Spectrum<N>)> {
    let sample = material.sample::<N>(interaction, Transport::Light, rng)?;
    let survival = sample.weight.largest_within(power);
    Some((sample, roulette(*power * sample.weight, survival, rng)?))
}

/// Russian roulette (Arvo and Kirk, "Particle Transport and Image Synthesis", SIGGRAPH 1990): with the chance
/// `survival`, which is certain from 1 on, a path goes on, and what it carries is divided by it; so the mean stays.
#[inline]
pub fn roulette<const N: usize>(
    carried: Spectrum<N>,
    survival: f32,
    rng: &mut Stream,
) -> Option<Spectrum<N>> {
    if survival >= 1.0 {
        return Some(carried);
    }
    (rng.uniform() < survival).then(|| Spectrum(carried.0.map(|value| value / survival)))
}

/// Splits a photon that leaves its light into so many flights, each as `emit` has it, and tells `on` which virtual
/// captors it crosses in all but the one to follow (Arvo
/// and Kirk 1990). Each is as likely as that one: their mean is right on average, and
/// varies less.
#[cold]
#[inline(never)]
pub fn split_at_light<const N: usize>(
    scene: &Scene,
    emit: impl Fn(&mut Stream) -> (Ray, Spectrum<N>),
    flights: usize,
    rng: &mut Stream,
    mut on: impl FnMut(Event<'_, N>),
) {
    let share = 1.0 / flights as f32;
    for _ in 1..flights {
        let (ray, power) = emit(rng);
        glance(scene, &ray, &power.scaled(share), &mut on);
    }
}

/// The same where it arrives; `shared` is what each flight brings there.
#[cold]
#[inline(never)]
fn split_at_surface<const N: usize>(
    scene: &Scene,
    hit: &SurfaceHit,
    interaction: &Interaction,
    shared: &Spectrum<N>,
    flights: usize,
    rng: &mut Stream,
    mut on: impl FnMut(Event<'_, N>),
) {
    let material = scene.material(scene.surface(hit.triangle));
    for _ in 1..flights {
        if let Some((sample, power)) = scatter(material, interaction, shared, rng) {
            let ray = leave(scene, hit, interaction, &sample);
            glance(scene, &ray, &power, &mut on);
        }
    }
}

/// Tells `on` which virtual captors a photon crosses in a flight that is not followed further.
#[inline]
fn glance<const N: usize>(
    scene: &Scene,
    ray: &Ray,
    power: &Spectrum<N>,
    mut on: impl FnMut(Event<'_, N>),
) {
    let direction = ray.direction;
    scene.glance(ray, |crossing| on(Event::Crossing { crossing, direction, power }));
}

/// The ray of a photon that goes on.
#[inline]
fn leave<const N: usize>(
    scene: &Scene,
    hit: &SurfaceHit,
    interaction: &Interaction,
    sample: &BsdfSample<N>,
) -> Ray {
    let side = if sample.crosses { -interaction.normal } else { interaction.normal };
    scene.leave(hit.point, side, sample.direction)
}
