//! Encoding of the body of a map file, part by part, with a check of the stop signal after each part. The bytes are the
//! same as those of the whole message of `snapshot.proto`.

use prost::Message;
use prost::encoding::{WireType, encode_key, encode_varint, encoded_len_varint, key_len};

use super::body::number;
use super::snapshot::Snapshot;
use crate::codec::{moments, voxels};
use crate::pb;
use mrol_map::map::MapContents;
use mrol_map::util::StopSignal;
use mrol_map::visibility::ViewpointSet;

/// Records (scans and requests) between two checks of the stop signal: a millisecond.
const RECORDS_PER_STOP_CHECK: usize = 1024;
/// Numbers between two checks of the stop signal: a millisecond.
const NUMBERS_PER_STOP_CHECK: usize = 128 << 10;

/// Encodes the body of a snapshot with those of its viewpoints that are to be in it; incomplete once stopped.
pub(super) fn body_of(snapshot: &Snapshot, viewpoints: &ViewpointSet, stop: StopSignal<'_>) -> Vec<u8> {
    let Snapshot { uuid, settings, contents } = snapshot;
    let MapContents { revision, voxels, moments, trajectory, requests, keep_outs, .. } = contents;
    let mut body = pb::Snapshot {
        uuid: uuid.as_bytes().to_vec().into(),
        resolution_m: settings.resolution_m,
        levels: settings.levels,
        filter_hashes: settings.filter.map_or(0, |filter| filter.hashes),
        filter_bits_per_key: settings.filter.map_or(0.0, |filter| filter.bits_per_key),
        revision: *revision,
        ..pb::Snapshot::default()
    }
    .encode_to_vec();
    append(&mut body, trajectory.stored(), stop, |trajectory| pb::Snapshot {
        trajectory,
        ..Default::default()
    });
    append_voxels(&mut body, &voxels::write(voxels, stop), stop);
    append(&mut body, trajectory.withdrawn(), stop, |withdrawn| pb::Snapshot {
        withdrawn,
        ..Default::default()
    });
    append(&mut body, requests.iter(), stop, |requests| pb::Snapshot { requests, ..Default::default() });
    if settings.moments {
        append_moments(&mut body, &moments::beside(voxels, moments, stop), stop);
    }
    append(&mut body, trajectory.forgotten(), stop, |forgotten| pb::Snapshot {
        forgotten,
        ..Default::default()
    });
    append(&mut body, keep_outs.iter(), stop, |keep_outs| pb::Snapshot { keep_outs, ..Default::default() });
    let (no_filter, no_moments) = (settings.filter.is_none(), !settings.moments);
    body.append(&mut pb::Snapshot { no_filter, no_moments, ..Default::default() }.encode_to_vec());
    let viewpoints = viewpoints.iter().map(|(revision, viewpoint)| (revision, &**viewpoint));
    append(&mut body, viewpoints, stop, |viewpoints| pb::Snapshot { viewpoints, ..Default::default() });
    let origin = settings.origin.map(|origin| pb::MapOrigin { position_m: origin.position_m.to_vec() });
    let thinned_scans = trajectory.thinned();
    body.append(&mut pb::Snapshot { origin, thinned_scans, ..Default::default() }.encode_to_vec());
    body
}

/// Appends the messages of `items`, some at a time, each in the field that `snapshot_of` puts it in.
fn append<T: Into<R>, R>(
    body: &mut Vec<u8>,
    items: impl IntoIterator<Item = T>,
    stop: StopSignal<'_>,
    snapshot_of: impl Fn(Vec<R>) -> pb::Snapshot,
) {
    let mut items = items.into_iter();
    while !stop.is_stopped() {
        let records: Vec<R> = items.by_ref().take(RECORDS_PER_STOP_CHECK).map(Into::into).collect();
        if records.is_empty() {
            return;
        }
        body.append(&mut snapshot_of(records).encode_to_vec());
    }
}

fn append_voxels(body: &mut Vec<u8>, voxels: &pb::Voxels, stop: StopSignal<'_>) {
    let gaps = Packed::of(number::KEY_GAPS, &voxels.key_gaps, |gap| *gap, stop);
    begin_message(body, number::VOXELS, gaps.len() + len_of_bytes(number::OCTREES, &voxels.octrees));
    gaps.append_to(body, stop);
    append_bytes(body, number::OCTREES, &voxels.octrees);
}

fn append_moments(body: &mut Vec<u8>, moments: &pb::Moments, stop: StopSignal<'_>) {
    let gaps = Packed::of(number::KEY_GAPS, &moments.key_gaps, |gap| *gap, stop);
    let numbers = Packed::of(number::NUMBERS, &moments.numbers, |number| zigzag(*number), stop);
    let bytes = [(number::FORMS, &moments.forms), (number::POINTS, &moments.points)];
    let length = bytes.iter().map(|(number, bytes)| len_of_bytes(*number, bytes)).sum::<usize>();
    begin_message(body, number::MOMENTS, gaps.len() + numbers.len() + length);
    gaps.append_to(body, stop);
    numbers.append_to(body, stop);
    bytes.iter().for_each(|(number, bytes)| append_bytes(body, *number, bytes));
}

/// Appends the key and length of a message field.
fn begin_message(body: &mut Vec<u8>, number: u64, length: usize) {
    body.reserve_exact(length + 16);
    encode_key(number as u32, WireType::LengthDelimited, body);
    encode_varint(length as u64, body);
}

fn append_bytes(body: &mut Vec<u8>, number: u64, bytes: &[u8]) {
    if !bytes.is_empty() {
        encode_key(number as u32, WireType::LengthDelimited, body);
        encode_varint(bytes.len() as u64, body);
        body.extend_from_slice(bytes);
    }
}

/// Encoded size of a field of bytes.
fn len_of_bytes(number: u64, bytes: &[u8]) -> usize {
    len_of_field(number, bytes.len())
}

/// Encoded size of a field whose content has `length` bytes; 0 where it is empty, since it is then left out.
fn len_of_field(number: u64, length: usize) -> usize {
    if length == 0 { 0 } else { key_len(number as u32) + encoded_len_varint(length as u64) + length }
}

fn zigzag(number: i64) -> u64 {
    ((number << 1) ^ (number >> 63)) as u64
}

/// A field of packed varints.
struct Packed<'a, T> {
    number: u64,
    values: &'a [T],
    varint: fn(&T) -> u64,
    /// Encoded size of the values, bytes.
    bytes: usize,
}

impl<'a, T> Packed<'a, T> {
    fn of(number: u64, values: &'a [T], varint: fn(&T) -> u64, stop: StopSignal<'_>) -> Self {
        let bytes_of = |values: &[T]| values.iter().map(|it| encoded_len_varint(varint(it))).sum::<usize>();
        let bytes = stop.pieces(values, NUMBERS_PER_STOP_CHECK).map(bytes_of).sum();
        Self { number, values, varint, bytes }
    }

    /// Encoded size of the field, bytes.
    fn len(&self) -> usize {
        len_of_field(self.number, self.bytes)
    }

    fn append_to(&self, body: &mut Vec<u8>, stop: StopSignal<'_>) {
        if self.bytes > 0 {
            encode_key(self.number as u32, WireType::LengthDelimited, body);
            encode_varint(self.bytes as u64, body);
            for values in stop.pieces(self.values, NUMBERS_PER_STOP_CHECK) {
                values.iter().for_each(|value| encode_varint((self.varint)(value), body));
            }
        }
    }
}
