//! Can a body move along these configurations?

use mrol_client::planning::{MotionAnswer, NUMBERS_PER_POSE};

use super::regions::{RegionNumbers, surroundings_but};
use super::{Form, Scope, check_reserved, unless_zero};
use crate::abi::Answer;
use crate::bodies::{BODIES, BodyHandle};
use crate::failure::Failure;
use crate::memory::{self, Array, Places, Question};
use crate::replicas::OpenReplica;

/// `mrol_motion_check`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct MotionCheck {
    pub(crate) struct_size: usize,
    pub(crate) scope: Scope,
    pub(crate) body: BodyHandle,
    pub(crate) configurations: *const f32,
    pub(crate) count: usize,
    pub(crate) lengths: *const u32,
    pub(crate) motions: usize,
    pub(crate) ignored: *const RegionNumbers,
    pub(crate) ignored_count: usize,
    pub(crate) step_m: f32,
    pub(crate) clearance_max_m: f32,
    pub(crate) unknown_is_occupied: u8,
    pub(crate) reserved: [u8; 7],
}

// SAFETY: it begins with its size, and any bytes are one.
unsafe impl Question for MotionCheck {
    const NAME: &'static str = "check";
    const BYTES_MIN: usize = size_of::<Self>();
}

/// `mrol_motion_answers`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct MotionPlaces {
    pub(crate) struct_size: usize,
    pub(crate) capacity: usize,
    pub(crate) is_free: *mut u8,
    pub(crate) first_hits: *mut f32,
    pub(crate) clearances_m: *mut f32,
}

// SAFETY: it begins with its size, and any bytes are one.
unsafe impl Question for MotionPlaces {
    const NAME: &'static str = "answers";
    const BYTES_MIN: usize = size_of::<Self>();
}

/// The arrays that are wanted.
struct Arrays {
    is_free: Option<Array<u8>>,
    first_hits: Option<Array<f32>>,
    clearances_m: Option<Array<f32>>,
}

impl MotionPlaces {
    /// # Safety
    /// Pointers are NULL or point to memory for as many as `places` says.
    unsafe fn arrays(&self, mut places: Places) -> Result<Arrays, Failure> {
        // SAFETY: as the caller promises.
        unsafe {
            Ok(Arrays {
                is_free: places.bitmap(self.is_free, "answers.is_free")?,
                first_hits: places.array(self.first_hits, "answers.first_hits")?,
                clearances_m: places.array(self.clearances_m, "answers.clearances_m")?,
            })
        }
    }
}

impl Arrays {
    fn write(&self, motions: &[MotionAnswer]) {
        if let Some(is_free) = &self.is_free {
            let bits = |motions: &[MotionAnswer]| {
                (0..).zip(motions).fold(0u8, |byte, (bit, motion)| byte | u8::from(motion.is_free()) << bit)
            };
            is_free.write(motions.chunks(8).map(bits));
        }
        if let Some(first_hits) = &self.first_hits {
            first_hits.write(motions.iter().map(|motion| motion.first_hit.unwrap_or(f32::NAN)));
        }
        if let Some(clearances_m) = &self.clearances_m {
            clearances_m.write(motions.iter().map(|motion| motion.clearance_m.unwrap_or(f32::NAN)));
        }
    }
}

impl MotionCheck {
    /// # Safety
    /// The lengths are there, and nobody writes them meanwhile.
    unsafe fn lengths(&self) -> Result<Vec<u32>, Failure> {
        if self.lengths.is_null() && self.motions == 0 {
            if !self.count.is_multiple_of(2) {
                let message = format!(
                    "check.count must be even where check.lengths is NULL, and each motion has two \
                     configurations, got {}",
                    self.count
                );
                return Err(Failure::argument(message));
            }
            return Ok(vec![2; self.count / 2]);
        }
        // SAFETY: as the caller promises.
        Ok(unsafe { memory::span(self.lengths, self.motions, "check.lengths") }?.to_vec())
    }
}

impl Form for MotionCheck {
    type Places = MotionPlaces;

    unsafe fn ask(&self, places: &MotionPlaces, replica: &OpenReplica) -> Result<Answer, Failure> {
        check_reserved(&self.reserved, "check")?;
        let body = BODIES.get(self.body)?;
        let each = body.links().len() * NUMBERS_PER_POSE;
        // SAFETY: as the caller promises.
        let (numbers, lengths, surroundings, arrays) = unsafe {
            let numbers =
                memory::numbers_each(self.configurations, (self.count, each), "check.configurations")?;
            let lengths = self.lengths()?;
            let room = Places::new(lengths.len(), places.capacity)?.beside(numbers);
            (
                numbers,
                lengths,
                surroundings_but(self.ignored, self.ignored_count, self.unknown_is_occupied)?,
                places.arrays(room)?,
            )
        };
        let clearance_max_m = arrays.clearances_m.as_ref().map(|_| match unless_zero(self.clearance_max_m) {
            Some(most_m) => most_m,
            None => replica.clearance_max_m(self.scope.level),
        });
        let question = mrol_client::service::MotionCheck {
            asked: self.scope.asked("check")?,
            body,
            configurations: numbers.to_vec(),
            lengths,
            step_m: unless_zero(self.step_m),
            clearance_max_m,
            surroundings,
        };
        let answered = replica.ask(&question)?;
        arrays.write(&answered.answer);
        let free = answered.answer.iter().filter(|motion| motion.is_free()).count();
        Ok(Answer::of(answered.version, answered.answer.len(), free as u64))
    }
}
