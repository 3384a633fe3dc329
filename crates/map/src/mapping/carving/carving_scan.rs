//! A scan that carves: the voxels that it saw through.

use super::settings::CarvingSettings;
use super::thin_things::{ThinThings, with_what_hangs_on};
use crate::geometry::{Point, Pose};
use crate::map::{MultiResolutionMap, Region, ScanRecord};
use crate::mapping::error::MappingError;
use crate::util::StopSignal;
use crate::visibility::{ScanRays, ScanSurface, SensorRays, SurfaceSettings};
use crate::voxel::{BlockMask, Lattice, VoxelKey, VoxelSet};

/// Blocks of voxels that are looked at between two looks at the stop signal.
const BLOCKS_PER_STOP_CHECK: usize = 16;

/// What a scan saw through.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Carving {
    /// Finest voxels that were occupied, and that the scan saw through.
    pub voxels: VoxelSet,
    /// The revision of the map in which they were.
    pub revision: u64,
}

impl Carving {
    /// This without the voxels that a change which came between took out or touched: they are gone, or another scan saw
    /// something there meanwhile.
    pub fn cut(&mut self, touched: &VoxelSet) {
        if !self.voxels.is_disjoint(touched) {
            self.voxels = self.voxels.difference(touched);
        }
    }

    /// What is carved of a map that is at `revision` now: nothing where something came between.
    pub(in crate::mapping) fn at(self, revision: u64) -> VoxelSet {
        if self.revision == revision { self.voxels } else { VoxelSet::default() }
    }
}

/// A scan that carves, where it was found.
pub(in crate::mapping) struct CarvingScan<'a> {
    /// Where its rays ended, those at the robot itself too.
    pub(in crate::mapping) rays: ScanRays<'a>,
    pub(in crate::mapping) record: &'a ScanRecord,
    /// How far the sensor moved while the points were measured, meters.
    pub(in crate::mapping) moved_m: f64,
    /// How its rays lie, where the sensor is known.
    pub(in crate::mapping) sensor: Option<SensorRays>,
}

impl CarvingScan<'_> {
    /// The voxels of `map` that the scan saw through.
    ///
    /// # Errors
    /// When `stop` said so.
    pub(in crate::mapping) fn carve(
        &self,
        map: &MultiResolutionMap,
        settings: &CarvingSettings,
        stop: StopSignal<'_>,
    ) -> Result<Carving, MappingError> {
        let resolution_m = map.lattice().resolution_m(0);
        let thresholds = settings.thresholds;
        let sample_step = f64::from(thresholds.sample_step);
        let surface = SurfaceSettings {
            grazing_rad: settings.grazing_deg.to_radians() as f32,
            noise_m: resolution_m as f32,
            spacing_m: (sample_step * resolution_m * f64::from(2 * settings.margin_voxels + 1)) as f32,
            sensor: self.sensor,
            thresholds,
        };
        let surface = ScanSurface::of(self.rays, surface);
        let region = surface.as_ref().and_then(|surface| self.seen_region(surface, settings));
        let (Some(surface), Some(region)) = (surface, region) else { return Ok(Carving::default()) };
        let (occupied, revision) = occupied_in(map, &region, stop);
        let solid = self.solid(&surface, map.lattice(), settings);
        let view = CarvingView {
            surface: &surface,
            solid: &solid,
            lattice: map.lattice(),
            sensor_from_map: self.record.pose.map_from_sensor.inverse(),
            radius_m: (resolution_m * 3f64.sqrt() / 2.0 + self.moved_m) as f32,
            gap_max_m: (f64::from(thresholds.carved_gap_max) * resolution_m) as f32,
            settings,
        };
        let candidates = occupied.difference(&solid);
        let seen_through = |&(block, ref mask): &(VoxelKey, BlockMask)| {
            let view = &view;
            mask.cells(0).map(move |cell| cell.voxel(block)).filter(|voxel| view.sees_through(*voxel))
        };
        let missed: VoxelSet =
            stop.paced(candidates.blocks(), BLOCKS_PER_STOP_CHECK).flat_map(seen_through).collect();
        let map_from_sensor = &self.record.pose.map_from_sensor;
        let thin = ThinThings::among(
            &candidates,
            &surface,
            map.lattice(),
            map_from_sensor,
            view.radius_m,
            &thresholds,
        );
        let gone = |&(block, ref mask): &(VoxelKey, BlockMask)| {
            let thin = &thin;
            mask.cells(0).map(move |cell| cell.voxel(block)).filter(|voxel| !thin.may_be_at(*voxel))
        };
        let wide: Vec<VoxelKey> = stop.paced(missed.blocks(), BLOCKS_PER_STOP_CHECK).flat_map(gone).collect();
        let voxels = with_what_hangs_on(wide, &missed);
        if stop.is_stopped() {
            return Err(MappingError::Stopped);
        }
        Ok(Carving { voxels, revision })
    }

    /// A box around what the scan saw within its range: no other voxel was seen through.
    fn seen_region(&self, surface: &ScanSurface, settings: &CarvingSettings) -> Option<Region> {
        let pose = &self.record.pose.map_from_sensor;
        let origin: [f64; 3] = pose.translation.vector.into();
        let seen = surface.seen(settings.range_max_m as f32);
        let corners = seen.fold((origin, origin), |(min_m, max_m), offset| {
            let point: [f64; 3] = (pose * nalgebra::Point3::from(offset.map(f64::from))).into();
            (
                std::array::from_fn(|axis| f64::min(min_m[axis], point[axis])),
                std::array::from_fn(|axis| f64::max(max_m[axis], point[axis])),
            )
        });
        Region::cuboid(corners.0, corners.1).ok()
    }

    /// The voxels of the surface that the scan shows: those of its points, and those between them.
    fn solid(&self, surface: &ScanSurface, lattice: &Lattice, settings: &CarvingSettings) -> VoxelSet {
        let mut samples = Vec::new();
        surface.for_samples(settings.range_max_m as f32, |offset| samples.push(Point::from(offset)));
        let from_points = lattice.from_points(&self.record.pose.map_from_sensor);
        let (between, _) = VoxelSet::of_points(&samples, &from_points);
        between.blocks().iter().chain(self.record.voxels.blocks()).copied().collect()
    }
}

/// The finest voxels of a map in a region, and the map's revision.
fn occupied_in(map: &MultiResolutionMap, region: &Region, stop: StopSignal<'_>) -> (VoxelSet, u64) {
    let long_read = map.long_read();
    let view = long_read.view();
    (view.finest_in_until(region, 0, stop), view.revision())
}

/// What a scan sees of voxels.
struct CarvingView<'a> {
    surface: &'a ScanSurface,
    solid: &'a VoxelSet,
    lattice: &'a Lattice,
    sensor_from_map: Pose,
    /// Of a ball around a voxel.
    radius_m: f32,
    /// How far the scan's points may lie from each other there.
    gap_max_m: f32,
    settings: &'a CarvingSettings,
}

impl CarvingView<'_> {
    fn sees_through(&self, voxel: VoxelKey) -> bool {
        let center_m = nalgebra::Point3::from(self.lattice.center_m(voxel, 0));
        let offset = self.sensor_from_map * center_m;
        let range_m = self.settings.range_max_m;
        if offset.coords.norm_squared() > range_m * range_m {
            return false;
        }
        let offset = offset.coords.map(|c| c as f32).into();
        self.surface.depth_exceeds(offset, self.radius_m)
            && !self.is_near_solid(voxel)
            && self.surface.sees_through(offset, self.radius_m, self.gap_max_m)
    }

    /// True of a voxel within the margin of the scan's surface.
    fn is_near_solid(&self, voxel: VoxelKey) -> bool {
        let margin = self.settings.margin_voxels as i32;
        let around = || -margin..=margin;
        let [x, y, z] = voxel.index();
        around().any(|dz| {
            around().any(|dy| {
                around().any(|dx| {
                    VoxelKey::new([x + dx, y + dy, z + dz]).is_some_and(|near| self.solid.contains(near))
                })
            })
        })
    }
}
