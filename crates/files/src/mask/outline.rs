//! Follows the edge between the texels of a mask that are there and those that are not, and
//! simplifies it without changing the area.

use std::{cmp::Reverse, collections::BinaryHeap};

use glam::DVec2;
use i_overlay::{
    core::{fill_rule::FillRule, overlay_rule::OverlayRule},
    float::overlay::FloatOverlay,
};

use super::bitmap::Bitmap;

/// The largest number of corners of the outline along the texels.
const MAX_CORNERS: usize = 2_000_000;

/// How far the simplified outline may be from the texels' edges where that is more than one texel,
/// as a part of the picture's longer side.
const TOLERANCE: f64 = 1.0 / 200.0;

/// The largest relative error of the area of all texels.
const AREA_ERROR: f64 = 1e-3;

/// The closed lines around the texels that are there, in texture coordinates. A point is there if
/// an odd number of lines goes around it.
#[derive(Debug)]
pub struct Outline {
    pub contours: Vec<Contour>,
}

/// One closed line, and the box around it.
#[derive(Debug)]
pub struct Contour {
    pub corners: Vec<[f64; 2]>,
    pub low: DVec2,
    pub high: DVec2,
}

impl Outline {
    /// Finds the outline of a bitmap. With `reach`, the texels of the border go on for so many
    /// pictures. Error, in words: it has too many corners.
    pub fn of(bitmap: &Bitmap, reach: Option<f64>) -> Result<Self, String> {
        let wider = reach.map(|_| padded(bitmap));
        let bitmap = wider.as_ref().unwrap_or(bitmap);
        let (w, h) = (bitmap.width as i64, bitmap.height as i64);
        let size = match reach {
            None => DVec2::new(w as f64, h as f64),
            Some(_) => DVec2::new((w - 2) as f64, (h - 2) as f64),
        };
        // where a line of the lattice lies, in texels
        let place = |line: i64, lines: i64, size: f64| match reach {
            None => line as f64,
            Some(reach) if line == 0 => -reach * size,
            Some(reach) if line == lines => (1.0 + reach) * size,
            Some(_) => (line - 1) as f64,
        };
        let loops: Vec<Vec<Corner>> = loops(bitmap)?
            .into_iter()
            .map(|line| {
                let corner = |(x, y): (i64, i64)| Corner {
                    at: DVec2::new(place(x, w, size.x), place(y, h, size.y)),
                    fixed: x == 0 || y == 0 || x == w || y == h,
                };
                line.into_iter().map(corner).collect()
            })
            .collect();
        let exact: f64 = loops.iter().map(|line| area(&positions(line))).sum();
        let mut tolerance = (TOLERANCE * size.max_element()).max(1.0);
        loop {
            let simple: Vec<Vec<DVec2>> = loops.iter().map(|l| simplified(l, tolerance)).collect();
            // where lines that are near each other came to cross, the area tells
            if tolerance < 0.1 || (covered(&simple) - exact).abs() <= AREA_ERROR * exact {
                let contours = simple.into_iter().map(|line| Contour::new(line, size)).collect();
                return Ok(Self { contours });
            }
            tolerance *= 0.5;
        }
    }
}

impl Contour {
    fn new(line: Vec<DVec2>, size: DVec2) -> Self {
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let corners = line.into_iter().map(|at| {
            let at = at / size;
            (low, high) = (low.min(at), high.max(at));
            at.to_array()
        });
        let corners = corners.collect();
        Self { corners, low, high }
    }
}

#[derive(Clone, Copy)]
struct Corner {
    at: DVec2,
    /// Whether it lies on the border of the picture, where it has to meet the next copy.
    fixed: bool,
}

fn positions(line: &[Corner]) -> Vec<DVec2> {
    line.iter().map(|corner| corner.at).collect()
}

/// Returns the bitmap with its border doubled.
fn padded(bitmap: &Bitmap) -> Bitmap {
    let (width, height) = (bitmap.width + 2, bitmap.height + 2);
    let within = |i: usize, size: usize| i.clamp(1, size) - 1;
    let texel = |i: usize| {
        let (row, column) = (within(i / width, bitmap.height), within(i % width, bitmap.width));
        bitmap.texels[row * bitmap.width + column]
    };
    Bitmap { width, height, texels: (0..width * height).map(texel).collect() }
}

/// Returns the area inside a closed line, counted negative where it runs clockwise.
fn area(line: &[DVec2]) -> f64 {
    let next = line.iter().cycle().skip(1);
    0.5 * line.iter().zip(next).map(|(p, q)| p.perp_dot(*q)).sum::<f64>()
}

/// Returns the area inside an odd number of lines.
fn covered(lines: &[Vec<DVec2>]) -> f64 {
    let lines: Vec<Vec<[f64; 2]>> =
        lines.iter().map(|line| line.iter().map(|p| p.to_array()).collect()).collect();
    let shapes = FloatOverlay::with_subj(&lines).overlay(OverlayRule::Subject, FillRule::EvenOdd);
    let of_line = |line: &Vec<[f64; 2]>| {
        area(&line.iter().map(|p| DVec2::from_array(*p)).collect::<Vec<_>>())
    };
    shapes.iter().flatten().map(of_line).sum::<f64>().abs()
}

/// Follows the edges of the texels that are there, which lie on the left. Only corners where a line
/// turns are returned.
fn loops(bitmap: &Bitmap) -> Result<Vec<Vec<(i64, i64)>>, String> {
    const STEPS: [(i64, i64); 4] = [(1, 0), (0, 1), (-1, 0), (0, -1)];
    /// The texels ahead of a corner on the left and on the right.
    const AHEAD: [[(i64, i64); 2]; 4] =
        [[(0, 0), (0, -1)], [(-1, 0), (0, 0)], [(-1, -1), (-1, 0)], [(0, -1), (-1, -1)]];
    let (w, h) = (bitmap.width as i64, bitmap.height as i64);
    let is_lower_edge = |x, y| bitmap.at(x, y) && !bitmap.at(x, y - 1);
    let mut followed = vec![false; bitmap.texels.len()];
    let (mut lines, mut corners) = (Vec::new(), 0);
    for (y, x) in (0..h).flat_map(|y| (0..w).map(move |x| (y, x))) {
        // each line has a lower edge
        if followed[(y * w + x) as usize] || !is_lower_edge(x, y) {
            continue;
        }
        let (mut at, mut heading, mut line) = ((x, y), 0, Vec::new());
        loop {
            if heading == 0 {
                let edge = &mut followed[(at.1 * w + at.0) as usize];
                if *edge {
                    break;
                }
                *edge = true;
            }
            at = (at.0 + STEPS[heading].0, at.1 + STEPS[heading].1);
            let [left, right] = AHEAD[heading].map(|(x, y)| bitmap.at(at.0 + x, at.1 + y));
            let turn = match (left, right) {
                // texels that meet at a corner alone stay apart
                (false, _) => 1,
                (true, true) => 3,
                (true, false) => continue,
            };
            heading = (heading + turn) % 4;
            line.push(at);
        }
        corners += line.len();
        if corners > MAX_CORNERS {
            return Err(format!(
                "has an outline of more than {MAX_CORNERS} corners; shrink or smooth the picture"
            ));
        }
        lines.push(line);
    }
    Ok(lines)
}

/// A corner of a line that is being simplified.
#[derive(Clone, Copy)]
struct Node {
    at: DVec2,
    fixed: bool,
    /// The corner of the texels' line that it stands for.
    origin: usize,
    before: usize,
    after: usize,
    /// Counts the changes near it, so that outdated plans are known; `None` once it is gone.
    version: Option<u32>,
}

/// Simplifies a closed line: again and again the edge is taken out that changes the line least, and
/// its two corners become one, placed so that the area stays (Kronenfeld et al. 2020). No corner of
/// the line comes to lie further than `tolerance` from the new line, nor a new corner from the line.
fn simplified(line: &[Corner], tolerance: f64) -> Vec<DVec2> {
    let n = line.len();
    let length: f64 = (0..n).map(|i| line[i].at.distance(line[(i + 1) % n].at)).sum();
    // what is narrow is kept more exactly
    let tolerance = tolerance.min(0.5 * area(&positions(line)).abs() / length);
    let mut nodes: Vec<Node> = line
        .iter()
        .enumerate()
        .map(|(i, corner)| Node {
            at: corner.at,
            fixed: corner.fixed,
            origin: i,
            before: (i + n - 1) % n,
            after: (i + 1) % n,
            version: Some(0),
        })
        .collect();
    let mut plans = BinaryHeap::new();
    let add = |nodes: &[Node], plans: &mut BinaryHeap<_>, b: usize| {
        if let Some((cost, ..)) = plan(line, nodes, b, tolerance) {
            // costs are not negative, so their bits are in their order
            plans.push(Reverse((cost.to_bits(), b, nodes[b].version)));
        }
    };
    (0..n).for_each(|b| add(&nodes, &mut plans, b));
    let mut left = n;
    let mut last = 0;
    while let Some(Reverse((_, b, version))) = plans.pop() {
        if left <= 4 || version.is_none() || nodes[b].version != version {
            continue;
        }
        let Some((_, at, origin)) = plan(line, &nodes, b, tolerance) else { continue };
        let c = nodes[b].after;
        let (a, d) = (nodes[b].before, nodes[c].after);
        nodes[c].version = None;
        (nodes[b].at, nodes[b].origin, nodes[b].after) = (at, origin, d);
        nodes[d].before = b;
        left -= 1;
        last = b;
        for changed in [nodes[a].before, a, b, d] {
            nodes[changed].version = nodes[changed].version.map(|version| version + 1);
            add(&nodes, &mut plans, changed);
        }
    }
    let mut simple = Vec::with_capacity(left);
    let mut node = last;
    loop {
        simple.push(nodes[node].at);
        node = nodes[node].after;
        if node == last {
            return simple;
        }
    }
}

/// Finds the corner that could replace `b` and the one after it: its cost, its place, and the
/// corner of the texels' line that it stands for.
fn plan(line: &[Corner], nodes: &[Node], b: usize, tolerance: f64) -> Option<(f64, DVec2, usize)> {
    let n = line.len();
    let c = nodes[b].after;
    if nodes[b].fixed || nodes[c].fixed {
        return None;
    }
    let (first, end) = (nodes[nodes[b].before], nodes[nodes[c].after]);
    let (pa, pb, pc, pd) = (first.at, nodes[b].at, nodes[c].at, end.at);
    let base = pd - pa;
    // twice the area between the line and its chord, which stays
    let twice = (pb - pa).perp_dot(pc - pa) + (pc - pa).perp_dot(base);
    let span = (end.origin + n - first.origin) % n;
    let origins = || (0..=span).map(|i| (first.origin + i) % n);
    let along = |from: DVec2, to: DVec2, scale: f64| {
        let t = twice / scale;
        t.is_finite().then(|| from + t * (to - from))
    };
    let places = match twice.abs() < 1e-9 {
        true => [Some(0.5 * (pa + pd)), None],
        false => [along(pa, pb, (pb - pa).perp_dot(base)), along(pd, pc, (pc - pd).perp_dot(base))],
    };
    let mut best: Option<(f64, DVec2, usize)> = None;
    for place in places.into_iter().flatten() {
        let moved = |p: DVec2| to_segment(p, pa, place).min(to_segment(p, place, pd));
        let cost = moved(pb).max(moved(pc));
        if cost > tolerance || best.is_some_and(|(least, ..)| least <= cost) {
            continue;
        }
        let mut nearest = (f64::INFINITY, first.origin);
        let mut is_near = true;
        for i in origins() {
            is_near &= moved(line[i].at) <= tolerance;
            let distance = to_segment(place, line[i].at, line[(i + 1) % n].at);
            if distance < nearest.0 {
                nearest = (distance, i);
            }
        }
        if is_near && nearest.0 <= tolerance {
            best = Some((cost, place, nearest.1));
        }
    }
    best
}

/// Returns the distance of a point from a segment.
fn to_segment(p: DVec2, from: DVec2, to: DVec2) -> f64 {
    let along = to - from;
    let t = ((p - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
    // a segment without length gives 0 / 0
    p.distance(from + if t.is_nan() { 0.0 } else { t } * along)
}
