//! Averages measured spectra over the bands, weighted with the light of the scene, and divides the
//! flux of lamps with a measured spectrum among the bands.

use std::sync::Arc;

use super::{
    files::unknown,
    known_spectra::{Part, SpectrumAverage},
    loader::Loader,
    luminaires::{FileFlux, LampFile},
    spec::*,
};
use crate::{
    input::quoted,
    photometry::FluxUnit,
    spectrum_file::{self, Column, Counts, Share},
};
use phylux_core::{
    error::{LISTED, Result, some},
    math::{
        curve::{Curve, integral},
        luminosity::{LM_PER_W, VISIBLE, luminosity},
        units::{Quantity, UMOL_PER_J_NM},
    },
    scene::{
        daylight::{DaylightSource, WAVELENGTHS, band_share},
        light::{known_spectra, known_spectrum},
    },
};

/// Noise scatters a few values below 0; a larger share of them leads to a warning.
const NOISE: f64 = 0.05;

/// Converts a value per nm of a table, in photons (umol) or energy (J), to `quantity`.
fn density(value: f64, nm: f64, unit: SpectralUnitSpec, quantity: Quantity) -> f64 {
    match (unit, quantity) {
        (SpectralUnitSpec::Photons, Quantity::Micromole)
        | (SpectralUnitSpec::Energy, Quantity::Watt) => value,
        (SpectralUnitSpec::Photons, Quantity::Watt) => value / (nm * UMOL_PER_J_NM),
        (SpectralUnitSpec::Energy, Quantity::Micromole) => value * nm * UMOL_PER_J_NM,
    }
}

impl Loader<'_> {
    /// Finds the light that averages of spectra are weighted with.
    pub(super) fn load_spectra(&mut self, file: &SceneSpec) -> Result<()> {
        let weight = file.spectra.weight.as_deref().unwrap_or("lights");
        match weight {
            "flat" => return Ok(()),
            "lights" => {}
            table => {
                let (curve, unit) =
                    self.lamp_curve("/spectra", "weight", table, None, file.spectra.unit)?;
                self.spectra.weight.push(Part::Lamp { curve, unit, scale: 1.0 });
                return Ok(());
            }
        }
        for (i, light) in file.lights.iter().enumerate() {
            let lamp_file = match light {
                LightSpec::Point(light) => light.lamp_file(),
                LightSpec::Area(light) => light.lamp_file(),
                LightSpec::Sun(_) | LightSpec::Sky(_) => {
                    let is_sun = matches!(light, LightSpec::Sun(_));
                    let source = if is_sun { DaylightSource::Sun } else { DaylightSource::Sky };
                    self.spectra.weight.push(Part::Daylight(source));
                    continue;
                }
                _ => LampFile::default(),
            };
            let pointer = format!("/lights/{i}/power");
            let part = match light.keys().power {
                Some(PowerSpec::Spectrum(lamp)) => {
                    let measured = match lamp.total {
                        TotalSpec::File => self.measured(&format!("/lights/{i}"), lamp_file)?,
                        TotalSpec::Given(_) => None,
                    };
                    let flux = measured.map(|measured| measured.flux());
                    let (curve, unit, scale) = self.lamp(&pointer, lamp, flux)?;
                    Part::Lamp { curve, unit, scale }
                }
                power => {
                    let name = light.keys().name.map_or(format!("light{i}"), String::from);
                    self.spectra.flat.push(name);
                    let power = match power {
                        Some(PowerSpec::Given(PerBand::All(power))) => vec![*power; self.bands()],
                        Some(PowerSpec::Given(PerBand::Each(power))) => power.clone(),
                        _ => vec![1.0; self.bands()],
                    };
                    Part::Flat(power)
                }
            };
            self.spectra.weight.push(part);
        }
        Ok(())
    }

    /// Returns all averages that were made, and warns of odd tables, and of lights without a spectrum
    /// if there are any averages.
    pub(super) fn take_averages(&mut self) -> Vec<SpectrumAverage> {
        for (place, problem) in self.spectra.warnings.take() {
            self.told.warn(place, problem);
        }
        let averages = self.spectra.averages.take();
        if !averages.is_empty() && !self.spectra.flat.is_empty() {
            let flat = self.spectra.flat.join("`, `");
            let problem = format!(
                "no spectrum of the lights `{flat}`: the averages of spectra take each as flat over a band"
            );
            let place = self.place("/lights");
            self.told.warn(place, problem);
        }
        averages
    }

    /// Returns a column of the table `file`, which the scene file names at `pointer`; each column
    /// is read once.
    fn curve(
        &self,
        pointer: &str,
        file: &str,
        column: Option<&ColumnSpec>,
    ) -> Result<Arc<spectrum_file::Measured>> {
        let key = format!("{file} {column:?}");
        if let Some(known) = self.spectra.curves.borrow().get(&key) {
            return Ok(known.clone());
        }
        let path = self.files.sibling(file);
        let bytes = self.files.bytes(pointer, &path)?;
        let column = match column {
            None => Column::Number(2),
            Some(ColumnSpec::Number(number)) => Column::Number(number.0),
            Some(ColumnSpec::Name(name)) => Column::Name(name),
        };
        let curve = Arc::new(spectrum_file::parse(&bytes, &path, column)?);
        self.spectra.curves.borrow_mut().insert(key, curve.clone());
        Ok(curve)
    }

    /// Returns the limits of a band, nm. Error: the band has no wavelengths, or the spectrum does
    /// not reach over all of it.
    fn limits(&self, pointer: &str, band: usize, file: &str, curve: &Curve) -> Result<[f64; 2]> {
        let band = &self.parts.bands[band];
        let (Some(from), Some(to)) = (band.from_nm, band.to_nm) else {
            let problem = format!("a spectrum, but band `{}` has no wavelengths", band.name);
            return Err(self
                .error(pointer, problem)
                .remedy("give every band `from_nm` and `to_nm`"));
        };
        if !curve.reaches(from, to) {
            let [first, last] = curve.range();
            let problem = format!(
                "{file} reaches from {first} to {last} nm, band `{}` from {from} to {to} nm",
                band.name
            );
            return Err(self
                .error(pointer, problem)
                .remedy("use a spectrum that covers the bands, or narrower bands"));
        }
        Ok([from, to])
    }

    /// Returns the mean of a spectrum over each band, from 0 to `high`, weighted with the light of
    /// the scene.
    pub(super) fn average(
        &self,
        pointer: &str,
        spectrum: &SpectrumSpec,
        high: f64,
    ) -> Result<Vec<f64>> {
        let key = format!("{spectrum:?}");
        let measured = self.curve(pointer, &spectrum.spectrum, spectrum.column.as_ref())?;
        if measured.counts == Some(Counts::Energy) {
            let problem = format!("{} holds light, and not what a surface does", spectrum.spectrum);
            return Err(self.error(pointer, problem).remedy(
                "name a file of reflectance or transmittance; the spectrum of a lamp belongs to its power",
            ));
        }
        if let Some(Counts::Share(share)) = measured.counts {
            self.check_share(pointer, &spectrum.spectrum, share)?;
        }
        let curve = &measured.curve;
        let times = spectrum.times.unwrap_or(1.0);
        self.in_range(&format!("{pointer}/times"), times, 0.0, f64::MAX)?;
        let factor = if spectrum.percent { 0.01 * times } else { times };
        let means = self.mean(pointer, &spectrum.spectrum, curve, factor, high)?;
        self.spectra.means.borrow_mut().insert(key, means.clone());
        Ok(means)
    }

    /// Checks that a file says the share of light that the key at `pointer` means.
    fn check_share(&self, pointer: &str, file: &str, share: Share) -> Result<()> {
        let key = pointer.rsplit('/').next().unwrap_or_default();
        let others: &[&str] = match share {
            Share::Reflectance => &["transmittance", "tint"],
            Share::Transmittance => &["reflectance", "specular", "albedo"],
            // no key takes it
            Share::Absorptance => &[""],
        };
        if !others.iter().any(|other| key.contains(other)) {
            return Ok(());
        }
        let problem = format!("{file} says that it holds `{}`", share.name());
        Err(self.error(pointer, problem).remedy(match share {
            Share::Absorptance => {
                "give what the surface reflects and what it lets through: it absorbs the rest"
                    .into()
            }
            _ => format!("name the file that belongs to `{key}`"),
        }))
    }

    /// Returns the mean of a curve times `factor` over each band, from 0 to `high`, weighted with
    /// the light of the scene. `name` says in errors which curve it is.
    pub(super) fn mean(
        &self,
        pointer: &str,
        name: &str,
        curve: &Curve,
        factor: f64,
        high: f64,
    ) -> Result<Vec<f64>> {
        let (mut means, mut spreads) = (Vec::new(), Vec::new());
        let mut knots = curve.places().to_vec();
        for part in &self.spectra.weight {
            match part {
                Part::Lamp { curve, .. } => knots.extend(curve.places()),
                Part::Daylight(_) => knots.extend((0..800).map(|i| 5.0 * f64::from(i))),
                Part::Flat(_) => {}
            }
        }
        knots.sort_by(f64::total_cmp);
        // so that many lamps of one table cost no more places than one
        knots.dedup();
        for band in 0..self.bands() {
            let [from, to] = self.limits(pointer, band, name, curve)?;
            let [after, until] = [from, to].map(|nm| knots.partition_point(|&knot| knot <= nm));
            let knots = &knots[after..until];
            let weighted = |power: i32| {
                integral(from, to, knots, |nm| curve.at(nm).powi(power) * self.weight(band, nm))
            };
            let dark = weighted(0) <= 0.0;
            let mean = |power: i32| match dark {
                // no light is emitted in this band, so the mean is plain
                true => integral(from, to, knots, |nm| curve.at(nm).powi(power)) / (to - from),
                false => weighted(power) / weighted(0),
            };
            let (first, second) = (mean(1), mean(2));
            self.tell_negative(name, band, curve, [from, to], first);
            // a mean below zero comes from noise
            let value = (first * factor).max(0.0);
            self.in_range(pointer, value, 0.0, high)?;
            means.push(value);
            spreads.push(if first > 0.0 { second / (first * first) } else { 1.0 });
        }
        let mut averages = self.spectra.averages.borrow_mut();
        if averages.iter().all(|average| average.pointer != pointer) {
            let pointer = pointer.to_string();
            averages.push(SpectrumAverage { pointer, means: means.clone(), spreads });
        }
        Ok(means)
    }

    /// Warns of a table with more values below 0 in a band than noise explains, or with a mean below
    /// 0.
    fn tell_negative(&self, file: &str, band: usize, curve: &Curve, limits: [f64; 2], mean: f64) {
        let [from, to] = limits;
        let rows = curve.places().iter().filter(|&&nm| from <= nm && nm <= to);
        let (rows, below) = rows
            .fold((0, 0), |(rows, below), &nm| (rows + 1, below + usize::from(curve.at(nm) < 0.0)));
        if mean >= 0.0 && f64::from(below as u32) <= NOISE * f64::from(rows as u32) {
            return;
        }
        let name = &self.parts.bands[band].name;
        let taken = if mean < 0.0 { ", below 0 too, and counts as 0" } else { "" };
        let problem = format!(
            "{below} of its {rows} values in band {} are below 0, which no surface has, and their \
             mean is {mean:.4}{taken}: look at the measurement",
            quoted(name)
        );
        self.tell(file, problem);
    }

    /// Keeps what is odd about a table, once, until the warnings are collected.
    fn tell(&self, file: &str, problem: String) {
        self.tell_at(self.files.sibling(file).display().to_string(), problem);
    }

    /// Keeps what is odd at a place, once, until the warnings are collected.
    pub(super) fn tell_at(&self, place: String, problem: String) {
        let warning = (place, problem);
        let mut warnings = self.spectra.warnings.borrow_mut();
        if !warnings.contains(&warning) {
            warnings.push(warning);
        }
    }

    /// Returns the means of a spectrum that has been averaged before.
    pub(super) fn averaged(&self, spectrum: &SpectrumSpec) -> Vec<f64> {
        let means = self.spectra.means.borrow();
        means.get(&format!("{spectrum:?}")).cloned().unwrap_or_else(|| vec![0.0; self.bands()])
    }

    /// Returns the light of the scene per nm at a wavelength in a band, which averages are weighted
    /// with; it is the same at all wavelengths where no weight is known.
    fn weight(&self, band: usize, nm: f64) -> f64 {
        if self.spectra.weight.is_empty() {
            return 1.0;
        }
        let quantity = self.parts.quantity;
        let of_part = |part: &Part| match part {
            Part::Lamp { curve, unit, scale } => {
                scale * density(curve.at(nm).max(0.0), nm, *unit, quantity)
            }
            Part::Daylight(source) => {
                let [low, high] = WAVELENGTHS;
                let (from, to) = ((nm - 0.01).clamp(low, high), (nm + 0.01).clamp(low, high));
                band_share(*source, quantity, from, to).unwrap_or(0.0) / 0.02
            }
            Part::Flat(power) => {
                let limits = &self.parts.bands[band];
                let width = limits.to_nm.unwrap_or(1.0) - limits.from_nm.unwrap_or(0.0);
                power.get(band).copied().unwrap_or(0.0) / width
            }
        };
        self.spectra.weight.iter().map(of_part).sum()
    }

    /// Returns the spectrum of a lamp and what it counts per nm: a spectrum at hand by its name, or
    /// else a column of the table of this name. The scene file has the name at `key` of `pointer`.
    fn lamp_curve(
        &self,
        pointer: &str,
        key: &str,
        name: &str,
        column: Option<&ColumnSpec>,
        unit: Option<SpectralUnitSpec>,
    ) -> Result<(Arc<Curve>, SpectralUnitSpec)> {
        let place = format!("{pointer}/{key}");
        if let Some(curve) = known_spectrum(name) {
            for (key, given) in [("column", column.is_some()), ("unit", unit.is_some())] {
                if given {
                    let problem =
                        format!("the spectrum `{name}` is at hand and has no {key} to choose");
                    return Err(self
                        .error(format!("{pointer}/{key}"), problem)
                        .remedy(format!("leave it out, or name your own file `./{name}`")));
                }
            }
            return Ok((Arc::new(curve.clone()), SpectralUnitSpec::Energy));
        }
        let measured = self.curve(&place, name, column).map_err(|error| {
            let is_file = name.contains(['/', '\\', ':'])
                || [".csv", ".spdx", ".xml"].iter().any(|end| name.contains(end));
            if is_file || self.files.fetch(&self.files.sibling(name)).is_ok() {
                return error;
            }
            let problem = format!("no file {name}, and no spectrum at hand of this name");
            unknown(self.error(&place, problem), name, known_spectra())
        })?;
        if column.is_none() && measured.names.len() > 1 {
            let names = measured.names.iter().zip(2..).map(|(name, column)| match name.as_str() {
                "" => format!("column {column}"),
                name => quoted(name),
            });
            let problem = format!(
                "holds {} spectra, {}; the first is taken: `column` picks another one, or says that it is meant",
                measured.names.len(),
                some(names, LISTED)
            );
            self.tell(name, problem);
        }
        let counted = match measured.counts {
            None => unit.unwrap_or_default(),
            Some(Counts::Energy) => SpectralUnitSpec::Energy,
            Some(Counts::Share(_)) => {
                let problem = format!("{name} holds what a surface does, and not light");
                return Err(self.error(place, problem).remedy("name the spectrum of the lamp"));
            }
        };
        if unit.is_some_and(|unit| unit != counted) {
            let problem = format!("{name} says itself that it counts energy");
            return Err(self.error(format!("{pointer}/unit"), problem).remedy("leave it out"));
        }
        Ok((Arc::new(measured.curve.clone()), counted))
    }

    /// Returns the spectrum of a lamp, what it counts per nm, and the factor that turns its values
    /// into the lamp's flux per nm. `of_file` is the flux that the lamp's photometry file states.
    fn lamp(
        &self,
        pointer: &str,
        lamp: &LampSpectrumSpec,
        of_file: Option<FileFlux>,
    ) -> Result<(Arc<Curve>, SpectralUnitSpec, f64)> {
        let (column, unit) = (lamp.column.as_ref(), lamp.unit);
        let (curve, unit) = self.lamp_curve(pointer, "spectrum", &lamp.spectrum, column, unit)?;
        let total = match (lamp.total, of_file) {
            (TotalSpec::Given(total), _) => total,
            (TotalSpec::File, Some(flux)) => flux.value,
            (TotalSpec::File, None) => {
                return Err(self
                    .error(format!("{pointer}/total"), "\"file\" without `photometry`")
                    .remedy("name the file, or give the flux"));
            }
        };
        self.in_range(&format!("{pointer}/total"), total, 0.0, f64::MAX)?;
        let [first, last] = curve.range();
        let stated = match (lamp.total, of_file) {
            (TotalSpec::File, Some(flux)) if flux.unit != FluxUnit::Lumen => Some(flux),
            _ => None,
        };
        if let Some(FileFlux { unit, .. }) = stated {
            self.check_stated(pointer, lamp, unit)?;
        }
        let of_total = match (stated.map(|flux| flux.unit), lamp.quantity, lamp.total) {
            (Some(FluxUnit::Micromole), ..) | (_, Some(TotalQuantitySpec::Micromole), _) => {
                Quantity::Micromole
            }
            (Some(_), ..) | (_, Some(TotalQuantitySpec::Watt), _) => Quantity::Watt,
            (_, None, TotalSpec::Given(_)) => self.parts.quantity,
            (_, Some(TotalQuantitySpec::Lumen), _) | (_, None, TotalSpec::File) => {
                let lumens = self.lumens(pointer, lamp, &curve, unit)?;
                return Ok((curve, unit, total / lumens));
            }
        };
        let [first_counted, last_counted] =
            stated.and_then(|flux| flux.range).unwrap_or([first, last]);
        let (from, to) =
            (lamp.from_nm.unwrap_or(first_counted), lamp.to_nm.unwrap_or(last_counted));
        if !(from < to && curve.reaches(from, to)) {
            let problem = format!(
                "`total` counts from {from} to {to} nm, {} reaches from {first} to {last} nm",
                lamp.spectrum
            );
            return Err(self
                .error(pointer, problem)
                .remedy("`from_nm` is below `to_nm`, and both lie within the spectrum"));
        }
        let whole = self.flux(&curve, unit, of_total, [from, to]);
        let dark = integral(from, to, curve.places(), |nm| (-curve.at(nm)).max(0.0));
        let bright = integral(from, to, curve.places(), |nm| curve.at(nm).max(0.0));
        if bright > 0.0 && dark > NOISE * bright {
            let problem = format!(
                "its values below 0 from {from} to {to} nm, which count as 0, come to {:.0} % of those \
                 above: look at the measurement",
                100.0 * dark / bright
            );
            self.tell(&lamp.spectrum, problem);
        }
        if !(whole > 0.0 && whole.is_finite()) {
            let problem = format!("{} has no light from {from} to {to} nm", lamp.spectrum);
            return Err(self.error(pointer, problem).remedy("name another column or range"));
        }
        Ok((curve, unit, total / whole))
    }

    /// Checks that a lamp says nothing of its total that its photometry file says itself.
    fn check_stated(&self, pointer: &str, lamp: &LampSpectrumSpec, unit: FluxUnit) -> Result<()> {
        let given = [
            ("quantity", lamp.quantity.is_some()),
            ("from_nm", lamp.from_nm.is_some()),
            ("to_nm", lamp.to_nm.is_some()),
        ];
        let problem = format!("the file states its flux in {} itself", unit.name());
        self.refuse_given(pointer, &given, problem, "leave it out")
    }

    /// Returns the integral of a lamp's table in lumens. Error: the table does not reach over the
    /// wavelengths that the eye sees, or has no light there.
    fn lumens(
        &self,
        pointer: &str,
        lamp: &LampSpectrumSpec,
        curve: &Curve,
        unit: SpectralUnitSpec,
    ) -> Result<f64> {
        let [low, high] = VISIBLE;
        let keys = [("from_nm", lamp.from_nm.is_some()), ("to_nm", lamp.to_nm.is_some())];
        let remedy = "leave it out, or give `total` in W or umol/s";
        self.refuse_given(pointer, &keys, "lumens count at all wavelengths", remedy)?;
        let [first, last] = curve.range();
        let lumens = curve.reaches(low, high).then(|| {
            let seen = |nm| {
                let energy = density(curve.at(nm).max(0.0), nm, unit, Quantity::Watt);
                LM_PER_W * energy * luminosity(nm)
            };
            let mut knots: Vec<f64> = curve.places().to_vec();
            knots.extend((76..=156).map(|i| 5.0 * f64::from(i)));
            knots.sort_by(f64::total_cmp);
            integral(first.max(380.0), last.min(780.0), &knots, seen)
        });
        lumens.filter(|lumens| *lumens > 0.0 && lumens.is_finite()).ok_or_else(|| {
            let problem = format!(
                "no lumens without a spectrum from {low} to {high} nm, {} reaches from {first} to {last} nm",
                lamp.spectrum
            );
            let remedy = "use a spectrum with light that the eye sees, 0 where there is none, or give \
                `total` in W or umol/s";
            self.error(format!("{pointer}/spectrum"), problem).remedy(remedy)
        })
    }

    /// Returns the integral of a lamp's table from `from` to `to`, nm, in `quantity`. Values below
    /// zero are noise and count as 0.
    fn flux(
        &self,
        curve: &Curve,
        unit: SpectralUnitSpec,
        quantity: Quantity,
        [from, to]: [f64; 2],
    ) -> f64 {
        integral(from, to, curve.places(), |nm| density(curve.at(nm).max(0.0), nm, unit, quantity))
    }

    /// Returns the power of a lamp in each band; `of_file` is the flux that its photometry file
    /// states.
    pub(super) fn lamp_power(
        &self,
        pointer: &str,
        lamp: &LampSpectrumSpec,
        of_file: Option<FileFlux>,
    ) -> Result<Vec<f64>> {
        let (curve, unit, scale) = self.lamp(pointer, lamp, of_file)?;
        let of_band = |band: usize| {
            let limits = self.limits(pointer, band, &lamp.spectrum, &curve)?;
            Ok(scale * self.flux(&curve, unit, self.parts.quantity, limits))
        };
        (0..self.bands()).map(of_band).collect()
    }
}
