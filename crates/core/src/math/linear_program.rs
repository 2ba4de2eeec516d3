//! Linear programs: the least cost of what must reach a number of places.

/// Changes of the basis after which the search ends, whether it is at the minimum or not.
const STEPS: usize = 100_000;

/// Returns the x >= 0 with A x >= 1 in every row at the least cost c x, with costs of at least 0.
/// `None` where there is none, because a row of A has nothing above 0.
///
/// This is the simplex method (Dantzig 1951) for the dual, max Σ y with Aᵀ y <= c and y >= 0, for
/// which y = 0 is a start; x are the prices of its constraints. Where many bases are equally good,
/// Bland's rule (1977) ends the search.
pub fn least_cost(rows: &[Vec<f64>], costs: &[f64]) -> Option<Vec<f64>> {
    const TINY: f64 = 1e-11;
    let (n, m) = (rows.len(), costs.len());
    // a line for each x: its entries of A, then those of the slacks, then its cost
    let mut table: Vec<Vec<f64>> = (0..m)
        .map(|j| {
            let own = rows.iter().map(|row| row[j]);
            let slacks = (0..m).map(|k| if k == j { 1.0 } else { 0.0 });
            own.chain(slacks).chain([costs[j]]).collect()
        })
        .collect();
    let mut goal: Vec<f64> = [vec![-1.0; n], vec![0.0; m + 1]].concat();
    let mut basis: Vec<usize> = (n..n + m).collect();
    for step in 0..STEPS {
        let better = (0..n + m).filter(|&c| goal[c] < -TINY);
        let entering = match step < STEPS / 10 {
            true => better.min_by(|&a, &b| goal[a].total_cmp(&goal[b])),
            false => better.min(),
        };
        let Some(entering) = entering else {
            return Some(goal[n..n + m].iter().map(|price| price.max(0.0)).collect());
        };
        let bound = |line: usize| table[line][n + m] / table[line][entering];
        let leaving = (0..m)
            .filter(|&line| table[line][entering] > TINY)
            .min_by(|&a, &b| bound(a).total_cmp(&bound(b)).then(basis[a].cmp(&basis[b])))?;
        let pivot = table[leaving][entering];
        table[leaving].iter_mut().for_each(|entry| *entry /= pivot);
        let line = table[leaving].clone();
        let others = table.iter_mut().enumerate().filter(|(other, _)| *other != leaving);
        for other in others.map(|(_, other)| other).chain([&mut goal]) {
            let factor = other[entering];
            if factor != 0.0 {
                other.iter_mut().zip(&line).for_each(|(entry, own)| *entry -= factor * own);
            }
        }
        basis[leaving] = entering;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rng::Stream;

    #[test]
    fn known_programs() {
        // x + 2 y >= 1 and 3 x + y >= 1 at x + y: where both lines meet, (0.2, 0.4)
        let rows = vec![vec![1.0, 2.0], vec![3.0, 1.0]];
        let x = least_cost(&rows, &[1.0, 1.0]).unwrap();
        assert!((x[0] - 0.2).abs() < 1e-12 && (x[1] - 0.4).abs() < 1e-12, "{x:?}");
        // if y is dear, x alone does it
        let x = least_cost(&rows, &[1.0, 10.0]).unwrap();
        assert!((x[0] - 1.0).abs() < 1e-12 && x[1].abs() < 1e-12, "{x:?}");
        assert_eq!(least_cost(&[vec![0.0, 0.0]], &[1.0, 1.0]), None);
        assert_eq!(least_cost(&[], &[1.0]), Some(vec![0.0]));
        // equal rows and costs: any answer of the least cost
        let x = least_cost(&vec![vec![1.0, 1.0]; 5], &[2.0, 2.0]).unwrap();
        assert!((x[0] + x[1] - 1.0).abs() < 1e-12);
    }

    /// In 200 random programs (seed 5) every place has enough, and no random feasible point costs
    /// less.
    #[test]
    fn random_programs() {
        let mut rng = Stream::new(5, 0, 0);
        let mut uniform = || f64::from(rng.uniform());
        for _ in 0..200 {
            let rows: Vec<Vec<f64>> =
                (0..12).map(|_| (0..4).map(|_| 0.05 + uniform()).collect()).collect();
            let costs: Vec<f64> = (0..4).map(|_| 0.1 + uniform()).collect();
            let x = least_cost(&rows, &costs).unwrap();
            let least = |x: &[f64]| {
                let at = |row: &Vec<f64>| row.iter().zip(x).map(|(a, x)| a * x).sum::<f64>();
                rows.iter().map(at).fold(f64::INFINITY, f64::min)
            };
            let cost = |x: &[f64]| x.iter().zip(&costs).map(|(x, c)| x * c).sum::<f64>();
            assert!(least(&x) > 1.0 - 1e-9 && x.iter().all(|x| *x >= 0.0));
            for _ in 0..50 {
                let other: Vec<f64> = (0..4).map(|_| uniform()).collect();
                let scale = 1.0 / least(&other);
                assert!(cost(&other) * scale > cost(&x) - 1e-9);
            }
        }
    }
}
