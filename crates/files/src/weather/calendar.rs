//! The clock of a weather file: where in the file a time lies, with and without a leap day.

use super::record::{Clock, DAY, Record, YEAR};
use phylux_core::scene::daylight::{Date, Timestamp};

/// The start of 29 February in a leap year, s since New Year.
const LEAP_DAY: f64 = 59.0 * DAY;

/// A file's clock, as the period that is selected sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Calendar {
    pub(super) clock: Clock,
    /// Whether a typical year has a 29 February.
    pub(super) leap: bool,
}

impl Calendar {
    /// Returns whether the year of the clock begins anew at its end.
    pub(super) fn wraps(self) -> bool {
        matches!(self.clock, Clock::TypicalYear { .. })
    }

    /// Returns the length of a typical year, s.
    pub(super) fn year(self) -> f64 {
        if self.leap { YEAR + DAY } else { YEAR }
    }

    /// Returns a time of the clock, or a time since another one, within the typical year.
    pub(super) fn wrapped(self, at: f64) -> f64 {
        if self.wraps() { at.rem_euclid(self.year()) } else { at }
    }

    /// Returns a record at its place on this clock; `None` on a 29 February that the clock has not.
    pub(super) fn place(self, record: &Record) -> Option<Record> {
        if !self.wraps() || self.leap {
            return Some(*record);
        }
        if self.is_leap_day(record) {
            return None;
        }
        let back = if middle(record) >= LEAP_DAY { DAY } else { 0.0 };
        Some(Record { from: record.from - back, to: record.to - back, ..*record })
    }

    /// Returns whether a record of a typical year is one of 29 February.
    pub(super) fn is_leap_day(self, record: &Record) -> bool {
        self.wraps() && (LEAP_DAY..LEAP_DAY + DAY).contains(&middle(record))
    }

    /// Returns whether a part of 29 February lies between two times, or at them.
    pub(super) fn meets_leap_day(self, from: Timestamp, to: Timestamp) -> bool {
        let Clock::TypicalYear { zone } = self.clock else { return false };
        let years = local(from, zone).0.year..=local(to, zone).0.year;
        years.into_iter().take(3).any(|year| {
            let day = Date { year, month: 2, day: 29 };
            let start = day.days() as f64 * DAY - zone;
            Date::from_days(day.days()) == day && start <= to.unix && from.unix < start + DAY
        })
    }

    /// Converts a time to the file's clock, s. In a typical year without 29 February, all of that
    /// day becomes the end of 28 February.
    pub(super) fn at(self, time: Timestamp) -> f64 {
        match self.clock {
            Clock::Unix => time.unix,
            Clock::TypicalYear { zone } => {
                let (date, clock) = local(time, zone);
                match (date.month, date.day) {
                    (2, 29) if !self.leap => self.day(Date { month: 3, day: 1, ..date }),
                    _ => self.day(date) + clock,
                }
            }
        }
    }

    /// Like [`at`](Self::at), for an instant: on a 29 February that the year has not, it takes the
    /// weather of 28 February.
    pub(super) fn instant(self, time: Timestamp) -> f64 {
        match self.clock {
            Clock::TypicalYear { zone }
                if !self.leap && matches!(local(time, zone).0, Date { month: 2, day: 29, .. }) =>
            {
                self.at(Timestamp { unix: time.unix - DAY, ..time })
            }
            _ => self.at(time),
        }
    }

    /// Converts a time on the file's clock to a real time, which is in 2001 or 2000 for a typical
    /// year.
    pub(super) fn timestamp(self, at: f64) -> Timestamp {
        match self.clock {
            Clock::Unix => Timestamp { unix: at, offset: 0.0 },
            Clock::TypicalYear { zone } => {
                let first = Date { year: self.standing_for(), month: 1, day: 1 }.days() as f64;
                Timestamp { unix: first * DAY + self.wrapped(at) - zone, offset: zone }
            }
        }
    }

    /// Returns the real time at a time of the mended clock. `offset` is that of the clock of the row, and
    /// `years` has the year of each month of a typical year, as far as it is known.
    pub(super) fn mended(self, at: f64, offset: f64, years: &[Option<i64>; 12]) -> Timestamp {
        // without the rounding errors of a shift
        let time = self.timestamp((1e3 * at).round() / 1e3);
        let Clock::TypicalYear { zone } = self.clock else { return Timestamp { offset, ..time } };
        let (date, _) = local(time, zone);
        let year = years[date.month as usize - 1].unwrap_or(date.year);
        let real = Date::new(year, date.month, date.day).unwrap_or(date);
        Timestamp { unix: time.unix + (real.days() - date.days()) as f64 * DAY, ..time }
    }

    /// Returns a readable name of the hour that starts at a time on the file's clock.
    pub(super) fn name(self, at: f64) -> String {
        let time = self.timestamp(at);
        let (Date { year, month, day }, clock) = local(time, time.offset);
        let minutes = (clock / 60.0).floor() as u32;
        let clock = format!("{:02}:{:02}", minutes / 60, minutes % 60);
        match self.clock {
            Clock::Unix => format!("{year}-{month:02}-{day:02}T{clock}Z"),
            Clock::TypicalYear { .. } => format!("{month:02}-{day:02} {clock}"),
        }
    }

    /// Returns the start of a day of a typical year, s.
    fn day(self, date: Date) -> f64 {
        (Date { year: self.standing_for(), ..date }.day_of_year() - 1) as f64 * DAY
    }

    /// Returns a year with the days of the typical year.
    fn standing_for(self) -> i64 {
        if self.leap { 2000 } else { 2001 }
    }
}

/// Puts a row of 1 March that begins before midnight, of a typical year, behind those of 28 February: it
/// seems to be one of 29 February, of which the file has no other.
pub(super) fn mend_leap_day(clock: Clock, records: &mut [Record]) {
    let calendar = Calendar { clock, leap: true };
    let mut on_leap_day = records.iter_mut().filter(|record| calendar.is_leap_day(record));
    if let (Some(record), None) = (on_leap_day.next(), on_leap_day.next())
        && record.to > LEAP_DAY + DAY - 1.0
    {
        record.from -= DAY;
        record.to -= DAY;
    }
}

fn middle(record: &Record) -> f64 {
    0.5 * (record.from + record.to)
}

/// Returns the day and the seconds since midnight on a clock `zone` seconds ahead of UTC.
fn local(time: Timestamp, zone: f64) -> (Date, f64) {
    let local = time.unix + zone;
    (Date::from_days((local / DAY).floor() as i64), local.rem_euclid(DAY))
}
