//! Checks the clock of a weather file: in every hour, global = direct sin(elevation) + diffuse must
//! hold for the true position of the sun.

use super::record::{HOUR, Record, Site, Weather};
use crate::scene::daylight::{SunPosition, Timestamp};

/// The result of checking a file's clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClockCheck {
    /// Root mean square of global - direct sin(elevation) - diffuse, W/m2, over the hours in which
    /// direct irradiance is above 100 W/m2.
    pub rms: f64,
    /// The shift of the clock, h, at which the root mean square is smallest.
    pub best_shift: f64,
    /// The root mean square at that shift, W/m2.
    pub best_rms: f64,
}

impl ClockCheck {
    /// A root mean square above this, W/m2, gives a warning.
    pub const LARGEST: f64 = 10.0;

    /// Returns a warning if the clock seems wrong.
    pub fn warning(&self) -> Option<String> {
        let Self { rms, best_shift, best_rms } = *self;
        if rms <= Self::LARGEST {
            return None;
        }
        let found = format!(
            "global, direct and diffuse irradiance fit the sun's elevation only within {rms:.1} W/m2"
        );
        Some(match best_rms < 0.5 * rms {
            true => format!(
                "{found}; with `shift_h` {best_shift:.2} they fit within {best_rms:.1}: is the clock of the \
                 file another one?"
            ),
            false => {
                format!("{found}, whatever the clock: are they of the same place and instruments?")
            }
        })
    }
}

impl Weather {
    /// Checks the clock, moved by `shift_h` hours, by how well global, direct and diffuse
    /// irradiance fit together. Returns `None` if no hour has all three, with direct irradiance
    /// above 100 W/m2.
    pub fn check_clock(&self, site: Site, shift_h: f64) -> Option<ClockCheck> {
        let hours: Vec<(&Record, [f64; 3])> = self
            .records
            .iter()
            .filter_map(|r| Some((r, [r.global?, r.direct?, r.diffuse?])))
            .filter(|(_, [_, direct, _])| *direct > 100.0)
            .collect();
        if hours.is_empty() {
            return None;
        }
        let rms = |shift: f64| {
            let miss = |(record, [global, direct, diffuse]): &(&Record, [f64; 3])| {
                let middle = 0.5 * (record.to - record.from);
                let sun = site.sun(record.start, middle + shift * HOUR);
                (global - direct * sun.elevation.sin().max(0.0) - diffuse).powi(2)
            };
            (hours.iter().map(miss).sum::<f64>() / hours.len() as f64).sqrt()
        };
        // try steps of a tenth of an hour, then of a fiftieth around the best
        let best_of = |shifts: &mut dyn Iterator<Item = f64>| {
            shifts.map(|shift| (shift, rms(shift))).min_by(|a, b| a.1.total_cmp(&b.1))
        };
        let (coarse, _) = best_of(&mut (-15..=15).map(|i| f64::from(i) / 10.0))?;
        let (best_shift, best_rms) = best_of(&mut (-5..=5).map(|i| coarse + f64::from(i) / 50.0))?;
        Some(ClockCheck { rms: rms(shift_h), best_shift, best_rms })
    }
}

impl Site {
    /// Returns the position of the sun `later` seconds after `start`.
    pub(super) fn sun(self, start: Timestamp, later: f64) -> SunPosition {
        let time = Timestamp { unix: start.unix + later, ..start };
        SunPosition::at(time, self.latitude.to_radians(), self.longitude.to_radians())
    }
}
