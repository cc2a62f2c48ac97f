//! Triangles as sources on a grid: cells, fixed distances and winding numbers against slow and plain references.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;
use std::path::Path;

use strandline::grid::NO_SOURCE;
use strandline::grid::{Box3, BrickGrid, Geometry, TriangleBins, TriangleMesh};
use strandline::io::geometry::read::source::Source;
use strandline::io::geometry::read::sources::read_source;
use strandline::kernel::distance::seeding::triangles::{cut_cells, fix_voxels};
use strandline::kernel::geometry::winding_number::{WindingTree, solid_angle};

use crate::common::meshes::{cuboid, joined, sphere};
use crate::common::random::Random;
use crate::common::{shared_data, shipped};

fn geometry() -> Geometry {
    Geometry { shape: [24, 20, 17], spacing: [0.5, 0.75, 1.25], origin: [-3.0, 2.0, 10.0], unit: None }
}

/// Points spread densely over a triangle, its corners among them.
fn samples(corners: [[f64; 3]; 3], steps: u32) -> impl Iterator<Item = [f64; 3]> {
    let [a, b, c] = corners;
    (0..=steps).flat_map(move |i| {
        (0..=steps - i).map(move |j| {
            let (s, t) = (f64::from(i) / f64::from(steps), f64::from(j) / f64::from(steps));
            std::array::from_fn(|k| a[k] + s * (b[k] - a[k]) + t * (c[k] - a[k]))
        })
    })
}

fn random_triangle(random: &mut Random, size: f64) -> [[f64; 3]; 3] {
    let at = [-4.0 + 14.0 * random.unit(), 1.0 + 17.0 * random.unit(), 8.0 + 24.0 * random.unit()];
    let mut corner = || at.map(|x| x + size * (random.unit() - 0.5));
    let corners = [corner(), corner(), corner()];
    match random.below(6) {
        0 => [corners[0], corners[1], corners[1]],
        1 => [corners[0]; 3],
        // In a plane of the grid.
        2 => corners.map(|[x, _, z]| [x, 5.0, z]),
        _ => corners,
    }
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn every_cell_with_a_sample_is_cut_and_every_cut_cell_has_one_near() {
    let geometry = geometry();
    let part = Box3::new([3, 2, 1], [21, 17, 15]);
    let cells = Box3::new([2, 1, 0], part.hi);
    let mut random = Random(5);
    for n in 0..120 {
        let size = [0.3, 2.0, 9.0][n % 3];
        let corners = random_triangle(&mut random, size);
        let mut cut = BTreeSet::new();
        cut_cells(&geometry, corners, &part, |cell| assert!(cut.insert(cell), "visited twice"));
        assert!(cut.iter().all(|&cell| cells.contains(cell)));
        let points: Vec<[f64; 3]> = samples(corners, 150).map(|p| geometry.to_voxels(p)).collect();
        for p in &points {
            let cell = p.map(|v| v.floor() as i64);
            // Which side of a cell's border a rounded sample falls on says nothing.
            let is_clear = p.iter().all(|v| (v - v.round()).abs() > 1e-9);
            assert!(!is_clear || !cells.contains(cell) || cut.contains(&cell), "{corners:?}: {p:?} is not covered");
        }
        // Samples lie no more than a side's 150th part apart, in voxels.
        let apart = points.iter().map(|p| distance(*p, points[0])).fold(0.0, f64::max) / 75.0 + 1e-9;
        for cell in &cut {
            let beyond = |p: &[f64; 3]| {
                let excess = |a: usize| (cell[a] as f64 - p[a]).max(p[a] - cell[a] as f64 - 1.0).max(0.0);
                excess(0).max(excess(1)).max(excess(2))
            };
            let nearest = points.iter().map(beyond).fold(f64::INFINITY, f64::min);
            assert!(nearest <= apart, "{corners:?}: {cell:?} is {nearest} away from all samples");
        }
    }
}

/// What every brick of a mesh is fixed to: voxel, squared distance, source.
fn fixed_by_bricks(geometry: &Geometry, mesh: &TriangleMesh, edge: i64) -> BTreeMap<[i64; 3], (f64, u32)> {
    let grid = BrickGrid::new(geometry.shape, edge);
    let bins = TriangleBins::new(grid, geometry, mesh);
    let mut found = BTreeMap::new();
    for brick in 0..grid.len() {
        let part = grid.brick_box(brick);
        let (mut squared, mut source) = (vec![f64::INFINITY; grid.brick_len()], vec![NO_SOURCE; grid.brick_len()]);
        let triangles = bins.of(brick).iter().map(|&n| (n, mesh.corners(n as usize)));
        fix_voxels(geometry, &part, edge as usize, triangles, |_| 1, &mut squared, &mut source);
        for (y, z) in part.rows() {
            for x in part.lo[0]..part.hi[0] {
                let [i, j, k] = [x - part.lo[0], y - part.lo[1], z - part.lo[2]];
                let place = ((k * edge + j) * edge + i) as usize;
                assert_eq!(source[place] == NO_SOURCE, squared[place].is_infinite());
                if source[place] != NO_SOURCE {
                    found.insert([x, y, z], (squared[place], source[place]));
                }
            }
        }
    }
    found
}

#[test]
fn fixed_distances_are_those_of_dense_samples_for_every_brick_size() {
    let geometry = geometry();
    let mut random = Random(11);
    let corners: Vec<_> = (0..24).flat_map(|n| random_triangle(&mut random, [1.0, 6.0][n % 2])).collect();
    let triangles = (0..24).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
    let mesh = TriangleMesh::new(corners, triangles).unwrap();
    let found = fixed_by_bricks(&geometry, &mesh, 16);
    assert!(found.len() > 300);
    for edge in [1, 5, 8, 32] {
        assert_eq!(fixed_by_bricks(&geometry, &mesh, edge), found, "edge {edge}");
    }
    for (voxel, (squared, source)) in found {
        let here = geometry.position(voxel);
        let to = |n: usize| samples(mesh.corners(n), 100).map(|p| distance(p, here)).fold(f64::INFINITY, f64::min);
        let sampled = to(source as usize);
        assert!(squared.sqrt() <= sampled + 1e-9 && squared.sqrt() >= sampled - 0.05, "{voxel:?}: {squared} {sampled}");
    }
}

/// The papers' unit cube as twelve triangles: distances of all fixed voxels are those to a box's surface, and every
/// grid point within half a voxel of it is fixed (Kósa & Mikula 2023, section on the Cube).
#[test]
fn a_cube_of_triangles_fixes_distances_to_its_surface() {
    for n in [10, 19, 37] {
        let h = 1.8 / f64::from(n - 1);
        let geometry = Geometry { shape: [i64::from(n); 3], spacing: [h; 3], origin: [-0.4; 3], unit: None };
        let found = fixed_by_bricks(&geometry, &cuboid([0.0; 3], [1.0; 3]), 16);
        let exact = |p: [f64; 3]| {
            let outside = p.map(|x| (x - 1.0).max(-x));
            let depth = outside.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            if depth <= 0.0 { -depth } else { outside.map(|x| x.max(0.0).powi(2)).iter().sum::<f64>().sqrt() }
        };
        for (y, z) in geometry.domain().rows() {
            for x in 0..geometry.shape[0] {
                let expected = exact(geometry.position([x, y, z]));
                match found.get(&[x, y, z]) {
                    Some((squared, _)) => {
                        assert!((squared.sqrt() - expected).abs() < 1e-12 && expected < h * 3.0_f64.sqrt());
                    }
                    None => assert!(expected > 1e-9, "a grid point on the surface is not fixed: {:?}", [x, y, z]),
                }
            }
        }
    }
}

/// The winding number by the plain sum over all triangles.
fn plain_sum(mesh: &TriangleMesh, p: [f64; 3]) -> f64 {
    (0..mesh.len()).map(|n| solid_angle(mesh.corners(n), p)).sum::<f64>() / (4.0 * PI)
}

#[test]
fn closed_meshes_wind_once_about_their_inside() {
    let ball = sphere([1.0, 2.0, 3.0], 2.0, 24, PI);
    assert!(ball.boundary_edges().is_closed() && ball.boundary_edges().is_oriented());
    let tree = WindingTree::new(&ball);
    let cube = WindingTree::new(&cuboid([0.0; 3], [1.0, 2.0, 3.0]));
    let mut random = Random(3);
    for _ in 0..2000 {
        let p = [0, 1, 2].map(|a| f64::from(a + 1) + 6.0 * (random.unit() - 0.5));
        let d = distance(p, [1.0, 2.0, 3.0]);
        if (d - 2.0).abs() > 0.05 {
            let expected = if d < 2.0 { 1.0 } else { 0.0 };
            assert!((tree.winding_number(p) - expected).abs() < 5e-3, "{p:?}: {}", tree.winding_number(p));
        }
        let q = [0, 1, 2].map(|a| f64::from(a + 1) * (2.0 * random.unit() - 0.5));
        let inside = (0..3).all(|a| 0.0 < q[a] && q[a] < a as f64 + 1.0);
        assert!((cube.winding_number(q) - f64::from(u8::from(inside))).abs() < 5e-3, "{q:?}");
    }
    assert!(cube.winding_number([1e6, 0.0, 0.0]).abs() < 1e-12);
}

#[test]
fn nested_meshes_add_up_and_half_spheres_fall_off() {
    let [inner, outer] = [1.0, 2.0].map(|radius| sphere([0.0; 3], radius, 20, PI));
    let mut hole = inner.clone();
    hole.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    for (second, expected) in [(inner, [2.0, 1.0, 0.0]), (hole, [0.0, 1.0, 0.0])] {
        let tree = WindingTree::new(&joined(&[outer.clone(), second]));
        for (x, w) in [0.3, 1.5, 2.5].into_iter().zip(expected) {
            assert!((tree.winding_number([x, 0.1, -0.2]) - w).abs() < 5e-3);
        }
    }
    let half = WindingTree::new(&sphere([0.0; 3], 1.0, 40, PI / 2.0));
    for p in [[0.0; 3], [0.5, 0.2, 0.0], [0.0, -0.8, 0.0]] {
        assert!((half.winding_number(p) - 0.5).abs() < 5e-3, "{p:?}: {}", half.winding_number(p));
    }
    // On the axis, at height h, the open disc takes up (1 - h / sqrt(1 + h^2)) / 2 of the view.
    for h in [-3.0, -0.9, -0.1, 0.2, 0.8_f64] {
        let expected = 0.5 + h / (2.0 * h.hypot(1.0));
        assert!((half.winding_number([0.0, 0.0, h]) - expected).abs() < 5e-3, "{h}");
    }
}

/// Holes, single triangles and flipped ones: whatever the mesh, the hierarchy gives the plain sum within a bound.
#[test]
fn the_hierarchy_agrees_with_the_plain_sum() {
    let mut random = Random(17);
    let mut torn = sphere([0.0; 3], 1.0, 32, 2.5);
    torn.triangles.retain(|_| random.below(10) > 0);
    for triangle in &mut torn.triangles {
        if random.below(20) == 0 {
            triangle.swap(0, 2);
        }
    }
    let soup: Vec<_> = (0..3000).map(|_| [random.unit(), random.unit(), random.unit()]).collect();
    let soup = TriangleMesh::new(soup, (0..1000).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect()).unwrap();
    for mesh in [torn, soup] {
        let tree = WindingTree::new(&mesh);
        let mut worst = 0.0_f64;
        for _ in 0..1000 {
            let p = [0; 3].map(|_| 4.0 * random.unit() - 2.0);
            worst = worst.max((tree.winding_number(p) - plain_sum(&mesh, p)).abs());
        }
        println!("{} triangles: worst difference {worst:.2e}", mesh.len());
        assert!(worst < 1e-2, "{worst}");
    }
}

#[test]
fn real_meshes_have_an_inside() {
    check_inside(&shipped("meshes/pilot-whale-cranium-10k.ply"), true);
    check_inside(&shipped("meshes/demosthenes-low-res.obj"), false);
    check_inside(&shipped("meshes/gastruloid.ply"), false);
}

#[test]
fn more_real_meshes_have_an_inside() {
    for name in ["meshes/pilot-whale-cranium.ply", "meshes/teddy-cgal-bear.off"] {
        let Some(path) = shared_data(name) else { return };
        check_inside(&path, true);
    }
}

fn check_inside(path: &Path, is_closed: bool) {
    let name = path.display();
    let Ok(Source::Mesh(mesh)) = read_source(path) else { panic!("{name}") };
    let (lo, hi) = mesh.bounds().expect("vertices");
    let tree = WindingTree::new(&mesh);
    let mut random = Random(23);
    let (mut worst, mut inside) = (0.0_f64, 0);
    for _ in 0..200 {
        let p = std::array::from_fn(|a| lo[a] + (hi[a] - lo[a]) * random.unit());
        let (found, plain) = (tree.winding_number(p), plain_sum(&mesh, p));
        worst = worst.max((found - plain).abs());
        inside += usize::from(found > 0.5);
        assert!(!is_closed || (plain - plain.round()).abs() < 1e-9);
    }
    println!("{name}: worst difference {worst:.2e}, {inside} of 200 inside");
    assert!(worst < 1e-2 && inside > 0 && inside < 200, "{name}: {worst} {inside}");
}
