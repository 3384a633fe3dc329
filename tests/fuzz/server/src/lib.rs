//! What is fuzzed of the server: functions of bytes that panic where a promise is broken. As those of files, in
//! `../src`.

mod grpc;
mod hosted;
mod http;
mod settings_files;

/// A function that is fuzzed.
pub type Target = fn(&[u8]);

/// All of them, by name.
pub const TARGETS: [(&str, Target); 4] = [
    ("config", settings_files::config),
    ("keys", settings_files::keys),
    ("grpc", grpc::grpc),
    ("http", http::http),
];

/// Calls the target of that name.
pub fn run(name: &str, bytes: &[u8]) {
    let target = TARGETS.iter().find(|(target, _)| *target == name);
    target.unwrap_or_else(|| panic!("no target {name}")).1(bytes);
}
