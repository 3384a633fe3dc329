//! Arrays of answers.

use mrol_client::map::KeepOutName;
use mrol_client::planning::{Clearance, Hit};
use mrol_client::service::{Collisions, MapVersion};
use mrol_client::voxel::VoxelKey;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;

/// Which state of a map an answer is of: revision, uuid, and the hash in hexadecimal digits.
pub(crate) type Version = (u64, String, Option<String>);

/// The bits of an answer, as booleans.
pub(crate) type Bools<'py> = Bound<'py, PyArray1<bool>>;
/// Voxels i j k, shape (n, 3).
pub(crate) type Indices<'py> = Bound<'py, PyArray2<i32>>;

/// A version, as the package takes it.
pub(crate) fn told(version: &MapVersion) -> Version {
    let hash = version.content_hash.map(|hash| hash.to_string());
    (version.revision, version.map_uuid.to_string(), hash)
}

/// The bits of each byte, lowest first.
const BITS: [[bool; 8]; 256] = {
    let mut bits = [[false; 8]; 256];
    let mut i = 0;
    while i < 8 * bits.len() {
        bits[i / 8][i % 8] = ((i / 8) >> (i % 8)) & 1 == 1;
        i += 1;
    }
    bits
};

/// Bit i % 8 of byte i / 8, as booleans.
pub(crate) fn of_bytes<'py>(py: Python<'py>, bytes: &[u8], count: usize) -> Bools<'py> {
    of_eights(py, bytes.iter().copied(), count)
}

/// Bit i % 64 of word i / 64, as booleans.
pub(crate) fn of_words<'py>(py: Python<'py>, words: &[u64], count: usize) -> Bools<'py> {
    of_eights(py, words.iter().flat_map(|word| word.to_le_bytes()), count)
}

fn of_eights<'py>(py: Python<'py>, bytes: impl Iterator<Item = u8>, count: usize) -> Bools<'py> {
    let mut bools = Vec::with_capacity(count.next_multiple_of(64));
    bytes.for_each(|byte| bools.extend_from_slice(&BITS[usize::from(byte)]));
    bools.truncate(count);
    PyArray1::from_vec(py, bools)
}

/// How many bits are set.
pub(crate) fn ones(words: &[u64]) -> usize {
    words.iter().map(|word| word.count_ones() as usize).sum()
}

/// The indices of voxels.
pub(crate) fn indices<'py>(
    py: Python<'py>,
    voxels: impl ExactSizeIterator<Item = VoxelKey>,
) -> PyResult<Indices<'py>> {
    let count = voxels.len();
    let numbers: Vec<i32> = voxels.flat_map(VoxelKey::index).collect();
    PyArray1::from_vec(py, numbers).reshape([count, 3])
}

/// The names of keep-outs, where there is any: a list of text and None; none where there is no name at all.
pub(crate) fn names(keep_outs: &[Option<KeepOutName>]) -> Option<Vec<Option<String>>> {
    let name = |name: &Option<KeepOutName>| name.as_ref().map(|name| name.as_str().to_owned());
    keep_outs.iter().any(Option::is_some).then(|| keep_outs.iter().map(name).collect())
}

/// What is met first: links, parts, voxels, keep-outs.
type FirstHits<'py> =
    (Bound<'py, PyArray1<i64>>, Bound<'py, PyArray1<i64>>, Indices<'py>, Option<Vec<Option<String>>>);

/// How much room there is: distances and the nearest links.
type Clearances<'py> = (Bound<'py, PyArray1<f32>>, Bound<'py, PyArray1<i64>>);

/// An answer to a check of poses or spheres.
pub(crate) type Checked<'py> = (Bools<'py>, usize, Option<FirstHits<'py>>, Option<Clearances<'py>>, Version);

/// The answer to a check of poses or spheres.
pub(crate) fn checked<'py>(
    py: Python<'py>,
    collisions: &Collisions,
    version: &MapVersion,
) -> PyResult<Checked<'py>> {
    let words = collisions.words();
    let (mut first_hits, mut clearances) = (None, None);
    match collisions {
        Collisions::Colliding { .. } => {}
        Collisions::FirstHits(hits) => first_hits = Some(of_hits(py, hits)?),
        Collisions::Clearances(of) => clearances = Some(of_clearances(py, of)),
    }
    let colliding = of_words(py, &words, collisions.checked());
    Ok((colliding, ones(&words), first_hits, clearances, told(version)))
}

fn of_hits<'py>(py: Python<'py>, hits: &[Option<Hit>]) -> PyResult<FirstHits<'py>> {
    let number = |of: fn(&Hit) -> u32| {
        let numbers = hits.iter().map(|hit| hit.as_ref().map_or(-1, |hit| i64::from(of(hit))));
        PyArray1::from_vec(py, numbers.collect())
    };
    let voxel = |hit: &Option<Hit>| hit.as_ref().and_then(|hit| hit.met.voxel()).unwrap_or_default();
    let voxels = indices(py, hits.iter().map(voxel))?;
    let keep_outs: Vec<Option<KeepOutName>> =
        hits.iter().map(|hit| hit.as_ref().and_then(|hit| hit.met.keep_out()).cloned()).collect();
    Ok((number(|hit| hit.link), number(|hit| hit.part), voxels, names(&keep_outs)))
}

fn of_clearances<'py>(py: Python<'py>, clearances: &[Clearance]) -> Clearances<'py> {
    let distances_m = clearances.iter().map(|clearance| clearance.distance_m).collect();
    let links = clearances.iter().map(|clearance| clearance.link.map_or(-1, i64::from)).collect();
    (PyArray1::from_vec(py, distances_m), PyArray1::from_vec(py, links))
}
