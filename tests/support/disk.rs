//! A disk that hangs or fails on demand: a library that is preloaded into the server, built of `disk.c`.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::Command;

use tempfile::TempDir;

/// A folder for the server's data, and what makes writing in it hang or fail.
pub(crate) struct Disk {
    folder: TempDir,
    /// Beside the data: the library, and the file that is there while the disk hangs or fails.
    tools: TempDir,
}

impl Disk {
    /// None where there is no compiler.
    pub(crate) fn build() -> Option<Self> {
        let (folder, tools) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/support/disk.c");
        let mut compiler = Command::new("cc");
        compiler.args(["-shared", "-fPIC", "-O1", "-w", "-o"]).arg(tools.path().join("disk.so"));
        let built = compiler.arg(source).arg("-ldl").status().ok()?;
        assert!(built.success(), "disk.c does not compile");
        Some(Self { folder, tools })
    }

    pub(crate) fn folder(&self) -> PathBuf {
        fs::canonicalize(self.folder.path()).unwrap()
    }

    /// Puts the disk under a program.
    pub(crate) fn preload(&self, command: &mut Command) {
        command
            .env("LD_PRELOAD", self.tools.path().join("disk.so"))
            .env("STUCK_DISK_CONTROL", self.control())
            .env("STUCK_DISK_FOLDER", self.folder());
    }

    /// From now on every change of a file hangs whose path, below the folder, has `part` in it.
    pub(crate) fn hang(&self, part: &str) {
        self.tell(part);
    }

    /// From now on every seventh change of a file fails whose path, below the folder, has `part` in it.
    pub(crate) fn fail(&self, part: &str) {
        self.tell(&format!("!{part}"));
    }

    fn tell(&self, text: &str) {
        let aside = self.tools.path().join("control.new");
        fs::write(&aside, text).unwrap();
        fs::rename(aside, self.control()).unwrap();
    }

    /// What hangs goes on, and nothing fails any more.
    pub(crate) fn go_on(&self) {
        match fs::remove_file(self.control()) {
            Err(error) if error.kind() != ErrorKind::NotFound => panic!("{error}"),
            _ => {}
        }
    }

    /// True once something hung.
    pub(crate) fn somebody_waits(&self) -> bool {
        self.tools.path().join("control.waits").exists()
    }

    fn control(&self) -> PathBuf {
        self.tools.path().join("control")
    }
}
