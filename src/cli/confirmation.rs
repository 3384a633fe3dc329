//! A map's name is asked for before the map goes for good.

use std::io::{self, BufRead, IsTerminal, Write};

use mrol::console::CliError;
use mrol_map::map::MapName;

/// Asks on a terminal for the name of a map that is to be deleted; elsewhere whoever calls has decided. `warning` says
/// what happens to it.
pub(super) fn confirm_deletion(map: &MapName, warning: &str) -> Result<(), CliError> {
    let (input, questions) = (io::stdin(), io::stderr());
    if !input.is_terminal() {
        return Ok(());
    }
    if !questions.is_terminal() {
        return Err(CliError::usage(format!(
            "map {map} is not deleted: its name is asked for on standard error, which is no terminal; --yes deletes it \
             without"
        )));
    }
    ask(map, warning, input.lock(), questions)
}

fn ask(
    map: &MapName,
    warning: &str,
    mut answers: impl BufRead,
    mut questions: impl Write,
) -> Result<(), CliError> {
    let mut answer = String::new();
    let asked = write!(questions, "{warning} Its name, to delete it: ")
        .and_then(|()| questions.flush())
        .and_then(|()| answers.read_line(&mut answer));
    match asked {
        Ok(_) if answer.trim() == map.as_str() => Ok(()),
        Ok(_) => Err(CliError::failed(format!(
            "map {map} is not deleted: its name was not given; --yes deletes it without"
        ))),
        Err(error) => Err(CliError::failed(format!(
            "map {map} is not deleted: {error}; --yes deletes it without asking"
        ))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_is_deleted_by_its_name_alone() {
        let map = MapName::new("office").unwrap();
        let said = |answer: &str| {
            let mut questions = Vec::new();
            let confirmed = ask(&map, "Map office goes.", answer.as_bytes(), &mut questions);
            assert_eq!(String::from_utf8(questions).unwrap(), "Map office goes. Its name, to delete it: ");
            confirmed.map_err(|error| error.to_string())
        };
        assert_eq!((said("office\n"), said(" office ")), (Ok(()), Ok(())));
        for other in ["", "\n", "y\n", "office2\n"] {
            let refused = said(other).unwrap_err();
            assert!(refused.starts_with("map office is not deleted: its name was not given"), "{refused}");
        }
    }
}
