//! Box plots with whiskers, as in Fig. 1 of the paper.

use std::path::Path;

use plotters::prelude::*;

use super::drawing::{COLORS, LABEL_PX, MARGIN_PX, Outcome, SIZE_PX, TITLE_PX, drawn};
use crate::experiment::stages::Stage;
use crate::report::error::ReportError;
use crate::report::spread::Spread;

/// Half the height of a box, pixels.
const HALF_BOX_PX: i32 = 10;

/// Draws a box with whiskers for each stage, the first at the bottom, with an axis in nanoseconds a point.
///
/// # Errors
/// When the file cannot be written.
pub fn box_plot(path: &Path, title: &str, stages: &[Stage]) -> Result<(), ReportError> {
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
        // Logarithmic, since the set intersection takes twenty times as long as the filter.
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
        let (color, y) = (color_of(stage.name), SegmentValue::CenterOf(name));
        let at = |ns: f64| (ns as f32, y.clone());
        let across = |ns: f64, half: i32| {
            EmptyElement::at(at(ns)) + PathElement::new([(0, -half), (0, half)], color.stroke_width(2))
        };
        let [first, median, third] = spread.quartiles;
        chart.draw_series([
            PathElement::new([at(spread.low), at(spread.high)], color.stroke_width(2)),
            // Hides the part of the whisker behind the box.
            PathElement::new([at(first), at(third)], WHITE.stroke_width(2 * HALF_BOX_PX as u32)),
            PathElement::new([at(first), at(third)], color.mix(0.4).stroke_width(2 * HALF_BOX_PX as u32)),
        ])?;
        chart.draw_series([
            across(spread.low, HALF_BOX_PX / 2),
            across(spread.high, HALF_BOX_PX / 2),
            across(median, HALF_BOX_PX),
        ])?;
        chart.draw_series(spread.outliers.iter().map(|&ns| Circle::new(at(ns), 3, color)))?;
    }
    Ok(root.present()?)
}

fn segment_name(segment: &SegmentValue<&&str>) -> String {
    match segment {
        SegmentValue::Exact(name) | SegmentValue::CenterOf(name) => (**name).to_owned(),
        SegmentValue::Last => String::new(),
    }
}

/// Color of a stage: one for each structure.
fn color_of(stage: &str) -> RGBColor {
    let structures = ["Bloom filter", "dense array", "hash table"];
    let color = structures.iter().position(|structure| stage.ends_with(structure));
    color.map_or(BLACK, |color| COLORS[color])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::stages::STAGES;
    use crate::measure::stopwatch::Runs;

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
}
