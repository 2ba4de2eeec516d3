//! How strong the lights are in each hour and period, as matrices.

use ndarray::{ArrayView2, ArrayViewMut2, linalg::general_mat_mul};

use super::{hours::Period, part::Part, responses::Responses};

/// Lights that shine in at least one of this many hours are multiplied as a dense matrix.
const DENSE: usize = 4;

/// How strong the lights of a part are.
pub(super) struct Strengths {
    /// In each hour in which anything shines.
    pub hours: Table,
    /// In each period.
    pub periods: Table,
}

/// How strong lights are at some times: a row for each time.
pub(super) struct Table {
    /// Lights that shine at many of the times, and their strengths, row by row.
    pub dense: Vec<usize>,
    rows: Vec<f64>,
    /// For each time the other lights that shine.
    pub sparse: Vec<Vec<(usize, f64)>>,
}

impl Strengths {
    pub fn new(part: &Part, all: &[Period], slots: &[usize]) -> Self {
        let lights = part.responses.lights();
        let hours = slots.iter().map(|&slot| part.weights[slot].clone()).collect();
        let mut sums = vec![0.0; lights];
        let periods = all.iter().map(|period| {
            sums.fill(0.0);
            for &(slot, share) in &period.slots {
                part.weights[slot].iter().for_each(|&(l, weight)| sums[l] += share * weight);
            }
            let sums = sums.iter().copied().enumerate();
            sums.filter(|(_, strength)| *strength != 0.0).collect()
        });
        let periods = periods.collect();
        Self { hours: Table::new(lights, hours), periods: Table::new(lights, periods) }
    }
}

impl Table {
    fn new(lights: usize, mut times: Vec<Vec<(usize, f64)>>) -> Self {
        let mut counts = vec![0; lights];
        times.iter().flatten().for_each(|&(light, _)| counts[light] += 1);
        let dense: Vec<usize> =
            (0..lights).filter(|&l| DENSE * counts[l] >= times.len().max(1)).collect();
        let mut place = vec![None; lights];
        dense.iter().enumerate().for_each(|(i, &light)| place[light] = Some(i));
        let mut rows = vec![0.0; times.len() * dense.len()];
        for (time, lights) in times.iter_mut().enumerate() {
            lights.retain(|&(light, strength)| match place[light] {
                Some(place) => {
                    rows[time * dense.len() + place] += strength;
                    false
                }
                None => true,
            });
        }
        Self { dense, rows, sparse: times }
    }

    /// Returns the strengths of the dense lights at a time.
    pub fn row(&self, time: usize) -> &[f64] {
        &self.rows[time * self.dense.len()..][..self.dense.len()]
    }

    /// Returns the lights that shine at a time, and their strengths.
    pub fn of(&self, time: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let dense = self.dense.iter().copied().zip(self.row(time).iter().copied());
        dense.chain(self.sparse[time].iter().copied())
    }

    /// Returns the means and the variances of light at some times: those of the lights times their
    /// strengths, for each time and value of `responses`.
    pub fn times(&self, times: &[usize], responses: &Responses) -> [Vec<f64>; 2] {
        let width = responses.width();
        let mut found = [(); 2].map(|()| vec![0.0; times.len() * width]);
        let mut rows: Vec<f64> = times.iter().flat_map(|&t| self.row(t)).copied().collect();
        let size = [times.len(), self.dense.len(), width];
        let [means, variances] = &mut found;
        let [of_means, of_variances] = responses.of(&self.dense);
        add_product(size, &rows, &of_means, means);
        rows.iter_mut().for_each(|strength| *strength *= *strength);
        add_product(size, &rows, &of_variances, variances);
        for (at, &time) in times.iter().enumerate() {
            let at = at * width..(at + 1) * width;
            for &(light, strength) in &self.sparse[time] {
                add(&mut means[at.clone()], strength, responses.means_of(light));
                let variances = &mut variances[at.clone()];
                add(variances, strength * strength, responses.variances_of(light));
            }
        }
        found
    }
}

/// Adds some values times a factor to sums.
pub(super) fn add(sums: &mut [f64], factor: f64, values: &[f64]) {
    sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += factor * value);
}

/// Adds the product of two matrices, of `m` x `k` and `k` x `n` numbers row by row, to `out`.
fn add_product([m, k, n]: [usize; 3], a: &[f64], b: &[f64], out: &mut [f64]) {
    if m * k * n == 0 {
        return;
    }
    let views = (ArrayView2::from_shape((m, k), a), ArrayView2::from_shape((k, n), b));
    let (Ok(a), Ok(b), Ok(mut out)) = (views.0, views.1, ArrayViewMut2::from_shape((m, n), out))
    else {
        unreachable!("matrices of other sizes");
    };
    general_mat_mul(1.0, &a, &b, 1.0, &mut out);
}
