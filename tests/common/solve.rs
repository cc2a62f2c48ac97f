//! Distances as the schedules give them: any method of the table on a plain cloud, read back into plain vectors.

use strandline::grid::NO_SOURCE;
use strandline::grid::{Box3, Geometry, PointBins};
use strandline::kernel::distance::state::neighbours::Neighbours;
use strandline::pipeline::distance::{self, Method, Options, Schedule, Sources, Textbook};

use super::lab::{Lab, dense};
use super::textbook::Stored;

/// What a method's values are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Equation {
    /// The viscosity solution of the discrete Eikonal equation.
    Eikonal,
    /// The Euclidean distance to a tracked source.
    Euclidean,
}

/// The equation that a row of the table solves. A new row must be entered here, or the suite fails.
pub(crate) fn equation(method: Method) -> Equation {
    match method.name() {
        "fsm" | "fmm" => Equation::Eikonal,
        "vdt" | "dp" => Equation::Euclidean,
        other => panic!("which equation does {other} solve?"),
    }
}

/// The rows of the table that solve an equation.
pub(crate) fn methods_of(wanted: Equation) -> impl Iterator<Item = Method> {
    Method::all().filter(move |&method| equation(method) == wanted)
}

/// Whether a row of the table can be done by ordered sweeps.
pub(crate) fn sweeps(method: Method) -> bool {
    method.solver::<f32>().textbook == Textbook::Sweeps
}

/// A solved field, `[z][y][x]` over the whole grid.
pub(crate) struct Field<P> {
    pub(crate) values: Vec<P>,
    /// The nearest source, where one is known.
    pub(crate) sources: Vec<Option<usize>>,
    /// Bricks that were not resident when they were used.
    pub(crate) loads: u64,
}

/// As far as the grid goes, by face neighbours.
pub(crate) fn everywhere(sources: bool) -> Options {
    Options { farthest: f64::INFINITY, neighbours: Neighbours::Faces, sources, labels: false }
}

/// Solves on bricks of an edge over the whole domain.
pub(crate) fn solve<P: Stored>(
    lab: &Lab,
    geometry: &Geometry,
    cloud: &[[f64; 3]],
    edge: i64,
    method: Method,
    schedule: Schedule,
) -> Field<P> {
    let options = everywhere(true);
    solve_with(lab, geometry, cloud, edge, method, schedule, options)
}

/// Solves so with other options.
pub(crate) fn solve_with<P: Stored>(
    lab: &Lab,
    geometry: &Geometry,
    cloud: &[[f64; 3]],
    edge: i64,
    method: Method,
    schedule: Schedule,
    options: Options,
) -> Field<P> {
    let set = dense(geometry.shape, edge);
    let bins = PointBins::new(*set.grid(), geometry, cloud);
    let sources = Sources::cloud(geometry, cloud, &bins);
    let stage = lab.engine.stage("distance", 0);
    let solved = distance::solve::<P>(&stage, &sources, &set, method, schedule, options).expect("room for a field");
    stage.finish();
    let loads = lab.engine.reports().last().map_or(0, |report| report.brick_loads);
    let part = Box3::from_shape(geometry.shape);
    let mut values = vec![P::default(); part.len()];
    solved.values.read_box(&part, &mut values).expect("memory can be read");
    let mut sources = vec![NO_SOURCE; part.len()];
    solved.sources.read_box(&part, &mut sources).expect("memory can be read");
    let sources = sources.into_iter().map(|s| (s != NO_SOURCE).then_some(s as usize)).collect();
    Field { values, sources, loads }
}

/// The edge of one brick that holds all of a domain.
pub(crate) fn whole_edge(shape: [i64; 3]) -> i64 {
    shape.iter().fold(1, |most: i64, &n| most.max(n)).unsigned_abs().next_multiple_of(16) as i64
}
