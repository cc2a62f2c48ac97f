//! Values with a spelling of their own: sizes, crops, triples, methods, outputs.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::ValueEnum;

use crate::io::ome_zarr::{Compression, OmeVersion};
use crate::kernel::distance::state::neighbours::Neighbours;
use crate::pipeline::distance::{Method, SOLVERS};
use crate::pipeline::marks::Seed;
use crate::pipeline::reconstruct::Vertices;
use crate::pipeline::segment::FillGaps;

/// A crop as typed: for each axis where it begins and ends, where that was said.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Crop(pub(crate) [[Option<i64>; 2]; 3]);

/// Where the result goes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Output {
    /// A store at this path.
    Store(PathBuf),
    /// Nowhere.
    None,
}

impl Output {
    /// The store's path, where there is to be one.
    pub(crate) fn path(&self) -> Option<&Path> {
        match self {
            Self::Store(path) => Some(path),
            Self::None => None,
        }
    }
}

impl FromStr for Output {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "" => Err("give a path, or none".into()),
            "none" => Ok(Self::None),
            path => Ok(Self::Store(path.into())),
        }
    }
}

/// `x0:x1,y0:y1,z0:z1`, each number may be left out.
pub(crate) fn parse_crop(text: &str) -> Result<Crop, String> {
    let what = "give three ranges such as 0:512,100:400,:60";
    let number = |text: &str| match text.trim() {
        "" => Ok(None),
        digits => digits.parse::<i64>().map(Some).map_err(|_| format!("'{digits}' is no whole number; {what}")),
    };
    let ranges: Vec<&str> = text.split(',').collect();
    let ranges: [&str; 3] = ranges.try_into().map_err(|_| what.to_string())?;
    let mut crop = [[None; 2]; 3];
    for (range, limits) in ranges.iter().zip(&mut crop) {
        let (low, high) = range.split_once(':').ok_or_else(|| format!("'{range}' has no colon; {what}"))?;
        *limits = [number(low)?, number(high)?];
    }
    Ok(Crop(crop))
}

/// `x,y,z`.
pub(crate) fn parse_triple(text: &str) -> Result<[f64; 3], String> {
    numbers(text)
}

/// One number for all axes, or `x,y,z`.
pub(crate) fn parse_spacing(text: &str) -> Result<[f64; 3], String> {
    if text.contains(',') { numbers(text) } else { numbers::<1>(text).map(|[h]| [h; 3]) }
}

/// `x,y,z`, whole numbers.
pub(crate) fn parse_whole_triple(text: &str) -> Result<[i64; 3], String> {
    let number = |part: &str| part.trim().parse::<i64>().map_err(|_| format!("'{}' is no whole number", part.trim()));
    let values = text.split(',').map(number).collect::<Result<Vec<i64>, String>>()?;
    values.try_into().map_err(|_| "give 3 whole numbers with commas between them".into())
}

/// `x,y,z,radius`.
pub(crate) fn parse_seed(text: &str) -> Result<Seed, String> {
    numbers(text).map(|[x, y, z, radius]| Seed { centre: [x, y, z], radius })
}

/// A width or `auto`.
pub(crate) fn parse_fill_gaps(text: &str) -> Result<FillGaps, String> {
    match text {
        "auto" => Ok(FillGaps::Auto),
        width => width.parse().map(FillGaps::Width).map_err(|_| "give a length, or auto".into()),
    }
}

/// `low,high`.
pub(crate) fn parse_pair(text: &str) -> Result<[f64; 2], String> {
    numbers(text)
}

fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let number = |part: &str| part.trim().parse::<f64>().map_err(|_| format!("'{}' is not a number", part.trim()));
    let values = text.split(',').map(number).collect::<Result<Vec<f64>, String>>()?;
    let found = values.len();
    values.try_into().map_err(|_| format!("give {N} numbers with commas between them, not {found}"))
}

/// Bytes with or without a unit.
pub(crate) fn parse_size(text: &str) -> Result<u64, String> {
    let text = text.trim();
    let digits = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    let (number, unit) = text.split_at(digits);
    let factor = match unit.trim().to_ascii_lowercase().as_str() {
        "" | "b" => 1.0,
        "k" | "kib" => 1024.0,
        "m" | "mib" => 1_048_576.0,
        "g" | "gib" => 1_073_741_824.0,
        "t" | "tib" => 1_099_511_627_776.0,
        "kb" => 1e3,
        "mb" => 1e6,
        "gb" => 1e9,
        "tb" => 1e12,
        _ => return Err("give bytes, or a number with KiB, MiB, GiB, TiB, kB, MB, GB or TB, such as 4GiB".into()),
    };
    let bytes = number.parse::<f64>().map_err(|_| "give a positive number, such as 512MiB".to_string())? * factor;
    if (1.0..1e18).contains(&bytes) { Ok(bytes as u64) } else { Err("give a size such as 512MiB".into()) }
}

/// A distance method by its name in the table.
pub(crate) fn parse_method(text: &str) -> Result<Method, String> {
    let names: Vec<&str> = SOLVERS.iter().map(|solver| solver.name).collect();
    Method::named(text).ok_or_else(|| format!("give one of {}", names.join(", ")))
}

/// 6 or 26 neighbours.
pub(crate) fn parse_neighbours(text: &str) -> Result<Neighbours, String> {
    match text {
        "6" => Ok(Neighbours::Faces),
        "26" => Ok(Neighbours::All),
        _ => Err("give 6 or 26".into()),
    }
}

/// The line of the help that lists the methods.
pub(crate) fn solvers_help() -> String {
    let list: Vec<String> = SOLVERS.iter().map(|solver| format!("{} ({})", solver.name, solver.about)).collect();
    format!("Distance method: {}", list.join(", "))
}

/// How chunks are packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum CompressArg {
    None,
    Fast,
    Small,
}

/// Where the mesh of a reconstruction has its vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum VerticesArg {
    Points,
    LevelSet,
}

impl From<VerticesArg> for Vertices {
    fn from(given: VerticesArg) -> Self {
        match given {
            VerticesArg::Points => Self::Points,
            VerticesArg::LevelSet => Self::LevelSet,
        }
    }
}

/// Which version of OME-Zarr is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum OmeArg {
    #[value(name = "0.4")]
    V04,
    #[value(name = "0.5")]
    V05,
}

impl OmeArg {
    /// As it is typed.
    pub(crate) fn name(self) -> &'static str {
        OmeVersion::from(self).name()
    }
}

impl From<OmeArg> for OmeVersion {
    fn from(arg: OmeArg) -> Self {
        match arg {
            OmeArg::V04 => Self::V04,
            OmeArg::V05 => Self::V05,
        }
    }
}

impl CompressArg {
    /// As it is typed.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Fast => "fast",
            Self::Small => "small",
        }
    }
}

impl From<CompressArg> for Compression {
    fn from(arg: CompressArg) -> Self {
        match arg {
            CompressArg::None => Self::None,
            CompressArg::Fast => Self::Fast,
            CompressArg::Small => Self::Small,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_in_every_unit() {
        for (text, bytes) in [
            ("1048576", 1 << 20),
            ("512MiB", 512 << 20),
            ("4GiB", 4 << 30),
            ("4g", 4 << 30),
            ("2GB", 2_000_000_000),
            ("1.5 KiB", 1536),
            ("1TiB", 1 << 40),
        ] {
            assert_eq!(parse_size(text), Ok(bytes), "{text}");
        }
        for text in ["", "GiB", "-1", "0", "1XiB", "1e9", "nan", "99999999TiB", "1.2.3"] {
            assert!(parse_size(text).is_err(), "{text}");
        }
    }

    #[test]
    fn crops_with_open_ends() {
        assert_eq!(parse_crop("0:5,2:,:").unwrap(), Crop([[Some(0), Some(5)], [Some(2), None], [None, None]]));
        assert_eq!(parse_crop("-1:5,:,:").unwrap().0[0], [Some(-1), Some(5)]);
        for text in ["", "1:2", "1:2,3:4", "1,2,3", "a:2,:,:", "1:2,:,:,:", "1.5:2,:,:"] {
            assert!(parse_crop(text).is_err(), "{text}");
        }
    }

    #[test]
    fn triples_are_three_numbers() {
        assert_eq!(parse_triple("0.2, 0.2,1").unwrap(), [0.2, 0.2, 1.0]);
        assert!(parse_triple("1,2").unwrap_err().contains("3 numbers"));
        assert!(parse_triple("1,2,x").unwrap_err().contains("'x'"));
    }

    #[test]
    fn every_solver_has_its_name() {
        for solver in SOLVERS {
            assert_eq!(parse_method(solver.name).map(Method::name), Ok(solver.name));
            assert!(solvers_help().contains(solver.name));
        }
        assert!(parse_method("fim").unwrap_err().contains("vdt"));
    }
}
