//! The choice of the light that a point of a path is joined with.

use glam::Vec3;

use crate::{
    math::{effort, rng::Stream},
    scene::world::Scene,
};

/// The largest number of lights that [`LightChoice::roughly`] looks at.
pub(super) const ROUGH: usize = 256;

/// The largest number of lights of which a choice keeps what each may contribute.
const FEW: usize = 8;

/// Fraction of the choices among many lights that are the same for all of them.
const EVEN: f64 = 0.1;

/// A point to be joined with a light.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub point: Vec3,
    /// Normal of the only side from which light counts. `None` if light counts from both sides.
    pub one_sided: Option<Vec3>,
}

/// The chances of the lights at a point. One half of the chance is in proportion to what each light
/// may contribute there. The other half is the same for all lights that may contribute anything,
/// for the sake of a dim lamp in a room that a bright lamp does not reach.
///
/// Where the scene has many lights, its [tree](Scene::light_tree) chooses nine tenths of them by
/// what they may contribute, and the rest is the same for all lights.
///
/// The place itself is known to the caller, so that a choice, of which a path makes one at each
/// point, is small.
#[derive(Clone, Copy, Default)]
pub(super) struct LightChoice {
    /// Sum of what all lights may contribute.
    total: f32,
    /// Number of the lights that may contribute anything.
    count: u32,
    /// What those of the light tree may contribute together.
    of_tree: f32,
    /// What each of at most [`FEW`] lights may contribute.
    each: [f32; FEW],
}

impl LightChoice {
    /// Computes the chances at a place.
    #[inline]
    pub(super) fn new(scene: &Scene, at: Place) -> Self {
        Self::of_each(scene, 1, at)
    }

    /// Estimates the chances at a place that is on no surface, in a time that does not grow with
    /// the number of lights: of more than [`ROUGH`], some stand for all.
    pub(super) fn roughly(scene: &Scene, at: Place) -> Self {
        Self::of_each(scene, scene.lights().len().div_ceil(ROUGH).max(1), at)
    }

    /// Computes the chances from each `step`-th light.
    fn of_each(scene: &Scene, step: usize, at: Place) -> Self {
        let mut choice = Self::default();
        if scene.lights().len() == 1 {
            return choice;
        }
        if let Some(tree) = scene.light_tree() {
            let infinite = infinite(scene, at).map(|(_, importance)| importance);
            choice.of_tree = tree.importance(scene.lights(), at.point, at.one_sided);
            choice.total = choice.of_tree + infinite.sum::<f32>();
            choice.count = scene.lights().len() as u32;
            return choice;
        }
        // twice: now, and when one is chosen
        effort::spend(2 * effort::LIGHT * (scene.lights().len() / step) as u64);
        for light in (0..scene.lights().len()).step_by(step) {
            let importance = importance(scene, at, light);
            choice.total += importance;
            choice.count += u32::from(importance > 0.0);
            if let Some(each) = choice.each.get_mut(light) {
                *each = importance;
            }
        }
        choice.total *= step as f32;
        choice.count *= step as u32;
        choice
    }

    /// Returns the index of a light chosen by chance, and its chance; `number` in [0, 1), if given,
    /// decides among few lights. `None` where no light can shine. A light that is alone is always
    /// chosen and needs no number.
    #[inline]
    pub(super) fn choose(
        &self,
        scene: &Scene,
        at: Place,
        number: Option<f32>,
        rng: &mut Stream,
    ) -> Option<(usize, f32)> {
        if scene.lights().len() == 1 {
            return Some((0, 1.0));
        }
        if scene.light_tree().is_some() {
            return self.choose_of_many(scene, at, rng);
        }
        let mut rest = number.unwrap_or_else(|| rng.uniform());
        let chances = (0..scene.lights().len()).map(|light| (light, self.chance(scene, at, light)));
        chances.filter(|(_, chance)| *chance > 0.0).find(|(_, chance)| {
            rest -= chance;
            rest < 0.0
        })
    }

    #[inline(never)]
    fn choose_of_many(&self, scene: &Scene, at: Place, rng: &mut Stream) -> Option<(usize, f32)> {
        if self.total <= 0.0 {
            return None;
        }
        let number = rng.uniform_fine();
        let light = if number < EVEN {
            (number / EVEN * f64::from(self.count)) as usize
        } else {
            let mut rest = (number - EVEN) / (1.0 - EVEN) * f64::from(self.total);
            let at_infinity = infinite(scene, at).find(|(_, importance)| {
                rest -= f64::from(*importance);
                rest < 0.0
            });
            match at_infinity {
                Some((light, _)) => light,
                None => {
                    let number = (rest / f64::from(self.of_tree)).clamp(0.0, 1.0 - f64::EPSILON);
                    let (lights, tree) = (scene.lights(), scene.light_tree()?);
                    let (light, share) = tree.choose(lights, at.point, at.one_sided, number)?;
                    return Some((light, self.of_many(share * self.of_tree)));
                }
            }
        };
        let light = light.min(self.count as usize - 1);
        Some((light, self.chance(scene, at, light)))
    }

    /// Returns the chance of one of many lights, which may contribute so much.
    fn of_many(&self, importance: f32) -> f32 {
        (1.0 - EVEN as f32) * importance / self.total + EVEN as f32 / self.count as f32
    }

    /// Returns the chance with which a light is chosen, in [0, 1].
    #[inline]
    pub(super) fn chance(&self, scene: &Scene, at: Place, light: usize) -> f32 {
        if scene.lights().len() == 1 {
            return 1.0;
        }
        if let Some(tree) = scene.light_tree() {
            if self.total <= 0.0 {
                return 0.0;
            }
            return self.of_many(match scene.lights()[light].entrance() {
                Some(_) => importance(scene, at, light),
                None => {
                    self.of_tree * tree.probability(scene.lights(), at.point, at.one_sided, light)
                }
            });
        }
        let importance = match self.each.get(light) {
            Some(&each) if scene.lights().len() <= FEW => each,
            _ => importance(scene, at, light),
        };
        if importance == 0.0 {
            return 0.0;
        }
        // an estimate may have left out the brightest light
        (0.5 * (importance / self.total + 1.0 / self.count.max(1) as f32)).min(1.0)
    }
}

/// Returns the lights at infinity, with what they may contribute.
fn infinite(scene: &Scene, at: Place) -> impl Iterator<Item = (usize, f32)> {
    scene.infinite_lights().map(move |(light, _)| (light, importance(scene, at, light)))
}

/// Returns the approximate irradiance of a light at a place, W/m2 or umol/m2/s; zero only where the
/// light sheds none directly.
fn importance(scene: &Scene, at: Place, light: usize) -> f32 {
    let power = scene.lights()[light].power.iter().copied().fold(0.0, f64::max) as f32;
    if power > 0.0 { power * scene.importance(light, at.point, at.one_sided) } else { 0.0 }
}
