//! Bodies, and what checks of them have in common.

use bytes::Bytes;

use super::keep_outs::{keep_outs_from, keep_outs_of};
use crate::wire::pb;
use crate::wire::values::{InField, bitmap_of, bytes_of, count_from, numbers_of, voxels_of, words_of};
use mrol_map::map::Region;
use mrol_map::planning::{Body, Clearance, Hit, Link, Met, NUMBERS_PER_POSE, Sphere, Surroundings, Unknown};
use mrol_map::voxel::VoxelKey;
use mrol_service::{CheckAs, Collisions, PointCloud, Reason, ServiceError};

/// Numbers of a sphere: its center and its radius.
const NUMBERS_PER_SPHERE: usize = 4;
/// The link of nothing.
const NO_LINK: u32 = u32::MAX;

impl pb::Body {
    /// Number of its links, and of the spheres and points of all of them.
    pub fn parts(&self) -> usize {
        let parts = |link: &pb::Link| {
            let spheres = link.spheres_f32le.len() / (NUMBERS_PER_SPHERE * size_of::<f32>());
            1 + spheres + link.points.as_ref().map_or(0, pb::Points::count)
        };
        self.links.iter().map(parts).sum()
    }

    /// The same body in memory of its own: it keeps nothing of the message that it came in.
    pub fn copied(&self) -> Self {
        let link = |link: &pb::Link| pb::Link {
            spheres_f32le: Bytes::copy_from_slice(&link.spheres_f32le),
            points: link.points.as_ref().map(pb::Points::copied),
            padding_m: link.padding_m,
        };
        Self { links: self.links.iter().map(link).collect() }
    }

    /// Bytes of memory that its copy takes.
    pub fn copied_bytes(&self) -> usize {
        let points = |points: &pb::Points| points.xyz_f32le.len() + size_of_val(&*points.xyz);
        let link = |link: &pb::Link| {
            size_of::<pb::Link>() + link.spheres_f32le.len() + link.points.as_ref().map_or(0, points)
        };
        self.links.iter().map(link).sum()
    }
}

impl pb::Points {
    fn count(&self) -> usize {
        self.xyz_f32le.len() / size_of::<mrol_map::geometry::Point>() + self.xyz.len() / 3
    }

    fn copied(&self) -> Self {
        Self { xyz_f32le: Bytes::copy_from_slice(&self.xyz_f32le), xyz: self.xyz.clone() }
    }
}

impl TryFrom<pb::Body> for Body {
    type Error = ServiceError;

    fn try_from(body: pb::Body) -> Result<Self, ServiceError> {
        let link =
            |(number, link): (usize, pb::Link)| link.try_into().in_field(&format!("body.links[{number}]"));
        let links = body.links.into_iter().enumerate().map(link).collect::<Result<_, _>>()?;
        Self::new(links).in_field("body")
    }
}

impl From<&Body> for pb::Body {
    fn from(body: &Body) -> Self {
        Self { links: body.links().iter().map(Into::into).collect() }
    }
}

impl TryFrom<pb::Link> for Link {
    type Error = ServiceError;

    fn try_from(link: pb::Link) -> Result<Self, ServiceError> {
        let spheres = spheres_from(&link.spheres_f32le)?;
        // No points beside spheres are none; a list of points that is all of a link, and empty, is a mistake.
        let is_none = |points: &pb::Points| points.xyz.is_empty() && points.xyz_f32le.is_empty();
        let points = match link.points.filter(|points| spheres.is_empty() || !is_none(points)) {
            Some(points) => PointCloud::try_from(points).in_field("points")?.as_slice().to_vec(),
            None => Vec::new(),
        };
        Ok(Self { spheres, points, padding_m: link.padding_m })
    }
}

impl From<&Link> for pb::Link {
    fn from(link: &Link) -> Self {
        let points = (!link.points.is_empty()).then(|| PointCloud::from(link.points.clone()).into());
        Self { spheres_f32le: spheres_bytes(&link.spheres), points, padding_m: link.padding_m }
    }
}

/// Spheres, four numbers each.
pub(super) fn spheres_from(bytes: &Bytes) -> Result<Vec<Sphere>, ServiceError> {
    let numbers = whole_from(bytes, NUMBERS_PER_SPHERE, "spheres_f32le")?;
    let spheres = numbers.as_chunks::<NUMBERS_PER_SPHERE>().0.iter();
    Ok(spheres.map(|&[x, y, z, radius_m]| Sphere { center_m: [x, y, z], radius_m }).collect())
}

/// The inverse of [`spheres_from`].
pub(super) fn spheres_bytes(spheres: &[Sphere]) -> Bytes {
    bytes_of(spheres.iter().flat_map(|Sphere { center_m: [x, y, z], radius_m }| [*x, *y, *z, *radius_m]))
}

/// Poses of links, seven numbers each.
pub(super) fn configurations_from(bytes: &Bytes) -> Result<Vec<f32>, ServiceError> {
    whole_from(bytes, NUMBERS_PER_POSE, "configurations_f32le")
}

/// Counts, as many as there are.
pub(super) fn counts_from(bytes: &Bytes, field: &str) -> Result<Vec<u32>, ServiceError> {
    numbers_of(bytes, bytes.len() / size_of::<u32>(), field)
}

/// Floats, `each` at a time.
fn whole_from(bytes: &Bytes, each: usize, field: &str) -> Result<Vec<f32>, ServiceError> {
    if !bytes.len().is_multiple_of(each * size_of::<f32>()) {
        let message =
            format!("{field} must have {each} numbers of 4 bytes each time, got {} bytes", bytes.len());
        return Err(ServiceError::new(Reason::BadArray, message));
    }
    numbers_of(bytes, bytes.len() / size_of::<f32>(), field)
}

/// What counts for a check.
pub(super) fn surroundings_from(
    ignored: Vec<pb::Region>,
    unknown: i32,
) -> Result<Surroundings, ServiceError> {
    let region = |(number, region): (usize, pb::Region)| {
        Region::try_from(region).in_field(&format!("ignored[{number}]"))
    };
    let ignored = ignored.into_iter().enumerate().map(region).collect::<Result<_, _>>()?;
    Ok(Surroundings { ignored, unknown: unknown_from(unknown, Reason::BadCheck)? })
}

/// What unknown voxels count as.
pub(super) fn unknown_from(unknown: i32, reason: Reason) -> Result<Unknown, ServiceError> {
    match pb::Unknown::try_from(unknown) {
        Ok(pb::Unknown::Unspecified | pb::Unknown::Free) => Ok(Unknown::Free),
        Ok(pb::Unknown::Occupied) => Ok(Unknown::Occupied),
        Err(_) => {
            let message = format!("unknown must be 0, 1 (free) or 2 (occupied), got {unknown}");
            Err(ServiceError::new(reason, message))
        }
    }
}

impl From<Unknown> for pb::Unknown {
    fn from(unknown: Unknown) -> Self {
        match unknown {
            Unknown::Free => Self::Free,
            Unknown::Occupied => Self::Occupied,
        }
    }
}

/// The regions that do not count.
pub(super) fn ignored_of(surroundings: Surroundings) -> Vec<pb::Region> {
    surroundings.ignored.into_iter().map(Into::into).collect()
}

/// How a check is answered.
pub(super) fn answer_from(answer: i32, clearance_max_m: Option<f32>) -> Result<CheckAs, ServiceError> {
    let answer_as = match pb::CheckAnswer::try_from(answer) {
        Ok(pb::CheckAnswer::Unspecified | pb::CheckAnswer::Colliding) => CheckAs::Colliding,
        Ok(pb::CheckAnswer::FirstHit) => CheckAs::FirstHit,
        Ok(pb::CheckAnswer::Clearance) => return Ok(CheckAs::Clearance { most_m: clearance_max_m }),
        Err(_) => {
            let message =
                format!("answer must be 0, 1 (colliding), 2 (first hit) or 3 (clearance), got {answer}");
            return Err(ServiceError::new(Reason::BadCheck, message));
        }
    };
    if clearance_max_m.is_some() {
        let message = "clearance_max_m goes with the answer clearance";
        return Err(ServiceError::new(Reason::BadCheck, message));
    }
    Ok(answer_as)
}

/// The inverse of [`answer_from`].
pub(super) fn answer_of(answer: CheckAs) -> (pb::CheckAnswer, Option<f32>) {
    match answer {
        CheckAs::Colliding => (pb::CheckAnswer::Colliding, None),
        CheckAs::FirstHit => (pb::CheckAnswer::FirstHit, None),
        CheckAs::Clearance { most_m } => (pb::CheckAnswer::Clearance, most_m),
    }
}

/// The packed key of the voxel that is met; 0 where none is.
fn voxel_bits(hit: &Option<Hit>) -> u64 {
    hit.as_ref().and_then(|hit| hit.met.voxel()).map_or(0, VoxelKey::to_bits)
}

impl From<Collisions> for pb::Collisions {
    fn from(collisions: Collisions) -> Self {
        let (checked, words) = (collisions.checked(), collisions.words());
        let colliding_count = words.iter().map(|word| u64::from(word.count_ones())).sum();
        let all = Self {
            checked: checked as u64,
            colliding: bitmap_of(words, checked),
            colliding_count,
            ..Self::default()
        };
        match collisions {
            Collisions::Colliding { .. } => all,
            Collisions::FirstHits(hits) => Self {
                hit_keep_outs: keep_outs_of(hits.iter().map(|hit| hit.as_ref()?.met.keep_out())),
                hit_links_u32le: bytes_of(
                    hits.iter().map(|hit| hit.as_ref().map_or(NO_LINK, |hit| hit.link)),
                ),
                hit_parts_u32le: bytes_of(hits.iter().map(|hit| hit.as_ref().map_or(0, |hit| hit.part))),
                hit_voxels_u64le: bytes_of(hits.iter().map(voxel_bits)),
                ..all
            },
            Collisions::Clearances(clearances) => Self {
                clearances_m_f32le: bytes_of(clearances.iter().map(|of| of.distance_m)),
                nearest_links_u32le: bytes_of(clearances.iter().map(|of| of.link.unwrap_or(NO_LINK))),
                ..all
            },
        }
    }
}

impl TryFrom<pb::Collisions> for Collisions {
    type Error = ServiceError;

    fn try_from(of: pb::Collisions) -> Result<Self, ServiceError> {
        let checked = count_from(of.checked);
        let link = |link: u32| (link != NO_LINK).then_some(link);
        if !of.hit_links_u32le.is_empty() {
            let links = numbers_of(&of.hit_links_u32le, checked, "hit_links_u32le")?;
            let parts = numbers_of(&of.hit_parts_u32le, checked, "hit_parts_u32le")?;
            let voxels = voxels_of(&of.hit_voxels_u64le, checked, "hit_voxels_u64le")?;
            let mut keep_outs = keep_outs_from(of.hit_keep_outs, checked, "hit_keep_outs")?.into_iter();
            let hit = |((of, part), voxel): ((u32, u32), VoxelKey)| {
                let met = keep_outs.next().flatten().map_or(Met::Voxel(voxel), Met::KeepOut);
                Some(Hit { link: link(of)?, part, met })
            };
            return Ok(Self::FirstHits(links.into_iter().zip(parts).zip(voxels).map(hit).collect()));
        }
        if !of.clearances_m_f32le.is_empty() {
            let distances = numbers_of(&of.clearances_m_f32le, checked, "clearances_m_f32le")?;
            let links = numbers_of(&of.nearest_links_u32le, checked, "nearest_links_u32le")?;
            let clearance = |(distance_m, of): (f32, u32)| Clearance { distance_m, link: link(of) };
            return Ok(Self::Clearances(distances.into_iter().zip(links).map(clearance).collect()));
        }
        Ok(Self::Colliding { words: words_of(&of.colliding, checked, "colliding")?, checked })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_map::geometry::Point;

    #[test]
    fn links_count_as_parts_and_a_message_counts_as_its_body_does() {
        let sphere = Sphere { center_m: [0.0; 3], radius_m: 0.1 };
        let full =
            Link { spheres: vec![sphere; 2], points: vec![Point::new(0.0, 0.0, 0.0); 3], padding_m: 0.0 };
        let body = Body::new(vec![Link::default(), full]).unwrap();
        let message = pb::Body::from(&body);
        assert_eq!((message.parts(), body.parts()), (7, 7));
        let listed = pb::Points { xyz: vec![0.0; 9], ..pb::Points::default() };
        let link = pb::Link { points: Some(listed), ..pb::Link::default() };
        assert_eq!(pb::Body { links: vec![link] }.parts(), 4);
        assert_eq!(message.copied(), message);
        assert_eq!(message.copied_bytes(), 2 * size_of::<pb::Link>() + 2 * 16 + 3 * 12);
    }
}
