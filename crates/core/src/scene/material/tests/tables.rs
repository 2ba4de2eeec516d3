//! Tests of measured sheets: covers and tables of scattering functions.

use super::*;
use crate::scene::material::table::*;

fn row(angle_deg: f64, direct: [f32; 4], diffuse: [f32; 4], reflectance: [f32; 4]) -> CoverRow {
    let [direct, diffuse, reflectance] = [direct, diffuse, reflectance].map(Vec::from);
    CoverRow { angle_deg, direct, diffuse, reflectance }
}

fn cover_of(rows: Vec<CoverRow>) -> Material {
    Material::Table(Cover::new(rows, &NAMES).unwrap().into())
}

/// Makes a cover whose transmittance falls with the angle.
pub(super) fn cover() -> Material {
    cover_of(vec![
        row(0.0, [0.5, 0.1, 0.0, 0.6], [0.3, 0.6, 0.9, 0.0], [0.1; 4]),
        row(40.0, [0.4, 0.1, 0.0, 0.5], [0.3, 0.5, 0.8, 0.0], [0.15; 4]),
        row(60.0, [0.2, 0.1, 0.0, 0.4], [0.3, 0.4, 0.7, 0.0], [0.2, 0.3, 0.1, 0.0]),
    ])
}

/// Returns the fractions of `cover` at an angle, by linear interpolation: straight, diffuse,
/// mirrored.
fn between(degrees: f64) -> [Bands; 3] {
    let rows = [
        (0.0, [[0.5, 0.1, 0.0, 0.6], [0.3, 0.6, 0.9, 0.0], [0.1; 4]]),
        (40.0, [[0.4, 0.1, 0.0, 0.5], [0.3, 0.5, 0.8, 0.0], [0.15; 4]]),
        (60.0, [[0.2, 0.1, 0.0, 0.4], [0.3, 0.4, 0.7, 0.0], [0.2, 0.3, 0.1, 0.0]]),
    ];
    if degrees >= 60.0 {
        let pane = |degrees: f64| exact_pane(degrees.to_radians().cos() as f32, 1.52, 1.0)[1];
        let fall = pane(degrees) / pane(60.0);
        let [straight, diffuse, mirrored] = rows[2].1;
        return [straight.map(|t| t * fall), diffuse.map(|t| t * fall), mirrored];
    }
    let next = rows.iter().position(|(angle, _)| *angle > degrees).unwrap();
    let ((a, before), (b, after)) = (rows[next - 1], rows[next]);
    let along = (degrees - a) / (b - a);
    std::array::from_fn(|part| {
        std::array::from_fn(|band| {
            before[part][band] + along * (after[part][band] - before[part][band])
        })
    })
}

/// The straight, scattered, mirrored and absorbed fractions of a cover, at angles in and beyond its
/// table and on both faces, are those of the table to 3e-5. The scattered fraction is found by
/// quadrature.
#[test]
fn a_cover_shows_its_table() {
    let cover = cover();
    for degrees in [0.0, 13.0, 40.0, 55.0, 60.0, 75.0, 89.0] {
        for front in [true, false] {
            let at = at_degrees(front, degrees);
            let [straight, diffuse, mirrored] = between(degrees);
            let found = cover.straight::<Lanes4>(at.direction, NORMAL).expect("light passes");
            assert_near("straight", wide(found), straight, 3e-5);
            assert_near("diffuse", quadrature(&cover, &at), diffuse, 3e-5);
            let all: Bands = std::array::from_fn(|b| 1.0 - straight[b] - diffuse[b] - mirrored[b]);
            assert_near("absorbed", wide(cover.absorptance(&at).unwrap()), all, 3e-5);
            let [up, down] = cover.smooth_ways::<Lanes4>(&at, Transport::Light);
            assert_near("mirrored", wide(up.expect("a mirror").weight), mirrored, 3e-5);
            assert_near("through", wide(down.expect("straight on").weight), straight, 3e-5);
        }
    }
    let grazing = cover.absorptance::<Lanes4>(&at_degrees(true, 90.0)).unwrap();
    assert_near("at 90 degrees", wide(grazing), [0.8, 0.7, 0.9, 1.0], 1e-4);
}

/// Uses 240 bins, on both faces, for both directions of transport. The cover lets no light straight
/// through, because such light would belong to no bin.
#[test]
fn a_cover_samples_its_density() {
    let scattering = cover_of(vec![
        row(0.0, [0.0; 4], [0.3, 0.6, 0.9, 0.0], [0.1; 4]),
        row(50.0, [0.0; 4], [0.3, 0.5, 0.6, 0.0], [0.2, 0.3, 0.1, 0.0]),
        row(80.0, [0.0; 4], [0.2, 0.1, 0.1, 0.0], [0.6, 0.3, 0.1, 0.0]),
    ]);
    for (degrees, front) in [(0.0, true), (50.0, false), (80.0, true)] {
        for transport in TRANSPORTS {
            let at = at_degrees(front, degrees);
            let [up, _] = scattering.smooth_ways::<Lanes4>(&at, transport);
            let fraction = wide(up.expect("a mirror").weight);
            let largest = fraction.into_iter().fold(0.0, f64::max);
            let down = at.direction.reflect(NORMAL.normalize());
            let chance = 1.0 - quadrature_of_pdf(&scattering, &at, transport);
            assert!(down.dot(at.mirrored()) > 0.999, "{largest}");
            let lobe = MirrorLobe { fraction, chance };
            let bins = SphereBins::even(NORMAL);
            assert_sampler("cover", (&scattering, &at, transport), &bins, lobe, 3.0);
        }
    }
}

/// Returns the chance that a path goes on in a random direction.
fn quadrature_of_pdf(material: &Material, at: &Interaction, transport: Transport) -> f64 {
    let bins = SphereBins::even(NORMAL);
    let chances = bins.integrals(|o| [f64::from(material.pdf(at, transport, o))]);
    chances.iter().map(|[p]| p).sum()
}

/// Converts degrees to rad.
fn radians(degrees: &[f32]) -> Vec<f32> {
    degrees.iter().map(|x| x.to_radians()).collect()
}

/// Makes the values for light from the angles and azimuths `from` to those of `to`, degrees, on one
/// side each, where `f` takes theta and phi of both directions, rad, and the band. With a single
/// azimuth in `from`, only the difference of the azimuths counts.
fn pairs(
    from: [&[f32]; 2],
    to: [&[f32]; 2],
    mut f: impl FnMut([f64; 4], usize) -> f64,
) -> PairValues {
    let isotropic = from[1].len() == 1;
    let mut values = Vec::new();
    for &theta_i in from[0] {
        for &phi_i in from[1] {
            for &theta_o in to[0] {
                for &phi_o in to[1] {
                    let angles =
                        [theta_i, phi_i, theta_o, phi_o].map(|x| f64::from(x).to_radians());
                    values.extend((0..BANDS).map(|band| f(angles, band) as f32));
                }
            }
        }
    }
    let rows = Basis::linear(&radians(from[0]), &radians(from[1]));
    let columns = Basis::cells(&radians(to[0]), if isotropic { &[0.0] } else { to[1] });
    let columns = match isotropic {
        true => columns,
        false => Basis::cells(&radians(to[0]), &radians(to[1])),
    };
    PairValues { rows, columns, turns: isotropic.then(|| radians(to[1])), values }
}

fn bsdf(faces: &BsdfFaces) -> Material {
    let material = Material::Table(Bsdf::new(faces, &NAMES).unwrap().into());
    material.placed(BANDS, vec![(0, NORMAL.any_orthonormal_vector())])
}

fn steps(from: usize, to: usize, step: usize) -> Vec<f32> {
    (from..=to).step_by(step).map(|x| x as f32).collect()
}

/// The table of a Lambertian sheet behaves like that sheet, whatever the angles of the table.
#[test]
fn a_lambert_table_is_lambert() {
    let (r, t) = ([0.3, 0.1, 0.0, 0.2f32], [0.5, 0.2, 0.1, 0.0f32]);
    let exact = phong(r, [0.0; 4], t, None);
    let half = steps(0, 85, 17);
    let around = steps(0, 330, 30);
    for azimuths in [vec![0.0], around.clone()] {
        let part = |f: [f32; 4]| {
            pairs([&half, &azimuths], [&half, &around], move |_, band| f64::from(f[band]) / PI)
        };
        let face = || FaceValues { reflected: part(r), transmitted: part(t) };
        for back in [None, Some(face())] {
            let table = bsdf(&BsdfFaces { front: face(), back, bands: BANDS });
            for degrees in [0.0, 33.0, 70.0, 89.0] {
                for front in [true, false] {
                    let at = at_degrees(front, degrees);
                    let absorbed = [&table, &exact].map(|m| wide(m.absorptance(&at).unwrap()));
                    assert_near("absorbed", absorbed[0], absorbed[1], 1e-6);
                    for (cos, turn) in [(0.9, 0.3), (0.2, 4.0), (-0.5, 2.0), (-0.01, 1.0)] {
                        let outgoing = -incident(true, f64::abs(cos), turn).direction;
                        let outgoing = if cos > 0.0 { outgoing } else { -outgoing };
                        let f = [&table, &exact].map(|m| wide(m.evaluate(&at, outgoing)));
                        assert_near("f", f[0], f[1], 1e-6);
                        for transport in TRANSPORTS {
                            let density = [&table, &exact].map(|m| m.pdf(&at, transport, outgoing));
                            assert!((density[0] - density[1]).abs() < 1e-5, "{density:?}");
                        }
                    }
                }
            }
        }
    }
}

/// The table of a Phong lobe in steps of 3 degrees agrees with the lobe to 2 % of its peak at the
/// table's angles of incidence, and with its albedo to 1 %.
#[test]
fn a_phong_table_is_phong() {
    let exact = glossy(Some(10.0));
    let (half, around) = (steps(0, 90, 3), steps(0, 357, 3));
    let normal = NORMAL.normalize();
    let (x, y) = normal.any_orthonormal_pair();
    let direction = |theta: f64, phi: f64, side: f32| {
        let (sin, cos) = (theta.sin() as f32, theta.cos().max(1e-6) as f32);
        side * cos * normal + sin * (phi.cos() as f32 * x + phi.sin() as f32 * y)
    };
    let (lobe, direction) = (&exact, &direction);
    let part = |side: f32| {
        pairs([&half, &[0.0]], [&half, &around], move |[theta_i, phi_i, theta_o, phi_o], band| {
            let at = Interaction::new(-direction(theta_i, phi_i, 1.0), NORMAL);
            wide(lobe.evaluate(&at, direction(theta_o, phi_o, side)))[band]
        })
    };
    let front = FaceValues { reflected: part(1.0), transmitted: part(-1.0) };
    let table = bsdf(&BsdfFaces { front, back: None, bands: BANDS });
    for degrees in [0.0, 30.0, 60.0] {
        let at = at_degrees(true, degrees);
        let found = wide(table.absorptance(&at).unwrap()).map(|a| 1.0 - a);
        assert_near("albedo", found, quadrature(&exact, &at), 0.01);
        for (theta, phi) in [(30.0f64, 0.0f64), (30.0, 180.0), (60.0, 183.0), (12.0, 90.0)] {
            let turn = 0.7 + phi.to_radians();
            let outgoing = -incident(true, theta.to_radians().cos(), turn).direction;
            let f = [&table, &exact].map(|m| wide(m.evaluate(&at, outgoing)));
            assert_near("f", f[0], f[1], 0.02);
        }
    }
}

/// Returns a function that depends on all angles, with its peaks in other places in each band. It
/// is smooth, so that steps between cells are small compared with the bins of a test.
fn smooth(phase: f64) -> impl FnMut([f64; 4], usize) -> f64 {
    move |[theta_i, phi_i, theta_o, phi_o], band| {
        let around = 1.0 + 0.6 * (2.0 * phi_o - phi_i + band as f64 + phase).sin();
        let along = 1.0 + 0.5 * (3.0 * theta_o - 2.0 * theta_i + phase).cos();
        0.1 * around * along * [1.0, 0.8, 0.5, 0.0][band]
    }
}

/// Makes a table of smooth values, which depend on the difference of the azimuths or on both, with
/// values for the back or without.
fn smooth_table(isotropic: bool, has_back: bool) -> BsdfFaces {
    let (coming, leaving) = (steps(0, 75, 25), steps(0, 90, 6));
    let azimuths = if isotropic { vec![0.0] } else { vec![10.0, 100.0, 200.0, 290.0] };
    let around = steps(0, 340, 20);
    let face = |phase: f64| FaceValues {
        reflected: pairs([&coming, &azimuths], [&leaving, &around], smooth(phase)),
        transmitted: pairs([&coming, &azimuths], [&leaving, &around], smooth(phase + 1.0)),
    };
    BsdfFaces { front: face(0.0), back: has_back.then(|| face(3.0)), bands: BANDS }
}

/// Returns random values that follow no rule and differ between bands.
fn wild(rng: &mut Stream, scale: f64) -> impl FnMut([f64; 4], usize) -> f64 {
    let mut rng = Stream::new(u64::from(rng.uniform().to_bits()), 0, 0);
    move |_, band| {
        let u = f64::from(rng.uniform());
        scale * u.powi(4) * [1.0, 0.5, 0.2, 0.0][band] * if rng.uniform() < 0.2 { 0.0 } else { 1.0 }
    }
}

/// Makes a table of such random values, which depend on the difference of the azimuths or on both,
/// with values for the back or without.
fn wild_table(isotropic: bool, has_back: bool) -> BsdfFaces {
    let mut rng = Stream::new(11, 0, 0);
    let (coming, leaving) = (steps(0, 75, 25), steps(10, 70, 15));
    let azimuths = if isotropic { vec![0.0] } else { vec![10.0, 100.0, 200.0, 290.0] };
    let around = [0.0, 40.0, 130.0, 250.0];
    let mut face = || FaceValues {
        reflected: pairs([&coming, &azimuths], [&leaving, &around], wild(&mut rng, 0.4)),
        transmitted: pairs([&coming, &azimuths], [&leaving, &around], wild(&mut rng, 0.4)),
    };
    let front = face();
    BsdfFaces { front, back: has_back.then(face), bands: BANDS }
}

/// Uses 240 bins, on both faces, for both directions of transport, and tables of each kind.
#[test]
fn tables_sample_their_density() {
    for (isotropic, has_back) in [(true, false), (true, true), (false, false), (false, true)] {
        let table = bsdf(&smooth_table(isotropic, has_back));
        for (degrees, front) in [(35.0, true), (80.0, false)] {
            for transport in TRANSPORTS {
                let at = at_degrees(front, degrees);
                let bins = SphereBins::even(NORMAL);
                let what = format!("table {isotropic} {has_back}");
                assert_sampler(&what, (&table, &at, transport), &bins, NO_MIRROR, 2.0);
            }
        }
    }
}

/// Uses 240 bins as well, for Klems' patches, each with a value of its own.
#[test]
fn patches_sample_their_density() {
    let rings =
        [(5.0f32, 1), (25.0, 8), (55.0, 12), (90.0, 6)].map(|(end, n)| (end.to_radians(), n));
    let mut rng = Stream::new(12, 0, 0);
    let mut part = |scale: f32| {
        let (rows, columns) = (Basis::patches(&rings, 0.0), Basis::patches(&rings, 0.5));
        let values = (0..rows.len() * columns.len() * BANDS)
            .map(|i| scale * (0.7 + 0.3 * rng.uniform()) * [1.0, 0.6, 0.3, 0.0][i % BANDS]);
        PairValues { values: values.collect(), rows, columns, turns: None }
    };
    let front = FaceValues { reflected: part(0.1), transmitted: part(0.2) };
    let table = bsdf(&BsdfFaces { front, back: None, bands: BANDS });
    for (degrees, front) in [(0.0, true), (40.0, false)] {
        for transport in TRANSPORTS {
            let at = at_degrees(front, degrees);
            let bins = SphereBins::even(NORMAL);
            assert_sampler("patches", (&table, &at, transport), &bins, NO_MIRROR, 2.0);
        }
    }
}

/// The light that goes on, found by quadrature, is what the table does not absorb, from both faces,
/// to 1 %, because cells have steps.
#[test]
fn tables_absorb_the_rest() {
    for (isotropic, has_back) in [(true, false), (false, true), (false, false)] {
        let table = bsdf(&wild_table(isotropic, has_back));
        for (degrees, front) in [(35.0, true), (62.0, false), (89.0, true)] {
            let at = at_degrees(front, degrees);
            let found = quadrature(&table, &at);
            let absorbed = wide(table.absorptance(&at).unwrap());
            let rest = absorbed.map(|a| 1.0 - a);
            assert_near("rest", found, rest, 0.01 * rest[0].max(0.1));
        }
    }
}

/// In a table without values for the back, light from behind goes the opposite way of light from
/// the front.
#[test]
fn what_comes_from_behind_goes_the_opposite_way() {
    let table = bsdf(&wild_table(false, false));
    let mut rng = Stream::new(13, 0, 0);
    for _ in 0..1000 {
        let [i, o] = [0; 2].map(|_| uniform_cone(2.0, rng.square()));
        if i.dot(NORMAL) > 0.0 || o.dot(NORMAL) < 0.0 {
            continue;
        }
        let there = wide(table.evaluate(&Interaction::new(-i, NORMAL), o));
        let back = wide(table.evaluate(&Interaction::new(-o, NORMAL), i));
        assert_near("f", there, back, 1e-6);
    }
}

/// Where the angles of incidence and exit are the same, a table that was made reciprocal has no
/// error of reciprocity left, while a table of random values has a large one.
#[test]
fn tables_can_be_made_reciprocal() {
    let half = steps(0, 80, 20);
    let around = steps(0, 300, 60);
    for azimuths in [vec![0.0], around.clone()] {
        let mut rng = Stream::new(14, 0, 0);
        let mut face = || FaceValues {
            reflected: pairs([&half, &azimuths], [&half, &around], wild(&mut rng, 0.4)),
            transmitted: pairs([&half, &azimuths], [&half, &around], wild(&mut rng, 0.4)),
        };
        let front = face();
        let mut faces = BsdfFaces { front, back: Some(face()), bands: BANDS };
        assert!(faces.reciprocity().error > 0.3);
        faces.make_reciprocal();
        let error = faces.reciprocity().error;
        assert!(error < 1e-5, "{error}");
    }
    let lambert = |_: [f64; 4], _: usize| 0.4 / PI;
    let part = || pairs([&half, &[0.0]], [&half, &around], lambert);
    let front = FaceValues { reflected: part(), transmitted: part() };
    assert!(BsdfFaces { front, back: None, bands: BANDS }.reciprocity().error < 1e-6);
}

/// The error of reciprocity is a mean over the circle: each azimuth counts by the width of its
/// sector. Here f is 1.2 at +60 and 0.8 at -60 degrees, whose sectors are 45 degrees wide each, and
/// 1 elsewhere. The mean difference is 0.4 x 90 / 360.
#[test]
fn narrow_sectors_count_little() {
    let around = [-90.0, -60.0, 0.0, 60.0, 90.0];
    let part = || {
        pairs([&[40.0], &[0.0]], [&[40.0], &around], |[_, _, _, phi], _| match phi.to_degrees() {
            50.0..70.0 => 0.12,
            -70.0..-50.0 => 0.08,
            _ => 0.1,
        })
    };
    let front = FaceValues { reflected: part(), transmitted: part() };
    let error = BsdfFaces { front, back: None, bands: BANDS }.reciprocity().error;
    assert!((error - 0.1).abs() < 1e-6, "{error}");
}

/// A table that sends on more light than it receives is refused; the message names the face and the
/// angle.
#[test]
fn tables_conserve_energy() {
    let half = steps(0, 80, 20);
    let part = |f: f64| {
        pairs([&half, &[0.0]], [&half, &[0.0, 180.0]], move |[theta_i, ..], _| {
            if theta_i > 1.0 { f / PI } else { 0.4 / PI }
        })
    };
    let front = |f| FaceValues { reflected: part(f), transmitted: part(0.4) };
    let check = |faces: &BsdfFaces| Bsdf::new(faces, &NAMES);
    let problem = check(&BsdfFaces { front: front(0.7), back: None, bands: BANDS }).unwrap_err();
    let sentence = problem.at("table").to_string();
    assert!(sentence.contains(" degrees 1.1000 goes on in band `"), "{sentence}");
    // an excess as small as rounding is scaled away
    let material = bsdf(&BsdfFaces { front: front(0.6004), back: None, bands: BANDS });
    let absorbed = wide(material.absorptance(&at_degrees(true, 60.0)).unwrap());
    assert_near("absorbed", absorbed, [0.0; BANDS], 1e-5);
    let mut wrong = BsdfFaces { front: front(0.1), back: None, bands: BANDS };
    wrong.front.reflected.values[3] = -1.0;
    assert!(check(&wrong).is_err());
    wrong.front.reflected.values.pop();
    assert!(check(&wrong).is_err());
}

#[test]
fn tables_are_sound() {
    assert_sound("cover", &cover());
    for (isotropic, has_back) in [(true, false), (false, true)] {
        assert_sound("table", &bsdf(&wild_table(isotropic, has_back)));
    }
}
