//! PROSPECT-D against closed forms, and against values of the Python package prosail 2.0.5.

use super::*;
use crate::{math::curve::integral, scene::material::diffuse_fresnel};

fn leaf(
    [n, chlorophyll, carotenoids, anthocyanins, brown, water, dry_matter]: [f64; 7],
) -> Prospect {
    Prospect { n, chlorophyll, carotenoids, anthocyanins, brown, water, dry_matter }
}

#[test]
fn agrees_with_the_reference() {
    let places = [400.0, 450.0, 550.0, 680.0, 720.0, 900.0, 1450.0, 1940.0, 2500.0];
    let leaves = [
        (
            [1.5, 40.0, 8.0, 0.0, 0.0, 0.01, 0.009],
            [
                [0.0431178, 0.0003313],
                [0.0412511, 0.0013994],
                [0.1511673, 0.1502528],
                [0.0360016, 0.0052725],
                [0.3065823, 0.3300047],
                [0.4415500, 0.4742043],
                [0.1650297, 0.2096990],
                [0.0373651, 0.0489542],
                [0.0335605, 0.0583454],
            ],
        ),
        (
            [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            [
                [0.4031187, 0.5968813],
                [0.3982190, 0.6017810],
                [0.3913324, 0.6086676],
                [0.3818622, 0.6181378],
                [0.3804284, 0.6195716],
                [0.3775902, 0.6224098],
                [0.3571358, 0.6428642],
                [0.3304059, 0.6695941],
                [0.3058884, 0.6941116],
            ],
        ),
        (
            [1.0, 80.0, 20.0, 5.0, 0.0, 0.04, 0.02],
            [
                [0.0430782, 0.0000009],
                [0.0409915, 0.0000154],
                [0.0446128, 0.0670434],
                [0.0346742, 0.0003942],
                [0.1465057, 0.3134683],
                [0.3000134, 0.5286168],
                [0.0316459, 0.0670075],
                [0.0201380, 0.0007319],
                [0.0153827, 0.0016106],
            ],
        ),
        (
            [2.7, 5.0, 2.0, 30.0, 1.0, 0.002, 0.003],
            [
                [0.0483467, 0.0003897],
                [0.0556178, 0.0016540],
                [0.0539532, 0.0019707],
                [0.2134175, 0.0647651],
                [0.4371659, 0.2090523],
                [0.5894049, 0.3314572],
                [0.4817946, 0.2780498],
                [0.2980379, 0.1702042],
                [0.2737064, 0.1820190],
            ],
        ),
    ];
    for (contents, values) in leaves {
        let spectra = leaf(contents).spectra().unwrap();
        for (nm, [r, t]) in places.into_iter().zip(values) {
            let found = [spectra.reflectance.at(nm), spectra.transmittance.at(nm)];
            let far = (found[0] - r).abs().max((found[1] - t).abs());
            assert!(far < 1e-6, "{contents:?} at {nm} nm: {found:?}, not {r}, {t}");
        }
    }
}

#[test]
fn shares_have_their_closed_forms() {
    for n in [1.1, 1.33, 1.425, 1.52] {
        let passed = isotropic_transmittance(90.0, n);
        assert!((passed - (1.0 - diffuse_fresnel(n))).abs() < 1e-6, "{n}: {passed}");
        // close to the normal it is Fresnel's
        let normal = 1.0 - ((n - 1.0) / (n + 1.0)).powi(2);
        assert!((isotropic_transmittance(0.5, n) - normal).abs() < 1e-4, "{n}");
    }
    // a layer under isotropic light: each direction goes a way of 1 / mu
    for k in [1e-6_f64, 0.01, 0.3, 0.999, 1.001, 2.0, 20.0] {
        let knots: Vec<f64> = (1..400).map(|i| f64::from(i) / 400.0).collect();
        let exact = 2.0 * integral(0.0, 1.0, &knots, |mu| mu * (-k / mu).exp());
        let found = diffuse_transmittance(k);
        assert!((found - exact).abs() < 1e-9, "{k}: {found}, not {exact}");
    }
    // plates one by one, with all reflections between them
    for (r, t) in [(0.3, 0.5), (0.05, 0.9), (0.4, 0.6), (0.9, 1e-6)] {
        let (mut all_r, mut all_t) = (r, t);
        for number in 2..6 {
            let between = 1.0 / (1.0 - all_r * r);
            (all_r, all_t) = (all_r + all_t * all_t * r * between, all_t * t * between);
            let [found_r, found_t] = pile(r, t, f64::from(number));
            assert!((found_r - all_r).abs() < 1e-9 && (found_t - all_t).abs() < 1e-9, "{r} {t}");
        }
        assert!((pile(r, t, 0.0)[1] - 1.0).abs() < 1e-12);
    }
}

#[test]
fn leaves_conserve_energy_and_bad_ones_are_named() {
    for n in [1.0, 1.5, 10.0] {
        let clear = leaf([n, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]).spectra().unwrap();
        let dark = leaf([n, 1e5, 1e5, 1e5, 1e3, 1e3, 1e3]).spectra().unwrap();
        for nm in (400..=2500).map(f64::from) {
            let sum = |s: &LeafSpectra| s.reflectance.at(nm) + s.transmittance.at(nm);
            assert!((sum(&clear) - 1.0).abs() < 1e-9, "{nm}: {}", sum(&clear));
            assert!((0.0..0.1).contains(&sum(&dark)), "{nm}: {}", sum(&dark));
        }
    }
    for (contents, name) in [
        ([0.9, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], "n"),
        ([f64::NAN, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], "n"),
        ([1.5, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0], "carotenoids"),
        ([1.5, 0.0, 0.0, 0.0, 0.0, f64::INFINITY, 0.0], "water"),
    ] {
        assert_eq!(leaf(contents).spectra().unwrap_err().place(), name);
    }
}
