//! Contents of copies, compared by their hashes at the same revision.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use super::findings::Finding;
use mrol_client::{Client, Credentials};
use mrol_cluster::{Overview, SeenNode};
use mrol_map::map::{ContentHash, MapName};
use mrol_service::replication::NodeName;
use uuid::Uuid;

/// How long a node may take to answer.
const ANSWERED_WITHIN: Duration = Duration::from_secs(5);
/// Pause before the nodes are asked again.
const PAUSE: Duration = Duration::from_millis(200);

/// What the nodes have said of a map: by revision, the hash that each node has there.
type Said = BTreeMap<u64, BTreeMap<NodeName, ContentHash>>;

/// Asks the live nodes for the versions of the maps until every map was compared, or the time is over.
pub(super) async fn compared(seen: &Overview, credentials: &Credentials, within: Duration) -> Vec<Finding> {
    let (mut clients, mut findings) = (Vec::new(), Vec::new());
    for SeenNode { node, beat, .. } in seen.nodes.iter().filter(|node| node.is_live) {
        match Client::connect_with(&beat.grpc, credentials).await {
            // Each is asked for its own copy.
            Ok(client) => clients.push((node.clone(), client.with_timeout(ANSWERED_WITHIN).not_sent_on())),
            Err(error) => {
                findings.push(Finding::wrong(
                    "contents",
                    format!("node {node} is not reached at {}: {error}", beat.grpc),
                ));
            }
        }
    }
    if clients.len() < 2 {
        findings.push(Finding::unknown("contents", "fewer than two nodes were reached: nothing to compare"));
        return findings;
    }
    let until = Instant::now() + within;
    for map in &seen.maps {
        let clients: Vec<_> = clients.iter().filter(|(node, _)| map.copy(node).is_some()).collect();
        if clients.len() < 2 {
            let detail = format!("map {} is on fewer than two nodes that were reached", map.name);
            findings.push(Finding::unknown("contents", detail));
            continue;
        }
        let mut said = Said::new();
        let mut failure = None;
        loop {
            for (node, client) in &clients {
                match version(client, &map.name, map.uuid).await {
                    Ok(Some((revision, hash))) => {
                        said.entry(revision).or_default().insert(node.clone(), hash);
                    }
                    Ok(None) => {}
                    Err(error) => failure = Some(format!("node {node}: {error}")),
                }
            }
            let is_done = said.values().any(|hashes| hashes.len() == clients.len());
            if is_done || differing(&said).is_some() || Instant::now() >= until {
                break;
            }
            tokio::time::sleep(PAUSE).await;
        }
        findings.push(judged(&map.name, &said, clients.len(), failure));
    }
    findings
}

/// Revision and hash of a node's copy; none where that is another map.
async fn version(
    client: &Client,
    map: &MapName,
    uuid: Uuid,
) -> Result<Option<(u64, ContentHash)>, mrol_client::ClientError> {
    let version = client.map_info(map).await?.version;
    Ok(version.content_hash.filter(|_| version.map_uuid == uuid).map(|hash| (version.revision, hash)))
}

/// A revision at which two nodes have different contents.
fn differing(said: &Said) -> Option<(u64, &BTreeMap<NodeName, ContentHash>)> {
    let differ = |hashes: &BTreeMap<NodeName, ContentHash>| {
        let mut all = hashes.values();
        let first = all.next();
        all.any(|hash| Some(hash) != first)
    };
    said.iter().find(|(_, hashes)| differ(hashes)).map(|(revision, hashes)| (*revision, hashes))
}

fn judged(map: &MapName, said: &Said, nodes: usize, failure: Option<String>) -> Finding {
    if let Some((revision, hashes)) = differing(said) {
        let hashes: Vec<String> = hashes.iter().map(|(node, hash)| format!("{node} {hash}")).collect();
        let hashes = hashes.join(", ");
        return Finding::wrong("contents", format!("map {map} differs at revision {revision}: {hashes}"));
    }
    let common = said.iter().filter(|(_, hashes)| hashes.len() > 1).max_by_key(|(_, hashes)| hashes.len());
    match common {
        Some((revision, hashes)) => {
            let equal = hashes.len();
            Finding::good(
                "contents",
                format!("map {map} is the same on {equal} of {nodes} nodes at revision {revision}"),
            )
        }
        None => {
            let why = failure.unwrap_or_else(|| "no two nodes were met at one revision".to_owned());
            Finding::unknown("contents", format!("map {map} was not compared: {why}"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contents_are_compared_at_the_same_revision() {
        let map = MapName::new("hall").unwrap();
        let said = |versions: &[(&str, u64, u64)]| {
            let mut said = Said::new();
            for &(node, revision, hash) in versions {
                let hashes = said.entry(revision).or_default();
                hashes.insert(NodeName::new(node).unwrap(), ContentHash::from_bits(hash));
            }
            judged(&map, &said, 3, None).to_string()
        };
        let equal = said(&[("a", 4, 1), ("b", 4, 1), ("c", 5, 2)]);
        assert!(equal.contains("the same on 2 of 3 nodes at revision 4"), "{equal}");
        let differ = said(&[("a", 4, 1), ("b", 4, 2)]);
        assert!(differ.starts_with("WRONG") && differ.contains("differs at revision 4: a "), "{differ}");
        let unknown = said(&[("a", 4, 1), ("b", 5, 2)]);
        assert!(unknown.starts_with("unknown") && unknown.contains("no two nodes"), "{unknown}");
    }
}
