//! Text files gone wrong, for property tests: sound ones with words, bytes and lines changed.

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::{Index, select};

/// Words that readers stumble over, wherever they stand.
#[rustfmt::skip]
const WORDS: [&str; 40] = [
    "nan", "inf", "-inf", "0", "-0", "1", "-1", "2", "-3", "4e9", "4000000000", "1e999", "1e308", "-1e200",
    "1e-320", "99999999999999999999", "-9223372036854775808", "0x1", "1,5", "+2", "/", "//", "1/", "1//2",
    "1/2/3/4", "-1/9/9", "#", "\\", "\\\n", "\n", "\r\n", "\t", "\"", ",", ";", "", "\u{fffd}", "ü", "\0", "f",
];

/// One of `files` after up to seven changes; `words` are those of its format.
pub fn spoiled(
    files: &'static [&'static str],
    words: &'static [&'static str],
) -> impl Strategy<Value = Vec<u8>> {
    let word = prop_oneof![select(&WORDS[..]), select(words)];
    let change = (0..9u8, any::<Index>(), any::<Index>(), word, any::<u8>());
    (select(files), vec(change, 0..8)).prop_map(|(file, changes)| {
        let mut text = file.as_bytes().to_vec();
        for (kind, here, there, word, byte) in changes {
            change_text(&mut text, kind, (here, there), word, byte);
        }
        text
    })
}

fn change_text(text: &mut Vec<u8>, kind: u8, at: (Index, Index), word: &str, byte: u8) {
    let pieces = |blanks: &[u8]| -> Vec<Vec<u8>> {
        text.split_inclusive(|b| blanks.contains(b)).map(<[u8]>::to_vec).collect()
    };
    let mut parts = if kind < 3 { pieces(b" \t\n/,") } else { pieces(b"\n") };
    if parts.is_empty() {
        return text.extend_from_slice(word.as_bytes());
    }
    let (i, j) = (at.0.index(parts.len()), at.1.index(parts.len()));
    match kind {
        // a word becomes another, keeping what ends it
        0 | 1 => {
            let end = parts[i].pop();
            parts[i] = word.bytes().chain(end).collect();
        }
        2 => parts.insert(i, word.bytes().chain([b' ']).collect()),
        3 => drop(parts.remove(i)),
        4 => parts.insert(i, parts[j].clone()),
        5 => parts.swap(i, j),
        6 => {
            let k = at.1.index(parts[i].len());
            parts[i].truncate(k);
        }
        _ => {
            let k = at.1.index(parts[i].len());
            parts[i][k] = byte;
        }
    }
    *text = parts.concat();
}
