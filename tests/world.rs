//! Small scenes of simple shapes, and checks that must hold in every run of them.

use std::f64::consts::PI;

use phylux::{Estimator, RunResult, results::FaceResult, transport::PhotonCount};
use serde_json::{Value, json};

use crate::common::{TestScene, run_file};

/// A point or a vector, m.
pub type Point = [f64; 3];

/// Polygons whose corners go counter-clockwise when seen from the front.
#[derive(Clone, Debug, Default)]
pub struct Mesh(pub Vec<Vec<Point>>);

impl Mesh {
    /// Returns a parallelogram whose front faces the way of u x v.
    pub fn rectangle(corner: Point, u: Point, v: Point) -> Self {
        let at = |s: f64, t: f64| [0, 1, 2].map(|i| corner[i] + s * u[i] + t * v[i]);
        Self(vec![vec![at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)]])
    }

    /// Returns a square with sides of length `size` around `center`, whose front faces along the
    /// unit vector `normal`.
    pub fn square(center: Point, normal: Point, size: f64) -> Self {
        let (u, v) = across(normal);
        let corner = [0, 1, 2].map(|i| center[i] - 0.5 * size * (u[i] + v[i]));
        Self::rectangle(corner, u.map(|x| x * size), v.map(|x| x * size))
    }

    /// Returns a polygon of 96 corners that has the area of the disc and whose front faces along
    /// `normal`.
    pub fn disc(center: Point, normal: Point, radius: f64) -> Self {
        const CORNERS: usize = 96;
        let (u, v) = across(normal);
        let step = 2.0 * PI / CORNERS as f64;
        let rim = radius * (step / step.sin()).sqrt();
        let corner = |k: usize| {
            let (sin, cos) = (k as f64 * step).sin_cos();
            [0, 1, 2].map(|i| center[i] + rim * (cos * u[i] + sin * v[i]))
        };
        Self(vec![(0..CORNERS).map(corner).collect()])
    }

    /// Returns an axis-aligned box with its fronts outside. The faces are in this order: x low, x
    /// high, y low, y high, z low, z high.
    pub fn cuboid(low: Point, high: Point) -> Self {
        let faces = (0..3).flat_map(|axis| {
            let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
            let along = |i: usize| {
                let mut v = [0.0; 3];
                v[i] = high[i] - low[i];
                v
            };
            let mut far = low;
            far[axis] = high[axis];
            let near = Self::rectangle(low, along(k), along(j));
            [near, Self::rectangle(far, along(j), along(k))]
        });
        Self(faces.flat_map(|face| face.0).collect())
    }

    /// Returns a sphere of triangles with their fronts outside and all corners at the distance
    /// `radius` from the centre.
    pub fn sphere(center: Point, radius: f64, rows: usize) -> Self {
        let at = |row: usize, column: usize| {
            let (sin, cos) = (PI * row as f64 / rows as f64).sin_cos();
            let turn = 2.0 * PI * (column % (2 * rows)) as f64 / (2 * rows) as f64;
            let unit = match row {
                0 => [0.0, 0.0, 1.0],
                r if r == rows => [0.0, 0.0, -1.0],
                _ => [sin * turn.cos(), sin * turn.sin(), cos],
            };
            [0, 1, 2].map(|i| center[i] + radius * unit[i])
        };
        let mut triangles = Vec::new();
        for (row, column) in (0..rows).flat_map(|r| (0..2 * rows).map(move |c| (r, c))) {
            let [a, b] = [at(row, column), at(row + 1, column)];
            let [c, d] = [at(row + 1, column + 1), at(row, column + 1)];
            if row + 1 < rows {
                triangles.push(vec![a, b, c]);
            }
            if row > 0 {
                triangles.push(vec![a, c, d]);
            }
        }
        Self(triangles)
    }

    /// Turns the front of each polygon to its other side.
    pub fn flipped(mut self) -> Self {
        self.0.iter_mut().for_each(|polygon| polygon.reverse());
        self
    }

    /// Joins two meshes into one.
    pub fn and(mut self, other: Self) -> Self {
        self.0.extend(other.0);
        self
    }

    /// Returns the polygon at this place in the list.
    pub fn face(&self, index: usize) -> Self {
        Self(vec![self.0[index].clone()])
    }

    /// Moves the mesh by this vector.
    pub fn shifted(mut self, by: Point) -> Self {
        for p in self.0.iter_mut().flatten() {
            *p = [p[0] + by[0], p[1] + by[1], p[2] + by[2]];
        }
        self
    }

    /// Writes the mesh as OBJ text, to follow `corners` vertices that the file has already. Every
    /// length is multiplied by `scale`.
    fn obj_after(&self, corners: usize, scale: f64) -> String {
        let mut text = String::new();
        for [x, y, z] in self.0.iter().flatten() {
            text += &format!("v {} {} {}\n", x * scale, y * scale, z * scale);
        }
        let mut first = corners + 1;
        for polygon in &self.0 {
            let corners: Vec<String> =
                (first..first + polygon.len()).map(|i| i.to_string()).collect();
            text += &format!("f {}\n", corners.join(" "));
            first += polygon.len();
        }
        text
    }
}

/// Returns two unit vectors that are perpendicular to a unit vector and right-handed with it.
fn across(normal: Point) -> (Point, Point) {
    let n = glam::DVec3::from(normal);
    let (u, v) = n.any_orthonormal_pair();
    let (u, v) = if u.cross(v).dot(n) > 0.0 { (u, v) } else { (v, u) };
    (u.to_array(), v.to_array())
}

/// A scene under construction, with its meshes as files.
#[derive(Clone, Debug)]
pub struct World {
    pub scene: Value,
    files: Vec<(String, String)>,
    /// Units of length per metre.
    per_metre: f64,
}

impl World {
    /// Returns an empty scene with one band.
    pub fn new() -> Self {
        let scene = json!({ "materials": {}, "objects": [], "lights": [], "captors": [] });
        Self { scene, files: Vec::new(), per_metre: 1.0 }
    }

    /// Returns an empty scene whose file is written in millimetres; meshes are still given in
    /// metres.
    pub fn in_millimetres() -> Self {
        let mut world = Self { per_metre: 1000.0, ..Self::new() };
        world.scene["unit"] = json!("mm");
        world
    }

    /// Gives the scene this number of bands, named b0, b1, ...
    pub fn bands(mut self, count: usize) -> Self {
        let bands: Vec<Value> = (0..count).map(|b| json!({ "name": format!("b{b}") })).collect();
        self.scene["bands"] = json!(bands);
        self
    }

    /// Adds another top-level entry.
    pub fn with(mut self, key: &str, value: Value) -> Self {
        self.scene[key] = value;
        self
    }

    /// Adds a material.
    pub fn material(mut self, name: &str, material: Value) -> Self {
        self.scene["materials"][name] = material;
        self
    }

    /// Adds a Lambertian material.
    pub fn lambert(self, name: &str, reflectance: f64) -> Self {
        self.material(name, json!({ "type": "lambert", "reflectance": reflectance }))
    }

    /// Adds another file to the scene, unless one of this name is there already.
    pub fn with_file(mut self, name: &str, text: &str) -> Self {
        if !self.files.iter().any(|(file, _)| file == name) {
            self.files.push((name.into(), text.into()));
        }
        self
    }

    fn file(&mut self, name: &str, mesh: &Mesh) -> String {
        let name = format!("{name}.obj");
        self.files.push((name.clone(), mesh.obj_after(0, self.per_metre)));
        name
    }

    fn push(mut self, list: &str, entry: Value) -> Self {
        self.scene[list].as_array_mut().expect("a list").push(entry);
        self
    }

    /// Adds a surface that is not a captor.
    pub fn surface(mut self, name: &str, material: &str, mesh: &Mesh) -> Self {
        let obj = self.file(name, mesh);
        self.push("objects", json!({ "name": name, "obj": obj, "material": material }))
    }

    /// Adds a surface that is also a captor.
    pub fn counted(mut self, name: &str, material: &str, mesh: &Mesh) -> Self {
        let obj = self.file(name, mesh);
        let object = json!({ "name": name, "obj": obj, "material": material, "captor": true });
        self.push("objects", object)
    }

    /// Adds a light that has no mesh.
    pub fn light(self, light: Value) -> Self {
        self.push("lights", light)
    }

    /// Adds an area light of this power, W.
    pub fn lamp(mut self, name: &str, mesh: &Mesh, power: f64) -> Self {
        let obj = self.file(name, mesh);
        self.push("lights", json!({ "type": "area", "name": name, "obj": obj, "power": power }))
    }

    /// Adds a surface of this material that also emits this radiance.
    pub fn glowing(mut self, name: &str, material: &str, mesh: &Mesh, radiance: f64) -> Self {
        let obj = self.file(name, mesh);
        let light = json!({ "type": "area", "name": name, "obj": obj, "radiance": radiance,
                            "material": material });
        self.push("lights", light)
    }

    /// Adds a virtual captor of this shape; several polygons count together.
    pub fn captor(mut self, name: &str, mesh: &Mesh) -> Self {
        let obj = self.file(name, mesh);
        self.push("captors", json!({ "name": name, "obj": obj }))
    }

    /// Adds several virtual captors, which share one file and have a name each.
    pub fn captors(
        mut self,
        entry: &str,
        captors: impl IntoIterator<Item = (String, Mesh)>,
    ) -> Self {
        let (mut text, mut corners) = (String::new(), 0);
        for (name, mesh) in captors {
            text += &format!("o {name}\n{}", mesh.obj_after(corners, self.per_metre));
            corners += mesh.0.iter().map(Vec::len).sum::<usize>();
        }
        let obj = format!("{entry}.obj");
        self.files.push((obj.clone(), text));
        self.push("captors", json!({ "name": entry, "obj": obj }))
    }

    /// Adds a virtual captor that counts on both sides.
    pub fn captor_of_both_sides(mut self, name: &str, mesh: &Mesh) -> Self {
        let obj = self.file(name, mesh);
        self.push("captors", json!({ "name": name, "obj": obj, "sides": "both" }))
    }

    /// Lets the last captor entry weigh arrivals by their angle.
    pub fn response(mut self, response: Value) -> Self {
        let captors = self.scene["captors"].as_array_mut().expect("a list");
        captors.last_mut().expect("a captor")["response"] = response;
        self
    }

    /// Puts a captor entry into one more group.
    pub fn grouped(mut self, captor: usize, group: &str) -> Self {
        self.scene["captors"][captor]["group"] = json!(group);
        self
    }

    /// Changes the scene's JSON.
    pub fn edited(mut self, edit: impl FnOnce(&mut Value)) -> Self {
        edit(&mut self.scene);
        self
    }

    /// Writes the scene to a temporary folder. Photons are not guided unless the scene's settings
    /// say so.
    pub fn write(&self) -> TestScene {
        let mut scene = self.scene.clone();
        let guiding = &mut scene["settings"]["guiding"];
        if guiding.is_null() {
            *guiding = json!("off");
        }
        let files: Vec<(&str, &str)> =
            self.files.iter().map(|(name, text)| (name.as_str(), text.as_str())).collect();
        TestScene::new(&scene.to_string(), &files)
    }

    /// Runs the scene by backward paths, with this number of paths in all.
    pub fn run_paths(&self, paths: u64, seed: u64) -> RunResult {
        self.write().run_paths(paths, seed)
    }

    /// Runs the scene by complete paths, with this number of paths in all, and checks the energy
    /// ledger of the photons beside them.
    pub fn run_complete(&self, paths: u64, seed: u64) -> RunResult {
        let result = run_file(&self.write().path("scene.json"), |settings| {
            settings.estimator = Estimator::Complete;
            (settings.photons, settings.seed) = (PhotonCount::new(paths).ok(), seed);
        });
        check_ledger(&result);
        result
    }

    /// Runs the scene with photons, and checks its energy ledger.
    pub fn run(&self, photons: u64, seed: u64) -> RunResult {
        let result = self.write().run(photons, seed);
        check_ledger(&result);
        result
    }
}

/// Checks the energy ledger of a run in every band. The emitted power is the nominal power to 1e-11,
/// as n equal parts add up to within n rounding errors (2^-53), and what all materials absorb, what escapes and what is lost add up to it, to 1e-9. This
/// holds in every run and does not depend on chance.
///
/// Where guided photons are split or ended at random, the sum includes the power that these games
/// of chance took. It is 0 within 4 of its standard errors (odds of a false alarm 6e-5 for each
/// band).
pub fn check_ledger(result: &RunResult) {
    let energy = &result.energy;
    for (b, &power) in energy.power.iter().enumerate() {
        let close = |value: f64, expected: f64, tolerance: f64, what: &str| {
            let off = (value - expected).abs();
            assert!(off <= tolerance * power, "band {b}: {what} {value}, expected {expected}");
        };
        close(energy.emitted[b], power, 1e-11, "emitted");
        let by_material = energy.absorbed_by.iter().flatten().map(|(_, values)| values[b]).sum();
        close(by_material, energy.absorbed[b], 1e-12, "absorbed by all materials");
        let accounted = by_material + energy.escaped[b] + energy.lost[b];
        let chance = energy.chance.as_ref().map_or(0.0, |chance| chance[b]);
        close(accounted + chance, energy.emitted[b], 1e-9, "absorbed + escaped + lost");
        if let Some(errors) = &energy.chance_se {
            let error = errors[b].expect("an error");
            assert!(chance.abs() <= 4.0 * error, "band {b}: chance took {chance} +- {error}");
        }
    }
}

/// Returns what a group received on its front. Every captor entry and every object that is a captor
/// is a group.
pub fn front<'a>(result: &'a RunResult, group: &str) -> &'a FaceResult {
    let found = result.groups.iter().find(|g| g.id == group);
    &found.unwrap_or_else(|| panic!("no group {group}")).front
}

/// Returns what a group received on its back.
pub fn back<'a>(result: &'a RunResult, group: &str) -> &'a FaceResult {
    let found = result.groups.iter().find(|g| g.id == group);
    found.and_then(|g| g.back.as_ref()).unwrap_or_else(|| panic!("no back of {group}"))
}

/// Returns a room in two bands with a leaf in it and small captors in a row, `spacing` (m) apart.
/// It has no light.
pub fn room_with_leaf(captors: u32, spacing: f64) -> World {
    let leaf = json!({ "type": "leaf", "reflectance": [0.1, 0.45], "transmittance": [0.05, 0.45] });
    let tiles = (0..captors).map(|i| {
        let x = -0.8 + spacing * f64::from(i);
        (format!("{i}"), Mesh::square([x, 0.1, -0.4], [0.0, 0.0, 1.0], 0.3))
    });
    World::new()
        .bands(2)
        .lambert("wall", 0.5)
        .material("leaf", leaf)
        .counted("room", "wall", &room([-1.0; 3], [1.0; 3]))
        .counted("leaf", "leaf", &Mesh::square([0.0; 3], [0.0, 0.6, 0.8], 0.8))
        .captors("tiles", tiles)
}

/// Returns the inside of an axis-aligned box: [`Mesh::cuboid`] with its fronts turned inwards.
pub fn room(low: Point, high: Point) -> Mesh {
    Mesh::cuboid(low, high).flipped()
}

/// Returns a narrow beam of power 1 from `from` to `to`, with this half angle in degrees.
pub fn beam(from: Point, to: Point, half_angle_deg: f64) -> Value {
    let direction = [0, 1, 2].map(|i| to[i] - from[i]);
    json!({ "type": "spot", "position": from, "direction": direction,
            "half_angle_deg": half_angle_deg, "power": 1.0 })
}
