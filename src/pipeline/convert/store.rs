//! A volume on its way into a store, as the image of its root.

use super::bricks::Work;
use crate::error::Result;
use crate::exec::{Engine, Stage};
use crate::grid::Geometry;
use crate::io::ome_zarr::{Content, ImageSpec, ImageWriter, LabelColor, LabelSpec, StoreWriter};
use crate::pipeline::output::pyramid::{Reduce, write_levels};
use crate::store::{BoxSource, Element, ElementType};

/// What the voxels of an image are.
#[derive(Clone, Copy, Debug)]
pub enum Kind<'a> {
    /// Values of which there are means.
    Image {
        /// What viewers call it.
        name: &'a str,
    },
    /// Numbers of objects.
    Labels {
        /// What viewers call it.
        name: &'a str,
        /// Colours by label.
        colors: &'a [LabelColor],
    },
}

impl Kind<'_> {
    /// How several voxels become one.
    pub(super) fn reduce(&self) -> Reduce {
        match self {
            Self::Image { .. } => Reduce::Mean,
            Self::Labels { .. } => Reduce::Mode,
        }
    }

    /// Begins the image; `window` is what of its values is shown at first, and their extremes.
    pub(super) fn begin(
        &self,
        store: &StoreWriter,
        geometry: &Geometry,
        element: ElementType,
        window: Option<[[f64; 2]; 2]>,
    ) -> Result<ImageWriter> {
        match *self {
            Self::Image { name } => {
                let (window, extremes) = (window.map(|[shown, _]| shown), window.map(|[_, all]| all));
                let content = Content::Grey;
                store.image("", &ImageSpec { name, geometry, element, content, window, extremes })
            }
            Self::Labels { name, colors } => store.labels_alone(&LabelSpec { name, geometry, element, colors }),
        }
    }
}

pub(super) struct Writing<'a> {
    pub(super) stage: &'a Stage<'a>,
    pub(super) engine: &'a Engine,
    pub(super) image: ImageWriter,
    pub(super) reduce: Reduce,
}

impl Work for Writing<'_> {
    fn on<T: Element>(self, voxels: &dyn BoxSource<T>) -> Result<()> {
        write_levels::<T>(self.stage, self.engine, self.image, voxels, self.reduce)
    }
}
