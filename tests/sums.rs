//! Sums over bands with weights, and ratios of sums with their errors.

use phylux::{
    RunResult, Settings,
    results::ByLight,
    transport::{PhotonCount, ThreadCount},
};
use serde_json::{Value, json};

use crate::{
    bad_input::phylux,
    common::{TestScene, run_file},
};

/// A reflecting plate of 1 m2 with sensors over it, under two lamps of different colours.
fn scene(quantity: &str, change: impl FnOnce(&mut Value)) -> TestScene {
    let mut scene = json!({
        "name": "colours", "quantity": quantity,
        "bands": [
            { "name": "B", "from_nm": 400, "to_nm": 500 }, { "name": "G", "from_nm": 500, "to_nm": 600 },
            { "name": "R", "from_nm": 600, "to_nm": 700 }, { "name": "FR", "from_nm": 700, "to_nm": 800 }
        ],
        "sums": { "PAR": ["B", "G", "R"], "lux": "photopic", "YPFD": "YPF", "mine": { "B": 0.5, "R": 2 } },
        "ratios": {
            "R:FR": "R:FR-broad", "blue": "blue-share", "PSS": "PSS",
            "B:R": { "numerator": "B", "denominator": ["R"] },
            "lux/PAR": { "numerator": "lux", "denominator": "PAR" }
        },
        "materials": { "grey": { "type": "lambert", "reflectance": [0.1, 0.3, 0.1, 0.6] } },
        "objects": [{ "name": "plate", "obj": "plate.obj", "material": "grey", "captor": true }],
        "lights": [
            { "name": "red", "type": "point", "position": [0.1, 0.2, 0.6], "power": [30, 10, 100, 5] },
            { "name": "white", "type": "point", "position": [0.6, 0.4, 0.8], "power": [30, 40, 30, 50] }
        ],
        "captors": [{ "name": "s", "grid": { "x": [0, 1], "y": [0, 1], "nx": 2, "ny": 1, "z": 0.2, "radius": 0.2 },
                      "sides": "both" }],
        "settings": { "photons": 4096, "k": 0, "guiding": "off" }
    });
    change(&mut scene);
    TestScene::new(
        &scene.to_string(),
        &[("plate.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n")],
    )
}

fn run(scene: &TestScene, change: impl FnOnce(&mut Settings)) -> RunResult {
    run_file(&scene.path("scene.json"), change)
}

fn error_of(change: impl FnOnce(&mut Value)) -> String {
    let scene = scene("umol/s", change);
    let output = phylux(&scene.path(""), &["check", "scene.json"]);
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Every weighted sum and every ratio follows from the bands, in W and in umol/s, on captors,
/// groups, absorbed power and energy.
#[test]
fn sums_and_ratios_are_those_of_the_bands() {
    for quantity in ["W", "umol/s"] {
        let result = run(&scene(quantity, |_| ()), |_| ());
        // in the order of the file: the first sum is what plots and pages show first
        let names: Vec<&str> = result.bands.iter().map(|band| band.name.as_str()).collect();
        assert_eq!(names, ["B", "G", "R", "FR", "PAR", "lux", "YPFD", "mine"]);
        let ratios: Vec<&str> = result.ratios.iter().map(|ratio| ratio.name.as_str()).collect();
        assert_eq!(ratios, ["R:FR", "blue", "PSS", "B:R", "lux/PAR"]);
        let of = |weights: &[f64], values: &[f64]| -> f64 {
            weights.iter().zip(values).map(|(weight, value)| weight * value).sum()
        };
        let weights: Vec<(usize, Vec<f64>)> = (4..result.bands.len())
            .map(|b| {
                let mut weights = vec![0.0; 4];
                result.bands[b].members(&result.bands).for_each(|(b, weight)| weights[b] = weight);
                (b, weights)
            })
            .collect();
        let mine = result.bands.iter().find(|band| band.name == "mine").expect("a sum");
        assert_eq!(mine.weights.as_deref(), Some(&[0.5, 2.0][..]));
        let check = |values: &[f64]| {
            for (b, weights) in &weights {
                let expected = of(weights, values);
                assert!((values[*b] - expected).abs() <= 1e-12 * expected.abs(), "{quantity} {b}");
            }
        };
        check(&result.energy.power);
        check(&result.energy.absorbed);
        let faces = result.captors.iter().flat_map(|captor| captor.faces());
        for face in faces.chain(result.groups.iter().map(|group| &group.front)) {
            check(&face.flux);
            for (r, ratio) in result.ratios.iter().enumerate() {
                let expected =
                    of(&ratio.numerator, &face.flux) / of(&ratio.denominator, &face.flux);
                let found = face.ratios.as_ref().expect("ratios").get(r).map(|(value, _)| value);
                match found {
                    Some(found) => {
                        assert!((found / expected - 1.0).abs() < 1e-12, "{}", ratio.name)
                    }
                    None => assert_eq!(face.photons, 0),
                }
            }
        }
        let plate = &result.captors.iter().find(|c| c.kind == "surface").expect("the plate");
        let absorbed = plate.absorbed.as_ref().expect("absorbed");
        let blue = plate.absorbed_ratios.as_ref().expect("ratios").get(3).expect("a ratio").0;
        assert!((blue * absorbed[2] / absorbed[0] - 1.0).abs() < 1e-12, "B:R is the fourth");
    }
}

/// The power of a lamp that is given in lumens comes back as lumens, and its photons in umol/s, from
/// 400 bands of 1 nm in W.
#[test]
fn a_lamp_of_known_lumens_has_them() {
    let bands: Vec<Value> = (380..780)
        .map(|nm| json!({ "name": format!("{nm}"), "from_nm": nm, "to_nm": nm + 1 }))
        .collect();
    for quantity in ["W", "umol/s"] {
        let scene = scene(quantity, |scene| {
            scene["bands"] = json!(bands);
            scene["sums"] =
                json!({ "lm": "photopic", "PPF": "PPF", "all": { "from_nm": 380, "to_nm": 780 } });
            scene["ratios"] = json!({});
            scene["materials"]["grey"]["reflectance"] = json!(0.5);
            scene["lights"] = json!([{ "name": "lamp", "type": "point", "position": [0, 0, 1],
                "power": { "spectrum": "LED-B3", "total": 1000, "quantity": "lm" } }]);
        });
        let output = phylux(&scene.path(""), &["check", "scene.json", "--json"]);
        let checked: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let sums = &checked["lights"][0]["sums"];
        let lumens = sums["lm"].as_f64().expect("a number");
        assert!((lumens / 1000.0 - 1.0).abs() < 1e-4, "{quantity}: {lumens}");
        // the same lamp by its photons
        let photons = sums["all"].as_f64().expect("a number");
        let ppf = sums["PPF"].as_f64().expect("a number");
        assert!(photons > ppf && ppf > 10.0 && photons < 20.0, "{photons} {ppf}");
    }
}

/// Errors of ratios against the spread of 200 runs of 4096 photons (seeds 1 to 200), as they are,
/// after a mix, and after a mix by bands: the root mean square of deviations over errors is 1 with a
/// standard deviation of 0.05; 0.8 to 1.2 is allowed. In the mix by bands the errors of ratios of
/// more bands than one over another are upper bounds, so there it may be lower, to 0.5.
#[test]
fn errors_of_ratios_are_the_spread_of_seeds() {
    let scene = scene("umol/s", |_| ());
    let factors: ByLight<f64> = [("red".to_string(), 0.3)].into_iter().collect();
    let by_bands = phylux::results::Factor::Bands(vec![0.5, 2.0, 0.3, 1.5]);
    let by_bands: ByLight<phylux::results::Factor> = [("red".to_string(), by_bands)].into();
    let mut found: Vec<[Vec<(f64, f64)>; 3]> = Vec::new();
    for seed in 1..=200 {
        let result = run(&scene, |settings| {
            (settings.seed, settings.by_light, settings.threads) =
                (seed, true, ThreadCount::nearest_to(1));
        });
        let all = |result: &RunResult| {
            let sensor = result.captors[0].front.ratios.clone().expect("ratios");
            let group = result.groups[0].front.ratios.clone().expect("ratios");
            let plate = result.captors.iter().find_map(|c| c.absorbed_ratios.clone());
            let each = [sensor, group, plate.expect("ratios")].into_iter().flat_map(|of| {
                (0..5).map(move |r| of.get(r).map(|(value, error)| (value, error.unwrap_or(0.0))))
            });
            each.map(|found| found.expect("a ratio")).collect::<Vec<_>>()
        };
        let mixes = [result.mix(&factors), result.mix_bands(&by_bands)];
        let [mixed, uneven] = mixes.map(|mix| all(&mix.expect("a mix")));
        found.push([all(&result), mixed, uneven]);
    }
    let n = found.len() as f64;
    for mixed in [0, 1, 2] {
        for i in 0..found[0][mixed].len() {
            let values = || found.iter().map(move |run| run[mixed][i]);
            let mean = values().map(|(value, _)| value).sum::<f64>() / n;
            let squares = values().map(|(value, error)| ((value - mean) / error).powi(2));
            let rms = (squares.sum::<f64>() / n).sqrt();
            // R:FR, blue, PSS, B:R, lux/PAR
            let exact = mixed < 2 || [0, 3].contains(&(i % 5));
            let least = if exact { 0.8 } else { 0.5 };
            assert!((least..1.2).contains(&rms), "ratio {i}, mixed {mixed}: {rms}");
        }
    }
}

/// A mix in which nothing changes has the ratios of the run, with their errors. Mixes by bands have
/// errors, too: those of one factor if the factors are equal, and never smaller ones after a way
/// through other factors and back.
#[test]
fn mixes_have_ratios() {
    let scene = scene("umol/s", |_| ());
    let result = run(&scene, |settings| settings.by_light = true);
    let mix = |result: &RunResult, factors: [f64; 4]| {
        let factors = phylux::results::Factor::Bands(factors.into());
        result.mix_bands(&[("red".to_string(), factors)].into()).expect("a mix")
    };
    let one: ByLight<f64> = [("red".to_string(), 3.0)].into();
    let [even, by_bands] = [result.mix(&one).expect("a mix"), mix(&result, [3.0; 4])];
    let same = mix(&result, [1.0; 4]);
    let uneven = mix(&result, [1.0, 4.0, 2.0, 1.0]);
    let back = mix(&uneven, [1.0, 0.25, 0.5, 1.0]);
    let ratios = |result: &RunResult| -> Vec<phylux::results::Ratios> {
        let faces = result.captors.iter().flat_map(|captor| captor.faces());
        let on_faces = faces.filter(|face| face.photons > 0).map(|face| face.ratios.clone());
        let absorbed = result.captors.iter().filter(|captor| captor.absorbed.is_some());
        let all = on_faces.chain(absorbed.map(|captor| captor.absorbed_ratios.clone()));
        all.map(|ratios| *ratios.expect("ratios")).collect()
    };
    assert_eq!(ratios(&even), ratios(&by_bands));
    let all = [&result, &same, &uneven, &back].map(ratios);
    assert!(all[0].len() > 3);
    let places = (0..all[0].len()).flat_map(|i| (0..result.ratios.len()).map(move |r| (i, r)));
    for (i, r) in places {
        let [(a, a_se), (b, b_se), (c, c_se), (d, d_se)] = [0, 1, 2, 3].map(|of| {
            let (value, error) = all[of][i].get(r).expect("a ratio");
            (value, error.expect("an error"))
        });
        assert!((a / b - 1.0).abs() < 1e-12 && (a / d - 1.0).abs() < 1e-12, "{a} {b} {d}");
        // lights are strata; and the run knows how few histories there are
        assert!(b_se < 1.3 * a_se, "{b_se} {a_se}");
        assert!(d_se > b_se * (1.0 - 1e-9) && c_se > 0.0, "{b_se} {d_se}");
        let name = result.ratios[r].name.as_str();
        assert!(c != a || !["B:R", "R:FR"].contains(&name));
    }
}

/// The same bytes on 1 and on 3 threads, and from two shards.
#[test]
fn threads_and_shards_change_no_byte() {
    let scene = scene("W", |_| ());
    let folder = scene.path("");
    let read = |name: &str| std::fs::read(scene.path(name)).expect("results");
    for arguments in [
        "run scene.json --threads 1 -o a.json --quiet",
        "run scene.json --threads 3 -o b.json --quiet",
        "run scene.json --shard 1/2 -o 1.shard --quiet",
        "run scene.json --shard 2/2 -o 2.shard --quiet",
        "merge 1.shard 2.shard -o c.json --quiet",
    ] {
        let output = phylux(&folder, &arguments.split(' ').collect::<Vec<_>>());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    assert!(read("a.json") == read("b.json") && read("a.json") == read("c.json"));
}

/// Paths find the ratios that photons find, within 4 combined errors (fixed seeds).
#[test]
fn paths_have_ratios_too() {
    let scene = scene("umol/s", |_| ());
    let photons = run(&scene, |settings| settings.photons = PhotonCount::new(100_000).ok());
    let paths = run(&scene, |settings| {
        (settings.photons, settings.estimator) =
            (PhotonCount::new(20_000).ok(), phylux::Estimator::Paths);
    });
    for r in 0..photons.ratios.len() {
        let of = |result: &RunResult| {
            let (value, error) =
                result.groups[0].front.ratios.as_ref().and_then(|all| all.get(r)).expect("a ratio");
            (value, error.expect("an error"))
        };
        let ((a, a_se), (b, b_se)) = (of(&photons), of(&paths));
        assert!((a - b).abs() < 4.0 * a_se.hypot(b_se), "{}: {a} {b}", photons.ratios[r].name);
    }
}

/// Weighted sums of a flat spectrum have their closed forms, within 1e-6: 1 W at the wavelength w,
/// nm, is w / 119.6265656 umol/s (N_A h c = 0.11962656 J m / mol), and so from a to b nm a flat lamp
/// has (b^2 - a^2) / 2 / 119.6265656 umol/s for each W per nm.
#[test]
fn weighted_sums_of_a_flat_spectrum_are_exact() {
    let bands: Vec<Value> =
        [[350, 400], [400, 500], [500, 600], [600, 640], [640, 700], [700, 750]]
            .iter()
            .map(|[from, to]| json!({ "name": format!("{from}"), "from_nm": from, "to_nm": to }))
            .collect();
    let photons = |from: f64, to: f64| (to * to - from * from) / 2.0 / 119.626_565_6;
    for quantity in ["W", "umol/s"] {
        let scene = scene(quantity, |scene| {
            scene["bands"] = json!(bands);
            scene["sums"] = json!({ "PPF": "PPF", "ePAR": "ePAR", "red": { "from_nm": 600, "to_nm": 700 },
                "watts": { "from_nm": 410, "to_nm": 690, "quantity": "W" } });
            scene["ratios"] = json!({});
            scene["materials"]["grey"]["reflectance"] = json!(0.5);
            scene["lights"] = json!([{ "name": "lamp", "type": "point", "position": [0, 0, 1],
                "power": { "spectrum": "flat.csv", "unit": "energy", "total": 400, "quantity": "W",
                    "from_nm": 350, "to_nm": 750 } }]);
        });
        std::fs::write(scene.path("flat.csv"), "nm,W\n350,1\n750,1\n").expect("a file");
        let output = phylux(&scene.path(""), &["check", "scene.json", "--json"]);
        let checked: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let sums = &checked["lights"][0]["sums"];
        for (name, from, to) in
            [("PPF", 400.0, 700.0), ("ePAR", 400.0, 750.0), ("red", 600.0, 700.0)]
        {
            let found = sums[name].as_f64().expect("a number") / photons(from, to);
            assert!((found - 1.0).abs() < 1e-6, "{quantity} {name}: {found}");
        }
        // the ends of the window cut bands, which are flat in the scene's quantity
        let part = |from: f64, to: f64, low: f64, high: f64| match quantity {
            "W" => high - low,
            _ => (to * to - from * from) / 2.0 / (to - from) * (high / low).ln(),
        };
        let exact = part(400.0, 500.0, 410.0, 500.0)
            + part(500.0, 600.0, 500.0, 600.0)
            + part(600.0, 640.0, 600.0, 640.0)
            + part(640.0, 700.0, 640.0, 690.0);
        let found = sums["watts"].as_f64().expect("a number") / exact;
        assert!((found - 1.0).abs() < 1e-6, "{quantity} W: {found}");
    }
}

/// Daily light integrals of sums of photons, also where the scene counts W; lumens have none.
#[test]
fn sums_of_photons_have_daily_light_integrals() {
    for (quantity, plain) in [("umol/s", true), ("W", false)] {
        let scene = scene(quantity, |scene| {
            scene["site"] = json!({ "latitude": 43, "longitude": 4 });
            scene["time"] = json!({ "from": "2025-06-21T00:00Z", "to": "2025-06-22T00:00Z" });
            scene["weather"] = json!({ "direct_normal": 500, "diffuse_horizontal": 100 });
            scene["lights"] = json!([{ "type": "sky" }]);
            // weights ask for a sum that reaches beyond 400 to 700 nm
            scene["sums"]["wide"] = json!({ "R": 1, "FR": 0.5 });
        });
        let output =
            phylux(&scene.path(""), &["run", "scene.json", "--photons", "2000", "--quiet"]);
        if !output.status.success() {
            // a period needs a weather file
            let error = String::from_utf8_lossy(&output.stderr).into_owned();
            assert!(error.contains("weather"), "{error}");
            let mut text = "time,ghi,dni,dhi\n".to_string();
            (0..24).for_each(|h| text += &format!("2025-06-21T{h:02}:00Z,300,0,300\n"));
            std::fs::write(scene.path("w.csv"), text).expect("a file");
            let mut file: Value =
                serde_json::from_slice(&std::fs::read(scene.path("scene.json")).expect("a scene"))
                    .expect("JSON");
            file["weather"] = json!({ "file": "w.csv", "stamp": "start" });
            std::fs::write(scene.path("scene.json"), file.to_string()).expect("a file");
        }
        let result = run(&scene, |settings| settings.photons = PhotonCount::new(2000).ok());
        let face = &result.groups[0].front;
        let dli = face.dli.as_ref().expect("daily light integrals");
        for (b, band) in result.bands.iter().enumerate() {
            let has = match band.name.as_str() {
                "YPFD" => true,
                "lux" | "FR" => false,
                _ => plain,
            };
            let expected = has.then_some(0.0864 * face.irradiance[b]);
            match (dli[b], expected) {
                (Some(found), Some(expected)) => assert!((found / expected - 1.0).abs() < 1e-12),
                (found, expected) => assert_eq!(found, expected, "{quantity} {}", band.name),
            }
        }
    }
}

/// A table of ratios is there for sweeps of scenes with ratios, and for no others.
#[test]
fn sweeps_have_a_table_of_ratios() {
    for ratios in [true, false] {
        let scene = scene("umol/s", |scene| {
            if !ratios {
                scene["ratios"] = json!({});
            }
        });
        let sweep = json!({ "scene": "scene.json", "vary": { "/lights/0/power/3": [5, 50] } });
        std::fs::write(scene.path("s.json"), sweep.to_string()).expect("a file");
        let output = phylux(
            &scene.path(""),
            &["sweep", "s.json", "-o", "out", "--photons", "2000", "--quiet"],
        );
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let table = std::fs::read_to_string(scene.path("out/ratios.csv"));
        assert_eq!(table.is_ok(), ratios);
        let Ok(table) = table else { continue };
        let head = "run,/lights/0/power/3,seed,captor,face,ratio,value,standard_error";
        assert_eq!(table.lines().next(), Some(head));
        let value = |run: &str| -> f64 {
            let line =
                table.lines().find(|line| line.starts_with(run) && line.contains(",s,front,R:FR,"));
            line.expect("a row").split(',').nth(6).expect("a value").parse().expect("a number")
        };
        assert!(value("1,") > 1.5 * value("2,"), "{table}");
    }
}

/// Of many bands the tables on the screen show the first, and each sum.
#[test]
fn tables_show_the_sums_of_many_bands() {
    let bands: Vec<Value> = (0..12)
        .map(|i| json!({ "name": format!("b{i}"), "from_nm": 400 + 20 * i, "to_nm": 420 + 20 * i }))
        .collect();
    let names: Vec<Value> = bands.iter().map(|band| band["name"].clone()).collect();
    let scene = scene("umol/s", |s| {
        s["bands"] = bands.into();
        s["sums"] = json!({ "everything": names });
        s["materials"]["grey"]["reflectance"] = json!(0.3);
        s["lights"] = json!([{ "name": "lamp", "type": "point", "position": [0.5, 0.5, 0.8],
                               "power": vec![1; 12], "watts": 10 }]);
        s["layers"] = json!({ "dz": 0.5 });
        s.as_object_mut().expect("keys").remove("ratios");
    });
    let output = phylux(&scene.path(""), &["run", "scene.json"]);
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(said.lines().all(|line| line.chars().count() <= 80), "{said}");
    let heads: Vec<&str> = said.lines().filter(|line| line.contains(" everything")).collect();
    for title in
        ["light per electricity", "share of the light", "share of groups", "absorbed by layer"]
    {
        assert!(heads.iter().any(|head| head.contains(title)), "{title}: {said}");
    }
    assert!(!said.contains("b7 "), "{said}");
    // 12 umol/s of 10 W
    let mut all = said.lines().filter(|line| line.starts_with("  all  "));
    assert!(all.any(|line| line.ends_with(" 1.200")), "{said}");
}

/// What is wrong with a sum or ratio is said with its place and the cure; what depends on where in
/// a wide band the light is, is warned of.
#[test]
fn wrong_sums_are_refused() {
    type Change = fn(&mut Value);
    let cases: [(Change, &str); 18] = [
        (
            |s| s["sums"]["x"] = json!("photopc"),
            "/sums/x: no weighting `photopc`; did you mean `photopic`?",
        ),
        (|s| s["sums"]["x"] = json!("B"), "/sums/x: `B` is a band, not a weighting; write [\"B\"]"),
        (|s| s["sums"]["x"] = json!({}), "/sums/x: adds up no band; name its bands"),
        (|s| s["sums"]["x"] = json!({ "B": -1 }), "/sums/x/B: -1, must be from 0 to"),
        (|s| s["sums"]["x"] = json!({ "Bl": 1 }), "/sums/x/Bl: no band `Bl`"),
        (
            |s| s["sums"]["x"] = json!({ "B": "1" }),
            "the weight of `B` is not a number; write it as one",
        ),
        (
            |s| s["sums"]["x"] = json!({ "from_nm": 600, "to_nm": "700" }),
            "`to_nm` of the window is not a number; write it as one",
        ),
        (|s| s["sums"]["x"] = json!(3), "/sums/x"),
        (|s| s["sums"]["x"] = json!({ "weighting": "PPF" }), "`bands` is missing"),
        (
            |s| s["sums"]["x"] = json!({ "from_nm": 400, "to_nm": 500, "quantity": "lm" }),
            "a window of `lm`; there are W and umol/s",
        ),
        (|s| s["sums"]["x"] = json!({ "from_nm": 700, "to_nm": 600 }), "is not below to_nm"),
        (
            |s| s["sums"]["x"] = json!({ "from_nm": 900, "to_nm": 950 }),
            "/sums/x: no band has light from 900 to 950 nm",
        ),
        (|s| s["ratios"]["PAR"] = json!("PSS"), "/ratios/PAR: a sum has this name too"),
        (|s| s["ratios"]["x"] = json!("RFR"), "/ratios/x: no ratio `RFR`"),
        (|s| s["ratios"]["x"] = json!({ "numerator": "B" }), "/ratios/x"),
        (
            |s| s["ratios"]["x"] = json!({ "numerator": "B", "denominator": { "R": 0 } }),
            "/ratios/x: its denominator gives every band the weight 0",
        ),
        (
            |s| s["ratios"]["x"] = json!({ "numerator": "B", "denominator": "lus" }),
            "no band, sum or weighting `lus`; did you mean `lux`?",
        ),
        (|s| s["bands"][3] = json!({ "name": "FR" }), "the wavelengths of band `FR` are not known"),
    ];
    for (change, expected) in cases {
        let error = error_of(change);
        assert!(error.contains(expected) && error.starts_with("error: "), "{error}\n{expected}");
    }
    // what no band covers is said once, unless the bands are named
    let missing = |of: Value| {
        error_of(|s| {
            s["bands"][3]["from_nm"] = json!(728);
            s["sums"] = json!({ "x": of });
            s["ratios"] = json!({ "R:FR": "R:FR" });
        })
    };
    let said = missing(json!("ePAR"));
    // each is warned of once, whatever is in doubt about it
    let of_ratio =
        "and no band has 30 % of them, from 725 to 728 nm; use narrower bands, and add some";
    let of_sum =
        "and no band has 8 % of them, from 700 to 728 nm; use narrower bands, and add some";
    for place in ["/ratios/R:FR: `R:FR`: its weights", "/sums/x: `ePAR`: its weights"] {
        assert_eq!(said.matches(place).count(), 1, "{said}");
    }
    assert!(said.contains(of_ratio) && said.contains(of_sum), "{said}");
    let window = missing(json!({ "from_nm": 350, "to_nm": 450 }));
    assert!(window.contains("no band has 50 % of them, from 350 to 400 nm"), "{window}");
    let named = missing(json!({ "weighting": "ePAR", "bands": ["B", "R"] }));
    assert!(!named.contains("/sums/x"), "{named}");
    let overlap = error_of(|s| s["bands"][3]["from_nm"] = json!(650));
    assert!(overlap.contains("bands `R` and `FR` overlap"), "{overlap}");
    let wide = error_of(|_| ());
    assert!(wide.contains("/sums/lux: `photopic`: its weights change much"), "{wide}");
}
