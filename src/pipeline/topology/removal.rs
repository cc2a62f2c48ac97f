//! Handles, tunnels and pieces of a solved surface that are no more than a few spacings wide, taken away: their voxels change sides.

use super::gather::{Gathered, gather, near_surface};
use super::needs::topology_bytes;
use super::pieces::PieceSizes;
use crate::error::Result;
use crate::exec::{Engine, Stage, Workers};
use crate::grid::{BrickId, Geometry};
use crate::kernel::level_set::initial::start::{HELD, value};
use crate::kernel::surface::Measures;
use crate::kernel::topology::blocks::{Blocks, LEN};
use crate::kernel::topology::growth::Order;
use crate::kernel::topology::simplify::{Small, Taken, simplify};
use crate::pipeline::surface::{Isosurface, extract};
use crate::store::{BrickArray, NoMesh};

/// How wide handles and tunnels may be that are taken away, in largest spacings, in the order in which they are.
const ROUNDS: [(f64, Order); 2] = [(WIDEST, Order::Distance), (WIDEST, Order::Level)];
const WIDEST: f64 = 7.0;
/// On grids that are finer along an axis than along others the sides are looked at so far along it at most.
const MOST_HALO: usize = 12;
/// Handles whose cut has no more area than that, in squares of the largest spacing, are strands or strips that are thinner than points can tell.
const THIN: f64 = 8.0;
/// A thicker handle that is cut leads around a hole by so many voxels at most, or widens within so many.
const AROUND: u32 = 24;
const ALONG: u32 = 12;
/// Pieces of no more than a ball of this radius, in largest spacings, are dropped.
const PIECE_RADIUS: f64 = 2.5;

/// So many points make a piece a body, however small it is.
const BODY_POINTS: usize = 16;

/// What was taken away, as it is told.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Removed {
    /// Handles that were cut.
    pub handles: u64,
    /// Tunnels that were filled.
    pub tunnels: u64,
    /// The widest of the cuts and fillings, a length.
    pub widest: f64,
    /// Pieces and hollows that were dropped.
    pub crumbs: u64,
}

/// Takes away what is small of the surface u = 1/2 of a cloud; `u` is changed there.
///
/// # Errors
/// When the memory is too little or the run is interrupted.
pub fn remove_small(engine: &Engine, u: &BrickArray<f32>, geometry: &Geometry, cloud: &[[f64; 3]]) -> Result<Removed> {
    let engine = &*engine.by_itself();
    let stage = engine.stage("topology", 0);
    let removed =
        if is_simple(&stage, u, geometry)? { Removed::default() } else { removed(&stage, u, geometry, cloud)? };
    stage.finish();
    Ok(removed)
}

/// True for a surface without handles and of no small pieces.
fn is_simple(stage: &Stage<'_>, u: &BrickArray<f32>, geometry: &Geometry) -> Result<bool> {
    let surface = Isosurface::of(u, geometry);
    let Measures { components, vertices, triangles, .. } = extract(stage, &surface, &mut NoMesh)?.0;
    if 2 * vertices != triangles + 4 * components {
        return Ok(false);
    }
    if components <= 1 {
        return Ok(true);
    }
    let _held = stage.hold(vertices * PieceSizes::VERTEX_BYTES)?;
    let mut sizes = PieceSizes::default();
    extract(stage, &surface, &mut sizes)?;
    // A voxel has six faces, and each vertex lies between two voxels.
    Ok(sizes.smallest() > 6 * small_voxels(geometry))
}

/// Voxels of a piece that is small.
fn small_voxels(geometry: &Geometry) -> u64 {
    let ball = 4.0 / 3.0 * std::f64::consts::PI * (PIECE_RADIUS * geometry.max_spacing()).powi(3);
    (ball / geometry.voxel_volume()) as u64
}

fn removed(stage: &Stage<'_>, u: &BrickArray<f32>, geometry: &Geometry, cloud: &[[f64; 3]]) -> Result<Removed> {
    let largest = geometry.max_spacing();
    let rounds = ROUNDS.map(|(voxels, order)| (voxels * largest, order));
    // As far as half the widest tunnel.
    let halo = geometry.spacing.map(|h| ((0.5 * (WIDEST - 1.0) * largest / h) as usize).clamp(1, MOST_HALO));
    let near = near_surface(u, geometry, halo);
    let _held = stage.hold(topology_bytes(near.len() as u64, cloud.len() as u64))?;
    let gathered = gather(stage, u, (halo, geometry.spacing), &near)?;
    let small = Small {
        rounds: rounds.to_vec(),
        thin: (THIN * largest * largest / libm::cbrt(geometry.voxel_volume()).powi(2)) as usize,
        around: AROUND,
        along: ALONG,
        voxels: small_voxels(geometry),
        points: gathered.places(u.set().grid(), geometry, cloud),
        body_points: BODY_POINTS,
    };
    let Gathered { mut blocks, bricks } = gathered;
    let taken = simplify(&mut blocks, geometry.spacing, &small, || stage.engine().check())?;
    write_sides(stage, u, &blocks, &bricks)?;
    let Taken { handles, tunnels, widest, pieces } = taken;
    Ok(Removed { handles, tunnels, widest, crumbs: pieces })
}

/// Puts voxels whose side is another one than that of u on it, beside the surface.
fn write_sides(stage: &Stage<'_>, u: &BrickArray<f32>, blocks: &Blocks, bricks: &[BrickId]) -> Result<()> {
    let changes: Vec<usize> = (0..bricks.len()).filter(|&block| !blocks.fixed[block]).collect();
    stage.run(&changes, &Workers::none(), |(), &block| {
        let states = &blocks.states[block * LEN..][..LEN];
        let Some(slot) = u.set().slot(bricks[block]) else { return Ok(()) };
        let differs = |value: f32, state: u8| (value >= 0.5) != (state >= 128);
        if u.read(slot, |u| u.iter().zip(states).any(|(&u, &state)| differs(u, state))) {
            u.write(slot, |u| {
                for (u, &state) in u.iter_mut().zip(states).filter(|(u, state)| differs(**u, **state)) {
                    *u = value(HELD | state >> 7);
                }
            });
            u.refresh_faces(slot);
        }
        Ok(())
    })?;
    Ok(())
}

#[cfg(test)]
mod tests;
