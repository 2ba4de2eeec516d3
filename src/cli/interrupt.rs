//! Ctrl-C and SIGTERM: an orderly end while photons fly, an immediate one at any other time. Nothing
//! stays behind either way.

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

/// The exit code of a command that was interrupted: 128 and the number of the signal of Ctrl-C.
pub(super) const EXIT_CODE: u8 = 130;

/// The path that stands for the standard output.
pub(super) const STANDARD_OUTPUT: &str = "-";

/// Error: `path` is that of the standard output, where a folder is to be.
pub(super) fn check_folder(path: &Path) -> Result<()> {
    match path == Path::new(STANDARD_OUTPUT) {
        true => {
            Err(Error::input("-", "is the standard output, and several files are to be written")
                .remedy("name a folder"))
        }
        false => Ok(()),
    }
}

/// Watches for signals from when it is installed to the end of the process.
pub(super) struct Interrupt {
    stop: Arc<AtomicBool>,
    phase: Arc<Mutex<Phase>>,
}

/// What a signal finds the command at.
struct Phase {
    /// It looks at `stop` now and then.
    listening: bool,
    /// Results may have been put in their place.
    writing: bool,
    /// Temporary files and folders.
    temporary: Vec<Temporary>,
}

impl Interrupt {
    /// Error: the system gives no signals.
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

    /// Set once the command should end.
    pub fn stop(&self) -> &AtomicBool {
        &self.stop
    }

    /// Prepares to write a file, or `-`, which is the standard output, and removes what that has made at an immediate end.
    pub fn file(&self, path: &Path) -> Result<OutputFile> {
        if path == Path::new(STANDARD_OUTPUT) {
            terminal::take_output()?;
            return Ok(OutputFile::standard());
        }
        self.make(|| OutputFile::create(path), |file| file.temporary())
    }

    /// Prepares to write files into a folder, and removes what that has made at an immediate end.
    pub fn folder(&self, path: &Path) -> Result<OutputFolder> {
        check_folder(path)?;
        self.make(|| OutputFolder::create(path), |folder| Some(folder.temporary()))
    }

    /// Makes something that an immediate end removes; such an end comes before or after, not meanwhile.
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

    /// Does `work`, which looks at the stop flag.
    pub fn listening<T>(&self, work: impl FnOnce() -> T) -> T {
        self.change(|phase| phase.listening = true);
        let done = work();
        self.change(|phase| phase.listening = false);
        done
    }

    /// From here on results are put in their places.
    pub fn writing(&self) {
        self.change(|phase| phase.writing = true);
    }

    fn change<T>(&self, change: impl FnOnce(&mut Phase) -> T) -> T {
        change(&mut self.phase.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Drop for Interrupt {
    /// A command does not end while an immediate end removes what it has made: that ends the process.
    fn drop(&mut self) {
        self.change(|_| ());
    }
}

/// Removes a folder into which another thread may still write: under another name it finds it no more.
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
