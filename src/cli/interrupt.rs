//! Ctrl-C and SIGTERM. While light is traced, a signal ends the command in an orderly way; at any
//! other time, and at a second signal, at once. No temporary file stays behind either way.

use std::{
    fs, io,
    path::Path,
    process,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
};

use super::terminal;
use crate::{
    error::{Error, NOTHING_WRITTEN, Result},
    formats::{
        output::{OutputFile, Temporary},
        result_file::OutputFolder,
    },
};

/// Exit code of a command that was interrupted: 128 plus the number of the signal of Ctrl-C.
pub(super) const EXIT_CODE: u8 = 130;

/// Path that stands for the standard output.
pub(super) const STANDARD_OUTPUT: &str = "-";

/// Refuses the standard output as `path`, where a folder is needed.
pub(super) fn check_folder(path: &Path) -> Result<()> {
    match path == Path::new(STANDARD_OUTPUT) {
        true => {
            Err(Error::input("-", "is the standard output, and several files are to be written")
                .remedy("name a folder"))
        }
        false => Ok(()),
    }
}

/// Watches for signals, from its installation to the end of the process.
pub(super) struct Interrupt {
    stop: Arc<AtomicBool>,
    phase: Arc<Mutex<Phase>>,
}

/// What the command is doing when a signal comes.
struct Phase {
    /// Whether the command looks at `stop` now and then.
    listening: bool,
    /// Whether results may already be in their places.
    writing: bool,
    /// Temporary files and folders, to be removed at an immediate end.
    temporary: Vec<Temporary>,
}

impl Interrupt {
    /// Begins to watch for signals. Error: the system does not allow it.
    pub fn install() -> Result<Self> {
        let stop = Arc::new(AtomicBool::new(false));
        let phase = Phase { listening: false, writing: false, temporary: Vec::new() };
        let phase = Arc::new(Mutex::new(phase));
        let (flag, current) = (stop.clone(), phase.clone());
        ctrlc::set_handler(move || {
            let again = flag.swap(true, Ordering::Relaxed);
            let phase = current.lock().unwrap_or_else(PoisonError::into_inner);
            if again || !phase.listening {
                phase.end();
            }
        })
        .map_err(|e| Error::run("Ctrl-C", e))?;
        Ok(Self { stop, phase })
    }

    /// Flag that is set once the command should end.
    pub fn stop(&self) -> &AtomicBool {
        &self.stop
    }

    /// Prepares to write a file, or the standard output if `path` is `-`. What is prepared is
    /// removed if a signal ends the command at once.
    pub fn file(&self, path: &Path) -> Result<OutputFile> {
        if path == Path::new(STANDARD_OUTPUT) {
            terminal::take_output()?;
            return Ok(OutputFile::standard());
        }
        self.make(|| OutputFile::create(path), |file| file.temporary())
    }

    /// Prepares to write files into a folder. What is prepared is removed if a signal ends the
    /// command at once.
    pub fn folder(&self, path: &Path) -> Result<OutputFolder> {
        check_folder(path)?;
        self.make(|| OutputFolder::create(path), |folder| Some(folder.temporary()))
    }

    /// Makes something that is removed if a signal ends the command at once; such an end waits
    /// while `make` is at work.
    pub fn make<T>(
        &self,
        make: impl FnOnce() -> Result<T>,
        temporary: impl FnOnce(&T) -> Option<Temporary>,
    ) -> Result<T> {
        self.change(|phase| {
            let made = make()?;
            phase.temporary.extend(temporary(&made));
            Ok(made)
        })
    }

    /// Does `work`, which looks at the stop flag: a first signal meanwhile only sets the flag.
    pub fn listening<T>(&self, work: impl FnOnce() -> T) -> T {
        self.change(|phase| phase.listening = true);
        let done = work();
        self.change(|phase| phase.listening = false);
        done
    }

    /// Says that from here on results are put in their places.
    pub fn writing(&self) {
        self.change(|phase| phase.writing = true);
    }

    fn change<T>(&self, change: impl FnOnce(&mut Phase) -> T) -> T {
        change(&mut self.phase.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Drop for Interrupt {
    /// Waits while an immediate end is removing what the command has made: it then ends the
    /// process, so that the command cannot end otherwise.
    fn drop(&mut self) {
        self.change(|_| ());
    }
}

/// Removes a folder that another thread may still write into: once the folder has another name,
/// that thread no longer finds it.
fn remove_folder(path: &Path) -> io::Result<()> {
    let gone = path.with_extension("gone");
    fs::rename(path, &gone)?;
    fs::remove_dir_all(gone)
}

impl Phase {
    fn end(&self) -> ! {
        for path in &self.temporary {
            let _ = match path {
                Temporary::File(path) => fs::remove_file(path),
                Temporary::Folder(path) => remove_folder(path),
                Temporary::IfEmpty(path) => fs::remove_dir(path),
            };
        }
        let error = match self.writing {
            true => Error::interrupted("run", "results were being written"),
            false => Error::interrupted("run", NOTHING_WRITTEN),
        };
        terminal::fail(&error);
        process::exit(EXIT_CODE.into())
    }
}
