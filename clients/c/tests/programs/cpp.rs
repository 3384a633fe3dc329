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

#[tokio::test]
async fn a_client_of_several_servers_goes_on_at_the_next_when_one_is_killed() {
    let (first, second) = (Server::start("cpp-first"), Server::start("cpp-second"));
    for (server, scans) in [(&first, 1), (&second, 2)] {
        let client = server.client().await;
        make_map(&client).await;
        for count in 1..=scans {
            insert(&client, row(count)).await;
        }
    }
    let mut driver = Driver::start("../../cpp/tests/several.cpp", Linked::Sanitized);
    driver.does(&format!("open {},{}", first.grpc, second.grpc));
    assert_eq!(driver.told("query a"), "1 10");
    let (address, second) = (first.grpc.clone(), second);
    drop(first);
    // The map of that name is another one here.
    assert_eq!(driver.told("query a"), "2 10");
    assert_eq!(driver.told("insert a 1"), "3");
    assert_eq!(driver.told("insert a 1"), "3");
    driver.does("make b");
    drop(second);
    let gone = driver.told("query a");
    assert!(gone.starts_with("MROL_UNREACHABLE: ") && gone.contains(&address), "{gone}");
    driver.end();
}

#[test]
fn points_that_are_no_floats_do_not_compile() {
    let folder = folder("cpp-points");
    let compiles = |container: &str| {
        let source = folder.join("points.cpp");
        let text = format!(
            "#include <mrol.hpp>\nstruct floats {{ float x, y, z; }};\nstruct ints {{ int x, y, z; }};\n\
             struct turned {{ float z, y, x; }};\nmrol::points of(const {container} &given) {{ return given; }}\n"
        );
        std::fs::write(&source, text).unwrap();
        let mut compiler = Command::new("c++");
        compiler.args(["-std=c++17", "-fsyntax-only", "-Wall", "-Wextra", "-Werror", "-pedantic"]);
        compiler.args(["-Iinclude", "-I../cpp/include"]).arg(&source);
        let output = compiler.current_dir(env!("CARGO_MANIFEST_DIR")).output().expect("a compiler");
        match String::from_utf8_lossy(&output.stderr) {
            _ if output.status.success() => true,
            said if said.contains("points are containers of float") => false,
            said => panic!("{container}: {said}"),
        }
    };
    for good in [
        "std::vector<float>",
        "std::vector<floats>",
        "std::vector<std::array<float, 3>>",
        "std::array<float[3], 2>",
    ] {
        assert!(compiles(good), "{good}");
    }
    for bad in [
        "std::vector<ints>",
        "std::vector<turned>",
        "std::vector<std::array<int, 3>>",
        "std::vector<std::array<std::uint32_t, 3>>",
        "std::array<int[3], 2>",
        "std::vector<std::array<double, 3>>",
        "std::vector<int>",
        "std::vector<double>",
    ] {
        assert!(!compiles(bad), "{bad}");
    }
    std::fs::remove_dir_all(folder).unwrap();
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
