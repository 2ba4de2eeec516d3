//! Checks: what a scene holds, and what looks wrong in it.

mod copies;
mod inside;
mod lamps;
mod leaves;
mod mesh;
mod objects;
mod remarks;
mod solids;

use std::collections::{BTreeMap, BTreeSet};

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use serde::Serialize;

pub use leaves::{LeafOptics, LeafSummary};
pub use objects::ObjectSummary;
pub use remarks::decimals;
use remarks::{Remarks, length, quoted};

use phylux_core::{
    error::{Error, NO_THREADS, Result, number},
    math::{
        geometry::{Extent, Ray, Triangle, closeness},
        rng::{Purpose, Streams},
        units::{LengthUnit, Quantity},
    },
    scene::{
        captor::{Captor, CaptorKind},
        daylight::InfiniteLight,
        lattice::Lattice,
        light::{Entrance, Light},
        material::{Material, Scatterer},
        world::{FlushLight, LOOKED_AT, Scene, Standing},
    },
};
use phylux_files::scene_file::{LoadedScene, TableNote};

/// A band is too wide for a spectrum if the mean square of the spectrum in it is above this
/// multiple of the square of its mean.
const WIDE: f64 = 1.05;

/// Lamps are suspiciously bright if their light, spread over half of the surface of the box around
/// the scene, is more than this many times full sunlight (1000 W/m2 or 2000 umol/m2/s).
const BRIGHT: f64 = 5.0;
/// A lamp is suspiciously bright if it has more than this many times the power of the median lamp.
const ODD: f64 = 300.0;
/// Lamps, and captors in daylight, that are farther than this many times the size of everything else,
/// and than so many metres, are worth a warning.
const FAR: f32 = 10.0;
/// The usual range of the size of a scene, m.
const USUAL_SIZE: [f64; 2] = [0.01, 1000.0];

/// The contents of a scene, and remarks about them.
#[derive(Clone, Debug)]
pub struct SceneSummary {
    /// Size of surfaces, lights and captors together along x, y and z, m.
    pub size: DVec3,
    /// The surfaces by material.
    pub surfaces: Vec<MaterialSummary>,
    /// What the leaves among the materials do with light.
    pub leaves: Vec<LeafSummary>,
    /// The objects that have surfaces.
    pub objects: Vec<ObjectSummary>,
    /// Probable mistakes. Each warning names the thing and says what to do.
    pub warnings: Vec<String>,
    /// Remarks on things that are right but may surprise.
    pub notes: Vec<String>,
}

/// The surfaces of one material.
#[derive(Clone, Debug, Serialize)]
pub struct MaterialSummary {
    /// Name of the material.
    pub material: String,
    /// Number of its triangles.
    pub triangles: usize,
    /// One-sided area of all of them together, m2.
    pub area: f64,
}

/// Checks a scene, on threads of its own. Error: threads cannot be started.
pub fn check(loaded: &LoadedScene) -> Result<SceneSummary> {
    let pool = rayon::ThreadPoolBuilder::new().build();
    Ok(pool.map_err(|e| Error::run("threads", e).remedy(NO_THREADS))?.install(|| look_over(loaded)))
}

/// Returns warnings about meshes, and lights in them, that send light the wrong way, and about suns
/// behind a slope; a run prints them. Error: threads cannot be started.
pub fn check_meshes(scene: &Scene) -> Result<Vec<String>> {
    let pool = rayon::ThreadPoolBuilder::new().build();
    pool.map_err(|e| Error::run("threads", e).remedy(NO_THREADS))?.install(|| {
        let mut remarks = Remarks::default();
        check_coincident(scene, &mut remarks);
        check_own_images(scene, &mut remarks);
        check_flush_lights(scene, &mut remarks);
        check_slope(scene, &mut remarks);
        if scene.materials().iter().any(|m| matches!(m.material, Material::Dielectric(_))) {
            solids::check_solids(scene, &mesh::weld(scene), &mut remarks);
        }
        Ok(remarks.warnings)
    })
}

fn look_over(loaded: &LoadedScene) -> SceneSummary {
    let scene = &loaded.scene;
    let surfaces = surfaces(scene);
    let lit = scene.lights().iter().map(|light| light.extent());
    let lit = lit.fold(scene.triangles().extent(), Extent::join);
    let size = lit.join(scene.captors_extent()).size().as_dvec3();

    let mut remarks = Remarks { warnings: loaded.warnings.clone(), notes: loaded.notes.clone() };
    let usual = check_unit(size, loaded.unit, &mut remarks);
    check_materials(loaded, &mut remarks);
    check_spectra(loaded, &mut remarks);
    note_tables(loaded, &mut remarks);
    check_lights(scene, &mut remarks);
    check_distances(scene, &mut remarks);
    // of a scene in the wrong unit all powers look wrong
    if usual {
        let extent = lit.join(scene.captors_extent());
        check_powers(scene, &extent, &mut remarks);
    }
    check_flush_lights(scene, &mut remarks);
    check_captors(scene, &lit, &mut remarks);
    check_ground(loaded, &mut remarks);
    check_openings(scene, &mut remarks);
    check_areas(scene, &mut remarks);
    let vertices = mesh::weld(scene);
    check_coincident(scene, &mut remarks);
    check_own_images(scene, &mut remarks);
    note_periods(scene, &mut remarks);
    solids::check_solids(scene, &vertices, &mut remarks);
    solids::check_sheets(scene, &vertices, &mut remarks);
    objects::check_slips(scene, &mut remarks);
    let Remarks { warnings, notes } = remarks;
    SceneSummary {
        size,
        surfaces,
        leaves: leaves::leaves(scene),
        objects: objects::objects(scene),
        warnings,
        notes,
    }
}

fn surfaces(scene: &Scene) -> Vec<MaterialSummary> {
    let materials = scene.materials().iter().map(|m| m.name.clone());
    let mut surfaces: Vec<MaterialSummary> =
        materials.map(|material| MaterialSummary { material, triangles: 0, area: 0.0 }).collect();
    for Standing { triangles, copies, area } in scene.standing() {
        for i in triangles {
            let summary = &mut surfaces[scene.surface(i).material as usize];
            summary.triangles += copies;
            summary.area += 0.5 * cross(&scene.triangles().at(i)).length() * area;
        }
    }
    surfaces
}

/// Warns of a scene of an unlikely size, and returns whether its size is a usual one.
fn check_unit(size: DVec3, unit: LengthUnit, remarks: &mut Remarks) -> bool {
    let [least, most] = USUAL_SIZE;
    let largest = size.max_element();
    let usual = largest <= 0.0 || (least..=most).contains(&largest);
    if !usual {
        let adjective = if largest < least { "small" } else { "large" };
        let (size, unit) = (length(largest), unit.name());
        remarks.warnings.push(format!(
            "the scene is very {adjective}: {size} across, with lengths in {unit}; check `unit` \
            and the coordinates"
        ));
    }
    usual
}

fn check_materials(loaded: &LoadedScene, remarks: &mut Remarks) {
    remarks.warn_of(quoted(&loaded.unused_materials), |list| {
        format!("materials on no surface: {list}; check `usemtl` and `material`, or remove them")
    });
    remarks.warn_of(quoted(&loaded.non_reciprocal_leaves), |list| {
        format!(
            "leaves whose faces differ in transmittance, which no real sheet does (reciprocity): \
            {list}; give both faces the same, unless it was measured so"
        )
    });
}

fn note_tables(loaded: &LoadedScene, remarks: &mut Remarks) {
    for TableNote { pointer, reciprocity } in &loaded.tables {
        let percent = 100.0 * reciprocity;
        remarks.notes.push(format!(
            "{pointer}: f(i, o) and f(o, i) of its file differ by {percent:.2} % of their mean (reciprocity)"
        ));
    }
}

/// Warns of bands in which one number cannot stand for a spectrum: light that meets the surface
/// twice would be scaled by the mean square of the spectrum.
fn check_spectra(loaded: &LoadedScene, remarks: &mut Remarks) {
    let wide = loaded.averages.iter().flat_map(|average| {
        let bands = loaded.scene.bands().iter().zip(&average.spreads);
        bands.filter(|(_, spread)| **spread > WIDE).map(move |(band, spread)| {
            format!("{} in band `{}` ({spread:.2})", average.pointer, band.name)
        })
    });
    remarks.warn_of(wide, |list| {
        format!(
            "bands too wide for spectra, with the mean square over the square of the mean (1.05 is much): {list}; \
            use narrower bands there"
        )
    });
}

/// Warns of powers that are too large by orders of magnitude.
fn check_powers(scene: &Scene, around: &Extent, remarks: &mut Remarks) {
    let full_sun = match scene.quantity() {
        Quantity::Watt => 1000.0,
        Quantity::Micromole => 2000.0,
    };
    let lamps = scene.lights().iter().filter(|light| light.entrance().is_none());
    let powers = lamps.map(|light| (&light.name, light.power.iter().sum::<f64>()));
    let mut powers: Vec<(&String, f64)> = powers.filter(|(_, power)| *power > 0.0).collect();
    powers.sort_by(|a, b| b.1.total_cmp(&a.1));
    let Some(&(brightest, most)) = powers.first() else { return };
    let units = scene.quantity().unit_names();
    let all: f64 = powers.iter().map(|(_, power)| power).sum();
    let area = f64::from(around.half_area());
    if area > 0.0 && all > BRIGHT * full_sun * area {
        remarks.warnings.push(format!(
            "the lamps emit {} {flux}, {} {irradiance} around the scene, where full sunlight is {full_sun}; check the \
            unit of `power`, most of all of `{brightest}` (docs/scene-format.md#errors-and-warnings)",
            number(all),
            number((all / area).round()),
            flux = units.flux,
            irradiance = units.irradiance,
        ));
    }
    let usual = powers[powers.len() / 2].1;
    let odd = powers.iter().take_while(|(_, power)| *power > ODD * usual);
    remarks.warn_of(quoted(odd.map(|(name, _)| *name)), |list| {
        format!(
            "lamps of more than {ODD} times the power of most others ({} {}): {list}, up to {} {}; check their `power`",
            number(usual),
            units.flux,
            number(most),
            units.flux
        )
    });
}

/// Returns the distance from a box beyond which a unit is in doubt, m.
fn far_from(around: &Extent) -> f32 {
    FAR * around.size().length().max(1.0)
}

/// Warns of lamps that are so far from everything that their unit is in doubt.
fn check_distances(scene: &Scene, remarks: &mut Remarks) {
    let around = scene.triangles().extent().join(scene.captors_extent());
    let lamps = scene.lights().iter().filter(|light| light.entrance().is_none());
    let there = around.size() != Vec3::ZERO;
    let far = lamps.filter(|light| there && light.extent().is_clear_of(&around, far_from(&around)));
    remarks.warn_of(quoted(far.map(|light| &light.name)), |list| {
        format!(
            "lights more than {FAR} m and {FAR} times the scene's size from all surfaces and captors: {list}; \
            check their position and its unit"
        )
    });
}

/// Returns whether suns are part of a light, and all of them stand behind the slope of the ground.
fn is_behind_the_slope(scene: &Scene, light: &Light) -> bool {
    let hillside = scene.lattice().and_then(Lattice::hillside);
    let infinite = light.entrance().map(|entrance| &entrance.light);
    hillside.zip(infinite).is_some_and(|(hillside, light)| light.is_behind(hillside))
}

fn check_slope(scene: &Scene, remarks: &mut Remarks) {
    let behind = scene.lights().iter().filter(|light| is_behind_the_slope(scene, light));
    remarks.warn_of(quoted(behind.map(|light| &light.name)), |list| {
        format!(
            "lights whose sun stands behind the slope of the ground, from where none of it arrives: {list}; check \
            where the sun stands, and `slope` (docs/scene-format.md#scenes-that-repeat)"
        )
    });
}

fn check_lights(scene: &Scene, remarks: &mut Remarks) {
    check_slope(scene, remarks);
    let is_dark = |light: &&Light| light.power.iter().all(|&p| p == 0.0);
    let dark = scene.lights().iter().filter(is_dark);
    let dark = dark.filter(|light| !is_behind_the_slope(scene, light));
    remarks.warn_of(quoted(dark.map(|light| &light.name)), |list| {
        format!("lights without power in any band: {list}; give them power or remove them")
    });
}

/// Warns of lights in the plane of a surface, and of tubes that reach into one, each with the
/// surface.
fn check_flush_lights(scene: &Scene, remarks: &mut Remarks) {
    let named = |flush: &&FlushLight| {
        let surface = &scene.surface(flush.triangle);
        let material = &scene.materials()[surface.material as usize].name;
        let object = scene.object(flush.triangle).map_or(material, |o| &scene.objects()[o]);
        format!("`{}` in `{object}`", scene.lights()[flush.light].name)
    };
    let list = |lifted: bool| {
        let lights = scene.flush_lights().iter().filter(|flush| flush.lifted == lifted);
        lights.map(|flush| named(&flush)).collect::<Vec<_>>()
    };
    remarks.warn_of(list(true), |list| {
        format!(
            "lights in the plane of a surface: {list}; they shine on one side of it; move them off by a millimetre \
            to choose which (docs/scene-format.md#lights)"
        )
    });
    remarks.warn_of(list(false), |list| {
        format!(
            "tubes that reach into a surface: {list}; what they emit beyond it is not seen on this side; \
            move them off it by more than their radius (docs/scene-format.md#lights)"
        )
    });
}

fn check_captors(scene: &Scene, lit: &Extent, remarks: &mut Remarks) {
    // in a scene that repeats nothing is outside
    let bounded = !scene.triangles().is_empty() && scene.lattice().is_none();
    let outside = scene.captors().iter().filter(|captor| {
        bounded && matches!(captor.kind, CaptorKind::Virtual { .. }) && {
            let extent = scene.extent_of(captor);
            // above a canopy there is sky
            let gap = match scene.has_daylight() {
                true => far_from(lit),
                false => closeness(extent.max.abs().max(extent.min.abs())),
            };
            extent.is_clear_of(lit, gap)
        }
    });
    remarks.warn_of(quoted(outside.map(|captor| &captor.id)), |list| {
        format!(
            "captors outside the box around all surfaces and lights: {list}; check their position \
            and `unit`"
        )
    });
    let in_surface = scene.captors_in_surfaces().iter().map(|&c| &scene.captors()[c].id);
    remarks.note_of(quoted(in_surface), |list| {
        format!(
            "captors in the plane of a surface: {list}; they count as lying just off it, on the \
            side that their normals point to"
        )
    });
}

/// Warns of captors in daylight that have neither a surface nor light from the ground below them.
fn check_ground(loaded: &LoadedScene, remarks: &mut Remarks) {
    if loaded.without_ground.is_empty() {
        return;
    }
    let captors = loaded.scene.captors().iter();
    let bare = captors.filter(|captor| !stands_over_surface(&loaded.scene, captor));
    let lights = loaded.without_ground.join("` and `");
    remarks.warn_of(quoted(bare.map(|captor| &captor.id)), |list| {
        format!(
            "captors with no surface below them in light of `{lights}` without `ground`: {list}; add a ground \
            object, or `ground` to the light (docs/scene-format.md#daylight)"
        )
    });
}

/// Returns whether a surface lies below the middle of a captor. A floor that is a captor counts as
/// below itself, but a leaf does not.
fn stands_over_surface(scene: &Scene, captor: &Captor) -> bool {
    /// The largest number of leaves of a captor that may lie over each other.
    const MOST: usize = 100;
    let middle = (captor.center - scene.center()).as_vec3();
    let above = scene.offset_of(captor);
    let origin = middle + (closeness(middle) + 4.0 * above) * Vec3::Z;
    let mut down = Ray { origin, direction: Vec3::NEG_Z };
    for _ in 0..MOST {
        let Some(hit) = scene.closest(&down) else { return false };
        let own = captor.kind == CaptorKind::Surface && captor.triangles.contains(&hit.triangle);
        if !own || !scene.material(&scene.surface(hit.triangle)).transmits_diffusely() {
            return true;
        }
        down = scene.pass(&hit, Vec3::NEG_Z);
    }
    true
}

/// Notes of a scene that repeats how large its cell is and what reaches out of it.
fn note_periods(scene: &Scene, remarks: &mut Remarks) {
    let Some(lattice) = scene.lattice() else { return };
    let along = |axis: usize, name: &str| {
        let length = lattice.period(axis)?.length;
        Some(format!("{} m along {name}", number(length)))
    };
    let periods: Vec<String> = [along(0, "x"), along(1, "y")].into_iter().flatten().collect();
    let (out, all) = (scene.reaching_out(), scene.triangles().len());
    remarks.notes.push(format!(
        "the scene repeats each {}; powers and sums are those of one cell; {out} of {all} triangles reach out of the \
        cell, whole",
        periods.join(" and ")
    ));
}

/// Warns of surfaces that lie on their own images, and of those that reach very far.
fn check_own_images(scene: &Scene, remarks: &mut Remarks) {
    if scene.lattice().is_none() {
        return;
    }
    let (mut objects, mut far) = (BTreeSet::new(), BTreeSet::new());
    for triangle in scene.standing_for_all() {
        let object = scene.object(triangle);
        if !objects.contains(&object) && scene.lies_on_its_image(triangle) {
            objects.insert(object);
        }
        if scene.reaches_far(triangle) {
            far.insert(object);
        }
    }
    let surface = "a surface".to_owned();
    let name = |object: Option<usize>| object.map_or(&surface, |o| &scene.objects()[o]);
    remarks.warn_of(quoted(far.into_iter().map(name)), |list| {
        format!(
            "objects with a triangle that reaches over more than 1000 periods: {list}; what is \
            farther away is rounded coarsely, or left out; correct their corners"
        )
    });
    remarks.warn_of(quoted(objects.into_iter().map(name)), |list| {
        format!(
            "objects that lie on their own images, so that light meets only one of them: {list}; \
            make ground exactly as large as the cell (`periodic`)"
        )
    });
}

/// Notes how much of the light of the sky comes in, where it comes in only through openings.
fn check_openings(scene: &Scene, remarks: &mut Remarks) {
    const RAYS: u64 = 20_000;
    for (l, light) in scene.infinite_lights().filter(|(_, light)| !light.through.is_empty()) {
        let all =
            InfiniteLight::new(light.name.clone(), scene.bands().len(), light.parts().to_vec());
        let all = Entrance::new(all, scene.bands().len(), scene.inside(), DVec3::ZERO);
        let streams = Streams::new(0, Purpose::Other, l as u64);
        let let_in = |ray: Ray| {
            let back = Ray { origin: ray.origin, direction: -ray.direction };
            // the openings may lie inside or outside the box
            let hit = scene.closest(&ray).map_or(f32::INFINITY, |hit| hit.t);
            let far = Ray { origin: ray.at(hit.min(4.0 * scene.radius())), ..back };
            scene.is_let_in(l, &far)
        };
        let rays = (0..RAYS).filter_map(|i| all.enter_anywhere(&mut streams.history(i)));
        let found = rays.filter(|ray| let_in(*ray)).count();
        remarks.notes.push(format!(
            "light of `{}` comes in through its openings alone: {:.1} % of what enters the box around the scene; \
            the rest is missing",
            light.name,
            100.0 * found as f64 / RAYS as f64
        ));
    }
}

fn check_areas(scene: &Scene, remarks: &mut Remarks) {
    let flat = |t: &Triangle| cross(t) == DVec3::ZERO;
    let mut by_material: BTreeMap<u32, usize> = BTreeMap::new();
    let all = scene
        .standing()
        .into_iter()
        .flat_map(|standing| standing.triangles.map(move |triangle| (triangle, standing.copies)));
    for (i, copies) in all.filter(|(i, _)| flat(&scene.triangles().at(*i))) {
        *by_material.entry(scene.surface(i).material).or_default() += copies;
    }
    let on_surfaces = by_material
        .iter()
        .map(|(&m, count)| format!("{count} of `{}`", scene.materials()[m as usize].name));
    let on_captors = scene.captors().iter().filter_map(|captor| {
        let CaptorKind::Virtual { .. } = captor.kind else { return None };
        let None = scene.round(captor) else { return None };
        let count = scene.triangles_of(captor).iter().filter(|t| flat(t)).count();
        (count > 0).then(|| format!("{count} of captor `{}`", captor.id))
    });
    remarks.warn_of(on_surfaces.chain(on_captors), |list| {
        format!("triangles without area, which light never meets: {list}; remove them")
    });
}

/// Warns of faces in the same place, of which light meets only one. Two faces are in the same place
/// if each has its middle in the other, however they are cut. Faces of two solids are left to
/// `solids`. A small face on a large one is an object that stands there.
fn check_coincident(scene: &Scene, remarks: &mut Remarks) {
    let material = |i: usize| scene.surface(i).material;
    let solid = |i: usize| scene.material(&scene.surface(i)).is_solid();
    let has_area = |i: usize| scene.triangles().at(i).normal() != Vec3::ZERO;
    let copies = scene.copies().iter().map(|pair| pair.map(|i| i as usize));
    let copies = copies.filter(|&[i, first]| has_area(i) && !(solid(i) && solid(first)));
    let mut pairs: BTreeMap<[u32; 2], usize> = BTreeMap::new();
    copies.for_each(|pair| *pairs.entry(pair.map(material)).or_default() += 1);

    let look = |i: usize| {
        let mut least = usize::MAX;
        let all = scene.has_coincident(i, |other| {
            least = if other == i { least } else { other.min(least) };
            false
        });
        let mutual = |other: usize| {
            let same = |j| j != other && material(j) == material(i);
            scene.has_coincident(other, same) == Some(true)
        };
        let twin = least < i && !(solid(i) && solid(least)) && mutual(least);
        (twin.then_some(least), all.is_none())
    };
    let distinct = scene.distinct_by_place().into_par_iter();
    let looked = distinct.map(|i| (i, look(i))).filter(|(_, found)| *found != (None, false));
    let looked: Vec<_> = looked.collect();
    let mut crowded: BTreeMap<u32, usize> = BTreeMap::new();
    for (i, (below, cut_short)) in looked {
        below.iter().for_each(|&p| *pairs.entry([i, p].map(material)).or_default() += 1);
        *crowded.entry(material(i)).or_default() += usize::from(cut_short);
    }
    crowded.retain(|_, count| *count > 0);

    let name = |m: u32| &scene.materials()[m as usize].name;
    let pairs = pairs.iter().map(|(&[q, p], n)| format!("{n} of `{}` on `{}`", name(q), name(p)));
    remarks.warn_of(pairs, |list| {
        format!(
            "triangles in the same place as others, front to front or back to back, of which light \
            meets only one: {list}; remove one of the two"
        )
    });
    let crowded = crowded.iter().map(|(&m, n)| format!("{n} of `{}`", name(m)));
    remarks.warn_of(crowded, |list| {
        format!(
            "triangles with more than {LOOKED_AT} others in one place, of which only so many were \
            looked at: {list}; remove those that lie there more than once"
        )
    });
}

/// Returns the vector along the triangle's normal whose length is twice its area, m2.
fn cross(t: &Triangle) -> DVec3 {
    let (a, b, c) = (t.a.as_dvec3(), t.b.as_dvec3(), t.c.as_dvec3());
    (b - a).cross(c - a)
}
