//! Functions on the hemisphere whose sum is 1 in every direction. A table has one value for each of
//! them.

use std::f32::consts::{FRAC_PI_2, TAU};

use crate::math::rng::Stream;

/// A direction on one side of a sheet: the cosine of its angle to the normal of that side, and its
/// azimuth, rad.
#[derive(Clone, Copy, Debug)]
pub(super) struct Polar {
    pub(super) cos: f32,
    pub(super) phi: f32,
}

/// Division of the circle into sectors. `starts` holds where each begins, rad, rising by less than
/// one turn from the first to the last; `middles` holds the azimuths in the middle of the sectors.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Sectors {
    starts: Vec<f32>,
    middles: Vec<f32>,
}

impl Sectors {
    /// Makes a single sector, the whole circle.
    pub(super) fn full() -> Self {
        Self { starts: vec![0.0], middles: vec![0.0] }
    }

    /// Makes one sector about each azimuth of `phi` (rad, rising within one turn), with borders
    /// half way between neighbours.
    pub(super) fn between(phi: &[f32]) -> Self {
        let last = phi.last().copied().unwrap_or(0.0) - TAU;
        let before = std::iter::once(&last).chain(phi);
        let starts = before.zip(phi).map(|(before, here)| 0.5 * (before + here)).collect();
        Self { starts, middles: phi.to_vec() }
    }

    pub(super) fn len(&self) -> usize {
        self.starts.len()
    }

    fn end(&self, sector: usize) -> f32 {
        self.starts.get(sector + 1).copied().unwrap_or(self.starts[0] + TAU)
    }

    /// Returns the share of the circle that a sector covers.
    pub(super) fn share(&self, sector: usize) -> f64 {
        f64::from(self.end(sector) - self.starts[sector]) / std::f64::consts::TAU
    }

    pub(super) fn middle(&self, sector: usize) -> f32 {
        self.middles[sector]
    }

    pub(super) fn find(&self, phi: f32) -> usize {
        if self.starts.len() == 1 {
            return 0;
        }
        let phi = self.starts[0] + (phi - self.starts[0]).rem_euclid(TAU);
        self.starts.partition_point(|&start| start <= phi).clamp(1, self.len()) - 1
    }

    pub(super) fn sample(&self, sector: usize, u: f32) -> f32 {
        self.starts[sector] + u * (self.end(sector) - self.starts[sector])
    }
}

/// Functions on the hemisphere that are nowhere negative, and whose sum is 1 in every direction.
/// They are numbered in one sequence, by the angle to the normal first, then by azimuth.
#[derive(Clone, Debug, PartialEq)]
pub struct Basis(Kind);

#[derive(Clone, Debug, PartialEq)]
enum Kind {
    /// Functions that are 1 in a cell and 0 elsewhere.
    Cells(Vec<Ring>),
    /// Functions that are linear in the angle to the normal between the angles `theta`, and in the
    /// azimuth between the azimuths `phi`, both rad.
    Hats { theta: Vec<f32>, phi: Vec<f32> },
}

/// Cells between two angles to the normal.
#[derive(Clone, Debug, PartialEq)]
struct Ring {
    /// Squared sines of the two angles.
    sin2: [f32; 2],
    /// Angle in the middle of the ring, rad.
    middle: f32,
    /// Index of the first cell of the ring.
    first: usize,
    sectors: Sectors,
}

/// Functions of a basis that are not 0 in a direction: the index and the value of each.
pub(super) struct Weights {
    list: [(usize, f32); 4],
    len: usize,
}

impl Weights {
    pub(super) fn list(&self) -> &[(usize, f32)] {
        &self.list[..self.len]
    }
}

impl Basis {
    /// Makes functions that are linear between the angles `theta` to the normal and between the
    /// azimuths `phi`, both rad and rising. Below the first angle and above the last they are
    /// constant. With a single azimuth they do not depend on it.
    pub fn linear(theta: &[f32], phi: &[f32]) -> Self {
        Self(Kind::Hats { theta: theta.to_vec(), phi: phi.to_vec() })
    }

    /// Makes one cell about each pair of an angle of `theta` and an azimuth of `phi` (rad, rising),
    /// with borders half way between neighbours; the last ring of cells ends at 90 degrees.
    pub fn cells(theta: &[f32], phi: &[f32]) -> Self {
        let borders = theta.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]));
        let borders: Vec<f32> = borders.chain([FRAC_PI_2]).collect();
        let rings = borders.iter().zip(theta);
        Self::rings(rings.map(|(&end, &middle)| (end, middle, Sectors::between(phi))))
    }

    /// Makes rings of cells. `rings` holds the angle at which each ring ends (rad, rising to 90
    /// degrees; the first begins at 0) and the number of its cells, which are equally wide. The
    /// middle of the first cell is at the azimuth `turn`, rad.
    pub fn patches(rings: &[(f32, usize)], turn: f32) -> Self {
        let mut start = 0.0;
        Self::rings(rings.iter().map(|&(end, cells)| {
            let width = TAU / cells as f32;
            let middles: Vec<f32> = (0..cells).map(|i| turn + i as f32 * width).collect();
            let starts = middles.iter().map(|middle| middle - 0.5 * width).collect();
            // the middle of a cell around the normal is the normal itself
            let middle = if cells == 1 && start == 0.0 { 0.0 } else { 0.5 * (start + end) };
            start = end;
            (end, middle, Sectors { starts, middles })
        }))
    }

    fn rings(rings: impl Iterator<Item = (f32, f32, Sectors)>) -> Self {
        let (mut start, mut first) = (0.0, 0);
        let ring = |(end, middle, sectors): (f32, f32, Sectors)| {
            let sin2 = [start, if end >= FRAC_PI_2 { 1.0 } else { end.sin().powi(2) }];
            let ring = Ring { sin2, middle, first, sectors };
            start = sin2[1];
            first += ring.sectors.len();
            ring
        };
        Self(Kind::Cells(rings.map(ring).collect()))
    }

    /// Returns the number of functions.
    pub fn len(&self) -> usize {
        match &self.0 {
            Kind::Cells(rings) => rings.last().map_or(0, |ring| ring.first + ring.sectors.len()),
            Kind::Hats { theta, phi } => theta.len() * phi.len(),
        }
    }

    /// Returns whether there are no functions.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the integral over the hemisphere of a function times the cosine to the normal.
    pub(super) fn measure(&self, index: usize) -> f64 {
        match &self.0 {
            Kind::Cells(rings) => {
                let (ring, sector) = cell(rings, index);
                let [start, end] = ring.sin2.map(f64::from);
                std::f64::consts::PI * (end - start) * ring.sectors.share(sector)
            }
            Kind::Hats { theta, phi } => {
                let (t, p) = (index / phi.len(), index % phi.len());
                hat_measure(theta, t) * hat_width(phi, p)
            }
        }
    }

    /// Returns the direction in which a function is largest, or the middle of its cell.
    pub(super) fn middle(&self, index: usize) -> Polar {
        match &self.0 {
            Kind::Cells(rings) => {
                let (ring, sector) = cell(rings, index);
                Polar { cos: ring.middle.cos(), phi: ring.sectors.middle(sector) }
            }
            Kind::Hats { theta, phi } => {
                Polar { cos: theta[index / phi.len()].cos(), phi: phi[index % phi.len()] }
            }
        }
    }

    /// Returns the functions that are not 0 in a direction, with their values.
    pub(super) fn weights(&self, at: Polar) -> Weights {
        let mut weights = Weights { list: [(0, 0.0); 4], len: 0 };
        let mut add = |index, weight| {
            if weight > 0.0 {
                weights.list[weights.len] = (index, weight);
                weights.len += 1;
            }
        };
        match &self.0 {
            Kind::Cells(rings) => {
                let sin2 = 1.0 - at.cos * at.cos;
                let ring = rings.partition_point(|ring| ring.sin2[1] <= sin2).min(rings.len() - 1);
                add(rings[ring].first + rings[ring].sectors.find(at.phi), 1.0);
            }
            Kind::Hats { theta, phi } => {
                let angle = at.cos.clamp(0.0, 1.0).acos();
                let thetas = between(theta, angle);
                let phis = around(phi, at.phi);
                for (t, of_theta) in thetas {
                    for (p, of_phi) in phis {
                        add(t * phi.len() + p, of_theta * of_phi);
                    }
                }
            }
        }
        weights
    }

    /// Draws a direction with the density function x cosine / measure.
    pub(super) fn sample(&self, index: usize, rng: &mut Stream) -> Polar {
        match &self.0 {
            Kind::Cells(rings) => {
                let (ring, sector) = cell(rings, index);
                let u = rng.square();
                let sin2 = ring.sin2[0] + u.x * (ring.sin2[1] - ring.sin2[0]);
                Polar { cos: (1.0 - sin2).max(1e-12).sqrt(), phi: ring.sectors.sample(sector, u.y) }
            }
            Kind::Hats { theta, phi } => {
                let (t, p) = (index / phi.len(), index % phi.len());
                Polar { cos: sample_hat(theta, t, rng), phi: sample_turn(phi, p, rng) }
            }
        }
    }
}

fn cell(rings: &[Ring], index: usize) -> (&Ring, usize) {
    let after = rings.partition_point(|ring| ring.first <= index).max(1);
    let ring = &rings[after - 1];
    (ring, index - ring.first)
}

/// Returns the two nodes next to `x` with their weights. Beyond the first or the last node that
/// node alone has weight.
fn between(nodes: &[f32], x: f32) -> [(usize, f32); 2] {
    let next = nodes.partition_point(|&node| node < x);
    match next {
        0 => [(0, 1.0), (0, 0.0)],
        n if n == nodes.len() => [(n - 1, 1.0), (0, 0.0)],
        n => {
            let along = (x - nodes[n - 1]) / (nodes[n] - nodes[n - 1]);
            [(n - 1, 1.0 - along), (n, along)]
        }
    }
}

/// Returns the two nodes next to `x` on the circle with their weights.
fn around(nodes: &[f32], x: f32) -> [(usize, f32); 2] {
    let count = nodes.len();
    if count == 1 {
        return [(0, 1.0), (0, 0.0)];
    }
    let x = nodes[0] + (x - nodes[0]).rem_euclid(TAU);
    let next = nodes.partition_point(|&node| node <= x).clamp(1, count);
    let end = if next == count { nodes[0] + TAU } else { nodes[next] };
    let along = ((x - nodes[next - 1]) / (end - nodes[next - 1])).clamp(0.0, 1.0);
    [(next - 1, 1.0 - along), (next % count, along)]
}

/// Returns the lengths, rad, of the intervals before and after a node on the circle.
fn gaps(nodes: &[f32], index: usize) -> [f32; 2] {
    let count = nodes.len();
    let before = if index == 0 { nodes[count - 1] - TAU } else { nodes[index - 1] };
    let after = if index + 1 == count { nodes[0] + TAU } else { nodes[index + 1] };
    [nodes[index] - before, after - nodes[index]]
}

/// Returns the integral of a hat function over the circle, rad.
fn hat_width(nodes: &[f32], index: usize) -> f64 {
    let [before, after] = gaps(nodes, index).map(f64::from);
    0.5 * (before + after)
}

/// Returns the integral of a hat function of the angle to the normal, times the cosine and the sine
/// of that angle.
fn hat_measure(theta: &[f32], index: usize) -> f64 {
    // integral of (x - zero) / (one - zero) times sin(2x) / 2 over x between `from` and `to`
    let linear = |zero: f64, one: f64, from: f64, to: f64| {
        let at = |x: f64| (2.0 * x).sin() / 8.0 - (x - zero) * (2.0 * x).cos() / 4.0;
        (at(to) - at(from)) / (one - zero)
    };
    let flat = |from: f64, to: f64| 0.5 * (to.sin().powi(2) - from.sin().powi(2));
    let node = f64::from(theta[index]);
    let before = match index {
        0 => flat(0.0, node),
        _ => {
            let before = f64::from(theta[index - 1]);
            linear(before, node, before, node)
        }
    };
    let after = match theta.get(index + 1) {
        None => flat(node, std::f64::consts::FRAC_PI_2),
        Some(&after) => linear(after.into(), node, node, after.into()),
    };
    before + after
}

/// Draws the cosine of an angle whose density is a hat function of the angle, times its cosine and
/// sine. Candidates are uniform in the squared sine, and each is accepted with the value of the hat
/// as its probability; at least a third of them are.
fn sample_hat(theta: &[f32], index: usize, rng: &mut Stream) -> f32 {
    let low = if index == 0 { 0.0 } else { theta[index - 1].sin().powi(2) };
    let high = theta.get(index + 1).map_or(1.0, |next| next.sin().powi(2));
    // so many attempts fail only where rounding is at fault
    for _ in 0..1000 {
        let sin2 = low + rng.uniform() * (high - low);
        let cos = (1.0 - sin2).max(1e-12).sqrt();
        let weights = between(theta, cos.acos());
        let weight: f32 = weights.iter().filter(|(i, _)| *i == index).map(|(_, w)| w).sum();
        if rng.uniform() < weight {
            return cos;
        }
    }
    theta[index].cos().max(1e-6)
}

/// Draws an azimuth whose density is a hat function on the circle.
fn sample_turn(phi: &[f32], index: usize, rng: &mut Stream) -> f32 {
    if phi.len() == 1 {
        return rng.uniform() * TAU;
    }
    let [before, after] = gaps(phi, index);
    let u = rng.uniform() * (before + after);
    match u < before {
        true => phi[index] - before * (1.0 - (u / before).sqrt()),
        false => phi[index] + after * (1.0 - ((before + after - u) / after).max(0.0).sqrt()),
    }
}
