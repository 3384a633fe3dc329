//! A robot: streams scans into a map and prints the answers. The scans are those of a folder, or simulated.
//!
//! ```text
//! mrol serve
//! cargo run --release --example robot -- http://127.0.0.1:7334 office path/to/scans
//! ```

use std::error::Error;
use std::path::PathBuf;

use mrol::client::{Client, Credentials, NewMap, new_session};
use mrol::geometry::{Point, translation_m};
use mrol::map::{MapName, RobotName};
use mrol::scan::{read_points, scan_files};
use mrol::service::ScanRequest;
use mrol_simulate::{Scene, tours};
use rand::SeedableRng;

#[tokio::main]
async fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let url = arguments.next().unwrap_or("http://127.0.0.1:7334".into());
    let map = MapName::new(&arguments.next().unwrap_or("office".into()))?;
    let robot = RobotName::new("example")?;
    let scans = match arguments.next() {
        Some(folder) => {
            let files = scan_files(&[PathBuf::from(folder)])?;
            files.iter().map(|file| read_points(file)).collect::<Result<Vec<_>, _>>()?
        }
        None => simulated(),
    };

    let client = Client::connect_with(&url, &credentials()?).await?;
    client.create_map(&map, NewMap::of(0.05)).await?;
    // Session and number make a retry safe: a scan that the map has already is answered again, and not added twice. A
    // new session at each start lets the numbers begin again.
    let session = new_session();
    let requests = scans.into_iter().zip(0..).map(move |(points, scan_id)| ScanRequest {
        session: session.clone(),
        scan_id: Some(scan_id),
        ..ScanRequest::new(robot.clone(), points.into())
    });
    let mut answers = client.insert_scans(&map, tokio_stream::iter(requests)).await?;
    while let Some(answer) = answers.next().await {
        let answer = answer?;
        let ([x, y, z], overlap) = (translation_m(&answer.map_from_sensor), answer.overlap());
        println!(
            "{:<12} at {x:>7.3} {y:>7.3} {z:>7.3} m, overlap {overlap:.3}: {}",
            answer.verdict.as_str(),
            answer.reason
        );
    }
    Ok(())
}

/// Reads the key from `MROL_KEY`. A server on loopback may need none; others do, of scope admin to make a map.
fn credentials() -> Result<Credentials, Box<dyn Error>> {
    match std::env::var("MROL_KEY") {
        Ok(secret) => Ok(Credentials::default().with_key(&secret)?),
        Err(_) => Ok(Credentials::default()),
    }
}

fn simulated() -> Vec<Vec<Point>> {
    let (scene, [_, tour]) = (Scene::furnished(1), tours(20));
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    tour.poses.iter().map(|pose| tour.sensor.scan(&scene, pose, &mut rng)).collect()
}
