//! Scene files: JSON with its OBJ, MTL and CSV files -> [`Scene`], with all checking.

mod captors;
mod format;
#[cfg(test)]
mod fuzz;
mod lights;
mod materials;
mod objects;

use std::{
    collections::{BTreeMap, HashMap, HashSet},
    fmt::Display,
    path::{Path, PathBuf},
    rc::Rc,
};

use glam::DVec3;
use serde_json::Value;

use format::{CameraFile, PerBand, SettingsFile, TransformFile};
pub use format::{Count, SceneFile};

use crate::{
    camera::View,
    error::{Error, Result, nearest, number},
    geometry::Transform,
    input::{Fetch, RELATIVE, read_bytes},
    json,
    obj::ObjFile,
    scene::{Band, BandSum, NamedMaterial, Scene, SceneParts},
    settings::{Checked, Settings},
    spectrum::{MAX_BANDS, lanes},
    units::LengthUnit,
};

/// The most triangles in a scene: surfaces, captors and lights together.
const MAX_TRIANGLES: usize = 20_000_000;
/// The most captors.
const MAX_CAPTORS: usize = 2_000_000;
/// The most lights.
const MAX_LIGHTS: usize = 1_000_000;
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
    /// The scene file and the OBJ and CSV files that it names.
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

/// Like [`load`], from the bytes of the file at `path`.
pub fn parse(bytes: &[u8], path: &Path) -> Result<LoadedScene> {
    load_value(json::parse(&path.display().to_string(), bytes)?, path, &read_bytes)
}

/// Like [`load`], from the JSON of the file at `path`; `read` fetches the files that it names.
pub fn load_value(value: Value, path: &Path, read: &Fetch) -> Result<LoadedScene> {
    let file: SceneFile = json::read(&path.display().to_string(), value)?;
    Loader::new(path, &file, read)?.load(&file)
}

/// What is known and collected while a scene is put together.
struct Loader<'a> {
    path: PathBuf,
    read: &'a Fetch<'a>,
    metres: f64,
    bands: usize,
    parts: SceneParts,
    obj_files: HashMap<PathBuf, Rc<ObjFile>>,
    csv_files: Vec<PathBuf>,
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
    fn new(path: &Path, file: &SceneFile, read: &'a Fetch) -> Result<Self> {
        let mut loader = Self {
            path: path.to_path_buf(),
            read,
            metres: file.unit.metres(),
            bands: 0,
            parts: SceneParts::default(),
            obj_files: HashMap::new(),
            csv_files: Vec::new(),
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
        let mut files = vec![self.path.clone()];
        files.extend(self.obj_files.into_keys());
        files.append(&mut self.csv_files);
        let mut groups: Vec<(usize, String)> =
            self.groups.into_iter().map(|(name, index)| (index, name)).collect();
        groups.sort();
        self.parts.groups = groups.into_iter().map(|(_, name)| name).collect();
        self.parts.materials = self.materials.into_used();
        let name = self.path.display().to_string();
        let scene = Scene::new(self.parts).map_err(|e| e.at(name))?;
        Ok(LoadedScene {
            scene,
            unit: file.unit,
            settings,
            view,
            warnings: self.warnings,
            unused_materials,
            non_reciprocal_leaves,
            files,
        })
    }

    fn load_bands(&mut self, file: &SceneFile) -> Result<()> {
        let Some(bands) = &file.bands else {
            self.bands = 1;
            self.parts.bands = vec![Band { name: "all".into(), from_nm: None, to_nm: None }];
            return self.load_sums(file);
        };
        if bands.is_empty() || bands.len() > MAX_BANDS {
            let problem = format!("{} bands, must be 1 to {MAX_BANDS}", bands.len());
            return Err(self.error("/bands", problem).remedy("leave it out for a single band"));
        }
        for (i, band) in bands.iter().enumerate() {
            let pointer = format!("/bands/{i}");
            if bands[..i].iter().any(|other| other.name == band.name) {
                return Err(self
                    .error(pointer, format!("a second band named `{}`", band.name))
                    .remedy("give each band a name of its own"));
            }
            if let (Some(from), Some(to)) = (band.from_nm, band.to_nm)
                && from >= to
            {
                return Err(self
                    .error(pointer, format!("from_nm = {from} is not below to_nm = {to}"))
                    .remedy("swap or correct them"));
            }
            for (key, nm) in [("from_nm", band.from_nm), ("to_nm", band.to_nm)] {
                if let Some(nm) = nm {
                    self.in_range(&format!("{pointer}/{key}"), nm, 0.0, f64::MAX)?;
                }
            }
            self.parts.bands.push(Band {
                name: band.name.clone(),
                from_nm: band.from_nm,
                to_nm: band.to_nm,
            });
        }
        self.bands = bands.len();
        self.load_sums(file)
    }

    fn load_sums(&mut self, file: &SceneFile) -> Result<()> {
        for (name, members) in &file.sums {
            let pointer = format!("/sums/{}", json::escaped(name));
            if self.parts.bands.iter().any(|band| band.name == *name) {
                return Err(self
                    .error(pointer, "a band has this name too")
                    .remedy("give the sum another name"));
            }
            let mut bands = Vec::new();
            for (i, member) in members.iter().enumerate() {
                let names = || self.parts.bands.iter().map(|band| band.name.as_str());
                let Some(band) = names().position(|name| name == member) else {
                    return Err(unknown(
                        self.error(format!("{pointer}/{i}"), format!("no band `{member}`")),
                        member,
                        names(),
                    ));
                };
                if bands.contains(&band) {
                    let problem = format!("`{member}` stands here twice");
                    return Err(self.error(pointer, problem).remedy("name each band once"));
                }
                bands.push(band);
            }
            if bands.is_empty() {
                return Err(self.error(pointer, "adds up no band").remedy("name its bands"));
            }
            self.parts.sums.push(BandSum { name: name.clone(), bands });
        }
        Ok(())
    }

    fn settings(&self, file: &SettingsFile) -> Result<Settings> {
        let default = Settings::default();
        let wrong = |key: &str, why: String| self.error(format!("/settings/{key}"), why);
        let count = |key: &str, count: Option<Count>, check: fn(u64) -> Checked<usize>| {
            count.map(|n| check(n.0).map_err(|why| wrong(key, why))).transpose()
        };
        Ok(Settings {
            estimator: file.estimator,
            photons: file
                .photons
                .map(|n| Settings::check_photons(n.0).map_err(|why| wrong("photons", why)))
                .transpose()?,
            seed: file.seed.unwrap_or(default.seed),
            k: count("k", file.k, Settings::check_k)?,
            map_photons: count("map_photons", file.map_photons, Settings::check_map_photons)?
                .unwrap_or(default.map_photons),
            tolerance: file
                .tolerance
                .map(|t| Settings::check_tolerance(t).map_err(|why| wrong("tolerance", why)))
                .transpose()?,
            tolerance_limit: None,
            max_time: file
                .max_time
                .map(|t| Settings::check_max_time(t).map_err(|why| wrong("max_time", why)))
                .transpose()?,
            threads: count("threads", file.threads, Settings::check_threads)?.unwrap_or(0),
        })
    }

    fn view(&self, camera: &CameraFile) -> Result<View> {
        let point = |p: [f64; 3]| DVec3::from(p) * self.metres;
        let pixels = |key: &str, count: Option<Count>, usual: usize| {
            let Some(count) = count else { return Ok(usual) };
            let most = View::MOST_PIXELS as f64;
            self.in_range(&format!("/camera/{key}"), count.0 as f64, 1.0, most)?;
            Ok(count.0 as usize)
        };
        let view = View {
            position: point(camera.position),
            look_at: point(camera.look_at),
            up: camera.up.map_or(DVec3::Z, DVec3::from),
            fov_deg: camera.fov_deg.unwrap_or(View::FOV_DEG),
            width: pixels("width", camera.width, View::SIZE.0)?,
            height: pixels("height", camera.height, View::SIZE.1)?,
        };
        view.check_directions()
            .map_err(|why| self.error("/camera", why).remedy("move one of them"))?;
        View::check_fov(view.fov_deg)
            .map_err(|why| self.error("/camera/fov_deg", why).remedy("45 is usual"))?;
        Ok(view)
    }

    /// An error at a JSON pointer of the scene file.
    fn error(&self, pointer: impl Display, problem: impl Display) -> Error {
        Error::input(json::place(&self.path.display().to_string(), &pointer.to_string()), problem)
    }

    fn warn(&mut self, place: impl Display, problem: impl Display) {
        const MOST: usize = 100;
        match self.warnings.len() {
            0..MOST => self.warnings.push(format!("{place}: {problem}")),
            MOST => self.warnings.push("and more warnings than these".into()),
            _ => {}
        }
    }

    /// Refuses a number outside [`low`, `high`].
    fn in_range(&self, pointer: &str, value: f64, low: f64, high: f64) -> Result<()> {
        if (low..=high).contains(&value) {
            return Ok(());
        }
        let range = match high {
            f64::MAX => format!("at least {low}"),
            _ => format!("from {low} to {high}"),
        };
        let error = self.error(pointer, format!("{}, must be {range}", number(value)));
        Err(if high == 1.0 && value > 1.0 { error.remedy("75 % is 0.75") } else { error })
    }

    /// One number per band, each in [0, `high`].
    fn per_band(&self, pointer: &str, values: &PerBand, high: f64) -> Result<Vec<f64>> {
        match values {
            PerBand::All(value) => {
                self.in_range(pointer, *value, 0.0, high)?;
                Ok(vec![*value; self.bands])
            }
            PerBand::Each(values) if values.len() == self.bands => {
                for (i, value) in values.iter().enumerate() {
                    self.in_range(&format!("{pointer}/{i}"), *value, 0.0, high)?;
                }
                Ok(values.clone())
            }
            PerBand::Each(values) => {
                let s = if self.bands == 1 { "" } else { "s" };
                let problem = format!("{} numbers for {} band{s}", values.len(), self.bands);
                Err(self.error(pointer, problem).remedy("give one number, or one per band"))
            }
        }
    }

    /// The same in single precision, padded to the lanes of the scene.
    fn lanes(&self, values: &[f64]) -> Vec<f32> {
        let mut padded: Vec<f32> = values.iter().map(|v| *v as f32).collect();
        padded.resize(lanes(self.bands), 0.0);
        padded
    }

    /// The path of a file that the scene file names.
    fn sibling(&self, file: &str) -> PathBuf {
        self.path.parent().unwrap_or(Path::new("")).join(file)
    }

    /// The bytes of a file that the scene file names at `pointer`.
    fn bytes(&self, pointer: &str, path: &Path) -> Result<Vec<u8>> {
        let error = |why| self.error(pointer, format!("{}: {why}", path.display()));
        (self.read)(path).map_err(|why| error(why).remedy(RELATIVE))
    }

    /// An OBJ file, read once.
    fn obj(&mut self, pointer: &str, file: &str) -> Result<Rc<ObjFile>> {
        let path = self.sibling(file);
        if let Some(obj) = self.obj_files.get(&path) {
            return Ok(obj.clone());
        }
        if file.is_empty() {
            return Err(self.error(pointer, "no file name").remedy("name an OBJ file"));
        }
        let bytes = self.bytes(pointer, &path)?;
        let obj = Rc::new(ObjFile::parse(&bytes, &path, self.read)?);
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
        self.obj_files.insert(path, obj.clone());
        Ok(obj)
    }

    /// Placements of an object: `transform` alone, or each instance after it.
    fn placements(
        &self,
        pointer: &str,
        transform: Option<TransformFile>,
        instances: Option<&[TransformFile]>,
    ) -> Result<Vec<Transform>> {
        let base =
            self.transform(&format!("{pointer}/transform"), transform.unwrap_or_default())?;
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

    /// Triangles in metres, placed.
    fn placed(
        &mut self,
        triangles: &[[DVec3; 3]],
        transform: &Transform,
    ) -> Result<Vec<[DVec3; 3]>> {
        self.count_triangles(triangles.len())?;
        let metres = self.metres;
        Ok(triangles.iter().map(|t| t.map(|p| transform.point(p * metres))).collect())
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
