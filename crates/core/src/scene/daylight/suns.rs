//! The sun's disc, or many of them: the suns of the hours of a period.

use std::f64::consts::PI;

use glam::{DVec3, Vec2};

use crate::math::{
    geometry::Frame,
    rng::Stream,
    sampling::{uniform_cone, weighted_choice},
};

/// Discs with the same half angle and uniform radiance. The irradiances on planes across their
/// directions add up to 1.
#[derive(Clone, Debug)]
pub struct Suns {
    /// The suns, lowest first.
    suns: Vec<Sun>,
    running: Vec<f64>,
    half_angle: f64,
}

#[derive(Clone, Copy, Debug)]
struct Sun {
    toward: DVec3,
    weight: f64,
}

/// The suns as a plane sees them, for sampling in proportion to the irradiance of each.
#[derive(Clone, Debug)]
pub struct SunsEntry {
    normal: DVec3,
    /// Normal of the slope from below which no light comes.
    hillside: Option<DVec3>,
    running: Vec<f64>,
}

impl SunsEntry {
    /// Returns the irradiance on the plane.
    pub fn total(&self) -> f64 {
        self.running.last().copied().unwrap_or(0.0)
    }
}

impl Suns {
    /// Makes suns from directions towards them (unit vectors), the irradiance of each on a plane
    /// across its direction, in any unit, and the half angle, rad, from 0 (parallel rays) to 5
    /// degrees. Returns `None` where there is no light.
    pub fn new(half_angle: f64, suns: impl IntoIterator<Item = (DVec3, f64)>) -> Option<Self> {
        let bright = suns.into_iter().filter(|(_, irradiance)| *irradiance > 0.0);
        let mut suns: Vec<Sun> = bright.map(|(toward, weight)| Sun { toward, weight }).collect();
        suns.sort_by(|a, b| a.toward.z.total_cmp(&b.toward.z));
        let total: f64 = suns.iter().map(|sun| sun.weight).sum();
        let mut sum = 0.0;
        let mut running = Vec::with_capacity(suns.len());
        for sun in &mut suns {
            sun.weight /= total;
            sum += sun.weight;
            running.push(sum);
        }
        (!suns.is_empty()).then_some(Self { suns, running, half_angle })
    }

    /// Returns the number of suns.
    pub fn count(&self) -> usize {
        self.suns.len()
    }

    /// Returns whether the suns send parallel rays, which no direction meets by chance.
    pub fn is_parallel(&self) -> bool {
        self.half_angle == 0.0
    }

    /// Returns the square of the sine of the half angle.
    fn sine2(&self) -> f64 {
        self.half_angle.sin().powi(2)
    }

    /// Returns 1 - cos of the half angle.
    fn versine(&self) -> f64 {
        2.0 * (0.5 * self.half_angle).sin().powi(2)
    }

    /// Returns the sum of the weights of the suns whose discs hold a direction; 0 for parallel
    /// rays.
    fn weight(&self, toward: DVec3) -> f64 {
        if self.is_parallel() {
            return 0.0;
        }
        // the elevation of a direction on the disc differs at most by the half angle, its sine by
        // no more
        let first = self.suns.partition_point(|sun| sun.toward.z < toward.z - self.half_angle);
        let near =
            self.suns[first..].iter().take_while(|s| s.toward.z <= toward.z + self.half_angle);
        let inside = near.filter(|s| 0.5 * (s.toward - toward).length_squared() < self.versine());
        inside.map(|sun| sun.weight).sum()
    }

    /// Returns the relative radiance, 1/sr; 0 for parallel rays.
    pub fn radiance(&self, toward: DVec3) -> f64 {
        let weight = self.weight(toward);
        if weight > 0.0 { weight / (PI * self.sine2()) } else { 0.0 }
    }

    /// Returns the integral of the relative radiance over all directions.
    pub fn total(&self) -> f64 {
        match self.is_parallel() {
            true => 1.0,
            false => 2.0 * self.versine() / self.sine2(),
        }
    }

    /// Draws a direction towards a sun with density radiance / total, and returns it with the
    /// radiance there (0 for parallel rays).
    pub fn sample(&self, rng: &mut Stream) -> (DVec3, f64) {
        let (toward, sun) = self.choose(rng);
        if self.is_parallel() {
            return (toward, 0.0);
        }
        // rounding may take the direction off the disc
        let own = sun.weight / (PI * self.sine2());
        (toward, self.radiance(toward).max(own))
    }

    /// Draws a direction like [`sample`](Self::sample), without the radiance there.
    pub fn direction(&self, rng: &mut Stream) -> DVec3 {
        self.choose(rng).0
    }

    /// Draws a direction towards one of the suns, each as likely as the others, and uniform on its
    /// disc. Returns with it the chance of that sun in [`direction`](Self::direction) over its chance
    /// here.
    pub fn each_alike(&self, rng: &mut Stream) -> (DVec3, f64) {
        let count = self.suns.len();
        let sun = &self.suns[((rng.uniform_fine() * count as f64) as usize).min(count - 1)];
        (self.on_disc(sun, rng), sun.weight * count as f64)
    }

    /// Draws a direction towards a sun, in proportion to its irradiance, and returns it with that sun.
    #[inline(always)]
    fn choose(&self, rng: &mut Stream) -> (DVec3, &Sun) {
        let sun = &self.suns[weighted_choice(&self.running, rng.uniform_fine()).index];
        (self.on_disc(sun, rng), sun)
    }

    /// Draws a direction uniform on the disc of a sun.
    #[inline(always)]
    fn on_disc(&self, sun: &Sun, rng: &mut Stream) -> DVec3 {
        if self.is_parallel() {
            return sun.toward;
        }
        let local = uniform_cone(self.versine() as f32, rng.square());
        to_world(sun.toward, local.as_dvec3())
    }

    /// Returns whether a plane that faces `normal` may see a sun.
    pub fn may_shine_on(&self, normal: DVec3) -> bool {
        // of many suns some are nearly always in front of the plane
        let border = -self.half_angle.sin() - 1e-6;
        self.suns.len() > 16 || self.suns.iter().any(|sun| sun.toward.dot(normal) > border)
    }

    /// Returns the irradiance on a plane that faces `normal` (a unit vector).
    pub fn irradiance(&self, normal: DVec3) -> f64 {
        let seen = |sun: &Sun| sun.weight * disc_cosine(sun.toward.dot(normal), self.half_angle);
        self.suns.iter().map(seen).sum()
    }

    /// Returns the suns as a plane that faces `normal` sees them, or `None` where it sees none. Of
    /// what lies below a slope that faces `hillside` it sees nothing.
    pub fn entry(&self, normal: DVec3, hillside: Option<DVec3>) -> Option<SunsEntry> {
        let mut sum = 0.0;
        let running = self.suns.iter().map(|sun| {
            sum += sun.weight * self.seen(sun.toward, normal, hillside);
            sum
        });
        let mut running: Vec<f64> = running.collect();
        let last = running.iter().position(|&s| s == sum).unwrap_or(0);
        running.truncate(last + 1);
        (sum > 0.0).then_some(SunsEntry { normal, hillside, running })
    }

    /// Returns the irradiance on a plane that faces `normal` from a disc, over that on a plane across
    /// the disc's direction. A disc that the slope cuts is summed point by point.
    fn seen(&self, toward: DVec3, normal: DVec3, hillside: Option<DVec3>) -> f64 {
        /// Number of points along the radius and around.
        const POINTS: [usize; 2] = [64, 256];
        let border = self.half_angle.sin();
        let height = hillside.map_or(1.0, |hillside| toward.dot(hillside));
        if height <= -border {
            return 0.0;
        }
        if height >= border {
            return disc_cosine(toward.dot(normal), self.half_angle);
        }
        let middle = |i: usize, of: usize| (i as f32 + 0.5) / of as f32;
        let points = (0..POINTS[0]).flat_map(|i| (0..POINTS[1]).map(move |j| [i, j]));
        let cosines = points.map(|[i, j]| {
            let at = Vec2::new(middle(i, POINTS[0]), middle(j, POINTS[1]));
            let at = to_world(toward, uniform_cone(self.versine() as f32, at).as_dvec3());
            let is_above = hillside.is_none_or(|hillside| at.dot(hillside) > 0.0);
            if is_above { at.dot(normal).max(0.0) } else { 0.0 }
        });
        // the mean over the solid angle, times this over the irradiance across the disc
        cosines.sum::<f64>() / (POINTS[0] * POINTS[1]) as f64 * self.total()
    }

    /// Draws a direction whose density is in proportion to radiance x cosine to the plane of
    /// `entry`.
    pub fn sample_entry(&self, entry: &SunsEntry, rng: &mut Stream) -> DVec3 {
        let sun = weighted_choice(&entry.running, rng.uniform_fine()).index;
        let toward = self.suns[sun].toward;
        if self.is_parallel() {
            return toward;
        }
        loop {
            let drawn = self.sample_disc(toward, entry.normal, rng);
            if entry.hillside.is_none_or(|hillside| drawn.dot(hillside) > 0.0) {
                return drawn;
            }
        }
    }

    /// Draws a direction of the disc around `toward` with a density in proportion to the cosine to
    /// `normal`.
    fn sample_disc(&self, toward: DVec3, normal: DVec3, rng: &mut Stream) -> DVec3 {
        // work on the projection of the disc along its axis, with x towards the plane's normal
        let cos = toward.dot(normal);
        let aside = normal - cos * toward;
        let sin = aside.length();
        let x = aside.try_normalize().unwrap_or_else(|| toward.any_orthonormal_vector());
        let y = toward.cross(x);
        let (radius, height) = self.half_angle.sin_cos();
        // the plane's horizon cuts off the part of the disc below `first`
        let cut = -cos / sin.max(f64::MIN_POSITIVE);
        let first = if cos < 0.0 { cut * height } else { cut.max(-radius) };
        let side =
            if first > 0.0 { (radius * radius - first * first).max(0.0).sqrt() } else { radius };
        let most = cos + sin * radius / height;
        loop {
            let Vec2 { x: u, y: v } = rng.square();
            let u = first + f64::from(u) * (radius - first);
            let v = side * (2.0 * f64::from(v) - 1.0);
            let z2 = 1.0 - u * u - v * v;
            if u * u + v * v > radius * radius {
                continue;
            }
            // solid angle per area of the projection is 1 / the cosine to the axis
            let z = z2.sqrt();
            if f64::from(rng.uniform()) * most < cos + sin * u / z {
                return u * x + v * y + z * toward;
            }
        }
    }
}

fn to_world(axis: DVec3, local: DVec3) -> DVec3 {
    let frame = Frame::new(axis.as_vec3().normalize());
    let (x, y) = (frame.tangent.as_dvec3(), frame.bitangent.as_dvec3());
    (local.x * x + local.y * y + local.z * axis).normalize()
}

/// Returns the irradiance on a plane from a disc of uniform radiance and half angle `t`, over the
/// irradiance on a plane across the disc's direction. `cos` is the cosine of the disc's middle to
/// the plane's normal. The result is this cosine, unless the plane's horizon cuts the disc (Snyder,
/// Area light sources for real-time graphics, MSR-TR-96-11).
fn disc_cosine(cos: f64, t: f64) -> f64 {
    let (sin_t, cos_t) = t.sin_cos();
    if cos >= sin_t || t == 0.0 {
        return cos.max(0.0);
    }
    if cos <= -sin_t {
        return 0.0;
    }
    let sin = (1.0 - cos * cos).sqrt();
    // angle about the disc's middle at which the horizon cuts its rim: a quarter turn if cos is 0
    let turn = (-cos * cos_t / (sin * sin_t)).clamp(-1.0, 1.0).acos();
    let chord = (sin_t * sin_t - cos * cos).max(0.0).sqrt();
    // the integral of the cosine over the part above the horizon, from its border (Lambert): an arc
    // of the rim and an arc of a great circle
    let arc = cos * sin_t * sin_t * turn - cos_t * chord;
    let great_circle = (chord / cos_t).atan();
    ((arc + great_circle) / (PI * sin_t * sin_t)).max(0.0)
}
