//! The C++ header, clients/cpp: all of it, with a real server.

use super::*;

/// Compiles a program of clients/cpp, with the address sanitizer.
fn compile_cpp(source: &str) -> PathBuf {
    let name = format!("mrol-cpp-{}-{}", std::process::id(), source.replace('/', "-"));
    let program = std::env::temp_dir().join(name);
    compile_file(&Path::new("../cpp").join(source), Linked::Sanitized, &program);
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
    let program = compile_cpp("tests/use.cpp");
    let server = Server::start("cpp-all");
    assert_eq!(said(&program, &server, "all"), (true, "ok\n".to_owned()));
}

#[test]
fn the_robot_of_the_example_finds_its_way() {
    let program = compile_cpp("examples/robot.cpp");
    let server = Server::start("cpp-robot");
    let (ended_well, text) = said(&program, &server, "room");
    assert!(ended_well, "{text}");
    assert!(
        text.starts_with("accepted at 2.40 3.10 1.50") && text.contains("post: blocked, around it: free"),
        "{text}"
    );
}
