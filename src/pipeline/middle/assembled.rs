//! The surfaces between labels put together of patches in the order of their boxes, also of patches that other ranks have drawn:
//! these wait on the disk until it is their rank's turn.

use crate::error::Result;
use crate::exec::{Comm, Message, pack_message, unpack_message};
use crate::grid::Geometry;
use crate::kernel::surface::{
    Bending, Bendings, Facet, Growing, Measures, Pair, Pairs, SurfaceMeasure, TaggedPatch, Welder,
};
use crate::store::{MeshSink, Spill, Spilled};

/// A patch, how wide the gap is at each of its vertices, where somebody wants to know, and how it is bent.
pub(super) type MadePatch = (TaggedPatch, Vec<f64>, Bending);

/// What the whole surface measures, and each part of it between two labels.
pub(super) type Found = (Measures, Vec<Pair>);

/// Who takes patches in their order.
pub(super) trait Takes {
    fn wants_gaps(&self) -> bool;
    fn take(&mut self, patch: &MadePatch) -> Result<()>;
    /// Bytes of what is known of the last patch, and the tables of all.
    fn holds(&self) -> (u64, Vec<Growing>);
}

/// The whole surface.
pub(super) struct Whole<'s> {
    welder: Welder,
    measure: SurfaceMeasure,
    pairs: Pairs,
    bendings: Bendings,
    sink: &'s mut dyn MeshSink,
}

impl<'s> Whole<'s> {
    pub(super) fn new(geometry: &Geometry, sink: &'s mut dyn MeshSink) -> Self {
        let (lo, hi) = (geometry.origin, geometry.position(geometry.shape));
        let middle = std::array::from_fn(|a| 0.5 * (lo[a] + hi[a]));
        let (measure, pairs) = (SurfaceMeasure::new(middle), Pairs::new(middle));
        Self { welder: Welder::new(geometry), measure, pairs, bendings: Bendings::default(), sink }
    }

    /// What was measured of all patches.
    pub(super) fn finish(self) -> Found {
        (self.measure.measures(), self.pairs.finish(&self.bendings))
    }

    /// Takes what another rank has drawn, some patches at a time: the length of each and it, packed.
    pub(super) fn take_from(&mut self, comm: &dyn Comm, rank: usize) -> Result<()> {
        loop {
            let message = comm.exchange(&[rank], vec![Vec::new()])?.concat();
            let mut patches = Message(&message);
            if patches.is_empty() {
                return Ok(());
            }
            while !patches.is_empty() {
                let length = u64::from_le_bytes(patches.word()?);
                self.take(&unpack_message(patches.take(length as usize)?)?)?;
            }
        }
    }
}

impl Takes for Whole<'_> {
    fn wants_gaps(&self) -> bool {
        self.sink.keeps_values()
    }

    fn take(&mut self, (patch, gaps, bending): &MadePatch) -> Result<()> {
        self.bendings.add(bending, patch.patch.cells.lo[2]);
        if let Some(kept) = self.welder.enter_layer(&patch.patch) {
            self.measure.forget_but(&kept);
        }
        self.welder.add_valued(&patch.patch, gaps, self.sink)?;
        for (n, (corners, places)) in self.welder.triangles_of(&patch.patch).enumerate() {
            self.measure.add(corners, places);
            let distances = patch.patch.triangles[n].map(|vertex| patch.distances[vertex as usize]);
            self.pairs.add(&Facet { labels: patch.patch.pairs[n], corners, places, distances });
        }
        Ok(())
    }

    fn holds(&self) -> (u64, Vec<Growing>) {
        (
            self.welder.bytes_of_last(),
            [self.welder.tables().as_slice(), &self.measure.tables(), &[self.bendings.table()]].concat(),
        )
    }
}

/// Patches wait on the disk until it is this rank's turn.
impl Takes for Spill {
    /// The first rank may write them.
    fn wants_gaps(&self) -> bool {
        true
    }

    fn take(&mut self, patch: &MadePatch) -> Result<()> {
        self.put(&pack_message(patch)?)
    }

    fn holds(&self) -> (u64, Vec<Growing>) {
        (0, Vec::new())
    }
}

/// Bytes of patches that travel at a time, at most, but for one patch.
const MESSAGE: usize = 4 << 20;

/// Sends patches to the first rank, some at a time, and at last none.
pub(super) fn send(comm: &dyn Comm, mut spilled: Spilled) -> Result<()> {
    let mut next = spilled.take()?;
    loop {
        let mut message = Vec::new();
        while let Some(patch) = next.take_if(|patch| message.is_empty() || message.len() + patch.len() <= MESSAGE) {
            message.extend_from_slice(&(patch.len() as u64).to_le_bytes());
            message.extend_from_slice(&patch);
            next = spilled.take()?;
        }
        let was_last = message.is_empty();
        comm.exchange(&[0], vec![message])?;
        if was_last {
            return Ok(());
        }
    }
}
