//! `phylux plot`: each plot shows the numbers of the results, and results without such numbers are
//! refused.

use std::{collections::BTreeSet, fs};

use serde_json::{Value, json};

use crate::{
    bad_input::{phylux, refused},
    common::TestScene,
    world::{self, Mesh, World},
};

/// Returns results with known values, of a grid of sensors, a shelf of three sensors in a line, and
/// two plants of three leaves. At x of the grid E = 100 (1 + x), and leaf r of plant p absorbs (10
/// p + r) / 10.
fn results() -> TestScene {
    let face = |value: f64| {
        json!({"photons": 100, "flux": [value, 0.5 * value], "flux_se": [0.01 * value, null],
               "irradiance": [value, 0.5 * value], "irradiance_se": [0.01 * value, null]})
    };
    let captor = |id: String, kind: &str, center: [f64; 3], value: f64| json!({"id": id, "kind": kind, "area": 0.5, "center": center, "normal": [0, 0, 1], "front": face(value)});
    let mut captors: Vec<Value> = Vec::new();
    for i in 0..9 {
        let (x, y) = (f64::from(i % 3), f64::from(i / 3));
        captors.push(captor(format!("grid/{i}"), "virtual", [x, y, 1.0], 100.0 * (1.0 + x)));
    }
    for i in 0..3 {
        captors.push(captor(format!("shelf/{i}"), "virtual", [f64::from(i), 0.0, 2.0], 50.0));
    }
    for plant in 0..2 {
        for rank in 1..4 {
            let id = format!("tomato/leaf{rank}#{plant}");
            let mut leaf = captor(id, "surface", [0.0, 0.0, 0.2 * f64::from(rank)], 10.0);
            let power = f64::from(10 * plant + rank) / 10.0;
            leaf["absorbed"] = json!([power, 0.1]);
            leaf["absorbed_se"] = json!([0.1 * power, null]);
            captors.push(leaf);
        }
    }
    let result = json!({
        "phylux": "0", "scene": "plotted", "seed": 1, "photons": 1000, "blocks": 128, "estimator": "photons",
        "unit": {"length": "m", "flux": "umol/s", "irradiance": "umol/m2/s", "radiance": "umol/m2/s/sr"},
        "bands": [{"name": "PAR", "from_nm": 400, "to_nm": 700}, {"name": "far red", "from_nm": 700, "to_nm": 750}],
        "energy": {"power": [1, 1], "emitted": [1, 1], "absorbed": [1, 1], "escaped": [0, 0], "lost": [0, 0], "absorbed_by": {}},
        "captors": captors, "groups": [],
        "layers": [
            {"from": 0, "to": 0.2, "area": 1, "absorbed": [2, 1], "absorbed_se": [0.1, null]},
            {"from": 0.2, "to": 0.4, "area": 2, "absorbed": [12, 1], "absorbed_se": [0.1, null]}
        ]
    });
    TestScene::new("{}", &[("r.json", &result.to_string())])
}

/// Radii of marks and of dots in the SVG, whose units are 1/384 inch.
const MARK: f64 = 10.0;
const DOT: f64 = 6.0;

/// Plots the results. Returns the texts of the SVG picture, and the whole picture.
fn plotted(scene: &TestScene, more: &[&str]) -> (Vec<String>, String) {
    let folder = scene.path("");
    let output = phylux(&folder, &[&["plot", "r.json", "-o", "p.svg"], more].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let svg = fs::read_to_string(scene.path("p.svg")).expect("a picture");
    let texts = svg.split("<text").skip(1).map(|text| {
        let (_, text) = text.split_once('>').expect("its start");
        text.split('<').next().expect("its end").trim().to_string()
    });
    (texts.collect(), svg.clone())
}

fn has(texts: &[String], wanted: &[&str]) {
    for text in wanted {
        assert!(texts.iter().any(|t| t == text), "`{text}` is not among {texts:?}");
    }
}

/// Returns the numbers in these attributes, for each of the elements that has all of them.
fn place(svg: &str, element: &str, attributes: &[&str]) -> Vec<Vec<f64>> {
    let number = |text: &str, name: &str| {
        let (_, rest) = text.split_once(&format!("{name}=\""))?;
        rest.split('"').next()?.parse().ok()
    };
    svg.split(element)
        .skip(1)
        .filter_map(|text| {
            let text = text.split('>').next()?;
            attributes.iter().map(|name| number(text, name)).collect()
        })
        .collect()
}

/// The map has one panel, for the grid only. Colours and contours follow x, and the contours are
/// straight lines where the value is 150, 200 and 250.
#[test]
fn a_map_has_the_sensors_their_colours_and_contours() {
    let scene = results();
    let (texts, svg) = plotted(&scene, &["--range", "100:300"]);
    // sqrt(2/3) x 100 of 200
    let title =
        "grid, z = 1 m: mean 200 µmol/m²/s, min/mean 0.50, CV 40.8 %, median error 2 µmol/m²/s";
    has(&texts, &[title, "x, m", "y, m", "PPFD, µmol/m²/s", "100", "200", "300"]);
    assert!(!texts.iter().any(|t| t.contains("z = 2 m")), "three in a line are no map");
    let dots = place(&svg, "<circle", &["cx", "cy"]);
    assert_eq!(dots.len(), 9);
    let columns: BTreeSet<i64> = dots.iter().map(|dot| dot[0] as i64).collect();
    let columns: Vec<i64> = columns.into_iter().collect();
    assert_eq!(columns.len(), 3, "{columns:?}");
    // a metre has the same length up and across
    let rows: BTreeSet<i64> = dots.iter().map(|dot| dot[1] as i64).collect();
    let height = rows.last().expect("a row") - rows.first().expect("a row");
    assert!((height - (columns[2] - columns[0])).abs() <= 2, "{columns:?} {rows:?}");
    // the colours go from dark blue to yellow (viridis), with more red and green to the right
    let polygons: Vec<(f64, [u8; 3])> = svg
        .split("<polygon")
        .skip(1)
        .map(|text| {
            let (_, fill) = text.split_once("fill=\"#").expect("a colour");
            let byte = |i: usize| u8::from_str_radix(&fill[2 * i..2 * i + 2], 16).expect("hex");
            let (_, points) = text.split_once("points=\"").expect("points");
            let points = points.split('"').next().expect("their end");
            let xs: Vec<f64> = points
                .split_whitespace()
                .map(|p| p.split(',').next().expect("x").parse().expect("a number"))
                .collect();
            (xs.iter().sum::<f64>() / xs.len() as f64, [byte(0), byte(1), byte(2)])
        })
        .collect();
    // one for each colour, on those below it: steps of 10 are the finest round ones of at most 32
    assert_eq!(polygons.len(), 20);
    let colour = |least: bool| {
        let order = |a: &&(f64, [u8; 3]), b: &&(f64, [u8; 3])| a.0.total_cmp(&b.0);
        if least { polygons.iter().min_by(order) } else { polygons.iter().max_by(order) }
    };
    let (left, right) = (colour(true).expect("one").1, colour(false).expect("one").1);
    assert!(left[0] < 80 && left[1] < 30, "{left:?}");
    assert!(right[0] > 230 && right[1] > 210, "{right:?}");
    // without `--range`, the range is chosen to fit the sensors
    let (texts, _) = plotted(&scene, &[]);
    has(&texts, &["100", "300"]);
    // sensors in a row by themselves are on no map, and a note says why
    let output = phylux(&scene.path(""), &["plot", "r.json", "-o", "p.svg"]);
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(said.contains("3 sensors are on no map: 3 of `shelf` (a map takes three"), "{said}");
    // far red is not photosynthetic, so its map is not called PPFD
    let (texts, _) = plotted(&scene, &["--band", "far red"]);
    has(&texts, &["PFD, far red, µmol/m²/s"]);
}

/// Racks far apart in one plane have maps of their own, with their names; a group stands for its
/// sensors, and several patterns for what fits any of them. Values within their errors are even.
#[test]
fn racks_have_maps_of_their_own() {
    let scene = results();
    let path = scene.path("r.json");
    let mut all: Value = serde_json::from_slice(&fs::read(&path).expect("results")).expect("JSON");
    let captors = all["captors"].as_array_mut().expect("captors");
    captors.truncate(9);
    for captor in captors.iter_mut() {
        captor["groups"] = json!(["racks", "grid"]);
    }
    for i in 0..9 {
        let mut other = captors[i].clone();
        let noise = if i % 2 == 0 { 1.0 } else { -1.0 };
        other["id"] = json!(format!("other/{i}"));
        other["groups"] = json!(["racks"]);
        other["center"][1] = json!(20.0 + (i / 3) as f64);
        other["front"]["irradiance"][0] = json!(150.0 + noise);
        other["front"]["irradiance_se"][0] = json!(2.0);
        captors.push(other);
    }
    fs::write(&path, all.to_string()).expect("written");
    let titles = |more: &[&str]| -> Vec<String> {
        let (texts, _) = plotted(&scene, more);
        texts.into_iter().filter(|text| text.contains("z = 1 m")).collect()
    };
    let first =
        "grid, z = 1 m: mean 200 µmol/m²/s, min/mean 0.50, CV 40.8 %, median error 2 µmol/m²/s";
    let second = "other, z = 1 m: 150 ± 2 µmol/m²/s, even within its error";
    assert_eq!(titles(&["--captors", "grid"]), [first]);
    assert_eq!(titles(&["--captors", "other/*"]), [second]);
    for both in [&[][..], &["--captors", "racks"], &["--captors", "grid,other/*"]] {
        let found = titles(both).concat();
        assert!(found.contains("grid, z = 1 m") && found.contains("other, z = 1 m"), "{found}");
    }
    let both = ["--captors", "grid/*", "--captors", "other/*"];
    assert_eq!(titles(&both).len(), 2);
    refused(&scene.path(""), &["plot", "r.json", "--captors", "grid,nobody"], &["`nobody`"]);
}

/// Changes the results of a scene.
fn changed(scene: &TestScene, change: impl FnOnce(&mut Value)) {
    let path = scene.path("r.json");
    let mut all: Value = serde_json::from_slice(&fs::read(&path).expect("results")).expect("JSON");
    change(&mut all);
    fs::write(&path, all.to_string()).expect("written");
}

/// Eight tiers of two racks have a map each, with their names.
#[test]
fn tiers_of_racks_have_maps_of_their_own() {
    let scene = results();
    changed(&scene, |all| {
        let captors = all["captors"].as_array_mut().expect("captors");
        let grid: Vec<Value> = captors.drain(..9).collect();
        captors.clear();
        for (rack, tier) in (0..8).map(|i| (i % 2, i / 2)) {
            for (i, sensor) in grid.iter().enumerate() {
                let mut own = sensor.clone();
                own["id"] = json!(format!("tier {rack}{tier}/{i}"));
                own["center"][1] = json!(20.0 * f64::from(rack) + (i / 3) as f64);
                own["center"][2] = json!(tier);
                captors.push(own);
            }
        }
    });
    let (texts, _) = plotted(&scene, &[]);
    for (rack, tier) in (0..8).map(|i| (i % 2, i / 2)) {
        let name = format!("tier {rack}{tier}, z = {tier} m");
        assert!(texts.iter().any(|text| text.starts_with(&name)), "{name}: {texts:?}");
    }
}

/// The map of sensors in a line is a curve over their places, with errors.
#[test]
fn sensors_in_a_line_are_a_curve() {
    let scene = results();
    changed(&scene, |all| {
        all["captors"].as_array_mut().expect("captors").drain(..9);
        for i in 0..3 {
            all["captors"][i]["front"]["irradiance"][0] = json!(50.0 * (1 + i) as f64);
        }
    });
    for more in [&["--captors", "shelf/*"][..], &["--show", "map", "--captors", "shelf/*"]] {
        let (texts, svg) = plotted(&scene, more);
        has(&texts, &["PPFD along shelf, y = 0 m, z = 2 m", "x, m", "PPFD, µmol/m²/s", "0"]);
        let marks = place(&svg, "<circle", &["cx", "cy"]);
        assert_eq!(marks.len(), 3);
        let up: Vec<f64> = marks.windows(2).map(|pair| pair[0][1] - pair[1][1]).collect();
        assert!(up[0] > 10.0 && (up[0] - up[1]).abs() <= 1.0, "{marks:?}");
    }
}

/// Where nothing says what to show, and there are no sensors for a map, the plot is the first of
/// layers, plants and profile that the results have, and the command says which.
#[test]
fn results_without_a_map_are_plotted_too() {
    let scene = results();
    let said = |words: &str| {
        let output = phylux(&scene.path(""), &["plot", "r.json", "-o", "p.svg"]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(text.contains(words), "{text}");
        fs::read_to_string(scene.path("p.svg")).expect("a plot")
    };
    changed(&scene, |all| drop(all["captors"].as_array_mut().expect("captors").drain(..12)));
    assert!(said("drawn as with --show layers").contains("absorbed by layers"));
    changed(&scene, |all| drop(all.as_object_mut().expect("an object").remove("layers")));
    assert!(said("drawn as with --show plants").contains("absorbed by each plant"));
    changed(&scene, |all| {
        for (i, captor) in all["captors"].as_array_mut().expect("captors").iter_mut().enumerate() {
            captor["id"] = json!(["wall", "roof", "door", "pane", "desk", "lamp"][i]);
            captor["normal"] = json!([1, 0, 0]);
        }
    });
    assert!(said("drawn as with --show profile").contains("absorbed over height"));
    // things that are neither copies nor leaves have their names
    let (texts, _) = plotted(&scene, &["--show", "plants"]);
    has(&texts, &["absorbed by each object, PAR", "wall", "roof", "door", "pane", "desk", "lamp"]);
}

/// Ground is no plant: two kinds of it side by side, one that slopes, and one whose triangles are
/// captors each. A shelf above, lit on both sides, is drawn, and so is ground that is asked for.
#[test]
fn ground_is_no_plant() {
    let scene = results();
    let names = |more: &[&str]| -> Vec<String> {
        let (texts, _) = plotted(&scene, &[&["--show", "plants"], more].concat());
        let known = ["tomato", "soil", "path", "tiles", "shelf"];
        known
            .iter()
            .filter(|name| texts.iter().any(|t| t == *name))
            .map(|n| n.to_string())
            .collect()
    };
    changed(&scene, |all| {
        let captors = all["captors"].as_array_mut().expect("captors");
        let leaf = captors.last().expect("a leaf").clone();
        let mut add = |id: &str, center: [f64; 3], normal: [f64; 3], back: f64| {
            let mut own = leaf.clone();
            own["id"] = json!(id);
            (own["center"], own["normal"]) = (json!(center), json!(normal));
            own["back"] = own["front"].clone();
            own["back"]["flux"] = json!([back, 0]);
            captors.push(own);
        };
        add("soil/soil", [1.0, 0.0, -0.01], [0.0, 0.6, 0.8], 0.0);
        add("path/path", [2.0, 0.0, 0.0], [0.0, 0.0, 1.0], 3.0);
        add("tiles/tile/0", [3.0, 0.0, 0.01], [0.0, 0.0, -1.0], 0.0);
        add("tiles/tile/1", [3.0, 1.0, 0.02], [0.1, 0.0, -0.99], 0.0);
        add("shelf/board", [0.0, 0.0, 0.9], [0.0, 0.0, 1.0], 1.0);
    });
    assert_eq!(names(&[]), ["tomato", "shelf"]);
    assert_eq!(names(&["--captors", "soil/*,tiles/*,tomato/*"]), ["tomato", "soil", "tiles"]);
}

/// The sensors have the mean 200 at 1 m and 50 at 2 m, and the line joins these means.
#[test]
fn a_profile_joins_means_of_heights() {
    let scene = results();
    let (texts, svg) = plotted(&scene, &["--show", "profile"]);
    has(
        &texts,
        &[
            "light over height, PAR",
            "light per area, µmol/m²/s",
            "height z, m",
            "marks: means at a height; pale dots: single captors; bars: standard errors (Monte Carlo)",
            "sensors, PPFD",
            "tomato, absorbed",
        ],
    );
    // pale dots are captors, and the larger marks are means: hollow circles at 2 heights of sensors,
    // triangles at 3 of leaves
    let circles = place(&svg, "<circle", &["cx", "cy", "r"]);
    let marks: Vec<&Vec<f64>> = circles.iter().filter(|c| c[2] == MARK).collect();
    let dots = circles.iter().filter(|c| c[2] == DOT).count();
    assert_eq!((dots, marks.len(), circles.len() - dots - marks.len()), (18, 2, 2));
    assert_eq!(svg.matches("<polygon").count(), 3, "{svg}");
    // the marks of the sensors come first; they are at 200 and at 50 on an axis that begins at 0
    let dots: Vec<&Vec<f64>> = circles.iter().filter(|c| c[2] == DOT).collect();
    let (at_100, at_300) = (dots[0][0], dots[2][0]);
    let pixels_of = |value: f64| at_100 + (value - 100.0) * (at_300 - at_100) / 200.0;
    assert!((marks[0][0] - pixels_of(200.0)).abs() < 1.5, "{marks:?}");
    assert!((marks[1][0] - pixels_of(50.0)).abs() < 1.5, "{marks:?}");
    assert!(marks[0][1] > marks[1][1], "2 m is above 1 m");
}

/// Sensors of one height have a row with their mean in place of an empty chart, and more than three
/// lines have no pale dots about them.
#[test]
fn a_profile_is_neither_empty_nor_crowded() {
    let scene = results();
    let (texts, svg) = plotted(&scene, &["--show", "profile", "--captors", "grid/*"]);
    has(&texts, &["PPFD, z = 1 m", "PPFD, µmol/m²/s", "sensors", "200.0 ± 0.7", "0"]);
    assert!(
        texts.iter().any(|text| text.contains("standard error of the Monte Carlo")),
        "{texts:?}"
    );
    // those that are close together are drawn so, on an axis that says so
    let own = ["--show", "profile", "--captors", "grid/1,grid/2"];
    let (near, _) = plotted(&scene, &own);
    has(&near, &["PPFD, µmol/m²/s (axis does not begin at 0)", "200", "300"]);
    assert!(!near.contains(&"0".to_string()), "{near:?}");
    assert!(!texts.iter().any(|text| text.contains("height")), "{texts:?}");
    let circles = place(&svg, "<circle", &["r", "cy"]);
    let marks: Vec<f64> = circles.iter().filter(|c| c[0] == MARK).map(|c| c[1]).collect();
    assert_eq!((circles.len(), marks.len()), (10, 1));
    assert!(circles.iter().all(|c| c[1] == marks[0]), "{circles:?}");
    let inches = |svg: &str| -> f64 {
        let (_, rest) = svg.split_once(" height=\"").expect("a height");
        rest.split_once("in\"").and_then(|(n, _)| n.parse().ok()).expect("inches")
    };
    let (_, usual) = plotted(&scene, &["--show", "profile"]);
    assert!(inches(&svg) < 0.5 * inches(&usual));

    changed(&scene, |all| {
        let captors = all["captors"].as_array_mut().expect("captors");
        let leaves: Vec<Value> = captors.split_off(12);
        for (name, times) in [("tomato", 1.0), ("lettuce", 2.0), ("cucumber", 3.0)] {
            for leaf in &leaves {
                let mut own = leaf.clone();
                let power = leaf["absorbed"][0].as_f64().expect("a power");
                own["absorbed"][0] = json!(times * power);
                let id = leaf["id"].as_str().expect("an id");
                own["id"] = json!(id.replace("tomato", name));
                captors.push(own);
            }
        }
    });
    let dots = |more: &[&str]| {
        let (texts, svg) = plotted(&scene, &[&["--show", "profile"], more].concat());
        has(&texts, &["lettuce, absorbed", "cucumber, absorbed"]);
        place(&svg, "<circle", &["r"]).iter().filter(|c| c[0] == DOT).count()
    };
    assert_eq!(dots(&[]), 0);
    assert_eq!(dots(&["--captors", "lettuce/*,cucumber/*"]), 12);
}

/// Objects that are neither copies nor leaves have a row with their whole name, also in a column; more
/// than a hundred plants have no bars, which would hide them.
#[test]
fn many_plants_and_long_names_are_legible() {
    let scene = results();
    let names: Vec<String> = (0..20).map(|i| format!("a wall with a long name, {i}")).collect();
    changed(&scene, |all| {
        let captors = all["captors"].as_array_mut().expect("captors");
        let leaf = captors.last().expect("a leaf").clone();
        captors.clear();
        for (i, name) in names.iter().enumerate() {
            let mut own = leaf.clone();
            own["id"] = json!(name);
            own["center"][2] = json!(i);
            own["normal"] = json!([1, 0, 0]);
            captors.push(own);
        }
    });
    let (texts, svg) = plotted(&scene, &["--show", "plants", "--width", "3.5"]);
    has(&texts, &["absorbed by each object, PAR", "absorbed, µmol/s"]);
    has(&texts, &names.iter().map(String::as_str).collect::<Vec<_>>());
    let shown = place(&svg, "<text", &["y"]);
    let rows: BTreeSet<i64> = shown.iter().map(|at| at[0] as i64).collect();
    assert!(rows.len() >= names.len(), "{rows:?}");

    let bars = |plants: usize| {
        changed(&scene, |all| {
            let captors = all["captors"].as_array_mut().expect("captors");
            let leaf = captors[0].clone();
            captors.clear();
            for plant in 0..plants {
                let mut own = leaf.clone();
                own["id"] = json!(format!("lettuce#{plant}"));
                captors.push(own);
            }
        });
        let (_, svg) = plotted(&scene, &["--show", "plants"]);
        // one more where a legend has the name
        assert!([plants, plants + 1].contains(&place(&svg, "<circle", &["r"]).len()));
        let upright = svg.split(" points=\"").skip(1).filter_map(|line| {
            let (a, b) = line.split('"').next()?.trim().split_once(' ')?;
            let [a, b] = [a, b].map(|end| end.split_once(','));
            Some(a?.0 == b?.0 && a?.1 != b?.1)
        });
        upright.filter(|is_bar| *is_bar).count()
    };
    let few = bars(90);
    assert!(few >= 90 && bars(110) < 30, "{few}");
}

/// The plants absorb 0.6 and 3.6, and the ranks 0.6, 0.7 and 0.8 on average. Each has an error bar.
#[test]
fn plants_and_ranks_absorb_what_their_leaves_do() {
    let scene = results();
    changed(&scene, |all| drop(all["captors"].as_array_mut().expect("captors").drain(..12)));
    let (texts, svg) = plotted(&scene, &["--show", "plants"]);
    has(
        &texts,
        &[
            "absorbed by each plant, PAR",
            "absorbed by rank, mean over plants, PAR",
            "plant",
            "tomato",
            "absorbed, µmol/s",
        ],
    );
    assert!(!texts.iter().any(|t| t == "1.5"), "there is no half plant and no half rank");
    let circles = place(&svg, "<circle", &["cx", "cy", "r"]);
    let marks: Vec<&Vec<f64>> = circles.iter().filter(|c| c[2] == MARK).collect();
    assert_eq!((circles.len() - marks.len(), marks.len()), (6, 5));
    let (plants, ranks) = (&marks[..2], &marks[2..]);
    assert!(plants[0][1] > plants[1][1], "the second plant absorbs more: {plants:?}");
    assert!(ranks[0][1] > ranks[1][1] && ranks[1][1] > ranks[2][1], "{ranks:?}");
    // rank 1 of the two plants absorbs 0.1 and 1.1, so their mean is half way between the dots
    let dots: Vec<&Vec<f64>> = circles.iter().filter(|c| c[2] == DOT).collect();
    let of_first: Vec<&&Vec<f64>> = dots.iter().filter(|dot| dot[0] == ranks[0][0]).collect();
    assert_eq!(of_first.len(), 2);
    assert!((ranks[0][1] - 0.5 * (of_first[0][1] + of_first[1][1])).abs() <= 1.0, "{circles:?}");
    // the bar of the second plant: 0.1 x (1.1, 1.2, 1.3), added in squares, reaches 0.208 to either
    // side of 3.6
    let bars = svg.split("<polyline").filter(|line| line.contains("stroke-width=\"6\"")).count();
    assert!(bars >= 5, "{bars}");
}

/// Layers absorb 2 and 6 umol/s per m2 of leaf: the step of the upper one is three times as far from
/// 0, and the whole picture is as high as they are.
#[test]
fn layers_are_steps_over_height() {
    let scene = results();
    let (texts, svg) = plotted(&scene, &["--show", "layers"]);
    has(
        &texts,
        &["absorbed by layers, PAR", "absorbed per area of leaf, µmol/m²/s", "height z, m"],
    );
    let lines: Vec<Vec<[f64; 2]>> = svg
        .split("<polyline")
        .filter(|line| line.contains("stroke-width=\"6\""))
        .map(|line| {
            let points = line.split("points=\"").nth(1).and_then(|l| l.split('"').next()).unwrap();
            let pair = |p: &str| p.split_once(',').map(|(x, y)| [x, y].map(|n| n.parse().unwrap()));
            points.split_whitespace().filter_map(pair).collect()
        })
        .collect();
    let steps = lines.iter().find(|line| line.len() == 4).expect("steps");
    let [low, high] = [steps[0], steps[2]];
    assert!(steps[0][0] == steps[1][0] && steps[2][0] == steps[3][0], "{steps:?}");
    assert!(steps[0][1] > steps[1][1] && steps[1][1] == steps[2][1] && steps[2][1] > steps[3][1]);
    // where 0 is, from the error bars of .1 and .05 about 2 and 6
    let per_unit = (high[0] - low[0]) / 4.0;
    let bars: Vec<f64> = lines.iter().filter(|l| l.len() == 2).map(|l| l[1][0] - l[0][0]).collect();
    let has_bar = |length: f64| bars.iter().any(|bar| (bar - length * per_unit).abs() < 12.0);
    assert!(has_bar(0.2) && has_bar(0.1), "{bars:?} {per_unit}");
    let bare = scene.path("r.json");
    let text = fs::read_to_string(&bare).unwrap().replace("\"layers\"", "\"other\"");
    fs::write(&bare, text).unwrap();
    refused(
        &scene.path(""),
        &["plot", "r.json", "--show", "layers"],
        &["r.json", "no layers", "dz"],
    );
}

/// A spectrum is drawn as steps between the wavelengths of the bands. Far red has half the
/// irradiance of PAR in a sixth of its width.
#[test]
fn a_spectrum_has_a_step_for_each_band() {
    let scene = results();
    let (texts, svg) = plotted(&scene, &["--show", "spectrum", "--captors", "grid/0"]);
    has(&texts, &["PFD by wavelength", "wavelength, nm", "PFD, µmol/m²/s/nm", "grid/0"]);
    let (_, line) = svg
        .split("<polyline")
        .filter_map(|line| line.split_once("points=\""))
        .find(|(_, line)| line.split('"').next().is_some_and(|p| p.split_whitespace().count() == 4))
        .expect("four ends of two steps");
    let points: Vec<(f64, f64)> = line
        .split('"')
        .next()
        .expect("its end")
        .split_whitespace()
        .filter_map(|p| p.split_once(','))
        .map(|(x, y)| (x.parse().expect("x"), y.parse().expect("y")))
        .collect();
    let [a, b, c, d] = points[..] else { panic!("{points:?}") };
    assert_eq!((a.1, b.0, c.1), (b.1, c.0, d.1));
    assert!(((b.0 - a.0) / (d.0 - c.0) - 6.0).abs() < 0.15, "{points:?}");
    assert!(c.1 < a.1, "50 over 50 nm is above 100 over 300 nm: {points:?}");
    let (texts, _) = plotted(&scene, &["--show", "spectrum", "--captors", "grid/*"]);
    // those at one x have the same light, and one label
    has(&texts, &["grid/0, grid/3, grid/6", "grid/1, grid/4", "grid/2, grid/5"]);
    assert!(!texts.iter().any(|t| t.contains("grid/7") || t.contains("shelf/0")), "{texts:?}");
}

/// What 10 % more of each input brings is a lying column, the largest above, with a bar from one error
/// below to one above; what uncertain inputs make of it is drawn beside chance. Of all light of one
/// lamp 10 % more power brings 10 %, without error.
#[test]
fn what_results_depend_on_is_drawn() {
    let scene = World::new()
        .lambert("white wall", 0.5)
        .surface("room", "white wall", &world::room([-1.0; 3], [1.0; 3]))
        .light(json!({ "type": "point", "position": [0.1, 0.2, 0.3], "power": 10 }))
        .captor("shelf", &Mesh::disc([0.2, 0.1, -0.3], [0.0, 0.0, 1.0], 0.3))
        .with("sensitivity", json!(true))
        .with("uncertain", json!({ "/materials/white wall/reflectance": 0.05 }))
        .with("settings", json!({ "photons": 20_000, "k": 0 }))
        .write();
    let run = phylux(&scene.path(""), &["run", "scene.json", "-o", "r.json"]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let (texts, svg) = plotted(&scene, &["--show", "sensitivity"]);
    has(
        &texts,
        &[
            "10 % more of each input: shelf",
            "light 0, power",
            "white wall, reflectance",
            "change of the light, %",
            "uncertain inputs: shelf",
            "all inputs",
            "chance (standard error)",
            "standard deviation of the light, %",
        ],
    );
    // the first is the lamp's: it ends at 10, the last number of the axis
    let place = |text: &str| texts.iter().position(|t| t == text);
    assert!(place("light 0, power") < place("white wall, reflectance"), "{texts:?}");
    assert!(svg.matches("<rect").count() >= 5, "two and three columns");
    let nothing = ["plot", "r.json", "--show", "sensitivity", "--captors", "floor"];
    refused(&scene.path(""), &nothing, &["no captor or group `floor`"]);
    refused(
        &results().path(""),
        &["plot", "r.json", "--show", "sensitivity"],
        &["nothing says what the results depend on"],
    );
}

/// Ratios have a column of the summary's table, and `--band` names one where it is drawn what results
/// depend on, and only there. A light goes by its name.
#[test]
fn what_ratios_depend_on_is_told_and_drawn() {
    let lamp = json!({
        "type": "point", "name": "row 1, lamp 1", "position": [0.1, 0.2, 0.3], "power": 10
    });
    let scene = World::new()
        .bands(2)
        .with("ratios", json!({ "red share": { "numerator": "b0", "denominator": "b1" } }))
        .material("wall", json!({ "type": "lambert", "reflectance": [0.5, 0.8] }))
        .surface("room", "wall", &world::room([-1.0; 3], [1.0; 3]))
        .light(lamp)
        .captor("shelf", &Mesh::disc([0.2, 0.1, -0.3], [0.0, 0.0, 1.0], 0.3))
        .with("sensitivity", json!(true))
        .with("uncertain", json!({ "/materials/wall/reflectance": 0.05 }))
        .with("settings", json!({ "photons": 20_000, "k": 0 }))
        .write();
    let run = phylux(&scene.path(""), &["run", "scene.json", "-o", "r.json"]);
    let said = String::from_utf8_lossy(&run.stdout).into_owned();
    for head in ["per cent for 1 % more of each", "per cent by uncertain inputs"] {
        let line = said.lines().find(|line| line.starts_with(head)).expect("its table");
        assert!(line.contains("red share"), "{line}");
    }
    // 1 % more of the lamp brings 1 % more light, and the same ratio
    let lamp = said.lines().find(|line| line.contains("/lights/row 1, lamp 1/power"));
    let numbers: Vec<&str> =
        lamp.expect("the lamp").rsplit_once("power").unwrap().1.split_whitespace().collect();
    assert_eq!(numbers[..2], ["1.000", "1.000"], "{said}");
    assert!(["0.000", "-0.000"].contains(&numbers[2]), "{said}");
    let (texts, _) = plotted(&scene, &["--show", "sensitivity", "--band", "red share"]);
    has(
        &texts,
        &[
            "10 % more of each input: shelf, red share",
            "row 1, lamp 1, power",
            "change of the ratio, %",
            "uncertain inputs: shelf, red share",
            "standard deviation of the ratio, %",
        ],
    );
    let profile = ["plot", "r.json", "--show", "profile", "--band", "red share"];
    refused(&scene.path(""), &profile, &["no band or sum `red share`"]);
}

/// Amounts begin at 0, names stand beside their lines, and no lines are between those that have
/// numbers.
#[test]
fn plots_begin_at_0_and_have_names_beside_lines() {
    let scene = results();
    for (kind, name) in [("plants", "tomato"), ("profile", "tomato, absorbed")] {
        let (texts, svg) = plotted(&scene, &["--show", kind, "--captors", "tomato/*"]);
        has(&texts, &["0"]);
        assert!(!svg.contains("opacity=\"0.04\""), "{kind} has a minor grid");
        let (before, _) = svg.split_once(&format!("\n{name}\n")).expect("its name");
        let text = before.rsplit("<text").next().expect("its start");
        assert!(text.contains("text-anchor=\"middle\"") && !text.contains("#000000"), "{text}");
        let at = &place(&format!("<text{text}>"), "<text", &["x", "y"])[0];
        let places = svg.split(" points=\"").skip(1).filter_map(|line| line.split('"').next());
        let points = places.flat_map(str::split_whitespace).filter_map(|p| p.split_once(','));
        let far = |p: (&str, &str)| {
            let [x, y] = [p.0, p.1].map(|n| n.parse::<f64>().expect("a number"));
            (x - at[0]).abs().max((y - at[1]).abs())
        };
        let nearest = points.map(far).fold(f64::MAX, f64::min);
        assert!((20.0..700.0).contains(&nearest), "{kind}: {nearest}");
    }
}

/// A plant has one colour in all plots, whatever else is drawn: the first object is blue, the second
/// vermilion, also by itself.
#[test]
fn a_plant_has_one_colour_in_all_plots() {
    let scene = results();
    changed(&scene, |all| {
        let captors = all["captors"].as_array_mut().expect("captors");
        captors.drain(..12);
        for i in 0..captors.len() {
            let mut own = captors[i].clone();
            own["id"] = json!(own["id"].as_str().expect("an id").replace("tomato", "lettuce"));
            captors.push(own);
        }
    });
    let (blue, red) = ("#0072B2", "#D55E00");
    let has = |more: &[&str]| {
        let (_, svg) = plotted(&scene, more);
        [blue, red].map(|colour| svg.contains(colour))
    };
    for show in ["plants", "profile"] {
        assert_eq!(has(&["--show", show]), [true, true], "{show}");
        assert_eq!(has(&["--show", show, "--captors", "lettuce/*"]), [false, true], "{show}");
        assert_eq!(has(&["--show", show, "--captors", "tomato/*"]), [true, false], "{show}");
    }
    let of_leaf = ["--show", "spectrum", "--captors", "lettuce/leaf1#0"];
    assert_eq!(has(&of_leaf), [false, true]);
}

/// Plots are 7 or 3.5 inches wide; PNG pictures of them have 300 pixels to the inch, and something
/// is drawn in them.
#[test]
fn pictures_have_the_width_of_a_page_or_of_a_column() {
    let scene = results();
    for (show, width, size) in [
        ("map", "7", (2100, 1550)),
        ("map", "3.5", (1050, 894)),
        ("profile", "7", (2100, 1234)),
        ("plants", "7", (2100, 2375)),
        ("plants", "3.5", (1050, 1625)),
        ("spectrum", "3.5", (1050, 812)),
    ] {
        let (_, svg) = plotted(&scene, &["--show", show, "--width", width]);
        let inches = |pixels: u32| f64::from(pixels) / 300.0;
        let [across, down] = [" width=\"", " height=\""].map(|name| {
            let (_, rest) = svg.split_once(name).expect("a size");
            rest.split_once("in\"").and_then(|(n, _)| n.parse::<f64>().ok()).expect("inches")
        });
        assert!((across - inches(size.0)).abs() < 0.01, "{show}: {across} inches wide");
        assert!((down - inches(size.1)).abs() < 0.01, "{show}: {down} inches high");
        let output = phylux(
            &scene.path(""),
            &["plot", "r.json", "--show", show, "--width", width, "-o", "p.png"],
        );
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let file = fs::File::open(scene.path("p.png")).expect("a picture");
        let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().expect("PNG");
        let mut pixels = vec![0; reader.output_buffer_size().expect("a size")];
        let info = reader.next_frame(&mut pixels).expect("pixels");
        assert_eq!((info.width, info.height), size, "{show}");
        let dark = pixels.chunks(3).filter(|p| p.iter().all(|c| *c < 100)).count();
        assert!(dark > 1500, "{show}: {dark} dark pixels");
    }
}

#[test]
fn what_cannot_be_plotted_is_refused() {
    let scene = results();
    let folder = scene.path("");
    for (more, words) in [
        (&["-o", "p.pdf"][..], &["p.pdf", ".svg"][..]),
        (&["--band", "PUR"], &["no band or sum `PUR`", "PAR, far red"]),
        (&["--captors", "nobody"], &["no captor or group `nobody`", "grid/0"]),
        (&["--show", "map", "--captors", "shelf/0"], &["r.json", "no three sensors"]),
        (&["--range", "0:1", "--captors", "tomato/*"], &["r.json", "no three sensors"]),
        (&["--show", "plants", "--captors", "grid/*"], &["no surface is a captor"]),
        (&["--show", "profile", "--range", "0:1"], &["--range", "--show map"]),
        (&["--range", "2:1"], &["2 to 1"]),
        (&["--width", "5"], &["--width"]),
        (&["-o", "r.json"], &["r.json"]),
    ] {
        refused(&folder, &[&["plot", "r.json"], more].concat(), words);
    }
    refused(&folder, &["plot", "scene.json"], &["scene.json", "is no results file"]);
    let text = fs::read_to_string(scene.path("r.json")).expect("the results");
    fs::write(scene.path("r.json"), text.replace("from_nm", "of_nm")).expect("written");
    refused(&folder, &["plot", "r.json", "--show", "spectrum"], &["no band has wavelengths"]);
}
