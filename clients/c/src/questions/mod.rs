//! Questions of planners in the form that all of them have: what is asked, and where the arrays of the answer go.

mod check;
pub(crate) mod grid;
mod motions;
mod nearest;
mod rays;
pub(crate) mod regions;

pub(crate) use check::{CollisionPlaces, PoseCheck, SphereCheck};
pub(crate) use grid::{GridPlaces, GridQuestion};
pub(crate) use motions::{MotionCheck, MotionPlaces};
pub(crate) use nearest::{NearestPlaces, NearestQuestion};
pub(crate) use rays::{RayPlaces, RayQuestion};

use mrol::service::Asked;

use crate::abi::{Answer, Error, ReplicaHandle};
use crate::failure::Failure;
use crate::memory::{self, Out};
use crate::replicas::{OpenReplica, REPLICAS};

/// A question, as a struct of mrol.h.
pub(crate) trait Form: memory::Question {
    /// Where the arrays of its answer go.
    type Places: memory::Question;

    /// Asks, and writes the answer.
    ///
    /// # Safety
    /// Pointers of both structs are NULL or point to what mrol.h says, and nobody writes there meanwhile.
    unsafe fn ask(&self, places: &Self::Places, replica: &OpenReplica) -> Result<Answer, Failure>;
}

/// Asks in the regular form.
///
/// # Safety
/// Pointers are NULL or point to what mrol.h says, and nobody writes there meanwhile.
pub(crate) unsafe fn ask<F: Form>(
    replica: ReplicaHandle,
    question: *const F,
    answers: *const F::Places,
    answer: *mut Answer,
    error: *mut Error,
) -> i32 {
    // SAFETY: as the caller promises.
    let (out, error) = unsafe { (Out::of(answer, "answer"), Out::of(error, "error")) };
    crate::guarded(error, || {
        let (replica, out) = (REPLICAS.get(replica)?, out.optional()?);
        // SAFETY: as the caller promises.
        let (question, answers) =
            unsafe { (memory::read_question(question)?, memory::read_question(answers)?) };
        // SAFETY: as the caller promises.
        let answered = unsafe { question.ask(&answers, &replica) }?;
        if let Some(out) = out {
            out.write(answered);
        }
        Ok(())
    })
}

/// What all questions have in common. A copy is asked as it is: programs wait for revisions beforehand.
fn asked(level: u32) -> Asked {
    Asked { level, ..Asked::default() }
}

/// Refuses bytes that must be zero.
fn check_reserved(reserved: &[u8], name: &str) -> Result<(), Failure> {
    match reserved.iter().all(|byte| *byte == 0) {
        true => Ok(()),
        false => Err(Failure::argument(format!("{name}.reserved must be zero"))),
    }
}

/// A number for which 0 stands for the default.
fn unless_zero<T: PartialEq + Default>(number: T) -> Option<T> {
    (number != T::default()).then_some(number)
}

/// How many bits are set.
fn ones(words: &[u64]) -> u64 {
    words.iter().map(|word| u64::from(word.count_ones())).sum()
}
