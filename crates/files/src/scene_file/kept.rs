//! What the scenes of a sweep have in common: files of meshes and triangles arranged for rays. Each is
//! read or arranged once and kept.

use std::{
    cell::RefCell,
    collections::HashMap,
    path::{Path, PathBuf},
    sync::{Arc, Mutex},
};

use sha2::{Digest, Sha256};

use crate::{input::Fetch, mesh_file, obj::ObjFile};
use phylux_core::{
    error::{Result, lock},
    scene::world::KeptShapes,
};

/// The most triangles that the kept OBJ files have together: about 150 MB. When one more file would
/// exceed it, all others are dropped.
const MAX_TRIANGLES: usize = 2_000_000;

/// What many scenes share: OBJ files as they were read, and triangles arranged for rays.
#[derive(Debug, Default)]
pub struct Kept {
    pub(super) shapes: KeptShapes,
    files: Mutex<HashMap<PathBuf, KeptObj>>,
}

#[derive(Clone, Debug)]
struct KeptObj {
    /// SHA-256 of the file.
    digest: [u8; 32],
    /// Paths of the files that it names (MTL, buffers of a glTF), each with its SHA-256, or `None` for one
    /// that could not be read.
    mtl: Vec<(PathBuf, Option<[u8; 32]>)>,
    file: Arc<ObjFile>,
}

impl Kept {
    /// Returns the file of a mesh at `path`, which has these `bytes`, with the files that it names.
    /// It is parsed only if it or one of these has changed since it was kept.
    pub(super) fn obj(&self, bytes: &[u8], path: &Path, fetch: &Fetch) -> Result<Arc<ObjFile>> {
        let digest = Sha256::digest(bytes).into();
        let digest_of = |path: &Path| fetch(path).ok().map(|bytes| Sha256::digest(bytes).into());
        let files = || lock(&self.files);
        let known = files().get(path).filter(|known| known.digest == digest).cloned();
        if let Some(known) = known
            && known.mtl.iter().all(|(path, digest)| digest_of(path) == *digest)
        {
            return Ok(known.file);
        }
        let mtl = RefCell::new(Vec::new());
        let file = Arc::new(mesh_file::parse(bytes, path, |path| {
            let bytes = fetch(path);
            let digest = bytes.as_ref().ok().map(|bytes| Sha256::digest(bytes).into());
            mtl.borrow_mut().push((path.to_path_buf(), digest));
            bytes
        })?);
        let mut files = files();
        let kept: usize = files.values().map(|known| known.file.triangles()).sum();
        if kept + file.triangles() > MAX_TRIANGLES {
            files.clear();
        }
        if file.triangles() <= MAX_TRIANGLES {
            let kept = KeptObj { digest, mtl: mtl.into_inner(), file: file.clone() };
            files.insert(path.to_path_buf(), kept);
        }
        Ok(file)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_read_anew_only_when_it_or_its_mtl_changes() {
        let kept = Kept::default();
        let mtl = RefCell::new(b"newmtl a\nKd 1 1 1\n".to_vec());
        let fetched = RefCell::new(0);
        let fetch = |_: &Path| {
            *fetched.borrow_mut() += 1;
            Ok(mtl.borrow().clone())
        };
        let obj = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n";
        let read = |text: &str| kept.obj(text.as_bytes(), Path::new("a.obj"), &fetch).unwrap();
        let first = read(obj);
        assert!(Arc::ptr_eq(&first, &read(obj)));
        assert_eq!(*fetched.borrow(), 2, "who reads must know of every file");
        *mtl.borrow_mut() = b"newmtl a\nKd 0 0 0\n".to_vec();
        let dark = read(obj);
        assert_eq!(dark.mtl.entry("a").unwrap().unwrap().kd, Some([0.0; 3]));
        assert!(Arc::ptr_eq(&dark, &read(obj)));
        assert!(!Arc::ptr_eq(&dark, &read(&obj.replace("v 1", "v 2"))));
    }
}
