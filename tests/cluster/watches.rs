//! Many watch a map's events at a follower.

use mrol::geometry::Point;
use mrol::map::MapName;
use mrol::service::EventsQuery;

use crate::site::{NODES, Site};

/// More than a connection between two nodes takes.
const WATCHES: usize = 150;
/// As many as a client's own connection takes.
const OF_A_CLIENT: usize = 75;

#[test]
fn whoever_watches_at_a_follower_keeps_no_change_from_the_leader() {
    let settings = &[("MROL_LIMITS__CALLER_WATCHES_MAX", "200")];
    let Some(site) = Site::start_with(settings) else { return };
    let map = MapName::new("hall").unwrap();
    site.create(&map);
    site.insert(&site.all_grpc(0), &map, 1, Point::new(1.0, 0.0, 0.0));
    let follower = (site.leader(&map) + 1) % NODES;
    let mut watches = Vec::new();
    for _ in 0..WATCHES / OF_A_CLIENT {
        let client = site.client(&site.grpc(follower));
        for _ in 0..OF_A_CLIENT {
            let watch = site.runtime().block_on(client.watch_events(&map, EventsQuery::default()));
            watches.push(watch.unwrap());
        }
    }
    assert_eq!(site.insert(&site.grpc(follower), &map, 2, Point::new(2.0, 0.0, 0.0)), 2);
    drop(watches);
}
