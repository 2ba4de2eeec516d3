//! The numbers of [`Settings`](super::Settings). Each has a type of its own, whose constructor
//! refuses what lies beyond its limits. The place of the error is the name of the setting.

use std::time::Duration;

use crate::error::{Error, Result, number};

/// The most photons, or paths, that a run can have.
pub const MAX_PHOTONS: u64 = 1_000_000_000_000_000;

/// A number of photons, or of paths, to trace: 1 to 1e15.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct PhotonCount(u64);

impl PhotonCount {
    /// Makes a number of photons. Error: it is not from 1 to 1e15.
    pub fn new(count: u64) -> Result<Self> {
        match count {
            1..=MAX_PHOTONS => Ok(Self(count)),
            _ => {
                let problem = format!("{count} photons, must be 1 to {:.0e}", MAX_PHOTONS as f64);
                Err(Error::input("photons", problem).remedy("1e6 are usual"))
            }
        }
    }

    /// Makes the number of photons from 1 to 1e15 that is nearest to `count`.
    pub fn nearest_to(count: u64) -> Self {
        Self(count.clamp(1, MAX_PHOTONS))
    }

    /// Returns the number.
    pub fn get(self) -> u64 {
        self.0
    }
}

/// A number of photons of a k-nearest estimate: at least 2, or [`NONE`](Self::NONE).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct NearestCount(usize);

impl NearestCount {
    /// 0: no k-nearest estimate is made, and no photon is stored.
    pub const NONE: Self = Self(0);

    /// Makes a number of photons. Error: it is 1.
    pub fn new(k: usize) -> Result<Self> {
        if k == 1 {
            let problem = "k = 1, must be 0 (no k-nearest estimate) or at least 2";
            return Err(
                Error::input("k", problem).remedy("leave it out for a number that suits each face")
            );
        }
        Ok(Self(k))
    }

    /// Returns the number.
    pub fn get(self) -> usize {
        self.0
    }
}

/// The most arrivals that a photon map may hold: 0 to 1e9.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct MapLimit(usize);

impl MapLimit {
    const MOST: usize = 1_000_000_000;
    /// The limit where none is given: 2e6.
    pub const DEFAULT: Self = Self(2_000_000);

    /// Makes a limit. Error: it is above 1e9.
    pub fn new(arrivals: usize) -> Result<Self> {
        if arrivals > Self::MOST {
            let problem = format!("{arrivals} arrivals, must be at most {:.0e}", Self::MOST as f64);
            return Err(Error::input("map_photons", problem).remedy("2e6 are usual"));
        }
        Ok(Self(arrivals))
    }

    /// Makes the limit from 0 to 1e9 that is nearest to `arrivals`.
    pub fn nearest_to(arrivals: usize) -> Self {
        Self(arrivals.min(Self::MOST))
    }

    /// Returns the number.
    pub fn get(self) -> usize {
        self.0
    }
}

/// A relative standard error at which a run stops: above 0 and below 1.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Tolerance(f64);

impl Tolerance {
    /// Makes a tolerance. Error: it is not between 0 and 1.
    pub fn new(tolerance: f64) -> Result<Self> {
        if tolerance > 0.0 && tolerance < 1.0 {
            return Ok(Self(tolerance));
        }
        // whoever writes 3 means 3 %
        let percent = if (1.0..100.0).contains(&tolerance) { tolerance } else { 1.0 };
        let problem = format!("{}, must be between 0 and 1", number(tolerance));
        Err(Error::input("tolerance", problem)
            .remedy(format!("{percent} % is {}", number(percent / 100.0))))
    }

    /// Returns the number.
    pub fn get(self) -> f64 {
        self.0
    }
}

/// A limit on the time of a run: above 0 and below 1e19 s.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct TimeLimit(Duration);

impl TimeLimit {
    /// Makes a limit of so many seconds. Error: they are not above 0 and below 1e19.
    pub fn new(seconds: f64) -> Result<Self> {
        match Duration::try_from_secs_f64(seconds) {
            Ok(time) if !time.is_zero() => Ok(Self(time)),
            _ => {
                let problem = format!("{} s, must be above 0 and below 1e19 s", number(seconds));
                Err(Error::input("max_time", problem).remedy("leave it out for no limit"))
            }
        }
    }

    /// Returns the time.
    pub fn get(self) -> Duration {
        self.0
    }
}

/// A number of threads: 1 to 1024, or [`ALL`](Self::ALL). The results do not depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ThreadCount(usize);

impl ThreadCount {
    const MOST: usize = 1024;
    /// 0: one for each processor.
    pub const ALL: Self = Self(0);
    /// A single thread.
    pub const ONE: Self = Self(1);

    /// Makes a number of threads; 0 means one for each processor. Error: it is above 1024.
    pub fn new(threads: usize) -> Result<Self> {
        if threads > Self::MOST {
            let problem = format!("{threads} threads, must be at most {}", Self::MOST);
            return Err(Error::input("threads", problem).remedy("0 takes all processors"));
        }
        Ok(Self(threads))
    }

    /// Makes the number of threads from 0 to 1024 that is nearest to `threads`.
    pub fn nearest_to(threads: usize) -> Self {
        Self(threads.min(Self::MOST))
    }

    /// Returns the number.
    pub fn get(self) -> usize {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_beyond_their_limits_cannot_be_made() {
        for count in [0, MAX_PHOTONS + 1, u64::MAX] {
            assert!(PhotonCount::new(count).is_err());
        }
        for tolerance in [0.0, -0.1, 1.0, 3.0, f64::NAN, f64::INFINITY] {
            assert!(Tolerance::new(tolerance).is_err());
        }
        for seconds in [0.0, -1.0, 1e-30, 1e20, f64::NAN] {
            assert!(TimeLimit::new(seconds).is_err());
        }
        assert!(NearestCount::new(1).is_err());
        assert!(MapLimit::new(usize::MAX).is_err());
        assert!(ThreadCount::new(1025).is_err());
    }

    #[test]
    fn errors_name_the_setting_and_a_remedy() {
        for (error, text) in [
            (
                PhotonCount::new(0).unwrap_err(),
                "photons: 0 photons, must be 1 to 1e15; 1e6 are usual",
            ),
            (
                Tolerance::new(3.0).unwrap_err(),
                "tolerance: 3, must be between 0 and 1; 3 % is 0.03",
            ),
        ] {
            assert_eq!(error.to_string(), text);
        }
    }
}
