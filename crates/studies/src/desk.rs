//! What surrounds work that writes files: what may end it early, what is then removed, and who hears
//! of its progress and its warnings. The command line and the Python package each have a desk of
//! their own for the same work.

use std::{
    fs, io,
    path::Path,
    sync::{Arc, Mutex, atomic::AtomicBool},
};

use phylux_core::{
    error::{Error, NOTHING_WRITTEN, Result, lock},
    transport::simulate::Progress,
};
use phylux_files::{
    held_file::HeldFile,
    output::{OutputFile, Temporary},
    result_file::OutputFolder,
    unfinished::GONE,
};

/// Path that stands for the standard output.
pub const STANDARD_OUTPUT: &str = "-";

/// Hears of work at a [`Desk`].
pub trait Listener: Send + Sync {
    /// A part of the work begins, such as `reading the scene`.
    fn begin(&self, part: &str);
    /// How far this part has come.
    fn progress(&self, progress: Progress);
    /// The part has ended.
    fn end(&self);
    /// Something to know before the results are trusted, a sentence.
    fn warn(&self, warning: &str);
    /// Something to know while the work goes on, a sentence.
    fn note(&self, note: &str);
    /// Takes the standard output for a result. Error: there is none, or another result has it.
    fn take_output(&self) -> Result<()>;
}

/// Where work is done that writes files.
pub struct Desk {
    stop: Arc<AtomicBool>,
    state: Arc<Mutex<DeskState>>,
    listener: Arc<dyn Listener>,
}

/// What the work is doing when it is asked to end.
#[derive(Default)]
pub struct DeskState {
    /// Whether the work looks at the stop flag now and then, and keeps something when it ends.
    pub listening: bool,
    /// What is said if it does not end in time, where it may not take as long as it needs.
    pub late: Option<Error>,
    /// Whether results may already be in their places.
    writing: bool,
    /// Temporary files and folders, to be removed at an immediate end.
    temporary: Vec<Temporary>,
}

impl Desk {
    /// Makes a desk whose work ends early once `stop` is set.
    pub fn new(stop: Arc<AtomicBool>, listener: Arc<dyn Listener>) -> Self {
        Self { stop, state: Arc::default(), listener }
    }

    /// Flag that is set once the work should end.
    pub fn stop(&self) -> &AtomicBool {
        &self.stop
    }

    /// What the work is doing, for a handler of signals.
    pub fn state(&self) -> Arc<Mutex<DeskState>> {
        self.state.clone()
    }

    /// Does `work`, of which the listener hears as `part`; how far it has come is told to the
    /// function that `work` gets.
    pub fn during<T>(&self, part: &str, work: impl FnOnce(&(dyn Fn(Progress) + Sync)) -> T) -> T {
        self.listener.begin(part);
        let done = work(&|progress| self.listener.progress(progress));
        self.listener.end();
        done
    }

    /// Says that another part of the same work begins.
    pub fn begin(&self, part: &str) {
        self.listener.begin(part);
    }

    /// Tells the listener of warnings, sentences.
    pub fn warn(&self, warnings: &[String]) {
        warnings.iter().for_each(|warning| self.listener.warn(warning));
    }

    /// Tells the listener of something to know while the work goes on.
    pub fn note(&self, note: &str) {
        self.listener.note(note);
    }

    /// Prepares to write a file, or the standard output if `path` is `-`. What is prepared is
    /// removed if the work ends at once. Errors: the file cannot be written; the standard output is
    /// taken.
    pub fn file(&self, path: &Path) -> Result<OutputFile> {
        if path == Path::new(STANDARD_OUTPUT) {
            self.listener.take_output()?;
            return Ok(OutputFile::standard());
        }
        self.make(|| OutputFile::create(path), |file| file.temporary())
    }

    /// Prepares to write files into a folder. What is prepared is removed if the work ends at once.
    /// Error: it cannot be written.
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

    /// Makes something that is removed if the work ends at once; such an end waits while `make` is
    /// at work. Error: that of `make`.
    pub fn make<T>(
        &self,
        make: impl FnOnce() -> Result<T>,
        temporary: impl FnOnce(&T) -> Option<Temporary>,
    ) -> Result<T> {
        self.change(|state| {
            let made = make()?;
            state.temporary.extend(temporary(&made));
            Ok(made)
        })
    }

    /// Does `work`, which looks at the stop flag and has something to keep: a first signal meanwhile
    /// only sets the flag. If `late` is given, it is said where the work does not end in time.
    pub fn listening<T>(&self, late: Option<Error>, work: impl FnOnce() -> T) -> T {
        self.change(|state| (state.listening, state.late) = (true, late));
        let done = work();
        self.change(|state| state.listening = false);
        done
    }

    /// Says that from here on results are put in their places.
    pub fn writing(&self) {
        self.change(|state| state.writing = true);
    }

    fn change<T>(&self, change: impl FnOnce(&mut DeskState) -> T) -> T {
        change(&mut lock(&self.state))
    }
}

impl Drop for Desk {
    /// Waits while an immediate end is removing what the work has made: it then ends the process, so
    /// that the work cannot end otherwise.
    fn drop(&mut self) {
        self.change(|_| ());
    }
}

impl DeskState {
    /// Removes what the work has made, and returns what is said of its end.
    pub fn undo(&self) -> Error {
        for path in &self.temporary {
            let _ = match path {
                Temporary::File(path) => fs::remove_file(path),
                Temporary::Folder(path) => remove_folder(path),
                Temporary::IfEmpty(path) => fs::remove_dir(path),
            };
        }
        match (&self.late, self.writing) {
            (Some(late), _) if self.listening => late.clone(),
            (_, true) => Error::interrupted("run", "results were being written"),
            (_, false) => Error::interrupted("run", NOTHING_WRITTEN),
        }
    }
}

/// Refuses the standard output as `path`, where a folder is needed.
pub fn check_folder(path: &Path) -> Result<()> {
    match path == Path::new(STANDARD_OUTPUT) {
        true => {
            Err(Error::input("-", "is the standard output, and several files are to be written")
                .remedy("name a folder"))
        }
        false => Ok(()),
    }
}

/// Removes a folder that another thread may still write into: once the folder has another name,
/// that thread no longer finds it.
fn remove_folder(path: &Path) -> io::Result<()> {
    let gone = path.with_extension(GONE);
    fs::rename(path, &gone)?;
    fs::remove_dir_all(gone)
}
