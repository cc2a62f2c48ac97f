//! `Faces`: polygons as a file gives them, made triangles once all vertices are known.
//!
//! While a polygon's corners come it is a fan about the first of them, in as much memory as its triangles take; fans that
//! do not cover their polygon are cut anew in the end, in place, so that triangles keep the order of the faces.

use super::ears::{Cut, SPARE_LOOKS, cut};
use crate::error::{Error, Result};
use crate::grid::MOST_SOURCES;

/// The faces of a mesh, whose corners come one by one, in any number.
#[derive(Debug)]
pub(crate) struct Faces {
    vertices: u64,
    triangles: Vec<[u32; 3]>,
    /// For each face of more than three corners the place of its first triangle, and how many it has.
    polygons: Vec<[u32; 2]>,
    /// The first and the last corner of the face that is being read, and how many there were.
    first: u32,
    last: u32,
    corners: u64,
    /// Faces of fewer than three corners, and where the first of them stands.
    short: u64,
    first_short: String,
}

impl Faces {
    /// No face yet; corners are numbers below `vertices`.
    pub(crate) fn new(vertices: u64) -> Self {
        Self {
            vertices,
            triangles: Vec::new(),
            polygons: Vec::new(),
            first: 0,
            last: 0,
            corners: 0,
            short: 0,
            first_short: String::new(),
        }
    }

    /// The next corner, a vertex number counted from 0 as read from a file.
    pub(crate) fn push(&mut self, vertex: f64) -> Result<()> {
        let is_there = vertex >= 0.0 && vertex < self.vertices as f64 && vertex.fract() == 0.0;
        // Vertex numbers are below MOST_SOURCES once the vertices are read; until then this keeps them in 32 bits.
        if !is_there || vertex > f64::from(u32::MAX) {
            return Err(Error::input(format!(
                "names vertex {vertex} of {}, counted from 0; the file is damaged",
                self.vertices
            )));
        }
        self.push_index(vertex as u32)
    }

    /// The next corner; whether the vertex exists is for the caller to tell.
    pub(crate) fn push_index(&mut self, vertex: u32) -> Result<()> {
        if self.corners == 0 {
            self.first = vertex;
        } else if self.corners > 1 {
            self.push_triangle([self.first, self.last, vertex])?;
        }
        self.last = vertex;
        self.corners += 1;
        Ok(())
    }

    fn push_triangle(&mut self, corners: [u32; 3]) -> Result<()> {
        if self.triangles.len() == MOST_SOURCES {
            return Err(Error::input(format!(
                "has more than {MOST_SOURCES} triangles, which cannot be numbered; simplify or divide the mesh"
            )));
        }
        self.triangles.push(corners);
        Ok(())
    }

    /// Ends the face, which stands at `place`. One of fewer than three corners is a line or a point, and left out.
    pub(crate) fn end(&mut self, place: impl FnOnce() -> String) {
        if self.corners < 3 {
            if self.short == 0 {
                self.first_short = place();
            }
            self.short += 1;
        } else if self.corners > 3 {
            let count = self.corners as u32 - 2;
            self.polygons.push([self.triangles.len() as u32 - count, count]);
        }
        self.corners = 0;
    }

    /// The triangles of all faces, in their order. Tells what was not as it should be.
    pub(crate) fn finish(mut self, vertices: &[[f64; 3]], notes: &mut Vec<String>) -> Vec<[u32; 3]> {
        let (mut crossed, mut first_crossed, mut spare) = (0_u64, Vec::new(), SPARE_LOOKS);
        for [start, count] in std::mem::take(&mut self.polygons) {
            let fan = &mut self.triangles[start as usize..][..count as usize];
            let names: Vec<u32> = fan[0][..2].iter().copied().chain(fan.iter().map(|triangle| triangle[2])).collect();
            let corners: Vec<[f64; 3]> = names.iter().map(|&v| vertices[v as usize]).collect();
            let found = match cut(&corners, &mut spare) {
                Cut::Fan => continue,
                Cut::Ears(found) => found,
                Cut::Crossed(found) => {
                    if crossed == 0 {
                        first_crossed.clone_from(&names);
                    }
                    crossed += 1;
                    found
                }
            };
            for (triangle, places) in fan.iter_mut().zip(found) {
                *triangle = places.map(|place| names[place as usize]);
            }
        }
        if self.short > 0 {
            notes.push(format!(
                "{} faces have fewer than three corners and are left out, the first in {}",
                self.short, self.first_short
            ));
        }
        if crossed > 0 {
            let named: Vec<String> = first_crossed.iter().take(4).map(ToString::to_string).collect();
            notes.push(format!(
                "{crossed} polygons cross themselves, so that nothing says which surface is meant; the first has {} \
                 corners, vertices {}, ... counted from 0",
                first_crossed.len(),
                named.join(", ")
            ));
        }
        self.triangles
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLACES: [[f64; 3]; 9] = [
        [0.0, 0.0, 0.0],
        [4.0, 0.0, 0.0],
        [4.0, 4.0, 0.0],
        [3.0, 1.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 4.0, 0.0],
        [5.0, 5.0, 5.0],
        [6.0, 5.0, 5.0],
        [6.0, 6.0, 5.0],
    ];

    fn read(faces: &[&[f64]]) -> Result<(Vec<[u32; 3]>, Vec<String>)> {
        let mut all = Faces::new(9);
        for (n, face) in faces.iter().enumerate() {
            face.iter().try_for_each(|&v| all.push(v))?;
            all.end(|| format!("line {n}"));
        }
        let mut notes = Vec::new();
        let triangles = all.finish(&PLACES, &mut notes);
        Ok((triangles, notes))
    }

    #[test]
    fn convex_polygons_become_fans_and_others_do_not() {
        let (triangles, notes) =
            read(&[&[6.0, 7.0, 8.0], &[0.0, 1.0, 2.0, 5.0], &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0]]).unwrap();
        assert_eq!(triangles[..3], [[6, 7, 8], [0, 1, 2], [0, 2, 5]]);
        assert_eq!((triangles.len(), notes.len()), (7, 0));
        // The notch holds nothing: no triangle joins both of its tips.
        assert!(triangles[3..].iter().all(|triangle| !(triangle.contains(&2) && triangle.contains(&5))));
    }

    #[test]
    fn faces_without_area_by_their_count_are_left_out_with_a_note() {
        let (triangles, notes) = read(&[&[0.0, 1.0, 2.0], &[0.0, 1.0], &[], &[6.0, 7.0, 8.0]]).unwrap();
        assert_eq!(triangles, [[0, 1, 2], [6, 7, 8]]);
        assert!(notes[0].contains("2 faces") && notes[0].contains("line 1"), "{notes:?}");
    }

    #[test]
    fn impossible_corners_are_refused() {
        for vertex in [-1.0, 9.0, 1.5, f64::NAN, f64::INFINITY, 1e300] {
            assert!(read(&[&[0.0, 1.0, vertex]]).unwrap_err().to_string().contains("of 9"), "{vertex}");
        }
    }
}
