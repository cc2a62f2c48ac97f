//! `Contacts`: the faces that labels have in common; sums in f64, in the order of the triangles.

use std::collections::BTreeMap;

use glam::DVec3;

use crate::grid::Geometry;

/// The faces between two labels. Lengths physical.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// The labels, the smaller first; 0 is what has none.
    pub labels: [u32; 2],
    /// Their area.
    pub area: f64,
    /// Their centre of gravity, world coordinates.
    pub centre: [f64; 3],
    /// Number of triangles.
    pub triangles: u64,
}

/// Contacts while their triangles pass.
#[derive(Clone, Debug)]
pub struct Contacts {
    /// Where positions are seen from, so that a mesh far from the origin loses no digits.
    from: DVec3,
    known: BTreeMap<[u32; 2], Contact>,
}

impl Contacts {
    /// None yet, on a grid.
    #[must_use]
    pub fn new(geometry: &Geometry) -> Self {
        Self { from: geometry.origin.into(), known: BTreeMap::new() }
    }

    /// Adds a triangle by its corners in the world.
    pub fn add(&mut self, labels: [u32; 2], corners: [[f64; 3]; 3]) {
        let new = Contact { labels, area: 0.0, centre: [0.0; 3], triangles: 0 };
        let contact = self.known.entry(labels).or_insert(new);
        let [a, b, c] = corners.map(|corner| DVec3::from(corner) - self.from);
        let area = 0.5 * (b - a).cross(c - a).length();
        contact.area += area;
        contact.triangles += 1;
        // The moment, until it is divided by the area.
        (0..3).for_each(|axis| contact.centre[axis] += area * (a[axis] + b[axis] + c[axis]) / 3.0);
    }

    /// All of them, in the order of their labels.
    #[must_use]
    pub fn finish(self) -> Vec<Contact> {
        let from = self.from;
        let centred = |contact: Contact| {
            let area = contact.area.max(f64::MIN_POSITIVE);
            Contact { centre: std::array::from_fn(|a| from[a] + contact.centre[a] / area), ..contact }
        };
        self.known.into_values().map(centred).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_are_summed_by_their_pair() {
        let geometry = Geometry { shape: [4; 3], spacing: [1.0; 3], origin: [100.0, 0.0, 0.0], unit: None };
        let mut contacts = Contacts::new(&geometry);
        contacts.add([0, 3], [[100.0, 0.0, 0.0], [103.0, 0.0, 0.0], [100.0, 3.0, 0.0]]);
        contacts.add([0, 3], [[103.0, 3.0, 0.0], [100.0, 3.0, 0.0], [103.0, 0.0, 0.0]]);
        contacts.add([0, 1], [[100.0, 0.0, 0.0], [101.0, 0.0, 0.0], [100.0, 0.0, 2.0]]);
        let [first, second] = contacts.finish()[..] else { panic!("two pairs") };
        assert_eq!((first.labels, first.area, first.triangles), ([0, 1], 1.0, 1));
        assert_eq!((second.labels, second.area, second.triangles), ([0, 3], 9.0, 2));
        assert_eq!(second.centre, [101.5, 1.5, 0.0]);
    }
}
