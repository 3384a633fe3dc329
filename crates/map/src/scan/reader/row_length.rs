//! How many numbers a row of bare floats has, as far as the numbers show it.
//!
//! The same bytes can be read as rows of three, four or five numbers. Rows of the wrong length mix coordinates with
//! intensities and with each other.

/// Lengths of rows, and the columns that they mostly have.
pub(super) const NAMES: [(usize, &str); 3] = [(3, "x y z"), (4, "x y z i"), (5, "x y z i ring")];
/// Numbers that are looked at: whole rows of each length.
const SAMPLE: usize = 1_200_000;
/// How many times larger the step from a row to the next one is, in the wrong rows, that they are told by it.
const STEP_RATIO: f64 = 4.0;
/// How likely it may be that a column of mixed coordinates has none outside of the range of an intensity.
const CHANCE_MAX: f64 = 1e-9;
/// The largest intensity of the scales in use.
const INTENSITIES_MAX: [f32; 2] = [1.0, 255.0];

/// The columns of rows of a length of [`NAMES`].
pub(super) fn name_of(length: usize) -> &'static str {
    NAMES.iter().find(|(of, _)| *of == length).map_or("x y z ...", |(_, name)| name)
}

/// The length that rows rather have than the given one, where the numbers show it.
///
/// Two things show it: numbers of one column change little from a row to the next, and intensities lie between 0 and 1
/// or 0 and 255 where coordinates do not.
pub(super) fn other_row_length(numbers: &[f32], length: usize) -> Option<usize> {
    let sample = &numbers[..numbers.len().min(SAMPLE)];
    let step = step(sample, length);
    let others = NAMES.iter().map(|(other, _)| *other);
    let mut fitting = others.filter(|&other| other != length && numbers.len().is_multiple_of(other));
    fitting.find(|&other| {
        let is_smoother = match (self::step(sample, other), step) {
            (Some(other), Some(step)) => other * STEP_RATIO < step,
            _ => false,
        };
        is_smoother || other > length && has_intensities(sample, other)
    })
}

/// The middle one of all differences between a number and the one a row later, but for those between zeros, of no
/// return.
fn step(sample: &[f32], length: usize) -> Option<f64> {
    let pairs = sample.iter().zip(sample.get(length..)?);
    let counts = |(before, after): &(&f32, &f32)| {
        before.is_finite() && after.is_finite() && (**before != 0.0 || **after != 0.0)
    };
    let mut steps: Vec<f64> =
        pairs.filter(counts).map(|(before, after)| (f64::from(*after) - f64::from(*before)).abs()).collect();
    let middle = steps.len().checked_sub(1)? / 2;
    Some(*steps.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// True where a column behind the third is one of intensities, which cannot be by chance.
fn has_intensities(sample: &[f32], length: usize) -> bool {
    let rows = sample.len() / length;
    let is_of_intensities = |column: usize| {
        let numbers = || sample.iter().skip(column).step_by(length).take(rows);
        let largest = numbers().try_fold(0f32, |largest, &number| {
            (number.is_finite() && number >= 0.0).then(|| largest.max(number))
        });
        let Some(most) =
            largest.and_then(|largest| INTENSITIES_MAX.into_iter().find(|most| largest <= *most))
        else {
            return false;
        };
        let finite = || sample.iter().filter(|number| number.is_finite());
        let outside = finite().filter(|number| **number < 0.0 || **number > most).count() as f64;
        let share = outside / finite().count().max(1) as f64;
        (1.0 - share).powf(rows as f64) < CHANCE_MAX
    };
    (3..length).any(is_of_intensities)
}
