//! Sources as a program gives them, checked as readers of files check theirs, and gathered into data sets.

use std::borrow::Cow;

use super::volume::{PlacedLabels, check_shape};
use crate::error::{Error, Result};
use crate::exec::Cancel;
use crate::grid::{DataSets, Geometry, TriangleMesh, refuse_too_many};
use crate::kernel::geometry::solid::Solid;
use crate::pipeline::distance::seeding::label_borders::label_borders;
use crate::pipeline::distance::without_inside;
use crate::pipeline::laying::{check_grid, check_spacing};
use crate::store::BoxSource;

/// One call of a builder: what it gave.
pub(super) enum Given<'a> {
    /// Points of the next label, or of a label of their own.
    Points(Option<u32>, Cow<'a, [[f64; 3]]>),
    /// A mesh of the next label.
    Mesh(Cow<'a, TriangleMesh>),
    /// A volume of labels, on a grid.
    Volume(Box<dyn BoxSource<u32> + Send + 'a>, Geometry),
}

/// What was gathered.
#[derive(Default)]
pub(super) struct Gathered {
    pub(super) sets: DataSets,
    /// The grid of the first label volume.
    pub(super) volume: Option<Geometry>,
}

impl Gathered {
    /// Gathers what was given, in its order; with signs only meshes, turned outside out. `note` hears what was odd.
    pub(super) fn new(given: &[Given<'_>], signed: bool, cancel: &Cancel, mut note: impl FnMut(&str)) -> Result<Self> {
        let mut gathered = Self::default();
        for (n, given) in given.iter().enumerate() {
            let numbered = |error: Error| error.reworded(|text| format!("data set {} {text}", n + 1));
            gathered.add(given, signed, cancel, &mut note).map_err(numbered)?;
        }
        if gathered.sets.is_empty() {
            return Err(Error::usage("there is no source; give points, meshes or a label volume"));
        }
        refuse_too_many("sources", gathered.sets.len() as u64)?;
        Ok(gathered)
    }

    fn add(&mut self, given: &Given<'_>, signed: bool, cancel: &Cancel, note: &mut impl FnMut(&str)) -> Result<()> {
        match given {
            Given::Points(..) if signed => return Err(without_inside("points")),
            Given::Volume(..) if signed => return Err(without_inside("labels")),
            Given::Points(label, points) => {
                check_points(points)?;
                let last = self.sets.last_label();
                let label = label.unwrap_or(last.saturating_add(1));
                self.sets.add_labelled(checked_label(label, last)?, points);
            }
            Given::Mesh(mesh) => self.sets.add_mesh(&checked_mesh(mesh, signed, note)?),
            Given::Volume(source, geometry) => {
                check_shape(source.shape(), geometry)?;
                check_grid(geometry)?;
                check_spacing("its spacing", Some(geometry.spacing))?;
                let before = self.sets.last_label();
                let borders = label_borders(&PlacedLabels { source: source.as_ref(), geometry }, cancel)?;
                for (label, positions) in borders {
                    let label = before.saturating_add(label);
                    self.sets.add_labelled(checked_label(label, self.sets.last_label())?, &positions);
                }
                self.volume.get_or_insert_with(|| geometry.clone());
            }
        }
        Ok(())
    }
}

/// Refuses points that are none.
pub(super) fn check_points(points: &[[f64; 3]]) -> Result<()> {
    if points.is_empty() {
        return Err(Error::input("holds no point"));
    }
    refuse_too_many("points", points.len() as u64)?;
    match points.iter().position(|p| !p.iter().all(|v| v.is_finite())) {
        Some(n) => Err(Error::input(format!("has a coordinate that is not finite at point {n}, counted from 0"))),
        None => Ok(()),
    }
}

/// Labels ascend, so that a source's label follows from its number; the largest number is that of no label.
fn checked_label(label: u32, last: u32) -> Result<u32> {
    if label > last && label < u32::MAX {
        return Ok(label);
    }
    Err(Error::usage(format!(
        "has the label {label} after one with the label {last}; give data sets in the order of their labels, from 1 on"
    )))
}

fn checked_mesh(mesh: &TriangleMesh, signed: bool, note: &mut impl FnMut(&str)) -> Result<TriangleMesh> {
    let mesh = TriangleMesh::new(mesh.vertices.clone(), mesh.triangles.clone())?;
    if mesh.is_empty() {
        return Err(Error::input("holds no triangle"));
    }
    if !signed {
        return Ok(mesh);
    }
    let solid = Solid::new(mesh);
    solid.found.sentences().iter().for_each(|sentence| note(sentence));
    if !solid.edges.is_closed() {
        let open = solid.edges.open;
        note(&format!("a mesh is open: {open} boundary edges; inside is where it winds around more than half"));
    }
    if !solid.edges.is_oriented() {
        let flipped = solid.edges.flipped;
        note(&format!(
            "a mesh has {flipped} edges whose triangles disagree on what is outside; signs there may be wrong"
        ));
    }
    Ok(solid.mesh)
}
