//! Planners' questions: a program in C answers as gRPC does, bit for bit.

use std::fmt::Write as _;
use std::sync::Arc;

use mrol_client::Client;
use mrol_client::map::{KeepOutName, KeepOutShape, Region};
use mrol_client::planning::{BandFrom, Body, GridArea, Link, MeasuredTo, Sphere, Surroundings, Unknown};
use mrol_client::service::{
    AtVersion, CheckAs, Collisions, GridQuestion, GridScope, MapVersion, MotionCheck, NearestQuestion,
    PoseCheck, PutKeepOut, QuestionScope, RayQuestion, RaysToward, SphereCheck,
};

use super::{Driver, Linked, Server, insert, make_map, map, row};

/// Two links: two balls and a point, and a padded point.
fn body() -> Body {
    let sphere = |x: f32, radius_m: f32| Sphere { center_m: [x, 0.0, 0.0], radius_m };
    let first = Link {
        spheres: vec![sphere(0.0, 0.06), sphere(0.2, 0.11)],
        points: vec![[0.3, 0.0, 0.0].into()],
        padding_m: 0.0,
    };
    let second = Link { points: vec![[0.0, 0.1, 0.0].into()], padding_m: 0.05, ..Link::default() };
    Body::new(vec![first, second]).unwrap()
}

const BODY: &str = "body 2 2 0 0 0 0.06 0.2 0 0 0.11 1 0.3 0 0 0 0 1 0 0.1 0 0.05";

/// Poses of two links at 24 places above and in the row of voxels.
fn configurations() -> Vec<f32> {
    let at = |x: f32, y: f32| [x, y, 0.05, 0.0, 0.0, 0.6, 0.8];
    (0..24)
        .flat_map(|i| {
            let (x, y) = ((i % 6) as f32 * 0.5 - 0.3, (i / 6) as f32 * 0.12);
            [at(x, y), at(x + 0.1, y + 0.1)].concat()
        })
        .collect()
}

fn listed(numbers: &[f32]) -> String {
    numbers.iter().map(|number| format!(" {number}")).collect()
}

/// A line as the program prints it.
struct Line(String);

impl Line {
    fn of(version: MapVersion, asked: usize, positive: usize) -> Self {
        Self(format!("{} {asked} {positive}", version.revision))
    }

    fn bits(mut self, words: &[u64], count: usize) -> Self {
        let bytes = words.iter().flat_map(|word| word.to_le_bytes()).take(count.div_ceil(8));
        let bits: String = bytes.map(|byte| format!("{byte:02x}")).collect();
        write!(self.0, " {bits}").unwrap();
        self
    }

    fn floats(self, floats: impl IntoIterator<Item = f32>) -> Self {
        self.words(floats.into_iter().map(f32::to_bits))
    }

    fn words(mut self, words: impl IntoIterator<Item = u32>) -> Self {
        words.into_iter().for_each(|word| write!(self.0, " {word:08x}").unwrap());
        self
    }

    fn names<'a>(mut self, names: impl IntoIterator<Item = Option<&'a KeepOutName>>) -> Self {
        names
            .into_iter()
            .for_each(|name| write!(self.0, " {}", name.map_or("-", |name| name.as_str())).unwrap());
        self
    }

    fn voxels(mut self, voxels: impl IntoIterator<Item = u64>) -> Self {
        voxels.into_iter().for_each(|voxel| write!(self.0, " {voxel:016x}").unwrap());
        self
    }
}

fn collisions(told: AtVersion<Collisions>) -> String {
    let (words, checked) = (told.answer.words(), told.answer.checked());
    let line = Line::of(told.version, checked, ones(&words)).bits(&words, checked);
    match told.answer {
        Collisions::Colliding { .. } => line,
        Collisions::FirstHits(hits) => {
            line.words(hits.iter().map(|hit| hit.as_ref().map_or(u32::MAX, |hit| hit.link)))
                .words(hits.iter().map(|hit| hit.as_ref().map_or(0, |hit| hit.part)))
                .voxels(hits.iter().map(|hit| {
                    hit.as_ref().and_then(|hit| hit.met.voxel()).map_or(0, |voxel| voxel.to_bits())
                }))
                .names(hits.iter().map(|hit| hit.as_ref().and_then(|hit| hit.met.keep_out())))
        }
        Collisions::Clearances(clearances) => line
            .floats(clearances.iter().map(|clearance| clearance.distance_m))
            .words(clearances.iter().map(|clearance| clearance.link.unwrap_or(u32::MAX))),
    }
    .0
}

fn ones(words: &[u64]) -> usize {
    words.iter().map(|word| word.count_ones() as usize).sum()
}

/// Kinds of checks, as the program numbers them, with its word for how far clearances are told.
const KINDS: [(u32, CheckAs, &str); 4] = [
    (0, CheckAs::Colliding, "0"),
    (1, CheckAs::FirstHit, "0"),
    (2, CheckAs::Clearance { most_m: None }, "0"),
    (2, CheckAs::Clearance { most_m: Some(0.25) }, "0.25"),
];

async fn bodies(driver: &mut Driver, client: &Client, asked: QuestionScope) {
    let (level, numbers) = (asked.level, configurations());
    let spheres: Vec<f32> = numbers.chunks(7).flat_map(|pose| [pose[0], pose[1], 0.05, 0.13]).collect();
    for (kind, answer, most) in KINDS {
        let check = PoseCheck {
            asked,
            body: Arc::new(body()),
            configurations: numbers.clone(),
            surroundings: Surroundings::default(),
            answer,
        };
        let told = client.check_poses(&map(), check).await.unwrap();
        assert!(told.answer.words()[0] != 0, "something is met");
        let command = format!("poses {kind} {level} {most} 24{}", listed(&numbers));
        assert_eq!(driver.told(&command), collisions(told));
        let check = SphereCheck {
            asked,
            spheres: spheres
                .as_chunks()
                .0
                .iter()
                .map(|&[x, y, z, radius_m]| Sphere { center_m: [x, y, z], radius_m })
                .collect(),
            sizes: vec![1; spheres.len() / 4],
            padding_m: 0.0,
            surroundings: Surroundings::default(),
            answer,
        };
        let command = format!("spheres {kind} {level} {most} {}{}", spheres.len() / 4, listed(&spheres));
        assert_eq!(driver.told(&command), collisions(client.check_spheres(&map(), check).await.unwrap()));
    }
}

async fn motions(driver: &mut Driver, client: &Client, asked: QuestionScope) {
    for clearance_max_m in [None, Some(0.25)] {
        let check = MotionCheck {
            asked,
            body: Arc::new(body()),
            configurations: configurations(),
            lengths: vec![2; 12],
            step_m: None,
            clearance_max_m,
            surroundings: Surroundings::default(),
        };
        let told = client.check_motions(&map(), check).await.unwrap();
        let free = told.answer.iter().filter(|motion| motion.is_free()).count();
        assert!(free > 0 && free < 12, "some are free, and some are not");
        let word =
            told.answer.iter().rev().fold(0u64, |word, motion| word << 1 | u64::from(motion.is_free()));
        let line = Line::of(told.version, 12, free)
            .bits(&[word], 12)
            .floats(told.answer.iter().map(|motion| motion.first_hit.unwrap_or(f32::NAN)))
            .floats(told.answer.iter().filter_map(|motion| motion.clearance_m));
        let kind = if clearance_max_m.is_some() { 2 } else { 0 };
        let most = clearance_max_m.unwrap_or_default();
        let command = format!("motions {kind} {} {most} 24{}", asked.level, listed(&configurations()));
        assert_eq!(driver.told(&command), line.0);
    }
}

async fn rays_and_points(driver: &mut Driver, client: &Client, asked: QuestionScope) {
    let origins: Vec<[f32; 3]> = (0..20).map(|i| [i as f32 * 0.2 - 1.0, 1.0, 0.05]).collect();
    let directions: Vec<[f32; 3]> =
        (0..20).map(|i| if i % 3 == 0 { [0.0, 1.0, 0.0] } else { [0.6, -0.8, 0.0] }).collect();
    let both: Vec<f32> = origins.iter().zip(&directions).flat_map(|(a, b)| [*a, *b].concat()).collect();
    let points = |points: &[[f32; 3]]| points.iter().map(|xyz| (*xyz).into()).collect::<Vec<_>>().into();
    let toward = RaysToward::Directions { directions: points(&directions), range_m: 5.0 };
    let told = client
        .cast_rays(&map(), RayQuestion { asked, origins: points(&origins), toward, unknown: Unknown::Free })
        .await
        .unwrap();
    assert!(told.answer.hits() > 0);
    let line = Line::of(told.version, 20, told.answer.hits())
        .bits(&told.answer.hit, 20)
        .floats(told.answer.distances_m.iter().copied())
        .voxels(told.answer.voxels.iter().map(|voxel| voxel.to_bits()))
        .names((0..20).map(|i| told.answer.keep_outs.get(i).and_then(Option::as_ref)));
    assert_eq!(driver.told(&format!("rays {} 5 20{}", asked.level, listed(&both))), line.0);
    for (to, word) in [(MeasuredTo::Cubes, 0), (MeasuredTo::Centers, 1)] {
        let question = NearestQuestion { asked, points: points(&origins), radius_m: 1.2, to };
        let told = client.find_nearest(&map(), question).await.unwrap();
        assert!(told.answer.count() > 0);
        let line = Line::of(told.version, 20, told.answer.count())
            .bits(&told.answer.found, 20)
            .floats(told.answer.distances_m.iter().copied())
            .voxels(told.answer.voxels.iter().map(|voxel| voxel.to_bits()))
            .floats(told.answer.away.iter().flatten().copied())
            .names((0..20).map(|i| told.answer.keep_outs.get(i).and_then(Option::as_ref)));
        let command = format!("nearest {} {word} 1.2 20{}", asked.level, listed(origins.as_flattened()));
        assert_eq!(driver.told(&command), line.0);
    }
}

async fn grids(driver: &mut Driver, client: &Client, asked: QuestionScope) {
    let scope = GridScope {
        area: GridArea::Occupied,
        band_m: [-1.0, 2.0],
        band_from: BandFrom::Map,
        cell_m: None,
        tells_unknown: false,
    };
    let told = client.project_grid(&map(), GridQuestion { asked, scope }).await.unwrap();
    let (grid, [x, y]) = (&told.answer, told.answer.size);
    assert!(grid.cells() > 0);
    let mut line = Line::of(told.version, grid.cells(), ones(&grid.occupied));
    write!(line.0, " {x} {y} {} {} {}", grid.cell_m, grid.origin_m[0], grid.origin_m[1]).unwrap();
    let line = line.bits(&grid.occupied, grid.cells()).floats(grid.tops_m.iter().copied());
    assert_eq!(driver.told(&format!("grid {} -1 2", asked.level)), line.0);
}

async fn questions(driver: &mut Driver, client: &Client, asked: QuestionScope) {
    bodies(driver, client, asked).await;
    motions(driver, client, asked).await;
    rays_and_points(driver, client, asked).await;
    grids(driver, client, asked).await;
}

async fn a_c_planner_is_answered_as_grpc_answers(linked: Linked) {
    let server = Server::start(&format!("planning-{linked:?}"));
    let client = server.client().await;
    make_map(&client).await;
    insert(&client, row(15)).await;
    let mut driver = Driver::start("planner.c", linked);
    assert_eq!(driver.told(&format!("open {} a", server.grpc)), "MROL_OK");
    assert_eq!(driver.told(BODY), "MROL_OK");
    for level in 0..3 {
        questions(&mut driver, &client, QuestionScope { level, ..QuestionScope::default() }).await;
    }
    let ball = KeepOutShape::of_region(Region::ball([0.9, 0.45, 0.05], 0.16).unwrap()).unwrap();
    let name = KeepOutName::new("crate").unwrap();
    let put = PutKeepOut { name, shape: ball, expires_at_ns: None, request_id: None };
    let revision = client.put_keep_out(&map(), put).await.unwrap().version.revision;
    assert_eq!(driver.told(&format!("wait {revision}")), "MROL_OK");
    assert!(driver.told("nearest 0 0 1 1 0.9 0.7 0.05").ends_with(" crate"));
    for ignore_keep_outs in [false, true] {
        driver.does(&format!("ignore {}", u8::from(ignore_keep_outs)));
        questions(&mut driver, &client, QuestionScope { ignore_keep_outs, ..QuestionScope::default() }).await;
    }
    let refused = driver.told("nearest 0 0 100 1 0 0 0");
    assert!(refused.starts_with("MROL_INVALID_ARGUMENT bad_radius: radius_m must lie above 0"), "{refused}");
    driver.end();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_planner_with_the_shared_library_is_answered_as_grpc_answers() {
    a_c_planner_is_answered_as_grpc_answers(Linked::Dynamically).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_planner_under_the_address_sanitizer_is_answered_as_grpc_answers() {
    a_c_planner_is_answered_as_grpc_answers(Linked::Sanitized).await;
}
