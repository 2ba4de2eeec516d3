//! Intensity that depends on the direction: measured tables and cosine lobes.

use std::{f64::consts::TAU, sync::Arc};

use glam::{DVec3, Vec3};

use super::checks::check_direction;
use crate::{
    error::{Checked, Problem, check_range, number},
    math::{
        geometry::{Frame, unit_vector},
        rng::Stream,
        sampling::{cosine_power, cosine_power_density, uniform_circle, weighted_choice},
    },
    scene::material::MAX_EXPONENT,
};

#[cfg(test)]
mod tests;

/// Intensity of a light by the direction in the scene, per W of the light's power.
#[derive(Clone, Debug)]
pub struct Intensity {
    pattern: Pattern,
    /// Axes in the scene: the normal is the aim, the tangent points to C = 0 and the bitangent to
    /// C = 90 degrees.
    frame: Frame,
}

#[derive(Clone, Debug)]
enum Pattern {
    Table(Arc<IntensityTable>),
    /// Exponent n of I ~ cos^n of the angle to the aim; nothing is emitted backwards.
    Cosine(f32),
}

impl Intensity {
    /// Makes the intensity of a measured table. Its vertical angle 0 lies along `aim`, C = 0 along
    /// `zero_plane`, made perpendicular to `aim`, and C = 90 degrees along `zero_plane` x `aim`.
    /// Error: a vector has length 0, or the two are parallel.
    pub fn table(
        table: Arc<IntensityTable>,
        aim: DVec3,
        zero_plane: DVec3,
    ) -> Result<Self, Problem> {
        let aim = check_direction(aim).map_err(|problem| problem.of("aim"))?;
        let across = unit_vector(zero_plane).map(|v| v.reject_from_normalized(aim));
        let Some(tangent) = across.filter(|v| v.length() > 1e-6).and_then(unit_vector) else {
            let problem = "zero_plane: has no part across `aim`";
            return Err(Problem::new(problem, "say where C = 0 lies, across the way it aims"));
        };
        let bitangent = tangent.cross(aim).as_vec3();
        let frame = Frame { tangent: tangent.as_vec3(), bitangent, normal: aim.as_vec3() };
        Ok(Self { pattern: Pattern::Table(table), frame })
    }

    /// Makes an intensity I ~ cos^n of the angle to `aim`, where n is the `exponent` from 0 to 1e9;
    /// nothing is emitted backwards. Error: the exponent is outside this range, or `aim` has
    /// length 0.
    pub fn cosine(exponent: f64, aim: DVec3) -> Result<Self, Problem> {
        check_range(exponent, 0.0, MAX_EXPONENT).map_err(|problem| problem.of("cosine"))?;
        let aim = check_direction(aim).map_err(|problem| problem.of("aim"))?;
        let frame = Frame::new(aim.as_vec3().normalize());
        Ok(Self { pattern: Pattern::Cosine(exponent as f32), frame })
    }

    /// Returns the measured table, or `None` for a cosine lobe.
    pub fn as_table(&self) -> Option<&Arc<IntensityTable>> {
        match &self.pattern {
            Pattern::Table(table) => Some(table),
            Pattern::Cosine(_) => None,
        }
    }

    /// Returns the axes in the scene: the normal is the aim, the tangent points to C = 0 and the
    /// bitangent to C = 90 degrees.
    pub fn axes(&self) -> &Frame {
        &self.frame
    }

    /// Draws a direction whose density is this intensity.
    #[inline(never)]
    pub fn sample(&self, rng: &mut Stream) -> Vec3 {
        let local = match &self.pattern {
            Pattern::Table(table) => table.sample(rng),
            Pattern::Cosine(exponent) => cosine_power(*exponent, rng.square()),
        };
        self.frame.to_world(local).normalize()
    }

    /// Returns the intensity along a unit vector per W of the light's power, 1/sr.
    pub fn towards(&self, direction: Vec3) -> f32 {
        let Frame { tangent, bitangent, normal } = self.frame;
        match &self.pattern {
            Pattern::Table(table) => {
                let local = [tangent, bitangent, normal].map(|axis| direction.dot(axis));
                table.at(local.into()) as f32
            }
            Pattern::Cosine(exponent) => {
                cosine_power_density(*exponent, 0.5 * direction.distance_squared(normal))
            }
        }
    }
}

/// Intensity at angles C about the axis and V from the axis (LM-63 type C). It is linear in both
/// angles between those of the table, 0 beyond the first and the last V, and scaled to a flux of 1.
#[derive(Clone, Debug)]
pub struct IntensityTable {
    /// Angles C from 0 to 2 pi, rad.
    c: Vec<f64>,
    /// Angles V between 0 and pi, rad.
    v: Vec<f64>,
    /// Intensities, 1/sr: for each C those of all V.
    values: Vec<f64>,
    /// Running sums of the flux of the cells: for each pair of neighbouring C those of all pairs of
    /// neighbouring V.
    running: Vec<f64>,
    /// Flux of the table as it was given, in its own unit.
    flux: f64,
}

impl IntensityTable {
    /// Makes a table from rising angles, degrees (`c` from 0 to 360, `v` within 0 to 180), and the
    /// intensities, which hold for each C one value for each V (at least 0, in any unit). Error:
    /// other angles, numbers or lengths, or a table without light.
    pub fn new(c: &[f64], v: &[f64], values: Vec<f64>) -> Result<Self, Problem> {
        check_rising(c, 360.0).map_err(|problem| problem.of("horizontal angles"))?;
        check_rising(v, 180.0).map_err(|problem| problem.of("vertical angles"))?;
        if c[0] != 0.0 || c[c.len() - 1] != 360.0 {
            let problem = "horizontal angles: do not go round from 0 to 360";
            return Err(Problem::new(problem, "mirror what is symmetric"));
        }
        if values.len() != c.len() * v.len() {
            let problem =
                format!("{} intensities for {} x {} angles", values.len(), c.len(), v.len());
            return Err(Problem::new(problem, "give one for each pair of angles"));
        }
        for value in &values {
            check_range(*value, 0.0, 1e30).map_err(|problem| problem.of("intensity"))?;
        }
        let radians = |degrees: &[f64]| degrees.iter().map(|d| d.to_radians()).collect();
        let mut table =
            Self { c: radians(c), v: radians(v), values, running: Vec::new(), flux: 0.0 };
        let mut flux = 0.0;
        for j in 0..table.c.len() - 1 {
            for k in 0..table.v.len() - 1 {
                let [near, far] = shares(table.v[k], table.v[k + 1]);
                let [a, b, d, e] = table.corners(j, k);
                flux += 0.5 * (table.c[j + 1] - table.c[j]) * ((a + d) * near + (b + e) * far);
                table.running.push(flux);
            }
        }
        if flux <= 0.0 {
            return Err(Problem::new("all intensities are 0", "a lamp shines somewhere"));
        }
        table.values.iter_mut().for_each(|value| *value /= flux);
        table.flux = flux;
        Ok(table)
    }

    /// Returns the integral over all directions of the intensities that the table was made from, in
    /// their unit times sr.
    pub fn flux(&self) -> f64 {
        self.flux
    }

    /// Returns the intensities at the corners of a cell: (C, V), (C, next V), (next C, V), (next C,
    /// next V).
    fn corners(&self, j: usize, k: usize) -> [f64; 4] {
        let at = |j: usize, k: usize| self.values[j * self.v.len() + k];
        [at(j, k), at(j, k + 1), at(j + 1, k), at(j + 1, k + 1)]
    }

    /// Returns the intensity, 1/sr, in a direction given in the axes of the table.
    fn at(&self, local: Vec3) -> f64 {
        let [x, y, z] = local.as_dvec3().to_array();
        let v = x.hypot(y).atan2(z);
        if !(self.v[0]..=self.v[self.v.len() - 1]).contains(&v) {
            return 0.0;
        }
        let c = y.atan2(x);
        let c = if c < 0.0 { c + TAU } else { c };
        let cell = |angles: &[f64], angle: f64| {
            angles.partition_point(|&a| a <= angle).clamp(1, angles.len() - 1) - 1
        };
        let (j, k) = (cell(&self.c, c), cell(&self.v, v));
        bilinear(self.corners(j, k), part(&self.c, j, c), part(&self.v, k, v))
    }

    /// Draws a direction, in the axes of the table, whose density is the intensity. A cell is
    /// chosen by its flux; in the cell, directions uniform per solid angle are accepted with the
    /// probability of their intensity over the largest of the cell.
    fn sample(&self, rng: &mut Stream) -> Vec3 {
        let cell = weighted_choice(&self.running, rng.uniform_fine()).index;
        let (j, k) = (cell / (self.v.len() - 1), cell % (self.v.len() - 1));
        let corners = self.corners(j, k);
        let largest = corners.into_iter().fold(0.0, f64::max);
        let versine = |angle: f64| 2.0 * (0.5 * angle).sin().powi(2);
        let [low, high] = [self.v[k], self.v[k + 1]].map(versine);
        loop {
            let u = rng.square().as_dvec2();
            let versine = low + u.y * (high - low);
            let v = 2.0 * (0.5 * versine).sqrt().min(1.0).asin();
            let intensity = bilinear(corners, u.x, part(&self.v, k, v).clamp(0.0, 1.0));
            if f64::from(rng.uniform()) * largest < intensity {
                let c = self.c[j] + u.x * (self.c[j + 1] - self.c[j]);
                let turn = uniform_circle((c / TAU) as f32);
                let sin = (versine * (2.0 - versine)).max(0.0).sqrt() as f32;
                return Vec3::new(sin * turn.x, sin * turn.y, (1.0 - versine) as f32);
            }
        }
    }
}

/// Returns where `angle` lies between the angle at index `i` (0) and the next (1).
fn part(angles: &[f64], i: usize, angle: f64) -> f64 {
    (angle - angles[i]) / (angles[i + 1] - angles[i])
}

fn bilinear([a, b, d, e]: [f64; 4], s: f64, t: f64) -> f64 {
    (1.0 - s) * ((1.0 - t) * a + t * b) + s * ((1.0 - t) * d + t * e)
}

/// Returns two integrals of sin V between two angles: with a weight that falls from 1 to 0, and
/// with one that rises from 0 to 1. With the middle m and half the width x they are sin m sin x -+
/// cos m (sin x / x - cos x); for small x the difference in brackets is computed by its series,
/// which loses nothing to rounding.
fn shares(from: f64, to: f64) -> [f64; 2] {
    let (m, x) = (0.5 * (from + to), 0.5 * (to - from));
    let x2 = x * x;
    let difference = match x < 0.1 {
        true => x2 * (1.0 / 3.0 - x2 * (1.0 / 30.0 - x2 * (1.0 / 840.0 - x2 / 45_360.0))),
        false => x.sin() / x - x.cos(),
    };
    let (even, odd) = (m.sin() * x.sin(), m.cos() * difference);
    [even - odd, even + odd].map(|share| share.max(0.0))
}

/// Checks angles, degrees. Error: there are fewer than two, they do not rise, or one is outside 0
/// to `most`.
fn check_rising(angles: &[f64], most: f64) -> Checked {
    if angles.len() < 2 {
        return Err(Problem::new(format!("{} of them", angles.len()), "give at least two"));
    }
    for angle in angles {
        check_range(*angle, 0.0, most)?;
    }
    match angles.windows(2).find(|pair| pair[0].to_radians() >= pair[1].to_radians()) {
        None => Ok(()),
        Some(pair) => {
            let problem = format!("{} comes after {}", number(pair[1]), number(pair[0]));
            Err(Problem::new(problem, "they must rise"))
        }
    }
}
