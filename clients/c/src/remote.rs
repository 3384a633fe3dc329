//! The functions that ask a server.

use std::ffi::c_char;
use std::time::Duration;

use mrol_client::NewMap;
use mrol_client::map::MapName;
use mrol_client::service::ServiceError;

use crate::abi::{Answer, Error, PointQuery};
use crate::clients::{CLIENTS, ClientHandle, OpenClient};
use crate::failure::Failure;
use crate::guarded;
use crate::memory::{self, Bitmap, Out};
use crate::options::{ClientOptions, address_of, credentials_of, required};
use crate::scans::{Localization, Localized, Scan, ScanOutcome, copied};

/// Longest time that a call takes, where nobody says.
const TIMEOUT_DEFAULT: Duration = Duration::from_secs(30);

/// Connects to a server: `mrol_client_open` of mrol.h.
///
/// # Safety
/// Pointers are NULL or point to what mrol.h says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mrol_client_open(
    options: *const ClientOptions,
    client: *mut ClientHandle,
    error: *mut Error,
) -> i32 {
    // SAFETY: as the caller promises.
    let (out, error) = unsafe { (Out::of(client, "client"), Out::of(error, "error")) };
    guarded(error, || {
        let out = out.required()?;
        out.write(ClientHandle::NONE);
        // SAFETY: as the caller promises.
        let options = unsafe { memory::read_question(options) }?;
        let address = address_of(options.address)?;
        let credentials = credentials_of(&options.credentials)?;
        let timeout = match options.timeout_ms {
            0 => TIMEOUT_DEFAULT,
            milliseconds => Duration::from_millis(milliseconds),
        };
        out.write(CLIENTS.open(&address, &credentials, timeout)?);
        Ok(())
    })
}

/// Closes a connection: `mrol_client_close` of mrol.h.
///
/// # Safety
/// `error` is NULL or points to what mrol.h says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mrol_client_close(client: ClientHandle, error: *mut Error) -> i32 {
    // SAFETY: as the caller promises.
    let error = unsafe { Out::of(error, "error") };
    guarded(error, || CLIENTS.close(client))
}

/// Makes a map where it is not there: `mrol_client_create_map` of mrol.h.
///
/// # Safety
/// Pointers are NULL or point to what mrol.h says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mrol_client_create_map(
    client: ClientHandle,
    map: *const c_char,
    resolution_m: f64,
    levels: u32,
    error: *mut Error,
) -> i32 {
    // SAFETY: as the caller promises.
    let error = unsafe { Out::of(error, "error") };
    guarded(error, || {
        let (client, map) = (CLIENTS.get(client)?, name_of(map)?);
        let new = NewMap { levels: (levels > 0).then_some(levels), ..NewMap::of(resolution_m) };
        client.call(|client| client.create_map(&map, new)).map(drop)
    })
}

/// Gives a map another name: `mrol_client_rename_map` of mrol.h.
///
/// # Safety
/// Pointers are NULL or point to what mrol.h says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mrol_client_rename_map(
    client: ClientHandle,
    map: *const c_char,
    to: *const c_char,
    error: *mut Error,
) -> i32 {
    // SAFETY: as the caller promises.
    let error = unsafe { Out::of(error, "error") };
    guarded(error, || {
        let (client, map, to) = (CLIENTS.get(client)?, name_of(map)?, named(to, "to")?);
        client.call(|client| client.rename_map(&map, &to)).map(drop)
    })
}

/// Asks a server about points: `mrol_client_query_points` of mrol.h.
///
/// # Safety
/// Pointers are NULL or point to what mrol.h says, and the memory is not written during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mrol_client_query_points(
    client: ClientHandle,
    map: *const c_char,
    query: *const PointQuery,
    occupied: *mut u8,
    occupied_bytes: usize,
    answer: *mut Answer,
    error: *mut Error,
) -> i32 {
    // SAFETY: as the caller promises.
    let (out, error) = unsafe { (Out::of(answer, "answer"), Out::of(error, "error")) };
    guarded(error, || {
        let (client, map, out) = (CLIENTS.get(client)?, name_of(map)?, out.optional()?);
        // SAFETY: as the caller promises; the points outlive the call, and the query does not.
        let (given, query) = unsafe {
            let given = memory::read_question(query)?;
            (given, given.parse()?)
        };
        // SAFETY: as the caller promises.
        let bitmap =
            unsafe { Bitmap::of(occupied, occupied_bytes, "occupied") }.for_answers_about(&query.points)?;
        // SAFETY: as the caller promises. What is sent may outlive a call that runs out of time.
        let points = unsafe { copied(given.xyz, given.count, "query.xyz") }?;
        let query = mrol_client::service::PointQuery { points, ..query };
        let asked = client.call(|client| client.query_points(&map, query))?;
        bitmap.write(&asked.occupied);
        if let Some(out) = out {
            out.write(Answer::to_points(&asked));
        }
        Ok(())
    })
}

/// Aligns a scan and adds it where it fits: `mrol_client_insert_scan` of mrol.h.
///
/// # Safety
/// Pointers are NULL or point to what mrol.h says, and the memory is not written during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mrol_client_insert_scan(
    client: ClientHandle,
    map: *const c_char,
    scan: *const Scan,
    answer: *mut ScanOutcome,
    error: *mut Error,
) -> i32 {
    let insert = |client: &OpenClient, map: &MapName, scan: Scan| {
        // SAFETY: as the caller promises.
        let scan = unsafe { scan.parse() }?;
        Ok(ScanOutcome::of(&client.call(|client| client.insert_scan(map, scan))?))
    };
    // SAFETY: as the caller promises.
    unsafe { answered(client, map, scan, answer, error, insert) }
}

/// Says what inserting a scan would do: `mrol_client_align_scan` of mrol.h.
///
/// # Safety
/// Pointers are NULL or point to what mrol.h says, and the memory is not written during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mrol_client_align_scan(
    client: ClientHandle,
    map: *const c_char,
    scan: *const Scan,
    answer: *mut ScanOutcome,
    error: *mut Error,
) -> i32 {
    let align = |client: &OpenClient, map: &MapName, scan: Scan| {
        // SAFETY: as the caller promises.
        let scan = unsafe { scan.parse() }?;
        Ok(ScanOutcome::of(&client.call(|client| client.align_scan(map, scan))?))
    };
    // SAFETY: as the caller promises.
    unsafe { answered(client, map, scan, answer, error, align) }
}

/// Finds where a scan was taken: `mrol_client_localize` of mrol.h.
///
/// # Safety
/// Pointers are NULL or point to what mrol.h says, and the memory is not written during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mrol_client_localize(
    client: ClientHandle,
    map: *const c_char,
    localization: *const Localization,
    answer: *mut Localized,
    error: *mut Error,
) -> i32 {
    let localize = |client: &OpenClient, map: &MapName, localization: Localization| {
        // SAFETY: as the caller promises.
        let request = unsafe { localization.parse() }?;
        Ok(Localized::of(&client.call(|client| client.localize(map, request))?))
    };
    // SAFETY: as the caller promises.
    unsafe { answered(client, map, localization, answer, error, localize) }
}

/// Writes what a call to a server answers to a question.
///
/// # Safety
/// Pointers are NULL or point to what mrol.h says.
unsafe fn answered<Q: memory::Question, A: Copy>(
    client: ClientHandle,
    map: *const c_char,
    question: *const Q,
    answer: *mut A,
    error: *mut Error,
    call: impl FnOnce(&OpenClient, &MapName, Q) -> Result<A, Failure>,
) -> i32 {
    // SAFETY: as the caller promises.
    let (out, error) = unsafe { (Out::of(answer, "answer"), Out::of(error, "error")) };
    guarded(error, || {
        let (client, map, out) = (CLIENTS.get(client)?, name_of(map)?, out.required()?);
        // SAFETY: as the caller promises.
        let question = unsafe { memory::read_question(question) }?;
        out.write(call(&client, &map, question)?);
        Ok(())
    })
}

fn name_of(map: *const c_char) -> Result<MapName, Failure> {
    named(map, "map")
}

/// The name of a map, which errors call `argument`.
fn named(name: *const c_char, argument: &str) -> Result<MapName, Failure> {
    Ok(MapName::new(&required(name, argument)?).map_err(ServiceError::from)?)
}
