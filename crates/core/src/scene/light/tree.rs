//! A tree of lights, by which one of thousands is chosen in a time that grows with the logarithm of
//! their number (Conty Estevez and Kulla, "Importance Sampling of Many Lights with Adaptive Tree
//! Splitting", 2018; Pharr, Jakob and Humphreys, Physically Based Rendering, 4th ed., 12.6).
//!
//! Each node knows of up to eight children the boxes around their lights, their power, and cones
//! around the directions in which they face. From a point, a child is chosen in proportion to what it
//! may bring there, by power, distance and the cosines at both ends; a child that is one light says
//! itself what it brings. A box behind a one-sided surface is left out. What all children bring is
//! computed at once, in arrays.

use std::{array::from_fn, f32::consts::PI};

use glam::Vec3;

use super::Light;
use crate::math::{effort, geometry::Extent};

/// What faces away from a point counts at least this much, because some light may come from there all
/// the same.
const LEAST_COS: f32 = 0.05;
/// The most children of a node, and the bits that name one.
const WIDTH: usize = 1 << BITS;
const BITS: u32 = 3;

/// The lights of a scene as a tree, without those at infinity.
#[derive(Debug)]
pub struct LightTree {
    /// The root first, each parent before its children.
    nodes: Vec<Node>,
    /// For each light the turns from the root to it: a child for each level, the first in the lowest
    /// bits; above the last turn stands a 1.
    turns: Vec<u64>,
}

/// One number for each child of a node.
type Each = [f32; WIDTH];

/// The children of a node, coordinate by coordinate.
#[derive(Debug)]
struct Node {
    /// Middle and half sides of the box around a child's lights, m.
    middle: [Each; 3],
    half: [Each; 3],
    /// Power in the brightest band, W or umol/s; 0 where there is no child.
    power: Each,
    /// Unit vector along the axis of a cone around the directions in which the lights face, and
    /// cosine and sine of its half angle.
    axis: [Each; 3],
    cos: Each,
    sin: Each,
    /// Largest side face of the box, over 2 pi, m2.
    area: Each,
    child: [Child; WIDTH],
}

#[derive(Clone, Copy, Debug)]
enum Child {
    None,
    /// Index of a node.
    Node(u32),
    /// Index of a light.
    Light(u32),
}

/// What is known of the lights below a node, or of one light.
struct Lights {
    extent: Extent,
    power: f32,
    cone: Cone,
    child: Child,
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

    /// Adds a node of these lights, and returns what is known of them.
    fn add(&mut self, lights: &[Light], all: &mut [u32], turns: u64, depth: u32) -> Lights {
        let at = self.nodes.len();
        self.nodes.push(Node::EMPTY);
        let mut joined = Lights {
            extent: Extent::EMPTY,
            power: 0.0,
            cone: Cone::ALL,
            child: Child::Node(at as u32),
        };
        for (lane, part) in parts(lights, all, BITS).into_iter().enumerate() {
            let own = turns | (lane as u64) << (BITS * depth);
            let of = match *part {
                [light] => {
                    self.turns[light as usize] = own | 1 << (BITS * (depth + 1));
                    Lights::of(&lights[light as usize], light)
                }
                _ => self.add(lights, part, own, depth + 1),
            };
            joined.extent = joined.extent.join(of.extent);
            joined.power += of.power;
            joined.cone = if lane == 0 { of.cone } else { joined.cone.join(of.cone) };
            self.nodes[at].set(lane, &of, lights);
        }
        joined
    }

    /// Returns the approximate irradiance of all lights together at a point; 0 only where none
    /// shines. With a `normal`, light from behind does not count.
    pub fn importance(&self, lights: &[Light], point: Vec3, normal: Option<Vec3>) -> f32 {
        self.nodes.first().map_or(0.0, |root| root.brings(lights, point, normal).iter().sum())
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
            let node = self.nodes.get(at)?;
            let brings = node.brings(lights, point, normal).map(f64::from);
            let sum: f64 = brings.iter().sum();
            let mut rest = number * sum;
            let shines = (0..WIDTH).filter(|&lane| brings[lane] > 0.0);
            // rounding may leave a rest beyond the last one
            let mut chosen = None;
            for lane in shines {
                if let Some(before) = chosen {
                    rest -= brings[before];
                }
                chosen = Some(lane);
                if rest < brings[lane] {
                    break;
                }
            }
            let lane = chosen?;
            probability *= brings[lane] / sum;
            number = (rest / brings[lane]).min(1.0 - f64::EPSILON);
            at = match node.child[lane] {
                Child::Node(next) => next as usize,
                Child::Light(light) => return Some((light as usize, probability as f32)),
                Child::None => return None,
            };
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
        while turns > 1 {
            let node = &self.nodes[at];
            let brings = node.brings(lights, point, normal).map(f64::from);
            let lane = turns as usize % WIDTH;
            if brings[lane] == 0.0 {
                return 0.0;
            }
            probability *= brings[lane] / brings.iter().sum::<f64>();
            if let Child::Node(next) = node.child[lane] {
                at = next as usize;
            }
            turns >>= BITS;
        }
        probability as f32
    }
}

/// Parts lights into two halves along the longest side of the box around their middles, each of
/// these again, and so on so many times, as long as there is more than one.
fn parts<'l>(lights: &[Light], all: &'l mut [u32], times: u32) -> Vec<&'l mut [u32]> {
    if times == 0 || all.len() == 1 {
        return vec![all];
    }
    let middle = |light: u32| lights[light as usize].extent().center();
    let size = Extent::of(all.iter().map(|&light| middle(light))).size();
    let axis = (0..3).fold(0, |best, axis| if size[axis] > size[best] { axis } else { best });
    let half = all.len() / 2;
    // equal places in the order of the lights, so that the tree is the same each time
    all.select_nth_unstable_by(half, |&a, &b| {
        middle(a)[axis].total_cmp(&middle(b)[axis]).then(a.cmp(&b))
    });
    let (first, second) = all.split_at_mut(half);
    let mut both = parts(lights, first, times - 1);
    both.extend(parts(lights, second, times - 1));
    both
}

impl Lights {
    fn of(light: &Light, index: u32) -> Self {
        Self {
            extent: light.extent(),
            power: most(&light.power),
            cone: Cone::of(light),
            child: Child::Light(index),
        }
    }
}

impl Node {
    const EMPTY: Self = Self {
        middle: [[0.0; WIDTH]; 3],
        half: [[0.0; WIDTH]; 3],
        power: [0.0; WIDTH],
        axis: [[0.0; WIDTH]; 3],
        cos: [-1.0; WIDTH],
        sin: [0.0; WIDTH],
        area: [0.0; WIDTH],
        child: [Child::None; WIDTH],
    };

    fn set(&mut self, lane: usize, of: &Lights, lights: &[Light]) {
        let (middle, size) = (of.extent.center(), of.extent.size());
        // a point, and a light with an axis, knows by itself how it shines: half of what it brings in
        // the mean over all directions, as its importance counts
        let knows = match of.child {
            Child::Light(light) => {
                let light = &lights[light as usize];
                light.axis().is_some() || light.irradiance(Vec3::Z).is_some()
            }
            _ => false,
        };
        let (cone, power) = if knows { (Cone::ALL, 2.0 * of.power) } else { (of.cone, of.power) };
        for axis in 0..3 {
            self.middle[axis][lane] = middle[axis];
            self.half[axis][lane] = 0.5 * size[axis];
            self.axis[axis][lane] = cone.axis[axis];
        }
        self.power[lane] = power;
        (self.cos[lane], self.sin[lane]) = (cone.cos, cone.sin);
        self.area[lane] = (size.x * size.y).max(size.y * size.z).max(size.z * size.x) / (2.0 * PI);
        self.child[lane] = of.child;
    }

    /// Returns the approximate irradiance of each child's lights at a point; 0 only where none
    /// shines.
    fn brings(&self, lights: &[Light], point: Vec3, normal: Option<Vec3>) -> Each {
        let (faces, d2) = match normal {
            Some(normal) => self.seen::<true>(point, normal),
            None => self.seen::<false>(point, Vec3::ZERO),
        };
        let mut singles = 0;
        let brings = from_fn(|lane| match self.child[lane] {
            Child::Light(light) if faces[lane] > 0.0 => {
                singles += 1;
                faces[lane] * lights[light as usize].importance(point, None)
            }
            _ => faces[lane] / d2[lane],
        });
        effort::spend((WIDTH as u64 + singles) * effort::LIGHT);
        brings
    }

    /// Returns, for each child, its power times the cosines at the point and at the lights, relative
    /// to the mean over all directions, and the square of its distance, m2. With `ONE_SIDED`, light
    /// from behind the normal does not count.
    fn seen<const ONE_SIDED: bool>(&self, point: Vec3, normal: Vec3) -> (Each, Each) {
        let (mut faces, mut distances) = ([0.0; WIDTH], [0.0; WIDTH]);
        for lane in 0..WIDTH {
            let of = |each: &[Each; 3]| Vec3::new(each[0][lane], each[1][lane], each[2][lane]);
            let (away, half) = (of(&self.middle) - point, of(&self.half));
            let (d2, r2) = (away.length_squared().max(f32::MIN_POSITIVE), half.length_squared());
            let d = d2.sqrt();
            // the box is seen within an angle of this sine and cosine about its middle: from close by
            // anywhere on that side
            let sin2 = (r2 / d2).min(1.0);
            let (sin, cos) = (sin2.sqrt(), (1.0 - sin2).sqrt());
            let mut arrives = 1.0;
            if ONE_SIDED {
                let along = away.dot(normal);
                // a little more than the box, because of rounding
                let reach = 1.001 * half.dot(normal.abs()) + 1e-5 * d;
                let cosine = cos_less(along / d, sin, cos).max(LEAST_COS);
                arrives = if along < -reach { 0.0 } else { cosine };
            }
            // each light is taken to shine in proportion to the cosine, which is a quarter in the
            // mean over all directions
            let nearest = cos_less(-of(&self.axis).dot(away) / d, sin, cos);
            let leaves = 4.0 * cos_less(nearest, self.sin[lane], self.cos[lane]).max(LEAST_COS);
            let leaves = if self.cos[lane] < 0.0 { 1.0 } else { leaves };
            faces[lane] = self.power[lane] * arrives * leaves;
            // close to lights that fill their box evenly, what they bring depends on the area
            // on which they are, and not on where its middle is
            let nearest = (away.abs() - half).max(Vec3::ZERO).length_squared();
            distances[lane] = d2.max(nearest + self.area[lane]);
        }
        (faces, distances)
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
