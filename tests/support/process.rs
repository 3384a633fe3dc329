//! The daemon as a process of its own, on free ports: for tests that end it in ways no thread can be ended.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

use serde_json::Value;

/// A daemon in a process of its own.
pub struct Process {
    child: Child,
    pub http: String,
    pub grpc: String,
}

impl Process {
    /// With its maps in `data_dir`, and more options. What it says of changes, which are a test's own, is left out.
    pub fn start(data_dir: &str, options: &[&str]) -> Self {
        let mut command = serve(data_dir, options, "error");
        command.env("MROL_LOG__AUDIT", "false");
        Self::of(command)
    }

    /// The same with its log, of `level` and above and of all changes, in `log`.
    pub fn start_with_log(data_dir: &str, options: &[&str], level: &str, log: Stdio) -> Self {
        let mut command = serve(data_dir, options, level);
        command.stderr(log);
        Self::of(command)
    }

    /// What a command becomes that serves, and says where with `--json`.
    pub fn of(mut command: Command) -> Self {
        let mut child = command.stdout(Stdio::piped()).spawn().expect("the program");
        let mut line = String::new();
        let output = child.stdout.take().expect("a pipe");
        BufReader::new(output).read_line(&mut line).expect("a line");
        let serving: Value = serde_json::from_str(&line).expect("where it serves");
        let address = |protocol: &str| format!("http://{}", serving[protocol].as_str().expect("an address"));
        Self { child, http: address("http"), grpc: address("grpc") }
    }

    /// Its number.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Sends it a signal, by its name.
    pub fn signal(&self, name: &str) {
        let sent =
            Command::new("kill").args(["-s", name, &self.child.id().to_string()]).status().expect("kill");
        assert!(sent.success());
    }

    /// Tells it to end, as a service manager does; its exit code.
    pub fn stop(self) -> Option<i32> {
        self.signal("TERM");
        self.ended()
    }

    /// Waits for its end; its exit code.
    pub fn ended(mut self) -> Option<i32> {
        self.child.wait().expect("its end").code()
    }

    /// Ends it at once, without a chance to do anything: `kill -9`.
    pub fn kill(mut self) {
        self.child.kill().expect("a process that runs");
        self.child.wait().expect("its end");
    }
}

fn serve(data_dir: &str, options: &[&str], level: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mrol"));
    command
        .args(["serve", "--json", "--data-dir", data_dir, "--log-level", level])
        .args(["--http-listen", "127.0.0.1:0", "--grpc-listen", "127.0.0.1:0"])
        .args(options);
    command
}

impl Drop for Process {
    fn drop(&mut self) {
        // Where a test failed since it ended by itself: by which signal, or with which code.
        if let (Ok(Some(status)), true) = (self.child.try_wait(), std::thread::panicking()) {
            eprintln!("the server had ended before the test did: {status}");
        }
        // Where a test failed before it was stopped.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
