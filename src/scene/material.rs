//! Materials: what a surface does with the light that meets it, one interaction at a time. A
//! material scatters light or absorbs it. The set of materials is closed, and every material
//! conserves energy.
//!
//! Read [`Interaction`], [`BsdfSample`] and [`Material`] first. Each file of the folder then holds
//! one material; `table` holds the measured ones. Nothing here knows lights, captors or what lies
//! beyond the surface.

mod dielectric;
mod fresnel;
mod leaf;
mod phong;
mod prospect;
mod table;
#[cfg(test)]
mod tests;

pub use dielectric::{Dielectric, Pane};
pub use fresnel::{Fresnel, diffuse_fresnel, normal_fresnel};
pub use leaf::{Leaf, LeafFace};
pub use phong::{MAX_EXPONENT, Phong, PhongFractions};
pub use prospect::{LeafSpectra, Prospect};
pub use table::{Basis, Bsdf, BsdfFaces, Cover, CoverRow, FaceValues, PairValues, Table};

use glam::{Vec2, Vec3};

use crate::{
    error::{Problem, check_length, check_range},
    math::{
        geometry::Frame,
        rng::Stream,
        sampling::{cosine_hemisphere, cosine_hemisphere_density},
        spectrum::{Lanes, Spectrum},
    },
};

/// Rounding error by which a sum of fractions in single precision may exceed 1.
const ROUNDING: f64 = 1e-6;

/// Result of a check of values: nothing, or what is wrong with them.
type Checked = Result<(), Problem>;

/// Checks an index of refraction. Error: it is outside [1, 1000].
pub fn check_ior(ior: f64) -> Checked {
    if (1.0..=1000.0).contains(&ior) {
        return Ok(());
    }
    Err(Problem::new(format!("ior = {ior}, must be from 1 to 1000"), "water has 1.33, glass 1.5"))
}

/// Checks the sum of fractions in one band. `names` says which fractions they are, `index` is the
/// band's index in `bands`. Error: the sum is above 1 by more than rounding.
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

/// Quantity that a path carries, and thereby whether it follows light forward or backward.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transport {
    /// Photons, which start at the lights and carry power.
    Light,
    /// Paths, which start at a captor and carry importance (Veach 1997, ch. 5).
    Importance,
}

/// Meeting of a path with a surface.
#[derive(Clone, Copy, Debug)]
pub struct Interaction {
    /// Direction in which the path travels, unit vector.
    pub direction: Vec3,
    /// Unit normal on the side that the path comes from.
    pub normal: Vec3,
    /// Cosine of the angle of incidence, in (0, 1].
    pub cos: f32,
    /// Whether the path comes from the front of the surface.
    pub front: bool,
    /// Index of the triangle, which tables that are turned about the normal need.
    pub triangle: u32,
}

impl Interaction {
    /// Describes a path along `direction` that meets a surface with the unit normal `front_normal`
    /// on its front. The triangle has index 0 until [`on`](Self::on) sets it.
    #[inline]
    pub fn new(direction: Vec3, front_normal: Vec3) -> Self {
        let dot = direction.dot(front_normal);
        let front = dot < 0.0;
        let normal = if front { front_normal } else { -front_normal };
        Self { direction, normal, cos: dot.abs().clamp(1e-7, 1.0), front, triangle: 0 }
    }

    /// Returns the same interaction on the triangle of this index.
    #[inline]
    pub fn on(self, triangle: usize) -> Self {
        Self { triangle: triangle as u32, ..self }
    }

    /// Returns the mirror direction, unit vector.
    #[inline]
    fn mirrored(&self) -> Vec3 {
        (self.direction + 2.0 * self.cos * self.normal).normalize()
    }
}

/// Direction and weight with which a path leaves a surface. No path ends here by chance: absorption
/// is a weight below 1.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample<L> {
    /// The new direction, unit vector.
    pub direction: Vec3,
    /// Factor for each band: f |cos| over the density of the sampled direction. For photons it is
    /// at most 1, except where bands have their largest fractions in different lobes, or where the
    /// cosine of a Phong lobe's direction is above the mean. For importance it can be above 1 in
    /// two more cases: a refraction brings the factor (n here / n there)^2, and the diffuse part of
    /// a cover belongs to the angle at which the path goes on.
    pub weight: Spectrum<L>,
    /// Lobe of the surface by which the path goes on.
    pub lobe: LobeKind,
}

impl<L: Lanes> BsdfSample<L> {
    /// Makes a sample of a diffuse lobe: on the side that the path came from, or on the other side
    /// if it `crosses` the surface.
    #[inline]
    fn diffuse(direction: Vec3, weight: Spectrum<L>, crosses: bool) -> Self {
        let lobe =
            if crosses { LobeKind::DiffuseTransmission } else { LobeKind::DiffuseReflection };
        Self { direction, weight, lobe }
    }

    /// Makes a sample in the mirror direction.
    #[inline]
    fn mirrored(at: &Interaction, weight: Spectrum<L>) -> Self {
        Self { direction: at.mirrored(), weight, lobe: LobeKind::MirrorReflection }
    }

    /// Makes a sample that goes straight on through a thin sheet.
    #[inline]
    fn straight(at: &Interaction, weight: Spectrum<L>) -> Self {
        Self { direction: at.direction, weight, lobe: LobeKind::Straight }
    }
}

/// Kind of lobe by which a path leaves a surface.
///
/// A value is 4 bytes wide: a single byte would be read together with other bytes that were just
/// written, which stalls the processor at each bounce.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum LobeKind {
    /// Straight on, through a thin pane or cover.
    Straight,
    /// In the mirror direction, at an angle at which some light may also go through.
    MirrorReflection,
    /// In the mirror direction inside a solid, at an angle at which no light leaves it.
    TotalReflection,
    /// Refracted at the surface of a solid.
    Refraction,
    /// In a random direction with a density, on the side that the path came from.
    DiffuseReflection,
    /// In a random direction with a density, on the other side.
    DiffuseTransmission,
}

impl LobeKind {
    /// Returns whether the path goes on at the other side of the surface.
    #[inline]
    pub fn crosses(self) -> bool {
        matches!(self, Self::Straight | Self::Refraction | Self::DiffuseTransmission)
    }

    /// Returns whether the new direction is random, with a density.
    #[inline]
    pub fn is_diffuse(self) -> bool {
        matches!(self, Self::DiffuseReflection | Self::DiffuseTransmission)
    }

    /// Returns whether the new direction differs from the old one and is fixed by it.
    #[inline]
    pub fn is_specular(self) -> bool {
        matches!(self, Self::MirrorReflection | Self::TotalReflection | Self::Refraction)
    }
}

/// One lobe: the fraction of the incident power that it scatters in each band. The fractions are
/// stored as the largest of them, and the ratio of each to it.
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

    /// Checks the fractions of the lobe called `name`. Error: there is not one for each of `bands`
    /// bands, or one is outside [0, 1] by more than rounding.
    fn check(&self, name: &str, bands: usize) -> Checked {
        self.check_as(name, bands, |fraction| fraction)
    }

    /// Checks like [`check`](Self::check), where `given` computes from a stored fraction the value
    /// that the user gave, which has to be in [0, 1].
    fn check_as(&self, name: &str, bands: usize, given: impl Fn(f64) -> f64) -> Checked {
        check_length(self.relative.len(), bands).map_err(|problem| problem.of(name))?;
        (0..bands).try_for_each(|band| {
            let value = given(self.of_band(band));
            let rounded = if (1.0..1.0 + ROUNDING).contains(&value) { 1.0 } else { value };
            check_range(rounded, 0.0, 1.0).map_err(|problem| problem.of(name))
        })
    }

    /// Returns the fraction of a band.
    fn of_band(&self, band: usize) -> f64 {
        // where no fraction is above 0, `relative` holds the fractions themselves
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

    /// Returns a spectrum with the same value in every band.
    #[inline]
    fn all<L: Lanes>(&self, value: f32) -> Spectrum<L> {
        Spectrum::splat(self.relative.len(), value)
    }

    #[inline]
    fn nothing<L: Lanes>(&self) -> Spectrum<L> {
        self.all(0.0)
    }
}

/// Lobe that was chosen for a path. `lobe` is its index. `weight` is the sum of the largest
/// fractions of all lobes; the relative fractions of the lobe times `weight` are the weight of the
/// sample.
struct Choice {
    lobe: usize,
    weight: f32,
}

/// Chooses a lobe with a chance in proportion to its entry in `fractions`, the largest fraction of
/// the lobe in any band. Returns `None` where all are 0, so that all light is absorbed. A single
/// lobe needs no random number.
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

/// Draws a direction about `normal` with the density cos / pi.
#[inline]
fn diffuse(normal: Vec3, rng: &mut Stream) -> Vec3 {
    Frame::new(normal).to_world(cosine_hemisphere(rng.square()))
}

/// Optical behaviour of a surface. In a scene its values per band are padded with zeros to the
/// number of lanes of the scene.
#[derive(Clone, Debug, PartialEq)]
pub enum Material {
    /// Opaque and Lambertian, with both faces alike.
    Lambert(Lambert),
    /// Smooth interface of a closed solid, such as glass, water or a leaf that is modelled as a
    /// solid.
    Dielectric(Dielectric),
    /// Thin pane with two parallel faces.
    Pane(Pane),
    /// Thin leaf with a cuticle.
    Leaf(Leaf),
    /// Lambertian reflection and transmission, with a glossy lobe or a mirror.
    Phong(Phong),
    /// Mirror that reflects the same fraction at every angle.
    Mirror(Mirror),
    /// Thin sheet as it was measured. It is boxed because the other variants are small.
    Table(Box<Table>),
}

impl Material {
    /// Checks the values of the material. `names` are the names of the bands. Error: there is not
    /// one value for each band, or a value is out of its range.
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

    /// Pads the values per band with zeros to this number of lanes.
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

    /// Returns whether the material is a table that is turned about the normal, so that it needs
    /// the direction of azimuth 0 on each triangle.
    pub fn needs_tangents(&self) -> bool {
        matches!(self, Self::Table(m) if m.needs_tangents())
    }

    /// Sets the direction of azimuth 0 on each triangle of such a table; other materials ignore it.
    /// `tangents` holds the index of the triangle and the direction, in rising order of the
    /// indices.
    pub(crate) fn set_tangents(&mut self, tangents: Vec<(u32, Vec3)>) {
        if let Self::Table(table) = self {
            table.set_tangents(tangents);
        }
    }

    /// Samples the direction in which a path leaves the surface. Returns `None` where nothing goes
    /// on. This function is inlined for Lambertian walls, which are met most; the longer samplers
    /// are called.
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

    /// Returns the scattering function f per band, 1/sr, for light that meets the surface at
    /// `interaction` and leaves along `outgoing` (unit vector). Light that is mirrored, refracted
    /// or goes straight on is not part of f.
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

    /// Returns the mirrored, refracted and straight directions in which light goes on, each with
    /// the fraction that it carries per band as its weight. Together with
    /// [`evaluate`](Self::evaluate) they hold all light that is scattered.
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

    /// Returns the fraction per band of light along `direction` that goes straight through. Returns
    /// `None` for materials through which no light goes straight; thin panes and some tables let it
    /// through.
    #[inline]
    pub fn straight<L: Lanes>(&self, direction: Vec3, front_normal: Vec3) -> Option<Spectrum<L>> {
        let interaction = || Interaction::new(direction, front_normal);
        match self {
            Self::Pane(m) => Some(m.transmittance(&interaction())),
            Self::Table(m) if m.passes_straight() => Some(m.straight(&interaction())),
            _ => None,
        }
    }

    /// Returns the density, 1/sr, with which [`sample`](Self::sample) draws the direction
    /// `outgoing`, without mirrored, refracted and straight directions. Its integral is the chance
    /// that the path goes on by a diffuse lobe.
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

    /// Returns the fraction of the incident power that is absorbed, per band, or `None` where no
    /// closed form is known (the glossy Phong lobe).
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

    /// Returns the diffusely scattered radiance that leaves the surface at an angle of this cosine
    /// to the normal, relative to the radiance along the normal of the same side. Returns `None`
    /// where it depends on the direction that the light comes from.
    pub fn relative_radiance(&self, cos: f32) -> Option<f32> {
        match self {
            Self::Lambert(_) => Some(1.0),
            Self::Leaf(m) => Some(m.relative_radiance(cos)),
            Self::Phong(m) if m.glossy() == 0.0 => Some(1.0),
            _ => None,
        }
    }

    /// Returns whether some light is scattered diffusely, so that the surface has a radiance to
    /// estimate.
    pub fn is_diffuse(&self) -> bool {
        match self {
            Self::Lambert(_) | Self::Leaf(_) | Self::Phong(_) => true,
            Self::Table(m) => m.is_diffuse(),
            Self::Dielectric(_) | Self::Pane(_) | Self::Mirror(_) => false,
        }
    }

    /// Returns whether some light is transmitted diffusely to the other side.
    pub fn transmits_diffusely(&self) -> bool {
        match self {
            Self::Lambert(_) | Self::Dielectric(_) | Self::Pane(_) | Self::Mirror(_) => false,
            Self::Leaf(_) => true,
            Self::Phong(m) => m.transmits(),
            Self::Table(m) => m.transmits_diffusely(),
        }
    }

    /// Returns whether some light leaves the surface mirrored or refracted.
    pub fn has_mirror(&self) -> bool {
        match self {
            Self::Lambert(_) => false,
            Self::Dielectric(_) | Self::Pane(_) | Self::Mirror(_) => true,
            Self::Leaf(m) => m.has_cuticle(),
            Self::Phong(m) => m.has_mirror(),
            Self::Table(m) => m.has_mirror(),
        }
    }

    /// Returns the largest fraction of light in any band that is scattered into a glossy lobe
    /// around the mirror direction, or 0 where there is no such lobe or it is a mirror.
    pub fn glossy(&self) -> f32 {
        match self {
            Self::Phong(m) => m.glossy(),
            _ => 0.0,
        }
    }

    /// Returns whether one can see through the surface, as through glass, water and covers that do
    /// not scatter.
    pub fn is_clear(&self) -> bool {
        match self {
            Self::Table(m) => m.passes_straight() && !m.is_diffuse(),
            _ => matches!(self, Self::Dielectric(_) | Self::Pane(_)),
        }
    }

    /// Returns whether the surface is the interface of a closed solid.
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
    /// Makes the material from its reflectance per band, in [0, 1].
    pub fn new(reflectance: &[f32]) -> Self {
        Self { lobe: Lobe::new(reflectance) }
    }

    /// Returns the reflectance of each lane in order.
    pub fn reflectance(&self) -> impl Iterator<Item = f32> {
        self.lobe.relative.iter().map(|r| r * self.lobe.largest)
    }

    #[inline]
    fn sample<L: Lanes>(&self, at: &Interaction, rng: &mut Stream) -> Option<BsdfSample<L>> {
        let (weight, numbers) = self.draw(rng)?;
        Some(BsdfSample::diffuse(Self::direction(at, numbers), weight, false))
    }

    /// Draws what a [sample](Material::sample) has to draw: returns its weight, and the numbers of
    /// its [direction](Self::direction). Returns `None` where nothing goes on.
    #[inline]
    pub fn draw<L: Lanes>(&self, rng: &mut Stream) -> Option<(Spectrum<L>, Vec2)> {
        (self.lobe.largest > 0.0).then(|| (self.lobe.fraction(), rng.square()))
    }

    /// Returns the direction of a sample. The lobe is a diffuse reflection.
    #[inline]
    pub fn direction(at: &Interaction, numbers: Vec2) -> Vec3 {
        Frame::new(at.normal).to_world(cosine_hemisphere(numbers))
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
    /// Makes the material from its reflectance per band, in [0, 1].
    pub fn new(reflectance: &[f32]) -> Self {
        Self { lobe: Lobe::new(reflectance) }
    }

    #[inline]
    fn sample<L: Lanes>(&self, at: &Interaction) -> Option<BsdfSample<L>> {
        let mirrored = || BsdfSample::mirrored(at, self.lobe.fraction());
        (self.lobe.largest > 0.0).then(mirrored)
    }
}
