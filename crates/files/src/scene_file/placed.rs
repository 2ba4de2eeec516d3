//! Reads the files of meshes, and finds where the copies of objects stand.

use std::{collections::BTreeSet, sync::Arc};

use glam::DVec3;

use super::{loader::Loader, spec::*};
use crate::{
    input::quoted,
    instance_csv,
    obj::{ObjFile, longest_edge, tangents},
};
use phylux_core::{
    error::{LISTED, Result, some},
    math::geometry::Transform,
};

/// How a file is turned before its `transform`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Turn {
    None,
    /// From (x, y, z) to (x, -z, y).
    YToZ,
    /// From (x, y, z) to (x, z, -y).
    ZToY,
}

impl Turn {
    /// How a file is turned whose axis `up` points up. The triangles of a glTF have been turned
    /// already, as its definition says.
    pub(super) fn of(obj: &ObjFile, up: Option<UpSpec>) -> Self {
        match (obj.is_gltf, up) {
            (false, Some(UpSpec::Y)) => Self::YToZ,
            (true, Some(UpSpec::Z)) => Self::ZToY,
            _ => Self::None,
        }
    }
}

impl Loader<'_> {
    /// Returns a file of a mesh (OBJ, PLY, STL, glTF), which is read once, or the mesh in memory
    /// that `file` names in place of a file.
    pub(super) fn obj(&mut self, pointer: &str, file: &str) -> Result<Arc<ObjFile>> {
        if let Some(name) = file.strip_prefix("mesh:") {
            return self.files.mesh(pointer, name);
        }
        let path = self.files.sibling(file);
        if let Some(obj) = self.files.obj_files.get(&path) {
            return Ok(obj.clone());
        }
        if file.is_empty() {
            return Err(self
                .error(pointer, "no file name")
                .remedy("name an OBJ, PLY, STL or glTF file"));
        }
        let obj = self.files.read_obj(pointer, &path)?;
        for note in &obj.notes {
            self.told.warn(path.display(), note);
        }
        for part in obj.parts.iter().filter(|part| part.tangled > 0) {
            self.told.warn(
                format!("{}:{}", path.display(), part.line),
                format!(
                    "{} of the faces from here on have an outline that crosses itself; cut them into \
                    triangles in the modelling program (docs/import.md#obj-and-mtl)",
                    part.tangled
                ),
            );
        }
        for part in obj.parts.iter().filter(|part| part.bent > 0) {
            self.told.warn(
                format!("{}:{}", path.display(), part.line),
                format!(
                    "{} of the faces from here on are not flat, and where they bend is chosen here; cut them into \
                    triangles in the modelling program (docs/import.md#obj-and-mtl)",
                    part.bent
                ),
            );
        }
        self.files.obj_files.insert(path, obj.clone());
        Ok(obj)
    }

    /// Returns the direction of azimuth 0 on each triangle of an OBJ file or mesh, in the order of
    /// its parts: along the texture coordinate u or, without it, along the triangle's longest edge.
    /// Where masks have cut the file, `sources` says which of its triangles each piece comes from.
    pub(super) fn tangents(
        &self,
        pointer: &str,
        file: Option<&str>,
        obj: &ObjFile,
        sources: &[usize],
    ) -> Result<Vec<DVec3>> {
        if let Some(file) = file.filter(|file| !file.starts_with("mesh:")) {
            let tangents = tangents(&self.files.bytes(pointer, &self.files.sibling(file))?);
            if let Some(&last) = sources.last() {
                if last < tangents.len() {
                    return Ok(sources.iter().map(|&source| tangents[source]).collect());
                }
            } else if tangents.len() == obj.triangles() {
                return Ok(tangents);
            }
        }
        let triangles = obj.parts.iter().flat_map(|part| &part.triangles);
        Ok(triangles.map(|corners| longest_edge(corners)).collect())
    }

    /// Says that groups of a file became one, where groups count light.
    pub(super) fn say_merged(&mut self, file: &str, obj: &ObjFile) {
        let path = self.files.sibling(file);
        if let Some(merged) = &obj.merged
            && self.told.first_time(&path, "merged")
        {
            self.told.warn(path.display(), merged);
        }
    }

    /// Says which statements of the MTL files mean something for light but are not used, of the
    /// materials that faces have. `material` is the one of the whole object, if there is one.
    pub(super) fn say_unused(&mut self, file: &str, obj: &ObjFile, material: Option<&str>) {
        let names: BTreeSet<&String> =
            obj.parts.iter().filter_map(|part| part.material.as_ref()).collect();
        let mut unused = Vec::new();
        for name in names {
            let replaced = material.is_some() || self.materials.by_name.contains_key(name);
            let entry = obj.mtl.written(name);
            let statements = entry.into_iter().flat_map(|entry| entry.unused(replaced));
            unused.extend(statements.map(|text| format!("{text} of {}", quoted(name))));
        }
        let path = self.files.sibling(file);
        if !unused.is_empty() && self.told.first_time(&path, "unused") {
            let list = some(unused, LISTED);
            self.told.warn(
                path.display(),
                format!(
                    "its MTL says {list}, which means something for light but is not used; give the scene materials \
                     of these names (docs/import.md#obj-and-mtl)"
                ),
            );
        }
    }

    /// Returns where the copies of an object stand: at `transform` alone, or at each of
    /// `instances`, applied after `transform`.
    pub(super) fn object_placements(
        &self,
        pointer: &str,
        transform: Option<TransformSpec>,
        instances: Option<&InstancesSpec>,
        turn: Turn,
    ) -> Result<Vec<Transform>> {
        let csv = match instances {
            Some(InstancesSpec::Table { csv }) => csv,
            Some(InstancesSpec::List(list)) => {
                return self.placements(pointer, transform, Some(list), turn);
            }
            None => return self.placements(pointer, transform, None, turn),
        };
        let base = self.placements(pointer, transform, None, turn)?[0];
        let pointer = format!("{pointer}/instances/csv");
        if csv.is_empty() {
            return Err(self.error(&pointer, "no file name").remedy("name a CSV file"));
        }
        let path = self.files.sibling(csv);
        let copies = match csv.strip_prefix("table:") {
            Some(name) => {
                instance_csv::parse(self.files.table(&pointer, name)?, &path, self.metres)?
            }
            None => instance_csv::parse(&self.files.bytes(&pointer, &path)?, &path, self.metres)?,
        };
        Ok(copies.into_iter().map(|copy| copy.after(&base)).collect())
    }

    /// Returns where the copies of a light stand, as those of an object in a list.
    pub(super) fn placements(
        &self,
        pointer: &str,
        transform: Option<TransformSpec>,
        instances: Option<&[TransformSpec]>,
        turn: Turn,
    ) -> Result<Vec<Transform>> {
        let base =
            self.transform(&format!("{pointer}/transform"), transform.unwrap_or_default())?;
        let turned = |deg| base.after(&Transform::new(1.0, DVec3::new(deg, 0.0, 0.0), DVec3::ZERO));
        let base = match turn {
            Turn::None => base,
            Turn::YToZ => turned(90.0),
            Turn::ZToY => turned(-90.0),
        };
        let Some(instances) = instances else { return Ok(vec![base]) };
        if instances.is_empty() {
            return Err(self
                .error(format!("{pointer}/instances"), "an empty list")
                .remedy("leave it out for one copy"));
        }
        instances
            .iter()
            .enumerate()
            .map(|(i, instance)| {
                let pointer = format!("{pointer}/instances/{i}");
                Ok(self.transform(&pointer, *instance)?.after(&base))
            })
            .collect()
    }

    fn transform(&self, pointer: &str, file: TransformSpec) -> Result<Transform> {
        let scale = file.scale.unwrap_or(1.0);
        if scale <= 0.0 {
            return Err(self
                .error(format!("{pointer}/scale"), format!("{scale}, must be above 0"))
                .remedy("a mirrored copy needs an OBJ file of its own"));
        }
        let rotate = DVec3::from(file.rotate_deg.unwrap_or_default());
        let translate = DVec3::from(file.translate.unwrap_or_default()) * self.metres;
        Ok(Transform::new(scale, rotate, translate))
    }

    /// The length of a file's unit, m: that of the scene, except of a glTF, whose unit is the metre.
    pub(super) fn metres_of(&self, obj: &ObjFile) -> f64 {
        if obj.is_gltf { 1.0 } else { self.metres }
    }

    /// Converts triangles to metres, of which the file's unit has so many, and places them.
    pub(super) fn placed(
        &mut self,
        triangles: &[[DVec3; 3]],
        transform: &Transform,
        metres: f64,
    ) -> Result<Vec<[DVec3; 3]>> {
        self.count_triangles(triangles.len())?;
        let mirrored = transform.is_mirrored();
        let place = |triangle: &[DVec3; 3]| {
            let [a, b, c] = triangle.map(|p| transform.point(p * metres));
            // fronts stay fronts
            if mirrored { [a, c, b] } else { [a, b, c] }
        };
        Ok(triangles.iter().map(place).collect())
    }
}
