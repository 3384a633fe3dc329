//! `mrol-lab experiment verdicts`: wrong poses that are accepted, and right ones that are refused.

use std::collections::BTreeMap;
use std::fmt::{self, Display};

use serde::Serialize;

use super::set_option::SetOption;
use crate::experiment::verdicts::{
    Carved, GUESSES, MapOf, Outcomes, PEOPLE, PERIODS_M, PIECES, STEP_S, Set, TURN_S, aisle, random, rooms,
};
use mrol::console::error::CliError;
use mrol::console::output::Output;
use mrol_map::align::{AlignmentSettings, RayAgreement};

const EXAMPLES: &str = "\
EXAMPLES:
  mrol-lab experiment verdicts                                     simulated places alone
  mrol-lab experiment verdicts hall/:0.1:hall street/:0.2:street   and two sets of real scans
  mrol-lab experiment verdicts --sequences hall/:0.1:hall          a set's scans in their order

Each argument is a folder of scans with poses.txt (a TUM file, line k for scan k), the side of a voxel, and the name
of the place. Its scans are aligned to maps of one, two and half of them, from guesses 0.1 m and 3 degrees to 8 m and
180 degrees off; scans of other places too. Simulated: rectangular rooms with 1 to 8 pieces of furniture and up to 12
people, after an unseen turn by as much as looks the same (one scan, up to three, and one after a piece was moved),
and after a step, with times of the scans and without; aisles with an upright every 0.5 to 3 m, by odometry and from
the pose before. A pose is right within two voxels and two degrees. Then how rays agree at true poses and at wrong
ones, 8 voxels and 10 degrees off, and how many of each a threshold from the other sets would tell.";

/// Wrong poses that are accepted and right ones that are refused, on real sets and in simulated places
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Verdicts {
    /// Sets of scans
    #[arg(value_name = "DIR:RESOLUTION:PLACE")]
    sets: Vec<SetOption>,
    /// Scans of a set that are looked at, evenly chosen
    #[arg(long, value_name = "N", default_value_t = 24)]
    scans: usize,
    /// Simulated rooms for each number of pieces and people
    #[arg(long, value_name = "N", default_value_t = 16)]
    rooms: u64,
    /// Drives along each aisle
    #[arg(long, value_name = "N", default_value_t = 2)]
    drives: u64,
    /// Seed of guesses and places
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Maps of the sets keep no viewpoints, as those from before there were any
    #[arg(long)]
    no_viewpoints: bool,
    /// Map all scans of each set in their order instead, each from the pose before it, and nothing else
    #[arg(long, conflicts_with_all = ["scans", "rooms", "drives", "seed", "no_viewpoints"], requires = "sets")]
    sequences: bool,
}

/// Least share of points that agree, of each side, for a pose whose rays tell anything.
const EVIDENCE_MIN: f64 = 0.2;

impl Verdicts {
    pub(super) fn run(self, output: &Output) -> Result<(), CliError> {
        let settings = AlignmentSettings::default();
        if self.sequences {
            return self.sequences(&settings, output);
        }
        let mut sets = Vec::new();
        for set in &self.sets {
            let mut set = set.read(self.scans, output)?;
            if self.no_viewpoints {
                set.viewpoints.bytes_max = 0;
            }
            sets.push(set);
        }
        let steps = sets.len() * MapOf::ALL.len() * (GUESSES.len() + 1)
            + PIECES.len() * PEOPLE.len()
            + PERIODS_M.len() * self.drives as usize;
        output.say(Line::HEAD)?;
        let bar = output.clone().with_bar_of(steps, "tables");
        let agreements = self.real(&sets, &settings, &bar)?;
        self.simulated(&settings, &bar)?;
        bar.clear_bar();
        if !agreements.is_empty() {
            output.say(Agreement::HEAD)?;
        }
        agreements.iter().try_for_each(|agreement| output.print(agreement))
    }

    /// The scans of each set one after the other: those at whose true poses rays tell enough, and the others.
    fn sequences(&self, settings: &AlignmentSettings, output: &Output) -> Result<(), CliError> {
        output.say(Line::HEAD)?;
        for set in &self.sets {
            let set = set.read(usize::MAX, output)?;
            let outcomes = set.in_order(settings, EVIDENCE_MIN)?;
            let told = format!("{}, in order", set.name);
            output.print(&Line::of(format!("{told}, evidence at the true pose"), outcomes.with_evidence))?;
            output.print(&Line::of(format!("{told}, too little of it"), outcomes.without_evidence))?;
        }
        Ok(())
    }

    fn real(
        &self,
        sets: &[Set],
        settings: &AlignmentSettings,
        bar: &Output,
    ) -> Result<Vec<Agreement>, CliError> {
        let mut random = random(self.seed);
        let mut pairs: Vec<(String, Vec<[RayAgreement; 2]>)> = Vec::new();
        for set in sets {
            let mut of_set = Vec::new();
            for which in MapOf::ALL {
                let Some(trials) = set.trials(which) else { continue };
                for (meters, degrees) in GUESSES {
                    let outcomes = trials.align_off((meters, degrees), settings, &mut random);
                    let what = format!("{}, {}, {meters} m {degrees} deg", set.name, which.as_str());
                    bar.step();
                    bar.print(&Line::of(what, outcomes))?;
                }
                for other in sets.iter().filter(|other| other.place != set.place) {
                    let outcomes = trials.align_others(other, settings, &mut random);
                    bar.print(&Line::of(
                        format!("{} in {}, {}", other.name, set.name, which.as_str()),
                        outcomes,
                    ))?;
                }
                of_set.extend(trials.agreements(settings, &mut random));
                bar.step();
            }
            pairs.push((set.name.clone(), of_set));
        }
        Ok(Agreement::of_all(&pairs))
    }

    fn simulated(&self, settings: &AlignmentSettings, bar: &Output) -> Result<(), CliError> {
        for pieces in PIECES {
            for people in PEOPLE {
                let trials = rooms(self.seed, self.rooms, pieces, people, settings).ok_or_else(no_map)?;
                bar.step();
                let hidden = 100.0 * trials.hidden;
                let of_room =
                    format!("room, {pieces} pieces, {people} people ({hidden:.0} % of the view at most)");
                for (what, outcomes) in [
                    ("turned".into(), trials.turned),
                    (format!("turned within {TURN_S} s"), trials.turned_in_time),
                    ("turned, by the third scan".into(), trials.by_third),
                    ("turned, a piece moved since".into(), trials.rearranged),
                    ("a step".into(), trials.stepped),
                    (format!("a step within {STEP_S} s"), trials.stepped_in_time),
                ] {
                    bar.print(&Line::of(format!("{of_room}, {what}"), outcomes))?;
                }
                bar.print(&CarvedLine {
                    what: format!("{of_room}, carved of what stands"),
                    carved: trials.carved,
                })?;
            }
        }
        for period_m in PERIODS_M {
            for drive in 0..self.drives {
                let [odometry, before] =
                    aisle(self.seed.wrapping_add(drive), period_m, settings).ok_or_else(no_map)?;
                bar.step();
                bar.print(&Line::of(format!("aisle, {period_m} m, odometry"), odometry))?;
                bar.print(&Line::of(format!("aisle, {period_m} m, the pose before"), before))?;
            }
        }
        Ok(())
    }
}

fn no_map() -> CliError {
    CliError::failed("no map of a simulated place could be made")
}

/// What came of some alignments.
#[derive(Serialize)]
struct Line {
    what: String,
    alignments: usize,
    right_accepted: usize,
    right_refused: BTreeMap<&'static str, usize>,
    wrong_accepted: usize,
    wrong_refused: usize,
    /// Of each wrong one: how far off it is, meters and degrees, and the reason that was given.
    wrong: Vec<(Option<(f64, f64)>, String)>,
}

impl Line {
    const HEAD: &str = "alignments  right: accepted  refused  wrong: accepted  refused  what";

    fn of(what: String, outcomes: Outcomes) -> Self {
        Self {
            what,
            alignments: outcomes.alignments(),
            right_accepted: outcomes.right,
            wrong_accepted: outcomes.wrong.len(),
            wrong_refused: outcomes.lost,
            right_refused: outcomes.refused,
            wrong: outcomes.wrong,
        }
    }
}

impl Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let refused: usize = self.right_refused.values().sum();
        let Self { what, alignments, right_accepted, wrong_accepted, wrong_refused, .. } = self;
        write!(
            f,
            "{alignments:>10}  {right_accepted:>15}  {refused:>7}  {wrong_accepted:>15}  {wrong_refused:>7}  {what}"
        )?;
        self.right_refused.iter().try_for_each(|(verdict, count)| write!(f, "; {count} {verdict}"))
    }
}

/// Voxels of what stands that the scans of some rooms carved.
#[derive(Serialize)]
struct CarvedLine {
    what: String,
    carved: Carved,
}

impl Display for CarvedLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Carved { at_found, at_truth, at_wrong } = self.carved;
        let what = &self.what;
        write!(f, "{what}: {at_found} voxels where found, {at_truth} where taken, {at_wrong} at wrong poses")
    }
}

/// How rays agree on a set.
#[derive(Serialize)]
struct Agreement {
    set: String,
    /// True poses whose evidence suffices, of all.
    with_evidence: usize,
    scans: usize,
    /// The smallest of the better shares at these, and the largest of the worse shares at wrong ones whose evidence
    /// suffices.
    least_right: f64,
    most_wrong: f64,
    /// The smallest better share of the true poses of all other sets, and how many true poses of this set lie below it;
    /// none without others.
    from_others: Option<f64>,
    right_below: Option<usize>,
}

impl Agreement {
    const HEAD: &str = "rays tell of  at true poses at least  at wrong ones at most  the others' least  true ones below  set";

    fn of_all(pairs: &[(String, Vec<[RayAgreement; 2]>)]) -> Vec<Self> {
        let tells = |agreement: &&RayAgreement| agreement.evidence() >= EVIDENCE_MIN;
        let least = |of: &[[RayAgreement; 2]]| {
            of.iter().map(|[right, _]| right).filter(tells).map(RayAgreement::better).fold(1.0, f64::min)
        };
        let of_set = |(k, (set, of)): (usize, &(String, Vec<[RayAgreement; 2]>))| {
            let others = pairs.iter().enumerate().filter(|(other, _)| *other != k);
            let from_others = others.map(|(_, (_, of))| least(of)).reduce(f64::min);
            let right = || of.iter().map(|[right, _]| right).filter(tells);
            let wrong = of.iter().map(|[_, wrong]| wrong).filter(tells);
            Self {
                set: set.clone(),
                with_evidence: right().count(),
                scans: of.len(),
                least_right: least(of),
                most_wrong: wrong.map(RayAgreement::worse).fold(0.0, f64::max),
                from_others,
                right_below: from_others.map(|least| right().filter(|right| right.better() < least).count()),
            }
        };
        pairs.iter().enumerate().map(of_set).collect()
    }
}

impl Display for Agreement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { set, with_evidence, scans, least_right, most_wrong, from_others, right_below } = self;
        let tells = format!("{with_evidence} of {scans}");
        let from_others = from_others.map_or_else(|| "-".into(), |least| format!("{least:.3}"));
        let right_below = right_below.map_or_else(|| "-".into(), |count| count.to_string());
        write!(
            f,
            "{tells:>12}  {least_right:>22.3}  {most_wrong:>21.3}  {from_others:>17}  {right_below:>15}  {set}"
        )
    }
}
