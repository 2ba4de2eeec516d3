//! Position of the sun, and the convention for directions: elevation above the horizon, azimuth
//! clockwise from north. +z is up.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::time::{Date, Timestamp};

/// Position of the sun in the sky, rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SunPosition {
    /// Angle above the horizon, -pi/2 to pi/2, without refraction.
    pub elevation: f64,
    /// Angle clockwise from north, 0 to 2 pi.
    pub azimuth: f64,
}

impl SunPosition {
    /// Computes the position at a `time`, seen from a latitude (north is positive) and a longitude
    /// (east is positive), rad.
    ///
    /// The formulas are the short ones of the Astronomical Almanac (Michalsky, Solar Energy 40:227,
    /// 1988, erratum 41:113), accurate to 0.01 degree from 1950 to 2050. Refraction is left out: it
    /// lifts the sun by 0.03 degree at an elevation of 30 degrees, and by 0.5 degree at the
    /// horizon.
    pub fn at(time: Timestamp, latitude: f64, longitude: f64) -> Self {
        // days since noon of 1 January 2000
        let n = time.unix / 86_400.0 - 10_957.5;
        let utc_hour = (time.unix / 3600.0).rem_euclid(24.0);
        let mean_longitude = 280.460 + 0.985_647_4 * n;
        let anomaly = (357.528 + 0.985_600_3 * n).to_radians();
        let equation = 1.915 * anomaly.sin() + 0.020 * (2.0 * anomaly).sin();
        let ecliptic = (mean_longitude + equation).to_radians();
        let obliquity = (23.439 - 4e-7 * n).to_radians();
        let right_ascension = (obliquity.cos() * ecliptic.sin()).atan2(ecliptic.cos());
        let (sin_dec, cos_dec) = {
            let sin = obliquity.sin() * ecliptic.sin();
            (sin, (1.0 - sin * sin).sqrt())
        };
        let sidereal = 6.697_375 + 0.065_709_824_2 * n + utc_hour;
        let hour_angle = (sidereal * 15.0).to_radians() + longitude - right_ascension;
        let (sin_lat, cos_lat) = latitude.sin_cos();
        let (sin_hour, cos_hour) = hour_angle.sin_cos();
        let up = sin_dec * sin_lat + cos_dec * cos_lat * cos_hour;
        let east = -cos_dec * sin_hour;
        let north = sin_dec * cos_lat - cos_dec * sin_lat * cos_hour;
        Self { elevation: up.atan2(east.hypot(north)), azimuth: east.atan2(north).rem_euclid(TAU) }
    }

    /// Returns the angle from the zenith, rad.
    pub fn zenith(self) -> f64 {
        0.5 * PI - self.elevation
    }

    /// Returns the direction towards the sun, unit vector. `north`, rad, is that of [`azimuth_of`].
    pub fn direction(self, north: f64) -> DVec3 {
        let (sin_h, cos_h) = self.elevation.sin_cos();
        let (sin_a, cos_a) = (north + self.azimuth).sin_cos();
        DVec3::new(sin_a * cos_h, cos_a * cos_h, sin_h)
    }
}

/// Returns the angle of a vector's horizontal part, rad, clockwise from +y seen from above. For a
/// vector to the north it is the `north` of other functions: 0 for north along +y, pi/2 for north
/// along +x.
pub fn azimuth_of(vector: DVec3) -> f64 {
    vector.x.atan2(vector.y).rem_euclid(TAU)
}

/// Returns the square of the mean distance between earth and sun over the distance on a day, 0.967
/// to 1.035 (Spencer, Search 2:172, 1971).
pub fn eccentricity(date: Date) -> f64 {
    let day = TAU * (date.day_of_year() - 1) as f64 / 365.0;
    1.000_110
        + 0.034_221 * day.cos()
        + 0.001_280 * day.sin()
        + 0.000_719 * (2.0 * day).cos()
        + 0.000_077 * (2.0 * day).sin()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn degrees(time: Timestamp, latitude: f64, longitude: f64) -> [f64; 2] {
        let sun = SunPosition::at(time, latitude.to_radians(), longitude.to_radians());
        [sun.elevation, sun.azimuth].map(f64::to_degrees)
    }

    /// Makes a timestamp from a date and an hour in UTC.
    fn utc(year: i64, month: u32, day: u32, hour: f64) -> Timestamp {
        let days = Date { year, month, day }.days();
        Timestamp { unix: days as f64 * 86_400.0 + hour * 3600.0, offset: 0.0 }
    }

    /// The published case of Reda and Andreas (Solar Energy 76:577, 2004): zenith angle 50.11162
    /// with 0.0161 of refraction, azimuth 194.34024; and for other times and places the same
    /// formulas in double precision.
    #[test]
    fn the_sun_stands_where_it_is_published() {
        let [elevation, azimuth] =
            degrees(utc(2003, 10, 17, 19.0 + 30.5 / 60.0), 39.742476, -105.1786);
        assert!((90.0 - elevation - 50.1272).abs() < 1e-4, "{elevation}");
        assert!((azimuth - 194.3370).abs() < 1e-4, "{azimuth}");
        assert!(
            (90.0 - elevation - 0.0161 - 50.11162).abs() < 0.01
                && (azimuth - 194.34024).abs() < 0.01
        );
        for (time, elevation, azimuth) in [(10.0, 60.3, 124.0), (11.0 + 46.0 / 60.0, 69.8, 180.0)] {
            let [h, a] = degrees(utc(2025, 6, 21, time), 43.61, 3.88);
            assert!((h - elevation).abs() < 0.05 && (a - azimuth).abs() < 0.5, "{time}: {h} {a}");
        }
        // south of the equator the noon sun stands in the north; it never rises in a polar night
        let [h, a] = degrees(utc(2025, 12, 21, 12.0), -60.0, 0.0);
        assert!((h - 53.4).abs() < 0.1 && (a.min(360.0 - a)) < 2.0, "{h} {a}");
        for hour in 0..24 {
            assert!(degrees(utc(2025, 12, 21, f64::from(hour)), 80.0, 15.0)[0] < -12.0);
        }
    }

    #[test]
    fn directions_follow_north() {
        let sun = SunPosition { elevation: 35f64.to_radians(), azimuth: 120f64.to_radians() };
        let expected = DVec3::new(0.70940648, -0.409576022, 0.573576436);
        assert!((sun.direction(0.0) - expected).length() < 1e-8);
        // where north is +x, east is -y
        let turned = sun.direction(azimuth_of(DVec3::X));
        assert!((turned - DVec3::new(-0.409576022, -0.70940648, 0.573576436)).length() < 1e-8);
        assert_eq!(azimuth_of(DVec3::Y), 0.0);
    }

    #[test]
    fn the_earth_is_nearest_in_january() {
        let at = |month, day| eccentricity(Date { year: 2025, month, day });
        assert!((at(1, 3) - 1.0351).abs() < 2e-4 && (at(7, 4) - 0.9666).abs() < 3e-4);
    }
}
