//! Lines of a file, whatever ends them.

use std::borrow::Cow;

use super::error::Problem;

/// The mark of UTF-8 at the start of a file.
const UTF8_MARK: &[u8] = b"\xef\xbb\xbf";
/// The marks of UTF-16.
const UTF16_MARKS: [&[u8]; 2] = [b"\xff\xfe", b"\xfe\xff"];
/// What starts a comment that takes a whole line.
const COMMENT_MARKS: [&[u8]; 3] = [b"#", b"//", b"%"];

/// The lines of a file, with their numbers; each ends with LF, CR LF or, as the line before it, CR alone.
#[derive(Debug, Clone)]
pub(super) struct Lines<'a> {
    rest: &'a [u8],
    number: usize,
    ends_with_cr: bool,
}

impl<'a> Lines<'a> {
    /// The lines of a whole file, without the mark of UTF-8.
    pub(super) fn of(bytes: &'a [u8]) -> Self {
        let rest = bytes.strip_prefix(UTF8_MARK).unwrap_or(bytes);
        Self { rest, number: 0, ends_with_cr: false }
    }

    /// The bytes after the lines that were taken.
    pub(super) fn rest(&self) -> &'a [u8] {
        self.rest
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = (usize, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        if self.rest.is_empty() {
            return None;
        }
        let end = self.rest.iter().position(|byte| matches!(byte, b'\n' | b'\r'));
        let (line, after) = self.rest.split_at(end.unwrap_or(self.rest.len()));
        self.rest = match after {
            // Data may begin with the byte of a line feed, where a header ends its lines with CR.
            [b'\r', b'\n', rest @ ..] if !self.ends_with_cr => rest,
            [end, rest @ ..] => {
                self.ends_with_cr |= *end == b'\r';
                rest
            }
            [] => after,
        };
        self.number += 1;
        Some((self.number, line.trim_ascii()))
    }
}

/// A line's text; characters that are not UTF-8, as in the comments of older programs, are replaced.
pub(super) fn text_of(line: &[u8]) -> Cow<'_, str> {
    String::from_utf8_lossy(line)
}

/// The text of a line without the mark of a comment; none of a line that is no comment.
pub(super) fn comment(line: &[u8]) -> Option<&[u8]> {
    COMMENT_MARKS.iter().find_map(|mark| line.strip_prefix(*mark))
}

/// The lines of a file that are neither blank nor a comment, with their numbers.
pub(in crate::scan) fn content_lines(
    bytes: &[u8],
) -> Result<impl Iterator<Item = (usize, Cow<'_, str>)>, Problem> {
    check_text(bytes)?;
    Ok(content(Lines::of(bytes)))
}

/// Those of `lines` that are neither blank nor a comment.
pub(super) fn content(lines: Lines<'_>) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let is_content = |(_, line): &(usize, &[u8])| !line.is_empty() && comment(line).is_none();
    lines.filter(is_content).map(|(number, line)| (number, text_of(line)))
}

/// Refuses a file of text in another encoding.
pub(super) fn check_text(bytes: &[u8]) -> Result<(), Problem> {
    match UTF16_MARKS.iter().any(|mark| bytes.starts_with(mark)) {
        true => Err(Problem::at_line(1, "UTF-16 text: save the file as UTF-8")),
        false => Ok(()),
    }
}
