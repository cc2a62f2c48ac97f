//! Outlines as they were drawn: the points of a shape in their order, ellipses from the corners of their boxes.

use std::collections::BTreeMap;

use super::corner::{Corner, ShapeKind};
use crate::grid::PointCloud;
use crate::io::geometry::read::ellipse::ellipse;

/// The cloud whose points stand in the order of their shapes, and what is to be told of these. Times follow their points.
pub(crate) fn drawn(cloud: &PointCloud, corners: &[Corner], times: &mut Vec<i64>) -> (PointCloud, Vec<String>) {
    let mut shapes: BTreeMap<(u32, i64), Vec<usize>> = BTreeMap::new();
    for n in 0..cloud.len() {
        let object = cloud.objects.get(n).copied().unwrap_or(1);
        let contour = cloud.contours.get(n).copied().unwrap_or(0);
        shapes.entry((object, contour)).or_default().push(n);
    }
    let (mut found, mut found_times) = (PointCloud::default(), Vec::new());
    let (mut open, mut lines) = (0, 0);
    for ((object, contour), mut points) in shapes {
        points.sort_by_key(|&n| corners[n].vertex.unwrap_or(n as i64));
        let kind = corners[points[0]].kind;
        let marks: Vec<[f64; 3]> = points.iter().map(|&n| cloud.positions[n]).collect();
        let outline = match (kind, marks.as_slice()) {
            (ShapeKind::Ellipse, &[a, b, c, d]) => ellipse([a, b, c, d]),
            _ => marks,
        };
        open += usize::from(kind == ShapeKind::Open);
        lines += usize::from(outline.len() < 3);
        found.objects.extend(cloud.objects.first().map(|_| vec![object; outline.len()]).unwrap_or_default());
        found.contours.extend(cloud.contours.first().map(|_| vec![contour; outline.len()]).unwrap_or_default());
        found_times.extend(times.get(points[0]).map(|&time| vec![time; outline.len()]).unwrap_or_default());
        found.positions.extend(outline);
    }
    *times = found_times;
    let mut notes = Vec::new();
    if open > 0 {
        let what = if open == 1 { "one path is".into() } else { format!("{open} paths are") };
        notes.push(format!("{what} taken as closed: an outline runs all around its object"));
    }
    if lines > 0 {
        let what = if lines == 1 { "one shape has".into() } else { format!("{lines} shapes have") };
        notes.push(format!("{what} fewer than three points: these enclose nothing and count as single marks"));
    }
    (found, notes)
}
