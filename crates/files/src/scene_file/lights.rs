//! Loads lights: point, spot, tube and area lights here; those of rooms of Radiance in `radiance`,
//! and those that are infinitely far away in `daylight`.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::{
    daylight::Sky,
    loader::Loader,
    luminaires::{Aim, LampFile},
    placed::Turn,
    spec::*,
};
use crate::obj::longest_edge;
use phylux_core::{
    error::{Checked, Result, number},
    math::{
        geometry::{Transform, area, triangulate},
        units::{Quantity, UMOL_PER_J_NM},
    },
    scene::{
        light::{
            Area, Cone, Intensity, IsotropicLine, Lamp, LightSource, Luminaire, LuminaireArea,
            Tube, check_aperture, check_area, check_axis, check_direction, check_half_angle,
            check_power,
        },
        world::{LightPart, SurfacePart, check_watts},
    },
};

/// Sides of the prism that stands for a tube with a material.
const TUBE_SIDES: usize = 64;

impl Loader<'_> {
    pub(super) fn load_lights(&mut self, lights: &[LightSpec], sky: Option<&Sky>) -> Result<()> {
        for (i, file) in lights.iter().enumerate() {
            let pointer = format!("/lights/{i}");
            if let Some(sky) = sky
                && self.load_infinite(&pointer, file, sky)?
            {
                continue;
            }
            let keys = file.keys();
            if let Some(watts) = keys.watts {
                self.located(format!("{pointer}/watts"), check_watts(watts))?;
            }
            let lights = match file {
                LightSpec::Point(light) => vec![self.point_light(&pointer, light)?],
                LightSpec::Spot(light) => vec![self.spot_light(&pointer, light)?],
                LightSpec::Tube(light) => vec![self.tube_light(&pointer, light)?],
                LightSpec::Area(light) => self.area_lights(&pointer, light)?,
                LightSpec::Rad(light) => {
                    self.rad_light(&pointer, light)?;
                    continue;
                }
                LightSpec::Sun(_) | LightSpec::Sky(_) | LightSpec::Environment(_) => continue,
            };
            let name = keys.name.map_or(format!("light{i}"), String::from);
            let several = lights.len() > 1;
            for (copy, light) in lights.into_iter().enumerate() {
                let name = if several { format!("{name}#{copy}") } else { name.clone() };
                self.make_solid(&name, &light);
                if copy == 0
                    && let Some(watts) = keys.watts
                {
                    self.check_efficacy(&pointer, &light.lamp.power, watts);
                }
                self.parts.watts.extend(keys.watts.map(|watts| (name.clone(), watts)));
                self.add_light(&pointer, LightPart::new(name, light.lamp))?;
            }
        }
        Ok(())
    }

    /// Warns of a lamp that emits more energy than the `watts` it takes. A umol of a band carries at
    /// least the energy that it has at the longest wavelength.
    fn check_efficacy(&mut self, pointer: &str, power: &[f64], watts: f64) {
        let place = self.place(pointer);
        let (least, emitted, remedy) = match self.parts.quantity {
            Quantity::Watt => {
                ("", power.iter().sum(), "a power in umol/s needs `\"quantity\": \"umol/s\"`")
            }
            Quantity::Micromole => {
                let longest = self.parts.bands.iter().map(|band| band.to_nm);
                let of_band = |(to, umol): (Option<f64>, &f64)| Some(umol / (to? * UMOL_PER_J_NM));
                let energy = longest.zip(power).filter_map(of_band).sum::<f64>();
                ("at least ", energy, "its power or its watts are wrong")
            }
        };
        if emitted > watts {
            let (emitted, watts) = (number(emitted), number(watts));
            let problem =
                format!("emits {least}{emitted} W of light and takes {watts} W; {remedy}");
            self.told.warn(place, problem);
        }
    }

    /// Adds a light that is infinitely far away, if `file` is one, and returns whether it is.
    fn load_infinite(&mut self, pointer: &str, file: &LightSpec, sky: &Sky) -> Result<bool> {
        if let Some(by_hour) = self.files.sources.by_hour
            && self.load_by_hour(pointer, file, sky, by_hour)?
        {
            return Ok(true);
        }
        let (usual, mut infinite, through) = match file {
            LightSpec::Sun(light) => ("sun", self.sun_light(pointer, light, sky)?, &light.through),
            LightSpec::Sky(light) => ("sky", self.sky_light(pointer, light, sky)?, &light.through),
            LightSpec::Environment(light) => {
                let infinite = self.environment_light(pointer, light, sky)?;
                ("environment", infinite, &light.through)
            }
            _ => return Ok(false),
        };
        if let Some(polygons) = through {
            infinite.through = self.openings(pointer, polygons)?;
        }
        let name = file.keys().name.unwrap_or(usual);
        self.add_light(pointer, LightPart::new(name, infinite))?;
        Ok(true)
    }

    /// Returns the polygons that light comes in through, in metres. Error: one of them is not a
    /// planar polygon, or they are too many.
    fn openings(&self, pointer: &str, polygons: &[Vec<[f64; 3]>]) -> Result<Vec<Vec<DVec3>>> {
        /// The most corners of all polygons together.
        const MOST: usize = 10_000;
        let corners: usize = polygons.iter().map(Vec::len).sum();
        if polygons.is_empty() || corners > MOST {
            let problem = format!("{} polygons with {corners} corners", polygons.len());
            return Err(self
                .error(format!("{pointer}/through"), problem)
                .remedy(format!("give at least one, and at most {MOST} corners in all")));
        }
        let polygon = |(i, polygon): (usize, &Vec<[f64; 3]>)| {
            let corners: Vec<DVec3> = polygon.iter().map(|&corner| self.point(corner)).collect();
            let wrong = |problem: &str| {
                Err(self.error(format!("{pointer}/through/{i}"), problem).remedy(
                    "give the corners of a planar polygon, counter-clockwise seen from the sky",
                ))
            };
            if corners.len() < 3 || !corners.iter().all(|corner| corner.is_finite()) {
                return wrong("fewer than three corners, or one that is not finite");
            }
            let sides =
                corners.windows(2).map(|pair| (pair[0] - corners[0]).cross(pair[1] - corners[0]));
            let normal: DVec3 = sides.sum();
            let Some(unit) = normal.try_normalize() else { return wrong("a polygon without area") };
            let size = corners.iter().map(|c| c.distance(corners[0])).fold(0.0, f64::max);
            if corners.iter().any(|c| (*c - corners[0]).dot(unit).abs() > 1e-4 * size) {
                return wrong("its corners do not lie in one plane");
            }
            Ok(corners)
        };
        polygons.iter().enumerate().map(polygon).collect()
    }

    /// Adds a light. Error: its name is taken, or its power is not one that single precision can
    /// carry, or there are too many lights.
    pub(super) fn add_light(&mut self, pointer: &str, light: LightPart) -> Result<()> {
        let claimed = self.taken.claim_light(&light.name);
        self.located(pointer, claimed)?;
        if let LightSource::Lamp(lamp) = &light.source {
            self.located(pointer, check_power(&lamp.power, self.bands()))?;
        }
        self.parts.lights.push(light);
        Ok(())
    }

    /// Returns the emitter of the lamp `name` of an object. Error: nothing that shines can be made of
    /// it.
    pub(super) fn shining<E>(&self, name: &str, made: Checked<E>) -> Result<E> {
        self.located("", made.map_err(|problem| problem.of(format!("light `{name}`"))))
    }

    /// Adds the surfaces of a light to the scene, if the light has a material.
    fn make_solid(&mut self, name: &str, light: &Glowing) {
        let Some(material) = light.material else { return };
        let object = Some(self.parts.objects.len());
        self.parts.objects.push(name.to_string());
        let triangles = [light.lamp.outline().triangles(), &light.dark].concat();
        if !triangles.is_empty() {
            if self.materials.needs_tangents(material) {
                self.turn_next(triangles.iter().map(|corners| longest_edge(corners)));
            }
            self.parts.surfaces.push(SurfacePart { object, material, captor: None, triangles });
        }
        if !light.caps.is_empty() {
            let material = self.black(format!("caps of {name}"));
            let triangles = light.caps.clone();
            self.parts.surfaces.push(SurfacePart { object, material, captor: None, triangles });
        }
    }

    fn point_light(&mut self, pointer: &str, light: &PointSpec) -> Result<Glowing> {
        let position = self.point(light.position);
        let aim = Aim { aim: light.aim, zero_plane: light.zero_plane };
        let measured = self.measured(pointer, light.lamp_file())?;
        if measured.is_none() {
            self.only_with(pointer, "zero_plane", light.zero_plane, "`photometry`")?;
        }
        let power = self.power(pointer, &light.power, light.lamp_file(), measured.as_ref())?;
        let lamp = match (measured, light.cosine) {
            (None, None) => {
                self.only_with(pointer, "aim", light.aim, "`photometry` or `cosine`")?;
                Lamp::new(power, Cone::point(position))
            }
            (Some(measured), None) => {
                let (unmoved, down) = (Transform::default(), DVec3::NEG_Z);
                let intensity = self.intensity(pointer, &measured, aim, &unmoved, down)?;
                Lamp::new(power, Luminaire::new(position, intensity))
            }
            (None, Some(exponent)) => {
                let aim = light.aim.map_or(DVec3::NEG_Z, DVec3::from);
                let intensity = self.located(pointer, Intensity::cosine(exponent, aim))?;
                Lamp::new(power, Luminaire::new(position, intensity))
            }
            (Some(_), Some(_)) => {
                return Err(self
                    .error(pointer, "both `photometry` and `cosine`")
                    .remedy("give one of them"));
            }
        };
        Ok(Glowing::new(lamp))
    }

    fn spot_light(&mut self, pointer: &str, light: &SpotSpec) -> Result<Glowing> {
        let direction = check_direction(light.direction.into());
        let direction = self.located(format!("{pointer}/direction"), direction)?;
        let half_angle = light.half_angle_deg;
        self.located(format!("{pointer}/half_angle_deg"), check_half_angle(half_angle))?;
        let spot = Cone::spot(self.point(light.position), direction, half_angle.to_radians());
        let spot = self.located(pointer, spot)?;
        let power = self.power(pointer, &light.power, LampFile::default(), None)?;
        Ok(Glowing::new(Lamp::new(power, spot)))
    }

    fn tube_light(&mut self, pointer: &str, light: &TubeSpec) -> Result<Glowing> {
        let (from, to) = (self.point(light.from), self.point(light.to));
        let radius = light.radius * self.metres;
        let axis = self.located(pointer, check_axis(to - from))?;
        self.in_range(&format!("{pointer}/radius"), light.radius, 0.0, f64::MAX)?;
        let power = self.power(pointer, &light.power, LampFile::default(), None)?;
        let aperture = self.aperture(pointer, light, axis)?;
        if light.emission == EmissionSpec::Isotropic {
            if radius > 0.0 || light.material.is_some() {
                return Err(self
                    .error(format!("{pointer}/emission"), "only a line (radius 0) is isotropic")
                    .remedy("set `radius` to 0, or leave `emission` out"));
            }
            let line = self.located(pointer, IsotropicLine::new(from, to))?;
            return Ok(Glowing::new(Lamp::new(power, line)));
        }
        let Some(material) = &light.material else {
            let tube = match aperture {
                Some((toward, opening)) => Tube::part(from, to, radius, toward, opening),
                None => Tube::whole(from, to, radius),
            };
            return Ok(Glowing::new(Lamp::new(power, self.located(pointer, tube)?)));
        };
        if radius == 0.0 {
            return Err(self
                .error(format!("{pointer}/material"), "a line (radius 0) has no surface")
                .remedy("give the tube a radius, or leave `material` out"));
        }
        let material = Some(self.named_material(&format!("{pointer}/material"), material)?);
        let Prism { sides, dark, caps } = prism(from, to, axis, radius, aperture);
        let sides = self.located(pointer, Area::new(sides, false))?;
        Ok(Glowing { lamp: Lamp::new(power, sides), material, dark, caps })
    }

    /// Returns which part of a tube's circumference emits, or `None` if all of it does: the unit
    /// vector from the axis to the middle of that part, and its angle, rad.
    fn aperture(
        &self,
        pointer: &str,
        light: &TubeSpec,
        axis: DVec3,
    ) -> Result<Option<(DVec3, f64)>> {
        let (toward, opening) = match (light.toward, light.opening_deg) {
            (None, None) => return Ok(None),
            (Some(toward), Some(opening)) => (DVec3::from(toward), opening),
            (given, _) => {
                let (there, missing) = match given {
                    Some(_) => ("toward", "opening_deg"),
                    None => ("opening_deg", "toward"),
                };
                return Err(self
                    .error(format!("{pointer}/{there}"), format!("without `{missing}`"))
                    .remedy("give both: to which side the tube shines, and within which angle"));
            }
        };
        if light.radius == 0.0 {
            return Err(self
                .error(format!("{pointer}/opening_deg"), "a line (radius 0) has no sides")
                .remedy("give the tube a radius"));
        }
        let toward = self.located(pointer, check_aperture(axis, toward, opening))?;
        Ok((opening < 360.0).then_some((toward, opening.to_radians())))
    }

    /// Returns an area light. One with a measured distribution becomes as many lights as it has
    /// copies, if these are turned differently.
    fn area_lights(&mut self, pointer: &str, light: &AreaSpec) -> Result<Vec<Glowing>> {
        let copies = self.area_copies(pointer, light)?;
        let whole: f64 = copies.iter().flat_map(|copy| &copy.triangles).map(area).sum();
        let sides = if light.two_sided { 2.0 } else { 1.0 };
        let measured = self.measured(pointer, light.lamp_file())?;
        if measured.is_some() {
            let keys = [("two_sided", light.two_sided), ("radiance", light.radiance.is_some())];
            let remedy = "leave it out: the file says where the light goes, `power` how much";
            self.refuse_given(pointer, &keys, "does not go with `photometry`", remedy)?;
        } else {
            self.only_with(pointer, "aim", light.aim, "`photometry`")?;
            self.only_with(pointer, "zero_plane", light.zero_plane, "`photometry`")?;
        }
        let power = match (&light.power, &light.radiance) {
            (Some(power), None) => {
                let mut flux = self.power(pointer, power, light.lamp_file(), measured.as_ref())?;
                // a file states the flux of one lamp, and each copy is one
                if power.is_of_file() {
                    flux.iter_mut().for_each(|flux| *flux *= copies.len() as f64);
                }
                flux
            }
            (None, Some(radiance)) => {
                let radiance = self.per_band(&format!("{pointer}/radiance"), radiance, f64::MAX)?;
                radiance.iter().map(|l| sides * PI * l * whole).collect()
            }
            (given, _) => {
                let problem = match given {
                    Some(_) => "both `power` and `radiance`",
                    None => "neither `power` nor `radiance`",
                };
                return Err(self.error(pointer, problem).remedy("give exactly one of them"));
            }
        };
        let material = match &light.material {
            Some(name) => Some(self.named_material(&format!("{pointer}/material"), name)?),
            None => None,
        };
        let alike = copies.iter().all(|copy| copy.placed.turns_like(&copies[0].placed));
        let joined = |copies: Vec<Copy>| {
            let placed = copies[0].placed;
            Copy { placed, triangles: copies.into_iter().flat_map(|copy| copy.triangles).collect() }
        };
        let Some(measured) = measured else {
            let Copy { triangles, .. } = joined(copies);
            let area = self.located(pointer, Area::new(triangles, light.two_sided))?;
            return Ok(vec![Glowing { material, ..Glowing::new(Lamp::new(power, area)) }]);
        };
        let copies = if alike { vec![joined(copies)] } else { copies };
        let several = copies.len() > 1;
        let aim = Aim { aim: light.aim, zero_plane: light.zero_plane };
        let of_copy = |Copy { placed, triangles }: Copy| {
            let own: f64 = triangles.iter().map(area).sum();
            self.located(pointer, check_area(own))?;
            let cross: DVec3 = triangles.iter().map(|[a, b, c]| (*b - *a).cross(*c - *a)).sum();
            let intensity = self.intensity(pointer, &measured, aim, &placed, 0.5 * cross / own)?;
            let share = if several { own / whole } else { 1.0 };
            let power: Vec<f64> = power.iter().map(|power| power * share).collect();
            let area = self.located(pointer, LuminaireArea::new(triangles, intensity))?;
            Ok(Glowing { material, ..Glowing::new(Lamp::new(power, area)) })
        };
        copies.into_iter().map(of_copy).collect()
    }

    /// Returns the copies of an area light, one where it is a polygon.
    fn area_copies(&mut self, pointer: &str, light: &AreaSpec) -> Result<Vec<Copy>> {
        match (&light.vertices, &light.obj) {
            (Some(vertices), None) => {
                let placed = ("transform", light.transform.is_some());
                let keys = [placed, ("instances", light.instances.is_some())];
                let remedy = "place the `vertices` where they belong";
                self.refuse_given(pointer, &keys, "goes with `obj` only", remedy)?;
                if !(3..=10_000).contains(&vertices.len()) {
                    let problem = format!("{} corners, must be 3 to 10000", vertices.len());
                    return Err(self
                        .error(format!("{pointer}/vertices"), problem)
                        .remedy("use an `obj` for a larger shape"));
                }
                self.count_triangles(vertices.len() - 2)?;
                let polygon: Vec<DVec3> = vertices.iter().map(|&v| self.point(v)).collect();
                let triangles = triangulate(&polygon).into_iter().map(|t| t.map(|i| polygon[i]));
                Ok(vec![Copy { placed: Transform::default(), triangles: triangles.collect() }])
            }
            (None, Some(file)) => {
                let obj = self.obj(&format!("{pointer}/obj"), file)?;
                self.say_not_cut(&format!("{pointer}/obj"), &obj);
                let metres = self.metres_of(&obj);
                let instances = light.instances.as_deref();
                let mut copies = Vec::new();
                for placed in self.placements(pointer, light.transform, instances, Turn::None)? {
                    let mut triangles = Vec::new();
                    for part in &obj.parts {
                        triangles.extend(self.placed(&part.triangles, &placed, metres)?);
                    }
                    copies.push(Copy { placed, triangles });
                }
                Ok(copies)
            }
            (given, _) => {
                let problem = match given {
                    Some(_) => "both `vertices` and `obj`",
                    None => "neither `vertices` nor `obj`",
                };
                Err(self.error(pointer, problem).remedy("give exactly one of them"))
            }
        }
    }
}

/// A copy of the surface of an area light.
struct Copy {
    /// Where it stands.
    placed: Transform,
    triangles: Vec<[DVec3; 3]>,
}

/// A light and, if it has a material, the surfaces that it adds to the scene.
struct Glowing {
    lamp: Lamp,
    material: Option<usize>,
    /// Triangles of the light's material that do not emit: the sides of a tube beyond its aperture.
    dark: Vec<[DVec3; 3]>,
    caps: Vec<[DVec3; 3]>,
}

impl Glowing {
    fn new(lamp: Lamp) -> Self {
        Self { lamp, material: None, dark: Vec::new(), caps: Vec::new() }
    }
}

struct Prism {
    sides: Vec<[DVec3; 3]>,
    /// The sides beyond the aperture, which do not emit.
    dark: Vec<[DVec3; 3]>,
    caps: Vec<[DVec3; 3]>,
}

/// Makes a closed prism, normals out, that has the same lateral area as the cylinder. If there is
/// an `aperture` (the unit vector to its middle, and its angle, rad), its borders are edges of the
/// prism.
fn prism(
    from: DVec3,
    to: DVec3,
    axis: DVec3,
    radius: f64,
    aperture: Option<(DVec3, f64)>,
) -> Prism {
    let (x, y, opening) = match aperture {
        Some((toward, opening)) => (toward, axis.cross(toward), opening),
        None => {
            let (x, y) = axis.any_orthonormal_pair();
            (x, y, TAU)
        }
    };
    let whole = opening == TAU;
    let lit = match whole {
        true => TUBE_SIDES,
        false => ((opening / TAU * TUBE_SIDES as f64).round() as usize).clamp(1, TUBE_SIDES - 1),
    };
    let (step, dark_step) =
        (opening / lit as f64, (TAU - opening) / (TUBE_SIDES - lit).max(1) as f64);
    let half = |step: f64| (0.5 * step).sin();
    let dark_sides = (TUBE_SIDES - lit) as f64;
    let rim = radius * PI / (lit as f64 * half(step) + dark_sides * half(dark_step));
    let start = if whole { 0.0 } else { -0.5 * opening };
    let corner = |i: usize| {
        let i = i % TUBE_SIDES;
        let dark = i.saturating_sub(lit) as f64;
        let (sin, cos) = (start + i.min(lit) as f64 * step + dark * dark_step).sin_cos();
        rim * (cos * x + sin * y)
    };
    let mut prism = Prism { sides: Vec::new(), dark: Vec::new(), caps: Vec::new() };
    // x, y and the axis are right-handed in both cases above: corners run counter-clockwise around
    // the axis
    for i in 0..TUBE_SIDES {
        let (p, q) = (corner(i), corner(i + 1));
        let side = if i < lit { &mut prism.sides } else { &mut prism.dark };
        side.push([from + p, from + q, to + q]);
        side.push([from + p, to + q, to + p]);
        prism.caps.push([to, to + p, to + q]);
        prism.caps.push([from, from + q, from + p]);
    }
    prism
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prism_is_closed_and_has_the_cylinder_s_lateral_area() {
        let (from, to) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(2.0, 4.0, 1.0));
        let Prism { sides, caps, .. } = prism(from, to, (to - from).normalize(), 0.1, None);
        let lateral: f64 = sides.iter().map(area).sum();
        assert!((lateral - TAU * 0.1 * 3.0).abs() < 1e-12);
        let vector: DVec3 = sides.iter().chain(&caps).map(|[a, b, c]| (b - a).cross(c - a)).sum();
        assert!(vector.length() < 1e-12, "closed: {vector}");
        let middle = 0.5 * (from + to);
        for [a, b, c] in sides.iter().chain(&caps) {
            assert!((b - a).cross(c - a).dot(*a - middle) > 0.0, "normals point out");
        }
    }

    /// For every opening the prism is closed, has the cylinder's lateral area, and emits within the
    /// opening alone.
    #[test]
    fn a_prism_shines_within_its_aperture() {
        let (from, to, axis) = (DVec3::ZERO, 3.0 * DVec3::Z, DVec3::Z);
        for degrees in [1e-3, 5.0, 120.0, 359.0] {
            let opening = f64::to_radians(degrees);
            let Prism { sides, dark, caps } =
                prism(from, to, axis, 0.1, Some((DVec3::NEG_Y, opening)));
            let lateral: f64 = sides.iter().chain(&dark).map(area).sum();
            assert!((lateral - TAU * 0.1 * 3.0).abs() < 1e-12);
            let lit: f64 = sides.iter().map(area).sum();
            assert!((lit / (opening * 0.1 * 3.0) - 1.0).abs() < 2e-3, "{degrees}");
            let all = || sides.iter().chain(&dark).chain(&caps);
            let vector: DVec3 = all().map(|[a, b, c]| (b - a).cross(c - a)).sum();
            assert!(vector.length() < 1e-12, "closed: {vector}");
            for p in sides.iter().flatten() {
                let turn = p.with_z(0.0).angle_between(DVec3::NEG_Y);
                assert!(turn <= 0.5 * opening + 1e-9, "{degrees}: {turn}");
            }
        }
    }
}
