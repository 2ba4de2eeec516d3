//! Measured lamps: closed forms of their intensities, by photons and by paths.

use std::f64::consts::PI;

use phylux::RunResult;
use serde_json::{Value, json};

use crate::{
    bad_input::{phylux, refused},
    common::{TestScene, front, shared},
    exact::{Comparisons, mean_over},
};

/// Writes an IES file with these angles (degrees) and the intensities of `candela`, in cd.
pub fn ies(c: &[f64], v: &[f64], candela: impl Fn(f64, f64) -> f64) -> String {
    let list = |values: &[f64]| values.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
    let rows = c.iter().map(|&c| list(&v.iter().map(|&v| candela(c, v)).collect::<Vec<_>>()));
    let rows: Vec<String> = rows.collect();
    format!(
        "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 {} {} 1 2 0 0 0\n1 1 50\n{}\n{}\n{}\n",
        v.len(),
        c.len(),
        list(v),
        list(c),
        rows.join("\n")
    )
}

/// A rectangle near the origin: its name, its corner and sides, and its normal towards the lamp.
/// The planes through the lamp in which intensities have kinks cut the rectangles at quarters of
/// their sides, where the pieces of the quadrature meet.
type Rectangle = (&'static str, [[f64; 3]; 3], [f64; 3]);

const AROUND: [Rectangle; 4] = [
    ("below", [[-0.6, -0.6, -1.0], [1.2, 0.0, 0.0], [0.0, 1.2, 0.0]], [0.0, 0.0, 1.0]),
    ("east", [[1.0, -0.6, -0.9], [0.0, 0.0, 1.2], [0.0, 1.2, 0.0]], [-1.0, 0.0, 0.0]),
    ("north", [[-0.6, 1.2, -0.9], [1.2, 0.0, 0.0], [0.0, 0.0, 1.2]], [0.0, -1.0, 0.0]),
    ("above", [[-0.6, -0.6, 0.9], [0.0, 1.2, 0.0], [1.2, 0.0, 0.0]], [0.0, 0.0, -1.0]),
];

/// Writes a scene with these rectangles as virtual captors, so that none is an obstacle.
fn around(light: &Value, files: &[(&str, &str)]) -> TestScene {
    let captors =
        AROUND.iter().map(|(name, _, _)| json!({ "name": name, "obj": format!("{name}.obj") }));
    let materials = json!({ "black": { "type": "lambert", "reflectance": 0 } });
    let scene = json!({ "materials": materials, "lights": [light], "captors": captors.collect::<Vec<_>>() });
    let objs = AROUND.iter().map(|(name, [p, u, v], _)| {
        let at = |s: f64, t: f64| {
            let [x, y, z] = [0, 1, 2].map(|i| p[i] + s * u[i] + t * v[i]);
            format!("v {x} {y} {z}\n")
        };
        let corners = [at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)].concat();
        (format!("{name}.obj"), corners + "f 1 2 3 4\n")
    });
    let objs: Vec<(String, String)> = objs.collect();
    let all: Vec<(&str, &str)> =
        objs.iter().map(|(a, b)| (a.as_str(), b.as_str())).chain(files.iter().copied()).collect();
    TestScene::new(&scene.to_string(), &all)
}

/// Runs the scene by photons and by paths.
fn both(scene: &TestScene, seed: u64) -> [(&'static str, RunResult); 2] {
    [("photons", scene.run(3_000_000, seed)), ("paths", scene.run_paths(300_000, seed))]
}

/// Compares the irradiance of the rectangles with that of a point light at the origin. `intensity`
/// gives the light's intensity (W/sr) for the cosine to straight down, and the angle about the
/// vertical from +x through +y.
fn compare(
    check: &mut Comparisons,
    what: &str,
    light: &Value,
    files: &[(&str, &str)],
    intensity: impl Fn(f64, f64) -> f64,
) {
    let scene = around(light, files);
    for (estimator, run) in both(&scene, 1) {
        for (name, [corner, u, v], normal) in AROUND {
            let exact = mean_over(corner, u, v, |p| {
                let d2: f64 = p.iter().map(|x| x * x).sum();
                let cos = -p.iter().zip(normal).map(|(a, b)| a * b).sum::<f64>() / d2.sqrt();
                intensity(-p[2] / d2.sqrt(), p[1].atan2(p[0])) * cos / d2
            });
            let what = format!("{what}, {name}, {estimator}");
            if exact == 0.0 {
                assert_eq!(front(&run, name).flux[0], 0.0, "{what}");
                continue;
            }
            check.irradiance(what, front(&run, name), 0, exact);
        }
    }
}

/// Point lights: an isotropic file is the same as a `point`; then a file with steps in C and V, the
/// file's own power, a turned lamp, and a cosine lobe. C = 0 is +x, C = 90 is +y, V = 0 is down.
///
/// Seed 1, 3e6 photons or 3e5 paths; standard errors at most 0.6 % of the exact value, which
/// quadrature knows to 0.05 % (because of kinks). 38 comparisons, odds of a false alarm 4e-3.
#[test]
fn points_have_their_intensity() {
    let mut check = Comparisons::new("photometry of points", 0.006).rounding(5e-4);
    let point =
        json!({ "type": "point", "position": [0, 0, 0], "power": 8, "photometry": "a.ies" });
    let with = |key: &str, value: Value| {
        let mut light = point.clone();
        light[key] = value;
        light
    };
    let isotropic = ies(&[0.0], &[0.0, 180.0], |_, _| 7.0);
    compare(&mut check, "isotropic", &point, &[("a.ies", &isotropic)], |_, _| 8.0 / (4.0 * PI));

    // I = 100 + 100 |C| / 180 below the horizon; above, it falls linearly to 0 at the zenith
    let wedge = ies(&[0.0, 180.0], &[0.0, 90.0, 180.0], |c, v| {
        if v < 180.0 { 100.0 + 100.0 * c / 180.0 } else { 0.0 }
    });
    // above the horizon the integral of (1 - (V - 90) / 90) sin V is 2 / pi
    let flux = 2.0 * PI * 150.0 * (1.0 + 2.0 / PI);
    let of_wedge = |cos: f64, turn: f64| {
        let above = if cos < 0.0 { 2.0 - cos.acos() / (0.5 * PI) } else { 1.0 };
        (100.0 + 100.0 * turn.abs() / PI) * above
    };
    let files: &[(&str, &str)] = &[("a.ies", &wedge)];
    compare(&mut check, "wedge", &point, files, |cos, turn| of_wedge(cos, turn) * 8.0 / flux);
    let mut of_file = with("power", json!("file"));
    of_file["lm_per_W"] = json!(1);
    compare(&mut check, "wedge's power", &of_file, files, of_wedge);
    // C = 0 turned to the north
    let turned = with("zero_plane", json!([0, 3, 1]));
    compare(&mut check, "turned", &turned, files, |cos, turn| {
        of_wedge(cos, (turn - 0.5 * PI).sin().atan2((turn - 0.5 * PI).cos())) * 8.0 / flux
    });
    let lobe = json!({ "type": "point", "position": [0, 0, 0], "power": 8, "cosine": 3.5 });
    compare(&mut check, "lobe", &lobe, &[], |cos, _| {
        8.0 * 4.5 / (2.0 * PI) * cos.max(0.0).powf(3.5)
    });
    check.finish(38);
}

/// Area lights: one with a Lambertian file is the same as an `area` without a file; one with an
/// isotropic file also lights what is behind it. Both are compared with I cos / d2, averaged over
/// the points of a tilted square.
///
/// Seed 1, 3e6 photons or 3e5 paths; standard errors at most 0.6 % of the exact value, which
/// quadrature knows to 0.1 %. 14 comparisons, odds of a false alarm 2e-3.
#[test]
fn areas_have_their_intensity() {
    let mut check = Comparisons::new("photometry of areas", 0.006).rounding(1e-3);
    let v: Vec<f64> = (0..=90).map(f64::from).collect();
    let cosine = ies(&[0.0], &v, |_, v| if v < 90.0 { v.to_radians().cos() } else { 0.0 });
    let isotropic = ies(&[0.0], &[0.0, 180.0], |_, _| 1.0);
    let corners =
        json!([[-0.1, -0.1, -0.05], [-0.1, 0.1, -0.05], [0.1, 0.1, 0.05], [0.1, -0.1, 0.05]]);
    let area = json!({ "type": "area", "vertices": corners, "power": 8, "photometry": "a.ies" });
    // the mean over all points of the lamp
    let over = |p: [f64; 3], normal: [f64; 3], intensity: &dyn Fn([f64; 3]) -> f64| {
        let at = |i: usize| (i as f64 + 0.5) / 40.0 - 0.1;
        let shine = |i: usize| {
            let (x, y) = (at(i / 8), at(i % 8));
            let d = [p[0] - x, p[1] - y, p[2] - 0.5 * x];
            let d2: f64 = d.iter().map(|x| x * x).sum();
            let cos = -d.iter().zip(normal).map(|(a, b)| a * b).sum::<f64>() / d2.sqrt();
            intensity(d.map(|x| x / d2.sqrt())) * cos.max(0.0) / d2
        };
        (0..64).map(shine).sum::<f64>() / 64.0
    };
    // the corners go counter-clockwise seen from below
    let normal = [0.5 / 1.25f64.sqrt(), 0.0, -1.0 / 1.25f64.sqrt()];
    let mut down = area.clone();
    down["aim"] = json!([0, 0, -1]);
    let lambert =
        |d: [f64; 3]| 8.0 / PI * d.iter().zip(normal).map(|(a, b)| a * b).sum::<f64>().max(0.0);
    let even = |_: [f64; 3]| 8.0 / (4.0 * PI);
    type Case<'a> = (&'a str, &'a Value, &'a str, &'a dyn Fn([f64; 3]) -> f64);
    let cases: [Case; 2] =
        [("Lambertian", &area, &cosine, &lambert), ("both ways", &down, &isotropic, &even)];
    for (what, light, file, intensity) in cases {
        let scene = around(light, &[("a.ies", file)]);
        for (estimator, run) in both(&scene, 1) {
            for (name, [corner, u, v], towards) in AROUND {
                let exact = mean_over(corner, u, v, |p| over(p, towards, intensity));
                let what = format!("{what}, {name}, {estimator}");
                match exact {
                    0.0 => assert_eq!(front(&run, name).flux[0], 0.0, "{what}"),
                    _ => check.irradiance(what, front(&run, name), 0, exact),
                }
            }
        }
    }
    check.finish(14);
}

/// A tube that emits from 100 degrees of its circumference, as a light only and also as an obstacle
/// of 64 sides. The exact value is the integral of its radiance over the part of its surface that a
/// captor sees.
///
/// Seed 1, 3e6 photons or 3e5 paths; standard errors at most 0.6 % of the exact value; 0.3 % is
/// allowed for quadrature and for the flat sides. 16 comparisons, odds of a false alarm 2e-3.
#[test]
fn tubes_shine_within_their_aperture() {
    const RADIUS: f64 = 0.05;
    let opening = 100f64.to_radians();
    let middle = (-0.6f64).atan2(0.8);
    let bare = json!({ "type": "tube", "from": [-0.3, 0, 0], "to": [0.3, 0, 0], "radius": RADIUS, "power": 8,
                       "toward": [5, 0.8, -0.6], "opening_deg": 100 });
    let mut solid = bare.clone();
    solid["material"] = json!("black");
    let radiance = 8.0 / (PI * opening * RADIUS * 0.6);
    let irradiance = |p: [f64; 3], normal: [f64; 3]| {
        let part = |i: usize| {
            let x = 0.6 * ((i / 20) as f64 + 0.5) / 20.0 - 0.3;
            let turn = middle + opening * (((i % 20) as f64 + 0.5) / 20.0 - 0.5);
            let out = [0.0, turn.cos(), turn.sin()];
            let d = [0, 1, 2].map(|k| p[k] - RADIUS * out[k] - if k == 0 { x } else { 0.0 });
            let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let (there, here) = (dot(d, out).max(0.0), (-dot(d, normal)).max(0.0));
            there * here / dot(d, d).powi(2)
        };
        radiance * opening * RADIUS * 0.6 * (0..400).map(part).sum::<f64>() / 400.0
    };
    let mut check = Comparisons::new("apertures", 0.006).rounding(3e-3);
    for (what, light) in [("light", bare), ("obstacle", solid)] {
        let scene = around(&light, &[]);
        for (estimator, run) in both(&scene, 1) {
            for (name, [corner, u, v], normal) in AROUND {
                let exact = mean_over(corner, u, v, |p| irradiance(p, normal));
                let what = format!("{what}, {name}, {estimator}");
                check.irradiance(what, front(&run, name), 0, exact);
            }
        }
    }
    check.finish(16);
}

/// An independently computed luminaire above a floor. The given values are irradiances at points,
/// and the formula in this test reproduces them to 1e-6. The captors are discs, and are compared
/// with the mean of this formula over each disc, within 4 standard errors plus 2e-5 of the value.
///
/// Seed 1, 4e6 photons on discs with a radius of 10 cm, and 2e5 paths on discs with a radius of 2
/// cm; 49 comparisons each, odds of a false alarm 6e-3.
#[test]
#[ignore = "needs PHYLUX_SHARED"]
fn needs_shared_luminaire_over_a_floor() {
    let folder = shared().join("truth/ies");
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).expect("a file");
    let truth: Value = serde_json::from_str(&read("truth.json")).expect("JSON");
    let values = truth["values"].as_array().expect("values");
    // ten numbers and three more, then 19 angles, one plane, and its intensities
    let file = read("symmetric.ies");
    let numbers = file.split("TILT=NONE").nth(1).expect("numbers").split_whitespace();
    let numbers: Vec<f64> = numbers.map(|word| word.parse().expect("a number")).collect();
    let (angles, candela) = (&numbers[13..32], &numbers[33..52]);
    let on_floor = |x: f64, y: f64| {
        let d2 = x * x + y * y + 9.0;
        let cos = 3.0 / d2.sqrt();
        let angle = cos.acos().to_degrees();
        let i = angles.partition_point(|v| *v <= angle).clamp(1, 18);
        let share = (angle - angles[i - 1]) / (angles[i] - angles[i - 1]);
        (candela[i - 1] + share * (candela[i] - candela[i - 1])) * cos / d2
    };
    let over_disc = |[x, y]: [f64; 2], radius: f64| {
        const POINTS: usize = 20_000;
        let at = |k: usize| {
            let r = radius * ((k as f64 + 0.5) / POINTS as f64).sqrt();
            let (sin, cos) = (k as f64 * PI * (3.0 - 5f64.sqrt())).sin_cos();
            on_floor(x + r * cos, y + r * sin)
        };
        (0..POINTS).map(at).sum::<f64>() / POINTS as f64
    };
    let run = |radius: f64| {
        let captor = |value: &Value| {
            json!({ "name": value["id"], "disc": {
                "center": value["center"], "normal": value["normal"], "radius": radius } })
        };
        let scene = json!({
            "captors": values.iter().map(captor).collect::<Vec<_>>(),
            "lights": [{ "type": "point", "position": [0, 0, 0], "power": "file", "lm_per_W": 1,
                         "photometry": folder.join("symmetric.ies") }]
        });
        TestScene::new(&scene.to_string(), &[])
    };
    let (photons, paths) = (run(0.1).run(4_000_000, 1), run(0.02).run_paths(200_000, 1));
    let mut wrong = Vec::new();
    for (estimator, run, radius) in [("photons", photons, 0.1), ("paths", paths, 0.02)] {
        let flux = truth["total_flux"].as_f64().expect("a flux");
        assert!((run.energy.power[0] / flux - 1.0).abs() < 1e-6, "{}", run.energy.power[0]);
        for value in values {
            let id = value["id"].as_str().expect("an id");
            let number = |value: &Value| value.as_f64().expect("a number");
            let at = [&value["center"][0], &value["center"][1]].map(number);
            let point = number(&value["irradiance"]);
            assert!((on_floor(at[0], at[1]) / point - 1.0).abs() < 1e-6, "{id}");
            let exact = over_disc(at, radius);
            let face = front(&run, id);
            let se = face.irradiance_se[0].expect("photons came");
            let off = face.irradiance[0] - exact;
            if off.abs() > 4.0 * se + 2e-5 * exact {
                wrong.push(format!(
                    "{estimator} {id}: {} {exact}, z {:.2}",
                    face.irradiance[0],
                    off / se
                ));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The distribution of an area turns with its copies: two copies that are turned to either side are
/// two lights, each with half of the power, and are those of two lights without copies.
#[test]
fn distributions_turn_with_their_copies() {
    let beam =
        ies(&[0.0, 180.0], &[0.0, 10.0, 40.0, 90.0], |c, v| if v < 40.0 { 100.0 + c } else { 0.0 });
    let bar = "v -0.1 -0.1 0\nv -0.1 0.1 0\nv 0.1 0.1 0\nv 0.1 -0.1 0\nf 1 2 3 4\n";
    let copies = json!([{ "translate": [-0.3, 0, 2], "rotate_deg": [0, 40, 30] },
                        { "translate": [0.3, 0, 2], "rotate_deg": [0, -40, 0] }]);
    let light = |power: f64| json!({ "type": "area", "obj": "bar.obj", "photometry": "a.ies", "power": power });
    let loaded = |lights: Value| {
        let scene = json!({ "lights": lights });
        let scene =
            TestScene::new(&scene.to_string(), &[("a.ies", beam.as_str()), ("bar.obj", bar)]);
        phylux::load(&scene.path("scene.json")).expect("a scene").scene
    };
    let mut together = light(100.0);
    together["name"] = json!("bars");
    together["instances"] = copies.clone();
    let mut apart = [light(50.0), light(50.0)];
    for (light, copy) in apart.iter_mut().zip(copies.as_array().expect("copies")) {
        light["transform"] = copy.clone();
    }
    let [together, apart] = [loaded(json!([together])), loaded(json!(apart))];
    assert_eq!(together.lights().len(), 2);
    assert_eq!([&together.lights()[0].name, &together.lights()[1].name], ["bars#0", "bars#1"]);
    for (a, b) in together.lights().iter().zip(apart.lights()) {
        assert!((a.power[0] - b.power[0]).abs() < 1e-9, "{:?} {:?}", a.power, b.power);
        let [a, b] = [a, b].map(|light| *light.intensity().expect("measured").axes());
        assert!(a.normal.distance(b.normal) < 1e-6 && a.tangent.distance(b.tangent) < 1e-6);
    }
    let axes = |light: Value| *loaded(json!([light])).lights()[0].intensity().expect("one").axes();
    // C = 0 turns by half a circle, with `aim` and without
    let mut half = light(1.0);
    half["transform"] = json!({ "rotate_deg": [0, 0, 180] });
    assert!(axes(half.clone()).tangent.distance(-glam::Vec3::X) < 1e-6);
    half["aim"] = json!([0, 1, 0]);
    assert!(axes(half).normal.distance(-glam::Vec3::Y) < 1e-6);
}

#[test]
fn bad_luminaires_are_told() {
    let isotropic = ies(&[0.0], &[0.0, 180.0], |_, _| 1.0);
    let point = r#""type": "point", "position": [0, 0, 0]"#;
    let area = r#""type": "area", "vertices": [[0, 0, 1], [0, 1, 1], [1, 1, 1], [1, 0, 1]]"#;
    let cube = r#""type": "area", "obj": "sheet.obj", "power": 1"#;
    let lamp = r#""photometry": "a.ies""#;
    let tube = r#""type": "tube", "from": [0, 0, 0], "to": [1, 0, 0], "radius": 0.1, "power": 1"#;
    for (light, words) in [
        (format!(r#"{point}, {lamp}"#), "missing key `power`"),
        (format!(r#"{point}, "power": "file""#), "/lights/0/power: \"file\" without `photometry`"),
        (format!(r#"{point}, "power": "much""#), "\"file\""),
        (format!(r#"{point}, "power": "file", {lamp}"#), "lumens are no W; say with `lm_per_W`"),
        (
            format!(r#"{point}, "power": "file", {lamp}, "lm_per_umol": 70"#),
            "/lm_per_umol: the scene counts in W",
        ),
        (format!(r#"{point}, "power": "file", {lamp}, "lm_per_W": 0"#), "0, must be above 0"),
        (format!(r#"{point}, "power": 1, {lamp}, "lm_per_W": 9"#), "/lm_per_W: goes with"),
        (format!(r#"{point}, "power": 1, {lamp}, "set": 2"#), "lamp set 2, but a.ies has 1"),
        (format!(r#"{point}, "power": 1, "set": 1"#), "/set: goes with `photometry` only"),
        (format!(r#"{point}, "power": 1, "photometry": "b.ies""#), "there is no such file"),
        (format!(r#"{point}, "power": 1, "photometry": "bad.ies""#), "bad.ies:3: "),
        (format!(r#"{point}, "power": 1, "aim": [0, 0, 1]"#), "/lights/0/aim: goes with"),
        (
            format!(r#"{point}, "power": 1, "cosine": 1, "zero_plane": [1, 0, 0]"#),
            "/zero_plane: goes",
        ),
        (format!(r#"{point}, "power": 1, {lamp}, "cosine": 1"#), "both `photometry` and `cosine`"),
        (
            format!(r#"{point}, "power": 1, {lamp}, "zero_plane": [0, 0, 2]"#),
            "no part across `aim`",
        ),
        (format!(r#"{point}, "power": 1, {lamp}, "aim": [0, 0, 0]"#), "a direction of length 0"),
        (format!(r#"{point}, "power": 1, "cosine": -1"#), "cosine: -1, must be from 0"),
        (format!(r#"{area}, "power": 1, {lamp}, "two_sided": true"#), "/two_sided: does not go"),
        (format!(r#"{area}, "radiance": 1, {lamp}"#), "/radiance: does not go with `photometry`"),
        (format!(r#"{area}, "power": 1, "aim": [0, 0, 1]"#), "/aim: goes with `photometry` only"),
        (format!(r#"{cube}, {lamp}"#), "normals of its triangles cancel"),
        (format!(r#"{tube}, "toward": [0, 0, 1]"#), "/toward: without `opening_deg`"),
        (format!(r#"{tube}, "opening_deg": 10"#), "/opening_deg: without `toward`"),
        (format!(r#"{tube}, "toward": [1, 0, 0], "opening_deg": 10"#), "no part across the tube"),
        (format!(r#"{tube}, "toward": [0, 0, 1], "opening_deg": 400"#), "400, must be above 0"),
    ] {
        let scene = format!(
            r#"{{"lights": [{{{light}}}],
                "captors": [{{"name": "s", "disc": {{"center": [0, 0, -1], "normal": [0, 0, 1], "radius": 1}}}}]}}"#
        );
        let sheet = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 3 2\n";
        let files = [
            ("a.ies", isotropic.as_str()),
            ("bad.ies", "IES\nTILT=NONE\nx\n"),
            ("sheet.obj", sheet),
        ];
        let folder = TestScene::new(&scene, &files);
        refused(&folder.path(""), &["run", "scene.json"], &[words]);
    }
    // one number in the file, but two bands
    let scene = r#"{"bands": [{"name": "a"}, {"name": "b"}], "lights": [{"type": "point", "position": [0, 0, 0],
        "power": "file", "photometry": "a.ies"}]}"#;
    let folder = TestScene::new(scene, &[("a.ies", &isotropic)]);
    refused(&folder.path(""), &["check", "scene.json"], &["\"file\" for 2 bands"]);
}

/// `check` draws the intensity of each kind of lamp once and says where its planes lie. Runs tell
/// the lights apart nevertheless.
#[test]
fn check_draws_the_distribution() {
    let beam = ies(&[0.0, 90.0], &[0.0, 45.0, 90.0], |c, v| if c < 90.0 { v } else { 90.0 - v });
    let lamp = |name: &str, x: f64| json!({ "type": "point", "name": name, "position": [x, 0, 2], "power": 1, "photometry": "a.ies" });
    let scene = json!({ "lights": [lamp("a", 0.0), lamp("b", 1.0)], "captors": [
        { "name": "s", "disc": { "center": [0, 0, 0], "normal": [0, 0, 1], "radius": 1 } }] });
    let folder = TestScene::new(&scene.to_string(), &[("a.ies", &beam)]);
    let output = phylux(&folder.path(""), &["check", "scene.json"]);
    let text = String::from_utf8_lossy(&output.stdout);
    for words in [
        "intensity of `a` and 1 more light: it aims (V = 0, below) along (0, 0, -1)",
        "* C = 0 along (1, 0, 0), to the right",
        "o C = 90 along (0, 1, 0), to the right",
    ] {
        assert!(text.contains(words), "{words}: {text}");
    }
    // C = 0 is brightest at the horizon, and C = 90 straight down
    let drawing: Vec<&str> =
        text.lines().skip_while(|line| !line.starts_with("  o C")).skip(1).collect();
    let middle = drawing.iter().position(|line| line.contains('+')).expect("the lamp");
    assert!(drawing[middle].ends_with('*') && drawing[middle].len() > 45, "{text}");
    assert!(drawing[middle + 12].trim().trim_matches('o').is_empty(), "{text}");
    let arguments = ["run", "scene.json", "--photons", "1e4", "--by-light"];
    let output = phylux(&folder.path(""), &arguments);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Returns a file of TM-33: a flat spectrum from 380 to 780 nm, and the same photon intensity,
/// 10 umol/s/sr, on all sides.
fn tm33(more: &str) -> String {
    let rows = ["0", "90", "180"].map(|v| format!("<IntData h='0' v='{v}'>10</IntData>"));
    format!(
        "<IESTM33><Emitter><PhotonData><MinWavelength>400</MinWavelength><MaxWavelength>700</MaxWavelength>\
         <PhotonIntensity>{}{more}</PhotonIntensity></PhotonData><SpectralData><EmitterSpectral><PwrData w='380'>3\
         </PwrData><PwrData w='780'>3</PwrData></EmitterSpectral></SpectralData></Emitter></IESTM33>",
        rows.concat()
    )
}

const TM27: &str = "<IESTM2714><SpectralDistribution><SpectralQuantity>reflectance</SpectralQuantity>\
    <SpectralData wavelength='380'>0.1</SpectralData><SpectralData wavelength='780'>0.1</SpectralData>\
    </SpectralDistribution></IESTM2714>";

/// A TM-33 alone says the flux of each band: photons per nm of a flat spectrum grow with the
/// wavelength, and there are 40 pi umol/s of them from 400 to 700 nm. Limits: rounding.
#[test]
fn a_tm33_says_the_flux_of_each_band() {
    let scene = |quantity: &str, bands: Value, power: Value| {
        let light = json!({ "type": "point", "position": [0, 0, 0], "photometry": "a.xml", "power": power });
        let captor = json!({ "name": "s", "disc": { "center": [0, 0, 1], "normal": [0, 0, -1], "radius": 0.1 } });
        let scene =
            json!({ "quantity": quantity, "bands": bands, "lights": [light], "captors": [captor] });
        TestScene::new(&scene.to_string(), &[("a.xml", &tm33(""))])
    };
    let blue = json!({ "name": "blue", "from_nm": 400, "to_nm": 500 });
    let red = json!({ "name": "red", "from_nm": 600, "to_nm": 700 });
    let both = json!([blue, red]);
    let of_file = json!({ "spectrum": "a.xml", "total": "file" });
    let power = |folder: &TestScene| {
        let loaded = phylux::load(&folder.path("scene.json")).unwrap_or_else(|e| panic!("{e}"));
        loaded.scene.lights()[0].power.to_vec()
    };
    let flux = 40.0 * PI;
    let close = |found: &[f64], expected: &[f64]| {
        assert_eq!(found.len(), expected.len());
        for (a, b) in found.iter().zip(expected) {
            assert!((a / b - 1.0).abs() < 1e-9, "{found:?} {expected:?}");
        }
    };
    let photons = scene("umol/s", both.clone(), of_file.clone());
    close(&power(&photons), &[flux * 9.0 / 33.0, flux * 13.0 / 33.0]);
    // 1 J of light of 1 nm has 1 / (N_A h c) = 8.3594e-3 umol
    let energy = scene("W", both.clone(), of_file.clone());
    let watts = power(&energy);
    assert!((watts[0] / watts[1] - 1.0).abs() < 1e-9, "{watts:?}");
    assert!((watts[0] / (flux * 119.6266 * 200.0 / 330_000.0) - 1.0).abs() < 1e-5, "{watts:?}");
    let par = json!([{ "name": "PAR", "from_nm": 400, "to_nm": 700 }]);
    close(&power(&scene("umol/s", par.clone(), json!("file"))), &[flux]);
    // the irradiance below follows from the intensity: 10 over the square of the distance
    let found = scene("umol/s", par.clone(), json!("file")).run(200_000, 1);
    let front = front(&found, "s");
    let (value, se) = (front.irradiance[0], front.irradiance_se[0].expect("an error"));
    let of_disc = 20.0 * PI * (1.0 - 1.0 / 1.01_f64.sqrt()) / (PI * 0.01);
    assert!((value - of_disc).abs() < 5.0 * se, "{value} {of_disc} {se}");

    let check = |folder: TestScene, words: &[&str]| {
        refused(&folder.path(""), &["check", "scene.json"], words);
    };
    check(scene("W", par.clone(), json!("file")), &["a.xml states", "count the scene in umol/s"]);
    check(scene("umol/s", both, json!("file")), &["\"file\" for 2 bands"]);
    check(
        scene("umol/s", json!([blue]), json!("file")),
        &["a.xml counts from 400 to 700 nm, band `blue` from 400 to 500"],
    );
    for (key, value) in [("quantity", json!("lm")), ("from_nm", json!(400)), ("to_nm", json!(700))]
    {
        let mut power = of_file.clone();
        power[key] = value;
        let words =
            format!("/power/{key}: the file states its flux in umol/s itself; leave it out");
        check(scene("umol/s", par.clone(), power), &[&words]);
    }
    let unit = json!({ "spectrum": "a.xml", "total": 1, "unit": "photons" });
    check(scene("umol/s", par, unit), &["/power/unit: a.xml says itself that it counts energy"]);
}

/// A luminaire of two emitters is two lights, each with the flux, the intensity and the spectrum of
/// its own.
#[test]
fn a_light_is_one_emitter_of_a_tm33() {
    let emitter = |text: &str| {
        let (begin, end) = (text.find("<Emitter>"), text.find("</IESTM33"));
        text[begin.expect("an emitter")..end.expect("an end")].to_string()
    };
    // nothing below 600 nm
    let rising = "<PwrData w='380'>0</PwrData><PwrData w='599.999'>0</PwrData><PwrData w='600'>";
    let red = tm33("<Multiplier>3</Multiplier>").replace("<PwrData w='380'>", rising);
    let both = tm33("").replace("</IESTM33>", &format!("{}</IESTM33>", emitter(&red)));
    let scene = |more: [Value; 2]| {
        let lights = more.map(|more| {
            let mut light =
                json!({ "type": "point", "position": [0, 0, 0], "photometry": "a.xml" });
            light.as_object_mut().expect("keys").extend(more.as_object().expect("keys").clone());
            light
        });
        let bands = json!([{ "name": "green", "from_nm": 500, "to_nm": 600 },
                           { "name": "red", "from_nm": 600, "to_nm": 700 }]);
        let scene = json!({ "quantity": "umol/s", "bands": bands, "lights": lights });
        TestScene::new(&scene.to_string(), &[("a.xml", &both)])
    };
    let of = |column: u32| json!({ "spectrum": "a.xml", "column": column, "total": "file" });
    let folder = scene([json!({ "power": of(2), "set": 1 }), json!({ "power": of(3), "set": 2 })]);
    let loaded = phylux::load(&folder.path("scene.json")).unwrap_or_else(|e| panic!("{e}"));
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    // 40 pi umol/s from 400 to 700 nm, with a flat spectrum in W/nm; and three times that, of which
    // all is red
    let flux = 40.0 * PI;
    let found = loaded.scene.lights().iter().flat_map(|light| light.power.to_vec());
    for (found, right) in found.zip([flux * 11.0 / 33.0, flux * 13.0 / 33.0, 0.0, 3.0 * flux]) {
        assert!((found - right).abs() < 1e-4 * flux, "{found} {right}");
    }
    // the spectrum of one and the intensities of the other are told
    let first = json!({ "spectrum": "a.xml", "total": "file" });
    let folder = scene([json!({ "power": first, "set": 1 }), json!({ "power": first, "set": 2 })]);
    let loaded = phylux::load(&folder.path("scene.json")).unwrap_or_else(|e| panic!("{e}"));
    for words in [
        "/lights/1/power: the intensities are those of emitter 2",
        "a.xml: holds 2 spectra, column 2, column 3; the first is taken: `column` picks another one",
    ] {
        let told = loaded.warnings.iter().filter(|warning| warning.contains(words)).count();
        assert_eq!(told, 1, "{:?}", loaded.warnings);
    }
    for (set, words) in [
        (None, "/photometry: a.xml has 2 emitters, which shine together; give a light for each"),
        (Some(3), "/set: emitter 3, but a.xml has 2; give a number from 1 to 2"),
    ] {
        let light = json!({ "power": 5, "set": set });
        refused(&scene([light.clone(), light]).path(""), &["check", "scene.json"], &[words]);
    }
}

/// What a surface does, and light, are told apart in the files of the IES, which a table does not
/// say.
#[test]
fn spectra_of_light_and_of_surfaces_are_told_apart() {
    let folder = |wall: &str, lamp: &str| {
        let scene = json!({
            "bands": [{ "name": "PAR", "from_nm": 400, "to_nm": 700 }],
            "materials": { "wall": { "type": "lambert", "reflectance": { "spectrum": wall } } },
            "objects": [{ "obj": "a.obj", "material": "wall", "captor": true }],
            "lights": [{ "type": "point", "position": [0, 0, 1], "power": { "spectrum": lamp, "total": 1 } }]
        });
        let other = |share: &str| TM27.replace("reflectance", share);
        let files = [
            ("a.spdx", TM27),
            ("t.spdx", &other("T-Factor")),
            ("absorbed.spdx", &other("absorptance")),
            ("a.xml", &tm33("")),
            ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
        ];
        TestScene::new(&scene.to_string(), &files)
    };
    let good = phylux::load(&folder("a.spdx", "a.xml").path("scene.json")).expect("a scene");
    assert!((good.averages[0].means[0] - 0.1).abs() < 1e-9);
    for (wall, lamp, words) in [
        ("a.xml", "a.xml", "a.xml holds light, and not what a surface does"),
        ("a.spdx", "a.spdx", "a.spdx holds what a surface does, and not light"),
        ("a.spdx", "b.spdx", "b.spdx: there is no such file"),
        (
            "t.spdx",
            "a.xml",
            "reflectance: t.spdx says that it holds `transmittance`; name the file",
        ),
        ("absorbed.spdx", "a.xml", "absorbed.spdx says that it holds `absorptance`; give what"),
    ] {
        refused(&folder(wall, lamp).path(""), &["check", "scene.json"], &[words]);
    }
    let intensities = json!({ "lights": [{ "type": "point", "position": [0, 0, 0], "power": 1,
        "photometry": "a.spdx" }] });
    let folder = TestScene::new(&intensities.to_string(), &[("a.spdx", TM27)]);
    refused(
        &folder.path(""),
        &["check", "scene.json"],
        &["a.spdx:1: ", "a TM-27 has a spectrum only"],
    );
}
