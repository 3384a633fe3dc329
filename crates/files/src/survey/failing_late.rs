//! A file whose failures are told once it is whole: the writer of LAS closes it again when it is dropped, and panics
//! where that fails.

use std::io::{self, Seek, SeekFrom, Write};
use std::sync::{Arc, Mutex, PoisonError};

/// What failed first, if anything did.
#[derive(Debug, Clone, Default)]
pub(super) struct Failure(Arc<Mutex<Option<io::Error>>>);

/// A writer that goes on after a failure as if nothing was.
pub(super) struct FailingLate<W> {
    inner: W,
    failure: Failure,
    /// Where writing would stand.
    position: u64,
}

impl Failure {
    fn keep(&self, error: io::Error) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
    }

    fn is_some(&self) -> bool {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).is_some()
    }

    /// The failure, if there was one.
    pub(super) fn check(&self) -> io::Result<()> {
        let failure = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        failure.as_ref().map_or(Ok(()), |error| Err(io::Error::new(error.kind(), error.to_string())))
    }
}

impl<W: Write + Seek> FailingLate<W> {
    pub(super) fn new(inner: W, failure: Failure) -> Self {
        Self { inner, failure, position: 0 }
    }

    /// What `act` gives, or what stands for it after a failure.
    fn unless_failed<T>(&mut self, otherwise: T, act: impl FnOnce(&mut W) -> io::Result<T>) -> T {
        if self.failure.is_some() {
            return otherwise;
        }
        act(&mut self.inner).unwrap_or_else(|error| {
            self.failure.keep(error);
            otherwise
        })
    }
}

impl<W: Write + Seek> Write for FailingLate<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.unless_failed(bytes.len(), |inner| inner.write_all(bytes).map(|()| bytes.len()));
        self.position += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.unless_failed((), W::flush);
        Ok(())
    }
}

impl<W: Write + Seek> Seek for FailingLate<W> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let otherwise = match to {
            SeekFrom::Start(at) => at,
            SeekFrom::Current(by) | SeekFrom::End(by) => self.position.saturating_add_signed(by),
        };
        self.position = self.unless_failed(otherwise, |inner| inner.seek(to));
        Ok(self.position)
    }
}

#[cfg(test)]
mod tests {
    use crate::survey::{LasKind, write_las};

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_an_error_and_no_panic() {
        for kind in [LasKind::Las, LasKind::Laz] {
            let points = (0..100_000).map(|k| [f64::from(k) * 0.01, 0.0, 0.0]);
            let written = write_las(
                "/dev/full".as_ref(),
                kind,
                [0.0; 3],
                1000.0,
                points.collect::<Vec<_>>().into_iter(),
            );
            assert!(written.unwrap_err().to_string().contains("No space left"), "{kind:?}");
        }
    }
}
