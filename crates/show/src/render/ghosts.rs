//! Dim, translucent surfaces, behind the photons in a picture.

use glam::Vec3;

use super::{
    Viewpoint,
    dots::{LAYERS, TRANSLUCENT},
};
use crate::{kinds::Kind, picture::Ground};
use phylux_core::math::geometry::Ray;

/// How surfaces look behind photons: each lets some of what is behind it through.
pub struct Ghosts {
    ground: Ground,
    /// The colour of each material, linear.
    tints: Vec<Vec3>,
}

/// Brightness of surfaces on a dark ground, as linear light: what faces the viewer, and what is
/// more at its rim.
const DIM: [f32; 2] = [0.036, 0.030];
/// The share of light that surfaces take from a light ground, the same.
const GREY: [f32; 2] = [0.10, 0.40];
/// Where surfaces seem to be lit from, so that one sees how they lie: from above, a little aside.
/// Those that face away have this share of the brightness.
const KEY: Vec3 = Vec3::new(-0.36, -0.48, 0.80);
const AWAY: f32 = 0.15;
/// How much a rim of glass shows, in place of a rim of an opaque surface.
const GLASS: f32 = 0.7;

impl Ghosts {
    /// Makes the surfaces of a scene look a little like what their materials stand for.
    pub fn new(viewpoint: &Viewpoint, ground: Ground) -> Self {
        let tint = |material| Vec3::ONE.lerp(Kind::of(material).mark(), 0.7);
        Self { ground, tints: viewpoint.scene.materials().iter().map(tint).collect() }
    }

    /// Returns the linear colour along a ray from the viewpoint.
    pub fn colour(&self, viewpoint: &Viewpoint, ray: &Ray) -> Vec3 {
        let (mut light, mut through, mut opaque) = (Vec3::ZERO, Vec3::ONE, 0);
        viewpoint.each_surface(ray, |hit, is_clear| {
            let surface = viewpoint.scene.surface(hit.triangle);
            let cos = ray.direction.dot(surface.normal);
            let lit = lit(surface.normal, ray);
            // shade is what takes light from a light ground
            let lit = match self.ground {
                Ground::Dark => lit,
                Ground::Light => 1.3 - 0.7 * lit,
            };
            let cos = cos.abs();
            let tint = self.tints[surface.material as usize];
            let rim = (1.0 - cos).powi(2);
            let [face, edge] = match self.ground {
                Ground::Dark => DIM,
                Ground::Light => GREY,
            };
            let shade = if is_clear { GLASS * edge * rim * rim } else { lit * (face + edge * rim) };
            match self.ground {
                Ground::Dark => light += through * tint * shade,
                Ground::Light => through *= Vec3::ONE - shade * (1.3 - tint),
            }
            if !is_clear {
                opaque += 1;
                if let Ground::Dark = self.ground {
                    through *= TRANSLUCENT;
                }
            }
            opaque < LAYERS
        });
        match self.ground {
            Ground::Dark => light + through * self.ground.linear(),
            Ground::Light => through * self.ground.linear(),
        }
    }
}

/// Returns how lit a surface seems along a ray, in [`AWAY`, 1].
pub(super) fn lit(normal: Vec3, ray: &Ray) -> f32 {
    let facing = if ray.direction.dot(normal) > 0.0 { -normal } else { normal };
    AWAY + (1.0 - AWAY) * (0.5 + 0.5 * facing.dot(KEY)).powi(2)
}

/// Returns the distance of the first opaque surface along a ray from the viewpoint, m, and how lit
/// it seems; infinity and 1 where there is none.
pub fn stands(viewpoint: &Viewpoint, ray: &Ray) -> (f32, f32) {
    viewpoint.opaque(ray).map_or((f32::INFINITY, 1.0), |hit| {
        (hit.t, lit(viewpoint.scene.surface(hit.triangle).normal, ray))
    })
}
