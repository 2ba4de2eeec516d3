//! What a person reads of scenes and results: the `summary` of a result, with the inputs that it
//! depends on (`dependence`), the description of a `scene` and the `comparison` of two results. They
//! are written for a [`Page`].

pub mod comparison;
mod dependence;
mod page;
mod polar;
pub mod scene;
pub mod summary;
pub mod table;

pub use page::{Page, in_digits, short, with_error};
