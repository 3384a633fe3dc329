//! Options of workloads, and of the maps that are made of them.

use std::fmt::{self, Display};

use clap::ValueEnum;

use crate::workload::{Order, Queries, Room, Scatter, ShotLayout, Shots, Site, Workload};
use mrol::console::error::CliError;
use mrol::console::map_report::count;
use mrol_map::bloom::FilterSettings;
use mrol_map::geometry::Point;
use mrol_map::map::{LEVELS_DEFAULT, MapSettings, MultiResolutionMap};

/// Name of a workload.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(in crate::cli) enum WorkloadName {
    /// Surfaces of a room of 14 x 9 x 3 m: 155 thousand voxels of 5 cm, as many as the paper's map has
    Room,
    /// Rolling terrain two voxels of 10 cm thick, --site-voxels in all
    Site,
    /// As many voxels of 5 cm as the paper's map has, anywhere at random; asked at random too
    Scatter,
}

/// Options of a workload.
#[derive(Debug, clap::Args)]
pub(in crate::cli) struct WorkloadOptions {
    /// A simulated workload
    #[arg(long, value_enum, default_value_t = WorkloadName::Room)]
    workload: WorkloadName,
    /// Voxels of a site, about
    #[arg(long, value_name = "N", default_value_t = Site::VOXELS as u64, value_parser = clap::value_parser!(u64).range(Site::VOXELS_RANGE))]
    site_voxels: u64,
    /// Order of the points: anywhere, as a spinning sensor of 64 rings sees the surface, or each voxel once [default:
    /// random; of points that are inserted, scan]
    #[arg(long, value_enum)]
    order: Option<Order>,
    /// Points of a pass
    #[arg(long, value_name = "N", default_value_t = 1_000_000, value_parser = clap::value_parser!(u64).range(1..=100_000_000))]
    queries: u64,
    /// Seed of the workload: the same seed gives the same voxels and points
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

impl WorkloadOptions {
    /// Sets the order to `usual` where none was given.
    pub(in crate::cli) fn usually(self, usual: Order) -> Self {
        Self { order: self.order.or(Some(usual)), ..self }
    }

    fn order(&self) -> Order {
        self.order.unwrap_or_default()
    }

    pub(in crate::cli) fn workload(&self) -> Workload {
        match self.workload {
            WorkloadName::Room => Workload::Room(Room),
            WorkloadName::Site => Workload::Site(Site::of(self.site_voxels as usize, self.seed)),
            WorkloadName::Scatter => Workload::Scatter(Scatter::of(Scatter::VOXELS, self.seed)),
        }
    }

    /// The points to ask about; `times` as many as were asked for.
    pub(in crate::cli) fn queries(&self, times: usize) -> Queries {
        // With the seed of the voxels, scattered points would coincide with the scattered voxels.
        let seed = self.seed.wrapping_add(0x5eed);
        self.workload().queries(self.order(), self.points() * times, seed)
    }

    /// The points to ask about, in the map frame.
    pub(in crate::cli) fn map_points(&self) -> Vec<Point> {
        self.workload().map_points(self.order(), self.points(), self.seed.wrapping_add(0x5eed))
    }

    pub(in crate::cli) fn seed(&self) -> u64 {
        self.seed
    }

    pub(in crate::cli) fn points(&self) -> usize {
        self.queries as usize
    }
}

impl Display for WorkloadOptions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = |value: &dyn Fn() -> Option<clap::builder::PossibleValue>| {
            value().map(|value| value.get_name().to_owned()).unwrap_or_default()
        };
        let scattered = self.workload == WorkloadName::Scatter && self.order() == Order::Scan;
        let order = if scattered { Order::Random } else { self.order() };
        write!(
            f,
            "{}, {} order",
            name(&|| self.workload.to_possible_value()),
            name(&|| order.to_possible_value())
        )
    }
}

/// Options of rays through a workload.
#[derive(Debug, clap::Args)]
pub(in crate::cli) struct ShotOptions {
    /// Places from which rays go
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    places: u16,
    /// Azimuths at each place
    #[arg(long, value_name = "N", default_value_t = 2000, value_parser = clap::value_parser!(u16).range(1..))]
    azimuths: u16,
    /// Elevations at each azimuth
    #[arg(long, value_name = "N", default_value_t = 500, value_parser = clap::value_parser!(u16).range(1..))]
    rings: u16,
}

impl ShotOptions {
    /// The rays.
    pub(in crate::cli) fn of(&self, workload: &WorkloadOptions) -> Shots {
        let [places, azimuths, rings] = [self.places, self.azimuths, self.rings].map(usize::from);
        workload.workload().shots(ShotLayout { places, azimuths, rings })
    }
}

/// Options of a map.
#[derive(Debug, clap::Args)]
pub(in crate::cli) struct MapOptions {
    /// Number of levels
    #[arg(long, default_value_t = LEVELS_DEFAULT)]
    levels: u32,
    /// Hash functions of the counting Bloom filters, k of eq. (1): 1 to 10
    #[arg(long, value_name = "K", default_value_t = FilterSettings::default().hashes)]
    filter_hashes: u32,
    /// Bits of the filters' planes a voxel, m / n of eq. (1): 1 to 4096
    #[arg(long, value_name = "BITS", default_value_t = FilterSettings::default().bits_per_key)]
    filter_bits_per_key: f64,
}

impl MapOptions {
    pub(in crate::cli) fn settings(&self, resolution_m: f64) -> Result<MapSettings, CliError> {
        let filter = FilterSettings { hashes: self.filter_hashes, bits_per_key: self.filter_bits_per_key };
        let settings = MapSettings { filter: Some(filter), ..MapSettings::new(resolution_m, self.levels) };
        settings.checked().map_err(CliError::usage)
    }

    /// Refuses a level that the map has not.
    pub(in crate::cli) fn check_level(&self, level: u32) -> Result<(), CliError> {
        let last = self.levels - 1;
        let message = || CliError::usage(format!("--level must lie in 0..={last}, got {level}"));
        (level <= last).then_some(()).ok_or_else(message)
    }

    /// The map of a workload.
    pub(in crate::cli) fn map_of(&self, workload: Workload) -> Result<MultiResolutionMap, CliError> {
        workload.map(self.settings(workload.resolution_m())?).map_err(CliError::usage)
    }
}

/// The size of a map as text: `154,880 voxels of 0.05 m`.
pub(in crate::cli) fn size_of(map: &MultiResolutionMap, level: u32) -> String {
    format!("{} voxels of {} m", count(map.voxels(level)), map.lattice().resolution_m(level))
}

/// Parses a number of repeats.
pub(in crate::cli) fn times(text: &str) -> Result<usize, String> {
    let times: usize = text.parse().map_err(|_| format!("{text:?} is no number"))?;
    (1..=10_000).contains(&times).then_some(times).ok_or_else(|| format!("1 to 10000, got {times}"))
}
