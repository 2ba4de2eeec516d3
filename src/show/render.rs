//! Pictures before they have colours: what the rays of every pixel find in a scene.
//!
//! Random numbers belong to pixels and rays, so a picture does not depend on threads.

mod denoise;
mod dots;
mod gather;
mod radiance;
mod shared;
#[cfg(test)]
mod tests;
mod viewpoint;

use std::sync::atomic::{AtomicU64, Ordering};

use glam::Vec3;
use rayon::prelude::*;

use crate::{
    error::{Error, NOTHING_WRITTEN, Result, catch_panic},
    math::{
        geometry::Ray,
        machine,
        rng::{Purpose, Stream, Streams},
        spectrum::{Spectrum, with_lanes},
    },
    transport::{
        simulate::{Control, Progress},
        surface_light::SurfaceLight,
    },
};

pub use denoise::{Guide, denoised, guides};
pub use dots::{Dot, path_dots, photon_dots};
pub use gather::Gather;
use radiance::Whitted;
use shared::{PIXELS, Shared};
pub use viewpoint::{FirstVisible, Viewpoint};

/// What a picture of light shows.
#[derive(Clone, Copy)]
pub enum Show<'a> {
    /// What a viewpoint would see: with light gathered where surfaces scatter it, or from the photons there alone.
    Radiance {
        /// What light is gathered from.
        gather: Option<&'a Gather<'a>>,
    },
    /// What arrives at the side that is seen.
    Irradiance,
    /// What the surface absorbs from both sides.
    Absorbed,
    /// The relative standard error of the irradiance in some bands together: one value a pixel.
    Error {
        /// Bands.
        bands: &'a [usize],
    },
}

/// How pixels are made.
#[derive(Clone, Copy, Debug)]
pub struct Sampling {
    /// Rays of each pixel, at least 1.
    pub rays: u32,
    /// Those that it has had before: further ones are others.
    pub before: u32,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Threads; 0 takes as many as there are processors.
    pub threads: usize,
}

/// A value per band and pixel, row by row from the upper left.
#[derive(Clone, Debug, PartialEq)]
pub struct Pixels {
    /// Pixels across.
    pub width: usize,
    /// Bands of a pixel.
    pub bands: usize,
    /// Means over the rays that met what is shown, band after band.
    pub values: Vec<f32>,
    /// Their variances as the rays tell them.
    pub variance: Vec<f32>,
    /// Variances of what the nearest photons tell of them, which pixels side by side have in common.
    pub common: Vec<f32>,
    /// Share of such rays, per pixel.
    pub covered: Vec<f32>,
}

/// Random numbers of a ray that are spread evenly over those of its pixel: its place there, a point of a lamp, and the
/// direction of a gathering ray.
const SPREAD: u32 = 8;

/// The most memory that the values of a picture may take, bytes.
const MAX_BYTES: usize = 2 << 30;

impl Pixels {
    /// The values of a pixel.
    pub fn pixel(&self, index: usize) -> &[f32] {
        &self.values[index * self.bands..][..self.bands]
    }

    /// The means over these and `more` rays of the same picture, where each pixel had `rays` and `others` of them.
    pub fn joined(mut self, rays: u32, more: &Self, others: u32) -> Self {
        let (rays, others) = (rays as f32, others as f32);
        let pixels = self.values.chunks_mut(self.bands).zip(more.values.chunks(self.bands));
        let share = |i: usize| {
            let (own, other) = (self.covered[i] * rays, more.covered[i] * others);
            if other > 0.0 { other / (own + other) } else { 0.0 }
        };
        for i in 0..self.variance.len() {
            let share = share(i / self.bands);
            self.variance[i] =
                (1.0 - share).powi(2) * self.variance[i] + share.powi(2) * more.variance[i];
            self.common[i] += share * (more.common[i] - self.common[i]);
        }
        for ((own, other), (covered, and)) in pixels.zip(self.covered.iter_mut().zip(&more.covered))
        {
            let (met, of_others) = (*covered * rays, and * others);
            let share = if of_others > 0.0 { of_others / (met + of_others) } else { 0.0 };
            own.iter_mut().zip(other).for_each(|(own, other)| *own += share * (other - *own));
            *covered = (met + of_others) / (rays + others);
        }
        self
    }
}

/// Renders a picture of light. Errors: it would not fit into memory, stopped by `control` (whose
/// progress counts pixels), no threads to be had.
pub fn render(
    light: &SurfaceLight,
    viewpoint: &Viewpoint,
    show: Show,
    sampling: Sampling,
    control: &Control,
) -> Result<Pixels> {
    let bands = match show {
        Show::Error { .. } => 1,
        _ => light.scene.bands.len(),
    };
    let (width, height) = (viewpoint.camera.width, viewpoint.camera.height);
    check_size(viewpoint, bands)?;
    let none = || vec![0.0; width * height * bands];
    let mut pixels = Pixels {
        width,
        bands,
        values: none(),
        variance: none(),
        common: none(),
        covered: vec![0.0; width * height],
    };
    let Pixels { values, variance, common, covered, .. } = &mut pixels;
    let [values, variance, common] =
        [values, variance, common].map(|rows| rows.par_chunks_mut(width * bands));
    let rows = values.zip(variance).zip(common).zip(covered.par_chunks_mut(width));
    with_lanes!(light.scene.lanes(), L => {
        each_row(rows, viewpoint, sampling, control, |mut samples, (((values, variance), common), covered)| {
            let whitted = Whitted { light, viewpoint };
            for (x, covered) in covered.iter_mut().enumerate() {
                let mut shared: [Shared; 2] = Default::default();
                let mut means = Means::new(bands);
                for (ray, mut rng) in samples.pixel(x) {
                    let found = match show {
                        Show::Radiance { gather } => {
                            let found = whitted.radiance::<L>(ray, gather, &mut shared, &mut rng);
                            let of_bands = |of: &Spectrum<L>| of.values()[..bands].iter().map(|v| f64::from(*v)).collect::<Vec<_>>();
                            let [radiance, told, gathered] =
                                [&found.radiance, &found.told, &found.gathered].map(of_bands);
                            means.add(&radiance, &told, &gathered);
                            continue;
                        }
                        Show::Irradiance => flat(viewpoint, ray, &mut shared[0], |triangle, front, point| {
                            light.irradiance(triangle, front, point)
                        }),
                        Show::Absorbed => flat(viewpoint, ray, &mut shared[0], |triangle, _, point| {
                            light.absorbed(triangle, point)
                        }),
                        Show::Error { bands } => flat(viewpoint, ray, &mut shared[0], |triangle, front, point| {
                            vec![light.relative_error(triangle, front, point, bands).unwrap_or(f64::NAN)]
                        })
                        .filter(|error| error[0].is_finite()),
                    };
                    if let Some(found) = found {
                        means.add(found, found, &[]);
                    }
                }
                let at = x * bands..(x + 1) * bands;
                means.tell(&mut values[at.clone()], &mut variance[at.clone()], &mut common[at], light.k);
                *covered = means.count as f32 / sampling.rays as f32;
            }
        })
    })?;
    Ok(pixels)
}

/// What the rays of a pixel have found, per band.
struct Means {
    count: u32,
    sums: Vec<f64>,
    /// What of it the nearest photons tell.
    told: Vec<f64>,
    /// What of it was gathered, and its squares.
    gathered: Vec<[f64; 2]>,
}

impl Means {
    fn new(bands: usize) -> Self {
        let none = vec![0.0; bands];
        Self { count: 0, sums: none.clone(), told: none, gathered: vec![[0.0; 2]; bands] }
    }

    /// One ray more: what it found, and what of it the nearest photons tell and was gathered.
    fn add(&mut self, found: &[f64], told: &[f64], gathered: &[f64]) {
        self.count += 1;
        self.sums.iter_mut().zip(found).for_each(|(sum, value)| *sum += value);
        self.told.iter_mut().zip(told).for_each(|(sum, value)| *sum += value);
        for ([sum, square], value) in self.gathered.iter_mut().zip(gathered) {
            *sum += value;
            *square += value * value;
        }
    }

    /// Their means, and the variances of these: of one ray as if it had gathered nothing but noise.
    fn tell(&self, values: &mut [f32], variance: &mut [f32], common: &mut [f32], k: usize) {
        let n = f64::from(self.count.max(1));
        for b in 0..values.len() {
            let [sum, square] = self.gathered[b];
            let of_mean =
                if self.count > 1 { (square - sum * sum / n) / (n - 1.0) } else { square };
            values[b] = (self.sums[b] / n) as f32;
            variance[b] = (of_mean / n).max(0.0) as f32;
            common[b] = ((self.told[b] / n).powi(2) / k as f64) as f32;
        }
    }
}

/// The mean colour of each pixel's rays. Errors: as [`render()`].
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

/// Does `work` for every row of a picture, in parallel.
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
        rows.enumerate().for_each(|(y, row)| {
            if !stopped() {
                work(Samples { viewpoint, sampling, y }, row);
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

/// The rays of the pixels of one row.
struct Samples<'a> {
    viewpoint: &'a Viewpoint<'a>,
    sampling: Sampling,
    y: usize,
}

impl Samples<'_> {
    /// The rays of a pixel, spread evenly over it, each with random numbers of its own.
    fn pixel(&mut self, x: usize) -> impl Iterator<Item = (Ray, Stream)> {
        let Self { viewpoint, sampling: Sampling { rays, before, seed, .. }, y } = *self;
        let pixel = (y * viewpoint.camera.width + x) as u64;
        (before..before + rays).map(move |ray| {
            let streams = |batch| Streams::new(seed, Purpose::Picture, batch);
            let sequence = streams(0).sequence(pixel);
            let stream = streams(ray.into()).history(pixel);
            let mut rng = stream.with_sobol(sequence, u64::from(ray), SPREAD);
            let within = rng.square();
            (viewpoint.camera.ray(x as f32 + within.x, y as f32 + within.y), rng)
        })
    }
}

/// A value of the first surface that cannot be seen through.
fn flat<'s>(
    viewpoint: &Viewpoint,
    ray: Ray,
    shared: &'s mut Shared,
    find: impl FnOnce(usize, bool, Vec3) -> Vec<f64>,
) -> Option<&'s [f64]> {
    let hit = viewpoint.opaque(&ray)?;
    let front = ray.direction.dot(viewpoint.scene.surface(hit.triangle).normal) < 0.0;
    let reach = PIXELS * viewpoint.camera.pixel() * hit.t;
    Some(shared.value(&hit, front, reach, || find(hit.triangle, front, hit.point)))
}

/// Refuses a picture that would not fit into memory.
pub fn check_size(viewpoint: &Viewpoint, bands: usize) -> Result<()> {
    let (width, height) = (viewpoint.camera.width, viewpoint.camera.height);
    // the values with two variances, and two colours made of them; 65536^2 x 4096 x 4 is below 2^64
    let bytes = width * height * (3 * bands + 6) * size_of::<f32>();
    if bytes <= MAX_BYTES {
        return Ok(());
    }
    let problem = format!(
        "{width} x {height} pixels of {bands} bands would take {:.0} GiB",
        bytes as f64 / f64::from(1 << 30)
    );
    Err(Error::input("picture", problem).remedy("ask for a smaller one"))
}
