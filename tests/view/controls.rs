//! The controls of the page: each does something, the keyboard reaches all of them, what changes is
//! told to those who hear the page, and a large page shows how far it has come.

use std::{
    fs,
    io::{BufRead, BufReader, Write},
    net::TcpListener,
    sync::mpsc,
    thread,
};

use super::{bay, chromium::Page, number, open, text};
use crate::rendered::done;

/// Every button, field, slider and list of the page has something that answers it.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_every_control_has_its_handler() {
    let page = open(&bay(), &["--results", "results.json"]);
    page.evaluate("list(0); element('tableButtons').firstElementChild.click(); 0");
    let dead = page.evaluate(
        "[...document.querySelectorAll('button, input, select')].filter((control) => {
           if (control.closest('#timeSection[hidden]') || control.id === 'play') return false; // without a year
           const kinds = Object.keys(getEventListeners(control)), around = Object.keys(getEventListeners(control.closest('tr') ?? control));
           return ![...kinds, ...around].some((kind) => ['click', 'change', 'input'].includes(kind)); }).map(({ id, outerHTML }) => id || outerHTML)",
    );
    assert_eq!(dead, serde_json::json!([]));
    let twice = page.evaluate(
        "(() => { const ids = [...document.querySelectorAll('[id]')].map(({ id }) => id); return ids.filter((id, i) => ids.indexOf(id) !== i); })()",
    );
    assert_eq!(twice, serde_json::json!([]));
    page.no_complaints();
}

/// Escape closes what is open, one thing after the other, also from within a field, and gives the
/// focus back to what has opened it.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_escape_closes_what_is_open() {
    let page = open(&bay(), &["--results", "results.json", "--no-trace"]);
    page.resize(390, 844);
    page.settle();
    let is = |what: &str| page.evaluate(what) == true;
    let escape = || {
        page.key("Escape", 27);
        page.settle();
    };
    page.evaluate("list(0); element('menu').focus(); element('menu').click(); 0");
    let (tables, listed, menu) = (
        "!element('tables').hidden",
        "!element('listed').hidden",
        "document.body.classList.contains('open')",
    );
    page.evaluate("element('tableButtons').lastElementChild.click(); 0");
    assert!(is(tables) && is(listed) && is(menu));
    assert!(is("element('tables').contains(document.activeElement)"), "the table has the focus");
    escape();
    assert!(!is(tables) && is(listed) && is(menu));
    assert!(is("document.activeElement === element('tableButtons').lastElementChild"));
    page.evaluate("element('high').focus(); 0");
    escape();
    assert!(!is(menu) && is(listed) && is("document.activeElement.id === 'menu'"));
    escape();
    assert!(!is(listed));
    page.evaluate("find('s0'); 0");
    assert!(number(&page, "state.found") >= 0.0);
    escape();
    assert_eq!(number(&page, "state.found"), -1.0);
    page.no_complaints();
}

/// The line that says what mouse and keys do gives way to the first drag, and comes back on demand.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_the_line_of_keys_gives_way() {
    let page = open(&bay(), &["--results", "results.json"]);
    let shows = || page.evaluate("element('help').querySelector('p').checkVisibility()") == true;
    assert!(shows());
    page.mouse("mouseMoved", 700.0, 300.0);
    page.click();
    assert!(!shows());
    page.key("?", 191);
    assert!(shows());
    page.evaluate("element('help').firstElementChild.click(); 0");
    assert!(!shows());
    page.no_complaints();
}

/// With the tabulator the focus goes through the controls in the order in which they stand, then to
/// the picture, and is seen on each.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_the_focus_is_seen_and_goes_in_order() {
    let page = open(&bay(), &["--results", "results.json"]);
    let (mut ids, mut last) = (Vec::new(), -1e9);
    for _ in 0..60 {
        page.key("Tab", 9);
        let seen = page.evaluate(
            "(() => { const at = document.activeElement, style = getComputedStyle(at), panel = element('panel');
             if (at === document.body) return null;
             return [at.id || at.tagName, style.outlineStyle !== 'none' && parseFloat(style.outlineWidth) >= 2,
               at.getBoundingClientRect().top + panel.scrollTop + (at.closest('.list')?.scrollTop ?? 0), panel.contains(at)]; })()",
        );
        let Some(seen) = seen.as_array() else { break };
        let id = seen[0].as_str().expect("a name").to_string();
        assert_eq!(seen[1], true, "{id} has no outline");
        if seen[3] == true {
            let top = seen[2].as_f64().expect("a place");
            assert!(top > last - 8.0, "{id} is above what was before: {top} {last}");
            last = top;
        }
        let is_picture = id == "CANVAS";
        ids.push(id);
        if is_picture {
            break;
        }
    }
    let place = |id: &str| {
        ids.iter().position(|own| own == id).unwrap_or_else(|| panic!("no {id} in {ids:?}"))
    };
    let order = ["picture", "quantity", "band", "high", "photons", "find", "CANVAS"].map(place);
    assert!(order.is_sorted(), "{ids:?}");
    // the picture answers keys: Enter lists what is in its middle
    page.evaluate("find('floor/floor'); renderer.domElement.focus(); 0");
    page.key("Enter", 13);
    page.settle();
    assert_eq!(number(&page, "state.listed.length"), 1.0);
    page.no_complaints();
}

/// Those who hear the page are told what has changed.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_changes_are_told() {
    let page = open(&bay(), &["--results", "results.json", "--no-trace"]);
    assert_eq!(text(&page, "element('say').getAttribute('aria-live')"), "polite");
    for (act, words) in [
        (
            "element('band').value = 1; element('band').dispatchEvent(new Event('change'))",
            "irradiance, b&<",
        ),
        (
            "element('high').value = 'x'; element('high').dispatchEvent(new Event('change'))",
            "does not fit",
        ),
        ("find('s0')", "s0"),
        ("find('nobody')", "no captor"),
        ("list(0)", "is listed"),
        ("element('clearListed').click()", "nothing is listed"),
    ] {
        page.evaluate(&format!("element('say').textContent = ''; {act}; 0"));
        page.wait_for("element('say').textContent !== ''");
        let said = text(&page, "element('say').textContent");
        assert!(said.contains(words), "{act}: {said}");
    }
    page.no_complaints();
}

/// An end of the colour bar is pointed if there are values beyond it, on the page and in the saved
/// picture.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_ends_of_the_bar_are_pointed() {
    let page = open(&bay(), &["--results", "results.json"]);
    let set = |low: f64, high: f64| {
        page.evaluate(&format!("[state.low, state.high] = [{low}, {high}]; repaint(false); 0"));
    };
    // the colour in the middle of the outermost pixels of the bar on the page
    let ends = || {
        page.evaluate(
            "(() => { const from = element('bar'), c = document.createElement('canvas'); [c.width, c.height] = [from.width, from.height];
             const pen = c.getContext('2d', { willReadFrequently: true }); pen.drawImage(from, 0, 0);
             return [3, c.width - 4].map((x) => pen.getImageData(x, Math.round(c.height / 2), 1, 1).data[3] > 128); })()",
        )
    };
    let most = number(&page, "shownRange.most");
    set(0.0, 2.0 * most);
    assert_eq!(ends(), serde_json::json!([false, false]));
    set(0.0, 0.5 * most);
    assert_eq!(ends(), serde_json::json!([false, true]));
    set(0.3 * most, 2.0 * most);
    assert_eq!(ends(), serde_json::json!([true, false]));
    // the point adds colour to the picture
    let yellow = "(() => { const c = picture(), top = 60 + renderer.domElement.height, d = c.getContext('2d').getImageData(0, top, c.width, c.height - top).data;
        let right = 0; for (let i = 0; i < d.length; i += 4) if (d[i] > 240 && d[i + 1] > 215 && d[i + 2] < 60) right = Math.max(right, (i / 4) % c.width); return right; })()";
    set(0.0, 2.0 * most);
    let flat = number(&page, yellow);
    set(0.0, 0.5 * most);
    let pointed = number(&page, yellow);
    assert!(pointed > flat + 5.0, "{flat} {pointed}");
    page.no_complaints();
}

/// The colour of a surface is that of its value on the bar, at whatever angle it is seen: shade would
/// look like less light.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_colours_are_those_of_the_bar() {
    let page = open(&bay(), &["--results", "results.json", "--no-trace"]);
    let found = page.evaluate(
        "(() => { const part = parts.find((p) => facts.captors[p.captor] === 'floor/floor'), found = [];
         const middle = [0, 1, 2].map((k) => { const all = tilesOf(part).map(cornersOf).flat(); return all.reduce((s, c) => s + c[k], 0) / all.length; });
         for (const up of [1, 0.3]) {
           controls.target.set(...middle); camera.position.set(middle[0] + 0.02, middle[1] - 0.3, middle[2] + 0.3 * up); controls.update();
           render();
           const g = renderer.getContext(), pixel = new Uint8Array(4);
           g.readPixels(g.drawingBufferWidth / 2, g.drawingBufferHeight / 2, 1, 1, g.RGBA, g.UNSIGNED_BYTE, pixel);
           found.push([...pixel.subarray(0, 3)]);
         }
         const { value } = captorValue(part.captor, FRONT, state.band), at = 255 * Math.min(Math.max(shareOnScale(value), 0), 1);
         const known = [...colours.subarray(3 * Math.round(at), 3 * Math.round(at) + 3)];
         return Math.max(...found.map((pixel) => Math.max(...pixel.map((c, k) => Math.abs(c - known[k]))))); })()",
    );
    assert!(found.as_f64().expect("a difference") <= 4.0, "{found}");
    page.no_complaints();
}

/// While a page comes slowly, a bar shows how much of it has come, and the page works in the end.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_a_slow_page_shows_its_progress() {
    let scene = bay();
    done(&scene.path(""), &["view", "scene.json", "--photons", "20000"]);
    let html = fs::read(scene.path("view.html")).expect("the page");
    let find = |what: &str| {
        let at = html.windows(what.len()).position(|window| window == what.as_bytes());
        at.unwrap_or_else(|| panic!("no {what}"))
    };
    // half of the data
    let half = (find("id=\"corners\"") + find("var THREE=")) / 2;
    let server = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = format!("http://{}/view.html", server.local_addr().expect("an address"));
    let (go, wait) = mpsc::channel::<()>();
    let sent = thread::spawn(move || {
        let (mut stream, _) = server.accept().expect("a browser");
        let mut line = String::new();
        let mut lines = BufReader::new(stream.try_clone().expect("a stream"));
        while lines.read_line(&mut line).expect("a request") > 2 {
            line.clear();
        }
        let head = "HTTP/1.1 200 OK\r\nContent-Type: text/html\r\nConnection: close";
        write!(stream, "{head}\r\nContent-Length: {}\r\n\r\n", html.len()).expect("sent");
        stream.write_all(&html[..half]).and_then(|()| stream.flush()).expect("sent");
        wait.recv().expect("the browser has seen it");
        stream.write_all(&html[half..]).expect("sent");
    });
    let page = Page::open_at(&address);
    page.wait_for("document.getElementById('progress')?.value > 0.1");
    let share = number(&page, "document.getElementById('progress').value");
    assert!((0.1..0.5).contains(&share), "{share}");
    let words = text(&page, "document.getElementById('progressText').textContent");
    assert!(words.starts_with("loading ") && words.ends_with(" MB"), "{words}");
    go.send(()).expect("the server waits");
    page.wait_for("document.documentElement.dataset.ready === 'yes'");
    sent.join().expect("all was sent");
    assert_eq!(page.evaluate("element('message').hidden"), true);
    page.no_complaints();
}

/// The page begins with the band that `plot` draws: the first sum.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_the_first_band_is_that_of_plots() {
    let scene = bay();
    let page = open(&scene, &["--results", "results.json", "--no-trace"]);
    let band = text(&page, "facts.bands[state.band].name");
    assert_eq!(band, "both");
    done(&scene.path(""), &["plot", "results.json", "--show", "profile", "-o", "plot.svg"]);
    let plot = fs::read_to_string(scene.path("plot.svg")).expect("a plot");
    assert!(plot.contains(&format!("light over height, {band}")), "{plot}");
    // a picture in false colour is that of the same band
    let picture = |name: &str, more: &[&str]| {
        let all = ["render", "scene.json", "--show", "captors", "--results", "results.json"];
        let small = ["--width", "200", "--height", "200", "-o", name];
        done(&scene.path(""), &[&all[..], &small, more].concat());
        fs::read(scene.path(name)).expect(name)
    };
    assert!(picture("a.png", &[]) == picture("b.png", &["--band", &band]), "another band");
    assert!(picture("c.png", &["--band", "a"]) != picture("d.png", &[]), "bands look alike");
}
