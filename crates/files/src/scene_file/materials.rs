//! Loads materials: those of the scene file, and those of the entries of MTL files.

use std::collections::BTreeMap;

use super::{files::unknown, loader::Loader, numbers::single, spec::*};
use crate::{
    json,
    obj::{MtlEntry, MtlLibrary},
};
use phylux_core::{
    error::{Checked, Error, Problem, Result, number},
    math::curve::Curve,
    scene::material::{
        Dielectric, Lambert, Leaf, LeafFace, MAX_EXPONENT, Material, Mirror, Pane, Phong,
        PhongFractions, Prospect, normal_fresnel,
    },
};

/// Index of refraction of a leaf's cuticle (Jacquemoud and Baret 1990; Bousquet et al. 2005).
pub(super) const LEAF_IOR: f64 = 1.425;

impl Loader<'_> {
    pub(super) fn load_materials(&mut self, files: &BTreeMap<String, MaterialSpec>) -> Result<()> {
        for (name, file) in files {
            let pointer = format!("/materials/{}", json::escaped(name));
            let material = self.material(&pointer, file);
            let reciprocal = match file {
                MaterialSpec::Leaf(leaf) => {
                    let back = leaf.back.as_ref().and_then(|back| back.transmittance.as_ref());
                    back.is_none_or(|back| {
                        self.checked(Some(back)) == self.checked(leaf.transmittance.as_ref())
                    })
                }
                _ => true,
            };
            let index = self.materials.add(name.clone(), material, reciprocal);
            self.materials.by_name.insert(name.clone(), index);
        }
        Ok(())
    }

    /// Returns the index in the scene of the material that the scene file calls `name`.
    pub(super) fn named_material(&mut self, pointer: &str, name: &str) -> Result<usize> {
        let broken = self.materials.unused_errors().next();
        match (self.materials.by_name.get(name), broken) {
            (Some(&entry), _) => self.materials.use_entry(entry),
            // the material that cannot be read may be the one that was meant
            (None, Some(error)) => Err(error),
            (None, None) => Err(unknown(
                self.error(pointer, format!("no material `{name}` in the scene")),
                name,
                self.materials.by_name.keys().map(String::as_str),
            )),
        }
    }

    /// Adds a perfectly black material, which no file has, and returns its index in the scene.
    pub(super) fn black(&mut self, name: String) -> usize {
        self.materials.add_used(name, Lambert::black(self.bands()).into())
    }

    /// Returns the index in the scene of the material that an OBJ file calls `name` at `place`: the
    /// material of the scene file with this name, or else the entry of the MTL files. With an MTL
    /// entry that emits light comes its radiance, per band.
    pub(super) fn obj_material(
        &mut self,
        place: &str,
        name: &str,
        mtl: &MtlLibrary,
    ) -> Result<(usize, Option<Vec<f64>>)> {
        if let Some(&entry) = self.materials.by_name.get(name) {
            return Ok((self.materials.use_entry(entry)?, None));
        }
        let Some(entry) = mtl.entry(name)? else {
            let missing = mtl.missing().iter().map(|mtl| format!("{}: {}", mtl.file, mtl.why));
            let missing = missing.collect::<Vec<_>>().join("; ");
            let because = if missing.is_empty() { missing } else { format!(" ({missing})") };
            let error = Error::input(place, format!("no material `{name}`{because}"));
            let scene = self.materials.by_name.keys().map(String::as_str);
            let known: Vec<&str> = scene.chain(mtl.names()).collect();
            return Err(unknown(error, name, known.iter().copied()));
        };
        let radiance = self.emission(entry)?;
        if let Some(&index) = self.materials.by_mtl_place.get(&entry.place) {
            return Ok((self.materials.use_entry(index)?, radiance));
        }
        let material = self.mtl_material(entry)?;
        let taken = self.materials.names.contains(name);
        let shown = if taken { format!("{name} ({})", entry.place) } else { name.into() };
        let index = self.materials.add(shown, Ok(material), true);
        self.materials.by_mtl_place.insert(entry.place.clone(), index);
        Ok((self.materials.use_entry(index)?, radiance))
    }

    fn emission(&self, entry: &MtlEntry) -> Result<Option<Vec<f64>>> {
        match entry.ke {
            Some(ke) if ke.iter().any(|&v| v > 0.0) => {
                self.rgb_bands(entry, "Ke", ke, f64::MAX).map(Some)
            }
            _ => Ok(None),
        }
    }

    /// Returns the values of a colour (r, g, b) per band: in this order for three bands, and their
    /// mean for one band. Each must be from 0 to `high`.
    fn rgb_bands(&self, entry: &MtlEntry, key: &str, rgb: [f64; 3], high: f64) -> Result<Vec<f64>> {
        if let Some(bad) = rgb.iter().find(|v| !(0.0..=high).contains(*v)) {
            let range = if high == 1.0 { "from 0 to 1" } else { "at least 0" };
            let problem = format!("{key} = {bad} of material {}, must be {range}", entry.name);
            return Err(Error::input(&entry.place, problem)
                .remedy("mend it, or give the scene a material of this name"));
        }
        match self.bands() {
            1 => Ok(vec![rgb.iter().sum::<f64>() / 3.0]),
            3 => Ok(rgb.to_vec()),
            n => Err(Error::input(
                &entry.place,
                format!("material {} has r, g, b, the scene has {n} bands", entry.name),
            )
            .remedy(format!("give the scene a material `{}` in /materials", entry.name))),
        }
    }

    fn mtl_material(&mut self, entry: &MtlEntry) -> Result<Material> {
        let place = format!("{}: material {}", entry.place, entry.name);
        if entry.map_kd.is_some() {
            self.told.warn(&place, "its texture map_Kd is not read: Kd is its colour everywhere");
        }
        let (key, colour) =
            if entry.illum == Some(5) { ("Ks", entry.ks) } else { ("Kd", entry.kd) };
        if colour.is_none() && entry.illum != Some(7) {
            self.told.warn(&place, format!("no {key}: it reflects nothing"));
        }
        let (material, warning) = self.of_illum(entry, &place)?;
        if let Some(warning) = warning {
            self.told.warn(place, warning);
        }
        Ok(material)
    }

    /// Returns the material that the `illum` of an MTL entry stands for, and a warning where the
    /// entry may mean another one.
    fn of_illum(&self, entry: &MtlEntry, place: &str) -> Result<(Material, Option<String>)> {
        let fraction = |key: &str, rgb: Option<[f64; 3]>| {
            self.rgb_bands(entry, key, rgb.unwrap_or_default(), 1.0)
        };
        let at_place = |problem: Problem| problem.at(place);
        let lambert = || -> Result<Material> {
            let kd = single(&fraction("Kd", entry.kd)?);
            Lambert::new(&kd).map(Material::from).map_err(at_place)
        };
        let specular = entry.ks.is_some_and(|ks| ks.iter().any(|&v| v > 0.0));
        Ok(match entry.illum {
            Some(1) => (lambert()?, None),
            Some(2) if specular => {
                let phong = PhongSpec {
                    reflectance: Some(PerBand::Each(fraction("Kd", entry.kd)?)),
                    specular: Some(PerBand::Each(fraction("Ks", entry.ks)?)),
                    transmittance: None,
                    exponent: Some(entry.ns.unwrap_or(0.0)),
                };
                let warning = "illum 2 with Ks: read as phong (many modelling programs write this \
                    by default); give the scene a material of this name if that is not meant";
                let material = self.phong(&phong).map_err(|why| of_mtl(why, place))?;
                (material, Some(warning.into()))
            }
            Some(2) => (lambert()?, None),
            Some(3) => {
                let warning = "illum 3 with Ks: read as lambert with Kd alone, without what Ks \
                    mirrors; give the scene a material of this name if that matters";
                (lambert()?, specular.then(|| warning.into()))
            }
            Some(5) => {
                let mirror = Mirror::new(&single(&fraction("Ks", entry.ks)?));
                (mirror.map(Material::from).map_err(at_place)?, None)
            }
            Some(6) => {
                let given = entry.tf.filter(|tf| *tf != [1.0; 3]);
                let leaf = LeafSpec {
                    ior: Some(LEAF_IOR),
                    reflectance: Some(PerBand::Each(fraction("Kd", entry.kd)?)),
                    transmittance: Some(PerBand::Each(fraction("Tf", given)?)),
                    prospect: None,
                    back: None,
                    thin: true,
                    tint: None,
                };
                self.thin_leaf(&leaf).map_err(|why| of_mtl(why, place))?
            }
            Some(7) => {
                let tint = single(&fraction("Kd", entry.kd.or(Some([1.0; 3])))?);
                let glass = Dielectric::new(entry.ni.unwrap_or(1.0), &tint);
                (glass.map(Material::from).map_err(at_place)?, None)
            }
            other => {
                let illum = other.map_or("no illum".into(), |illum| format!("illum {illum}"));
                (lambert()?, Some(format!("{illum}: read as lambert with Kd")))
            }
        })
    }

    fn material(&mut self, pointer: &str, file: &MaterialSpec) -> Result<Material> {
        let place = self.place(pointer);
        let made: Checked<Material> = match file {
            MaterialSpec::Lambert(m) => {
                let reflectance =
                    self.per_band(&format!("{pointer}/reflectance"), &m.reflectance, 1.0)?;
                Lambert::new(&single(&reflectance)).map(Material::from)
            }
            MaterialSpec::Mirror(m) => {
                let reflectance =
                    self.per_band(&format!("{pointer}/reflectance"), &m.reflectance, 1.0)?;
                Mirror::new(&single(&reflectance)).map(Material::from)
            }
            MaterialSpec::Transparent(m) => {
                let tint = single(&self.fraction(pointer, "tint", m.tint.as_ref(), 1.0)?);
                match m.thin {
                    true => Pane::new(m.ior, &tint).map(Material::from),
                    false => Dielectric::new(m.ior, &tint).map(Material::from),
                }
            }
            MaterialSpec::Phong(m) => {
                for (key, values) in [
                    ("reflectance", &m.reflectance),
                    ("specular", &m.specular),
                    ("transmittance", &m.transmittance),
                ] {
                    self.fraction(pointer, key, values.as_ref(), 0.0)?;
                }
                if let Some(exponent) = m.exponent {
                    self.in_range(&format!("{pointer}/exponent"), exponent, 0.0, MAX_EXPONENT)?;
                }
                self.phong(m)
            }
            MaterialSpec::Table(m) => return self.table_material(pointer, m),
            MaterialSpec::Leaf(m) if m.thin => {
                let of_contents = self.leaf_of_contents(pointer, m)?;
                let m = of_contents.as_ref().unwrap_or(m);
                self.check_leaf_ranges(pointer, m)?;
                let (material, warning) = self.thin_leaf(m).map_err(|why| why.at(&place))?;
                if let Some(warning) = warning {
                    self.told.warn(&place, warning);
                }
                Ok(material)
            }
            MaterialSpec::Leaf(m) => {
                let of_sheets = [
                    ("reflectance", m.reflectance.is_some()),
                    ("transmittance", m.transmittance.is_some()),
                    ("prospect", m.prospect.is_some()),
                    ("back", m.back.is_some()),
                ];
                let problem = "a solid leaf (thin: false) is a dielectric interface";
                self.refuse_given(pointer, &of_sheets, problem, "leave it out, or drop `thin`")?;
                let tint = self.fraction(pointer, "tint", m.tint.as_ref(), 1.0)?;
                let ior = m.ior.unwrap_or(LEAF_IOR);
                Dielectric::new(ior, &single(&tint)).map(Material::from)
            }
        };
        made.map_err(|why| why.at(place))
    }

    /// Returns the fractions of a key per band, or `default` where the key is left out.
    fn fraction(
        &self,
        pointer: &str,
        key: &str,
        values: Option<&PerBand>,
        default: f64,
    ) -> Result<Vec<f64>> {
        let values = values.unwrap_or(&PerBand::All(default)).clone();
        self.per_band(&format!("{pointer}/{key}"), &values, 1.0)
    }

    /// Returns the leaf with the reflectance and the transmittance that PROSPECT computes of its
    /// contents; `None` if it has none.
    fn leaf_of_contents(&self, pointer: &str, leaf: &LeafSpec) -> Result<Option<LeafSpec>> {
        let Some(contents) = &leaf.prospect else { return Ok(None) };
        for (key, given) in [
            ("reflectance", leaf.reflectance.is_some()),
            ("transmittance", leaf.transmittance.is_some()),
        ] {
            if given {
                let problem = format!("a leaf has `prospect` or `{key}`, not both");
                return Err(self
                    .error(format!("{pointer}/{key}"), problem)
                    .remedy("leave one out"));
            }
        }
        let pointer = format!("{pointer}/prospect");
        // beyond what leaves have, by a factor: a slip of the unit
        for (key, value, most, unit) in [
            ("chlorophyll", contents.chlorophyll, 200.0, "ug/cm2"),
            ("carotenoids", contents.carotenoids, 60.0, "ug/cm2"),
            ("anthocyanins", contents.anthocyanins, 100.0, "ug/cm2"),
            ("water", contents.water, 0.2, "cm"),
            ("dry_matter", contents.dry_matter, 0.1, "g/cm2"),
        ] {
            if value > most {
                let problem = format!(
                    "{} {unit}, and leaves have at most some {most}: is it in another unit?",
                    number(value)
                );
                self.tell_at(self.place(format!("{pointer}/{key}")), problem);
            }
        }
        let spectra = Prospect {
            n: contents.n,
            chlorophyll: contents.chlorophyll,
            carotenoids: contents.carotenoids,
            anthocyanins: contents.anthocyanins,
            brown: contents.brown,
            water: contents.water,
            dry_matter: contents.dry_matter,
        }
        .spectra()
        .map_err(|error| {
            let place = self.place(format!("{pointer}/{}", error.place()));
            error.at(place)
        })?;
        let mean = |key: &str, curve: &Curve| {
            let means = self.mean(&format!("{pointer} {key}"), "PROSPECT", curve, 1.0, 1.0)?;
            Ok(Some(PerBand::Each(means)))
        };
        Ok(Some(LeafSpec {
            reflectance: mean("reflectance", &spectra.reflectance)?,
            transmittance: mean("transmittance", &spectra.transmittance)?,
            prospect: None,
            ..leaf.clone()
        }))
    }

    fn check_leaf_ranges(&self, pointer: &str, leaf: &LeafSpec) -> Result<()> {
        if leaf.tint.is_some() {
            return Err(self
                .error(format!("{pointer}/tint"), "only a solid leaf (thin: false) has a tint")
                .remedy("leave it out"));
        }
        for (key, values) in
            [("reflectance", &leaf.reflectance), ("transmittance", &leaf.transmittance)]
        {
            if values.is_none() {
                return Err(self
                    .error(pointer, format!("a thin leaf has no `{key}`"))
                    .remedy("give it as an integrating sphere measures it, or what the leaf is made of (`prospect`)"));
            }
            self.fraction(pointer, key, values.as_ref(), 0.0)?;
        }
        if let Some(back) = &leaf.back {
            let pointer = format!("{pointer}/back");
            self.fraction(&pointer, "reflectance", back.reflectance.as_ref(), 0.0)?;
            self.fraction(&pointer, "transmittance", back.transmittance.as_ref(), 0.0)?;
        }
        Ok(())
    }

    pub(super) fn band_names(&self) -> Vec<&str> {
        self.parts.bands.iter().map(|band| band.name.as_str()).collect()
    }

    /// Returns the values per band of fractions that have been checked one by one; 0 where there
    /// are none.
    fn checked(&self, values: Option<&PerBand>) -> Vec<f64> {
        match values {
            None => vec![0.0; self.bands()],
            Some(PerBand::All(value)) => vec![*value; self.bands()],
            Some(PerBand::Each(values)) => values.clone(),
            Some(PerBand::Spectrum(spectrum)) => self.averaged(spectrum),
        }
    }

    fn phong(&self, file: &PhongSpec) -> Checked<Material> {
        let [reflectance, specular, transmittance] =
            [&file.reflectance, &file.specular, &file.transmittance]
                .map(|values| self.checked(values.as_ref()));
        let fractions = PhongFractions {
            reflectance: &single(&reflectance),
            specular: &single(&specular),
            transmittance: &single(&transmittance),
        };
        let exponent = file.exponent.map(|n| n as f32);
        Phong::new(fractions, exponent, &self.band_names()).map(Material::from)
    }

    /// Makes a thin leaf, and a warning where its cuticle alone reflects more than was measured.
    fn thin_leaf(&self, file: &LeafSpec) -> Checked<(Material, Option<String>)> {
        let ior = file.ior.unwrap_or(LEAF_IOR);
        let f0 = normal_fresnel(ior);
        let [r, t] = [&file.reflectance, &file.transmittance].map(|v| self.checked(v.as_ref()));
        let back = file.back.as_ref();
        let of_back = |values: Option<&PerBand>, front: &[f64]| match values {
            Some(values) => self.checked(Some(values)),
            None => front.to_vec(),
        };
        let back_r = of_back(back.and_then(|b| b.reflectance.as_ref()), &r);
        let back_t = of_back(back.and_then(|b| b.transmittance.as_ref()), &t);
        let low = r.iter().chain(&back_r).any(|&r| r < f0);
        let warning = low.then(|| {
            format!(
                "a reflectance below that of the cuticle: with ior {ior} the leaf shows {f0:.4} there"
            )
        });
        let [r, t, back_r, back_t] = [r, t, back_r, back_t].map(|v| single(&v));
        let front = LeafFace { reflectance: &r, transmittance: &t };
        let back = LeafFace { reflectance: &back_r, transmittance: &back_t };
        Ok((Leaf::new(ior, front, back, &self.band_names())?.into(), warning))
    }
}

/// Makes an error of what is wrong with a material of an MTL file.
fn of_mtl(problem: Problem, place: &str) -> Error {
    problem.or("give the scene a material of this name").at(place)
}
