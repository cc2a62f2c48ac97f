//! Where two arrays of voxels differ.

/// The first place at which two arrays hold other values, and at how many more they do.
pub fn first_difference<T>(is: &[T], should: &[T], same: impl Fn(&T, &T) -> bool) -> Option<(usize, usize)> {
    let mut places = is.iter().zip(should).enumerate().filter(|(_, (a, b))| !same(a, b)).map(|(place, _)| place);
    let first = places.next()?;
    Some((first, places.count()))
}

/// Equal as numbers, or both none.
#[must_use]
pub fn same_number(a: f64, b: f64) -> bool {
    a == b || (a.is_nan() && b.is_nan())
}

/// The same bits, or both no number: zeros of two signs differ.
#[must_use]
pub fn same_bits(a: f64, b: f64) -> bool {
    a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_found_and_counted() {
        let numbers = |a: &f64, b: &f64| same_number(*a, *b);
        assert_eq!(first_difference(&[1.0, f64::NAN, 0.0], &[1.0, f64::NAN, -0.0], numbers), None);
        assert_eq!(first_difference(&[1.0, 2.0, 3.0, 4.0], &[1.0, 5.0, 3.0, 5.0], numbers), Some((1, 1)));
        assert_eq!(first_difference(&[1.0, 0.0], &[1.0, -0.0], |a, b| same_bits(*a, *b)), Some((1, 0)));
        assert_eq!(first_difference::<u8>(&[], &[], u8::eq), None);
    }
}
