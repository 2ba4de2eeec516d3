//! Calibration files, which `phylux calibrate` writes and `phylux mix --calibration` reads.

use std::path::Path;

use serde::Deserialize;

use super::{input::read_bytes, json};
use phylux_core::{
    error::{Error, Result, call},
    math::stats::is_possible,
    words,
};
use phylux_results::result::ByLight;

/// What a mix takes from a calibration, or from powers that light captors evenly.
#[derive(Clone, Debug, Deserialize)]
pub struct Factors {
    /// Names of the bands of the scene.
    pub bands: Vec<String>,
    /// Factors on the powers of lights, one for each band.
    pub factors: ByLight<Vec<f64>>,
    /// Names of the lamps: lights, or patterns of lights; empty where the powers are not measured.
    #[serde(default)]
    pub lamps: Vec<String>,
    /// Names of the bands or sums in which readings were taken.
    #[serde(default)]
    pub measured_bands: Vec<String>,
    /// Covariances of the factors, lamp by lamp, and for each lamp by measured band.
    #[serde(default)]
    pub covariance: Vec<Vec<f64>>,
}

/// Reads the calibration file at `path`. Errors: the file cannot be read, or it is not a
/// calibration.
pub fn read(path: &Path) -> Result<Factors> {
    let bytes = read_bytes(path).map_err(|why| Error::unreadable(path.display(), why))?;
    parse(&bytes, path)
}

fn parse(bytes: &[u8], path: &Path) -> Result<Factors> {
    let none = |why: String| {
        Error::input(path.display(), format!("is no calibration: {why}")).remedy(words![
            "name a file such as `calibration.json` that ",
            call("calibrate"),
            " has written"
        ])
    };
    json::check_memory(bytes).map_err(|why| Error::too_large(path.display(), why))?;
    let calibration: Factors = serde_json::from_slice(bytes).map_err(|e| none(e.to_string()))?;
    for (light, factors) in &calibration.factors {
        if factors.len() != calibration.bands.len() {
            let problem = format!("light `{light}` has not one factor for each band");
            return Err(none(problem));
        }
        if factors.iter().any(|factor| *factor < 0.0 || !is_possible(*factor)) {
            return Err(none(format!("light `{light}` has a factor that none can be")));
        }
    }
    Ok(calibration)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use phylux_testing::{check_error, spoiled};

    const FILE: &str = r#"{"phylux": "1", "scene": "s", "model": "lamps", "prior": 0.2, "bands": ["a"],
"factors": {"l": [1.5]}, "factors_se": {"l": [null]}, "measured_bands": ["a"], "lamps": ["l"], "covariance": [[0.1]],
"residual": [0.05], "models": [{"model": "common", "numbers": 1, "blocked_loss": null, "blocked_loss_se": null,
"blocked_rmse": [null]}], "slope_intercept": {"slope": [1], "intercept": [0], "blocked_rmse": [null], "test_rmse": [null]},
"fit_rmse": [0.1], "test_rmse": [null], "test_inside": null, "readings": [], "warnings": []}"#;
    const WORDS: &[&str] = &["null", "[", "]", "{", "}", "1e300", "\"lamps\"", "\"factors\":"];

    #[test]
    fn a_file_is_read_and_what_is_none_is_refused() {
        let path = Path::new("c.json");
        let read = parse(FILE.as_bytes(), path).unwrap();
        assert_eq!(read.factors["l"], [1.5]);
        for (from, to, start) in [
            ("[1.5]", "[1, 2]", "c.json: is no calibration: light `l` has not one factor for each"),
            ("[1.5]", "[-1]", "c.json: is no calibration: light `l` has a factor that none can be"),
            ("\"s\"", "s", "c.json: is no calibration: expected value"),
        ] {
            let error = parse(FILE.replacen(from, to, 1).as_bytes(), path).unwrap_err().to_string();
            assert!(error.starts_with(start), "{error}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn no_spoiled_file_panics(bytes in spoiled(&[FILE], WORDS)) {
            if let Err(error) = parse(&bytes, Path::new("c.json")) {
                check_error(&error, Path::new("c.json"));
            }
        }
    }
}
