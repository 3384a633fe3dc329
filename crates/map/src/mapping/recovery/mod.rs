//! Recovery: how a robot is found again whose scans were refused.
//!
//! A guess is relative to the robot's last accepted pose. Once a few scans were refused, that pose is too far away, and
//! no scan fits any more. [`ScanMapper::recover`] then aligns a refused scan from other guesses: the pose that the
//! refused scans before it lead to, chained by aligning scan to scan; the robot's last pose; and where constant
//! velocity leads. [`ScanMapper::search`] looks for the scan in a box around the last good pose, as for a robot of
//! which nothing is known ([`localize`](crate::align::localize)). One search is not believed: the next scan has to be
//! found where the motion between the two leads, which is known from aligning one to the other.
//!
//! A robot may be found in the wrong one of two places that look the same only if the other lies beyond where it can
//! be: see [`RecoverySettings::distance_min_m`].
//!
//! [`ScanMapper::recover`]: super::ScanMapper::recover
//! [`ScanMapper::search`]: super::ScanMapper::search
//! [`RecoverySettings::distance_min_m`]: super::RecoverySettings::distance_min_m

mod motion;
mod other_guesses;
mod search;
