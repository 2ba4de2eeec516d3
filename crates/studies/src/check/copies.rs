//! Copies of objects one by one: such as stand twice, below the ground or far from the others; and
//! objects of which there is only one, below the ground.

use std::collections::HashMap;

use glam::{Vec2, Vec3, Vec3Swizzles};

use super::remarks::{Remarks, place};
use phylux_core::{
    math::geometry::{Extent, Ray, closeness},
    scene::{material::Scatterer, world::Scene},
};

/// Copies in the same place are those whose corners differ by less than this, in what rounding takes
/// for one place.
const SAME: f32 = 4.0;
/// A copy is far from the others if it is farther away than this many times the size of the middle
/// half of them.
const FAR: f32 = 20.0;
/// The fewest copies of an object of which one can be far from the others.
const FEWEST: usize = 3;
/// Number of directions in which the back of the ground is looked for above a copy, besides straight
/// up.
const ASIDE: usize = 8;
/// The angle of these above the horizontal, rad.
const LOW: f32 = 0.6;
/// The most surfaces that are looked at above a copy.
const SHEETS: usize = 1000;

/// A copy of an object, or an object of which there is only one.
pub(super) struct Copy {
    /// Index of the object.
    pub object: usize,
    /// Index of its first triangle.
    pub first: usize,
    /// Number of its triangles.
    pub triangles: usize,
    /// A box around it, m from the centre of the scene.
    pub extent: Extent,
    /// Whether it shares its triangles.
    pub is_shared: bool,
}

/// Returns the copies of all objects of which there are several.
pub(super) fn copies(scene: &Scene) -> Vec<Copy> {
    let triangles = scene.triangles();
    let own = scene.object_copies().take_while(|copy| copy.triangles.start < scene.unshared());
    let own = own.filter_map(|copy| {
        Some(Copy {
            object: copy.object?,
            first: copy.triangles.start,
            triangles: copy.triangles.len(),
            extent: Extent::of_triangles(copy.triangles.map(|i| triangles.at(i))),
            is_shared: false,
        })
    });
    let shared = scene.shared_copies().filter_map(|copy| {
        Some(Copy {
            object: scene.object(copy.first)?,
            first: copy.first,
            triangles: copy.triangles,
            extent: copy.extent,
            is_shared: true,
        })
    });
    own.chain(shared).filter(|copy| copy.triangles > 0).collect()
}

/// Returns the objects of which there is only one, each with all its triangles.
fn single_objects(scene: &Scene, copies: &[Copy]) -> Vec<Copy> {
    let mut found: Vec<Option<Copy>> = scene.objects().iter().map(|_| None).collect();
    for first in 0..scene.unshared() {
        let Some(object) = scene.object(first) else { continue };
        let extent = Extent::of_triangles([scene.triangles().at(first)]);
        let none = Copy { object, first, triangles: 0, extent, is_shared: false };
        let own = found[object].get_or_insert(none);
        own.triangles = first + 1 - own.first;
        own.extent = own.extent.join(extent);
    }
    copies.iter().for_each(|copy| found[copy.object] = None);
    found.into_iter().flatten().collect()
}

/// Warns of copies that stand where no one puts them, and of other objects below the ground.
pub(super) fn check_copies(scene: &Scene, remarks: &mut Remarks) {
    let copies = copies(scene);
    let named = |copy: &Copy| {
        format!("`{}` at {}", scene.objects()[copy.object], place(scene, copy.extent.center()))
    };
    remarks.warn_of(twins(scene, &copies).into_iter().map(named), |list| {
        format!(
            "copies that stand where another copy stands, so that light meets only one of them: {list}; \
            remove them from `instances`"
        )
    });
    remarks.warn_of(far_off(&copies).into_iter().map(named), |list| {
        format!(
            "copies far away from all others of their object: {list}; check their `translate`, and its \
            unit"
        )
    });
    let middle = |copy: &Copy| vec![copy.extent.center().xy()];
    let below = copies.iter().filter(|copy| is_below_ground(scene, copy, &middle(copy)));
    remarks.warn_of(below.map(named), |list| {
        format!(
            "copies below the ground, with nothing but its back above them and nothing below: {list}; \
            check their `translate` and `up`"
        )
    });
    // a ground reaches beyond all sides of what lies below it; a shelf is as wide as the one above
    let everywhere = |object: &Copy| {
        let corners = object.extent.corners().map(|corner| corner.xy());
        [&middle(object)[..], &corners[4..]].concat()
    };
    let singles = single_objects(scene, &copies);
    let below = singles.iter().filter(|one| is_below_ground(scene, one, &everywhere(one)));
    let name = |object: &Copy| format!("`{}`", scene.objects()[object.object]);
    remarks.warn_of(below.map(name), |list| {
        format!(
            "objects below the ground, with its back above them and nothing below: {list}; check their \
            `translate` and `up`, and the ground's front (docs/scene-format.md#objects)"
        )
    });
}

/// Returns the copies that stand where one before them stands. Those that have triangles of their
/// own are left to the check of triangles.
fn twins<'c>(scene: &Scene, copies: &'c [Copy]) -> Vec<&'c Copy> {
    let corner = |copy: &Copy| scene.triangles().at(copy.first);
    let same = |a: &Copy, b: &Copy, reach: f32| {
        let (one, other) = (corner(a), corner(b));
        a.triangles == b.triangles
            && a.extent.center().distance(b.extent.center()) <= 2.0 * reach
            && [one.a - other.a, one.b - other.b, one.c - other.c]
                .iter()
                .all(|d| d.length() <= reach)
    };
    let reach =
        copies.iter().map(|copy| closeness(copy.extent.max.abs().max(copy.extent.min.abs())));
    let reach = SAME * reach.fold(0.0, f32::max);
    // copies in one place lie in the same cube or in neighbouring ones
    let cube = |copy: &Copy| (copy.extent.center() / (4.0 * reach)).floor().as_i64vec3();
    let mut places: HashMap<_, Vec<&Copy>> = HashMap::new();
    let mut found = Vec::new();
    for copy in copies {
        let own = cube(copy);
        let around = (0..27).map(|i| own + glam::I64Vec3::new(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
        let mut near = around.filter_map(|cube| places.get(&cube)).flatten();
        match near.any(|other| (copy.is_shared || other.is_shared) && same(copy, other, reach)) {
            true => found.push(copy),
            // a twin stands where another is known
            false => places.entry(own).or_default().push(copy),
        }
    }
    found
}

/// Returns the copies that are far away from the others of their object.
fn far_off(copies: &[Copy]) -> Vec<&Copy> {
    let mut found = Vec::new();
    for alike in copies.chunk_by(|a, b| a.object == b.object) {
        if alike.len() < FEWEST {
            continue;
        }
        let quartiles = |axis: usize| {
            let mut all: Vec<f32> = alike.iter().map(|copy| copy.extent.center()[axis]).collect();
            all.sort_unstable_by(f32::total_cmp);
            [all[(all.len() - 1) / 4], all[3 * (all.len() - 1) / 4]]
        };
        let [x, y, z] = [0, 1, 2].map(quartiles);
        let middle = Extent { min: Vec3::new(x[0], y[0], z[0]), max: Vec3::new(x[1], y[1], z[1]) };
        let mut sizes: Vec<f32> = alike.iter().map(|copy| copy.extent.size().length()).collect();
        sizes.sort_unstable_by(f32::total_cmp);
        let size = middle.size().length() + sizes[sizes.len() / 2];
        found.extend(alike.iter().filter(|copy| copy.extent.is_clear_of(&middle, FAR * size)));
    }
    found
}

/// Returns whether all around above these places on top of a copy there is the back of a surface that
/// lets no light through, as that of a ground, and below the copy there is nothing.
fn is_below_ground(scene: &Scene, copy: &Copy, places: &[Vec2]) -> bool {
    let own = |triangle: usize| (copy.first..copy.first + copy.triangles).contains(&triangle);
    let Extent { min, max } = copy.extent;
    let middle = copy.extent.center();
    let beyond = 2.0 * closeness(max.abs().max(min.abs()));
    let first = |origin: Vec3, direction: Vec3| {
        let mut ray = Ray { origin, direction };
        for _ in 0..SHEETS {
            let hit = scene.closest(&ray)?;
            let surface = scene.surface(hit.triangle);
            let material = scene.material(&surface);
            if !own(hit.triangle) && !material.is_clear() && !material.transmits_diffusely() {
                return Some(surface.normal.dot(direction) > 0.0);
            }
            ray = scene.pass(&hit, direction);
        }
        None
    };
    // a roof of narrow panels leaves gaps at the sides
    let turn = |i: usize| std::f32::consts::TAU * i as f32 / ASIDE as f32;
    let aside = (0..ASIDE)
        .map(|i| Vec3::new(LOW.cos() * turn(i).cos(), LOW.cos() * turn(i).sin(), LOW.sin()));
    let mut ways = aside.chain([Vec3::Z]);
    let top = |place: &Vec2| place.extend(max.z + beyond);
    ways.all(|way| places.iter().all(|place| first(top(place), way) == Some(true)))
        && first(middle.xy().extend(min.z - beyond), Vec3::NEG_Z).is_none()
}
