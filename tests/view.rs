//! `phylux view`: the page that it writes, and what the page does in a browser. The tests that need
//! a browser (Chromium) have names that begin with `needs_chromium_`.

mod chromium;
mod controls;
mod copies;
mod histories;
mod hours;
mod opening;
mod photons;
mod weight;

use std::{fs, path::Path};

use serde_json::Value;

use crate::{
    common::TestScene,
    rendered::{done, scene},
};
use chromium::Page;

/// Writes the page of a scene and opens it in the browser.
fn open(scene: &TestScene, more: &[&str]) -> Page {
    done(&scene.path(""), &[&["view", "scene.json"], more].concat());
    let page = Page::open(&scene.path("view.html"));
    page.wait_for("document.documentElement.dataset.ready === 'yes'");
    page
}

/// Looks at a captor from close by and moves the mouse over it. Returns the text that the page
/// shows there.
fn hover(page: &Page, captor: &str) -> String {
    let name = serde_json::to_string(captor).expect("text");
    page.evaluate(&format!(
        "element('find').value = {name}; element('find').dispatchEvent(new Event('change')); 0"
    ));
    let stage = |what| page.evaluate(&format!("stage.getBoundingClientRect().{what}"));
    let number = |what| stage(what).as_f64().expect("a number");
    page.settle();
    page.mouse("mouseMoved", number("left") + number("width") / 2.0, number("height") / 2.0);
    page.settle();
    text(page, "element('tip').innerText")
}

fn text(page: &Page, expression: &str) -> String {
    page.evaluate(expression).as_str().unwrap_or_default().to_string()
}

/// With the mouse over a captor, the page shows the captor's irradiance and standard error as they
/// are in the results file, to the digits shown. A click adds the captor to the list, and the CSV
/// table holds the same numbers as the results.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_a_known_captor_shows_its_numbers() {
    let scene = scene();
    done(&scene.path(""), &["run", "scene.json", "-o", "results.json"]);
    let page = open(&scene, &["--results", "results.json"]);
    let results: Value =
        serde_json::from_slice(&fs::read(scene.path("results.json")).expect("results"))
            .expect("JSON");
    let front = &results["captors"][1]["front"];
    let tip = hover(&page, "sensor");
    assert!(tip.starts_with("sensor"), "{tip}");
    let line = tip.lines().find(|line| line.trim().starts_with("front")).expect("its front");
    let cells: Vec<&str> = line.split('\t').map(str::trim).collect();
    assert_eq!((cells[0], cells[4]), ("front", "W/m²"), "{tip}");
    for band in 0..3 {
        let (value, error) = cells[1 + band].split_once(" ± ").expect("an error");
        for (shown, known) in [(value, "irradiance"), (error, "irradiance_se")] {
            let digits = shown.split_once('.').map_or(0, |(_, decimals)| decimals.len() as i32);
            let known = front[known][band].as_f64().expect("a number");
            let shown: f64 = shown.parse().expect("a number");
            assert!((shown - known).abs() <= 0.51 * 10f64.powi(-digits), "{line}: {known}");
        }
    }

    page.click();
    let listed = text(&page, "element('table').innerText");
    assert!(listed.contains("sensor") && listed.contains(cells[1]), "{listed}");
    let csv = text(&page, "csv()");
    let row = csv.lines().find(|row| row.starts_with("sensor,front,a,irradiance,")).expect("a row");
    let value: f64 = row.split(',').nth(4).expect("a value").parse().expect("a number");
    let known = front["irradiance"][0].as_f64().expect("a number");
    assert!((value / known - 1.0).abs() < 1e-6, "{row}: {known}");

    // the list is emptied by its button and by nothing else
    page.evaluate("element('clear').click(); element('clear').click(); 0");
    assert!(text(&page, "element('table').innerText").contains("sensor"));
    page.evaluate("element('clearListed').click(); 0");
    assert!(!text(&page, "element('table').innerText").contains("sensor"));

    // a surface that is not a captor shows the light at the place of the mouse
    page.evaluate("controls.target.set(0, 0, 0.6); camera.position.set(0, 0, 0.3); controls.update(); draw(); 0");
    page.settle();
    page.mouse("mouseMoved", 700.0, 300.0);
    page.settle();
    let tip = text(&page, "element('tip').innerText");
    assert!(tip.starts_with("walls") && tip.contains("here, front"), "{tip}");
    page.no_complaints();
}

/// A name that tries to break out of its element, as JSON text without its quotes.
const EVIL: &str =
    r#"</script><script>document.title = 'taken'</script><img src=x onerror=alert(1)> <!-- & \" é"#;

/// Returns the scene with this name for the room and for the sensor.
fn evil_scene() -> TestScene {
    let scene = scene();
    let plain = fs::read_to_string(scene.path("scene.json")).expect("the scene");
    let text_of = |name: &str| {
        plain
            .replace("\"sensor\"", name)
            .replace(r#"room <b>1</b> & \"2\""#, name.trim_matches('"'))
    };
    fs::write(scene.path("scene.json"), text_of(&format!("\"{EVIL}\""))).expect("written");
    scene
}

/// Names that try to break out of their element do not become markup.
#[test]
fn names_are_no_markup() {
    let scene = evil_scene();
    done(&scene.path(""), &["view", "scene.json"]);
    let html = fs::read_to_string(scene.path("view.html")).expect("the page");
    assert!(!html.contains("<script>document.title"), "a name became markup");
    assert!(!html.contains("<img src=x"), "a name became markup");
}

/// Names that try to break out of their element are shown as plain text.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_names_are_text() {
    let page = open(&evil_scene(), &[]);
    let name: String = EVIL.replace("\\\"", "\"");
    assert_eq!(text(&page, "document.title"), name);
    assert_eq!(text(&page, "element('name').textContent"), name);
    let tip = hover(&page, &name);
    assert!(tip.contains("</script>"), "{tip}");
    page.no_complaints();
}

/// Every control (bands, quantities, scales, hiding, photons and others) changes the picture, and
/// the browser reports no error.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_every_control_does_something() {
    let scene = scene();
    let page = open(&scene, &[]);
    let pixels = || {
        page.settle();
        text(&page, "render(), renderer.domElement.toDataURL()")
    };
    let mut before = pixels();
    for (what, action) in [
        ("band", "element('band').value = 0; element('band').dispatchEvent(new Event('change'))"),
        (
            "range",
            "element('high').value = '3'; element('high').dispatchEvent(new Event('change'))",
        ),
        ("log", "element('log').click()"),
        ("smooth light", "element('smooth').click()"),
        (
            "captors",
            "element('values').value = 'captor'; element('values').dispatchEvent(new Event('change'))",
        ),
        (
            "quantity",
            "element('quantity').value = 'absorbed'; element('quantity').dispatchEvent(new Event('change'))",
        ),
        ("cut", "element('cut').value = 0.5; element('cut').dispatchEvent(new Event('input'))"),
        (
            "clip planes",
            "element('cut').value = 0; element('cut').dispatchEvent(new Event('input'));
             const plane = element('clip').querySelectorAll('input')[1]; plane.value = 0.5; plane.dispatchEvent(new Event('input'))",
        ),
        ("unlit sides", "element('dark').click()"),
        ("lines at edges", "element('shade').click()"),
        ("an object", "element('objects').querySelectorAll('input')[1].click()"),
        ("a material", "element('materials').querySelector('input').click()"),
        (
            "photons",
            "element('materials').querySelector('input').click(); element('photons').click()",
        ),
        (
            "bounces",
            "element('bounceLow').value = 2; element('bounceLow').dispatchEvent(new Event('input'))",
        ),
        (
            "power",
            "element('photonColour').value = 'power'; element('photonColour').dispatchEvent(new Event('change'))",
        ),
        (
            "size",
            "element('photonSize').value = 2; element('photonSize').dispatchEvent(new Event('input'))",
        ),
    ] {
        page.evaluate(&format!("{action}; 0"));
        let after = pixels();
        assert!(after.len() > 1000 && after != before, "{what} changed nothing");
        before = after;
    }
    page.no_complaints();
}

/// Returns the room with a second lamp, a row of sensors, one more sensor 1 cm from a lamp, and two
/// plants.
fn bay() -> TestScene {
    let scene = scene();
    let text = fs::read_to_string(scene.path("scene.json")).expect("the scene");
    let second = r#""power": [3, 5]}, {"name": "far", "type": "point", "position": [10.1, 0.5, 0.9], "power": [2, 1]}]"#;
    let plant = r#"{"name": "plant", "obj": "leaf.obj", "material": "grey", "captor": true,
        "instances": [{"translate": [10.2, 0.2, 0.1]}, {"translate": [10.7, 0.6, 0.1]}]}, {"name": "walls""#;
    let disc = |i: usize, z: f64| {
        let x = 10.15 + 0.1 * i as f64;
        format!(
            r#"{{"name": "s{i}", "disc": {{"center": [{x}, 0.5, {z}], "normal": [0, 0, 1], "radius": 0.03}}}}"#
        )
    };
    let row: Vec<String> = (0..6).map(|i| disc(i, 0.1)).chain([disc(6, 0.1)]).collect();
    let near = r#"{"name": "near", "disc": {"center": [10.5, 0.5, 0.49], "normal": [0, 0, 1], "radius": 0.005}}"#;
    let text = text
        .replacen(r#""map_photons": 80000, "k": 20"#, r#""map_photons": 20000, "k": 10"#, 1)
        .replacen(r#""power": [3, 5]}]"#, second, 1)
        .replacen(r#"{"name": "walls""#, plant, 1)
        .replacen(r#""captors": ["#, &format!(r#""captors": [{near}, {}, "#, row.join(", ")), 1);
    fs::write(scene.path("scene.json"), text).expect("written");
    let leaf =
        "v 0 0 0\nv 0.1 0 0\nv 0.1 0.1 0.05\nv 0 0.1 0.05\ng leaf1\nf 1 2 3\ng leaf2\nf 1 3 4\n";
    fs::write(scene.path("leaf.obj"), leaf).expect("written");
    done(&scene.path(""), &["run", "scene.json", "--by-light", "--k", "0", "-o", "results.json"]);
    scene
}

fn number(page: &Page, expression: &str) -> f64 {
    page.evaluate(expression).as_f64().unwrap_or_else(|| panic!("{expression} is no number"))
}

/// The sliders of the lamps show what `phylux mix` finds, with its errors. The light at places on
/// surfaces changes with them.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_lamps_can_be_dimmed() {
    let scene = bay();
    let page = open(&scene, &["--results", "results.json"]);
    done(
        &scene.path(""),
        &["mix", "results.json", "--power", "lamp=0.5,far=2", "-o", "mixed.json"],
    );
    let mixed: Value =
        serde_json::from_slice(&fs::read(scene.path("mixed.json")).expect("a mix")).expect("JSON");
    let wall = "localValue(parts.find((p) => p.captor < 0 && p.material >= 0).first + 7, FRONT, 0)";
    let before = number(&page, wall);
    page.evaluate(
        "[0.5, 2].forEach((power, i) => { const slider = element('lamps').querySelectorAll('input')[i];
         slider.value = power; slider.dispatchEvent(new Event('input')); }); 0",
    );
    for (kind, list) in [("captorValue", "captors"), ("groupValue", "groups")] {
        for (i, known) in mixed[list].as_array().expect("a list").iter().enumerate() {
            for (band, key) in [(0, "irradiance"), (2, "irradiance")] {
                for (part, key) in [("value", key.to_string()), ("error", format!("{key}_se"))] {
                    let known = known["front"][&key][band].as_f64().expect("a number");
                    let shown = number(&page, &format!("{kind}({i}, FRONT, {band}).{part}"));
                    assert!((shown / known - 1.0).abs() < 1e-5, "{list} {i}: {shown} {known}");
                }
            }
        }
    }
    let after = number(&page, wall);
    assert!(after > 0.0 && after != before, "{before} {after}");
    // the fractions by lamp are stored in one byte each, and add up to the whole within half a step
    // for each lamp
    page.evaluate("state.lamps.fill(1); makeLampSliders(); dimmed = true; 0");
    let same = number(&page, wall);
    assert!((same / before - 1.0).abs() < 1e-6, "{before} {same}");
    page.no_complaints();
}

/// Groups, plants and captors are shown as tables, which a click sorts. Their CSV text holds the
/// numbers of the results.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_tables_are_sorted_and_copied() {
    let scene = bay();
    let page = open(&scene, &["--results", "results.json", "--no-trace"]);
    let results: Value =
        serde_json::from_slice(&fs::read(scene.path("results.json")).expect("results"))
            .expect("JSON");
    let press = |what: &str, text: &str| {
        page.evaluate(&format!(
            "[...element('{what}').querySelectorAll('button')].find((b) => b.textContent.startsWith('{text}')).click(); 0"
        ));
    };
    let names = || {
        text(
            &page,
            "[...element('groupTable').tBodies[0].rows].map((r) => r.cells[0].textContent).join()",
        )
    };
    press("tableButtons", "plants");
    assert_eq!(names(), "plant#0,plant#1");
    press("groupTable", "name");
    assert_eq!(names(), "plant#1,plant#0");
    press("tableButtons", "captors");
    press("groupTable", "front a");
    let first = names().split(',').next().map(String::from).expect("a row");
    assert_eq!(first, "near", "1 cm from a lamp is the brightest");
    press("tableButtons", "groups");
    let csv = text(&page, "tableCsv()");
    for group in results["groups"].as_array().expect("groups") {
        let id = group["id"].as_str().expect("a name");
        let Some(absorbed) = group["absorbed"][0].as_f64().filter(|_| !id.contains('#')) else {
            continue;
        };
        let row = format!("{id},,a,absorbed,");
        let row = csv.lines().find_map(|line| line.strip_prefix(&row)).expect("its row");
        let values: Vec<f64> = row.split(',').map(|v| v.parse().expect("a number")).collect();
        let error = group["absorbed_se"][0].as_f64().expect("an error");
        assert!((values[0] / absorbed - 1.0).abs() < 1e-5, "{row}: {absorbed}");
        assert!((values[1] / error - 1.0).abs() < 1e-5, "{row}: {error}");
    }
    assert!(csv.lines().count() > 6, "{csv}");
    page.no_complaints();
}

/// At first the page shows the whole bed of sensors in the growth room and the lamps above it.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_lamps_above_the_captors_are_seen_at_first() {
    let folder = tempfile::tempdir().expect("a folder");
    let room = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/growth-room.json");
    let room = room.to_str().expect("UTF-8");
    done(folder.path(), &["view", room, "--photons", "5000", "-o", "view.html"]);
    let page = Page::open(&folder.path().join("view.html"));
    page.wait_for("document.documentElement.dataset.ready === 'yes'");
    let farthest = |places: &str| {
        let out = "({ x, y }) => Math.max(Math.abs(x), Math.abs(y))";
        number(
            &page,
            &format!(
                "Math.max(...{places}.map((p) => new T.Vector3(...p).project(camera)).map({out}))"
            ),
        )
    };
    let lamps = farthest("facts.lights.map(({ min }) => min)");
    let sensors = farthest(
        "parts.filter((part) => part.captor >= 0).flatMap((part) => tilesOf(part).flatMap(cornersOf))",
    );
    // 1 is the edge of the picture, and the room is larger than it
    assert!(lamps < 1.0 && sensors < 1.0 && lamps.max(sensors) > 0.6, "{lamps} {sensors}");
    page.no_complaints();
}

/// The range that the page chooses begins at 0 and ends where 98 % of the lit area is below, so that
/// walls and leaves have colours of their own however the sensors differ, or where 90 % of the light
/// is, if that at most doubles it, and up to three times as far for the light of most captors. One button
/// spreads the sensors over the colours.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_surfaces_and_sensors_have_colours_of_their_own() {
    let page = open(&bay(), &["--results", "results.json", "--no-trace"]);
    let ends = || (number(&page, "state.low"), number(&page, "state.high"));
    for band in 0..3 {
        page.evaluate(&format!("state.band = {band}; repaint(true); 0"));
        let above = number(
            &page,
            "(() => { const d = valueTexture.image.data; let above = 0, lit = 0;
               for (let t = 0; t < facts.tiles; t++) for (const f of [0, 1]) if (!(d[4 * t + 3] & 1) && d[4 * t + f] > 0) {
                 lit += areaOf(t); if (d[4 * t + f] > state.high) above += areaOf(t); }
               return above / lit; })()",
        );
        assert_eq!(ends().0, 0.0);
        assert!(above <= 0.02, "{above} of the lit area is above the range");
        page.evaluate("element('sensors').click(); 0");
        let middle = number(
            &page,
            "(() => { const s = sensorValues(), at = (q) => s[Math.round(q * (s.length - 1))];
             return (at(0.75) - at(0.25)) / (state.high - state.low); })()",
        );
        assert!(middle >= 0.19, "half of the sensors in {middle} of the colours");
    }
    // sensors that receive nearly the same are told apart too, because that bar need not begin at 0
    page.evaluate("captorValues.forEach((v, i) => { if (!(i % 2)) captorValues[i] = 100 + i % 97 / 97; }); repaint(true); element('sensors').click(); 0");
    let (low, high) = ends();
    assert!(low > 95.0 && high < 106.0, "{low} to {high}");
    // the scale ends at round numbers
    assert!(low.to_string().len() <= 6 && high.to_string().len() <= 6, "{low} to {high}");
    // a logarithmic bar begins above 0
    page.evaluate("state.log = true; repaint(true); 0");
    let (low, high) = ends();
    assert!(0.0 < low && low >= high / 1.1e4, "{low} to {high}");
    // light that is gathered on 1.5 % of the area has a place on the bar, if that does not dim all else
    page.evaluate("state.log = false; 0");
    let end = |gathered: f64, captor: i32| {
        page.evaluate(&format!(
            "(() => {{ const d = valueTexture.image.data; let all = 0, passed = 0;
               for (let t = 0; t < facts.tiles; t++) if (!(d[4 * t + 3] & 1)) all += areaOf(t);
               for (let t = 0; t < facts.tiles; t++) {{
                 const share = passed / all;
                 d[4 * t] = share < 0.015 ? {gathered} : share < 0.135 ? 1 : 0.1;
                 d[4 * t + 1] = 0;
                 d[4 * t + 2] = share < 0.015 ? {captor} : -1;
                 if (!(d[4 * t + 3] & 1)) passed += areaOf(t); }}
               chooseRange(); return 0; }})()"
        ));
        ends().1
    };
    assert_eq!([end(1.9, -1), end(5.0, -1)], [2.0, 1.0]);
    assert_eq!([end(1.3, 0), end(5.0, 0)], [1.5, 3.0]);
    page.no_complaints();
}

/// The search field finds a captor by its name or a part of it. A hidden captor is shown again, and
/// the captor is marked and described.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_find_marks_and_shows() {
    let page = open(&bay(), &["--results", "results.json", "--no-trace"]);
    page.evaluate("element('objects').querySelector('[data-key=\"0\"]').click(); 0");
    let flags = "valueTexture.image.data[4 * parts.find((p) => facts.captors[p.captor] === 'plant/leaf2#1').first + 3]";
    assert_eq!(number(&page, &format!("{flags} & 1")), 1.0, "hidden");
    let marked = "mark[0].geometry.getAttribute('position').count";
    assert_eq!(number(&page, marked), 0.0, "not marked");
    page.evaluate(
        "element('find').value = 'LEAF2#1'; element('find').dispatchEvent(new Event('change')); 0",
    );
    assert_eq!(number(&page, &format!("{flags} & 1")), 0.0, "shown");
    let tiles =
        "parts.filter((p) => p.captor === state.found).reduce((n, p) => n + p.end - p.first, 0)";
    assert_eq!(number(&page, marked), 3.0 * number(&page, tiles), "marked");
    // the mark shows through whatever stands in front of it: it is pink in the middle of the
    // picture
    let middle = "(() => { renderer.render(scene, camera); const g = renderer.getContext(), pixel = new Uint8Array(4);
        g.readPixels(g.drawingBufferWidth / 2, g.drawingBufferHeight / 2, 1, 1, g.RGBA, g.UNSIGNED_BYTE, pixel);
        return pixel[0] - pixel[1]; })()";
    let pink = number(&page, middle);
    page.evaluate("mark.forEach((object) => (object.visible = false)); 0");
    assert!(pink > 40.0 + number(&page, middle), "{pink}");
    page.evaluate("mark.forEach((object) => (object.visible = true)); 0");
    let told = text(&page, "element('found').textContent");
    assert!(
        told.starts_with("plant/leaf2#1") && told.contains('±') && told.contains("absorbed"),
        "{told}"
    );
    page.evaluate(
        "element('find').value = 'nobody'; element('find').dispatchEvent(new Event('change')); 0",
    );
    assert!(text(&page, "element('found').textContent").contains("no captor"));
    assert_eq!(number(&page, marked), 0.0);
    page.no_complaints();
}

/// The link restores band, scale, clip planes, lamps, theme, hidden objects and the view.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_the_link_keeps_the_view() {
    let page = open(&bay(), &["--results", "results.json", "--no-trace"]);
    page.evaluate(
        "state.band = 1; state.low = 0.25; state.high = 7; state.clip = [0, 0.5, 0.1, 1, 0, 1];
         state.lamps = [1.5, 1]; dimmed = true; state.theme = 'dark'; state.hidden.object.add(2);
         camera.position.set(1, 2, 3); controls.target.set(0.5, 0.4, 0.3); controls.update(); repaint(false); 0",
    );
    let link = text(&page, "linkText()");
    page.evaluate(
        "state.band = 2; state.clip.fill(0.3); state.lamps = [1, 1]; dimmed = false; state.theme = '';
         state.hidden.object.clear(); state.low = 0; resetView(); 0",
    );
    assert_ne!(text(&page, "linkText()"), link);
    page.evaluate(&format!("history.replaceState(null, '', '#{link}'); readLink(); 0"));
    assert_eq!(text(&page, "linkText()"), link);
    // a link with meaningless values does no harm
    page.evaluate("location.hash = 'range=a,b&band=x&objects=q,,9e9&lamps=1&eye=1,2&at=&clip=2,3'; readLink(); repaint(true); 0");
    page.no_complaints();
}

/// The saved picture holds the canvas, and below it the colour bar on the page's ground, which is
/// dark if the dark theme is chosen. Its text has a contrast of 4.5 or more to its ground, whatever
/// the scene shows.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_a_picture_has_its_colour_bar() {
    let page = open(&bay(), &["--results", "results.json", "--no-trace"]);
    page.evaluate("element('theme').click(); 0");
    page.settle();
    let found = page.evaluate(
        "(() => { const c = picture(), d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
         const below = renderer.domElement.height + (c.height - renderer.domElement.height) / 3;
         let [yellow, dark, light, all] = [0, 0, 0, 0];
         for (let i = 4 * c.width * Math.round(below); i < d.length; i += 4) {
           all++;
           yellow += d[i] > 240 && d[i + 1] > 200 && d[i + 2] < 60;
           dark += d[i] === 0x16 && d[i + 1] === 0x18;
           light += d[i] > 0xe0 && d[i + 2] > 0xe0;
         }
         return [c.width === renderer.domElement.width && c.height > renderer.domElement.height + 40, yellow, dark / all, light]; })()",
    );
    assert_eq!(found[0], true);
    assert!(found[1].as_f64() >= Some(5.0), "no end of the bar: {found}");
    assert!(found[2].as_f64() > Some(0.5), "no dark ground: {found}");
    assert!(found[3].as_f64() > Some(50.0), "no light text: {found}");
    page.no_complaints();
}

/// The arrow keys turn the view, plus zooms in, Home shows everything again, and t opens a table. A
/// tap with a finger shows the numbers of a captor.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_keys_and_fingers_work() {
    let page = open(&bay(), &["--results", "results.json", "--no-trace"]);
    let key = |key: &str| {
        page.evaluate(&format!("document.body.dispatchEvent(new KeyboardEvent('keydown', {{ key: '{key}', bubbles: true }})); 0"));
    };
    let eye = || text(&page, "camera.position.toArray().map((x) => x.toFixed(4)).join()");
    let distance = || number(&page, "camera.position.distanceTo(controls.target)");
    let (first, far) = (eye(), distance());
    key("ArrowLeft");
    assert!(eye() != first && (distance() / far - 1.0).abs() < 1e-6, "turned");
    key("+");
    assert!(distance() < 0.95 * far, "nearer");
    key("Home");
    assert_eq!(eye(), first);
    key("t");
    assert_eq!(page.evaluate("element('tables').hidden"), false);
    key("Escape");
    assert_eq!(page.evaluate("element('tables').hidden"), true);
    page.evaluate(
        "const box = stage.getBoundingClientRect();
         for (const type of ['pointerdown', 'pointerup', 'pointerleave']) renderer.domElement.dispatchEvent(new PointerEvent(type,
           { pointerType: 'touch', button: 0, pointerId: 1, bubbles: true, clientX: box.left + box.width / 2, clientY: box.height / 2 })); 0",
    );
    assert_eq!(text(&page, "element('tip').style.display"), "block");
    page.no_complaints();
}

/// The page is a single file that loads nothing from the network, and it has the same bytes for any
/// number of threads.
#[test]
fn the_page_is_whole_and_the_same_each_time() {
    let scene = scene();
    for (name, threads) in [("a.html", "1"), ("b.html", "2")] {
        done(&scene.path(""), &["view", "scene.json", "-o", name, "--threads", threads]);
    }
    let page = |name: &str| fs::read(scene.path(name)).expect(name);
    let (a, b) = (page("a.html"), page("b.html"));
    assert!(a == b, "threads matter");
    let text = String::from_utf8(a).expect("text");
    let markup = |word: &str| text.match_indices(word).count();
    assert_eq!((markup(" src="), markup(" href=")), (0, 1), "the icon alone, which is empty");
    assert_eq!(markup("<script"), markup("</script>"));
}

/// The head says what was traced, also where it stands in a results file by a short name.
#[test]
fn the_head_says_what_was_traced() {
    let scene = scene();
    let run = ["run", "scene.json", "--estimator", "complete", "--photons", "2000"];
    done(&scene.path(""), &[&run[..], &["-o", "results.json"]].concat());
    done(&scene.path(""), &["view", "scene.json", "--results", "results.json", "--no-trace"]);
    let text = fs::read_to_string(scene.path("view.html")).expect("the page");
    let (_, rest) = text.split_once("\"source\":\"").expect("its source");
    let source = rest.split('"').next().expect("its end");
    assert!(source.contains(" complete paths, seed "), "{source}");
}

/// The scripts are copied into script elements unchanged, so none of them may contain text that
/// ends such an element.
#[test]
fn no_script_ends_its_element() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("crates/show/src/view");
    for entry in fs::read_dir(folder).expect("crates/show/src/view") {
        let path = entry.expect("an entry").path();
        if path.extension().is_some_and(|ending| ending == "js") {
            let text = fs::read_to_string(&path).expect("a script");
            assert!(!text.contains("</script") && !text.contains("<!--"), "{}", path.display());
        }
    }
}
