//! `--help` teaches.

use super::lab;

#[test]
fn every_command_explains_itself_with_examples() {
    for command in ["bench", "experiment"] {
        let help = lab(&[command, "--help"]).assert().success().get_output().stdout.clone();
        let help = String::from_utf8(help).unwrap();
        assert!(help.contains("EXAMPLES:\n  ") && help.contains(&format!("mrol-lab {command}")), "{help}");
    }
}
