//! Rivals: which of several poses a scan was taken at, by what is known beforehand and by rays.
//!
//! No least agreement tells a right pose from a wrong one: a robot that turned in a rectangular room has nearly as much
//! as at the true pose. But the true pose is contradicted less. So the poses where ascents ended are compared, with the
//! same witnesses, by one cost: the squared deviation from what is known beforehand, and that by which rays contradict
//! a pose more than the one they like best.

use nalgebra::{Translation3, UnitQuaternion, Vector2, Vector3};

use super::agreement::{RayAgreement, Rays, Rival};
use super::ascent::Ascent;
use super::elsewhere::{LEVEL_OF_SHIFTS, LEVEL_OF_TURNS, on_other_floors, shifted, turned};
use super::ends::{End, Ends, REACH_M, RIVAL, cost_of_prior};
use super::fit::Fit;
use super::prior::PosePrior;
use super::sampled_scan::SampledScan;
use super::settings::AlignmentSettings;
use super::stages::{climb, finish};
use super::verdict::{Alignment, Verdict};
use crate::geometry::Pose;
use crate::map::MultiResolutionMap;

/// How many times as much rays have to contradict a pose aside: so many r_0, or turned by so many degrees.
const CONTRAST_MIN: f64 = 2.0;
const ASIDE_VOXELS: f64 = 8.0;
const ASIDE_DEG: f64 = 10.0;
/// Other places are looked for where what is known beforehand reaches farther than this, r_0.
const REACH_VOXELS: f64 = 4.0;

/// A scan whose pose is to be told from its rivals.
#[derive(Debug, Clone, Copy)]
pub(super) struct Contest<'a> {
    pub(super) map: &'a MultiResolutionMap,
    pub(super) scan: &'a SampledScan<'a>,
    pub(super) rays: &'a Rays,
    pub(super) settings: &'a AlignmentSettings,
}

impl Contest<'_> {
    /// The best of `found`, which must not be empty, and of what fits as well elsewhere, with a verdict.
    pub(super) fn decide(&self, found: Vec<Fit>, prior: &PosePrior) -> Alignment {
        let mut ends = self.ends(found, Some(*prior));
        let best = ends.best();
        let is_doubted = self.is_doubted(best, &ends);
        if best.against.is_some() && !is_doubted {
            return self.judged(&mut ends);
        }
        // Whoever was turned away unseen may stand at any yaw, and where things repeat the scan fits at each of them.
        let may_have_turned = is_doubted || prior.leaves_yaw_open() || best.is_beyond_odometry();
        let may_have_changed_floors = is_doubted || ends.is_contradicted(best);
        let others = self.others(&best.fit, prior, may_have_changed_floors, may_have_turned);
        if others.is_empty() || self.settings.multi_start.ascents == 0 {
            return Alignment { wants_more_starts: !others.is_empty(), ..self.judged(&mut ends) };
        }
        // What is told of the turn is heard where rays contradict both sides, too.
        if prior.tells_no_turn() {
            ends.open_yaw();
        }
        for (guess, coarsest) in others {
            let ascent = climb(self.map, self.scan, guess, coarsest, self.settings);
            ends.add(finish(self.map, self.scan, ascent, self.settings));
        }
        ends.hear_further_witnesses(self.map);
        self.judged(&mut ends)
    }

    /// Places that a search found, looked at by rays and [ranked](Ends::rank): nothing is known beforehand. Of those
    /// that `is_same_place` says are one, the best is kept.
    pub(super) fn rank(&self, places: Vec<Fit>, is_same_place: impl Fn(&Pose, &Pose) -> bool) -> Ends<'_> {
        let mut ends = self.ends(places, None);
        ends.rank(is_same_place);
        ends
    }

    /// Which of the places that a search found is the best, with a verdict. They must not be none.
    pub(super) fn decide_among(&self, places: &mut Ends<'_>) -> Alignment {
        self.judged(places)
    }

    fn ends(&self, found: Vec<Fit>, prior: Option<PosePrior>) -> Ends<'_> {
        Ends::of(found, self.map, self.rays, prior, self.settings, self.scan.stop)
    }

    /// Where else the scan may fit as well, with the coarsest level to ascend on from there: shifted as far as the
    /// prior reaches around its guess, along the map's axes and those of what holds the pose, and turned. On other
    /// floors too, whatever the prior says, where the robot may have taken a lift unseen.
    fn others(
        &self,
        found: &Fit,
        prior: &PosePrior,
        may_have_changed_floors: bool,
        may_have_turned: bool,
    ) -> Vec<(Pose, u32)> {
        let far_m = REACH_VOXELS * self.map.lattice().resolution_m(0);
        let from_guess = found.map_from_sensor.translation.vector - prior.guess.translation.vector;
        let farthest_m = |axis: Vector3<f64>| prior.possible_m(axis) + from_guess.dot(&axis).abs();
        let possible_m =
            |axis| Some(farthest_m(axis)).filter(|farthest_m| *farthest_m > far_m).unwrap_or(0.0);
        let on_floor = [Some(Vector2::x()), least_held(found)].into_iter().flatten();
        let on_floor = on_floor.flat_map(|axis| [axis, Vector2::new(-axis.y, axis.x)]);
        let axes: Vec<Vector3<f64>> = on_floor.map(|axis| axis.push(0.0)).collect();
        let pose = &found.map_from_sensor;
        let mut shifted = shifted(self.map, self.scan, pose, &axes, possible_m, self.settings);
        if may_have_changed_floors {
            let farthest_m = farthest_m(Vector3::z()).max(REACH_M);
            shifted.extend(on_other_floors(self.map, self.scan, pose, farthest_m, self.settings));
        }
        let turned = match may_have_turned {
            true => turned(self.map, self.scan, pose, &prior.guess, self.settings),
            false => Vec::new(),
        };
        let coarsest = self.map.settings().levels - 1;
        let shifted = shifted.into_iter().map(|guess| (guess, LEVEL_OF_SHIFTS.min(coarsest)));
        shifted.chain(turned.into_iter().map(|guess| (guess, LEVEL_OF_TURNS.min(coarsest)))).collect()
    }

    /// True of an end that rays contradict both ways, by more than the witnesses contradict each other: people, and
    /// what was brought or taken away, contradict one side only.
    fn is_doubted(&self, end: &End, ends: &Ends<'_>) -> bool {
        let is_contradicted = matches!(end.against, Some((Verdict::Contradicted, _)));
        is_contradicted || end.against.is_none() && !ends.is_usual(end)
    }

    /// The verdict on the best of the ends, refined without the surfaces that are not its own: the other side of a thin
    /// wall lies where this side would be, or pulls the scan there.
    fn judged(&self, ends: &mut Ends<'_>) -> Alignment {
        if let Some(points) = ends.met_from_own_side(self.map, self.scan) {
            let scan = self.scan.with_surface_sample(points, self.map.lattice());
            let ascent = Ascent::from(ends.best().fit.map_from_sensor);
            ends.replace_best(finish(self.map, &scan, ascent, self.settings));
        }
        let best = ends.best();
        let (verdict, reason, rivals) = self.verdict_on(best, ends);
        Alignment {
            agreement: Some(best.agreement),
            rivals,
            contradicted_both_ways: self.is_doubted(best, ends),
            lookups: ends.lookups,
            ..best.fit.clone().told(verdict, reason)
        }
    }

    /// The verdict on the best of the ends, why, and the rivals that make it ambiguous.
    fn verdict_on(&self, best: &End, ends: &Ends<'_>) -> (Verdict, String, Vec<Rival>) {
        if let Some((verdict, reason)) = best.against.clone() {
            return (verdict, reason, Vec::new());
        }
        let agree = told(&best.agreement);
        let rivals = ends.rivals_of(best);
        if let Some(rival) = rivals.first() {
            let [x, y, z] = rival.map_from_sensor.translation.vector.into();
            let count = rivals.len();
            let reason = format!(
                "{agree}; of {count} other poses the first, at {x:.2} {y:.2} {z:.2} m, is as likely: {}",
                told(&rival.agreement)
            );
            return (Verdict::Ambiguous, reason, rivals);
        }
        if let Some(aside) = self.slides_to(best, ends) {
            return (Verdict::Undetermined, format!("{agree}, and as well {aside}"), Vec::new());
        }
        if let Some(reason) = ends.reason_against_best(best) {
            return (Verdict::Contradicted, reason, Vec::new());
        }
        let held_m = best.fit.information.directions()[0].std_m;
        // A search has no guess.
        let from_guess = match ends.prior {
            Some(_) => format!(", {:.1} standard deviations from the guess", best.deviations),
            None => String::new(),
        };
        let moments = if self.map.settings().moments { "" } else { "; the map keeps no moments" };
        let reason = format!("{agree}{from_guess}, held to {held_m:.4} m in every direction{moments}");
        (Verdict::Accepted, reason, Vec::new())
    }

    /// Where rays contradict the scan hardly more than at `end`, a little aside or turned, as far as the prior allows:
    /// they do not hold it.
    fn slides_to(&self, end: &End, ends: &Ends<'_>) -> Option<String> {
        let pose = &end.fit.map_from_sensor;
        let aside_m = ASIDE_VOXELS * self.map.lattice().resolution_m(0);
        let axis = least_held(&end.fit).unwrap_or_else(Vector2::x);
        let across = Vector2::new(-axis.y, axis.x);
        let shifts = [axis, -axis, across, -across].map(|way| (way * aside_m, 0.0));
        let turns = [ASIDE_DEG, -ASIDE_DEG].map(|degrees| (Vector2::zeros(), degrees));
        let is_open = |(shift, degrees): &(Vector2<f64>, f64)| {
            let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * degrees.to_radians());
            let shift = Translation3::new(shift.x, shift.y, 0.0);
            let aside = Pose::from_parts(shift * pose.translation, turn * pose.rotation);
            // Most are ruled out by what is known beforehand, without a look.
            let farther = cost_of_prior(ends.deviations(&aside)) - cost_of_prior(end.deviations);
            farther <= RIVAL && !ends.is_held_against(end, &aside, CONTRAST_MIN)
        };
        let (shift, degrees) = shifts.into_iter().chain(turns).find(is_open)?;
        Some(match degrees == 0.0 {
            true => format!("{:.2} m along x and {:.2} m along y from there", shift.x, shift.y),
            false => format!("turned by {degrees} deg"),
        })
    }
}

/// The direction on the floor along which the map's surfaces hold a pose least; none where turns are all that is open.
fn least_held(found: &Fit) -> Option<Vector2<f64>> {
    let directions = found.information.directions().into_iter();
    let on_floor = directions.map(|open| Vector2::new(open.direction[0], open.direction[1]));
    on_floor.into_iter().find(|axis| axis.norm() > 0.7).map(|axis| axis.normalize())
}

/// Says how rays agree at a pose.
fn told(RayAgreement { of_scan, of_map }: &RayAgreement) -> String {
    format!("{:.3} of the scan's and {:.3} of the map's rays agree", of_scan.share(), of_map.share())
}
