//! The collision-affording point tree `capt` on the voxels and arms of `mrol-lab bench planning --peer-file`, one
//! thread.
//!
//! ```text
//! mrol-lab bench planning --scans 0 --peer-file target/arms.bin
//! cargo run --release --manifest-path crates/lab/benches/peers/capt/Cargo.toml -- target/arms.bin
//! ```
//!
//! The layout of the file is in `crates/lab/src/measure/peer_file.rs`. The tree holds the centers of voxels, as balls
//! of half a voxel's side: less than the cubes, so that an arm that it finds colliding collides, and some that collide
//! it does not find. Prints nanoseconds a pose, the median of some passes after one that is not timed; and how the
//! answers compare.

#![cfg_attr(feature = "simd", feature(portable_simd))]

use std::hint::black_box;
use std::time::Instant;

use capt::Capt;

const PASSES: usize = 7;
/// Spheres of an arm.
const SPHERES: usize = 59;
/// Spheres at once.
const LANES: usize = 8;

type Sphere = [f32; 4];

struct Peer {
    voxel_m: f32,
    centers: Vec<[f32; 3]>,
    arms: Vec<[Sphere; SPHERES]>,
    collides: Vec<bool>,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("usage: capt-peer FILE")?;
    let peer = Peer::read(&std::fs::read(path)?).ok_or("no file of mrol-lab bench planning --peer-file")?;
    let radii = || peer.arms.iter().flatten().map(|sphere| sphere[3]);
    let range = (radii().fold(f32::INFINITY, f32::min), radii().fold(0.0, f32::max));
    let build = || Capt::<3>::with_point_radius(&peer.centers, range, peer.voxel_m / 2.0, LANES);
    let start = Instant::now();
    let tree = build();
    println!("{} centers, built in {:.0} ms", peer.centers.len(), start.elapsed().as_secs_f64() * 1e3);
    peer.report("one by one", |arm| {
        arm.iter().any(|&[x, y, z, radius]| tree.collides(&[x, y, z], radius))
    });
    #[cfg(feature = "simd")]
    peer.report("eight at once", |arm| eight_at_once(&tree, arm));
    Ok(())
}

#[cfg(feature = "simd")]
fn eight_at_once(tree: &Capt<3>, arm: &[Sphere; SPHERES]) -> bool {
    use std::simd::Simd;
    arm.chunks(LANES).any(|spheres| {
        let lane = |n: usize| spheres[n.min(spheres.len() - 1)];
        let number = |i: usize| Simd::<f32, LANES>::from_array(std::array::from_fn(|n| lane(n)[i]));
        tree.collides_simd(&[number(0), number(1), number(2)], number(3))
    })
}

impl Peer {
    fn read(bytes: &[u8]) -> Option<Self> {
        let mut rest = bytes.strip_prefix(b"mrolpeer")?;
        let voxel_m = f64::from_le_bytes(take(&mut rest)?);
        let _range_m: [u8; 8] = take(&mut rest)?;
        let (mut centers, mut arms, mut collides) = (Vec::new(), Vec::new(), Vec::new());
        for _ in 0..u64::from_le_bytes(take(&mut rest)?) {
            let mut center = [0.0; 3];
            for c in &mut center {
                *c = ((f64::from(i32::from_le_bytes(take(&mut rest)?)) + 0.5) * voxel_m) as f32;
            }
            centers.push(center);
        }
        for _ in 0..u64::from_le_bytes(take(&mut rest)?) {
            let mut arm = [[0.0; 4]; SPHERES];
            for number in arm.iter_mut().flatten() {
                *number = f32::from_le_bytes(take(&mut rest)?);
            }
            arms.push(arm);
            collides.push(f32::from_le_bytes(take(&mut rest)?) == 0.0);
        }
        Some(Self { voxel_m: voxel_m as f32, centers, arms, collides })
    }

    fn report(&self, how: &str, ask: impl Fn(&[Sphere; SPHERES]) -> bool) {
        let found: Vec<bool> = self.arms.iter().map(&ask).collect();
        let of = |told: bool, here: bool| {
            self.collides.iter().zip(&found).filter(|(a, b)| (**a, **b) == (told, here)).count()
        };
        let mut passes: Vec<f64> = (0..PASSES)
            .map(|_| {
                let start = Instant::now();
                self.arms.iter().for_each(|arm| {
                    black_box(ask(arm));
                });
                start.elapsed().as_nanos() as f64 / self.arms.len() as f64
            })
            .collect();
        passes.sort_by(f64::total_cmp);
        println!(
            "{how}: {:.0} ns a pose; {} collide here and there, {} there alone, {} here alone",
            passes[PASSES / 2],
            of(true, true),
            of(true, false),
            of(false, true)
        );
    }
}

fn take<const N: usize>(rest: &mut &[u8]) -> Option<[u8; N]> {
    let (number, after) = rest.split_first_chunk::<N>()?;
    *rest = after;
    Some(*number)
}
