//! Pictures of the photons themselves, and of their paths.

use std::{collections::HashSet, f32::consts::FRAC_PI_3};

use glam::Vec3;

use super::{
    job::PhotonColour,
    task::{Made, Task, photons},
};
use phylux_core::{
    error::Result,
    math::geometry::Ray,
    transport::{
        photon_map::{StoredPhoton, Way},
        surface_light::SurfaceLight,
    },
    words,
};
use phylux_show::{
    kinds::Kind,
    picture::{BandColours, Crowd, Ground, Key, Legend, Picture, Scale, Splats, linear, relief},
    render::{
        ColouredLight, Dot, Ghosts, Paths, last_materials, painted, path_dots, photon_dots, stands,
    },
};

/// What one knows of a photon where it arrives, or on its way.
struct Told<'a> {
    light: usize,
    way: Way,
    /// Index of the material that it came from; `None` straight from its lamp.
    last: Option<usize>,
    /// What it carries, per band.
    power: &'a [f32],
}

/// Radius of a splat with one photon in a square of pixels of this side about it, in pixels of a
/// picture 800 pixels wide. It grows with the square root of the side, so that crowds brighten with
/// the square root of their density.
const SPLAT: f32 = 1.05;
/// The least and the greatest radius of a splat, in the same pixels.
const RADII: [f32; 2] = [0.9, 2.4];
/// Photons in a square pixel of such a picture, at the median over the places where there are any:
/// more would hide each other and the surfaces that they lie on.
const USUAL: f32 = 0.06;
/// The most light in the middle of a splat of a photon of mean power.
const BRIGHT: f32 = 0.2;
/// Where photons crowd as half of them do, and where one in fifty crowds more, light adds up to no
/// more than this.
const COMMON: f32 = 0.5;
const CROWDED: f32 = 2.2;
/// Powers of photons relative to their mean, beyond which they are drawn no fainter or brighter.
const POWERS: [f32; 2] = [0.15, 5.0];
/// The light that photons make together is no more than this over so much of the lit part of the
/// picture, and elsewhere grows with such a power of the irradiance.
const TOGETHER: f32 = 0.45;
const PLACE: f64 = 0.95;
const TONE: f32 = 0.9;
/// The share of that light that does not depend on how a surface lies.
const FLAT: f32 = 0.35;
/// Exponent that makes mixtures of colours as clear as these.
const VIVID: f32 = 2.0;
/// The grey in light whose colour photons alone have, and its share.
const GREY: Vec3 = Vec3::splat(0.35);
const MOSTLY: f32 = 0.65;
/// Radius of the dots of a path, pixels of a picture 800 pixels wide.
const LINE: f32 = 1.4;
/// Light in the middle of a line.
const LINE_BRIGHT: f32 = 0.6;

impl Task<'_> {
    pub fn photons(&self) -> Result<Made> {
        let light = self.light()?;
        let ground = match self.job.light_ground {
            Some(true) => Ground::Light,
            Some(false) | None => Ground::Dark,
        };
        let threads = self.settings.threads.get();
        let ghosts = Ghosts::new(&self.viewpoint, ground);
        let mut behind = self.pixels(|ray| ghosts.colour(&self.viewpoint, ray))?;
        let (relief, lit) = self.relief()?;
        behind.iter_mut().zip(&relief).for_each(|(behind, relief)| *behind *= *relief);
        let colours = self.colours_of_photons(&light, ground);
        let shines = self.shines(&light, &colours)?;
        let shine: Vec<Vec3> = shines.iter().map(|(colour, power)| *power * *colour).collect();
        let together = ColouredLight::new(&light, &shine, threads)?;
        let together = self.pixels(|ray| together.along(&self.viewpoint, ray))?;
        let mut dots = self
            .watched("photons", |control| photon_dots(&light, &self.viewpoint, threads, control))?;
        // a photon without power in the chosen bands is not drawn
        dots.retain(|dot| shines[dot.index].1 > 0.0);
        let found = dots.len();
        let (width, height) = (self.viewpoint.camera.width, self.viewpoint.camera.height);
        let mut splats = Splats::new(ground, width, height);
        let shades =
            relief.iter().zip(&lit).map(|(relief, lit)| relief * (FLAT + (1.0 - FLAT) * lit));
        let toned = toned(together, colours.grey()).into_iter();
        let shaded = toned.zip(shades).map(|(light, shade)| shade * light);
        splats.add_all(&shaded.collect::<Vec<Vec3>>());
        for dot in &mut dots {
            let [x, y] = dot.at.map(|at| at as usize);
            dot.clear *= relief[(y * width + x).min(relief.len() - 1)];
        }
        self.add_photons(&mut splats, &mut dots, &shines);
        let paths = self.add_paths(&mut splats, &colours)?;
        let drawn = match dots.len() {
            drawn if drawn < found => format!(", {drawn} drawn"),
            _ => String::new(),
        };
        let (arrivals, colour) = (photons(&light), colours.words());
        let words = words![format!("{arrivals}, {found} of them seen{drawn}, {colour}\n")];
        let ways = dots.iter().map(|dot| light.map.ways()[dot.index]);
        let ways: HashSet<usize> = ways
            .chain(paths.dots.iter().map(|(dot, _)| paths.legs[dot.index].way))
            .map(way)
            .collect();
        let picture = colours.explained(splats.over(&behind), &ways)?;
        Ok(Made { picture, pixels: None, words })
    }

    /// Returns the share of its light that each pixel keeps beside what stands in front of it, and
    /// how lit it seems by the way its surface lies.
    fn relief(&self) -> Result<(Vec<f32>, Vec<f32>)> {
        let stands = self.pixels(|ray| {
            let (distance, lit) = stands(&self.viewpoint, ray);
            // the mean of nearness has no infinity
            Vec3::new(1.0 / distance, lit, 0.0)
        })?;
        let depths: Vec<f32> = stands.iter().map(|stands| 1.0 / stands.x).collect();
        let lit = stands.iter().map(|stands| stands.y).collect();
        Ok((relief(&depths, self.viewpoint.camera.width), lit))
    }

    /// Returns the mean over the rays of every pixel of what `colour` gives.
    pub(super) fn pixels(&self, colour: impl Fn(&Ray) -> Vec3 + Sync) -> Result<Vec<Vec3>> {
        self.watched("pixels", |control| painted(&self.viewpoint, self.sampling, control, colour))
    }

    /// Returns the colour of each stored photon, and its power in the chosen bands.
    fn shines(&self, light: &SurfaceLight, colours: &PhotonColours) -> Result<Vec<(Vec3, f32)>> {
        let last = match colours.by {
            PhotonColour::Surface => last_materials(light, self.settings.threads.get())?,
            _ => Vec::new(),
        };
        let of = |(index, photon): (usize, &StoredPhoton)| {
            let power = light.map.power(index);
            let way = light.map.ways()[index];
            let last = last.get(index).copied().flatten();
            let told = Told { light: photon.light as usize, way, last, power };
            (colours.of(&told), self.band.bands.iter().map(|&b| power[b]).sum())
        };
        Ok(light.map.photons.iter().enumerate().map(of).collect())
    }

    /// Draws photons, of which only some stay where they are too many.
    fn add_photons(&self, splats: &mut Splats, dots: &mut Vec<Dot>, shines: &[(Vec3, f32)]) {
        let (width, height) = (self.viewpoint.camera.width, self.viewpoint.camera.height);
        let unit = width as f32 / 800.0;
        let crowd =
            |dots: &[Dot]| Crowd::new(width, height, dots.iter().map(|dot| (dot.at, dot.clear)));
        let share = USUAL / (unit * unit * crowd(dots).usual());
        thin(dots, share);
        let crowd = crowd(dots);
        let power = |dot: &Dot| shines[dot.index].1;
        let mean = dots.iter().map(|dot| f64::from(power(dot))).sum::<f64>();
        let mean = (mean / dots.len().max(1) as f64) as f32;
        let radius = |dot: &Dot| {
            let side = (1.0 / crowd.density(dot.at).max(1e-6)).sqrt() / unit;
            unit * (SPLAT * side.sqrt()).clamp(RADII[0], RADII[1])
        };
        // the integral of a splat is a third of its disc
        let crowded = |dot: &Dot| crowd.density(dot.at) * FRAC_PI_3 * radius(dot).powi(2);
        let bright = brightness(dots.iter().map(crowded).collect());
        for dot in dots.iter() {
            let relative = (power(dot) / mean).clamp(POWERS[0], POWERS[1]);
            let amount = bright * relative * dot.clear;
            splats.add(dot.at, radius(dot), shines[dot.index].0, amount);
        }
    }

    /// Draws the paths that are asked for, and returns them.
    fn add_paths(&self, splats: &mut Splats, colours: &PhotonColours) -> Result<Paths> {
        let (paths, seed) = (self.job.paths, self.settings.seed);
        let paths = self.watched("paths", |control| {
            path_dots(self.scene, &self.viewpoint, paths, &self.band.bands, seed, control)
        })?;
        let unit = (self.viewpoint.camera.width as f32 / 800.0).max(1.0);
        for (dot, strength) in &paths.dots {
            let leg = &paths.legs[dot.index];
            let told = Told { light: leg.light, way: leg.way, last: leg.left, power: &leg.power };
            let amount = LINE_BRIGHT * strength * dot.clear / unit;
            splats.add(dot.at, LINE * unit, colours.of(&told), amount);
        }
        Ok(paths)
    }

    /// Returns the colours of photons, as asked for or chosen.
    fn colours_of_photons<'t>(&'t self, light: &SurfaceLight, ground: Ground) -> PhotonColours<'t> {
        let scene = self.scene;
        let bands = BandColours::new(scene.bands(), scene.quantity());
        let by = self.job.colour;
        // the light of the lamps themselves is white
        let white = bands.linear(&self.straight(light));
        let white =
            white.max(Vec3::splat(LEAST_WHITE * white.max_element().max(f32::MIN_POSITIVE)));
        let histories = light.map.histories as f64;
        let power = |index: usize| {
            let power = light.map.power(index);
            self.band.bands.iter().map(|&b| f64::from(power[b])).sum::<f64>() / histories
        };
        let powers: Vec<f64> = (0..light.map.photons.len()).map(power).collect();
        let most = powers.iter().copied().fold(0.0, f64::max);
        let scale = self.scale(powers, 0.999);
        let unit = scene.quantity().unit_names().flux;
        let legend = Legend { ground, ..self.legend("photon power", &unit, scale, most) };
        let kinds = scene.materials().iter().map(Kind::of).collect();
        PhotonColours { task: self, by, ground, bands, white, histories, scale, legend, kinds }
    }
}

/// Returns light as it is shown: dim enough nearly everywhere that photons stand out from it, and with
/// this share of its colour replaced by grey.
fn toned(mut light: Vec<Vec3>, grey: f32) -> Vec<Vec3> {
    let mut values: Vec<f32> =
        light.iter().map(|light| light.max_element()).filter(|value| *value > 0.0).collect();
    values.sort_unstable_by(f32::total_cmp);
    let Some(usual) = values.get((PLACE * values.len() as f64) as usize).copied() else {
        return light;
    };
    for light in &mut light {
        let value = light.max_element();
        if value > 0.0 {
            let colour = (*light / value).powf(VIVID).lerp(GREY, grey);
            *light = TOGETHER * (value / usual).powf(TONE) * colour;
        }
    }
    light
}

/// Keeps a share of the dots, the same of every place, if it is less than 1.
fn thin(dots: &mut Vec<Dot>, share: f32) {
    // multiples of the golden section are even within any run of photons
    let place = |index: usize| (index as f64 * 0.618_033_988_749_894_9).fract();
    dots.retain(|dot| place(dot.index) < f64::from(share));
}

/// Returns the light in the middle of a splat. `crowds` says, for each photon, how many splats lie
/// over each other where it is.
fn brightness(mut crowds: Vec<f32>) -> f32 {
    crowds.sort_unstable_by(f32::total_cmp);
    let crowded = |share: f64| {
        let place = (share * crowds.len().saturating_sub(1) as f64) as usize;
        crowds.get(place).copied().unwrap_or(0.0).max(f32::MIN_POSITIVE)
    };
    BRIGHT.min(COMMON / crowded(0.5)).min(CROWDED / crowded(0.98))
}

/// The least component of the light of lamps, relative to its greatest, for which colours make up.
const LEAST_WHITE: f32 = 0.1;
/// Exponent that makes the colours of photons clearer.
const CLEARER: f32 = 1.5;

/// How photons are coloured.
struct PhotonColours<'t> {
    task: &'t Task<'t>,
    by: PhotonColour,
    ground: Ground,
    bands: BandColours,
    /// The light of the lamps.
    white: Vec3,
    histories: f64,
    scale: Scale,
    legend: Legend,
    /// The kind of each material.
    kinds: Vec<Kind>,
}

/// The colours of light that came straight from a lamp; by mirrors and glass alone; after one
/// scattering, two, and more.
const WAYS: [(&str, [u8; 3]); 5] = [
    ("straight", [255, 205, 110]),
    ("focused", [110, 240, 255]),
    ("scattered once", [255, 92, 135]),
    ("twice", [176, 110, 255]),
    ("more often", [80, 130, 255]),
];
/// Colours of lamps, and of all further ones.
const LAMPS: [[u8; 3]; 9] = [
    [255, 200, 97],
    [92, 200, 255],
    [255, 111, 145],
    [139, 226, 139],
    [195, 155, 255],
    [255, 150, 80],
    [102, 224, 208],
    [230, 230, 120],
    [150, 155, 165],
];
/// The colour of light straight from lamps among the kinds of surfaces.
const STRAIGHT: [u8; 3] = [255, 244, 214];

fn rgb(bytes: [u8; 3]) -> Vec3 {
    linear(Vec3::from(bytes.map(f32::from)) / 255.0)
}

impl PhotonColours<'_> {
    /// Returns the colour of a photon, linear.
    fn of(&self, photon: &Told) -> Vec3 {
        match self.by {
            PhotonColour::Band => {
                let seen = self.bands.linear(photon.power) / self.white;
                let most = seen.max_element();
                // what no eye sees is grey
                if most > 0.0 { (seen / most).powf(CLEARER) } else { Vec3::splat(0.3) }
            }
            PhotonColour::Bounce => rgb(WAYS[way(photon.way)].1),
            PhotonColour::Lamp => rgb(LAMPS[photon.light.min(LAMPS.len() - 1)]),
            PhotonColour::Surface => {
                photon.last.map_or(rgb(STRAIGHT), |last| self.kinds[last].mark())
            }
            PhotonColour::Power => {
                let power = photon.power;
                let sum = self.task.band.bands.iter().map(|&b| f64::from(power[b])).sum::<f64>();
                linear(self.scale.colour(sum / self.histories))
            }
        }
    }

    /// Returns the share of grey in the light that photons make together: where a colour names a kind of
    /// photon, light of many kinds has none.
    fn grey(&self) -> f32 {
        match self.by {
            PhotonColour::Band | PhotonColour::Power => 0.0,
            PhotonColour::Bounce | PhotonColour::Lamp | PhotonColour::Surface => MOSTLY,
        }
    }

    /// Says what the colours mean.
    fn words(&self) -> &'static str {
        match self.by {
            PhotonColour::Band => "coloured by their bands: white as from the lamps",
            PhotonColour::Bounce => "coloured by their bounces",
            PhotonColour::Lamp => "coloured by their lamps",
            PhotonColour::Surface => "coloured by the surface that they come from",
            PhotonColour::Power => "coloured by their power",
        }
    }

    /// Returns the picture with what explains its colours; of the ways of photons those that are
    /// drawn.
    fn explained(&self, picture: Picture, ways: &HashSet<usize>) -> Result<Picture> {
        let scene = self.task.scene;
        let of = |(name, bytes): (&str, [u8; 3])| (name.to_string(), rgb(bytes));
        let (title, entries): (&str, Vec<(String, Vec3)>) = match self.by {
            PhotonColour::Band => return Ok(picture),
            PhotonColour::Power => return picture.with_bar(&self.legend),
            PhotonColour::Bounce => {
                let there = |i: &usize| ways.contains(i);
                ("light", (0..WAYS.len()).filter(there).map(|i| of(WAYS[i])).collect())
            }
            PhotonColour::Lamp => {
                let lights = scene.lights();
                let named = lights
                    .iter()
                    .zip(LAMPS)
                    .map(|(light, colour)| of((light.name.as_str(), colour)));
                let mut entries: Vec<_> = named.collect();
                if lights.len() > LAMPS.len() {
                    entries[LAMPS.len() - 1].0 = "others".into();
                }
                ("lamp", entries)
            }
            PhotonColour::Surface => {
                let there = |kind: &Kind| self.kinds.contains(kind);
                let kinds = Kind::ALL.into_iter().filter(there);
                let kinds = kinds.map(|kind| (kind.name().into(), kind.mark()));
                ("comes from", std::iter::once(of(("lamps", STRAIGHT))).chain(kinds).collect())
            }
        };
        let marked = |(name, colour)| (name, self.ground.mark(colour));
        let entries = entries.into_iter().map(marked).collect();
        picture.with_key(&Key { title: title.into(), entries, ground: self.ground })
    }
}

/// Returns the index of a way among [`WAYS`].
fn way(way: Way) -> usize {
    match way {
        Way { bounces: 0, mirrored: true, .. } => 1,
        Way { bounces: 0, .. } => 0,
        Way { bounces, .. } => 1 + usize::from(bounces.min(3)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Light is shown the brighter the more there is, in its hue, and nearly everywhere so dim that
    /// photons stand out from it, whatever its unit; where there is none, none is shown.
    #[test]
    fn light_is_toned_down() {
        let light = |i: u16| f32::from(i) * Vec3::new(1.0, 0.5, 0.0);
        for unit in [1.0, 1e-9, 1e6] {
            let shown = toned((0..=1000).map(|i| unit * light(i)).collect(), 0.0);
            assert_eq!(shown[0], Vec3::ZERO);
            assert!(shown.is_sorted_by(|a, b| a.x < b.x));
            assert!(shown[1..].iter().all(|light| light.x > light.y && light.z == 0.0));
            let dim = shown.iter().filter(|light| light.x <= 1.001 * TOGETHER).count();
            assert!((945..=955).contains(&dim), "{dim}");
        }
        assert_eq!(toned(vec![Vec3::ZERO; 3], 0.5), [Vec3::ZERO; 3]);
    }
}
