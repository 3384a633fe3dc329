//! The async runtime of the commands that talk to a server or are one.

use tokio::runtime::Runtime;

use super::error::CliError;

/// Runs a command to its end.
pub fn block_on(command: impl Future<Output = Result<(), CliError>>) -> Result<(), CliError> {
    let runtime = Runtime::new().map_err(|e| CliError::failed(format!("no thread can be started: {e}")))?;
    let result = runtime.block_on(command);
    // A file that is still being read does not delay the end of the process.
    runtime.shutdown_background();
    result
}
