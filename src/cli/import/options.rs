//! What the commands' options say of a file that becomes a map.

use std::path::PathBuf;

use mrol::console::{CliError, OriginChoice, parse};
use mrol_map::map::{LEVELS_DEFAULT, MapOrigin, MapSettings};
use mrol_map::scan::Columns;

/// How many levels coarser than its file a map may be.
const COARSER_MAX: u32 = 15;
/// How far a resolution that is asked for may lie from one that a map has, as a share of it.
const SIDE_ERROR_MAX: f64 = 1e-6;

#[derive(Debug, clap::Args)]
pub(super) struct ImportOptions {
    /// The file to read; its extension says what it holds
    #[arg(value_name = "FILE")]
    pub(super) file: PathBuf,
    /// Side of a finest voxel, meters: needed for points. Of a file of voxels as wide as those, or 2, 4, 8 and so on
    /// times as wide [default: as wide as the file's voxels]
    #[arg(long, value_name = "METERS")]
    pub(super) resolution: Option<f64>,
    /// Number of levels, each twice as coarse as the one before: 1 to 12
    #[arg(long, default_value_t = LEVELS_DEFAULT)]
    pub(super) levels: u32,
    /// Where the map's origin lies in the coordinates of points: "x y z", or auto for the first point. It is subtracted
    /// from them in double precision, and kept in the map
    #[arg(long, value_name = "ORIGIN", allow_hyphen_values = true, value_parser = parse::origin)]
    pub(super) origin: Option<OriginChoice>,
    /// What the columns of .xyz, .npy, .bin and .f32 files hold, such as "x y z i" [default: x y z, of .bin x y z i]
    #[arg(long, value_name = "NAMES")]
    pub(super) columns: Option<Columns>,
}

impl ImportOptions {
    /// Settings of a map of voxels of `resolution_m`.
    ///
    /// # Errors
    /// When a setting is out of range.
    pub(super) fn settings(
        &self,
        resolution_m: f64,
        origin: Option<MapOrigin>,
    ) -> Result<MapSettings, CliError> {
        let settings = MapSettings { origin, ..MapSettings::new(resolution_m, self.levels) };
        settings.checked().map_err(CliError::usage)
    }

    /// Side of a finest voxel, which a file of points does not say.
    pub(super) fn resolution_of_points(&self) -> Result<f64, CliError> {
        self.resolution.ok_or_else(|| {
            CliError::usage(
                "--resolution METERS is needed: a file of points does not say how large voxels are",
            )
        })
    }

    /// Side of a finest voxel of a map of a file whose voxels are `side_m` wide, and how many levels coarser that is.
    ///
    /// # Errors
    /// When the resolution that is asked for is not `side_m` times a power of two.
    pub(super) fn resolution_of_voxels(&self, side_m: f64) -> Result<(f64, u32), CliError> {
        let Some(asked_m) = self.resolution else { return Ok((side_m, 0)) };
        let coarser = (0..=COARSER_MAX).find(|&coarser| {
            let resolution_m = side_m * f64::from(1_u32 << coarser);
            (resolution_m - asked_m).abs() <= resolution_m * SIDE_ERROR_MAX
        });
        let coarser = coarser.ok_or_else(|| {
            CliError::usage(format!(
                "--resolution: the file's voxels are {side_m} m wide, and those of the map are as wide, or 2, 4, 8 and so \
                 on times as wide, got {asked_m}; without --resolution they are as wide"
            ))
        })?;
        Ok((side_m * f64::from(1_u32 << coarser), coarser))
    }

    /// Refuses options that a file of voxels has no use for.
    pub(super) fn refuse_options_of_points(&self) -> Result<(), CliError> {
        let given = [("--origin", self.origin.is_some()), ("--columns", self.columns.is_some())];
        match given.into_iter().find(|(_, is_given)| *is_given) {
            Some((option, _)) => {
                let file = self.file.display();
                Err(CliError::usage(format!("{option}: for files of points, and {file} has voxels")))
            }
            None => Ok(()),
        }
    }
}
