//! A mesh against the field that it is the surface of: every vertex lies where u = 1/2 is crossed between two voxels, as far as the
//! file's numbers tell, and the mesh measures what the report says.

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::Value;

use super::found::{Check, Fault};
use super::structure::Image;
use super::voxels::read;
use crate::error::Result;
use crate::exec::{Engine, Workers};
use crate::grid::{Box3, Geometry, TriangleMesh};
use crate::io::geometry::read::source::Source;
use crate::io::geometry::read::sources::read_source;
use crate::kernel::surface::{SurfaceMeasure, fraction};

/// Voxels along the edge of the boxes that vertices are gathered by.
const EDGE: i64 = 63;
/// Bytes in memory for each of the file: vertices in double precision, triangles, their edges, and numbers gathered by box.
const MEMORY: u64 = 6;

/// Compares the mesh of an object of a segmentation, in a folder, with its level set and with what is told of it.
///
/// # Errors
/// As [`check`].
pub(super) fn check_object(
    engine: &Engine,
    store: &Path,
    (images, folder): (&[Image], &str),
    object: &Value,
) -> Result<Check> {
    let of = |group: &str| images.iter().find(|image| image.group == group);
    let own = format!("object-{}", object["label"]);
    let alone = of("levelset");
    let mesh = if alone.is_some() { format!("{folder}/surface.ply") } else { format!("{folder}/{own}.ply") };
    let field = alone.or_else(|| of(&format!("levelset/{own}")));
    check(engine, store, &mesh, field, object)
}

/// Compares a mesh with a field and with what is told of it.
///
/// # Errors
/// When the memory does not hold the mesh or the run is interrupted.
pub(super) fn check(engine: &Engine, store: &Path, name: &str, field: Option<&Image>, told: &Value) -> Result<Check> {
    let mut found = Check::new(name);
    let path = store.join(name);
    let Ok(file) = path.metadata() else {
        found.wrong_in(name, "is missing");
        return Ok(found);
    };
    let _held = engine.hold(file.len().saturating_mul(MEMORY))?;
    let mesh = match read_source(&path) {
        Ok(Source::Mesh(mesh)) => mesh,
        Ok(Source::Cloud(_)) => TriangleMesh { vertices: Vec::new(), triangles: Vec::new() },
        Err(error) => {
            found.wrong_in(name, error.to_string());
            return Ok(found);
        }
    };
    measures(&mesh, name, told, &mut found);
    found.told = format!("{} triangles and their measures", mesh.len());
    if let Some(field) = field {
        vertices(engine, &mesh, name, field, &mut found)?;
        found.also(&format!(", {} vertices on the surface u = 1/2 of {}", mesh.vertices.len(), field.name()));
    }
    Ok(found)
}

/// How far a number in the file may be from the one that was computed: half of the last place, twice over.
fn rounding(mesh: &TriangleMesh) -> f64 {
    let is_single = mesh.vertices.iter().flatten().all(|&v| f64::from(v as f32) == v);
    if is_single { f64::from(f32::EPSILON) } else { f64::EPSILON }
}

/// Compares counts, area, volume and closedness with the report.
fn measures(mesh: &TriangleMesh, name: &str, told: &Value, found: &mut Check) {
    let (low, high) = mesh.bounds().unwrap_or_default();
    let mut measure = SurfaceMeasure::new(std::array::from_fn(|a| f64::midpoint(low[a], high[a])));
    let mut perimeters = 0.0;
    for (n, triangle) in mesh.triangles.iter().enumerate() {
        let corners = mesh.corners(n);
        measure.add(*triangle, corners);
        perimeters += (0..3).map(|side| length(corners[side], corners[(side + 1) % 3])).sum::<f64>();
    }
    let measures = measure.measures();
    let names: Vec<u32> = (0..mesh.vertices.len() as u32).collect();
    let is_closed = mesh.edges_between(&names).is_closed();
    let mut wrong = |what: &str, told: &Value, is: String| {
        found.wrong_in(name, format!("report.json says {what} {told}; the mesh has {is}"));
    };
    if told["triangles"] != measures.triangles {
        wrong("triangles:", &told["triangles"], measures.triangles.to_string());
    }
    if told["closed"].as_bool().is_some_and(|told| told != is_closed) {
        wrong("closed:", &told["closed"], is_closed.to_string());
    }
    if told["components"].as_u64().is_some_and(|told| told != measures.components) {
        wrong("components:", &told["components"], measures.components.to_string());
    }
    // A place moves by that; an area by that along the sides, a volume by that times the area.
    let reach = low.iter().chain(&high).fold(0.0_f64, |most, v| most.max(v.abs()));
    let moved = rounding(mesh) * reach;
    let near = |told: f64, is: f64, slack: f64| (told - is).abs() <= slack + 1e-9 * is.abs();
    if !told["area"].as_f64().is_some_and(|told| near(told, measures.area, moved * perimeters)) {
        wrong("area:", &told["area"], measures.area.to_string());
    }
    let is_told = told["volume"].as_f64();
    if is_told.is_none_or(|told| !near(told, measures.volume, 2.0 * moved * measures.area)) && is_closed {
        wrong("volume:", &told["volume"], measures.volume.to_string());
    }
}

fn length(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>().sqrt()
}

/// Compares all vertices with the field, box by box.
fn vertices(engine: &Engine, mesh: &TriangleMesh, name: &str, field: &Image, found: &mut Check) -> Result<()> {
    let geometry = &field.reader.levels()[0].geometry;
    let mut boxes: BTreeMap<[i64; 3], Vec<u32>> = BTreeMap::new();
    for (n, vertex) in mesh.vertices.iter().enumerate() {
        let cell = geometry.to_voxels(*vertex).map(|v| (v.floor() as i64).div_euclid(EDGE));
        boxes.entry([cell[2], cell[1], cell[0]]).or_default().push(n as u32);
    }
    let boxes: Vec<([i64; 3], Vec<u32>)> = boxes.into_iter().collect();
    let eps = rounding(mesh);
    let stage = engine.stage(name, boxes.len() as u64);
    let parts = stage.run(&boxes, &Workers::none(), |(), ([z, y, x], members)| {
        let mut found = Check::default();
        let lo = [*x, *y, *z].map(|cell| cell * EDGE);
        let part = Box3::from_shape([EDGE + 2; 3]).translate(lo.map(|v| v - 1));
        let Some(values) = padded(field, &part, &mut found) else { return Ok(found) };
        for &n in members {
            let position = mesh.vertices[n as usize];
            if let Some((voxel, text)) = off(geometry, position, eps, (&values, &part)) {
                let text = format!("vertex {n} at {position:?} {text}");
                found.add(Fault { file: Some(name.to_owned()), voxel: Some(voxel), text });
            }
        }
        Ok(found)
    })?;
    stage.finish();
    found.take_all(parts);
    Ok(())
}

/// The values of a box that may reach out of the field, where it is 0.
fn padded(field: &Image, part: &Box3, found: &mut Check) -> Option<Vec<f32>> {
    let mut values = vec![0.0; part.len()];
    let inside = part.intersect(&field.reader.levels()[0].geometry.domain());
    if inside.is_empty() {
        return Some(values);
    }
    let stored = read::<f32>(field, 0, &inside, found)?;
    let width = inside.shape()[0] as usize;
    for (row, (y, z)) in stored.chunks_exact(width).zip(inside.rows()) {
        values[part.offset_of([inside.lo[0], y, z])..][..width].copy_from_slice(row);
    }
    Some(values)
}

/// What is wrong with the place of a vertex, and the voxel below it.
fn off(
    geometry: &Geometry,
    position: [f64; 3],
    eps: f64,
    (values, part): (&[f32], &Box3),
) -> Option<([i64; 3], String)> {
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
