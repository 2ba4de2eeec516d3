//! The outcome of the comparisons in some rooms, and how it is printed.

use std::{collections::BTreeMap, fmt};

use phylux::Scene;

use super::compare::{Compared, LeftOut, beyond};

/// How many values of one kind were compared, or left out for each reason.
#[derive(Clone, Copy, Default)]
struct Counts {
    compared: usize,
    few_photons: usize,
    few_paths: usize,
    by_chance: usize,
    in_repeat: usize,
}

impl Counts {
    fn left_out(&self) -> usize {
        self.few_photons + self.few_paths + self.by_chance + self.in_repeat
    }

    fn share(&self) -> f64 {
        self.left_out() as f64 / (self.compared + self.left_out()).max(1) as f64
    }

    fn add(&mut self, value: &Compared) {
        *match value.z {
            Ok(_) => &mut self.compared,
            Err(LeftOut::FewPhotons) => &mut self.few_photons,
            Err(LeftOut::FewPaths) => &mut self.few_paths,
            Err(LeftOut::ByChance) => &mut self.by_chance,
            Err(LeftOut::InRepeat) => &mut self.in_repeat,
        } += 1;
    }

    fn join(&mut self, other: &Self) {
        self.compared += other.compared;
        self.few_photons += other.few_photons;
        self.few_paths += other.few_paths;
        self.by_chance += other.by_chance;
        self.in_repeat += other.in_repeat;
    }
}

/// The outcome of the comparisons in some rooms.
#[derive(Default)]
pub struct Tried {
    all: Counts,
    /// Counts for each kind of captor that a value belongs to, and for each kind of material or
    /// light in its room.
    kinds: BTreeMap<String, Counts>,
    squares: f64,
    /// Number of values that differ by more than 2, 3 and 4 errors.
    beyond: [usize; 3],
    /// Values that are wrong.
    pub wrong: Vec<String>,
    /// Values beyond the limit that were left out in the repeat, so that they are neither wrong nor
    /// right.
    pub open: Vec<String>,
    /// Values that were beyond the limit once, but not in the repeat.
    pub chance: Vec<String>,
}

impl Tried {
    /// Adds the values of one room.
    pub fn add(&mut self, scene: &Scene, values: &[Compared]) {
        let mut inside: Vec<String> = scene
            .materials()
            .iter()
            .map(|named| format!("room with {}", kind(&named.name)))
            .collect();
        inside
            .extend(scene.lights().iter().map(|light| format!("room with {}", kind(&light.name))));
        inside.sort();
        inside.dedup();
        for value in values {
            self.all.add(value);
            let own = format!("value of {}", kind(&value.captor));
            for kind in inside.iter().chain([&own]) {
                self.kinds.entry(kind.clone()).or_default().add(value);
            }
        }
        for z in values.iter().filter_map(|value| value.z.ok()) {
            self.squares += z * z;
            let beyond = self.beyond.iter_mut().zip([2.0, 3.0, 4.0]);
            beyond.for_each(|(count, limit)| *count += usize::from(z.abs() > limit));
        }
    }

    /// Judges the values of a room that are beyond the limit by the room's second run. Those that
    /// are beyond it there too, in the same direction, are wrong. Those that the second run leaves
    /// out are open, and become left out in `first` as well.
    pub fn repeated(&mut self, name: &str, first: &mut [Compared], again: &[Compared]) {
        for value in first {
            let Some(z) = value.z.ok().filter(|&z| beyond(z)) else { continue };
            // a value that is missing is zero in both estimates
            let after = again.iter().find(|c| c.what == value.what).map_or(Ok(0.0), |c| c.z);
            let then = after.map_or_else(|why| format!("{why:?}"), |z| format!("{z:.1}"));
            let list = match after {
                Ok(after) if beyond(after) && after.signum() == z.signum() => &mut self.wrong,
                Ok(_) => &mut self.chance,
                Err(_) => {
                    value.z = Err(LeftOut::InRepeat);
                    &mut self.open
                }
            };
            list.push(format!("{name}: {}: z {z:.1}, then {then}", value.what));
        }
    }

    pub fn join(&mut self, other: Self) {
        self.all.join(&other.all);
        for (kind, counts) in other.kinds {
            self.kinds.entry(kind).or_default().join(&counts);
        }
        self.squares += other.squares;
        self.beyond.iter_mut().zip(other.beyond).for_each(|(count, more)| *count += more);
        self.wrong.extend(other.wrong);
        self.open.extend(other.open);
        self.chance.extend(other.chance);
    }

    pub fn compared(&self) -> usize {
        self.all.compared
    }

    /// Returns the fraction of values that are left out.
    pub fn share_left_out(&self) -> f64 {
        self.all.share()
    }
}

/// Returns the kind of an object from its name: `ball` for `ball of glass 7`, `flush Spot` for
/// `flush Spot 9`.
fn kind(name: &str) -> &str {
    let name = name.split('/').next().unwrap_or(name);
    let name = name.trim_end_matches(|c: char| c.is_ascii_digit() || c == ' ');
    name.split_once(" of ").map_or(name, |(kind, _)| kind)
}

impl fmt::Display for Tried {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        writeln!(f, "         left out     few    few      by     in")?;
        writeln!(f, "compared        % photons  paths  chance repeat")?;
        for (kind, counts) in self.kinds.iter().chain([(&"all".to_string(), &self.all)]) {
            let Counts { compared, few_photons, few_paths, by_chance, in_repeat } = counts;
            let share = 100.0 * counts.share();
            let reasons = format!("{few_photons:7} {few_paths:6} {by_chance:7} {in_repeat:6}");
            writeln!(f, "{compared:8} {share:8.1} {reasons}  {kind}")?;
        }
        let compared = self.all.compared as f64;
        let beyond =
            self.beyond.map(|count| format!("{count} ({:.3} %)", 100.0 * count as f64 / compared));
        let rms = (self.squares / compared).sqrt();
        write!(f, "z: RMS {rms:.3}; beyond 2, 3, 4: {}", beyond.join(", "))?;
        self.open.iter().try_for_each(|open| write!(f, "\nneither wrong nor right: {open}"))?;
        self.chance.iter().try_for_each(|chance| write!(f, "\nchance: {chance}"))
    }
}
