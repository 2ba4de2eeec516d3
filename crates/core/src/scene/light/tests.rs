//! Tests of emission against closed forms. Every chi-square has 4e5 photons and odds of a false
//! alarm of 1e-6.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use super::{AnyEmitter, Area, Cone, IsotropicLine, Lamp, Light, Tube, Unplaced};
use crate::math::{
    geometry::{Extent, Ray},
    odds::{SphereBins, assert_counts, assert_shard},
    rng::Stream,
};

const PHOTONS: u64 = 400_000;
const CENTER: DVec3 = DVec3::new(3.0, -2.0, 1.0);
/// Above the distance from their light at which photons start, m.
const OFFSET: f64 = 2e-5;

fn light<E: 'static>(power: &[f64], emitter: Unplaced<E>) -> Light
where
    AnyEmitter: From<E>,
{
    let lamp = Lamp::new(power, emitter).into();
    Light::new("lamp".into(), lamp, power.len(), CENTER, &Extent::EMPTY.into())
}

/// Visits each photon of a light, with its start in the user's coordinates and its direction.
fn photons<E: 'static>(seed: u64, emitter: Unplaced<E>, mut visit: impl FnMut(DVec3, Vec3))
where
    AnyEmitter: From<E>,
{
    let (light, mut rng) = (light(&[1.0], emitter), Stream::new(seed, 0, 0));
    for _ in 0..PHOTONS {
        let ray = light.emit(&mut rng);
        assert!((ray.direction.length() - 1.0).abs() < 1e-6, "{ray:?}");
        visit(ray.origin.as_dvec3() + CENTER, ray.direction);
    }
}

#[track_caller]
fn assert_uniform(what: &str, counts: &[u64]) {
    assert_counts(what, counts, &vec![PHOTONS as f64 / counts.len() as f64; counts.len()]);
}

/// Returns which of `n` equal cells holds a number in [0, 1].
fn cell(u: f64, n: usize) -> usize {
    ((u * n as f64) as usize).min(n - 1)
}

fn turn_around(axis: DVec3, v: DVec3) -> f64 {
    let (x, y) = axis.any_orthonormal_pair();
    v.dot(y).atan2(v.dot(x)).rem_euclid(2.0 * PI) / (2.0 * PI)
}

/// Returns which of 4 x 4 equally likely cells holds a Lambertian direction about `normal`.
fn lambertian_cell(normal: DVec3, direction: Vec3) -> usize {
    let d = direction.as_dvec3();
    let cos = d.dot(normal);
    assert!(cos > 0.0, "a direction into the lamp");
    4 * cell(cos * cos, 4) + cell(turn_around(normal, d), 4)
}

/// Seed 1, 240 bins of directions.
#[test]
fn point_and_isotropic_line_fill_the_sphere() {
    let (from, to) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(-0.5, 2.5, 4.0));
    let bins = SphereBins::even(Vec3::new(0.48, -0.6, 0.64));
    let mut counts = vec![0; bins.len()];
    photons(1, Cone::point(from), |p, d| {
        assert!(p.distance(from) < 1e-6);
        counts[bins.index(d)] += 1;
    });
    assert_uniform("point", &counts);

    let mut counts = vec![0; 5 * bins.len()];
    photons(1, IsotropicLine::new(from, to).unwrap(), |p, d| {
        let along = (p - from).dot(to - from) / from.distance_squared(to);
        assert!(p.distance(from.lerp(to, along)) < 1e-6 && (-1e-6..1.0 + 1e-6).contains(&along));
        counts[5 * bins.index(d) + cell(along, 5)] += 1;
    });
    assert_uniform("isotropic line", &counts);
}

/// Seed 2, 20 x 12 bins in each cone. No direction is outside the cone by more than its own
/// rounding, 1e-7.
#[test]
fn spot_is_uniform_in_its_cone() {
    let (position, direction) = (DVec3::ONE, DVec3::new(1.0, 2.0, -3.0));
    let axis = direction.normalize();
    for degrees in [1e-3, 0.5, 30.0, 90.0, 120.0, 180.0] {
        let half_angle = f64::to_radians(degrees);
        let whole = 2.0 * (half_angle / 2.0).sin().powi(2);
        let mut counts = vec![0; 240];
        let spot = Cone::spot(position, direction, half_angle).unwrap();
        // directions are known to 1e-7, which is coarser than the rings of the narrowest cone
        let rings = if degrees < 0.01 { 4 } else { 20 };
        photons(2, spot, |_, d| {
            let d = d.as_dvec3();
            let off_axis = 2.0 * (0.5 * d.distance(axis)).min(1.0).asin();
            assert!(off_axis < half_angle + 2e-7, "{off_axis} of {half_angle}");
            let ring = cell(0.5 * d.distance_squared(axis) / whole, rings);
            counts[12 * ring + cell(turn_around(axis, d), 12)] += 1;
        });
        let expected: Vec<f64> = (0..240)
            .map(|i| if i < 12 * rings { PHOTONS as f64 / (12 * rings) as f64 } else { 0.0 })
            .collect();
        if degrees < 0.01 {
            // half of the photons are in the inner rings, within 1 %: rounding moves some between
            // cells
            let inner: u64 = counts[..12 * rings / 2].iter().sum();
            assert!((inner as f64 / PHOTONS as f64 - 0.5).abs() < 0.01);
        } else {
            assert_counts(&format!("spot of {degrees}"), &counts, &expected);
        }
    }
}

/// Seed 3. One chi-square has 5 places along the tube, 8 around it (none for a line) and 4 x 4
/// Lambertian directions. Another compares the intensity in 240 bins with the sine of the angle to
/// the axis, density sin / pi^2.
#[test]
fn tube_is_lambertian() {
    let (from, to) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(-0.5, 2.5, 4.0));
    let axis = (to - from).normalize();
    for radius in [0.4, 0.0] {
        let bins = SphereBins::even(axis.as_vec3());
        let mut intensity = vec![0; bins.len()];
        let mut cells = vec![0; 5 * 8 * 16];
        photons(3, Tube::whole(from, to, radius).unwrap(), |p, d| {
            intensity[bins.index(d)] += 1;
            let along = (p - from).dot(axis) / from.distance(to);
            assert!((-1e-6..1.0 + 1e-6).contains(&along));
            let outward = p - from.lerp(to, along);
            assert!((0.0..OFFSET).contains(&(outward.length() - radius)));
            let normal = outward.normalize();
            // the offset of a line is too short to show the normal well
            let direction = if radius > 0.0 { lambertian_cell(normal, d) } else { 0 };
            let around = if radius > 0.0 { cell(turn_around(axis, outward), 8) } else { 0 };
            cells[(5 * around + cell(along, 5)) * 16 + direction] += 1;
        });
        if radius > 0.0 {
            assert_uniform("tube", &cells);
        } else {
            let places: Vec<u64> = cells.iter().copied().step_by(16).take(5).collect();
            assert_uniform("line", &places);
        }
        let axis = axis.as_vec3();
        let sine = |d: Vec3| [f64::from(d.cross(axis).length()) / (PI * PI)];
        let chances = bins.integrals(sine);
        let total: f64 = chances.iter().map(|[p]| p).sum();
        assert!((total - 1.0).abs() < 1e-3);
        let expected: Vec<f64> = chances.iter().map(|[p]| p / total * PHOTONS as f64).collect();
        assert_counts("sine", &intensity, &expected);
    }
}

/// Seed 4. Triangles of areas from 3 to 0.03 and one without area, on either face. One chi-square
/// has 4 cells in each triangle and 4 x 4 Lambertian directions.
#[test]
fn area_light_is_uniform_and_lambertian() {
    let triangles = vec![
        [DVec3::ZERO, DVec3::new(3.0, 0.0, 0.0), DVec3::new(0.0, 2.0, 0.0)],
        [DVec3::ONE, DVec3::ONE, DVec3::new(2.0, 2.0, 2.0)],
        [DVec3::new(5.0, 0.0, 1.0), DVec3::new(5.0, 1.0, 1.0), DVec3::new(5.0, 0.0, 1.2)],
        [DVec3::new(-4.0, 1.0, 0.0), DVec3::new(-4.0, 1.0, 1.0), DVec3::new(-3.0, 1.9, 0.0)],
        [DVec3::new(0.0, 6.0, 0.0), DVec3::new(0.2, 6.0, 0.3), DVec3::new(0.0, 6.2, 0.0)],
    ];
    let area = |[a, b, c]: &[DVec3; 3]| 0.5 * (*b - *a).cross(*c - *a).length();
    let total: f64 = triangles.iter().map(area).sum();
    for two_sided in [false, true] {
        let mut counts = vec![0; 2 * 5 * 4 * 16];
        let shape = Area::new(triangles.clone(), two_sided).unwrap();
        photons(4, shape, |p, d| {
            // find the triangle that the photon comes from
            let (index, weights, height) = (0..5)
                .filter(|&i| area(&triangles[i]) > 0.0)
                .map(|i| {
                    let [a, b, c] = triangles[i];
                    let normal = (b - a).cross(c - a);
                    let weight =
                        |u: DVec3, v: DVec3| u.cross(v).dot(normal) / normal.length_squared();
                    let weights = [weight(p - a, c - a), weight(b - a, p - a)];
                    (i, weights, (p - a).dot(normal.normalize()))
                })
                .find(|(_, [u, v], height)| {
                    let inside = u.min(*v).min(1.0 - u - v) > -1e-4;
                    inside && height.abs() < OFFSET
                })
                .expect("the photon starts off a triangle");
            let [a, b, c] = triangles[index];
            let front = height > 0.0;
            assert!(front || two_sided);
            let normal = (b - a).cross(c - a).normalize() * if front { 1.0 } else { -1.0 };
            let across = weights[0] + weights[1];
            let place = 2 * cell(across * across, 2) + cell(weights[1] / across, 2);
            let direction = lambertian_cell(normal, d);
            counts[((usize::from(front) * 5 + index) * 4 + place) * 16 + direction] += 1;
        });
        let share = |face: usize| match (two_sided, face) {
            (true, _) => 0.5,
            (false, 1) => 1.0,
            (false, _) => 0.0,
        };
        let expected: Vec<f64> = (0..counts.len())
            .map(|i| {
                let (face, triangle) = (i / (5 * 64), i / 64 % 5);
                share(face) * area(&triangles[triangle]) / total / 64.0 * PHOTONS as f64
            })
            .collect();
        assert_counts("area light", &counts, &expected);
        let back: u64 = counts[..5 * 64].iter().sum();
        assert_shard("back", back, PHOTONS, share(0));
    }
}

/// For tubes from afar, the width that rays find is the true one, the mean cosine is pi / 4 of the
/// cosine of the tilt, and hits lie on the tube. There are 2e5 rays for each tube with seed 6,
/// spread evenly across twice its width. The rounding of their directions to single precision moves
/// the width by a random 2e-4 at most.
#[test]
fn tubes_are_as_wide_as_they_are() {
    const RAYS: u64 = 200_000;
    let axis = DVec3::new(0.48, -0.6, 0.64);
    let (x, y) = axis.any_orthonormal_pair();
    let cases =
        [(0.013, 1.0), (0.013, 30.0), (0.013, 100.0), (0.001, 2.0), (1e-4, 10.0), (0.001, 100.0)];
    for (radius, distance) in cases {
        let shape = Tube::whole(CENTER - axis, CENTER + axis, radius).unwrap();
        let (tube, mut rng) = (light(&[1.0], shape), Stream::new(6, 0, 0));
        let (mut hits, mut cosines) = (0u64, 0.0);
        for i in 0..RAYS {
            let (sin, cos) = (2.0 * PI * f64::from(rng.uniform())).sin_cos();
            let (away, beside) = (cos * x + sin * y, cos * y - sin * x);
            let tilt = f64::from(rng.uniform()) - 0.5;
            let origin = (distance * (away + 0.9 / distance * tilt * axis)).as_vec3();
            let offset = 2.0 * radius * (2.0 * (i as f64 + 0.5) / RAYS as f64 - 1.0);
            let towards = offset * beside - origin.as_dvec3();
            let ray = Ray { origin, direction: towards.normalize().as_vec3() };
            let Some(hit) = tube.hit(&ray) else { continue };
            hits += 1;
            // relative to the cosine of the tilt
            let direction = ray.direction.as_dvec3();
            let across = direction.reject_from_normalized(axis).length();
            cosines += f64::from(hit.cos) / across;
            let on = ray.origin.as_dvec3() + f64::from(hit.t) * direction;
            let off = on.reject_from_normalized(axis).length() - radius;
            assert!(off.abs() < 2e-7 * distance, "{radius} at {distance}: {off} off");
        }
        let width = 2.0 * hits as f64 / RAYS as f64;
        let cosine = cosines / hits as f64 / (PI / 4.0);
        assert!((width - 1.0).abs() < 1e-3, "{radius} m at {distance} m: width {width}");
        assert!((cosine - 1.0).abs() < 1e-3, "{radius} m at {distance} m: cosine {cosine}");
    }
}
