//! Vertices of a mesh against the image that it was drawn from: where u = 1/2 is crossed between two voxels, as far as the file's
//! numbers tell, or where labels meet.

use std::collections::BTreeMap;

use super::found::{Check, Fault};
use super::structure::Image;
use super::voxels::read;
use crate::error::Result;
use crate::exec::{Engine, Workers};
use crate::grid::{Box3, Geometry, TriangleMesh};
use crate::kernel::surface::fraction;
use crate::store::Element;

/// Voxels along the edge of the boxes that vertices are gathered by.
const EDGE: i64 = 63;
/// Voxels around these that are looked at.
const MARGIN: i64 = 1;

/// The voxel below a vertex, and what is wrong with its place.
type Off = ([i64; 3], String);

/// What a mesh was drawn from.
#[derive(Clone, Copy)]
pub(super) enum DrawnFrom<'a> {
    /// A level set: vertices lie on u = 1/2.
    LevelSet(&'a Image),
    /// The same with vertices that were moved from there, so far at most: no farther than from a voxel to the next.
    Moved(&'a Image, f64),
    /// Labels: each vertex has two of them in its cell of voxels, or one voxel beside it.
    Labels(&'a Image),
    /// The same where what has no label, and what lies around the image, counts as one.
    Bounded(&'a Image),
}

impl<'a> DrawnFrom<'a> {
    fn image(self) -> &'a Image {
        match self {
            Self::LevelSet(image) | Self::Moved(image, _) | Self::Labels(image) | Self::Bounded(image) => image,
        }
    }

    /// Where vertices lie, in words.
    pub(super) fn told(self) -> String {
        match self {
            Self::LevelSet(image) => format!("on the surface u = 1/2 of {}", image.name()),
            Self::Moved(image, most) => format!("within {most} of the surface u = 1/2 of {}", image.name()),
            Self::Labels(image) | Self::Bounded(image) => format!("where {} changes", image.name()),
        }
    }

    /// What is wrong with vertices in a box.
    fn compare(self, members: &[u32], mesh: &TriangleMesh, eps: f64, part: &Box3, name: &str) -> Check {
        let mut found = Check::default();
        let geometry = &self.image().reader.levels()[0].geometry;
        let judge: Box<dyn Fn([f64; 3]) -> Option<Off>> = match self {
            Self::LevelSet(image) => {
                let Some(values) = padded::<f32>(image, part, &mut found) else { return found };
                Box::new(move |position| off(geometry, position, eps, (&values, part)))
            }
            Self::Moved(image, most) => {
                let Some(values) = padded::<f32>(image, part, &mut found) else { return found };
                Box::new(move |position| far(geometry, position, (most, eps), (&values, part)))
            }
            Self::Labels(image) | Self::Bounded(image) => {
                let is_bounded = matches!(self, Self::Bounded(_));
                let Some(values) = padded::<u32>(image, part, &mut found) else { return found };
                Box::new(move |position| in_one_label(geometry, position, (&values, part), is_bounded))
            }
        };
        for &n in members {
            let position = mesh.vertices[n as usize];
            if let Some((voxel, text)) = judge(position) {
                let text = format!("vertex {n} at {position:?} {text}");
                found.add(Fault { file: Some(name.to_owned()), voxel: Some(voxel), text });
            }
        }
        found
    }
}

/// Compares all vertices with what they were drawn from, box by box; `eps` is the last place of the file's numbers.
///
/// # Errors
/// When the run is interrupted.
pub(super) fn check(
    engine: &Engine,
    (mesh, eps): (&TriangleMesh, f64),
    name: &str,
    from: DrawnFrom<'_>,
    found: &mut Check,
) -> Result<()> {
    let geometry = &from.image().reader.levels()[0].geometry;
    let mut boxes: BTreeMap<[i64; 3], Vec<u32>> = BTreeMap::new();
    for (n, vertex) in mesh.vertices.iter().enumerate() {
        let cell = geometry.to_voxels(*vertex).map(|v| (v.floor() as i64).div_euclid(EDGE));
        boxes.entry([cell[2], cell[1], cell[0]]).or_default().push(n as u32);
    }
    let boxes: Vec<([i64; 3], Vec<u32>)> = boxes.into_iter().collect();
    let stage = engine.stage(name, boxes.len() as u64);
    let parts = stage.run(&boxes, &Workers::none(), |(), ([z, y, x], members)| {
        let lo = [*x, *y, *z].map(|cell| cell * EDGE);
        let part = Box3::from_shape([EDGE + 1; 3]).translate(lo).grow(MARGIN);
        Ok(from.compare(members, mesh, eps, &part, name))
    })?;
    stage.finish();
    found.take_all(parts);
    Ok(())
}

/// The values of a box that may reach out of the field, where it is nothing.
fn padded<T: Element>(field: &Image, part: &Box3, found: &mut Check) -> Option<Vec<T>> {
    let mut values = vec![T::default(); part.len()];
    let inside = part.intersect(&field.reader.levels()[0].geometry.domain());
    if inside.is_empty() {
        return Some(values);
    }
    let stored = read::<T>(field, 0, &inside, found)?;
    let width = inside.shape()[0] as usize;
    for (row, (y, z)) in stored.chunks_exact(width).zip(inside.rows()) {
        values[part.offset_of([inside.lo[0], y, z])..][..width].copy_from_slice(row);
    }
    Some(values)
}

/// What is wrong with the place of a vertex, and the voxel below it.
fn off(geometry: &Geometry, position: [f64; 3], eps: f64, (values, part): (&[f32], &Box3)) -> Option<Off> {
    let place = geometry.to_voxels(position);
    // What rounding moves it, in voxels; on the way from the world to voxels places lose digits too.
    let slack: [f64; 3] = std::array::from_fn(|a| {
        eps * position[a].abs() / geometry.spacing[a] + 1e-12 * (1.0 + (geometry.origin[a] / geometry.spacing[a]).abs())
    });
    let from_voxel = |a: usize| (place[a] - place[a].round()).abs();
    let axis = (0..3).max_by(|&a, &b| from_voxel(a).total_cmp(&from_voxel(b)))?;
    let mut lower: [i64; 3] = place.map(|v| v.round() as i64);
    lower[axis] = place[axis].floor() as i64;
    if let Some(other) = (0..3).find(|&a| a != axis && from_voxel(a) > slack[a]) {
        let off = from_voxel(other).min(from_voxel(axis));
        return Some((
            lower,
            format!("lies between no two voxels that are neighbours: {off} voxels beside their line"),
        ));
    }
    let mut upper = lower;
    upper[axis] += 1;
    if !(part.contains(lower) && part.contains(upper)) {
        return Some((lower, "lies outside of the field".into()));
    }
    let [below, above] = [lower, upper].map(|voxel| values[part.offset_of(voxel)]);
    if (below >= 0.5) == (above >= 0.5) {
        return Some((lower, format!("lies between u = {below} and {above}, where 1/2 is not crossed")));
    }
    let expected = fraction(below, above, 0.5);
    let at = place[axis] - lower[axis] as f64;
    ((at - expected).abs() > slack[axis])
        .then(|| (lower, format!("lies {at} of the way from u = {below} to {above}; 1/2 is at {expected}")))
}

/// What is wrong with the place of a vertex that was moved so far at most, and the voxel below it.
fn far(
    geometry: &Geometry,
    position: [f64; 3],
    (most, eps): (f64, f64),
    (values, part): (&[f32], &Box3),
) -> Option<Off> {
    let place = geometry.to_voxels(position);
    let lower: [i64; 3] = place.map(|v| v.floor() as i64);
    // Where u crosses 1/2 on the lines between the voxels around and those beside them.
    let around = Box3::new(lower, lower.map(|v| v + 2)).grow(MARGIN).intersect(part);
    let mut nearest = f64::INFINITY;
    let voxels = around.rows().flat_map(|(y, z)| (around.lo[0]..around.hi[0]).map(move |x| [x, y, z]));
    for (voxel, axis) in voxels.flat_map(|voxel| (0..3).map(move |axis| (voxel, axis))) {
        let mut upper = voxel;
        upper[axis] += 1;
        if !around.contains(upper) {
            continue;
        }
        let [below, above] = [voxel, upper].map(|voxel| values[part.offset_of(voxel)]);
        if (below >= 0.5) != (above >= 0.5) {
            let mut crossing = voxel.map(|v| v as f64);
            crossing[axis] += fraction(below, above, 0.5);
            let away = (0..3).map(|a| ((crossing[a] - place[a]) * geometry.spacing[a]).powi(2)).sum::<f64>();
            nearest = nearest.min(away.sqrt());
        }
    }
    let reach = position.iter().chain(&geometry.origin).fold(0.0_f64, |most, v| most.max(v.abs()));
    let slack = 2.0 * eps * reach + 1e-9 * geometry.max_spacing();
    (nearest > most.min(geometry.min_spacing()) + slack)
        .then(|| (lower, format!("lies {nearest} from where u crosses 1/2, more than {most}")))
}

/// What is wrong with the place of a vertex between labels, and the voxel below it.
fn in_one_label(
    geometry: &Geometry,
    position: [f64; 3],
    (values, part): (&[u32], &Box3),
    is_bounded: bool,
) -> Option<Off> {
    let lower: [i64; 3] = geometry.to_voxels(position).map(|v| v.floor() as i64);
    let around = Box3::new(lower, lower.map(|v| v + 2)).grow(MARGIN).intersect(part);
    let mut first = None;
    for (y, z) in around.rows() {
        let row = part.offset_of([around.lo[0], y, z]);
        for &label in values[row..][..around.shape()[0] as usize].iter().filter(|label| is_bounded || **label > 0) {
            if *first.get_or_insert(label) != label {
                return None;
            }
        }
    }
    Some((lower, format!("lies in the midst of label {}", first.unwrap_or(0))))
}
