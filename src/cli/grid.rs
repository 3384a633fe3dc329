//! `mrol grid`: draws a map from above, for the map server of ROS and Nav2.

use std::fmt;
use std::fmt::Display;
use std::fs;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::map_source::{MapSource, MapSourceOptions};
use super::scope::ScopeOptions;
use mrol::console::CliError;
use mrol::console::NewFile;
use mrol::console::Output;
use mrol::console::count;
use mrol::console::parse;
use mrol::offline::grid_of;
use mrol_client::Client;
use mrol_map::map::MapName;
use mrol_map::planning::{BandFrom, Grid, GridArea};
use mrol_service::{GridQuestion, GridScope};
use mrol_store::Snapshot;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol grid --map office --band \"0.1 1.8\" --out office.pgm        what a robot of 1.8 m on the floor can run into
  mrol grid --map office --band \"0.1 1.8\" --cell 0.1 --area \"0 0 10 8\" --out office.pgm
  mrol grid --map office --out office.pgm --unknown               free is only what scans saw through
  mrol grid --map office --band \"-1.6 0\" --band-from map --out office.pgm
  mrol grid hall.mrol --band \"0.1 1.8\" --out hall.pgm            of a map file, no server needed

The band counts from the floor: in each column of voxels from the top of those that the floor lies in. It is found below the poses
of the robots and followed from there, up and down ramps. What it does not reach, as the cells of a wall, has the floor of a cell
near it. What lies below it, such as stairs that lead down, is not drawn.

Writes the image and, beside it, office.yaml, which names it: both are what map_server of ROS 1 and nav2_map_server read. The
server draws large grids in tiles; if the map changes meanwhile, each tile is of a revision of its own.";

/// What names of descriptions end in.
const DESCRIPTION: &str = "yaml";
/// What names of images end in.
const IMAGE: &str = "pgm";

/// Draw a map from above, as a 2-D grid for Nav2
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct DrawGrid {
    #[command(flatten)]
    map: MapSourceOptions,
    /// Where to write the image, a PGM; the description gets the same name with .yaml
    #[arg(long, value_name = "FILE.pgm")]
    out: PathBuf,
    /// Lowest and highest height in meters: voxels count that reach between [default: all]
    #[arg(long, value_name = "Z Z", allow_hyphen_values = true, value_parser = parse::band)]
    band: Option<[f64; 2]>,
    /// What the band counts from: floor, or map for z = 0 of the map, where usually the first sensor was
    #[arg(long, value_name = "FROM", default_value = "floor", value_parser = parse::keyword::<BandFrom>())]
    band_from: BandFrom,
    /// The rectangle to draw: smallest and largest x y, meters [default: all that there is]
    #[arg(long, value_name = "X Y X Y", allow_hyphen_values = true, value_parser = parse::rectangle)]
    area: Option<GridArea>,
    /// Side of a cell, meters: a whole number of voxels [default: one voxel]
    #[arg(long, value_name = "METERS")]
    cell: Option<f64>,
    /// Tell unknown cells: those without a voxel are free only where scans saw through
    #[arg(long)]
    unknown: bool,
    #[command(flatten)]
    asked: ScopeOptions,
}

impl DrawGrid {
    pub(super) async fn run(self, output: Output) -> Result<(), CliError> {
        let Self { map, out, band, band_from, area, cell, unknown, asked } = self;
        check_is_image(&out)?;
        let band_m = band.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        let scope = GridScope {
            area: area.unwrap_or(GridArea::Occupied),
            band_m,
            band_from,
            cell_m: cell,
            tells_unknown: unknown,
        };
        let question = GridQuestion { asked: asked.scope(), scope };
        let (grid, voxel_m, revisions) = match map.open().await? {
            MapSource::File(snapshot) => drawn_of_file(*snapshot, &question)?,
            MapSource::Server(client, name) => drawn_of_server(&client, &name, question).await?,
        };
        if grid.cells() == 0 {
            let message =
                "the map has no voxel in this band: there is nothing to draw; give --area, or another --band";
            return Err(CliError::failed(message));
        }
        let description = write_files(&grid, &out)?;
        if grid.floor_m.is_some() {
            let voxel_m = voxel_m * f64::from(1 << question.asked.level);
            let low_m = 2.0 * voxel_m;
            output.note(format!(
                "what is lower than {low_m:.2} m above the floor, two voxels, may be taken for floor"
            ));
        }
        output.print(&Drawn::of(&grid, &out, &description, revisions))
    }
}

/// The grid of a map file, the side of its finest voxels in meters, and the revisions of its first and its last part.
type DrawnOf = (Grid, f64, [u64; 2]);

fn drawn_of_file(snapshot: Snapshot, question: &GridQuestion) -> Result<DrawnOf, CliError> {
    let (voxel_m, revision) = (snapshot.settings.resolution_m, snapshot.contents.revision);
    if question.asked.min_revision.is_some_and(|least| revision < least) {
        return Err(CliError::failed(format!(
            "the map file is of revision {revision}, before --min-revision"
        )));
    }
    Ok((grid_of(snapshot, question)?, voxel_m, [revision; 2]))
}

async fn drawn_of_server(
    client: &Client,
    name: &MapName,
    question: GridQuestion,
) -> Result<DrawnOf, CliError> {
    let (grid, versions) = client.whole_grid(name, question).await?;
    let voxel_m = client.map_info(name).await?.settings.resolution_m;
    Ok((grid, voxel_m, versions.map(|version| version.revision)))
}

/// Refuses an image of another format: `map_server` reads it by its name.
fn check_is_image(out: &Path) -> Result<(), CliError> {
    match out.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(IMAGE)) {
        true => Ok(()),
        false => Err(CliError::usage(format!(
            "--out {}: the image is a PGM, which map servers and image viewers read: name it {}; its description is written \
             beside it, as {}",
            out.display(),
            out.with_extension(IMAGE).display(),
            out.with_extension(DESCRIPTION).display()
        ))),
    }
}

/// Writes the image and its description, whose path is returned. Both are whole before one of them is put in its place.
fn write_files(grid: &Grid, image: &Path) -> Result<PathBuf, CliError> {
    let name = image.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let description = image.with_extension(DESCRIPTION);
    let (drawn, described) = (NewFile::at(image)?, NewFile::at(&description)?);
    fs::write(drawn.path(), grid.to_pgm()).map_err(|problem| drawn.failed(problem))?;
    fs::write(described.path(), grid.to_yaml(&name)).map_err(|problem| described.failed(problem))?;
    drawn.keep()?;
    described.keep()?;
    Ok(description)
}

fn ones(words: &[u64]) -> usize {
    words.iter().map(|word| word.count_ones() as usize).sum()
}

#[derive(Serialize)]
struct Drawn {
    image: String,
    description: String,
    size: [usize; 2],
    cell_m: f64,
    origin_m: [f64; 2],
    cells_occupied: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    cells_free: Option<usize>,
    /// The lowest and the highest floor, in the map frame, where the band counts from it.
    #[serde(skip_serializing_if = "Option::is_none")]
    floor_m: Option<[f64; 2]>,
    /// Of the first tile.
    revision_first: u64,
    /// Of the last tile.
    revision: u64,
}

impl Drawn {
    fn of(grid: &Grid, image: &Path, description: &Path, [revision_first, revision]: [u64; 2]) -> Self {
        Self {
            image: image.display().to_string(),
            description: description.display().to_string(),
            size: grid.size,
            cell_m: grid.cell_m,
            origin_m: grid.origin_m,
            cells_occupied: ones(&grid.occupied),
            cells_free: grid.free.as_deref().map(ones),
            floor_m: grid.floor_m,
            revision_first,
            revision,
        }
    }
}

impl Display for Drawn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ([width, height], occupied) = (self.size, count(self.cells_occupied));
        write!(
            f,
            "{} and {}: {width} x {height} cells of {} m, ",
            self.image, self.description, self.cell_m
        )?;
        match self.cells_free {
            Some(free) => write!(f, "{occupied} of them occupied and {} free", count(free))?,
            None => write!(f, "{occupied} of them occupied")?,
        }
        if let Some([low_m, high_m]) = self.floor_m {
            write!(f, ", floor from {low_m:.2} to {high_m:.2} m of the map")?;
        }
        match self.revision_first == self.revision {
            true => write!(f, ", at revision {}", self.revision),
            false => write!(f, ", at revisions {} to {}", self.revision_first, self.revision),
        }
    }
}
