//! The header of an NRRD file: lines `field: value` up to an empty one (NRRD formats 1 to 5, Kindlmann).

use std::collections::BTreeMap;
use std::io::BufRead;

use crate::io::stack::number::{ByteOrder, Number};
use crate::io::stack::units;

/// A header has no more bytes than this.
const MOST_BYTES: u64 = 1 << 20;
/// Entries along an axis, and of all axes, that indices still count.
const MOST_ENTRIES: u64 = 1 << 31;
const MOST_VALUES: u64 = 1 << 48;

/// What a header says.
#[derive(Debug)]
pub(super) struct Fields {
    pub(super) number: Number,
    pub(super) order: ByteOrder,
    /// Entries along each axis, the fastest first: three, and a fourth where there are several volumes.
    pub(super) sizes: Vec<u64>,
    pub(super) spacing: [Option<f64>; 3],
    pub(super) origin: [f64; 3],
    pub(super) unit: Option<String>,
    pub(super) is_gzip: bool,
    /// The file that holds the voxels, where it is another one.
    pub(super) data_file: Option<String>,
    /// Bytes and lines before the voxels; -1 byte: the file ends with them.
    pub(super) skip: [i64; 2],
    /// Bytes of the header.
    pub(super) length: u64,
    pub(super) notes: Vec<String>,
}

/// Reads a header.
pub(super) fn parse(file: impl BufRead) -> Result<Fields, String> {
    let (told, length) = lines(file)?;
    let field = |name: &str| told.get(name).map(String::as_str);
    let needed = |name: &str| field(name).ok_or_else(|| format!("has no field '{name}' in its header"));
    let number = number_named(needed("type")?)?;
    let sizes = sizes(needed("dimension")?, needed("sizes")?)?;
    let order = match field("endian").map(str::to_lowercase).as_deref() {
        Some("little") => ByteOrder::Little,
        Some("big") => ByteOrder::Big,
        None if number.bits() == 8 => ByteOrder::NATIVE,
        None => return Err("has no field 'endian' in its header".into()),
        Some(other) => return Err(format!("has the byte order '{other}'; little and big are read")),
    };
    let is_gzip = match needed("encoding")?.to_lowercase().as_str() {
        "raw" => false,
        "gzip" | "gz" => true,
        other => return Err(format!("has the encoding '{other}'; raw and gzip are read")),
    };
    let skip = [skip(field("byte skip").or(field("byteskip")))?, skip(field("line skip").or(field("lineskip")))?];
    if skip[1] < 0 || skip[0] < -1 || (is_gzip && skip[0] < 0) {
        return Err(format!("has a byte skip of {} and a line skip of {}, which is not read", skip[0], skip[1]));
    }
    let data_file = field("data file").or(field("datafile")).map(ToOwned::to_owned);
    let mut fields = Fields {
        number,
        order,
        sizes,
        spacing: [None; 3],
        origin: [0.0; 3],
        unit: None,
        is_gzip,
        data_file,
        skip,
        length,
        notes: Vec::new(),
    };
    fields.place(&told)?;
    Ok(fields)
}

/// The fields by their names in lower case, and the bytes that they take.
fn lines(file: impl BufRead) -> Result<(BTreeMap<String, String>, u64), String> {
    let mut file = file.take(MOST_BYTES);
    let (mut told, mut length, mut line) = (BTreeMap::new(), 0, Vec::new());
    let mut is_first = true;
    loop {
        line.clear();
        let read = file.read_until(b'\n', &mut line).map_err(|error| format!("cannot be read: {error}"))?;
        length += read as u64;
        if read == 0 && length == MOST_BYTES {
            return Err("has a header of more than 1 MiB".into());
        }
        let text = String::from_utf8_lossy(&line).trim().to_owned();
        if std::mem::take(&mut is_first) && !text.starts_with("NRRD000") {
            return Err("does not begin as an NRRD file does, with NRRD and the number of its format".into());
        }
        if text.is_empty() {
            return Ok((told, length));
        }
        // Comments, and values that somebody else understands.
        if text.starts_with('#') || text.contains(":=") {
            continue;
        }
        if let Some((name, value)) = text.split_once(": ") {
            told.insert(name.trim().to_lowercase(), value.trim().to_owned());
        }
    }
}

fn sizes(dimension: &str, sizes: &str) -> Result<Vec<u64>, String> {
    let found: Option<Vec<u64>> = sizes.split_whitespace().map(|size| size.parse().ok()).collect();
    let mut found = found.ok_or_else(|| format!("has the sizes '{sizes}', which are no whole numbers"))?;
    if dimension.parse() != Ok(found.len()) {
        return Err(format!("has {} sizes where its dimension is '{dimension}'", found.len()));
    }
    if !(2..=4).contains(&found.len()) {
        return Err(format!("has {} axes; 2 to 4 are read", found.len()));
    }
    let all = found.iter().try_fold(1_u64, |all, &size| all.checked_mul(size));
    if found.iter().any(|&size| size == 0 || size >= MOST_ENTRIES) || all.is_none_or(|all| all > MOST_VALUES) {
        return Err(format!("has {sizes} entries along its axes, which cannot be worked on"));
    }
    found.resize(found.len().max(3), 1);
    Ok(found)
}

fn number_named(name: &str) -> Result<Number, String> {
    let words: Vec<String> = name.split_whitespace().map(str::to_lowercase).collect();
    let plain = words.join(" ");
    let known = match plain.trim_end_matches("_t") {
        "signed char" | "int8" => "int8",
        "uchar" | "unsigned char" | "uint8" => "uint8",
        "short" | "short int" | "signed short" | "signed short int" | "int16" => "int16",
        "ushort" | "unsigned short" | "unsigned short int" | "uint16" => "uint16",
        "int" | "signed int" | "int32" => "int32",
        "uint" | "unsigned int" | "uint32" => "uint32",
        "longlong" | "long long" | "long long int" | "signed long long" | "signed long long int" | "int64" => "int64",
        "ulonglong" | "unsigned long long" | "unsigned long long int" | "uint64" => "uint64",
        "float" => "float32",
        "double" => "float64",
        _ => "",
    };
    Number::named(known)
        .ok_or_else(|| format!("holds voxels of type '{name}'; whole numbers, float and double are read"))
}

fn skip(told: Option<&str>) -> Result<i64, String> {
    told.map_or(Ok(0), |told| {
        told.parse().map_err(|_| format!("skips '{told}' bytes or lines, which is no whole number"))
    })
}

impl Fields {
    /// Reads where the voxels lie.
    fn place(&mut self, told: &BTreeMap<String, String>) -> Result<(), String> {
        let field = |name: &str| told.get(name).map(String::as_str);
        if let Some(list) = field("space directions") {
            let mut axes = vectors(list)?.into_iter();
            let places = [0, 1, 2].map(|_| axes.next().flatten());
            for (axis, direction) in places.iter().enumerate() {
                let Some(direction) = direction else { continue };
                let length = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
                self.spacing[axis] = (length > 0.0).then_some(length);
                if direction.get(axis).is_none_or(|&along| (along - length).abs() > 1e-6 * length) {
                    self.note(
                        "its axes are turned in space, which is left aside: the axes of the file are taken as x, y, z",
                    );
                }
            }
        } else if let Some(list) = field("spacings") {
            let numbers: Vec<Option<f64>> = list.split_whitespace().map(|text| text.parse().ok()).collect();
            for (axis, spacing) in numbers.into_iter().take(3).enumerate() {
                self.spacing[axis] = spacing.filter(|h: &f64| h.is_finite() && *h > 0.0);
            }
        }
        if let Some(origin) =
            field("space origin").map(vectors).transpose()?.and_then(|list| list.into_iter().next().flatten())
        {
            origin.iter().take(3).enumerate().for_each(|(axis, &v)| self.origin[axis] = v);
        }
        let Some(list) = field("space units").or(field("units")) else { return Ok(()) };
        let written: Vec<&str> = list.split('"').filter(|text| !text.trim().is_empty()).collect();
        let unit = |axis: usize| written.get(axis).copied().unwrap_or_default();
        let found = units::spacing([0, 1, 2].map(|axis| self.spacing[axis].map(|h| (h, unit(axis)))));
        if found.unit.is_some() {
            // The origin is in the units of the axes.
            for axis in 0..3 {
                if let (Some(old), Some(new)) = (self.spacing[axis], found.sizes[axis]) {
                    self.origin[axis] *= new / old;
                }
            }
            (self.spacing, self.unit) = (found.sizes, found.unit);
        }
        found.notes.iter().for_each(|note| self.note(note));
        Ok(())
    }

    fn note(&mut self, text: &str) {
        if !self.notes.iter().any(|note| note == text) {
            self.notes.push(text.to_owned());
        }
    }
}

/// Vectors `(a,b,c)`, or `none`, with blanks between them.
fn vectors(text: &str) -> Result<Vec<Option<Vec<f64>>>, String> {
    let wrong = || format!("has the vectors '{text}' in its header, which cannot be read");
    let (mut found, mut rest) = (Vec::new(), text.trim());
    while !rest.is_empty() {
        if let Some(after) = rest.strip_prefix("none") {
            found.push(None);
            rest = after.trim_start();
            continue;
        }
        let (inside, after) = rest.strip_prefix('(').and_then(|rest| rest.split_once(')')).ok_or_else(wrong)?;
        let numbers: Option<Vec<f64>> =
            inside.split(',').map(|number| number.trim().parse().ok().filter(|v: &f64| v.is_finite())).collect();
        found.push(Some(numbers.ok_or_else(wrong)?));
        rest = after.trim_start();
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Result<Fields, String> {
        parse(format!("NRRD0004\n{text}\nencoding: raw\n\nvoxels").as_bytes())
    }

    #[test]
    fn fields_are_understood() {
        let found = parsed(
            "# comment\ntype: short\ndimension: 3\nsizes: 4 3 2\nendian: big\nspace directions: (2,0,0) (0,0.5,0) (0,0,1e3)\n\
             space units: \"um\" \"um\" \"nm\"\nspace origin: (1,-2,3e3)\nkey:=value",
        )
        .unwrap();
        assert_eq!((found.number, found.order, found.sizes), (Number::I16, ByteOrder::Big, vec![4, 3, 2]));
        assert_eq!((found.spacing, found.unit.as_deref()), ([Some(2.0), Some(0.5), Some(1.0)], Some("micrometer")));
        assert_eq!((found.origin, found.notes.len()), ([1.0, -2.0, 3.0], 0));
        let turned = parsed("type: uchar\ndimension: 3\nsizes: 4 3 2\nspace directions: (0,2,0) (2,0,0) none").unwrap();
        assert_eq!((turned.spacing, turned.notes.len()), ([Some(2.0), Some(2.0), None], 1));
    }

    #[test]
    fn what_cannot_be_is_refused() {
        for (text, reason) in [
            ("dimension: 3\nsizes: 1 2 3", "'type'"),
            ("type: block\ndimension: 3\nsizes: 1 2 3", "'block'"),
            ("type: short\ndimension: 3\nsizes: 1 2 3", "'endian'"),
            ("type: uchar\ndimension: 3\nsizes: 1 2", "2 sizes"),
            ("type: uchar\ndimension: 3\nsizes: 1 0 2", "cannot be worked on"),
            ("type: uchar\ndimension: 3\nsizes: 2000000000 2000000000 2000000000", "cannot be worked on"),
            ("type: uchar\ndimension: 3\nsizes: 1 -2 2", "no whole numbers"),
            ("type: uchar\ndimension: 3\nsizes: 1 2 2\nspace origin: (1,2", "cannot be read"),
            ("type: uchar\ndimension: 3\nsizes: 1 2 2\nspace origin: (1,2,inf)", "cannot be read"),
            ("type: uchar\ndimension: 3\nsizes: 1 2 2\nbyte skip: -2", "byte skip"),
        ] {
            let found = parsed(text).unwrap_err();
            assert!(found.contains(reason), "{text}: {found}");
        }
    }
}
