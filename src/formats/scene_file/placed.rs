//! Reads OBJ files, and finds where the copies of objects stand.

use std::{path::Path, sync::Arc};

use glam::DVec3;

use super::{
    format::*,
    loader::{Loader, unknown},
};
use crate::{
    error::Result,
    formats::{
        input::quoted,
        obj::{ObjFile, longest_edge, tangents},
    },
    math::geometry::Transform,
};

impl Loader<'_> {
    /// Returns an OBJ file, which is read once, or the mesh in memory that `file` names in place of
    /// a file.
    pub(super) fn obj(&mut self, pointer: &str, file: &str) -> Result<Arc<ObjFile>> {
        if let Some(name) = file.strip_prefix("mesh:") {
            return self.mesh(pointer, name);
        }
        let path = self.sibling(file);
        if let Some(obj) = self.obj_files.get(&path) {
            return Ok(obj.clone());
        }
        if file.is_empty() {
            return Err(self.error(pointer, "no file name").remedy("name an OBJ file"));
        }
        let bytes = self.bytes(pointer, &path)?;
        let fetch = |path: &Path| self.fetch(path);
        let obj = match self.sources.kept {
            Some(kept) => kept.obj(&bytes, &path, &fetch)?,
            None => Arc::new(ObjFile::parse(&bytes, &path, fetch)?),
        };
        for part in obj.parts.iter().filter(|part| part.tangled > 0) {
            self.warn(
                format!("{}:{}", path.display(), part.line),
                format!(
                    "{} of the faces from here on have an outline that crosses itself, so it is \
                    unclear what they cover; cut them into triangles in the modelling program",
                    part.tangled
                ),
            );
        }
        for part in obj.parts.iter().filter(|part| part.bent > 0) {
            self.warn(
                format!("{}:{}", path.display(), part.line),
                format!(
                    "{} of the faces from here on are not flat: a corner is off the plane by more than a \
                    hundredth of the face's size, and where they are bent is chosen here; cut them into \
                    triangles in the modelling program",
                    part.bent
                ),
            );
        }
        self.obj_files.insert(path, obj.clone());
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
            let tangents = tangents(&self.bytes(pointer, &self.sibling(file))?);
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

    fn mesh(&self, pointer: &str, name: &str) -> Result<Arc<ObjFile>> {
        let meshes = self.sources.meshes;
        if let Some(mesh) = meshes.get(name) {
            return Ok(mesh.as_obj());
        }
        let mut known: Vec<&str> = meshes.keys().map(String::as_str).collect();
        known.sort_unstable();
        let error = self.error(pointer, format!("there is no mesh {} in memory", quoted(name)));
        Err(match known.is_empty() {
            true => error.remedy("name an OBJ file; meshes can only be handed over by a program"),
            false => unknown(error, name, known.into_iter()),
        })
    }

    /// Returns where the copies of an object stand: at `transform` alone, or at each of
    /// `instances`, applied after `transform`.
    pub(super) fn placements(
        &self,
        pointer: &str,
        transform: Option<TransformFile>,
        instances: Option<&[TransformFile]>,
        up: UpFile,
    ) -> Result<Vec<Transform>> {
        let base =
            self.transform(&format!("{pointer}/transform"), transform.unwrap_or_default())?;
        let base = match up {
            UpFile::Z => base,
            // turns (x, y, z) to (x, -z, y)
            UpFile::Y => base.after(&Transform::new(1.0, DVec3::new(90.0, 0.0, 0.0), DVec3::ZERO)),
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

    fn transform(&self, pointer: &str, file: TransformFile) -> Result<Transform> {
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

    /// Converts triangles to metres and places them.
    pub(super) fn placed(
        &mut self,
        triangles: &[[DVec3; 3]],
        transform: &Transform,
    ) -> Result<Vec<[DVec3; 3]>> {
        self.count_triangles(triangles.len())?;
        let metres = self.metres;
        Ok(triangles.iter().map(|t| t.map(|p| transform.point(p * metres))).collect())
    }
}

/// Area of a triangle, m2.
pub(super) fn area([a, b, c]: &[DVec3; 3]) -> f64 {
    0.5 * (*b - *a).cross(*c - *a).length()
}
