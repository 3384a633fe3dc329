//! Certificates that expire, and handshakes that fail, are told.

use std::fs::{self, File};
use std::io::{Read, Write};
use std::net::TcpStream;
use std::process::Command;
use std::time::{Duration, Instant};

use rcgen::date_time_ymd;

use super::authority::{Authority, Files};
use super::reloading::metrics_over_tls;
use crate::support::daemon::PATIENCE;
use crate::support::process::Process;

#[tokio::test(flavor = "multi_thread")]
async fn the_end_of_a_certificate_and_failed_handshakes_are_metrics() {
    let authority = Authority::new();
    let files = Files::of(&authority.sign_until(date_time_ymd(2100, 1, 1)));
    let daemon = files.serve(None).await;
    let address = daemon.http;
    let failing = tokio::task::spawn_blocking(move || {
        let mut connection = TcpStream::connect(address).unwrap();
        connection.write_all(b"GET / HTTP/1.1\r\nhost: localhost\r\n\r\n").unwrap();
        let _ = connection.read_to_end(&mut Vec::new());
    });
    failing.await.unwrap();
    let start = Instant::now();
    loop {
        let metrics = metrics_over_tls(&daemon, &authority).await;
        let has = |line: &str| metrics.lines().any(|other| other == line);
        let told = has(r#"mrol_certificate_expires_timestamp_seconds{setting="tls.certificate"} 4102444800"#);
        if told && has(r#"mrol_tls_handshakes_failed_total{protocol="http"} 1"#) {
            return;
        }
        assert!(start.elapsed() < PATIENCE, "{metrics}");
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
}

#[test]
fn an_expired_certificate_is_an_error_in_the_log() {
    let files = Files::of(&Authority::new().sign_until(date_time_ymd(2020, 1, 1)));
    let log = files.path("log");
    let mut serve = Command::new(env!("CARGO_BIN_EXE_mrol"));
    serve.args(["serve", "--json", "--data-dir", "", "--log-level", "warn"]);
    serve.args(["--http-listen", "127.0.0.1:0", "--grpc-listen", "127.0.0.1:0", "--tls-certificate"]);
    serve.arg(files.path("certificate.pem")).arg("--tls-key").arg(files.path("key.pem"));
    Process::of(serve_with_log(serve, &log)).stop();
    let said = fs::read_to_string(&log).unwrap();
    assert!(said.contains("has expired") && said.contains("tls.certificate"), "{said}");
}

fn serve_with_log(mut serve: Command, log: &std::path::Path) -> Command {
    serve.stderr(File::create(log).unwrap());
    serve
}
