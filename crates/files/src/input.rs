//! Reads the bytes of input files, or says in a few words why it cannot; makes hashes and unknown
//! words printable.

use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::Path;

use sha2::{Digest, Sha256};

/// The remedy for a file that cannot be read.
pub const RELATIVE: &str = "paths are relative to the file that names them";

/// The length of the longest file that is read, bytes; 20 million triangles fit into it.
const LONGEST: u64 = 2 << 30;

/// A function that fetches the bytes of a file that another file names, or says why it cannot.
pub type Fetch<'a> = dyn Fn(&Path) -> std::result::Result<Vec<u8>, String> + 'a;

/// Reads a whole regular file. The error is the problem alone, in words that fit after `path: `;
/// the caller knows the place that names the file.
pub fn read_bytes(path: &Path) -> std::result::Result<Vec<u8>, String> {
    let metadata = std::fs::metadata(path).map_err(|e| words(&e))?;
    if metadata.is_dir() {
        return Err("is a directory, not a file".into());
    }
    // reading a device or a pipe may never end
    if !metadata.is_file() {
        return Err("is not a regular file".into());
    }
    read_up_to(path, LONGEST)
}

/// Reads a file of at most `longest` bytes. The length that the system reports is not relied on,
/// because it may be wrong, or the file may grow.
fn read_up_to(path: &Path, longest: u64) -> std::result::Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(|e| words(&e))?;
    file.take(longest + 1).read_to_end(&mut bytes).map_err(|e| words(&e))?;
    match bytes.len() as u64 > longest {
        true => Err(format!("is longer than {longest} bytes")),
        false => Ok(bytes),
    }
}

fn words(error: &std::io::Error) -> String {
    match error.kind() {
        ErrorKind::NotFound => "there is no such file".into(),
        ErrorKind::PermissionDenied => "may not be read: permission denied".into(),
        _ => format!("cannot be read: {error}"),
    }
}

/// Returns the text of a file in UTF-16 whose text begins as ASCII, with a mark of its byte order or
/// without; `None` if the file is not in UTF-16.
pub fn from_utf16(bytes: &[u8]) -> Option<String> {
    let unit = match bytes {
        [0xff, 0xfe, ..] | [1..=127, 0, 1..=127, 0, ..] => u16::from_le_bytes,
        [0xfe, 0xff, ..] | [0, 1..=127, 0, 1..=127, ..] => u16::from_be_bytes,
        _ => return None,
    };
    let units: Vec<u16> = bytes.chunks_exact(2).map(|pair| unit([pair[0], pair[1]])).collect();
    Some(String::from_utf16_lossy(&units))
}

/// Returns `word` for the message of an error: in quotes, on one line and shortened.
pub fn quoted(word: &str) -> String {
    let short: String = word.chars().take(40).flat_map(char::escape_debug).collect();
    let more = if word.chars().nth(40).is_some() { "..." } else { "" };
    format!("`{short}{more}`")
}

/// Returns a SHA-256 hash as 64 hexadecimal digits.
pub fn hex(hash: Sha256) -> String {
    const DIGITS: &[u8; 16] = b"0123456789abcdef";
    let digits =
        |byte: u8| [byte >> 4, byte & 15].map(|digit| char::from(DIGITS[usize::from(digit)]));
    hash.finalize().into_iter().flat_map(digits).collect()
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
        assert_eq!(read_up_to(&file, 1).unwrap(), b"x");
        assert_eq!(read_up_to(&file, 0).unwrap_err(), "is longer than 0 bytes");
        #[cfg(unix)]
        assert_eq!(read_bytes(Path::new("/dev/zero")).unwrap_err(), "is not a regular file");
    }

    #[test]
    fn quotes_stay_short_and_on_one_line() {
        assert_eq!(quoted("a\nb"), "`a\\nb`");
        assert_eq!(quoted(&"x".repeat(50)), format!("`{}...`", "x".repeat(40)));
    }
}
