//! Loads virtual captors: discs (single, in a grid or from CSV files), spheres, line sensors, and
//! the groups of OBJ files. Makes groups of captors by patterns of their ids, too.

use std::collections::BTreeMap;

use glam::DVec3;

use super::{
    loader::{Loader, stem},
    spec::*,
};
use crate::{captor_csv, input::quoted, json};
use phylux_core::{
    error::{Error, Result},
    math::{
        geometry::{Transform, area, unit_vector},
        machine::{gib, memory_left},
        pattern,
        round::Round,
    },
    scene::{
        captor::{CaptorKind, Response, Sensor},
        world::{CaptorPart, MAX_CAPTORS},
    },
};

/// A disc or sphere takes the memory of so many triangles, with its name and what a run keeps of it.
const LIKE_TRIANGLES: usize = 8;

/// A group that is to have the captors whose ids fit its patterns.
struct Wanted<'a> {
    index: usize,
    /// Each pattern, and whether a captor fits it.
    patterns: Vec<(&'a str, bool)>,
}

impl Loader<'_> {
    pub(super) fn load_captors(&mut self, captors: &[CaptorSpec]) -> Result<()> {
        for (i, file) in captors.iter().enumerate() {
            let pointer = format!("/captors/{i}");
            let name = self.entry_name(&pointer, file)?;
            let claimed = self.taken.claim_entry(&name);
            self.located(&pointer, claimed)?;
            let mut groups = vec![self.taken.group(&name)];
            let joins = file.group.as_ref();
            groups.extend(joins.map(|group| self.taken.joined(&pointer, &name, group)));
            groups.sort_unstable();
            groups.dedup();
            let kind = CaptorKind::Virtual { both_sides: file.sides == SidesSpec::Both };
            let response = match &file.response {
                Some(table) => Some(
                    Response::new(table)
                        .map_err(|problem| problem.at(self.place(format!("{pointer}/response"))))?,
                ),
                None => None,
            };
            let sensor = Sensor { round: None, is_sphere: file.sphere.is_some(), response };
            if file.csv.is_none() && !file.ignore.is_empty() {
                return Err(self
                    .error(format!("{pointer}/ignore"), "there is no table whose columns to ignore")
                    .remedy("leave it out"));
            }
            let entry = Entry { pointer, name, kind, groups, sensor };
            match file {
                CaptorSpec { csv: Some(csv), .. } => self.load_csv(&entry, csv, &file.ignore)?,
                CaptorSpec { obj: Some(obj), .. } => self.load_captor_obj(&entry, obj)?,
                CaptorSpec { disc: Some(disc), .. } => self.load_disc(&entry, disc)?,
                CaptorSpec { sphere: Some(sphere), .. } => self.load_sphere(&entry, sphere)?,
                CaptorSpec { grid: Some(grid), .. } => self.load_grid(&entry, grid)?,
                CaptorSpec { line: Some(line), .. } => self.load_line(&entry, line)?,
                _ => {}
            }
        }
        Ok(())
    }

    fn entry_name(&self, pointer: &str, file: &CaptorSpec) -> Result<String> {
        let CaptorSpec { csv, obj, disc, sphere, grid, line, .. } = file;
        let files = [csv.is_some(), obj.is_some()];
        let shapes = [disc.is_some(), sphere.is_some(), grid.is_some(), line.is_some()];
        let given = files.into_iter().chain(shapes).filter(|given| *given).count();
        if given != 1 {
            let kinds = "`csv`, `obj`, `disc`, `sphere`, `grid` and `line`";
            return Err(match given {
                0 => self.error(pointer, format!("has none of {kinds}")).remedy("say what it is"),
                _ => self
                    .error(pointer, format!("must have exactly one of {kinds}"))
                    .remedy("split it into several entries"),
            });
        }
        match (&file.name, file.csv.as_ref().or(file.obj.as_ref())) {
            (Some(name), _) => Ok(name.clone()),
            (None, Some(path)) => Ok(stem(&self.files.sibling(path))),
            (None, None) => {
                let what = ["disc", "sphere", "grid", "line"];
                let what =
                    what.into_iter().zip(shapes).find_map(|(name, given)| given.then_some(name));
                let problem = format!("a {} without `name`", what.unwrap_or_default());
                Err(self.error(pointer, problem).remedy("give it a name"))
            }
        }
    }

    fn load_csv(&mut self, entry: &Entry, csv: &str, ignore: &[String]) -> Result<()> {
        let pointer = format!("{}/csv", entry.pointer);
        if csv.is_empty() {
            return Err(self.error(pointer, "no file name").remedy("name a CSV file"));
        }
        let path = self.files.sibling(csv);
        let rows = match csv.strip_prefix("table:") {
            Some(name) => captor_csv::parse(self.files.table(&pointer, name)?, &path, ignore)?,
            None => captor_csv::parse(&self.files.bytes(&pointer, &path)?, &path, ignore)?,
        };
        for (row, captor) in rows.into_iter().enumerate() {
            let id = captor.id.unwrap_or_else(|| row.to_string());
            let center = captor.center * self.metres;
            let disc = Round::disc(center, captor.normal, captor.radius * self.metres);
            let place = format!("{}:{}", path.display(), captor.line);
            self.add_round(entry, &place, format!("{}/{id}", entry.name), disc)?;
        }
        Ok(())
    }

    fn load_disc(&mut self, entry: &Entry, file: &DiscSpec) -> Result<()> {
        let pointer = format!("{}/disc", entry.pointer);
        self.check_size(&format!("{pointer}/radius"), file.radius)?;
        let Some(normal) = unit_vector(file.normal.into()) else {
            return Err(self
                .error(format!("{pointer}/normal"), "a normal of length 0")
                .remedy("say where the front of the disc looks: [0, 0, 1] is up"));
        };
        let disc = Round::disc(self.point(file.center), normal, file.radius * self.metres);
        let place = self.error(&pointer, "").place().to_string();
        self.add_round(entry, &place, entry.name.clone(), disc)
    }

    fn load_sphere(&mut self, entry: &Entry, file: &SphereSpec) -> Result<()> {
        let pointer = format!("{}/sphere", entry.pointer);
        self.check_size(&format!("{pointer}/radius"), file.radius)?;
        let sphere = Round::sphere(self.point(file.center), file.radius * self.metres);
        self.add_round(entry, &self.place(&pointer), entry.name.clone(), sphere)
    }

    fn load_grid(&mut self, entry: &Entry, file: &GridSpec) -> Result<()> {
        let pointer = format!("{}/grid", entry.pointer);
        self.check_size(&format!("{pointer}/radius"), file.radius)?;
        for (key, count) in [("nx", file.nx), ("ny", file.ny)] {
            if count.0 == 0 {
                return Err(self
                    .error(format!("{pointer}/{key}"), "0 cells, must be at least 1")
                    .remedy("give the number of sensors in this direction"));
            }
        }
        // before the first of them is made
        let discs = u128::from(file.nx.0) * u128::from(file.ny.0);
        let most = MAX_CAPTORS as u128;
        if discs > most {
            let problem = format!("{} x {} discs, must be at most {most}", file.nx.0, file.ny.0);
            return Err(self.error(pointer, problem).remedy("give fewer sensors"));
        }
        let normal = file.normal.unwrap_or([0.0, 0.0, 1.0]);
        let Some(normal) = unit_vector(normal.into()) else {
            return Err(self
                .error(format!("{pointer}/normal"), "a normal of length 0")
                .remedy("say where the fronts look: [0, 0, 1] is up"));
        };
        let middle = |[low, high]: [f64; 2], i: u64, n: Count| {
            let share = (i as f64 + 0.5) / n.0 as f64;
            low * (1.0 - share) + high * share
        };
        let (radius, place) = (file.radius * self.metres, self.place(&pointer));
        for (iy, ix) in (0..file.ny.0).flat_map(|iy| (0..file.nx.0).map(move |ix| (iy, ix))) {
            let center = [middle(file.x, ix, file.nx), middle(file.y, iy, file.ny), file.z];
            let disc = Round::disc(self.point(center), normal, radius);
            self.add_round(entry, &place, format!("{}/{ix}-{iy}", entry.name), disc)?;
        }
        Ok(())
    }

    fn load_line(&mut self, entry: &Entry, file: &LineSpec) -> Result<()> {
        let pointer = format!("{}/line", entry.pointer);
        self.check_size(&format!("{pointer}/width"), file.width)?;
        let (from, to) = (self.point(file.from), self.point(file.to));
        let Some(axis) = unit_vector(to - from) else {
            return Err(self
                .error(pointer, "`from` and `to` are the same point")
                .remedy("give both ends of the sensor"));
        };
        let across = unit_vector(file.normal.into()).and_then(|normal| {
            let across = normal.cross(axis);
            (across.length() > 1e-6).then(|| across.normalize())
        });
        let Some(across) = across else {
            return Err(self
                .error(format!("{pointer}/normal"), "a normal of length 0, or along the line")
                .remedy("say where the front looks: [0, 0, 1] is up"));
        };
        let side = 0.5 * file.width * self.metres * across;
        let [a, b, c, d] = [from - side, from + side, to + side, to - side];
        self.count_triangles(2)?;
        // across x axis is opposite to the normal (less its component along the axis), hence this
        // order of the corners
        let triangles = vec![[a, c, b], [a, d, c]];
        self.add_captor(entry, &self.place(&pointer), entry.name.clone(), triangles)
    }

    /// Refuses a size that is not positive.
    fn check_size(&self, pointer: &str, size: f64) -> Result<()> {
        if size > 0.0 {
            return Ok(());
        }
        Err(self.error(pointer, format!("{size}, must be above 0")).remedy("a sensor has a size"))
    }

    /// Makes the groups that are given by patterns of captors' ids. All captors must be known by
    /// then.
    pub(super) fn load_groups(&mut self, groups: &BTreeMap<String, Patterns>) -> Result<()> {
        for (group, pointer) in std::mem::take(&mut self.taken.joined) {
            if self.taken.entries.contains(&group) {
                let problem = format!(
                    "an entry or object is named {} too, and its group has these captors as well; is another name \
                     meant? (docs/scene-format.md#ids-and-groups)",
                    quoted(&group)
                );
                self.told.warn(self.place(pointer), problem);
            }
        }
        const MOST: usize = 1_000_000_000;
        let patterns: usize = groups.values().map(|patterns| patterns.all().len()).sum();
        if patterns.saturating_mul(self.parts.captors.len()) > MOST {
            let problem = format!("{patterns} patterns for {} captors", self.parts.captors.len());
            return Err(self
                .error("/groups", problem + " take too long")
                .remedy("give fewer patterns"));
        }
        let pointer = |name: &str| format!("/groups/{}", json::escaped(name));
        let mut wanted: Vec<Wanted> = Vec::with_capacity(groups.len());
        for (name, patterns) in groups {
            if self.taken.groups.contains_key(name) {
                let problem = "an entry, an object or a `group` has this name too";
                return Err(self
                    .error(pointer(name), problem)
                    .remedy("give the group another name"));
            }
            if patterns.all().is_empty() {
                return Err(self
                    .error(pointer(name), "no pattern")
                    .remedy("give one, such as \"plant/*\""));
            }
            let patterns = patterns.all().iter().map(|pattern| (pattern.as_str(), false)).collect();
            wanted.push(Wanted { index: self.taken.group(name), patterns });
        }
        self.join_groups(&mut wanted)?;
        for (wanted, name) in wanted.iter().zip(groups.keys()) {
            if let Some((pattern, _)) = wanted.patterns.iter().find(|(_, found)| !found) {
                let ids: Vec<&str> =
                    self.parts.captors.iter().take(5).map(|captor| captor.id.as_str()).collect();
                return Err(self
                    .error(pointer(name), format!("no captor has an id like {}", quoted(pattern)))
                    .remedy(match ids.is_empty() {
                        true => "the scene has no captor".into(),
                        false => format!(
                            "`*` stands for any characters; ids are like {}",
                            ids.join(", ")
                        ),
                    }));
            }
        }
        Ok(())
    }

    /// Lets captors join the groups whose patterns they fit: one captor after the other, so that its
    /// id is at hand for all patterns. Error: the groups take more memory than there is.
    fn join_groups(&mut self, groups: &mut [Wanted]) -> Result<()> {
        // what the memberships take in a scene and in its results, where each names its group
        const MEMBERSHIP: u64 = 128;
        let room = memory_left() / MEMBERSHIP;
        let mut memberships = 0;
        for captor in &mut self.parts.captors {
            let before = captor.groups.len();
            for Wanted { index, patterns } in groups.iter_mut() {
                let mut fits = false;
                for (pattern, found) in patterns {
                    let this = pattern::fits(pattern, &captor.id);
                    *found |= this;
                    fits |= this;
                }
                if fits {
                    captor.groups.push(*index);
                }
            }
            memberships += (captor.groups.len() - before) as u64;
            if memberships > room {
                let problem = format!(
                    "up to {} captors are in groups {memberships} times, which takes {:.1} GiB of memory, more than \
                     there are left",
                    quoted(&captor.id),
                    gib(memberships * MEMBERSHIP)
                );
                return Err(self.error("/groups", problem).remedy("give fewer groups"));
            }
        }
        Ok(())
    }

    fn load_captor_obj(&mut self, entry: &Entry, file: &str) -> Result<()> {
        let obj = self.obj(&format!("{}/obj", entry.pointer), file)?;
        self.say_merged(file, &obj);
        self.say_not_cut(&format!("{}/obj", entry.pointer), &obj);
        let path = self.files.sibling(file);
        let metres = self.metres_of(&obj);
        let identity = Transform::new(1.0, DVec3::ZERO, DVec3::ZERO);
        let mut triangles = vec![Vec::new(); obj.groups.len()];
        for part in &obj.parts {
            triangles[part.group].extend(self.placed(&part.triangles, &identity, metres)?);
        }
        for (group, triangles) in obj.groups.iter().zip(triangles) {
            let id = match &group.name {
                Some(name) => format!("{}/{name}", entry.name),
                None if obj.groups.len() == 1 => entry.name.clone(),
                None => format!("{}/{}", entry.name, stem(&path)),
            };
            let place = path.display().to_string();
            self.add_captor(entry, &place, id, triangles)?;
        }
        Ok(())
    }

    fn add_round(&mut self, entry: &Entry, place: &str, id: String, round: Round) -> Result<()> {
        self.count_triangles(LIKE_TRIANGLES)?;
        if round.area() <= 0.0 {
            return Err(without_area(place, &id));
        }
        let sensor = Sensor { round: Some(round), ..entry.sensor.clone() };
        self.add(entry, id, Vec::new(), sensor)
    }

    fn add_captor(
        &mut self,
        entry: &Entry,
        place: &str,
        id: String,
        triangles: Vec<[DVec3; 3]>,
    ) -> Result<()> {
        if triangles.iter().map(area).sum::<f64>() <= 0.0 {
            return Err(without_area(place, &id));
        }
        self.add(entry, id, triangles, entry.sensor.clone())
    }

    fn add(
        &mut self,
        entry: &Entry,
        id: String,
        triangles: Vec<[DVec3; 3]>,
        sensor: Sensor,
    ) -> Result<()> {
        let claimed = self.taken.claim_captor(&id);
        self.located(&entry.pointer, claimed)?;
        let (kind, groups) = (entry.kind, entry.groups.clone());
        self.parts.captors.push(CaptorPart { id, kind, triangles, groups, sensor });
        Ok(())
    }
}

fn without_area(place: &str, id: &str) -> Error {
    Error::input(place, format!("captor `{id}` has no area"))
        .remedy("leave it out, or correct its corners")
}

/// What the captors of one entry of the scene file share.
struct Entry {
    pointer: String,
    name: String,
    kind: CaptorKind,
    groups: Vec<usize>,
    sensor: Sensor,
}
