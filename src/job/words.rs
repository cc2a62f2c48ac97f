//! Settings are called by their flags in messages; who calls builders knows them as functions of the same name.

use crate::error::Result;

/// The result with messages in the words of builders: `--max-distance` is `max_distance` there.
pub(super) fn in_builders_words<T>(result: Result<T>) -> Result<T> {
    result.map_err(|error| error.reworded(of_builders))
}

/// A sentence with flags as functions.
pub(super) fn of_builders(sentence: &str) -> String {
    let mut told = String::with_capacity(sentence.len());
    let mut rest = sentence;
    while let Some(at) = rest.find("--") {
        let (before, flag) = (&rest[..at], &rest[at + 2..]);
        told.push_str(before);
        let len = flag.find(|c: char| !(c.is_ascii_lowercase() || c == '-')).unwrap_or(flag.len());
        let name = flag[..len].trim_end_matches('-');
        if name.is_empty() || before.ends_with(|c: char| c.is_alphanumeric() || c == '-') {
            told.push_str("--");
            rest = flag;
            continue;
        }
        told.extend(["`", &name.replace('-', "_"), "`"]);
        rest = &flag[name.len()..];
    }
    told + rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;

    #[test]
    fn flags_are_functions() {
        for (told, of) in [
            (
                "--max-distance needs --schedule front; leave one out",
                "`max_distance` needs `schedule` front; leave one out",
            ),
            ("give less smoothing (--delta)", "give less smoothing (`delta`)"),
            ("give --points-in voxels, or --beta", "give `points_in` voxels, or `beta`"),
            ("a -- b, a--b, 5 --", "a -- b, a--b, 5 --"),
        ] {
            assert_eq!(of_builders(told), of);
        }
        let error = in_builders_words::<()>(Err(Error::usage("--brick is 8").at("a--b".as_ref()))).unwrap_err();
        assert_eq!(error.to_string(), "a--b: `brick` is 8");
    }
}
