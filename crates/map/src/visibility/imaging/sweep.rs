//! A sweep: how a scan looked around.

/// Movements of the sensor up to this are taken for none, meters.
const MOVED_MIN_M: f32 = 0.01;

/// How a scan looked around.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sweep {
    /// What is further away is seen up to here, meters.
    pub range_max_m: f32,
    /// How far the sensor was, at most, from the scan's pose when it took a ray, meters; 0 of one that stood.
    pub moved_m: f32,
    /// Rays that end here or farther away met nothing: they run on, meters. Infinite: each met something.
    pub open_m: f32,
}

impl Sweep {
    /// The sweep of a sensor that stood.
    pub const fn standing(range_max_m: f32) -> Self {
        Self { range_max_m, moved_m: 0.0, open_m: f32::INFINITY }
    }

    /// The point at `offset` from the sensor, as far as it is seen; none of what has no direction.
    pub fn limited(self, offset: [f32; 3]) -> Option<[f32; 3]> {
        let squared = offset.iter().map(|c| c * c).sum::<f32>();
        if !(squared > 0.0 && squared.is_finite()) {
            return None;
        }
        let scale = (self.range_max_m / squared.sqrt()).min(1.0);
        Some(offset.map(|c| c * scale))
    }

    /// How far the sensor moved, where that is more than noise.
    pub(super) fn told_moved_m(self) -> f32 {
        if self.moved_m > MOVED_MIN_M { self.moved_m } else { 0.0 }
    }
}
