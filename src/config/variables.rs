//! Environment variables: which are settings, which belong to others, and which are misspelled settings.

use serde_json::Value;

use mrol_service::Limits;

use super::error::ConfigError;
use super::settings::Config;

/// Prefix of the variables' names. `__` separates section and setting: `MROL_HTTP__LISTEN`.
pub(super) const PREFIX: &str = "MROL_";

/// Settings outside of any section, which need no `__`.
pub(super) const TOP: [&str; 3] = ["data_dir", "drain_seconds", "drain_delay_s"];

/// Variables that options of commands are read from, without `MROL_`; a test compares them with the command line.
pub const OF_COMMANDS: [&str; 7] = ["CONFIG", "SERVER", "KEY", "KEY_FILE", "CA", "CLIENT_CERT", "CLIENT_KEY"];

/// What a variable means to the settings.
#[derive(Debug, PartialEq, Eq)]
enum Meaning {
    /// A setting, or a name that figment refuses.
    Setting,
    /// No setting.
    Other,
    /// A misspelled setting; the payload is the right spelling.
    Misspelled(String),
    Unknown,
}

/// Refuses variables that have `_` where a setting has `__`.
///
/// # Errors
/// Names the variable and the right spelling.
pub(super) fn check(names: impl Iterator<Item = String>) -> Result<(), ConfigError> {
    let settings = spellings();
    for name in names {
        if let Meaning::Misspelled(meant) = meaning(&name, &settings) {
            return Err(ConfigError::Variable { name, meant });
        }
    }
    Ok(())
}

/// Names of this process's variables that begin with `MROL_` and mean nothing to this program, sorted.
pub fn unknown_variables() -> Vec<String> {
    let settings = spellings();
    let mut unknown: Vec<String> =
        of_environment().filter(|name| meaning(name, &settings) == Meaning::Unknown).collect();
    unknown.sort();
    unknown
}

/// Names of this process's variables; names that are not UTF-8 are left out.
pub(super) fn of_environment() -> impl Iterator<Item = String> {
    std::env::vars_os().filter_map(|(name, _)| name.into_string().ok())
}

fn meaning(name: &str, settings: &[String]) -> Meaning {
    let upper = name.to_ascii_uppercase();
    let Some(rest) = upper.strip_prefix(PREFIX) else { return Meaning::Other };
    if rest.contains("__") || TOP.iter().any(|top| rest.eq_ignore_ascii_case(top)) {
        return Meaning::Setting;
    }
    if OF_COMMANDS.contains(&rest) || is_of_kubernetes(rest) {
        return Meaning::Other;
    }
    match settings.iter().find(|setting| setting.replace("__", "_") == rest) {
        Some(setting) => Meaning::Misspelled(format!("{PREFIX}{setting}")),
        None if rest.starts_with("ROBOTS_") => Meaning::Misspelled(format!("{PREFIX}ROBOTS__NAME__SETTING")),
        None => Meaning::Unknown,
    }
}

/// True of variables that Kubernetes, and container links before it, set for a service called mrol:
/// `MROL_SERVICE_HOST`, `MROL_SERVICE_PORT`, `MROL_SERVICE_PORT_GRPC`, `MROL_PORT`, `MROL_PORT_7333_TCP`,
/// `MROL_PORT_7333_TCP_ADDR`, ...
fn is_of_kubernetes(rest: &str) -> bool {
    let of_port = |rest: &str| {
        let mut parts = rest.splitn(3, '_');
        let number = parts.next().is_some_and(|n| !n.is_empty() && n.bytes().all(|c| c.is_ascii_digit()));
        let protocol = parts.next().is_some_and(|protocol| ["TCP", "UDP", "SCTP"].contains(&protocol));
        let detail = parts.next().is_none_or(|detail| ["PROTO", "PORT", "ADDR"].contains(&detail));
        number && protocol && detail
    };
    matches!(rest, "SERVICE_HOST" | "SERVICE_PORT" | "PORT")
        || rest.strip_prefix("SERVICE_PORT_").is_some_and(|name| !name.is_empty())
        || rest.strip_prefix("PORT_").is_some_and(of_port)
}

/// Names of all settings within sections, spelled as variables without [`PREFIX`].
fn spellings() -> Vec<String> {
    let mut found = Vec::new();
    if let Ok(Value::Object(sections)) = serde_json::to_value(Config::default()) {
        for (section, settings) in &sections {
            collect(section, settings, &mut found);
        }
    }
    found.extend(
        Limits::constants().iter().map(|(row, _)| format!("LIMITS__{}", row.name.to_ascii_uppercase())),
    );
    found
}

fn collect(path: &str, value: &Value, found: &mut Vec<String>) {
    match value {
        Value::Object(fields) => {
            fields.iter().for_each(|(name, value)| collect(&format!("{path}__{name}"), value, found));
        }
        _ => found.push(path.to_ascii_uppercase()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn meaning(name: &str) -> Meaning {
        super::meaning(name, &spellings())
    }

    #[test]
    fn a_setting_spelled_with_one_underscore_is_named_with_its_right_spelling() {
        for (name, meant) in [
            ("MROL_ACCESS_KEYS_FILE", "MROL_ACCESS__KEYS_FILE"),
            ("MROL_HTTP_LISTEN", "MROL_HTTP__LISTEN"),
            ("MROL_TLS_CLIENT_CA", "MROL_TLS__CLIENT_CA"),
            ("MROL_LIMITS_MAPS_MAX", "MROL_LIMITS__MAPS_MAX"),
            ("mrol_grpc_socket", "MROL_GRPC__SOCKET"),
            ("MROL_ROBOTS_R1_RANGE_MAX_M", "MROL_ROBOTS__NAME__SETTING"),
        ] {
            assert_eq!(meaning(name), Meaning::Misspelled(meant.into()));
            let error = check([name.to_owned()].into_iter()).unwrap_err().to_string();
            assert!(error.contains(name) && error.contains(meant), "{error}");
        }
    }

    #[test]
    fn what_others_set_is_left_alone_and_the_rest_is_told() {
        for other in [
            "MROL_SERVICE_HOST",
            "MROL_SERVICE_PORT",
            "MROL_SERVICE_PORT_GRPC",
            "MROL_PORT",
            "MROL_PORT_7333_TCP",
            "MROL_PORT_7333_TCP_PROTO",
            "MROL_PORT_7333_TCP_PORT",
            "MROL_PORT_7334_UDP_ADDR",
            "MROL_KEY",
            "MROL_SERVER",
            "PATH",
        ] {
            assert_eq!(meaning(other), Meaning::Other, "{other}");
        }
        for setting in ["MROL_DATA_DIR", "mrol_drain_seconds", "MROL_ACCESS__KEYS_FILE", "MROL_NO__SUCH"] {
            assert_eq!(meaning(setting), Meaning::Setting, "{setting}");
        }
        for unknown in
            ["MROL_", "MROL_ACCESS", "MROL_KEYS", "MROL_PORT_GRPC", "MROL_PORT_1_TCP_X", "MROL_SERVICE"]
        {
            assert_eq!(meaning(unknown), Meaning::Unknown, "{unknown}");
        }
        assert!(check(["MROL_KEYS".to_owned(), "MROL_PORT".to_owned()].into_iter()).is_ok());
    }
}
