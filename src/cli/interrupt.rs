//! Ctrl-C and SIGTERM: an orderly end while photons fly, an immediate one at any other time. Nothing
//! stays behind either way.

use std::{
    fs,
    io::{self, Write},
    process,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
};

use crate::{
    error::{Error, Result},
    formats::output::Temporary,
};

/// What an interrupted command says.
pub(super) const NOTHING_WRITTEN: &str = "interrupted, nothing was written";

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

    /// What to remove at an immediate end, in this order.
    pub fn remove_at_end(&self, temporary: impl IntoIterator<Item = Temporary>) {
        self.change(|phase| phase.temporary.extend(temporary));
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

    fn change(&self, change: impl FnOnce(&mut Phase)) {
        change(&mut self.phase.lock().unwrap_or_else(PoisonError::into_inner));
    }
}

impl Phase {
    fn end(&self) -> ! {
        for path in &self.temporary {
            let _ = match path {
                Temporary::File(path) => fs::remove_file(path),
                Temporary::Folder(path) => fs::remove_dir_all(path),
                Temporary::IfEmpty(path) => fs::remove_dir(path),
            };
        }
        let what = if self.writing { "interrupted while writing" } else { NOTHING_WRITTEN };
        let _ = writeln!(io::stderr(), "error: run: {what}");
        process::exit(1)
    }
}
