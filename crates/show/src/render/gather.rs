//! Final gathering: where a surface scatters light diffusely to the camera, the point is joined
//! with the lamps by shadow rays, and gathering rays from there find the light that other surfaces
//! send (Jensen, Realistic Image Synthesis Using Photon Mapping, 2001, ch. 8). Focused light, which
//! has come from its lamp by mirrors, refraction or gloss alone, is estimated from photons instead.

use std::{f32::consts::PI, sync::OnceLock};

use glam::Vec3;

use super::{
    normals::Normals,
    radiance::{FAINT, Found, Place, Way, Whitted, load, onward},
    shared::{PIXELS, Shared},
};
use phylux_core::{
    error::Result,
    math::{
        geometry::Ray,
        rng::Stream,
        spectrum::{Lanes, Spectrum},
    },
    scene::{
        light::LightHit,
        material::{Lambert, Material, Scatterer, Transport},
        world::{Arrived, SurfaceHit},
    },
    transport::{
        paths::Joined,
        photon_map::Way as Came,
        settings::Settings,
        simulate::{Control, focused_light},
        surface_light::{RadianceCache, SurfaceLight},
    },
};

/// Russian-roulette threshold of branches from the camera: one that carries less than this goes on
/// by chance, and counts for more where it does.
const SMALL: f32 = 0.005;
/// Russian-roulette threshold of the branches of gathering rays, as `SMALL` is for those from the
/// camera.
const SMALL_GATHERED: f32 = 0.25;
/// How many times in a row light is gathered anew where a gathering ray ends so near that the
/// photons of the estimate there would reach back to its start.
const NEAR: u32 = 3;

/// Number of photons in an estimate of focused light at a visible place, as a multiple of those in
/// other estimates: there its blotches are seen. But still more photons would add more blur than
/// they take away noise.
const FOCUSED: usize = 3;
/// Number of the nearest points at which radiance was estimated beforehand, over which it is
/// averaged at a visible place. Together they rest on as many photons; as the nearer ones count
/// more, it is as if there were seven.
const NEAREST: usize = 12;
/// Number of shadow rays to the lamps for each gathering ray. They cost little, and most of the
/// noise is theirs.
const SHADOW_RAYS: u32 = 2;
/// Divisor for the number of photons where a glossy surface is seen faintly.
const COARSE: usize = 4;
/// The same where a glossy surface is one of the many ends of gathering rays: the mean over these
/// takes out the noise of each.
const COARSE_END: usize = 8;

/// The photon estimates from which light is gathered.
pub struct Gather<'a> {
    /// Number of gathering rays from each point, at least 1.
    directions: u32,
    /// Radiance of the surfaces, estimated beforehand at many points.
    cache: RadianceCache,
    /// Focused light: photons that came by mirrors, refraction or gloss alone.
    focused: SurfaceLight<'a>,
    /// Radiance that surfaces send of the focused light, estimated beforehand at many points.
    focused_cache: RadianceCache,
    /// A sheet that reflects all light: its radiance, times π, is the irradiance.
    white: Material,
    /// Radiance that such sheets would send of the focused light in the place of the surfaces, once
    /// a picture asks for it.
    white_cache: OnceLock<RadianceCache>,
    /// The normals with which curved meshes are drawn.
    normals: Normals,
}

impl<'a> Gather<'a> {
    /// Prepares gathering from the light on all surfaces, with `directions` rays from each point.
    /// It traces photons of focused light, as [`light_surfaces`] does, from which `light` comes,
    /// with the same `settings`. Errors: as those of [`light_surfaces`].
    ///
    /// [`light_surfaces`]: phylux_core::transport::light_surfaces
    pub fn new(
        light: &SurfaceLight<'a>,
        directions: u32,
        settings: &Settings,
        control: &Control,
    ) -> Result<Self> {
        let cache = RadianceCache::new(light, settings.threads.get())?;
        let focused = focused_light(light, settings, control)?;
        let focused_cache = RadianceCache::new(&focused, settings.threads.get())?;
        let focused = SurfaceLight { k: FOCUSED * focused.k, ..focused };
        let white = Lambert::white(light.scene.lanes()).into();
        let normals = Normals::new(light.scene);
        let white_cache = OnceLock::new();
        Ok(Self { directions, cache, focused, focused_cache, white, white_cache, normals })
    }

    /// Prepares pictures of irradiance. Error: no threads are to be had.
    pub(super) fn with_white(&self, threads: usize) -> Result<()> {
        if self.white_cache.get().is_none() {
            let cache = RadianceCache::of_white(&self.focused, threads)?;
            // another call may have been faster
            let _ = self.white_cache.set(cache);
        }
        Ok(())
    }

    /// Returns the irradiance of focused light near a point on the face of a piece (`bin`), per
    /// band.
    fn focused_irradiance(&self, bin: u32, point: Vec3) -> Vec<f64> {
        let cache = self.white_cache.get().expect("a picture of irradiance is prepared");
        let mut found = cache.mean_along_normal(bin, point, NEAREST);
        found.iter_mut().for_each(|v| *v *= f64::from(PI));
        found
    }

    /// Returns the normals with which curved meshes are drawn.
    pub(super) fn normals(&self) -> &Normals {
        &self.normals
    }

    /// Returns the radiance per band that a place sends of focused light.
    fn focused(&self, place: &Place) -> Vec<f64> {
        let Self { focused, focused_cache, .. } = self;
        told(focused, focused_cache, focused.k, place)
    }
}

/// Returns the radiance of a place per band, as its photons estimate it. Where the material relates
/// the radiance in any direction to that along the normal, the estimates made beforehand are
/// used; otherwise the nearest `k` photons.
fn told(light: &SurfaceLight, cache: &RadianceCache, k: usize, place: &Place) -> Vec<f64> {
    let Arrived { hit, material, interaction, .. } = &place.at;
    let Some(relative) = material.relative_radiance(interaction.cos) else {
        return light.radiance_of(hit.triangle, hit.point, -interaction.direction, k, |_| true);
    };
    let bin = light.patches.bin(hit.triangle, interaction.front);
    let mut sent = cache.mean_along_normal(bin, hit.point, NEAREST);
    sent.iter_mut().for_each(|v| *v *= f64::from(relative));
    sent
}

/// Returns the relative standard error of an estimate that [`told`] returned, for photons of one
/// power: it took `beforehand` photons where the estimate was made beforehand, otherwise the
/// nearest `k`.
fn error_of_told(beforehand: usize, k: usize, place: &Place) -> f32 {
    let known = place.at.material.relative_radiance(place.at.interaction.cos).is_some();
    SurfaceLight::error_of(if known { beforehand } else { k })
}

impl Whitted<'_> {
    /// Returns the radiance along a ray from the viewpoint, W/m2/sr or umol/m2/s/sr, with its
    /// noise. `shared` holds the estimates that the rays of a pixel share: of all light, and of
    /// focused light.
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
            let Arrived { hit, interaction, .. } = &place.at;
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
                    let k = self.light.coarse(COARSE);
                    let told = near(shared, &|| told(self.light, &gather.cache, k, place));
                    let lamps = place.gloss.map_or_else(|| told.zero(), |gloss| gloss.lamps(rng));
                    let error = error_of_told(self.light.k, k, place);
                    Found { lamps, ..Found::told(told, error) }
                }
                Some(gather) => {
                    let told = near(shared_focused, &|| gather.focused(place));
                    let told = Found::told(told, SurfaceLight::error_of(gather.focused.k));
                    told.with(self.gathered(gather, place, rng))
                }
            }
        })
    }

    /// Returns the irradiance on the side of a surface that a ray meets, W/m2 or umol/m2/s, with
    /// its noise.
    pub fn irradiance<L: Lanes>(
        &self,
        ray: &Ray,
        hit: &SurfaceHit,
        gather: Option<&Gather>,
        shared: &mut Shared,
        rng: &mut Stream,
    ) -> Found<L> {
        let (scene, triangle) = (self.light.scene, hit.triangle);
        let at = scene.arrived(*hit, ray.direction);
        let front = at.interaction.front;
        let (light, reach) = (self.told_by(gather), self.reach(hit));
        let told = shared.value(hit, front, reach, || match gather {
            None => light.irradiance(triangle, front, hit.point),
            Some(gather) => {
                gather.focused_irradiance(light.patches.bin(triangle, front), hit.point)
            }
        });
        let told = Found::told(load(told), light.error_of_alike());
        let Some(gather) = gather else { return told };
        let at = Arrived { material: &gather.white, ..at };
        let place = Place { at, length: hit.t, share: 1.0, gloss: None };
        told.with(self.gathered::<L>(gather, &place, rng).map(|found| found.scaled(PI)))
    }

    /// Returns the power per area that a surface absorbs, from both sides together, where a ray
    /// meets it, W/m2 or umol/m2/s, with its noise. `shared` holds the estimates that the rays of a
    /// pixel share: of irradiance, and of absorbed power or absorptance.
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
            // from many photons, of which each gives nearly the same absorptance
            let share = absorbed
                .value(hit, front, reach, || self.light.absorptance(triangle, front, hit.point));
            found * &load(share)
        };
        let mut found = of_face(ray.direction);
        found += of_face(-ray.direction);
        found
    }

    /// Returns the photons that estimate the light that is not gathered: focused light, or all
    /// light where nothing is gathered.
    pub fn told_by<'b>(&'b self, gather: Option<&'b Gather>) -> &'b SurfaceLight<'b> {
        gather.map_or(self.light, |gather| &gather.focused)
    }

    /// Returns the largest distance between points that share an estimate, m.
    pub fn reach(&self, hit: &SurfaceHit) -> f32 {
        PIXELS * self.viewpoint.camera.pixel() * hit.t
    }

    /// Returns the radiance that a place sends towards the camera by diffuse scattering, without
    /// the focused light that arrives there: of light that comes straight from lamps, and of light
    /// that other surfaces send.
    fn gathered<L: Lanes>(
        &self,
        gather: &Gather,
        place: &Place,
        rng: &mut Stream,
    ) -> [Spectrum<L>; 2] {
        let [mut lamps, mut surfaces] = self.gather::<L>(gather, place, NEAR, rng);
        for _ in 1..gather.directions {
            let [more_of_lamps, more_of_surfaces] = self.gather::<L>(gather, place, NEAR, rng);
            lamps += more_of_lamps;
            surfaces += more_of_surfaces;
        }
        [lamps, surfaces].map(|sum| sum.scaled(1.0 / gather.directions as f32))
    }

    /// Returns one estimate of both: by shadow rays to lamps, and by what one gathering ray finds.
    fn gather<L: Lanes>(
        &self,
        gather: &Gather,
        place: &Place,
        near: u32,
        rng: &mut Stream,
    ) -> [Spectrum<L>; 2] {
        let scene = self.light.scene;
        let at = &place.at;
        let joined = place.gloss.map_or_else(|| Joined::new(scene, *at), |gloss| gloss.joined);
        let by_shadow_ray = |rng: &mut Stream| -> Spectrum<L> {
            let density = |d| place.gloss.map_or(0.0, |gloss| gloss.density(d));
            let [scattered, mirrored] = joined.radiance(density, rng);
            scattered + mirrored.scaled(place.gloss.map_or(0.0, |gloss| gloss.fraction))
        };
        // the first shadow ray and the gathering ray have the numbers that are spread evenly
        let mut from_lamps = by_shadow_ray(rng);
        let scatter = at.material.sample::<L>(&at.interaction, Transport::Importance, rng);
        (1..SHADOW_RAYS).for_each(|_| from_lamps += by_shadow_ray(rng));
        let from_lamps = from_lamps.scaled(1.0 / SHADOW_RAYS as f32);
        let Some(scatter) = scatter.filter(|s| s.lobe.is_diffuse()) else {
            return [from_lamps.clone(), from_lamps.zero()];
        };
        let ray = onward(at, scatter.lobe, scatter.direction);
        let start = Way::new(ray, scene.lanes(), false, SMALL_GATHERED);
        // lamps seen by way of mirrors are focused light, which photons estimate
        let share = |way: &Way<L>, hit: &LightHit| {
            if way.straight { joined.weight(&way.ray, hit) } else { 0.0 }
        };
        let found = self.follow(start, rng, share, |end, rng| {
            Found::of_surfaces(self.sent(gather, end, near, rng))
        });
        [from_lamps + found.told * &scatter.weight, found.surfaces * &scatter.weight]
    }

    /// Returns the radiance that the place `end`, where a gathering ray ends, sends back along the
    /// ray.
    fn sent<L: Lanes>(
        &self,
        gather: &Gather,
        end: &Place,
        near: u32,
        rng: &mut Stream,
    ) -> Spectrum<L> {
        let (light, Arrived { hit, material, interaction, .. }) = (self.light, &end.at);
        let (triangle, outgoing) = (hit.triangle, -interaction.direction);
        let Some(relative) = material.relative_radiance(interaction.cos) else {
            // light that came to a glossy surface straight or by gloss alone becomes focused light
            // where it goes on to, and photons estimate it there: it is left out here
            let is_glossy = material.glossy() > 0.0;
            let wanted = |came: Came| came.diffused || !is_glossy;
            let k = light.coarse(COARSE_END);
            return load(&light.radiance_of(triangle, hit.point, outgoing, k, wanted));
        };
        let bin = light.patches.bin(triangle, interaction.front);
        let Some(cached) = gather.cache.near(bin, hit.point) else {
            return Spectrum::splat(light.scene.lanes(), 0.0);
        };
        if near > 0 && end.length < cached.reach {
            let focused = load::<L>(&gather.focused(end));
            let [lamps, surfaces] = self.gather(gather, end, near - 1, rng);
            return focused + lamps + surfaces;
        }
        let sent = cached.along_normal;
        Spectrum::from_fn(sent.len(), |b| sent.get(b).map_or(0.0, |v| v * relative))
    }
}
