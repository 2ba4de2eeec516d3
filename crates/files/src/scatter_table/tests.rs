//! Tests of both readers: the values from valid files, and that no damaged file causes a panic.

use std::fmt::Write;

use glam::Vec3;
use proptest::prelude::*;

use super::*;
use phylux_core::scene::material::{Bsdf, Interaction, Material, Scatterer};
use phylux_testing::{check_error, spoiled};

fn read(text: &str, name: &str, bands: &[&str]) -> Result<ScatterTable> {
    parse(
        text.as_bytes(),
        Path::new(name),
        Wanted { bands, limits: &[], named: bands != ["all"], front: Side::Outside },
    )
}

/// Returns the unit vector that leaves the surface at angle `theta` to the front's normal z and
/// azimuth `phi` from x, degrees.
fn direction(theta: f32, phi: f32) -> Vec3 {
    let (theta, phi) = (theta.to_radians(), phi.to_radians());
    Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
}

/// Returns f of the first band for light that comes from one direction and leaves in another; x is
/// at azimuth 0.
fn f(table: &ScatterTable, from: [f32; 2], to: [f32; 2]) -> f32 {
    let table = Bsdf::new(&table.faces, &["all"]).unwrap();
    let surface = Material::Table(table.into()).placed(1, vec![(0, Vec3::X)]);
    let at = Interaction::new(-direction(from[0], from[1]), Vec3::Z);
    surface.evaluate::<[f32; 1]>(&at, direction(to[0], to[1])).0[0]
}

/// Writes a table with the full grid of these angles.
fn csv(lists: [&[i32]; 4], mut f: impl FnMut([i32; 4]) -> f64) -> String {
    let mut text = "theta_i,phi_i,theta_o,phi_o,all\n".to_string();
    for &a in lists[0] {
        for &b in lists[1] {
            for &c in lists[2] {
                for &d in lists[3] {
                    writeln!(text, "{a},{b},{c},{d},{}", f([a, b, c, d])).unwrap();
                }
            }
        }
    }
    text
}

/// The cells of angles, differences of azimuths, mirrored halves, 360 instead of 0, and the side
/// that each angle belongs to.
#[test]
fn four_angles_are_read() {
    // the value encodes the angles: 1e-3 theta_i + 1e-4 theta_o + 1e-5 phi_o
    let value = |[a, _, c, d]: [i32; 4]| {
        1e-3 * f64::from(a) + 1e-4 * f64::from(c) + 1e-5 * f64::from(d % 360)
    };
    let whole = csv([&[0, 40, 80], &[0], &[10, 50, 130, 170], &[0, 90, 180, 270, 360]], value);
    let table = read(&whole, "a.csv", &["all"]).unwrap();
    let warning =
        "theta_o ends 50.0 degrees from the normal of the front: beyond, its last values hold";
    assert_eq!((table.warnings.len(), table.warnings[0].as_str()), (2, warning));
    for (from, to, expected) in [
        ([40.0, 0.0], [50.0, 90.0], 0.0459),
        // the difference of the azimuths counts, and cells extend half way to their neighbours
        ([40.0, 30.0], [45.0, 140.0], 0.0459),
        ([20.0, 0.0], [50.0, 0.0], 0.025),
        ([89.0, 0.0], [5.0, 350.0], 0.081),
        // transmitted light
        ([40.0, 0.0], [155.0, 270.0], 0.0597),
        ([40.0, 0.0], [130.0, 180.0], 0.0548),
    ] {
        let found = f64::from(f(&table, from, to));
        assert!((found - expected).abs() < 1e-6, "{from:?} {to:?}: {found} {expected}");
    }
    // light from behind: reflected like light on the front, transmitted in the opposite direction
    assert!((f(&table, [140.0, 0.0], [170.0, 0.0]) - 0.041).abs() < 1e-6);
    let (there, back) =
        (f(&table, [40.0, 0.0], [130.0, 90.0]), f(&table, [130.0, 90.0], [40.0, 0.0]));
    assert!((there - back).abs() < 1e-7 && there > 0.05, "{there} {back}");

    let half = csv([&[0, 40, 80], &[0], &[10, 50], &[0, 90, 180]], value);
    let table = read(&half, "a.csv", &["all"]).unwrap();
    assert!((f(&table, [40.0, 0.0], [50.0, 270.0]) - 0.0459).abs() < 1e-6);
    assert_eq!(f(&table, [40.0, 0.0], [130.0, 0.0]), 0.0);

    // both azimuths matter: the sheet is turned about its normal, and x is at azimuth 0
    let turned =
        csv([&[0, 40, 80], &[0, 90, 180, 270], &[10, 50], &[0, 90, 180, 270]], |[a, b, c, d]| {
            value([a, b, c, d]) + f64::from(b) * 1e-4
        });
    let table = read(&turned, "a.csv", &["all"]).unwrap();
    for (phi, expected) in [(90.0, 0.0549), (45.0, 0.0504)] {
        let found = f(&table, [40.0, phi], [50.0, 90.0]);
        assert!((found - expected).abs() < 1e-6, "{phi}: {found} {expected}");
    }
    // the back has values of its own
    let both = csv([&[0, 40, 140, 180], &[0], &[10, 50, 130, 170], &[0]], |angles| {
        // whole values would send on more light than comes
        0.5 * value(angles)
    });
    let table = read(&both, "a.csv", &["all"]).unwrap();
    assert!((f(&table, [140.0, 0.0], [130.0, 0.0]) - 0.0765).abs() < 1e-6);
    assert!((f(&table, [140.0, 0.0], [50.0, 77.0]) - 0.0725).abs() < 1e-6);
    assert_eq!(table.warnings.len(), 4, "{:?}", table.warnings);
}

/// Writes a small file of WINDOW with 3 patches; the value of a pair is
/// 0.01 (3 leaving + incident + 1).
fn xml(direction: &str) -> String {
    let block = "<AngleBasisBlock><Theta>0</Theta><nPhis>1</nPhis><ThetaBounds><LowerTheta>0</LowerTheta>\
        <UpperTheta>30</UpperTheta></ThetaBounds></AngleBasisBlock><AngleBasisBlock><Theta>60</Theta><nPhis>2</nPhis>\
        <ThetaBounds><LowerTheta>30</LowerTheta><UpperTheta>90</UpperTheta></ThetaBounds></AngleBasisBlock>";
    format!(
        "<?xml version=\"1.0\"?>\n<!-- made by hand -->\n<WindowElement xmlns=\"http://windows.lbl.gov\"><Optical><Layer>\
        <DataDefinition><IncidentDataStructure>Columns</IncidentDataStructure><AngleBasis>\
        <AngleBasisName>mine &amp; yours</AngleBasisName>{block}</AngleBasis></DataDefinition><WavelengthData>\
        <Wavelength unit=\"Integral\">Visible</Wavelength><WavelengthDataBlock>\
        <WavelengthDataDirection>{direction}</WavelengthDataDirection><ColumnAngleBasis>mine &amp; yours</ColumnAngleBasis>\
        <RowAngleBasis>mine &amp; yours</RowAngleBasis><ScatteringData>\n0.01, 0.02, 0.03,\n 0.04,0.05,0.06\n\
        0.07 0.08 0.09,\n</ScatteringData></WavelengthDataBlock></WavelengthData></Layer></Optical></WindowElement>\n"
    )
}

/// Columns are patches of incidence. The azimuth of such a patch is that of light which passes
/// straight through, counted from the right as the sheet is seen from its back. Azimuth 0 of the
/// file is therefore azimuth 180 here, to the left as seen from the front.
#[test]
fn klems_patches_are_read() {
    let table = read(&xml("Transmission Front"), "a.xml", &["all"]).unwrap();
    for (from, to, expected) in [
        ([10.0, 77.0], [170.0, 3.0], 0.01),
        // column 1: the light travels towards azimuth 0 of the file
        ([60.0, 0.0], [120.0, 180.0], 0.05),
        ([60.0, 0.0], [120.0, 0.0], 0.08),
        ([60.0, 0.0], [175.0, 180.0], 0.02),
        ([60.0, 180.0], [120.0, 180.0], 0.06),
        // light from behind travels in the opposite direction
        ([120.0, 180.0], [60.0, 0.0], 0.05),
        ([10.0, 0.0], [10.0, 0.0], 0.0),
    ] {
        let found = f(&table, from, to);
        assert!((found - expected).abs() < 1e-6, "{from:?} {to:?}: {found}");
    }
    let table = read(&xml("Reflection Front"), "a.XML", &["red"]).unwrap();
    // a mirror's light stays in its patch, on both faces
    assert!((f(&table, [60.0, 0.0], [60.0, 180.0]) - 0.05).abs() < 1e-6);
    assert!((f(&table, [120.0, 0.0], [120.0, 180.0]) - 0.05).abs() < 1e-6);
}

/// Azimuths 0 and 180 of the file change places here, 90 and 270 stay.
#[test]
fn azimuths_of_klems_patches_are_seen_from_the_inside() {
    // four patches all around; the value of a pair is 0.01 (4 leaving + incident + 1)
    let values: Vec<String> =
        (1..=16).map(|value| format!("{}", f64::from(value) / 100.0)).collect();
    let text = xml("Transmission Front");
    let (head, rest) = text.split_once("<AngleBasisBlock>").expect("a basis");
    let (_, rest) = rest.split_once("</AngleBasis>").expect("its end");
    let (middle, rest) = rest.split_once("0.01, ").expect("values");
    let (_, tail) = rest.split_once("</ScatteringData>").expect("their end");
    let basis = "<AngleBasisBlock><nPhis>4</nPhis><ThetaBounds><UpperTheta>90</UpperTheta></ThetaBounds></AngleBasisBlock>";
    let text =
        format!("{head}{basis}</AngleBasis>{middle}{}</ScatteringData>{tail}", values.join(" "));
    let table = read(&text, "a.xml", &["all"]).unwrap();
    for (patch, ours) in [(0, 180.0), (1, 90.0), (2, 0.0), (3, 270.0)] {
        for (coming, from) in [(0, 0.0), (1, 270.0), (2, 180.0), (3, 90.0)] {
            let expected = (4 * patch + coming + 1) as f32 / 100.0;
            let found = f(&table, [45.0, from], [135.0, ours]);
            assert!(
                (found - expected).abs() < 1e-6,
                "{coming} to {patch}: {found}, not {expected}"
            );
        }
    }
}

/// A matrix that is missing is made from that of the other face, and what is made or left out is
/// told.
#[test]
fn missing_faces_follow_from_the_other() {
    let back = read(&xml("Transmission Back"), "a.xml", &["all"]).unwrap();
    for (from, to, expected) in [
        // column 1: the light travels towards azimuth 0 of the file, which is 180 here
        ([120.0, 0.0], [60.0, 180.0], 0.05),
        ([120.0, 0.0], [5.0, 180.0], 0.02),
        ([175.0, 0.0], [60.0, 180.0], 0.04),
        ([120.0, 180.0], [60.0, 180.0], 0.06),
        // the same the other way around
        ([60.0, 180.0], [120.0, 0.0], 0.05),
        ([5.0, 180.0], [120.0, 0.0], 0.02),
        ([60.0, 180.0], [175.0, 0.0], 0.04),
        ([60.0, 180.0], [120.0, 180.0], 0.06),
    ] {
        let found = f(&back, from, to);
        assert!((found - expected).abs() < 1e-6, "{from:?} {to:?}: {found}");
    }
    let told = "it has no `Transmission Front`: that is taken from `Transmission Back`, the other way around";
    assert_eq!(back.warnings, [told]);
    let front = read(&xml("Transmission Front"), "a.xml", &["all"]).unwrap();
    assert_eq!(front.warnings, [""; 0]);

    // three of four matrices, and a second one of the same kind
    let with = |text: &str, direction: &str, factor: &str| {
        let block = text.split_once("<WavelengthDataBlock>").unwrap().1;
        let block = block.split_once("</WavelengthDataBlock>").unwrap().0;
        let (_, rest) = block.split_once("</WavelengthDataDirection>").unwrap();
        let more = format!(
            "</WavelengthDataBlock><WavelengthDataBlock><WavelengthDataDirection>{direction}</WavelengthDataDirection>{}",
            rest.replace("0.0", factor)
        );
        text.replacen("</WavelengthDataBlock>", &(more + "</WavelengthDataBlock>"), 1)
    };
    let three = with(&xml("Transmission Front"), "Reflection Back", "0.1");
    let table = read(&three, "a.xml", &["all"]).unwrap();
    assert!((f(&table, [120.0, 180.0], [60.0, 0.0]) - 0.05).abs() < 1e-6);
    // the other way around in both, as the rows of a face have to be alike
    assert!((f(&table, [120.0, 0.0], [120.0, 180.0]) - 0.19).abs() < 1e-6);
    // light on the front is mirrored as on the back
    assert!((f(&table, [60.0, 0.0], [60.0, 180.0]) - 0.15).abs() < 1e-6);
    assert_eq!(table.warnings.len(), 2, "{:?}", table.warnings);
    let zeros = with(&xml("Transmission Back"), "Transmission Front", "0 ");
    let zeros = zeros.replacen("0 1, 0 2, 0 3,\n 0 4,0 5,0 6\n0 7 0 8 0 9,", &"0 ".repeat(9), 1);
    let table = read(&zeros, "a.xml", &["all"]).unwrap();
    assert!((f(&table, [60.0, 180.0], [175.0, 0.0]) - 0.04).abs() < 1e-6);
    assert!(
        table.warnings[0].starts_with("`Transmission Front` is all zeros"),
        "{:?}",
        table.warnings
    );
    let twice = with(&xml("Transmission Front"), "transmission front", "0.1");
    let table = read(&twice, "a.xml", &["all"]).unwrap();
    assert_eq!(
        table.warnings,
        ["a second block of `transmission front` for `Visible` is not used"]
    );
    assert!((f(&table, [10.0, 77.0], [170.0, 3.0]) - 0.01).abs() < 1e-6);
    let layers = twice
        .replacen("<Wavelength ", "<LayerNumber>System</LayerNumber><Wavelength ", 1)
        .replace("</Layer>", "<WavelengthData><LayerNumber>1</LayerNumber><Wavelength>Visible</Wavelength><WavelengthDataBlock>\
            <WavelengthDataDirection>Reflection Front</WavelengthDataDirection></WavelengthDataBlock></WavelengthData></Layer>");
    let table = read(&layers, "a.xml", &["all"]).unwrap();
    assert_eq!(table.warnings.len(), 2, "{:?}", table.warnings);
    assert!(table.warnings[0].starts_with("its blocks of single layers are not used"));
    // without the whole sheet, the first layer is all that is read
    let others = layers.replace(">System<", ">2<");
    let table = read(&others, "a.xml", &["all"]).unwrap();
    assert_eq!(
        table.warnings[0],
        "it has no `System`: the sheet is taken to be its layer `2` alone, and the others are not used"
    );
    assert!((f(&table, [10.0, 77.0], [170.0, 3.0]) - 0.01).abs() < 1e-6);
}

/// A band that takes the wavelengths of others is told so, whether there are better ones or not.
#[test]
fn bands_beyond_the_visible_are_told() {
    let text = xml("Transmission Front");
    let (head, data) = text.split_once("<WavelengthData>").unwrap();
    let data = data.split_once("</Layer>").unwrap().0;
    let solar = data.replace("Visible", "Solar").replace("0.0", "0.1");
    let both = format!(
        "{head}<WavelengthData>{solar}<WavelengthData>{data}</Layer></Optical></WindowElement>"
    );
    let look = |text: &str, band: &str, limits| {
        let wanted =
            Wanted { bands: &[band], limits: &[limits], named: true, front: Side::Outside };
        let table = parse(text.as_bytes(), Path::new("a.xml"), wanted).unwrap();
        (f(&table, [60.0, 0.0], [120.0, 180.0]), table.warnings.join("; "))
    };
    let nir = Some([700.0, 1100.0]);
    for (text, band, limits, value, words) in [
        (&both, "PAR", Some([400.0, 700.0]), 0.05, ""),
        (&both, "red", None, 0.05, ""),
        (&both, "solar", nir, 0.15, ""),
        (
            &both,
            "NIR",
            nir,
            0.05,
            "band `NIR` takes the wavelengths `Visible`, which are not its own; the file also has `Solar`",
        ),
        (&both, "NIR", None, 0.05, "the file also has `Solar`: name the band so"),
        (&text, "far", nir, 0.05, "which are not its own; and the file has no other"),
        (&text.replace("Visible", "NIR"), "nir", nir, 0.05, ""),
        (
            &text.replace("Visible", "Solar"),
            "PAR",
            Some([400.0, 700.0]),
            0.05,
            "band `PAR` takes the wavelengths `Solar`",
        ),
    ] {
        let (found, told) = look(text, band, limits);
        assert!((found - value).abs() < 1e-6, "{band}: {found}");
        assert!(told.contains(words) && told.is_empty() == words.is_empty(), "{band}: {told}");
    }
}

/// Klems' smaller bases are known by name.
#[test]
fn known_bases_need_no_definition() {
    for (name, patches) in
        [("LBNL/Klems Full", 145), ("LBNL/Klems Half", 73), ("LBNL/Klems Quarter", 41)]
    {
        let text = xml("Transmission Front")
            .replace("AngleBasis>mine &amp; yours", &format!("AngleBasis>{name}"));
        let (head, rest) = text.split_once("0.01, ").unwrap();
        let tail = rest.split_once("</ScatteringData>").unwrap().1;
        let values = "0.2 ".repeat(patches * patches);
        let table = read(&format!("{head}{values}</ScatteringData>{tail}"), "a.xml", &["all"]);
        let table = table.unwrap_or_else(|e| panic!("{name}: {e}"));
        assert!((f(&table, [70.0, 3.0], [99.0, 88.0]) - 0.2).abs() < 1e-6);
    }
}

/// Semicolons, decimal commas and comments.
#[test]
fn a_grid_in_other_dresses() {
    let plain = csv([&[0, 40, 80], &[0], &[10, 50], &[0]], |[a, _, c, _]| 1e-3 * f64::from(a + c));
    let table = read(&plain, "a.csv", &["all"]).unwrap();
    let commas = plain.replace(',', ";").replace('.', ",");
    let tabs = plain.replace(',', "\t");
    let comments = plain.replace("\n40,0,10", "\n# a lamp, changed\n 40,0,10");
    for text in [commas.clone(), tabs, format!("# one\n#two; three\n\n{commas}"), comments] {
        let found = read(&text, "a.csv", &["all"]).unwrap_or_else(|e| panic!("{text}: {e}"));
        assert_eq!(found.faces, table.faces, "{text}");
    }
}

#[test]
fn errors_say_where_and_what() {
    let good = "theta_i,phi_i,theta_o,phi_o,red\n0,0,0,0,0.1\n";
    for (text, start) in [
        ("", "a.csv: is empty; a table begins with `theta_i"),
        ("theta_i,phi_i,theta_o,red\n", "a.csv:1: no column `phi_o`; a table begins"),
        (&good.replace("red", "rde"), "a.csv:1: no column `red` for that band; did you mean `rde`"),
        (&good.replace("0.1", "x"), "a.csv:2: `red` is `x`, not a finite number; every row"),
        (&good.replace("0.1", "-1"), "a.csv:2: `red` is -1, must be at least 0; noise below 0"),
        (&good.replace("\n0,", "\n200,"), "a.csv:2: theta_i = 200, must be from 0 to 180"),
        ("theta_i,phi_i,theta_o,phi_o,red\n", "a.csv: has no values; below the header"),
        (
            &good.replace("0.1", "0,1"),
            "a.csv:2: 6 cells, with `1` in the last, but 5 columns; numbers take a decimal point, or",
        ),
        (&good.replace("\n0,0", "\n100,0"), "a.csv: no light on the front: every theta_i is"),
        (&format!("{good}0,0,0,0,0.2\n"), "a.csv:3: a second row for 0, 0, 0, 0; delete one"),
        (
            &format!("{good}0,0,10,90,0.2\n"),
            "a.csv: 2 rows for 1 theta_i, 1 phi_i, 2 theta_o and 2 phi_o: none for 0, 0, 0, 90; a table has",
        ),
        (
            &format!("{good}0,0,0,60,0.2\n0,0,0,120,0.2\n0,0,0,190,0.2\n"),
            "a.csv: phi_o goes from 0 to 190 degrees only; give the whole circle",
        ),
        (
            &format!("{good}0,0,0.0001,0,0.2\n"),
            "a.csv: two angles are less than 0.0006 degrees apart; round them",
        ),
    ] {
        let error = read(text, "a.csv", &["red"]).unwrap_err().to_string();
        assert!(error.starts_with(start), "{error}\n{start}");
    }
    let good = xml("Transmission Front");
    for (text, start) in [
        ("theta_i,phi_i\n".into(), "a.xml: has no element of XML"),
        (good.replace("</Layer>", ""), "a.xml:7: is no XML: "),
        (good.replace("Columns", "TensorTree4"), "a.xml: its data are in `TensorTree4`, not in"),
        (
            good.replace("0.09", ""),
            "a.xml: Transmission Front: 8 values for 3 x 3 patches; the file",
        ),
        (good.replace("0.09", "-1"), "a.xml: Transmission Front: `-1` is no finite number of at"),
        (good.replace("Front", "Side"), "a.xml: no matrix of light in it; it needs"),
        (
            good.replace(
                "<ScatteringData>",
                "<ScatteringDataType>dB</ScatteringDataType><ScatteringData>",
            ),
            "a.xml: Transmission Front: its values are `dB`, not BTDF or BRDF",
        ),
        (
            good.replace("<RowAngleBasis>mine", "<RowAngleBasis>ours"),
            "a.xml: Transmission Front: no angle basis `ours & yours`",
        ),
        (
            good.replace(">90<", ">80<"),
            "a.xml: Transmission Front: the angle basis `mine & yours` does not end",
        ),
        (
            good.replace("<nPhis>2", "<nPhis>0"),
            "a.xml: Transmission Front: the angle basis `mine & yours` is no",
        ),
        ("<a>".repeat(100), "a.xml:1: is no XML: more than 64 elements"),
    ] {
        let error = read(&text, "a.xml", &["red"]).unwrap_err().to_string();
        assert!(error.starts_with(start), "{error}\n{start}");
    }
}

const TABLES: &[&str] = &[
    "theta_i,phi_i,theta_o,phi_o,red,blue\n0,0,0,0,0.1,0.2\n0,0,60,0,0.1,0.1\n60,0,0,0,0.1,0.2\n60,0,60,0,0.3,0.2\n",
    "theta_i,phi_i,theta_o,phi_o,red,blue\n10,0,20,0,0.1,0.2\n10,0,20,180,0.1,0.1\n10,0,120,0,0.1,0\n10,0,120,180,0.3,0\n",
    "theta_i,phi_i,theta_o,phi_o,blue,red\n5,0,5,360,.1,0\n5,120,5,360,.1,0\n5,240,5,360,.1,0\n",
];
const MATRICES: &[&str] = &[
    "<?xml version=\"1.0\"?>\n<WindowElement>\n<IncidentDataStructure>Columns</IncidentDataStructure>\n<AngleBasis>\n\
     <AngleBasisName>two</AngleBasisName>\n<AngleBasisBlock>\n<nPhis>1</nPhis>\n<UpperTheta>30</UpperTheta>\n\
     </AngleBasisBlock>\n<AngleBasisBlock>\n<nPhis>1</nPhis>\n<UpperTheta>90</UpperTheta>\n</AngleBasisBlock>\n</AngleBasis>\n\
     <WavelengthData>\n<Wavelength unit=\"Integral\">Visible</Wavelength>\n<WavelengthDataBlock>\n\
     <WavelengthDataDirection>Transmission Front</WavelengthDataDirection>\n<ColumnAngleBasis>two</ColumnAngleBasis>\n\
     <RowAngleBasis>two</RowAngleBasis>\n<ScatteringData>\n0.1, 0.2,\n0.3, 0.1\n</ScatteringData>\n</WavelengthDataBlock>\n\
     </WavelengthData>\n</WindowElement>\n",
];
const WORDS: &[&str] = &[
    "theta_i",
    "phi_o",
    "red",
    "360",
    "180",
    "90",
    "90.0001",
    "<a>",
    "</a>",
    "<!--",
    "-->",
    "&amp;",
    "&x;",
    "<![CDATA[",
    "]]>",
    "<nPhis>",
    "</nPhis>",
    "Reflection Front",
    "Transmission Back",
    "LBNL/Klems Full",
    "<AngleBasis/>",
];

fn check(bytes: &[u8], name: &str) {
    let path = Path::new(name);
    match parse(
        bytes,
        path,
        Wanted { bands: &["red", "blue"], limits: &[], named: true, front: Side::Inside },
    ) {
        Err(error) => check_error(&error, path),
        Ok(mut table) => {
            let error = table.faces.reciprocity().error;
            assert!(error.is_finite(), "{error}");
            table.faces.make_reciprocal();
            match Bsdf::new(&table.faces, &["red", "blue"]) {
                Err(problem) => check_error(&problem.at(path.display()), path),
                Ok(material) => {
                    let at = Interaction::new(Vec3::new(0.6, 0.0, -0.8), Vec3::Z);
                    let f = material.evaluate::<[f32; 4]>(&at, Vec3::new(0.0, 0.6, 0.8));
                    assert!(f.0.iter().all(|f| f.is_finite() && *f >= 0.0), "{f:?}");
                }
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_spoiled_grid_panics(bytes in spoiled(TABLES, WORDS)) {
        check(&bytes, "a.csv");
    }

    #[test]
    fn no_spoiled_matrix_panics(bytes in spoiled(MATRICES, WORDS)) {
        check(&bytes, "a.xml");
    }
}
