//! Loads the sums over bands and their ratios.

use std::collections::BTreeSet;

use super::{files::unknown, loader::Loader, spec::*};
use crate::json;
use phylux_core::{
    error::{Error, LISTED, Result, number, some},
    math::{
        units::Quantity,
        weighting::{RATIOS, SUMS, WeightedUnit, Weighting},
    },
    scene::world::{BandRatio, BandSum},
};

/// A change of the weight within a band, as a part of the largest weight of all, beyond which there
/// is a warning: the sum then depends on where in the band the light is.
const UNEVEN: f64 = 0.5;
/// A part of a weighting that no band covers, beyond which there is a warning.
const UNCOVERED: f64 = 0.05;
/// The largest number of sums, and of ratios.
const MOST: usize = 4096;

/// What of a weighted sum depends on the light within bands, or where no band is.
#[derive(Default)]
struct Doubts {
    /// Names of the bands within which weights change much.
    uneven: BTreeSet<String>,
    /// Wavelengths that no band covers, and the part of the weights that they have.
    gaps: Vec<String>,
    share: f64,
}

impl Doubts {
    /// Joins the doubts about both parts of a ratio, so that each is said once.
    fn and(mut self, other: Self) -> Self {
        self.uneven.extend(other.uneven);
        let new: Vec<String> =
            other.gaps.into_iter().filter(|gap| !self.gaps.contains(gap)).collect();
        self.gaps.extend(new);
        self.share = self.share.max(other.share);
        self
    }
}

impl Loader<'_> {
    pub(super) fn load_sums(&mut self, file: &SceneSpec) -> Result<()> {
        for (key, count) in [("sums", file.sums.len()), ("ratios", file.ratios.len())] {
            if count > MOST {
                let problem = format!("{count} {key}, must be at most {MOST}");
                return Err(self.error(format!("/{key}"), problem).remedy("split the scene file"));
            }
        }
        for (name, sum) in &file.sums {
            let pointer = format!("/sums/{}", json::escaped(name));
            self.check_sum_name(&pointer, name, "sum")?;
            let sum = BandSum { name: name.clone(), ..self.sum(&pointer, sum, false)? };
            self.parts.sums.push(sum);
        }
        for (name, ratio) in &file.ratios {
            let pointer = format!("/ratios/{}", json::escaped(name));
            self.check_sum_name(&pointer, name, "ratio")?;
            let (numerator, denominator) = match ratio {
                RatioSpec::Name(known) => self.known_ratio(&pointer, known)?,
                RatioSpec::Of(QuotientSpec { numerator, denominator }) => {
                    let mut of = |key: &str, sum| self.sum(&format!("{pointer}/{key}"), sum, true);
                    (of("numerator", numerator)?, of("denominator", denominator)?)
                }
            };
            if denominator.weighted().all(|(_, weight)| weight == 0.0) {
                let problem = "its denominator gives every band the weight 0";
                return Err(self.error(pointer, problem).remedy("give one of them a weight"));
            }
            self.parts.ratios.push(BandRatio { name: name.clone(), numerator, denominator });
        }
        if self.files.sources.by_hour.is_some() {
            // ratios of hours and days follow from these
            let sums = self.parts.ratios.iter().flat_map(BandRatio::sums).collect::<Vec<_>>();
            self.parts.sums.extend(sums);
        }
        Ok(())
    }

    fn check_sum_name(&self, pointer: &str, name: &str, what: &str) -> Result<()> {
        let used = match () {
            _ if self.parts.bands.iter().any(|band| band.name == *name) => "band",
            _ if self.parts.sums.iter().any(|sum| sum.name == *name) => "sum",
            _ => return Ok(()),
        };
        Err(self
            .error(pointer, format!("a {used} has this name too"))
            .remedy(format!("give the {what} another name")))
    }

    /// Makes a sum without a name. In a ratio a text may name a band or a sum.
    fn sum(&mut self, pointer: &str, sum: &SumSpec, in_ratio: bool) -> Result<BandSum> {
        match sum {
            SumSpec::Bands(members) => {
                let bands = self.members(pointer, members)?;
                Ok(BandSum { bands, ..BandSum::default() })
            }
            SumSpec::Weights(weights) => self.weights(pointer, weights),
            SumSpec::Window(WindowSpec { from_nm, to_nm, quantity }) => {
                for (key, nm) in [("from_nm", from_nm), ("to_nm", to_nm)] {
                    self.in_range(&format!("{pointer}/{key}"), *nm, 0.0, f64::MAX)?;
                }
                if from_nm >= to_nm {
                    let problem = format!("from_nm = {from_nm} is not below to_nm = {to_nm}");
                    return Err(self.error(pointer, problem).remedy("swap or correct them"));
                }
                let window = match quantity {
                    None | Some(Quantity::Micromole) => Weighting::Photons(*from_nm, *to_nm),
                    Some(Quantity::Watt) => Weighting::Energy(*from_nm, *to_nm),
                };
                self.weighted(pointer, "the window", &[window], None)
            }
            SumSpec::Some(SomeBandsSpec { weighting, bands }) => {
                let bands = self.members(&format!("{pointer}/bands"), bands)?;
                let of = self.weighting(&format!("{pointer}/weighting"), weighting, &[])?;
                self.weighted(pointer, &format!("`{weighting}`"), &[of], Some(&bands))
            }
            SumSpec::Name(name) => {
                let band = self.parts.bands.iter().position(|band| band.name == *name);
                let known = self.parts.sums.iter().find(|sum| sum.name == *name);
                match (band.filter(|_| in_ratio), known.filter(|_| in_ratio)) {
                    (Some(band), _) => Ok(BandSum { bands: vec![band], ..BandSum::default() }),
                    (_, Some(sum)) => Ok(BandSum { name: String::new(), ..sum.clone() }),
                    _ if band.is_some() => Err(self
                        .error(pointer, format!("`{name}` is a band, not a weighting"))
                        .remedy(format!("write [\"{name}\"] for a sum of this band"))),
                    _ => {
                        let others: Vec<&str> = match in_ratio {
                            true => self.names_of_ratios().collect(),
                            false => Vec::new(),
                        };
                        let of = self.weighting(pointer, name, &others)?;
                        self.weighted(pointer, &format!("`{name}`"), &[of], None)
                    }
                }
            }
        }
    }

    fn members(&self, pointer: &str, members: &[String]) -> Result<Vec<usize>> {
        let mut bands = Vec::new();
        for (i, member) in members.iter().enumerate() {
            let band = self.band(&format!("{pointer}/{i}"), member)?;
            if bands.contains(&band) {
                let problem = format!("`{member}` stands here twice");
                return Err(self.error(pointer, problem).remedy("name each band once"));
            }
            bands.push(band);
        }
        if bands.is_empty() {
            return Err(self.error(pointer, "adds up no band").remedy("name its bands"));
        }
        Ok(bands)
    }

    fn band(&self, pointer: &str, name: &str) -> Result<usize> {
        let names = || self.parts.bands.iter().map(|band| band.name.as_str());
        names()
            .position(|band| band == name)
            .ok_or_else(|| unknown(self.error(pointer, format!("no band `{name}`")), name, names()))
    }

    fn weights(
        &self,
        pointer: &str,
        weights: &std::collections::BTreeMap<String, f64>,
    ) -> Result<BandSum> {
        let mut of_bands = vec![None; self.bands()];
        for (name, weight) in weights {
            let place = format!("{pointer}/{}", json::escaped(name));
            let band = self.band(&place, name)?;
            self.in_range(&place, *weight, 0.0, 1e30)?;
            of_bands[band] = Some(*weight);
        }
        let given = of_bands.into_iter().enumerate();
        let (bands, weights): (Vec<_>, Vec<_>) =
            given.filter_map(|(band, weight)| Some((band, weight?))).unzip();
        if bands.is_empty() {
            return Err(self.error(pointer, "adds up no band").remedy("name its bands"));
        }
        Ok(BandSum { bands, weights, ..BandSum::default() })
    }

    /// Returns the names of bands and sums, which a ratio may have in place of a weighting.
    fn names_of_ratios(&self) -> impl Iterator<Item = &str> {
        let bands = self.parts.bands.iter().map(|band| band.name.as_str());
        bands.chain(self.parts.sums.iter().map(|sum| sum.name.as_str()))
    }

    /// Returns the weighting of this name. Error: there is none; the sentence names those that there
    /// are, after the `others` that may stand there.
    fn weighting(&self, pointer: &str, name: &str, others: &[&str]) -> Result<Weighting> {
        let known = SUMS.iter().find(|(known, _)| *known == name);
        known.map(|(_, weighting)| *weighting).ok_or_else(|| {
            let what = if others.is_empty() { "weighting" } else { "band, sum or weighting" };
            let error = self.error(pointer, format!("no {what} `{name}`"));
            let names = SUMS.iter().map(|(known, _)| *known);
            unknown(error, name, others.iter().copied().chain(names))
        })
    }

    fn known_ratio(&mut self, pointer: &str, name: &str) -> Result<(BandSum, BandSum)> {
        let Some((_, over, under)) = RATIOS.iter().find(|(known, ..)| *known == name) else {
            let error = self.error(pointer, format!("no ratio `{name}`"));
            return Err(unknown(error, name, RATIOS.iter().map(|(known, ..)| *known)));
        };
        let name = format!("`{name}`");
        let (numerator, of_numerator) = self.doubted(pointer, &name, &[*over], None)?;
        let (denominator, of_denominator) = self.doubted(pointer, &name, under, None)?;
        self.say(pointer, &name, of_numerator.and(of_denominator));
        Ok((numerator, denominator))
    }

    /// Weights bands as [`doubted`](Self::doubted) does, and warns once of what depends on the light within
    /// them.
    fn weighted(
        &mut self,
        pointer: &str,
        name: &str,
        weightings: &[Weighting],
        chosen: Option<&[usize]>,
    ) -> Result<BandSum> {
        let (sum, doubts) = self.doubted(pointer, name, weightings, chosen)?;
        self.say(pointer, name, doubts);
        Ok(sum)
    }

    fn say(&mut self, pointer: &str, name: &str, doubts: Doubts) {
        let Doubts { uneven, gaps, share } = doubts;
        let gaps = (share > UNCOVERED).then(|| (100.0 * share, gaps.join(", ")));
        let bands = some(uneven, LISTED);
        let (doubts, remedy) = match (bands.is_empty(), gaps) {
            (true, None) => return,
            (false, None) => {
                (format!("its weights change much within band {bands}"), "use narrower bands")
            }
            (true, Some((percent, gaps))) => {
                (format!("no band has {percent:.0} % of its weights, from {gaps} nm"), "add bands")
            }
            (false, Some((percent, gaps))) => (
                format!(
                    "its weights change much within band {bands}, and no band has {percent:.0} % of \
                     them, from {gaps} nm"
                ),
                "use narrower bands, and add some",
            ),
        };
        let problem = format!("{name}: {doubts}; {remedy} (docs/scene-format.md#sums-and-ratios)");
        self.told.warn_once(pointer, problem);
    }

    /// Weights the `chosen` bands by wavelength, or all, by the sum of the weightings, which sentences
    /// call `name`, and returns what of this depends on the light within bands. Errors: wavelengths of
    /// a band are not known; two bands that count overlap; no band counts.
    fn doubted(
        &mut self,
        pointer: &str,
        name: &str,
        weightings: &[Weighting],
        chosen: Option<&[usize]>,
    ) -> Result<(BandSum, Doubts)> {
        let quantity = self.parts.quantity;
        let every: Vec<usize> = (0..self.bands()).collect();
        let bands = chosen.unwrap_or(&every);
        let mut sum = BandSum::default();
        let mut ends: Vec<(usize, [f64; 2])> = Vec::new();
        let mut doubts = Doubts::default();
        for &band in bands {
            let known = &self.parts.bands[band];
            let (Some(from), Some(to)) = (known.from_nm, known.to_nm) else {
                return Err(self
                    .error(
                        pointer,
                        format!("the wavelengths of band `{}` are not known", known.name),
                    )
                    .remedy("give every band from_nm and to_nm, or weights by band here"));
            };
            let weight = |weighting: &Weighting| weighting.of_band([from, to], quantity);
            let weight: f64 = weightings.iter().map(weight).sum();
            if weight <= 0.0 {
                continue;
            }
            let over = |(_, [start, end]): &&(usize, [f64; 2])| *start < to && from < *end;
            if let Some((other, _)) = ends.iter().find(over) {
                let other = &self.parts.bands[*other].name;
                return Err(self.overlap(pointer, [other, &known.name]));
            }
            let most = weightings.iter().map(|weighting| {
                let [least, most] = weighting.extremes([from, to]);
                most - least
            });
            if most.fold(0.0, f64::max) > UNEVEN {
                doubts.uneven.insert(format!("`{}`", known.name));
            }
            ends.push((band, [from, to]));
            sum.bands.push(band);
            sum.weights.push(weight);
        }
        if sum.bands.is_empty() {
            let [from, to] = weightings[0].range().map(number);
            return Err(self
                .error(
                    pointer,
                    format!("no band has light from {from} to {to} nm, which {name} weighs"),
                )
                .remedy("add such bands, or take this out"));
        }
        if chosen.is_none() {
            let covered: Vec<[f64; 2]> = ends.iter().map(|(_, ends)| *ends).collect();
            let (gaps, share) = uncovered(weightings, covered);
            let gap = |[from, to]: &[f64; 2]| format!("{} to {}", number(*from), number(*to));
            doubts.gaps = gaps.iter().map(gap).collect();
            doubts.share = share;
        }
        // a sum of W in a scene of W is like those of its bands
        let is_usual = (weightings[0].unit(), quantity) == (WeightedUnit::Watts, Quantity::Watt);
        sum.unit = (!is_usual).then(|| weightings[0].unit());
        Ok((sum, doubts))
    }

    fn overlap(&self, pointer: &str, [first, second]: [&str; 2]) -> Error {
        self.error(pointer, format!("bands `{first}` and `{second}` overlap, so that light would count twice"))
            .remedy("say which bands count: {\"weighting\": ..., \"bands\": [...]}, or give weights by band")
    }
}

/// Returns the wavelengths, nm, that weightings weigh and none of the bands has, and their share of
/// all weights.
fn uncovered(weightings: &[Weighting], mut bands: Vec<[f64; 2]>) -> (Vec<[f64; 2]>, f64) {
    let ranges = || weightings.iter().map(|weighting| weighting.range());
    let first = ranges().map(|range| range[0]).fold(f64::INFINITY, f64::min);
    let last = ranges().map(|range| range[1]).fold(0.0, f64::max);
    bands.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let (mut gaps, mut from) = (Vec::new(), first);
    for [start, end] in bands.into_iter().chain([[last, last]]) {
        if start > from && from < last {
            gaps.push([from, start.min(last)]);
        }
        from = from.max(end);
    }
    let of = |[from, to]: [f64; 2]| -> f64 {
        weightings.iter().map(|weighting| weighting.between(from, to)).sum()
    };
    let share = gaps.iter().map(|gap| of(*gap)).sum::<f64>() / of([first, last]);
    (gaps, share)
}
