//! The image that labels are written to: its type, and the colours of its labels.

use crate::error::Result;
use crate::grid::Geometry;
use crate::io::ome_zarr::{ImageWriter, LabelColor, LabelSpec, StoreWriter};
use crate::kernel::image::picture::palette::label_color;
use crate::store::{Element, ElementType};

/// The smallest type that holds labels up to one.
pub(super) fn type_for(highest: u32) -> ElementType {
    match highest {
        0..=0xff => ElementType::U8,
        0x100..=0xffff => ElementType::U16,
        _ => ElementType::U32,
    }
}

/// Begins the image of some labels.
pub(super) fn begin_image<T: Element>(
    store: &StoreWriter,
    geometry: &Geometry,
    labels: impl Iterator<Item = u32>,
) -> Result<ImageWriter> {
    let color = |label| {
        let [red, green, blue] = label_color(label);
        LabelColor { label, rgba: [red, green, blue, 255] }
    };
    let colors: Vec<LabelColor> = labels.map(color).collect();
    store.labels(&LabelSpec { name: "segmentation", geometry, element: T::TYPE, colors: &colors })
}
