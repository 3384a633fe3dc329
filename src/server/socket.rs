//! Unix sockets: files beside the TCP addresses, for clients on the same machine.

use std::fs;
use std::fs::Permissions;
use std::io;
use std::io::ErrorKind;
use std::os::unix::fs::{FileTypeExt, MetadataExt, PermissionsExt};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};

use tokio::net::UnixListener;

use super::error::ServerError;
use super::protocol::Protocol;

/// Who may connect: the server's user and group.
const MODE: u32 = 0o660;

/// A socket that is listened on, and its file.
#[derive(Debug)]
pub(super) struct UnixSocket {
    pub(super) listener: UnixListener,
    pub(super) file: SocketFile,
}

/// The file of a socket, which goes with this value, unless another socket has taken its place.
#[derive(Debug)]
pub(super) struct SocketFile {
    path: PathBuf,
    inode: u64,
}

impl UnixSocket {
    /// Listens at `path`, if there is one. A file that a server left behind when it was killed, so that nobody
    /// answers there, is replaced; one that is no socket is not touched.
    ///
    /// # Errors
    /// When somebody answers there, the file is no socket, or none can be made.
    pub(super) fn bind(protocol: Protocol, path: Option<&Path>) -> Result<Option<Self>, ServerError> {
        let Some(path) = path else { return Ok(None) };
        let refused =
            |error| ServerError::Socket { protocol: protocol.as_str(), path: path.to_owned(), error };
        remove_stale(path).map_err(refused)?;
        Self::bind_at(path).map(Some).map_err(refused)
    }

    fn bind_at(path: &Path) -> io::Result<Self> {
        let listener = UnixListener::bind(path)?;
        let file = SocketFile { path: path.to_owned(), inode: fs::metadata(path)?.ino() };
        fs::set_permissions(path, Permissions::from_mode(MODE))?;
        Ok(Self { listener, file })
    }
}

fn remove_stale(path: &Path) -> io::Result<()> {
    let file_type = match fs::symlink_metadata(path) {
        Ok(metadata) => metadata.file_type(),
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(error),
    };
    if !file_type.is_socket() {
        return Err(io::Error::new(ErrorKind::AlreadyExists, "the file is there and is no socket"));
    }
    match UnixStream::connect(path) {
        Ok(_) => Err(io::Error::new(ErrorKind::AddrInUse, "somebody answers there already")),
        Err(error) if error.kind() == ErrorKind::ConnectionRefused => fs::remove_file(path),
        Err(error) => Err(error),
    }
}

impl SocketFile {
    pub(super) fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for SocketFile {
    fn drop(&mut self) {
        let still_ours = fs::symlink_metadata(&self.path).is_ok_and(|file| file.ino() == self.inode);
        if still_ours && let Err(error) = fs::remove_file(&self.path) {
            tracing::warn!(path = %self.path.display(), %error, "a socket's file stays behind");
        }
    }
}
