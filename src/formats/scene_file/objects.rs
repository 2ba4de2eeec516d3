//! Loads objects: placed files of meshes (and files in the format of Radiance), with their materials,
//! their captors and their surfaces that emit light.

use std::{collections::BTreeMap, f64::consts::PI, sync::Arc};

use glam::DVec3;

use super::{
    loader::{Loader, stem},
    masks::Pieces,
    placed::{Turn, area},
    spec::*,
};
use crate::{
    error::{Error, Result},
    formats::{
        mesh_file,
        obj::{ObjFile, ObjPart},
        rad::RadFile,
    },
    math::geometry::Transform,
    scene::{
        captor::{CaptorKind, Sensor},
        light::LightShape,
        world::{CaptorPart, CopyPart, LightPart, SurfacePart},
    },
};

/// An object whose file is read and whose materials are found.
struct Object<'a> {
    pointer: &'a str,
    name: String,
    file: &'a ObjectSpec,
    obj: Arc<ObjFile>,
    /// Name of the file without its extension: the group of faces outside any group of the file.
    stem: String,
    /// Index in the scene of the material of each part of the file.
    materials: Vec<usize>,
    /// Direction of azimuth 0 on each triangle of the file; empty unless one of the materials needs
    /// it, since it can be turned about the normal.
    tangents: Vec<DVec3>,
    /// Where the triangles come from, if masks have cut those of the file.
    pieces: Pieces,
    /// Surfaces that emit light, by the name of their MTL entry.
    glows: BTreeMap<String, Glow>,
}

struct Glow {
    radiance: Vec<f64>,
    triangles: Vec<[DVec3; 3]>,
}

impl Loader<'_> {
    pub(super) fn load_objects(&mut self, objects: &[ObjectSpec]) -> Result<()> {
        let present = |(_, file): &(usize, &ObjectSpec)| file.present != Some(false);
        for (i, file) in objects.iter().enumerate().filter(present) {
            self.load_object(&format!("/objects/{i}"), file)?;
        }
        Ok(())
    }

    fn load_object(&mut self, pointer: &str, file: &ObjectSpec) -> Result<()> {
        let (obj, rad) = self.object_file(pointer, file)?;
        let (obj, pieces) = self.masked(pointer, file, obj)?;
        let stem = stem(&self.sibling(file.obj.as_ref().or(file.rad.as_ref()).map_or("", |f| f)));
        let name = file.name.clone().unwrap_or_else(|| stem.clone());
        let (materials, tangents, glows) = (Vec::new(), Vec::new(), BTreeMap::new());
        let mut object =
            Object { pointer, name, file, obj, stem, materials, tangents, pieces, glows };
        for (i, part) in object.obj.clone().parts.iter().enumerate() {
            let material = match (&file.material, &rad) {
                (Some(material), _) => {
                    self.named_material(&format!("{pointer}/material"), material)?
                }
                (None, None) => self.part_material(&mut object, part)?,
                (None, Some(rad)) => {
                    let part = &rad.parts[i];
                    let material = &rad.materials[part.material];
                    self.rad_material(&part.place, material, file.dialect.unwrap_or_default())?
                }
            };
            object.materials.push(material);
        }
        if object.materials.iter().any(|&material| self.materials.needs_tangents(material)) {
            let name = file.obj.as_deref();
            let sources = &object.pieces.sources;
            object.tangents =
                self.tangents(&format!("{pointer}/obj"), name, &object.obj, sources)?;
            if let Some(rad) = &rad {
                object.tangents = Self::rad_tangents(rad, &object.tangents);
            }
        }

        if file.captor != SurfaceCaptorSpec::Off {
            self.claim_group(pointer, &object.name)?;
            self.say_merged(file.obj.as_deref().unwrap_or_default(), &object.obj);
        }
        self.say_unused(
            file.obj.as_deref().unwrap_or_default(),
            &object.obj,
            file.material.as_deref(),
        );
        if file.ground {
            self.parts.ground.push(self.parts.objects.len());
        }
        self.parts.objects.push(object.name.clone());
        let turn = Turn::of(&object.obj, file.up);
        let placements =
            self.object_placements(pointer, file.transform, file.instances.as_ref(), turn)?;
        for (i, transform) in placements.iter().enumerate() {
            let instance = file.instances.as_ref().map(|_| i);
            let first = self.parts.surfaces.len();
            self.place_object(&mut object, instance, transform)?;
            let surfaces = first..self.parts.surfaces.len();
            if placements.len() > 1 && !surfaces.is_empty() {
                self.parts.copies.push(CopyPart { surfaces, transform: *transform });
            }
            if let Some(rad) = &rad {
                self.place_lamps(pointer, &object.name, rad, transform)?;
            }
        }

        for (material, glow) in object.glows {
            let area: f64 = glow.triangles.iter().map(area).sum();
            let power = glow.radiance.iter().map(|l| PI * l * area).collect();
            let shape = LightShape::Area { triangles: glow.triangles, two_sided: false };
            let name = format!("{}/{material}", object.name);
            self.add_light(pointer, LightPart { name, power, shape })?;
        }
        Ok(())
    }

    /// Reads the file of an object. The file of a room in the format of Radiance is returned as a
    /// whole, too, for its materials and lamps.
    fn object_file(
        &mut self,
        pointer: &str,
        file: &ObjectSpec,
    ) -> Result<(Arc<ObjFile>, Option<RadFile>)> {
        match (&file.obj, &file.rad) {
            (Some(obj), None) => {
                if file.dialect.is_some() {
                    return Err(self
                        .error(format!("{pointer}/dialect"), "goes with `rad` only")
                        .remedy("leave it out"));
                }
                Ok((self.obj(&format!("{pointer}/obj"), obj)?, None))
            }
            (None, Some(rad)) => {
                let dialect = file.dialect.unwrap_or_default();
                let (rad, obj) = self.rad(&format!("{pointer}/rad"), rad, dialect)?;
                Ok((obj, Some(rad)))
            }
            (Some(_), Some(_)) => Err(self
                .error(pointer, "both `obj` and `rad`")
                .remedy("give one of them; a second file is a second object")),
            (None, None) => Err(self
                .error(pointer, "missing key `obj`")
                .remedy("name an OBJ, PLY, STL or glTF file, or a file of Radiance as `rad`")),
        }
    }

    /// Finds the material of a part, if the object has no material of its own.
    fn part_material(&mut self, object: &mut Object, part: &ObjPart) -> Result<usize> {
        let file = object.file.obj.as_deref().unwrap_or_default();
        let path = self.sibling(file);
        let is_obj = mesh_file::is_obj(&path);
        let place = match is_obj {
            true => format!("{}:{}", path.display(), part.line),
            false => path.display().to_string(),
        };
        let Some(name) = &part.material else {
            return Err(match is_obj {
                true => Error::input(place, "a face without `usemtl`")
                    .remedy("name its material there, or give the object a `material`"),
                false => Error::input(place, "the file names no material")
                    .remedy("give the object a `material`"),
            });
        };
        let (index, radiance) = self.obj_material(&place, name, &object.obj.mtl)?;
        if let Some(radiance) = radiance {
            let glow = Glow { radiance, triangles: Vec::new() };
            object.glows.entry(name.clone()).or_insert(glow);
        }
        Ok(index)
    }

    /// Adds one copy of an object to the scene.
    fn place_object(
        &mut self,
        object: &mut Object,
        instance: Option<usize>,
        transform: &Transform,
    ) -> Result<()> {
        let object_index = self.parts.objects.len().checked_sub(1);
        let copy = instance.map_or(String::new(), |i| format!("#{i}"));
        let mut captors = match object.file.captor {
            SurfaceCaptorSpec::Off => None,
            _ => {
                let mut groups = vec![self.group(&object.name)];
                if instance.is_some() && object.file.captor != SurfaceCaptorSpec::Instances {
                    groups.push(self.group(&format!("{}{copy}", object.name)));
                }
                groups.extend(object.file.group.as_ref().map(|group| self.group(group)));
                groups.sort_unstable();
                groups.dedup();
                Some(SurfaceCaptors {
                    groups,
                    of_group: vec![Seen::default(); object.obj.groups.len()],
                })
            }
        };
        let mut first = 0;
        for (part, &material) in object.obj.clone().parts.iter().zip(&object.materials) {
            let of_part = object.tangents.get(first..first + part.triangles.len());
            let turned = of_part.filter(|_| self.materials.needs_tangents(material));
            let tangents = turned.unwrap_or_default().iter();
            let mut tangents = tangents.map(|&tangent| transform.turned(tangent));
            let numbers = object.pieces.numbers.get(first..first + part.triangles.len());
            first += part.triangles.len();
            let metres = self.metres_of(&object.obj);
            let triangles = self.placed(&part.triangles, transform, metres)?;
            if let Some(glow) = part.material.as_ref().and_then(|name| object.glows.get_mut(name)) {
                glow.triangles.extend_from_slice(&triangles);
            }
            let Some(captors) = &mut captors else {
                self.turn_next(tangents);
                self.parts.surfaces.push(SurfacePart {
                    object: object_index,
                    material,
                    captor: None,
                    triangles,
                });
                continue;
            };
            let whole = object.file.captor == SurfaceCaptorSpec::Instances;
            let group = object.obj.groups[part.group].name.as_deref().unwrap_or(&object.stem);
            let id = match whole {
                true => format!("{}{copy}", object.name),
                false => format!("{}/{group}{copy}", object.name),
            };
            let seen = &mut captors.of_group[if whole { 0 } else { part.group }];
            if object.file.captor == SurfaceCaptorSpec::Triangles {
                let number = |i| numbers.map_or(seen.triangles + i, |numbers| numbers[i]);
                let numbers: Vec<usize> = (0..triangles.len()).map(number).collect();
                seen.triangles += triangles.len();
                let mut rest = &triangles[..];
                // the pieces that a mask leaves of one triangle are one captor
                for pieces in numbers.chunk_by(|a, b| a == b) {
                    let (triangles, after) = rest.split_at(pieces.len());
                    rest = after;
                    let tangents: Vec<DVec3> = tangents.by_ref().take(pieces.len()).collect();
                    let id = format!("{id}/{}", pieces[0]);
                    if triangles.iter().all(|triangle| area(triangle) == 0.0) {
                        self.warn(
                            object.pointer,
                            format!("triangle `{id}` has no area: no captor"),
                        );
                        continue;
                    }
                    let captor = Some(self.surface_captor(object.pointer, id, &captors.groups)?);
                    self.turn_next(tangents);
                    let triangles = triangles.to_vec();
                    self.parts.surfaces.push(SurfacePart {
                        object: object_index,
                        material,
                        captor,
                        triangles,
                    });
                }
            } else {
                if seen.captor.is_none() {
                    seen.captor = Some(self.surface_captor(object.pointer, id, &captors.groups)?);
                }
                let captor = seen.captor;
                self.turn_next(tangents);
                self.parts.surfaces.push(SurfacePart {
                    object: object_index,
                    material,
                    captor,
                    triangles,
                });
            }
        }
        Ok(())
    }

    /// Says where azimuth 0 lies on the triangles of the surface that is added next; does nothing
    /// if `tangents` is empty.
    pub(super) fn turn_next(&mut self, tangents: impl IntoIterator<Item = DVec3>) {
        let tangents: Vec<DVec3> = tangents.into_iter().collect();
        if !tangents.is_empty() {
            self.parts.tangents.insert(self.parts.surfaces.len(), tangents);
        }
    }

    fn surface_captor(&mut self, pointer: &str, id: String, groups: &[usize]) -> Result<usize> {
        self.claim_id(pointer, &id)?;
        let (kind, groups) = (CaptorKind::Surface, groups.to_vec());
        self.parts.captors.push(CaptorPart {
            id,
            kind,
            triangles: Vec::new(),
            groups,
            sensor: Sensor::default(),
        });
        Ok(self.parts.captors.len() - 1)
    }
}

/// The surface captors of one copy of an object.
struct SurfaceCaptors {
    /// Indices of the groups of captors that all of these captors belong to.
    groups: Vec<usize>,
    /// What has been made so far of each group of the OBJ file.
    of_group: Vec<Seen>,
}

#[derive(Clone, Default)]
struct Seen {
    captor: Option<usize>,
    triangles: usize,
}
