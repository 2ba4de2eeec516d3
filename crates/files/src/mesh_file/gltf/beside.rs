//! What a glTF holds beside triangles: extensions, and what would change the light but is not used.

use super::document::{self, Document};
use crate::{input::quoted, json::place};
use phylux_core::error::{Error, LISTED, Result, some};

/// Extensions that change shapes in a way that is not read: a file with one of them is refused.
const REFUSED: [(&str, &str); 5] = [
    ("KHR_draco_mesh_compression", "export it without compression"),
    ("EXT_meshopt_compression", "export it without compression"),
    ("KHR_meshopt_compression", "export it without compression"),
    ("EXT_mesh_gpu_instancing", "export the instances as nodes"),
    ("KHR_mesh_primitive_restart", "export strips without restarts"),
];
/// Extensions whose content is read here, or is the business of the scene's materials; beginnings of
/// their names.
const KNOWN: [&str; 8] = [
    "KHR_mesh_quantization",
    "KHR_materials_",
    "KHR_texture_",
    "EXT_texture_",
    "MSFT_texture_",
    "KHR_xmp",
    "ADOBE_materials_",
    "FB_",
];

/// Refuses a file of another version, or with extensions that change its shapes.
pub fn check(document: &Document, name: &str) -> Result<()> {
    if !document.asset.version.starts_with("2.") {
        let problem = format!("version {}, must be 2.0", quoted(&document.asset.version));
        return Err(Error::input(place(name, "/asset"), problem).remedy("export it as glTF 2.0"));
    }
    let used = document.extensions();
    for (refused, remedy) in REFUSED {
        if used.contains(refused) {
            return Err(
                Error::input(name, format!("uses {refused}, which is not read")).remedy(remedy)
            );
        }
    }
    let known = |extension: &&String| KNOWN.iter().any(|known| extension.starts_with(known));
    match document.extensions_required.iter().find(|extension| !known(extension)) {
        None => Ok(()),
        Some(extension) => Err(Error::input(
            place(name, "/extensionsRequired"),
            format!("{} is needed, but is not read", quoted(extension)),
        )
        .remedy("export it without this extension")),
    }
}

/// Says what the file holds besides triangles that would change the light.
pub fn notes(document: &Document) -> Vec<String> {
    let mut notes = Vec::new();
    if document.scenes.len() > 1 {
        let shown = document.scene.unwrap_or(0);
        notes.push(format!("{} scenes: only scene {shown} is read", document.scenes.len()));
    }
    let mut none = |is_there: bool, what: &str| {
        if is_there {
            notes.push(what.into());
        }
    };
    let used = document.extensions();
    none(!document.animations.is_empty(), "its animations are not read: it stands as it was saved");
    none(!document.cameras.is_empty(), "its cameras are not read; a scene has a `camera`");
    none(used.contains("KHR_lights_punctual"), "its lights are not read; give the scene `lights`");
    none(
        document.nodes.iter().any(|node| node.skin.is_some()),
        "its skins (bones) are not applied: meshes have the shape in which they were bound",
    );
    let mut primitives = document.meshes.iter().flat_map(|mesh| &mesh.primitives);
    none(
        primitives.any(|primitive| !primitive.targets.is_empty()),
        "its morph targets are not applied: meshes have their basic shape",
    );
    let materials = || document.materials.iter().enumerate();
    let named = |(i, material): (usize, &document::Material)| {
        quoted(material.name.as_deref().unwrap_or(&format!("material {i}")))
    };
    let clear = materials().filter(|(_, material)| {
        material.alpha_mode.as_deref().is_some_and(|mode| mode != "OPAQUE")
    });
    let clear = some(clear.map(named), LISTED);
    none(
        !clear.is_empty(),
        &format!(
            "the alphaMode of {clear} is not read: textures cut no outline, and nothing shines through; cut \
             leaves, or give panes a `transparent` material (docs/import.md#gltf)"
        ),
    );
    let lit = materials().filter(|(_, material)| material.emissive_factor.iter().any(|&e| e > 0.0));
    let lit = some(lit.map(named), LISTED);
    none(
        !lit.is_empty(),
        &format!("the emissiveFactor of {lit} is not read; give the scene a light of type `area`"),
    );
    let other = used.into_iter().filter(|used| {
        *used != "KHR_lights_punctual" && !KNOWN.iter().any(|known| used.starts_with(known))
    });
    let other = some(other.map(quoted), LISTED);
    none(!other.is_empty(), &format!("its extensions {other} are not read"));
    notes
}
