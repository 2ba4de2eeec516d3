//! The nodes of a glTF: which meshes stand where.

use glam::{DAffine3, DMat4, DQuat, DVec3};

use super::document::{Document, Mesh, Node};
use crate::json::place;
use phylux_core::error::{Error, Result};

/// A mesh with its index.
type Numbered<'a> = (usize, &'a Mesh);

/// Returns the meshes of the scene that the file shows, in the order of its tree: the name of the
/// group, the place of the node, the mesh, and the transform of its points.
pub fn placed<'a>(
    document: &'a Document,
    name: &str,
) -> Result<Vec<(String, String, Numbered<'a>, DAffine3)>> {
    let error = |pointer: &str, problem: String| {
        Err(Error::input(place(name, pointer), problem).remedy("export it again"))
    };
    let roots = match (document.scene, document.scenes.first()) {
        (Some(shown), _) => match document.scenes.get(shown) {
            Some(scene) => scene.nodes.clone(),
            None => return error("/scene", format!("there is no scene {shown}")),
        },
        (None, Some(first)) => first.nodes.clone(),
        (None, None) => {
            let mut is_child = vec![false; document.nodes.len()];
            for &child in document.nodes.iter().flat_map(|node| &node.children) {
                if let Some(known) = is_child.get_mut(child) {
                    *known = true;
                }
            }
            (0..document.nodes.len()).filter(|&i| !is_child[i]).collect()
        }
    };
    let mut seen = vec![false; document.nodes.len()];
    let mut found = Vec::new();
    let mut next: Vec<(usize, DAffine3)> =
        roots.iter().rev().map(|&root| (root, DAffine3::IDENTITY)).collect();
    while let Some((i, parent)) = next.pop() {
        let pointer = format!("/nodes/{i}");
        let Some(node) = document.nodes.get(i) else {
            return error("/nodes", format!("there is no node {i}"));
        };
        // a node that is met twice could be met without end
        if std::mem::replace(&mut seen[i], true) {
            return error(&pointer, "stands twice in the tree of nodes".into());
        }
        let transform = parent * local(node);
        if !transform.is_finite() {
            return error(&pointer, "a transform that is not finite".into());
        }
        if let Some(m) = node.mesh {
            let Some(mesh) = document.meshes.get(m) else {
                return error(&pointer, format!("there is no mesh {m}"));
            };
            let mut own = [&node.name, &mesh.name].into_iter().flatten().map(|name| clean(name));
            let group = own.find(|name| !name.is_empty());
            let group = group.unwrap_or_else(|| format!("node{i}"));
            found.push((group, format!("node {i}"), (m, mesh), transform));
        }
        next.extend(node.children.iter().rev().map(|&child| (child, transform)));
    }
    Ok(found)
}

/// Returns a name on one line, without blanks around it.
fn clean(name: &str) -> String {
    let name: String = name.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    name.trim().to_owned()
}

/// The transform of a node among its siblings.
fn local(node: &Node) -> DAffine3 {
    if let Some(matrix) = &node.matrix {
        return DAffine3::from_mat4(DMat4::from_cols_array(matrix));
    }
    let rotation = node.rotation.map_or(DQuat::IDENTITY, DQuat::from_array);
    // exporters write few digits
    let rotation = if rotation.length() > 0.0 { rotation.normalize() } else { DQuat::IDENTITY };
    DAffine3::from_scale_rotation_translation(
        node.scale.map_or(DVec3::ONE, DVec3::from),
        rotation,
        node.translation.map_or(DVec3::ZERO, DVec3::from),
    )
}
