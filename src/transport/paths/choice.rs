//! Which light a point is joined with.

use super::vertex::Vertex;
use crate::scene::light::Light;

/// The chances of the lights at a point: one half in proportion to what each may contribute
/// there; the other half alike, for a dim lamp in a room that a bright one does not reach.
pub(super) struct LightChoice<'a> {
    lights: &'a [Light],
    at: &'a Vertex,
    total: f32,
    count: usize,
}

impl<'a> LightChoice<'a> {
    pub(super) fn new(lights: &'a [Light], at: &'a Vertex) -> Self {
        let mut choice = Self { lights, at, total: 0.0, count: 0 };
        if lights.len() == 1 {
            return choice;
        }
        for light in 0..lights.len() {
            let importance = choice.importance(light);
            choice.total += importance;
            choice.count += usize::from(importance > 0.0);
        }
        choice
    }

    /// The light that a number in [0, 1) stands for, and its chance; none where no light can shine.
    /// One that is alone is chosen everywhere, and needs no number.
    pub(super) fn choose(&self, number: impl FnOnce() -> f32) -> Option<(usize, f32)> {
        if self.lights.len() == 1 {
            return Some((0, 1.0));
        }
        let mut rest = number();
        let chances = (0..self.lights.len()).map(|light| (light, self.chance(light)));
        chances.filter(|(_, chance)| *chance > 0.0).find(|(_, chance)| {
            rest -= chance;
            rest < 0.0
        })
    }

    /// The chance of a light, in [0, 1].
    pub(super) fn chance(&self, light: usize) -> f32 {
        if self.lights.len() == 1 {
            return 1.0;
        }
        let importance = self.importance(light);
        if importance == 0.0 {
            return 0.0;
        }
        0.5 * (importance / self.total + 1.0 / self.count as f32)
    }

    /// About the irradiance of a light at the point; zero only where it sheds none directly.
    fn importance(&self, light: usize) -> f32 {
        let light = &self.lights[light];
        let power = light.power.iter().copied().fold(0.0, f64::max) as f32;
        if power > 0.0 { power * light.importance(self.at.point, self.at.one_sided) } else { 0.0 }
    }
}
