//! The natural order of names: scan2 comes before scan10.

use std::cmp::Ordering;
use std::path::Path;

/// Compares the names of two files; runs of digits count as the numbers that they are. Of names that are equal so, as
/// scan2 and scan02, the order of the bytes decides.
pub fn compare_names(a: &Path, b: &Path) -> Ordering {
    let [a_name, b_name] = [a, b].map(|path| path.file_name().unwrap_or_default().as_encoded_bytes());
    compare(a_name, b_name).then_with(|| a.cmp(b))
}

fn compare<'a>(mut a: &'a [u8], mut b: &'a [u8]) -> Ordering {
    loop {
        let (Some(first), Some(other)) = (a.first(), b.first()) else { return a.len().cmp(&b.len()) };
        if first.is_ascii_digit() && other.is_ascii_digit() {
            let [(number, rest), (other_number, other_rest)] = [a, b].map(number_first);
            let by_number = number.len().cmp(&other_number.len()).then_with(|| number.cmp(other_number));
            if by_number.is_ne() {
                return by_number;
            }
            (a, b) = (rest, other_rest);
        } else if first == other {
            (a, b) = (&a[1..], &b[1..]);
        } else {
            return first.cmp(other);
        }
    }
}

/// The digits at the start of a name without leading zeros, and what follows them.
fn number_first(name: &[u8]) -> (&[u8], &[u8]) {
    let digits = name.iter().take_while(|byte| byte.is_ascii_digit()).count();
    let zeros = name[..digits].iter().take_while(|&&byte| byte == b'0').count();
    (&name[zeros..digits], &name[digits..])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_names_count_as_numbers() {
        let ordered = [
            "2 a.ply",
            "10.ply",
            "a.ply",
            "scan.ply",
            "scan1.ply",
            "scan02.ply",
            "scan2.ply",
            "scan10.ply",
            "scan10b.ply",
            "scan018446744073709551616.ply",
            "scan18446744073709551617.ply",
            "scan_1.ply",
        ];
        for (k, a) in ordered.iter().enumerate() {
            for (l, b) in ordered.iter().enumerate() {
                assert_eq!(compare_names(Path::new(a), Path::new(b)), k.cmp(&l), "{a} and {b}");
            }
        }
    }
}
