//! From the unit square to disk, hemisphere, cone, sphere and triangle. A local frame has the
//! normal, or the axis, along z.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

/// A direction around the z axis from its versine 1 - cos(theta), exact for the narrowest cone,
/// and a uniform number for its turn.
#[inline]
fn around_z(versine: f32, u: f32) -> Vec3 {
    let sin = (versine * (2.0 - versine)).max(0.0).sqrt();
    let turn = uniform_circle(u);
    Vec3::new(sin * turn.x, sin * turn.y, 1.0 - versine)
}

/// Hemisphere with density cos(theta) / pi; the cosine is never zero (Malley's method).
#[inline]
pub fn cosine_hemisphere(u: Vec2) -> Vec3 {
    let turn = u.x.sqrt() * uniform_circle(u.y);
    Vec3::new(turn.x, turn.y, (1.0 - u.x).sqrt())
}

/// Density of [`cosine_hemisphere`], 1/sr.
#[inline]
pub fn cosine_hemisphere_density(cos: f32) -> f32 {
    cos.max(0.0) / PI
}

/// Directions uniform in the cone whose half angle has this versine, in (0, 2]; the whole
/// sphere at 2.
#[inline]
pub fn uniform_cone(versine: f32, u: Vec2) -> Vec3 {
    around_z(u.x * versine, u.y)
}

/// Density (n+1) / (2 pi) cos^n(alpha) around z (Lafortune and Willems, 1994).
#[inline]
pub fn cosine_power(exponent: f32, u: Vec2) -> Vec3 {
    around_z(-((-u.x).ln_1p() / (exponent + 1.0)).exp_m1(), u.y)
}

/// Density of [`cosine_power`], 1/sr.
#[inline]
pub fn cosine_power_density(exponent: f32, cos: f32) -> f32 {
    if cos > 0.0 { (exponent + 1.0) / (2.0 * PI) * cos.powf(exponent) } else { 0.0 }
}

/// Barycentric weights of the second and third corner, uniform over a triangle's area.
#[inline]
pub fn uniform_triangle(u: Vec2) -> Vec2 {
    let root = (1.0 - u.x).sqrt();
    Vec2::new((1.0 - u.y) * root, u.y * root)
}

/// A point uniform on the unit circle.
#[inline]
pub fn uniform_circle(u: f32) -> Vec2 {
    let (sin, cos) = (2.0 * PI * u).sin_cos();
    Vec2::new(cos, sin)
}
