//! A room with a box in it that is taken away: what scans carve.

/// Half the sides of a room around the sensor, meters.
const ROOM_M: [f32; 3] = [3.03, 2.53, 1.24];
/// A box in it: smallest and largest corner.
pub const BOX_M: [[f32; 3]; 2] = [[1.23, -0.44, -0.53], [1.83, 0.44, 0.53]];

/// What a sensor in the middle of the room sees all around, with the box or without it.
pub fn room(has_box: bool) -> Vec<[f32; 3]> {
    let range_m = |direction: [f32; 3]| {
        let to_wall = (0..3).map(|axis| ROOM_M[axis] / direction[axis].abs()).fold(f32::INFINITY, f32::min);
        let ends = (0..3).map(|axis| {
            let ends = [BOX_M[0][axis] / direction[axis], BOX_M[1][axis] / direction[axis]];
            (ends[0].min(ends[1]), ends[0].max(ends[1]))
        });
        let (from, to) = ends.fold((0.0f32, f32::INFINITY), |(from, to), (a, b)| (from.max(a), to.min(b)));
        if has_box && from <= to { from.min(to_wall) } else { to_wall }
    };
    let directions = (0..180).flat_map(|i| (-44..=44).map(move |k| (i as f32 * 2.0 + 0.3, k as f32 * 2.0)));
    directions
        .map(|(azimuth, elevation)| {
            let ((sin, cos), (up, along)) =
                (azimuth.to_radians().sin_cos(), elevation.to_radians().sin_cos());
            let direction = [cos * along, sin * along, up];
            direction.map(|c| c * range_m(direction))
        })
        .collect()
}
