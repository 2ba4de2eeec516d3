//! States: scenes that differ from the scene file at times, because screens close, panes are
//! whitewashed or crops grow.
//!
//! In an hour each state holds for a fraction of the time; several states overlap as if by chance.
//! Each combination of states that occurs is a scene of its own, whose lights have the hours of
//! that combination alone.

use std::path::{Path, PathBuf};

use indexmap::IndexSet;
use serde_json::Value;
use sha2::{Digest, Sha256};

use super::{
    conditions::{Outside, Wrong},
    places::Places,
    trackers::angles,
};
use phylux_core::{
    error::{Error, Result},
    scene::world::Scene,
};
use phylux_files::{
    control_file::ControlFile,
    input::{hex, quoted, read_bytes},
    json,
    output::folder_of,
    scene_file::{ByHour, HourlyLights, LoadedScene, SkyDivision, load_by_hour, load_state},
};
use phylux_results::result::band_results;

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
    /// All files that were read, in the order of reading.
    pub files: Vec<PathBuf>,
    /// Those of them that the light of sun, sky and lamps depends on, whenever lamps are on.
    of_light: Vec<PathBuf>,
    /// The states and trackers of the control file, as text.
    changes: String,
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
        let mut files = base.files.clone();
        let mut of_light = files.clone();
        if let Some((file, path)) = control {
            files.push(path.into());
            files.extend(file.series().map(|series| folder_of(path).join(&series.file)));
        }
        let Some((file, control)) = control.filter(|(file, _)| file.changes_scene()) else {
            return Ok(Self { files, of_light, ..Self::plain(base) });
        };
        let series = file.states.iter().filter_map(|state| state.series.as_ref());
        of_light.extend(series.map(|series| folder_of(control).join(&series.file)));
        let of_control = format!("{:?} {:?}", file.states, file.trackers);
        let Some(hourly) = &base.hourly else { return Ok(Self::plain(base)) };
        let name = control.display().to_string();
        let bytes = read_bytes(path).map_err(|why| Error::unreadable(path.display(), why))?;
        let document = json::parse(&path.display().to_string(), &bytes)?;
        let changes = Changes { control: (file, control), document: &document };
        let slots = hourly.slots.clone();
        let mut warnings = Vec::new();
        let states =
            [changes.of_states(&base.scene, hourly, &mut warnings)?, changes.of_trackers(hourly)?]
                .concat();
        let shares: Vec<&[f64]> = states.iter().map(|state| &state.shares[..]).collect();
        let combinations = combinations(&shares, slots.len()).ok_or_else(|| {
            let place = if file.states.is_empty() { "/trackers" } else { "/states" };
            Error::input(
                json::place(&name, place),
                format!("more than {MOST} combinations of states occur"),
            )
            .remedy(
                "join states that hold together, let them hold at other times, or let trackers \
                     turn in larger steps",
            )
        })?;
        let mut base = Some(base);
        let mut scenes: Vec<StateScene> = Vec::new();
        let mut first: Option<Places> = None;
        for (set, shares) in combinations {
            let on: Vec<&State> =
                (0..states.len()).filter(|&i| set >> i & 1 == 1).map(|i| &states[i]).collect();
            let names: Vec<String> = on.iter().map(|state| state.name.clone()).collect();
            let own = shares.iter().zip(&slots).map(|(share, slot)| share * slot.length);
            let (own, said) = (own.sum::<f64>(), names.join(" + "));
            // each angle of a tracker may hold for a short time
            if !on.is_empty() && !on.iter().any(|state| state.turns) && own < SHORT {
                warnings.push(format!(
                    "states {} hold for {own:.3} h only, without others, for which the scene is traced once more \
                     (docs/year.md#states-screens-shades-whitewash)",
                    quoted(&said)
                ));
            }
            let own = changed(&document, &on)?;
            let by_hour = ByHour { division, shares: Some(&shares) };
            let loaded = load_state(own, path, by_hour)?;
            // what is said of each angle of a tracker would be said too often
            if let Some(base) = base.as_ref().filter(|_| !on.iter().any(|state| state.turns)) {
                let known = |warning: &&String| !base.warnings.contains(warning);
                let new = loaded.warnings.iter().filter(known);
                warnings.extend(new.map(|warning| format!("state {}: {warning}", quoted(&said))));
            }
            let places = Places::new(&loaded.scene);
            match &first {
                None => first = Some(places),
                Some(first) => {
                    if let Some(id) = first.differs(&places) {
                        let place = on.first().map_or(String::new(), |state| state.place.clone());
                        let problem = format!(
                            "with {} the captors or groups are others than without: {}",
                            quoted(&said),
                            quoted(id)
                        );
                        return Err(Error::input(place, problem).remedy(
                            "let states change only what is no captor, or captors that keep their ids",
                        ));
                    }
                }
            }
            files.extend(loaded.files.iter().cloned());
            of_light.extend(loaded.files.iter().cloned());
            scenes.push(StateScene { loaded, shares, states: names });
        }
        if let (Some(base), Some(first)) = (base.take(), scenes.first_mut()) {
            // what was said of the scene file as it is
            first.loaded.warnings = base.warnings;
        }
        let states = states.into_iter().map(|state| (state.name, state.shares)).collect();
        Ok(Self { scenes, states, warnings, files, of_light, changes: of_control })
    }

    /// Returns whether there is direct sunlight in a slot.
    pub(super) fn is_sunny(&self, slot: usize) -> bool {
        self.scenes.iter().filter_map(|scene| scene.loaded.hourly.as_ref()).any(|hourly| {
            let hour = hourly.slots[slot].hour;
            !hourly.suns.is_empty() && hour.is_some_and(|h| hourly.hours[h].direct_normal > 0.0)
        })
    }

    /// The scene of a year without states.
    pub fn plain(loaded: LoadedScene) -> Self {
        let slots = loaded.hourly.as_ref().map_or(0, |hourly| hourly.slots.len());
        let of_light = loaded.files.clone();
        let scene = StateScene { loaded, shares: vec![1.0; slots], states: Vec::new() };
        let (states, warnings, changes) = Default::default();
        Self { scenes: vec![scene], states, warnings, files: Vec::new(), of_light, changes }
    }

    /// Returns a SHA-256 over all files that were read, in hexadecimal digits. Error: a file can no
    /// longer be read.
    pub fn digest(&self) -> Result<String> {
        Ok(hex(hash_of(&self.files)?))
    }

    /// Returns a SHA-256 over all that the light of sun, sky and lamps depends on, whenever lamps are
    /// on: over the files of the scene, and the states and trackers of the control file. Error: a
    /// file can no longer be read.
    pub fn digest_of_light(&self) -> Result<String> {
        let mut hash = hash_of(&self.of_light)?;
        hash.update(&self.changes);
        Ok(hex(hash))
    }
}

fn hash_of(files: &[PathBuf]) -> Result<Sha256> {
    let mut hash = Sha256::new();
    for file in files.iter().collect::<IndexSet<_>>() {
        let bytes = read_bytes(file).map_err(|why| Error::unreadable(file.display(), why))?;
        hash.update(Sha256::digest(&bytes));
    }
    Ok(hash)
}

/// A state with the times at which it holds.
#[derive(Clone, Debug)]
struct State {
    name: String,
    /// What it replaces in the scene file.
    changes: Vec<(String, Value)>,
    /// For each slot the fraction of it in which it holds.
    shares: Vec<f64>,
    /// Its place in the control file.
    place: String,
    /// Whether it is an angle of a tracker.
    turns: bool,
}

/// The states of a control file and the scene that they change.
struct Changes<'a> {
    control: (&'a ControlFile, &'a Path),
    document: &'a Value,
}

impl Changes<'_> {
    fn place(&self, pointer: &str) -> String {
        json::place(&self.control.1.display().to_string(), pointer)
    }

    /// Refuses a place that the scene does not have.
    fn check_pointer(&self, pointer: &str, place: &str) -> Result<()> {
        match self.document.pointer(pointer) {
            Some(_) => Ok(()),
            None => {
                let problem = format!("the scene has no {}", quoted(pointer));
                Err(Error::input(self.place(place), problem).remedy(
                    "write the value without the state there, such as `\"present\": false`",
                ))
            }
        }
    }

    fn of_states(
        &self,
        scene: &Scene,
        hourly: &HourlyLights,
        warnings: &mut Vec<String>,
    ) -> Result<Vec<State>> {
        let (file, path) = self.control;
        let bands = band_results(scene);
        let outside = Outside::new(scene, hourly, &bands);
        let mut states = Vec::new();
        for (i, state) in file.states.iter().enumerate() {
            let wrong: Wrong =
                &|key, problem| Error::input(self.place(&format!("/states/{i}{key}")), problem);
            let shares = outside.shares(&state.when(), &folder_of(path), wrong)?;
            let place = format!("/states/{i}/changes");
            state.changes.keys().try_for_each(|pointer| self.check_pointer(pointer, &place))?;
            if shares.iter().all(|share| *share <= 0.0) {
                warnings.push(format!(
                    "state {} never holds; look at its conditions (docs/year.md#states-screens-shades-whitewash)",
                    quoted(&state.name)
                ));
            }
            let changes = state.changes.iter().map(|(at, value)| (at.clone(), value.clone()));
            states.push(State {
                name: state.name.clone(),
                changes: changes.collect(),
                shares,
                place: self.place(&place),
                turns: false,
            });
        }
        Ok(states)
    }

    /// Returns a state for each angle of each tracker.
    fn of_trackers(&self, hourly: &HourlyLights) -> Result<Vec<State>> {
        let mut states = Vec::new();
        for (i, tracker) in self.control.0.trackers.iter().enumerate() {
            let place = format!("/trackers/{i}/turn");
            let wrong: Wrong =
                &|key, problem| Error::input(self.place(&format!("/trackers/{i}{key}")), problem);
            let turn = tracker.turn.all();
            let angles = angles(tracker, self.document, hourly, wrong)?;
            let mut all = angles.clone();
            all.sort_by(f64::total_cmp);
            all.dedup();
            for angle in all {
                states.push(State {
                    name: format!("tracker {i} at {angle} deg"),
                    changes: turn.iter().map(|at| (at.clone(), angle.into())).collect(),
                    shares: angles.iter().map(|own| f64::from(u8::from(*own == angle))).collect(),
                    place: self.place(&place),
                    turns: true,
                });
            }
        }
        Ok(states)
    }
}

/// Returns the combinations of states that occur, as sets of bits, with the fraction of each slot in
/// which they hold; the one without states first. `None` if there are too many.
fn combinations(shares: &[&[f64]], slots: usize) -> Option<Vec<(u128, Vec<f64>)>> {
    let mut found: std::collections::BTreeMap<u128, Vec<f64>> = Default::default();
    if shares.len() > 128 {
        return None;
    }
    for slot in 0..slots {
        let mut sets = vec![(0u128, 1.0)];
        for (i, shares) in shares.iter().enumerate() {
            let share = shares[slot];
            let split =
                |&(set, of): &(u128, f64)| [(set, of * (1.0 - share)), (set | 1 << i, of * share)];
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
fn changed(document: &Value, on: &[&State]) -> Result<Value> {
    let mut document = document.clone();
    let mut done: Vec<(&str, &State)> = Vec::new();
    for state in on {
        for (pointer, value) in &state.changes {
            let within = |a: &str, b: &str| {
                b.strip_prefix(a).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
            };
            let same =
                done.iter().find(|(other, _)| within(other, pointer) || within(pointer, other));
            if let Some((other, of)) = same {
                let problem = format!(
                    "state {} holds at the same time and changes {} too",
                    quoted(&of.name),
                    quoted(other)
                );
                return Err(
                    Error::input(&state.place, problem).remedy("let them hold at other times")
                );
            }
            if let Some(place) = document.pointer_mut(pointer) {
                *place = value.clone();
            }
            done.push((pointer, state));
        }
    }
    Ok(document)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_overlap_as_if_by_chance() {
        let found = combinations(&[&[0.0, 0.5, 1.0], &[1.0, 0.2, 1.0]], 3).unwrap();
        let sets: Vec<u128> = found.iter().map(|(set, _)| *set).collect();
        assert_eq!(sets, [0, 1, 2, 3]);
        assert_eq!(found[0].1, [0.0, 0.4, 0.0]);
        assert_eq!(found[1].1, [0.0, 0.4, 0.0]);
        assert_eq!(found[2].1, [1.0, 0.1, 0.0]);
        assert_eq!(found[3].1, [0.0, 0.1, 1.0]);
        assert!(combinations(&[&[0.5][..]; 7], 1).is_none());
        assert_eq!(combinations(&[&[0.5][..]; 6], 1).unwrap().len(), 64);
    }
}
