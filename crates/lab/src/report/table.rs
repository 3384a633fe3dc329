//! Tables as text files.

use std::fmt::Display;
use std::fs;
use std::path::Path;

use super::error::ReportError;

/// A table of text cells: rows under a head.
pub struct Table {
    head: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// Creates a table without rows under `head`.
    pub fn new(head: impl IntoIterator<Item = impl Display>) -> Self {
        Self { head: cells(head), rows: Vec::new() }
    }

    /// Adds a row, of as many cells as the head has.
    pub fn push(&mut self, row: impl IntoIterator<Item = impl Display>) {
        self.rows.push(cells(row));
    }

    /// Writes the table as comma-separated values. No cell may hold a comma or a quotation mark.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write_csv(&self, path: &Path) -> Result<(), ReportError> {
        let line = |cells: &Vec<String>| format!("{}\n", cells.join(","));
        write(path, &std::iter::once(&self.head).chain(&self.rows).map(line).collect::<String>())
    }

    /// Writes the table as Markdown, aligned to the right.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write_markdown(&self, path: &Path) -> Result<(), ReportError> {
        let line = |cells: &Vec<String>| format!("| {} |\n", cells.join(" | "));
        let rule = format!("|{}\n", " ---: |".repeat(self.head.len()));
        let rows: String = self.rows.iter().map(line).collect();
        write(path, &format!("{}{rule}{rows}", line(&self.head)))
    }
}

fn cells(cells: impl IntoIterator<Item = impl Display>) -> Vec<String> {
    cells.into_iter().map(|cell| cell.to_string()).collect()
}

fn write(path: &Path, text: &str) -> Result<(), ReportError> {
    fs::write(path, text).map_err(ReportError::writing(path))
}

/// Creates the folder `path` and its parents where they do not exist.
///
/// # Errors
/// When the folder cannot be made.
pub fn folder(path: &Path) -> Result<(), ReportError> {
    fs::create_dir_all(path).map_err(ReportError::writing(path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_written_in_both_forms() {
        let folder = tempfile::tempdir().unwrap();
        let mut table = Table::new(["voxels", "ns"]);
        table.push(["10", "1.5"]);
        let (csv, markdown) = (folder.path().join("t.csv"), folder.path().join("t.md"));
        table.write_csv(&csv).unwrap();
        table.write_markdown(&markdown).unwrap();
        assert_eq!(fs::read_to_string(csv).unwrap(), "voxels,ns\n10,1.5\n");
        assert_eq!(fs::read_to_string(markdown).unwrap(), "| voxels | ns |\n| ---: | ---: |\n| 10 | 1.5 |\n");
    }
}
