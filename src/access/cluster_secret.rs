//! The secret of a cluster: by it nodes believe each other for whom they ask.

use std::path::{Path, PathBuf};
use std::{fs, io};

use super::reload::is_open_to_others;
use super::secret::Secret;

/// Characters of the secret of a cluster, at least: nobody chooses as many, so that it is not guessed.
const LENGTH_MIN: usize = 32;

/// Why a file holds no secret of a cluster.
#[derive(Debug, thiserror::Error)]
pub enum ClusterSecretError {
    /// It cannot be read.
    #[error("the file of the cluster's secret, {file}, cannot be read: {cause}", file = .file.display())]
    Unreadable {
        /// Which.
        file: PathBuf,
        /// What the system said.
        cause: io::Error,
    },
    /// It holds something else.
    #[error(
        "{file} holds no secret of a cluster: one line of {LENGTH_MIN} characters or more, such as \
         `openssl rand -hex 32` prints, without spaces",
        file = .0.display()
    )]
    None(PathBuf),
}

/// Reads the secret of a cluster from a file, which is the same on all nodes: one line, spaces around it do not count.
///
/// # Errors
/// When the file cannot be read or holds something else. The error does not repeat it.
pub fn read_cluster_secret(file: &Path) -> Result<Secret, ClusterSecretError> {
    let unreadable = |cause| ClusterSecretError::Unreadable { file: file.to_owned(), cause };
    let text = fs::read_to_string(file).map_err(unreadable)?;
    if is_open_to_others(file) {
        tracing::warn!(
            path = %file.display(),
            "everybody on this machine may read or write the file of the cluster's secret"
        );
    }
    let secret = text.trim();
    let is_one = secret.len() >= LENGTH_MIN && secret.bytes().all(|c| c.is_ascii_graphic());
    is_one.then(|| Secret::new(secret)).ok_or_else(|| ClusterSecretError::None(file.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_secret_is_one_long_line_and_is_not_repeated_in_the_error() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let read = |text: &str| {
            fs::write(file.path(), text).unwrap();
            read_cluster_secret(file.path())
        };
        let secret = Secret::random().unwrap();
        assert_eq!(read(&format!("{}\n", secret.reveal())).unwrap(), secret);
        assert_eq!(read(&"x".repeat(32)).unwrap().reveal().len(), 32);
        for none in ["", "hush", &"x".repeat(31), &format!("{0} {0}", "y".repeat(32)), &"\u{e4}".repeat(32)] {
            let error = read(none).unwrap_err().to_string();
            assert!(error.contains("holds no secret") && !error.contains("hush"), "{error}");
        }
        let gone = read_cluster_secret(Path::new("/nowhere/secret")).unwrap_err().to_string();
        assert!(gone.contains("/nowhere/secret, cannot be read"), "{gone}");
    }
}
