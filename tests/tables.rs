//! Measured sheets (materials of type `table`) in whole runs: closed forms, and agreement of
//! photons and paths.

use std::{f64::consts::PI, fmt::Write, fs};

use phylux::{
    Estimator, RunResult,
    results::FaceResult,
    transport::{NearestCount, PhotonCount},
};
use serde_json::{Value, json};

use crate::{
    bad_input::{bad_scene, phylux},
    common::{TestScene, run_file},
    exact::{Comparisons, fresnel},
    world::{Mesh, Point, World, check_ledger, front, room},
};

const UP: Point = [0.0, 0.0, 1.0];

fn film() -> Value {
    json!({ "type": "table", "angles_deg": [0, 40, 60], "direct": [0.5, 0.45, 0.3],
        "diffuse": [[0.3], 0.32, 0.25], "reflectance": [0.1, 0.1, 0.2] })
}

/// Returns the transmittance of a pane of n = 1.52 at this angle of incidence (degrees).
fn pane(degrees: f64) -> f64 {
    let through = fresnel(degrees.to_radians().cos(), 1.52).map(|r| (1.0 - r) / (1.0 + r));
    0.5 * (through[0] + through[1])
}

/// The sun shines through a wide cover onto the ground. The irradiance is E cos(theta) times the
/// direct and the diffuse transmittance of the cover, at one angle within its table and at one
/// beyond, where the table is extended like a pane.
///
/// Seed 1; standard errors at most 0.2 % of the exact value. 4 comparisons, odds of a false alarm
/// 4e-4.
#[test]
fn the_sun_shines_through_a_cover() {
    let mut check = Comparisons::new("cover", 0.002).rounding(1e-4);
    for (theta, total) in [(50.0, 0.66), (75.0, 0.55 * pane(75.0) / pane(60.0))] {
        let world = World::new()
            .material("film", film())
            .surface("film", "film", &Mesh::square([0.0, 0.0, 0.01], UP, 42.0))
            .captor("ground", &Mesh::square([0.0; 3], UP, 40.0))
            .light(json!({ "type": "sun", "irradiance": 800 }))
            .with("sun_at", json!({ "elevation_deg": 90.0 - theta, "azimuth_deg": 77 }));
        let exact = 800.0 * f64::to_radians(theta).cos() * total;
        for (how, run) in
            [("photons", world.run(1_600_000, 1)), ("paths", world.run_paths(240_000, 1))]
        {
            let face = front(&run, "ground");
            check.irradiance(format!("{theta}, {how}"), face, 0, exact);
            assert_eq!(run.account.unseen.map_or(0.0, |unseen| unseen[0]), 0.0);
        }
    }
    check.finish(4);
}

/// A screen that only lets light through straight is no end of aimed flights: below one, and below
/// two of them, a small sensor has its share of the sun's light, by photons aimed at it and by paths.
///
/// Seed 1; standard errors at most 3 % of the exact value. 4 comparisons, odds of a false alarm 4e-4.
#[test]
fn flights_are_aimed_through_screens() {
    let mut check = Comparisons::new("screens", 0.03).rounding(1e-4);
    let screen = json!({ "type": "table", "angles_deg": [0, 90], "direct": [0.5, 0.5] });
    for sheets in 1..=2 {
        let world = World::new()
            .lambert("soil", 0.2)
            .material("screen", screen.clone())
            .surface("ground", "soil", &Mesh::square([0.0, 0.0, -0.1], UP, 8.0))
            .captor("up", &Mesh::disc([0.0; 3], UP, 0.2))
            .light(json!({ "type": "sun", "irradiance": 300 }))
            .with("sun_at", json!({ "elevation_deg": 60, "azimuth_deg": 200 }));
        let world = (1..=sheets).fold(world, |world, i| {
            let mesh = Mesh::square([0.0, 0.0, f64::from(i)], UP, 8.0);
            world.surface(&format!("s{i}"), "screen", &mesh)
        });
        let exact = 300.0 * 60f64.to_radians().sin() * 0.5f64.powi(sheets);
        let aimed = run_file(&world.write().path("scene.json"), |settings| {
            settings.guiding = phylux::Guiding::Aim;
            settings.photons = PhotonCount::new(100_000).ok();
        });
        for (how, run) in [("aimed", aimed), ("paths", world.run_paths(20_000, 1))] {
            check.irradiance(format!("{sheets}, {how}"), front(&run, "up"), 0, exact);
        }
    }
    check.finish(4);
}

/// Writes a table of values of one band on the grid of these angles.
fn table(lists: [&[i32]; 4], f: impl Fn([f64; 4]) -> f64) -> String {
    let mut text = "theta_i,phi_i,theta_o,phi_o,all\n".to_string();
    for &a in lists[0] {
        for &b in lists[1] {
            for &c in lists[2] {
                for &d in lists[3] {
                    let value = f([a, b, c, d].map(f64::from));
                    writeln!(text, "{a},{b},{c},{d},{value}").expect("text");
                }
            }
        }
    }
    text
}

/// Writes a matrix of Klems' full division for a Lambertian sheet that transmits `t` and reflects
/// `r`.
fn klems(t: f64, r: f64) -> String {
    let data = |direction: &str, f: f64| {
        let line = vec![format!("{}", f / PI); 145].join(", ") + ",\n";
        format!(
            "<WavelengthData><Wavelength unit=\"Integral\">Visible</Wavelength><WavelengthDataBlock>\
            <WavelengthDataDirection>{direction}</WavelengthDataDirection>\
            <ColumnAngleBasis>LBNL/Klems Full</ColumnAngleBasis><RowAngleBasis>LBNL/Klems Full</RowAngleBasis>\
            <ScatteringDataType>BTDF</ScatteringDataType><ScatteringData>\n{}</ScatteringData>\
            </WavelengthDataBlock></WavelengthData>\n",
            line.repeat(145)
        )
    };
    let all = [data("Transmission Front", t), data("Reflection Front", r)].concat();
    format!("<?xml version=\"1.0\"?>\n<WindowElement>{all}</WindowElement>\n")
}

/// Runs a scene together with the files that it names.
fn run(world: &World, files: &[(&str, String)], estimator: Estimator, histories: u64) -> RunResult {
    let scene = files_of(world, files);
    let result = run_file(&scene.path("scene.json"), |settings| {
        settings.estimator = estimator;
        (settings.photons, settings.k) =
            (PhotonCount::new(histories).ok(), Some(NearestCount::NONE));
    });
    if estimator == Estimator::Photons {
        check_ledger(&result);
    }
    result
}

fn files_of(world: &World, files: &[(&str, String)]) -> TestScene {
    let scene = world.write();
    for (name, text) in files {
        fs::write(scene.path(name), text).expect("a table");
    }
    scene
}

/// Asserts that two irradiances agree within 4.5 combined standard errors (odds of a false alarm
/// 7e-6 each).
fn assert_alike(what: &str, a: &FaceResult, b: &FaceResult) {
    let (x, y) = (a.irradiance[0], b.irradiance[0]);
    let error = |face: &FaceResult| face.irradiance_se[0].expect("an error");
    let sd = error(a).hypot(error(b));
    assert!((x - y).abs() < 4.5 * sd && sd < 0.06 * x, "{what}: {x} {y} +- {sd}");
}

const HALF: [i32; 7] = [0, 15, 30, 45, 60, 75, 85];
const AROUND: [i32; 8] = [0, 45, 90, 135, 180, 225, 270, 315];

/// Returns a room with a sheet across it, a floor, and captors above and below the sheet.
fn crossed(sheet: Value, floor: Value) -> World {
    World::new()
        .lambert("wall", 0.6)
        .material("sheet", sheet)
        .material("floor", floor)
        .counted("room", "wall", &room([-1.0; 3], [1.0; 3]))
        .counted("sheet", "sheet", &Mesh::square([0.0; 3], [0.0, 0.6, 0.8], 1.8))
        .counted("floor", "floor", &Mesh::square([0.0, 0.0, -0.9], UP, 1.6))
        .captor("under", &Mesh::square([0.3, 0.1, -0.6], UP, 0.5))
        .captor("over", &Mesh::square([-0.3, 0.1, 0.7], [0.0, 0.0, -1.0], 0.5))
        .light(json!({ "type": "point", "position": [0.2, 0.1, 0.8], "power": 10 }))
}

/// A table and a Klems matrix that are Lambertian give the same as a `lambert` floor and a `phong`
/// sheet with these values.
///
/// Seed 1, 60,000 photons and 12,000 paths. 8 comparisons, odds of a false alarm 6e-5.
#[test]
fn lambertian_tables_are_lambertian() {
    let flat = |f: f64| move |_: [f64; 4]| f / PI;
    let files = [
        ("floor.csv", table([&HALF, &[0], &HALF, &[0, 90, 180]], flat(0.4))),
        ("sheet.xml", klems(0.35, 0.45)),
    ];
    let file = |name: &str| json!({ "type": "table", "file": name });
    let tables = crossed(file("sheet.xml"), file("floor.csv"));
    let same = crossed(
        json!({ "type": "phong", "reflectance": 0.45, "transmittance": 0.35 }),
        json!({ "type": "lambert", "reflectance": 0.4 }),
    );
    for (estimator, histories) in [(Estimator::Photons, 60_000), (Estimator::Paths, 12_000)] {
        let [a, b] = [&tables, &same].map(|world| run(world, &files, estimator, histories));
        for captor in ["under", "over", "floor", "sheet"] {
            assert_alike(captor, front(&a, captor), front(&b, captor));
        }
    }
}

/// Photons and paths agree in a room with a table floor that depends on the difference of azimuths
/// and with each of three sheets: a cover, a sheet that is not symmetric about its normal and whose
/// back follows from its front, and one whose table states both faces.
///
/// Seed 1, 60,000 photons and 12,000 paths. 12 comparisons, odds of a false alarm 9e-5.
#[test]
fn photons_and_paths_agree_about_tables() {
    let lobe = |[a, b, c, d]: [f64; 4]| {
        let turn = (d - b).to_radians().cos() + 0.5 * d.to_radians().sin();
        (0.1 + 0.05 * turn * (a.min(180.0 - a) / 90.0)) * (0.5 + c / 180.0)
    };
    let both_sides = [0, 30, 60, 100, 130, 160];
    let files = [
        ("floor.csv", table([&HALF, &[0], &HALF, &AROUND], |[a, _, c, d]| lobe([a, 0.0, c, d]))),
        ("sheet.csv", table([&HALF, &AROUND, &both_sides, &AROUND], lobe)),
        ("faces.csv", table([&both_sides, &AROUND, &both_sides, &AROUND], lobe)),
    ];
    let file = |name: &str| json!({ "type": "table", "file": name });
    for (what, sheet) in
        [("cover", film()), ("sheet", file("sheet.csv")), ("faces", file("faces.csv"))]
    {
        let world = crossed(sheet, file("floor.csv"));
        let photons = run(&world, &files, Estimator::Photons, 60_000);
        let paths = run(&world, &files, Estimator::Paths, 12_000);
        for captor in ["under", "over", "floor", "sheet"] {
            let what = format!("{what}, {captor}");
            assert_alike(&what, front(&photons, captor), front(&paths, captor));
        }
    }
}

/// A sheet that sends all transmitted light towards its azimuth 0 lights the wall in that
/// direction, which is along u of its texture coordinates or, without them, along its longest edge.
#[test]
fn azimuth_0_is_along_u_or_the_longest_edge() {
    let through = |[_, _, c, d]: [f64; 4]| if c == 130.0 && d == 0.0 { 0.25 } else { 0.0 };
    let text = table(
        [&[0, 45, 90], &[0, 120, 240], &[45, 95, 130, 165], &[0, 45, 90, 135, 180, 225, 270, 315]],
        through,
    );
    let corners = "v -0.2 -0.1 0\nv 0.2 -0.1 0\nv 0.2 0.1 0\nv -0.2 0.1 0\n";
    let along_y = "vt 0 0\nvt 0 -1\nvt 1 -1\nvt 1 0\n";
    for (faces, axis) in [
        ("f 1 2 3 4\n".to_string(), [1.0, 0.0]),
        (format!("{along_y}f 1/1 2/2 3/3 4/4\n"), [0.0, 1.0]),
        (format!("{along_y}f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"), [0.0, 1.0]),
    ] {
        // four walls below the sheet, of which only one is lit
        let walls = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]];
        let world = walls.iter().enumerate().fold(World::new(), |world, (i, [x, y])| {
            world.captor(&format!("wall {i}"), &Mesh::square([*x, *y, -1.0], [-x, -y, 0.0], 1.9))
        });
        let object = json!([{ "name": "sheet", "obj": "sheet.obj", "material": "sheet" }]);
        let spot = json!({ "type": "spot", "position": [0, 0, 1], "direction": [0, 0, -1], "half_angle_deg": 3, "power": 1 });
        let world = world
            .material("sheet", json!({ "type": "table", "file": "sheet.csv" }))
            .with("objects", object)
            .light(spot);
        let files = [("sheet.csv", text.clone()), ("sheet.obj", format!("{corners}{faces}"))];
        let result = run(&world, &files, Estimator::Photons, 20_000);
        let flux = |i: usize| front(&result, &format!("wall {i}")).flux[0];
        for (i, [x, y]) in walls.iter().enumerate() {
            let lit = [*x, *y] == axis;
            assert!(if lit { flux(i) > 0.03 } else { flux(i) < 0.02 }, "{faces}: {i} {}", flux(i));
        }
    }
}

/// Every command accepts tables, and `check` reports how far they are from reciprocity.
#[test]
fn commands_take_tables() {
    let lobe = |[a, _, c, _]: [f64; 4]| 0.1 + 0.1 * a / 90.0 + 0.05 * c / 90.0;
    let files = [("floor.csv", table([&HALF, &[0], &HALF, &AROUND], lobe))];
    let world = crossed(film(), json!({ "type": "table", "file": "floor.csv" })).with(
        "camera",
        json!({ "position": [0, -0.9, 0.9], "look_at": [0, 0, -0.5], "width": 32, "height": 24 }),
    );
    let scene = files_of(&world, &files);
    let folder = scene.path("");
    for arguments in [
        &["run", "scene.json", "--photons", "2000"][..],
        &["run", "scene.json", "--photons", "2000", "--estimator", "paths", "-o", "paths.json"],
        &["render", "scene.json", "--photons", "20000", "-o", "light.png"],
        &["render", "scene.json", "--photons", "20000", "--gather", "2", "-o", "gathered.png"],
        &["check", "scene.json"],
    ] {
        let output = phylux(&folder, arguments);
        let text = String::from_utf8_lossy(&output.stdout).into_owned()
            + &String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{arguments:?}: {text}");
        if arguments[0] == "check" {
            let words = "/materials/floor: f(i, o) and f(o, i) of its file differ by ";
            assert!(text.contains(words), "{text}");
        }
        if arguments.len() == 4 {
            assert!(text.contains("floor.csv: f(i, o) and f(o, i) differ by "), "{text}");
        }
    }
}

/// Every wrong table is refused with a message that says what is wrong.
#[test]
fn wrong_tables_are_refused() {
    let scene = |material: &str| {
        format!(
            "{{\"materials\": {{\"t\": {material}}}, \"objects\": [{{\"obj\": \"a.obj\", \"material\": \"t\", \"captor\": true}}], \
            \"lights\": [{{\"type\": \"point\", \"position\": [0, 0, 1], \"power\": 1}}]}}"
        )
    };
    let bright = "theta_i,phi_i,theta_o,phi_o,all\n0,0,0,0,0.4\n";
    let files = [("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), ("a.csv", bright)];
    for (material, words) in [
        (
            r#"{"type": "table"}"#,
            &["/materials/t: a table with neither `file` nor `angles_deg`"][..],
        ),
        (r#"{"type": "table", "file": "none.csv"}"#, &["/materials/t/file: ", "no such file"]),
        (
            r#"{"type": "table", "file": "a.csv", "direct": [1]}"#,
            &["/materials/t/direct: does not go with `file`"],
        ),
        (
            r#"{"type": "table", "angles_deg": [0], "direct": [1], "reciprocal": true}"#,
            &["/reciprocal: goes with `file` only"],
        ),
        (
            r#"{"type": "table", "angles_deg": [0]}"#,
            &["neither `direct` nor `diffuse`; give the transmittance"],
        ),
        (
            r#"{"type": "table", "angles_deg": [], "direct": []}"#,
            &["angles_deg: 0 angles, must be 1 to 1000"],
        ),
        (
            r#"{"type": "table", "angles_deg": [0, 0], "direct": [0, 0]}"#,
            &["angles_deg/1: 0 after 0: angles rise"],
        ),
        (
            r#"{"type": "table", "angles_deg": [0, 91], "direct": [0, 0]}"#,
            &["angles_deg/1: 91, must be from 0 to 90"],
        ),
        (
            r#"{"type": "table", "angles_deg": [0, 9], "direct": [0]}"#,
            &["direct: 1 entry for 2 angles; give one"],
        ),
        (
            r#"{"type": "table", "angles_deg": [0], "diffuse": [1.5]}"#,
            &["diffuse/0: 1.5, must be from 0 to 1"],
        ),
        (
            r#"{"type": "table", "angles_deg": [0], "diffuse": [[0.5, 0.5]]}"#,
            &["diffuse/0: 2 numbers for 1 band"],
        ),
        (
            r#"{"type": "table", "angles_deg": [30], "diffuse": [0.5], "direct": [0.6]}"#,
            &["direct + diffuse + reflectance at 30 degrees = 1.1000, must be at most 1"],
        ),
        (
            r#"{"type": "table", "file": "a.csv"}"#,
            &[
                "a.csv: of the light that comes to the front at 0.0 degrees 1.2566 goes on, must be at most 1",
            ],
        ),
        (r#"{"type": "table", "flie": "a.csv"}"#, &["unknown key `flie`", "file"]),
    ] {
        bad_scene(&scene(material), &files, words);
    }
}
