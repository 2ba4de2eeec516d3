//! How a run is to be done, and what its numbers may be.

use std::{fmt, time::Duration};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{error::number, scene::captor::Channel};

/// The most histories that a run can have.
pub const MAX_PHOTONS: u64 = 1_000_000_000_000_000;

/// How captors are read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum Estimator {
    /// Photons from the lights, counted where they arrive.
    #[default]
    Photons,
    /// Paths back from the captors.
    Paths,
    /// What a short trial finds cheaper.
    Auto,
}

impl fmt::Display for Estimator {
    /// What it traces.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Photons => "photons",
            Self::Paths => "paths",
            Self::Auto => "photons or paths",
        })
    }
}

/// What a tolerance is asked of: captors and groups, a quantity of them, and a band.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// Pattern of the ids of captors or names of groups; `*` stands for any characters.
    pub pattern: String,
    /// The channel: light on the front or back, or what is absorbed.
    pub quantity: Channel,
    /// Name of a band or sum; none: all.
    pub band: Option<String>,
}

impl Target {
    /// From `PATTERN[:QUANTITY[:BAND]]`; quantities are `irradiance` and `front` (the same, and the default), `back`
    /// and `absorbed`. A colon before anything else belongs to the pattern. Error: no pattern.
    pub fn parse(text: &str) -> Checked<Self> {
        let named = text.match_indices(':').find_map(|(at, _)| {
            let (word, band) = match text[at + 1..].split_once(':') {
                Some((word, band)) => (word, Some(band.to_string())),
                None => (&text[at + 1..], None),
            };
            let quantity = match word {
                "irradiance" | "front" => Channel::Front,
                "back" => Channel::Back,
                "absorbed" => Channel::Absorbed,
                _ => return None,
            };
            Some((&text[..at], quantity, band))
        });
        let (pattern, quantity, band) = named.unwrap_or((text, Channel::Front, None));
        match pattern.is_empty() {
            true => Err("must be PATTERN[:QUANTITY[:BAND]], as in \"plant*:absorbed:PAR\"".into()),
            false => Ok(Self { pattern: pattern.into(), quantity, band }),
        }
    }
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let quantity = match self.quantity {
            Channel::Front => "irradiance",
            Channel::Back => "back",
            Channel::Absorbed => "absorbed",
        };
        write!(f, "{}:{quantity}", self.pattern)?;
        self.band.iter().try_for_each(|band| write!(f, ":{band}"))
    }
}

/// What helps photons to captors that light hardly reaches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum Guiding {
    /// Nothing: photons alone.
    Off,
    /// Flights aimed at virtual captors, from wherever a photon starts or is scattered diffusely.
    Aim,
    /// These, and photons split and ended by how much light at a place matters to the captors.
    Full,
    /// Off, aim or full, as a short trial finds cheaper.
    #[default]
    Auto,
}

/// How a run is to be done.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// How captors are read.
    pub estimator: Estimator,
    /// Histories, or paths over all faces: how many (none: [`DEFAULT_PHOTONS`](Self::DEFAULT_PHOTONS)).
    pub photons: Option<u64>,
    /// Seed of the random streams.
    pub seed: u64,
    /// Photons of a k-nearest estimate, at least 2 (none: the number of those on each face to the power
    /// 2/3, at least 50); 0 stores no photons.
    pub k: Option<usize>,
    /// The most arrivals in the photon map; fewer where they would take more than 1 GiB.
    pub map_photons: usize,
    /// What is sent out beside photons, for virtual captors.
    pub guiding: Guiding,
    /// Goes on until every captor's relative standard error is at most this, in (0, 1).
    pub tolerance: Option<f64>,
    /// With a tolerance: the most histories, if they are limited.
    pub tolerance_limit: Option<u64>,
    /// With a tolerance: what must meet it; empty: the irradiance of all faces in all bands.
    pub of: Vec<Target>,
    /// Ends at the first batch border after this time.
    pub max_time: Option<Duration>,
    /// Whether results are split by light; of photons only.
    pub by_light: bool,
    /// Threads; 0 takes as many as there are processors.
    pub threads: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            estimator: Estimator::Photons,
            photons: None,
            seed: 1,
            k: None,
            map_photons: 2_000_000,
            guiding: Guiding::Auto,
            tolerance: None,
            tolerance_limit: None,
            of: Vec::new(),
            max_time: None,
            by_light: false,
            threads: 0,
        }
    }
}

/// A checked number, or what it must be.
pub type Checked<T> = Result<T, String>;

impl Settings {
    /// Histories of a run that is given no number.
    pub const DEFAULT_PHOTONS: u64 = 1_000_000;

    /// A number of photons to trace.
    pub fn check_photons(count: u64) -> Checked<u64> {
        match count {
            1..=MAX_PHOTONS => Ok(count),
            _ => Err(format!("{count} photons, must be 1 to {:.0e}", MAX_PHOTONS as f64)),
        }
    }

    /// A number of photons for a k-nearest estimate.
    pub fn check_k(k: u64) -> Checked<usize> {
        match usize::try_from(k) {
            Ok(1) | Err(_) => {
                Err(format!("k = {k}, must be 0 (no k-nearest estimate) or at least 2"))
            }
            Ok(k) => Ok(k),
        }
    }

    /// A bound on the arrivals in the photon map.
    pub fn check_map_photons(count: u64) -> Checked<usize> {
        const MOST: u64 = 1_000_000_000;
        match count {
            0..=MOST => Ok(count as usize),
            _ => Err(format!("{count} arrivals, must be at most {:.0e}", MOST as f64)),
        }
    }

    /// A relative standard error to stop at.
    pub fn check_tolerance(tolerance: f64) -> Checked<f64> {
        if tolerance > 0.0 && tolerance < 1.0 {
            return Ok(tolerance);
        }
        Err(format!("{}, must be between 0 and 1 (1 % is 0.01)", number(tolerance)))
    }

    /// A time to stop at, from seconds.
    pub fn check_max_time(seconds: f64) -> Checked<Duration> {
        match Duration::try_from_secs_f64(seconds) {
            Ok(time) if !time.is_zero() => Ok(time),
            _ => Err(format!("{} s, must be above 0 and below 1e19 s", number(seconds))),
        }
    }

    /// A number of threads.
    pub fn check_threads(threads: u64) -> Checked<usize> {
        match threads {
            0..=1024 => Ok(threads as usize),
            _ => Err(format!("{threads} threads, must be at most 1024 (0: all processors)")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_are_read() {
        for (text, pattern, quantity, band) in [
            ("plant*:absorbed:PAR", "plant*", Channel::Absorbed, Some("PAR")),
            ("plant*:absorbed", "plant*", Channel::Absorbed, None),
            ("plant*", "plant*", Channel::Front, None),
            ("*:irradiance:a b", "*", Channel::Front, Some("a b")),
            ("rank: 3", "rank: 3", Channel::Front, None),
            ("rank: 3:back", "rank: 3", Channel::Back, None),
            ("a:absorbed:back", "a", Channel::Absorbed, Some("back")),
            ("a:front:b:c", "a", Channel::Front, Some("b:c")),
        ] {
            let band = band.map(String::from);
            let expected = Target { pattern: pattern.into(), quantity, band };
            assert_eq!(Target::parse(&expected.to_string()).as_ref(), Ok(&expected));
            assert_eq!(Target::parse(text), Ok(expected));
        }
        assert!(Target::parse("").is_err() && Target::parse(":absorbed").is_err());
    }
}
