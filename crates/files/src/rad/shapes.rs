//! Makes triangles of Radiance's surfaces. Round shapes get 64 sides and have the area of the true
//! shape.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use phylux_core::math::geometry::{area, triangulate};

const SIDES: usize = 64;

/// Cuts a polygon with counter-clockwise corners into triangles.
pub fn polygon(corners: &[DVec3]) -> Vec<[DVec3; 3]> {
    let cut = triangulate(corners);
    let cut = match cut.is_empty() {
        // a face must not vanish, so a polygon that cannot be cut becomes a fan
        true => (2..corners.len()).map(|i| [0, i - 1, i]).collect(),
        false => cut,
    };
    cut.iter().map(|triangle| triangle.map(|i| corners[i])).collect()
}

/// Returns corner `i` of a regular polygon of [`SIDES`] corners on a circle of this radius about
/// the origin, perpendicular to `axis`. Callers enlarge the radius so that shapes keep their area.
fn corner(axis: DVec3, radius: f64, i: usize) -> DVec3 {
    let (x, y) = axis.any_orthonormal_pair();
    let (sin, cos) = (TAU * (i % SIDES) as f64 / SIDES as f64).sin_cos();
    radius * (cos * x + sin * y)
}

/// Returns the side of a cone between two circles, without its ends; the front faces outwards.
pub fn cone(from: DVec3, to: DVec3, radii: [f64; 2]) -> Vec<[DVec3; 3]> {
    let Some(axis) = (to - from).try_normalize() else { return Vec::new() };
    // the sides are trapezoids; together they have the cone's area if both ends are larger by
    // `scale`
    let (height2, step) = ((to - from).length_squared(), PI / SIDES as f64);
    let difference2 = ((radii[1] - radii[0]) * step.cos()).powi(2);
    let slant2 = height2 + (radii[1] - radii[0]).powi(2);
    let wanted2 = slant2 * (PI / (SIDES as f64 * step.sin())).powi(2);
    let scale2 =
        2.0 * wanted2 / (height2 + (height2 * height2 + 4.0 * difference2 * wanted2).sqrt());
    let ends =
        [(from, radii[0]), (to, radii[1])].map(|(end, radius)| (end, scale2.sqrt() * radius));
    let mut triangles = Vec::new();
    for i in 0..SIDES {
        let [[a, b], [d, c]] =
            ends.map(|(end, radius)| [i, i + 1].map(|i| end + corner(axis, radius, i)));
        triangles.extend(
            [[a, b, c], [a, c, d]].into_iter().filter(|[a, b, c]| a != b && b != c && c != a),
        );
    }
    triangles
}

/// Returns a disc with a hole, its front towards `normal`.
pub fn ring(center: DVec3, normal: DVec3, radii: [f64; 2]) -> Vec<[DVec3; 3]> {
    let Some(axis) = normal.try_normalize() else { return Vec::new() };
    let step = TAU / SIDES as f64;
    let scale = (step / step.sin()).sqrt();
    let [inner, outer] = [radii[0].min(radii[1]), radii[0].max(radii[1])].map(|r| r * scale);
    let mut triangles = Vec::new();
    for i in 0..SIDES {
        let [[a, b], [d, c]] =
            [inner, outer].map(|radius| [i, i + 1].map(|i| center + corner(axis, radius, i)));
        triangles.push([d, c, b]);
        if inner > 0.0 {
            triangles.push([d, b, a]);
        }
    }
    triangles
}

/// Returns a sphere whose front faces outwards.
pub fn sphere(center: DVec3, radius: f64) -> Vec<[DVec3; 3]> {
    const ROWS: usize = SIDES / 2;
    let at = |row: usize, column: usize| {
        let (sin, cos) = (PI * row as f64 / ROWS as f64).sin_cos();
        match row {
            0 => DVec3::Z,
            ROWS => DVec3::NEG_Z,
            _ => corner(DVec3::Z, sin, column) + cos * DVec3::Z,
        }
    };
    let mut triangles = Vec::new();
    for (row, column) in (0..ROWS).flat_map(|row| (0..SIDES).map(move |column| (row, column))) {
        let [a, d] = [column, column + 1].map(|column| at(row, column));
        let [b, c] = [column, column + 1].map(|column| at(row + 1, column));
        if row + 1 < ROWS {
            triangles.push([a, b, c]);
        }
        if row > 0 {
            triangles.push([a, c, d]);
        }
    }
    let scale = radius * (4.0 * PI / triangles.iter().map(area).sum::<f64>()).sqrt();
    triangles.iter().map(|corners| corners.map(|p| center + scale * p)).collect()
}

/// Turns the fronts of the triangles to the other side.
pub fn inverted(triangles: Vec<[DVec3; 3]>) -> Vec<[DVec3; 3]> {
    triangles.into_iter().map(|[a, b, c]| [a, c, b]).collect()
}
