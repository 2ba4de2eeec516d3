//! `phylux check`

mod polar;

use std::{fmt::Write, path::Path};

use super::summary::{SHOWN_BANDS, short};
use crate::{
    error::Result,
    formats::scene_file::{self, LoadedScene, OpenField},
    scene::{captor::CaptorKind, world::Scene},
    studies::check::{SceneSummary, check, decimals},
};

/// Materials and lights that are listed; what is beyond is only in the totals.
const LISTED: usize = 30;

pub(super) fn run(path: &Path) -> Result<()> {
    let loaded = scene_file::load(path)?;
    let summary = check(&loaded)?;
    super::terminal::print(&describe(&loaded, &summary))?;
    super::terminal::warn(&summary.warnings);
    Ok(())
}

/// The text of the command.
pub(super) fn describe(loaded: &LoadedScene, summary: &SceneSummary) -> String {
    let scene = &loaded.scene;
    let size = summary.size;
    let decimals = decimals(size.max_element(), 3);
    let mut text = format!(
        "{}: {:.decimals$} x {:.decimals$} x {:.decimals$} m\n",
        scene.name, size.x, size.y, size.z
    );
    surfaces(&mut text, summary);
    lights(&mut text, scene);
    polar::distributions(&mut text, scene);
    if let Some(open_field) = &loaded.open_field {
        daylight(&mut text, open_field);
    }
    captors(&mut text, scene);
    for note in &summary.notes {
        let _ = writeln!(text, "\nnote: {note}");
    }
    text
}

fn surfaces(text: &mut String, summary: &SceneSummary) {
    if summary.surfaces.is_empty() {
        text.push_str("\nno surfaces: free space\n");
        return;
    }
    let whole: Show = |count| format!("{count}");
    let columns = vec![("triangles".into(), whole), ("area, m2".into(), short as Show)];
    let rows = summary.surfaces.iter();
    let rows = rows.map(|s| (s.material.as_str(), vec![s.triangles as f64, s.area]));
    Table { title: "surfaces".into(), columns, rows: rows.collect() }.write(text);
}

fn lights(text: &mut String, scene: &Scene) {
    let bands = &scene.bands[..scene.bands.len().min(SHOWN_BANDS)];
    let columns = bands.iter().map(|band| (band.name.clone(), short as Show)).collect();
    let rows = scene.lights.iter();
    let rows = rows.map(|light| (light.name.as_str(), light.power[..bands.len()].to_vec()));
    let mut title = format!("lights, {}", scene.quantity.unit_names().flux);
    if bands.len() < scene.bands.len() {
        let _ = write!(title, ", {} of {} bands", bands.len(), scene.bands.len());
    }
    Table { title, columns, rows: rows.collect() }.write(text);
}

/// Where the sun stands and how bright it is outside: what a wrong clock or place shows in.
fn daylight(text: &mut String, open_field: &OpenField) {
    if let Some(sun) = open_field.sun {
        let [elevation, azimuth] = [sun.elevation, sun.azimuth].map(f64::to_degrees);
        let _ = writeln!(
            text,
            "\nthe sun stands {elevation:.2} degrees high, {azimuth:.2} clockwise from north"
        );
    }
    let (Some([normal, direct, diffuse]), Some(ppfd)) = (open_field.weather, open_field.ppfd())
    else {
        return;
    };
    let global = short(direct + diffuse);
    let (normal, diffuse, ppfd) = (short(normal), short(diffuse), short(ppfd));
    let _ = writeln!(
        text,
        "in the open, W/m2: global {global}, diffuse {diffuse}, direct normal {normal}; \
        PPFD {ppfd} umol/m2/s"
    );
}

fn captors(text: &mut String, scene: &Scene) {
    let on_surfaces = scene.captors.iter().filter(|c| c.kind == CaptorKind::Surface).count();
    let sensors = scene.captors.len() - on_surfaces;
    let groups = scene.groups.len();
    let _ = match scene.captors.len() {
        0 => writeln!(text, "\nno captors, so nothing to run"),
        _ => {
            writeln!(text, "\ncaptors: {sensors} virtual, {on_surfaces} surface; groups: {groups}")
        }
    };
}

type Show = fn(f64) -> String;

/// Named rows of numbers, and their total.
struct Table<'a> {
    title: String,
    columns: Vec<(String, Show)>,
    rows: Vec<(&'a str, Vec<f64>)>,
}

impl Table<'_> {
    fn write(&self, text: &mut String) {
        let shown = &self.rows[..self.rows.len().min(LISTED)];
        let longest = shown.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
        let width = longest.max(22) + 2;
        let mut line = |name: &str, cells: &mut dyn Iterator<Item = String>| {
            let cells: String = cells.map(|cell| format!(" {cell:>10}")).collect();
            let _ = writeln!(text, "{}", format!("{name:<width$}{cells}").trim_end());
        };
        let show = |values: &[f64]| {
            let cells = self.columns.iter().zip(values).map(|((_, show), value)| show(*value));
            cells.collect::<Vec<_>>().into_iter()
        };
        line("", &mut std::iter::empty());
        line(&self.title, &mut self.columns.iter().map(|(name, _)| name.clone()));
        for (name, values) in shown {
            line(&format!("  {name}"), &mut show(values));
        }
        if self.rows.len() > LISTED {
            let more = format!("  and {} more", self.rows.len() - LISTED);
            line(&more, &mut std::iter::empty());
        }
        if self.rows.len() > 1 {
            let sum = |column: usize| self.rows.iter().map(|(_, values)| values[column]).sum();
            let total: Vec<f64> = (0..self.columns.len()).map(sum).collect();
            line("  total", &mut show(&total));
        }
    }
}
