//! Positions of vertices that later triangles name: the last ones in memory, those before in a temporary file. Surfaces are drawn
//! in layers, so few triangles have a vertex from far before.

use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::temporary::Temporary;

/// So many stay in memory, and as many again until they are written: 12 bytes each.
const RECENT: usize = 1 << 17;

/// Positions by the numbers of their vertices.
pub(super) struct Places {
    folder: PathBuf,
    /// Made when it is needed.
    early: Option<Temporary>,
    /// How many lie there.
    before: usize,
    recent: Vec<[f32; 3]>,
}

impl Places {
    /// None yet; the folder is that of temporary files.
    pub(super) fn new(folder: &Path) -> Self {
        Self { folder: folder.to_path_buf(), early: None, before: 0, recent: Vec::new() }
    }

    pub(super) fn push(&mut self, position: [f32; 3]) -> io::Result<()> {
        self.recent.push(position);
        if self.recent.len() < 2 * RECENT {
            return Ok(());
        }
        let file = match &mut self.early {
            Some(file) => file,
            none => none.insert(Temporary::new(&self.folder)?),
        };
        file.seek(SeekFrom::End(0))?;
        let bytes: Vec<u8> = self.recent[..RECENT].as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect();
        file.write_all(&bytes)?;
        self.recent.drain(..RECENT);
        self.before += RECENT;
        Ok(())
    }

    /// The position of a vertex that came.
    pub(super) fn get(&mut self, vertex: u32) -> io::Result<[f32; 3]> {
        let vertex = vertex as usize;
        if let Some(position) = vertex.checked_sub(self.before).map(|at| self.recent.get(at)) {
            return position.copied().ok_or_else(|| unknown(vertex));
        }
        let Some(file) = &mut self.early else { return Err(unknown(vertex)) };
        file.seek(SeekFrom::Start(12 * vertex as u64))?;
        let mut bytes = [[0; 4]; 3];
        file.read_exact(bytes.as_flattened_mut())?;
        Ok(bytes.map(f32::from_le_bytes))
    }
}

fn unknown(vertex: usize) -> io::Error {
    io::Error::new(
        io::ErrorKind::InvalidInput,
        format!("a triangle names vertex {vertex}, which did not come before it"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_found_in_memory_and_out_of_it() {
        let folder = tempfile::tempdir().unwrap();
        let mut places = Places::new(folder.path());
        let of = |n: usize| [n as f32, -(n as f32), 0.5 + n as f32];
        for n in 0..5 * RECENT {
            places.push(of(n)).unwrap();
            if n % 1000 == 0 {
                for at in [0, n / 3, n - n / 100, n] {
                    assert_eq!(places.get(at as u32).unwrap(), of(at), "{at} of {n}");
                }
            }
        }
        assert!(places.before == 4 * RECENT && places.recent.len() <= 2 * RECENT);
        let error = places.get(5 * RECENT as u32).unwrap_err().to_string();
        assert!(error.contains("which did not come before it"), "{error}");
    }
}
