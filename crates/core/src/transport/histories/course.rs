//! The places of a photon, and of the flight that accompanies it, from the lamp on.

use glam::Vec3;

use crate::{
    scene::{
        light::{Emission, EntryFace},
        material::LobeKind,
        world::{Arrived, Crossing, Scene, SurfaceHit},
    },
    transport::trace::{Event, Turn},
};

/// The last surface that scattered or mirrored light on its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct LastSurface {
    /// Index of its object, of which all copies have the same; `None` for a surface without a name.
    pub object: Option<usize>,
    /// Index of its material.
    pub material: usize,
}

/// Where light comes from: its lamp, and the last surface before the captor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Origin {
    /// Index of the light.
    pub light: usize,
    /// The last surface; `None` for direct light.
    pub last: Option<LastSurface>,
}

/// The way of one history, for drawing.
#[derive(Clone, Debug, PartialEq)]
pub struct HistoryLine {
    /// Where its light comes from.
    pub origin: Origin,
    /// Index of the captor.
    pub captor: usize,
    /// Whether it arrives at the front.
    pub front: bool,
    /// Its places, m from the centre of the scene: on the lamp, or where light from afar comes into
    /// the scene; on each surface that it meets; on the captor. Where the scene repeats, the captor is
    /// where the scene describes it, and what comes before lies in the cells around.
    pub points: Vec<Vec3>,
    /// The surface at each place between the first and the last.
    pub met: Vec<LastSurface>,
}

/// The places of one history so far.
pub struct Course<'s> {
    light: usize,
    /// Where the photon started.
    start: Vec3,
    /// For light from infinitely far away: its direction, and the face by which it came in.
    afar: Option<(Vec3, Option<&'s EntryFace>)>,
    /// Whether the scene repeats, so that places lie where the photon has flown and not where the
    /// scene describes them.
    repeats: bool,
    own: Places,
    /// Those of the flight beside the photon, after the photon's own.
    beside: Places,
}

/// Surfaces that light has met, in their order.
#[derive(Default)]
struct Places {
    met: Vec<Met>,
    /// The last surface that scattered or mirrored the light.
    last: Option<Met>,
}

/// A place on a surface.
#[derive(Clone, Copy)]
struct Met {
    point: Vec3,
    triangle: usize,
    material: u32,
}

impl Met {
    fn surface(&self, scene: &Scene) -> LastSurface {
        LastSurface { object: scene.object(self.triangle), material: self.material as usize }
    }
}

impl Places {
    /// Takes in a surface, which has sent the light on by a lobe.
    fn add(&mut self, met: Met, lobe: LobeKind) {
        self.met.push(met);
        if !matches!(lobe, LobeKind::Straight | LobeKind::Refraction) {
            self.last = Some(met);
        }
    }
}

impl<'s> Course<'s> {
    /// Begins with a photon that leaves its light.
    pub fn of<L>(scene: &'s Scene, photon: &Emission<'_, L>) -> Self {
        let entrance = scene.lights()[photon.light].entrance();
        Self {
            light: photon.light,
            start: photon.start.map_or(photon.ray.origin, |start| start.point),
            afar: entrance.map(|entrance| (photon.ray.direction, entrance.face(photon.face))),
            repeats: scene.lattice().is_some(),
            own: Places::default(),
            beside: Places::default(),
        }
    }

    /// Takes in an event, once it has been counted.
    pub fn then<L>(&mut self, event: &Event<'_, L>) {
        match *event {
            Event::Arrival { at, lobe, .. } => {
                let Arrived { hit: SurfaceHit { t, triangle, point }, surface, .. } = *at;
                let flown = || self.here() + t * at.interaction.direction;
                let point = if self.repeats { flown() } else { point };
                let met = Met { point, triangle, material: surface.material };
                // a photon that ends here has been here all the same, for flights that are aimed from here
                self.own.add(met, lobe.unwrap_or(LobeKind::DiffuseReflection));
            }
            Event::Turn(Turn::Aimed { .. }) => {
                self.beside.met.clear();
                self.beside.last = self.own.met.last().copied();
            }
            Event::Turn(Turn::SentOn { hit, material, lobe, .. }) => {
                let SurfaceHit { triangle, point, .. } = hit;
                self.beside.add(Met { point, triangle, material }, lobe);
            }
            _ => {}
        }
    }

    /// Returns where the photon has come to.
    fn here(&self) -> Vec3 {
        self.own.met.last().map_or(self.start, |met| met.point)
    }

    /// Returns where the light of an arrival comes from.
    pub fn origin<L>(&self, scene: &Scene, event: &Event<'_, L>) -> Origin {
        let places = if is_beside(event) { &self.beside } else { &self.own };
        Origin { light: self.light, last: places.last.map(|met| met.surface(scene)) }
    }

    /// Returns the way of an arrival as a line: `line` with its places.
    pub fn line<L>(&self, scene: &Scene, event: &Event<'_, L>, line: HistoryLine) -> HistoryLine {
        let (t, direction, end) = match *event {
            Event::Crossing { crossing: Crossing { t, point, .. }, direction, .. } => {
                (t, direction, point)
            }
            Event::Arrival { at, .. } | Event::ArrivalBeside { at, .. } => {
                (at.hit.t, at.interaction.direction, at.hit.point)
            }
            _ => return line,
        };
        let beside: &[Met] = if is_beside(event) { &self.beside.met } else { &[] };
        let all = || self.own.met.iter().chain(beside);
        let met: Vec<LastSurface> = all().map(|met| met.surface(scene)).collect();
        let first = all().next().map_or(end, |met| met.point);
        let start = match self.afar {
            // the flight beside the photon comes in elsewhere
            Some((direction, Some(face))) if is_beside(event) && self.own.met.is_empty() => {
                face.entering(first, direction).map_or(self.start, |ray| ray.origin)
            }
            _ => self.start,
        };
        let places = [start].into_iter().chain(all().map(|met| met.point));
        // to where the scene describes the captor
        let back = match self.repeats {
            true => end - (self.here() + t * direction),
            false => Vec3::ZERO,
        };
        let points = places.map(|place| place + back).chain([end]).collect();
        HistoryLine { points, met, ..line }
    }
}

/// Returns whether an event is one of a flight beside the photon.
fn is_beside<L>(event: &Event<'_, L>) -> bool {
    matches!(event, Event::Crossing { carried: None, .. } | Event::ArrivalBeside { .. })
}
