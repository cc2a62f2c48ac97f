//! Which times of a series are meant: one, all of them, or a range.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

use crate::error::{Error, Result};

/// Times as they are typed, counted from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Times {
    One(u32),
    All,
    /// From one on to one that is not meant any more; an end left out is the image's.
    Range(Option<u32>, Option<u32>),
}

impl Default for Times {
    fn default() -> Self {
        Self::One(0)
    }
}

impl Times {
    /// The one time, where no series is meant.
    pub(crate) fn one(self) -> Option<u32> {
        if let Self::One(time) = self { Some(time) } else { None }
    }

    /// One of them, with which a file is opened before it is known how many there are.
    pub(crate) fn first(self) -> u32 {
        match self {
            Self::One(time) | Self::Range(Some(time), _) => time,
            Self::All | Self::Range(None, _) => 0,
        }
    }

    /// The times that are meant of so many.
    ///
    /// # Errors
    /// When there are none, or some are not there.
    pub(crate) fn of(self, count: u32) -> Result<Range<u32>> {
        let (first, end) = match self {
            Self::One(time) => (time, time.saturating_add(1)),
            Self::All => (0, count),
            Self::Range(first, end) => (first.unwrap_or(0), end.unwrap_or(count)),
        };
        if end > count || first >= count {
            let has = if count == 1 { "time 0 alone".into() } else { format!("the times 0 to {}", count - 1) };
            return Err(Error::usage(format!("--time {self}: the image has {has} (0:{count})")));
        }
        if first >= end {
            return Err(Error::usage(format!(
                "--time {self} is no time at all; give the first one, and the one after the last, such as {first}:{}",
                first + 1
            )));
        }
        Ok(first..end)
    }
}

impl fmt::Display for Times {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let end = |end: &Option<u32>| end.map_or(String::new(), |end| end.to_string());
        match self {
            Self::One(time) => write!(f, "{time}"),
            Self::All => f.write_str("all"),
            Self::Range(first, last) => write!(f, "{}:{}", end(first), end(last)),
        }
    }
}

impl FromStr for Times {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let what = "give a time counted from 0, all, or A:B for the times from A up to B - 1";
        let number = |text: &str| match text.trim() {
            "" => Ok(None),
            digits => digits.parse().map(Some).map_err(|_| format!("'{digits}' is no whole number; {what}")),
        };
        match text.split_once(':') {
            _ if text.trim() == "all" => Ok(Self::All),
            Some((first, end)) => Ok(Self::Range(number(first)?, number(end)?)),
            None => number(text)?.map(Self::One).ok_or_else(|| what.into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_those_of_the_image() {
        let of = |text: &str, count| text.parse::<Times>().unwrap().of(count).map_err(|error| error.to_string());
        assert_eq!(of("all", 21), Ok(0..21));
        assert_eq!(of("3", 21), Ok(3..4));
        assert_eq!(
            (of("2:5", 21), of(":5", 21), of("19:", 21), of(":", 3)),
            (Ok(2..5), Ok(0..5), Ok(19..21), Ok(0..3))
        );
        for (text, says) in
            [("5:5", "no time at all"), ("7:2", "no time at all"), ("0:22", "0 to 20"), ("21", "0 to 20")]
        {
            assert!(of(text, 21).unwrap_err().contains(says), "{text}");
        }
        assert!(of("1:", 1).unwrap_err().contains("time 0 alone"));
        for text in ["", "x", "-1", "1:x", "1.5"] {
            assert!(text.parse::<Times>().is_err(), "{text}");
        }
        for text in ["all", "3", "2:5", ":5", "19:"] {
            assert_eq!(text.parse::<Times>().unwrap().to_string(), text);
        }
    }
}
