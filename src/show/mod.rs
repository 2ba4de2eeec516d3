//! Light to look at: pictures ([`render`], [`picture`]), charts ([`chart`]), plots of results ([`plot`]), the page for the browser
//! ([`view`]) and files for other programs ([`export`]). All but charts and plots begin with [`rendered`], a scene
//! with its results.

pub mod chart;
pub mod export;
pub mod glb;
pub mod picture;
pub mod plot;
pub mod ply;
pub mod render;
pub mod rendered;
pub mod view;
pub mod vtk;
