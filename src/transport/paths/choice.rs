//! Which light a point is joined with.

use glam::Vec3;

use crate::scene::light::Light;

/// The chances of the lights at a point: one half in proportion to what each may contribute
/// there; the other half alike, for a dim lamp in a room that a bright one does not reach.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LightChoice {
    point: Vec3,
    one_sided: Option<Vec3>,
    /// What all may contribute.
    total: f32,
    /// Lights that may contribute something.
    count: usize,
}

impl LightChoice {
    /// At a point, where light from behind does not count if it has a normal.
    pub(super) fn new(lights: &[Light], point: Vec3, one_sided: Option<Vec3>) -> Self {
        let mut choice = Self { point, one_sided, total: 0.0, count: 0 };
        if lights.len() == 1 {
            return choice;
        }
        for light in lights {
            let importance = choice.importance(light);
            choice.total += importance;
            choice.count += usize::from(importance > 0.0);
        }
        choice
    }

    /// The light of `lights` that a number in [0, 1) stands for, and its chance; none where no light can shine.
    /// One that is alone is chosen everywhere, and needs no number.
    pub(super) fn choose(
        &self,
        lights: &[Light],
        number: impl FnOnce() -> f32,
    ) -> Option<(usize, f32)> {
        if lights.len() == 1 {
            return Some((0, 1.0));
        }
        let mut rest = number();
        let chances = (0..lights.len()).map(|light| (light, self.chance(lights, light)));
        chances.filter(|(_, chance)| *chance > 0.0).find(|(_, chance)| {
            rest -= chance;
            rest < 0.0
        })
    }

    /// The chance of one of `lights`, in [0, 1].
    pub(super) fn chance(&self, lights: &[Light], light: usize) -> f32 {
        if lights.len() == 1 {
            return 1.0;
        }
        let importance = self.importance(&lights[light]);
        if importance == 0.0 {
            return 0.0;
        }
        0.5 * (importance / self.total + 1.0 / self.count as f32)
    }

    /// About the irradiance of a light at the point; zero only where it sheds none directly.
    fn importance(&self, light: &Light) -> f32 {
        let power = light.power.iter().copied().fold(0.0, f64::max) as f32;
        if power > 0.0 { power * light.importance(self.point, self.one_sided) } else { 0.0 }
    }
}
