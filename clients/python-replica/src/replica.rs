//! A copy of a server's map, which follows it.

use std::time::Duration;

use mrol_client::bloom::FilterSettings;
use mrol_client::map::{MapName, Region};
use mrol_client::service::{MapVersion, ServiceError};
use mrol_client::{Client, Credentials, Replica, ReplicaOptions};
use pyo3::prelude::*;

use crate::answers::{Version, told};
use crate::failure::{Failure, guarded};
use crate::questions::NativeMap;
use crate::source::{OpenSource, Source};
use crate::waiting::wait_for;

/// How far a replica is: its version, the server's revision, whether it is connected, copies made, the last error, the
/// seconds since the server was heard, whether it follows no longer.
type Status = (Version, u64, bool, u64, Option<String>, f64, bool);

/// A copy of a server's map.
#[pyclass(frozen, extends = NativeMap, module = "mrol_native")]
pub(crate) struct NativeReplica {
    /// It copies all of the map, whose hash it knows.
    is_whole: bool,
}

#[pymethods]
impl NativeReplica {
    /// Copies a map, and follows it.
    #[new]
    #[pyo3(signature = (address, map, *, key, ca, certificate, private_key, timeout_s, silence_s, region, blocks_max, bloom,
        viewpoints, age_max_s))]
    #[expect(clippy::too_many_arguments, reason = "they are the keywords of a function of Python")]
    fn open(
        py: Python<'_>,
        address: &str,
        map: &str,
        key: Option<&str>,
        ca: Option<&[u8]>,
        certificate: Option<&[u8]>,
        private_key: Option<&[u8]>,
        timeout_s: f64,
        silence_s: Option<f64>,
        region: Option<([f64; 3], [f64; 3])>,
        blocks_max: Option<usize>,
        bloom: bool,
        viewpoints: bool,
        age_max_s: Option<f64>,
    ) -> PyResult<PyClassInitializer<Self>> {
        guarded(|| {
            let mut credentials = Credentials::default();
            let of = |made: Result<Credentials, _>| made.map_err(Failure::from);
            if let Some(key) = key {
                credentials = of(credentials.with_key(key))?;
            }
            if let Some(ca) = ca {
                credentials = of(credentials.with_server_ca(ca))?;
            }
            credentials = match (certificate, private_key) {
                (None, None) => credentials,
                (Some(certificate), Some(key)) => of(credentials.with_identity(certificate, key))?,
                _ => return Err(Failure::argument("one of certificate and private_key, not both").into()),
            };
            let usual = ReplicaOptions::default();
            let region = region.map(|(min_m, max_m)| Region::cuboid(min_m, max_m)).transpose();
            let options = ReplicaOptions {
                region: region.map_err(ServiceError::from).map_err(Failure::from)?,
                blocks_max: blocks_max.unwrap_or(usual.blocks_max),
                filter: bloom.then(FilterSettings::default),
                viewpoint_bytes_max: if viewpoints { usual.viewpoint_bytes_max } else { 0 },
                silence_max: silence_s.map_or(usual.silence_max, Duration::from_secs_f64),
                age_max: age_max_s.map(Duration::from_secs_f64),
                ..usual
            };
            let map = MapName::new(map).map_err(ServiceError::from).map_err(Failure::from)?;
            let timeout = Duration::from_secs_f64(timeout_s);
            let replica = wait_for(py, async {
                let copying = async {
                    let client = Client::connect_with(address, &credentials).await?;
                    Replica::open(client, map, options).await.map_err(Failure::from)
                };
                let too_slow = |_| {
                    Failure::timed_out(format!("the copy was not complete within {timeout_s} s (timeout_s)"))
                };
                tokio::time::timeout(timeout, copying).await.map_err(too_slow)?
            })?;
            let source = OpenSource::new(Source::Replica(replica));
            let replica = Self { is_whole: options.region.is_none() };
            Ok(PyClassInitializer::from(NativeMap { source }).add_subclass(replica))
        })
    }

    /// How far it is.
    fn status(slf: PyRef<'_, Self>) -> PyResult<Status> {
        guarded(|| {
            let source = slf.as_super().source.get()?;
            let replica = source.replica()?;
            let (status, age_s) = (replica.status(), replica.age().as_secs_f64());
            let content_hash = slf.is_whole.then_some(status.version.hash);
            let version =
                MapVersion { revision: status.version.revision, map_uuid: status.map_uuid, content_hash };
            let (head, connected, resets) = (status.head_revision, status.is_connected, status.resets);
            Ok((told(&version), head, connected, resets, status.last_error, age_s, status.has_ended))
        })
    }

    /// Refuses a copy whose server was heard longer ago than `age_max_s`.
    fn check_age(slf: PyRef<'_, Self>, age_max_s: f64) -> PyResult<()> {
        guarded(|| {
            let source = slf.as_super().source.get()?;
            let checked = source.replica()?.check_age(Duration::from_secs_f64(age_max_s));
            Ok(checked.map_err(Failure::from)?)
        })
    }

    /// Waits until it has a revision.
    fn wait_for_revision(
        slf: PyRef<'_, Self>,
        py: Python<'_>,
        revision: u64,
        timeout_s: f64,
    ) -> PyResult<()> {
        guarded(|| {
            let source = slf.as_super().source.get()?;
            let replica = source.replica()?;
            wait_for(py, replica.wait_for_revision(revision, Duration::from_secs_f64(timeout_s)))
        })
    }
}
