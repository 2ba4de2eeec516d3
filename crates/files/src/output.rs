//! Writes files completely or not at all: the content goes to a temporary file in the same folder,
//! which is renamed when all of it is on the disk. Several files that belong together are first all
//! completed, and then all renamed.

use std::{
    collections::HashSet,
    fs,
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
};

use super::unfinished::{remove_leftovers, unfinished_file};
use phylux_core::error::{Error, Result};

/// What is wrong with a file that would be replaced without having been asked for by its name, and
/// that no command has written.
pub const NOT_OURS: &str = "is not what phylux has written there";

/// A file or folder on the disk that holds unfinished output.
#[derive(Clone, Debug)]
pub enum Temporary {
    /// A file.
    File(PathBuf),
    /// A folder with everything in it.
    Folder(PathBuf),
    /// A folder that is removed only if it is empty.
    IfEmpty(PathBuf),
}

/// The files that a command has read; no output may replace one of them.
#[derive(Clone, Debug, Default)]
pub struct FilesRead(HashSet<PathBuf>);

impl FilesRead {
    /// Collects these files; links in their paths are resolved.
    pub fn new<'a>(files: impl IntoIterator<Item = &'a PathBuf>) -> Self {
        Self(files.into_iter().filter_map(|file| fs::canonicalize(file).ok()).collect())
    }

    /// Checks that output may be written to `place`, a path without links. Error: the command has
    /// read the file there.
    pub fn check(&self, place: &Path) -> Result<()> {
        if !self.0.contains(place) {
            return Ok(());
        }
        let problem = "is a file that is read, which the output would replace";
        Err(Error::input(place.display(), problem).remedy("write elsewhere"))
    }
}

/// A file that will be written completely or not at all. It is created before the work begins, so
/// that a folder that is missing or not writable is found at once.
#[derive(Debug)]
pub struct OutputFile {
    path: PathBuf,
    target: Target,
}

#[derive(Debug)]
enum Target {
    /// A temporary file, and the path without links that it is moved to when it is complete.
    Temporary(tempfile::NamedTempFile, PathBuf),
    /// A device or a pipe, which a renamed file cannot replace.
    Special,
    /// The standard output.
    Standard,
}

impl OutputFile {
    /// Prepares to write the file `path`. Errors: `path` is a directory or write-protected, or its
    /// folder is missing or not writable.
    pub fn create(path: &Path) -> Result<Self> {
        let output = Self::prepare(path)?;
        if let Some(place) = output.place() {
            remove_leftovers(&folder_of(place));
        }
        Ok(output)
    }

    /// Returns an output that is written to the standard output.
    pub fn standard() -> Self {
        Self { path: PathBuf::from("standard output"), target: Target::Standard }
    }

    /// Like [`create`](Self::create), in the folder of a sweep, where `path` may not be a link.
    /// Error, in addition: something other than a plain file stands at `path`.
    pub fn of_sweep(path: &Path) -> Result<Self> {
        match fs::symlink_metadata(path) {
            Ok(kind) if !kind.is_file() => {
                Err(Error::input(path.display(), "is not a file that a sweep has made")
                    .remedy("move it away"))
            }
            _ => Self::prepare(path),
        }
    }

    fn prepare(path: &Path) -> Result<Self> {
        let fail = |problem: String, remedy: &str| {
            Err(Error::input(path.display(), problem).remedy(remedy))
        };
        let place = match fs::metadata(path) {
            Ok(kind) if kind.is_dir() => {
                return fail("is a directory".into(), "name a file in it");
            }
            Ok(kind) if !kind.is_file() => {
                return Ok(Self { path: path.to_path_buf(), target: Target::Special });
            }
            Ok(kind) if kind.permissions().readonly() => {
                return fail("is write-protected".into(), "write elsewhere");
            }
            _ => writable_place(path)?,
        };
        let old = fs::metadata(path).ok();
        match unfinished_file(&folder_of(&place), old.as_ref()) {
            Ok(file) => {
                Ok(Self { path: path.to_path_buf(), target: Target::Temporary(file, place) })
            }
            Err(e) => fail(format!("cannot be written: {}", e.kind()), "write elsewhere"),
        }
    }

    /// Returns the path that the file will have, without links; `None` for a device, a pipe or the
    /// standard output.
    pub fn place(&self) -> Option<&Path> {
        match &self.target {
            Target::Temporary(_, place) => Some(place),
            Target::Special | Target::Standard => None,
        }
    }

    /// Returns the temporary file that must be removed if the process ends before this value is
    /// dropped; `None` for a device, a pipe or the standard output.
    pub fn temporary(&self) -> Option<Temporary> {
        match &self.target {
            Target::Temporary(file, _) => Some(Temporary::File(file.path().to_path_buf())),
            Target::Special | Target::Standard => None,
        }
    }

    /// Writes the content and moves the file to its place. Errors: the file would replace one of
    /// the files in `read`, or it cannot be written.
    pub fn write(
        self,
        read: &FilesRead,
        content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<()> {
        self.complete(read, content)?.put()
    }

    /// Writes the content, but does not move the file to its place yet. Errors: the file would
    /// replace one of the files in `read`, or it cannot be written.
    pub fn complete(
        self,
        read: &FilesRead,
        content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<CompleteFile> {
        let mut file = self.open(read)?;
        let written = content(&mut file);
        file.complete(written)
    }

    /// Starts to write the file. Errors: it would replace one of the files in `read`, or a device
    /// or pipe cannot be opened.
    pub fn open(self, read: &FilesRead) -> Result<OpenFile> {
        self.place().map_or(Ok(()), |place| read.check(place))?;
        let Self { path, target } = self;
        let target = match target {
            Target::Special => fs::OpenOptions::new().write(true).open(&path).map(Opened::Special),
            Target::Standard => Ok(Opened::Standard(io::stdout())),
            Target::Temporary(file, place) => Ok(Opened::Temporary(file, place)),
        };
        let target = target.map_err(|e| unwritten(&path, e))?;
        Ok(OpenFile { path, writer: BufWriter::with_capacity(1 << 16, target) })
    }
}

fn unwritten(path: &Path, e: io::Error) -> Error {
    Error::unwritable(path.display(), e)
}

/// A file that is being written; it is moved to its place only by [`finish`](Self::finish).
#[derive(Debug)]
pub struct OpenFile {
    path: PathBuf,
    writer: BufWriter<Opened>,
}

#[derive(Debug)]
enum Opened {
    Temporary(tempfile::NamedTempFile, PathBuf),
    Special(fs::File),
    Standard(io::Stdout),
}

impl OpenFile {
    /// Moves the file to its place, if `written` says that all of its content could be written.
    /// Error: it could not be written completely.
    pub fn finish(self, written: io::Result<()>) -> Result<()> {
        self.complete(written)?.put()
    }

    /// Ends the content of the file, which does not have its place yet, if `written` says that all
    /// of it could be written. Error: it could not be written completely.
    pub fn complete(self, written: io::Result<()>) -> Result<CompleteFile> {
        let Self { path, writer } = self;
        let target = written.and_then(|()| writer.into_inner().map_err(io::Error::from));
        let complete = target.and_then(|target| match target {
            Opened::Special(_) => Ok(None),
            Opened::Standard(mut output) => whoever_reads(output.flush().map(|()| None), None),
            Opened::Temporary(file, place) => {
                file.as_file().sync_all()?;
                Ok(Some((file, place)))
            }
        });
        match complete {
            Ok(waiting) => Ok(CompleteFile { path, waiting }),
            Err(e) => Err(unwritten(&path, e)),
        }
    }
}

/// A file that holds all of its content and waits to be moved to its place. Files that belong
/// together are completed first and moved then, so that no end of the process leaves some of them.
#[derive(Debug)]
pub struct CompleteFile {
    path: PathBuf,
    /// The temporary file and its place; `None` for a device, a pipe or the standard output.
    waiting: Option<(tempfile::NamedTempFile, PathBuf)>,
}

impl CompleteFile {
    /// Moves the file to its place.
    pub fn put(self) -> Result<()> {
        let Some((file, place)) = self.waiting else { return Ok(()) };
        file.persist(&place).map(drop).map_err(|e| unwritten(&self.path, e.error))
    }
}

impl Write for OpenFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.writer.write(bytes)
    }
    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

impl Write for Opened {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Self::Temporary(file, _) => file.write(bytes),
            Self::Special(file) => file.write(bytes),
            Self::Standard(output) => whoever_reads(output.write(bytes), bytes.len()),
        }
    }
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Turns the error of a broken pipe into `done`: whoever stops reading the standard output has read
/// enough.
fn whoever_reads<T>(written: io::Result<T>, done: T) -> io::Result<T> {
    match written {
        Err(e) if e.kind() == io::ErrorKind::BrokenPipe => Ok(done),
        written => written,
    }
}

/// Returns the folder that a path is in; `.` for a plain file name.
pub fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_path_buf(),
        _ => PathBuf::from("."),
    }
}

/// Returns the place that a file has or will have, without links: a rename would replace a link
/// itself. Errors: there is no such folder, or `path` cannot be the name of a file.
pub fn place_of(path: &Path) -> io::Result<PathBuf> {
    fs::canonicalize(path).or_else(|_| new_place(path, MOST_LINKS))
}

/// Returns the [place](place_of) of a file that is to be written. Error: there is no such folder, or
/// `path` cannot be the name of a file.
pub fn writable_place(path: &Path) -> Result<PathBuf> {
    let fail = |problem: String, remedy| Error::input(path.display(), problem).remedy(remedy);
    place_of(path).map_err(|e| match e.kind() {
        io::ErrorKind::NotFound => {
            let problem = format!("there is no folder {}", folder_of(path).display());
            fail(problem, "create it, or write elsewhere")
        }
        _ => fail(format!("cannot be written: {e}"), "write elsewhere"),
    })
}

/// The most links that are followed from one to the next, as on Linux.
const MOST_LINKS: usize = 40;

/// Returns the place of a file that does not exist yet.
fn new_place(path: &Path, links: usize) -> io::Result<PathBuf> {
    let name = match path.file_name() {
        Some(name) if !path.as_os_str().as_encoded_bytes().ends_with(b"/") => name,
        _ => return Err(io::Error::other("it does not name a file")),
    };
    let place = fs::canonicalize(folder_of(path))?.join(name);
    // finds a name that is too long, or that passes through a file, now and not after the work
    match fs::symlink_metadata(&place) {
        Err(e) if e.kind() != io::ErrorKind::NotFound => {
            Err(io::Error::other(e.kind().to_string()))
        }
        Ok(kind) if kind.is_symlink() => {
            let strange = || io::Error::other("it is a link that leads nowhere");
            let links = links.checked_sub(1).ok_or_else(strange)?;
            let target = folder_of(&place).join(fs::read_link(&place)?);
            new_place(&target, links).map_err(|_| strange())
        }
        _ => Ok(place),
    }
}

/// Refuses an output that would take the place of another output, or of a file that is read. It is
/// called before any work. (Even where a command does not check this here, [`OutputFile`] refuses
/// to replace a file that was read.)
pub fn check_places(places: &[PathBuf], read: &FilesRead) -> Result<()> {
    let mut named = HashSet::new();
    for place in places {
        if !named.insert(place) {
            return Err(
                Error::input(place.display(), "is named for two outputs").remedy("write elsewhere")
            );
        }
        read.check(place)?;
    }
    Ok(())
}
