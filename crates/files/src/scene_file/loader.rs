//! The [`Loader`]: what is known and collected while a scene is put together, and errors that say
//! where in the scene file they are. The other files of this folder add to it what they load.

use std::{
    cell::RefCell,
    collections::{BTreeMap, HashMap, HashSet},
    fmt::Display,
    path::{Path, PathBuf},
    sync::Arc,
};

use glam::DVec3;

use super::{
    hourly_lights::{ByHour, HourlyLights},
    kept::Kept,
    known_spectra::Spectra,
    library::Library,
    notes::TableNote,
    rooms::RoomLamps,
    spec::SceneSpec,
};
use crate::{
    input::{Fetch, RELATIVE},
    json,
    obj::{Mesh, ObjFile},
    photometry::Photometry,
};
use phylux_core::{
    error::{Checked, Error, Result, nearest},
    math::machine::{gib, memory_left},
    scene::world::{Asked, MAX_CAPTORS, MAX_TRIANGLES, SceneParts},
};

/// The most names that a sentence lists of those that are known: all spectra at hand.
const NAMED: usize = 30;

/// The places where a scene finds the files, meshes and tables that its JSON only names.
pub(super) struct Sources<'a> {
    /// Reads the file at a path.
    pub(super) read: &'a Fetch<'a>,
    /// Files and arranged triangles of other scenes, to be used again if they are the same.
    pub(super) kept: Option<&'a Kept>,
    /// Meshes in memory, by name.
    pub(super) meshes: &'a HashMap<String, Mesh>,
    /// Tables of captors in memory (the bytes of CSV files), by name.
    pub(super) tables: &'a HashMap<String, Vec<u8>>,
    /// How finely the sky is divided, if the sun and the sky are to become the lights of
    /// [`HourlyLights`]; else `None`.
    pub(super) by_hour: Option<ByHour<'a>>,
}

/// What is known and collected while a scene is put together.
pub(super) struct Loader<'a> {
    pub(super) path: PathBuf,
    pub(super) sources: &'a Sources<'a>,
    /// Every file that was read, the scene file first.
    pub(super) files: RefCell<Vec<PathBuf>>,
    pub(super) metres: f64,
    pub(super) bands: usize,
    /// Whether the scene file names its bands.
    pub(super) bands_named: bool,
    pub(super) parts: SceneParts,
    pub(super) obj_files: HashMap<PathBuf, Arc<ObjFile>>,
    /// What was said already of files that several objects may name, as place and kind.
    pub(super) said: HashSet<(PathBuf, &'static str)>,
    pub(super) photometries: HashMap<PathBuf, Photometry>,
    pub(super) spectra: Spectra,
    pub(super) materials: Library,
    pub(super) groups: BTreeMap<String, usize>,
    /// Names of the captor entries and of the objects with captors. Each is the name of a group of
    /// captors too.
    pub(super) entries: HashSet<String>,
    /// The groups that entries and objects join by the key `group`, with the place of one of them.
    pub(super) joined: BTreeMap<String, String>,
    pub(super) captor_ids: HashSet<String>,
    pub(super) light_names: HashSet<String>,
    pub(super) triangles: usize,
    pub(super) warnings: Vec<String>,
    pub(super) notes: Vec<String>,
    pub(super) tables: Vec<TableNote>,
    pub(super) room_lamps: Vec<RoomLamps>,
    pub(super) hourly: HourlyLights,
}

impl<'a> Loader<'a> {
    pub(super) fn new(path: &Path, file: &SceneSpec, sources: &'a Sources) -> Result<Self> {
        let mut loader = Self {
            path: path.to_path_buf(),
            sources,
            files: RefCell::new(vec![path.to_path_buf()]),
            metres: file.unit.metres(),
            bands: 0,
            bands_named: file.bands.is_some(),
            parts: SceneParts::default(),
            obj_files: HashMap::new(),
            said: HashSet::new(),
            photometries: HashMap::new(),
            spectra: Spectra::default(),
            materials: Library::default(),
            groups: BTreeMap::new(),
            entries: HashSet::new(),
            joined: BTreeMap::new(),
            captor_ids: HashSet::new(),
            light_names: HashSet::new(),
            triangles: 0,
            warnings: Vec::new(),
            notes: Vec::new(),
            tables: Vec::new(),
            room_lamps: Vec::new(),
            hourly: HourlyLights::default(),
        };
        let stem = stem(path);
        loader.parts.name = file.name.clone().unwrap_or(stem);
        loader.parts.quantity = file.quantity;
        loader.parts.asked = Asked {
            absorbed_by_face: file.absorbed_by_face,
            // a year says it by the hour
            sunlit: file.sunlit && sources.by_hour.is_none(),
        };
        loader.load_bands(file)?;
        Ok(loader)
    }

    /// Names the place of a JSON pointer in the scene file, for errors.
    pub(super) fn place(&self, pointer: impl Display) -> String {
        json::place(&self.path.display().to_string(), &pointer.to_string())
    }

    /// Makes an error at a JSON pointer of the scene file.
    pub(super) fn error(&self, pointer: impl Display, problem: impl Display) -> Error {
        Error::input(self.place(pointer), problem)
    }

    /// Gives the problem of a value that was checked its place in the scene file.
    pub(super) fn located<T>(&self, pointer: impl Display, value: Checked<T>) -> Result<T> {
        value.map_err(|problem| problem.at(self.place(pointer)))
    }

    /// Refuses the first of the keys at `pointer` that is given.
    pub(super) fn refuse_given(
        &self,
        pointer: &str,
        keys: &[(&str, bool)],
        problem: impl Display,
        remedy: &str,
    ) -> Result<()> {
        match keys.iter().find(|(_, given)| *given) {
            Some((key, _)) => Err(self.error(format!("{pointer}/{key}"), problem).remedy(remedy)),
            None => Ok(()),
        }
    }

    pub(super) fn warn(&mut self, place: impl Display, problem: impl Display) {
        const MOST: usize = 100;
        match self.warnings.len() {
            0..MOST => self.warnings.push(format!("{place}: {problem}")),
            MOST => self.warnings.push("and more warnings than these".into()),
            _ => {}
        }
    }

    /// Warns as [`warn`](Self::warn), unless the same was said before.
    pub(super) fn warn_once(&mut self, place: impl Display, problem: impl Display) {
        let sentence = format!("{place}: {problem}");
        if !self.warnings.contains(&sentence) {
            self.warn(place, problem);
        }
    }

    /// Returns the path of a file that the scene file names, relative to the scene file.
    pub(super) fn sibling(&self, file: &str) -> PathBuf {
        self.path.parent().unwrap_or(Path::new("")).join(file)
    }

    /// Reads the bytes of a file that the scene file names at `pointer`.
    pub(super) fn bytes(&self, pointer: &str, path: &Path) -> Result<Vec<u8>> {
        let error = |why| self.error(pointer, format!("{}: {why}", path.display()));
        self.fetch(path).map_err(|why| error(why).remedy(RELATIVE))
    }

    pub(super) fn fetch(&self, path: &Path) -> std::result::Result<Vec<u8>, String> {
        let bytes = (self.sources.read)(path)?;
        self.files.borrow_mut().push(path.to_path_buf());
        Ok(bytes)
    }

    pub(super) fn count_triangles(&mut self, more: usize) -> Result<()> {
        // while the search structure is made, measured with meshes of 1e6 triangles; and what a
        // triangle takes that has its place already, bytes
        const EACH: usize = 220;
        const PLACED: usize = 72;
        // how many more triangles it takes to ask the system again
        const STEP: usize = 20_000;
        let before = self.triangles;
        self.triangles += more;
        if self.triangles / STEP > before / STEP {
            let (bytes, left) = (EACH * self.triangles - PLACED * before, memory_left());
            if bytes as u64 > left {
                let problem = format!(
                    "at least {} triangles take {:.1} GiB of memory, of {:.1} that are left",
                    self.triangles,
                    gib(bytes as u64),
                    gib(left)
                );
                return Err(self
                    .error("", problem)
                    .remedy("use fewer instances or coarser meshes"));
            }
        }
        if self.triangles <= MAX_TRIANGLES {
            return Ok(());
        }
        Err(self
            .error("", format!("more than {MAX_TRIANGLES} triangles"))
            .remedy("use fewer instances, coarser meshes or fewer captors"))
    }

    pub(super) fn point(&self, p: [f64; 3]) -> DVec3 {
        DVec3::from(p) * self.metres
    }

    /// Returns the index of the group `name`; a group that is new gets the next index.
    pub(super) fn group(&mut self, name: &str) -> usize {
        let next = self.groups.len();
        *self.groups.entry(name.to_string()).or_insert(next)
    }

    /// Returns the index of the group that the entry or object `name` joins by the key `group`.
    pub(super) fn joined(&mut self, pointer: &str, name: &str, group: &str) -> usize {
        if group != name && !self.joined.contains_key(group) {
            self.joined.insert(group.into(), self.place(format!("{pointer}/group")));
        }
        self.group(group)
    }

    /// Claims the name of a captor entry or of an object with captors. Error: the name is taken.
    pub(super) fn claim_group(&mut self, pointer: &str, name: &str) -> Result<()> {
        if self.entries.insert(name.to_string()) {
            return Ok(());
        }
        Err(self
            .error(pointer, format!("a second captor entry or captor object named `{name}`"))
            .remedy("give one of them a `name` of its own"))
    }

    pub(super) fn too_many_captors(&self, pointer: &str) -> Error {
        self.error(pointer, format!("more than {MAX_CAPTORS} captors"))
            .remedy("let groups count in place of triangles, or fewer instances")
    }

    /// Claims the id of a captor. Error: the id is taken, or there are too many captors.
    pub(super) fn claim_id(&mut self, pointer: &str, id: &str) -> Result<()> {
        if self.captor_ids.len() == MAX_CAPTORS {
            return Err(self.too_many_captors(pointer));
        }
        if self.captor_ids.insert(id.to_string()) {
            return Ok(());
        }
        Err(self
            .error(pointer, format!("a second captor with the id `{id}`"))
            .remedy("give one of the entries a `name` of its own"))
    }
}

/// Returns the name of a file without its folder and extension.
pub(super) fn stem(path: &Path) -> String {
    path.file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned())
}

/// Adds to an error about an unknown `name` the nearest known name, if one is near, and a list of
/// the known names.
pub(super) fn unknown<'a>(
    error: Error,
    name: &str,
    known: impl Iterator<Item = &'a str> + Clone,
) -> Error {
    let mut all: Vec<&str> = known.clone().take(NAMED + 1).collect();
    if all.is_empty() {
        return error.remedy("there is none");
    }
    if let Some(more) = all.get_mut(NAMED) {
        *more = "...";
    }
    error.did_you_mean_of(nearest(name, known), &all.join(", "))
}
