//! How far something has moved between two images: a template, and where in the other image it is found again.
//!
//! Normalised cross-correlation of Lewis (Vision Interface 1995, 120-123), weighted: `C(s) = sum w (T - mT) (I_s - mI) /
//! sqrt(sum w (T - mT)^2 sum w (I_s - mI)^2)`, `I_s(x) = I(x + s)`, with the weighted means mT and mI. It does not change with brightness and contrast,
//! and weights that end around an object leave its neighbours out. All whole shifts within the reach are tried on copies that are
//! averaged to few voxels; the best is carried to the finer ones, where it climbs, and a parabola along each axis makes it finer
//! than a voxel (docs/algorithms.md, "Objects over time"). Arrays over boxes, x fastest; shifts in voxels.

use crate::grid::Box3;
use crate::kernel::image::filter::downsample;

/// The coarsest copies of a template have no more voxels than this.
const FEW: u64 = 1 << 12;
/// An axis is halved while a template has so many voxels along it.
const LEAST_EDGE: i64 = 8;
/// A shift is that of the object only where the images are at least so much alike.
const LEAST_LIKENESS: f64 = 0.4;
/// So much of the weights has to lie in both images.
const LEAST_SEEN: f64 = 0.5;
/// Steps of a climb, at most.
const MOST_STEPS: usize = 16;

/// Grey values on a box.
#[derive(Clone, Debug)]
pub struct Patch {
    /// Its voxels.
    pub part: Box3,
    /// Their values.
    pub values: Vec<f32>,
}

/// Where a template was found again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// From the template to where it was found, voxels.
    pub shift: [f64; 3],
    /// How much alike the images are there, at most 1.
    pub likeness: f64,
}

/// How much voxels of a template count: all in the ellipsoid that touches the faces of a box, and nothing well outside of it. `low` and
/// `high` are the corners of the box, in voxels.
#[must_use]
pub fn ellipsoid(part: &Box3, low: [f64; 3], high: [f64; 3]) -> Vec<f32> {
    let centre: [f64; 3] = std::array::from_fn(|a| f64::midpoint(low[a], high[a]));
    let half: [f64; 3] = std::array::from_fn(|a| (0.5 * (high[a] - low[a])).max(1.0));
    let square = |a: usize, v: i64| ((v as f64 - centre[a]) / half[a]).powi(2);
    let rows = part.rows().flat_map(|(y, z)| {
        let across = square(1, y) + square(2, z);
        (part.lo[0]..part.hi[0]).map(move |x| across + square(0, x))
    });
    // One at the ellipsoid, and nothing from a third farther out on.
    rows.map(|square| (4.0 - 3.0 * square.sqrt()).clamp(0.0, 1.0) as f32).collect()
}

/// Where a template is found again: at a shift no farther along any axis than `reach` from the whole shift `guess`. None where the
/// images do not tell: where they are nowhere much alike, or most where the reach ends.
#[must_use]
pub fn find(template: &Patch, weights: &[f32], image: &Patch, guess: [i64; 3], reach: [i64; 3]) -> Option<Found> {
    let finest = Pair { template: template.clone(), weights: weights.to_vec(), image: image.clone() };
    let mut pairs = vec![(finest, [1; 3])];
    while let Some((pair, factors)) = pairs.last() {
        let halved = pair.halved_axes();
        if pair.template.part.volume() <= FEW || halved == [1; 3] {
            break;
        }
        let next = std::array::from_fn(|a| factors[a] * halved[a]);
        let coarser = pair.halved(halved);
        pairs.push((coarser, next));
    }
    let (coarsest, factors) = pairs.pop()?;
    let mut best = coarsest.best_within(guess, reach, factors)?;
    let mut before = factors;
    let mut last = coarsest;
    while let Some((pair, factors)) = pairs.pop() {
        best = pair.climb(std::array::from_fn(|a| best[a] * before[a] / factors[a]));
        (before, last) = (factors, pair);
    }
    let likeness = last.likeness(best)?;
    let inside = (0..3).all(|a| reach[a] == 0 || (best[a] - guess[a]).abs() < reach[a]);
    (inside && likeness >= LEAST_LIKENESS).then(|| Found { shift: last.refined(best, likeness), likeness })
}

/// A template and an image at one resolution.
struct Pair {
    template: Patch,
    weights: Vec<f32>,
    image: Patch,
}

impl Pair {
    /// By what each axis is halved: those that are long enough.
    fn halved_axes(&self) -> [i64; 3] {
        self.template.part.shape().map(|n| if n >= LEAST_EDGE { 2 } else { 1 })
    }

    fn halved(&self, factors: [i64; 3]) -> Self {
        let weights = Patch { part: self.template.part, values: self.weights.clone() };
        Self {
            template: halved(&self.template, factors),
            weights: halved(&weights, factors).values,
            image: halved(&self.image, factors),
        }
    }

    /// The best of all whole shifts within a reach, both given in voxels of the finest.
    fn best_within(&self, guess: [i64; 3], reach: [i64; 3], factors: [i64; 3]) -> Option<[i64; 3]> {
        let bound = |a: usize, sign: i64| (guess[a] + sign * reach[a]).div_euclid(factors[a]);
        let tried = Box3 {
            lo: std::array::from_fn(|a| bound(a, -1)),
            hi: std::array::from_fn(|a| bound(a, 1) + i64::from(factors[a] > 1) + 1),
        };
        let shifts = tried.rows().flat_map(|(y, z)| (tried.lo[0]..tried.hi[0]).map(move |x| [x, y, z]));
        let mut best: Option<([i64; 3], f64)> = None;
        for shift in shifts {
            if let Some(likeness) = self.likeness(shift)
                && best.is_none_or(|(_, most)| likeness > most)
            {
                best = Some((shift, likeness));
            }
        }
        best.map(|(shift, _)| shift)
    }

    /// Up from a shift, each time to the best of the 26 beside it, until none is better.
    fn climb(&self, from: [i64; 3]) -> [i64; 3] {
        let mut at = (from, self.likeness(from).unwrap_or(f64::NEG_INFINITY));
        for _ in 0..MOST_STEPS {
            let beside = Box3::from_shape([3; 3]).translate(at.0.map(|v| v - 1));
            let shifts = beside.rows().flat_map(|(y, z)| (beside.lo[0]..beside.hi[0]).map(move |x| [x, y, z]));
            let better = shifts.fold(at, |best, shift| match self.likeness(shift) {
                Some(likeness) if likeness > best.1 => (shift, likeness),
                _ => best,
            });
            if better.0 == at.0 {
                break;
            }
            at = better;
        }
        at.0
    }

    /// The weighted correlation at a whole shift; none where too little of the template lies in the image, or one of both is flat.
    fn likeness(&self, shift: [i64; 3]) -> Option<f64> {
        let (part, image) = (&self.template.part, &self.image);
        let shared = part.translate(shift).intersect(&image.part);
        if shared.is_empty() {
            return None;
        }
        let own = shared.translate(shift.map(|v| -v));
        let length = shared.shape()[0] as usize;
        let mut sums = Sums::default();
        for ((y, z), (own_y, own_z)) in shared.rows().zip(own.rows()) {
            let at = part.offset_of([own.lo[0], own_y, own_z]);
            let there = image.part.offset_of([shared.lo[0], y, z]);
            let (weights, before) = (&self.weights[at..at + length], &self.template.values[at..at + length]);
            for ((&w, &a), &b) in weights.iter().zip(before).zip(&image.values[there..there + length]) {
                sums.add(f64::from(w), f64::from(a), f64::from(b));
            }
        }
        let all: f64 = self.weights.iter().map(|&w| f64::from(w)).sum();
        (sums.weight >= LEAST_SEEN * all).then(|| sums.correlation()).flatten()
    }

    /// A whole shift, made finer by a parabola along each axis.
    fn refined(&self, best: [i64; 3], likeness: f64) -> [f64; 3] {
        std::array::from_fn(|a| {
            let beside = |step: i64| {
                let mut shift = best;
                shift[a] += step;
                self.likeness(shift)
            };
            let (Some(below), Some(above)) = (beside(-1), beside(1)) else { return best[a] as f64 };
            let bend = below - 2.0 * likeness + above;
            let finer = if bend < 0.0 { 0.5 * (below - above) / bend } else { 0.0 };
            best[a] as f64 + finer.clamp(-0.5, 0.5)
        })
    }
}

/// A patch by the means of blocks that begin at multiples of the factors; its ends may hold blocks that are cut.
fn halved(patch: &Patch, factors: [i64; 3]) -> Patch {
    // Whole blocks alone, so that blocks of two patches hold the same voxels.
    let part = &patch.part;
    let whole = Box3 {
        lo: std::array::from_fn(|a| (part.lo[a] + factors[a] - 1).div_euclid(factors[a]) * factors[a]),
        hi: std::array::from_fn(|a| part.hi[a].div_euclid(factors[a]) * factors[a]),
    };
    let coarse = Box3 {
        lo: std::array::from_fn(|a| whole.lo[a] / factors[a]),
        hi: std::array::from_fn(|a| whole.hi[a] / factors[a]),
    };
    if whole.is_empty() {
        return Patch { part: Box3::new(coarse.lo, coarse.lo), values: Vec::new() };
    }
    let (mut inside, mut values) = (Vec::new(), vec![0.0; coarse.len()]);
    part.cut(&patch.values, &whole, &mut inside);
    downsample::mean(&inside, whole.shape(), factors, &mut values);
    Patch { part: coarse, values }
}

/// Weighted sums of two values.
#[derive(Default)]
struct Sums {
    weight: f64,
    first: f64,
    second: f64,
    squares: [f64; 2],
    product: f64,
}

impl Sums {
    fn add(&mut self, w: f64, a: f64, b: f64) {
        self.weight += w;
        self.first += w * a;
        self.second += w * b;
        self.squares[0] += w * a * a;
        self.squares[1] += w * b * b;
        self.product += w * a * b;
    }

    fn correlation(&self) -> Option<f64> {
        let (first, second) = (self.first / self.weight, self.second / self.weight);
        let variance = |square: f64, mean: f64| square / self.weight - mean * mean;
        let [a, b] = [variance(self.squares[0], first), variance(self.squares[1], second)];
        // What is left of equal values by rounding is no contrast.
        let flat = |variance: f64, mean: f64| variance <= 1e-12 * mean * mean || variance.is_nan();
        if flat(a, first) || flat(b, second) || a <= 0.0 || b <= 0.0 {
            return None;
        }
        Some((self.product / self.weight - first * second) / (a * b).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Smooth bumps at places, on a box.
    fn bumps(part: Box3, places: &[[f64; 3]], wide: f64) -> Patch {
        let value = |v: [i64; 3]| -> f32 {
            let near = |place: &[f64; 3]| (0..3).map(|a| (v[a] as f64 - place[a]).powi(2)).sum::<f64>();
            places.iter().map(|place| 100.0 / (1.0 + libm::exp((near(place).sqrt() - wide) / 0.7))).sum::<f64>() as f32
        };
        let voxels = part.rows().flat_map(|(y, z)| (part.lo[0]..part.hi[0]).map(move |x| [x, y, z]));
        Patch { part, values: voxels.map(value).collect() }
    }

    #[test]
    fn a_body_is_found_where_it_went_and_its_neighbour_is_left_out() {
        let (from, by) = ([20.0, 22.0, 15.0], [3.3, -2.6, 1.8]);
        let to: [f64; 3] = std::array::from_fn(|a| from[a] + by[a]);
        let whole = Box3::from_shape([48, 44, 32]);
        let before = bumps(whole, &[from, [34.0, 22.0, 15.0]], 6.0);
        // The neighbour goes the other way.
        let after = bumps(whole, &[to, [37.0, 25.0, 12.0]], 6.0);
        let (low, high) = (from.map(|v| v - 8.0), from.map(|v| v + 8.0));
        let part = Box3 { lo: low.map(|v| v as i64 - 2), hi: high.map(|v| v as i64 + 3) }.intersect(&whole);
        let mut values = Vec::new();
        before.part.cut(&before.values, &part, &mut values);
        let weights = ellipsoid(&part, low, high);
        let found = find(&Patch { part, values }, &weights, &after, [0; 3], [6; 3]).unwrap();
        for a in 0..3 {
            assert!((found.shift[a] - by[a]).abs() < 0.15, "{found:?}");
        }
        assert!(found.likeness > 0.9);
    }

    #[test]
    fn what_is_not_there_is_not_found() {
        let whole = Box3::from_shape([30; 3]);
        let template = bumps(whole, &[[15.0; 3]], 5.0);
        let weights = ellipsoid(&whole, [8.0; 3], [22.0; 3]);
        let flat = Patch { part: whole, values: vec![7.0; whole.len()] };
        assert_eq!(find(&template, &weights, &flat, [0; 3], [4; 3]), None);
        // It is beyond the reach.
        let gone = bumps(whole, &[[24.0, 15.0, 15.0]], 5.0);
        assert_eq!(find(&template, &weights, &gone, [0; 3], [4; 3]), None);
        let bright = Patch { values: template.values.iter().map(|v| 3.0 * v + 50.0).collect(), ..template.clone() };
        let found = find(&template, &weights, &bright, [0; 3], [4; 3]).unwrap();
        assert!(found.shift.iter().all(|v| v.abs() < 1e-3) && found.likeness > 0.999, "{found:?}");
    }
}
