//! A server that may have 512 MiB in memory: no input ends it, and no map file keeps it from starting again.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use tempfile::TempDir;

use crate::map_files::restore_all;
use crate::siege::MIB;
use crate::support::daemon::client;
use crate::support::hostile_files::hostile_files;
use crate::support::process::Process;
use crate::support::skipped::skipped;

const LIMIT: usize = 512 * MIB;
/// Where control groups are told.
const GROUPS: &str = "/sys/fs/cgroup";

/// A control group of its own, gone with this.
struct Group(PathBuf);

impl Group {
    /// None where the system lets nobody make one.
    fn with_memory(limit: usize) -> Option<Self> {
        let (root, file) = match Path::new(GROUPS).join("memory").is_dir() {
            true => (Path::new(GROUPS).join("memory"), "memory.limit_in_bytes"),
            false => (PathBuf::from(GROUPS), "memory.max"),
        };
        let group = Self(root.join(format!("mrol-test-{}", std::process::id())));
        fs::create_dir(&group.0).ok()?;
        fs::write(group.0.join(file), limit.to_string()).ok()?;
        // Memory that is written to a disk would hide what is too much.
        let _ = fs::write(group.0.join("memory.swap.max"), "0");
        Some(group)
    }

    /// The server within the group.
    fn serve(&self, data: &TempDir) -> Process {
        let mut command = Command::new("sh");
        command
            .args(["-c", "echo $$ > \"$0\" && exec \"$@\""])
            .arg(self.0.join("cgroup.procs"))
            .args([env!("CARGO_BIN_EXE_mrol"), "serve", "--json", "--log-level", "error", "--data-dir"])
            .arg(data.path())
            .args(["--http-listen", "127.0.0.1:0", "--grpc-listen", "127.0.0.1:0"]);
        Process::of(command)
    }
}

impl Drop for Group {
    fn drop(&mut self) {
        let _ = fs::remove_dir(&self.0);
    }
}

#[tokio::test]
async fn in_512_mib_no_map_file_ends_the_server_or_keeps_it_from_starting() {
    let Some(group) = Group::with_memory(LIMIT) else {
        skipped(format!("no memory control group can be made under {GROUPS}, which takes root"));
        return;
    };
    let data = tempfile::tempdir().unwrap();
    let server = group.serve(&data);
    for (what, said) in restore_all(&server.http, &hostile_files()).await {
        println!("{what}: {said}");
    }
    let alive = client().get(format!("{}/readyz", server.http)).send().await.unwrap();
    assert_eq!(alive.status(), 200);
    // As if the power failed: nothing is put in order before.
    server.kill();
    let again = group.serve(&data);
    let maps = client().get(format!("{}/v1/maps", again.http)).send().await.unwrap();
    assert_eq!(maps.status(), 200);
    assert_eq!(again.stop(), Some(0));
}
