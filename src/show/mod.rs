//! The display of light: pictures (`render`, `picture`), charts (`chart`), plots of results
//! (`plot`), the page for the browser (`view`) and files for other programs (`export`, with
//! `vtk`, `glb` and `ply`).
//!
//! Read `rendered` first, a scene with its light: the page and the exported files are made from
//! it. Pictures begin with `render`, and `picture` colours and writes them. Charts draw rows of
//! numbers; plots read results and no scene. Code that knows sweeps, studies or the command line
//! may not enter.

pub(crate) mod chart;
pub(crate) mod export;
pub(crate) mod glb;
pub(crate) mod picture;
pub(crate) mod plot;
pub(crate) mod ply;
pub(crate) mod render;
pub(crate) mod rendered;
pub(crate) mod view;
pub(crate) mod vtk;
pub(crate) mod xml;

pub use chart::{Chart, Series, Stroke, Width};
pub use export::{Colours, ExportFormat, check_export, write_export};
pub use glb::Shown;
pub use picture::{Legend, Picture, Scale};
pub use plot::PlotStyle;
pub use render::{
    FirstVisible, Fragments, Gather, Pixels, Sampling, Show, Viewpoint, painted, render,
};
pub use rendered::{RenderPlan, RenderStage, RenderedScene};
pub use view::{check_view, write_view};
pub use vtk::VtkKind;
