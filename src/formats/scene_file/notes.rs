//! What is told of a scene's materials.

/// What is told of a measured material.
#[derive(Clone, Debug, PartialEq)]
pub struct TableNote {
    /// JSON pointer of the material.
    pub pointer: String,
    /// Mean difference of f(i, o) and f(o, i) in its file, relative to their mean; of the worst band.
    pub reciprocity: f64,
}
