//! What the rays of every pixel found, kept apart by the surface that they met first.

use glam::Vec3;

/// Surfaces that are told apart in a pixel; what others send is kept together.
const MOST: usize = 8;

/// What rays met. Only what they found on the same face of one smooth piece in one material, and through the same glass,
/// belongs together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Guide {
    /// The smooth piece and its face.
    pub face: u32,
    /// The same of the glass or water before it, of which light is bent.
    pub through: Option<u32>,
    /// The index of its material.
    pub material: u32,
    /// The normal where a surface was first met, that of glass too.
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
    /// None for what is beyond all surfaces, and where more are in one pixel than are told apart.
    pub guide: Option<Guide>,
    /// How many rays met it.
    pub rays: u32,
}

/// Sums over the rays of a fragment, in one band.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sums {
    /// All that they found.
    pub found: f32,
    /// Standard errors of what of it the nearest photons tell: this noise is alike in pixels side by side.
    pub deviation: f32,
    /// What of it was gathered: its noise is each ray's own.
    pub gathered: f32,
    /// The same squared.
    pub squares: f32,
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
    /// Share of such rays, per pixel.
    pub covered: Vec<f32>,
}

impl Pixels {
    /// The values of a pixel.
    pub fn pixel(&self, index: usize) -> &[f32] {
        &self.values[index * self.bands..][..self.bands]
    }
}

/// What the rays of every pixel found, row by row from the upper left.
#[derive(Clone, Debug, PartialEq)]
pub struct Fragments {
    /// Pixels across.
    pub(super) width: usize,
    /// Bands of a pixel.
    pub(super) bands: usize,
    rays: u32,
    /// Where the fragments of each pixel begin, and where the last end.
    starts: Vec<usize>,
    pub(super) all: Vec<Fragment>,
    /// Of each fragment and band.
    pub(super) sums: Vec<Sums>,
}

impl Fragments {
    /// Of no pixel yet.
    pub(super) fn new(width: usize, bands: usize, rays: u32) -> Self {
        Self { width, bands, rays, starts: vec![0], all: Vec::new(), sums: Vec::new() }
    }

    /// Rays of each pixel.
    pub fn rays(&self) -> u32 {
        self.rays
    }

    /// How many pixels there are.
    pub(super) fn pixel_count(&self) -> usize {
        self.starts.len() - 1
    }

    /// The indices of the fragments of a pixel.
    pub(super) fn of(&self, pixel: usize) -> std::ops::Range<usize> {
        self.starts[pixel]..self.starts[pixel + 1]
    }

    /// One ray more of the pixel that is not yet closed: what it met, and in each band what it found, the standard error
    /// of what of it the nearest photons tell, and what of it was gathered.
    pub(super) fn add(&mut self, guide: Option<Guide>, found: impl Iterator<Item = [f32; 3]>) {
        let sums = self.fragment(guide, 1);
        for (sums, [found, deviation, gathered]) in self.sums[sums..].iter_mut().zip(found) {
            sums.found += found;
            sums.deviation += deviation;
            sums.gathered += gathered;
            sums.squares += gathered * gathered;
        }
    }

    /// Counts rays of the pixel that is not yet closed, and says where the sums of their fragment begin.
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

    /// Begins the next pixel.
    pub(super) fn close(&mut self) {
        self.starts.push(self.all.len());
    }

    /// Those of further rows.
    pub(super) fn append(&mut self, more: Self) {
        let first = self.all.len();
        self.starts.extend(more.starts[1..].iter().map(|start| first + start));
        self.all.extend(more.all);
        self.sums.extend(more.sums);
    }

    /// These and those of more rays of the same picture.
    pub fn joined(&self, more: &Self) -> Self {
        let mut both = Self::new(self.width, self.bands, self.rays + more.rays);
        for pixel in 0..self.pixel_count() {
            for (of, fragment) in
                [self, more].into_iter().flat_map(|of| of.of(pixel).map(move |i| (of, i)))
            {
                let Fragment { guide, rays } = of.all[fragment];
                let sums = both.fragment(guide, rays);
                let theirs = &of.sums[fragment * of.bands..][..of.bands];
                for (sums, theirs) in both.sums[sums..].iter_mut().zip(theirs) {
                    sums.found += theirs.found;
                    sums.deviation += theirs.deviation;
                    sums.gathered += theirs.gathered;
                    sums.squares += theirs.squares;
                }
            }
            both.close();
        }
        both
    }

    /// The means over the rays of each pixel.
    pub fn pixels(&self) -> Pixels {
        self.mixed(|fragment, band| {
            self.sums[fragment * self.bands + band].found / self.all[fragment].rays as f32
        })
    }

    /// The means over the fragments of each pixel, whose values are given.
    pub(super) fn mixed(&self, value: impl Fn(usize, usize) -> f32) -> Pixels {
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
                    .for_each(|(b, mean)| *mean += share * value(fragment, b));
            }
        }
        Pixels { width: self.width, bands, values, covered }
    }
}
