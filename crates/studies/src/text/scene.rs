//! The description of a scene: what it holds, as text and as JSON.

use std::{collections::BTreeMap, fmt::Write};

use serde::Serialize;

use super::{Page, polar, short, table::Table};
use crate::check::{
    LeafOptics, LeafSummary, MaterialSummary, ObjectSummary, SceneSummary, decimals,
};
use phylux_core::{
    error::{Error, Result},
    scene::{
        captor::CaptorKind,
        light::Light,
        world::{BandSum, Scene},
    },
};
use phylux_files::scene_file::{LoadedScene, OpenField};

/// The most materials, objects or lights that are listed. Totals count those beyond, too.
const LISTED: usize = 30;

/// Returns all of it as JSON.
pub fn as_json(loaded: &LoadedScene, summary: &SceneSummary) -> Result<String> {
    serde_json::to_string_pretty(&Checked::new(loaded, summary)).map_err(|e| Error::run("check", e))
}

/// What the JSON has.
#[derive(Serialize)]
struct Checked<'a> {
    /// Name of the scene.
    scene: &'a str,
    /// Size of all that is in the scene together, along x, y and z, m.
    size: [f64; 3],
    /// Names of the bands.
    bands: Vec<&'a str>,
    /// Unit of the powers.
    unit: String,
    surfaces: &'a [MaterialSummary],
    leaves: &'a [LeafSummary],
    objects: &'a [ObjectSummary],
    lights: Vec<Powers<'a>>,
    /// Spectra of lamps, by the names of these: at hand, or files.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    spectra: BTreeMap<&'a str, &'a str>,
    averages: Vec<Average<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    sun: Option<Sun>,
    captors: Captors,
    /// Names of the groups of captors.
    groups: &'a [String],
    notes: &'a [String],
    warnings: &'a [String],
}

/// Mean of a spectrum over each band.
#[derive(Serialize)]
struct Average<'a> {
    /// Place of the spectrum in the scene file, as a JSON pointer.
    at: &'a str,
    /// Mean, per band.
    means: &'a [f64],
}

#[derive(Serialize)]
struct Powers<'a> {
    name: &'a str,
    /// Power, per band.
    power: &'a [f64],
    /// Power over the bands of each sum of the scene.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    sums: BTreeMap<&'a str, f64>,
    /// Unit vector along which the light shines in the mean; absent where it shines to all sides.
    #[serde(skip_serializing_if = "Option::is_none")]
    facing: Option<[f64; 3]>,
}

impl<'a> Powers<'a> {
    fn of(scene: &'a Scene, light: &'a Light) -> Self {
        let bands = scene.bands().len();
        let sums = scene.with_sums(&light.power).split_off(bands);
        let names = scene.sums().iter().map(|sum| sum.name.as_str());
        Self {
            name: &light.name,
            power: &light.power,
            sums: names.zip(sums).collect(),
            facing: light.facing().map(|(facing, _)| facing.as_dvec3().to_array()),
        }
    }
}

/// Position of the sun, degrees.
#[derive(Serialize)]
struct Sun {
    elevation: f64,
    azimuth: f64,
}

/// Number of captors of each kind.
#[derive(Serialize)]
struct Captors {
    #[serde(rename = "virtual")]
    sensors: usize,
    surface: usize,
}

impl Captors {
    fn of(scene: &Scene) -> Self {
        let surface = scene.captors().iter().filter(|c| c.kind == CaptorKind::Surface).count();
        Self { sensors: scene.captors().len() - surface, surface }
    }
}

impl<'a> Checked<'a> {
    fn new(loaded: &'a LoadedScene, summary: &'a SceneSummary) -> Self {
        let scene = &loaded.scene;
        let averages = loaded.averages.iter();
        let averages = averages.map(|a| Average { at: &a.pointer, means: &a.means });
        let lights = scene.lights().iter();
        let sun = loaded.open_field.as_ref().and_then(|field| field.sun).map(|sun| Sun {
            elevation: sun.elevation.to_degrees(),
            azimuth: sun.azimuth.to_degrees(),
        });
        Self {
            scene: scene.name(),
            size: summary.size.to_array(),
            bands: scene.bands().iter().map(|band| band.name.as_str()).collect(),
            unit: scene.quantity().unit_names().flux.to_string(),
            surfaces: &summary.surfaces,
            leaves: &summary.leaves,
            objects: &summary.objects,
            lights: lights.map(|light| Powers::of(scene, light)).collect(),
            spectra: loaded.lamp_spectra.iter().map(|[l, spectrum]| (&**l, &**spectrum)).collect(),
            averages: averages.collect(),
            sun,
            captors: Captors::of(scene),
            groups: scene.groups(),
            notes: &summary.notes,
            warnings: &summary.warnings,
        }
    }
}

/// Returns the text.
pub fn describe(page: &Page, loaded: &LoadedScene, summary: &SceneSummary) -> String {
    let scene = &loaded.scene;
    let size = summary.size;
    let decimals = decimals(size.max_element(), 3);
    let mut text = format!(
        "{}: {:.decimals$} x {:.decimals$} x {:.decimals$} m\n",
        scene.name(),
        size.x,
        size.y,
        size.z
    );
    surfaces(page, &mut text, summary);
    leaves(page, &mut text, scene, &summary.leaves);
    objects(page, &mut text, summary);
    lights(page, &mut text, scene);
    lamp_spectra(page, &mut text, loaded);
    polar::distributions(&mut text, scene);
    averages(page, &mut text, loaded);
    if let Some(open_field) = &loaded.open_field {
        daylight(&mut text, open_field);
    }
    captors(&mut text, scene);
    for note in &summary.notes {
        let _ = writeln!(text, "\nnote: {note}");
    }
    text
}

fn surfaces(page: &Page, text: &mut String, summary: &SceneSummary) {
    if summary.surfaces.is_empty() {
        text.push_str("\nno surfaces: free space\n");
        return;
    }
    let columns = vec!["triangles".into(), "area, m2".into()];
    let rows = summary.surfaces.iter();
    let rows = rows.map(|s| (s.material.as_str(), vec![s.triangles as f64, s.area]));
    let show = |column: usize, value: f64| match column {
        0 => format!("{value}"),
        _ => short(value),
    };
    with_total(page, text, "surfaces".into(), columns, rows.collect(), show);
}

/// Writes what each leaf reflects, transmits and absorbs, so that one sees a wrong unit, column or
/// band of its spectrum.
fn leaves(page: &Page, text: &mut String, scene: &Scene, leaves: &[LeafSummary]) {
    if leaves.is_empty() {
        return;
    }
    let names = scene.bands().iter().map(|band| band.name.clone());
    let mut table = Table::new("leaves, at normal incidence", names, "");
    let mut rows = |name: &str, optics: &LeafOptics| {
        let LeafOptics { reflectance, transmittance, absorptance } = optics;
        let kinds =
            [("reflects", reflectance), ("transmits", transmittance), ("absorbs", absorptance)];
        for (kind, fractions) in kinds {
            let cells = fractions.iter().map(|fraction| format!("{fraction:.3}"));
            table.row(format!("  {name} {kind}"), cells, "");
        }
    };
    for LeafSummary { material, front, back } in leaves.iter().take(page.shown(LISTED)) {
        rows(material, front);
        if let Some(back) = back {
            rows(&format!("{material}, back,"), back);
        }
    }
    table.below(text, page);
    text.push_str(&page.more(leaves.len(), LISTED));
}

/// Writes where each object is, so that one sees a wrong unit, scale or axis.
fn objects(page: &Page, text: &mut String, summary: &SceneSummary) {
    if summary.objects.is_empty() {
        return;
    }
    // three digits, or millimetres
    let size = summary.size.max_element();
    let digits = decimals(size, 3).max(decimals(size, 4).min(3));
    let mut table = Table::new("objects, m", ["from", "to", "above lowest", "facing up"], "");
    for object in summary.objects.iter().take(page.shown(LISTED)) {
        // rounded first, and 0 added, so that no minus stands before a zero
        let shown = 10_f64.powi(digits as i32);
        let show = |x: f64| format!("{:.digits$}", (x * shown).round() / shown + 0.0);
        let point = |p: glam::DVec3| p.to_array().map(show).join(" ");
        let cells = [
            point(object.from),
            point(object.to),
            object.height.map(show).join(" to "),
            format!("{:.0} %", 100.0 * object.facing_up),
        ];
        table.row(format!("  {}", object.object), cells, "");
    }
    table.below(text, page);
    text.push_str(&page.more(summary.objects.len(), LISTED));
}

/// Writes the powers of the lights, per band and for the sums over bands, and where those face that
/// do not shine to all sides alike.
fn lights(page: &Page, text: &mut String, scene: &Scene) {
    let unit = scene.quantity().unit_names().flux;
    let of_sum = |sum: &BandSum| match sum.unit.map(|unit| unit.names()[0]) {
        Some(own) if own != unit => format!("{}, {own}", sum.name),
        _ => sum.name.clone(),
    };
    let names = scene.bands().iter().map(|band| band.name.clone());
    let names = names.chain(scene.sums().iter().map(of_sum));
    let rows = scene.lights().iter();
    let rows = rows.map(|light| (light.name.as_str(), scene.with_sums(&light.power)));
    let title = format!("lights, {unit}");
    with_total(page, text, title, names.collect(), rows.collect(), |_, value| short(value));

    let facing = scene.lights().iter();
    let facing = facing.filter_map(|light| Some((light.name.as_str(), light.facing()?)));
    let (facing, more) = listed(page, &facing.collect::<Vec<_>>());
    if !facing.is_empty() {
        text.push_str("\nlights face\n");
    }
    for (name, (facing, both)) in &facing {
        let [x, y, z] = facing.to_array().map(|x| (100.0 * x).round() / 100.0 + 0.0);
        let how = match facing.z {
            ..-0.99 => ", down",
            0.99.. => ", up",
            _ => "",
        };
        let both = if *both { ", and the opposite way" } else { "" };
        let _ = writeln!(text, "  {name:<22} ({x}, {y}, {z}){how}{both}");
    }
    text.push_str(&more);
}

/// Writes which spectrum each lamp has.
fn lamp_spectra(page: &Page, text: &mut String, loaded: &LoadedScene) {
    let all = loaded.lamp_spectra.iter();
    let all: Vec<_> = all.map(|[lamp, spectrum]| (lamp.as_str(), spectrum)).collect();
    let (all, more) = listed(page, &all);
    if !all.is_empty() {
        text.push_str("\nspectra of lamps\n");
    }
    for (lamp, spectrum) in &all {
        let _ = writeln!(text, "  {lamp:<22} {spectrum}");
    }
    text.push_str(&more);
}

/// Writes the mean of each spectrum over each band.
fn averages(page: &Page, text: &mut String, loaded: &LoadedScene) {
    if loaded.averages.is_empty() {
        return;
    }
    let names = loaded.scene.bands().iter().map(|band| band.name.clone());
    let mut table = Table::new("averages of spectra", names, "");
    for average in &loaded.averages {
        let means = average.means.iter().map(|mean| format!("{mean:.4}"));
        table.row(format!("  {}", average.pointer), means, "");
    }
    table.below(text, page);
}

/// Writes where the sun stands and how bright it is in the open, so that one sees a wrong clock or
/// place.
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
    let Captors { sensors, surface } = Captors::of(scene);
    let groups = scene.groups().len();
    let some =
        |count: usize, thing| format!("{count} {thing}{}", if count == 1 { "" } else { "s" });
    let [sensors, surfaces] = [some(sensors, "sensor"), some(surface, "surface")];
    let _ = match scene.captors().len() {
        0 => writeln!(text, "\nno captors, so nothing to run"),
        _ => writeln!(text, "\ncaptors: {sensors}, {surfaces}; groups: {groups}"),
    };
}

/// Returns the rows that are shown, by their names, and the line below them that says how many are
/// not. Of at least three neighbours that say the same there is one row with the first name, the last
/// and their number, unless all is asked for.
fn listed<T: Clone + PartialEq>(page: &Page, rows: &[(&str, T)]) -> (Vec<(String, T)>, String) {
    let runs = rows.chunk_by(|a, b| a.1 == b.1);
    let together = |len: usize| if len < 3 || page.full { 1 } else { len };
    let runs = runs.flat_map(|run| run.chunks(together(run.len())));
    let mut left = rows.len();
    let shown = runs.take(page.shown(LISTED)).map(|run| {
        left -= run.len();
        let ((first, said), (last, _)) = (&run[0], &run[run.len() - 1]);
        let name = match run.len() {
            1 => (*first).to_string(),
            count => format!("{first} to {last} ({count}), each"),
        };
        (name, said.clone())
    });
    let shown = shown.collect();
    (shown, page.more(left, 0))
}

/// Writes a table of named rows of numbers, with a total if there are several rows.
fn with_total(
    page: &Page,
    text: &mut String,
    title: String,
    columns: Vec<String>,
    rows: Vec<(&str, Vec<f64>)>,
    show: impl Fn(usize, f64) -> String,
) {
    let cells = |values: &[f64]| -> Vec<String> {
        values.iter().enumerate().map(|(column, value)| show(column, *value)).collect()
    };
    let count = columns.len();
    let mut table = Table::new(title, columns, "");
    let (shown, more) = listed(page, &rows);
    for (name, values) in &shown {
        table.row(format!("  {name}"), cells(values), "");
    }
    if !more.is_empty() {
        table.row(more.trim_end(), [], "");
    }
    if rows.len() > 1 {
        let sum = |column: usize| rows.iter().map(|(_, values)| values[column]).sum();
        let total: Vec<f64> = (0..count).map(sum).collect();
        table.row("  total", cells(&total), "");
    }
    table.below(text, page);
}
