//! Where the surface of a cloud ends: at the rim along which a disc rolls that holds no points (alpha shapes; Edelsbrunner,
//! Kirkpatrick & Seidel, "On the shape of a set of points in the plane", 1983), in the tangent plane of each place
//! (docs/algorithms.md, "Open surfaces").
//!
//! Points whose surface does not lead to a place say nothing of it, as those on the other side of a step in depth do not.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::surfel::Surfel;

/// Directions in which an empty disc is looked for.
const DIRECTIONS: u32 = 32;
/// The surface leads from a point to a place that is off its tangent plane by this part of the distance at most, and this part of
/// the disc's radius more.
const STEEPEST: f64 = 0.5;
const OFF: f64 = 0.13;

/// Where a place lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Support {
    /// Within the rim.
    Within,
    /// Beyond it; the step leads back onto it.
    Beyond(DVec3),
    /// The surface of no point leads there.
    Away,
}

/// How a rim is told. Lengths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rim {
    /// Of the disc: holes that are narrower than two of it are none.
    pub radius: f64,
    /// The rim lies so far beyond the outermost points.
    pub beyond: f64,
}

impl Rim {
    /// Points so near a place lie in every disc that comes to it from their half plane.
    #[must_use]
    pub fn near(&self) -> f64 {
        (self.beyond * (2.0 * self.radius - self.beyond)).sqrt()
    }

    /// Whether a place lies within the rim for the points that are [`Rim::near`] it alone: in no half plane are none of them. Few places
    /// within the rim are not found so.
    #[must_use]
    pub fn is_surrounded(&self, at: DVec3, near: &[Surfel], normal: DVec3) -> bool {
        let (u, v) = normal.any_orthonormal_pair();
        let turn = |point: &Surfel| libm::atan2(v.dot(point.place - at), u.dot(point.place - at));
        let mut turns: Vec<f64> = near.iter().filter(|point| self.leads(point, at)).map(turn).collect();
        turns.sort_unstable_by(f64::total_cmp);
        let around = turns.first().map(|first| first + TAU);
        let next = turns.iter().copied().skip(1).chain(around);
        turns.len() > 2 && turns.iter().zip(next).all(|(here, next)| next - here < PI)
    }

    /// Where a place lies, by the points within two radii of it.
    #[must_use]
    pub fn support(&self, at: DVec3, near: &[Surfel]) -> Support {
        let away = |point: &Surfel| point.place.distance_squared(at);
        let Some(nearest) = near.iter().min_by(|a, b| away(a).total_cmp(&away(b))) else { return Support::Away };
        if away(nearest) <= self.beyond * self.beyond {
            return Support::Within;
        }
        if !self.leads(nearest, at) {
            return Support::Away;
        }
        let (u, v) = nearest.normal.any_orthonormal_pair();
        let unrolled = |point: &Surfel| {
            let (step, [x, y]) = (point.place - at, [u, v].map(|axis| axis.dot(point.place - at)));
            let scale = step.length() / (x * x + y * y).sqrt().max(f64::MIN_POSITIVE);
            [x * scale, y * scale]
        };
        let plane: Vec<[f64; 2]> = near.iter().filter(|point| self.leads(point, at)).map(unrolled).collect();
        let mut best = (f64::INFINITY, DVec3::ZERO);
        let mut covered = Vec::with_capacity(plane.len());
        for n in 0..DIRECTIONS {
            let turn = TAU * f64::from(n) / f64::from(DIRECTIONS);
            let (cosine, sine) = (libm::cos(turn), libm::sin(turn));
            let empty = self.first_empty(&plane, [cosine, sine], &mut covered);
            if empty < best.0 {
                best = (empty, u * cosine + v * sine);
            }
        }
        let back = self.radius - self.beyond - best.0;
        if back <= 0.0 { Support::Within } else { Support::Beyond(-best.1 * back) }
    }

    /// Whether the surface leads from a point to a place.
    #[must_use]
    pub fn leads(&self, from: &Surfel, to: DVec3) -> bool {
        let step = to - from.place;
        from.normal.dot(step).abs() <= STEEPEST * step.length() + OFF * self.radius
    }

    /// How far along a direction the first disc's middle lies that holds no points; `covered` is a buffer.
    fn first_empty(&self, plane: &[[f64; 2]], [cosine, sine]: [f64; 2], covered: &mut Vec<[f64; 2]>) -> f64 {
        covered.clear();
        for &[x, y] in plane {
            let (along, across) = (x * cosine + y * sine, y * cosine - x * sine);
            let squared = self.radius * self.radius - across * across;
            if squared > 0.0 && along + squared.sqrt() > 0.0 {
                covered.push([along - squared.sqrt(), along + squared.sqrt()]);
            }
        }
        covered.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
        let mut free = 0.0;
        for &[from, to] in covered.iter() {
            if from > free {
                break;
            }
            free = to.max(free);
        }
        free
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The half plane x <= 0 of a lattice, and a lattice below it.
    fn step() -> Vec<Surfel> {
        let point = |n: i32, z: f64| DVec3::new(f64::from(n % 41 - 20), f64::from(n / 41 - 20), z);
        let normal = DVec3::new(0.0, 0.0, -1.0);
        let above = (0..41 * 41).map(|n| point(n, 0.0)).filter(|p| p.x <= 0.0);
        let below = (0..41 * 41).map(|n| point(n, -5.0)).filter(|p| p.x >= 0.0);
        above.chain(below).map(|place| Surfel { place, normal }).collect()
    }

    /// What is found soon is what is found by the discs.
    #[test]
    fn surrounded_places_are_within() {
        let cloud = step();
        let mut found = 0;
        for n in 0..400 {
            let at = DVec3::new(0.17 * f64::from(n % 20) - 2.6, 0.13 * f64::from(n / 20), 0.0);
            let near: Vec<Surfel> = cloud.iter().copied().filter(|p| p.place.distance(at) < 6.0).collect();
            let nearest: Vec<Surfel> = near.iter().copied().filter(|p| p.place.distance(at) < RIM.near()).collect();
            if RIM.is_surrounded(at, &nearest, DVec3::Z) {
                assert_eq!(RIM.support(at, &near), Support::Within, "{at}");
                found += 1;
            }
        }
        assert!(found > 250, "{found}");
    }

    const RIM: Rim = Rim { radius: 3.0, beyond: 0.25 };

    fn near(at: DVec3, cloud: &[Surfel]) -> Vec<Surfel> {
        cloud.iter().copied().filter(|point| point.place.distance(at) < 6.0).collect()
    }

    #[test]
    fn a_place_beyond_the_rim_goes_back_onto_it() {
        let cloud = step();
        let support = |x: f64, y: f64, z: f64| RIM.support(DVec3::new(x, y, z), &near(DVec3::new(x, y, z), &cloud));
        for n in 0..20 {
            let y = 0.1 * f64::from(n);
            assert_eq!(support(-0.5, y, 0.0), Support::Within);
            let Support::Beyond(back) = support(0.9, y, 0.0) else { panic!("{y}") };
            // The disc dips between points by 1 - sqrt(1 - 1/36) of its radius.
            assert!((back - DVec3::new(-0.65, 0.0, 0.0)).length() < 0.2, "{y}: {back}");
            assert!((back.x + 0.65).abs() < 0.05, "{y}: {back}");
        }
    }

    #[test]
    fn walls_across_a_step_are_not_supported() {
        let cloud = step();
        for z in [-1.2, -2.0, -2.5, -3.2] {
            let at = DVec3::new(0.1, 0.3, z);
            assert_ne!(RIM.support(at, &near(at, &cloud)), Support::Within, "{z}");
        }
    }

    #[test]
    fn narrow_holes_are_none_and_wide_ones_are() {
        for (width, expected) in [(4.5, true), (9.0, false)] {
            let cloud: Vec<Surfel> = step()
                .into_iter()
                .filter(|p| p.place.z == 0.0 && (p.place - DVec3::new(-10.0, 0.0, 0.0)).length() > 0.5 * width)
                .collect();
            let at = DVec3::new(-10.0, 0.2, 0.0);
            assert_eq!(RIM.support(at, &near(at, &cloud)) == Support::Within, expected, "{width}");
        }
        assert_eq!(RIM.support(DVec3::ZERO, &[]), Support::Away);
    }
}
