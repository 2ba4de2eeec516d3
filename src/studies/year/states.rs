//! States: scenes that differ from the scene file at times, because screens close, panes are
//! whitewashed or crops grow.
//!
//! In an hour each state holds for a fraction of the time; several states overlap as if by chance.
//! Each combination of states that occurs is a scene of its own, whose lights have the hours of
//! that combination alone.

use std::path::Path;

use serde_json::Value;

use super::{
    conditions::{Outside, Wrong},
    places::Places,
};
use crate::{
    error::{Error, Result},
    formats::{
        control_file::{ControlFile, StateControl},
        input::{quoted, read_bytes},
        json,
        output::folder_of,
        scene_file::{ByHour, LoadedScene, SkyDivision, load_by_hour, load_state},
    },
    results::result::band_results,
};

/// The most combinations of states.
const MOST: usize = 64;
/// A combination that holds for less than this is worth a warning, h.
const SHORT: f64 = 10.0;

/// The scene as it is in a combination of states.
#[derive(Debug)]
pub struct StateScene {
    /// The scene, with the hours of this combination alone.
    pub loaded: LoadedScene,
    /// For each hour of the period, the fraction of it in which the combination holds.
    pub shares: Vec<f64>,
    /// Names of the states that hold.
    pub states: Vec<String>,
}

/// The scene of a year with all combinations of its states, the one without any first if it occurs.
#[derive(Debug)]
pub struct YearScenes {
    /// The combinations that occur, at least one.
    pub scenes: Vec<StateScene>,
    /// For each state its name, and for each hour the fraction of it in which it holds.
    pub states: Vec<(String, Vec<f64>)>,
    /// What a user should know.
    pub warnings: Vec<String>,
}

impl YearScenes {
    /// Loads the scene at `path` by the hour, in all states of a control file, given with its path.
    /// Errors: those of a scene; a state that changes what is not in the scene, or which captors
    /// there are; states that hold together and change one place; too many combinations.
    pub fn load(
        path: &Path,
        division: SkyDivision,
        control: Option<(&ControlFile, &Path)>,
    ) -> Result<Self> {
        let base = load_by_hour(path, division)?;
        let states = control.map_or(&[][..], |(file, _)| &file.states);
        let (Some((_, control)), false) = (control, states.is_empty()) else {
            return Ok(Self::plain(base));
        };
        let Some(hourly) = &base.hourly else { return Ok(Self::plain(base)) };
        let bands = band_results(&base.scene);
        let outside = Outside::new(&base.scene, hourly, &bands);
        let name = control.display().to_string();
        let at = |state: usize, key: &str| json::place(&name, &format!("/states/{state}{key}"));
        let mut shares = Vec::new();
        for (i, state) in states.iter().enumerate() {
            let wrong: Wrong = &|key, problem| Error::input(at(i, key), problem);
            shares.push(outside.shares(&state.when(), &folder_of(control), wrong)?);
        }
        let bytes = read_bytes(path).map_err(|why| Error::input(path.display(), why))?;
        let document = json::parse(&path.display().to_string(), &bytes)?;
        for (i, state) in states.iter().enumerate() {
            for pointer in state.changes.keys() {
                if document.pointer(pointer).is_none() {
                    let problem = format!("the scene has no {}", quoted(pointer));
                    return Err(Error::input(at(i, "/changes"), problem).remedy(
                        "write the value without the state there, such as `\"present\": false`",
                    ));
                }
            }
        }
        let slots = hourly.slots.clone();
        let mut warnings = Vec::new();
        for (state, shares) in states.iter().zip(&shares) {
            let own = shares.iter().zip(&slots).map(|(share, slot)| share * slot.length);
            let own: f64 = own.sum();
            if own <= 0.0 {
                warnings.push(format!("state {} never holds", quoted(&state.name)));
            }
        }
        let combinations = combinations(&shares, slots.len()).ok_or_else(|| {
            let place = json::place(&name, "/states");
            Error::input(place, format!("more than {MOST} combinations of states occur"))
                .remedy("join states that hold together, or let them hold at other times")
        })?;
        let mut base = Some(base);
        let mut scenes: Vec<StateScene> = Vec::new();
        let mut first: Option<Places> = None;
        for (set, shares) in combinations {
            let on: Vec<usize> = (0..states.len()).filter(|&i| set >> i & 1 == 1).collect();
            let names: Vec<String> = on.iter().map(|&i| states[i].name.clone()).collect();
            let own = shares.iter().zip(&slots).map(|(share, slot)| share * slot.length);
            let (own, said) = (own.sum::<f64>(), names.join(" + "));
            if !names.is_empty() && own < SHORT {
                warnings.push(format!(
                    "states {} hold for {own:.3} h only, for which the scene is traced once more",
                    quoted(&said)
                ));
            }
            let own = changed(&document, states, &on, &|i, problem| {
                Error::input(at(i, "/changes"), problem)
            })?;
            let by_hour = ByHour { division, shares: Some(&shares) };
            let loaded = load_state(own, path, by_hour)?;
            if let Some(base) = &base {
                let known = |warning: &&String| !base.warnings.contains(warning);
                let new = loaded.warnings.iter().filter(known);
                warnings.extend(new.map(|warning| format!("state {}: {warning}", quoted(&said))));
            }
            let places = Places::new(&loaded.scene);
            match &first {
                None => first = Some(places),
                Some(first) => {
                    if let Some(id) = first.differs(&places) {
                        let state = on.first().copied().unwrap_or(0);
                        let problem = format!(
                            "with {} the captors or groups are others than without: {}",
                            quoted(&said),
                            quoted(id)
                        );
                        return Err(Error::input(at(state, "/changes"), problem).remedy(
                            "let states change only what is no captor, or captors that keep their ids",
                        ));
                    }
                }
            }
            scenes.push(StateScene { loaded, shares, states: names });
        }
        if let (Some(base), Some(first)) = (base.take(), scenes.first_mut()) {
            // what was said of the scene file as it is
            first.loaded.warnings = base.warnings;
        }
        let names = states.iter().map(|state| state.name.clone());
        Ok(Self { scenes, states: names.zip(shares).collect(), warnings })
    }

    /// The scene of a year without states.
    pub fn plain(loaded: LoadedScene) -> Self {
        let slots = loaded.hourly.as_ref().map_or(0, |hourly| hourly.slots.len());
        let scene = StateScene { loaded, shares: vec![1.0; slots], states: Vec::new() };
        Self { scenes: vec![scene], states: Vec::new(), warnings: Vec::new() }
    }
}

/// Returns the combinations of states that occur, as sets of bits, with the fraction of each slot in
/// which they hold; the one without states first. `None` if there are too many.
fn combinations(shares: &[Vec<f64>], slots: usize) -> Option<Vec<(u64, Vec<f64>)>> {
    let mut found: std::collections::BTreeMap<u64, Vec<f64>> = Default::default();
    if shares.len() > 64 {
        return None;
    }
    for slot in 0..slots {
        let mut sets = vec![(0u64, 1.0)];
        for (i, shares) in shares.iter().enumerate() {
            let share = shares[slot];
            let split =
                |&(set, of): &(u64, f64)| [(set, of * (1.0 - share)), (set | 1 << i, of * share)];
            sets = sets.iter().flat_map(split).filter(|(_, share)| *share > 0.0).collect();
            if sets.len() > MOST {
                return None;
            }
        }
        for (set, share) in sets {
            found.entry(set).or_insert_with(|| vec![0.0; slots])[slot] = share;
        }
        if found.len() > MOST {
            return None;
        }
    }
    Some(found.into_iter().collect())
}

/// Returns a scene file with the changes of some states. Error: two of them change one place.
fn changed(
    document: &Value,
    states: &[StateControl],
    on: &[usize],
    wrong: &dyn Fn(usize, String) -> Error,
) -> Result<Value> {
    let mut document = document.clone();
    let mut done: Vec<(&str, usize)> = Vec::new();
    for &i in on {
        for (pointer, value) in &states[i].changes {
            let within = |a: &str, b: &str| {
                b.strip_prefix(a).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
            };
            let same =
                done.iter().find(|(other, _)| within(other, pointer) || within(pointer, other));
            if let Some((other, j)) = same {
                let other_state = quoted(&states[*j].name);
                let problem = format!(
                    "state {other_state} holds at the same time and changes {} too",
                    quoted(other)
                );
                return Err(wrong(i, problem).remedy("let them hold at other times"));
            }
            if let Some(place) = document.pointer_mut(pointer) {
                *place = value.clone();
            }
            done.push((pointer, i));
        }
    }
    Ok(document)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_overlap_as_if_by_chance() {
        let found = combinations(&[vec![0.0, 0.5, 1.0], vec![1.0, 0.2, 1.0]], 3).unwrap();
        let sets: Vec<u64> = found.iter().map(|(set, _)| *set).collect();
        assert_eq!(sets, [0, 1, 2, 3]);
        assert_eq!(found[0].1, [0.0, 0.4, 0.0]);
        assert_eq!(found[1].1, [0.0, 0.4, 0.0]);
        assert_eq!(found[2].1, [1.0, 0.1, 0.0]);
        assert_eq!(found[3].1, [0.0, 0.1, 1.0]);
        assert!(combinations(&vec![vec![0.5]; 7], 1).is_none());
        assert_eq!(combinations(&vec![vec![0.5]; 6], 1).unwrap().len(), 64);
    }
}
