//! The time from one volume of a stack to the next, where a file tells it.

/// A length of time.
#[derive(Clone, Debug, PartialEq)]
pub struct Interval {
    /// How long, in `unit`; more than 0.
    pub step: f64,
    /// The unit as OME-Zarr spells it.
    pub unit: String,
}

/// Units as files write them, and as OME-Zarr does.
const UNITS: [(&str, &[&str]); 7] = [
    ("second", &["s", "sec", "secs", "second", "seconds"]),
    ("millisecond", &["ms", "msec", "millisecond", "milliseconds"]),
    ("microsecond", &["us", "µs", "μs", "\\u00B5s", "usec", "microsecond", "microseconds"]),
    ("nanosecond", &["ns", "nsec", "nanosecond", "nanoseconds"]),
    ("minute", &["min", "mins", "minute", "minutes"]),
    ("hour", &["h", "hr", "hrs", "hour", "hours"]),
    ("day", &["d", "day", "days"]),
];

impl Interval {
    /// What a file says; none where that is no time.
    #[must_use]
    pub fn told(step: f64, unit: &str) -> Option<Self> {
        let is_named = |names: &[&str]| names.iter().any(|name| name.eq_ignore_ascii_case(unit.trim()));
        let (unit, _) = UNITS.into_iter().find(|(_, names)| is_named(names))?;
        (step.is_finite() && step > 0.0).then(|| Self { step, unit: unit.into() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_spelled_as_ome_zarr_does() {
        let told = |step, unit| Interval::told(step, unit).map(|told| told.unit);
        assert_eq!(told(1.0, "sec").as_deref(), Some("second"));
        assert_eq!(told(0.5, " min").as_deref(), Some("minute"));
        assert_eq!(told(5.0, "µs").as_deref(), Some("microsecond"));
        assert_eq!([told(0.0, "s"), told(f64::NAN, "s"), told(-1.0, "s"), told(1.0, "frame")], [const { None }; 4]);
    }
}
