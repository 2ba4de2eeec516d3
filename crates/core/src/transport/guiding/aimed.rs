//! Flights aimed at captors, which accompany a photon's own (DXTRAN: Booth, "Particle transport",
//! LANL 1985).
//!
//! Where a photon of power w is scattered, with f cos per solid angle, the aimed flight's direction
//! ω is drawn with the density p(ω) of [`Targets::choose`]. The photon's own flight takes ω with a
//! density of about q, the largest f cos of all bands. Both see the same captors, so each counts by
//! the balance heuristic (Veach 1997, ch. 9): the aimed flight w f cos / (p + q), the photon's own
//! q / (p + q) of what it carries. What no flight can be aimed at (p = 0) counts in full, and no
//! flight counts more than the photon carries. The weights add up to 1 for every ω, whatever stands
//! in the way, so the mean is right.
//!
//! Light from infinitely far away has its direction ω already. Its photon enters anywhere on a face
//! of area A, and the aimed flight enters where it will reach a captor. There p and q = 1 / (A cos)
//! are densities of places across ω, per m2.

use glam::Vec3;

use super::targets::{Facing, Seen, Targets, View};
use crate::{
    math::{
        geometry::Ray,
        rng::Stream,
        spectrum::{Lanes, Spectrum},
    },
    scene::{
        light::{Emission, EntryFace, Light, Start},
        material::{Interaction, LobeKind, Material, Scatterer},
        world::{Arrived, Crossing, Scene},
    },
    transport::trace::{Event, MAX_INTERACTIONS, MAX_TOTAL_REFLECTIONS, Onward, Turn, scatter},
};

/// Sends the aimed flights that accompany one photon.
pub struct Aimed<'a> {
    scene: &'a Scene,
    targets: &'a Targets,
    /// The photon's flight and the place where its direction was drawn; `None` where no flight
    /// could have been aimed in that direction.
    leg: Option<Leg<'a>>,
    /// The weight q / (p + q) of the photon's own crossings, once it has been computed.
    share: Option<f32>,
}

/// The photon's own flight, and the place where its direction was drawn.
struct Leg<'a> {
    from: Origin<'a>,
    /// What was learned of the captors when a flight was aimed from that place.
    seen: Seen,
    ray: Ray,
}

/// The place from which a photon leaves.
#[derive(Clone, Copy)]
enum Origin<'a> {
    /// A point of a light.
    Light(&'a Light, Start),
    /// A face by which light from infinitely far away enters, along a unit vector.
    Infinity(&'a EntryFace, Vec3),
    /// A point of a surface that scatters the photon diffusely.
    Surface { point: Vec3, offset: f32, material: &'a Material, interaction: Interaction },
}

impl<'a> Origin<'a> {
    /// Takes the place where a photon has arrived.
    fn surface(arrived: &Arrived<'a>) -> Self {
        let Arrived { hit, surface, material, interaction } = *arrived;
        let (point, offset) = (hit.point, surface.offset_at(hit.point));
        Self::Surface { point, offset, material, interaction }
    }

    /// Takes the place where a photon was emitted; `None` for a dark light at infinity.
    fn of<L>(scene: &'a Scene, emission: &Emission<'_, L>) -> Option<Self> {
        let light = &scene.lights()[emission.light];
        match emission.start {
            Some(start) => Some(Self::Light(light, start)),
            None => {
                let face = light.entrance()?.face(emission.face)?;
                Some(Self::Infinity(face, emission.ray.direction))
            }
        }
    }

    fn view(&self) -> View {
        match self {
            Self::Light(_, start) if start.both_sides => View::Point(start.point, Facing::Anywhere),
            Self::Light(_, start) => View::Point(start.point, Facing::Front(start.normal)),
            Self::Infinity(_, direction) => View::Beam(*direction),
            Self::Surface { point, material, interaction, .. } => {
                let facing = match material.transmits_diffusely() {
                    true => Facing::Both(interaction.normal),
                    false => Facing::Front(interaction.normal),
                };
                View::Point(*point, facing)
            }
        }
    }

    /// Draws a ray from here to a captor. Returns with it what was learned of the captors that are
    /// seen from here.
    fn aim(&self, targets: &Targets, rng: &mut Stream) -> (Option<Ray>, Seen) {
        let chosen = targets.choose(self.view(), rng);
        let from = |origin: Vec3| Some(Ray { origin, direction: chosen.to? });
        let ray = match *self {
            Self::Light(_, start) => from(start.point),
            Self::Surface { point, .. } => from(point),
            Self::Infinity(face, direction) => {
                chosen.to.and_then(|through| face.entering(through, direction))
            }
        };
        (ray.filter(|ray| targets.is_sent(&chosen, ray)), chosen.seen)
    }

    /// Returns the same ray, moved off the surface on which it starts.
    fn off(&self, ray: Ray) -> Ray {
        let (side, offset) = match self {
            Self::Light(_, start) => (start.normal, start.offset),
            Self::Surface { interaction, offset, .. } => (interaction.normal, *offset),
            Self::Infinity(..) => return ray,
        };
        let offset = if ray.direction.dot(side) < 0.0 { -offset } else { offset };
        Ray { origin: ray.origin + offset * side, ..ray }
    }

    /// Returns the part of the power that leaves along a ray, per band: per solid angle, 1/sr, or
    /// for light at infinity per area across the ray, 1/m2.
    fn leaves<L: Lanes>(&self, lanes: usize, direction: Vec3) -> Spectrum<L> {
        match self {
            Self::Light(light, start) => Spectrum::splat(lanes, light.density(start, direction)),
            Self::Infinity(face, _) => Spectrum::splat(lanes, face.area_across(direction).recip()),
            Self::Surface { material, interaction, .. } => {
                let f: Spectrum<L> = material.evaluate(interaction, direction);
                f.scaled(direction.dot(interaction.normal).abs())
            }
        }
    }
}

impl<'a> Aimed<'a> {
    /// Starts beside a photon that no flight accompanies yet.
    pub fn new(scene: &'a Scene, targets: &'a Targets) -> Self {
        Self { scene, targets, leg: None, share: None }
    }

    /// Sends the first flight beside a `photon` as it is emitted. The flight leaves from an
    /// emission without guiding: from `other` or, if the photon itself was emitted without guiding,
    /// from the photon.
    pub fn start<L: Lanes>(
        &mut self,
        photon: &Emission<'_, L>,
        other: Option<&Emission<'_, L>>,
        rng: &mut Stream,
        on: &mut impl FnMut(Event<'_, L>),
    ) {
        let free = other.unwrap_or(photon);
        let Some(from) = Origin::of(self.scene, free) else { return };
        let seen = self.send(&from, &free.power, rng, on);
        let place = |emission: &Emission<'_, L>| emission.start.map(|start| start.point);
        let same = other.is_none() || free.start.is_some() && place(free) == place(photon);
        let seen = if same { seen } else { Seen::default() };
        let origin = photon.start.map_or(photon.ray.origin, |start| start.point);
        let ray = Ray { origin, ..photon.ray };
        self.leg = Origin::of(self.scene, photon).map(|from| Leg { from, seen, ray });
    }

    /// Sends a flight from a place where the photon has `power`. Returns what was learned of the
    /// captors seen from there.
    #[inline(never)]
    fn send<L: Lanes>(
        &self,
        from: &Origin<'_>,
        power: &Spectrum<L>,
        rng: &mut Stream,
        on: &mut impl FnMut(Event<'_, L>),
    ) -> Seen {
        let (ray, seen) = from.aim(self.targets, rng);
        let Some(ray) = ray else { return seen };
        let leaves: Spectrum<L> = from.leaves(self.scene.lanes(), ray.direction);
        let own = leaves.largest();
        let carried = leaves * power;
        if carried.is_zero() {
            return seen;
        }
        let density = self.targets.density(from.view(), &ray, seen);
        // rounding has made the flight miss what it was aimed at
        if density == 0.0 {
            return seen;
        }
        if let Origin::Surface { interaction, .. } = from {
            let crosses = ray.direction.dot(interaction.normal) < 0.0;
            on(Event::Turn(Turn::Aimed { crosses }));
        }
        let ray = from.off(ray);
        self.fly(ray, carried.scaled(1.0 / (density + own)), rng, on);
        seen
    }

    /// Follows an aimed flight to the next diffuse surface, where it ends.
    fn fly<L: Lanes>(
        &self,
        mut ray: Ray,
        mut power: Spectrum<L>,
        rng: &mut Stream,
        on: &mut impl FnMut(Event<'_, L>),
    ) {
        let scene = self.scene;
        if !(self.targets.passes_surfaces || self.targets.are_surfaces) {
            let (direction, power) = (ray.direction, &power);
            scene.glance(&ray, |crossing| {
                on(Event::Crossing { crossing, direction, power, carried: None });
            });
            return on(Event::FlightBeside);
        }
        let mut total_reflections = 0;
        for _ in 0..MAX_INTERACTIONS {
            let direction = ray.direction;
            let hit = scene.meet(&ray, |crossing| {
                on(Event::Crossing { crossing, direction, power: &power, carried: None });
            });
            on(Event::FlightBeside);
            let Some(hit) = hit else { return };
            let at = scene.arrived(hit, direction);
            if self.targets.are_surfaces {
                on(Event::ArrivalBeside { at: &at, power: &power });
            }
            if at.material.is_diffuse() {
                return;
            }
            let mut scattered = power.zero();
            let onward = scatter(at.material, &at.interaction, &power, &mut scattered, rng);
            let Some(onward) = onward else { return };
            power = scattered;
            let (material, lobe) = (at.surface.material, onward.lobe);
            on(Event::Turn(Turn::SentOn { hit, material, at: at.interaction, lobe }));
            total_reflections =
                if onward.lobe == LobeKind::TotalReflection { total_reflections + 1 } else { 0 };
            if total_reflections == MAX_TOTAL_REFLECTIONS {
                return;
            }
            ray = at.leave(onward.lobe, onward.direction);
        }
    }

    /// Returns the weight q / (p + q) with which the photon itself counts where it now comes to a
    /// captor at which flights are aimed.
    pub fn share<L: Lanes>(&mut self) -> f32 {
        let share = self.share.unwrap_or_else(|| self.own_share::<L>());
        self.share = Some(share);
        share
    }

    #[inline(never)]
    fn own_share<L: Lanes>(&self) -> f32 {
        let Some(Leg { from, seen, ray }) = &self.leg else { return 1.0 };
        let aimed = self.targets.density(from.view(), ray, *seen);
        if aimed == 0.0 {
            return 1.0;
        }
        let leaves: Spectrum<L> = from.leaves(self.scene.lanes(), ray.direction);
        let own = leaves.largest();
        own / (aimed + own)
    }

    /// Passes a crossing of the photon to `on`, with the power that it counts.
    #[inline]
    pub fn cross<L: Lanes>(
        &mut self,
        crossing: Crossing,
        direction: Vec3,
        power: &Spectrum<L>,
        on: &mut impl FnMut(Event<'_, L>),
    ) {
        let share = self.share::<L>();
        let counts = power.clone().scaled(share);
        on(Event::Crossing { crossing, direction, power: &counts, carried: Some(power) });
    }

    /// Sends a flight from a diffuse surface to which the photon has brought `power`. Returns what
    /// was learned of the captors seen from there.
    #[inline]
    pub fn arrive<L: Lanes>(
        &mut self,
        arrived: &Arrived<'a>,
        power: &Spectrum<L>,
        rng: &mut Stream,
        on: &mut impl FnMut(Event<'_, L>),
    ) -> Seen {
        self.send(&Origin::surface(arrived), power, rng, on)
    }

    /// Takes in how the photon leaves the surface; `None`: the photon ends there.
    #[inline]
    pub fn leave(&mut self, arrived: &Arrived<'a>, seen: Seen, onward: Option<Onward>) {
        self.share = None;
        // no aimed flight is sent in a mirrored direction
        let drawn = onward.filter(|onward| onward.lobe.is_diffuse());
        let from = Origin::surface(arrived);
        let ray = |direction: Vec3| Ray { origin: arrived.hit.point, direction };
        self.leg = drawn.map(|onward| Leg { from, seen, ray: ray(onward.direction) });
    }
}
