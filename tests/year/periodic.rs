//! Years of scenes that repeat, and panels that turn to the sun.

use glam::DVec3;
use phylux::{
    formats::SkyDivision,
    math::Quantity,
    scene::{Channel, daylight},
    studies::{Year, YearOptions},
    transport::PhotonCount,
};
use serde_json::{Value, json};

use super::{first_days, states::find, sunny, world, written};
use crate::{
    bad_input::refused,
    common::TestScene,
    world::{Mesh, World},
};

fn id(year: &Year, name: &str) -> usize {
    year.places.ids.iter().position(|id| id == name).expect("an id")
}

/// Below black horizontal panels that cover a quarter of an endless field, the ground has three
/// quarters of the light in the open in every hour, wherever sun and sky stand, and the panels have
/// all of it. 29 hours, two bands and two places within 5 standard errors.
#[test]
fn below_endless_panels_is_what_they_leave_open() {
    let flat = |low: [f64; 3], x: f64, y: f64| Mesh::rectangle(low, [x, 0.0, 0.0], [0.0, y, 0.0]);
    let scene = written(
        &world(first_days())
            .with("periodic", json!({ "x": [0, 2], "y": [0, 3] }))
            .lambert("black", 0.0)
            .counted("panel", "black", &flat([0.3, 0.4, 2.0], 1.0, 1.5))
            .counted("ground", "black", &flat([0.0; 3], 2.0, 3.0)),
    );
    let loaded = phylux::formats::load_by_hour(&scene.path("scene.json"), SkyDivision::Tregenza);
    let loaded = loaded.expect("a scene");
    let settings =
        phylux::Settings { photons: PhotonCount::new(200_000).ok(), ..loaded.settings.clone() };
    let hours = loaded.hourly.as_ref().expect("hours").hours.clone();
    let year = super::find(
        loaded,
        &YearOptions { sun_rays: Some(256), ..YearOptions::default() },
        &settings,
    );
    let share = |source, from, to| {
        daylight::band_share(source, Quantity::Micromole, from, to).expect("a share")
    };
    let mut compared = 0;
    for (s, slot) in year.slots.iter().enumerate() {
        let Some(hour) = slot.hour.map(|h| hours[h]) else { continue };
        let values = year.hour(s).expect("an hour");
        for (b, (from, to)) in [(400.0, 700.0), (700.0, 800.0)].into_iter().enumerate() {
            let diffuse = hour.diffuse_horizontal;
            let open = share(daylight::DaylightSource::Sun, from, to) * (hour.global() - diffuse)
                + share(daylight::DaylightSource::Sky, from, to) * diffuse;
            for (name, factor) in [("panel", 1.0), ("ground", 0.75)] {
                let found = values.light(id(&year, name), Channel::Front, b).expect("a front");
                let (exact, error) = (factor * open, found.variance.sqrt());
                let off = (found.mean - exact).abs();
                assert!(off < 5.0 * error + 2e-3 * exact, "{s}, {name}: {found:?}, not {exact}");
                assert!(error < 0.06 * exact, "{s}, {name}: {error} of {exact}");
                compared += 1;
            }
        }
    }
    assert!(compared > 100, "{compared}");
}

/// A panel of 2 m, which fills a cell along y, in rows 5 m apart.
fn row() -> World {
    sunny(21..22)
        .with("periodic", json!({ "x": [0, 5], "y": [0, 1] }))
        .lambert("black", 0.0)
        .counted(
            "panel",
            "black",
            &Mesh::rectangle([-1.0, -0.5, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
        )
        .edited(|scene| {
            scene["objects"][0]["transform"] =
                json!({ "rotate_deg": [0, 0, 0], "translate": [2.5, 0.5, 2] });
        })
}

fn turned(scene: &TestScene, tracker: Value) -> Year {
    find(scene, &json!({ "trackers": [tracker] }), 40_000).unwrap_or_else(|e| panic!("{e}"))
}

/// A panel that turns about an axis to the north has, in every hour, the direct light times the sine
/// of the angle between the sun and the axis, within what rounding to 5 degrees and the limit of 60
/// degrees cost. Rows that turn back do not shade each other; rows that do not turn back do.
#[test]
fn panels_turn_to_the_sun() {
    let turn = "/objects/0/transform/rotate_deg/1";
    let alone = row().edited(|scene| {
        scene.as_object_mut().expect("a scene").remove("periodic");
    });
    let alone = alone.write();
    let year = turned(&alone, json!({ "turn": turn }));
    let loaded = phylux::formats::load_by_hour(&alone.path("scene.json"), SkyDivision::Tregenza);
    let hourly = loaded.expect("a scene").hourly.expect("hours");
    let mut compared = 0;
    for (s, slot) in year.slots.iter().enumerate() {
        let Some(hour) = slot.hour.map(|h| hourly.hours[h]) else { continue };
        let sun = hour.sun.direction(hourly.north);
        let ideal = sun.x.atan2(sun.z).to_degrees();
        let angle = (5.0 * (ideal / 5.0).round()).clamp(-60.0, 60.0).to_radians();
        let suns = hour.suns(hourly.north);
        let exact: f64 = suns
            .map(|(sun, light)| light * (angle.sin() * sun.x + angle.cos() * sun.z).max(0.0))
            .sum();
        let found = year.hour(s).expect("an hour").light(0, Channel::Front, 0).expect("a front");
        let off = (found.mean - exact).abs();
        assert!(off < 5.0 * found.variance.sqrt() + 0.1, "{s}: {found:?}, not {exact}");
        assert!(found.variance.sqrt() < 0.03 * exact + 0.1, "{s}: {found:?}");
        if ideal.abs() < 60.0 {
            let most = 600.0 * (1.0 - sun.y * sun.y).sqrt();
            assert!(
                found.mean > 0.99 * most && found.mean < 1.002 * most,
                "{s}: {found:?}, {most}"
            );
            compared += 1;
        }
    }
    assert!(compared > 8, "{compared}");
    let hours: f64 = year.states.iter().flat_map(|(_, shares)| shares).sum();
    assert!((hours - 24.0).abs() < 1e-9 && year.states.len() > 10, "{hours}");

    // rows of 10 minutes, in which the sun moves by 2.5 degrees
    let scene = row().write();
    let mut weather = String::from("time,ghi,dni,dhi\n");
    for row in 0..144 {
        let direct = if (24..120).contains(&row) { 600 } else { 0 };
        weather += &format!("2025-06-21T{:02}:{}0Z,,{direct},0\n", row / 6, row % 6);
    }
    std::fs::write(scene.path("w.csv"), weather).expect("weather");
    let sunlit = |tracker: Value| {
        let year = turned(&scene, tracker);
        let rows = (0..144).filter_map(|s| year.hour(s).expect("a row").sunlit(0));
        rows.map(|share| share.mean).collect::<Vec<f64>>()
    };
    let least = |hours: &[f64]| hours.iter().copied().fold(1.0, f64::min);
    let back = sunlit(json!({ "turn": [turn], "backtrack": 0.4, "limit_deg": 85 }));
    // a row stands as for the middle of that time: before and after it, while the sun is low, its edge
    // may be in the shade of the one before it
    let unshaded = back.iter().filter(|share| **share > 0.99).count();
    assert!(back.len() > 72 && least(&back) > 0.9 && unshaded > 80, "{back:?}");
    let straight = sunlit(json!({ "turn": turn, "limit_deg": 85 }));
    assert!(least(&straight) < 0.8, "{straight:?}");
}

#[test]
fn wrong_trackers_have_their_sentence() {
    let scene = row().write();
    let turn = "/objects/0/transform/rotate_deg/1";
    let arguments =
        ["year", "scene.json", "-o", "out", "--photons", "4000", "--control", "control.json"];
    for (tracker, words) in [
        (json!({ "turn": "/objects/0/name" }), "/trackers/0/turn: `/objects/0/name` is no angle"),
        (json!({ "turn": [] }), "/trackers/0/turn: names nothing that turns"),
        (json!({ "turn": 5 }), "/trackers/0/turn: must be a place such as"),
        (
            json!({ "turn": "/objects/7/transform/rotate_deg/1" }),
            "/trackers/0/turn: `/objects/7/transform/rotate_deg/1` is not an angle of the scene",
        ),
        (
            json!({ "turn": "/objects/0/transform/rotate_deg/2" }),
            "turns the object about the line along which it looks",
        ),
        (json!({ "turn": turn, "step_deg": 0.1 }), "/trackers/0/step_deg: 0.1, must be 1 to 45"),
        (
            json!({ "turn": turn, "backtrack": 1 }),
            "/trackers/0/backtrack: 1, must be between 0 and 1",
        ),
        (
            json!({ "turn": [turn, "/objects/0/transform/rotate_deg/0"] }),
            "rotate_deg/0` turns about another axis",
        ),
        (json!({ "turn": turn, "stepp": 5 }), "stepp"),
    ] {
        let control = json!({ "trackers": [tracker] }).to_string();
        std::fs::write(scene.path("control.json"), control).expect("control.json");
        refused(&scene.path(""), &arguments, &[words]);
    }
}

/// On a slope that rises to the east a level sensor has no direct light while the sun stands below the
/// slope, and all of it afterwards, with one axis and with two; no hour is sunlit before. The truth of
/// an hour is the sum over its suns.
///
/// Seed 1; each hour to 5 standard errors of at most 1 % and 0.1 %, but for those with a sun that the
/// slope or the horizon cuts. 2 x 12 comparisons at most, odds of a false alarm 2e-5.
#[test]
fn the_sun_comes_over_the_hill() {
    for axes in [
        json!({ "x": [0, 2], "slope": [1, 0] }),
        json!({ "x": [0, 2], "y": [0, 3], "slope": [1, 0] }),
    ] {
        let scene = sunny(21..22)
            .with("periodic", axes.clone())
            .captor("up", &Mesh::square([1.0, 1.0, 2.0], [0.0, 0.0, 1.0], 0.2))
            .write();
        let loaded =
            phylux::formats::load_by_hour(&scene.path("scene.json"), SkyDivision::Tregenza);
        let loaded = loaded.expect("a scene");
        let hourly = loaded.hourly.clone().expect("hours");
        let settings =
            phylux::Settings { photons: PhotonCount::new(20_000).ok(), ..loaded.settings.clone() };
        let options = YearOptions { sun_rays: Some(16_384), ..YearOptions::default() };
        let year = super::find(loaded, &options, &settings);
        let (mut hidden, mut lit) = (0, 0);
        for (s, slot) in year.slots.iter().enumerate() {
            let Some(hour) = slot.hour.map(|h| hourly.hours[h]) else { continue };
            let suns: Vec<_> = hour.suns(hourly.north).collect();
            let above = |sun: &DVec3| sun.z - 0.5 * sun.x;
            if suns.iter().any(|(sun, _)| above(sun).abs() < 0.01 || sun.z < 0.01) {
                continue;
            }
            let seen =
                |(sun, light): &(DVec3, f64)| if above(sun) > 0.0 { light * sun.z } else { 0.0 };
            let exact: f64 = suns.iter().map(seen).sum();
            let values = year.hour(s).expect("an hour");
            let found = values.light(0, Channel::Front, 0).expect("a front");
            let sunlit = values.sunlit(0).expect("a share");
            let off = (found.mean - exact).abs();
            let what = format!("{axes}, {s}: {found:?}, not {exact}; {sunlit:?}");
            assert!(off <= 5.0 * found.variance.sqrt() + 1e-3 * exact, "{what}");
            assert!(found.variance.sqrt() <= 0.01 * exact + 1e-9, "{what}");
            let is_above = |(sun, _): &(DVec3, f64)| above(sun) > 0.0;
            if !suns.iter().any(is_above) {
                assert!(found.mean == 0.0 && sunlit.mean == 0.0, "{what}");
                hidden += 1;
            } else if suns.iter().all(is_above) {
                assert_eq!(sunlit.mean, 1.0, "{what}");
                lit += 1;
            }
        }
        assert!(hidden >= 1 && lit >= 8, "{hidden} {lit}");
    }
}
