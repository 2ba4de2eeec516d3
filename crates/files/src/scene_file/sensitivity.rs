//! The parameters of which results say how much they depend on them.

use std::collections::BTreeMap;

use glam::Vec3;

use super::{files::unknown, loader::Loader, materials::LEAF_IOR, spec::*};
use crate::json;
use phylux_core::{
    error::Result,
    scene::{
        material::{Material, Scatterer, normal_fresnel},
        parameter::{Factor, Parameter, Parameters, Sent, Uncertainty},
    },
};

/// Whether each way of a material counts, in the order of [`Sent`]: scattered back, in the mirror
/// direction, scattered to the other side, straight on, through the surface of a solid.
type Ways = [bool; Sent::WAYS];
const REFLECTED: Ways = [true, true, false, false, false];
/// Below the cuticle of a leaf, which mirrors whatever is below it, or beside a mirror.
const SCATTERED: Ways = [true, false, false, false, false];
const MIRRORED: Ways = [false, true, false, false, false];
const TRANSMITTED: Ways = [false, false, true, false, false];
const STRAIGHT: Ways = [false, false, false, true, false];
/// Through a pane, or mirrored from between its faces.
const IN_PANE: Ways = [false, true, false, true, false];
const REFRACTED: Ways = [false, false, false, false, true];
const BOTH: [bool; 2] = [true, true];
const FRONT: [bool; 2] = [true, false];
const BACK: [bool; 2] = [false, true];

/// What of a material is one parameter: the end of its name, faces and ways, and where a number of the
/// file stands for it, that number per band.
type Kind = (String, [bool; 2], Ways, Option<Vec<f64>>);

impl Loader<'_> {
    /// Makes the parameters that the scene asks for, once its materials and lights are known.
    pub(super) fn load_parameters(&mut self, file: &SceneSpec) -> Result<()> {
        let names = match &file.sensitivity {
            SensitivitySpec::Off if file.uncertain.is_empty() => return Ok(()),
            SensitivitySpec::Off => Some(&[][..]),
            SensitivitySpec::All => None,
            SensitivitySpec::Of(names) => Some(&names[..]),
        };
        if self.files.sources.by_hour.is_some() {
            // a year sums its hours of other sums
            let key = if file.uncertain.is_empty() { "/sensitivity" } else { "/uncertain" };
            let problem = "a year does not say how its results depend on these: it is left out";
            self.told.warn(self.place(key), problem);
            return Ok(());
        }
        let mut all = Vec::new();
        for (index, named) in self.parts.materials.iter().enumerate() {
            let (name, material) = (&named.name, &named.material);
            let (place, kinds) = match file.materials.get(name) {
                Some(spec) => {
                    (format!("/materials/{}", json::escaped(name)), self.kinds(spec, material))
                }
                None => (name.clone(), of_nothing_known(material)),
            };
            for (end, faces, ways, values) in kinds {
                let factor = Factor::Material { material: index, faces, ways };
                let values = values.unwrap_or_default();
                // what sends on nothing is no factor on light
                if values.is_empty() || values.iter().any(|value| *value != 0.0) {
                    all.push((name.clone(), parameter(place.clone() + &end, factor, values)));
                }
            }
        }
        for (index, light) in self.parts.lights.iter().enumerate() {
            let (place, values) = self.place_of_light(file, &light.name);
            let factor = Factor::Light(index);
            all.push((light.name.clone(), parameter(place, factor, values)));
        }
        if let Some(names) = names {
            for (i, name) in names.iter().enumerate() {
                let known = || {
                    let materials = self.parts.materials.iter().map(|named| named.name.as_str());
                    materials.chain(self.parts.lights.iter().map(|light| light.name.as_str()))
                };
                if !known().any(|known| known == name) {
                    let problem = format!("no material or light `{name}` in the scene");
                    let error = self.error(format!("/sensitivity/{i}"), problem);
                    return Err(unknown(error, name, known().collect::<Vec<_>>().into_iter()));
                }
                if !all.iter().any(|(of, _)| of == name) {
                    let place = self.place(format!("/sensitivity/{i}"));
                    let remark = format!(
                        "`{name}` sends on no light by a way that counts, so nothing depends on it"
                    );
                    self.told.note(place, remark);
                }
            }
        }
        self.load_uncertainties(file, &mut all)?;
        all.retain(|(of, parameter)| {
            names.is_none_or(|names| names.contains(of)) || parameter.uncertainty.is_some()
        });
        let all: Vec<Parameter> = all.into_iter().map(|(_, parameter)| parameter).collect();
        if all.len() > Parameters::MOST {
            let problem =
                format!("{} materials and lights, must be at most {}", all.len(), Parameters::MOST);
            return Err(self
                .error("/sensitivity", problem)
                .remedy("give a list of names in place of `true`"));
        }
        self.parts.parameters = all;
        Ok(())
    }

    /// Returns the pointer to what stands for a light in the scene file, and its power per band, where
    /// that is given in numbers. Of an area light that stands several times each copy is told apart.
    fn place_of_light(&self, file: &SceneSpec, name: &str) -> (String, Vec<f64>) {
        let of = |name: &str| {
            let found = file.lights.iter().enumerate().find(|(i, spec)| spec.name(*i) == name);
            found.map(|(i, spec)| match spec.keys().power {
                Some(PowerSpec::Given(power)) => {
                    (format!("/lights/{i}/power"), self.given(power).unwrap_or_default())
                }
                _ => (format!("/lights/{i}"), Vec::new()),
            })
        };
        let copy = || {
            let (name, copy) = name.rsplit_once('#')?;
            let (place, values) = of(name)?;
            Some((format!("{place}#{copy}"), values))
        };
        of(name).or_else(copy).unwrap_or_else(|| (name.into(), Vec::new()))
    }

    /// Gives the parameters, each beside the name of its material or light, the uncertainties that the
    /// scene states.
    fn load_uncertainties(
        &mut self,
        file: &SceneSpec,
        all: &mut [(String, Parameter)],
    ) -> Result<()> {
        // for each uncertain parameter, with which it goes, and its pointer
        let mut sets: BTreeMap<usize, (usize, &str)> = BTreeMap::new();
        for (pointer, spec) in &file.uncertain {
            let at = format!("/uncertain/{}", json::escaped(pointer));
            let index = self.uncertain(all, pointer, at.clone())?;
            let (deviation, with) = match spec {
                UncertainSpec::Alone(deviation) => (deviation, index),
                UncertainSpec::Together(TogetherSpec { deviation, with }) => {
                    let at = format!("{at}/with");
                    if !file.uncertain.contains_key(with) {
                        let problem = format!("`{with}` is not among the uncertain inputs");
                        let known = file.uncertain.keys().map(String::as_str);
                        return Err(unknown(self.error(at, problem), with, known));
                    }
                    (deviation, self.uncertain(all, with, at)?)
                }
            };
            if let Some((_, other)) = sets.insert(index, (with, pointer)) {
                let problem = format!("is the same input as `{other}`");
                return Err(self.error(at, problem).remedy("leave one out"));
            }
            let deviations = match deviation {
                DeviationSpec::All(all) => vec![*all; self.bands()],
                DeviationSpec::Each(each) => each.clone(),
            };
            if deviations.len() != self.bands() {
                let problem = format!("{} numbers for {} bands", deviations.len(), self.bands());
                return Err(self.error(at, problem).remedy("give one number for each band"));
            }
            let parameter = &mut all[index].1;
            let values = &parameter.values;
            let is_dark = |b: usize| values.get(b) == Some(&0.0) && deviations[b] != 0.0;
            if let Some(dark) = (0..self.bands()).find(|b| is_dark(*b)) {
                let problem = format!(
                    "the input is 0 in band `{}`, where there is no light to count: what its \
                     uncertainty makes of the results there is not known",
                    self.parts.bands[dark].name
                );
                self.told.warn(self.place(&at), problem);
            }
            let gains = parameter.gains(|m| &self.parts.materials[m].material, self.bands());
            let share = |(b, deviation): (usize, f64)| match values.get(b) {
                None => gains[b] * deviation,
                Some(0.0) => 0.0,
                Some(value) => deviation / value,
            };
            let deviations = deviations.into_iter().enumerate().map(share).collect();
            parameter.uncertainty = Some(Uncertainty { deviations, set: index });
        }
        // an input goes with another that may go with a third
        for &index in sets.keys() {
            let mut set = index;
            for _ in 0..sets.len() {
                set = sets[&set].0;
            }
            if sets[&set].0 != set {
                let pointer = json::escaped(sets[&index].1);
                let problem = "inputs go with each other in a circle";
                return Err(self
                    .error(format!("/uncertain/{pointer}/with"), problem)
                    .remedy("let one of them stand by itself"));
            }
            all[index].1.uncertainty.iter_mut().for_each(|of| of.set = set);
        }
        Ok(())
    }

    /// Returns the index of the parameter that a pointer into the scene file means; lights may be given
    /// by their names.
    fn uncertain(&self, all: &[(String, Parameter)], pointer: &str, at: String) -> Result<usize> {
        let by_name = |(name, parameter): &(String, Parameter)| {
            let of_light = parameter.name.strip_prefix("/lights/").is_some_and(|place| {
                let key = place.find('/').map_or("", |at| &place[at..]);
                // the name of a copy tells which it is
                let keys = [key, key.split('#').next().unwrap_or_default()];
                let by_name = |key| format!("/lights/{}{key}", json::escaped(name));
                name == pointer || keys.iter().any(|key| by_name(key) == pointer)
            });
            parameter.name == pointer || of_light
        };
        if let Some(index) = all.iter().position(by_name) {
            return Ok(index);
        }
        let problem = format!(
            "`{pointer}` is no input of which a run can tell what depends on it (lengths, \
             angles, indices and gloss are none, nor is what is 0)"
        );
        let known = all.iter().map(|(_, parameter)| parameter.name.as_str());
        Err(unknown(self.error(at, problem), pointer, known))
    }

    /// Returns numbers of the scene file per band; `None` where they come from a spectrum.
    fn given(&self, values: &PerBand) -> Option<Vec<f64>> {
        match values {
            PerBand::All(value) => Some(vec![*value; self.bands()]),
            PerBand::Each(values) => Some(values.clone()),
            PerBand::Spectrum(_) => None,
        }
    }

    fn kinds(&self, spec: &MaterialSpec, material: &Material) -> Vec<Kind> {
        let kind = |key: &str, faces, ways, values: &PerBand| -> Kind {
            (format!("/{key}"), faces, ways, self.given(values))
        };
        match spec {
            MaterialSpec::Lambert(LambertSpec { reflectance })
            | MaterialSpec::Mirror(MirrorSpec { reflectance }) => {
                vec![kind("reflectance", BOTH, REFLECTED, reflectance)]
            }
            MaterialSpec::Phong(PhongSpec { reflectance, specular, transmittance, exponent }) => {
                let diffuse =
                    |ways| reflectance.as_ref().map(|r| kind("reflectance", BOTH, ways, r));
                let shines = |s: &&PerBand| self.given(s) != Some(vec![0.0; self.bands()]);
                let reflected = match (specular.as_ref().filter(shines), exponent) {
                    (None, _) => [diffuse(REFLECTED), None],
                    (Some(specular), None) => {
                        [diffuse(SCATTERED), Some(kind("specular", BOTH, MIRRORED, specular))]
                    }
                    // a glossy lobe sends light where the diffuse one does
                    (Some(_), Some(_)) => {
                        [Some(("#reflected".into(), BOTH, REFLECTED, None)), None]
                    }
                };
                let transmitted =
                    transmittance.as_ref().map(|t| kind("transmittance", BOTH, TRANSMITTED, t));
                reflected.into_iter().flatten().chain(transmitted).collect()
            }
            MaterialSpec::Leaf(leaf) if leaf.thin => self.kinds_of_leaf(leaf),
            MaterialSpec::Table(_) => of_nothing_known(material),
            MaterialSpec::Transparent(TransparentSpec { tint, thin, .. }) => {
                vec![self.kind_of_tint(tint.as_ref(), *thin)]
            }
            MaterialSpec::Leaf(leaf) => vec![self.kind_of_tint(leaf.tint.as_ref(), false)],
        }
    }

    /// Returns the parameter of a pane or a solid. A tint that is not given is 1.
    fn kind_of_tint(&self, tint: Option<&PerBand>, is_pane: bool) -> Kind {
        let values = tint.map_or(Some(vec![1.0; self.bands()]), |tint| self.given(tint));
        ("/tint".into(), BOTH, if is_pane { IN_PANE } else { REFRACTED }, values)
    }

    fn kinds_of_leaf(&self, leaf: &LeafSpec) -> Vec<Kind> {
        // below the cuticle a change of the reflectance is one of what exceeds the cuticle's own
        let cuticle = normal_fresnel(leaf.ior.unwrap_or(LEAF_IOR));
        let below = |values: &PerBand| -> Option<Vec<f64>> {
            Some(self.given(values)?.iter().map(|r| (r - cuticle).max(0.0)).collect())
        };
        let mut kinds: Vec<Kind> = Vec::new();
        let back = leaf.back.as_ref();
        let of_back = [
            back.and_then(|b| b.reflectance.as_ref()),
            back.and_then(|b| b.transmittance.as_ref()),
        ];
        for (i, (key, ways)) in
            [("reflectance", SCATTERED), ("transmittance", TRANSMITTED)].into_iter().enumerate()
        {
            let values = |of: &PerBand| if i == 0 { below(of) } else { self.given(of) };
            let of_front = [&leaf.reflectance, &leaf.transmittance][i].as_ref();
            let faces = if of_back[i].is_some() { FRONT } else { BOTH };
            match of_front {
                Some(of) => kinds.push((format!("/{key}"), faces, ways, values(of))),
                // PROSPECT has computed it
                None if leaf.prospect.is_some() => {
                    let end = ["#reflected", "#transmitted"][i];
                    kinds.push((end.into(), faces, ways, None));
                }
                None => {}
            }
            if let Some(of) = of_back[i] {
                kinds.push((format!("/back/{key}"), BACK, ways, values(of)));
            }
        }
        kinds
    }
}

/// Makes a parameter whose uncertainty is not known.
fn parameter(name: String, factor: Factor, values: Vec<f64>) -> Parameter {
    Parameter { name, factor, values, uncertainty: None }
}

/// Returns the parameters of a material for which no number of the scene file stands.
fn of_nothing_known(material: &Material) -> Vec<Kind> {
    let ways = match material {
        Material::Leaf(_) => SCATTERED,
        _ => REFLECTED,
    };
    let reflects = material.is_diffuse() || material.has_mirror();
    let of_tint = match material {
        Material::Pane(_) => Some(IN_PANE),
        Material::Dielectric(_) => Some(REFRACTED),
        _ => None,
    };
    if let Some(ways) = of_tint {
        return vec![("#tint".into(), BOTH, ways, None)];
    }
    let straight = material.straight::<[f32; 1]>(Vec3::NEG_Z, Vec3::Z).is_some();
    let kind = |end: &str, ways| -> Kind { (end.into(), BOTH, ways, None) };
    let all = [
        reflects.then(|| kind("#reflected", ways)),
        material.transmits_diffusely().then(|| kind("#transmitted", TRANSMITTED)),
        straight.then(|| kind("#straight", STRAIGHT)),
    ];
    all.into_iter().flatten().collect()
}
