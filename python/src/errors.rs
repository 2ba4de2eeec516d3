//! Turns errors of the library into the exceptions of Python that `phylux/errors.py` defines.

use phylux::{Error, ErrorKind};
use pyo3::{exceptions::PyKeyboardInterrupt, prelude::*};

/// Returns the exception for an error, with its message and, as `.place`, its place.
pub fn exception(py: Python<'_>, error: &Error) -> PyErr {
    let name = match error.kind() {
        ErrorKind::Input => "InputError",
        ErrorKind::Run => "RunError",
        ErrorKind::Interrupted => return PyKeyboardInterrupt::new_err(error.to_string()),
    };
    let made = || -> PyResult<PyErr> {
        let class = py.import("phylux.errors")?.getattr(name)?;
        // an option of the command line is an argument of the same name in Python
        let error = match error.place().strip_prefix("--") {
            Some(option) => &error.clone().at(option.replace('-', "_")),
            None => error,
        };
        Ok(PyErr::from_value(class.call1((error.to_string(), error.place()))?))
    };
    made().unwrap_or_else(|failed| failed)
}

/// Turns a result of the library into a result of Python.
pub fn raised<T>(py: Python<'_>, result: phylux::Result<T>) -> PyResult<T> {
    result.map_err(|error| exception(py, &error))
}
