//! Random canopies of black leaves.

use std::{f64::consts::TAU, sync::atomic::AtomicBool};

use glam::DVec3;
use phylux::{
    Band, Control, Lambert, LightPart, LightShape, Material, NamedMaterial, RunResult, Scene,
    SceneParts, Settings, Stream, SurfacePart,
};

use crate::{
    exact::{Comparisons, integral, rounds_to},
    world::check_ledger,
};

/// Leaf area per ground area.
const LEAF_AREA_INDEX: f64 = 2.0;
/// Height of the layer, m.
const HEIGHT: f64 = 1.0;
/// Side of a leaf, m: the layer is seven leaves high and 56 to 133 wide.
const LEAF: f64 = 0.15;
const CANOPIES: u64 = 64;

/// Square leaves with normals uniform on the sphere, their number a Poisson variate and their centres
/// uniform in a layer of this width: a line through it misses them all with the chance
/// exp(-L / (2 cos)), whatever their size.
fn leaves(width: f64, seed: u64) -> Vec<[DVec3; 3]> {
    let mut rng = Stream::new(1234, seed, 0);
    let mut uniform = move || rng.uniform_fine();
    let expected = LEAF_AREA_INDEX * width * width / (LEAF * LEAF);
    let mut triangles = Vec::new();
    let mut gaps = -(1.0 - uniform()).ln();
    while gaps < expected {
        gaps -= (1.0 - uniform()).ln();
        let center = DVec3::new(
            width * (uniform() - 0.5),
            width * (uniform() - 0.5),
            HEIGHT * (uniform() - 0.5),
        );
        let z = 2.0 * uniform() - 1.0;
        let (sin, cos) = (TAU * uniform()).sin_cos();
        let across = (1.0 - z * z).sqrt();
        let (u, v) = DVec3::new(across * cos, across * sin, z).any_orthonormal_pair();
        let (sin, cos) = (TAU * uniform()).sin_cos();
        let (u, v) = (0.5 * LEAF * (cos * u + sin * v), 0.5 * LEAF * (cos * v - sin * u));
        triangles.push([center - u - v, center + u - v, center + u + v]);
        triangles.push([center - u - v, center + u + v, center - u + v]);
    }
    triangles
}

/// The canopy of a seed, under photons of a seed of their own too.
fn run(width: f64, light: LightShape, seed: u64) -> RunResult {
    let scene = Scene::new(SceneParts {
        bands: vec![Band { name: "all".into(), from_nm: None, to_nm: None }],
        materials: vec![NamedMaterial {
            name: "black".into(),
            material: Material::Lambert(Lambert::new(&[0.0])),
        }],
        surfaces: vec![SurfacePart {
            object: None,
            material: 0,
            captor: None,
            triangles: leaves(width, seed),
        }],
        lights: vec![LightPart { name: "lamp".into(), power: vec![1.0], shape: light }],
        ..SceneParts::default()
    })
    .unwrap_or_else(|e| panic!("{e}"));
    let settings = Settings { photons: Some(30_000), seed, k: Some(0), ..Settings::default() };
    let control = Control { stop: &AtomicBool::new(false), progress: &|_| {} };
    let simulation =
        phylux::simulate(&scene, &settings, &control).unwrap_or_else(|e| panic!("{e}"));
    let result = RunResult::new(&scene, &settings, &simulation);
    check_ledger(&result);
    result
}

/// Mean intercepted share over the canopies, and its standard error from their spread.
fn intercepted(canopy: impl Fn(u64) -> RunResult) -> (f64, f64) {
    let shares: Vec<f64> = (0..CANOPIES).map(|i| canopy(i).energy.absorbed[0]).collect();
    let n = CANOPIES as f64;
    let mean = shares.iter().sum::<f64>() / n;
    let squares = shares.iter().map(|s| (s - mean).powi(2)).sum::<f64>();
    (mean, (squares / (n * (n - 1.0))).sqrt())
}

/// Light straight down (a spot 200 m above that covers a disc of 4 m: its rays lean by up to a
/// degree, which is in the exact value) and uniform light from above (a Lambertian square in the
/// middle of a field so wide that what leaves sideways has met 8 m of canopy, exp(-8)).
/// Seeds 0 to 63 and 1000 to 1063, a canopy and 3e4 photons each, standard errors between canopies at
/// most 0.2 %; 2 comparisons, odds of a false alarm 3e-4 (63 degrees of freedom).
#[test]
fn black_canopy() {
    let mut check = Comparisons::new("canopy", 0.002);
    let intercepts = |cos: f64| 1.0 - (-LEAF_AREA_INDEX / (2.0 * cos)).exp();

    let half_angle = (4.0f64 / 200.0).atan();
    let above = LightShape::Spot {
        position: DVec3::new(0.0, 0.0, 200.0),
        direction: DVec3::NEG_Z,
        half_angle,
    };
    let (mean, error) = intercepted(|i| run(8.4, above.clone(), i));
    rounds_to(intercepts(1.0), 0.632_12, 1e-5);
    let edge = half_angle.cos();
    let exact = integral(edge, 1.0, 1, intercepts) / (1.0 - edge);
    check.add("straight down", mean, error, exact);

    let corner = |x: f64, y: f64| DVec3::new(x, y, 0.5 * HEIGHT + LEAF);
    let [a, b, c, d] = [corner(-2.0, -2.0), corner(-2.0, 2.0), corner(2.0, 2.0), corner(2.0, -2.0)];
    let square = LightShape::Area { triangles: vec![[a, b, c], [a, c, d]], two_sided: false };
    let (mean, error) = intercepted(|i| run(20.0, square.clone(), 1000 + i));
    let exact = integral(0.0, 1.0, 20, |cos| 2.0 * cos * intercepts(cos));
    rounds_to(exact, 0.780_62, 1e-5);
    check.add("uniform light from above", mean, error, exact);
    check.finish(2);
}
