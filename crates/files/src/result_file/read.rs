//! Reads result files.

use std::{fmt::Display, path::Path};

use crate::{input::read_bytes, json};
use phylux_core::{
    error::{Error, Result, call},
    math::stats::LARGEST,
    words,
};
use phylux_results::result::RunResult;

/// Reads the results at `path`. Errors: the file cannot be read, or is not a results file.
pub fn read_json(path: &Path) -> Result<RunResult> {
    let bytes = read_bytes(path).map_err(|why| Error::unreadable(path.display(), why))?;
    parse(&bytes, path.display())
}

/// Reads results from bytes that [`write_json`](super::write_json) has written. Error: they are not
/// results.
pub fn parse_json(bytes: &[u8]) -> Result<RunResult> {
    parse(bytes, "results")
}

fn parse(bytes: &[u8], place: impl Display) -> Result<RunResult> {
    let none = |why: &dyn Display| {
        Error::input(&place, format!("is no results file: {why}")).remedy(words![
            "name a file that ",
            call("run"),
            " has written"
        ])
    };
    json::check_memory(bytes).map_err(|why| Error::too_large(&place, why))?;
    let result: RunResult = serde_json::from_slice(bytes).map_err(|e| none(&e))?;
    match result.is_valid() {
        true => Ok(result),
        false => Err(none(&format!(
            "a list has not one entry for each band, or a number is above {LARGEST:e}"
        ))),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::LazyLock;

    use proptest::{prelude::*, sample::select};

    use super::*;
    use crate::result_file::write_json;
    use phylux_core::transport::settings::{Estimator, NearestCount, Settings};
    use phylux_results::{
        compare::Comparison,
        result::{Factor, ToleranceResult},
    };
    use phylux_testing::{check_error, check_finite, small_run, spoiled};

    const WORDS: &[&str] = &["null", "[", "]", "{", "}", "1e300", "-1e300", "\"back\":", "l1"];

    /// Two results: of photons, split by light, and of backward paths.
    static FILES: LazyLock<Vec<&'static str>> = LazyLock::new(|| {
        let paths = Settings { estimator: Estimator::Paths, ..Settings::default() };
        let split =
            Settings { by_light: true, k: NearestCount::new(2).ok(), ..Settings::default() };
        [split, paths].map(|settings| text(&small_run(settings))).to_vec()
    });

    fn text(result: &RunResult) -> &'static str {
        let mut bytes = Vec::new();
        write_json(result, &mut bytes).expect("memory");
        String::from_utf8(bytes).expect("UTF-8").leak()
    }

    /// Factors of a mix, shares of unseen light and a tolerance that no run can have are refused.
    #[test]
    fn every_entry_of_the_head_is_checked() {
        let accuracy = |asked| ToleranceResult { asked, met: true, worst: None, dark: Vec::new() };
        let read = |change: &dyn Fn(&mut RunResult)| {
            let mut result = small_run(Settings { by_light: true, ..Settings::default() });
            change(&mut result);
            parse_json(text(&result).as_bytes()).map_err(|error| error.to_string())
        };
        let lamp = |factor: Factor| Some([("lamp".to_string(), factor)].into());
        let bands = read(&|_| ()).expect("results").bands;
        // a sum has a share of its own, but no factor
        let own = bands.iter().filter(|band| band.sum_of.is_none()).count();
        assert!(own < bands.len());
        // places in lists are those of bands, which come before the sums
        assert!(read(&|result| result.bands.reverse()).is_err());
        for entries in 0..=bands.len() + 1 {
            let factors = read(&|result| result.mixed = lamp(Factor::Bands(vec![2.0; entries])));
            let shares = read(&|result| result.account.unseen = Some(vec![0.1; entries]));
            for (found, of) in [(factors, own), (shares, bands.len())] {
                assert_eq!(found.is_ok(), entries == of, "{entries} of {of}");
                let refused =
                    |said: String| said.contains("a list has not one entry for each band");
                assert!(found.is_ok() || found.is_err_and(refused));
            }
        }
        for (number, is_sound) in [(0.01, true), (1e200, false)] {
            let factor = read(&|result| result.mixed = lamp(Factor::All(number)));
            let asked = read(&|result| result.account.tolerance = Some(accuracy(number)));
            assert_eq!((factor.is_ok(), asked.is_ok()), (is_sound, is_sound), "{number}");
        }
    }

    /// Whatever part of the results a wrong value stands in, the message says in which line.
    #[test]
    fn wrong_values_have_their_places() {
        for key in ["seed", "settings", "energy", "map", "captors"] {
            let wrong: String = FILES[0]
                .lines()
                .map(|line| match line.strip_prefix(&format!("  \"{key}\": ")) {
                    Some(value) => format!("\"{key}\": 0.5, \"old {key}\": {value}\n"),
                    None => format!("{line}\n"),
                })
                .collect();
            let line = 1 + wrong.lines().position(|line| line.contains("0.5, \"old")).expect(key);
            let said = parse_json(wrong.as_bytes()).expect_err(key).to_string();
            assert!(said.contains("0.5") && said.contains(&format!(" at line {line} ")), "{said}");
        }
    }

    /// A folder with a valid results file; the tests write damaged files beside it.
    static FOLDER: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
        let folder = tempfile::tempdir().expect("a temporary folder");
        std::fs::write(folder.path().join("sound.json"), FILES[0]).expect("a file");
        folder
    });

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// Any text gives an error that names the file, or results from which only finite numbers
        /// follow.
        #[test]
        fn no_spoiled_results_panic(
            bytes in spoiled(FILES.as_slice(), WORDS),
            factor in select(&[0.0, 0.5, 1e30][..]),
        ) {
            let (sound, path) = (FOLDER.path().join("sound.json"), FOLDER.path().join("r.json"));
            std::fs::write(&path, &bytes).expect("a file");
            match read_json(&path) {
                Err(error) => check_error(&error, &path),
                Ok(result) => {
                    let sound = read_json(&sound).expect("results");
                    for pair in [[&result, &sound], [&sound, &result], [&result, &result]] {
                        if let Ok(comparison) = Comparison::new(pair[0], pair[1]) {
                            check_finite(&comparison);
                            check_finite(&comparison.rms());
                        }
                    }
                    let lights = result.energy.by_light.iter().flatten();
                    let factors = lights.map(|(name, _)| (name.clone(), factor)).collect();
                    if let Ok(mixed) = result.mix(&factors) {
                        check_finite(&mixed);
                    }
                }
            }
        }
    }
}
