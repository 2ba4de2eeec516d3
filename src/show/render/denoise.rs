//! Pictures without blotches: a filter that evens out noise over each piece of surface, and keeps its edges.
//!
//! Passes with growing steps between their taps (à trous; Dammertz, Sewtz, Hanika and Lensch, Edge-Avoiding
//! À-Trous Wavelet Transform for fast Global Illumination Filtering, HPG 2010). Here two pixels *exchange* light:
//! what one gains the other loses, so the sum over a picture stays what it was to rounding.

use glam::Vec3;
use rayon::prelude::*;

use super::{Pixels, Sampling, Viewpoint};
use crate::{error::Result, math::machine, scene::patches::Patches};

/// Passes; the steps between taps are 1, 2, 4 and 8 pixels, and all together reach 9 pixels far (root mean
/// square): farther ones would even out the slope of light near edges.
const PASSES: u32 = 4;
/// The B3 spline from the middle on.
const KERNEL: [f32; 3] = [3.0 / 8.0, 1.0 / 4.0, 1.0 / 16.0];
/// Standard errors of the difference of two pixels from which on they keep what they have.
const EDGE: f32 = 4.0;
/// Pixels to each side over which variances are pooled: those of few rays know little, and those of a pixel that light has
/// found by chance nothing of its neighbours'.
const POOL: isize = 3;

/// What a pixel shows. Only pixels that show the same face of one smooth piece in one material exchange light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guide {
    /// The smooth piece and its face.
    face: u32,
    material: u32,
    normal: Vec3,
}

/// What the pixels of a viewpoint show; none where there are several things, or nothing. Error: no threads to be had.
pub fn guides(
    viewpoint: &Viewpoint,
    patches: &Patches,
    sampling: Sampling,
) -> Result<Vec<Option<Guide>>> {
    let width = viewpoint.camera.width;
    let guide = |x: f32, y: f32| {
        let ray = viewpoint.camera.ray(x, y);
        let hit = viewpoint.opaque(&ray)?;
        let surface = viewpoint.scene.surface(hit.triangle);
        let front = ray.direction.dot(surface.normal) < 0.0;
        let face = patches.bin(hit.triangle, front);
        Some(Guide { face, material: surface.material, normal: surface.normal })
    };
    // near the corners of the pixel
    let places = [(0.1, 0.1), (0.9, 0.1), (0.1, 0.9), (0.9, 0.9)];
    let pixel = |i: usize| {
        let (x, y) = ((i % width) as f32, (i / width) as f32);
        let mut seen = places.into_iter().map(|(dx, dy)| guide(x + dx, y + dy));
        let first = seen.next()??;
        let same = |other: Option<Guide>| other.is_some_and(|other| first.weight(&other) > 0.0);
        seen.all(same).then_some(first)
    };
    let count = width * viewpoint.camera.height;
    let pool = machine::pool(sampling.threads)?;
    Ok(pool.install(|| (0..count).into_par_iter().map(pixel).collect()))
}

impl Guide {
    /// How much two pixels have to do with each other, in [0, 1]; the same both ways.
    fn weight(&self, other: &Self) -> f32 {
        match self.face == other.face && self.material == other.material {
            true => self.normal.dot(other.normal).max(0.0).powi(8),
            false => 0.0,
        }
    }
}

/// The same picture with less noise. Error: no threads to be had.
pub fn denoised(pixels: &Pixels, guides: &[Option<Guide>], threads: usize) -> Result<Pixels> {
    let pool = machine::pool(threads)?;
    let each = |work: &(dyn Fn(usize) -> Vec<[f32; 2]> + Sync)| -> Vec<[f32; 2]> {
        pool.install(|| (0..guides.len()).into_par_iter().flat_map_iter(work).collect())
    };
    let mut picture = pixels.clone();
    picture.variance = each(&|i| pooled(pixels, guides, i)).into_iter().map(|[v, _]| v).collect();
    for pass in 0..PASSES {
        let found = each(&|i| exchanged(&picture, guides, i, 1 << pass));
        for (i, [value, variance]) in found.into_iter().enumerate() {
            (picture.values[i], picture.variance[i]) = (value, variance);
        }
    }
    Ok(picture)
}

/// Pixels beside one that show something of the same surface, and how much they have to do with it.
fn beside(
    picture: &Pixels,
    guides: &[Option<Guide>],
    index: usize,
    reach: isize,
    step: isize,
) -> impl Iterator<Item = (isize, isize, usize, f32)> {
    let (width, height) = (picture.width as isize, (guides.len() / picture.width) as isize);
    let (x, y) = (index as isize % width, index as isize / width);
    let side = 2 * reach + 1;
    let taps = (0..side * side).map(move |i| (i % side - reach, i / side - reach));
    taps.filter(|tap| *tap != (0, 0)).filter_map(move |(dx, dy)| {
        let (tap_x, tap_y) = (x + step * dx, y + step * dy);
        let inside = (0..width).contains(&tap_x) && (0..height).contains(&tap_y);
        let tap = inside.then(|| (tap_y * width + tap_x) as usize)?;
        let weight = guides[index]?.weight(guides[tap].as_ref()?);
        (weight > 0.0).then_some((dx, dy, tap, weight))
    })
}

/// The variances of a pixel, or those of the pixels about it where they are larger.
fn pooled(picture: &Pixels, guides: &[Option<Guide>], index: usize) -> Vec<[f32; 2]> {
    let bands = picture.bands;
    let own = &picture.variance[index * bands..][..bands];
    let mut sums: Vec<[f32; 2]> = own.iter().map(|own| [*own, 1.0]).collect();
    for (.., tap, weight) in beside(picture, guides, index, POOL, 1) {
        for (sum, there) in sums.iter_mut().zip(&picture.variance[tap * bands..]) {
            *sum = [sum[0] + weight * there, sum[1] + weight];
        }
    }
    sums.iter().zip(own).map(|([sum, weights], own)| [own.max(sum / weights), 0.0]).collect()
}

/// The values of a pixel after it has exchanged light with those that are `step` and twice that away, and their variances.
fn exchanged(
    picture: &Pixels,
    guides: &[Option<Guide>],
    index: usize,
    step: isize,
) -> Vec<[f32; 2]> {
    let Pixels { bands, ref values, ref variance, ref common, .. } = *picture;
    let own = index * bands;
    // values, variances, and what of its own the pixel keeps
    let mut sums: Vec<[f32; 3]> = (own..own + bands).map(|i| [values[i], 0.0, 1.0]).collect();
    for (dx, dy, tap, weight) in beside(picture, guides, index, 2, step) {
        let spline = KERNEL[dx.unsigned_abs()] * KERNEL[dy.unsigned_abs()];
        for (b, [value, of_others, kept]) in sums.iter_mut().enumerate() {
            let (i, j) = (own + b, tap * bands + b);
            let known = variance[i] + variance[j] + common[i] + common[j];
            let share = weight * spline * alike(values[i], values[j], known);
            if share > 0.0 {
                *value += share * (values[j] - values[i]);
                *of_others += share * share * variance[j];
                *kept -= share;
            }
        }
    }
    let variances = sums.iter().zip(&variance[own..]);
    variances.map(|([value, of_others, kept], v)| [*value, kept * kept * v + of_others]).collect()
}

/// How alike two values are, whose difference has this variance: 1 for the same, 0 from [`EDGE`] standard errors on
/// (Tukey's biweight).
fn alike(a: f32, b: f32, variance: f32) -> f32 {
    let difference = (a - b) / EDGE;
    let share = difference * difference / variance;
    if share.is_nan() { 0.0 } else { (1.0 - share).max(0.0).powi(2) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rng::{Purpose, Streams};

    const SIDE: usize = 64;

    /// Light that falls off to the right by a tenth, and half as much below a shadow's edge.
    fn truth(i: usize) -> f32 {
        let (x, y) = ((i % SIDE) as f32, i / SIDE);
        (1.0 - 0.1 * x / SIDE as f32) * if y < SIDE / 2 { 1.0 } else { 0.5 }
    }

    /// What 200 photons tell.
    fn told(values: Vec<f32>) -> Pixels {
        let common = values.iter().map(|v| v * v / 200.0).collect();
        let variance = vec![0.0; values.len()];
        Pixels { width: SIDE, bands: 1, covered: vec![1.0; values.len()], values, variance, common }
    }

    /// The truth with blotches of 4 x 4 pixels, 7 % strong, as of 200 photons.
    fn blotchy(picture: u64) -> Pixels {
        let streams = Streams::new(7, Purpose::Picture, 0);
        let blotch = |i: usize| {
            let cell = (i % SIDE) / 4 + SIDE / 4 * (i / SIDE / 4);
            let mut rng = streams.history(picture * 1000 + cell as u64);
            1.0 + 0.07 * 12f32.sqrt() * (rng.uniform() - 0.5)
        };
        let values = (0..SIDE * SIDE).map(|i| truth(i) * blotch(i)).collect();
        told(values)
    }

    fn one_surface() -> Vec<Option<Guide>> {
        vec![Some(Guide { face: 0, material: 0, normal: Vec3::Z }); SIDE * SIDE]
    }

    /// Relative noise about the truth, root of the mean square.
    fn noise(pixels: &Pixels) -> f32 {
        let square = |(i, value): (usize, &f32)| (value / truth(i) - 1.0).powi(2);
        let sum: f32 = pixels.values.iter().enumerate().map(square).sum();
        (sum / pixels.values.len() as f32).sqrt()
    }

    /// Blotches of 7 % become less than 2 %, the sum over the picture stays to rounding, and the shadow keeps its
    /// edge.
    #[test]
    fn blotches_go_and_edges_stay() {
        let before = blotchy(0);
        let after = denoised(&before, &one_surface(), 1).expect("threads");
        assert!(
            noise(&before) > 0.06 && noise(&after) < 0.02,
            "{} {}",
            noise(&before),
            noise(&after)
        );
        let sum = |pixels: &Pixels| pixels.values.iter().map(|v| f64::from(*v)).sum::<f64>();
        assert!((sum(&after) / sum(&before) - 1.0).abs() < 1e-6);
        for x in 0..SIDE {
            let at = |y: usize| after.values[y * SIDE + x] / truth(y * SIDE + x);
            assert!(
                (at(31) - 1.0).abs() < 0.15 && (at(32) - 1.0).abs() < 0.15,
                "{x}: {} {}",
                at(31),
                at(32)
            );
        }
    }

    /// Means over 32 x 32 pixels have no bias above 0.5 %. Over 100 pictures the standard error of a block's mean
    /// is at most 7 % / sqrt(64 blotches x 100) = 0.09 %, so 0.5 % is more than 5 of them: odds below 1e-6.
    #[test]
    fn means_over_blocks_are_unbiased() {
        const PICTURES: u64 = 100;
        let mut ratios = [0.0f64; 4];
        for picture in 0..PICTURES {
            let after = denoised(&blotchy(picture), &one_surface(), 1).expect("threads");
            for (i, value) in after.values.iter().enumerate() {
                let block = (i % SIDE) / 32 + 2 * (i / SIDE / 32);
                ratios[block] += f64::from(value / truth(i)) / (1024 * PICTURES) as f64;
            }
        }
        assert!(ratios.iter().all(|ratio| (ratio - 1.0).abs() < 0.005), "{ratios:?}");
    }

    /// Nothing goes from one surface to another, nor where a pixel shows several, nor to no number.
    #[test]
    fn surfaces_do_not_mix() {
        let mut guides = one_surface();
        for (i, guide) in guides.iter_mut().enumerate() {
            *guide = guide
                .filter(|_| i % SIDE != 20)
                .map(|g| Guide { face: u32::from(i % SIDE > 20), ..g });
        }
        let value = |i: usize| match i % SIDE {
            0..20 => 1.0,
            20 => 1.05,
            _ => 1.1,
        };
        let mut values: Vec<f32> = (0..SIDE * SIDE).map(value).collect();
        values[5] = f32::NAN;
        let before = told(values);
        let after = denoised(&before, &guides, 2).expect("threads");
        for (i, (a, b)) in after.values.iter().zip(&before.values).enumerate() {
            assert!(a == b || (i == 5 && a.is_nan()), "{i}: {a} {b}");
        }
    }
}
