//! The surfaces between three clouds, and a mesh that is counted as it is drawn instead of being kept.
#![allow(clippy::disallowed_methods, reason = "no bits are compared here")]

use strandline::{MeshSink, MiddleSurface, Result};

/// Triangles of each pair of labels.
#[derive(Default)]
struct Counted(std::collections::BTreeMap<[u32; 2], u64>);

impl MeshSink for Counted {
    fn vertex(&mut self, _position: [f64; 3]) -> Result<()> {
        Ok(())
    }

    fn triangle(&mut self, corners: [u32; 3]) -> Result<()> {
        self.facet(corners, [0, 0])
    }

    fn facet(&mut self, _corners: [u32; 3], labels: [u32; 2]) -> Result<()> {
        *self.0.entry(labels).or_default() += 1;
        Ok(())
    }
}

fn main() -> Result<()> {
    let ring =
        |z: f64| -> Vec<[f64; 3]> { (0..60).map(|n| f64::from(n) * 0.104_72).map(|a| [a.cos(), a.sin(), z]).collect() };
    let (low, high, middle) = (ring(-0.5), ring(0.5), [[0.0, 0.0, 0.0]]);

    let mut counted = Counted::default();
    let job = MiddleSurface::new().points(low).points(high).points(&middle).spacing([0.05; 3]);
    let found = job.solve_into(&mut counted)?;
    for pair in &found.pairs {
        let [a, b] = pair.labels;
        println!("between {a} and {b}: area {:.3}, {} triangles", pair.area, counted.0[&pair.labels]);
    }
    println!("voxels of each: {:?}", found.distance.found().label_voxels);
    Ok(())
}
