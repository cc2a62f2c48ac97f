//! Times as people read them, beside numbers and sizes.

pub(crate) use crate::grid::digits::{bytes, grouped, number, place, triple};

/// Seconds as `12 s`, `3 min 05 s`, `2 h 10 min`.
pub(crate) fn duration(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match whole {
        0..60 => format!("{whole} s"),
        60..3600 => format!("{} min {:02} s", whole / 60, whole % 60),
        _ => format!("{} h {:02} min", whole / 3600, whole % 3600 / 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_short() {
        assert_eq!(duration(59.4), "59 s");
        assert_eq!(duration(65.0), "1 min 05 s");
        assert_eq!(duration(7260.0), "2 h 01 min");
    }
}
