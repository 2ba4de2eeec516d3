//! A stand of plants as a whole: the layers in which its leaves absorb light, and the ground below
//! them.

use std::fmt;

use glam::DVec3;

use super::instances::Located;
use crate::{error::Problem, math::geometry::Transform};

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

/// A height counts as that of a border between layers if it differs from it by no more than this
/// fraction of a layer: 0.3 is the third border of layers of 0.1, whatever 0.3 / 0.1 is in binary.
/// What lies in a border belongs to the layer above it.
const ON_BORDER: f64 = 1e-5;

/// Layers of equal height, one above the other.
#[derive(Clone)]
pub struct LayerBins {
    /// Height of a layer, m.
    pub dz: f64,
    /// Number of the lowest layer; layer 0 begins at the height 0 of the user's coordinates.
    pub first: i64,
    /// One-sided area, m2, of the surface captors that are not ground in each layer.
    pub areas: Vec<f64>,
    heights: Heights,
    /// For each triangle that is no shared copy and has heights, its layer, [`ACROSS`] or [`NONE`].
    of_triangle: Vec<u16>,
}

/// A triangle that reaches over a border between layers.
const ACROSS: u16 = u16::MAX;
/// A triangle that counts in no layer.
const NONE: u16 = u16::MAX - 1;

/// Where a triangle lies.
pub enum InLayers {
    /// In no layer: it is ground.
    Nowhere,
    /// In this layer as a whole.
    In(usize),
    /// In several, or in those of its copy.
    Across,
}

/// Heights of the corners of triangles, in double precision. Both the area of a triangle and the
/// light on it are divided among layers by these heights.
#[derive(Clone, Default)]
pub struct Heights {
    /// The index of the first triangle that has heights.
    pub first: usize,
    /// Heights of the corners from this triangle on, m from the user's origin.
    pub own: Vec<[f64; 3]>,
    /// Those of copies that share their triangles, object by object.
    pub shared: Vec<SharedHeights>,
}

/// The heights of copies that share their triangles.
#[derive(Clone, Default)]
pub struct SharedHeights {
    /// Corners of the object's triangles, m in its own coordinates.
    pub corners: Vec<[DVec3; 3]>,
    /// How high each copy stands.
    pub copies: Vec<Level>,
}

/// How high a copy of an object stands: a point p of the object is at the height `along` . p + `at`,
/// m from the user's origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Level {
    along: DVec3,
    at: f64,
}

impl Level {
    /// Returns the level of a copy that `transform` places.
    pub fn of(transform: &Transform) -> Self {
        let along = DVec3::AXES.map(|axis| transform.turned(axis).z);
        Self { along: along.into(), at: transform.point(DVec3::ZERO).z }
    }

    /// Returns the heights of a triangle's corners, m from the user's origin.
    pub fn heights(&self, corners: &[DVec3; 3]) -> [f64; 3] {
        corners.map(|corner| self.along.dot(corner) + self.at)
    }

    /// Returns numbers that are equal for equal levels.
    pub fn key(&self) -> [u64; 4] {
        let DVec3 { x, y, z } = self.along;
        [x, y, z, self.at].map(f64::to_bits)
    }
}

/// Writes what the numbers depend on; the heights follow from the triangles.
impl fmt::Debug for LayerBins {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { dz, first, areas, .. } = self;
        let mut text = f.debug_struct("LayerBins");
        text.field("dz", dz).field("first", first).field("areas", areas).finish()
    }
}

impl LayerBins {
    /// Makes layers of the height `dz`, m, for triangles that are given by the heights of their
    /// corners, m from the user's origin, and by their area, m2, times the number of copies at the
    /// same heights. `heights` are those by which points are found; `counts` says of each triangle that
    /// is no shared copy whether it counts. Error: more than 10,000 layers.
    pub fn new(
        dz: f64,
        triangles: impl Iterator<Item = ([f64; 3], f64)> + Clone,
        heights: Heights,
        counts: impl Iterator<Item = bool>,
    ) -> Result<Self, Problem> {
        let (areas, of_triangle) = (Vec::new(), Vec::new());
        let mut layers = Self { dz, first: 0, areas, heights, of_triangle };
        let levels = || triangles.clone().flat_map(|(heights, _)| heights);
        let low = layers.level(levels().fold(f64::INFINITY, f64::min)).floor();
        let high = layers.level(levels().fold(f64::NEG_INFINITY, f64::max)).floor();
        if low > high {
            return Ok(layers);
        }
        if high - low >= MOST {
            let problem = format!("dz makes {} layers, must be at most {MOST}", high - low + 1.0);
            return Err(Problem::new(problem, "give thicker layers"));
        }
        layers.first = low as i64;
        layers.areas = vec![0.0; (high - low) as usize + 1];
        for (heights, area) in triangles {
            let levels = heights.map(|height| layers.level(height));
            let [bottom, top] = ends(levels);
            let mut below = 0.0;
            for bin in bottom as usize..=top as usize {
                let end = bin as f64 + 1.0;
                let part = if top < end { 1.0 } else { share_below(levels, end) };
                layers.areas[bin] += area * (part - below);
                below = part;
            }
        }
        let of = |(heights, counts): (&[f64; 3], bool)| {
            let [bottom, top] = ends(heights.map(|height| layers.level(height)));
            match (counts, bottom as usize == top as usize) {
                (false, _) => NONE,
                (true, true) => bottom as u16,
                (true, false) => ACROSS,
            }
        };
        layers.of_triangle = layers.heights.own.iter().zip(counts).map(of).collect();
        Ok(layers)
    }

    /// Returns where a triangle of a surface captor lies.
    #[inline]
    pub fn of_triangle(&self, triangle: usize) -> InLayers {
        match triangle.checked_sub(self.heights.first).and_then(|own| self.of_triangle.get(own)) {
            Some(&NONE) => InLayers::Nowhere,
            Some(&layer) if layer != ACROSS => InLayers::In(layer.into()),
            _ => InLayers::Across,
        }
    }

    /// Returns the heights of the corners of a triangle of a surface captor, m from the user's origin.
    /// `copy` says which triangle of which copy it is, if it is shared.
    pub fn heights(&self, triangle: usize, copy: Option<Located>) -> [f64; 3] {
        let Heights { first, own, shared } = &self.heights;
        match copy {
            None => own[triangle - first],
            Some(Located { prototype, copy, triangle }) => {
                let SharedHeights { corners, copies } = &shared[prototype];
                copies[copy].heights(&corners[triangle])
            }
        }
    }

    /// Returns the layer of the point with these barycentric weights of the second and third corner,
    /// in a triangle whose corners have these heights.
    #[inline]
    pub fn of(&self, heights: [f64; 3], [u, v]: [f64; 2]) -> usize {
        let [a, b, c] = heights.map(|height| self.level(height));
        // rounding may put a point a little outside its triangle
        let [bottom, top] = ends([a, b, c]);
        (a + u * (b - a) + v * (c - a)).max(bottom).min(top) as usize
    }

    /// Returns a height, m, in layers from the bottom of the lowest one.
    #[inline]
    fn level(&self, height: f64) -> f64 {
        let level = height / self.dz;
        let border = level.round();
        let level = if (level - border).abs() <= ON_BORDER { border } else { level };
        level - self.first as f64
    }
}

/// Returns the least and the largest of three numbers.
#[inline]
fn ends([a, b, c]: [f64; 3]) -> [f64; 2] {
    [a.min(b).min(c), a.max(b).max(c)]
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

    fn bins(dz: f64, triangles: &[([f64; 3], f64)]) -> LayerBins {
        let own = triangles.iter().map(|(heights, _)| *heights).collect();
        let heights = Heights { own, ..Heights::default() };
        LayerBins::new(dz, triangles.iter().copied(), heights, std::iter::repeat(true)).unwrap()
    }

    /// A right triangle of 1.5 m2 that stands upright, cut at thirds of its height: 5/9, 3/9 and 1/9
    /// of its area, from the bottom; and a level one, which lies in one layer.
    #[test]
    fn areas_are_cut_at_layers() {
        let (upright, level) = (([0.0, 0.0, 3.0], 1.5), ([1.0; 3], 0.5));
        let layers = bins(1.0, &[upright, level]);
        let exact = [1.5 * 5.0 / 9.0, 1.5 * 3.0 / 9.0 + 0.5, 1.5 / 9.0, 0.0];
        assert_eq!(layers.areas.len(), 4);
        for (area, exact) in layers.areas.iter().zip(exact) {
            assert!((area - exact).abs() < 1e-12, "{:?}", layers.areas);
        }
        assert_eq!(layers.of(upright.0, [0.0, 0.5]), 1);
        assert_eq!(layers.of(upright.0, [-0.1, 1.2]), 3);
        assert!(matches!(layers.of_triangle(0), InLayers::Across));
        assert!(matches!(layers.of_triangle(1), InLayers::In(1)));
        let none = std::iter::empty();
        assert!(LayerBins::new(1e-6, [upright].into_iter(), Heights::default(), none).is_err());
    }

    /// Level triangles at the borders of layers, by division, by multiplication, in single precision
    /// and turned over: area and points lie in the layer above the border. A triangle across a
    /// border has the same share of area and of points, which are counted on a lattice, below it.
    #[test]
    fn area_and_points_are_in_one_layer() {
        for dz in [0.1, 0.05, 0.3, 0.7, 1.0 / 3.0] {
            for border in -40_i64..40 {
                let height = border as f64 * dz;
                let single = f64::from(height as f32);
                for heights in [[height; 3], [single; 3], [height, height - 1e-15, single]] {
                    let layers = bins(dz, &[(heights, 1.0)]);
                    assert_eq!((layers.first, &layers.areas[..]), (border, &[1.0][..]), "{dz}");
                    assert_eq!(layers.of(heights, [0.3, 0.3]), 0);
                    assert!(matches!(layers.of_triangle(0), InLayers::In(0)));
                }
            }
        }
        let across = [0.999_95, 1.0, 1.000_02];
        let layers = bins(0.5, &[(across, 1.0)]);
        let (mut below, mut all) = (0.0, 0.0);
        for (i, j) in (0..200).flat_map(|i| (0..200 - i).map(move |j| (i, j))) {
            let at = [i, j].map(|n| (f64::from(n) + 1.0 / 3.0) / 200.0);
            below += f64::from(u8::from(layers.of(across, at) == 0));
            all += 1.0;
        }
        assert!((below / all - layers.areas[0]).abs() < 0.01, "{below} {all} {:?}", layers.areas);
    }
}
