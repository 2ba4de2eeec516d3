//! A random room.

use std::f64::consts::TAU;

use glam::{DMat3, DVec3};
use serde_json::{Value, json};

use super::dice::Dice;
use crate::world::{Mesh, World};

/// A room under construction, in its own coordinates from 0 to `size`.
pub struct Room {
    pub(super) dice: Dice,
    pub(super) world: World,
    pub(super) size: DVec3,
    pub(super) bands: usize,
    /// How the room is turned in the scene; `shift` says where it stands.
    pub(super) turn: DMat3,
    shift: DVec3,
    /// Eighths of the room in which nothing stands yet, each given by its low corner.
    free: Vec<DVec3>,
    /// The walls that exist: the axis across the wall, and whether it is at the high end.
    pub(super) walls: Vec<(usize, bool)>,
    things: usize,
    /// Whether daylight enters.
    pub(super) by_day: bool,
    /// Whether an object in the room is glossy, mirrors or refracts.
    pub(super) smooth: bool,
}

const DULL: [&str; 3] = ["paint", "leaf", "weave"];
/// Materials of sheets and of bodies that are glossy, mirror or refract.
const SMOOTH_SHEETS: [&str; 6] = ["waxy leaf", "gloss", "coat", "mirror", "pane", "cover"];
const SMOOTH_BODIES: [&str; 5] = ["gloss", "coat", "mirror", "glass", "jelly"];

/// Returns the scene with this number.
pub fn room(number: u64) -> World {
    let mut dice = Dice(number.wrapping_mul(0x2545_f491_4f6c_dd1d));
    let bands = 1 + dice.below(5);
    let scale = dice.magnitude(1.0, 3.0);
    let size = DVec3::from([(); 3].map(|()| scale * dice.between(1.0, 1.7)));
    let turned = dice.chance(0.5);
    let turn = match turned {
        true => DMat3::from_axis_angle(dice.direction(), dice.between(0.0, TAU)),
        false => DMat3::IDENTITY,
    };
    let shift = if turned { 100.0 * dice.direction() } else { DVec3::ZERO };
    let eighth = |i: usize| DVec3::from([0, 1, 2].map(|axis| (i >> axis & 1) as f64)) * 0.5 * size;
    let mut room = Room {
        dice,
        world: World::new().bands(bands),
        size,
        bands,
        turn,
        shift,
        free: (0..8).map(eighth).collect(),
        walls: Vec::new(),
        things: 0,
        by_day: false,
        smooth: false,
    };
    room.materials();
    room.build_walls();
    for _ in 0..2 + room.dice.below(3) {
        room.furniture();
    }
    for _ in 0..1 + room.dice.below(3) {
        room.lamp();
    }
    for _ in 0..2 + room.dice.below(3) {
        room.captor();
    }
    room.world
}

impl Room {
    pub(super) fn per_band(&mut self, low: f64, high: f64) -> Value {
        (0..self.bands).map(|_| self.dice.between(low, high)).collect()
    }

    fn materials(&mut self) {
        let ior = self.dice.between(1.2, 1.8);
        let transmittance = self.per_band(0.02, 0.45);
        let leaf = json!({ "type": "leaf", "ior": 1.0, "reflectance": self.per_band(0.05, 0.5),
            "transmittance": transmittance, "back": { "reflectance": self.per_band(0.05, 0.5) } });
        let mut waxy = leaf.clone();
        waxy["ior"] = json!(1.425);
        let gloss = json!({ "type": "phong", "reflectance": self.per_band(0.1, 0.4),
            "specular": self.per_band(0.2, 0.4), "transmittance": self.dice.one_of(&[0.0, 0.2]),
            "exponent": self.dice.magnitude(2.0, 100.0) });
        let coat = json!({ "type": "phong", "reflectance": self.per_band(0.1, 0.5),
            "specular": self.per_band(0.1, 0.4) });
        let pane = json!({ "type": "transparent", "thin": true, "ior": ior,
            "tint": self.per_band(0.3, 1.0) });
        let glass = json!({ "type": "transparent", "ior": ior, "tint": self.per_band(0.7, 1.0) });
        let jelly = json!({ "type": "leaf", "thin": false, "ior": 1.0 + 0.3 * ior,
            "tint": self.per_band(0.6, 1.0) });
        let cover = json!({ "type": "table", "angles_deg": [0, 30, 60],
            "direct": self.falling(0.2, 0.4), "diffuse": self.falling(0.1, 0.3),
            "reflectance": self.falling(0.0, 0.3) });
        let all = [
            ("wall", json!({ "type": "lambert", "reflectance": self.per_band(0.1, 0.75) })),
            ("paint", json!({ "type": "lambert", "reflectance": self.per_band(0.0, 0.9) })),
            ("lining", json!({ "type": "lambert", "reflectance": self.per_band(0.5, 0.95) })),
            ("mirror", json!({ "type": "mirror", "reflectance": self.per_band(0.5, 0.95) })),
            ("weave", json!({ "type": "table", "file": "weave.csv" })),
            ("leaf", leaf),
            ("waxy leaf", waxy),
            ("gloss", gloss),
            ("coat", coat),
            ("pane", pane),
            ("glass", glass),
            ("jelly", jelly),
            ("cover", cover),
        ];
        self.world = all
            .into_iter()
            .fold(self.world.clone(), |world, (name, material)| world.material(name, material));
        let weave = self.weave();
        self.world = self.world.clone().with_file("weave.csv", &weave);
    }

    /// Returns three falling numbers, the first between `low` and `high`.
    fn falling(&mut self, low: f64, high: f64) -> [f64; 3] {
        let first = self.dice.between(low, high);
        [first, first * self.dice.between(0.8, 1.0), first * self.dice.between(0.5, 0.8)]
    }

    /// Returns a table of a measured scattering function, of a sheet that scatters forwards and
    /// backwards.
    fn weave(&mut self) -> String {
        let names: Vec<String> = (0..self.bands).map(|b| format!(",b{b}")).collect();
        let mut table = format!("theta_i,phi_i,theta_o,phi_o{}\n", names.concat());
        for (incidence, around) in [(0, 0), (40, 0), (75, 0)] {
            for (exit, azimuth) in [0, 45, 75, 105, 135, 180]
                .into_iter()
                .flat_map(|o| [0, 90, 180, 270].map(|a| (o, a)))
            {
                // at most 0.14 / sr over 2 pi of projected solid angle (both sides): at most 0.88
                // of the light goes on
                let f: Vec<String> = (0..self.bands)
                    .map(|_| format!(",{:.4}", self.dice.between(0.0, 0.14)))
                    .collect();
                table += &format!("{incidence},{around},{exit},{azimuth}{}\n", f.concat());
            }
        }
        table
    }

    /// Returns one of the given smooth materials, or a dull one.
    fn material(&mut self, smooth: &[&'static str]) -> &'static str {
        if self.dice.chance(0.65) {
            // it is dark inside bodies made of leaf, so they are painted
            return if smooth == SMOOTH_BODIES { "paint" } else { self.dice.one_of(&DULL) };
        }
        self.smooth = true;
        self.dice.one_of(smooth)
    }

    pub(super) fn place(&self, p: DVec3) -> [f64; 3] {
        (self.turn * p + self.shift).to_array()
    }

    fn placed(&self, mesh: &Mesh) -> Mesh {
        let polygon =
            |polygon: &Vec<_>| polygon.iter().map(|&p| self.place(DVec3::from(p))).collect();
        Mesh(mesh.0.iter().map(polygon).collect())
    }

    pub(super) fn name(&mut self, what: &str) -> String {
        self.things += 1;
        format!("{what} {}", self.things)
    }

    /// Adds a surface, which is a captor in half of the cases.
    pub(super) fn surface(&mut self, what: &str, material: &str, mesh: &Mesh) {
        let (name, mesh) = (self.name(&format!("{what} of {material}")), self.placed(mesh));
        let world = self.world.clone();
        self.world = match self.dice.chance(0.5) {
            true => world.counted(&name, material, &mesh),
            false => world.surface(&name, material, &mesh),
        };
    }

    /// Returns the point at fractions `s` and `t` of a side of the room, and its normal into the
    /// room.
    pub(super) fn on_wall(&self, (axis, high): (usize, bool), s: f64, t: f64) -> (DVec3, DVec3) {
        let mut at = self.size * DVec3::splat(s);
        at[(axis + 1) % 3] = self.size[(axis + 1) % 3] * t;
        at[axis] = if high { self.size[axis] } else { 0.0 };
        let mut normal = DVec3::ZERO;
        normal[axis] = if high { -1.0 } else { 1.0 };
        (at, normal)
    }

    /// Adds six walls, or fewer; most are of the material `wall`.
    fn build_walls(&mut self) {
        let faces = crate::world::room([0.0; 3], self.size.to_array());
        let open = if self.dice.chance(0.6) { 0 } else { 1 + self.dice.below(3) };
        for face in open..6 {
            let material = match self.dice.chance(0.75) {
                true => "wall",
                false => self.material(&SMOOTH_SHEETS),
            };
            self.walls.push((face / 2, face % 2 == 1));
            self.surface("wall", material, &faces.face(face));
        }
    }

    /// Takes a free eighth of the room, and returns its middle and the radius (m) of the largest
    /// object for it.
    pub(super) fn take(&mut self) -> (DVec3, f64) {
        let eighth = self.free.swap_remove(self.dice.below(self.free.len()));
        (eighth + 0.25 * self.size, 0.22 * self.size.min_element())
    }

    fn furniture(&mut self) {
        let (middle, radius) = self.take();
        let size = radius * self.dice.between(0.6, 1.0);
        match self.dice.below(3) {
            0 => {
                let normal = self.dice.direction().to_array();
                let material = self.material(&SMOOTH_SHEETS);
                self.surface("sheet", material, &Mesh::square(middle.to_array(), normal, size));
            }
            1 => {
                let half = DVec3::from([(); 3].map(|()| 0.5 * size * self.dice.between(0.2, 1.0)));
                let (low, high) = ((middle - half).to_array(), (middle + half).to_array());
                let material = self.material(&SMOOTH_BODIES);
                self.surface("box", material, &Mesh::cuboid(low, high));
            }
            _ => {
                let material = self.material(&SMOOTH_BODIES);
                self.surface("ball", material, &Mesh::sphere(middle.to_array(), 0.5 * size, 5));
            }
        }
    }

    /// Adds a virtual captor that lies in a wall or floats in the room, tilted or parallel to a
    /// wall. Some weigh light by its angle.
    fn captor(&mut self) {
        let size = self.size.min_element() * self.dice.between(0.4, 0.8);
        let at: [f64; 3] = [(); 3].map(|()| self.dice.between(0.25, 0.75));
        let wall = self.dice.one_of(&self.walls);
        let (on_wall, inward) = self.on_wall(wall, at[0], at[1]);
        let inside = self.size * DVec3::from(at);
        let (what, middle, normal) = match self.dice.below(10) {
            0..3 => ("flush", on_wall, inward),
            3..6 => ("free", inside, inward),
            _ => ("tilted", inside, self.dice.direction()),
        };
        let mesh = self.placed(&Mesh::square(middle.to_array(), normal.to_array(), size));
        let response = self.dice.chance(0.25).then(|| self.response());
        let sensor = if response.is_some() { "sensor with a response" } else { "sensor" };
        let (name, world) = (self.name(&format!("{what} {sensor}")), self.world.clone());
        let world = match self.dice.chance(if what == "flush" { 0.2 } else { 0.5 }) {
            true => world.captor_of_both_sides(&name, &mesh),
            false => world.captor(&name, &mesh),
        };
        self.world = match response {
            Some(response) => world.response(response),
            None => world,
        };
    }

    /// Returns a response by angle, of 1 to 4 factors.
    fn response(&mut self) -> Value {
        let angles = [15.0, 40.0, 65.0, 90.0].into_iter().take(1 + self.dice.below(4));
        angles
            .map(|angle| [angle * self.dice.between(0.8, 1.0), self.dice.between(0.0, 1.2)])
            .collect()
    }
}
