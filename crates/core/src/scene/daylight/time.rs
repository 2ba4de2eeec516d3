//! Instants of time, and the calendar.

/// Number of seconds in a day.
const DAY: f64 = 86_400.0;

/// An instant, with the offset of the clock that it was read from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timestamp {
    /// Seconds since 1970-01-01T00:00Z, without leap seconds.
    pub unix: f64,
    /// Seconds by which that clock is ahead of UTC.
    pub offset: f64,
}

/// A day of the Gregorian calendar.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Date {
    /// Year.
    pub year: i64,
    /// Month, 1 to 12.
    pub month: u32,
    /// Day of the month, from 1.
    pub day: u32,
}

impl Date {
    /// Makes a date. Returns `None` unless the day exists and is in the years 1900 to 2100, for
    /// which positions of the sun are right.
    pub fn new(year: i64, month: u32, day: u32) -> Option<Self> {
        let date = Self { year, month, day };
        let real = (1900..=2100).contains(&year) && (1..=12).contains(&month) && day >= 1;
        (real && Self::from_days(date.days()) == date).then_some(date)
    }

    /// Returns the days since 1970-01-01 (Hinnant, chrono-compatible low-level date algorithms,
    /// 2021).
    pub fn days(self) -> i64 {
        let (m, d) = (i64::from(self.month), i64::from(self.day));
        let y = self.year - i64::from(m <= 2);
        let (era, year_of_era) = (y.div_euclid(400), y.rem_euclid(400));
        let day_of_year = (153 * ((m + 9) % 12) + 2) / 5 + d - 1;
        era * 146_097 + year_of_era * 365 + year_of_era / 4 - year_of_era / 100 + day_of_year
            - 719_468
    }

    /// Returns the date of a number of days since 1970-01-01, the inverse of [`days`](Self::days).
    pub fn from_days(days: i64) -> Self {
        let z = days + 719_468;
        let (era, day) = (z.div_euclid(146_097), z.rem_euclid(146_097));
        let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
        let day_of_year = day - (365 * year + year / 4 - year / 100);
        let shifted = (5 * day_of_year + 2) / 153;
        let month = (shifted + 2) % 12 + 1;
        Self {
            year: era * 400 + year + i64::from(month <= 2),
            month: month as u32,
            day: (day_of_year - (153 * shifted + 2) / 5 + 1) as u32,
        }
    }

    /// Returns the day of the year, from 1.
    pub fn day_of_year(self) -> i64 {
        self.days() - Self { month: 1, day: 1, ..self }.days() + 1
    }
}

impl Timestamp {
    /// Returns the day in UTC.
    pub fn date(self) -> Date {
        Date::from_days((self.unix / DAY).floor() as i64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_day_of_two_centuries_comes_back() {
        let first = Date { year: 1900, month: 1, day: 1 }.days();
        assert_eq!(first, -25_567);
        let last = Date { year: 2100, month: 12, day: 31 }.days();
        for days in first..=last {
            let date = Date::from_days(days);
            assert_eq!(date.days(), days);
            assert_eq!(Date::new(date.year, date.month, date.day), Some(date));
        }
        assert_eq!(Date { year: 2024, month: 12, day: 31 }.day_of_year(), 366);
    }
}
