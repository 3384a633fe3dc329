//! `--help` teaches.

use super::mrol;

const COMMANDS: [&str; 34] = [
    "serve",
    "demo",
    "map",
    "insert",
    "log",
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
    "cluster",
    "bench",
    "experiment",
    "health",
    "key",
    "snapshot",
    "restore",
    "export",
    "import",
    "doctor",
    "config",
    "watch",
    "completions",
    "man",
];

#[test]
fn every_command_explains_itself_with_examples() {
    for command in COMMANDS {
        let help = mrol(&[command, "--help"]).assert().success().get_output().stdout.clone();
        let help = String::from_utf8(help).unwrap();
        let moved = ["bench", "experiment"].contains(&command);
        let example = if moved { format!("mrol-lab -- {command}") } else { format!("mrol {command}") };
        assert!(help.contains("EXAMPLES:\n  ") && help.contains(&example), "{help}");
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

#[test]
fn the_version_tells_commit_and_features() {
    let said = mrol(&["--version"]).assert().success().get_output().stdout.clone();
    let said = String::from_utf8(said).unwrap();
    let lines: Vec<&str> = said.lines().collect();
    assert_eq!(lines[0], concat!("mrol ", env!("CARGO_PKG_VERSION")));
    assert!(lines[1].strip_prefix("commit: ").is_some_and(|commit| !commit.is_empty()), "{said}");
    assert!(lines[2].starts_with("features: "), "{said}");
    let short = mrol(&["-V"]).assert().success().get_output().stdout.clone();
    assert_eq!(String::from_utf8(short).unwrap().trim_end(), lines[0]);
}

#[test]
fn shells_complete_commands_and_options() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = mrol(&["completions", shell]).assert().success().get_output().stdout.clone();
        let script = String::from_utf8(script).unwrap();
        assert!(script.contains("snapshot") && script.contains("min-revision"), "{shell}: {script}");
    }
    mrol(&["completions", "cmd"]).assert().code(2);
}

#[test]
fn every_command_has_a_manual_page() {
    let folder = tempfile::tempdir().unwrap();
    let pages = folder.path().join("man1");
    mrol(&["man", pages.to_str().unwrap()]).assert().success();
    let page = |name: &str| std::fs::read_to_string(pages.join(name)).unwrap();
    assert!(page("mrol.1").contains("mrol\\-serve(1)"), "{}", page("mrol.1"));
    assert!(page("mrol-map.1").contains("sensor\\-height"));
    assert!(page("mrol-maps-create.1").contains(".TH"));
}

/// What bash itself completes with the script, where there is a bash.
#[test]
fn bash_completes_a_command() {
    let script = mrol(&["completions", "bash"]).assert().success().get_output().stdout.clone();
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), script).unwrap();
    let asked =
        "source \"$0\"; COMP_WORDS=(mrol snap); COMP_CWORD=1; _mrol mrol snap mrol; echo \"${COMPREPLY[@]}\"";
    match std::process::Command::new("bash").args(["-c", asked]).arg(file.path()).output() {
        Ok(output) => assert_eq!(String::from_utf8_lossy(&output.stdout).trim(), "snapshot"),
        Err(error) => eprintln!("SKIPPED: no bash ({error})"),
    }
}
