//! States of a year: screens, whitewash and blackout, and lamps that are dimmed.

use std::fmt::Write;

use phylux::{
    Control, Settings,
    formats::{ControlFile, SkyDivision},
    scene::Channel,
    studies::{Year, YearOptions, YearScenes},
    transport::PhotonCount,
};
use serde_json::{Value, json};

use super::{UP, first_days, sunny, world, written};
use crate::{
    bad_input::{phylux, refused},
    common::TestScene,
    world::{Mesh, World},
};

/// States, and what the leaf absorbs in each hour.
type Case<'a> = (Vec<Value>, &'a dyn Fn(usize) -> f64);

const NORMAL: [f64; 3] = [0.6, 0.0, 0.8];

/// Returns a leaf alone under the sun, which absorbs 0.6 of the light, and a black roof that is not
/// there.
fn leaf() -> World {
    let leaf = json!({ "type": "leaf", "ior": 1, "reflectance": 0.1, "transmittance": 0.3 });
    let roof = Mesh::cuboid([-1.0; 3], [1.0; 3]).flipped();
    sunny(21..22)
        .material("leaf", leaf)
        .material("black", json!({ "type": "lambert", "reflectance": 0 }))
        .counted("leaf", "leaf", &Mesh::square([0.0; 3], NORMAL, 0.5))
        .surface("roof", "black", &roof)
        .edited(|scene| scene["objects"][1]["present"] = json!(false))
}

pub fn find(scene: &TestScene, control: &Value, photons: u64) -> phylux::Result<Year> {
    let path = scene.path("control.json");
    std::fs::write(&path, control.to_string()).expect("control.json");
    let file = ControlFile::load(&path)?;
    let path_text = path.display().to_string();
    let scenes =
        YearScenes::load(&scene.path("scene.json"), SkyDivision::Tregenza, Some((&file, &path)))?;
    let settings = &scenes.scenes[0].loaded.settings;
    let settings = Settings { photons: PhotonCount::new(photons).ok(), ..settings.clone() };
    let watched = Control::default();
    let control = Some((&file, path_text.as_str()));
    let options = YearOptions { control, ..YearOptions::default() };
    Year::find(&scenes, &options, &settings, &watched)
}

/// Returns the light on both faces of an id together, and what it absorbs.
fn light(year: &Year, slot: usize, name: &str) -> [f64; 2] {
    let id = year.places.ids.iter().position(|id| id == name).expect("an id");
    let values = year.hour(slot).expect("an hour");
    let of = |channel| values.light(id, channel, 0).map_or(0.0, |value| value.mean);
    [of(Channel::Front) + of(Channel::Back), of(Channel::Absorbed)]
}

fn close(found: f64, expected: f64) -> bool {
    (found - expected).abs() <= 1e-5 * expected.abs() + 1e-6
}

/// A leaf alone absorbs what its material says, in every hour, whichever state holds: never, from 9
/// to 13.5, in a quarter of each hour by a table, or in both of two that are independent. Chance is
/// only in where on the sun's disc the 16 rays of each state go. States that change nothing change nothing.
#[test]
fn a_leaf_absorbs_by_its_states() {
    let scene = leaf().write();
    let plain = find(&scene, &json!({}), 2000).expect("a year");
    let mut series = String::from("time,curtain\n");
    for hour in 0..24 {
        let _ = writeln!(series, "2025-06-21T{hour:02}:00Z,0.25");
    }
    std::fs::write(scene.path("c.csv"), series).expect("c.csv");
    let black = json!({ "/materials/leaf/reflectance": 0.5 });
    let open = json!({ "/materials/leaf/transmittance": 0.1 });
    let same = json!({ "/materials/leaf/transmittance": 0.3 });
    let table = json!({ "file": "c.csv", "column": "curtain" });
    let state = |name: &str, changes: &Value, keys: Value| {
        let mut state = json!({ "name": name, "changes": changes });
        state.as_object_mut().unwrap().extend(keys.as_object().unwrap().clone());
        state
    };
    let by_clock = |s: usize| {
        if (9..13).contains(&s) {
            1.0
        } else if s == 13 {
            0.5
        } else {
            0.0
        }
    };
    let cases: [Case; 5] = [
        (vec![state("a", &same, json!({ "hours": [9, 13.5] }))], &|_| 0.6),
        (vec![state("a", &black, json!({ "hours": [9, 13.5] }))], &|s| 0.6 - 0.4 * by_clock(s)),
        (vec![state("a", &black, json!({ "series": table }))], &|_| 0.5),
        (
            vec![
                state("a", &black, json!({ "series": table })),
                state("b", &open, json!({ "series": table })),
            ],
            &|_| 0.6 - 0.25 * 0.4 + 0.25 * 0.2,
        ),
        (vec![state("a", &black, json!({ "dates": ["12-01", "03-01"] }))], &|_| 0.6),
    ];
    for (i, (states, absorptance)) in cases.iter().enumerate() {
        let year = find(&scene, &json!({ "states": states }), 2000);
        let year = year.unwrap_or_else(|e| panic!("{e}"));
        for s in 0..24 {
            let [arrived, absorbed] = light(&year, s, "leaf");
            let [without, _] = light(&plain, s, "leaf");
            let off = (arrived - without).abs();
            assert!(off < 2.0 + 0.02 * without, "case {i}, hour {s}: {arrived}, {without}");
            let expected = absorptance(s) * arrived;
            let off = (absorbed - expected).abs();
            assert!(off <= 3e-3 * expected, "case {i}, hour {s}: {absorbed}, not {expected}");
        }
    }
    let never = find(&scene, &json!({ "states": cases[4].0 }), 2000).expect("a year");
    assert_eq!(never.states[0].1.iter().sum::<f64>(), 0.0);
}

/// Under a black roof there is no light at all, and beside its hours there is all.
#[test]
fn blackout_is_dark() {
    let scene = leaf().write();
    let plain = find(&scene, &json!({}), 2000).expect("a year");
    let roof = json!({ "name": "blackout", "changes": { "/objects/1/present": true },
                       "outside_above": 100, "hours": [10, 14] });
    let year = find(&scene, &json!({ "states": [roof] }), 2000).expect("a year");
    for s in 0..24 {
        let [[arrived, absorbed], [all, _]] = [&year, &plain].map(|year| light(year, s, "leaf"));
        match (10..14).contains(&s) {
            true => assert_eq!([arrived, absorbed], [0.0; 2], "hour {s}"),
            false => {
                let off = (arrived - all).abs();
                assert!(off < 2.0 + 0.02 * all, "hour {s}: {arrived}, {all}");
            }
        }
    }
    assert_eq!(year.states[0].1.iter().sum::<f64>(), 4.0);
    // the command writes the same, with the hours of the state
    let done = phylux(
        &scene.path(""),
        &["year", "scene.json", "-o", "out", "--photons", "2000", "--control", "control.json"],
    );
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    assert!(done.status.success(), "{said}");
    assert!(said.contains("`blackout` hold for 4.000 h only"), "{said}");
    let read = |name: &str| std::fs::read_to_string(scene.path("out").join(name)).expect(name);
    assert_eq!(read("states.csv"), "state,month,hours\nblackout,2025-06,4\nblackout,all,4\n");
    assert!(read("captors.csv").starts_with("captor,kind,x,y,z,nx,ny,nz,area,groups\nleaf"));
}

/// Lamps that are dimmed to one half bring one half of the light for one half of the energy, and
/// lamps that fill up bring just what daylight does not, as far as they can.
#[test]
fn lamps_are_dimmed() {
    let lamp = json!({ "type": "area", "name": "lamp", "power": 4000,
                       "vertices": [[0, 0, 2], [0, 1, 2], [1, 1, 2], [1, 0, 2]] });
    let scene = written(
        &world(first_days())
            .captor("up", &Mesh::square([0.5, 0.5, 0.0], UP, 1.0))
            .captor("above", &Mesh::square([0.5, 0.5, 3.0], UP, 1.0))
            .light(lamp),
    );
    let find = |keys: Value| {
        let mut lamps = json!({ "lights": "lamp", "watts": 1000 });
        lamps.as_object_mut().unwrap().extend(keys.as_object().unwrap().clone());
        find(&scene, &json!({ "lamps": [lamps] }), 20_000).unwrap_or_else(|e| panic!("{e}"))
    };
    let (full, half) = (find(json!({})), find(json!({ "dim": 0.5 })));
    let off = find(json!({ "hours": [5, 5] }));
    let at = |year: &Year, s: usize| light(year, s, "up")[0];
    let above = |year: &Year, s: usize| light(year, s, "above")[0];
    let brings = at(&full, 0);
    assert!(brings > 50.0 && (at(&half, 0) / brings - 0.5).abs() < 1e-6);
    let energy = |year: &Year| year.energy(&year.lamps[0], 0..48).expect("a power");
    assert_eq!([energy(&full), energy(&half), energy(&off)], [48.0, 24.0, 0.0]);
    assert_eq!(half.hours_on(&half.lamps[0], 0..48), 48.0);
    let wanted = 0.6 * brings;
    let filled = find(json!({ "fill_to": wanted, "of": "up", "band": "PAR" }));
    let mut kwh = 0.0;
    for s in 0..48 {
        let daylight = at(&off, s);
        assert!(close(at(&filled, s), daylight.max(wanted)), "hour {s}: {}", at(&filled, s));
        kwh += ((wanted - daylight) / brings).max(0.0);
    }
    assert!((energy(&filled) / kwh - 1.0).abs() < 1e-4 && kwh > 10.0);
    // a lamp that brings nothing there cannot fill up anything
    let in_vain = find(json!({ "fill_to": 100, "of": "above", "band": "PAR" }));
    assert!((0..48).all(|s| above(&full, s) == above(&off, s)));
    assert_eq!((energy(&in_vain), in_vain.hours_on(&in_vain.lamps[0], 0..48)), (0.0, 0.0));
    let words = "the lamps `lamp` were never on: there is always enough light at `above`";
    assert!(
        in_vain.warnings.iter().any(|warning| warning.contains(words)),
        "{:?}",
        in_vain.warnings
    );
    // light outside in a band: the sky and the sun of the open, of which `up` gets all
    let outside = find(json!({ "outside_above": 300, "outside_band": "PAR" }));
    let close_call = |s: usize| (at(&off, s) - 300.0).abs() < 15.0;
    for s in (0..48).filter(|s| !close_call(*s)) {
        assert_eq!(outside.lamps[0].on[s], f64::from(at(&off, s) > 300.0), "hour {s}");
    }
    let winter = find(json!({ "dates": ["06-21", "06-30"] }));
    assert_eq!([0, 23, 24, 47].map(|s| winter.lamps[0].on[s]), [0.0, 0.0, 1.0, 1.0]);
}

#[test]
fn wrong_states_have_their_sentence() {
    let scene = leaf().write();
    std::fs::write(scene.path("c.csv"), "time,a\n2025-06-21T03:00Z,0.5\n").expect("c.csv");
    let refuse = |states: &str, words: &str| {
        std::fs::write(scene.path("control.json"), format!(r#"{{"states": [{states}]}}"#))
            .expect("control.json");
        let arguments =
            ["year", "scene.json", "-o", "out", "--photons", "2000", "--control", "control.json"];
        refused(&scene.path(""), &arguments, &[words]);
    };
    let roof = r#""changes": {"/objects/1/present": true}"#;
    for (state, words) in [
        (
            format!(r#"{{"name": "a", {roof}, "dates": ["02-30", "03-01"]}}"#),
            "/states/0/dates: `02-30` is no day",
        ),
        (
            format!(r#"{{"name": "a", {roof}, "hours": [4, 25]}}"#),
            "/states/0/hours: must be two times",
        ),
        (
            format!(r#"{{"name": "a", {roof}, "outside_band": "all"}}"#),
            "/states/0/outside_band: goes with",
        ),
        (
            format!(r#"{{"name": "a", {roof}, "outside_below": 5, "outside_band": "PAR"}}"#),
            "/states/0/outside_band: no band or sum `PAR`",
        ),
        (
            format!(r#"{{"name": "a", {roof}, "outside_below": -5}}"#),
            "/states/0/outside_below: -5, must be 0 to 1e9",
        ),
        (
            r#"{"name": "a", "changes": {"/lights/0": 1}}"#.into(),
            "/states/0/changes: `/lights/0` is no place that a state may change",
        ),
        (
            r#"{"name": "a", "changes": {"/objects/5/present": true}}"#.into(),
            "/states/0/changes: the scene has no `/objects/5/present`",
        ),
        (
            r#"{"name": "a", "changes": {"/objects/0/name": "b"}, "hours": [3, 9]}"#.into(),
            "/states/0/changes: with `a` the captors or groups are others",
        ),
        (
            format!(r#"{{"name": "a", {roof}}}, {{"name": "b", {roof}}}"#),
            "/states/1/changes: state `a` holds at the same time and changes `/objects/1/present` too",
        ),
        (
            format!(r#"{{"name": "a", {roof}}}, {{"name": "a", {roof}}}"#),
            "/states/1/name: state 0 is also called `a`",
        ),
        (
            format!(r#"{{"name": "a", {roof}, "series": {{"file": "c.csv", "column": "a"}}}}"#),
            "c.csv: has no row for the hour from 2025-06-21T00:00",
        ),
        (
            format!(r#"{{"name": "a", {roof}, "series": {{"file": "c.csv", "column": "b"}}}}"#),
            "c.csv:1: no column `b`",
        ),
        (
            format!(r#"{{"name": "a", {roof}, "series": {{"file": "d.csv", "column": "b"}}}}"#),
            "d.csv",
        ),
    ] {
        refuse(&state, words);
    }
    let control = |lamps: &str, words: &str| {
        std::fs::write(scene.path("control.json"), format!(r#"{{"lamps": [{lamps}]}}"#))
            .expect("control.json");
        let arguments =
            ["year", "scene.json", "-o", "out", "--photons", "2000", "--control", "control.json"];
        refused(&scene.path(""), &arguments, &[words]);
    };
    control(r#"{"lights": "l", "dim": 2}"#, "/lamps/0/dim: 2, must be 0 to 1");
    control(
        r#"{"lights": "l", "fill_to": 2}"#,
        "/lamps/0: `below`, `until_dli`, `fill_day` and `fill_to` need to know where",
    );
    control(
        r#"{"lights": "l", "fill_to": 2, "below": 3, "of": "leaf"}"#,
        "/lamps/0/fill_to: both `fill_to` and `below`",
    );
}
