//! Exact values, and the comparison of estimates with them.

use phylux::results::FaceResult;

use crate::world::Point;

/// Estimates with the exact values that each should meet within 4 standard errors. Where the errors
/// come from 128 batches, the odds of a false alarm are 1.1e-4 for each comparison (Student's t,
/// 127 degrees of freedom). Seeds are fixed, so a false alarm can only come when a random stream is
/// changed.
pub struct Comparisons {
    topic: &'static str,
    largest_error: f64,
    rounding: f64,
    rows: Vec<Row>,
}

struct Row {
    what: String,
    estimate: f64,
    standard_error: f64,
    exact: f64,
}

impl Comparisons {
    /// Starts the comparisons of one topic. Every standard error must be at most the fraction
    /// `largest_error` of the exact value.
    pub fn new(topic: &'static str, largest_error: f64) -> Self {
        Self { topic, largest_error, rounding: 1e-5, rows: Vec::new() }
    }

    /// Sets the relative deviation that is allowed beyond chance. The default of 1e-5 covers single
    /// precision and the offset of rays from surfaces.
    pub fn rounding(self, rounding: f64) -> Self {
        Self { rounding, ..self }
    }

    /// Adds any estimate.
    pub fn add(&mut self, what: impl Into<String>, estimate: f64, standard_error: f64, exact: f64) {
        self.rows.push(Row { what: what.into(), estimate, standard_error, exact });
    }

    /// Adds the flux of one face in one band.
    pub fn flux(&mut self, what: impl Into<String>, face: &FaceResult, band: usize, exact: f64) {
        let se = face.flux_se[band].unwrap_or(f64::INFINITY);
        self.add(what, face.flux[band], se, exact);
    }

    /// Adds the irradiance of one face in one band.
    pub fn irradiance(
        &mut self,
        what: impl Into<String>,
        face: &FaceResult,
        band: usize,
        exact: f64,
    ) {
        let se = face.irradiance_se[band].unwrap_or(f64::INFINITY);
        self.add(what, face.irradiance[band], se, exact);
    }

    /// Prints and judges all comparisons. `comparisons` is their number, as the test's comment
    /// states it.
    pub fn finish(self, comparisons: usize) {
        assert_eq!(self.rows.len(), comparisons, "{}: comparisons", self.topic);
        let mut wrong = Vec::new();
        for Row { what, estimate, standard_error, exact } in &self.rows {
            let z = (estimate - exact) / standard_error;
            let relative = standard_error / exact.abs();
            let line = format!(
                "{}: {what}: {estimate:.6} exact {exact:.6}, standard error {:.3} %, z {z:+.2}",
                self.topic,
                100.0 * relative
            );
            println!("{line}");
            // each condition is written as what must hold, so that NaN fails
            let off = (estimate - exact).abs() - self.rounding * exact.abs();
            let holds = off <= 4.0 * standard_error && relative <= self.largest_error;
            if !holds {
                wrong.push(line);
            }
        }
        assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
    }
}

/// Returns the integral of `f` over [a, b], by Gauss's rule of five points on `pieces` equal
/// pieces.
pub fn integral(a: f64, b: f64, pieces: usize, f: impl Fn(f64) -> f64) -> f64 {
    const NODES: [(f64, f64); 5] = [
        (0.0, 0.568_888_888_888_888_9),
        (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
        (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
        (0.906_179_845_938_664, 0.236_926_885_056_189_08),
        (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
    ];
    let half = 0.5 * (b - a) / pieces as f64;
    let piece = |i: usize| {
        let middle = a + (2 * i + 1) as f64 * half;
        NODES.iter().map(|(x, weight)| weight * half * f(middle + half * x)).sum::<f64>()
    };
    (0..pieces).map(piece).sum()
}

/// Returns the mean of `f` over a parallelogram.
pub fn mean_over(corner: Point, u: Point, v: Point, f: impl Fn(Point) -> f64) -> f64 {
    integral(0.0, 1.0, 4, |s| {
        integral(0.0, 1.0, 4, |t| f([0, 1, 2].map(|i| corner[i] + s * u[i] + t * v[i])))
    })
}

/// Returns the irradiance at `p`, on a surface with this unit normal, by a polygon of radiance 1
/// that lies wholly above the horizon of the surface (Lambert 1760): half the sum over the edges of
/// the angle that an edge subtends, times the cosine between the normal and the normal of the plane
/// through `p` and the edge.
pub fn polygon_irradiance(p: Point, normal: Point, polygon: &[Point]) -> f64 {
    let p = glam::DVec3::from(p);
    let to = |i: usize| (glam::DVec3::from(polygon[i % polygon.len()]) - p).normalize();
    let edge = |i: usize| {
        let (a, b) = (to(i), to(i + 1));
        let cross = a.cross(b);
        let angle = cross.length().atan2(a.dot(b));
        angle * cross.normalize_or_zero().dot(normal.into())
    };
    0.5 * (0..polygon.len()).map(edge).sum::<f64>().abs()
}

/// Returns Fresnel's reflectances of the two polarisations (s and p) at the cosine of incidence
/// `cos`, on the way into a medium of the relative index `eta` (Born and Wolf, 1.5).
pub fn fresnel(cos: f64, eta: f64) -> [f64; 2] {
    let sin2 = (1.0 - cos * cos) / (eta * eta);
    if sin2 >= 1.0 {
        return [1.0, 1.0];
    }
    let beyond = (1.0 - sin2).sqrt();
    let s = (cos - eta * beyond) / (cos + eta * beyond);
    let p = (eta * cos - beyond) / (eta * cos + beyond);
    [s * s, p * p]
}

/// Asserts that a closed form agrees with the published number, to the digits that are published.
/// `digit` is the unit of the last one.
pub fn rounds_to(value: f64, published: f64, digit: f64) {
    let off = (value - published).abs();
    assert!(off <= 0.501 * digit, "{value} does not round to the published {published}");
}
