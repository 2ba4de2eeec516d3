//! The sun moves while an hour lasts: sums and sunlit shares by rows of an hour are those by rows of
//! minutes. The clock is the mended one, and one year at a time is written into a folder.

use std::{fmt::Write, fs, fs::File};

use phylux::{
    formats::{SkyDivision, iso8601},
    scene::{Channel, daylight::SunPosition},
    transport::{NearestCount, PhotonCount},
};
use serde_json::json;

use super::{first_days, world, written, year};
use crate::{
    bad_input::{listing, phylux},
    common::run_file,
    world::{Mesh, Point, World, front},
};

const UP: Point = [0.0, 0.0, 1.0];

/// Returns direct light of a clear sky at a latitude, as means over rows of so many minutes.
fn clear(latitude: f64, first: &str, days: usize, minutes: usize) -> String {
    let mut text = String::from("time,dni,dhi\n");
    let first = iso8601::parse_time(&format!("{first}T00:00Z"), "time").expect("a time");
    let light = |minute: usize| {
        let mut time = first;
        time.unix += 60.0 * (minute as f64 + 0.5);
        let sine = SunPosition::at(time, latitude.to_radians(), 0.0).elevation.sin();
        if sine > 0.0 { 1100.0 * (-0.15 / sine.max(0.02)).exp() } else { 0.0 }
    };
    for row in 0..days * 1440 / minutes {
        let mean = (0..minutes).map(|m| light(row * minutes + m)).sum::<f64>() / minutes as f64;
        let unix = first.unix as u64 + (60 * minutes * row) as u64;
        let date = phylux::scene::daylight::Date::from_days((unix / 86_400) as i64);
        let (hour, minute) = (unix / 3600 % 24, unix / 60 % 60);
        let _ = writeln!(
            text,
            "{}-{:02}-{:02}T{hour:02}:{minute:02}Z,{mean:.3},0",
            date.year, date.month, date.day
        );
    }
    text
}

/// Returns a world under such a sky without diffuse light.
fn under(latitude: f64, first: &str, days: usize, minutes: usize) -> World {
    let from = iso8601::parse_time(&format!("{first}T00:00Z"), "time").expect("a time");
    let last =
        phylux::scene::daylight::Date::from_days((from.unix / 86_400.0) as i64 + days as i64);
    let to = format!("{}-{:02}-{:02}T00:00Z", last.year, last.month, last.day);
    World::new()
        .with("bands", json!([{ "name": "all" }]))
        .with("site", json!({ "latitude": latitude, "longitude": 0.0 }))
        .with("weather", json!({ "file": "w.csv", "stamp": "start" }))
        .with("time", json!({ "from": format!("{first}T00:00Z"), "to": to }))
        .with_file("w.csv", &clear(latitude, first, days, minutes))
        .light(json!({ "type": "sun", "share": 1 }))
}

/// Between black walls along north the sun of an hour comes down for a part of it. With rows of an hour
/// the sums of a week are within 0.5 % of those with rows of 10 minutes, by the hour and in a run; with
/// one sun in the middle of each hour they are 4 % lower in March, and 0.5 % in December, when half of
/// them come from a sun that is less than 20 degrees high. Seed 1, 4 errors, 4 comparisons.
#[test]
fn sums_of_hours_are_those_of_minutes() {
    let sums = |latitude: f64, first: &str, minutes: usize| {
        let wall = |x: f64| Mesh::rectangle([x, -50.0, 0.0], [0.0, 100.0, 0.0], [0.0, 0.0, 1.4]);
        let mut world = under(latitude, first, 7, minutes)
            .lambert("black", 0.0)
            .surface("west", "black", &wall(-2.0))
            .surface("east", "black", &wall(2.0));
        for x in [-1.5, -0.9, -0.3, 0.3, 0.9, 1.5] {
            world = world.captor(&format!("{x}"), &Mesh::square([x, 0.0, 0.0], UP, 0.1));
        }
        let scene = world.write();
        let found = year(&scene, None, 1000, SkyDivision::Tregenza);
        let whole = found.whole().expect("sums");
        let values = (0..6).map(|id| whole.light(id, Channel::Front, 0).expect("a front"));
        let sum = values.fold([0.0; 2], |[mean, variance], value| {
            [mean + value.mean, variance + value.variance]
        });
        let run = run_file(&scene.path("scene.json"), |settings| {
            settings.estimator = phylux::Estimator::Paths;
            (settings.photons, settings.k) =
                (PhotonCount::new(200_000).ok(), Some(NearestCount::NONE));
        });
        let fronts = ["-1.5", "-0.9", "-0.3", "0.3", "0.9", "1.5"].map(|id| {
            let face = front(&run, id);
            [face.irradiance[0], face.irradiance_se[0].expect("an error")].map(|x| 0.0864 * x)
        });
        let of_run = fronts.iter().fold([0.0; 2], |[mean, variance], [value, error]| {
            [mean + value, variance + error * error]
        });
        [sum, of_run]
    };
    for (latitude, first) in [(45.0, "2025-03-01"), (52.0, "2025-12-01")] {
        let [hours, minutes] = [60, 10].map(|minutes| sums(latitude, first, minutes));
        for ([a, in_a], [b, in_b]) in hours.into_iter().zip(minutes) {
            let error = (in_a + in_b).sqrt();
            assert!((a - b).abs() < 0.005 * b + 4.0 * error, "{latitude}: {a}, {b} ({error})");
            assert!(error < 0.005 * b, "{latitude}: {error} of {b}");
        }
    }
}

/// On a short day of the north hours of sunrise and sunset count by their minutes of sun. A wall in the
/// south-west hides the sun in the afternoon.
#[test]
fn sunlit_shares_of_days_go_by_minutes() {
    let share = |minutes: usize| {
        let wall = Mesh::rectangle([-3.0, -2.0, 0.0], [2.0, -1.0, 0.0], [0.0, 0.0, 5.0]);
        let scene = under(63.0, "2025-12-20", 1, minutes)
            .lambert("black", 0.0)
            .surface("wall", "black", &wall)
            .captor("up", &Mesh::square([0.0, 0.0, 1.0], UP, 0.4))
            .write();
        let found = year(&scene, None, 1000, SkyDivision::Tregenza);
        let values = [found.day(0), found.month(0), found.whole()].map(|v| v.expect("values"));
        values.map(|values| values.sunlit(0).expect("a share").mean)
    };
    let [hours, minutes] = [60, 5].map(share);
    for (a, b) in hours.into_iter().zip(minutes) {
        assert!((a - b).abs() < 0.01, "{a}, {b}");
        assert!((0.2..0.95).contains(&b), "{b}");
    }
}

/// With `shift_h` the hours, days, lamps and states are those of the mended clock, as in a file whose
/// clock is right.
#[test]
fn all_goes_by_the_mended_clock() {
    let square = Mesh::square([0.0; 3], UP, 1.0);
    let roof = Mesh::square([0.0, 0.0, 1.0], [0.0, 0.0, -1.0], 9.0);
    let scene = || {
        let scene = written(
            &world(first_days())
                .lambert("black", 0.0)
                .surface("roof", "black", &roof)
                .edited(|scene| scene["objects"][0]["present"] = json!(false))
                .captor("up", &square)
                .light(
                    json!({ "type": "point", "name": "lamp", "position": [0, 0, 0.5], "power": 9 }),
                ),
        );
        let series: String = (0..48)
            .map(|hour| {
                let closed = u8::from((10..12).contains(&(hour % 24)));
                format!("2025-06-{}T{:02}:00+01:00,{closed}\n", 20 + hour / 24, hour % 24)
            })
            .collect();
        fs::write(scene.path("s.csv"), format!("time,s\n{series}")).expect("a series");
        let control = json!({
            "states": [{ "name": "roof", "changes": { "/objects/0/present": true },
                "series": { "file": "s.csv", "column": "s" } }],
            "lamps": [{ "lights": "lamp", "watts": 100, "hours": [3, 5.5] }]
        });
        fs::write(scene.path("control.json"), control.to_string()).expect("control.json");
        scene
    };
    let tables = |scene: &crate::common::TestScene| {
        let fixed = ["year", "scene.json", "-o", "y", "--csv", "--photons", "20000"];
        let more = ["--control", "control.json", "--patches", "145"];
        let output = phylux(&scene.path(""), &[&fixed[..], &more].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        ["hours", "days", "lamps", "states"]
            .map(|name| fs::read_to_string(scene.path(&format!("y/{name}.csv"))).expect("a table"))
    };
    let right = tables(&scene());
    // the same light, written by a clock that is three hours late
    let late = scene();
    let weather = fs::read_to_string(late.path("w.csv")).expect("weather");
    let mut moved = String::from("time,ghi,dni,dhi\n");
    for line in weather.lines().skip(1) {
        let (time, rest) = line.split_once(',').expect("a row");
        let time = iso8601::parse_time(time, "time").expect("a time").unix + 3600.0 - 3.0 * 3600.0;
        let date = phylux::scene::daylight::Date::from_days((time / 86_400.0) as i64);
        let hour = (time / 3600.0) as i64 % 24;
        let _ = writeln!(moved, "2025-{:02}-{:02}T{hour:02}:00+01:00,{rest}", date.month, date.day);
    }
    fs::write(late.path("w.csv"), moved).expect("weather");
    let mut document = fs::read_to_string(late.path("scene.json")).expect("a scene");
    document = document.replacen("\"stamp\":", "\"shift_h\": 3, \"stamp\":", 1);
    fs::write(late.path("scene.json"), document).expect("a scene");
    assert_eq!(tables(&late), right);
}

/// A second `year` into a folder is refused at its start, and so is a second `chart`. Afterwards nothing
/// of this stays.
#[test]
fn one_year_at_a_time_is_written_into_a_folder() {
    let scene = super::two_days();
    fs::create_dir(scene.path("y")).expect("a folder");
    let lock = File::create(scene.path("y/.phylux.lock")).expect("a file");
    lock.lock().expect("a lock");
    for command in ["year", "chart"] {
        let output = phylux(&scene.path(""), &[command, "scene.json", "-o", "y"]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.starts_with("error: y: another phylux is at work in this folder"), "{said}");
        assert_eq!(listing(&scene.path("y")), [".phylux.lock"]);
    }
    drop(lock);
    let arguments = ["year", "scene.json", "-o", "y", "--csv", "--photons", "2000"];
    let output = phylux(&scene.path(""), &arguments);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let left = listing(&scene.path("y"));
    assert!(left.iter().all(|name| !name.starts_with('.')), "{left:?}");
}
