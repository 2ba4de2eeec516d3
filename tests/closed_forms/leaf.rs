//! A leaf in an integrating sphere, which here is a closed black box that the leaf divides into two
//! halves.

use serde_json::{Value, json};

use crate::{
    exact::{Comparisons, fresnel, integral},
    world::{Mesh, Point, World, beam, front, room},
};

const IOR: f64 = 1.425;

fn cuticle(cos: f64) -> f64 {
    let [s, p] = fresnel(cos, IOR);
    0.5 * (s + p)
}

/// Returns a black box of 2 x 2 x 2 m with the leaf across its middle. The walls of each half of
/// the box are a captor.
fn sphere(leaf: Value, bands: usize) -> World {
    World::new()
        .bands(bands)
        .lambert("black", 0.0)
        .material("leaf", leaf)
        .surface("leaf", "leaf", &Mesh::square([0.0; 3], [0.0, 0.0, 1.0], 2.0))
        .counted("upper", "black", &half(0.0, 1.0))
        .counted("lower", "black", &half(-1.0, 0.0))
}

/// Returns the walls of the box between two heights, with no wall where the leaf is.
fn half(low: f64, high: f64) -> Mesh {
    let walls = room([-1.0, -1.0, low], [1.0, 1.0, high]);
    let end = if low == 0.0 { 5 } else { 4 };
    [0, 1, 2, 3, end].into_iter().fold(Mesh::default(), |mesh, i| mesh.and(walls.face(i)))
}

fn towards_the_leaf(degrees: f64, side: f64) -> Point {
    let (sin, cos) = degrees.to_radians().sin_cos();
    [0.9 * sin, 0.0, side * 0.9 * cos]
}

/// Measuring a leaf gives its reflectance R and transmittance T back. Near normal incidence they
/// are the values that the scene states, on both faces and in four bands at once. At 60 degrees the
/// reflectance is F + r (1 - F) and the transmittance t (1 - F), where F is the reflectance of the
/// cuticle, and r = (R - F0) / (1 - F0) and t = T / (1 - F0) are fractions of the light that enters
/// the leaf (F0 is F at normal incidence).
///
/// Seed 1, 1.2e6 photons; standard errors at most 0.2 % of the exact value. 32 comparisons, odds of
/// a false alarm 4e-3.
#[test]
fn leaf_in_an_integrating_sphere() {
    let f0 = cuticle(1.0);
    let faces = [
        ([0.09, 0.45, 0.52, 0.10], [0.04, 0.45, 0.48, 0.30]),
        ([0.12, 0.46, 0.52, 0.70], [0.04, 0.45, 0.48, 0.30]),
    ];
    let leaf = json!({ "type": "leaf", "reflectance": faces[0].0, "transmittance": faces[0].1,
                       "back": { "reflectance": faces[1].0 } });
    let world = sphere(leaf, 4);
    let mut check = Comparisons::new("leaf", 0.002);
    for (side, (reflectance, transmittance)) in [1.0, -1.0].into_iter().zip(faces) {
        let [here, there] = if side > 0.0 { ["upper", "lower"] } else { ["lower", "upper"] };
        for degrees in [0.0, 60.0] {
            let light = beam(towards_the_leaf(degrees, side), [0.0; 3], 0.2);
            let run = world.clone().light(light).run(1_200_000, 1);
            let f = cuticle(f64::cos(f64::to_radians(degrees)));
            for band in 0..4 {
                // of the light that enters the leaf, a fraction (R - F0) / (1 - F0) comes back and
                // T / (1 - F0) goes through
                let entered = (1.0 - f) / (1.0 - f0);
                let r = f + entered * (reflectance[band] - f0);
                let t = entered * transmittance[band];
                if degrees == 0.0 {
                    assert!((r - reflectance[band]).abs() < 1e-12);
                }
                let what = |lobe| format!("{lobe} of band {band} at {degrees}, side {side}");
                check.flux(what("R"), front(&run, here), band, r);
                check.flux(what("T"), front(&run, there), band, t);
            }
            assert_eq!(run.energy.escaped, [0.0; 4]);
        }
    }
    check.finish(32);
}

/// A leaf whose stated reflectance is less than what its cuticle alone reflects, F0, reflects F0.
///
/// Seed 3, 1e7 photons; standard error at most 0.2 % of the exact value. 1 comparison, odds of a
/// false alarm 1.1e-4.
#[test]
fn dark_leaf_shows_its_cuticle() {
    let leaf = json!({ "type": "leaf", "reflectance": 0.01, "transmittance": 0 });
    let run = sphere(leaf, 1).light(beam([0.0, 0.0, 0.9], [0.0; 3], 0.2)).run(10_000_000, 3);
    let mut check = Comparisons::new("dark leaf", 0.002);
    check.flux("R", front(&run, "upper"), 0, cuticle(1.0));
    check.finish(1);
    assert_eq!(front(&run, "lower").photons, 0);
}

/// Light from inside a leaf leaves it with a density proportional to (1 - F) cos over directions. A
/// narrow beam falls on the leaf at normal incidence, and captors on both sides collect the light
/// within cones of 30, 60 and 80 degrees: on the reflected side the lobe's share in the cone and
/// the mirror image of the beam, on the transmitted side the lobe's share alone.
///
/// Seed 2, 2e6 photons; standard errors at most 0.2 % of the exact value. 6 comparisons, odds of a
/// false alarm 7e-4.
#[test]
fn light_leaves_a_leaf_refracted() {
    let f0 = cuticle(1.0);
    let density = |cos: f64| 2.0 * cos * (1.0 - cuticle(cos));
    // substitutes cos = x^2, because F is steep at grazing angles
    let over = |low: f64| integral(low.sqrt(), 1.0, 50, |x| 2.0 * x * density(x * x));
    let all = over(0.0);
    assert!((all - (1.0 - 0.0806)).abs() < 5e-5, "Fbar {}", 1.0 - all);

    let leaf = json!({ "type": "leaf", "reflectance": 0.5, "transmittance": 0.45 });
    let mut world = sphere(leaf, 1).light(beam([0.0, 0.0, 0.9], [0.0; 3], 0.02));
    let angles = [30.0f64, 60.0, 80.0];
    for degrees in angles {
        let (distance, slope) = (0.12, degrees.to_radians().tan());
        for (name, side) in [("reflected", 1.0), ("transmitted", -1.0)] {
            let center = [0.0, 0.0, side * distance];
            let disc = Mesh::disc(center, [0.0, 0.0, -side], distance * slope);
            world = world.captor(&format!("{name} {degrees}"), &disc);
        }
    }
    let run = world.run(2_000_000, 2);
    let mut check = Comparisons::new("leaf lobe", 0.002);
    for degrees in angles {
        let share = over(degrees.to_radians().cos()) / all;
        let name = |lobe| format!("{lobe} {degrees}");
        let reflected = f0 + (0.5 - f0) * share;
        check.flux(name("reflected"), front(&run, &name("reflected")), 0, reflected);
        check.flux(name("transmitted"), front(&run, &name("transmitted")), 0, 0.45 * share);
    }
    check.finish(6);
}
