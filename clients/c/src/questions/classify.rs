//! Points as what is known of them: occupied, free, or unknown.

use super::{Form, Scope};
use crate::abi::Answer;
use crate::failure::Failure;
use crate::memory::{self, Places, Question};
use crate::replicas::OpenReplica;

/// `mrol_classify_question`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ClassifyQuestion {
    pub(crate) struct_size: usize,
    pub(crate) scope: Scope,
    pub(crate) points: *const f32,
    pub(crate) count: usize,
}

// SAFETY: it begins with its size, and any bytes are one.
unsafe impl Question for ClassifyQuestion {
    const NAME: &'static str = "question";
    const BYTES_MIN: usize = size_of::<Self>();
}

/// `mrol_classify_answers`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ClassifyPlaces {
    pub(crate) struct_size: usize,
    pub(crate) capacity: usize,
    pub(crate) is_occupied: *mut u8,
    pub(crate) is_free: *mut u8,
}

// SAFETY: it begins with its size, and any bytes are one.
unsafe impl Question for ClassifyPlaces {
    const NAME: &'static str = "answers";
    const BYTES_MIN: usize = size_of::<Self>();
}

impl Form for ClassifyQuestion {
    type Places = ClassifyPlaces;

    unsafe fn ask(&self, places: &ClassifyPlaces, replica: &OpenReplica) -> Result<Answer, Failure> {
        // SAFETY: as the caller promises.
        let points = unsafe { memory::points_of(self.points, self.count, "question.points") }?;
        let mut room = Places::new(self.count, places.capacity)?.beside(points.as_slice());
        // SAFETY: as the caller promises.
        let (is_occupied, is_free) = unsafe {
            (
                room.bitmap(places.is_occupied, "answers.is_occupied")?,
                room.bitmap(places.is_free, "answers.is_free")?,
            )
        };
        let asked = self.scope.asked("question")?;
        let answered = replica.ask(&mrol_client::service::ClassifyQuestion { asked, points })?;
        let states = &answered.answer;
        if let Some(to) = is_occupied {
            to.write_bits(&states.occupied);
        }
        if let Some(to) = is_free {
            to.write_bits(&states.free);
        }
        Ok(Answer::of(answered.version, states.points, states.points_free() as u64))
    }
}
