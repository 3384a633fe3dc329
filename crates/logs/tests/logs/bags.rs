//! Folders of ROS 2, with databases or files of MCAP, are read as the one log that they are.

use std::fs;
use std::path::{Path, PathBuf};

use mrol_logs::log::{Bag, DamageKind, LogError, Messages};
use rusqlite::Connection;
use tempfile::TempDir;

/// A message: its topic's name, its time, its bytes.
type Message = (String, u64, Vec<u8>);

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name)
}

/// The messages of a log, and what is said of files that end too early.
fn read(path: &Path) -> (Vec<Message>, Vec<String>) {
    let mut bag = Bag::open(path).unwrap();
    let (mut messages, mut position) = (Vec::new(), 0);
    while let Some((topic, time_ns)) = bag.advance().unwrap() {
        messages.push((bag.topics()[topic].name.clone(), time_ns, bag.data().to_vec()));
        assert!((position..=bag.bytes()).contains(&bag.position()));
        position = bag.position();
    }
    assert!(bag.advance().unwrap().is_none() && bag.data().is_empty(), "the end stays the end");
    assert_eq!(bag.position(), bag.bytes());
    (messages, bag.damages().iter().map(ToString::to_string).collect())
}

fn refusal(path: &Path) -> LogError {
    Bag::open(path).map(|bag| format!("{bag:?}")).unwrap_err()
}

#[test]
fn databases_by_others_have_the_messages_of_the_file_of_mcap() {
    let (of_mcap, none) = read(&fixture("zstd.mcap"));
    assert!(of_mcap.len() == 92 && none.is_empty(), "{none:?}");
    for name in ["bag_plain", "bag_by_message", "bag_by_file", "bag_plain/bag_plain.db3"] {
        assert!(Bag::is_log(&fixture(name)), "{name}");
        let (messages, damages) = read(&fixture(name));
        assert!(
            messages == of_mcap && damages.is_empty(),
            "{name}: {} messages, {damages:?}",
            messages.len()
        );
    }
}

#[test]
fn a_log_in_several_files_is_read_in_their_order_and_topics_keep_their_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let names = ["run_10.mcap", "run_2.db3", "run_2.db3.zstd", "run_0.mcap", "metadata.yaml"];
    let files =
        ["lz4.mcap", "bag_plain/bag_plain.db3", "bag_by_file/bag_by_file.db3.zstd", "zstd.mcap", "write.py"];
    for (name, file) in names.into_iter().zip(files) {
        fs::copy(fixture(file), folder.path().join(name)).unwrap();
    }
    let (one, _) = read(&fixture("zstd.mcap"));
    let (all, damages) = read(folder.path());
    assert!(
        all == vec![one.clone(); 3].concat() && damages.is_empty(),
        "{} messages, {damages:?}",
        all.len()
    );
    let mut bag = Bag::open(folder.path()).unwrap();
    while bag.advance().unwrap().is_some() {}
    assert_eq!(bag.topics().len(), 6);

    // The others are read where one ends too early, which is told with its name.
    let cut = folder.path().join("run_0.mcap");
    let bytes = fs::read(&cut).unwrap();
    fs::write(&cut, &bytes[..bytes.len() / 2]).unwrap();
    let (rest, damages) = read(folder.path());
    assert!(
        (2 * one.len()..3 * one.len()).contains(&rest.len())
            && rest.ends_with(&vec![one.clone(); 2].concat())
    );
    assert!(
        matches!(&damages[..], [only] if only.starts_with("run_0.mcap is good up to byte")),
        "{damages:?}"
    );
}

#[test]
fn compressed_files_of_mcap_are_read_as_they_were_before() {
    let folder = tempfile::tempdir().unwrap();
    let whole = fs::read(fixture("none.mcap")).unwrap();
    let path = folder.path().join("run.mcap.zstd");
    fs::write(&path, zstd::bulk::compress(&whole, 3).unwrap()).unwrap();
    assert!(read(&path) == read(&fixture("none.mcap")));
}

#[test]
fn folders_without_a_log_and_links_out_of_them_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    assert!(!Bag::is_log(folder.path()));
    let nothing = refusal(folder.path()).to_string();
    assert!(nothing.contains(".mcap .db3"), "{nothing}");
    std::os::unix::fs::symlink(fixture("zstd.mcap"), folder.path().join("run_0.mcap")).unwrap();
    assert!(matches!(refusal(folder.path()), LogError::Link(name) if name == "run_0.mcap"));
    fs::remove_file(folder.path().join("run_0.mcap")).unwrap();
    fs::write(folder.path().join("run_0.db3"), "nothing").unwrap();
    let broken = refusal(folder.path()).to_string();
    assert!(broken.starts_with("run_0.db3: this is no database of ROS 2"), "{broken}");
}

/// A database with rows of its own.
fn database(statements: &str) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.db3");
    Connection::open(&path).unwrap().execute_batch(statements).unwrap();
    (folder, path)
}

const TOPICS: &str =
    "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);
                      INSERT INTO topics VALUES (1, '/points', 'sensor_msgs/msg/PointCloud2', 'cdr');";
const MESSAGES: &str =
    "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);";

#[test]
fn what_is_no_regular_file_is_not_waited_for() {
    let folder = tempfile::tempdir().unwrap();
    let _socket = std::os::unix::net::UnixListener::bind(folder.path().join("run_1.mcap")).unwrap();
    fs::copy(fixture("zstd.mcap"), folder.path().join("run_0.mcap")).unwrap();
    for path in [folder.path().to_owned(), folder.path().join("run_1.mcap")] {
        let told = refusal(&path).to_string();
        assert!(told.contains("run_1.mcap is no regular file"), "{told}");
    }
}

#[test]
fn a_compressed_file_that_is_no_database_is_not_unpacked_and_computed_columns_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let zeros = folder.path().join("zeros.db3.zstd");
    fs::write(&zeros, zstd::bulk::compress(&vec![0; 10 << 20], 3).unwrap()).unwrap();
    assert!(refusal(&zeros).to_string().contains("what is compressed in it begins with"));
    let bomb = [&b"SQLite format 3\0"[..], &vec![0; 64 << 20]].concat();
    let bomb_file = folder.path().join("bomb.db3.zstd");
    fs::write(&bomb_file, zstd::bulk::compress(&bomb, 3).unwrap()).unwrap();
    assert!(refusal(&bomb_file).to_string().contains("unpack to more than 1000 times as many"));
    let computed = "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER,
                    data BLOB GENERATED ALWAYS AS (zeroblob(60000000)) VIRTUAL);
                    INSERT INTO messages(topic_id, timestamp) VALUES (1, 1), (1, 2);";
    let (_folder, computed) = database(&format!("{TOPICS} {computed}"));
    assert!(refusal(&computed).to_string().contains("columns of its tables are computed"));
}

#[test]
fn hostile_databases_neither_grow_nor_hang() {
    // A view in the place of a table, whose rows have no end.
    let endless = "CREATE VIEW messages AS WITH RECURSIVE n(id) AS (SELECT 1 UNION ALL SELECT id + 1 FROM n) \
                   SELECT id, 1 AS topic_id, 0 AS timestamp, x'00' AS data FROM n;";
    let (_folder, path) = database(&format!("{TOPICS} {endless}"));
    assert!(refusal(&path).to_string().contains("no tables `topics` and `messages`"));
    // Other types, a topic that nobody declared, times before 1970, and numbers up to the last.
    let odd = "INSERT INTO messages VALUES (-5, 1, -1, x'01'), (1, 7, 2, x'02'), (2, 1, 3, 'text'), (3, 1, 4, NULL),
               (9223372036854775807, 1, 5, x'03');";
    let (_folder, path) = database(&format!("{TOPICS} {MESSAGES} {odd}"));
    let (messages, damages) = read(&path);
    let bytes: Vec<&[u8]> = messages.iter().map(|(_, _, data)| &data[..]).collect();
    assert!(bytes == [&[1][..], &[], &[], &[3]] && damages.is_empty(), "{messages:?} {damages:?}");
    // A message that becomes much, and one that is much.
    let bomb = zstd::bulk::compress(&vec![0; 200 << 20], 1).unwrap();
    let hex = |bytes: &[u8]| bytes.iter().map(|byte| format!("{byte:02x}")).collect::<String>();
    let rows = format!("INSERT INTO messages VALUES (1, 1, 0, x'00'), (2, 1, 0, x'{}');", hex(&bomb));
    let (_folder, path) = database(&format!("{TOPICS} {MESSAGES} {rows}"));
    let mut bag = Bag::open(&path).unwrap();
    while bag.advance().unwrap().is_some() {}
    assert!(matches!(bag.damages()[0].why, DamageKind::TooLong { .. }), "{:?}", bag.damages());
    let (_folder, path) =
        database(&format!("{TOPICS} {MESSAGES} INSERT INTO messages VALUES (1, 1, 0, zeroblob(100000000));"));
    let (messages, damages) = read(&path);
    assert!(messages.is_empty() && damages[0].contains("too big"), "{damages:?}");
}

#[test]
fn a_database_with_a_flipped_byte_is_read_or_refused_in_bounded_time() {
    let whole = fs::read(fixture("bag_plain/bag_plain.db3")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.db3");
    let (mut read_whole, mut ended) = (0, 0);
    for at in (0..whole.len()).step_by(397) {
        let mut flipped = whole.clone();
        flipped[at] ^= 0x11;
        fs::write(&path, &flipped).unwrap();
        let Ok(mut bag) = Bag::open(&path) else {
            ended += 1;
            continue;
        };
        let mut messages = 0;
        while bag.advance().unwrap().is_some() {
            messages += 1;
        }
        assert!(messages <= 92);
        read_whole += u32::from(bag.damages().is_empty());
        ended += u32::from(!bag.damages().is_empty());
    }
    assert!(read_whole > 50 && ended > 3, "{read_whole} read, {ended} ended");
}
