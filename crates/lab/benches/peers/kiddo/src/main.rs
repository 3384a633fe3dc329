//! The k-d tree `kiddo` on the voxels and points of `mrol-lab bench nearest --to centers --peer-file`, one thread.
//!
//! ```text
//! mrol-lab bench nearest --queries 100000 --to centers --peer-file target/points.bin
//! cargo run --release --manifest-path crates/lab/benches/peers/kiddo/Cargo.toml -- target/points.bin
//! ```
//!
//! The layout of the file is in `crates/lab/src/measure/peer_file.rs`. Prints nanoseconds a point, the median of some
//! passes after one that is not timed: of the search for the nearest center however far it is, and of that within the
//! radius; and the largest difference of the distances within the radius.

use std::hint::black_box;
use std::num::NonZeroUsize;
use std::time::Instant;

use kiddo::{ImmutableKdTree, SquaredEuclidean};

const PASSES: usize = 7;

struct Peer {
    radius_m: f64,
    centers: Vec<[f32; 3]>,
    points: Vec<[f32; 3]>,
    distances_m: Vec<f32>,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("usage: kiddo-peer FILE")?;
    let peer = Peer::read(&std::fs::read(path)?).ok_or("no file of mrol-lab bench nearest --peer-file")?;
    let start = Instant::now();
    let tree = ImmutableKdTree::<f32, 3>::new_from_slice(&peer.centers);
    println!("{} centers, built in {:.0} ms", peer.centers.len(), start.elapsed().as_secs_f64() * 1e3);

    let squared: Vec<f32> =
        peer.points.iter().map(|point| tree.nearest_one::<SquaredEuclidean>(point).distance).collect();
    println!("largest difference {:.1e} m", peer.largest_difference_m(&squared));
    println!("nearest_one: {:.1} ns a point", peer.median_ns(|point| {
        black_box(tree.nearest_one::<SquaredEuclidean>(point));
    }));
    let (squared_radius, one) = ((peer.radius_m * peer.radius_m) as f32, NonZeroUsize::MIN);
    println!("within the radius: {:.1} ns a point", peer.median_ns(|point| {
        black_box(tree.nearest_n_within::<SquaredEuclidean>(point, squared_radius, one, true));
    }));
    Ok(())
}

impl Peer {
    fn read(bytes: &[u8]) -> Option<Self> {
        let mut rest = bytes.strip_prefix(b"mrolpeer")?;
        let voxel_m = f64::from_le_bytes(take(&mut rest)?);
        let radius_m = f64::from_le_bytes(take(&mut rest)?);
        let (mut centers, mut points, mut distances_m) = (Vec::new(), Vec::new(), Vec::new());
        for _ in 0..u64::from_le_bytes(take(&mut rest)?) {
            let mut center = [0.0; 3];
            for c in &mut center {
                *c = ((f64::from(i32::from_le_bytes(take(&mut rest)?)) + 0.5) * voxel_m) as f32;
            }
            centers.push(center);
        }
        for _ in 0..u64::from_le_bytes(take(&mut rest)?) {
            let mut point = [0.0; 3];
            for c in &mut point {
                *c = f32::from_le_bytes(take(&mut rest)?);
            }
            points.push(point);
            distances_m.push(f32::from_le_bytes(take(&mut rest)?));
        }
        Some(Self { radius_m, centers, points, distances_m })
    }

    /// Of the distances in the file to those found, infinite where the file has one beyond the radius or lacks one
    /// within.
    fn largest_difference_m(&self, squared: &[f32]) -> f64 {
        let pairs = self.distances_m.iter().zip(squared);
        let difference = |(&told, &squared): (&f32, &f32)| {
            let found = f64::from(squared).sqrt();
            let near_radius = (found - self.radius_m).abs() < 1e-5;
            match told.is_finite() {
                true => (f64::from(told) - found).abs(),
                false if found > self.radius_m || near_radius => 0.0,
                false => f64::INFINITY,
            }
        };
        pairs.map(difference).fold(0.0, f64::max)
    }

    fn median_ns(&self, search: impl Fn(&[f32; 3])) -> f64 {
        let mut passes: Vec<f64> = (0..=PASSES)
            .map(|_| {
                let start = Instant::now();
                self.points.iter().for_each(&search);
                start.elapsed().as_nanos() as f64 / self.points.len() as f64
            })
            .skip(1)
            .collect();
        passes.sort_by(f64::total_cmp);
        passes[passes.len() / 2]
    }
}

fn take<const N: usize>(rest: &mut &[u8]) -> Option<[u8; N]> {
    let (number, after) = rest.split_first_chunk::<N>()?;
    *rest = after;
    Some(*number)
}
