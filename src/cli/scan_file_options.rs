//! Options of commands that read scan files.

use mrol::console::{ScanReader, parse};
use mrol_files::DepthImages;
use mrol_map::scan::{Columns, Intrinsics};

/// Steps of a meter in depth images, where nobody says: millimeters.
const STEPS_PER_M: f64 = 1000.0;

/// What scan files do not say themselves.
#[derive(Debug, Clone, Default, clap::Args)]
pub(super) struct ScanFileOptions {
    /// What the columns of .xyz, .npy, .bin and .f32 files hold, such as "x y z i" [default: x y z, of .bin x y z i]
    #[arg(long, value_name = "NAMES")]
    pub(super) columns: Option<Columns>,
    /// Read depth images (.png, 16 bits), of a camera with these intrinsics, pixels: "fx fy cx cy". Points are in its
    /// optical frame
    #[arg(long, value_name = "INTRINSICS", allow_hyphen_values = true, conflicts_with = "columns")]
    pub(super) camera: Option<Intrinsics>,
    /// With --camera: steps of a meter in the images [default: 1000, millimeters; the sets of TUM and ICL-NUIM have
    /// 5000]
    #[arg(long, value_name = "STEPS", requires = "camera", value_parser = parse::depth_scale)]
    pub(super) depth_scale: Option<f64>,
}

impl ScanFileOptions {
    /// How scan files are read.
    pub(super) fn reader(&self) -> ScanReader {
        match self.camera {
            Some(intrinsics) => ScanReader::Depths(DepthImages {
                intrinsics,
                steps_per_m: self.depth_scale.unwrap_or(STEPS_PER_M),
            }),
            None => self.columns.into(),
        }
    }

    /// Refuses what is for scan files, where a log is read.
    #[cfg(feature = "logs")]
    pub(super) fn given(&self) -> [(&'static str, bool); 2] {
        [("--columns", self.columns.is_some()), ("--camera", self.camera.is_some())]
    }
}
