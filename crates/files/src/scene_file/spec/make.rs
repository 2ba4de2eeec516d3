//! How a program makes the parts of a description: the values that each part must have are the
//! arguments, and all others have the defaults of a scene file until they are set.

use super::*;

impl From<f64> for PerBand {
    fn from(value: f64) -> Self {
        Self::All(value)
    }
}

impl From<Vec<f64>> for PerBand {
    fn from(values: Vec<f64>) -> Self {
        Self::Each(values)
    }
}

impl<const N: usize> From<[f64; N]> for PerBand {
    fn from(values: [f64; N]) -> Self {
        Self::Each(values.into())
    }
}

impl From<SpectrumSpec> for PerBand {
    fn from(spectrum: SpectrumSpec) -> Self {
        Self::Spectrum(spectrum)
    }
}

impl<T: Into<PerBand>> From<T> for PowerSpec {
    fn from(flux: T) -> Self {
        Self::Given(flux.into())
    }
}

impl From<LampSpectrumSpec> for PowerSpec {
    fn from(spectrum: LampSpectrumSpec) -> Self {
        Self::Spectrum(spectrum)
    }
}

impl From<u64> for Count {
    fn from(number: u64) -> Self {
        Self(number)
    }
}

impl From<&str> for Patterns {
    fn from(pattern: &str) -> Self {
        Self::One(pattern.into())
    }
}

impl<const N: usize> From<[&str; N]> for Patterns {
    fn from(patterns: [&str; N]) -> Self {
        Self::Several(patterns.map(String::from).into())
    }
}

impl LambertSpec {
    /// A Lambertian surface that reflects this fraction of light, in [0, 1].
    pub fn new(reflectance: impl Into<PerBand>) -> Self {
        Self { reflectance: reflectance.into() }
    }
}

impl MirrorSpec {
    /// A mirror that reflects this fraction of light, in [0, 1].
    pub fn new(reflectance: impl Into<PerBand>) -> Self {
        Self { reflectance: reflectance.into() }
    }
}

impl TransparentSpec {
    /// A closed solid of this index of refraction, at least 1.
    pub fn solid(ior: f64) -> Self {
        Self { ior, tint: None, thin: false }
    }

    /// A pane of this index of refraction, at least 1, whose two faces are one polygon.
    pub fn pane(ior: f64) -> Self {
        Self { thin: true, ..Self::solid(ior) }
    }
}

impl LeafSpec {
    /// A thin leaf of this hemispherical reflectance and transmittance near normal incidence, both
    /// faces alike.
    pub fn new(reflectance: impl Into<PerBand>, transmittance: impl Into<PerBand>) -> Self {
        let (reflectance, transmittance) = (reflectance.into(), transmittance.into());
        Self {
            reflectance: Some(reflectance),
            transmittance: Some(transmittance),
            ..Self::default()
        }
    }
}

impl Default for LeafSpec {
    /// A thin leaf without any value, which says neither R and T nor what it is made of.
    fn default() -> Self {
        let (reflectance, transmittance, prospect, back) = (None, None, None, None);
        let (ior, tint) = (None, None);
        Self { ior, reflectance, transmittance, prospect, back, thin: true, tint }
    }
}

impl TransformSpec {
    /// A translation, in the scene's unit.
    pub fn to(place: [f64; 3]) -> Self {
        Self { translate: Some(place), ..Self::default() }
    }
}

impl ObjectSpec {
    /// A mesh that was handed over under this name, all of one material.
    pub fn mesh(name: &str, material: &str) -> Self {
        Self {
            name: Some(name.into()),
            obj: Some(in_memory(name)),
            material: Some(material.into()),
            ..Self::default()
        }
    }

    /// Copies that stand in these places, in the scene's unit.
    pub fn at(self, places: impl IntoIterator<Item = [f64; 3]>) -> Self {
        let copies = places.into_iter().map(TransformSpec::to).collect();
        Self { instances: Some(InstancesSpec::List(copies)), ..self }
    }

    /// Surfaces that count light, one captor for each group of the mesh and each copy.
    pub fn captor(self) -> Self {
        Self { captor: SurfaceCaptorSpec::Groups, ..self }
    }
}

impl PointSpec {
    /// A point at `position`, in the scene's unit, that emits `power` alike in all directions.
    pub fn new(position: [f64; 3], power: impl Into<PowerSpec>) -> Self {
        Self {
            name: None,
            position,
            power: power.into(),
            photometry: None,
            aim: None,
            zero_plane: None,
            set: None,
            lm_per_w: None,
            lm_per_umol: None,
            cosine: None,
            watts: None,
        }
    }
}

impl SpotSpec {
    /// A point that emits `power` into a cone about `direction`, of `half_angle_deg` in (0, 180].
    pub fn new(
        position: [f64; 3],
        direction: [f64; 3],
        half_angle_deg: f64,
        power: impl Into<PowerSpec>,
    ) -> Self {
        let power = power.into();
        Self { name: None, position, direction, half_angle_deg, power, watts: None }
    }
}

impl TubeSpec {
    /// A tube from one end of its axis to the other, of a radius of at least 0, in the scene's
    /// unit, that emits `power`.
    pub fn new(from: [f64; 3], to: [f64; 3], radius: f64, power: impl Into<PowerSpec>) -> Self {
        Self {
            name: None,
            from,
            to,
            radius,
            emission: EmissionSpec::default(),
            power: power.into(),
            toward: None,
            opening_deg: None,
            material: None,
            watts: None,
        }
    }
}

impl AreaSpec {
    /// A polygon of these corners, counter-clockwise seen from its front, that emits `power` from
    /// its front.
    pub fn polygon(vertices: Vec<[f64; 3]>, power: impl Into<PowerSpec>) -> Self {
        Self { vertices: Some(vertices), power: Some(power.into()), ..Self::default() }
    }

    /// A mesh that was handed over under this name, that emits `power` from its fronts.
    pub fn mesh(name: &str, power: impl Into<PowerSpec>) -> Self {
        Self { obj: Some(in_memory(name)), power: Some(power.into()), ..Self::default() }
    }
}

impl EnvironmentSpec {
    /// The light of a latitude-longitude picture, a .exr or .hdr file.
    pub fn new(file: &str) -> Self {
        let (name, file, heading_deg) = (None, file.into(), None);
        Self { name, file, heading_deg, scale: None, irradiance: None, through: None }
    }
}

impl CaptorSpec {
    /// A disc with its front towards `normal`, in the scene's unit.
    pub fn disc(name: &str, center: [f64; 3], normal: [f64; 3], radius: f64) -> Self {
        Self { disc: Some(DiscSpec { center, normal, radius }), ..Self::named(name) }
    }

    /// A sphere, in the scene's unit.
    pub fn sphere(name: &str, center: [f64; 3], radius: f64) -> Self {
        Self { sphere: Some(SphereSpec { center, radius }), ..Self::named(name) }
    }

    /// Discs in rows and columns.
    pub fn grid(name: &str, grid: GridSpec) -> Self {
        Self { grid: Some(grid), ..Self::named(name) }
    }

    /// A strip.
    pub fn line(name: &str, line: LineSpec) -> Self {
        Self { line: Some(line), ..Self::named(name) }
    }

    /// A mesh that was handed over under this name, each of whose groups is one captor.
    pub fn mesh(name: &str) -> Self {
        Self { obj: Some(in_memory(name)), ..Self::named(name) }
    }

    /// Captors of this name that have no shape yet.
    fn named(name: &str) -> Self {
        Self { name: Some(name.into()), ..Self::default() }
    }
}

/// Returns what stands for a mesh in memory where a file has a path.
fn in_memory(mesh: &str) -> String {
    format!("mesh:{mesh}")
}
