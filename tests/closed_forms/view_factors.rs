//! View factors: the fraction of a Lambertian surface's power that reaches another surface.

use crate::{
    exact::Comparisons,
    world::{Mesh, World, front},
};

/// Three pairs of surfaces, each with light both ways: two parallel rectangles, two perpendicular
/// squares and two coaxial discs. Published: Howell, A Catalog of Radiation Heat Transfer
/// Configuration Factors, C-11, C-14, C-41.
///
/// Seed 1, 1.2e6 to 1.5e7 photons; standard errors at most 0.1 % of the exact value. 6 comparisons,
/// odds of a false alarm 7e-4.
#[test]
fn view_factors() {
    let mut check = Comparisons::new("view factor", 0.001);
    let x = |length: f64| [length, 0.0, 0.0];
    let y = |length: f64| [0.0, length, 0.0];
    let z = |length: f64| [0.0, 0.0, length];

    // the way back follows from reciprocity, F21 A2 = F12 A1; `areas` is A1 / A2
    let mut pair = |what: &str, a: &Mesh, b: &Mesh, factor: f64, areas: f64, photons: [u64; 2]| {
        let share = |from: &Mesh, to: &Mesh, photons| {
            World::new().lamp("lamp", from, 1.0).captor("captor", to).run(photons, 1)
        };
        check.flux(what, front(&share(a, b, photons[0]), "captor"), 0, factor);
        let back = share(b, a, photons[1]);
        check.flux(format!("{what}, back"), front(&back, "captor"), 0, factor * areas);
    };
    let low = Mesh::rectangle([0.0; 3], x(1.0), y(2.0));
    let high = Mesh::rectangle([0.0, 0.0, 0.5], y(2.0), x(1.0));
    pair("parallel 1 x 2 m at 0.5 m", &low, &high, 0.508_989, 1.0, [1_200_000; 2]);

    let floor = Mesh::rectangle([0.0; 3], x(1.0), y(1.0));
    let wall = Mesh::rectangle([0.0; 3], y(1.0), z(1.0));
    pair("perpendicular unit squares", &floor, &wall, 0.200_044, 1.0, [5_000_000; 2]);

    let small = Mesh::disc([0.0; 3], [0.0, 0.0, 1.0], 0.2);
    let large = Mesh::disc([0.0, 0.0, 0.5], [0.0, 0.0, -1.0], 0.5);
    pair("coaxial discs", &small, &large, 0.480_032, 0.04 / 0.25, [2_000_000, 15_000_000]);
    check.finish(6);
}
