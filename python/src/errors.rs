//! Turns errors of the library into the exceptions of Python that `phylux/errors.py` defines.

use phylux::{Error, ErrorKind};
use pyo3::{exceptions::PyKeyboardInterrupt, prelude::*};

/// Returns the exception for an error, with its message in the words of Python and, as `.place`, its
/// place.
pub fn exception(py: Python<'_>, error: &Error) -> PyErr {
    let failed = match error.kind() {
        ErrorKind::Input => false,
        ErrorKind::Run => true,
        ErrorKind::Interrupted => return PyKeyboardInterrupt::new_err(error.to_string()),
    };
    let made = || {
        let of_command = py.import("phylux.errors")?.getattr("of_command")?;
        of_command.call1((failed, error.to_string(), error.place()))
    };
    made().map_or_else(|failed| failed, PyErr::from_value)
}

/// Turns a result of the library into a result of Python.
pub fn raised<T>(py: Python<'_>, result: phylux::Result<T>) -> PyResult<T> {
    result.map_err(|error| exception(py, &error))
}
