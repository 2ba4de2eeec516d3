//! The way of the sun through an hour.

use super::sun_position::SunPosition;

/// The most positions of a course.
const MOST: usize = 6;
/// The longest part of a course for which one position stands, s.
const STEP: f64 = 600.0;
const DAY: f64 = 86_400.0;
/// The fraction of a part by which positions are moved on from one day to the next: the golden ratio,
/// whose multiples are spread evenly, however many days there are.
const MOVED: f64 = 0.618_033_988_749_894_9;

/// Where the sun stands while it shines in an hour: one position in each of equal parts of that time,
/// two or more of at most 10 minutes, and the share of the direct light of the hour that comes from each.
///
/// Positions lie before and after the middles of parts in turn, so that what changes evenly through an
/// hour is summed exactly; and by how much depends on the day, so that the edge of a shadow that comes by at
/// the same time of each day falls at all places of a part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SunCourse {
    positions: [(SunPosition, f64); MOST],
    count: usize,
}

impl SunCourse {
    /// Makes the course of a sun that stands still, as at an instant.
    pub fn still(at: SunPosition) -> Self {
        Self { positions: [(at, 1.0); MOST], count: 1 }
    }

    /// Makes the course from the time `from` to the time `to`, s since 1970, at most an hour apart; `at`
    /// returns the position of the sun at a time. Light is shared out as under a clear sky. Positions below
    /// the horizon are left out; `None` if all of them are.
    pub fn new(from: f64, to: f64, at: impl Fn(f64) -> SunPosition) -> Option<Self> {
        let parts = (((to - from) / STEP - 1e-6).ceil() as usize).clamp(2, MOST);
        let off = (MOVED * (from / DAY).floor()).rem_euclid(1.0) - 0.5;
        let first = (from / (to - from)).floor() as i64;
        let time = |part: usize| {
            let off = if (first + part as i64) % 2 == 0 { off } else { -off };
            from + (part as f64 + 0.5 + off) / parts as f64 * (to - from)
        };
        let up = (0..parts).map(|part| at(time(part))).filter(|sun| sun.elevation > 0.0);
        let mut course = Self::still(SunPosition { elevation: 0.0, azimuth: 0.0 });
        course.count = 0;
        for (place, sun) in course.positions.iter_mut().zip(up) {
            *place = (sun, clear_sky(sun));
            course.count += 1;
        }
        let all: f64 = course.iter().map(|(_, light)| light).sum();
        course.positions.iter_mut().for_each(|(_, light)| *light /= all);
        (course.count > 0).then_some(course)
    }

    /// Returns the positions, and the share of the direct light that comes from each. Each stands for
    /// the same time.
    pub fn iter(&self) -> impl Iterator<Item = (SunPosition, f64)> + '_ {
        self.positions[..self.count].iter().copied()
    }

    /// Returns the direct irradiance on a horizontal plane over that on a plane across the direction of
    /// the sun: the mean sine of its elevation, at least 0.
    pub fn sine(&self) -> f64 {
        self.iter().map(|(sun, share)| share * sun.elevation.sin().max(0.0)).sum()
    }
}

/// Returns the relative direct irradiance of a clear sky, across the direction of the sun (Meinel and
/// Meinel, Applied solar energy, 1976), by the air mass of Kasten and Young (Applied Optics 28:4735,
/// 1989). The sun stands above the horizon.
fn clear_sky(sun: SunPosition) -> f64 {
    let above = sun.elevation.to_degrees();
    let air_mass = 1.0 / (sun.elevation.sin() + 0.505_72 * (above + 6.079_95).powf(-1.6364));
    0.7f64.powf(air_mass.powf(0.678))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at_elevation(degrees: f64) -> SunPosition {
        SunPosition { elevation: degrees.to_radians(), azimuth: 0.0 }
    }

    /// Meinel's formula gives 70 % of the light outside for an air mass of 1, and some 1.5 % at the
    /// horizon.
    #[test]
    fn clear_skies_are_the_published_ones() {
        assert!((clear_sky(at_elevation(90.0)) - 0.7).abs() < 1e-3);
        assert!((clear_sky(at_elevation(30.0)) - 0.7f64.powf(1.6)).abs() < 2e-3);
        assert!((0.01..0.02).contains(&clear_sky(at_elevation(0.001))));
    }

    /// Positions stand for equal times, and what changes evenly through an hour is summed exactly,
    /// whatever the day.
    #[test]
    fn an_hour_has_six_suns_and_ten_minutes_two() {
        for day in [0.0, 1.0, 20_000.0] {
            let start = DAY * day + 36_000.0;
            let rising = |t: f64| at_elevation(30.0 + (t - start) / 100.0);
            for (length, count) in [(60.0, 2), (600.0, 2), (900.0, 2), (3600.0, 6)] {
                let course = SunCourse::new(start, start + length, rising).unwrap();
                assert_eq!(course.iter().count(), count);
                assert!((course.iter().map(|(_, share)| share).sum::<f64>() - 1.0).abs() < 1e-12);
                let mean = course.iter().map(|(sun, _)| sun.elevation).sum::<f64>() / count as f64;
                let off = (mean.to_degrees() - 30.0 - length / 200.0).abs();
                assert!(off < 1e-9);
            }
        }
    }

    /// The edge of a shadow that comes by at the same time of each day cuts an hour, over many days,
    /// where it cuts it in truth.
    #[test]
    fn shadows_of_many_days_have_no_bias() {
        for part in [0.13, 0.37, 0.52, 0.94] {
            let lit: f64 = (0..90)
                .map(|day| {
                    let start = DAY * f64::from(19_000 + day) + 36_000.0;
                    let at = |t: f64| at_elevation(10.0 + (t - start) / 3600.0);
                    let course = SunCourse::new(start, start + 3600.0, at).unwrap();
                    let before =
                        |(sun, _): &(SunPosition, f64)| sun.elevation.to_degrees() < 10.0 + part;
                    course.iter().filter(before).count() as f64 / 6.0
                })
                .sum();
            assert!((lit / 90.0 - part).abs() < 0.005, "{part}: {}", lit / 90.0);
        }
    }

    /// While the sun is down nothing shines, and the low sun is weaker.
    #[test]
    fn the_sun_may_rise_within_an_hour() {
        // in the first half of this hour the sun is down, and the low sun is weaker
        let start = 20_000.0 * DAY + 18_000.0;
        let rising = |t: f64| at_elevation((t - start - 1800.0) / 100.0);
        let course = SunCourse::new(start, start + 3600.0, rising).unwrap();
        let shares: Vec<f64> = course.iter().map(|(_, share)| share).collect();
        assert!(shares.len() == 3 && shares[0] < shares[1] && shares[1] < shares[2]);
        assert_eq!(SunCourse::new(0.0, 3600.0, |_| at_elevation(-1.0)), None);
        let still = SunCourse::still(at_elevation(30.0));
        assert!((still.sine() - 0.5).abs() < 1e-12);
    }
}
