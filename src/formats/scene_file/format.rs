//! The scene file as it is written: the types that its JSON is read into and its schema made of.

use std::{collections::BTreeMap, fmt};

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, de};

use crate::{
    formats::json::tagged,
    math::units::{LengthUnit, Quantity},
    transport::settings::{Estimator, Guiding},
};

/// A phylux scene.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SceneFile {
    /// Where an editor finds the schema; not read.
    #[serde(rename = "$schema")]
    pub _schema: Option<String>,
    /// Title (default: the file's name).
    pub name: Option<String>,
    /// Unit of every length in the scene, its OBJ and its captor files (default m).
    #[serde(default)]
    pub unit: LengthUnit,
    /// What power and flux are measured in (default W).
    #[serde(default)]
    pub quantity: Quantity,
    /// Wavelength intervals, all traced in one pass (default: one named `all`).
    pub bands: Option<Vec<BandFile>>,
    /// Totals over bands, reported like bands: name -> names of bands.
    #[serde(default)]
    pub sums: BTreeMap<String, Vec<String>>,
    /// How spectra are averaged over the bands.
    #[serde(default)]
    pub spectra: SpectraFile,
    /// Materials by name.
    #[serde(default)]
    pub materials: BTreeMap<String, MaterialFile>,
    /// Surfaces.
    #[serde(default)]
    pub objects: Vec<ObjectFile>,
    /// Lights; at least one.
    #[serde(default)]
    #[schemars(length(min = 1))]
    pub lights: Vec<LightFile>,
    /// Sensors that do not disturb light.
    #[serde(default)]
    pub captors: Vec<CaptorFile>,
    /// Groups of captors by their ids: name -> a pattern or a list of patterns, `*` stands for any characters.
    #[serde(default)]
    pub groups: BTreeMap<String, Patterns>,
    /// Defaults of the run, which the command line overrides.
    #[serde(default)]
    pub settings: SettingsFile,
    /// The view to render.
    pub camera: Option<CameraFile>,
    /// Where on the earth the scene is, and its north; +z is up.
    pub site: Option<SiteFile>,
    /// When it is: an ISO 8601 time with offset, a period, or "year".
    pub time: Option<TimeFile>,
    /// Irradiances of the whole spectrum.
    pub weather: Option<WeatherFile>,
    /// Where the sun stands, in place of `site` and `time`.
    pub sun_at: Option<SunAtFile>,
}

/// A place on the earth.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SiteFile {
    /// Degrees, north is positive.
    pub latitude: Option<f64>,
    /// Degrees, east is positive.
    pub longitude: Option<f64>,
    /// Where north is (default [0, 1, 0]); its z does not matter.
    pub north: Option<[f64; 3]>,
}

/// Where the sun stands.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SunAtFile {
    /// Degrees above the horizon.
    #[schemars(range(min = -90, max = 90))]
    pub elevation_deg: f64,
    /// Degrees clockwise from north: east is 90.
    pub azimuth_deg: f64,
}

/// An instant, a period or a year.
#[derive(Debug, JsonSchema)]
#[schemars(untagged)]
pub enum TimeFile {
    /// ISO 8601 with offset, or "year".
    Text(String),
    /// A period.
    Span {
        /// Its start.
        from: String,
        /// Its end, not included.
        to: String,
    },
}

impl<'de> Deserialize<'de> for TimeFile {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Span {
            from: String,
            to: String,
        }
        struct Visitor;
        impl<'de> de::Visitor<'de> for Visitor {
            type Value = TimeFile;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a time, {\"from\", \"to\"} or \"year\"")
            }
            fn visit_str<E>(self, text: &str) -> Result<TimeFile, E> {
                Ok(TimeFile::Text(text.into()))
            }
            fn visit_map<A: de::MapAccess<'de>>(self, map: A) -> Result<TimeFile, A::Error> {
                let Span { from, to } =
                    Span::deserialize(de::value::MapAccessDeserializer::new(map))?;
                Ok(TimeFile::Span { from, to })
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}

/// Irradiances of the whole spectrum, W/m2, or a file of them.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WeatherFile {
    /// Direct irradiance across the sun's direction, W/m2.
    #[schemars(range(min = 0, max = 2000))]
    pub direct_normal: Option<f64>,
    /// Diffuse irradiance of a horizontal plane, W/m2.
    #[schemars(range(min = 0, max = 2000))]
    pub diffuse_horizontal: Option<f64>,
    /// EPW, TMY3 or CSV (time, ghi, dni, dhi) file.
    pub file: Option<String>,
    /// Hours that the file's clock is put forward (default 0).
    pub shift_h: Option<f64>,
    /// Of CSV: where in its interval the time of a row stands.
    pub stamp: Option<StampFile>,
}

/// Where in its interval a time stands.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum StampFile {
    /// At its start.
    Start,
    /// In its middle.
    Middle,
    /// At its end.
    End,
}

/// A wavelength interval.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BandFile {
    /// Unique name.
    pub name: String,
    /// Shortest wavelength, nm.
    pub from_nm: Option<f64>,
    /// Longest wavelength, nm.
    pub to_nm: Option<f64>,
}

/// One number for all bands, an array with one number per band, or a spectrum.
#[derive(Clone, Debug, PartialEq, JsonSchema)]
#[schemars(untagged)]
pub enum PerBand {
    /// The same for all.
    All(#[schemars(range(min = 0))] f64),
    /// One for each.
    Each(#[schemars(inner(range(min = 0)))] Vec<f64>),
    /// The mean of a spectrum over each band.
    Spectrum(SpectrumFile),
}

/// A measured spectrum, averaged over each band.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpectrumFile {
    /// Table: first column nm, rising.
    pub spectrum: String,
    /// Name or number of the column (default 2).
    pub column: Option<ColumnFile>,
    /// Whether its values are in percent (default false).
    #[serde(default)]
    pub percent: bool,
    /// What they are multiplied with (default 1).
    pub times: Option<f64>,
}

/// The spectrum of a lamp, and its flux.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LampSpectrumFile {
    /// Table: first column nm, rising.
    pub spectrum: String,
    /// Name or number of the column (default 2).
    pub column: Option<ColumnFile>,
    /// What the table counts per nm (default photons).
    #[serde(default)]
    pub unit: SpectralUnitFile,
    /// Flux from `from_nm` to `to_nm`.
    #[schemars(range(min = 0))]
    pub total: f64,
    /// Of `total` (default: the quantity of the scene).
    pub quantity: Option<Quantity>,
    /// Where `total` begins, nm (default: where the table does).
    pub from_nm: Option<f64>,
    /// Where `total` ends, nm (default: where the table does).
    pub to_nm: Option<f64>,
}

/// What the table of a lamp counts per nm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum SpectralUnitFile {
    /// Photons (umol, mol).
    #[default]
    Photons,
    /// Energy (J, W).
    Energy,
}

/// How spectra are averaged over a band.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpectraFile {
    /// "lights" (default: the light of the lamps), "flat", or the table of a lamp.
    pub weight: Option<String>,
    /// What such a table counts per nm (default photons).
    #[serde(default)]
    pub unit: SpectralUnitFile,
}

/// A column of a table.
#[derive(Clone, Debug, PartialEq, JsonSchema)]
#[schemars(untagged)]
pub enum ColumnFile {
    /// From 1; the first are the wavelengths.
    Number(Count),
    /// In the header.
    Name(String),
}

impl<'de> Deserialize<'de> for ColumnFile {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl de::Visitor<'_> for Visitor {
            type Value = ColumnFile;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("the name or number of a column")
            }
            fn visit_u64<E>(self, number: u64) -> Result<ColumnFile, E> {
                Ok(ColumnFile::Number(Count(number)))
            }
            fn visit_str<E>(self, name: &str) -> Result<ColumnFile, E> {
                Ok(ColumnFile::Name(name.into()))
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}

impl<'de> Deserialize<'de> for PerBand {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl<'de> de::Visitor<'de> for Visitor {
            type Value = PerBand;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a number, or an array with one number per band, or a spectrum")
            }
            fn visit_f64<E>(self, v: f64) -> Result<PerBand, E> {
                Ok(PerBand::All(v))
            }
            fn visit_u64<E>(self, v: u64) -> Result<PerBand, E> {
                Ok(PerBand::All(v as f64))
            }
            fn visit_i64<E>(self, v: i64) -> Result<PerBand, E> {
                Ok(PerBand::All(v as f64))
            }
            fn visit_seq<A: de::SeqAccess<'de>>(self, mut seq: A) -> Result<PerBand, A::Error> {
                let mut values = Vec::new();
                while let Some(value) = seq.next_element()? {
                    values.push(value);
                }
                Ok(PerBand::Each(values))
            }
            fn visit_map<A: de::MapAccess<'de>>(self, map: A) -> Result<PerBand, A::Error> {
                let deserializer = de::value::MapAccessDeserializer::new(map);
                SpectrumFile::deserialize(deserializer).map(PerBand::Spectrum)
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}

/// The power of a light.
#[derive(Debug, JsonSchema)]
#[schemars(untagged)]
pub enum PowerFile {
    /// As given.
    Given(PerBand),
    /// What the photometry says.
    #[schemars(with = "FileWord")]
    File,
    /// A spectrum, and the flux between two wavelengths.
    Spectrum(LampSpectrumFile),
}

/// The word that stands for a file's own value.
#[derive(JsonSchema)]
#[schemars(rename_all = "lowercase")]
#[allow(dead_code)] // for the schema alone
enum FileWord {
    /// What the file says.
    File,
}

impl<'de> Deserialize<'de> for PowerFile {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl<'de> de::Visitor<'de> for Visitor {
            type Value = PowerFile;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str(
                    "a number, or an array with one number per band, or a spectrum, or \"file\"",
                )
            }
            fn visit_f64<E>(self, v: f64) -> Result<PowerFile, E> {
                Ok(PowerFile::Given(PerBand::All(v)))
            }
            fn visit_u64<E: de::Error>(self, v: u64) -> Result<PowerFile, E> {
                self.visit_f64(v as f64)
            }
            fn visit_i64<E: de::Error>(self, v: i64) -> Result<PowerFile, E> {
                self.visit_f64(v as f64)
            }
            fn visit_str<E: de::Error>(self, text: &str) -> Result<PowerFile, E> {
                match text {
                    "file" => Ok(PowerFile::File),
                    _ => Err(E::invalid_value(de::Unexpected::Str(text), &self)),
                }
            }
            fn visit_seq<A: de::SeqAccess<'de>>(self, seq: A) -> Result<PowerFile, A::Error> {
                let deserializer = de::value::SeqAccessDeserializer::new(seq);
                PerBand::deserialize(deserializer).map(PowerFile::Given)
            }
            fn visit_map<A: de::MapAccess<'de>>(self, map: A) -> Result<PowerFile, A::Error> {
                let deserializer = de::value::MapAccessDeserializer::new(map);
                LampSpectrumFile::deserialize(deserializer).map(PowerFile::Spectrum)
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}

/// A whole number, which may be written 1e8.
#[derive(Clone, Copy, Debug, PartialEq, Eq, JsonSchema)]
#[schemars(transparent)]
pub struct Count(#[schemars(range(min = 0))] pub u64);

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
    pub enum MaterialFile {
        /// Opaque, Lambertian, alike on both faces.
        "lambert" => Lambert(LambertFile),
        /// Smooth dielectric: the interface of a closed solid, normals out, or a thin pane.
        "transparent" => Transparent(TransparentFile),
        /// A leaf: a thin sheet, or a closed solid.
        "leaf" => Leaf(LeafFile),
        /// Lambertian, with a glossy or mirror lobe and diffuse transmission.
        "phong" => Phong(PhongFile),
        /// A mirror, alike at every angle.
        "mirror" => Mirror(MirrorFile),
        /// A thin sheet as it was measured.
        "table" => Table(TableFile),
    }
}

/// Material `lambert`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LambertFile {
    /// In [0, 1].
    pub reflectance: PerBand,
}

/// Material `mirror`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MirrorFile {
    /// In [0, 1].
    pub reflectance: PerBand,
}

/// Material `table`: a file of the scattering function, or the values of a cover by the angle of incidence.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("oneOf" = [{"required": ["file"]}, {"required": ["angles_deg"]}]))]
pub struct TableFile {
    /// CSV (theta_i,phi_i,theta_o,phi_o and the bands; f in 1/sr) or Klems XML.
    pub file: Option<String>,
    /// Of a file: whether f(i, o) and f(o, i) are made alike by their mean (default false).
    pub reciprocal: Option<bool>,
    /// Angles of incidence, degrees, rising.
    #[schemars(length(min = 1), inner(range(min = 0, max = 90)))]
    pub angles_deg: Option<Vec<f64>>,
    /// Transmittance straight on, at each of these (default 0).
    pub direct: Option<Vec<PerBand>>,
    /// Transmittance into all directions, Lambertian, at each of these (default 0).
    pub diffuse: Option<Vec<PerBand>>,
    /// Reflectance of the mirror that it is, at each of these (default 0).
    pub reflectance: Option<Vec<PerBand>>,
}

/// Material `transparent`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TransparentFile {
    /// Index of refraction, at least 1.
    #[schemars(range(min = 1, max = 1000))]
    pub ior: f64,
    /// In [0, 1]: multiplies what is transmitted at each crossing (default 1).
    pub tint: Option<PerBand>,
    /// Whether the polygon stands for a pane with two parallel faces (default false).
    #[serde(default)]
    pub thin: bool,
}

/// Material `leaf`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LeafFile {
    /// Index of refraction of the cuticle, at least 1 (default 1.425).
    #[schemars(range(min = 1, max = 1000))]
    pub ior: Option<f64>,
    /// Hemispherical reflectance near normal incidence; of the upper (front) face.
    pub reflectance: Option<PerBand>,
    /// Hemispherical transmittance near normal incidence; of light entering the front face.
    pub transmittance: Option<PerBand>,
    /// The lower (back) face; what it lacks is that of the front.
    pub back: Option<LeafBackFile>,
    /// A thin sheet (default true), or a closed solid with a dielectric interface.
    #[serde(default = "yes")]
    pub thin: bool,
    /// Of a solid leaf only: multiplies what is transmitted at each crossing (default 1).
    pub tint: Option<PerBand>,
}

fn yes() -> bool {
    true
}

/// The lower face of a leaf.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LeafBackFile {
    /// Hemispherical reflectance near normal incidence.
    pub reflectance: Option<PerBand>,
    /// Hemispherical transmittance of light entering this face.
    pub transmittance: Option<PerBand>,
}

/// Material `phong`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PhongFile {
    /// Lambertian reflectance (default 0).
    pub reflectance: Option<PerBand>,
    /// Specular reflectance (default 0).
    pub specular: Option<PerBand>,
    /// Lambertian transmittance (default 0).
    pub transmittance: Option<PerBand>,
    /// Exponent of the glossy lobe, at least 0; without it the lobe is a mirror.
    #[schemars(range(min = 0))]
    pub exponent: Option<f64>,
}

/// Scale, then rotation about x, then y, then z, then translation.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TransformFile {
    /// Positive (default 1).
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub scale: Option<f64>,
    /// Angles about x, y and z, degrees (default 0).
    pub rotate_deg: Option<[f64; 3]>,
    /// Shift, in the scene's unit (default 0).
    pub translate: Option<[f64; 3]>,
}

/// How the materials of a file of Radiance are meant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum DialectFile {
    /// As in Radiance.
    #[default]
    Radiance,
    /// As in SEC2: the colour is the whole reflectance, and a trans passes its transmission.
    Sec2,
}

/// Surfaces from an OBJ file, or from one in the format of Radiance.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("oneOf" = [{"required": ["obj"]}, {"required": ["rad"]}]))]
pub struct ObjectFile {
    /// Name (default: the OBJ file's).
    pub name: Option<String>,
    /// OBJ file, relative to the scene file.
    pub obj: Option<String>,
    /// File in the format of Radiance, in place of an OBJ file.
    pub rad: Option<String>,
    /// How its materials are meant (default radiance).
    pub dialect: Option<DialectFile>,
    /// Material of all its faces, in place of the file's own.
    pub material: Option<String>,
    /// Which axis of the OBJ file points up (default z); y turns (x, y, z) to (x, -z, y) before `transform`.
    #[serde(default)]
    pub up: UpFile,
    /// Where it stands.
    pub transform: Option<TransformFile>,
    /// Copies, each placed after `transform`.
    pub instances: Option<Vec<TransformFile>>,
    /// Whether its surfaces count light: true (one captor per OBJ group) or "triangle".
    #[serde(default)]
    pub captor: SurfaceCaptorFile,
    /// One more group that its captors belong to.
    pub group: Option<String>,
}

/// Which axis of a file points up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum UpFile {
    /// As in the scene.
    #[default]
    Z,
    /// As many modelling programs have it.
    Y,
}

/// One pattern, or several.
#[derive(Debug, JsonSchema)]
#[schemars(untagged)]
pub enum Patterns {
    /// One.
    One(String),
    /// Several.
    Several(Vec<String>),
}

impl Patterns {
    /// All of them.
    pub fn all(&self) -> &[String] {
        match self {
            Self::One(pattern) => std::slice::from_ref(pattern),
            Self::Several(patterns) => patterns,
        }
    }
}

impl<'de> Deserialize<'de> for Patterns {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl<'de> de::Visitor<'de> for Visitor {
            type Value = Patterns;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a pattern of ids such as \"plant/leaf3#*\", or a list of them")
            }
            fn visit_str<E>(self, text: &str) -> Result<Patterns, E> {
                Ok(Patterns::One(text.into()))
            }
            fn visit_seq<A: de::SeqAccess<'de>>(self, mut seq: A) -> Result<Patterns, A::Error> {
                let mut patterns = Vec::new();
                while let Some(pattern) = seq.next_element()? {
                    patterns.push(pattern);
                }
                Ok(Patterns::Several(patterns))
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}

/// Whether, and how finely, the surfaces of an object count light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SurfaceCaptorFile {
    /// Not at all.
    #[default]
    Off,
    /// One captor per OBJ group and instance.
    Groups,
    /// One captor per triangle.
    Triangles,
}

impl JsonSchema for SurfaceCaptorFile {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "SurfaceCaptor".into()
    }
    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "enum": [true, false, "triangle"] })
    }
}

impl<'de> Deserialize<'de> for SurfaceCaptorFile {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl de::Visitor<'_> for Visitor {
            type Value = SurfaceCaptorFile;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("true, false or \"triangle\"")
            }
            fn visit_bool<E>(self, v: bool) -> Result<Self::Value, E> {
                Ok(if v { SurfaceCaptorFile::Groups } else { SurfaceCaptorFile::Off })
            }
            fn visit_str<E: de::Error>(self, v: &str) -> Result<Self::Value, E> {
                match v {
                    "triangle" => Ok(SurfaceCaptorFile::Triangles),
                    _ => Err(E::invalid_value(de::Unexpected::Str(v), &self)),
                }
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}

tagged! {
    /// Where photons start. `power` is the total emitted flux, per band.
    pub enum LightFile {
        /// A point, alike in all directions.
        "point" => Point(PointFile),
        /// A point with uniform intensity inside a cone.
        "spot" => Spot(SpotFile),
        /// Lateral surface of a cylinder, Lambertian; or a line.
        "tube" => Tube(TubeFile),
        /// Polygon or OBJ file, Lambertian.
        "area" => Area(AreaFile),
        /// Lamps of a room in the format of Radiance.
        "rad" => Rad(RadLightFile),
        /// The sun: a disc infinitely far away.
        "sun" => Sun(SunFile),
        /// The sky above the horizon.
        "sky" => Sky(SkyFile),
        /// A picture of the light from all directions.
        "environment" => Environment(EnvironmentFile),
    }
}

impl LightFile {
    /// Whether it is infinitely far away.
    pub fn is_infinite(&self) -> bool {
        matches!(self, Self::Sun(_) | Self::Sky(_) | Self::Environment(_))
    }
}

/// Light `rad`: the lamps of a material in an object that is a file of Radiance.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RadLightFile {
    /// Name of the object.
    pub object: String,
    /// Name of the lamps' material in its file.
    pub material: String,
    /// Flux of all of them together; each takes its share by area.
    pub power: PowerFile,
}

/// Light `sun`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SunFile {
    /// Unique name (default sun).
    pub name: Option<String>,
    /// Half angle of its disc, degrees (default 0.2666); 0 is parallel rays.
    #[schemars(range(min = 0, max = 5))]
    pub half_angle_deg: Option<f64>,
    /// Irradiance across its direction, in the scene's quantity per m2; or `weather`.
    pub irradiance: Option<PerBand>,
    /// The scene's quantity per J of the whole spectrum (default: by the band's wavelengths).
    pub share: Option<PerBand>,
    /// Reflectance of the ground below the horizon, lit without shadows (default 0).
    pub ground: Option<PerBand>,
    /// Planar polygons just outside a roof or window, front to the sky, that its light comes in through alone
    /// (default: everywhere).
    #[schemars(extend("minItems" = 1))]
    pub through: Option<Vec<Vec<[f64; 3]>>>,
}

/// Light `sky`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SkyFile {
    /// Unique name (default sky).
    pub name: Option<String>,
    /// How its radiance is spread (default perez).
    #[serde(default)]
    pub model: SkyModelFile,
    /// Of the model `cie`: 1 to 15.
    #[schemars(range(min = 1, max = 15))]
    pub cie_type: Option<Count>,
    /// Irradiance of a horizontal plane, in the scene's quantity per m2; or `weather`.
    pub irradiance: Option<PerBand>,
    /// The scene's quantity per J of the whole spectrum (default: by the band's wavelengths).
    pub share: Option<PerBand>,
    /// Reflectance of the ground below the horizon, lit without shadows (default 0).
    pub ground: Option<PerBand>,
    /// Planar polygons just outside a roof or window, front to the sky, that its light comes in through alone
    /// (default: everywhere).
    #[schemars(extend("minItems" = 1))]
    pub through: Option<Vec<Vec<[f64; 3]>>>,
}

/// How the radiance of the sky is spread.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum SkyModelFile {
    /// By the weather (Perez, Seals and Michalsky, 1993).
    #[default]
    Perez,
    /// Alike everywhere.
    Uniform,
    /// The traditional overcast sky: the zenith three times as bright as the horizon.
    Overcast,
    /// A general sky of the CIE.
    Cie,
}

/// Light `environment`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EnvironmentFile {
    /// Unique name (default environment).
    pub name: Option<String>,
    /// Latitude-longitude picture, .exr or .hdr.
    pub file: String,
    /// Azimuth of its middle column, degrees clockwise from north (default 0).
    pub heading_deg: Option<f64>,
    /// What its texels are multiplied with to be radiances (default 1).
    pub scale: Option<PerBand>,
    /// Irradiance of an upward plane, in place of `scale`.
    pub irradiance: Option<PerBand>,
    /// Planar polygons just outside a roof or window, front to the sky, that its light comes in through alone
    /// (default: everywhere).
    #[schemars(extend("minItems" = 1))]
    pub through: Option<Vec<Vec<[f64; 3]>>>,
}

/// Light `point`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PointFile {
    /// Unique name (default light0, light1, ...).
    pub name: Option<String>,
    /// Where it is.
    pub position: [f64; 3],
    /// Total emitted flux; with `photometry` also "file".
    pub power: PowerFile,
    /// IES (LM-63) or EULUMDAT file of its intensity; without it alike in all directions.
    pub photometry: Option<String>,
    /// With `photometry` or `cosine`: where it aims (default [0, 0, -1], down).
    pub aim: Option<[f64; 3]>,
    /// With `photometry`: where C = 0 lies (default [1, 0, 0]).
    pub zero_plane: Option<[f64; 3]>,
    /// Exponent n of an intensity ~ cos^n of the angle to `aim`.
    #[schemars(range(min = 0))]
    pub cosine: Option<f64>,
}

/// Light `spot`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpotFile {
    /// Unique name (default light0, light1, ...).
    pub name: Option<String>,
    /// Where it is.
    pub position: [f64; 3],
    /// Axis of the cone; not zero.
    pub direction: [f64; 3],
    /// Half angle of the cone, degrees, in (0, 180].
    #[schemars(range(max = 180), extend("exclusiveMinimum" = 0))]
    pub half_angle_deg: f64,
    /// Total emitted flux.
    pub power: PowerFile,
}

/// Light `tube`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TubeFile {
    /// Unique name (default light0, light1, ...).
    pub name: Option<String>,
    /// One end of its axis.
    pub from: [f64; 3],
    /// The other end.
    pub to: [f64; 3],
    /// At least 0; 0 is a line.
    #[schemars(range(min = 0))]
    pub radius: f64,
    /// Pattern of a line (default lambert).
    #[serde(default)]
    pub emission: EmissionFile,
    /// Total emitted flux.
    pub power: PowerFile,
    /// With `opening_deg`: the middle of the part of the circumference that shines, from the axis.
    pub toward: Option<[f64; 3]>,
    /// With `toward`: how much of the circumference shines, degrees, in (0, 360].
    #[schemars(range(max = 360), extend("exclusiveMinimum" = 0))]
    pub opening_deg: Option<f64>,
    /// Makes the tube an obstacle of this material, with black ends.
    pub material: Option<String>,
}

/// How a tube emits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum EmissionFile {
    /// Lambertian.
    #[default]
    Lambert,
    /// Alike in all directions (radius 0 only).
    Isotropic,
}

/// Light `area`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AreaFile {
    /// Unique name (default light0, light1, ...).
    pub name: Option<String>,
    /// Corners of a polygon, counter-clockwise seen from its front; or `obj`.
    pub vertices: Option<Vec<[f64; 3]>>,
    /// OBJ file; or `vertices`.
    pub obj: Option<String>,
    /// Where the OBJ stands.
    pub transform: Option<TransformFile>,
    /// Copies of the OBJ, each placed after `transform`.
    pub instances: Option<Vec<TransformFile>>,
    /// Total emitted flux, with `photometry` also "file"; or `radiance`.
    pub power: Option<PowerFile>,
    /// Radiance of each emitting side; or `power`.
    pub radiance: Option<PerBand>,
    /// Whether the back emits too (default false).
    #[serde(default)]
    pub two_sided: bool,
    /// Makes the light an obstacle of this material.
    pub material: Option<String>,
    /// IES (LM-63) or EULUMDAT file of its intensity; without it Lambertian.
    pub photometry: Option<String>,
    /// With `photometry`: where it aims (default: the mean normal).
    pub aim: Option<[f64; 3]>,
    /// With `photometry`: where C = 0 lies (default [1, 0, 0]).
    pub zero_plane: Option<[f64; 3]>,
}

/// Captors: one of `csv`, `obj`, `disc`, `sphere`, `grid` and `line`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("oneOf" = [{"required": ["csv"]}, {"required": ["obj"]}, {"required": ["disc"]},
    {"required": ["sphere"]}, {"required": ["grid"]}, {"required": ["line"]}]))]
pub struct CaptorFile {
    /// First part of its captors' ids (default: the file's name; what is in no file needs one).
    pub name: Option<String>,
    /// Table of discs: x,y,z,radius,nx,ny,nz and optional id.
    pub csv: Option<String>,
    /// OBJ file, one captor per group.
    pub obj: Option<String>,
    /// Columns of the table that are passed over.
    #[serde(default)]
    pub ignore: Vec<String>,
    /// A single disc.
    pub disc: Option<DiscFile>,
    /// A sphere, which counts what enters it: its irradiance is the fluence rate.
    pub sphere: Option<SphereFile>,
    /// Discs in rows and columns.
    pub grid: Option<GridFile>,
    /// A strip.
    pub line: Option<LineFile>,
    /// Factor on what arrives, by its angle to the normal, degrees: linear between these, held at the ends.
    pub response: Option<Vec<[f64; 2]>>,
    /// Which faces count (default front).
    #[serde(default)]
    pub sides: SidesFile,
    /// One more group that its captors belong to.
    pub group: Option<String>,
}

/// Which faces of a virtual captor count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum SidesFile {
    /// Light against the normal.
    #[default]
    Front,
    /// Both faces, apart.
    Both,
}

/// A disc.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DiscFile {
    /// Its middle.
    pub center: [f64; 3],
    /// Where its front looks; not zero.
    pub normal: [f64; 3],
    /// Positive.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub radius: f64,
}

/// A sphere.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SphereFile {
    /// Its middle.
    pub center: [f64; 3],
    /// Positive.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub radius: f64,
}

/// Discs in the middles of the cells of a grid.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GridFile {
    /// Where it begins and ends along x.
    pub x: [f64; 2],
    /// Where it begins and ends along y.
    pub y: [f64; 2],
    /// Cells along x, at least 1.
    #[schemars(extend("minimum" = 1))]
    pub nx: Count,
    /// Cells along y, at least 1.
    #[schemars(extend("minimum" = 1))]
    pub ny: Count,
    /// Height of the discs.
    pub z: f64,
    /// Their radius, positive.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub radius: f64,
    /// Where their fronts look (default [0, 0, 1]); not zero.
    pub normal: Option<[f64; 3]>,
}

/// A strip, as a line sensor is.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LineFile {
    /// The middle of one end.
    pub from: [f64; 3],
    /// The middle of the other end.
    pub to: [f64; 3],
    /// Positive.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub width: f64,
    /// Where its front looks; not along the line, and what of it is along the line does not count.
    pub normal: [f64; 3],
}

/// Defaults of a run.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SettingsFile {
    /// Photons to trace, or paths over all captors, at least 1 (default 1e6).
    #[schemars(extend("minimum" = 1))]
    pub photons: Option<Count>,
    /// Seed of the random numbers (default 1).
    pub seed: Option<u64>,
    /// Photons of a k-nearest estimate, 0 for none (default: the number of those on the face to the
    /// power 2/3, at least 50).
    pub k: Option<Count>,
    /// The most arrivals in the photon map (default 2e6).
    pub map_photons: Option<Count>,
    /// What helps photons to captors that light hardly reaches (default: what a trial finds cheapest).
    #[serde(default)]
    pub guiding: Guiding,
    /// No longer a setting: `guiding` takes its place.
    #[schemars(skip)]
    pub splitting: Option<Count>,
    /// Largest relative standard error to stop at.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1))]
    pub tolerance: Option<f64>,
    /// Time to stop at, s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub max_time: Option<f64>,
    /// How to read the captors (default photons).
    #[serde(default)]
    pub estimator: Estimator,
    /// Threads, 0 for all processors (default 0).
    pub threads: Option<Count>,
}

/// The view to render.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraFile {
    /// Where the camera stands.
    pub position: [f64; 3],
    /// The point in the middle of the picture.
    pub look_at: [f64; 3],
    /// The way that is up in the picture (default z).
    pub up: Option<[f64; 3]>,
    /// Angle of view across the picture, from left to right, degrees, in (0, 180) (default 45).
    pub fov_deg: Option<f64>,
    /// Pixels across (default 800).
    pub width: Option<Count>,
    /// Pixels down (default 600).
    pub height: Option<Count>,
}
