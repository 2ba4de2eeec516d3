//! From the measured columns of a record to direct and diffuse light: by closure, global = diffuse +
//! direct sin(elevation), where two of them are known, and by a model where only the global is.

use super::record::{Record, Site};
use phylux_core::scene::daylight::{SunCourse, SunPosition, Timestamp, eccentricity};

/// The sun of a record.
#[derive(Clone, Copy, Debug)]
pub(super) struct OwnSun {
    /// Its position in the middle of the record, or of the part in which it is up.
    pub(super) at: SunPosition,
    /// Its positions in that part; `None` while it is below the horizon.
    pub(super) course: Option<SunCourse>,
    /// The part of the record in which it is above the horizon, 0 to 1.
    pub(super) lit: f64,
    /// The [`eccentricity`](phylux_core::scene::daylight::eccentricity) of the day.
    pub(super) eccentricity: f64,
}

/// The light of a record, W/m2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Split {
    pub(super) direct: f64,
    pub(super) diffuse: f64,
    /// Whether a model told the two apart.
    pub(super) estimated: bool,
    /// Global irradiance as it was measured and as the two make it, where these do not agree.
    pub(super) misfit: Option<[f64; 2]>,
}

/// Irradiance on a plane across the sun's direction outside the atmosphere, at the mean distance of
/// the earth, W/m2.
pub(super) const OUTSIDE: f64 = 1367.0;

impl Site {
    /// Returns the sun of a record whose clock is moved by `shift` s.
    pub(super) fn own_sun(self, record: &Record, shift: f64) -> OwnSun {
        let length = record.length();
        let at = |later: f64| self.sun(record.start, shift + later);
        let up = |later: f64| at(later).elevation > 0.0;
        // the sun may rise and set within a record
        let looks: Vec<f64> =
            (0..=LOOKS).map(|i| f64::from(i) / f64::from(LOOKS) * length).collect();
        let first = looks.iter().position(|&later| up(later));
        let last = looks.iter().rposition(|&later| up(later));
        let (from, to) = match (first, last) {
            (Some(first), Some(last)) => (
                first.checked_sub(1).map_or(0.0, |down| crossing(up, looks[first], looks[down])),
                looks.get(last + 1).map_or(length, |&down| crossing(up, looks[last], down)),
            ),
            _ => (0.0, length),
        };
        let start = record.start.unix + shift;
        let at_time = |time: f64| at(time - start);
        let course = first.and_then(|_| SunCourse::new(start + from, start + to, at_time));
        let lit = if course.is_some() && length > 0.0 { (to - from) / length } else { 0.0 };
        let date = Timestamp { unix: record.start.unix + shift, ..record.start }.date();
        OwnSun { at: at(0.5 * (from + to)), course, lit, eccentricity: eccentricity(date) }
    }
}

impl OwnSun {
    /// Returns the mean sine of the elevation of the sun while it shines; 0 where it does not.
    fn sine(&self) -> f64 {
        self.course.map_or(0.0, |course| course.sine())
    }
}

/// Number of parts of a record at whose borders the sun is looked for.
const LOOKS: u32 = 6;

/// Returns the time, s, at which `is` changes between `yes`, where it holds, and `no`, where it
/// does not, to within a second.
fn crossing(is: impl Fn(f64) -> bool, mut yes: f64, mut no: f64) -> f64 {
    while (yes - no).abs() > 1.0 {
        let middle = 0.5 * (yes + no);
        *(if is(middle) { &mut yes } else { &mut no }) = middle;
    }
    yes
}

impl Record {
    /// Returns the direct and diffuse light of a record, whose sun is `sun`; `None` if too little
    /// was measured.
    pub(super) fn split(&self, sun: OwnSun) -> Option<Split> {
        let sine = sun.sine();
        let (direct, diffuse) = match (self.global, self.direct, self.diffuse) {
            (_, Some(direct), Some(diffuse)) => (direct, diffuse),
            (Some(global), None, Some(diffuse)) => {
                // near the horizon a small error of the difference is a large one of direct light,
                // so it is kept below what arrives outside the atmosphere; the rest is diffuse
                let most = OUTSIDE * sun.eccentricity * sun.lit;
                let direct =
                    if sine > 0.0 { ((global - diffuse) / sine).clamp(0.0, most) } else { 0.0 };
                (direct, diffuse.max(global - direct * sine))
            }
            (Some(global), Some(direct), None) => (direct, (global - direct * sine).max(0.0)),
            (Some(global), None, None) => erbs(global, sine, sun.eccentricity),
            // measurements may be missing at night
            _ if sun.at.elevation < -0.1 => (0.0, 0.0),
            _ => return None,
        };
        let estimated = self.direct.is_none() && self.diffuse.is_none() && self.global > Some(0.0);
        let sum = diffuse + direct * sine;
        let misfit = self.global.map(|global| [global, sum]).filter(|[global, sum]| {
            sine > 0.0 && (global - sum).abs() > 10.0 + tolerance(sine) * global.max(*sum)
        });
        Some(Split { direct, diffuse, estimated, misfit })
    }
}

/// Returns by how much, relatively, global irradiance may differ from direct and diffuse (Long and
/// Dutton, BSRN Global Network recommended QC tests, V2.0, 2002).
fn tolerance(sine: f64) -> f64 {
    if sine > 75f64.to_radians().cos() { 0.08 } else { 0.15 }
}

/// Splits global irradiance into direct normal and diffuse horizontal irradiance, W/m2 (Erbs,
/// Klein, Duffie, Solar Energy 28:293, 1982). While the sun is less than 3 degrees above the
/// horizon, all of it is diffuse.
fn erbs(global: f64, sine: f64, eccentricity: f64) -> (f64, f64) {
    if sine < 3f64.to_radians().sin() {
        return (0.0, global);
    }
    let outside = OUTSIDE * eccentricity;
    let clearness = global / (outside * sine);
    let k = clearness;
    let diffuse = global
        * match k {
            ..=0.22 => 1.0 - 0.09 * k,
            ..=0.8 => {
                0.9511 - 0.1604 * k + 4.388 * k.powi(2) - 16.638 * k.powi(3) + 12.336 * k.powi(4)
            }
            _ => 0.165,
        };
    let direct = ((global - diffuse) / sine).min(outside);
    (direct, global - direct * sine)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn erbs_has_its_published_shape() {
        // clearness 0.2, 0.5 and 0.9 with the sun at 30 degrees give the diffuse fractions 0.982,
        // 0.6592 and 0.165
        for (clearness, fraction) in [(0.2, 0.982), (0.5, 0.659_2), (0.9, 0.165)] {
            let global = clearness * OUTSIDE * 0.5;
            let (direct, diffuse) = erbs(global, 0.5, 1.0);
            assert!(
                (diffuse / global - fraction).abs() < 1e-3,
                "{clearness}: {}",
                diffuse / global
            );
            assert!((direct * 0.5 + diffuse - global).abs() < 1e-9);
        }
        assert_eq!(erbs(20.0, 0.01, 1.0), (0.0, 20.0));
        assert_eq!(erbs(20.0, -0.5, 1.0), (0.0, 20.0));
    }

    /// Two columns give the third; what cannot fit is said, and the global is kept where it can be.
    #[test]
    fn two_columns_close() {
        let split = |values: [Option<f64>; 3], degrees: f64, lit: f64| {
            let [global, direct, diffuse] = values;
            let start = Timestamp { unix: 0.0, offset: 0.0 };
            let record = Record { line: 1, from: 0.0, to: 3600.0, start, global, direct, diffuse };
            let at = SunPosition { elevation: degrees.to_radians(), azimuth: 0.0 };
            let course = (degrees > 0.0).then(|| SunCourse::still(at));
            record.split(OwnSun { at, course, lit, eccentricity: 1.0 })
        };
        let near = |found: Option<Split>, direct: f64, diffuse: f64, misfit: bool| {
            let found = found.unwrap();
            let right = (found.direct - direct).abs() < 1e-9
                && (found.diffuse - diffuse).abs() < 1e-9
                && found.misfit.is_some() == misfit
                && !found.estimated;
            assert!(right, "{found:?}, not {direct} {diffuse}");
        };
        near(split([Some(700.0), None, Some(300.0)], 30.0, 1.0), 800.0, 300.0, false);
        near(split([Some(700.0), Some(800.0), None], 30.0, 1.0), 800.0, 300.0, false);
        near(split([None, Some(800.0), Some(300.0)], 30.0, 1.0), 800.0, 300.0, false);
        near(split([Some(700.0), Some(800.0), Some(300.0)], 30.0, 1.0), 800.0, 300.0, false);
        // more diffuse than global light, by an instrument's error and by more than that
        near(split([Some(300.0), None, Some(305.0)], 30.0, 1.0), 0.0, 305.0, false);
        near(split([Some(300.0), None, Some(500.0)], 30.0, 1.0), 0.0, 500.0, true);
        near(split([Some(300.0), Some(900.0), None], 30.0, 1.0), 900.0, 0.0, true);
        near(split([Some(700.0), Some(0.0), Some(100.0)], 30.0, 1.0), 0.0, 100.0, true);
        // a sun that rises in the last minute brings little
        let rise = split([Some(3.0), None, Some(1.0)], 0.1, 1.0 / 60.0).unwrap();
        assert!((rise.direct - OUTSIDE / 60.0).abs() < 1e-9 && rise.diffuse > 2.9, "{rise:?}");
        near(split([Some(5.0), None, Some(4.0)], -1.0, 0.0), 0.0, 5.0, false);
        assert!(split([Some(500.0), None, None], 30.0, 1.0).unwrap().estimated);
        assert_eq!(split([None, Some(500.0), None], 30.0, 1.0), None);
        near(split([None; 3], -10.0, 0.0), 0.0, 0.0, false);
    }
}
