//! Times the events at the ends of a ray: emission by each kind of light, scattering by each
//! material.

use divan::{Bencher, black_box_drop, counter::ItemsCount};
use glam::{DVec3, Vec3};
use phylux::{
    Dielectric, Extent, Interaction, Lambert, Lanes, Leaf, LeafFace, Light, LightShape, Material,
    Mirror, Pane, Phong, PhongFractions, Stream, Transport,
};

const EVENTS: u64 = 10_000;

#[divan::bench(args = ["point", "spot", "tube", "isotropic line", "area"])]
fn emit(bencher: Bencher, shape: &str) {
    let (position, to) = (DVec3::ZERO, DVec3::X);
    let shape = match shape {
        "point" => LightShape::Point { position },
        "spot" => LightShape::Spot { position, direction: -DVec3::Z, half_angle: 0.5 },
        "tube" => LightShape::Tube { from: position, to, radius: 0.02 },
        "isotropic line" => LightShape::IsotropicLine { from: position, to },
        _ => {
            let triangles = vec![[position, to, DVec3::Y], [to, DVec3::ONE, DVec3::Y]];
            LightShape::Area { triangles, two_sided: false }
        }
    };
    let light = Light::new("lamp".into(), vec![1.0], &shape, DVec3::ZERO, &Extent::EMPTY.into());
    sample(bencher, |rng| light.emit(rng));
}

/// Times many events that draw from one random stream.
fn sample<T>(bencher: Bencher, event: impl Fn(&mut Stream) -> T + Sync) {
    bencher.counter(ItemsCount::new(EVENTS)).bench(|| {
        let mut rng = Stream::new(1, 0, 0);
        (0..EVENTS).for_each(|_| black_box_drop(event(&mut rng)));
    });
}

fn material(name: &str, bands: usize) -> Material {
    let all = |x: f32| vec![x; bands];
    match name {
        "lambert" => Material::Lambert(Lambert::new(&all(0.5))),
        "solid" => Material::Dielectric(Dielectric::new(1.5, &all(0.9))),
        "pane" => Material::Pane(Pane::new(1.52, &all(0.9))),
        "leaf" => {
            let face = LeafFace { reflectance: &all(0.1), transmittance: &all(0.05) };
            Material::Leaf(Leaf::new(1.425, face, face))
        }
        "phong" => {
            let fractions = PhongFractions {
                reflectance: &all(0.3),
                specular: &all(0.45),
                transmittance: &all(0.0),
            };
            Material::Phong(Phong::new(fractions, Some(20.0)))
        }
        _ => Material::Mirror(Mirror::new(&all(0.9))),
    }
}

#[divan::bench(args = ["lambert", "solid", "pane", "leaf", "phong", "mirror"], types = [[f32; 1], [f32; 4], [f32; 16]])]
fn scatter<L: Lanes>(bencher: Bencher, name: &str) {
    let material = material(name, size_of::<L>() / size_of::<f32>());
    let at = Interaction::new(Vec3::new(0.6, 0.0, -0.8), Vec3::Z);
    sample(bencher, |rng| material.sample::<L>(&at, Transport::Light, rng));
}
