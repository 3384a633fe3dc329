//! Measurement of look-ups: several structures with the same queries.

use super::stopwatch::Runs;
use crate::rivals::{Structure, StructureName};
use crate::workload::Queries;
use mrol_map::map::Lookup;
use mrol_map::map::MultiResolutionMap;

/// Measurements of a structure.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// Name of the structure.
    pub name: StructureName,
    /// Duration of each pass over all points, nanoseconds a point.
    pub runs: Runs,
    /// Number of points of a pass.
    pub points: usize,
    /// Number of points that it called occupied, false positives included.
    pub occupied: usize,
    /// Number of points that it called occupied in voxels that are not.
    pub false_positives: usize,
    /// Bytes of memory of the structure.
    pub bytes: usize,
}

/// A structure gave a wrong answer, so that its times are worthless.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Disagreement {
    /// A structure calls occupied voxels free; the payload is the structure and the number of such points.
    #[error("{0} says of {1} points in occupied voxels that they are free")]
    Denies(&'static str, usize),
    /// An exact structure calls free voxels occupied; the payload is the structure and the number of such points.
    #[error("{0} says of {1} points in free voxels that they are occupied")]
    Invents(&'static str, usize),
}

/// Times `structures` on `level` of `map` in `passes` passes over all points, each after one that is not timed. The
/// structures take turns, so that other load of the machine affects all of them.
///
/// # Errors
/// When answers contradict those of the map's exact set.
pub fn compare(
    structures: &[(StructureName, Box<dyn Structure + '_>)],
    map: &MultiResolutionMap,
    level: u32,
    queries: &Queries,
    passes: usize,
) -> Result<Vec<Measured>, Disagreement> {
    let truth = truth(map, level, queries);
    let mut answers = vec![0; truth.len()];
    let mut measured = Vec::with_capacity(structures.len());
    for (name, structure) in structures {
        structure.occupied(&queries.points, &queries.map_from_points, &mut answers);
        measured.push(check(*name, structure.as_ref(), &answers, &truth, queries.points.len())?);
    }
    for _ in 0..passes {
        for ((_, structure), measured) in structures.iter().zip(&mut measured) {
            let mut ask = || structure.occupied(&queries.points, &queries.map_from_points, &mut answers);
            // An untimed pass first, so that what other structures left in the caches does not count.
            ask();
            measured.runs.time(queries.points.len(), ask);
        }
    }
    Ok(measured)
}

/// The answers of the exact set.
fn truth(map: &MultiResolutionMap, level: u32, queries: &Queries) -> Vec<u64> {
    let mut occupied = vec![0; queries.points.len().div_ceil(64)];
    let quantize = map.lattice().from_points(&queries.map_from_points);
    let view = map.view();
    view.query(&queries.points, &quantize, level, Lookup::Exact, &mut occupied);
    occupied
}

fn check(
    name: StructureName,
    structure: &dyn Structure,
    answers: &[u64],
    truth: &[u64],
    points: usize,
) -> Result<Measured, Disagreement> {
    let pairs = || answers.iter().zip(truth);
    let denied = ones(pairs().map(|(answer, truth)| truth & !answer));
    let false_positives = ones(pairs().map(|(answer, truth)| answer & !truth));
    if denied > 0 {
        return Err(Disagreement::Denies(name.as_str(), denied));
    }
    if name.is_exact() && false_positives > 0 {
        return Err(Disagreement::Invents(name.as_str(), false_positives));
    }
    let (occupied, bytes) = (ones(answers.iter().copied()), structure.bytes());
    Ok(Measured { name, runs: Runs::default(), points, occupied, false_positives, bytes })
}

fn ones(words: impl Iterator<Item = u64>) -> usize {
    words.map(|word| word.count_ones() as usize).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workload::{Order, Site, Workload};
    use mrol_map::geometry::{Point, Pose};
    use mrol_map::map::MapSettings;

    struct Always(bool);

    impl Structure for Always {
        fn occupied(&self, _: &[Point], _: &Pose, occupied: &mut [u64]) {
            occupied.fill(if self.0 { u64::MAX } else { 0 });
        }

        fn bytes(&self) -> usize {
            0
        }
    }

    fn compared(name: StructureName, structure: impl Structure) -> Result<Vec<Measured>, Disagreement> {
        let site = Workload::Site(Site::of(5000, 1));
        let map = site.map(MapSettings::new(site.resolution_m(), 2)).unwrap();
        compare(&[(name, Box::new(structure))], &map, 0, &site.queries(Order::Random, 640, 1), 3)
    }

    #[test]
    fn false_positives_are_counted_and_passes_timed() {
        let measured = compared(StructureName::Paper, Always(true)).unwrap().remove(0);
        assert_eq!((measured.points, measured.occupied, measured.runs.ns_per_item().len()), (640, 640, 3));
        assert!((200..640).contains(&measured.false_positives), "{measured:?}");
    }

    #[test]
    fn a_structure_that_is_wrong_is_not_timed() {
        let denies = compared(StructureName::Paper, Always(false)).unwrap_err();
        assert!(matches!(denies, Disagreement::Denies("paper", 1..)), "{denies}");
        let invents = compared(StructureName::Dense, Always(true)).unwrap_err();
        assert!(matches!(invents, Disagreement::Invents("dense", 200..)), "{invents}");
    }
}
