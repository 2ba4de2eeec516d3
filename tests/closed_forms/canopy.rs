//! Random canopies of black leaves, whose interception follows Beer's law.

use std::{
    f64::consts::{FRAC_1_PI, TAU},
    sync::Arc,
};

use glam::DVec3;
use phylux::{
    Control, Estimator, RunResult, Scene, Settings,
    math::Stream,
    scene::{
        Area, Band, CaptorKind, CaptorPart, Cone, Lambert, Lamp, LightPart, LightSource, Material,
        NamedMaterial, SceneParts, Sensor, SurfacePart,
        daylight::{InfiniteLight, InfinitePart, InfiniteShape, RadianceMap},
    },
    transport::{NearestCount, PhotonCount},
};

use crate::{
    exact::{Comparisons, integral, rounds_to},
    world::check_ledger,
};

/// Leaf area (one side) per ground area.
const LEAF_AREA_INDEX: f64 = 2.0;
/// Height of the canopy, m.
const HEIGHT: f64 = 1.0;
/// Side of a leaf, m. The canopy is about seven leaves high and 56 to 133 leaves wide.
const LEAF: f64 = 0.15;
const CANOPIES: u64 = 64;

/// Returns the triangles of a random canopy: square leaves in a layer of this width (m). The
/// normals are uniform on the sphere, the number of leaves is a Poisson variate, and the centres
/// are uniform in the layer. A line through the layer therefore misses all leaves with probability
/// exp(-L / (2 cos)), whatever their size, where L is the leaf area index and cos the cosine of the
/// line's zenith angle.
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

/// Runs the canopy of this seed under `light`; the run's own random numbers have the same seed.
/// Light is traced by photons if there are no captors, and otherwise by backward paths from them.
fn run(width: f64, light: LightSource, captors: Vec<CaptorPart>, seed: u64) -> RunResult {
    let estimator = if captors.is_empty() { Estimator::Photons } else { Estimator::Paths };
    let scene = Scene::new(SceneParts {
        bands: vec![Band { name: "all".into(), from_nm: None, to_nm: None }],
        materials: vec![NamedMaterial {
            name: "black".into(),
            material: Material::Lambert(Lambert::new(&[0.0]).unwrap()),
        }],
        surfaces: vec![SurfacePart {
            object: None,
            material: 0,
            captor: None,
            triangles: leaves(width, seed),
        }],
        lights: vec![LightPart::new("lamp", light)],
        captors,
        ..SceneParts::default()
    })
    .unwrap_or_else(|e| panic!("{e}"));
    let settings = Settings {
        photons: PhotonCount::new(15_000).ok(),
        seed,
        k: Some(NearestCount::NONE),
        estimator,
        ..Settings::default()
    };
    let control = Control::default();
    let simulation =
        phylux::simulate(&scene, &settings, &control).unwrap_or_else(|e| panic!("{e}"));
    RunResult::new(&simulation)
}

/// Returns the flux that the leaves absorb from a lamp of power 1 above them.
fn caught(width: f64, light: LightSource, seed: u64) -> f64 {
    let result = run(width, light, Vec::new(), seed);
    check_ledger(&result);
    result.energy.absorbed[0]
}

/// Returns the mean of the intercepted fraction over all canopies, and its standard error, from the
/// spread of the canopies.
fn intercepted(canopy: impl Fn(u64) -> f64) -> (f64, f64) {
    let shares: Vec<f64> = (0..CANOPIES).map(canopy).collect();
    let n = CANOPIES as f64;
    let mean = shares.iter().sum::<f64>() / n;
    let squares = shares.iter().map(|s| (s - mean).powi(2)).sum::<f64>();
    (mean, (squares / (n * (n - 1.0))).sqrt())
}

/// Black leaves intercept a fraction 1 - exp(-L / (2 cos)) of a beam. Three kinds of light fall on
/// the canopies:
///
/// - light straight down, from a spot 200 m above that covers a disc of 4 m radius (its rays lean
///   by up to a degree, which the exact value includes);
/// - uniform light from above, from a Lambertian square in the middle of a field so wide that light
///   that leaves it sideways has passed 8 m of canopy, which lets exp(-8) through;
/// - a uniform sky, by backward paths from a square below the canopy.
///
/// Seeds 0 to 63, 1000 to 1063 and 2000 to 2063, each a canopy with 15,000 photons or paths. The
/// standard errors come from the spread of the canopies and are at most 0.2 % of the exact value. 3
/// comparisons, odds of a false alarm 5e-4 (Student's t, 63 degrees of freedom).
#[test]
fn black_canopy() {
    let mut check = Comparisons::new("canopy", 0.002);
    let intercepts = |cos: f64| 1.0 - (-LEAF_AREA_INDEX / (2.0 * cos)).exp();

    let half_angle = (4.0f64 / 200.0).atan();
    let above = Cone::spot(DVec3::new(0.0, 0.0, 200.0), DVec3::NEG_Z, half_angle).unwrap();
    let above = LightSource::from(Lamp::new([1.0], above));
    let (mean, error) = intercepted(|i| caught(8.4, above.clone(), i));
    rounds_to(intercepts(1.0), 0.632_12, 1e-5);
    let edge = half_angle.cos();
    let exact = integral(edge, 1.0, 1, intercepts) / (1.0 - edge);
    check.add("straight down", mean, error, exact);

    let corner = |x: f64, y: f64| DVec3::new(x, y, 0.5 * HEIGHT + LEAF);
    let [a, b, c, d] = [corner(-2.0, -2.0), corner(-2.0, 2.0), corner(2.0, 2.0), corner(2.0, -2.0)];
    let square = Area::new(vec![[a, b, c], [a, c, d]], false).unwrap();
    let square = LightSource::from(Lamp::new([1.0], square));
    let (mean, error) = intercepted(|i| caught(20.0, square.clone(), 1000 + i));
    let exact = integral(0.0, 1.0, 20, |cos| 2.0 * cos * intercepts(cos));
    rounds_to(exact, 0.780_62, 1e-5);
    check.add("uniform light from above", mean, error, exact);

    // a sky of radiance 1 / pi, whose irradiance on an open horizontal plane is 1
    let map = Arc::new(RadianceMap::new(1, 0.0, vec![1.0, 0.0]));
    let part = InfinitePart::new(InfiniteShape::Map(map), vec![FRAC_1_PI]);
    let sky = LightSource::from(InfiniteLight::new("sky".into(), 1, vec![part]));
    let below = |[a, b, c]: [DVec3; 3]| [a, c, b].map(|p| p.with_z(-p.z));
    let captor = CaptorPart {
        id: "below".into(),
        kind: CaptorKind::Virtual { both_sides: false },
        triangles: [[a, b, c], [a, c, d]].map(below).into(),
        groups: Vec::new(),
        sensor: Sensor::default(),
    };
    let (mean, error) = intercepted(|i| {
        let result = run(20.0, sky.clone(), vec![captor.clone()], 2000 + i);
        1.0 - result.captors[0].front.irradiance[0]
    });
    check.add("sky", mean, error, exact);
    check.finish(3);
}
