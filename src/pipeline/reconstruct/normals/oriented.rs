//! A cloud with a side: a normal for each point, all turned to one side (docs/algorithms.md, "Holes").

use std::f64::consts::PI;

use glam::DVec3;
use rstar::RTree;
use rstar::primitives::GeomWithData;

use crate::error::Result;
use crate::exec::{Stage, Workers};
use crate::kernel::points::height_field::plane_normal;
use crate::kernel::points::orientation::{Link, orient};
use crate::kernel::points::surfel::Surfel;

/// Neighbours that tell a normal, and those that are linked.
const NEIGHBOURS: usize = 12;
/// Points that one thread takes at a time.
pub(in crate::pipeline::reconstruct) const AT_ONCE: usize = 256;

/// A point and its number.
pub(in crate::pipeline::reconstruct) type Numbered = GeomWithData<[f64; 3], u32>;

/// The points of a cloud in a tree.
pub(in crate::pipeline::reconstruct) fn numbered(points: &[[f64; 3]]) -> RTree<Numbered> {
    RTree::bulk_load(points.iter().zip(0..).map(|(&p, n)| GeomWithData::new(p, n)).collect())
}

/// Normals of the points, turned to one side, and what part of the surface each has.
pub(in crate::pipeline::reconstruct) struct OrientedCloud {
    pub(in crate::pipeline::reconstruct) normals: Vec<DVec3>,
    pub(in crate::pipeline::reconstruct) areas: Vec<f64>,
    /// Towards where each point has no neighbours, along the surface; unit length.
    pub(in crate::pipeline::reconstruct) beyond: Vec<DVec3>,
    /// The edge of the square that a point has of the surface, the median.
    pub(in crate::pipeline::reconstruct) apart: f64,
}

impl OrientedCloud {
    /// The points with their normals.
    pub(in crate::pipeline::reconstruct) fn surfels(&self, points: &[[f64; 3]]) -> Vec<Surfel> {
        let surfel = |(&place, &normal): (&[f64; 3], &DVec3)| Surfel { place: DVec3::from(place), normal };
        points.iter().zip(&self.normals).map(surfel).collect()
    }

    /// Fits a plane to the neighbours of each point, and turns the normals along their links.
    ///
    /// # Errors
    /// When the run is interrupted.
    pub(in crate::pipeline::reconstruct) fn new(
        stage: &Stage<'_>,
        points: &[[f64; 3]],
        tree: &RTree<Numbered>,
    ) -> Result<Self> {
        let parts: Vec<&[[f64; 3]]> = points.chunks(AT_ONCE).collect();
        let found = stage.run(&parts, &Workers::none(), |(), part| {
            let told = |p: &[f64; 3]| {
                let near: Vec<_> = tree.nearest_neighbor_iter(*p).take(NEIGHBOURS).collect();
                let places: Vec<DVec3> = near.iter().map(|n| DVec3::from(*n.geom())).collect();
                let radius = places.last().map_or(0.0, |last| last.distance(places[0]));
                let numbers: Vec<u32> = near.iter().map(|n| n.data).collect();
                let normal = plane_normal(&places, &[1.0; NEIGHBOURS][..places.len()]);
                let others = places.iter().sum::<DVec3>() / places.len() as f64 - places[0];
                let beyond = -(others - normal * others.dot(normal)).normalize_or_zero();
                (normal, radius, numbers, beyond)
            };
            Ok(part.iter().map(told).collect::<Vec<_>>())
        })?;
        let found: Vec<_> = found.into_iter().flatten().collect();
        let places: Vec<DVec3> = points.iter().map(|&p| DVec3::from(p)).collect();
        let mut normals: Vec<DVec3> = found.iter().map(|(normal, ..)| *normal).collect();
        let of = |a: u32, b: u32| {
            let ends = [a.min(b), a.max(b)];
            Link::between(ends, ends.map(|n| places[n as usize]), ends.map(|n| normals[n as usize]))
        };
        let links = (0..)
            .zip(&found)
            .flat_map(|(a, (_, _, near, _))| near.iter().filter(move |&&b| a != b).map(move |&b| (a, b)));
        let links: Vec<Link> = links.map(|(a, b)| of(a, b)).collect();
        orient(&places, &mut normals, links);
        let areas: Vec<f64> = found.iter().map(|(_, radius, ..)| PI * radius * radius / NEIGHBOURS as f64).collect();
        let mut sorted = areas.clone();
        sorted.sort_by(f64::total_cmp);
        Ok(Self {
            normals,
            areas,
            beyond: found.iter().map(|(.., beyond)| *beyond).collect(),
            apart: sorted.get(sorted.len() / 2).map_or(0.0, |area| area.sqrt()),
        })
    }
}
