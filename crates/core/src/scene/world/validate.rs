//! Checks that parts make a valid scene, the same whether they come from a file or from a program.

use std::{collections::HashSet, fmt::Display};

use glam::DVec3;

use super::{
    Band, BandSum, CaptorPart, LightPart, NamedMaterial, SceneParts, SharedPart, SurfacePart,
};
use crate::{
    error::{Checked, Error, Problem, Result, check_range, number},
    math::{round::Round, spectrum::MAX_BANDS},
    scene::{
        captor::{CaptorKind, Sensor},
        daylight::InfiniteLight,
        instances::is_even,
        lattice::Lattice,
        light::{LightSource, check_power},
        material::{Material, Scatterer},
        parameter::{Factor, Parameter, Parameters, Sent},
    },
};

/// Limit on the number of triangles in a scene: those of surfaces, captors and lights together, and
/// of copies that share them once.
pub const MAX_TRIANGLES: usize = 20_000_000;
/// Limit on the number of triangles of all copies together.
pub const MAX_PLACED: u64 = 2_000_000_000;
/// Limit on the number of captors.
pub const MAX_CAPTORS: usize = 2_000_000;
/// Limit on the number of lights.
pub const MAX_LIGHTS: usize = 1_000_000;

impl SceneParts {
    /// Refuses parts that do not make a valid scene; the error names `place`. Whether coordinates
    /// are finite and shapes not too small is checked elsewhere, once the extent of the scene is
    /// known.
    pub(super) fn validate(&self, place: &str) -> Result<()> {
        let bands = self.bands.len();
        if self.lights.is_empty() {
            return Err(Error::input(place, "it has no light").remedy("add one to /lights"));
        }
        if bands == 0 || bands > MAX_BANDS {
            let problem = format!("{bands} bands, must be 1 to {MAX_BANDS}");
            return Err(Error::input(place, problem).remedy("change /bands"));
        }
        self.check_names()
            .and_then(|()| self.check_numbers())
            .and_then(|()| self.check_watts())
            .map_err(|problem| problem.at(place))?;
        for band in &self.bands {
            check(band.check(), format_args!("band `{}`", band.name), place)?;
        }
        for sum in &self.sums {
            check(sum.check(bands), format_args!("sum `{}`", sum.name), place)?;
        }
        for ratio in &self.ratios {
            for sum in [&ratio.numerator, &ratio.denominator] {
                check(sum.check(bands), format_args!("ratio `{}`", ratio.name), place)?;
            }
        }
        self.check_parameters().map_err(|problem| problem.at(place))?;
        for named in &self.materials {
            let checked = named.material.check_bands(bands);
            check(checked, format_args!("material `{}`", named.name), place)?;
        }
        for light in &self.lights {
            check(light.check(bands), format_args!("light `{}`", light.name), place)?;
        }
        for (i, surface) in self.surfaces.iter().enumerate() {
            check(surface.check(self), format_args!("surface {i}"), place)?;
        }
        for (i, shared) in self.shared.iter().enumerate() {
            check(shared.check(self), format_args!("shared copies {i}"), place)?;
        }
        check(self.check_shared_captors(), "shared copies", place)?;
        for copy in &self.copies {
            if copy.surfaces.is_empty() || copy.surfaces.end > self.surfaces.len() {
                let problem =
                    format!("a copy of surfaces {:?} of {}", copy.surfaces, self.surfaces.len());
                return Err(Error::input(place, problem).remedy("give indices of its surfaces"));
            }
        }
        if let Some(dz) = self.layers
            && !(dz.is_finite() && dz > 0.0)
        {
            let problem = Problem::new(format!("a height of {} m", number(dz)), "give one above 0");
            return Err(problem.of("layers").at(place));
        }
        if self.asked.sunlit {
            let infinite = self.lights.iter().filter_map(LightPart::infinite);
            let suns: usize = infinite.map(InfiniteLight::suns).sum();
            if suns != 1 {
                let problem = format!("{suns} suns, must be 1");
                let remedy = "a sunlit share belongs to one moment: give a sun, or daylight at a time \
                              with sun, or leave `sunlit` out, which a year has by the hour (docs/year.md)";
                return Err(Problem::new(problem, remedy).of("sunlit").at(place));
            }
        }
        for &object in &self.ground {
            check(check_index("object", object, self.objects.len()), "ground", place)?;
        }
        if let Some(lattice) = &self.lattice {
            check(lattice.check(), "periodic", place)?;
        }
        for captor in &self.captors {
            check(captor.check(self), format_args!("captor `{}`", captor.id), place)?;
        }
        Ok(())
    }

    /// Refuses captors that belong to copies and to other surfaces as well.
    fn check_shared_captors(&self) -> Checked {
        let of_copies = |shared: &SharedPart| {
            let captors = shared.captors * shared.transforms.len();
            shared.first_captor..shared.first_captor + captors
        };
        let mut ranges: Vec<_> = self.shared.iter().map(of_copies).collect();
        ranges.retain(|range| !range.is_empty());
        ranges.sort_by_key(|range| range.start);
        let of_two = ranges.windows(2).find(|two| two[1].start < two[0].end);
        let own = self.surfaces.iter().filter_map(|surface| surface.captor);
        let both = of_two.map(|two| two[1].start).or_else(|| {
            own.into_iter().find(|captor| {
                let after = ranges.partition_point(|range| range.start <= *captor);
                after > 0 && ranges[after - 1].contains(captor)
            })
        });
        match both {
            Some(captor) => {
                let id = &self.captors[captor].id;
                let problem = format!("captor `{id}` is of a shared copy and of another surface");
                Err(Problem::new(problem, "give each its own captor"))
            }
            None => Ok(()),
        }
    }

    fn check_names(&self) -> Checked {
        let bands = self.bands.iter().map(|band| &band.name);
        let sums = self.sums.iter().map(|sum| &sum.name);
        let ratios = self.ratios.iter().map(|ratio| &ratio.name);
        unique("band or sum", bands.chain(sums).chain(ratios))?;
        unique("material", self.materials.iter().map(|named| &named.name))?;
        unique("light", self.lights.iter().map(|light| &light.name))?;
        unique("captor", self.captors.iter().map(|captor| &captor.id))?;
        unique("group", self.groups.iter())
    }

    fn check_parameters(&self) -> Checked {
        let (most, bands) = (Parameters::MOST, self.bands.len());
        if self.parameters.len() > most {
            let problem = format!("{} parameters, must be at most {most}", self.parameters.len());
            return Err(Problem::new(problem, "ask for fewer"));
        }
        let mut taken = HashSet::new();
        for Parameter { name, factor, values, uncertainty } in &self.parameters {
            let places: Vec<[usize; 2]> = match *factor {
                Factor::Light(light) if light < self.lights.len() => vec![[light, 2 * Sent::WAYS]],
                Factor::Material { material, faces, ways } if material < self.materials.len() => {
                    let all = 0..2 * Sent::WAYS;
                    all.filter(|way| faces[way / Sent::WAYS] && ways[way % Sent::WAYS])
                        .map(|way| [material, way])
                        .collect()
                }
                Factor::Light(_) | Factor::Material { .. } => Vec::new(),
            };
            let fits = values.is_empty() || values.len() == bands;
            let possible = values.iter().all(|value| value.is_finite());
            if places.is_empty() || !fits || !possible {
                let problem = format!("parameter `{name}` is of nothing in the scene");
                return Err(Problem::new(problem, "give it a light, or ways of a material"));
            }
            if !places.into_iter().all(|place| taken.insert(place)) {
                let problem = format!("parameter `{name}` is of light that another has, too");
                return Err(Problem::new(problem, "leave one out"));
            }
            let is_deviation = |of: &f64| of.abs() <= 1e30;
            let fits = |of: &[f64]| of.len() == bands && of.iter().all(is_deviation);
            if uncertainty.as_ref().is_some_and(|of| !fits(&of.deviations)) {
                let problem = format!("uncertainty of parameter `{name}`");
                return Err(Problem::new(problem, "give it a number within 1e30 for each band"));
            }
        }
        unique("parameter", self.parameters.iter().map(|parameter| &parameter.name))
    }

    fn check_watts(&self) -> Checked {
        for (name, watts) in &self.watts {
            if !self.lights.iter().any(|light| light.name == *name) {
                return Err(Problem::new(format!("watts of `{name}`"), "name one of the lights"));
            }
            check_watts(*watts).map_err(|problem| problem.of("watts"))?;
        }
        Ok(())
    }

    fn check_numbers(&self) -> Checked {
        let of_lights = self.lights.iter().map(|light| light.triangles().len());
        let of_surfaces = self.surfaces.iter().map(|surface| surface.triangles.len());
        let of_captors = self.captors.iter().map(|captor| captor.triangles.len());
        let of_copies = self.shared.iter().map(SharedPart::triangles);
        let own = of_lights.chain(of_surfaces).chain(of_captors);
        let triangles = own.chain(of_copies).sum::<usize>();
        let placed =
            |shared: &SharedPart| shared.triangles() as u64 * shared.transforms.len() as u64;
        let placed: u64 = triangles as u64 + self.shared.iter().map(placed).sum::<u64>();
        if placed > MAX_PLACED {
            let problem = format!("more than {MAX_PLACED} triangles in all copies");
            return Err(Problem::new(problem, "use fewer copies or coarser meshes"));
        }
        for (what, number, most) in [
            ("triangles", triangles, MAX_TRIANGLES),
            ("captors", self.captors.len(), MAX_CAPTORS),
            ("lights", self.lights.len(), MAX_LIGHTS),
        ] {
            if number > most {
                return Err(Problem::new(format!("more than {most} {what}"), "use fewer"));
            }
        }
        Ok(())
    }
}

fn check(checked: Checked, part: impl Display, place: &str) -> Result<()> {
    checked.map_err(|problem| problem.of(part).at(place))
}

/// Refuses a name that occurs twice.
fn unique<'a>(what: &str, names: impl Iterator<Item = &'a String>) -> Checked {
    let mut seen = HashSet::new();
    for name in names {
        if !seen.insert(name) {
            let problem = format!("a second {what} named `{name}`");
            return Err(Problem::new(problem, "give it a name of its own"));
        }
    }
    Ok(())
}

/// Refuses an index that is not below `number`.
fn check_index(what: &str, index: usize, number: usize) -> Checked {
    if index < number {
        return Ok(());
    }
    let problem = format!("{what} {index} of {number}");
    Err(Problem::new(problem, "indices count from 0; name one that there is"))
}

impl Band {
    /// Refuses wavelengths that are negative or not finite, and a lower end that is not below the
    /// upper end.
    pub fn check(&self) -> Checked {
        if let (Some(from), Some(to)) = (self.from_nm, self.to_nm)
            && from >= to
        {
            let (from, to) = (number(from), number(to));
            let problem = format!("from_nm = {from} is not below to_nm = {to}");
            return Err(Problem::new(problem, "swap or correct them"));
        }
        for (key, nm) in [("from_nm", self.from_nm), ("to_nm", self.to_nm)] {
            let checked = nm.map_or(Ok(()), |nm| check_range(nm, 0.0, f64::MAX));
            checked.map_err(|problem| problem.of(key))?;
        }
        Ok(())
    }
}

/// Checks the electric power of a light, W.
pub fn check_watts(watts: f64) -> Checked {
    match watts > 0.0 {
        true => check_range(watts, 0.0, MAX_WATTS),
        false => Err(Problem::new(
            format!("{}, must be above 0", number(watts)),
            "leave it out where it is not known",
        )),
    }
}

/// The largest electric power of a light, W.
const MAX_WATTS: f64 = 1e9;

/// The largest weight of a band in a sum: no sum becomes infinite by it.
const MAX_WEIGHT: f64 = 1e30;

impl BandSum {
    fn check(&self, bands: usize) -> Checked {
        if self.bands.is_empty() {
            return Err(Problem::new("adds up no band", "name its bands"));
        }
        let mut seen = HashSet::new();
        for &band in &self.bands {
            check_index("band", band, bands)?;
            if !seen.insert(band) {
                let problem = format!("band {band} stands here twice");
                return Err(Problem::new(problem, "name each band once"));
            }
        }
        if ![0, self.bands.len()].contains(&self.weights.len()) {
            let problem = format!("{} weights of {} bands", self.weights.len(), self.bands.len());
            return Err(Problem::new(problem, "give one for each band, or none"));
        }
        for weight in &self.weights {
            check_range(*weight, 0.0, MAX_WEIGHT).map_err(|problem| problem.of("weight"))?;
        }
        Ok(())
    }
}

impl LightPart {
    fn check(&self, bands: usize) -> Checked {
        match &self.source {
            LightSource::Lamp(lamp) => check_power(&lamp.power, bands),
            LightSource::Infinite(light) => light.check(bands),
        }
    }
}

impl SurfacePart {
    fn check(&self, parts: &SceneParts) -> Checked {
        check_index("material", self.material, parts.materials.len())?;
        if let Some(object) = self.object {
            check_index("object", object, parts.objects.len())?;
        }
        let Some(captor) = self.captor else { return Ok(()) };
        check_index("captor", captor, parts.captors.len())?;
        let CaptorPart { id, kind, .. } = &parts.captors[captor];
        if *kind != CaptorKind::Surface {
            let problem = format!("captor `{id}` is virtual, with triangles of its own");
            return Err(Problem::new(problem, "name a surface captor"));
        }
        Ok(())
    }
}

impl SharedPart {
    fn check(&self, parts: &SceneParts) -> Checked {
        if let Some(object) = self.object {
            check_index("object", object, parts.objects.len())?;
        }
        for surface in &self.surfaces {
            check_index("material", surface.material, parts.materials.len())?;
            if let Some(captor) = surface.captor {
                check_index("captor", captor, self.captors)?;
            }
            let NamedMaterial { name, material } = &parts.materials[surface.material];
            if !may_be_shared(material) {
                let problem = format!("its material `{name}` is a mirror, a pane or a table");
                return Err(Problem::new(problem, "give each copy surfaces of its own"));
            }
        }
        if !self.transforms.iter().all(is_even) {
            let problem = "a transform that stretches or shears";
            return Err(Problem::new(problem, "give such copies surfaces of their own"));
        }
        let boxes: Vec<[DVec3; 2]> = self.boxes().map(|corners| ends(&corners)).collect();
        check_crowd(&boxes)?;
        let captors = self.captors.saturating_mul(self.transforms.len());
        let end = self.first_captor.saturating_add(captors);
        let kinds = parts
            .captors
            .get(self.first_captor..end)
            .map(|all| all.iter().all(|captor| captor.kind == CaptorKind::Surface));
        match (self.captors, kinds) {
            (0, _) | (_, Some(true)) => Ok(()),
            _ => {
                let problem =
                    format!("captors {} to {end} of {}", self.first_captor, parts.captors.len());
                Err(Problem::new(problem, "each captor of each copy is a surface captor"))
            }
        }
    }
}

/// Limit on the number of copies of an object whose boxes overlap at one point. A ray through it would
/// look into each of them.
pub const MAX_OVERLAPPING: usize = 10_000;
/// Number of boxes whose middles are looked at for that, and the number of comparisons that this takes
/// at most, where there are not very many boxes.
const LOOKED_AT: usize = 256;
const COMPARED: usize = 1 << 26;

/// Refuses copies of an object, by the lowest and highest corners of their boxes, m, so many of which stand at one place that no ray would
/// find its way through them in time.
pub fn check_crowd(boxes: &[[DVec3; 2]]) -> Checked {
    if boxes.len() <= MAX_OVERLAPPING {
        return Ok(());
    }
    let holds =
        |point: DVec3, [low, high]: &[DVec3; 2]| low.cmple(point).all() && point.cmple(*high).all();
    let looked_at = (COMPARED / boxes.len()).clamp(LOOKED_AT / 8, LOOKED_AT);
    for [low, high] in boxes.iter().step_by(boxes.len() / looked_at) {
        let middle = 0.5 * (*low + *high);
        let number = boxes.iter().filter(|other| holds(middle, other)).count();
        if number > MAX_OVERLAPPING {
            let at = middle.to_array().map(|metres| format!("{metres:.3}")).join(", ");
            let problem = format!(
                "{number} of its copies stand at one place, around ({at}) m, may be {MAX_OVERLAPPING}"
            );
            return Err(Problem::new(problem, "spread them, or leave out those that stand twice"));
        }
    }
    Ok(())
}

/// Returns the lowest and the highest coordinates of some points.
pub fn ends(points: &[DVec3]) -> [DVec3; 2] {
    let low = points.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let high = points.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    [low, high]
}

/// Returns whether copies may share triangles of a material: mirrors and panes that show images of
/// the sun are found one by one, and a table may depend on how each triangle lies.
pub fn may_be_shared(material: &Material) -> bool {
    !matches!(material, Material::Pane(_) | Material::Mirror(_) | Material::Table(_))
}

impl CaptorPart {
    fn check(&self, parts: &SceneParts) -> Checked {
        if self.kind == CaptorKind::Surface && !self.triangles.is_empty() {
            let problem = "a surface captor with triangles of its own";
            return Err(Problem::new(problem, "leave them to the surfaces that name it"));
        }
        if self.kind == CaptorKind::Surface && self.sensor != Sensor::default() {
            let problem = "a surface captor with a shape or response of its own";
            return Err(Problem::new(problem, "give it to a virtual captor"));
        }
        if let Some(Round { center, radius, normal }) = self.sensor.round {
            if !self.triangles.is_empty() {
                let problem = "a disc or sphere with triangles";
                return Err(Problem::new(problem, "give it either"));
            }
            let is_unit = normal.is_none_or(|normal| (normal.length() - 1.0).abs() < 1e-9);
            // not a number is not positive
            if !(radius > 0.0 && radius.is_finite() && center.is_finite() && is_unit) {
                let problem = "a disc or sphere that is none";
                let remedy = "its radius is above 0, and a normal has the length 1";
                return Err(Problem::new(problem, remedy));
            }
            if self.sensor.is_sphere != normal.is_none() {
                let problem = "a sphere with a normal, or a disc without one";
                return Err(Problem::new(problem, "say the same of its shape and of its area"));
            }
        }
        let mut seen = HashSet::new();
        for &group in &self.groups {
            check_index("group", group, parts.groups.len())?;
            if !seen.insert(group) {
                let problem = format!("group {group} stands here twice");
                return Err(Problem::new(problem, "name each group once"));
            }
        }
        Ok(())
    }
}

/// Refuses shapes that reach over so many periods that their images would take too much memory.
pub fn check_images(parts: &SceneParts, lattice: &Lattice, slack: f64) -> Checked {
    let mut all = 0u64;
    let surfaces = parts.surfaces.iter().flat_map(|part| {
        let name = part.object.map_or("a surface", |object| parts.objects[object].as_str());
        part.triangles.iter().map(move |corners| (name, corners.as_slice()))
    });
    let captors = parts.captors.iter().flat_map(|captor| {
        captor.triangles.iter().map(|corners| (captor.id.as_str(), corners.as_slice()))
    });
    let rounds = parts.captors.iter().filter_map(|captor| Some((captor, captor.sensor.round?)));
    for (captor, round) in rounds {
        all = all.saturating_add(lattice.count_images(&round.corners(), slack));
        check_count(all, &captor.id)?;
    }
    for shared in &parts.shared {
        let images = shared.boxes().map(|corners| lattice.count_images(&corners, slack));
        all = images.fold(all, u64::saturating_add);
    }
    let lights = parts.lights.iter().flat_map(|light| {
        let triangles = light.triangles().iter();
        triangles.map(|corners| (light.name.as_str(), corners.as_slice()))
    });
    let tubes = parts.lights.iter().filter_map(|light| {
        let line = light.lamp()?.outline().line()?;
        Some((light.name.as_str(), line))
    });
    let openings = parts.lights.iter().flat_map(|light| {
        let polygons = light.infinite().map_or(&[][..], |infinite| &infinite.through);
        polygons.iter().map(|polygon| (light.name.as_str(), polygon.as_slice()))
    });
    for (name, corners) in surfaces.chain(captors).chain(lights).chain(tubes).chain(openings) {
        all = all.saturating_add(lattice.count_images(corners, slack));
        check_count(all, name)?;
    }
    Ok(())
}

/// Refuses too many images of what has been counted up to `name`.
fn check_count(images: u64, name: &str) -> Checked {
    if images <= MAX_TRIANGLES as u64 {
        return Ok(());
    }
    let problem = format!(
        "what reaches over the cell's borders has more than {MAX_TRIANGLES} images in it, at `{name}`"
    );
    Err(Problem::new(problem, "make the ground as large as the cell, or the cell larger"))
}
