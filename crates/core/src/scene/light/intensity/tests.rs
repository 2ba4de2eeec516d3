//! Tests of tables and lobes against closed forms. Every chi-square has 4e5 directions, seed 1 and
//! odds of a false alarm of 1e-6.

use std::f64::consts::PI;

use super::*;
use crate::math::odds::{SphereBins, assert_counts};

const SAMPLES: u64 = 400_000;

/// Makes the table of a function of C and V, degrees.
fn table(c: &[f64], v: &[f64], f: impl Fn(f64, f64) -> f64) -> IntensityTable {
    let values = c.iter().flat_map(|&c| v.iter().map(move |&v| (c, v))).map(|(c, v)| f(c, v));
    IntensityTable::new(c, v, values.collect()).unwrap_or_else(|e| panic!("{e:?}"))
}

fn steps(to: f64, n: usize) -> Vec<f64> {
    (0..=n).map(|i| to * i as f64 / n as f64).collect()
}

/// An isotropic table has a flux of 4 pi. A hat about the axis, 1 - V / a, has 2 pi (1 - sin a /
/// a). A wedge that rises with C has half the flux that it would have without the rise. Nothing is
/// lost to rounding with angles down to 1e-6 degrees.
#[test]
fn fluxes_are_exact() {
    let isotropic = table(&[0.0, 360.0], &[0.0, 180.0], |_, _| 1.0);
    assert!((isotropic.flux() - 4.0 * PI).abs() < 1e-12);
    for degrees in [90.0, 10.0, 1e-3, 1e-6] {
        let a = f64::to_radians(degrees);
        let hat = table(&[0.0, 90.0, 360.0], &[0.0, degrees], |_, v| 1.0 - v / degrees);
        let series = a * a / 6.0 * (1.0 - a * a / 20.0);
        let exact = 2.0 * PI * if a < 0.02 { series } else { 1.0 - a.sin() / a };
        assert!((hat.flux() / exact - 1.0).abs() < 1e-9, "{degrees}: {} {exact}", hat.flux());
        let wedge = table(&[0.0, 360.0], &[0.0, degrees], |c, v| c / 360.0 * (1.0 - v / degrees));
        assert!((wedge.flux() / exact - 0.5).abs() < 1e-9, "{degrees}");
    }
    let fine = table(&steps(360.0, 8), &steps(180.0, 1800), |_, v| 1.0 + v.to_radians().cos());
    assert!((fine.flux() / (4.0 * PI) - 1.0).abs() < 1e-6);
}

/// Uses 240 bins around three axes, for an uneven table, a narrow beam, a table that shines only
/// above the horizon, and lobes. Directions have the intensity as their density, which integrates
/// to 1.
#[test]
fn directions_have_the_intensity_as_density() {
    let uneven = table(&[0.0, 45.0, 200.0, 360.0], &[0.0, 30.0, 90.0, 150.0], |c, v| {
        1.0 + (c.to_radians().cos() * v.to_radians().sin()) + 0.01 * v
    });
    let narrow = table(&[0.0, 360.0], &[0.0, 0.5, 1.0], |_, v| 1.0 - v);
    let above = table(&steps(360.0, 6), &[90.0, 135.0, 180.0], |c, v| (c / 60.0) % 2.0 * v);
    let aim = DVec3::new(0.48, -0.6, 0.64);
    let of = |t: IntensityTable| Intensity::table(Arc::new(t), aim, DVec3::Y);
    let narrow_bins = SphereBins::lobe(aim.as_vec3(), 1.5e4);
    let even = || SphereBins::even(aim.as_vec3());
    for (what, intensity, bins) in [
        ("uneven", of(uneven), even()),
        ("narrow", of(narrow), narrow_bins),
        ("above", of(above), even()),
        ("cosine 0", Intensity::cosine(0.0, aim), even()),
        ("cosine 2.5", Intensity::cosine(2.5, aim), even()),
    ] {
        let intensity = intensity.unwrap_or_else(|e| panic!("{e:?}"));
        let mut rng = Stream::new(1, 0, 0);
        let mut counts = vec![0; bins.len()];
        for _ in 0..SAMPLES {
            let direction = intensity.sample(&mut rng);
            assert!((direction.length() - 1.0).abs() < 1e-6, "{what}: {direction}");
            counts[bins.index(direction)] += 1;
        }
        let chances = bins.integrals(|d| [f64::from(intensity.towards(d))]);
        let total: f64 = chances.iter().map(|[p]| p).sum();
        assert!((total - 1.0).abs() < 3e-3, "{what}: the density integrates to {total}");
        let expected: Vec<f64> = chances.iter().map(|[p]| p / total * SAMPLES as f64).collect();
        assert_counts(what, &counts, &expected);
    }
}

/// When a lamp aims down, C = 0 is +x and C = 90 is +y; when it aims up, C = 90 is -y. A zero plane
/// that is not perpendicular to the aim is made so.
#[test]
fn planes_lie_where_they_should() {
    let rising = |aim: DVec3, zero: DVec3| {
        let t = table(&[0.0, 90.0, 180.0, 270.0, 360.0], &[0.0, 90.0, 180.0], |c, v| {
            if v == 90.0 && c < 360.0 { 1.0 + c / 90.0 } else { 1.0 }
        });
        let unit = t.values[0];
        let intensity = Intensity::table(Arc::new(t), aim, zero).unwrap();
        move |x: f32, y: f32, z: f32| f64::from(intensity.towards(Vec3::new(x, y, z))) / unit
    };
    let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-5, "{a} {b}");
    let down = rising(DVec3::NEG_Z, DVec3::new(2.0, 0.0, 1.0));
    [(1.0, 0.0, 1.0), (0.0, 1.0, 2.0), (-1.0, 0.0, 3.0), (0.0, -1.0, 4.0)]
        .into_iter()
        .for_each(|(x, y, value)| close(down(x, y, 0.0), value));
    // half way in both angles
    let half = 0.5f32.sqrt();
    close(down(0.5, 0.5, -half), 0.5 * 1.0 + 0.5 * 1.5);
    let up = rising(DVec3::Z, DVec3::X);
    close(up(0.0, -1.0, 0.0), 2.0);
}

#[test]
fn refuses_what_is_no_table() {
    let new = |c: &[f64], v: &[f64], n: usize| IntensityTable::new(c, v, vec![1.0; n]).is_err();
    assert!(new(&[0.0], &[0.0, 90.0], 2) && new(&[0.0, 350.0], &[0.0, 90.0], 4));
    assert!(new(&[0.0, 360.0], &[90.0, 0.0], 4) && new(&[0.0, 360.0], &[0.0, 181.0], 4));
    assert!(new(&[0.0, 360.0], &[0.0, 90.0], 3) && new(&[0.0, 360.0], &[0.0, f64::NAN], 4));
    assert!(IntensityTable::new(&[0.0, 360.0], &[0.0, 90.0], vec![0.0; 4]).is_err());
    assert!(IntensityTable::new(&[0.0, 360.0], &[0.0, 90.0], vec![-1.0, 1.0, 1.0, 1.0]).is_err());
    let t = Arc::new(table(&[0.0, 360.0], &[0.0, 90.0], |_, _| 1.0));
    assert!(Intensity::table(t.clone(), DVec3::Z, DVec3::NEG_Z).is_err());
    assert!(Intensity::table(t, DVec3::ZERO, DVec3::X).is_err());
    assert!(Intensity::cosine(-1.0, DVec3::Z).is_err());
}
