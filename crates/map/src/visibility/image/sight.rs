//! Sight: what a scan tells of a point, from its image alone.

use crate::visibility::directions::{CubeMap, Pixel, Projection};

/// What a scan tells of a point, by what it saw in the directions around it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sight {
    /// Something was met there.
    Agrees,
    /// Everything that was met lies farther away: nothing was there.
    Contradicts,
    /// Something before it was in the way.
    Hidden,
    /// Nobody looked there.
    NotSeen,
}

/// Pixels on each side of a point's own in which it is looked for: what was met lies up to a pixel beside where it is
/// seen.
const BESIDE: isize = 1;

/// The sight of the point at `offset` from the sensor, in its frame, by an image whose pixels were seen to the depths
/// that `depth_m` tells. Depths that differ by `tolerance_m` or less are the same.
#[inline(always)]
pub(in crate::visibility) fn sight(
    map: CubeMap,
    depth_m: impl Fn(Pixel) -> Option<f32>,
    offset: [f32; 3],
    tolerance_m: f32,
) -> Sight {
    let Some(Projection { face, pixel, depth_m: own_m }) = map.project(offset) else { return Sight::NotSeen };
    let mut nearest_m = f32::INFINITY;
    for up in -BESIDE..=BESIDE {
        for right in -BESIDE..=BESIDE {
            let Some(beside) = map.beside((face, pixel), [right, up]) else { continue };
            let Some(seen_m) = depth_m(beside) else { continue };
            // On another face it is as deep as it lies along that face's axis.
            let own_m = if beside.0 == face { own_m } else { map.depth_on(beside.0, offset) };
            if (seen_m - own_m).abs() <= tolerance_m {
                return Sight::Agrees;
            }
            nearest_m = nearest_m.min(seen_m - own_m);
        }
    }
    match nearest_m {
        _ if nearest_m.is_infinite() => Sight::NotSeen,
        _ if nearest_m > tolerance_m => Sight::Contradicts,
        _ => Sight::Hidden,
    }
}
