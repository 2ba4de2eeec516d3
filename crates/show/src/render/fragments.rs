//! The values that the rays of every pixel have found, kept apart by the surface that each ray met
//! first.

use std::ops::AddAssign;

use glam::Vec3;

/// The number of surfaces that are kept apart in a pixel; rays that meet further ones are summed
/// together.
const MOST: usize = 8;

/// Identifies the surface that a ray met. Values belong together only if they come from the same
/// face of one smooth piece of surface in one material, seen through the same glass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Guide {
    /// Index of the smooth piece and its face (`Patches::bin`).
    pub face: u32,
    /// The same of the glass or water in front of it, which bends light; `None` without.
    pub through: Option<u32>,
    /// Index of the material.
    pub material: u32,
    /// Unit normal where the ray first met a surface, which may be glass.
    pub normal: Vec3,
}

impl Guide {
    pub fn is_of(&self, other: &Self) -> bool {
        (self.face, self.through, self.material) == (other.face, other.through, other.material)
    }
}

/// The part of a pixel that shows one surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fragment {
    /// The surface. `None` for rays that met no surface, and for rays to surfaces beyond those that
    /// are kept apart.
    pub guide: Option<Guide>,
    /// Number of rays.
    pub rays: u32,
}

/// Sums over the rays of a fragment, in one band.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sums {
    /// Sum of the parts that the nearest photons estimate, and of lamps that are seen.
    pub told: f32,
    /// Sum of the standard errors of what the nearest photons estimate: neighbouring pixels have
    /// this noise in common.
    pub deviation: f32,
    /// The light that came straight from lamps: each ray has its own, independent noise.
    pub lamps: Gathered,
    /// The light that gathering rays found on other surfaces, with independent noise as well.
    pub surfaces: Gathered,
}

/// Sums over the rays of a fragment of a part of the light that was gathered.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Gathered {
    pub sum: f32,
    /// Sum of the squares.
    pub squares: f32,
}

impl Sums {
    /// Returns the sum of the whole values.
    fn found(&self) -> f32 {
        self.told + self.lamps.sum + self.surfaces.sum
    }
}

impl AddAssign for Sums {
    fn add_assign(&mut self, other: Self) {
        self.told += other.told;
        self.deviation += other.deviation;
        self.lamps += other.lamps;
        self.surfaces += other.surfaces;
    }
}

impl AddAssign for Gathered {
    fn add_assign(&mut self, other: Self) {
        self.sum += other.sum;
        self.squares += other.squares;
    }
}

impl From<f32> for Gathered {
    /// Takes what one ray has gathered.
    fn from(found: f32) -> Self {
        Self { sum: found, squares: found * found }
    }
}

/// A value per pixel and band; pixels are in rows from the upper left.
#[derive(Clone, Debug, PartialEq)]
pub struct Pixels {
    /// Number of pixels across.
    pub width: usize,
    /// Number of bands of a pixel.
    pub bands: usize,
    /// Means over the rays that met something to show: all bands of the first pixel, then of the
    /// next.
    pub values: Vec<f32>,
    /// Fraction of such rays, per pixel.
    pub covered: Vec<f32>,
}

impl Pixels {
    /// Returns the values of a pixel, one per band.
    pub fn pixel(&self, index: usize) -> &[f32] {
        &self.values[index * self.bands..][..self.bands]
    }
}

/// What some rays of a pixel have seen: one surface, or what is beyond all.
#[derive(Clone, Debug, PartialEq)]
pub struct Seen {
    /// Index of the material; of glass only where nothing opaque is behind it. `None` for rays that
    /// met no surface, and for those that met one of very many in the pixel.
    pub material: Option<usize>,
    /// Whether these are only rays that met no surface.
    pub is_beyond: bool,
    /// Their share of the pixel's rays.
    pub share: f32,
    /// The mean of what they found, per band.
    pub values: Vec<f32>,
}

/// Sums of what the rays of every pixel found, per surface that they met first; pixels are in rows
/// from the upper left.
#[derive(Clone, Debug, PartialEq)]
pub struct Fragments {
    /// Number of pixels across.
    pub(super) width: usize,
    /// Number of bands of a pixel.
    pub(super) bands: usize,
    rays: u32,
    /// Index of the first fragment of each pixel, then the number of all fragments.
    starts: Vec<usize>,
    pub(super) all: Vec<Fragment>,
    /// The sums of each fragment: all bands of the first, then of the next.
    pub(super) sums: Vec<Sums>,
}

impl Fragments {
    /// Makes a picture without pixels, which will have `rays` rays each.
    pub(super) fn new(width: usize, bands: usize, rays: u32) -> Self {
        Self { width, bands, rays, starts: vec![0], all: Vec::new(), sums: Vec::new() }
    }

    /// Returns the number of rays of each pixel.
    pub fn rays(&self) -> u32 {
        self.rays
    }

    /// Returns the indices of the fragments of a pixel.
    pub(super) fn of(&self, pixel: usize) -> std::ops::Range<usize> {
        self.starts[pixel]..self.starts[pixel + 1]
    }

    /// Adds a ray to the pixel that is not yet closed: the surface that it met, and what it found
    /// in each band.
    pub(super) fn add(&mut self, guide: Option<Guide>, found: impl Iterator<Item = Sums>) {
        let sums = self.fragment(guide, 1);
        self.sums[sums..].iter_mut().zip(found).for_each(|(sums, found)| *sums += found);
    }

    /// Counts `rays` more rays of the pixel that is not yet closed, and returns where the sums of
    /// their fragment begin.
    fn fragment(&mut self, guide: Option<Guide>, rays: u32) -> usize {
        let start = self.starts[self.starts.len() - 1];
        let find = |all: &[Fragment], guide: Option<Guide>| {
            all.iter().position(|other| match (&other.guide, &guide) {
                (Some(a), Some(b)) => a.is_of(b),
                (None, None) => true,
                _ => false,
            })
        };
        let own = &self.all[start..];
        let guide = guide.filter(|_| own.len() < MOST || find(own, guide).is_some());
        let index = find(own, guide).unwrap_or_else(|| {
            self.all.push(Fragment { guide, rays: 0 });
            self.sums.resize(self.all.len() * self.bands, Sums::default());
            self.all.len() - 1 - start
        });
        self.all[start + index].rays += rays;
        (start + index) * self.bands
    }

    /// Closes the current pixel and begins the next.
    pub(super) fn close(&mut self) {
        self.starts.push(self.all.len());
    }

    /// Appends the pixels of further rows.
    pub(super) fn append(&mut self, more: Self) {
        let first = self.all.len();
        self.starts.extend(more.starts[1..].iter().map(|start| first + start));
        self.all.extend(more.all);
        self.sums.extend(more.sums);
    }

    /// Joins these sums with those of more rays of the same picture.
    pub fn joined(&self, more: &Self) -> Self {
        let mut both = Self::new(self.width, self.bands, self.rays + more.rays);
        for pixel in 0..self.pixel_count() {
            for (of, fragment) in
                [self, more].into_iter().flat_map(|of| of.of(pixel).map(move |i| (of, i)))
            {
                let Fragment { guide, rays } = of.all[fragment];
                let sums = both.fragment(guide, rays);
                let theirs = &of.sums[fragment * of.bands..][..of.bands];
                both.sums[sums..]
                    .iter_mut()
                    .zip(theirs)
                    .for_each(|(sums, theirs)| *sums += *theirs);
            }
            both.close();
        }
        both
    }

    /// Returns the means over the rays of each pixel.
    pub fn pixels(&self) -> Pixels {
        let bands = self.bands;
        let mut values = vec![0.0; self.pixel_count() * bands];
        let mut covered = vec![0.0; self.pixel_count()];
        for (pixel, mean) in values.chunks_mut(bands).enumerate() {
            let rays: u32 = self.all[self.of(pixel)].iter().map(|of| of.rays).sum();
            covered[pixel] = rays as f32 / self.rays as f32;
            for fragment in self.of(pixel) {
                let share = self.all[fragment].rays as f32 / rays as f32;
                mean.iter_mut()
                    .enumerate()
                    .for_each(|(b, mean)| *mean += share * self.found(fragment, b));
            }
        }
        Pixels { width: self.width, bands, values, covered }
    }

    /// Returns the mean of the colours (linear) of each pixel's rays: `colour` gives that of a
    /// surface from its values per band, and rays that met none show `paper`.
    pub fn in_colours(&self, paper: Vec3, colour: impl Fn(&[f32]) -> Vec3) -> Vec<Vec3> {
        let pixel = |pixel| {
            let beside_paper = |seen: Seen| seen.share * (colour(&seen.values) - paper);
            paper + self.seen(pixel).map(beside_paper).sum::<Vec3>()
        };
        (0..self.pixel_count()).map(pixel).collect()
    }

    /// Returns the number of pixels.
    pub fn pixel_count(&self) -> usize {
        self.starts.len() - 1
    }

    /// Returns what the rays of a pixel have seen, surface by surface.
    pub fn seen(&self, pixel: usize) -> impl Iterator<Item = Seen> {
        let crowded = self.of(pixel).len() >= MOST;
        self.of(pixel).map(move |index| {
            let Fragment { guide, rays } = &self.all[index];
            Seen {
                material: guide.as_ref().map(|guide| guide.material as usize),
                is_beyond: guide.is_none() && !crowded,
                share: *rays as f32 / self.rays as f32,
                values: (0..self.bands).map(|b| self.found(index, b)).collect(),
            }
        })
    }

    /// Returns the mean over the rays of a fragment in a band.
    fn found(&self, fragment: usize, band: usize) -> f32 {
        self.sums[fragment * self.bands + band].found() / self.all[fragment].rays as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pixel of two surfaces shows the mean of their colours, not the colour of their mean, beside
    /// the paper that the rest of its rays see.
    #[test]
    fn surfaces_of_a_pixel_mix_their_colours() {
        let mut all = Fragments::new(1, 1, 4);
        for (face, value) in [(0, 0.0), (1, 10.0)] {
            let guide = Guide { face, through: None, material: 0, normal: Vec3::Z };
            let found = Sums { told: value, ..Sums::default() };
            all.add(Some(guide), std::iter::once(found));
        }
        all.close();
        let red_or_blue = |values: &[f32]| if values[0] > 7.0 { Vec3::X } else { Vec3::Z };
        let mixed = all.in_colours(Vec3::ONE, red_or_blue);
        assert_eq!(mixed, [Vec3::new(0.75, 0.5, 0.75)]);
        assert_eq!(all.pixels().values, [5.0]);
    }
}
