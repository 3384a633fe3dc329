//! Points in lines of text.

use super::axis::axes;
use super::columns::Columns;
use super::coordinates::Coordinates;
use super::error::{Problem, quoted};
use super::lines::{Lines, check_text, comment, text_of};

/// Columns of x, y and z where no line of names says others.
const FIRST_COLUMNS: [usize; 3] = [0, 1, 2];

/// The points of an `.xyz` file: x y z are the columns that somebody named, those that a line of names before them
/// says, or the first three.
pub(super) fn points<C: Coordinates>(bytes: &[u8], named: Option<Columns>) -> Result<Vec<C>, Problem> {
    check_text(bytes)?;
    let mut lines = Lines::of(bytes);
    let Head { columns, declared } = Head::take(&mut lines);
    let columns = named.map_or(columns, |named| named.axes);
    let mut points = Vec::new();
    for (number, line) in lines.filter(|(_, line)| is_content(line)) {
        let point = point(&text_of(line), columns).map_err(|problem| Problem::at_line(number, problem))?;
        points.push(C::of_doubles(point));
    }
    match declared {
        Some((line, count)) if count != points.len() as u64 => {
            let problem =
                format!("{count} points are declared, {} follow: the file is truncated", points.len());
            Err(Problem::at_line(line, problem))
        }
        _ => Ok(points),
    }
}

/// What the lines before the first point say.
struct Head {
    /// The columns of x, y and z.
    columns: [usize; 3],
    /// A number of points, and its line.
    declared: Option<(usize, u64)>,
}

impl Head {
    /// Takes from `lines` what comes before the first point: comments, a line of names, a number of points.
    fn take(lines: &mut Lines<'_>) -> Self {
        let (mut named, mut commented, mut declared) = (None, None, None);
        let mut after = lines.clone();
        while let Some((number, line)) = after.next() {
            if let Some(words) = comment(line) {
                commented = names(&text_of(words)).or(commented);
            } else if !line.is_empty() {
                let text = text_of(line);
                match (names(&text), text.parse()) {
                    (Some(found), _) if named.is_none() => named = Some(found.columns),
                    (_, Ok(count))
                        if declared.is_none() && after.clone().any(|(_, line)| is_content(line)) =>
                    {
                        declared = Some((number, count));
                    }
                    _ => {
                        // The words of a comment are names where there are as many as columns.
                        let commented = commented.filter(|names| names.count == cells(&text).count());
                        named = named.or(commented.map(|names| names.columns));
                        break;
                    }
                }
            }
            *lines = after.clone();
        }
        Self { columns: named.unwrap_or(FIRST_COLUMNS), declared }
    }
}

fn is_content(line: &[u8]) -> bool {
    !line.is_empty() && comment(line).is_none()
}

/// Names of columns.
#[derive(Clone, Copy)]
struct Names {
    /// Those of x, y and z.
    columns: [usize; 3],
    /// How many there are.
    count: usize,
}

/// The columns that a line names, where x, y and z are among the names.
fn names(text: &str) -> Option<Names> {
    let names: Vec<&str> = cells(text.trim()).map(|cell| cell.trim_matches(['"', '\''])).collect();
    let columns = axes(&names).ok()?;
    Some(Names { columns, count: names.len() })
}

/// The cells of a line. Semicolons and commas separate even after nothing: an empty cell is an error, not a shifted
/// column.
fn cells(text: &str) -> Box<dyn Iterator<Item = &str> + '_> {
    match [';', ','].into_iter().find(|separator| text.contains(*separator)) {
        Some(separator) => {
            let text = text.trim_end();
            Box::new(text.strip_suffix(separator).unwrap_or(text).split(separator).map(str::trim))
        }
        None => Box::new(text.split_ascii_whitespace()),
    }
}

fn point(text: &str, columns: [usize; 3]) -> Result<[f64; 3], String> {
    let last = columns.into_iter().max().unwrap_or_default();
    let mut xyz = [0.0; 3];
    let mut have = 0;
    for (column, cell) in cells(text).enumerate().take(last + 1) {
        if let Some(axis) = columns.iter().position(|c| *c == column) {
            xyz[axis] = coordinate(cell, text)?;
        }
        have = column + 1;
    }
    match have > last {
        true => Ok(xyz),
        false if columns == FIRST_COLUMNS => Err(format!("{have} columns, x y z are needed")),
        false => Err(format!("{have} columns, column {} is needed", last + 1)),
    }
}

/// A coordinate of a line. Where semicolons separate, a comma may be the decimal point.
fn coordinate(cell: &str, line: &str) -> Result<f64, String> {
    match cell.split_once(',') {
        Some((whole, fraction)) if line.contains(';') && !cell.contains('.') && !fraction.contains(',') => {
            number(&format!("{whole}.{fraction}")).map_err(|_| not_a_number(cell))
        }
        _ => number(cell),
    }
}

/// Parses `token` as a number; `nan` and `inf` are accepted.
pub(in crate::scan) fn number<T: std::str::FromStr>(token: &str) -> Result<T, String> {
    token.parse().map_err(|_| not_a_number(token))
}

fn not_a_number(token: &str) -> String {
    match token.contains([char::REPLACEMENT_CHARACTER, '\0']) {
        true => format!("not text but binary data: {}", quoted(token)),
        false => format!("{} is not a number (a comment starts with #)", quoted(token)),
    }
}
