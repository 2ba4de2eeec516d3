//! Light that comes to a point of a path by itself: the ways by which it comes, and what it has met
//! there.

use glam::Vec3;

use super::{
    mirrored::{Step, by_way_of},
    spots::{self, Passage},
    vertex::Vertex,
};
use crate::{
    math::{
        geometry::Ray,
        spectrum::{Lanes, Spectrum},
    },
    scene::{
        light::Toward,
        material::{Interaction, LobeKind},
        world::Scene,
    },
    transport::met::{Along, Met, Place},
};

/// Light that comes to a point of a path by itself, without the path going on.
pub(super) struct Lit<L> {
    /// Where it comes from, a unit vector.
    pub towards: Vec3,
    /// Its irradiance across that direction, divided by the density of the choice.
    pub irradiance: Spectrum<L>,
    /// Index of its light.
    pub light: usize,
    /// The way by which it comes.
    pub course: Course,
}

/// A way by which light comes to a point.
#[derive(Clone, Copy)]
pub(super) enum Course {
    /// Straight from a light.
    Straight(Toward),
    /// From the sun in the direction `toward_sun`, by way of the flat panes or mirrors of an image.
    Image {
        /// Index of the image.
        image: usize,
        /// Direction towards the sun, a unit vector.
        toward_sun: Vec3,
    },
    /// Along a ray from a lamp to a surface, and from there, off it, to the point.
    Sent {
        /// The ray of the photon.
        ray: Ray,
        /// The place off the surface.
        from: Vec3,
    },
}

/// Counts light that a path has found at a vertex, where it comes by itself, with what it has met
/// on its course. `more` adds what it meets between the vertex and the captor, beside the path.
#[inline(always)]
pub(super) fn count<L: Lanes, A: Along<L>>(
    account: &mut A,
    scene: &Scene,
    (at, lit): (&Vertex, &Lit<L>),
    found: &Spectrum<L>,
    more: impl Fn(&mut Met<L>),
) {
    if A::KEEPS {
        count_by(account, scene, (at, lit), found, more);
    }
}

#[inline(never)]
fn count_by<L: Lanes, A: Along<L>>(
    account: &mut A,
    scene: &Scene,
    (at, lit): (&Vertex, &Lit<L>),
    found: &Spectrum<L>,
    more: impl Fn(&mut Met<L>),
) {
    let light = scene.parameters().of_light(lit.light);
    let towards = lit.towards;
    let from_here = || Ray { origin: at.off(towards), direction: towards };
    match lit.course {
        Course::Straight(target) => account.found(scene, found, |met| {
            met.add(light);
            let distance = match target {
                Toward::Point { end, .. } => at.off(towards).distance(end),
                Toward::Direction(_) => f32::INFINITY,
            };
            pass(scene, from_here, distance, met);
            more(met);
        }),
        Course::Sent { ray, from } => account.found(scene, found, |met| {
            met.add(light);
            let landed = spots::straight::<L>(scene, ray, |passage, _| {
                if let Passage::Through(at) = passage {
                    met.sent_on(scene, at.into(), LobeKind::Straight);
                }
            });
            if let Some((landed, _)) = landed {
                met.sent_on(scene, (&landed).into(), landed.scattered(-towards));
            }
            pass(scene, from_here, at.off(towards).distance(from), met);
            more(met);
        }),
        Course::Image { image, toward_sun } => {
            let Some(mirrors) = scene.flat_mirrors() else { return };
            // what comes by way of each pane or mirror has met other ones
            let mut passed = Met::default();
            let mut parts: Vec<(Spectrum<L>, Met<L>)> = Vec::new();
            let shines = |ray: &Ray| scene.sky_visibility::<L>(lit.light, ray);
            let step = |step: Step<L>| match step {
                Step::Through(at) => passed.sent_back(scene, at.into(), LobeKind::Straight),
                Step::Shown { at, onward, arriving } => {
                    let mut met = passed.clone();
                    met.sent_back(scene, at.into(), LobeKind::MirrorReflection);
                    pass(scene, || onward, f32::INFINITY, &mut met);
                    parts.push((arriving.clone(), met));
                }
            };
            let (all, _) = by_way_of(scene, mirrors, image, from_here(), toward_sun, shines, step);
            let share = |part: f32, all: f32| if all > 0.0 { part / all } else { 0.0 };
            for (part, met_there) in parts {
                let found = part.zip(&all, share) * found;
                account.found(scene, &found, |met| {
                    met.add(light);
                    met.add_all(&met_there);
                    more(met);
                });
            }
        }
    }
}

/// Counts the panes and covers that light passes straight, against the direction of a ray, as far
/// as `distance`, m.
fn pass<L: Lanes>(scene: &Scene, ray: impl Fn() -> Ray, distance: f32, met: &mut Met<L>) {
    if !scene.parameters().goes_straight() {
        return;
    }
    let ray = ray();
    scene.passes_straight::<L>(&ray, distance, |surface, _| {
        let at = Interaction::new(ray.direction, surface.normal);
        met.sent_back(scene, Place { material: surface.material, at }, LobeKind::Straight);
    });
}
