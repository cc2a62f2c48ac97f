//! Which columns of a table hold what, told from the names in its header.
//!
//! Every program has names of its own: `x`, `Position X` (Imaris), `POSITION_X` (`TrackMate`), `x (um)`, `CentroidX`,
//! `Points:0` (`ParaView`), `axis-0` (napari, z first), `centroid-0` (scikit-image, z first), `Slice` in place of z (ImageJ,
//! counted from 1). Words that only say that a position follows are passed over; columns with any other word, such as a
//! velocity's, are none.

use super::words::{Name, families};
use crate::error::{Error, Result};
use crate::io::geometry::read::point_file::Scale;
use crate::io::geometry::read::point_units::{LengthUnit, Unit};
use crate::io::text::quoted;

/// What wrote a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Form {
    /// Columns by names that no program has for itself.
    Named,
    /// Three numbers a line, and no names.
    FirstThree,
    NapariPoints,
    NapariShapes,
    TrackMate,
    Imaris,
    ImageJ,
    Regions,
    MorphoGraphX,
}

/// The places of the columns that matter, counted from 0.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Columns {
    pub(crate) form: Form,
    /// Columns of x, y and z.
    pub(crate) position: [usize; 3],
    /// How each of them counts.
    pub(crate) scales: [Scale; 3],
    /// Their units, where the header tells them.
    pub(crate) units: [Option<LengthUnit>; 3],
    pub(crate) object: Option<usize>,
    pub(crate) contour: Option<usize>,
    /// The place of a point in its outline, and what kind of outline that is.
    pub(crate) vertex: Option<usize>,
    pub(crate) shape: Option<usize>,
    /// The time, and the number of the first one.
    pub(crate) time: Option<(usize, i64)>,
    /// A column that holds the unit of the others.
    pub(crate) unit: Option<usize>,
    /// A column that may tell objects, where none is named so.
    pub(crate) label: Option<(usize, &'static str)>,
}

impl Columns {
    /// x, y, z first and nothing else of use.
    pub(crate) const FIRST_THREE: Self = Self::at(Form::FirstThree, [0, 1, 2], Scale::Physical);
    /// The text form of `MorphoGraphX` meshes: a number, the position, a label.
    pub(crate) const MORPHOGRAPHX: Self = Self::at(Form::MorphoGraphX, [1, 2, 3], Scale::Physical);

    const fn at(form: Form, position: [usize; 3], scale: Scale) -> Self {
        Self {
            form,
            position,
            scales: [scale; 3],
            units: [None; 3],
            object: None,
            contour: None,
            vertex: None,
            shape: None,
            time: None,
            unit: None,
            label: None,
        }
    }

    /// The columns beside the position that are read of every line, and what they hold.
    pub(crate) fn others(&self) -> impl Iterator<Item = (usize, &'static str)> {
        let time = self.time.map(|(column, _)| column);
        let all = [
            (self.object, "object"),
            (self.contour, "contour"),
            (self.vertex, "vertex-index"),
            (self.shape, "shape-type"),
            (time, "the time"),
            (self.unit, "the unit"),
        ];
        all.into_iter().filter_map(|(column, what)| Some((column?, what)))
    }

    /// Finds the columns by the names in a header; upper and lower case are the same.
    pub(crate) fn named(names: &[&str]) -> Result<Self> {
        let plain: Vec<String> = names.iter().map(|n| n.trim().trim_matches('"').to_lowercase()).collect();
        let has = |wanted: &str| plain.iter().any(|n| n == wanted);
        let mut columns = match Self::zyx(&plain, "axis-", Form::NapariPoints)? {
            Some(napari) if !["x", "y", "z"].into_iter().all(has) => napari,
            _ => Self::by_words(names, &plain)?,
        };
        columns.object = one_column(&plain, "object")?;
        columns.contour = one_column(&plain, "contour")?;
        if columns.object.is_none() {
            let label = |n: usize| Some((n, *LABELS.iter().find(|&&label| label == plain[n])?));
            columns.label = (0..plain.len()).find_map(label);
        }
        match columns.form {
            Form::NapariPoints if has("vertex-index") || has("shape-type") => {
                columns.form = Form::NapariShapes;
                columns.vertex = one_column(&plain, "vertex-index")?;
                columns.shape = one_column(&plain, "shape-type")?;
                columns.contour = columns.contour.or(one_column(&plain, "index")?);
            }
            Form::TrackMate => columns.time = one_column(&plain, "frame")?.map(|column| (column, 0)),
            Form::Imaris => {
                columns.time = one_column(&plain, "time")?.map(|column| (column, 1));
                columns.unit = one_column(&plain, "unit")?;
            }
            Form::ImageJ => columns.time = one_column(&plain, "frame")?.map(|column| (column, 1)),
            _ if columns.time.is_none() => columns.time = one_column(&plain, "t")?.map(|column| (column, 0)),
            _ => {}
        }
        Ok(columns)
    }

    /// Numbered axes, z, y, x, perhaps after a time.
    fn zyx(plain: &[String], prefix: &str, form: Form) -> Result<Option<Self>> {
        let place = |axis: usize| one_column(plain, &format!("{prefix}{axis}"));
        let mut axes = Vec::new();
        while let Some(column) = place(axes.len())? {
            axes.push(column);
        }
        let named = |axis: usize| format!("{prefix}{axis}");
        match *axes {
            [z, y, x] => Ok(Some(Self::at(form, [x, y, z], Scale::Voxels))),
            [t, z, y, x] => Ok(Some(Self { time: Some((t, 0)), ..Self::at(form, [x, y, z], Scale::Voxels) })),
            [_, _] => Err(Error::input(format!(
                "names two axes, {} and {} (y, x); a point needs three (z, y, x): mark on the whole stack",
                named(0),
                named(1)
            ))),
            [_, _, _, _, _, ..] => Err(Error::input(format!(
                "names more than four axes; keep {}, {}, {} (z, y, x), or four with the time first",
                named(0),
                named(1),
                named(2)
            ))),
            _ => Ok(None),
        }
    }

    fn by_words(names: &[&str], plain: &[String]) -> Result<Self> {
        let has = |wanted: &str| plain.iter().any(|n| n == wanted);
        let read: Vec<Option<Name>> = names.iter().map(|name| Name::of(name)).collect();
        let slice = (0..plain.len()).find(|&n| ["slice", "slice number", "slice_number"].contains(&plain[n].as_str()));
        let mut missing = vec!["x", "y", "z"];
        for (family, in_voxels) in families(&read) {
            let mut found = [None; 3];
            for (axis, place) in found.iter_mut().enumerate() {
                let of_family = |name: &Name| {
                    name.family == family && name.axis == axis && in_voxels.is_none_or(|v| v == name.in_voxels())
                };
                let mut columns = (0..read.len()).filter(|&n| read[n].as_ref().is_some_and(of_family));
                *place = columns.next();
                // Of columns that only differ in their units one was meant.
                if in_voxels.is_some() && columns.next().is_some() {
                    let name = ["x", "y", "z"][axis];
                    return Err(Error::input(format!("names the column {name} twice; leave one")));
                }
            }
            let lacking: Vec<&str> = (0..3).filter(|&a| found[a].is_none()).map(|a| ["x", "y", "z"][a]).collect();
            let ([Some(x), Some(y), Some(z)], is_slice) = (match found {
                [Some(_), Some(_), None] => ([found[0], found[1], slice], true),
                found => (found, false),
            }) else {
                if lacking.len() < missing.len() {
                    missing = lacking;
                }
                continue;
            };
            return Ok(Self::of_words(&read, [x, y, z], is_slice, plain));
        }
        if let Some(regions) = Self::zyx(plain, "centroid-", Form::Regions)? {
            return Ok(regions);
        }
        let hint = if has("x") && has("y") { " (or slice, counted from 1)" } else { "" };
        Err(Error::input(format!(
            "names the columns {} but not {}; name three columns x, y, z{hint}",
            quoted(&plain.join(", ")),
            missing.join(", ")
        )))
    }

    fn of_words(read: &[Option<Name>], position: [usize; 3], is_slice: bool, plain: &[String]) -> Self {
        let has = |wanted: &str| plain.iter().any(|n| n == wanted);
        let form = if position.iter().all(|&n| plain[n].starts_with("position_")) && (has("track_id") || has("frame")) {
            Form::TrackMate
        } else if has("category") && (has("collection") || has("unit")) {
            Form::Imaris
        } else if is_slice || (plain[0].is_empty() && (has("area") || has("mean") || has("frame"))) {
            Form::ImageJ
        } else {
            Form::Named
        };
        let unit = |axis: usize| read[position[axis]].as_ref().and_then(|name| name.unit);
        let mut columns = Self::at(form, position, Scale::Physical);
        for axis in 0..3 {
            match unit(axis) {
                _ if axis == 2 && is_slice => columns.scales[axis] = Scale::Slices,
                Some(Unit::Voxels) => columns.scales[axis] = Scale::Voxels,
                Some(Unit::Length(length)) => columns.units[axis] = Some(length),
                None => {}
            }
        }
        columns
    }
}

/// Columns that often tell which object a point is of, though that is not what their names say here.
const LABELS: [&str; 12] = [
    "label",
    "labels",
    "object_id",
    "object id",
    "objectid",
    "object number",
    "cell",
    "cell_id",
    "cell id",
    "cellid",
    "segment",
    "nucleus",
];

/// The column of that name, where there is one.
fn one_column(names: &[String], name: &str) -> Result<Option<usize>> {
    let mut places = (0..names.len()).filter(|&i| names[i] == name);
    let first = places.next();
    match places.next() {
        None => Ok(first),
        Some(_) => Err(Error::input(format!("names the column {name} twice; leave one"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_found_in_any_order_and_case() {
        let found = Columns::named(&["Object", " Z ", "note", "\"Y\"", "X"]).unwrap();
        assert_eq!((found.position, found.object, found.contour), ([4, 3, 1], Some(0), None));
        let napari = Columns::named(&["index", "axis-0", "axis-1", "axis-2"]).unwrap();
        assert_eq!((napari.position, napari.scales, napari.form), ([3, 2, 1], [Scale::Voxels; 3], Form::NapariPoints));
    }

    #[test]
    fn names_of_many_programs() {
        let micrometre = LengthUnit::named("um");
        for (names, position, unit) in [
            ("Position X|Position Y|Position Z|Unit|Category|Collection|Time", [0, 1, 2], None),
            ("LABEL|QUALITY|POSITION_X|POSITION_Y|POSITION_Z|FRAME", [2, 3, 4], None),
            ("x (um)|y (um)|z (um)", [0, 1, 2], micrometre),
            ("X [\u{b5}m]|Y [\u{b5}m]|Z [\u{b5}m]", [0, 1, 2], micrometre),
            ("z_um|y_um|x_um", [2, 1, 0], micrometre),
            ("CentroidX|CentroidY|CentroidZ|VelocityX", [0, 1, 2], None),
            ("velocity_x|velocity_y|velocity_z|xpos|ypos|zpos", [3, 4, 5], None),
            ("Points:0|Points:1|Points:2|Normals:0", [0, 1, 2], None),
            ("center_of_mass_x|center_of_mass_y|center_of_mass_z", [0, 1, 2], None),
            ("x [px]|y [px]|z [px]|x [um]|y [um]|z [um]", [3, 4, 5], micrometre),
        ] {
            let found = Columns::named(&names.split('|').collect::<Vec<_>>()).unwrap();
            assert_eq!((found.position, found.units), (position, [unit; 3]), "{names}");
            assert_eq!(found.scales, [Scale::Physical; 3], "{names}");
        }
    }

    #[test]
    fn voxels_and_slices_are_told_by_axis() {
        use Scale::{Physical, Slices, Voxels};
        for (names, scales) in [
            ("x [px]|y [px]|z [um]", [Voxels, Voxels, Physical]),
            ("x_px|y_px|z_px", [Voxels; 3]),
            (" |Area|X|Y|Slice", [Physical, Physical, Slices]),
            ("label|centroid-0|centroid-1|centroid-2", [Voxels; 3]),
        ] {
            let found = Columns::named(&names.split('|').collect::<Vec<_>>()).unwrap();
            assert_eq!(found.scales, scales, "{names}");
        }
    }

    #[test]
    fn shapes_have_outlines_and_times_come_first() {
        let names = ["index", "shape-type", "vertex-index", "axis-0", "axis-1", "axis-2", "axis-3"];
        let found = Columns::named(&names).unwrap();
        assert_eq!((found.form, found.position), (Form::NapariShapes, [6, 5, 4]));
        assert_eq!((found.contour, found.shape, found.vertex, found.time), (Some(0), Some(1), Some(2), Some((3, 0))));
    }

    #[test]
    fn unusable_headers_are_refused() {
        for (names, reason) in [
            (&["a", "x"][..], "not y, z"),
            (&["x", "y", "z", "X"], "twice"),
            (&["x", "y", "z", "object", "object"], "twice"),
            (&["axis-0", "axis-1", "axis-2", "axis-3", "axis-4"], "axes"),
            (&["axis-0", "axis-1"], "two axes"),
            (&["speed x", "speed y", "speed z"], "name three columns x, y, z"),
        ] {
            let message = Columns::named(names).unwrap_err().to_string();
            assert!(message.contains(reason), "{message}");
        }
    }
}
