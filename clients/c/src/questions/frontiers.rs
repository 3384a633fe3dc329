//! Frontiers: where free space ends and nothing is known beyond.

use mrol_client::geometry::{rotation_xyzw, translation_m};
use mrol_client::planning::Frontier;

use super::{Form, Scope, unless_zero};
use crate::abi::Answer;
use crate::failure::Failure;
use crate::memory::{Places, Plain, Question};
use crate::replicas::OpenReplica;

/// `mrol_frontier_question`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct FrontierQuestion {
    pub(crate) struct_size: usize,
    pub(crate) scope: Scope,
    pub(crate) min_m: [f64; 3],
    pub(crate) max_m: [f64; 3],
    pub(crate) standoff_m: f64,
    pub(crate) size_min: u64,
}

// SAFETY: it begins with its size, and any bytes are one.
unsafe impl Question for FrontierQuestion {
    const NAME: &'static str = "question";
    const BYTES_MIN: usize = size_of::<Self>();
}

/// `mrol_frontier`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub(crate) struct FrontierNumbers {
    pub(crate) voxels: u64,
    pub(crate) center_m: [f64; 3],
    pub(crate) min_m: [f64; 3],
    pub(crate) max_m: [f64; 3],
    pub(crate) view_m: [f64; 3],
    pub(crate) view_rotation: [f64; 4],
    pub(crate) target_m: [f64; 3],
    pub(crate) yaw_rad: f64,
    pub(crate) elevation_rad: f64,
    pub(crate) has_view: u8,
    pub(crate) reserved: [u8; 7],
}

// SAFETY: any bytes are one.
unsafe impl Plain for FrontierNumbers {}

/// `mrol_frontier_answers`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct FrontierPlaces {
    pub(crate) struct_size: usize,
    pub(crate) capacity: usize,
    pub(crate) frontiers: *mut FrontierNumbers,
}

// SAFETY: it begins with its size, and any bytes are one.
unsafe impl Question for FrontierPlaces {
    const NAME: &'static str = "answers";
    const BYTES_MIN: usize = size_of::<Self>();
}

impl From<&Frontier> for FrontierNumbers {
    fn from(frontier: &Frontier) -> Self {
        let Frontier { voxels, center_m, min_m, max_m, view } = *frontier;
        let of_view =
            view.map(|view| (translation_m(&view.map_from_view), rotation_xyzw(&view.map_from_view)));
        let (view_m, view_rotation) = of_view.unwrap_or_default();
        Self {
            voxels,
            center_m,
            min_m,
            max_m,
            view_m,
            view_rotation,
            target_m: view.map_or([0.0; 3], |view| view.target_m),
            yaw_rad: view.map_or(0.0, |view| view.yaw_rad),
            elevation_rad: view.map_or(0.0, |view| view.elevation_rad),
            has_view: view.is_some().into(),
            reserved: [0; 7],
        }
    }
}

impl Form for FrontierQuestion {
    type Places = FrontierPlaces;

    unsafe fn ask(&self, places: &FrontierPlaces, replica: &OpenReplica) -> Result<Answer, Failure> {
        let question = mrol_client::service::FrontierQuestion {
            asked: self.scope.asked("question")?,
            min_m: self.min_m,
            max_m: self.max_m,
            size_min: unless_zero(self.size_min),
            frontiers_max: Some(places.capacity),
            standoff_m: unless_zero(self.standoff_m),
        };
        let answered = replica.ask(&question)?;
        let told = &answered.answer;
        let mut room = Places::new(told.frontiers.len(), places.capacity)?;
        // SAFETY: as the caller promises.
        let to = unsafe { room.array(places.frontiers, "answers.frontiers") }?;
        if let Some(to) = to {
            to.write(told.frontiers.iter().map(FrontierNumbers::from));
        }
        Ok(Answer::of(answered.version, told.frontiers.len(), told.frontiers_total))
    }
}
