//! Numbers in text as programs write them: C's suffix `f`, Fortran's exponent `D`, and what Windows calls not a number.

/// The number that a word means; none where it means none. May be infinite or not a number.
pub(crate) fn number(word: &str) -> Option<f64> {
    word.parse().ok().or_else(|| odd_number(word))
}

fn odd_number(word: &str) -> Option<f64> {
    let lower = word.to_ascii_lowercase();
    let size = lower.strip_prefix(['-', '+']).unwrap_or(&lower);
    let sign = if lower.starts_with('-') { -1.0 } else { 1.0 };
    // 1.#IND, 1.#QNAN and 1.#SNAN of the older runtime, nan(ind) and nan(snan) of the newer one; zeros may follow.
    if size.starts_with("1.#inf") || size.starts_with("1.#j") {
        return Some(sign * f64::INFINITY);
    }
    if size.starts_with("1.#") || (size.starts_with("nan(") && size.ends_with(')')) {
        return Some(f64::NAN);
    }
    let digits = size.strip_suffix('f').filter(|rest| rest.ends_with(|c: char| c.is_ascii_digit() || c == '.'));
    let plain = digits.unwrap_or(size).replacen('d', "e", 1);
    if !plain.starts_with(|c: char| c.is_ascii_digit() || c == '.') {
        return None;
    }
    plain.parse::<f64>().ok().map(|value| sign * value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_as_programs_write_them() {
        for (word, value) in [
            ("1e-6F", 1e-6),
            ("-2.5f", -2.5),
            ("3.f", 3.0),
            ("+1D-3", 1e-3),
            ("-4.5d2", -450.0),
            ("7", 7.0),
            (".5", 0.5),
        ] {
            assert_eq!(number(word), Some(value), "{word}");
        }
        for word in ["nan", "-nan", "-nan(ind)", "nan(snan)", "-1.#IND", "1.#QNAN0", "-1.#IND00"] {
            assert!(number(word).is_some_and(f64::is_nan), "{word}");
        }
        assert_eq!((number("1.#INF"), number("-1.#INF00")), (Some(f64::INFINITY), Some(f64::NEG_INFINITY)));
        for word in ["", "f", "-", "d5", "1,5", "0x1f", "1.5ff", "e", "--1f", "infd"] {
            assert_eq!(number(word), None, "{word}");
        }
    }
}
