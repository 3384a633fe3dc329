//! Permissions of the data folder.

use std::fmt::{self, Display};
use std::str::FromStr;

/// Permissions of the folders that a store creates; its files have the same without execution. `0700`: only the
/// server's own user.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StoreMode(u32);

/// Why a text is no [`StoreMode`].
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("must be the permissions of folders in octal from 0700 to 0777, such as 0700 or 0750, got {0:?}")]
pub struct StoreModeError(String);

/// Permissions that the server itself needs.
const OWNER: u32 = 0o700;
const ALL: u32 = 0o777;
const READ_AND_WRITE: u32 = 0o666;

impl StoreMode {
    /// Permission bits of folders.
    pub(super) fn of_folders(self) -> u32 {
        self.0
    }

    /// Permission bits of files.
    pub(super) fn of_files(self) -> u32 {
        self.0 & READ_AND_WRITE
    }
}

impl Default for StoreMode {
    fn default() -> Self {
        Self(OWNER)
    }
}

impl FromStr for StoreMode {
    type Err = StoreModeError;

    fn from_str(text: &str) -> Result<Self, StoreModeError> {
        let digits = (3..=4).contains(&text.len()) && text.bytes().all(|c| c.is_ascii_digit());
        let bits = u32::from_str_radix(text, 8).ok().filter(|_| digits);
        bits.filter(|bits| (OWNER..=ALL).contains(bits) && bits & OWNER == OWNER)
            .map(Self)
            .ok_or_else(|| StoreModeError(text.chars().take(64).collect()))
    }
}

impl Display for StoreMode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:04o}", self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mode_is_octal_and_leaves_the_owner_everything() {
        for (text, folders, files) in [("0700", 0o700, 0o600), ("750", 0o750, 0o640), ("0777", 0o777, 0o666)]
        {
            let mode: StoreMode = text.parse().unwrap();
            assert_eq!((mode.of_folders(), mode.of_files()), (folders, files));
            assert_eq!(mode.to_string().parse(), Ok(mode));
        }
        for bad in ["", "7", "0600", "1777", "0800", "rwx", "+700", "0o700", "-700"] {
            let error = bad.parse::<StoreMode>().unwrap_err().to_string();
            assert!(error.contains("0700") && error.contains(&format!("{bad:?}")), "{error}");
        }
        assert_eq!(StoreMode::default().to_string(), "0700");
    }
}
