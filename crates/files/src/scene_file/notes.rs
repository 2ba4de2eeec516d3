//! What a check of a scene tells about its measured materials.

/// How far a material that was measured as a scattering function f is from reciprocity.
#[derive(Clone, Debug, PartialEq)]
pub struct TableNote {
    /// JSON pointer of the material.
    pub pointer: String,
    /// Mean of |f(i, o) - f(o, i)| in the material's file over the mean of f, in the band where
    /// this is largest.
    pub reciprocity: f64,
}
