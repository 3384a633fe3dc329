//! The command `mrol import`.

use std::path::{Path, PathBuf};

use uuid::Uuid;

use super::imported::{Imported, ImportedLine};
use super::options::ImportOptions;
use super::{cloud, e57, las, npz, octree};
use mrol::console::{CliError, Output, check_is_no_input, place_of_map_file};
use mrol_files::FileKind;
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

/// Make a map of what another program mapped: .bt .ot .npz .ply .pcd .las .laz .e57
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Import {
    #[command(flatten)]
    options: ImportOptions,
    /// The map file to write
    #[arg(long, value_name = "FILE.mrol")]
    out: PathBuf,
}

impl Import {
    pub(crate) fn run(self, output: Output) -> Result<(), CliError> {
        check_folder(&self.out)?;
        check_is_no_input(&self.out, [self.options.file.as_path()])?;
        let place = place_of_map_file(&self.out)?;
        let kind =
            FileKind::of(&self.options.file).map(FileKind::checked).transpose().map_err(CliError::usage)?;
        let imported = match kind {
            Some(FileKind::Ply | FileKind::Pcd) | None => cloud::read(&self.options, &output),
            Some(FileKind::Bt | FileKind::Ot) => octree::read(&self.options, &output),
            Some(FileKind::Npz) => npz::read(&self.options, &output),
            Some(FileKind::Las | FileKind::Laz) => las::read(&self.options, &output),
            Some(FileKind::E57) => e57::read(&self.options, &output),
            Some(FileKind::Mcap) => {
                let file = self.options.file.display();
                Err(CliError::usage(format!("{file}: a log becomes a map by `mrol map {file}`")))
            }
        }?;
        if imported.contents.voxels.is_empty() {
            let file = self.options.file.display();
            return Err(CliError::failed(format!(
                "{file}: nothing in it is occupied: there is no map to write"
            )));
        }
        let line = ImportedLine::of(&self.out, &imported);
        let Imported { settings, contents } = imported;
        Snapshot { uuid: Uuid::new_v4(), settings, contents }.write(&Disk::default(), &place)?;
        output.print(&line)?;
        let out = self.out.display();
        output.say(format!("`mrol restore {out}` puts the map on a running server"))
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
