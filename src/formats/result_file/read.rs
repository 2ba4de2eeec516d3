//! Reading results files.

use std::{fmt::Display, path::Path};

use serde::de::DeserializeOwned;

use crate::{
    error::{Error, Result},
    formats::{input::read_bytes, json},
    results::{result::RunResult, saved::ResultsFile},
};

impl ResultsFile {
    /// Reads the results at `path`. Errors: they cannot be read, or are none.
    pub fn read(path: &Path) -> Result<Self> {
        read(path)
    }
}

fn read<T: DeserializeOwned>(path: &Path) -> Result<T> {
    let bytes = read_bytes(path).map_err(|why| Error::input(path.display(), why))?;
    json::check_memory(&bytes).map_err(|why| Error::input(path.display(), why))?;
    serde_json::from_slice(&bytes).map_err(|e| no_results(path, e))
}

fn no_results(path: &Path, why: impl Display) -> Error {
    Error::input(path.display(), format!("is no results file: {why}"))
        .remedy("name a file that `phylux run -o` has written")
}

/// Reads all of the results at `path`. Errors: they cannot be read, or are none.
pub fn read_json(path: &Path) -> Result<RunResult> {
    let result: RunResult = read(path)?;
    match result.is_whole() {
        true => Ok(result),
        false => Err(no_results(path, "a list has not one entry for each band")),
    }
}
