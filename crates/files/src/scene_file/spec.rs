//! The description of a scene, as a scene file or a program gives it: the types that serde reads
//! JSON into, and that `phylux schema` makes the JSON Schema of. Their doc comments are the
//! descriptions in that schema. Nothing is checked here beyond keys and types: ranges are checked
//! when the scene is [built](crate::SceneBuilder::build).

mod make;

use std::{collections::BTreeMap, fmt};

use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, de};

use crate::json::{one_of, tagged};
use phylux_core::{
    math::{
        units::{LengthUnit, Quantity},
        weighting::{RATIOS, SUMS},
    },
    scene::light::known_spectra,
    transport::settings::{Estimator, Guiding},
};

/// A phylux scene.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SceneSpec {
    /// Where an editor finds the JSON Schema; phylux does not read it.
    #[serde(rename = "$schema")]
    pub _schema: Option<String>,
    /// Title (default: the file's name without extension).
    pub name: Option<String>,
    /// Unit of every length in the scene, in its OBJ files and in its captor files (default m).
    #[serde(default)]
    pub unit: LengthUnit,
    /// Quantity that power and flux are measured in (default W).
    #[serde(default)]
    pub quantity: Quantity,
    /// Wavelength intervals, all traced in one pass (default: one named `all`).
    pub bands: Option<Vec<BandSpec>>,
    /// Totals over bands, reported like bands: name of the total -> names of its bands, their
    /// weights, or the name of a weighting by wavelength.
    #[serde(default)]
    pub sums: IndexMap<String, SumSpec>,
    /// Ratios of totals over bands: name of the ratio -> its numerator and denominator, or the name
    /// of a known ratio.
    #[serde(default)]
    pub ratios: IndexMap<String, RatioSpec>,
    /// Whether surfaces say what they absorbed of the light on each face (default false).
    #[serde(default)]
    pub absorbed_by_face: bool,
    /// Whether captors say which share of their area the sun shines on (default false).
    #[serde(default)]
    pub sunlit: bool,
    /// The materials and lights of which results say how much they depend on them: true for all, or a
    /// list of names (default false).
    #[serde(default)]
    pub sensitivity: SensitivitySpec,
    /// How uncertain inputs are: pointer into the scene file, as `sensitivity` of results names it ->
    /// standard deviation of the number there. Results say how uncertain that makes them.
    #[serde(default)]
    pub uncertain: IndexMap<String, UncertainSpec>,
    /// How spectra are averaged over each band.
    #[serde(default)]
    pub spectra: SpectraSpec,
    /// Materials by name.
    #[serde(default)]
    pub materials: BTreeMap<String, MaterialSpec>,
    /// Surfaces.
    #[serde(default)]
    pub objects: Vec<ObjectSpec>,
    /// Lights; at least one.
    #[serde(default)]
    #[schemars(length(min = 1))]
    pub lights: Vec<LightSpec>,
    /// Sensors that do not disturb light.
    #[serde(default)]
    pub captors: Vec<CaptorSpec>,
    /// Groups of captors by their ids: name -> a pattern or a list of patterns, in which `*` stands
    /// for any characters.
    #[serde(default)]
    pub groups: BTreeMap<String, Patterns>,
    /// The cell of a scene that repeats for ever: surfaces, captors, lights, sun and sky.
    pub periodic: Option<PeriodicSpec>,
    /// Layers in which the light that surface captors absorb is summed.
    pub layers: Option<LayersSpec>,
    /// Defaults of a run; options of the command line override them.
    #[serde(default)]
    pub settings: SettingsSpec,
    /// The view to render as a picture.
    pub camera: Option<CameraSpec>,
    /// Where on the earth the scene is, and where its north lies; +z is up.
    pub site: Option<SiteSpec>,
    /// When the scene is: an ISO 8601 time with offset, a period, or "year".
    pub time: Option<TimeSpec>,
    /// Irradiances of the whole solar spectrum, or a file of them.
    pub weather: Option<WeatherSpec>,
    /// Where the sun stands, in place of `site` and `time`.
    pub sun_at: Option<SunAtSpec>,
}

/// The materials and lights of which results say how much they depend on them.
#[derive(Debug, Default, JsonSchema)]
#[schemars(untagged)]
pub enum SensitivitySpec {
    /// None.
    #[default]
    #[schemars(skip)]
    Off,
    /// All.
    #[schemars(with = "bool")]
    All,
    /// Those of these names.
    Of(Vec<String>),
}

one_of! {
    SensitivitySpec: "true, false or a list of names of materials and lights",
    flag(on) => if on { SensitivitySpec::All } else { SensitivitySpec::Off },
    list(names) => SensitivitySpec::Of(names),
}

/// The standard deviation of an input: in its unit, or as a share of 1 where no number of the scene
/// file stands for it.
#[derive(Debug, JsonSchema)]
#[schemars(untagged)]
pub enum UncertainSpec {
    /// Of an input that varies by itself.
    Alone(DeviationSpec),
    /// Of an input that varies together with another.
    Together(TogetherSpec),
}

/// The standard deviation of an input that varies together with another.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TogetherSpec {
    /// The standard deviation; a negative one where the input falls as the other rises.
    pub deviation: DeviationSpec,
    /// The other input, which is uncertain too.
    pub with: String,
}

/// A standard deviation: one number for all bands, or an array with one number per band.
#[derive(Debug, JsonSchema)]
#[schemars(untagged)]
pub enum DeviationSpec {
    /// The same in all bands.
    All(f64),
    /// One for each band.
    Each(Vec<f64>),
}

one_of! {
    DeviationSpec: "a number, or an array with one number per band",
    number(all) => DeviationSpec::All(all),
    list(each) => DeviationSpec::Each(each),
}

one_of! {
    UncertainSpec: "a standard deviation: a number, or an array with one number per band, or {\"deviation\": ..., \"with\": ...}",
    number(all) => UncertainSpec::Alone(DeviationSpec::All(all)),
    list(each) => UncertainSpec::Alone(DeviationSpec::Each(each)),
    object(together) => UncertainSpec::Together(together),
}

/// The cell of a scene that repeats.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PeriodicSpec {
    /// Ends of the cell along x, the lower one first, in the scene's unit; left out, the scene does
    /// not repeat along x.
    pub x: Option<[f64; 2]>,
    /// Ends of the cell along y.
    pub y: Option<[f64; 2]>,
    /// By how much the ground rises over one period along x and along y (default [0, 0]).
    #[serde(default)]
    pub slope: [f64; 2],
}

/// Layers of equal height, of which one begins at the height 0.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LayersSpec {
    /// Height of a layer, in the scene's unit.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub dz: f64,
}

/// A place on the earth.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SiteSpec {
    /// Latitude in degrees; north is positive.
    pub latitude: Option<f64>,
    /// Longitude in degrees; east is positive.
    pub longitude: Option<f64>,
    /// Vector that points north (default [0, 1, 0]); its z does not matter.
    pub north: Option<[f64; 3]>,
}

/// Where the sun stands.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SunAtSpec {
    /// Elevation in degrees above the horizon.
    #[schemars(range(min = -90, max = 90))]
    pub elevation_deg: f64,
    /// Azimuth in degrees clockwise from north: east is 90.
    pub azimuth_deg: f64,
}

/// An instant, a period or a year.
#[derive(Debug, JsonSchema)]
#[schemars(untagged)]
pub enum TimeSpec {
    /// ISO 8601 with offset, or "year".
    Text(String),
    /// A period of time.
    Span {
        /// Start of the period.
        from: String,
        /// End of the period, not included.
        to: String,
    },
}

/// The keys of [`TimeSpec::Span`].
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Span {
    from: String,
    to: String,
}

one_of! {
    TimeSpec: "a time, {\"from\", \"to\"} or \"year\"",
    text(text) => TimeSpec::Text(text),
    object(Span { from, to }) => TimeSpec::Span { from, to },
}

/// Irradiances of the whole solar spectrum, W/m2, or a file of them.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WeatherSpec {
    /// Direct irradiance of a plane that faces the sun, W/m2.
    #[schemars(range(min = 0, max = 2000))]
    pub direct_normal: Option<f64>,
    /// Diffuse irradiance of a horizontal plane, W/m2.
    #[schemars(range(min = 0, max = 2000))]
    pub diffuse_horizontal: Option<f64>,
    /// Weather file: EPW, TMY3, TMY2, a table of PVGIS, NSRDB, Open-Meteo or NASA POWER, or CSV
    /// (columns time, ghi, dni, dhi).
    pub file: Option<String>,
    /// How many hours the clock of the file is put forward (default 0).
    pub shift_h: Option<f64>,
    /// For a CSV file or another table: which moment of its interval the time of a row is.
    pub stamp: Option<StampSpec>,
}

/// Which moment of its interval the time of a row is.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum StampSpec {
    /// The start of the interval.
    Start,
    /// The middle of the interval.
    Middle,
    /// The end of the interval.
    End,
}

/// A wavelength interval.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BandSpec {
    /// Unique name.
    pub name: String,
    /// Shortest wavelength, nm.
    pub from_nm: Option<f64>,
    /// Longest wavelength, nm.
    pub to_nm: Option<f64>,
}

/// A total over bands.
#[derive(Clone, Debug, PartialEq, JsonSchema)]
#[schemars(untagged)]
pub enum SumSpec {
    /// Names of bands, each of which counts as it is.
    Bands(Vec<String>),
    /// A weighting by wavelength, of all bands. In a ratio also the name of a band or of a sum.
    Name(#[schemars(extend("examples" = SUMS.map(|(name, _)| name)))] String),
    /// A weighting by wavelength, of some of the bands.
    Some(SomeBandsSpec),
    /// The photons or the energy of a window of wavelengths, of all bands.
    Window(WindowSpec),
    /// A weight for each of some bands, by their names.
    Weights(#[schemars(with = "BTreeMap<String, WeightSpec>")] BTreeMap<String, f64>),
}

/// A weighting by wavelength, of some of the bands.
#[derive(Clone, Debug, PartialEq, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct SomeBandsSpec {
    /// Name of the weighting.
    #[schemars(extend("examples" = SUMS.map(|(name, _)| name)))]
    pub weighting: String,
    /// Names of the bands.
    pub bands: Vec<String>,
}

/// A window of wavelengths.
#[derive(Clone, Debug, PartialEq, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct WindowSpec {
    /// Wavelength where the window begins, nm.
    pub from_nm: f64,
    /// Wavelength where the window ends, nm.
    pub to_nm: f64,
    /// What is counted: photons, umol/s (default), or energy, W.
    pub quantity: Option<Quantity>,
}

/// The weight of a band.
#[derive(JsonSchema)]
#[schemars(transparent)]
struct WeightSpec(
    #[schemars(range(min = 0))]
    #[allow(dead_code)]
    f64,
);

/// A value of an object that describes a sum.
enum SumValue {
    Number(f64),
    Text(String),
    List(Vec<String>),
}

one_of! {
    SumValue: "a weight",
    number(number) => SumValue::Number(number),
    text(text) => SumValue::Text(text),
    list(names) => SumValue::List(names),
}

impl SumSpec {
    /// Makes the sum that an object describes: by a weighting, a window or the weights of bands.
    fn of_object<E: de::Error>(mut object: BTreeMap<String, SumValue>) -> Result<Self, E> {
        if let Some(SumValue::Text(weighting)) = object.get("weighting") {
            let weighting = weighting.clone();
            object.remove("weighting");
            return match (object.remove("bands"), object.into_keys().next()) {
                (Some(SumValue::List(bands)), None) => {
                    Ok(Self::Some(SomeBandsSpec { weighting, bands }))
                }
                (Some(_), None) => {
                    Err(E::custom("`bands` is no list; list the names of the bands"))
                }
                (None, None) => {
                    Err(E::custom("`bands` is missing; the weighting of all bands is a text alone"))
                }
                (_, Some(key)) => Err(E::unknown_field(&key, &["weighting", "bands"])),
            };
        }
        let number = |key: &str| match object.get(key) {
            Some(SumValue::Number(number)) => Some(*number),
            _ => None,
        };
        if ["from_nm", "to_nm"].into_iter().all(|key| object.contains_key(key)) {
            for key in ["from_nm", "to_nm"] {
                if number(key).is_none() {
                    let problem = format!("`{key}` of the window is not a number; write it as one");
                    return Err(E::custom(problem + ", without quotes or brackets"));
                }
            }
        }
        let quantity = match object.get("quantity") {
            None => Some(None),
            Some(SumValue::Text(text)) => Some(Some(
                Quantity::deserialize(de::value::StrDeserializer::<E>::new(text)).map_err(
                    |_| E::custom(format!("a window of `{text}`; there are W and umol/s")),
                )?,
            )),
            Some(_) => None,
        };
        if let (Some(from_nm), Some(to_nm), Some(quantity)) =
            (number("from_nm"), number("to_nm"), quantity)
            && object.len() == 2 + usize::from(quantity.is_some())
        {
            return Ok(Self::Window(WindowSpec { from_nm, to_nm, quantity }));
        }
        let weight = |(name, value)| match value {
            SumValue::Number(weight) => Ok((name, weight)),
            SumValue::Text(_) | SumValue::List(_) => Err(E::custom(format!(
                "the weight of `{name}` is not a number; write it as one, without quotes or brackets"
            ))),
        };
        object.into_iter().map(weight).collect::<Result<_, E>>().map(Self::Weights)
    }
}

one_of! {
    SumSpec: "a list of bands, an object of bands and weights, or a weighting",
    text(name) => SumSpec::Name(name),
    list(names) => SumSpec::Bands(names),
    object(object) => SumSpec::of_object(object)?,
}

/// A ratio of totals over bands.
#[derive(Clone, Debug, PartialEq, JsonSchema)]
#[schemars(untagged)]
pub enum RatioSpec {
    /// A known ratio, of all bands.
    Name(#[schemars(extend("examples" = RATIOS.map(|(name, ..)| name)))] String),
    /// A ratio of two totals.
    Of(QuotientSpec),
}

/// Two totals over bands, of which the one is divided by the other.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct QuotientSpec {
    /// The total that is divided: a band, a sum, or anything that a sum may be.
    pub numerator: SumSpec,
    /// The total that it is divided by.
    pub denominator: SumSpec,
}

one_of! {
    RatioSpec: "the name of a ratio, or {\"numerator\", \"denominator\"}",
    text(name) => RatioSpec::Name(name),
    object(quotient) => RatioSpec::Of(quotient),
}

/// One number for all bands, an array with one number per band, or a spectrum.
#[derive(Clone, Debug, PartialEq, JsonSchema)]
#[schemars(untagged)]
pub enum PerBand {
    /// The same number for all bands.
    All(#[schemars(range(min = 0))] f64),
    /// One number for each band.
    Each(#[schemars(inner(range(min = 0)))] Vec<f64>),
    /// A spectrum, of which each band takes the mean.
    Spectrum(SpectrumSpec),
}

/// A measured spectrum, averaged over each band.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpectrumSpec {
    /// File with a table, in which the first column holds wavelengths in nm, rising; or TM-27.
    pub spectrum: String,
    /// Name or number of the column with the spectrum (default 2).
    pub column: Option<ColumnSpec>,
    /// Whether the values of the column are in percent (default false).
    #[serde(default)]
    pub percent: bool,
    /// Factor that the values are multiplied by (default 1).
    pub times: Option<f64>,
}

/// The spectrum of a lamp, and the flux of the lamp.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LampSpectrumSpec {
    /// Name of a spectrum at hand, or a file with a table, in which the first column holds
    /// wavelengths in nm, rising; or TM-27 or TM-33.
    #[schemars(extend("examples" = known_spectra().collect::<Vec<_>>()))]
    pub spectrum: String,
    /// Name or number of the column with the spectrum (default 2).
    pub column: Option<ColumnSpec>,
    /// What the table counts per nm (default photons).
    pub unit: Option<SpectralUnitSpec>,
    /// Flux of the lamp from `from_nm` to `to_nm`; with `photometry` also "file": the flux that the
    /// file states.
    pub total: TotalSpec,
    /// Quantity that `total` is measured in (default: the quantity of the scene; of the "file", lm).
    pub quantity: Option<TotalQuantitySpec>,
    /// Wavelength where `total` begins, nm (default: where the table begins).
    pub from_nm: Option<f64>,
    /// Wavelength where `total` ends, nm (default: where the table ends).
    pub to_nm: Option<f64>,
}

/// The flux of a lamp with a spectrum.
#[derive(Clone, Copy, Debug, PartialEq, JsonSchema)]
#[schemars(untagged)]
pub enum TotalSpec {
    /// The flux itself.
    Given(#[schemars(range(min = 0))] f64),
    /// "file": the flux that the photometry file states.
    #[schemars(with = "FileWord")]
    File,
}

one_of! {
    TotalSpec: "a number, or \"file\"",
    number(total) => TotalSpec::Given(total),
    word { "file" => TotalSpec::File },
}

/// What the flux of a lamp with a spectrum is measured in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
pub enum TotalQuantitySpec {
    /// Radiant flux, W.
    #[serde(rename = "W")]
    Watt,
    /// Photon flux, umol/s.
    #[serde(rename = "umol/s")]
    Micromole,
    /// Luminous flux, lm: over all wavelengths.
    #[serde(rename = "lm")]
    Lumen,
}

/// What the table of a lamp counts per nm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum SpectralUnitSpec {
    /// Photons (umol, mol).
    #[default]
    Photons,
    /// Energy (J, W).
    Energy,
}

/// How spectra are averaged over a band.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpectraSpec {
    /// What the mean of a spectrum is weighted with: "lights" (default: the light of the lamps),
    /// "flat", the name of a spectrum at hand, or the file of a lamp's table.
    pub weight: Option<String>,
    /// What the table of `weight` counts per nm (default photons).
    pub unit: Option<SpectralUnitSpec>,
}

/// A column of a table.
#[derive(Clone, Debug, PartialEq, JsonSchema)]
#[schemars(untagged)]
pub enum ColumnSpec {
    /// Number of the column, from 1; the first column holds the wavelengths.
    Number(Count),
    /// Name of the column in the header.
    Name(String),
}

one_of! {
    ColumnSpec: "the name or number of a column",
    whole(number) => ColumnSpec::Number(Count(number)),
    text(name) => ColumnSpec::Name(name),
}

one_of! {
    PerBand: "a number, or an array with one number per band, or a spectrum",
    number(all) => PerBand::All(all),
    list(each) => PerBand::Each(each),
    object(spectrum) => PerBand::Spectrum(spectrum),
}

/// The power of a light.
#[derive(Debug, JsonSchema)]
#[schemars(untagged)]
pub enum PowerSpec {
    /// The flux itself, or a spectrum that is averaged over each band.
    Given(PerBand),
    /// "file": the flux that the photometry file states.
    #[schemars(with = "FileWord")]
    File,
    /// A spectrum of any scale, and the flux between two wavelengths.
    Spectrum(LampSpectrumSpec),
}

impl PowerSpec {
    /// Returns whether the photometry file says how large the flux is.
    pub fn is_of_file(&self) -> bool {
        match self {
            Self::Given(_) => false,
            Self::File => true,
            Self::Spectrum(lamp) => lamp.total == TotalSpec::File,
        }
    }
}

/// The word that stands for the value in the photometry file.
#[derive(JsonSchema)]
#[schemars(rename_all = "lowercase")]
#[allow(dead_code)] // for the schema alone
enum FileWord {
    /// The value that the file states.
    File,
}

one_of! {
    PowerSpec: "a number, or an array with one number per band, or a spectrum, or \"file\"",
    number(all) => PowerSpec::Given(PerBand::All(all)),
    word { "file" => PowerSpec::File },
    list(each) => PowerSpec::Given(PerBand::Each(each)),
    object(lamp) => PowerSpec::Spectrum(lamp),
}

/// A whole number, which may be written like 1e8.
#[derive(Clone, Copy, Debug, PartialEq, Eq, JsonSchema)]
#[schemars(transparent)]
pub struct Count(#[schemars(range(min = 0))] pub u64);

impl Count {
    /// Returns the number as one of things in memory.
    pub(super) fn size(self) -> usize {
        usize::try_from(self.0).unwrap_or(usize::MAX)
    }
}

impl<'de> Deserialize<'de> for Count {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl de::Visitor<'_> for Visitor {
            type Value = Count;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a whole number, at least 0")
            }
            fn visit_u64<E>(self, v: u64) -> Result<Count, E> {
                Ok(Count(v))
            }
            fn visit_f64<E: de::Error>(self, v: f64) -> Result<Count, E> {
                // beyond 2^53 a float no longer tells whole numbers apart
                if v >= 0.0 && v.fract() == 0.0 && v <= 9e15 {
                    return Ok(Count(v as u64));
                }
                if v > 9e15 {
                    return Err(E::custom(format_args!("{v:?}, must be at most 9e15")));
                }
                Err(E::invalid_value(de::Unexpected::Float(v), &self))
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}

tagged! {
    /// What a surface does with light; every interaction conserves energy.
    pub enum MaterialSpec {
        /// Opaque, Lambertian, both faces alike.
        "lambert" => Lambert(LambertSpec),
        /// Smooth dielectric: the interface of a closed solid (normals out), or a thin pane.
        "transparent" => Transparent(TransparentSpec),
        /// A leaf: a thin sheet, or a closed solid.
        "leaf" => Leaf(Box<LeafSpec>),
        /// Lambertian, with a glossy or mirror lobe and diffuse transmission.
        "phong" => Phong(PhongSpec),
        /// A mirror whose reflectance is the same at every angle.
        "mirror" => Mirror(MirrorSpec),
        /// A thin sheet as it was measured.
        "table" => Table(TableSpec),
    }
}

/// Material `lambert`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LambertSpec {
    /// Fraction that is reflected, in [0, 1].
    pub reflectance: PerBand,
}

/// Material `mirror`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MirrorSpec {
    /// Fraction that is reflected, in [0, 1].
    pub reflectance: PerBand,
}

/// Material `table`: a file of the scattering function, or a cover's values by angle of incidence.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("oneOf" = [{"required": ["file"]}, {"required": ["angles_deg"]}]))]
pub struct TableSpec {
    /// File of the scattering function f (1/sr): CSV (theta_i,phi_i,theta_o,phi_o, bands) or Klems
    /// XML.
    pub file: Option<String>,
    /// With `file`: whether f(i, o) and f(o, i) are both replaced by their mean (default false).
    pub reciprocal: Option<bool>,
    /// Angles of incidence, degrees, rising.
    #[schemars(length(min = 1), inner(range(min = 0, max = 90)))]
    pub angles_deg: Option<Vec<f64>>,
    /// Transmittance straight on, one entry for each of `angles_deg` (default 0).
    pub direct: Option<Vec<PerBand>>,
    /// Diffuse (Lambertian) transmittance, one entry for each of `angles_deg` (default 0).
    pub diffuse: Option<Vec<PerBand>>,
    /// Reflectance as by a mirror, one entry for each of `angles_deg` (default 0).
    pub reflectance: Option<Vec<PerBand>>,
}

/// Material `transparent`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TransparentSpec {
    /// Index of refraction, at least 1.
    #[schemars(range(min = 1, max = 1000))]
    pub ior: f64,
    /// Factor on transmitted light, at each crossing of a solid's face or passage inside a pane
    /// (default 1).
    pub tint: Option<PerBand>,
    /// Whether the polygon stands for a whole pane with two parallel faces (default false).
    #[serde(default)]
    pub thin: bool,
}

/// Material `leaf`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LeafSpec {
    /// Index of refraction of the cuticle, at least 1 (default 1.425).
    #[schemars(range(min = 1, max = 1000))]
    pub ior: Option<f64>,
    /// Hemispherical reflectance of the upper (front) face near normal incidence.
    pub reflectance: Option<PerBand>,
    /// Hemispherical transmittance near normal incidence of light that enters the front face.
    pub transmittance: Option<PerBand>,
    /// What the leaf is made of, in the place of `reflectance` and `transmittance`.
    pub prospect: Option<ProspectSpec>,
    /// The lower (back) face; a value that it lacks is that of the front.
    pub back: Option<LeafBackSpec>,
    /// Whether it is a thin sheet (default true) or a closed solid with a dielectric interface.
    #[serde(default = "yes")]
    pub thin: bool,
    /// For a solid leaf only: factor on the light that is transmitted at each crossing (default 1).
    pub tint: Option<PerBand>,
}

fn yes() -> bool {
    true
}

/// What a leaf is made of: PROSPECT-D computes its reflectance and transmittance.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProspectSpec {
    /// Structure parameter N, the number of layers (1.2 to 2.5 in most leaves).
    #[schemars(range(min = 1, max = 10))]
    pub n: f64,
    /// Chlorophyll a and b, ug/cm2.
    #[schemars(range(min = 0))]
    pub chlorophyll: f64,
    /// Carotenoids, ug/cm2 (default 0).
    #[schemars(range(min = 0))]
    #[serde(default)]
    pub carotenoids: f64,
    /// Anthocyanins, ug/cm2 (default 0).
    #[schemars(range(min = 0))]
    #[serde(default)]
    pub anthocyanins: f64,
    /// Brown pigments, in arbitrary units from 0 to about 1 (default 0).
    #[schemars(range(min = 0))]
    #[serde(default)]
    pub brown: f64,
    /// Water, cm (the same as g/cm2).
    #[schemars(range(min = 0))]
    pub water: f64,
    /// Dry matter, g/cm2.
    #[schemars(range(min = 0))]
    pub dry_matter: f64,
}

/// The lower face of a leaf.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LeafBackSpec {
    /// Hemispherical reflectance of this face near normal incidence (default: that of the front).
    pub reflectance: Option<PerBand>,
    /// Hemispherical transmittance of light that enters this face (default: that of the front).
    pub transmittance: Option<PerBand>,
}

/// Material `phong`.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PhongSpec {
    /// Lambertian reflectance (default 0).
    pub reflectance: Option<PerBand>,
    /// Reflectance of the glossy or mirror lobe (default 0).
    pub specular: Option<PerBand>,
    /// Lambertian transmittance (default 0).
    pub transmittance: Option<PerBand>,
    /// Exponent of the glossy lobe, at least 0; without it the lobe is that of a mirror.
    #[schemars(range(min = 0))]
    pub exponent: Option<f64>,
}

/// Placement: scale, then rotation about x, then y, then z, then translation.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TransformSpec {
    /// Scale factor, positive (default 1).
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub scale: Option<f64>,
    /// Angles of rotation about x, y and z, degrees (default 0).
    pub rotate_deg: Option<[f64; 3]>,
    /// Translation, in the scene's unit (default 0).
    pub translate: Option<[f64; 3]>,
}

/// Where the copies of an object stand: a list, or a table.
#[derive(Debug, JsonSchema)]
#[schemars(untagged)]
pub enum InstancesSpec {
    /// One transform for each copy.
    List(Vec<TransformSpec>),
    /// A CSV file with one row for each copy.
    Table {
        /// The file, with the columns x, y, z and, if wanted, turn_deg and scale, or m00 to m23.
        csv: String,
    },
}

/// The keys of [`InstancesSpec::Table`].
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct InstancesTable {
    csv: String,
}

one_of! {
    InstancesSpec: "an array of transforms, or {\"csv\"}",
    list(copies) => InstancesSpec::List(copies),
    object(InstancesTable { csv }) => InstancesSpec::Table { csv },
}

/// How the materials of a file in the format of Radiance are meant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum DialectSpec {
    /// As Radiance reads them.
    #[default]
    Radiance,
    /// As SEC2 reads them: the colour is the whole reflectance, and a trans transmits its
    /// transmission, whatever its colour.
    Sec2,
}

/// Surfaces from an OBJ file, or from one in the format of Radiance.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("oneOf" = [{"required": ["obj"]}, {"required": ["rad"]}]))]
pub struct ObjectSpec {
    /// Name of the object (default: the file's name without extension).
    pub name: Option<String>,
    /// Whether the object is there (default true). An object that is not may come in at times, by a
    /// state of a control file of `phylux year`.
    pub present: Option<bool>,
    /// Mesh, relative to the scene file: an OBJ, PLY, STL or glTF file (.gltf, .glb).
    pub obj: Option<String>,
    /// File in the format of Radiance, in place of a mesh.
    pub rad: Option<String>,
    /// How the materials of the `rad` file are meant (default radiance).
    pub dialect: Option<DialectSpec>,
    /// Material of all faces, in place of the materials that the file names.
    pub material: Option<String>,
    /// Whether the masks of the MTL entries (`map_d`) cut the faces of an OBJ file (default true).
    pub mask: Option<bool>,
    /// Which axis of the file points up (default z, and y in a glTF); y turns (x, y, z) to
    /// (x, -z, y) before `transform`.
    pub up: Option<UpSpec>,
    /// Where the object stands.
    pub transform: Option<TransformSpec>,
    /// Copies of the object, each placed after `transform`.
    pub instances: Option<InstancesSpec>,
    /// Whether the copies share the triangles of the object, and the memory that these take (default:
    /// from 200,000 triangles of all copies together on, of objects of less than 5,000 from 2 million
    /// on).
    pub share: Option<bool>,
    /// Whether the surfaces count light: true (one captor per OBJ group and instance), "instance"
    /// (one per instance) or "triangle" (one per triangle).
    #[serde(default)]
    pub captor: SurfaceCaptorSpec,
    /// Name of one more group that the captors of the object belong to.
    pub group: Option<String>,
    /// Whether the object is ground below plants: layers leave it out, and results say what arrives
    /// there (default false).
    #[serde(default)]
    pub ground: bool,
}

/// Which axis of a file points up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum UpSpec {
    /// z, as in the scene.
    Z,
    /// y, as in many modelling programs.
    Y,
}

/// One pattern of captors' ids, or several.
#[derive(Debug, JsonSchema)]
#[schemars(untagged)]
pub enum Patterns {
    /// One pattern.
    One(String),
    /// Several patterns.
    Several(Vec<String>),
}

impl Patterns {
    /// All patterns, as a slice.
    pub fn all(&self) -> &[String] {
        match self {
            Self::One(pattern) => std::slice::from_ref(pattern),
            Self::Several(patterns) => patterns,
        }
    }
}

one_of! {
    Patterns: "a pattern of ids such as \"plant/leaf3#*\", or a list of them",
    text(pattern) => Patterns::One(pattern),
    list(patterns) => Patterns::Several(patterns),
}

/// Whether, and how finely, the surfaces of an object count light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SurfaceCaptorSpec {
    /// The surfaces are no captors.
    #[default]
    Off,
    /// One captor per OBJ group and instance.
    Groups,
    /// One captor per triangle.
    Triangles,
    /// One captor per instance.
    Instances,
}

impl JsonSchema for SurfaceCaptorSpec {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "SurfaceCaptor".into()
    }
    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "enum": [true, false, "triangle", "instance"] })
    }
}

one_of! {
    SurfaceCaptorSpec: "true, false, \"triangle\" or \"instance\"",
    flag(on) => if on { SurfaceCaptorSpec::Groups } else { SurfaceCaptorSpec::Off },
    word {
        "triangle" => SurfaceCaptorSpec::Triangles,
        "instance" => SurfaceCaptorSpec::Instances,
    },
}

tagged! {
    /// Where photons start. `power` is the total emitted flux, per band.
    pub enum LightSpec {
        /// A point that emits alike in all directions, or as `photometry` or `cosine` says.
        "point" => Point(PointSpec),
        /// A point with uniform intensity inside a cone.
        "spot" => Spot(SpotSpec),
        /// The lateral surface of a cylinder, Lambertian; or a line.
        "tube" => Tube(TubeSpec),
        /// A polygon or the faces of an OBJ file, Lambertian or as `photometry` says.
        "area" => Area(Box<AreaSpec>),
        /// Lamps of an object that is a file in the format of Radiance.
        "rad" => Rad(RadLightSpec),
        /// The sun: a disc infinitely far away.
        "sun" => Sun(SunSpec),
        /// The sky above the horizon.
        "sky" => Sky(SkySpec),
        /// A picture of the light that comes from all directions.
        "environment" => Environment(EnvironmentSpec),
    }
}

/// What lights of several kinds say of themselves, where it is given.
#[derive(Clone, Copy, Debug, Default)]
pub struct LightKeys<'a> {
    /// Name of the light.
    pub name: Option<&'a str>,
    /// Power of a lamp.
    pub power: Option<&'a PowerSpec>,
    /// Electric power of the lamp, W.
    pub watts: Option<f64>,
}

impl LightSpec {
    /// Returns what the light says of itself.
    pub fn keys(&self) -> LightKeys<'_> {
        let (name, power, watts) = match self {
            Self::Point(PointSpec { name, power, watts, .. })
            | Self::Spot(SpotSpec { name, power, watts, .. })
            | Self::Tube(TubeSpec { name, power, watts, .. }) => (name, Some(power), *watts),
            Self::Area(light) => (&light.name, light.power.as_ref(), light.watts),
            Self::Rad(light) => (&None, Some(&light.power), light.watts),
            Self::Sun(SunSpec { name, .. })
            | Self::Sky(SkySpec { name, .. })
            | Self::Environment(EnvironmentSpec { name, .. }) => (name, None, None),
        };
        LightKeys { name: name.as_deref(), power, watts }
    }

    /// Returns the name of the light with this index in the scene file.
    pub fn name(&self, index: usize) -> String {
        let usual = match self {
            Self::Sun(_) => "sun".into(),
            Self::Sky(_) => "sky".into(),
            Self::Environment(_) => "environment".into(),
            _ => format!("light{index}"),
        };
        self.keys().name.map_or(usual, String::from)
    }

    /// Whether the light is infinitely far away.
    pub fn is_infinite(&self) -> bool {
        matches!(self, Self::Sun(_) | Self::Sky(_) | Self::Environment(_))
    }
}

/// Light `rad`: the lamps of one material in an object that is a file in the format of Radiance.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RadLightSpec {
    /// Name of the object that has the lamps.
    pub object: String,
    /// Name of the lamps' material in the object's file.
    pub material: String,
    /// Flux of all these lamps together; each emits a share of it by its area.
    pub power: PowerSpec,
    /// Electric power of all these lamps together, W; each has a share of it by its area.
    #[schemars(range(max = 1e9), extend("exclusiveMinimum" = 0))]
    pub watts: Option<f64>,
}

/// Light `sun`.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SunSpec {
    /// Unique name (default sun).
    pub name: Option<String>,
    /// Half angle of the sun's disc, degrees (default 0.2666); 0 makes its rays parallel.
    #[schemars(range(min = 0, max = 5))]
    pub half_angle_deg: Option<f64>,
    /// Irradiance of a plane that faces the sun, in the scene's quantity per m2 (default: from
    /// `weather`).
    pub irradiance: Option<PerBand>,
    /// The scene's quantity per J of the whole spectrum (default: by the band's wavelengths).
    pub share: Option<PerBand>,
    /// Reflectance of the ground below the horizon, which is lit without shadows (default 0).
    pub ground: Option<PerBand>,
    /// Planar polygons just outside a roof or window, front to the sky, through which alone the
    /// light enters (default: it enters everywhere).
    #[schemars(extend("minItems" = 1))]
    pub through: Option<Vec<Vec<[f64; 3]>>>,
}

/// Light `sky`.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SkySpec {
    /// Unique name (default sky).
    pub name: Option<String>,
    /// How the radiance is distributed over the sky (default perez).
    #[serde(default)]
    pub model: SkyModelSpec,
    /// With the model `cie`: number of the sky type, 1 to 15.
    #[schemars(range(min = 1, max = 15))]
    pub cie_type: Option<Count>,
    /// Irradiance of a horizontal plane, in the scene's quantity per m2 (default: from `weather`).
    pub irradiance: Option<PerBand>,
    /// The scene's quantity per J of the whole spectrum (default: by the band's wavelengths).
    pub share: Option<PerBand>,
    /// Reflectance of the ground below the horizon, which is lit without shadows (default 0).
    pub ground: Option<PerBand>,
    /// Planar polygons just outside a roof or window, front to the sky, through which alone the
    /// light enters (default: it enters everywhere).
    #[schemars(extend("minItems" = 1))]
    pub through: Option<Vec<Vec<[f64; 3]>>>,
}

/// How the radiance is distributed over the sky.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum SkyModelSpec {
    /// By the weather (Perez, Seals and Michalsky, 1993).
    #[default]
    Perez,
    /// The same radiance everywhere.
    Uniform,
    /// The traditional overcast sky: the zenith three times as bright as the horizon.
    Overcast,
    /// One of the general skies of the CIE, named by `cie_type`.
    Cie,
}

/// Light `environment`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EnvironmentSpec {
    /// Unique name (default environment).
    pub name: Option<String>,
    /// Latitude-longitude picture: a .exr or .hdr file.
    pub file: String,
    /// Azimuth of the picture's middle column, degrees clockwise from north (default 0).
    pub heading_deg: Option<f64>,
    /// Factor from the picture's values to radiances (default 1).
    pub scale: Option<PerBand>,
    /// Irradiance of a plane that faces up, in place of `scale`.
    pub irradiance: Option<PerBand>,
    /// Planar polygons just outside a roof or window, front to the sky, through which alone the
    /// light enters (default: it enters everywhere).
    #[schemars(extend("minItems" = 1))]
    pub through: Option<Vec<Vec<[f64; 3]>>>,
}

/// Light `point`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PointSpec {
    /// Unique name (default light0, light1, ...).
    pub name: Option<String>,
    /// Position of the light.
    pub position: [f64; 3],
    /// Total emitted flux; with `photometry` also "file": the flux that the file states.
    pub power: PowerSpec,
    /// IES (LM-63), EULUMDAT or TM-33 file of the intensity (default: alike in all directions).
    pub photometry: Option<String>,
    /// With `photometry` or `cosine`: the direction that the light aims in (default [0, 0, -1],
    /// down).
    pub aim: Option<[f64; 3]>,
    /// With `photometry`: the direction of the half-plane C = 0 (default [1, 0, 0]).
    pub zero_plane: Option<[f64; 3]>,
    /// With `photometry`: which of an EULUMDAT's lamp sets is in the lamp (default: the first with
    /// lamps and light), or which of a TM-33's emitters the light is, from 1.
    pub set: Option<Count>,
    /// With "power": "file": lumens per W of the lamp's light.
    #[serde(rename = "lm_per_W")]
    #[schemars(range(max = 683), extend("exclusiveMinimum" = 0))]
    pub lm_per_w: Option<f64>,
    /// With "power": "file": lumens per umol/s of the lamp's light.
    #[schemars(range(max = 150), extend("exclusiveMinimum" = 0))]
    pub lm_per_umol: Option<f64>,
    /// Exponent n of an intensity proportional to cos^n of the angle to `aim`.
    #[schemars(range(min = 0))]
    pub cosine: Option<f64>,
    /// Electric power of the light, W.
    #[schemars(range(max = 1e9), extend("exclusiveMinimum" = 0))]
    pub watts: Option<f64>,
}

/// Light `spot`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpotSpec {
    /// Unique name (default light0, light1, ...).
    pub name: Option<String>,
    /// Position of the light.
    pub position: [f64; 3],
    /// Axis of the cone; not zero.
    pub direction: [f64; 3],
    /// Half angle of the cone, degrees, in (0, 180].
    #[schemars(range(max = 180), extend("exclusiveMinimum" = 0))]
    pub half_angle_deg: f64,
    /// Total emitted flux.
    pub power: PowerSpec,
    /// Electric power of the light, W.
    #[schemars(range(max = 1e9), extend("exclusiveMinimum" = 0))]
    pub watts: Option<f64>,
}

/// Light `tube`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TubeSpec {
    /// Unique name (default light0, light1, ...).
    pub name: Option<String>,
    /// One end of the tube's axis.
    pub from: [f64; 3],
    /// The other end of the axis.
    pub to: [f64; 3],
    /// Radius of the tube, at least 0; 0 is a line.
    #[schemars(range(min = 0))]
    pub radius: f64,
    /// How the tube emits; isotropic only for a line (default lambert).
    #[serde(default)]
    pub emission: EmissionSpec,
    /// Total emitted flux.
    pub power: PowerSpec,
    /// With `opening_deg`: direction from the axis to the middle of the part of the circumference
    /// that emits.
    pub toward: Option<[f64; 3]>,
    /// With `toward`: how much of the circumference emits, degrees, in (0, 360].
    #[schemars(range(max = 360), extend("exclusiveMinimum" = 0))]
    pub opening_deg: Option<f64>,
    /// Makes the tube an obstacle of this material, with black ends.
    pub material: Option<String>,
    /// Electric power of the light, W.
    #[schemars(range(max = 1e9), extend("exclusiveMinimum" = 0))]
    pub watts: Option<f64>,
}

/// How a tube emits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum EmissionSpec {
    /// Lambertian.
    #[default]
    Lambert,
    /// Each point alike in all directions (radius 0 only).
    Isotropic,
}

/// Light `area`.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AreaSpec {
    /// Unique name (default light0, light1, ...).
    pub name: Option<String>,
    /// Corners of a polygon, counter-clockwise seen from its front; in place of `obj`.
    pub vertices: Option<Vec<[f64; 3]>>,
    /// Mesh of the surface (OBJ, PLY, STL or glTF file); in place of `vertices`.
    pub obj: Option<String>,
    /// Where the surface of the OBJ file stands.
    pub transform: Option<TransformSpec>,
    /// Copies of the surface of the OBJ file, each placed after `transform`.
    pub instances: Option<Vec<TransformSpec>>,
    /// Total emitted flux, in place of `radiance`; with `photometry` also "file": the flux that the
    /// file states.
    pub power: Option<PowerSpec>,
    /// Radiance of each emitting side, in place of `power`.
    pub radiance: Option<PerBand>,
    /// Whether the back emits too (default false).
    #[serde(default)]
    pub two_sided: bool,
    /// Makes the light an obstacle of this material.
    pub material: Option<String>,
    /// IES (LM-63), EULUMDAT or TM-33 file of the intensity (default: Lambertian).
    pub photometry: Option<String>,
    /// With `photometry`: the direction that the light aims in (default: the mean normal).
    pub aim: Option<[f64; 3]>,
    /// With `photometry`: the direction of the half-plane C = 0 (default [1, 0, 0]).
    pub zero_plane: Option<[f64; 3]>,
    /// With `photometry`: which of an EULUMDAT's lamp sets is in the lamp (default: the first with
    /// lamps and light), or which of a TM-33's emitters the light is, from 1.
    pub set: Option<Count>,
    /// With "power": "file": lumens per W of the lamp's light.
    #[serde(rename = "lm_per_W")]
    #[schemars(range(max = 683), extend("exclusiveMinimum" = 0))]
    pub lm_per_w: Option<f64>,
    /// With "power": "file": lumens per umol/s of the lamp's light.
    #[schemars(range(max = 150), extend("exclusiveMinimum" = 0))]
    pub lm_per_umol: Option<f64>,
    /// Electric power of the light, W; of each copy, where there are `instances`.
    #[schemars(range(max = 1e9), extend("exclusiveMinimum" = 0))]
    pub watts: Option<f64>,
}

/// Captors: exactly one of `csv`, `obj`, `disc`, `sphere`, `grid` and `line`.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("oneOf" = [{"required": ["csv"]}, {"required": ["obj"]}, {"required": ["disc"]},
    {"required": ["sphere"]}, {"required": ["grid"]}, {"required": ["line"]}]))]
pub struct CaptorSpec {
    /// First part of the captors' ids (default: the file's name without extension; needed without a
    /// file).
    pub name: Option<String>,
    /// CSV file of discs: columns x,y,z,radius,nx,ny,nz and optional id.
    pub csv: Option<String>,
    /// Mesh (OBJ, PLY, STL or glTF file); each of its groups is one captor.
    pub obj: Option<String>,
    /// Columns of the `csv` file to ignore.
    #[serde(default)]
    pub ignore: Vec<String>,
    /// A single disc.
    pub disc: Option<DiscSpec>,
    /// A sphere, which counts the light that enters it: its irradiance is the fluence rate.
    pub sphere: Option<SphereSpec>,
    /// Discs in rows and columns.
    pub grid: Option<GridSpec>,
    /// A strip, as a line sensor has.
    pub line: Option<LineSpec>,
    /// Pairs of an angle to the normal in degrees and the factor on light that arrives at this
    /// angle: linear between the angles, constant beyond the first and the last.
    pub response: Option<Vec<[f64; 2]>>,
    /// Which faces count (default front).
    #[serde(default)]
    pub sides: SidesSpec,
    /// Name of one more group that the captors belong to.
    pub group: Option<String>,
}

/// Which faces of a virtual captor count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum SidesSpec {
    /// The front alone: light that arrives against the normal.
    #[default]
    Front,
    /// Both faces, counted separately.
    Both,
}

/// A disc.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DiscSpec {
    /// Centre of the disc.
    pub center: [f64; 3],
    /// Direction in which the front faces; not zero.
    pub normal: [f64; 3],
    /// Radius, positive.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub radius: f64,
}

/// A sphere.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SphereSpec {
    /// Centre of the sphere.
    pub center: [f64; 3],
    /// Radius, positive.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub radius: f64,
}

/// A grid of discs, each in the middle of its cell.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GridSpec {
    /// Where the grid begins and ends along x.
    pub x: [f64; 2],
    /// Where the grid begins and ends along y.
    pub y: [f64; 2],
    /// Number of cells along x, at least 1.
    #[schemars(extend("minimum" = 1))]
    pub nx: Count,
    /// Number of cells along y, at least 1.
    #[schemars(extend("minimum" = 1))]
    pub ny: Count,
    /// Height z of the discs.
    pub z: f64,
    /// Radius of each disc, positive.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub radius: f64,
    /// Direction in which the fronts face (default [0, 0, 1]); not zero.
    pub normal: Option<[f64; 3]>,
}

/// A strip, as a line sensor has.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LineSpec {
    /// The middle of one end.
    pub from: [f64; 3],
    /// The middle of the other end.
    pub to: [f64; 3],
    /// Width of the strip, positive.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub width: f64,
    /// Direction in which the front faces: not along the line, and its component along the line
    /// does not count.
    pub normal: [f64; 3],
}

/// Defaults of a run.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SettingsSpec {
    /// Photons to trace, or paths over all captors; at least 1 (default 1e6).
    #[schemars(extend("minimum" = 1))]
    pub photons: Option<Count>,
    /// Seed of the random numbers (default 1).
    pub seed: Option<u64>,
    /// Photons of each k-nearest estimate, 0 for no such estimates (default: the number of photons
    /// on the face to the power 2/3, at least 50).
    pub k: Option<Count>,
    /// The most arrivals that k-nearest estimates are taken from (default 2e6).
    pub map_photons: Option<Count>,
    /// What guides photons to captors that light hardly reaches (default: what a trial finds
    /// cheapest).
    #[serde(default)]
    pub guiding: Guiding,
    /// No longer a setting: `guiding` has taken its place.
    #[schemars(skip)]
    pub splitting: Option<Count>,
    /// Relative standard error to reach on every captor; the run goes on until then.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1))]
    pub tolerance: Option<f64>,
    /// Time after which the run stops, s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub max_time: Option<f64>,
    /// Method that finds the light on the captors (default auto).
    #[serde(default)]
    pub estimator: Estimator,
    /// Number of threads, 0 for one per processor (default 0).
    pub threads: Option<Count>,
}

/// The view to render.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraSpec {
    /// Where the camera is.
    pub position: [f64; 3],
    /// The point in the middle of the picture.
    pub look_at: [f64; 3],
    /// The direction that points up in the picture (default [0, 0, 1]).
    pub up: Option<[f64; 3]>,
    /// Angle of view from left to right across the picture, degrees, in (0, 180) (default 45).
    pub fov_deg: Option<f64>,
    /// Width of the picture in pixels (default 800).
    pub width: Option<Count>,
    /// Height of the picture in pixels (default 600).
    pub height: Option<Count>,
}
