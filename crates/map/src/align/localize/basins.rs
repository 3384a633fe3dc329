//! Basins: the best poses of a search, no two of which are the same place.

use crate::geometry::Pose;

/// A pose that a scan fits, with its score.
#[derive(Debug, Clone, Copy)]
pub(super) struct Basin {
    pub(super) map_from_sensor: Pose,
    /// Points of the sample that fall on the map.
    pub(super) score: u16,
}

/// The best places found so far, no two of them the same.
#[derive(Debug)]
pub(super) struct Basins {
    /// The basins, best first.
    found: Vec<Basin>,
    radius_m: f64,
    radius_rad: f64,
    most: usize,
}

impl Basins {
    /// An empty list of up to `most` places. Poses that differ by less than `radius_m` and `radius_rad` are one place.
    pub(super) fn new(radius_m: f64, radius_rad: f64, most: usize) -> Self {
        Self { found: Vec::new(), radius_m, radius_rad, most }
    }

    /// The places, best first.
    pub(super) fn found(&self) -> &[Basin] {
        &self.found
    }

    /// The best score; 0 without a place.
    pub(super) fn best(&self) -> u16 {
        self.found.first().map_or(0, |basin| basin.score)
    }

    /// The score that a new place has to exceed.
    pub(super) fn entry(&self) -> u16 {
        if self.found.len() < self.most { 0 } else { self.found.last().map_or(0, |basin| basin.score) }
    }

    /// True when every pose within `distance_m` and `turn_rad` of `center` is the same place as one that scores at
    /// least `bound`.
    pub(super) fn cover(&self, center: &Pose, distance_m: f64, turn_rad: f64, bound: u16) -> bool {
        self.found.iter().take_while(|basin| basin.score >= bound).any(|basin| {
            let between = basin.map_from_sensor.inv_mul(center);
            between.translation.vector.norm() + distance_m <= self.radius_m
                && between.rotation.angle() + turn_rad <= self.radius_rad
        })
    }

    /// Adds a pose, unless the same place is in the list with at least its score. Worse poses of the same place are
    /// removed.
    pub(super) fn offer(&mut self, offered: Basin) {
        if self.cover(&offered.map_from_sensor, 0.0, 0.0, offered.score) {
            return;
        }
        let better = self.found.partition_point(|basin| basin.score >= offered.score);
        let (radius_m, radius_rad) = (self.radius_m, self.radius_rad);
        let apart = |basin: &Basin| {
            let between = basin.map_from_sensor.inv_mul(&offered.map_from_sensor);
            between.translation.vector.norm() > radius_m || between.rotation.angle() > radius_rad
        };
        self.found.insert(better, offered);
        let mut place = 0;
        self.found.retain(|basin| {
            place += 1;
            place <= better + 1 || apart(basin)
        });
        self.found.truncate(self.most);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn basin(x: f64, score: u16) -> Basin {
        Basin { map_from_sensor: Pose::translation(x, 0.0, 0.0), score }
    }

    fn scores(basins: &Basins) -> Vec<u16> {
        basins.found().iter().map(|basin| basin.score).collect()
    }

    #[test]
    fn of_poses_of_one_place_the_best_is_kept() {
        let mut basins = Basins::new(1.0, 0.2, 3);
        for (x, score) in [(0.0, 5), (0.5, 7), (0.6, 7), (5.0, 6), (5.5, 6), (0.9, 3)] {
            basins.offer(basin(x, score));
        }
        assert_eq!(scores(&basins), [7, 6]);
        assert_eq!(basins.found()[0].map_from_sensor.translation.x, 0.5);
    }

    #[test]
    fn a_turn_makes_another_place() {
        let mut basins = Basins::new(1.0, 0.2, 3);
        basins.offer(basin(0.0, 5));
        let turned = Pose::rotation(nalgebra::Vector3::z() * 0.3);
        basins.offer(Basin { map_from_sensor: turned, score: 4 });
        assert_eq!(scores(&basins), [5, 4]);
    }

    #[test]
    fn only_the_best_places_are_kept_and_the_last_is_the_entry() {
        let mut basins = Basins::new(1.0, 0.2, 3);
        for (x, score) in [(0.0, 5), (10.0, 7)] {
            basins.offer(basin(x, score));
            assert_eq!(basins.entry(), 0);
        }
        for (x, score) in [(20.0, 6), (30.0, 4), (40.0, 9)] {
            basins.offer(basin(x, score));
        }
        assert_eq!((scores(&basins), basins.best(), basins.entry()), (vec![9, 7, 6], 9, 6));
    }

    #[test]
    fn a_cell_is_covered_only_by_a_place_as_good_that_holds_all_of_it() {
        let mut basins = Basins::new(1.0, 0.2, 3);
        basins.offer(basin(0.0, 5));
        let center = Pose::translation(0.5, 0.0, 0.0);
        assert!(basins.cover(&center, 0.4, 0.1, 5));
        assert!(!basins.cover(&center, 0.4, 0.1, 6), "it may hold something better");
        assert!(!basins.cover(&center, 0.6, 0.1, 5) && !basins.cover(&center, 0.4, 0.3, 5));
    }
}
