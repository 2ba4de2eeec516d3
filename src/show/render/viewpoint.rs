//! What a viewpoint sees of a scene's shapes.

use glam::Vec3;

use crate::{
    error::{Error, Result},
    math::geometry::{Extent, Ray},
    scene::{
        camera::{Camera, View},
        patches::Patches,
        world::{Scene, SurfaceHit},
    },
};

/// A camera in a scene.
pub struct Viewpoint<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The camera.
    pub camera: Camera,
    /// Which triangles are cut away; empty for none.
    cut: Vec<bool>,
}

/// What is first in a ray's way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FirstVisible {
    /// Nothing.
    Nothing,
    /// A surface or a captor.
    Thing {
        /// Cosine of the angle that it is seen at.
        cos: f32,
        /// Index of the captor that it is, if it is one.
        captor: Option<usize>,
        /// Whether its front is seen.
        front: bool,
    },
}

/// Share of the scene's largest cross-section from which on a piece of surface may be cut away.
const LARGE: f64 = 0.02;
/// How far a viewpoint may be from the middle of a scene, in its radii.
const FARTHEST: f64 = 1e4;

impl<'a> Viewpoint<'a> {
    /// Of a view. Error: it is so far away that single precision would not do.
    pub fn new(scene: &'a Scene, view: &View) -> Result<Self> {
        let distance = view.position.distance(scene.center);
        let farthest = FARTHEST * f64::from(scene.radius);
        if distance > farthest {
            let problem = format!(
                "its position is {distance:.3e} m from the middle of the scene, must be within {farthest:.3e} m"
            );
            return Err(Error::input("camera", problem)
                .remedy("bring it nearer (coordinates are in the scene's unit)"));
        }
        Ok(Self { scene, camera: Camera::new(view, scene.center), cut: Vec::new() })
    }

    /// A view chosen for the scene: of all surfaces, from outside. Error: there is no surface to see.
    pub fn choose_view(scene: &Scene, size: (usize, usize)) -> Result<View> {
        if scene.triangles().is_empty() {
            let place = format!("scene {}", scene.name);
            return Err(Error::input(place, "it has no surface, so there is nothing to see")
                .remedy("add an object, or give a camera to look at its lamps"));
        }
        Ok(View::of(&Extent::of_triangles(scene.triangles()), scene.center, size))
    }

    /// The same, but large surfaces whose plane parts it from the middle of the scene are not seen: for an
    /// viewpoint outside a closed room.
    pub fn cut_open(mut self) -> Self {
        let scene = self.scene;
        let extent = Extent::of_triangles(scene.triangles());
        let patches = Patches::new(scene);
        let (middle, from) = (extent.center(), self.camera.position);
        let radius = f64::from(0.5 * extent.size().length());
        let large = LARGE * std::f64::consts::PI * radius * radius;
        let parts = |triangle: usize| {
            let (corner, normal) = (scene.triangles()[triangle].a, scene.surface(triangle).normal);
            let side = |point: Vec3| (point - corner).dot(normal);
            side(from) * side(middle) < 0.0 && patches.area(patches.of(triangle)) >= large
        };
        self.cut = (0..scene.triangles().len()).map(parts).collect();
        self
    }

    /// The first surface in the way of a ray from the viewpoint.
    pub fn closest(&self, ray: &Ray) -> Option<SurfaceHit> {
        self.first(ray, |_| false)
    }

    /// The first surface that cannot be seen through, as if glass and water did not bend light.
    pub fn opaque(&self, ray: &Ray) -> Option<SurfaceHit> {
        self.first(ray, |triangle| self.scene.material(self.scene.surface(triangle)).is_clear())
    }

    /// The first surface that is neither cut away nor `passed`.
    fn first(&self, ray: &Ray, passed: impl Fn(usize) -> bool) -> Option<SurfaceHit> {
        let (mut ray, mut travelled) = (*ray, 0.0);
        loop {
            let hit = self.scene.closest(&ray)?;
            let t = travelled + hit.t;
            let cut = self.cut.get(hit.triangle).is_some_and(|cut| *cut);
            if !cut && !passed(hit.triangle) {
                return Some(SurfaceHit { t, ..hit });
            }
            let normal = self.scene.surface(hit.triangle).normal;
            let side = normal * normal.dot(ray.direction).signum();
            ray = self.scene.leave(hit.point, side, ray.direction);
            travelled = t;
        }
    }

    /// The surface that a ray meets first.
    pub fn surface(&self, ray: &Ray) -> FirstVisible {
        self.opaque(ray).map_or(FirstVisible::Nothing, |hit| self.at(ray, &hit))
    }

    fn at(&self, ray: &Ray, hit: &SurfaceHit) -> FirstVisible {
        let surface = self.scene.surface(hit.triangle);
        let dot = ray.direction.dot(surface.normal);
        FirstVisible::Thing { cos: dot.abs(), captor: surface.captor(), front: dot < 0.0 }
    }

    /// What a ray meets first, virtual captors too.
    pub fn first_visible(&self, ray: &Ray) -> FirstVisible {
        let hit = self.opaque(ray);
        let mut nearest = hit.map_or(f32::INFINITY, |hit| hit.t);
        let mut visible = hit.map_or(FirstVisible::Nothing, |hit| self.at(ray, &hit));
        // a captor in a surface is seen before it
        let limit = nearest + 4.0 * self.scene.ray_offset();
        self.scene.crossings(ray, limit, |crossing| {
            let t = (crossing.point - ray.origin).dot(ray.direction);
            let t = t - 4.0 * self.scene.ray_offset();
            if t < nearest {
                nearest = t;
                let normal = self.scene.captor_triangles()[crossing.triangle].normal();
                let cos = ray.direction.dot(normal).abs();
                visible = FirstVisible::Thing {
                    cos,
                    captor: Some(crossing.captor),
                    front: crossing.front,
                };
            }
        });
        visible
    }

    /// Whether nothing is in the way of a point.
    pub fn sees(&self, point: Vec3) -> bool {
        let towards = point - self.camera.position;
        let distance = towards.length();
        let Some(direction) = towards.try_normalize() else { return false };
        let hit = self.opaque(&Ray { origin: self.camera.position, direction });
        hit.is_none_or(|hit| hit.t >= distance * (1.0 - 1e-4) - 4.0 * self.scene.ray_offset())
    }
}
