//! What the tests share.

use std::{
    path::{Path, PathBuf},
    sync::atomic::AtomicBool,
};

use phylux::{Control, Estimator, FaceResult, RunResult, Settings};

/// Loads and runs a scene file; panics with the error's sentence. Where the environment variable
/// `PHYLUX_RETRY` is set, with the next seed and four times the histories: if a random test fails by bias
/// it fails then too, as a bias in standard errors doubles; if it failed by chance it passes.
pub fn run_file(path: &Path, change: impl FnOnce(&mut Settings)) -> RunResult {
    let loaded = phylux::load(path).unwrap_or_else(|e| panic!("{e}"));
    let mut settings = loaded.settings.clone();
    change(&mut settings);
    if std::env::var_os("PHYLUX_RETRY").is_some() {
        settings.seed += 1;
        settings.photons = Some(4 * settings.photons.unwrap_or(Settings::DEFAULT_PHOTONS));
    }
    let stop = AtomicBool::new(false);
    let control = Control { stop: &stop, progress: &|_| {} };
    let simulation =
        phylux::simulate(&loaded.scene, &settings, &control).unwrap_or_else(|e| panic!("{e}"));
    RunResult::new(&loaded.scene, &settings, &simulation)
}

/// The program: the one built with the tests or, to test another build, that at `PHYLUX_BINARY`.
pub fn binary() -> PathBuf {
    let other = std::env::var_os("PHYLUX_BINARY");
    other.unwrap_or_else(|| env!("CARGO_BIN_EXE_phylux").into()).into()
}

/// A folder with a scene and its files, gone when dropped.
pub struct TestScene(tempfile::TempDir);

impl TestScene {
    /// Writes `scene` as scene.json, and the other files by name.
    pub fn new(scene: &str, files: &[(&str, &str)]) -> Self {
        let dir = tempfile::tempdir().expect("a temporary folder");
        std::fs::write(dir.path().join("scene.json"), scene).expect("scene.json");
        for (name, content) in files {
            std::fs::write(dir.path().join(name), content).expect("a file of the scene");
        }
        Self(dir)
    }

    /// The path of a file in it.
    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Runs it with so many photons and no k-nearest estimate.
    pub fn run(&self, photons: u64, seed: u64) -> RunResult {
        run_file(&self.path("scene.json"), |settings| {
            *settings = Settings { photons: Some(photons), seed, k: Some(0), ..settings.clone() };
        })
    }

    /// Runs it with so many paths over all captors.
    pub fn run_paths(&self, paths: u64, seed: u64) -> RunResult {
        run_file(&self.path("scene.json"), |settings| {
            settings.estimator = Estimator::Paths;
            (settings.photons, settings.seed) = (Some(paths), seed);
        })
    }
}

/// The front of the captor `id`.
pub fn front<'a>(result: &'a RunResult, id: &str) -> &'a FaceResult {
    let captor = result.captors.iter().find(|captor| captor.id == id);
    &captor.unwrap_or_else(|| panic!("no captor {id}")).front
}

/// The folder of independently computed truths and measurements, which is no part of the
/// repository. Tests that read it have names that begin with `needs_shared_`.
pub fn shared() -> PathBuf {
    let shared = std::env::var_os("PHYLUX_SHARED");
    shared.expect("set the environment variable PHYLUX_SHARED to the folder of the data").into()
}
