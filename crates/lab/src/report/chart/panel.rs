//! Curves in panels side by side.

use std::ops::Range;
use std::path::Path;

use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::element::DashedPathElement;
use plotters::prelude::*;

use super::drawing::{COLORS, LABEL_PX, MARGIN_PX, Outcome, SIZE_PX, TITLE_PX, drawn};
use crate::report::error::ReportError;

/// Lengths of a dash, of the gap after it, and of the piece of a curve beside its name.
const DASH_PX: i32 = 7;
const GAP_PX: i32 = 5;
const LEGEND_PX: i32 = 30;
/// Radius of the dots of a curve with few points, pixels.
const DOT_PX: i32 = 3;
/// Space above the values of a logarithmic axis for the legend, as a share of the values' range.
const NAMES_SHARE: f64 = 0.55;
/// Number of points below which each point of a curve is drawn as a dot.
const DOTS_BELOW: usize = 40;

/// A panel: curves over two axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// Title, drawn above the panel.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// Curves, drawn in this order.
    pub curves: Vec<Curve>,
}

/// An axis of a panel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// The quantity, with its unit.
    pub name: &'static str,
    /// How values are spread along it.
    pub scale: Scale,
}

/// How values are spread along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// Linear, from zero.
    Linear,
    /// Logarithmic, from the least value that is drawn; values are positive.
    Logarithmic,
}

/// A curve of one value against another.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Name in the legend.
    pub name: String,
    /// Index of the color; related curves have the same.
    pub color: usize,
    /// How the line is drawn.
    pub style: Style,
    /// Points of the curve, ascending by x.
    pub points: Vec<(f64, f64)>,
}

/// How a curve is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// A solid line.
    Solid,
    /// A dashed line, which can be seen on top of a solid curve where both coincide.
    Dashed,
}

/// Draws `panels` side by side, from left to right, as an SVG file.
///
/// # Errors
/// When the file cannot be written.
pub fn panels(path: &Path, panels: &[Panel]) -> Result<(), ReportError> {
    drawn(path, try_panels(path, panels))
}

fn try_panels(path: &Path, panels: &[Panel]) -> Outcome<()> {
    let wide = panels.len() > 1;
    // Panels that share a picture are narrower.
    let width_px = if wide { SIZE_PX.0 * 2 / 3 * panels.len() as u32 } else { SIZE_PX.0 };
    let root = SVGBackend::new(path, (width_px, SIZE_PX.1)).into_drawing_area();
    root.fill(&WHITE)?;
    for (area, panel) in root.split_evenly((1, panels.len())).iter().zip(panels) {
        let (x, y) =
            (panel.range(|point| point.0, panel.x.scale), panel.range(|point| point.1, panel.y.scale));
        match (panel.x.scale, panel.y.scale) {
            (Scale::Linear, Scale::Linear) => panel.draw(area, x, y)?,
            (Scale::Linear, Scale::Logarithmic) => panel.draw(area, x, with_room_for_names(y).log_scale())?,
            (Scale::Logarithmic, Scale::Linear) => panel.draw(area, x.log_scale(), y)?,
            (Scale::Logarithmic, Scale::Logarithmic) => {
                panel.draw(area, x.log_scale(), with_room_for_names(y).log_scale())?;
            }
        }
    }
    Ok(root.present()?)
}

/// A logarithmic range with space above the values for the legend.
fn with_room_for_names(values: Range<f64>) -> Range<f64> {
    values.start..values.end * (values.end / values.start).powf(NAMES_SHARE)
}

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

impl Panel {
    /// The range of values along an axis.
    fn range(&self, of: fn(&(f64, f64)) -> f64, scale: Scale) -> Range<f64> {
        let values = || self.curves.iter().flat_map(|curve| curve.points.iter().map(of));
        let most = values().fold(0.0, f64::max);
        match scale {
            // Never empty, so that no division by zero occurs.
            Scale::Linear => 0.0..if most > 0.0 { most * 1.05 } else { 1.0 },
            Scale::Logarithmic => {
                let least = values().filter(|value| *value > 0.0).fold(f64::INFINITY, f64::min);
                if least < most { least * 0.9..most * 1.1 } else { 0.5..2.0 }
            }
        }
    }

    fn draw<X, Y>(&self, area: &Area<'_>, x: X, y: Y) -> Outcome<()>
    where
        X: AsRangedCoord<Value = f64>,
        Y: AsRangedCoord<Value = f64>,
        X::CoordDescType: ValueFormatter<f64>,
        Y::CoordDescType: ValueFormatter<f64>,
    {
        let mut chart = ChartBuilder::on(area)
            .caption(&self.title, ("sans-serif", TITLE_PX))
            .margin(MARGIN_PX)
            .x_label_area_size(45)
            .y_label_area_size(65)
            .build_cartesian_2d(x, y)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .label_style(("sans-serif", LABEL_PX))
            .x_desc(self.x.name)
            .y_desc(self.y.name)
            .x_label_formatter(&|value| short(*value))
            .y_label_formatter(&|value| short(*value))
            .draw()?;
        for curve in &self.curves {
            let style = COLORS[curve.color % COLORS.len()].stroke_width(2);
            let points = || curve.points.iter().copied();
            let legend = |(x, y)| [(x, y), (x + LEGEND_PX, y)];
            let drawn = match curve.style {
                Style::Dashed => chart
                    .draw_series(DashedLineSeries::new(points(), DASH_PX, GAP_PX, style))?
                    .legend(move |at| DashedPathElement::new(legend(at), DASH_PX, GAP_PX, style)),
                Style::Solid => chart
                    .draw_series(LineSeries::new(points(), style))?
                    .legend(move |at| PathElement::new(legend(at), style)),
            };
            drawn.label(&curve.name);
            if curve.points.len() < DOTS_BELOW {
                chart.draw_series(points().map(|point| Circle::new(point, DOT_PX, style.filled())))?;
            }
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperLeft)
            .legend_area_size(LEGEND_PX + 6)
            .label_font(("sans-serif", LABEL_PX))
            .border_style(BLACK)
            .background_style(WHITE.mix(0.85))
            .draw()?;
        Ok(())
    }
}

/// Formats a number of an axis: `10 k`, `2.5 M`, `0.001`.
fn short(value: f64) -> String {
    // Ticks of an axis are sums: 0.30000000000000004 is printed as 0.3.
    let rounded = |value: f64| (value * 1e6).round() / 1e6;
    match value.abs() {
        n if n >= 1e6 => format!("{} M", rounded(value / 1e6)),
        n if n >= 1e4 => format!("{} k", rounded(value / 1e3)),
        _ => rounded(value).to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panel(title: &str, x: Scale, y: Scale) -> Panel {
        let curve = |name: &str, style| Curve {
            name: format!("{title}, {name}"),
            color: 0,
            style,
            points: vec![(1e4, 1.0), (1e6, 2.0), (5e7, 8.0)],
        };
        Panel {
            title: title.into(),
            x: Axis { name: "voxels", scale: x },
            y: Axis { name: "ns a point", scale: y },
            curves: vec![curve("one", Style::Solid), curve("two", Style::Dashed)],
        }
    }

    #[test]
    fn every_panel_curve_and_axis_has_its_name_in_the_plot() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("plot.svg");
        let scales = [Scale::Linear, Scale::Logarithmic];
        let all: Vec<_> = scales
            .iter()
            .flat_map(|&x| scales.iter().map(move |&y| panel(&format!("{x:?} {y:?}"), x, y)))
            .collect();
        panels(&path, &all).unwrap();
        let svg = std::fs::read_to_string(path).unwrap();
        for panel in &all {
            assert!(panel.curves.iter().all(|curve| svg.contains(&curve.name)) && svg.contains(&panel.title));
        }
        assert!(["voxels", "ns a point", "100 k", "10 M"].iter().all(|text| svg.contains(text)), "{svg}");
    }

    #[test]
    fn a_panel_without_a_value_is_drawn_too() {
        let folder = tempfile::tempdir().unwrap();
        let mut empty = panel("empty", Scale::Linear, Scale::Logarithmic);
        empty.curves.iter_mut().for_each(|curve| curve.points.clear());
        panels(&folder.path().join("plot.svg"), &[empty]).unwrap();
    }

    #[test]
    fn numbers_are_short() {
        assert_eq!([0.1 + 0.2, 5000.0, 25_000.0, 2.5e6].map(short), ["0.3", "5000", "25 k", "2.5 M"]);
    }
}
