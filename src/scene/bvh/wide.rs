//! Turns a binary tree into one with eight children per node, up to 32 at the root, and up to eight
//! triangles per leaf.

use arrayvec::ArrayVec;

use super::layout::Row;
use super::triangle::{INDICES, Leaf};
use super::walk::{CHILDLESS, CHILDREN, Child, NODE_ROWS, PAD, ROOT_NODES};
use crate::math::geometry::{Extent, Triangle};

/// A node of a binary tree with one triangle (or box) per leaf; the root comes first.
#[derive(Clone, Copy)]
pub(super) enum Branch {
    Fork([usize; 2]),
    Thing(u32),
}

/// Number of places for the children of a node, and for the triangles of a leaf.
const WIDTH: usize = 8;

/// What a tree arranges: triangles, or boxes around what has a tree of its own.
pub(super) trait Things: Sync {
    /// The largest number of them in a leaf.
    const IN_LEAF: usize;

    /// Returns the box around one of them.
    fn extent(&self, index: u32) -> Extent;

    /// Adds the leaf below a branch to the rows, if it needs any, and returns how it is named.
    fn leaf(&self, binary: &[Branch], branch: usize, rows: &mut Vec<Row>) -> Child;
}

impl Things for [Triangle] {
    const IN_LEAF: usize = WIDTH;

    fn extent(&self, index: u32) -> Extent {
        Extent::of_triangles([&self[index as usize]])
    }

    fn leaf(&self, binary: &[Branch], branch: usize, rows: &mut Vec<Row>) -> Child {
        let mut leaf = [Row([f32::NAN; WIDTH]); 10];
        fill(&mut leaf, &mut 0, binary, branch, self);
        let child = Child::leaf(rows.len());
        rows.extend(leaf);
        child
    }
}

/// A leaf is the index of a box, and has no rows: what is in the box is searched for elsewhere.
impl Things for [Extent] {
    const IN_LEAF: usize = 1;

    fn extent(&self, index: u32) -> Extent {
        self[index as usize]
    }

    fn leaf(&self, binary: &[Branch], branch: usize, _: &mut Vec<Row>) -> Child {
        match binary[branch] {
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
pub(super) fn widen<T: Things + ?Sized>(binary: &[Branch], things: &T, root_nodes: usize) -> Wide {
    struct Place {
        branch: usize,
        /// The row, and the place in it, that refers to the branch; `None` for the root.
        named: Option<(usize, usize)>,
        /// Number of children that may wait in the levels above.
        above: usize,
    }
    let parts = parts(binary, things);
    let mut wide = Wide { rows: Vec::new(), root_nodes: 1, waiting: 0 };
    let mut todo = vec![Place { branch: 0, named: None, above: 0 }];
    while let Some(Place { branch, named, above }) = todo.pop() {
        let most = if named.is_none() { root_nodes } else { 1 };
        let members = members(binary, &parts, branch, most * WIDTH);
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
            let part = &parts[member];
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
            if !parts[member].leaf {
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

/// Returns the branches that become the children of a node: those that use eight places best. As
/// long as there is `room`, the largest of them is replaced by its own children.
fn members(
    binary: &[Branch],
    parts: &[Part],
    branch: usize,
    room: usize,
) -> ArrayVec<usize, { WIDTH * ROOT_NODES }> {
    let shared = |branch| {
        let mut members = ArrayVec::<usize, WIDTH>::new();
        share(binary, parts, branch, WIDTH, &mut members);
        members
    };
    let mut members: ArrayVec<_, _> = shared(branch).into_iter().collect();
    while members.len() < room {
        let nodes = (0..members.len()).filter(|&i| !parts[members[i]].leaf);
        let area = |i: usize| parts[members[i]].extent.half_area();
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

/// Adds to `members` the branches, all below `branch`, that share `places` places of a node at the
/// least cost.
fn share(
    binary: &[Branch],
    parts: &[Part],
    branch: usize,
    places: usize,
    members: &mut ArrayVec<usize, WIDTH>,
) {
    let part = &parts[branch];
    // a root that is best a leaf becomes the only child of a node
    let whole = if places == WIDTH { part.leaf } else { part.costs[places] == part.costs[1] };
    match binary[branch] {
        Branch::Fork([l, r]) if !whole => {
            let (own, _) = parts[l].shared(&parts[r], places);
            share(binary, parts, l, own, members);
            share(binary, parts, r, places - own, members);
        }
        _ => members.push(branch),
    }
}

/// Puts a branch's triangles into the lanes of a leaf from `lane` on.
fn fill(
    leaf: &mut Leaf,
    lane: &mut usize,
    binary: &[Branch],
    branch: usize,
    triangles: &[Triangle],
) {
    match binary[branch] {
        Branch::Fork([l, r]) => {
            fill(leaf, lane, binary, l, triangles);
            fill(leaf, lane, binary, r, triangles);
        }
        Branch::Thing(index) => {
            let Triangle { a, b, c } = triangles[index as usize];
            for axis in 0..3 {
                for (corner, point) in [a, b, c].iter().enumerate() {
                    leaf[3 * axis + corner].0[*lane] = point[axis];
                }
            }
            leaf[INDICES].0[*lane] = f32::from_bits(index);
            *lane += 1;
        }
    }
}

/// Bounds and number of the things below a branch of the binary tree.
#[derive(Clone, Copy)]
struct Part {
    /// The box around them.
    extent: Extent,
    /// Their number.
    count: usize,
    /// Cost for a random ray, in nodes and leaves that it meets, if the branch takes 1, up to 2,
    /// ... up to 7 places of a node (entry 0 is not used).
    costs: [f32; WIDTH],
    /// Whether the branch is best made a leaf if it takes one place.
    leaf: bool,
}

/// Finds the costs of all branches by dynamic programming from the leaves up: Ylitie, Karras and
/// Laine, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", HPG 2017. A
/// leaf costs as much as a node, since its triangles are tested at once.
fn parts<T: Things + ?Sized>(binary: &[Branch], things: &T) -> Vec<Part> {
    let empty = Part { extent: Extent::EMPTY, count: 0, costs: [0.0; WIDTH], leaf: true };
    let mut parts = vec![empty; binary.len()];
    for &i in downward(binary).iter().rev() {
        parts[i] = match binary[i] {
            Branch::Thing(index) => {
                let extent = things.extent(index);
                Part { extent, count: 1, costs: [extent.half_area(); WIDTH], leaf: true }
            }
            Branch::Fork([l, r]) => {
                let (l, r) = (&parts[l], &parts[r]);
                let (extent, count) = (l.extent.join(r.extent), l.count + r.count);
                let area = extent.half_area();
                let as_node = area + l.shared(r, WIDTH).1;
                let leaf = count <= T::IN_LEAF && area <= as_node;
                let mut costs = [if leaf { area } else { as_node }; WIDTH];
                for places in 2..WIDTH {
                    costs[places] = costs[places - 1].min(l.shared(r, places).1);
                }
                Part { extent, count, costs, leaf }
            }
        };
    }
    parts
}

impl Part {
    /// Returns how many of `places` places this child of a fork takes at the least cost, if the
    /// other child takes the rest, and the cost of both.
    fn shared(&self, other: &Self, places: usize) -> (usize, f32) {
        let cost = |own: usize| (own, self.costs[own] + other.costs[places - own]);
        let cheaper = |a: (usize, f32), b: (usize, f32)| if b.1 < a.1 { b } else { a };
        (2..places).map(cost).fold(cost(1), cheaper)
    }
}

/// Returns all branches, each before those that it forks into.
fn downward(binary: &[Branch]) -> Vec<usize> {
    let mut order = Vec::with_capacity(binary.len());
    order.push(0);
    let mut next = 0;
    while let Some(&branch) = order.get(next) {
        if let Branch::Fork(children) = binary[branch] {
            order.extend(children);
        }
        next += 1;
    }
    order
}
