//! The time from one volume of a stack to the next, where a file tells it.

/// A length of time.
#[derive(Clone, Debug, PartialEq)]
pub struct Interval {
    /// How long, in `unit`; more than 0.
    pub step: f64,
    /// The unit as OME-Zarr spells it.
    pub unit: String,
}

/// Units as OME-Zarr spells them, their seconds, and as files write them.
const UNITS: [(&str, f64, &[&str]); 7] = [
    ("second", 1.0, &["s", "sec", "secs", "second", "seconds"]),
    ("millisecond", 1e-3, &["ms", "msec", "millisecond", "milliseconds"]),
    ("microsecond", 1e-6, &["us", "µs", "μs", "\\u00B5s", "usec", "microsecond", "microseconds"]),
    ("nanosecond", 1e-9, &["ns", "nsec", "nanosecond", "nanoseconds"]),
    ("minute", 60.0, &["min", "mins", "minute", "minutes"]),
    ("hour", 3600.0, &["h", "hr", "hrs", "hour", "hours"]),
    ("day", 86400.0, &["d", "day", "days"]),
];

impl Interval {
    /// What a file says; none where that is no time.
    #[must_use]
    pub fn told(step: f64, unit: &str) -> Option<Self> {
        let is_named = |names: &[&str]| names.iter().any(|name| name.eq_ignore_ascii_case(unit.trim()));
        let (unit, ..) = UNITS.into_iter().find(|(.., names)| is_named(names))?;
        (step.is_finite() && step > 0.0).then(|| Self { step, unit: unit.into() })
    }
}

/// The seconds of a unit that is spelled as OME-Zarr does.
#[must_use]
pub fn seconds(unit: &str) -> Option<f64> {
    UNITS.into_iter().find(|(name, ..)| *name == unit).map(|(_, seconds, _)| seconds)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_spelled_as_ome_zarr_does() {
        let told = |step, unit| Interval::told(step, unit).map(|told| told.unit);
        assert_eq!(told(1.0, "sec").as_deref(), Some("second"));
        assert_eq!(["nanosecond", "hour", "h"].map(seconds), [Some(1e-9), Some(3600.0), None]);
        assert_eq!(told(0.5, " min").as_deref(), Some("minute"));
        assert_eq!(told(5.0, "µs").as_deref(), Some("microsecond"));
        assert_eq!([told(0.0, "s"), told(f64::NAN, "s"), told(-1.0, "s"), told(1.0, "frame")], [const { None }; 4]);
    }
}
