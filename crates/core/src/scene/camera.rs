//! The camera: turns pixels into rays, and points into pixels.

use glam::{DVec3, Vec3};

use crate::math::geometry::{Extent, Ray, unit_vector};

/// A view as the user asks for it, in metres from the user's origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Position of the camera.
    pub position: DVec3,
    /// The point that the middle of the picture shows; it differs from the position.
    pub look_at: DVec3,
    /// The direction that is up in the picture; it must not be along the view.
    pub up: DVec3,
    /// Angle of view across the picture, degrees, in (0, 180).
    pub fov_deg: f64,
    /// Pixels across, at least 1.
    pub width: usize,
    /// Pixels down, at least 1.
    pub height: usize,
}

/// Half of a picture relative to half of what a chosen view fills of it.
const MARGIN: f64 = 1.06;

impl View {
    /// Default angle of view, degrees.
    pub const FOV_DEG: f64 = 45.0;
    /// Default number of pixels across and down.
    pub const SIZE: (usize, usize) = (800, 600);
    /// Limit on the number of pixels across, and down.
    pub const MOST_PIXELS: u64 = 65_536;

    /// Chooses a view of everything inside `extent`, m from `center`, seen from the front, the left
    /// and above. The box fills the width or the height of the picture but for a small margin, and
    /// lies in its middle. `size` is in pixels, (across, down); `fov_deg` is the angle of view across,
    /// degrees, in (0, 180).
    pub fn of(
        extent: &Extent,
        center: DVec3,
        (width, height): (usize, usize),
        fov_deg: f64,
    ) -> Self {
        let away = DVec3::new(-0.45, -0.75, 0.5).normalize();
        let right = DVec3::Z.cross(away).normalize();
        let axes = [right, away.cross(right)];
        let half_across = (fov_deg / 2.0).to_radians().tan();
        let slopes = [half_across, half_across * height as f64 / width as f64];
        let half = (0.5 * extent.size().as_dvec3()).max(DVec3::splat(1e-6));
        let corners = [-1.0, 1.0].into_iter().flat_map(|x| {
            let signs = [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)];
            signs.map(|(y, z)| half * DVec3::new(x, y, z))
        });
        let corners: Vec<DVec3> = corners.collect();
        // A corner c is inside if |c . axis - e . axis| is at most slope (e . away - c . away), for
        // an eye at e. The planes through the outermost corners on either side of an axis meet at
        // the nearest eye, whose place along the axis is half way between them.
        let (mut aside, mut distance) = (DVec3::ZERO, 0.0f64);
        for (axis, slope) in axes.into_iter().zip(slopes) {
            let slope = slope / MARGIN;
            let least = |sign: f64| {
                let reach = |c: &DVec3| sign * c.dot(axis) + slope * c.dot(away);
                corners.iter().map(reach).fold(f64::NEG_INFINITY, f64::max)
            };
            let [low, high] = [least(-1.0), least(1.0)];
            aside += 0.5 * (high - low) * axis;
            distance = distance.max(0.5 * (high + low) / slope);
        }
        let look_at = center + extent.center().as_dvec3() + aside;
        let position = look_at + distance * away;
        Self { position, look_at, up: DVec3::Z, fov_deg, width, height }
    }

    /// Checks the directions. Error: `look_at` is the position, or the view is along `up`.
    pub fn check_directions(&self) -> Result<(), String> {
        let look = unit_vector(self.look_at - self.position);
        if look.zip(unit_vector(self.up)).is_none_or(|(l, up)| l.cross(up).length() < 1e-9) {
            return Err("`look_at` is the position itself, or straight along `up`".into());
        }
        Ok(())
    }

    /// Returns an angle of view, degrees, if it is valid. Error: it is not in (0, 180).
    pub fn check_fov(fov: f64) -> Result<f64, String> {
        if fov > 0.0 && fov < 180.0 {
            return Ok(fov);
        }
        Err(format!("{}, must be between 0 and 180", crate::error::number(fov)))
    }
}

/// A view prepared for rays, relative to the centre of a scene.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    /// Position of the camera, m.
    pub position: Vec3,
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    forward: Vec3,
    /// Step from one pixel to the next to the right, on the plane at distance 1; `down` is the step
    /// downwards.
    right: Vec3,
    down: Vec3,
}

impl Camera {
    /// Prepares a view with valid directions, relative to `center`.
    pub fn new(view: &View, center: DVec3) -> Self {
        let forward = unit_vector(view.look_at - view.position).unwrap_or(DVec3::Y);
        let right = unit_vector(forward.cross(view.up)).unwrap_or(DVec3::X);
        let pixel = 2.0 * (view.fov_deg.to_radians() / 2.0).tan() / view.width as f64;
        Self {
            position: (view.position - center).as_vec3(),
            width: view.width,
            height: view.height,
            forward: forward.as_vec3(),
            right: (pixel * right).as_vec3(),
            down: (pixel * forward.cross(right)).as_vec3(),
        }
    }

    /// Returns the ray through a point of the picture, given in pixels from its upper left corner.
    pub fn ray(&self, x: f32, y: f32) -> Ray {
        let (x, y) = (x - 0.5 * self.width as f32, y - 0.5 * self.height as f32);
        let direction = (self.forward + x * self.right + y * self.down).normalize();
        Ray { origin: self.position, direction }
    }

    /// Returns the position of a point in the picture, in pixels from its upper left corner; `None`
    /// behind the camera.
    pub fn project(&self, point: Vec3) -> Option<[f32; 2]> {
        let from = point - self.position;
        let depth = from.dot(self.forward);
        (depth > 0.0).then(|| {
            let along = |axis: Vec3| from.dot(axis) / (depth * axis.length_squared());
            [
                along(self.right) + 0.5 * self.width as f32,
                along(self.down) + 0.5 * self.height as f32,
            ]
        })
    }

    /// Returns the viewing direction, a unit vector.
    pub fn forward(&self) -> Vec3 {
        self.forward
    }

    /// Returns the angle across a pixel in the middle of the picture, rad.
    pub fn pixel(&self) -> f32 {
        self.right.length()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const VIEW: View = View {
        position: DVec3::new(1.0, 2.0, 3.0),
        look_at: DVec3::new(1.0, 5.0, 3.0),
        up: DVec3::Z,
        fov_deg: 90.0,
        width: 400,
        height: 200,
    };

    /// A point north of the camera is in the middle, east is right, up is up; the angle of view is
    /// that across the picture.
    #[test]
    fn rays_go_where_the_view_says() {
        let camera = Camera::new(&VIEW, DVec3::new(1.0, 0.0, 0.0));
        assert_eq!(camera.position, Vec3::new(0.0, 2.0, 3.0));
        let near = |a: Vec3, b: Vec3| assert!(a.distance(b) < 1e-6, "{a} {b}");
        near(camera.ray(200.0, 100.0).direction, Vec3::Y);
        near(camera.ray(400.0, 100.0).direction, Vec3::new(1.0, 1.0, 0.0).normalize());
        near(camera.ray(200.0, 0.0).direction, Vec3::new(0.0, 1.0, 0.5).normalize());
    }

    #[test]
    fn a_point_is_where_its_ray_goes() {
        let camera = Camera::new(&VIEW, DVec3::ZERO);
        let ray = camera.ray(37.25, 150.5);
        let [x, y] = camera.project(ray.at(2.5)).expect("in front");
        assert!((x - 37.25).abs() < 1e-3 && (y - 150.5).abs() < 1e-3, "{x} {y}");
        assert_eq!(camera.project(ray.at(-1.0)), None);
    }

    /// A view chosen for a box shows all of it, in wide pictures and in tall ones, and the box fills
    /// the width or the height but for a margin, which is the same on both sides.
    #[test]
    fn a_chosen_view_is_filled_by_all() {
        let boxes = [[3.0, 1.0, 0.5], [0.0, 9.0, 9.0], [30.0, -1.9, 0.1], [-0.9, -1.9, 4.0]];
        let sizes = [(800, 600), (300, 900), (900, 100)];
        for (size, max) in sizes.into_iter().flat_map(|size| boxes.map(|max| (size, max))) {
            let extent = Extent { min: Vec3::new(-1.0, -2.0, 0.0), max: Vec3::from(max) };
            let view = View::of(&extent, DVec3::splat(7.0), size, 37.0);
            assert_eq!(view.check_directions(), Ok(()));
            let camera = Camera::new(&view, DVec3::splat(7.0));
            let (mut low, mut high) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
            for corner in 0..8 {
                let pick = |axis: usize| [extent.min, extent.max][corner >> axis & 1][axis];
                let point = Vec3::new(pick(0), pick(1), pick(2));
                let place = camera.project(point).expect("in front");
                for (axis, side) in [size.0, size.1].into_iter().enumerate() {
                    let share = place[axis] / side as f32;
                    (low[axis], high[axis]) = (low[axis].min(share), high[axis].max(share));
                }
            }
            let all = format!("{low:?} to {high:?} of {size:?}, {max:?}");
            assert!((0..2).all(|axis| low[axis] > 0.02 && high[axis] < 0.98), "{all}");
            assert!((0..2).any(|axis| high[axis] - low[axis] > 0.93), "{all}");
            for axis in 0..2 {
                assert!((low[axis] + high[axis] - 1.0).abs() < 0.12, "{all}");
            }
        }
    }
}
