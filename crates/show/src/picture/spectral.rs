//! Turns values per band into colours that a screen can show.

use glam::{DMat3, DVec3, Mat3, Vec3};

use phylux_core::{math::units::Quantity, scene::world::Band};

/// The weight of each band in linear sRGB. An even spectrum (in W) from 400 to 700 nm is white.
#[derive(Clone, Debug, PartialEq)]
pub struct BandColours {
    weights: Vec<Vec3>,
    /// Whether all bands have wavelengths and at least one of them is visible; if not, their sum is
    /// grey.
    pub coloured: bool,
}

/// The matrix from XYZ to linear sRGB (IEC 61966-2-1).
const SRGB: Mat3 = Mat3::from_cols_array(&[
    3.2406, -0.9689, 0.0557, -1.5372, 1.8758, -0.2040, -0.4986, 0.0415, 1.0570,
]);

impl BandColours {
    /// Makes the weights for the bands of a scene: from their wavelengths if all bands have them
    /// and at least one is visible, otherwise equal weights.
    pub fn new(bands: &[Band], quantity: Quantity) -> Self {
        let white = SRGB * mean_response(400.0, 700.0, quantity);
        let weight = |band: &Band| {
            let response = mean_response(band.from_nm?, band.to_nm?, quantity);
            Some(SRGB * response / white)
        };
        let weights: Option<Vec<Vec3>> = bands.iter().map(weight).collect();
        match weights {
            Some(weights) if weights.iter().any(|w| w.abs().max_element() > 1e-3) => {
                Self { weights, coloured: true }
            }
            _ => Self { weights: vec![Vec3::ONE; bands.len()], coloured: false },
        }
    }

    /// Makes weights that show the sum of the `chosen` bands alone, as grey.
    pub fn grey(bands: usize, chosen: &[usize]) -> Self {
        let weight = |b| if chosen.contains(&b) { Vec3::ONE } else { Vec3::ZERO };
        Self { weights: (0..bands).map(weight).collect(), coloured: false }
    }

    /// Returns the indices of the bands that have any weight.
    pub fn visible(&self) -> Vec<usize> {
        (0..self.weights.len()).filter(|&band| self.weights[band] != Vec3::ZERO).collect()
    }

    /// Returns linear sRGB for values per band; a colour that no screen can show loses its negative
    /// components.
    pub fn linear(&self, values: &[f32]) -> Vec3 {
        let sum: Vec3 = self.weights.iter().zip(values).map(|(w, v)| *w * *v).sum();
        sum.max(Vec3::ZERO)
    }
}

/// Returns the mean response of the standard observer, XYZ, over a band with a flat spectrum: of
/// power, or for photons of their number.
fn mean_response(from: f64, to: f64, quantity: Quantity) -> Vec3 {
    const STEPS: u32 = 200;
    let response = |step: u32| {
        let nm = from + (to - from) * (f64::from(step) + 0.5) / f64::from(STEPS);
        let energy = match quantity {
            Quantity::Watt => 1.0,
            Quantity::Micromole => 550.0 / nm,
        };
        energy as f32 * matching(nm as f32)
    };
    (0..STEPS).map(response).sum::<Vec3>() / STEPS as f32
}

/// Returns the CIE 1931 colour matching functions, as sums of Gaussians (Wyman, Sloan and Shirley,
/// JCGT 2 (2), 2013, eq. 4).
fn matching(nm: f32) -> Vec3 {
    let lobe = |height: f32, middle: f32, below: f32, above: f32| {
        let width = if nm < middle { below } else { above };
        height * (-0.5 * ((nm - middle) / width).powi(2)).exp()
    };
    Vec3::new(
        lobe(1.056, 599.8, 37.9, 31.0)
            + lobe(0.362, 442.0, 16.0, 26.7)
            + lobe(-0.065, 501.1, 20.4, 26.2),
        lobe(0.821, 568.8, 46.9, 40.5) + lobe(0.286, 530.9, 16.3, 31.1),
        lobe(1.217, 437.0, 11.8, 36.0) + lobe(0.681, 459.0, 26.0, 13.8),
    )
}

/// The exposure of a picture: a value of 2^-stops is about white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposure {
    /// Stops; one more makes the picture twice as bright.
    pub stops: f64,
}

impl Exposure {
    /// Chooses the exposure for linear colours: all but the brightest tenth of the lit pixels are
    /// at most two thirds of white: lamps may fill some of it.
    pub fn of(colours: &[Vec3]) -> Self {
        let mut brightest: Vec<f32> =
            colours.iter().map(|c| c.max_element()).filter(|c| *c > 0.0).collect();
        if brightest.is_empty() {
            return Self { stops: 0.0 };
        }
        let place = (0.9 * (brightest.len() - 1) as f64) as usize;
        let (_, white, _) = brightest.select_nth_unstable_by(place, f32::total_cmp);
        // to a tenth of a stop, as it is reported to the user
        Self { stops: (-10.0 * f64::from(1.5 * *white).log2()).round() / 10.0 }
    }

    /// Returns the sRGB colour of a linear one, as film shows it: shadows are deep, middle tones are
    /// bright, and lights approach white without an edge, so that lamps and surfaces close to them
    /// keep their shapes. Bright light of one colour turns white, too, as its colour reaches all
    /// layers of a film: a red lamp has a white middle.
    pub fn srgb(self, linear: Vec3) -> Vec3 {
        let exposed = TO_FILM * (linear.as_dvec3() * self.stops.exp2());
        let developed = DVec3::from_array(exposed.to_array().map(filmic));
        let shown = (FROM_FILM * developed).clamp(DVec3::ZERO, DVec3::ONE);
        encoded(shown.as_vec3())
    }
}

/// From linear sRGB to the three layers of a film, in each of which a little of the other colours
/// counts, and back. Whites and greys stay as they are. These are the matrices that stand before and
/// behind the reference rendering transform of the Academy Color Encoding System, as Hill has fitted
/// it to sRGB (2016).
const TO_FILM: DMat3 = DMat3::from_cols_array_2d(&[
    [0.59719, 0.07600, 0.02840],
    [0.35458, 0.90834, 0.13383],
    [0.04823, 0.01566, 0.83777],
]);
const FROM_FILM: DMat3 = DMat3::from_cols_array_2d(&[
    [1.60475, -0.10208, -0.00327],
    [-0.53108, 1.10813, -0.07276],
    [-0.07367, -0.00605, 1.07602],
]);

/// Maps a value relative to white into [0, 1] by the S-shaped curve of films (Narkowicz 2016, a fit
/// to the reference rendering transform of the Academy Color Encoding System), which is cut off at
/// white.
fn filmic(value: f64) -> f64 {
    // greater values are white
    let v = value.clamp(0.0, 1e3);
    (v * (2.51 * v + 0.03) / (v * (2.43 * v + 0.59) + 0.14)).min(1.0)
}

/// Returns the sRGB colour of a linear one (IEC 61966-2-1).
pub fn encoded(linear: Vec3) -> Vec3 {
    Vec3::from_array(linear.to_array().map(encode))
}

/// Returns the linear colour of one in sRGB (IEC 61966-2-1).
pub fn linear(srgb: Vec3) -> Vec3 {
    let linear = |s: f32| if s <= 0.040_45 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) };
    Vec3::from_array(srgb.to_array().map(linear))
}

fn encode(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn band(from: f64, to: f64) -> Band {
        Band { name: String::new(), from_nm: Some(from), to_nm: Some(to) }
    }

    fn colour(bands: &[Band], values: &[f32]) -> Vec3 {
        BandColours::new(bands, Quantity::Watt).linear(values)
    }

    /// Even light is white, however it is divided into bands; the thirds are blue, green and red.
    #[test]
    fn bands_have_their_colours() {
        let thirds = [band(400.0, 500.0), band(500.0, 600.0), band(600.0, 700.0)];
        let white = colour(&thirds, &[1.0 / 3.0; 3]);
        assert!(white.distance(Vec3::ONE) < 1e-4, "{white}");
        assert_eq!(colour(&[band(400.0, 700.0)], &[2.0]), Vec3::splat(2.0));
        for (i, brightest) in [2, 1, 0].into_iter().enumerate() {
            let mut values = [0.0; 3];
            values[i] = 1.0;
            let c = colour(&thirds, &values);
            assert_eq!(c.max_element(), c[brightest], "{c}");
        }
    }

    /// The functions peak at 1.78 (z), 1.06 (x) and 1 (y at 555 nm), as those of 1931 do.
    #[test]
    fn the_eye_is_that_of_1931() {
        for (nm, known) in [
            (445.0, [0.348, 0.030, 1.783]),
            (555.0, [0.512, 1.0, 0.006]),
            (600.0, [1.062, 0.631, 0.001]),
        ] {
            let found = matching(nm);
            assert!(found.distance(Vec3::from(known)) < 0.05, "{nm}: {found}");
        }
    }

    /// An invisible band is black beside a visible one, and grey alone; bands without wavelengths
    /// are grey, too.
    #[test]
    fn infrared_is_dark_or_grey() {
        let both = [band(400.0, 700.0), band(1000.0, 2000.0)];
        assert!(colour(&both, &[0.0, 1.0]).max_element() < 1e-6);
        assert_eq!(colour(&both[1..], &[1.0]), Vec3::ONE);
        let unnamed = Band { name: "b0".into(), from_nm: None, to_nm: None };
        assert_eq!(colour(&[unnamed.clone(), unnamed], &[1.0, 2.0]), Vec3::splat(3.0));
    }

    /// A red and blue lamp that is far brighter than white has a middle that is nearly white; what it
    /// lights keeps its hue. Greys have no hue at any brightness.
    #[test]
    fn bright_colours_turn_white() {
        let shown = |linear: Vec3| Exposure { stops: 0.0 }.srgb(linear);
        let lamp = shown(Vec3::new(30.0, 0.0, 30.0));
        assert!(lamp.min_element() > 0.9, "{lamp}");
        let leaf = shown(Vec3::new(0.2, 0.0, 0.2));
        assert!(leaf.y < 0.25 * leaf.x && leaf.x > 0.4, "{leaf}");
        for grey in [0.01, 0.2, 1.0, 5.0] {
            let shown = shown(Vec3::splat(grey));
            assert!(shown.max_element() - shown.min_element() < 1e-4, "{shown}");
        }
    }

    #[test]
    fn a_stop_is_a_factor_of_two() {
        let exposure = Exposure::of(&[Vec3::splat(3.0); 10]);
        let white = exposure.stops.exp2() * 3.0;
        assert!((0.6..0.75).contains(&white), "{white}");
        let at = |value: f32| Exposure { stops: 1.0 }.srgb(Vec3::splat(value)).x;
        // a value of 1 relative to white becomes 2.54 / 3.16 = 0.8038; the limit is white, and a
        // greater value is never darker
        assert!((at(0.5) - encode(0.8038)).abs() < 1e-4, "{}", at(0.5));
        assert!(at(10.0) > 0.999 && (at(f32::INFINITY) - 1.0).abs() < 1e-6);
        let values: Vec<f32> = (0..200).map(|i| at(i as f32 / 100.0)).collect();
        assert!(values.is_sorted() && values[150] < values[199], "{values:?}");
        // deeper shadows and brighter middle tones than those of the light itself
        let plain = |value: f32| Exposure { stops: 0.0 }.srgb(Vec3::splat(value)).x - encode(value);
        assert!(plain(0.01) < -0.02 && plain(0.2) > 0.03, "{} {}", plain(0.01), plain(0.2));
        assert_eq!(Exposure::of(&[Vec3::ZERO]), Exposure { stops: 0.0 });
    }
}
