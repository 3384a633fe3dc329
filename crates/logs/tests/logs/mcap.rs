//! Logs are read to their end, or up to where they are good.

use std::path::Path;

use super::support::McapWriter;
use mrol_logs::log::{CHUNK_BYTES_MAX, DamageKind, LogError, McapReader, Messages};

/// A message: its topic, its time, its bytes.
type Message = (usize, u64, Vec<u8>);

/// Logs by the packages of others, see fixtures/write.py.
fn written_by_others() -> [Vec<u8>; 3] {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures");
    ["zstd", "lz4", "none"].map(|name| std::fs::read(folder.join(format!("{name}.mcap"))).unwrap())
}

/// The messages of a log, and why it ended before the end.
fn read(log: &[u8]) -> (Vec<Message>, Option<DamageKind>) {
    let mut reader = McapReader::new(log).unwrap();
    let mut messages = Vec::new();
    while let Some(message) = reader.next_message().unwrap() {
        messages.push((message.topic, message.log_time_ns, message.data.to_vec()));
    }
    assert!(reader.next_message().unwrap().is_none(), "the end stays the end");
    assert!(reader.position() <= log.len() as u64);
    (messages, reader.damages().first().map(|damage| damage.why.clone()))
}

#[test]
fn logs_by_others_are_read_whatever_their_compression() {
    let [zstd, lz4, none] = written_by_others().map(|log| {
        let (messages, damage) = read(&log);
        assert_eq!(damage, None);
        messages
    });
    assert_eq!(zstd.len(), 26 * 3 + 6 * 2 + 2);
    assert!(zstd == lz4 && zstd == none);
    let log = &written_by_others()[0][..];
    let mut reader = McapReader::new(log).unwrap();
    while reader.next_message().unwrap().is_some() {}
    let points = reader.topics().iter().find(|topic| topic.name == "/points").unwrap();
    assert_eq!((&*points.type_name, &*points.encoding), ("sensor_msgs/msg/PointCloud2", "cdr"));
}

#[test]
fn a_log_that_is_cut_off_anywhere_is_read_up_to_there_with_a_word() {
    for log in written_by_others() {
        let (whole, _) = read(&log);
        let (mut last, mut told) = (0, 0);
        for part in 1..=20 {
            let cut = log.len() * part / 21;
            let (messages, damage) = read(&log[..cut]);
            assert!(messages.len() >= last && whole.starts_with(&messages), "at byte {cut}");
            last = messages.len();
            match damage {
                Some(why) => assert_eq!(why, DamageKind::CutOff, "at byte {cut}"),
                // What is cut off is the summary, which nobody reads.
                None => assert_eq!(messages.len(), whole.len(), "at byte {cut}"),
            }
            told += u32::from(messages.len() < whole.len());
        }
        assert!(last > whole.len() / 2 && told > 10, "{last} messages, {told} told");
    }
}

#[test]
fn a_flipped_byte_ends_the_log_before_its_chunk() {
    for log in written_by_others() {
        let (whole, _) = read(&log);
        let (mut ended, mut unharmed) = (0, 0);
        for at in (8..log.len()).step_by(61) {
            let mut flipped = log.clone();
            flipped[at] ^= 0x10;
            let (messages, damage) = read(&flipped);
            assert!(whole.starts_with(&messages), "at byte {at}");
            match damage {
                Some(_) => ended += 1,
                None => unharmed += u32::from(messages.len() == whole.len()),
            }
        }
        assert!(ended > 50 && unharmed > 3, "{ended} ended, {unharmed} unharmed");
    }
}

#[test]
fn another_log_behind_the_end_of_one_is_told_and_not_read() {
    for log in written_by_others() {
        let (whole, _) = read(&log);
        for more in [&log[..], &log[..9], &[0]] {
            let (messages, damage) = read(&[&log[..], more].concat());
            assert_eq!((messages.len(), damage), (whole.len(), Some(DamageKind::Appended)));
        }
    }
}

/// A chunk that claims sizes, with its content.
fn chunk(uncompressed: u64, compression: &str, compressed: u64, content: &[u8]) -> Vec<u8> {
    let text = [&(compression.len() as u32).to_le_bytes()[..], compression.as_bytes()].concat();
    [&[0; 16][..], &uncompressed.to_le_bytes(), &[0; 4], &text, &compressed.to_le_bytes(), content].concat()
}

#[test]
fn claims_of_sizes_allocate_nothing_and_end_the_log() {
    let four_gb = 4 << 30;
    let bomb = zstd::bulk::compress(&vec![0; 4 * CHUNK_BYTES_MAX], 1).unwrap();
    let small = bomb.len() as u64;
    let over = CHUNK_BYTES_MAX as u64;
    let cases = [
        (chunk(four_gb, "", 4, &[1; 4]), "4294967296"),
        (chunk(4, "", four_gb, &[1; 4]), "format"),
        (chunk(4, "zstd", small, &bomb), "more than the 4 bytes"),
        (chunk(over, "zstd", small, &bomb), "more than"),
        (chunk(9, "zstd", 3, &[1; 3]), "decompressed"),
        (chunk(9, "lz4", 3, &[1; 3]), "decompressed"),
        (chunk(9, "", 3, &[1; 3]), "less than"),
        (chunk(4, "rot13", 4, &[1; 4]), "rot13"),
        // A record that says it is longer than its chunk.
        (chunk(13, "", 13, &[5, 200, 0, 0, 0, 0, 0, 0, 0, 1, 2, 3, 4]), "format"),
        (chunk(3, "", 3, &[5; 3]), "format"),
    ];
    for (body, said) in cases {
        let mut log = McapWriter::default();
        let points = log.topic("/points", "sensor_msgs/msg/PointCloud2");
        log.message(points, 0, &[1; 50]);
        log.record(6, &body);
        log.message(points, 1, &[2; 50]);
        let (read, damage) = self::read(&log.finish());
        let damage = damage.map(|why| why.to_string()).unwrap_or_default();
        assert!(read.len() == 1 && damage.contains(said), "{} messages, {damage}", read.len());
    }
    // A record of the file that claims more than there is.
    let mut log = McapWriter::default().kill();
    log.extend([6]);
    log.extend(four_gb.to_le_bytes());
    let (read, damage) = self::read(&log);
    assert!(read.is_empty() && matches!(damage, Some(DamageKind::TooLong { .. })), "{damage:?}");
}

#[test]
fn what_is_no_log_and_what_has_no_end_is_told() {
    for nothing in [&b""[..], b"\x89MCAP", b"#ROSBAG V2.0\n"] {
        assert!(matches!(McapReader::new(nothing), Err(LogError::NoMcap(_))));
    }
    let mut log = McapWriter::default();
    let points = log.topic("/points", "sensor_msgs/msg/PointCloud2");
    log.message(points, 0, &[1; 50]);
    // Of a channel that nobody declared, and of one with a name that is too long.
    log.message(7, 1, &[2; 50]);
    let long = log.topic(&"n".repeat(65_536), "sensor_msgs/msg/PointCloud2");
    log.message(long, 1, &[2; 50]);
    log.message(points, 1, &[2; 50]);
    let (read, damage) = read(&log.kill());
    assert_eq!((read.len(), damage), (2, Some(DamageKind::CutOff)));
}
