//! Regions as a program names them.

use mrol_client::geometry::pose;
use mrol_client::map::Region;
use mrol_client::planning::Surroundings;
use mrol_client::service::ServiceError;

use crate::failure::Failure;
use crate::memory::{self, Plain};

/// `mrol_region`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub(crate) struct RegionNumbers {
    pub(crate) kind: i32,
    pub(crate) reserved: u32,
    pub(crate) numbers: [f64; 10],
}

// SAFETY: any bytes are one.
unsafe impl Plain for RegionNumbers {}

impl RegionNumbers {
    fn parse(&self) -> Result<Region, Failure> {
        let [a, b, c, d, e, f, g, h, i, j] = self.numbers;
        let (region, used) = match self.kind {
            1 => (Region::cuboid([a, b, c], [d, e, f]), 6),
            2 => (Region::ball([a, b, c], d), 4),
            3 => {
                let map_from_box = pose([a, b, c], [d, e, f, g]).map_err(ServiceError::from)?;
                (Region::oriented_box(map_from_box, [h, i, j]), 10)
            }
            other => {
                let message = format!("kind must be 1 (box), 2 (ball) or 3 (oriented box), got {other}");
                return Err(Failure::argument(message));
            }
        };
        if self.reserved != 0 || self.numbers[used..].iter().any(|number| *number != 0.0) {
            return Err(Failure::argument(format!(
                "of its numbers {used} are used, the others must be zero"
            )));
        }
        Ok(region.map_err(ServiceError::from)?)
    }
}

/// What counts: all but what lies in these regions, and what no scan saw where that is said.
///
/// # Safety
/// The regions are there, and nobody writes them meanwhile.
pub(super) unsafe fn surroundings_but(
    ignored: *const RegionNumbers,
    count: usize,
    unknown_is_occupied: u8,
) -> Result<Surroundings, Failure> {
    // SAFETY: as the caller promises.
    let regions = unsafe { memory::span(ignored, count, "ignored") }?;
    let named = |(number, region): (usize, &RegionNumbers)| {
        region.parse().map_err(|failure| failure.of(&format!("ignored[{number}]")))
    };
    let ignored = regions.iter().enumerate().map(named).collect::<Result<_, _>>()?;
    Ok(Surroundings { ignored, unknown: super::unknown(unknown_is_occupied)? })
}
