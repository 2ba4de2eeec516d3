//! Loads virtual captors: discs (single, in a grid or from CSV files), spheres, line sensors, and
//! the groups of OBJ files. Makes groups of captors by patterns of their ids, too.

use std::{
    collections::BTreeMap,
    f64::consts::{PI, TAU},
};

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
    },
    scene::{
        captor::{CaptorKind, Response, Sensor},
        world::{CaptorPart, MAX_TRIANGLES},
    },
};

/// Number of triangles that a disc is made of.
const DISC_TRIANGLES: usize = 32;
/// Number of segments that each edge of a sphere's octahedron is cut into.
const SPHERE_CUTS: usize = 16;

impl Loader<'_> {
    pub(super) fn load_captors(&mut self, captors: &[CaptorSpec]) -> Result<()> {
        for (i, file) in captors.iter().enumerate() {
            let pointer = format!("/captors/{i}");
            let name = self.entry_name(&pointer, file)?;
            self.claim_group(&pointer, &name)?;
            let mut groups = vec![self.group(&name)];
            groups.extend(file.group.as_ref().map(|group| self.joined(&pointer, &name, group)));
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
            let sensor = Sensor { is_sphere: file.sphere.is_some(), response };
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
            (None, Some(path)) => Ok(stem(&self.sibling(path))),
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
        let path = self.sibling(csv);
        let rows = match csv.strip_prefix("table:") {
            Some(name) => captor_csv::parse(self.table(&pointer, name)?, &path, ignore)?,
            None => captor_csv::parse(&self.bytes(&pointer, &path)?, &path, ignore)?,
        };
        for (row, captor) in rows.into_iter().enumerate() {
            let id = captor.id.unwrap_or_else(|| row.to_string());
            let center = captor.center * self.metres;
            self.count_triangles(DISC_TRIANGLES)?;
            let disc = disc(center, captor.normal, captor.radius * self.metres);
            let place = format!("{}:{}", path.display(), captor.line);
            self.add_captor(entry, &place, format!("{}/{id}", entry.name), disc)?;
        }
        Ok(())
    }

    /// Returns the bytes of a table that is in memory.
    pub(super) fn table(&self, pointer: &str, name: &str) -> Result<&[u8]> {
        self.sources.tables.get(name).map(Vec::as_slice).ok_or_else(|| {
            self.error(pointer, format!("there is no table {} in memory", quoted(name)))
                .remedy("name a CSV file; tables can only be handed over by a program")
        })
    }

    fn load_disc(&mut self, entry: &Entry, file: &DiscSpec) -> Result<()> {
        let pointer = format!("{}/disc", entry.pointer);
        self.check_size(&format!("{pointer}/radius"), file.radius)?;
        let Some(normal) = unit_vector(file.normal.into()) else {
            return Err(self
                .error(format!("{pointer}/normal"), "a normal of length 0")
                .remedy("say where the front of the disc looks: [0, 0, 1] is up"));
        };
        self.count_triangles(DISC_TRIANGLES)?;
        let triangles = disc(self.point(file.center), normal, file.radius * self.metres);
        let place = self.error(&pointer, "").place().to_string();
        self.add_captor(entry, &place, entry.name.clone(), triangles)
    }

    fn load_sphere(&mut self, entry: &Entry, file: &SphereSpec) -> Result<()> {
        let pointer = format!("{}/sphere", entry.pointer);
        self.check_size(&format!("{pointer}/radius"), file.radius)?;
        self.count_triangles(8 * SPHERE_CUTS * SPHERE_CUTS)?;
        let triangles = sphere(self.point(file.center), file.radius * self.metres);
        self.add_captor(entry, &self.place(&pointer), entry.name.clone(), triangles)
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
        let most = (MAX_TRIANGLES / DISC_TRIANGLES) as u128;
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
        let radius = file.radius * self.metres;
        for (iy, ix) in (0..file.ny.0).flat_map(|iy| (0..file.nx.0).map(move |ix| (iy, ix))) {
            self.count_triangles(DISC_TRIANGLES)?;
            let center = [middle(file.x, ix, file.nx), middle(file.y, iy, file.ny), file.z];
            let triangles = disc(self.point(center), normal, radius);
            self.add_captor(
                entry,
                &self.place(&pointer),
                format!("{}/{ix}-{iy}", entry.name),
                triangles,
            )?;
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
        for (group, place) in std::mem::take(&mut self.joined) {
            if self.entries.contains(&group) {
                let problem = format!(
                    "an entry or object is named {} too, and its group has these captors as well; is another name \
                     meant? (docs/scene-format.md#ids-and-groups)",
                    quoted(&group)
                );
                self.warn(place, problem);
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
        // what the memberships take in a scene and in its results, where each names its group
        const MEMBERSHIP: u64 = 128;
        let room = memory_left() / MEMBERSHIP;
        let mut memberships = 0;
        for (name, patterns) in groups {
            let pointer = format!("/groups/{}", json::escaped(name));
            if self.groups.contains_key(name) {
                let problem = "an entry, an object or a `group` has this name too";
                return Err(self.error(pointer, problem).remedy("give the group another name"));
            }
            let mut found = vec![false; patterns.all().len()];
            let group = self.group(name);
            for captor in &mut self.parts.captors {
                let mut fits = false;
                for (pattern, found) in patterns.all().iter().zip(&mut found) {
                    let this = pattern::fits(pattern, &captor.id);
                    *found |= this;
                    fits |= this;
                }
                if fits {
                    captor.groups.push(group);
                    memberships += 1;
                }
            }
            if memberships > room {
                let problem = format!(
                    "up to here captors are in groups {memberships} times, which takes {:.1} GiB of memory, more than \
                    there are left",
                    gib(memberships * MEMBERSHIP)
                );
                return Err(self.error(pointer, problem).remedy("give fewer groups"));
            }
            if found.is_empty() {
                return Err(self
                    .error(pointer, "no pattern")
                    .remedy("give one, such as \"plant/*\""));
            }
            if let Some(i) = found.iter().position(|found| !found) {
                let pattern = &patterns.all()[i];
                let ids: Vec<&str> =
                    self.parts.captors.iter().take(5).map(|captor| captor.id.as_str()).collect();
                return Err(self
                    .error(pointer, format!("no captor has an id like {}", quoted(pattern)))
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

    fn load_captor_obj(&mut self, entry: &Entry, file: &str) -> Result<()> {
        let obj = self.obj(&format!("{}/obj", entry.pointer), file)?;
        self.say_merged(file, &obj);
        self.say_not_cut(&format!("{}/obj", entry.pointer), &obj);
        let path = self.sibling(file);
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

    fn add_captor(
        &mut self,
        entry: &Entry,
        place: &str,
        id: String,
        triangles: Vec<[DVec3; 3]>,
    ) -> Result<()> {
        if triangles.iter().map(area).sum::<f64>() <= 0.0 {
            return Err(Error::input(place, format!("captor `{id}` has no area"))
                .remedy("leave it out, or correct its corners"));
        }
        self.claim_id(&entry.pointer, &id)?;
        let Entry { kind, groups, sensor, .. } = entry;
        let (kind, groups, sensor) = (*kind, groups.clone(), sensor.clone());
        self.parts.captors.push(CaptorPart { id, kind, triangles, groups, sensor });
        Ok(())
    }
}

/// What the captors of one entry of the scene file share.
struct Entry {
    pointer: String,
    name: String,
    kind: CaptorKind,
    groups: Vec<usize>,
    sensor: Sensor,
}

/// Makes a fan of triangles with the area of the disc; its front is on the side that the unit
/// vector `normal` points to.
fn disc(center: DVec3, normal: DVec3, radius: f64) -> Vec<[DVec3; 3]> {
    let (x, y) = normal.any_orthonormal_pair();
    let n = DISC_TRIANGLES as f64;
    let rim = radius * (TAU / n / (TAU / n).sin()).sqrt();
    let corner = |i: usize| {
        let (sin, cos) = (TAU * (i % DISC_TRIANGLES) as f64 / n).sin_cos();
        center + rim * (cos * x + sin * y)
    };
    (0..DISC_TRIANGLES).map(|i| [center, corner(i), corner(i + 1)]).collect()
}

/// Makes an octahedron whose faces are cut into triangles with corners on a sphere and normals out.
/// Their total area is four times that of the wanted sphere's cross-section: then their mean
/// cross-section is that of the sphere, too (Cauchy).
fn sphere(center: DVec3, radius: f64) -> Vec<[DVec3; 3]> {
    let n = SPHERE_CUTS;
    let mut triangles = Vec::with_capacity(8 * n * n);
    for octant in 0..8 {
        let sign = |axis: usize| if octant >> axis & 1 == 0 { 1.0 } else { -1.0 };
        let signs = DVec3::new(sign(0), sign(1), sign(2));
        let corner = |i: usize, j: usize| {
            (DVec3::new((n - i - j) as f64, i as f64, j as f64).normalize()) * signs
        };
        let mut add = |a: DVec3, b: DVec3, c: DVec3| {
            let outward = (b - a).cross(c - a).dot(a) > 0.0;
            triangles.push(if outward { [a, b, c] } else { [a, c, b] });
        };
        for (i, j) in (0..n).flat_map(|i| (0..n - i).map(move |j| (i, j))) {
            add(corner(i, j), corner(i + 1, j), corner(i, j + 1));
            if i + j + 1 < n {
                add(corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1));
            }
        }
    }
    let total: f64 = triangles.iter().map(area).sum();
    let scale = radius * (4.0 * PI / total).sqrt();
    triangles.iter().map(|triangle| triangle.map(|p| center + scale * p)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The sphere has its area, all its normals point out, and its outline from any side has the
    /// circle's area to 0.2 %.
    #[test]
    fn a_sphere_is_round() {
        let center = DVec3::new(1.0, -2.0, 3.0);
        let triangles = sphere(center, 0.5);
        assert_eq!(triangles.len(), 8 * SPHERE_CUTS * SPHERE_CUTS);
        let total: f64 = triangles.iter().map(area).sum();
        assert!((total - PI).abs() < 1e-12);
        let vectors = triangles.iter().map(|[a, b, c]| (*a, 0.5 * (b - a).cross(c - a)));
        assert!(vectors.clone().all(|(a, vector)| (a - center).dot(vector) > 0.0));
        for from in [DVec3::X, DVec3::ONE, DVec3::new(1.0, 1.0, 0.0), DVec3::new(3.0, -1.0, 0.5)] {
            let from = from.normalize();
            let seen: f64 = vectors.clone().map(|(_, vector)| vector.dot(from).max(0.0)).sum();
            assert!((seen / (0.25 * PI) - 1.0).abs() < 2e-3, "{seen}");
        }
    }

    #[test]
    fn disc_has_its_true_area_and_front() {
        for normal in [DVec3::Z, DVec3::NEG_Z, DVec3::new(1.0, -2.0, 0.5)] {
            let triangles = disc(DVec3::new(3.0, 2.0, 1.0), normal.normalize(), 0.4);
            let total: f64 = triangles.iter().map(area).sum();
            assert!((total - PI * 0.16).abs() < 1e-12);
            assert!(triangles.iter().all(|[a, b, c]| (b - a).cross(c - a).dot(normal) > 0.0));
        }
    }
}
