//! The [`Loader`]: what is known and collected while a scene is put together. It is made of parts:
//! the [`Files`] that were read, what is [`Taken`], what the user is [`Told`], and others. The
//! other files of this folder add to it what they load.

use std::{fmt::Display, path::Path};

use glam::DVec3;

use super::{
    files::{Files, Sources},
    hourly_lights::HourlyLights,
    known_spectra::Spectra,
    library::Library,
    rooms::RoomLamps,
    spec::SceneSpec,
    taken::Taken,
    told::Told,
};
use phylux_core::{
    error::{Checked, Error, Result},
    scene::world::{Asked, SceneParts},
};

/// What is known and collected while a scene is put together.
pub(super) struct Loader<'a> {
    pub(super) files: Files<'a>,
    pub(super) taken: Taken,
    pub(super) told: Told,
    /// The length of the scene's unit, m.
    pub(super) metres: f64,
    /// Whether the scene file names its bands.
    pub(super) bands_named: bool,
    pub(super) parts: SceneParts,
    pub(super) spectra: Spectra,
    pub(super) materials: Library,
    pub(super) room_lamps: Vec<RoomLamps>,
    pub(super) hourly: HourlyLights,
}

impl<'a> Loader<'a> {
    pub(super) fn new(path: &Path, file: &SceneSpec, sources: &'a Sources) -> Result<Self> {
        let mut loader = Self {
            files: Files::new(path, sources),
            taken: Taken::default(),
            told: Told::default(),
            metres: file.unit.metres(),
            bands_named: file.bands.is_some(),
            parts: SceneParts::default(),
            spectra: Spectra::default(),
            materials: Library::default(),
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
        self.files.place(pointer)
    }

    /// Makes an error at a JSON pointer of the scene file.
    pub(super) fn error(&self, pointer: impl Display, problem: impl Display) -> Error {
        self.files.error(pointer, problem)
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

    /// Claims room for more triangles. Error: the scene has more than memory or indices hold.
    pub(super) fn count_triangles(&mut self, more: usize) -> Result<()> {
        self.taken.claim_triangles(more).map_err(|problem| problem.at(self.place("")))
    }

    /// Returns the number of bands, which is known once they are loaded.
    pub(super) fn bands(&self) -> usize {
        self.parts.bands.len()
    }

    /// Returns a point of the scene file in metres.
    pub(super) fn point(&self, p: [f64; 3]) -> DVec3 {
        DVec3::from(p) * self.metres
    }
}

/// Returns the name of a file without its folder and extension.
pub(super) fn stem(path: &Path) -> String {
    path.file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned())
}
