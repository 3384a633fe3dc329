//! Map files that are small, and become much when they are read.

/// Sub-messages of a file.
const MANY: usize = 4_000_000;
/// Blocks of a row that ascends by one along x.
const ROW: u64 = 1 << 17;

/// A varint.
fn varint(mut value: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    while value >= 128 {
        bytes.push(value as u8 | 128);
        value >>= 7;
    }
    bytes.push(value as u8);
    bytes
}

/// A field of bytes, by its tag.
fn field(tag: u8, bytes: &[u8]) -> Vec<u8> {
    [&[tag][..], &varint(bytes.len() as u64), bytes].concat()
}

/// The first fields of a body: uuid, resolution, levels, filter and revision.
fn settings(levels: u8, bits_per_key: f64) -> Vec<u8> {
    let number = |tag: u8, value: f64| [&[tag][..], &value.to_le_bytes()].concat();
    let bits = number(0x29, bits_per_key);
    [&field(0x0a, &[7; 16])[..], &number(0x11, 0.05), &[0x18, levels, 0x20, 1], &bits, &[0x30, 1]].concat()
}

/// `blocks` of one voxel each, one after another along x.
fn voxels(blocks: u64) -> Vec<u8> {
    let row_end = (1 << 21) - (ROW - 1);
    let gaps = (0..blocks).flat_map(|i| match i {
        0 => vec![0],
        _ if i % ROW == 0 => varint(row_end),
        _ => vec![1],
    });
    let gaps: Vec<u8> = gaps.collect();
    field(0x52, &[field(0x0a, &gaps), field(0x12, &[1; 3].repeat(blocks as usize))].concat())
}

/// Viewpoints of one revision after another, whose images have as many tiles as there may be, and none of them seen.
fn viewpoints(count: u64) -> Vec<u8> {
    const TILES: u8 = 100;
    let mut image = vec![0; 5 + (6 * usize::from(TILES) * usize::from(TILES)).div_ceil(8)];
    image[0] = TILES;
    image[1..5].copy_from_slice(&1f32.to_le_bytes());
    let numbers = [0.0f64, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0].map(f64::to_le_bytes).concat();
    let rest = [field(0x12, &numbers), field(0x1a, &image)].concat();
    let viewpoint = |revision| [&[0x08][..], &varint(revision), &rest].concat();
    // The tag of field 18 takes two bytes.
    let of_map = |revision| [&[0x92][..], &field(0x01, &viewpoint(revision))].concat();
    (1..=count).flat_map(of_map).collect()
}

/// A map file of version 3 around a body.
fn file(body: &[u8]) -> Vec<u8> {
    let compressed = zstd::bulk::compress(body, 3).unwrap();
    let version = 3u32.to_le_bytes();
    let checked = [&(body.len() as u64).to_le_bytes()[..], &compressed].concat();
    let checksum = crc32c::crc32c_append(crc32c::crc32c(&version), &checked).to_le_bytes();
    [b"MROL-MAP", &version[..], &checksum, &checked].concat()
}

/// Files by what is wrong with them.
pub(crate) fn hostile_files() -> Vec<(&'static str, Vec<u8>)> {
    let map = settings(4, 14.0);
    let repeated = |field: &[u8]| file(&[&map[..], &field.repeat(MANY)].concat());
    // Of `voxels` and `moments`, which are joined where they come again: numbers of a byte, and one by one.
    let packed = |tag, inner| file(&[&map[..], &field(tag, &field(inner, &vec![2; 4 * MANY]))].concat());
    let single = |tag, inner: u8| file(&[&map[..], &field(tag, &[inner, 2].repeat(2 * MANY))].concat());
    vec![
        ("empty poses", repeated(&[0x4a, 0])),
        ("empty withdrawn scans", repeated(&[0x5a, 0])),
        ("empty requests", repeated(&[0x62, 0])),
        ("voxels again and again", repeated(&[0x52, 0])),
        ("key gaps", packed(0x52, 0x0a)),
        ("key gaps one by one", single(0x52, 0x08)),
        ("numbers of moments", packed(0x6a, 0x12)),
        ("numbers of moments one by one", single(0x6a, 0x10)),
        ("numbers of a pose", file(&[&map[..], &field(0x4a, &field(0x32, &vec![0; 64 << 20]))].concat())),
        // Bytes that are copied out of the body.
        ("octrees of no block", file(&[&map[..], &field(0x52, &field(0x12, &vec![0; 48 << 20]))].concat())),
        ("forms and points of no voxel", {
            let copied = [field(0x1a, &vec![0; 24 << 20]), field(0x22, &vec![0; 24 << 20])].concat();
            file(&[&map[..], &field(0x6a, &copied)].concat())
        }),
        ("empty viewpoints", repeated(&[0x92, 0x01, 0])),
        ("viewpoints that saw nothing", {
            file(&[&map[..], &[0x30], &varint(1 << 20), &viewpoints(10_000)].concat())
        }),
        ("unknown fields", repeated(&[0x7a, 0])),
        ("blocks of one voxel", file(&[&map[..], &voxels(1_000_000)].concat())),
        ("wide filters of a few voxels", file(&[settings(12, 4096.0), voxels(20_000)].concat())),
        ("zeros", file(&vec![0; 768 << 20])),
    ]
}
