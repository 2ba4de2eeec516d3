//! Part of the scattering function of a measured sheet: reflection on one side, or transmission
//! from one side to the other.

use super::basis::{Basis, Polar, Sectors};
use crate::math::{
    rng::Stream,
    sampling::weighted_choice,
    spectrum::{Lanes, Spectrum},
};

/// Values of a scattering function: f(i, o) is the sum of `row(i) column(o) value` over rows and
/// columns.
#[derive(Clone, Debug, PartialEq)]
pub struct PairValues {
    /// Functions of the direction that the light comes from.
    pub rows: Basis,
    /// Functions of the direction in which the light leaves.
    pub columns: Basis,
    /// `None` where f depends on both azimuths. Otherwise it depends only on their difference
    /// (leaving less coming, rad): this holds the differences that there are values for, rising
    /// within one turn, and f is constant in a sector about each. Both bases then have a single
    /// azimuth.
    pub turns: Option<Vec<f32>>,
    /// Values of f, 1/sr, by row, then column, then azimuth difference (if `turns` holds any), then
    /// band.
    pub values: Vec<f32>,
}

impl PairValues {
    /// Returns the number of values for each band.
    pub fn pairs(&self) -> usize {
        self.rows.len() * self.columns.len() * self.turns.as_ref().map_or(1, Vec::len)
    }
}

/// A part of the scattering function, prepared to be sampled from either end.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Part {
    rows: Basis,
    columns: Basis,
    sectors: Sectors,
    isotropic: bool,
    lanes: usize,
    values: Vec<f32>,
    /// Largest value in any band of each pair.
    largest: Vec<f32>,
    forward: End,
    backward: End,
}

/// Sums for paths that come from one end: for each function of that end, sums over the functions of
/// the other end and over the sectors.
#[derive(Clone, Debug, PartialEq)]
struct End {
    /// Running sums of the largest value in any band times the measure.
    running: Vec<f64>,
    /// Number of pairs of each function.
    width: usize,
    /// Sums of the values times the measure, for each function and band.
    albedo: Vec<f32>,
}

impl End {
    fn total(&self, function: usize) -> f64 {
        self.running[(function + 1) * self.width - 1]
    }
}

impl Part {
    /// Prepares a part from its values. Their number must be that of the pairs times that of the
    /// bands.
    pub(super) fn new(given: &PairValues, bands: usize) -> Self {
        let PairValues { rows, columns, turns, values } = given;
        let sectors = turns.as_ref().map_or(Sectors::full(), |turns| Sectors::between(turns));
        let largest = values.chunks(bands.max(1)).map(|f| f.iter().copied().fold(0.0, f32::max));
        let largest: Vec<f32> = largest.collect();
        let measures = |basis: &Basis| -> Vec<f64> {
            (0..basis.len()).map(|index| basis.measure(index)).collect()
        };
        let (of_rows, of_columns) = (measures(rows), measures(columns));
        let (r, c, s) = (rows.len(), columns.len(), sectors.len());
        let shares: Vec<f64> = (0..s).map(|sector| sectors.share(sector)).collect();
        let end =
            |functions: usize, others: &[f64], pair: &dyn Fn(usize, usize, usize) -> usize| {
                let width = others.len() * s;
                let mut running = Vec::with_capacity(functions * width);
                let mut albedo = vec![0.0; functions * bands];
                for function in 0..functions {
                    let mut sum = 0.0;
                    let mut of_bands = vec![0.0; bands];
                    for (other, measure) in others.iter().enumerate() {
                        for (sector, share) in shares.iter().enumerate() {
                            let pair = pair(function, other, sector);
                            let measure = measure * share;
                            sum += f64::from(largest[pair]) * measure;
                            running.push(sum);
                            for (of_band, f) in of_bands.iter_mut().zip(&values[pair * bands..]) {
                                *of_band += f64::from(*f) * measure;
                            }
                        }
                    }
                    for (albedo, sum) in albedo[function * bands..].iter_mut().zip(of_bands) {
                        *albedo = sum as f32;
                    }
                }
                End { running, width, albedo }
            };
        let forward = end(r, &of_columns, &|row, column, sector| (row * c + column) * s + sector);
        let backward = end(c, &of_rows, &|column, row, sector| (row * c + column) * s + sector);
        Self {
            rows: rows.clone(),
            columns: columns.clone(),
            isotropic: turns.is_some(),
            sectors,
            lanes: bands,
            values: values.clone(),
            largest,
            forward,
            backward,
        }
    }

    /// Pads the values per band with zeros to this number of lanes.
    pub(super) fn pad(&mut self, lanes: usize) {
        let pad = |values: &mut Vec<f32>, bands: usize| {
            let padded = values.chunks(bands).flat_map(|of_bands| {
                of_bands.iter().copied().chain(std::iter::repeat_n(0.0, lanes - bands))
            });
            *values = padded.collect();
        };
        if lanes > self.lanes {
            pad(&mut self.values, self.lanes);
            pad(&mut self.forward.albedo, self.lanes);
            pad(&mut self.backward.albedo, self.lanes);
            self.lanes = lanes;
        }
    }

    pub(super) fn rows(&self) -> &Basis {
        &self.rows
    }

    pub(super) fn columns(&self) -> &Basis {
        &self.columns
    }

    pub(super) fn lanes(&self) -> usize {
        self.lanes
    }

    pub(super) fn is_black(&self) -> bool {
        self.largest.iter().all(|&f| f == 0.0)
    }

    /// Returns the fraction that leaves in a band, of light that comes as the function `row`
    /// describes.
    pub(super) fn row_albedo(&self, row: usize, band: usize) -> f64 {
        self.forward.albedo[row * self.lanes + band].into()
    }

    /// Returns the fraction that leaves in a band, of light that goes the opposite way and comes as
    /// the function `column` describes.
    pub(super) fn column_albedo(&self, column: usize, band: usize) -> f64 {
        self.backward.albedo[column * self.lanes + band].into()
    }

    /// Visits every value that a pair of directions depends on, with its index and its weight.
    fn pairs(&self, from: Polar, to: Polar, mut visit: impl FnMut(usize, f32)) {
        let sector = self.sectors.find(to.phi - from.phi);
        let (rows, columns) = (self.rows.weights(from), self.columns.weights(to));
        for (row, of_row) in rows.list() {
            for (column, of_column) in columns.list() {
                let pair = (row * self.columns.len() + column) * self.sectors.len() + sector;
                visit(pair, of_row * of_column);
            }
        }
    }

    /// Returns the value of f in one band, 1/sr, for checks.
    pub(super) fn value(&self, from: Polar, to: Polar, band: usize) -> f64 {
        let mut sum = 0.0;
        self.pairs(from, to, |pair, weight| {
            sum += f64::from(weight) * f64::from(self.values[pair * self.lanes + band]);
        });
        sum
    }
}

/// A part as a path goes through it. The path comes from the `near` end and goes on at the `far`
/// end. A path that is followed backward meets light that comes from the far end. If only one side
/// of a sheet was measured, transmission from the other side is the measured part seen backward,
/// too.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    pub(super) part: &'a Part,
    pub(super) backward: bool,
}

impl View<'_> {
    fn end(&self) -> &End {
        if self.backward { &self.part.backward } else { &self.part.forward }
    }

    /// Returns the basis of the near end, then that of the far end.
    fn bases(&self) -> [&Basis; 2] {
        let Part { rows, columns, .. } = self.part;
        if self.backward { [columns, rows] } else { [rows, columns] }
    }

    /// Returns the integral over the far directions of the largest value in any band times the
    /// cosine.
    pub(super) fn total(&self, near: Polar) -> f32 {
        let end = self.end();
        let weights = self.bases()[0].weights(near);
        weights.list().iter().map(|&(i, weight)| weight * end.total(i) as f32).sum()
    }

    /// Returns the integral over the far directions of f times the cosine, per band.
    pub(super) fn albedo<L: Lanes>(&self, near: Polar) -> Spectrum<L> {
        let (end, lanes) = (self.end(), self.part.lanes);
        let weights = self.bases()[0].weights(near);
        Spectrum::from_fn(lanes, |b| {
            let list = weights.list().iter();
            list.map(|&(i, weight)| weight * end.albedo[i * lanes + b]).sum()
        })
    }

    fn ordered(&self, near: Polar, far: Polar) -> [Polar; 2] {
        if self.backward { [far, near] } else { [near, far] }
    }

    /// Returns f per band, 1/sr.
    pub(super) fn value<L: Lanes>(&self, near: Polar, far: Polar) -> Spectrum<L> {
        let Part { lanes, values, .. } = self.part;
        let mut sum = Spectrum::<L>::splat(*lanes, 0.0);
        let [from, to] = self.ordered(near, far);
        self.part.pairs(from, to, |pair, weight| {
            let values = &values[pair * lanes..];
            let sums = sum.0.values_mut().iter_mut().zip(values);
            sums.for_each(|(sum, f)| *sum += weight * f);
        });
        sum
    }

    /// Returns the weighted mean of the largest values in any band, 1/sr, over the pairs that f
    /// depends on. Directions are sampled in proportion to it.
    pub(super) fn largest(&self, near: Polar, far: Polar) -> f32 {
        let [from, to] = self.ordered(near, far);
        let mut sum = 0.0;
        self.part.pairs(from, to, |pair, weight| sum += weight * self.part.largest[pair]);
        sum
    }

    /// Draws a far direction with the density [`largest`](Self::largest) x cosine /
    /// [`total`](Self::total). Returns `None` where the total is 0.
    pub(super) fn sample(&self, near: Polar, rng: &mut Stream) -> Option<Polar> {
        let (end, [from, to]) = (self.end(), self.bases());
        let weights = from.weights(near);
        let chance = |&(i, weight): &(usize, f32)| weight * end.total(i) as f32;
        let total: f32 = weights.list().iter().map(chance).sum();
        if total <= 0.0 {
            return None;
        }
        // choose a function of the near end in proportion to its weight times the total of its
        // pairs
        let mut rest = rng.uniform() * total;
        let list = weights.list().iter().filter(|entry| chance(entry) > 0.0);
        let mut chosen = 0;
        for entry in list {
            chosen = entry.0;
            rest -= chance(entry);
            if rest < 0.0 {
                break;
            }
        }
        let running = &end.running[chosen * end.width..][..end.width];
        let pair = weighted_choice(running, rng.uniform_fine());
        let sectors = &self.part.sectors;
        let (other, sector) = (pair.index / sectors.len(), pair.index % sectors.len());
        let far = to.sample(other, rng);
        if !self.part.isotropic {
            return Some(far);
        }
        let turn = sectors.sample(sector, rng.uniform());
        let phi = if self.backward { near.phi - turn } else { near.phi + turn };
        Some(Polar { phi, ..far })
    }
}
