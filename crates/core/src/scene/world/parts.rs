//! The parts of a scene, as files or a program give them.

use std::{collections::BTreeMap, fmt, ops::Range};

use glam::DVec3;

use crate::{
    math::{geometry::Transform, units::Quantity, weighting::WeightedUnit},
    scene::{
        captor::{CaptorKind, Sensor},
        daylight::InfiniteLight,
        lattice::Lattice,
        light::{Lamp, LightSource},
        material::Material,
        parameter::Parameter,
        stand::{Level, SharedHeights},
    },
};

/// A wavelength interval in which light is traced separately.
#[derive(Clone, Debug, PartialEq)]
pub struct Band {
    /// Unique name.
    pub name: String,
    /// Lower end, nm, at least 0 and below `to_nm`.
    pub from_nm: Option<f64>,
    /// Upper end, nm.
    pub to_nm: Option<f64>,
}

/// A sum over bands, reported like a band.
#[derive(Clone, Default, PartialEq)]
pub struct BandSum {
    /// Name, unique among bands and sums.
    pub name: String,
    /// Indices of its bands: at least one, each once.
    pub bands: Vec<usize>,
    /// Weights of these bands, at least 0; empty where each band counts as it is.
    pub weights: Vec<f64>,
    /// What the sum is measured in, where that is not the scene's quantity.
    pub unit: Option<WeightedUnit>,
}

impl BandSum {
    /// Returns the bands, each with its weight.
    pub fn weighted(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        let weight = |i: usize| self.weights.get(i).copied().unwrap_or(1.0);
        self.bands.iter().enumerate().map(move |(i, band)| (*band, weight(i)))
    }

    /// Returns the sum of these values of the bands.
    #[inline]
    pub fn of(&self, values: &[f64]) -> f64 {
        match self.weights.is_empty() {
            true => self.bands.iter().map(|&b| values[b]).sum(),
            false => self.weighted().map(|(band, weight)| weight * values[band]).sum(),
        }
    }
}

/// Writes weights and unit only where there are any, so that the
/// [digest](crate::scene::Scene::digest) of a scene without them is that from before they existed.
impl fmt::Debug for BandSum {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { name, bands, weights, unit } = self;
        let mut text = f.debug_struct("BandSum");
        text.field("name", name).field("bands", bands);
        if !weights.is_empty() || unit.is_some() {
            text.field("weights", weights).field("unit", unit);
        }
        text.finish()
    }
}

/// The ratio of two sums over bands.
#[derive(Clone, Debug, PartialEq)]
pub struct BandRatio {
    /// Name, unique among bands, sums and ratios.
    pub name: String,
    /// The sum that is divided; its name does not matter.
    pub numerator: BandSum,
    /// The sum that it is divided by; its name does not matter.
    pub denominator: BandSum,
}

impl BandRatio {
    /// Returns the numerator, the denominator, and the sum of both, from whose variances the
    /// covariance of the two follows.
    pub fn sums(&self) -> [BandSum; 3] {
        let name = |part: &str| format!("{part} of {}", self.name);
        let (over, under) = (&self.numerator, &self.denominator);
        let mut both = BandSum { name: name("both"), ..BandSum::default() };
        for (band, weight) in over.weighted().chain(under.weighted()) {
            match both.bands.iter().position(|&known| known == band) {
                Some(i) => both.weights[i] += weight,
                None => {
                    both.bands.push(band);
                    both.weights.push(weight);
                }
            }
        }
        let named = |part: &str, sum: &BandSum| BandSum { name: name(part), ..sum.clone() };
        [named("numerator", over), named("denominator", under), both]
    }
}

/// A material with its name.
#[derive(Clone, Debug)]
pub struct NamedMaterial {
    /// Unique name.
    pub name: String,
    /// Optical behaviour, with one value for each band.
    pub material: Material,
}

/// Triangles of one material and, if they count light, of one surface captor.
#[derive(Clone, Debug)]
pub struct SurfacePart {
    /// Index of the object that the triangles belong to, if it has a name.
    pub object: Option<usize>,
    /// Index of the material.
    pub material: usize,
    /// Index of the surface captor; `None` if the triangles do not count light.
    pub captor: Option<usize>,
    /// Corners, m from the user's origin.
    pub triangles: Vec<[DVec3; 3]>,
}

/// A range of surfaces that is one of several copies of an object.
#[derive(Clone, Debug)]
pub struct CopyPart {
    /// Indices of the surfaces; each copy has the same surfaces in the same order.
    pub surfaces: Range<usize>,
    /// The transform that placed the copy, m from the user's origin.
    pub transform: Transform,
}

/// Copies of an object that share its triangles: a field of plants takes the memory of one plant. A
/// ray meets the same as if each copy had triangles of its own.
#[derive(Clone, Debug)]
pub struct SharedPart {
    /// Index of the object, if it has a name.
    pub object: Option<usize>,
    /// The surfaces of the object, m in its own coordinates. Their captors are numbered from 0 in
    /// each copy, and their own `object` is not used. Their material is no mirror, no pane and no
    /// table.
    pub surfaces: Vec<SurfacePart>,
    /// The transforms that place the copies, m from the user's origin: each only turns, mirrors,
    /// scales and moves.
    pub transforms: Vec<Transform>,
    /// Index of captor 0 of the first copy among all captors. Those of the other copies follow.
    pub first_captor: usize,
    /// Number of captors of each copy.
    pub captors: usize,
}

impl SharedPart {
    /// Returns the number of triangles of a copy.
    pub fn triangles(&self) -> usize {
        self.surfaces.iter().map(|surface| surface.triangles.len()).sum()
    }

    /// Returns the corners of a box around each copy.
    pub fn boxes(&self) -> impl Iterator<Item = [DVec3; 8]> + Clone {
        let points = || self.surfaces.iter().flat_map(|part| &part.triangles).flatten().copied();
        let low = points().fold(DVec3::INFINITY, DVec3::min);
        let high = points().fold(DVec3::NEG_INFINITY, DVec3::max);
        let corners: [DVec3; 8] = std::array::from_fn(|corner| {
            let side = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
            DVec3::new(side(0), side(1), side(2))
        });
        let placed = self.transforms.iter().filter(move |_| low.x <= high.x);
        placed.map(move |transform| corners.map(|corner| transform.point(corner)))
    }

    /// Returns the levels at which copies stand, each with the sum of the factors on areas over the
    /// copies that stand so.
    pub fn levels(&self) -> Vec<(Level, f64)> {
        let mut kinds: BTreeMap<[u64; 4], (Level, f64)> = BTreeMap::new();
        for transform in &self.transforms {
            let level = Level::of(transform);
            let scale = transform.turned(DVec3::X).length();
            kinds.entry(level.key()).or_insert((level, 0.0)).1 += scale * scale;
        }
        kinds.into_values().collect()
    }

    /// Returns the heights of the triangles of all copies, in the order of the surfaces.
    pub fn heights(&self) -> SharedHeights {
        let triangles = self.surfaces.iter().flat_map(|surface| &surface.triangles);
        SharedHeights {
            corners: triangles.copied().collect(),
            copies: self.transforms.iter().map(Level::of).collect(),
        }
    }
}

/// A light of the scene, before it is built.
#[derive(Clone, Debug)]
pub struct LightPart {
    /// Unique name.
    pub name: String,
    /// What shines, and how much.
    pub source: LightSource,
}

impl LightPart {
    /// Makes a part of a lamp or of a light that is infinitely far away.
    pub fn new(name: impl Into<String>, source: impl Into<LightSource>) -> Self {
        Self { name: name.into(), source: source.into() }
    }

    /// Returns the lamp, unless the light is infinitely far away.
    pub fn lamp(&self) -> Option<&Lamp> {
        match &self.source {
            LightSource::Lamp(lamp) => Some(lamp),
            LightSource::Infinite(_) => None,
        }
    }

    /// Returns the light that is infinitely far away, if it is one.
    pub fn infinite(&self) -> Option<&InfiniteLight> {
        match &self.source {
            LightSource::Lamp(_) => None,
            LightSource::Infinite(light) => Some(light),
        }
    }

    /// Returns the triangles of a lamp; the list is empty for other lights.
    pub fn triangles(&self) -> &[[DVec3; 3]] {
        self.lamp().map_or(&[], |lamp| lamp.outline().triangles())
    }
}

/// A captor of the scene, before it is built.
#[derive(Clone, Debug)]
pub struct CaptorPart {
    /// Unique name.
    pub id: String,
    /// Whether the captor is virtual or a surface.
    pub kind: CaptorKind,
    /// Corners of a virtual captor, m from the user's origin. Empty for a disc or sphere, which its
    /// `sensor` describes, and for a surface captor, which consists of the surface parts that name it.
    pub triangles: Vec<[DVec3; 3]>,
    /// Indices of the groups that it belongs to, each once.
    pub groups: Vec<usize>,
    /// Special shape and response, for virtual captors only.
    pub sensor: Sensor,
}

/// What a scene asks its captors to say beside the light that they receive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Asked {
    /// Whether surface captors count what they absorb by face, too.
    pub absorbed_by_face: bool,
    /// Whether captors say which share of their area the sun shines on; there is then one sun.
    pub sunlit: bool,
}

impl Asked {
    /// Returns what the digest of a scene has of it, beside what captors have of it in theirs.
    pub(super) fn in_digest(self) -> &'static str {
        if self.sunlit { "sunlit" } else { "" }
    }
}

/// The parts of a scene, as files or a program give them.
#[derive(Clone, Debug, Default)]
pub struct SceneParts {
    /// Title.
    pub name: String,
    /// The quantity that photons carry: power in W or photon flux in umol/s.
    pub quantity: Quantity,
    /// Length of the period, h, whose mean the daylight of the scene is, nights included, so that
    /// sums per day follow from a result; `None` for an instant.
    pub period_h: Option<f64>,
    /// The wavelength bands, at least one.
    pub bands: Vec<Band>,
    /// Sums over bands.
    pub sums: Vec<BandSum>,
    /// Ratios of sums over bands.
    pub ratios: Vec<BandRatio>,
    /// The parameters on which a run is to say how its results depend: at most
    /// [`Parameters::MOST`](crate::scene::parameter::Parameters::MOST), and at most one for each light
    /// and each way of a face of a material.
    pub parameters: Vec<Parameter>,
    /// What captors are to say beside the light that they receive.
    pub asked: Asked,
    /// Electric power of lights, W, above 0, by their names; those that are not named have none
    /// that is known.
    pub watts: BTreeMap<String, f64>,
    /// The materials, with unique names.
    pub materials: Vec<NamedMaterial>,
    /// Names of the objects.
    pub objects: Vec<String>,
    /// The surfaces.
    pub surfaces: Vec<SurfacePart>,
    /// The surfaces that are copies of an object, all copies of one object in succession. They
    /// serve to display the scene; the tracing of rays does not use them.
    pub copies: Vec<CopyPart>,
    /// Copies of objects that share their triangles.
    pub shared: Vec<SharedPart>,
    /// For surfaces (by index) whose material is a table that depends on the azimuth about the
    /// normal: the direction of azimuth 0 on each of their triangles.
    pub tangents: BTreeMap<usize, Vec<DVec3>>,
    /// The lights, at least one.
    pub lights: Vec<LightPart>,
    /// The captors.
    pub captors: Vec<CaptorPart>,
    /// Names of the groups, unique.
    pub groups: Vec<String>,
    /// Height of the layers in which surface captors are summed, m; `None` for no layers.
    pub layers: Option<f64>,
    /// Indices of the objects that are ground, below the plants.
    pub ground: Vec<usize>,
    /// How the scene repeats, m from the user's origin; `None` if it does not. Powers of lamps are
    /// then those of one cell.
    pub lattice: Option<Lattice>,
}
