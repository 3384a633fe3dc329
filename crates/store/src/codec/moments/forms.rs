//! Encoding of moments without their keys, each in the shortest form that holds all of it.

use super::few_points::FewPoints;
use super::steps::{self, Numbers};
use crate::codec::unreadable::Unreadable;
use crate::pb;
use mrol_map::util::StopSignal;
use mrol_map::voxel::{MomentSet, Moments};

/// Voxels whose moments are written or read between two checks of the stop signal: some milliseconds.
pub(super) const VOXELS_PER_STOP_CHECK: usize = 16 << 10;
/// Form of ten numbers in steps. Smaller forms are numbers of points.
const STEPS: u8 = FewPoints::MOST + 1;
/// Form of ten numbers in units.
const UNITS: u8 = STEPS + 1;

/// The message of a set without its keys; incomplete once stopped.
pub(super) fn write(set: &MomentSet, stop: StopSignal<'_>) -> pb::Moments {
    let mut forms = Vec::with_capacity(set.as_slice().len());
    let (mut points, mut numbers) = (Vec::new(), Vec::new());
    for (_, moments) in stop.pieces(set.as_slice(), VOXELS_PER_STOP_CHECK).flatten() {
        let in_units = moments.to_numbers();
        let in_steps = steps::of_units(&in_units);
        match (in_steps.as_ref().and_then(FewPoints::of), in_steps) {
            (Some(few), _) => {
                forms.push(few.count());
                points.extend_from_slice(few.as_bytes());
            }
            (None, Some(in_steps)) => {
                forms.push(STEPS);
                numbers.extend(in_steps);
            }
            (None, None) => {
                forms.push(UNITS);
                numbers.extend(in_units);
            }
        }
    }
    pb::Moments { key_gaps: Vec::new(), numbers, forms: forms.into(), points: points.into() }
}

/// Reads the moments of `voxels` voxels: the inverse of [`write`]. Files of before there were forms have all numbers in
/// units.
pub(super) fn read(
    message: &pb::Moments,
    voxels: usize,
    stop: StopSignal<'_>,
) -> Result<Vec<Moments>, Unreadable> {
    let forms = match message.forms.is_empty() {
        true => &vec![UNITS; voxels],
        false => &message.forms[..],
    };
    if forms.len() != voxels {
        return Err(format!("moments has {} forms for {voxels} voxels", forms.len()));
    }
    let mut unread = Unread::of(message)?;
    let voxel = |(i, &form): (usize, &u8)| {
        let in_units = unread.take(form).map_err(|what| format!("moments of voxel {i}: {what}"))?;
        in_units
            .and_then(Moments::from_numbers)
            .ok_or_else(|| format!("moments of voxel {i} are those of no points"))
    };
    let mut moments = Vec::with_capacity(voxels);
    for moments_of_voxel in stop.paced(forms.iter().enumerate(), VOXELS_PER_STOP_CHECK).map(voxel) {
        moments.push(moments_of_voxel?);
    }
    match unread {
        Unread { points: [], numbers: [] } => Ok(moments),
        Unread { points, numbers } => Err(format!(
            "moments has {} points and {} times ten numbers that are no voxel's",
            points.len(),
            numbers.len()
        )),
    }
}

/// The parts of a message that are not read yet.
struct Unread<'a> {
    points: &'a [[u8; 3]],
    numbers: &'a [Numbers],
}

impl<'a> Unread<'a> {
    fn of(message: &'a pb::Moments) -> Result<Self, Unreadable> {
        match (message.points.as_chunks(), message.numbers.as_chunks()) {
            ((points, []), (numbers, [])) => Ok(Self { points, numbers }),
            _ => Err(format!(
                "moments has {} numbers and {} bytes of points, not ten and three of each",
                message.numbers.len(),
                message.points.len()
            )),
        }
    }

    /// Takes the numbers of the next voxel, in units; none where they are too large.
    fn take(&mut self, form: u8) -> Result<Option<Numbers>, Unreadable> {
        match form {
            0..=FewPoints::MOST => {
                let points = self.points.split_off(..usize::from(form)).ok_or("no points are left")?;
                Ok(steps::to_units(&FewPoints::numbers(points)))
            }
            STEPS => Ok(steps::to_units(self.next_numbers()?)),
            UNITS => Ok(Some(*self.next_numbers()?)),
            _ => Err(format!("form {form}, at most {UNITS} is known")),
        }
    }

    fn next_numbers(&mut self) -> Result<&'a Numbers, Unreadable> {
        self.numbers.split_off_first().ok_or_else(|| "no numbers are left".into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_map::voxel::VoxelKey;

    fn of(points: &[[i64; 3]]) -> Moments {
        let mut sum = Moments::default();
        points.iter().for_each(|&point| sum += Moments::of_offset(point));
        sum
    }

    fn set() -> MomentSet {
        let step = Moments::STEP;
        let (one, two) = ([step, -2 * step, 127 * step], [-128 * step, 0, 3 * step]);
        let voxels = [of(&[]), of(&[one]), of(&[two, one]), of(&[one, two, two]), of(&[[1, 2, 3]])];
        (0..).zip(voxels).map(|(x, moments)| (VoxelKey::new([x, 0, 0]).unwrap(), moments)).collect()
    }

    #[test]
    fn each_voxel_has_its_shortest_form() {
        let message = write(&set(), StopSignal::NEVER);
        assert_eq!(&message.forms[..], [0, 1, 2, STEPS, UNITS]);
        assert_eq!((message.points.len(), message.numbers.len()), (3 * 3, 2 * 10));
        assert_eq!(message.numbers[..4], [3, -255, -2, 133]);
        let moments: Vec<_> = set().as_slice().iter().map(|(_, moments)| *moments).collect();
        assert_eq!(read(&message, 5, StopSignal::NEVER).unwrap(), moments);
    }

    #[test]
    fn what_does_not_go_with_its_forms_is_an_error() {
        let damaged = |damage: fn(&mut pb::Moments)| {
            let mut message = write(&set(), StopSignal::NEVER);
            damage(&mut message);
            read(&message, 5, StopSignal::NEVER).unwrap_err()
        };
        assert!(damaged(|m| m.forms = vec![1, 1].into()).contains("2 forms for 5 voxels"));
        assert!(damaged(|m| m.forms = vec![5; 5].into()).contains("form 5"));
        assert!(damaged(|m| m.forms = vec![0; 5].into()).contains("no voxel's"));
        assert!(damaged(|m| m.forms = vec![2; 5].into()).contains("voxel 1: no points"));
        assert!(damaged(|m| m.forms = vec![STEPS; 5].into()).contains("voxel 2: no numbers"));
        assert!(damaged(|m| m.points = vec![0; 8].into()).contains("8 bytes of points"));
        assert!(damaged(|m| m.numbers[1] = i64::MAX).contains("voxel 3 are those of no points"));
    }
}
