//! A stand of plants as a whole: the layers in which its leaves absorb light, and the ground below
//! them.

use glam::{DVec3, Vec3};

use crate::{error::Problem, math::geometry::area};

/// The largest number of layers.
const MOST: f64 = 10_000.0;

/// Where light goes in a scene that repeats in all directions, below sun and sky alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Balance {
    /// Escaped upwards.
    Up,
    /// Escaped downwards.
    Down,
    /// Arrived at the ground from above.
    OnGround,
    /// Absorbed by the ground.
    ByGround,
    /// Absorbed by all else.
    ByStand,
}

/// Number of kinds of [`Balance`].
pub const BALANCES: usize = 5;

/// What is summed of a stand besides its captors.
#[derive(Clone, Debug, Default)]
pub struct Stand {
    /// The layers; `None` if none are asked for.
    pub layers: Option<LayerBins>,
    /// Whether each object is ground.
    pub is_ground: Vec<bool>,
    /// Whether the [`Balance`] is kept: the scene repeats along x and y, and its light comes from
    /// sun and sky alone.
    pub balances: bool,
}

impl Stand {
    /// Returns the number of sums.
    pub fn channels(&self) -> usize {
        self.layers.as_ref().map_or(0, |layers| layers.areas.len())
            + if self.balances { BALANCES } else { 0 }
    }

    /// Returns the index of the sum of a balance among them.
    pub fn channel(&self, balance: Balance) -> usize {
        self.layers.as_ref().map_or(0, |layers| layers.areas.len()) + balance as usize
    }
}

/// Layers of equal height, one above the other.
#[derive(Clone, Debug)]
pub struct LayerBins {
    /// Height of a layer, m.
    pub dz: f64,
    /// Number of the lowest layer; layer 0 begins at the height 0 of the user's coordinates.
    pub first: i64,
    /// One-sided area, m2, of the surface captors that are not ground in each layer.
    pub areas: Vec<f64>,
    /// Height of the centre of the scene, m.
    center: f64,
}

impl LayerBins {
    /// Makes layers of the height `dz`, m, for triangles with corners in the user's coordinates,
    /// each with the number of copies of it at the same heights; `center` is the height of the
    /// point that rays are relative to. Error: more than 10,000 layers.
    pub fn new(
        dz: f64,
        center: f64,
        triangles: impl Iterator<Item = ([DVec3; 3], usize)> + Clone,
    ) -> Result<Self, Problem> {
        let corners = || triangles.clone().flat_map(|(corners, _)| corners.map(|corner| corner.z));
        let low = (corners().fold(f64::INFINITY, f64::min) / dz).floor();
        let high = (corners().fold(f64::NEG_INFINITY, f64::max) / dz).floor();
        let mut layers = Self { dz, first: 0, areas: Vec::new(), center };
        if low > high {
            return Ok(layers);
        }
        if high - low >= MOST {
            let problem = format!("dz makes {} layers, must be at most {MOST}", high - low + 1.0);
            return Err(Problem::new(problem, "give thicker layers"));
        }
        layers.first = low as i64;
        layers.areas = vec![0.0; (high - low) as usize + 1];
        for (triangle, copies) in triangles {
            let mut below = 0.0;
            let heights = triangle.map(|corner| corner.z);
            let area = copies as f64 * area(&triangle);
            let bottom = heights.into_iter().fold(f64::INFINITY, f64::min);
            let top = heights.into_iter().fold(f64::NEG_INFINITY, f64::max);
            let from = ((bottom / dz).floor() - low) as usize;
            let to = ((top / dz).floor() - low) as usize;
            for bin in from..=to {
                let z = (low + bin as f64 + 1.0) * dz;
                let part = if bin == to { 1.0 } else { share_below(heights, z) };
                layers.areas[bin] += area * (part - below);
                below = part;
            }
        }
        Ok(layers)
    }

    /// Returns the layer in which a point lies.
    #[inline]
    pub fn of(&self, point: Vec3) -> usize {
        let bin = ((f64::from(point.z) + self.center) / self.dz).floor() as i64 - self.first;
        // rounding may put a point of the highest corner above it
        bin.clamp(0, self.areas.len() as i64 - 1) as usize
    }
}

/// Returns the share of a triangle, with corners at these heights, that lies below `z`.
fn share_below(heights: [f64; 3], z: f64) -> f64 {
    let mut h = heights;
    h.sort_by(f64::total_cmp);
    let [low, middle, high] = h;
    if z <= low {
        0.0
    } else if z >= high {
        1.0
    } else if z <= middle {
        (z - low).powi(2) / ((middle - low) * (high - low))
    } else {
        1.0 - (high - z).powi(2) / ((high - middle) * (high - low))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A right triangle that stands upright, cut at thirds of its height: 5/9, 3/9 and 1/9 of its
    /// area, from the bottom; and a level one, which lies in one layer.
    #[test]
    fn areas_are_cut_at_layers() {
        let upright = [DVec3::ZERO, DVec3::X, DVec3::new(0.0, 0.0, 3.0)];
        let level = [DVec3::Z, DVec3::Z + DVec3::X, DVec3::Z + DVec3::Y];
        let layers = LayerBins::new(1.0, 0.0, [(upright, 1), (level, 1)].into_iter()).unwrap();
        let exact = [1.5 * 5.0 / 9.0, 1.5 * 3.0 / 9.0 + 0.5, 1.5 / 9.0, 0.0];
        assert_eq!(layers.areas.len(), 4);
        for (area, exact) in layers.areas.iter().zip(exact) {
            assert!((area - exact).abs() < 1e-12, "{:?}", layers.areas);
        }
        assert_eq!(layers.of(Vec3::new(0.0, 0.0, 1.5)), 1);
        assert_eq!(layers.of(Vec3::new(0.0, 0.0, 9.0)), 3);
        assert!(LayerBins::new(1e-6, 0.0, [(upright, 1)].into_iter()).is_err());
    }
}
