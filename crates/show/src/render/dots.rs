//! Stored photons and paths of photons, as dots in a picture.

use std::sync::atomic::Ordering;

use glam::Vec3;
use rayon::prelude::*;

use super::Viewpoint;
use phylux_core::{
    error::{Error, NOTHING_WRITTEN, Result},
    math::{
        machine,
        rng::{Purpose, Streams},
        spectrum::with_lanes,
    },
    scene::{light::Strata, world::Scene},
    transport::{
        simulate::{Control, Progress},
        surface_light::SurfaceLight,
        trace::{Event, trace},
    },
};

/// A dot of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dot {
    /// Position in pixels, right and down from the upper left corner.
    pub at: [f32; 2],
    /// Distance from the viewpoint, m.
    pub distance: f32,
    /// Index of the photon in the photon map, or of the path.
    pub index: usize,
}

/// Returns a dot for each stored photon that is visible: nothing opaque is in front of it, and it
/// arrived at the side of the surface that the viewpoint is on. The farthest come first. Errors:
/// `control` stopped the work; no threads can be started.
pub fn photon_dots(
    light: &SurfaceLight,
    viewpoint: &Viewpoint,
    threads: usize,
    control: &Control,
) -> Result<Vec<Dot>> {
    let positions = light.map.positions();
    let dot = |(index, &point): (usize, &Vec3)| {
        let photon = &light.map.photons[index];
        let normal = light.scene.surface(photon.triangle as usize).normal;
        let from_front = photon.direction.unpack().dot(normal) < 0.0;
        let seen_from_front = (point - viewpoint.camera.position).dot(normal) < 0.0;
        dot(viewpoint, point, index)
            .filter(|_| from_front == seen_from_front && viewpoint.sees(point))
    };
    let pool = machine::pool(threads)?;
    let mut dots = Vec::new();
    for (chunk, points) in positions.chunks(CHUNK).enumerate() {
        check_stopped(control)?;
        let first = chunk * CHUNK;
        let found = points.par_iter().enumerate().filter_map(|(i, point)| dot((first + i, point)));
        dots.extend(pool.install(|| found.collect::<Vec<Dot>>()));
        let (photons, of) = ((first + points.len()) as u64, Some(positions.len() as u64));
        (control.progress)(Progress { photons, of, worst: None });
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

/// Returns dots along the paths of `paths` photons from surface to surface, about one per pixel,
/// where nothing opaque hides them. The photons come from all lights. Error: `control` stopped the
/// work.
pub fn path_dots(
    scene: &Scene,
    viewpoint: &Viewpoint,
    paths: u64,
    seed: u64,
    control: &Control,
) -> Result<Vec<Dot>> {
    let mut dots = Vec::new();
    for (index, corners) in paths_of(scene, paths, seed).iter().enumerate() {
        check_stopped(control)?;
        for leg in corners.windows(2) {
            let Some((from, to)) = in_front(viewpoint, leg[0], leg[1]) else { continue };
            let ends = [from, to].map(|point| viewpoint.camera.project(point));
            let [Some(a), Some(b)] = ends else { continue };
            // at most 2 (width + height) steps, wherever the ends are
            let most = 2 * (viewpoint.camera.width + viewpoint.camera.height);
            let steps =
                ((a[0] - b[0]).abs().max((a[1] - b[1]).abs()).ceil() as usize).clamp(1, most);
            for step in 0..=steps {
                let point = along(viewpoint, [from, to], step as f32 / steps as f32);
                if let Some(dot) = dot(viewpoint, point, index)
                    && viewpoint.sees(point)
                {
                    dots.push(dot);
                }
            }
        }
        let (photons, of) = (index as u64 + 1, Some(paths));
        (control.progress)(Progress { photons, of, worst: None });
    }
    Ok(dots)
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

fn dot(viewpoint: &Viewpoint, point: Vec3, index: usize) -> Option<Dot> {
    let at = viewpoint.camera.project(point)?;
    let inside = |x: f32, size: usize| x >= 0.0 && x < size as f32;
    let seen = inside(at[0], viewpoint.camera.width) && inside(at[1], viewpoint.camera.height);
    seen.then(|| Dot { at, distance: point.distance(viewpoint.camera.position), index })
}

/// Returns the corners of `paths` photon paths: the start at the light, then each arrival.
fn paths_of(scene: &Scene, paths: u64, seed: u64) -> Vec<Vec<Vec3>> {
    let all = paths.max(scene.sources() as u64);
    with_lanes!(scene.lanes(), L => {
        let strata = Strata::new(scene.lights(), all, scene.lanes());
        let streams = Streams::new(seed, Purpose::Dots, 0);
        (0..paths)
            .map(|index| {
                let mut rng = streams.history(index);
                let photon = scene.emit::<L>(&strata, index, &mut rng);
                let mut corners = vec![photon.ray.origin];
                trace(scene, photon.ray, photon.power, (), &mut rng, |event| {
                    if let Event::Arrival { at, .. } = event {
                        corners.push(at.hit.point);
                    }
                });
                corners
            })
            .collect()
    })
}
