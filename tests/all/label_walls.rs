//! Smooth walls between labels of a volume that touch: against analytic balls and ellipsoids, as closed surfaces of each label without gaps
//! and overlaps, and the same bits in any layout.

#![allow(clippy::unwrap_used)]

use std::collections::HashMap;
use std::f64::consts::PI;

use glam::DVec3;
use strandline::grid::{Box3, Geometry};
use strandline::pipeline::distance::seeding::label_borders::Labels;
use strandline::pipeline::middle::{Survey, WallsFound, WallsSettings, walls};
use strandline::{LabelledMesh, Result};

use crate::common::ball::{Bench, write_stack};
use crate::common::lab::{Lab, PlainGrid};
use crate::common::stores::volume;

/// Labels in memory.
struct Volume {
    geometry: Geometry,
    labels: Vec<u32>,
}

impl Volume {
    fn new(shape: [i64; 3], spacing: [f64; 3], label: impl Fn([i64; 3]) -> u32) -> Self {
        let geometry = Geometry { shape, spacing, origin: [3.0, -20.0, 100.0], unit: None };
        Self { geometry, labels: PlainGrid { shape }.voxels().map(label).collect() }
    }

    fn drawn(&self, background: bool, threads: usize) -> (WallsFound, LabelledMesh) {
        let mut mesh = LabelledMesh::default();
        let survey = Survey::new(self, || Ok(())).unwrap();
        let found =
            walls(&Lab::new(threads).engine, (self, &survey), WallsSettings { background }, None, &mut mesh).unwrap();
        (found, mesh)
    }

    /// What the voxels of a label take.
    fn volume_of(&self, label: u32) -> f64 {
        let voxels = self.labels.iter().filter(|&&other| other == label).count();
        voxels as f64 * self.geometry.spacing.iter().product::<f64>()
    }
}

impl Labels for Volume {
    fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    fn natural_boxes(&self) -> Box<dyn Iterator<Item = Box3> + '_> {
        Box::new(self.geometry.domain().tiles([self.geometry.shape[0], self.geometry.shape[1], 1]))
    }

    fn read_box(&self, part: &Box3, out: &mut Vec<u32>) -> Result<()> {
        self.geometry.domain().cut(&self.labels, part, out);
        Ok(())
    }
}

/// An ellipsoid by its half axes.
#[derive(Clone, Copy)]
struct Ellipsoid {
    axes: [f64; 3],
}

impl Ellipsoid {
    fn volume(self) -> f64 {
        4.0 / 3.0 * PI * self.axes.iter().product::<f64>()
    }

    /// By quadrature over its two angles.
    fn area(self) -> f64 {
        let [a, b, c] = self.axes;
        let steps = 600;
        let middle = |n: i32, length: f64| (f64::from(n) + 0.5) / f64::from(steps) * length;
        let element = |lift: f64, turn: f64| {
            let [x, y, z] = [lift.sin() * turn.cos(), lift.sin() * turn.sin(), lift.cos()];
            lift.sin() * ((b * c * x).powi(2) + (a * c * y).powi(2) + (a * b * z).powi(2)).sqrt()
        };
        let sum: f64 = (0..steps)
            .flat_map(|n| (0..steps).map(move |m| (n, m)))
            .map(|(n, m)| element(middle(n, PI), middle(m, 2.0 * PI)))
            .sum();
        sum * 2.0 * (PI / f64::from(steps)).powi(2)
    }

    /// Its voxels are label 1 of a volume that leaves some room around it, and its middle in the world.
    fn in_voxels(self, spacing: [f64; 3], off: [f64; 3]) -> (Volume, DVec3) {
        let shape: [i64; 3] = std::array::from_fn(|a| 2 * (self.axes[a] / spacing[a]).ceil() as i64 + 7);
        let middle: [f64; 3] = std::array::from_fn(|a| (shape[a] / 2) as f64 + off[a]);
        let at = |v: [i64; 3], a: usize| (v[a] as f64 - middle[a]) * spacing[a] / self.axes[a];
        let volume = Volume::new(shape, spacing, |v| u32::from((0..3).map(|a| at(v, a).powi(2)).sum::<f64>() < 1.0));
        let origin = volume.geometry.origin;
        (volume, DVec3::from_array(std::array::from_fn(|a| origin[a] + middle[a] * spacing[a])))
    }

    /// How far the facets of its surface are turned from its own, in degrees: mean over the area, and root of the mean square.
    fn turned(self, mesh: &LabelledMesh, middle: DVec3) -> [f64; 2] {
        let mut sums = [0.0; 3];
        for triangle in &mesh.mesh.triangles {
            let [a, b, c] = triangle.map(|n| DVec3::from(mesh.mesh.vertices[n as usize]) - middle);
            let across = (b - a).cross(c - a);
            let own = (a + b + c) / DVec3::from(self.axes).powf(2.0);
            // The label lies on the side of the larger one: facets look inward.
            let angle = if across.length() > 0.0 { across.angle_between(-own).to_degrees() } else { 0.0 };
            let area = 0.5 * across.length();
            sums = [sums[0] + area, sums[1] + area * angle, sums[2] + area * angle * angle];
        }
        [sums[1] / sums[0], (sums[2] / sums[0]).sqrt()]
    }
}

/// Each label's facets, outward: edges walked as often in one direction as in the other, twice in all, and the Euler number.
fn euler(mesh: &LabelledMesh, label: u32) -> i64 {
    let mut edges: HashMap<(u32, u32), (u32, i32)> = HashMap::new();
    let mut vertices = std::collections::HashSet::new();
    let mut facets = 0;
    for (&[a, b, c], pair) in mesh.mesh.triangles.iter().zip(&mesh.labels).filter(|(_, pair)| pair.contains(&label)) {
        facets += 1;
        let [a, b, c] = if pair[0] == label { [a, b, c] } else { [a, c, b] };
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let edge = edges.entry((from.min(to), from.max(to))).or_default();
            edge.0 += 1;
            edge.1 += if from < to { 1 } else { -1 };
            vertices.insert(from);
        }
    }
    assert!(edges.values().all(|edge| *edge == (2, 0)), "label {label} is not closed");
    vertices.len() as i64 - edges.len() as i64 + facets
}

#[test]
fn balls_and_ellipsoids_have_their_area_volume_and_normals() {
    // Half axes, spacing, middle off the voxels; degrees that normals may be off, mean and root of the mean square.
    let cases = [
        ([10.0; 3], [1.0; 3], [0.1, 0.23, 0.37], [3.0, 3.3]),
        ([20.0; 3], [1.0; 3], [0.1, 0.23, 0.37], [2.0, 2.4]),
        ([40.0; 3], [1.0; 3], [0.45, 0.31, 0.18], [1.7, 2.1]),
        ([30.0, 20.0, 12.0], [1.0; 3], [0.1, 0.23, 0.37], [2.2, 2.7]),
        ([20.0; 3], [0.5, 0.5, 1.0], [0.1, 0.23, 0.37], [2.0, 2.6]),
        ([20.0; 3], [1.0, 1.0, 2.0], [0.45, 0.31, 0.18], [2.5, 3.0]),
        ([60.0, 40.0, 50.0], [1.0, 2.0, 1.5], [0.1, 0.23, 0.37], [2.0, 2.6]),
    ];
    for (axes, spacing, off, most) in cases {
        let body = Ellipsoid { axes };
        let (volume, middle) = body.in_voxels(spacing, off);
        let (found, mesh) = volume.drawn(true, 2);
        let [label] = found.labels.as_slice() else { panic!("one label") };
        let turned = body.turned(&mesh, middle);
        let area = label.area / body.area() - 1.0;
        let enclosed = label.volume.unwrap();
        let [off, off_voxels] = [body.volume(), volume.volume_of(1)].map(|true_one| enclosed / true_one - 1.0);
        println!(
            "{axes:?} {spacing:?}: area {area:.4}, volume {off:.4}, {off_voxels:.4} off the voxels', turned {turned:?}"
        );
        assert!(area.abs() < 0.01 && off.abs() < 0.005 && off_voxels.abs() < 0.004);
        assert!(turned[0] < most[0] && turned[1] < most[1], "{turned:?}");
        assert_eq!(euler(&mesh, 1), 2);
        assert!(found.measures.is_closed() && (found.measures.volume.abs() - enclosed).abs() < 1e-9 * enclosed);
        if axes == [axes[0]; 3] {
            // That of a ball is one over its radius; chords are four thirds of it long in the mean.
            assert!((label.mean_curvature * axes[0] - 1.0).abs() < 0.02, "{}", label.mean_curvature);
            assert!((label.thickness.unwrap() / axes[0] * 0.75 - 1.0).abs() < 0.01);
        }
    }
}

/// Walls stay within half a voxel of the faces between voxels: on no edge between two voxels of one label, and plates keep their sides.
#[test]
fn plates_of_any_thickness_keep_their_sides() {
    for thick in [1_i64, 2, 3, 4, 5, 6, 8, 12] {
        let volume = Volume::new([24, 24, 30], [1.0; 3], |[_, _, z]| 1 + u32::from((9..9 + thick).contains(&z)));
        let (found, mesh) = volume.drawn(false, 1);
        let [pair] = found.pairs.as_slice() else { panic!("one pair") };
        let sides = mesh.mesh.vertices.iter().map(|v| v[2] - 100.0 - 8.5);
        let off = sides.map(|z| z.abs().min((z - thick as f64).abs())).fold(0.0, f64::max);
        println!("{thick}: {off}");
        assert!(off < if thick < 3 { 0.25 } else { 0.12 }, "{thick} voxels: {off}");
        assert!((pair.area / (2.0 * 23.0 * 23.0) - 1.0).abs() < 1e-3 && pair.contact_area == pair.area);
        // The surfaces are flat, and end where the grid does.
        assert!(pair.mean_curvature().abs() < 1e-3 && found.labels.iter().all(|label| label.volume.is_none()));
    }
}

/// A voxel's cell of some middles, spread by irrational steps; 0 outside of a ball.
fn cells(count: usize, shape: [i64; 3]) -> impl Fn([i64; 3]) -> u32 {
    let place = |n: usize| [2.0_f64, 3.0, 5.0].map(|root| (n as f64 * root.sqrt()).fract());
    let middles: Vec<[f64; 3]> = (1..=count).map(|n| std::array::from_fn(|a| place(n)[a] * shape[a] as f64)).collect();
    move |v| {
        let from = |middle: [f64; 3]| (0..3).map(|a| (v[a] as f64 - middle[a]).powi(2)).sum::<f64>();
        if from(shape.map(|n| 0.48 * n as f64)) > (0.45 * shape[0] as f64).powi(2) {
            return 0;
        }
        (0..count).min_by(|&n, &m| from(middles[n]).total_cmp(&from(middles[m]))).map_or(0, |n| 7 * n as u32 + 3)
    }
}

#[test]
fn two_halves_of_a_ball_share_a_disc() {
    let inside = |v: [i64; 3]| (0..3).map(|a| (v[a] as f64 - 24.3).powi(2)).sum::<f64>() < 400.0;
    let upper = |[x, y, z]: [i64; 3]| 0.3 * (x as f64 - 24.3) + (y as f64 - 24.3) + 0.2 * (z as f64 - 24.3) > 0.0;
    let volume = Volume::new([49; 3], [1.0; 3], |v| if inside(v) { 1 + u32::from(upper(v)) } else { 0 });
    let (found, mesh) = volume.drawn(true, 2);
    let labels: Vec<[u32; 2]> = found.pairs.iter().map(|pair| pair.labels).collect();
    assert_eq!(labels, [[0, 1], [0, 2], [1, 2]]);
    assert!((found.pairs[2].area / (PI * 400.0) - 1.0).abs() < 0.01, "{:?}", found.pairs[2]);
    assert!(((found.pairs[0].area + found.pairs[1].area) / (4.0 * PI * 400.0) - 1.0).abs() < 0.012);
    let [of_first, _, of_disc] = [0, 1, 2].map(|n| found.pairs[n].mean_curvature());
    assert!(of_disc.abs() < 0.006 && of_first < -0.03, "{of_disc} {of_first}");
    let enclosed: f64 = found.labels.iter().map(|label| label.volume.unwrap()).sum();
    assert!((enclosed / (4.0 / 3.0 * PI * 8000.0) - 1.0).abs() < 0.005, "no gap, no overlap: {enclosed}");
    for label in &found.labels {
        assert_eq!(euler(&mesh, label.label), 2);
        assert!((label.volume.unwrap() / volume.volume_of(label.label) - 1.0).abs() < 0.005);
        let (contact, area) = (label.contact_area, found.pairs[2].area);
        assert!((contact / area - 1.0).abs() < 1e-9, "label {}: {contact} of {area}", label.label);
    }
}

#[test]
fn many_cells_are_closed_and_fill_what_they_fill_together() {
    let shape = [70, 66, 64];
    let volume = Volume::new(shape, [0.5, 0.5, 0.8], cells(30, shape));
    let (found, mesh) = volume.drawn(true, 2);
    assert_eq!(found.labels.len(), found.label_voxels.len());
    let (mut enclosed, mut voxels) = (0.0, 0.0);
    for label in &found.labels {
        let number = euler(&mesh, label.label);
        let (own, its) = (label.volume.unwrap(), volume.volume_of(label.label));
        // Half spaces and a ball share one piece without a hole; of slivers voxels may leave several that touch along edges.
        let is_sliver = found.label_voxels[&label.label] < 500;
        if !is_sliver {
            assert_eq!(number, 2, "label {} of {} voxels", label.label, found.label_voxels[&label.label]);
        }
        if found.label_voxels[&label.label] > 300 {
            let most = if is_sliver { 0.06 } else { 0.03 };
            assert!((own / its - 1.0).abs() < most, "label {}: {own} of {its}", label.label);
        }
        let walls = found.pairs.iter().filter(|pair| pair.labels.contains(&label.label));
        assert!((walls.map(|pair| pair.area).sum::<f64>() / label.area - 1.0).abs() < 1e-12);
        enclosed += own;
        voxels += its;
    }
    // What all enclose together is what lies within their surface against 0: nothing is left out or counted twice.
    let around: f64 = found
        .pairs
        .iter()
        .filter(|pair| pair.labels[0] == 0)
        .map(|pair| {
            let own = mesh.labels.iter().zip(&mesh.mesh.triangles).filter(|(labels, _)| **labels == pair.labels);
            own.map(|(_, t)| {
                let [a, b, c] =
                    t.map(|n| DVec3::from(mesh.mesh.vertices[n as usize]) - DVec3::from(volume.geometry.origin));
                -a.dot(b.cross(c)) / 6.0
            })
            .sum::<f64>()
        })
        .sum();
    assert!((around / enclosed - 1.0).abs() < 1e-9 && (enclosed / voxels - 1.0).abs() < 0.005, "{around} {enclosed}");
}

/// A label that fills its volume is closed where the volume ends, half a voxel beyond its last voxels.
#[test]
fn what_fills_the_volume_is_closed_at_its_end() {
    let volume = Volume::new([40, 36, 34], [1.0, 1.0, 2.0], |_| 5);
    let (found, mesh) = volume.drawn(true, 1);
    assert_eq!(euler(&mesh, 5), 2);
    let (own, its) = (found.labels[0].volume.unwrap(), volume.volume_of(5));
    assert!((own / its - 1.0).abs() < 0.01, "{own} of {its}: edges and corners are rounded");
    // Flat but near edges, and nowhere farther from the faces between voxels than half a voxel.
    let inner = |v: &&[f64; 3]| (0..2).all(|a| (6.0..28.0).contains(&(v[a] - volume.geometry.origin[a])));
    let below = mesh.mesh.vertices.iter().filter(|v| v[2] < 105.0);
    assert!(below.clone().all(|v| v[2] >= 98.0));
    let flat: Vec<f64> = below.filter(inner).map(|v| v[2]).collect();
    assert!(flat.len() > 100 && flat.iter().all(|z| (z - 99.0).abs() < 0.1), "{flat:?}");
}

#[test]
fn layouts_change_no_bit() {
    let bench = Bench::bare();
    let shape = [70, 45, 41];
    let geometry = Geometry { shape, spacing: [0.4, 0.4, 0.9], origin: [0.0; 3], unit: Some("micrometer".into()) };
    let label = cells(12, shape);
    let some: Vec<u16> = PlainGrid { shape }.voxels().map(|v| label(v) as u16).collect();
    let full: Vec<u16> = some.iter().map(|&label| label.max(1)).collect();
    write_stack(&bench.path("some.tif"), &geometry, &[&some]);
    write_stack(&bench.path("full.tif"), &geometry, &[&full]);
    bench.succeed("convert some.tif some.zarr");
    for (input, flags) in [("some", "--background"), ("full", ""), ("some", "--labels exact")] {
        let mut first: Option<(Vec<u8>, String)> = None;
        for (n, layout) in
            ["--threads 1", "--threads 2 --brick 16", "--brick 64 --ranks 3", "--memory 300MiB"].iter().enumerate()
        {
            // The same labels in other boxes.
            let mut layout = (*layout).to_owned();
            if flags.starts_with("--labels") {
                // Of equally near sources another may be tracked with bricks of another size.
                layout = layout.replace("--brick 16", "").replace("--brick 64", "");
            }
            let file = if input == "some" && n == 1 { "some.zarr" } else { &format!("{input}.tif") };
            let out = format!("{input}{n}{}", flags.len());
            bench.succeed(&format!("middle {file} {flags} {layout} -o {out}.zarr --mesh {out}.stl"));
            let mesh = std::fs::read(bench.path(&format!("{out}.stl"))).unwrap();
            let told =
                |name: &str| std::fs::read_to_string(bench.path(&format!("{out}.zarr/meshes/{name}.csv"))).unwrap();
            let found = (mesh, told("pairs") + &told("labels"));
            let first = first.get_or_insert_with(|| found.clone());
            assert!(first.0 == found.0, "{input} {flags} {layout}: another mesh");
            assert_eq!(first.1, found.1, "{input} {flags} {layout}");
            if flags == "--background" {
                let wanted: Vec<f64> = some.iter().map(|&label| label.into()).collect();
                assert_eq!(volume(&bench.path(&format!("{out}.zarr/labels/nearest"))), wanted);
            }
        }
    }
    let report = bench.json(&format!("some0{}.zarr/report.json", "--background".len()));
    let labels = report["result"]["labels"].as_array().unwrap();
    assert_eq!(labels.len(), report["result"]["label_voxels"].as_object().unwrap().len());
    assert!(labels.iter().all(|label| label["volume"].is_f64() && label["mean_curvature"].is_f64()));
    let table = std::fs::read_to_string(bench.path("full00.zarr/meshes/labels.csv")).unwrap();
    assert!(table.starts_with("label,voxels,volume,area,contact_area,mean_curvature,thickness\n"), "{table}");
}

/// Where labels touch in part and lie apart in part: walls there, the surface equally far from both here, and both one surface.
#[test]
fn walls_go_over_into_the_surface_between_labels_apart() {
    let bench = Bench::bare();
    let shape = [40, 40, 40];
    let geometry = Geometry { shape, spacing: [1.0; 3], origin: [0.0; 3], unit: None };
    // Two blocks with a tilted side, and between them, from x = 22 on, a gap that opens.
    let label = |[x, y, z]: [i64; 3]| {
        let height = z as f64 - 19.6 - 0.23 * (y as f64 - 20.0);
        let gap = if x < 22 { 0.0 } else { 0.5 * (x - 22) as f64 };
        if height < -gap {
            1
        } else if height > gap {
            2
        } else {
            0
        }
    };
    let voxels: Vec<u16> = PlainGrid { shape }.voxels().map(label).collect();
    write_stack(&bench.path("blocks.tif"), &geometry, &[&voxels]);
    bench.succeed("middle blocks.tif --labels exact -o out.zarr --report report.json");
    let report = bench.json("report.json");
    let pair = &report["result"]["pairs"][0];
    let [area, contact] = ["area", "contact_area"].map(|name| pair[name].as_f64().unwrap());
    // A tilted plane of 39 by 39 voxels, of which 21 to 22 touch; in the gap, steps of voxels show.
    let slope = (1.0_f64 + 0.23 * 0.23).sqrt();
    println!("{area} {contact} {}", 39.0 * 39.0 * slope);
    assert!((contact / (21.5 * 39.0 * slope) - 1.0).abs() < 0.05, "{contact}");
    assert!((area / (39.0 * 39.0 * slope) - 1.0).abs() < 0.06, "{area}");
    assert_eq!(pair["distance"]["min"], 0.0);
    assert!(pair["thickness"]["max"].as_f64().unwrap() > 10.0);
    assert_eq!(report["result"]["components"], 1);
}

#[test]
fn what_has_no_walls_is_refused() {
    let bench = Bench::bare();
    let shape = [20, 16, 12];
    let geometry = Geometry { shape, spacing: [1.0; 3], origin: [0.0; 3], unit: None };
    let write = |name: &str, label: &dyn Fn([i64; 3]) -> u16| {
        write_stack(&bench.path(name), &geometry, &[&PlainGrid { shape }.voxels().map(label).collect::<Vec<_>>()]);
    };
    write("one.tif", &|[x, y, _]| u16::from((5..12).contains(&x) && (4..12).contains(&y)));
    write("none.tif", &|_| 0);
    bench.write("points.xyz", "1 2 3\n4 5 6\n");
    for (arguments, complaint) in [
        ("middle one.tif", "--background"),
        ("middle none.tif --background", "holds no label"),
        ("middle points.xyz one.tif --background", "one label volume"),
        ("middle one.tif --background --spacing 0.5", "one label volume"),
        ("middle one.tif --background --surface labels", "one label volume"),
    ] {
        let text = bench.fail(&format!("{arguments} -o none"), 2);
        assert!(text.contains(complaint), "{arguments}: {text}");
    }
    bench.succeed("middle one.tif --background -o out.zarr");
    bench.succeed("verify out.zarr");
}
