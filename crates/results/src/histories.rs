//! How light reaches a captor or a group of captors: what the histories that bring it contribute, by
//! light and last surface, with names, and some of them as lines.

use serde::Serialize;

use phylux_core::{
    math::stats::Estimate,
    scene::{captor::Channel, world::Scene},
    transport::histories::{Contribution, Goal, Histories, HistoryLine, LastSurface},
};

/// What stands for the last surface of light that comes straight from its lamp, or only through glass.
pub const DIRECT: &str = "direct";
/// What stands for surfaces that belong to no object.
const NAMELESS: &str = "surfaces";

/// How light reaches a captor or a group of captors. Lists of numbers have an entry for each band,
/// then for each sum over bands.
#[derive(Clone, Debug, Serialize)]
pub struct HistoriesResult {
    /// Version of the program.
    pub phylux: &'static str,
    /// Name of the scene.
    pub scene: String,
    /// The captor or the group.
    pub to: String,
    /// The face at which light counts: `front`, `back` or, for all that count light, `both`.
    pub face: &'static str,
    /// Number of photons that were traced.
    pub photons: u64,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Names of the bands and sums, each with the unit of its flux.
    pub bands: Vec<HistoriesBand>,
    /// Name of the band or sum by which the parts are sorted and the lines are drawn.
    pub band: String,
    /// Index of this band or sum.
    #[serde(skip)]
    pub column: usize,
    /// All light that reaches it.
    pub whole: HistoriesPart,
    /// The same by light, the largest share first.
    pub by_light: Vec<HistoriesPart>,
    /// The same by last surface, the largest share first.
    pub by_surface: Vec<HistoriesPart>,
    /// The same by light and last surface, the largest share first.
    pub groups: Vec<HistoriesPart>,
    /// Some histories, drawn with chances in proportion to what they bring in the `band`.
    pub lines: Vec<HistoriesLine>,
}

/// A band or a sum over bands.
#[derive(Clone, Debug, Serialize)]
pub struct HistoriesBand {
    /// Its name.
    pub name: String,
    /// The unit of its flux.
    pub unit: String,
}

/// What some of the histories contribute.
#[derive(Clone, Debug, Serialize)]
pub struct HistoriesPart {
    /// The light that they come from; absent where it is not told apart.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub light: Option<String>,
    /// Where they were scattered or mirrored last: the name of the object, or [`DIRECT`]; absent where
    /// that is not told apart.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub last_surface: Option<String>,
    /// The material of the last surface; absent for direct light and where surfaces are not told apart.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
    /// Number of histories: of arrivals, each with its way from the lamp.
    pub histories: u64,
    /// Share of the light that reaches the captor or group, in [0, 1]; null where none does.
    pub share: Vec<Option<f64>>,
    /// Standard error of the share; null also where the run has one batch.
    pub share_se: Vec<Option<f64>>,
    /// Flux, in the unit of the band.
    pub flux: Vec<f64>,
    /// Standard error of the flux.
    pub flux_se: Vec<Option<f64>>,
}

/// The way of one history.
#[derive(Clone, Debug, Serialize)]
pub struct HistoriesLine {
    /// The light that it comes from.
    pub light: String,
    /// Where it was scattered or mirrored last, as in [`HistoriesPart`].
    pub last_surface: String,
    /// The material of the last surface; absent for direct light.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
    /// The captor at which it arrives.
    pub captor: String,
    /// The face at which it arrives: `front` or `back`.
    pub face: &'static str,
    /// Its places, m from the origin of the scene: on the lamp (or where light from afar comes into the
    /// scene), on each surface that it meets, and on the captor.
    pub points: Vec<[f64; 3]>,
    /// The surfaces between the first and the last place: of each the object and the material.
    pub met: Vec<[String; 2]>,
}

/// Returns the names of the object and the material of a surface.
fn names(scene: &Scene, surface: LastSurface) -> [String; 2] {
    let object = surface.object.map_or(NAMELESS, |object| scene.objects()[object].as_str());
    [object.into(), scene.materials()[surface.material].name.clone()]
}

/// Returns the names of a last surface and of its material; `None` stands for direct light.
pub fn last_surface(scene: &Scene, last: Option<LastSurface>) -> (String, Option<String>) {
    match last.map(|last| names(scene, last)) {
        None => (DIRECT.into(), None),
        Some([object, material]) => (object, Some(material)),
    }
}

impl HistoriesResult {
    /// Gives names to what was found of a goal that is called `to`, with lines drawn by the band or sum
    /// of this index.
    pub fn new(
        scene: &Scene,
        to: &str,
        goal: &Goal,
        column: usize,
        seed: u64,
        found: &Histories,
    ) -> Self {
        let bands = scene.band_names().enumerate().map(|(b, name)| HistoriesBand {
            name: name.into(),
            unit: scene.units(b)[0].clone().into_owned(),
        });
        let bands: Vec<HistoriesBand> = bands.collect();
        let light = |light: usize| scene.lights()[light].name.clone();
        let with_last = |part: HistoriesPart, last: Option<LastSurface>| {
            let (last, material) = last_surface(scene, last);
            HistoriesPart { last_surface: Some(last), material, ..part }
        };
        let with_light = |part, of| HistoriesPart { light: Some(light(of)), ..part };
        let of_light = |(of, own): &(usize, Contribution)| with_light(HistoriesPart::new(own), *of);
        let of_surface =
            |(last, own): &(Option<_>, Contribution)| with_last(HistoriesPart::new(own), *last);
        let group = found.groups.iter().map(|(origin, own)| {
            with_last(with_light(HistoriesPart::new(own), origin.light), origin.last)
        });
        let line = |line: &HistoryLine| {
            let (last_surface, material) = last_surface(scene, line.origin.last);
            let points = line.points.iter();
            let points = points.map(|point| (point.as_dvec3() + scene.center()).to_array());
            HistoriesLine {
                light: light(line.origin.light),
                last_surface,
                material,
                captor: scene.captors()[line.captor].id.clone(),
                face: if line.front { "front" } else { "back" },
                points: points.collect(),
                met: line.met.iter().map(|met| names(scene, *met)).collect(),
            }
        };
        Self {
            phylux: env!("CARGO_PKG_VERSION"),
            scene: scene.name().into(),
            to: to.into(),
            face: match goal.face {
                None | Some(Channel::Absorbed) => "both",
                Some(Channel::Front) => "front",
                Some(Channel::Back) => "back",
            },
            photons: found.photons,
            seed,
            band: bands[column].name.clone(),
            bands,
            column,
            whole: HistoriesPart::new(&found.whole),
            by_light: found.by_light.iter().map(of_light).collect(),
            by_surface: found.by_surface.iter().map(of_surface).collect(),
            groups: group.collect(),
            lines: found.lines.iter().map(line).collect(),
        }
    }
}

impl HistoriesResult {
    /// Returns the share of the group that a line belongs to, in the band of the lines.
    pub fn share_of(&self, line: &HistoriesLine) -> Option<f64> {
        self.groups.iter().find(|group| group.has(line))?.share[self.column]
    }
}

impl HistoriesPart {
    /// Returns whether a line has the light and the last surface of this part.
    pub fn has(&self, line: &HistoriesLine) -> bool {
        self.light.as_ref() == Some(&line.light)
            && self.last_surface.as_ref() == Some(&line.last_surface)
            && self.material == line.material
    }

    /// A part without the names of its light and surface.
    fn new(Contribution { histories, flux, share }: &Contribution) -> Self {
        let error = |estimate: &Estimate| estimate.standard_error;
        Self {
            light: None,
            last_surface: None,
            material: None,
            histories: *histories,
            share: share.iter().map(|share| share.as_ref().map(|share| share.mean)).collect(),
            share_se: share.iter().map(|share| share.as_ref().and_then(error)).collect(),
            flux: flux.iter().map(|flux| flux.mean).collect(),
            flux_se: flux.iter().map(error).collect(),
        }
    }
}
