//! Tests with the same table in every form that is read, the messages of errors, and damaged files.

use proptest::prelude::*;

use super::*;
use crate::formats::spoil::{check_error, spoiled};

const FILES: [&str; 10] = [
    "\"lambda\";\"moy\"\n400;0,5\n401;0,25\n403;-0,125\n",
    "nm,R,T\n400,0,0.5\n401,0,0.25\n403,0,-0.125\n",
    "nm\tR\n400\t0.5\n401\t0.25\n\n403\t-0.125\n",
    "\"wavelength nm\" \"a b\"\n400 0.5\n 401   0.25 \n403 -1.25e-1\n",
    "400 0.5\r\n401 0.25\r\n403 -0.125\r\n",
    "400;0.5\n401;0.25\n403;-0.125",
    "# spectrometer 7\n# wavelength (nm), reflectance\n400 0.5\n401 0.25\n# lamp changed\n403 -0.125\n",
    "#made, by; hand\n\n # nm,R\n\"nm\",\"R\",\n400,0.5,\n401,0.25,\n403,-0.125,,\n",
    "# nm\tT\tR\n400\t1\t0,5\n401\t1\t0,25\n403\t1\t-0,125\n",
    "nm R\n400 0,5\n401 0,25\n403 -0,125\n",
];

#[test]
fn the_same_table_in_all_dresses() {
    let curve = Curve::new([[400.0, 0.5], [401.0, 0.25], [403.0, -0.125]]).unwrap();
    let columns: [Column; 10] = [
        Column::Name("moy"),
        Column::Name("T"),
        Column::Number(2),
        Column::Name("a b"),
        Column::Number(2),
        Column::Number(2),
        Column::Number(2),
        Column::Name("R"),
        Column::Name("R"),
        Column::Number(2),
    ];
    for (text, column) in FILES.iter().zip(columns) {
        let found = parse(text.as_bytes(), Path::new("a.csv"), column);
        assert_eq!(found.unwrap_or_else(|e| panic!("{text}: {e}")), curve, "{text}");
    }
}

#[test]
fn bad_tables_are_told() {
    for (text, column, words) in [
        ("", Column::Number(2), "a.csv: is empty"),
        ("nm,R\n400,1\n", Column::Number(2), "a.csv: 1 points"),
        ("nm,R\n400,1\n401,2", Column::Number(3), "a.csv:1: column 3 of 2"),
        ("nm,R\n400,1\n401,2", Column::Number(1), "the first has the wavelengths"),
        ("nm,leaf\n400,1\n401,2", Column::Name("laef"), "did you mean `leaf`?"),
        ("400,1\n401,2", Column::Name("R"), "no header that names a column `R`"),
        ("nm,R\n400,1\n401,x", Column::Number(2), "a.csv:3: the value is `x`, not a finite"),
        ("nm,R\n400,1\n401", Column::Number(2), "a.csv:3: the value is ``"),
        ("nm,R\n400,1\n390,1", Column::Number(2), "a.csv:3: the wavelength 390 nm comes after 400"),
        (
            "nm,R\n400,0,05\n500,0,06",
            Column::Number(2),
            "a.csv:2: 3 cells, with `05` in the last, but 2",
        ),
        ("nm,R,\n400,0,05", Column::Number(2), "a.csv:2: 3 cells, with `05` in the last, but 2"),
        (
            "nm,R,T\n400,0,05,0,1",
            Column::Number(2),
            "a.csv:2: 5 cells, with `0` in the last, but 3",
        ),
        (
            "nm,R\n400,1\n401,0,5",
            Column::Number(2),
            "where semicolons separate the columns, a comma",
        ),
        ("nm R\n400 1\n401 2 3", Column::Number(2), "a.csv:3: 3 cells"),
        ("400,0,05\n500,0,06", Column::Number(2), "a.csv:1: rows of whole numbers between commas"),
        ("400,0,05\n500,0", Column::Number(2), "a.csv:1: rows of whole numbers between commas"),
        ("# a\n400,1\n401,0,5", Column::Number(2), "a.csv:3: 3 cells"),
        ("# a\n# b\n", Column::Number(2), "a.csv: is empty"),
        ("nm,R\n-400,1\n390,1", Column::Number(2), "a.csv:2: the wavelength -400 nm"),
    ] {
        let path = Path::new("a.csv");
        let error = parse(text.as_bytes(), path, column).expect_err(words);
        check_error(&error, path);
        assert!(error.to_string().contains(words), "{words}: {error}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Any text gives an error with its place, or a spectrum.
    #[test]
    fn no_spoiled_table_panics(text in spoiled(&FILES, &["400", "R", "nm", "\"nm\""]), named in any::<bool>()) {
        let path = Path::new("a.csv");
        let column = if named { Column::Name("R") } else { Column::Number(2) };
        match parse(&text, path, column) {
            Err(error) => check_error(&error, path),
            Ok(curve) => prop_assert!(curve.at(500.0).is_finite()),
        }
    }
}
