//! Rays that graze closed meshes.

use std::{f64::consts::TAU, fmt::Write};

use glam::Vec3;
use phylux::math::{Ray, Stream};

use crate::common::TestScene;

/// Returns the OBJ lines of a closed prism with its fronts outside, in a file that has `after`
/// vertices already.
fn prism(foot: [f64; 3], radius: f64, height: f64, sides: usize, after: usize) -> String {
    let [x, y, z] = foot;
    let mut obj = String::new();
    for z in [z, z + height] {
        for i in 0..sides {
            let (sin, cos) = (TAU * i as f64 / sides as f64).sin_cos();
            let _ = writeln!(obj, "v {} {} {z}", x + radius * cos, y + radius * sin);
        }
        let _ = writeln!(obj, "v {x} {y} {z}");
    }
    for i in 0..sides {
        let (a, b) = (after + 1 + i, after + 1 + (i + 1) % sides);
        let (d, c) = (a + sides + 1, b + sides + 1);
        let (low, high) = (after + sides + 1, after + 2 * sides + 2);
        let _ = write!(obj, "f {a} {b} {c}\nf {a} {c} {d}\nf {low} {b} {a}\nf {high} {d} {c}\n");
    }
    obj
}

/// 8e5 rays start outside and aim at points on the edges of a stem with a radius of 5 mm and of a
/// pot, in a scene of 10 m. The first face that a ray meets must be a front. Close to a corner of
/// the outline, the order of three faces depends on rounding, so 4 backs are allowed; if only
/// distances decided, there would be thousands.
#[test]
fn rays_that_graze_a_closed_mesh_meet_its_front() {
    let stem = prism([4.0, -3.5, 0.4], 0.005, 0.3, 6, 0);
    let pot = prism([4.2, -3.5, 0.4], 0.1, 0.2, 24, 14);
    let scene = TestScene::new(
        r#"{
            "name": "grazed",
            "materials": { "black": { "type": "lambert", "reflectance": 0 } },
            "objects": [{ "name": "meshes", "obj": "meshes.obj", "material": "black" }],
            "lights": [{ "name": "far", "type": "point", "position": [-4, 4, 0], "power": 1 }]
        }"#,
        &[("meshes.obj", &(stem + &pot))],
    );
    let scene = phylux::load(&scene.path("scene.json")).unwrap_or_else(|e| panic!("{e}")).scene;
    let triangles = scene.triangles();
    let mut random = Stream::new(8, 0, 0);
    let mut unit = || random.uniform_fine() as f32;
    let (mut met, mut backs) = (0, 0);
    for i in 0..800_000 {
        let t = triangles.at(i % triangles.len());
        let target = t.a.lerp(t.b, unit());
        let (z, phi) = (2.0 * unit() - 1.0, TAU as f32 * unit());
        let r = (1.0 - z * z).sqrt();
        let away = Vec3::new(r * phi.cos(), r * phi.sin(), z);
        let origin = target + (0.5 + 3.0 * unit()) * away;
        let ray = Ray { origin, direction: (target - origin).normalize() };
        let Some(hit) = scene.closest(&ray) else { continue };
        met += 1;
        backs += usize::from(triangles.at(hit.triangle).cross().dot(ray.direction) >= 0.0);
    }
    assert!(met > 600_000 && backs <= 4, "{backs} backs of {met}");
}
