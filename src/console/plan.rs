//! A plan: voxels from above.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::Path;

use super::error::CliError;
use mrol_map::voxel::VoxelKey;

/// Voxels of a plan in one color; those of later layers lie on those of earlier ones.
#[derive(Debug, Clone, Copy)]
pub struct PlanLayer<'a> {
    /// What they are, for the legend.
    pub name: &'a str,
    /// A color of CSS.
    pub color: &'a str,
    /// The voxels.
    pub voxels: &'a BTreeSet<VoxelKey>,
}

/// Side of a column of voxels in the picture, pixels.
const COLUMN_PX: i32 = 3;
/// Height of the legend, pixels.
const LEGEND_PX: i32 = 24;

/// Draws columns of voxels from above, x to the right and y up, as an SVG file.
///
/// # Errors
/// When the file cannot be written.
pub fn plan(path: &Path, layers: &[PlanLayer<'_>]) -> Result<(), CliError> {
    std::fs::write(path, svg(layers)).map_err(CliError::writing(path))
}

fn svg(layers: &[PlanLayer<'_>]) -> String {
    let columns: Vec<BTreeSet<[i32; 2]>> = layers
        .iter()
        .map(|layer| {
            let column = |voxel: &VoxelKey| {
                let [x, y, _] = voxel.index();
                [y, x]
            };
            layer.voxels.iter().map(column).collect()
        })
        .collect();
    let ends = |axis: usize| {
        let all = || columns.iter().flatten().map(move |column| column[axis]);
        (all().min().unwrap_or(0), all().max().unwrap_or(0))
    };
    let ((bottom, top), (left, right)) = (ends(0), ends(1));
    let (width, height) = ((right - left + 1) * COLUMN_PX, (top - bottom + 1) * COLUMN_PX + LEGEND_PX);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
         height=\"{height}\">\n<rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n"
    );
    let mut legend_px = 0;
    for (layer, columns) in layers.iter().zip(&columns) {
        let mut path = String::new();
        for [y, x] in columns {
            let (x, y) = ((x - left) * COLUMN_PX, LEGEND_PX + (top - y) * COLUMN_PX);
            // Writing to a string does not fail.
            let _ = write!(path, "M{x} {y}h{COLUMN_PX}v{COLUMN_PX}h-{COLUMN_PX}z");
        }
        let PlanLayer { name, color, .. } = layer;
        let _ = writeln!(svg, "<path fill=\"{color}\" d=\"{path}\"/>");
        let _ = writeln!(
            svg,
            "<text x=\"{}\" y=\"16\" font-family=\"sans-serif\" font-size=\"14\" fill=\"{color}\">{name}</text>",
            8 + legend_px
        );
        legend_px += 16 + 8 * name.len() as i32;
    }
    svg + "</svg>\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plan_has_a_square_for_each_column_with_y_up() {
        let voxels = |indices: &[[i32; 3]]| indices.iter().filter_map(|i| VoxelKey::new(*i)).collect();
        let (kept, gone) = (voxels(&[[0, 0, 0], [0, 0, 5], [2, 1, 0]]), voxels(&[[1, 1, 1]]));
        let svg = svg(&[
            PlanLayer { name: "kept", color: "gray", voxels: &kept },
            PlanLayer { name: "gone", color: "red", voxels: &gone },
        ]);
        assert_eq!(svg.matches("h3v3h-3z").count(), 3);
        assert!(svg.contains("M0 27h3v3") && svg.contains("M6 24h3v3"), "{svg}");
        assert!(svg.contains("fill=\"red\" d=\"M3 24h3v3"), "{svg}");
    }
}
