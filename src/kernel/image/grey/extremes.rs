//! The smallest and the largest of some values.

use crate::store::Element;

/// The smallest and the largest value so far; what is no number takes no part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extremes {
    low: f64,
    high: f64,
}

impl Default for Extremes {
    fn default() -> Self {
        Self { low: f64::INFINITY, high: f64::NEG_INFINITY }
    }
}

impl Extremes {
    /// Looks at some more values.
    pub fn add<T: Element>(&mut self, values: &[T]) {
        for value in values {
            let value = value.to_f64();
            (self.low, self.high) = (self.low.min(value), self.high.max(value));
        }
    }

    /// `[smallest, largest]`; none where there was no number.
    #[must_use]
    pub fn range(&self) -> Option<[f64; 2]> {
        (self.low <= self.high).then_some([self.low, self.high])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_takes_no_part() {
        let mut found = Extremes::default();
        found.add(&[f32::NAN]);
        assert_eq!(found.range(), None);
        found.add(&[2.5, f32::NAN, -1.0]);
        found.add(&[7_u8]);
        assert_eq!(found.range(), Some([-1.0, 7.0]));
    }
}
