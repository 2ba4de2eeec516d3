//! The faces of captors, where paths start.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use super::{
    Aim, Leg, Path, Pilot,
    choice::{LightChoice, Place},
    course,
    mirrored::{Step, by_way_of},
    spots::{self, Passage, Spots},
    vertex::{Arrival, Vertex},
};
use crate::{
    math::{
        effort,
        geometry::{Frame, POINT, ROUNDING, Ray, Triangle, across},
        rng::Stream,
        sampling::{cosine_hemisphere, cosine_hemisphere_density},
        spectrum::{Lanes, Spectrum},
    },
    scene::{
        captor::{Captor, CaptorKind, Channel},
        daylight::InfiniteLight,
        material::{Interaction, LobeKind, Material, Scatterer, Transport},
        parameter::Variant,
        world::{Outline, Scene, Shape, Surface},
    },
    transport::met::{self, Along, Meeting, Moments, PathAccount},
};

/// What one path has found for a face, per band in W or umol/s.
#[derive(Clone, Debug)]
pub struct PathScore<L> {
    /// Estimate of the flux on the face.
    pub flux: Spectrum<L>,
    /// Estimate of the part of the flux that the surface absorbs; zero for a virtual captor.
    pub absorbed: Spectrum<L>,
    /// Number of rays traced.
    pub rays: u32,
    /// Whether a limit on the length of paths ended the path, so that what it could still have
    /// found is missing. If surfaces have left only a fraction of the path, this is true with that
    /// probability.
    pub cut_off: bool,
    /// The same in each layer in which the path or a photon that was sent to it arrives. Empty where
    /// the captor counts in no layer.
    pub in_layers: Vec<(usize, Spectrum<L>)>,
    /// The moments of the scene's parameters in `flux`, in its unit, or what it is in each variant of the
    /// scene; none unless they are asked for.
    pub moments: Moments<L>,
    /// The same in `absorbed`.
    pub absorbed_moments: Moments<L>,
}

impl<L: Lanes> PathScore<L> {
    /// Adds what one contribution is to the sums of an index: what the sensor reads, and what the surface
    /// absorbs.
    fn add_moments(&mut self, index: usize, [read, absorbed]: [Spectrum<L>; 2]) {
        self.moments.add(index, read);
        if !absorbed.is_zero() {
            self.absorbed_moments.add(index, absorbed);
        }
    }
}

/// A face of a captor, from which paths start.
pub struct Face<'a> {
    /// Index of the captor.
    pub captor: usize,
    /// Front or back.
    pub channel: Channel,
    scene: &'a Scene,
    area: f32,
    /// Middle of the captor, m.
    middle: Vec3,
    outline: Outline<'a>,
    /// How paths start from each triangle; empty for a copy that shares its triangles, and for a disc
    /// or sphere.
    places: Vec<StartPlace>,
}

/// How paths start from one triangle, or from a point of a disc or sphere.
#[derive(Clone, Copy)]
struct StartPlace {
    /// Unit normal of the face.
    normal: Vec3,
    /// The surface, which paths leave as photons do; `None` for a virtual captor.
    surface: Option<Surface>,
    /// Way from the triangle of a virtual captor to the points where paths start, m.
    lift: Vec3,
    /// Barycentric weights below which a point may be too close to the edge opposite the corner.
    margins: Vec3,
}

impl StartPlace {
    /// Returns the way from the point to where paths start, m. Of a virtual captor it
    /// leads off the plane by more than rounding, so that every point is on the same side of a lamp in
    /// that plane, whether a path starts there or a photon arrives.
    fn off(&self, point: Vec3) -> Vec3 {
        match self.surface {
            Some(surface) => surface.offset_at(point) * self.normal,
            None => self.lift + ROUNDING * across(self.normal, point) * self.normal,
        }
    }

    /// Returns the distance of points from the edges of the triangle, besides their errors along it,
    /// m.
    fn apart(&self, point: Vec3) -> f32 {
        let virtually = || POINT * across(self.normal, point);
        self.surface.map_or_else(virtually, |surface| surface.apart(point))
    }
}

impl<'a> Face<'a> {
    /// Returns the front or the back of a captor of `scene`.
    pub fn new(scene: &'a Scene, captor: usize, channel: Channel) -> Self {
        let of: &Captor = &scene.captors()[captor];
        let outline = scene.outline(of);
        let area = of.area_of_face() as f32;
        let middle = (of.center - scene.center()).as_vec3();
        let places = Vec::new();
        let mut face = Self { captor, channel, scene, area, middle, outline, places };
        let make = |(index, triangle): (usize, &Triangle)| {
            face.make_place(index, Shape::Triangle(*triangle), triangle.a)
        };
        face.places = face.outline.own().iter().enumerate().map(make).collect();
        face
    }

    /// Returns how paths start from a shape, at this point.
    #[inline]
    fn place(&self, shape: usize, point: Vec3) -> StartPlace {
        let make = || self.make_place(shape, self.outline.shape(shape), point);
        self.places.get(shape).copied().unwrap_or_else(make)
    }

    fn make_place(&self, index: usize, shape: Shape, point: Vec3) -> StartPlace {
        let (scene, captor) = (self.scene, &self.scene.captors()[self.captor]);
        let front = shape.normal_at(point);
        let normal = if self.channel == Channel::Back { -front } else { front };
        match self.surface(index) {
            Some(surface) => {
                let margins = scene.margins(captor.triangles.start + index);
                StartPlace { normal, surface: Some(surface), lift: Vec3::ZERO, margins }
            }
            None => {
                let margins = match shape {
                    Shape::Triangle(triangle) => {
                        Triangle::margins(triangle.slopes(), triangle.blur())
                    }
                    Shape::Round(_) => Vec3::ZERO,
                };
                let lift = scene.lift(self.captor) * front;
                StartPlace { normal, surface: None, lift, margins }
            }
        }
    }

    /// Follows one path back from the face. It uses what the `pilot` run learned. The score has the
    /// moments of the scene's parameters if they are asked for.
    pub fn path<L: Lanes>(&self, pilot: &Pilot, moments: bool, rng: &mut Stream) -> PathScore<L> {
        match moments {
            false => self.path_along::<L, ()>(pilot, rng),
            true => self.path_along::<L, PathAccount<L>>(pilot, rng),
        }
    }

    /// Follows one path back from the face, and keeps account of what it meets.
    fn path_along<L: Lanes, A: Along<L>>(&self, pilot: &Pilot, rng: &mut Stream) -> PathScore<L> {
        effort::spend(effort::PATH);
        let Start { triangle, point, normal } = self.start(rng);
        let at = self.vertex(point, normal);
        let mut path = Path { scene: self.scene, pilot, rng, rays: 0, cut_off: false };

        let free = path.free_share();
        let along = |direction: Vec3| free * cosine_hemisphere_density(direction.dot(normal));
        let direct = [
            path.next_event::<L>(&at, along),
            path.mirrored_sun::<L>(&at),
            path.sent::<L>(&at, along),
        ];
        let direct = direct.map(|lit| {
            let mut lit = lit?;
            lit.irradiance = lit.irradiance.scaled(self.area * lit.towards.dot(normal).max(0.0));
            Some(lit)
        });
        let indirect = match path.aim(&at) {
            Aim::Nowhere => None,
            Aim::Free => {
                let local = cosine_hemisphere(path.rng.square());
                Some((Frame::new(normal).to_world(local), PI / free, None))
            }
            Aim::At(triangle, target) => {
                let towards = (target - point).normalize_or_zero();
                let cos = towards.dot(normal);
                (cos > 0.0).then_some((towards, cos, Some(triangle)))
            }
        };
        let indirect = indirect.map(|(direction, weight, aimed)| {
            let ray = Ray { origin: point, direction };
            let leg = Leg { at, ray, density: Some(along(direction)), aimed, unbroken: true };
            let mut account = A::default();
            let flux = path.follow::<L>(leg, &mut account).scaled(self.area * weight);
            (direction, flux, account.into_sums(self.area * weight))
        });
        let Path { rays, cut_off, .. } = path;
        let [flux, absorbed] = [0.0; 2].map(|zero| Spectrum::splat(self.scene.lanes(), zero));
        let (in_layers, moments) = (Vec::new(), Moments::default());
        let absorbed_moments = Moments::default();
        let mut score =
            PathScore { flux, absorbed, rays, cut_off, in_layers, moments, absorbed_moments };
        for lit in direct.into_iter().flatten() {
            let mut account = A::default();
            course::count(&mut account, self.scene, (&at, &lit), &lit.irradiance, |_| ());
            let (direction, cos) = (lit.towards, lit.towards.dot(normal));
            let (coming, sums) = (Coming { triangle, direction, cos }, account.into_sums(1.0));
            self.take(&mut score, coming, lit.irradiance, sums, rng);
        }
        if let Some((direction, flux, moments)) = indirect {
            let cos = direction.dot(normal);
            self.take(&mut score, Coming { triangle, direction, cos }, flux, moments, rng);
        }
        let layer = self.layer(triangle, point);
        score.in_layers.extend(layer.map(|layer| (layer, score.absorbed.clone())));
        if let Some(spots) = &pilot.spots {
            self.sent::<L, A>(spots, free, &mut score, rng);
        }
        score
    }

    /// Adds to `score` flux that comes to the face, and its moments; these are `None` where no account
    /// is kept. Returns what the surface absorbs of the flux.
    #[inline(always)]
    fn take<L: Lanes>(
        &self,
        score: &mut PathScore<L>,
        coming: Coming,
        flux: Spectrum<L>,
        moments: Option<Moments<L>>,
        rng: &mut Stream,
    ) -> Spectrum<L> {
        let absorbed = self.absorbed(coming.triangle, coming.direction, &flux, rng);
        if let Some(moments) = moments {
            self.take_moments(score, coming, [&flux, &absorbed], moments, rng);
        }
        score.absorbed += absorbed.clone();
        score.flux += self.read(flux, coming.cos);
        absorbed
    }

    /// Adds to `score` the moments of flux that comes to the face, part of which the surface absorbs.
    #[inline(never)]
    fn take_moments<L: Lanes>(
        &self,
        score: &mut PathScore<L>,
        Coming { triangle, direction, cos }: Coming,
        [flux, absorbed]: [&Spectrum<L>; 2],
        moments: Moments<L>,
        rng: &Stream,
    ) {
        let variants = self.scene.parameters().variants();
        for (index, moment) in moments.0 {
            let read = self.read(moment.clone(), cos);
            let absorbed = match variants.get(index) {
                Some(variant) => {
                    self.absorbed_in(Some(variant), triangle, direction, &moment, &mut rng.clone())
                }
                None => {
                    let share = |own: f32, all: f32| if all > 0.0 { own / all } else { 0.0 };
                    absorbed.clone().zip(flux, share) * moment
                }
            };
            score.add_moments(index, [read, absorbed]);
        }
        // what the surface sends on of the light, it does not absorb; one scattering stands for all
        let Some((material, at)) = self.interaction(triangle, direction) else { return };
        let Some(surface) = self.surface(triangle).filter(|_| variants.is_empty()) else { return };
        let sample = material.sample::<L>(&at, Transport::Light, &mut rng.clone());
        let Some(sample) = sample else { return };
        let place = met::Place { material: surface.material, at };
        if let Some(own) = Meeting::sent_on(self.scene, place, sample.lobe) {
            let sent_on = (sample.weight * flux).scaled(-1.0);
            score.absorbed_moments.add(own.parameter.into(), own.moment(&sent_on));
        }
    }

    /// Returns the material of a triangle of a surface captor, and how light from a direction comes to
    /// it; `None` for a virtual captor.
    fn interaction(&self, triangle: usize, direction: Vec3) -> Option<(&'a Material, Interaction)> {
        let surface = self.surface(triangle)?;
        let first = self.scene.captors()[self.captor].triangles.start;
        let at = Interaction::new(-direction, surface.normal).on(first + triangle);
        Some((self.scene.material(&surface), at))
    }

    /// Returns the layer in which a point of a triangle of the captor counts.
    fn layer(&self, triangle: usize, point: Vec3) -> Option<usize> {
        let captor = &self.scene.captors()[self.captor];
        let of = |first: usize| self.scene.layer_of(first + triangle, point);
        (captor.kind == CaptorKind::Surface).then_some(captor.triangles.start).and_then(of)
    }

    /// Returns what the sensor reads of flux that comes at this cosine to the normal of the face.
    fn read<L: Lanes>(&self, flux: Spectrum<L>, cos: f32) -> Spectrum<L> {
        match &self.scene.captors()[self.captor].sensor.response {
            None => flux,
            Some(response) => flux.scaled(response.factor(cos)),
        }
    }

    /// Returns the starting point of a path, chosen uniformly on the face.
    fn vertex(&self, point: Vec3, normal: Vec3) -> Vertex {
        let arrival = Some(Arrival { from: self.middle, density: 1.0 / self.area });
        let one_sided = Some(normal);
        let choice = LightChoice::new(self.scene, Place { point, one_sided });
        Vertex { point, step: None, one_sided, arrival, choice }
    }

    /// Sends a photon from a lamp, and adds to `score` what it brings to the face, weighted by the
    /// balance heuristic against the paths that start there.
    fn sent<L: Lanes, A: Along<L>>(
        &self,
        spots: &Spots,
        free: f32,
        score: &mut PathScore<L>,
        rng: &mut Stream,
    ) {
        let (scene, captor) = (self.scene, &self.scene.captors()[self.captor]);
        let (light, chance) = spots.choose(scene, self.middle, rng);
        let ray = scene.lights()[light].emit(rng);
        score.rays += 1;
        let power = scene.lights()[light].spectrum::<L>();
        let mut account = A::default();
        spots::straight::<L>(scene, ray, |passage, through| {
            let crossing = match passage {
                Passage::To(crossing) => crossing,
                Passage::Through(at) => {
                    return account.sent_forth(scene, at, LobeKind::Straight);
                }
            };
            let channel = if crossing.front { Channel::Front } else { Channel::Back };
            if (crossing.captor, channel) != (self.captor, self.channel) {
                return;
            }
            let triangle = crossing.triangle - captor.triangles.start;
            let place = self.place(triangle, crossing.point);
            let normal = place.normal;
            // points are lifted as paths start, so that both weigh the lights alike: a lamp may lie
            // in the plane of the face
            let point = crossing.point + place.off(crossing.point);
            let Some(origin) = spots::origin(scene, light, &ray, point) else { return };
            let share = spots.share(scene, &self.vertex(point, normal), &origin, |d| {
                free * cosine_hemisphere_density(d.dot(normal))
            });
            let flux = (power.clone() * through).scaled(share / chance);
            let mut here = account.clone();
            here.found(scene, &flux, |met| met.add(scene.parameters().of_light(light)));
            let moments = here.into_sums(1.0);
            let (direction, cos) = (origin.towards, origin.towards.dot(normal));
            let absorbed =
                self.take(score, Coming { triangle, direction, cos }, flux, moments, rng);
            let layer = self.layer(triangle, point);
            score.in_layers.extend(layer.map(|layer| (layer, absorbed)));
        });
    }

    /// Draws a point of the captor, and a direction of the suns of `light`, which is at infinity, each as
    /// likely as the others.
    /// `None` where the light has no suns.
    pub fn sunbeam<L: Lanes>(&self, light: &InfiniteLight, rng: &mut Stream) -> Option<Sunbeam<L>> {
        let (triangle, weights) = self.outline.choose(rng);
        let (sun, irradiance) = light.sample_suns_alike::<L>(rng)?;
        Some(Sunbeam { triangle, weights, sun, irradiance })
    }

    /// Estimates from one beam what suns bring to the face straight, through thin panes, or by way
    /// of one flat pane or mirror. This is the light of which [`Finding`](super::Finding) says that
    /// it is neither scattered nor hidden. The beam may have been drawn for the other face of the
    /// captor. Light of faint images counts `faint` times; they are not looked for if that is 0.
    /// `None` where no light arrives.
    pub fn direct<L: Lanes>(
        &self,
        beam: &Sunbeam<L>,
        faint: f32,
        rng: &mut Stream,
    ) -> Option<Sunlight<L>> {
        let (scene, sun) = (self.scene, beam.sun);
        let at = self.start_at(beam.triangle, beam.weights);
        let straight = self.straight(&at, sun);
        let Start { triangle, point: origin, normal } = at;
        // the face of a spherical sensor is four times its cross-section, which is its area
        let start = self.area / scene.captors()[self.captor].area as f32;
        let shines = |ray: &Ray| scene.visibility_along::<L>(ray, f32::INFINITY);
        let mut found: Option<Sunlight<L>> = None;
        // takes in the fraction of the suns' light that arrives along a direction
        let mut add = |arriving: Spectrum<L>,
                       direction: Vec3,
                       is_straight: bool,
                       rng: &mut Stream| {
            let cos = normal.dot(direction);
            let irradiance = (arriving * &beam.irradiance).scaled(cos * start);
            let absorbed = self.absorbed(triangle, direction, &irradiance, rng);
            let irradiance = self.read(irradiance, cos);
            found = Some(match found.take() {
                Some(Sunlight { irradiance: others, absorbed: of_others, is_straight: any }) => {
                    let is_straight = any || is_straight;
                    let absorbed = of_others + absorbed;
                    Sunlight { irradiance: others + irradiance, absorbed, is_straight }
                }
                None => Sunlight { irradiance, absorbed, is_straight },
            });
        };
        if let Some(visible) = straight {
            add(visible, sun, true, rng);
        }
        if let Some(mirrors) = scene.flat_mirrors() {
            for (image, toward) in mirrors.seen(origin, Some(normal), sun) {
                let weight = if mirrors.is_faint(image) { faint } else { 1.0 };
                if weight == 0.0 {
                    continue;
                }
                let direction = toward.normalize();
                let ray = Ray { origin, direction };
                let (arriving, _) =
                    by_way_of(scene, mirrors, image, ray, sun, shines, |_: Step<L>| ());
                if !arriving.is_zero() {
                    add(arriving.scaled(weight), direction, false, rng);
                }
            }
        }
        found
    }

    /// Returns whether the sun of a beam shines on its point, on this face, straight or through thin
    /// panes.
    pub fn is_lit<L: Lanes>(&self, beam: &Sunbeam<L>) -> bool {
        self.straight::<L>(&self.start_at(beam.triangle, beam.weights), beam.sun).is_some()
    }

    /// Returns the layer in which the point of a beam counts.
    pub fn layer_of<L>(&self, beam: &Sunbeam<L>) -> Option<usize> {
        self.layer(beam.triangle, self.start_at(beam.triangle, beam.weights).point)
    }

    /// Returns the fraction of a sun's light that comes to a point straight, or through thin panes;
    /// `None` where none does.
    fn straight<L: Lanes>(&self, at: &Start, sun: Vec3) -> Option<Spectrum<L>> {
        let ray = Ray { origin: at.point, direction: sun };
        let visible = || self.scene.visibility_along::<L>(&ray, f32::INFINITY);
        (at.normal.dot(sun) > 0.0).then(visible).flatten().filter(|visible| !visible.is_zero())
    }

    /// Draws a point of the face. It is as far off the face and from its edges as photons that
    /// leave it.
    fn start(&self, rng: &mut Stream) -> Start {
        let (triangle, weights) = self.outline.choose(rng);
        self.start_at(triangle, weights)
    }

    fn start_at(&self, triangle: usize, weights: Vec2) -> Start {
        let shape = self.outline.shape(triangle);
        let (point, place) = match shape {
            Shape::Triangle(there) => {
                let place = self.place(triangle, there.a);
                (there.point_within(weights, place.margins, |p| place.apart(p)), place)
            }
            Shape::Round(_) => {
                let point = shape.point(weights);
                (point, self.place(triangle, point))
            }
        };
        Start { triangle, point: point + place.off(point), normal: place.normal }
    }

    /// Returns the surface of a triangle of a surface captor; `None` for a virtual captor.
    fn surface(&self, triangle: usize) -> Option<Surface> {
        let captor = &self.scene.captors()[self.captor];
        let surface = || self.scene.surface(captor.triangles.start + triangle);
        (captor.kind == CaptorKind::Surface).then(surface)
    }

    /// Returns the part of `flux` from `direction` that a surface captor absorbs.
    fn absorbed<L: Lanes>(
        &self,
        triangle: usize,
        direction: Vec3,
        flux: &Spectrum<L>,
        rng: &mut Stream,
    ) -> Spectrum<L> {
        self.absorbed_in(None, triangle, direction, flux, rng)
    }

    /// Returns what the captor absorbs in a variant of the scene.
    #[inline]
    fn absorbed_in<L: Lanes>(
        &self,
        variant: Option<&Variant>,
        triangle: usize,
        direction: Vec3,
        flux: &Spectrum<L>,
        rng: &mut Stream,
    ) -> Spectrum<L> {
        let Some((material, interaction)) = self.interaction(triangle, direction) else {
            return flux.zero();
        };
        let other = variant.zip(self.surface(triangle));
        let material =
            other.map_or(material, |(variant, surface)| variant.material(surface.material));
        match material.absorptance(&interaction) {
            Some(absorptance) => absorptance * flux,
            // without a closed form: what is left after one random scattering is absorbed, on
            // average
            None => match material.sample::<L>(&interaction, Transport::Light, rng) {
                Some(scatter) => scatter.weight.zip(flux, |weight, f| f * (1.0 - weight)),
                None => flux.clone(),
            },
        }
    }
}

/// A point of a captor, and a direction of a sun.
pub struct Sunbeam<L> {
    /// Index among the captor's triangles; 0 for a disc or sphere.
    triangle: usize,
    /// The numbers of the point on it: barycentric weights, or those of a disc or sphere.
    weights: Vec2,
    /// Direction towards the sun, a unit vector.
    sun: Vec3,
    /// Irradiance of the suns on a plane across that direction, over the probability of the choice,
    /// per band, W/m2.
    irradiance: Spectrum<L>,
}

/// An estimate of what suns bring to a face, per band and per area of the captor, W/m2.
pub struct Sunlight<L> {
    /// Irradiance, as the sensor reads it.
    pub irradiance: Spectrum<L>,
    /// What the surface absorbs of it; zero for a virtual captor.
    pub absorbed: Spectrum<L>,
    /// Whether light comes straight from the sun, or through thin panes.
    pub is_straight: bool,
}

/// How light comes to a face.
#[derive(Clone, Copy)]
struct Coming {
    /// Index among the captor's triangles; 0 for a disc or sphere.
    triangle: usize,
    /// Where it comes from, a unit vector.
    direction: Vec3,
    /// The cosine of its angle to the normal of the face.
    cos: f32,
}

/// The point where a path starts.
struct Start {
    /// Index among the captor's triangles; 0 for a disc or sphere.
    triangle: usize,
    point: Vec3,
    /// Unit normal of the face.
    normal: Vec3,
}
