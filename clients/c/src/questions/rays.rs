//! Rays: what each meets first.

use mrol_client::service::{PointCloud, RaysToward};

use super::{Form, Name, Scope, check_reserved, unknown, unless_zero, write_names};
use crate::abi::Answer;
use crate::failure::Failure;
use crate::memory::{self, Places, Question};
use crate::replicas::OpenReplica;

/// `mrol_ray_question`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct RayQuestion {
    pub(crate) struct_size: usize,
    pub(crate) scope: Scope,
    pub(crate) origins: *const f32,
    pub(crate) origins_count: usize,
    pub(crate) directions: *const f32,
    pub(crate) ends: *const f32,
    pub(crate) count: usize,
    pub(crate) range_m: f64,
    pub(crate) unknown_is_occupied: u8,
    pub(crate) reserved: [u8; 7],
}

// SAFETY: it begins with its size, and any bytes are one.
unsafe impl Question for RayQuestion {
    const NAME: &'static str = "question";
    const BYTES_MIN: usize = size_of::<Self>();
}

/// `mrol_ray_answers`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct RayPlaces {
    pub(crate) struct_size: usize,
    pub(crate) capacity: usize,
    pub(crate) hit: *mut u8,
    pub(crate) distances_m: *mut f32,
    pub(crate) voxels: *mut u64,
    pub(crate) keep_outs: *mut Name,
}

// SAFETY: it begins with its size, and any bytes are one.
unsafe impl Question for RayPlaces {
    const NAME: &'static str = "answers";
    const BYTES_MIN: usize = size_of::<Self>();
}

impl RayQuestion {
    /// Where each ray leads, one of two ways.
    ///
    /// # Safety
    /// The points are there, and nobody writes them while they are in use.
    unsafe fn toward(&self) -> Result<RaysToward, Failure> {
        // SAFETY: as the caller promises.
        let points = |from, name| unsafe { memory::points_of(from, self.count, name) };
        match (self.directions.is_null(), self.ends.is_null()) {
            (_, true) => {
                let directions = points(self.directions, "question.directions")?;
                let range_m = unless_zero(self.range_m).unwrap_or(f64::INFINITY);
                Ok(RaysToward::Directions { directions, range_m })
            }
            (true, false) if self.range_m == 0.0 => Ok(RaysToward::Ends(points(self.ends, "question.ends")?)),
            (true, false) => {
                Err(Failure::argument("question.range_m is of rays with directions: set it to 0"))
            }
            (false, false) => {
                Err(Failure::argument("question.directions and question.ends: one of them must be NULL"))
            }
        }
    }
}

fn of_toward(toward: &RaysToward) -> &PointCloud {
    match toward {
        RaysToward::Directions { directions, .. } => directions,
        RaysToward::Ends(ends) => ends,
    }
}

impl Form for RayQuestion {
    type Places = RayPlaces;

    unsafe fn ask(&self, places: &RayPlaces, replica: &OpenReplica) -> Result<Answer, Failure> {
        check_reserved(&self.reserved, "question")?;
        // SAFETY: as the caller promises.
        let (origins, toward) = unsafe {
            (memory::points_of(self.origins, self.origins_count, "question.origins")?, self.toward()?)
        };
        let room = Places::new(self.count, places.capacity)?;
        let mut room = room.beside(origins.as_slice()).beside(of_toward(&toward).as_slice());
        // SAFETY: as the caller promises.
        let (hit, distances_m, voxels, keep_outs) = unsafe {
            (
                room.bitmap(places.hit, "answers.hit")?,
                room.array(places.distances_m, "answers.distances_m")?,
                room.array(places.voxels, "answers.voxels")?,
                room.array(places.keep_outs, "answers.keep_outs")?,
            )
        };
        let answered = replica.ask(&mrol_client::service::RayQuestion {
            asked: self.scope.asked("question")?,
            origins,
            toward,
            unknown: unknown(self.unknown_is_occupied)?,
        })?;
        let hits = &answered.answer;
        if let Some(to) = hit {
            to.write_bits(&hits.hit);
        }
        if let Some(to) = distances_m {
            to.write(hits.distances_m.iter().copied());
        }
        if let Some(to) = voxels {
            to.write(hits.voxels.iter().map(|voxel| voxel.to_bits()));
        }
        write_names(keep_outs, &hits.keep_outs, hits.len());
        Ok(Answer::of(answered.version, hits.len(), hits.hits() as u64))
    }
}
