//! Scene files: reads the JSON of a scene and the files that it names (OBJ, MTL, CSV and others),
//! checks all of it, and makes a [`Scene`].
//!
//! [`load`] is the usual entry. The JSON is read into the types of `spec`; a `Loader` (`loader`)
//! then puts the scene together in the order of `Loader::load`, at the end of this file. Each of
//! the other files of the folder loads what its name says.

mod builder;
mod captors;
mod daylight;
mod files;
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
mod masks;
mod materials;
mod notes;
mod numbers;
mod objects;
mod placed;
mod radiance;
mod rooms;
mod sensitivity;
mod source;
pub mod spec;
mod spectra;
mod sums;
mod tables;
mod taken;
#[cfg(test)]
mod tests;
mod told;

use std::{
    cell::RefCell,
    collections::HashMap,
    path::{Path, PathBuf},
};

use serde_json::Value;
use sha2::{Digest, Sha256};

pub use builder::SceneBuilder;
pub use daylight::OpenField;
use files::Sources;
pub use hourly_lights::{ByHour, HourlyLight, HourlyLights, HourlySun, SkyDivision};
pub use kept::Kept;
pub use known_spectra::SpectrumAverage;
use loader::Loader;
pub use notes::TableNote;
pub use source::SceneSource;
pub use spec::{Count, SceneSpec};
use spec::{LayersSpec, LightSpec, PeriodicSpec, PowerSpec};

use crate::{
    input::{Fetch, hex, read_bytes},
    json,
    obj::Mesh,
};
use phylux_core::{
    error::{Error, LISTED, Result, some},
    math::{spectrum::lanes, units::LengthUnit},
    scene::{
        camera::View,
        lattice::{Lattice, Period},
        world::{Outside, Scene},
    },
    transport::settings::Settings,
};

/// The largest product of the number of bands, rounded up as in memory, and the number of materials
/// and lights.
const MAX_NUMBERS: usize = 100_000_000;

/// A scene as it was loaded, with what its files say besides.
#[derive(Debug)]
pub struct LoadedScene {
    /// The scene.
    pub scene: Scene,
    /// The unit of every length in the file; the scene itself is in metres.
    pub unit: LengthUnit,
    /// Settings that the file asks a run to use.
    pub settings: Settings,
    /// The names of those settings that the file gives.
    pub given_settings: Vec<String>,
    /// The view that the file asks a picture to show; `None` where it has no camera.
    pub view: Option<View>,
    /// What a user should know before trusting a result.
    pub warnings: Vec<String>,
    /// What was done as the files ask for, and may surprise.
    pub notes: Vec<String>,
    /// Materials of the file that no surface has.
    pub unused_materials: Vec<String>,
    /// Names of the suns and skies without a `ground`: no light comes to the scene from below the
    /// horizon.
    pub without_ground: Vec<String>,
    /// Daylight by the hour, or `None` unless the scene was loaded by [`load_by_hour`].
    pub hourly: Option<HourlyLights>,
    /// Daylight in the open, or `None` where the scene has no sun, sky or environment map.
    pub open_field: Option<OpenField>,
    /// Mean of each spectrum over each band.
    pub averages: Vec<SpectrumAverage>,
    /// Names of the lamps whose power a spectrum shares among the bands, each with that of the
    /// spectrum: one at hand, or a file.
    pub lamp_spectra: Vec<[String; 2]>,
    /// How far each material that was measured as a scattering function is from reciprocity.
    pub tables: Vec<TableNote>,
    /// Leaves whose transmittance differs between the faces, which makes them non-reciprocal.
    pub non_reciprocal_leaves: Vec<String>,
    /// The scene file, unless the scene was in memory, and every file that was read for it (OBJ,
    /// MTL, CSV, ...).
    pub files: Vec<PathBuf>,
    /// The scene file as the place of errors, or where it would be for a scene in memory.
    pub place: PathBuf,
}

impl LoadedScene {
    /// Returns the error of a run. Where a setting of the file is the reason, the place of the error
    /// is that of the setting in the file.
    pub fn placed(&self, error: Error) -> Error {
        match self.given_settings.iter().any(|name| *name == error.place()) {
            true => {
                let pointer = format!("/settings/{}", error.place());
                error.at(json::place(&self.place.display().to_string(), &pointer))
            }
            false => error,
        }
    }

    /// Refuses a scene without captors, since a run would find nothing.
    pub fn check_captors(&self) -> Result<()> {
        if !self.scene.captors().is_empty() {
            return Ok(());
        }
        Err(Error::input(
            json::place(&self.place.display().to_string(), "/captors"),
            "the scene has no captor, so there is nothing to run",
        )
        .remedy("add a captor, or `\"captor\": true` to an object"))
    }
}

/// Loads the scene at `path`. Errors name the file and the place in it.
pub fn load(path: &Path) -> Result<LoadedScene> {
    load_value(read_document(path, &read_bytes)?, path, &read_bytes, None)
}

/// Reads the JSON of the scene file at `path`.
fn read_document(path: &Path, read: &Fetch) -> Result<Value> {
    let name = path.display().to_string();
    let bytes =
        read(path).map_err(|why| Error::input(&name, why).remedy("name a scene file (JSON)"))?;
    json::parse(&name, &bytes)
}

/// Loads a scene like [`load`], with `sensitivity` in the place of its key of that name.
pub fn load_with_sensitivity(path: &Path, sensitivity: Value) -> Result<LoadedScene> {
    let name = path.display().to_string();
    let bytes = read_bytes(path)
        .map_err(|why| Error::input(&name, why).remedy("name a scene file (JSON)"))?;
    let mut value = json::parse(&name, &bytes)?;
    if let Some(scene) = value.as_object_mut() {
        scene.insert("sensitivity".into(), sensitivity);
    }
    load_value(value, path, &read_bytes, None)
}

/// Loads a scene like [`load`], and returns with it a SHA-256 in hexadecimal digits, over the scene
/// file and every file that was read for it, in the order of reading.
pub fn load_with_digest(path: &Path) -> Result<(LoadedScene, String)> {
    let hash = RefCell::new(Sha256::new());
    let read = |path: &Path| {
        let bytes = read_bytes(path)?;
        // each file is hashed by itself, so that no file can pass for two
        hash.borrow_mut().update(Sha256::digest(&bytes));
        Ok(bytes)
    };
    let loaded = load_value(read_document(path, &read)?, path, &read, None)?;
    let digest = hex(hash.take());
    Ok((loaded, digest))
}

/// Loads a scene like [`load`], from the bytes of the file at `path`.
pub fn parse(bytes: &[u8], path: &Path) -> Result<LoadedScene> {
    load_value(json::parse(&path.display().to_string(), bytes)?, path, &read_bytes, None)
}

/// Loads a scene like [`load`], from the JSON of the file at `path`. `read` fetches the files that
/// the JSON names; `kept` holds files and arranged triangles of other scenes, which are used again
/// where they are the same.
pub fn load_value(
    value: Value,
    path: &Path,
    read: &Fetch,
    kept: Option<&Kept>,
) -> Result<LoadedScene> {
    let (meshes, tables) = (&HashMap::new(), &HashMap::new());
    load_sources(value, path, &Sources { read, kept, meshes, tables, by_hour: None })
}

/// Loads a scene like [`load`], but divides the sun and the sky into lights such that the light of
/// each hour is a weighted sum of theirs. The weights are in `hourly` of the loaded scene. Errors:
/// the scene's time is not a period, or the scene has neither sun nor sky.
pub fn load_by_hour(path: &Path, sky: SkyDivision) -> Result<LoadedScene> {
    let by_hour = ByHour { division: sky, shares: None };
    load_state(read_document(path, &read_bytes)?, path, by_hour)
}

/// Loads a scene like [`load_by_hour`], from the JSON of the file at `path`, with some fraction of
/// each hour.
pub fn load_state(value: Value, path: &Path, by_hour: ByHour) -> Result<LoadedScene> {
    let (meshes, tables) = (&HashMap::new(), &HashMap::new());
    let by_hour = Some(by_hour);
    load_sources(value, path, &Sources { read: &read_bytes, kept: None, meshes, tables, by_hour })
}

/// Loads a scene that is in memory: `scene` is the JSON of a scene file, `folder` the folder that
/// the files it names are relative to, and `meshes` holds the meshes that it names, as
/// `"mesh:NAME"`, where the path of an OBJ file would stand.
///
/// The scene is the same, with the same ids, as the one that [`load`] makes of files that say the
/// same. Errors: those of [`load`]; their place is `scene` in that folder, with a JSON pointer.
pub fn load_with(
    scene: Value,
    folder: &Path,
    meshes: &HashMap<String, Mesh>,
) -> Result<LoadedScene> {
    let tables = &HashMap::new();
    let sources = Sources { read: &read_bytes, kept: None, meshes, tables, by_hour: None };
    load_in_memory(scene, &folder.join("scene"), &sources)
}

/// Meshes and tables that a program hands over in place of files that a scene names.
#[derive(Clone, Debug, Default)]
pub struct InMemory {
    /// Meshes by name; a scene names one by `"obj": "mesh:NAME"`.
    pub meshes: HashMap<String, Mesh>,
    /// Tables of captors (bytes of CSV files) by name; a scene names one by `"csv": "table:NAME"`.
    pub tables: HashMap<String, Vec<u8>>,
}

/// Loads a scene like [`load_with`], with tables as well as meshes. `path` says where the scene
/// file would be: files are relative to its folder, and errors name it as their place.
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
    let settings = value.get("settings").and_then(Value::as_object);
    let given_settings = settings.into_iter().flat_map(|all| all.keys().cloned()).collect();
    let file: SceneSpec = json::read_with(&path.display().to_string(), value, home)?;
    let loaded = Loader::new(path, &file, sources)?.load(&file)?;
    Ok(LoadedScene { given_settings, ..loaded })
}

/// Says where a key belongs that stands where a scene file has no such key.
fn home(key: &str) -> Option<String> {
    let schema = schemars::schema_for!(SceneSpec);
    let has = |keys: &str| schema.pointer(keys).is_some_and(|keys| keys.get(key).is_some());
    Some(match key {
        _ if has("/properties") => format!("`{key}` is a key of the scene itself"),
        _ if has("/$defs/SettingsSpec/properties") => {
            format!("`{key}` is a key of the scene's `settings`")
        }
        "point" | "spot" | "tube" | "area" | "rad" | "sun" | "sky" | "environment" => {
            format!("a light with `\"type\": \"{key}\"` stands in the scene's list `lights`")
        }
        "intensity" => "the file of a lamp's intensity by direction is its `photometry`".into(),
        _ => return None,
    })
}

impl Loader<'_> {
    fn lattice(&self, cell: &PeriodicSpec, unit: LengthUnit) -> Result<Lattice> {
        let period = |axis: usize, ends: [f64; 2]| {
            let [from, to] = ends.map(|end| end * unit.metres());
            Period { from, length: to - from, rise: cell.slope[axis] * unit.metres() }
        };
        let lattice =
            Lattice::new([cell.x.map(|ends| period(0, ends)), cell.y.map(|ends| period(1, ends))]);
        for (axis, name, ends) in [(0, "x", cell.x), (1, "y", cell.y)] {
            if ends.is_none() && cell.slope[axis] != 0.0 {
                let problem =
                    format!("a slope along {name}, along which the scene does not repeat");
                return Err(self
                    .error(format_args!("/periodic/slope/{axis}"), problem)
                    .remedy(format!("give `{name}`, or a slope of 0")));
            }
        }
        lattice.check().map_err(|problem| problem.at(self.place("/periodic")))?;
        Ok(lattice)
    }

    fn load(mut self, file: &SceneSpec) -> Result<LoadedScene> {
        let settings = self.settings(&file.settings)?;
        let view = file.camera.as_ref().map(|camera| self.view(camera)).transpose()?;
        let spectra = file.materials.len() + file.lights.len();
        if spectra * lanes(self.bands()) > MAX_NUMBERS {
            let problem = format!("{} bands for {spectra} materials and lights", self.bands());
            return Err(self
                .error("/bands", problem + ": more than memory holds")
                .remedy("use fewer bands"));
        }
        self.parts.lattice =
            file.periodic.as_ref().map(|cell| self.lattice(cell, file.unit)).transpose()?;
        if let Some(LayersSpec { dz }) = file.layers {
            if !(dz.is_finite() && dz > 0.0) {
                return Err(self
                    .error("/layers/dz", format!("{dz}, must be above 0"))
                    .remedy("give the height of a layer in the scene's unit"));
            }
            self.parts.layers = Some(dz * file.unit.metres());
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
            self.told.warnings.push(format!("{error} (no surface has this material)"));
        }
        let non_reciprocal_leaves = self.materials.non_reciprocal();
        drop(std::mem::take(&mut self.files.obj_files));
        self.parts.groups = self.taken.take_groups();
        self.parts.materials = std::mem::take(&mut self.materials).into_used();
        self.load_parameters(file)?;
        let name = self.files.path.display().to_string();
        let scene = match self.files.sources.kept {
            Some(kept) => Scene::with_kept(self.parts, &kept.shapes),
            None => Scene::new(self.parts),
        };
        let scene = scene.map_err(|e| e.at(&name))?;
        let outside = scene.outside_openings();
        self.told
            .warnings
            .extend(outside.iter().map(|outside| outside_openings(&name, &scene, outside)));
        Ok(LoadedScene {
            scene,
            unit: file.unit,
            settings,
            given_settings: Vec::new(),
            view,
            warnings: self.told.warnings,
            notes: self.told.notes,
            unused_materials,
            hourly: self.files.sources.by_hour.is_some().then_some(self.hourly),
            open_field,
            averages,
            lamp_spectra: lamp_spectra(file),
            without_ground: file.lights.iter().filter_map(LightSpec::without_ground).collect(),
            tables: self.told.tables,
            non_reciprocal_leaves,
            files: self.files.read.into_inner(),
            place: self.files.path,
        })
    }
}

fn lamp_spectra(file: &SceneSpec) -> Vec<[String; 2]> {
    let named = |(i, light): (usize, &LightSpec)| match light.keys().power? {
        PowerSpec::Spectrum(lamp) => {
            let name = light.keys().name.map_or(format!("light{i}"), String::from);
            Some([name, lamp.spectrum.clone()])
        }
        PowerSpec::Given(_) | PowerSpec::File => None,
    };
    file.lights.iter().enumerate().filter_map(named).collect()
}

/// Says that light is missing that would come in by way of surfaces outside openings.
fn outside_openings(file: &str, scene: &Scene, outside: &Outside) -> String {
    let Outside { lights, share, names } = outside;
    let lights = lights.iter().map(|&light| format!("`{}`", scene.lights()[light].name));
    let percent = 100.0 * share;
    let names = some(names.iter().map(|name| format!("`{name}`")), LISTED);
    format!(
        "{}: {} come in through openings alone, and {percent:.*} % of what these see towards the sky \
        is surfaces ({names}), which get none of this light: what they would send in is missing; \
        put the openings outside of these surfaces, or leave `through` out; in place of a ground \
        give the lights `ground`",
        json::place(file, "/lights"),
        some(lights, LISTED),
        usize::from(percent < 9.95),
    )
}
