//! Questions of planners in the form that all of them have: what is asked, and where the arrays of the answer go.

mod check;
mod classify;
pub(crate) mod frontiers;
pub(crate) mod grid;
mod motions;
mod nearest;
mod rays;
pub(crate) mod regions;

pub(crate) use check::{CollisionPlaces, PoseCheck, SphereCheck};
pub(crate) use classify::{ClassifyPlaces, ClassifyQuestion};
pub(crate) use frontiers::{FrontierPlaces, FrontierQuestion};
pub(crate) use grid::{GridPlaces, GridQuestion};
pub(crate) use motions::{MotionCheck, MotionPlaces};
pub(crate) use nearest::{NearestPlaces, NearestQuestion};
pub(crate) use rays::{RayPlaces, RayQuestion};

use mrol_client::map::{KeepOutName, NAME_LENGTH_MAX};
use mrol_client::planning::Unknown;
use mrol_client::service::QuestionScope;

use crate::abi::{Answer, Error, ReplicaHandle};
use crate::failure::Failure;
use crate::memory::{self, Array, Out, Plain};
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

/// `mrol_scope`: what all questions have in common.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub(crate) struct Scope {
    pub(crate) level: u32,
    pub(crate) ignore_keep_outs: u8,
    pub(crate) reserved: [u8; 3],
}

impl Scope {
    /// What the question `name` has in common with others. A copy is asked as it is: programs wait for revisions
    /// beforehand.
    fn asked(&self, name: &str) -> Result<QuestionScope, Failure> {
        check_reserved(&self.reserved, &format!("{name}.scope"))?;
        let ignore_keep_outs = memory::flag(self.ignore_keep_outs, "ignore_keep_outs")?;
        Ok(QuestionScope { level: self.level, ignore_keep_outs, ..QuestionScope::default() })
    }
}

/// What unknown voxels count as.
fn unknown(unknown_is_occupied: u8) -> Result<Unknown, Failure> {
    let is_occupied = memory::flag(unknown_is_occupied, "unknown_is_occupied")?;
    Ok(if is_occupied { Unknown::Occupied } else { Unknown::Free })
}

/// `mrol_name`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub(crate) struct Name {
    text: [u8; NAME_BYTES],
}

/// Bytes of a name with its zero: `MROL_NAME_BYTES`.
const NAME_BYTES: usize = 72;
const _: () = assert!(NAME_BYTES > NAME_LENGTH_MAX);

// SAFETY: any bytes are one.
unsafe impl Plain for Name {}

impl Name {
    /// The name, or none.
    fn of(name: Option<&KeepOutName>) -> Self {
        let mut text = [0; NAME_BYTES];
        let name = name.map_or("", KeepOutName::as_str);
        text.iter_mut().zip(name.bytes()).for_each(|(to, byte)| *to = byte);
        Self { text }
    }
}

/// Writes the keep-outs of `count` elements, of which there are none where the list is empty.
fn write_names(to: Option<Array<Name>>, keep_outs: &[Option<KeepOutName>], count: usize) {
    if let Some(to) = to {
        to.write((0..count).map(|i| Name::of(keep_outs.get(i).and_then(Option::as_ref))));
    }
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
