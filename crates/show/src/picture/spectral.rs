//! Turns values per band into colours that a screen can show.

use glam::{DMat3, DVec3, Mat3, Vec3};

use crate::kinds::Kind;
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

/// A band that is wider than this, nm, does not tell the colours of things.
const BROAD: f64 = 120.0;
/// The power of the wavelength with which the light of a sky falls.
const SKY: f32 = 2.0;

impl BandColours {
    /// Makes the weights for the bands of a scene: from their wavelengths, or from those that a
    /// name such as `PAR` or `red` stands for, if all bands have them and at least one is visible;
    /// otherwise equal weights.
    pub fn new(bands: &[Band], quantity: Quantity) -> Self {
        Self::of_kind(bands, quantity, Kind::Other)
    }

    /// Makes the weights for light that comes from a surface of a kind. In bands of more than 120
    /// nm this light has the spectrum in which such surfaces typically reflect even light, so that
    /// leaves are green and soil is brown; its sum over the band stays as it is. Bands of which
    /// nothing is known are taken for one of visible light.
    pub fn of_kind(bands: &[Band], quantity: Quantity, kind: Kind) -> Self {
        Self::typical(bands, quantity, &|nm| kind.reflectance(nm))
    }

    /// Makes the weights for light of a sky that is seen itself: in bands of more than 120 nm it is as
    /// blue as that of a fair day.
    pub fn of_sky(bands: &[Band], quantity: Quantity) -> Self {
        Self::typical(bands, quantity, &|nm| (nm / 400.0).powf(-SKY))
    }

    /// Makes weights for light that has a typical spectrum in bands of more than 120 nm.
    fn typical(bands: &[Band], quantity: Quantity, spectrum: &dyn Fn(f32) -> f32) -> Self {
        let even = |_: f32| 1.0;
        let white = SRGB * mean_response(400.0, 700.0, quantity, &even);
        let colour = |[from, to]: [f64; 2]| {
            let spectrum = if to - from > BROAD { spectrum } else { &even };
            SRGB * mean_response(from, to, quantity, spectrum) / white
        };
        let weights: Option<Vec<Vec3>> =
            bands.iter().map(|band| wavelengths(band).map(colour)).collect();
        match weights {
            Some(weights) if weights.iter().any(|w| w.abs().max_element() > 1e-3) => {
                Self { weights, coloured: true }
            }
            _ => Self { weights: vec![colour([400.0, 700.0]); bands.len()], coloured: false },
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

/// Returns the wavelengths of a band, nm: its own, or those that its name stands for.
fn wavelengths(band: &Band) -> Option<[f64; 2]> {
    if let (Some(from), Some(to)) = (band.from_nm, band.to_nm) {
        return Some([from, to]);
    }
    const NAMES: [(&str, [f64; 2]); 7] = [
        ("par", [400.0, 700.0]),
        ("blue", [400.0, 500.0]),
        ("green", [500.0, 600.0]),
        ("red", [600.0, 700.0]),
        ("far-red", [700.0, 800.0]),
        ("far red", [700.0, 800.0]),
        ("nir", [700.0, 1000.0]),
    ];
    let name = band.name.to_lowercase();
    NAMES.iter().find(|(known, _)| *known == name).map(|(_, range)| *range)
}

/// Returns the mean response of the standard observer, XYZ, to light of a spectrum over a band,
/// relative to light that is even: in power, or for photons in their number.
fn mean_response(from: f64, to: f64, quantity: Quantity, spectrum: &dyn Fn(f32) -> f32) -> Vec3 {
    const STEPS: u32 = 200;
    let (mut sum, mut weights) = (Vec3::ZERO, 0.0);
    for step in 0..STEPS {
        let nm = from + (to - from) * (f64::from(step) + 0.5) / f64::from(STEPS);
        let energy = match quantity {
            Quantity::Watt => 1.0,
            Quantity::Micromole => 550.0 / nm,
        };
        let weight = spectrum(nm as f32);
        sum += weight * energy as f32 * matching(nm as f32);
        weights += weight;
    }
    sum / weights
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
    /// Light of all surfaces, as a fraction of white, that is taken for haze: black is there.
    pub black: f32,
}

/// What a light meter reads at a part of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metered {
    /// The value that a white surface would have in the place of what is seen.
    pub white: f32,
    /// The value that is seen: the greatest of red, green and blue.
    pub seen: f32,
    /// The share of the picture that this part takes up.
    pub share: f32,
}

/// White surfaces come to white, and the middle of what is seen to this fraction of it. An exposure
/// is between both, and this far from the first, in stops.
const MIDDLE: f64 = 0.1;
const SEEN: f64 = 0.2;
/// Four fifths of the white surfaces come to no more than this.
const WHITEST: f64 = 1.3;
/// Nineteen of twenty parts of the picture come to no more than this, so that large bright surfaces
/// keep their shades.
const BRIGHTEST: f64 = 0.65;
/// These parts come to no less than this: a field of dark soil is not a dark picture.
const BRIGHT: f64 = 0.17;
/// What is more than so many times as bright as white surfaces is a lamp in front of them.
const LAMP: f64 = 4.0;
/// Black is where one in 200 parts of the picture is darker, but no higher than these fractions of
/// the middle, of white, and of what one in 20 has: evenly lit surfaces and shadows stay as light as
/// they are.
const DARK: f64 = 0.005;
const SHADE: f64 = 0.05;
const BLACKEST: [f64; 3] = [0.2, 0.03, 0.2];

impl Exposure {
    /// Makes an exposure that a user asks for, which takes nothing for haze.
    pub fn asked(stops: f64) -> Self {
        Self { stops, black: 0.0 }
    }

    /// Chooses the exposure as two light meters do, one for what arrives and one for what is seen.
    /// So what is lit well looks as light as it is, leaves and soil are not too dark, and white
    /// benches are not so bright that they lose their shades. Parts of value 0 are left out.
    pub fn metered(mut parts: Vec<Metered>) -> Self {
        let is_lit = |value: f32| value.is_finite() && value > 0.0;
        parts.retain(|part| is_lit(part.white) && is_lit(part.seen));
        if parts.is_empty() {
            return Self::asked(0.0);
        }
        let white = quantile(&mut parts, |part| part.white, 0.8);
        parts.retain(|part| f64::from(part.white) <= LAMP * white);
        let [dark, shade, middle, bright] =
            [DARK, SHADE, 0.5, 0.95].map(|place| quantile(&mut parts, |part| part.seen, place));
        let between = (MIDDLE / middle).powf(SEEN) * white.powf(SEEN - 1.0);
        let factor = between.min(WHITEST / white).min(BRIGHTEST / bright).max(BRIGHT / bright);
        let black = dark.min(BLACKEST[0] * middle).min(BLACKEST[2] * shade) * factor;
        // to a tenth of a stop, as it is reported to the user
        let stops = (10.0 * factor.log2()).round() / 10.0;
        Self { stops, black: black.min(BLACKEST[1]) as f32 }
    }

    /// Returns the sRGB colour of a linear one, as film shows it: shadows are deep, middle tones
    /// are bright, and lights approach white without an edge, so that lamps and surfaces close to
    /// them keep their shapes. Bright light of one colour turns white, too, as its colour reaches
    /// all layers of a film: a red lamp has a white middle.
    pub fn srgb(self, linear: Vec3) -> Vec3 {
        let black = f64::from(self.black);
        let clear = (linear.as_dvec3() * self.stops.exp2() - black) / (1.0 - black);
        let exposed = TO_FILM * clear.max(DVec3::ZERO);
        let developed = DVec3::from_array(exposed.to_array().map(filmic));
        let shown = (FROM_FILM * developed).clamp(DVec3::ZERO, DVec3::ONE);
        encoded(shown.as_vec3())
    }
}

/// Returns the value that this share of all parts does not exceed.
fn quantile(parts: &mut [Metered], value: impl Fn(&Metered) -> f32, place: f64) -> f64 {
    parts.sort_unstable_by(|a, b| value(a).total_cmp(&value(b)));
    let all: f64 = parts.iter().map(|part| f64::from(part.share)).sum();
    let mut sum = 0.0;
    let found = parts.iter().find(|part| {
        sum += f64::from(part.share);
        sum >= place * all
    });
    f64::from(found.or(parts.last()).map_or(0.0, value))
}

/// Factors of red, green and blue that take a cast from a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WhiteBalance(pub Vec3);

/// How warm or cool light may stay, in stops between red and blue. Light that lacks so much green,
/// in stops, beside the mean of red and blue, is of no flame and no sky: little of its warmth stays.
const WARMTH: f32 = 0.9;
const PINK: f32 = 0.4;
/// The largest factor between two colours, stops.
const MOST_BALANCE: f32 = 3.5;

impl WhiteBalance {
    /// Leaves colours as they are.
    pub const NONE: Self = Self(Vec3::ONE);

    /// Balances the light of lamps and sky, linear sRGB, as cameras do: what is pink or green in it
    /// vanishes, and so does what is warmer or cooler than an evening or the shade. Light of that
    /// kind stays warm or cool. Light without any colour of its own stays as it is.
    pub fn of(light: Vec3) -> Self {
        let most = light.max_element();
        if !(most.is_finite() && most > 0.0) {
            return Self::NONE;
        }
        let logs = (light / most).max(Vec3::splat((-MOST_BALANCE).exp2())).map(f32::log2);
        let warm = logs.x - logs.z;
        let lacks_green = (0.5 * (logs.x + logs.z) - logs.y).max(0.0);
        let natural = (-(lacks_green / PINK).powi(2)).exp();
        let kept = natural * warm.clamp(-WARMTH, WARMTH);
        // the colour that the light is left with, of the same brightness
        let left = Vec3::new(0.5 * kept, 0.0, -0.5 * kept);
        let factors = (left - logs).map(f32::exp2);
        let luminance = |colour: Vec3| colour.dot(Vec3::new(0.2126, 0.7152, 0.0722));
        Self(factors * (luminance(light) / luminance(light * factors)).max(0.0))
    }

    /// Returns a colour, linear sRGB, as it looks in the balanced picture.
    pub fn balanced(self, colour: Vec3) -> Vec3 {
        self.0 * colour
    }
}

/// From linear sRGB to the three layers of a film, in each of which a little of the other colours
/// counts, and back. Whites and greys stay as they are. These are the matrices that stand before
/// and behind the reference rendering transform of the Academy Color Encoding System, as Hill has
/// fitted it to sRGB (2016).
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
        assert!(colour(&[band(400.0, 700.0)], &[2.0]).distance(Vec3::splat(2.0)) < 1e-4);
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
        assert!(colour(&both[1..], &[1.0]).distance(Vec3::ONE) < 1e-4);
        let unnamed = Band { name: "b0".into(), from_nm: None, to_nm: None };
        let sum = colour(&[unnamed.clone(), unnamed], &[1.0, 2.0]);
        assert!(sum.distance(Vec3::splat(3.0)) < 1e-4, "{sum}");
    }

    /// In one band of 400 to 700 nm leaves are green and soil is brown, and walls stay white; so
    /// they are in bands of which nothing is known but a name. Bands of 100 nm tell their own
    /// colours.
    #[test]
    fn broad_bands_have_the_colours_of_kinds() {
        let named = |name: &str| Band { name: name.into(), from_nm: None, to_nm: None };
        for band in [band(400.0, 700.0), named("PAR"), named("b0")] {
            let of = |kind| {
                BandColours::of_kind(std::slice::from_ref(&band), Quantity::Watt, kind)
                    .linear(&[1.0])
            };
            let leaf = of(Kind::Plant);
            assert!(leaf.y > 1.3 * leaf.x && leaf.y > 1.8 * leaf.z, "{leaf}");
            let soil = of(Kind::Soil);
            assert!(soil.x > 1.2 * soil.y && soil.y > 1.2 * soil.z, "{soil}");
            assert!(of(Kind::Other).distance(Vec3::ONE) < 1e-4);
        }
        let thirds = [band(400.0, 500.0), band(500.0, 600.0), band(600.0, 700.0)];
        let of = |kind| BandColours::of_kind(&thirds, Quantity::Watt, kind);
        assert_eq!(of(Kind::Plant), of(Kind::Other));
        assert_eq!(BandColours::of_sky(&thirds, Quantity::Watt), of(Kind::Other));
        let sky = BandColours::of_sky(&[band(400.0, 700.0)], Quantity::Watt).linear(&[1.0]);
        assert!(sky.z > 1.2 * sky.y && sky.y > 1.1 * sky.x && sky.x > 0.4, "{sky}");
    }

    /// Pink light becomes white, as do green light and that of a sodium lamp to some degree; the
    /// light of an evening keeps its warmth, and brightness stays.
    #[test]
    fn casts_are_balanced_and_evenings_stay_warm() {
        let pink = Vec3::new(1.0, 0.2, 0.7);
        let balanced = WhiteBalance::of(pink).balanced(pink);
        assert!(balanced.max_element() < 1.45 * balanced.min_element(), "{balanced}");
        let luminance = |c: Vec3| c.dot(Vec3::new(0.2126, 0.7152, 0.0722));
        assert!((luminance(balanced) / luminance(pink) - 1.0).abs() < 1e-4);
        // neither red nor blue are without green between them
        assert!((balanced.y - (balanced.x * balanced.z).sqrt()).abs() < 1e-4, "{balanced}");
        // no flame is pink, however red it is
        let diodes = Vec3::new(1.0, 0.12, 0.35);
        let balanced = WhiteBalance::of(diodes).balanced(diodes);
        assert!(balanced.max_element() < 1.05 * balanced.min_element(), "{balanced}");
        let evening = Vec3::new(1.0, 0.8, 0.62);
        let balanced = WhiteBalance::of(evening).balanced(evening);
        assert!(balanced.x > 1.5 * balanced.z, "{balanced}");
        for light in [Vec3::ZERO, Vec3::splat(f32::NAN), Vec3::splat(f32::INFINITY)] {
            assert_eq!(WhiteBalance::of(light), WhiteBalance::NONE);
        }
        assert!(WhiteBalance::of(Vec3::splat(0.3)).0.distance(Vec3::ONE) < 1e-5);
    }

    /// A red and blue lamp that is far brighter than white has a middle that is nearly white; what
    /// it lights keeps its hue. Greys have no hue at any brightness.
    #[test]
    fn bright_colours_turn_white() {
        let shown = |linear: Vec3| Exposure::asked(0.0).srgb(linear);
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
        let at = |value: f32| Exposure::asked(1.0).srgb(Vec3::splat(value)).x;
        // a value of 1 relative to white becomes 2.54 / 3.16 = 0.8038; the limit is white, and a
        // greater value is never darker
        assert!((at(0.5) - encode(0.8038)).abs() < 1e-4, "{}", at(0.5));
        assert!(at(10.0) > 0.999 && (at(f32::INFINITY) - 1.0).abs() < 1e-6);
        let values: Vec<f32> = (0..200).map(|i| at(i as f32 / 100.0)).collect();
        assert!(values.is_sorted() && values[150] < values[199], "{values:?}");
        // deeper shadows and brighter middle tones than those of the light itself
        let plain = |value: f32| Exposure::asked(0.0).srgb(Vec3::splat(value)).x - encode(value);
        assert!(plain(0.01) < -0.02 && plain(0.2) > 0.03, "{} {}", plain(0.01), plain(0.2));
    }

    /// Returns parts of a picture of equal size, of surfaces that scatter this share of the light,
    /// in so much light.
    fn parts(surfaces: &[(f32, f32)]) -> Vec<Metered> {
        let part = |(scatters, light): &(f32, f32)| Metered {
            white: *light,
            seen: scatters * light,
            share: 1.0 / surfaces.len() as f32,
        };
        surfaces.iter().map(part).collect()
    }

    /// Whatever a scene is lit with: a room of white walls, one of grey walls, and a field keep
    /// their shades below white, each is shown in its order of brightness, and no one is dark.
    #[test]
    fn an_exposure_suits_white_rooms_and_fields() {
        for light in [1e-6, 1.0, 3e4] {
            let shown = |scatters: f32| {
                let shades: Vec<(f32, f32)> =
                    (1..=100).map(|i| (scatters, light * (0.5 + 0.005 * i as f32))).collect();
                let exposure = Exposure::metered(parts(&shades));
                [0.505, 0.75, 1.0].map(|l| exposure.srgb(Vec3::splat(scatters * light * l)).x)
            };
            let [white, grey, field] = [0.9, 0.5, 0.1].map(shown);
            for shades in [white, grey, field] {
                assert!(shades.is_sorted() && shades[2] < 0.87, "{light}: {shades:?}");
                assert!(shades[2] - shades[0] > 0.05 && shades[1] > 0.28, "{light}: {shades:?}");
            }
            assert!(white[1] > grey[1] && grey[1] > field[1], "{white:?} {grey:?} {field:?}");
        }
        assert_eq!(Exposure::metered(parts(&[(0.5, 0.0)])), Exposure::asked(0.0));
        assert_eq!(Exposure::metered(Vec::new()), Exposure::asked(0.0));
    }

    /// A lamp in the picture does not darken the rest, and neither does a white bench that takes
    /// up a third of the picture lose its shades.
    #[test]
    fn bright_parts_do_not_rule_a_picture() {
        let leaves: Vec<(f32, f32)> = (1..=100).map(|i| (0.1, 0.5 + 0.005 * i as f32)).collect();
        let plain = Exposure::metered(parts(&leaves)).stops;
        // also if it takes up a tenth of the picture, as tubes do
        let spots = [leaves.clone(), vec![(0.1, 300.0); 11]].concat();
        assert!((Exposure::metered(parts(&spots)).stops - plain).abs() < 0.15);
        let bench: Vec<(f32, f32)> = (1..=50).map(|i| (0.88, 0.5 + 0.01 * i as f32)).collect();
        let exposure = Exposure::metered(parts(&[leaves, bench].concat()));
        let at = |value: f32| exposure.srgb(Vec3::splat(value)).x;
        assert!(at(0.88) < 0.87 && at(0.88) - at(0.7) > 0.02, "{} {}", at(0.88), at(0.7));
        assert!(at(0.1) > 0.2, "{}", at(0.1));
    }

    /// Haze over a whole picture is taken away, as far as shadows tell of it; a wide shadow keeps at
    /// least four fifths of its light.
    #[test]
    fn shadows_are_black() {
        let lit: Vec<(f32, f32)> = (0..98).map(|i| (0.1, 0.8 + 0.002 * i as f32)).collect();
        let hazy = [lit, vec![(0.1, 0.1), (0.1, 0.12)]].concat();
        let exposure = Exposure::metered(parts(&hazy));
        assert!(exposure.srgb(Vec3::splat(0.01)).x < 0.03, "{exposure:?}");
        assert!(exposure.srgb(Vec3::splat(0.09)).x > 0.33, "{exposure:?}");
        let shaded = [vec![(0.1, 1.0); 80], vec![(0.1, 0.1); 20]].concat();
        let exposure = Exposure::metered(parts(&shaded));
        let shade = 0.01 * exposure.stops.exp2() as f32;
        assert!(exposure.black > 0.0 && exposure.black < 0.22 * shade, "{exposure:?}");
    }
}
