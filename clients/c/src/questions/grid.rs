//! The map from above, as a 2-D grid.

use mrol_client::planning::{BandFrom, Grid, GridArea};
use mrol_client::service::GridScope;

use super::{Form, Scope, check_reserved, ones, unless_zero};
use crate::abi::Answer;
use crate::failure::Failure;
use crate::memory::{Out, Places, Question, flag};
use crate::replicas::OpenReplica;

/// `mrol_grid_question`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct GridQuestion {
    pub(crate) struct_size: usize,
    pub(crate) scope: Scope,
    pub(crate) area_min_m: [f64; 2],
    pub(crate) area_max_m: [f64; 2],
    pub(crate) min_z_m: f64,
    pub(crate) max_z_m: f64,
    pub(crate) cell_m: f64,
    pub(crate) has_area: u8,
    pub(crate) has_min_z: u8,
    pub(crate) has_max_z: u8,
    pub(crate) tell_unknown: u8,
    pub(crate) band_from: u8,
    pub(crate) reserved: [u8; 3],
}

// SAFETY: it begins with its size, and any bytes are one.
unsafe impl Question for GridQuestion {
    const NAME: &'static str = "question";
    const BYTES_MIN: usize = size_of::<Self>();
}

/// `mrol_grid_shape`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub(crate) struct GridShape {
    pub(crate) cell_m: f64,
    pub(crate) origin_m: [f64; 2],
    pub(crate) cells: [u64; 2],
    pub(crate) floor_min_m: f64,
    pub(crate) floor_max_m: f64,
}

/// `mrol_grid_answers`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct GridPlaces {
    pub(crate) struct_size: usize,
    pub(crate) capacity: usize,
    pub(crate) shape: *mut GridShape,
    pub(crate) occupied: *mut u8,
    pub(crate) tops_m: *mut f32,
    pub(crate) is_free: *mut u8,
}

// SAFETY: it begins with its size, and any bytes are one.
unsafe impl Question for GridPlaces {
    const NAME: &'static str = "answers";
    const BYTES_MIN: usize = std::mem::offset_of!(Self, is_free);
}

impl GridQuestion {
    fn scope(&self) -> Result<GridScope, Failure> {
        check_reserved(&self.reserved, "question")?;
        let bound = |has: u8, name: &str, bound: f64, otherwise: f64| {
            flag(has, name).map(|has| if has { bound } else { otherwise })
        };
        let low_m = bound(self.has_min_z, "question.has_min_z", self.min_z_m, f64::NEG_INFINITY)?;
        let high_m = bound(self.has_max_z, "question.has_max_z", self.max_z_m, f64::INFINITY)?;
        let area = match flag(self.has_area, "question.has_area")? {
            true => GridArea::Rectangle { min_m: self.area_min_m, max_m: self.area_max_m },
            false => GridArea::Occupied,
        };
        let tells_unknown = flag(self.tell_unknown, "question.tell_unknown")?;
        let band_from = match self.band_from {
            0 => BandFrom::Floor,
            1 => BandFrom::Map,
            other => {
                return Err(Failure::argument(format!("question.band_from must be 0 or 1, got {other}")));
            }
        };
        let (band_m, cell_m) = ([low_m, high_m], unless_zero(self.cell_m));
        Ok(GridScope { area, band_m, band_from, cell_m, tells_unknown })
    }
}

fn shape_of(grid: &Grid) -> GridShape {
    let cells = grid.size.map(|cells| cells as u64);
    let [floor_min_m, floor_max_m] = grid.floor_m.unwrap_or([f64::NAN; 2]);
    GridShape { cell_m: grid.cell_m, origin_m: grid.origin_m, cells, floor_min_m, floor_max_m }
}

impl GridPlaces {
    /// Writes the arrays.
    ///
    /// # Safety
    /// Pointers are NULL or point to memory for `capacity` cells.
    unsafe fn write(&self, grid: &Grid) -> Result<(), Failure> {
        if self.occupied.is_null() && self.tops_m.is_null() && self.is_free.is_null() {
            return Ok(());
        }
        let mut room = Places::new(grid.cells(), self.capacity)?;
        // SAFETY: as the caller promises.
        let (occupied, tops_m, is_free) = unsafe {
            (
                room.bitmap(self.occupied, "answers.occupied")?,
                room.array(self.tops_m, "answers.tops_m")?,
                room.bitmap(self.is_free, "answers.is_free")?,
            )
        };
        if let Some(to) = occupied {
            to.write_bits(&grid.occupied);
        }
        if let Some(to) = tops_m {
            to.write(grid.tops_m.iter().copied());
        }
        if let (Some(to), Some(free)) = (is_free, &grid.free) {
            to.write_bits(free);
        }
        Ok(())
    }
}

impl Form for GridQuestion {
    type Places = GridPlaces;

    unsafe fn ask(&self, places: &GridPlaces, replica: &OpenReplica) -> Result<Answer, Failure> {
        // SAFETY: as the caller promises.
        let shape = unsafe { Out::of(places.shape, "answers.shape") }.required()?;
        let question =
            mrol_client::service::GridQuestion { asked: self.scope.asked("question")?, scope: self.scope()? };
        if !places.is_free.is_null() && !question.scope.tells_unknown {
            return Err(Failure::argument("answers.is_free is told where question.tell_unknown is 1"));
        }
        let answered = replica.ask(&question)?;
        let grid = &answered.answer;
        shape.write(shape_of(grid));
        // SAFETY: as the caller promises.
        unsafe { places.write(grid) }?;
        Ok(Answer::of(answered.version, grid.cells(), ones(&grid.occupied)))
    }
}
