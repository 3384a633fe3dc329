//! Ends: where ascents ended, with what is known beforehand and what rays say for and against each.

use nalgebra::Vector3;

use super::agreement::{RayAgreement, RayCounts, Rays, Rival};
use super::evidence::{
    AGREEMENT_MIN, EVIDENCE_MIN, EVIDENCE_OF_BOTH_MIN, has_evidence, in_rank, is_hardly_contradicted,
    is_vouched_for,
};
use super::fit::Fit;
use super::look::{Look, is_contradicted_times_as_much};
use super::prior::{PosePrior, WIDE_DEG, WIDE_M};
use super::sampled_scan::SampledScan;
use super::settings::{AlignmentSettings, DEVIATIONS_MAX};
use super::sides;
use super::verdict::Verdict;
use super::witnesses::Witnesses;
use crate::geometry::{Point, Pose, pose_difference};
use crate::map::MultiResolutionMap;
use crate::util::StopSignal;

/// Poses that differ by less than this many r_0 and less than [`SAME_DEG`] are the same place.
const SAME_VOXELS: f64 = 4.0;
const SAME_DEG: f64 = 5.0;
/// A pose is near its guess within so many meters, three quarters of a standard deviation of a guess of which nothing
/// else is known, and a tilt of one, degrees; other places are looked for up to so many meters, three of them. Its yaw
/// does not count: the robot may have been turned unseen.
const NEAR_M: f64 = 0.75 * WIDE_M;
const NEAR_TILT_DEG: f64 = WIDE_DEG;
pub(super) const REACH_M: f64 = 3.0 * WIDE_M;
/// Both sides are contradicted where more than this share of each is, and more than [`UNUSUAL`] times what the
/// witnesses contradict each other.
const CONTRADICTED_MIN: f64 = 0.005;
const UNUSUAL: f64 = 2.0;
/// A pose of another place is a rival whose cost is at most this much more than the best: three standard deviations.
pub(super) const RIVAL: f64 = 9.0;

/// True of poses at the same place in a map whose finest voxels have sides of `resolution_m`.
pub(super) fn is_same_place(a: &Pose, b: &Pose, resolution_m: f64) -> bool {
    let (meters, degrees) = pose_difference(a, b);
    meters < SAME_VOXELS * resolution_m && degrees < SAME_DEG
}

/// The angle between what is up for two poses, degrees.
fn tilt_deg(a: &Pose, b: &Pose) -> f64 {
    (a.rotation * Vector3::z()).angle(&(b.rotation * Vector3::z())).to_degrees()
}

/// Where an ascent ended, with what speaks for and against it.
#[derive(Debug)]
pub(super) struct End {
    pub(super) fit: Fit,
    pub(super) agreement: RayAgreement,
    look: Look,
    /// How far it is from the guess, in standard deviations of what is known beforehand.
    pub(super) deviations: f64,
    /// Why it is not to be believed, whatever its rivals are.
    pub(super) against: Option<(Verdict, String)>,
}

/// The ends of one scan's ascents, all looked at with the same witnesses.
#[derive(Debug)]
pub(super) struct Ends<'a> {
    pub(super) all: Vec<End>,
    /// Look-ups of all their ascents.
    pub(super) lookups: u64,
    rays: &'a Rays,
    witnesses: Witnesses,
    /// What is known beforehand; none of places that a search found.
    pub(super) prior: Option<PosePrior>,
    resolution_m: f64,
    overlap_min: f64,
    stop: StopSignal<'a>,
}

impl<'a> Ends<'a> {
    /// The ends of some ascents, which must not be none.
    pub(super) fn of(
        found: Vec<Fit>,
        map: &MultiResolutionMap,
        rays: &'a Rays,
        prior: Option<PosePrior>,
        settings: &AlignmentSettings,
        stop: StopSignal<'a>,
    ) -> Self {
        let poses: Vec<Pose> = found.iter().map(|end| end.map_from_sensor).collect();
        let witnesses = Witnesses::of(rays, map, &poses, stop);
        let (resolution_m, overlap_min) = (map.lattice().resolution_m(0), settings.overlap_min);
        let lookups = found.iter().map(|end| end.lookups).sum();
        let mut ends =
            Self { all: Vec::new(), lookups, rays, witnesses, prior, resolution_m, overlap_min, stop };
        // Of those at one place the one that fits best.
        let mut found = found;
        let closeness = |end: &Fit| if map.settings().moments { end.fitness } else { end.overlap() };
        found.sort_by(|a, b| closeness(b).total_cmp(&closeness(a)));
        found.into_iter().for_each(|found| ends.push(found));
        ends
    }

    /// Adds the end of another ascent, if it lies elsewhere.
    pub(super) fn add(&mut self, found: Fit) {
        self.lookups += found.lookups;
        if !self.stop.is_stopped() {
            self.push(found);
        }
    }

    /// Sorts the ends by [`in_rank`]. Of those that `is_same_place` says are one place, the first is kept.
    pub(super) fn rank(&mut self, is_same_place: impl Fn(&Pose, &Pose) -> bool) {
        let rank = |end: &End| (end.agreement, end.fit.overlap());
        self.all.sort_by(|a, b| in_rank(&rank(a), &rank(b)));
        let mut places: Vec<Pose> = Vec::new();
        self.all.retain(|End { fit, .. }| {
            let is_new = !places.iter().any(|place| is_same_place(place, &fit.map_from_sensor));
            places.extend(is_new.then_some(fit.map_from_sensor));
            is_new
        });
    }

    fn push(&mut self, found: Fit) {
        let is_known = self
            .all
            .iter()
            .any(|end| is_same_place(&end.fit.map_from_sensor, &found.map_from_sensor, self.resolution_m));
        if !is_known {
            self.all.push(self.end(found));
        }
    }

    /// Adds witnesses near the ends that the present witnesses did not see, and compares all ends anew. Witnesses on
    /// one floor see nothing of another.
    pub(super) fn hear_further_witnesses(&mut self, map: &MultiResolutionMap) {
        let unseen = self.all.iter().filter(|end| !has_evidence(&end.agreement));
        let poses: Vec<Pose> = unseen.map(|end| end.fit.map_from_sensor).collect();
        if self.stop.is_stopped() || poses.is_empty() {
            return;
        }
        self.witnesses.add(self.rays, map, &poses, self.stop);
        let ends = std::mem::take(&mut self.all);
        self.all = ends.into_iter().map(|end| self.end(end.fit)).collect();
    }

    /// The surface points of the scan that earlier scans met from its side where the best end puts them, see [`sides`];
    /// none where all are.
    pub(super) fn met_from_own_side(
        &self,
        map: &MultiResolutionMap,
        scan: &SampledScan<'_>,
    ) -> Option<Vec<Point>> {
        let End { fit, against, .. } = self.best();
        let is_judged = against.is_none() && !self.stop.is_stopped();
        let of = |pose| sides::met_from_own_side(map, scan, pose, self.rays, &self.witnesses);
        if is_judged { of(&fit.map_from_sensor) } else { None }
    }

    /// Puts another fit in the place of the best end.
    pub(super) fn replace_best(&mut self, fit: Fit) {
        self.lookups += fit.lookups;
        let pose = self.best().fit.map_from_sensor;
        if let Some(best) = self.all.iter().position(|end| end.fit.map_from_sensor == pose) {
            self.all[best] = self.end(fit);
        }
    }

    /// Leaves open which way the robot was turned.
    pub(super) fn open_yaw(&mut self) {
        self.prior = self.prior.map(PosePrior::with_open_yaw);
        for k in 0..self.all.len() {
            self.all[k].deviations = self.deviations(&self.all[k].fit.map_from_sensor);
        }
    }

    fn end(&self, fit: Fit) -> End {
        let pose = &fit.map_from_sensor;
        let (look, deviations) =
            (Look::of(self.rays, pose, &self.witnesses, self.stop), self.deviations(pose));
        let agreement = look.agreement();
        let against = self.reason_against(&fit, &agreement);
        End { fit, agreement, look, deviations, against }
    }

    /// How far a pose is from the guess, in standard deviations.
    pub(super) fn deviations(&self, pose: &Pose) -> f64 {
        self.prior.map_or(0.0, |prior| prior.deviations(pose, self.resolution_m))
    }

    /// Why a pose is not to be believed, whatever its rivals are.
    fn reason_against(&self, found: &Fit, agreement: &RayAgreement) -> Option<(Verdict, String)> {
        let RayAgreement { of_scan, of_map } = agreement;
        if !has_evidence(agreement) {
            let (a, b) = (of_scan.evidence(), of_map.evidence());
            let words = "of the scan's points and of what earlier scans met in its view agree";
            let least =
                format!("at least {EVIDENCE_MIN} of one and {EVIDENCE_OF_BOTH_MIN} of the other have to");
            return Some((Verdict::LowOverlap, format!("{a:.3} and {b:.3} {words}, {least}")));
        }
        if let Some(worst) = found.undetermined.first() {
            return Some((Verdict::Undetermined, format!("open along {worst}")));
        }
        let (overlap, overlap_min) = (found.overlap(), self.overlap_min);
        if overlap < overlap_min {
            let reason = format!("overlap {overlap:.3} is below overlap_min {overlap_min}");
            return Some((Verdict::LowOverlap, reason));
        }
        let from_guess = self.prior.map(|prior| pose_difference(&prior.guess, &found.map_from_sensor).0);
        let is_near = self.is_near(&found.map_from_sensor);
        if agreement.worse() < AGREEMENT_MIN && !(is_near && is_vouched_for(agreement)) {
            let (a, b) = (of_scan.contradicted_share(), of_map.contradicted_share());
            let words = "of the scan's points and of what earlier scans met are contradicted";
            let sides = if is_near {
                "of both, or of one if the other is clear,"
            } else {
                "of one, so far from the guess,"
            };
            let most = 1.0 - AGREEMENT_MIN;
            let reason = format!("{a:.3} and {b:.3} {words}: at most {most:.1} {sides} may be");
            return Some((Verdict::Contradicted, reason));
        }
        let far_m = from_guess.filter(|meters| *meters > REACH_M)?;
        let reason = format!("it is {far_m:.2} m from the guess, others were looked for up to {REACH_M} m");
        Some((Verdict::Ambiguous, reason))
    }

    /// True of a pose near its guess. Farther away some pose of many fits by chance.
    fn is_near(&self, pose: &Pose) -> bool {
        self.prior.is_some_and(|prior| {
            pose_difference(&prior.guess, pose).0 <= NEAR_M && tilt_deg(&prior.guess, pose) <= NEAR_TILT_DEG
        })
    }

    /// Why the best of all ends is not to be believed, though nothing better was found: far from its guess, nothing but
    /// rays speaks for it, and they contradict it both ways.
    pub(super) fn reason_against_best(&self, best: &End) -> Option<String> {
        let is_far = self.prior.is_some() && !self.is_near(&best.fit.map_from_sensor);
        let (a, b) =
            (best.agreement.of_scan.contradicted_share(), best.agreement.of_map.contradicted_share());
        (is_far && !self.is_usual(best)).then(|| {
            format!(
                "{a:.3} of the scan's points and {b:.3} of what earlier scans met are contradicted, so far from the \
                 guess: more on both sides than earlier scans contradict each other"
            )
        })
    }

    /// The end that rays contradict least, of those that may be believed.
    pub(super) fn preferred(&self) -> Option<&End> {
        let believable = self.all.iter().filter(|end| end.against.is_none());
        believable.reduce(|best, end| if end.is_contradicted_more_than(best) < 0.0 { end } else { best })
    }

    /// The end of least cost, of those that may be believed; where there are none, the one that fits best.
    pub(super) fn best(&self) -> &End {
        let cost = |end: &&End| self.preferred().map_or(0.0, |preferred| end.cost(preferred));
        let believable = self.all.iter().filter(|end| end.against.is_none());
        let by_fitness = |a: &&End, b: &&End| a.fit.fitness.total_cmp(&b.fit.fitness);
        let best = believable.min_by(|a, b| cost(a).total_cmp(&cost(b)));
        best.or_else(|| self.all.iter().max_by(by_fitness)).unwrap_or(&self.all[0])
    }

    /// The rivals of `best`: [ends elsewhere that may be the true pose](Self::is_rival), and [the
    /// guess](Self::rival_at_guess).
    pub(super) fn rivals_of(&self, best: &End) -> Vec<Rival> {
        let Some(preferred) = self.preferred() else { return Vec::new() };
        let is_elsewhere = |end: &&End| {
            !is_same_place(&end.fit.map_from_sensor, &best.fit.map_from_sensor, self.resolution_m)
        };
        let ends = self.all.iter().filter(|end| has_evidence(&end.agreement)).filter(is_elsewhere);
        let rivals = ends.filter(|end| self.is_rival(end, best, preferred));
        let of_end = |end: &End| Rival { map_from_sensor: end.fit.map_from_sensor, agreement: end.agreement };
        rivals.map(of_end).chain(self.rival_at_guess(best, preferred)).collect()
    }

    /// True of an end that may be the true pose instead of `best`. One with an open direction is not believed, but it
    /// is possible.
    fn is_rival(&self, end: &End, best: &End, preferred: &End) -> bool {
        let is_as_likely = end.cost(preferred) - best.cost(preferred) <= RIVAL;
        // What is known beforehand may be too sure of itself: wheels slip.
        let is_preferred_by_rays = best.is_contradicted_more_than(end) >= RIVAL.sqrt();
        // On new ground, and where things were moved, rays contradict the true pose too: they do not outweigh the
        // guess.
        let is_nearer = end.deviations < best.deviations
            && end.against.is_none()
            && (self.is_usual(end) || !self.is_usual(best));
        // A single thing that came or went may be all that speaks against it, unless that is much. Where the scan and
        // earlier scans agree at the best end in all, nothing came or went.
        let is_contradicted_one_way = end.agreement.worse() >= AGREEMENT_MIN
            && best.agreement.worse() < 1.0 - CONTRADICTED_MIN
            && end.is_as_near_as(best)
            && !end.is_contradicted_both_ways_more_than(best);
        is_as_likely || is_preferred_by_rays || is_nearer || is_contradicted_one_way
    }

    /// True of an end that may be believed, and that rays contradict on one side hardly more than the witnesses
    /// contradict each other. Where the scan comes to new ground, it is seen askew, and rays contradict the true pose a
    /// little more than one where all is known.
    pub(super) fn is_usual(&self, end: &End) -> bool {
        let RayAgreement { of_scan, of_map } = end.agreement;
        let both = of_scan.contradicted_share().min(of_map.contradicted_share());
        end.against.is_none()
            && (both <= CONTRADICTED_MIN || both <= UNUSUAL * self.contradicted_among_witnesses())
    }

    /// True of an end that rays contradict on one side or both, by more than the witnesses contradict each other.
    /// People and moved things cause that, and so does a pose on the wrong floor.
    pub(super) fn is_contradicted(&self, end: &End) -> bool {
        let most = 1.0 - end.agreement.worse();
        most > CONTRADICTED_MIN && most > UNUSUAL * self.contradicted_among_witnesses()
    }

    /// The guess as a rival, where rays do not tell it from `best`: the scan would show new ground there, or little
    /// that it shows holds it.
    ///
    /// A pose elsewhere at which the scan would show new ground only is no rival: there are always some.
    fn rival_at_guess(&self, best: &End, preferred: &End) -> Option<Rival> {
        let map_from_sensor = self.prior?.guess;
        if is_same_place(&map_from_sensor, &best.fit.map_from_sensor, self.resolution_m) {
            return None;
        }
        let look = Look::of(self.rays, &map_from_sensor, &self.witnesses, self.stop);
        let agreement = look.agreement();
        let is_as_likely = cost(0.0, &look, &preferred.look) - best.cost(preferred) <= RIVAL;
        (is_hardly_contradicted(&agreement) && is_as_likely).then_some(Rival { map_from_sensor, agreement })
    }

    /// True where rays contradict `pose` at least `times` times as much as an end, on one side or both.
    pub(super) fn is_held_against(&self, end: &End, pose: &Pose, times: f64) -> bool {
        is_contradicted_times_as_much(self.rays, pose, &self.witnesses, &end.agreement, times)
    }

    /// The share of what each witness met that another one contradicts.
    fn contradicted_among_witnesses(&self) -> f64 {
        self.witnesses.contradicted_among_each_other(self.rays.tolerance_m)
    }
}

impl End {
    /// What is known beforehand and what rays say against this end, in squared standard deviations; rays against the
    /// end that they prefer.
    pub(super) fn cost(&self, preferred: &Self) -> f64 {
        cost(self.deviations, &self.look, &preferred.look)
    }

    /// True of an end at which what is known beforehand is known to be wrong.
    pub(super) fn is_beyond_odometry(&self) -> bool {
        self.deviations > DEVIATIONS_MAX
    }

    /// How much more rays contradict this end than another, in standard deviations.
    fn is_contradicted_more_than(&self, other: &Self) -> f64 {
        self.look.contradicted_more_than(&other.look)
    }

    /// True where rays contradict a larger share of the scan and a larger share of what earlier scans met than at
    /// another end. One alone may be a thing that came or went, as after a piece of furniture was moved.
    fn is_contradicted_both_ways_more_than(&self, other: &Self) -> bool {
        let more = |of: fn(&RayAgreement) -> RayCounts| {
            let [here, there] = [self, other].map(|end| of(&end.agreement).contradicted_share());
            here - there > CONTRADICTED_MIN
        };
        more(|agreement| agreement.of_scan) && more(|agreement| agreement.of_map)
    }

    /// True where what is known beforehand does not tell it from another end.
    fn is_as_near_as(&self, other: &Self) -> bool {
        cost_of_prior(self.deviations) - cost_of_prior(other.deviations) <= RIVAL
    }
}

/// [`End::cost`] of a pose that is so many standard deviations from the guess.
fn cost(deviations: f64, look: &Look, preferred: &Look) -> f64 {
    let z = look.contradicted_more_than(preferred).max(0.0);
    cost_of_prior(deviations) + z * z
}

/// What is known beforehand against a pose that is so many standard deviations from the guess, squared ones.
pub(super) fn cost_of_prior(deviations: f64) -> f64 {
    deviations.min(DEVIATIONS_MAX).powi(2)
}
