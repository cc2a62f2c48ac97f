//! Objects that meet: overlaps by depth, gaps along the wall, common faces; on shapes whose answers are known.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;

use strandline::grid::{Box3, Geometry};
use strandline::kernel::surface::Contact;
use strandline::pipeline::segment::{FillGaps, Joining, NeighboursFound, Overlap, Placed, draw_faces, join};
use strandline::store::{BoxSource, BrickArray, MeshSink};

use crate::common::lab::{Lab, dense};

/// Objects by their labels, each told by whether a place lies in it.
type Object<'a> = (u32, &'a dyn Fn([f64; 3]) -> bool);

/// A box of voxels with objects in it, and an image where there is one.
struct Scene<'a> {
    geometry: Geometry,
    objects: Vec<Object<'a>>,
    image: Option<Grey>,
}

/// An image, dense over its shape, with its border repeated beyond.
struct Grey {
    shape: [i64; 3],
    values: Vec<f32>,
}

impl BoxSource<f32> for Grey {
    fn shape(&self) -> [i64; 3] {
        self.shape
    }

    fn read_box(&self, part: &Box3, out: &mut [f32]) -> strandline::error::Result<()> {
        let whole = Box3::from_shape(self.shape);
        let voxels = part.rows().flat_map(|(y, z)| (part.lo[0]..part.hi[0]).map(move |x| [x, y, z]));
        for (out, voxel) in out.iter_mut().zip(voxels) {
            let inside = std::array::from_fn(|a| voxel[a].clamp(0, self.shape[a] - 1));
            *out = self.values[whole.offset_of(inside)];
        }
        Ok(())
    }
}

/// A mesh in memory with the labels of its triangles.
#[derive(Default, PartialEq, Debug)]
struct Faces {
    vertices: Vec<[f64; 3]>,
    facets: Vec<([u32; 3], [u32; 2])>,
}

impl MeshSink for Faces {
    fn vertex(&mut self, position: [f64; 3]) -> strandline::error::Result<()> {
        self.vertices.push(position);
        Ok(())
    }

    fn triangle(&mut self, corners: [u32; 3]) -> strandline::error::Result<()> {
        self.facet(corners, [0; 2])
    }

    fn facet(&mut self, corners: [u32; 3], labels: [u32; 2]) -> strandline::error::Result<()> {
        self.facets.push((corners, labels));
        Ok(())
    }
}

/// What came of a scene.
#[derive(PartialEq, Debug)]
struct Tissue {
    labels: Vec<u32>,
    found: NeighboursFound,
    faces: Faces,
    contacts: Vec<Contact>,
}

/// How a scene is joined: overlap, gaps, edge of the fields' bricks, threads, window.
#[derive(Clone, Copy)]
struct How {
    overlap: Overlap,
    fill: Option<FillGaps>,
    brick: i64,
    threads: usize,
    window: u64,
}

const PLAIN: How = How { overlap: Overlap::Smaller, fill: None, brick: 16, threads: 2, window: 1 << 30 };

impl Scene<'_> {
    fn voxels(&self) -> impl Iterator<Item = [f64; 3]> + use<> {
        let domain = self.geometry.domain();
        domain.rows().flat_map(move |(y, z)| (0..domain.hi[0]).map(move |x| [x as f64, y as f64, z as f64]))
    }

    fn join(&self, how: How) -> Tissue {
        let lab = Lab::with_window(how.threads, how.window);
        let set = dense(self.geometry.shape, how.brick);
        let fields: Vec<(u32, BrickArray<f32>, f64)> = self
            .objects
            .iter()
            .map(|(label, holds)| {
                let u: Vec<f32> = self.voxels().map(|v| f32::from(u8::from(holds(v)))).collect();
                let volume = u.iter().map(|u| f64::from(*u)).sum();
                (*label, lab.field(&set, &u), volume)
            })
            .collect();
        let window = self.geometry.domain();
        let placed =
            fields.iter().map(|(label, u, volume)| Placed { label: *label, window, u, volume: *volume }).collect();
        let image = self.image.as_ref().map(|image| image as &dyn BoxSource<f32>);
        let joining = Joining { geometry: &self.geometry, image, overlap: how.overlap, fill: how.fill };
        let joined = join(&lab.engine, placed, &joining).unwrap();
        let mut labels = vec![0; window.len()];
        joined.read_box(&window, &mut labels).unwrap();
        let mut faces = Faces::default();
        let stage = lab.engine.stage("faces", 0);
        let contacts = draw_faces(&stage, &self.geometry, &joined, &mut faces).unwrap();
        Tissue { labels, found: joined.found.clone(), faces, contacts }
    }
}

impl Tissue {
    fn area(&self, labels: [u32; 2]) -> f64 {
        self.contacts.iter().find(|contact| contact.labels == labels).map_or(0.0, |contact| contact.area)
    }

    /// Holds that the facets of each label are a closed, consistently oriented surface.
    fn check_closed(&self) {
        let mut edges: BTreeMap<(u32, u32, u32), i64> = BTreeMap::new();
        for (corners, pair) in &self.faces.facets {
            // A facet is counter-clockwise as seen from the larger label: turned for the smaller one.
            for (label, sign) in [(pair[0], 1), (pair[1], -1)] {
                for n in 0..3 {
                    let (a, b) = (corners[n], corners[(n + 1) % 3]);
                    let (key, along) = if a < b { ((label, a, b), sign) } else { ((label, b, a), -sign) };
                    *edges.entry(key).or_default() += along;
                }
            }
        }
        assert!(edges.values().all(|sum| *sum == 0), "an edge of a label is open");
    }
}

fn grid(shape: [i64; 3]) -> Geometry {
    Geometry { shape, spacing: [1.0; 3], origin: [0.0; 3], unit: None }
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|n| (a[n] - b[n]).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn neighbours_share_an_overlap_evenly_and_nested_objects_keep_theirs() {
    let left = |v: [f64; 3]| distance(v, [18.0, 20.0, 20.0]) < 12.0;
    let right = |v: [f64; 3]| distance(v, [36.0, 20.0, 20.0]) < 12.0;
    let core = |v: [f64; 3]| distance(v, [16.0, 20.0, 20.0]) < 5.0;
    let objects: Vec<Object<'_>> = vec![(1, &left), (2, &right), (3, &core)];
    let scene = Scene { geometry: grid([55, 41, 41]), objects, image: None };
    let tissue = scene.join(PLAIN);
    assert_eq!(tissue.found.nested, [[3, 1]]);
    let both = scene.voxels().filter(|&v| left(v) && right(v)).count() as u64;
    assert_eq!(tissue.found.contested, both);
    for (v, &label) in scene.voxels().zip(&tissue.labels) {
        let expected = match (left(v), right(v)) {
            _ if core(v) => 3,
            (true, true) if v[0] == 27.0 => continue,
            (true, true) => 1 + u32::from(v[0] > 27.0),
            (true, false) => 1,
            (false, is_right) => 2 * u32::from(is_right),
        };
        assert_eq!(label, expected, "{v:?}");
    }
    // What is equally deep in both goes to the lower label.
    let is_middle = |v: [f64; 3]| left(v) && right(v) && v[0] == 27.0;
    let middle: Vec<u32> =
        scene.voxels().zip(&tissue.labels).filter(|(v, _)| is_middle(*v)).map(|(_, label)| *label).collect();
    assert!(middle.len() > 20 && middle.iter().all(|label| *label == 1));
    tissue.check_closed();
    let last = scene.join(How { overlap: Overlap::Last, ..PLAIN });
    assert!(scene.voxels().zip(&last.labels).all(|(v, label)| !right(v) || *label == 2), "the user's word");
    assert_eq!(last.found.contested, 0);
}

#[test]
fn a_gap_is_shared_in_the_middle_without_an_image_and_on_the_crest_with_one() {
    // A ball cut in two by a slab of four voxels; the left half claims one voxel of that too many.
    let ball = |v: [f64; 3]| distance(v, [24.0; 3]) < 20.0;
    let left = |v: [f64; 3]| ball(v) && v[0] < 23.0;
    let right = |v: [f64; 3]| ball(v) && v[0] > 26.0;
    let (shape, disc) = ([49; 3], std::f64::consts::PI * 400.0);
    let objects: Vec<Object<'_>> = vec![(1, &left), (2, &right)];
    let mut scene = Scene { geometry: grid(shape), objects, image: None };
    let how = How { fill: Some(FillGaps::Width(12.0)), ..PLAIN };
    let split = |tissue: &Tissue, at: f64| {
        let wrong = |(v, label): &([f64; 3], &u32)| {
            ball(*v) && distance(*v, [24.0; 3]) < 17.0 && (v[0] - at).abs() > 0.6 && **label != 1 + u32::from(v[0] > at)
        };
        scene_voxels(shape).zip(&tissue.labels).filter(wrong).count()
    };
    let tissue = scene.join(how);
    assert_eq!(split(&tissue, 24.5), 0, "the middle");
    assert!((tissue.area([1, 2]) / disc - 1.0).abs() < 0.05, "{} of {disc}", tissue.area([1, 2]));
    tissue.check_closed();
    for (crest, is_dark) in [(24.5, false), (26.0, false), (23.0, true), (21.5, false)] {
        let bright = |v: [f64; 3]| (-0.5 * ((v[0] - crest) / 1.2_f64).powi(2)).exp() as f32;
        let values = scene_voxels(shape).map(|v| if is_dark { 1.0 - bright(v) } else { bright(v) }).collect();
        scene.image = Some(Grey { shape, values });
        let tissue = scene.join(how);
        assert_eq!(split(&tissue, crest), 0, "crest at {crest}, {:?}", tissue.found);
        tissue.check_closed();
    }
}

fn scene_voxels(shape: [i64; 3]) -> impl Iterator<Item = [f64; 3]> {
    let domain = Box3::from_shape(shape);
    domain.rows().flat_map(move |(y, z)| (0..domain.hi[0]).map(move |x| [x as f64, y as f64, z as f64]))
}

/// Places of cells, none near a plane between others.
const CELLS: [[f64; 3]; 6] = [
    [14.2, 15.7, 16.1],
    [35.1, 13.4, 20.3],
    [20.3, 36.2, 15.2],
    [36.4, 33.7, 28.8],
    [15.8, 25.1, 36.9],
    [31.2, 15.6, 38.4],
];
const MIDDLE: [f64; 3] = [24.0; 3];
const RADIUS: f64 = 20.0;

/// The nearest cell, and how far the wall to the next one is.
fn nearest(v: [f64; 3]) -> (usize, f64) {
    let order = |n: usize| distance(v, CELLS[n]);
    let best = (0..6).min_by(|&a, &b| order(a).total_cmp(&order(b))).unwrap();
    let to_wall = |n: usize| (order(n).powi(2) - order(best).powi(2)) / (2.0 * distance(CELLS[n], CELLS[best]));
    (best, (0..6).filter(|&n| n != best).map(to_wall).fold(f64::INFINITY, f64::min))
}

/// The area of the face between two cells, counted on the plane between them.
fn true_area(a: usize, b: usize) -> f64 {
    let length = distance(CELLS[a], CELLS[b]);
    let normal: [f64; 3] = std::array::from_fn(|n| (CELLS[b][n] - CELLS[a][n]) / length);
    let axis = (0..3).min_by(|&m, &n| normal[m].abs().total_cmp(&normal[n].abs())).unwrap();
    let cross = |u: [f64; 3], v: [f64; 3]| -> [f64; 3] {
        [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
    };
    let side = cross(normal, std::array::from_fn(|n| f64::from(u8::from(n == axis))));
    let size = side.iter().map(|v| v * v).sum::<f64>().sqrt();
    let (side, step) = (side.map(|v| v / size), 0.25);
    let other = cross(normal, side);
    let place = |i: i32, j: i32| -> [f64; 3] {
        let (s, t) = (f64::from(i) * step, f64::from(j) * step);
        std::array::from_fn(|n| 0.5 * (CELLS[a][n] + CELLS[b][n]) + s * side[n] + t * other[n])
    };
    let is_on = |v: [f64; 3]| {
        let own = distance(v, CELLS[a]);
        distance(v, MIDDLE) < RADIUS && (0..6).all(|n| distance(v, CELLS[n]) > own - 1e-9)
    };
    let count = (-160..160).flat_map(|i| (-160..160).map(move |j| (i, j))).filter(|&(i, j)| is_on(place(i, j))).count();
    count as f64 * step * step
}

#[test]
fn a_foam_becomes_cells_with_common_faces_to_the_same_bits() {
    let holds = |n: usize| move |v: [f64; 3]| distance(v, MIDDLE) < RADIUS && nearest(v).0 == n && nearest(v).1 > 1.5;
    let cells: Vec<_> = (0..6).map(holds).collect();
    let objects = cells.iter().enumerate().map(|(n, cell)| (n as u32 + 1, cell as &dyn Fn([f64; 3]) -> bool)).collect();
    let shape = [49; 3];
    let wall = |v: [f64; 3]| (-0.5 * (nearest(v).1 / 1.3).powi(2)).exp() as f32;
    let image = Grey { shape, values: scene_voxels(shape).map(wall).collect() };
    let scene = Scene { geometry: grid(shape), objects, image: Some(image) };
    let how = How { fill: Some(FillGaps::Auto), ..PLAIN };
    let tissue = scene.join(how);
    let (mut left, mut wrong, mut near) = (0, 0, 0);
    for (v, &label) in scene.voxels().zip(&tissue.labels).filter(|(v, _)| distance(*v, MIDDLE) < RADIUS - 2.0) {
        let (cell, to_wall) = nearest(v);
        near += u64::from(to_wall < 3.0);
        left += u64::from(label == 0);
        wrong += u64::from(label > 0 && label != cell as u32 + 1);
    }
    assert_eq!(left, 0, "{:?}", tissue.found);
    assert!(wrong * 100 < 3 * near, "{wrong} of {near}");
    tissue.check_closed();
    // Faces 10 to 20 voxels wide: a line that is off by a third of a voxel all around is 5 % of them.
    let (mut sum, mut off) = (0.0, 0.0);
    for contact in tissue.contacts.iter().filter(|contact| contact.labels[0] > 0 && contact.area > 100.0) {
        let [a, b] = contact.labels.map(|label| label as usize - 1);
        let expected = true_area(a, b);
        assert!((contact.area / expected - 1.0).abs() < 0.1, "{contact:?}: {expected}");
        (sum, off) = (sum + expected, off + (contact.area - expected).abs());
    }
    assert!(sum > 1000.0 && off < 0.05 * sum, "{off} of {sum}");
    let ball = 4.0 * std::f64::consts::PI * RADIUS * RADIUS;
    let outside: f64 = tissue.contacts.iter().filter(|c| c.labels[0] == 0).map(|contact| contact.area).sum();
    assert!((outside / ball - 1.0).abs() < 0.05, "{outside} of {ball}");
    for other in [How { brick: 32, threads: 1, ..how }, How { brick: 64, threads: 3, window: 1 << 20, ..how }] {
        let again = scene.join(other);
        assert!(again == tissue, "brick {} threads {}", other.brick, other.threads);
    }
}
