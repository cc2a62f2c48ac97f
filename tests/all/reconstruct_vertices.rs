//! Vertices of reconstructed surfaces, at the points and as the level set has them, beside the bodies that the points are of.

use std::f64::consts::PI;

use glam::DVec3;
use strandline::grid::TriangleMesh;
use strandline::pipeline::level_set::motion::Motion;
use strandline::pipeline::reconstruct::{ReconstructSettings, Reconstruction, Vertices, grid_for, reconstruct};

use crate::common::clouds::sphere;
use crate::common::lab::Lab;
use crate::common::random::Random;

/// The surface with vertices as they are asked for.
fn drawn(cloud: &[[f64; 3]], settings: &ReconstructSettings) -> (TriangleMesh, Reconstruction) {
    let grid = grid_for(cloud, None).expect("more than one place");
    let mut mesh = TriangleMesh::default();
    let found = reconstruct(&Lab::new(2).engine, &grid, cloud, settings, &mut mesh).expect("a surface");
    (mesh, found)
}

fn with(vertices: Vertices) -> ReconstructSettings {
    ReconstructSettings { vertices: Some(vertices), ..ReconstructSettings::default() }
}

const RADIUS: f64 = 2.0;
const TUBE: f64 = 0.7;

/// Points of a torus, as many at random as leave each other room.
fn torus() -> Vec<[f64; 3]> {
    let (mut random, mut cloud) = (Random(9), Vec::new());
    let apart = 0.075;
    for _ in 0..60_000 {
        let [around, along, kept] = [0.0; 3].map(|_| random.unit());
        let (u, v) = (2.0 * PI * around, 2.0 * PI * along);
        let ring = RADIUS + TUBE * v.cos();
        let point = [ring * u.cos(), ring * u.sin(), TUBE * v.sin()];
        let is_near = |q: &[f64; 3]| (0..3).map(|a| (point[a] - q[a]).powi(2)).sum::<f64>() < apart * apart;
        if kept * (RADIUS + TUBE) < ring && !cloud.iter().any(is_near) {
            cloud.push(point);
        }
    }
    cloud
}

/// The torus' normal and distance at a place near it.
fn at_torus(place: DVec3) -> (DVec3, f64) {
    let axis = DVec3::new(place.x, place.y, 0.0).normalize() * RADIUS;
    let away = place - axis;
    (away.normalize(), away.length() - TUBE)
}

/// The mean angle between a mesh's facets and the torus' normals, degrees, and the mean distance of their middles from it; by area.
fn beside_torus(mesh: &TriangleMesh) -> (f64, f64) {
    let (mut turned, mut off, mut area) = (0.0, 0.0, 0.0);
    for n in 0..mesh.len() {
        let [a, b, c] = mesh.corners(n).map(DVec3::from);
        let across = (b - a).cross(c - a);
        let (normal, distance) = at_torus((a + b + c) / 3.0);
        let weight = across.length();
        if weight > 0.0 {
            turned += weight * (across.dot(normal) / weight).clamp(-1.0, 1.0).acos().to_degrees();
            off += weight * distance.abs();
            area += weight;
        }
    }
    (turned / area, off / area)
}

/// Against the torus itself: facets are turned half as much from its normals as those of the level set are, and lie nearer to it; the mesh
/// has the same triangles of the same vertices, none farther from its place than is told.
#[test]
fn vertices_at_the_points_have_a_smooth_surface() {
    let cloud = torus();
    let (plain, _) = drawn(&cloud, &with(Vertices::LevelSet));
    let (moved, found) = drawn(&cloud, &ReconstructSettings::default());
    let ([before, far], [after, near]) =
        (<[f64; 2]>::from(beside_torus(&plain)), <[f64; 2]>::from(beside_torus(&moved)));
    println!("{} points: turned by {before}, then {after} degrees; off by {far}, then {near}", cloud.len());
    assert!(after < 0.55 * before && near < 0.8 * far, "{before} {after} {far} {near}");
    assert_eq!(plain.triangles, moved.triangles);
    let way = |n: usize| DVec3::from(plain.vertices[n]).distance(DVec3::from(moved.vertices[n]));
    let farthest = (0..plain.vertices.len()).map(way).fold(0.0, f64::max);
    // Places of the mesh are those of f32.
    assert!((farthest - found.moved_vertices).abs() < 1e-6, "{farthest} {}", found.moved_vertices);
    assert!(farthest <= 0.3001 * found.geometry.spacing[0], "{farthest}");
    let area = 4.0 * PI * PI * RADIUS * TUBE;
    assert!((found.measures.area / area - 1.0).abs() < 0.01, "{} {area}", found.measures.area);
}

/// A surface that is asked to leave its points does; u is the same whatever is drawn.
#[test]
fn vertices_follow_what_is_asked_for() {
    let cloud = sphere([0.0; 3], 2.0, 1500, |_| true);
    let h = grid_for(&cloud, None).expect("a grid").spacing[0];
    let usual = ReconstructSettings::default();
    let smoother = Motion { delta: Some(0.4 * h), ..usual.motion };
    let (_, found) = drawn(&cloud, &ReconstructSettings { motion: smoother, ..usual.clone() });
    assert_eq!(found.moved_vertices, 0.0);
    let weaker = Motion { theta: 0.5, ..usual.motion };
    let (_, found) = drawn(&cloud, &ReconstructSettings { motion: weaker, ..usual.clone() });
    assert_eq!(found.moved_vertices, 0.0);
    let (_, found) = drawn(&cloud, &ReconstructSettings { motion: weaker, ..with(Vertices::Points) });
    assert!(found.moved_vertices > 0.0);
    let (_, found) = drawn(&cloud, &usual);
    assert!(found.moved_vertices > 0.0);
    let (_, found) = drawn(&cloud, &with(Vertices::LevelSet));
    assert_eq!(found.moved_vertices, 0.0);
}
