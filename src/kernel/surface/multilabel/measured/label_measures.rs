//! What each label measures, told from the surfaces that it has with others.

use std::collections::BTreeMap;

use super::pairs::Pair;

/// A label's surface. Lengths physical.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LabelMeasures {
    /// The label.
    pub label: u32,
    /// What its surface encloses; none where that is open, as it is where the label goes to the end of the grid.
    pub volume: Option<f64>,
    /// Of all of its surface that lies within the grid.
    pub area: f64,
    /// Of what of it touches another label.
    pub contact_area: f64,
    /// The mean of the mean curvature, positive where the label is convex; edges where three labels meet are left out.
    pub mean_curvature: f64,
    /// The mean length of chords through it, 4 V / A: of a ball four thirds of its radius, of a plate twice what it is thick. None where there
    /// is no volume.
    pub thickness: Option<f64>,
}

/// Sums of one label.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    flux: f64,
    edges: u64,
    area: f64,
    contact: f64,
    bending: f64,
}

/// The measures of all labels but 0 that have a surface, in their order.
#[must_use]
pub fn label_measures(pairs: &[Pair]) -> Vec<LabelMeasures> {
    let mut all: BTreeMap<u32, Sums> = BTreeMap::new();
    for pair in pairs {
        for (label, sign) in pair.labels.into_iter().zip([1.0, -1.0]).filter(|(label, _)| *label > 0) {
            let sums = all.entry(label).or_default();
            sums.flux += sign * pair.flux;
            sums.edges =
                if sign > 0.0 { sums.edges.wrapping_add(pair.edges) } else { sums.edges.wrapping_sub(pair.edges) };
            sums.area += pair.area;
            sums.contact += if pair.labels[0] > 0 { pair.contact_area } else { 0.0 };
            sums.bending += sign * pair.bending;
        }
    }
    let measured = |(label, sums): (u32, Sums)| {
        let volume = (sums.edges == 0).then_some(sums.flux);
        LabelMeasures {
            label,
            volume,
            area: sums.area,
            contact_area: sums.contact,
            mean_curvature: sums.bending / sums.area.max(f64::MIN_POSITIVE),
            thickness: volume.map(|volume| 4.0 * volume / sums.area.max(f64::MIN_POSITIVE)),
        }
    };
    all.into_iter().map(measured).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::surface::{Bendings, Facet, Pairs};

    #[test]
    fn a_body_between_two_others_has_its_volume() {
        // A tetrahedron of label 2, one side of which touches 1 and the others 3.
        let places = [[7.0, 0.0, 0.0], [8.0, 0.0, 0.0], [7.0, 2.0, 0.0], [7.0, 0.0, 3.0]];
        let mut pairs = Pairs::new([0.0, 9.0, 0.0]);
        // As seen from outside; to the label 1 the smaller one is the other way round.
        for (labels, corners) in [([1, 2], [0, 1, 2]), ([2, 3], [0, 1, 3]), ([2, 3], [1, 2, 3]), ([2, 3], [2, 0, 3])] {
            let corners: [u32; 3] = corners;
            let places = corners.map(|n| places[n as usize]);
            pairs.add(&Facet { labels, corners, places, distances: [0.0; 3] });
        }
        let found = label_measures(&pairs.finish(&Bendings::default()));
        assert_eq!(found.iter().map(|label| label.volume.is_some()).collect::<Vec<_>>(), [false, true, false]);
        assert!((found[1].volume.unwrap() - 1.0).abs() < 1e-12 && (found[1].area - 9.0).abs() < 1e-12);
        assert!((found[1].thickness.unwrap() - 4.0 / 9.0).abs() < 1e-12);
    }
}
