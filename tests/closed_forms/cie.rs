//! Test cases of CIE 171:2006 (Test Cases to Assess the Accuracy of Lighting Computer Programs),
//! with W in place of lm.
//!
//! The standard gives illuminances at points, but captors are surfaces. Each closed form is
//! therefore first checked against the standard's numbers at its points, and then integrated over
//! captors that contain these points.

use std::f64::consts::PI;

use serde_json::json;

use crate::{
    exact::{Comparisons, mean_over, polygon_irradiance, rounds_to},
    world::{Mesh, Point, World, front, room},
};

/// Returns a mesh together with its mirror images in the other three quarters of the floor
/// (mirrored in x, in y, and in both).
fn mirrored(mesh: &Mesh) -> Mesh {
    let flip = |sx: f64, sy: f64| {
        let copy = mesh.0.iter().map(|polygon| {
            polygon.iter().map(|&[x, y, z]| [sx * x, sy * y, z]).collect::<Vec<_>>()
        });
        let copy = Mesh(copy.collect());
        if sx * sy < 0.0 { copy.flipped() } else { copy }
    };
    flip(1.0, 1.0).and(flip(-1.0, 1.0)).and(flip(1.0, -1.0)).and(flip(-1.0, -1.0))
}

/// CIE 171 5.2: two point sources 3 m above the floor. A Lambertian point of axial intensity I0 =
/// 1000 cd gives E = I0 h2 / d4 (here an area light with a side of 1 mm), an isotropic point gives
/// E = I h / d3. The captors are squares with sides of 0.6 m around the standard's points, each
/// together with its mirror images in the other quarters of the floor.
///
/// Seed 2, 2e7 photons; standard errors at most 0.2 % of the exact value. 14 comparisons, odds of a
/// false alarm 1.5e-3.
#[test]
fn point_sources_of_cie_5_2() {
    const H: f64 = 3.0;
    let lambert = |p: Point| 1000.0 * H * H / (p[0] * p[0] + p[1] * p[1] + H * H).powi(2);
    let isotropic = |p: Point| 1000.0 * H / (p[0] * p[0] + p[1] * p[1] + H * H).powf(1.5);
    let published = [
        ([0.0, 0.0], 111.11),
        ([0.5, 0.0], 105.21),
        ([1.0, 0.0], 90.02),
        ([1.5, 0.0], 71.11),
        ([0.5, 0.5], 99.73),
        ([1.0, 1.0], 74.36),
        ([1.5, 1.5], 49.39),
    ];
    let mut world = World::new();
    let mut captors = Vec::new();
    for (i, ([x, y], lux)) in published.into_iter().enumerate() {
        // the numbers that the standard prints are themselves rounded wrongly, by up to 0.024
        rounds_to(lambert([x, y, 0.0]), lux, 0.05);
        let (corner, u, v) = ([x - 0.3, y - 0.3, 0.0], [0.6, 0.0, 0.0], [0.0, 0.6, 0.0]);
        world = world.captor(&format!("p{i}"), &mirrored(&Mesh::rectangle(corner, u, v)));
        captors.push((corner, u, v));
    }
    let lamp = Mesh::square([0.0, 0.0, H], [0.0, 0.0, -1.0], 0.001);
    let mut check = Comparisons::new("CIE 5.2", 0.002);
    let run = world.clone().lamp("lamp", &lamp, 1000.0 * PI).run(20_000_000, 2);
    for (i, &(corner, u, v)) in captors.iter().enumerate() {
        let exact = mean_over(corner, u, v, lambert);
        check.irradiance(format!("Lambertian, {i}"), front(&run, &format!("p{i}")), 0, exact);
    }
    // captors see only the lower half space of an isotropic point, so a spot that covers them is
    // enough
    let point = json!({ "type": "spot", "position": [0.0, 0.0, H], "direction": [0.0, 0.0, -1.0],
                        "half_angle_deg": 60.0, "power": 1000.0 * PI });
    let run = world.light(point).run(20_000_000, 2);
    for (i, &(corner, u, v)) in captors.iter().enumerate() {
        let exact = mean_over(corner, u, v, isotropic);
        check.irradiance(format!("isotropic, {i}"), front(&run, &format!("p{i}")), 0, exact);
    }
    check.finish(14);
}

/// CIE 171 5.3: a Lambertian square metre of axial intensity 1000 cd in the ceiling of a black room
/// of 4 x 4 x 3 m. The closed form is the irradiance by a polygon of uniform radiance. CIE 171 5.4:
/// all surfaces of the room together receive exactly the power that the lamp emits.
///
/// Seed 3, 2e7 photons; standard errors at most 0.2 % of the exact value. 10 comparisons, odds of a
/// false alarm 1.1e-3.
#[test]
fn area_source_of_cie_5_3_and_flux_of_5_4() {
    let lamp = Mesh::square([0.0, 0.0, 3.0], [0.0, 0.0, -1.0], 1.0);
    let polygon = lamp.0[0].clone();
    let power = 1000.0 * PI;
    let walls = room([-2.0, -2.0, 0.0], [2.0, 2.0, 3.0]);
    let mut world = World::new()
        .lambert("black", 0.0)
        .counted("room", "black", &walls)
        .lamp("lamp", &lamp, power);
    let on_wall = |p: Point| 1000.0 * polygon_irradiance(p, [-1.0, 0.0, 0.0], &polygon);
    let on_floor = |p: Point| 1000.0 * polygon_irradiance(p, [0.0, 0.0, 1.0], &polygon);

    let mut captors = Vec::new();
    let wall_points =
        [(2.75, 32.68), (2.25, 75.19), (1.75, 81.32), (1.25, 69.06), (0.75, 53.40), (0.25, 40.00)];
    for (z, lux) in wall_points {
        rounds_to(on_wall([2.0, 0.0, z]), lux, 0.01);
        let (corner, u, v) = ([2.0, -1.0, z - 0.25], [0.0, 0.0, 0.5], [0.0, 2.0, 0.0]);
        let strip = Mesh::rectangle(corner, u, v);
        let other = Mesh(vec![strip.0[0].iter().map(|&[x, y, z]| [-x, -y, z]).collect()]);
        let name = format!("wall {z}");
        world = world.captor(&name, &strip.and(other));
        captors.push((name, mean_over(corner, u, v, on_wall)));
    }
    for (from_wall, lux) in [(0.25, 61.42), (0.75, 79.26), (1.25, 95.67), (1.75, 105.78)] {
        let y = 2.0 - from_wall;
        rounds_to(on_floor([0.0, y, 0.0]), lux, 0.01);
        let (corner, u, v) = ([-1.0, y - 0.25, 0.0], [2.0, 0.0, 0.0], [0.0, 0.5, 0.0]);
        let strip = Mesh::rectangle(corner, u, v);
        let other = Mesh(vec![strip.0[0].iter().map(|&[x, y, z]| [-x, -y, z]).collect()]);
        let name = format!("floor {from_wall}");
        world = world.captor(&name, &strip.and(other));
        captors.push((name, mean_over(corner, u, v, on_floor)));
    }
    let run = world.run(20_000_000, 3);
    let mut check = Comparisons::new("CIE 5.3", 0.002);
    for (name, exact) in captors {
        check.irradiance(&name, front(&run, &name), 0, exact);
    }
    check.finish(10);

    let received = front(&run, "room");
    assert_eq!(received.photons, 20_000_000, "every photon arrives once");
    assert!((received.flux[0] - power).abs() < 1e-9 * power, "{} W arrive", received.flux[0]);
    assert_eq!(run.energy.escaped[0], 0.0);
}

/// CIE 171 5.6: a diffuse floor of reflectance rho = 0.3 under uniform light illuminates black
/// walls and a black ceiling. The standard gives E / (E_h rho) there, where E_h is the irradiance
/// of the floor. The uniform light comes from a Lambertian sheet 0.1 mm above the floor, which
/// casts no shadow.
///
/// Seed 4, 3e7 photons; standard errors at most 0.2 % of the exact value. 9 comparisons, odds of a
/// false alarm 1e-3.
#[test]
fn diffuse_floor_of_cie_5_6() {
    const RHO: f64 = 0.3;
    let floor = Mesh::square([0.0; 3], [0.0, 0.0, 1.0], 4.0);
    let polygon = floor.0[0].clone();
    let lamp = Mesh::square([0.0, 0.0, 1e-4], [0.0, 0.0, -1.0], 4.0);
    let mut world = World::new()
        .lambert("floor", RHO)
        .lambert("black", 0.0)
        .surface("floor", "floor", &floor)
        .lamp("lamp", &lamp, 16.0);
    let walls = room([-2.0, -2.0, 0.0], [2.0, 2.0, 3.0]);
    for face in [0, 1, 2, 3, 5] {
        world = world.surface(&format!("face {face}"), "black", &walls.face(face));
    }
    let on_wall = |p: Point| polygon_irradiance(p, [-1.0, 0.0, 0.0], &polygon) / PI;
    let on_ceiling = |p: Point| polygon_irradiance(p, [0.0, 0.0, -1.0], &polygon) / PI;
    let quarter_turn = |mesh: &Mesh| {
        Mesh(vec![mesh.0[0].iter().map(|&[x, y, z]| [-y, x, z]).collect::<Vec<Point>>()])
    };
    let all_around = |mesh: &Mesh| {
        let [b, c] = [quarter_turn(mesh), quarter_turn(&quarter_turn(mesh))];
        mesh.clone().and(quarter_turn(&c)).and(b).and(c)
    };
    let mut captors = Vec::new();
    let wall_points = [(0.75, 35.90), (1.25, 27.99), (1.75, 21.64), (2.25, 16.72), (2.75, 12.97)];
    for (z, percent) in wall_points {
        rounds_to(100.0 * on_wall([2.0, 0.0, z]), percent, 0.01);
        let (corner, u, v) = ([2.0, -1.5, z - 0.25], [0.0, 0.0, 0.5], [0.0, 3.0, 0.0]);
        let name = format!("wall {z}");
        world = world.captor(&name, &all_around(&Mesh::rectangle(corner, u, v)));
        captors.push((name, mean_over(corner, u, v, on_wall)));
    }
    for (y, percent) in [(0.25, 26.80), (0.75, 30.94), (1.25, 33.98), (1.75, 35.57)] {
        let y = 2.0 - y;
        rounds_to(100.0 * on_ceiling([0.0, y, 3.0]), percent, 0.01);
        let (corner, u, v) = ([-1.0, y - 0.25, 3.0], [0.0, 0.5, 0.0], [2.0, 0.0, 0.0]);
        let name = format!("ceiling {y}");
        world = world.captor(&name, &all_around(&Mesh::rectangle(corner, u, v)));
        captors.push((name, mean_over(corner, u, v, on_ceiling)));
    }
    let run = world.run(30_000_000, 4);
    let mut check = Comparisons::new("CIE 5.6", 0.002);
    for (name, exact) in captors {
        check.irradiance(&name, front(&run, &name), 0, RHO * exact);
    }
    check.finish(9);
    assert_eq!(run.energy.escaped[0], 0.0);
}

/// CIE 171 5.8: a cube of 4 m with a lamp of 10 000 lm at its centre. The mean indirect illuminance
/// of the walls is rho Phi / (96 (1 - rho)), where 96 m2 is their area. The seven reflectances rho
/// of the standard are seven bands of one run.
///
/// Seed 5, 5e5 photons; standard errors at most 0.2 % of the exact value. 7 comparisons, odds of a
/// false alarm 8e-4.
#[test]
fn interreflections_of_cie_5_8() {
    let published = [
        (0.05, 5.48),
        (0.1, 11.6),
        (0.2, 26.0),
        (0.5, 104.0),
        (0.8, 417.0),
        (0.9, 937.0),
        (0.95, 1979.0),
    ];
    let reflectance: Vec<f64> = published.iter().map(|(rho, _)| *rho).collect();
    let walls = room([-2.0; 3], [2.0; 3]);
    let run = World::new()
        .bands(7)
        .material("wall", json!({ "type": "lambert", "reflectance": reflectance }))
        .counted("room", "wall", &walls)
        .light(json!({ "type": "point", "position": [0.0, 0.0, 0.0], "power": 10_000.0 }))
        .run(500_000, 5);
    let mut check = Comparisons::new("CIE 5.8", 0.002);
    for (band, (rho, lux)) in published.into_iter().enumerate() {
        let exact = rho * 10_000.0 / (96.0 * (1.0 - rho));
        rounds_to(exact / lux, 1.0, 0.01);
        let received = front(&run, "room");
        // each photon arrives once directly, so the direct part is exact and all the error is in
        // the indirect part
        let indirect = received.irradiance[band] - 10_000.0 / 96.0;
        let se = received.irradiance_se[band].unwrap();
        check.add(format!("rho {rho}"), indirect, se, exact);
        assert_eq!(run.energy.escaped[band], 0.0);
    }
    check.finish(7);
}
