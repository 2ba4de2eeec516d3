//! What every command that traces can be told.

use clap::Args;

use super::run;
use crate::transport::settings::Settings;

/// The options that are alike in all commands that trace; without them the scene's settings hold.
#[derive(Args)]
pub struct TracingArguments {
    /// Photons to trace, e.g. 5e6 [default: the scene's]
    #[arg(long, value_name = "N", value_parser = run::photons, allow_negative_numbers = true)]
    pub photons: Option<u64>,
    /// Seed of the random numbers: the same seed gives the same output, byte for byte [default: the scene's]
    #[arg(long, value_name = "N", value_parser = run::count, allow_negative_numbers = true)]
    pub seed: Option<u64>,
    /// Threads; 0 takes all processors. What is found does not depend on it [default: the scene's]
    #[arg(long, value_name = "N", value_parser = run::threads, allow_negative_numbers = true)]
    pub threads: Option<usize>,
}

impl TracingArguments {
    /// The settings of a scene with those that are given here in their place.
    pub fn settings(&self, of_scene: &Settings) -> Settings {
        Settings {
            photons: self.photons.or(of_scene.photons),
            seed: self.seed.unwrap_or(of_scene.seed),
            threads: self.threads.unwrap_or(of_scene.threads),
            ..of_scene.clone()
        }
    }
}
