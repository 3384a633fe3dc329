//! Settings are loaded from defaults, a file, variables and options.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::Path;

use figment::Figment;
use figment::providers::{Env, Format, Serialized, Toml};
use figment::value::Value;
use mrol_service::EVERY_ROBOT;
use serde::Serialize;

use super::error::ConfigError;
use super::refused_value::described;
use super::settings::Config;
use super::variables;

impl Config {
    /// Loads the settings: defaults < `file` < `MROL_...` variables < `overrides`, whose nulls (an option that
    /// was not given) do not count.
    ///
    /// A variable counts when it names a setting at the top (`MROL_DATA_DIR`) or holds the `__` between section
    /// and key (`MROL_HTTP__LISTEN`). One that would be a setting with `__` in place of `_` is refused. Others are left
    /// alone, since container platforms set names such as `MROL_SERVICE_HOST` for every service called mrol; what
    /// nobody is known to set, [`unknown_variables`](super::unknown_variables) lists.
    ///
    /// # Errors
    /// For an unknown setting, a value of the wrong type or out of range, a missing file, or a misspelled variable.
    pub fn load(file: Option<&Path>, overrides: impl Serialize) -> Result<Self, ConfigError> {
        variables::check(variables::of_environment())?;
        let mut figment = Figment::from(Serialized::defaults(Self::default()));
        if let Some(file) = file {
            check_file(file)?;
            figment = figment.merge(Toml::file_exact(file));
        }
        let overrides =
            serde_json::to_value(overrides).map_err(|error| ConfigError::Value(error.to_string()))?;
        let given = Serialized::globals(without_nulls(overrides));
        let figment = figment.merge(settings_of_environment()).merge(given);
        if let Some((old, new)) = RENAMED.into_iter().find(|(old, _)| figment.contains(old)) {
            return Err(ConfigError::Renamed { old, new });
        }
        let figment = with_every_robot(figment);
        let config: Self = figment.extract().map_err(|e| ConfigError::Value(described(&e)))?;
        let (limits, constants) = config.limits.clone().with_constants();
        Self { limits, constants_set: constants, ..config }.checked()
    }
}

/// Sees that the settings file is a file that this process may read.
fn check_file(path: &Path) -> Result<(), ConfigError> {
    let unreadable = |problem: String| ConfigError::File { path: path.to_owned(), problem };
    // A pipe would be opened for ever.
    match fs::metadata(path) {
        Ok(metadata) if metadata.is_file() => File::open(path).map(drop),
        Ok(_) => return Err(unreadable("it is no file".to_owned())),
        Err(error) => Err(error),
    }
    .map_err(|error| unreadable(error.to_string()))
}

/// Fills what the section of a robot leaves out from the section of every robot.
fn with_every_robot(settings: Figment) -> Figment {
    let Some(mut robots) = settings.find_value("robots").ok().and_then(Value::into_dict) else {
        return settings;
    };
    let Some(every) = robots.remove(EVERY_ROBOT) else { return settings };
    let sections: BTreeMap<String, Value> = robots.into_keys().map(|name| (name, every.clone())).collect();
    settings.join(Serialized::defaults(BTreeMap::from([("robots", sections)])))
}

/// Renamed settings: former name, present name.
const RENAMED: [(&str, &str); 3] = [
    ("filter.bits_per_voxel", "filter.bits_per_key"),
    ("limits.disk_free_back_mib", "limits.disk_free_resume_mib"),
    ("limits.memory_back_mib", "limits.memory_resume_mib"),
];

/// The provider of the environment variables that are settings; see [`Config::load`].
fn settings_of_environment() -> Env {
    Env::prefixed(variables::PREFIX)
        .filter(|key| key.as_str().contains("__") || variables::TOP.iter().any(|name| key == *name))
        .split("__")
}

/// Removes nulls from a JSON value, at any depth.
fn without_nulls(value: serde_json::Value) -> serde_json::Value {
    match value {
        serde_json::Value::Object(fields) => {
            let given = fields.into_iter().filter(|(_, value)| !value.is_null());
            given.map(|(key, value)| (key, without_nulls(value))).collect()
        }
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_service::Limits;
    use serde_json::json;
    use std::io::Write;
    use std::time::Duration;

    fn load(toml: &str, overrides: serde_json::Value) -> Result<Config, ConfigError> {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(toml.as_bytes()).unwrap();
        Config::load(Some(file.path()), overrides)
    }

    #[test]
    fn the_command_line_wins_over_the_file_and_the_file_over_defaults() {
        let toml = "drain_seconds = 3\n[http]\nlisten = \"127.0.0.1:1\"\n[limits]\nmaps_max = 2";
        let given = json!({"drain_seconds": null, "http": {"listen": "0.0.0.0:2"}, "grpc": {"listen": null}});
        let config = load(toml, given).unwrap();
        assert_eq!(config.drain_seconds, 3);
        assert_eq!(config.http.listen.to_string(), "0.0.0.0:2");
        assert_eq!(config.grpc.listen.to_string(), "127.0.0.1:7334");
        let limits = config.service_settings().limits;
        assert_eq!(limits, Limits { maps_max: 2, ..Limits::default() });
    }

    #[test]
    fn what_the_section_of_a_robot_leaves_out_is_as_that_of_every_robot_says() {
        let toml = "[robots.\"*\"]\nrecover = true\nrange_max_m = 40\n[robots.r1]\nrange_max_m = 20\n\
                    [robots.\"a.b\"]\nrecover = false";
        let robots = load(toml, json!({})).unwrap().service_settings().robots;
        let of = |name: &str| (robots[name].recover, robots[name].filter.range_max_m);
        assert_eq!(of("*"), (true, Some(40.0)));
        assert_eq!(of("r1"), (true, Some(20.0)));
        assert_eq!(of("a.b"), (false, Some(40.0)));
        // One that is no section is told as before.
        let error =
            load("[robots]\nr1 = 3\n[robots.\"*\"]\nrecover = true", json!({})).unwrap_err().to_string();
        assert!(error.contains("robots.r1"), "{error}");
    }

    #[test]
    fn a_key_that_is_none_is_named() {
        for (toml, key) in
            [("color = 1", "color"), ("[http]\nlisen = \"a\"", "lisen"), ("[limits]\nx = 1", "x")]
        {
            let error = load(toml, json!({})).unwrap_err().to_string();
            assert!(error.contains(key), "{error}");
        }
        assert!(load("", json!({"http": {"port": 1}})).unwrap_err().to_string().contains("port"));
    }

    #[test]
    fn a_setting_of_an_earlier_version_is_refused_with_its_name_of_today() {
        for (old, new) in RENAMED {
            let (section, name) = old.split_once('.').unwrap();
            let error = load(&format!("[{section}]\n{name} = 14"), json!({})).unwrap_err().to_string();
            assert!(error.contains(old) && error.contains(new), "{error}");
        }
    }

    #[test]
    fn what_became_a_constant_is_read_told_and_does_not_count() {
        let config = load("[limits]\nprobes_max = 5\nmaps_max = 3", json!({})).unwrap();
        assert_eq!(config.constants_set, ["limits.probes_max"]);
        assert_eq!(config.limits, Limits { maps_max: 3, ..Limits::default() });
    }

    #[test]
    fn whole_numbers_are_read_as_what_they_are_in_every_language() {
        let most = |value: u64| load(&format!("[store]\nundo_bytes_max = {value}"), json!({}));
        assert_eq!(most(1 << 53).unwrap().store.undo_bytes_max, 1 << 53);
        let error = most((1 << 53) + 2).unwrap_err().to_string();
        assert!(
            error.contains("store.undo_bytes_max must be 0 to 9007199254740992, got 9007199254740994"),
            "{error}"
        );
    }

    #[test]
    fn values_that_do_not_fit_are_named() {
        let error = |toml| load(toml, json!({})).unwrap_err().to_string();
        let journal = error("[store]\nsnapshot_journal_mib = 0");
        assert!(journal.contains("store.snapshot_journal_mib must be 1 to 1048576, got 0"), "{journal}");
        let durability = error("[store]\ndurability = \"often\"");
        assert!(
            durability.contains("must be \"always\" or an interval")
                && durability.contains("store.durability"),
            "{durability}"
        );
        assert!(error("[limits]\nmin_revision_wait_max_s = -1").contains("min_revision_wait_max_s"));
        assert!(error("[tls]\nkey = \"a\"").contains("tls.certificate is missing"));
        assert!(error("[tls]\ncertificate = \"a\"").contains("tls.key is missing"));
        assert!(error("[tls]\nclient_ca = \"a\"").contains("tls.client_ca is of no use"));
        for (name, table) in
            [("r*", "[robots.\"r*\"]\nrecover = true"), ("a b", "[robots.\"a b\"]\nrecover = true")]
        {
            let named = error(table);
            assert!(named.contains(&format!("robots.{name:?}: robot must be 1 to 64 of")), "{named}");
        }
        let margin = error("[robots.r]\ncarve = true\ncarve_margin_voxels = 9");
        assert!(margin.contains("robots.r: carve_margin_voxels must be 1 to 8, got 9"), "{margin}");
        let sensor = error("[robots.r]\nsensor = \"spinning 0 1800 -24.9 2\"");
        assert!(
            sensor.contains("rings must lie in 1..=1024, got 0") && sensor.contains("sensor"),
            "{sensor}"
        );
        let threads = error("[threads]\nmapping = 1025");
        assert!(threads.contains("threads.mapping must be 0 to 1024, got 1025"), "{threads}");
        assert!(
            error("[limits]\njobs_waiting_max = 1048577").contains("jobs_waiting_max must be 0 to 1048576")
        );
        assert!(error("[log]\nformat = \"xml\"").contains("xml"));
        let missing = Config::load(Some(Path::new("no-such-file.toml")), json!({})).unwrap_err();
        let missing = missing.to_string();
        assert!(missing.contains("no-such-file.toml") && missing.contains("No such file"), "{missing}");
        let folder = tempfile::tempdir().unwrap();
        let folder = Config::load(Some(folder.path()), json!({})).unwrap_err().to_string();
        assert!(folder.ends_with("it is no file"), "{folder}");
    }

    #[test]
    fn the_delay_before_draining_has_an_end() {
        let delay = |seconds: u64| load(&format!("drain_delay_s = {seconds}"), json!({}));
        assert_eq!(delay(3600).unwrap().drain_delay(), Duration::from_secs(3600));
        let error = delay(3601).unwrap_err().to_string();
        assert!(error.contains("drain_delay_s must be 0 to 3600, got 3601"), "{error}");
        assert_eq!(Config::default().drain_delay_s, 0);
    }

    #[test]
    fn access_is_open_or_by_keys_and_answers_to_hosts() {
        let error = |toml| load(toml, json!({})).unwrap_err().to_string();
        let both = error("[access]\nopen = true\nkeys_file = \"k\"");
        assert!(both.contains("access.open") && both.contains("access.keys_file"), "{both}");
        assert!(load("[access]\nopen = false\nkeys_file = \"k\"", json!({})).is_ok());
        let host = error("[access]\nhosts = [\"mrol\", \"mrol:7333\"]");
        assert!(
            host.contains("access.hosts must be names or addresses without ports, got \"mrol:7333\""),
            "{host}"
        );
        assert!(load("[access]\nhosts = [\"mrol\", \"10.0.0.1\"]", json!({})).is_ok());
        for section in ["access", "tls"] {
            let days = |days| load(&format!("[{section}]\nexpiry_warning_days = {days}"), json!({}));
            let refused = days(3651).unwrap_err().to_string();
            assert!(refused.contains("expiry_warning_days must be 0 to 3650, got 3651"), "{refused}");
            assert!(days(3650).is_ok() && days(0).is_ok());
        }
    }

    #[test]
    fn marks_need_room_between_them() {
        let error = |limits| load(&format!("[limits]\n{limits}"), json!({})).unwrap_err().to_string();
        let disk = error("disk_free_low_mib = 512");
        assert!(
            disk.contains("limits.disk_free_resume_mib must be more than limits.disk_free_low_mib, got 512"),
            "{disk}"
        );
        let memory = error("memory_high_mib = 100\nmemory_resume_mib = 100");
        assert!(memory.contains("memory_resume_mib must be less than limits.memory_high_mib"), "{memory}");
        assert!(error("memory_resume_mib = 100").contains("limits.memory_high_mib is missing"));
        let beyond = error("disk_free_resume_mib = 1099511627777");
        assert!(beyond.contains("disk_free_resume_mib must be 0 to 1099511627776"), "{beyond}");

        let limits = load("[limits]\nmemory_high_mib = 3\ndisk_free_low_mib = 0", json!({})).unwrap();
        let marks = limits.service_settings().limits.marks();
        assert_eq!((marks.memory_high_bytes, marks.memory_resume_bytes), (Some(3 << 20), None));
        assert_eq!((marks.disk_free_low_bytes, marks.disk_free_resume_bytes), (0, 512 << 20));
    }

    #[test]
    fn an_empty_data_dir_keeps_maps_in_memory() {
        let config = load("data_dir = \"\"", json!({})).unwrap();
        assert_eq!(config.service_settings().data_dir, None);
        assert!(Config::default().service_settings().data_dir.is_some());
    }
}
