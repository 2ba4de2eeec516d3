//! Pictures of light: what a camera sees, and false colours.

use glam::Vec3;

use super::task::{Made, Task, photons_and_rays};
use phylux_core::error::Result;
use phylux_show::{
    picture::{BandColours, Exposure, Legend, PAPER, Picture, encoded, linear, with_glow},
    render::{Pixels, Show},
};

/// The largest light of a pixel that takes part in the glow, relative to white. The sun in a pane is
/// far brighter, and its glow would be a white disc.
const BRIGHTEST: f32 = 1000.0;

impl Task<'_> {
    pub fn radiance(&self) -> Result<Made> {
        let light = self.light()?;
        let fragments = self.fragments(&light, Show::Radiance)?;
        let colours = self.colours();
        let shown = self.shown(&fragments, &colours.visible())?.pixels();
        let pixels = fragments.pixels();
        let count = pixels.covered.len();
        let linear: Vec<Vec3> = (0..count).map(|i| colours.linear(shown.pixel(i))).collect();
        let chosen = self.arguments.exposure.map(|stops| Exposure { stops });
        let exposure = chosen.unwrap_or_else(|| Exposure::of(&linear));
        // nothing is so bright that its glow hides what is around it
        let brightest = BRIGHTEST * (-exposure.stops).exp2() as f32;
        let capped: Vec<Vec3> = linear.iter().map(|c| capped(*c, brightest)).collect();
        let glowing = with_glow(&capped, pixels.width);
        let picture = Picture::new(pixels.width, glowing.into_iter().map(|c| exposure.srgb(c)));
        let what = if colours.coloured { "bands by their wavelengths" } else { "grey" };
        let photons = photons_and_rays(&light, &fragments);
        let words = format!("{photons}, exposure {} stops, {what}\n", exposure.stops);
        Ok(Made { picture, pixels: Some(pixels), words })
    }

    fn colours(&self) -> BandColours {
        if self.band.named {
            return BandColours::grey(self.scene.bands().len(), &self.band.bands);
        }
        BandColours::new(self.scene.bands(), self.scene.quantity())
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
        let colours = shown.in_colours(PAPER, |values| linear(legend.scale.colour(value(values))));
        let pixels = fragments.pixels();
        let picture = Self::with_bar(pixels.width, colours, &legend)?;
        Ok(Made {
            picture,
            pixels: Some(pixels),
            words: photons_and_rays(&light, &fragments) + "\n",
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
            PAPER.lerp(linear(legend.scale.colour(value(pixels.pixel(i)))), *covered)
        };
        let colours = pixels.covered.iter().enumerate().map(colour).collect();
        let picture = Self::with_bar(pixels.width, colours, &legend)?;
        Ok(Made {
            picture,
            pixels: Some(pixels),
            words: photons_and_rays(&light, &fragments) + "\n",
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
