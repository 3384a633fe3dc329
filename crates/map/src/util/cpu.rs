//! CPU features as types: a value is the proof that the CPU has them.
//!
//! Kernels for an instruction set take its token, so that a safe function can call code that is compiled for it. Only
//! `detect` makes one.

/// The CPU has AVX2 and POPCNT.
#[derive(Debug, Clone, Copy)]
pub struct Avx2(());

/// The CPU has AVX-512 F, BW, CD, DQ and VL, AVX2 and POPCNT: every server CPU with AVX-512 since 2017 does.
#[derive(Debug, Clone, Copy)]
pub struct Avx512(());

impl Avx2 {
    /// The token, where the CPU has the features.
    #[inline]
    pub fn detect() -> Option<Self> {
        (is_x86_feature_detected!("avx2") && is_x86_feature_detected!("popcnt")).then_some(Self(()))
    }
}

impl Avx512 {
    /// The token, where the CPU has the features.
    #[inline]
    pub fn detect() -> Option<Self> {
        let has_all = is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512bw")
            && is_x86_feature_detected!("avx512cd")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512vl")
            && is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("popcnt");
        has_all.then_some(Self(()))
    }
}
