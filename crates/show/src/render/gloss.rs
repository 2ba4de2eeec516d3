//! The gloss of leaves. In pictures the cuticle of a leaf is a little rough, as true cuticles are: a
//! leaf that mirrors as glass does would show each lamp, and the sun, as a few white dots.

use glam::Vec3;

use phylux_core::{
    math::{
        geometry::{Frame, Ray},
        rng::Stream,
        sampling::{cosine_power, cosine_power_density},
        spectrum::{Lanes, Spectrum},
    },
    scene::{
        light::LightHit,
        material::{BsdfSample, Material, Scatterer, Transport},
        world::{Arrived, Scene},
    },
    transport::paths::Joined,
};

/// Exponent n of the lobe: its density is (n+1) / (2 pi) cos^n(alpha) at the angle alpha from the
/// mirror direction, half as large at 12 degrees as in the middle.
const EXPONENT: f32 = 30.0;
/// Russian-roulette threshold of branches that a leaf has mirrored. What surfaces send is evened by
/// the filter, and lamps are found by shadow rays too.
pub(super) const SMALL: f32 = 0.1;

/// The lobe about the mirror direction over which a cuticle mirrors. It shows the mean of the
/// radiance over the directions of the lobe, times the fraction that a smooth cuticle mirrors, so
/// no light is lost. Directions that would go into the triangle are mirrored at its plane.
#[derive(Clone, Copy)]
pub(super) struct Gloss<'a> {
    pub joined: Joined<'a>,
    /// The fraction of light that a smooth cuticle would mirror.
    pub fraction: f32,
    /// The mirror direction.
    mirrored: Vec3,
    /// Unit normal of the triangle on the side that is seen.
    facing: Vec3,
}

impl<'a> Gloss<'a> {
    /// Returns the lobe of what a ray meets, if it is a leaf with a cuticle.
    pub fn of(scene: &'a Scene, at: &Arrived<'a>) -> Option<Self> {
        let Material::Leaf(leaf) = at.material else { return None };
        // a cuticle mirrors the same fraction in all bands
        let [way, _] = leaf.smooth_ways::<[f32; 1]>(&at.interaction, Transport::Importance);
        let BsdfSample { direction, weight, .. } = way?;
        let (joined, fraction) = (Joined::new(scene, *at), weight.largest());
        Some(Self { joined, fraction, mirrored: direction, facing: at.facing() })
    }

    /// Samples a direction of the lobe, which may point into the triangle.
    pub fn direction(&self, rng: &mut Stream) -> Vec3 {
        Frame::new(self.mirrored).to_world(cosine_power(EXPONENT, rng.square()))
    }

    /// Returns the density of a direction, 1/sr: 0 for those into the triangle.
    pub fn density(&self, direction: Vec3) -> f32 {
        let height = direction.dot(self.facing);
        if height <= 0.0 {
            return 0.0;
        }
        let density =
            |d: Vec3| cosine_power_density(EXPONENT, 0.5 * d.distance_squared(self.mirrored));
        density(direction) + density(direction - 2.0 * height * self.facing)
    }

    /// Estimates, with one light point, the radiance of lamps that the leaf mirrors, without the part
    /// that [`weight`](Self::weight) leaves to sampled directions.
    pub fn lamps<L: Lanes>(&self, rng: &mut Stream) -> Spectrum<L> {
        let [_, mirrored] = self.joined.radiance(|d| self.density(d), rng);
        mirrored.scaled(self.fraction)
    }

    /// Returns the weight, in [0, 1], of a light that the branch along `ray` meets, after it has left
    /// the leaf in `direction`. What a small lamp or the sun sends by a further mirror, or by
    /// refraction, is left out: a direction of the lobe would find it seldom, and make a lone white
    /// dot.
    pub fn weight(&self, direction: Vec3, ray: &Ray, hit: &LightHit) -> f32 {
        self.joined.weight_in(self.density(direction), ray, hit)
    }
}
