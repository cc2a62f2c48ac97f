//! A volume on its way into a file that is written from the first plane to the last: threads pack its pieces, a few at a time,
//! and these are written in their order, so that the same file comes of any number of threads.

use super::PIECES_PER_THREAD;
use super::bricks::Work;
use crate::error::Result;
use crate::exec::{Stage, Workers};
use crate::grid::Box3;
use crate::io::stack::write::formats::VolumeFile;
use crate::store::{BoxSource, Element};

pub(super) struct Writing<'a> {
    pub(super) stage: &'a Stage<'a>,
    pub(super) file: &'a mut VolumeFile,
}

impl Work for Writing<'_> {
    fn on<T: Element>(self, voxels: &dyn BoxSource<T>) -> Result<()> {
        let Self { stage, file } = self;
        let (mut pieces, workers) = (file.pieces(), Workers::new(Vec::new));
        loop {
            let next: Vec<Box3> = pieces.by_ref().take(PIECES_PER_THREAD * stage.threads()).collect();
            if next.is_empty() {
                return Ok(());
            }
            let packing = &*file;
            let packed = stage.run(&next, &workers, |values, piece| {
                values.resize(piece.len(), T::default());
                voxels.read_box(piece, values)?;
                let mut bytes = Vec::with_capacity(size_of_val(values.as_slice()));
                T::append_bytes(values, &mut bytes);
                packing.pack(piece, bytes)
            })?;
            packed.into_iter().try_for_each(|piece| file.append(piece))?;
        }
    }
}
