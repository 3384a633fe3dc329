//! Bodies at poses among shapes.

use super::figure::{Figure, Solid};
use super::shapes::Shapes;
use crate::planning::answers::{Clearance, Hit, Met};
use crate::planning::body::{CellsFromLink, Configurations, LinkPose, MAP_FRAME};
use crate::planning::effort::Effort;
use crate::util::StopSignal;

/// Something that is asked about again and again, each time elsewhere or another one.
#[derive(Debug, Clone, Copy)]
pub(in crate::planning) enum Posed<'a> {
    /// A body at configurations.
    Body(&'a Figure, Configurations<'a>),
    /// Links that are in the map frame, each for itself.
    Groups(&'a [Solid]),
}

impl<'a> Posed<'a> {
    /// Sets the bit of each configuration that meets a shape. None once stopped.
    pub(in crate::planning) fn mark(
        &self,
        shapes: &Shapes<'_>,
        mut words: Vec<u64>,
        stop: StopSignal<'_>,
    ) -> Option<Vec<u64>> {
        let effort = Effort::until(stop);
        for i in (0..self.count()).take_while(|_| effort.goes_on(1)) {
            let bit = 1 << (i % 64);
            if words[i / 64] & bit == 0
                && self.placed(i).any(|(_, link, at)| link.first_met(shapes, &at, &effort).is_some())
            {
                words[i / 64] |= bit;
            }
        }
        effort.done(words)
    }

    /// Puts what is met of shapes before what is met of voxels, where the link or the part comes before. None once
    /// stopped.
    pub(in crate::planning) fn hits(
        &self,
        shapes: &Shapes<'_>,
        mut hits: Vec<Option<Hit>>,
        stop: StopSignal<'_>,
    ) -> Option<Vec<Option<Hit>>> {
        let effort = Effort::until(stop);
        for (i, hit) in hits.iter_mut().enumerate().take_while(|_| effort.goes_on(1)) {
            let end = hit.as_ref().map_or((u32::MAX, u32::MAX), |hit| (hit.link, hit.part));
            let mut links = self.placed(i).take_while(|(number, ..)| *number as u32 <= end.0);
            let first = links.find_map(|(number, link, at)| {
                let (part, keep_out) = link.first_met(shapes, &at, &effort)?;
                let met = Met::KeepOut(keep_out.name.clone());
                Some(Hit { link: number as u32, part: part as u32, met })
            });
            if let Some(first) = first.filter(|first| (first.link, first.part) < end) {
                *hit = Some(first);
            }
        }
        effort.done(hits)
    }

    /// Shortens clearances to the distance from shapes, where that is less. None once stopped.
    pub(in crate::planning) fn clearances(
        &self,
        shapes: &Shapes<'_>,
        mut clearances: Vec<Clearance>,
        stop: StopSignal<'_>,
    ) -> Option<Vec<Clearance>> {
        let effort = Effort::until(stop);
        for (i, clearance) in clearances.iter_mut().enumerate().take_while(|_| effort.goes_on(1)) {
            for (number, link, at) in self.placed(i) {
                let distance_m = link.distance_m(shapes, &at, f64::from(clearance.distance_m), &effort);
                let Some(distance_m) = distance_m.map(|distance_m| distance_m as f32) else { continue };
                let number = number as u32;
                let is_first = clearance.link.is_some_and(|link| number < link);
                if distance_m < clearance.distance_m || distance_m == clearance.distance_m && is_first {
                    *clearance = Clearance { distance_m, link: Some(number) };
                }
            }
        }
        effort.done(clearances)
    }

    /// How many configurations there are.
    fn count(&self) -> usize {
        match self {
            Self::Body(_, configurations) => configurations.len(),
            Self::Groups(links) => links.len(),
        }
    }

    /// The links of a configuration by their numbers, and the transform from each to the map.
    fn placed(self, i: usize) -> impl Iterator<Item = (usize, &'a Solid, CellsFromLink)> {
        let (links, poses): (&[Solid], &[_]) = match self {
            Self::Body(figure, configurations) => (&figure.0, configurations.poses_of(i)),
            Self::Groups(links) => (std::slice::from_ref(&links[i]), &[MAP_FRAME]),
        };
        let placed = links.iter().zip(poses).enumerate();
        placed.map(|(number, (link, pose))| (number, link, CellsFromLink::of(&LinkPose::of(pose), 1.0)))
    }
}
