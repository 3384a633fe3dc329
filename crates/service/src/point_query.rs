//! How a query of points is answered from a view of a map: the server's, or a replica's.

use bytes::Bytes;
use uuid::Uuid;

use super::{MapVersion, PointAnswer, PointQuery, Reason, ServiceError, check_not_stopped};
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::{ContentVersion, LongRead, MapView};
use mrol_map::util::StopSignal;
use mrol_map::voxel::{Lattice, LatticeFromPoints};

/// Points that are looked up before it is asked whether somebody waits for the answer: a millisecond or less. A multiple
/// of the bits in a word.
pub(super) const POINTS_PER_STEP: usize = 64 << 10;

impl PointQuery {
    /// The answer in `view`, which covers the points and has the keep-outs where they count, of the map `map_uuid` on
    /// `lattice`.
    ///
    /// # Errors
    /// `InvalidArgument` for a point in no voxel, named by its place.
    pub fn answer_in(
        &self,
        view: MapView<'_>,
        long_read: Option<LongRead<'_>>,
        map_uuid: Uuid,
        lattice: &Lattice,
        stop: StopSignal<'_>,
    ) -> Result<PointAnswer, ServiceError> {
        let points = self.points.as_slice();
        let map_from_points = self.map_from_points.unwrap_or_else(Pose::identity);
        let quantize = lattice.from_points(&map_from_points);
        let mut occupied = vec![0; points.len().div_ceil(64)];
        let mut all_have_a_voxel = true;
        for (points, words) in points.chunks(POINTS_PER_STEP).zip(occupied.chunks_mut(POINTS_PER_STEP / 64)) {
            check_not_stopped(stop)?;
            all_have_a_voxel &= view.query(points, &quantize, self.level, self.lookup, words);
        }
        let ContentVersion { revision, hash } = view.version();
        let keep_outs = view.keep_outs().filter(|_| self.keep_out).cloned();
        // Changes do not wait until the points are compared with shapes.
        drop((view, long_read));
        if !all_have_a_voxel {
            return Err(point_without_voxel(points, &quantize, lattice));
        }
        if let Some(keep_outs) = keep_outs {
            keep_outs.mark(points, &map_from_points, &mut occupied, stop);
            check_not_stopped(stop)?;
        }
        Ok(PointAnswer {
            points: points.len(),
            points_occupied: occupied.iter().map(|word| word.count_ones() as usize).sum(),
            occupied: bitmap(occupied, points.len()),
            version: MapVersion { revision, map_uuid, content_hash: Some(hash) },
        })
    }
}

/// Names the first point that falls in no voxel.
pub(super) fn point_without_voxel(
    points: &[Point],
    quantize: &LatticeFromPoints,
    lattice: &Lattice,
) -> ServiceError {
    let place = points.iter().position(|&point| quantize.index(point).is_none()).unwrap_or_default();
    without_voxel(&format!("points[{place}]"), points[place], lattice)
}

/// Says why the point of a field falls in no voxel.
pub(super) fn without_voxel(field: &str, point: Point, lattice: &Lattice) -> ServiceError {
    let (min_m, end_m) = lattice.range_m();
    let (reason, what) = match point.is_finite() {
        true => (Reason::PointOutOfRange, format!("outside the map's range of {min_m} to {end_m} m")),
        false => (Reason::PointNotFinite, "not finite".to_owned()),
    };
    ServiceError::new(reason, format!("{field} is {what}: {point:?}"))
}

/// The first `points` bits of `words`, as bytes: bit i % 8 (lowest first) of byte i / 8.
pub(super) fn bitmap(words: Vec<u64>, points: usize) -> Bytes {
    struct Owner(Vec<u64>);
    impl AsRef<[u8]> for Owner {
        fn as_ref(&self) -> &[u8] {
            bytemuck::cast_slice(&self.0)
        }
    }
    let words = if cfg!(target_endian = "big") { words.into_iter().map(u64::to_le).collect() } else { words };
    Bytes::from_owner(Owner(words)).slice(..points.div_ceil(8))
}
