//! What leaves get by the hour: front, back, absorbed light and the sunlit share.

use phylux::{
    Settings,
    formats::SkyDivision,
    scene::Channel,
    studies::{HoursOf, Value, Values, Year, YearOptions},
    transport::PhotonCount,
};
use serde_json::json;

use super::{UP, find, south_room, sunny};
use crate::{
    bad_input::{phylux, refused},
    common::TestScene,
    world::{Mesh, World},
};

const ALL: [Channel; 3] = [Channel::Front, Channel::Back, Channel::Absorbed];

fn year(scene: &TestScene, photons: u64, options: &YearOptions) -> Year {
    let loaded = phylux::formats::load_by_hour(&scene.path("scene.json"), SkyDivision::Tregenza);
    let loaded = loaded.expect("a scene");
    let settings = Settings { photons: PhotonCount::new(photons).ok(), ..loaded.settings.clone() };
    find(loaded, options, &settings)
}

fn id(year: &Year, name: &str) -> usize {
    year.places.ids.iter().position(|id| id == name).unwrap_or_else(|| panic!("no {name}"))
}

fn light(values: &Values, id: usize) -> [f64; 3] {
    ALL.map(|channel| values.light(id, channel, 0).expect("a value").mean)
}

fn share(value: Option<Value>) -> f64 {
    value.expect("a sunlit share").mean
}

/// A leaf alone under the sun: the face that sees the sun gets 600 W/m2 times the cosine, whichever
/// face it is, and the leaf absorbs 1 - R - T of it. Hours in which the sun's disc lies in the plane
/// of the leaf are left out, so that chance is only in which of the suns of an hour, and where on its
/// disc, the rays of a point go.
#[test]
fn both_faces_of_a_leaf_see_the_sun() {
    let normal = [0.6, 0.0, 0.8];
    let scene = sunny(21..22)
        .material(
            "leaf",
            json!({ "type": "leaf", "ior": 1, "reflectance": 0.1, "transmittance": 0.3 }),
        )
        .material("black", json!({ "type": "lambert", "reflectance": 0 }))
        .counted("leaf", "leaf", &Mesh::square([0.0; 3], normal, 0.5))
        .counted("black", "black", &Mesh::square([0.0, 90.0, -40.0], [0.0, 0.0, -1.0], 0.5))
        .captor("sensor", &Mesh::square([0.0, -90.0, 90.0], UP, 0.5))
        .write();
    let year = year(&scene, 2000, &YearOptions::default());
    let loaded = phylux::formats::load_by_hour(&scene.path("scene.json"), SkyDivision::Tregenza);
    let hourly = loaded.expect("a scene").hourly.expect("hours");
    let [leaf, black, sensor] = ["leaf", "black", "sensor"].map(|name| id(&year, name));
    let (mut fronts, mut backs) = (0, 0);
    for (s, slot) in year.slots.iter().enumerate() {
        let values = year.hour(s).expect("an hour");
        let Some(hour) = slot.hour else {
            assert_eq!(light(&values, leaf), [0.0; 3]);
            assert!(values.sunlit(leaf).is_none() && !year.has_sun(s));
            continue;
        };
        let suns: Vec<_> = hourly.hours[hour].suns(hourly.north).collect();
        let normal = glam::DVec3::from(normal);
        if suns.iter().any(|(sun, _)| sun.dot(normal).abs() < 0.02 || sun.z < 0.02) {
            continue;
        }
        let on = |face: glam::DVec3| -> f64 {
            suns.iter().map(|(sun, light)| light * sun.dot(face).max(0.0)).sum()
        };
        let [front, back] = [normal, -normal].map(on);
        let expected = [front, back, 0.6 * (front + back)];
        for (found, expected) in light(&values, leaf).into_iter().zip(expected) {
            assert!((found - expected).abs() < 3.0, "hour {s}: {found}, not {expected}");
        }
        let expected = on(glam::DVec3::Z);
        let (is_front, is_back) = (front > back, back > front);
        let [front, back, absorbed] = light(&values, black);
        assert!(front == 0.0 && (absorbed - back).abs() < 1e-3, "{front}, {back}, {absorbed}");
        assert!((back - expected).abs() < 3.0, "hour {s}: {back}, not {expected}");
        assert_eq!([leaf, black, sensor].map(|id| share(values.sunlit(id))), [1.0; 3]);
        assert!(values.light(sensor, Channel::Back, 0).is_none());
        assert!(values.light(sensor, Channel::Absorbed, 0).is_none());
        (fronts, backs) = (fronts + usize::from(is_front), backs + usize::from(is_back));
    }
    assert!(fronts > 5 && backs > 1, "{fronts} fronts, {backs} backs");
    // the day is the sum of its hours
    let day = light(&year.day(0).expect("a day"), leaf);
    let hours = (0..24).map(|s| light(&year.hour(s).expect("an hour"), leaf)[2]);
    assert!((day[2] / (0.0036 * hours.sum::<f64>()) - 1.0).abs() < 1e-5);
}

pub fn leaves_in_a_room() -> World {
    let leaf = json!({ "type": "leaf", "ior": 1, "reflectance": 0.1, "transmittance": 0.3 });
    let small = Mesh::square([2.0, 1.0, 1.0], [0.0, -0.6, 0.8], 0.5);
    let large = Mesh::square([2.0, 3.0, 0.5], [0.8, 0.0, 0.6], 1.0);
    south_room(sunny(20..22), &[1.0])
        .material("leaf", leaf)
        .counted("small", "leaf", &small)
        .counted("large", "leaf", &large)
        .edited(|scene| {
            let objects = scene["objects"].as_array_mut().expect("objects");
            objects[1..].iter_mut().for_each(|object| object["group"] = json!("both"));
        })
}

/// In a room, in every hour and in all, a leaf absorbs 1 - R - T of what arrives on both faces, and a
/// group has the mean of its captors, by their areas, in all channels and in the sunlit share.
#[test]
fn leaves_absorb_and_groups_are_means() {
    let year = year(&leaves_in_a_room().write(), 100_000, &YearOptions::default());
    let [small, large, both] = ["small", "large", "both"].map(|name| id(&year, name));
    let all = (0..48).map(|s| year.hour(s).expect("an hour")).chain([year.whole().expect("all")]);
    let mut lit = 0;
    for values in all {
        let [a, b, group] = [small, large, both].map(|id| light(&values, id));
        for [front, back, absorbed] in [a, b, group] {
            let expected = 0.6 * (front + back);
            assert!((absorbed - expected).abs() <= 1e-4 * expected, "{absorbed}, not {expected}");
            lit += usize::from(front > 0.0 && back > 0.0);
        }
        for c in 0..3 {
            let mean = (0.25 * a[c] + b[c]) / 1.25;
            assert!((group[c] - mean).abs() <= 1e-4 * mean, "{}, not {mean}", group[c]);
        }
        if values.sunlit(small).is_some() {
            let [a, b, group] = [small, large, both].map(|id| share(values.sunlit(id)));
            assert!((group - (0.25 * a + b) / 1.25).abs() < 1e-5);
        }
    }
    assert!(lit > 10, "{lit}");
}

/// Under a comb of slats that hides half of the sky from any side, half of a leaf is sunlit: 1024
/// points an hour, 4 standard errors.
#[test]
fn half_of_a_leaf_below_slats_is_sunlit() {
    let slats = (0..200).map(|i| {
        let x = -5.0 + 0.05 * f64::from(i);
        Mesh::rectangle([x, -5.0, 0.002], [0.025, 0.0, 0.0], [0.0, 10.0, 0.0])
    });
    let slats = slats.fold(Mesh::default(), Mesh::and);
    let black = json!({ "type": "lambert", "reflectance": 0 });
    let scene = sunny(21..22)
        .material("black", black)
        .surface("slats", "black", &slats)
        .counted("leaf", "black", &Mesh::square([0.0; 3], UP, 1.0))
        .write();
    let options = YearOptions { sun_rays: Some(1024), ..YearOptions::default() };
    let year = year(&scene, 2000, &options);
    let leaf = id(&year, "leaf");
    let whole = year.whole().expect("all").sunlit(leaf).expect("a share");
    assert!(whole.variance.sqrt() < 0.01);
    assert!((whole.mean - 0.5).abs() < 4.0 * whole.variance.sqrt() + 0.002, "{}", whole.mean);
    let hours = (0..24).filter_map(|s| year.hour(s).expect("an hour").sunlit(leaf));
    let hours: Vec<f64> = hours.map(|share| share.mean).collect();
    assert!(hours.len() > 12 && hours.iter().all(|share| (share - 0.5).abs() < 0.08), "{hours:?}");
}

/// With two points an hour the sums of three days are as sure as their errors say, though an hour
/// alone is not: 30 leaves below a comb of wide slats, against 1024 points. The root mean square of
/// 30 deviations over their errors lies outside of 0.6 to 1.5 once in 10,000 cases.
#[test]
fn two_points_an_hour_are_enough_for_sums() {
    let slats = (0..20).map(|i| {
        let x = -5.0 + 0.5 * f64::from(i);
        Mesh::rectangle([x, -5.0, 0.4], [0.25, 0.0, 0.0], [0.0, 10.0, 0.0])
    });
    let black = json!({ "type": "lambert", "reflectance": 0 });
    let world = sunny(21..24).material("black", black).surface(
        "slats",
        "black",
        &slats.fold(Mesh::default(), Mesh::and),
    );
    let leaf = |i: u32| [0.31 * f64::from(i % 6) - 0.8, 0.37 * f64::from(i / 6) - 0.7, 0.0];
    let names: Vec<String> = (0..30).map(|i| format!("leaf{i}")).collect();
    let scene = names.iter().zip(0..).fold(world, |world, (name, i)| {
        world.counted(name, "black", &Mesh::square(leaf(i), UP, 0.2))
    });
    let scene = scene.write();
    let find = |points: u64| {
        let hours = HoursOf::None;
        year(&scene, 2000, &YearOptions { hours, sun_rays: Some(points), ..Default::default() })
    };
    let [few, many] = [2, 1024].map(find);
    assert_eq!([few.sun_rays, many.sun_rays], [2, 1024]);
    let whole = |year: &Year, name: &String| {
        let value = year.whole().expect("all").light(id(year, name), Channel::Front, 0);
        value.expect("a value")
    };
    let deviation = |name: &String| {
        let [few, many] = [&few, &many].map(|year| whole(year, name));
        (few.mean - many.mean).powi(2) / (few.variance + many.variance)
    };
    let squares: Vec<f64> = names.iter().map(deviation).collect();
    let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    assert!((0.6..1.5).contains(&rms), "{rms} of {squares:?}");
    let (value, truth) = (whole(&few, &names[7]), whole(&many, &names[7]));
    let [error, sure] = [value, truth].map(|value| value.variance.sqrt() / value.mean);
    assert!(error > 0.01 && error < 0.3 && sure < 0.2 * error, "{error} {sure}");
}

/// Hours are kept for those captors and groups that were asked for; sums are there for all, and the
/// same.
#[test]
fn hours_are_kept_for_those_that_were_asked_for() {
    let scene = leaves_in_a_room().write();
    let find =
        |hours: HoursOf| year(&scene, 2000, &YearOptions { hours, ..YearOptions::default() });
    let all = find(HoursOf::All);
    let names = |year: &Year| -> Vec<String> {
        year.with_hours().map(|id| year.places.ids[id].clone()).collect()
    };
    assert_eq!(names(&all), all.places.ids);
    for (hours, wanted) in [
        (HoursOf::Groups, &["small", "both", "large"][..]),
        (HoursOf::None, &[]),
        (HoursOf::Like("s0*".into()), &["s0"]),
        (HoursOf::Like("b*h".into()), &["both"]),
    ] {
        let some = find(hours);
        assert_eq!(names(&some), wanted);
        let sums = |year: &Year| {
            let values = year.whole().expect("all");
            year.places
                .ids
                .iter()
                .enumerate()
                .map(|(id, _)| values.light(id, Channel::Front, 0))
                .collect::<Vec<_>>()
        };
        assert_eq!(sums(&some), sums(&all));
        let (some_hour, hour) = (some.hour(12).expect("an hour"), all.hour(12).expect("an hour"));
        for id in 0..all.places.ids.len() {
            let kept = some_hour.light(id, Channel::Front, 0);
            assert_eq!(kept, hour.light(id, Channel::Front, 0).filter(|_| kept.is_some()));
            assert_eq!(kept.is_some(), wanted.contains(&all.places.ids[id].as_str()));
        }
    }
    let folder = scene.path("");
    let year = ["year", "scene.json", "-o", "out", "--photons", "2000"];
    refused(&folder, &[&year[..], &["--hours", "tulip*"]].concat(), &["no group like `tulip*`"]);
    refused(&folder, &[&year[..], &["--sun-rays", "1"]].concat(), &["must be 2 to 65536"]);
}

/// One, two and five threads write the same bytes, hours of both faces included.
#[test]
fn leaves_do_not_depend_on_threads() {
    let scene = leaves_in_a_room().write();
    let tables = |threads: &str| {
        let out = format!("out{threads}");
        let arguments =
            ["year", "scene.json", "-o", &out, "--photons", "3000", "--threads", threads];
        let done = phylux(&scene.path(""), &[&arguments[..], &["--csv"]].concat());
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        ["hours.csv", "days.csv", "year.csv"]
            .map(|name| std::fs::read_to_string(scene.path(&out).join(name)).expect("a table"))
    };
    let one = tables("1");
    let row = one[0].lines().find(|line| line.starts_with("small,2025-06-20T12:00")).expect("noon");
    assert!(row.split(',').all(|cell| !cell.is_empty()), "{row}");
    assert!(one[0].contains("s0,2025-06-20T00:00+00:00,0,0,,,,,,"));
    assert_eq!(one, tables("2"));
    assert_eq!(one, tables("5"));
}
