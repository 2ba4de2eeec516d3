//! What the page shows when it is opened: the captors from near by, in light that is easy to read,
//! on large and on small screens.

use std::fs;

use serde_json::json;

use super::{bay, hover, number, open, text};
use crate::{
    common::TestScene,
    world::{Mesh, World},
};

/// Returns the bay in a hall that is six times as large.
fn hall() -> TestScene {
    let scene = bay();
    let plain = fs::read_to_string(scene.path("scene.json")).expect("the scene");
    let hall = r#""objects": [{"name": "hall", "obj": "hall.obj", "material": "grey"}, "#;
    fs::write(scene.path("scene.json"), plain.replacen(r#""objects": ["#, hall, 1))
        .expect("written");
    // its faces are a floor and a back wall
    let obj =
        "v 7 -3 -1\nv 14 -3 -1\nv 14 4 -1\nv 7 4 -1\nv 7 4 3\nv 14 4 3\nf 1 2 3 4\nf 4 3 6 5\n";
    fs::write(scene.path("hall.obj"), obj).expect("written");
    scene
}

/// The page opens with all captors in view and as large as they can be, however large the scene is.
/// The key a shows the whole scene.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_the_page_opens_at_the_captors() {
    let page = open(&hall(), &["--photons", "20000"]);
    let most = "Math.max(...[0, 1, 2, 3, 4, 5, 6, 7].flatMap((i) => {
        const side = (bit) => (i & bit ? 1 : -1);
        const at = new T.Vector3(side(1), side(2), side(4)).multiply(captorBox.half).add(captorBox.middle).project(camera);
        return [Math.abs(at.x), Math.abs(at.y)]; }))";
    let seen = number(&page, most);
    assert!((0.8..=1.0).contains(&seen), "the captors reach to {seen} of the picture");
    page.evaluate(
        "document.body.dispatchEvent(new KeyboardEvent('keydown', { key: 'a', bubbles: true })); 0",
    );
    let seen = number(&page, most);
    assert!(seen < 0.6, "the captors reach to {seen} of the picture");
    page.no_complaints();
}

/// A scene without captors has its page too: no table, no field to find them, but its light and its
/// photons, and pictures of both.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_a_scene_without_captors_is_shown() {
    let scene = World::new()
        .material("grey", json!({ "type": "lambert", "reflectance": 0.5 }))
        .surface("floor", "grey", &Mesh::square([0.0; 3], [0.0, 0.0, 1.0], 1.0))
        .light(json!({ "type": "point", "power": 10, "position": [0, 0, 1] }))
        .write();
    let page = open(&scene, &["--photons", "20000"]);
    assert_eq!(page.evaluate("element('tableSection').hidden"), true);
    assert!(number(&page, "shownRange.most") > 0.0);
    let bright = number(&page, "picture().height");
    page.evaluate("element('photons').click(); element('fly').click(); 0");
    page.wait_for("points.material.uniforms.time.value > 0");
    page.evaluate(
        "document.body.dispatchEvent(new KeyboardEvent('keydown', { key: ' ', bubbles: true })); 0",
    );
    assert_eq!(number(&page, "points.material.uniforms.time.value"), -1.0);
    assert!(number(&page, "picture().height") > 300.0 && bright > 300.0);
    page.no_complaints();
}

/// A plane that is much larger than the other captors is an outline until it is filled.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_large_planes_are_outlines() {
    let scene = bay();
    let plain = fs::read_to_string(scene.path("scene.json")).expect("the scene");
    let plane = r#""captors": [{"name": "plane", "disc": {"center": [10.5, 0.5, 0.3], "normal": [0, 0, 1], "radius": 0.45}}, "#;
    fs::write(scene.path("scene.json"), plain.replacen(r#""captors": ["#, plane, 1))
        .expect("written");
    let page = open(&scene, &["--photons", "20000"]);
    let flag = |name: &str| {
        let flags = format!(
            "valueTexture.image.data[4 * parts.find((p) => facts.captors[p.captor] === '{name}').first + 3]"
        );
        number(&page, &format!("{flags} & 1"))
    };
    assert_eq!([flag("plane"), flag("s0")], [1.0, 0.0], "hidden is 1");
    assert_eq!(
        page.evaluate("outlines.visible && outlines.geometry.getAttribute('position').count > 10"),
        true
    );
    page.evaluate("element('planes').click(); 0");
    assert_eq!([flag("plane"), flag("s0")], [0.0, 0.0], "hidden is 1");
    assert_eq!(page.evaluate("outlines.visible"), false);
    assert!(text(&page, "linkText()").contains("planes=1"));
    page.no_complaints();
}

/// A scene that repeats stands among its images, and its own cell is outlined. The mouse reads a leaf
/// on any image of it.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_a_scene_that_repeats_shows_its_images() {
    let leaf = Mesh::square([0.5, 0.5, 0.5], [0.0, 0.0, 1.0], 0.4);
    let scene = World::new()
        .with("periodic", json!({ "x": [0, 1], "y": [0, 2], "slope": [0.1, 0] }))
        .material("leaf", json!({ "type": "lambert", "reflectance": 0.5 }))
        .counted("leaf", "leaf", &leaf)
        .light(json!({ "type": "point", "power": 10, "position": [0.5, 0.5, 2] }))
        .write();
    let page = open(&scene, &["--photons", "20000"]);
    page.settle();
    let shown = "images.filter((image) => image.visible).length / (meshes.length - images.length)";
    assert_eq!(number(&page, shown), 8.0);
    let shift = page.evaluate("shifts().find(([x, y]) => x > 0 && y > 0)");
    assert_eq!(shift, json!([1, 2, 0.1]));
    // the middle of the leaf in the next cell along x, where the page shows it
    let captor = "(() => {
        const at = new T.Vector3(...cornersOf(0)[0]).add(new T.Vector3(...cornersOf(0)[1])).add(new T.Vector3(...cornersOf(0)[2]));
        at.multiplyScalar(1 / 3).add(new T.Vector3(1, 0, 0.1)).project(camera);
        const box = renderer.domElement.getBoundingClientRect();
        const tile = tileAt(box.x + ((at.x + 1) / 2) * box.width, box.y + ((1 - at.y) / 2) * box.height);
        return tile < 0 ? '' : facts.captors[partOf(tile).captor]; })()";
    page.evaluate("lookAtAll(); draw(); 0");
    page.settle();
    assert_eq!(text(&page, captor), "leaf/leaf");
    page.evaluate("element('images').click(); 0");
    page.settle();
    assert_eq!(number(&page, shown), 0.0);
    assert_eq!(page.evaluate("cellOutline.visible"), false);
    assert_eq!(text(&page, captor), "");
    assert!(text(&page, "linkText()").contains("images=0"));
    page.no_complaints();
}

/// On a phone the colour bar stays in view below the picture, and the settings unfold below it.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_a_phone_shows_the_colour_bar() {
    let page = open(&bay(), &["--results", "results.json", "--no-trace"]);
    page.resize(390, 844);
    page.settle();
    let height =
        |id: &str| number(&page, &format!("element('{id}').getBoundingClientRect().height"));
    assert!(height("bar") > 10.0 && height("unit") > 10.0, "no bar");
    assert_eq!([height("band"), height("objects"), height("low")], [0.0; 3], "folded");
    let picture = height("stage");
    assert!(picture > 0.8 * 844.0, "the picture is {picture} pixels high");
    page.evaluate("element('menu').click(); 0");
    page.settle();
    assert!(height("band") > 10.0, "unfolded");
    assert_eq!(page.evaluate("element('stage').getBoundingClientRect().bottom <= element('panel').getBoundingClientRect().top + 1"), true);
    page.no_complaints();
}

/// The numbers of a captor stand beside it.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_numbers_do_not_cover_what_they_tell_of() {
    let page = open(&bay(), &["--results", "results.json", "--no-trace"]);
    for captor in ["s0", "plant/leaf2#1"] {
        assert!(hover(&page, captor).starts_with(captor));
        let covered = "(() => { const [tip, stageBox] = [element('tip').getBoundingClientRect(), stage.getBoundingClientRect()];
            const own = aroundTiles(parts.filter((p) => p.captor === state.found).flatMap(tilesOf), stageBox.width / 2, stageBox.height / 2, stageBox);
            const [left, top] = [tip.left - stageBox.left, tip.top - stageBox.top];
            return left < own.right && left + tip.width > own.left && top < own.bottom && top + tip.height > own.top; })()";
        assert_eq!(page.evaluate(covered), false, "{captor}");
    }
    page.no_complaints();
}

/// Light is smoothed for the eye: it varies less from place to place, and its mean over a wall stays.
/// The numbers under the mouse are those of the estimate, with its error.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_light_is_smoothed_and_numbers_are_not() {
    let page = open(&bay(), &["--results", "results.json"]);
    let found = page.evaluate(
        "(() => { const raw = [], even = [];
         for (const part of parts) if (part.captor < 0) for (let t = part.first; t < part.end; t++) {
           const value = valueTexture.image.data[4 * t];
           if (!(value > 0)) continue;
           for (let i = 3 * t; i < 3 * t + 3; i++) for (let j = meetings[i]; j < meetings[i + 1]; j++) {
             raw.push([value, valueTexture.image.data[4 * meeting[j]]]);
             even.push([cornerTexture.image.data[8 * t + i % 3], cornerTexture.image.data[8 * meeting[j]]]);
           } }
         const mean = (list) => list.reduce((sum, [a]) => sum + a, 0) / list.length;
         const jumps = (list) => list.reduce((sum, [a, b]) => sum + Math.abs(a - b), 0) / list.length / mean(list);
         return [jumps(even) / jumps(raw), mean(even) / mean(raw), facts.localError]; })()",
    );
    let value = |i: usize| found[i].as_f64().expect("a number");
    assert!(value(0) < 0.75, "jumps are {} of what they were", value(0));
    assert!((value(1) - 1.0).abs() < 0.03, "the mean is {} of what it was", value(1));
    assert!((value(2) - 10f64.sqrt().recip()).abs() < 1e-6, "10 photons at each place");
    let tip = hover(&page, "plant/leaf2#1");
    let line = tip.lines().find(|line| line.contains("here, front")).expect("the place");
    assert!(line.contains('±'), "{tip}");
    page.no_complaints();
}
