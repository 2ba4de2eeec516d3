//! Writes a scene with its light as one HTML page that needs no network: WebGL by three.js, with
//! all data in the page.

mod hours;
mod levels;
pub(crate) mod shapes;

use std::io::{self, Write};

use base64::{Engine, engine::general_purpose::STANDARD, write::EncoderWriter};
use flate2::{Compression, write::ZlibEncoder};
use serde_json::{Value, json};

use crate::{
    picture::Scale,
    rendered::{MOST_TILES, RenderedScene},
    xml::allowed,
};
use hours::Hours;
use levels::Levels;
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
use phylux_files::year_table::YearTable;
use phylux_results::saved::CaptorValues;
use shapes::{Shape, quantised, shapes};

/// Limit on the number of captors.
const MOST_CAPTORS: usize = 500_000;
/// Limit on the number of photons, which are those of the first histories.
const MOST_PHOTONS: usize = 50_000;
/// Bytes of an array that are deflated at a time.
const PIECE: usize = 1 << 16;
/// Limit on the number of lights that are outlined.
const MOST_LIGHTS: usize = 10_000;

const PAGE: &str = include_str!("view/page.html");
const STYLE: &str = include_str!("view/page.css");
const SCRIPTS: [&str; 7] = [
    include_str!("view/data.js"),
    include_str!("view/draw.js"),
    include_str!("view/smooth.js"),
    include_str!("view/table.js"),
    include_str!("view/link.js"),
    include_str!("view/panel.js"),
    include_str!("view/start.js"),
];
/// three.js, MIT; see `view/three.md`.
const THREE: &str = include_str!("view/three.min.js");
const THREE_LICENCE: &str = include_str!("view/three.LICENSE");

/// Checks that a scene fits into a page, and returns the most tiles of a page. Error: it has too many
/// triangles, copies or captors. Copies that share their triangles count only with their parts.
pub fn check_view(scene: &Scene) -> Result<usize> {
    let distinct = scene.distinct_triangles() + scene.captor_triangles().len();
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

/// Writes the page, with the hours of a year of this scene if they are given.
pub fn write_view(
    rendered: &RenderedScene,
    hours: Option<&YearTable>,
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
            "data" => write_data(rendered, hours, writer)?,
            _ => return Err(io::Error::other(format!("page.html: no `{slot}` to fill in"))),
        }
    }
    Ok(())
}

/// Escapes text, so that it contains no markup.
fn escaped(text: &str) -> String {
    allowed(text).replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Writes the facts as JSON, and long lists of numbers deflated (zlib) in base64.
fn write_data(
    rendered: &RenderedScene,
    hours: Option<&YearTable>,
    writer: &mut dyn Write,
) -> io::Result<()> {
    let hours = hours.map(|file| {
        let captors = rendered.scene.captors().iter().map(|captor| captor.id.as_str());
        let groups = rendered.groups.iter().map(|group| group.values.id.as_str());
        Hours::new(file, captors.chain(groups))
    });
    let shapes = shapes(rendered.scene, &rendered.tiles);
    let facts = facts(rendered, &shapes, hours.as_ref()).to_string();
    // only `<` could end a script element
    script(writer, "facts", "application/json", &facts.replace('<', "\\u003c"))?;
    let mut array = |name: &str, bytes: &mut dyn Iterator<Item = u8>| {
        write!(writer, "<script type=\"application/octet-stream\" id=\"{name}\">")?;
        let text = EncoderWriter::new(&mut *writer, &STANDARD);
        // piece by piece, because an array can be as large as all the light
        let mut deflated = ZlibEncoder::new(text, Compression::default());
        let mut piece = Vec::with_capacity(PIECE);
        loop {
            piece.extend(bytes.take(PIECE));
            if piece.is_empty() {
                break;
            }
            deflated.write_all(&piece)?;
            piece.clear();
        }
        deflated.finish()?.finish()?;
        writeln!(writer, "</script>")
    };
    let corners = shapes.iter().flat_map(|shape| {
        let corners = shape.triangles(rendered.scene, &rendered.tiles);
        corners.flat_map(|t| [t.a, t.b, t.c]).flat_map(move |p| quantised(p, &shape.extent))
    });
    array("corners", &mut shorts(corners))?;
    let starts: Vec<u32> =
        shapes.iter().flat_map(|s| s.merged).flat_map(|m| &m.starts).copied().collect();
    if !starts.is_empty() {
        array("starts", &mut starts.into_iter().flat_map(u32::to_le_bytes))?;
    }
    let placements = shapes.iter().flat_map(|shape| shape.placements.as_flattened());
    array("placements", &mut floats(placements.copied()))?;
    let index = |index: Option<usize>| index.map_or(-1, |i| i as i32);
    let parts = rendered.tiles.parts.iter().flat_map(|part| {
        [index(part.object), index(part.material), index(part.captor), part.tiles.start as i32]
    });
    array("parts", &mut parts.flat_map(i32::to_le_bytes))?;
    let (arrived, kept) = (levels(rendered, most_arrived(rendered)), levels(rendered, 1.0));
    let local = arriving(rendered).map(|value| arrived.level(value));
    let local = local.chain(kept_shares(rendered).map(|share| kept.level(share)));
    match arrived.is_byte() {
        true => array("local", &mut local.map(|level| level as u8))?,
        false => array("local", &mut shorts(local))?,
    }
    let bands = rendered.scene.band_names().count();
    let groups = rendered.groups.iter().map(|group| &group.values);
    array("captors", &mut floats(received(&rendered.captors, bands)))?;
    array("groups", &mut floats(received(groups.clone(), bands)))?;
    if rendered.is_by_light() {
        let lights = rendered.scene.lights().len();
        let both = rendered.captors.iter().chain(groups);
        array("byLight", &mut floats(received_of_lights(both, lights, bands)))?;
    }
    array("shares", &mut shares(rendered))?;
    if let Some(hours) = &hours {
        let slots = hours.slots.iter().flat_map(|slot| slot.to_le_bytes());
        array("hourSlots", &mut { slots })?;
        array("hourValues", &mut shorts(hours.value_levels.iter().copied()))?;
        array("hourErrors", &mut hours.error_levels.iter().copied())?;
    }
    if let Some(light) = &rendered.light {
        let shown = shown_photons(light);
        let positions = light.map.positions();
        let levels = Levels::fine(most_power(light, &shown));
        let extent = extent(rendered);
        let places = shown.iter().flat_map(|&i| quantised(positions[i], &extent));
        array("photonPlaces", &mut shorts(places))?;
        let powers = shown.iter().flat_map(|&i| light.map.power(i));
        array("photonPowers", &mut shorts(powers.map(|power| levels.level(*power))))?;
        let normals = shown.iter().flat_map(|&i| face_normal(light, i));
        array("photonNormals", &mut normals.flat_map(i8::to_le_bytes))?;
        let bounce = |i: &usize| light.map.ways().get(*i).map_or(0, |way| way.bounces);
        array("photonBounces", &mut shorts(shown.iter().map(bounce)))?;
    }
    Ok(())
}

fn script(writer: &mut dyn Write, id: &str, kind: &str, text: &str) -> io::Result<()> {
    writeln!(writer, "<script type=\"{kind}\" id=\"{id}\">{text}</script>")
}

fn facts(rendered: &RenderedScene, shapes: &[Shape], hours: Option<&Hours>) -> Value {
    let scene = rendered.scene;
    let extent = extent(rendered);
    let unit = scene.quantity().unit_names();
    let bands =
        scene.bands().iter().enumerate().map(|(b, band)| json!({ "name": band.name, "of": [b] }));
    let sums = scene.sums().iter().enumerate().map(|(s, sum)| {
        let mut facts = json!({ "name": sum.name, "of": sum.bands, "sum": true });
        if !sum.weights.is_empty() {
            let [flux, irradiance] = scene.units(scene.bands().len() + s);
            facts["weights"] = json!(sum.weights);
            facts["unit"] = json!({ "flux": printed(&flux), "irradiance": printed(&irradiance) });
        }
        facts
    });
    let materials = scene.materials().iter();
    let few_paths = rendered.captors.iter().enumerate().filter(|(_, captor)| captor.few_paths());
    // lights that have a place
    let lights = scene.lights().iter().filter(|light| light.entrance().is_none());
    let lights = lights.take(MOST_LIGHTS).map(|light| {
        let Extent { min, max } = light.extent();
        json!({ "name": light.name, "min": min.to_array(), "max": max.to_array() })
    });
    // lights whose shares are known, if all of them are
    let split = rendered.is_by_light() || !rendered.shares().is_empty();
    let lamps = scene.lights().iter().filter(|_| split).map(|light| &light.name);
    let shown = rendered.light.as_ref().map(|light| (light, shown_photons(light)));
    json!({
        "phylux": env!("CARGO_PKG_VERSION"),
        "scene": scene.name(),
        "source": rendered.source,
        "unit": { "flux": printed(&unit.flux), "irradiance": printed(&unit.irradiance) },
        "bands": bands.chain(sums).collect::<Vec<_>>(),
        "objects": scene.objects(),
        "materials": materials
            .map(|m| json!({ "name": m.name, "clear": m.material.is_clear() }))
            .collect::<Vec<_>>(),
        "captors": scene.captors().iter().map(|captor| &captor.id).collect::<Vec<_>>(),
        "areas": scene.captors().iter().map(|captor| captor.area).collect::<Vec<_>>(),
        "fewPaths": few_paths.map(|(c, _)| c).collect::<Vec<_>>(),
        "lights": lights.collect::<Vec<_>>(),
        "lamps": lamps.collect::<Vec<_>>(),
        "groups": rendered.groups.iter().map(|group| {
            json!({ "name": group.values.id, "area": group.values.area })
        }).collect::<Vec<_>>(),
        "periods": scene.lattice().map(|lattice| [0, 1].map(|axis| lattice.period(axis).map(
            |Period { from, length, rise }| json!({ "from": from, "length": length, "rise": rise })
        ))),
        "min": extent.min.to_array(),
        "size": extent.size().to_array(),
        "tiles": rendered.tiles.count(),
        "shapes": shapes.iter().map(|shape| {
            let mut facts = json!({ "tiles": shape.tiles.len(), "copies": shape.placements.len() });
            if let Some(merged) = shape.merged {
                facts["triangles"] = merged.triangles.len().into();
            }
            facts
        }).collect::<Vec<_>>(),
        "hours": hours.map(Hours::facts),
        "local": rendered.has_local().then(|| levels(rendered, most_arrived(rendered)).facts()),
        // of a place where photons of equal power arrive
        "localError": rendered.light.as_ref().map(SurfaceLight::error_of_alike),
        "kept": levels(rendered, 1.0).facts(),
        "photons": shown.map(|(light, shown)| json!({
            "count": shown.len(), "levels": Levels::fine(most_power(light, &shown)).facts(),
            "histories": light.map.histories,
        })),
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

fn shorts(values: impl Iterator<Item = u16>) -> impl Iterator<Item = u8> {
    values.flat_map(u16::to_le_bytes)
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
fn received<'a>(
    all: impl IntoIterator<Item = &'a CaptorValues>,
    bands: usize,
) -> impl Iterator<Item = f32> {
    all.into_iter().flat_map(move |captor| {
        let each = CHANNELS.into_iter().flat_map(move |c| (0..bands).map(move |b| (c, b)));
        each.flat_map(move |(channel, band)| numbers(captor.value(channel, band)))
    })
}

/// Returns the same values for each light, one light after the other within a band.
fn received_of_lights<'a>(
    all: impl IntoIterator<Item = &'a CaptorValues>,
    lights: usize,
    bands: usize,
) -> impl Iterator<Item = f32> {
    all.into_iter().flat_map(move |captor| {
        let each = CHANNELS.into_iter().flat_map(move |c| (0..bands).map(move |b| (c, b)));
        each.flat_map(move |(channel, band)| {
            (0..lights).flat_map(move |light| numbers(captor.of_light(light, channel, band)))
        })
    })
}

fn numbers(estimate: Option<Estimate>) -> [f32; 2] {
    let error = estimate.and_then(|e| e.standard_error);
    [estimate.map(|e| e.mean), error].map(|value| value.map_or(f32::NAN, |value| value as f32))
}

/// Returns the indices of all photons of as many first histories as a page holds.
fn shown_photons(light: &SurfaceLight) -> Vec<usize> {
    let photons = &light.map.photons;
    let mut per_history: Vec<u32> = Vec::new();
    for photon in photons.iter() {
        let history = photon.history as usize;
        if history < MOST_PHOTONS {
            per_history.resize(per_history.len().max(history + 1), 0);
            per_history[history] += 1;
        }
    }
    let mut room = MOST_PHOTONS as u32;
    let whole = per_history.iter().take_while(|count| {
        let fits = **count <= room;
        room -= if fits { **count } else { 0 };
        fits
    });
    let histories = whole.count() as u32;
    (0..photons.len()).filter(|&i| photons[i].history < histories).collect()
}

/// Returns the normal of the face that a photon arrived on, in steps of 1/127.
fn face_normal(light: &SurfaceLight, photon: usize) -> [i8; 3] {
    let stored = &light.map.photons[photon];
    let normal = light.scene.surface(stored.triangle as usize).normal;
    let front = stored.direction.unpack().dot(normal) < 0.0;
    let facing = if front { normal } else { -normal };
    (127.0 * facing).to_array().map(|step| step.round() as i8)
}

fn most_power(light: &SurfaceLight, shown: &[usize]) -> f32 {
    let powers = shown.iter().flat_map(|&i| light.map.power(i));
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
}
