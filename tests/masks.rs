//! Masks of MTL entries cut the outlines of leaves: areas, light and captors are those of what is
//! left.

use std::{fs, path::Path};

use phylux::{
    Estimator, LoadedScene, RunResult, Settings,
    transport::{NearestCount, PhotonCount},
};
use serde_json::{Value, json};

use crate::common::{TestScene, front, run_file};

/// A card of 1 m2 that faces up, in two triangles.
const CARD: &str = "mtllib card.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\n\
                    vt 0 1\ng leaf\nusemtl blade\nf 1/1 2/2 3/3 4/4\n";

/// A scene in which a lamp of 1 m2 lies on the card, and a sensor of 1 m2 under it. All the light
/// that the card does not absorb arrives at the sensor.
fn scene(mtl: &str, object: &str, masks: &[(&str, Vec<u8>)]) -> TestScene {
    let text = format!(
        r#"{{"materials": {{"black": {{"type": "lambert", "reflectance": 0}}}},
        "objects": [{{"name": "card", "obj": "card.obj", "material": "black"{object}}}],
        "captors": [{{"name": "under", "obj": "under.obj"}}],
        "lights": [{{"type": "area", "power": 1,
            "vertices": [[0, 0, 0.0005], [0, 1, 0.0005], [1, 1, 0.0005], [1, 0, 0.0005]]}}]}}"#
    );
    let under = "v 0 0 -5e-4\nv 1 0 -5e-4\nv 1 1 -5e-4\nv 0 1 -5e-4\nf 1 2 3 4\n";
    let files = [("card.obj", CARD), ("card.mtl", mtl), ("under.obj", under)];
    let scene = TestScene::new(&text, &files);
    for (name, bytes) in masks {
        fs::write(scene.path(name), bytes).expect("a mask");
    }
    scene
}

fn load(scene: &TestScene) -> LoadedScene {
    phylux::load(&scene.path("scene.json")).unwrap_or_else(|e| panic!("{e}"))
}

/// A picture whose texels are opaque where the rule says so, for the middle of each in texture
/// coordinates.
fn picture(size: u32, rule: impl Fn(f64, f64) -> bool) -> Vec<u8> {
    let place = |i: u32| (f64::from(i) + 0.5) / f64::from(size);
    let texel = |i: u32| [40, 90, 30, u8::from(rule(place(i % size), 1.0 - place(i / size))) * 255];
    let texels: Vec<u8> = (0..size * size).flat_map(texel).collect();
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, size, size);
    encoder.set_color(png::ColorType::Rgba);
    encoder.write_header().unwrap().write_image_data(&texels).unwrap();
    bytes
}

const LEAF: &str = "newmtl blade\nKd 0.1 0.3 0.1\nillum 1\nmap_Kd leaf.png\nmap_d leaf.png\n";

/// The closed form: a black card that is there in a share s of its area absorbs s of the light, and
/// 1 - s passes. The slits between card, lamp and sensor lose some 0.1 % of the light at the edge of
/// the lamp, and mix the squares of the checker at theirs, without a mean.
///
/// Seeds 1 and 2, 20,000 photons or paths: the standard error of a share is at most 0.0036, and the
/// limit is 5 of them with the slits' 0.002; odds of a false alarm 1e-6 for each of 9 values.
#[test]
fn a_card_absorbs_the_share_that_its_mask_leaves() {
    let disc = |x: f64, y: f64| (x - 0.5).hypot(y - 0.5) < 0.4;
    let checker = |x: f64, y: f64| ((x * 4.0) as u32 + (y * 4.0) as u32).is_multiple_of(2);
    let disc_area = std::f64::consts::PI * 0.16;
    for (name, bytes, share) in [
        ("half", picture(16, |x, _| x < 0.5), 0.5),
        ("checker", picture(64, checker), 0.5),
        ("disc", picture(128, disc), disc_area),
    ] {
        let scene = scene(LEAF, r#", "captor": true"#, &[("leaf.png", bytes)]);
        let result = scene.run(20_000, 1);
        let leaf = result.captors.iter().find(|captor| captor.id == "card/leaf").unwrap();
        assert!((leaf.area / share - 1.0).abs() < 2e-3, "{name}: area {}", leaf.area);
        let near = |found: f64, expected: f64| {
            assert!((found - expected).abs() < 0.02, "{name}: {found}, must be {expected}");
        };
        near(leaf.absorbed.as_ref().unwrap()[0], share);
        near(front(&result, "card/leaf").irradiance[0], 1.0);
        near(front(&result, "under").flux[0], 1.0 - share);
        let paths = scene.run_paths(20_000, 2);
        near(front(&paths, "card/leaf").flux[0], share);
        near(front(&paths, "under").flux[0], 1.0 - share);
    }
}

/// Returns the elasticity of a captor by a parameter, with its error.
fn elasticity(run: &RunResult, captor: &str, face: &str, parameter: &str) -> (f64, f64) {
    let mut rows = run.extras.sensitivity.iter().flatten().filter(|of| {
        of.captor.as_deref() == Some(captor) && of.face == face && of.parameter == parameter
    });
    let of = rows.next().expect("light that has met it");
    (of.elasticity[0].expect("light"), of.elasticity_se[0].expect("an error"))
}

/// A leaf without a cuticle, of which a mask leaves the share s: the light behind it, 1 - s + s t, has
/// the elasticity s t / (1 - s + s t) by t, and what the leaf absorbs has -r / (1 - r - t) by r and
/// -t / (1 - r - t) by t; also if it is one of two copies that share their triangles.
///
/// Photons, paths and complete paths, 6 values each within 4 standard errors and 0.003 for the slits,
/// odds of a false alarm 1.2e-3.
#[test]
fn elasticities_of_a_leaf_that_is_cut() {
    let (r, t, s) = (0.3, 0.4, 0.5);
    let checker = |x: f64, y: f64| ((x * 4.0) as u32 + (y * 4.0) as u32).is_multiple_of(2);
    let copies = r#", "captor": true, "share": true,
        "instances": [{}, {"translate": [300, 0, 0]}]"#;
    for (object, id) in [(r#", "captor": true"#, "card/leaf"), (copies, "card/leaf#0")] {
        let scene = scene(LEAF, object, &[("leaf.png", picture(64, checker))]);
        let path = scene.path("scene.json");
        let text = fs::read_to_string(&path).expect("the scene");
        let mut edited: Value = serde_json::from_str(&text).expect("JSON");
        edited["materials"]["black"] =
            json!({ "type": "leaf", "ior": 1, "reflectance": r, "transmittance": t });
        edited["sensitivity"] = json!(true);
        fs::write(&path, edited.to_string()).expect("the scene");
        for estimator in [Estimator::Photons, Estimator::Paths, Estimator::Complete] {
            let found = run_file(&path, |settings| {
                let (photons, k) = (PhotonCount::new(40_000).ok(), Some(NearestCount::NONE));
                *settings = Settings { estimator, photons, k, ..settings.clone() };
            });
            for (captor, face, key, exact) in [
                ("under", "front", "transmittance", s * t / (1.0 - s + s * t)),
                (id, "absorbed", "reflectance", -r / (1.0 - r - t)),
                (id, "absorbed", "transmittance", -t / (1.0 - r - t)),
            ] {
                let parameter = format!("/materials/black/{key}");
                let (e, error) = elasticity(&found, captor, face, &parameter);
                assert!(
                    (e - exact).abs() < 4.0 * error + 0.003 && error < 0.02,
                    "{estimator}, {captor} by {key}: {e} ± {error}, not {exact}"
                );
            }
        }
    }
}

#[test]
fn what_a_mask_does_is_said_and_can_be_switched_off() {
    let half = || vec![("leaf.png", picture(16, |x, _| x < 0.5))];
    let area = |loaded: &LoadedScene| {
        loaded.scene.triangles().iter().map(|t| f64::from(t.area())).sum::<f64>()
    };
    let cut = load(&scene(LEAF, "", &half()));
    assert!((area(&cut) - 0.5).abs() < 1e-6);
    // what the file asks for is no reason to warn
    assert_eq!((cut.warnings.len(), cut.notes.len()), (0, 1), "{:?}", cut.warnings);
    assert!(cut.notes[0].contains("`leaf.png` cuts 50.0 % of the area"), "{:?}", cut.notes);
    assert!(cut.files.iter().any(|file| file.ends_with("leaf.png")), "{:?}", cut.files);
    let copies =
        r#", "captor": "triangle", "instances": [{}, {"translate": [0, 0, -3], "scale": 2}]"#;
    let copies = load(&scene(LEAF, copies, &half()));
    let ids: Vec<&str> = copies.scene.captors().iter().map(|captor| captor.id.as_str()).collect();
    assert_eq!(ids, ["card/leaf#0/0", "card/leaf#0/1", "card/leaf#1/0", "card/leaf#1/1", "under"]);
    assert!((area(&copies) - 2.5).abs() < 1e-5);
    let off = load(&scene(LEAF, r#", "mask": false"#, &half()));
    assert_eq!((area(&off), off.warnings.len()), (1.0, 0), "{:?}", off.warnings);
    assert!(off.notes.is_empty(), "{:?}", off.notes);
    let opaque = load(&scene(LEAF, "", &[("leaf.png", picture(8, |_, _| true))]));
    let whole = load(&scene("newmtl blade\n", "", &[]));
    assert!(opaque.scene.triangles().iter().eq(whole.scene.triangles().iter()));
    let clear = scene(LEAF, "", &[("leaf.png", picture(8, |_, _| false))]);
    let error = phylux::load(&clear.path("scene.json")).unwrap_err().to_string();
    assert!(error.contains("/objects/0: its masks (`map_d`) leave nothing of it"), "{error}");
}

#[test]
fn masks_that_cannot_cut_are_said() {
    let half = || picture(16, |x, _| x < 0.5);
    let opaque = || picture(4, |_, _| true);
    for (mtl, file, warning) in [
        (LEAF, None, "cannot be used (there is no such file): its faces are not cut"),
        (LEAF, Some(b"\xff\xd8\xff\xe0".to_vec()), "is a JPEG file"),
        ("newmtl blade\nmap_d -t 1 leaf.png\n", Some(half()), "turbulence"),
        ("newmtl blade\nmap_Kd leaf.png\n", Some(half()), "50.0 % of its texture `leaf.png`"),
        ("newmtl blade\nmap_d C:\\x\\leaf.png\n", Some(half()), "cuts 50.0 %"),
        ("newmtl blade\nmap_d -imfchan r leaf.png\n", Some(opaque()), "leave nothing"),
        ("newmtl blade\nmap_d -mm 1 -1 leaf.png\n", Some(half()), "cuts 50.0 %"),
    ] {
        let masks: Vec<_> = file.into_iter().map(|bytes| ("leaf.png", bytes)).collect();
        let scene = scene(mtl, "", &masks);
        let said = match phylux::load(&scene.path("scene.json")) {
            Ok(loaded) => [loaded.warnings, loaded.notes].concat(),
            Err(error) => vec![error.to_string()],
        };
        assert_eq!(said.len(), 1, "{mtl}: {said:?}");
        assert!(said[0].contains(warning), "{mtl}: {said:?}");
        assert!(said[0].contains("card.mtl:1: ") || said[0].contains("scene.json"), "{said:?}");
    }
    // the colours of an opaque leaf, with an alpha channel and without
    for (colours, texels) in
        [(png::ColorType::Rgba, vec![40, 90, 30, 255]), (png::ColorType::Rgb, vec![40, 90, 30])]
    {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 1, 1);
        encoder.set_color(colours);
        encoder.write_header().unwrap().write_image_data(&texels).unwrap();
        let loaded = load(&scene(LEAF, "", &[("leaf.png", bytes)]));
        assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
        assert_eq!(loaded.scene.triangles().len(), 2);
    }
    // neither vt nor a picture that repeats without end
    let bare = scene(LEAF, "", &[("leaf.png", half())]);
    let path = bare.path("card.obj");
    fs::write(&path, CARD.replace("f 1/1 2/2 3/3 4/4", "f 1 2 3 4")).expect("an OBJ file");
    let warnings = load(&bare).warnings;
    assert!(warnings[0].contains("2 triangles without texture coordinates"), "{warnings:?}");
    fs::write(&path, CARD.replace("vt 1 1", "vt 1e9 1e9")).expect("an OBJ file");
    let error = phylux::load(Path::new(&bare.path("scene.json"))).unwrap_err().to_string();
    assert!(error.contains("repeats") && error.contains("\"mask\": false"), "{error}");
}

/// Masks cut objects alone. Where one would cut the mesh of a captor or of a light, it is said; an
/// opaque one says nothing.
#[test]
fn masks_of_captors_and_lights_are_said() {
    let warnings = |rule: fn(f64, f64) -> bool| {
        let text = r#"{"materials": {}, "objects": [],
            "captors": [{"name": "leaf", "obj": "card.obj"}],
            "lights": [{"name": "panel", "type": "area", "power": 1, "obj": "card.obj"}]}"#;
        let scene = TestScene::new(text, &[("card.obj", CARD), ("card.mtl", LEAF)]);
        fs::write(scene.path("leaf.png"), picture(16, rule)).expect("a mask");
        load(&scene).warnings
    };
    let said = warnings(|x, _| x < 0.5);
    assert_eq!(said.len(), 2, "{said:?}");
    for place in ["/captors/0/obj: ", "/lights/0/obj: "] {
        let found = said.iter().find(|warning| warning.contains(place)).expect(place);
        assert!(found.contains("the mask `leaf.png` of "), "{found}");
    }
    assert!(warnings(|_, _| true).is_empty());
}

/// A file of materials that is missing may name masks: that is said, once a file, where faces have
/// texture coordinates and the object does not leave masks out.
#[test]
fn a_missing_file_of_materials_may_name_masks() {
    let words = "card.mtl: there is no such file; if it names masks (`map_d`), they cut no faces";
    let told = |object: &str, obj: &str| {
        let scene = scene(LEAF, object, &[]);
        fs::remove_file(scene.path("card.mtl")).expect("a file");
        fs::write(scene.path("card.obj"), obj).expect("a file");
        load(&scene).warnings.iter().filter(|warning| warning.contains(words)).count()
    };
    assert_eq!(told("", CARD), 1);
    assert_eq!(told(", \"mask\": false", CARD), 0);
    assert_eq!(told("", &CARD.replace("1/1 2/2 3/3 4/4", "1 2 3 4")), 0);
    // each of several files
    let scene = scene(LEAF, "", &[]);
    fs::remove_file(scene.path("card.mtl")).expect("a file");
    let named = CARD.replace("mtllib card.mtl", "mtllib card.mtl\nmtllib other.mtl");
    fs::write(scene.path("card.obj"), named).expect("a file");
    let warnings = load(&scene).warnings;
    for file in ["card.mtl", "other.mtl"] {
        let words = words.replace("card.mtl", file);
        assert!(warnings.iter().any(|warning| warning.contains(&words)), "{file}: {warnings:?}");
    }
}
