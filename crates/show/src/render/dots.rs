//! Stored photons and paths of photons, as dots in a picture.

use std::sync::atomic::Ordering;

use glam::Vec3;
use rayon::prelude::*;

use super::Viewpoint;
use phylux_core::{
    error::{Error, NOTHING_WRITTEN, Result},
    math::{
        geometry::Ray,
        machine,
        rng::{Purpose, Stream, Streams},
        spectrum::{Lanes, Spectrum, with_lanes},
    },
    scene::{
        light::Strata,
        material::{BsdfSample, LobeKind, Scatterer, Transport},
        world::{Arrived, Scene, SurfaceHit},
    },
    transport::{
        photon_map::Way,
        simulate::{Control, Progress},
        surface_light::SurfaceLight,
        trace::{Event, Guide, Onward, trace},
    },
};

/// A dot of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dot {
    /// Position in pixels, right and down from the upper left corner.
    pub at: [f32; 2],
    /// Distance from the viewpoint, m.
    pub distance: f32,
    /// The share of its light that comes through the surfaces in front of it, in (0, 1].
    pub clear: f32,
    /// Index of the photon in the photon map, or of the leg of a path.
    pub index: usize,
}

/// The share of the light of a dot that a surface in front of it lets through, so that one sees
/// into a canopy.
pub(super) const TRANSLUCENT: f32 = 0.12;
/// Number of surfaces behind which a dot can still be seen.
pub(super) const LAYERS: usize = 2;
/// The share of the light of a dot on glass or water, which would seem to hang in the air.
pub(super) const ON_GLASS: f32 = 0.15;
/// In a scene that repeats, photons are drawn in the cell of the viewpoint and in as many beyond it
/// on each side.
const CELLS: i32 = 40;

/// Returns a dot for each stored photon that is visible, behind at most two surfaces. A photon is
/// behind its own surface, too, if it arrived at the side that faces away. Where the scene repeats,
/// the cells around that of the viewpoint show their images of the photons, farther ones fewer. The
/// farthest dots come first. Errors: `control` stopped the work; no threads can be started.
pub fn photon_dots(
    light: &SurfaceLight,
    viewpoint: &Viewpoint,
    threads: usize,
    control: &Control,
) -> Result<Vec<Dot>> {
    let scene = light.scene;
    let positions = light.map.positions();
    let dot_of = |index: usize, shift: Vec3| {
        let photon = &light.map.photons[index];
        if viewpoint.is_cut(photon.triangle as usize) {
            return None;
        }
        let point = positions[index] + shift;
        let surface = scene.surface(photon.triangle as usize);
        let from_front = photon.direction.unpack().dot(surface.normal) < 0.0;
        let is_clear = scene.material(&surface).is_clear();
        let seen_from_front = (point - viewpoint.camera.position).dot(surface.normal) < 0.0;
        let faces_away = !is_clear && from_front != seen_from_front;
        let dot = dot(viewpoint, point, index, usize::from(faces_away))?;
        let share = if is_clear { ON_GLASS } else { 1.0 };
        Some(Dot { clear: share * dot.clear, ..dot })
    };
    let pool = machine::pool(threads)?;
    let mut dots = Vec::new();
    let cells = cells(viewpoint);
    let all: f64 = cells.iter().map(|cell| positions.len() as f64 * cell.share).sum();
    let mut done = 0;
    for Images { shift, share } in cells {
        let images = (positions.len() as f64 * share) as usize;
        let index = |i: usize| ((i as f64 + 0.5) / share) as usize;
        for first in (0..images).step_by(CHUNK) {
            check_stopped(control)?;
            let some = first..images.min(first + CHUNK);
            done += some.len() as u64;
            let found = some.into_par_iter().filter_map(|i| dot_of(index(i), shift));
            dots.extend(pool.install(|| found.collect::<Vec<Dot>>()));
            let of = Some(all as u64);
            (control.progress)(Progress { photons: done, of, worst: None });
        }
    }
    dots.sort_by(|a, b| b.distance.total_cmp(&a.distance));
    Ok(dots)
}

/// Number of photons between two looks at `control`.
const CHUNK: usize = 50_000;

fn check_stopped(control: &Control) -> Result<()> {
    if control.stop.load(Ordering::Relaxed) {
        return Err(Error::interrupted("render", NOTHING_WRITTEN));
    }
    Ok(())
}

/// The photons of a cell of a scene that repeats, or of a whole scene.
struct Images {
    /// The way from a photon to its image there.
    shift: Vec3,
    /// The share of the photons whose images are drawn: the farther away a cell, the fewer, so that
    /// they do not crowd there.
    share: f64,
}

/// Returns the cells in which photons are drawn.
fn cells(viewpoint: &Viewpoint) -> Vec<Images> {
    let Some(lattice) = viewpoint.scene.lattice() else {
        return vec![Images { shift: Vec3::ZERO, share: 1.0 }];
    };
    let eye = viewpoint.camera.position;
    let middle = lattice.cell_of(eye.as_dvec3());
    let along = |axis: usize| match lattice.period(axis) {
        Some(_) => middle[axis] - CELLS..middle[axis] + CELLS + 1,
        None => 0..1,
    };
    let cells = along(0).flat_map(|i| along(1).map(move |j| [i, j]));
    let shifts: Vec<Vec3> = cells.map(|cell| lattice.shift(cell).as_vec3()).collect();
    let nearest = shifts.iter().map(|shift| shift.distance(eye)).fold(f32::INFINITY, f32::min);
    let nearest = nearest.max(lattice.shortest() as f32);
    let share = |shift: Vec3| f64::from(nearest / shift.distance(eye)).powi(2).min(1.0);
    shifts.into_iter().map(|shift| Images { shift, share: share(shift) }).collect()
}

/// Returns the index of the material from which each stored photon came; `None` straight from its
/// light. Error: no threads can be started.
pub fn last_materials(light: &SurfaceLight, threads: usize) -> Result<Vec<Option<usize>>> {
    let positions = light.map.positions();
    let last = |(index, point): (usize, &Vec3)| last_material(light, index, *point);
    Ok(machine::pool(threads)?.install(|| positions.par_iter().enumerate().map(last).collect()))
}

/// Looks back from where a stored photon arrived.
fn last_material(light: &SurfaceLight, index: usize, point: Vec3) -> Option<usize> {
    let way = light.map.ways()[index];
    if way.bounces == 0 && !way.mirrored {
        return None;
    }
    let scene = light.scene;
    let photon = &light.map.photons[index];
    let back = -photon.direction.unpack();
    let surface = scene.surface(photon.triangle as usize);
    let side = if back.dot(surface.normal) < 0.0 { -surface.normal } else { surface.normal };
    let from = SurfaceHit { t: 0.0, triangle: photon.triangle as usize, point };
    let hit = scene.closest(&scene.leave(&from, side, back))?;
    Some(scene.surface(hit.triangle).material as usize)
}

/// A straight part of the path of a photon.
#[derive(Clone, Debug, PartialEq)]
pub struct Leg {
    /// Index of the light that emitted the photon.
    pub light: usize,
    /// The way by which it has come so far.
    pub way: Way,
    /// What it carries, per band, relative to other photons.
    pub power: Vec<f32>,
    /// Index of the material that it left; `None` at its light.
    pub left: Option<usize>,
}

/// Paths of photons as dots.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Paths {
    /// The legs of all paths.
    pub legs: Vec<Leg>,
    /// Dots along them, about one per pixel, each with the power there, as a fraction of that with
    /// which the photon was emitted.
    pub dots: Vec<(Dot, f32)>,
}

/// The smallest fraction of the power with which a photon of a drawn path goes on.
const FAINT: f32 = 0.02;
/// The length of the last leg of a path that leaves the scene, as a fraction of the scene's radius:
/// it fades along its way.
const TAIL: f32 = 0.5;
/// The length of a path from the sky before it enters the scene, in the same measure.
const FROM_SKY: f32 = 2.0;

/// Returns dots along the paths of `paths` photons from surface to surface, where at most two
/// surfaces hide them. The photons come from all lights, and lose at each surface what it absorbs
/// (in a run they rather end there by chance), in the `bands` together. Error: `control` stopped
/// the work.
pub fn path_dots(
    scene: &Scene,
    viewpoint: &Viewpoint,
    paths: u64,
    bands: &[usize],
    seed: u64,
    control: &Control,
) -> Result<Paths> {
    let mut all = Paths::default();
    for (index, path) in paths_of(scene, paths, bands, seed).into_iter().enumerate() {
        check_stopped(control)?;
        for Flown { leg, ends, strengths } in path {
            let index = all.legs.len();
            all.legs.push(leg);
            all.dots.extend(dots_along(viewpoint, ends, strengths, index));
        }
        let (photons, of) = (index as u64 + 1, Some(paths));
        (control.progress)(Progress { photons, of, worst: None });
    }
    Ok(all)
}

/// Returns visible dots from one point to another, with the strength at each.
fn dots_along(
    viewpoint: &Viewpoint,
    ends: [Vec3; 2],
    strengths: [f32; 2],
    index: usize,
) -> Vec<(Dot, f32)> {
    let Some((from, to)) = in_front(viewpoint, ends[0], ends[1]) else { return Vec::new() };
    let [Some(a), Some(b)] = [from, to].map(|point| viewpoint.camera.project(point)) else {
        return Vec::new();
    };
    let Some([first, last]) = within(viewpoint, a, b) else { return Vec::new() };
    let length = (last - first) * (a[0] - b[0]).hypot(a[1] - b[1]);
    let steps = length.ceil().max(1.0) as usize;
    let whole = ends[0].distance(ends[1]);
    let at = |step: usize| {
        let share = first + (last - first) * (step as f32 + 0.5) / steps as f32;
        let point = along(viewpoint, [from, to], share);
        let flown = if whole > 0.0 { point.distance(ends[0]) / whole } else { 0.0 };
        let strength = strengths[0] + (strengths[1] - strengths[0]) * flown.clamp(0.0, 1.0);
        dot(viewpoint, point, index, 0).map(|dot| (dot, strength))
    };
    (0..steps).filter_map(at).collect()
}

/// Returns the part of the way between two pixels that is in the picture, as fractions of the way;
/// its ends may be far outside. `None` if no part is.
fn within(viewpoint: &Viewpoint, a: [f32; 2], b: [f32; 2]) -> Option<[f32; 2]> {
    let sizes = [viewpoint.camera.width, viewpoint.camera.height];
    let (mut first, mut last) = (0.0f32, 1.0f32);
    for axis in 0..2 {
        let (from, step, size) = (a[axis], b[axis] - a[axis], sizes[axis] as f32);
        if step == 0.0 {
            if !(0.0..size).contains(&from) {
                return None;
            }
            continue;
        }
        let [low, high] = [-from / step, (size - from) / step];
        first = first.max(low.min(high));
        last = last.min(low.max(high));
    }
    (first < last).then_some([first, last])
}

/// Returns the point at a fraction `share` of the way from one end to the other, measured in the
/// picture.
fn along(viewpoint: &Viewpoint, [from, to]: [Vec3; 2], share: f32) -> Vec3 {
    let depth = |p: Vec3| (p - viewpoint.camera.position).dot(viewpoint.camera.forward());
    let (near, far) = (depth(from), depth(to));
    // equal steps in the picture are equal steps in 1 / depth
    let weight = share * near / (share * near + (1.0 - share) * far);
    from.lerp(to, weight)
}

/// Returns the part of a leg of a path that lies in front of the viewpoint, if there is one.
fn in_front(viewpoint: &Viewpoint, from: Vec3, to: Vec3) -> Option<(Vec3, Vec3)> {
    let near = 1e-3 * from.distance(to);
    let depth = |p: Vec3| (p - viewpoint.camera.position).dot(viewpoint.camera.forward()) - near;
    let (a, b) = (depth(from), depth(to));
    let cut = || from.lerp(to, a / (a - b));
    match (a > 0.0, b > 0.0) {
        (true, true) => Some((from, to)),
        (true, false) => Some((from, cut())),
        (false, true) => Some((cut(), to)),
        (false, false) => None,
    }
}

/// Returns a dot behind so many surfaces more than those between the viewpoint and the point.
fn dot(viewpoint: &Viewpoint, point: Vec3, index: usize, behind: usize) -> Option<Dot> {
    let at = viewpoint.camera.project(point)?;
    let inside = |x: f32, size: usize| x >= 0.0 && x < size as f32;
    if !(inside(at[0], viewpoint.camera.width) && inside(at[1], viewpoint.camera.height)) {
        return None;
    }
    let behind = behind + viewpoint.in_front_of(point, LAYERS + 1);
    let distance = point.distance(viewpoint.camera.position);
    let clear = TRANSLUCENT.powi(behind as i32);
    (behind <= LAYERS).then_some(Dot { at, distance, clear, index })
}

/// A leg of a path, from end to end, and the fraction of its power that the photon has at both.
struct Flown {
    leg: Leg,
    ends: [Vec3; 2],
    strengths: [f32; 2],
}

/// Follows photons without a game of chance: what a surface absorbs they lose.
struct Fading;

impl<'s, L: Lanes> Guide<'s, L> for Fading {
    fn scatter(
        &mut self,
        at: &Arrived<'s>,
        power: &Spectrum<L>,
        scattered: &mut Spectrum<L>,
        rng: &mut Stream,
    ) -> Option<Onward> {
        let BsdfSample { direction, weight, lobe } =
            at.material.sample::<L>(&at.interaction, Transport::Light, rng)?;
        *scattered = weight * power;
        (scattered.largest() > FAINT).then_some(Onward { direction, lobe })
    }
}

/// Returns the legs of `paths` photons. Photons that meet no surface are left out.
fn paths_of(scene: &Scene, paths: u64, bands: &[usize], seed: u64) -> Vec<Vec<Flown>> {
    let all = paths.max(scene.sources() as u64);
    with_lanes!(scene.lanes(), L => {
        let strata = Strata::new(scene.lights(), all, scene.lanes());
        let streams = Streams::new(seed, Purpose::Dots, 0);
        (0..paths)
            .map(|index| {
                // one of each so many histories, so that all lights take part
                let history = (u128::from(index) * u128::from(all) / u128::from(paths)) as u64;
                let mut rng = streams.history(index);
                let photon = scene.emit::<L>(&strata, history, &mut rng);
                let weights: Vec<f32> = photon.weights.iter().map(|w| *w as f32).collect();
                let carried = |power: &Spectrum<L>| -> Vec<f32> {
                    power.values().iter().zip(&weights).map(|(p, w)| p * w).collect()
                };
                let sum = |power: &[f32]| bands.iter().map(|&b| power[b]).sum::<f32>();
                let first = carried(&photon.power);
                let emitted = sum(&first);
                let mut legs = Vec::new();
                if emitted <= 0.0 {
                    return legs;
                }
                let Ray { origin, direction } = photon.ray;
                // what comes from the sky is seen from above the scene on
                let above = if photon.start.is_none() { FROM_SKY * scene.radius() } else { 0.0 };
                let mut from = origin - above * direction;
                let mut way = Way::default();
                let mut left = None;
                let mut flown = |power: &Spectrum<L>, way, left, ends, rest: f32| {
                    let power = carried(power);
                    let strength = sum(&power) / emitted;
                    let leg = Leg { light: photon.light, way, power, left };
                    legs.push(Flown { leg, ends, strengths: [strength, rest * strength] });
                };
                trace(scene, photon.ray, photon.power, Fading, &mut rng, |event| match event {
                    Event::Arrival { at, power, lobe, .. } => {
                        // the scene may describe the place some periods away
                        let first = if way == Way::default() && left.is_none() { above } else { 0.0 };
                        let to = from + (first + at.hit.t) * at.interaction.direction;
                        flown(power, way, left, [from, to], 1.0);
                        from = to;
                        left = Some(at.surface.material as usize);
                        if let Some(lobe) = lobe {
                            way = onward(way, lobe, at.material.glossy() > 0.0);
                        }
                    }
                    Event::Escaped { power, missed: false, direction } => {
                        let to = from + TAIL * scene.radius() * direction;
                        flown(power, way, left, [from, to], 0.0);
                    }
                    _ => {}
                });
                legs
            })
            .collect()
    })
}

/// Returns the way of a photon that a surface has sent on by a lobe.
fn onward(way: Way, lobe: LobeKind, is_glossy: bool) -> Way {
    Way {
        bounces: way.bounces.saturating_add(u16::from(lobe.is_diffuse())),
        mirrored: way.mirrored || lobe.is_specular(),
        diffused: way.diffused || (lobe.is_diffuse() && !is_glossy),
    }
}
