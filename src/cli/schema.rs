//! `phylux schema`: prints the JSON Schema of a kind of files.

use clap::ValueEnum;

use phylux_core::error::{Error, Result};
use phylux_files::{
    control_file::ControlFile, result_file::SingleCaptor, scene_file::SceneSpec,
    sweep_file::SweepFile,
};
use phylux_results::result::RunResult;

/// Kind of files to print the schema of.
#[derive(Clone, Copy, ValueEnum)]
pub(super) enum Of {
    /// Scene files
    Scene,
    /// Sweep files
    Sweep,
    /// Results files
    Results,
    /// Files of `--per-captor`
    Captor,
    /// Control files of `phylux year`
    Control,
}

pub(super) fn print(of: Of) -> Result<()> {
    let schema = match of {
        Of::Scene => schemars::schema_for!(SceneSpec),
        Of::Sweep => schemars::schema_for!(SweepFile),
        Of::Results => schemars::schema_for!(RunResult),
        Of::Control => schemars::schema_for!(ControlFile),
        Of::Captor => schemars::schema_for!(SingleCaptor),
    };
    let text = serde_json::to_string_pretty(&schema).map_err(|e| Error::run("schema", e))?;
    super::terminal::print_result(&(text + "\n"))
}
