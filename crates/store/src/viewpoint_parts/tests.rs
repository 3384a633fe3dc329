//! Parts over long histories, and parts that are damaged.

use std::sync::Arc;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use uuid::Uuid;

use super::file::{ViewpointPart, part_names};
use super::known_part::KnownPart;
use super::loading::{LoadedParts, load};
use super::plan::ViewpointParts;
use super::uses::{PartUse, section_of, uses_in};
use crate::error::StoreError;
use crate::file_system::Disk;
use crate::folder;
use mrol_map::geometry::{Point, Pose};
use mrol_map::util::StopSignal;
use mrol_map::visibility::{RangeImage, Sweep, Viewpoint, ViewpointSet};

const MAP: Uuid = Uuid::from_u128(7);

/// A viewpoint of some hundred bytes.
fn viewpoint(x: f64) -> Arc<Viewpoint> {
    let points: Vec<_> = (0..300).map(|i| Point::new(2.0, (i % 20) as f32 / 9.0, 0.3)).collect();
    let image = RangeImage::of_points(&points, Sweep::standing(9.0), 700).unwrap();
    Arc::new(Viewpoint::new(Pose::translation(x, 0.0, 0.0), image))
}

/// Parts as a folder keeps them.
struct Folder {
    at: tempfile::TempDir,
    known: ViewpointParts,
    uses: Vec<PartUse>,
    /// Viewpoints that were written, each time.
    written: usize,
}

impl Folder {
    fn new() -> Self {
        let (at, known) = (tempfile::tempdir().unwrap(), ViewpointParts::default());
        Self { at, known, uses: Vec::new(), written: 0 }
    }

    /// What a snapshot does.
    fn save(&mut self, viewpoints: &ViewpointSet) {
        let plan = self.known.plan(viewpoints);
        let (written, bytes) = plan.new_part(viewpoints, MAP).unwrap().unzip();
        self.uses = uses_in(&section_of(&plan.uses(written.as_ref()))).unwrap();
        if let (Some(part), Some(bytes)) = (&written, bytes) {
            for path in part_names(part.number).map(|name| self.at.path().join(name)) {
                assert!(!path.exists(), "a number comes twice");
                folder::replace(&Disk::default(), &path, &bytes).unwrap();
            }
            self.written += part.stored.len();
        }
        self.known.use_up_number(&plan);
        self.known.note_written(plan, written);
    }

    fn load(&self) -> Result<ViewpointSet, StoreError> {
        Ok(self.load_all()?.viewpoints)
    }

    fn load_all(&self) -> Result<LoadedParts, StoreError> {
        load(&Disk::default(), self.at.path(), MAP, &self.uses, StopSignal::NEVER)
    }
}

#[test]
fn a_viewpoint_is_written_a_few_times_whatever_comes_and_goes_between_snapshots() {
    let one = viewpoint(1.0);
    for seed in 0..2 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let (mut folder, mut viewpoints, mut revision) = (Folder::new(), ViewpointSet::default(), 0);
        for _ in 0..60 {
            for _ in 0..random.random_range(0..12) {
                revision += random.random_range(1..4);
                viewpoints.insert(revision, one.clone());
            }
            // More come than go at first, and then as many.
            let most = if revision > 400 { 14 } else { 4 };
            for _ in 0..random.random_range(0..most) {
                let all: Vec<u64> = viewpoints.iter().map(|(revision, _)| revision).collect();
                if !all.is_empty() {
                    viewpoints.remove(all[random.random_range(0..all.len())]);
                }
            }
            folder.save(&viewpoints);
            assert!(folder.load().unwrap() == viewpoints);
            assert!(folder.uses.len() <= 12, "{} parts", folder.uses.len());
            let there: u64 = folder.known.parts.iter().map(KnownPart::bytes).sum();
            assert!(there <= 2 * viewpoints.stored_bytes() as u64, "more than half is of no use");
        }
        assert!(revision > 400);
        assert!(folder.written < 8 * revision as usize, "{} for {revision}", folder.written);
    }
}

#[test]
fn nothing_is_written_where_nothing_came() {
    let (mut folder, mut viewpoints) = (Folder::new(), ViewpointSet::default());
    (1..=100).for_each(|revision| viewpoints.insert(revision, viewpoint(revision as f64)));
    folder.save(&viewpoints);
    viewpoints.remove(17);
    folder.save(&viewpoints);
    assert_eq!((folder.written, folder.uses.len()), (100, 1));
    assert!(folder.load().unwrap() == viewpoints);
    viewpoints.insert(101, viewpoint(0.0));
    folder.save(&viewpoints);
    assert_eq!((folder.written, folder.uses.len()), (101, 2));
    (1..=60).for_each(|revision| drop(viewpoints.remove(revision)));
    folder.save(&viewpoints);
    assert_eq!((folder.written, folder.uses.len()), (141, 2), "most of the part was of no use");
    viewpoints = ViewpointSet::default();
    folder.save(&viewpoints);
    assert_eq!((folder.written, folder.uses.len()), (141, 0));
    assert!(folder.load().unwrap().is_empty());
}

#[test]
fn a_part_that_is_damaged_missing_or_another_is_told_by_name() {
    let (mut folder, mut viewpoints) = (Folder::new(), ViewpointSet::default());
    viewpoints.insert(1, viewpoint(1.0));
    viewpoints.insert(2, viewpoint(2.0));
    folder.save(&viewpoints);
    let [path, copy] = part_names(1).map(|name| folder.at.path().join(name));
    let bytes = std::fs::read(&path).unwrap();
    for bit in 0..bytes.len() * 8 {
        let mut damaged = bytes.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert!(ViewpointPart::decode(&damaged, StopSignal::NEVER).is_err(), "bit {bit}");
    }
    for length in 0..bytes.len() {
        assert!(ViewpointPart::decode(&bytes[..length], StopSignal::NEVER).is_err(), "cut at {length}");
    }
    let refused = |folder: &Folder| folder.load().unwrap_err().to_string();
    std::fs::write(&path, &bytes[..30]).unwrap();
    let LoadedParts { viewpoints: read, known, damaged } = folder.load_all().unwrap();
    assert!(read == viewpoints && known.is_empty() && damaged.len() == 1, "the copy stands in for it");
    // As where a sector cannot be read: a folder cannot be.
    std::fs::remove_file(&path).unwrap();
    std::fs::create_dir(&path).unwrap();
    assert!(folder.load().unwrap() == viewpoints, "the copy stands in for what cannot be read");
    std::fs::remove_dir(&path).unwrap();
    std::fs::write(&path, &bytes[..30]).unwrap();
    std::fs::remove_file(&copy).unwrap();
    assert!(refused(&folder).ends_with("000001.part: 30 bytes are too few for the header of a part"));
    std::fs::remove_file(&path).unwrap();
    assert!(refused(&folder).ends_with("000001.part: a snapshot names it, and it is missing"));
    // One that is well, and not the one that is meant.
    viewpoints.remove(2);
    let other = ViewpointPart::new(vec![(1, viewpoint(1.0))]);
    let (_, others) = other.clone().encode(MAP).unwrap();
    std::fs::write(&path, &others).unwrap();
    assert!(refused(&folder).contains("a snapshot says"));
    let (other, others) = other.encode(MAP).unwrap();
    std::fs::write(&path, others).unwrap();
    folder.uses[0].checksum = other.checksum;
    assert!(refused(&folder).ends_with("it has no viewpoint of revision 2, which a snapshot names"));
    let (other, others) = other.encode(Uuid::from_u128(8)).unwrap();
    std::fs::write(&path, others).unwrap();
    folder.uses[0] = PartUse { checksum: other.checksum, revisions: vec![1], ..folder.uses[0].clone() };
    assert!(matches!(folder.load(), Err(StoreError::Foreign { .. })));
}

#[test]
fn what_a_snapshot_says_of_its_parts_makes_sense() {
    let part = |number, revisions: &[u64]| PartUse { number, checksum: 1, revisions: revisions.to_vec() };
    let refused = |uses: &[PartUse]| uses_in(&section_of(uses)).unwrap_err();
    assert!(refused(&[part(2, &[1]), part(1, &[2])]).contains("must ascend"));
    assert!(
        refused(&[part(1, &[1, 5]), part(2, &[5])]).contains("two parts have the viewpoint of revision 5")
    );
    assert!(uses_in(&[255]).is_err());
}
