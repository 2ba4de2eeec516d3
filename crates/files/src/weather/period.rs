//! Selects the hours of a weather file for an instant or a period.

use super::{
    calendar::Calendar,
    record::{Clock, DAY, HOUR, Record, Site, Weather, YEAR},
    split::{OwnSun, Split},
};
use phylux_core::{
    error::{Error, Result},
    scene::daylight::{Date, Hour, SunCourse, SunPosition, Timestamp},
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
    /// Start of the interval by the mended clock, in the standard time of the file. In a typical year
    /// its year is that of the rows of its month.
    pub start: Timestamp,
    /// Length of the part within the period, h.
    pub length: f64,
    /// How long of that the sun is above the horizon, h.
    pub sun_up: f64,
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
    /// Number of records whose global irradiance is not that of their direct and diffuse light.
    pub misfits: usize,
    /// The worst of them: its line, and its global irradiance as measured and as that sum, W/m2.
    pub worst_misfit: Option<(u64, [f64; 2])>,
}

/// The least direct light that a warning is about: less is written as 0.0 and comes from rounding.
const TOLD: f64 = 0.05;

impl Selected {
    /// Returns warnings about light that was left out or estimated.
    pub fn warnings(&self) -> Vec<String> {
        let mut found = Vec::new();
        if self.dropped_direct >= TOLD {
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
                 Duffie (1982): single hours may be far off (docs/coming-from/weather.md#your-own-sensors)"
            ));
        }
        if let Some((line, [global, sum])) = self.worst_misfit {
            let records = self.misfits;
            let plural = if records == 1 { "" } else { "s" };
            found.push(format!(
                "the global irradiance of {records} record{plural} is not that of direct and diffuse light, the worst in \
                 line {line}: {global:.1} W/m2, not {sum:.1}; mend the clock or a column (docs/scene-format.md#daylight)"
            ));
        }
        found
    }
}

impl Weather {
    /// Selects the hours of `period`, seen from `site`, with the file's clock moved `shift_h` hours
    /// forward: the times of the slots are those of the mended clock.
    ///
    /// For an instant, the position of the sun is that of the instant. For a record the sun moves
    /// through it or, where it rises or sets in it, through the part in which it is up. A record that
    /// lies in the period in part counts by that part. Hours in which the sun does not rise may be
    /// missing. The years in the rows of a typical year matter only for the
    /// position of the sun. Its rows of 29 February count where the period meets that day, and in
    /// `Year`; without such rows the day is left out of periods, and an instant takes 28 February.
    ///
    /// Where direct or diffuse light was not measured, it follows from the global and the other one
    /// with the record's own sun; both are estimated only where the global is all there is.
    ///
    /// # Errors
    /// At the file: needed hours are missing (the error names the first ones and their number); a
    /// period ends before it starts or is longer than a year; or, for `Year`, a CSV file does not
    /// cover a year. At `path:LINE`: the first needed row without irradiances.
    pub fn select(&self, period: Period, site: Site, shift_h: f64) -> Result<Selected> {
        let shift = shift_h * HOUR;
        let mut selected = Selected::default();
        let calendar = self.calendar(period);
        let placed: Vec<Record> = self.records.iter().filter_map(|r| calendar.place(r)).collect();
        let Some((from, length)) = self.span(period, calendar, shift)? else {
            let Period::Instant(time) = period else { return Ok(selected) };
            return self.select_instant(time, &placed, calendar, site, shift);
        };
        selected.length = length / HOUR;
        let (mut gaps, mut lacking) = (Vec::new(), Vec::new());
        let mut slots: Vec<(f64, Slot)> = Vec::new();
        let mut covered = 0.0;
        let parts = parts(&placed, calendar, from - shift, length);
        let years = self.years();
        let time = |at: f64, offset: f64| calendar.mended(at + shift, offset, &years);
        let mut at = from - shift;
        for (start, end, record) in &parts {
            if *start > at + 1.0 {
                gaps.push((at, *start));
            }
            at = at.max(*end);
            covered += end - start;
            let lit = selected.hours.len();
            let own = site.own_sun(record, shift);
            let weight = (end - start) / length;
            if !selected.add(record, own, (own.at, own.course), weight, (end - start) / HOUR) {
                lacking.push(record.line);
            }
            let hour = (selected.hours.len() > lit).then_some(lit);
            let global = hour.map_or(0.0, |h| selected.hours[h].global());
            let slot = Slot {
                start: time(*start, record.start.offset),
                length: (end - start) / HOUR,
                sun_up: own.lit * (end - start) / HOUR,
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
            return Err(self.missing(calendar, &[from - shift], (length / HOUR).ceil() as usize));
        }
        let dark = |at: f64| site.sun(calendar.timestamp(at + 0.5 * HOUR), shift).elevation < -0.1;
        let hours = gaps.iter().flat_map(|&(from, to)| {
            (0..).map(move |i| from + f64::from(i) * HOUR).take_while(move |&at| at < to - 1.0)
        });
        let offset = parts[0].2.start.offset;
        slots.extend(gaps.iter().flat_map(|&(from, to)| {
            let time = &time;
            let slot = move |i: i32| {
                let at = from + f64::from(i) * HOUR;
                let (start, length) = (time(at, offset), (to - at).min(HOUR) / HOUR);
                (at, Slot { start, length, sun_up: 0.0, global: 0.0, hour: None })
            };
            (0..).map(slot).take_while(move |(at, _)| *at < to - 1.0)
        }));
        slots.sort_by(|a, b| a.0.total_cmp(&b.0));
        selected.slots = slots.into_iter().map(|(_, slot)| slot).collect();
        let hours: Vec<f64> = hours.filter(|&at| !dark(at)).collect();
        if !hours.is_empty() {
            return Err(self.missing(calendar, &hours[..hours.len().min(3)], hours.len()));
        }
        match lacking.first() {
            Some(&line) => Err(self.lacking(line, lacking.len())),
            None => Ok(selected),
        }
    }

    /// Returns the hour that holds an instant.
    fn select_instant(
        &self,
        time: Timestamp,
        placed: &[Record],
        calendar: Calendar,
        site: Site,
        shift: f64,
    ) -> Result<Selected> {
        let mut selected = Selected::default();
        let at = calendar.wrapped(calendar.instant(time) - shift);
        // a record may begin in the year before
        let holds = |r: &&Record| {
            let late = calendar.wrapped(at - r.from);
            0.0 <= late && late < r.length()
        };
        let record = placed.iter().find(holds);
        let sun = SunPosition::at(time, site.latitude.to_radians(), site.longitude.to_radians());
        if record.is_none() && sun.elevation > 0.0 {
            return Err(self.missing(calendar, &[at], 1));
        }
        if let Some(record) = record {
            let course = (sun.elevation > 0.0).then(|| SunCourse::still(sun));
            let own = site.own_sun(record, shift);
            if !selected.add(record, own, (sun, course), 1.0, 1.0) {
                return Err(self.lacking(record.line, 1));
            }
        }
        Ok(selected)
    }

    /// Returns start and length of a period on the file's clock moved by `shift`, s; `None` for an
    /// instant.
    fn span(&self, period: Period, calendar: Calendar, shift: f64) -> Result<Option<(f64, f64)>> {
        let whole = |problem: &str| {
            Err(Error::input(self.path.display(), problem)
                .remedy("give a period: \"time\": {\"from\": ..., \"to\": ...}"))
        };
        match (period, self.clock) {
            (Period::Instant(_), _) => Ok(None),
            (Period::Year, Clock::TypicalYear { .. }) => Ok(Some((0.0, calendar.year()))),
            (Period::Year, Clock::Unix) => {
                let from = self.records.first().map_or(0.0, |r| r.from);
                let to = self.records.last().map_or(0.0, |r| r.to);
                match ((to - from) / DAY - 365.5).abs() <= 1.5 {
                    true => Ok(Some((from + shift, to - from))),
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
                let (start, end) = (calendar.at(from), calendar.at(to));
                // a typical year may have no leap day
                let length = match calendar.wraps() {
                    true if length >= calendar.year() => calendar.year(),
                    true => (end - start).rem_euclid(calendar.year()),
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

    /// Returns the file's clock for a period. A typical year has a leap day if the file has rows of
    /// it and the period meets it.
    fn calendar(&self, period: Period) -> Calendar {
        let all = Calendar { clock: self.clock, leap: true };
        let has = self.records.iter().any(|r| all.is_leap_day(r));
        let leap = match period {
            Period::Year => true,
            Period::Instant(time) => all.meets_leap_day(time, time),
            Period::Span { from, to } => all.meets_leap_day(from, to),
        };
        Calendar { clock: self.clock, leap: has && leap }
    }

    /// Returns for each month of a typical year, from January on, the year of its rows: that of most of
    /// them, where a row of another month begins in it. `None` without rows.
    fn years(&self) -> [Option<i64>; 12] {
        let mut years: [Vec<i64>; 12] = Default::default();
        for record in &self.records {
            let middle = record.start.unix + 0.5 * record.length() + record.start.offset;
            let date = Date::from_days((middle / DAY).floor() as i64);
            years[date.month as usize - 1].push(date.year);
        }
        years.map(|mut years| {
            years.sort_unstable();
            years.get(years.len() / 2).copied()
        })
    }

    fn missing(&self, calendar: Calendar, first: &[f64], count: usize) -> Error {
        let names: Vec<String> = first.iter().map(|&at| calendar.name(at)).collect();
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
}

impl Selected {
    /// Adds a record that counts for this many hours, whose sun is `own` but shines from `at`, where it
    /// stands in the middle and in its course, if it is up. Returns false if the record lacks a value
    /// that is needed.
    fn add(
        &mut self,
        record: &Record,
        own: OwnSun,
        at: (SunPosition, Option<SunCourse>),
        weight: f64,
        hours: f64,
    ) -> bool {
        let Some(split) = record.split(own) else { return false };
        let Split { mut direct, diffuse, estimated, misfit } = split;
        self.estimated += usize::from(estimated);
        if let Some([global, sum]) = misfit {
            self.misfits += 1;
            let off = |[a, b]: [f64; 2]| (a - b).abs();
            if self.worst_misfit.is_none_or(|(_, worst)| off(worst) < off([global, sum])) {
                self.worst_misfit = Some((record.line, [global, sum]));
            }
        }
        let (sun, course) = at;
        if course.is_none() {
            self.dropped_direct += direct * hours;
            direct = 0.0;
        }
        if direct > 0.0 || diffuse > 0.0 {
            self.hours.push(Hour {
                weight,
                sun,
                course: course.unwrap_or(SunCourse::still(sun)),
                eccentricity: own.eccentricity,
                direct_normal: direct,
                diffuse_horizontal: diffuse,
            });
        }
        true
    }
}

/// Returns the parts of records in a period of some length from an instant on, s, in order. A period may
/// extend beyond the end of a typical year.
fn parts(
    placed: &[Record],
    calendar: Calendar,
    from: f64,
    length: f64,
) -> Vec<(f64, f64, &Record)> {
    let year = calendar.year();
    let turns = if calendar.wraps() { vec![-year, 0.0, year] } else { vec![0.0] };
    let of_turn = |turn: f64| {
        placed.iter().filter_map(move |record| {
            let start = (record.from + turn).max(from);
            let end = (record.to + turn).min(from + length);
            // times of a shifted clock have rounding errors
            (end > start + 1e-3).then_some((start, end, record))
        })
    };
    let mut parts: Vec<_> = turns.into_iter().flat_map(of_turn).collect();
    parts.sort_by(|a, b| a.0.total_cmp(&b.0));
    parts
}
