//! The options that are common to commands that trace.

use clap::Args;

use super::run;
use phylux_core::transport::settings::{PhotonCount, Settings, ThreadCount};

/// Options that are the same in several commands that trace; the scene's settings hold for those
/// that are not given.
#[derive(Args)]
pub struct TracingArguments {
    /// Photons to trace, e.g. 5e6 [default: the scene's]
    #[arg(long, value_name = "N", value_parser = run::photons)]
    pub photons: Option<PhotonCount>,
    /// Seed of the random numbers: the same seed gives the same output, byte for byte [default: the
    /// scene's]
    #[arg(long, value_name = "N", value_parser = run::count)]
    pub seed: Option<u64>,
    /// Threads; 0 takes all processors. The results do not depend on it [default: the scene's]
    #[arg(long, value_name = "N", value_parser = run::threads)]
    pub threads: Option<ThreadCount>,
}

impl TracingArguments {
    /// Returns the settings of a scene, replaced by those that are given as options.
    pub fn settings(&self, of_scene: &Settings) -> Settings {
        Settings {
            photons: self.photons.or(of_scene.photons),
            seed: self.seed.unwrap_or(of_scene.seed),
            threads: self.threads.unwrap_or(of_scene.threads),
            ..of_scene.clone()
        }
    }
}
