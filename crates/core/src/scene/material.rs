//! Materials: what a surface does with the light that meets it, one interaction at a time. A
//! material scatters light or absorbs it. The set of materials is closed, and every material
//! conserves energy: its constructor refuses values that do not.
//!
//! Read [`Interaction`], [`BsdfSample`] and [`Scatterer`] first: what every material does. Each file
//! of the folder then holds one material; `table` holds the measured ones. Nothing here knows
//! lights, captors or what lies beyond the surface.

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

use enum_dispatch::enum_dispatch;
use glam::{Vec2, Vec3};

use crate::{
    error::{Checked, Problem, check_length, check_range},
    math::{
        geometry::Frame,
        rng::Stream,
        sampling::{cosine_hemisphere, cosine_hemisphere_density},
        spectrum::{Lanes, Spectrum},
    },
};

/// Rounding error by which a sum of fractions in single precision may exceed 1.
const ROUNDING: f64 = 1e-6;

/// Returns an index of refraction in single precision. Error: it is outside [1, 1000].
fn checked_ior(ior: f64) -> Checked<f32> {
    if (1.0..=1000.0).contains(&ior) {
        return Ok(ior as f32);
    }
    Err(Problem::new(format!("ior = {ior}, must be from 1 to 1000"), "water has 1.33, glass 1.5"))
}

/// Checks the values called `name`. Error: one is outside [0, 1] by more than rounding.
fn check_fractions(name: &str, values: &[f32]) -> Checked {
    values.iter().try_for_each(|&value| {
        let value = f64::from(value);
        let rounded = if (1.0..1.0 + ROUNDING).contains(&value) { 1.0 } else { value };
        check_range(rounded, 0.0, 1.0).map_err(|problem| problem.of(name))
    })
}

/// Checks the values called `name` like [`check_fractions`]. Error, too: there is not one for each
/// of `bands` bands.
fn check_per_band(name: &str, values: &[f32], bands: usize) -> Checked {
    check_length(values.len(), bands).map_err(|problem| problem.of(name))?;
    check_fractions(name, values)
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
        Self { direction, weight, lobe: LobeKind::diffuse(crosses) }
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

    /// Returns the lobe of diffuse scattering, to the other side if it `crosses` the surface.
    #[inline]
    pub fn diffuse(crosses: bool) -> Self {
        if crosses { Self::DiffuseTransmission } else { Self::DiffuseReflection }
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

    /// Makes a lobe of the fractions called `name`. Error: one is outside [0, 1] by more than
    /// rounding.
    fn checked(name: &str, fractions: &[f32]) -> Checked<Self> {
        check_fractions(name, fractions).map(|()| Self::new(fractions))
    }

    /// Returns the same lobe with zeros in the lanes beyond its bands.
    fn in_lanes(mut self, lanes: usize) -> Self {
        self.relative.resize(lanes, 0.0);
        self
    }

    /// Returns the number of bands, or of lanes.
    fn len(&self) -> usize {
        self.relative.len()
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

/// Optical behaviour of a surface.
#[enum_dispatch(Scatterer)]
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
    /// Thin sheet as it was measured.
    Table(Table),
}

impl Material {
    /// Samples as [`Scatterer::sample`] does, and is what callers get by that name. It is inlined
    /// for Lambertian walls, which are met most; the longer samplers are called. The function that
    /// the macro makes would itself be called, which takes 4 % more time among leaves.
    #[inline(always)]
    pub fn sample<L: Lanes>(
        &self,
        at: &Interaction,
        transport: Transport,
        rng: &mut Stream,
    ) -> Option<BsdfSample<L>> {
        match self {
            Self::Lambert(m) => m.sample(at, transport, rng),
            Self::Dielectric(m) => m.sample(at, transport, rng),
            Self::Pane(m) => m.sample(at, transport, rng),
            Self::Leaf(m) => m.sample(at, transport, rng),
            Self::Phong(m) => m.sample(at, transport, rng),
            Self::Mirror(m) => m.sample(at, transport, rng),
            Self::Table(m) => m.sample(at, transport, rng),
        }
    }
}

/// What a material does with light. A method with a default says that the material has no such
/// thing; a material overrides those of what it has.
#[enum_dispatch]
pub trait Scatterer {
    /// Returns the number of values of each kind: one for each band, or for each lane where the
    /// material is [`placed`](Self::placed).
    fn lanes(&self) -> usize;

    /// Checks that there is one value of each kind for each of `bands` bands. Error: there are
    /// more or fewer.
    fn check_bands(&self, bands: usize) -> Result<(), Problem> {
        check_length(self.lanes(), bands).map_err(|problem| problem.of("reflectance"))
    }

    /// Returns the material as it is in a scene: with zeros in the lanes beyond its bands, and, if
    /// it [needs](Self::needs_tangents) them, with the directions of azimuth 0. `tangents` holds
    /// the index of each triangle and its direction, in rising order of the indices.
    fn placed(self, lanes: usize, tangents: Vec<(u32, Vec3)>) -> Self;

    /// Returns whether the material is a table that is turned about the normal, so that it needs
    /// the direction of azimuth 0 on each triangle.
    fn needs_tangents(&self) -> bool {
        false
    }

    /// Samples the direction in which a path leaves the surface. Returns `None` where nothing goes
    /// on.
    fn sample<L: Lanes>(
        &self,
        interaction: &Interaction,
        transport: Transport,
        rng: &mut Stream,
    ) -> Option<BsdfSample<L>>;

    /// Returns the scattering function f per band, 1/sr, for light that meets the surface at
    /// `interaction` and leaves along `outgoing` (unit vector). Light that is mirrored, refracted
    /// or goes straight on is not part of f.
    fn evaluate<L: Lanes>(&self, _interaction: &Interaction, _outgoing: Vec3) -> Spectrum<L> {
        Spectrum::splat(self.lanes(), 0.0)
    }

    /// Returns the density, 1/sr, with which [`sample`](Self::sample) draws the direction
    /// `outgoing`, without mirrored, refracted and straight directions. Its integral is the chance
    /// that the path goes on by a diffuse lobe.
    fn pdf(&self, _interaction: &Interaction, _transport: Transport, _outgoing: Vec3) -> f32 {
        0.0
    }

    /// Returns the mirrored, refracted and straight directions in which light goes on, each with
    /// the fraction that it carries per band as its weight. Together with
    /// [`evaluate`](Self::evaluate) they hold all light that is scattered.
    fn smooth_ways<L: Lanes>(
        &self,
        _interaction: &Interaction,
        _transport: Transport,
    ) -> [Option<BsdfSample<L>>; 2] {
        [None, None]
    }

    /// Returns the fraction per band of light along `direction` that goes straight through. Returns
    /// `None` for materials through which no light goes straight; thin panes and some tables let it
    /// through.
    fn straight<L: Lanes>(&self, _direction: Vec3, _front_normal: Vec3) -> Option<Spectrum<L>> {
        None
    }

    /// Returns per band the power with which the [parameter](super::parameter) of a way enters into
    /// the light that a lobe sends on that way: d ln f / d ln s. `None` where it is 1.
    fn powers<L: Lanes>(&self, _at: &Interaction, _lobe: LobeKind) -> Option<Spectrum<L>> {
        None
    }

    /// Returns the fraction of the incident power that is absorbed, per band, or `None` where no
    /// closed form is known (the glossy Phong lobe).
    fn absorptance<L: Lanes>(&self, interaction: &Interaction) -> Option<Spectrum<L>>;

    /// Returns the diffusely scattered radiance that leaves the surface at an angle of this cosine
    /// to the normal, relative to the radiance along the normal of the same side. Returns `None`
    /// where it depends on the direction that the light comes from.
    fn relative_radiance(&self, _cos: f32) -> Option<f32> {
        None
    }

    /// Returns whether some light is scattered diffusely, so that the surface has a radiance to
    /// estimate.
    fn is_diffuse(&self) -> bool {
        false
    }

    /// Returns whether some light is transmitted diffusely to the other side.
    fn transmits_diffusely(&self) -> bool {
        false
    }

    /// Returns whether some light leaves the surface mirrored or refracted.
    fn has_mirror(&self) -> bool {
        false
    }

    /// Returns the largest fraction of light in any band that is scattered into a glossy lobe
    /// around the mirror direction, or 0 where there is no such lobe or it is a mirror.
    fn glossy(&self) -> f32 {
        0.0
    }

    /// Returns whether one can see through the surface, as through glass, water and covers that do
    /// not scatter.
    fn is_clear(&self) -> bool {
        false
    }

    /// Returns whether the surface is the interface of a closed solid.
    fn is_solid(&self) -> bool {
        false
    }
}

/// Returns the mirrored way of a material that mirrors this fraction, and no other.
fn mirrored_way<L: Lanes>(at: &Interaction, fraction: Spectrum<L>) -> [Option<BsdfSample<L>>; 2] {
    [(!fraction.is_zero()).then(|| BsdfSample::mirrored(at, fraction)), None]
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
    /// Makes the material from its reflectance per band, in [0, 1]. Error: a value is outside.
    pub fn new(reflectance: &[f32]) -> Result<Self, Problem> {
        Ok(Self { lobe: Lobe::checked("reflectance", reflectance)? })
    }

    /// Makes a surface that absorbs all light of so many bands.
    pub fn black(bands: usize) -> Self {
        Self { lobe: Lobe::new(&vec![0.0; bands]) }
    }

    /// Makes a surface that reflects all light of so many bands.
    pub fn white(bands: usize) -> Self {
        Self { lobe: Lobe::new(&vec![1.0; bands]) }
    }

    /// Returns the reflectance of each lane in order.
    pub fn reflectance(&self) -> impl Iterator<Item = f32> {
        self.lobe.relative.iter().map(|r| r * self.lobe.largest)
    }

    /// Draws what a [sample](Scatterer::sample) has to draw: returns its weight, and the numbers of
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
}

impl Scatterer for Lambert {
    fn lanes(&self) -> usize {
        self.lobe.len()
    }

    fn placed(self, lanes: usize, _tangents: Vec<(u32, Vec3)>) -> Self {
        Self { lobe: self.lobe.in_lanes(lanes) }
    }

    #[inline]
    fn sample<L: Lanes>(
        &self,
        at: &Interaction,
        _transport: Transport,
        rng: &mut Stream,
    ) -> Option<BsdfSample<L>> {
        let (weight, numbers) = self.draw(rng)?;
        Some(BsdfSample::diffuse(Self::direction(at, numbers), weight, false))
    }

    #[inline]
    fn evaluate<L: Lanes>(&self, at: &Interaction, outgoing: Vec3) -> Spectrum<L> {
        let above = outgoing.dot(at.normal) > 0.0;
        let fraction = if above { self.lobe.fraction() } else { self.lobe.nothing() };
        fraction.scaled(1.0 / std::f32::consts::PI)
    }

    #[inline]
    fn pdf(&self, at: &Interaction, _transport: Transport, outgoing: Vec3) -> f32 {
        let reflects = self.lobe.largest > 0.0;
        if reflects { cosine_hemisphere_density(outgoing.dot(at.normal)) } else { 0.0 }
    }

    #[inline]
    fn absorptance<L: Lanes>(&self, _at: &Interaction) -> Option<Spectrum<L>> {
        Some(complement(self.lobe.fraction()))
    }

    fn relative_radiance(&self, _cos: f32) -> Option<f32> {
        Some(1.0)
    }

    fn is_diffuse(&self) -> bool {
        true
    }
}

/// Mirror that reflects the same fraction at every angle, on both faces.
#[derive(Clone, Debug, PartialEq)]
pub struct Mirror {
    lobe: Lobe,
}

impl Mirror {
    /// Makes the material from its reflectance per band, in [0, 1]. Error: a value is outside.
    pub fn new(reflectance: &[f32]) -> Result<Self, Problem> {
        Ok(Self { lobe: Lobe::checked("reflectance", reflectance)? })
    }
}

impl Scatterer for Mirror {
    fn lanes(&self) -> usize {
        self.lobe.len()
    }

    fn placed(self, lanes: usize, _tangents: Vec<(u32, Vec3)>) -> Self {
        Self { lobe: self.lobe.in_lanes(lanes) }
    }

    #[inline]
    fn sample<L: Lanes>(
        &self,
        at: &Interaction,
        _transport: Transport,
        _rng: &mut Stream,
    ) -> Option<BsdfSample<L>> {
        let mirrored = || BsdfSample::mirrored(at, self.lobe.fraction());
        (self.lobe.largest > 0.0).then(mirrored)
    }

    fn smooth_ways<L: Lanes>(
        &self,
        at: &Interaction,
        _transport: Transport,
    ) -> [Option<BsdfSample<L>>; 2] {
        mirrored_way(at, self.lobe.fraction())
    }

    #[inline]
    fn absorptance<L: Lanes>(&self, _at: &Interaction) -> Option<Spectrum<L>> {
        Some(complement(self.lobe.fraction()))
    }

    fn has_mirror(&self) -> bool {
        true
    }
}
