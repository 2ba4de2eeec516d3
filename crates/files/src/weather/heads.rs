//! Heads of tables: who made them, and what they say about place, clock and units.

use std::path::Path;

use super::{
    cells::Line,
    record::{HOUR, Site, Stamp},
};
use crate::input::quoted;
use phylux_core::error::{Error, Result};

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Column {
    Global,
    Direct,
    Diffuse,
    /// Direct irradiance of a horizontal plane.
    Beam,
}

/// Names of the columns of irradiance, in small letters, without units.
pub(super) const NAMES: [(Column, &[&str]); 4] = [
    (Column::Global, &["ghi", "g(h)", "g(i)", "shortwave_radiation", "allsky_sfc_sw_dwn"]),
    (Column::Direct, &["dni", "gb(n)", "direct_normal_irradiance", "allsky_sfc_sw_dni"]),
    (Column::Diffuse, &["dhi", "gd(h)", "gd(i)", "diffuse_radiation", "allsky_sfc_sw_diff"]),
    (Column::Beam, &["gb(i)", "direct_radiation"]),
];

/// Who made a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Source {
    Plain,
    OpenMeteo,
    Nsrdb,
    Pvgis,
    Power,
}

/// What the head of a table says.
pub(super) struct Head<'a, 'b> {
    pub(super) source: Source,
    pub(super) names: &'b Line<'a>,
    pub(super) rows: &'b [Line<'a>],
    pub(super) site: Option<Site>,
    /// How far the clock of the rows is ahead of UTC, s.
    pub(super) zone: f64,
    /// How much later than its time a row was measured, s.
    pub(super) late: f64,
    pub(super) stamp: Option<Stamp>,
    /// Whether it is known to be a typical year.
    pub(super) typical: bool,
    /// Units of the columns, where they do not stand in the names.
    pub(super) units: Vec<(String, String)>,
}

/// Splits the name of a column from a unit behind it; the name is in small letters.
pub(super) fn name_and_unit(whole: &str) -> (String, Option<&str>) {
    let at = whole.find(" (").or(whole.find('['));
    let (name, unit) = match at {
        Some(at) => (&whole[..at], Some(whole[at..].trim_matches([' ', '(', ')', '[', ']']))),
        None => (whole, None),
    };
    (name.trim().to_ascii_lowercase(), unit)
}

/// Returns whether a column of this name holds irradiance.
fn is_irradiance(whole: &str) -> bool {
    let (name, _) = name_and_unit(whole);
    NAMES.iter().any(|(_, names)| names.contains(&name.as_str()))
}

/// Returns the first number after a word, whatever the case of its letters.
pub(super) fn number_after(text: &str, word: &str) -> Option<f64> {
    let at = text.to_ascii_lowercase().find(word)? + word.len();
    let rest =
        text[at..].trim_start_matches(|c: char| !(c.is_ascii_digit() || c == '-' || c == '.'));
    let end = rest.find(|c: char| !(c.is_ascii_digit() || "-.eE+".contains(c)));
    rest[..end.unwrap_or(rest.len())].parse().ok().filter(|x: &f64| x.is_finite())
}

/// Reads the head of a table.
pub(super) fn head<'a, 'b>(path: &Path, lines: &'b [Line<'a>]) -> Result<Head<'a, 'b>> {
    let first = &lines[0];
    let has = |name: &str| first.values.iter().any(|v| v.eq_ignore_ascii_case(name));
    if has("utc_offset_seconds") {
        open_meteo(first, lines)
    } else if ["Time Zone", "Latitude", "Longitude"].iter().all(|name| has(name)) {
        nsrdb(first, lines)
    } else if first.whole.trim_start().starts_with("Latitude (decimal degrees)") {
        pvgis(path, lines)
    } else if first.whole.contains("BEGIN HEADER") {
        power(path, lines)
    } else {
        let (source, stamp, site) = (Source::Plain, None, None);
        let (names, rows) = (first, &lines[1..]);
        let (zone, late, typical, units) = (0.0, 0.0, false, Vec::new());
        Ok(Head { source, names, rows, site, zone, late, stamp, typical, units })
    }
}

/// The head of Open-Meteo: names and values of the place, then tables that each begin with a line
/// of names. Radiation is the mean of the interval before its time.
fn open_meteo<'a, 'b>(first: &Line, lines: &'b [Line<'a>]) -> Result<Head<'a, 'b>> {
    let begins = |line: &Line| line.values.contains(&"time");
    let tables: Vec<usize> = (0..lines.len()).filter(|&i| begins(&lines[i])).collect();
    let Some((&start, values)) = tables.first().zip(lines.get(1)) else {
        return Err(first.error("no column `time` below it").remedy("fetch the file again"));
    };
    if start != 2 {
        return Err(first
            .error(format!("{} places", start.saturating_sub(1)))
            .remedy("fetch a file of one place"));
    }
    let at = |name: &str| {
        let found = first.values.iter().position(|v| v.eq_ignore_ascii_case(name));
        found.ok_or_else(|| first.error(format!("no column `{name}`")).remedy("fetch it again"))
    };
    values.count(0..=first.values.len())?;
    let site = values.site(at("latitude")?, at("longitude")?)?;
    let zone = values.number(at("utc_offset_seconds")?, "the offset from UTC")?;
    if zone.abs() > 14.0 * HOUR {
        return Err(values
            .error(format!("the offset from UTC is {zone} s"))
            .remedy("fetch it again"));
    }
    // of hourly and daily tables, the first that holds radiation
    let radiates = |&i: &usize| lines[i].values.iter().any(|name| is_irradiance(name));
    let start = tables.iter().copied().find(radiates).unwrap_or(start);
    let end = tables.iter().copied().find(|&i| i > start).unwrap_or(lines.len());
    Ok(Head {
        source: Source::OpenMeteo,
        names: &lines[start],
        rows: &lines[start + 1..end],
        site: Some(site),
        zone,
        late: 0.0,
        stamp: Some(Stamp::End),
        typical: false,
        units: Vec::new(),
    })
}

/// The head of NSRDB: names and values of the place, clock and units. Values are those of the
/// instant.
fn nsrdb<'a, 'b>(first: &Line, lines: &'b [Line<'a>]) -> Result<Head<'a, 'b>> {
    let (Some(values), Some(names)) = (lines.get(1), lines.get(2)) else {
        return Err(first.error("nothing stands below it").remedy("fetch the file again"));
    };
    // the head is known by these names
    let at =
        |name: &str| first.values.iter().position(|v| v.eq_ignore_ascii_case(name)).unwrap_or(0);
    let units = first.values.iter().zip(&values.values).filter_map(|(name, value)| {
        Some((name.strip_suffix(" Units")?.to_owned(), (*value).to_owned()))
    });
    values.count(0..=first.values.len())?;
    let minutes = names.values.iter().any(|name| name.eq_ignore_ascii_case("Minute"));
    Ok(Head {
        source: Source::Nsrdb,
        names,
        rows: &lines[3..],
        site: Some(values.site(at("Latitude"), at("Longitude"))?),
        zone: values.zone(at("Time Zone"))?,
        late: 0.0,
        stamp: Some(if minutes { Stamp::Middle } else { Stamp::Start }),
        typical: false,
        units: units.collect(),
    })
}

/// The head of PVGIS: lines `name: value`, in a typical year the years of its months, and a line of
/// names that begins with `time`. Below the rows stand explanations. Values are those of the
/// instant, UTC.
fn pvgis<'a, 'b>(path: &Path, lines: &'b [Line<'a>]) -> Result<Head<'a, 'b>> {
    let begins = |line: &Line| line.values[0].to_ascii_lowercase().starts_with("time");
    let Some(start) = lines.iter().position(begins) else {
        return Err(Error::input(path.display(), "PVGIS without a line that begins with `time`")
            .remedy("fetch the file again"));
    };
    let (top, names) = (&lines[..start], &lines[start]);
    let key = |wanted: &str| top.iter().find(|l| l.whole.trim_start().starts_with(wanted));
    let number = |wanted: &str| key(wanted).and_then(|l| number_after(l.whole, ":"));
    let (Some(latitude), Some(longitude)) = (number("Latitude"), number("Longitude")) else {
        return Err(lines[0].error("latitude or longitude is missing").remedy("fetch it again"));
    };
    let said = names.values[0].to_ascii_lowercase();
    if !matches!(said.as_str(), "time" | "time(utc)") {
        return Err(names
            .error(format!("{} is not UTC", quoted(names.values[0])))
            .remedy("fetch it in UTC"));
    }
    let late = number("Irradiance Time Offset").unwrap_or(0.0);
    if late.abs() > 12.0 {
        return Err(lines[0]
            .error(format!("irradiance is {late} h late"))
            .remedy("fetch it again"));
    }
    let slope = key("Slope").and_then(|l| l.whole.split_once(':'));
    let begins_with_digit = |l: &Line| l.values[0].starts_with(|c: char| c.is_ascii_digit());
    let rows = &lines[start + 1..];
    let end = rows.iter().rposition(begins_with_digit).map_or(0, |last| last + 1);
    Ok(Head {
        source: Source::Pvgis,
        names,
        rows: &rows[..end],
        site: Some(lines[0].checked(Site { latitude, longitude })?),
        zone: 0.0,
        late: late * HOUR,
        stamp: Some(Stamp::Middle),
        typical: key("month,year").is_some(),
        units: slope
            .map(|(_, value)| ("slope".to_owned(), value.trim().to_owned()))
            .into_iter()
            .collect(),
    })
}

/// The head of NASA POWER: lines between `-BEGIN HEADER-` and `-END HEADER-`. A row is the mean of
/// the hour that begins; local solar time is that of a zone of 15 degrees.
fn power<'a, 'b>(path: &Path, lines: &'b [Line<'a>]) -> Result<Head<'a, 'b>> {
    let end = lines.iter().position(|l| l.whole.contains("END HEADER"));
    let Some((end, names)) = end.and_then(|end| Some((end, lines.get(end + 1)?))) else {
        return Err(Error::input(path.display(), "its head has no end `-END HEADER-`")
            .remedy("fetch the file again"));
    };
    let top = &lines[..end];
    let line_with = |word: &str| top.iter().find(|l| l.whole.to_ascii_lowercase().contains(word));
    let place = line_with("latitude").unwrap_or(&lines[0]);
    let [latitude, longitude] =
        ["latitude", "longitude"].map(|word| number_after(place.whole, word));
    let (Some(latitude), Some(longitude)) = (latitude, longitude) else {
        return Err(place.error("latitude or longitude is missing").remedy("fetch the file again"));
    };
    let site = place.checked(Site { latitude, longitude })?;
    let dates = line_with("dates (").unwrap_or(&lines[0]);
    let zone = match dates
        .whole
        .split_whitespace()
        .next_back()
        .map(|word| word.trim_matches([',', '"']))
    {
        Some("UTC") => 0.0,
        Some("LST") => (longitude / 15.0).round() * HOUR,
        _ => {
            return Err(dates
                .error("says neither `in UTC` nor `in LST`")
                .remedy("fetch it again with the time standard UTC"));
        }
    };
    let units = top.iter().filter_map(|line| {
        let (name, rest) = line.whole.trim().split_once(char::is_whitespace)?;
        let unit = rest.rsplit_once('(')?.1.split_once(')')?.0;
        Some((name.to_owned(), unit.to_owned()))
    });
    Ok(Head {
        source: Source::Power,
        names,
        rows: &lines[end + 2..],
        site: Some(site),
        zone,
        late: 0.0,
        stamp: Some(Stamp::Start),
        typical: false,
        units: units.collect(),
    })
}
