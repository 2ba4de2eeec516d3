//! The parameters of which results say how much they depend on them.

use super::{
    loader::{Loader, unknown},
    materials::LEAF_IOR,
    spec::*,
};
use crate::json;
use phylux_core::{
    error::Result,
    scene::{
        material::{Material, Scatterer, normal_fresnel},
        parameter::{Factor, Parameter, Parameters},
    },
};

/// The ways of a material, in the order of [`Sent`](phylux_core::scene::parameter::Sent): scattered
/// back, in the mirror direction, scattered to the other side.
const REFLECTED: [bool; 3] = [true, true, false];
/// The same of a leaf, whose cuticle mirrors whatever is below it.
const BELOW_CUTICLE: [bool; 3] = [true, false, false];
const TRANSMITTED: [bool; 3] = [false, false, true];
const BOTH: [bool; 2] = [true, true];
const FRONT: [bool; 2] = [true, false];
const BACK: [bool; 2] = [false, true];

/// What of a material is one parameter: the end of its name, faces and ways, and where a number of the
/// file stands for it, that number per band.
type Kind = (String, [bool; 2], [bool; 3], Option<Vec<f64>>);

impl Loader<'_> {
    /// Makes the parameters that the scene asks for, once its materials and lights are known.
    pub(super) fn load_parameters(&mut self, file: &SceneSpec) -> Result<()> {
        let names = match &file.sensitivity {
            SensitivitySpec::Off => return Ok(()),
            SensitivitySpec::All => None,
            SensitivitySpec::Of(names) => Some(names),
        };
        if self.sources.by_hour.is_some() {
            // a year sums its hours of other sums
            let problem = "a year does not say how its results depend on these: it is left out";
            self.warn(self.place("/sensitivity"), problem);
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
                    all.push((name, Parameter { name: place.clone() + &end, factor, values }));
                }
            }
        }
        for (index, light) in self.parts.lights.iter().enumerate() {
            let spec = |(i, spec): &(usize, &LightSpec)| match spec.keys().name {
                Some(name) => name == light.name,
                None => light.name == format!("light{i}"),
            };
            let found = file.lights.iter().enumerate().find(spec);
            let (place, values) = match found.map(|(i, spec)| (i, spec.keys().power)) {
                Some((i, Some(PowerSpec::Given(power)))) => {
                    (format!("/lights/{i}/power"), self.given(power).unwrap_or_default())
                }
                Some((i, _)) => (format!("/lights/{i}"), Vec::new()),
                None => (light.name.clone(), Vec::new()),
            };
            let factor = Factor::Light(index);
            all.push((&light.name, Parameter { name: place, factor, values }));
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
                if !all.iter().any(|(of, _)| *of == name) {
                    let place = self.place(format!("/sensitivity/{i}"));
                    self.notes.push(format!(
                        "{place}: `{name}` sends on no light by a way that counts, so nothing depends \
                         on it"
                    ));
                }
            }
            all.retain(|(of, _)| names.contains(of));
        }
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

    /// Returns numbers of the scene file per band; `None` where they come from a spectrum.
    fn given(&self, values: &PerBand) -> Option<Vec<f64>> {
        match values {
            PerBand::All(value) => Some(vec![*value; self.bands]),
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
            MaterialSpec::Phong(PhongSpec { reflectance, specular, transmittance, .. }) => {
                let shines =
                    specular.as_ref().is_some_and(|s| self.given(s) != Some(vec![0.0; self.bands]));
                let reflected = match (reflectance, shines) {
                    (Some(reflectance), false) => {
                        Some(kind("reflectance", BOTH, REFLECTED, reflectance))
                    }
                    (None, false) => None,
                    (_, true) => Some(("#reflected".into(), BOTH, REFLECTED, None)),
                };
                let transmitted =
                    transmittance.as_ref().map(|t| kind("transmittance", BOTH, TRANSMITTED, t));
                reflected.into_iter().chain(transmitted).collect()
            }
            MaterialSpec::Leaf(leaf) if leaf.thin => self.kinds_of_leaf(leaf),
            MaterialSpec::Table(_) => of_nothing_known(material),
            // what panes and solids let through is not counted
            MaterialSpec::Transparent(_) | MaterialSpec::Leaf(_) => Vec::new(),
        }
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
            [("reflectance", BELOW_CUTICLE), ("transmittance", TRANSMITTED)].into_iter().enumerate()
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

/// Returns the parameters of a material for which no number of the scene file stands.
fn of_nothing_known(material: &Material) -> Vec<Kind> {
    let ways = match material {
        Material::Leaf(_) => BELOW_CUTICLE,
        _ => REFLECTED,
    };
    let reflects = material.is_diffuse() || material.has_mirror();
    let lets_through = matches!(material, Material::Pane(_) | Material::Dielectric(_));
    let reflected = (reflects && !lets_through).then(|| ("#reflected".into(), BOTH, ways, None));
    let transmitted =
        material.transmits_diffusely().then(|| ("#transmitted".into(), BOTH, TRANSMITTED, None));
    reflected.into_iter().chain(transmitted).collect()
}
