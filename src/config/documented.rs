//! The settings as documents show them: a TOML file with comments, a JSON schema, and the tables of the guide.

use serde_json::{Map, Value, json};

use super::settings::Config;
use super::{
    AccessConfig, AdminConfig, AlignmentConfig, ClusterConfig, FilterConfig, ListenerConfig, LogConfig,
    MapsConfig, RobotConfig,
};
use super::{StoreConfig, ThreadsConfig, TlsConfig};
use mrol_service::{EVERY_ROBOT, Limits, Setting, SettingKind, Unit};

/// Characters of a comment's line.
const COLUMNS: usize = 100;

/// A section of the settings: its name, empty for those outside of any, and its rows.
type Section = (&'static str, Vec<Setting>);

/// All sections but the one of robots, in order.
fn sections() -> Vec<Section> {
    vec![
        ("", Config::top().into()),
        ("http", ListenerConfig::settings()),
        ("grpc", ListenerConfig::settings()),
        ("admin", AdminConfig::settings()),
        ("access", AccessConfig::settings()),
        ("tls", TlsConfig::settings()),
        ("cluster", ClusterConfig::settings()),
        ("log", LogConfig::settings()),
        ("store", StoreConfig::settings()),
        ("maps", MapsConfig::settings()),
        ("threads", ThreadsConfig::settings()),
        ("filter", FilterConfig::settings()),
        ("alignment", AlignmentConfig::settings()),
        ("limits", Limits::settings()),
    ]
}

impl Config {
    /// These settings as a TOML file: every setting with its meaning, its range and its default. Those that have no
    /// value are comments.
    pub fn to_toml(&self) -> String {
        let (values, defaults) = (json!(self), json!(Self::default()));
        let mut text = String::new();
        for (section, rows) in sections() {
            let of = |all: &Value| if section.is_empty() { all.clone() } else { all[section].clone() };
            write_section(&mut text, section, &rows, &of(&values), &of(&defaults));
        }
        text.push_str("\n# Settings by robot; \"*\" stands for every robot without a section of its own.\n");
        let default = json!(RobotConfig::default());
        for (name, robot) in &self.robots {
            let section = format!("robots.{}", quoted(name));
            write_section(&mut text, &section, &RobotConfig::settings(), &json!(robot), &default);
        }
        if self.robots.is_empty() {
            let mut example = String::new();
            let section = format!("robots.{}", quoted(EVERY_ROBOT));
            write_section(&mut example, &section, &RobotConfig::settings(), &default, &default);
            let lines = example.lines().map(|line| match line {
                "" => "\n".to_owned(),
                line if line.starts_with('#') => format!("{line}\n"),
                line => format!("# {line}\n"),
            });
            text.extend(lines);
        }
        text
    }

    /// The JSON schema of a file of settings.
    pub fn schema() -> Value {
        let defaults = json!(Self::default());
        let mut properties = Map::new();
        for (section, rows) in sections() {
            if section.is_empty() {
                properties.extend(properties_of(&rows, &defaults));
            } else {
                properties.insert(section.into(), object_of(&rows, &defaults[section]));
            }
        }
        for (row, _) in Limits::constants() {
            let mut schema = schema_of(&row);
            schema["deprecated"] = true.into();
            properties["limits"]["properties"][row.name] = schema;
        }
        let robot = object_of(&RobotConfig::settings(), &json!(RobotConfig::default()));
        properties.insert("robots".into(), json!({"type": "object", "additionalProperties": robot}));
        json!({
            "$schema": "https://json-schema.org/draft/2020-12/schema",
            "title": "Settings of the MROL map server",
            "type": "object",
            "additionalProperties": false,
            "properties": properties,
        })
    }
}

/// Writes a section of a TOML file.
fn write_section(text: &mut String, section: &str, rows: &[Setting], values: &Value, defaults: &Value) {
    if !section.is_empty() {
        text.push_str(&format!("\n[{section}]\n"));
    }
    for row in rows {
        let mut told = row.sentence.clone();
        told.extend(row.range().map(|range| format!(" Range: {range}.")));
        told.push_str(&format!(" Default: {}.", default_of(row, &defaults[row.name])));
        let lines = wrapped(&told);
        text.extend(lines.into_iter().map(|line| format!("# {line}\n")));
        let name = row.name;
        let line = match in_toml(&values[name]) {
            Some(value) => format!("{name} = {value}\n"),
            None => format!("# {name} =\n"),
        };
        text.push_str(&line);
    }
}

/// A name as TOML quotes it.
fn quoted(name: &str) -> String {
    Value::from(name).to_string().replace('\u{7f}', "\\u007F")
}

/// A value as TOML writes it; none of no value.
fn in_toml(value: &Value) -> Option<String> {
    toml::Value::try_from(value).ok().map(|value| value.to_string())
}

/// Words in lines of at most [`COLUMNS`] characters.
fn wrapped(words: &str) -> Vec<String> {
    words.split_whitespace().fold(Vec::new(), |mut lines: Vec<String>, word| {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= COLUMNS => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
        lines
    })
}

/// The default of a setting, with its unit.
fn default_of(row: &Setting, value: &Value) -> String {
    match value {
        Value::Null if row.unit == Unit::none => "none".into(),
        Value::Null => format!("none (in {})", row.unit.as_str()),
        Value::Array(values) if values.is_empty() => "none".into(),
        Value::String(text) => format!("`{text}`"),
        Value::Number(number) => {
            let of_bytes = number.as_u64().filter(|_| row.unit == Unit::bytes);
            match (of_bytes, row.unit) {
                (Some(bytes), _) if bytes > 0 && bytes.is_multiple_of(1 << 30) => {
                    format!("{} GiB", bytes >> 30)
                }
                (Some(bytes), _) if bytes > 0 && bytes.is_multiple_of(1 << 20) => {
                    format!("{} MiB", bytes >> 20)
                }
                (_, Unit::none) => plain(number),
                (_, unit) => format!("{} {}", plain(number), unit.as_str()),
            }
        }
        other => other.to_string(),
    }
}

/// A number without the `.0` of a whole one, its thousands parted by commas.
fn plain(number: &serde_json::Number) -> String {
    let text = number.as_f64().map_or_else(String::new, |number| number.to_string());
    let (whole, rest) = text.split_at(text.find('.').unwrap_or(text.len()));
    let groups: Vec<&str> =
        whole.as_bytes().rchunks(3).rev().filter_map(|group| str::from_utf8(group).ok()).collect();
    groups.join(",") + rest
}

/// The schema of a section.
fn object_of(rows: &[Setting], defaults: &Value) -> Value {
    json!({
        "type": "object",
        "additionalProperties": false,
        "properties": properties_of(rows, defaults),
    })
}

fn properties_of(rows: &[Setting], defaults: &Value) -> Map<String, Value> {
    let of_row = |row: &Setting| {
        let mut schema = schema_of(row);
        if !defaults[row.name].is_null() {
            schema["default"] = defaults[row.name].clone();
        }
        (row.name.to_owned(), schema)
    };
    rows.iter().map(of_row).collect()
}

/// The schema of a setting.
fn schema_of(row: &Setting) -> Value {
    let numbers = json!({"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3});
    let mut schema = match row.kind {
        SettingKind::Boolean => json!({"type": "boolean"}),
        SettingKind::Integer => json!({"type": "integer"}),
        SettingKind::Number => json!({"type": "number"}),
        SettingKind::Text if row.words.is_empty() => json!({"type": "string"}),
        SettingKind::Text => json!({"enum": row.words}),
        SettingKind::Texts => json!({"type": "array", "items": {"type": "string"}}),
        SettingKind::Corners => json!({"type": "array", "items": numbers, "minItems": 2, "maxItems": 2}),
    };
    schema["description"] = row.sentence.clone().into();
    let (least, most) = row.bounds();
    for (name, bound) in [("minimum", least), ("maximum", most)] {
        if let Some(bound) = bound {
            schema[name] = bound.into();
        }
    }
    schema
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fmt::Write;

    const HEAD: &str = "| setting | default | range | meaning |\n|---|---|---|---|\n";
    const GUIDE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/guide/operations.md");

    fn table(section: &str, rows: &[Setting], defaults: &Value) -> String {
        let mut text = String::new();
        for row in rows {
            let default = default_of(row, &defaults[row.name]);
            let range = row.range().unwrap_or_default();
            let dot = if section.is_empty() || section == "limits" { "" } else { "." };
            let section = if section == "limits" { "" } else { section };
            writeln!(text, "| `{section}{dot}{}` | {default} | {range} | {} |", row.name, row.sentence)
                .unwrap();
        }
        text
    }

    /// Compares what stands between two marks of the guide with what is made of the rows, or writes it there.
    fn check_guide(mark: &str, made: &str) {
        let (begin, end) = (
            format!("<!-- {mark}: made from crates/service/src/setting.rs and its tables -->\n"),
            format!("<!-- end of {mark} -->"),
        );
        let guide = std::fs::read_to_string(GUIDE).unwrap();
        let from = guide.find(&begin).expect("a place for the list") + begin.len();
        let to = from + guide[from..].find(&end).expect("the end of the list");
        let made = format!("\n{made}\n");
        if std::env::var_os("MROL_WRITE_DOCS").is_some() {
            std::fs::write(GUIDE, [&guide[..from], &made, &guide[to..]].concat()).unwrap();
            return;
        }
        assert!(
            guide[from..to] == made,
            "docs/guide/operations.md is old: run this test with MROL_WRITE_DOCS=1"
        );
    }

    #[test]
    fn the_guide_lists_every_setting() {
        let defaults = json!(Config::default());
        let mut tables = HEAD.to_owned();
        for (section, rows) in sections() {
            let of_section = if section.is_empty() { &defaults } else { &defaults[section] };
            match section {
                "limits" => check_guide("limits", &[HEAD, &table(section, &rows, of_section)].concat()),
                _ => tables.push_str(&table(section, &rows, of_section)),
            }
        }
        tables.push_str(&table("robots.NAME", &RobotConfig::settings(), &json!(RobotConfig::default())));
        check_guide("settings", &tables);
        let mut constants = "| constant | value | meaning |\n|---|---|---|\n".to_owned();
        for (row, value) in Limits::constants() {
            writeln!(constants, "| `{}` | {value} | {} |", row.name, row.sentence).unwrap();
        }
        check_guide("constants", &constants);
    }

    #[test]
    fn a_printed_file_has_every_setting_and_is_read_as_what_it_was() {
        let robot = RobotConfig { range_max_m: Some(30.0), ..RobotConfig::default() };
        let robots = [EVERY_ROBOT, "a.b", "A_1-2"].map(|name| (name.to_owned(), robot.clone()));
        let mut config = Config { robots: robots.into(), ..Config::default() };
        config.access.hosts = vec!["mrol".into()];
        let printed = config.to_toml();
        for (section, rows) in sections() {
            let at =
                if section.is_empty() { 0 } else { printed.find(&format!("[{section}]")).expect(section) };
            for row in rows {
                assert!(
                    printed[at..].contains(&format!("{} =", row.name)),
                    "{section} {} is missing",
                    row.name
                );
            }
        }
        assert!(printed.lines().all(|line| line.chars().count() <= COLUMNS + 2 || !line.starts_with('#')));
        let file = tempfile::NamedTempFile::new().unwrap();
        for (config, printed) in [(&config, printed), (&Config::default(), Config::default().to_toml())] {
            std::fs::write(file.path(), printed).unwrap();
            assert_eq!(&Config::load(Some(file.path()), json!({})).unwrap(), config);
        }
    }

    #[test]
    fn the_schema_has_the_range_and_the_default_of_a_limit() {
        let schema = Config::schema();
        let limit = &schema["properties"]["limits"]["properties"]["requests_max"];
        assert_eq!((&limit["type"], &limit["default"]), (&json!("integer"), &json!(512)));
        assert_eq!((&limit["minimum"], &limit["maximum"]), (&json!(1.0), &json!(1_048_576.0)));
        let robot = &schema["properties"]["robots"]["additionalProperties"]["properties"]["range_max_m"];
        assert_eq!(robot["type"], "number");
        // A file that sets what is a constant now is read.
        assert_eq!(schema["properties"]["limits"]["properties"]["probes_max"]["deprecated"], true);
        assert_eq!(schema["properties"]["log"]["properties"]["format"]["enum"], json!(["text", "json"]));
    }
}
