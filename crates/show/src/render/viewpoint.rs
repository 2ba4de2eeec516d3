//! Which surfaces and captors of a scene are visible from a viewpoint.

use glam::{DVec3, Vec3};

use phylux_core::{
    error::{Error, Result},
    math::geometry::{Extent, ROUNDING, Ray, closeness},
    scene::{
        camera::{Camera, View},
        lattice::{Cell, Lattice, Period},
        material::Scatterer,
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
    /// Whether each triangle is cut away; empty where none is.
    cut: Vec<bool>,
}

/// The first thing along a ray that is visible.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FirstVisible {
    /// Nothing.
    Nothing,
    /// A surface or a captor.
    Thing {
        /// Cosine of the angle between the ray and the normal, in [0, 1].
        cos: f32,
        /// Index of the captor, if the thing is one.
        captor: Option<usize>,
        /// Whether the ray meets the front.
        front: bool,
    },
}

/// The least area of a smooth piece of surface that may be cut away, as a fraction of the
/// cross-section of the ball around all surfaces.
const LARGE: f64 = 0.02;
/// A surface whose normal has a greater z than this, up or down, lies: things stand on it.
const LYING: f32 = 0.7;
/// A lying surface is the roof if it reaches to within this fraction of the scene's height from the
/// top.
const TOPMOST: f32 = 0.1;
/// Captors that take up less than this fraction of the scene are looked at, with at least this
/// fraction of each side of it around them.
const PART: f32 = 0.25;
/// A scene that repeats is seen from such a distance, in its longest period or its height, from
/// above by these fractions of its height and of the distance, and downwards by this slope.
const AWAY: f32 = 2.5;
const ABOVE: [f32; 2] = [0.5, 0.25];
const DOWN: f32 = 0.26;
/// The direction of such a view along and across the rows, which follow the shorter period.
const OBLIQUE: [f32; 2] = [0.85, 0.53];
/// Where at least this fraction of such a scene lies below a roof, or below panels, with air of more
/// than that fraction of its height between them and what stands below, it is seen from within: from
/// so far up in the air below a roof, or beside panels, and downwards by this slope.
const COVERED: f32 = 0.2;
const AIR: f32 = 0.35;
const UP: f32 = 0.45;
const UP_BESIDE: f32 = 0.7;
const DOWN_INSIDE: f32 = 0.16;
/// The direction of the view beside panels, along and across their rows.
const BESIDE: [f32; 2] = [0.94, 0.34];
/// Number of rays along each side of a cell that look for what is above others.
const LOOKS: usize = 16;
/// The largest distance of a viewpoint from the centre of the scene, in radii of the scene.
const FARTHEST: f64 = 1e4;

impl<'a> Viewpoint<'a> {
    /// Places the camera of a view in a scene. Error: the camera is so far away that single
    /// precision would not do.
    pub fn new(scene: &'a Scene, view: &View) -> Result<Self> {
        let distance = view.position.distance(scene.center());
        let farthest = FARTHEST * f64::from(scene.radius());
        if distance > farthest {
            let problem = format!(
                "its position is {distance:.3e} m from the middle of the scene, must be within {farthest:.3e} m"
            );
            return Err(Error::input("camera", problem)
                .remedy("bring it nearer (coordinates are in the scene's unit)"));
        }
        Ok(Self { scene, camera: Camera::new(view, scene.center()), cut: Vec::new() })
    }

    /// Chooses a view that shows all surfaces of the scene from outside or, where the captors are
    /// only a small part of it, these and what is around them, in a picture of `size` (width,
    /// height) pixels that is `fov_deg` degrees wide. Error: the scene has no surface to see.
    pub fn choose_view(scene: &Scene, size: (usize, usize), fov_deg: f64) -> Result<View> {
        if scene.triangles().is_empty() {
            let place = format!("scene {}", scene.name());
            return Err(Error::input(place, "it has no surface, so there is nothing to see")
                .remedy("add an object, or give a camera to look at its lamps"));
        }
        let all = scene.triangles().extent();
        if let Some(lattice) = scene.lattice() {
            return Ok(along_rows(scene, lattice, size, fov_deg));
        }
        let triangles = (0..scene.triangles().len())
            .filter(|&triangle| scene.surface(triangle).captor().is_some())
            .map(|triangle| scene.triangles().at(triangle));
        let captors = Extent::of_triangles(triangles).join(scene.captors_extent());
        let is_part = (0.0..PART * all.size().length()).contains(&captors.size().length());
        if !is_part || captors.size() == Vec3::ZERO {
            return Ok(View::of(&all, scene.center(), size, fov_deg));
        }
        let (middle, half) = (captors.center(), 0.5 * captors.size().max(PART * all.size()));
        let around = Extent { min: middle - half, max: middle + half };
        Ok(View::of(&around, scene.center(), size, fov_deg))
    }

    /// Returns the same viewpoint, but without the large surfaces whose plane lies between the
    /// camera and the middle of all surfaces: so a viewpoint outside a closed room sees into it.
    /// Copies that share their triangles stay, and so does a scene that repeats. Of surfaces that
    /// lie only the topmost are left out, as the floors of a rack carry something.
    pub fn cut_open(mut self) -> Self {
        let scene = self.scene;
        if scene.lattice().is_some() {
            return self;
        }
        let extent = scene.triangles().extent();
        let patches = Patches::new(scene);
        let (middle, from) = (extent.center(), self.camera.position);
        let radius = f64::from(0.5 * extent.size().length());
        let large = LARGE * std::f64::consts::PI * radius * radius;
        let mut tops = vec![f32::NEG_INFINITY; patches.unshared()];
        for triangle in 0..scene.unshared() {
            let corners = scene.triangles().at(triangle);
            let top = &mut tops[patches.of(triangle)];
            *top = top.max(corners.a.z).max(corners.b.z).max(corners.c.z);
        }
        let roof = extent.max.z - TOPMOST * extent.size().z;
        let parts = |triangle: usize| {
            let (corner, normal) =
                (scene.triangles().at(triangle).a, scene.surface(triangle).normal);
            let side = |point: Vec3| (point - corner).dot(normal);
            let patch = patches.of(triangle);
            side(from) * side(middle) < 0.0
                && patches.area(patch) >= large
                && (normal.z.abs() < LYING || tops[patch] >= roof)
        };
        self.cut = (0..scene.unshared()).map(parts).collect();
        self
    }

    /// Returns the first surface along a ray from the viewpoint, apart from those cut away.
    pub fn closest(&self, ray: &Ray) -> Option<SurfaceHit> {
        self.first(ray, |_| true)
    }

    /// Returns the first surface along a ray that cannot be seen through, apart from those cut
    /// away. The ray goes straight through glass and water, as if they did not bend light.
    pub fn opaque(&self, ray: &Ray) -> Option<SurfaceHit> {
        self.first(ray, |is_clear| !is_clear)
    }

    /// Returns the first surface that is `wanted`, by whether one can see through it.
    fn first(&self, ray: &Ray, wanted: impl Fn(bool) -> bool) -> Option<SurfaceHit> {
        let mut first = None;
        self.each_surface(ray, |hit, is_clear| {
            first = wanted(is_clear).then_some(*hit);
            first.is_none()
        });
        first
    }

    /// Returns the first opaque surface along a ray; virtual captors are left out.
    pub fn surface(&self, ray: &Ray) -> FirstVisible {
        self.opaque(ray).map_or(FirstVisible::Nothing, |hit| self.at(ray, &hit))
    }

    fn at(&self, ray: &Ray, hit: &SurfaceHit) -> FirstVisible {
        let surface = &self.scene.surface(hit.triangle);
        let dot = ray.direction.dot(surface.normal);
        FirstVisible::Thing { cos: dot.abs(), captor: surface.captor(), front: dot < 0.0 }
    }

    /// Returns the first opaque surface or virtual captor along a ray.
    pub fn first_visible(&self, ray: &Ray) -> FirstVisible {
        self.first_visible_in_cell(ray).0
    }

    /// Returns the same and, in a scene that repeats, of which cell a virtual captor is the image.
    pub(super) fn first_visible_in_cell(&self, ray: &Ray) -> (FirstVisible, Cell) {
        let hit = self.opaque(ray);
        let mut nearest = hit.map_or(f32::INFINITY, |hit| hit.t);
        let mut visible = hit.map_or(FirstVisible::Nothing, |hit| self.at(ray, &hit));
        let mut cell = [0, 0];
        let lattice = self.scene.lattice();
        // a captor that lies in a surface is seen in front of it
        let limit = nearest * (1.0 + 4.0 * ROUNDING) + 2.0 * self.scene.highest_lift();
        self.scene.crossings(ray, limit, |crossing| {
            let t = match lattice {
                Some(_) => crossing.t,
                None => (crossing.point - ray.origin).dot(ray.direction),
            };
            let t = t * (1.0 - 2.0 * ROUNDING) - 2.0 * self.scene.lift(crossing.captor);
            if t < nearest {
                nearest = t;
                let normal = self.scene.crossed_normal(&crossing);
                let cos = ray.direction.dot(normal).abs();
                visible = FirstVisible::Thing {
                    cos,
                    captor: Some(crossing.captor),
                    front: crossing.front,
                };
                // the point is where the scene describes it
                let away = ray.origin + crossing.t * ray.direction - crossing.point;
                let periods = |axis| lattice.and_then(|lattice| lattice.period(axis));
                cell = [0, 1].map(|axis| {
                    let period = |p: Period| (f64::from(away[axis]) / p.length).round() as i32;
                    periods(axis).map_or(0, period)
                });
            }
        });
        (visible, cell)
    }

    /// Returns the number of opaque surfaces between the viewpoint and a point, at most `most`,
    /// apart from those cut away. The line of sight goes straight through glass and water.
    pub fn in_front_of(&self, point: Vec3, most: usize) -> usize {
        let towards = point - self.camera.position;
        let distance = towards.length();
        let Some(direction) = towards.try_normalize() else { return 0 };
        let end = distance * (1.0 - 1e-4) - closeness(point);
        let mut count = 0;
        self.each_surface(&Ray { origin: self.camera.position, direction }, |hit, is_clear| {
            count += usize::from(!is_clear && hit.t < end);
            hit.t < end && count < most
        });
        count
    }

    /// Visits the surfaces along a ray from the viewpoint, apart from those cut away, with whether
    /// one can see through them, as long as `visit` returns true. The ray goes straight on.
    pub fn each_surface(&self, ray: &Ray, mut visit: impl FnMut(&SurfaceHit, bool) -> bool) {
        let (mut ray, mut travelled) = (*ray, 0.0);
        while let Some(hit) = self.scene.closest(&ray) {
            let t = travelled + hit.t;
            let is_clear = self.scene.material(&self.scene.surface(hit.triangle)).is_clear();
            if !self.is_cut(hit.triangle) && !visit(&SurfaceHit { t, ..hit }, is_clear) {
                return;
            }
            ray = self.scene.pass(&hit, ray.direction);
            travelled = t;
        }
    }

    /// Returns whether a triangle is cut away.
    pub fn is_cut(&self, triangle: usize) -> bool {
        self.cut.get(triangle).is_some_and(|cut| *cut)
    }
}

/// Returns a view along the rows of a scene that repeats: from above or, where much of it is
/// covered, from below a roof or beside panels.
fn along_rows(
    scene: &Scene,
    lattice: &Lattice,
    (width, height): (usize, usize),
    fov_deg: f64,
) -> View {
    let extent = scene.triangles().extent();
    let sides = [0, 1].map(|axis| match lattice.period(axis) {
        Some(period) => [period.from as f32, period.length as f32],
        None => [extent.min[axis], extent.size()[axis]],
    });
    let [[x, along_x], [y, along_y]] = sides;
    let tall = extent.size().z;
    let distance = AWAY * along_x.max(along_y).max(1.5 * tall);
    let ahead = |[along, across]: [f32; 2]| match along_y <= along_x {
        true => Vec3::new(across, along, 0.0),
        false => Vec3::new(along, across, 0.0),
    };
    let middle = Vec3::new(x + 0.5 * along_x, y + 0.5 * along_y, extent.center().z);
    let (eye, ahead, down) = match in_free_air(scene, &extent, sides) {
        Some((eye, true)) => (middle.with_z(eye.z), ahead(OBLIQUE), DOWN_INSIDE),
        Some((eye, false)) => (eye, ahead(BESIDE), DOWN_INSIDE),
        None => {
            let z = extent.max.z + ABOVE[0] * tall + ABOVE[1] * distance;
            ((middle - distance * ahead(OBLIQUE)).with_z(z), ahead(OBLIQUE), DOWN)
        }
    };
    let (position, look_at) = (eye, eye + ahead - down * Vec3::Z);
    let [position, look_at] = [position, look_at].map(|p| scene.center() + p.as_dvec3());
    View { position, look_at, up: DVec3::Z, fov_deg, width, height }
}

/// Returns a place in the air below a roof or beside panels, m from the centre of the scene, and
/// whether a roof is everywhere; `None` where little is covered, or without room below it.
fn in_free_air(scene: &Scene, extent: &Extent, sides: [[f32; 2]; 2]) -> Option<(Vec3, bool)> {
    let tall = extent.size().z;
    let place = |index: usize| {
        let at =
            |[from, length]: [f32; 2], i: usize| from + length * (i as f32 + 0.5) / LOOKS as f32;
        Vec3::new(
            at(sides[0], index % LOOKS),
            at(sides[1], index / LOOKS),
            extent.max.z + 0.1 * tall,
        )
    };
    let columns: Vec<Vec<f32>> = (0..LOOKS * LOOKS).map(|i| heights(scene, place(i))).collect();
    let mut all: Vec<f32> = columns.iter().flatten().copied().chain([extent.min.z]).collect();
    all.sort_unstable_by(f32::total_cmp);
    let air = |pair: &&[f32]| pair[1] - pair[0];
    let widest = all.windows(2).max_by(|a, b| air(a).total_cmp(&air(b)))?;
    let [low, cover] = [widest[0], widest[1]];
    // lamps may hang below a roof
    let lamps = scene.lights().iter().filter(|light| light.entrance().is_none());
    let lowest = lamps.map(|lamp| lamp.extent().min.z).filter(|z| *z > low);
    let high = lowest.fold(cover, f32::min);
    let is_covered: Vec<bool> =
        columns.iter().map(|column| column.iter().any(|z| *z >= cover)).collect();
    let covered = is_covered.iter().filter(|covered| **covered).count() as f32;
    if cover - low < AIR * tall || covered < COVERED * is_covered.len() as f32 {
        return None;
    }
    let at = |index: usize, up: f32| place(index).with_z(low + up * (high - low));
    match farthest_from(&is_covered) {
        // what is measured may also stand on what covers the ground, as on a bench
        Some(open) => is_measured_below(scene, cover).then(|| (at(open, UP_BESIDE), false)),
        None => Some((at(0, UP), true)),
    }
}

/// Returns whether most captors lie below a height, m from the centre of the scene.
fn is_measured_below(scene: &Scene, height: f32) -> bool {
    let height = scene.center().z + f64::from(height);
    let below = scene.captors().iter().filter(|captor| captor.center.z < height).count();
    2 * below > scene.captors().len()
}

/// Returns the heights of all surfaces straight below a place, m from the centre of the scene.
fn heights(scene: &Scene, from: Vec3) -> Vec<f32> {
    let mut ray = Ray { origin: from, direction: -Vec3::Z };
    let mut heights = Vec::new();
    while let Some(hit) = scene.closest(&ray) {
        heights.push(hit.point.z);
        ray = scene.pass(&hit, ray.direction);
    }
    heights
}

/// Returns the place of a square of places, that repeats, which is farthest from those that are
/// covered; `None` if all are.
fn farthest_from(is_covered: &[bool]) -> Option<usize> {
    let away = |a: usize, b: usize| {
        let apart = |i: usize, j: usize| i.abs_diff(j).min(LOOKS - i.abs_diff(j));
        apart(a % LOOKS, b % LOOKS).pow(2) + apart(a / LOOKS, b / LOOKS).pow(2)
    };
    let places = || 0..is_covered.len();
    let room = |place: usize| places().filter(|i| is_covered[*i]).map(|i| away(place, i)).min();
    places().filter(|place| !is_covered[*place]).max_by_key(|place| room(*place))
}
