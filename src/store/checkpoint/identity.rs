//! Who makes checkpoints, and how two runs differ.

/// Who makes checkpoints: program, settings, inputs, by name. Of another run's nothing is taken.
pub type Identity = Vec<(String, String)>;

/// The first thing in which two runs differ, in words.
#[must_use]
pub fn difference(then: &Identity, now: &Identity) -> Option<String> {
    let of = |identity: &Identity, name: &str| {
        identity.iter().find(|(known, _)| known == name).map(|(_, value)| value.clone())
    };
    let names = then.iter().chain(now).map(|(name, _)| name);
    names.map(|name| (name, of(then, name), of(now, name))).find(|(_, then, now)| then != now).map(
        |(name, then, now)| match (then, now) {
            (Some(then), Some(now)) => format!("{name} was {then} and is {now}"),
            (Some(then), None) => format!("{name} was {then} and is not given"),
            (None, now) => format!("{name} was not given and is {}", now.unwrap_or_default()),
        },
    )
}
