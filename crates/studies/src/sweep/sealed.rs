//! Sealed JSON: its last entry is a checksum of the rest, so that any damage is found.

use std::io;

use serde::Serialize;
use sha2::{Digest, Sha256};

use phylux_files::{input::hex, result_file::write_lines};

/// Writes an object as lines of JSON. The last line holds the SHA-256 of everything before it.
pub fn seal(value: &impl Serialize) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    write_lines(value, &mut bytes)?;
    bytes.truncate(bytes.strip_suffix(b"\n}\n").map_or(0, <[u8]>::len));
    let seal = seal_of(&bytes);
    bytes.extend(seal);
    Ok(bytes)
}

/// Returns whether the bytes are as [`seal`] made them.
pub fn is_valid(bytes: &[u8]) -> bool {
    body(bytes).len() < bytes.len()
}

/// Returns the bytes without the last entry, or all bytes if they have no valid seal.
pub fn body(bytes: &[u8]) -> &[u8] {
    let Some(end) = bytes.len().checked_sub(seal_of(b"").len()) else { return bytes };
    let (body, seal) = bytes.split_at(end);
    if seal == seal_of(body) { body } else { bytes }
}

/// Returns the seal of these bytes, which is appended to them.
fn seal_of(body: &[u8]) -> Vec<u8> {
    format!(",\n  \"sha256\": \"{}\"\n}}\n", hex(Sha256::new_with_prefix(body))).into_bytes()
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;

    /// The seal breaks when any single bit changes, when bytes are missing, and when there is one
    /// more.
    #[test]
    fn any_damage_breaks_the_seal() {
        let value = json!({"a": [1, 2.5], "b": {"c": "d"}});
        let bytes = seal(&value).expect("memory");
        assert!(is_valid(&bytes));
        let mut read: Value = serde_json::from_slice(&bytes).expect("JSON");
        assert!(read["sha256"].take().is_string());
        assert_eq!(read["a"], value["a"]);
        for place in 0..bytes.len() {
            for bit in 0..8 {
                let mut damaged = bytes.clone();
                damaged[place] ^= 1 << bit;
                assert!(!is_valid(&damaged), "bit {bit} of byte {place}");
            }
            assert!(!is_valid(&bytes[..place]), "{place} bytes");
        }
        assert!(!is_valid(&[&bytes[..], b" "].concat()));
    }
}
