//! Remarks about a scene, in sentences.

use glam::Vec3;

use phylux_core::{
    error::{LISTED, some},
    scene::world::Scene,
};

/// Warnings and notes, as they are collected.
#[derive(Default)]
pub(super) struct Remarks {
    pub warnings: Vec<String>,
    pub notes: Vec<String>,
}

impl Remarks {
    /// Adds a warning about `things`, if there are any: the sentence that `say` makes of their
    /// list.
    pub fn warn_of(
        &mut self,
        things: impl IntoIterator<Item = String>,
        say: impl FnOnce(&str) -> String,
    ) {
        self.warnings.extend(listed(things).map(|list| say(&list)));
    }

    pub fn note_of(
        &mut self,
        things: impl IntoIterator<Item = String>,
        say: impl FnOnce(&str) -> String,
    ) {
        self.notes.extend(listed(things).map(|list| say(&list)));
    }
}

fn listed(things: impl IntoIterator<Item = String>) -> Option<String> {
    Some(some(things, LISTED)).filter(|list| !list.is_empty())
}

pub(super) fn quoted<'a>(
    names: impl IntoIterator<Item = &'a String>,
) -> impl Iterator<Item = String> {
    names.into_iter().map(|name| format!("`{name}`"))
}

/// Writes a length in m or mm, with two digits.
pub(super) fn length(metres: f64) -> String {
    let (value, unit) = if metres >= 0.1 { (metres, "m") } else { (1e3 * metres, "mm") };
    format!("{value:.*} {unit}", decimals(value, 2))
}

/// Writes a point in the user's coordinates, to a thousandth of the scene's size.
pub(super) fn place(scene: &Scene, point: Vec3) -> String {
    let decimals = decimals(scene.radius().into(), 4);
    let p = (scene.center() + point.as_dvec3()).to_array();
    // avoids a minus before zero
    let scale = 10f64.powi(decimals as i32);
    let [x, y, z] = p.map(|v| format!("{:.decimals$}", (v * scale).round() / scale + 0.0));
    format!("({x}, {y}, {z}) m")
}

/// Returns the number of decimals that shows this many digits of `value`.
pub fn decimals(value: f64, digits: i32) -> usize {
    if value > 0.0 { (digits - 1 - value.log10().floor() as i32).clamp(0, 12) as usize } else { 0 }
}
