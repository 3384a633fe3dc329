//! Encoding of moments of one or two points as the points themselves.

use super::steps::Numbers;
use mrol_map::voxel::Moments;

/// Up to [`FewPoints::MOST`] points, each as three signed bytes: its offset from the voxel's center in steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct FewPoints {
    offsets: [[u8; 3]; FewPoints::MOST as usize],
    count: u8,
}

impl FewPoints {
    /// Most points that can be recovered from moments: two follow from their sum and difference, three do not.
    pub(super) const MOST: u8 = 2;

    /// The points whose moments are `numbers` (in steps); none where there are more of them, or no such points.
    pub(super) fn of(numbers: &Numbers) -> Option<Self> {
        let [count, x, y, z, ..] = *numbers;
        let points = match count {
            0 => [[0; 3]; 2],
            1 => [[x, y, z], [0; 3]],
            2 => two_points(numbers)?,
            _ => return None,
        };
        let few = Self { offsets: points.map(|point| point.map(|d| d as u8)), count: count as u8 };
        (Self::numbers(few.offsets()) == *numbers).then_some(few)
    }

    /// The moments of points, in steps.
    pub(super) fn numbers(offsets: &[[u8; 3]]) -> Numbers {
        let mut sum = Moments::default();
        offsets.iter().for_each(|offset| sum += Moments::of_offset(offset.map(|d| i64::from(d as i8))));
        sum.to_numbers()
    }

    pub(super) fn count(&self) -> u8 {
        self.count
    }

    pub(super) fn as_bytes(&self) -> &[u8] {
        self.offsets().as_flattened()
    }

    fn offsets(&self) -> &[[u8; 3]] {
        &self.offsets[..usize::from(self.count)]
    }
}

/// Recovers two points from the sums s and q: their difference e has e_i e_j = 2 q_ij - s_i s_j, and the points are (s
/// + e) / 2 and (s - e) / 2.
fn two_points(&[_, x, y, z, xx, xy, xz, yy, yz, zz]: &Numbers) -> Option<[[i64; 3]; 2]> {
    let length = |xx: i64, x: i64| u64::try_from(2 * xx - x * x).ok().map(|square| square.isqrt() as i64);
    let (ex, ey, ez) = (length(xx, x)?, length(yy, y)?, length(zz, z)?);
    // Which end goes with which, the first axis along which they differ tells.
    let signed = |length: i64, product: i64| if product < 0 { -length } else { length };
    let apart = match ex {
        0 => [0, ey, signed(ez, 2 * yz - y * z)],
        _ => [ex, signed(ey, 2 * xy - x * y), signed(ez, 2 * xz - x * z)],
    };
    let halves = |sign: i64| [x + sign * apart[0], y + sign * apart[1], z + sign * apart[2]].map(|d| d / 2);
    Some([halves(1), halves(-1)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        #[test]
        fn up_to_two_points_are_known_from_their_numbers(offsets in prop::collection::vec(any::<[u8; 3]>(), 0..=2)) {
            let few = FewPoints::of(&FewPoints::numbers(&offsets)).unwrap();
            let (mut known, mut offsets) = (few.offsets().to_vec(), offsets);
            known.sort_unstable();
            offsets.sort_unstable();
            prop_assert_eq!(known, offsets);
        }

        #[test]
        fn two_points_close_to_each_other_are_known_as_well(
            one in prop::array::uniform3(60u8..70), by in prop::array::uniform3(0u8..3), on_plane in 0usize..3,
        ) {
            let mut other: [u8; 3] = std::array::from_fn(|axis| one[axis] + by[axis] - 1);
            other[on_plane] = one[on_plane];
            let few = FewPoints::of(&FewPoints::numbers(&[one, other])).unwrap();
            prop_assert!(few.offsets() == [one, other] || few.offsets() == [other, one]);
        }

        #[test]
        fn numbers_that_no_two_points_have_are_none(offsets: [[u8; 3]; 2], at in 1usize..10, by in 1i64..9) {
            let mut numbers = FewPoints::numbers(&offsets);
            numbers[at] += by;
            let known = FewPoints::of(&numbers).map(|few| FewPoints::numbers(few.offsets()));
            prop_assert!(known.is_none_or(|known| known == numbers));
        }
    }

    #[test]
    fn more_points_than_two_and_those_beyond_a_byte_are_not_known() {
        assert_eq!(FewPoints::of(&FewPoints::numbers(&[[1; 3]; 3])), None);
        assert_eq!(FewPoints::of(&Moments::of_offset([128, 0, 0]).to_numbers()), None);
        assert_eq!(FewPoints::of(&[1, 2, 2, 2, 4, 4, 4, 4, 4, 5]), None);
    }
}
