//! The parameters of a scene on which a run says how much its results depend.
//!
//! A parameter is a factor s on all light that a material sends on in some way, or that a light
//! emits. What a history brings to a captor, after it has met this factor n times, is in proportion
//! to s^n. So the elasticity of the light E that arrives there, d ln E / d ln s at s = 1, is the mean
//! of n over the histories, weighted by what they bring (Hayakawa, Spanier et al., "Perturbation
//! Monte Carlo methods to solve inverse photon migration problems in heterogeneous tissues", Optics
//! Letters 26, 2001). The chances with which histories are drawn do not enter, as they stay the same.
//!
//! The tint of a pane counts by the length of the ways through it, so that a meeting adds to n the
//! [power](super::material::Scatterer::powers) with which the tint enters there, which is no whole
//! number and differs between bands.

use super::{
    light::Light,
    material::{LobeKind, Material},
};
use crate::error::Problem;

/// A factor on light.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Its name: a pointer into the scene file, and after `#` what of it counts where that is more
    /// than one value.
    pub name: String,
    /// The light that it is a factor on.
    pub factor: Factor,
    /// Per band, the x of d ln s = dx / x, where dx is a change of the number in the scene file, in its
    /// units: that number itself, or for a leaf what its reflectance has above that of the cuticle. 0
    /// where there is no derivative; empty where no number of the scene file stands for the factor.
    pub values: Vec<f64>,
    /// How uncertain it is, where that is stated.
    pub uncertainty: Option<Uncertainty>,
}

impl Parameter {
    /// Returns for each band by how many per cent its factor changes for 1 % more of what the scene
    /// states: for the reflectance of a leaf more than 1, as the cuticle mirrors its part whatever is
    /// below it; else 1. `material` gives the material of an index.
    pub fn gains<'m>(&self, material: impl Fn(usize) -> &'m Material, bands: usize) -> Vec<f64> {
        const BELOW_CUTICLE: usize = Sent::Reflected as usize;
        match self.factor {
            Factor::Material { material: index, faces, ways } if ways[BELOW_CUTICLE] => {
                match material(index) {
                    Material::Leaf(leaf) => {
                        leaf.reflected_over_scattered(faces[0]).take(bands).collect()
                    }
                    _ => vec![1.0; bands],
                }
            }
            Factor::Material { .. } | Factor::Light(_) => vec![1.0; bands],
        }
    }
}

/// The stated uncertainty of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Uncertainty {
    /// Per band, the standard deviation of ln s. A negative one goes the other way than the others
    /// of its set.
    pub deviations: Vec<f64>,
    /// The parameters of a set vary together, those of different sets independently.
    pub set: usize,
}

/// The light that a parameter is a factor on.
#[derive(Clone, Debug, PartialEq)]
pub enum Factor {
    /// What a material, given by its index, sends on of the light that comes to its front and to its
    /// back, if these count, in each of the [ways](Sent) that count.
    Material {
        /// Index of the material.
        material: usize,
        /// Whether light that comes to the front, and to the back, counts.
        faces: [bool; 2],
        /// Whether each way counts, in the order of [`Sent`].
        ways: [bool; Sent::WAYS],
    },
    /// What the light of this index emits.
    Light(usize),
}

/// How a surface sends light on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sent {
    /// Scattered back.
    Reflected,
    /// In the mirror direction.
    Mirrored,
    /// Scattered to the other side.
    Transmitted,
    /// Straight on, through a pane or cover.
    Straight,
    /// Through the surface of a solid.
    Refracted,
}

impl Sent {
    /// The number of ways.
    pub const WAYS: usize = 5;

    /// Returns how a lobe sends light on; `None` for total reflection, to which no parameter
    /// belongs.
    #[inline]
    pub fn by(lobe: LobeKind) -> Option<Self> {
        match lobe {
            LobeKind::DiffuseReflection => Some(Self::Reflected),
            LobeKind::MirrorReflection => Some(Self::Mirrored),
            LobeKind::DiffuseTransmission => Some(Self::Transmitted),
            LobeKind::Straight => Some(Self::Straight),
            LobeKind::Refraction => Some(Self::Refracted),
            LobeKind::TotalReflection => None,
        }
    }
}

/// Index of a parameter of a scene.
pub type ParameterIndex = u16;

/// A scene that differs from another in the values of parameters alone. A history that brings the power
/// c in the other scene, after it has met each parameter p n times, brings c Π s^n here, where s is the
/// factor between the values of p.
#[derive(Debug)]
pub struct Variant {
    /// For each parameter, its factor in each lane.
    factors: Vec<Vec<f32>>,
    materials: Vec<Material>,
}

impl Variant {
    /// Returns the factor of a parameter in each lane.
    #[inline]
    pub fn factor(&self, parameter: ParameterIndex) -> &[f32] {
        &self.factors[usize::from(parameter)]
    }

    /// Returns the material of this index.
    #[inline]
    pub fn material(&self, index: u32) -> &Material {
        &self.materials[index as usize]
    }
}

/// The parameters of a scene, and which of them each light and each way of a material has. Each has
/// at most one.
#[derive(Debug, Default)]
pub struct Parameters {
    /// Those of materials, then those of lights.
    all: Vec<Parameter>,
    /// Scenes with other values of them.
    variants: Vec<Variant>,
    /// For each material, face and way; empty if there are no parameters.
    of_ways: Vec<Option<ParameterIndex>>,
    /// For each light; empty if there are no parameters.
    of_lights: Vec<Option<ParameterIndex>>,
    /// Whether light that goes straight on has any.
    goes_straight: bool,
}

impl Parameters {
    /// The largest number of parameters.
    pub const MOST: usize = 4096;

    /// Arranges the parameters of a scene of so many materials and lights.
    pub(super) fn new(mut all: Vec<Parameter>, materials: usize, lights: usize) -> Self {
        if all.is_empty() {
            return Self::default();
        }
        all.sort_by_key(|parameter| matches!(parameter.factor, Factor::Light(_)));
        let mut of_ways = vec![None; 2 * Sent::WAYS * materials];
        let mut of_lights = vec![None; lights];
        let mut goes_straight = false;
        for (index, parameter) in all.iter().enumerate() {
            let index = Some(index as ParameterIndex);
            match parameter.factor {
                Factor::Light(light) => of_lights[light] = index,
                Factor::Material { material, faces, ways } => {
                    goes_straight |= ways[Sent::Straight as usize];
                    for way in 0..2 * Sent::WAYS {
                        if faces[way / Sent::WAYS] && ways[way % Sent::WAYS] {
                            of_ways[2 * Sent::WAYS * material + way] = index;
                        }
                    }
                }
            }
        }
        Self { all, variants: Vec::new(), of_ways, of_lights, goes_straight }
    }

    /// Returns all parameters.
    #[inline]
    pub fn all(&self) -> &[Parameter] {
        &self.all
    }

    /// Returns the scenes with other values of the parameters whose light is counted, too.
    #[inline]
    pub fn variants(&self) -> &[Variant] {
        &self.variants
    }

    /// Returns the parameters whose moments are counted: none where variants are counted.
    pub fn moments(&self) -> impl Iterator<Item = &Parameter> {
        self.all.iter().filter(|_| self.variants.is_empty())
    }

    /// Returns the first of these, whose moments are also counted for each light where results are split
    /// by light: those of materials. Of the parameter of a light, its own moment is its light.
    pub fn moments_by_light(&self) -> impl Iterator<Item = &Parameter> {
        self.moments().take_while(|parameter| matches!(parameter.factor, Factor::Material { .. }))
    }

    /// Adds a scene with other values of the parameters, in whose lists these are, in so many
    /// lanes. Error: a parameter is 0 in a band, where light could not be scaled, or is the tint of
    /// a pane, which is no factor on light.
    pub(super) fn add_variant(
        &mut self,
        lights: [&[Light]; 2],
        materials: Vec<Material>,
        parameters: &Self,
        lanes: usize,
    ) -> Result<(), Problem> {
        let of = |parameter: &Parameter| -> Result<Vec<f32>, Problem> {
            let other = || parameters.all.iter().find(|other| other.name == parameter.name);
            let factor = |(from, to): (&f64, &f64)| match (*from, *to) {
                (from, to) if from == to => Ok(1.0),
                (0.0, _) => Err(Problem::new(
                    format!("`{}` is 0 in a band, so that no light can be scaled", parameter.name),
                    "run the scenes one by one",
                )),
                (from, to) => Ok((to / from) as f32),
            };
            let ratio = |from: &[f64], to: &[f64]| {
                from.iter().zip(to).map(factor).collect::<Result<Vec<f32>, _>>()
            };
            let mut factors: Vec<f32> = match parameter.factor {
                Factor::Light(light) => {
                    let [own, other] = lights.map(|lights| &lights[light].power[..]);
                    ratio(own, other)?
                }
                // where nothing is sent on there is no parameter
                Factor::Material { ways, .. }
                    if ways[Sent::Straight as usize]
                        && other().is_none_or(|other| other.values != parameter.values) =>
                {
                    return Err(Problem::new(
                        format!("`{}` enters by different powers", parameter.name),
                        "run the scenes one by one",
                    ));
                }
                Factor::Material { .. } => match other() {
                    Some(other) => ratio(&parameter.values, &other.values)?,
                    None => vec![0.0; parameter.values.len()],
                },
            };
            factors.resize(lanes, 1.0);
            Ok(factors)
        };
        let factors = self.all.iter().map(of).collect::<Result<_, _>>()?;
        self.variants.push(Variant { factors, materials });
        Ok(())
    }

    /// Returns the parameter of light that comes to a face of a material, and that is sent on so.
    #[inline]
    pub fn of_way(&self, material: u32, front: bool, sent: Sent) -> Option<ParameterIndex> {
        let way = if front { 0 } else { Sent::WAYS } + sent as usize;
        self.of_ways.get(2 * Sent::WAYS * material as usize + way).copied().flatten()
    }

    /// Returns whether light that goes straight on, through panes or covers, has parameters.
    #[inline]
    pub fn goes_straight(&self) -> bool {
        self.goes_straight
    }

    /// Returns the parameter of a light.
    #[inline]
    pub fn of_light(&self, light: usize) -> Option<ParameterIndex> {
        self.of_lights.get(light).copied().flatten()
    }
}
