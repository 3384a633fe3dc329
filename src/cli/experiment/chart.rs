//! Plots as SVG.

use std::path::Path;

use plotters::element::DashedPathElement;
use plotters::prelude::*;

use super::spread::Spread;
use crate::bench::stages::Stage;
use crate::cli::error::CliError;

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

const SIZE_PX: (u32, u32) = (900, 480);
const TITLE_PX: i32 = 18;
const LABEL_PX: i32 = 14;
const MARGIN_PX: i32 = 12;
/// Lengths of a dash, of the gap after it, and of the piece of a curve beside its name.
const DASH_PX: i32 = 7;
const GAP_PX: i32 = 5;
const LEGEND_PX: i32 = 30;
/// Half the height of a box, as wide as it is on its line.
const HALF_BOX_PX: i32 = 10;
/// Colours that can be told apart by those who do not see all of them, and in print.
const COLOURS: [RGBColor; 4] =
    [RGBColor(0, 114, 178), RGBColor(213, 94, 0), RGBColor(0, 158, 115), RGBColor(204, 121, 167)];

fn drawn(path: &Path, outcome: Outcome<()>) -> Result<(), CliError> {
    outcome.map_err(|error| CliError::failed(format!("{}: cannot be drawn: {error}", path.display())))
}

/// A box with whiskers for each stage, the first at the bottom, as in Fig. 1 of the paper.
pub(super) fn box_plot(path: &Path, title: &str, stages: &[Stage]) -> Result<(), CliError> {
    drawn(path, try_box_plot(path, title, stages))
}

fn try_box_plot(path: &Path, title: &str, stages: &[Stage]) -> Outcome<()> {
    let names: Vec<&str> = stages.iter().map(|stage| stage.name).collect();
    let runs = || stages.iter().flat_map(|stage| stage.runs.ns_per_item()).copied();
    let (fastest, slowest) = (runs().fold(f64::MAX, f64::min), runs().fold(0.0, f64::max));
    let root = SVGBackend::new(path, SIZE_PX).into_drawing_area();
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .caption(title, ("sans-serif", TITLE_PX))
        .margin(MARGIN_PX)
        .x_label_area_size(45)
        .y_label_area_size(270)
        // The set intersection takes twenty times as long as the filter: both are to be seen.
        .build_cartesian_2d(
            ((fastest * 0.8) as f32..(slowest * 1.2) as f32).log_scale(),
            names[..].into_segmented(),
        )?;
    chart
        .configure_mesh()
        .disable_y_mesh()
        .light_line_style(BLACK.mix(0.08))
        .label_style(("sans-serif", LABEL_PX))
        .x_desc("ns a point")
        .x_label_formatter(&|ns| format!("{ns}"))
        .y_label_formatter(&|stage| segment_name(stage))
        .draw()?;
    for (stage, name) in stages.iter().zip(&names) {
        let Some(spread) = Spread::of(stage.runs.ns_per_item()) else { continue };
        let (colour, y) = (colour_of(stage.name), SegmentValue::CenterOf(name));
        let at = |ns: f64| (ns as f32, y.clone());
        let across = |ns: f64, half: i32| {
            EmptyElement::at(at(ns)) + PathElement::new([(0, -half), (0, half)], colour.stroke_width(2))
        };
        let [first, median, third] = spread.quartiles;
        chart.draw_series([
            PathElement::new([at(spread.low), at(spread.high)], colour.stroke_width(2)),
            // Hides the whisker behind the box.
            PathElement::new([at(first), at(third)], WHITE.stroke_width(2 * HALF_BOX_PX as u32)),
            PathElement::new([at(first), at(third)], colour.mix(0.4).stroke_width(2 * HALF_BOX_PX as u32)),
        ])?;
        chart.draw_series([
            across(spread.low, HALF_BOX_PX / 2),
            across(spread.high, HALF_BOX_PX / 2),
            across(median, HALF_BOX_PX),
        ])?;
        chart.draw_series(spread.outliers.iter().map(|&ns| Circle::new(at(ns), 3, colour)))?;
    }
    Ok(root.present()?)
}

fn segment_name(segment: &SegmentValue<&&str>) -> String {
    match segment {
        SegmentValue::Exact(name) | SegmentValue::CenterOf(name) => (**name).to_owned(),
        SegmentValue::Last => String::new(),
    }
}

/// One colour a structure.
fn colour_of(stage: &str) -> RGBColor {
    let structures = ["Bloom filter", "dense array", "hash table"];
    let colour = structures.iter().position(|structure| stage.ends_with(structure));
    colour.map_or(BLACK, |colour| COLOURS[colour])
}

/// Cost at several sizes.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Curve {
    pub(super) name: String,
    /// Curves of one colour belong together.
    pub(super) colour: usize,
    pub(super) dashed: bool,
    /// (voxels, nanoseconds a point), voxels ascending.
    pub(super) points: Vec<(f64, f64)>,
}

/// Curves over a logarithmic axis of voxels.
pub(super) fn curves(path: &Path, title: &str, curves: &[Curve]) -> Result<(), CliError> {
    drawn(path, try_curves(path, title, curves))
}

fn try_curves(path: &Path, title: &str, curves: &[Curve]) -> Outcome<()> {
    let all = || curves.iter().flat_map(|curve| curve.points.iter().copied());
    let (few, many, slowest) = all().fold((f64::INFINITY, 1.0f64, 1.0f64), |(few, many, slowest), point| {
        (few.min(point.0), many.max(point.0), slowest.max(point.1))
    });
    let root = SVGBackend::new(path, SIZE_PX).into_drawing_area();
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .caption(title, ("sans-serif", TITLE_PX))
        .margin(MARGIN_PX)
        .x_label_area_size(45)
        .y_label_area_size(55)
        .build_cartesian_2d((few * 0.9..many * 1.1).log_scale(), 0.0..slowest * 1.05)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .label_style(("sans-serif", LABEL_PX))
        .x_desc("voxels")
        .y_desc("ns a point")
        .x_label_formatter(&|voxels| short_count(*voxels))
        .y_label_formatter(&|ns| format!("{ns:.0}"))
        .draw()?;
    for curve in curves {
        let style = COLOURS[curve.colour % COLOURS.len()].stroke_width(2);
        let (points, legend) = (curve.points.iter().copied(), |(x, y)| [(x, y), (x + LEGEND_PX, y)]);
        let drawn = if curve.dashed {
            let series = chart.draw_series(DashedLineSeries::new(points, DASH_PX, GAP_PX, style))?;
            series.legend(move |at| DashedPathElement::new(legend(at), DASH_PX, GAP_PX, style))
        } else {
            chart
                .draw_series(LineSeries::new(points, style))?
                .legend(move |at| PathElement::new(legend(at), style))
        };
        drawn.label(&curve.name);
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperLeft)
        .legend_area_size(LEGEND_PX + 6)
        .label_font(("sans-serif", LABEL_PX))
        .border_style(BLACK)
        .background_style(WHITE)
        .draw()?;
    Ok(root.present()?)
}

/// `10 k`, `2.5 M`.
fn short_count(n: f64) -> String {
    match n {
        n if n >= 1e6 => format!("{} M", n / 1e6),
        n if n >= 1e3 => format!("{} k", n / 1e3),
        n => n.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::stages::STAGES;
    use crate::bench::stopwatch::Runs;

    #[test]
    fn every_stage_has_its_name_in_the_plot() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("plot.svg");
        let stages = STAGES.map(|name| {
            let mut runs = Runs::default();
            (0..10).for_each(|_| runs.time(1, || ()));
            Stage { name, runs }
        });
        box_plot(&path, "a title", &stages).unwrap();
        let svg = std::fs::read_to_string(path).unwrap();
        assert!(STAGES.iter().chain(&["a title", "ns a point"]).all(|text| svg.contains(text)), "{svg}");
    }

    #[test]
    fn every_curve_has_its_name_in_the_plot() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("plot.svg");
        let curve = |name: &str, dashed| Curve {
            name: name.into(),
            colour: 0,
            dashed,
            points: vec![(1e4, 1.0), (1e6, 2.0), (5e7, 8.0)],
        };
        curves(&path, "a title", &[curve("bloom, random", false), curve("bloom, scan", true)]).unwrap();
        let svg = std::fs::read_to_string(path).unwrap();
        for text in ["a title", "bloom, random", "bloom, scan", "100 k", "10 M"] {
            assert!(svg.contains(text), "{text}: {svg}");
        }
    }
}
