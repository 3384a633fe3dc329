//! Spheres of a body that were found in the field, and what it says of them.

use std::ops::Range;

use super::field_lookup::{FieldLookup, FoundGroup, SphereBounds};
use crate::planning::body::{CellsFromLink, EightTransforms, Group};
use crate::planning::clearance::{Centers, LANES, eight_points};
use crate::util::bits::for_each_bit;

/// Groups of spheres where they are, found in the field and not read yet.
#[derive(Debug, Default)]
pub(super) struct FoundSpheres<'a, 'f> {
    /// Only the first `count` are valid. The others are kept: a look-up is written where it lies, and not copied.
    groups: Vec<PlacedGroup<'a, 'f>>,
    count: usize,
    open: OpenSpheres,
}

#[derive(Debug)]
struct PlacedGroup<'a, 'f> {
    group: &'a Group,
    centers: Centers,
    found: FoundGroup<'f>,
    /// The lanes of which the field did not say, once it was read.
    is_open: u8,
}

/// Spheres of which the field does not say whether they meet a voxel: the center and the radius of each, cells.
#[derive(Debug, Default)]
pub(super) struct OpenSpheres(Vec<([f64; 3], f64)>);

impl OpenSpheres {
    /// Forgets all of them.
    #[inline(always)]
    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    /// Notes those of a group with these centers that are classified as open.
    #[inline(always)]
    pub(super) fn note(&mut self, bounds: &SphereBounds, group: &Group, centers: &Centers) {
        for_each_bit(u64::from(bounds.is_open), |lane| {
            self.0.push((eight_points::lane_of(centers, lane as usize), group.radius[lane as usize]));
        });
    }

    /// True where one of them meets a voxel.
    #[inline(always)]
    pub(super) fn meet(&self, lookup: &mut FieldLookup<'_>) -> bool {
        for (center, radius) in &self.0 {
            if lookup.meets(*center, *radius) {
                return true;
            }
        }
        false
    }
}

impl<'a, 'f> FoundSpheres<'a, 'f> {
    /// Forgets all groups.
    #[inline(always)]
    pub(super) fn clear(&mut self) {
        self.count = 0;
    }

    /// How many groups there are.
    #[inline(always)]
    pub(super) fn len(&self) -> usize {
        self.count
    }

    /// Finds one more group of a link in the field.
    #[inline(always)]
    pub(super) fn add(
        &mut self,
        lookup: &mut FieldLookup<'f>,
        group: &'a Group,
        cells_from_link: &CellsFromLink,
    ) {
        self.add_at(lookup, group, group.centers(cells_from_link));
    }

    /// Finds one more sphere of a link at eight places in the field.
    #[inline(always)]
    pub(super) fn add_single(
        &mut self,
        lookup: &mut FieldLookup<'f>,
        single: &'a Group,
        places: &EightTransforms,
    ) {
        self.add_at(lookup, single, single.centers_of_each(places));
    }

    #[inline(always)]
    fn add_at(&mut self, lookup: &mut FieldLookup<'f>, group: &'a Group, centers: Centers) {
        if self.count == self.groups.len() {
            let (centers, found) = ([[0.0; LANES]; 3], FoundGroup::NOTHING);
            self.groups.push(PlacedGroup { group, centers, found, is_open: 0 });
        }
        let placed = &mut self.groups[self.count];
        (placed.group, placed.centers) = (group, centers);
        lookup.find(group, &placed.centers, &mut placed.found);
        self.count += 1;
    }

    /// Of spheres at eight places, added one by one: those of `places` where a sphere meets a voxel, and those where a
    /// part of the field is waited for.
    #[inline(always)]
    pub(super) fn singles_meet(&mut self, lookup: &mut FieldLookup<'_>, places: u8) -> (u8, u8) {
        let (mut meets, mut unmade) = (0, 0);
        for placed in &mut self.groups[..self.count] {
            let bounds = lookup.classify_found(placed.group, &placed.found);
            meets |= bounds.meets & places;
            unmade |= bounds.unmade & places;
            placed.is_open = bounds.is_open & places;
        }
        let waits = if lookup.waits_for(unmade) { unmade & !meets } else { 0 };
        for placed in &self.groups[..self.count] {
            let is_open = placed.is_open & !meets & !waits;
            for place in 0..LANES {
                if is_open >> place & 1 == 1 {
                    let center = eight_points::lane_of(&placed.centers, place);
                    meets |= u8::from(lookup.meets(center, placed.group.radius[place])) << place;
                }
            }
        }
        (meets, waits)
    }

    /// True where a sphere of some of the groups meets a voxel; none where a part of the field is waited for.
    #[inline(always)]
    pub(super) fn meets(&mut self, lookup: &mut FieldLookup<'_>, groups: Range<usize>) -> Option<bool> {
        self.open.clear();
        let mut unmade = 0;
        for PlacedGroup { group, centers, found, .. } in &self.groups[groups] {
            let bounds = lookup.classify_found(group, found);
            if bounds.meets != 0 {
                return Some(true);
            }
            unmade |= bounds.unmade;
            self.open.note(&bounds, group, centers);
        }
        (!lookup.waits_for(unmade)).then(|| self.open.meet(lookup))
    }
}
