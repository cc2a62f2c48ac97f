//! The axes of an array: which is x, y, z, channel, time, and in which unit lengths along them are.

use serde_json::Value;

use crate::io::stack::units;
use crate::io::stack::units::Unit;

/// What an axis is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Role {
    /// 0 x, 1 y, 2 z.
    Space(usize),
    Channel,
    Time,
    Other,
}

/// One axis of an array.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Axis {
    pub(crate) role: Role,
    pub(crate) name: String,
    pub(crate) unit: Option<String>,
}

impl Axis {
    pub(crate) fn named(name: &str) -> Self {
        Self { role: role(name, ""), name: name.to_owned(), unit: None }
    }

    /// An axis as OME-Zarr writes it: an object since version 0.4, a name in 0.3.
    fn parse(value: &Value) -> Option<Self> {
        let name = value.as_str().or_else(|| value["name"].as_str())?;
        let kind = value["type"].as_str().unwrap_or("");
        Some(Self {
            role: role(name, kind),
            name: name.to_owned(),
            unit: value["unit"].as_str().map(ToOwned::to_owned),
        })
    }
}

fn role(name: &str, kind: &str) -> Role {
    match (name.trim().to_lowercase().as_str(), kind) {
        (_, "channel") | ("c" | "channel" | "channels", _) => Role::Channel,
        (_, "time") | ("t" | "time", _) => Role::Time,
        ("x", _) => Role::Space(0),
        ("y", _) => Role::Space(1),
        ("z", _) => Role::Space(2),
        _ => Role::Other,
    }
}

/// The axes that a list names; none when it is no such list.
pub(crate) fn parse(list: &Value) -> Option<Vec<Axis>> {
    list.as_array()?.iter().map(Axis::parse).collect()
}

/// The axes of an array of that many that does not name them: the last of t, c, z, y, x, as OME-Zarr has had them at first.
pub(crate) fn usual(count: usize) -> Option<Vec<Axis>> {
    let names = ["t", "c", "z", "y", "x"];
    (2..=names.len())
        .contains(&count)
        .then(|| names[names.len() - count..].iter().map(|name| Axis::named(name)).collect())
}

/// The names as a list for messages.
pub(crate) fn names(axes: &[Axis]) -> String {
    axes.iter().map(|axis| axis.name.as_str()).collect::<Vec<_>>().join(", ")
}

/// Which axes of the array are x, y, z, or why a volume cannot be had.
pub(crate) fn places(axes: &[Axis]) -> Result<[usize; 3], String> {
    let mut found = [0; 3];
    for (space, name) in ["x", "y", "z"].iter().enumerate() {
        let places: Vec<usize> = (0..axes.len()).filter(|&a| axes[a].role == Role::Space(space)).collect();
        found[space] = match places[..] {
            [place] => place,
            [] => {
                return Err(format!(
                    "has the axes {} and none that is {name}; a surface needs a 3-D image with z, y and x",
                    names(axes)
                ));
            }
            _ => return Err(format!("has the axes {}, of which several are {name}", names(axes))),
        };
    }
    for (role, what) in [(Role::Channel, "channels"), (Role::Time, "times")] {
        if axes.iter().filter(|axis| axis.role == role).count() > 1 {
            return Err(format!("has the axes {}, of which several are {what}", names(axes)));
        }
    }
    Ok(found)
}

/// The unit that lengths along x, y, z are told in, and for each axis what its lengths are to be multiplied and then
/// divided by, which keeps steps of a thousand exact. Says in `notes` what is not as it should be.
pub(crate) fn common_unit(units: [Option<&str>; 3], notes: &mut Vec<String>) -> (Option<String>, [[f64; 2]; 3]) {
    const NAMES: [&str; 3] = ["x", "y", "z"];
    let mut factors = [[1.0; 2]; 3];
    let lengths = units.map(|unit| match unit.map(units::parse) {
        Some(Unit::Length(name, metres)) => Some((name, metres)),
        _ => None,
    });
    let unknown: Vec<String> = (0..3)
        .filter(|&a| units[a].is_some_and(|unit| units::parse(unit) == Unit::Unknown))
        .map(|a| format!("{} of {}", units[a].unwrap_or(""), NAMES[a]))
        .collect();
    let Some((name, metres)) = lengths.into_iter().flatten().next() else {
        if !unknown.is_empty() {
            notes.push(format!("unknown unit: {}; lengths are taken as they are, without a unit", unknown.join(", ")));
        }
        return (None, factors);
    };
    for a in 0..3 {
        if let Some((_, own)) = lengths[a] {
            let ratio = if own >= metres { own / metres } else { metres / own };
            // Metres of most units have rounded binary forms, ratios of whole powers of ten are meant exact.
            let ratio = if (ratio - ratio.round()).abs() < 1e-9 * ratio { ratio.round() } else { ratio };
            factors[a] = if own >= metres { [ratio, 1.0] } else { [1.0, ratio] };
        }
    }
    let without: Vec<&str> = (0..3).filter(|&a| lengths[a].is_none()).map(|a| NAMES[a]).collect();
    if !unknown.is_empty() {
        notes.push(format!("unknown unit: {}; {name} is taken", unknown.join(", ")));
    } else if !without.is_empty() {
        notes.push(format!("no unit along {}; {name} is taken as along the others", without.join(", ")));
    }
    if factors != [[1.0; 2]; 3] {
        let told: Vec<String> = (0..3).filter_map(|a| Some(format!("{} of {}", lengths[a]?.0, NAMES[a]))).collect();
        notes.push(format!("units differ ({}); all lengths are told in {name}", told.join(", ")));
    }
    (Some(name.to_owned()), factors)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_told_by_name_and_type() {
        let list = serde_json::json!([{"name": "lambda", "type": "channel"}, "X", {"name": "y"}, "z", {"name": "t"}]);
        let axes = parse(&list).unwrap();
        assert_eq!(places(&axes).unwrap(), [1, 2, 3]);
        assert_eq!((axes[0].role, axes[4].role), (Role::Channel, Role::Time));
        assert!(places(&usual(2).unwrap()).unwrap_err().contains("has the axes y, x and none that is z"));
        assert!(places(&parse(&serde_json::json!(["z", "y", "x", "x"])).unwrap()).is_err());
    }

    #[test]
    fn units_become_one() {
        let mut notes = Vec::new();
        let (unit, factors) = common_unit([Some("micrometer"), Some("um"), Some("nanometer")], &mut notes);
        assert_eq!((unit.as_deref(), factors), (Some("micrometer"), [[1.0; 2], [1.0; 2], [1.0, 1000.0]]));
        assert_eq!(notes.len(), 1);
        let (unit, _) = common_unit([Some("furlong"), None, Some("mm")], &mut notes);
        assert!(unit.as_deref() == Some("millimeter") && notes[1].contains("furlong of x"), "{notes:?}");
        assert_eq!(common_unit([None; 3], &mut Vec::new()), (None, [[1.0; 2]; 3]));
    }
}
