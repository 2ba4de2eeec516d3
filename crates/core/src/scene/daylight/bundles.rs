//! The suns of the hours of a period in bundles, each of which is one light.

use std::{f64::consts::PI, sync::Arc};

use glam::DVec3;

use super::{
    by_hour::{Beside, HourlyPart},
    hours::Hour,
    infinite::InfiniteShape,
    sun_position::SunPosition,
    suns::Suns,
};

/// Least elevation of the nodes of the grid of suns, rad. Lower suns bring little light, all of it
/// from the side.
const LOWEST: f64 = 2.0 * PI / 180.0;
/// Largest difference between the declinations of neighbouring rows of the grid, rad. A year takes
/// 13 rows.
const ROW_STEP: f64 = 4.0 * PI / 180.0;
/// Largest range of declinations that one row serves, rad: some weeks about a solstice, or a day
/// about an equinox.
const ONE_ROW: f64 = 0.5 * PI / 180.0;
/// Number of nodes in a row, from sunrise to sunset.
const SUNS: usize = 25;

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

/// Suns of hours that count as one light.
#[derive(Clone, Default)]
struct Bundle {
    /// Indices of the hours, and the part of the direct light of each, W/m2.
    strengths: Vec<(usize, f64)>,
    /// Its suns: the directions towards them, and the direct light of each times the weight of its
    /// hour.
    suns: Vec<(DVec3, f64)>,
    /// The same times the weights of the hours: their sum, and their sums times the place of the
    /// sun on the grid, x in the day and y in the season.
    sums: [f64; 3],
}

impl Bundle {
    /// Adds a sun of an hour with this index and weight: its direct light, the direction towards it, and
    /// its place on the grid.
    fn add(&mut self, hour: usize, weight: f64, light: f64, toward: DVec3, [x, y]: [f64; 2]) {
        // the suns of an hour come one after the other
        match self.strengths.last_mut() {
            Some((last, strength)) if *last == hour => *strength += light,
            _ => self.strengths.push((hour, light)),
        }
        self.suns.push((toward, weight * light));
        for (sum, place) in self.sums.iter_mut().zip([1.0, x, y]) {
            *sum += weight * light * place;
        }
    }

    /// Returns the mean place of its suns: 0 in the day, 1 in the season.
    fn at(&self, axis: usize) -> f64 {
        self.sums[axis + 1] / self.sums[0]
    }
}

/// Returns the suns of all hours in bundles, which stand at the nodes of a grid of declinations and
/// times of the day, from sunrise to sunset. The light of each sun of an hour is that of the four
/// bundles around it, with bilinear weights, and each bundle holds its suns in just these parts.
/// Therefore the light of one hour is mixed with that of hours about it, but the sum over all hours
/// is exactly that of their suns. `half_angle`, `latitude` and `north` are in rad.
///
/// The grid is meant for scattered light, which changes smoothly with the position of the sun;
/// light straight from the sun does not.
pub fn suns_by_hour(hours: &[Hour], half_angle: f64, latitude: f64, north: f64) -> Vec<HourlyPart> {
    let suns_of = |(h, hour): (usize, &Hour)| {
        let direct = hour.direct_normal;
        let course = hour.course;
        let suns = course.iter().map(|(sun, share)| (h, sun, share * direct));
        suns.filter(|(_, _, light)| *light > 0.0).collect::<Vec<_>>()
    };
    let located = |(h, sun, light)| (h, sun, light, Celestial::of(sun, latitude));
    let places: Vec<(usize, SunPosition, f64, Celestial)> =
        hours.iter().enumerate().flat_map(suns_of).map(located).collect();
    let declinations = places.iter().map(|(_, _, _, at)| at.declination);
    let first = declinations.clone().fold(f64::INFINITY, f64::min);
    let range = declinations.fold(f64::NEG_INFINITY, f64::max) - first;
    if places.is_empty() {
        return Vec::new();
    }
    let steps = if range <= ONE_ROW { 0 } else { (range / ROW_STEP).ceil() as usize };
    let mut bundles = vec![Bundle::default(); (steps + 1) * SUNS];
    for (h, sun, light, at) in places {
        let toward = sun.direction(north);
        let y = if steps > 0 { (at.declination - first) / range * steps as f64 } else { 0.0 };
        let half_day = sunset(at.declination, latitude);
        let of_day = if half_day > 0.0 { at.hour_angle / half_day } else { 0.0 };
        let x = 0.5 * (of_day.clamp(-1.0, 1.0) + 1.0) * (SUNS - 1) as f64;
        for (r, of_row) in between(y, steps + 1) {
            for (s, of_sun) in between(x, SUNS) {
                let strength = of_row * of_sun * light;
                if strength > 0.0 {
                    bundles[r * SUNS + s].add(h, hours[h].weight, strength, toward, [x, y]);
                }
            }
        }
    }
    let part = |bundle: &Bundle| {
        let suns = Suns::new(half_angle, bundle.suns.iter().copied())?;
        let strengths = bundle.strengths.iter().copied();
        HourlyPart::new(InfiniteShape::Suns(Arc::new(suns)), hours, strengths)
    };
    let mut parts = Vec::new();
    let mut part_of = vec![None; bundles.len()];
    for (node, bundle) in bundles.iter().enumerate() {
        if let Some(part) = part(bundle) {
            part_of[node] = Some(parts.len());
            parts.push(part);
        }
    }
    for (node, part) in part_of.iter().enumerate() {
        let Some(part) = *part else { continue };
        let mean = parts[part].mean;
        let of_day = node / SUNS * SUNS..(node / SUNS + 1) * SUNS;
        let of_season = (node % SUNS..bundles.len()).step_by(SUNS);
        for (axis, line) in [of_day.collect::<Vec<_>>(), of_season.collect()].iter().enumerate() {
            let bright = line.iter().filter_map(|&n| Some((part_of[n]?, bundles[n].at(axis))));
            let Some(mut guess) = beside(&bright.collect::<Vec<_>>(), part) else { continue };
            guess.from.iter_mut().for_each(|(other, share)| *share *= mean / parts[*other].mean);
            parts[part].beside.push(guess);
        }
    }
    parts
}

/// Returns how the light of a part, per strength, is guessed from that of two others on the same
/// line of the grid, by a straight line through them: from those on both sides or, at an end of the
/// line, from the next two. `line` has the parts with their places. `None` where there are no two.
fn beside(line: &[(usize, f64)], part: usize) -> Option<Beside> {
    let own = line.iter().position(|(p, _)| *p == part)?;
    let [a, b] = match own {
        0 => [1, 2],
        last if last + 1 == line.len() => [last.checked_sub(1)?, last.checked_sub(2)?],
        inner => [inner - 1, inner + 1],
    };
    let (&(_, x), &(a, x_a), &(b, x_b)) = (line.get(own)?, line.get(a)?, line.get(b)?);
    let t = (x - x_a) / (x_b - x_a);
    // the difference of a parabola and the line grows with this product
    let far = ((x - x_a) * (x - x_b)).abs();
    let from = [(a, 1.0 - t), (b, t)];
    ((x_b - x_a).abs() > 0.5).then_some(Beside { from, scale: 1.0 / far.max(1.0) })
}

/// Returns the two of `count` nodes that a place lies between, with their weights.
fn between(at: f64, count: usize) -> [(usize, f64); 2] {
    let low = (at as usize).min(count.saturating_sub(2));
    let weight = if count > 1 { (at - low as f64).clamp(0.0, 1.0) } else { 0.0 };
    [(low, 1.0 - weight), ((low + 1).min(count - 1), weight)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::daylight::{Date, SunCourse, Timestamp, eccentricity};

    /// Returns the hours of a year with a sun of 500 W/m2, or those of its first days.
    fn hours(days: usize, latitude: f64) -> Vec<Hour> {
        let count = 24 * days;
        let hour = |h: usize| {
            let at = |minutes: f64| {
                let unix = 1.735e9 + 3600.0 * h as f64 + 60.0 * minutes;
                SunPosition::at(Timestamp { unix, offset: 0.0 }, latitude, 0.0)
            };
            let course = SunCourse::new(0.0, 3600.0, |seconds| at(seconds / 60.0));
            let sun = at(30.0);
            let direct_normal = if course.is_some() { 500.0 } else { 0.0 };
            let course = course.unwrap_or(SunCourse::still(sun));
            let eccentricity = eccentricity(Date { year: 2025, month: 1, day: 1 });
            let (weight, diffuse_horizontal) = (1.0 / count as f64, 0.0);
            Hour { weight, sun, course, eccentricity, direct_normal, diffuse_horizontal }
        };
        (0..count).map(hour).collect()
    }

    fn suns(part: &HourlyPart) -> &Suns {
        let InfiniteShape::Suns(suns) = &part.shape else { panic!("suns") };
        suns
    }

    /// In each hour of a year, bundles bring the direct light of the hour, and from about its
    /// direction. Over the year, a plane of any orientation gets just the light of all true suns.
    #[test]
    fn bundles_stand_about_the_sun_and_add_up_to_all_suns() {
        let latitude = 43.61f64.to_radians();
        let hours = hours(365, latitude);
        let parts = suns_by_hour(&hours, 0.0, latitude, 0.0);
        // few hours are about the first and the last row, so that some of its bundles are empty
        assert!((12 * SUNS..=13 * SUNS).contains(&parts.len()), "{}", parts.len());
        let mut sums = vec![DVec3::ZERO; hours.len()];
        let mut strength = vec![0.0; hours.len()];
        for part in &parts {
            let x = DVec3::AXES.map(|a| suns(part).irradiance(a) - suns(part).irradiance(-a));
            for &(h, factor) in &part.factors {
                sums[h] += factor * part.mean * DVec3::from(x);
                strength[h] += factor * part.mean;
            }
        }
        let mut off = Vec::new();
        for (h, hour) in hours.iter().enumerate() {
            assert!((strength[h] - hour.direct_normal).abs() < 1e-6);
            if hour.direct_normal > 0.0 {
                let mean: DVec3 = hour.suns(0.0).map(|(toward, light)| light * toward).sum();
                let cos = sums[h].normalize().dot(mean.normalize());
                off.push(cos.min(1.0).acos().to_degrees());
            }
        }
        off.sort_by(f64::total_cmp);
        let [middle, last] = [off[off.len() / 2], off[off.len() - 1]];
        // rows are at most 4 degrees apart
        assert!(middle < 1.0 && last < 4.0, "{middle} and {last} degrees");
        for normal in [[0.0, 0.0, 1.0], [0.0, -0.8, 0.6], [0.6, 0.8, 0.0], [-1.0, 0.0, 0.0]] {
            let normal = DVec3::from(normal);
            let found: f64 = parts.iter().map(|p| p.mean * suns(p).irradiance(normal)).sum();
            let lit = |h: &Hour| -> f64 {
                h.suns(0.0).map(|(toward, light)| light * toward.dot(normal).max(0.0)).sum()
            };
            let all: f64 = hours.iter().map(|h| h.weight * lit(h)).sum();
            assert!((found / all - 1.0).abs() < 1e-9, "{normal}: {found}, {all}");
        }
    }

    /// The guess at a bundle by those beside it is exact in the day, and about right in the season,
    /// where light changes linearly with the part of the day. One day has one row, of which each
    /// end is guessed too.
    #[test]
    fn light_that_changes_linearly_is_guessed_by_the_bundles_beside() {
        let latitude = 43.61f64.to_radians();
        for (days, each) in [(365, 2), (1, 1)] {
            let mut hours = hours(days, latitude);
            for hour in &mut hours {
                hour.course = SunCourse::still(hour.sun);
                hour.direct_normal *= f64::from(u8::from(hour.sun.elevation > 0.0));
            }
            let parts = suns_by_hour(&hours, 0.0, latitude, 0.0);
            let light = |hour: &Hour| {
                let at = Celestial::of(hour.sun, latitude);
                let of_day = (at.hour_angle / sunset(at.declination, latitude)).clamp(-1.0, 1.0);
                10.0 + of_day
            };
            let of = |part: &HourlyPart| -> f64 {
                let one = |&(h, f): &(usize, f64)| hours[h].weight * f * light(&hours[h]);
                part.mean * part.factors.iter().map(one).sum::<f64>()
            };
            let mut guessed = 0;
            for part in &parts {
                assert!(part.beside.len() <= each);
                for beside in &part.beside {
                    let line: f64 = beside.from.iter().map(|&(o, k)| k * of(&parts[o])).sum();
                    let off = (line / of(part) - 1.0).abs();
                    guessed += usize::from(off < 1e-9);
                    assert!(beside.scale > 0.0 && beside.scale <= 1.0);
                    assert!(off < 0.03, "{off}");
                }
            }
            assert!(5 * guessed >= 4 * parts.len(), "{guessed} of {} in {days} days", parts.len());
        }
    }
}
