//! Flights aimed at captors, beside a photon's own (DXTRAN: Booth, "Particle transport", LANL 1985).
//!
//! Origin a point with a photon of power w that scatters f cos per solid angle, a direction ω is drawn with the density
//! p(ω) of [`Targets::choose`]. The photon's own flight takes it with a density of about q = max f cos over the bands.
//! Both see the same captors, so each counts by the balance heuristic (Veach 1997, ch. 9): the aimed flight
//! w f cos / (p + q), the photon's own q / (p + q) of what it carries. What no flight can be aimed at (p = 0) counts
//! in full, and no flight counts more than the photon carries. The weights add up to 1 for every ω,
//! whatever stands in the way, so the mean is right.

use glam::Vec3;

use super::targets::{Facing, Seen, Targets};
use crate::{
    math::{
        geometry::Ray,
        rng::Stream,
        spectrum::{Lanes, Spectrum},
    },
    scene::{
        light::{Light, Start},
        material::{BsdfSample, Interaction, LobeKind, Material},
        world::{Crossing, Scene},
    },
    transport::trace::{Arrived, Event, MAX_INTERACTIONS, MAX_TOTAL_REFLECTIONS, leave, scatter},
};

/// Sends aimed flights beside one photon.
pub struct Aimed<'a> {
    scene: &'a Scene,
    targets: &'a Targets,
    /// Where the photon's direction was drawn; none where no flight could have been aimed that way.
    leg: Option<Leg<'a>>,
    /// The share that the photon's own crossings count, once one was asked for.
    share: Option<f32>,
}

/// A direction of the photon and where it was drawn.
struct Leg<'a> {
    from: Origin<'a>,
    /// What was seen from there.
    seen: Seen,
    direction: Vec3,
}

/// Where a photon leaves.
#[derive(Clone, Copy)]
enum Origin<'a> {
    /// A place on a light.
    Light(&'a Light, Start),
    /// A point of a surface that scatters it diffusely.
    Surface { point: Vec3, material: &'a Material, interaction: Interaction, photons: f32 },
}

impl<'a> Origin<'a> {
    /// Where a photon has arrived, and so many go on for one without a guide.
    fn surface(arrived: &Arrived<'_, 'a>, photons: f32) -> Self {
        let Arrived { hit, material, interaction, .. } = *arrived;
        Self::Surface { point: hit.point, material, interaction: *interaction, photons }
    }

    fn point(&self) -> Vec3 {
        match self {
            Self::Light(_, start) => start.point,
            Self::Surface { point, .. } => *point,
        }
    }

    fn facing(&self) -> Facing {
        match self {
            Self::Light(_, start) if start.both_sides => Facing::Anywhere,
            Self::Light(_, start) => Facing::Front(start.normal),
            Self::Surface { material, interaction, .. } => match material.transmits_diffusely() {
                true => Facing::Both(interaction.normal),
                false => Facing::Front(interaction.normal),
            },
        }
    }

    /// The part of the power that leaves along a unit vector per solid angle, per band, 1/sr.
    fn leaves<L: Lanes>(&self, lanes: usize, direction: Vec3) -> Spectrum<L> {
        match self {
            Self::Light(light, start) => Spectrum::splat(lanes, light.density(start, direction)),
            Self::Surface { material, interaction, .. } => {
                let f: Spectrum<L> = material.evaluate(interaction, direction);
                f.scaled(direction.dot(interaction.normal).abs())
            }
        }
    }

    /// About the density with which photons go on along a direction into which so much leaves, 1/sr.
    fn own<L: Lanes>(&self, leaves: &Spectrum<L>) -> f32 {
        match self {
            Self::Light(..) => leaves.largest(),
            Self::Surface { photons, .. } => photons * leaves.largest(),
        }
    }
}

impl<'a> Aimed<'a> {
    /// Beside a photon that leaves a light from a place, if that is known, along `ray`; sends the first flight, from the
    /// place and with the power of a photon that was emitted without a guide, which may be the same.
    pub fn start<L: Lanes>(
        scene: &'a Scene,
        targets: &'a Targets,
        (light, start): (&'a Light, Option<Start>),
        direction: Vec3,
        (free, power): (Option<Start>, &Spectrum<L>),
        rng: &mut Stream,
        on: &mut impl FnMut(Event<'_, L>),
    ) -> Self {
        let mut aimed = Self { scene, targets, leg: None, share: None };
        let (Some(start), Some(free)) = (start, free) else { return aimed };
        let seen = aimed.send(&Origin::Light(light, free), power, rng, on);
        let seen = if free.point == start.point { seen } else { Seen::default() };
        aimed.leg = Some(Leg { from: Origin::Light(light, start), seen, direction });
        aimed
    }

    /// Sends a flight from a point where the photon has `power`, and says what it saw there.
    #[inline(never)]
    fn send<L: Lanes>(
        &self,
        from: &Origin<'_>,
        power: &Spectrum<L>,
        rng: &mut Stream,
        on: &mut impl FnMut(Event<'_, L>),
    ) -> Seen {
        let (point, facing) = (from.point(), from.facing());
        let (direction, seen) = self.targets.choose(point, facing, rng);
        let Some(direction) = direction else { return seen };
        let leaves: Spectrum<L> = from.leaves(self.scene.lanes(), direction);
        let own = from.own(&leaves);
        let carried = leaves * power;
        if carried.is_zero() {
            return seen;
        }
        let density = self.targets.density(point, facing, direction, seen);
        let side = match from {
            Origin::Light(_, start) => start.normal,
            Origin::Surface { interaction, .. } => interaction.normal,
        };
        let side = if direction.dot(side) < 0.0 { -side } else { side };
        let ray = self.scene.leave(point, side, direction);
        self.fly(ray, carried.scaled(1.0 / (density + own)), rng, on);
        seen
    }

    /// Follows a flight to the next diffuse surface.
    fn fly<L: Lanes>(
        &self,
        mut ray: Ray,
        mut power: Spectrum<L>,
        rng: &mut Stream,
        on: &mut impl FnMut(Event<'_, L>),
    ) {
        let scene = self.scene;
        if !self.targets.passes_surfaces {
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
            let surface = scene.surface(hit.triangle);
            let material = scene.material(surface);
            if material.is_diffuse() {
                return;
            }
            let interaction = Interaction::new(direction, surface.normal).on(hit.triangle);
            let mut scattered = power.zero();
            let sample = scatter(material, &interaction, &power, &mut scattered, rng);
            let Some(sample) = sample else { return };
            power = scattered;
            total_reflections =
                if sample.lobe == LobeKind::TotalReflection { total_reflections + 1 } else { 0 };
            if total_reflections == MAX_TOTAL_REFLECTIONS {
                return;
            }
            ray = leave(scene, &hit, &interaction, &sample);
        }
    }

    /// The share that the photon's own crossings count.
    #[inline(never)]
    fn own_share<L: Lanes>(&self) -> f32 {
        let Some(Leg { from, seen, direction }) = &self.leg else { return 1.0 };
        let aimed = self.targets.density(from.point(), from.facing(), *direction, *seen);
        if aimed == 0.0 {
            return 1.0;
        }
        let leaves: Spectrum<L> = from.leaves(self.scene.lanes(), *direction);
        let own = from.own(&leaves);
        own / (aimed + own)
    }

    /// Tells `on` that the photon crosses a captor.
    #[inline]
    pub fn cross<L: Lanes>(
        &mut self,
        crossing: Crossing,
        direction: Vec3,
        power: &Spectrum<L>,
        on: &mut impl FnMut(Event<'_, L>),
    ) {
        let share = self.share.unwrap_or_else(|| self.own_share::<L>());
        self.share = Some(share);
        let counts = power.clone().scaled(share);
        on(Event::Crossing { crossing, direction, power: &counts, carried: Some(power) });
    }

    /// Sends a flight from a diffuse surface that the photon has brought `power` to, and says what it saw there.
    /// `photons`: how many go on for one without a guide.
    #[inline]
    pub fn arrive<L: Lanes>(
        &mut self,
        arrived: &Arrived<'_, 'a>,
        photons: f32,
        power: &Spectrum<L>,
        rng: &mut Stream,
        on: &mut impl FnMut(Event<'_, L>),
    ) -> Seen {
        self.send(&Origin::surface(arrived, photons), power, rng, on)
    }

    /// From now on the photon is the one that leaves such a surface as `sample` says, if it does.
    #[inline]
    pub fn leave<L: Lanes>(
        &mut self,
        arrived: &Arrived<'_, 'a>,
        photons: f32,
        seen: Seen,
        sample: Option<&BsdfSample<L>>,
    ) {
        self.share = None;
        // a mirrored one of such a surface no aimed flight follows
        let drawn = sample.filter(|sample| sample.lobe.is_diffuse());
        let from = Origin::surface(arrived, photons);
        self.leg = drawn.map(|sample| Leg { from, seen, direction: sample.direction });
    }
}
