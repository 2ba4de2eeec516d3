//! What the tests share: how a scene file is run, where the program is, and folders for scenes.

use std::{
    path::{Path, PathBuf},
    process::Output,
};

use phylux::{
    Control, Estimator, RunResult, Settings,
    results::{FaceResult, Own},
    transport::{NearestCount, PhotonCount},
};

/// Loads and runs a scene file whose settings are first changed by `change`. Photons are traced
/// where the file names no estimator. Panics with the error's message.
///
/// Where the environment variable `PHYLUX_RETRY` is set, the run uses the next seed and four times
/// the histories. A random test that failed because of a bias then fails again, because the bias
/// doubles in units of the standard error; one that failed by chance passes.
pub fn run_file(path: &Path, change: impl FnOnce(&mut Settings)) -> RunResult {
    let loaded = phylux::load(path).unwrap_or_else(|e| panic!("{e}"));
    let mut settings = loaded.settings.clone();
    let names_estimator =
        std::fs::read_to_string(path).is_ok_and(|text| text.contains("\"estimator\""));
    if !names_estimator {
        settings.estimator = Estimator::Photons;
    }
    change(&mut settings);
    if std::env::var_os("PHYLUX_RETRY").is_some() {
        settings.seed += 1;
        settings.photons = PhotonCount::new(4 * settings.photons_or_default()).ok();
    }
    let control = Control::default();
    let simulation =
        phylux::simulate(&loaded.scene, &settings, &control).unwrap_or_else(|e| panic!("{e}"));
    RunResult::new(&simulation)
}

/// Returns the path of the program: the one built with the tests, or the one that the environment
/// variable `PHYLUX_BINARY` names, to test another build.
pub fn binary() -> PathBuf {
    let other = std::env::var_os("PHYLUX_BINARY");
    other.unwrap_or_else(|| env!("CARGO_BIN_EXE_phylux").into()).into()
}

/// Returns what a command has said to the standard error, without lines of progress, which come only
/// if it takes longer than two seconds.
pub fn stderr(output: &Output) -> String {
    // such a line begins with a percentage or a time, as in `12% ` and `3s `
    let is_progress = |line: &str| {
        let rest = line.trim_start_matches(|c: char| c.is_ascii_digit());
        rest.len() < line.len() && rest.starts_with(['%', 's', 'm', 'h'])
            || line.contains(" so far, ")
    };
    let text = String::from_utf8_lossy(&output.stderr);
    text.split_inclusive('\n').filter(|line| !is_progress(line)).collect()
}

/// A temporary folder with a scene and its files, which is deleted when this is dropped.
pub struct TestScene(tempfile::TempDir);

impl TestScene {
    /// Writes `scene` as scene.json, and the other files under their names.
    pub fn new(scene: &str, files: &[(&str, &str)]) -> Self {
        let dir = tempfile::tempdir().expect("a temporary folder");
        std::fs::write(dir.path().join("scene.json"), scene).expect("scene.json");
        for (name, content) in files {
            std::fs::write(dir.path().join(name), content).expect("a file of the scene");
        }
        Self(dir)
    }

    /// Returns the path of a file in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Runs the scene with this number of photons and this seed, without the estimate from the k
    /// nearest photons.
    pub fn run(&self, photons: u64, seed: u64) -> RunResult {
        run_file(&self.path("scene.json"), |settings| {
            *settings = Settings {
                photons: PhotonCount::new(photons).ok(),
                seed,
                k: Some(NearestCount::NONE),
                ..settings.clone()
            };
        })
    }

    /// Runs the scene by backward paths, with this number of paths in all captors together.
    pub fn run_paths(&self, paths: u64, seed: u64) -> RunResult {
        run_file(&self.path("scene.json"), |settings| {
            settings.estimator = Estimator::Paths;
            (settings.photons, settings.seed) = (PhotonCount::new(paths).ok(), seed);
        })
    }
}

/// Returns what the front of the captor `id` received.
pub fn front<'a>(result: &'a RunResult, id: &str) -> &'a FaceResult {
    let captor = result.captors.iter().find(|captor| captor.id == id);
    &captor.unwrap_or_else(|| panic!("no captor {id}")).front
}

/// Returns the share of a captor, group or layer that the sun shines on, with its standard error.
pub fn sunlit(own: &Own) -> (f64, f64) {
    let (share, error) = own.one("sunlit").expect("a share");
    (share, error.expect("an error"))
}

/// Returns the folder of independently computed truths and measurements, which is not part of the
/// repository. Tests that read it have names that begin with `needs_shared_`.
pub fn shared() -> PathBuf {
    let shared = std::env::var_os("PHYLUX_SHARED");
    shared.expect("set the environment variable PHYLUX_SHARED to the folder of the data").into()
}
