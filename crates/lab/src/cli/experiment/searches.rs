//! `mrol-lab experiment searches`: whether robots of which nothing is known are found, and what that takes.

use std::fmt::{self, Display};

use serde::Serialize;

use super::set_option::SetOption;
use crate::experiment::verdicts::{KindOfSearch, MapOf, Searches, Set};
use mrol::console::error::CliError;
use mrol::console::output::Output;

const EXAMPLES: &str = "\
EXAMPLES:
  mrol-lab experiment searches hall/:0.1:hall
  mrol-lab experiment searches hall/:0.1:hall street/:0.2:street --scans 12 --resolutions 28

Each argument is a folder of scans with poses.txt (a TUM file, line k for scan k), the side of a voxel, and the name of the
place. Its scans are searched for, with no guess, in maps of one, two and half of them: with the direction down known and with
all orientations, down to search voxels of so many a range. A place is right within two voxels and two degrees.";

/// Whether scans are found with no guess, and what that takes
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct SearchExperiment {
    /// Sets of scans
    #[arg(value_name = "DIR:RESOLUTION:PLACE", required = true)]
    sets: Vec<SetOption>,
    /// Scans of a set that are looked at, evenly chosen
    #[arg(long, value_name = "N", default_value_t = 12)]
    scans: usize,
    /// Finest search voxels within a scan's range, coarse searches first
    #[arg(long, value_name = "N", value_delimiter = ',', default_values_t = [28.0, 56.0])]
    resolutions: Vec<f64>,
}

impl SearchExperiment {
    pub(super) fn run(self, output: &Output) -> Result<(), CliError> {
        let sets: Vec<Set> =
            self.sets.iter().map(|set| set.read(self.scans, output)).collect::<Result<_, _>>()?;
        let kinds: Vec<KindOfSearch> = [true, false]
            .into_iter()
            .flat_map(|knows_down| {
                let kind = move |&resolutions_per_range| KindOfSearch { resolutions_per_range, knows_down };
                self.resolutions.iter().map(kind)
            })
            .collect();
        output.say(Line::HEAD)?;
        let bar = output.clone().with_bar_of(sets.len() * MapOf::ALL.len() * kinds.len(), "tables");
        for set in &sets {
            for which in MapOf::ALL {
                let Some(trials) = set.trials(which) else { continue };
                for kind in &kinds {
                    let searches = trials.search(*kind).map_err(CliError::failed)?;
                    bar.step();
                    bar.print(&Line::of(set, which, *kind, &searches))?;
                }
            }
        }
        bar.clear_bar();
        Ok(())
    }
}

/// What came of the searches of one kind.
#[derive(Serialize)]
struct Line {
    set: String,
    map: &'static str,
    knows_down: bool,
    resolutions_per_range: f64,
    searches: usize,
    right_accepted: usize,
    right_refused: usize,
    wrong_accepted: usize,
    not_found: usize,
    median_s: f64,
    longest_s: f64,
    longest_cells: u64,
}

impl Line {
    const HEAD: &str =
        "searches  right: accepted  refused  wrong  not found  median s  longest s   M cells  what";

    fn of(set: &Set, which: MapOf, kind: KindOfSearch, searches: &Searches) -> Self {
        let Searches { outcomes, cells } = searches;
        Self {
            set: set.name.clone(),
            map: which.as_str(),
            knows_down: kind.knows_down,
            resolutions_per_range: kind.resolutions_per_range,
            searches: outcomes.alignments(),
            right_accepted: outcomes.right,
            right_refused: outcomes.refused.values().sum(),
            wrong_accepted: outcomes.wrong.len(),
            not_found: outcomes.lost,
            median_s: outcomes.median_ms() / 1e3,
            longest_s: outcomes.longest_ms() / 1e3,
            longest_cells: cells.iter().copied().max().unwrap_or(0),
        }
    }
}

impl Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { set, map, searches, right_accepted, right_refused, wrong_accepted, not_found, .. } = self;
        let down = if self.knows_down { "down known" } else { "all orientations" };
        write!(
            f,
            "{searches:>8}  {right_accepted:>15}  {right_refused:>7}  {wrong_accepted:>5}  {not_found:>9}  \
             {:>8.2}  {:>9.2}  {:>8.2}  {set}, {map}, {down}, {} voxels a range",
            self.median_s,
            self.longest_s,
            self.longest_cells as f64 / 1e6,
            self.resolutions_per_range
        )
    }
}
