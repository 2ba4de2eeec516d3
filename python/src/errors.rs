//! Turns errors of the library into the exceptions of Python that `phylux/errors.py` defines, and
//! spells the names of settings and commands as arguments and calls.

use phylux::{
    Error, ErrorKind,
    words::{Call, Said, Setting, SettingValue, Spelling, Words},
};
use pyo3::{exceptions::PyKeyboardInterrupt, prelude::*};

/// The spelling of Python.
pub struct InPython;

/// Returns the argument that a setting is in Python.
fn argument(name: &str) -> &str {
    match name {
        "group" => "groups",
        "power" => "factors",
        "from" => "from_",
        name => name,
    }
}

/// Returns an argument with what is said of its value, and `otherwise` behind it where nothing is.
fn given(Setting { name, value }: &Setting, otherwise: &str) -> String {
    let name = argument(name);
    match value {
        SettingValue::Unsaid => format!("{name}{otherwise}"),
        SettingValue::On => format!("{name}=True"),
        SettingValue::Is(value) if value.parse::<f64>().is_ok() => format!("{name}={value}"),
        SettingValue::Is(value) => format!("{name}=\"{value}\""),
    }
}

impl Spelling for InPython {
    fn setting(&self, setting: &Setting) -> String {
        format!("`{}`", given(setting, ""))
    }

    fn call(&self, Call { command, settings }: &Call) -> String {
        let function = match *command {
            "compare" | "mix" => format!("Result.{command}"),
            "plot" => "plot".into(),
            "sweep" => "px.sweep".into(),
            "trace" => "Scene.histories".into(),
            command => format!("Scene.{command}"),
        };
        let arguments: Vec<String> = settings.iter().map(|of| given(of, "=...")).collect();
        match arguments.is_empty() {
            true => format!("`{function}`"),
            false => format!("`{function}({})`", arguments.join(", ")),
        }
    }

    fn place(&self, setting: &Setting) -> String {
        argument(setting.name).into()
    }
}

/// Returns sentences in the spelling of Python.
pub fn spelled<'a>(sentences: impl IntoIterator<Item = &'a Words>) -> Vec<String> {
    sentences.into_iter().map(|words| words.spelled(&InPython)).collect()
}

/// Returns the exception for an error, with its place, its problem and its remedy.
pub fn exception(py: Python<'_>, error: &Error) -> PyErr {
    let said = error.said(&InPython);
    let name = match error.kind() {
        ErrorKind::Input => "InputError",
        ErrorKind::Run => "RunError",
        ErrorKind::Interrupted => return PyKeyboardInterrupt::new_err(said.to_string()),
    };
    let made = || {
        let sentence = said.to_string();
        let Said { place, problem, remedy } = said;
        py.import("phylux.errors")?.getattr(name)?.call1((sentence, place, problem, remedy))
    };
    made().map_or_else(|failed| failed, PyErr::from_value)
}

/// Turns a result of the library into a result of Python.
pub fn raised<T>(py: Python<'_>, result: phylux::Result<T>) -> PyResult<T> {
    result.map_err(|error| exception(py, &error))
}
