//! What a program wants to open, parsed.

use std::time::Duration;

use mrol_client::bloom::FilterSettings;
use mrol_client::map::{MapName, Region};
use mrol_client::service::ServiceError;
use mrol_client::{BLOCKS_MAX_DEFAULT, Credentials, ReplicaOptions};

use crate::abi::Options;
use crate::failure::Failure;
use crate::memory;

/// Longest time until a copy is complete, where nobody says.
const OPEN_TIMEOUT_DEFAULT: Duration = Duration::from_secs(60);

/// What to open.
pub(crate) struct Opening {
    pub(crate) address: String,
    pub(crate) map: MapName,
    pub(crate) credentials: Credentials,
    pub(crate) replica: ReplicaOptions,
    /// Longest time until the copy is complete.
    pub(crate) timeout: Duration,
}

impl Opening {
    /// Parses what mrol.h says of `mrol_replica_options`.
    pub(crate) fn of(options: Options) -> Result<Self, Failure> {
        if options.reserved != [0; 5] {
            return Err(Failure::argument("options.reserved must be zero"));
        }
        let map = required(options.map, "options.map")?;
        let timeout = milliseconds(options.open_timeout_ms, OPEN_TIMEOUT_DEFAULT);
        Ok(Self {
            address: address_of(options.address)?,
            map: MapName::new(&map).map_err(ServiceError::from)?,
            credentials: credentials_of(&CredentialFiles {
                key: options.key,
                ca_file: options.ca_file,
                certificate_file: options.certificate_file,
                private_key_file: options.private_key_file,
            })?,
            replica: replica_options(&options)?,
            timeout,
        })
    }
}

fn replica_options(options: &Options) -> Result<ReplicaOptions, Failure> {
    let usual = ReplicaOptions::default();
    let has_region = memory::flag(options.has_region, "options.has_region")?;
    let region = has_region.then(|| Region::cuboid(options.region_min_m, options.region_max_m));
    let blocks_max = match options.blocks_max {
        0 => BLOCKS_MAX_DEFAULT,
        blocks => usize::try_from(blocks).unwrap_or(usize::MAX),
    };
    Ok(ReplicaOptions {
        region: region.transpose().map_err(ServiceError::from)?,
        blocks_max,
        field_bytes_max: usual.field_bytes_max,
        viewpoint_bytes_max: match memory::flag(options.without_viewpoints, "options.without_viewpoints")? {
            true => 0,
            false => usual.viewpoint_bytes_max,
        },
        silence_max: milliseconds(options.silence_timeout_ms, usual.silence_max),
        filter: memory::flag(options.with_filter, "options.with_filter")?.then(FilterSettings::default),
        age_max: (options.age_max_ms > 0).then(|| Duration::from_millis(options.age_max_ms)),
    })
}

/// `mrol_credentials`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub(crate) struct CredentialFiles {
    pub(crate) key: *const std::ffi::c_char,
    pub(crate) ca_file: *const std::ffi::c_char,
    pub(crate) certificate_file: *const std::ffi::c_char,
    pub(crate) private_key_file: *const std::ffi::c_char,
}

/// `mrol_client_options`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ClientOptions {
    pub(crate) struct_size: usize,
    pub(crate) address: *const std::ffi::c_char,
    pub(crate) credentials: CredentialFiles,
    pub(crate) timeout_ms: u64,
}

// SAFETY: it begins with its size, and any bytes are one.
unsafe impl memory::Question for ClientOptions {
    const NAME: &'static str = "options";
    const BYTES_MIN: usize = size_of::<Self>();
}

/// The credentials that files and a key are.
pub(crate) fn credentials_of(files: &CredentialFiles) -> Result<Credentials, Failure> {
    let mut credentials = Credentials::default();
    if let Some(key) = text(files.key, "options.key")? {
        credentials = credentials.with_key(&key)?;
    }
    if let Some(ca) = file(files.ca_file, "options.ca_file")? {
        credentials = credentials.with_server_ca(&ca)?;
    }
    let certificate = file(files.certificate_file, "options.certificate_file")?;
    match (certificate, file(files.private_key_file, "options.private_key_file")?) {
        (None, None) => Ok(credentials),
        (Some(certificate), Some(key)) => Ok(credentials.with_identity(&certificate, &key)?),
        _ => Err(Failure::argument("options has one of certificate_file and private_key_file, not both")),
    }
}

fn text(text: *const std::ffi::c_char, name: &str) -> Result<Option<String>, Failure> {
    // SAFETY: the program that passes options promises their texts.
    unsafe { memory::text(text, name) }
}

pub(crate) fn required(pointer: *const std::ffi::c_char, name: &str) -> Result<String, Failure> {
    text(pointer, name)?.ok_or_else(|| Failure::argument(format!("{name} is NULL")))
}

/// The address of a server, or several with commas between them. Messages about a connection show them, so that no key
/// or password may stand in one.
pub(crate) fn address_of(pointer: *const std::ffi::c_char) -> Result<String, Failure> {
    let address = required(pointer, "options.address")?;
    mrol_client::addresses(&address).into_iter().try_for_each(check_address)?;
    Ok(address)
}

fn check_address(address: &str) -> Result<(), Failure> {
    if address.starts_with("unix:") {
        return Ok(());
    }
    let place = address.split_once("://").map_or(address, |(_, place)| place);
    let place = place.strip_suffix('/').unwrap_or(place);
    // What ends with a bracket is an address of IPv6 without a port.
    let port = place.rsplit_once(':').filter(|_| !place.ends_with(']')).map_or("", |(_, port)| port);
    if place.contains(['@', '/', '?', '#']) || !port.bytes().all(|byte| byte.is_ascii_digit()) {
        let message = "options.address must be http://host:port, https://host:port or unix:/path, or several with \
            commas between them, without a user, a path or a query; what was given is not shown";
        return Err(Failure::argument(message));
    }
    Ok(())
}

fn file(path: *const std::ffi::c_char, name: &str) -> Result<Option<Vec<u8>>, Failure> {
    let Some(path) = text(path, name)? else { return Ok(None) };
    let unreadable = |error| Failure::argument(format!("{name}: {path} cannot be read: {error}"));
    // A pipe can keep its reader waiting, and a device has no end.
    if !std::fs::metadata(&path).map_err(unreadable)?.is_file() {
        return Err(Failure::argument(format!("{name}: {path} is no regular file")));
    }
    std::fs::read(&path).map(Some).map_err(unreadable)
}

fn milliseconds(milliseconds: u64, usual: Duration) -> Duration {
    if milliseconds == 0 { usual } else { Duration::from_millis(milliseconds) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_is_a_host_and_a_port() {
        let refusal = |text: &str| {
            let text = std::ffi::CString::new(text).unwrap_or_default();
            address_of(text.as_ptr()).err().map(|failure| failure.message)
        };
        for good in [
            "localhost",
            "localhost:7334",
            "http://127.0.0.1:7334",
            "https://robot-7:7334/",
            "http://[::1]:7334",
            "http://[::1]",
            "unix:/run/a@b.sock",
            "unix:///run/mrol.sock",
            "http://node-1:7334,http://node-2:7334",
            "node-1:7334, unix:/run/a,b/c.sock,https://[::1]/",
        ] {
            assert_eq!(refusal(good), None, "{good}");
        }
        for bad in [
            "http://u:SECRET@127.0.0.1:1",
            "SECRET@host",
            "http://host/SECRET",
            "host:1//SECRET",
            "http://host:1/?key=SECRET",
            "http://host?SECRET",
            "http://host#SECRET",
            "http://host:SECRET",
            "http://host:1,http://u:SECRET@host",
            "unix:/run/mrol.sock,http://host/SECRET",
        ] {
            let message = refusal(bad).unwrap_or_default();
            assert!(
                message.contains("options.address must be") && !message.contains("SECRET"),
                "{bad}: {message}"
            );
        }
    }
}
