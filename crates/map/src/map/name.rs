//! Names that are safe as file names, metric labels and path segments.

use std::sync::Arc;

use crate::util::excerpt;

/// Characters a name may have, at most.
pub const NAME_LENGTH_MAX: usize = 64;

/// Why a text is not a name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NameError {
    /// Not a map's name.
    #[error("map must match [a-z0-9][a-z0-9_-]{{0,63}}, got {0:?}")]
    Map(String),
    /// Not a keep-out's name.
    #[error("keep-out must match [a-z0-9][a-z0-9_-]{{0,63}}, got {0:?}")]
    KeepOut(String),
    /// Not a robot's name.
    #[error("robot must be 1 to {NAME_LENGTH_MAX} of [A-Za-z0-9_.-], got {0:?}")]
    Robot(String),
    /// Not a session's name.
    #[error("session must be empty or 1 to {NAME_LENGTH_MAX} of [A-Za-z0-9_.-], got {0:?}")]
    Session(String),
    /// Not a caller's name.
    #[error("caller must be 1 to {NAME_LENGTH_MAX} of [A-Za-z0-9_.-], got {0:?}")]
    Caller(String),
    /// Not a request's id.
    #[error("request_id must be 1 to {NAME_LENGTH_MAX} of [A-Za-z0-9_.-], got {0:?}")]
    Request(String),
}

/// The name of a map: `[a-z0-9][a-z0-9_-]{0,63}`.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MapName(Arc<str>);

impl MapName {
    /// Checks a text.
    ///
    /// # Errors
    /// Names the text and what a name looks like.
    pub fn new(text: &str) -> Result<Self, NameError> {
        path_segment(text).map(Self).ok_or_else(|| NameError::Map(excerpt(text)))
    }

    /// The text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

/// The name of a keep-out: `[a-z0-9][a-z0-9_-]{0,63}`.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct KeepOutName(Arc<str>);

impl KeepOutName {
    /// Checks a text.
    ///
    /// # Errors
    /// Names the text and what a name looks like.
    pub fn new(text: &str) -> Result<Self, NameError> {
        path_segment(text).map(Self).ok_or_else(|| NameError::KeepOut(excerpt(text)))
    }

    /// The text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

/// The name of a robot: 1 to 64 of `[A-Za-z0-9_.-]`.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct RobotName(Arc<str>);

impl RobotName {
    /// Checks a text.
    ///
    /// # Errors
    /// Names the text and what a name looks like.
    pub fn new(text: &str) -> Result<Self, NameError> {
        word(text).map(Self).ok_or_else(|| NameError::Robot(excerpt(text)))
    }

    /// The text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

/// The name of one run of a robot's software: empty, or 1 to 64 of `[A-Za-z0-9_.-]`.
///
/// The numbers of a robot's scans are unique within a session, so that a robot that starts again may count from 0 under
/// another name. The empty name is that of clients which do not tell one run from another.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct SessionName(Arc<str>);

impl SessionName {
    /// Checks a text.
    ///
    /// # Errors
    /// Names the text and what a name looks like.
    pub fn new(text: &str) -> Result<Self, NameError> {
        if text.is_empty() {
            return Ok(Self::default());
        }
        word(text).map(Self).ok_or_else(|| NameError::Session(excerpt(text)))
    }

    /// The text.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// True of the session of clients that do not tell one run from another.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

/// A caller's own id of a change: 1 to 64 of `[A-Za-z0-9_.-]`; a UUID is one.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct RequestId(Arc<str>);

impl RequestId {
    /// Checks a text.
    ///
    /// # Errors
    /// Names the text and what an id looks like.
    pub fn new(text: &str) -> Result<Self, NameError> {
        word(text).map(Self).ok_or_else(|| NameError::Request(excerpt(text)))
    }

    /// The text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

/// The name of the key that asks for changes: 1 to 64 of `[A-Za-z0-9_.-]`.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct CallerName(Arc<str>);

impl CallerName {
    /// Checks a text.
    ///
    /// # Errors
    /// Names the text and what a name looks like.
    pub fn new(text: &str) -> Result<Self, NameError> {
        word(text).map(Self).ok_or_else(|| NameError::Caller(excerpt(text)))
    }

    /// The text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

/// `[a-z0-9][a-z0-9_-]{0,63}`.
fn path_segment(text: &str) -> Option<Arc<str>> {
    let first = |c: u8| c.is_ascii_lowercase() || c.is_ascii_digit();
    let rest = |c: u8| first(c) || c == b'_' || c == b'-';
    let bytes = text.as_bytes();
    let fits = bytes.len() <= NAME_LENGTH_MAX
        && bytes.first().is_some_and(|&c| first(c))
        && bytes.iter().all(|&c| rest(c));
    fits.then(|| text.into())
}

/// 1 to 64 of `[A-Za-z0-9_.-]`.
fn word(text: &str) -> Option<Arc<str>> {
    let fits = |c: u8| c.is_ascii_alphanumeric() || b"_.-".contains(&c);
    ((1..=NAME_LENGTH_MAX).contains(&text.len()) && text.bytes().all(fits)).then(|| text.into())
}

impl std::fmt::Display for MapName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::fmt::Display for KeepOutName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::fmt::Display for RobotName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::fmt::Display for SessionName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::fmt::Display for RequestId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_name_can_be_no_path() {
        for good in ["a", "0", "floor-2_b", &"x".repeat(64)] {
            assert!(MapName::new(good).is_ok() && KeepOutName::new(good).is_ok(), "{good}");
        }
        for bad in ["", "A", "-a", "_a", "a/b", "..", "a.b", "ä", "a b", "a\0", &"x".repeat(65)] {
            assert!(MapName::new(bad).is_err() && KeepOutName::new(bad).is_err(), "{bad}");
        }
        assert!(MapName::new(&"x".repeat(1 << 20)).unwrap_err().to_string().len() < 200);
    }

    #[test]
    fn a_robot_name_is_letters_digits_and_three_signs() {
        assert!(RobotName::new("Robot_1.arm-left").is_ok());
        assert!(RobotName::new("").is_err());
        assert!(RobotName::new("r 1").is_err());
    }
}
