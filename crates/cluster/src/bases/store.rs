//! The files of bases.

use std::future::Future;
use std::io;
use std::time::Duration;

use async_nats::jetstream;
use async_nats::jetstream::object_store::{InfoErrorKind, ObjectMetadata, ObjectStore};
use async_nats::jetstream::stream::{Config, DiscardPolicy, StorageType};
use tokio::io::AsyncReadExt;
use uuid::Uuid;

use super::base::object_of;
use super::error::BaseError;
use crate::engine::{Engine, StreamError};
use mrol_service::replication::Base;

/// Name of the object store.
pub(super) const NAME: &str = "mrol-bases";

/// Bytes of a piece. Each is acknowledged before the next, so that larger ones are faster: three servers on one machine
/// took 20 MB in 0.5 s, and gave them in 0.1 s. NATS takes messages of 1 MiB.
const PIECE: usize = 512 << 10;

/// How long the next bytes of a file may take. An election takes some seconds, and whoever fetches asks again.
const NEXT_WITHIN: Duration = Duration::from_secs(10);

/// Bytes that are reserved for a file before it comes, at most.
const RESERVED_MAX: usize = 64 << 20;

/// The files of bases, in the object store `mrol-bases`. A file is there as a whole or not at all.
#[derive(Debug, Clone)]
pub struct BaseStore {
    pub(super) engine: Engine,
}

impl BaseStore {
    /// The store, which is made where there is none.
    ///
    /// # Errors
    /// Says what NATS said.
    pub fn create(engine: &Engine) -> Result<Self, StreamError> {
        engine.block_on(engine.create_stream(&config_of(engine.replicas())))?;
        Ok(Self { engine: engine.clone() })
    }

    /// Puts a map file there. One that was cut short is not there, and may be put again. Takes as long as the network
    /// and the servers' disks need for it.
    ///
    /// # Errors
    /// NATS did not take it.
    pub fn put(&self, map: Uuid, base: &Base, file: &[u8]) -> Result<(), BaseError> {
        self.engine.block_on(async {
            let name = object_of(base, map);
            let described =
                ObjectMetadata { name: name.clone(), chunk_size: Some(PIECE), ..ObjectMetadata::default() };
            let put = self.store().await?.put(described, &mut &*file).await.map_err(unavailable)?;
            match put.size == file.len() {
                true => Ok(()),
                false => {
                    let (bytes, put) = (file.len(), put.size);
                    Err(BaseError::Damaged(format!("{name}: {bytes} bytes, of which {put} were put")))
                }
            }
        })
    }

    /// Fetches a map file.
    ///
    /// # Errors
    /// NATS does not have all of it, or did not answer.
    pub fn fetch(&self, map: Uuid, base: &Base) -> Result<Vec<u8>, BaseError> {
        let name = object_of(base, map);
        self.engine.block_on(async {
            let store = self.store().await?;
            let mut object = in_time(store.get(name.as_str())).await?.map_err(unavailable)?;
            let expected = object.info().size;
            // What is said of the size is not believed before it comes.
            let mut file = Vec::with_capacity(expected.min(RESERVED_MAX));
            let mut buffer = vec![0; PIECE];
            loop {
                // The store compares all of it with its hash.
                let read = in_time(object.read(&mut buffer)).await?.map_err(|error| damaged(&name, error))?;
                if read == 0 {
                    break;
                }
                file.extend_from_slice(&buffer[..read]);
            }
            match file.len() == expected {
                true => Ok(file),
                false => Err(BaseError::Damaged(format!("{name}: {} bytes of {expected}", file.len()))),
            }
        })
    }

    /// True where the file is there.
    ///
    /// # Errors
    /// Nobody answered.
    pub fn has(&self, map: Uuid, base: &Base) -> Result<bool, BaseError> {
        self.engine.block_on(async {
            match in_time(self.store().await?.info(object_of(base, map))).await? {
                Ok(info) => Ok(!info.deleted),
                Err(error) if error.kind() == InfoErrorKind::NotFound => Ok(false),
                Err(error) => Err(unavailable(error)),
            }
        })
    }

    /// Deletes a file that nothing points to any more.
    ///
    /// # Errors
    /// NATS did not.
    pub fn delete(&self, map: Uuid, base: &Base) -> Result<(), BaseError> {
        self.engine.block_on(async {
            in_time(self.store().await?.delete(object_of(base, map))).await?.map_err(unavailable)
        })
    }

    async fn store(&self) -> Result<ObjectStore, BaseError> {
        let context = jetstream::new(self.engine.client().clone());
        in_time(context.get_object_store(NAME)).await?.map_err(unavailable)
    }
}

/// What a step gives, unless it takes too long.
async fn in_time<T>(step: impl Future<Output = T>) -> Result<T, BaseError> {
    let timed = tokio::time::timeout(NEXT_WITHIN, step).await;
    timed.map_err(|_| {
        BaseError::Unavailable(format!("NATS did not answer within {} s", NEXT_WITHIN.as_secs()))
    })
}

fn unavailable(error: impl std::error::Error) -> BaseError {
    BaseError::Unavailable(format!("object store {NAME}: {error}"))
}

/// The store says of a hash that differs that the data are invalid, and of all else that it could not read.
fn damaged(name: &str, error: io::Error) -> BaseError {
    match error.kind() {
        io::ErrorKind::InvalidData => BaseError::Damaged(format!("{name}: {error}")),
        _ => unavailable(error),
    }
}

/// An object store as all clients of NATS know it.
fn config_of(replicas: usize) -> Config {
    Config {
        name: format!("OBJ_{NAME}"),
        description: Some("Map files".to_owned()),
        subjects: vec![format!("$O.{NAME}.C.>"), format!("$O.{NAME}.M.>")],
        num_replicas: replicas,
        storage: StorageType::File,
        discard: DiscardPolicy::New,
        allow_rollup: true,
        allow_direct: true,
        ..Config::default()
    }
}
