//! `--help` teaches.

use super::mrol;

const COMMANDS: [&str; 27] = [
    "serve",
    "demo",
    "map",
    "insert",
    "localize",
    "query",
    "check",
    "rays",
    "nearest",
    "classify",
    "frontiers",
    "grid",
    "block",
    "observers",
    "events",
    "delete",
    "undo",
    "keepout",
    "maps",
    "bench",
    "experiment",
    "health",
    "key",
    "snapshot",
    "restore",
    "doctor",
    "config",
];

#[test]
fn every_command_explains_itself_with_examples() {
    for command in COMMANDS {
        let help = mrol(&[command, "--help"]).assert().success().get_output().stdout.clone();
        let help = String::from_utf8(help).unwrap();
        assert!(help.contains("EXAMPLES:\n  ") && help.contains(&format!("mrol {command}")), "{help}");
    }
}

#[test]
fn the_program_lists_its_commands() {
    let help = mrol(&["--help"]).assert().success().get_output().stdout.clone();
    let help = String::from_utf8(help).unwrap();
    assert!(COMMANDS.iter().all(|command| help.contains(&format!("\n  {command}"))), "{help}");
}

#[test]
fn no_command_or_an_unknown_one_is_a_usage_error() {
    mrol(&[]).assert().code(2);
    mrol(&["fly"]).assert().code(2);
}
