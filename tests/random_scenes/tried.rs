//! What was compared in some rooms.

use std::{collections::BTreeMap, fmt};

use phylux::Scene;

use super::compare::{Compared, LeftOut};

/// Values of one kind.
#[derive(Clone, Copy, Default)]
struct Counts {
    compared: usize,
    few_photons: usize,
    few_paths: usize,
    by_chance: usize,
}

impl Counts {
    fn left_out(&self) -> usize {
        self.few_photons + self.few_paths + self.by_chance
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
        } += 1;
    }

    fn join(&mut self, other: &Self) {
        self.compared += other.compared;
        self.few_photons += other.few_photons;
        self.few_paths += other.few_paths;
        self.by_chance += other.by_chance;
    }
}

/// What was compared in some rooms.
#[derive(Default)]
pub struct Tried {
    all: Counts,
    /// By what they are of, and by what is in the room.
    kinds: BTreeMap<String, Counts>,
    squares: f64,
    /// Values beyond 2, 3 and 4 errors.
    beyond: [usize; 3],
    /// What is wrong.
    pub wrong: Vec<String>,
}

impl Tried {
    /// One room.
    pub fn new(scene: &Scene, values: &[Compared], wrong: Vec<String>) -> Self {
        let mut tried = Self { wrong, ..Self::default() };
        let mut inside: Vec<String> = scene
            .materials
            .iter()
            .map(|named| format!("room with {}", kind(&named.name)))
            .collect();
        inside.extend(scene.lights.iter().map(|light| format!("room with {}", kind(&light.name))));
        inside.sort();
        inside.dedup();
        for value in values {
            tried.all.add(value);
            let own = format!("value of {}", kind(&value.captor));
            for kind in inside.iter().chain([&own]) {
                tried.kinds.entry(kind.clone()).or_default().add(value);
            }
        }
        for z in values.iter().filter_map(|value| value.z.ok()) {
            tried.squares += z * z;
            let beyond = tried.beyond.iter_mut().zip([2.0, 3.0, 4.0]);
            beyond.for_each(|(count, limit)| *count += usize::from(z.abs() > limit));
        }
        tried
    }

    pub fn join(&mut self, other: Self) {
        self.all.join(&other.all);
        for (kind, counts) in other.kinds {
            self.kinds.entry(kind).or_default().join(&counts);
        }
        self.squares += other.squares;
        self.beyond.iter_mut().zip(other.beyond).for_each(|(count, more)| *count += more);
        self.wrong.extend(other.wrong);
    }

    pub fn compared(&self) -> usize {
        self.all.compared
    }

    /// The share of values that are left out.
    pub fn share_left_out(&self) -> f64 {
        self.all.share()
    }
}

/// What a thing is, of its name: `ball` of `ball of glass 7`, `flush Spot` of `flush Spot 9`.
fn kind(name: &str) -> &str {
    let name = name.split('/').next().unwrap_or(name);
    let name = name.trim_end_matches(|c: char| c.is_ascii_digit() || c == ' ');
    name.split_once(" of ").map_or(name, |(kind, _)| kind)
}

impl fmt::Display for Tried {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        writeln!(f, "{:>8} {:>8} {:>7} {:>6} {:>7}", "", "left out", "few", "few", "by")?;
        writeln!(
            f,
            "{:>8} {:>8} {:>7} {:>6} {:>7}",
            "compared", "%", "photons", "paths", "chance"
        )?;
        for (kind, counts) in self.kinds.iter().chain([(&"all".to_string(), &self.all)]) {
            let Counts { compared, few_photons, few_paths, by_chance } = counts;
            let share = 100.0 * counts.share();
            let reasons = format!("{few_photons:7} {few_paths:6} {by_chance:7}");
            writeln!(f, "{compared:8} {share:8.1} {reasons}  {kind}")?;
        }
        let compared = self.all.compared as f64;
        let beyond =
            self.beyond.map(|count| format!("{count} ({:.3} %)", 100.0 * count as f64 / compared));
        let rms = (self.squares / compared).sqrt();
        write!(f, "z: RMS {rms:.3}; beyond 2, 3, 4: {}", beyond.join(", "))
    }
}
