//! What the lights bring to some captors and groups.

use super::matrix::Matrix;
use crate::error::Result;

/// What the lights of a part bring to a block of ids: light by light, means and variances.
pub(super) struct Responses {
    width: usize,
    pub means: Vec<f64>,
    pub variances: Vec<f64>,
}

impl Responses {
    pub fn read(matrix: &Matrix, first: usize, width: usize) -> Result<Self> {
        let [mut means, mut variances] =
            [(); 2].map(|()| Vec::with_capacity(matrix.rows() * width));
        let mut row = vec![[0.0; 2]; width];
        for light in 0..matrix.rows() {
            matrix.read(light, first, &mut row)?;
            means.extend(row.iter().map(|&[mean, _]| f64::from(mean)));
            variances.extend(row.iter().map(|&[_, error]| f64::from(error).powi(2)));
        }
        Ok(Self { width, means, variances })
    }

    /// Returns the number of lights.
    pub fn lights(&self) -> usize {
        self.means.len().checked_div(self.width).unwrap_or(0)
    }

    pub fn means_of(&self, light: usize) -> &[f64] {
        &self.means[light * self.width..][..self.width]
    }

    pub fn variances_of(&self, light: usize) -> &[f64] {
        &self.variances[light * self.width..][..self.width]
    }

    /// Returns the means and the variances of some lights.
    pub fn of(&self, lights: &[usize]) -> [Vec<f64>; 2] {
        let means = lights.iter().flat_map(|&l| self.means_of(l)).copied().collect();
        let variances = lights.iter().flat_map(|&l| self.variances_of(l)).copied().collect();
        [means, variances]
    }
}
