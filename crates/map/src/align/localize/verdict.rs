//! Verdict of global localization: whether the best candidate is where the scan was taken.

use super::answer::Candidate;
use super::settings::LocalizationSettings;
use crate::align::verdict::Verdict;

/// Verdict on the first of `ranked`, with the reason. It is accepted where it fits, is determined in every direction,
/// and no other place is as good.
pub(super) fn verdict_on(
    ranked: &[Candidate],
    cut_short: bool,
    settings: &LocalizationSettings,
) -> (Verdict, String) {
    let Some((best, others)) = ranked.split_first() else {
        let least = settings.search_overlap_min;
        return match cut_short {
            true => (Verdict::Ambiguous, "the search was cut short before it found a place".into()),
            false => (Verdict::LowOverlap, format!("no place has {least} of the scan on the map or near it")),
        };
    };
    let (overlap, blocked) = (best.alignment.overlap(), best.blocked);
    if overlap < settings.overlap_min {
        let least = settings.overlap_min;
        return (Verdict::LowOverlap, format!("overlap {overlap:.3} of the best place is below {least}"));
    }
    if blocked > settings.blocked_max {
        let most = settings.blocked_max;
        let reason = format!("{blocked:.3} of the rays pass through what the map holds, at most {most} may");
        return (Verdict::LowOverlap, reason);
    }
    if best.alignment.verdict != Verdict::Accepted {
        return (best.alignment.verdict, best.alignment.reason.clone());
    }
    if cut_short {
        return (Verdict::Ambiguous, "the search was cut short: other places are not ruled out".into());
    }
    match others.iter().find_map(|other| rivals(other, best, settings)) {
        Some((measure, a, b)) => {
            (Verdict::Ambiguous, format!("another place fits about as well: {measure} {a:.3} against {b:.3}"))
        }
        None => (Verdict::Accepted, format!("overlap {overlap:.3}, and no other place is as good")),
    }
}

/// The measure by which `other` is as good as `best`, with both values: overlap with the finest voxels, or with the
/// dilated map that both were found on. Where the scan does not belong to the map, many places score alike on the
/// dilated map, and one of them is best by chance.
fn rivals(
    other: &Candidate,
    best: &Candidate,
    settings: &LocalizationSettings,
) -> Option<(&'static str, f64, f64)> {
    let measures = [
        ("fit", other.fit(), best.fit()),
        ("overlap with the dilated map", other.search_overlap, best.search_overlap),
    ];
    measures.into_iter().find(|(_, other, best)| *other >= settings.ambiguous_share * best)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::align::verdict::Alignment;
    use crate::geometry::Pose;

    fn candidate(overlap: f64, search_overlap: f64, blocked: f64) -> Candidate {
        let alignment =
            Alignment { level_overlaps: vec![overlap], ..Alignment::trusted(Pose::identity(), 1, &[]) };
        Candidate { alignment, search_overlap, blocked, margin: None }
    }

    fn verdict(ranked: &[Candidate], cut_short: bool) -> Verdict {
        verdict_on(ranked, cut_short, &LocalizationSettings::default()).0
    }

    #[test]
    fn a_place_that_fits_and_has_no_rival_is_accepted() {
        let best = candidate(0.8, 0.95, 0.1);
        assert_eq!(verdict(std::slice::from_ref(&best), false), Verdict::Accepted);
        assert_eq!(verdict(&[best.clone(), candidate(0.6, 0.8, 0.1)], false), Verdict::Accepted);
        assert_eq!(verdict(&[best], true), Verdict::Ambiguous, "others are not ruled out");
    }

    #[test]
    fn a_rival_on_the_finest_voxels_or_on_the_dilated_map_makes_it_ambiguous() {
        let best = candidate(0.8, 0.95, 0.1);
        let of_fit = (candidate(0.78, 0.7, 0.1), "fit 0.");
        let of_search = (candidate(0.3, 0.94, 0.1), "overlap with the dilated map 0.940 against 0.950");
        for (rival, words) in [of_fit, of_search] {
            let ranked = [best.clone(), candidate(0.1, 0.1, 0.0), rival];
            let (verdict, reason) = verdict_on(&ranked, false, &LocalizationSettings::default());
            assert_eq!(verdict, Verdict::Ambiguous);
            assert!(reason.contains(words), "{reason}");
        }
    }

    #[test]
    fn a_place_that_does_not_fit_is_not_accepted_and_the_reason_has_the_figures() {
        let settings = LocalizationSettings::default();
        for (best, words) in
            [(candidate(0.3, 0.9, 0.0), ["0.300", "0.45"]), (candidate(0.9, 0.9, 0.6), ["0.600", "0.4"])]
        {
            let (verdict, reason) = verdict_on(&[best], false, &settings);
            assert_eq!(verdict, Verdict::LowOverlap);
            assert!(words.iter().all(|word| reason.contains(word)), "{reason}");
        }
        assert_eq!(verdict(&[], false), Verdict::LowOverlap);
        let open = candidate(0.9, 0.9, 0.0);
        let open =
            Candidate { alignment: Alignment { verdict: Verdict::Undetermined, ..open.alignment }, ..open };
        assert_eq!(verdict(&[open], false), Verdict::Undetermined);
    }
}
