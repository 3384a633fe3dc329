//! The same code, compiled for the widest instructions that the CPU has.

#[cfg(target_arch = "x86_64")]
use crate::util::cpu::{Avx2, Avx512};

/// Work whose loops over lanes the compiler turns into vector instructions. Its parts must be `#[inline(always)]`, so
/// that they are compiled with it. The answers are the same bit for bit: no operation is fused or reordered.
pub(super) trait Work {
    /// What it comes to.
    type Output;

    /// Does it.
    fn run(self) -> Self::Output;
}

/// Does the work with the widest instructions that the CPU has.
pub(super) fn run<W: Work>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    if let Some(cpu) = Avx512::detect() {
        return run_avx512(cpu, work);
    }
    #[cfg(target_arch = "x86_64")]
    if let Some(cpu) = Avx2::detect() {
        return run_avx2(cpu, work);
    }
    work.run()
}

#[cfg(target_arch = "x86_64")]
#[expect(unsafe_code, reason = "instructions that not every machine has")]
fn run_avx512<W: Work>(_: Avx512, work: W) -> W::Output {
    #[target_feature(enable = "avx512f,avx512bw,avx512cd,avx512dq,avx512vl,avx2,popcnt")]
    fn with_avx512<W: Work>(work: W) -> W::Output {
        work.run()
    }
    // SAFETY: the token says that the CPU has the features.
    unsafe { with_avx512(work) }
}

#[cfg(target_arch = "x86_64")]
#[expect(unsafe_code, reason = "instructions that not every machine has")]
fn run_avx2<W: Work>(_: Avx2, work: W) -> W::Output {
    #[target_feature(enable = "avx2,popcnt")]
    fn with_avx2<W: Work>(work: W) -> W::Output {
        work.run()
    }
    // SAFETY: the token says that the CPU has the features.
    unsafe { with_avx2(work) }
}
