//! The picture to make, and what all kinds of pictures need: the bands, the camera, the light,
//! scales and legends.

use std::{borrow::Cow, time::Instant};

use glam::Vec3;

use super::job::{PictureJob, PictureOf};
use crate::desk::Desk;
use phylux_core::{
    error::{Error, Result, Words, setting},
    math::geometry::Ray,
    scene::{material::Scatterer, world::Scene},
    transport::{
        settings::{MapLimit, NearestCount, Settings, TimeLimit},
        simulate::{Control, light_surfaces},
        surface_light::SurfaceLight,
    },
    words,
};
use phylux_files::scene_file::LoadedScene;
use phylux_results::result::{band_results, light_name};
use phylux_show::{
    picture::{Ground, Legend, PAPER, Picture, Scale},
    render::{
        FirstVisible, Fragments, Gather, Pixels, Sampling, Show, Viewpoint, check_size, painted,
        render,
    },
};

/// Rays of each pixel between two looks at the clock, where the time is limited.
const ROUND: u32 = 4;
/// Photons to store for a picture of photons.
const DOTS: usize = 300_000;

/// Photons of each estimate of the light that they make together there, which is sharper than pictures
/// of light alone: photons on it say where it is rough.
const DOTS_K: usize = 150;

/// A finished picture, the light in it as numbers, and a line about how it was found.
#[derive(Debug)]
pub struct Made {
    /// The picture.
    pub picture: Picture,
    /// The light on surfaces; `None` in pictures of captors or photons.
    pub pixels: Option<Pixels>,
    /// How the light was found.
    pub words: Words,
}

impl PictureJob {
    /// Makes the picture. Errors: options that do not go together; there is no such band; the camera
    /// sees nothing; those of the runs.
    pub fn picture(&self, loaded: &LoadedScene, desk: &Desk) -> Result<Made> {
        self.check()?;
        make(self, loaded, desk)
    }
}

fn make(job: &PictureJob, loaded: &LoadedScene, desk: &Desk) -> Result<Made> {
    let started = Instant::now();
    let LoadedScene { scene, settings, .. } = loaded;
    // of numbers the band that plots and pages begin with; a photo has all bands
    let first = match job.show {
        PictureOf::Irradiance | PictureOf::Absorbed | PictureOf::Error | PictureOf::Captors => {
            first_band(scene)
        }
        PictureOf::Radiance | PictureOf::Photons => None,
    };
    let band = chosen_bands(scene, job.band.as_deref().or(first))?;
    let sum =
        band.index.and_then(|index| scene.sums().get(index.checked_sub(scene.bands().len())?));
    if let Some(sum) = sum.filter(|sum| !sum.weights.is_empty() && job.show != PictureOf::Captors) {
        let problem = format!("the sum `{}` weights its bands, which a picture cannot", sum.name);
        return Err(Error::input(setting("band"), problem).remedy(words![
            "name a band or another sum, or show the captors (",
            setting("show").is("captors"),
            ")"
        ]));
    }
    let scale = match job.range {
        Some((low, high)) => Some(Scale::new(low, high, job.log)?),
        None => None,
    };
    let viewpoint = job.camera.viewpoint(loaded)?;
    // checked here, before photons are traced for a picture that is too large
    check_size(&viewpoint, scene.bands().len().max(3))?;
    let (few, k) = match job.show {
        PictureOf::Photons => (MapLimit::nearest_to(DOTS), DOTS_K),
        _ => (settings.map_photons, SurfaceLight::DEFAULT_K),
    };
    let settings = Settings {
        photons: job.photons,
        seed: job.seed.unwrap_or(settings.seed),
        k: Some(NearestCount::new(job.k.map_or(k, |k| k as usize))?),
        map_photons: job.map_photons.unwrap_or(few),
        threads: job.threads.unwrap_or(settings.threads),
        ..settings.clone()
    };
    let sampling = Sampling {
        rays: job.rays,
        before: 0,
        seed: settings.seed,
        threads: settings.threads.get(),
    };
    let task = Task { job, scene, viewpoint, settings, sampling, band, scale, desk, started };
    match job.show {
        PictureOf::Radiance => task.radiance(),
        PictureOf::Irradiance => task.false_colour(Show::Irradiance),
        PictureOf::Absorbed => task.false_colour(Show::Absorbed),
        PictureOf::Error => task.error(),
        PictureOf::Captors => task.captors(loaded),
        PictureOf::Photons => task.photons(),
    }
}

/// The bands to show, and the name of the band or sum that they make up.
pub(super) struct ChosenBands {
    pub name: String,
    pub bands: Vec<usize>,
    /// Whether the user named the band or sum.
    pub named: bool,
    /// Index among the bands followed by the sums; `None` for the sum of all bands.
    pub index: Option<usize>,
}

/// Returns the name of the first sum that pictures can show, or of the first band.
fn first_band(scene: &Scene) -> Option<&str> {
    let sum = scene.sums().iter().find(|sum| sum.weights.is_empty()).map(|sum| &sum.name);
    sum.or(scene.bands().first().map(|band| &band.name)).map(String::as_str)
}

fn chosen_bands(scene: &Scene, name: Option<&str>) -> Result<ChosenBands> {
    let count = scene.bands().len();
    let chosen =
        |name: &str, bands, index| ChosenBands { name: name.into(), bands, named: true, index };
    let Some(name) = name else {
        let all = match scene.bands() {
            [only] => chosen(&only.name, vec![0], Some(0)),
            _ => chosen("sum of bands", (0..count).collect(), None),
        };
        return Ok(ChosenBands { named: false, ..all });
    };
    if let Some(b) = scene.bands().iter().position(|band| band.name == name) {
        return Ok(chosen(name, vec![b], Some(b)));
    }
    if let Some(s) = scene.sums().iter().position(|sum| sum.name == name) {
        return Ok(chosen(name, scene.sums()[s].bands.clone(), Some(count + s)));
    }
    if name == "sum" {
        return Ok(chosen("sum of bands", (0..count).collect(), None));
    }
    let names = scene.bands().iter().map(|band| &band.name);
    let names: Vec<&str> =
        names.chain(scene.sums().iter().map(|sum| &sum.name)).map(String::as_str).collect();
    let problem = format!("the scene has no band or sum `{name}`");
    Err(Error::input(setting("band"), problem)
        .remedy(format!("there are {}, sum", names.join(", "))))
}

/// A picture to make.
pub(super) struct Task<'a> {
    pub job: &'a PictureJob,
    pub scene: &'a Scene,
    pub viewpoint: Viewpoint<'a>,
    pub settings: Settings,
    pub sampling: Sampling,
    pub band: ChosenBands,
    scale: Option<Scale>,
    desk: &'a Desk,
    started: Instant,
}

impl<'a> Task<'a> {
    /// Does `work`, of which the desk hears as `what`.
    pub fn watched<T>(&self, what: &str, work: impl FnOnce(&Control) -> Result<T>) -> Result<T> {
        self.desk.during(what, |progress| work(&Control { stop: self.desk.stop(), progress }))
    }

    pub fn light(&self) -> Result<SurfaceLight<'a>> {
        self.watched("photons", |control| light_surfaces(self.scene, &self.settings, control))
    }

    /// Returns the sum, per band, of the light that has come from lamps and sky to opaque surfaces
    /// without being scattered on its way.
    pub fn straight(&self, light: &SurfaceLight) -> Vec<f32> {
        let mut sums = vec![0.0; self.scene.bands().len()];
        for (index, way) in light.map.ways().iter().enumerate() {
            let surface = self.scene.surface(light.map.photons[index].triangle as usize);
            if way.bounces == 0 && !self.scene.material(&surface).is_clear() {
                let power = light.map.power(index);
                sums.iter_mut().zip(power).for_each(|(sum, p)| *sum += f64::from(*p));
            }
        }
        sums.into_iter().map(|sum| sum as f32).collect()
    }

    /// Returns what the rays of all pixels find: so many for each pixel, or as many as the time allows.
    pub fn fragments(&self, light: &SurfaceLight, show: Show) -> Result<Fragments> {
        let Sampling { rays, .. } = self.sampling;
        let gather = match self.job.gather.unwrap_or(1) {
            0 => None,
            directions => Some(self.watched("photons", |control| {
                Gather::new(light, directions, &self.settings, control)
            })?),
        };
        let round = |before: u32, rays: u32| {
            let sampling = Sampling { rays, before, ..self.sampling };
            self.watched("pixels", |control| {
                render(light, gather.as_ref(), &self.viewpoint, show, sampling, control)
            })
        };
        let Some(most) = self.job.max_time.map(TimeLimit::get) else { return round(0, rays) };
        let mut from = Instant::now();
        let mut all = round(0, rays.min(ROUND))?;
        // as long as another round is expected to end in time
        while all.rays() < rays && self.started.elapsed() + from.elapsed() <= most {
            from = Instant::now();
            all = all.joined(&round(all.rays(), (rays - all.rays()).min(ROUND))?);
        }
        Ok(all)
    }

    /// Returns what the picture shows: with noise smoothed out in the `bands` that are seen, unless
    /// the user turns this off.
    pub fn shown<'f>(
        &self,
        fragments: &'f Fragments,
        bands: &[usize],
    ) -> Result<Cow<'f, Fragments>> {
        Ok(match self.denoises() {
            true => Cow::Owned(fragments.denoised(bands, self.sampling.threads)?),
            false => Cow::Borrowed(fragments),
        })
    }

    pub fn denoises(&self) -> bool {
        self.job.denoise != Some(false)
    }

    /// Returns the scale of the user, or else one that reaches beyond this share of the values.
    pub fn scale(&self, values: Vec<f64>, share: f64) -> Scale {
        self.scale.unwrap_or_else(|| Scale::of(values, share, self.job.log))
    }

    /// Returns the legend of values of which `most` is the greatest.
    pub fn legend(&self, what: &str, unit: &str, scale: Scale, most: f64) -> Legend {
        let flux = self.scene.quantity().unit_names().flux;
        let light = match what {
            "irradiance" => light_name(&band_results(self.scene), self.band.index, &flux),
            _ => format!("{what}, {}", self.band.name),
        };
        let short = |line: &str| line.chars().take(14).collect();
        let lines = light.splitn(2, ", ").chain([unit]);
        let (title, beyond) = (lines.map(short).collect(), most > scale.high);
        Legend { title, scale, whole: false, beyond, ground: Ground::Light }
    }

    /// Makes a pale picture of what `see` says each ray meets first. `colour` gives the colour of a
    /// captor and the face of it that is seen (true for the front); what has no colour is grey.
    pub fn pale(
        &self,
        see: impl Fn(&Viewpoint<'a>, &Ray) -> FirstVisible + Sync,
        colour: impl Fn(usize, bool) -> Option<Vec3> + Sync,
    ) -> Result<Picture> {
        let paint = |ray: &Ray| match see(&self.viewpoint, ray) {
            FirstVisible::Nothing => PAPER,
            FirstVisible::Thing { cos, captor, front } => captor
                .and_then(|captor| colour(captor, front))
                .unwrap_or(Vec3::splat(0.72 + 0.2 * cos)),
        };
        let colours = self
            .watched("pixels", |control| painted(&self.viewpoint, self.sampling, control, paint))?;
        Ok(Picture::new(self.viewpoint.camera.width, colours.into_iter()))
    }
}

pub(super) fn photons(light: &SurfaceLight) -> String {
    format!("{} arrivals of {} photons", light.map.photons.len(), light.map.histories)
}

/// Describes the photons, and the number of rays of each pixel.
pub(super) fn photons_and_rays(light: &SurfaceLight, found: &Fragments) -> String {
    format!("{}, {} rays a pixel", photons(light), found.rays())
}
