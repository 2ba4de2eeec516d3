//! The display of light: pictures (`render`, `picture`), charts (`chart`), plots of results
//! (`plot`), the page for the browser (`view`) and files for other programs (`export`, with
//! `vtk`, `glb` and `ply`).
//!
//! Read `rendered` first, a scene with its light: the page and the exported files are made from
//! it. Pictures begin with `render`, and `picture` colours and writes them. Charts draw rows of
//! numbers; plots read results and no scene. Code that knows sweeps, studies or the command line
//! may not enter.

#![deny(unsafe_code)]

pub mod chart;
pub mod export;
pub mod following;
pub mod glb;
mod inputs;
pub mod kinds;
pub mod picture;
pub mod plot;
pub mod ply;
pub mod render;
pub mod rendered;
pub mod view;
pub mod vtk;
pub mod xml;

pub use chart::{Chart, Series, Stroke, Width};
pub use export::{Colours, ExportFormat, check_export, write_export};
pub use following::{Followed, Following};
pub use glb::Shown;
pub use picture::{Legend, Picture, Scale};
pub use plot::{
    Plot, PlotKind, PlotStyle, YearPlotKind,
    job::{PlotJob, PlotLight, PlotWhat},
};
pub use render::{
    FirstVisible, Fragments, Gather, Pixels, Sampling, Show, Viewpoint, painted, render,
};
pub use rendered::{RenderPlan, RenderStage, RenderedScene};
pub use view::{YearLight, check_view, write_view};
pub use vtk::VtkKind;
