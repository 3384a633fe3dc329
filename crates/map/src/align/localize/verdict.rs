//! Verdict of global localization: whether the best candidate is where the scan was taken.

use super::settings::LocalizationSettings;
use crate::align::verdict::{Alignment, Verdict};

/// Verdict on the best place, with the reason: what rays say of it and of the others.
pub(super) fn verdict_on(
    best: Option<&Alignment>,
    cut_short: bool,
    settings: &LocalizationSettings,
) -> (Verdict, String) {
    let least = settings.search_overlap_min;
    match best.map(|best| (best.verdict, best)) {
        None if cut_short => (Verdict::Ambiguous, "the search was cut short before it found a place".into()),
        None => (Verdict::LowOverlap, format!("no place has {least} of the scan on the map or near it")),
        Some((_, best)) if cut_short && !best.agreement.is_some_and(|agreement| agreement.is_asked()) => {
            (Verdict::Ambiguous, "the search was cut short before rays were asked of what it found".into())
        }
        Some((Verdict::Accepted, _)) if cut_short => {
            (Verdict::Ambiguous, "the search was cut short: other places are not ruled out".into())
        }
        Some((verdict, best)) => (verdict, best.reason.clone()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::align::agreement::{RayAgreement, RayCounts};
    use crate::geometry::Pose;

    fn best(verdict: Verdict, asked: usize) -> Alignment {
        let counts = RayCounts { asked, ..RayCounts::default() };
        let agreement = Some(RayAgreement { of_scan: counts, of_map: counts });
        let alignment = Alignment::trusted(Pose::identity(), 1, &[]).but(verdict, "as rays say".into());
        Alignment { agreement, ..alignment }
    }

    fn verdict(best: Option<Alignment>, cut_short: bool) -> (Verdict, String) {
        verdict_on(best.as_ref(), cut_short, &LocalizationSettings::default())
    }

    #[test]
    fn what_rays_say_counts_and_a_search_that_was_cut_short_rules_nothing_out() {
        for told in Verdict::ALL {
            assert_eq!(verdict(Some(best(told, 800)), false), (told, "as rays say".into()));
            let expected = if told == Verdict::Accepted { Verdict::Ambiguous } else { told };
            assert_eq!(verdict(Some(best(told, 800)), true).0, expected);
            let (unasked, reason) = verdict(Some(best(told, 0)), true);
            assert!(unasked == Verdict::Ambiguous && reason.contains("before rays were asked"), "{reason}");
        }
        assert_eq!(verdict(None, false).0, Verdict::LowOverlap);
        assert_eq!(verdict(None, true).0, Verdict::Ambiguous);
    }
}
