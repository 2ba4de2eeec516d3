//! What the tests share.

use std::{
    path::{Path, PathBuf},
    sync::atomic::AtomicBool,
};

use phylux::{Control, Estimator, FaceResult, RunResult, Settings};

/// Loads and runs a scene file; panics with the error's sentence.
pub fn run_file(path: &Path, change: impl FnOnce(&mut Settings)) -> RunResult {
    let loaded = phylux::load(path).unwrap_or_else(|e| panic!("{e}"));
    let mut settings = loaded.settings.clone();
    change(&mut settings);
    let stop = AtomicBool::new(false);
    let control = Control { stop: &stop, progress: &|_| {} };
    let simulation =
        phylux::simulate(&loaded.scene, &settings, &control).unwrap_or_else(|e| panic!("{e}"));
    RunResult::new(&loaded.scene, &settings, &simulation)
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

/// The folder of independently computed truths and measurements, if this machine has it.
pub fn shared() -> Option<PathBuf> {
    let shared = std::env::var_os("PHYLUX_SHARED").map(PathBuf::from);
    if shared.is_none() {
        eprintln!("skipped: PHYLUX_SHARED is not set");
    }
    shared
}
