//! Lamps that lie in a surface.

use glam::Vec3;

use super::shapes::{Found, Shapes};
use crate::{
    math::geometry::{Triangle, closeness},
    scene::light::Light,
};

/// Number of places along a line where surfaces are searched for.
const PLACES: usize = 9;
/// Cosine between a spot's axis or a line and a surface's normal, below which it runs along the
/// surface.
const ALONG: f32 = 1e-3;

/// A lamp that reaches into a surface, or lies in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlushLight {
    /// Index of the light.
    pub light: usize,
    /// Index of the first triangle of a surface that it lies in.
    pub triangle: usize,
    /// Whether it was lifted off that surface, as points, spots and lines are.
    pub lifted: bool,
}

/// Lifts points, spots and lines that lie in a surface off it: above the points that rays start
/// from, and above captors in the surface. A spot moves to the side that it shines to, the others to
/// the side of the middle of the scene. This is done for photons and paths alike: otherwise rounding
/// alone would decide on which side of the surface a photon starts, and which shadow rays the surface
/// stops. Returns the lights concerned, and the tubes that surfaces cut.
pub fn lift(lights: &mut [Light], shapes: &Shapes, middle: Vec3, radius: f32) -> Vec<FlushLight> {
    let mut flush = Vec::new();
    for (l, light) in lights.iter_mut().enumerate() {
        let lifted = light.is_delta();
        let mut near: Vec<Found> = Vec::new();
        let mut lift = 0f32;
        for place in light.places(PLACES) {
            let reach = light.radius() + closeness(place);
            let widest = reach + closeness(Vec3::splat(radius));
            shapes.near(place, widest, |found| {
                let shape = &found.triangle;
                let offset = found.offset_at(place);
                let reach = reach + 4.0 * offset;
                if shape.nearest_point(place).distance(place) <= reach && !crosses(light, shape) {
                    near.push(found);
                    lift = lift.max(2.0 * closeness(place) + 6.0 * offset);
                }
            });
        }
        near.sort_unstable_by_key(|found| found.order);
        let Some(triangle) = near.first().map(|first| first.index) else { continue };
        flush.push(FlushLight { light: l, triangle, lifted });
        if lifted {
            let highest = shapes.lifts.iter().copied().fold(0.0, f32::max);
            let mut close = Vec::new();
            for place in light.places(PLACES) {
                shapes.captor_bvh.near(place, lift + highest, |triangle| {
                    close.push(shapes.captor_origin(triangle) as usize);
                });
                shapes.round_captors.near(place, lift + highest, |index| {
                    close.push(shapes.captor_triangles.len() + shapes.round_origin(index).0);
                });
                for shape in close.drain(..) {
                    let captor = shapes.captor_of_triangle[shape] as usize;
                    if let Ok(captor) = shapes.in_surface.binary_search(&captor) {
                        lift = lift.max(1.5 * shapes.lifts[captor]);
                    }
                }
            }
            for found in near {
                leave(light, &found.triangle, middle, lift);
            }
        }
    }
    flush
}

/// Returns whether a line passes through a triangle steeply, so that only a point of it lies in the
/// triangle.
fn crosses(light: &Light, triangle: &Triangle) -> bool {
    light.along().is_some_and(|along| along.dot(triangle.normal()).abs() > ALONG)
}

/// Moves a light to `distance`, m, off the plane of a triangle, unless it is already that far;
/// `scene` is the middle of the scene.
fn leave(light: &mut Light, triangle: &Triangle, scene: Vec3, distance: f32) {
    let front = triangle.normal();
    let middle = light.middle();
    let aimed = light.axis().map(|axis| axis.dot(front)).filter(|cos| cos.abs() > ALONG);
    let behind = aimed.unwrap_or((scene - middle).dot(front)) < 0.0;
    let normal = if behind { -front } else { front };
    let lack = distance - (middle - triangle.a).dot(normal);
    if lack > 0.0 {
        light.shift(lack * normal);
    }
}
