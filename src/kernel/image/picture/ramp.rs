//! Colours for numbers: straight lines in red, green and blue between a few colours of rising or falling lightness.

/// A row of colours for the numbers from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ramp {
    /// From violet over green to yellow: lightness says how large.
    Size,
    /// From a pale grey over yellow to red: what is far off stands out.
    Alarm,
}

/// Five colours of viridis (Smith and van der Walt 2015), the first a little lighter, to be seen on a dark ground.
const SIZE: [[u8; 3]; 5] = [[78, 42, 132], [64, 96, 152], [38, 152, 146], [102, 204, 100], [253, 231, 37]];
/// Five colours of the same kind for warnings.
const ALARM: [[u8; 3]; 5] = [[206, 214, 222], [246, 222, 140], [250, 166, 72], [232, 88, 42], [176, 18, 40]];

impl Ramp {
    /// The colours at 0, 1/4, 1/2, 3/4 and 1.
    #[must_use]
    pub fn stops(self) -> [[u8; 3]; 5] {
        match self {
            Self::Size => SIZE,
            Self::Alarm => ALARM,
        }
    }

    /// The red, green and blue of a number; beyond 0 and 1 those at the ends, the first for what is no number.
    #[must_use]
    pub fn color(self, value: f64) -> [u8; 3] {
        let stops = self.stops();
        let last = stops.len() - 1;
        let at = if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) * last as f64 };
        let low = (at as usize).min(last - 1);
        let share = at - low as f64;
        std::array::from_fn(|c| {
            let (a, b) = (f64::from(stops[low][c]), f64::from(stops[low + 1][c]));
            (a + (b - a) * share).round() as u8
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_pass_their_stops() {
        for ramp in [Ramp::Size, Ramp::Alarm] {
            for (n, stop) in ramp.stops().into_iter().enumerate() {
                assert_eq!(ramp.color(n as f64 / 4.0), stop);
            }
            assert_eq!((ramp.color(-3.0), ramp.color(7.0)), (ramp.stops()[0], ramp.stops()[4]));
            assert_eq!(ramp.color(f64::NAN), ramp.stops()[0]);
        }
    }
}
