//! Radiance along camera rays. Rays go on through panes and glass and by mirrors; where light
//! divides, they follow both branches (Whitted, Communications of the ACM 23 (6), 1980). They see
//! lamps; where a surface scatters diffusely, light is gathered, or the photons there give its
//! radiance.

use std::ops::{AddAssign, Mul};

use super::{
    fragments::Sums,
    gloss::{self, Gloss},
    normals::Normals,
    viewpoint::Viewpoint,
};
use glam::Vec3;

use phylux_core::{
    math::{
        geometry::Ray,
        rng::Stream,
        spectrum::{Lanes, Spectrum},
    },
    scene::{
        light::LightHit,
        material::{LobeKind, Scatterer, Transport},
        world::{Arrived, SurfaceHit},
    },
    transport::surface_light::SurfaceLight,
};

/// The number of smooth surfaces along a branch after which it is no longer followed.
const MOST_SURFACES: u32 = 100;
/// A place of which less than this fraction is seen, as in a pane, shows the radiance estimate of
/// the photons there, whose noise is low enough for that.
pub(super) const FAINT: f32 = 0.25;

/// Follows camera rays through a scene.
pub(super) struct Whitted<'a> {
    pub light: &'a SurfaceLight<'a>,
    pub viewpoint: &'a Viewpoint<'a>,
    /// The normals with which curved meshes are drawn; `None` draws flat triangles.
    pub normals: Option<&'a Normals>,
}

/// What is found along a ray, per band: radiance (W/m2/sr or umol/m2/s/sr), or irradiance or
/// absorbed power per area (W/m2 or umol/m2/s).
pub(super) struct Found<L> {
    /// The part that the nearest photons estimate, and lamps that are seen.
    pub told: Spectrum<L>,
    /// Standard error of what the nearest photons estimate: neighbouring pixels have this noise in
    /// common.
    pub deviation: Spectrum<L>,
    /// The part that came straight from lamps to a place where light was gathered.
    pub lamps: Spectrum<L>,
    /// The part that gathering rays found on other surfaces.
    pub surfaces: Spectrum<L>,
}

impl<L: Lanes> Found<L> {
    /// Makes a value that the nearest photons estimate alone, with the relative standard error
    /// `error`.
    pub fn told(told: Spectrum<L>, error: f32) -> Self {
        let deviation = told.clone().scaled(error);
        Self { deviation, lamps: told.zero(), surfaces: told.zero(), told }
    }

    /// Makes light that other surfaces send.
    pub fn of_surfaces(surfaces: Spectrum<L>) -> Self {
        let zero = || surfaces.zero();
        Self { told: zero(), deviation: zero(), lamps: zero(), surfaces }
    }

    /// Returns this with the light that was gathered in its place: what came straight from lamps,
    /// and what other surfaces send.
    pub fn with(self, [lamps, surfaces]: [Spectrum<L>; 2]) -> Self {
        Self { lamps, surfaces, ..self }
    }

    /// Returns what was found in one band.
    pub fn in_band(&self, band: usize) -> Sums {
        let of = |part: &Spectrum<L>| part.values()[band];
        let Self { told, deviation, lamps, surfaces } = self;
        Sums {
            told: of(told),
            deviation: of(deviation),
            lamps: of(lamps).into(),
            surfaces: of(surfaces).into(),
        }
    }
}

impl<L: Lanes> Mul<&Spectrum<L>> for Found<L> {
    type Output = Self;

    fn mul(self, share: &Spectrum<L>) -> Self {
        let Self { told, deviation, lamps, surfaces } = self;
        let [told, deviation] = [told, deviation].map(|part| part * share);
        let [lamps, surfaces] = [lamps, surfaces].map(|part| part * share);
        Self { told, deviation, lamps, surfaces }
    }
}

impl<L: Lanes> AddAssign for Found<L> {
    fn add_assign(&mut self, other: Self) {
        self.told += other.told;
        self.deviation += other.deviation;
        self.lamps += other.lamps;
        self.surfaces += other.surfaces;
    }
}

/// A branch of a ray that is still to be followed, with the fraction that it carries of what it
/// will find.
pub(super) struct Way<L> {
    pub ray: Ray,
    throughput: Spectrum<L>,
    surfaces: u32,
    /// Length of the branch up to the origin of `ray`, m.
    length: f32,
    /// Whether the branch started at the viewpoint.
    from_eye: bool,
    /// Whether the branch has come straight from its start: at most through thin panes.
    pub straight: bool,
    /// Whether the branch has been mirrored by a surface that also scatters, as by a leaf's cuticle.
    on_gloss: bool,
    /// The number of the leaf with gloss that mirrored the branch last, and the direction in which
    /// the branch left it.
    gloss: Option<(usize, Vec3)>,
    /// Threshold of Russian roulette: a branch that carries less goes on by chance, and then
    /// carries this much.
    small: f32,
}

impl<L: Lanes> Way<L> {
    pub fn new(ray: Ray, lanes: usize, from_eye: bool, small: f32) -> Self {
        let throughput = Spectrum::splat(lanes, 1.0);
        Self {
            ray,
            throughput,
            surfaces: 0,
            length: 0.0,
            from_eye,
            straight: true,
            on_gloss: false,
            gloss: None,
            small,
        }
    }
}

/// A place where a surface scatters diffusely, as seen along a ray.
pub(super) struct Place<'a> {
    pub at: Arrived<'a>,
    /// Distance along the ray from its start, m.
    pub length: f32,
    /// The fraction of the place's radiance that is seen: the largest over the bands.
    pub share: f32,
    /// The gloss of the place, if it is that of a leaf.
    pub gloss: Option<&'a Gloss<'a>>,
}

impl<'a> Whitted<'a> {
    /// Returns what a ray from the viewpoint, of this direction, finds where it meets a surface.
    pub fn seen(&self, hit: SurfaceHit, direction: Vec3) -> Arrived<'a> {
        let scene = self.light.scene;
        let at = scene.arrived(hit, direction);
        match self.normals {
            Some(normals) if at.material.is_diffuse() => normals.smooth(scene, at),
            _ => at,
        }
    }

    /// Follows a ray, with both branches at every smooth surface, and sums what `seen` returns
    /// where a surface scatters diffusely, and the emitted radiance of the lights on the way, each
    /// times the weight that `share` gives it. Both are multiplied by what the branch carries.
    pub fn follow<L: Lanes>(
        &self,
        start: Way<L>,
        rng: &mut Stream,
        share: impl Fn(&Way<L>, &LightHit) -> f32,
        mut seen: impl FnMut(&Place, &mut Stream) -> Found<L>,
    ) -> Found<L> {
        let scene = self.light.scene;
        let zero = || start.throughput.zero();
        let mut sum = Found { told: zero(), deviation: zero(), lamps: zero(), surfaces: zero() };
        let mut ways = vec![start];
        // the leaves with gloss on the way
        let mut leaves: Vec<Gloss> = Vec::new();
        while let Some(way) = ways.pop() {
            let Way { ray, ref throughput, surfaces, length, from_eye, straight, .. } = way;
            let Way { on_gloss, gloss, small, .. } = way;
            let hit = if from_eye && straight {
                self.viewpoint.closest(&ray)
            } else {
                scene.closest(&ray)
            };
            self.add_lights(&mut sum, &way, hit.as_ref(), &leaves, &share);
            let Some(hit) = hit else { continue };
            let at = if from_eye {
                self.seen(hit, ray.direction)
            } else {
                scene.arrived(hit, ray.direction)
            };
            let length = length + hit.t;
            let share = throughput.largest();
            let rough = from_eye && self.normals.is_some();
            let before = leaves.len();
            leaves.extend(rough.then(|| Gloss::of(scene, &at)).flatten());
            let glossy = leaves.get(before);
            if at.material.is_diffuse() {
                let place = Place { at, length, share, gloss: glossy };
                let found = seen(&place, rng) * throughput;
                match gloss {
                    // each ray has its own direction, so its noise is its own
                    Some(_) => sum.surfaces += found.told + found.lamps + found.surfaces,
                    None => sum += found,
                }
            }
            if surfaces == MOST_SURFACES {
                continue;
            }
            let smooth = at.material.smooth_ways::<L>(&at.interaction, Transport::Importance);
            for scatter in smooth.into_iter().flatten() {
                let throughput = scatter.weight * throughput;
                let small = if glossy.is_some() { gloss::SMALL } else { small };
                let chance = (throughput.largest() / small).min(1.0);
                if chance == 0.0 || (chance < 1.0 && rng.uniform() >= chance) {
                    continue;
                }
                let direction = glossy.map_or(scatter.direction, |gloss| gloss.direction(rng));
                let onward = onward(&at, scatter.lobe, direction);
                let glossy = glossy.map(|_| (before, onward.direction));
                ways.push(Way {
                    ray: match scatter.lobe {
                        LobeKind::Straight => scene.unfolded(&ray, &hit, onward),
                        _ => onward,
                    },
                    throughput: throughput.scaled(1.0 / chance),
                    surfaces: surfaces + 1,
                    length,
                    from_eye,
                    on_gloss: from_eye && (on_gloss || at.material.is_diffuse()),
                    gloss: glossy.or(gloss),
                    straight: straight && scatter.lobe == LobeKind::Straight,
                    small,
                });
            }
        }
        sum
    }

    /// Adds the emitted radiance of the lights that a branch meets before `hit`, each times the
    /// weight that `share` gives it.
    #[inline]
    fn add_lights<L: Lanes>(
        &self,
        sum: &mut Found<L>,
        way: &Way<L>,
        hit: Option<&SurfaceHit>,
        leaves: &[Gloss],
        share: &impl Fn(&Way<L>, &LightHit) -> f32,
    ) {
        let scene = self.light.scene;
        // a light with a material lies in a surface: search a little beyond the hit
        scene.lights_met(&way.ray, scene.beyond(hit), |hit| {
            let light = &scene.lights()[hit.light];
            let met = light.radiance::<L>(&way.ray, hit.on.as_ref());
            let met = met.scaled(share(way, &hit)) * &way.throughput;
            match way.gloss {
                Some((gloss, direction)) => {
                    sum.lamps += met.scaled(leaves[gloss].weight(direction, &way.ray, &hit));
                }
                // a lamp mirrored by a smooth leaf is met by some of the rays of a pixel, and the
                // filter evens it; the sun is so bright that it stays in its place
                None if way.on_gloss && light.entrance().is_none() => sum.lamps += met,
                None => sum.told += met,
            }
        });
    }
}

/// Returns the ray that goes on from a surface by a lobe. A direction about a smoothed normal may
/// point into the flat triangle; it is mirrored at its plane, so that no light leaks through it.
pub(super) fn onward(at: &Arrived, lobe: LobeKind, direction: Vec3) -> Ray {
    let side = if lobe.crosses() { -at.facing() } else { at.facing() };
    let beneath = direction.dot(side).min(0.0);
    at.leave(lobe, direction - 2.0 * beneath * side)
}

pub(super) fn load<L: Lanes>(values: &[f64]) -> Spectrum<L> {
    Spectrum::from_fn(values.len(), |b| values.get(b).map_or(0.0, |v| *v as f32))
}
