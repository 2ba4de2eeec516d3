//! A random cell of a scene that repeats, with copies that are turned, mirrored and scaled.

use std::f64::consts::TAU;

use glam::{DMat3, DVec3};
use serde_json::json;

use super::dice::Dice;
use crate::world::{Mesh, World};

/// Returns the cell with this number, whose copies share their triangles or have their own.
pub fn cell(number: u64, share: bool) -> World {
    let mut dice = Dice(number.wrapping_mul(0x9e6c_63d0_876a_68ed));
    let [x, y] = [(); 2].map(|()| dice.between(0.7, 1.6));
    let by_two = dice.chance(0.7);
    let rise = if dice.chance(0.5) { dice.between(-0.6, 0.6) } else { 0.0 };
    let periodic = match by_two {
        true => json!({ "x": [0, x], "y": [0, y], "slope": [rise * x, 0] }),
        false => json!({ "x": [0, x], "slope": [rise * x, 0] }),
    };
    let mut world =
        World::new().with("periodic", periodic).lambert("paint", dice.between(0.1, 0.6)).material(
            "leaf",
            json!({ "type": "leaf", "ior": 1.0, "reflectance": dice.between(0.05, 0.5),
                    "transmittance": dice.between(0.05, 0.45) }),
        );
    if dice.chance(0.7) {
        let soil = Mesh::rectangle([0.0; 3], [x, 0.0, rise * x], [0.0, y, 0.0]);
        world = world.counted("soil of paint", "paint", &soil);
    }
    for plant in 0..1 + dice.below(3) {
        let leaves = (0..2 + dice.below(3)).map(|_| {
            let middle = dice.between(0.0, 0.4) * dice.direction();
            let normal = dice.direction().to_array();
            Mesh::square(middle.to_array(), normal, dice.between(0.05, 0.3))
        });
        let mesh = leaves.reduce(Mesh::and).expect("a leaf");
        let mut rows = "m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23\n".to_owned();
        for _ in 0..2 + dice.below(3) {
            let turn = DMat3::from_axis_angle(dice.direction(), dice.between(0.0, TAU));
            let mirror = if dice.chance(0.5) { -1.0 } else { 1.0 };
            let linear = dice.between(0.5, 1.5) * mirror * turn;
            let [u, v] = [x, y].map(|length| dice.between(-0.5, 1.5) * length);
            let at = DVec3::new(u, v, 1.0 + dice.between(0.0, 1.5) + rise * u);
            for axis in 0..3 {
                let row = linear.row(axis);
                let end = if axis < 2 { ',' } else { '\n' };
                rows += &format!("{},{},{},{}{end}", row.x, row.y, row.z, at[axis]);
            }
        }
        let name = format!("plant of leaf {plant}");
        let (captor, file) = (dice.one_of(&["instance", "triangle"]), format!("rows{plant}.csv"));
        world = world.counted(&name, "leaf", &mesh).with_file(&file, &rows).edited(|scene| {
            let plant = scene["objects"].as_array_mut().unwrap().last_mut().unwrap();
            plant["instances"] = json!({ "csv": file });
            plant["share"] = json!(share);
            plant["captor"] = json!(captor);
        });
    }
    let [u, v] = [x, y].map(|length| dice.between(0.0, 1.0) * length);
    let sensor = Mesh::square([u, v, 0.3 + rise * u], dice.direction().to_array(), 0.3);
    world = world.captor_of_both_sides("sensor", &sensor);
    if dice.chance(0.5) {
        world = world.light(json!({ "type": "sky", "model": "uniform", "irradiance": 1,
                                    "ground": dice.between(0.0, 0.5) }));
    }
    if dice.chance(0.5) {
        let [elevation, azimuth] = [dice.between(35.0, 80.0), dice.between(0.0, 360.0)];
        world = world
            .with("sun_at", json!({ "elevation_deg": elevation, "azimuth_deg": azimuth }))
            .light(json!({ "type": "sun", "irradiance": 1 }));
    }
    let [u, v] = [x, y].map(|length| dice.between(0.0, 1.0) * length);
    world.light(json!({ "type": "point", "position": [u, v, 3.5 + rise * u], "power": 1 }))
}
