//! `phylux view`: the page, and what it does in a browser (Chromium; these tests have names that begin
//! with `needs_chromium_`).

mod chromium;

use std::{fs, path::Path};

use serde_json::Value;

use crate::{
    common::TestScene,
    rendered::{done, scene},
};
use chromium::Page;

/// Writes the page of a scene and opens it.
fn open(scene: &TestScene, more: &[&str]) -> Page {
    done(&scene.path(""), &[&["view", "scene.json"], more].concat());
    let page = Page::open(&scene.path("view.html"));
    page.wait_for("document.documentElement.dataset.ready === 'yes'");
    page
}

/// Looks at a captor from near by, and puts the mouse on it: what the page says of it.
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

/// The mouse on the sensor finds its result, as it is in the file to the digits shown, with its error;
/// a click lists it, and the table holds the same as the results.
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
    assert_eq!((cells[0], cells[4]), ("front", "W/m2"), "{tip}");
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

    // a surface without a captor says where it is lit
    page.evaluate("controls.target.set(0, 0, 0.4); camera.position.set(0, 0, 0.1); controls.update(); draw(); 0");
    page.settle();
    page.mouse("mouseMoved", 700.0, 300.0);
    page.settle();
    let tip = text(&page, "element('tip').innerText");
    assert!(tip.starts_with("walls") && tip.contains("here, front"), "{tip}");
    page.no_complaints();
}

/// A name that tries to leave its place, as JSON text without its quotes.
const EVIL: &str =
    r#"</script><script>document.title = 'taken'</script><img src=x onerror=alert(1)> <!-- & \" é"#;

/// The scene in which the room and the sensor have this name.
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

/// Names that try to leave their place do not become markup.
#[test]
fn names_are_no_markup() {
    let scene = evil_scene();
    done(&scene.path(""), &["view", "scene.json"]);
    let html = fs::read_to_string(scene.path("view.html")).expect("the page");
    assert!(!html.contains("<script>document.title"), "a name became markup");
    assert!(!html.contains("<img src=x"), "a name became markup");
}

/// Names that try to leave their place are shown as they are.
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

/// Bands, quantities, scales, hiding and photons change what is drawn, and nothing complains.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_every_control_does_something() {
    let scene = scene();
    let page = open(&scene, &[]);
    let pixels = || {
        page.settle();
        text(&page, "renderer.render(scene, camera), renderer.domElement.toDataURL()")
    };
    let mut before = pixels();
    for (what, action) in [
        ("band", "element('band').value = 0; element('band').dispatchEvent(new Event('change'))"),
        (
            "range",
            "element('high').value = '3'; element('high').dispatchEvent(new Event('change'))",
        ),
        ("log", "element('log').click()"),
        (
            "captors",
            "element('values').value = 'captor'; element('values').dispatchEvent(new Event('change'))",
        ),
        (
            "quantity",
            "element('quantity').value = 'absorbed'; element('quantity').dispatchEvent(new Event('change'))",
        ),
        ("cut", "element('cut').value = 0.5; element('cut').dispatchEvent(new Event('input'))"),
        ("unlit sides", "element('dark').click()"),
        ("shading", "element('shade').click()"),
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
    ] {
        page.evaluate(&format!("{action}; 0"));
        let after = pixels();
        assert!(after.len() > 1000 && after != before, "{what} changed nothing");
        before = after;
    }
    page.no_complaints();
}

/// One file, the same for any number of threads, that asks the network for nothing.
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

/// The scripts stand in script elements as they are.
#[test]
fn no_script_ends_its_element() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/show/view");
    for entry in fs::read_dir(folder).expect("src/show/view") {
        let path = entry.expect("an entry").path();
        if path.extension().is_some_and(|ending| ending == "js") {
            let text = fs::read_to_string(&path).expect("a script");
            assert!(!text.contains("</script") && !text.contains("<!--"), "{}", path.display());
        }
    }
}
