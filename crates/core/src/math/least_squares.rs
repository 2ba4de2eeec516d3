//! Least squares with parameters that may not be negative, from the normal equations.

/// A symmetric matrix, row by row.
pub type Matrix = Vec<Vec<f64>>;

/// Number of sweeps over all parameters after which the search ends, whether it has converged or
/// not.
const SWEEPS: usize = 20_000;

/// Minimises θᵀNθ/2 - cᵀθ over θ >= 0 by cyclic coordinate descent (Franc, Hlaváč and Navara,
/// "Sequential coordinate-wise algorithm for the non-negative least squares problem", CAIP 2005).
/// `normal` is N, positive semidefinite; `target` is c. The search starts from `theta`, and writes
/// the minimum there. In turn, each parameter takes its best value while the others are held; a
/// parameter on which nothing depends keeps its value.
pub fn nonnegative(normal: &Matrix, target: &[f64], theta: &mut [f64]) {
    for _ in 0..SWEEPS {
        let (mut change, mut size) = (0.0f64, 0.0f64);
        for (j, row) in normal.iter().enumerate() {
            if row[j] <= 0.0 {
                continue;
            }
            let slope: f64 = row.iter().zip(&*theta).map(|(n, t)| n * t).sum::<f64>() - target[j];
            let next = (theta[j] - slope / row[j]).max(0.0);
            change = change.max((next - theta[j]).abs());
            size = size.max(next);
            theta[j] = next;
        }
        if change <= 1e-13 * size {
            return;
        }
    }
}

/// Returns the inverse of a positive definite matrix, by Cholesky factorisation. `None` where the
/// matrix is singular to working precision.
pub fn inverse(matrix: &Matrix) -> Option<Matrix> {
    const SINGULAR: f64 = 1e-12;
    let n = matrix.len();
    let mut factor = vec![vec![0.0; n]; n];
    for i in 0..n {
        for j in 0..=i {
            let known: f64 = (0..j).map(|k| factor[i][k] * factor[j][k]).sum();
            let rest = matrix[i][j] - known;
            factor[i][j] = match i == j {
                true if rest > SINGULAR * matrix[i][i] => rest.sqrt(),
                true => return None,
                false => rest / factor[j][j],
            };
        }
    }
    let mut columns = vec![vec![0.0; n]; n];
    for (c, column) in columns.iter_mut().enumerate() {
        for i in 0..n {
            let known: f64 = (0..i).map(|k| factor[i][k] * column[k]).sum();
            column[i] = (f64::from(i == c) - known) / factor[i][i];
        }
        for i in (0..n).rev() {
            let known: f64 = (i + 1..n).map(|k| factor[k][i] * column[k]).sum();
            column[i] = (column[i] - known) / factor[i][i];
        }
    }
    Some(columns)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inverse_times_the_matrix_is_one() {
        let matrix = vec![vec![4.0, 2.0, 0.6], vec![2.0, 5.0, 1.0], vec![0.6, 1.0, 3.0]];
        let inverse = inverse(&matrix).unwrap();
        for (i, row) in matrix.iter().enumerate() {
            for j in 0..3 {
                let product: f64 = row.iter().zip(&inverse).map(|(a, b)| a * b[j]).sum();
                assert!((product - f64::from(i == j)).abs() < 1e-14);
            }
        }
        assert_eq!(super::inverse(&vec![vec![1.0, 1.0], vec![1.0, 1.0]]), None);
    }

    /// Within the bounds the minimum is the solution of the equations; at a bound it is the one
    /// that the conditions of Karush, Kuhn and Tucker determine.
    #[test]
    fn the_minimum_is_found_inside_and_at_a_bound() {
        let normal = vec![vec![2.0, 1.0], vec![1.0, 2.0]];
        let mut theta = [0.0; 2];
        nonnegative(&normal, &[4.0, 5.0], &mut theta);
        assert!((theta[0] - 1.0).abs() < 1e-12 && (theta[1] - 2.0).abs() < 1e-12);
        // without bounds the minimum would be at (-1, 2)
        nonnegative(&normal, &[0.0, 3.0], &mut theta);
        assert_eq!(theta[0], 0.0);
        assert!((theta[1] - 1.5).abs() < 1e-12);
        // a parameter on which nothing depends keeps its value
        let mut theta = [7.0, 1.0];
        nonnegative(&vec![vec![0.0, 0.0], vec![0.0, 2.0]], &[0.0, 6.0], &mut theta);
        assert_eq!(theta, [7.0, 3.0]);
    }
}
