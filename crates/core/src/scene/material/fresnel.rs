//! Fresnel reflectance of a smooth dielectric interface (Born and Wolf, Principles of Optics, 1.5).

/// Power reflectances of an interface at one angle of incidence, for both polarisations.
#[derive(Clone, Copy, Debug)]
pub struct Fresnel {
    /// Reflectance of light polarised across the plane of incidence.
    pub s: f32,
    /// Reflectance of light polarised in the plane of incidence.
    pub p: f32,
    /// Cosine of the angle of refraction; 0 where reflection is total.
    pub cos_refracted: f32,
}

impl Fresnel {
    /// Computes the reflectances at the cosine of incidence `cos` in [0, 1]. `eta` is the index of
    /// the medium beyond the interface over the index of the medium here.
    #[inline]
    pub fn new(cos: f32, eta: f32) -> Self {
        // not 1 - sin^2 / eta^2, which with an index near 1 would lose a grazing cosine to rounding
        let cos2_refracted = ((eta - 1.0) * (eta + 1.0) + cos * cos) / (eta * eta);
        if cos2_refracted <= 0.0 {
            return Self { s: 1.0, p: 1.0, cos_refracted: 0.0 };
        }
        let cos_refracted = cos2_refracted.sqrt();
        let s = (cos - eta * cos_refracted) / (cos + eta * cos_refracted);
        let p = (eta * cos - cos_refracted) / (eta * cos + cos_refracted);
        Self { s: s * s, p: p * p, cos_refracted }
    }

    /// Returns the reflectance for unpolarised light.
    #[inline]
    pub fn unpolarised(&self) -> f32 {
        0.5 * (self.s + self.p)
    }

    /// Returns whether reflection is total.
    #[inline]
    pub fn is_total(&self) -> bool {
        self.cos_refracted == 0.0
    }
}

/// Returns the reflectance at normal incidence, F0, of an index of refraction seen from air.
pub fn normal_fresnel(ior: f64) -> f64 {
    ((ior - 1.0) / (ior + 1.0)).powi(2)
}

/// Returns the reflectance for diffuse light from outside, Fbar = 2 integral of F cos d(cos). The
/// integral is computed by the midpoint rule over x with cos = x^2, because F is steep at grazing
/// angles.
pub fn diffuse_fresnel(ior: f64) -> f64 {
    const STEPS: usize = 20_000;
    let sum: f64 = (0..STEPS)
        .map(|i| {
            let x = (i as f64 + 0.5) / STEPS as f64;
            let f = Fresnel::new((x * x) as f32, ior as f32).unpolarised();
            f64::from(f) * 4.0 * x.powi(3)
        })
        .sum();
    sum / STEPS as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_reflectances() {
        // no p at Brewster's angle, a leaf's diffuse reflectance, total reflection beyond 41.8
        // degrees
        let brewster = 1.5f32.atan().cos();
        assert!(Fresnel::new(brewster, 1.5).p < 1e-12);
        assert!((diffuse_fresnel(1.425) - 0.0806).abs() < 5e-5);
        assert!(Fresnel::new(42f32.to_radians().cos(), 1.0 / 1.5).is_total());
        assert!(!Fresnel::new(41f32.to_radians().cos(), 1.0 / 1.5).is_total());
        let normal = f64::from(Fresnel::new(1.0, 1.425).unpolarised());
        assert!((normal - normal_fresnel(1.425)).abs() < 1e-7);
    }

    /// Compares with the textbook's sines and tangents in double precision, to 1e-5 even at the
    /// limits of single precision: grazing angles and indices near 1.
    #[test]
    fn agrees_with_double_precision() {
        for ior in [1.0001f32, 1.01, 1.33, 1.425, 1.52, 2.4, 1000.0] {
            for eta in [ior, 1.0 / ior] {
                for cos in [1e-7f32, 1e-5, 1e-4, 1e-3, 0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99, 0.9999]
                {
                    let fresnel = Fresnel::new(cos, eta);
                    let (angle, eta) = (f64::from(cos).acos(), f64::from(eta));
                    let sine = angle.sin() / eta;
                    if (sine - 1.0).abs() < 1e-6 {
                        continue; // this is the critical angle, to rounding
                    }
                    let exact = if sine > 1.0 {
                        [1.0, 1.0]
                    } else {
                        let refracted = sine.asin();
                        let (sum, difference) = (angle + refracted, angle - refracted);
                        [difference.sin() / sum.sin(), difference.tan() / sum.tan()].map(|r| r * r)
                    };
                    for (found, exact) in [fresnel.s, fresnel.p].into_iter().zip(exact) {
                        let miss = (f64::from(found) - exact).abs();
                        assert!(miss < 1e-5, "eta {eta}, cos {cos}: {found}, not {exact}");
                    }
                }
            }
        }
    }

    /// An index of 1 is no interface and reflects nothing, however grazing the light is.
    #[test]
    fn no_interface_reflects_nothing() {
        for i in 0..=10_000 {
            let cos = 10f32.powf(-7.0 * i as f32 / 10_000.0);
            let fresnel = Fresnel::new(cos, 1.0);
            assert_eq!((fresnel.s, fresnel.p, fresnel.cos_refracted), (0.0, 0.0, cos));
        }
        assert_eq!(diffuse_fresnel(1.0), 0.0);
    }
}
