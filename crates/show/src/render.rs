//! Pictures before they are coloured: the values per band, such as radiance, that the camera rays
//! of every pixel find in a scene.
//!
//! [`Viewpoint`] says what the camera sees; `radiance` follows camera rays through glass and
//! mirrors; `gather` finds the light that diffuse surfaces send back; `normals` makes curved meshes
//! round, and `gloss` leaves glossy; `fragments` keeps the sums of each pixel apart by surface;
//! `denoise` filters them; `dots` projects stored photons and paths instead, `coloured` is the
//! light that photons make together, and `ghosts` is what stands behind them; `marks` are lamps and
//! sensors that no ray meets.
//!
//! Random numbers belong to pixels and rays, so a picture does not depend on the number of threads.

mod coloured;
mod denoise;
mod dots;
mod fragments;
mod gather;
mod ghosts;
mod gloss;
mod marks;
mod normals;
mod radiance;
mod shared;
#[cfg(test)]
mod tests;
mod viewpoint;

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use glam::Vec3;
use rayon::prelude::*;

use phylux_core::{
    error::{Error, NOTHING_WRITTEN, Result, catch_panic},
    math::{
        geometry::Ray,
        machine,
        rng::{Purpose, Stream, Streams},
        spectrum::{Spectrum, with_lanes},
    },
    scene::{
        material::{Interaction, Scatterer},
        world::{Arrived, SurfaceHit},
    },
    transport::{
        simulate::{Control, Progress},
        surface_light::SurfaceLight,
    },
};

pub use coloured::ColouredLight;
pub use dots::{Dot, Leg, Paths, last_materials, path_dots, photon_dots};
pub use fragments::{Fragments, Pixels, Seen};
use fragments::{Guide, Sums};
pub use gather::Gather;
pub use ghosts::{Ghosts, stands};
pub use marks::{Bulb, SENSOR, bulbs, nearest_cell, rim, sensor};
use radiance::Whitted;
use shared::Shared;
pub use viewpoint::{FirstVisible, Viewpoint};

/// The quantity that a picture of light shows.
#[derive(Clone, Copy)]
pub enum Show<'a> {
    /// Radiance towards the viewpoint.
    Radiance,
    /// Irradiance on the side that is seen.
    Irradiance,
    /// Power per area that the surface absorbs, from both sides together.
    Absorbed,
    /// The sum of the irradiance over some bands, one value per pixel, together with what is needed
    /// for its relative standard errors ([`Fragments::errors`]).
    Error {
        /// Indices of the bands.
        bands: &'a [usize],
    },
}

/// How the pixels are sampled.
#[derive(Clone, Copy, Debug)]
pub struct Sampling {
    /// Number of rays of each pixel, at least 1.
    pub rays: u32,
    /// Number of rays that each pixel has had in earlier rounds; the rays of this round differ from
    /// them.
    pub before: u32,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Number of threads; 0 takes as many as there are processors.
    pub threads: usize,
}

/// The number of a ray's random numbers that are spread evenly over the rays of neighbouring
/// pixels, too: enough to choose a point on a lamp and the direction of a gathering ray.
const SPREAD: u32 = 6;
/// Side of the squares of pixels over which these numbers are spread, pixels.
const SQUARE: usize = 16;

/// Limit on the memory for the values of a picture whose pixels show two surfaces each, bytes.
const MAX_BYTES: usize = 4 << 30;

/// Renders a picture of `light`: with `gather` by final gathering, without it from the photons on
/// the surfaces that are seen alone. Returns sums per pixel, surface and band. Errors: the picture
/// would not fit into memory; `control` stopped the work (its progress counts pixels); no threads
/// can be started.
pub fn render(
    light: &SurfaceLight,
    gather: Option<&Gather>,
    viewpoint: &Viewpoint,
    show: Show,
    sampling: Sampling,
    control: &Control,
) -> Result<Fragments> {
    let bands = match show {
        Show::Error { .. } => 1,
        _ => light.scene.bands().len(),
    };
    let (width, height) = (viewpoint.camera.width, viewpoint.camera.height);
    check_size(viewpoint, bands)?;
    if let (Some(gather), false) = (gather, matches!(show, Show::Radiance)) {
        gather.with_white(sampling.threads)?;
    }
    let none = || Fragments::new(width, bands, sampling.rays);
    let mut rows: Vec<Fragments> = (0..height).map(|_| none()).collect();
    with_lanes!(light.scene.lanes(), L => {
        each_row(rows.par_iter_mut(), viewpoint, sampling, control, |mut samples, row| {
            let smooth = gather.filter(|_| matches!(show, Show::Radiance));
            let whitted = Whitted { light, viewpoint, normals: smooth.map(Gather::normals) };
            for x in 0..width {
                let mut shared: [Shared; 2] = Default::default();
                for (ray, mut rng) in samples.pixel(x) {
                    let first = First::of(&whitted, &ray);
                    let guide = first.as_ref().map(|first| first.guide);
                    if let Show::Radiance = show {
                        let found = whitted.radiance::<L>(ray, gather, &mut shared, &mut rng);
                        row.add(guide, (0..bands).map(|b| found.in_band(b)));
                        continue;
                    }
                    let Some((hit, front)) = first.and_then(|first| first.opaque) else { continue };
                    if let Show::Absorbed = show {
                        let found = whitted.absorbed::<L>(&ray, &hit, gather, &mut shared, &mut rng);
                        row.add(guide, (0..bands).map(|b| found.in_band(b)));
                        continue;
                    }
                    let [arriving, errors] = &mut shared;
                    let found = whitted.irradiance::<L>(&ray, &hit, gather, arriving, &mut rng);
                    let Show::Error { bands: together } = show else {
                        row.add(guide, (0..bands).map(|b| found.in_band(b)));
                        continue;
                    };
                    let error = errors.value(&hit, front, whitted.reach(&hit), || {
                        let told_by = whitted.told_by(gather);
                        let error = told_by.relative_error(hit.triangle, front, hit.point, together);
                        vec![error.unwrap_or(0.0)]
                    });
                    let sum = |of: &Spectrum<L>| together.iter().map(|&b| of.values()[b]).sum::<f32>();
                    let told = sum(&found.told);
                    let deviation = told * error[0] as f32;
                    let [lamps, surfaces] = [&found.lamps, &found.surfaces].map(|part| sum(part).into());
                    row.add(guide, std::iter::once(Sums { told, deviation, lamps, surfaces }));
                }
                row.close();
            }
        })
    })?;
    let mut all = none();
    rows.into_iter().for_each(|row| all.append(row));
    Ok(all)
}

/// What a camera ray meets first.
struct First {
    /// The first surface that cannot be seen through, and whether its front is seen.
    opaque: Option<(SurfaceHit, bool)>,
    /// This surface with the glass before it; where the sky is seen through glass, the glass.
    guide: Guide,
}

impl First {
    fn of(whitted: &Whitted, ray: &Ray) -> Option<Self> {
        let Whitted { light, viewpoint, .. } = *whitted;
        let clear = |at: &Arrived| at.material.is_clear();
        let guide = |at: &Arrived, through| {
            let Interaction { normal, front, .. } = at.interaction;
            let normal = if front { normal } else { -normal };
            let face = light.patches.bin(at.hit.triangle, front);
            Guide { face, through, material: at.surface.material, normal }
        };
        let first = whitted.seen(viewpoint.closest(ray)?, ray.direction);
        if !clear(&first) {
            let opaque = Some((first.hit, first.interaction.front));
            return Some(Self { opaque, guide: guide(&first, None) });
        }
        let glass = guide(&first, None);
        let Some(hit) = viewpoint.opaque(ray) else {
            return Some(Self { opaque: None, guide: glass });
        };
        let seen = whitted.seen(hit, ray.direction);
        let opaque = Some((hit, seen.interaction.front));
        let guide = Guide { normal: glass.normal, ..guide(&seen, Some(glass.face)) };
        Some(Self { opaque, guide })
    }
}

/// Returns the mean of `colour` over the rays of each pixel, row by row from the upper left.
/// Errors: as [`render()`].
pub fn painted(
    viewpoint: &Viewpoint,
    sampling: Sampling,
    control: &Control,
    colour: impl Fn(&Ray) -> Vec3 + Sync,
) -> Result<Vec<Vec3>> {
    let (width, height) = (viewpoint.camera.width, viewpoint.camera.height);
    check_size(viewpoint, 3)?;
    let mut colours = vec![Vec3::ZERO; width * height];
    each_row(colours.par_chunks_mut(width), viewpoint, sampling, control, |mut samples, row| {
        for (x, mean) in row.iter_mut().enumerate() {
            let colours = samples.pixel(x).map(|(ray, _)| colour(&ray));
            *mean = colours.sum::<Vec3>() / sampling.rays as f32;
        }
    })?;
    Ok(colours)
}

/// Does `work` for every row of a picture, in parallel. Errors: `control` stopped the work; no
/// threads can be started.
fn each_row<T: Send>(
    rows: impl IndexedParallelIterator<Item = T>,
    viewpoint: &Viewpoint,
    sampling: Sampling,
    control: &Control,
    work: impl Fn(Samples, T) + Sync + Send,
) -> Result<()> {
    let pool = machine::pool(sampling.threads)?;
    let (width, height) = (viewpoint.camera.width as u64, viewpoint.camera.height as u64);
    let done = AtomicU64::new(0);
    let stopped = || control.stop.load(Ordering::Relaxed);
    let all = || {
        // one by one, because some rows take far longer than others
        rows.with_max_len(1).enumerate().for_each(|(y, row)| {
            if !stopped() {
                work(Samples { viewpoint, sampling, y, stop: control.stop }, row);
            }
            let photons = done.fetch_add(width, Ordering::Relaxed) + width;
            (control.progress)(Progress { photons, of: Some(width * height), worst: None });
        });
        Ok(())
    };
    catch_panic("render", || pool.install(all))?;
    if stopped() {
        return Err(Error::interrupted("render", NOTHING_WRITTEN));
    }
    Ok(())
}

/// Generates the camera rays for the pixels of one row.
struct Samples<'a> {
    viewpoint: &'a Viewpoint<'a>,
    sampling: Sampling,
    y: usize,
    /// Once it is set there are no more rays: the picture will not be used.
    stop: &'a AtomicBool,
}

impl Samples<'_> {
    /// Returns the rays of a pixel, spread evenly over it, each with a random stream of its own.
    /// The first `SPREAD` numbers of the streams are spread evenly over squares of pixels: the
    /// pixels of a square share a Sobol sequence, in the order of a curve that keeps neighbours
    /// close to each other. What the rays of one pixel miss those of its neighbours then find, so
    /// less noise is left when the denoising filter averages neighbours (Ahmed and Wonka,
    /// Screen-Space Blue-Noise Diffusion of Monte Carlo Sampling Error via Hierarchical Ordering of
    /// Pixels, SIGGRAPH Asia 2020).
    fn pixel(&mut self, x: usize) -> impl Iterator<Item = (Ray, Stream)> {
        let Self { viewpoint, sampling: Sampling { rays, before, seed, .. }, y, stop } = *self;
        let (width, height) = (viewpoint.camera.width, viewpoint.camera.height);
        let pixel = (y * width + x) as u64;
        // the sequences of the squares are numbered after those of the pixels
        let square = width * height + y / SQUARE * width.div_ceil(SQUARE) + x / SQUARE;
        let first = along_z(x % SQUARE, y % SQUARE) * u64::from(rays);
        let go_on = move |_: &u32| !stop.load(Ordering::Relaxed);
        (before..before + rays).take_while(go_on).map(move |ray| {
            let streams = |batch: u32| Streams::new(seed, Purpose::Picture, batch.into());
            let stream = streams(ray).history(pixel);
            let own = streams(0).sequence(pixel);
            let within = stream.clone().with_sobol(own, ray.into(), 2).square();
            let shared = streams(before).sequence(square as u64);
            let rng = stream.with_sobol(shared, first + u64::from(ray - before), SPREAD);
            (viewpoint.camera.ray(x as f32 + within.x, y as f32 + within.y), rng)
        })
    }
}

/// Returns the position of a pixel along a Z-curve through its square: the bits of both coordinates
/// interleaved.
fn along_z(x: usize, y: usize) -> u64 {
    let bit = |i: u32| ((x >> i & 1) << (2 * i) | (y >> i & 1) << (2 * i + 1)) as u64;
    (0..SQUARE.ilog2()).map(bit).sum()
}

/// Refuses a picture of the viewpoint's size that would take more than `MAX_BYTES`. Error: it is
/// too large.
pub fn check_size(viewpoint: &Viewpoint, bands: usize) -> Result<()> {
    let (width, height) = (viewpoint.camera.width, viewpoint.camera.height);
    // per band six sums, a value and two variances for each of two surfaces, and colours; 65536^2
    // x 4096 x 80 is below 2^64
    let bytes = width * height * (2 * 9 * bands + 32) * size_of::<f32>();
    if bytes <= MAX_BYTES {
        return Ok(());
    }
    let problem = format!(
        "{width} x {height} pixels of {bands} bands would take {:.0} GiB",
        machine::gib(bytes as u64)
    );
    Err(Error::input("picture", problem).remedy("ask for a smaller one"))
}
