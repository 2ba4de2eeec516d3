//! The hash of a scene: equal for equal surfaces, materials, lights and captors, wherever they come
//! from.

use std::fmt::{self, Write};

use sha2::{Digest, Sha256};

use super::{Scene, Surface, contents::Head};
use crate::math::geometry::Triangle;

/// A writer that hashes everything written to it.
struct Hashing(Sha256);

impl Write for Hashing {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0.update(text);
        Ok(())
    }
}

impl Scene {
    /// Returns a SHA-256, as 64 hexadecimal digits, of everything that the numbers and names of a
    /// result depend on: shapes, materials, lights, captors, bands. Within one version of phylux
    /// the same scene has the same hash, whether it comes from a file or from memory and however it
    /// was written. Title and camera are not part of it.
    pub fn digest(&self) -> String {
        let mut hash = Hashing(Sha256::new());
        let Self { head, materials, captors, groups, .. } = self;
        let (Head { quantity, bands, sums, .. }, lights) = (head, &self.lighting.lights);
        let (center, radius) = (self.place.center, self.place.radius);
        // the error can be ignored: this writer never fails
        let _ = write!(hash, "{:?}", (quantity, bands, sums, materials, lights, captors, groups));
        if !self.head.ratios.is_empty() {
            let _ = write!(hash, "{:?}", self.head.ratios);
        }
        if !self.parameters.all().is_empty() {
            let _ = write!(hash, "{:?}", self.parameters.all());
        }
        let _ = write!(hash, "{}", self.asked.in_digest());
        if !self.lighting.watts.is_empty() {
            let _ = write!(hash, "{:?}", self.lighting.watts);
        }
        let _ = write!(hash, "{center:?} {radius:?} {:?}", self.head.period_h.is_some());
        // of periods the daily light integrals know all that is more than a day
        if let Some(hours) = self.head.period_h.filter(|hours| *hours < 24.0) {
            let _ = write!(hash, " {hours:?}");
        }
        if self.place.stand.channels() > 0 {
            let _ = write!(hash, " {:?}", self.place.stand);
        }
        if let Some(lattice) = self.lattice() {
            let _ = write!(hash, " {lattice:?}");
        }
        hash.surfaces(&self.shapes.triangles, &self.objects.surfaces);
        let placed = &self.shapes.placed;
        for (prototype, common) in placed.prototypes.iter().zip(&self.objects.common) {
            hash.surfaces(&prototype.triangles, &common.surfaces);
            let _ = write!(hash, " {} {}", common.first_captor, common.captors);
        }
        if !placed.instances.is_empty() {
            let _ = write!(hash, " {:?}", placed.instances);
        }
        self.captor_triangles().iter().for_each(|triangle| hash.triangle(triangle));
        hash.0.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }
}

impl Hashing {
    fn surfaces(&mut self, triangles: &[Triangle], surfaces: &[Surface]) {
        for (triangle, surface) in triangles.iter().zip(surfaces) {
            self.0.update(surface.material.to_le_bytes());
            self.0.update(surface.captor.to_le_bytes());
            self.triangle(triangle);
        }
    }

    fn triangle(&mut self, triangle: &Triangle) {
        for corner in [triangle.a, triangle.b, triangle.c] {
            corner.to_array().iter().for_each(|number| self.0.update(number.to_le_bytes()));
        }
    }
}
