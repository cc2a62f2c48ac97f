//! Surfaces of known shapes: closed, outward, the same for every brick size, and as large as they should be.

use std::collections::HashMap;
use std::f64::consts::PI;

use proptest::prelude::*;
use strandline::grid::{Box3, BrickGrid, Geometry};
use strandline::kernel::surface::{MarchingCubes, Measures, Patch, PatchIndex, SurfaceMeasure, Welder, cells_of_brick};

use crate::common::mesh_buffer::MeshBuffer;

const WHOLE: i64 = 1 << 20;

/// A grid centred on the world's origin.
fn centred(shape: [i64; 3], spacing: [f64; 3]) -> Geometry {
    let origin = std::array::from_fn(|a| -0.5 * (shape[a] - 1) as f64 * spacing[a]);
    Geometry { shape, spacing, origin, unit: None }
}

/// The surface of a field given by voxel, brick by brick; voxels outside of the domain hold 0.
fn surface(
    geometry: &Geometry,
    edge: i64,
    closed: bool,
    level: f32,
    field: &dyn Fn([i64; 3]) -> f32,
) -> (MeshBuffer, Measures) {
    let grid = BrickGrid::new(geometry.shape, edge);
    let mut cubes = MarchingCubes::new(level);
    let (mut patch, mut welder, mut mesh) = (Patch::default(), Welder::new(geometry), MeshBuffer::default());
    let mut measure = SurfaceMeasure::new(geometry.position(geometry.shape.map(|n| n / 2)));
    for id in 0..grid.len() {
        let cells = cells_of_brick(&grid.brick_box(id), geometry.shape, closed);
        let part = Box3::new(cells.lo, cells.hi.map(|v| v + 1));
        let value = |voxel| if geometry.domain().contains(voxel) { field(voxel) } else { 0.0 };
        let values: Vec<f32> =
            part.rows().flat_map(|(y, z)| (part.lo[0]..part.hi[0]).map(move |x| value([x, y, z]))).collect();
        cubes.extract(&values, &part, &cells, &mut patch);
        welder.add(&patch, &mut mesh).expect("memory takes any mesh");
        welder.triangles_of(&patch).for_each(|(corners, positions)| measure.add(corners, positions));
    }
    (mesh, measure.measures())
}

/// The surface of a shape given by its signed distance, negative inside.
fn shape_surface(geometry: &Geometry, edge: i64, distance: &dyn Fn([f64; 3]) -> f64) -> (MeshBuffer, Measures) {
    surface(geometry, edge, false, 0.0, &|voxel| -distance(geometry.position(voxel)) as f32)
}

fn length(p: [f64; 3]) -> f64 {
    p.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn torus([x, y, z]: [f64; 3]) -> f64 {
    (x.hypot(y) - 6.0).hypot(z) - 2.5
}

/// The triangles as positions, each starting at its lowest corner, sorted: the same for the same mesh.
fn sorted(mesh: &MeshBuffer) -> Vec<[[u32; 3]; 3]> {
    let mut all: Vec<_> = mesh
        .triangles
        .iter()
        .map(|t| {
            let mut corners = t.map(|v| mesh.vertices[v as usize].map(f32::to_bits));
            let first = (0..3).min_by_key(|&i| corners[i]).unwrap_or(0);
            corners.rotate_left(first);
            corners
        })
        .collect();
    all.sort_unstable();
    all
}

/// Every directed edge is walked once and its opposite once: an oriented manifold without border, up to its vertices.
fn assert_closed_manifold(mesh: &MeshBuffer) {
    let mut walked: HashMap<(u32, u32), u32> = HashMap::new();
    for &[a, b, c] in &mesh.triangles {
        for edge in [(a, b), (b, c), (c, a)] {
            *walked.entry(edge).or_default() += 1;
        }
    }
    for (&(a, b), &count) in &walked {
        assert_eq!((count, walked.get(&(b, a))), (1, Some(&1)), "edge {a} {b}");
    }
}

fn euler_characteristic(mesh: &MeshBuffer) -> i64 {
    mesh.vertices.len() as i64 - (3 * mesh.triangles.len() / 2) as i64 + mesh.triangles.len() as i64
}

#[test]
fn spheres_converge_at_second_order() {
    let radius = 1.0;
    let errors = [12, 24, 48].map(|n| {
        let step = 2.6 / n as f64;
        let geometry = centred([n, n, 2 * n], [step, step, step / 2.0]);
        let (mesh, found) = shape_surface(&geometry, 16, &|p| length(p) - radius);
        assert_closed_manifold(&mesh);
        assert!(found.is_closed());
        assert_eq!((found.components, euler_characteristic(&mesh)), (1, 2));
        assert_eq!(found.vertices, mesh.vertices.len() as u64);
        assert!(mesh.vertices.iter().all(|v| (length(v.map(f64::from)) - radius).abs() < step * step));
        let (volume, area) = (4.0 / 3.0 * PI, 4.0 * PI);
        [(found.volume - volume) / volume, (found.area - area) / area]
    });
    for measure in 0..2 {
        let order = |i: usize| (errors[i][measure] / errors[i + 1][measure]).log2();
        assert!(errors[2][measure].abs() < 2e-3, "{errors:?}");
        assert!(order(0) > 1.7 && order(1) > 1.8, "{errors:?}");
    }
}

#[test]
fn boxes_lose_only_their_edges() {
    let half = [3.0, 2.5, 5.0];
    let distance = |p: [f64; 3]| (0..3).map(|a| p[a].abs() - half[a]).fold(f64::NEG_INFINITY, f64::max);
    let (volume, area) = (8.0 * 3.0 * 2.5 * 5.0, 8.0 * (3.0 * 2.5 + 2.5 * 5.0 + 3.0 * 5.0));
    let errors = [1, 2, 4].map(|n| {
        // The sides lie midway between voxel centres at every refinement.
        let geometry = centred([16 * n, 28 * n, 14 * n], [0.5, 0.25, 1.0].map(|h| h / n as f64));
        let (mesh, found) = shape_surface(&geometry, 8, &distance);
        assert_closed_manifold(&mesh);
        let highest = mesh.vertices.iter().fold([f32::MIN; 3], |hi, v| std::array::from_fn(|a| hi[a].max(v[a])));
        assert!((0..3).all(|a| (f64::from(highest[a]) - half[a]).abs() < 1e-5), "{highest:?}");
        [1.0 - found.volume / volume, 1.0 - found.area / area]
    });
    // A bevel along the edges, as wide as a cell: it takes h^2 of the volume and h of the area.
    for (measure, order) in [(0, 2.0), (1, 1.0)] {
        let found = (errors[1][measure] / errors[2][measure]).log2();
        assert!(errors[2][measure] > 0.0 && errors[0][measure] < 0.1 && (found - order).abs() < 0.2, "{errors:?}");
    }
}

#[test]
fn a_torus_has_genus_one() {
    let (mesh, found) = shape_surface(&centred([40, 40, 16], [0.5; 3]), 16, &torus);
    assert_closed_manifold(&mesh);
    assert_eq!((found.components, euler_characteristic(&mesh)), (1, 0));
    assert!((found.volume / (2.0 * PI * PI * 6.0 * 2.5 * 2.5) - 1.0).abs() < 0.02);
}

#[test]
fn bricks_of_any_size_give_the_same_mesh() {
    let geometry = Geometry { shape: [37, 40, 21], spacing: [0.5, 0.45, 0.4], origin: [-9.1, -8.9, -4.1], unit: None };
    let (whole, measures) = shape_surface(&geometry, WHOLE, &torus);
    for edge in [5, 8, 16] {
        let (mesh, found) = shape_surface(&geometry, edge, &torus);
        assert_eq!(sorted(&mesh), sorted(&whole), "bricks of {edge}");
        assert_eq!(mesh.vertices.len(), whole.vertices.len());
        assert!((found.volume - measures.volume).abs() < 1e-9 && (found.area - measures.area).abs() < 1e-9);
    }
}

#[test]
fn separate_shapes_are_counted() {
    let geometry = centred([40, 20, 20], [1.0; 3]);
    let (mesh, found) = shape_surface(&geometry, 8, &|[x, y, z]| length([x.abs() - 9.0, y, z]) - 6.0);
    assert_eq!((found.components, euler_characteristic(&mesh)), (2, 4));
}

#[test]
fn a_hollow_shape_counts_its_cavity_out() {
    let (_, found) = shape_surface(&centred([40; 3], [0.5; 3]), 16, &|p| (length(p) - 6.0).abs() - 2.0);
    let exact = 4.0 / 3.0 * PI * (512.0 - 64.0);
    assert!((found.volume / exact - 1.0).abs() < 0.01, "{found:?}");
    assert_eq!(found.components, 2);
}

#[test]
fn a_sphere_that_runs_into_the_border_closes_on_request() {
    let geometry = Geometry { shape: [12, 20, 20], spacing: [1.0; 3], origin: [0.0, -9.5, -9.5], unit: None };
    let ball = |voxel: [i64; 3]| (0.5 + (7.0 - length(geometry.position(voxel))) / 4.0).clamp(0.0, 1.0) as f32;
    let (_, open) = surface(&geometry, 8, false, 0.5, &ball);
    assert!(open.open_edges > 20 && !open.is_closed(), "{open:?}");
    let (mesh, closed) = surface(&geometry, 8, true, 0.5, &ball);
    assert_closed_manifold(&mesh);
    assert_eq!((closed.open_edges, closed.components, euler_characteristic(&mesh)), (0, 1, 2));
    // Half the ball, and a lid that lies up to half a voxel beyond the border.
    let (half_ball, lid) = (2.0 / 3.0 * PI * 343.0, 0.5 * PI * 49.0);
    assert!(closed.volume > half_ball + 0.3 * lid && closed.volume < half_ball + lid, "{closed:?}");
    assert!(mesh.vertices.iter().all(|v| v[0] >= -0.5));
    for edge in [5, WHOLE] {
        assert_eq!(sorted(&surface(&geometry, edge, true, 0.5, &ball).0), sorted(&mesh));
    }
}

#[test]
fn a_full_domain_closes_around_itself() {
    let geometry = centred([4, 3, 2], [1.0, 2.0, 3.0]);
    let (mesh, found) = surface(&geometry, 2, true, 0.5, &|_| 1.0);
    assert_closed_manifold(&mesh);
    assert!(found.is_closed() && found.volume > 0.8 * 24.0 * 6.0 && found.volume < 24.0 * 6.0, "{found:?}");
}

#[test]
fn the_mesh_of_a_sphere_is_as_near_as_the_sphere() {
    let geometry = centred([32; 3], [0.1; 3]);
    let (mesh, _) = shape_surface(&geometry, 16, &|p| length(p) - 1.2);
    let index = PatchIndex::new(&mesh.vertices, &mesh.triangles, 0.2);
    let queries: Vec<[f64; 3]> = (0..200)
        .map(|i| {
            let (height, turn) = (1.0 - (2 * i + 1) as f64 / 200.0, 2.4 * f64::from(i));
            let ring = (1.0 - height * height).sqrt();
            [ring * turn.cos(), ring * turn.sin(), height].map(|x| x * (0.2 + 0.02 * f64::from(i)))
        })
        .collect();
    let exact: Vec<f64> = queries.iter().map(|&q| (length(q) - 1.2).abs()).collect();
    let found = index.hausdorff_from(queries.iter().copied()).unwrap();
    let mean = exact.iter().sum::<f64>() / 200.0;
    assert!((found.mean - mean).abs() < 0.002 && (found.max - exact.iter().copied().fold(0.0, f64::max)).abs() < 0.003);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Any signs at all, and values exactly at the level: every ambiguous face occurs between two cells.
    #[test]
    fn random_fields_are_closed(values in prop::collection::vec(prop::sample::select(&[0.0_f32, 0.2, 0.5, 0.5, 0.9, 1.0]), 9 * 8 * 7)) {
        let geometry = centred([9, 8, 7], [1.0; 3]);
        let field = |[x, y, z]: [i64; 3]| values[((z * 8 + y) * 9 + x) as usize];
        let (mesh, found) = surface(&geometry, 3, true, 0.5, &field);
        assert_closed_manifold(&mesh);
        prop_assert!(found.is_closed());
        prop_assert_eq!(sorted(&mesh), sorted(&surface(&geometry, WHOLE, true, 0.5, &field).0));
        let no_area = mesh.triangles.iter().filter(|t| (0..3).any(|i| {
            mesh.vertices[t[i] as usize] == mesh.vertices[t[(i + 1) % 3] as usize]
        })).count();
        prop_assert_eq!(no_area, 0);
    }
}
