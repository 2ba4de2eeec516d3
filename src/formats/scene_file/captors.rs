//! Virtual captors: discs from CSV files or the scene, groups of OBJ files.

use std::f64::consts::TAU;

use glam::DVec3;

use super::{
    format::*,
    loader::{Loader, stem},
    objects::area,
};
use crate::{
    error::{Error, Result},
    formats::{captor_csv, input::quoted},
    math::geometry::{Transform, unit_vector},
    scene::{captor::CaptorKind, world::CaptorPart},
};

/// Triangles of a disc.
const DISC_TRIANGLES: usize = 32;

impl Loader<'_> {
    pub(super) fn load_captors(&mut self, captors: &[CaptorFile]) -> Result<()> {
        for (i, file) in captors.iter().enumerate() {
            let pointer = format!("/captors/{i}");
            let name = self.entry_name(&pointer, file)?;
            self.claim_group(&pointer, &name)?;
            let mut groups = vec![self.group(&name)];
            groups.extend(file.group.as_ref().map(|group| self.group(group)));
            groups.sort_unstable();
            groups.dedup();
            let kind = CaptorKind::Virtual { both_sides: file.sides == SidesFile::Both };
            let entry = Entry { pointer, name, kind, groups };
            match (&file.csv, &file.obj, &file.disc) {
                (Some(csv), None, None) => self.load_csv(&entry, csv)?,
                (None, Some(obj), None) => self.load_captor_obj(&entry, obj)?,
                (None, None, Some(disc)) => self.load_disc(&entry, disc)?,
                _ => {
                    return Err(self
                        .error(entry.pointer, "must have exactly one of `csv`, `obj` and `disc`")
                        .remedy("split it into several entries"));
                }
            }
        }
        Ok(())
    }

    fn entry_name(&self, pointer: &str, file: &CaptorFile) -> Result<String> {
        if file.csv.is_none() && file.obj.is_none() && file.disc.is_none() {
            return Err(self
                .error(pointer, "has none of `csv`, `obj` and `disc`")
                .remedy("say what it is"));
        }
        match (&file.name, file.csv.as_ref().or(file.obj.as_ref())) {
            (Some(name), _) => Ok(name.clone()),
            (None, Some(path)) => Ok(stem(&self.sibling(path))),
            (None, None) => {
                Err(self.error(pointer, "a disc without `name`").remedy("give it a name"))
            }
        }
    }

    fn load_csv(&mut self, entry: &Entry, csv: &str) -> Result<()> {
        let pointer = format!("{}/csv", entry.pointer);
        if csv.is_empty() {
            return Err(self.error(pointer, "no file name").remedy("name a CSV file"));
        }
        let path = self.sibling(csv);
        let rows = match csv.strip_prefix("table:") {
            Some(name) => captor_csv::parse(self.table(&pointer, name)?, &path)?,
            None => captor_csv::parse(&self.bytes(&pointer, &path)?, &path)?,
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

    /// The bytes of a table in memory.
    fn table(&self, pointer: &str, name: &str) -> Result<&[u8]> {
        self.sources.tables.get(name).map(Vec::as_slice).ok_or_else(|| {
            self.error(pointer, format!("there is no table {} in memory", quoted(name)))
                .remedy("name a CSV file; tables can only be handed over by a program")
        })
    }

    fn load_disc(&mut self, entry: &Entry, file: &DiscFile) -> Result<()> {
        let pointer = format!("{}/disc", entry.pointer);
        if file.radius <= 0.0 {
            return Err(self
                .error(format!("{pointer}/radius"), format!("{}, must be above 0", file.radius))
                .remedy("a sensor has a size"));
        }
        let Some(normal) = unit_vector(file.normal.into()) else {
            return Err(self
                .error(format!("{pointer}/normal"), "a normal of length 0")
                .remedy("say where the front of the disc looks: [0, 0, 1] is up"));
        };
        let triangles = disc(self.point(file.center), normal, file.radius * self.metres);
        let place = self.error(&pointer, "").place().to_string();
        self.add_captor(entry, &place, entry.name.clone(), triangles)
    }

    fn load_captor_obj(&mut self, entry: &Entry, file: &str) -> Result<()> {
        let obj = self.obj(&format!("{}/obj", entry.pointer), file)?;
        let path = self.sibling(file);
        let identity = Transform::new(1.0, DVec3::ZERO, DVec3::ZERO);
        let mut triangles = vec![Vec::new(); obj.groups.len()];
        for part in &obj.parts {
            triangles[part.group].extend(self.placed(&part.triangles, &identity)?);
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
        let (kind, groups) = (entry.kind, entry.groups.clone());
        self.parts.captors.push(CaptorPart { id, kind, triangles, groups });
        Ok(())
    }
}

/// What the captors of one entry share.
struct Entry {
    pointer: String,
    name: String,
    kind: CaptorKind,
    groups: Vec<usize>,
}

/// A fan of triangles with the area of the disc; front where the unit vector `normal` points.
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

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

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
