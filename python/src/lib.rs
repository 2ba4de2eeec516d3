//! The native part of the Python package `phylux`: it loads scenes from the JSON of a scene file
//! with meshes in memory, runs them so that Ctrl-C ends the run, and returns results as flat
//! arrays. The interface for users is written in Python, in `phylux/`.

#![deny(unsafe_code)]

mod errors;
mod result;
mod runs;
mod scene;
mod studies;
mod watched;

use std::ffi::OsString;

use numpy::PyArray1;
use phylux::{math::Curve, scene::Prospect};
use pyo3::prelude::*;

/// Runs the command line and returns its exit code. It is meant for a process of its own.
#[pyfunction]
fn main(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| phylux::cli::main_from(arguments))
}

/// Computes the reflectance and the transmittance of a leaf from 400 to 2500 nm. `contents` are those
/// of `phylux::scene::Prospect`, in its order.
#[pyfunction]
fn prospect<'py>(py: Python<'py>, contents: [f64; 7]) -> PyResult<[Bound<'py, PyArray1<f64>>; 3]> {
    let [n, chlorophyll, carotenoids, anthocyanins, brown, water, dry_matter] = contents;
    let leaf = Prospect { n, chlorophyll, carotenoids, anthocyanins, brown, water, dry_matter };
    let spectra = errors::raised(py, leaf.spectra())?;
    let places = spectra.reflectance.places();
    let values = |curve: &Curve| places.iter().map(|&nm| curve.at(nm)).collect();
    let columns: [Vec<f64>; 3] =
        [places.to_vec(), values(&spectra.reflectance), values(&spectra.transmittance)];
    Ok(columns.map(|column| PyArray1::from_vec(py, column)))
}

#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_function(wrap_pyfunction!(main, module)?)?;
    module.add_function(wrap_pyfunction!(prospect, module)?)?;
    module.add_function(wrap_pyfunction!(result::quantities, module)?)?;
    module.add_function(wrap_pyfunction!(scene::load, module)?)?;
    module.add_function(wrap_pyfunction!(scene::write_file, module)?)?;
    module.add_function(wrap_pyfunction!(scene::write_obj, module)?)?;
    module.add_function(wrap_pyfunction!(studies::year, module)?)?;
    module.add_function(wrap_pyfunction!(studies::merged_year, module)?)?;
    module.add_function(wrap_pyfunction!(studies::plot, module)?)?;
    module.add_function(wrap_pyfunction!(studies::calibrate, module)?)?;
    module.add_function(wrap_pyfunction!(studies::charts, module)?)?;
    module.add_class::<scene::Loaded>()?;
    module.add_class::<scene::Planned>()?;
    module.add_class::<result::Found>()
}
