//! Patterns of names, in which `*` stands for any characters, or for none, and names of copies.

use std::collections::HashSet;

/// Returns whether the whole `name` fits the pattern.
pub fn fits(pattern: &str, name: &str) -> bool {
    let mut parts = pattern.split('*');
    let first = parts.next().unwrap_or_default();
    let Some(mut rest) = name.strip_prefix(first) else { return false };
    let Some(last) = parts.next_back() else { return rest.is_empty() };
    // each part at its first place leaves most for the parts after it
    for part in parts {
        let Some(at) = rest.find(part) else { return false };
        rest = &rest[at + part.len()..];
    }
    rest.ends_with(last)
}

/// Returns the name of what a name is a copy of: `plant` of `plant#3`.
pub fn copied(name: &str) -> Option<&str> {
    let (whole, number) = name.rsplit_once('#')?;
    (!number.is_empty() && number.bytes().all(|b| b.is_ascii_digit())).then_some(whole)
}

/// Leaves out the things whose names are those of copies, where the whole is there, too.
pub fn without_copies<'a, T>(all: Vec<T>, name: impl Fn(&T) -> &'a str) -> Vec<T> {
    let names: HashSet<&str> = all.iter().map(&name).collect();
    let is_whole = |one: &T| copied(name(one)).is_none_or(|whole| !names.contains(whole));
    all.into_iter().filter(is_whole).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn copies_give_way_to_the_whole() {
        assert_eq!([copied("a#3"), copied("a/b#12")], [Some("a"), Some("a/b")]);
        assert_eq!([copied("a"), copied("a#"), copied("a#x"), copied("#")], [None; 4]);
        let of = |names: &[&'static str]| without_copies(names.to_vec(), |name| *name);
        assert_eq!(of(&["a#0", "a", "a#1", "b#0", "c"]), ["a", "b#0", "c"]);
    }

    #[test]
    fn a_star_is_any_characters() {
        for (pattern, name) in [
            ("", ""),
            ("leaf", "leaf"),
            ("*", ""),
            ("*", "any/thing#1"),
            ("plant/leaf3#*", "plant/leaf3#12"),
            ("*leaf*", "leaf"),
            ("a*b*a", "aba"),
            ("*ab*ab", "abab"),
            ("**ü", "aü"),
        ] {
            assert!(fits(pattern, name), "{pattern} {name}");
        }
        for (pattern, name) in [
            ("", "a"),
            ("leaf", "leaf1"),
            ("plant/leaf3#*", "plant/leaf33"),
            ("a*a", "a"),
            ("*ab*ab", "ab"),
            ("a*b*a", "abb"),
        ] {
            assert!(!fits(pattern, name), "{pattern} {name}");
        }
    }

    /// Checks a pattern by its definition, character by character.
    fn fits_slowly(pattern: &[u8], name: &[u8]) -> bool {
        match pattern {
            [] => name.is_empty(),
            [b'*', rest @ ..] => (0..=name.len()).any(|skip| fits_slowly(rest, &name[skip..])),
            [first, rest @ ..] => {
                name.split_first().is_some_and(|(n, name)| n == first && fits_slowly(rest, name))
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn patterns_fit_by_their_definition(pattern in "[ab*]{0,8}", name in "[ab]{0,10}") {
            prop_assert_eq!(fits(&pattern, &name), fits_slowly(pattern.as_bytes(), name.as_bytes()));
        }
    }
}
