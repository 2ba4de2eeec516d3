//! Light or ink in soft round splats, over what is behind them.

use glam::Vec3;

use super::{Picture, encoded};

/// What is behind everything in a picture of splats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ground {
    /// Nearly black: splats shine on it.
    Dark,
    /// Nearly white: splats are ink on it.
    Light,
}

impl Ground {
    /// Returns its colour, linear.
    pub fn linear(self) -> Vec3 {
        match self {
            Self::Dark => Vec3::new(0.0028, 0.0038, 0.0065),
            Self::Light => Vec3::ONE,
        }
    }

    /// Returns its colour, sRGB.
    pub fn paper(self) -> Vec3 {
        encoded(self.linear())
    }

    /// Returns the colour of text on it, as in SVG.
    pub(super) fn text(self) -> &'static str {
        match self {
            Self::Dark => "#d5d9e0",
            Self::Light => "#1a1a1a",
        }
    }

    /// Returns the beginning of a drawing of this size on it, in SVG, with letters of `em` pixels.
    pub(super) fn sheet(self, width: f64, height: f64, em: f64) -> String {
        let [r, g, b] = self.paper().to_array().map(|c| (255.0 * c).round() as u8);
        format!(
            "<svg width=\"{width}\" height=\"{height}\" xmlns=\"http://www.w3.org/2000/svg\" \
             font-family=\"sans-serif\" font-size=\"{em}\" fill=\"{}\">\
             <rect width=\"{width}\" height=\"{height}\" fill=\"rgb({r},{g},{b})\"/>",
            self.text()
        )
    }

    /// Returns what a splat of a colour adds: light, or the logarithm of what ink lets through.
    fn shed(self, colour: Vec3) -> Vec3 {
        match self {
            Self::Dark => colour,
            Self::Light => (colour * INK).max(Vec3::splat(DARKEST)).map(|c| -c.ln()),
        }
    }

    /// Returns the colour in which a mark is seen on this ground, sRGB, from its colour on a dark one,
    /// linear.
    pub fn mark(self, colour: Vec3) -> Vec3 {
        encoded(match self {
            Self::Dark => colour,
            Self::Light => colour * INK,
        })
    }
}

/// Inks are darker than lights of the same name, by this factor.
const INK: f32 = 0.42;
/// The darkest component of an ink.
const DARKEST: f32 = 0.02;

/// Sums of splats over the pixels of a picture.
pub struct Splats {
    ground: Ground,
    width: usize,
    height: usize,
    /// Light that is added, or the logarithm of what ink lets through.
    sums: Vec<Vec3>,
}

impl Splats {
    /// Makes an empty sheet of so many pixels.
    pub fn new(ground: Ground, width: usize, height: usize) -> Self {
        Self { ground, width, height, sums: vec![Vec3::ZERO; width * height] }
    }

    /// Adds a disc about a point, in pixels from the upper left corner. In its middle it has `amount`
    /// times `colour` (linear, on a dark ground), and towards its edge, at `radius` pixels, it fades
    /// to nothing, as (1 - (d / radius)^2)^2 at the distance d.
    pub fn add(&mut self, at: [f32; 2], radius: f32, colour: Vec3, amount: f32) {
        let colour = self.ground.shed(colour);
        let range = |at: f32, size: usize| {
            // pixel i has its middle at i + 0.5
            let from = (at - radius - 0.5).ceil().max(0.0) as usize;
            let to = (at + radius + 0.5).floor().clamp(0.0, size as f32) as usize;
            from..to.max(from)
        };
        for y in range(at[1], self.height) {
            for x in range(at[0], self.width) {
                let (dx, dy) = (x as f32 + 0.5 - at[0], y as f32 + 0.5 - at[1]);
                let inside = 1.0 - (dx * dx + dy * dy) / (radius * radius);
                if inside > 0.0 {
                    self.sums[y * self.width + x] += inside * inside * amount * colour;
                }
            }
        }
    }

    /// Adds light (linear, on a dark ground) to every pixel, row by row.
    pub fn add_all(&mut self, light: &[Vec3]) {
        for (sum, light) in self.sums.iter_mut().zip(light) {
            let amount = light.max_element();
            if amount > 0.0 {
                *sum += amount * self.ground.shed(*light / amount);
            }
        }
    }

    /// Returns the picture of the splats over linear colours, row by row. Light adds up to white, and
    /// ink to black, without ever reaching either.
    pub fn over(&self, behind: &[Vec3]) -> Picture {
        let shown = |(sum, behind): (&Vec3, &Vec3)| {
            let through = sum.map(|s| (-s).exp());
            encoded(match self.ground {
                Ground::Dark => Vec3::ONE - (Vec3::ONE - *behind) * through,
                Ground::Light => *behind * through,
            })
        };
        Picture::new(self.width, self.sums.iter().zip(behind).map(shown))
    }
}

/// How densely points lie in a picture.
pub struct Crowd {
    side: f32,
    across: usize,
    down: usize,
    /// Points per pixel, of each square of pixels.
    densities: Vec<f32>,
}

/// Squares in which points are counted, across a picture.
const SQUARES: f32 = 120.0;

impl Crowd {
    /// Counts points, each for its weight, in squares of pixels, and spreads the counts over the
    /// squares around.
    pub fn new(width: usize, height: usize, points: impl Iterator<Item = ([f32; 2], f32)>) -> Self {
        let side = (width as f32 / SQUARES).max(2.0);
        let [across, down] = [width, height].map(|size| (size as f32 / side).ceil() as usize + 1);
        let mut counts = vec![0.0; across * down];
        for (at, weight) in points {
            let [x, y] = at.map(|at| (at.max(0.0) / side) as usize);
            counts[y.min(down - 1) * across + x.min(across - 1)] += weight;
        }
        let at = |x: isize, y: isize| {
            let inside = (0..across as isize).contains(&x) && (0..down as isize).contains(&y);
            inside.then(|| counts[y as usize * across + x as usize])
        };
        let mean = |i: usize| {
            let (x, y) = ((i % across) as isize, (i / across) as isize);
            let (mut sum, mut weights) = (0.0, 0.0);
            let around = (-1..=1).flat_map(|dx: isize| (-1..=1).map(move |dy: isize| (dx, dy)));
            for (dx, dy) in around {
                let weight = ((2 - dx.abs()) * (2 - dy.abs())) as f32;
                if let Some(count) = at(x + dx, y + dy) {
                    (sum, weights) = (sum + weight * count, weights + weight);
                }
            }
            sum / (weights * side * side)
        };
        let densities = (0..counts.len()).map(mean).collect();
        Self { side, across, down, densities }
    }

    /// Returns the number of points per pixel that half of the squares with points exceed.
    pub fn usual(&self) -> f32 {
        let mut some: Vec<f32> = self.densities.iter().copied().filter(|d| *d > 0.0).collect();
        some.sort_unstable_by(f32::total_cmp);
        some.get(some.len() / 2).copied().unwrap_or(0.0)
    }

    /// Returns the number of points per pixel around a place.
    pub fn density(&self, at: [f32; 2]) -> f32 {
        // between the middles of four squares
        let [x, y] = at.map(|at| (at / self.side - 0.5).max(0.0));
        let [i, j] = [(x as usize).min(self.across - 1), (y as usize).min(self.down - 1)];
        let [k, l] = [(i + 1).min(self.across - 1), (j + 1).min(self.down - 1)];
        let (u, v) = ((x - i as f32).min(1.0), (y - j as f32).min(1.0));
        let of = |x: usize, y: usize| self.densities[y * self.across + x];
        let above = of(i, j) * (1.0 - u) + of(k, j) * u;
        let below = of(i, l) * (1.0 - u) + of(k, l) * u;
        above * (1.0 - v) + below * v
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A splat is a disc with soft edges: the same on all sides, less the farther from its middle,
    /// and nothing beyond its radius. Its sum is a third of that of a disc without soft edges.
    #[test]
    fn a_splat_is_a_soft_disc() {
        let (size, radius) = (41, 15.0);
        let mut sheet = Splats::new(Ground::Dark, size, size);
        sheet.add([20.5, 20.5], radius, Vec3::ONE, 1.0);
        let at = |x: usize, y: usize| sheet.sums[y * size + x].x;
        assert_eq!(at(20, 20), 1.0);
        for away in 1..20 {
            let [left, right] = [at(20 - away, 20), at(20 + away, 20)];
            let [up, down] = [at(20, 20 - away), at(20, 20 + away)];
            assert!(
                left == right && right == up && up == down,
                "{away}: {left} {right} {up} {down}"
            );
            assert!(right < at(19 + away, 20) || right == 0.0, "{away}");
            assert_eq!(right > 0.0, (away as f32) < radius, "{away}");
        }
        // round, not square: along a diagonal it ends where it does along a row
        assert!(at(30, 30) > 0.0 && at(31, 31) == 0.0);
        // soft: close to its edge it is faint, without a step
        assert!(at(20 + 13, 20) < 0.1 && at(20 + 7, 20) > 0.5);
        let sum: f32 = sheet.sums.iter().map(|sum| sum.x).sum();
        let exact = std::f32::consts::PI / 3.0 * radius * radius;
        assert!((sum / exact - 1.0).abs() < 0.01, "{sum} {exact}");
        // one at the border, and one beyond it, take no harm
        sheet.add([-3.0, 0.0], 5.0, Vec3::ONE, 1.0);
        sheet.add([1e9, -1e9], 5.0, Vec3::ONE, 1.0);
    }

    /// Light brightens a dark ground and ink darkens a light one, the more the more there is of it.
    #[test]
    fn light_adds_up_on_dark_and_ink_on_light() {
        let middle = |ground: Ground, times: usize| {
            let mut sheet = Splats::new(ground, 1, 1);
            (0..times).for_each(|_| sheet.add([0.5, 0.5], 2.0, Vec3::new(1.0, 0.2, 0.1), 0.4));
            let picture = sheet.over(&[ground.linear()]);
            picture.rgb().iter().map(|c| u32::from(*c)).sum::<u32>()
        };
        for (ground, brighter) in [(Ground::Dark, true), (Ground::Light, false)] {
            let sums = [0, 1, 2, 5].map(|times| middle(ground, times));
            assert_eq!(sums.is_sorted(), brighter, "{ground:?}: {sums:?}");
            assert!(sums[0].abs_diff(sums[3]) > 100, "{ground:?}: {sums:?}");
        }
    }

    /// Even points have their density everywhere but at the border, and twice as many twice that.
    #[test]
    fn a_crowd_is_as_dense_as_its_points() {
        let points = |step: usize| {
            (0..200usize).step_by(step).flat_map(move |y| {
                (0..300usize).step_by(step).map(move |x| ([x as f32 + 0.5, y as f32 + 0.5], 1.0))
            })
        };
        for step in [1, 2] {
            let crowd = Crowd::new(300, 200, points(step));
            let exact = 1.0 / (step * step) as f32;
            for at in [[150.0, 100.0], [33.3, 71.9], [250.0, 20.0]] {
                let found = crowd.density(at);
                assert!((found / exact - 1.0).abs() < 0.25, "{at:?}: {found} {exact}");
            }
            assert!((crowd.usual() / exact - 1.0).abs() < 0.1, "{}", crowd.usual());
        }
        assert_eq!(Crowd::new(300, 200, std::iter::empty()).density([0.0, 199.0]), 0.0);
    }
}
