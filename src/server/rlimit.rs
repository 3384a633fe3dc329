//! How many files the process may have open: each connection is one.

use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

use mrol_service::Limits;

/// For maps, the log, threads and whatever else is no connection; half of what there is where that is less.
const BESIDES_CONNECTIONS: usize = 512;

/// The limits, with no more connections than the process may have files for.
///
/// Asks the system for as many as `connections_max` takes, which is more than most give a process by themselves.
/// Without a file nobody could connect, while idle connections do not give way before all their places are taken.
pub(super) fn within_allowed(limits: Limits) -> Limits {
    let besides = BESIDES_CONNECTIONS + 2 * limits.connections_reserved;
    let needed = 2 * limits.connections_max + besides;
    let allowed = allowed(needed as u64).try_into().unwrap_or(usize::MAX);
    if allowed >= needed {
        return limits;
    }
    let connections_max = connections_with(allowed, besides);
    tracing::warn!(
        open_files = allowed,
        needed,
        connections_max,
        "the system allows fewer open files than limits.connections_max takes: fewer connections are kept"
    );
    Limits { connections_max, ..limits }
}

/// Asks for `needed` files; how many there may be.
fn allowed(needed: u64) -> u64 {
    let Rlimit { current, maximum } = getrlimit(Resource::Nofile);
    let current = current.unwrap_or(u64::MAX);
    let wanted = needed.min(maximum.unwrap_or(u64::MAX));
    if current >= wanted {
        return current;
    }
    let raised = setrlimit(Resource::Nofile, Rlimit { current: Some(wanted), maximum });
    if raised.is_ok() { wanted } else { current }
}

/// Connections of each protocol.
fn connections_with(files: usize, besides: usize) -> usize {
    (files - besides.min(files / 2)) / 2
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn connections_leave_files_for_the_rest() {
        assert_eq!(connections_with(4608, BESIDES_CONNECTIONS), 2048);
        assert_eq!(connections_with(4640, BESIDES_CONNECTIONS + 32), 2048);
        assert_eq!(connections_with(1024, BESIDES_CONNECTIONS), 256);
        assert_eq!(connections_with(64, BESIDES_CONNECTIONS), 16);
    }
}
