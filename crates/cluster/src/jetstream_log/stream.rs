//! What the stream of a log is made of.

use std::time::Duration;

use async_nats::jetstream::stream::{Config, DiscardPolicy, Republish, StorageType};

use super::names::LogNames;

/// For how long ids are remembered: an attempt and some repetitions. More is of no use, since a repetition is told by
/// its place; and an id whose message its leader lost is answered "in process" for as long.
const IDS_REMEMBERED: Duration = Duration::from_secs(2);

/// What the stream of a log on so many servers is made of.
pub(super) fn config_of(names: &LogNames, replicas: usize) -> Config {
    Config {
        name: names.stream.clone(),
        description: Some("The changes of a map, in order".to_owned()),
        subjects: vec![names.subjects()],
        num_replicas: replicas,
        storage: StorageType::File,
        // A stream that is full refuses: what it has is not given up for what is new.
        discard: DiscardPolicy::New,
        duplicate_window: IDS_REMEMBERED,
        allow_direct: true,
        deny_delete: true,
        republish: Some(Republish {
            source: names.subjects(),
            destination: names.news.clone(),
            headers_only: true,
        }),
        ..Config::default()
    }
}
