//! Maps that some of the nodes hold: they are made there, others name them, and they move without a loss.

use std::time::Instant;

use mrol_cluster::{ClusterStore, Holders, OverviewReader};
use mrol_map::map::MapSettings;
use mrol_service::replication::NodeName;
use mrol_service::{Reason, ServiceError};
use tempfile::TempDir;

use crate::nodes::{Server, leader, name, retried, waited};
use crate::support::{NatsServers, eventually};

const MAP: &str = "hall";

/// Why a node does not describe the map; none where it does.
fn refusal(server: &Server) -> Option<ServiceError> {
    server.runtime.block_on(server.service.map_info(&name(MAP))).err()
}

/// True of a node that says that others hold the map.
fn is_elsewhere(server: &Server) -> bool {
    refusal(server).is_some_and(|error| error.reason == Reason::MapElsewhere)
}

fn only(nodes: &[&str]) -> Holders {
    Holders::Only(nodes.iter().map(|node| NodeName::new(node).unwrap()).collect())
}

fn holders(store: &ClusterStore) -> Holders {
    eventually(|| store.catalog.read()).0.map(&name(MAP)).unwrap().holders()
}

/// Takes the server of that name out.
fn take(servers: &mut Vec<(&'static str, Server)>, node: &str) -> Server {
    let index = servers.iter().position(|(name, _)| *name == node).unwrap();
    servers.remove(index).1
}

#[test]
fn a_map_is_held_by_some_nodes_goes_on_when_one_is_gone_and_moves_to_others() {
    let Some(nats) = NatsServers::start(3) else { return };
    drop(nats.engine());
    let store = eventually(|| ClusterStore::create(&nats.settings()));
    let folders: Vec<_> = (0..3).map(|_| TempDir::new().unwrap()).collect();
    let names = ["a", "b", "c"];
    let start = |index: usize| Server::start_with_copies(&nats, names[index], folders[index].path(), 2);
    let mut servers: Vec<(&'static str, Server)> = (0..3).map(|index| (names[index], start(index))).collect();
    waited("three nodes that see each other", || {
        servers.iter().all(|(_, server)| server.node.status().grpc.len() == 2)
    });
    let begun = Instant::now();
    assert!(servers[0].1.create(MAP));
    println!("made after {:?}", begun.elapsed());
    let held = holders(&store);
    assert!(held.names().count() == 2 && held.contains(&NodeName::new("a").unwrap()), "{held}");
    let other = names[1..].iter().find(|node| held.contains(&NodeName::new(node).unwrap())).unwrap();
    let third = names[1..].iter().find(|node| *node != other).unwrap();

    // The third node names the two, whatever it is asked for, and is ready without a copy.
    let c = take(&mut servers, third);
    waited("the third node names those that hold it", || is_elsewhere(&c));
    let error = refusal(&c).unwrap();
    let mut named: Vec<&str> = error.holders.iter().map(|holder| holder.node.as_str()).collect();
    named.sort_unstable();
    assert_eq!(named, ["a", *other], "{error}");
    let settings = MapSettings::new(0.5, 2);
    let made = c.runtime.block_on(c.service.create_map(name(MAP), settings)).unwrap_err();
    assert_eq!(made.reason, Reason::MapElsewhere);
    assert_eq!(c.insert(MAP, 0).unwrap_err().reason, Reason::MapElsewhere);
    let deleted = c.runtime.block_on(c.service.delete_map(&name(MAP))).unwrap_err();
    assert_eq!(deleted.reason, Reason::MapElsewhere);
    waited("it lacks nothing", || !c.node.is_behind(std::time::Duration::from_secs(1)));
    assert_eq!(c.version(MAP), None);

    // One of the two is gone: the other leads, and the third names that one alone.
    let (a, b) = (take(&mut servers, "a"), take(&mut servers, other));
    for number in 0..10 {
        assert_eq!(retried(|| leader(&[&a, &b], MAP).insert(MAP, number)), number + 1);
    }
    waited("equal copies", || a.version(MAP) == b.version(MAP));
    let (gone, left, left_name) = match a.leads(MAP) {
        true => (a, b, *other),
        false => (b, a, "a"),
    };
    let gone_name = if left_name == "a" { *other } else { "a" };
    gone.vanish();
    let begun = Instant::now();
    waited("the other leads", || left.leads(MAP));
    println!("taken over after {:?}", begun.elapsed());
    assert_eq!(retried(|| left.insert(MAP, 10)), 11);
    waited("the one that is gone is not named", || {
        refusal(&c).is_some_and(|error| error.holders.len() == 1 && error.holders[0].node == left_name)
    });
    assert!(c.version(MAP).is_none(), "no node holds it that is not named");

    // It moves to the third while it is changed: nothing is lost, and the copy goes from where it was.
    assert!(eventually(|| store.catalog.set_holders(&name(MAP), &only(&[third]))));
    let begun = Instant::now();
    let mut count = 11;
    while left.version(MAP).is_some() || !c.leads(MAP) {
        let by = if left.leads(MAP) { &left } else { &c };
        match by.insert(MAP, count) {
            Ok(revision) => {
                count += 1;
                assert_eq!(revision, count, "each change is there once");
            }
            Err(error) => {
                let passing =
                    [Reason::NoQuorum, Reason::NotLeader, Reason::MapElsewhere, Reason::OutcomeUnknown];
                assert!(passing.contains(&error.reason), "{error}");
            }
        }
        assert!(begun.elapsed() < 4 * crate::nodes::WITHIN, "{:?} {:?}", left.version(MAP), c.version(MAP));
    }
    println!("moved after {:?}, with {} changes meanwhile", begun.elapsed(), count - 11);
    assert!(count > 11, "nothing was changed meanwhile");
    assert_eq!(retried(|| c.insert(MAP, count)), count + 1);
    waited("who held it names the third", || {
        refusal(&left).is_some_and(|error| error.holders.len() == 1 && error.holders[0].node == *third)
    });

    // Who was gone had a copy, and has none any more.
    let index = names.iter().position(|name| *name == gone_name).unwrap();
    let back = start(index);
    waited("its copy goes", || is_elsewhere(&back));

    // On all nodes again, with all that was changed.
    assert!(eventually(|| store.catalog.set_holders(&name(MAP), &Holders::All)));
    let all = [&left, &c, &back];
    waited("copies on all nodes", || {
        all.iter().all(|server| {
            server.version(MAP) == c.version(MAP) && server.version(MAP).is_some_and(|it| it.0 == count + 1)
        })
    });
    let seen = OverviewReader::begin(store).unwrap();
    waited("the overview shows them", || {
        seen.look().is_ok_and(|seen| seen.map(&name(MAP)).is_some_and(|map| map.copies.len() == 3))
    });
}
