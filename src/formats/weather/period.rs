//! Selects the hours of a weather file for an instant or a period.

use super::record::{Clock, DAY, HOUR, Record, Site, Weather, YEAR};
use crate::{
    error::{Error, Result},
    scene::daylight::{Date, Hour, SunPosition, Timestamp, eccentricity},
};

/// The time that a weather file is used for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Period {
    /// An instant.
    Instant(Timestamp),
    /// A span of time, without its end.
    Span {
        /// Start of the span.
        from: Timestamp,
        /// End of the span, later than its start.
        to: Timestamp,
    },
    /// All hours of the file, which must cover a year.
    Year,
}

/// An hour of a period, or another interval if the file's records are shorter; dark ones are
/// included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slot {
    /// Start of the interval, in the standard time of the file.
    pub start: Timestamp,
    /// Length of the part within the period, h.
    pub length: f64,
    /// Global irradiance, W/m2: the value in the file, or else the sum of direct and diffuse light.
    pub global: f64,
    /// Index into [`Selected::hours`]; `None` if the interval is dark.
    pub hour: Option<usize>,
}

/// The hours of a period.
#[derive(Clone, Debug, Default)]
pub struct Selected {
    /// The hours that are not dark.
    pub hours: Vec<Hour>,
    /// All intervals in order, including the dark ones; empty for an instant.
    pub slots: Vec<Slot>,
    /// Length of the period, h; 0 for an instant.
    pub length: f64,
    /// Direct normal irradiation, Wh/m2, of hours in which the sun is below the horizon, which is
    /// left out. For an instant, the irradiance, W/m2.
    pub dropped_direct: f64,
    /// Number of records whose direct and diffuse irradiance were estimated from global irradiance.
    pub estimated: usize,
}

impl Selected {
    /// Returns warnings about light that was left out or estimated.
    pub fn warnings(&self) -> Vec<String> {
        let mut found = Vec::new();
        if self.dropped_direct > 0.0 {
            let unit = if self.length > 0.0 { "Wh/m2" } else { "W/m2" };
            let dropped = self.dropped_direct;
            found.push(format!(
                "{dropped:.1} {unit} of direct light while the sun is below the horizon are left out"
            ));
        }
        if self.estimated > 0 {
            let hours = self.estimated;
            found.push(format!(
                "direct and diffuse light of {hours} records are estimated from the global by Erbs, Klein and \
                 Duffie (1982): single hours may be far off"
            ));
        }
        found
    }
}

impl Weather {
    /// Selects the hours of `period`, seen from `site`, with the file's clock moved `shift_h` hours
    /// forward.
    ///
    /// For an instant, the position of the sun is that of the instant. For a record it is that of
    /// the middle of the record, or of the middle of its sunlit part where the sun rises or sets in
    /// it. A record that lies in the period in part counts by that part. Hours in which the sun
    /// does not rise may be missing. The years in the rows of a typical year matter only for the
    /// position of the sun.
    ///
    /// # Errors
    /// At the file: needed hours are missing (the error names the first ones and their number); a
    /// period ends before it starts or is longer than a year; or, for `Year`, a CSV file does not
    /// cover a year. At `path:LINE`: the first needed row without irradiances.
    pub fn select(&self, period: Period, site: Site, shift_h: f64) -> Result<Selected> {
        let shift = shift_h * HOUR;
        let mut selected = Selected::default();
        let Some((from, length)) = self.span(period)? else {
            let Period::Instant(time) = period else { return Ok(selected) };
            let at = self.instant(time) - shift;
            let at = if self.wraps() { at.rem_euclid(YEAR) } else { at };
            let record = self.records.iter().find(|r| r.from <= at && at < r.to);
            let sun =
                SunPosition::at(time, site.latitude.to_radians(), site.longitude.to_radians());
            if record.is_none() && sun.elevation > 0.0 {
                return Err(self.missing(&[at], 1));
            }
            if let Some(record) = record
                && !selected.add(record, sun, time.date(), 1.0, 1.0)
            {
                return Err(self.lacking(record.line, 1));
            }
            return Ok(selected);
        };
        selected.length = length / HOUR;
        let (mut gaps, mut lacking) = (Vec::new(), Vec::new());
        let mut slots: Vec<(f64, Slot)> = Vec::new();
        let mut covered = 0.0;
        // a period may extend beyond the end of a typical year
        let turns: &[f64] = if self.wraps() { &[-YEAR, 0.0, YEAR] } else { &[0.0] };
        let mut parts: Vec<(f64, f64, &Record)> = Vec::new();
        for turn in turns {
            for record in &self.records {
                let start = (record.from + turn).max(from - shift);
                let end = (record.to + turn).min(from - shift + length);
                if end > start {
                    parts.push((start, end, record));
                }
            }
        }
        parts.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut at = from - shift;
        for (start, end, record) in &parts {
            if *start > at + 1.0 {
                gaps.push((at, *start));
            }
            at = at.max(*end);
            covered += end - start;
            let lit = selected.hours.len();
            let date = Timestamp { unix: record.start.unix + shift, ..record.start }.date();
            let sun = site.sunlit(record, shift);
            let weight = (end - start) / length;
            if !selected.add(record, sun, date, weight, (end - start) / HOUR) {
                lacking.push(record.line);
            }
            // `late` is right in a typical year that begins anew, too
            let late = (start - record.from).rem_euclid(YEAR);
            let hour = (selected.hours.len() > lit).then_some(lit);
            let global = hour.map_or(0.0, |h| selected.hours[h].global());
            let slot = Slot {
                start: Timestamp { unix: record.start.unix + late, ..record.start },
                length: (end - start) / HOUR,
                global: record.global.unwrap_or(global).max(0.0),
                hour,
            };
            slots.push((*start, slot));
        }
        let end = from - shift + length;
        if end > at + 1.0 {
            gaps.push((at, end));
        }
        if covered == 0.0 {
            return Err(self.missing(&[from - shift], (length / HOUR).ceil() as usize));
        }
        let dark = |at: f64| site.sun(self.timestamp(at + 0.5 * HOUR), shift).elevation < -0.1;
        let hours = gaps.iter().flat_map(|&(from, to)| {
            (0..).map(move |i| from + f64::from(i) * HOUR).take_while(move |&at| at < to - 1.0)
        });
        let offset = parts[0].2.start.offset;
        slots.extend(gaps.iter().flat_map(|&(from, to)| {
            let slot = move |i: i32| {
                let at = from + f64::from(i) * HOUR;
                let start = Timestamp { offset, ..self.timestamp(at) };
                (at, Slot { start, length: (to - at).min(HOUR) / HOUR, global: 0.0, hour: None })
            };
            (0..).map(slot).take_while(move |(at, _)| *at < to - 1.0)
        }));
        slots.sort_by(|a, b| a.0.total_cmp(&b.0));
        selected.slots = slots.into_iter().map(|(_, slot)| slot).collect();
        let hours: Vec<f64> = hours.filter(|&at| !dark(at)).collect();
        if !hours.is_empty() {
            return Err(self.missing(&hours[..hours.len().min(3)], hours.len()));
        }
        match lacking.first() {
            Some(&line) => Err(self.lacking(line, lacking.len())),
            None => Ok(selected),
        }
    }

    /// Returns start and length of a period on the file's clock, s; `None` for an instant.
    fn span(&self, period: Period) -> Result<Option<(f64, f64)>> {
        let whole = |problem: &str| {
            Err(Error::input(self.path.display(), problem)
                .remedy("give a period: \"time\": {\"from\": ..., \"to\": ...}"))
        };
        match (period, self.clock) {
            (Period::Instant(_), _) => Ok(None),
            (Period::Year, Clock::TypicalYear { .. }) => Ok(Some((0.0, YEAR))),
            (Period::Year, Clock::Unix) => {
                let from = self.records.first().map_or(0.0, |r| r.from);
                let to = self.records.last().map_or(0.0, |r| r.to);
                match ((to - from) / DAY - 365.5).abs() <= 1.5 {
                    true => Ok(Some((from, to - from))),
                    false => whole(&format!("covers {:.1} days, not a year", (to - from) / DAY)),
                }
            }
            (Period::Span { from, to }, _) => {
                let length = to.unix - from.unix;
                if length <= 0.0 {
                    return whole("the period ends before it starts");
                }
                if length > YEAR + 1.5 * DAY {
                    return whole("the period is longer than a year");
                }
                let (start, end) = (self.at(from), self.at(to));
                // a typical year has no leap day
                let length = match self.wraps() {
                    true if length >= YEAR => YEAR,
                    true => (end - start).rem_euclid(YEAR),
                    false => length,
                };
                match length > 0.0 {
                    true => Ok(Some((start, length))),
                    false => {
                        whole("the period lies within 29 February, which a typical year has not")
                    }
                }
            }
        }
    }

    fn wraps(&self) -> bool {
        matches!(self.clock, Clock::TypicalYear { .. })
    }

    /// Converts a time to the file's clock, s. In a typical year, all of 29 February becomes the
    /// end of 28 February.
    fn at(&self, time: Timestamp) -> f64 {
        match self.clock {
            Clock::Unix => time.unix,
            Clock::TypicalYear { zone } => {
                let (date, clock) = local(time, zone);
                match (date.month, date.day) {
                    (2, 29) => day_of_typical_year(Date { month: 3, day: 1, ..date }),
                    _ => day_of_typical_year(date) + clock,
                }
            }
        }
    }

    /// Like [`at`](Self::at), for an instant: on 29 February it takes the weather of 28 February in
    /// a typical year.
    fn instant(&self, time: Timestamp) -> f64 {
        match self.clock {
            Clock::TypicalYear { zone }
                if matches!(local(time, zone).0, Date { month: 2, day: 29, .. }) =>
            {
                self.at(Timestamp { unix: time.unix - DAY, ..time })
            }
            _ => self.at(time),
        }
    }

    /// Converts a time on the file's clock to a real time, which is in 2001 for a typical year.
    fn timestamp(&self, at: f64) -> Timestamp {
        match self.clock {
            Clock::Unix => Timestamp { unix: at, offset: 0.0 },
            Clock::TypicalYear { zone } => {
                let first = Date { year: 2001, month: 1, day: 1 }.days() as f64 * DAY;
                Timestamp { unix: first + at.rem_euclid(YEAR) - zone, offset: zone }
            }
        }
    }

    fn missing(&self, first: &[f64], count: usize) -> Error {
        let names: Vec<String> = first.iter().map(|&at| self.name(at)).collect();
        let more = if count > first.len() { ", ..." } else { "" };
        let hours = if count == 1 { "hour is" } else { "hours are" };
        let problem = format!("{count} needed {hours} missing: {}{more}", names.join(", "));
        Error::input(self.path.display(), problem).remedy("choose another time, or mend the file")
    }

    fn lacking(&self, line: u64, count: usize) -> Error {
        let rows = if count == 1 { "row lacks" } else { "rows lack" };
        let problem = format!("{count} needed {rows} irradiances, this the first");
        Error::input(format_args!("{}:{line}", self.path.display()), problem)
            .remedy("choose another time, or mend the file")
    }

    /// Returns a readable name of the hour that starts at a time on the file's clock.
    fn name(&self, at: f64) -> String {
        let time = self.timestamp(at);
        let local = time.unix + time.offset;
        let date = Date::from_days((local / DAY).floor() as i64);
        let minutes = (local.rem_euclid(DAY) / 60.0).floor() as u32;
        let clock = format!("{:02}:{:02}", minutes / 60, minutes % 60);
        let Date { year, month, day } = date;
        match self.clock {
            Clock::Unix => format!("{year}-{month:02}-{day:02}T{clock}Z"),
            Clock::TypicalYear { .. } => format!("{month:02}-{day:02} {clock}"),
        }
    }
}

/// Returns the day and the seconds since midnight on a clock `zone` seconds ahead of UTC.
fn local(time: Timestamp, zone: f64) -> (Date, f64) {
    let local = time.unix + zone;
    (Date::from_days((local / DAY).floor() as i64), local.rem_euclid(DAY))
}

/// Returns the start of a day (not 29 February) of a typical year, s.
fn day_of_typical_year(date: Date) -> f64 {
    (Date { year: 2001, ..date }.day_of_year() - 1) as f64 * DAY
}

impl Site {
    /// Returns the position of the sun in the middle of a record, or in the middle of its sunlit
    /// part.
    fn sunlit(self, record: &Record, shift: f64) -> SunPosition {
        let length = record.to - record.from;
        let up = |later: f64| self.sun(record.start, shift + later).elevation > 0.0;
        let middle = match (up(0.0), up(length)) {
            (false, true) => 0.5 * (crossing(up, length, 0.0) + length),
            (true, false) => 0.5 * crossing(up, 0.0, length),
            _ => 0.5 * length,
        };
        self.sun(record.start, shift + middle)
    }
}

/// Returns the time, s, at which `is` changes between `yes`, where it holds, and `no`, where it
/// does not, to within a second.
fn crossing(is: impl Fn(f64) -> bool, mut yes: f64, mut no: f64) -> f64 {
    while (yes - no).abs() > 1.0 {
        let middle = 0.5 * (yes + no);
        *(if is(middle) { &mut yes } else { &mut no }) = middle;
    }
    yes
}

impl Selected {
    /// Adds a record that counts for this many hours. Returns false if the record lacks a value
    /// that is needed.
    fn add(
        &mut self,
        record: &Record,
        sun: SunPosition,
        date: Date,
        weight: f64,
        hours: f64,
    ) -> bool {
        let up = sun.elevation > 0.0;
        let eccentricity = eccentricity(date);
        let (mut direct, diffuse) = match (record.direct, record.diffuse, record.global) {
            (Some(direct), Some(diffuse), _) => (direct, diffuse),
            (_, _, Some(global)) => {
                self.estimated += usize::from(global > 0.0);
                erbs(global, sun.elevation.sin(), eccentricity)
            }
            // measurements may be missing at night
            _ if sun.elevation < -0.1 => (0.0, 0.0),
            _ => return false,
        };
        if !up {
            self.dropped_direct += direct * hours;
            direct = 0.0;
        }
        if direct > 0.0 || diffuse > 0.0 {
            self.hours.push(Hour {
                weight,
                sun,
                eccentricity,
                direct_normal: direct,
                diffuse_horizontal: diffuse,
            });
        }
        true
    }
}

/// Splits global irradiance into direct normal and diffuse horizontal irradiance, W/m2 (Erbs,
/// Klein, Duffie, Solar Energy 28:293, 1982). While the sun is less than 3 degrees above the
/// horizon, all of it is diffuse.
fn erbs(global: f64, sine: f64, eccentricity: f64) -> (f64, f64) {
    if sine < 3f64.to_radians().sin() {
        return (0.0, global);
    }
    let outside = 1367.0 * eccentricity;
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
            let global = clearness * 1367.0 * 0.5;
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
}
