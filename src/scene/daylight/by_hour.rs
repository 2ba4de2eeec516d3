//! Daylight by the hour as a few lights: patches of the sky, and suns on a grid. The light of each
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
    suns::Suns,
};

/// Number of patches in each row of Tregenza's sky from the horizon up; the zenith is a patch of
/// its own (Tregenza, Lighting Research & Technology 19:13, 1987).
const ROWS: [usize; 7] = [30, 30, 24, 24, 18, 12, 6];
/// Least elevation of the suns of the grid, rad. Lower suns bring little light, all of it from the
/// side.
const LOWEST: f64 = 2.0 * PI / 180.0;
/// Largest difference between the declinations of neighbouring rows of suns, rad. A year takes
/// seven rows.
const ROW_STEP: f64 = 8.0 * PI / 180.0;
/// Number of suns in a row, from sunrise to sunset.
const SUNS: usize = 13;
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
        (mean > 0.0).then_some(Self { shape, mean, factors })
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

/// Position of the sun on the celestial sphere: declination and hour angle, rad. The hour angle is
/// 0 at noon and positive in the afternoon.
#[derive(Clone, Copy, Debug)]
struct Celestial {
    declination: f64,
    hour_angle: f64,
}

impl Celestial {
    fn of(sun: SunPosition, latitude: f64) -> Self {
        let ((sin_h, cos_h), (sin_a, cos_a)) = (sun.elevation.sin_cos(), sun.azimuth.sin_cos());
        let (sin_lat, cos_lat) = latitude.sin_cos();
        let sine = sin_h * sin_lat + cos_h * cos_lat * cos_a;
        let hour_angle = (-sin_a * cos_h).atan2(sin_h * cos_lat - cos_h * sin_lat * cos_a);
        Self { declination: sine.clamp(-1.0, 1.0).asin(), hour_angle }
    }

    fn position(self, latitude: f64) -> SunPosition {
        let ((sin_d, cos_d), (sin_t, cos_t)) =
            (self.declination.sin_cos(), self.hour_angle.sin_cos());
        let (sin_lat, cos_lat) = latitude.sin_cos();
        let up = sin_d * sin_lat + cos_d * cos_lat * cos_t;
        let (east, north) = (-cos_d * sin_t, sin_d * cos_lat - cos_d * sin_lat * cos_t);
        let azimuth = east.atan2(north).rem_euclid(TAU);
        SunPosition { elevation: up.clamp(-1.0, 1.0).asin().max(LOWEST), azimuth }
    }
}

/// Returns the hour angle, rad, at which a sun of this declination has the elevation [`LOWEST`]: pi
/// if it never is lower, 0 if it never is higher.
fn sunset(declination: f64, latitude: f64) -> f64 {
    let above = LOWEST.sin() - latitude.sin() * declination.sin();
    let swing = latitude.cos() * declination.cos();
    if above >= swing {
        0.0
    } else if above <= -swing {
        PI
    } else {
        (above / swing).acos()
    }
}

/// Returns the suns of all hours as suns on a grid of declinations and times of the day, from
/// sunrise to sunset. The light of an hour is that of the four suns of the grid around its sun,
/// with bilinear weights. `half_angle`, `latitude` and `north` are in rad.
///
/// The grid is meant for scattered light, which changes smoothly with the position of the sun;
/// light straight from the sun does not.
pub fn suns_by_hour(hours: &[Hour], half_angle: f64, latitude: f64, north: f64) -> Vec<HourlyPart> {
    let lit = || hours.iter().enumerate().filter(|(_, hour)| hour.direct_normal > 0.0);
    let places: Vec<(usize, Celestial)> =
        lit().map(|(h, hour)| (h, Celestial::of(hour.sun, latitude))).collect();
    let declinations = places.iter().map(|(_, at)| at.declination);
    let first = declinations.clone().fold(f64::INFINITY, f64::min);
    let range = declinations.fold(f64::NEG_INFINITY, f64::max) - first;
    if places.is_empty() {
        return Vec::new();
    }
    // days as close as those of a week share a row
    let steps = if range < 0.05 { 0 } else { (range / ROW_STEP).ceil() as usize };
    let row = |r: usize| match steps {
        0 => first + 0.5 * range,
        _ => first + range * r as f64 / steps as f64,
    };
    let mut strengths: Vec<Vec<(usize, f64)>> = vec![Vec::new(); (steps + 1) * SUNS];
    for (h, at) in places {
        let y = if steps > 0 { (at.declination - first) / range * steps as f64 } else { 0.0 };
        let half_day = sunset(at.declination, latitude);
        let of_day = if half_day > 0.0 { at.hour_angle / half_day } else { 0.0 };
        let x = 0.5 * (of_day.clamp(-1.0, 1.0) + 1.0) * (SUNS - 1) as f64;
        for (r, of_row) in between(y, steps + 1) {
            for (s, of_sun) in between(x, SUNS) {
                strengths[r * SUNS + s].push((h, of_row * of_sun * hours[h].direct_normal));
            }
        }
    }
    let part = |(i, strengths): (usize, Vec<(usize, f64)>)| {
        let declination = row(i / SUNS);
        let of_day = 2.0 * (i % SUNS) as f64 / (SUNS - 1) as f64 - 1.0;
        let at = Celestial { declination, hour_angle: of_day * sunset(declination, latitude) };
        let toward = at.position(latitude).direction(north);
        let suns = Suns::new(half_angle, [(toward, 1.0)])?;
        HourlyPart::new(InfiniteShape::Suns(Arc::new(suns)), hours, strengths)
    };
    strengths.into_iter().enumerate().filter_map(part).collect()
}

/// Returns the two of `count` nodes that a place lies between, with their weights.
fn between(at: f64, count: usize) -> [(usize, f64); 2] {
    let low = (at as usize).min(count.saturating_sub(2));
    let weight = if count > 1 { (at - low as f64).clamp(0.0, 1.0) } else { 0.0 };
    [(low, 1.0 - weight), ((low + 1).min(count - 1), weight)]
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::daylight::{Date, Timestamp, eccentricity};

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

    /// In each hour of a year, the suns of the grid bring the direct light of the hour, and from
    /// about its direction.
    #[test]
    fn suns_stand_about_the_sun() {
        let latitude = 43.61f64.to_radians();
        let hours: Vec<Hour> = (0..8760)
            .map(|h| {
                let time = Timestamp { unix: 1.735e9 + 3600.0 * f64::from(h), offset: 0.0 };
                let sun = SunPosition::at(time, latitude, 0.0);
                let direct_normal = if sun.elevation > 0.0 { 500.0 } else { 0.0 };
                let eccentricity = eccentricity(Date { year: 2025, month: 1, day: 1 });
                let (weight, diffuse_horizontal) = (1.0 / 8760.0, 0.0);
                Hour { weight, sun, eccentricity, direct_normal, diffuse_horizontal }
            })
            .collect();
        let parts = suns_by_hour(&hours, 0.005, latitude, 0.0);
        assert_eq!(parts.len(), 7 * SUNS);
        let mut sums = vec![DVec3::ZERO; hours.len()];
        let mut strength = vec![0.0; hours.len()];
        for part in &parts {
            let InfiniteShape::Suns(suns) = &part.shape else { panic!("suns") };
            let x = [DVec3::X, DVec3::Y, DVec3::Z]
                .map(|axis| suns.irradiance(axis) - suns.irradiance(-axis));
            for &(h, factor) in &part.factors {
                sums[h] += factor * part.mean * DVec3::from(x);
                strength[h] += factor * part.mean;
            }
        }
        for (h, hour) in hours.iter().enumerate() {
            assert!((strength[h] - hour.direct_normal).abs() < 1e-6);
            if hour.direct_normal > 0.0 && hour.sun.elevation > LOWEST {
                let off = sums[h].normalize().dot(hour.sun.direction(0.0)).acos().to_degrees();
                assert!(off < 1.5, "{off} degrees at {:?}", hour.sun);
            }
        }
    }
}
