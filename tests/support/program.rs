//! Calls of a program, away from the caller's settings.

use assert_cmd::Command;
use serde_json::Value;

/// The path of a program.
#[derive(Debug, Clone, Copy)]
pub struct Program(pub &'static str);

impl Program {
    /// A call of the program.
    pub fn call(self, arguments: &[&str]) -> Command {
        let mut command = Command::new(self.0);
        for name in ["MROL_SERVER", "MROL_CONFIG", "MROL_KEY", "MROL_KEY_FILE", "MROL_CA"] {
            command.env_remove(name);
        }
        command.args(arguments);
        command
    }

    /// The objects that a call prints, which must succeed.
    pub fn objects(self, arguments: &[&str]) -> Vec<Value> {
        let output = self.call(arguments).arg("--json").assert().success().get_output().clone();
        let lines = String::from_utf8(output.stdout).unwrap();
        lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    }

    /// What a call says on standard error, which must end with `code`.
    pub fn complaint(self, arguments: &[&str], code: i32) -> String {
        let output = self.call(arguments).assert().code(code).get_output().clone();
        let complaint = String::from_utf8(output.stderr).unwrap();
        assert!(complaint.starts_with("error: "), "{arguments:?}: {complaint}");
        assert!(!complaint.contains("panicked"), "{complaint}");
        complaint
    }
}

/// A number of a printed object.
pub fn number(line: &Value, field: &str) -> f64 {
    line[field].as_f64().unwrap_or_else(|| panic!("{field} in {line}"))
}

/// A text of each of them.
pub fn texts<'a>(lines: &'a [Value], field: &str) -> Vec<&'a str> {
    lines.iter().map(|line| line[field].as_str().unwrap()).collect()
}
