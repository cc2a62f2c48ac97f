//! The parts of a composite ROI: segments of a path (`java.awt.geom.PathIterator`), each a kind and its points.

use super::bytes::Bytes;
use crate::error::{Error, Result};

/// Where the numbers start.
const COORDINATES: usize = 64;
/// Pieces that a curved segment is drawn by.
const PIECES: usize = 8;

/// The closed curves of a path of `count` numbers.
pub(crate) fn read(bytes: Bytes<'_>, count: usize) -> Result<Vec<Vec<[f64; 2]>>> {
    let mut reader = Numbers { bytes, count, next: 0 };
    let mut parts: Vec<Vec<[f64; 2]>> = Vec::new();
    while reader.next < reader.count {
        let kind = reader.number()?;
        if kind == 0.0 {
            let start = reader.point()?;
            parts.push(vec![start]);
            continue;
        }
        if kind == 4.0 {
            continue;
        }
        let from = parts.last().and_then(|part| part.last()).copied();
        let (Some(from), Some(part)) = (from, parts.last_mut()) else {
            return Err(Error::input("has a composite ROI that does not start at a point"));
        };
        match kind {
            1.0 => part.push(reader.point()?),
            2.0 => {
                let [a, b] = [reader.point()?, reader.point()?];
                part.extend(curve(|t| bezier(&[from, a, b], t)));
            }
            3.0 => {
                let [a, b, c] = [reader.point()?, reader.point()?, reader.point()?];
                part.extend(curve(|t| bezier(&[from, a, b, c], t)));
            }
            other => return Err(Error::input(format!("has a composite ROI with a segment of the kind {other}"))),
        }
    }
    parts.iter_mut().for_each(close);
    parts.retain(|part| part.len() > 2);
    Ok(parts)
}

/// The numbers of a path, one after the other.
struct Numbers<'a> {
    bytes: Bytes<'a>,
    count: usize,
    next: usize,
}

impl Numbers<'_> {
    fn number(&mut self) -> Result<f64> {
        let place = COORDINATES + 4 * self.next;
        self.next += 1;
        if self.next > self.count {
            return Err(Error::input("is cut off: a part of a composite ROI lacks its points"));
        }
        self.bytes.f32(place)
    }

    fn point(&mut self) -> Result<[f64; 2]> {
        Ok([self.number()?, self.number()?])
    }
}

fn curve(at: impl Fn(f64) -> [f64; 2]) -> Vec<[f64; 2]> {
    (1..=PIECES).map(|n| at(n as f64 / PIECES as f64)).collect()
}

/// A point of a Bezier curve, by de Casteljau's halving at t.
fn bezier(points: &[[f64; 2]], t: f64) -> [f64; 2] {
    let mut points = points.to_vec();
    while points.len() > 1 {
        points = points.windows(2).map(|w| [0, 1].map(|a| (1.0 - t) * w[0][a] + t * w[1][a])).collect();
    }
    points[0]
}

/// Leaves out an end that repeats the start.
fn close(part: &mut Vec<[f64; 2]>) {
    if part.len() > 1 && part.first() == part.last() {
        part.pop();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path(numbers: &[f32]) -> Result<Vec<Vec<[f64; 2]>>> {
        let mut bytes = vec![0; COORDINATES];
        bytes.extend(numbers.iter().flat_map(|v| v.to_be_bytes()));
        read(Bytes(&bytes), numbers.len())
    }

    #[test]
    fn parts_and_curves() {
        let square = [0.0, 0.0, 0.0, 1.0, 4.0, 0.0, 1.0, 4.0, 4.0, 1.0, 0.0, 4.0, 4.0];
        let arch = [0.0, 10.0, 0.0, 2.0, 12.0, 8.0, 14.0, 0.0, 1.0, 10.0, 0.0, 4.0];
        let parts = path(&[&square[..], &arch[..]].concat()).unwrap();
        assert_eq!(parts[0], [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]]);
        // The parabola's top lies half way to its control point; the end repeats the start.
        assert_eq!((parts.len(), parts[1].len(), parts[1][4]), (2, 9, [12.0, 4.0]));
        assert!(path(&square[..5]).is_err() && path(&[1.0, 0.0, 0.0]).is_err() && path(&[7.0]).is_err());
    }
}
