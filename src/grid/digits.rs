//! Numbers and sizes in sentences: as many digits as matter, wherever a sentence is made.

/// A number with four significant digits, no trailing zeros.
#[must_use]
pub fn number(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let magnitude = libm::log10(value.abs()).floor() as i32;
    if !(-4..9).contains(&magnitude) {
        return format!("{value:.3e}");
    }
    let decimals = (3 - magnitude).max(0) as usize;
    let text = format!("{value:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}

/// A coordinate, with as many decimals as tell a tenth of `step` and no zeros at their end: what matters on a grid of that
/// spacing, however far from zero it lies. Where no step is known, ten digits.
#[must_use]
pub fn coordinate(value: f64, step: f64) -> String {
    let step = if step > 0.0 && step.is_finite() { step } else { 1e-8 * value.abs() };
    if value == 0.0 || value.abs() >= 1e15 || !value.is_finite() || step <= 0.0 {
        return number(value);
    }
    let decimals = (1.0 - libm::log10(step).floor()).clamp(0.0, 15.0) as usize;
    let text = format!("{value:.decimals$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text == "-0" { "0".into() } else { text.into() }
}

/// `(x, y, z)`, a place on a grid of spacing `step`.
#[must_use]
pub fn place(values: [f64; 3], step: f64) -> String {
    let [x, y, z] = values.map(|value| coordinate(value, step));
    format!("({x}, {y}, {z})")
}

/// The shortest number between two, near their middle; none where they do not leave room.
#[must_use]
pub fn shortest_between(low: f64, high: f64) -> Option<f64> {
    let middle = 0.5 * (low + high);
    if !(0.0 < low && low < high) {
        return None;
    }
    let magnitude = libm::log10(middle).floor() as i32;
    (0..8).find_map(|digits| {
        let written = format!("{:.digits$}e{magnitude}", middle / 10f64.powi(magnitude)).parse::<f64>().ok()?;
        (low < written && written < high).then_some(written)
    })
}

/// A whole number in groups of three digits.
#[must_use]
pub fn grouped(value: u64) -> String {
    let digits = value.to_string();
    let mut text = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

/// Bytes in the unit that gives the shortest number.
#[must_use]
pub fn bytes(value: u64) -> String {
    let units = [("TiB", 40), ("GiB", 30), ("MiB", 20), ("KiB", 10)];
    match units.iter().find(|(_, shift)| value >> shift > 0) {
        Some((unit, shift)) => {
            let tenths = (value as f64 / 2f64.powi(*shift) * 10.0).round();
            format!("{} {unit}", number(tenths / 10.0))
        }
        None => format!("{value} bytes"),
    }
}

/// `(x, y, z)`.
#[must_use]
pub fn triple(values: [f64; 3]) -> String {
    let [x, y, z] = values.map(number);
    format!("({x}, {y}, {z})")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_short() {
        assert_eq!(bytes(1023), "1023 bytes");
        assert_eq!(bytes(1536), "1.5 KiB");
        assert_eq!(bytes(3 << 30), "3 GiB");
        assert_eq!(bytes((1 << 20) + (1 << 19)), "1.5 MiB");
        assert_eq!(grouped(1_234_567), "1 234 567");
        assert_eq!(grouped(12), "12");
    }

    #[test]
    fn numbers_are_short_and_right() {
        for (value, text) in [
            (0.0, "0"),
            (1.0, "1"),
            (0.25, "0.25"),
            (1234.5678, "1235"),
            (12.3456, "12.35"),
            (0.001_234_56, "0.001235"),
            (-0.5, "-0.5"),
            (1e12, "1.000e12"),
            (100_000.4, "100000"),
            (1e-7, "1.000e-7"),
        ] {
            assert_eq!(number(value), text);
        }
    }

    #[test]
    fn places_keep_what_matters() {
        assert_eq!(place([500_000.123_456, -1.0, 0.0], 0.076), "(500000.123, -1, 0)");
        assert_eq!(place([12.345, 1e6, 0.0], 30.0), "(12, 1000000, 0)");
    }

    #[test]
    fn places_keep_the_digits_that_matter() {
        for (value, step, text) in [
            (500_000.123_456, 0.076, "500000.123"),
            (3_999_999.999_96, 0.076, "4000000"),
            (1_000_000_000.25, 0.1, "1000000000.25"),
            (-0.000_01, 0.1, "0"),
            (12.345, 10.0, "12"),
            (123_456.7, 1000.0, "123457"),
            (0.000_123_4, 1e-6, "0.0001234"),
            (500_000.4, 0.0, "500000.4"),
            (0.1 + 0.2, 0.0, "0.3"),
            (1e300, 1.0, "1.000e300"),
        ] {
            assert_eq!(coordinate(value, step), text);
        }
    }

    #[test]
    fn short_numbers_lie_between() {
        assert_eq!(shortest_between(0.056, 0.063), Some(0.06));
        assert_eq!(shortest_between(1.02, 1.06), Some(1.04));
        assert_eq!(shortest_between(900.0, 1200.0), Some(1000.0));
        assert_eq!(shortest_between(2.0, 2.0), None);
        assert_eq!(shortest_between(0.0, 0.0), None);
    }
}
