//! The runs of a sweep, and the contents of its tables.

use std::{collections::HashMap, fs};

use super::*;
use crate::{bad_input::listing, common::run_file};

/// Returns the rows of a table, each as a map from column to cell.
fn rows(folder: &TestScene, name: &str) -> Vec<HashMap<String, String>> {
    let mut table = csv::Reader::from_path(folder.path(name)).expect("a table");
    table.deserialize().map(|row| row.expect("a row")).collect()
}

fn column(folder: &TestScene, name: &str, column: &str) -> Vec<String> {
    rows(folder, name).iter().map(|row| row[column].clone()).collect()
}

/// Asserts that a Parquet file holds the same as the CSV file of the same name.
fn check_parquet(folder: &TestScene, name: &str) {
    use parquet::{file::reader::FileReader, record::Field};
    let file = fs::File::open(folder.path(&format!("{name}.parquet"))).expect("a Parquet file");
    let file = parquet::file::serialized_reader::SerializedFileReader::new(file).expect("a table");
    let mut csv = csv::Reader::from_path(folder.path(&format!("{name}.csv"))).expect("a table");
    let head = csv.headers().expect("names").clone();
    let mut rows = file.get_row_iter(None).expect("rows");
    for record in csv.records().map(|record| record.expect("a row")) {
        let row = rows.next().expect("as many rows").expect("a row");
        for ((column, field), (name, cell)) in row.get_column_iter().zip(head.iter().zip(&record)) {
            // in a CSV file a text may need an apostrophe, in Parquet it does not
            assert_eq!(column, name.trim_start_matches('\''));
            match field {
                Field::Null => assert_eq!(cell, ""),
                Field::ULong(n) => assert_eq!(cell, n.to_string()),
                Field::Double(v) => assert_eq!(cell.parse(), Ok(*v)),
                Field::Str(text) => assert_eq!(cell.trim_start_matches('\''), text),
                other => panic!("{other:?}"),
            }
        }
    }
    assert!(rows.next().is_none());
}

/// Every run of a grid finds what `phylux run` finds in the scene with these values.
#[test]
fn a_grid_runs_every_pair() {
    let folder = folder(
        r#"{"scene": "scene.json", "seeds": 2, "vary": {
            "both": {"at": ["/lights/0/power", "/lights/1/power"], "values": [1, 2.0]},
            "/lights/1/position/2": {"from": 0.1, "to": 0.3, "steps": 3}}}"#,
    );
    let said = ok(&folder, "sweep sweep.json -o out");
    let from = "12 runs from 6 simulations: light is linear in the powers\n";
    assert_eq!(said, format!("{from}12 of 12 runs are done; wrote out\n"));
    let runs = rows(&folder, "out/runs.csv");
    let mut expected = Vec::new();
    for power in ["1", "2"] {
        for height in ["0.1", "0.2", "0.3"] {
            expected.extend(["7", "8"].map(|seed| (power, height, seed)));
        }
    }
    assert_eq!(runs.len(), expected.len());
    let captors = rows(&folder, "out/captors.csv");
    let groups = rows(&folder, "out/groups.csv");
    assert_eq!((captors.len(), groups.len()), (24, 24));
    for (i, (row, (power, height, seed))) in runs.iter().zip(expected).enumerate() {
        assert_eq!(row["run"], (i + 1).to_string());
        assert_eq!(row["both"], power);
        assert_eq!(row["/lights/1/position/2"], height);
        assert_eq!((&*row["seed"], &*row["photons"], &*row["error"]), (seed, "2000", ""));
        let whole: f64 = row["power_all"].parse().expect("a number");
        assert_eq!(whole, 2.0 * power.parse::<f64>().expect("a number"));

        let scene = SCENE
            .replace("\"power\": 1", &format!("\"power\": {power}"))
            .replace("[0.2, 0.3, 0.1]", &format!("[0.2, 0.3, {height}]"));
        fs::write(folder.path("one.json"), scene).expect("a scene");
        let one = run_file(&folder.path("one.json"), |settings| {
            settings.seed = seed.parse().expect("a seed");
        });
        let captor = &one.captors[0];
        let (front, back) = (&captors[2 * i], &captors[2 * i + 1]);
        assert_eq!((&*front["face"], &*back["face"], &*front["band"]), ("front", "back", "all"));
        assert_eq!(front["captor"], "a/a");
        let number = |cell: &str| cell.parse::<f64>().expect("a number");
        assert_eq!(number(&front["irradiance"]), captor.front.irradiance[0]);
        assert_eq!(Some(number(&front["irradiance_se"])), captor.front.irradiance_se[0]);
        assert_eq!(Some(&[number(&front["absorbed"])][..]), captor.absorbed.as_deref());
        assert_eq!((&*back["irradiance_se"], &*back["absorbed"]), ("", ""));
        assert_eq!((&*groups[2 * i]["group"], &*groups[2 * i]["captors"]), ("a", "1"));
        assert_eq!(number(&groups[2 * i]["irradiance"]), one.groups[0].front.irradiance[0]);
    }
    for name in ["runs", "captors", "groups"] {
        check_parquet(&folder, &format!("out/{name}"));
    }
    let pictures = ["both.svg", "lights_1_position_2.svg"];
    assert_eq!(listing(&folder.path("out/plots")), pictures);
    for name in pictures {
        let svg = fs::read_to_string(folder.path("out/plots").join(name)).expect("a picture");
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"), "{name}");
        assert!(svg.contains("irradiance, W/m²") && !svg.contains("NaN"), "{name}");
    }
    // times differ each time, so they are in a file of their own
    assert_eq!(column(&folder, "out/times.csv", "file"), column(&folder, "out/runs.csv", "file"));
}

/// What light costs is a table of its own where a lamp's electric power is known: the numbers that
/// the runs' own tables have, one row each.
#[test]
fn what_light_costs_over_a_sweep() {
    let sweep = r#"{"scene": "scene.json", "vary": {"/lights/1/position/2": [0.1, 0.3]}}"#;
    let folder = folder(sweep);
    ok(&folder, "sweep sweep.json -o plain");
    assert!(!folder.path("plain/electricity.csv").exists());
    let scene = SCENE.replace("\"power\": 1", "\"watts\": 4, \"power\": 1");
    fs::write(folder.path("scene.json"), scene).expect("a scene");
    ok(&folder, "sweep sweep.json -o out");
    let found = rows(&folder, "out/electricity.csv");
    let of = |run: &str, of: &str, quantity: &str| -> Vec<f64> {
        let fits = |row: &&HashMap<String, String>| {
            (&*row["run"], &*row["of"], &*row["quantity"]) == (run, of, quantity)
        };
        found.iter().filter(fits).map(|row| row["value"].parse().expect("a number")).collect()
    };
    for (run, height) in [("1", 0.1), ("2", 0.3)] {
        assert_eq!(of(run, "all lights", "per_watt"), [0.25]);
        let one = SCENE
            .replace("\"power\": 1", "\"watts\": 4, \"power\": 1")
            .replace("[0.2, 0.3, 0.1]", &format!("[0.2, 0.3, {height}]"));
        fs::write(folder.path("one.json"), one).expect("a scene");
        let one = run_file(&folder.path("one.json"), |_| ()).account.electricity.expect("watts");
        let shares = one.shares.expect("shares");
        assert_eq!(
            of(run, "wall", "material_share"),
            [shares.absorbed_by["wall"].share[0].expect("one")]
        );
        assert_eq!(of(run, "outside", "share"), [shares.outside.share[0].expect("one")]);
    }
    check_parquet(&folder, "out/electricity");
}

#[test]
fn zip_and_samples() {
    let folder = folder(
        r#"{"scene": "scene.json", "combine": "zip", "vary": {
            "/lights/0/power": [1, 2, 2], "/lights/0/position": [[0, 0, 1], [0, 0, 1], [0, 0, 2]]}}"#,
    );
    ok(&folder, "sweep sweep.json -o out");
    assert_eq!(column(&folder, "out/runs.csv", "/lights/0/power"), ["1", "2", "2"]);
    let positions = ["[0,0,1]", "[0,0,1]", "[0,0,2]"];
    assert_eq!(column(&folder, "out/runs.csv", "/lights/0/position"), positions);

    for (sample, out) in [("sobol", "sobol"), ("latin-hypercube", "latin")] {
        let sweep = format!(
            r#"{{"scene": "scene.json", "combine": {{"sample": "{sample}", "count": 8, "seed": 3}},
                "vary": {{"/lights/0/power": {{"from": 10, "to": 90}}, "/lights/1/power": [3, 4]}}}}"#
        );
        fs::write(folder.path("sweep.json"), sweep).expect("a sweep");
        ok(&folder, &format!("sweep sweep.json -o {out}"));
        let table = format!("{out}/runs.csv");
        let powers = column(&folder, &table, "/lights/0/power");
        // one value in each eighth
        let mut parts: Vec<usize> = powers
            .iter()
            .map(|power| ((power.parse::<f64>().expect("a number") - 10.0) / 10.0) as usize)
            .collect();
        parts.sort();
        assert_eq!(parts, [0, 1, 2, 3, 4, 5, 6, 7], "{powers:?}");
        let fours = column(&folder, &table, "/lights/1/power");
        assert_eq!(fours.iter().filter(|power| *power == "4").count(), 4, "{fours:?}");
    }
}

/// A run that fails does not stop the others, and its error is in the table. After a correction
/// only this run is done again.
#[test]
fn a_failed_run_is_recorded() {
    let sweep = |value| {
        format!(
            r#"{{"scene": "scene.json", "vary": {{"/materials/wall/reflectance": [0.2, {value}, 0.4]}}}}"#
        )
    };
    let folder = folder(&sweep("1.5"));
    let output = any(&folder, "sweep sweep.json -o out");
    assert_eq!(output.status.code(), Some(1));
    let said = stderr(&output);
    let lines: Vec<&str> = said.lines().collect();
    let sentence = "run 2 (/materials/wall/reflectance = 1.5, seed 7): \
                    scene.json: /materials/wall/reflectance: 1.5, must be from 0 to 1";
    assert!(lines[0].starts_with(&format!("warning: {sentence}")), "{said}");
    assert!(lines[1].starts_with("error: sweep: 1 of 3 runs failed; "), "{said}");
    assert_eq!(lines.len(), 2, "{said}");
    let errors = column(&folder, "out/runs.csv", "error");
    assert_eq!((&*errors[0], &*errors[2]), ("", ""));
    assert!(sentence.ends_with(errors[1].split(';').next().expect("a sentence")), "{}", errors[1]);
    assert_eq!(column(&folder, "out/captors.csv", "run"), ["1", "1", "3", "3"]);
    check_parquet(&folder, "out/runs");

    fs::write(folder.path("sweep.json"), sweep("0.3")).expect("a sweep");
    let said = ok(&folder, "sweep sweep.json -o out");
    let from = "3 runs from 1 simulation: histories are weighted anew for other reflectances and \
                transmittances\n";
    let done = "3 of 3 runs are done, 2 of them from before; wrote out\n";
    assert_eq!(said, format!("{from}{done}"));
    assert_eq!(column(&folder, "out/runs.csv", "error"), ["", "", ""]);
}

/// If the scene or its files change, the affected runs are done again, and no others.
#[test]
fn a_change_is_noticed() {
    let folder = folder(
        r#"{"scene": "scene.json", "vary": {"/objects/0/obj": ["a.obj", "b.obj"], "/lights/0/power": [1, 2]}}"#,
    );
    fs::write(folder.path("b.obj"), OBJ).expect("an OBJ file");
    ok(&folder, "sweep sweep.json -o out");
    let again = || {
        let said = ok(&folder, "sweep sweep.json -o out");
        let from = "4 runs from 2 simulations: light is linear in the powers\n";
        said.strip_prefix(from).expect("light is linear").to_string()
    };
    assert_eq!(again(), "4 of 4 runs are done, 4 of them from before; wrote out\n");
    fs::write(folder.path("b.obj"), OBJ.replace("v 0 1 0", "v 0 2 0")).expect("an OBJ file");
    assert_eq!(again(), "4 of 4 runs are done, 2 of them from before; wrote out\n");
    // a change of a value that the sweep sets in every run affects nothing
    fs::write(folder.path("scene.json"), SCENE.replacen("\"power\": 1", "\"power\": 9", 1))
        .expect("a scene");
    assert_eq!(again(), "4 of 4 runs are done, 4 of them from before; wrote out\n");
    fs::write(folder.path("scene.json"), SCENE.replace("2000", "3000")).expect("a scene");
    assert_eq!(again(), "4 of 4 runs are done; wrote out\n");
    assert_eq!(column(&folder, "out/runs.csv", "photons"), ["3000"; 4]);
    // a damaged result file is not reused
    let file = format!("out/runs/{}", column(&folder, "out/runs.csv", "file")[1]);
    let text = fs::read_to_string(folder.path(&file)).expect("results");
    fs::write(folder.path(&file), &text[..text.len() / 2]).expect("half of it");
    assert_eq!(again(), "4 of 4 runs are done, 3 of them from before; wrote out\n");
    assert_eq!(fs::read_to_string(folder.path(&file)).expect("results"), text);
}

/// A group names the lowest and the highest value of its captors.
#[test]
fn groups_have_a_least_and_a_greatest_captor() {
    let folder =
        folder(r#"{"scene": "scene.json", "vary": {"/objects/0/captor": [true, "triangle"]}}"#);
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 4 3\n";
    fs::write(folder.path("a.obj"), obj).expect("an OBJ file");
    ok(&folder, "sweep sweep.json -o out");
    let groups = rows(&folder, "out/groups.csv");
    assert_eq!((&*groups[0]["captors"], &*groups[0]["min"], &*groups[0]["max"]), ("1", "", ""));
    let both = groups.iter().find(|row| row["captors"] == "2" && row["face"] == "front");
    let both = both.expect("a group of two triangles");
    let captors = rows(&folder, "out/captors.csv");
    let of_both = |row: &&HashMap<String, String>| row["run"] == "2" && row["face"] == "front";
    let mut values: Vec<f64> = captors
        .iter()
        .filter(of_both)
        .map(|row| row["irradiance"].parse().expect("a number"))
        .collect();
    values.sort_by(f64::total_cmp);
    let ends: Vec<f64> = ["min", "max"].map(|end| both[end].parse().expect("a number")).to_vec();
    assert_eq!(values, ends);
    assert!(ends[0] < ends[1], "{ends:?}");
    // values that are texts have no axis, so nothing is plotted
    assert!(!folder.path("out/plots").exists());
}

/// The shipped example of a sweep is valid.
#[test]
fn the_shipped_sweep_is_sound() {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let sweep = phylux::formats::Sweep::load(&scenes.join("lamp-height.sweep.json"));
    let sweep = sweep.unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(sweep.runs().len(), 11);
    phylux::studies::load_base(&sweep).unwrap_or_else(|e| panic!("{e}"));
}

/// At its end a sweep says how many runs have which warnings, including runs from before. Values
/// that rest on few paths have a column for that.
#[test]
fn warnings_are_counted() {
    let folder =
        folder(r#"{"scene": "scene.json", "vary": {"/settings/photons": [20, 2000, 3000]}}"#);
    for _ in 0..2 {
        let output = any(&folder, "sweep sweep.json -o out");
        assert!(output.status.success());
        let said = stderr(&output);
        let expected = "warning: 1 run: few photons on a face of a captor\n\
                        warning: 1 run: standard errors come from few batches\n";
        assert_eq!(said, expected);
    }
    assert_eq!(column(&folder, "out/captors.csv", "few_paths"), ["1", "0", "0", "0", "0", "0"]);
}

#[test]
fn a_dry_run_lists_and_writes_nothing() {
    let folder =
        folder(r#"{"scene": "scene.json", "vary": {"/lights/0/power": [1, 2]}, "seeds": 2}"#);
    let before = listing(&folder.path(""));
    let said = ok(&folder, "sweep sweep.json -o out --dry-run");
    let lines: Vec<&str> = said.lines().collect();
    assert_eq!(lines[1], "run 2: /lights/0/power = 1, seed 8: to do");
    assert_eq!(lines[4], "4 runs from 2 simulations: light is linear in the powers");
    assert!(lines[5].starts_with("4 runs, 4 to do: about ") && lines[5].ends_with(" kB of disk"));
    let without_folder = ok(&folder, "sweep sweep.json --dry-run");
    assert!(without_folder.lines().take(5).eq(lines[..5].iter().copied()));
    assert_eq!(listing(&folder.path("")), before);
    ok(&folder, "sweep sweep.json -o out");
    let said = ok(&folder, "sweep sweep.json -o out --dry-run");
    assert!(said.ends_with("linear in the powers\n4 runs, 0 to do\n"), "{said}");
    assert_eq!(said.matches(": done\n").count(), 4);
}

/// In CSV files, texts that a spreadsheet would run as formulas begin with an apostrophe, column
/// names too. Numbers have none.
#[test]
fn no_value_is_a_formula() {
    let folder = folder(
        r#"{"scene": "scene.json", "combine": "zip", "vary": {
            "=x": {"at": ["/objects/0/name"], "values": ["=1+1", "+a"]},
            "y": {"at": ["/lights/0/position/0"], "values": [-0.1, 0.2]}}}"#,
    );
    ok(&folder, "sweep sweep.json -o out");
    assert_eq!(column(&folder, "out/runs.csv", "'=x"), ["'=1+1", "'+a"]);
    assert_eq!(column(&folder, "out/runs.csv", "y"), ["-0.1", "0.2"]);
    assert_eq!(column(&folder, "out/captors.csv", "captor")[0], "'=1+1/a");
    assert_eq!(column(&folder, "out/groups.csv", "group")[0], "'=1+1");
    for name in ["runs", "captors", "groups"] {
        check_parquet(&folder, &format!("out/{name}"));
    }
}
