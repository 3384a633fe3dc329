//! The C interface of [`mrol_client::Replica`]: what `include/mrol.h` declares and documents.
//!
//! ```text
//! lib.rs       the functions: read the arguments, ask, write the answer
//! planning.rs  those of planners' questions
//! remote.rs    those that ask a server
//! scans.rs     scans and what becomes of them, as structs of mrol.h
//! clients.rs   the connections by their numbers
//! abi.rs       the structs of mrol.h, field by field
//! questions/   those of planners' questions, and what each asks and writes
//! bodies.rs    the bodies by their numbers
//! replicas.rs  the open replicas by their numbers, and their threads
//! options.rs   what to open
//! failure.rs   codes, reasons and messages of failures
//! process.rs   the process that all of it belongs to
//! memory.rs    the caller's memory, with memory/arrays.rs: the only files that trust a pointer
//! ```
//!
//! Nothing that a program passes is believed where it can be checked: NULL, misaligned and overlapping memory, counts,
//! flags, levels, numbers of replicas. No panic leaves a function.

mod abi;
mod bodies;
mod clients;
mod failure;
mod memory;
mod options;
pub mod planning;
mod process;
mod questions;
pub mod remote;
mod replicas;
mod scans;

use std::ffi::{CStr, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use abi::{Answer, Error, MapVersion, Options, PointQuery, ReplicaHandle, Status};
use failure::{Code, Failure};
use memory::{Bitmap, Out};
use options::Opening;
use replicas::REPLICAS;

const VERSION: &CStr = match CStr::from_bytes_with_nul(concat!(env!("CARGO_PKG_VERSION"), "\0").as_bytes()) {
    Ok(version) => version,
    Err(_) => panic!("the version has a zero byte"),
};

/// The version of the library: `mrol_library_version` of mrol.h.
#[unsafe(no_mangle)]
pub extern "C" fn mrol_library_version() -> *const c_char {
    VERSION.as_ptr()
}

/// The version of the interface: `mrol_abi_version` of mrol.h.
#[unsafe(no_mangle)]
pub extern "C" fn mrol_abi_version() -> u32 {
    abi::VERSION
}

/// The name of a code: `mrol_code_name` of mrol.h.
#[unsafe(no_mangle)]
pub extern "C" fn mrol_code_name(code: i32) -> *const c_char {
    Code::of(code).map_or(c"MROL_UNKNOWN", Code::name).as_ptr()
}

/// Opens a replica: `mrol_replica_open` of mrol.h.
///
/// # Safety
/// Pointers are NULL or point to what mrol.h says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mrol_replica_open(
    options: *const Options,
    replica: *mut ReplicaHandle,
    error: *mut Error,
) -> i32 {
    // SAFETY: as the caller promises.
    let (out, error) = unsafe { (Out::of(replica, "replica"), Out::of(error, "error")) };
    guarded(error, || {
        let out = out.required()?;
        out.write(ReplicaHandle::NONE);
        // SAFETY: as the caller promises.
        let opening = Opening::of(unsafe { memory::read_question(options) }?)?;
        out.write(REPLICAS.open(opening)?);
        Ok(())
    })
}

/// Closes a replica: `mrol_replica_close` of mrol.h.
///
/// # Safety
/// `error` is NULL or points to what mrol.h says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mrol_replica_close(replica: ReplicaHandle, error: *mut Error) -> i32 {
    // SAFETY: as the caller promises.
    let error = unsafe { Out::of(error, "error") };
    guarded(error, || REPLICAS.close(replica))
}

/// How far a replica is: `mrol_replica_get_status` of mrol.h.
///
/// # Safety
/// Pointers are NULL or point to what mrol.h says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mrol_replica_get_status(
    replica: ReplicaHandle,
    status: *mut Status,
    error: *mut Error,
) -> i32 {
    // SAFETY: as the caller promises.
    let (out, error) = unsafe { (Out::of(status, "status"), Out::of(error, "error")) };
    guarded(error, || {
        let (replica, out) = (REPLICAS.get(replica)?, out.required()?);
        out.write(replica.status());
        Ok(())
    })
}

/// The state of a replica's copy: `mrol_replica_get_version` of mrol.h.
///
/// # Safety
/// Pointers are NULL or point to what mrol.h says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mrol_replica_get_version(
    replica: ReplicaHandle,
    version: *mut MapVersion,
    error: *mut Error,
) -> i32 {
    // SAFETY: as the caller promises.
    let (out, error) = unsafe { (Out::of(version, "version"), Out::of(error, "error")) };
    guarded(error, || {
        let (replica, out) = (REPLICAS.get(replica)?, out.required()?);
        out.write(replica.status().version);
        Ok(())
    })
}

/// The revision of a replica's copy: `mrol_replica_revision` of mrol.h.
#[unsafe(no_mangle)]
pub extern "C" fn mrol_replica_revision(replica: ReplicaHandle) -> u64 {
    let mut revision = 0;
    guarded(Out::NONE, || {
        revision = REPLICAS.get(replica)?.status().version.revision;
        Ok(())
    });
    revision
}

/// Waits for a revision: `mrol_replica_wait_for_revision` of mrol.h.
///
/// # Safety
/// `error` is NULL or points to what mrol.h says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mrol_replica_wait_for_revision(
    replica: ReplicaHandle,
    revision: u64,
    timeout_ms: u64,
    error: *mut Error,
) -> i32 {
    // SAFETY: as the caller promises.
    let error = unsafe { Out::of(error, "error") };
    guarded(error, || REPLICAS.get(replica)?.wait_for_revision(revision, Duration::from_millis(timeout_ms)))
}

/// Refuses a copy that is too old: `mrol_replica_check_age` of mrol.h.
///
/// # Safety
/// `error` is NULL or points to what mrol.h says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mrol_replica_check_age(
    replica: ReplicaHandle,
    age_max_ms: u64,
    error: *mut Error,
) -> i32 {
    // SAFETY: as the caller promises.
    let error = unsafe { Out::of(error, "error") };
    guarded(error, || REPLICAS.get(replica)?.check_age(Duration::from_millis(age_max_ms)))
}

/// Asks about points: `mrol_replica_query_points` of mrol.h.
///
/// # Safety
/// Pointers are NULL or point to what mrol.h says, and the memory is not written during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mrol_replica_query_points(
    replica: ReplicaHandle,
    query: *const PointQuery,
    occupied: *mut u8,
    occupied_bytes: usize,
    answer: *mut Answer,
    error: *mut Error,
) -> i32 {
    // SAFETY: as the caller promises.
    let (out, error) = unsafe { (Out::of(answer, "answer"), Out::of(error, "error")) };
    guarded(error, || {
        let (replica, out) = (REPLICAS.get(replica)?, out.optional()?);
        // SAFETY: as the caller promises; the points outlive the call, and the query does not.
        let query = unsafe { memory::read_question(query)?.parse() }?;
        // SAFETY: as the caller promises.
        let bitmap =
            unsafe { Bitmap::of(occupied, occupied_bytes, "occupied") }.for_answers_about(&query.points)?;
        let asked = replica.query_points(&query)?;
        bitmap.write(&asked.occupied);
        if let Some(out) = out {
            out.write(Answer::to_points(&asked));
        }
        Ok(())
    })
}

/// Does the work; its code, and the rest of a failure in `error`. A panic is a failure.
pub(crate) fn guarded(error: Out<Error>, work: impl FnOnce() -> Result<(), Failure>) -> i32 {
    let Ok(error) = error.optional() else { return Code::InvalidArgument as i32 };
    let done = catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| {
        // What it carries may panic in turn when it is dropped.
        std::mem::forget(panic);
        Err(Failure::panicked())
    });
    let Err(failure) = done else { return Code::Ok as i32 };
    if let Some(error) = error {
        error.write(Error::of(&failure));
    }
    failure.code as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_a_code() {
        let mut error = Error::of(&Failure::closed());
        // SAFETY: the error is there.
        let out = unsafe { Out::of(&raw mut error, "error") };
        assert_eq!(guarded(out, || panic!("a defect")), Code::Internal as i32);
        assert!(error.message().contains("defect of the library"), "{}", error.message());
        assert_eq!(guarded(Out::NONE, || panic!("a defect")), Code::Internal as i32);
    }

    #[test]
    fn codes_have_the_names_of_the_header() {
        let header = include_str!("../include/mrol.h");
        for code in Code::ALL {
            let line = format!("{} = {}", code.name().to_str().unwrap(), *code as i32);
            assert!(header.contains(&format!("    {line}")), "{line}");
        }
        let others = ["MROL_BAND_FROM_", "MROL_LOOKUP_", "MROL_REGION_", "MROL_MEASURED_TO_"];
        let others: usize = others.iter().map(|other| header.matches(&format!("    {other}")).count()).sum();
        assert_eq!(header.matches("    MROL_").count(), Code::ALL.len() + others);
        assert!(header.contains(&format!("#define MROL_ABI_VERSION {}\n", abi::VERSION)));
    }
}
