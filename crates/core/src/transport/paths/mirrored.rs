//! The image of the sun in flat panes and mirrors.

use glam::Vec3;

use crate::{
    math::{
        geometry::Ray,
        spectrum::{Lanes, Spectrum},
    },
    scene::{
        material::{LobeKind, Scatterer, Transport},
        world::{Arrived, FlatMirrors, Scene},
    },
    transport::trace::MAX_INTERACTIONS,
};

/// A step of a ray towards an image of the sun.
pub(super) enum Step<'a, L> {
    /// It goes straight through a pane.
    Through(&'a Arrived<'a>),
    /// A pane or mirror shows the image.
    Shown {
        /// The place.
        at: &'a Arrived<'a>,
        /// The ray from there to the sun.
        onward: Ray,
        /// The fraction of the sun's light that arrives by way of it.
        arriving: &'a Spectrum<L>,
    },
}

/// Follows a ray in the direction in which an image of the sun is seen. Returns the fraction of the
/// sun's light, across that direction, that arrives along the ray by way of the panes or mirrors
/// that show this image, and the number of rays that this took. `shines` tells which fraction of
/// the sun's light comes along a ray in the direction `toward_sun`. `on` is told of each step.
pub(super) fn by_way_of<L: Lanes>(
    scene: &Scene,
    mirrors: &FlatMirrors,
    image: usize,
    mut ray: Ray,
    toward_sun: Vec3,
    shines: impl Fn(&Ray) -> Option<Spectrum<L>>,
    mut on: impl FnMut(Step<'_, L>),
) -> (Spectrum<L>, u32) {
    let toward = ray.direction;
    let [mut arriving, mut through] =
        [0.0, 1.0].map(|value| Spectrum::<L>::splat(scene.lanes(), value));
    let mut rays = 0;
    // panes on the way may also show the image, and they let through what panes behind them show
    for _ in 0..MAX_INTERACTIONS {
        if !mirrors.may_be_met(image, &ray) {
            break;
        }
        rays += 1;
        let Some(at) = scene.arrive(&ray) else { break };
        let [mirrored, onward] =
            at.material.smooth_ways::<L>(&at.interaction, Transport::Importance);
        if mirrors.image_of(at.hit.triangle) == Some(image)
            && let Some(mirrored) = mirrored
        {
            rays += 1;
            let onward = at.leave(mirrored.lobe, toward_sun);
            if let Some(visible) = shines(&onward) {
                let more = mirrored.weight * &through * visible;
                on(Step::Shown { at: &at, onward, arriving: &more });
                arriving += more;
            }
        }
        match onward {
            Some(onward) if onward.lobe == LobeKind::Straight => {
                through = through * onward.weight;
                on(Step::Through(&at));
            }
            _ => break,
        }
        ray = at.leave(LobeKind::Straight, toward);
    }
    (arriving, rays)
}
