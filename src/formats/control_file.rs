//! Control files: when lamps are on, and how much electric power they use.

use std::path::Path;

use schemars::JsonSchema;
use serde::Deserialize;

use super::{input::read_bytes, json};
use crate::error::{Error, Result, number};

/// When the lamps of a scene are on in a year calculated by the hour.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ControlFile {
    /// Place of the schema, for editors; phylux does not read it.
    #[serde(rename = "$schema")]
    pub _schema: Option<String>,
    /// The lamps, in the order in which they are switched on.
    pub lamps: Vec<LampControl>,
}

/// When some lamps are on: they are on while all conditions given here hold.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LampControl {
    /// Name of a light; a name that ends with `*` stands for all lights whose names begin with the
    /// part before it.
    pub lights: String,
    /// Electric power of each light, W (default: unknown).
    #[schemars(range(min = 0))]
    pub watts: Option<f64>,
    /// From when to when the lamps may be on, h of the weather file's standard time; the span may
    /// pass midnight (default: always).
    pub hours: Option<[f64; 2]>,
    /// The lamps are on while daylight on the front of `of` is below this, in the scene's quantity
    /// per m2.
    #[schemars(range(min = 0))]
    pub below: Option<f64>,
    /// The captor or group that `below` and `until_dli` refer to.
    pub of: Option<String>,
    /// The band or sum that `below` and `until_dli` refer to (default: the only one that has a
    /// daily light integral).
    pub band: Option<String>,
    /// The lamps are on while the global irradiance outside is below this, W/m2.
    #[schemars(range(min = 0))]
    pub outside_below: Option<f64>,
    /// The lamps are on until daylight and lamps since midnight have brought this amount of light
    /// to the front of `of`: mol/m2, or MJ/m2 where the scene is in W. In the last hour they are on
    /// for part of the time.
    #[schemars(range(min = 0))]
    pub until_dli: Option<f64>,
}

impl ControlFile {
    /// Reads the control file at `path`. Errors: the file is not valid JSON; a value is out of its
    /// range; `below` or `until_dli` is given without `of`, or `of` without either.
    pub fn load(path: &Path) -> Result<Self> {
        let name = path.display().to_string();
        let bytes = read_bytes(path)
            .map_err(|why| Error::input(&name, why).remedy("name a control file (JSON)"))?;
        let file: Self = json::read(&name, json::parse(&name, &bytes)?)?;
        for (i, lamps) in file.lamps.iter().enumerate() {
            lamps.check(&|key| json::place(&name, &format!("/lamps/{i}{key}")))?;
        }
        Ok(file)
    }
}

impl LampControl {
    fn check(&self, place: &dyn Fn(&str) -> String) -> Result<()> {
        for (key, value) in [
            ("/watts", self.watts),
            ("/below", self.below),
            ("/outside_below", self.outside_below),
            ("/until_dli", self.until_dli),
        ] {
            if let Some(value) = value.filter(|value| !(0.0..=1e9).contains(value)) {
                let problem = format!("{}, must be 0 to 1e9", number(value));
                return Err(Error::input(place(key), problem).remedy("correct it"));
            }
        }
        if let Some(hours) = self.hours
            && !hours.iter().all(|hour| (0.0..=24.0).contains(hour))
        {
            return Err(Error::input(place("/hours"), "must be two times of 0 to 24 h")
                .remedy("write [4, 22], or [22, 6] for a night"));
        }
        let about = self.below.is_some() || self.until_dli.is_some();
        match (&self.of, about) {
            (None, true) => {
                Err(Error::input(place(""), "`below` and `until_dli` need to know where")
                    .remedy("name a captor or a group as `of`"))
            }
            (Some(_), false) => {
                Err(Error::input(place("/of"), "goes with `below` or `until_dli` only")
                    .remedy("leave it out"))
            }
            _ => Ok(()),
        }
    }

    /// Returns whether `lights` stands for the light of this name.
    pub fn names(&self, light: &str) -> bool {
        match self.lights.strip_suffix('*') {
            Some(start) => light.starts_with(start),
            None => light == self.lights,
        }
    }

    /// Returns the fraction of the time in which `hours` allow the lamps to be on, of the `length`
    /// h that begin at `start`, h since midnight.
    pub fn allowed(&self, start: f64, length: f64) -> f64 {
        let Some([from, to]) = self.hours else { return 1.0 };
        let within = |from: f64, to: f64| ((start + length).min(to) - start.max(from)).max(0.0);
        let of_days = |from: f64, to: f64| within(from, to) + within(from + 24.0, to + 24.0);
        let hours = match from <= to {
            true => of_days(from, to),
            false => within(0.0, to) + of_days(from, to + 24.0),
        };
        (hours / length).min(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lamps(hours: [f64; 2]) -> LampControl {
        serde_json::from_value(serde_json::json!({ "lights": "row 1*", "hours": hours })).unwrap()
    }

    #[test]
    fn hours_are_allowed_in_part_and_past_midnight() {
        let day = lamps([4.5, 22.0]);
        let found: Vec<f64> = [3.0, 4.0, 5.0, 21.0, 22.0].map(|h| day.allowed(h, 1.0)).into();
        assert_eq!(found, [0.0, 0.5, 1.0, 1.0, 0.0]);
        let night = lamps([22.0, 6.0]);
        let found: Vec<f64> =
            [0.0, 5.0, 6.0, 21.0, 22.0, 23.0].map(|h| night.allowed(h, 1.0)).into();
        assert_eq!(found, [1.0, 1.0, 0.0, 0.0, 1.0, 1.0]);
        assert_eq!(lamps([0.0, 24.0]).allowed(23.0, 1.0), 1.0);
        assert_eq!(lamps([8.0, 8.0]).allowed(8.0, 1.0), 0.0);
        assert!(day.names("row 1a") && !day.names("row 2"));
    }
}
