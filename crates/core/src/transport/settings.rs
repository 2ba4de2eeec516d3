//! Settings of a run, and the limits within which their numbers must lie.

mod limits;

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::scene::captor::Channel;

pub use limits::{
    MAX_PHOTONS, MapLimit, NearestCount, PhotonCount, ThreadCount, TimeLimit, Tolerance,
};

/// The method by which the light on the captors is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Estimator {
    /// Photons are traced from the lights and counted where they arrive.
    Photons,
    /// Paths are traced backward, from the captors to the lights.
    Paths,
    /// Paths, and beside them photons that count where they bring light which paths cannot find.
    Complete,
    /// A short trial chooses photons or complete paths, whichever take less work.
    #[default]
    Auto,
}

impl Estimator {
    /// Returns the name by which `--estimator` and `"estimator"` ask for it.
    pub fn option(self) -> &'static str {
        match self {
            Self::Photons => "photons",
            Self::Paths => "paths",
            Self::Complete => "complete",
            Self::Auto => "auto",
        }
    }
}

impl fmt::Display for Estimator {
    /// Writes what this estimator traces.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Photons => "photons",
            Self::Paths => "paths",
            Self::Complete => "complete paths",
            Self::Auto => "photons or paths",
        })
    }
}

/// A value that has been read from a text, or a message that says what it must be.
pub type Checked<T> = Result<T, String>;

/// What a tolerance applies to: captors and groups, one of their quantities, and a band.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// Pattern of the ids of captors or names of groups; `*` stands for any characters.
    pub pattern: String,
    /// The channel: light on the front or back, or what is absorbed.
    pub quantity: Channel,
    /// Name of a band or of a sum over bands; `None` means all of them.
    pub band: Option<String>,
}

impl Target {
    /// Reads `PATTERN[:QUANTITY[:BAND]]`. The quantities are `irradiance` and `front` (which mean
    /// the same, and are the default), `back` and `absorbed`. A colon before anything else belongs
    /// to the pattern. Error: the pattern is empty.
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

/// The help that photons get to reach captors that little light reaches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Guiding {
    /// None: photons are left to chance.
    Off,
    /// Flights are aimed at virtual captors, from wherever a photon is emitted or scattered
    /// diffusely.
    Aim,
    /// As `aim`, and photons are also split or ended depending on how much light at a place matters
    /// to the captors.
    Full,
    /// A short trial chooses the cheapest of `off`, `aim` and `full`.
    #[default]
    Auto,
}

/// Settings of a run. Each number lies within its limits, as its type says.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The method by which the light on the captors is found.
    pub estimator: Estimator,
    /// Number of photons or, if paths are asked for, of paths over all faces together; `None` means
    /// [`DEFAULT_PHOTONS`](Self::DEFAULT_PHOTONS). Where a trial chooses complete paths, as many are
    /// traced as take the work of so many photons.
    pub photons: Option<PhotonCount>,
    /// Seed of the random streams.
    pub seed: u64,
    /// Number of photons of a k-nearest estimate. With `None`, each face has its own: the number of
    /// histories that reached it, to the power 2/3 and at least 50, times the photons per history.
    pub k: Option<NearestCount>,
    /// The most arrivals that the photon map holds. It holds fewer where they would take more than
    /// 1 GiB.
    pub map_photons: MapLimit,
    /// The help that photons get to reach captors that little light reaches.
    pub guiding: Guiding,
    /// The run goes on until the relative standard error of every captor is at most this.
    pub tolerance: Option<Tolerance>,
    /// With a tolerance: the most photons, or paths, if their number is limited.
    pub tolerance_limit: Option<PhotonCount>,
    /// With a tolerance: what must meet it. An empty list means the irradiance of all faces in all
    /// bands.
    pub of: Vec<Target>,
    /// Time limit. With a tolerance the run ends after the round in which the limit is passed;
    /// without one it ends at the border between tasks that is nearest to the limit.
    pub max_time: Option<TimeLimit>,
    /// Whether results are split by light, which only photons can do.
    pub by_light: bool,
    /// Number of threads.
    pub threads: ThreadCount,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            estimator: Estimator::Auto,
            photons: None,
            seed: 1,
            k: None,
            map_photons: MapLimit::DEFAULT,
            guiding: Guiding::Auto,
            tolerance: None,
            tolerance_limit: None,
            of: Vec::new(),
            max_time: None,
            by_light: false,
            threads: ThreadCount::ALL,
        }
    }
}

impl Settings {
    /// Number of photons of a run for which no number is given.
    pub const DEFAULT_PHOTONS: u64 = 1_000_000;

    /// Returns the number of photons, or of paths over all faces together.
    pub fn photons_or_default(&self) -> u64 {
        self.photons.map_or(Self::DEFAULT_PHOTONS, PhotonCount::get)
    }

    /// Returns whether photons are stored for k-nearest estimates.
    pub fn keeps_map(&self) -> bool {
        self.k != Some(NearestCount::NONE)
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
