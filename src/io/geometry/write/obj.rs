//! OBJ (Wavefront, 1992), text: `v x y z`, then `f a b c`, counted from 1. Numbers are the shortest that read back as
//! the same f32, or f64 where the mesh has these. Vertices are written as they come, triangles wait for the last of them.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use super::body::{BUFFER, Body, Form};
use super::spool::Spool;

struct Obj {
    file: BufWriter<File>,
    triangles: Spool,
    is_double: bool,
}

pub(super) fn start(file: File, folder: &Path, form: &Form) -> io::Result<Box<dyn Body>> {
    let (file, triangles) = (BufWriter::with_capacity(BUFFER, file), Spool::new(folder, false)?);
    Ok(Box::new(Obj { file, triangles, is_double: form.is_double }))
}

impl Body for Obj {
    fn vertex(&mut self, position: [f64; 3]) -> io::Result<()> {
        if self.is_double {
            let [x, y, z] = position;
            return writeln!(self.file, "v {x} {y} {z}");
        }
        let [x, y, z] = position.map(|v| v as f32);
        writeln!(self.file, "v {x} {y} {z}")
    }

    fn facet(&mut self, corners: [u32; 3], labels: [u32; 2]) -> io::Result<()> {
        self.triangles.push(corners, labels)
    }

    fn complete(mut self: Box<Self>) -> io::Result<()> {
        let file = &mut self.file;
        self.triangles.finish()?.each(|corners, _| {
            let [a, b, c] = corners.map(|corner| u64::from(corner) + 1);
            writeln!(file, "f {a} {b} {c}")
        })?;
        file.flush()
    }
}
