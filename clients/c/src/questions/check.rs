//! Does a body fit at these configurations? Do these spheres meet anything?

use mrol_client::planning::{Clearance, Hit, NUMBERS_PER_POSE};
use mrol_client::service::{AtVersion, CheckAs, Collisions};
use mrol_client::voxel::VoxelKey;

use super::regions::{RegionNumbers, surroundings_but};
use super::{Form, Name, Scope, check_reserved, ones, unless_zero};
use crate::abi::Answer;
use crate::bodies::{BODIES, BodyHandle, spheres_of};
use crate::failure::Failure;
use crate::memory::{self, Array, Places, Question};
use crate::replicas::OpenReplica;

/// `mrol_pose_check`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct PoseCheck {
    pub(crate) struct_size: usize,
    pub(crate) scope: Scope,
    pub(crate) body: BodyHandle,
    pub(crate) configurations: *const f32,
    pub(crate) count: usize,
    pub(crate) ignored: *const RegionNumbers,
    pub(crate) ignored_count: usize,
    pub(crate) clearance_max_m: f32,
    pub(crate) unknown_is_occupied: u8,
    pub(crate) reserved: [u8; 3],
}

// SAFETY: it begins with its size, and any bytes are one.
unsafe impl Question for PoseCheck {
    const NAME: &'static str = "check";
    const BYTES_MIN: usize = size_of::<Self>();
}

/// `mrol_sphere_check`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct SphereCheck {
    pub(crate) struct_size: usize,
    pub(crate) scope: Scope,
    pub(crate) spheres: *const f32,
    pub(crate) count: usize,
    pub(crate) sizes: *const u32,
    pub(crate) groups: usize,
    pub(crate) ignored: *const RegionNumbers,
    pub(crate) ignored_count: usize,
    pub(crate) padding_m: f32,
    pub(crate) clearance_max_m: f32,
    pub(crate) unknown_is_occupied: u8,
    pub(crate) reserved: [u8; 7],
}

// SAFETY: it begins with its size, and any bytes are one.
unsafe impl Question for SphereCheck {
    const NAME: &'static str = "check";
    const BYTES_MIN: usize = size_of::<Self>();
}

/// `mrol_collisions`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct CollisionPlaces {
    pub(crate) struct_size: usize,
    pub(crate) capacity: usize,
    pub(crate) colliding: *mut u8,
    pub(crate) hit_links: *mut u32,
    pub(crate) hit_parts: *mut u32,
    pub(crate) hit_voxels: *mut u64,
    pub(crate) clearances_m: *mut f32,
    pub(crate) nearest_links: *mut u32,
    pub(crate) hit_keep_outs: *mut Name,
}

// SAFETY: it begins with its size, and any bytes are one.
unsafe impl Question for CollisionPlaces {
    const NAME: &'static str = "answers";
    const BYTES_MIN: usize = size_of::<Self>();
}

/// What stands for no link.
const NO_LINK: u32 = u32::MAX;

/// The arrays that are wanted.
struct Arrays {
    colliding: Option<Array<u8>>,
    hit_links: Option<Array<u32>>,
    hit_parts: Option<Array<u32>>,
    hit_voxels: Option<Array<u64>>,
    clearances_m: Option<Array<f32>>,
    nearest_links: Option<Array<u32>>,
    hit_keep_outs: Option<Array<Name>>,
}

impl CollisionPlaces {
    /// # Safety
    /// Pointers are NULL or point to memory for as many as `places` says.
    unsafe fn arrays(&self, mut places: Places) -> Result<Arrays, Failure> {
        // SAFETY: as the caller promises.
        unsafe {
            Ok(Arrays {
                colliding: places.bitmap(self.colliding, "answers.colliding")?,
                hit_links: places.array(self.hit_links, "answers.hit_links")?,
                hit_parts: places.array(self.hit_parts, "answers.hit_parts")?,
                hit_voxels: places.array(self.hit_voxels, "answers.hit_voxels")?,
                clearances_m: places.array(self.clearances_m, "answers.clearances_m")?,
                nearest_links: places.array(self.nearest_links, "answers.nearest_links")?,
                hit_keep_outs: places.array(self.hit_keep_outs, "answers.hit_keep_outs")?,
            })
        }
    }
}

impl Arrays {
    /// What has a place is asked for.
    fn check_as(&self, clearance_max_m: f32) -> Result<CheckAs, Failure> {
        let hits = self.hit_links.is_some()
            || self.hit_parts.is_some()
            || self.hit_voxels.is_some()
            || self.hit_keep_outs.is_some();
        let clearances = self.clearances_m.is_some() || self.nearest_links.is_some();
        match (hits, clearances) {
            (false, false) => Ok(CheckAs::Colliding),
            (true, false) => Ok(CheckAs::FirstHit),
            (false, true) => Ok(CheckAs::Clearance { most_m: unless_zero(clearance_max_m) }),
            (true, true) => {
                let message = "answers has places for hits and for clearances: ask for one of them";
                Err(Failure::argument(message))
            }
        }
    }

    fn write(&self, answered: &AtVersion<Collisions>) -> Answer {
        let collisions = &answered.answer;
        let words = collisions.words();
        if let Some(colliding) = &self.colliding {
            colliding.write_bits(&words);
        }
        match collisions {
            Collisions::Colliding { .. } => {}
            Collisions::FirstHits(hits) => self.write_hits(hits),
            Collisions::Clearances(clearances) => self.write_clearances(clearances),
        }
        Answer::of(answered.version, collisions.checked(), ones(&words))
    }

    fn write_hits(&self, hits: &[Option<Hit>]) {
        if let Some(links) = &self.hit_links {
            links.write(hits.iter().map(|hit| hit.as_ref().map_or(NO_LINK, |hit| hit.link)));
        }
        if let Some(parts) = &self.hit_parts {
            parts.write(hits.iter().map(|hit| hit.as_ref().map_or(0, |hit| hit.part)));
        }
        if let Some(voxels) = &self.hit_voxels {
            let voxel = |hit: &Option<Hit>| hit.as_ref().and_then(|hit| hit.met.voxel());
            voxels.write(hits.iter().map(|hit| voxel(hit).map_or(0, VoxelKey::to_bits)));
        }
        if let Some(keep_outs) = &self.hit_keep_outs {
            keep_outs.write(hits.iter().map(|hit| Name::of(hit.as_ref().and_then(|hit| hit.met.keep_out()))));
        }
    }

    fn write_clearances(&self, clearances: &[Clearance]) {
        if let Some(to) = &self.clearances_m {
            to.write(clearances.iter().map(|clearance| clearance.distance_m));
        }
        if let Some(links) = &self.nearest_links {
            links.write(clearances.iter().map(|clearance| clearance.link.unwrap_or(NO_LINK)));
        }
    }
}

impl Form for PoseCheck {
    type Places = CollisionPlaces;

    unsafe fn ask(&self, places: &CollisionPlaces, replica: &OpenReplica) -> Result<Answer, Failure> {
        check_reserved(&self.reserved, "check")?;
        let body = BODIES.get(self.body)?;
        let each = body.links().len() * NUMBERS_PER_POSE;
        // SAFETY: as the caller promises.
        let (numbers, surroundings, arrays) = unsafe {
            let numbers =
                memory::numbers_each(self.configurations, (self.count, each), "check.configurations")?;
            let room = Places::new(self.count, places.capacity)?.beside(numbers);
            (
                numbers,
                surroundings_but(self.ignored, self.ignored_count, self.unknown_is_occupied)?,
                places.arrays(room)?,
            )
        };
        let question = mrol_client::service::PoseCheck {
            asked: self.scope.asked("check")?,
            body,
            configurations: numbers.to_vec(),
            surroundings,
            answer: arrays.check_as(self.clearance_max_m)?,
        };
        Ok(arrays.write(&replica.ask(&question)?))
    }
}

impl SphereCheck {
    /// # Safety
    /// The sizes are there, and nobody writes them meanwhile.
    unsafe fn sizes(&self) -> Result<Vec<u32>, Failure> {
        if self.sizes.is_null() && self.groups == 0 {
            return Ok(vec![1; self.count]);
        }
        // SAFETY: as the caller promises.
        Ok(unsafe { memory::span(self.sizes, self.groups, "check.sizes") }?.to_vec())
    }
}

impl Form for SphereCheck {
    type Places = CollisionPlaces;

    unsafe fn ask(&self, places: &CollisionPlaces, replica: &OpenReplica) -> Result<Answer, Failure> {
        check_reserved(&self.reserved, "check")?;
        // SAFETY: as the caller promises.
        let (spheres, sizes, surroundings, arrays) = unsafe {
            let spheres = memory::rows::<4>(self.spheres, self.count, "check.spheres")?;
            let sizes = self.sizes()?;
            let room = Places::new(sizes.len(), places.capacity)?.beside(spheres);
            (
                spheres,
                sizes,
                surroundings_but(self.ignored, self.ignored_count, self.unknown_is_occupied)?,
                places.arrays(room)?,
            )
        };
        let question = mrol_client::service::SphereCheck {
            asked: self.scope.asked("check")?,
            spheres: spheres_of(spheres),
            sizes,
            padding_m: self.padding_m,
            surroundings,
            answer: arrays.check_as(self.clearance_max_m)?,
        };
        Ok(arrays.write(&replica.ask(&question)?))
    }
}
