//! The command `mrol import`.

use std::path::{Path, PathBuf};

use uuid::Uuid;

use super::imported::{Imported, ImportedLine};
use super::{cloud, e57, las, npz, octree};
use mrol::console::{CliError, OriginChoice, Output, parse};
use mrol_files::FileKind;
use mrol_map::map::{LEVELS_DEFAULT, MapOrigin, MapSettings};
use mrol_map::scan::Columns;
use mrol_store::{Disk, Snapshot};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol import building.bt --out building.mrol                 an octree of OctoMap: its occupied cells
  mrol import building.bt --resolution 0.16 --out coarse.mrol     two of its cells a voxel
  mrol import hall.npz --out hall.mrol                        arrays of numpy, as `mrol export` writes them
  mrol import hall.ply --resolution 0.1 --out hall.mrol       a point cloud in the map frame
  mrol import site.pcd --resolution 0.1 --origin auto --out site.mrol      in the coordinates of a survey
  mrol import site.laz --resolution 0.1 --origin auto --out site.mrol      a survey, and so of .las
  mrol import site.e57 --resolution 0.1 --origin auto --out site.mrol      its scans, and what they saw through

Points become the voxels that they fall in, occupied cells the voxels that they are. Free cells and probabilities are left
out: a map knows free space by what its scans saw through, and this one is at revision 1 without scans, but for one of an
.e57 file. `mrol restore` puts it on a running server, where robots localize in it and add to it.";

/// How many levels coarser than its file a map may be.
const COARSER_MAX: u32 = 15;
/// How far a resolution that is asked for may lie from one that a map has, as a share of it.
const SIDE_ERROR_MAX: f64 = 1e-6;

/// Make a map of what another program mapped: .bt .ot .npz .ply .pcd .las .laz .e57
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Import {
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
    /// The map file to write
    #[arg(long, value_name = "FILE.mrol")]
    out: PathBuf,
    /// Where the map's origin lies in the coordinates of points: "x y z", or auto for the first point. It is subtracted
    /// from them in double precision, and kept in the map
    #[arg(long, value_name = "ORIGIN", allow_hyphen_values = true, value_parser = parse::origin)]
    pub(super) origin: Option<OriginChoice>,
    /// What the columns of .xyz, .npy, .bin and .f32 files hold, such as "x y z i" [default: x y z, of .bin x y z i]
    #[arg(long, value_name = "NAMES")]
    pub(super) columns: Option<Columns>,
    /// Take the scans of an .e57 file as points alone [default: where each scan has a pose, it is a scan of the map,
    /// and what it saw through is free]
    #[arg(long)]
    pub(super) as_points: bool,
}

impl Import {
    pub(crate) fn run(self, output: Output) -> Result<(), CliError> {
        check_folder(&self.out)?;
        let kind = FileKind::of(&self.file).map(FileKind::checked).transpose().map_err(CliError::usage)?;
        let imported = match kind {
            Some(FileKind::Ply | FileKind::Pcd) | None => cloud::read(&self, &output),
            Some(FileKind::Bt | FileKind::Ot) => octree::read(&self, &output),
            Some(FileKind::Npz) => npz::read(&self, &output),
            Some(FileKind::Las | FileKind::Laz) => las::read(&self, &output),
            Some(FileKind::E57) => e57::read(&self, &output),
        }?;
        if imported.contents.voxels.is_empty() {
            let file = self.file.display();
            return Err(CliError::failed(format!(
                "{file}: nothing in it is occupied: there is no map to write"
            )));
        }
        let line = ImportedLine::of(&self.out, &imported);
        let Imported { settings, contents } = imported;
        Snapshot { uuid: Uuid::new_v4(), settings, contents }.write(&Disk::default(), &self.out)?;
        output.print(&line)?;
        let out = self.out.display();
        output.say(format!("`mrol restore {out}` puts the map on a running server"))
    }

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

/// Checks that the folder of an output file exists, so that a long run does not fail at its end.
fn check_folder(path: &Path) -> Result<(), CliError> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match folder.is_dir() {
        true => Ok(()),
        false => {
            let (path, folder) = (path.display(), folder.display());
            Err(CliError::failed(format!("{path}: there is no folder {folder}: make it first")))
        }
    }
}
