//! Control files: when lamps are on, how much electric power they use, and when screens and shades
//! change the scene.

mod tracker;

use std::path::Path;

use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::Value;

use super::{
    input::{quoted, read_bytes},
    json,
};
use phylux_core::{
    error::{Error, Result, number},
    scene::daylight::Date,
};
pub use tracker::{TrackerControl, Turn};

/// When the lamps of a scene are on, and when the scene changes, in a year calculated by the hour.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ControlFile {
    /// Place of the schema, for editors; phylux does not read it.
    #[serde(rename = "$schema")]
    pub _schema: Option<String>,
    /// The lamps, in the order in which they are switched on (default: none).
    #[serde(default)]
    pub lamps: Vec<LampControl>,
    /// States in which the scene is another one at times: screens that close, shades, whitewash
    /// (default: none).
    #[serde(default)]
    pub states: Vec<StateControl>,
    /// One-axis trackers: objects that turn to the sun, such as solar panels (default: none).
    #[serde(default)]
    pub trackers: Vec<TrackerControl>,
}

/// A change of the scene at some times: while all conditions given here hold.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StateControl {
    /// Name of the state.
    pub name: String,
    /// What stands elsewhere in the scene file: values by the place (a JSON pointer) that they
    /// replace, in `objects` or `materials`.
    pub changes: IndexMap<String, Value>,
    /// First and last day of the year, such as ["10-01", "04-30"], both included; may pass the new
    /// year (default: always).
    pub dates: Option<[String; 2]>,
    /// From when to when, h of the weather file's standard time; the span may pass midnight
    /// (default: always).
    pub hours: Option<[f64; 2]>,
    /// The state holds while the light outside is below this: global irradiance, W/m2, or light in
    /// `outside_band`.
    #[schemars(range(min = 0))]
    pub outside_below: Option<f64>,
    /// The state holds while the light outside is above this.
    #[schemars(range(min = 0))]
    pub outside_above: Option<f64>,
    /// The band or sum that `outside_below` and `outside_above` refer to, in the scene's quantity
    /// per m2 on a horizontal plane in the open.
    pub outside_band: Option<String>,
    /// Fraction of each hour for which the state holds, from a table.
    pub series: Option<SeriesFile>,
}

/// A column of a table by time.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SeriesFile {
    /// CSV file, relative to the control file, with a column `time` (date, time and the clock's
    /// offset from UTC) at which each row begins to hold.
    pub file: String,
    /// Column with numbers: from 0 to 1, if they are no prices.
    pub column: String,
}

/// How far lamps are dimmed.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "must be a number from 0 to 1, or a table: {\"file\", \"column\"}")]
pub enum DimFile {
    /// Always to this fraction of their power, 0 to 1.
    Fraction(f64),
    /// To fractions from a table.
    Series(SeriesFile),
}

/// The conditions of a state, or of lamps, that do not depend on the light inside.
#[derive(Clone, Copy, Debug)]
pub struct WhenKeys<'a> {
    /// First and last day of the year.
    pub dates: Option<&'a [String; 2]>,
    /// First and last hour of the day.
    pub hours: Option<[f64; 2]>,
    /// Light outside that must not be reached.
    pub outside_below: Option<f64>,
    /// Light outside that must be exceeded.
    pub outside_above: Option<f64>,
    /// Band or sum of these two.
    pub outside_band: Option<&'a str>,
    /// Fraction of the time.
    pub series: Option<&'a SeriesFile>,
}

/// When some lamps are on: they are on while all conditions given here hold.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LampControl {
    /// Name of a light; a name that ends with `*` stands for all lights whose names begin with the
    /// part before it.
    pub lights: String,
    /// Electric power of each light, W (default: the scene's `watts` of the light, or unknown).
    #[schemars(range(min = 0))]
    pub watts: Option<f64>,
    /// From when to when the lamps may be on, h of the weather file's standard time; the span may
    /// pass midnight (default: always).
    pub hours: Option<[f64; 2]>,
    /// The lamps are on while daylight on the front of `of` is below this, in the scene's quantity
    /// per m2.
    #[schemars(range(min = 0))]
    pub below: Option<f64>,
    /// The captor or group that `below`, `until_dli`, `fill_day` and `fill_to` refer to.
    pub of: Option<String>,
    /// The band or sum that `below`, `until_dli`, `fill_day` and `fill_to` refer to (default: the only
    /// one that has a daily light integral).
    pub band: Option<String>,
    /// The lamps are on while the light outside is below this: global irradiance, W/m2, or light in
    /// `outside_band`.
    #[schemars(range(min = 0))]
    pub outside_below: Option<f64>,
    /// The lamps are on while the light outside is above this.
    #[schemars(range(min = 0))]
    pub outside_above: Option<f64>,
    /// The band or sum that `outside_below` and `outside_above` refer to, in the scene's quantity
    /// per m2 on a horizontal plane in the open.
    pub outside_band: Option<String>,
    /// First and last day of the year, such as ["10-01", "03-31"], both included; may pass the new
    /// year (default: always).
    pub dates: Option<[String; 2]>,
    /// Fraction of their power to which the lamps are dimmed while they are on (default 1); the
    /// electric power is dimmed alike.
    pub dim: Option<DimFile>,
    /// The lamps are dimmed such that `of` just has this light, in the scene's quantity per m2, of
    /// daylight and lamps together.
    #[schemars(range(min = 0))]
    pub fill_to: Option<f64>,
    /// The lamps are on until daylight and lamps since midnight have brought this amount of light
    /// to the front of `of`: mol/m2, or MJ/m2 where the scene is in W. In the last hour they are on
    /// for part of the time.
    #[schemars(range(min = 0))]
    pub until_dli: Option<f64>,
    /// The lamps bring what daylight, and the lamps of the entries before, leave open of this daily
    /// light integral at the front of `of`, in mol/m2 (MJ/m2 where the scene is in W): the daylight of
    /// the whole day is known, and they are on just long enough, in the hours of `prefer` first.
    #[schemars(range(min = 0))]
    pub fill_day: Option<f64>,
    /// Hours of the day in which `fill_day` has the lamps on first (default: the darkest).
    pub prefer: Option<Prefer>,
    /// Price of electricity by time, for the cheapest hours: numbers of any unit and sign.
    pub prices: Option<SeriesFile>,
}

/// Hours of the day that are taken first. Of hours that are alike the earlier one is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Prefer {
    /// Those with the least daylight.
    #[default]
    Darkest,
    /// The first ones of the day.
    Earliest,
    /// The last ones of the day.
    Latest,
    /// Those in which electricity is cheapest.
    Cheapest,
}

/// The most entries that fill up days behind one with `until_dli`: what that one does on the day is
/// found anew for each of them.
const MOST_BEHIND: usize = 20;

impl ControlFile {
    /// Refuses too many entries that fill up days behind one with `until_dli`.
    fn check_order(&self, name: &str) -> Result<()> {
        let entries = self.lamps.iter().enumerate();
        let mut behind = entries
            .skip_while(|(_, lamps)| lamps.until_dli.is_none())
            .filter(|(_, lamps)| lamps.fill_day.is_some());
        match behind.nth(MOST_BEHIND) {
            None => Ok(()),
            Some((i, _)) => {
                let problem =
                    format!("more than {MOST_BEHIND} entries behind one with `until_dli`");
                Err(Error::input(json::place(name, &format!("/lamps/{i}/fill_day")), problem)
                    .remedy("let entries with `fill_day` stand before those with `until_dli`"))
            }
        }
    }

    /// Returns whether the scene is another one at times.
    pub fn changes_scene(&self) -> bool {
        !self.states.is_empty() || !self.trackers.is_empty()
    }

    /// Returns all tables by time that it names.
    pub fn series(&self) -> impl Iterator<Item = &SeriesFile> {
        let dims = self.lamps.iter().filter_map(|lamps| match &lamps.dim {
            Some(DimFile::Series(series)) => Some(series),
            _ => None,
        });
        let prices = self.lamps.iter().filter_map(|lamps| lamps.prices.as_ref());
        self.states.iter().filter_map(|state| state.series.as_ref()).chain(dims).chain(prices)
    }

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
        file.check_order(&name)?;
        for (i, tracker) in file.trackers.iter().enumerate() {
            tracker.check(&|key| json::place(&name, &format!("/trackers/{i}{key}")))?;
        }
        for (i, state) in file.states.iter().enumerate() {
            state.check(&|key| json::place(&name, &format!("/states/{i}{key}")))?;
            if let Some(j) = file.states[..i].iter().position(|other| other.name == state.name) {
                let place = json::place(&name, &format!("/states/{i}/name"));
                let problem = format!("state {j} is also called {}", quoted(&state.name));
                return Err(Error::input(place, problem).remedy("give each a name of its own"));
            }
        }
        Ok(file)
    }
}

/// Refuses numbers out of range; `place` returns the place of a key.
fn check_numbers(place: &dyn Fn(&str) -> String, numbers: &[(&str, Option<f64>)]) -> Result<()> {
    for (key, value) in numbers {
        if let Some(value) = value.filter(|value| !(0.0..=1e9).contains(value)) {
            let problem = format!("{}, must be 0 to 1e9", number(value));
            return Err(Error::input(place(key), problem).remedy("correct it"));
        }
    }
    Ok(())
}

impl WhenKeys<'_> {
    fn check(&self, place: &dyn Fn(&str) -> String) -> Result<()> {
        let (below, above) = (self.outside_below, self.outside_above);
        check_numbers(place, &[("/outside_below", below), ("/outside_above", above)])?;
        if let Some(hours) = self.hours
            && !hours.iter().all(|hour| (0.0..=24.0).contains(hour))
        {
            return Err(Error::input(place("/hours"), "must be two times of 0 to 24 h")
                .remedy("write [4, 22], or [22, 6] for a night"));
        }
        for date in self.dates.into_iter().flatten() {
            if month_and_day(date).is_none() {
                let problem = format!("{} is no day of the year", quoted(date));
                return Err(Error::input(place("/dates"), problem)
                    .remedy("write month and day: [\"10-01\", \"04-30\"]"));
            }
        }
        if self.outside_band.is_some() && below.is_none() && above.is_none() {
            let problem = "goes with `outside_below` or `outside_above` only";
            return Err(Error::input(place("/outside_band"), problem).remedy("leave it out"));
        }
        Ok(())
    }

    /// Returns whether `dates` include a day, given as month and day.
    pub fn includes(&self, day: (u32, u32)) -> bool {
        let Some([from, to]) = self.dates.map(|dates| dates.each_ref().map(|d| month_and_day(d)))
        else {
            return true;
        };
        let (from, to) = (from.unwrap_or_default(), to.unwrap_or_default());
        match from <= to {
            true => (from..=to).contains(&day),
            false => day >= from || day <= to,
        }
    }

    /// Returns the fraction of the time in which `hours` include the `length` h that begin at
    /// `start`, h since midnight.
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

/// Reads `10-01` as month and day.
fn month_and_day(text: &str) -> Option<(u32, u32)> {
    let (month, day) = text.split_once('-')?;
    let plain =
        |part: &str| (1..=2).contains(&part.len()) && part.bytes().all(|b| b.is_ascii_digit());
    if !plain(month) || !plain(day) {
        return None;
    }
    let (month, day) = (month.parse().ok()?, day.parse().ok()?);
    // a leap year has every day of a year
    Date::new(2024, month, day).map(|_| (month, day))
}

impl StateControl {
    /// Returns the conditions.
    pub fn when(&self) -> WhenKeys<'_> {
        WhenKeys {
            dates: self.dates.as_ref(),
            hours: self.hours,
            outside_below: self.outside_below,
            outside_above: self.outside_above,
            outside_band: self.outside_band.as_deref(),
            series: self.series.as_ref(),
        }
    }

    fn check(&self, place: &dyn Fn(&str) -> String) -> Result<()> {
        self.when().check(place)?;
        for pointer in self.changes.keys() {
            if !["/objects/", "/materials/"].iter().any(|start| pointer.starts_with(start)) {
                let problem = format!("{} is no place that a state may change", quoted(pointer));
                return Err(Error::input(place("/changes"), problem).remedy(
                    "name places in the scene's `objects` and `materials`, such as \
                     \"/objects/7/present\"; lamps have a control of their own",
                ));
            }
        }
        Ok(())
    }
}

impl LampControl {
    /// Returns the conditions that do not depend on the light inside.
    pub fn when(&self) -> WhenKeys<'_> {
        WhenKeys {
            dates: self.dates.as_ref(),
            hours: self.hours,
            outside_below: self.outside_below,
            outside_above: self.outside_above,
            outside_band: self.outside_band.as_deref(),
            series: None,
        }
    }

    fn check(&self, place: &dyn Fn(&str) -> String) -> Result<()> {
        check_numbers(
            place,
            &[
                ("/watts", self.watts),
                ("/below", self.below),
                ("/until_dli", self.until_dli),
                ("/fill_day", self.fill_day),
                ("/fill_to", self.fill_to),
            ],
        )?;
        self.when().check(place)?;
        if let Some(DimFile::Fraction(dim)) = self.dim
            && !(0.0..=1.0).contains(&dim)
        {
            let problem = format!("{}, must be 0 to 1", number(dim));
            return Err(Error::input(place("/dim"), problem).remedy("give a fraction of the power"));
        }
        if self.fill_to.is_some() && self.below.is_some() {
            let problem = "both `fill_to` and `below`";
            return Err(Error::input(place("/fill_to"), problem).remedy(
                "leave `below` out: `fill_to` needs no lamps where there is enough light",
            ));
        }
        self.check_fill_day(place)?;
        let keys = [self.below, self.until_dli, self.fill_day, self.fill_to];
        let about = keys.iter().any(Option::is_some);
        match (&self.of, about) {
            (None, true) => Err(Error::input(
                place(""),
                "`below`, `until_dli`, `fill_day` and `fill_to` need to know where",
            )
            .remedy("name a captor or a group as `of`")),
            (Some(_), false) => Err(Error::input(
                place("/of"),
                "goes with `below`, `until_dli`, `fill_day` or `fill_to` only",
            )
            .remedy("leave it out")),
            _ => Ok(()),
        }
    }

    /// Refuses keys beside `fill_day` that do not go with it, and its keys without it.
    fn check_fill_day(&self, place: &dyn Fn(&str) -> String) -> Result<()> {
        let wrong = |key: &str, problem: &str, remedy: &str| {
            Err(Error::input(place(key), problem).remedy(remedy))
        };
        let given = [("/prefer", self.prefer.is_some()), ("/prices", self.prices.is_some())];
        match self.fill_day {
            None => match given.iter().find(|(_, given)| *given) {
                Some((key, _)) => wrong(key, "goes with `fill_day` only", "leave it out"),
                None => Ok(()),
            },
            Some(_) if self.until_dli.is_some() => wrong(
                "/fill_day",
                "both `fill_day` and `until_dli`",
                "keep `fill_day`, which knows the day, or `until_dli`, which does not",
            ),
            Some(_) => match (self.prefer == Some(Prefer::Cheapest), &self.prices) {
                (true, None) => wrong(
                    "/prefer",
                    "the cheapest hours are not known",
                    "name a table of prices: \"prices\": {\"file\", \"column\"}",
                ),
                (false, Some(_)) => wrong(
                    "/prices",
                    "goes with \"prefer\": \"cheapest\" only",
                    "prefer the cheapest",
                ),
                _ => Ok(()),
            },
        }
    }

    /// Returns whether `lights` stands for the light of this name.
    pub fn names(&self, light: &str) -> bool {
        match self.lights.strip_suffix('*') {
            Some(start) => light.starts_with(start),
            None => light == self.lights,
        }
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
        let found: Vec<f64> =
            [3.0, 4.0, 5.0, 21.0, 22.0].map(|h| day.when().allowed(h, 1.0)).into();
        assert_eq!(found, [0.0, 0.5, 1.0, 1.0, 0.0]);
        let night = lamps([22.0, 6.0]);
        let found: Vec<f64> =
            [0.0, 5.0, 6.0, 21.0, 22.0, 23.0].map(|h| night.when().allowed(h, 1.0)).into();
        assert_eq!(found, [1.0, 1.0, 0.0, 0.0, 1.0, 1.0]);
        assert_eq!(lamps([0.0, 24.0]).when().allowed(23.0, 1.0), 1.0);
        assert_eq!(lamps([8.0, 8.0]).when().allowed(8.0, 1.0), 0.0);
        assert!(day.names("row 1a") && !day.names("row 2"));
    }

    /// Before entries with `until_dli` any number may fill up days, but behind them only some.
    #[test]
    fn few_days_are_filled_up_behind_others() {
        let file = |before: usize, behind: usize| {
            let fill = serde_json::json!({ "lights": "a", "fill_day": 12, "of": "a" });
            let mut lamps = vec![fill; before + behind];
            lamps.insert(before, serde_json::json!({ "lights": "b", "until_dli": 9, "of": "a" }));
            let file: ControlFile =
                serde_json::from_value(serde_json::json!({ "lamps": lamps })).unwrap();
            file.check_order("c.json").map_err(|error| error.to_string())
        };
        assert!(file(500, MOST_BEHIND).is_ok());
        let error = file(0, MOST_BEHIND + 1).unwrap_err();
        assert!(error.starts_with("c.json: /lamps/21/fill_day: more than 20 entries"), "{error}");
    }

    #[test]
    fn keys_of_a_day_go_together() {
        let file = |keys: serde_json::Value| {
            let mut lamps = serde_json::json!({ "lights": "a" });
            lamps.as_object_mut().unwrap().extend(keys.as_object().unwrap().clone());
            let lamps: LampControl = serde_json::from_value(lamps).unwrap();
            lamps.check(&|key| format!("c.json: {key}")).map_err(|error| error.to_string())
        };
        let prices = serde_json::json!({ "file": "p.csv", "column": "p" });
        let full = |prefer: &str| serde_json::json!({ "fill_day": 12, "of": "a", "prefer": prefer, "prices": prices });
        for keys in [
            serde_json::json!({ "fill_day": 12, "of": "a" }),
            serde_json::json!({ "fill_day": 12, "of": "a", "prefer": "latest" }),
            full("cheapest"),
        ] {
            assert!(file(keys.clone()).is_ok(), "{keys}");
        }
        for (keys, words) in [
            (serde_json::json!({ "fill_day": 12 }), "c.json: : `below`, `until_dli`, `fill_day`"),
            (serde_json::json!({ "fill_day": -1, "of": "a" }), "/fill_day: -1, must be 0 to 1e9"),
            (serde_json::json!({ "fill_day": 1, "until_dli": 1, "of": "a" }), "/fill_day: both"),
            (serde_json::json!({ "prefer": "latest" }), "/prefer: goes with `fill_day` only"),
            (full("darkest"), "/prices: goes with \"prefer\": \"cheapest\" only"),
            (
                serde_json::json!({ "fill_day": 12, "of": "a", "prefer": "cheapest" }),
                "/prefer: the cheapest hours are not known",
            ),
        ] {
            let error = file(keys).unwrap_err();
            assert!(error.contains(words), "{error}: {words}");
        }
    }

    #[test]
    fn dates_include_both_ends_and_may_pass_the_new_year() {
        let state = |dates: [&str; 2]| -> StateControl {
            let keys = serde_json::json!({ "name": "a", "changes": {}, "dates": dates });
            serde_json::from_value(keys).unwrap()
        };
        let summer = state(["05-15", "8-31"]);
        let days = [(5, 14), (5, 15), (7, 1), (8, 31), (9, 1)];
        let found = days.map(|day| summer.when().includes(day));
        assert_eq!(found, [false, true, true, true, false]);
        let winter = state(["10-01", "02-29"]);
        let days = [(9, 30), (10, 1), (12, 31), (1, 1), (2, 29), (3, 1)];
        let found = days.map(|day| winter.when().includes(day));
        assert_eq!(found, [false, true, true, true, true, false]);
        for wrong in ["", "1", "13-01", "02-30", "10-1-1", "+1-01", "a-b"] {
            assert!(month_and_day(wrong).is_none(), "{wrong}");
        }
    }
}
