//! The bodies of this process, by their numbers.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use mrol_client::planning::{Body, Link, Sphere};
use parking_lot::RwLock;

use crate::failure::Failure;
use crate::memory::{self, Plain};
use crate::process;

/// Most links of a body: `MROL_LINKS_MAX`.
pub(crate) const LINKS_MAX: usize = 4096;

/// The bodies of this process.
pub(crate) static BODIES: Bodies =
    Bodies { last_number: AtomicU64::new(0), made: RwLock::new(BTreeMap::new()) };

/// `mrol_body`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[repr(C)]
pub struct BodyHandle {
    pub(crate) number: u64,
}

impl BodyHandle {
    /// No body.
    pub(crate) const NONE: Self = Self { number: 0 };
}

/// `mrol_link`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct LinkParts {
    pub(crate) spheres: *const f32,
    pub(crate) spheres_count: usize,
    pub(crate) points: *const f32,
    pub(crate) points_count: usize,
    pub(crate) padding_m: f32,
    pub(crate) reserved: [u32; 3],
}

// SAFETY: any bytes are one.
unsafe impl Plain for LinkParts {}

impl LinkParts {
    /// # Safety
    /// The numbers are there, and nobody writes them meanwhile.
    unsafe fn parse(&self, number: usize) -> Result<Link, Failure> {
        if self.reserved != [0; 3] {
            return Err(Failure::argument(format!("links[{number}].reserved must be zero")));
        }
        // SAFETY: as the caller promises.
        let spheres = unsafe { memory::rows::<4>(self.spheres, self.spheres_count, "links.spheres") }?;
        // SAFETY: as the caller promises.
        let points = unsafe { memory::rows::<3>(self.points, self.points_count, "links.points") }?;
        let points = points.iter().map(|xyz| (*xyz).into()).collect();
        Ok(Link { spheres: spheres_of(spheres), points, padding_m: self.padding_m })
    }
}

/// Spheres of four numbers each: the center and the radius.
pub(crate) fn spheres_of(numbers: &[[f32; 4]]) -> Vec<Sphere> {
    numbers.iter().map(|&[x, y, z, radius_m]| Sphere { center_m: [x, y, z], radius_m }).collect()
}

/// Bodies by their numbers: one that was freed is an error for ever.
pub(crate) struct Bodies {
    last_number: AtomicU64,
    made: RwLock<BTreeMap<BodyHandle, Arc<Body>>>,
}

impl Bodies {
    /// Makes a body of links.
    ///
    /// # Safety
    /// The links and their numbers are there, and nobody writes them meanwhile.
    pub(crate) unsafe fn make(&self, links: *const LinkParts, count: usize) -> Result<BodyHandle, Failure> {
        process::claim()?;
        if count > LINKS_MAX {
            return Err(Failure::argument(format!("links_count must be at most {LINKS_MAX}, got {count}")));
        }
        // SAFETY: as the caller promises.
        let links = unsafe { memory::span(links, count, "links") }?;
        // SAFETY: as the caller promises.
        let links = links.iter().enumerate().map(|(number, link)| unsafe { link.parse(number) });
        let body = Body::new(links.collect::<Result<_, _>>()?);
        let body = Arc::new(body.map_err(|error| Failure::argument(error.to_string()))?);
        let handle = BodyHandle { number: self.last_number.fetch_add(1, Ordering::Relaxed) + 1 };
        self.made.write().insert(handle, body);
        Ok(handle)
    }

    /// The body of a number.
    pub(crate) fn get(&self, body: BodyHandle) -> Result<Arc<Body>, Failure> {
        process::check()?;
        self.made.read().get(&body).cloned().ok_or_else(Failure::no_body)
    }

    /// Frees a body, once the last call that uses it returns.
    pub(crate) fn free(&self, body: BodyHandle) -> Result<(), Failure> {
        process::check()?;
        self.made.write().remove(&body).map(drop).ok_or_else(Failure::no_body)
    }
}
