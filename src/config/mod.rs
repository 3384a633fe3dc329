//! The daemon's settings: defaults, then a TOML file, then `MROL_...` variables, then the command line.

mod access;
mod admin;
mod cluster;
mod documented;
mod error;
mod filter;
mod limits;
mod listener;
mod loading;
mod log;
mod maps;
mod refused_value;
mod scans;
mod settings;
mod store;
mod threads;
mod tls;
mod variables;

pub use access::AccessConfig;
pub use admin::AdminConfig;
pub use cluster::ClusterConfig;
#[cfg(feature = "cluster")]
pub(crate) use cluster::advertised;
pub use error::ConfigError;
pub use filter::FilterConfig;
pub use listener::ListenerConfig;
pub use log::LogConfig;
pub use maps::MapsConfig;
pub use scans::{AlignmentConfig, RobotConfig};
pub use settings::Config;
pub use store::StoreConfig;
pub use threads::ThreadsConfig;
pub use tls::TlsConfig;
pub use variables::OF_COMMANDS as VARIABLES_OF_COMMANDS;
pub use variables::unknown_variables;
