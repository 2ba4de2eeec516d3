//! Pictures of light: what a camera sees, and false colours.

use glam::Vec3;

use super::task::{Made, Task, photons_and_rays};
use phylux_core::{
    error::{Result, Words, setting},
    math::{geometry::Ray, spectrum::with_lanes},
    scene::{
        captor::{Captor, CaptorKind},
        material::{Interaction, Material, Scatterer},
    },
    transport::surface_light::SurfaceLight,
    words,
};
use phylux_show::{
    kinds::Kind,
    picture::{
        BandColours, Exposure, Legend, Metered, PAPER, Picture, WhiteBalance, encoded,
        linear as linear_of, with_glow,
    },
    render::{Fragments, Pixels, SENSOR, Seen, Show, bulbs, nearest_cell, rim, sensor},
};

/// The largest light of a pixel that takes part in the glow, relative to white. The sun in a pane
/// is far brighter, and its glow would be a white disc.
const BRIGHTEST: f32 = 1000.0;

/// The backdrop behind a scene without sky, at the top of a picture and at its bottom, sRGB.
const BACKDROP: [Vec3; 2] = [Vec3::new(0.20, 0.22, 0.25), Vec3::new(0.38, 0.40, 0.43)];
/// The light of a lamp that is a point or line, relative to white, and of one that shines
/// elsewhere.
const BULB: f32 = 60.0;
const UNLIT: f32 = 0.2;
/// More sensors than these are drawn by default only in scenes without plants, and those that take
/// up more than this share of the picture are not.
const FEW_SENSORS: usize = 12;
const LARGE_SENSORS: f32 = 0.1;
/// The share of what is behind a sensor that it hides.
const SENSOR_HIDES: f32 = 0.8;
/// The share of light that surfaces scatter where it is not known, and the least that is assumed.
const SCATTERED: [f32; 2] = [0.7, 0.05];

impl Task<'_> {
    pub fn radiance(&self) -> Result<Made> {
        let light = self.light()?;
        let fragments = self.fragments(&light, Show::Radiance)?;
        let colours = self.colours();
        let shown = self.shown(&fragments, &colours[0].visible())?;
        let balance = self.balance(&light, &colours[0]);
        let (sky, width) = (self.sky_colours(), self.viewpoint.camera.width);
        let is_up = |pixel: usize| {
            let [x, y] = [pixel % width, pixel / width].map(|at| at as f32 + 0.5);
            self.viewpoint.camera.ray(x, y).direction.z > 0.0
        };
        // what no known material sends has the colours of the first
        let of = |pixel: usize, seen: &Seen| {
            let of_sky = sky.as_ref().filter(|_| seen.is_beyond && is_up(pixel));
            let colours = of_sky
                .unwrap_or_else(|| &colours[seen.material.map_or(0, |material| 1 + material)]);
            balance.balanced(colours.linear(&seen.values))
        };
        let pixels = fragments.pixels();
        let count = shown.pixel_count();
        let mut linear: Vec<Vec3> = (0..count)
            .map(|pixel| shown.seen(pixel).map(|seen| seen.share * of(pixel, &seen)).sum())
            .collect();
        let scattered = self.scattered(&light);
        let part = |pixel: usize, found: Seen| {
            let scattered = scattered[found.material?]?;
            let seen = of(pixel, &found).max_element();
            Some(Metered { white: seen / scattered, seen, share: found.share })
        };
        let of_pixel = |pixel: usize| shown.seen(pixel).filter_map(move |of| part(pixel, of));
        let parts = || (0..count).flat_map(of_pixel).collect();
        let chosen = self.job.exposure.map(Exposure::asked);
        let exposure = chosen.unwrap_or_else(|| Exposure::metered(parts()));
        self.add_bulbs(&mut linear, exposure, |power| balance.balanced(colours[0].linear(power)));
        // nothing is so bright that its glow hides what is around it
        let brightest = BRIGHTEST * (-exposure.stops).exp2() as f32;
        let capped: Vec<Vec3> = linear.iter().map(|c| capped(*c, brightest)).collect();
        let glowing = with_glow(&capped, width).into_iter().map(|c| exposure.srgb(c));
        let open = self.open(&shown);
        let behind = |(pixel, colour): (usize, Vec3)| match open.get(pixel) {
            Some(share) if *share > 0.0 => {
                let down = (pixel / width) as f32 / (count / width) as f32;
                let backdrop = linear_of(BACKDROP[0].lerp(BACKDROP[1], down));
                encoded(linear_of(colour) + share * backdrop)
            }
            _ => colour,
        };
        let mut developed: Vec<Vec3> = glowing.enumerate().map(behind).collect();
        let sensors = match self.add_sensors(&mut developed)? {
            true => {
                words!["\nsensors are amber; ", setting("sensors").is("off"), " leaves them out"]
            }
            false => words![],
        };
        let picture = Picture::new(width, developed.into_iter());
        let photons = photons_and_rays(&light, &fragments);
        let colours = self.told_of_colours(&colours[0], balance);
        let exposed = format!("{photons}, exposure {} stops, ", exposure.stops);
        let words = words![exposed, colours, sensors, "\n"];
        Ok(Made { picture, pixels: Some(pixels), words })
    }

    /// Draws the lamps that are points or lines, brighter than white, in the colours that `colour`
    /// gives to their powers. Those that shine elsewhere are grey.
    fn add_bulbs(&self, linear: &mut [Vec3], exposure: Exposure, colour: impl Fn(&[f32]) -> Vec3) {
        let camera = &self.viewpoint.camera;
        let white = (-exposure.stops).exp2() as f32;
        for bulb in bulbs(&self.viewpoint, self.settings.seed) {
            let power = &self.scene.lights()[bulb.light].power;
            let colour = colour(&power.iter().map(|power| *power as f32).collect::<Vec<f32>>());
            let most = colour.max_element();
            let light = match bulb.shines && most > 0.0 {
                true => BULB * white * colour / most,
                false => Vec3::splat(UNLIT * white),
            };
            bulb.pixels([camera.width, camera.height], |pixel, share| {
                linear[pixel] = linear[pixel].lerp(light, share);
            });
        }
    }

    /// Draws sensors over a picture, sRGB, where they are wanted, and returns whether it did.
    fn add_sensors(&self, picture: &mut [Vec3]) -> Result<bool> {
        let is_sensor = |captor: &Captor| matches!(captor.kind, CaptorKind::Virtual { .. });
        let count = self.scene.captors().iter().filter(|captor| is_sensor(captor)).count();
        let has_plants = || self.scene.materials().iter().any(|m| Kind::of(m) == Kind::Plant);
        let wanted = self.job.sensors.unwrap_or_else(|| count <= FEW_SENSORS || !has_plants());
        if count == 0 || !wanted {
            return Ok(false);
        }
        // of a scene that repeats those of one cell
        let shown = self.scene.lattice().map(|_| nearest_cell(&self.viewpoint));
        let met = |ray: &Ray| {
            let met = sensor(&self.viewpoint, ray);
            let met = met.filter(|(_, cell)| shown.is_none_or(|shown| shown == *cell));
            met.map_or(Vec3::ZERO, |(cos, _)| Vec3::new(1.0, cos, 0.0))
        };
        let met = self.pixels(met)?;
        let shares: Vec<f32> = met.iter().map(|met| met.x).collect();
        let covered = shares.iter().sum::<f32>() / shares.len() as f32;
        if covered == 0.0 || (self.job.sensors.is_none() && covered > LARGE_SENSORS) {
            return Ok(false);
        }
        let rim = rim(&shares, self.viewpoint.camera.width);
        for (i, colour) in picture.iter_mut().enumerate().filter(|(i, _)| shares[*i] > 0.0) {
            let lit = 0.8 + 0.2 * met[i].y / shares[i];
            let shade = (lit * SENSOR[0]).lerp(SENSOR[1], rim[i] / shares[i]);
            *colour = colour.lerp(shade, SENSOR_HIDES * shares[i]);
        }
        Ok(true)
    }

    /// Returns the colours of bands, first for light of no material, then for that of each.
    fn colours(&self) -> Vec<BandColours> {
        let (bands, quantity) = (self.scene.bands(), self.scene.quantity());
        let materials = self.scene.materials();
        if self.band.named {
            return vec![BandColours::grey(bands.len(), &self.band.bands); 1 + materials.len()];
        }
        let kinds = std::iter::once(Kind::Other).chain(materials.iter().map(Kind::of));
        kinds.map(|kind| BandColours::of_kind(bands, quantity, kind)).collect()
    }

    /// Returns the colours of light from beyond all surfaces, where this is the sky alone.
    fn sky_colours(&self) -> Option<BandColours> {
        let is_sky = self.scene.lights().iter().all(|light| light.entrance().is_some());
        let (bands, quantity) = (self.scene.bands(), self.scene.quantity());
        (is_sky && !self.band.named).then(|| BandColours::of_sky(bands, quantity))
    }

    /// Returns the balance for the light that comes straight from lamps and sky.
    fn balance(&self, light: &SurfaceLight, colours: &BandColours) -> WhiteBalance {
        if self.job.white_balance == Some(false) || !colours.coloured {
            return WhiteBalance::NONE;
        }
        WhiteBalance::of(colours.linear(&self.straight(light)))
    }

    /// Returns the share of the light that each material scatters, on average over the visible
    /// bands; `None` for those that do not scatter diffusely.
    fn scattered(&self, light: &SurfaceLight) -> Vec<Option<f32>> {
        let visible = BandColours::new(self.scene.bands(), self.scene.quantity()).visible();
        let straight = Interaction::new(-Vec3::Z, Vec3::Z);
        let of = |material: &Material| {
            let absorbed = with_lanes!(light.scene.lanes(), L => {
                material.absorptance::<L>(&straight).map(|absorbed| {
                    visible.iter().map(|&band| absorbed.values()[band]).sum::<f32>()
                })
            });
            let absorbed = absorbed.map(|sum| sum / visible.len().max(1) as f32);
            absorbed.map_or(SCATTERED[0], |absorbed| (1.0 - absorbed).max(SCATTERED[1]))
        };
        let materials = self.scene.materials().iter();
        materials.map(|m| m.material.is_diffuse().then(|| of(&m.material))).collect()
    }

    /// Returns the share of each pixel beyond which there is nothing, not even a sky; empty where
    /// there is a sky. One looks through panes and glass.
    fn open(&self, shown: &Fragments) -> Vec<f32> {
        let is_open = |seen: &Seen| {
            seen.material
                .is_none_or(|material| self.scene.materials()[material].material.is_clear())
        };
        let all = || (0..shown.pixel_count()).flat_map(|pixel| shown.seen(pixel));
        let beyond = all().filter(|seen| seen.material.is_none()).map(|seen| {
            let is_lit = seen.values.iter().any(|value| *value > 0.0);
            [seen.share, if is_lit { seen.share } else { 0.0 }]
        });
        let [whole, lit] = beyond.fold([0.0; 2], |[a, b], [c, d]| [a + c, b + d]);
        if lit > 0.5 * whole || (whole == 0.0 && self.scene.has_daylight()) {
            return Vec::new();
        }
        let of = |pixel: usize| shown.seen(pixel).filter(is_open).map(|seen| seen.share).sum();
        (0..shown.pixel_count()).map(of).collect()
    }

    /// Says how bands became colours.
    fn told_of_colours(&self, colours: &BandColours, balance: WhiteBalance) -> Words {
        let told = match colours.coloured {
            _ if self.band.named => "grey",
            true => "bands by their wavelengths",
            false => "bands as one of white light",
        };
        let WhiteBalance(factors) = balance;
        let [red, green, blue] = (factors / factors.max_element()).to_array();
        match factors.max_element() / factors.min_element() > 1.1 {
            true => words![
                format!(
                    "{told}\nwhite balance: red x {red:.2}, green x {green:.2}, blue x {blue:.2}; "
                ),
                setting("white_balance").is("none"),
                " leaves the light its colour"
            ],
            false => words![told],
        }
    }

    pub fn false_colour(&self, show: Show) -> Result<Made> {
        let light = self.light()?;
        let fragments = self.fragments(&light, show)?;
        let shown = self.shown(&fragments, &self.band.bands)?;
        let value =
            |values: &[f32]| self.band.bands.iter().map(|&b| f64::from(values[b])).sum::<f64>();
        let what = match show {
            Show::Absorbed => "absorbed",
            _ => "irradiance",
        };
        let unit = self.scene.quantity().unit_names().irradiance;
        let legend = self.legend_of(&shown.pixels(), value, what, &unit);
        let colours =
            shown.in_colours(PAPER, |values| linear_of(legend.scale.colour(value(values))));
        let pixels = fragments.pixels();
        let picture = Self::with_bar(pixels.width, colours, &legend)?;
        Ok(Made {
            picture,
            pixels: Some(pixels),
            words: words![photons_and_rays(&light, &fragments), "\n"],
        })
    }

    /// Makes a picture of the relative standard error of the irradiance, in per cent.
    pub fn error(&self) -> Result<Made> {
        let light = self.light()?;
        let fragments = self.fragments(&light, Show::Error { bands: &self.band.bands })?;
        let pixels = fragments.errors(self.sampling.threads, self.denoises())?;
        let value = |values: &[f32]| 100.0 * f64::from(values[0]);
        let legend = self.legend_of(&pixels, value, "error", "%");
        let colour = |(i, covered): (usize, &f32)| {
            PAPER.lerp(linear_of(legend.scale.colour(value(pixels.pixel(i)))), *covered)
        };
        let colours = pixels.covered.iter().enumerate().map(colour).collect();
        let picture = Self::with_bar(pixels.width, colours, &legend)?;
        Ok(Made {
            picture,
            pixels: Some(pixels),
            words: words![photons_and_rays(&light, &fragments), "\n"],
        })
    }

    /// Returns a legend for the values of the pixels that show something. The brightest 5 % of them
    /// do not stretch its scale, for lamp housings are small and bright.
    fn legend_of(
        &self,
        pixels: &Pixels,
        value: impl Fn(&[f32]) -> f64,
        what: &str,
        unit: &str,
    ) -> Legend {
        let seen = (0..pixels.covered.len()).filter(|&i| pixels.covered[i] > 0.0);
        let values: Vec<f64> = seen.map(|i| value(pixels.pixel(i))).collect();
        let most = values.iter().copied().fold(0.0, f64::max);
        self.legend(what, unit, self.scale(values, 0.95), most)
    }

    /// Makes a picture of linear colours, with a colour bar.
    fn with_bar(width: usize, colours: Vec<Vec3>, legend: &Legend) -> Result<Picture> {
        Picture::new(width, colours.into_iter().map(encoded)).with_bar(legend)
    }
}

/// Returns a colour of the same hue whose largest component is at most `most`.
fn capped(colour: Vec3, most: f32) -> Vec3 {
    let largest = colour.max_element();
    if largest > most { colour * (most / largest) } else { colour }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is too bright keeps its hue, and all else stays as it is.
    #[test]
    fn bright_light_is_capped() {
        assert_eq!(capped(Vec3::new(4000.0, 2000.0, 0.0), 1000.0), Vec3::new(1000.0, 500.0, 0.0));
        for light in [Vec3::ZERO, Vec3::new(1000.0, 2.0, 1.0)] {
            assert_eq!(capped(light, 1000.0), light);
        }
    }
}
