//! Patterns of names, in which `*` stands for any characters, or for none.

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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

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
