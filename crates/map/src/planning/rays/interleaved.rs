//! Interleaved rays: while one waits for memory or for a sum, others go on.

use super::hits::RayHits;
use super::rays_in_cells::Request;
use super::request::RayError;
use super::space::{Space, Step, Walk};
use crate::util::StopSignal;
#[cfg(target_arch = "x86_64")]
use crate::util::cpu::Avx2;

/// Rays under way at once.
const AT_ONCE: usize = 4;

/// Rounds between two checks of the stop signal: about a millisecond.
const ROUNDS_PER_STOP_CHECK: usize = 16_384;

/// All rays of a request, some of them under way.
pub(super) struct InterleavedRays<'a> {
    space: Space<'a>,
    request: Request<'a>,
    /// The first ray that has not begun.
    next: usize,
}

impl<'a> InterleavedRays<'a> {
    /// The rays of `request` in `space`, none of which has begun.
    pub(super) fn new(space: Space<'a>, request: Request<'a>) -> Self {
        Self { space, request, next: 0 }
    }

    /// Walks all rays to their ends and sets what they hit.
    pub(super) fn walk(mut self, hits: &mut RayHits, stop: StopSignal<'_>) -> Result<(), RayError> {
        let mut walks = Vec::with_capacity(AT_ONCE);
        while walks.len() < AT_ONCE
            && let Some(walk) = self.begin()?
        {
            walks.push(walk);
        }
        while !walks.is_empty() && !stop.is_stopped() {
            self.some_rounds(&mut walks, hits)?;
        }
        Ok(())
    }

    /// Lets each ray take so many steps: [`ROUNDS_PER_STOP_CHECK`].
    fn some_rounds(&mut self, walks: &mut Vec<Walk>, hits: &mut RayHits) -> Result<(), RayError> {
        #[cfg(target_arch = "x86_64")]
        if let Some(cpu) = Avx2::detect() {
            return self.some_rounds_avx2(cpu, walks, hits);
        }
        self.rounds(walks, hits)
    }

    /// [`InterleavedRays::some_rounds`] with all axes of a ray in one register. The sums are the same, in the same
    /// order.
    #[cfg(target_arch = "x86_64")]
    #[expect(unsafe_code, reason = "instructions that not every machine has")]
    fn some_rounds_avx2(
        &mut self,
        _: Avx2,
        walks: &mut Vec<Walk>,
        hits: &mut RayHits,
    ) -> Result<(), RayError> {
        #[target_feature(enable = "avx2,popcnt")]
        fn with_avx2(
            rays: &mut InterleavedRays<'_>,
            walks: &mut Vec<Walk>,
            hits: &mut RayHits,
        ) -> Result<(), RayError> {
            rays.rounds(walks, hits)
        }
        // SAFETY: the token says that the CPU has the features.
        unsafe { with_avx2(self, walks, hits) }
    }

    #[inline(always)]
    fn rounds(&mut self, walks: &mut Vec<Walk>, hits: &mut RayHits) -> Result<(), RayError> {
        for _ in 0..ROUNDS_PER_STOP_CHECK {
            if walks.is_empty() {
                break;
            }
            let mut at = 0;
            while let Some(walk) = walks.get_mut(at) {
                match self.space.step(walk) {
                    Step::Further => {
                        at += 1;
                        continue;
                    }
                    Step::Hit(distance_m, voxel) => hits.set(walk.number, distance_m, voxel),
                    Step::Missed => {}
                }
                match self.begin()? {
                    Some(begun) => *walk = begun,
                    None => drop(walks.swap_remove(at)),
                }
            }
        }
        Ok(())
    }

    /// The walk of the next ray that can meet anything.
    #[inline(always)]
    fn begin(&mut self) -> Result<Option<Walk>, RayError> {
        while self.next < self.request.rays.len() {
            let number = self.next;
            self.next += 1;
            let (ray, range_m) = self.request.ray(number)?;
            if let Some((origin, rays)) = self.request.common_origin(number) {
                self.space.look_around(origin, rays);
            }
            if let Some(walk) = self.space.walk(number, ray, range_m) {
                return Ok(Some(walk));
            }
        }
        Ok(None)
    }
}
