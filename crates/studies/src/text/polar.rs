//! Draws measured intensities as text (polar diagrams), so that one sees whether a lamp is turned
//! or upside down.

use std::{collections::HashMap, fmt::Write, sync::Arc};

use glam::Vec3;

use phylux_core::scene::{light::Intensity, world::Scene};

/// The most drawings; scenes seldom have so many kinds of lamps.
const MOST: usize = 4;
/// Rows and columns from the middle of a drawing to its edge; a character is about twice as high as
/// wide.
const ROWS: i32 = 12;
const COLUMNS: i32 = 2 * ROWS;

/// Writes one drawing for each intensity table and way to aim it, with the names of the lights that
/// emit so.
pub(super) fn distributions(text: &mut String, scene: &Scene) {
    let mut drawn: Vec<(&Intensity, Vec<&str>)> = Vec::new();
    let mut known: HashMap<_, usize> = HashMap::new();
    for light in scene.lights() {
        let Some(intensity) = light.intensity() else { continue };
        let Some(table) = intensity.as_table() else { continue };
        let axes = [intensity.axes().normal, intensity.axes().tangent];
        let key = (Arc::as_ptr(table), axes.map(|axis| (axis + 0.0).to_array().map(f32::to_bits)));
        let index = *known.entry(key).or_insert(drawn.len());
        match drawn.get_mut(index) {
            Some((_, names)) => names.push(&light.name),
            None => drawn.push((intensity, vec![&light.name])),
        }
    }
    for (intensity, names) in drawn.iter().take(MOST) {
        draw(text, intensity, names);
    }
    if drawn.len() > MOST {
        let _ = writeln!(text, "\nand {} more intensity distributions", drawn.len() - MOST);
    }
}

/// A point of the curve in one half-plane: sine and cosine of V, and the intensity there.
type CurvePoint = (f32, f32, f32);

/// Returns the points of the half-plane on the side of `across`, one for each half degree from V =
/// 0 to 180.
fn curve(intensity: &Intensity, across: Vec3) -> Vec<CurvePoint> {
    let at = |i: i32| {
        let (sin, cos) = (0.5 * i as f32).to_radians().sin_cos();
        (sin, cos, intensity.towards(cos * intensity.axes().normal + sin * across))
    };
    (0..=360).map(at).collect()
}

fn draw(text: &mut String, intensity: &Intensity, names: &[&str]) {
    let axes = intensity.axes();
    let more = match names.len() - 1 {
        0 => String::new(),
        1 => " and 1 more light".into(),
        more => format!(" and {more} more lights"),
    };
    let along = |v: Vec3| {
        let [x, y, z] = v.to_array().map(|x| (100.0 * x).round() / 100.0 + 0.0);
        format!("({x}, {y}, {z})")
    };
    let _ = writeln!(
        text,
        "\nintensity of `{}`{more}: it aims (V = 0, below) along {}\n  \
        * C = 0 along {}, to the right, and C = 180, to the left\n  \
        o C = 90 along {}, to the right, and C = 270, to the left",
        names[0],
        along(axes.normal),
        along(axes.tangent),
        along(axes.bitangent)
    );
    let (c0, c90) = (axes.tangent, axes.bitangent);
    let curves = [('*', 1, c0), ('*', -1, -c0), ('o', 1, c90), ('o', -1, -c90)]
        .map(|(mark, side, across)| (mark, side, curve(intensity, across)));
    let points = || curves.iter().flat_map(|(_, _, curve)| curve);
    let largest = points().fold(0.0, |most: f32, point| most.max(point.2));
    if largest == 0.0 {
        text.push_str("  nothing in these planes\n");
        return;
    }
    let place = |&(sin, cos, value): &CurvePoint| {
        let cells = |x: f32, most: i32| (x * value / largest * most as f32).round() as i32;
        (cells(sin, COLUMNS), cells(cos, ROWS))
    };
    let rows = points().map(|point| place(point).1);
    let (top, bottom) = rows.fold((0, 0), |(low, high), row| (low.min(row), high.max(row)));
    let width = (2 * COLUMNS + 1) as usize;
    let mut cells = vec![vec![' '; width]; (bottom - top + 1) as usize];
    for (mark, side, curve) in curves.iter().rev() {
        for point in curve.iter().filter(|point| point.2 > 0.0) {
            let (column, row) = place(point);
            cells[(row - top) as usize][(COLUMNS + side * column) as usize] = *mark;
        }
    }
    cells[(-top) as usize][COLUMNS as usize] = '+';
    for row in cells {
        let _ = writeln!(text, "  {}", row.into_iter().collect::<String>().trim_end());
    }
}
