//! Scrapes and answers that are asked for again and again, and never read.

use std::time::{Duration, Instant};

use serde_json::json;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpSocket, TcpStream};
use tokio::time::timeout;

use crate::frames::{END_HEADERS, END_STREAM, HEADERS, frame, literal, opening};
use crate::siege::{ATTACK, MIB, Siege};
use crate::support::daemon::{PATIENCE, client};

const CONNECTIONS: usize = 8;
/// HTTP/2's name for how much of an answer may be on its way.
const INITIAL_WINDOW_SIZE: u16 = 4;
/// Maps with as many levels as there can be: their gauges come to half a MiB.
const MAPS: usize = 60;
const LEVELS: usize = 12;

#[tokio::test]
async fn scrapes_that_nobody_reads() {
    // Of a hundred MiB four texts are in memory at once, and what connections hold.
    let siege = Siege::begin_within("scrapes unread", "", 56 * MIB).await;
    for map in 0..MAPS {
        let settings = json!({"resolution_m": 0.1, "levels": LEVELS});
        let put = client().put(format!("http://{}/v1/maps/map-{map}", siege.http())).json(&settings);
        assert_eq!(put.send().await.unwrap().status(), 201);
    }
    let get: Vec<u8> =
        [(":method", "GET"), (":scheme", "http"), (":path", "/metrics"), (":authority", "localhost")]
            .iter()
            .flat_map(|(name, value)| literal(name, value))
            .collect();
    let scrapes =
        (1..240).step_by(2).flat_map(|stream| frame(HEADERS, END_HEADERS | END_STREAM, stream, &get));
    let scrapes: Vec<u8> = opening(&[(INITIAL_WINDOW_SIZE, 0)]).into_iter().chain(scrapes).collect();
    let mut unread = Vec::new();
    for _ in 0..CONNECTIONS {
        let mut connection = TcpStream::connect(siege.http()).await.unwrap();
        connection.write_all(&scrapes).await.unwrap();
        unread.push(connection);
    }
    tokio::time::sleep(2 * ATTACK).await;
    siege.end().await;
}

#[tokio::test]
async fn answers_in_json_that_nobody_reads() {
    const POINTS: usize = 200_000;
    const UNREAD: usize = 150;
    // `false,` for each point, of each of them.
    const WITHOUT_BOUND: usize = UNREAD * POINTS * "false,".len();
    /// Some come in a second.
    const ANSWERED_WITHIN: Duration = Duration::from_secs(120);
    // 64 MiB of bodies and answers, and what two threads have in hand: points, and the text that is made of them, in
    // lists that double their room.
    const BOUND: usize = (64 + 3 * 16) * MIB;
    const { assert!(WITHOUT_BOUND > 3 * BOUND / 2) };
    let siege = Siege::begin_within("large answers unread", "", BOUND).await;
    let body = format!("{{\"points\":[{}[9,9,9]]}}", "[9,9,9],".repeat(POINTS - 1));
    let head = format!(
        "POST /v1/maps/hall/occupancy HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\n\
         content-length: {}\r\n\r\n",
        body.len()
    );
    let request = [head.as_bytes(), body.as_bytes()].concat();
    let (mut unread, mut answered) = (Vec::new(), 0);
    let start = Instant::now();
    // Who leaves an answer unread gives way after a second to who wants one: there is room for some at a time.
    while answered < UNREAD {
        assert!(start.elapsed() < ANSWERED_WITHIN, "{answered} of {UNREAD} answers were begun");
        // The system takes little of what is not read: the rest lies in the server.
        let socket = TcpSocket::new_v4().unwrap();
        socket.set_recv_buffer_size(4 << 10).unwrap();
        let mut connection = socket.connect(siege.http()).await.unwrap();
        // Who is refused for want of room has sent less.
        let _ = timeout(PATIENCE, connection.write_all(&request)).await;
        let mut status = [0; 12];
        let read =
            timeout(PATIENCE, connection.read_exact(&mut status)).await.expect("an answer, or its end");
        answered += usize::from(read.is_ok() && &status == b"HTTP/1.1 200");
        unread.push(connection);
    }
    siege.end().await;
}
