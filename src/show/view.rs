//! A scene with its light as one HTML page that needs no network: WebGL by three.js, all data in it.

use std::io::{self, Write};

use base64::{Engine, engine::general_purpose::STANDARD};
use serde_json::{Value, json};

use crate::{
    error::{Error, Result},
    math::{geometry::Extent, stats::Estimate},
    results::saved::CaptorValues,
    scene::{captor::CHANNELS, world::Scene},
    show::{picture::Scale, rendered::RenderedScene},
    transport::surface_light::SurfaceLight,
};

/// The most triangles in a page, some 150 MB.
const MOST_TRIANGLES: usize = 4_000_000;
/// The most captors.
const MOST_CAPTORS: usize = 500_000;
/// The most photons, those of the first histories.
const MOST_PHOTONS: usize = 50_000;
/// The most lights that are outlined.
const MOST_LIGHTS: usize = 10_000;

const PAGE: &str = include_str!("view/page.html");
const STYLE: &str = include_str!("view/page.css");
const SCRIPTS: [&str; 6] = [
    include_str!("view/data.js"),
    include_str!("view/draw.js"),
    include_str!("view/table.js"),
    include_str!("view/link.js"),
    include_str!("view/panel.js"),
    include_str!("view/start.js"),
];
/// three.js, MIT; see `view/three.md`.
const THREE: &str = include_str!("view/three.min.js");
const THREE_LICENCE: &str = include_str!("view/three.LICENSE");

/// Refuses a scene that no page can hold.
pub fn check_view(scene: &Scene) -> Result<()> {
    let counts = [
        (scene.triangles().len() + scene.captor_triangles().len(), MOST_TRIANGLES, "triangles"),
        (scene.captors.len(), MOST_CAPTORS, "captors"),
    ];
    for (count, most, what) in counts {
        if count > most {
            return Err(Error::input("scene", format!("{count} {what}, a page holds {most}"))
                .remedy("export it (.vtp) and open it in ParaView"));
        }
    }
    Ok(())
}

/// Writes the page.
pub fn write_view(rendered: &RenderedScene, writer: &mut dyn Write) -> io::Result<()> {
    for piece in PAGE.split_inclusive("-->") {
        let (text, slot) = match piece.rsplit_once("<!--") {
            Some((text, slot)) => (text, slot.trim_end_matches("-->").trim()),
            None => (piece, ""),
        };
        writer.write_all(text.as_bytes())?;
        match slot {
            "" => {}
            "title" => writer.write_all(escaped(&rendered.scene.name).as_bytes())?,
            "style" => writer.write_all(STYLE.as_bytes())?,
            "three" => write!(writer, "/*\n{THREE_LICENCE}*/\n{THREE}")?,
            "script" => writer.write_all(SCRIPTS.join("\n").as_bytes())?,
            "data" => write_data(rendered, writer)?,
            _ => return Err(io::Error::other(format!("page.html: no `{slot}` to fill in"))),
        }
    }
    Ok(())
}

/// Text that is no markup.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// The facts as JSON, long lists of numbers as base64.
fn write_data(rendered: &RenderedScene, writer: &mut dyn Write) -> io::Result<()> {
    let facts = facts(rendered).to_string();
    // in a script element only `<` could end it
    script(writer, "facts", "application/json", &facts.replace('<', "\\u003c"))?;
    let mut array = |name: &str, bytes: &[u8]| {
        script(writer, name, "application/octet-stream", &STANDARD.encode(bytes))
    };
    let extent = extent(rendered);
    let corners = rendered.tiles.corners.iter().flat_map(|t| [t.a, t.b, t.c]);
    array("corners", &shorts(corners.flat_map(|p| quantised(p, &extent))))?;
    let index = |index: Option<usize>| index.map_or(-1, |i| i as i32);
    let parts = rendered.tiles.parts.iter().flat_map(|part| {
        [index(part.object), index(part.material), index(part.captor), part.tiles.start as i32]
    });
    array("parts", &parts.flat_map(i32::to_le_bytes).collect::<Vec<u8>>())?;
    let most = most_light(rendered);
    array("local", &shorts(local(rendered).map(|value| level(value, most))))?;
    let floats =
        |values: Vec<f32>| values.into_iter().flat_map(f32::to_le_bytes).collect::<Vec<u8>>();
    let bands = rendered.scene.band_names().count();
    let groups = rendered.groups.iter().map(|group| &group.values);
    array("captors", &floats(received(&rendered.captors, bands).collect()))?;
    array("groups", &floats(received(groups.clone(), bands).collect()))?;
    if rendered.is_by_light() {
        let lights = rendered.scene.lights.len();
        let both = rendered.captors.iter().chain(groups);
        array("byLight", &floats(received_of_lights(both, lights, bands).collect()))?;
    }
    array("shares", rendered.shares())?;
    if let Some(light) = &rendered.light {
        let shown = shown_photons(light);
        let positions = light.map.positions();
        let most = most_power(light, &shown);
        array(
            "photonPlaces",
            &shorts(shown.iter().flat_map(|&i| quantised(positions[i], &extent))),
        )?;
        let powers = shown.iter().flat_map(|&i| light.map.power(i));
        array("photonPowers", &shorts(powers.map(|power| level(*power, most))))?;
        let normals = shown.iter().flat_map(|&i| face_normal(light, i));
        array("photonNormals", &normals.flat_map(i8::to_le_bytes).collect::<Vec<u8>>())?;
        let bounce = |i: &usize| light.map.ways().get(*i).map_or(0, |way| way.bounces);
        array("photonBounces", &shorts(shown.iter().map(bounce)))?;
    }
    Ok(())
}

fn script(writer: &mut dyn Write, id: &str, kind: &str, text: &str) -> io::Result<()> {
    writeln!(writer, "<script type=\"{kind}\" id=\"{id}\">{text}</script>")
}

fn facts(rendered: &RenderedScene) -> Value {
    let scene = rendered.scene;
    let extent = extent(rendered);
    let unit = scene.quantity.unit_names();
    let bands =
        scene.bands.iter().enumerate().map(|(b, band)| json!({ "name": band.name, "of": [b] }));
    let sums =
        scene.sums.iter().map(|sum| json!({ "name": sum.name, "of": sum.bands, "sum": true }));
    let materials = scene.materials.iter();
    let few_paths = rendered.captors.iter().enumerate().filter(|(_, captor)| captor.few_paths());
    // those that have a place
    let lights = scene.lights.iter().filter(|light| light.entrance().is_none());
    let lights = lights.take(MOST_LIGHTS).map(|light| {
        let Extent { min, max } = light.extent();
        json!({ "name": light.name, "min": min.to_array(), "max": max.to_array() })
    });
    // those whose share is known, if each of them is
    let split = rendered.is_by_light() || !rendered.shares().is_empty();
    let lamps = scene.lights.iter().filter(|_| split).map(|light| &light.name);
    let shown = rendered.light.as_ref().map(|light| (light, shown_photons(light)));
    json!({
        "phylux": env!("CARGO_PKG_VERSION"),
        "scene": scene.name,
        "source": rendered.source,
        "unit": { "flux": unit.flux, "irradiance": unit.irradiance },
        "bands": bands.chain(sums).collect::<Vec<_>>(),
        "objects": scene.objects,
        "materials": materials
            .map(|m| json!({ "name": m.name, "clear": m.material.is_clear() }))
            .collect::<Vec<_>>(),
        "captors": scene.captors.iter().map(|captor| &captor.id).collect::<Vec<_>>(),
        "areas": scene.captors.iter().map(|captor| captor.area).collect::<Vec<_>>(),
        "fewPaths": few_paths.map(|(c, _)| c).collect::<Vec<_>>(),
        "lights": lights.collect::<Vec<_>>(),
        "lamps": lamps.collect::<Vec<_>>(),
        "groups": rendered.groups.iter().map(|group| {
            json!({ "name": group.values.id, "captors": group.captors, "area": group.values.area })
        }).collect::<Vec<_>>(),
        "min": extent.min.to_array(),
        "size": extent.size().to_array(),
        "tiles": rendered.tiles.count(),
        "local": rendered.has_local().then(|| json!({ "most": most_light(rendered), "span": SPAN })),
        "photons": shown.map(|(light, shown)| json!({
            "count": shown.len(), "most": most_power(light, &shown),
            "histories": light.map.histories,
        })),
        "colours": STANDARD.encode(colours().as_flattened()),
    })
}

/// The colour map in 256 steps, sRGB.
fn colours() -> Vec<[u8; 3]> {
    let map = Scale { low: 0.0, high: 255.0, log: false };
    let byte = |share: f32| (255.0 * share).round() as u8;
    (0..=255).map(|i| map.colour(f64::from(i)).to_array().map(byte)).collect()
}

/// A box around all tiles and lights.
fn extent(rendered: &RenderedScene) -> Extent {
    let lights = rendered.scene.lights.iter().map(|light| light.extent());
    let tiles = Extent::of_triangles(&rendered.tiles.corners);
    lights.fold(tiles, Extent::join)
}

/// Coordinates as 16-bit steps of the box.
fn quantised(p: glam::Vec3, extent: &Extent) -> [u16; 3] {
    // a side without length has no steps
    let fraction = (p - extent.min) / extent.size().max(glam::Vec3::splat(f32::MIN_POSITIVE));
    (fraction * 65535.0).to_array().map(|step| step.round() as u16)
}

/// Natural logarithm of the ratio of the greatest value to the least that is told apart from 0.
const SPAN: f32 = 18.0;

/// A value on a logarithmic scale of 16 bits, to 0.02 %: 0 is 0, 65535 is `most`.
fn level(value: f32, most: f32) -> u16 {
    let fraction = 1.0 + (value / most).ln() / SPAN;
    // no number and what is too small become 0
    if fraction > 0.0 { (1.0 + fraction.min(1.0) * 65534.0).round() as u16 } else { 0 }
}

fn shorts(values: impl Iterator<Item = u16>) -> Vec<u8> {
    values.flat_map(u16::to_le_bytes).collect()
}

/// The light on the tiles of surfaces: channel after channel, band after band, tile after tile.
fn local<'a>(rendered: &'a RenderedScene) -> impl Iterator<Item = f32> + 'a {
    let bands = rendered.scene.bands.len();
    let planes =
        CHANNELS.into_iter().flat_map(move |channel| (0..bands).map(move |b| (channel, b)));
    planes.flat_map(move |(channel, band)| {
        (0..rendered.tiles.count())
            .map_while(move |tile| rendered.local(tile, channel).map(|v| v[band]))
    })
}

fn most_light(rendered: &RenderedScene) -> f32 {
    local(rendered).fold(f32::MIN_POSITIVE, f32::max)
}

/// What captors or groups received per area: channel after channel, band after band and sums, value before error;
/// NaN where it is not known.
fn received<'a>(
    all: impl IntoIterator<Item = &'a CaptorValues>,
    bands: usize,
) -> impl Iterator<Item = f32> {
    all.into_iter().flat_map(move |captor| {
        let each = CHANNELS.into_iter().flat_map(move |c| (0..bands).map(move |b| (c, b)));
        each.flat_map(move |(channel, band)| numbers(captor.value(channel, band)))
    })
}

/// The same of each light, one light after the other within a band.
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

/// All photons of as many first histories as a page holds.
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

/// Normal of the face that a photon arrived on, in steps of 1/127.
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
