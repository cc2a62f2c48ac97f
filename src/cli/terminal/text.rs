//! Numbers, sizes and times as people read them.

pub(crate) use crate::grid::digits::{number, place};

/// A whole number in groups of three digits.
pub(crate) fn grouped(value: u64) -> String {
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
pub(crate) fn bytes(value: u64) -> String {
    let units = [("TiB", 40), ("GiB", 30), ("MiB", 20), ("KiB", 10)];
    match units.iter().find(|(_, shift)| value >> shift > 0) {
        Some((unit, shift)) => {
            let tenths = (value as f64 / 2f64.powi(*shift) * 10.0).round();
            format!("{} {unit}", number(tenths / 10.0))
        }
        None => format!("{value} bytes"),
    }
}

/// Seconds as `12 s`, `3 min 05 s`, `2 h 10 min`.
pub(crate) fn duration(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match whole {
        0..60 => format!("{whole} s"),
        60..3600 => format!("{} min {:02} s", whole / 60, whole % 60),
        _ => format!("{} h {:02} min", whole / 3600, whole % 3600 / 60),
    }
}

/// `(x, y, z)`.
pub(crate) fn triple(values: [f64; 3]) -> String {
    let [x, y, z] = values.map(number);
    format!("({x}, {y}, {z})")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_and_times_are_short() {
        assert_eq!(bytes(1023), "1023 bytes");
        assert_eq!(bytes(1536), "1.5 KiB");
        assert_eq!(bytes(3 << 30), "3 GiB");
        assert_eq!(bytes((1 << 20) + (1 << 19)), "1.5 MiB");
        assert_eq!(duration(59.4), "59 s");
        assert_eq!(duration(65.0), "1 min 05 s");
        assert_eq!(duration(7260.0), "2 h 01 min");
        assert_eq!(grouped(1_234_567), "1 234 567");
        assert_eq!(grouped(12), "12");
    }
}
