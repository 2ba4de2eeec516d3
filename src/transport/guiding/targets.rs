//! The virtual captors as targets of aimed flights: which of them a point, or a beam from
//! infinitely far away, sees well, and where they are.
//!
//! A captor is also a target where a flat pane or mirror shows it: the flight is aimed at its mirror
//! image, and the pane sends it to the captor. Without such flights the little light that comes to a
//! small captor by way of a window pane would rest on single photons, each of which brings far more
//! than all flights that are aimed.

use std::f32::consts::PI;

use glam::Vec3;

use crate::{
    math::{
        geometry::{Extent, Frame, Ray, Triangle},
        rng::Stream,
        sampling::{uniform_circle, uniform_cone},
    },
    scene::{
        captor::{Captor, CaptorKind, Moments},
        material::Material,
        world::{MirrorPlane, Scene},
    },
};

/// The shape at which flights are aimed is larger than the captor by this factor, so that rounding
/// does not make them miss its rim.
const MARGIN: f32 = 1.02;
/// In scenes with solid glass, which shifts rays, some flights aim at a shape up to this many times
/// as large as the captor.
const WIDE: f32 = 4.0;
/// The fraction of the flights that do so. More of these flights pass close to the captor's rim
/// than far from it, so that a flight that only the shift brings onto the captor counts a few times
/// as much as others, and not 50 times as much.
const WIDE_SHARE: f32 = 0.4;
/// The largest number of captors that are compared one by one. More captors are cut into halves,
/// which are compared first.
const GROUP: usize = 128;
/// The largest number of captors against which a ray is tested without a ball around some of them.
const LEAF: usize = 8;
/// A captor is flat if its corners are off their mean plane by less than this fraction of its size.
const FLAT: f32 = 0.02;
/// The largest number of mirror images of captors at which flights are aimed, and of the planes of
/// panes and mirrors that show them. Less is found by the mirrors beyond, which show less.
const IMAGES: usize = 1024;
const PLANES: usize = 16;

/// The directions into which light leaves a point.
#[derive(Clone, Copy, Debug)]
pub enum Facing {
    /// The half space towards which this unit vector points.
    Front(Vec3),
    /// All directions, with the cosine to this normal: light leaves both sides of the surface.
    Both(Vec3),
    /// All directions equally.
    Anywhere,
}

impl Facing {
    /// Returns the cosine at which a ball is seen, times its distance, with its radius added for
    /// its rim; 0 if the ball lies behind.
    #[inline]
    fn along(self, to: Vec3, radius: f32) -> f32 {
        match self {
            Self::Front(normal) => (to.dot(normal) + radius).max(0.0),
            Self::Both(normal) => to.dot(normal).abs() + radius,
            Self::Anywhere => to.length() + radius,
        }
    }
}

/// The place from which flights are aimed at captors.
#[derive(Clone, Copy, Debug)]
pub enum View {
    /// From a point, into some directions.
    Point(Vec3, Facing),
    /// From infinitely far away, along this unit vector.
    Beam(Vec3),
}

/// The shape at which flights are aimed.
#[derive(Clone, Copy, Debug)]
enum Shape {
    /// The ellipse around a flat captor.
    Ellipse {
        /// Unit normal of the captor's front.
        normal: Vec3,
        /// The half axes of the ellipse, m.
        axes: [Vec3; 2],
        /// The half axes, each divided by its squared length, 1/m.
        inverse: [Vec3; 2],
        /// The area of the ellipse, m2.
        area: f32,
        /// Whether only light from the front counts.
        one_sided: bool,
    },
    /// The ball around a captor that is not flat.
    Ball,
}

/// A captor, or the mirror image of one, at which flights are aimed.
#[derive(Clone, Copy, Debug)]
struct Target {
    center: Vec3,
    /// The radius of a ball around the captor, m.
    radius: f32,
    shape: Shape,
    /// Index of the plane that shows it, if it is an image.
    plane: Option<usize>,
}

/// A node of the tree of targets: a set of neighbouring targets.
#[derive(Clone, Debug)]
struct Node {
    /// Centre of a ball around everything at which flights are aimed there.
    center: Vec3,
    radius: f32,
    /// The range of the node's targets in the list is `from..to`.
    from: usize,
    to: usize,
    /// The number of these targets, in which an image counts as the fraction that is mirrored.
    number: f32,
    /// The index of the node of their first half; the node of the other half follows it in the
    /// list.
    halves: Option<usize>,
}

/// The node whose targets were compared one by one in a view, and the sum of their weights.
#[derive(Clone, Copy, Debug, Default)]
pub struct Seen(Option<(usize, f32)>);

/// The virtual captors of a scene.
#[derive(Clone, Debug)]
pub struct Targets {
    targets: Vec<Target>,
    /// The planes of panes and mirrors that show captors, each with the fraction of the light towards
    /// it that is mirrored.
    planes: Vec<(MirrorPlane, f32)>,
    /// The tree; its first node holds all targets.
    nodes: Vec<Node>,
    /// The share of the flights that aim at a shape larger than the captor.
    wide_share: f32,
    /// Whether a flight may pass glass or be mirrored.
    pub(super) passes_surfaces: bool,
}

impl Targets {
    /// Builds the targets of a scene; `None` if it has no virtual captor.
    pub fn of(scene: &Scene) -> Option<Self> {
        let captors = scene.captors.iter().enumerate();
        let sensors = captors.filter(|(_, captor)| captor.kind != CaptorKind::Surface);
        let mut targets: Vec<Target> =
            sensors.map(|(c, captor)| Target::new(scene, c, captor)).collect();
        if targets.is_empty() {
            return None;
        }
        let planes = scene.mirror_planes((IMAGES / targets.len()).min(PLANES));
        let planes: Vec<_> = planes.into_iter().map(|plane| (plane, plane.share())).collect();
        let images = planes.iter().enumerate().flat_map(|(number, (plane, _))| {
            targets.iter().filter_map(move |target| target.image(number, plane))
        });
        targets.extend(images.collect::<Vec<_>>());
        let used =
            |of: fn(&Material) -> bool| scene.materials.iter().any(|named| of(&named.material));
        let wide_share = if used(Material::is_solid) { WIDE_SHARE } else { 0.0 };
        let passes_surfaces = used(|material| material.has_mirror() && !material.is_diffuse());
        let reach = if wide_share > 0.0 { WIDE } else { 1.0 };
        let mut all = Self { targets, planes, nodes: Vec::new(), wide_share, passes_surfaces };
        let whole = all.node(0, all.targets.len(), reach);
        all.nodes.push(whole);
        let mut next = 0;
        while next < all.nodes.len() {
            all.halve(next, reach);
            next += 1;
        }
        Some(all)
    }

    fn node(&self, from: usize, to: usize, reach: f32) -> Node {
        let targets = &self.targets[from..to];
        let center = Extent::of(targets.iter().map(|target| target.center)).center();
        let far = |target: &Target| target.center.distance(center) + reach * target.radius;
        let radius = targets.iter().map(far).fold(0.0, f32::max);
        let number = targets.iter().map(|target| target.strength(&self.planes)).sum();
        Node { center, radius, from, to, number, halves: None }
    }

    /// Cuts a node into halves across its longest side, unless it is small.
    fn halve(&mut self, node: usize, reach: f32) {
        let Node { from, to, .. } = self.nodes[node];
        if to - from <= LEAF {
            return;
        }
        let targets = &mut self.targets[from..to];
        let size = Extent::of(targets.iter().map(|target| target.center)).size();
        let axis = size.max_position();
        targets.sort_by(|a, b| a.center[axis].total_cmp(&b.center[axis]));
        let middle = (from + to) / 2;
        let halves = [self.node(from, middle, reach), self.node(middle, to, reach)];
        self.nodes[node].halves = Some(self.nodes.len());
        self.nodes.extend(halves);
    }

    /// Chooses a target in a view. Returns a unit vector from the point of the view to it or, for a
    /// beam, a point that the beam is to pass. Also returns what [`density`](Self::density) in the
    /// same view then need not compute again. `None` where no captor is chosen.
    pub fn choose(&self, view: View, rng: &mut Stream) -> (Option<Vec3>, Seen) {
        let mut u = rng.uniform();
        let mut number = 0;
        while let Some(first) = self.nodes[number].choice() {
            let Some((share, _)) = self.shares(first, view) else {
                return (None, Seen(None));
            };
            let second = u >= share;
            u = if second { (u - share) / (1.0 - share) } else { u / share };
            number = first + usize::from(second);
        }
        let targets = self.targets_of(number);
        let mut weights = [0.0; GROUP];
        let mut total = 0.0;
        for (weight, target) in weights.iter_mut().zip(targets) {
            *weight = target.weight(view, &self.planes);
            total += *weight;
        }
        let seen = Seen(Some((number, total)));
        let mut rest = u * total;
        let mut chosen = None;
        for (target, weight) in targets.iter().zip(weights).filter(|(_, weight)| *weight > 0.0) {
            chosen = Some(target);
            rest -= weight;
            if rest < 0.0 {
                break;
            }
        }
        (chosen.and_then(|target| target.aim(view, self.wide_share, rng)), seen)
    }

    /// Returns the density with which [`choose`](Self::choose) draws a ray: of its direction from
    /// the point of the view, 1/sr, or of its place across a beam, 1/m2.
    pub fn density(&self, view: View, ray: &Ray, seen: Seen) -> f32 {
        // nodes to visit, each with its chance and the node whose targets are compared one by one;
        // there are no more than the depth of the tree, which is the logarithm of the number of
        // targets
        let mut open = [(0, 1.0, None); 64];
        let mut left = 1;
        let Seen(mut known) = seen;
        let mut density = 0.0;
        while left > 0 {
            left -= 1;
            let (number, chance, group): (usize, f32, Option<usize>) = open[left];
            let node = &self.nodes[number];
            if !meets_ball(node.center - ray.origin, node.radius, ray.direction) {
                continue;
            }
            if let Some(first) = node.choice() {
                if let Some((one, other)) = self.shares(first, view) {
                    open[left] = (first, chance * one, None);
                    open[left + 1] = (first + 1, chance * other, None);
                    left += 2;
                }
                continue;
            }
            let group = group.unwrap_or(number);
            if let Some(first) = node.halves {
                open[left] = (first, chance, Some(group));
                open[left + 1] = (first + 1, chance, Some(group));
                left += 2;
                continue;
            }
            for target in self.targets_of(number) {
                let there = target.density(view, ray, self.wide_share);
                if there == 0.0 {
                    continue;
                }
                // a target without weight is seen from behind
                let weight = target.weight(view, &self.planes);
                if weight > 0.0 {
                    let total = match known {
                        Some((of, total)) if of == group => total,
                        _ => {
                            let all = self.targets_of(group).iter();
                            all.map(|target| target.weight(view, &self.planes)).sum()
                        }
                    };
                    known = Some((group, total));
                    density += chance * weight / total * there;
                }
            }
        }
        density
    }

    fn targets_of(&self, node: usize) -> &[Target] {
        let Node { from, to, .. } = self.nodes[node];
        &self.targets[from..to]
    }

    /// Returns the chances of the two halves of a node, of which `first` is the first; `None` if
    /// neither is seen.
    #[inline]
    fn shares(&self, first: usize, view: View) -> Option<(f32, f32)> {
        let seen = |node: &Node| {
            let number = node.number;
            let View::Point(point, facing) = view else { return number };
            let to = node.center - point;
            let d2 = to.length_squared() + node.radius * node.radius;
            number * facing.along(to, node.radius) / (d2 * d2.sqrt())
        };
        let [one, other] = [seen(&self.nodes[first]), seen(&self.nodes[first + 1])];
        let total = one + other;
        (total > 0.0).then(|| (one / total, other / total))
    }
}

impl Node {
    /// Returns the index of the node's first half, if its halves are compared before its targets.
    #[inline]
    fn choice(&self) -> Option<usize> {
        self.halves.filter(|_| self.to - self.from > GROUP)
    }
}

/// Returns whether a ray along `direction` meets a ball whose middle lies at `to` from the ray's
/// origin.
#[inline]
fn meets_ball(to: Vec3, radius: f32, direction: Vec3) -> bool {
    let along = to.dot(direction);
    let r2 = radius * radius;
    (to - along * direction).length_squared() <= r2 && (along >= 0.0 || to.length_squared() <= r2)
}

impl Target {
    fn new(scene: &Scene, index: usize, captor: &Captor) -> Self {
        let triangles = scene.triangles_of(captor);
        let corners = || triangles.iter().flat_map(|t: &Triangle| [t.a, t.b, t.c]);
        let exact: Vec<[glam::DVec3; 3]> =
            triangles.iter().map(|t| [t.a, t.b, t.c].map(|p| p.as_dvec3())).collect();
        let Moments { normal, .. } = Moments::of(&exact);
        let normal = normal.as_vec3();
        let middle = Extent::of(corners()).center();
        let radius = corners().map(|corner| corner.distance(middle)).fold(0.0, f32::max);
        let off = |corner: Vec3| (corner - middle).dot(normal).abs();
        let fronts = triangles.iter().all(|t| t.cross().dot(normal) >= 0.0);
        let is_flat = normal != Vec3::ZERO && corners().all(|c| off(c) <= FLAT * radius);
        if !is_flat || !fronts {
            let radius = MARGIN * radius;
            return Self { center: middle, radius, shape: Shape::Ball, plane: None };
        }
        let axes = axes(middle, normal, &triangles).map(|axis| MARGIN * axis);
        let [a, b] = axes.map(Vec3::length);
        let shape = Shape::Ellipse {
            normal,
            axes,
            inverse: axes.map(|axis| axis / axis.length_squared()),
            area: PI * a * b,
            one_sided: !captor.kind.has_back(),
        };
        let center = middle + scene.lift(index) * normal;
        Self { center, radius: a.max(b), shape, plane: None }
    }

    /// Returns the image of the target in a plane, by the plane's number; `None` for a target that
    /// the plane cuts.
    fn image(&self, number: usize, plane: &MirrorPlane) -> Option<Self> {
        let shape = match self.shape {
            Shape::Ellipse { normal, axes, inverse, area, one_sided } => Shape::Ellipse {
                normal: plane.turned(normal),
                axes: axes.map(|axis| plane.turned(axis)),
                inverse: inverse.map(|axis| plane.turned(axis)),
                area,
                one_sided,
            },
            Shape::Ball => Shape::Ball,
        };
        let center = plane.image(self.center);
        let is_clear = plane.height(self.center).abs() > self.radius;
        is_clear.then_some(Self { center, shape, plane: Some(number), ..*self })
    }

    /// Returns the fraction of the light towards the target that comes to the captor.
    fn strength(&self, planes: &[(MirrorPlane, f32)]) -> f32 {
        self.plane.map_or(1.0, |plane| planes[plane].1)
    }

    /// Returns the same fraction for a view; 0 where the plane's panes and mirrors do not show the
    /// image there.
    fn shown(&self, view: View, (plane, share): &(MirrorPlane, f32)) -> f32 {
        let height = plane.height(self.center);
        // the way from the view to the image, and the part of it from the plane on
        let (way, beyond) = match view {
            View::Point(point, _) => {
                let before = plane.height(point);
                (self.center - point, height / (height - before))
            }
            View::Beam(direction) => (direction, height / direction.dot(plane.normal)),
        };
        let is_shown = match view {
            View::Point(..) => (0.0..1.0).contains(&beyond),
            View::Beam(_) => beyond > 0.0 && beyond.is_finite(),
        };
        let meets = || plane.is_near(self.center - beyond * way, self.radius);
        if is_shown && meets() { *share } else { 0.0 }
    }

    /// Returns the weight of the target in a view, in proportion to which flights aim at it: the
    /// approximate light of the view per unit of the target's area, cos cos' / d2 or the cosine of
    /// a beam, and of that the fraction that an image gets.
    #[inline]
    fn weight(&self, view: View, planes: &[(MirrorPlane, f32)]) -> f32 {
        match self.plane {
            None => self.weight_in_sight(view),
            Some(plane) => self.shown(view, &planes[plane]) * self.weight_in_sight(view),
        }
    }

    #[inline]
    fn weight_in_sight(&self, view: View) -> f32 {
        let height = |to: Vec3| match self.shape {
            Shape::Ellipse { normal, one_sided, .. } => {
                let height = -to.dot(normal);
                if one_sided { height.max(0.0) } else { height.abs() }
            }
            Shape::Ball => to.length(),
        };
        let (point, facing) = match view {
            View::Point(point, facing) => (point, facing),
            View::Beam(direction) => return height(direction),
        };
        let (to, r2) = (self.center - point, self.radius * self.radius);
        let d2 = to.length_squared();
        // no direction leads to a ball from within
        if matches!(self.shape, Shape::Ball) && d2 <= r2 {
            return 0.0;
        }
        height(to) * facing.along(to, self.radius) / (d2 + r2).powi(2)
    }

    /// Draws a unit vector to the target or, for a beam, a point of the target that the beam is to
    /// pass.
    fn aim(&self, view: View, wide_share: f32, rng: &mut Stream) -> Option<Vec3> {
        let size = match wide_share {
            0.0 => 1.0,
            share => wide_size(rng.uniform() / share),
        };
        let mut on = |middle: Vec3, [a, b]: [Vec3; 2], size: f32| {
            let u = rng.square();
            let at = size * u.x.sqrt() * uniform_circle(u.y);
            middle + at.x * a + at.y * b
        };
        match (self.shape, view) {
            (Shape::Ellipse { axes, .. }, View::Point(point, _)) => {
                on(self.center - point, axes, size).try_normalize()
            }
            (Shape::Ellipse { axes, .. }, View::Beam(_)) => Some(on(self.center, axes, size)),
            (Shape::Ball, View::Point(point, _)) => {
                let to = self.center - point;
                let direction = to.try_normalize()?;
                let local = uniform_cone(self.versine(to), rng.square());
                Some(Frame::new(direction).to_world(local))
            }
            (Shape::Ball, View::Beam(direction)) => {
                let Frame { tangent, bitangent, .. } = Frame::new(direction);
                Some(on(self.center, [tangent, bitangent].map(|axis| self.radius * axis), 1.0))
            }
        }
    }

    /// Returns 1 - cos of the angle at which the radius of the ball appears from outside.
    fn versine(&self, to: Vec3) -> f32 {
        let sin2 = (self.radius * self.radius / to.length_squared()).min(1.0);
        sin2 / (1.0 + (1.0 - sin2).sqrt())
    }

    /// Returns the density of [`aim`](Self::aim): of directions, 1/sr, or of places across a beam,
    /// 1/m2.
    #[inline]
    fn density(&self, view: View, ray: &Ray, wide_share: f32) -> f32 {
        let (to, direction) = (self.center - ray.origin, ray.direction);
        match self.shape {
            Shape::Ellipse { normal, inverse, area, .. } => {
                let cos = direction.dot(normal);
                let t = to.dot(normal) / cos;
                let at = t * direction - to;
                let r2 = at.dot(inverse[0]).powi(2) + at.dot(inverse[1]).powi(2);
                // a ray in the plane of the ellipse has no density
                if !(r2 <= WIDE * WIDE && t > 0.0) {
                    return 0.0;
                }
                let own = if r2 <= 1.0 { 1.0 - wide_share } else { 0.0 };
                let wide = if wide_share > 0.0 { wide_share * wide_density(r2) } else { 0.0 };
                let across = (own + wide) / (area * cos.abs());
                if let View::Point(..) = view { across * t * t } else { across }
            }
            Shape::Ball => match view {
                View::Point(..) => {
                    let versine = self.versine(to);
                    let away = 0.5 * direction.distance_squared(to.normalize_or_zero());
                    if away <= versine { 1.0 / (2.0 * PI * versine) } else { 0.0 }
                }
                View::Beam(_) => {
                    let r2 = self.radius * self.radius;
                    if meets_ball(to, self.radius, direction) { 1.0 / (PI * r2) } else { 0.0 }
                }
            },
        }
    }
}

/// Returns the size of the ellipse at which a flight aims, relative to the captor. It is 1 for `u`
/// of 1 and more; below, it is a size s of which 1 / s is uniform in [1 / [`WIDE`], 1].
#[inline]
fn wide_size(u: f32) -> f32 {
    if u < 1.0 { 1.0 / (1.0 - u * (1.0 - 1.0 / WIDE)) } else { 1.0 }
}

/// Returns the density of points that are uniform on ellipses of such sizes, times the area of the
/// captor's ellipse. `r2` is the squared distance from the middle, relative to the size of the
/// captor. The density is the integral of s^-4 WIDE / (WIDE - 1) over the sizes s that reach there.
#[inline]
fn wide_density(r2: f32) -> f32 {
    let r = r2.max(1.0).sqrt();
    (WIDE / (3.0 * (WIDE - 1.0)) * ((r * r * r).recip() - (WIDE * WIDE * WIDE).recip())).max(0.0)
}

/// Returns the half axes of an ellipse around flat triangles. Their directions and the proportion
/// of their lengths are those of the second moments of the triangles.
fn axes(middle: Vec3, normal: Vec3, triangles: &[Triangle]) -> [Vec3; 2] {
    let Frame { tangent: x, bitangent: y, .. } = Frame::new(normal);
    let corners = || {
        let all = triangles.iter().flat_map(|t| [t.a, t.b, t.c]);
        all.map(|corner| [(corner - middle).dot(x), (corner - middle).dot(y)])
    };
    let [mut xx, mut xy, mut yy] = [0.0f32; 3];
    for (t, chunk) in triangles.iter().zip(corners().collect::<Vec<_>>().chunks_exact(3)) {
        let area = t.area();
        for [px, py] in chunk {
            xx += area * px * px;
            xy += area * px * py;
            yy += area * py * py;
        }
    }
    // the axes of the matrix of these moments, and their lengths
    let turn = 0.5 * (2.0 * xy).atan2(xx - yy);
    let (sin, cos) = turn.sin_cos();
    let spread = |c: f32, s: f32| (xx * c * c + 2.0 * xy * c * s + yy * s * s).max(0.0).sqrt();
    let least = 1e-3 * (xx + yy).sqrt();
    let lengths = [spread(cos, sin).max(least), spread(-sin, cos).max(least)];
    let far = |[px, py]: [f32; 2]| {
        ((px * cos + py * sin) / lengths[0]).hypot((py * cos - px * sin) / lengths[1])
    };
    let size = corners().map(far).fold(0.0, f32::max);
    [size * lengths[0] * (cos * x + sin * y), size * lengths[1] * (cos * y - sin * x)]
}
