//! How a path goes on: from surface to surface, joined with a light at each that is diffuse, until it
//! leaves the scene or little of it is left.

use glam::Vec3;

use super::{
    Aim, LEAST, Leg, Path,
    course::{self, Lit},
    vertex::{Arrival, Vertex},
};
use crate::{
    math::{
        geometry::Ray,
        spectrum::{Lanes, Spectrum},
    },
    scene::{
        material::{LobeKind, Scatterer, Transport},
        world::{Arrived, SurfaceHit},
    },
    transport::{
        met::Along,
        trace::{MAX_INTERACTIONS, MAX_TOTAL_REFLECTIONS, roulette},
    },
};

/// A path on its way, and the light that it has found.
struct Walk<L> {
    leg: Leg,
    radiance: Spectrum<L>,
    throughput: Spectrum<L>,
    /// The fraction that surfaces have left of the path; the weights of its choices of direction do
    /// not end it.
    kept: f32,
    /// The number of total reflections in a row.
    total_reflections: u32,
}

/// What becomes of a path at a surface.
enum Fate {
    Goes,
    Ends,
    /// It is caught in a solid, and given up.
    CutOff,
}

/// Returns the fraction, 1/sr, of light from a direction that a surface sends back along the path, times
/// the cosine there.
fn scattered<L: Lanes>(at: &Arrived, towards: Vec3) -> Spectrum<L> {
    let arriving = at.along(-towards);
    let f: Spectrum<L> = at.material.evaluate(&arriving, -at.interaction.direction);
    f.scaled(arriving.cos)
}

impl Path<'_, '_> {
    /// Follows a path along `leg` and returns an estimate of the radiance that arrives by it,
    /// without the part that next-event estimation at the beginning of the leg counts. For an aimed
    /// leg, it returns the part of the radiance that aiming counts, divided by the density of the
    /// direction. It keeps `account` of the parameters that it meets.
    pub(super) fn follow<L: Lanes>(
        &mut self,
        leg: Leg,
        account: &mut impl Along<L>,
    ) -> Spectrum<L> {
        let scene = self.scene;
        let [radiance, throughput] = [0.0, 1.0].map(|value| Spectrum::splat(scene.lanes(), value));
        let mut walk = Walk { leg, radiance, throughput, kept: 1.0, total_reflections: 0 };
        for _ in 0..MAX_INTERACTIONS {
            self.rays += 1;
            let hit = scene.closest(&walk.leg.ray);
            if walk.leg.aimed.is_none() {
                self.meet_lights(&mut walk, hit.as_ref(), account);
            }
            let Some(hit) = hit else {
                self.cut_off = scene.is_endless(&walk.leg.ray) && self.rng.uniform() < walk.kept;
                return walk.radiance;
            };
            let at = scene.arrived(hit, walk.leg.ray.direction);
            match self.arrival_weight(&walk.leg, &hit, at.interaction.cos) {
                Some(weight) => walk.throughput *= weight,
                None => return walk.radiance,
            }
            let here = self.vertex::<L>(&walk.leg, &at);
            let aim = match at.material.is_diffuse() {
                true => self.join(&mut walk, &here, &at, account),
                false => Aim::Free,
            };
            let fate = match aim {
                Aim::Nowhere => Fate::Ends,
                Aim::At(triangle, target) => {
                    self.go_towards(&mut walk, here, &at, (triangle, target), account)
                }
                Aim::Free => self.go_freely(&mut walk, here, &at, account),
            };
            match fate {
                Fate::CutOff => break,
                Fate::Goes if !walk.throughput.is_zero() => {}
                _ => return walk.radiance,
            }
        }
        // a path of which surfaces have left only a part counts as cut off with that probability
        self.cut_off = self.rng.uniform() < walk.kept;
        walk.radiance
    }

    /// Adds the light of the lights that a leg meets before it arrives.
    #[inline(always)]
    fn meet_lights<L: Lanes>(
        &self,
        walk: &mut Walk<L>,
        hit: Option<&SurfaceHit>,
        account: &mut impl Along<L>,
    ) {
        let scene = self.scene;
        let Walk { leg, radiance, throughput, .. } = walk;
        // a light with a material lies in a surface, so lights are met a little beyond it
        let t_max = scene.beyond(hit);
        scene.lights_met(&leg.ray, t_max, |hit| {
            let found = self.met::<L>(leg, &hit) * &*throughput;
            let parameters = scene.parameters();
            account.found(scene, &found, |met| met.add(parameters.of_light(hit.light)));
            *radiance += found;
        });
    }

    /// Returns the point of a path at which a leg arrives.
    #[inline(always)]
    fn vertex<L: Lanes>(&self, leg: &Leg, at: &Arrived) -> Vertex {
        let mut here = Vertex::on(self.scene, at);
        // photons that are sent pass whatever lets light straight through, so they never land there
        if self.pilot.spots.is_some()
            && at.material.straight::<L>(leg.ray.direction, at.surface.normal).is_none()
        {
            here.arrival = leg.density.map(|density| {
                let (from, d2) = (leg.at.point, leg.at.point.distance_squared(at.hit.point));
                Arrival { from, density: density * at.interaction.cos / d2 }
            });
        }
        here
    }

    /// Returns the chance that a path goes on freely from a surface.
    #[inline(always)]
    fn free_share_at(&self, at: &Arrived) -> f32 {
        if at.material.is_diffuse() { self.free_share() } else { 1.0 }
    }

    /// Returns the density with which a path goes on freely in a direction, 1/sr, if it does so with
    /// the chance `free`.
    #[inline(always)]
    fn along(at: &Arrived, free: f32, direction: Vec3) -> f32 {
        free * at.material.pdf(&at.interaction, Transport::Importance, direction)
    }

    /// Joins a point of a path with lights, adds their light, and chooses how the path goes on.
    #[inline(always)]
    fn join<L: Lanes>(
        &mut self,
        walk: &mut Walk<L>,
        here: &Vertex,
        at: &Arrived,
        account: &mut impl Along<L>,
    ) -> Aim {
        let scene = self.scene;
        let free = self.free_share();
        let along = |direction| Self::along(at, free, direction);
        let mut add = |lit: Option<Lit<L>>| {
            let Some(lit) = lit else { return };
            let towards = lit.towards;
            let found = scattered(at, towards) * &walk.throughput * &lit.irradiance;
            course::count(account, scene, (here, &lit), &found, |met| {
                met.sent_back(scene, at.into(), at.scattered(towards));
            });
            walk.radiance += found;
        };
        add(self.next_event(here, along));
        add(self.mirrored_sun(here));
        add(self.sent(here, along));
        self.aim(here)
    }

    /// Goes on towards a point of a reflector.
    #[inline(always)]
    fn go_towards<L: Lanes>(
        &mut self,
        walk: &mut Walk<L>,
        here: Vertex,
        at: &Arrived,
        (triangle, target): (usize, Vec3),
        account: &mut impl Along<L>,
    ) -> Fate {
        let scene = self.scene;
        let normal = at.surface.normal;
        let side = (target - at.hit.point).dot(normal).signum() * normal;
        let origin = scene.leave(&at.hit, side, side).origin;
        let direction = (target - origin).normalize_or_zero();
        walk.throughput *= &scattered(at, direction);
        account.sent_on(scene, at, at.scattered(direction));
        let density = Some(Self::along(at, self.free_share_at(at), direction));
        let ray = Ray { origin, direction };
        walk.leg = Leg { at: here, ray, density, aimed: Some(triangle), unbroken: true };
        walk.total_reflections = 0;
        Fate::Goes
    }

    /// Goes on in the way in which the surface scatters.
    #[inline(always)]
    fn go_freely<L: Lanes>(
        &mut self,
        walk: &mut Walk<L>,
        here: Vertex,
        at: &Arrived,
        account: &mut impl Along<L>,
    ) -> Fate {
        let scene = self.scene;
        let free = self.free_share_at(at);
        let sample = at.material.sample::<L>(&at.interaction, Transport::Importance, self.rng);
        let Some(scatter) = sample else { return Fate::Ends };
        let before = walk.throughput.largest();
        walk.throughput *= &scatter.weight;
        // a solid gives back on exit the factor by which radiance changes on entry
        if scatter.lobe != LobeKind::Refraction {
            walk.kept *= walk.throughput.largest() / before;
        }
        if walk.kept < LEAST {
            let carried = roulette(walk.throughput.clone(), walk.kept / LEAST, self.rng);
            let Some(carried) = carried else { return Fate::Ends };
            (walk.throughput, walk.kept) = (carried, LEAST);
        }
        walk.throughput *= 1.0 / free;
        walk.total_reflections = match scatter.lobe {
            LobeKind::TotalReflection => walk.total_reflections + 1,
            _ => 0,
        };
        if walk.total_reflections == MAX_TOTAL_REFLECTIONS {
            return Fate::CutOff;
        }
        account.sent_on(scene, at, scatter.lobe);
        let ray = at.leave(scatter.lobe, scatter.direction);
        walk.leg = match scatter.lobe {
            // light beyond a pane can still be joined with the vertex before the pane
            LobeKind::Straight => {
                let ray = scene.unfolded(&walk.leg.ray, &at.hit, ray);
                Leg { ray, unbroken: false, aimed: None, ..walk.leg }
            }
            lobe if lobe.is_specular() => Leg { ray, density: None, aimed: None, ..walk.leg },
            _ => {
                let density = Some(Self::along(at, free, scatter.direction));
                Leg { at: here, ray, density, aimed: None, unbroken: true }
            }
        };
        Fate::Goes
    }
}
