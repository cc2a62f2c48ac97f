//! A mesh against the image that it was drawn from, and against what the report says that it measures.

use std::path::Path;

use serde_json::Value;

use super::found::Check;
use super::structure::Image;
use super::vertices::{self, DrawnFrom};
use crate::error::Result;
use crate::exec::Engine;
use crate::grid::TriangleMesh;
use crate::io::geometry::read::source::Source;
use crate::io::geometry::read::sources::read_source;
use crate::kernel::surface::SurfaceMeasure;

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
    check(engine, store, &mesh, field.map(DrawnFrom::LevelSet), object)
}

/// Compares a mesh with what it was drawn from and with what is told of it.
///
/// # Errors
/// When the memory does not hold the mesh or the run is interrupted.
pub(super) fn check(
    engine: &Engine,
    store: &Path,
    name: &str,
    from: Option<DrawnFrom<'_>>,
    told: &Value,
) -> Result<Check> {
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
    if let Some(from) = from {
        vertices::check(engine, (&mesh, rounding(&mesh)), name, from, &mut found)?;
        found.also(&format!(", {} vertices {}", mesh.vertices.len(), from.told()));
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
    if is_told.is_none_or(|told| !near(told.abs(), measures.volume.abs(), 2.0 * moved * measures.area)) && is_closed {
        wrong("volume:", &told["volume"], measures.volume.to_string());
    }
}

fn length(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>().sqrt()
}
