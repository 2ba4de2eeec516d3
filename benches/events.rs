//! Times the events at the ends of a ray: emission by each kind of light, scattering by each
//! material.

use divan::{Bencher, black_box_drop, counter::ItemsCount};
use glam::Vec3;
use phylux::{
    formats::{SceneBuilder, spec::*},
    math::{Lanes, Stream},
    scene::{
        Dielectric, Interaction, Lambert, Leaf, LeafFace, Material, Mirror, Pane, Phong,
        PhongFractions, Transport,
    },
};

const EVENTS: u64 = 10_000;

#[divan::bench(args = ["point", "spot", "tube", "isotropic line", "area"])]
fn emit(bencher: Bencher, shape: &str) {
    let (position, to) = ([0.0; 3], [1.0, 0.0, 0.0]);
    let tube = |radius| TubeSpec::new(position, to, radius, 1.0);
    let light: LightSpec = match shape {
        "point" => PointSpec::new(position, 1.0).into(),
        "spot" => SpotSpec::new(position, [0.0, 0.0, -1.0], 30.0, 1.0).into(),
        "tube" => tube(0.02).into(),
        "isotropic line" => TubeSpec { emission: EmissionSpec::Isotropic, ..tube(0.0) }.into(),
        _ => {
            let corners = vec![position, to, [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
            AreaSpec::polygon(corners, 1.0).into()
        }
    };
    let loaded = SceneBuilder::new().light(light).build().expect("a scene of one light");
    let light = &loaded.scene.lights()[0];
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
    let names = vec!["band"; bands];
    match name {
        "lambert" => Material::Lambert(Lambert::new(&all(0.5)).unwrap()),
        "solid" => Material::Dielectric(Dielectric::new(1.5, &all(0.9)).unwrap()),
        "pane" => Material::Pane(Pane::new(1.52, &all(0.9)).unwrap()),
        "leaf" => {
            let face = LeafFace { reflectance: &all(0.1), transmittance: &all(0.05) };
            Material::Leaf(Leaf::new(1.425, face, face, &names).unwrap())
        }
        "phong" => {
            let fractions = PhongFractions {
                reflectance: &all(0.3),
                specular: &all(0.45),
                transmittance: &all(0.0),
            };
            Material::Phong(Phong::new(fractions, Some(20.0), &names).unwrap())
        }
        _ => Material::Mirror(Mirror::new(&all(0.9)).unwrap()),
    }
}

#[divan::bench(args = ["lambert", "solid", "pane", "leaf", "phong", "mirror"], types = [[f32; 1], [f32; 4], [f32; 16]])]
fn scatter<L: Lanes>(bencher: Bencher, name: &str) {
    let material = material(name, size_of::<L>() / size_of::<f32>());
    let at = Interaction::new(Vec3::new(0.6, 0.0, -0.8), Vec3::Z);
    sample(bencher, |rng| material.sample::<L>(&at, Transport::Light, rng));
}
