//! Arrays of answers.

use mrol_client::map::{ContentHash, KeepOutName};
use mrol_client::planning::{Clearance, Frontier, Hit};
use mrol_client::service::{Collisions, MapVersion};
use mrol_client::voxel::VoxelKey;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::region::PoseFields;

/// Which state of a map an answer is of: revision, uuid, and the hash of its voxels.
pub(crate) type Version = (u64, String, Option<u64>);

/// The bits of an answer, as booleans.
pub(crate) type Bools<'py> = Bound<'py, PyArray1<bool>>;
/// Voxels i j k, shape (n, 3).
pub(crate) type Indices<'py> = Bound<'py, PyArray2<i32>>;

/// A version, as the package takes it.
pub(crate) fn told(version: &MapVersion) -> Version {
    let hash = version.content_hash.map(ContentHash::to_bits);
    (version.revision, version.map_uuid.to_string(), hash)
}

/// An answer: a dictionary of its fields by the names that they have over HTTP, and the version.
macro_rules! answer {
    ($py:expr, $version:expr, $($name:ident = $value:expr),* $(,)?) => {{
        let fields = pyo3::types::PyDict::new($py);
        fields.set_item(pyo3::intern!($py, "version"), crate::answers::told($version))?;
        $(fields.set_item(pyo3::intern!($py, stringify!($name)), $value)?;)*
        pyo3::PyResult::Ok(fields)
    }};
}
pub(crate) use answer;

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

/// The answer to a check of poses or spheres.
pub(crate) fn checked<'py>(
    py: Python<'py>,
    collisions: &Collisions,
    version: &MapVersion,
) -> PyResult<Bound<'py, PyDict>> {
    let words = collisions.words();
    let fields = answer!(
        py,
        version,
        checked = collisions.checked(),
        colliding = of_words(py, &words, collisions.checked()),
        colliding_count = ones(&words),
    )?;
    match collisions {
        Collisions::Colliding { .. } => {}
        Collisions::FirstHits(hits) => add_hits(&fields, hits)?,
        Collisions::Clearances(of) => add_clearances(&fields, of)?,
    }
    Ok(fields)
}

fn add_hits(fields: &Bound<'_, PyDict>, hits: &[Option<Hit>]) -> PyResult<()> {
    let py = fields.py();
    let number = |of: fn(&Hit) -> u32| {
        let numbers = hits.iter().map(|hit| hit.as_ref().map_or(-1, |hit| i64::from(of(hit))));
        PyArray1::from_vec(py, numbers.collect())
    };
    let voxel = |hit: &Option<Hit>| hit.as_ref().and_then(|hit| hit.met.voxel()).unwrap_or_default();
    let keep_outs: Vec<Option<KeepOutName>> =
        hits.iter().map(|hit| hit.as_ref().and_then(|hit| hit.met.keep_out()).cloned()).collect();
    fields.set_item("hit_links", number(|hit| hit.link))?;
    fields.set_item("hit_parts", number(|hit| hit.part))?;
    fields.set_item("hit_voxels", indices(py, hits.iter().map(voxel))?)?;
    fields.set_item("hit_keep_outs", names(&keep_outs))
}

fn add_clearances(fields: &Bound<'_, PyDict>, clearances: &[Clearance]) -> PyResult<()> {
    let py = fields.py();
    let distances_m = clearances.iter().map(|clearance| clearance.distance_m).collect();
    let links = clearances.iter().map(|clearance| clearance.link.map_or(-1, i64::from)).collect();
    fields.set_item("clearances_m", PyArray1::from_vec(py, distances_m))?;
    fields.set_item("nearest_links", PyArray1::<i64>::from_vec(py, links))
}

/// A frontier, by the names of its fields.
#[derive(IntoPyObject)]
pub(crate) struct FrontierFields {
    voxels: u64,
    center_m: [f64; 3],
    min_m: [f64; 3],
    max_m: [f64; 3],
    view: Option<ViewFields>,
}

/// Where a frontier can be seen from.
#[derive(IntoPyObject)]
struct ViewFields {
    map_from_view: PoseFields,
    target_m: [f64; 3],
    yaw_rad: f64,
    elevation_rad: f64,
}

impl FrontierFields {
    /// The fields of a frontier.
    pub(crate) fn of(frontier: &Frontier) -> Self {
        let Frontier { voxels, center_m, min_m, max_m, view } = *frontier;
        let view = view.map(|view| ViewFields {
            map_from_view: PoseFields::of(&view.map_from_view),
            target_m: view.target_m,
            yaw_rad: view.yaw_rad,
            elevation_rad: view.elevation_rad,
        });
        Self { voxels, center_m, min_m, max_m, view }
    }
}
