//! How light reaches a captor, in the page: the lines of the captor that is clicked, and its list.

use super::{bay, number, open, text};

/// A captor that is found gets its lines and its list: they begin at the lamps and end on the captor,
/// the list has its shares, which add up to 100 %, and a click on a row leaves its lines alone. The
/// cross closes both, and a page of no captor has none.
#[test]
#[ignore = "needs Chromium"]
fn needs_chromium_a_captor_shows_its_histories() {
    let page = open(&bay(), &["--photons", "20000"]);
    assert!(page.evaluate("element('ways').hidden && wayLines === null") == true);
    let find =
        "element('find').value = 'near'; element('find').dispatchEvent(new Event('change')); 0";
    page.evaluate(find);
    assert_eq!(text(&page, "element('wayName').textContent"), "How light reaches near");
    let found = page.evaluate(
        "(() => { const own = ways.of.get(facts.captors.indexOf('near'));
         const at = (i) => [0, 1, 2].map((k) => facts.histories.min[k] + ways.places[3 * i + k] / 65535 * facts.histories.size[k]);
         const far = (a, b) => Math.hypot(...a.map((x, k) => x - b[k]));
         const step = Math.max(...facts.histories.size) / 65535;
         let [off, aside] = [0, 0];
         const box = boxAround((part) => part.captor === own.captor);
         for (let line = own.first; line < own.first + own.lines; line++) {
           const light = own.groups[Math.min(ways.groups[line], own.groups.length - 1)].light;
           const lamp = facts.lights.find(({ name }) => name === light);
           off = Math.max(off, far(at(ways.starts[line]), lamp.min) / step);
           aside = Math.max(aside, far(at(ways.starts[line + 1] - 1), box.middle.toArray()));
         }
         const shares = own.groups.reduce((sum, { share }) => sum + share[state.band], 0);
         return { off, aside, shares, lines: own.lines, ends: wayLines.geometry.getAttribute('position').count,
           all: ways.starts[own.first + own.lines] - ways.starts[own.first], more: own.more }; })()",
    );
    let value = |key: &str| found[key].as_f64().expect(key);
    // both lamps are points; the sensor has a radius of 5 mm
    assert!(value("off") < 3.0 && value("aside") < 0.0055, "{found}");
    assert!((value("shares") - 1.0).abs() < 1e-5 && value("more") == 0.0, "{found}");
    // 15 captors, so that each may have 200 lines; a line of n places has n - 1 pieces of two ends
    assert_eq!([value("lines"), value("ends")], [200.0, 2.0 * (value("all") - 200.0)], "{found}");
    let list = text(&page, "element('wayTable').innerText");
    for word in ["lamp", "far", "direct", "share of", "±"] {
        assert!(list.contains(word), "`{word}`: {list}");
    }
    let words = text(&page, "element('wayText').textContent");
    assert!(words.starts_with("200 of ") && words.contains("drawn in proportion"), "{words}");

    let ends = "wayLines.geometry.getAttribute('position').count";
    let all = number(&page, ends);
    page.evaluate("element('wayTable').querySelector('button').click(); 0");
    let one = number(&page, ends);
    assert!(one > 0.0 && one < all, "{one} of {all}");
    page.evaluate("element('wayTable').querySelector('button').click(); 0");
    assert_eq!(number(&page, ends), all);
    page.evaluate("element('closeWays').click(); 0");
    assert!(page.evaluate("element('ways').hidden && wayLines === null") == true);
    page.no_complaints();

    // a page that follows another captor says how to follow this one
    let page = open(&bay(), &["--photons", "20000", "--to", "s1"]);
    page.evaluate(find);
    let words = text(&page, "element('wayText').textContent");
    assert!(words.contains("phylux view --to"), "{words}");
    page.no_complaints();
}
