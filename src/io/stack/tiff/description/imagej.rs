//! The `ImageDescription` that ImageJ writes: lines of `key=value` after `ImageJ=version`.
//!
//! Keys as in ImageJ's `TiffDecoder`/`FileOpener`: `images, channels, slices, frames, spacing, unit, yunit, zunit,
//! finterval, tunit`. Planes run
//! channel first, then slice, then frame. The xy spacing lies in the resolution tags, in pixels per unit.

use super::layout::{Axis, Description, Dimensions};
use crate::io::stack::interval::Interval;
use crate::io::stack::units;
use crate::io::stack::units::Unit;

/// True when ImageJ wrote the description.
pub(crate) fn is_imagej(text: &str) -> bool {
    text.starts_with("ImageJ=")
}

/// Whether it names the unit of its lengths.
pub(crate) fn names_unit(text: &str) -> bool {
    text.lines().any(|line| {
        line.strip_prefix("unit").is_some_and(|rest| rest.trim_start().trim_start_matches('=').trim() != "")
    })
}

/// Reads the description; `pages` is the number of pages in the file, `xy` the pixel size from the resolution tags and
/// `tagged` the unit that these name, in which everything is where the description names none.
pub(crate) fn parse(text: &str, pages: u64, xy: [Option<f64>; 2], tagged: Option<&str>) -> Description {
    let value =
        |key: &str| text.lines().find_map(|line| line.strip_prefix(key)?.trim_start().strip_prefix('=')).map(str::trim);
    let number = |key: &str| value(key).and_then(|v| v.parse::<u64>().ok()).filter(|&n| n > 0);
    let unit = value("unit").filter(|unit| !unit.is_empty()).or(tagged).unwrap_or_default();
    // ImageJ names the units of y and z only where they are others.
    let own = |key: &str| value(key).filter(|own| !own.is_empty()).unwrap_or(unit);
    let z = value("spacing").and_then(units::size);
    let mut units = [unit, own("yunit"), own("zunit")];
    if let (Some(z), false, None) = (z, names_unit(text), value("zunit")) {
        units[2] = units::of_bare_size(z, xy, unit);
    }
    let sizes = [xy[0], xy[1], z];
    // Without a unit the tags hold 1 pixel per pixel: nothing that was measured. ImageJ writes a spacing of 0 for one slice.
    let measured = |size: f64, unit: &str| size != 0.0 && (size != 1.0 || units::parse(unit) != Unit::Pixel);
    let written = std::array::from_fn(|a| sizes[a].filter(|&s| measured(s, units[a])).map(|s| (s, units[a])));
    let spacing = units::spacing(written);
    let mut notes = spacing.notes;
    notes.extend(z.and_then(|z| units::bare_note(z, unit, units[2])).filter(|_| !names_unit(text)));
    let images = number("images").unwrap_or(pages);
    let dimensions = dimensions(images, [number("channels"), number("slices"), number("frames")]);
    let apart = number("channels").is_some_and(|c| c > 1) || number("frames").is_some_and(|t| t > 1);
    if apart && dimensions == Dimensions::only_z(images) {
        notes
            .push(format!("channels, slices and frames do not multiply to {images} images: all were taken for slices"));
    }
    notes.extend(origin_note([value("xorigin"), value("yorigin"), value("zorigin")]));
    let interval = value("finterval").and_then(|text| text.parse().ok());
    Description {
        interval: interval.and_then(|step| Interval::told(step, value("tunit").unwrap_or("sec"))),
        dimensions: Some(dimensions),
        spacing: spacing.sizes,
        unit: spacing.unit,
        single_page: true,
        notes,
        ..Description::none()
    }
}

/// What is to be known of a place that `ImageJ` counts lengths from, in voxels; other programs count from the first one.
fn origin_note(written: [Option<&str>; 3]) -> Option<String> {
    let origin = written.map(|text| text.and_then(units::size).unwrap_or(0.0));
    let [x, y, z] = origin;
    (origin != [0.0; 3]).then(|| {
        format!(
            "ImageJ counts lengths in it from voxel {x}, {y}, {z}; here they count from the centre of the first voxel, so \
             points in lengths that ImageJ wrote have to be moved by that"
        )
    })
}

/// Channels, slices and frames; as in ImageJ a stack whose numbers do not multiply to `images` is one of slices alone.
fn dimensions(images: u64, [channels, slices, frames]: [Option<u64>; 3]) -> Dimensions {
    let (c, t) = (channels.unwrap_or(1), frames.unwrap_or(1));
    let rest = c.checked_mul(t).filter(|ct| images.is_multiple_of(*ct)).map(|ct| images / ct);
    let z = slices.or(rest).unwrap_or(1);
    let stated = Dimensions([(Axis::Channel, c), (Axis::Z, z), (Axis::Time, t)]);
    if stated.count() == Some(images) { stated } else { Dimensions::only_z(images) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hyperstack_with_escaped_unit() {
        let text = "ImageJ=1.53f\nimages=84\nchannels=2\nslices=14\nframes=3\nunit=\\u00B5m\nspacing=-0.4\nmin=2.0\n";
        let d = parse(text, 84, [Some(0.1), Some(0.2)], None);
        assert_eq!(d.dimensions, Some(Dimensions([(Axis::Channel, 2), (Axis::Z, 14), (Axis::Time, 3)])));
        assert_eq!(d.spacing, [Some(0.1), Some(0.2), Some(0.4)]);
        assert_eq!(d.unit.as_deref(), Some("micrometer"));
    }

    #[test]
    fn missing_and_contradictory_numbers() {
        let dims = |text: &str, pages| parse(text, pages, [None; 2], None).dimensions;
        assert_eq!(dims("ImageJ=1\n", 7), Some(Dimensions::only_z(7)));
        assert_eq!(dims("ImageJ=1\nimages=7\nchannels=2\n", 7), Some(Dimensions::only_z(7)));
        let two = Dimensions([(Axis::Channel, 2), (Axis::Z, 3), (Axis::Time, 1)]);
        assert_eq!(dims("ImageJ=1\nimages=6\nchannels=2\n", 6), Some(two));
        assert_eq!(
            dims("ImageJ=1\nimages=6\nchannels=0\nslices=99999999999999999999\n", 6),
            Some(Dimensions::only_z(6))
        );
    }

    #[test]
    fn pixels_are_no_spacing() {
        let d = parse("ImageJ=1\nimages=3\nspacing=1.0\n", 3, [Some(1.0), Some(1.0)], None);
        assert_eq!((d.spacing, d.unit), ([None; 3], None));
        let d = parse("ImageJ=1\nimages=3\nunit=um\nspacing=1.0\n", 3, [Some(1.0), None], None);
        assert_eq!(d.spacing, [Some(1.0), None, Some(1.0)]);
    }

    #[test]
    fn an_origin_is_told() {
        let notes = |text: &str| parse(&format!("ImageJ=1\nimages=3\n{text}"), 3, [None; 2], None).notes;
        assert!(notes("xorigin=10\nyorigin=-2.5\n")[0].contains("from voxel 10, -2.5, 0;"));
        assert!(notes("xorigin=0\nyorigin=0.0\nzorigin=0\n").is_empty());
    }

    #[test]
    fn units_of_y_and_z_of_their_own() {
        let of = |text: &str, tagged| {
            let d = parse(&format!("ImageJ=1\nimages=3\n{text}"), 3, [Some(0.5), Some(500.0)], tagged);
            (d.spacing.map(|s| s.map(|s| (s * 1e9).round() / 1e9)), d.unit)
        };
        let um = Some("micrometer".to_string());
        assert_eq!(
            of("unit=um\nyunit=nm\nzunit=mm\nspacing=0.002\n", None),
            ([Some(0.5), Some(0.5), Some(2.0)], um.clone())
        );
        assert_eq!(of("unit=um\nyunit=nm\nspacing=2\n", None), ([Some(0.5), Some(0.5), Some(2.0)], um.clone()));
        assert_eq!(of("unit=um\nyunit=nm\nzunit=blob\nspacing=2\n", None), ([Some(0.5), Some(0.5), None], um));
        let cm = Some("centimeter".to_string());
        assert_eq!(of("spacing=2,5\n", Some("cm")), ([Some(0.5), Some(500.0), Some(2.5)], cm));
    }
}
