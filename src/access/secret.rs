//! What a caller proves itself with, and what the server keeps of it.

use std::fmt;

use rand::TryRng;
use rand::rngs::{SysError, SysRng};
use sha2::{Digest as _, Sha256};
use subtle::{Choice, ConstantTimeEq};

/// What secrets begin with, so that people and scanners know one when they see it.
const PREFIX: &str = "mrol_";
/// Bytes from the system's random numbers: nothing that is guessed, so a plain hash hides it.
const RANDOM_BYTES: usize = 32;

/// The secret of a key. It is shown where somebody asks for its text, and nowhere else.
#[derive(Clone, PartialEq, Eq)]
pub struct Secret(String);

/// SHA-256 of a secret: enough to know it again, not enough to find it out.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Digest([u8; 32]);

impl Secret {
    /// A fresh one.
    ///
    /// # Errors
    /// When the system has no random numbers.
    pub fn random() -> Result<Self, SysError> {
        let mut bytes = [0; RANDOM_BYTES];
        SysRng.try_fill_bytes(&mut bytes)?;
        Ok(Self(format!("{PREFIX}{}", hex(&bytes))))
    }

    /// What a caller sent.
    pub fn new(text: impl Into<String>) -> Self {
        Self(text.into())
    }

    /// The text itself.
    pub fn reveal(&self) -> &str {
        &self.0
    }

    /// What is kept of it.
    pub fn digest(&self) -> Digest {
        Digest(Sha256::digest(self.0.as_bytes()).into())
    }
}

impl Digest {
    /// From 64 hexadecimal digits; nothing else is one.
    pub fn parse(text: &str) -> Option<Self> {
        let digit =
            |place: usize| text.get(place..place + 1).and_then(|digit| u8::from_str_radix(digit, 16).ok());
        let mut bytes = [0; 32];
        for (i, byte) in bytes.iter_mut().enumerate() {
            *byte = digit(2 * i)? << 4 | digit(2 * i + 1)?;
        }
        (text.len() == 64).then_some(Self(bytes))
    }

    /// Whether both are the same, in a time that does not depend on where they differ.
    pub(super) fn same_as(&self, other: &Self) -> Choice {
        self.0.ct_eq(&other.0)
    }
}

impl fmt::Debug for Secret {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Secret(..)")
    }
}

impl fmt::Debug for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Digest(..)")
    }
}

impl fmt::Display for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&hex(&self.0))
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn secrets_are_long_all_different_and_not_shown() {
        let (one, other) = (Secret::random().unwrap(), Secret::random().unwrap());
        assert_ne!(one, other);
        assert_eq!(one.reveal().len(), PREFIX.len() + 2 * RANDOM_BYTES);
        assert_eq!(format!("{one:?} {:?}", one.digest()), "Secret(..) Digest(..)");
    }

    #[test]
    fn a_digest_is_sha_256_and_reads_back() {
        let digest = Secret::new("abc").digest();
        let text = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(digest.to_string(), text);
        assert_eq!(Digest::parse(text), Some(digest));
        assert!(bool::from(digest.same_as(&Digest::parse(&text.to_uppercase()).unwrap())));
        assert!(!bool::from(digest.same_as(&Secret::new("abd").digest())));
        for bad in
            ["", "abc", &text[1..], &format!("{text}0"), &text.replace('b', "x"), &text.replace('b', "+")]
        {
            assert_eq!(Digest::parse(bad), None, "{bad}");
        }
    }
}
