//! Checks the clock of a weather file: global = direct sin(elevation) + diffuse must hold for the
//! true position of the sun; where less is measured, the light of a day must rise and fall with the
//! sun; and never can more arrive than outside the atmosphere.

use std::f64::consts::TAU;

use super::{
    record::{HOUR, Record, Site, Weather},
    split::OUTSIDE,
};
use phylux_core::scene::daylight::{Timestamp, eccentricity};

/// What a clock was checked by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Evidence {
    /// Hours with global, direct and diffuse irradiance, and more than 100 W/m2 of direct light:
    /// their global less that of the other two, W/m2.
    Closure,
    /// Days of one column, or of direct and diffuse light: the misfit of their light to the course of
    /// the sun's elevation, relative to it.
    Course,
}

/// The result of checking a file's clock. A misfit is a root mean square.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClockCheck {
    /// What the clock was checked by.
    pub by: Evidence,
    /// The misfit.
    pub misfit: f64,
    /// The shift of the clock, h, at which the misfit is smallest.
    pub best_shift: f64,
    /// The misfit at that shift.
    pub best_misfit: f64,
    /// Whether the clock is wrong and that shift mends it.
    pub advised: bool,
}

impl ClockCheck {
    /// A root mean square of closure above this, W/m2, gives a warning.
    pub const LARGEST: f64 = 10.0;

    /// Returns a warning if the clock seems wrong.
    pub fn warning(&self) -> Option<String> {
        let Self { by, misfit, best_shift, best_misfit, advised } = *self;
        let doubt = "is the clock of the file another one, or the site's longitude?";
        match by {
            Evidence::Closure if misfit > Self::LARGEST => {
                let found = format!(
                    "global, direct and diffuse irradiance fit the sun's elevation only within {misfit:.1} W/m2"
                );
                Some(match advised {
                    true => format!(
                        "{found}; with `shift_h` {best_shift:.2} they fit within {best_misfit:.1}: {doubt}"
                    ),
                    false => format!(
                        "{found}, whatever the clock: are they of the same place and instruments?"
                    ),
                })
            }
            Evidence::Course if advised => {
                let [now, then] = [misfit, best_misfit].map(|misfit| 100.0 * misfit);
                Some(format!(
                    "the light of the days rises and falls with the sun only within {now:.0} %, with `shift_h` \
                     {best_shift:.2} within {then:.0} %: {doubt} (docs/scene-format.md#daylight)"
                ))
            }
            _ => None,
        }
    }
}

/// The sine of the sun's elevation as a function of a shift of the clock, within a day of the
/// record. Declination is taken to be constant meanwhile.
struct Course {
    mean: f64,
    cosine: f64,
    sine: f64,
}

impl Course {
    fn new(site: Site, record: &Record) -> Self {
        let middle = 0.5 * record.length();
        let [now, later, opposite] =
            [0.0, 6.0, 12.0].map(|h| site.sun(record.start, middle + h * HOUR).elevation.sin());
        let mean = 0.5 * (now + opposite);
        Self { mean, cosine: now - mean, sine: later - mean }
    }

    /// Returns the sine, at least 0, where a shift has this `(sine, cosine)` as an angle of the day.
    fn at(&self, (sine, cosine): (f64, f64)) -> f64 {
        (self.mean + self.cosine * cosine + self.sine * sine).max(0.0)
    }
}

/// Returns a time in hours as an angle of the day.
fn angle(hours: f64) -> (f64, f64) {
    (hours / 24.0 * TAU).sin_cos()
}

/// Misfits that agree to this fraction are equal: shifts that differ by a day are the same angle, up
/// to rounding.
const EQUAL: f64 = 1e-9;

/// Returns the best shift, h, and its misfit: by quarters of an hour over -14 to 14 h, then by
/// hundredths of an hour. Of equal ones it is the smallest shift.
fn search(misfit: impl Fn(f64) -> f64) -> (f64, f64) {
    let best_of = |shifts: &mut dyn Iterator<Item = f64>| {
        let found: Vec<(f64, f64)> = shifts.map(|shift| (shift, misfit(shift))).collect();
        let least = found.iter().map(|(_, misfit)| *misfit).fold(f64::INFINITY, f64::min);
        let equal = found.into_iter().filter(|(_, misfit)| *misfit <= least * (1.0 + EQUAL));
        equal.min_by(|a, b| a.0.abs().total_cmp(&b.0.abs()))
    };
    let (coarse, _) =
        best_of(&mut (-56..=56).map(|i| f64::from(i) / 4.0)).unwrap_or((0.0, f64::INFINITY));
    best_of(&mut (-13..=13).map(|i| coarse + f64::from(i) / 100.0)).unwrap_or((coarse, 0.0))
}

/// The fewest hours that say what the clock is.
const FEWEST: usize = 6;
/// The course of days says something only where the light that is known on level ground is more
/// than this share of the direct light.
const LEAST_LEVEL: f64 = 0.02;
/// The smallest error of a clock, h, that the course of days is trusted to show.
const SURE: f64 = 0.6;

impl Weather {
    /// Returns warnings about the clock, moved by `shift_h` hours, and about light that the sun cannot
    /// have sent then.
    pub fn clock_warnings(&self, site: Site, shift_h: f64) -> Vec<String> {
        let check = self.check_clock(site, shift_h).and_then(|check| check.warning());
        let light = [self.beyond_the_sun(site, shift_h), self.hardly_any(site, shift_h)];
        check.into_iter().chain(light.into_iter().flatten()).collect()
    }

    /// Checks the clock, moved by `shift_h` hours, by how well global, direct and diffuse
    /// irradiance fit together, or else by the course of the days. Returns `None` if the file shows
    /// neither.
    pub fn check_clock(&self, site: Site, shift_h: f64) -> Option<ClockCheck> {
        self.closure(site, shift_h).or_else(|| self.course(site, shift_h))
    }

    fn closure(&self, site: Site, shift_h: f64) -> Option<ClockCheck> {
        let hours: Vec<(Course, [f64; 3])> = self
            .records
            .iter()
            .filter_map(|r| Some((r, [r.global?, r.direct?, r.diffuse?])))
            .filter(|(_, [_, direct, _])| *direct > 100.0)
            .map(|(record, values)| (Course::new(site, record), values))
            .collect();
        if hours.is_empty() {
            return None;
        }
        let count = hours.len() as f64;
        let rms = |shift: f64| {
            let turn = angle(shift);
            let miss = |(course, [global, direct, diffuse]): &(Course, [f64; 3])| {
                (global - direct * course.at(turn) - diffuse).powi(2)
            };
            (hours.iter().map(miss).sum::<f64>() / count).sqrt()
        };
        let misfit = rms(shift_h);
        let (best_shift, best_misfit) = search(rms);
        let global = hours.iter().map(|(_, [global, ..])| global).sum::<f64>() / count;
        let fits = best_misfit < ClockCheck::LARGEST.max(0.05 * global);
        let advised = misfit > ClockCheck::LARGEST
            && fits
            && best_misfit < 0.5 * misfit
            && hours.len() >= FEWEST;
        Some(ClockCheck { by: Evidence::Closure, misfit, best_shift, best_misfit, advised })
    }

    /// Checks by the course of the days: light from dark to dark is, but for the weather, about
    /// proportional to sin(elevation)^1.2. Where direct and diffuse light are measured, their sum on
    /// the ground depends on the clock itself.
    fn course(&self, site: Site, shift_h: f64) -> Option<ClockCheck> {
        let days: Vec<Vec<(Course, [f64; 2])>> = self
            .days()
            .into_iter()
            .map(|day| day.into_iter().map(|(r, light)| (Course::new(site, r), light)).collect())
            .collect();
        // what direct light alone brings to the ground is by the clock itself, and goes with any
        let [level, direct] =
            [0, 1].map(|part| days.iter().flatten().map(|(_, light)| light[part]).sum::<f64>());
        if level <= LEAST_LEVEL * direct {
            return None;
        }
        // of minutes, some of the days are enough
        let every = 1 + days.iter().map(Vec::len).sum::<usize>() / 40_000;
        let days: Vec<_> = days.into_iter().step_by(every).collect();
        // what a day leaves over if it is fitted by itself, as days differ in their clouds; and all
        let fit = |day: &[(Course, [f64; 2])], shift: f64| {
            let turn = angle(shift);
            let (mut product, mut square, mut total) = (0.0, 0.0, 0.0);
            for (course, [level, direct]) in day {
                let sine = course.at(turn);
                let (due, value) = (sine.powf(1.2), level + direct * sine);
                product += due * value;
                square += due * due;
                total += value * value;
            }
            [total - if square > 0.0 { product * product / square } else { 0.0 }, total]
        };
        // in proportion to the light that the day has by its own clock
        let own: Vec<f64> = days.iter().map(|day| fit(day, shift_h)[1]).collect();
        let left = |i: usize, shift: f64| {
            let [left, total] = fit(&days[i], shift);
            if total > 0.0 { left / total * own[i] } else { own[i] }
        };
        let all: f64 = own.iter().sum();
        let misfit = |shift: f64| {
            ((0..days.len()).map(|i| left(i, shift)).sum::<f64>() / all).max(0.0).sqrt()
        };
        let (best_shift, best_misfit) = search(misfit);
        let now = misfit(shift_h);
        // days under clouds fit badly with any clock, but the difference adds up over many of them
        let gains: Vec<f64> =
            (0..days.len()).map(|i| left(i, shift_h) - left(i, best_shift)).collect();
        let count = gains.len() as f64;
        let gain = gains.iter().sum::<f64>() / count;
        let variance = gains.iter().map(|g| (g - gain).powi(2)).sum::<f64>() / (count - 1.0);
        let sure = gains.len() > 4 && gain > 4.0 * (variance / count).sqrt();
        let clear = best_misfit < 0.15 && best_misfit < 0.5 * now;
        let off = (best_shift - shift_h + 12.0).rem_euclid(24.0) - 12.0;
        let advised = off.abs() >= SURE && (clear || sure);
        let by = Evidence::Course;
        Some(ClockCheck { by, misfit: now, best_shift, best_misfit, advised })
    }

    /// Returns the records of each day from dark to dark, with their light, W/m2: what is measured on
    /// level ground, and the direct light on a plane across its way where the former lacks it.
    fn days(&self) -> Vec<Vec<(&Record, [f64; 2])>> {
        /// Light above this, W/m2, makes a day.
        const LIGHT: f64 = 2.0;
        let mut days: Vec<Vec<(&Record, [f64; 2])>> = Vec::new();
        for record in &self.records {
            let light = match (record.global, record.diffuse) {
                (Some(global), _) => [global, 0.0],
                (None, Some(diffuse)) => [diffuse, record.direct.unwrap_or(0.0)],
                (None, None) => continue,
            };
            if light[0] + light[1] <= LIGHT {
                continue;
            }
            match days.last_mut() {
                Some(day) if day.last().is_some_and(|(r, _)| record.from < r.to + 1.0) => {
                    day.push((record, light));
                }
                _ => days.push(vec![(record, light)]),
            }
        }
        days.retain(|day| {
            let sum = |(_, [level, direct]): &(&Record, [f64; 2])| level + direct;
            let most = day.iter().map(sum).fold(0.0, f64::max);
            let [Some(first), Some(last)] = [day.first(), day.last()] else { return false };
            let hours = (last.0.to - first.0.from) / HOUR;
            let ends = sum(first).max(sum(last)) < 0.35 * most;
            day.len() >= FEWEST && (4.0..22.0).contains(&hours) && ends
        });
        days
    }

    /// Returns the mean sine of the sun's elevation in a record, and the irradiance, W/m2, across its
    /// direction outside the atmosphere.
    fn outside(site: Site, record: &Record, shift_h: f64) -> (f64, f64) {
        let time = Timestamp { unix: record.start.unix + shift_h * HOUR, ..record.start };
        let course = Course::new(site, record);
        let part = |i: i32| (f64::from(i) - 2.0) / 5.0 * record.length() / HOUR;
        let sine = (0..5).map(|i| course.at(angle(shift_h + part(i)))).sum::<f64>() / 5.0;
        (sine, OUTSIDE * eccentricity(time.date()))
    }

    /// Returns a warning if more light arrives than can (Long and Dutton, BSRN Global Network
    /// recommended QC tests, V2.0, 2002: the limits of global and of direct irradiance).
    fn beyond_the_sun(&self, site: Site, shift_h: f64) -> Option<String> {
        let beyond = self.records.iter().filter_map(|record| {
            let (level, direct) = (record.global.or(record.diffuse)?, record.direct.unwrap_or(0.0));
            // most rows are dark or far from the limits
            if level <= 50.0 && direct <= 50.0 {
                return None;
            }
            let (sine, outside) = Self::outside(site, record, shift_h);
            // for minutes the edges of clouds may add to the sun
            let (factor, more) = if record.length() < 900.0 { (1.5, 100.0) } else { (1.2, 50.0) };
            let most = factor * outside * sine.powf(1.2) + more;
            let level = if record.global.is_none() { level + direct * sine } else { level };
            let excess = [("", level, most), (" of direct light", direct, outside)];
            let of = |&(what, value, most): &(&'static str, f64, f64)| {
                (value > most).then_some((record.line, what, value, most))
            };
            excess.iter().find_map(of)
        });
        let beyond: Vec<(u64, &str, f64, f64)> = beyond.collect();
        let (line, what, value, most) =
            *beyond.iter().max_by(|a, b| (a.2 - a.3).total_cmp(&(b.2 - b.3)))?;
        let rows = match beyond.len() {
            1 => "1 row has".to_owned(),
            rows => format!("{rows} rows have"),
        };
        Some(format!(
            "{rows} more light than can arrive, the worst in line {line}: {value:.1} W/m2{what} where at most {most:.1} can: \
             is the clock another one, the site, or the unit? (docs/scene-format.md#daylight)"
        ))
    }

    /// Returns a warning if hardly any light arrives, however high the sun stands.
    fn hardly_any(&self, site: Site, shift_h: f64) -> Option<String> {
        /// The darkest clouds leave more than this fraction of what arrives outside the atmosphere.
        const DARKEST: f64 = 0.01;
        /// The sine of the sun's elevation above which rows are compared.
        const HIGH: f64 = 0.3;
        let mut most: Option<(u64, f64, f64)> = None;
        let mut rows = 0;
        for record in &self.records {
            let Some(level) = record.global.or(record.diffuse) else { continue };
            // one bright row is enough, and bright ones need no sun to be told
            if level > DARKEST * OUTSIDE * 1.04 {
                return None;
            }
            let (sine, outside) = Self::outside(site, record, shift_h);
            if sine < HIGH {
                continue;
            }
            let light = match record.global {
                Some(global) => global,
                None => level + record.direct.unwrap_or(0.0) * sine,
            };
            rows += 1;
            if light > DARKEST * outside * sine {
                return None;
            }
            if most.is_none_or(|(_, value, _)| light > value) {
                most = Some((record.line, light, outside * sine));
            }
        }
        let (line, value, outside) = most.filter(|_| rows >= FEWEST)?;
        Some(format!(
            "hardly any light arrives: of {rows} rows with a high sun the brightest, in line {line}, has {value:.3} W/m2 \
             of {outside:.0}: is the unit kW/m2, or the clock another one? (docs/scene-format.md#daylight)"
        ))
    }
}
