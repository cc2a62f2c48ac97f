//! Which numbers a setting may be. A setting is called by its flag on the command line; the builders of the library have a
//! function of that name for it.

use std::ops::RangeInclusive;

use crate::error::{Error, Result};

/// A range of numbers and how to say it.
pub type Range = (fn(f64) -> bool, &'static str);

/// Weights and widths that may be nothing.
pub const AT_LEAST_ZERO: Range = (|v| v >= 0.0, "0 or more");
/// Lengths and steps.
pub const ABOVE_ZERO: Range = (|v| v > 0.0, "more than 0");
/// Factors of over-relaxation.
pub const BETWEEN_ZERO_AND_TWO: Range = (|v| 0.0 < v && v < 2.0, "between 0 and 2");

/// Edges of bricks, of which multiples of 16 are taken.
const BRICKS: RangeInclusive<i64> = 16..=512;

/// Refuses a number out of its range.
///
/// # Errors
/// With the setting's name, the number and the range.
pub fn check(flag: &str, value: f64, (holds, range): Range) -> Result<()> {
    // Lengths and weights are computed with in single precision.
    if value.is_finite() && (value as f32).is_finite() && holds(value) {
        return Ok(());
    }
    Err(Error::usage(format!("{flag} is {value}; it must be a number, {range}")))
}

/// Refuses a number out of its range, where one was given.
///
/// # Errors
/// With the setting's name, the number and the range.
pub fn check_given(flag: &str, value: Option<f64>, range: Range) -> Result<()> {
    value.map_or(Ok(()), |value| check(flag, value, range))
}

/// Refuses an edge that bricks cannot have.
///
/// # Errors
/// With the edges that they can have.
pub fn check_brick(edge: i64) -> Result<()> {
    if BRICKS.contains(&edge) && edge % 16 == 0 {
        return Ok(());
    }
    Err(Error::usage(format!("--brick is {edge}; give a multiple of 16 from {} to {}", BRICKS.start(), BRICKS.end())))
}
