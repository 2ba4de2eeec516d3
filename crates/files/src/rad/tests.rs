//! Tests of the content that valid files give, and that no damaged file causes a panic.

use std::f64::consts::PI;

use glam::DVec3;
use proptest::prelude::*;

use super::{content::RadPart, *};
use phylux_core::{error::Error, math::geometry::area};
use phylux_testing::{check_error, spoiled};

fn parse(text: &str, dialect: Dialect) -> Result<RadFile> {
    let load = |path: &Path| match path.to_str() {
        Some("dir/wall.rad") => Ok(b"white polygon wall 0 0 9 0 0 0 1 0 0 1 1 0".to_vec()),
        Some("parts/leg.rad" | "dir/../near/leg.rad") => {
            Ok(b"white polygon leg 0 0 9 0 0 0 1 0 0 1 1 0".to_vec())
        }
        Some("dir/again.rad") => Ok(b"!xform again.rad".to_vec()),
        _ => Err("there is no such file".into()),
    };
    RadFile::parse(text.as_bytes(), Path::new("dir/a.rad"), dialect, &load)
}

const WHITE: &str = "void plastic white 0 0 5 .8 .8 .8 0 0 # paint\n";

/// Round shapes have the area of the true shapes, and their fronts face the right way.
#[test]
fn shapes_have_their_area() {
    for (shape, true_area, outside) in [
        ("polygon a 0 0 12 0 0 0  2 0 0  2 1 0  0 1 0", 2.0, None),
        ("sphere a 0 0 4 1 2 3 0.5", PI, Some(1.0)),
        ("bubble a 0 0 4 1 2 3 0.5", PI, Some(-1.0)),
        ("cylinder a 0 0 7 1 2 1 1 2 5 0.5", 4.0 * PI, Some(1.0)),
        ("tube a 0 0 7 1 2 1 1 2 5 0.5", 4.0 * PI, Some(-1.0)),
        ("cone a 0 0 8 1 2 1 1 2 5 3 0", 15.0 * PI, Some(1.0)),
        ("cup a 0 0 8 1 2 1 1 2 5 0 3", 15.0 * PI, Some(-1.0)),
        ("ring a 0 0 8 1 2 3 0 0 2 0.5 1", 0.75 * PI, None),
        ("ring a 0 0 8 1 2 3 0 0 2 1 0", PI, None),
    ] {
        let file = parse(&format!("{WHITE}white {shape}"), Dialect::Radiance).unwrap();
        let triangles = &file.parts[0].triangles;
        let found: f64 = triangles.iter().map(area).sum();
        assert!((found / true_area - 1.0).abs() < 1e-9, "{shape}: {found} {true_area}");
        for [a, b, c] in triangles {
            let normal = (b - a).cross(c - a);
            match outside {
                None => assert!(normal.z > 0.0, "{shape}"),
                Some(sign) => {
                    let out = (*a + *b + *c) / 3.0 - DVec3::new(1.0, 2.0, 3.0);
                    assert!(sign * out.dot(normal) > 0.0, "{shape}");
                }
            }
        }
    }
}

/// Transforms move the corners, turn the fronts and change the identifiers as the command says.
#[test]
fn transforms_are_followed() {
    for (command, first, last, copies) in [
        ("!xform -t 1 2 3 wall.rad", [1.0, 2.0, 3.0], [2.0, 3.0, 3.0], 1),
        ("!xform -t 1 2 3 ../near/leg.rad", [1.0, 2.0, 3.0], [2.0, 3.0, 3.0], 1),
        ("!xform -rz 90 -t 1 0 0 wall.rad", [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 1),
        ("!xform -s 2 \\\n -t 1 0 0 wall.rad", [1.0, 0.0, 0.0], [3.0, 2.0, 0.0], 1),
        ("!xform -a 3 -t 10 0 0 wall.rad", [0.0, 0.0, 0.0], [21.0, 1.0, 0.0], 3),
        ("!xform -a 2 -t 10 0 0 -a 2 -t 0 5 0 -i 1 -s 2 wall.rad", [0.0; 3], [22.0, 12.0, 0.0], 4),
        ("!cat wall.rad", [0.0; 3], [1.0, 1.0, 0.0], 1),
    ] {
        let file = parse(&format!("{WHITE}{command}\n"), Dialect::Radiance).unwrap();
        let triangles: Vec<_> = file.parts.iter().flat_map(|part| &part.triangles).collect();
        assert_eq!(triangles.len(), copies, "{command}");
        let all: Vec<DVec3> = triangles.iter().flat_map(|t| t.iter().copied()).collect();
        let has = |p: [f64; 3]| all.iter().any(|q| q.distance(DVec3::from(p)) < 1e-9);
        assert!(has(first) && has(last), "{command}: {all:?}");
        assert!(triangles.iter().all(|[a, b, c]| (b - a).cross(c - a).z > 0.0), "{command}");
    }
    // a mirrored surface faces the mirrored way, an inverted one the other way
    for (command, z) in [("-mx", 1.0), ("-mz", -1.0), ("-I", -1.0), ("-I -mz", 1.0)] {
        let file = parse(&format!("{WHITE}!xform {command} wall.rad"), Dialect::Radiance).unwrap();
        let [a, b, c] = file.parts[0].triangles[0];
        assert!((b - a).cross(c - a).z * z > 0.0, "{command}");
    }
    let text = format!(
        "{WHITE}void metal m 0 0 5 .5 .5 .5 1 0\n!xform -n east -m m -a 2 -t 1 0 0 wall.rad"
    );
    let file = parse(&text, Dialect::Radiance).unwrap();
    let names: Vec<&str> = file.parts.iter().map(|part| part.identifier.as_str()).collect();
    assert_eq!(names, ["east.0.wall", "east.1.wall"]);
    assert!(file.parts.iter().all(|part| file.materials[part.material].name == "m"));
}

/// The last definition of a name holds, an alias stands for the material it names, reversed copies
/// are dropped, and lamps are not surfaces.
#[test]
fn materials_and_lamps_are_kept_apart() {
    let text = "void plastic a\n0\n0\n5 .1 .1 .1 0 0\na polygon p1 0 0 9 0 0 0 1 0 0 1 1 0\n\
        void plastic a 0 0 5 .2 .2 .2 0 0 void alias b a\n\
        a polygon p2 0 0 9 0 0 1 1 0 1 1 1 1\nb polygon p3 0 0 9 0 0 2 1 0 2 1 1 2\n\
        b polygon p3R 0 0 9 1 1 2 1 0 2 0 0 2\nvoid light l 0 0 3 1 1 1\nl cylinder tube1 0 0 7 0 0 5 1 0 5 .1\n\
        l polygon panel 0 0 9 0 0 3 1 1 3 1 0 3\nmine polygon p4 0 0 9 0 0 4 1 0 4 1 1 4\n";
    let file = parse(text, Dialect::Radiance).unwrap();
    let reflected = |part: &RadPart| file.materials[part.material].numbers.first().copied();
    let parts: Vec<_> = file.parts.iter().map(|p| (p.identifier.as_str(), reflected(p))).collect();
    let expected = [("p1", Some(0.1)), ("p2", Some(0.2)), ("p3", Some(0.2)), ("p4", None)];
    assert_eq!(parts, expected);
    let lamps: Vec<_> =
        file.lamps.iter().map(|l| (l.identifier.as_str(), l.tube.is_some())).collect();
    assert_eq!(lamps, [("tube1", true), ("panel", false)]);
}

/// A file in the form that SEC2 writes is read.
#[test]
fn the_dialect_of_sec2_is_read() {
    let text = "scale_factor 100\nvoid light lum400 0 0 1 100 100 100\nvoid x lumB\nvoid point p1 1 2 3\n\
        void point_light pl 0 0 5 10\nvoid plastic w 0 0 5 .5 .5 .5 .1 0\nw polygon floor 0 0 9 0 0 0 1 0 0 1 1 0\n\
        lum400 cylinder n1 0 0 7 0 0 1 1 0 1 .1\n";
    let file = parse(text, Dialect::Sec2).unwrap();
    assert_eq!((file.parts.len(), file.lamps.len(), file.warnings.len()), (1, 1, 1));
    // an unused lamp changes nothing, with or without counts, and with a colour or without
    for (x, numbers) in [
        ("void x lumB", 0),
        ("void x lumB 0 0 0", 0),
        ("void x lumB 0 0 3 .5 .5 .5", 3),
        ("void x lumB .5 .5 .5", 3),
        ("void x lumB 0 0 1 .5", 1),
    ] {
        let other = parse(&text.replace("void x lumB", x), Dialect::Sec2).unwrap();
        assert!((&other.parts, &other.lamps) == (&file.parts, &file.lamps), "{x}");
        assert_eq!(other.materials[1].numbers.len(), numbers, "{x}");
    }
    assert!(parse(text, Dialect::Radiance).is_err());
}

/// What is wrong with a material stands in it, for a scene that gives it another.
#[test]
fn materials_that_are_not_read_do_not_stop_the_reading() {
    for (definition, start) in [
        (
            "void trans2 m 4 a b c d 0 1 1",
            "dir/a.rad:1: void trans2 m: `trans2` is not read; give the scene",
        ),
        ("void velvet m 0 0 2 1 1", "dir/a.rad:1: void velvet m: `velvet` is not supported; there"),
        ("void colorpict m 7 r g b p.hdr . u v 0 0", "dir/a.rad:1: void colorpict m: `colorpict`"),
        (
            "p plastic m 0 0 5 1 1 1 0 0",
            "dir/a.rad:1: a material that is modified by `p`; patterns",
        ),
        (
            "void plastic w 0 0 5 1 1 1 0 0\np alias m w",
            "dir/a.rad:2: a material that is modified by `p`",
        ),
        ("void BSDF m 6 0 /a.xml 0 1 0 . 0 0", "dir/a.rad:1: BSDF `m`: a file that is named by no"),
        ("void BSDF m 6 0 a.xml 0 u 0 . 0 0", "dir/a.rad:1: BSDF `m`: a direction up that is not"),
        ("void BSDF m 2 0 a.xml 0 0", "dir/a.rad:1: BSDF `m`: too few texts"),
        ("void BSDF m 6 0 a.xml 0 1 0 . 0 3 .1 .1 .1", "dir/a.rad:1: BSDF `m`: diffuse parts"),
    ] {
        let file = parse(&format!("{definition}\nm sphere s 0 0 4 0 0 0 1"), Dialect::Radiance);
        let file = file.unwrap_or_else(|e| panic!("{definition}: {e}"));
        let material = &file.materials[file.parts[0].material];
        let problem = material.problem.as_ref().map_or(String::new(), Error::to_string);
        assert!(material.name == "m" && problem.starts_with(start), "{problem}\n{start}");
    }
}

/// A measured material names its file, beside the room or in the working directory, and turns with
/// the copy of its file.
#[test]
fn measured_materials_name_their_file() {
    for (definition, up, through) in [
        ("void BSDF m 6 0 a.xml 0 0 2 . 0 0", [0.0, 0.0, 2.0], false),
        ("void BSDF m 8 0.1 a.xml 0 1 0 . -rx 90 0 3 0 0 0", [0.0, 0.0, 1.0], true),
        ("void aBSDF m 5 a.xml 1 0 0 . 0 0", [1.0, 0.0, 0.0], true),
    ] {
        let text = format!("{definition}\nm sphere s 0 0 4 0 0 0 1");
        let file = parse(&text, Dialect::Radiance).unwrap();
        let bsdf = file.materials[0].bsdf.clone().unwrap();
        assert_eq!(bsdf.files, [Path::new("dir/a.xml"), Path::new("a.xml")]);
        assert!(bsdf.up.distance(DVec3::from(up)) < 1e-12 && bsdf.through == through);
    }
    // files of commands are looked for in the same places
    let room = parse(&format!("{WHITE}!xform -t 1 0 0 parts/leg.rad"), Dialect::Radiance).unwrap();
    assert_eq!(room.parts[0].identifier, "leg");
    let text =
        format!("{WHITE}void light sun 0 0 3 1 1 1\nsun source s 0 0 4 0 0 1 .5\n!cat wall.rad");
    let warnings = parse(&text, Dialect::Radiance).unwrap().warnings;
    assert!(warnings[0].starts_with("dir/a.rad:3: source s is not read: give the scene a sun"));
}

#[test]
fn errors_say_where_and_what() {
    for (text, start) in [
        ("", "dir/a.rad: holds no surface; a surface is"),
        ("# nothing\n", "dir/a.rad: holds no surface"),
        ("\nvoid plastic", "dir/a.rad:2: `void` without its identifier; a primitive is"),
        ("void plastic a 0 0 x", "dir/a.rad:1: `x` where `plastic` has a number; after the"),
        ("void plastic a 0 0 5 1 1 1 0", "dir/a.rad:1: `` where `plastic` has a number"),
        ("void plastic a 0 0 -1", "dir/a.rad:1: -1 is no count of arguments"),
        ("void plastic a 0 0 3 1 1 1", "dir/a.rad:1: plastic a of 3 numbers, must be 5"),
        (
            "void plastik a 0 0 3 1 1 1",
            "dir/a.rad:1: void plastik a: `plastik` is not supported; did you mean `plastic`?",
        ),
        ("void colorpict a 7 1 2", "dir/a.rad:1: the file ends within it; the file is broken"),
        ("void mesh a 1 a.rtm 0 0", "dir/a.rad:1: void mesh a: `mesh` is not supported"),
        ("void trans2 t 0 0 0", "dir/a.rad: holds no surface"),
        (
            "m polygno a 0 0 9 0 0 0 1 0 0 1 1 0",
            "dir/a.rad:1: m polygno a: `polygno` is not supported; did",
        ),
        ("void velvet v 1 2", "dir/a.rad:1: void velvet v: `velvet` is not supported; there are"),
        (
            "m instance a 1 a.oct 0 0",
            "dir/a.rad:1: m instance a: `instance` is not supported; write",
        ),
        (
            "d brightdata p 0 0 0\np light a 0 0 3 1 1 1\na sphere s 0 0 4 0 0 0 1",
            "dir/a.rad:2: a material that is modified by `p`; patterns",
        ),
        ("scale_factor 100\nvoid x l", "dir/a.rad:1: `scale_factor` is a word of SEC2; give the"),
        ("void point_light p 1 2 3", "dir/a.rad:1: `point_light` is a word of SEC2; give the"),
        ("void alias a b", "dir/a.rad:1: the alias of `b`, which is not defined"),
        ("void sphere a 0 0 4 0 0 0 1", "dir/a.rad:1: a surface without material; write"),
        ("m sphere a 0 0 4 0 0 0 0", "dir/a.rad:1: sphere `a`: a radius that is not above 0"),
        ("m polygon a 0 0 8 0 0 0 0 0 0 0 0", "dir/a.rad:1: polygon `a`: 8 numbers"),
        ("m cylinder a 0 0 7 0 0 0 0 0 0 1", "dir/a.rad:1: cylinder `a`: no extent"),
        ("!rm -r /tmp/x", "dir/a.rad:1: the command `rm -r /tmp/x`; of commands `!xform` and"),
        (
            "!xform -t 1 0 0 wall.rad | sort",
            "dir/a.rad:1: the command `xform -t 1 0 0 wall.rad | sort`",
        ),
        ("!xform -t 1 0 wall.rad", "dir/a.rad:1: `-t` without its numbers"),
        ("!xform -q wall.rad", "dir/a.rad:1: the option `-q` of xform is not known"),
        ("!xform -a 1e9 wall.rad", "dir/a.rad:1: `-a` is no number of copies from 1 to 100000"),
        ("!xform -a 1000 -a 1000 wall.rad", "dir/a.rad:1: more than 100000 copies"),
        ("!xform -t 1 0 0", "dir/a.rad:1: `!xform` without a file"),
        ("!xform /etc/passwd", "dir/a.rad:1: `/etc/passwd` is no relative path"),
        ("!xform ../none.rad", "dir/a.rad:1: dir/../none.rad: there is no such file"),
        ("!xform a.rad", "dir/a.rad:1: `a.rad` names itself"),
        ("!xform again.rad", "dir/again.rad:1: `again.rad` names itself"),
        ("!xform none.rad", "dir/a.rad:1: dir/none.rad: there is no such file"),
        ("\0", "dir/a.rad: is not text but binary"),
    ] {
        let error = parse(text, Dialect::Radiance).unwrap_err().to_string();
        assert!(error.starts_with(start), "{error}\n{start}");
    }
}

const FILES: &[&str] = &[
    "void plastic white 0 0 5 .8 .8 .8 .1 0 # paint\nvoid light lum\n0\n0\n3 10 10 10\nwhite polygon floor\n0\n0\n12\n0 0 0\n\
     1 0 0\n1 1 0\n0 1 0\nlum cylinder n1 0 0 7 0 0 1 1 0 1 .01\n!xform -n a -a 3 -t 1 0 0 -rz 30 wall.rad\n",
    "scale_factor 100\nvoid light l 0 0 1 1 2 3\nvoid x lum\nvoid point p 1 2 3\nvoid trans t 0 0 7 .1 .1 .1 .1 0 .5 0\n\
     t ring r 0 0 8 0 0 0 0 0 1 0 1\nt sphere s 0 0 4 0 0 0 1\nt cone c 0 0 8 0 0 0 0 0 1 1 0\nvoid alias u t\nu bubble b 0 0 4 0 0 0 2\n",
];
const WORDS: &[&str] = &[
    "void",
    "polygon",
    "sphere",
    "cylinder",
    "ring",
    "cup",
    "alias",
    "light",
    "glow",
    "BSDF",
    "void BSDF white 6 0 a.xml 0 1 0 . 0 0",
    "illum",
    "source",
    "velvet",
    "12",
    "!xform",
    "!cat wall.rad",
    "-a",
    "-i",
    "-mx",
    "-s",
    "wall.rad",
    "again.rad",
    "../x",
    "5",
];

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_spoiled_room_panics(bytes in spoiled(FILES, WORDS), sec2 in any::<bool>()) {
        let text = String::from_utf8_lossy(&bytes);
        match parse(&text, if sec2 { Dialect::Sec2 } else { Dialect::Radiance }) {
            Err(error) => check_error(&error, Path::new("dir/")),
            Ok(file) => {
                let parts = file.parts.iter().flat_map(|part| &part.triangles);
                let all = parts.chain(file.lamps.iter().flat_map(|lamp| &lamp.triangles));
                prop_assert!(all.flatten().all(|p| p.is_finite()));
            }
        }
    }
}
