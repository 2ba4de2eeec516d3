//! The bytes of an input file, or a few words that say why they cannot be had.

use std::io::ErrorKind;
use std::path::Path;

/// The remedy where a file cannot be read.
pub const RELATIVE: &str = "paths are relative to the file that names them";

/// Reads the whole of a regular file. The error is the problem alone, in words that fit behind
/// `path: `; the caller knows the place that names the file.
pub fn read_bytes(path: &Path) -> std::result::Result<Vec<u8>, String> {
    let metadata = std::fs::metadata(path).map_err(|e| words(&e))?;
    if metadata.is_dir() {
        return Err("is a directory, not a file".into());
    }
    // a device or a pipe may never end
    if !metadata.is_file() {
        return Err("is not a regular file".into());
    }
    std::fs::read(path).map_err(|e| words(&e))
}

fn words(error: &std::io::Error) -> String {
    match error.kind() {
        ErrorKind::NotFound => "there is no such file".into(),
        ErrorKind::PermissionDenied => "may not be read: permission denied".into(),
        _ => format!("cannot be read: {error}"),
    }
}

/// `word` for an error sentence: in quotes, on one line, not longer than a line.
pub fn quoted(word: &str) -> String {
    let short: String = word.chars().take(40).flat_map(char::escape_debug).collect();
    let more = if word.chars().nth(40).is_some() { "..." } else { "" };
    format!("`{short}{more}`")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn says_why_a_file_cannot_be_read() {
        let dir = tempfile::tempdir().unwrap();
        assert_eq!(read_bytes(&dir.path().join("none.obj")).unwrap_err(), "there is no such file");
        assert_eq!(read_bytes(dir.path()).unwrap_err(), "is a directory, not a file");
        let file = dir.path().join("a");
        std::fs::write(&file, b"x").unwrap();
        assert_eq!(read_bytes(&file).unwrap(), b"x");
        #[cfg(unix)]
        assert_eq!(read_bytes(Path::new("/dev/zero")).unwrap_err(), "is not a regular file");
    }

    #[test]
    fn quotes_stay_short_and_on_one_line() {
        assert_eq!(quoted("a\nb"), "`a\\nb`");
        assert_eq!(quoted(&"x".repeat(50)), format!("`{}...`", "x".repeat(40)));
    }
}
