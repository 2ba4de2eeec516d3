//! Rooms in Radiance's file format.

use serde_json::{Value, json};

use crate::{
    bad_input::bad_scene,
    common::{TestScene, front},
};

const ROOM: &str = "void plastic white 0 0 5 .8 .8 .8 .05 0\nvoid trans panel 0 0 7 .161 .161 .161 .3 0 .755 0\n\
    void light lum 0 0 3 100 100 100\nvoid glass pane 0 0 3 .9 .9 .9\n\
    white polygon floor 0 0 12 0 0 0 2000 0 0 2000 1000 0 0 1000 0\n\
    white polygon floorR 0 0 12 0 1000 0 2000 1000 0 2000 0 0 0 0 0\n\
    panel polygon ceiling 0 0 12 0 0 1800 0 1000 1800 2000 1000 1800 2000 0 1800\n\
    pane polygon window 0 0 9 0 0 0 0 0 1000 0 1000 0\n\
    lum cylinder north 0 0 7 200 300 1900 1800 300 1900 13\nlum cylinder south 0 0 7 200 700 1900 600 700 1900 13\n";

const OBJ: &str = "v 0 0 0\nv 2000 0 0\nv 2000 1000 0\nv 0 1000 0\nv 0 0 1800\nv 0 1000 1800\nv 2000 1000 1800\n\
    v 2000 0 1800\nv 0 0 1000\ng floor\nusemtl white\nf 1 2 3 4\ng ceiling\nusemtl panel\nf 5 6 7 8\ng window\nusemtl pane\n\
    f 1 9 4\n";

fn room(dialect: &str) -> Value {
    json!({
        "unit": "mm",
        "objects": [{ "name": "room", "rad": "room.rad", "dialect": dialect, "captor": true }],
        "lights": [{ "type": "rad", "object": "room", "material": "lum", "power": 100 }]
    })
}

/// In both dialects the scene has the same digest as an OBJ file with the materials that the
/// documentation promises.
#[test]
fn a_room_is_what_its_obj_file_would_be() {
    let c = f64::from(0.161f32);
    for (dialect, white, panel) in [
        (
            "radiance",
            json!({ "type": "phong", "reflectance": 0.8 * (1.0 - 0.05), "specular": 0.05 }),
            json!({ "type": "phong", "reflectance": 0.161 * ((1.0 - 0.3) * (1.0 - 0.755)), "specular": 0.3,
                "transmittance": 0.161 * ((1.0 - 0.3) * 0.755) }),
        ),
        (
            "sec2",
            json!({ "type": "phong", "reflectance": 0.8 * (1.0 - 0.05), "specular": 0.8 * 0.05 }),
            json!({ "type": "phong", "reflectance": 0.161 * (1.0 - 0.3), "specular": 0.161 * 0.3, "transmittance": 0.755 }),
        ),
    ] {
        assert!((c - 0.161).abs() < 1e-7);
        let tube = |name: &str, y: f64, to: f64, power: f64| json!({ "type": "tube", "name": name, "from": [200, y, 1900], "to": [to, y, 1900], "radius": 13, "power": power });
        let same = json!({
            "unit": "mm",
            "materials": { "white": white, "panel": panel, "pane": { "type": "transparent", "ior": 1.52, "thin": true, "tint": 0.9 } },
            "objects": [{ "name": "room", "obj": "room.obj", "captor": true }],
            "lights": [tube("north", 300.0, 1800.0, 80.0), tube("south", 700.0, 600.0, 20.0)]
        });
        let of = |scene: &Value| {
            let scene =
                TestScene::new(&scene.to_string(), &[("room.rad", ROOM), ("room.obj", OBJ)]);
            let loaded = phylux::load(&scene.path("scene.json")).unwrap_or_else(|e| panic!("{e}"));
            let powers: Vec<f64> =
                loaded.scene.lights().iter().map(|light| light.power[0]).collect();
            assert!(
                (powers[0] - 80.0).abs() < 1e-9 && (powers[1] - 20.0).abs() < 1e-9,
                "{powers:?}"
            );
            let captors: Vec<String> =
                loaded.scene.captors().iter().map(|c| c.id.clone()).collect();
            let materials = format!("{:?}", loaded.scene.materials());
            (captors, materials, loaded.scene.triangles().len())
        };
        assert_eq!(of(&room(dialect)), of(&same), "{dialect}");
    }
}

/// The panel of a growth chamber transmits 8.5 % of the light in one dialect and 75.5 % in the
/// other.
///
/// Seed 1, 20,000 photons; each value is off by more than 4 standard errors with odds of 6e-5.
#[test]
fn the_dialect_matters() {
    let panel = "void trans Makrolon 0 0 7 .161 .161 .161 .3 0 .755 0\nMakrolon polygon sheet 0 0 12 -5 -5 1 5 -5 1 5 5 1 -5 5 1\n";
    for (dialect, passed) in [("radiance", 0.0851), ("sec2", 0.755)] {
        let scene = json!({
            "objects": [{ "name": "sheet", "rad": "sheet.rad", "dialect": dialect }],
            "lights": [{ "type": "spot", "position": [0, 0, 2], "direction": [0, 0, -1], "half_angle_deg": 5, "power": 1 }],
            "captors": [{ "name": "below", "disc": { "center": [0, 0, 0.99], "normal": [0, 0, 1], "radius": 4 } }]
        });
        let result = TestScene::new(&scene.to_string(), &[("sheet.rad", panel)]).run(20_000, 1);
        let face = front(&result, "below");
        let (flux, error) = (face.flux[0], face.flux_se[0].expect("an error"));
        assert!((flux - passed).abs() < 4.0 * error + 1e-3, "{dialect}: {flux} +- {error}");
    }
}

/// A material of the scene replaces the one of that name in the file, and is also used where the
/// file defines none of that name.
#[test]
fn materials_of_the_scene_come_first() {
    let room = "void plastic white 0 0 5 .8 .8 .8 0 0\nwhite polygon a 0 0 9 0 0 0 1 0 0 1 1 0\nmine polygon b 0 0 9 0 0 1 1 0 1 1 1 1\n";
    let scene = json!({
        "materials": { "white": { "type": "lambert", "reflectance": 0.25 }, "mine": { "type": "mirror", "reflectance": 0.5 } },
        "objects": [{ "rad": "a.rad", "captor": true }],
        "lights": [{ "type": "point", "position": [0, 0, 3], "power": 1 }]
    });
    let scene = TestScene::new(&scene.to_string(), &[("a.rad", room)]);
    let loaded = phylux::load(&scene.path("scene.json")).unwrap_or_else(|e| panic!("{e}"));
    let materials = format!("{:?}", loaded.scene.materials());
    assert!(materials.contains("0.25") && materials.contains("Mirror"), "{materials}");
}

#[test]
fn wrong_rooms_are_refused() {
    let lamp = r#"[{"type": "rad", "object": "room", "material": "lum", "power": 1}]"#;
    let point = r#"[{"type": "point", "position": [0, 0, 1], "power": 1}]"#;
    let sound = r#"[{"name": "room", "rad": "room.rad", "captor": true}]"#;
    let files = [
        ("room.rad", ROOM),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
        ("tspec.rad", "void trans t 0 0 7 .5 .5 .5 0 0 .5 .5\nt sphere s 0 0 4 0 0 0 1\n"),
        ("thick.rad", "void dielectric d 0 0 5 .9 .9 .9 1.5 0\nd sphere s 0 0 4 0 0 0 1\n"),
        ("bright.rad", "void plastic p 0 0 5 2 2 2 0 0\np sphere s 0 0 4 0 0 0 1\n"),
        ("none.rad", "p sphere s 0 0 4 0 0 0 1\n"),
        ("shell.rad", "!touch ran\n"),
    ];
    for (objects, lights, words) in [
        (
            sound,
            point,
            &["/objects/0/rad: its 2 lamps of `lum` have no light; add {\"type\": \"rad\""][..],
        ),
        (
            sound,
            &lamp.replace("lum", "lun"),
            &["/lights/0: no lamps of `lun` in `room`; there are lum in room"],
        ),
        (sound, &lamp.replace(r#""power": 1"#, r#""power": "file""#), &["/lights/0/power"]),
        (
            &sound.replace("rad\": \"room.rad", "rad\": \"no.rad"),
            lamp,
            &["/objects/0/rad: ", "no such file"],
        ),
        (
            &sound.replace("\"captor\"", "\"obj\": \"a.obj\", \"captor\""),
            lamp,
            &["/objects/0: both `obj` and `rad`"],
        ),
        (
            &sound.replace("\"captor\"", "\"dialect\": \"x\", \"captor\""),
            lamp,
            &["unknown value `x`"],
        ),
        (
            r#"[{"obj": "a.obj", "dialect": "sec2"}]"#,
            point,
            &["/objects/0/dialect: goes with `rad` only"],
        ),
        (
            r#"[{"rad": "tspec.rad", "captor": true}]"#,
            point,
            &["tspec.rad:1: `t`: a part that goes straight"],
        ),
        (
            r#"[{"rad": "thick.rad", "captor": true}]"#,
            point,
            &["thick.rad:1: `d`: a dielectric that absorbs"],
        ),
        (
            r#"[{"rad": "bright.rad", "captor": true}]"#,
            point,
            &["bright.rad:1: colour 2 of `p`, must be from 0"],
        ),
        (
            r#"[{"rad": "none.rad", "captor": true}]"#,
            point,
            &["none.rad:1: no material `p`; there is none"],
        ),
        (
            r#"[{"rad": "shell.rad", "captor": true}]"#,
            point,
            &["shell.rad:1: the command `touch ran`; of commands"],
        ),
    ] {
        let scene = format!("{{\"objects\": {objects}, \"lights\": {lights}}}");
        bad_scene(&scene, &files, words);
    }
}
