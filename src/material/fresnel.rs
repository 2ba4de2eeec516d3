//! Fresnel reflectance of a smooth dielectric interface (Born and Wolf, Principles of Optics, 1.5).

/// Power reflectances of an interface at one angle, per polarisation.
#[derive(Clone, Copy, Debug)]
pub struct Fresnel {
    /// Polarised across the plane of incidence.
    pub s: f32,
    /// Polarised in it.
    pub p: f32,
    /// Cosine of the angle of refraction; zero where reflection is total.
    pub cos_refracted: f32,
}

impl Fresnel {
    /// At the cosine of incidence `cos` in [0, 1], towards a medium of relative index
    /// `eta` = n beyond / n here.
    #[inline]
    pub fn new(cos: f32, eta: f32) -> Self {
        let sin2 = (1.0 - cos * cos).max(0.0) / (eta * eta);
        if sin2 >= 1.0 {
            return Self { s: 1.0, p: 1.0, cos_refracted: 0.0 };
        }
        let cos_refracted = (1.0 - sin2).sqrt();
        let s = (cos - eta * cos_refracted) / (cos + eta * cos_refracted);
        let p = (eta * cos - cos_refracted) / (eta * cos + cos_refracted);
        Self { s: s * s, p: p * p, cos_refracted }
    }

    /// Reflectance for unpolarised light.
    #[inline]
    pub fn unpolarised(&self) -> f32 {
        0.5 * (self.s + self.p)
    }

    /// Whether reflection is total.
    #[inline]
    pub fn is_total(&self) -> bool {
        self.cos_refracted == 0.0
    }
}

/// Reflectance at normal incidence, F0.
pub fn normal_fresnel(ior: f64) -> f64 {
    ((ior - 1.0) / (ior + 1.0)).powi(2)
}

/// Reflectance for diffuse light from outside, Fbar = 2 integral of F cos d(cos), by the midpoint
/// rule over cos = x^2 (F is steep at grazing angles).
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
        // Brewster's angle: no p; a leaf's diffuse reflectance; total reflection beyond 41.8 deg
        let brewster = 1.5f32.atan().cos();
        assert!(Fresnel::new(brewster, 1.5).p < 1e-12);
        assert!((diffuse_fresnel(1.425) - 0.0806).abs() < 5e-5);
        assert!(Fresnel::new(42f32.to_radians().cos(), 1.0 / 1.5).is_total());
        assert!(!Fresnel::new(41f32.to_radians().cos(), 1.0 / 1.5).is_total());
        let normal = f64::from(Fresnel::new(1.0, 1.425).unpolarised());
        assert!((normal - normal_fresnel(1.425)).abs() < 1e-7);
    }
}
