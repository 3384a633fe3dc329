//! A planner: asks about a slice of a map, all points at once, and draws what is occupied.
//!
//! ```text
//! mrol demo
//! cargo run --release --example planner -- http://127.0.0.1:7334 demo
//! ```

use std::error::Error;

use mrol::client::{Client, Credentials};
use mrol::geometry::Point;
use mrol::map::{Lookup, MapName};
use mrol::service::PointQuery;

/// The slice: meters from the map's origin, one meter above the floor, a point every 0.125 x 0.25 m.
const COLUMNS: usize = 112;
const ROWS: usize = 36;
const HEIGHT_M: f32 = 1.0;

#[tokio::main]
async fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let url = arguments.next().unwrap_or("http://127.0.0.1:7334".into());
    let map = MapName::new(&arguments.next().unwrap_or("demo".into()))?;

    let row = |row: usize| (0..COLUMNS).map(move |column| place(column, row));
    let points: Vec<Point> = (0..ROWS).rev().flat_map(row).collect();
    let query = PointQuery {
        points: points.into(),
        map_from_points: None,
        level: 3,
        lookup: Lookup::Exact,
        min_revision: None,
        map_uuid: None,
        keep_out: false,
    };
    let client = Client::connect_with(&url, &credentials()?).await?;
    let answer = client.query_points(&map, query).await?;

    let occupied = |i: usize| answer.occupied[i / 8] >> (i % 8) & 1 == 1;
    for row in 0..ROWS {
        let line = (0..COLUMNS).map(|column| if occupied(row * COLUMNS + column) { '#' } else { '.' });
        println!("{}", line.collect::<String>());
    }
    let revision = answer.version.revision;
    println!("{} of {} points are occupied at revision {revision}", answer.points_occupied, answer.points);
    Ok(())
}

/// A server on loopback may ask for no key; others do.
fn credentials() -> Result<Credentials, Box<dyn Error>> {
    match std::env::var("MROL_KEY") {
        Ok(secret) => Ok(Credentials::default().with_key(&secret)?),
        Err(_) => Ok(Credentials::default()),
    }
}

fn place(column: usize, row: usize) -> Point {
    Point::new(column as f32 * 0.125, row as f32 * 0.25, HEIGHT_M)
}
