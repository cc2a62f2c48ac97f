//! OBJ (Wavefront, 1992), text: `v x y z`, then `f a b c`, counted from 1. Numbers are the shortest that read back as
//! the same f32, or f64 where the mesh has these.

use std::io::{self, Write};

use super::written::Written;

pub(crate) fn write(mesh: &mut Written, out: &mut dyn Write) -> io::Result<()> {
    let is_double = mesh.is_double;
    mesh.each_vertex(|position| {
        let [x, y, z] = position;
        if is_double {
            return writeln!(out, "v {x} {y} {z}");
        }
        let [x, y, z] = position.map(|v| v as f32);
        writeln!(out, "v {x} {y} {z}")
    })?;
    mesh.each_triangle(|[a, b, c]| writeln!(out, "f {} {} {}", u64::from(a) + 1, u64::from(b) + 1, u64::from(c) + 1))
}
