//! Meshes in memory, which take the place of OBJ files.

use std::{collections::HashMap, sync::Arc};

use glam::DVec3;

use super::{ObjFile, ObjGroup, ObjPart};
use phylux_core::error::{Error, Result};

/// Triangles with one group name and one material.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshGroup {
    /// Name of the group, as after `g` in an OBJ file; `None` stands for the name of the object
    /// that the mesh belongs to.
    pub name: Option<String>,
    /// Name of a material of the scene, as after `usemtl`; `None` where the object names the
    /// material.
    pub material: Option<String>,
    /// Corners in the scene's unit of length, counter-clockwise seen from the front.
    pub triangles: Vec<[DVec3; 3]>,
}

/// A checked mesh in memory, which objects, lights and captors of a scene can name instead of an
/// OBJ file. Copies share their triangles.
#[derive(Clone, Debug)]
pub struct Mesh(Arc<ObjFile>);

impl Mesh {
    /// Makes a mesh of groups. Groups with the same name become one, as in an OBJ file, and a group
    /// without triangles is left out. Errors: at `mesh, group N`, with N counted from 0, a
    /// coordinate is not a finite number; at `mesh`, there is no triangle at all.
    pub fn new(groups: Vec<MeshGroup>) -> Result<Self> {
        for (i, MeshGroup { triangles, .. }) in groups.iter().enumerate() {
            if let Some(t) = triangles.iter().position(|t| !t.iter().all(|p| p.is_finite())) {
                let problem = format!("triangle {t} has a coordinate that is no finite number");
                return Err(Error::input(format!("mesh, group {i}"), problem)
                    .remedy("leave the triangle out, or mend the vertex"));
            }
        }
        let found = ObjFile::from(groups);
        if found.parts.is_empty() {
            return Err(Error::input("mesh", "has no triangle")
                .remedy("give it one, or leave the object out"));
        }
        Ok(Self(Arc::new(found)))
    }

    /// Makes a mesh of vertices and, for each triangle, the indices of its corners, counted from 0.
    /// Errors: those of [`new`](Self::new), and an index of a vertex that does not exist.
    pub fn from_faces(vertices: &[DVec3], faces: &[[usize; 3]]) -> Result<Self> {
        let corner = |face: usize, i: usize| {
            vertices.get(i).copied().ok_or_else(|| {
                let problem =
                    format!("corner {i} of face {face}: there are {} vertices", vertices.len());
                Error::input("mesh", problem).remedy("vertices are counted from 0")
            })
        };
        let triangle = |(f, [a, b, c]): (usize, &[usize; 3])| {
            Ok([corner(f, *a)?, corner(f, *b)?, corner(f, *c)?])
        };
        let triangles = faces.iter().enumerate().map(triangle).collect::<Result<_>>()?;
        Self::new(vec![MeshGroup { triangles, ..MeshGroup::default() }])
    }

    /// Returns the content of the OBJ file that the mesh takes the place of.
    pub(crate) fn as_obj(&self) -> Arc<ObjFile> {
        self.0.clone()
    }
}

impl From<Vec<MeshGroup>> for ObjFile {
    /// Puts groups of finite numbers into the form of an OBJ file; the number of a group stands for
    /// the line. Groups with the same name become one, and those without triangles are left out.
    fn from(groups: Vec<MeshGroup>) -> Self {
        let mut found = Self::default();
        let mut by_name = HashMap::new();
        for (i, MeshGroup { name, material, triangles }) in groups.into_iter().enumerate() {
            if triangles.is_empty() {
                continue;
            }
            let group = *by_name.entry(name.clone()).or_insert_with(|| {
                found.groups.push(ObjGroup { name });
                found.groups.len() - 1
            });
            let (line, tangled, bent) = (i + 1, 0, 0);
            found.parts.push(ObjPart { group, material, line, triangles, tangled, bent });
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn triangles(shift: f64) -> Vec<[DVec3; 3]> {
        vec![[DVec3::splat(shift), DVec3::X, DVec3::Y]]
    }

    fn group(name: Option<&str>, material: Option<&str>, shift: f64) -> MeshGroup {
        let text = |text: Option<&str>| text.map(String::from);
        MeshGroup { name: text(name), material: text(material), triangles: triangles(shift) }
    }

    /// A mesh gives the same groups and parts as the OBJ file, except for line numbers.
    #[test]
    fn a_mesh_is_what_an_obj_file_says() {
        let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 2 2\nf 1 2 3\n\
                    g leaf\nusemtl green\nf 1 2 3\ng stem\nf 4 2 3\ng leaf\nf 4 2 3\n";
        let obj =
            ObjFile::parse(text.as_bytes(), Path::new("a.obj"), |_| Err("none".into())).unwrap();
        let mesh = Mesh::new(vec![
            group(None, None, 0.0),
            group(Some("leaf"), Some("green"), 0.0),
            MeshGroup { name: Some("empty".into()), ..MeshGroup::default() },
            group(Some("stem"), Some("green"), 2.0),
            group(Some("leaf"), Some("green"), 2.0),
        ])
        .unwrap()
        .as_obj();
        assert_eq!(mesh.groups, obj.groups);
        let part = |part: &ObjPart| (part.group, part.material.clone(), part.triangles.clone());
        let parts = |file: &ObjFile| file.parts.iter().map(part).collect::<Vec<_>>();
        assert_eq!(parts(&mesh), parts(&obj));
    }

    #[test]
    fn nonsense_is_refused() {
        let error = |mesh: Result<Mesh>| mesh.unwrap_err().to_string();
        assert!(error(Mesh::new(vec![])).starts_with("mesh: has no triangle"));
        let nan = Mesh::new(vec![group(None, None, 0.0), group(None, None, f64::NAN)]);
        assert!(error(nan).starts_with("mesh, group 1: triangle 0 has a coordinate"));
        let faces = Mesh::from_faces(&[DVec3::X, DVec3::Y, DVec3::Z], &[[0, 1, 2], [0, 1, 3]]);
        assert!(error(faces).starts_with("mesh: corner 3 of face 1: there are 3 vertices"));
    }
}
