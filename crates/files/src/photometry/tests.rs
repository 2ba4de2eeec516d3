//! Tests with files made here: every symmetry against the whole circle, the factors, the messages
//! of errors, and damaged files.

use std::{f64::consts::PI, sync::Arc};

use proptest::prelude::*;

use super::{symmetry::Symmetry, *};
use phylux_core::scene::light::IntensityTable;
use phylux_testing::{check_error, spoiled};

const V: [f64; 7] = [0.0, 15.0, 40.0, 75.0, 90.0, 130.0, 180.0];

/// Returns an intensity that has exactly this symmetry.
fn intensity(c: f64, v: f64, symmetry: Symmetry) -> f64 {
    let (c, v) = (c.to_radians(), v.to_radians());
    let even = 100.0 + 50.0 * v.cos();
    let quarter = 20.0 * (2.0 * c).cos() * v.sin();
    let along = 10.0 * c.cos() * v.sin();
    let across = 8.0 * c.sin() * v.sin();
    match symmetry {
        Symmetry::Axial => even,
        Symmetry::Quadrant => even + quarter,
        Symmetry::At0 => even + quarter + along,
        Symmetry::At90 => even + quarter + across,
        Symmetry::None => even + quarter + along + across,
    }
}

fn angles(from: f64, to: f64) -> Vec<f64> {
    (0..=((to - from) / 15.0) as usize).map(|i| from + 15.0 * i as f64).collect()
}

fn row(c: f64, symmetry: Symmetry, separator: &str) -> String {
    let values = V.iter().map(|&v| format!("{}", intensity(c % 360.0, v, symmetry)));
    values.collect::<Vec<_>>().join(separator)
}

/// Returns an IES file with these horizontal angles.
fn ies(c: &[f64], symmetry: Symmetry) -> String {
    let list = |angles: &[f64]| angles.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
    let rows: Vec<String> = c.iter().map(|&c| row(c, symmetry, " ")).collect();
    format!(
        "IESNA:LM-63-2002\n[TEST] made\nTILT=NONE\n1 -1 1 {} {} 1 2 0 0 0\n1 1 50\n{}\n{}\n{}\n",
        V.len(),
        c.len(),
        list(&V),
        list(c),
        rows.join("\n")
    )
}

/// Returns an EULUMDAT file of 24 planes, with intensities for the given planes only, as its
/// symmetry needs.
fn ldt(number: usize, given: &[f64], symmetry: Symmetry) -> String {
    let mut lines = vec![String::from("nobody"), "1".into(), number.to_string(), "24".into()];
    lines.extend(["15", &V.len().to_string(), "15", "", "made", "", "", ""].map(String::from));
    lines.extend(["0"; 10].map(String::from)); // sizes: lines 13 to 22
    lines.extend(["80", "1", "0", "1"].map(String::from)); // LORL, factor, tilt, sets: 23 to 26
    lines.extend(["1", "LED", "1000", "4000", "80", "50"].map(String::from));
    lines.extend(["0.5"; 10].map(String::from));
    lines.extend((0..24).map(|i| (15 * i).to_string()));
    lines.extend(V.map(|v| v.to_string()));
    lines.extend(given.iter().map(|&c| row(c, symmetry, "\r\n")));
    lines.join("\r\n") + "\r\n"
}

fn read(text: &str) -> Result<Photometry> {
    Photometry::parse(text.as_bytes(), Path::new("lamp"))
}

fn ok(text: &str) -> Photometry {
    read(text).unwrap_or_else(|e| panic!("{e}"))
}

/// Returns the lamp of a file that has one.
fn lamp(text: &str) -> MeasuredLamp {
    let [lamp] = ok(text).lamps.try_into().expect("one lamp");
    lamp
}

/// A symmetric file gives, except for rounding, the same table as a file with the whole circle, in
/// IES and in EULUMDAT.
#[test]
fn symmetric_files_are_their_whole_circle() {
    let cases = [
        (Symmetry::Axial, vec![0.0], 1),
        (Symmetry::Quadrant, angles(0.0, 90.0), 4),
        (Symmetry::At0, angles(0.0, 180.0), 2),
        (Symmetry::At90, angles(90.0, 270.0), 3),
        (Symmetry::None, angles(0.0, 345.0), 0),
    ];
    for (symmetry, c, number) in cases {
        let whole = lamp(&ies(&angles(0.0, 360.0), symmetry));
        // in EULUMDAT the planes run from C = 270 through 0
        let of_ldt = if symmetry == Symmetry::At90 { angles(270.0, 450.0) } else { c.clone() };
        let mut files = vec![lamp(&ldt(number, &of_ldt, symmetry))];
        if symmetry != Symmetry::None {
            files.push(lamp(&ies(&c, symmetry)));
        }
        for file in files {
            assert!((file.flux / whole.flux - 1.0).abs() < 1e-12, "{symmetry:?}");
            let axes = |table: &Arc<IntensityTable>| {
                let (aim, zero) = (glam::DVec3::NEG_Z, glam::DVec3::X);
                phylux_core::scene::light::Intensity::table(table.clone(), aim, zero).unwrap()
            };
            let [file, whole] = [axes(&file.table), axes(&whole.table)];
            for i in 0..400 {
                let (z, turn) = (1.0 - 2.0 * (f64::from(i) + 0.5) / 400.0, 2.4 * f64::from(i));
                let sine = f64::sqrt(1.0 - z * z);
                let d = glam::DVec3::new(sine * turn.cos(), sine * turn.sin(), z).as_vec3();
                let [a, b] = [file.towards(d), whole.towards(d)];
                assert!((a - b).abs() <= 2e-6 * b, "{symmetry:?} {d}: {a} {b}");
            }
        }
    }
}

/// The flux is that of the interpolated table times the factors of the file: the multiplier and the
/// ballast factor, and until 1991 also the photometric factor. The unit of lengths, and blanks,
/// commas and line ends in any place, change nothing.
#[test]
fn factors_count_as_they_should() {
    let even = |head: &str, numbers: &str| {
        lamp(&format!("{head}TILT=NONE\n{numbers}\n0 180\n0\n2 2\n")).flux / (8.0 * PI)
    };
    let modern = "IESNA:LM-63-1995\n[TEST] a\n";
    for (head, numbers, factor) in [
        (modern, "1 1000 1 2 1 1 2 0 0 0\n1 1 50", 1.0),
        (modern, "1 -1 3 2 1 1 1 0.2 0.3 0\n0.5 7 50", 1.5),
        ("IES:LM-63-2019\n", "1,-1,3,2,1,1,1,0,0,0,0.5\n,7 , 50", 1.5),
        ("IESNA91\n", "1 1000 3 2 1 1 1 0 0 0 0.5 0.9 50", 1.35),
        ("an old lamp\n", "1 1000 3 2 1 1 1 0 0 0 0.5 0.9 50", 1.35),
    ] {
        let found = even(head, numbers);
        assert!((found - factor).abs() < 1e-12, "{head}{numbers}: {found}");
    }
    // candela per 1000 lm, with lamps of 1000 lm; the decimal sign may be a comma, and LORL does
    // not count
    let file = ldt(1, &[0.0], Symmetry::Axial);
    let flux = lamp(&file).flux;
    let more = file.replace("\r\nLED\r\n1000\r\n", "\r\nLED\r\n2500\r\n");
    assert!((lamp(&more).flux / flux - 2.5).abs() < 1e-12);
    let factor =
        file.replace("\r\n80\r\n1\r\n0\r\n1\r\n1\r\n", "\r\n40\r\n0,5\r\n0\r\n1\r\n-1\r\n");
    assert!(factor != file && (lamp(&factor).flux / flux - 0.5).abs() < 1e-12);
}

#[test]
fn bad_files_are_told() {
    let good = ies(&angles(0.0, 90.0), Symmetry::Quadrant);
    let changed = |from: &str, to: &str| {
        let text = good.replacen(from, to, 1);
        assert_ne!(text, good, "{from}");
        text
    };
    let eulumdat = ldt(4, &angles(0.0, 90.0), Symmetry::Quadrant);
    for (text, words) in [
        (String::new(), "lamp:1: the file ends before line 3"),
        ("x\n".repeat(40), "the symmetry (Isym) is `x`, not a finite number"),
        (changed("TILT=NONE", "TILT=a.tlt"), "lamp:3: TILT=`A.TLT` names another file"),
        (changed(" 1 2 0 0 0", " 2 2 0 0 0"), "photometric type 2, must be 1 (C)"),
        (changed("1 -1 1 7 7", "1 -1 1 7 6"), "horizontal angles from 0 to 75"),
        (changed("1 -1 1 7 7", "1 -1 1 7.5 7"), "`7.5`, must be 1 to 1000000"),
        (changed("1 -1 1 7 7", "1 -1 1 7 4000000000"), "`4000000000`, must be 1 to"),
        (changed("1 -1 1 7 7", "1 -1 1 999999 999"), "more than 1000000 intensities"),
        (changed("1 -1 1 7", "1 -1 0 7"), "make 0, must be above 0"),
        (changed("0 15 40", "0 45 40"), "vertical angles: 40 comes after 45"),
        (changed("0 15 40", "-1 15 40"), "vertical angles: -1, must be from 0 to 180"),
        (changed("45 60 75 90\n", "45 60 60 90\n"), "horizontal angle 60 comes after 60"),
        (changed("\n150", "\n-150"), "an intensity of -150 at horizontal angle 0"),
        (changed("\n150", "\n1e999"), "intensity 1 of 7 is `1e999`, not a finite number"),
        (good[..good.len() - 20].into(), "the file ends before horizontal angle 7"),
        (good.clone() + "5\n", "`5` comes after the last intensity"),
        (ldt(7, &[0.0], Symmetry::Axial), "`7`, must be 0 to 4"),
        (eulumdat.replacen("24", "23", 1), "23 C planes do not suit this symmetry"),
        (
            eulumdat.replace("\r\n90\r\n", "\r\n91\r\n"),
            "C angles from 0 to 91, must rise from 0 to 90",
        ),
        (eulumdat.clone() + "5\r\n", "a number comes after the last intensity"),
    ] {
        let error = read(&text).map(|_| ()).expect_err(words);
        check_error(&error, Path::new("lamp"));
        assert!(error.to_string().contains(words), "{words}: {error}");
    }
}

/// Files of other forms whose meaning is clear say the same as the usual form.
#[test]
fn other_forms_are_read() {
    let usual = ies(&angles(0.0, 360.0), Symmetry::None);
    let flux = lamp(&usual).flux;
    let changed = |from: &str, to: &str| usual.replacen(from, to, 1);
    for text in [
        changed("TILT=NONE", "TILT = NONE"),
        changed("TILT=NONE", " tilt=none "),
        usual.replace('\n', "\r\n"),
        usual.replace('\n', "\r"),
        usual.clone() + "[END]\nof the file\n",
        ies(&angles(0.0, 345.0), Symmetry::None),
    ] {
        assert!((lamp(&text).flux / flux - 1.0).abs() < 1e-12, "{text}");
    }
    let included = lamp(&changed("TILT=NONE", "TILT=INCLUDE\n1\n3\n0 45 90\n0.9 0.8 0.7"));
    assert!(included.notes[0].contains("TILT=INCLUDE"), "{:?}", included.notes);
    assert!((included.flux / flux - 0.9).abs() < 1e-12);
    for little in [true, false] {
        for mark in ["\u{feff}", ""] {
            let units = mark.encode_utf16().chain(usual.encode_utf16());
            let bytes = |unit: u16| if little { unit.to_le_bytes() } else { unit.to_be_bytes() };
            let bytes: Vec<u8> = units.flat_map(bytes).collect();
            let read = Photometry::parse(&bytes, Path::new("lamp")).unwrap();
            assert!((read.lamps[0].flux / flux - 1.0).abs() < 1e-12);
        }
    }
    // a part of the circle is not guessed
    for c in [vec![-90.0, 0.0, 90.0], vec![0.0, 1.0, 93.0], angles(0.0, 270.0)] {
        let text = ies(&c, Symmetry::None);
        assert!(read(&text).unwrap_err().to_string().contains("horizontal angles from"), "{c:?}");
    }
}

/// The sets of lamps of an EULUMDAT file are alternatives, each with a flux of its own.
#[test]
fn lamp_sets_are_alternatives() {
    let one = ldt(1, &[0.0], Symmetry::Axial);
    let set = "1\r\nLED\r\n1000\r\n4000\r\n80\r\n50\r\n";
    let two = one.replacen(
        &format!("\r\n1\r\n{set}"),
        &format!("\r\n2\r\n{set}{}", set.replace("1000", "2500")),
        1,
    );
    assert_ne!(one, two);
    let (one, two) = (lamp(&one), ok(&two));
    let ratios: Vec<f64> = two.lamps.iter().map(|lamp| lamp.flux / one.flux).collect();
    assert!(ratios.len() == 2 && (ratios[0] - 1.0).abs() < 1e-12, "{ratios:?}");
    assert!((ratios[1] - 2.5).abs() < 1e-12, "{ratios:?}");
    assert_eq!(two.usual, Some(0));
}

/// A set of 0 lm is empty, and so is one without lamps where another one has some: the first of the
/// others is taken. A file whose only set says 0 lamps, as some do, is read as it is.
#[test]
fn lamp_sets_may_be_empty() {
    let of = |sets: &[(i32, u32)]| {
        let set = |&(lamps, lumens): &(i32, u32)| {
            format!("{lamps}\r\nLED\r\n{lumens}\r\n4000\r\n80\r\n50\r\n")
        };
        let one = "\r\n1\r\n1\r\nLED\r\n1000\r\n4000\r\n80\r\n50\r\n";
        let all: String = sets.iter().map(set).collect();
        let text = ldt(1, &[0.0], Symmetry::Axial);
        let text = text.replacen(one, &format!("\r\n{}\r\n{all}", sets.len()), 1);
        let bright = |read: &Photometry| read.lamps.iter().map(|lamp| lamp.flux > 0.0).collect();
        read(&text).map(|read| (read.usual.expect("a set"), bright(&read)))
    };
    let usual = |sets: &[(i32, u32)]| -> (usize, Vec<bool>) { of(sets).unwrap() };
    assert_eq!(usual(&[(1, 0), (1, 1000)]), (1, vec![false, true]));
    assert_eq!(usual(&[(1, 1000), (0, 0), (1, 0)]), (0, vec![true, false, false]));
    assert_eq!(usual(&[(0, 900), (-1, 1000)]), (1, vec![true, true]));
    assert_eq!(usual(&[(0, 900)]), (0, vec![true]));
    assert_eq!(usual(&[(0, 0), (0, 900)]), (1, vec![false, true]));
    for dark in [&[(1, 0)][..], &[(0, 0), (2, 0)]] {
        let error = of(dark).map(|(usual, _): (usize, Vec<bool>)| usual).unwrap_err().to_string();
        assert!(error.contains("lamps of 0 lm and a conversion factor of 1"), "{error}");
    }
}

const WORDS: &[&str] = &["TILT=NONE", "TILT=", "NONE", "360", "180", "90", "7", "IESNA91"];

/// The ending of its name says that a file was meant to be an IES file.
#[test]
fn an_ies_file_needs_its_tilt() {
    let error = Photometry::parse(b"IESNA91\n1 2 3\n", Path::new("a.IES")).unwrap_err();
    let start = "a.IES:2: has no line that begins with `TILT=`; the file is broken";
    assert!(error.to_string().starts_with(start), "{error}");
}

/// Any text gives an error with its place, or a distribution with a positive flux.
fn check(text: &[u8]) {
    let path = Path::new("lamp");
    match Photometry::parse(text, path) {
        Err(error) => check_error(&error, path),
        Ok(photometry) => {
            assert!(photometry.lamps.iter().all(|lamp| lamp.flux >= 0.0 && lamp.flux.is_finite()))
        }
    }
}

static FILES: std::sync::LazyLock<Vec<&'static str>> = std::sync::LazyLock::new(|| {
    let none = Symmetry::None;
    let files = [
        ies(&[0.0], Symmetry::Axial),
        ies(&[90.0, 180.0, 270.0], Symmetry::At90),
        ies(&angles(0.0, 360.0), none),
        ldt(0, &angles(0.0, 345.0), none),
        ldt(3, &angles(270.0, 450.0), Symmetry::At90),
    ];
    files.map(|text| &*text.leak()).into()
});

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_spoiled_file_panics(text in spoiled(&FILES, WORDS)) {
        check(&text);
    }

    /// Arbitrary bytes do not cause a panic.
    #[test]
    fn no_bytes_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200), ies in any::<bool>()) {
        let head: &[u8] = if ies { b"IESNA91\nTILT=NONE\n" } else { b"" };
        check(&[head, &bytes].concat());
    }
}

/// Returns a file of TM-33 with these horizontal angles, in umol/s per sr.
fn tm33(c: &[f64], symmetry: Symmetry, symm: &str) -> String {
    let mut rows = String::new();
    for &c in c {
        for &v in &V {
            let value = intensity(c % 360.0, v, symmetry);
            rows += &format!("<IntData h=\"{c}\" v=\"{v}\">{value}</IntData>\n");
        }
    }
    format!(
        "<?xml version=\"1.0\"?>\n<IESTM33-22><Version>1.1</Version>\n<Emitter><Quantity>1</Quantity>\n<PhotonData>\
         <MinWavelength>400</MinWavelength><MaxWavelength>700</MaxWavelength>\n<PhotonIntensity>{symm}\
         <NumberHorz>{}</NumberHorz><NumberVert>{}</NumberVert>\n{rows}</PhotonIntensity></PhotonData></Emitter></IESTM33-22>",
        c.len(),
        V.len()
    )
}

/// A TM-33 is the IES file with the same intensities, but for its unit; with all symmetries.
#[test]
fn tm33_has_the_intensities_of_the_same_ies_file() {
    for (symmetry, c, symm) in [
        (Symmetry::Axial, vec![0.0], "<Symm>Symm _ Full</Symm>"),
        (Symmetry::Quadrant, angles(0.0, 90.0), "<Symm>Symm_Quad</Symm>"),
        (Symmetry::At0, angles(0.0, 180.0), "<Symm>Symm _ Bi _ 0</Symm>"),
        (Symmetry::At90, angles(90.0, 270.0), "<Symm>Symm _ Bi _90</Symm>"),
        (Symmetry::None, angles(0.0, 345.0), ""),
    ] {
        let (own, ies) = (lamp(&tm33(&c, symmetry, symm)), lamp(&ies(&c, symmetry)));
        assert_eq!((own.unit, own.range), (FluxUnit::Micromole, Some([400.0, 700.0])));
        assert_eq!((own.flux, own.notes.len()), (ies.flux, 0));
        assert_eq!(format!("{:?}", own.table), format!("{:?}", ies.table));
    }
    let whole = tm33(&[0.0], Symmetry::Axial, "");
    let flux = lamp(&whole).flux;
    let more = |from: &str, to: &str| lamp(&whole.replace(from, to));
    let twice = more("<NumberHorz>", "<Multiplier>2</Multiplier><NumberHorz>");
    assert!((twice.flux / flux - 2.0).abs() < 1e-12);
    let stated = more("</PhotonIntensity>", "</PhotonIntensity><PhotonFlux>7</PhotonFlux>");
    assert!(stated.flux == flux && stated.notes[0].contains("the flux that it states is 7"));
    let relative = whole
        .replace("<NumberHorz>", "<Absolute>false</Absolute><NumberHorz>")
        .replace("</PhotonIntensity>", "</PhotonIntensity><PhotonFlux>7</PhotonFlux>");
    let relative = lamp(&relative);
    assert_eq!((relative.flux, relative.notes.len()), (7.0, 0));
    let watts = more("Photon", "Radiant");
    assert_eq!((watts.unit, watts.range), (FluxUnit::Watt, Some([400.0, 700.0])));
    let lumens = more("Photon", "Luminous");
    assert_eq!((lumens.unit, lumens.range), (FluxUnit::Lumen, None));
    let many = more("<Quantity>1", "<BallastFactor>0.9</BallastFactor><Quantity>4");
    assert_eq!(many.notes.len(), 2, "{:?}", many.notes);
}

/// The emitters of a TM-33 keep intensities and units of their own; one without any is passed over.
#[test]
fn emitters_of_tm33_are_lamps() {
    let [wide, narrow] = [&[0.0][..], &[0.0, 90.0]]
        .map(|c| tm33(c, if c.len() == 1 { Symmetry::Axial } else { Symmetry::Quadrant }, ""));
    let emitter = |text: &str| {
        let (begin, end) = (text.find("<Emitter>").unwrap(), text.find("</IESTM33").unwrap());
        text[begin..end].to_string()
    };
    let more = format!("{}<Emitter></Emitter>", emitter(&narrow).replace("Photon", "Radiant"));
    let both = wide.replacen("</IESTM33", &format!("{more}</IESTM33"), 1);
    let Photometry { lamps, usual } = ok(&both);
    let (wide, narrow) = (lamp(&wide), lamp(&narrow.replace("Photon", "Radiant")));
    assert_eq!((lamps.len(), usual), (2, None));
    for (found, own) in lamps.iter().zip([wide, narrow]) {
        assert_eq!((found.flux, found.unit, found.range), (own.flux, own.unit, own.range));
        assert_eq!(format!("{:?}", found.table), format!("{:?}", own.table));
    }
}

#[test]
fn errors_in_tm33_name_the_line() {
    let path = Path::new("lamp.xml");
    let whole = tm33(&[0.0], Symmetry::Axial, "");
    for (from, to, words) in [
        ("v=\"15\">", "v=\"15\">-", "lamp.xml:7: an intensity of -"),
        ("v=\"15\"", "v=\"x\"", "lamp.xml:7: the angle v is `x`, not a finite"),
        ("v=\"15\"", "v=\"0\"", "lamp.xml:5: `NumberVert` is 7, but there are 6"),
        ("<NumberHorz>1<", "<NumberHorz>2<", "`NumberHorz` is 2, but there are 1"),
        ("h=\"0\" v=\"15\"", "h=\"9\" v=\"15\"", "`NumberHorz` is 1, but there are 2"),
        (
            "<NumberHorz>1</NumberHorz>",
            "<Symm>Symm_Quad</Symm>",
            "`Symm` is `Symm_Quad`, which its",
        ),
        (
            "<NumberHorz>1</NumberHorz>",
            "<Symm>Symm_Arbitrary</Symm>",
            "a `Symm` of `Symm_Arbitrary`",
        ),
        ("<NumberHorz>1</NumberHorz>", "<Multiplier>0</Multiplier>", "a multiplier of 0"),
        (
            "<NumberHorz>1</NumberHorz>",
            "<Absolute>false</Absolute>",
            "relative intensities, and no `Photo",
        ),
        ("IntData", "Data", "no `IntData` in it"),
        ("PhotonIntensity", "Other", "no emitter with `PhotonIntensity`"),
        (
            "IESTM33-22",
            "IESTM2714",
            "lamp.xml:2: its outermost element is `IESTM2714`, not that of TM-33",
        ),
        (">400<", ">800<", "a flux from 800 to 700 nm"),
        (
            "<Emitter>",
            "<Equipment><Gonioradiometer><Type>CIE _ B</Type></Gonioradiometer></Equipment><Emitter>",
            "angles of the type `CIE _ B`, must be C",
        ),
    ] {
        let text = whole.replace(from, to);
        let error = Photometry::parse(text.as_bytes(), path).expect_err(words);
        check_error(&error, path);
        assert!(error.to_string().contains(words), "{words}: {error}");
    }
    let dark = tm33(&[0.0], Symmetry::Axial, "").replace("h=\"0\" v=\"15\"", "h=\"0\" v=\"0\"");
    let dark = dark.replace("<NumberVert>7<", "<NumberVert>6<");
    let error = Photometry::parse(dark.as_bytes(), path).unwrap_err().to_string();
    assert!(error.contains("two intensities at h = 0, v = 0"), "{error}");
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Any damaged TM-33 gives an error with its place, or a lamp with light.
    #[test]
    fn no_spoiled_tm33_panics(text in spoiled_tm33()) {
        let path = Path::new("a.xml");
        match Photometry::parse(&text, path) {
            Err(error) => check_error(&error, path),
            Ok(found) => prop_assert!(found.lamps.iter().all(|lamp| lamp.flux.is_finite())),
        }
    }
}

fn spoiled_tm33() -> impl Strategy<Value = Vec<u8>> {
    const WORDS: [&str; 6] =
        ["<IntData h=\"90\" v=\"0\">1</IntData>", "</Emitter>", "v=\"", "<![CDATA[", "&lt;", "-->"];
    let file: &'static str = Box::leak(tm33(&[0.0, 90.0], Symmetry::Quadrant, "").into_boxed_str());
    let files: &'static [&'static str] = Box::leak(Box::new([file]));
    spoiled(files, &WORDS)
}
