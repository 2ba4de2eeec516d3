//! Patterns of names, in which `*` stands for any characters, or for none, and names of copies.

use std::collections::HashSet;

/// Up to this many groups are compared with each other.
const MOST_COMPARED: usize = 200;

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

/// Leaves out copies, as [`without_copies`] does, and of other groups those that have no captor of
/// their own beside a larger group or an earlier one that is the same. `members` are the numbers of
/// a group's captors, in rising order, or none where they are not known; a group of `whole` captors
/// has all of them, and no parts.
pub fn apart<'a, T>(
    all: Vec<T>,
    name: impl Fn(&T) -> &'a str,
    members: impl Fn(&T) -> &'a [usize],
    whole: usize,
) -> Vec<T> {
    let all = without_copies(all, name);
    if all.len() > MOST_COMPARED {
        return all;
    }
    let own: Vec<&[usize]> = all.iter().map(members).collect();
    let is_part = |i: usize| {
        (0..own.len()).any(|j| {
            let larger = own[i].len() < own[j].len() && own[j].len() < whole;
            let same = own[i].len() == own[j].len() && j < i;
            (larger || same) && own[i].iter().all(|captor| own[j].binary_search(captor).is_ok())
        })
    };
    let keeps: Vec<bool> = (0..own.len()).map(|i| own[i].is_empty() || !is_part(i)).collect();
    let all = all.into_iter().zip(keeps).filter(|(_, keeps)| *keeps);
    all.map(|(one, _)| one).collect()
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
    fn parts_give_way_to_what_they_are_parts_of() {
        let groups: [(&str, &[usize]); 8] = [
            ("tomato-1", &[0, 1]),
            ("tomato", &[0, 1, 2]),
            ("tomato-1#0", &[0]),
            ("cucumber-2", &[3, 4]),
            ("cucumber", &[3, 4]),
            ("all", &[0, 1, 2, 3, 4, 5]),
            ("sensor", &[5]),
            ("unknown", &[]),
        ];
        let kept = apart(groups.to_vec(), |group| group.0, |group| group.1, 6);
        let kept: Vec<&str> = kept.into_iter().map(|group| group.0).collect();
        assert_eq!(kept, ["tomato", "cucumber-2", "all", "sensor", "unknown"]);
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
