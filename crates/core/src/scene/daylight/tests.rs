//! Tests of skies, suns and maps against closed forms, and of every sampler against its density.
//!
//! Chi-squares have seed 1, 2e5 samples and odds of a false alarm of 1e-6.

use std::{f64::consts::PI, sync::Arc};

use glam::{DVec3, Vec3};

use super::*;
use crate::math::{
    odds::{Mean, SphereBins, assert_counts},
    rng::Stream,
    units::Quantity,
};

const SAMPLES: u64 = 200_000;

fn position(elevation: f64, azimuth: f64) -> SunPosition {
    SunPosition { elevation: elevation.to_radians(), azimuth: azimuth.to_radians() }
}

/// Returns an hour that is the whole of a period.
fn hour(direct_normal: f64, diffuse_horizontal: f64, sun: SunPosition) -> Hour {
    let june = Date { year: 2025, month: 6, day: 21 };
    let eccentricity = eccentricity(june);
    let course = SunCourse::still(sun);
    Hour { weight: 1.0, sun, course, eccentricity, direct_normal, diffuse_horizontal }
}

/// Returns a sky with the diffuse irradiance of the hour in its only band.
fn sky(model: SkyModel, hour: Hour) -> InfiniteLight {
    let (map, mean) = mean_sky(model, &[hour], 0.0).unwrap();
    light([(InfiniteShape::Map(Arc::new(map)), vec![mean])])
}

fn light(parts: impl IntoIterator<Item = (InfiniteShape, Vec<f64>)>) -> InfiniteLight {
    let parts = parts.into_iter().map(|(shape, scale)| InfinitePart::new(shape, scale));
    let parts: Vec<InfinitePart> = parts.collect();
    InfiniteLight::new("light".into(), parts[0].scale().len(), parts)
}

fn sun(half_angle_deg: f64, toward: DVec3) -> InfiniteShape {
    let suns = Suns::new(half_angle_deg.to_radians(), [(toward, 1.0)]).unwrap();
    InfiniteShape::Suns(Arc::new(suns))
}

/// Returns a normal that is tilted from the zenith towards an azimuth.
fn tilted(tilt: f64, azimuth: f64) -> Vec3 {
    position(90.0 - tilt, azimuth).direction(0.0).as_vec3()
}

#[test]
fn tilted_planes_have_their_closed_forms() {
    let hour = hour(0.0, 100.0, position(40.0, 120.0));
    let (uniform, overcast) = (sky(SkyModel::Uniform, hour), sky(SkyModel::Overcast, hour));
    let zenith = 900.0 / (7.0 * PI);
    for tilt in [0.0f64, 10.0, 30.0, 60.0, 90.0, 120.0, 170.0, 180.0] {
        for azimuth in [0.0, 33.3, 90.0, 180.0, 271.0] {
            let (normal, b) = (tilted(tilt, azimuth), tilt.to_radians());
            let found = uniform.irradiance(normal)[0];
            assert!((found - 50.0 * (1.0 + b.cos())).abs() < 2e-4, "uniform {tilt}: {found}");
            let expected =
                zenith * (PI / 6.0 * (1.0 + b.cos()) + 4.0 / 9.0 * (b.sin() + (PI - b) * b.cos()));
            let found = overcast.irradiance(normal)[0];
            assert!((found - expected).abs() < 2e-3, "overcast {tilt}: {found}, not {expected}");
        }
    }
    assert!((overcast.radiance::<[f32; 1]>(Vec3::Z).0[0] / zenith as f32 - 1.0).abs() < 1e-4);
    // the overcast sky of the standard is another function
    let cie = sky(SkyModel::Cie(1), hour);
    let vertical = cie.irradiance(Vec3::X)[0] / 100.0;
    assert!((vertical - 0.379).abs() < 5e-4, "{vertical}");
    let zenith = f64::from(cie.radiance::<[f32; 1]>(Vec3::Z).0[0]);
    assert!((100.0 / zenith - 2.4496).abs() < 5e-4, "{zenith}");
}

/// A direct normal irradiance of 850 and a diffuse horizontal irradiance of 100 on 21 June, with
/// the sun in the south at an elevation of 69.83 degrees.
#[test]
fn a_clear_june_noon_has_its_irradiances() {
    let noon = hour(850.0, 100.0, position(69.83, 180.0));
    let perez = sky(SkyModel::Perez, noon);
    // many cells meet at the zenith: take their mean
    let around = (0..36).map(|i| position(89.5, 10.0 * f64::from(i)).direction(0.0).as_vec3());
    let zenith = around.map(|d| f64::from(perez.radiance::<[f32; 1]>(d).0[0])).sum::<f64>() / 36.0;
    for (what, found, expected, digit) in [
        ("zenith", zenith, 43.86, 0.1),
        ("south", perez.irradiance(Vec3::NEG_Y)[0], 63.27, 0.02),
        ("north", perez.irradiance(Vec3::Y)[0], 37.59, 0.02),
        ("horizontal", perez.irradiance(Vec3::Z)[0], 100.0, 1e-4),
        ("all", mean_direct(&[noon]) + 100.0, 897.9, 0.05),
    ] {
        assert!((found - expected).abs() < digit, "{what}: {found}, not {expected}");
    }
    let share = |source| band_share(source, Quantity::Micromole, 400.0, 700.0).unwrap();
    let ppfd =
        mean_direct(&[noon]) * share(DaylightSource::Sun) + 100.0 * share(DaylightSource::Sky);
    assert!((ppfd - 1773.0).abs() < 1.0, "{ppfd}");
}

/// Irradiances on planes from the cells agree with those of the formula in cells a sixteenth as
/// large.
#[test]
fn cells_are_as_good_as_the_formula() {
    let weathers =
        [(850.0, 100.0, 69.83), (600.0, 80.0, 20.0), (100.0, 200.0, 45.0), (0.0, 60.0, 10.0)];
    for (direct, diffuse, elevation) in weathers {
        let hour = hour(direct, diffuse, position(elevation, 137.3));
        let model = RelativeSky::perez(direct, diffuse, hour.sun.zenith(), hour.eccentricity);
        let toward_sun = hour.sun.direction(0.0);
        let normals =
            [tilted(0.0, 0.0), tilted(90.0, 137.3), tilted(90.0, 0.0), tilted(45.0, 200.0)];
        let mut fine = [0.0; 4];
        for row in 0..360 {
            let z = (f64::from(row) + 0.5) * 0.25f64.to_radians();
            for column in 0..1440 {
                let a = (f64::from(column) + 0.5) * 0.25f64.to_radians();
                let w = DVec3::new(z.sin() * a.sin(), z.sin() * a.cos(), z.cos());
                let l = model.radiance(w.z, w.dot(toward_sun)) * z.sin();
                for (sum, normal) in fine.iter_mut().zip(normals) {
                    *sum += l * w.dot(normal.as_dvec3()).max(0.0);
                }
            }
        }
        let cells = sky(SkyModel::Perez, hour);
        for (normal, fine_sum) in normals.into_iter().zip(fine) {
            let (found, expected) = (cells.irradiance(normal)[0], diffuse * fine_sum / fine[0]);
            let off = found / expected - 1.0;
            assert!(off.abs() < 2e-4, "{direct} {diffuse} {elevation} {normal}: {off}");
        }
    }
}

/// A period has the sum of the irradiances of its hours, although its cells are sampled more
/// coarsely.
#[test]
fn a_period_is_the_sum_of_its_hours() {
    let hours: Vec<Hour> = (0..60)
        .map(|i| {
            let i = f64::from(i);
            let sun = position(5.0 + i, 90.0 + 3.0 * i);
            Hour { weight: 1.0 / 100.0, ..hour(10.0 * i, 50.0 + i, sun) }
        })
        .collect();
    let (map, mean) = mean_sky(SkyModel::Perez, &hours, 0.0).unwrap();
    let sum = light([(InfiniteShape::Map(Arc::new(map)), vec![mean])]);
    let (suns, direct) = mean_sun(&hours, 0.00465, 0.0).unwrap();
    let suns = light([(InfiniteShape::Suns(Arc::new(suns)), vec![direct])]);
    for normal in [tilted(0.0, 0.0), tilted(90.0, 100.0), tilted(60.0, 250.0)] {
        let of_sky = |h: &Hour| sky(SkyModel::Perez, *h).irradiance(normal)[0];
        let expected: f64 = hours.iter().map(of_sky).sum();
        let found = sum.irradiance(normal)[0];
        assert!((found / expected - 1.0).abs() < 1e-4, "sky {normal}: {found} {expected}");
        let of_sun = |h: &Hour| {
            0.01 * h.direct_normal * h.sun.direction(0.0).dot(normal.as_dvec3()).max(0.0)
        };
        let expected: f64 = hours.iter().map(of_sun).sum();
        let found = suns.irradiance(normal)[0];
        assert!((found / expected - 1.0).abs() < 1e-4, "sun {normal}: {found} {expected}");
    }
    assert!(mean_sky(SkyModel::Perez, &[], 0.0).is_none());
    assert!(mean_sun(&[hour(0.0, 100.0, position(30.0, 0.0))], 0.0, 0.0).is_none());
}

/// The closed form of a disc at the plane's horizon agrees with a sum over the disc.
#[test]
fn a_sun_cut_by_the_horizon_has_its_irradiance() {
    for half_angle in [0.2666f64, 5.0] {
        let toward = position(30.0, 120.0).direction(0.0);
        let light = light([(sun(half_angle, toward), vec![800.0])]);
        let t = half_angle.to_radians();
        let aside = toward.any_orthonormal_vector();
        for tilt in [-1.5, -0.9, -0.3, 0.0, 0.3, 0.99, 1.5, 100.0] {
            // the middle of the disc is so many radii above the plane
            let above = (tilt * t).min(1.2);
            let normal = (above.sin() * toward + above.cos() * aside).as_vec3();
            let (n, mut sum) = (2000, 0.0);
            let other = toward.cross(aside);
            for i in 0..n {
                let r = t.sin() * ((f64::from(i) + 0.5) / f64::from(n)).sqrt();
                for j in 0..400 {
                    let (s, c) = (f64::from(j) * PI / 200.0).sin_cos();
                    let w = r * (c * aside + s * other) + (1.0 - r * r).sqrt() * toward;
                    // solid angle per area of the projection is 1 / the cosine to the axis
                    sum += w.dot(normal.as_dvec3()).max(0.0) / w.dot(toward);
                }
            }
            let (found, expected) = (light.irradiance(normal)[0], 800.0 * sum / f64::from(n * 400));
            // tolerances relative to the irradiance of a plane that the whole disc shines upon at
            // this angle
            let scale = 800.0 * t;
            assert!(
                (found - expected).abs() < 1e-3 * scale,
                "{half_angle} {tilt}: {found} {expected}"
            );
        }
        // parallel rays and a disc that is wholly above the horizon bring the same irradiance
        let parallel = self::light([(sun(0.0, toward), vec![800.0])]);
        for (tilt, azimuth) in [(0.0, 0.0), (30.0, 180.0), (60.0, 180.0), (90.0, 90.0), (90.0, 0.0)]
        {
            let normal = tilted(tilt, azimuth);
            let [a, b] = [&parallel, &light].map(|light| light.irradiance(normal)[0]);
            assert!((a - b).abs() < 1e-9, "{tilt} {azimuth}");
            let cosine = toward.dot(normal.as_dvec3().normalize()).max(0.0);
            assert!((a - 800.0 * cosine).abs() < 1e-3);
        }
    }
}

/// A map of ones brings an irradiance of pi to every plane, and a map with one bright cell shines
/// from where its heading says.
#[test]
fn maps_shine_from_where_they_should() {
    for (columns, rows) in [(1, 1), (1, 2), (2, 1), (7, 5), (360, 180)] {
        let map = RadianceMap::new(columns, 0.3, vec![1.0; columns * rows]);
        for (tilt, azimuth) in [(0.0, 0.0), (90.0, 0.0), (90.0, 77.0), (180.0, 0.0), (37.0, 200.0)]
        {
            let normal = tilted(tilt, azimuth).as_dvec3().normalize();
            let found = map.irradiance(normal)[0];
            assert!((found / PI - 1.0).abs() < 3e-5, "{columns} x {rows}: {found}");
        }
        assert!((map.total() / (4.0 * PI) - 1.0).abs() < 1e-12);
    }
    for heading in [0.0, 90.0, 180.0, 270.0f64] {
        let mut values = vec![0.0; 64 * 32];
        // 11.25 to 16.875 degrees above the horizon, just right of the middle of the picture
        values[13 * 64 + 32] = 1.0;
        let start = (heading - 180.0).to_radians();
        let map = RadianceMap::new(64, start, values);
        let toward = position(14.06, heading + 2.8).direction(0.0);
        assert_eq!(map.radiance(map.cell(toward), 0), 1.0, "{heading}");
        assert_eq!(map.radiance(map.cell(-toward), 0), 0.0);
        let solid_angle = map.total();
        let small = 5.625f64.to_radians().powi(2) * 14.06f64.to_radians().cos();
        assert!((solid_angle / small - 1.0).abs() < 1e-3);
        let found = map.irradiance(toward)[0];
        assert!((found / solid_angle - 1.0).abs() < 2e-3, "{heading}");
        let behind = -toward.with_z(0.0).normalize();
        assert_eq!(map.irradiance(behind)[0], 0.0);
        assert!(map.entry(behind, None).is_none());
    }
}

/// Returns lights of every kind: a clear sky, a sun with light from the ground, the suns of a day,
/// and a map that differs between bands.
fn lights() -> Vec<(&'static str, InfiniteLight)> {
    let hour = hour(700.0, 90.0, position(25.0, 200.0));
    let ground = || {
        let values = [0.0, 1.0].to_vec();
        InfiniteShape::Map(Arc::new(RadianceMap::new(1, 0.0, values)))
    };
    let day = (0..9).map(|i| {
        let i = f64::from(i);
        (position(10.0 + 5.0 * i, 90.0 + 20.0 * i).direction(0.0), 1.0 + i)
    });
    let day = Suns::new(5f64.to_radians(), day).unwrap();
    let mut rng = Stream::new(1, 0, 9);
    let texels: Vec<f32> = (0..16 * 8 * 2).map(|_| rng.uniform().powi(4)).collect();
    let map = RadianceMap::spectral(16, 0.4, 2, texels);
    vec![
        ("clear sky", sky(SkyModel::Perez, hour)),
        (
            "sun and ground",
            light([
                (sun(5.0, position(2.0, 77.0).direction(0.0)), vec![0.3, 20.0]),
                (ground(), vec![1.0, 0.5]),
            ]),
        ),
        ("suns of a day", light([(InfiniteShape::Suns(Arc::new(day)), vec![1.0])])),
        ("map", light([(InfiniteShape::Map(Arc::new(map)), vec![2.0, 0.5])])),
    ]
}

/// Uses 240 bins. The mean of radiance / density is the integral of the radiance, also as a sum
/// over the bins.
#[test]
fn directions_have_their_density() {
    for (what, light) in lights() {
        let bins = SphereBins::even(Vec3::Z);
        let (mut counts, mut rng) = (vec![0; bins.len()], Stream::new(1, 0, 0));
        let (mut mean, mut balance) = (Mean::default(), Mean::default());
        for _ in 0..SAMPLES {
            let sample = light.sample::<[f32; 2]>(&mut rng).unwrap();
            assert!((sample.toward.length() - 1.0).abs() < 1e-6);
            let pdf = light.pdf(sample.toward);
            // except at borders of cells and discs, where rounding may fall to either side
            let radiance = light.radiance::<[f32; 2]>(sample.toward);
            let alike = (pdf / sample.pdf.unwrap() - 1.0).abs() < 1e-4
                && (radiance.0[0] / pdf / sample.radiance_over_pdf.0[0] - 1.0).abs() < 1e-4;
            balance.add(if alike { 1.0 } else { 0.0 });
            mean.add(f64::from(sample.radiance_over_pdf.0[0]));
            counts[bins.index(sample.toward)] += 1;
        }
        assert!(balance.mean() > 0.9999, "{what}: {}", balance.mean());
        // the finer quadrature is accurate to a thousandth in each bin, except at the border of a
        // disc
        let fine = sum_over_sphere(&light);
        let total = fine.iter().map(|(_, [p, ..])| p).sum::<f64>();
        assert!((total - 1.0).abs() < 5e-3, "{what}: the density integrates to {total}");
        let mut expected = vec![0.0; bins.len()];
        let mut integral = 0.0;
        for (direction, [p, radiance, _]) in fine {
            expected[bins.index(direction)] += p / total * SAMPLES as f64;
            integral += radiance;
        }
        mean.assert(what, integral, 5e-3 * integral);
        if what == "map" || what == "clear sky" {
            assert_counts(what, &counts, &expected);
        }
    }
}

/// Returns the directions of those of a million cells of the sphere that are not dark, each with
/// the density and the radiance in two bands, times the solid angle.
fn sum_over_sphere(light: &InfiniteLight) -> Vec<(Vec3, [f64; 3])> {
    let (rows, columns) = (720, 1440);
    let solid_angle = 4.0 * PI / f64::from(rows * columns);
    let mut found = Vec::new();
    for i in 0..rows {
        let z = 1.0 - 2.0 * (f64::from(i) + 0.5) / f64::from(rows);
        let across = (1.0 - z * z).sqrt();
        for j in 0..columns {
            let (s, c) = (2.0 * PI * (f64::from(j) + 0.5) / f64::from(columns)).sin_cos();
            let direction = DVec3::new(across * s, across * c, z).as_vec3();
            let [l, m] = light.radiance::<[f32; 2]>(direction).0.map(f64::from);
            let density = f64::from(light.pdf(direction));
            if density > 0.0 {
                found.push((direction, [density, l, m].map(|v| v * solid_angle)));
            }
        }
    }
    found
}

/// The directions of photons that enter through a face have the density radiance x cosine, in every
/// band.
#[test]
fn entering_photons_have_their_density() {
    let normals = [Vec3::Z, Vec3::NEG_X, Vec3::Y, tilted(120.0, 33.0)];
    for (what, light) in lights() {
        for part in light.parts() {
            let fine = sum_over_sphere(&InfiniteLight::new(
                "part".into(),
                part.scale().len(),
                vec![part.clone()],
            ));
            for normal in normals {
                let Some(entry) = part.entry(normal, None) else {
                    assert_eq!(part.irradiance(normal).iter().sum::<f64>(), 0.0, "{what} {normal}");
                    continue;
                };
                assert_eq!(entry.irradiance, part.irradiance(normal));
                check_entry(what, &entry, &fine, normal);
            }
        }
    }
}

fn check_entry(what: &str, entry: &InfiniteEntry, fine: &[(Vec3, [f64; 3])], normal: Vec3) {
    let mut rng = Stream::new(1, 0, 1);
    let bins = SphereBins::even(normal);
    let bands = entry.irradiance.len();
    let mut counts = vec![0; bins.len()];
    // mean power of each band, and mean of power times cosine
    let mut power = vec![Mean::default(); bands];
    let mut cosine = vec![Mean::default(); bands];
    for _ in 0..SAMPLES {
        let photon = entry.sample::<[f32; 2]>(&mut rng);
        let cos = -f64::from(photon.direction.dot(normal));
        assert!(cos > -1e-6, "{what}: goes out");
        counts[bins.index(-photon.direction)] += 1;
        for b in 0..bands {
            power[b].add(f64::from(photon.factor.0[b]));
            cosine[b].add(f64::from(photon.factor.0[b]) * cos);
        }
    }
    let cos = |direction: Vec3| f64::from(direction.dot(normal)).max(0.0);
    let sum = |power: i32, k: usize| -> f64 {
        fine.iter().map(|(d, v)| v[k] * cos(*d).powi(power)).sum()
    };
    for b in 0..bands {
        let (found, expected) = (sum(1, 1 + b), entry.irradiance[b]);
        // a million directions resolve a disc of 5 degrees to a hundredth
        assert!((found / expected - 1.0).abs() < 0.01, "{what} {normal}: {found}, not {expected}");
        power[b].assert(what, 1.0, 1e-6);
        let mean = sum(2, 1 + b) / found;
        cosine[b].assert(&format!("{what} {normal} band {b}"), mean, 5e-3 * mean);
    }
    if what == "map" || what == "clear sky" {
        let mut expected = vec![0.0; bins.len()];
        for (direction, [density, ..]) in fine {
            expected[bins.index(*direction)] += density * cos(*direction);
        }
        let total: f64 = expected.iter().sum();
        expected.iter_mut().for_each(|e| *e *= SAMPLES as f64 / total);
        assert_counts(&format!("{what} {normal}"), &counts, &expected);
    }
}

/// Where runs of cells share an entry of the table, each cell is still sampled with its own chance.
#[test]
fn a_large_map_is_sampled_by_its_cells() {
    let (columns, rows) = (1500, 750);
    let mut values = vec![0.0; columns * rows];
    let bright: Vec<usize> = (0..40).map(|i| 300_000 + 7 * i).collect();
    for (i, &cell) in bright.iter().enumerate() {
        values[cell] = (i % 5) as f32;
    }
    let map = RadianceMap::new(columns, 0.0, values.clone());
    let (entry, _) = map.entry(DVec3::Z, None).unwrap();
    let mut rng = Stream::new(1, 0, 2);
    let mut counts = [vec![0; 40], vec![0; 40]];
    for _ in 0..SAMPLES {
        for (counts, (toward, _)) in
            counts.iter_mut().zip([map.sample(&mut rng), map.sample_entry(&entry, &mut rng)])
        {
            let azimuth = azimuth_of(toward);
            let column = (azimuth / (2.0 * PI) * columns as f64) as usize;
            counts[bright.iter().position(|cell| cell % columns == column).unwrap()] += 1;
        }
    }
    let expected: Vec<f64> =
        bright.iter().map(|&cell| f64::from(values[cell]) / 80.0 * SAMPLES as f64).collect();
    assert_counts("runs", &counts[0], &expected);
    assert_counts("runs through a face", &counts[1], &expected);
}

#[test]
fn parallel_rays_are_found_by_sampling_alone() {
    let toward = position(35.0, 120.0).direction(0.0);
    let light = light([(sun(0.0, toward), vec![800.0, 0.0])]);
    let sample = light.sample::<[f32; 2]>(&mut Stream::new(1, 0, 0)).unwrap();
    assert_eq!((sample.toward, sample.pdf), (toward.as_vec3(), None));
    assert_eq!(sample.radiance_over_pdf.0, [800.0, 0.0]);
    assert_eq!(
        (light.radiance::<[f32; 2]>(toward.as_vec3()).0, light.pdf(toward.as_vec3())),
        ([0.0; 2], 0.0)
    );
    let entry = light.parts()[0].entry(Vec3::Z, None).unwrap();
    let photon = entry.sample::<[f32; 2]>(&mut Stream::new(1, 0, 0));
    assert_eq!((photon.direction, photon.factor.0), (-toward.as_vec3(), [1.0, 0.0]));
    assert!(light.parts()[0].entry(Vec3::Y, None).is_none());
    // a disc, unlike parallel rays, has a radiance
    let disc = self::light([(sun(0.2666, toward), vec![800.0])]);
    let expected = 800.0 / (PI * 0.2666f64.to_radians().sin().powi(2));
    assert!(
        (f64::from(disc.radiance::<[f32; 1]>(toward.as_vec3()).0[0]) / expected - 1.0).abs() < 1e-6
    );
    assert_eq!(disc.radiance::<[f32; 1]>(position(35.28, 120.0).direction(0.0).as_vec3()).0, [0.0]);
}

/// The text of a map, which the hash of a scene is made of, is short and tells maps apart.
#[test]
fn the_text_of_a_map_is_short() {
    let map = |value: f32| {
        let values = (0..80_000).map(|i| if i == 777 { value } else { 1.0 });
        RadianceMap::new(400, 0.0, values.collect())
    };
    let texts = [1.0, 1.5, 1.0].map(|value| format!("{:?}", map(value)));
    assert!(texts[0] != texts[1] && texts[0] == texts[2] && texts[0].len() < 400, "{texts:?}");
    let entry = map(1.0).entry(DVec3::Z, None).map(|(entry, _)| format!("{entry:?}"));
    assert!(entry.is_some_and(|text| text.len() < 400));
}
