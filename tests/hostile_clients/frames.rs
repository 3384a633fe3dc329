//! HTTP/2 by hand: what no client library would send.

use std::net::SocketAddr;
use std::time::Duration;

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::net::tcp::OwnedWriteHalf;
use tokio::sync::watch;
use tokio::time::timeout;

use crate::support::daemon::PATIENCE;

const PREFACE: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";

pub(crate) const DATA: u8 = 0;
pub(crate) const HEADERS: u8 = 1;
pub(crate) const PRIORITY: u8 = 2;
pub(crate) const RST_STREAM: u8 = 3;
pub(crate) const SETTINGS: u8 = 4;
pub(crate) const PING: u8 = 6;
pub(crate) const WINDOW_UPDATE: u8 = 8;
pub(crate) const CONTINUATION: u8 = 9;

pub(crate) const ACK: u8 = 1;
pub(crate) const END_STREAM: u8 = 1;
pub(crate) const END_HEADERS: u8 = 4;

/// The most that a frame holds before its reader says otherwise.
const FRAME_BYTES: usize = 16 << 10;

/// A frame: its length in 24 bits, its type, flags and stream, and what it holds.
pub(crate) fn frame(kind: u8, flags: u8, stream: u32, payload: &[u8]) -> Vec<u8> {
    let length = (payload.len() as u32).to_be_bytes();
    let head = [&length[1..], &[kind, flags], &stream.to_be_bytes()].concat();
    [&head, payload].concat()
}

/// The preface and settings of a connection.
pub(crate) fn opening(settings: &[(u16, u32)]) -> Vec<u8> {
    let settings: Vec<u8> = settings
        .iter()
        .flat_map(|(id, value)| [&id.to_be_bytes()[..], &value.to_be_bytes()].concat())
        .collect();
    [PREFACE, &frame(SETTINGS, 0, 0, &settings)].concat()
}

/// A header as HPACK writes it without its tables.
pub(crate) fn literal(name: &str, value: &str) -> Vec<u8> {
    [&[0][..], &text(name), &text(value)].concat()
}

/// Its length with seven bits a byte after the first, then the text as it is.
pub(crate) fn text(text: &str) -> Vec<u8> {
    let mut bytes = Vec::new();
    match text.len() {
        short @ 0..127 => bytes.push(short as u8),
        long => {
            bytes.push(127);
            let mut rest = long - 127;
            while rest >= 128 {
                bytes.push((rest & 127) as u8 | 128);
                rest >>= 7;
            }
            bytes.push(rest as u8);
        }
    }
    bytes.extend_from_slice(text.as_bytes());
    bytes
}

/// The headers of a call, and more of them.
pub(crate) fn call_headers(path: &str, more: &[(&str, &str)]) -> Vec<u8> {
    let usual = [
        (":method", "POST"),
        (":scheme", "http"),
        (":path", path),
        (":authority", "mrol"),
        ("content-type", "application/grpc"),
        ("te", "trailers"),
    ];
    usual.iter().chain(more).flat_map(|(name, value)| literal(name, value)).collect()
}

/// A call's first frame.
pub(crate) fn call(stream: u32, path: &str, more: &[(&str, &str)], flags: u8) -> Vec<u8> {
    frame(HEADERS, END_HEADERS | flags, stream, &call_headers(path, more))
}

/// What a stream sends, in frames, with its end.
pub(crate) fn data(stream: u32, bytes: &[u8]) -> Vec<u8> {
    let chunks = bytes.chunks(FRAME_BYTES).count();
    let flags = |chunk: usize| if chunk + 1 == chunks { END_STREAM } else { 0 };
    let frames = bytes.chunks(FRAME_BYTES).enumerate();
    frames.flat_map(|(chunk, bytes)| frame(DATA, flags(chunk), stream, bytes)).collect()
}

/// What stands before a message: whether it is compressed, and its length.
pub(crate) fn message_head(compressed: bool, length: u32) -> Vec<u8> {
    [&[u8::from(compressed)][..], &length.to_be_bytes()].concat()
}

/// True where an answer to a stream was begun.
pub(crate) fn is_answered(answers: &[u8], stream: u32) -> bool {
    has_headers(answers, stream, 0)
}

/// True where an answer to a stream was begun and ended, and not the connection cut alone.
pub(crate) fn was_answered(answers: &[u8], stream: u32) -> bool {
    has_headers(answers, stream, END_STREAM)
}

/// True where the server sent headers of a stream with these flags.
fn has_headers(answers: &[u8], stream: u32, flags: u8) -> bool {
    let mut rest = answers;
    while let Some((head, more)) = rest.split_at_checked(9) {
        let length = u32::from_be_bytes([0, head[0], head[1], head[2]]) as usize;
        let of_stream = head[5..9] == stream.to_be_bytes();
        if of_stream && head[3] == HEADERS && head[4] & flags == flags {
            return true;
        }
        rest = more.get(length..).unwrap_or_default();
    }
    false
}

/// A connection whose answers are read, so that nothing keeps the server from sending them.
pub(crate) struct Connection {
    send: OwnedWriteHalf,
    /// All that the server has said; its sender is gone once the server has closed.
    answers: watch::Receiver<Vec<u8>>,
}

impl Connection {
    pub(crate) async fn open(server: SocketAddr) -> Self {
        Self::open_with(server, &[]).await
    }

    pub(crate) async fn open_with(server: SocketAddr, settings: &[(u16, u32)]) -> Self {
        let mut connection = Self::open_raw(server).await;
        connection.send(&opening(settings)).await;
        connection
    }

    /// Without a word yet.
    pub(crate) async fn open_raw(server: SocketAddr) -> Self {
        let (mut read, send) = TcpStream::connect(server).await.unwrap().into_split();
        let (heard, answers) = watch::channel(Vec::new());
        tokio::spawn(async move {
            let mut piece = vec![0; 4096];
            // However it ends, that is its end.
            while let Ok(bytes @ 1..) = read.read(&mut piece).await {
                heard.send_modify(|answers| answers.extend_from_slice(&piece[..bytes]));
            }
        });
        Self { send, answers }
    }

    /// True when it went out; false once the server has closed.
    pub(crate) async fn send(&mut self, bytes: &[u8]) -> bool {
        self.answers.has_changed().is_ok() && self.send.write_all(bytes).await.is_ok()
    }

    /// Sends a byte at a time until the server has enough; all that it said.
    pub(crate) async fn dribble(mut self, bytes: impl Iterator<Item = Vec<u8>>, pause: Duration) -> Vec<u8> {
        for piece in bytes {
            if !self.send(&piece).await {
                break;
            }
            tokio::time::sleep(pause).await;
        }
        self.closed().await
    }

    /// Waits until what the server has said fulfills a condition, or the server closes.
    pub(crate) async fn until(&mut self, said: impl FnMut(&Vec<u8>) -> bool) {
        let heard = timeout(2 * PATIENCE, self.answers.wait_for(said)).await;
        let _ = heard.expect("the server answers or closes the connection");
    }

    /// Waits until the server closes; all that it said.
    pub(crate) async fn closed(mut self) -> Vec<u8> {
        self.until(|_| false).await;
        self.answers.borrow().clone()
    }
}
