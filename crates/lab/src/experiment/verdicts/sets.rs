//! Sets of real scans, maps of some of them, and the scans that are aligned to these.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::outcomes::Outcomes;
use super::trial::{aligned, mapped, off_by};
use crate::workload::Scan;
use mrol_map::align::{AlignmentSettings, RayAgreement, ray_agreement};
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::MultiResolutionMap;
use mrol_map::mapping::ViewpointSettings;

/// How far guesses are off, meters and degrees.
pub const GUESSES: [(f64, f64); 5] = [(0.1, 3.0), (0.3, 10.0), (1.0, 30.0), (3.0, 90.0), (8.0, 180.0)];

/// Which scans of a set its map is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MapOf {
    /// The one in the middle.
    One,
    /// That and the next but one.
    Two,
    /// Every other one.
    Half,
}

impl MapOf {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::One, Self::Two, Self::Half];

    /// Its name in tables.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::One => "one scan",
            Self::Two => "two scans",
            Self::Half => "half",
        }
    }

    fn has(self, scan: usize, scans: usize) -> bool {
        let middle = scans / 2;
        match self {
            Self::One => scan == middle,
            Self::Two => scan == middle || scan == (middle + 2) % scans,
            Self::Half => scan.is_multiple_of(2),
        }
    }
}

/// A set of scans with true poses.
#[derive(Debug)]
pub struct Set {
    /// Its name.
    pub name: String,
    /// The place that it shows: sets of the same place have the same.
    pub place: String,
    /// Which scans leave viewpoints in its maps.
    pub viewpoints: ViewpointSettings,
    pub(super) scans: Vec<(Vec<Point>, Pose)>,
    pub(super) resolution_m: f64,
}

/// A map of some scans of a set, and the scans that are aligned to it.
#[derive(Debug)]
pub struct Trials<'a> {
    pub(super) map: MultiResolutionMap,
    of_map: Vec<Pose>,
    pub(super) others: Vec<&'a (Vec<Point>, Pose)>,
    pub(super) resolution_m: f64,
}

impl Set {
    /// A set of at most `most` of `scans`, evenly chosen; scans without a pose are left out.
    pub fn of(name: &str, place: &str, scans: Vec<Scan>, resolution_m: f64, most: usize) -> Self {
        let stride = scans.len().div_ceil(most.max(1)).max(1);
        let posed = scans.into_iter().step_by(stride);
        let scans = posed.filter_map(|scan| Some((scan.points, scan.map_from_sensor?))).collect();
        let viewpoints = ViewpointSettings::default();
        Self { name: name.into(), place: place.into(), viewpoints, scans, resolution_m }
    }

    /// A map of some of its scans at their true poses; none of settings out of range, or where no scan is left to
    /// align.
    pub fn trials(&self, which: MapOf) -> Option<Trials<'_>> {
        let count = self.scans.len();
        let (of_map, others): (Vec<_>, Vec<_>) =
            self.scans.iter().enumerate().partition(|(k, _)| which.has(*k, count));
        let map = mapped(of_map.iter().map(|(_, scan)| *scan), self.resolution_m, self.viewpoints)?;
        let others: Vec<_> = others.into_iter().map(|(_, scan)| scan).collect();
        let of_map = of_map.iter().map(|(_, (_, pose))| *pose).collect();
        (!others.is_empty()).then_some(Trials { map, of_map, others, resolution_m: self.resolution_m })
    }
}

impl Trials<'_> {
    /// Aligns each scan from a guess off by so much.
    pub fn align_off(
        &self,
        off: (f64, f64),
        settings: &AlignmentSettings,
        random: &mut ChaCha8Rng,
    ) -> Outcomes {
        let mut outcomes = Outcomes::default();
        for (points, truth) in &self.others {
            let found = aligned(&self.map, points, &off_by(truth, off, random).into(), settings);
            outcomes.add(&found, Some(truth), self.resolution_m);
        }
        outcomes
    }

    /// Aligns the scans of another place, from guesses near this map's viewpoints.
    pub fn align_others(
        &self,
        other: &Set,
        settings: &AlignmentSettings,
        random: &mut ChaCha8Rng,
    ) -> Outcomes {
        let mut outcomes = Outcomes::default();
        for (points, _) in &other.scans {
            let viewpoint = &self.of_map[random.random_range(0..self.of_map.len())];
            let found = aligned(&self.map, points, &off_by(viewpoint, GUESSES[2], random).into(), settings);
            outcomes.add(&found, None, self.resolution_m);
        }
        outcomes
    }

    /// How rays agree at the true pose of each scan, and at one 8 r_0 aside and turned by 10 degrees.
    pub fn agreements(
        &self,
        settings: &AlignmentSettings,
        random: &mut ChaCha8Rng,
    ) -> Vec<[RayAgreement; 2]> {
        let pair = |(points, truth): &&(Vec<Point>, Pose)| {
            let aside = off_by(truth, (8.0 * self.resolution_m, 10.0), random);
            let at = |pose| ray_agreement(&self.map, points, pose, settings);
            [at(truth), at(&aside)]
        };
        self.others.iter().map(pair).collect()
    }
}
