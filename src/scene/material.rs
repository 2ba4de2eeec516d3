//! What a surface does with light: scatter it or absorb it. A closed set; every one conserves energy.

mod dielectric;
mod fresnel;
mod leaf;
mod phong;
mod table;
#[cfg(test)]
mod tests;

pub use dielectric::{Dielectric, Pane};
pub use fresnel::{Fresnel, diffuse_fresnel, normal_fresnel};
pub use leaf::{Leaf, LeafFace};
pub use phong::{MAX_EXPONENT, Phong, PhongFractions};
pub use table::{Basis, Bsdf, BsdfFaces, Cover, CoverRow, FaceValues, PairValues, Table};

use glam::Vec3;

use crate::{
    error::{Problem, check_length, check_range},
    math::{
        geometry::Frame,
        rng::Stream,
        sampling::{cosine_hemisphere, cosine_hemisphere_density},
        spectrum::{Lanes, Spectrum},
    },
};

/// Rounding that a sum of fractions in single precision may exceed 1 by.
const ROUNDING: f64 = 1e-6;

/// What a check of a value finds.
type Checked = Result<(), Problem>;

/// Refuses an index of refraction outside [1, 1000].
pub fn check_ior(ior: f64) -> Checked {
    if (1.0..=1000.0).contains(&ior) {
        return Ok(());
    }
    Err(Problem::new(format!("ior = {ior}, must be from 1 to 1000"), "water has 1.33, glass 1.5"))
}

/// Refuses fractions `names` of the band at `index` of `bands` that together are more than 1.
fn check_sum(names: &str, sum: f64, index: usize, bands: &[&str]) -> Checked {
    if sum <= 1.0 + ROUNDING {
        return Ok(());
    }
    let of_band = match bands {
        [_] => String::new(),
        _ => format!(" in band `{}`", bands[index]),
    };
    let problem = format!("{names} = {sum:.4}{of_band}, must be at most 1");
    Err(Problem::new(problem, "lower one of them"))
}

/// Which way a path is followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transport {
    /// Photons, from the lights: they carry power.
    Light,
    /// Paths from a captor: they carry importance (Veach 1997, ch. 5).
    Importance,
}

/// A path meeting a surface.
#[derive(Clone, Copy, Debug)]
pub struct Interaction {
    /// The way the path travels, unit vector.
    pub direction: Vec3,
    /// Unit normal on the side that the path comes from.
    pub normal: Vec3,
    /// Cosine of the angle of incidence, in (0, 1].
    pub cos: f32,
    /// Whether that side is the surface's front.
    pub front: bool,
    /// Index of the triangle, for tables that are turned about the normal.
    pub triangle: u32,
}

impl Interaction {
    /// A path along `direction` at a surface with unit normal `front_normal`.
    #[inline]
    pub fn new(direction: Vec3, front_normal: Vec3) -> Self {
        let dot = direction.dot(front_normal);
        let front = dot < 0.0;
        let normal = if front { front_normal } else { -front_normal };
        Self { direction, normal, cos: dot.abs().clamp(1e-7, 1.0), front, triangle: 0 }
    }

    /// The same on a triangle.
    #[inline]
    pub fn on(self, triangle: usize) -> Self {
        Self { triangle: triangle as u32, ..self }
    }

    /// The mirror direction.
    #[inline]
    fn mirrored(&self) -> Vec3 {
        (self.direction + 2.0 * self.cos * self.normal).normalize()
    }
}

/// How a path goes on. Nothing ends here by chance: absorption is a weight below 1.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample<L> {
    /// The new direction, unit vector.
    pub direction: Vec3,
    /// What each band is multiplied with: f |cos| over the density of the choice. At most 1, but where bands have
    /// their largest fractions in different lobes, or a Phong lobe's cosine is above its mean.
    pub weight: Spectrum<L>,
    /// By which of the surface's lobes it goes on.
    pub lobe: LobeKind,
}

impl<L: Lanes> BsdfSample<L> {
    /// By a diffuse lobe, on the side where the path came from or on the other.
    #[inline]
    fn diffuse(direction: Vec3, weight: Spectrum<L>, crosses: bool) -> Self {
        let lobe =
            if crosses { LobeKind::DiffuseTransmission } else { LobeKind::DiffuseReflection };
        Self { direction, weight, lobe }
    }

    /// In the mirror direction.
    #[inline]
    fn mirrored(at: &Interaction, weight: Spectrum<L>) -> Self {
        Self { direction: at.mirrored(), weight, lobe: LobeKind::MirrorReflection }
    }

    /// On through a thin sheet as if it were not there.
    #[inline]
    fn straight(at: &Interaction, weight: Spectrum<L>) -> Self {
        Self { direction: at.direction, weight, lobe: LobeKind::Straight }
    }
}

/// How a path leaves a surface.
///
/// Not a byte, which would be read together with others that were just written: a stall at each bounce.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum LobeKind {
    /// Straight on, through a thin pane or cover.
    Straight,
    /// In the mirror direction, while a part may go through.
    MirrorReflection,
    /// In the mirror direction inside a solid, out of which nothing comes at this angle.
    TotalReflection,
    /// Refracted at the surface of a solid.
    Refraction,
    /// In a random direction, with a density, on the side where the path came from.
    DiffuseReflection,
    /// In a random direction, with a density, on the other side.
    DiffuseTransmission,
}

impl LobeKind {
    /// Whether the path goes on at the other side of the surface.
    #[inline]
    pub fn crosses(self) -> bool {
        matches!(self, Self::Straight | Self::Refraction | Self::DiffuseTransmission)
    }

    /// Whether the new direction is random, with a density.
    #[inline]
    pub fn is_diffuse(self) -> bool {
        matches!(self, Self::DiffuseReflection | Self::DiffuseTransmission)
    }

    /// Whether the new direction follows from the old one, and is another.
    #[inline]
    pub fn is_specular(self) -> bool {
        matches!(self, Self::MirrorReflection | Self::TotalReflection | Self::Refraction)
    }
}

/// One way to scatter: the fraction of the incident power per band, as its largest value and
/// the bands relative to that.
#[derive(Clone, Debug, PartialEq)]
struct Lobe {
    largest: f32,
    relative: Vec<f32>,
}

impl Lobe {
    fn new(fractions: &[f32]) -> Self {
        let largest = fractions.iter().copied().fold(0.0, f32::max);
        let divisor = if largest > 0.0 { largest } else { 1.0 };
        Self { largest, relative: fractions.iter().map(|f| f / divisor).collect() }
    }

    /// Refuses all but one fraction in [0, 1] for each of so many bands.
    fn check(&self, name: &str, bands: usize) -> Checked {
        self.check_as(name, bands, |fraction| fraction)
    }

    /// The same of what was given for each fraction.
    fn check_as(&self, name: &str, bands: usize, given: impl Fn(f64) -> f64) -> Checked {
        check_length(self.relative.len(), bands).map_err(|problem| problem.of(name))?;
        (0..bands).try_for_each(|band| {
            let value = given(self.of_band(band));
            let rounded = if (1.0..1.0 + ROUNDING).contains(&value) { 1.0 } else { value };
            check_range(rounded, 0.0, 1.0).map_err(|problem| problem.of(name))
        })
    }

    /// The fraction of a band.
    fn of_band(&self, band: usize) -> f64 {
        // where none is above 0 they are not relative
        let largest = if self.largest > 0.0 { self.largest } else { 1.0 };
        f64::from(self.relative[band]) * f64::from(largest)
    }

    #[inline]
    fn relative<L: Lanes>(&self) -> Spectrum<L> {
        Spectrum::load(&self.relative)
    }

    #[inline]
    fn fraction<L: Lanes>(&self) -> Spectrum<L> {
        self.relative().scaled(self.largest)
    }

    /// The same value in every band.
    #[inline]
    fn all<L: Lanes>(&self, value: f32) -> Spectrum<L> {
        Spectrum::splat(self.relative.len(), value)
    }

    #[inline]
    fn nothing<L: Lanes>(&self) -> Spectrum<L> {
        self.all(0.0)
    }
}

/// The lobe that a path takes, each with a chance in proportion to the largest of its fractions. What the lobe's
/// relative bands are then multiplied with is `weight`, the sum of these.
struct Choice {
    lobe: usize,
    weight: f32,
}

/// Chooses a lobe by the largest band fraction of each; none where all is absorbed. One alone needs no number.
#[inline]
fn choose<const K: usize>(fractions: [f32; K], rng: &mut Stream) -> Option<Choice> {
    let last = fractions.iter().rposition(|&fraction| fraction > 0.0)?;
    let weight: f32 = fractions.iter().sum();
    let mut rest = if K == 1 { 0.0 } else { rng.uniform() * weight };
    let mut lobe = 0;
    while lobe < last && rest >= fractions[lobe] {
        rest -= fractions[lobe];
        lobe += 1;
    }
    Some(Choice { lobe, weight })
}

/// The diffuse direction about `normal`.
#[inline]
fn diffuse(normal: Vec3, rng: &mut Stream) -> Vec3 {
    Frame::new(normal).to_world(cosine_hemisphere(rng.square()))
}

/// A surface's optical behaviour. In a scene its values per band are padded with zeros to the scene's lanes.
#[derive(Clone, Debug, PartialEq)]
pub enum Material {
    /// Opaque and Lambertian, alike on both faces.
    Lambert(Lambert),
    /// Smooth interface of a closed solid: glass, water, the solid leaf.
    Dielectric(Dielectric),
    /// Thin pane with two parallel faces.
    Pane(Pane),
    /// Thin leaf with a cuticle.
    Leaf(Leaf),
    /// Lambertian, with a glossy or mirror lobe and diffuse transmission.
    Phong(Phong),
    /// Perfect mirror of some reflectance.
    Mirror(Mirror),
    /// Thin sheet as it was measured. Boxed, for the others are small.
    Table(Box<Table>),
}

impl Material {
    /// Refuses values that are not one for each of the bands of these names, or are out of their ranges.
    pub fn check(&self, names: &[&str]) -> Checked {
        let bands = names.len();
        match self {
            Self::Lambert(m) => m.lobe.check("reflectance", bands),
            Self::Dielectric(m) => m.check(bands),
            Self::Pane(m) => m.check(bands),
            Self::Leaf(m) => m.check(names),
            Self::Phong(m) => m.check(names),
            Self::Mirror(m) => m.lobe.check("reflectance", bands),
            Self::Table(m) => m.check(names),
        }
    }

    /// Pads its values with zeros to so many lanes.
    pub fn pad(&mut self, lanes: usize) {
        let lobes = match self {
            Self::Lambert(Lambert { lobe }) | Self::Mirror(Mirror { lobe }) => vec![lobe],
            Self::Dielectric(m) => vec![&mut m.tint],
            Self::Pane(m) => vec![&mut m.tint],
            Self::Leaf(m) => m.lobes_mut().into(),
            Self::Phong(m) => m.lobes_mut().into(),
            Self::Table(m) => return m.pad(lanes),
        };
        lobes.into_iter().for_each(|lobe| lobe.relative.resize(lanes, 0.0));
    }

    /// Whether it is a table that is turned about the normal, so that it has to know where its azimuth 0 is.
    pub fn needs_tangents(&self) -> bool {
        matches!(self, Self::Table(m) if m.needs_tangents())
    }

    /// Tells such a table where that is on each triangle, in rising order of their indices.
    pub(crate) fn set_tangents(&mut self, tangents: Vec<(u32, Vec3)>) {
        if let Self::Table(table) = self {
            table.set_tangents(tangents);
        }
    }

    /// Follows a path one interaction further; none where nothing goes on. Inlined
    /// for the walls, which are met most; the longer ones are called.
    #[inline(always)]
    pub fn sample<L: Lanes>(
        &self,
        interaction: &Interaction,
        transport: Transport,
        rng: &mut Stream,
    ) -> Option<BsdfSample<L>> {
        match self {
            Self::Lambert(m) => m.sample(interaction, rng),
            Self::Dielectric(m) => m.sample(interaction, transport, rng),
            Self::Pane(m) => m.sample(interaction, rng),
            Self::Leaf(m) => m.sample(interaction, transport, rng),
            Self::Phong(m) => m.sample(interaction, rng),
            Self::Mirror(m) => m.sample(interaction),
            Self::Table(m) => m.sample(interaction, transport, rng),
        }
    }

    /// Scattering function f per band, 1/sr, for light that meets the surface at `interaction` and
    /// leaves along `outgoing`, without the lobes that are mirrors.
    #[inline]
    pub fn evaluate<L: Lanes>(&self, interaction: &Interaction, outgoing: Vec3) -> Spectrum<L> {
        match self {
            Self::Lambert(m) => m.evaluate(interaction, outgoing),
            Self::Leaf(m) => m.evaluate(interaction, outgoing),
            Self::Phong(m) => m.evaluate(interaction, outgoing),
            Self::Table(m) => m.evaluate(interaction, outgoing),
            Self::Dielectric(Dielectric { tint: lobe, .. })
            | Self::Pane(Pane { tint: lobe, .. })
            | Self::Mirror(Mirror { lobe }) => lobe.nothing(),
        }
    }

    /// The ways in which light goes on mirrored, refracted or straight: together with
    /// [`evaluate`](Self::evaluate) all that is scattered. Each has as weight what it carries per band.
    pub fn smooth_ways<L: Lanes>(
        &self,
        interaction: &Interaction,
        transport: Transport,
    ) -> [Option<BsdfSample<L>>; 2] {
        let mirrored = |fraction: Spectrum<L>| {
            let some = !fraction.is_zero();
            [some.then(|| BsdfSample::mirrored(interaction, fraction)), None]
        };
        match self {
            Self::Lambert(_) => [None, None],
            Self::Dielectric(m) => m.ways(interaction, transport),
            Self::Pane(m) => m.ways(interaction),
            Self::Leaf(m) => mirrored(m.mirrored(interaction)),
            Self::Phong(m) => mirrored(m.mirrored()),
            Self::Mirror(m) => mirrored(m.lobe.fraction()),
            Self::Table(m) => m.ways(interaction),
        }
    }

    /// Fraction per band that goes straight through, of light along `direction`; none where no light does, as it does
    /// through thin panes and some tables.
    #[inline]
    pub fn straight<L: Lanes>(&self, direction: Vec3, front_normal: Vec3) -> Option<Spectrum<L>> {
        let interaction = || Interaction::new(direction, front_normal);
        match self {
            Self::Pane(m) => Some(m.transmittance(&interaction())),
            Self::Table(m) if m.passes_straight() => Some(m.straight(&interaction())),
            _ => None,
        }
    }

    /// Density with which [`sample`](Self::sample) goes on along `outgoing`, 1/sr, without the
    /// lobes that are mirrors; it integrates to the chance that the path goes on in the others.
    #[inline]
    pub fn pdf(&self, interaction: &Interaction, transport: Transport, outgoing: Vec3) -> f32 {
        match self {
            Self::Lambert(m) => m.pdf(interaction, outgoing),
            Self::Leaf(m) => m.pdf(interaction, transport, outgoing),
            Self::Phong(m) => m.pdf(interaction, outgoing),
            Self::Table(m) => m.pdf(interaction, transport, outgoing),
            Self::Dielectric(_) | Self::Pane(_) | Self::Mirror(_) => 0.0,
        }
    }

    /// Fraction of the incident power that is absorbed, per band; `None` where no closed form is
    /// known (the Phong lobe).
    #[inline]
    pub fn absorptance<L: Lanes>(&self, interaction: &Interaction) -> Option<Spectrum<L>> {
        match self {
            Self::Lambert(m) => Some(complement(m.lobe.fraction())),
            Self::Dielectric(m) => Some(m.absorptance(interaction)),
            Self::Pane(m) => Some(m.absorptance(interaction)),
            Self::Leaf(m) => Some(m.absorptance(interaction)),
            Self::Phong(m) => m.absorptance(),
            Self::Mirror(m) => Some(complement(m.lobe.fraction())),
            Self::Table(m) => Some(m.absorptance(interaction)),
        }
    }

    /// Radiance that leaves it by other ways than mirrors at an angle of this cosine, as a share of what leaves along the
    /// normal of the same side; none where that depends on where light comes from.
    pub fn relative_radiance(&self, cos: f32) -> Option<f32> {
        match self {
            Self::Lambert(_) => Some(1.0),
            Self::Leaf(m) => Some(m.relative_radiance(cos)),
            Self::Phong(m) if m.glossy() == 0.0 => Some(1.0),
            _ => None,
        }
    }

    /// Whether light leaves it by other ways than mirrors, so that it has a radiance to estimate.
    pub fn is_diffuse(&self) -> bool {
        match self {
            Self::Lambert(_) | Self::Leaf(_) | Self::Phong(_) => true,
            Self::Table(m) => m.is_diffuse(),
            Self::Dielectric(_) | Self::Pane(_) | Self::Mirror(_) => false,
        }
    }

    /// Whether some light leaves it by other ways than mirrors at the far side.
    pub fn transmits_diffusely(&self) -> bool {
        match self {
            Self::Lambert(_) | Self::Dielectric(_) | Self::Pane(_) | Self::Mirror(_) => false,
            Self::Leaf(_) => true,
            Self::Phong(m) => m.transmits(),
            Self::Table(m) => m.transmits_diffusely(),
        }
    }

    /// Whether some light leaves it mirrored or refracted.
    pub fn has_mirror(&self) -> bool {
        match self {
            Self::Lambert(_) => false,
            Self::Dielectric(_) | Self::Pane(_) | Self::Mirror(_) => true,
            Self::Leaf(m) => m.has_cuticle(),
            Self::Phong(m) => m.has_mirror(),
            Self::Table(m) => m.has_mirror(),
        }
    }

    /// Fraction of the light that leaves it in a lobe around the mirror direction; 0 where there is none
    /// or it is a mirror.
    pub fn glossy(&self) -> f32 {
        match self {
            Self::Phong(m) => m.glossy(),
            _ => 0.0,
        }
    }

    /// Whether it can be seen through: glass and water, and covers that do not scatter.
    pub fn is_clear(&self) -> bool {
        match self {
            Self::Table(m) => m.passes_straight() && !m.is_diffuse(),
            _ => matches!(self, Self::Dielectric(_) | Self::Pane(_)),
        }
    }

    /// Whether it is the interface of a closed solid.
    pub fn is_solid(&self) -> bool {
        matches!(self, Self::Dielectric(_))
    }
}

fn complement<L: Lanes>(scattered: Spectrum<L>) -> Spectrum<L> {
    scattered.map(|s| (1.0 - s).max(0.0))
}

/// Opaque Lambertian surface: f = reflectance / pi on both faces (Lambert 1760).
#[derive(Clone, Debug, PartialEq)]
pub struct Lambert {
    lobe: Lobe,
}

impl Lambert {
    /// From the reflectance per band, in [0, 1].
    pub fn new(reflectance: &[f32]) -> Self {
        Self { lobe: Lobe::new(reflectance) }
    }

    /// Its reflectance per lane.
    pub fn reflectance(&self) -> impl Iterator<Item = f32> {
        self.lobe.relative.iter().map(|r| r * self.lobe.largest)
    }

    #[inline]
    fn sample<L: Lanes>(&self, at: &Interaction, rng: &mut Stream) -> Option<BsdfSample<L>> {
        let reflected =
            || BsdfSample::diffuse(diffuse(at.normal, rng), self.lobe.fraction(), false);
        (self.lobe.largest > 0.0).then(reflected)
    }

    #[inline]
    fn evaluate<L: Lanes>(&self, at: &Interaction, outgoing: Vec3) -> Spectrum<L> {
        let above = outgoing.dot(at.normal) > 0.0;
        let fraction = if above { self.lobe.fraction() } else { self.lobe.nothing() };
        fraction.scaled(1.0 / std::f32::consts::PI)
    }

    #[inline]
    fn pdf(&self, at: &Interaction, outgoing: Vec3) -> f32 {
        let reflects = self.lobe.largest > 0.0;
        if reflects { cosine_hemisphere_density(outgoing.dot(at.normal)) } else { 0.0 }
    }
}

/// Mirror that reflects the same fraction at every angle, on both faces.
#[derive(Clone, Debug, PartialEq)]
pub struct Mirror {
    lobe: Lobe,
}

impl Mirror {
    /// From the reflectance per band, in [0, 1].
    pub fn new(reflectance: &[f32]) -> Self {
        Self { lobe: Lobe::new(reflectance) }
    }

    #[inline]
    fn sample<L: Lanes>(&self, at: &Interaction) -> Option<BsdfSample<L>> {
        let mirrored = || BsdfSample::mirrored(at, self.lobe.fraction());
        (self.lobe.largest > 0.0).then(mirrored)
    }
}
