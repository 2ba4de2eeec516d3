//! Checks of closed solids: outside a solid, the program knows only air.

use std::collections::BTreeMap;

use glam::Vec3;
use rayon::prelude::*;

use super::{
    mesh::{Piece, Pieces, Welded, pieces},
    remarks::{Remarks, length, place},
};
use phylux_core::{
    math::{
        geometry::{Ray, Triangle, closeness},
        rng::Stream,
    },
    scene::{bvh::Bvh, material::Material, world::Scene},
};

/// Solids closer to each other than this, in what rounding takes for one place, count as touching.
const TOUCH: f32 = 10.0;
/// Solids thinner than this, in what rounding takes for one place, cannot be traced.
const THIN: f32 = 4.0;
/// The largest number of other solids that are checked for touching one triangle. If many overlap,
/// there are as many pairs as the square of their number.
const NEIGHBOURS: usize = 16;
/// The largest number of faces that are checked along the way out of a solid.
const FACES: usize = 1000;
/// A closed sheet is a flat box if it is thinner than this, relative to the square root of its
/// area.
const FLAT: f64 = 0.02;
/// A direction in which no two points of a model are likely to lie.
const SKEW: Vec3 = Vec3::new(0.601_3, 0.235_7, 0.763_5);

/// Adds remarks on the interfaces of solids.
pub(super) fn check_solids(scene: &Scene, welded: &Welded, remarks: &mut Remarks) {
    let solids = Solids::new(scene, welded);
    if !solids.pieces.is_empty() {
        check_shapes(&solids, remarks);
        check_neighbours(&solids, welded, remarks);
        note_lights(&solids, remarks);
    }
}

/// Checks each solid by itself.
fn check_shapes(solids: &Solids, remarks: &mut Remarks) {
    let pieces = &solids.pieces;
    let with = |of: fn(&Piece) -> usize, what: &'static str| {
        let found = (0..pieces.len()).filter(move |&p| of(&pieces[p]) > 0);
        found.map(move |p| format!("{} ({} {what})", solids.name(p), of(&pieces[p])))
    };
    remarks.warn_of(with(|p| p.open_edges, "open edges"), |list| {
        format!(
            "solids that are not closed: {list}; close the mesh, with equal coordinates where \
            faces meet, or set `\"thin\": true` if it stands for a sheet"
        )
    });
    remarks.warn_of(with(|p| p.turned_edges, "edges"), |list| {
        format!(
            "solids whose neighbouring faces turn opposite sides out: {list}; turn all normals out"
        )
    });
    let least = f64::from(THIN * solids.closeness);
    let thin = |p: usize| pieces[p].is_closed() && pieces[p].thickness() < least;
    remarks.warn_of(solids.names(thin), |list| {
        let least = length(least);
        format!(
            "solids thinner than can be traced in a scene of this size ({least}): {list}; use a \
            sheet (`\"thin\": true`)"
        )
    });
}

/// Checks solids against each other.
fn check_neighbours(solids: &Solids, welded: &Welded, remarks: &mut Remarks) {
    let reach = TOUCH * solids.closeness;
    let Touching { pairs: touching, crowded } = solids.touching(welded, reach);
    remarks.warn_of(touching.iter().map(|pair| solids.pair(pair, "and")), |list| {
        let gap = length(reach.into());
        format!(
            "solids that touch or cut each other: {list}; between solids there is only air here: \
            join them to one, or leave a gap above {gap}"
        )
    });
    remarks.warn_of(solids.names(|p| crowded[p]), |list| {
        format!(
            "solids that touch more than {NEIGHBOURS} others in one place, too many to be looked at: {list}; \
            remove those that stand there more than once"
        )
    });
    let surroundings = solids.surroundings(&touching, &crowded);
    remarks.warn_of(solids.names(|p| surroundings[p] == Around::Unknown), |list| {
        format!(
            "solids with more than {FACES} faces of solids on the way out of them, too many to be looked \
            at: {list}; remove those that stand in one another"
        )
    });
    remarks.warn_of(solids.names(|p| surroundings[p] == Around::InsideOut), |list| {
        format!("solids inside out: {list}; turn their normals out")
    });
    let nested = surroundings.iter().enumerate().filter_map(|(p, around)| match around {
        Around::Solid(outer) => Some(solids.pair(&[p, *outer], "in")),
        _ => None,
    });
    remarks.warn_of(nested, |list| {
        format!(
            "solids inside another: {list}; outside a solid there is only air here: cut a cavity \
            around it (faces of the outer material, normals towards the cavity)"
        )
    });
}

fn note_lights(solids: &Solids, remarks: &mut Remarks) {
    let scene = solids.scene;
    let inside = scene.lights().iter().filter_map(|light| {
        let start = light.emit(&mut Stream::new(0, 0, 0)).origin;
        let outer = solids.innermost(&solids.windings(start)?)?;
        Some(format!("`{}` in {}", light.name, solids.name(outer)))
    });
    remarks.note_of(inside, |list| {
        format!("lights inside a solid: {list}; their power is that which they emit in there")
    });
}

/// Adds remarks on panes and thin leaves that are modelled with both faces.
pub(super) fn check_sheets(scene: &Scene, welded: &Welded, remarks: &mut Remarks) {
    let Pieces { list, .. } = pieces(scene, welded, |triangle| {
        let surface = &scene.surface(triangle);
        let thin = matches!(
            scene.material(surface),
            Material::Pane(_) | Material::Leaf(_) | Material::Table(_)
        );
        thin.then_some(surface.material)
    });
    let boxes = list
        .iter()
        .filter(|p| p.is_closed() && p.area > 0.0 && p.thickness() < FLAT * (0.5 * p.area).sqrt());
    let names = boxes.map(|p| format!("{} ({} thick)", name(scene, p), length(p.thickness())));
    remarks.warn_of(names, |list| {
        format!(
            "flat closed boxes of a thin material, so that light passes two sheets: {list}; keep one \
            face, or set `\"thin\": false`"
        )
    });
}

/// Returns the name of a piece: its captor or material, and its place.
fn name(scene: &Scene, piece: &Piece) -> String {
    let surface = &scene.surface(piece.triangles[0]);
    let what = match surface.captor() {
        Some(captor) => &scene.captors()[captor].id,
        None => &scene.materials()[surface.material as usize].name,
    };
    format!("`{what}` at {}", place(scene, piece.extent.center()))
}

/// The medium on the side to which a solid's normals point.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Around {
    Air,
    Solid(usize),
    InsideOut,
    /// Not known: there are more faces than are checked.
    Unknown,
}

/// The solids that touch or overlap each other.
struct Touching {
    /// Pairs of closed pieces, sorted.
    pairs: Vec<[usize; 2]>,
    /// For each piece, whether it touches more others than were checked.
    crowded: Vec<bool>,
}

/// All solids of a scene.
struct Solids<'a> {
    scene: &'a Scene,
    pieces: Vec<Piece>,
    /// Pairs of pieces that share an edge.
    meeting: Vec<[usize; 2]>,
    triangles: Vec<Triangle>,
    /// For each of `triangles`, the index of its piece.
    owners: Vec<u32>,
    bvh: Bvh,
    /// The distance within which rounding makes points of any of these one, m.
    closeness: f32,
}

impl<'a> Solids<'a> {
    fn new(scene: &'a Scene, welded: &Welded) -> Self {
        // materials of one refractive index may share a solid: they differ only in tint
        let Pieces { list, meeting } =
            pieces(scene, welded, |triangle| match scene.material(&scene.surface(triangle)) {
                Material::Dielectric(solid) => Some(solid.ior().to_bits()),
                _ => None,
            });
        let members =
            || list.iter().zip(0..).flat_map(|(p, i)| p.triangles.iter().map(move |t| (*t, i)));
        let triangles: Vec<Triangle> = members().map(|(t, _)| scene.triangles().at(t)).collect();
        let owners = members().map(|(_, piece)| piece).collect();
        let bvh = Bvh::build(&triangles);
        let reach = triangles.iter().map(Triangle::reach).fold(Vec3::ZERO, Vec3::max);
        let closeness = closeness(reach);
        Self { scene, pieces: list, meeting, triangles, owners, bvh, closeness }
    }

    fn name(&self, piece: usize) -> String {
        name(self.scene, &self.pieces[piece])
    }

    fn names(&self, wanted: impl Fn(usize) -> bool) -> impl Iterator<Item = String> {
        (0..self.pieces.len()).filter(move |&p| wanted(p)).map(|p| self.name(p))
    }

    fn pair(&self, &[p, q]: &[usize; 2], word: &str) -> String {
        match p == q {
            true => format!("{} {word} itself", self.name(p)),
            false => format!("{} {word} {}", self.name(p), self.name(q)),
        }
    }

    /// Returns the pairs of closed pieces that share a vertex, cut each other or are closer than
    /// `reach`. For each triangle, only the first pieces that are found count.
    fn touching(&self, welded: &Welded, reach: f32) -> Touching {
        let mut pairs = self.meeting.clone();
        let mut owner_of_vertex = vec![usize::MAX; 3 * welded.triangles.len()];
        for (p, piece) in self.pieces.iter().enumerate() {
            for vertex in piece.triangles.iter().flat_map(|&t| welded.vertices_of(t)) {
                let owner = &mut owner_of_vertex[vertex as usize];
                if *owner != usize::MAX && *owner != p {
                    pairs.push([*owner, p]);
                }
                *owner = p;
            }
        }
        // no other piece may cross the line through the middle of each triangle, which reaches out
        // on both sides, nor its edges, moved out by the reach; the line comes first, because moved
        // edges pass by copies in the same place and find none of them
        let others = |i: usize| {
            let t = &self.triangles[i];
            let out = reach * t.normal();
            let (a, b, c, m) = (t.a + out, t.b + out, t.c + out, t.centroid());
            let own = self.owners[i] as usize;
            let mut found = Vec::new();
            let crowded =
                [(m - out, m + out), (a, b), (b, c), (c, a)].into_iter().any(|(from, to)| {
                    let way = to - from;
                    let ray = Ray { origin: from, direction: way.normalize_or_zero() };
                    way != Vec3::ZERO
                        && self.bvh.crosses(&ray, way.length(), |hit| {
                            let other = self.owners[hit.triangle as usize] as usize;
                            if other != own && !found.contains(&other) {
                                found.push(other);
                            }
                            found.len() > NEIGHBOURS
                        })
                });
            found.sort_unstable();
            (own, found, crowded)
        };
        let found = (0..self.triangles.len()).into_par_iter().map(others);
        let found: Vec<_> = found.filter(|(_, others, _)| !others.is_empty()).collect();
        let mut crowded = vec![false; self.pieces.len()];
        for (own, others, more) in found {
            crowded[own] |= more;
            pairs.extend(others.into_iter().map(|other| [own.min(other), own.max(other)]));
        }
        // open pieces have a warning of their own
        pairs.retain(|pair| pair.iter().all(|&p| self.pieces[p].is_closed()));
        pairs.par_sort_unstable();
        pairs.dedup();
        Touching { pairs, crowded }
    }

    /// Returns the medium around each piece. Pieces that it touches are left out. A piece that
    /// touches more others than were checked counts as being in air.
    fn surroundings(&self, touching: &[[usize; 2]], crowded: &[bool]) -> Vec<Around> {
        let touch = |p: usize, q: usize| touching.binary_search(&[p.min(q), p.max(q)]).is_ok();
        let around = |p: usize| {
            let piece = &self.pieces[p];
            if !piece.is_closed() || piece.volume == 0.0 || crowded[p] {
                return Around::Air;
            }
            let windings = self.windings(self.scene.triangles().at(piece.triangles[0]).a);
            let Some(mut windings) = windings else { return Around::Unknown };
            windings.retain(|&q, _| q != p && !crowded[q] && !touch(p, q));
            let depth: i32 = windings.values().sum();
            let outer = self.innermost(&windings);
            match (piece.volume > 0.0, outer) {
                (true, Some(outer)) if depth > 0 => Around::Solid(outer),
                (true, _) => Around::Air,
                // the piece is a cavity
                (false, Some(outer)) if depth == 1 && self.ior(outer) == self.ior(p) => Around::Air,
                (false, Some(outer)) if depth > 0 => Around::Solid(outer),
                (false, _) => Around::InsideOut,
            }
        };
        (0..self.pieces.len()).into_par_iter().map(around).collect()
    }

    /// Returns how often each closed piece winds around a point; `None` if there are too many faces
    /// to check.
    fn windings(&self, point: Vec3) -> Option<BTreeMap<usize, i32>> {
        let ray = Ray { origin: point, direction: SKEW.normalize() };
        let mut windings = BTreeMap::new();
        let mut faces = 0;
        let too_many = self.bvh.crosses(&ray, f32::INFINITY, |hit| {
            let owner = self.owners[hit.triangle as usize] as usize;
            if self.pieces[owner].is_closed() {
                let leaves = self.triangles[hit.triangle as usize].cross().dot(ray.direction) > 0.0;
                *windings.entry(owner).or_default() += if leaves { 1 } else { -1 };
            }
            faces += 1;
            faces > FACES
        });
        windings.retain(|_, winding| *winding != 0);
        (!too_many).then_some(windings)
    }

    /// Returns the smallest piece that winds around the point of these `windings`. `None` if the
    /// point is not more often in a solid than in a cavity.
    fn innermost(&self, windings: &BTreeMap<usize, i32>) -> Option<usize> {
        if windings.values().sum::<i32>() <= 0 {
            return None;
        }
        let solid = windings.iter().filter(|(_, winding)| **winding > 0).map(|(piece, _)| *piece);
        solid.min_by(|&p, &q| self.pieces[p].volume.total_cmp(&self.pieces[q].volume))
    }

    fn ior(&self, piece: usize) -> u32 {
        let surface = &self.scene.surface(self.pieces[piece].triangles[0]);
        match self.scene.material(surface) {
            Material::Dielectric(solid) => solid.ior().to_bits(),
            _ => 0,
        }
    }
}
