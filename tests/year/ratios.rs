//! Ratios of the light of days, months and the whole period, and their errors.

use phylux::{
    formats::SkyDivision,
    scene::Channel,
    transport::{NearestCount, PhotonCount},
};
use serde_json::json;

use super::{UP, first_days, room_with_window, world, written, year};
use crate::{
    bad_input::phylux,
    common::{TestScene, run_file},
    world::{Mesh, front},
};

/// Returns a room whose walls reflect more far-red light than PAR, with a sensor far from the window.
fn room(seed: u64) -> TestScene {
    let world = world(first_days())
        .with("ratios", json!({ "R:FR": { "numerator": "PAR", "denominator": "far" } }))
        .with("settings", json!({ "seed": seed }))
        .material("wall", json!({ "type": "lambert", "reflectance": [0.3, 0.8] }))
        .surface("room", "wall", &room_with_window())
        .captor("far", &Mesh::square([2.0, 4.5, 0.8], UP, 1.6));
    written(&world)
}

/// The ratio of the whole period is that of a run over it. Its error counts that both sums rest on
/// the same photons: it is that of the spread of 12 seeds (the spread of 12 is itself known to some
/// 20 %), and much smaller than if they were independent.
#[test]
fn ratios_are_those_of_a_period_with_errors_of_their_spread() {
    let period = run_file(&room(1).path("scene.json"), |settings| {
        settings.estimator = phylux::Estimator::Paths;
        (settings.photons, settings.k) = (PhotonCount::new(200_000).ok(), Some(NearestCount::NONE));
    });
    let exact = front(&period, "far").ratios.clone().expect("ratios").get(0).expect("a ratio");
    let (mut values, mut errors, mut apart) = (Vec::new(), 0.0, 0.0);
    for seed in 1..=12 {
        let year = year(&room(seed), None, 20_000, SkyDivision::Tregenza);
        let [ratio] = &year.places.ratios[..] else { panic!("{:?}", year.places.ratios) };
        assert_eq!((ratio.name.as_str(), year.bands.len()), ("R:FR", 2));
        let whole = year.whole().expect("sums");
        let found = whole.ratio(0, Channel::Front, 0).expect("a ratio");
        assert!(whole.ratio(0, Channel::Absorbed, 0).is_none());
        // results of a period have it, too
        let result = year.result(None).expect("results");
        assert_eq!(result.ratios, year.places.ratios);
        let [far] = &result.captors[..] else { panic!("{} captors", result.captors.len()) };
        let own = far.front.ratios.clone().expect("ratios").get(0).expect("a ratio");
        assert_eq!(own, (found.mean, Some(found.variance.sqrt())));
        let [a, b] = [0, 1].map(|band| whole.light(0, Channel::Front, band).expect("light"));
        assert!((found.mean / (a.mean / b.mean) - 1.0).abs() < 1e-5);
        values.push(found.mean);
        errors += found.variance / 12.0;
        let relative = a.variance / a.mean.powi(2) + b.variance / b.mean.powi(2);
        apart += relative * found.mean.powi(2) / 12.0;
    }
    let mean = values.iter().sum::<f64>() / 12.0;
    let spread = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / 11.0;
    let se = (errors / 12.0).sqrt().hypot(exact.1.expect("an error"));
    assert!((mean - exact.0).abs() < 5.0 * se + 0.01 * exact.0, "{mean} {} {se}", exact.0);
    let ratio = (spread / errors).sqrt();
    assert!((0.4..2.0).contains(&ratio), "{ratio}: {spread} {errors}");
    assert!(errors < 0.7 * apart, "{errors} {apart}");
}

#[test]
fn the_table_of_ratios_has_days_months_and_all() {
    let scene = room(1);
    let line = ["year", "scene.json", "-o", "y", "--photons", "100000", "--csv"];
    let output = phylux(&scene.path(""), &line);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && !said.contains("ratio"), "{said}");
    let read = |name: &str| std::fs::read_to_string(scene.path("y").join(name)).expect("a table");
    let ratios = read("ratios.csv");
    let rows: Vec<Vec<&str>> = ratios.lines().map(|line| line.split(',').collect()).collect();
    let head = "captor,period,ratio,front,front_se,back,back_se,absorbed,absorbed_se";
    assert_eq!(rows[0].join(","), head);
    let periods: Vec<&str> = rows[1..].iter().map(|row| row[1]).collect();
    assert_eq!(periods, ["2025-06-20", "2025-06-21", "2025-06", "all"]);
    // the same as the quotient of the integrals; a sensor has no back
    for (row, days) in rows[1..3].iter().zip(["2025-06-20", "2025-06-21"]) {
        assert_eq!((row[0], row[2], row[5], row[7]), ("far", "R:FR", "", ""));
        let ratio: f64 = row[3].parse().expect("a ratio");
        let error: f64 = row[4].parse().expect("an error");
        assert!(ratio > 0.01 && error > 0.0 && error < 0.5 * ratio, "{days}: {ratio} +- {error}");
    }
    // each hour has its own, which stands beside the light that it is made of
    let (hours, light) = (read("hour-ratios.csv"), read("hours.csv"));
    let rows: Vec<Vec<&str>> = hours.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows[0].join(","), head.replace("period", "time"));
    let mut lit = 0;
    for (row, light) in rows[1..].iter().zip(light.lines().skip(1)) {
        let light: Vec<&str> = light.split(',').collect();
        assert_eq!((row[0], row[1], row[2]), (light[0], light[1], "R:FR"));
        let number = |cell: &str| cell.parse::<f64>().expect("a number");
        match number(light[4]) {
            0.0 => assert_eq!(row[3..5], ["", ""]),
            far => {
                let ratio = number(light[2]) / far;
                assert!((number(row[3]) / ratio - 1.0).abs() < 1e-5, "{row:?} {light:?}");
                assert!(number(row[4]) > 0.0 && number(row[4]) < ratio, "{row:?}");
                lit += 1;
            }
        }
    }
    assert!(lit > 20, "{lit} hours with light");
    // the sums that ratios are made of are in no table
    assert_eq!(read("hours.csv").lines().count(), 1 + 48);
    assert!(!read("days.csv").contains("numerator"));
}
