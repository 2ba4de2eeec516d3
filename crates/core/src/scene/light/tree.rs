//! A tree of lights, by which one of thousands is chosen in a time that grows with the logarithm of
//! their number (Conty Estevez and Kulla, "Importance Sampling of Many Lights with Adaptive Tree
//! Splitting", 2018; Pharr, Jakob and Humphreys, Physically Based Rendering, 4th ed., 12.6).
//!
//! Each node knows the box around its lights and their power. From a point, a child is chosen in
//! proportion to power over squared distance; a box behind a one-sided surface is left out.

use glam::Vec3;

use super::Light;
use crate::math::geometry::Extent;

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
    kind: Kind,
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
            let (extent, power) = (of.extent(), most(&of.power));
            self.nodes.push(Node { extent, power, kind: Kind::Leaf(light) });
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
        self.nodes.push(Node { extent: Extent::EMPTY, power: 0.0, kind: Kind::Inner(0) });
        let (first, second) = part.split_at_mut(half);
        self.add(lights, first, turns, depth + 1);
        let next = self.nodes.len();
        self.add(lights, second, turns | 1 << depth, depth + 1);
        let (a, b) = (&self.nodes[at + 1], &self.nodes[next]);
        let node = Node {
            extent: a.extent.join(b.extent),
            power: a.power + b.power,
            kind: Kind::Inner(next as u32),
        };
        self.nodes[at] = node;
    }

    /// Returns the approximate irradiance of all lights together at a point; 0 only where none
    /// shines. With a `normal`, light from behind does not count.
    pub fn importance(&self, point: Vec3, normal: Option<Vec3>) -> f32 {
        self.nodes.first().map_or(0.0, |root| root.importance(point, normal))
    }

    /// Chooses a light by a number in [0, 1), as a point sees them. Returns its index and the
    /// probability of the choice. `None` where no light can shine.
    pub fn choose(
        &self,
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
            let first = self.share(at, next, point, normal)?;
            if number < first {
                (at, probability, number) = (at + 1, probability * first, number / first);
            } else {
                let second = 1.0 - first;
                (at, probability, number) = (next, probability * second, (number - first) / second);
            }
        }
    }

    /// Returns the probability with which [`choose`](Self::choose) takes a light.
    pub fn probability(&self, point: Vec3, normal: Option<Vec3>, light: usize) -> f32 {
        let (mut at, mut probability, mut turns) = (0, 1.0, self.turns[light]);
        while let Some(Node { kind: Kind::Inner(next), .. }) = self.nodes.get(at) {
            let next = *next as usize;
            let Some(first) = self.share(at, next, point, normal) else { return 0.0 };
            (at, probability) = match turns & 1 {
                0 => (at + 1, probability * first),
                _ => (next, probability * (1.0 - first)),
            };
            turns >>= 1;
        }
        probability as f32
    }

    /// Returns the probability of the first child of a node. `None` where neither can shine.
    fn share(&self, at: usize, next: usize, point: Vec3, normal: Option<Vec3>) -> Option<f64> {
        let [first, second] =
            [at + 1, next].map(|child| self.nodes[child].importance(point, normal));
        let sum = first + second;
        (sum > 0.0).then(|| f64::from(first) / f64::from(sum))
    }
}

impl Node {
    /// Returns the approximate irradiance of the node's lights at a point; 0 only where none shines.
    fn importance(&self, point: Vec3, normal: Option<Vec3>) -> f32 {
        let Extent { min, max } = self.extent;
        let (half, away) = (0.5 * (max - min), self.extent.center() - point);
        // a little more than the box, because of rounding
        let reach = |normal: Vec3| 1.001 * half.dot(normal.abs()) + 1e-5 * away.length();
        if normal.is_some_and(|normal| away.dot(normal) < -reach(normal)) {
            return 0.0;
        }
        self.power / away.length_squared().max(half.length_squared()).max(f32::MIN_POSITIVE)
    }
}

fn most(power: &[f64]) -> f32 {
    power.iter().copied().fold(0.0, f64::max) as f32
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::light::{Cone, Lamp};

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
            let of = |light: usize| f64::from(tree.probability(point, normal, light));
            let sum: f64 = (0..lights.len()).map(of).sum();
            assert!((sum - 1.0).abs() < 1e-5, "{sum}");
            const NUMBERS: u32 = 200_000;
            let mut shares = vec![0.0; lights.len()];
            for i in 0..NUMBERS {
                let number = (f64::from(i) + 0.5) / f64::from(NUMBERS);
                let (light, probability) = tree.choose(point, normal, number).expect("a light");
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
        assert!(LightTree::new(&[]).choose(point, None, 0.5).is_none());
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
            let probability = tree.probability(Vec3::ZERO, None, light);
            assert!((probability - 1e-3).abs() < 1e-5, "{probability}");
        }
    }
}
