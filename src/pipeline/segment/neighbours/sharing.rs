//! The watershed: voxels of gaps, and those that objects gave back, go to the object that reaches them at the least cost
//! (`kernel::image::morphology::geodesic`). Bricks are relaxed in rounds until nothing falls; costs are whole numbers, so the end is
//! the same for any order.

use super::fields::Roots;
use super::walls::Walls;
use crate::error::Result;
use crate::exec::{Boundary, Engine, FixedPoint, HaloPlan, Reach, Stage, Workers, one_wave, relax_to_fixed_point};
use crate::grid::{Geometry, Slot};
use crate::kernel::image::morphology::gaps::SEED;
use crate::kernel::image::morphology::geodesic::{Lengths, UNREACHED, relax};
use crate::store::{BoxSource, BrickArray};
use crate::tile::HaloTile;

/// The fields of the watershed.
struct Fields {
    cost: BrickArray<u32>,
    label: BrickArray<u32>,
    weight: BrickArray<u16>,
}

/// The label that reaches each voxel; 0 for those that none reaches.
pub(super) fn share(
    stage: &Stage<'_>,
    engine: &Engine,
    geometry: &Geometry,
    roots: &Roots<'_>,
    states: &BrickArray<u8>,
    walls: &Walls<'_>,
) -> Result<BrickArray<u32>> {
    let set = states.set();
    let fields = Fields {
        cost: BrickArray::blank(engine.scratch(), set, UNREACHED)?,
        label: BrickArray::with_faces(engine.scratch(), set)?,
        weight: BrickArray::with_faces(engine.scratch(), set)?,
    };
    begin(stage, roots, states, walls, &fields)?;
    flood(stage, geometry, &fields)?;
    Ok(fields.label)
}

/// Puts the seeds in, and what each voxel costs.
fn begin(
    stage: &Stage<'_>,
    roots: &Roots<'_>,
    states: &BrickArray<u8>,
    walls: &Walls<'_>,
    fields: &Fields,
) -> Result<()> {
    let set = states.set();
    let make = || (Vec::new(), Vec::new(), Vec::new(), Walls::gaussian());
    stage.run(&one_wave(set), &Workers::new(make), |(labels, state, weights, gaussian), &slot| {
        let part = set.grid().brick_box(set.id(slot));
        roots.around(&part, [0; 3], labels)?;
        state.resize(part.len(), 0_u8);
        states.read_box(&part, state)?;
        walls.weights(&part, state, gaussian, weights)?;
        fields.weight.write_box(&part, weights);
        let is_seed = |n: usize| state[n] == SEED;
        let costs: Vec<u32> = (0..part.len()).map(|n| if is_seed(n) { 0 } else { UNREACHED }).collect();
        fields.cost.write_box(&part, &costs);
        labels.iter_mut().enumerate().filter(|(n, _)| !is_seed(*n)).for_each(|(_, label)| *label = 0);
        fields.label.write_box(&part, labels);
        fields.cost.refresh_faces(slot);
        fields.label.refresh_faces(slot);
        fields.weight.refresh_faces(slot);
        Ok(())
    })?;
    Ok(())
}

/// Relaxes bricks until nothing falls.
fn flood(stage: &Stage<'_>, geometry: &Geometry, fields: &Fields) -> Result<()> {
    let set = fields.cost.set();
    let plan = HaloPlan::new(*set.grid(), Reach::All);
    let edge = set.grid().edge() as usize;
    let workers = &Workers::new(move || (HaloTile::new(edge), HaloTile::new(edge), HaloTile::new(edge)));
    relax_to_fixed_point(
        stage,
        Reach::All,
        workers,
        &mut Flood { fields, lengths: Lengths::new(geometry.spacing), plan },
    )
}

struct Flood<'a> {
    fields: &'a Fields,
    lengths: Lengths,
    plan: HaloPlan,
}

impl FixedPoint for Flood<'_> {
    type State = u32;
    type Work = (HaloTile<u32>, HaloTile<u32>, HaloTile<u16>);

    fn field(&self) -> &BrickArray<u32> {
        &self.fields.cost
    }

    fn relax(&self, (cost, label, weight): &mut Self::Work, slot: Slot) -> Result<bool> {
        let Self { fields, plan, .. } = self;
        plan.gather(&fields.cost, slot, Boundary::Constant(UNREACHED), cost);
        plan.gather(&fields.label, slot, Boundary::Constant(0), label);
        plan.gather(&fields.weight, slot, Boundary::Constant(0), weight);
        let fell = relax([cost, label], weight, &self.lengths);
        if fell {
            plan.scatter(cost, &fields.cost, slot);
            plan.scatter(label, &fields.label, slot);
        }
        Ok(fell)
    }
}
