//! Scene files: JSON with its OBJ, MTL and CSV files -> [`Scene`], with all checking.

mod captors;
mod daylight;
mod format;
#[cfg(test)]
mod fuzz;
mod head;
mod hourly;
mod hourly_lights;
mod kept;
mod known_spectra;
mod library;
mod lights;
mod loader;
mod luminaires;
mod materials;
mod notes;
mod numbers;
mod objects;
mod placed;
mod radiance;
mod rooms;
mod spectra;
mod tables;

use std::{
    cell::RefCell,
    collections::HashMap,
    path::{Path, PathBuf},
};

use serde_json::Value;
use sha2::{Digest, Sha256};

pub use daylight::OpenField;
use format::LightFile;
pub use format::{Count, SceneFile};
pub use hourly_lights::{HourlyLight, HourlyLights, HourlySun, SkyDivision};
pub use kept::Kept;
pub use known_spectra::SpectrumAverage;
use loader::{Loader, Sources};
pub use notes::TableNote;

use crate::{
    error::{Error, Result},
    formats::{
        input::{Fetch, hex, read_bytes},
        json,
        obj::Mesh,
    },
    math::{spectrum::lanes, units::LengthUnit},
    scene::{camera::View, world::Scene},
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
    /// Names of suns and skies without light of the ground.
    pub without_ground: Vec<String>,
    /// Daylight by the hour, where it was loaded so.
    pub hourly: Option<HourlyLights>,
    /// Daylight in the open, where there is any.
    pub open_field: Option<OpenField>,
    /// What spectra are in each band.
    pub averages: Vec<SpectrumAverage>,
    /// What is known of measured materials.
    pub tables: Vec<TableNote>,
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
    let (meshes, tables) = (&HashMap::new(), &HashMap::new());
    load_sources(value, path, &Sources { read, kept, meshes, tables, by_hour: None })
}

/// Like [`load`], with the sun and the sky as lights of which the light of each hour is a weighted sum: what
/// `hourly` of the loaded scene says. Errors: the scene's time is no period, or it has neither sun nor sky.
pub fn load_by_hour(path: &Path, sky: SkyDivision) -> Result<LoadedScene> {
    let name = path.display().to_string();
    let bytes = read_bytes(path)
        .map_err(|why| Error::input(&name, why).remedy("name a scene file (JSON)"))?;
    let (meshes, tables) = (&HashMap::new(), &HashMap::new());
    let sources = Sources { read: &read_bytes, kept: None, meshes, tables, by_hour: Some(sky) };
    load_sources(json::parse(&name, &bytes)?, path, &sources)
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
    let tables = &HashMap::new();
    let sources = Sources { read: &read_bytes, kept: None, meshes, tables, by_hour: None };
    load_in_memory(scene, &folder.join("scene"), &sources)
}

/// What a program hands over in the place of files that a scene names.
#[derive(Clone, Debug, Default)]
pub struct InMemory {
    /// Meshes, by name: `"obj": "mesh:NAME"`.
    pub meshes: HashMap<String, Mesh>,
    /// Tables of captors, the bytes of CSV files, by name: `"csv": "table:NAME"`.
    pub tables: HashMap<String, Vec<u8>>,
}

/// Like [`load_with`], with tables too. `path` is where the scene would stand: its folder is what files are
/// relative to, and it is the place of errors.
pub fn load_from(scene: Value, path: &Path, memory: &InMemory) -> Result<LoadedScene> {
    let InMemory { meshes, tables } = memory;
    let sources = Sources { read: &read_bytes, kept: None, meshes, tables, by_hour: None };
    load_in_memory(scene, path, &sources)
}

fn load_in_memory(scene: Value, path: &Path, sources: &Sources) -> Result<LoadedScene> {
    let mut loaded = load_sources(scene, path, sources)?;
    loaded.files.retain(|file| *file != path);
    Ok(loaded)
}

fn load_sources(value: Value, path: &Path, sources: &Sources) -> Result<LoadedScene> {
    let file: SceneFile = json::read(&path.display().to_string(), value)?;
    Loader::new(path, &file, sources)?.load(&file)
}

impl Loader<'_> {
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
        self.load_spectra(file)?;
        self.load_materials(&file.materials)?;
        self.load_objects(&file.objects)?;
        let sky = self.load_sky(file)?;
        self.load_lights(&file.lights, sky.as_ref())?;
        self.check_lamps()?;
        self.check_hourly()?;
        let open_field = sky.map(|sky| self.open_field(&sky));
        self.load_captors(&file.captors)?;
        self.load_groups(&file.groups)?;
        if self.parts.lights.is_empty() {
            return Err(self
                .error("/lights", "the scene has no light")
                .remedy("add a light: point, spot, tube, area, sun, sky or environment"));
        }
        let averages = self.take_averages();
        let unused_materials = self.materials.unused();
        for error in self.materials.unused_errors() {
            self.warnings.push(format!("{error} (no surface has this material)"));
        }
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
            hourly: self.sources.by_hour.is_some().then_some(self.hourly),
            open_field,
            averages,
            without_ground: file.lights.iter().filter_map(LightFile::without_ground).collect(),
            tables: self.tables,
            non_reciprocal_leaves,
            files: self.files.into_inner(),
        })
    }
}
