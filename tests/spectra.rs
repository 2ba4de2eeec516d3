//! Spectra as values per band: averages that are calculated by hand, powers of lamps, warnings and
//! refusals.

use phylux::{load, scene::Prospect};
use serde_json::{Value, json};

use crate::{
    bad_input::{phylux, refused},
    common::TestScene,
};

/// A table whose reflectance rises from 0 at 400 nm to 1 at 600 nm, and a noisy column in percent.
const LEAF: &str = "nm,R,noise\n400,0,-1\n500,0.5,-1\n600,1,50\n";
/// A lamp that emits 1 photon per nm up to 500 nm, then rising to 3.
const LAMP: &str = "\"nm\";\"photons\"\n400;1,0\n500;1,0\n600;3,0\n";

fn scene(power: Value, more: Value) -> Value {
    let mut scene = json!({
        "quantity": "umol/s",
        "bands": [{ "name": "a", "from_nm": 400, "to_nm": 500 }, { "name": "b", "from_nm": 500, "to_nm": 600 }],
        "materials": { "m": { "type": "lambert", "reflectance": { "spectrum": "leaf.csv" } } },
        "objects": [{ "obj": "a.obj", "material": "m", "captor": true }],
        "lights": [{ "type": "point", "position": [0, 0, 1], "power": power }]
    });
    for (key, value) in more.as_object().expect("an object") {
        scene[key.as_str()] = value.clone();
    }
    scene
}

fn write(scene: &Value) -> TestScene {
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    TestScene::new(&scene.to_string(), &[("leaf.csv", LEAF), ("lamp.csv", LAMP), ("a.obj", obj)])
}

fn averages(scene: &Value) -> Vec<f64> {
    let loaded = load(&write(scene).path("scene.json")).unwrap_or_else(|e| panic!("{e}"));
    loaded.averages[0].means.clone()
}

fn powers(scene: &Value) -> Vec<f64> {
    let loaded = load(&write(scene).path("scene.json")).unwrap_or_else(|e| panic!("{e}"));
    loaded.scene.lights()[0].power.clone()
}

#[track_caller]
fn close(found: &[f64], exact: &[f64]) {
    for (a, b) in found.iter().zip(exact) {
        assert!((a - b).abs() < 1e-6 * b.abs().max(1.0), "{found:?} {exact:?}");
    }
    assert_eq!(found.len(), exact.len());
}

fn lamp(total: f64) -> Value {
    json!({ "spectrum": "lamp.csv", "total": total })
}

/// Averages of a spectrum over bands. With a flat weight they are the value in the middle of each
/// band. With the lamp's photons as weight the average in b is 19/24: for x from 0 to 1, the
/// integral of (1/2 + x/2)(1 + 2x) over that of 1 + 2x. In W the weight is the number of photons
/// divided by the wavelength.
#[test]
fn averages_are_weighted_by_the_light() {
    let flat = json!({ "spectra": { "weight": "flat" } });
    close(&averages(&scene(json!(1), flat)), &[0.25, 0.75]);
    close(&averages(&scene(json!(1), json!({}))), &[0.25, 0.75]);
    close(&averages(&scene(lamp(5.0), json!({}))), &[0.25, 19.0 / 24.0]);
    let by_file = json!({ "spectra": { "weight": "lamp.csv" } });
    close(&averages(&scene(json!(1), by_file)), &[0.25, 19.0 / 24.0]);
    // energy per nm is photons per nm over nm: with the weight 1 / nm, the mean of (nm - 400) / 200
    // is (100 / ln 1.25 - 400) / 200
    let watts = averages(&scene(lamp(5.0), json!({ "quantity": "W" })));
    close(&watts[..1], &[(100.0 / 1.25f64.ln() - 400.0) / 200.0]);
    // two lamps weigh by their light: one of 300 umol/s with the shape of LAMP, and one with 100 in
    // each band and a flat spectrum
    let lights = json!({ "lights": [
        { "type": "point", "position": [0, 0, 1], "power": lamp(300.0) },
        { "type": "point", "position": [0, 0, 1], "power": 100 } ] });
    let both = (200.0 * 19.0 / 24.0 + 100.0 * 0.75) / 300.0;
    close(&averages(&scene(json!(1), lights)), &[0.25, both]);
    // values below zero are noise, and are cut after the mean is taken: from -1 to 50 % the mean is
    // 24.5 %
    let noise = json!({ "spectrum": "leaf.csv", "column": "noise", "percent": true, "times": 2 });
    let noisy = json!({ "materials": { "m": { "type": "lambert", "reflectance": noise } } });
    close(&averages(&scene(json!(1), noisy)), &[0.0, 0.49]);
}

/// The lamp emits 100 photons in a and 200 in b. In W they are converted by wavelength: 1 umol is 1
/// J / (0.0083593472 nm).
#[test]
fn lamps_share_their_flux_by_the_spectrum() {
    let k = 0.008_359_347_2;
    close(&powers(&scene(lamp(30.0), json!({}))), &[10.0, 20.0]);
    let range = json!({ "spectrum": "lamp.csv", "column": "photons", "total": 30, "from_nm": 400, "to_nm": 500 });
    close(&powers(&scene(range, json!({}))), &[30.0, 60.0]);
    // 100 umol in a: the integral of 1 / (k nm)
    let photons =
        json!({ "spectrum": "lamp.csv", "column": 2, "total": 300, "quantity": "umol/s" });
    let watts = powers(&scene(photons, json!({ "quantity": "W" })));
    close(&watts[..1], &[1.25f64.ln() / k]);
    let energy = json!({ "spectrum": "lamp.csv", "unit": "energy", "total": 300, "quantity": "W" });
    let umol = powers(&scene(energy, json!({})));
    close(&umol[..1], &[k * 45_000.0]);
}

/// Phong and leaf materials accept spectra too. `check` prints the averages, and warns of wide
/// bands and of lamps without a spectrum.
#[test]
fn check_prints_averages_and_warns() {
    let r = |times: f64| json!({ "spectrum": "leaf.csv", "times": times });
    let materials = json!({ "materials": {
        "m": { "type": "phong", "reflectance": r(0.9), "specular": r(0.05) },
        "leaf": { "type": "leaf", "reflectance": r(0.5), "transmittance": r(0.4), "back": { "reflectance": r(0.3) } } } });
    let scene = write(&scene(json!(1), materials));
    let output = phylux(&scene.path(""), &["check", "scene.json"]);
    let text = String::from_utf8_lossy(&output.stdout);
    for words in [
        "averages of spectra a b",
        "/materials/m/reflectance 0.2250 0.6750",
        "/materials/m/specular 0.0125 0.0375",
        "/materials/leaf/back/reflectance 0.0750 0.2250",
    ] {
        let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(text.contains(words), "{words}: {text}");
    }
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(errors.contains("no spectrum of the lights `light0`"), "{errors}");
    // the mean square over the square of the mean is 1/3 over 1/4 in a, and 7/12 over 9/16 in b
    assert!(errors.contains("/materials/m/reflectance in band `a` (1.33)"), "{errors}");
    assert!(!errors.contains("in band `b`"), "{errors}");
}

#[test]
fn bad_spectra_are_told() {
    let material =
        |value: Value| json!({ "materials": { "m": { "type": "lambert", "reflectance": value } } });
    let bands = json!({ "bands": [{ "name": "a", "from_nm": 400 }] });
    let wide = json!({ "bands": [{ "name": "a", "from_nm": 400, "to_nm": 900 }] });
    for (power, more, words) in [
        (json!(1), material(json!({ "spectrum": "none.csv" })), "none.csv: there is no such file"),
        (
            json!(1),
            material(json!({ "spectrum": "leaf.csv", "column": "Q" })),
            "leaf.csv:1: no column `Q`",
        ),
        (json!(1), material(json!({ "spectrum": "leaf.csv", "colum": 2 })), "unknown key `colum`"),
        (
            json!(1),
            material(json!({ "spectrum": "leaf.csv", "times": 3 })),
            "/materials/m/reflectance: 2.2",
        ),
        (
            json!(1),
            material(json!({ "spectrum": "leaf.csv", "times": -3 })),
            "/reflectance/times: -3",
        ),
        (json!(1), bands, "band `a` has no wavelengths"),
        (json!(1), wide, "reaches from 400 to 600 nm, band `a` from 400 to 900 nm"),
        (json!({ "spectrum": "lamp.csv" }), json!({}), "missing key `total`"),
        (
            json!({ "spectrum": "lamp.csv", "total": -1 }),
            json!({}),
            "/total: -1, must be at least 0",
        ),
        (
            json!({ "spectrum": "lamp.csv", "total": 1, "from_nm": 700, "to_nm": 600 }),
            json!({}),
            "counts from 700 to 600 nm",
        ),
        (
            json!({ "spectrum": "lamp.csv", "total": 1, "to_nm": 900 }),
            json!({}),
            "counts from 400 to 900 nm",
        ),
    ] {
        let folder = write(&scene(power, more));
        refused(&folder.path(""), &["check", "scene.json"], &[words]);
    }
}

/// A leaf by its contents has the means of PROSPECT's spectra, which the light of the scene weights:
/// those of the leaf whose spectra are tables. A sweep may vary the contents, and what is wrong with
/// them is named.
#[test]
fn leaves_are_made_of_their_contents() {
    let contents = Prospect {
        n: 1.5,
        chlorophyll: 40.0,
        carotenoids: 8.0,
        anthocyanins: 0.0,
        brown: 0.0,
        water: 0.01,
        dry_matter: 0.009,
    };
    let spectra = contents.spectra().expect("a leaf");
    let rows = (400..=600).map(f64::from);
    let rows = rows.map(|nm| {
        format!("{nm},{},{}\n", spectra.reflectance.at(nm), spectra.transmittance.at(nm))
    });
    let table = format!("nm,R,T\n{}", rows.collect::<String>());
    let leaf = |keys: Value| {
        let mut leaf = keys;
        leaf["type"] = json!("leaf");
        scene(lamp(10.0), json!({ "materials": { "m": leaf } }))
    };
    let of = |key: &str| json!({ "spectrum": "prospect.csv", "column": key });
    let measured = leaf(json!({ "reflectance": of("R"), "transmittance": of("T") }));
    let given = json!({ "n": 1.5, "chlorophyll": 40, "carotenoids": 8, "water": 0.01, "dry_matter": 0.009 });
    let made = leaf(json!({ "prospect": given }));
    let averages = |scene: &Value| {
        let files = write(scene);
        std::fs::write(files.path("prospect.csv"), &table).expect("written");
        let loaded = load(&files.path("scene.json")).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(loaded.averages.len(), 2);
        loaded.averages
    };
    let (measured, made) = (averages(&measured), averages(&made));
    for (measured, made) in measured.iter().zip(&made) {
        close(&made.means, &measured.means);
    }
    assert!(made[0].pointer.ends_with("/prospect reflectance"), "{}", made[0].pointer);

    let with = |key: &str, value: Value| {
        let mut contents = given.clone();
        contents[key] = value;
        leaf(json!({ "prospect": contents }))
    };
    for (scene, problem) in [
        (with("n", json!(0.5)), "/materials/m/prospect/n: 0.5, must be from 1 to 10"),
        (with("water", json!(-1)), "/materials/m/prospect/water: -1, must be at least 0"),
        (with("chlorofyll", json!(1)), "unknown key `chlorofyll`"),
        (
            leaf(json!({ "prospect": given, "transmittance": 0.1 })),
            "/materials/m/transmittance: a leaf has `prospect` or `transmittance`, not both",
        ),
        (
            leaf(json!({ "prospect": given, "thin": false })),
            "/materials/m/prospect: a solid leaf (thin: false) is a dielectric interface",
        ),
    ] {
        let error = load(&write(&scene).path("scene.json")).expect_err("refused").to_string();
        assert!(error.contains(problem), "{error}");
    }
    // g/m2 in place of cm, and mg/cm2 in place of g/cm2
    for (key, value, words) in [
        (
            "water",
            json!(100),
            "/prospect/water: 100 cm, and leaves have at most some 0.2: is it in",
        ),
        ("dry_matter", json!(9), "/prospect/dry_matter: 9 g/cm2, and leaves have at most some 0.1"),
    ] {
        let slip =
            load(&write(&with(key, value)).path("scene.json")).unwrap_or_else(|e| panic!("{e}"));
        let said = slip.warnings.iter().filter(|said| said.contains(words)).count();
        assert_eq!(said, 1, "{:?}", slip.warnings);
    }
}

/// A lamp may have a spectrum at hand. Illuminant A is a Planckian radiator, so the power in each
/// band is the integral of Planck's law; a band at the peak of a narrow diode has all of its light.
#[test]
fn lamps_have_spectra_at_hand() {
    let named = |name: &str| json!({ "spectrum": name, "total": 10, "quantity": "W" });
    let with = |power: Value| {
        let mut scene = scene(power, json!({ "quantity": "W" }));
        scene["materials"]["m"]["reflectance"] = json!(0.5);
        scene["bands"][1]["to_nm"] = json!(700);
        scene
    };
    let planck = |nm: f64| nm.powi(-5) / ((1.435e7 / (nm * 2848.0)).exp() - 1.0);
    let part = |from: u32, to: u32| (from..to).map(|nm| planck(f64::from(nm) + 0.5)).sum::<f64>();
    let all = part(300, 780);
    let found = powers(&with(named("A")));
    for (found, (from, to)) in found.iter().zip([(400, 500), (500, 700)]) {
        let exact = 10.0 * part(from, to) / all;
        assert!((found / exact - 1.0).abs() < 1e-3, "{found}, not {exact}");
    }
    // `check` says which one a lamp has
    let output = phylux(&write(&with(named("A"))).path(""), &["check", "scene.json"]);
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    let row = said.lines().skip_while(|line| *line != "spectra of lamps").nth(1);
    assert!(
        row.is_some_and(|row| row.trim_start().starts_with("light0") && row.ends_with(" A")),
        "{said}"
    );
    let found = powers(&with(named("LED-red-660")));
    assert!(found[0] < 1e-6 && (found[1] - 10.0).abs() < 0.03, "{found:?}");
    // the weight of means may have one, too
    let blue = json!({ "spectra": { "weight": "LED-blue-450" } });
    let means = averages(&scene(json!(1), blue));
    assert!((means[0] - 0.25).abs() < 0.003, "{means:?}");

    for (power, problem) in [
        (
            named("LED-B33"),
            "no file LED-B33, and no spectrum at hand of this name; did you mean `LED-B3`?",
        ),
        (
            json!({ "spectrum": "D65", "total": 1, "unit": "photons" }),
            "/lights/0/power/unit: the spectrum `D65` is at hand and has no unit to choose",
        ),
    ] {
        let error = load(&write(&with(power)).path("scene.json")).expect_err("refused").to_string();
        assert!(error.contains(problem), "{error}");
    }
}
