//! Conversion of moments from units to steps: a voxel is 256 steps wide, so that an offset is a byte.

use mrol_map::voxel::Moments;

/// Moments as [`Moments::to_numbers`] returns them, in units or in steps.
pub(super) type Numbers = [i64; Moments::NUMBERS];

/// Units in a step. [`Moments::STEP`] should be a multiple of it, or nothing gets shorter.
const STEP: i64 = Moments::UNITS / 256;
/// Units of a step of each number: the count has none, products have two factors of a step.
const UNITS: Numbers = {
    const PRODUCT: i64 = STEP * STEP;
    [1, STEP, STEP, STEP, PRODUCT, PRODUCT, PRODUCT, PRODUCT, PRODUCT, PRODUCT]
};

/// Converts units to steps; none where an offset is not a whole number of steps.
pub(super) fn of_units(numbers: &Numbers) -> Option<Numbers> {
    let whole = numbers.iter().zip(UNITS).all(|(number, units)| number % units == 0);
    whole.then(|| std::array::from_fn(|i| numbers[i] / UNITS[i]))
}

/// Converts steps to units; none where the numbers are too large.
pub(super) fn to_units(numbers: &Numbers) -> Option<Numbers> {
    let mut in_units = *numbers;
    for (number, units) in in_units.iter_mut().zip(UNITS) {
        *number = number.checked_mul(units)?;
    }
    Some(in_units)
}
