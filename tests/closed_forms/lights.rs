//! The directions into which lights emit: cones, points, tubes and lines.

use std::f64::consts::{PI, TAU};

use serde_json::json;

use crate::{
    exact::{Comparisons, integral, mean_over},
    world::{Mesh, Point, World, front, room},
};

/// Returns the solid angle (sr) of a rectangle with sides `a` and `b`, seen from a point at
/// `height` above one of its corners.
fn solid_angle(a: f64, b: f64, height: f64) -> f64 {
    (a * b / (height * (a * a + b * b + height * height).sqrt())).atan()
}

/// Radii of the captors of [`spot_world`], as fractions of the spot's half angle.
pub const SPOT_SHARES: [f64; 3] = [0.3, 0.6, 0.9];

/// Returns the fraction of a cone's solid angle that lies within the fraction `share` of its half
/// angle (degrees).
pub fn share_of_cone(share: f64, half_angle: f64) -> f64 {
    let versine = |angle: f64| 2.0 * (0.5 * angle.to_radians()).sin().powi(2);
    versine(share * half_angle) / versine(half_angle)
}

/// Returns a black room with a spot above disc captors inside its cone. One more captor surrounds
/// the cone, whose inner radius is 0.05 % larger than that of the lit disc.
pub fn spot_world(half_angle: f64, distance: f64) -> World {
    let width = distance * half_angle.to_radians().tan();
    let ring = |k: usize, radius: f64| {
        let (sin, cos) = (k as f64 * TAU / 256.0).sin_cos();
        [radius * cos, radius * sin, -distance]
    };
    let outside = (0..256).map(|k| {
        let (inner, outer) = (1.0005 * width, 3.0 * width);
        vec![ring(k, inner), ring(k, outer), ring(k + 1, outer), ring(k + 1, inner)]
    });
    let walls = room([-3.0 * width, -3.0 * width, -distance - 1.0], [3.0 * width; 3]);
    let world = World::new()
        .lambert("black", 0.0)
        .surface("walls", "black", &walls)
        .captor("outside", &Mesh(outside.collect()))
        .light(json!({ "type": "spot", "position": [0, 0, 0], "direction": [0, 0, -2],
                       "half_angle_deg": half_angle, "power": 1.0 }));
    SPOT_SHARES.into_iter().fold(world, |world, share| {
        let radius = distance * (share * half_angle).to_radians().tan();
        let disc = Mesh::disc([0.0, 0.0, -distance], [0.0, 0.0, 1.0], radius);
        world.captor(&format!("inside {share}"), &disc)
    })
}

/// A spot with a half angle of 30 degrees in a black room has the same intensity everywhere in its
/// cone, and not one photon falls outside. A second spot has a half angle of half a degree and
/// shines over 10 m.
///
/// Seed 1, 3e6 photons; standard errors at most 0.2 % of the exact value. 6 comparisons, odds of a
/// false alarm 7e-4.
#[test]
fn spot_fills_its_cone() {
    let mut check = Comparisons::new("spot", 0.002);
    for (half_angle, distance) in [(30.0, 2.0), (0.5, 10.0)] {
        let run = spot_world(half_angle, distance).run(3_000_000, 1);
        for share in SPOT_SHARES {
            let exact = share_of_cone(share, half_angle);
            let what = format!("{share} of {half_angle} degrees");
            check.flux(what, front(&run, &format!("inside {share}")), 0, exact);
        }
        assert_eq!(front(&run, "outside").photons, 0, "photons outside {half_angle} degrees");
        assert_eq!(run.energy.escaped[0], 0.0);
    }
    check.finish(6);
}

/// A spot with a half angle of 180 degrees is a point light. Both send to each face of a box around
/// them a flux in proportion to the solid angle of that face, seen from the light. The light does
/// not stand in the middle of the box.
///
/// Seed 2, 3e6 photons; standard errors at most 0.2 % of the exact value. 12 comparisons, odds of a
/// false alarm 1.3e-3.
#[test]
fn widest_spot_and_point_are_isotropic() {
    let (low, high) = ([-0.8, -1.0, -0.9], [1.0, 0.7, 1.2]);
    let walls = room(low, high);
    let mut world = World::new().lambert("black", 0.0);
    for face in 0..6 {
        world = world.counted(&format!("face {face}"), "black", &walls.face(face));
    }
    let point = json!({ "type": "point", "position": [0, 0, 0], "power": 1 });
    let spot = json!({ "type": "spot", "position": [0, 0, 0], "direction": [1, -2, 3],
                       "half_angle_deg": 180, "power": 1 });
    let mut check = Comparisons::new("isotropic", 0.002);
    for (name, light) in [("point", point), ("spot", spot)] {
        let run = world.clone().light(light).run(3_000_000, 2);
        for face in 0..6 {
            let axis = face / 2;
            let height: f64 = if face % 2 == 0 { low[axis] } else { high[axis] };
            let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
            let corners = [low[j], high[j]].into_iter().flat_map(|a| [(a, low[k]), (a, high[k])]);
            let angle: f64 =
                corners.map(|(a, b): (f64, f64)| solid_angle(a.abs(), b.abs(), height.abs())).sum();
            let received = front(&run, &format!("face {face}"));
            check.flux(format!("{name}, face {face}"), received, 0, angle / (4.0 * PI));
        }
        assert_eq!(run.energy.escaped[0], 0.0);
    }
    check.finish(12);
}

pub const LENGTH: f64 = 1.2;

/// Returns the captors around a tube that goes from the origin along x, each with a name, its
/// corner and sides, and its normal. One lies below the tube, one half beyond its end, and one
/// stands across its end.
pub fn around_the_tube() -> [(&'static str, [Point; 3], Point); 3] {
    let (x, y) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    let below = [0.1, -0.5, -0.3];
    let beyond = [LENGTH - 0.5, 0.1, -0.3];
    let across = [LENGTH + 0.2, -0.5, -0.3];
    [
        ("below", [below, x, y], [0.0, 0.0, 1.0]),
        ("beyond", [beyond, x, [0.0, 0.5, 0.0]], [0.0, 0.0, 1.0]),
        ("across", [across, [0.0, 0.0, 1.0], y], [-1.0, 0.0, 0.0]),
    ]
}

pub fn tube_world() -> World {
    around_the_tube().into_iter().fold(World::new(), |world, (name, [corner, u, v], _)| {
        world.captor(name, &Mesh::rectangle(corner, u, v))
    })
}

/// Returns the irradiance at `p` by a line of power 1. `radiates` gives the line's power per length
/// and solid angle, 1/(m sr), for the sine of the angle to its axis.
pub fn line_irradiance(p: Point, normal: Point, radiates: impl Fn(f64) -> f64) -> f64 {
    integral(0.0, LENGTH, 8, |x| {
        let to = [x - p[0], -p[1], -p[2]];
        let d2: f64 = to.iter().map(|c| c * c).sum();
        let cos = to.iter().zip(normal).map(|(a, b)| a * b).sum::<f64>() / d2.sqrt();
        let sine = (1.0 - to[0] * to[0] / d2).sqrt();
        radiates(sine) * cos.max(0.0) / d2
    })
}

/// Two line lights. A Lambertian tube that becomes thinner and thinner tends to a line with Phi /
/// (pi2 l) x sine of the angle to the axis, per length and solid angle; an isotropic line has Phi /
/// (4 pi l). Both are integrated over the line and the captors.
///
/// Seed 3, 8e6 photons; standard errors at most 0.2 % of the exact value. 6 comparisons, odds of a
/// false alarm 7e-4.
#[test]
fn line_lights() {
    let ends = json!({ "type": "tube", "from": [0, 0, 0], "to": [LENGTH, 0, 0], "radius": 0,
                       "power": 1 });
    let mut isotropic = ends.clone();
    isotropic["emission"] = json!("isotropic");
    let mut check = Comparisons::new("line", 0.002);
    let lambertian = tube_world().light(ends).run(8_000_000, 3);
    let isotropic = tube_world().light(isotropic).run(8_000_000, 3);
    for (name, [corner, u, v], normal) in around_the_tube() {
        let mean = |radiates: fn(f64) -> f64| {
            mean_over(corner, u, v, |p| line_irradiance(p, normal, radiates))
        };
        let exact = mean(|sine| sine / (PI * PI * LENGTH));
        check.irradiance(format!("Lambertian, {name}"), front(&lambertian, name), 0, exact);
        let exact = mean(|_| 1.0 / (4.0 * PI * LENGTH));
        check.irradiance(format!("isotropic, {name}"), front(&isotropic, name), 0, exact);
    }
    check.finish(6);
}

/// Radius of the tube that is not a line, m.
pub const RADIUS: f64 = 0.1;

/// Returns the irradiance at `p` by a tube of power 1, integrated over the part of its side that
/// `p` sees.
pub fn tube_irradiance(p: Point, normal: Point) -> f64 {
    const TURNS: usize = 200;
    let radiance = 1.0 / (PI * TAU * RADIUS * LENGTH);
    let turn = |k: usize| {
        let (sin, cos) = ((k as f64 + 0.5) * TAU / TURNS as f64).sin_cos();
        integral(0.0, LENGTH, 4, |x| {
            let to = [x - p[0], RADIUS * cos - p[1], RADIUS * sin - p[2]];
            let d2: f64 = to.iter().map(|c| c * c).sum();
            let here = to.iter().zip(normal).map(|(a, b)| a * b).sum::<f64>();
            let there = -(to[1] * cos + to[2] * sin);
            here.max(0.0) * there.max(0.0) / (d2 * d2)
        })
    };
    radiance * TAU / TURNS as f64 * RADIUS * (0..TURNS).map(turn).sum::<f64>()
}

/// A tube with a radius of 0.1 m, once as a light only and once also as an obstacle of 64 sides.
/// The exact value is the integral of the tube's radiance over what a captor sees of it. The
/// obstacle's sides are convex and nothing lights its caps, so all of its power leaves.
///
/// Seed 4, 8e6 photons; standard errors at most 0.2 % of the exact value. 6 comparisons, odds of a
/// false alarm 7e-4.
#[test]
fn tubes() {
    let tube = json!({ "type": "tube", "from": [0, 0, 0], "to": [LENGTH, 0, 0], "radius": RADIUS,
                       "power": 1 });
    let mut obstacle = tube.clone();
    obstacle["material"] = json!("white");
    let bare = tube_world().light(tube).run(8_000_000, 4);
    let solid = tube_world().lambert("white", 1.0).light(obstacle).run(8_000_000, 4);
    let mut check = Comparisons::new("tube", 0.002);
    for (name, [corner, u, v], normal) in around_the_tube() {
        let exact = mean_over(corner, u, v, |p| tube_irradiance(p, normal));
        check.irradiance(format!("light, {name}"), front(&bare, name), 0, exact);
        check.irradiance(format!("obstacle, {name}"), front(&solid, name), 0, exact);
    }
    check.finish(6);
    assert_eq!(solid.energy.absorbed[0], 0.0, "nothing returns to a convex lamp");
    assert_eq!(
        solid.energy.absorbed_by.as_ref().map(|all| all.len()),
        Some(2),
        "the tube's material and its black caps"
    );
}
