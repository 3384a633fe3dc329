//! The nearest voxel of points.

use mrol_client::planning::MeasuredTo;

use super::{Form, Name, Scope, check_reserved, write_names};
use crate::abi::Answer;
use crate::failure::Failure;
use crate::memory::{self, Places, Question};
use crate::replicas::OpenReplica;

/// `mrol_nearest_question`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct NearestQuestion {
    pub(crate) struct_size: usize,
    pub(crate) scope: Scope,
    pub(crate) points: *const f32,
    pub(crate) count: usize,
    pub(crate) radius_m: f64,
    pub(crate) to: i32,
    pub(crate) reserved: [u8; 4],
}

// SAFETY: it begins with its size, and any bytes are one.
unsafe impl Question for NearestQuestion {
    const NAME: &'static str = "question";
    const BYTES_MIN: usize = size_of::<Self>();
}

/// `mrol_nearest_answers`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct NearestPlaces {
    pub(crate) struct_size: usize,
    pub(crate) capacity: usize,
    pub(crate) found: *mut u8,
    pub(crate) distances_m: *mut f32,
    pub(crate) voxels: *mut u64,
    pub(crate) away: *mut f32,
    pub(crate) keep_outs: *mut Name,
}

// SAFETY: it begins with its size, and any bytes are one.
unsafe impl Question for NearestPlaces {
    const NAME: &'static str = "answers";
    const BYTES_MIN: usize = size_of::<Self>();
}

impl Form for NearestQuestion {
    type Places = NearestPlaces;

    unsafe fn ask(&self, places: &NearestPlaces, replica: &OpenReplica) -> Result<Answer, Failure> {
        check_reserved(&self.reserved, "question")?;
        let to = match self.to {
            0 => MeasuredTo::Cubes,
            1 => MeasuredTo::Centers,
            other => return Err(Failure::argument(format!("question.to must be 0 or 1, got {other}"))),
        };
        // SAFETY: as the caller promises.
        let points = unsafe { memory::points_of(self.points, self.count, "question.points") }?;
        let mut room = Places::new(self.count, places.capacity)?.beside(points.as_slice());
        // SAFETY: as the caller promises.
        let (found, distances_m, voxels, away, keep_outs) = unsafe {
            (
                room.bitmap(places.found, "answers.found")?,
                room.array(places.distances_m, "answers.distances_m")?,
                room.array(places.voxels, "answers.voxels")?,
                room.array(places.away.cast::<[f32; 3]>(), "answers.away")?,
                room.array(places.keep_outs, "answers.keep_outs")?,
            )
        };
        let question = mrol_client::service::NearestQuestion {
            asked: self.scope.asked("question")?,
            points,
            radius_m: self.radius_m,
            to,
        };
        let answered = replica.ask(&question)?;
        let nearest = &answered.answer;
        if let Some(to) = found {
            to.write_bits(&nearest.found);
        }
        if let Some(to) = distances_m {
            to.write(nearest.distances_m.iter().copied());
        }
        if let Some(to) = voxels {
            to.write(nearest.voxels.iter().map(|voxel| voxel.to_bits()));
        }
        if let Some(to) = away {
            to.write(nearest.away.iter().copied());
        }
        write_names(keep_outs, &nearest.keep_outs, nearest.len());
        Ok(Answer::of(answered.version, nearest.len(), nearest.count() as u64))
    }
}
