//! Writes a scene with its light as one HTML page that needs no network: WebGL by three.js, with
//! all data in the page.

mod arrays;
mod dependence;
mod histories;
mod levels;
mod photons;
pub(crate) mod shapes;
mod year;

use std::io::{self, Write};

use base64::{Engine, engine::general_purpose::STANDARD};
use glam::Vec3;
use serde_json::{Value, json};

use crate::{
    picture::Scale,
    rendered::{MOST_TILES, RenderedScene},
    xml::allowed,
};
use arrays::{Arrays, shorts};
use levels::Levels;
use photons::Shown;
use phylux_core::{
    error::{Error, Result},
    math::{geometry::Extent, stats::Estimate, units::printed},
    scene::{
        captor::{CHANNELS, Channel},
        lattice::Period,
        material::Scatterer,
        tiles::Tiles,
        world::Scene,
    },
    transport::surface_light::SurfaceLight,
};
use phylux_results::{
    result::{CaptorResult, GroupResult, Row, band_results, light_name, light_word},
    year_facts::daily_unit,
};
use shapes::{Shape, quantised, shapes};
use year::Series;
pub use year::YearLight;

/// Limit on the number of captors.
const MOST_CAPTORS: usize = 500_000;
/// Limit on the number of lights that are outlined.
const MOST_LIGHTS: usize = 10_000;

const PAGE: &str = include_str!("view/page.html");
const STYLE: &str = include_str!("view/page.css");
const SCRIPTS: [&str; 13] = [
    include_str!("view/data.js"),
    include_str!("view/draw.js"),
    include_str!("view/smooth.js"),
    include_str!("view/photons.js"),
    include_str!("view/histories.js"),
    include_str!("view/dependence.js"),
    include_str!("view/table.js"),
    include_str!("view/bar.js"),
    include_str!("view/year.js"),
    include_str!("view/link.js"),
    include_str!("view/panel.js"),
    include_str!("view/keys.js"),
    include_str!("view/start.js"),
];
/// Runs before the data, and shows how much of it has come.
const LOADING: &str = include_str!("view/loading.js");
/// three.js, MIT; see `view/three.md`.
const THREE: &str = include_str!("view/three.min.js");
const THREE_LICENCE: &str = include_str!("view/three.LICENSE");

/// Checks that a scene fits into a page, and returns the most tiles of a page. Error: it has too many
/// triangles, copies or captors. Copies that share their triangles count only with their parts.
pub fn check_view(scene: &Scene) -> Result<usize> {
    let distinct = scene.distinct_triangles() + scene.captor_tiles();
    let counts = [
        (distinct, MOST_TILES, "triangles"),
        (Tiles::least(scene), MOST_TILES, "parts of copies"),
        (scene.captors().len(), MOST_CAPTORS, "captors"),
    ];
    for (count, most, what) in counts {
        if count > most {
            return Err(Error::input("scene", format!("{count} {what}, a page holds {most}"))
                .remedy("export it (.vtp) and open it in ParaView"));
        }
    }
    Ok(MOST_TILES)
}

/// Writes the page, with the light of a year of this scene if it is given.
pub fn write_view(
    rendered: &RenderedScene,
    year: Option<&YearLight>,
    writer: &mut dyn Write,
) -> io::Result<()> {
    for piece in PAGE.split_inclusive("-->") {
        let (text, slot) = match piece.rsplit_once("<!--") {
            Some((text, slot)) => (text, slot.trim_end_matches("-->").trim()),
            None => (piece, ""),
        };
        writer.write_all(text.as_bytes())?;
        match slot {
            "" => {}
            "title" => writer.write_all(escaped(rendered.scene.name()).as_bytes())?,
            "style" => writer.write_all(STYLE.as_bytes())?,
            "three" => write!(writer, "/*\n{THREE_LICENCE}*/\n{THREE}")?,
            "script" => writer.write_all(SCRIPTS.join("\n").as_bytes())?,
            "loading" => writer.write_all(LOADING.as_bytes())?,
            "data" => write_data(rendered, year, writer)?,
            _ => return Err(io::Error::other(format!("page.html: no `{slot}` to fill in"))),
        }
    }
    Ok(())
}

/// Escapes text, so that it contains no markup.
fn escaped(text: &str) -> String {
    allowed(text).replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Writes the facts as JSON, then the arrays. The facts say how long these are, so that the page can
/// show how much of them has come.
fn write_data(
    rendered: &RenderedScene,
    year: Option<&YearLight>,
    writer: &mut dyn Write,
) -> io::Result<()> {
    let series: Vec<(&str, Series)> = year
        .into_iter()
        .flat_map(YearLight::tables)
        .map(|(name, table)| (name, Series::new(rendered.scene, table)))
        .collect();
    let shapes = shapes(rendered.scene, &rendered.tiles);
    let shown = rendered.light.as_ref().map(|light| photons::shown(light, &extent(rendered)));
    let shown = shown.unwrap_or_default();
    let mut facts = facts(rendered, &shapes, &series, &shown);
    let arrays = arrays(rendered, &shapes, &series, &shown)?;
    facts["bytes"] = arrays.0.iter().map(|(_, text)| text.len()).sum::<usize>().into();
    // only `<` could end a script element
    let facts = facts.to_string().replace('<', "\\u003c");
    writeln!(writer, "<script type=\"application/json\" id=\"facts\">{facts}</script>")?;
    for (name, text) in arrays.0 {
        let size = text.len();
        write!(
            writer,
            "<script type=\"application/octet-stream\" data-size=\"{size}\" id=\"{name}\">"
        )?;
        writer.write_all(&text)?;
        writeln!(writer, "</script>")?;
    }
    Ok(())
}

/// Returns all numbers of a page.
fn arrays(
    rendered: &RenderedScene,
    shapes: &[Shape],
    series: &[(&str, Series)],
    shown: &[Shown],
) -> io::Result<Arrays> {
    let mut arrays = Arrays::default();
    let corners = shapes.iter().flat_map(|shape| {
        let corners = shape.triangles(rendered.scene, &rendered.tiles);
        corners.flat_map(|t| [t.a, t.b, t.c]).flat_map(move |p| quantised(p, &shape.extent))
    });
    arrays.add("corners", shorts(corners))?;
    let starts: Vec<u32> =
        shapes.iter().flat_map(|s| s.merged).flat_map(|m| &m.starts).copied().collect();
    if !starts.is_empty() {
        arrays.add("starts", starts.into_iter().flat_map(u32::to_le_bytes))?;
    }
    let placements = shapes.iter().flat_map(|shape| shape.placements.as_flattened());
    arrays.add("placements", floats(placements.copied()))?;
    let index = |index: Option<usize>| index.map_or(-1, |i| i as i32);
    let parts = rendered.tiles.parts.iter().flat_map(|part| {
        [index(part.object), index(part.material), index(part.captor), part.tiles.start as i32]
    });
    arrays.add("parts", parts.flat_map(i32::to_le_bytes))?;
    let (arrived, kept) = (levels(rendered, most_arrived(rendered)), levels(rendered, 1.0));
    let local = arriving(rendered).map(|value| arrived.level(value));
    let local = local.chain(kept_shares(rendered).map(|share| kept.level(share)));
    match arrived.is_byte() {
        true => arrays.add("local", local.map(|level| level as u8))?,
        false => arrays.add("local", shorts(local))?,
    }
    let bands = rendered.scene.band_names().count();
    let captors = rendered.captors.iter().map(CaptorResult::row);
    let groups = rendered.groups.iter().map(GroupResult::row);
    arrays.add("captors", floats(received(captors.clone(), bands)))?;
    arrays.add("groups", floats(received(groups.clone(), bands)))?;
    if rendered.is_by_light() {
        let lights = rendered.scene.lights().len();
        let both = captors.chain(groups);
        arrays.add("byLight", floats(received_of_lights(both, lights, bands)))?;
    }
    arrays.add("shares", shares(rendered))?;
    for (name, series) in series {
        let [slots, values, errors] = match *name {
            "hours" => ["hourSlots", "hourValues", "hourErrors"],
            "days" => ["daySlots", "dayValues", "dayErrors"],
            _ => ["monthSlots", "monthValues", "monthErrors"],
        };
        arrays.add(slots, series.slots.iter().flat_map(|slot| slot.to_le_bytes()))?;
        arrays.add(values, shorts(series.value_levels.iter().copied()))?;
        arrays.add(errors, series.error_levels.iter().copied())?;
    }
    histories::add(&mut arrays, rendered)?;
    if let Some(light) = &rendered.light {
        add_photons(&mut arrays, light, shown, &extent(rendered))?;
    }
    Ok(arrays)
}

/// Adds the photons: where they arrived, where they flew from if that is not the arrival before,
/// their powers, faces, bounces, lights and the materials that they came from and arrived on.
fn add_photons(
    arrays: &mut Arrays,
    light: &SurfaceLight,
    shown: &[Shown],
    extent: &Extent,
) -> io::Result<()> {
    let positions = light.map.positions();
    let levels = Levels::fine(most_power(light, shown));
    let photon = |shown: &Shown| light.map.photons[shown.index];
    let place = |place: Vec3| quantised(place, extent);
    arrays.add("photonPlaces", shorts(shown.iter().flat_map(|s| place(positions[s.index]))))?;
    arrays.add("photonLinks", shown.iter().map(|s| u8::from(s.linked)))?;
    let starts = shown.iter().filter(|s| !s.linked).flat_map(|s| place(s.from));
    arrays.add("photonStarts", shorts(starts))?;
    let powers = shown.iter().flat_map(|s| light.map.power(s.index));
    arrays.add("photonPowers", shorts(powers.map(|power| levels.level(*power))))?;
    let normals = shown.iter().flat_map(|s| face_normal(light, s.index));
    arrays.add("photonNormals", normals.flat_map(i8::to_le_bytes))?;
    let bounce = |s: &Shown| light.map.ways().get(s.index).map_or(0, |way| way.bounces);
    arrays.add("photonBounces", shorts(shown.iter().map(bounce)))?;
    arrays.add("photonLights", shown.iter().flat_map(|s| photon(s).light.to_le_bytes()))?;
    let material = |s: &Shown| s.material.map_or(u32::MAX, |m| m as u32);
    arrays.add("photonMaterials", shown.iter().flat_map(|s| material(s).to_le_bytes()))?;
    let on = |s: &Shown| light.scene.surface(photon(s).triangle as usize).material;
    arrays.add("photonSurfaces", shown.iter().flat_map(|s| on(s).to_le_bytes()))
}

/// Returns the bands, then the sums over bands, each with the name of its light.
fn bands(scene: &Scene) -> Vec<Value> {
    let (all, flux) = (band_results(scene), scene.quantity().unit_names().flux);
    let light = |place: usize| light_name(&all, Some(place), &flux);
    let bands = scene.bands().iter().enumerate().map(|(b, band)| {
        json!({
            "name": band.name, "light": light(b), "of": [b], "nm": band.from_nm.zip(band.to_nm)
        })
    });
    let sums = scene.sums().iter().enumerate().map(|(s, sum)| {
        let place = scene.bands().len() + s;
        let light = light(place);
        let mut facts = json!({ "name": sum.name, "light": light, "of": sum.bands, "sum": true });
        if !sum.weights.is_empty() {
            let [flux, irradiance] = scene.units(place);
            facts["weights"] = json!(sum.weights);
            facts["unit"] = json!({ "flux": printed(&flux), "irradiance": printed(&irradiance) });
        }
        facts
    });
    bands.chain(sums).collect()
}

/// Returns the boxes around the lights that have a place.
fn lights(scene: &Scene) -> Vec<Value> {
    let lights = scene.lights().iter().filter(|light| light.entrance().is_none());
    let lights = lights.take(MOST_LIGHTS).map(|light| {
        let Extent { min, max } = light.extent();
        json!({ "name": light.name, "min": min.to_array(), "max": max.to_array() })
    });
    lights.collect()
}

/// Returns the numbers of tiles and copies of a shape.
fn shape(shape: &Shape) -> Value {
    let mut facts = json!({ "tiles": shape.tiles.len(), "copies": shape.placements.len() });
    if let Some(merged) = shape.merged {
        facts["triangles"] = merged.triangles.len().into();
    }
    facts
}

fn facts(
    rendered: &RenderedScene,
    shapes: &[Shape],
    series: &[(&str, Series)],
    shown: &[Shown],
) -> Value {
    let scene = rendered.scene;
    let extent = extent(rendered);
    let unit = scene.quantity().unit_names();
    let materials = scene.materials().iter();
    let few_paths = rendered
        .captors
        .iter()
        .enumerate()
        .filter(|(_, captor)| captor.faces().any(|face| face.few_paths));
    // lights whose shares are known, if all of them are
    let split = rendered.is_by_light() || !rendered.shares().is_empty();
    let lamps = scene.lights().iter().filter(|_| split).map(|light| &light.name);
    json!({
        "phylux": env!("CARGO_PKG_VERSION"),
        "scene": scene.name(),
        "source": rendered.source,
        "light": light_word(&unit.flux),
        "unit": { "flux": printed(&unit.flux), "irradiance": printed(&unit.irradiance) },
        "bands": bands(scene),
        "objects": scene.objects(),
        "materials": materials
            .map(|m| json!({ "name": m.name, "clear": m.material.is_clear() }))
            .collect::<Vec<_>>(),
        "captors": scene.captors().iter().map(|captor| &captor.id).collect::<Vec<_>>(),
        "areas": scene.captors().iter().map(|captor| captor.area).collect::<Vec<_>>(),
        "fewPaths": few_paths.map(|(c, _)| c).collect::<Vec<_>>(),
        "lights": lights(scene),
        "lamps": lamps.collect::<Vec<_>>(),
        "groups": rendered.groups.iter().map(|group| {
            json!({ "name": group.id, "area": group.area })
        }).collect::<Vec<_>>(),
        "periods": scene.lattice().map(|lattice| [0, 1].map(|axis| lattice.period(axis).map(
            |Period { from, length, rise }| json!({ "from": from, "length": length, "rise": rise })
        ))),
        "min": extent.min.to_array(),
        "size": extent.size().to_array(),
        "tiles": rendered.tiles.count(),
        "shapes": shapes.iter().map(shape).collect::<Vec<_>>(),
        "year": (!series.is_empty()).then(|| {
            let mut year = json!({ "unit": printed(daily_unit(scene.quantity())) });
            series.iter().for_each(|(name, series)| year[*name] = series.facts());
            year
        }),
        "local": rendered.has_local().then(|| levels(rendered, most_arrived(rendered)).facts()),
        // of a place where photons of equal power arrive
        "localError": rendered.light.as_ref().map(SurfaceLight::error_of_alike),
        "kept": levels(rendered, 1.0).facts(),
        "photons": rendered.light.as_ref().map(|light| json!({
            "count": shown.len(), "levels": Levels::fine(most_power(light, shown)).facts(),
            // the names of their lights
            "lights": scene.lights().iter().map(|light| &light.name).collect::<Vec<_>>(),
        })),
        "histories": histories::facts(rendered),
        "dependence": dependence::facts(rendered),
        "colours": STANDARD.encode(colours().as_flattened()),
    })
}

/// Returns the colour map in 256 steps, sRGB.
fn colours() -> Vec<[u8; 3]> {
    let map = Scale { low: 0.0, high: 255.0, log: false };
    let byte = |share: f32| (255.0 * share).round() as u8;
    (0..=255).map(|i| map.colour(f64::from(i)).to_array().map(byte)).collect()
}

/// Returns a box around all tiles and lights.
fn extent(rendered: &RenderedScene) -> Extent {
    let lights = rendered.scene.lights().iter().map(|light| light.extent());
    let tiles = Extent::of_triangles(&rendered.tiles.corners);
    // a merged tile reaches beyond its middle triangle
    let merged = rendered.tiles.copies.iter().any(|copies| copies.merged.is_some());
    let surfaces = merged.then(|| rendered.scene.triangles().extent());
    lights.chain(surfaces).fold(tiles, Extent::join)
}

/// Up to this many tiles each value takes two bytes; with more tiles it takes one.
const MOST_FINE: usize = 500_000;

/// Returns the scale for values up to `most` on tiles. Where there are many tiles, it has one byte
/// and an error of a third of the error of the light there.
fn levels(rendered: &RenderedScene, most: f32) -> Levels {
    let error = rendered.light.as_ref().map_or(0.0, SurfaceLight::error_of_alike);
    match rendered.tiles.count() {
        0..=MOST_FINE => Levels::fine(most),
        _ => Levels::coarse(most, error / 3.0),
    }
}

fn floats(values: impl Iterator<Item = f32>) -> impl Iterator<Item = u8> {
    values.flat_map(f32::to_le_bytes)
}

/// Returns the irradiance on the tiles of surfaces: face after face, in it band after band, in it
/// tile after tile.
fn arriving<'a>(rendered: &'a RenderedScene) -> impl Iterator<Item = f32> + 'a {
    let bands = rendered.scene.bands().len();
    let planes = [Channel::Front, Channel::Back].into_iter();
    planes.flat_map(move |face| (0..bands).flat_map(move |b| plane(rendered, face, b)))
}

/// Returns the greatest irradiance.
fn most_arrived(rendered: &RenderedScene) -> f32 {
    arriving(rendered).fold(f32::MIN_POSITIVE, f32::max)
}

/// Returns the share that a tile absorbs of the light on both faces: band after band, in it tile
/// after tile. The share differs from tile to tile far less than the light does.
fn kept_shares<'a>(rendered: &'a RenderedScene) -> impl Iterator<Item = f32> + 'a {
    (0..rendered.scene.bands().len()).flat_map(move |b| {
        let [front, back, absorbed] = CHANNELS.map(|channel| plane(rendered, channel, b));
        // NaN where nothing arrives, which becomes level 0
        front.zip(back).zip(absorbed).map(|((front, back), absorbed)| absorbed / (front + back))
    })
}

/// Returns the light on the tiles of surfaces in a channel and band.
fn plane<'a>(
    rendered: &'a RenderedScene,
    channel: Channel,
    band: usize,
) -> impl Iterator<Item = f32> + 'a {
    let value = move |tile| rendered.local(tile, channel).map(|values| values[band]);
    (0..rendered.tiles.count()).map_while(value)
}

/// Returns the shares of lights: light after light, in it face after face, in it band after band,
/// in it tile after tile.
fn shares<'a>(rendered: &'a RenderedScene) -> impl Iterator<Item = u8> + 'a {
    let (lights, bands) = (rendered.scene.lights().len(), rendered.scene.bands().len());
    let of_tile = rendered.shares();
    let each = 2 * lights * bands;
    let order = (0..lights).flat_map(|light| (0..2).map(move |face| (light, face)));
    let order = order.flat_map(move |(light, face)| {
        (0..bands).map(move |b| (face * lights + light) * bands + b)
    });
    order.flat_map(move |place| of_tile.iter().skip(place).step_by(each)).copied()
}

/// Returns the values of captors or groups per area: for each one channel after channel, in it band
/// after band and sums, value before error; NaN where a number is not known.
fn received<'a>(all: impl Iterator<Item = Row<'a>>, bands: usize) -> impl Iterator<Item = f32> {
    all.flat_map(move |row| {
        let each = CHANNELS.into_iter().flat_map(move |c| (0..bands).map(move |b| (c, b)));
        each.flat_map(move |(channel, band)| numbers(row.per_area(channel, band)))
    })
}

/// Returns the same values for each light, one light after the other within a band.
fn received_of_lights<'a>(
    all: impl Iterator<Item = Row<'a>>,
    lights: usize,
    bands: usize,
) -> impl Iterator<Item = f32> {
    all.flat_map(move |row| {
        let each = CHANNELS.into_iter().flat_map(move |c| (0..bands).map(move |b| (c, b)));
        each.flat_map(move |(channel, band)| {
            (0..lights).flat_map(move |light| numbers(row.of_light(light).per_area(channel, band)))
        })
    })
}

fn numbers(estimate: Option<Estimate>) -> [f32; 2] {
    let error = estimate.and_then(|e| e.standard_error);
    [estimate.map(|e| e.mean), error].map(|value| value.map_or(f32::NAN, |value| value as f32))
}

/// Returns the normal of the face that a photon arrived on, in steps of 1/127.
fn face_normal(light: &SurfaceLight, photon: usize) -> [i8; 3] {
    let stored = &light.map.photons[photon];
    let normal = light.scene.surface(stored.triangle as usize).normal;
    let front = stored.direction.unpack().dot(normal) < 0.0;
    let facing = if front { normal } else { -normal };
    (127.0 * facing).to_array().map(|step| step.round() as i8)
}

fn most_power(light: &SurfaceLight, shown: &[Shown]) -> f32 {
    let powers = shown.iter().flat_map(|s| light.map.power(s.index));
    powers.copied().fold(f32::MIN_POSITIVE, f32::max)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    /// Returns what stands between quotes behind each of these beginnings.
    fn quoted<'a>(text: &'a str, beginnings: &[&str]) -> Vec<&'a str> {
        let behind =
            |beginning| text.split(beginning).skip(1).filter_map(|rest| rest.split('"').next());
        beginnings.iter().copied().flat_map(behind).collect()
    }

    /// Every id stands once in the page, or one of the two things of that name would be dead; and the
    /// scripts ask for no id that is not there.
    #[test]
    fn ids_of_the_page_are_its_own() {
        let all = quoted(PAGE, &[" id=\""]);
        let ids: BTreeSet<&str> = all.iter().copied().collect();
        assert_eq!(all.len(), ids.len(), "an id stands twice among {all:?}");
        assert!(ids.len() > 50, "{ids:?}");
        for script in SCRIPTS {
            for id in quoted(script, &["element(\"", " on(\""]) {
                // the facts stand in the data of a page
                assert!(ids.contains(id) || id == "facts", "the scripts ask for `{id}`");
            }
        }
    }

    /// Every control of the page has a line of the scripts that answers it.
    #[test]
    fn controls_of_the_page_have_their_handlers() {
        let ids = ["button", "input", "select"].map(|kind| format!("<{kind} id=\""));
        let controls = quoted(PAGE, &ids.each_ref().map(String::as_str));
        assert!(controls.len() > 35, "{controls:?}");
        for id in controls {
            let answered =
                SCRIPTS.iter().any(|script| script.contains(&format!(" on(\"{id}\", \"")));
            assert!(answered, "nothing answers `{id}`");
        }
    }
}
