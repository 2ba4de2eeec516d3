//! Ctrl-C and SIGTERM. A signal ends a command at once, unless the command has something to keep: a
//! run with a checkpoint, and a sweep, then end in an orderly way, and at once at a second signal. No
//! temporary file stays behind either way.

use std::{
    fs, io,
    path::Path,
    process,
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, Ordering},
    },
    thread::sleep,
    time::{Duration, Instant},
};

use cpu_time::ProcessTime;

use super::terminal;
use phylux_core::error::{Error, NOTHING_WRITTEN, Result, lock};
use phylux_files::{
    held_file::HeldFile,
    output::{OutputFile, Temporary},
    result_file::OutputFolder,
    unfinished::GONE,
};

/// Exit code of a command that was interrupted: 128 plus the number of the signal of Ctrl-C.
pub(super) const EXIT_CODE: u8 = 130;

/// How long a command may take to end in an orderly way, unless it may take as long as it needs: CPU
/// time, or time where it waits for something else.
const PATIENCE: Duration = Duration::from_millis(100);
const WAITING: Duration = Duration::from_secs(10);

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
    /// Whether the command looks at `stop` now and then, and keeps something when it ends.
    listening: bool,
    /// What is said if it does not end in time, where it may not take as long as it needs.
    late: Option<Error>,
    /// Whether results may already be in their places.
    writing: bool,
    /// Temporary files and folders, to be removed at an immediate end.
    temporary: Vec<Temporary>,
}

impl Interrupt {
    /// Begins to watch for signals. Error: the system does not allow it.
    pub fn install() -> Result<Self> {
        let stop = Arc::new(AtomicBool::new(false));
        let phase = Phase { listening: false, late: None, writing: false, temporary: Vec::new() };
        let phase = Arc::new(Mutex::new(phase));
        let (flag, current) = (stop.clone(), phase.clone());
        ctrlc::set_handler(move || {
            let again = flag.swap(true, Ordering::Relaxed);
            let phase = || lock(&current);
            let is_late = |phase: &Phase| phase.listening && phase.late.is_some();
            if again || !phase().listening {
                phase().end();
            }
            let (worked, waited) = (ProcessTime::now(), Instant::now());
            while is_late(&phase()) && worked.elapsed() < PATIENCE && waited.elapsed() < WAITING {
                sleep(Duration::from_millis(5));
            }
            let phase = phase();
            if is_late(&phase) {
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

    /// Says that this process is at work in a folder. Error: another one is.
    pub fn hold(&self, folder: &Path) -> Result<HeldFile> {
        self.make(
            || HeldFile::folder(folder),
            |held| (!held.kept).then(|| Temporary::File(held.place.clone())),
        )
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

    /// Does `work`, which looks at the stop flag and has something to keep: a first signal meanwhile
    /// only sets the flag. If `late` is given, it is said where the work does not end in time.
    pub fn listening<T>(&self, late: Option<Error>, work: impl FnOnce() -> T) -> T {
        self.change(|phase| (phase.listening, phase.late) = (true, late));
        let done = work();
        self.change(|phase| phase.listening = false);
        done
    }

    /// Says that from here on results are put in their places.
    pub fn writing(&self) {
        self.change(|phase| phase.writing = true);
    }

    fn change<T>(&self, change: impl FnOnce(&mut Phase) -> T) -> T {
        change(&mut lock(&self.phase))
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
    let gone = path.with_extension(GONE);
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
        let error = match (&self.late, self.writing) {
            (Some(late), _) if self.listening => late.clone(),
            (_, true) => Error::interrupted("run", "results were being written"),
            (_, false) => Error::interrupted("run", NOTHING_WRITTEN),
        };
        terminal::clear_line();
        terminal::fail(&error);
        process::exit(EXIT_CODE.into())
    }
}
