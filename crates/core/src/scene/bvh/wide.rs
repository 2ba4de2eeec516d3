//! Turns a binary tree into one with eight children per node, up to 32 at the root, and up to eight
//! triangles, discs or spheres per leaf.

use arrayvec::ArrayVec;

use super::layout::Row;
use super::pages::room_for;
use super::triangle::{INDICES, Leaf};
use super::walk::{CHILDLESS, CHILDREN, Child, NODE_ROWS, PAD, ROOT_NODES};
use crate::math::geometry::{Extent, Triangle};

/// A node of a binary tree with one triangle (or box) per leaf; the root comes first.
#[derive(Clone, Copy)]
pub(super) enum Branch {
    /// Two branches, of which the first has this index, an odd number, and the other the next one.
    Fork(u32),
    /// The triangle or box of this index.
    Thing(u32),
}

impl Branch {
    /// Returns the indices of the branches below a fork.
    #[inline]
    fn below(first: u32) -> [usize; 2] {
        [first as usize, first as usize + 1]
    }
}

/// A [`Branch`] in four bytes, as the list of all branches holds it: the highest bit is set in that
/// of a thing.
#[derive(Clone, Copy)]
pub(super) struct Packed(u32);

impl Packed {
    const THING: u32 = 1 << 31;

    #[inline]
    pub fn branch(self) -> Branch {
        match self.0 & Self::THING {
            0 => Branch::Fork(self.0),
            _ => Branch::Thing(self.0 & !Self::THING),
        }
    }
}

impl From<Branch> for Packed {
    #[inline]
    fn from(branch: Branch) -> Self {
        let (Branch::Fork(index) | Branch::Thing(index)) = branch;
        assert!(index < Self::THING, "fewer than 2^30 things");
        match branch {
            Branch::Fork(_) => Self(index),
            Branch::Thing(_) => Self(index | Self::THING),
        }
    }
}

/// Number of places for the children of a node, and for the triangles of a leaf.
const WIDTH: usize = 8;

/// What a tree arranges: triangles, discs and spheres, or boxes around what has a tree of its own.
pub(super) trait Things: Sync {
    /// The largest number of them in a leaf.
    const IN_LEAF: usize;
    /// The number of rows that a leaf needs.
    const LEAF_ROWS: usize;

    /// Returns the box around one of them.
    fn extent(&self, index: u32) -> Extent;

    /// Adds the leaf below a branch to the rows, if it needs any, and returns how it is named.
    fn leaf(&self, binary: &[Packed], branch: usize, rows: &mut Vec<Row>) -> Child;
}

impl Things for [Triangle] {
    const IN_LEAF: usize = WIDTH;
    const LEAF_ROWS: usize = size_of::<Leaf>() / size_of::<Row>();

    fn extent(&self, index: u32) -> Extent {
        Extent::of_triangles([&self[index as usize]])
    }

    fn leaf(&self, binary: &[Packed], branch: usize, rows: &mut Vec<Row>) -> Child {
        let mut leaf: Leaf = [Row([f32::NAN; WIDTH]); 10];
        things_below(binary, branch, &mut |lane, index| {
            let Triangle { a, b, c } = self[index as usize];
            for axis in 0..3 {
                for (corner, point) in [a, b, c].iter().enumerate() {
                    leaf[3 * axis + corner].0[lane] = point[axis];
                }
            }
            leaf[INDICES].0[lane] = f32::from_bits(index);
        });
        let child = Child::leaf(rows.len());
        rows.extend(leaf);
        child
    }
}

/// Triangles, the last of which are met only within boxes of their own.
pub(super) struct Within<'a> {
    pub triangles: &'a [Triangle],
    /// The boxes of the last triangles.
    pub boxes: Vec<Extent>,
}

impl Things for Within<'_> {
    const IN_LEAF: usize = <[Triangle]>::IN_LEAF;
    const LEAF_ROWS: usize = <[Triangle]>::LEAF_ROWS;

    fn extent(&self, index: u32) -> Extent {
        let first = self.triangles.len() - self.boxes.len();
        match (index as usize).checked_sub(first) {
            Some(place) => self.boxes[place],
            None => self.triangles.extent(index),
        }
    }

    fn leaf(&self, binary: &[Packed], branch: usize, rows: &mut Vec<Row>) -> Child {
        self.triangles.leaf(binary, branch, rows)
    }
}

/// A leaf is the index of a box, and has no rows: what is in the box is searched for elsewhere.
impl Things for [Extent] {
    const IN_LEAF: usize = 1;
    const LEAF_ROWS: usize = 0;

    fn extent(&self, index: u32) -> Extent {
        self[index as usize]
    }

    fn leaf(&self, binary: &[Packed], branch: usize, _: &mut Vec<Row>) -> Child {
        match binary[branch].branch() {
            Branch::Thing(index) => Child::leaf(index as usize),
            Branch::Fork(_) => unreachable!("a leaf holds one box"),
        }
    }
}

/// The wide tree.
pub(super) struct Wide {
    /// Each node, followed by its leaves, followed by the nodes below it.
    pub rows: Vec<Row>,
    /// Number of nodes that form the root, the first ones.
    pub root_nodes: usize,
    /// The largest number of children that can wait at the same time in a walk.
    pub waiting: usize,
}

/// Makes a binary tree wide, with a root of at most `root_nodes` nodes.
pub(super) fn widen<T: Things + ?Sized>(binary: &[Packed], things: &T, root_nodes: usize) -> Wide {
    struct Place {
        branch: usize,
        /// The row, and the place in it, that refers to the branch; `None` for the root.
        named: Option<(usize, usize)>,
        /// Number of children that may wait in the levels above.
        above: usize,
    }
    let parts = Parts::of(binary, things);
    let rows = room_for(parts.rows(root_nodes));
    let mut wide = Wide { rows, root_nodes: 1, waiting: 0 };
    let mut todo = vec![Place { branch: 0, named: None, above: 0 }];
    while let Some(Place { branch, named, above }) = todo.pop() {
        let most = if named.is_none() { root_nodes } else { 1 };
        let members = parts.members(branch, most * WIDTH);
        let nodes = members.len().div_ceil(WIDTH);
        let Wide { rows, root_nodes, waiting } = &mut wide;
        let first = rows.len();
        for _ in 0..nodes {
            rows.extend(CHILDLESS);
        }
        match named {
            Some((row, place)) => rows[row].0[place] = Child::node(first).as_float(),
            None => *root_nodes = nodes,
        }
        let above = above + members.len() - 1;
        *waiting = above.max(*waiting);
        let place = |i: usize| (first + NODE_ROWS * (i / WIDTH), i % WIDTH);
        for (i, &member) in members.iter().enumerate() {
            let (node, place) = place(i);
            let part = parts.at(member);
            let Extent { min, max } = padded(&part.extent);
            for axis in 0..3 {
                rows[node + 2 * axis].0[place] = min[axis];
                rows[node + 2 * axis + 1].0[place] = max[axis];
            }
            if part.leaf {
                let leaf = things.leaf(binary, member, rows);
                rows[node + CHILDREN].0[place] = leaf.as_float();
            }
        }
        for (i, &member) in members.iter().enumerate().rev() {
            if !parts.at(member).leaf {
                let (node, place) = place(i);
                todo.push(Place { branch: member, named: Some((node + CHILDREN, place)), above });
            }
        }
    }
    wide
}

/// Returns a box that is wider by the rounding of the tests of its planes and of the triangles in it
/// (see `Slabs` in `walk`).
fn padded(extent: &Extent) -> Extent {
    let reach = extent.min.abs().max(extent.max.abs());
    let pad = PAD * (reach + reach.max_element());
    Extent { min: extent.min - pad, max: extent.max + pad }
}

/// Calls `put` for each thing below a branch that becomes a leaf, with its lane and its index.
pub(super) fn things_below(binary: &[Packed], branch: usize, put: &mut impl FnMut(usize, u32)) {
    let (mut lane, mut waiting) = (0, ArrayVec::<usize, WIDTH>::from_iter([branch]));
    while let Some(branch) = waiting.pop() {
        match binary[branch].branch() {
            Branch::Fork(first) => waiting.extend(Branch::below(first).into_iter().rev()),
            Branch::Thing(index) => {
                put(lane, index);
                lane += 1;
            }
        }
    }
}

/// Bounds of the things below a branch of the binary tree, and what they cost.
#[derive(Clone, Copy)]
struct Part {
    /// The box around them.
    extent: Extent,
    /// Cost for a random ray, in nodes and leaves that it meets, if the branch takes 1, 2, ... up
    /// to 7 places of a node.
    costs: [f32; WIDTH - 1],
    /// Their number; if they are too many for a leaf, any that is too large.
    count: u8,
    /// Whether the branch is best made a leaf if it takes one place.
    leaf: bool,
}

/// The parts of a binary tree.
struct Parts<'a, T: ?Sized> {
    binary: &'a [Packed],
    things: &'a T,
    /// The part below each fork, in the order of the branches below them; that of a single thing is
    /// known from the thing.
    forks: Vec<Part>,
}

impl<'a, T: Things + ?Sized> Parts<'a, T> {
    /// Finds the costs of all branches by dynamic programming from the leaves up: Ylitie, Karras
    /// and Laine, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", HPG
    /// 2017. A leaf costs as much as a node, since its triangles are tested at once.
    fn of(binary: &'a [Packed], things: &'a T) -> Self {
        let empty = Part { extent: Extent::EMPTY, costs: [0.0; WIDTH - 1], count: 0, leaf: true };
        let mut parts = Self { binary, things, forks: vec![empty; binary.len() / 2] };
        for &first in downward(binary).iter().rev() {
            let [l, r] = Branch::below(first).map(|branch| parts.at(branch));
            let (extent, count) = (l.extent.join(r.extent), l.count.saturating_add(r.count));
            let area = extent.half_area();
            let as_node = area + l.shared(&r, WIDTH).1;
            let leaf = usize::from(count) <= T::IN_LEAF && area <= as_node;
            let mut costs = [if leaf { area } else { as_node }; WIDTH - 1];
            for places in 2..WIDTH {
                costs[places - 1] = costs[places - 2].min(l.shared(&r, places).1);
            }
            parts.forks[first as usize / 2] = Part { extent, costs, count, leaf };
        }
        parts
    }

    /// Returns what is below a branch.
    #[inline]
    fn at(&self, branch: usize) -> Part {
        match self.binary[branch].branch() {
            Branch::Fork(first) => self.forks[first as usize / 2],
            Branch::Thing(index) => {
                let extent = self.things.extent(index);
                let costs = [extent.half_area(); WIDTH - 1];
                Part { extent, costs, count: 1, leaf: true }
            }
        }
    }

    /// Returns the number of rows of the wide tree.
    fn rows(&self, root_nodes: usize) -> usize {
        let (mut rows, mut todo) = (0, vec![(0, root_nodes)]);
        while let Some((branch, most)) = todo.pop() {
            let members = self.members(branch, most * WIDTH);
            rows += NODE_ROWS * members.len().div_ceil(WIDTH);
            for member in members {
                match self.at(member).leaf {
                    true => rows += T::LEAF_ROWS,
                    false => todo.push((member, 1)),
                }
            }
        }
        rows
    }

    /// Returns the branches that become the children of a node: those that use eight places best.
    /// As long as there is `room`, the largest of them is replaced by its own children.
    fn members(&self, branch: usize, room: usize) -> ArrayVec<usize, { WIDTH * ROOT_NODES }> {
        let shared = |branch| {
            let mut members = ArrayVec::<usize, WIDTH>::new();
            self.share(branch, WIDTH, &mut members);
            members
        };
        let mut members: ArrayVec<_, _> = shared(branch).into_iter().collect();
        while members.len() < room {
            let nodes = (0..members.len()).filter(|&i| !self.at(members[i]).leaf);
            let area = |i: usize| self.at(members[i]).extent.half_area();
            let Some(largest) = nodes.max_by(|&i, &j| area(i).total_cmp(&area(j))) else { break };
            let own = shared(members[largest]);
            if members.len() - 1 + own.len() > room {
                break;
            }
            members.swap_remove(largest);
            members.extend(own);
        }
        members
    }

    /// Adds to `members` the branches, all below `branch`, that share `places` places of a node at
    /// the least cost.
    fn share(&self, branch: usize, places: usize, members: &mut ArrayVec<usize, WIDTH>) {
        match self.binary[branch].branch() {
            Branch::Fork(first) if !self.is_whole(first, places) => {
                let [left, right] = Branch::below(first);
                let (own, _) = self.at(left).shared(&self.at(right), places);
                self.share(left, own, members);
                self.share(right, places - own, members);
            }
            _ => members.push(branch),
        }
    }

    /// Returns whether a fork is best one child where it may have so many places.
    fn is_whole(&self, first: u32, places: usize) -> bool {
        let part = &self.forks[first as usize / 2];
        // a root that is best a leaf becomes the only child of a node
        if places == WIDTH { part.leaf } else { part.costs[places - 1] == part.costs[0] }
    }
}

impl Part {
    /// Returns how many of `places` places this child of a fork takes at the least cost, if the
    /// other child takes the rest, and the cost of both.
    fn shared(&self, other: &Self, places: usize) -> (usize, f32) {
        let cost = |own: usize| (own, self.costs[own - 1] + other.costs[places - own - 1]);
        let cheaper = |a: (usize, f32), b: (usize, f32)| if b.1 < a.1 { b } else { a };
        (2..places).map(cost).fold(cost(1), cheaper)
    }
}

/// Returns, for all forks, the first branch below, each before those that it forks into.
fn downward(binary: &[Packed]) -> Vec<u32> {
    let fork = |branch: usize| match binary[branch].branch() {
        Branch::Fork(first) => Some(first),
        Branch::Thing(_) => None,
    };
    let mut order = Vec::with_capacity(binary.len() / 2);
    order.extend(fork(0));
    let mut next = 0;
    while let Some(&first) = order.get(next) {
        order.extend(Branch::below(first).into_iter().filter_map(fork));
        next += 1;
    }
    order
}
