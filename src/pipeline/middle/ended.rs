//! Surfaces in the middle that are ended anywhere, while they are drawn too.

use crate::error::Result;
use crate::exec::Engine;
use crate::exec::save_points::ending::check_ended_anywhere;
use crate::grid::{DataSets, Geometry, TriangleMesh};
use crate::kernel::distance::state::neighbours::Neighbours;
use crate::pipeline::distance::{DistanceSettings, Init, Method, Schedule};
use crate::pipeline::middle::{LabelMode, MiddleSettings, SurfaceKind, middle};

/// Corners of all triangles, as bits.
fn drawn(engine: &Engine, labels: LabelMode, method: Method) -> Result<Vec<u64>> {
    let geometry = Geometry::new([56, 50, 60], [1.0, 1.1, 0.9], [0.0; 3]);
    let mut sets = DataSets::default();
    for n in 0..2 {
        let at =
            |i: i32| [f64::from(i * 37 % 50), f64::from(i * 53 % 45), 8.0 + 35.0 * f64::from(n) + f64::from(i % 7)];
        sets.add_cloud(&(0..30).map(at).collect::<Vec<_>>());
    }
    let distance = DistanceSettings {
        method,
        schedule: Schedule::Front,
        neighbours: Neighbours::Faces,
        init: Init::Cell,
        farthest: None,
        signed: false,
        labels: true,
        closest_point: false,
        brick: 16,
        exact: false,
        timed: false,
    };
    let settings = MiddleSettings { distance, surface: SurfaceKind::Exact, labels };
    let mut mesh = TriangleMesh::default();
    middle::<f32>(engine, &geometry, &sets, &settings, None, &mut mesh)?;
    Ok(mesh.vertices.iter().flatten().map(|v| v.to_bits()).collect())
}

#[test]
fn a_middle_surface_that_is_ended_anywhere_goes_on_with_the_same_bits() {
    for (labels, method) in
        [(LabelMode::Tracked, Method::VDT), (LabelMode::Exact, Method::VDT), (LabelMode::Tracked, Method::FSM)]
    {
        check_ended_anywhere(&format!("{labels:?} {method:?}"), 8, 1.0, &|engine| drawn(engine, labels, method));
    }
}
