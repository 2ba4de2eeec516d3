//! Images of what a scene that repeats holds besides surfaces and captors: lights and openings.

use std::collections::BTreeMap;

use glam::{DVec3, Vec3};

use crate::{
    math::geometry::Triangle,
    scene::{
        bvh::Bvh,
        lattice::{Cell, Images, Lattice, Layers, Repeats},
        light::Light,
    },
};

/// Images of lights and of the openings of lights at infinity that reach into the cell (0, 0).
#[derive(Debug, Default)]
pub struct LightImages {
    /// Images of the triangles of area lights.
    pub triangles: Images,
    /// The tubes, by the index of the light, with the cells from which their images come, their own
    /// among them.
    pub tubes: Vec<(usize, Cell)>,
    /// The openings of each light that has any.
    pub openings: BTreeMap<usize, Openings>,
}

/// The openings of a light.
#[derive(Debug)]
pub struct Openings {
    /// Where they lie.
    pub layers: Layers,
    /// Their images.
    pub images: Images,
}

/// Returns a triangle's corners in double precision.
fn corners(triangle: &Triangle) -> [DVec3; 3] {
    [triangle.a, triangle.b, triangle.c].map(Vec3::as_dvec3)
}

fn rounded(corners: &[DVec3; 3]) -> Triangle {
    corners.map(|corner| corner.as_vec3()).into()
}

/// What rays may meet of lights: the triangles of area lights, and the images of lights and openings.
#[derive(Debug)]
pub struct LightShapes {
    pub triangles: Vec<Triangle>,
    /// The light of each triangle.
    pub of_triangle: Vec<u32>,
    /// Finds the triangles, and after them their images.
    pub bvh: Bvh,
    pub images: LightImages,
}

impl LightShapes {
    /// Finds the shapes of lights that lie in the cell, in a scene that may repeat.
    pub fn of(lights: &[Light], repeats: Option<&Repeats>) -> Self {
        let (mut triangles, mut of_triangle) = (Vec::new(), Vec::new());
        for (l, light) in lights.iter().enumerate() {
            triangles.extend_from_slice(light.triangles());
            of_triangle.resize(triangles.len(), l as u32);
        }
        let images =
            repeats.map_or_else(LightImages::default, |Repeats { lattice, layers, .. }| {
                LightImages::new(lattice, layers.slack, lights, &triangles)
            });
        let with_images: Vec<Triangle> =
            triangles.iter().chain(&images.triangles.shapes).copied().collect();
        Self { triangles, of_triangle, bvh: Bvh::build(&with_images), images }
    }
}

impl LightImages {
    /// Finds the images of lights, whose `triangles` are those of all area lights.
    fn new(lattice: &Lattice, slack: f64, lights: &[Light], triangles: &[Triangle]) -> Self {
        let images = |triangles: &[Triangle]| {
            let corners: Vec<[DVec3; 3]> = triangles.iter().map(corners).collect();
            Images::new(lattice, slack, true, corners.iter(), rounded)
        };
        let tubes = lights.iter().enumerate().filter(|(_, light)| light.radius() > 0.0);
        let tubes = tubes.flat_map(|(l, light)| {
            let extent = light.extent();
            let box_ends = [extent.min.as_dvec3(), extent.max.as_dvec3()];
            let [[x0, x1], [y0, y1]] = lattice.images_of(&box_ends, slack);
            (x0..=x1).flat_map(move |x| (y0..=y1).map(move |y| (l, [x, y])))
        });
        let with_openings = lights.iter().enumerate().filter_map(|(l, light)| {
            let openings = light.entrance().filter(|entrance| entrance.has_openings())?.openings();
            let each = |visit: &mut dyn FnMut(&[DVec3])| {
                openings.iter().for_each(|triangle| visit(&corners(triangle)));
            };
            let layers = Layers::new(lattice, each);
            Some((l, Openings { layers, images: images(openings) }))
        });
        Self {
            triangles: images(triangles),
            tubes: tubes.collect(),
            openings: with_openings.collect(),
        }
    }
}
