//! The virtual captors as targets of aimed flights: which of them a point, or a beam from
//! infinitely far away, sees well, and where they are.
//!
//! Some flights are aimed at what flat panes and mirrors show: the view is mirrored in their plane, a
//! captor is chosen from there, and the flight to it is mirrored back. Without such flights the
//! little light that comes to a small captor by way of a window pane would rest on single photons,
//! each of which brings far more than all flights that are aimed.

use std::f32::consts::PI;

use glam::Vec3;

use crate::{
    math::{
        effort,
        geometry::{Extent, Frame, Ray, Triangle},
        rng::Stream,
        sampling::{uniform_circle, uniform_cone},
    },
    scene::{
        captor::{Captor, CaptorKind, Moments},
        light::Light,
        material::{Material, Scatterer},
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
/// A captor whose size is below this fraction of its distance is not aimed at: the rounding of the
/// directions of rays would make flights miss it.
const TINY: f32 = 1e-5;
/// What surfaces farther away than this, m, scatter onto a sensor is taken to be little: else a wide
/// ground would mark all of them.
const NEAR: f32 = 100.0;
/// A ray that passes captors at more than this many times their size is compared with them in double
/// precision.
const FAR: f32 = 1e3;
/// Where a ray passes a ball is known up to this fraction of its distance.
const ROUNDING: f32 = 1e-6;
/// The fraction of the flights that are aimed by way of panes and mirrors, if there are any, and the
/// largest number of planes in which these lie.
const MIRRORED: f32 = 0.05;
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

impl View {
    /// Returns the view in a mirror.
    fn mirrored(self, plane: &MirrorPlane) -> Self {
        let facing = |facing| match facing {
            Facing::Front(normal) => Facing::Front(plane.turned(normal)),
            Facing::Both(normal) => Facing::Both(plane.turned(normal)),
            Facing::Anywhere => Facing::Anywhere,
        };
        match self {
            Self::Point(point, towards) => Self::Point(plane.image(point), facing(towards)),
            Self::Beam(direction) => Self::Beam(plane.turned(direction)),
        }
    }
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

/// A captor at which flights are aimed.
#[derive(Clone, Copy, Debug)]
struct Target {
    center: Vec3,
    /// The radius of a ball around the captor, m.
    radius: f32,
    /// The smaller half axis of the shape, m.
    least: f32,
    shape: Shape,
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
    /// The index of the node of their first half; the node of the other half follows it in the
    /// list.
    halves: Option<usize>,
}

/// The node whose targets were compared one by one in a view, and the sum of their weights.
#[derive(Clone, Copy, Debug, Default)]
pub struct Seen(Option<(usize, f32)>);

/// A target that was chosen in a view.
#[derive(Clone, Copy, Debug, Default)]
pub struct Chosen {
    /// A unit vector from the point of the view to it or, for a beam, a point that the beam is to
    /// pass; `None` where no captor was chosen.
    pub to: Option<Vec3>,
    /// What [`Targets::density`] in the same view then need not compute again.
    pub seen: Seen,
    /// Index of the plane whose panes or mirrors are to send the flight to the captor.
    by: Option<usize>,
}

/// The captors of a scene at which flights are aimed.
#[derive(Clone, Debug)]
pub struct Targets {
    targets: Vec<Target>,
    /// The planes of panes and mirrors by way of which flights are aimed, each with its share of
    /// these flights.
    planes: Vec<(MirrorPlane, f32)>,
    /// The tree; its first node holds all targets.
    nodes: Vec<Node>,
    /// The share of the flights that aim at a shape larger than the captor.
    wide_share: f32,
    /// Whether a flight may pass glass or covers, or be mirrored.
    pub(super) passes_surfaces: bool,
    /// Whether flights are aimed at surfaces, too, and tell of their arrivals there.
    pub(super) are_surfaces: bool,
}

/// Returns the indices of the virtual captors that are too small to be aimed at from all lamps, or from
/// all surfaces up to [`NEAR`], so that flights miss some of their light.
pub fn too_small_to_aim_at(scene: &Scene) -> Vec<usize> {
    let lamps = scene.lights().iter().filter(|light| light.entrance().is_none());
    let lamps = lamps.map(Light::extent).fold(Extent::EMPTY, Extent::join);
    let surfaces = scene.triangles().extent();
    let far = |extent: &Extent, from: Vec3| match extent.min.is_finite() {
        true => extent.corners().map(|corner| corner.distance_squared(from)),
        false => [0.0; 8],
    };
    let is_too_small = |&(c, captor): &(usize, &Captor)| {
        let target = Target::new(scene, c, captor);
        let [lamps, surfaces] = [&lamps, &surfaces]
            .map(|extent| far(extent, target.center).into_iter().fold(0.0, f32::max));
        target.is_tiny(lamps.max(surfaces.min(NEAR * NEAR)))
    };
    let captors = scene.captors().iter().enumerate();
    let captors = captors.filter(|(_, captor)| captor.kind != CaptorKind::Surface);
    captors.filter(is_too_small).map(|(c, _)| c).collect()
}

impl Targets {
    /// Builds the targets of a scene, its virtual captors; `None` if there are none.
    pub fn of(scene: &Scene) -> Option<Self> {
        Self::among(scene, |c| scene.captors()[c].kind != CaptorKind::Surface)
    }

    /// Builds targets of the captors, virtual or not, whose indices are `chosen`; `None` if there are
    /// none.
    pub fn among(scene: &Scene, chosen: impl Fn(usize) -> bool) -> Option<Self> {
        let captors = || scene.captors().iter().enumerate().filter(|(c, _)| chosen(*c));
        let targets: Vec<Target> =
            captors().map(|(c, captor)| Target::new(scene, c, captor)).collect();
        let are_surfaces = captors().any(|(_, captor)| captor.kind == CaptorKind::Surface);
        if targets.is_empty() {
            return None;
        }
        let used =
            |of: fn(&Material) -> bool| scene.materials().iter().any(|named| of(&named.material));
        let wide_share = if used(Material::is_solid) { WIDE_SHARE } else { 0.0 };
        let passes_surfaces = used(|material| {
            !material.is_diffuse() && (material.has_mirror() || material.is_clear())
        });
        let reach = if wide_share > 0.0 { WIDE } else { 1.0 };
        let planes = scene.mirror_planes(PLANES);
        let whole: f32 = planes.iter().map(MirrorPlane::mirrored_area).sum();
        let share = |plane: MirrorPlane| (plane, plane.mirrored_area() / whole);
        let planes = planes.into_iter().map(share).collect();
        let nodes = Vec::new();
        let mut all = Self { targets, planes, nodes, wide_share, passes_surfaces, are_surfaces };
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
        Node { center, radius, from, to, halves: None }
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

    /// Chooses a target in a view.
    pub fn choose(&self, view: View, rng: &mut Stream) -> Chosen {
        let Some(by) = self.choose_plane(rng) else {
            let (to, seen) = self.choose_in_sight(view, rng);
            return Chosen { to, seen, by: None };
        };
        let (plane, _) = &self.planes[by];
        let (to, _) = self.choose_in_sight(view.mirrored(plane), rng);
        let to = to.map(|to| match view {
            View::Point(..) => plane.turned(to),
            View::Beam(_) => plane.image(to),
        });
        Chosen { to, seen: Seen::default(), by: Some(by) }
    }

    /// Chooses the plane by way of which a flight is aimed; `None` for most flights.
    fn choose_plane(&self, rng: &mut Stream) -> Option<usize> {
        if self.planes.is_empty() {
            return None;
        }
        let mut rest = rng.uniform() / MIRRORED;
        self.planes.iter().position(|(_, share)| {
            rest -= share;
            rest < 0.0
        })
    }

    /// Returns whether a flight along `ray` to what was chosen is sent: one by way of a pane or
    /// mirror must come to it.
    pub fn is_sent(&self, chosen: &Chosen, ray: &Ray) -> bool {
        chosen.by.is_none_or(|by| self.planes[by].0.is_met(ray))
    }

    /// Chooses a target that is seen without a mirror.
    fn choose_in_sight(&self, view: View, rng: &mut Stream) -> (Option<Vec3>, Seen) {
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
        // each is weighed, and most again for the density of what was chosen
        effort::spend(2 * effort::TARGET * targets.len() as u64);
        let mut weights = [0.0; GROUP];
        let mut total = 0.0;
        for (weight, target) in weights.iter_mut().zip(targets) {
            *weight = target.weight(view);
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

    /// Returns whether flights are aimed by way of a mirror at this point, where a surface has this
    /// unit normal.
    pub fn shows(&self, point: Vec3, normal: Vec3) -> bool {
        self.planes.iter().any(|(plane, _)| plane.holds(point, normal))
    }

    /// Returns the density with which [`choose`](Self::choose) draws a ray that is sent: of its
    /// direction from the point of the view, 1/sr, or of its place across a beam, 1/m2.
    pub fn density(&self, view: View, ray: &Ray, seen: Seen) -> f32 {
        let in_sight = self.density_in_sight(view, ray, seen);
        if self.planes.is_empty() {
            return in_sight;
        }
        effort::spend(effort::TARGET * self.planes.len() as u64);
        let met = self.planes.iter().filter(|(plane, _)| plane.is_met(ray));
        let mirrored = met.map(|(plane, share)| {
            let ray =
                Ray { origin: plane.image(ray.origin), direction: plane.turned(ray.direction) };
            share * self.density_in_sight(view.mirrored(plane), &ray, Seen::default())
        });
        (1.0 - MIRRORED) * in_sight + MIRRORED * mirrored.sum::<f32>()
    }

    fn density_in_sight(&self, view: View, ray: &Ray, seen: Seen) -> f32 {
        // nodes to visit, each with its chance and the node whose targets are compared one by one;
        // there are no more than the depth of the tree, which is the logarithm of the number of
        // targets
        let mut open = [(0, 1.0, None); 64];
        let mut left = 1;
        let Seen(mut known) = seen;
        let mut density = 0.0;
        while left > 0 {
            left -= 1;
            effort::spend(effort::TARGET);
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
            effort::spend(effort::TARGET * self.targets_of(number).len() as u64);
            for target in self.targets_of(number) {
                let there = target.density(view, ray, self.wide_share);
                if there == 0.0 {
                    continue;
                }
                // a target without weight is seen from behind
                let weight = target.weight(view);
                if weight > 0.0 {
                    let total = match known {
                        Some((of, total)) if of == group => total,
                        _ => self.targets_of(group).iter().map(|target| target.weight(view)).sum(),
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
        effort::spend(2 * effort::TARGET);
        let seen = |node: &Node| {
            let number = (node.to - node.from) as f32;
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
    let r2 = (radius + ROUNDING * along.abs()).powi(2);
    (to - along * direction).length_squared() <= r2 && (along >= 0.0 || to.length_squared() <= r2)
}

impl Target {
    fn new(scene: &Scene, index: usize, captor: &Captor) -> Self {
        if let Some(round) = scene.round(captor) {
            let (middle, radius) = (round.center.as_vec3(), MARGIN * round.radius as f32);
            return match round.normal.map(|normal| normal.as_vec3()) {
                Some(normal) => {
                    let Frame { tangent, bitangent, .. } = Frame::new(normal);
                    let axes = [tangent, bitangent].map(|axis| radius * axis);
                    let center = middle + scene.lift(index) * normal;
                    Self::ellipse(center, normal, axes, captor)
                }
                None => Self { center: middle, radius, least: radius, shape: Shape::Ball },
            };
        }
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
            return Self { center: middle, radius, least: radius, shape: Shape::Ball };
        }
        let axes = axes(middle, normal, &triangles).map(|axis| MARGIN * axis);
        Self::ellipse(middle + scene.lift(index) * normal, normal, axes, captor)
    }

    /// Makes the target of a flat captor, from the half axes of the ellipse around it, m.
    fn ellipse(center: Vec3, normal: Vec3, axes: [Vec3; 2], captor: &Captor) -> Self {
        let [a, b] = axes.map(Vec3::length);
        let shape = Shape::Ellipse {
            normal,
            axes,
            inverse: axes.map(|axis| axis / axis.length_squared()),
            area: PI * a * b,
            one_sided: !captor.kind.has_back(),
        };
        Self { center, radius: a.max(b), least: a.min(b), shape }
    }

    /// Returns the weight of the target in a view, in proportion to which flights aim at it: the
    /// approximate light of the view per unit of the target's area, cos cos' / d2 or the cosine of
    /// a beam.
    #[inline]
    fn weight(&self, view: View) -> f32 {
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
        if self.is_tiny(d2) || matches!(self.shape, Shape::Ball) && d2 <= r2 {
            return 0.0;
        }
        height(to) * facing.along(to, self.radius) / (d2 + r2).powi(2)
    }

    /// Returns whether flights from a place at this squared distance would miss the target.
    #[inline]
    fn is_tiny(&self, d2: f32) -> bool {
        self.least * self.least < TINY * TINY * d2
    }

    /// Returns the distance at which a ray comes to the plane of a flat target with this normal, and
    /// the way from its middle to the ray there. `to` is the way from the ray's origin to the middle.
    #[inline]
    fn met(&self, ray: &Ray, to: Vec3, normal: Vec3) -> (f32, Vec3) {
        if to.length_squared() < (FAR * self.least).powi(2) {
            let t = to.dot(normal) / ray.direction.dot(normal);
            return (t, t * ray.direction - to);
        }
        let to = self.center.as_dvec3() - ray.origin.as_dvec3();
        let (direction, normal) = (ray.direction.as_dvec3(), normal.as_dvec3());
        let t = to.dot(normal) / direction.dot(normal);
        (t as f32, (t * direction - to).as_vec3())
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
                let (t, at) = self.met(ray, to, normal);
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
