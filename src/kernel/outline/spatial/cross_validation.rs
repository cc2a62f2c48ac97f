//! Leave one section out: how far its marks lie from the shape of the others tells how sure a shape is between marks.

use glam::DVec3;
use rstar::RTree;
use serde::{Deserialize, Serialize};

use super::fitted::Fitted;
use crate::kernel::outline::planar::section::Section;

/// A shape without a section is fitted to so many of those nearest to it.
const NEAREST: usize = 6;

/// It goes through so many samples, about: in the large it is the same with fewer.
const SAMPLES: usize = 200;

/// A mark of a section that was left out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct HeldOut {
    /// Where it is.
    pub mark: [f64; 3],
    /// Signed distance to the shape of the other sections, positive outside.
    pub off: f64,
    /// Distance to the nearest section that was not left out, or to its plane.
    pub away: f64,
    /// The shape's outward direction there.
    pub normal: [f64; 3],
}

/// What the sections but the n-th say of its marks; none where they tell no shape.
#[must_use]
pub fn leave_out(sections: &[&Section], n: usize, least: f64) -> Option<Vec<HeldOut>> {
    let out = sections[n];
    // Outlines of many thousand marks are near to one another in many pairs.
    let marks = RTree::bulk_load(out.marks.clone());
    let away = |other: &Section| other.marks.iter().map(|&p| nearest(&marks, p)).fold(f64::INFINITY, f64::min);
    let mut others: Vec<(f64, usize)> =
        (0..sections.len()).filter(|m| *m != n).map(|m| (away(sections[m]), m)).collect();
    others.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    others.truncate(NEAREST);
    others.sort_by_key(|(_, m)| *m);
    let others: Vec<&Section> = others.into_iter().map(|(_, m)| sections[m]).collect();
    let fitted = Fitted::new(&others, SAMPLES, least)?;
    let beside: Vec<(&Section, RTree<[f64; 3]>)> =
        others.iter().map(|&other| (other, RTree::bulk_load(other.marks.clone()))).collect();
    let held = |&mark: &[f64; 3]| {
        let (off, normal) = fitted.distance(mark);
        let away = beside.iter().map(|(other, marks)| nearest(marks, mark).min(other.plane.height(mark).abs()));
        let away = away.fold(f64::INFINITY, f64::min);
        HeldOut { mark, off, away, normal }
    };
    Some(out.marks.iter().map(held).collect())
}

fn nearest(points: &RTree<[f64; 3]>, to: [f64; 3]) -> f64 {
    points.nearest_neighbor(to).map_or(f64::INFINITY, |&p| DVec3::from(p).distance(to.into()))
}
