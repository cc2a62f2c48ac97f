//! The images that a distance is written as: the distance itself, the label of the nearest data set and where it borders
//! on another, the position of the nearest source.

use super::tile::Tile;
use crate::error::Result;
use crate::exec::Engine;
use crate::grid::{Box3, DataSets, Geometry};
use crate::io::ome_zarr::{Content, ImageSpec, LabelColor, LabelSpec, LevelWriter, StoreWriter};
use crate::kernel::distance::state::precision::Precision;
use crate::kernel::image::picture::palette::label_color;
use crate::pipeline::output::pyramid::{Pyramid, Reduce, held};
use crate::pipeline::output::saved::PartlyWritten;
use crate::store::{Element, ElementType};

/// What is written beside the distance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Wanted {
    /// The label of each voxel's nearest data set.
    pub(crate) labels: bool,
    /// Labels of the voxels that have a face neighbour of another one, 0 elsewhere.
    pub(crate) borders: bool,
    /// Where the nearest source is closest.
    pub(crate) closest_point: bool,
}

impl Wanted {
    /// Bytes that are held while these images are written, on so many threads.
    pub(crate) fn held<P: Element>(self, geometry: &Geometry, sets: &DataSets, threads: usize) -> u64 {
        let coordinate = if geometry.fits_single() { f32::TYPE } else { f64::TYPE };
        let labels = u64::from(self.labels) + u64::from(self.borders);
        let mut elements = vec![P::TYPE];
        elements.extend((0..labels).map(|_| label_type(sets)));
        elements.extend((0..3 * u64::from(self.closest_point)).map(|_| coordinate));
        held(geometry, &elements, threads as u64)
    }
}

/// The smallest type that holds all labels.
fn label_type(sets: &DataSets) -> ElementType {
    match sets.last_label() {
        0..=0xff => ElementType::U8,
        0x100..=0xffff => ElementType::U16,
        _ => ElementType::U32,
    }
}

/// The images of a distance on their way into a store.
pub(crate) struct Images<'a, P: Element> {
    store: &'a StoreWriter,
    geometry: &'a Geometry,
    name: &'static str,
    distance: Pyramid<P>,
    labels: Option<Box<dyn LabelImage>>,
    borders: Option<Box<dyn LabelImage>>,
    closest: Option<Closest>,
}

/// An image for each coordinate; single precision would move places that are far from zero.
enum Closest {
    Single([Pyramid<f32>; 3]),
    Double([Pyramid<f64>; 3]),
}

/// Buffers of one thread.
#[derive(Default)]
pub(crate) struct Buffers<P> {
    values: Vec<P>,
    labels: LabelBuffers,
    single: ([Vec<f32>; 3], Vec<f32>),
    double: ([Vec<f64>; 3], Vec<f64>),
}

impl<'a, P: Precision> Images<'a, P> {
    /// Begins all images that are wanted.
    pub(crate) fn new(
        engine: &Engine,
        (geometry, is_timed): (&'a Geometry, bool),
        sets: &DataSets,
        wanted: Wanted,
        store: &'a StoreWriter,
    ) -> Result<Self> {
        let name = if is_timed { "travel time" } else { "distance" };
        let image = store.image("", &distance_spec::<P>((name, geometry), None))?;
        let labels = |name, is_wanted: bool| is_wanted.then(|| label_image(engine, geometry, sets, name, store));
        let closest = wanted.closest_point.then(|| {
            Ok(if geometry.fits_single() {
                Closest::Single(coordinates(engine, geometry, store)?)
            } else {
                Closest::Double(coordinates(engine, geometry, store)?)
            })
        });
        Ok(Self {
            store,
            geometry,
            name,
            distance: Pyramid::new(engine, image, Reduce::Mean)?,
            labels: labels("nearest", wanted.labels).transpose()?,
            borders: labels("border", wanted.borders).transpose()?,
            closest: closest.transpose()?,
        })
    }

    /// The finest level of each image.
    pub(crate) fn finest(&self) -> Vec<&LevelWriter> {
        let labels = self.labels.iter().chain(&self.borders).map(|image| image.finest());
        let closest = match &self.closest {
            None => None,
            Some(Closest::Single([x, ..])) => Some(x.finest()),
            Some(Closest::Double([x, ..])) => Some(x.finest()),
        };
        std::iter::once(self.distance.finest()).chain(labels).chain(closest).collect()
    }

    /// All of them, as checkpoints see them.
    pub(crate) fn all(&self) -> Vec<&dyn PartlyWritten> {
        let labels = self.labels.iter().chain(&self.borders).map(|image| image.partly_written());
        let closest: Vec<&dyn PartlyWritten> = match &self.closest {
            None => Vec::new(),
            Some(Closest::Single(images)) => images.iter().map(|image| image as &dyn PartlyWritten).collect(),
            Some(Closest::Double(images)) => images.iter().map(|image| image as &dyn PartlyWritten).collect(),
        };
        std::iter::once(&self.distance as &dyn PartlyWritten).chain(labels).chain(closest).collect()
    }

    /// Takes what was read of a chunk.
    pub(crate) fn put(&self, tile: &Tile<'_, P>, buffers: &mut Buffers<P>) -> Result<()> {
        self.distance.put(tile.part, tile.values, &mut buffers.values)?;
        for (image, labels) in [(&self.labels, tile.labels), (&self.borders, tile.borders)] {
            if let Some(image) = image {
                image.put(tile.part, labels, &mut buffers.labels)?;
            }
        }
        match &self.closest {
            None => Ok(()),
            Some(Closest::Single(images)) => put_coordinates(images, tile, &mut buffers.single),
            Some(Closest::Double(images)) => put_coordinates(images, tile, &mut buffers.double),
        }
    }

    /// Takes all chunks once more.
    pub(crate) fn again(&self) {
        self.distance.again();
        self.labels.iter().chain(&self.borders).for_each(|image| image.again());
        match &self.closest {
            None => {}
            Some(Closest::Single(images)) => images.iter().for_each(Pyramid::again),
            Some(Closest::Double(images)) => images.iter().for_each(Pyramid::again),
        }
    }

    /// Says which range of distances there is.
    pub(crate) fn describe(&self, range: [f64; 2]) -> Result<()> {
        self.store.describe("", &distance_spec::<P>((self.name, self.geometry), Some(range)))
    }
}

fn distance_spec<'a, P: Element>((name, geometry): (&'a str, &'a Geometry), window: Option<[f64; 2]>) -> ImageSpec<'a> {
    ImageSpec { name, geometry, element: P::TYPE, content: Content::Field, window, extremes: window }
}

fn coordinates<T: Element>(engine: &Engine, geometry: &Geometry, store: &StoreWriter) -> Result<[Pyramid<T>; 3]> {
    let image = |name: &str| {
        let group = format!("closest-point/{name}");
        let spec = ImageSpec {
            name: &group,
            geometry,
            element: T::TYPE,
            content: Content::Repeated,
            window: None,
            extremes: None,
        };
        Pyramid::new(engine, store.image(&group, &spec)?, Reduce::Mean)
    };
    Ok([image("x")?, image("y")?, image("z")?])
}

fn put_coordinates<T: Element, P>(
    images: &[Pyramid<T>; 3],
    tile: &Tile<'_, P>,
    (coordinates, buffer): &mut ([Vec<T>; 3], Vec<T>),
) -> Result<()> {
    tile.closest.of(tile.part, tile.sources, coordinates);
    images.iter().zip(coordinates).try_for_each(|(image, values)| image.put(tile.part, values, buffer))
}

/// An image of labels, whatever its type.
trait LabelImage: Send + Sync {
    fn finest(&self) -> &LevelWriter;
    fn partly_written(&self) -> &dyn PartlyWritten;
    fn put(&self, chunk: &Box3, labels: &[u32], buffers: &mut LabelBuffers) -> Result<()>;
    fn again(&self);
}

/// Labels in the types that they may be written in.
#[derive(Default)]
struct LabelBuffers {
    u8: [Vec<u8>; 2],
    u16: [Vec<u16>; 2],
    u32: [Vec<u32>; 2],
}

macro_rules! label_image {
    ($type:ty, $buffers:ident) => {
        impl LabelImage for Pyramid<$type> {
            fn finest(&self) -> &LevelWriter {
                Pyramid::finest(self)
            }

            fn partly_written(&self) -> &dyn PartlyWritten {
                self
            }

            fn put(&self, chunk: &Box3, labels: &[u32], buffers: &mut LabelBuffers) -> Result<()> {
                let [values, buffer] = &mut buffers.$buffers;
                values.clear();
                values.extend(labels.iter().map(|&label| label as $type));
                Pyramid::put(self, chunk, values, buffer)
            }

            fn again(&self) {
                Pyramid::again(self);
            }
        }
    };
}

label_image!(u8, u8);
label_image!(u16, u16);
label_image!(u32, u32);

/// Begins an image of labels, in the smallest type that holds all of them.
fn label_image(
    engine: &Engine,
    geometry: &Geometry,
    sets: &DataSets,
    name: &str,
    store: &StoreWriter,
) -> Result<Box<dyn LabelImage>> {
    let color = |label: u32| {
        let [red, green, blue] = label_color(label);
        LabelColor { label, rgba: [red, green, blue, 255] }
    };
    let colors: Vec<LabelColor> = sets.labels().iter().copied().map(color).collect();
    let element = label_type(sets);
    let image = store.labels(&LabelSpec { name, geometry, element, colors: &colors })?;
    Ok(match element {
        ElementType::U8 => Box::new(Pyramid::<u8>::new(engine, image, Reduce::Mode)?),
        ElementType::U16 => Box::new(Pyramid::<u16>::new(engine, image, Reduce::Mode)?),
        _ => Box::new(Pyramid::<u32>::new(engine, image, Reduce::Mode)?),
    })
}
