//! Files that are written whole or not at all: to a temporary file beside the place, renamed when all
//! of it is on the disk.

use std::{
    collections::HashSet,
    fs,
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
};

use crate::error::{Error, Result};

/// How the names of temporary files and folders begin.
pub const TEMPORARY: &str = ".phylux-";
/// How those begin that are in the folder of a sweep, where one process works at a time: what it finds of them when
/// it begins was left behind.
pub const OF_SWEEP: &str = ".phylux-sweep-";

/// The file or folder on the disk that an unfinished output is written to.
#[derive(Clone, Debug)]
pub enum Temporary {
    /// A file.
    File(PathBuf),
    /// A folder with all that is in it.
    Folder(PathBuf),
    /// A folder that goes away only if it is empty.
    IfEmpty(PathBuf),
}

/// Files that a command has read: no output may take the place of one.
#[derive(Clone, Debug, Default)]
pub struct FilesRead(HashSet<PathBuf>);

impl FilesRead {
    /// These files, by whichever links they are named.
    pub fn new<'a>(files: impl IntoIterator<Item = &'a PathBuf>) -> Self {
        Self(files.into_iter().filter_map(|file| fs::canonicalize(file).ok()).collect())
    }

    /// Error: what stands at `place`, a path without links, was read.
    pub fn check(&self, place: &Path) -> Result<()> {
        if !self.0.contains(place) {
            return Ok(());
        }
        let problem = "is a file that is read, which the output would replace";
        Err(Error::input(place.display(), problem).remedy("write elsewhere"))
    }
}

/// A file to be written whole or not at all. Made before the work, so that a folder that is missing
/// or closed is found then.
#[derive(Debug)]
pub struct OutputFile {
    path: PathBuf,
    target: Target,
}

#[derive(Debug)]
enum Target {
    /// Goes to this place, a path without links, when it is whole.
    Temporary(tempfile::NamedTempFile, PathBuf),
    /// A device or pipe, which no rename can replace.
    Special,
    /// The standard output.
    Standard,
}

impl OutputFile {
    /// Prepares to write `path`. Errors: it is a directory or write-protected, its folder is missing
    /// or not writable.
    pub fn create(path: &Path) -> Result<Self> {
        Self::with_prefix(path, TEMPORARY)
    }

    /// The standard output.
    pub fn standard() -> Self {
        Self { path: PathBuf::from("standard output"), target: Target::Standard }
    }

    /// The same in a folder that belongs to a sweep, where no link leads elsewhere.
    pub fn of_sweep(path: &Path) -> Result<Self> {
        match fs::symlink_metadata(path) {
            Ok(kind) if !kind.is_file() => {
                Err(Error::input(path.display(), "is not a file that a sweep has made")
                    .remedy("move it away"))
            }
            _ => Self::with_prefix(path, OF_SWEEP),
        }
    }

    fn with_prefix(path: &Path, prefix: &str) -> Result<Self> {
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
            // a rename would replace a link
            Ok(_) => fs::canonicalize(path),
            Err(_) => new_place(path),
        };
        let old = fs::metadata(path).ok();
        let place = match place {
            Ok(place) => place,
            Err(e) if e.kind() == io::ErrorKind::NotFound => {
                let problem = format!("there is no folder {}", folder_of(path).display());
                return fail(problem, "create it, or write elsewhere");
            }
            Err(e) => return fail(format!("cannot be written: {e}"), "write elsewhere"),
        };
        match temporary(&folder_of(&place), prefix, old.as_ref()) {
            Ok(file) => {
                Ok(Self { path: path.to_path_buf(), target: Target::Temporary(file, place) })
            }
            Err(e) => fail(format!("cannot be written: {}", e.kind()), "write elsewhere"),
        }
    }

    /// Where the file will be, a path without links; none for a device, a pipe or the standard output.
    pub fn place(&self) -> Option<&Path> {
        match &self.target {
            Target::Temporary(_, place) => Some(place),
            Target::Special | Target::Standard => None,
        }
    }

    /// What to remove where the process ends before it is dropped.
    pub fn temporary(&self) -> Option<Temporary> {
        match &self.target {
            Target::Temporary(file, _) => Some(Temporary::File(file.path().to_path_buf())),
            Target::Special | Target::Standard => None,
        }
    }

    /// Writes the content and puts the file in its place, where nothing of `read` may be.
    pub fn write(
        self,
        read: &FilesRead,
        content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<()> {
        let mut file = self.open(read)?;
        let written = content(&mut file);
        file.finish(written)
    }

    /// Begins to write it. Error: it would replace one of the files `read`.
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
    Error::run(path.display(), format!("cannot be written: {e}"))
}

/// A file that is being written, and is in its place only when it is finished.
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
    /// Puts the file in its place, if all of it could be written.
    pub fn finish(self, written: io::Result<()>) -> Result<()> {
        let Self { path, writer } = self;
        let target = written.and_then(|()| writer.into_inner().map_err(io::Error::from));
        let placed = target.and_then(|target| match target {
            Opened::Special(_) => Ok(()),
            Opened::Standard(mut output) => whoever_reads(output.flush(), ()),
            Opened::Temporary(file, place) => {
                file.as_file().sync_all()?;
                file.persist(&place).map(drop).map_err(|e| e.error)
            }
        });
        placed.map_err(|e| unwritten(&path, e))
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

/// Whoever stops reading the standard output has read enough: that is `done`.
fn whoever_reads<T>(written: io::Result<T>, done: T) -> io::Result<T> {
    match written {
        Err(e) if e.kind() == io::ErrorKind::BrokenPipe => Ok(done),
        written => written,
    }
}

/// The folder that a path is in.
pub fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_path_buf(),
        _ => PathBuf::from("."),
    }
}

/// The place of a file that is not there yet.
fn new_place(path: &Path) -> io::Result<PathBuf> {
    let name = match path.file_name() {
        Some(name) if !path.as_os_str().as_encoded_bytes().ends_with(b"/") => name,
        _ => return Err(io::Error::other("it does not name a file")),
    };
    let place = fs::canonicalize(folder_of(path))?.join(name);
    // a name that is too long, or passes through a file, is found now and not when all is done
    match fs::symlink_metadata(&place) {
        Err(e) if e.kind() != io::ErrorKind::NotFound => {
            Err(io::Error::other(e.kind().to_string()))
        }
        _ => Ok(place),
    }
}

/// A file that will stand in the place of `old`, if there is one.
fn temporary(
    folder: &Path,
    prefix: &str,
    old: Option<&fs::Metadata>,
) -> io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(prefix);
    // as any other new file, for the umask to restrict; the default is for secrets
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let file = builder.tempfile_in(folder)?;
    old.map_or(Ok(()), |old| keep_mode(file.as_file(), old))?;
    Ok(file)
}

/// Lets read and write a file whoever might do so with the `old` one, which it will replace.
#[cfg(unix)]
pub fn keep_mode(file: &fs::File, old: &fs::Metadata) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(fs::Permissions::from_mode(old.permissions().mode() & 0o777))
}

/// Elsewhere a file has the rights of its folder.
#[cfg(not(unix))]
pub fn keep_mode(_: &fs::File, _: &fs::Metadata) -> io::Result<()> {
    Ok(())
}
