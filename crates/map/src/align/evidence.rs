//! Evidence: how much a scan and earlier scans saw of each other, and what the two sides say of a pose together.

use std::cmp::Ordering;

use super::agreement::{RayAgreement, RayCounts};
use super::look::CLUSTERING;

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

/// True where one side alone tells that a pose is right: people and what was moved contradict one side only. Its share
/// counts as that of further points is to be expected, so that a few that agree by chance tell nothing.
pub(super) fn is_vouched_for(RayAgreement { of_scan, of_map }: &RayAgreement) -> bool {
    [of_scan, of_map].into_iter().any(|side| expected_share(side) >= AGREEMENT_MIN)
}

/// True of a pose at which the scan and earlier scans saw enough of each other, and most of what is known of either
/// side agrees.
pub(crate) fn agrees_both_ways(agreement: &RayAgreement) -> bool {
    has_evidence(agreement) && agreement.worse() >= AGREEMENT_MIN
}

/// The share that agrees of further points like those of a side: (a + 1) / (a + c + 2) after a that agree and c that
/// are contradicted (Laplace's rule of succession), where points beside each other count as fewer, see [`CLUSTERING`].
fn expected_share(side: &RayCounts) -> f64 {
    let independent = |points: usize| points as f64 / (CLUSTERING * CLUSTERING);
    let (agree, contradicted) = (independent(side.agree), independent(side.contradicted));
    (agree + 1.0) / (agree + contradicted + 2.0)
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
    fn a_side_with_few_points_does_not_vouch_for_a_pose_that_the_other_one_contradicts() {
        let is_vouched_for = |of_scan, of_map| is_vouched_for(&RayAgreement { of_scan, of_map });
        // A crowd before the scan: what it hides says nothing, and what is seen beside it agrees.
        let crowd = counts(400, 230);
        assert!(is_vouched_for(crowd, counts(400, 3)));
        assert!(is_vouched_for(crowd, counts(26, 0)) && !is_vouched_for(crowd, counts(360, 40)));
        // A camera of another place: of what an earlier scan met seven points lie in its view, and six of them fit.
        assert!(!is_vouched_for(counts(245, 139), RayCounts { asked: 7, agree: 6, contradicted: 0 }));
        assert!(!is_vouched_for(counts(0, 0), counts(0, 0)));
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
