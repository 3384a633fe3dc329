//! All settings, from defaults, a file, variables and options.

use super::access::AccessConfig;
use super::admin::AdminConfig;
use super::cluster::ClusterConfig;
use super::error::ConfigError;
use super::filter::FilterConfig;
use super::limits;
use super::listener::ListenerConfig;
use super::log::LogConfig;
use super::maps::MapsConfig;
use super::scans::AlignmentConfig;
use super::scans::RobotConfig;
use super::store::StoreConfig;
use super::threads::ThreadsConfig;
use super::tls::TlsConfig;
use std::collections::BTreeMap;
use std::net::Ipv4Addr;
use std::path::PathBuf;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use mrol_map::align::AlignmentSettings;
use mrol_map::bloom::FilterSettings;
use mrol_map::map::RobotName;
use mrol_map::mapping::StationarySettings;
use mrol_service::{
    EVERY_ROBOT, Limits, OutOfRange, ServiceSettings, Setting, SettingKind, SettingValue, Unit,
};

/// The longest [`Config::drain_delay_s`]: longer, and the server would seem not to hear its signal.
const DRAIN_DELAY_MAX_S: f64 = 3600.0;

/// All settings of the daemon.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Where maps are kept across restarts; an empty path, `\"\"`, keeps them in memory only. `./mrol-data`.
    pub data_dir: PathBuf,
    /// Settings of a node of a cluster.
    pub cluster: ClusterConfig,
    /// Settings of the store.
    pub store: StoreConfig,
    /// Which maps are kept in memory.
    pub maps: MapsConfig,
    /// Seconds that requests in flight may take when the server goes down, and saving the maps after them. 10.
    pub drain_seconds: u64,
    /// Seconds that the server goes on to serve after it was told to end, while `/readyz` says that it is not ready:
    /// for balancers that look at it now and then. 0; 5 in the container image.
    pub drain_delay_s: u64,
    /// The HTTP listener; 127.0.0.1:7333.
    pub http: ListenerConfig,
    /// The gRPC listener; 127.0.0.1:7334.
    pub grpc: ListenerConfig,
    /// The listener for health and metrics alone; none.
    pub admin: AdminConfig,
    /// Keys, and who needs none.
    pub access: AccessConfig,
    /// Settings of TLS.
    pub tls: TlsConfig,
    /// Settings of the log.
    pub log: LogConfig,
    /// Numbers of threads for work that uses the CPU.
    pub threads: ThreadsConfig,
    /// Filter of new maps whose requests do not say.
    pub filter: FilterConfig,
    /// Settings of alignment.
    pub alignment: AlignmentConfig,
    /// Settings by robot name; `"*"` stands for every other robot, and for what the others leave out.
    pub robots: BTreeMap<String, RobotConfig>,
    /// Limits of the server; each is named in the error of a request beyond it.
    pub limits: Limits,
    /// Constants that the file, a variable or an option sets: they were settings once, and what is set does not count.
    #[serde(skip)]
    pub constants_set: Vec<&'static str>,
}

impl Default for Config {
    fn default() -> Self {
        let listener = |port| ListenerConfig { listen: (Ipv4Addr::LOCALHOST, port).into(), socket: None };
        Self {
            data_dir: "./mrol-data".into(),
            cluster: ClusterConfig::default(),
            store: StoreConfig::default(),
            maps: MapsConfig::default(),
            drain_seconds: 10,
            drain_delay_s: 0,
            http: listener(7333),
            grpc: listener(7334),
            admin: AdminConfig::default(),
            access: AccessConfig::default(),
            tls: TlsConfig::default(),
            log: LogConfig::default(),
            threads: ThreadsConfig::default(),
            filter: FilterConfig::default(),
            alignment: AlignmentConfig::default(),
            robots: BTreeMap::new(),
            limits: Limits::default(),
            constants_set: Vec::new(),
        }
    }
}

impl Config {
    /// Refuses numbers that would stop the server from working at all.
    pub(super) fn checked(self) -> Result<Self, ConfigError> {
        if let Some(OutOfRange { key, range, value }) = self.out_of_range() {
            return Err(ConfigError::Range { key, range, value });
        }
        limits::check(&self.limits)?;
        self.access.check()?;
        self.cluster.check(self.access.keys_file.is_some(), self.data_dir.as_os_str().is_empty())?;
        if let Some((needed, by)) = self.tls.missing() {
            return Err(ConfigError::Missing { needed, by });
        }
        for (name, robot) in &self.robots {
            if let (true, Err(error)) = (name != EVERY_ROBOT, RobotName::new(name)) {
                return Err(ConfigError::RobotName { name: name.clone(), error });
            }
            if let Err(error) = robot.filter().checked() {
                return Err(ConfigError::Robot { name: name.clone(), error });
            }
            if let Err(error) = robot.carving().checked() {
                return Err(ConfigError::RobotCarving { name: name.clone(), error });
            }
            if let Err(error) = robot.odometry().checked() {
                return Err(ConfigError::RobotOdometry { name: name.clone(), error });
            }
        }
        Ok(self)
    }

    /// The first value that is out of the range of its row.
    fn out_of_range(&self) -> Option<OutOfRange> {
        let [_, drain, delay] = Self::top();
        let of_section = [
            self.drain_seconds.number().and_then(|number| drain.out_of_range("drain_seconds", number)),
            self.drain_delay_s.number().and_then(|number| delay.out_of_range("drain_delay_s", number)),
            self.store.out_of_range(),
            self.maps.out_of_range(),
            self.admin.out_of_range(),
            self.access.out_of_range(),
            self.cluster.out_of_range(),
            self.tls.out_of_range(),
            self.threads.out_of_range(),
            self.filter.out_of_range(),
            self.limits.out_of_range(),
        ];
        of_section.into_iter().flatten().next()
    }

    /// The rows of the settings outside of any section.
    pub(super) fn top() -> [Setting; 3] {
        let row = |name, kind, unit, most: Option<f64>, sentence: &str| Setting {
            name,
            kind,
            unit,
            least: most.map(|_| 0.0),
            most,
            words: Vec::new(),
            sentence: sentence.into(),
        };
        [
            row(
                "data_dir",
                SettingKind::Text,
                Unit::none,
                None,
                "Where maps are kept across restarts; an empty path, `\"\"`, keeps them in memory only.",
            ),
            row(
                "drain_seconds",
                SettingKind::Integer,
                Unit::s,
                None,
                "Time that requests in flight may take when the server goes down, and again (at least 5 s) saving the maps.",
            ),
            row(
                "drain_delay_s",
                SettingKind::Integer,
                Unit::s,
                Some(DRAIN_DELAY_MAX_S),
                "Time to serve on after the server was told to end, while `/readyz` says that it is not ready: for balancers \
                 that look at it now and then. 5 in the container image.",
            ),
        ]
    }

    /// The settings that the service is opened with.
    pub fn service_settings(&self) -> ServiceSettings {
        let FilterConfig { hashes, bits_per_key } = self.filter;
        ServiceSettings {
            data_dir: (!self.data_dir.as_os_str().is_empty()).then(|| self.data_dir.clone()),
            store: self.store.of_store(),
            limits: self.limits.clone(),
            gauges: None,
            observers: Vec::new(),
            query_threads: self.threads.query,
            planning_threads_beside_robots: self.threads.planning_beside_robots,
            mapping_threads: self.threads.mapping,
            alignment_threads: self.threads.alignment,
            localization_threads: self.threads.localization,
            alignment: AlignmentSettings { method: self.alignment.method.0, ..AlignmentSettings::default() },
            stationary: StationarySettings::default(),
            robots: self.robots.iter().map(|(name, robot)| (name.clone(), robot.of_robot())).collect(),
            filter: FilterSettings { hashes, bits_per_key },
            // A map that nodes share follows its log.
            sleep_after: self.maps.sleep_after().filter(|_| !self.cluster.is_used()),
            cluster: None,
            adoption: None,
        }
    }

    /// Time that requests in flight may take when the server goes down, and saving the maps after them.
    pub fn drain(&self) -> Duration {
        Duration::from_secs(self.drain_seconds)
    }

    /// Time that the server goes on to serve after it was told to end.
    pub fn drain_delay(&self) -> Duration {
        Duration::from_secs(self.drain_delay_s)
    }
}
