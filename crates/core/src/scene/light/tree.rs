//! A tree of lights, by which one of thousands is chosen in a time that grows with the logarithm of
//! their number (Conty Estevez and Kulla, "Importance Sampling of Many Lights with Adaptive Tree
//! Splitting", 2018; Pharr, Jakob and Humphreys, Physically Based Rendering, 4th ed., 12.6).
//!
//! Each node knows the box around its lights, their power, and a cone around the directions in which
//! they face. From a point, a child is chosen in proportion to what it may bring there: the sum over
//! its own two children, each by power, distance and the cosines at both ends. A box behind a
//! one-sided surface is left out.

use std::f32::consts::PI;

use glam::Vec3;

use super::Light;
use crate::math::{effort, geometry::Extent};

/// What faces away from a point counts at least this much, because some light may come from there all
/// the same.
const LEAST_COS: f32 = 0.05;

/// The lights of a scene as a binary tree, without those at infinity.
#[derive(Debug)]
pub struct LightTree {
    /// The root first, each parent before its children.
    nodes: Vec<Node>,
    /// For each light the turns from the root to it: a bit for each level, lowest first, 1 for the
    /// second child; above the last turn stands a 1.
    turns: Vec<u64>,
}

#[derive(Debug)]
struct Node {
    extent: Extent,
    /// Power in the brightest band, W or umol/s.
    power: f32,
    cone: Cone,
    kind: Kind,
}

/// A cone around the directions in which lights face.
#[derive(Clone, Copy, Debug)]
struct Cone {
    /// Unit vector along the axis.
    axis: Vec3,
    /// Cosine and sine of the half angle. The cone holds all directions if the cosine is -1, as where
    /// a light faces to both or all sides.
    cos: f32,
    sin: f32,
}

#[derive(Debug)]
enum Kind {
    /// Index of the second child; the first one follows its parent.
    Inner(u32),
    /// Index of the light.
    Leaf(u32),
}

impl LightTree {
    /// Builds the tree, by halves along the longest side of the box around the middles of lights.
    pub fn new(lights: &[Light]) -> Self {
        let mut tree = Self { nodes: Vec::new(), turns: vec![0; lights.len()] };
        let has_place = |&light: &u32| lights[light as usize].entrance().is_none();
        let mut all: Vec<u32> = (0..lights.len() as u32).filter(has_place).collect();
        if !all.is_empty() {
            tree.add(lights, &mut all, 0, 0);
        }
        tree
    }

    fn add(&mut self, lights: &[Light], part: &mut [u32], turns: u64, depth: u32) {
        let at = self.nodes.len();
        if let [light] = *part {
            let of = &lights[light as usize];
            let (extent, power, cone) = (of.extent(), most(&of.power), Cone::of(of));
            self.nodes.push(Node { extent, power, cone, kind: Kind::Leaf(light) });
            self.turns[light as usize] = turns | 1 << depth;
            return;
        }
        let middle = |light: u32| lights[light as usize].extent().center();
        let size = Extent::of(part.iter().map(|&light| middle(light))).size();
        let axis = (0..3).fold(0, |best, axis| if size[axis] > size[best] { axis } else { best });
        let half = part.len() / 2;
        // equal places in the order of the lights, so that the tree is the same each time
        part.select_nth_unstable_by(half, |&a, &b| {
            middle(a)[axis].total_cmp(&middle(b)[axis]).then(a.cmp(&b))
        });
        let (extent, cone) = (Extent::EMPTY, Cone::ALL);
        self.nodes.push(Node { extent, power: 0.0, cone, kind: Kind::Inner(0) });
        let (first, second) = part.split_at_mut(half);
        self.add(lights, first, turns, depth + 1);
        let next = self.nodes.len();
        self.add(lights, second, turns | 1 << depth, depth + 1);
        let (a, b) = (&self.nodes[at + 1], &self.nodes[next]);
        let node = Node {
            extent: a.extent.join(b.extent),
            power: a.power + b.power,
            cone: a.cone.join(b.cone),
            kind: Kind::Inner(next as u32),
        };
        self.nodes[at] = node;
    }

    /// Returns the approximate irradiance of all lights together at a point; 0 only where none
    /// shines. With a `normal`, light from behind does not count.
    pub fn importance(&self, lights: &[Light], point: Vec3, normal: Option<Vec3>) -> f32 {
        if self.nodes.is_empty() { 0.0 } else { self.brings(lights, 0, point, normal) }
    }

    /// Chooses a light by a number in [0, 1), as a point sees them. Returns its index and the
    /// probability of the choice. `None` where no light can shine.
    pub fn choose(
        &self,
        lights: &[Light],
        point: Vec3,
        normal: Option<Vec3>,
        mut number: f64,
    ) -> Option<(usize, f32)> {
        let (mut at, mut probability) = (0, 1.0);
        loop {
            let next = match self.nodes.get(at)?.kind {
                Kind::Leaf(light) => return Some((light as usize, probability as f32)),
                Kind::Inner(next) => next as usize,
            };
            let first = self.share(lights, at, next, point, normal)?;
            if number < first {
                (at, probability, number) = (at + 1, probability * first, number / first);
            } else {
                let second = 1.0 - first;
                (at, probability, number) = (next, probability * second, (number - first) / second);
            }
        }
    }

    /// Returns the probability with which [`choose`](Self::choose) takes a light.
    pub fn probability(
        &self,
        lights: &[Light],
        point: Vec3,
        normal: Option<Vec3>,
        light: usize,
    ) -> f32 {
        let (mut at, mut probability, mut turns) = (0, 1.0, self.turns[light]);
        while let Some(Node { kind: Kind::Inner(next), .. }) = self.nodes.get(at) {
            let next = *next as usize;
            let Some(first) = self.share(lights, at, next, point, normal) else { return 0.0 };
            (at, probability) = match turns & 1 {
                0 => (at + 1, probability * first),
                _ => (next, probability * (1.0 - first)),
            };
            turns >>= 1;
        }
        probability as f32
    }

    /// Returns the probability of the first child of a node. `None` where neither can shine.
    fn share(
        &self,
        lights: &[Light],
        at: usize,
        next: usize,
        point: Vec3,
        normal: Option<Vec3>,
    ) -> Option<f64> {
        let [first, second] = [at + 1, next].map(|child| self.brings(lights, child, point, normal));
        let sum = first + second;
        (sum > 0.0).then(|| f64::from(first) / f64::from(sum))
    }

    /// Returns the approximate irradiance of a node's lights at a point: the sum over its children,
    /// which tell better than the node itself where its lights are.
    fn brings(&self, lights: &[Light], at: usize, point: Vec3, normal: Option<Vec3>) -> f32 {
        effort::spend(2 * effort::LIGHT);
        let of = |node: usize| self.nodes[node].brings(lights, point, normal);
        match self.nodes[at].kind {
            Kind::Leaf(_) => of(at),
            Kind::Inner(next) => of(at + 1) + of(next as usize),
        }
    }
}

impl Node {
    /// Returns the approximate irradiance of the node's lights at a point; 0 only where none shines.
    fn brings(&self, lights: &[Light], point: Vec3, normal: Option<Vec3>) -> f32 {
        let Extent { min, max } = self.extent;
        let (half, away) = (0.5 * (max - min), self.extent.center() - point);
        // a little more than the box, because of rounding
        let reach = |normal: Vec3| 1.001 * half.dot(normal.abs()) + 1e-5 * away.length();
        if normal.is_some_and(|normal| away.dot(normal) < -reach(normal)) {
            return 0.0;
        }
        let (d2, r2) = (away.length_squared(), half.length_squared());
        // the box is seen within an angle of this sine and cosine about its middle
        let seen = (d2 > r2).then(|| {
            let sin2 = r2 / d2;
            (away / d2.sqrt(), sin2.sqrt(), (1.0 - sin2).sqrt())
        });
        let (mut arrives, mut leaves) = (1.0, 1.0);
        if let Some((towards, sin, cos)) = seen {
            if let Some(normal) = normal {
                arrives = cos_less(normal.dot(towards), sin, cos).max(LEAST_COS);
            }
            leaves = self.cone.leaves(-towards, sin, cos);
        }
        match self.kind {
            Kind::Leaf(light) => {
                let light = &lights[light as usize];
                // a light with an axis knows how it shines
                let leaves = if light.axis().is_some() { 1.0 } else { leaves };
                self.power * arrives * leaves * light.importance(point, None)
            }
            Kind::Inner(_) => {
                // close to lights that fill their box evenly, what they bring depends on the area
                // on which they are, and not on where its middle is
                let nearest = (min - point).max(point - max).max(Vec3::ZERO).length_squared();
                let Vec3 { x, y, z } = max - min;
                let area = (x * y).max(y * z).max(z * x);
                let d2 = d2.max(nearest + area / PI).max(f32::MIN_POSITIVE);
                self.power * arrives * leaves / d2
            }
        }
    }
}

impl Cone {
    const ALL: Self = Self { axis: Vec3::Z, cos: -1.0, sin: 0.0 };

    fn of(light: &Light) -> Self {
        match light.facing() {
            Some((axis, false)) => Self { axis, cos: 1.0, sin: 0.0 },
            _ => Self::ALL,
        }
    }

    /// Returns a cone that holds both.
    fn join(self, other: Self) -> Self {
        let Some(axis) = (self.axis + other.axis).try_normalize() else { return Self::ALL };
        if self.cos.min(other.cos) < 0.0 {
            return Self::ALL;
        }
        let angle = |cone: Self| cone.cos.min(1.0).acos() + axis.dot(cone.axis).min(1.0).acos();
        let angle = angle(self).max(angle(other));
        if angle >= PI / 2.0 {
            return Self::ALL;
        }
        Self { axis, cos: angle.cos(), sin: angle.sin() }
    }

    /// Returns how much light leaves in a direction, relative to the mean over all directions, if each
    /// light shines in proportion to the cosine; the direction is known up to an angle.
    fn leaves(&self, direction: Vec3, sin: f32, cos: f32) -> f32 {
        if self.cos < 0.0 {
            return 1.0;
        }
        let nearest = cos_less(self.axis.dot(direction), sin, cos);
        2.0 * cos_less(nearest, self.sin, self.cos).max(LEAST_COS)
    }
}

/// Returns the cosine of an angle that is less by another one, of this sine and cosine, but not below
/// 0.
fn cos_less(of: f32, sin: f32, cos: f32) -> f32 {
    if of >= cos { 1.0 } else { of * cos + (1.0 - of * of).max(0.0).sqrt() * sin }
}

fn most(power: &[f64]) -> f32 {
    power.iter().copied().fold(0.0, f64::max) as f32
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::light::{Cone, Intensity, Lamp, Luminaire};

    fn lights(count: usize) -> Vec<Light> {
        (0..count)
            .map(|i| {
                let f = i as f64;
                let position = DVec3::new((f * 0.37).sin(), (f * 0.73).cos(), 0.1 * (f % 7.0));
                let power = [if i % 5 == 0 { 0.0 } else { 1.0 + (f % 3.0) }];
                let lamp = Lamp::new(power, Cone::point(position)).into();
                Light::new("lamp".into(), lamp, 1, DVec3::ZERO, &Extent::EMPTY.into())
            })
            .collect()
    }

    /// The probabilities of all lights add up to 1, and each light is chosen by its share of the
    /// numbers; a light without power never, and none behind a surface.
    #[test]
    fn choices_have_their_probabilities() {
        let lights = lights(101);
        let tree = LightTree::new(&lights);
        let point = Vec3::new(0.3, -0.2, 0.25);
        for normal in [None, Some(Vec3::Z)] {
            let of = |light: usize| f64::from(tree.probability(&lights, point, normal, light));
            let sum: f64 = (0..lights.len()).map(of).sum();
            assert!((sum - 1.0).abs() < 1e-5, "{sum}");
            const NUMBERS: u32 = 200_000;
            let mut shares = vec![0.0; lights.len()];
            for i in 0..NUMBERS {
                let number = (f64::from(i) + 0.5) / f64::from(NUMBERS);
                let (light, probability) =
                    tree.choose(&lights, point, normal, number).expect("a light");
                assert!((f64::from(probability) - of(light)).abs() < 1e-6);
                shares[light] += 1.0 / f64::from(NUMBERS);
            }
            for (light, share) in shares.iter().enumerate() {
                let off = (share - of(light)).abs();
                assert!(off < 3.0 / f64::from(NUMBERS), "{light}: {share} {}", of(light));
                let behind = normal.is_some() && lights[light].ball().0.z < 0.24;
                assert!((light % 5 != 0 && !behind) || *share == 0.0, "{light}");
            }
        }
        assert!(LightTree::new(&[]).choose(&[], point, None, 0.5).is_none());
    }

    /// In racks of 1,080 diodes that shine down, each in proportion to the cosine, choices vary little
    /// from point to point: with light E of all and f of each, chosen by the probability p, the
    /// relative variance of f / p is the sum of f^2 / p over E^2, less 1. That of a choice by the power
    /// and squared distance of boxes alone is 10 to 30. Chance plays no part in this.
    #[test]
    fn diodes_of_near_shelves_are_chosen() {
        let place = |i: usize| {
            let (shelf, at) = (i / 60, i % 60);
            let (rack, level) = (shelf / 6, shelf % 6);
            let (x, y) = (0.5 * (at / 4) as f64, 0.3 * (at % 4) as f64 + 2.4 * rack as f64);
            DVec3::new(x, y, 0.9 + 0.65 * level as f64)
        };
        let light = |i: usize| {
            let intensity = Intensity::cosine(1.0, DVec3::NEG_Z).expect("an intensity");
            let lamp = Lamp::new([1.0], Luminaire::new(place(i), intensity)).into();
            Light::new("diode".into(), lamp, 1, DVec3::ZERO, &Extent::EMPTY.into())
        };
        let lights: Vec<Light> = (0..1080).map(light).collect();
        let tree = LightTree::new(&lights);
        for (shelf, x) in [(0, 0.2), (8, 3.6), (17, 6.9)] {
            let above = place(60 * shelf) + DVec3::new(x, 0.45, -0.39);
            let (mut all, mut squares) = (0.0, 0.0);
            for i in 0..lights.len() {
                let away = place(i) - above;
                if away.z <= 0.0 {
                    continue;
                }
                let brings = away.z.powi(2) / away.length_squared().powi(2);
                let probability = tree.probability(&lights, above.as_vec3(), Some(Vec3::Z), i);
                all += brings;
                squares += brings * brings / f64::from(probability);
            }
            let variance = squares / (all * all) - 1.0;
            assert!(variance < 2.0, "{shelf}: {variance}");
        }
    }

    #[test]
    fn equal_places_make_a_tree() {
        let light = |_| {
            let lamp = Lamp::new([1.0], Cone::point(DVec3::ONE)).into();
            Light::new("a".into(), lamp, 1, DVec3::ZERO, &Extent::EMPTY.into())
        };
        let lights: Vec<Light> = (0..1000).map(light).collect();
        let tree = LightTree::new(&lights);
        for light in [0, 499, 999] {
            // what a node brings is told by its children, and a leaf's by the lamp itself
            let probability = tree.probability(&lights, Vec3::ZERO, None, light);
            assert!((0.8e-3..1.25e-3).contains(&probability), "{probability}");
        }
    }
}
