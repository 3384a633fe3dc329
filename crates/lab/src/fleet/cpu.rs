//! Processor time of a process.

use super::error::FleetError;

/// Clock ticks a second in what Linux tells programs of processor time, on every machine.
const TICKS_PER_S: f64 = 100.0;
/// Place of the time in user mode among the fields behind the program's name; that in the kernel follows it.
const USER_TIME: usize = 11;

/// Processor time that a process has used, with all its threads, seconds of one core.
pub(crate) fn cpu_seconds(pid: u32) -> Result<f64, FleetError> {
    let path = format!("/proc/{pid}/stat");
    let told = std::fs::read_to_string(&path)
        .map_err(|error| FleetError::failed(format!("{path} does not tell the server's time: {error}")))?;
    // The name, in brackets, may have any character.
    let fields = told.rsplit(')').next().unwrap_or_default();
    let ticks: Option<Vec<f64>> =
        fields.split_whitespace().skip(USER_TIME).take(2).map(|field| field.parse().ok()).collect();
    match ticks.as_deref() {
        Some([user, system]) => Ok((user + system) / TICKS_PER_S),
        _ => Err(FleetError::failed(format!("{path} tells no time: {told}"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_process_that_works_uses_time() {
        let before = cpu_seconds(std::process::id()).unwrap();
        while cpu_seconds(std::process::id()).unwrap() < before + 0.03 {}
        assert!(cpu_seconds(u32::MAX).is_err());
    }
}
