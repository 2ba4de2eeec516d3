//! The native part of the Python package `phylux`: it loads scenes from the JSON of a scene file
//! with meshes in memory, runs them so that Ctrl-C ends the run, and returns results as flat
//! arrays. The interface for users is written in Python, in `phylux/`.

#![deny(unsafe_code)]

mod errors;
mod result;
mod scene;
mod watched;

use std::ffi::OsString;

use pyo3::prelude::*;

/// Runs the command line and returns its exit code. It is meant for a process of its own.
#[pyfunction]
fn main(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| phylux::cli::main_from(arguments))
}

#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_function(wrap_pyfunction!(main, module)?)?;
    module.add_function(wrap_pyfunction!(scene::load, module)?)?;
    module.add_function(wrap_pyfunction!(scene::write_obj, module)?)?;
    module.add_class::<scene::Loaded>()?;
    module.add_class::<result::Found>()
}
