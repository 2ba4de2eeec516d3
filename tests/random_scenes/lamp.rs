//! The lights of a random room.

use glam::DVec3;
use serde_json::{Value, json};

use super::room::Room;
use crate::world::Mesh;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Point,
    /// A point whose light falls off with a power of the cosine.
    Led,
    /// A point with the intensities of a file.
    Measured,
    Spot,
    Line,
    IsotropicLine,
    Tube,
    /// A tube that shines from a part of its circumference.
    Aperture,
    /// A tube with a material.
    GlowingTube,
    Area,
    TwoSided,
    /// An area light with a material.
    Glowing,
    /// An area light with the intensities of a file.
    MeasuredArea,
}

const ALL: [Kind; 13] = [
    Kind::Point,
    Kind::Led,
    Kind::Measured,
    Kind::Spot,
    Kind::Line,
    Kind::IsotropicLine,
    Kind::Tube,
    Kind::Aperture,
    Kind::GlowingTube,
    Kind::Area,
    Kind::TwoSided,
    Kind::Glowing,
    Kind::MeasuredArea,
];

const WITHOUT_SURFACE: [Kind; 6] =
    [Kind::Point, Kind::Led, Kind::Measured, Kind::Spot, Kind::Line, Kind::IsotropicLine];

/// Lights that may lie in the plane of a wall: all except tubes and surfaces with a material.
const FLAT: [Kind; 9] = [
    Kind::Point,
    Kind::Led,
    Kind::Measured,
    Kind::Spot,
    Kind::Line,
    Kind::IsotropicLine,
    Kind::Area,
    Kind::TwoSided,
    Kind::MeasuredArea,
];

/// Of these, the lights that do not light the wall itself.
const RECESSED: [Kind; 5] = [Kind::Led, Kind::Measured, Kind::Spot, Kind::Area, Kind::MeasuredArea];

/// Intensities of a lamp that is twice as bright in one plane as in the plane across it.
const INTENSITIES: &str = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 4 2 1 2 0.1 1.2 0\n1 1 320\n\
    0 30 60 90\n0 90\n100 90 40 0\n100 180 80 0\n";

impl Room {
    /// Adds daylight, or a lamp that stands free, in a housing, or in or close to a wall. If there
    /// are smooth objects in the room, then nine times in ten the lamps are large or have no
    /// surface, and none lights a spot close by: paths find the others in mirrors by chance only,
    /// too seldom to be compared.
    pub(super) fn lamp(&mut self) {
        let least = self.size.min_element();
        let wall = self.dice.one_of(&self.walls);
        let small = self.dice.chance(if self.smooth { 0.05 } else { 0.5 });
        let large = if small { self.dice.magnitude(0.1, 1.0) } else { 1.0 };
        let kinds: &[Kind] = match self.smooth && !small && self.dice.chance(0.8) {
            true => &WITHOUT_SURFACE,
            false => &ALL,
        };
        match self.dice.below(5) {
            0 | 1 if self.walls.len() < 6 => self.daylight(),
            2 => {
                let (middle, radius) = self.take();
                let half = DVec3::splat(0.9 * radius);
                let housing = Mesh::cuboid((middle - half).to_array(), (middle + half).to_array());
                let open = self.dice.below(6);
                let sides = (0..6).filter(|&face| face != open).map(|face| housing.face(face));
                let sides = sides.reduce(Mesh::and).expect("five sides");
                self.surface("housing", "lining", &sides);
                let mut axis = DVec3::ZERO;
                axis[open / 2] = if open % 2 == 1 { 1.0 } else { -1.0 };
                self.light("housed", middle, axis, 0.5 * radius * large, kinds);
            }
            3 => {
                let (s, t) = (self.dice.between(0.4, 0.6), self.dice.between(0.4, 0.6));
                let (on_wall, inward) = self.on_wall(wall, s, t);
                let kinds: &[Kind] = if self.smooth && !small { &RECESSED } else { &FLAT };
                let radius = least * self.dice.between(0.35, 0.5);
                self.light("flush", on_wall, inward, radius * large, kinds);
            }
            4 if small || !self.smooth => {
                let (s, t) = (self.dice.between(0.2, 0.8), self.dice.between(0.2, 0.8));
                let (on_wall, inward) = self.on_wall(wall, s, t);
                let towards = if self.dice.chance(0.5) { inward } else { -inward };
                let middle = on_wall + least * self.dice.magnitude(5e-4, 0.1) * inward;
                self.light("close", middle, towards, 0.1 * least, &ALL);
            }
            _ => {
                let (middle, radius) = self.take();
                let axis = self.dice.direction();
                self.light("free", middle, axis, radius * large, kinds);
            }
        }
    }

    /// Adds a light of one of these kinds with a size of about `radius` (m). It lies across `axis`
    /// or, if it has a direction, shines along it.
    fn light(&mut self, place: &str, middle: DVec3, axis: DVec3, radius: f64, kinds: &[Kind]) {
        let power: Vec<f64> = (0..self.bands)
            .map(|_| if self.dice.chance(0.15) { 0.0 } else { self.dice.magnitude(1.0, 100.0) })
            .collect();
        let kind = self.dice.one_of(kinds);
        let mut light = self.shape(kind, middle, axis, radius);
        if matches!(kind, Kind::Glowing | Kind::GlowingTube) {
            light["material"] = json!(self.dice.one_of(&["paint", "gloss", "leaf"]));
        }
        if matches!(kind, Kind::Measured | Kind::MeasuredArea) {
            light["photometry"] = json!("lamp.ies");
            light["aim"] = json!((self.turn * axis).to_array());
            light["zero_plane"] = json!((self.turn * axis.any_orthonormal_vector()).to_array());
            self.world = self.world.clone().with_file("lamp.ies", INTENSITIES);
        }
        light["name"] = json!(self.name(&format!("{place} {kind:?}")));
        light["power"] = json!(power);
        self.world = self.world.clone().light(light);
    }

    /// Returns a light of this kind, without its power.
    fn shape(&mut self, kind: Kind, middle: DVec3, axis: DVec3, radius: f64) -> Value {
        let u = axis.any_orthonormal_vector();
        let v = axis.cross(u);
        let half = 0.9 * radius;
        let ends = [-1.0, 1.0].map(|end| self.place(middle + end * half * u));
        let corners = [-u - v, u - v, u + v, v - u]
            .map(|corner| self.place(middle + std::f64::consts::FRAC_1_SQRT_2 * radius * corner));
        let thick = half * self.dice.magnitude(if self.smooth { 0.3 } else { 0.05 }, 0.4);
        match kind {
            Kind::Point | Kind::Measured => {
                json!({ "type": "point", "position": self.place(middle) })
            }
            Kind::Led => {
                let aim = self.turn * self.dice.near(axis, if self.smooth { 0.0 } else { 30.0 });
                json!({ "type": "point", "position": self.place(middle), "aim": aim.to_array(),
                        "cosine": self.dice.between(0.5, if self.smooth { 1.5 } else { 6.0 }) })
            }
            Kind::Spot => {
                let tilt = if self.smooth { 0.0 } else { 30.0 };
                let axis = self.turn * self.dice.near(axis, tilt);
                // a spot of more than 90 degrees lights the wall in which it lies
                let [narrowest, widest] = match self.smooth && self.dice.chance(0.95) {
                    true => [60.0, 88.0],
                    false => [10.0, 100.0],
                };
                json!({ "type": "spot", "position": self.place(middle),
                        "direction": axis.to_array(),
                        "half_angle_deg": self.dice.between(narrowest, widest) })
            }
            Kind::Line => json!({ "type": "tube", "from": ends[0], "to": ends[1], "radius": 0 }),
            Kind::IsotropicLine => {
                json!({ "type": "tube", "from": ends[0], "to": ends[1], "radius": 0,
                        "emission": "isotropic" })
            }
            Kind::Tube | Kind::GlowingTube => {
                json!({ "type": "tube", "from": ends[0], "to": ends[1], "radius": thick })
            }
            Kind::Aperture => {
                json!({ "type": "tube", "from": ends[0], "to": ends[1], "radius": thick,
                        "toward": (self.turn * axis).to_array(),
                        "opening_deg": self.dice.between(120.0, 300.0) })
            }
            Kind::Area | Kind::Glowing | Kind::MeasuredArea => {
                json!({ "type": "area", "vertices": corners })
            }
            Kind::TwoSided => json!({ "type": "area", "vertices": corners, "two_sided": true }),
        }
    }
}
