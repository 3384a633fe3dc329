//! Verdict of global localization: whether the best candidate is where the scan was taken.

use super::answer::Candidate;
use super::settings::LocalizationSettings;
use crate::align::verdict::Verdict;

/// Verdict on the candidate that rays like best, with the reason: what they say of it and of the others.
pub(super) fn verdict_on(
    best: Option<&Candidate>,
    cut_short: bool,
    settings: &LocalizationSettings,
) -> (Verdict, String) {
    let least = settings.search_overlap_min;
    match best.map(|best| (best.alignment.verdict, &best.alignment.reason)) {
        None if cut_short => (Verdict::Ambiguous, "the search was cut short before it found a place".into()),
        None => (Verdict::LowOverlap, format!("no place has {least} of the scan on the map or near it")),
        Some((Verdict::Accepted, _)) if cut_short => {
            (Verdict::Ambiguous, "the search was cut short: other places are not ruled out".into())
        }
        Some((verdict, reason)) => (verdict, reason.clone()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::align::verdict::Alignment;
    use crate::geometry::Pose;

    fn verdict(best: Option<Verdict>, cut_short: bool) -> (Verdict, String) {
        let best = best.map(|verdict| {
            let alignment = Alignment::trusted(Pose::identity(), 1, &[]).but(verdict, "as rays say".into());
            Candidate { alignment, search_overlap: 0.9, blocked: 0.0, margin: None }
        });
        verdict_on(best.as_ref(), cut_short, &LocalizationSettings::default())
    }

    #[test]
    fn what_rays_say_counts_and_a_search_that_was_cut_short_rules_nothing_out() {
        for told in Verdict::ALL {
            assert_eq!(verdict(Some(told), false), (told, "as rays say".into()));
            let expected = if told == Verdict::Accepted { Verdict::Ambiguous } else { told };
            assert_eq!(verdict(Some(told), true).0, expected);
        }
        assert_eq!(verdict(None, false).0, Verdict::LowOverlap);
        assert_eq!(verdict(None, true).0, Verdict::Ambiguous);
    }
}
