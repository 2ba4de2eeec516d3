//! The size of a page of 3 million triangles, and the time that it takes to open.

use super::{chromium::Page, number};
use crate::{common::TestScene, rendered::done};
use std::{fmt::Write, fs};

/// Number of copies of a plant, which has 50 leaves of 200 triangles each: 3,000,000 triangles in
/// all.
const PLANTS: usize = 300;

/// Returns the OBJ text of a plant with curved leaves in a spiral around its stem.
fn plant() -> String {
    const SIDE: usize = 10;
    let mut obj = String::new();
    for leaf in 0..50 {
        let (sine, cosine) = (2.39996 * leaf as f64).sin_cos();
        let _ = writeln!(obj, "g leaf{}", leaf + 1);
        for i in 0..=SIDE {
            for j in 0..=SIDE {
                let [along, across] = [i, j].map(|i| i as f64 / SIDE as f64);
                let (r, half) = (0.01 + 0.25 * along, 0.08 * (across - 0.5));
                let (x, y) = (r * cosine - half * sine, r * sine + half * cosine);
                let z = 0.05 + 0.018 * leaf as f64 + 0.12 * along - 0.15 * along * along;
                let _ = writeln!(obj, "v {x:.5} {y:.5} {z:.5}");
            }
        }
        for i in 0..SIDE * SIDE {
            let first = 1 + leaf * (SIDE + 1) * (SIDE + 1) + i / SIDE * (SIDE + 1) + i % SIDE;
            let beside = first + SIDE + 1;
            let _ = writeln!(obj, "f {first} {beside} {} {}", beside + 1, first + 1);
        }
    }
    obj
}

/// Returns a field of these plants under lamps. The light is read from 10 million arrivals with the
/// 50 nearest of them, so it differs from triangle to triangle, with a noise of 14 %.
fn field(bands: usize, lamps: usize) -> TestScene {
    let names = (0..bands).map(|b| format!(r#"{{"name": "b{b}"}}"#)).collect::<Vec<_>>().join(", ");
    let of_bands = |values: [f64; 2]| format!("{:?}", &values[..bands]);
    let instance = |i: usize| {
        let (x, y, scale) =
            (0.45 * (i % 20) as f64, 0.45 * (i / 20) as f64, 1.0 + 0.0005 * i as f64);
        format!(
            r#"{{"translate": [{x}, {y}, 0], "rotate_deg": [0, 0, {}], "scale": {scale}}}"#,
            37 * i
        )
    };
    let lamp = |i: usize| {
        let (x, power) = (1.0 + 3.0 * i as f64, of_bands([100.0, 60.0]));
        format!(
            r#"{{"name": "lamp{i}", "type": "point", "position": [{x}, 3, 2.5], "power": {power}}}"#
        )
    };
    let sensor = |i: usize| {
        let (x, y) = (0.2 + 0.9 * (i % 10) as f64, 0.2 + 1.1 * (i / 10) as f64);
        format!(
            r#"{{"name": "s{i}", "disc": {{"center": [{x}, {y}, 1.3], "normal": [0, 0, 1], "radius": 0.02}}}}"#
        )
    };
    let list = |count: usize, of: &dyn Fn(usize) -> String| {
        (0..count).map(of).collect::<Vec<_>>().join(",\n")
    };
    let scene = format!(
        r#"{{"bands": [{names}],
        "materials": {{"soil": {{"type": "lambert", "reflectance": 0.2}},
            "leaf": {{"type": "leaf", "reflectance": {}, "transmittance": {}}}}},
        "objects": [{{"name": "soil", "obj": "soil.obj", "material": "soil"}},
            {{"name": "plant", "obj": "plant.obj", "material": "leaf", "instances": [{}]}}],
        "lights": [{}], "captors": [{}],
        "settings": {{"photons": 1000000, "map_photons": 10000000, "k": 50}}}}"#,
        of_bands([0.1, 0.4]),
        of_bands([0.05, 0.4]),
        list(PLANTS, &instance),
        list(lamps, &lamp),
        list(60, &sensor),
    );
    let soil = "v -1 -1 0\nv 10 -1 0\nv 10 8 0\nv -1 8 0\nf 1 2 3 4\n";
    TestScene::new(&scene, &[("plant.obj", &plant()), ("soil.obj", soil)])
}

/// The page for one band and one lamp is smaller than 15 MB. How long it takes from opening its
/// address to the picture is printed. A further band or lamp adds at most 4 MB.
#[test]
#[ignore = "takes minutes, and needs Chromium: .ci/nightly runs it"]
fn nightly_a_page_of_three_million_triangles_is_light() {
    let weight = |bands, lamps| {
        let scene = field(bands, lamps);
        done(&scene.path(""), &["view", "scene.json"]);
        let bytes = fs::metadata(scene.path("view.html")).expect("the page").len();
        println!("{bands} bands, {lamps} lamps: {:.2} MB", bytes as f64 / 1e6);
        (scene, bytes)
    };
    let (scene, first) = weight(1, 1);
    assert!(first < 15_000_000, "{first}");
    let page = Page::open(&scene.path("view.html"));
    page.wait_for("document.documentElement.dataset.ready === 'yes'");
    page.settle();
    let opened = number(&page, "performance.now()") / 1000.0;
    println!("opened in {opened:.1} s, {} triangles", number(&page, "facts.tiles"));
    assert!(number(&page, "facts.tiles") >= 3e6);
    page.no_complaints();
    let (_, two_bands) = weight(2, 1);
    assert!(two_bands - first <= 4_000_000, "a band: {}", two_bands - first);
    let [(_, two), (_, three)] = [2, 3].map(|lamps| weight(1, lamps));
    assert!(three - two <= 4_000_000, "a lamp: {}", three - two);
}
