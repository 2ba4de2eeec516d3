//! Loads objects: placed files of meshes (and files in the format of Radiance), with their materials,
//! their captors and their surfaces that emit light.

use std::{collections::BTreeMap, f64::consts::PI, ops::Range, sync::Arc};

use glam::DVec3;

use super::{
    loader::{Loader, stem},
    masks::Pieces,
    placed::Turn,
    spec::*,
    taken::too_many_captors,
};
use crate::{
    mesh_file,
    obj::{ObjFile, ObjPart},
    rad::RadFile,
};
use phylux_core::{
    error::{Error, Result},
    math::geometry::{Transform, area},
    scene::{
        captor::{CaptorKind, Sensor},
        instances::is_even,
        light::{Area, Lamp},
        world::{
            CaptorPart, CopyPart, LightPart, MAX_CAPTORS, SharedPart, SurfacePart, check_crowd,
        },
    },
};

/// Where copies of an object share its triangles unless they are asked to: from this number of
/// triangles of the object, and of all copies together, on. Copies of small objects with triangles of
/// their own are traced faster, so that they share them only where these would take about a gigabyte.
const PAYS: [[usize; 2]; 2] = [[5_000, 200_000], [100, 2_000_000]];

/// An object whose file is read and whose materials are found.
struct Object<'a> {
    pointer: &'a str,
    name: String,
    file: &'a ObjectSpec,
    obj: Arc<ObjFile>,
    /// Length of the file's unit, m.
    metres: f64,
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

impl Object<'_> {
    /// Returns the corners of a surface's triangles, in the file's unit.
    fn corners(&self, surface: &OwnSurface) -> &[[DVec3; 3]] {
        &self.obj.parts[surface.part].triangles[surface.triangles.clone()]
    }
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
        let stem =
            stem(&self.files.sibling(file.obj.as_ref().or(file.rad.as_ref()).map_or("", |f| f)));
        let name = file.name.clone().unwrap_or_else(|| stem.clone());
        let metres = self.metres_of(&obj);
        let (materials, tangents, glows) = (Vec::new(), Vec::new(), BTreeMap::new());
        let mut object =
            Object { pointer, name, file, obj, metres, stem, materials, tangents, pieces, glows };
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
            let claimed = self.taken.claim_entry(&object.name);
            self.located(pointer, claimed)?;
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
        self.refuse_crowd(&object, &placements)?;
        let own = self.own_surfaces(&object);
        if self.shares_triangles(&object, &own, &placements)? {
            self.place_shared(&object, own, placements)?;
            return Ok(());
        }
        for (i, transform) in placements.iter().enumerate() {
            let instance = file.instances.as_ref().map(|_| i);
            let first = self.parts.surfaces.len();
            self.place_object(&mut object, &own, instance, transform)?;
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
            let power: Vec<f64> = glow.radiance.iter().map(|l| PI * l * area).collect();
            let name = format!("{}/{material}", object.name);
            let emitter = self.shining(&name, Area::new(glow.triangles, false))?;
            self.add_light(pointer, LightPart::new(name, Lamp::new(power, emitter)))?;
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
        let path = self.files.sibling(file);
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

    /// Divides an object into surfaces and captors.
    fn own_surfaces(&mut self, object: &Object) -> OwnSurfaces {
        let mut own = OwnSurfaces::default();
        let has_area =
            |[a, b, c]: &[DVec3; 3]| area(&[*a, *b, *c].map(|p| p * object.metres)) != 0.0;
        let mut seen = vec![Seen::default(); object.obj.groups.len()];
        let captor = object.file.captor;
        let mut first = 0;
        for (index, (part, &material)) in object.obj.parts.iter().zip(&object.materials).enumerate()
        {
            let range = first..first + part.triangles.len();
            first = range.end;
            let of_part = object.tangents.get(range.clone());
            let turned = of_part.filter(|_| self.materials.needs_tangents(material));
            let tangents = turned.unwrap_or_default();
            let numbers = object.pieces.numbers.get(range);
            let glow = part.material.clone().filter(|name| object.glows.contains_key(name));
            let mut surface = OwnSurface {
                material,
                captor: None,
                part: index,
                triangles: 0..part.triangles.len(),
                tangents: tangents.to_vec(),
                glow,
            };
            let whole = captor == SurfaceCaptorSpec::Instances;
            let group = object.obj.groups[part.group].name.as_deref().unwrap_or(&object.stem);
            let before = match whole {
                true => object.name.clone(),
                false => format!("{}/{group}", object.name),
            };
            let seen = &mut seen[if whole { 0 } else { part.group }];
            match captor {
                SurfaceCaptorSpec::Off => {}
                SurfaceCaptorSpec::Triangles => {
                    let number = |i| numbers.map_or(seen.triangles + i, |numbers| numbers[i]);
                    let numbers: Vec<usize> = (0..surface.triangles.len()).map(number).collect();
                    seen.triangles += surface.triangles.len();
                    let (mut next, mut tangents) = (0, tangents);
                    // the pieces that a mask leaves of one triangle are one captor
                    for pieces in numbers.chunk_by(|a, b| a == b) {
                        let triangles = next..next + pieces.len();
                        next = triangles.end;
                        let (of_pieces, after) =
                            tangents.split_at(pieces.len().min(tangents.len()));
                        tangents = after;
                        let number = pieces[0];
                        if !part.triangles[triangles.clone()].iter().any(has_area) {
                            self.told.warn(
                                object.pointer,
                                format!("triangle `{before}/{number}` has no area: no captor"),
                            );
                            continue;
                        }
                        own.captors.push([before.clone(), format!("/{number}")]);
                        own.surfaces.push(OwnSurface {
                            captor: Some(own.captors.len() - 1),
                            triangles,
                            tangents: of_pieces.to_vec(),
                            ..surface.clone_without_triangles()
                        });
                    }
                    continue;
                }
                _ => {
                    surface.captor = Some(*seen.captor.get_or_insert_with(|| {
                        own.captors.push([before, String::new()]);
                        own.captors.len() - 1
                    }));
                }
            }
            own.surfaces.push(surface);
        }
        own
    }

    /// Adds the captors of a copy of an object. Returns the index of the first.
    fn place_captors(
        &mut self,
        object: &Object,
        own: &OwnSurfaces,
        instance: Option<usize>,
    ) -> Result<usize> {
        let first = self.parts.captors.len();
        if object.file.captor == SurfaceCaptorSpec::Off {
            return Ok(first);
        }
        let copy = instance.map_or(String::new(), |i| format!("#{i}"));
        let mut groups = vec![self.taken.group(&object.name)];
        if instance.is_some() && object.file.captor != SurfaceCaptorSpec::Instances {
            groups.push(self.taken.group(&format!("{}{copy}", object.name)));
        }
        let joins = object.file.group.as_ref();
        groups.extend(joins.map(|group| self.taken.joined(object.pointer, &object.name, group)));
        groups.sort_unstable();
        groups.dedup();
        for [before, after] in &own.captors {
            self.surface_captor(object.pointer, format!("{before}{copy}{after}"), &groups)?;
        }
        Ok(first)
    }

    /// Adds one copy of an object to the scene, with triangles of its own.
    fn place_object(
        &mut self,
        object: &mut Object,
        own: &OwnSurfaces,
        instance: Option<usize>,
        transform: &Transform,
    ) -> Result<()> {
        let object_index = self.parts.objects.len().checked_sub(1);
        let first_captor = self.place_captors(object, own, instance)?;
        for surface in &own.surfaces {
            let triangles = self.placed(object.corners(surface), transform, object.metres)?;
            let glow = surface.glow.as_ref().and_then(|name| object.glows.get_mut(name));
            if let Some(glow) = glow {
                glow.triangles.extend_from_slice(&triangles);
            }
            self.turn_next(surface.tangents.iter().map(|&tangent| transform.turned(tangent)));
            self.parts.surfaces.push(SurfacePart {
                object: object_index,
                material: surface.material,
                captor: surface.captor.map(|captor| first_captor + captor),
                triangles,
            });
        }
        Ok(())
    }

    /// Refuses copies so many of which stand at one place that rays would never get through.
    fn refuse_crowd(&self, object: &Object, placements: &[Transform]) -> Result<()> {
        let corners = object.obj.parts.iter().flat_map(|part| &part.triangles).flatten();
        let around = corners.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], corner| {
            [low.min(*corner), high.max(*corner)]
        });
        if placements.len() < 2 || !around[0].is_finite() {
            return Ok(());
        }
        let [low, high] = around.map(|end| end * object.metres);
        let placed = |transform: &Transform| {
            // the box around the turned box
            let half = DVec3::AXES.map(|axis| transform.turned(axis * (0.5 * (high - low))).abs());
            let (middle, half) = (transform.point(0.5 * (low + high)), half[0] + half[1] + half[2]);
            [middle - half, middle + half]
        };
        let boxes: Vec<[DVec3; 2]> = placements.iter().map(placed).collect();
        self.located(format!("{}/instances", object.pointer), check_crowd(&boxes))
    }

    /// Returns whether the copies of an object share its triangles: where they may, and are asked to
    /// or it [pays](PAYS). Error: they are asked to, and may not.
    fn shares_triangles(
        &mut self,
        object: &Object,
        own: &OwnSurfaces,
        placements: &[Transform],
    ) -> Result<bool> {
        let asked = object.file.share;
        let triangles: usize = own.surfaces.iter().map(|surface| surface.triangles.len()).sum();
        let all = triangles * placements.len();
        let pays = placements.len() > 1
            && PAYS.iter().any(|&[each, together]| triangles >= each && all >= together);
        if asked == Some(false) || (asked.is_none() && !pays) || triangles == 0 {
            return Ok(false);
        }
        let mut materials = own.surfaces.iter().map(|surface| surface.material);
        let problem = if object.file.rad.is_some() {
            Some("is a file of Radiance")
        } else if !object.glows.is_empty() {
            Some("emits light")
        } else if materials.any(|material| !self.materials.may_be_shared(material)) {
            Some("has a mirror, a pane or a table as material")
        } else if !placements.iter().all(is_even) {
            Some("has copies that are stretched or sheared")
        } else {
            None
        };
        match (problem, asked) {
            (None, _) => Ok(true),
            (Some(problem), Some(true)) => Err(self
                .error(format!("{}/share", object.pointer), format!("the object {problem}"))
                .remedy("leave `share` out: each copy then has triangles of its own")),
            (Some(problem), None | Some(false)) => {
                self.told.warn(
                    object.pointer,
                    format!(
                        "its copies do not share their triangles, {all} in all, because the object {problem}"
                    ),
                );
                Ok(false)
            }
        }
    }

    /// Adds all copies of an object, which share its triangles.
    fn place_shared(
        &mut self,
        object: &Object,
        own: OwnSurfaces,
        transforms: Vec<Transform>,
    ) -> Result<()> {
        let object_index = self.parts.objects.len().checked_sub(1);
        let captors = own.captors.len();
        let all = self.parts.captors.len() + captors * transforms.len();
        if all > MAX_CAPTORS {
            return Err(too_many_captors().at(self.place(object.pointer)));
        }
        let first_captor = self.parts.captors.len();
        for copy in 0..transforms.len() {
            self.place_captors(object, &own, object.file.instances.as_ref().map(|_| copy))?;
        }
        let mut surfaces = Vec::new();
        for surface in &own.surfaces {
            let OwnSurface { material, captor, .. } = *surface;
            let corners = object.corners(surface);
            self.count_triangles(corners.len())?;
            let triangles = corners.iter().map(|t| t.map(|p| p * object.metres)).collect();
            surfaces.push(SurfacePart { object: object_index, material, captor, triangles });
        }
        let object = object_index;
        self.parts.shared.push(SharedPart { object, surfaces, transforms, first_captor, captors });
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
        let claimed = self.taken.claim_captor(&id);
        self.located(pointer, claimed)?;
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

/// The surfaces of an object and the captors that count their light.
#[derive(Default)]
struct OwnSurfaces {
    surfaces: Vec<OwnSurface>,
    /// The ids of the captors: what stands before and after the number of the copy.
    captors: Vec<[String; 2]>,
}

/// A surface of an object.
struct OwnSurface {
    /// Index of the material in the scene.
    material: usize,
    /// Index of the captor among those of the object.
    captor: Option<usize>,
    /// The part of the file whose triangles it has, and which of them.
    part: usize,
    triangles: Range<usize>,
    /// Direction of azimuth 0 on each triangle, if the material needs it.
    tangents: Vec<DVec3>,
    /// Name of the MTL entry, if it emits light.
    glow: Option<String>,
}

impl OwnSurface {
    /// Returns a surface like this one, without triangles.
    fn clone_without_triangles(&self) -> Self {
        Self {
            material: self.material,
            captor: self.captor,
            part: self.part,
            triangles: 0..0,
            tangents: Vec::new(),
            glow: self.glow.clone(),
        }
    }
}

/// What has been made so far of a group of the OBJ file.
#[derive(Clone, Default)]
struct Seen {
    captor: Option<usize>,
    triangles: usize,
}
