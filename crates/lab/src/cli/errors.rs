//! Errors of fleets and reports as errors of a command.

use crate::fleet::FleetError;
use crate::report::ReportError;
use mrol::console::CliError;

impl From<FleetError> for CliError {
    fn from(error: FleetError) -> Self {
        match error {
            FleetError::Client(error) => error.into(),
            FleetError::Server(error) => error.into(),
            FleetError::Usage(message) => Self::usage(message),
            FleetError::Failed(message) => Self::failed(message),
        }
    }
}

impl From<ReportError> for CliError {
    fn from(error: ReportError) -> Self {
        Self::failed(error)
    }
}
