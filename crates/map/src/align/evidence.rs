//! Evidence: how much a scan and earlier scans saw of each other, and what the two sides say of a pose together.

use std::cmp::Ordering;

use super::agreement::{RayAgreement, RayCounts};

/// Least share of points that agree, of the side that shows more of the other, and of the other one: two that see
/// nothing of each other cannot be compared.
pub(super) const EVIDENCE_MIN: f64 = 0.2;
pub(super) const EVIDENCE_OF_BOTH_MIN: f64 = 0.05;
/// Least share of points that agree, of those of which anything is known: of the better side near the guess, since
/// people and what was moved contradict one side only; farther away, where some pose of many fits by chance, of both.
pub(super) const AGREEMENT_MIN: f64 = 0.9;

/// True of a pose at which the scan and earlier scans saw enough of each other to be compared.
pub(super) fn has_evidence(RayAgreement { of_scan, of_map }: &RayAgreement) -> bool {
    let (a, b) = (of_scan.evidence(), of_map.evidence());
    a.max(b) >= EVIDENCE_MIN && a.min(b) >= EVIDENCE_OF_BOTH_MIN
}

/// The larger share of the two sides, of those that saw enough of the other to tell: people and what was moved
/// contradict one side only, and a side that sees a small part of what the other one does vouches for nothing.
pub(super) fn vouched_share(RayAgreement { of_scan, of_map }: &RayAgreement) -> f64 {
    let that_tell = [of_scan, of_map].into_iter().filter(|side| side.evidence() >= EVIDENCE_MIN);
    that_tell.map(RayCounts::share).fold(0.0, f64::max)
}

/// True of a pose at which little of what is known of one side at least is contradicted: nothing is, where nothing is
/// known.
pub(super) fn is_hardly_contradicted(RayAgreement { of_scan, of_map }: &RayAgreement) -> bool {
    of_scan.contradicted_share().min(of_map.contradicted_share()) <= 1.0 - AGREEMENT_MIN
}

/// The order of places that a search found, each with how rays agree there and its overlap: first those at which the
/// scan and earlier scans saw enough of each other, by the smaller share of rays that agree; then the others, by
/// overlap.
pub(super) fn in_rank(
    (rays, overlap): &(RayAgreement, f64),
    (of_other, overlap_of_other): &(RayAgreement, f64),
) -> Ordering {
    let share = |rays: &RayAgreement| if has_evidence(rays) { rays.worse() } else { -1.0 };
    share(of_other).total_cmp(&share(rays)).then(overlap_of_other.total_cmp(overlap))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counts(agree: usize, contradicted: usize) -> RayCounts {
        RayCounts { asked: 800, agree, contradicted }
    }

    #[test]
    fn a_side_that_shows_little_of_the_other_does_not_vouch_for_a_pose_that_the_other_contradicts() {
        let vouched = |of_scan, of_map| vouched_share(&RayAgreement { of_scan, of_map });
        // A crowd before the scan: what it hides says nothing, and what is seen beside it agrees.
        let crowd = counts(400, 230);
        assert_eq!(vouched(crowd, counts(400, 0)), 1.0);
        assert_eq!(vouched(crowd, counts(60, 0)), crowd.share());
        assert_eq!(vouched(counts(60, 0), counts(400, 100)), 0.8);
    }

    #[test]
    fn places_are_ranked_by_the_rays_that_agree_and_by_overlap_where_nothing_is_known() {
        let place = |agree: usize, contradicted: usize, overlap: f64| {
            (RayAgreement { of_scan: counts(agree, 0), of_map: counts(agree, contradicted) }, overlap)
        };
        let (agreed, contradicted) = (place(700, 10, 0.3), place(700, 70, 0.9));
        let (unseen_dense, unseen_sparse) = (place(30, 0, 0.95), place(30, 0, 0.5));
        let of_less_overlap = place(700, 10, 0.2);
        let mut places = [unseen_sparse, of_less_overlap, contradicted, unseen_dense, agreed];
        places.sort_by(in_rank);
        assert_eq!(places, [agreed, of_less_overlap, contradicted, unseen_dense, unseen_sparse]);
    }
}
