//! Scene files: JSON with its OBJ, MTL and CSV files -> [`Scene`], with all checking.

mod captors;
mod format;
#[cfg(test)]
mod fuzz;
mod head;
mod kept;
mod lights;
mod materials;
mod numbers;
mod objects;
mod placed;

use std::{
    cell::RefCell,
    collections::{BTreeMap, HashMap, HashSet},
    fmt::Display,
    path::{Path, PathBuf},
    sync::Arc,
};

use glam::DVec3;
use serde_json::Value;
use sha2::{Digest, Sha256};

pub use format::{Count, SceneFile};
pub use kept::Kept;

use crate::{
    error::{Error, Result, nearest},
    formats::{
        input::{Fetch, RELATIVE, hex, read_bytes},
        json,
        obj::{Mesh, ObjFile},
    },
    math::{spectrum::lanes, units::LengthUnit},
    scene::{
        camera::View,
        world::{
            Band, BandSum, MAX_CAPTORS, MAX_LIGHTS, MAX_TRIANGLES, NamedMaterial, Scene, SceneParts,
        },
    },
    transport::settings::Settings,
};

/// The most numbers for the bands of all materials and lights.
const MAX_NUMBERS: usize = 100_000_000;

/// A scene as loaded from files.
#[derive(Debug)]
pub struct LoadedScene {
    /// The scene.
    pub scene: Scene,
    /// The unit of every length in the file; the scene itself is in metres.
    pub unit: LengthUnit,
    /// How the file asks to run it.
    pub settings: Settings,
    /// How the file asks to look at it.
    pub view: Option<View>,
    /// What a user should know before trusting a result.
    pub warnings: Vec<String>,
    /// Materials of the file that no surface has.
    pub unused_materials: Vec<String>,
    /// Thin leaves whose transmittance differs between the faces.
    pub non_reciprocal_leaves: Vec<String>,
    /// The scene file and all OBJ, MTL and CSV files that were read for it.
    pub files: Vec<PathBuf>,
}

impl LoadedScene {
    /// Error: it has no captor, so that a run would find nothing.
    pub fn check_captors(&self) -> Result<()> {
        if !self.scene.captors.is_empty() {
            return Ok(());
        }
        let place = self.files.first().map_or(String::new(), |file| file.display().to_string());
        Err(Error::input(
            json::place(&place, "/captors"),
            "the scene has no captor, so there is nothing to run",
        )
        .remedy("add a captor, or `\"captor\": true` to an object"))
    }
}

/// Loads the scene at `path`. Errors name the file and the place in it.
pub fn load(path: &Path) -> Result<LoadedScene> {
    let bytes = read_bytes(path)
        .map_err(|why| Error::input(path.display(), why).remedy("name a scene file (JSON)"))?;
    parse(&bytes, path)
}

/// Like [`load`], with a SHA-256 of the scene file and of every file that was read for it, in that order.
pub fn load_with_digest(path: &Path) -> Result<(LoadedScene, String)> {
    let hash = RefCell::new(Sha256::new());
    let read = |path: &Path| {
        let bytes = read_bytes(path)?;
        // each by itself, so that none can pass for two
        hash.borrow_mut().update(Sha256::digest(&bytes));
        Ok(bytes)
    };
    let bytes = read(path)
        .map_err(|why| Error::input(path.display(), why).remedy("name a scene file (JSON)"))?;
    let value = json::parse(&path.display().to_string(), &bytes)?;
    let loaded = load_value(value, path, &read, None)?;
    let digest = hex(hash.take());
    Ok((loaded, digest))
}

/// Like [`load`], from the bytes of the file at `path`.
pub fn parse(bytes: &[u8], path: &Path) -> Result<LoadedScene> {
    load_value(json::parse(&path.display().to_string(), bytes)?, path, &read_bytes, None)
}

/// Like [`load`], from the JSON of the file at `path`; `read` fetches the files that it names, and `kept` has
/// what of other scenes can be used again.
pub fn load_value(
    value: Value,
    path: &Path,
    read: &Fetch,
    kept: Option<&Kept>,
) -> Result<LoadedScene> {
    load_from(value, path, &Sources { read, kept, meshes: &HashMap::new() })
}

/// A scene that is in memory: the JSON of a scene file, the folder that the files it names are
/// relative to, and the meshes that it names as `"obj": "mesh:NAME"` where a path would stand.
///
/// It makes the same scene, with the same ids, as [`load`] from files that say the same. Errors: those
/// of [`load`]; their place is `scene` with a JSON pointer.
pub fn load_with(
    scene: Value,
    folder: &Path,
    meshes: &HashMap<String, Mesh>,
) -> Result<LoadedScene> {
    let path = folder.join("scene");
    let mut loaded = load_from(scene, &path, &Sources { read: &read_bytes, kept: None, meshes })?;
    loaded.files.retain(|file| *file != path);
    Ok(loaded)
}

fn load_from(value: Value, path: &Path, sources: &Sources) -> Result<LoadedScene> {
    let file: SceneFile = json::read(&path.display().to_string(), value)?;
    Loader::new(path, &file, sources)?.load(&file)
}

/// Where a scene finds what its JSON only names.
struct Sources<'a> {
    /// Fetches files.
    read: &'a Fetch<'a>,
    /// What of other scenes can be used again.
    kept: Option<&'a Kept>,
    /// Meshes in memory, by name.
    meshes: &'a HashMap<String, Mesh>,
}

/// What is known and collected while a scene is put together.
struct Loader<'a> {
    path: PathBuf,
    sources: &'a Sources<'a>,
    /// Every file that was read.
    files: RefCell<Vec<PathBuf>>,
    metres: f64,
    bands: usize,
    parts: SceneParts,
    obj_files: HashMap<PathBuf, Arc<ObjFile>>,
    materials: materials::Library,
    groups: BTreeMap<String, usize>,
    /// Names of captor entries and captor objects: each is a group of its own.
    entries: HashSet<String>,
    captor_ids: HashSet<String>,
    light_names: HashSet<String>,
    triangles: usize,
    warnings: Vec<String>,
}

impl<'a> Loader<'a> {
    fn new(path: &Path, file: &SceneFile, sources: &'a Sources) -> Result<Self> {
        let mut loader = Self {
            path: path.to_path_buf(),
            sources,
            files: RefCell::new(vec![path.to_path_buf()]),
            metres: file.unit.metres(),
            bands: 0,
            parts: SceneParts::default(),
            obj_files: HashMap::new(),
            materials: materials::Library::default(),
            groups: BTreeMap::new(),
            entries: HashSet::new(),
            captor_ids: HashSet::new(),
            light_names: HashSet::new(),
            triangles: 0,
            warnings: Vec::new(),
        };
        let stem = stem(path);
        loader.parts.name = file.name.clone().unwrap_or(stem);
        loader.parts.quantity = file.quantity;
        loader.load_bands(file)?;
        Ok(loader)
    }

    fn load(mut self, file: &SceneFile) -> Result<LoadedScene> {
        let settings = self.settings(&file.settings)?;
        let view = file.camera.as_ref().map(|camera| self.view(camera)).transpose()?;
        let spectra = file.materials.len() + file.lights.len();
        if spectra * lanes(self.bands) > MAX_NUMBERS {
            let problem = format!("{} bands for {spectra} materials and lights", self.bands);
            return Err(self
                .error("/bands", problem + ": more than memory holds")
                .remedy("use fewer bands"));
        }
        self.load_materials(&file.materials)?;
        self.load_objects(&file.objects)?;
        self.load_lights(&file.lights)?;
        self.load_captors(&file.captors)?;
        if self.parts.lights.is_empty() {
            return Err(self
                .error("/lights", "the scene has no light")
                .remedy("add a point, spot, tube or area light"));
        }
        let unused_materials = self.materials.unused();
        let non_reciprocal_leaves = self.materials.non_reciprocal();
        drop(self.obj_files);
        let mut groups: Vec<(usize, String)> =
            self.groups.into_iter().map(|(name, index)| (index, name)).collect();
        groups.sort();
        self.parts.groups = groups.into_iter().map(|(_, name)| name).collect();
        self.parts.materials = self.materials.into_used();
        let name = self.path.display().to_string();
        let scene = match self.sources.kept {
            Some(kept) => Scene::with_kept(self.parts, &kept.shapes),
            None => Scene::new(self.parts),
        };
        let scene = scene.map_err(|e| e.at(name))?;
        Ok(LoadedScene {
            scene,
            unit: file.unit,
            settings,
            view,
            warnings: self.warnings,
            unused_materials,
            non_reciprocal_leaves,
            files: self.files.into_inner(),
        })
    }

    /// A JSON pointer of the scene file.
    fn place(&self, pointer: impl Display) -> String {
        json::place(&self.path.display().to_string(), &pointer.to_string())
    }

    /// An error there.
    fn error(&self, pointer: impl Display, problem: impl Display) -> Error {
        Error::input(self.place(pointer), problem)
    }

    fn warn(&mut self, place: impl Display, problem: impl Display) {
        const MOST: usize = 100;
        match self.warnings.len() {
            0..MOST => self.warnings.push(format!("{place}: {problem}")),
            MOST => self.warnings.push("and more warnings than these".into()),
            _ => {}
        }
    }

    /// The path of a file that the scene file names.
    fn sibling(&self, file: &str) -> PathBuf {
        self.path.parent().unwrap_or(Path::new("")).join(file)
    }

    /// The bytes of a file that the scene file names at `pointer`.
    fn bytes(&self, pointer: &str, path: &Path) -> Result<Vec<u8>> {
        let error = |why| self.error(pointer, format!("{}: {why}", path.display()));
        self.fetch(path).map_err(|why| error(why).remedy(RELATIVE))
    }

    fn fetch(&self, path: &Path) -> std::result::Result<Vec<u8>, String> {
        let bytes = (self.sources.read)(path)?;
        self.files.borrow_mut().push(path.to_path_buf());
        Ok(bytes)
    }

    fn count_triangles(&mut self, more: usize) -> Result<()> {
        self.triangles += more;
        if self.triangles <= MAX_TRIANGLES {
            return Ok(());
        }
        Err(self
            .error("", format!("more than {MAX_TRIANGLES} triangles"))
            .remedy("use fewer instances, coarser meshes or fewer captors"))
    }

    fn point(&self, p: [f64; 3]) -> DVec3 {
        DVec3::from(p) * self.metres
    }

    /// The index of the group `name`.
    fn group(&mut self, name: &str) -> usize {
        let next = self.groups.len();
        *self.groups.entry(name.to_string()).or_insert(next)
    }

    /// Takes the name of a captor entry or captor object, which must be new.
    fn claim_group(&mut self, pointer: &str, name: &str) -> Result<()> {
        if self.entries.insert(name.to_string()) {
            return Ok(());
        }
        Err(self
            .error(pointer, format!("a second captor entry or captor object named `{name}`"))
            .remedy("give one of them a `name` of its own"))
    }

    /// Takes a captor's id, which must be new.
    fn claim_id(&mut self, pointer: &str, id: &str) -> Result<()> {
        if self.captor_ids.len() == MAX_CAPTORS {
            return Err(self
                .error(pointer, format!("more than {MAX_CAPTORS} captors"))
                .remedy("let groups count in place of triangles, or fewer instances"));
        }
        if self.captor_ids.insert(id.to_string()) {
            return Ok(());
        }
        Err(self
            .error(pointer, format!("a second captor with the id `{id}`"))
            .remedy("give one of the entries a `name` of its own"))
    }
}

/// The name of a file without folder and extension.
fn stem(path: &Path) -> String {
    path.file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned())
}

/// Adds to an error about an unknown `name` the nearest known one, or all.
fn unknown<'a>(error: Error, name: &str, known: impl Iterator<Item = &'a str> + Clone) -> Error {
    let mut all: Vec<&str> = known.clone().take(21).collect();
    let list = match all.len() {
        0 => return error.remedy("there is none"),
        21 => {
            all[20] = "...";
            format!("there are {}", all.join(", "))
        }
        _ => format!("there are {}", all.join(", ")),
    };
    match nearest(name, known) {
        Some(near) => error.remedy(format!("did you mean `{near}`? ({list})")),
        None => error.remedy(list),
    }
}
