//! Edges between voxels that surfaces cross more than once: where another label reaches across an edge, as it does at
//! creases and along the lines where three labels meet, the edge is split by a corner of that label.
//!
//! Whether it is follows from the voxels one around its two ends alone, so all cells and bricks that share the edge
//! split it alike. Candidates are the tracked sources there; that a label is nearest on the edge is then made sure of
//! by the nearest source of each label.

use super::corner::Corner;
use super::known::Known;
use super::touching::do_touch;
use crate::grid::{Box3, NEIGHBOURS_26};

/// Other labels that are kept of a voxel, the nearest.
const OTHERS: usize = 3;
/// Places on an edge that are looked at, in parts of it: the middle first.
const PLACES: [f64; 3] = [0.5, 0.25, 0.75];
/// A label that reaches less far across an edge, in parts of its length, does not split it: triangles would be slivers.
const SHALLOW: f64 = 1.0 / 32.0;
/// The same for a label between two others: the lines where three meet are off by what is left out.
const SHALLOW_THIRD: f64 = 1.0 / 128.0;
/// Halvings that find where an edge is equally far from two labels.
const HALVINGS: usize = 7;
/// How close to a voxel an edge is split, in parts of it.
const LEAST_PART: f64 = 1.0 / 16.0;

/// What is known of an edge: 0 nothing yet, 1 that it is not split, more: the place in the list of corners, plus 2.
const UNKNOWN: u32 = 0;
const WHOLE: u32 = 1;

/// The edges of one brick.
#[derive(Clone, Debug, Default)]
pub(crate) struct Splits {
    /// Voxels with another label one around.
    is_near: Vec<bool>,
    /// The nearest other labels of such voxels, each by a source; as many as there are.
    others: Vec<Option<Others>>,
    /// By 7 * (place of the lower voxel) + (axes of the step as bits) - 1.
    edges: Vec<u32>,
    corners: Vec<Corner>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Others {
    sources: [u32; OTHERS],
    count: usize,
}

impl Splits {
    /// Bytes of memory.
    pub(crate) fn bytes(&self) -> u64 {
        let of_voxels = self.is_near.capacity() + self.others.capacity() * size_of::<Option<Others>>();
        let of_edges = self.edges.capacity() * size_of::<u32>() + self.corners.capacity() * size_of::<Corner>();
        (of_voxels + of_edges) as u64
    }

    /// Forgets the last brick, and finds out where in this one different labels are near.
    pub(crate) fn enter(&mut self, known: &Known<'_>) {
        let part = known.part;
        self.is_near.clear();
        self.is_near.resize(part.len(), false);
        self.others.clear();
        self.others.resize(part.len(), None);
        self.edges.clear();
        self.edges.resize(7 * part.len(), UNKNOWN);
        self.corners.clear();
        let cells = Box3::new(part.lo, part.hi.map(|v| v - 1));
        if cells.is_empty() {
            return;
        }
        let [width, height, _] = part.shape().map(|n| n as usize);
        let corners = [0, 1, width, width + 1].map(|n| [n, n + width * height]).concat();
        for (y, z) in cells.rows() {
            let row = part.offset_of([cells.lo[0], y, z]);
            for place in row..row + width - 1 {
                if corners.iter().any(|n| known.labels[place + n] != known.labels[place]) {
                    for n in &corners {
                        self.is_near[place + n] = true;
                    }
                }
            }
        }
    }

    /// Whether a corner of a cell has another label one around.
    pub(crate) fn is_near(&self, known: &Known<'_>, cell: [i64; 3]) -> bool {
        let [width, height, _] = known.part.shape().map(|n| n as usize);
        let place = known.part.offset_of(cell);
        [0, width, width * height, width * height + width]
            .iter()
            .any(|n| self.is_near[place + n] || self.is_near[place + n + 1])
    }

    /// The corner that splits the edge from a voxel one step along some axes, given as bits; none where it is whole.
    pub(crate) fn of_edge(&mut self, known: &Known<'_>, lower: [i64; 3], step: u8) -> Option<Corner> {
        let place = 7 * known.part.offset_of(lower) + usize::from(step) - 1;
        if self.edges[place] == UNKNOWN {
            let upper = std::array::from_fn(|a| lower[a] + i64::from(step >> a & 1));
            let found = self.search(known, [lower, upper]);
            self.edges[place] = if found.is_some() { WHOLE + 1 + self.corners.len() as u32 } else { WHOLE };
            self.corners.extend(found);
        }
        (self.edges[place] > WHOLE).then(|| self.corners[(self.edges[place] - 2) as usize])
    }

    /// Looks at an edge.
    fn search(&mut self, known: &Known<'_>, ends: [[i64; 3]; 2]) -> Option<Corner> {
        let places = ends.map(|voxel| known.part.offset_of(voxel));
        let own = places.map(|place| known.labels[place]);
        // Voxels that touch meet between them, whatever their sources say.
        if do_touch(known, &ends.map(|voxel| Corner::of_voxel(known, voxel))) {
            return None;
        }
        if own.contains(&0) || !places.iter().any(|&place| self.is_near[place]) {
            return None;
        }
        let mut sources = places.map(|place| known.sources[place]).to_vec();
        for (place, voxel) in places.into_iter().zip(ends) {
            let others = self.others(known, place, voxel);
            sources.extend(&others.sources[..others.count]);
        }
        sources.sort_unstable();
        sources.dedup();
        let labels: Vec<u32> = sources.iter().map(|&source| known.shapes.label(source)).collect();
        let is_third = |label: &u32| !own.contains(label);
        if !labels.iter().any(is_third) {
            return None;
        }
        let between = Edge { known, ends, own, sources: &sources, labels: &labels };
        let found = if own[0] == own[1] { between.reached() } else { between.parted() };
        found.filter(|corner| is_nearest(known, corner, own))
    }

    /// The nearest other labels one around a voxel.
    fn others(&mut self, known: &Known<'_>, place: usize, voxel: [i64; 3]) -> Others {
        *self.others[place].get_or_insert_with(|| {
            let own = known.labels[place];
            let here = known.geometry.position(voxel);
            let mut found: Vec<(f64, u32, u32)> = Vec::new();
            for offset in NEIGHBOURS_26 {
                let beside: [i64; 3] = std::array::from_fn(|a| voxel[a] + offset[a]);
                if !known.part.contains(beside) {
                    continue;
                }
                let (label, source) = (known.label(beside), known.sources[known.part.offset_of(beside)]);
                if label == own || label == 0 || found.iter().any(|f| f.2 == source) {
                    continue;
                }
                let distance = known.shapes.distance(here, source);
                match found.iter_mut().find(|f| f.1 == label) {
                    Some(former) if (former.0, former.2) <= (distance, source) => {}
                    Some(former) => *former = (distance, label, source),
                    None => found.push((distance, label, source)),
                }
            }
            found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));
            let mut others = Others { count: found.len().min(OTHERS), ..Others::default() };
            others.sources.iter_mut().zip(&found).for_each(|(source, f)| *source = f.2);
            others
        })
    }
}

/// An edge, and the sources that may be nearest on it with their labels.
struct Edge<'a> {
    known: &'a Known<'a>,
    ends: [[i64; 3]; 2],
    own: [u32; 2],
    sources: &'a [u32],
    labels: &'a [u32],
}

impl Edge<'_> {
    fn length(&self) -> f64 {
        let [from, to] = self.ends;
        self.known.geometry.length(std::array::from_fn(|a| to[a] - from[a]))
    }

    /// The distances to the labels of both ends at a part of the way, and to the nearest other label.
    fn distances(&self, part: f64) -> ([f64; 2], (f64, u32)) {
        let here = self.known.world(Corner::between(self.ends, part, 0).place);
        let (mut own, mut third) = ([f64::INFINITY; 2], (f64::INFINITY, 0));
        for (&source, &label) in self.sources.iter().zip(self.labels) {
            let distance = self.known.shapes.distance(here, source);
            if !self.own.contains(&label) && (distance, label) < third {
                third = (distance, label);
            }
            for n in (0..2).filter(|&n| self.own[n] == label) {
                own[n] = own[n].min(distance);
            }
        }
        (own, third)
    }

    /// Where another label reaches farthest across an edge between two voxels of one label.
    fn reached(&self) -> Option<Corner> {
        let mut best: Option<(f64, Corner)> = None;
        for &part in &PLACES {
            let ([own, _], (distance, label)) = self.distances(part);
            let by = (own - distance) / self.length();
            // On the way to either end it can gain no more than the length.
            if part == PLACES[0] && by < -1.0 {
                break;
            }
            if by > SHALLOW && best.is_none_or(|(most, _)| by > most) {
                best = Some((by, Corner::between(self.ends, part, label)));
            }
        }
        best.map(|(_, corner)| corner)
    }

    /// Where a third label lies between the two of the ends: at the place that these are equally far from.
    fn parted(&self) -> Option<Corner> {
        let (mut lo, mut hi) = (0.0, 1.0);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (lo + hi);
            let ([from, to], _) = self.distances(middle);
            *(if from < to { &mut lo } else { &mut hi }) = middle;
        }
        let part = (0.5 * (lo + hi)).clamp(LEAST_PART, 1.0 - LEAST_PART);
        let (own, (distance, label)) = self.distances(part);
        let by = (own[0].min(own[1]) - distance) / self.length();
        (by > SHALLOW_THIRD).then(|| Corner::between(self.ends, part, label))
    }
}

/// Whether the label of a corner is nearer than those of the edge's ends there.
fn is_nearest(known: &Known<'_>, corner: &Corner, ends: [u32; 2]) -> bool {
    let here = known.world(corner.place);
    let distance = |label: u32| known.shapes.distance(here, known.nearest(label, corner.place));
    let its = distance(corner.label);
    ends.iter().all(|&label| its < distance(label))
}
