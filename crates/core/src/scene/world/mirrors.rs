//! Flat panes and mirrors. Under the sun all of one material that lie in parallel planes show one
//! image of it; captors have an image in each plane.

use std::collections::HashMap;

use glam::Vec3;

use super::{NamedMaterial, Scene, Surface};
use crate::{
    math::{
        geometry::{Extent, Frame, Ray, Triangle, closeness},
        spectrum::{Lanes, Wide},
    },
    scene::{
        light::{Light, MARGIN},
        material::{Interaction, Material, Scatterer, Transport},
    },
};

/// Limit on the number of images of the sun, and of planes. Those beyond it, in smaller surfaces, are
/// not looked for.
const MOST: usize = 64;

/// Sine of the angle between normals that count as parallel: far below the sun's angular radius,
/// and above the rounding error in the normal of a small pane.
const PARALLEL: f32 = 1e-4;

/// Images in what mirrors less than this fraction of the light at 45 degrees are faint.
const FAINT: f32 = 0.5;

/// A plane with flat panes or mirrors of one material.
#[derive(Clone, Copy, Debug)]
pub struct MirrorPlane {
    /// Unit normal of the plane.
    normal: Vec3,
    /// A point of the plane.
    point: Vec3,
    /// The largest fraction per band of light at 45 degrees that is mirrored.
    mirrored: f32,
    material: u32,
    /// A box around the panes or mirrors, and their area, m2.
    extent: Extent,
    area: f32,
}

impl MirrorPlane {
    /// Returns the height of a point above the plane, m; below it is negative.
    #[inline]
    fn height(&self, point: Vec3) -> f32 {
        (point - self.point).dot(self.normal)
    }

    /// Returns the mirror image of a point.
    pub fn image(&self, point: Vec3) -> Vec3 {
        point - 2.0 * self.height(point) * self.normal
    }

    /// Returns the mirror image of a direction.
    pub fn turned(&self, direction: Vec3) -> Vec3 {
        mirrored(direction, self.normal)
    }

    /// Returns the area of the panes and mirrors times the fraction that they mirror, m2.
    pub fn mirrored_area(&self) -> f32 {
        self.area * self.mirrored
    }

    /// Returns whether a point of a surface with this unit normal lies on a pane or mirror in the plane.
    pub fn holds(&self, point: Vec3, normal: Vec3) -> bool {
        self.normal.cross(normal).length() < PARALLEL && self.extent.holds(point)
    }

    /// Returns whether a ray comes to the plane within the box around the panes and mirrors.
    #[inline]
    pub fn is_met(&self, ray: &Ray) -> bool {
        let t = -self.height(ray.origin) / ray.direction.dot(self.normal);
        t > 0.0 && t.is_finite() && self.extent.holds(ray.origin + t * ray.direction)
    }
}

/// The flat panes and mirrors in which a scene's suns are seen.
#[derive(Debug)]
pub struct FlatMirrors {
    /// Indices of the lights with a sun.
    suns: Vec<usize>,
    images: Vec<Image>,
    /// Index of the image that each triangle shows.
    of_triangle: HashMap<usize, usize>,
}

/// The image of the sun in all panes or mirrors of one material that lie in parallel planes.
#[derive(Debug)]
struct Image {
    normal: Vec3,
    material: u32,
    /// The largest fraction per band of light at 45 degrees that is mirrored.
    mirrored: f32,
    /// A box around these surfaces, slightly enlarged.
    extent: Extent,
}

/// An image of a sun, chosen by chance.
#[derive(Clone, Copy, Debug)]
pub struct ChosenImage {
    /// Index of the image.
    pub image: usize,
    /// Direction in which the image is seen, unit vector.
    pub toward: Vec3,
    /// Probability of the choice.
    pub chance: f32,
}

impl Image {
    /// Returns the direction in which a sun that stands towards `sun` is seen.
    fn of(&self, sun: Vec3) -> Vec3 {
        mirrored(sun, self.normal)
    }
}

/// Returns a direction as a mirror with this unit normal sends it.
fn mirrored(direction: Vec3, normal: Vec3) -> Vec3 {
    direction - 2.0 * direction.dot(normal) * normal
}

impl FlatMirrors {
    /// Finds the images in the largest flat panes and mirrors; `margin` is the distance by which
    /// the boxes are enlarged, m. `None` if no light has a sun or no surface shows it.
    pub(super) fn find(
        lights: &[Light],
        triangles: &[Triangle],
        surfaces: &[Surface],
        materials: &[NamedMaterial],
        margin: f32,
    ) -> Option<Self> {
        let has_sun = |light: &Light| light.entrance().is_some_and(|e| e.light.has_sun());
        let suns: Vec<usize> = (0..lights.len()).filter(|&l| has_sun(&lights[l])).collect();
        if suns.is_empty() {
            return None;
        }
        let of = |material: u32| &materials[material as usize].material;
        let is_mirror = |t: &usize| {
            surfaces[*t].normal != Vec3::ZERO && shows_images(of(surfaces[*t].material))
        };
        let mut flat: Vec<usize> = (0..triangles.len()).filter(is_mirror).collect();
        flat.sort_by(|&a, &b| triangles[b].area().total_cmp(&triangles[a].area()).then(a.cmp(&b)));
        let mut images: Vec<Image> = Vec::new();
        let mut of_triangle = HashMap::new();
        for t in flat {
            let Surface { normal, material, .. } = surfaces[t];
            let shows = |image: &Image| {
                image.material == material && image.normal.cross(normal).length() < PARALLEL
            };
            let image = match images.iter().position(shows) {
                Some(image) => image,
                None if images.len() == MOST => continue,
                None => {
                    let mirrored = share_at_45_degrees(of(material), normal);
                    images.push(Image { normal, material, mirrored, extent: Extent::EMPTY });
                    images.len() - 1
                }
            };
            let extent = Extent::of_triangles([&triangles[t]]).wider(margin);
            images[image].extent = images[image].extent.join(extent);
            of_triangle.insert(t, image);
        }
        (!images.is_empty()).then_some(Self { suns, images, of_triangle })
    }

    /// Returns the indices of the lights with a sun.
    pub fn suns(&self) -> &[usize] {
        &self.suns
    }

    /// Returns the index of the image that a triangle shows, if it shows one.
    pub fn image_of(&self, triangle: usize) -> Option<usize> {
        self.of_triangle.get(&triangle).copied()
    }

    /// Returns the images of a sun that stands towards `sun` (unit vector), each with its index and
    /// the direction in which it is seen: those that may be seen from `point`, on
    /// the side of `normal` if one is given.
    pub fn seen(
        &self,
        point: Vec3,
        normal: Option<Vec3>,
        sun: Vec3,
    ) -> impl Iterator<Item = (usize, Vec3)> {
        let images =
            self.images.iter().enumerate().map(move |(i, image)| (i, image, image.of(sun)));
        images.filter_map(move |(i, image, direction)| {
            let seen = normal.is_none_or(|normal| normal.dot(direction) > 0.0)
                && image.extent.is_met(&Ray { origin: point, direction });
            seen.then_some((i, direction))
        })
    }

    /// Returns whether an image is faint beside the sun itself, as in a pane.
    pub fn is_faint(&self, image: usize) -> bool {
        self.images[image].mirrored < FAINT
    }

    /// Returns whether a ray may meet one of the surfaces that show an image.
    pub fn may_be_met(&self, image: usize, ray: &Ray) -> bool {
        self.images[image].extent.is_met(ray)
    }
}

impl Scene {
    /// Returns the planes with flat panes and mirrors, at most so many: those that mirror most of
    /// the light that falls evenly on all. A scene that repeats has none, as its images have no end.
    pub fn mirror_planes(&self, most: usize) -> Vec<MirrorPlane> {
        let shows = |material: u32| shows_images(&self.materials[material as usize].material);
        let any = self.materials.iter().any(|named| shows_images(&named.material));
        if !any || self.lattice().is_some() {
            return Vec::new();
        }
        // copies that share their triangles have no panes and no mirrors
        let triangles = &self.shapes.triangles;
        let is_flat = |t: &usize| {
            let Surface { normal, material, .. } = self.objects.surfaces[*t];
            normal != Vec3::ZERO && shows(material)
        };
        let mut flat: Vec<(usize, f32)> =
            (0..triangles.len()).filter(is_flat).map(|t| (t, triangles[t].area())).collect();
        flat.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let near = MARGIN * closeness(Vec3::splat(self.place.radius));
        let mut planes: Vec<MirrorPlane> = Vec::new();
        for (t, area) in flat {
            let (triangle, Surface { normal, material, .. }) =
                (triangles[t], self.objects.surfaces[t]);
            let is_there = |plane: &MirrorPlane| {
                plane.material == material
                    && plane.normal.cross(normal).length() < PARALLEL
                    && plane.height(triangle.a).abs() < near
            };
            let extent = Extent::of_triangles([&triangle]).wider(near);
            match planes.iter().position(is_there) {
                Some(plane) => {
                    let plane = &mut planes[plane];
                    plane.extent = plane.extent.join(extent);
                    plane.area += area;
                }
                None if planes.len() < MOST => {
                    let named = &self.materials[material as usize];
                    let mirrored = share_at_45_degrees(&named.material, normal);
                    let point = triangle.a;
                    planes.push(MirrorPlane { normal, mirrored, point, material, extent, area });
                }
                None => {}
            }
        }
        planes.retain(|plane| plane.mirrored > 0.0);
        planes.sort_by(|a, b| b.mirrored_area().total_cmp(&a.mirrored_area()));
        planes.truncate(most);
        planes
    }

    /// Returns the flat panes and mirrors in which the suns of the scene are seen, if there are
    /// any.
    #[inline]
    pub fn flat_mirrors(&self) -> Option<&FlatMirrors> {
        self.lighting.mirrors.as_ref()
    }

    /// Chooses an image of a sun that stands towards `sun` (unit vector), by a random `number` in
    /// [0, 1). Candidates are the images that may be seen from `point`, on the side of `normal` if
    /// one is given. The probability of each is the fraction of light that it mirrors, divided by
    /// the sum of these fractions if that is above 1. `None` if no image is chosen.
    pub fn choose_image<L: Lanes>(
        &self,
        mirrors: &FlatMirrors,
        point: Vec3,
        normal: Option<Vec3>,
        sun: Vec3,
        number: f32,
    ) -> Option<ChosenImage> {
        let mut shares = [0.0; MOST];
        for (i, direction) in mirrors.seen(point, normal, sun) {
            let image = &mirrors.images[i];
            let material = &self.materials[image.material as usize].material;
            let at = Interaction::new(direction, image.normal);
            let [mirrored, _] = material.smooth_ways::<L>(&at, Transport::Importance);
            shares[i] = mirrored.map_or(0.0, |way| way.weight.largest());
        }
        let all = shares.iter().sum::<f32>().max(1.0);
        let mut rest = number * all;
        let image = shares.iter().position(|share| {
            rest -= share;
            rest < 0.0
        })?;
        let toward = mirrors.images[image].of(sun).normalize();
        Some(ChosenImage { image, toward, chance: shares[image] / all })
    }
}

/// Returns the largest fraction per band that a material mirrors at 45 degrees.
fn share_at_45_degrees(material: &Material, normal: Vec3) -> f32 {
    let direction = -(Frame::new(normal).tangent + normal).normalize();
    let at = Interaction::new(direction, normal);
    let [mirrored, _] = material.smooth_ways::<Wide>(&at, Transport::Light);
    mirrored.map_or(0.0, |way| way.weight.largest())
}

/// Returns whether surfaces of a material show images: they mirror light from one direction into
/// one direction that depends on their plane.
fn shows_images(material: &Material) -> bool {
    match material {
        Material::Pane(_) | Material::Mirror(_) => true,
        Material::Table(_) => material.has_mirror(),
        _ => false,
    }
}
