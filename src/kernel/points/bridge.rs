//! Bridges over holes: the surface that two stretches of rim on opposite sides of a hole lead to, as points (docs/algorithms.md, "Holes").
//!
//! Two places of a rim go together where the surface leads from each towards the other, along its tangent plane. Between them it is taken to be a
//! cubic curve with both tangents. Many curves cross: points beside each other are thinned out.

use glam::DVec3;
use rstar::RTree;
use rstar::primitives::GeomWithData;

use super::surfel::Surfel;
use crate::kernel::topology::union_find::Forest;

/// A place at the rim of a hole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rim {
    /// The point and its normal.
    pub surfel: Surfel,
    /// Along the surface, to where it has no points; unit length.
    pub beyond: DVec3,
}

/// Two places are so many spacings of the points apart at least, and at most.
const SHORTEST: f64 = 4.0;
const LONGEST: f64 = 60.0;
/// Places of a rim are one stretch where they are so many spacings from the next at most.
const STRETCH: f64 = 3.5;

/// How two places go together.
struct Limits {
    /// Spacings between them for each place of either stretch, at most.
    longer: f64,
    /// The cosine of the angle between the way to the other side and that away from the points, at least.
    ahead: f64,
    /// The sine of the angle between the way and the tangent plane, at most.
    along: f64,
}

/// Of one stretch, across its hole, which is about a third as wide as its rim is long.
const WITHIN: Limits = Limits { longer: 1.5, ahead: 0.6, along: 0.65 };
/// Of two, which may be those of two bodies: a part goes on over three of its widths, straight on, and does not close in.
const BETWEEN: Limits = Limits { longer: 1.0, ahead: 0.9, along: 0.35 };
/// The way back from the other side ends this part of the distance from where it began, at most, and two spacings.
const RETURNS: f64 = 0.5;
/// Points between are so many spacings from each other at least.
const APART: f64 = 0.8;

type Numbered = GeomWithData<[f64; 3], u32>;

/// The places of rims, to be looked up.
pub struct Rims<'a> {
    all: &'a [Rim],
    /// The stretch of rim that each is one of, by its first place, and how many places that has.
    stretches: Vec<(u32, u32)>,
    tree: RTree<Numbered>,
    /// The spacing of the points.
    step: f64,
}

impl<'a> Rims<'a> {
    /// Of points so far apart.
    #[must_use]
    pub fn new(rims: &'a [Rim], step: f64) -> Self {
        let numbered = |(rim, n): (&Rim, u32)| GeomWithData::new(rim.surfel.place.to_array(), n);
        let tree = RTree::bulk_load(rims.iter().zip(0..).map(numbered).collect::<Vec<Numbered>>());
        let mut forest = Forest::of_singles(rims.len());
        for (rim, n) in rims.iter().zip(0..) {
            for beside in tree.locate_within_distance(rim.surfel.place.to_array(), (STRETCH * step).powi(2)) {
                forest.join(n, beside.data);
            }
        }
        let roots = forest.roots();
        let mut sizes = vec![0_u32; rims.len()];
        for &root in &roots {
            sizes[root as usize] += 1;
        }
        let stretches = roots.into_iter().map(|root| (root, sizes[root as usize])).collect();
        Self { all: rims, stretches, tree, step }
    }

    /// The place on the other side of a hole that one leads to best, if there is such a one.
    #[must_use]
    pub fn opposite(&self, rim: usize) -> Option<u32> {
        let (from, (stretch, places)) = (&self.all[rim], self.stretches[rim]);
        let longest = |places: u32, most: f64| (most * f64::from(places)).min(LONGEST) * self.step;
        let near =
            self.tree.locate_within_distance(from.surfel.place.to_array(), longest(places, WITHIN.longer).powi(2));
        near.filter_map(|other| {
            let n = other.data as usize;
            let limits = if self.stretches[n].0 == stretch { &WITHIN } else { &BETWEEN };
            let most = longest(places.min(self.stretches[n].1), limits.longer);
            Some((cost(from, &self.all[n], limits, [SHORTEST * self.step, most])?, other.data))
        })
        .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
        .map(|(_, other)| other)
    }

    /// The points from one place on to the one opposite, where that leads back to about where it began; `is_free` tells whether no point of the
    /// cloud is beside a place.
    #[must_use]
    pub fn bridge(&self, rim: usize, opposite: &[Option<u32>], is_free: impl Fn(DVec3) -> bool) -> Option<Vec<DVec3>> {
        let (from, other) = (&self.all[rim], opposite[rim]? as usize);
        let (to, back) = (&self.all[other], &self.all[opposite[other]? as usize]);
        let [at, there, back] = [from, to, back].map(|rim| rim.surfel.place);
        if back.distance(at) > RETURNS * there.distance(at) + 2.0 * self.step {
            return None;
        }
        Some(curve(from, to, self.step)).filter(|curve| curve.iter().all(|&place| is_free(place)))
    }
}

/// How far two places are apart, more where they lead past each other; none where they do not go together.
fn cost(from: &Rim, to: &Rim, limits: &Limits, [least, most]: [f64; 2]) -> Option<f64> {
    let way = to.surfel.place - from.surfel.place;
    let length = way.length();
    let way = way / length;
    let (ahead, behind) = (from.beyond.dot(way), -to.beyond.dot(way));
    let is_along = |rim: &Rim| rim.surfel.normal.dot(way).abs() <= limits.along;
    let goes = (least..=most).contains(&length)
        && ahead >= limits.ahead
        && behind >= limits.ahead
        && is_along(from)
        && is_along(to);
    (goes && from.surfel.normal.dot(to.surfel.normal) > 0.0).then(|| length / (ahead * behind))
}

/// The points between two places, on the cubic curve that has both tangents, a spacing from each other.
fn curve(from: &Rim, to: &Rim, step: f64) -> Vec<DVec3> {
    let (a, b) = (from.surfel, to.surfel);
    let way = b.place - a.place;
    let length = way.length();
    let tangent = |surfel: &Surfel| surfel.normal.cross(way).cross(surfel.normal).normalize_or_zero() * length;
    let (ta, tb) = (tangent(&a), tangent(&b));
    let parts = (length / step).round().max(2.0) as usize;
    let point = |n: usize| {
        let t = n as f64 / parts as f64;
        let (t2, t3) = (t * t, t * t * t);
        a.place * (2.0 * t3 - 3.0 * t2 + 1.0)
            + ta * (t3 - 2.0 * t2 + t)
            + b.place * (3.0 * t2 - 2.0 * t3)
            + tb * (t3 - t2)
    };
    (1..parts).map(point).collect()
}

/// Of points beside each other the first.
#[must_use]
pub fn thinned(points: &[DVec3], step: f64) -> Vec<DVec3> {
    let mut kept: RTree<[f64; 3]> = RTree::new();
    let mut is_new = |at: &&DVec3| {
        let at = at.to_array();
        let is_new = kept.locate_within_distance(at, (APART * step).powi(2)).next().is_none();
        if is_new {
            kept.insert(at);
        }
        is_new
    };
    points.iter().filter(&mut is_new).copied().collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    const RADIUS: f64 = 8.0;

    /// The rim of a tube around z at a height, its points one apart, that ends there to one side.
    fn end_of_tube(height: f64, beyond: DVec3) -> Vec<Rim> {
        let angle = |n: usize| n as f64 * TAU / 50.0;
        let normal = |n: usize| DVec3::new(angle(n).cos(), angle(n).sin(), 0.0);
        let place = |n: usize| normal(n) * RADIUS + DVec3::Z * height;
        (0..50).map(|n| Rim { surfel: Surfel { place: place(n), normal: normal(n) }, beyond }).collect()
    }

    fn bridged(rims: &[Rim], is_free: impl Fn(DVec3) -> bool) -> Vec<DVec3> {
        let known = Rims::new(rims, 1.0);
        let opposite: Vec<Option<u32>> = (0..rims.len()).map(|rim| known.opposite(rim)).collect();
        (0..rims.len()).filter_map(|rim| known.bridge(rim, &opposite, &is_free)).flatten().collect()
    }

    #[test]
    fn two_ends_of_a_tube_have_the_tube_between_them() {
        let rims = [end_of_tube(0.0, DVec3::Z), end_of_tube(20.0, -DVec3::Z)].concat();
        let found = bridged(&rims, |_| true);
        assert_eq!(found.len(), 100 * 19);
        assert!(found.iter().all(|at| (at.truncate().length() - RADIUS).abs() < 1e-9 && (0.9..19.1).contains(&at.z)));
        // From both sides the same.
        assert!((found.len() / 2..=found.len() / 2 + 50).contains(&thinned(&found, 1.0).len()));
        // Not through other points.
        assert!(bridged(&rims, |at| at.z < 10.0 || at.x < 0.0).len() < 60 * 19);
    }

    #[test]
    fn a_hole_in_a_ball_is_bridged_as_the_ball_is() {
        let (radius, angle) = (30.0_f64, 0.4_f64);
        let rim = |n: usize| {
            let around = n as f64 * TAU / 74.0;
            let out = DVec3::new(around.cos(), around.sin(), 0.0);
            let normal = out * angle.sin() + DVec3::Z * angle.cos();
            Rim {
                surfel: Surfel { place: normal * radius, normal },
                beyond: DVec3::Z * angle.sin() - out * angle.cos(),
            }
        };
        let found = bridged(&(0..74).map(rim).collect::<Vec<_>>(), |_| true);
        assert!(found.len() > 74 * 20);
        // A flat cap would be 2.4 off.
        assert!(found.iter().all(|at| (at.length() - radius).abs() < 0.1), "{found:?}");
    }

    /// Places that only look like a rim, as some of uneven points do.
    #[test]
    fn a_few_places_have_no_bridge() {
        let end = |height: f64, beyond: DVec3| end_of_tube(height, beyond).into_iter().step_by(5).take(4).collect();
        let few: [Vec<Rim>; 2] = [end(0.0, DVec3::Z), end(20.0, -DVec3::Z)];
        assert!(bridged(&few.concat(), |_| true).is_empty());
    }

    /// Two balls that look at each other through their holes close in; so do tubes beside each other's axis.
    #[test]
    fn rims_of_two_bodies_stay_apart() {
        let ball = |side: f64| {
            (0..60).map(move |n| {
                let around = f64::from(n) * TAU / 60.0;
                let out = DVec3::new(around.cos(), around.sin(), 0.0);
                let normal = out * 0.8 + DVec3::Z * (0.6 * side);
                let place = normal * 12.0 - DVec3::Z * (20.0 * side);
                Rim { surfel: Surfel { place, normal }, beyond: DVec3::Z * (0.8 * side) - out * 0.6 }
            })
        };
        assert!(bridged(&ball(1.0).chain(ball(-1.0)).collect::<Vec<_>>(), |_| true).is_empty());
        let mut shifted = end_of_tube(10.0, -DVec3::Z);
        for rim in &mut shifted {
            rim.surfel.place.x += 2.0 * RADIUS;
        }
        assert!(bridged(&[end_of_tube(0.0, DVec3::Z), shifted].concat(), |_| true).is_empty());
    }

    #[test]
    fn an_open_end_leads_nowhere() {
        assert!(bridged(&end_of_tube(0.0, DVec3::Z), |_| true).is_empty());
        // Tubes beside each other.
        let beside = end_of_tube(0.0, DVec3::Z).into_iter().map(|mut rim| {
            rim.surfel.place.x += 20.0;
            rim
        });
        assert!(
            bridged(&end_of_tube(0.0, DVec3::Z).into_iter().chain(beside).collect::<Vec<_>>(), |_| true).is_empty()
        );
    }
}
