//! Tests with the same table in every form that is read, the messages of errors, and damaged files.

use proptest::prelude::*;

use super::*;
use phylux_core::math::curve::Curve;
use phylux_testing::{check_error, spoiled};

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
        assert_eq!(found.unwrap_or_else(|e| panic!("{text}: {e}")).curve, curve, "{text}");
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
        ("nm,R,R\n400,1,2\n401,2,3", Column::Name("R"), "a.csv:1: column 3 is named `R` too"),
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
            Ok(curve) => prop_assert!(curve.curve.at(500.0).is_finite()),
        }
    }
}

const TM27: &str = r#"<?xml version="1.0"?>
<IESTM2714 xmlns="http://www.ies.org/iestm2714" version="1.0">
<Header><Manufacturer>nobody</Manufacturer><Description>red</Description></Header>
<SpectralDistribution>
<SpectralQuantity>relative</SpectralQuantity>
<BandwidthFWHM>2.0</BandwidthFWHM><BandwidthCorrected>false</BandwidthCorrected>
<SpectralData wavelength="600">0.5</SpectralData>
<SpectralData wavelength="650.0">1.5</SpectralData>
<SpectralData wavelength="700">-0.1</SpectralData>
</SpectralDistribution>
</IESTM2714>"#;

const TM33: &str = r#"<?xml version="1.0"?>
<IESTM33><Version>1.1</Version><Header><Description>two</Description></Header>
<Emitter><Quantity>1</Quantity><Description>white</Description><SpectralData>
<EmitterSpectral><NumberWavelength>2</NumberWavelength>
<PwrData w="400">0.1</PwrData><PwrData w="700">0.3</PwrData></EmitterSpectral>
<EmitterSpectral><EmitterName>far red</EmitterName><Multiplier>2</Multiplier>
<PwrData w="700">1</PwrData><PwrData w="750">3</PwrData></EmitterSpectral>
</SpectralData></Emitter></IESTM33>"#;

/// Files of the IES give their spectra by number and by name, and say what they count.
#[test]
fn files_of_the_ies_are_read() {
    let path = Path::new("lamp.spdx");
    let read = |text: &str, column| parse(text.as_bytes(), path, column).expect("a spectrum");
    let found = read(TM27, Column::Number(2));
    assert_eq!(found.counts, Some(Counts::Energy));
    assert_eq!(found.curve.places(), [600.0, 650.0, 700.0]);
    assert_eq!([found.curve.at(625.0), found.curve.at(700.0)], [1.0, -0.1]);
    assert_eq!(read(TM27, Column::Name("red")), found);
    let leaf = read(&TM27.replace(">relative<", ">Transmittance<"), Column::Number(2));
    assert_eq!(leaf, Measured { counts: Some(Counts::Share(Share::Transmittance)), ..found });
    let [white, far_red] = [2, 3].map(|number| read(TM33, Column::Number(number)));
    assert_eq!([white.curve.at(550.0), far_red.curve.at(725.0)], [0.2, 4.0]);
    assert_eq!(read(TM33, Column::Name("white")), white);
    assert_eq!(read(TM33, Column::Name("far red")), far_red);
}

#[test]
fn errors_in_files_of_the_ies_name_the_line() {
    let path = Path::new("lamp.spdx");
    for (text, from, to, column, words) in [
        (
            TM27,
            "700",
            "640",
            Column::Number(2),
            "lamp.spdx:9: the wavelength 640 nm comes after 650",
        ),
        (TM27, ">1.5<", ">x<", Column::Number(2), "lamp.spdx:8: the value is `x`, not a finite"),
        (TM27, "\"600\"", "\"\"", Column::Number(2), "lamp.spdx:7: the wavelength is ``"),
        (TM27, "\"600\"", "\"0.5\"", Column::Number(2), "lamp.spdx:7: a wavelength of 0.5 nm"),
        (
            TM27,
            "relative",
            "other",
            Column::Number(2),
            "lamp.spdx:4: its `SpectralQuantity` is `other`; it",
        ),
        (
            TM27,
            "IESTM2714",
            "spd",
            Column::Number(2),
            "lamp.spdx:2: its outermost element is `spd`",
        ),
        (TM27, "SpectralData ", "Data ", Column::Number(2), "lamp.spdx:"),
        (TM27, "x", "x", Column::Number(1), "lamp.spdx: column 1 of 2; column 2 is the first"),
        (TM27, "x", "x", Column::Number(3), "lamp.spdx: column 3 of 2"),
        (
            TM27,
            "x",
            "x",
            Column::Name("rde"),
            "no spectrum of an emitter `rde`; did you mean `red`?",
        ),
        (TM33, ">2<", ">3<", Column::Number(2), "lamp.spdx:4: 2 values, but 3 wavelengths"),
        (
            TM33,
            ">2</M",
            ">1e308</M",
            Column::Number(3),
            "lamp.spdx:7: the multiplier times 3 is no",
        ),
        (TM33, "EmitterSpectral", "Other", Column::Number(2), "lamp.spdx: no spectrum in it"),
    ] {
        let text = text.replace(from, to);
        let error = parse(text.as_bytes(), path, column).expect_err(words);
        check_error(&error, path);
        assert!(error.to_string().contains(words), "{words}: {error}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Any damaged file of the IES gives an error with its place, or a spectrum.
    #[test]
    fn no_spoiled_file_of_the_ies_panics(
        text in spoiled(&[TM27, TM33], &["<PwrData w=\"1\">", "</Emitter>", "w=\"", "<![CDATA[", "&amp;", "<!--", "-->"]),
        named in any::<bool>(),
    ) {
        let path = Path::new("a.spdx");
        let column = if named { Column::Name("white") } else { Column::Number(2) };
        match parse(&text, path, column) {
            Err(error) => check_error(&error, path),
            Ok(found) => prop_assert!(found.curve.at(500.0).is_finite()),
        }
    }
}
