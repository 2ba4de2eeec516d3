//! Scenes that a program makes from typed values, in the words of a scene file.

use std::path::{Path, PathBuf};

use super::{
    InMemory, LoadedScene,
    files::Sources,
    loader::Loader,
    spec::{
        BandSpec, CaptorSpec, LayersSpec, LightSpec, MaterialSpec, ObjectSpec, Patterns,
        PeriodicSpec, SceneSpec, SiteSpec, SunAtSpec, TimeSpec, WeatherSpec,
    },
};
use crate::{input::read_bytes, obj::Mesh};
use phylux_core::{
    error::{Error, Result},
    math::units::{LengthUnit, Quantity},
};

/// A scene in the making: what a scene file says, as typed values, with meshes in memory.
///
/// A scene file is read into the same [description](crate::spec), and both go the same
/// way from there: ids, checks and the sentences of errors are those of a file that says the same.
/// docs/scene-format.md describes each part.
/// The documentation of `phylux::formats` has an example.
#[derive(Debug, Default)]
pub struct SceneBuilder {
    spec: SceneSpec,
    memory: InMemory,
    folder: PathBuf,
    /// A name that was given twice, as the place and what is wrong there.
    twice: Option<(String, String)>,
}

impl SceneBuilder {
    /// Begins a scene that is made in memory.
    pub fn new() -> Self {
        Self::default()
    }

    /// Begins with what a description says, such as parts for which there is no method here.
    pub fn of(spec: SceneSpec) -> Self {
        Self { spec, ..Self::default() }
    }

    /// Sets the title.
    pub fn name(mut self, name: &str) -> Self {
        self.spec.name = Some(name.into());
        self
    }

    /// Sets the unit of every length (m without it).
    pub fn unit(mut self, unit: LengthUnit) -> Self {
        self.spec.unit = unit;
        self
    }

    /// Sets the quantity of powers and fluxes (W without it).
    pub fn quantity(mut self, quantity: Quantity) -> Self {
        self.spec.quantity = quantity;
        self
    }

    /// Sets the folder that the files which parts name are relative to (the working directory
    /// without it).
    pub fn folder(mut self, folder: impl AsRef<Path>) -> Self {
        self.folder = folder.as_ref().into();
        self
    }

    /// Adds a band of wavelengths, nm.
    pub fn band(mut self, name: &str, from_nm: f64, to_nm: f64) -> Self {
        let (from_nm, to_nm) = (Some(from_nm), Some(to_nm));
        let band = BandSpec { name: name.into(), from_nm, to_nm };
        self.spec.bands.get_or_insert_default().push(band);
        self
    }

    /// Adds a material.
    pub fn material(mut self, name: &str, material: impl Into<MaterialSpec>) -> Self {
        let before = self.spec.materials.insert(name.into(), material.into());
        self.once("/materials", name, before.is_some());
        self
    }

    /// Hands over a mesh, for objects, area lights and captors to name.
    pub fn mesh(mut self, name: &str, mesh: Mesh) -> Self {
        let before = self.memory.meshes.insert(name.into(), mesh);
        self.once("meshes", name, before.is_some());
        self
    }

    /// Adds surfaces.
    pub fn object(mut self, object: ObjectSpec) -> Self {
        self.spec.objects.push(object);
        self
    }

    /// Adds a light.
    pub fn light(mut self, light: impl Into<LightSpec>) -> Self {
        self.spec.lights.push(light.into());
        self
    }

    /// Adds captors.
    pub fn captor(mut self, captor: CaptorSpec) -> Self {
        self.spec.captors.push(captor);
        self
    }

    /// Adds a group of captors by patterns of their ids.
    pub fn group(mut self, name: &str, patterns: impl Into<Patterns>) -> Self {
        let before = self.spec.groups.insert(name.into(), patterns.into());
        self.once("/groups", name, before.is_some());
        self
    }

    /// Sets where on the earth the scene is, in degrees north and east.
    pub fn site(mut self, latitude: f64, longitude: f64) -> Self {
        let (latitude, longitude) = (Some(latitude), Some(longitude));
        self.spec.site = Some(SiteSpec { latitude, longitude, north: None });
        self
    }

    /// Sets when the scene is: an ISO 8601 time with offset, or "year".
    pub fn time(mut self, time: &str) -> Self {
        self.spec.time = Some(TimeSpec::Text(time.into()));
        self
    }

    /// Sets where the sun stands, in place of site and time: its elevation above the horizon and its
    /// azimuth clockwise from north, degrees.
    pub fn sun_at(mut self, elevation_deg: f64, azimuth_deg: f64) -> Self {
        self.spec.sun_at = Some(SunAtSpec { elevation_deg, azimuth_deg });
        self
    }

    /// Makes the scene a cell that repeats for ever between these ends along x and y, in the scene's
    /// unit.
    pub fn periodic(mut self, x: [f64; 2], y: [f64; 2]) -> Self {
        self.spec.periodic = Some(PeriodicSpec { x: Some(x), y: Some(y), slope: [0.0; 2] });
        self
    }

    /// Sums what surface captors absorb in layers of this height, above 0, in the scene's unit.
    pub fn layers(mut self, dz: f64) -> Self {
        self.spec.layers = Some(LayersSpec { dz });
        self
    }

    /// Sets the irradiances of the whole solar spectrum, or the file of them.
    pub fn weather(mut self, weather: WeatherSpec) -> Self {
        self.spec.weather = Some(weather);
        self
    }

    /// Makes the scene, with the warnings and notes of a scene that is loaded.
    ///
    /// # Errors
    /// Those of [`load`](crate::load). Their place is `scene` in the [folder](Self::folder), with
    /// the JSON pointer that the part would have in a file.
    pub fn build(self) -> Result<LoadedScene> {
        let path = self.folder.join("scene");
        if let Some((place, problem)) = self.twice {
            let place = format!("{}: {place}", path.display());
            return Err(Error::input(place, problem).remedy("give each a name of its own"));
        }
        let InMemory { meshes, tables } = &self.memory;
        let sources = Sources { read: &read_bytes, kept: None, meshes, tables, by_hour: None };
        let mut loaded = Loader::new(&path, &self.spec, &sources)?.load(&self.spec)?;
        loaded.files.retain(|file| *file != path);
        Ok(loaded)
    }

    /// Remembers the first name that is given twice.
    fn once(&mut self, place: &str, name: &str, again: bool) {
        if again && self.twice.is_none() {
            self.twice = Some((place.into(), format!("`{name}` is there twice")));
        }
    }
}
