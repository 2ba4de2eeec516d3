//! Lights whose intensity was measured, and the power of lights.

use glam::DVec3;

use super::{loader::Loader, spec::*};
use crate::{
    input::quoted,
    photometry::{FluxUnit, MeasuredLamp, Photometry},
};
use phylux_core::{
    error::{LISTED, Result, some},
    math::{geometry::Transform, units::Quantity},
    scene::light::Intensity,
};

/// The most lumens that a watt, and a umol/s, of any light can have.
const MOST_LM_PER_W: f64 = 683.0;
const MOST_LM_PER_UMOL: f64 = 150.0;

/// What the scene file says of a light's photometry file.
#[derive(Clone, Copy, Default)]
pub(super) struct LampFile<'a> {
    file: Option<&'a str>,
    set: Option<Count>,
    lm_per_w: Option<f64>,
    lm_per_umol: Option<f64>,
}

impl LampFile<'_> {
    /// Returns the keys that say how many lumens the light has, and whether each is given.
    fn lumen_keys(&self) -> [(&'static str, bool); 2] {
        [("lm_per_W", self.lm_per_w.is_some()), ("lm_per_umol", self.lm_per_umol.is_some())]
    }
}

impl PointSpec {
    pub(super) fn lamp_file(&self) -> LampFile<'_> {
        LampFile {
            file: self.photometry.as_deref(),
            set: self.set,
            lm_per_w: self.lm_per_w,
            lm_per_umol: self.lm_per_umol,
        }
    }
}

impl AreaSpec {
    pub(super) fn lamp_file(&self) -> LampFile<'_> {
        LampFile {
            file: self.photometry.as_deref(),
            set: self.set,
            lm_per_w: self.lm_per_w,
            lm_per_umol: self.lm_per_umol,
        }
    }
}

/// Where a luminaire aims, as the scene file says.
#[derive(Clone, Copy)]
pub(super) struct Aim {
    pub(super) aim: Option<[f64; 3]>,
    pub(super) zero_plane: Option<[f64; 3]>,
}

impl Aim {
    /// Returns the directions of V = 0 and C = 0 of a lamp that a transform has `turned`, which is
    /// aimed along `default` if the scene file does not say where.
    fn directions(self, turned: &Transform, default: DVec3) -> [DVec3; 2] {
        let aim = self.aim.map_or(default, |aim| turned.turned(aim.into()));
        [aim, turned.turned(self.zero_plane.map_or(DVec3::X, DVec3::from))]
    }
}

/// A photometry file, and which of its lamps the scene file picks.
pub(super) struct Measured {
    photometry: Photometry,
    picked: usize,
}

impl Measured {
    fn lamp(&self) -> &MeasuredLamp {
        &self.photometry.lamps[self.picked]
    }

    /// Returns the flux that the file states for the lamp.
    pub(super) fn flux(&self) -> FileFlux {
        let MeasuredLamp { flux: value, unit, range, .. } = *self.lamp();
        FileFlux { value, unit, range }
    }
}

/// The flux that a photometry file states.
#[derive(Clone, Copy)]
pub(super) struct FileFlux {
    pub(super) value: f64,
    pub(super) unit: FluxUnit,
    /// Wavelengths between which it counts, nm; `None` where the file does not say it.
    pub(super) range: Option<[f64; 2]>,
}

impl Loader<'_> {
    /// Reads the photometry file of a light; `None` if the light names none.
    pub(super) fn measured(&mut self, pointer: &str, lamp: LampFile) -> Result<Option<Measured>> {
        let Some(file) = lamp.file else {
            self.only_with(pointer, "set", lamp.set, "`photometry`")?;
            return Ok(None);
        };
        let photometry = self.files.photometry(&format!("{pointer}/photometry"), file)?;
        let picked = self.picked(pointer, file, lamp.set, &photometry)?;
        Ok(Some(Measured { photometry, picked }))
    }

    /// Returns the index of the lamp of a file that is meant: that of the key `set`, or the usual
    /// one. Errors: there is none, or it has no light.
    fn picked(
        &self,
        pointer: &str,
        file: &str,
        set: Option<Count>,
        photometry: &Photometry,
    ) -> Result<usize> {
        let Photometry { lamps, usual } = photometry;
        let Some(set) = set else {
            return usual.ok_or_else(|| {
                let count = lamps.len();
                let problem = format!("{file} has {count} emitters, which shine together");
                self.error(format!("{pointer}/photometry"), problem).remedy(format!(
                    "give a light for each of them, with `\"set\": 1` to `\"set\": {count}`"
                ))
            });
        };
        let error = |problem: String| self.error(format!("{pointer}/set"), problem);
        let index = usize::try_from(set.0).ok().and_then(|set| set.checked_sub(1));
        let Some(index) = index.filter(|&index| index < lamps.len()) else {
            let what = usual.map_or("emitter", |_| "lamp set");
            let problem = format!("{what} {}, but {file} has {}", set.0, lamps.len());
            return Err(error(problem).remedy(match lamps.len() {
                1 => "leave `set` out".into(),
                count => format!("give a number from 1 to {count}"),
            }));
        };
        if lamps[index].flux == 0.0 {
            let problem = format!("lamp set {} of {file} has no light (0 lm)", set.0);
            return Err(error(problem).remedy("leave `set` out, or pick another one"));
        }
        Ok(index)
    }

    /// Returns the intensity of a measured lamp that a transform has `turned`, and which is aimed
    /// along `default` if the scene file does not say where.
    pub(super) fn intensity(
        &self,
        pointer: &str,
        measured: &Measured,
        aim: Aim,
        turned: &Transform,
        default: DVec3,
    ) -> Result<Intensity> {
        if aim.aim.is_none() && default.length() < 1e-6 {
            return Err(self
                .error(pointer, "the normals of its triangles cancel, so that it aims nowhere")
                .remedy("say with `aim` where it does"));
        }
        let [aim, zero_plane] = aim.directions(turned, default);
        Intensity::table(measured.lamp().table.clone(), aim, zero_plane)
            .map_err(|problem| problem.at(self.place(pointer)))
    }

    /// Refuses a key that is given without the key that it belongs to.
    pub(super) fn only_with<T>(
        &self,
        pointer: &str,
        key: &str,
        given: Option<T>,
        with: &str,
    ) -> Result<()> {
        match given {
            None => Ok(()),
            Some(_) => Err(self
                .error(format!("{pointer}/{key}"), format!("goes with {with} only"))
                .remedy("leave it out, or say how its intensity depends on the direction")),
        }
    }

    /// Returns the power of a light per band. Where the photometry file says the flux, it is that
    /// of one lamp.
    pub(super) fn power(
        &mut self,
        pointer: &str,
        power: &PowerSpec,
        lamp: LampFile,
        measured: Option<&Measured>,
    ) -> Result<Vec<f64>> {
        if !matches!(power, PowerSpec::File) {
            let problem = "goes with `\"power\": \"file\"` only";
            let remedy = "leave it out: `power` says the flux";
            self.refuse_given(pointer, &lamp.lumen_keys(), problem, remedy)?;
        }
        let there = format!("{pointer}/power");
        let flux = measured.map(Measured::flux);
        let power = match power {
            PowerSpec::Given(power) => return self.per_band(&there, power, f64::MAX),
            PowerSpec::Spectrum(spectrum) => {
                if let (Some(measured), Some(file)) = (measured, lamp.file) {
                    self.remark_on_emitter(&there, file, spectrum, measured);
                }
                let power = self.lamp_power(&there, spectrum, flux)?;
                if spectrum.total != TotalSpec::File {
                    return Ok(power);
                }
                power
            }
            PowerSpec::File => self.converted(pointer, lamp, flux)?,
        };
        if let (Some(measured), Some(file)) = (measured, lamp.file) {
            self.remark_on_flux(pointer, lamp, file, measured);
        }
        Ok(power)
    }

    /// Returns the flux of a file in the quantity of the scene, by the factor that the scene file
    /// states.
    fn converted(&self, pointer: &str, lamp: LampFile, flux: Option<FileFlux>) -> Result<Vec<f64>> {
        const SPECTRUM: &str =
            "`{ \"spectrum\": \"lamp.csv\", \"total\": \"file\" }` with the lamp's spectrum";
        let there = format!("{pointer}/power");
        let (Some(flux), Some(file)) = (flux, lamp.file) else {
            return Err(self
                .error(there, "\"file\" without `photometry`")
                .remedy("name the file, or give the flux of each band"));
        };
        if self.bands() != 1 {
            let problem = format!("\"file\" for {} bands", self.bands());
            return Err(self.error(there, problem).remedy(format!(
                "give the flux of each band, or {SPECTRUM}: a file has but one number for the whole lamp"
            )));
        }
        if flux.unit != FluxUnit::Lumen {
            return self.as_stated(pointer, lamp, file, flux);
        }
        let flux = flux.value;
        let (unit, key, usual, most) = match self.parts.quantity {
            Quantity::Watt => ("W", "lm_per_W", lamp.lm_per_w, MOST_LM_PER_W),
            Quantity::Micromole => ("umol/s", "lm_per_umol", lamp.lm_per_umol, MOST_LM_PER_UMOL),
        };
        let other = match self.parts.quantity {
            Quantity::Watt => lamp.lm_per_umol.map(|_| "lm_per_umol"),
            Quantity::Micromole => lamp.lm_per_w.map(|_| "lm_per_W"),
        };
        if let Some(other) = other {
            return Err(self
                .error(format!("{pointer}/{other}"), format!("the scene counts in {unit}"))
                .remedy(format!("give `{key}`, or {SPECTRUM}")));
        }
        let Some(factor) = usual else {
            let problem = format!("\"file\": {file} states {flux:.1} lm, and lumens are no {unit}");
            return Err(self.error(there, problem).remedy(format!(
                "say with `{key}` how many lumens 1 {unit} of the lamp's light has, or give \
                {SPECTRUM}; if the file is in {unit} in place of lumens, `\"{key}\": 1`"
            )));
        };
        if !(factor > 0.0 && factor <= most) {
            let problem = format!("{factor}, must be above 0 and at most {most}");
            return Err(self.error(format!("{pointer}/{key}"), problem).remedy(
                "it is for the light that the lamp emits, not for the electricity that it takes: 1 W \
                of light at 555 nm, where the eye sees best, has 683 lm",
            ));
        }
        Ok(vec![flux / factor])
    }

    /// Returns the flux of a file that states it in W or umol/s, in a scene of one band. Errors: the
    /// scene counts in the other one; a factor for lumens is given; the band has other wavelengths.
    fn as_stated(
        &self,
        pointer: &str,
        lamp: LampFile,
        file: &str,
        flux: FileFlux,
    ) -> Result<Vec<f64>> {
        let there = format!("{pointer}/power");
        let spectrum = "give `{ \"spectrum\": ..., \"total\": \"file\" }` with the lamp's spectrum";
        let FileFlux { value, unit, range } = flux;
        let problem = format!("{file} states its flux in {}, not in lumens", unit.name());
        self.refuse_given(pointer, &lamp.lumen_keys(), problem, "leave it out")?;
        let own = self.parts.quantity.unit_names().flux;
        if own != unit.name() {
            let problem = format!("\"file\": {file} states {value} {}", unit.name());
            return Err(self
                .error(there, problem)
                .remedy(format!("count the scene in {}, or {spectrum}", unit.name())));
        }
        let band = &self.parts.bands[0];
        if let (Some([from, to]), Some(first), Some(last)) = (range, band.from_nm, band.to_nm)
            && [from, to] != [first, last]
        {
            let problem = format!(
                "\"file\": {file} counts from {from} to {to} nm, band {} from {first} to {last}",
                quoted(&band.name)
            );
            return Err(self
                .error(there, problem)
                .remedy(format!("let both agree, or {spectrum}")));
        }
        Ok(vec![value])
    }

    /// Warns where the intensities are those of another emitter of a file than the spectrum.
    fn remark_on_emitter(
        &mut self,
        there: &str,
        file: &str,
        spectrum: &LampSpectrumSpec,
        measured: &Measured,
    ) {
        let set = measured.picked + 1;
        if set > 1 && spectrum.spectrum == file && spectrum.column.is_none() {
            let problem = format!(
                "the intensities are those of emitter {set} of {file}, and the spectrum is that of the first: `column` \
                 picks its own, such as {} (docs/scene-format.md#measured-lamps)",
                set + 1
            );
            self.told.warn(self.place(there), problem);
        }
    }

    /// Warns where a file has more than one flux, of which one had to be chosen, and of what it notes.
    fn remark_on_flux(&mut self, pointer: &str, lamp: LampFile, file: &str, measured: &Measured) {
        let place = self.place(format!("{pointer}/photometry"));
        let Measured { photometry: Photometry { lamps, .. }, picked } = measured;
        if lamp.set.is_none() && lamps.len() > 1 {
            let others = lamps.iter().enumerate().filter(|(i, _)| i != picked);
            let others = others.map(|(i, lamp)| format!("set {}: {:.1} lm", i + 1, lamp.flux));
            let taken = match *picked {
                0 => "the first".into(),
                picked => format!("set {}, the first with lamps and light,", picked + 1),
            };
            let problem = format!(
                "{file} has {} sets of lamps, of which one at a time is in the luminaire: {taken} is \
                taken, {:.1} lm ({}); `set` picks one",
                lamps.len(),
                lamps[*picked].flux,
                some(others, LISTED)
            );
            self.told.warn(&place, problem);
        }
        for note in &measured.lamp().notes {
            self.told.warn(&place, format!("{file}: {note}"));
        }
    }
}
