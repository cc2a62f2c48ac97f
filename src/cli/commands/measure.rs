//! `strandline measure`: volume, area, closedness and pieces of a triangle mesh, and how far points lie from it.
//!
//! What is measured is the mesh as it is meant (`crate::kernel::geometry::solid`); notes tell where that is not the mesh as it came.

use std::io::Write;
use std::path::Path;

use serde_json::json;

use crate::cli::args::measure::MeasureArgs;
use crate::cli::inputs::noted::read_told;
use crate::cli::print;
use crate::cli::terminal::console::{Console, Voice};
use crate::cli::terminal::text::{grouped, number};
use crate::error::{Error, Result};
use crate::exec::Progress;
use crate::grid::TriangleMesh;
use crate::io::geometry::read::source::Source;
use crate::kernel::geometry::solid::Solid;
use crate::kernel::surface::{Hausdorff, Measures, PatchIndex};

/// Runs the command.
pub(crate) fn run(args: &MeasureArgs) -> Result<()> {
    let mesh = match read_told(&args.mesh, &note)? {
        Source::Mesh(mesh) => mesh,
        Source::Cloud(_) => return Err(Error::input("holds points and no triangle; give a mesh").at(&args.mesh)),
    };
    let points = args.points.as_deref().map(read_points).transpose()?;
    let solid = Solid::new(mesh);
    for sentence in solid.found.sentences() {
        note(&format!("{}: {sentence}", args.mesh.display()));
    }
    let local = Local::new(&solid.mesh).map_err(|error| error.at(&args.mesh))?;
    let measures = local.measures(&solid);
    let hausdorff = points.and_then(|points| local.distances(&solid.mesh, &measures, &points));
    print(&if args.json { as_json(&measures, &solid, hausdorff) } else { as_lines(&measures, &solid, hausdorff) })
}

fn read_points(path: &Path) -> Result<Vec<[f64; 3]>> {
    let console = Console::new(Voice::of(false, false));
    Ok(match read_told(path, &|text| console.note(text))? {
        Source::Cloud(cloud) => cloud.positions,
        Source::Mesh(mesh) => mesh.vertices,
    })
}

/// The mesh as seen from its middle, so that no digits are spent on where it lies.
struct Local {
    middle: [f64; 3],
    vertices: Vec<[f64; 3]>,
}

impl Local {
    fn new(mesh: &TriangleMesh) -> Result<Self> {
        let (low, high) = mesh.bounds().ok_or_else(|| Error::input("holds no triangle"))?;
        let middle = std::array::from_fn(|a| f64::midpoint(low[a], high[a]));
        let vertices: Vec<[f64; 3]> = mesh.vertices.iter().map(|p| seen_from(middle, *p)).collect();
        let is_measurable = vertices.iter().flatten().all(|&v| (v as f32).is_finite());
        is_measurable
            .then_some(Self { middle, vertices })
            .ok_or_else(|| Error::input("reaches farther than single precision does; scale it down"))
    }

    fn measures(&self, solid: &Solid) -> Measures {
        solid.measures(|v| self.vertices[v as usize])
    }

    /// Distances of points from the surface.
    fn distances(&self, mesh: &TriangleMesh, measures: &Measures, points: &[[f64; 3]]) -> Option<Hausdorff> {
        // The side of a mean triangle.
        let side = (measures.area / measures.triangles as f64).sqrt();
        let edge = if side > 0.0 { side } else { 1.0 };
        // In f32 they lie within a ten millionth of the mesh of where they are.
        let vertices: Vec<[f32; 3]> = self.vertices.iter().map(|p| p.map(|v| v as f32)).collect();
        let index = PatchIndex::new(&vertices, &mesh.triangles, edge);
        index.hausdorff_from(points.iter().map(|&p| seen_from(self.middle, p)))
    }
}

fn seen_from(middle: [f64; 3], point: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|a| point[a] - middle[a])
}

fn as_json(measures: &Measures, solid: &Solid, hausdorff: Option<Hausdorff>) -> String {
    let (edges, found) = (solid.edges, solid.found);
    let document = json!({
        "volume": measures.volume,
        "area": measures.area,
        "closed": edges.is_closed() && edges.is_oriented(),
        "boundary_edges": edges.open,
        "flipped_edges": found.flipped_edges,
        "turned_triangles": found.turned,
        "doubled_triangles": found.doubled + found.two_sided,
        "inverted_pieces": found.inverted,
        "welded_within": found.welded_within,
        "components": measures.components,
        "triangles": measures.triangles,
        "vertices": measures.vertices,
        "hausdorff": hausdorff.map(|h| json!({ "mean": h.mean, "max": h.max })),
    });
    format!("{document:#}\n")
}

fn as_lines(measures: &Measures, solid: &Solid, hausdorff: Option<Hausdorff>) -> String {
    let edges = solid.edges;
    let closed = match (edges.is_closed(), edges.is_oriented()) {
        (true, true) => "closed".into(),
        (true, false) => {
            format!("closed, {} edges whose triangles disagree on what is outside", grouped(edges.flipped))
        }
        (false, _) => format!("open, {} boundary edges; its volume means nothing", grouped(edges.open)),
    };
    let mut lines = vec![
        format!("surface     {closed}"),
        format!("pieces      {}", grouped(measures.components)),
        format!("triangles   {}", grouped(measures.triangles)),
        format!("vertices    {}", grouped(measures.vertices)),
        format!("volume      {}", number(measures.volume)),
        format!("area        {}", number(measures.area)),
    ];
    if let Some(Hausdorff { mean, max }) = hausdorff {
        lines.push(format!("points off  {} in the mean, {} at most", number(mean), number(max)));
    }
    lines.join("\n") + "\n"
}

fn note(text: &str) {
    // Nobody is left to tell when stderr is closed.
    let _ = writeln!(std::io::stderr(), "note: {text}");
}
