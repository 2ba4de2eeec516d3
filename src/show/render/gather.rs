//! Final gathering: where a surface scatters light to the camera, it is joined with the lamps, and rays from there find what
//! other surfaces send (Jensen, Realistic Image Synthesis Using Photon Mapping, 2001, ch. 8). Light that has come
//! from its lamp by way of mirrors, refraction or gloss alone is left to photons.

use std::f32::consts::PI;

use glam::Vec3;

use super::{
    radiance::{Found, Place, Way, Whitted, load},
    shared::{PIXELS, Shared},
};
use crate::{
    error::Result,
    math::{
        geometry::Ray,
        rng::Stream,
        spectrum::{Lanes, Spectrum},
    },
    scene::{
        light::LightHit,
        material::{Interaction, Lambert, Material, Transport},
        world::SurfaceHit,
    },
    transport::{
        paths::Joined,
        photon_map::Way as Came,
        settings::Settings,
        simulate::{Control, focused_light},
        surface_light::{RadianceCache, SurfaceLight},
    },
};

/// A way from the camera that carries less than this goes on by chance, and counts for more where it does.
const SMALL: f32 = 0.005;
/// What is seen by less than this, as in a pane, is seen as the photons there tell it: they are noisy enough for that.
const FAINT: f32 = 0.25;
/// The same of a ray that gathers.
const SMALL_GATHERED: f32 = 0.25;
/// How often light is gathered anew where a ray ends so near that its photons would reach back to where it started.
const NEAR: u32 = 3;

/// Photons of an estimate of focused light over those of any other: it is told at the place itself, where its blotches are
/// seen. More of them blur it by more than their noise is less.
const FOCUSED: usize = 2;
/// Photons of an estimate over those that tell what a glossy surface sends where little of it is seen or it is one end of
/// many: in the mean over these the noise of each goes.
const COARSE: usize = 4;

/// What light is gathered from.
pub struct Gather<'a> {
    /// Rays from every point that scatters, at least 1.
    directions: u32,
    /// What surfaces send.
    cache: RadianceCache,
    /// Photons that came by mirrors, refraction or gloss alone.
    focused: SurfaceLight<'a>,
    /// What surfaces send of them.
    focused_cache: RadianceCache,
    /// A sheet that sends on all that arrives: its radiance, times π, is the irradiance.
    white: Material,
}

impl<'a> Gather<'a> {
    /// From the light on all surfaces, by so many rays from every point. It traces photons as [`light_surfaces`] does,
    /// from which the light comes, with the same `settings`, and has its errors.
    ///
    /// [`light_surfaces`]: crate::light_surfaces
    pub fn new(
        light: &SurfaceLight<'a>,
        directions: u32,
        settings: &Settings,
        control: &Control,
    ) -> Result<Self> {
        let cache = RadianceCache::new(light, settings.threads)?;
        let focused = focused_light(light, FOCUSED * light.k, settings, control)?;
        let focused_cache = RadianceCache::new(&focused, settings.threads)?;
        let white = Material::Lambert(Lambert::new(&vec![1.0; light.scene.lanes()]));
        Ok(Self { directions, cache, focused, focused_cache, white })
    }

    /// Radiance of the light that is left to photons.
    fn focused(&self, place: &Place) -> Vec<f64> {
        let Self { focused, focused_cache, .. } = self;
        told(focused, focused_cache, focused.k, place)
    }
}

/// Radiance of a place, as the photons there tell it: beforehand or, where that along the normal does not tell it in other
/// directions, the nearest `k`.
fn told(light: &SurfaceLight, cache: &RadianceCache, k: usize, place: &Place) -> Vec<f64> {
    let Place { hit, material, interaction, .. } = place;
    let Some(relative) = material.relative_radiance(interaction.cos) else {
        return light.radiance_of(hit.triangle, hit.point, -interaction.direction, k, |_| true);
    };
    let cached = cache.near(light.patches.bin(hit.triangle, interaction.front), hit.point);
    let sent = cached.map_or_else(Default::default, |cached| cached.along_normal);
    sent.iter().map(|v| f64::from(v * relative)).collect()
}

/// Relative standard error of what was [`told`] of a place by photons of one power: so many beforehand, or the nearest `k`.
fn error_of_told(beforehand: usize, k: usize, place: &Place) -> f32 {
    let known = place.material.relative_radiance(place.interaction.cos).is_some();
    SurfaceLight::error_of(if known { beforehand } else { k })
}

/// Photons of an estimate that many others are mixed with.
fn coarse(light: &SurfaceLight) -> usize {
    light.k.div_ceil(COARSE).max(2)
}

impl Whitted<'_> {
    /// Radiance along a ray from the viewpoint.
    pub fn radiance<L: Lanes>(
        &self,
        ray: Ray,
        gather: Option<&Gather>,
        shared: &mut [Shared; 2],
        rng: &mut Stream,
    ) -> Found<L> {
        let start = Way::new(ray, self.light.scene.lanes(), true, SMALL);
        let [shared, shared_focused] = shared;
        let all = |_: &Way<L>, _: &LightHit| 1.0;
        self.follow(start, rng, all, |place, rng| {
            let Place { hit, interaction, .. } = place;
            let reach = PIXELS * self.viewpoint.camera.pixel() * place.length;
            let (triangle, outgoing) = (hit.triangle, -interaction.direction);
            let near = |shared: &mut Shared, find: &dyn Fn() -> Vec<f64>| {
                load(shared.value(hit, interaction.front, reach, find))
            };
            match gather {
                None => {
                    let told = near(shared, &|| self.light.radiance(triangle, hit.point, outgoing));
                    Found::told(told, self.light.error_of_alike())
                }
                Some(gather) if place.share < FAINT => {
                    let k = coarse(self.light);
                    let told = near(shared, &|| told(self.light, &gather.cache, k, place));
                    Found::told(told, error_of_told(self.light.k, k, place))
                }
                Some(gather) => {
                    let told = near(shared_focused, &|| gather.focused(place));
                    let told = Found::told(told, SurfaceLight::error_of(gather.focused.k));
                    told.with(self.gathered(gather, place, rng))
                }
            }
        })
    }

    /// Irradiance on the side of a surface that a ray meets.
    pub fn irradiance<L: Lanes>(
        &self,
        ray: &Ray,
        hit: &SurfaceHit,
        gather: Option<&Gather>,
        shared: &mut Shared,
        rng: &mut Stream,
    ) -> Found<L> {
        let (scene, triangle) = (self.light.scene, hit.triangle);
        let surface = scene.surface(triangle);
        let interaction = Interaction::new(ray.direction, surface.normal).on(triangle);
        let (light, reach) = (self.told_by(gather), self.reach(hit));
        let told = shared.value(hit, interaction.front, reach, || {
            light.irradiance(triangle, interaction.front, hit.point)
        });
        let told = Found::told(load(told), light.error_of_alike());
        let Some(gather) = gather else { return told };
        let (material, length, share) = (&gather.white, hit.t, 1.0);
        let place = Place { hit: *hit, surface, material, interaction, length, share };
        told.with(self.gathered::<L>(gather, &place, rng).scaled(PI))
    }

    /// What a surface absorbs from both sides where a ray meets it.
    pub fn absorbed<L: Lanes>(
        &self,
        ray: &Ray,
        hit: &SurfaceHit,
        gather: Option<&Gather>,
        shared: &mut [Shared; 2],
        rng: &mut Stream,
    ) -> Found<L> {
        let (triangle, reach) = (hit.triangle, self.reach(hit));
        let [arriving, absorbed] = shared;
        if gather.is_none() {
            let told =
                absorbed.value(hit, true, reach, || self.light.absorbed(triangle, hit.point));
            return Found::told(load(told), self.light.error_of_alike());
        }
        let normal = self.light.scene.surface(triangle).normal;
        let mut of_face = |direction: Vec3| {
            let ray = Ray { direction, ..*ray };
            let found = self.irradiance::<L>(&ray, hit, gather, arriving, rng);
            let front = direction.dot(normal) < 0.0;
            // of many photons, as each of them tells nearly the same
            let share = absorbed
                .value(hit, front, reach, || self.light.absorptance(triangle, front, hit.point));
            found * &load(share)
        };
        let mut found = of_face(ray.direction);
        found += of_face(-ray.direction);
        found
    }

    /// The photons that tell what is not gathered.
    pub fn told_by<'b>(&'b self, gather: Option<&'b Gather>) -> &'b SurfaceLight<'b> {
        gather.map_or(self.light, |gather| &gather.focused)
    }

    /// How far apart points may be that share an estimate, m.
    pub fn reach(&self, hit: &SurfaceHit) -> f32 {
        PIXELS * self.viewpoint.camera.pixel() * hit.t
    }

    /// What a place sends towards the camera, but for light that photons tell there.
    fn gathered<L: Lanes>(&self, gather: &Gather, place: &Place, rng: &mut Stream) -> Spectrum<L> {
        let mut sum = self.gather(gather, place, NEAR, rng);
        for _ in 1..gather.directions {
            sum += self.gather(gather, place, NEAR, rng);
        }
        sum.scaled(1.0 / gather.directions as f32)
    }

    /// One lamp's light and what one ray finds.
    fn gather<L: Lanes>(
        &self,
        gather: &Gather,
        place: &Place,
        near: u32,
        rng: &mut Stream,
    ) -> Spectrum<L> {
        let scene = self.light.scene;
        let Place { hit, surface, material, interaction, .. } = place;
        let joined = Joined::new(scene, surface.normal, material, *interaction, hit.point);
        let from_lamp = joined.radiance(rng);
        let scatter = material.sample::<L>(interaction, Transport::Importance, rng);
        let Some(scatter) = scatter.filter(|s| s.lobe.is_diffuse()) else {
            return from_lamp;
        };
        let side = if scatter.lobe.crosses() { -interaction.normal } else { interaction.normal };
        let ray = scene.leave(hit.point, side, scatter.direction);
        let start = Way::new(ray, scene.lanes(), false, SMALL_GATHERED);
        // lamps by way of mirrors are left to photons
        let share = |way: &Way<L>, hit: &LightHit| {
            if way.straight { joined.weight(&way.ray, hit) } else { 0.0 }
        };
        let found = self.follow(start, rng, share, |end, rng| {
            Found::told(self.sent(gather, end, near, rng), 0.0)
        });
        from_lamp + scatter.weight * found.value
    }

    /// What is sent from where a gathering ray ends.
    fn sent<L: Lanes>(
        &self,
        gather: &Gather,
        end: &Place,
        near: u32,
        rng: &mut Stream,
    ) -> Spectrum<L> {
        let (light, Place { hit, material, interaction, .. }) = (self.light, end);
        let (triangle, outgoing) = (hit.triangle, -interaction.direction);
        let Some(relative) = material.relative_radiance(interaction.cos) else {
            // what came to a glossy surface straight or by gloss is told by photons where it goes on to
            let is_glossy = material.glossy() > 0.0;
            let wanted = |came: Came| came.diffused || !is_glossy;
            return load(&light.radiance_of(triangle, hit.point, outgoing, coarse(light), wanted));
        };
        let bin = light.patches.bin(triangle, interaction.front);
        let Some(cached) = gather.cache.near(bin, hit.point) else {
            return Spectrum::splat(light.scene.lanes(), 0.0);
        };
        if near > 0 && end.length < cached.reach {
            let focused = load::<L>(&gather.focused(end));
            return focused + self.gather(gather, end, near - 1, rng);
        }
        let sent = cached.along_normal;
        Spectrum::from_fn(sent.len(), |b| sent.get(b).map_or(0.0, |v| v * relative))
    }
}
