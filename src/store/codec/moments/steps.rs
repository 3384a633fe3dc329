//! The numbers of a voxel's moments in steps, of which a byte counts those from one side to the other.

use super::Numbers;
use crate::voxel::Moments;

/// Units in a step. [`Moments::STEP`] had better be a multiple, or nothing gets shorter.
const STEP: i64 = Moments::UNITS / 256;
/// Steps of each number: the count has none, products have two.
const UNITS: Numbers = {
    const PRODUCT: i64 = STEP * STEP;
    [1, STEP, STEP, STEP, PRODUCT, PRODUCT, PRODUCT, PRODUCT, PRODUCT, PRODUCT]
};

/// None where an offset lies between two steps.
pub(super) fn of_units(numbers: &Numbers) -> Option<Numbers> {
    let whole = numbers.iter().zip(UNITS).all(|(number, units)| number % units == 0);
    whole.then(|| std::array::from_fn(|i| numbers[i] / UNITS[i]))
}

/// The inverse of [`of_units`]; none where they are too large.
pub(super) fn to_units(numbers: &Numbers) -> Option<Numbers> {
    let mut in_units = *numbers;
    for (number, units) in in_units.iter_mut().zip(UNITS) {
        *number = number.checked_mul(units)?;
    }
    Some(in_units)
}
