//! `LocalFit`: the surface around a point of a clean cloud, and where a place near several such points lies to all of them: a blend of
//! their fits, weighed by distance (implicit moving least squares; Shen, O'Brien and Shewchuk, "Interpolating and approximating implicit
//! surfaces from polygon soup", 2004; Kolluri, "Provably good moving least squares", 2008), in which a fit that lies off the place counts
//! little, so that edges and other sheets stay apart (after Öztireli, Guennebaud and Gross, "Feature preserving point set surfaces based
//! on non-linear kernel regression", 2009; docs/algorithms.md, "Vertices on the points' surface").

use glam::DVec3;

use super::height_field::{COEFFICIENTS, HeightField};
use crate::kernel::geometry::vector::unit;

/// Fits that follow each other; each begins with what the one before has found.
const FITS: usize = 3;
/// The weight of a neighbour falls to 1/e^2 at the distance of the farthest one.
const FALL: f64 = 2.0;
/// Neighbours so far off the first plane, and then so far off the fitted surface, count 0.6: parts of the distance of the farthest.
const FIRST_OFF: f64 = 0.16;
const OFF: f64 = 0.05;

/// A fit counts at places within this part of that distance, and less the farther they are off it, up to this part.
const REACH: f64 = 1.0;
const FARTHEST_OFF: f64 = 0.28;

/// With this sum of weights half of the way is gone: a place with few points near stays about where it is.
const HALF_WEIGHT: f64 = 0.02;

/// A point of the cloud, and which way is out there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Looking {
    /// Its place.
    pub at: DVec3,
    /// A unit vector; 0 where it is not known.
    pub outward: DVec3,
}

/// The surface around a point, as a height over a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalFit {
    at: DVec3,
    normal: DVec3,
    /// Of 1, a, b, a^2, a b, b^2; a and b along the plane, all lengths as they are.
    terms: [f64; COEFFICIENTS],
    /// Beyond this from its point it says nothing.
    reach: f64,
}

/// Where a place lies to a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Above {
    /// Distance to first order, positive outside.
    pub distance: f64,
    /// The outward normal of the surface below the place, a unit vector.
    pub normal: DVec3,
}

impl LocalFit {
    /// Fitted to the surface around a point, of its neighbours, the farthest last. Those that look another way are of another side, and do
    /// not count. None where the others tell no surface.
    #[must_use]
    pub fn around(first: Looking, neighbours: &[Looking]) -> Option<Self> {
        let last = neighbours.last()?;
        let radius = last.at.distance(first.at);
        if radius <= 0.0 || first.outward == DVec3::ZERO {
            return None;
        }
        let (at, mut normal) = (first.at, first.outward);
        let points: Vec<DVec3> = neighbours.iter().map(|q| q.at).collect();
        let near = |q: &Looking| {
            let facing = q.outward.dot(normal).clamp(0.0, 1.0);
            facing * facing * libm::exp(-FALL * q.at.distance_squared(at) / (radius * radius))
        };
        let near: Vec<f64> = neighbours.iter().map(near).collect();
        let fall = |off: f64| libm::exp(-0.5 * off * off);
        let mut weights: Vec<f64> = near
            .iter()
            .zip(&points)
            .map(|(near, q)| near * fall((*q - at).dot(normal) / (FIRST_OFF * radius)))
            .collect();
        let mut fitted = HeightField::fitted(&points, &weights, (at, normal), radius)?;
        for _ in 1..FITS {
            normal = fitted.normal;
            let off = near.iter().zip(&fitted.residuals);
            weights.iter_mut().zip(off).for_each(|(w, (near, off))| *w = near * fall(off / (OFF * radius)));
            fitted = HeightField::fitted(&points, &weights, (at, normal), radius)?;
        }
        let degrees = [0, 1, 1, 2, 2, 2];
        let terms = std::array::from_fn(|n| fitted.coefficients[n] / radius.powi(degrees[n]));
        Some(Self { at, normal, terms, reach: REACH * radius })
    }

    /// The point around which it was fitted.
    #[must_use]
    pub fn at(&self) -> DVec3 {
        self.at
    }

    /// Makes it say nothing beyond this.
    pub fn reach_no_farther_than(&mut self, most: f64) {
        self.reach = self.reach.min(most);
    }

    /// Beyond this from its point it says nothing.
    #[must_use]
    pub fn reach(&self) -> f64 {
        self.reach
    }

    /// Where a place lies to it.
    #[must_use]
    pub fn above(&self, place: DVec3) -> Above {
        let (u, v) = self.normal.any_orthonormal_pair();
        let away = place - self.at;
        let (a, b) = (away.dot(u), away.dot(v));
        let [c, ca, cb, caa, cab, cbb] = self.terms;
        let height = c + ca * a + cb * b + caa * a * a + cab * a * b + cbb * b * b;
        let slope = u * (ca + 2.0 * caa * a + cab * b) + v * (cb + cab * a + 2.0 * cbb * b);
        let gradient = self.normal - slope;
        let length = gradient.length();
        Above { distance: (away.dot(self.normal) - height) / length, normal: gradient / length }
    }
}

/// A blend of fits at a place, gathered one by one.
#[derive(Clone, Copy, Debug)]
pub struct Blend {
    place: DVec3,
    outward: DVec3,
    weight: f64,
    distance: f64,
    normal: DVec3,
}

impl Blend {
    /// Of nothing, at a place; `outward` is the unit vector that leads out there, about.
    #[must_use]
    pub fn at(place: DVec3, outward: DVec3) -> Self {
        Self { place, outward, weight: 0.0, distance: 0.0, normal: DVec3::ZERO }
    }

    /// Adds a fit.
    #[inline]
    pub fn add(&mut self, fit: &LocalFit) {
        let near = 1.0 - self.place.distance_squared(fit.at) / (fit.reach * fit.reach);
        if near <= 0.0 {
            return;
        }
        let Above { distance, normal } = fit.above(self.place);
        let facing = normal.dot(self.outward);
        if facing <= 0.0 {
            return;
        }
        let off = distance / (FARTHEST_OFF * fit.reach);
        let like = (1.0 - off * off).max(0.0);
        let both = near * like;
        let weight = (both * both) * (both * both) * facing * facing;
        self.weight += weight;
        self.distance += weight * distance;
        self.normal += normal * weight;
    }

    /// From the place to the surface of all, `most` far at most.
    #[must_use]
    pub fn way(&self, most: f64) -> DVec3 {
        if self.weight <= 0.0 {
            return DVec3::ZERO;
        }
        let way = -self.distance / (self.weight + HALF_WEIGHT);
        unit(self.normal) * way.clamp(-most, most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers between -0.5 and 0.5.
    fn jitter(seed: &mut u64) -> f64 {
        *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    }

    /// A square lattice of unit edge, each point somewhere in the middle half of its cell, put into space by a function.
    fn sheet(seed: u64, place: impl Fn(f64, f64) -> Looking) -> Vec<Looking> {
        let mut seed = seed;
        let mut of = |n: i32| {
            let mut along = |v: i32| f64::from(v - 10) + 0.5 * jitter(&mut seed);
            let (a, b) = (along(n % 21), along(n / 21));
            place(a, b)
        };
        (0..441).map(&mut of).collect()
    }

    fn fits(points: &[Looking]) -> Vec<LocalFit> {
        let fit = |first: &Looking| {
            let mut near = points.to_vec();
            near.sort_by(|p, q| p.at.distance_squared(first.at).total_cmp(&q.at.distance_squared(first.at)));
            LocalFit::around(*first, &near[..18])
        };
        points.iter().filter_map(fit).collect()
    }

    fn moved(fits: &[LocalFit], place: DVec3, outward: DVec3) -> DVec3 {
        let mut blend = Blend::at(place, outward);
        for fit in fits {
            blend.add(fit);
        }
        place + blend.way(0.3)
    }

    /// Points of a ball, whose outward directions are 20 degrees off: places beside it are moved onto it, along its normals.
    #[test]
    fn places_beside_a_ball_are_moved_onto_it() {
        let radius = 12.0;
        let on = |a: f64, b: f64| DVec3::new(a, b, (radius * radius - a * a - b * b).max(0.0).sqrt());
        let off = |way: DVec3, turn: f64| (way + way.any_orthonormal_vector() * turn).normalize();
        let ball = sheet(5, |a, b| Looking { at: on(0.5 * a, 0.5 * b), outward: off(on(a, b) / radius, 0.36) });
        let fits = fits(&ball);
        assert!(fits.len() > 400, "{}", fits.len());
        for (a, b, above) in [(0.1, 0.2, 0.1), (1.3, -0.7, -0.1), (-2.2, 1.9, 0.05), (0.6, 2.5, -0.02)] {
            let foot = on(a, b);
            let found = moved(&fits, foot * ((radius + above) / radius), off(foot / radius, -0.3));
            assert!(found.distance(foot) < 0.1 * above.abs() + 0.002, "{a} {b}: {}", found.distance(foot));
        }
    }

    /// The two sides of a plate that is half as thick as its points are apart do not pull each other.
    #[test]
    fn the_sides_of_a_thin_plate_stay_apart() {
        let side = |seed: u64, z: f64| {
            sheet(seed, move |a, b| Looking { at: DVec3::new(a, b, z), outward: DVec3::Z * z.signum() })
        };
        let fits = fits(&[side(1, 0.25), side(2, -0.25)].concat());
        for (above, outward) in [(0.35, DVec3::Z), (0.15, DVec3::Z), (-0.1, -DVec3::Z), (-0.4, -DVec3::Z)] {
            let found = moved(&fits, DVec3::new(0.3, -0.6, above), outward);
            assert!((found.z - 0.25 * outward.z).abs() < 0.01, "{above}: {found}");
        }
    }

    /// Beside an edge of two planes places are moved onto the nearer one.
    #[test]
    fn an_edge_stays_sharp() {
        let roof = sheet(3, |a, b| {
            let outward = DVec3::new(a.signum(), 0.0, 1.0).normalize();
            Looking { at: DVec3::new(a, b, -a.abs()), outward }
        });
        let fits = fits(&roof);
        for a in [-1.5, -0.7, 0.4, 1.0] {
            let outward = DVec3::new(f64::signum(a), 0.0, 1.0).normalize();
            let found = moved(&fits, DVec3::new(a, 0.2, -f64::abs(a)) + outward * 0.1, outward);
            assert!((found.z + found.x.abs()).abs() < 0.03, "{a}: {found}");
        }
    }

    #[test]
    fn places_without_points_stay() {
        let plane = sheet(4, |a, b| Looking { at: DVec3::new(a, b, 0.0), outward: DVec3::Z });
        let fits = fits(&plane);
        for place in [DVec3::new(0.0, 0.0, 5.0), DVec3::new(30.0, 0.0, 0.1)] {
            assert_eq!(moved(&fits, place, DVec3::Z), place);
        }
        assert_eq!(moved(&fits, DVec3::new(0.0, 0.0, 0.2), -DVec3::Z).z, 0.2, "it is of the other side");
        assert_eq!(LocalFit::around(Looking { outward: DVec3::ZERO, ..plane[9] }, &plane[..18]), None);
        assert_eq!(LocalFit::around(plane[9], &[plane[9]; 18]), None);
    }
}
