//! Scenes that a program builds: what is refused, and how a fault during a run ends it.

use std::{
    f64::consts::PI,
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicUsize, Ordering},
        mpsc,
    },
    time::Duration,
};

use glam::DVec3;
use phylux::{
    Control, Error, ErrorKind, Estimator, RunResult, Scene, Settings,
    math::Transform,
    scene::{
        Area, Band, BandSum, CaptorKind, CaptorPart, Cone, Cover, CoverRow, Dielectric,
        IsotropicLine, Lambert, Lamp, Leaf, LeafFace, LightPart, LightSource, Material, Mirror,
        NamedMaterial, Pane, Phong, PhongFractions, SceneParts, SharedPart, SurfacePart, Tube,
    },
    simulate,
    transport::{PhotonCount, ThreadCount, TimeLimit, Tolerance, light_surfaces},
};

fn square(z: f64) -> Vec<[DVec3; 3]> {
    let corner = |x, y| DVec3::new(x, y, z);
    let [a, b, c, d] = [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
    vec![[a, b, c], [a, c, d]]
}

/// The names of the bands: three, a number that no type of lanes has.
const BANDS: [&str; 3] = ["blue", "red", "far red"];

/// The power of each light.
const POWER: [f64; 3] = [1.0, 2.0, 0.0];

/// Returns the parts of a scene with a floor and a sensor under one light of each kind.
fn parts() -> SceneParts {
    let band = |name: &str| Band { name: name.into(), from_nm: None, to_nm: None };
    let material = |name: &str, material| NamedMaterial { name: name.into(), material };
    let (from, to) = (DVec3::new(0.2, 0.2, 0.9), DVec3::new(0.8, 0.2, 0.9));
    let face = LeafFace { reflectance: &[0.05, 0.5, 1.0], transmittance: &[0.1, 0.5, 0.0] };
    let fractions = PhongFractions {
        reflectance: &[0.2, 0.4, 0.6],
        specular: &[0.3, 0.3, 0.3],
        transmittance: &[0.1, 0.1, 0.1],
    };
    SceneParts {
        name: "made".into(),
        bands: BANDS.map(band).into(),
        sums: vec![BandSum { name: "PAR".into(), bands: vec![0, 1], ..BandSum::default() }],
        materials: vec![
            material("soil", Material::Lambert(Lambert::new(&[0.1, 0.2, 0.3]).unwrap())),
            material("mirror", Material::Mirror(Mirror::new(&[0.9, 0.9, 1.0]).unwrap())),
            material(
                "glass",
                Material::Dielectric(Dielectric::new(1.5, &[1.0, 0.9, 0.8]).unwrap()),
            ),
            material("pane", Material::Pane(Pane::new(1.5, &[1.0, 0.9, 0.8]).unwrap())),
            material("leaf", Material::Leaf(Leaf::new(1.425, face, face, &BANDS).unwrap())),
            material("metal", Material::Phong(Phong::new(fractions, Some(20.0), &BANDS).unwrap())),
        ],
        objects: vec!["floor".into()],
        surfaces: vec![SurfacePart {
            object: Some(0),
            material: 0,
            captor: Some(0),
            triangles: square(0.0),
        }],
        lights: vec![
            LightPart::new("point", Lamp::new(POWER, Cone::point(from))),
            LightPart::new("spot", Lamp::new(POWER, Cone::spot(to, DVec3::NEG_Z, PI).unwrap())),
            LightPart::new("tube", Lamp::new(POWER, Tube::whole(from, to, 0.01).unwrap())),
            LightPart::new("line", Lamp::new(POWER, IsotropicLine::new(from, to).unwrap())),
            LightPart::new("area", Lamp::new(POWER, Area::new(square(1.0), true).unwrap())),
        ],
        captors: vec![
            CaptorPart {
                id: "floor".into(),
                kind: CaptorKind::Surface,
                triangles: vec![],
                groups: vec![0],
                sensor: Default::default(),
            },
            CaptorPart {
                id: "sensor".into(),
                kind: CaptorKind::Virtual { both_sides: true },
                triangles: square(0.5),
                groups: vec![0, 1],
                sensor: Default::default(),
            },
        ],
        groups: vec!["all".into(), "sensors".into()],
        ..SceneParts::default()
    }
}

fn run(scene: &Scene, settings: &Settings) -> RunResult {
    let control = Control::default();
    let simulation = simulate(scene, settings, &control).unwrap_or_else(|e| panic!("{e}"));
    RunResult::new(&simulation)
}

/// Lists with one value for each of three bands, which is no power of two, arrive complete.
#[test]
fn three_bands_need_three_values() {
    let scene = Scene::new(parts()).unwrap_or_else(|e| panic!("{e}"));
    for estimator in [Estimator::Photons, Estimator::Paths] {
        let settings =
            Settings { photons: PhotonCount::new(2000).ok(), estimator, ..Settings::default() };
        let result = run(&scene, &settings);
        let floor = &result.captors[0].front.flux;
        assert!(floor[0] > 0.0 && floor[1] > floor[0] && floor[2] == 0.0, "{floor:?}");
    }
}

/// A change that makes the parts invalid, and words of the message that refuses them.
type Spoiled = (fn(&mut SceneParts), &'static str);

fn material(parts: &mut SceneParts, material: Material) {
    parts.materials[0].material = material;
}

/// Returns the power of the point light.
fn power(parts: &mut SceneParts) -> &mut Vec<f64> {
    let LightSource::Lamp(lamp) = &mut parts.lights[0].source else { panic!("a lamp") };
    &mut lamp.power
}

/// Returns a shared copy whose only captor is the first of the scene, the floor.
fn copy_of_floor() -> SharedPart {
    let surface =
        SurfacePart { object: None, material: 0, captor: Some(0), triangles: square(0.3) };
    SharedPart {
        object: None,
        surfaces: vec![surface],
        transforms: vec![Transform::default()],
        first_captor: 0,
        captors: 1,
    }
}

const SPOILED: &[Spoiled] = &[
    (
        |p| p.shared.push(copy_of_floor()),
        "shared copies: captor `floor` is of a shared copy and of another surface; give each its own",
    ),
    (
        |p| {
            p.surfaces[0].captor = None;
            p.shared = vec![copy_of_floor(), copy_of_floor()];
        },
        "shared copies: captor `floor` is of a shared copy and of another surface",
    ),
    (|p| p.lights.clear(), "it has no light"),
    (|p| p.bands.clear(), "0 bands, must be 1 to 4096"),
    (|p| p.bands[1].name = "blue".into(), "a second band or sum named `blue`"),
    (|p| p.sums[0].name = "red".into(), "a second band or sum named `red`"),
    (|p| p.materials[1].name = "soil".into(), "a second material named `soil`"),
    (|p| p.lights[1].name = "point".into(), "a second light named `point`"),
    (|p| p.captors[1].id = "floor".into(), "a second captor named `floor`"),
    (|p| p.groups[1] = "all".into(), "a second group named `all`"),
    (
        |p| (p.bands[0].from_nm, p.bands[0].to_nm) = (Some(5.0), Some(5.0)),
        "band `blue`: from_nm = 5 is not below to_nm = 5; swap or correct them",
    ),
    (|p| p.bands[0].to_nm = Some(f64::NAN), "band `blue`: to_nm: NaN, must be at least 0"),
    (|p| p.sums[0].bands.clear(), "sum `PAR`: adds up no band"),
    (|p| p.sums[0].bands[1] = 3, "sum `PAR`: band 3 of 3"),
    (|p| p.sums[0].bands[1] = 0, "sum `PAR`: band 0 stands here twice"),
    (
        |p| material(p, Material::Lambert(Lambert::new(&[0.5]).unwrap())),
        "material `soil`: reflectance: 1 numbers for 3 bands; give one number, or one per band",
    ),
    (
        |p| material(p, Material::Dielectric(Dielectric::new(1.5, &[1.0; 4]).unwrap())),
        "material `soil`: tint: 4 numbers for 3 bands",
    ),
    (|p| *power(p) = vec![1.0], "light `point`: power: 1 numbers for 3 bands"),
    (|p| power(p)[2] = -1.0, "light `point`: power: -1, must be at least 0"),
    (|p| power(p)[2] = f64::INFINITY, "light `point`: power: inf, must be at least 0"),
    (|p| power(p)[2] = 1e300, "light `point`: emits 1e300 W or umol/s in a band"),
    (
        |p| p.lights[0].source = Lamp::new(POWER, Cone::point(DVec3::splat(f64::NAN))).into(),
        "a coordinate is not finite",
    ),
    (|p| p.surfaces[0].triangles[1][2].y = f64::INFINITY, "a coordinate is not finite"),
    (|p| p.surfaces[0].material = 6, "surface 0: material 6 of 6; indices count from 0"),
    (|p| p.surfaces[0].captor = Some(2), "surface 0: captor 2 of 2"),
    (|p| p.surfaces[0].captor = Some(1), "surface 0: captor `sensor` is virtual"),
    (|p| p.surfaces[0].object = Some(1), "surface 0: object 1 of 1"),
    (|p| p.captors[0].triangles = square(0.3), "captor `floor`: a surface captor with triangles"),
    (|p| p.captors[1].triangles.clear(), "captor `sensor` has no area"),
    (|p| p.captors[1].groups[0] = 2, "captor `sensor`: group 2 of 2"),
    (|p| p.captors[1].groups[0] = 1, "captor `sensor`: group 1 stands here twice"),
];

#[test]
fn parts_that_make_no_scene_are_refused() {
    for (spoil, said) in SPOILED {
        let mut parts = parts();
        spoil(&mut parts);
        match Scene::new(parts) {
            Ok(_) => panic!("accepted: {said}"),
            Err(error) => {
                let sentence = error.to_string();
                assert!(sentence.contains(said), "{sentence}\nshould say\n{said}");
                assert_eq!(error.kind(), ErrorKind::Input, "{sentence}");
            }
        }
    }
}

/// A material that does not conserve energy, or has other impossible values, is refused by the
/// constructor of its kind.
#[test]
fn impossible_materials_are_refused() {
    let leaf = |reflectance: &[f32], transmittance: &[f32], ior| {
        let good = LeafFace { reflectance: &[0.1; 3], transmittance: &[0.1; 3] };
        Leaf::new(ior, good, LeafFace { reflectance, transmittance }, &BANDS).err()
    };
    let phong = |fractions: [&[f32]; 3], exponent| {
        let [reflectance, specular, transmittance] = fractions;
        let fractions = PhongFractions { reflectance, specular, transmittance };
        Phong::new(fractions, Some(exponent), &BANDS).err()
    };
    let cover = |rows: &[(f64, f32)]| {
        let row = |&(angle_deg, direct)| CoverRow {
            angle_deg,
            direct: vec![direct; 3],
            diffuse: vec![0.5; 3],
            reflectance: vec![0.1; 3],
        };
        Cover::new(rows.iter().map(row).collect(), &BANDS).err()
    };
    for (refused, said) in [
        (
            Lambert::new(&[0.5, 1.5, 0.5]).err(),
            "reflectance: 1.5, must be from 0 to 1; 75 % is 0.75",
        ),
        (Lambert::new(&[0.5, f32::NAN, 0.5]).err(), "reflectance: NaN, must be from 0 to 1"),
        (Mirror::new(&[0.5, -0.5, 0.5]).err(), "reflectance: -0.5, must be from 0 to 1"),
        (Dielectric::new(0.5, &[1.0; 3]).err(), "ior = 0.5"),
        (
            Pane::new(f64::NAN, &[1.0; 3]).err(),
            "ior = NaN, must be from 1 to 1000; water has 1.33, glass 1.5",
        ),
        (Pane::new(1.5, &[2.0; 3]).err(), "tint: 2, must"),
        (
            leaf(&[0.6; 3], &[0.5; 3], 1.425),
            "back: reflectance + transmittance = 1.1000 in band `blue`, must be at most 1",
        ),
        (
            leaf(&[0.0; 3], &[0.99; 3], 1.425),
            "back: reflectance (of the cuticle alone) + transmittance = 1.0207 in band `blue`, must be at most 1",
        ),
        (leaf(&[-0.25; 3], &[0.5; 3], 1.0), "back: reflectance: -0.25, must be from"),
        (leaf(&[0.5; 3], &[1.25; 3], 1.0), "back: transmittance: 1.25, must be from"),
        (leaf(&[0.5; 3], &[0.5; 2], 1.4), "back: transmittance: 2 numbers for 3"),
        (leaf(&[0.5; 3], &[0.5; 3], 2000.0), "ior = 2000, must be from 1 to 1000"),
        (
            phong([&[0.5; 3], &[0.4; 3], &[0.2; 3]], 1.0),
            "reflectance + specular + transmittance = 1.1000 in band `blue`, must be at most 1; lower one of them",
        ),
        (phong([&[0.1; 3]; 3], -1.0), "exponent: -1, must be from 0 to 1000000000"),
        (phong([&[0.1; 3], &[0.1; 3], &[0.1]], 1.0), "transmittance: 1 numbers"),
        (cover(&[]), "a table without angles; give at least one"),
        (cover(&[(91.0, 0.1)]), "angles_deg: 91, must be from 0 to 90"),
        (cover(&[(40.0, 0.1), (20.0, 0.1)]), "angles_deg: an angle comes after one that is not"),
        (
            cover(&[(0.0, 0.1), (40.0, 0.5)]),
            "direct + diffuse + reflectance at 40 degrees = 1.1000 in band `blue`, must be at most",
        ),
    ] {
        let sentence = refused.expect(said).at("material").to_string();
        assert!(sentence.contains(said), "{sentence}\nshould say\n{said}");
    }
}

/// What could not shine is refused by the constructor of its kind.
#[test]
fn emitters_that_could_not_shine_are_refused() {
    let spot = |direction, half_angle| Cone::spot(DVec3::Z, direction, half_angle).err();
    let tube = |to, radius| Tube::whole(DVec3::Z, to, radius).err();
    for (refused, said) in [
        (
            spot(DVec3::ZERO, 1.0),
            "direction: a direction of length 0; say where the spot points: [0, 0, -1] is down",
        ),
        (spot(DVec3::NEG_Z, 0.0), "half angle: 0, must be above 0 and at most 180"),
        (spot(DVec3::NEG_Z, f64::NAN), "half angle: NaN, must be above 0"),
        (tube(DVec3::Z, 0.1), "a tube of length 0"),
        (IsotropicLine::new(DVec3::Z, DVec3::Z).err(), "a tube of length 0"),
        (tube(DVec3::ONE, -0.1), "radius: -0.1, must be at least"),
        (Tube::part(DVec3::Z, DVec3::ONE, 0.0, DVec3::X, 1.0).err(), "radius: 0, must be at least"),
        (
            Tube::part(DVec3::ZERO, DVec3::Z, 0.1, DVec3::Z, 1.0).err(),
            "toward: has no part across the tube",
        ),
        (
            Area::new(vec![[DVec3::ZERO; 3]], false).err(),
            "an area light without area; its corners must not lie on one line",
        ),
    ] {
        let sentence = refused.expect(said).at("lamp").to_string();
        assert!(sentence.contains(said), "{sentence}\nshould say\n{said}");
    }
}

/// Asserts that `work` ends with an error if the progress callback panics when it is called for the
/// `nth` time. Fails if `work` does not end within a time that
/// only a hang takes.
fn broken_off(threads: usize, nth: usize, work: fn(&Scene, &Settings, &Control) -> Option<Error>) {
    let scene = Arc::new(Scene::new(parts()).unwrap_or_else(|e| panic!("{e}")));
    let (tell, told) = mpsc::channel();
    std::thread::spawn(move || {
        let calls = AtomicUsize::new(0);
        let progress = |_| {
            assert!(calls.fetch_add(1, Ordering::Relaxed) + 1 != nth, "the callback is at fault");
        };
        let control = Control { stop: &AtomicBool::new(false), progress: &progress };
        let settings = Settings {
            photons: PhotonCount::new(300_000).ok(),
            threads: ThreadCount::nearest_to(threads),
            ..Settings::default()
        };
        // the receiver exists unless the test has failed already
        let _ = tell.send(work(&scene, &settings, &control));
    });
    let error = told.recv_timeout(Duration::from_secs(900)).expect("it panics, or never ends");
    let error = error.expect("the run went on");
    assert_eq!(error.kind(), ErrorKind::Run);
    assert!(error.to_string().contains("(the callback is at fault)"), "{error}");
}

/// A panic in any thread ends a run with an error: the other threads do not wait for the part of
/// the one that is at fault.
#[test]
fn a_panic_ends_a_run_with_an_error() {
    for threads in [1, 2] {
        for nth in [1, 40] {
            broken_off(threads, nth, |scene, settings, control| {
                simulate(scene, settings, control).err()
            });
            broken_off(threads, nth, |scene, settings, control| {
                let estimator = Estimator::Paths;
                simulate(scene, &Settings { estimator, ..settings.clone() }, control).err()
            });
            broken_off(threads, nth, |scene, settings, control| {
                let tolerance = Tolerance::new(1e-3).ok();
                simulate(scene, &Settings { tolerance, ..settings.clone() }, control).err()
            });
            broken_off(threads, nth, |scene, settings, control| {
                let max_time = TimeLimit::new(3600.0).ok();
                simulate(scene, &Settings { max_time, ..settings.clone() }, control).err()
            });
            broken_off(threads, nth, |scene, settings, control| {
                light_surfaces(scene, settings, control).err()
            });
        }
    }
}
