//! Headers that are larger than any that means something.

use std::fmt::Write;

use crate::frames::{
    CONTINUATION, Connection, END_HEADERS, END_STREAM, HEADERS, call_headers, frame, literal, text,
};
use crate::siege::Siege;

const TIMES: usize = 50;

#[tokio::test]
async fn giant_headers_over_http() {
    let siege = Siege::begin_alone("giant headers over HTTP/1").await;
    let long = format!("x-long: {}\r\n", "a".repeat(4 << 20));
    let mut many = String::new();
    for i in 0..100_000 {
        write!(many, "x-{i}: a\r\n").unwrap();
    }
    for headers in [long, many] {
        for _ in 0..TIMES {
            let mut connection = Connection::open_raw(siege.http()).await;
            let request = format!("GET /livez HTTP/1.1\r\nhost: localhost\r\n{headers}\r\n");
            // The server need not wait for its end.
            connection.send(request.as_bytes()).await;
            let answer = String::from_utf8_lossy(&connection.closed().await).into_owned();
            assert!(answer.is_empty() || answer.starts_with("HTTP/1.1 431"), "{answer}");
        }
    }
    siege.end().await;
}

#[tokio::test]
async fn giant_headers_over_http2() {
    let siege = Siege::begin_alone("giant headers over HTTP/2").await;
    let piece = literal("x-long", &"a".repeat(16_000));
    for server in [siege.grpc(), siege.http()].into_iter().cycle().take(TIMES) {
        let mut connection = Connection::open(server).await;
        let begun = frame(HEADERS, END_STREAM, 1, &call_headers("/mrol.v1.Maps/ListMaps", &[]));
        let more = frame(CONTINUATION, 0, 1, &piece).repeat(250);
        let end = frame(CONTINUATION, END_HEADERS, 1, &piece);
        connection.send(&[begun, more, end].concat()).await;
        let answer = connection.closed().await;
        assert!(!String::from_utf8_lossy(&answer).contains("grpc-status: 0"));
    }
    siege.end().await;
}

#[tokio::test]
async fn headers_that_name_one_in_the_table_again_and_again() {
    let siege = Siege::begin_alone("HPACK bombs").await;
    // Kept in the table, where it is the newest: a byte stands for all of it.
    let kept = [&[0x40][..], &text("x-bomb"), &text(&"a".repeat(3900))].concat();
    let newest = 0x80 | 62;
    let usual = call_headers("/mrol.v1.Maps/ListMaps", &[]);
    for server in [siege.grpc(), siege.http()].into_iter().cycle().take(TIMES) {
        let mut connection = Connection::open(server).await;
        connection.send(&frame(HEADERS, END_HEADERS | END_STREAM, 1, &[&usual[..], &kept].concat())).await;
        for stream in (3..200).step_by(2) {
            let bomb = [&usual[..], &vec![newest; 15_000]].concat();
            if !connection.send(&frame(HEADERS, END_HEADERS | END_STREAM, stream, &bomb)).await {
                break;
            }
        }
    }
    siege.end().await;
}
