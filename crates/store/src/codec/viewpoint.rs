//! Encoding of viewpoints: where scans saw through.

use std::sync::Arc;

use super::scan::{pose_from, pose_numbers};
use super::unreadable::Unreadable;
use crate::pb;
use mrol_map::map::ViewpointRecord;
use mrol_map::visibility::{IMAGE_BYTES_MAX, RangeImage, Viewpoint};

impl From<&ViewpointRecord> for pb::ScanViewpoint {
    fn from(ViewpointRecord { image, displaced }: &ViewpointRecord) -> Self {
        Self { image: image.to_bytes().into(), displaced_gaps: gaps_of(displaced.iter().copied()) }
    }
}

impl TryFrom<pb::ScanViewpoint> for ViewpointRecord {
    type Error = Unreadable;

    fn try_from(message: pb::ScanViewpoint) -> Result<Self, Unreadable> {
        Ok(Self {
            image: image_from(&message.image).map_err(|reason| format!("insertion.viewpoint: {reason}"))?,
            displaced: ascending_from(&message.displaced_gaps, "insertion.viewpoint.displaced_gaps")?,
        })
    }
}

impl From<(u64, &Viewpoint)> for pb::Viewpoint {
    fn from((revision, viewpoint): (u64, &Viewpoint)) -> Self {
        Self {
            revision,
            map_from_sensor: pose_numbers(viewpoint.map_from_sensor()),
            image: viewpoint.image().to_bytes().into(),
        }
    }
}

impl TryFrom<pb::Viewpoint> for (u64, Arc<Viewpoint>) {
    type Error = Unreadable;

    fn try_from(message: pb::Viewpoint) -> Result<Self, Unreadable> {
        let of_revision = |reason| format!("the viewpoint of revision {}: {reason}", message.revision);
        let pose = pose_from(&message.map_from_sensor).map_err(of_revision)?;
        let image = image_from(&message.image).map_err(of_revision)?;
        Ok((message.revision, Arc::new(Viewpoint::new(pose, image))))
    }
}

fn image_from(bytes: &[u8]) -> Result<RangeImage, Unreadable> {
    if bytes.len() > IMAGE_BYTES_MAX {
        return Err(format!("a range image of {} bytes, at most {IMAGE_BYTES_MAX} are one", bytes.len()));
    }
    RangeImage::from_bytes(bytes).map_err(|e| e.to_string())
}

/// Ascending numbers as the first, then the distance of each from the one before.
pub(crate) fn gaps_of(ascending: impl IntoIterator<Item = u64>) -> Vec<u64> {
    let mut before = 0;
    ascending.into_iter().map(|number| number - std::mem::replace(&mut before, number)).collect()
}

/// The inverse of [`gaps_of`]; no number comes twice.
pub(crate) fn ascending_from(gaps: &[u64], field: &str) -> Result<Vec<u64>, Unreadable> {
    let mut numbers = Vec::with_capacity(gaps.len());
    let mut before = 0u64;
    for (i, &gap) in gaps.iter().enumerate() {
        if i > 0 && gap == 0 {
            return Err(format!("{field} names {before} twice"));
        }
        before = before.checked_add(gap).ok_or_else(|| format!("{field} goes beyond 2^64"))?;
        numbers.push(before);
    }
    Ok(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_map::geometry::{Point, Pose};
    use mrol_map::visibility::Sweep;

    fn image() -> RangeImage {
        let points: Vec<_> = (0..900).map(|i| Point::new(3.0, (i % 30) as f32 * 0.1, 0.1)).collect();
        let range = Sweep::standing(40.0);
        RangeImage::of_points(&points, range, IMAGE_BYTES_MAX).unwrap()
    }

    #[test]
    fn a_viewpoint_comes_back_bit_for_bit_and_damage_is_named() {
        let viewpoint = Viewpoint::new(Pose::translation(0.1, -2.0, 1.0 / 3.0), image());
        let message = pb::Viewpoint::from((7, &viewpoint));
        let (revision, again) = message.clone().try_into().unwrap();
        assert_eq!((revision, &*again), (7, &viewpoint));
        let refused = |message: pb::Viewpoint| <(u64, Arc<Viewpoint>)>::try_from(message).unwrap_err();
        let short = pb::Viewpoint { image: message.image.slice(..40), ..message.clone() };
        assert!(refused(short).starts_with("the viewpoint of revision 7: a range image of 40 bytes"));
        let large = pb::Viewpoint { image: vec![1; 8193].into(), ..message.clone() };
        assert!(refused(large).contains("of 8193 bytes, at most 8192"));
        let nowhere = pb::Viewpoint { map_from_sensor: vec![0.0; 6], ..message };
        assert!(refused(nowhere).contains("a pose of 6 numbers"));
    }

    #[test]
    fn ascending_numbers_come_back_and_others_are_refused() {
        for numbers in [vec![], vec![0], vec![3, 4, 90, u64::MAX]] {
            assert_eq!(ascending_from(&gaps_of(numbers.iter().copied()), "gaps").unwrap(), numbers);
        }
        assert_eq!(ascending_from(&[3, 0], "gaps").unwrap_err(), "gaps names 3 twice");
        assert_eq!(ascending_from(&[3, u64::MAX], "gaps").unwrap_err(), "gaps goes beyond 2^64");
    }
}
