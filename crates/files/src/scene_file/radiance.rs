//! Loads rooms in the format of Radiance: their surfaces in the form of an OBJ file, their
//! materials, and their lamps, which lights of the scene give power to.

use std::{collections::HashMap, f64::consts::TAU, sync::Arc};

use glam::DVec3;

use super::{
    files::unknown,
    loader::Loader,
    luminaires::LampFile,
    numbers::single,
    rooms::{RoomLamp, RoomLamps},
    spec::*,
};
use crate::{
    input::quoted,
    obj::{ObjFile, ObjGroup, ObjPart},
    rad::{Dialect, RadBsdf, RadFile, RadMaterial},
    scatter_table::Side,
};
use phylux_core::{
    error::{Error, Problem, Result},
    math::geometry::{Transform, area},
    scene::{
        light::{Area, Lamp, Tube, Unplaced},
        material::{
            Dielectric, Lambert, MAX_EXPONENT, Material, Mirror, Pane, Phong, PhongFractions,
        },
        world::LightPart,
    },
};

/// Index of refraction of Radiance's glass, where the file states none.
const GLASS_IOR: f64 = 1.52;

/// What a user can do about a material that cannot be read; the remedy of errors.
const OWN: &str = "give the scene a material of this name";

impl Loader<'_> {
    /// Reads a room, and returns its surfaces also in the form of an OBJ file, whose groups are the
    /// identifiers.
    pub(super) fn rad(
        &mut self,
        pointer: &str,
        file: &str,
        dialect: DialectSpec,
    ) -> Result<(RadFile, Arc<ObjFile>)> {
        if file.is_empty() {
            return Err(self.error(pointer, "no file name").remedy("name a .rad file"));
        }
        let path = self.files.sibling(file);
        let bytes = self.files.bytes(pointer, &path)?;
        let dialect = match dialect {
            DialectSpec::Radiance => Dialect::Radiance,
            DialectSpec::Sec2 => Dialect::Sec2,
        };
        let rad = RadFile::parse(&bytes, &path, dialect, &|path| self.files.fetch(path))?;
        rad.warnings.iter().for_each(|warning| self.told.warn(pointer, warning));
        let mut obj = ObjFile::default();
        let mut groups = HashMap::new();
        for part in &rad.parts {
            let group = *groups.entry(&part.identifier).or_insert_with(|| {
                obj.groups.push(ObjGroup { name: Some(part.identifier.clone()) });
                obj.groups.len() - 1
            });
            let (triangles, material) = (part.triangles.clone(), None);
            obj.parts.push(ObjPart { group, material, line: 0, triangles, tangled: 0, bent: 0 });
        }
        Ok((rad, Arc::new(obj)))
    }

    /// Returns the index in the scene of a material of a room: the material of the scene file with
    /// this name, or else the one in the file of the room.
    pub(super) fn rad_material(
        &mut self,
        place: &str,
        file: &RadMaterial,
        dialect: DialectSpec,
    ) -> Result<usize> {
        if let Some(&entry) = self.materials.by_name.get(&file.name) {
            return self.materials.use_entry(entry);
        }
        if file.kind.is_empty() {
            let error = Error::input(place, format!("no material {}", quoted(&file.name)));
            let scene = self.materials.by_name.keys().map(String::as_str);
            return Err(unknown(error, &file.name, scene));
        }
        if let Some(problem) = &file.problem {
            return Err(problem.clone());
        }
        if let Some(&index) = self.materials.by_mtl_place.get(&file.place) {
            return self.materials.use_entry(index);
        }
        let material = match &file.bsdf {
            Some(bsdf) => self.rad_bsdf(file, bsdf)?,
            None => self.made_of(file, dialect)?,
        };
        let taken = self.materials.names.contains(&file.name);
        let shown =
            if taken { format!("{} ({})", file.name, file.place) } else { file.name.clone() };
        let index = self.materials.add(shown, Ok(material), true);
        self.materials.by_mtl_place.insert(file.place.clone(), index);
        self.materials.use_entry(index)
    }

    /// Reads the file of a measured material. In Radiance the front of a surface is the side of the
    /// room, which WINDOW calls the back.
    fn rad_bsdf(&mut self, file: &RadMaterial, bsdf: &RadBsdf) -> Result<Material> {
        let refused = |problem: String| {
            Error::input(&file.place, format!("{}: {problem}", quoted(&file.name))).remedy(OWN)
        };
        let mut found = Err(String::new());
        for path in &bsdf.files {
            found = self.files.fetch(path).map(|bytes| (bytes, path));
            if found.is_ok() {
                break;
            }
        }
        let (bytes, path) =
            found.map_err(|why| refused(format!("{}: {why}", bsdf.files[0].display())))?;
        if bsdf.through {
            let problem = format!(
                "{}: the surface lies where it stands, without thickness, and light that goes \
                 straight through is spread over a patch",
                quoted(&file.name)
            );
            self.told.warn(&file.place, problem);
        }
        self.table_file(&file.place, path, &bytes, false, Side::Inside)
    }

    /// Returns the direction of azimuth 0 on the triangles of a room whose material is measured,
    /// as it follows from the direction up; otherwise that of their longest edges, `along`.
    pub(super) fn rad_tangents(rad: &RadFile, along: &[DVec3]) -> Vec<DVec3> {
        let triangles = rad.parts.iter().flat_map(|part| {
            let up = rad.materials[part.material].bsdf.as_ref().map(|bsdf| bsdf.up);
            part.triangles.iter().map(move |triangle| (triangle, up))
        });
        let turned = triangles.zip(along).map(|(([a, b, c], up), &along)| {
            let normal = (*b - *a).cross(*c - *a).normalize_or_zero();
            let right = up.and_then(|up| up.normalize_or_zero().cross(normal).try_normalize());
            right.unwrap_or(along)
        });
        turned.collect()
    }

    /// Returns the values of a colour per band: red, green and blue in this order for three bands,
    /// and their mean for one band.
    fn colour(&self, file: &RadMaterial) -> Result<Vec<f64>> {
        let rgb = &file.numbers[..3];
        if let Some(bad) = rgb.iter().find(|value| !(0.0..=1.0).contains(*value)) {
            let problem = format!("colour {bad} of {}, must be from 0 to 1", quoted(&file.name));
            return Err(Error::input(&file.place, problem).remedy(OWN));
        }
        match self.bands() {
            1 => Ok(vec![rgb.iter().sum::<f64>() / 3.0]),
            3 => Ok(rgb.to_vec()),
            n => {
                let problem =
                    format!("{} has r, g, b, the scene has {n} bands", quoted(&file.name));
                Err(Error::input(&file.place, problem).remedy(OWN))
            }
        }
    }

    fn made_of(&self, file: &RadMaterial, dialect: DialectSpec) -> Result<Material> {
        let colour = self.colour(file)?;
        let number = |i: usize| file.numbers.get(i).copied().unwrap_or(0.0);
        let refused = |problem: &str| {
            Err(Error::input(&file.place, format!("{}: {problem}", quoted(&file.name))).remedy(OWN))
        };
        let times = |factor: f64| -> Vec<f64> { colour.iter().map(|c| c * factor).collect() };
        let sec2 = dialect == DialectSpec::Sec2;
        let (s, roughness, t, straight) = (number(3), number(4), number(5), number(6));
        if ["plastic", "metal", "trans"].contains(&file.kind.as_str())
            && ![s, t].iter().all(|share| (0.0..=1.0).contains(share))
        {
            return refused("specularity and transmission are from 0 to 1");
        }
        let named = |problem: Problem| problem.of(quoted(&file.name));
        let made = match file.kind.as_str() {
            "glass" => {
                let ior = file.numbers.get(3).copied().unwrap_or(GLASS_IOR);
                Pane::new(ior, &single(&colour)).map(Material::from)
            }
            "dielectric" => {
                if colour.iter().any(|&c| c < 1.0) {
                    return refused(
                        "a dielectric that absorbs along the way, which no material here does",
                    );
                }
                Dielectric::new(s, &single(&colour)).map(Material::from)
            }
            "mirror" => Mirror::new(&single(&colour)).map(Material::from),
            "plastic" | "metal" | "trans" => {
                if file.kind == "trans" && !sec2 && straight > 0.0 {
                    return refused("a part that goes straight through (tspec); a `table` has one");
                }
                let mirrored = match file.kind.as_str() {
                    "metal" => times(s),
                    _ if sec2 => times(s),
                    _ => vec![s; self.bands()],
                };
                let (reflected, transmitted) = match (file.kind.as_str(), sec2) {
                    ("trans", false) => (times((1.0 - s) * (1.0 - t)), times((1.0 - s) * t)),
                    ("trans", true) => (times(1.0 - s), vec![t; self.bands()]),
                    _ => (times(1.0 - s), vec![0.0; self.bands()]),
                };
                if s == 0.0 && transmitted.iter().all(|&t| t == 0.0) {
                    Lambert::new(&single(&reflected)).map(Material::from)
                } else {
                    // with this exponent Phong's lobe is about as wide as Ward's
                    let exponent = 0.5 / (roughness * roughness);
                    let rough = !sec2 && roughness > 0.0 && exponent <= MAX_EXPONENT;
                    let fractions = PhongFractions {
                        reflectance: &single(&reflected),
                        specular: &single(&mirrored),
                        transmittance: &single(&transmitted),
                    };
                    let exponent = rough.then_some(exponent as f32);
                    let made = Phong::new(fractions, exponent, &self.band_names());
                    made.map(Material::from).map_err(named)
                }
            }
            _ => return refused("a lamp among the surfaces"),
        };
        made.map_err(|problem| problem.or(OWN).at(&file.place))
    }

    /// Keeps the lamps of a room, at the place of this copy of it, until a light of the scene gives
    /// them power.
    pub(super) fn place_lamps(
        &mut self,
        pointer: &str,
        object: &str,
        rad: &RadFile,
        transform: &Transform,
    ) -> Result<()> {
        for lamp in &rad.lamps {
            let triangles = self.placed(&lamp.triangles, transform, self.metres)?;
            let metres = self.metres;
            let (emitter, area) = match lamp.tube {
                Some((from, to, radius)) => {
                    let [from, to] = [from, to].map(|p| transform.point(p * metres));
                    let radius = radius * transform.turned(DVec3::X * metres).length();
                    let area = TAU * radius * from.distance(to);
                    (Tube::whole(from, to, radius).map(Unplaced::of_any_kind), area)
                }
                None => {
                    let area = triangles.iter().map(area).sum();
                    (Area::new(triangles, false).map(Unplaced::of_any_kind), area)
                }
            };
            let material = &rad.materials[lamp.material].name;
            let emitter = self.shining(&lamp.identifier, emitter)?;
            let lamp = RoomLamp { identifier: lamp.identifier.clone(), area, emitter };
            let known = self
                .room_lamps
                .iter_mut()
                .find(|known| known.pointer == pointer && known.material == *material);
            match known {
                Some(known) => known.lamps.push(lamp),
                None => self.room_lamps.push(RoomLamps {
                    object: object.to_string(),
                    material: material.clone(),
                    pointer: pointer.to_string(),
                    lit: false,
                    lamps: vec![lamp],
                }),
            }
        }
        Ok(())
    }

    /// Gives power to the lamps of one material in an object: each lamp gets a share of the power
    /// by its area.
    pub(super) fn rad_light(&mut self, pointer: &str, light: &RadLightSpec) -> Result<()> {
        let power = self.power(pointer, &light.power, LampFile::default(), None)?;
        let wanted =
            |lamps: &RoomLamps| lamps.object == light.object && lamps.material == light.material;
        let mut found: Vec<RoomLamp> = Vec::new();
        for lamps in self.room_lamps.iter_mut().filter(|lamps| wanted(lamps)) {
            if lamps.lit {
                return Err(self
                    .error(pointer, "a second light of the same lamps")
                    .remedy("give their whole power in one"));
            }
            lamps.lit = true;
            found.append(&mut lamps.lamps);
        }
        if found.is_empty() {
            let problem =
                format!("no lamps of {} in {}", quoted(&light.material), quoted(&light.object));
            let known = self.room_lamps.iter().map(|lamps| (&lamps.object, &lamps.material));
            let known: Vec<String> = known.map(|(o, m)| format!("{m} in {o}")).collect();
            let error = self.error(pointer, problem);
            return Err(unknown(error, &light.material, known.iter().map(String::as_str)));
        }
        let whole: f64 = found.iter().map(|lamp| lamp.area).sum();
        let mut copies = HashMap::new();
        for RoomLamp { identifier, area, emitter } in found {
            let mut name = identifier.clone();
            let copy = copies.entry(identifier.clone()).or_insert(0);
            while self.taken.light_names.contains(&name) {
                *copy += 1;
                name = format!("{identifier}#{copy}");
            }
            let share = if whole > 0.0 { area / whole } else { 0.0 };
            let power: Vec<f64> = power.iter().map(|power| power * share).collect();
            let watts = light.watts.map(|watts| (name.clone(), watts * share));
            self.parts.watts.extend(watts.filter(|_| share > 0.0));
            self.add_light(pointer, LightPart::new(name, Lamp::new(power, emitter)))?;
        }
        Ok(())
    }

    /// Refuses a scene with lamps of rooms that no light gives power to.
    pub(super) fn check_lamps(&self) -> Result<()> {
        let Some(dark) = self.room_lamps.iter().find(|lamps| !lamps.lit) else { return Ok(()) };
        let RoomLamps { object, material, pointer, lamps, .. } = dark;
        let count = if lamps.len() == 1 { "lamp".into() } else { format!("{} lamps", lamps.len()) };
        let has = if lamps.len() == 1 { "has" } else { "have" };
        let problem = format!("its {count} of {} {has} no light", quoted(material));
        Err(self.error(format!("{pointer}/rad"), problem).remedy(format!(
            "add {{\"type\": \"rad\", \"object\": {object:?}, \"material\": {material:?}, \"power\": ...}} to /lights"
        )))
    }
}
