//! The addresses of servers in one text.

/// Beginnings of an address behind a comma that follows the path of a socket.
const SCHEMES: [&str; 3] = ["http://", "https://", "unix:"];

/// Returns the addresses in a text, which commas separate: `http://node-1:7334,http://node-2:7334`.
///
/// Spaces around an address do not count. A path of `unix:` may have commas: there a comma separates only if `http://`,
/// `https://` or `unix:` follows. A text without a comma is one address, as it is.
pub fn addresses(text: &str) -> Vec<&str> {
    let mut found = Vec::new();
    let mut rest = text;
    while let Some(comma) = separator(rest) {
        found.push(rest[..comma].trim());
        rest = &rest[comma + 1..];
    }
    if found.is_empty() {
        return vec![text];
    }
    found.push(rest.trim());
    found
}

/// Where the comma behind the first address is.
fn separator(text: &str) -> Option<usize> {
    let is_path = text.trim_start().starts_with("unix:");
    let begins = |behind: &str| SCHEMES.iter().any(|scheme| behind.trim_start().starts_with(scheme));
    text.match_indices(',').map(|(at, _)| at).find(|at| !is_path || begins(&text[at + 1..]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commas_separate_addresses_and_stay_in_the_path_of_a_socket() {
        assert_eq!(addresses("http://a:1"), ["http://a:1"]);
        assert_eq!(addresses(" a "), [" a "]);
        assert_eq!(addresses("http://a:1, b:2,https://[::1]:3"), ["http://a:1", "b:2", "https://[::1]:3"]);
        assert_eq!(addresses("unix:/run/a,b.sock"), ["unix:/run/a,b.sock"]);
        assert_eq!(addresses("unix:/run/a,b.sock,unix:/c"), ["unix:/run/a,b.sock", "unix:/c"]);
        assert_eq!(addresses("a:1,unix:/b,c, http://d"), ["a:1", "unix:/b,c", "http://d"]);
        assert_eq!(addresses("a:1,"), ["a:1", ""]);
    }
}
