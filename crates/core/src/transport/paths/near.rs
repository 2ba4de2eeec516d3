//! Photons of sun and sky near the captors, where these take up little of a wide scene.
//!
//! A photon of light from infinitely far away has its direction from the face by which it enters; its
//! place across that direction is uniform over the face, with the density 1 / A. One half of such
//! photons is sent through a box about the captors instead, with the density 1 / S, where S is the
//! area of the box across the direction. The photon starts where its line enters the scene, so that
//! whatever shades the captors still does. By the balance heuristic (Veach 1997, ch. 9) a photon
//! counts 2 / (1 + A / S) times if its line passes the box, and twice if it does not. The means stay
//! the same, and where A is much larger than S, far more photons come to the captors.

use glam::Vec3;

use crate::{
    math::{
        geometry::Extent,
        rng::Stream,
        spectrum::{Lanes, Spectrum},
    },
    scene::{
        light::{Emission, Light, Strata},
        world::Scene,
    },
};

/// The box is wider than the captors by this fraction of their longest side, so that what is beside
/// them may mirror light to them.
const BESIDE: f32 = 0.25;
/// Photons are sent there if the surface of the scene's box is at least this many times as large.
const WORTH: f32 = 8.0;

/// A box about the captors of a scene, through which photons are sent.
pub struct Near(Extent);

impl Near {
    /// The most that a photon counts, in photons that are emitted as any others.
    pub const MOST_GAIN: f64 = 2.0;

    /// Finds the box; `None` where it would gain little, where the scene repeats, and where no light
    /// comes in from infinitely far away by the faces of the scene's box.
    pub fn find(scene: &Scene) -> Option<Self> {
        let comes_in = |light: &Light| light.entrance().is_some_and(|e| !e.has_openings());
        if scene.lattice().is_some() || !scene.lights().iter().any(comes_in) {
            return None;
        }
        let of = |captor| scene.extent_of(captor);
        let own = scene.captors().iter().map(of).fold(Extent::EMPTY, Extent::join);
        let whole = scene.triangles().extent().join(own);
        let wider = own.wider(BESIDE * own.size().max_element());
        let near = Extent { min: wider.min.max(whole.min), max: wider.max.min(whole.max) };
        let is_small = WORTH * near.half_area() <= whole.half_area();
        (!scene.captors().is_empty() && is_small).then_some(Self(near))
    }

    /// Emits history `index` of some strata, as [`Scene::emit`], through the box or anywhere. Returns
    /// with it the power, as a fraction of its weights, that it would have if it were emitted as any
    /// other, where that differs.
    pub fn emit<'s, L: Lanes>(
        &self,
        scene: &Scene,
        strata: &'s Strata,
        index: u64,
        rng: &mut Stream,
    ) -> (Emission<'s, L>, Option<Spectrum<L>>) {
        let mut photon = scene.emit::<L>(strata, index, rng);
        let entrance = scene.lights()[photon.light].entrance().filter(|e| !e.has_openings());
        let Some(face) = entrance.and_then(|entrance| entrance.face(photon.face)) else {
            return (photon, None);
        };
        let usual = photon.power.clone();
        let direction = photon.ray.direction;
        if rng.uniform() < 0.5 {
            // light that enters by another face is found by the photons of that face
            match face.entering(self.draw(direction, rng), direction) {
                Some(ray) => photon.ray = ray,
                None => photon.power = photon.power.scaled(0.0),
            }
        }
        let passes = self.0.is_met(&photon.ray);
        let ratio = if passes { face.area_across(direction) / self.across(direction) } else { 0.0 };
        photon.power = photon.power.scaled(Self::MOST_GAIN as f32 / (1.0 + ratio));
        (photon, Some(usual))
    }

    /// Returns the area of each pair of opposite faces of the box across a direction, m2.
    fn faces(&self, direction: Vec3) -> [f32; 3] {
        let Vec3 { x, y, z } = self.0.size();
        (Vec3::new(y * z, z * x, x * y) * direction.abs()).to_array()
    }

    /// Returns the area of the box across a direction, m2.
    fn across(&self, direction: Vec3) -> f32 {
        self.faces(direction).iter().sum()
    }

    /// Draws a point of the box whose place across a direction is uniform: on one of the three faces
    /// that are seen from there.
    fn draw(&self, direction: Vec3, rng: &mut Stream) -> Vec3 {
        let mut rest = rng.uniform() * self.across(direction);
        let axis = self.faces(direction).iter().position(|area| {
            rest -= area;
            rest < 0.0
        });
        let axis = axis.unwrap_or(direction.abs().max_position());
        let at = rng.square();
        let mut point = Vec3::ZERO;
        point[axis] = f32::from(direction[axis] < 0.0);
        point[(axis + 1) % 3] = at.x;
        point[(axis + 2) % 3] = at.y;
        self.0.min + point * self.0.size()
    }
}
