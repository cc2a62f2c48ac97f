//! Shapes that single precision has rounded: far from the origin its numbers lie far apart, and what was written there with
//! them is not what was measured. Nothing brings that back, so it is told.

/// A shape is told to be rounded when single precision has fewer steps than this across it.
const FEWEST_STEPS: f64 = 1000.0;
/// Positions that are looked at.
const SAMPLE: usize = 10_000;

/// What is to be told of positions that single precision has rounded so that it shows.
pub(crate) fn rounded_note(positions: &[[f64; 3]]) -> Option<String> {
    let (axis, step, at) = (0..3).filter_map(|axis| rounded(positions, axis)).max_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(format!(
        "its {} are single precision numbers, which lie {step} apart near {at:.0}, and its shape is rounded to these; \
         write it in double precision, or seen from a nearer origin",
        ["x", "y", "z"][axis]
    ))
}

/// The axis, the step between neighbouring numbers of single precision, and where, if that shows.
fn rounded(positions: &[[f64; 3]], axis: usize) -> Option<(usize, f64, f64)> {
    let values = || positions.iter().map(|place| place[axis]);
    let (low, high) = values().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
    let farthest = if high.abs() >= low.abs() { high } else { low };
    let single = farthest.abs() as f32;
    if !single.is_normal() {
        return None;
    }
    let step = f64::from(f32::from_bits(single.to_bits() + 1)) - f64::from(single);
    if high - low >= FEWEST_STEPS * step || high == low {
        return None;
    }
    let sample = || values().step_by(positions.len().div_ceil(SAMPLE).max(1));
    let all = sample().count();
    let exact = sample().filter(|&x| f64::from(x as f32) == x).count();
    // Of round numbers, such as whole ones, the last bit is never set; of rounded ones it is in every other.
    let odd = sample().filter(|&x| (x as f32).to_bits() & 1 == 1).count();
    (exact == all && 4 * odd >= all).then_some((axis, step, farthest))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A spiral on the unit sphere, seen from afar.
    fn sphere(centre: [f64; 3]) -> Vec<[f64; 3]> {
        let place = |n: usize| {
            let (z, angle) = (1.0 - (2 * n + 1) as f64 / 500.0, 2.4 * n as f64);
            let ring = libm::sqrt(1.0 - z * z);
            [centre[0] + ring * libm::cos(angle), centre[1] + ring * libm::sin(angle), centre[2] + z]
        };
        (0..500).map(place).collect()
    }

    fn single(places: &[[f64; 3]]) -> Vec<[f64; 3]> {
        places.iter().map(|place| place.map(|x| f64::from(x as f32))).collect()
    }

    #[test]
    fn what_was_rounded_is_told() {
        let far = sphere([500_000.0, 4_000_000.0, 100.0]);
        assert_eq!(rounded_note(&far), None, "doubles");
        // From 2^21 to 2^22 single precision numbers lie 2^-2 apart.
        let note = rounded_note(&single(&far)).unwrap();
        assert!(note.starts_with("its y are single precision numbers, which lie 0.25 apart near 4000001,"), "{note}");
        assert_eq!(rounded_note(&single(&sphere([500.0, 4000.0, 0.0]))), None, "near enough");
    }

    #[test]
    fn round_numbers_are_not_rounded() {
        let whole = |place: [f64; 3]| place.map(|x| (4.0 * x).round() + 4_000_000.0);
        let places: Vec<[f64; 3]> = sphere([0.0; 3]).into_iter().map(whole).collect();
        assert_eq!(rounded_note(&places), None);
        assert_eq!(rounded_note(&[]), None);
        assert_eq!(rounded_note(&[[4e6, 4e6, 4e6]]), None, "one place");
    }
}
