//! The C++ header, clients/cpp: all of it, with a real server.

use super::*;

/// Compiles a program of clients/cpp with the static library, warnings being errors.
fn compile_cpp(source: &str, sanitized: bool) -> PathBuf {
    let program =
        std::env::temp_dir().join(format!("mrol-cpp-{}-{}", std::process::id(), source.replace('/', "-")));
    let mut command = Command::new("c++");
    command.args([
        "-std=c++17",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-pedantic",
        "-g",
        "-Iinclude",
        "-I../cpp/include",
    ]);
    if sanitized {
        command.args(["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]);
    }
    command.arg(Path::new("../cpp").join(source)).arg("-o").arg(&program);
    command.arg(built().join("libmrol_replica.a")).args(SYSTEM);
    let compiled = command.current_dir(env!("CARGO_MANIFEST_DIR")).status().expect("a compiler");
    assert!(compiled.success(), "{command:?}");
    program
}

fn said(program: &Path, server: &Server, map: &str) -> (bool, String) {
    let output = Command::new(program).args([&server.grpc, map]).output().unwrap();
    std::fs::remove_file(program).unwrap();
    let text =
        [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    (output.status.success(), text)
}

#[test]
fn all_of_the_header_does_what_it_says_under_the_address_sanitizer() {
    let program = compile_cpp("tests/use.cpp", true);
    let server = Server::start("cpp-all");
    assert_eq!(said(&program, &server, "all"), (true, "ok\n".to_owned()));
}

#[test]
fn the_robot_of_the_example_finds_its_way() {
    let program = compile_cpp("examples/robot.cpp", true);
    let server = Server::start("cpp-robot");
    let (ended_well, text) = said(&program, &server, "room");
    assert!(ended_well, "{text}");
    assert!(
        text.starts_with("accepted at 2.40 3.10 1.50") && text.contains("post: blocked, around it: free"),
        "{text}"
    );
}
