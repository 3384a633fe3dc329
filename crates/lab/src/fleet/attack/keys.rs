//! The keys of the attacked server.

use std::path::{Path, PathBuf};

use crate::fleet::address::{GrpcAddress, HttpAddress};
use crate::fleet::error::FleetError;
use crate::fleet::process::ServerProcess;
use mrol::access::{Key, KeyName, Scope, Secret, add_to_file};
use mrol_client::Credentials;
use mrol_service::AllowedMaps;

/// Whose key it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Holder {
    /// The maker of the maps.
    Admin,
    /// The honest robot.
    Robot,
    /// The honest planner.
    Planner,
    /// The honest operator.
    Operator,
    /// An attacker with scope `read`.
    Reader,
    /// An attacker with scope `insert`.
    Inserter,
}

/// A file of keys, a key for each holder.
pub(crate) struct KeyRing {
    file: PathBuf,
    secrets: [Secret; Holder::ALL.len()],
}

impl Holder {
    const ALL: [Self; 6] =
        [Self::Admin, Self::Robot, Self::Planner, Self::Operator, Self::Reader, Self::Inserter];

    fn name(self) -> &'static str {
        match self {
            Self::Admin => "admin",
            Self::Robot => "robot",
            Self::Planner => "planner",
            Self::Operator => "operator",
            Self::Reader => "attacker-read",
            Self::Inserter => "attacker-insert",
        }
    }

    fn scope(self) -> Scope {
        match self {
            Self::Admin => Scope::Admin,
            Self::Robot | Self::Inserter => Scope::Insert,
            Self::Planner | Self::Operator | Self::Reader => Scope::Read,
        }
    }
}

impl KeyRing {
    /// Makes the keys and their file in `folder`.
    pub(crate) fn make(folder: &Path) -> Result<Self, FleetError> {
        let file = folder.join("keys.toml");
        let mut secrets = Vec::new();
        for holder in Holder::ALL {
            let secret = Secret::random().map_err(FleetError::failed)?;
            let name = KeyName::new(holder.name()).ok_or_else(|| FleetError::failed("a key needs a name"))?;
            let key = Key::new(name, secret.digest(), holder.scope(), AllowedMaps::Every);
            add_to_file(&file, &key).map_err(FleetError::failed)?;
            secrets.push(secret);
        }
        let secrets = secrets.try_into().map_err(|_| FleetError::failed("a holder has no key"))?;
        Ok(Self { file, secrets })
    }

    /// The file.
    pub(crate) fn file(&self) -> &Path {
        &self.file
    }

    /// The secret of a holder's key.
    pub(crate) fn secret(&self, holder: Holder) -> &str {
        self.secrets[holder as usize].reveal()
    }

    /// The gRPC address of a server, with a holder's key.
    pub(crate) fn grpc(&self, server: &ServerProcess, holder: Holder) -> Result<GrpcAddress, FleetError> {
        let credentials = Credentials::default().with_key(self.secret(holder))?;
        Ok(GrpcAddress { credentials, ..server.grpc() })
    }

    /// The address of `path` over HTTP, with a holder's key.
    pub(crate) fn http(
        &self,
        server: &ServerProcess,
        holder: Holder,
        path: &str,
    ) -> Result<HttpAddress, FleetError> {
        HttpAddress::new(&format!("{}{path}", server.http().url), Some(self.secret(holder)))
    }
}
