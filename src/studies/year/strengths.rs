//! How strong the lights are in each hour and period, as matrices.

use ndarray::{ArrayView2, ArrayViewMut2, linalg::general_mat_mul};

use super::{hours::Period, part::Part};

/// Lights that shine in at least one of this many hours are multiplied as a dense matrix.
const DENSE: usize = 4;

/// How strong the lights of a part are.
pub(super) struct Strengths {
    /// Lights that shine in many hours, and their strengths, hour by hour.
    pub dense: Vec<usize>,
    pub hours: Vec<f64>,
    /// For each slot the other lights that shine.
    pub sparse: Vec<Vec<(usize, f64)>>,
    /// For each period the strengths of all lights, and their squares.
    pub periods: Vec<f64>,
    pub squares: Vec<f64>,
}

impl Strengths {
    pub fn new(part: &Part, all: &[Period], slots: &[usize]) -> Self {
        let lights = part.responses.rows();
        let mut counts = vec![0; lights];
        part.weights.iter().flatten().for_each(|&(light, _)| counts[light] += 1);
        let dense: Vec<usize> =
            (0..lights).filter(|&l| DENSE * counts[l] >= slots.len().max(1)).collect();
        let mut place = vec![None; lights];
        dense.iter().enumerate().for_each(|(i, &light)| place[light] = Some(i));
        let mut hours = vec![0.0; slots.len() * dense.len()];
        let mut sparse = vec![Vec::new(); part.weights.len()];
        for (i, &slot) in slots.iter().enumerate() {
            for &(light, weight) in &part.weights[slot] {
                match place[light] {
                    Some(place) => hours[i * dense.len() + place] += weight,
                    None => sparse[slot].push((light, weight)),
                }
            }
        }
        let mut periods = vec![0.0; all.len() * lights];
        for (period, row) in all.iter().zip(periods.chunks_mut(lights.max(1))) {
            for &(slot, share) in &period.slots {
                part.weights[slot].iter().for_each(|&(l, weight)| row[l] += share * weight);
            }
        }
        let squares = periods.iter().map(|x| x * x).collect();
        Self { dense, hours, sparse, periods, squares }
    }
}

/// Adds the product of two matrices, of `m` x `k` and `k` x `n` numbers row by row, to `out`.
pub(super) fn add_product([m, k, n]: [usize; 3], a: &[f64], b: &[f64], out: &mut [f64]) {
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
