//! `mrol-lab experiment hostile-guesses`: what is accepted of guesses that are far off, and of scans of other places.

use std::fmt::{self, Display};
use std::path::PathBuf;
use std::str::FromStr;

use serde::Serialize;

use crate::experiment::hostile_guesses::{FAIR, HOSTILE, Place, Trial, random};
use crate::workload::Scan;
use mrol::console::error::CliError;
use mrol::console::output::Output;
use mrol::console::truth::true_poses;
use mrol_map::align::{AlignmentSettings, Contradiction, FreeSpaceSettings, Verdict};
use mrol_map::geometry::Pose;
use mrol_map::map::{LEVELS_DEFAULT, MapSettings};
use mrol_map::scan::{read_points, scan_files};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol-lab experiment hostile-guesses hall/:0.1:hall office/:0.04:office street/:0.2:street
  mrol-lab experiment hostile-guesses hall/:0.1:hall office/:0.04:office --without-free-space

Each argument is a folder of scans with poses.txt (a TUM file, line k for scan k), the side of a voxel, and the name of the
place. Each set's odd scans are aligned to a map of its even ones: from guesses off by up to 10 m and 180 degrees, which is
hostile, and by up to 1 m and 30 degrees, which is fair; scans of other places too, which belong nowhere. A pose is wrong
that is more than a voxel and a degree off. Every wrong one is printed.";

/// What is accepted of guesses that are far off, and of scans of other places
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct HostileGuesses {
    /// Sets of scans
    #[arg(required = true, value_name = "DIR:RESOLUTION:PLACE")]
    sets: Vec<SetOption>,
    /// Alignments from hostile guesses, and as many from fair ones, over all sets
    #[arg(long, value_name = "N", default_value_t = 1000)]
    guesses: usize,
    /// Alignments of scans of other places, over all pairs of sets
    #[arg(long, value_name = "N", default_value_t = 300)]
    others: usize,
    /// Do not ask whether free space contradicts a pose, for comparison
    #[arg(long)]
    without_free_space: bool,
    /// Seed of the guesses
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// A set of scans: its folder, the side of a voxel, and the place it shows.
#[derive(Debug, Clone)]
pub(super) struct SetOption {
    pub(super) folder: PathBuf,
    pub(super) resolution_m: f64,
    pub(super) place: String,
}

impl FromStr for SetOption {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || format!("must be DIR:RESOLUTION:PLACE, as in hall/:0.1:hall, got {text}");
        let mut parts = text.rsplitn(3, ':');
        let (place, resolution_m) = (parts.next(), parts.next().and_then(|text| text.parse().ok()));
        let (place, resolution_m, folder) = (
            place.ok_or_else(expected)?,
            resolution_m.ok_or_else(expected)?,
            parts.next().ok_or_else(expected)?,
        );
        Ok(Self { folder: folder.into(), resolution_m, place: place.to_owned() })
    }
}

impl SetOption {
    /// The scans, with their true poses.
    pub(super) fn scans(&self, output: &Output) -> Result<Vec<Scan>, CliError> {
        let files = scan_files(std::slice::from_ref(&self.folder))?;
        let poses = true_poses(&self.folder.join("poses.txt"), files.len(), output)?;
        let scan = |(file, pose): (&PathBuf, Pose)| Ok(Scan::of_finite(read_points(file)?, Some(pose)));
        files.iter().zip(poses).map(scan).collect()
    }

    fn read(&self, output: &Output) -> Result<Place, CliError> {
        let scans = self.scans(output)?;
        let settings = MapSettings::new(self.resolution_m, LEVELS_DEFAULT);
        let place = Place::of(&self.place, scans, settings).map_err(CliError::usage)?;
        match place.is_empty() {
            true => {
                Err(CliError::failed(format!("{}: two scans are needed at least", self.folder.display())))
            }
            false => Ok(place),
        }
    }

    pub(super) fn name(&self) -> String {
        self.folder.file_name().unwrap_or(self.folder.as_os_str()).to_string_lossy().into_owned()
    }
}

impl HostileGuesses {
    pub(super) fn run(self, output: &Output) -> Result<(), CliError> {
        let mut settings = AlignmentSettings::default();
        if self.without_free_space {
            settings.free_space = FreeSpaceSettings { rays: 0, ..settings.free_space };
        }
        let places = self.sets.iter().map(|set| set.read(output)).collect::<Result<Vec<_>, _>>()?;
        let pairs: Vec<(usize, usize)> = (0..places.len())
            .flat_map(|map| (0..places.len()).map(move |scans| (map, scans)))
            .filter(|(map, scans)| places[*map].name != places[*scans].name)
            .collect();
        let of_set = self.guesses.div_ceil(places.len());
        let of_pair = self.others.div_ceil(pairs.len().max(1));
        output.say(Line::HEAD)?;
        let bar = output.clone().with_bar_of(2 * of_set * places.len() + of_pair * pairs.len(), "alignments");
        let mut random = random(self.seed);
        for (kind, most) in [("hostile", HOSTILE), ("fair", FAIR)] {
            for (set, place) in self.sets.iter().zip(&places) {
                let trials = place.align_from_off(of_set, most, &settings, &mut random, || bar.step());
                bar.print(&Line::of(kind, set.name(), &trials, set.resolution_m))?;
            }
        }
        for (map, scans) in pairs {
            let (set, name) =
                (&self.sets[map], format!("{} in {}", self.sets[scans].name(), self.sets[map].name()));
            let trials =
                places[map].align_others(&places[scans], of_pair, &settings, &mut random, || bar.step());
            bar.print(&Line::of("elsewhere", name, &trials, set.resolution_m))?;
        }
        bar.clear_bar();
        Ok(())
    }
}

/// What came of the alignments of a set.
#[derive(Serialize)]
struct Line {
    guesses: &'static str,
    set: String,
    alignments: usize,
    accepted: usize,
    wrong: Vec<Wrong>,
    contradicted: usize,
    /// Of right poses: shares that free space says against them, the largest of 95 % and of all.
    blocked_p95: f64,
    blocked_max: f64,
    seen_through_p95: f64,
    seen_through_max: f64,
}

/// A pose that was believed and is wrong.
#[derive(Serialize)]
struct Wrong {
    off_m: f64,
    off_deg: f64,
    error_m: Option<f64>,
    error_deg: Option<f64>,
    overlap: f64,
    #[serde(skip)]
    contradiction: Contradiction,
    reason: String,
}

impl Line {
    const HEAD: &str = "guesses    alignments  accepted  contradicted  wrong  blocked      seen through  set";

    fn of(guesses: &'static str, set: String, trials: &[Trial], resolution_m: f64) -> Self {
        let wrong = |trial: &&Trial| trial.is_wrong(resolution_m, 1.0);
        let right = |of: fn(&Contradiction) -> f64| {
            let mut shares: Vec<f64> = trials
                .iter()
                .filter(|trial| trial.is_right(resolution_m, 1.0))
                .map(|trial| of(&trial.alignment.contradiction))
                .collect();
            shares.sort_by(f64::total_cmp);
            let p95 = shares.len().saturating_sub(1) * 95 / 100;
            (shares.get(p95).copied().unwrap_or(0.0), shares.last().copied().unwrap_or(0.0))
        };
        let ((blocked_p95, blocked_max), (seen_through_p95, seen_through_max)) =
            (right(|share| share.blocked), right(|share| share.seen_through));
        let contradicted = |trial: &&Trial| trial.alignment.verdict == Verdict::Contradicted;
        Self {
            guesses,
            set,
            alignments: trials.len(),
            accepted: trials.iter().filter(|trial| trial.is_accepted()).count(),
            contradicted: trials.iter().filter(contradicted).count(),
            blocked_p95,
            blocked_max,
            seen_through_p95,
            seen_through_max,
            wrong: trials.iter().filter(wrong).map(Wrong::of).collect(),
        }
    }
}

impl Wrong {
    fn of(trial: &Trial) -> Self {
        Self {
            off_m: trial.off.0,
            off_deg: trial.off.1,
            error_m: trial.error.map(|error| error.0),
            error_deg: trial.error.map(|error| error.1),
            overlap: trial.alignment.overlap(),
            contradiction: trial.alignment.contradiction,
            reason: trial.alignment.reason.clone(),
        }
    }
}

impl Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { guesses, set, alignments, accepted, contradicted, wrong, .. } = self;
        let (blocked, seen) = (self.blocked_max, self.seen_through_max);
        let (blocked95, seen95) = (self.blocked_p95, self.seen_through_p95);
        let count = wrong.len();
        write!(
            f,
            "{guesses:<9}  {alignments:>10}  {accepted:>8}  {contradicted:>12}  {count:>5}  {blocked95:.3} {blocked:.3}  {seen95:.3} {seen:.3}  {set}"
        )?;
        wrong.iter().try_for_each(|wrong| write!(f, "\n    {wrong}"))
    }
}

impl Display for Wrong {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { off_m, off_deg, overlap, reason, .. } = self;
        match self.error_m.zip(self.error_deg) {
            Some((meters, degrees)) => {
                write!(
                    f,
                    "guess {off_m:.2} m {off_deg:.0} deg off, pose {meters:.2} m {degrees:.1} deg off: "
                )?;
            }
            None => write!(f, "of another place: ")?,
        }
        let Contradiction { blocked, seen_through, unexplained, .. } = self.contradiction;
        write!(f, "overlap {overlap:.3}, blocked {blocked:.3}, seen through {seen_through:.3}, ")?;
        write!(f, "unexplained {unexplained:.3}; {reason}")
    }
}
