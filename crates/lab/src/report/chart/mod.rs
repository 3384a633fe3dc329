//! Plots as SVG.

mod box_plot;
mod drawing;
mod panel;

pub use box_plot::box_plot;
pub use panel::{Axis, Curve, Panel, Scale, Style, panels};
