//! Photons of the page: where they lie, where they come from, and how they fly.

use serde_json::json;

use super::{bay, number, open, text};
use crate::{
    common::TestScene,
    rendered::{done, scene},
    world::{Mesh, World},
};
use std::fs;

/// The flights of a path follow each other: the first begins on its lamp, each further one where the
/// flight before has ended, and later. Every flight is as long as its time. All lights have photons.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_photons_fly_along_their_paths() {
    let page = open(&bay(), &["--photons", "20000"]);
    let found = page.evaluate(
        "(() => { const { count, links, lightOf, materials, bounces } = photons;
         const at = (name, i) => [0, 1, 2].map((axis) => facts.min[axis] + points.geometry.getAttribute(name).array[3 * i + axis] / 65535 * facts.size[axis]);
         const times = points.geometry.getAttribute('times').array, step = Math.max(...facts.size) / 65535;
         const far = (a, b) => Math.hypot(...a.map((x, k) => x - b[k]));
         let [off, broken, early, longest, first, speeds] = [0, 0, 0, 0, 0, []];
         for (let i = 0; i < count; i++) {
           const [start, end] = [at('start', i), at('position', i)];
           const lamp = facts.lights[lightOf[i]];
           if (materials[i] === 0xffffffff) { first++; off = Math.max(off, far(start, lamp.min)); }
           if (links[i]) broken = Math.max(broken, far(start, at('position', i - 1)));
           if (links[i] && (times[2 * i] < times[2 * i - 1] - 1e-3 || bounces[i] < bounces[i - 1])) early++;
           if (far(start, end) > 0.2) speeds.push(far(start, end) / (times[2 * i + 1] - times[2 * i]));
           longest = Math.max(longest, times[2 * i + 1]);
         }
         return { off: off / step, broken: broken / step, early, first, count, links: links.reduce((a, b) => a + b, 0), longest: Math.abs(longest - lastTime) < 1e-6,
           speed: Math.min(...speeds) / Math.max(...speeds), lights: new Set(lightOf).size }; })()",
    );
    let value = |key: &str| found[key].as_f64().expect(key);
    // both lamps are points; places are kept to a step of the box, directions to some 1e-5
    assert!(value("off") < 8.0 && value("broken") < 3.0, "{found}");
    assert_eq!([value("early"), value("lights")], [0.0, 2.0], "{found}");
    assert_eq!(value("links") + value("first"), value("count"), "in a closed room: {found}");
    assert!(value("speed") > 0.99 && found["longest"] == true, "{found}");
    page.no_complaints();
}

/// Played, photons leave the lamp and arrive; stopped, all lie where they arrived. Colours are
/// those of the legend.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_photons_are_played_and_coloured() {
    let page = open(&bay(), &["--photons", "20000"]);
    let picture = || text(&page, "render(), renderer.domElement.toDataURL()");
    page.evaluate("element('photons').click(); 0");
    let still = picture();
    page.evaluate("element('fly').click(); 0");
    page.wait_for("points.material.uniforms.time.value > 0.5");
    assert_ne!(picture(), still);
    page.key("Escape", 27);
    page.settle();
    assert_eq!(number(&page, "points.material.uniforms.time.value"), -1.0);
    assert!(picture() == still, "all lie where they arrived");
    for (colour, name) in [
        ("lamp", "lamp"),
        ("lamp", "far"),
        ("surface", "straight from its lamp"),
        ("surface", "grey"),
        ("band", "b&<"),
        ("bounce", "0"),
    ] {
        page.evaluate(&format!(
            "element('photonColour').value = '{colour}'; element('photonColour').dispatchEvent(new Event('change')); 0"
        ));
        let names = page.evaluate("legend.map(({ name }) => name)");
        let names = names.as_array().expect("names");
        assert!(names.contains(&json!(name)), "{colour}: {names:?}");
        let shown = text(&page, "element('photonLegend').innerText");
        assert!(shown.contains(name), "{shown}");
        // nearly every photon has a colour of the legend; the longest paths share the last one
        let others = "(() => { const known = new Set(legend.map(({ colour }) => [...colour].join()));
            const all = points.geometry.getAttribute('paint').array; let others = 0;
            for (let i = 0; i < photons.count; i++) others += !known.has([...all.subarray(3 * i, 3 * i + 3)].join());
            return others / photons.count; })()";
        assert!(number(&page, others) < 0.02, "{colour}");
    }
    page.no_complaints();
}

/// Points are small where photons lie close together.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_points_are_small_where_photons_are_many() {
    let page = open(&bay(), &["--photons", "20000"]);
    let ratio = number(
        &page,
        "(() => { const of = new Map(); const side = 1 / 8;
         for (let i = 0; i < photons.count; i++) {
           const key = [0, 1, 2].map((a) => Math.floor(photons.places[3 * i + a] / 65536 / side)).join();
           if (!of.has(key)) of.set(key, []);
           of.get(key).push(allRadii[i]);
         }
         const cells = [...of.values()].sort((a, b) => a.length - b.length);
         const mean = (lists) => { const all = lists.flat(); return all.reduce((a, b) => a + b, 0) / all.length; };
         const third = Math.floor(cells.length / 3);
         return mean(cells.slice(-third)) / mean(cells.slice(0, third)); })()",
    );
    assert!(ratio < 0.85, "{ratio}");
    page.no_complaints();
}

/// A photon's disc is whole, though it lies in a face: of all that is seen of them where nothing
/// hides them, nearly all is seen on the floor that they lie on.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_photons_are_whole_on_their_faces() {
    let scene = World::new()
        .with("settings", json!({ "photons": 500, "map_photons": 400, "k": 10 }))
        .material("grey", json!({ "type": "lambert", "reflectance": 0.5 }))
        .counted("floor", "grey", &Mesh::square([0.0; 3], [0.0, 0.0, 1.0], 1.0))
        .light(json!({ "type": "point", "power": 10, "position": [0, 0, 1] }))
        .write();
    let page = open(&scene, &[]);
    // sizes of points are set where the page is drawn
    page.evaluate("element('photons').click(); lookAt(boxShown(), direction(20, 60)); render(); 0");
    let of = |floor: bool| {
        let seen = format!(
            "(() => {{ meshes.forEach((mesh) => (mesh.visible = {floor}));
             const pixels = (shown) => {{
               points.visible = shown; renderer.render(scene, camera);
               const g = renderer.getContext();
               const all = new Uint8Array(4 * g.drawingBufferWidth * g.drawingBufferHeight);
               g.readPixels(0, 0, g.drawingBufferWidth, g.drawingBufferHeight, g.RGBA, g.UNSIGNED_BYTE, all);
               return all; }};
             const [without, all] = [pixels(false), pixels(true)];
             let seen = 0;
             for (let i = 0; i < all.length; i += 4) seen += Math.abs(all[i] - without[i]) > 30;
             return seen; }})()"
        );
        number(&page, &seen)
    };
    let (alone, on_the_floor) = (of(false), of(true));
    assert!(alone > 500.0 && on_the_floor > 0.9 * alone, "{on_the_floor} of {alone}");
    page.no_complaints();
}

/// Photons that lie on a hidden material are hidden with it. Of the pane its four edges are seen, but
/// not of its diagonal, until the object is hidden.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_photons_on_hidden_glass_are_hidden() {
    let pane = Mesh::square([0.0, 0.0, 0.5], [0.0, 0.0, 1.0], 1.0);
    let floor = Mesh::square([0.0; 3], [0.0, 0.0, 1.0], 1.0);
    let scene = World::new()
        .material("glass", json!({ "type": "transparent", "ior": 1.5, "thin": true }))
        .material("grey", json!({ "type": "lambert", "reflectance": 0.5 }))
        .surface("pane", "glass", &pane)
        .counted("floor", "grey", &floor)
        .light(json!({ "type": "point", "power": 10, "position": [0, 0, 1] }))
        .write();
    let page = open(&scene, &["--photons", "5000"]);
    let hidden = "points.geometry.getAttribute('radius').array.reduce((n, r, i) => n + (r === 0 && facts.materials[photons.surfaces[i]].name === 'glass'), 0)";
    let glass = "photons.surfaces.reduce((n, m) => n + (facts.materials[m].name === 'glass'), 0)";
    assert!(number(&page, glass) > 100.0);
    assert_eq!(number(&page, hidden), number(&page, glass));
    page.evaluate("element('materials').querySelector(`[data-key=\"${facts.materials.findIndex(({ name }) => name === 'glass')}\"]`).click(); 0");
    assert_eq!(number(&page, hidden), 0.0);
    let edges = "glass.map((lines) => lines.geometry.getAttribute('position').count).join()";
    assert_eq!(text(&page, edges), "8");
    let pane = "facts.objects.indexOf('pane')";
    page.evaluate(&format!("state.hidden.object.add({pane}); repaint(false); 0"));
    assert_eq!(page.evaluate("glass[0].visible"), false);
    page.evaluate(&format!("state.hidden.object.delete({pane}); repaint(false); 0"));
    assert_eq!(page.evaluate("glass[0].visible"), true);
    // through the pane: the flight to the floor begins at the pane
    let through = "photons.links.reduce((n, link, i) => n + (link && facts.materials[photons.materials[i]].name === 'glass'), 0)";
    assert!(number(&page, through) > 100.0);
    page.no_complaints();
}

/// Returns the size that the page's facts give for its data.
fn size_of_data(scene: &TestScene) -> (u64, String) {
    done(&scene.path(""), &["view", "scene.json", "--photons", "20000"]);
    let html = fs::read_to_string(scene.path("view.html")).expect("the page");
    let (_, facts) = html.split_once("id=\"facts\">").expect("the facts");
    let facts = facts.split("</script>").next().expect("their end");
    let facts: serde_json::Value = serde_json::from_str(facts).expect("JSON");
    (facts["bytes"].as_u64().expect("a size"), html)
}

/// The page says before its data how long these are, and each list of numbers has the length that
/// its element says.
#[test]
fn the_page_says_how_much_data_it_has() {
    let (size, html) = size_of_data(&scene());
    let mut sum = 0;
    let lists = html.split("data-size=\"").skip(1);
    for list in lists.filter(|list| list.contains("\" id=\"")) {
        let (length, rest) = list.split_once('"').expect("a length");
        let Ok(length) = length.parse::<u64>() else { continue };
        let text = rest.split_once('>').and_then(|(_, text)| text.split_once("</script>"));
        assert_eq!(text.expect("its text").0.len() as u64, length);
        sum += length;
    }
    assert!(sum > 10_000);
    assert_eq!(sum, size);
    let place = |what: &str| html.find(what).unwrap_or_else(|| panic!("no {what}"));
    assert!(place("id=\"progress\"") < place("watchLoading();\n"));
    assert!(place("watchLoading();\n") < place("id=\"facts\">"));
}
