//! What no ray meets: lamps that are points or lines, and sensors, which light crosses. A picture
//! shows them all the same.

use std::collections::BTreeMap;

use glam::Vec3;

use super::{FirstVisible, Viewpoint};
use phylux_core::{
    math::{
        geometry::Ray,
        rng::{Purpose, Streams},
    },
    scene::{captor::CaptorKind, lattice::Cell},
};

/// A place of a lamp without a surface, as a disc of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bulb {
    /// Index of the light.
    pub light: usize,
    /// Position in pixels, right and down from the upper left corner.
    pub at: [f32; 2],
    /// Radius of the disc, pixels.
    pub radius: f32,
    /// Whether it shines towards the viewpoint; a spot may shine elsewhere.
    pub shines: bool,
}

/// Radius of a bulb, as a fraction of the scene's radius; in a picture no less than so many pixels,
/// and no more than this fraction of its width.
const RADIUS: f32 = 0.012;
const LEAST: f32 = 1.5;
const MOST: f32 = 0.012;
/// Number of places of a line at which bulbs stand.
const PLACES: u64 = 64;

/// Returns the bulbs that are seen from a viewpoint, the farthest first.
pub fn bulbs(viewpoint: &Viewpoint, seed: u64) -> Vec<Bulb> {
    let Viewpoint { scene, camera, .. } = viewpoint;
    let mut all = Vec::new();
    for (index, light) in scene.lights().iter().enumerate() {
        if light.entrance().is_some() || !light.is_delta() {
            continue;
        }
        let places = if light.ball().1 > 0.0 { PLACES } else { 1 };
        let streams = Streams::new(seed, Purpose::Dots, index as u64);
        for place in 0..places {
            let point = light.emit(&mut streams.history(place)).origin;
            let Some(at) = camera.project(point) else { continue };
            if viewpoint.in_front_of(point, 1) > 0 {
                continue;
            }
            let distance = point.distance(camera.position);
            let radius = RADIUS * scene.radius() / (distance * camera.pixel());
            let radius = radius.min(MOST * camera.width as f32).max(LEAST);
            let shines = light.irradiance(camera.position - point).is_some_and(|e| e > 0.0);
            all.push((distance, Bulb { light: index, at, radius, shines }));
        }
    }
    all.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    all.into_iter().map(|(_, bulb)| bulb).collect()
}

impl Bulb {
    /// Visits the pixels of a picture of `width` x `height` pixels that the bulb covers, with the
    /// share of each that it covers.
    pub fn pixels(&self, [width, height]: [usize; 2], mut visit: impl FnMut(usize, f32)) {
        let range = |at: f32, size: usize| {
            let [from, to] = [at - self.radius - 1.0, at + self.radius + 1.0];
            let inside = |place: f32| place.clamp(0.0, size as f32) as usize;
            inside(from)..inside(to.ceil())
        };
        for y in range(self.at[1], height) {
            for x in range(self.at[0], width) {
                let away = (x as f32 + 0.5 - self.at[0]).hypot(y as f32 + 0.5 - self.at[1]);
                let share = (self.radius + 0.5 - away).clamp(0.0, 1.0);
                if share > 0.0 {
                    visit(y * width + x, share);
                }
            }
        }
    }
}

/// Returns the cosine of the angle at which a ray from the viewpoint meets a sensor, if nothing
/// that hides it is in front of it, and the cell of a scene that repeats to which the sensor belongs.
pub fn sensor(viewpoint: &Viewpoint, ray: &Ray) -> Option<(f32, Cell)> {
    let (FirstVisible::Thing { cos, captor: Some(captor), .. }, cell) =
        viewpoint.first_visible_in_cell(ray)
    else {
        return None;
    };
    let kind = viewpoint.scene.captors()[captor].kind;
    matches!(kind, CaptorKind::Virtual { .. }).then_some((cos, cell))
}

/// Side of the squares of pixels of which one ray looks for the cell whose sensors take up most of
/// the picture.
const COARSE: usize = 4;

/// Returns the cell of a scene that repeats of whose sensors most is seen; (0, 0) where none is.
pub fn nearest_cell(viewpoint: &Viewpoint) -> Cell {
    let camera = &viewpoint.camera;
    let mut counts = BTreeMap::<Cell, usize>::new();
    for y in (0..camera.height).step_by(COARSE) {
        for x in (0..camera.width).step_by(COARSE) {
            let met = sensor(viewpoint, &camera.ray(x as f32 + 0.5, y as f32 + 0.5));
            met.into_iter().for_each(|(_, cell)| *counts.entry(cell).or_default() += 1);
        }
    }
    counts.into_iter().max_by_key(|(_, count)| *count).map_or([0, 0], |(cell, _)| cell)
}

/// Returns, for each pixel, the share of it that is on the rim of what covers pixels by `shares`:
/// inside of it, and beside pixels outside.
pub fn rim(shares: &[f32], width: usize) -> Vec<f32> {
    let height = shares.len() / width;
    let least = |pixel: usize| {
        let (x, y) = (pixel % width, pixel / width);
        let across = x.saturating_sub(1)..(x + 2).min(width);
        let down = y.saturating_sub(1)..(y + 2).min(height);
        let around = down.flat_map(|y| across.clone().map(move |x| shares[y * width + x]));
        around.fold(1.0, f32::min)
    };
    (0..shares.len()).map(|pixel| (shares[pixel] - least(pixel)).max(0.0)).collect()
}

/// The colour of sensors, and that of their rims, sRGB.
pub const SENSOR: [Vec3; 2] = [Vec3::new(1.0, 0.66, 0.10), Vec3::new(0.33, 0.19, 0.10)];

#[cfg(test)]
mod tests {
    use super::*;

    /// A bulb covers its disc, and its rim in part; beyond the picture it does no harm.
    #[test]
    fn a_bulb_is_a_disc() {
        let bulb = Bulb { light: 0, at: [20.0, 15.0], radius: 4.0, shines: true };
        let mut sum = 0.0;
        bulb.pixels([40, 30], |pixel, share| {
            let away = ((pixel % 40) as f32 - 19.5).hypot((pixel / 40) as f32 - 14.5);
            assert!(away < 4.5 && (share == 1.0) == (away <= 3.5), "{away} {share}");
            sum += share;
        });
        assert!((sum / (16.0 * std::f32::consts::PI) - 1.0).abs() < 0.02, "{sum}");
        for at in [[-3.0, 2.0], [42.0, 29.0], [1e9, -1e9]] {
            Bulb { at, ..bulb }.pixels([40, 30], |pixel, _| assert!(pixel < 1200));
        }
    }

    /// The rim of a square is one pixel wide.
    #[test]
    fn a_rim_is_inside() {
        let inside =
            |pixel: usize| (3..8).contains(&(pixel % 10)) && (2..7).contains(&(pixel / 10));
        let shares: Vec<f32> = (0..100).map(|p| if inside(p) { 1.0 } else { 0.0 }).collect();
        let rim = rim(&shares, 10);
        assert_eq!(rim.iter().sum::<f32>(), 16.0);
        assert!(rim[23] == 1.0 && rim[34] == 0.0 && rim[13] == 0.0);
    }
}
