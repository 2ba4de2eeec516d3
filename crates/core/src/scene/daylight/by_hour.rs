//! Daylight by the hour as a few lights: patches of the sky, and bundles of suns. The light of each
//! hour is a weighted sum of theirs.

use std::{
    f64::consts::{FRAC_PI_2, PI, TAU},
    sync::Arc,
};

use rayon::prelude::*;

use super::{
    hours::{Hour, SkyModel},
    infinite::InfiniteShape,
    radiance_map::RadianceMap,
    sun_position::SunPosition,
};

/// Number of patches in each row of Tregenza's sky from the horizon up; the zenith is a patch of
/// its own (Tregenza, Lighting Research & Technology 19:13, 1987).
const ROWS: [usize; 7] = [30, 30, 24, 24, 18, 12, 6];
/// Number of points along each side of a patch over which its mean radiance is taken.
const POINTS: usize = 6;

/// A light that the hours of a period share: its mean strength over the period, and its strength in
/// each hour as a multiple of that.
#[derive(Clone, Debug)]
pub struct HourlyPart {
    /// Directions that its light comes from.
    pub shape: InfiniteShape,
    /// Mean strength over the period, of the whole spectrum, as
    /// [`InfinitePart`](super::InfinitePart) takes it.
    pub mean: f64,
    /// For each hour in which it shines, the index of the hour and the strength over the mean,
    /// above 0.
    pub factors: Vec<(usize, f64)>,
    /// How its light can be guessed from that of lights beside it. Empty where it stands alone.
    pub beside: Vec<Beside>,
}

/// A guess at the light of a bundle of suns from the bundles next to it, before and after it in the
/// day or in the season. The difference to the true light tells how far the light is from linear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beside {
    /// The indices of two bundles, and the factors on their light that make up the guess.
    pub from: [(usize, f64); 2],
    /// Factor on the difference, at most 1: less than 1 where the two are farther away than is
    /// usual.
    pub scale: f64,
}

impl HourlyPart {
    /// Makes a light from its strengths in the hours, given with the indices of the hours. Returns
    /// `None` where it is dark in all of them.
    pub fn new(
        shape: InfiniteShape,
        hours: &[Hour],
        strengths: impl IntoIterator<Item = (usize, f64)>,
    ) -> Option<Self> {
        let bright: Vec<_> = strengths.into_iter().filter(|(_, s)| *s > 0.0).collect();
        let mean: f64 = bright.iter().map(|(h, s)| hours[*h].weight * s).sum();
        let factors = bright.into_iter().map(|(h, s)| (h, s / mean)).collect();
        (mean > 0.0).then_some(Self { shape, mean, factors, beside: Vec::new() })
    }

    /// Makes the light that the ground below the horizon sends up, if it reflects all of the
    /// horizontal irradiance that `of` returns for each hour, W/m2. Returns `None` where that is 0
    /// in all hours.
    pub fn ground(hours: &[Hour], of: impl Fn(&Hour) -> f64) -> Option<Self> {
        let shape = InfiniteShape::Map(Arc::new(RadianceMap::below_horizon()));
        Self::new(shape, hours, hours.iter().map(|hour| of(hour) / PI).enumerate())
    }
}

/// A patch of the sky between two elevations, `from` and `to`, rad, and between two azimuths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkyPatch {
    from: f64,
    to: f64,
    /// Number of patches in its row, of which this has the index `index`, clockwise from north.
    of: usize,
    index: usize,
}

impl SkyPatch {
    /// Returns all patches of the sky, 145 (`fine` 1) or 577 (`fine` 2): Reinhart's division of
    /// Tregenza's patches.
    pub fn all(fine: usize) -> Vec<Self> {
        let height = FRAC_PI_2 / (7.0 * fine as f64 + 0.5);
        let rows = ROWS.iter().flat_map(|&of| std::iter::repeat_n(of * fine, fine)).enumerate();
        let patches = rows.flat_map(|(row, of)| {
            let (from, to) = (row as f64 * height, (row + 1) as f64 * height);
            (0..of).map(move |index| Self { from, to, of, index })
        });
        let from = 7.0 * fine as f64 * height;
        patches.chain([Self { from, to: FRAC_PI_2, of: 1, index: 0 }]).collect()
    }

    /// Returns the integral of the sine of the elevation over the patch, sr: the horizontal
    /// irradiance per radiance.
    pub fn projected(&self) -> f64 {
        0.5 * (self.to.sin().powi(2) - self.from.sin().powi(2)) * TAU / self.of as f64
    }

    /// Returns directions spread over the patch, each with its share of the patch's solid angle.
    fn points(&self) -> impl Iterator<Item = (SunPosition, f64)> + '_ {
        let (height, width) = (self.to - self.from, TAU / self.of as f64);
        let part = |i: usize| (i as f64 + 0.5) / POINTS as f64;
        let all = self.to.sin() - self.from.sin();
        (0..POINTS * POINTS).map(move |i| {
            let elevation = self.from + part(i / POINTS) * height;
            let azimuth = (self.index as f64 - 0.5 + part(i % POINTS)) * width;
            let share = elevation.cos() * height / all / (POINTS * POINTS) as f64;
            (SunPosition { elevation, azimuth }, share)
        })
    }

    /// Returns the patch as a map of radiance 1. `north`, rad, is that of
    /// [`azimuth_of`](super::azimuth_of).
    fn map(&self, north: f64) -> RadianceMap {
        let start = north - 0.5 * TAU / self.of as f64;
        RadianceMap::patch([self.from, self.to], self.of, start, self.index)
    }
}

/// Returns the skies of all hours as patches of uniform radiance (145 or 577, with `fine` 1 or 2),
/// without the patches that are always dark. The patches of an hour together bring its diffuse
/// irradiance exactly. `north`, rad, is that of [`azimuth_of`](super::azimuth_of).
pub fn sky_by_hour(model: SkyModel, hours: &[Hour], north: f64, fine: usize) -> Vec<HourlyPart> {
    let patches = SkyPatch::all(fine);
    let points: Vec<Vec<_>> = patches
        .iter()
        .map(|patch| patch.points().map(|(at, share)| (at.direction(0.0), share)).collect())
        .collect();
    let radiances: Vec<Vec<f64>> = hours
        .par_iter()
        .map(|hour| {
            if hour.diffuse_horizontal <= 0.0 {
                return vec![0.0; patches.len()];
            }
            let (sky, sun) = (model.sky(hour), hour.sun.direction(0.0));
            let relative = |points: &Vec<(glam::DVec3, f64)>| -> f64 {
                let of = |&(toward, share): &(glam::DVec3, f64)| {
                    share * (sky.gradation(toward.z) * sky.indicatrix(toward.dot(sun))).max(0.0)
                };
                points.iter().map(of).sum()
            };
            let mut own: Vec<f64> = points.iter().map(relative).collect();
            let irradiance: f64 = own.iter().zip(&patches).map(|(l, p)| l * p.projected()).sum();
            let due = hour.diffuse_horizontal;
            match irradiance > 0.0 && irradiance.is_finite() {
                true => own.iter_mut().for_each(|l| *l *= due / irradiance),
                // a formula that is negative everywhere: a uniform sky instead
                false => own.fill(due / PI),
            }
            own
        })
        .collect();
    let part = |(p, patch): (usize, &SkyPatch)| {
        let shape = InfiniteShape::Map(Arc::new(patch.map(north)));
        HourlyPart::new(shape, hours, radiances.iter().map(|own| own[p]).enumerate())
    };
    patches.iter().enumerate().filter_map(part).collect()
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn patches_make_the_whole_sky() {
        for (fine, count) in [(1, 145), (2, 577)] {
            let patches = SkyPatch::all(fine);
            assert_eq!(patches.len(), count);
            let projected: f64 = patches.iter().map(SkyPatch::projected).sum();
            assert!((projected - PI).abs() < 1e-12);
            // as lights of radiance 1 the patches make a uniform sky, on a plane and on a wall
            for (normal, whole) in [(DVec3::Z, PI), (DVec3::Y, FRAC_PI_2), (DVec3::NEG_Z, 0.0)] {
                let of = |patch: &SkyPatch| patch.map(0.3).irradiance(normal)[0];
                let sum: f64 = patches.iter().map(of).sum();
                assert!((sum - whole).abs() < 1e-4, "{normal}: {sum}");
            }
            // the directions of a patch lie in it
            let patch = &patches[40];
            for (at, share) in patch.points() {
                let map = patch.map(0.3);
                let toward = at.direction(0.3);
                assert!(map.radiance(map.cell(toward), 0) == 1.0 && share > 0.0);
                assert_eq!(map.radiance(map.cell(-toward), 0), 0.0);
            }
        }
        let first = SkyPatch::all(1)[0];
        let (at, _) = first.points().next().unwrap();
        assert!(at.elevation > 0.0 && at.direction(0.0).y > 0.97, "north, then east: {at:?}");
    }
}
