//! What a question of a planner is.

use std::fmt::Debug;

use super::known::KnownPart;
use super::question_target::QuestionTarget;
use super::scope::QuestionScope;
use crate::error::{Reason, ServiceError};
use crate::limits::Limits;
use mrol_map::map::{ContentVersion, MultiResolutionMap};
use mrol_map::util::StopSignal;

/// A question of a planner.
pub trait Question: Debug + Send + Sync + 'static {
    /// What it is answered with.
    type Answer: Debug + Send + 'static;

    /// Its name in the table of operations.
    const OPERATION: &'static str;

    /// What to do where its time is up, for the error.
    const WAY_OUT: &'static str = "ask about less at once, or raise that setting of limits";

    /// What it has in common with others.
    fn asked(&self) -> &QuestionScope;

    /// Bytes of memory that its answer takes, at most.
    fn answer_bytes(&self, limits: &Limits) -> usize;

    /// Bytes of memory that finding the answer in a map takes besides it, where that grows with the question or the
    /// map.
    fn work_bytes(&self, _: &MultiResolutionMap) -> usize {
        0
    }

    /// How long finding the answer takes, roughly, nanoseconds.
    fn work_ns(&self) -> usize;

    /// True where the answer is found in parts, between which changes may come.
    fn is_in_parts(&self) -> bool {
        false
    }

    /// Checks it against the server's limits.
    ///
    /// # Errors
    /// `InvalidArgument`, naming the field, the value and the limit.
    fn check(&self, limits: &Limits) -> Result<(), ServiceError>;

    /// The answer from a view of `map`, with the version that it is of. Where others went first meanwhile, or it is
    /// found in parts, the version is the first; the rest may be of later ones.
    ///
    /// # Errors
    /// `InvalidArgument` for what makes no question, naming the field and its place; how it was stopped, once it was;
    /// that the time is up, where `map` must not be waited for and would have to be.
    fn answer_from(
        &self,
        map: &QuestionTarget<'_>,
        limits: &Limits,
        stop: StopSignal<'_>,
    ) -> Result<(Self::Answer, ContentVersion), ServiceError>;

    /// Refuses an answer that what is not known could change: it was given from a part of the map, and all keep-outs.
    ///
    /// # Errors
    /// `InvalidArgument`, naming the element that needs more, what it needs and what is known.
    fn check_known(&self, answer: &Self::Answer, known: &KnownPart) -> Result<(), ServiceError>;
}

/// Refuses a question of more elements than one request may have, or of so many that the answer fits into no message.
pub(super) fn check_elements(
    field: &str,
    elements: usize,
    bytes_each: usize,
    limits: &Limits,
) -> Result<(), ServiceError> {
    limits.check_elements(field, elements)?;
    let most = limits.message_bytes_max / bytes_each;
    if elements <= most {
        return Ok(());
    }
    let message = format!(
        "{field}: {elements} of them take {} bytes in the answer, message_bytes_max is {}: ask for at most {most}",
        elements * bytes_each,
        limits.message_bytes_max
    );
    Err(ServiceError::new(Reason::BatchTooLarge, message))
}
