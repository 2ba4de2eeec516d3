//! The colours of objects, sets of sensors and groups: the same in all plots of one run.

use indexmap::IndexSet;

use super::organ::Organ;
use crate::chart::Series;

/// The names of objects, of sets of sensors and of groups, in the order of the scene. The place of a
/// name is its colour.
pub(super) struct Names<'a>(IndexSet<&'a str>);

impl<'a> Names<'a> {
    /// Finds the names in the ids of captors and groups, in the order of the results. Copies have
    /// the name of their object.
    pub fn of(ids: impl Iterator<Item = &'a str>) -> Self {
        Self(ids.map(name).collect())
    }

    /// Returns the colour of a captor or group.
    pub fn colour(&self, id: &str) -> usize {
        own(self.0.get_index_of(name(id)).unwrap_or(self.0.len()))
    }

    /// Returns the colours of some that are drawn together.
    pub fn colours(&self, ids: &[&str]) -> Vec<usize> {
        told_apart(ids.iter().map(|id| self.colour(id)).collect())
    }
}

fn name(id: &str) -> &str {
    Organ::of(id).object
}

/// Returns the colour with a number among those that are neither black nor grey.
fn own(number: usize) -> usize {
    let bright = |colour: &usize| ![Series::BLACK, Series::GREY].contains(colour);
    let bright: Vec<usize> = (0..Series::COLOURS).filter(bright).collect();
    Series::COLOURS * (number / bright.len()) + bright[number % bright.len()]
}

/// Returns the colours of what is drawn together, of which those that an earlier one has are others
/// that are free or, if none is, the same with another mark.
pub(super) fn told_apart(mut colours: Vec<usize>) -> Vec<usize> {
    let paint = |colour: usize| colour % Series::COLOURS;
    for i in 1..colours.len() {
        let (before, after) = (&colours[..i], &colours[i + 1..]);
        let is_used = |colour: usize| before.iter().any(|other| paint(*other) == paint(colour));
        if !is_used(colours[i]) {
            continue;
        }
        let is_wanted = |colour: usize| after.iter().any(|other| paint(*other) == paint(colour));
        let mut others = (0..).map(own).take(Series::COLOURS * (colours.len() + 1));
        let free = others.clone().find(|other| !is_used(*other) && !is_wanted(*other));
        let mut all = others.clone().chain([Series::BLACK, Series::GREY]);
        let free = free.or_else(|| all.find(|other| !is_used(*other)));
        let free = free.or_else(|| others.find(|other| !before.contains(other)));
        colours[i] = free.unwrap_or(colours[i]);
    }
    colours
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plant, its leaves and its copies have one colour, whatever else is drawn; a group has one of
    /// its own.
    #[test]
    fn a_name_has_one_colour() {
        let ids = ["a/leaf1#0", "a/leaf2#0", "a/leaf1#1", "bench/0-0", "bench/0-1", "a", "all"];
        let names = Names::of(ids.into_iter());
        assert_eq!(names.colours(&["a", "bench", "all"]), [0, 1, 2]);
        assert_eq!(names.colours(&["bench"]), [1]);
        assert_eq!(names.colour("a#7"), names.colour("a/leaf2#3"));
    }

    /// No object is black or grey. What is drawn together has different colours, or at least marks, and
    /// what comes first keeps its own.
    #[test]
    fn what_is_drawn_together_is_told_apart() {
        assert!((0..40).all(|i| !(5..7).contains(&(own(i) % Series::COLOURS))));
        assert_eq!(told_apart(vec![3, 0, 11, 1]), [3, 0, 2, 1]);
        let many = told_apart(vec![2; 30]);
        let colours = |all: &[usize]| {
            let all: std::collections::HashSet<usize> = all.iter().map(|own| own % 8).collect();
            all.len()
        };
        assert_eq!((colours(&many[..6]), colours(&many[..8])), (6, 8), "{many:?}");
        let all: std::collections::HashSet<usize> = many.iter().copied().collect();
        assert_eq!(all.len(), 30, "{many:?}");
    }
}
