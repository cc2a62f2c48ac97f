//! A triangle mesh in another format.

use std::path::Path;

use crate::cli::args::convert::ConvertArgs;
use crate::cli::inputs::noted::read_told;
use crate::cli::print;
use crate::cli::terminal::console::Console;
use crate::cli::terminal::text::grouped;
use crate::error::{Error, Result};
use crate::exec::Progress;
use crate::grid::TriangleMesh;
use crate::io::geometry::read::source::Source;
use crate::io::geometry::read::sources::describe;
use crate::io::geometry::write::formats::{Format, MeshFile};
use crate::job::resources::Resources;
use crate::store::MeshSink;

/// Writes the mesh that the input holds.
pub(super) fn run(args: &ConvertArgs, format: &Format, resources: &Resources, console: &Console) -> Result<()> {
    let mesh = match read_told(&args.input, &|text| console.note(text))? {
        Source::Mesh(mesh) => mesh,
        Source::Cloud(_) => return Err(Error::input("holds points and no triangle; give a mesh").at(&args.input)),
    };
    if let Some([x, y, z]) = MeshFile::anchor_of(format, &mesh) {
        console.note(&format!(
            "{} holds single precision alone: coordinates are rounded to it, as seen from {x}, {y}, {z}",
            format.name
        ));
    }
    write(format, args, &mesh, &resources.scratch)?;
    if args.quiet {
        return Ok(());
    }
    let (vertices, triangles) = (grouped(mesh.vertices.len() as u64), grouped(mesh.len() as u64));
    print(&format!("{}: {}, {vertices} vertices, {triangles} triangles\n", args.output.display(), format.name))
}

fn write(format: &Format, args: &ConvertArgs, mesh: &TriangleMesh, scratch: &Path) -> Result<()> {
    let mut file = MeshFile::create_for(format, &args.output, mesh, scratch)?;
    mesh.vertices.iter().try_for_each(|&vertex| file.vertex(vertex))?;
    mesh.triangles.iter().try_for_each(|&corners| file.triangle(corners))?;
    file.complete()?.place(args.overwrite)
}

/// Whether a file holds points or a mesh.
pub(super) fn is_source(path: &Path) -> bool {
    describe(path).is_ok()
}
