//! A set of moments as a message, and back.

use super::forms::{self, VOXELS_PER_STOP_CHECK};
use crate::codec::unreadable::Unreadable;
use crate::pb;
use mrol_map::util::StopSignal;
use mrol_map::voxel::{MomentSet, VoxelKey, VoxelSet};

impl From<&MomentSet> for pb::Moments {
    fn from(set: &MomentSet) -> Self {
        with_keys(set, StopSignal::NEVER)
    }
}

fn with_keys(set: &MomentSet, stop: StopSignal<'_>) -> pb::Moments {
    let mut before = 0;
    let key_gaps = set.as_slice().iter().map(|(key, _)| {
        let bits = key.to_bits();
        bits - std::mem::replace(&mut before, bits)
    });
    pb::Moments { key_gaps: key_gaps.collect(), ..forms::write(set, stop) }
}

impl TryFrom<pb::Moments> for MomentSet {
    type Error = Unreadable;

    fn try_from(message: pb::Moments) -> Result<Self, Unreadable> {
        read(&message, &VoxelSet::default(), StopSignal::NEVER)
    }
}

/// The message of the moments of points in `voxels`. Keys that follow from the voxels are left out. Incomplete once
/// stopped.
pub(crate) fn beside(voxels: &VoxelSet, set: &MomentSet, stop: StopSignal<'_>) -> pb::Moments {
    let keys = set.as_slice().iter().map(|(key, _)| *key);
    match keys.eq(voxels.moment_voxels_until(stop)) || stop.is_stopped() {
        true => forms::write(set, stop),
        false => with_keys(set, stop),
    }
}

/// Reads moments: the inverse of [`beside`].
pub(crate) fn read(
    message: &pb::Moments,
    voxels: &VoxelSet,
    stop: StopSignal<'_>,
) -> Result<MomentSet, Unreadable> {
    let keys = match message.key_gaps.is_empty() && !message.forms.is_empty() {
        true => voxels.moment_voxels_until(stop),
        false => keys_of(&message.key_gaps, stop)?,
    };
    let moments = forms::read(message, keys.len(), stop)?;
    Ok(MomentSet::of_voxels_until(keys.into_iter().zip(moments).collect(), stop))
}

fn keys_of(key_gaps: &[u64], stop: StopSignal<'_>) -> Result<Vec<VoxelKey>, Unreadable> {
    let mut bits = 0u64;
    let mut key = |(i, &gap): (usize, &u64)| {
        if gap == 0 && i > 0 {
            return Err(format!("moments.key_gaps[{i}] is 0: a voxel comes twice"));
        }
        bits = bits.checked_add(gap).ok_or_else(|| format!("moments.key_gaps[{i}] is too large: {gap}"))?;
        MomentSet::key(bits).ok_or_else(|| format!("voxel key {bits:#x} is out of range"))
    };
    let mut keys = Vec::with_capacity(key_gaps.len());
    for gap in stop.paced(key_gaps.iter().enumerate(), VOXELS_PER_STOP_CHECK) {
        keys.push(key(gap)?);
    }
    Ok(keys)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_map::voxel::Moments;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    /// Of a few points, or of none: on whole steps as maps have them now, or anywhere as they had them before.
    fn moments() -> impl Strategy<Value = Moments> {
        let points = prop::collection::vec(prop::array::uniform3(-128i64..128), 0..20);
        (points, prop::sample::select(vec![1, Moments::STEP])).prop_map(|(points, step)| {
            let mut sum = Moments::default();
            points.into_iter().for_each(|point| sum += Moments::of_offset(point.map(|d| d * step)));
            sum
        })
    }

    fn set_of(voxels: impl IntoIterator<Item = ([i32; 3], Moments)>) -> MomentSet {
        voxels.into_iter().map(|(index, moments)| (VoxelKey::new(index).unwrap(), moments)).collect()
    }

    proptest! {
        #[test]
        fn a_set_survives_its_message(
            voxels in prop::collection::btree_map(prop::array::uniform3(-40i32..40), moments(), 0..30),
        ) {
            let set = set_of(voxels);
            prop_assert_eq!(MomentSet::try_from(pb::Moments::from(&set)).unwrap(), set);
        }

        #[test]
        fn beside_voxels_keys_are_left_out_where_they_follow(
            points in prop::collection::btree_map(prop::array::uniform3(-40i32..40), moments(), 1..30), extra: bool,
        ) {
            let voxels: VoxelSet = points.keys().map(|&index| VoxelKey::new(index).unwrap()).collect();
            let mut of_voxels: BTreeMap<_, _> =
                points.into_iter().map(|(index, moments)| (index.map(|i| i >> 2), moments)).collect();
            if extra {
                of_voxels.insert([77; 3], Moments::default());
            }
            let set = set_of(of_voxels);
            let message = beside(&voxels, &set, StopSignal::NEVER);
            prop_assert_eq!(message.key_gaps.is_empty(), !extra);
            prop_assert_eq!(read(&message, &voxels, StopSignal::NEVER).unwrap(), set);
        }

        #[test]
        fn messages_that_are_no_moments_are_an_error_and_never_a_panic(
            key_gaps in prop::collection::vec(0u64..9, 0..5),
            numbers in prop::collection::vec(prop_oneof![-9i64..9, any::<i64>()], 0..30),
            forms in prop::collection::vec(0u8..6, 0..5),
            points: Vec<u8>,
        ) {
            let message = pb::Moments { key_gaps, numbers, forms: forms.into(), points: points.into() };
            if let Ok(set) = MomentSet::try_from(message) {
                prop_assert_eq!(MomentSet::try_from(pb::Moments::from(&set)).unwrap(), set);
            }
        }
    }

    #[test]
    fn numbers_are_read_as_they_were_written_before_there_were_forms() {
        let set = set_of([([-3, 0, 5], Moments::of_offset([7, -9, 2048])), ([0; 3], Moments::default())]);
        let numbers = set.as_slice().iter().flat_map(|(_, moments)| moments.to_numbers()).collect();
        let pb::Moments { key_gaps, .. } = (&set).into();
        let old = pb::Moments { key_gaps, numbers, ..pb::Moments::default() };
        assert_eq!(MomentSet::try_from(old).unwrap(), set);
    }
}
