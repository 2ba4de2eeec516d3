//! Unfinished files and folders: their names, and what is left of them when a process is killed.
//!
//! Each has a name that nobody else has, and the process that fills it holds a lock of the system
//! on it. The lock ends with the process, however that ends, so an unfinished file without a lock
//! is a leftover, and the next command that writes into its folder removes it.

use std::{
    ffi::OsStr,
    fs::{self, File, TryLockError},
    io,
    path::Path,
};

/// How the names of unfinished files and folders begin and end. Between both stand random letters
/// and digits.
const BEGINNING: &str = ".phylux-";
const ENDING: &str = ".unfinished";
const RANDOM: usize = 12;
/// The ending of an unfinished folder that is being removed, without the dot.
pub const GONE: &str = "gone";
/// How often a name is tried that another process takes for a leftover.
const TRIES: usize = 16;

/// Returns whether this is the name of an unfinished file or folder of this program.
pub fn is_unfinished(name: &OsStr) -> bool {
    let middle = name.to_str().and_then(|name| {
        let name = name.strip_prefix(BEGINNING)?;
        name.strip_suffix(ENDING).or_else(|| name.strip_suffix(GONE)?.strip_suffix('.'))
    });
    middle.is_some_and(|m| m.len() == RANDOM && m.bytes().all(|b| b.is_ascii_alphanumeric()))
}

/// Creates an unfinished file in `folder`, with the access rights of the `old` file that it will
/// replace, if there is one. It is locked.
pub fn unfinished_file(
    folder: &Path,
    old: Option<&fs::Metadata>,
) -> io::Result<tempfile::NamedTempFile> {
    // the access rights of any other new file, restricted by the umask; the default of tempfile is
    // meant for secrets
    let file = held(
        || builder(0o666).tempfile_in(folder),
        |file| Ok(is_held(file.as_file(), file.path())),
    )?;
    old.map_or(Ok(()), |old| keep_mode(file.as_file(), old))?;
    Ok(file)
}

/// Creates an unfinished folder in `folder`. It is locked as long as the file beside it is open;
/// there is none where the system cannot open folders, and then nobody removes what is left.
pub fn unfinished_folder(folder: &Path) -> io::Result<(tempfile::TempDir, Option<File>)> {
    let make = || {
        let made = builder(0o777).tempdir_in(folder)?;
        let lock = File::open(made.path()).ok();
        Ok((made, lock))
    };
    held(make, |(made, lock)| Ok(lock.as_ref().is_none_or(|lock| is_held(lock, made.path()))))
}

fn builder(_mode: u32) -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(BEGINNING).suffix(ENDING).rand_bytes(RANDOM);
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(_mode));
    builder
}

/// Makes something that is held. Between making and locking, another process can take it for a
/// leftover and remove it; then it is made again.
fn held<T>(
    make: impl Fn() -> io::Result<T>,
    hold: impl Fn(&T) -> io::Result<bool>,
) -> io::Result<T> {
    for _ in 0..TRIES {
        let made = make()?;
        if hold(&made)? {
            return Ok(made);
        }
    }
    Err(io::Error::other("another process removes what is unfinished there"))
}

/// Locks the file at `path`, and returns whether it is now held and still there. Some file systems
/// have no locks: what is there cannot be taken by others either.
pub fn is_held(lock: &File, path: &Path) -> bool {
    !matches!(lock.try_lock(), Err(TryLockError::WouldBlock)) && is_at(lock, path)
}

/// Returns whether this open file is the one at `path`, and not one that was there before.
#[cfg(unix)]
pub fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let same = |a: fs::Metadata, b: fs::Metadata| (a.dev(), a.ino()) == (b.dev(), b.ino());
    file.metadata().is_ok_and(|a| fs::symlink_metadata(path).is_ok_and(|b| same(a, b)))
}

/// Returns whether there is a file at `path`: on other systems an open file is not removed.
#[cfg(not(unix))]
pub fn is_at(_: &File, path: &Path) -> bool {
    path.exists()
}

/// Removes the unfinished files and folders in `folder` that no living process holds.
pub fn remove_leftovers(folder: &Path) {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    for entry in entries.filter(|entry| is_unfinished(&entry.file_name())) {
        let path = entry.path();
        // not of a link, which is not ours
        let Ok(kind) = fs::symlink_metadata(&path) else { continue };
        if !kind.is_file() && !kind.is_dir() {
            continue;
        }
        let Ok(lock) = File::open(&path) else { continue };
        if lock.try_lock().is_ok() && is_at(&lock, &path) {
            let _ = if kind.is_dir() { fs::remove_dir_all(&path) } else { fs::remove_file(&path) };
        }
    }
}

/// Gives a file the access rights of the `old` one, which it will replace.
#[cfg(unix)]
pub fn keep_mode(file: &fs::File, old: &fs::Metadata) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(fs::Permissions::from_mode(old.permissions().mode() & 0o777))
}

/// Does nothing: on other systems a file has the access rights of its folder.
#[cfg(not(unix))]
pub fn keep_mode(_: &fs::File, _: &fs::Metadata) -> io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_leftovers_without_a_process_are_removed() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        let held = unfinished_file(folder.path(), None).expect("a file");
        let (held_folder, _lock) = unfinished_folder(folder.path()).expect("a folder");
        let left = ["abcdefABCDEF", "0123456789ab"].map(|m| format!(".phylux-{m}.unfinished"));
        fs::write(at(&left[0]), "half").expect("a file");
        fs::create_dir(at(&left[1])).expect("a folder");
        fs::write(at(&left[1]).join("captor.json"), "half").expect("a file");
        let others = [
            ".phylux-abcdef",
            ".phylux-notes.unfinished",
            ".phylux-abcdefABCDE_.unfinished",
            ".phylux-abcdefABCDEF.unfinished2",
            "phylux-abcdefABCDEF.unfinished",
        ];
        others.iter().for_each(|name| fs::write(at(name), "ours").expect("a file"));
        remove_leftovers(folder.path());
        assert!(left.iter().all(|name| !at(name).exists()));
        assert!(others.iter().all(|name| at(name).exists()));
        assert!(held.path().exists() && held_folder.path().exists());
    }

    #[cfg(unix)]
    #[test]
    fn links_with_such_names_are_left_alone() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        fs::write(at("precious"), "precious").expect("a file");
        let link = at(".phylux-abcdefABCDEF.unfinished");
        std::os::unix::fs::symlink(at("precious"), &link).expect("a link");
        remove_leftovers(folder.path());
        assert!(link.is_symlink() && at("precious").exists());
    }
}
