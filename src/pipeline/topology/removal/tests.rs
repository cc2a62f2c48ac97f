//! Bodies with handles, tunnels and crumbs whose number is known; Euler numbers are counted from the mesh.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::{Removed, remove_small};
use crate::exec::{Budget, Cancel, Engine, Silent};
use crate::grid::{BrickGrid, BrickSet, Geometry, TriangleMesh};
use crate::pipeline::surface::{Isosurface, extract};
use crate::store::{BrickArray, Scratch};

const SHAPE: [i64; 3] = [64, 64, 60];

fn ball(p: [f64; 3], centre: [f64; 3], radius: f64) -> f64 {
    (0..3).map(|a| (p[a] - centre[a]).powi(2)).sum::<f64>().sqrt() - radius
}

fn slab(p: [f64; 3], lo: [f64; 3], hi: [f64; 3]) -> f64 {
    (0..3).map(|a| (lo[a] - p[a]).max(p[a] - hi[a])).fold(f64::NEG_INFINITY, f64::max)
}

fn torus(p: [f64; 3], radius: f64, tube: f64) -> f64 {
    let ring = ((p[0] - 32.0).powi(2) + (p[1] - 31.0).powi(2)).sqrt() - radius;
    (ring * ring + (p[2] - 30.5).powi(2)).sqrt() - tube
}

/// Two walls with a gap of four voxels between them that are one along an edge.
fn walls(p: [f64; 3]) -> f64 {
    let lower = slab(p, [8.0, 8.0, 25.5], [56.0, 56.0, 30.5]);
    let upper = slab(p, [8.0, 8.0, 34.5], [56.0, 56.0, 39.5]);
    lower.min(upper).min(slab(p, [8.0, 8.0, 25.5], [13.0, 56.0, 39.5]))
}

/// Walls with so many columns across the gap, and so many tunnels through the lower wall.
fn laced(p: [f64; 3], columns: usize, tunnels: usize) -> f64 {
    let across = |[x, y]: [f64; 2]| ((p[0] - x).powi(2) + (p[1] - y).powi(2)).sqrt();
    let mut away = walls(p);
    for place in [[22.0, 20.0], [34.0, 44.0], [47.0, 17.0], [48.5, 48.0]].into_iter().take(columns) {
        away = away.min((across(place) - 1.6).max((p[2] - 32.5).abs() - 4.0));
    }
    for place in [[24.0, 47.0], [33.5, 14.0], [44.0, 32.0]].into_iter().take(tunnels) {
        if (p[2] - 28.0).abs() < 4.0 {
            away = away.max(1.6 - across(place));
        }
    }
    away
}

/// What is taken away of a body, a function that is negative inside, in voxels; the Euler number and the pieces of its surface before and after,
/// and u.
fn taken(body: impl Fn([f64; 3]) -> f64, points: &[[f64; 3]], threads: usize) -> (Removed, [(i64, u64); 2], Vec<f32>) {
    let folder = tempfile::tempdir().unwrap();
    let scratch = Scratch::new(folder.path(), 1 << 26);
    let engine = Engine::new(threads, scratch, Budget { total: 1 << 30 }, Cancel::default(), Arc::new(Silent)).unwrap();
    let geometry = Geometry::new(SHAPE, [0.5; 3], [1.0, 2.0, 3.0]);
    let grid = BrickGrid::new(SHAPE, 16);
    // Bricks far from the body are not stored.
    let value = |p: [i64; 3]| (0.5 - 0.25 * body(p.map(|v| v as f64))).clamp(0.0, 1.0) as f32;
    let voxels = |id| {
        let part = grid.brick_box(id);
        let row = move |(y, z)| (part.lo[0]..part.hi[0]).map(move |x| [x, y, z]);
        part.rows().flat_map(row).map(value).collect::<Vec<f32>>()
    };
    let set = Arc::new(BrickSet::from_fn(grid, |id| voxels(id).iter().any(|&u| u > 0.0)));
    let u = BrickArray::with_faces(engine.scratch(), &set).unwrap();
    for slot in 0..set.len() as u32 {
        u.write_box(&grid.brick_box(set.id(slot)), &voxels(set.id(slot)));
        u.refresh_faces(slot);
    }
    let counted = || {
        let stage = engine.stage("test", 0);
        let mut mesh = TriangleMesh::default();
        let (measures, _) = extract(&stage, &Isosurface::of(&u, &geometry), &mut mesh).unwrap();
        let edges: BTreeSet<[u32; 2]> = mesh
            .triangles
            .iter()
            .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
            .map(|[a, b]| [a.min(b), a.max(b)])
            .collect();
        assert!(measures.is_closed());
        (mesh.vertices.len() as i64 - edges.len() as i64 + mesh.triangles.len() as i64, measures.components)
    };
    let before = counted();
    let removed = remove_small(&engine, &u, &geometry, points).unwrap();
    let mut values = vec![0.0; geometry.domain().len()];
    crate::store::BoxSource::read_box(&u, &geometry.domain(), &mut values).unwrap();
    (removed, [before, counted()], values)
}

#[test]
fn a_torus_keeps_its_handle_whether_thick_or_thin() {
    for (radius, tube) in [(16.0, 6.0), (18.0, 2.5), (9.0, 4.0)] {
        let (removed, counted, _) = taken(|p| torus(p, radius, tube), &[], 2);
        assert_eq!((removed, counted), (Removed::default(), [(0, 1); 2]), "{radius} {tube}");
    }
}

#[test]
fn columns_between_walls_are_cut_and_tunnels_through_them_filled() {
    for (columns, tunnels) in [(0, 0), (4, 0), (0, 3), (4, 3)] {
        let (removed, counted, _) = taken(|p| laced(p, columns, tunnels), &[], 2);
        let genus = (columns + tunnels) as i64;
        assert_eq!(counted, [(2 - 2 * genus, 1), (2, 1)], "{columns} {tunnels}");
        assert_eq!((removed.handles, removed.tunnels), (columns as u64, tunnels as u64), "{columns} {tunnels}");
        assert!(genus == 0 || (1.0..=3.5).contains(&removed.widest), "{}", removed.widest);
    }
}

#[test]
fn crumbs_go_and_bodies_stay() {
    let two = |p: [f64; 3]| ball(p, [20.0, 20.0, 20.0], 9.0).min(ball(p, [43.0, 44.0, 40.0], 5.0));
    let (removed, counted, _) = taken(two, &[], 2);
    assert_eq!((removed, counted), (Removed::default(), [(4, 2); 2]));
    let with_crumbs =
        move |p: [f64; 3]| two(p).min(ball(p, [50.0, 12.0, 30.0], 2.2)).min(ball(p, [12.0, 50.0, 30.0], 1.0));
    let hollow = move |p: [f64; 3]| with_crumbs(p).max(1.8 - ball(p, [20.0, 20.0, 20.0], 0.0));
    let (removed, counted, _) = taken(hollow, &[], 2);
    assert_eq!((removed.crumbs, removed.handles, removed.tunnels), (3, 0, 0));
    assert_eq!(counted, [(10, 5), (4, 2)]);
    // Points on the larger crumb make it a body; voxels are half a unit apart, and the grid begins at [1, 2, 3].
    let spiral = |n: i32| {
        let (z, turn) = ((2.0 * f64::from(n) + 1.0) / 20.0 - 1.0, 2.4 * f64::from(n));
        let ring = (1.0 - z * z).sqrt();
        [26.0 + 1.1 * ring * libm::cos(turn), 8.0 + 1.1 * ring * libm::sin(turn), 18.0 + 1.1 * z]
    };
    let points: Vec<[f64; 3]> = (0..20).map(spiral).collect();
    let (removed, counted, _) = taken(hollow, &points, 2);
    assert_eq!((removed.crumbs, counted[1]), (2, (6, 3)));
}

#[test]
fn threads_change_nothing() {
    let body = |p: [f64; 3]| laced(p, 4, 3).min(ball(p, [57.0, 57.0, 10.0], 2.0));
    let (one, _, values) = taken(body, &[], 1);
    let (two, _, same) = taken(body, &[], 3);
    assert_eq!(one, two);
    assert!(values.iter().zip(&same).all(|(a, b)| a.to_bits() == b.to_bits()));
}
