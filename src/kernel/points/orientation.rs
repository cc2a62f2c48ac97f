//! Which way the normals of a cloud point: along a tree of least differences between neighbours (Hoppe et al., "Surface
//! reconstruction from unorganized points", 1992; docs/algorithms.md, "Holes").

use glam::DVec3;

use crate::kernel::topology::union_find::Forest;

/// Two points that are neighbours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// The points, by number.
    pub ends: [u32; 2],
    /// How unlike one smooth surface through both they are, from 0 on.
    pub unlike: f64,
}

impl Link {
    /// Between two points with normals of either sign. Normals across each other, and places along a normal from each other, as
    /// those of the two sides of a thin part, are not of one smooth surface.
    #[must_use]
    pub fn between(ends: [u32; 2], places: [DVec3; 2], normals: [DVec3; 2]) -> Self {
        let away = places[1] - places[0];
        let length = away.length();
        let along = if length > 0.0 { normals.iter().map(|n| n.dot(away).abs()).sum::<f64>() / length } else { 0.0 };
        Self { ends, unlike: 1.0 - normals[0].dot(normals[1]).abs() + 0.5 * along }
    }
}

/// A part that bulges by less than this of its extent is flat.
const FLAT: f64 = 1e-9;

/// Turns normals so that neighbours agree, along the links that are least unlike; of each connected part they look away from its
/// middle, all together, as those of a closed body do, or of a bowl. Of a flat one the highest point looks up.
pub fn orient(places: &[DVec3], normals: &mut [DVec3], mut links: Vec<Link>) {
    links.sort_unstable_by(|a, b| a.unlike.total_cmp(&b.unlike).then(a.ends.cmp(&b.ends)));
    let mut forest = Forest::of_singles(places.len());
    links.retain(|link| forest.join(link.ends[0], link.ends[1]));
    let mut beside: Vec<Vec<u32>> = vec![Vec::new(); places.len()];
    for [a, b] in links.iter().map(|link| link.ends) {
        beside[a as usize].push(b);
        beside[b as usize].push(a);
    }
    let mut highest: Vec<u32> = (0..places.len() as u32).collect();
    highest.sort_by(|&a, &b| places[b as usize].z.total_cmp(&places[a as usize].z).then(a.cmp(&b)));
    let mut is_known = vec![false; places.len()];
    let mut stack = Vec::new();
    for first in highest {
        if std::mem::replace(&mut is_known[first as usize], true) {
            continue;
        }
        if normals[first as usize].z < 0.0 {
            normals[first as usize] = -normals[first as usize];
        }
        stack.push(first);
        let mut part = Vec::new();
        while let Some(at) = stack.pop() {
            let normal = normals[at as usize];
            part.push(at as usize);
            for &next in &beside[at as usize] {
                if !std::mem::replace(&mut is_known[next as usize], true) {
                    if normals[next as usize].dot(normal) < 0.0 {
                        normals[next as usize] = -normals[next as usize];
                    }
                    stack.push(next);
                }
            }
        }
        if looks_in(places, normals, &part) {
            for n in part {
                normals[n] = -normals[n];
            }
        }
    }
}

/// Whether the normals of some points look towards the middle of these, all together.
fn looks_in(places: &[DVec3], normals: &[DVec3], part: &[usize]) -> bool {
    let middle = part.iter().map(|&n| places[n]).sum::<DVec3>() / part.len() as f64;
    let [out, extent] = part.iter().fold([0.0; 2], |[out, extent], &n| {
        let away = places[n] - middle;
        [out + away.dot(normals[n]), extent + away.length()]
    });
    out < -FLAT * extent
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bowl that is open above: its normals look down, wherever it is highest.
    #[test]
    fn a_bowl_looks_out() {
        let place = |n: u32| {
            let (r, turn) = ((f64::from(n) / 400.0).sqrt() * 0.95, 2.399_963 * f64::from(n));
            DVec3::new(r * libm::cos(turn), r * libm::sin(turn), 9.0 - (1.0 - r * r).sqrt())
        };
        let places: Vec<DVec3> = (0..400).map(place).collect();
        let out = |n: u32| places[n as usize] - DVec3::Z * 9.0;
        let mut normals: Vec<DVec3> = (0..400).map(|n| if n % 5 < 3 { out(n) } else { -out(n) }).collect();
        let pairs = (0..400).flat_map(|a| (0..a).map(move |b| [a, b]));
        let near = pairs.filter(|[a, b]| places[*a as usize].distance(places[*b as usize]) < 0.25);
        let link =
            |ends: [u32; 2]| Link::between(ends, ends.map(|n| places[n as usize]), ends.map(|n| normals[n as usize]));
        let links: Vec<Link> = near.map(link).collect();
        orient(&places, &mut normals, links);
        assert!((0..400).all(|n| normals[n as usize].dot(out(n)) > 0.9));
    }

    /// Two balls, the normals of either sign: all look out.
    #[test]
    fn balls_look_out() {
        let place = |n: u32, middle: DVec3| {
            let z = 1.0 - (2.0 * f64::from(n % 300) + 1.0) / 300.0;
            let (r, turn) = ((1.0 - z * z).sqrt(), 2.399_963 * f64::from(n));
            middle + DVec3::new(r * libm::cos(turn), r * libm::sin(turn), z)
        };
        let middle = |n: u32| if n < 300 { DVec3::ZERO } else { DVec3::new(0.0, 3.0, 0.5) };
        let places: Vec<DVec3> = (0..600).map(|n| place(n, middle(n))).collect();
        let out = |n: u32| places[n as usize] - middle(n);
        let mut normals: Vec<DVec3> = (0..600).map(|n| if n % 7 < 3 { out(n) } else { -out(n) }).collect();
        let pairs = || (0..600).flat_map(|a| (0..a).map(move |b| [a, b]));
        let near = |[a, b]: &[u32; 2]| places[*a as usize].distance(places[*b as usize]) < 0.4;
        let link =
            |ends: [u32; 2]| Link::between(ends, ends.map(|n| places[n as usize]), ends.map(|n| normals[n as usize]));
        let links: Vec<Link> = pairs().filter(near).map(link).collect();
        orient(&places, &mut normals, links);
        assert!((0..600).all(|n| normals[n as usize].dot(out(n)) > 0.9));
    }
}
