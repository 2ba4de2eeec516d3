//! What light costs and where it goes, and what surfaces absorb by face.

use phylux::{
    Estimator, RunResult, Settings,
    transport::{PhotonCount, ThreadCount},
};
use serde_json::{Value, json};

use crate::{
    bad_input::phylux,
    common::{TestScene, run_file},
};

/// Two plates of 1 m2, one over the other, in the light of two lamps between and over them.
fn scene(change: impl FnOnce(&mut Value)) -> TestScene {
    let plate = |name: &str, z: f64| {
        json!({ "name": name, "obj": "plate.obj", "material": name, "captor": true,
        "transform": { "translate": [0, 0, z] } })
    };
    let mut scene = json!({
        "name": "plates", "quantity": "umol/s",
        "bands": [{ "name": "B", "from_nm": 400, "to_nm": 500 }, { "name": "R", "from_nm": 600, "to_nm": 700 }],
        "sums": { "PPF": "PPF", "lm": "photopic" },
        "materials": {
            "floor": { "type": "lambert", "reflectance": [0.1, 0.2] },
            "leaf": { "type": "leaf", "reflectance": [0.1, 0.1], "transmittance": [0.1, 0.3] }
        },
        "objects": [plate("floor", 0.0), plate("leaf", 0.5)],
        "lights": [
            { "name": "low", "type": "point", "position": [0.5, 0.5, 0.25], "power": [10, 30], "watts": 20 },
            { "name": "high", "type": "point", "position": [0.3, 0.5, 1], "power": [20, 20], "watts": 30 }
        ],
        "captors": [{ "name": "s", "disc": { "center": [0.5, 0.5, 0.1], "normal": [0, 0, 1], "radius": 0.1 } }],
        "settings": { "photons": 20_000, "k": 0, "guiding": "off" },
        "absorbed_by_face": true
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

fn close(a: f64, b: f64) {
    assert!((a - b).abs() <= 1e-9 * a.abs().max(b.abs()), "{a} and {b}");
}

/// What is absorbed of the light on each face adds up to what is absorbed, by photons (also by
/// light, mixed, and guided) and by paths, on captors and groups.
#[test]
fn faces_add_up_to_what_is_absorbed() {
    let scene = scene(|_| ());
    let whole = run(&scene, |settings| settings.by_light = true);
    let dim = whole.mix(&[("low".to_string(), 0.5)].into_iter().collect()).expect("a mix");
    let paths = run(&scene, |settings| settings.estimator = Estimator::Paths);
    let guided = run(&scene, |settings| settings.guiding = phylux::Guiding::Full);
    for result in [&whole, &dim, &paths, &guided] {
        let captors = result.captors.iter().map(|c| (&c.absorbed, &c.absorbed_by_face));
        let groups = result.groups.iter().map(|g| (&g.absorbed, &g.absorbed_by_face));
        let mut surfaces = 0;
        for (absorbed, faces) in captors.chain(groups) {
            let (Some(absorbed), Some(faces)) = (absorbed, faces) else {
                assert!(absorbed.is_none() && faces.is_none());
                continue;
            };
            surfaces += 1;
            for (b, absorbed) in absorbed.iter().enumerate() {
                close(faces.front[b] + faces.back[b], *absorbed);
                assert_eq!(faces.front_se[b].is_some(), faces.front[b] != 0.0);
            }
        }
        assert_eq!(surfaces, 4);
    }
    // of what arrives on a face, the share 1 - R - T is absorbed
    let leaf = whole.captors.iter().find(|c| c.id.starts_with("leaf")).expect("the leaf");
    let faces = leaf.absorbed_by_face.as_ref().expect("faces");
    let back = leaf.back.as_ref().expect("a back");
    for (found, arrived) in [(&faces.front, &leaf.front.flux), (&faces.back, &back.flux)] {
        for (b, least) in [(0, 0.7), (1, 0.5)] {
            let share = found[b] / arrived[b];
            assert!((least..0.9).contains(&share), "{share}");
        }
    }
    // 4 combined standard errors (fixed seeds)
    for (c, captor) in paths.captors.iter().enumerate() {
        let (Some(a), Some(b)) = (&captor.absorbed_by_face, &whole.captors[c].absorbed_by_face)
        else {
            continue;
        };
        for band in 0..2 {
            let error = a.back_se[band].unwrap_or(0.0).hypot(b.back_se[band].unwrap_or(0.0));
            assert!((a.back[band] - b.back[band]).abs() <= 4.0 * error, "{}", captor.id);
        }
    }
}

/// Efficacies are those of the powers, shares add up to 1 and are those of the energy balance, and
/// 1 umol/J is 3.6 mol/kWh; by photons, guided ones, and in part by paths.
#[test]
fn light_has_its_price() {
    let scene = scene(|_| ());
    for (paths, guiding) in [(false, "off"), (false, "full"), (true, "off")] {
        let result = run(&scene, |settings| {
            if paths {
                settings.estimator = Estimator::Paths;
            }
            if guiding == "full" {
                settings.guiding = phylux::Guiding::Full;
            }
        });
        let found = result.account.electricity.as_ref().expect("electricity");
        assert_eq!(found.unit, ["umol/J", "umol/J", "umol/J", "lm/W"]);
        assert_eq!((found.watts, found.lights["low"].watts), (50.0, 20.0));
        close(found.per_watt[2], 80.0 / 50.0);
        close(found.lights["low"].per_watt[2], 2.0);
        let plants = &found.groups.as_ref().expect("groups")["leaf"];
        let absorbed = result.groups.iter().find(|g| g.id == "leaf").expect("leaf");
        let absorbed = absorbed.absorbed.as_ref().expect("absorbed");
        close(plants.mol_per_kwh[2].expect("mol/kWh"), 3.6 * absorbed[2] / 50.0);
        close(plants.share.share[2].expect("a share"), absorbed[2] / 80.0);
        assert!(plants.mol_per_kwh[3].is_none() && plants.of == "absorbed");
        assert_eq!(found.groups.as_ref().expect("groups")["s"].of, "front");
        assert_eq!(found.shares.is_none(), paths);
        let Some(shares) = &found.shares else { continue };
        assert_eq!(shares.chance.is_some(), result.energy.chance.is_some());
        for b in 0..4 {
            let sum = |of: fn(&phylux::results::Share) -> &Vec<Option<f64>>| {
                shares.all().map(|(_, share)| of(share)[b].expect("a number")).sum::<f64>()
            };
            close(sum(|share| &share.share), 1.0);
            let outside = shares.outside.share[b].expect("a share");
            close(outside, result.energy.escaped[b] / result.energy.power[b]);
            let error = shares.outside.share_se[b].expect("an error");
            assert!(error > 0.0 && error < 0.05, "{error}");
        }
    }
}

/// The error of the outside's share against the spread of 100 runs of 2000 photons (seeds 1 to 100):
/// the root mean square of deviations over errors is 1 with a standard deviation of 0.07; 0.75 to
/// 1.25 is allowed.
#[test]
fn errors_of_shares_are_the_spread_of_seeds() {
    let scene = scene(|_| ());
    let found: Vec<[(f64, f64); 2]> = (1..=100)
        .map(|seed| {
            let result = run(&scene, |settings| {
                (settings.photons, settings.seed, settings.threads) =
                    (PhotonCount::new(2000).ok(), seed, ThreadCount::nearest_to(1));
            });
            let shares = result.account.electricity.expect("electricity").shares.expect("shares");
            [&shares.outside, &shares.absorbed_by["leaf"]]
                .map(|of| (of.share[2].expect("a share"), of.share_se[2].expect("an error")))
        })
        .collect();
    for i in 0..2 {
        let mean = found.iter().map(|run| run[i].0).sum::<f64>() / 100.0;
        let squares = found.iter().map(|run| ((run[i].0 - mean) / run[i].1).powi(2));
        let rms = (squares.sum::<f64>() / 100.0).sqrt();
        assert!((0.75..1.25).contains(&rms), "{rms}");
    }
}

/// Where another light shines, nothing is said of shares unless results are kept by light; then it
/// is what the lamps alone would have.
#[test]
fn other_lights_do_not_mix_in() {
    let both = scene(|scene| {
        scene["lights"][1].as_object_mut().expect("a light").remove("watts");
    });
    let alone = scene(|scene| {
        scene["lights"][1]["power"] = json!(0);
        scene["lights"][1].as_object_mut().expect("a light").remove("watts");
    });
    let plain = run(&both, |_| ()).account.electricity.expect("electricity");
    assert!(plain.shares.is_none() && plain.groups.is_none() && plain.watts == 20.0);
    let split = run(&both, |settings| settings.by_light = true);
    let split = split.account.electricity.expect("electricity").shares.expect("shares");
    let alone =
        run(&alone, |_| ()).account.electricity.expect("electricity").shares.expect("shares");
    for b in 0..2 {
        let [(a, a_se), (c, c_se)] = [&split, &alone].map(|shares| {
            let of = &shares.absorbed_by["floor"];
            (of.share[b].expect("a share"), of.share_se[b].expect("an error"))
        });
        assert!((a - c).abs() < 4.0 * a_se.hypot(c_se), "{a} {c}");
    }
}

/// A grid under a lamp of 100 umol/s and 40 W, which shines down with a cosine lobe: a point of the
/// floor at the distance r from its foot gets P h^2 / (pi (h^2 + r^2)^2), and the square of side 2
/// under it P times the form factor F of the square. The plane of the sensors has 3.6 * P * F / 40
/// mol/kWh, where the mean of the middles of the cells stands for F (the 12 x 12 cells are small:
/// 0.2 %). It is the same for a part of the grid by its own cells, however far apart these are.
#[test]
fn a_grid_stands_for_its_plane() {
    let scene = TestScene::new(
        &json!({
            "quantity": "umol/s",
            "lights": [{ "name": "lamp", "type": "area", "two_sided": false, "power": 100, "watts": 40,
                "vertices": [[-0.005, -0.005, 1], [-0.005, 0.005, 1], [0.005, 0.005, 1], [0.005, -0.005, 1]] }],
            "captors": [
                { "name": "bench", "grid":
                    { "x": [-1, 1], "y": [-1, 1], "nx": 12, "ny": 12, "z": 0, "radius": 0.02 } },
                { "name": "one", "disc": { "center": [0, 0, 0.2], "normal": [0, 0, 1], "radius": 0.02 } },
                { "name": "uneven", "obj": "uneven.obj" }
            ],
            "groups": { "corner": ["bench/0-0", "bench/11-0", "bench/0-11", "bench/11-11"] },
            "settings": { "photons": 200_000, "k": 0, "estimator": "paths" }
        })
        .to_string(),
        // two sensors in one plane that are not equal
        &[(
            "uneven.obj",
            "v 0 0 0.3\nv 1 0 0.3\nv 0 1 0.3\nv 3 0 0.3\nv 5 0 0.3\nv 3 1 0.3\ng a\nf 1 2 3\ng b\nf 4 5 6\n",
        )],
    );
    let result = run(&scene, |_| ());
    let found = result.account.electricity.as_ref().expect("electricity");
    assert_eq!(found.grown.mol_per_kwh, [Some(9.0)]);
    assert_eq!(found.lights["lamp"].grown.kwh_per_mol, [Some(1.0 / 9.0)]);
    let groups = found.groups.as_ref().expect("groups");
    assert!(["one", "uneven"].iter().all(|name| groups[*name].plane.is_none()));

    let at = |x: f64, y: f64| 1.0 / (std::f64::consts::PI * (1.0 + x * x + y * y).powi(2));
    let middles = || (0..12).map(|i| (f64::from(i) + 0.5) / 6.0 - 1.0);
    let mean = middles().flat_map(|x| middles().map(move |y| at(x, y))).sum::<f64>() / 144.0;
    // the form factor of a square of half side 1 from its middle, at the distance 1
    let exact = 4.0 * (0.5_f64.sqrt() * 0.5_f64.sqrt().atan()) / std::f64::consts::PI;
    assert!((4.0 * mean / exact - 1.0).abs() < 2e-3, "{} {exact}", 4.0 * mean);
    let plane = groups["bench"].plane.as_ref().expect("a plane");
    let corner = groups["corner"].plane.as_ref().expect("a plane");
    close(plane.area, 4.0);
    close(corner.area, 4.0 / 36.0);
    for (plane, share) in [(plane, 4.0 * mean), (corner, at(11.0 / 12.0, 11.0 / 12.0) / 9.0)] {
        let number = |of: &[Option<f64>]| of[0].expect("a number");
        let (mol, error) = (number(&plane.mol_per_kwh), number(&plane.mol_per_kwh_se));
        // 4 standard errors (fixed seed), and what discs are not points
        assert!((mol - 9.0 * share).abs() < 4.0 * error + 1e-3 * mol, "{mol} +- {error}: {share}");
        assert!(error < 0.01 * mol, "{error} of {mol}");
        close(number(&plane.share.share), mol / 9.0);
        close(number(&plane.kwh_per_mol), 1.0 / mol);
        close(number(&plane.kwh_per_mol_se), error / (mol * mol));
    }
}

/// The table has rows for all of it, and the summary tells it; a wrong number of watts is refused.
#[test]
fn it_is_told_and_written() {
    let scene = scene(|scene| {
        let grid = json!({ "x": [0, 1], "y": [0, 1], "nx": 2, "ny": 3, "z": 0.2, "radius": 0.05 });
        let captors = scene["captors"].as_array_mut().expect("captors");
        captors.push(json!({ "name": "grid", "grid": grid }));
    });
    let output = phylux(&scene.path(""), &["run", "scene.json", "--csv", "r.csv", "-o", "r.json"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    for word in [
        "light per electricity",
        "share of the light",
        "outside",
        "mol/kWh",
        "kWh/mol",
        "grid, share of 1.000 m2",
        "leaf, absorbed",
    ] {
        assert!(text.contains(word), "{word}: {text}");
    }
    // what arrives on the discs of sensors is told if it is asked for
    assert!(!text.contains("grid, front"), "{text}");
    let full = phylux(&scene.path(""), &["run", "scene.json", "--full", "-o", "r.json"]);
    assert!(String::from_utf8_lossy(&full.stdout).contains("grid, front"));
    let table = std::fs::read_to_string(scene.path("r.csv")).expect("a table");
    for start in [
        "low,,PPF,per_watt,2,",
        "all lights,,PPF,per_watt,1.6,",
        "floor,,PPF,material_share,",
        "outside,,PPF,share,",
        "leaf,,PPF,group_share,",
        "leaf,,PPF,mol_per_kwh,",
        "grid,,PPF,plane_share,",
        "grid,,PPF,plane_mol_per_kwh,",
        "grid,,PPF,plane_kwh_per_mol,",
        "leaf/plate,back,PPF,absorbed_by_face,",
    ] {
        assert!(table.lines().any(|line| line.starts_with(start)), "{start}\n{table}");
    }
    let result = phylux::formats::read_json(&scene.path("r.json")).expect("results");
    assert!(result.account.electricity.is_some());
    for watts in ["0", "-1", "1e10"] {
        let wrong = self::scene(|scene| {
            scene["lights"][0]["watts"] = serde_json::from_str(watts).expect("a number");
        });
        let output = phylux(&wrong.path(""), &["check", "scene.json"]);
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(error.starts_with("error: scene.json: /lights/0/watts: "), "{error}");
    }
}
