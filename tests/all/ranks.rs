//! Distances solved by several ranks: each a thread with its own bricks, faces told by messages. Whatever the number of
//! ranks, distances, sources and the work done are those of one rank, bit for bit; what one rank computes is compared
//! with plain loops in `distance`.

use std::path::Path;
use std::process::{Command, Output};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use half::f16;
use proptest::prelude::*;
use strandline::error::{Error, ErrorKind, Result};
use strandline::exec::{Budget, Cancel, Comm, Engine, Progress, Silent, StageReport, as_threads};
use strandline::grid::{BrickGrid, BrickSet, Geometry, PointBins};
use strandline::kernel::distance::state::neighbours::Neighbours;
use strandline::kernel::distance::state::precision::Precision;
use strandline::pipeline::distance::{Method, Options, Reads, Schedule, Solving, Sources, solve_watched};
use strandline::store::{BoxSource, Element, Scratch};

use crate::common::clouds::{grid_around, sponge};
use crate::common::patience;
use crate::common::random::Random;

const SCHEDULES: [Schedule; 3] =
    [Schedule::Front, Schedule::Sweep { iterations: 1 }, Schedule::Sweep { iterations: 3 }];

/// Where and with how much ranks work.
struct Place<'a> {
    folder: &'a Path,
    window: u64,
    threads: usize,
    ranks: usize,
}

impl Place<'_> {
    fn engine(&self, comm: Arc<dyn Comm>, cancel: &Cancel, progress: &Arc<dyn Progress>) -> Engine {
        let scratch = Scratch::new(self.folder, self.window);
        let (threads, budget) = ((self.threads / self.ranks).max(1), Budget { total: 2 << 30 });
        let engine = Engine::new(threads, scratch, budget, cancel.clone(), progress.clone());
        engine.expect("threads start").as_rank(comm)
    }
}

fn silent() -> Arc<dyn Progress> {
    Arc::new(Silent)
}

/// A cloud on a grid, cut into bricks.
#[derive(Clone, Debug)]
struct Case {
    geometry: Geometry,
    cloud: Vec<[f64; 3]>,
    edge: i64,
    farthest: f64,
    neighbours: Neighbours,
}

/// A solved field: distances, sources, which voxels are fixed and how many; what it took.
#[derive(Debug, PartialEq)]
struct Field<P> {
    distances: Vec<P>,
    sources: Vec<u32>,
    fixed: Vec<u8>,
    fixed_voxels: u64,
    bricks: u64,
    rounds: u64,
}

fn whole<T: Element>(source: &dyn BoxSource<T>) -> Vec<T> {
    let part = strandline::grid::Box3::from_shape(source.shape());
    let mut values = vec![T::default(); part.len()];
    source.read_box(&part, &mut values).expect("scratch can be read");
    values
}

impl Case {
    /// Solves on all ranks of a place, each of which reads the whole field in the end; what they did is summed.
    fn solve<P: Precision>(
        &self,
        place: &Place<'_>,
        (method, schedule): (Method, Schedule),
        (cancel, progress): (&Cancel, &Arc<dyn Progress>),
    ) -> Result<(Field<P>, StageReport)> {
        let mut done = as_threads(place.ranks, |comm| {
            self.solve_rank::<P>(&place.engine(comm, cancel, progress), method, schedule)
        })?
        .into_iter();
        let (mut field, mut report) = done.next().expect("a rank");
        for (other, did) in done {
            let same =
                other.distances == field.distances && other.sources == field.sources && other.fixed == field.fixed;
            assert!(same, "ranks read the same");
            field.bricks += other.bricks;
            field.fixed_voxels += other.fixed_voxels;
            report.brick_loads += did.brick_loads;
            report.bytes_read += did.bytes_read;
            report.bytes_written += did.bytes_written;
        }
        Ok((field, report))
    }

    fn solve_rank<P: Precision>(
        &self,
        engine: &Engine,
        method: Method,
        schedule: Schedule,
    ) -> Result<(Field<P>, StageReport)> {
        let grid = BrickGrid::new(self.geometry.shape, self.edge);
        let bins = PointBins::new(grid, &self.geometry, &self.cloud);
        let sources = Sources::cloud(&self.geometry, &self.cloud, &bins);
        let stage = engine.stage("distance", 0);
        let all = [self.geometry.domain()];
        let reads = Reads { early: None, boxes: if engine.comm().ranks() > 1 { &all } else { &[] } };
        let by = (method, schedule);
        let solved = solve_watched::<P>(&stage, &sources, &BrickSet::dense(grid), by, self.options(), reads)?;
        let report = stage.finish();
        let field = Field {
            distances: whole(&*solved.values),
            sources: whole(&*solved.sources),
            fixed: whole(&*solved.fixed),
            fixed_voxels: solved.fixed_voxels,
            bricks: report.bricks,
            rounds: report.iterations,
        };
        Ok((field, report))
    }

    fn options(&self) -> Options {
        Options { farthest: self.farthest, neighbours: self.neighbours, sources: true, labels: false }
    }

    fn on<P: Precision>(&self, ranks: usize, threads: usize, method: Method, schedule: Schedule) -> Field<P> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let place = Place { folder: folder.path(), window: 1 << 30, threads, ranks };
        self.solve(&place, (method, schedule), (&Cancel::default(), &silent())).expect("room in scratch").0
    }

    /// All methods, schedules and neighbours on these ranks give what they give on one.
    fn check<P: Precision>(&self, ranks: &[usize]) {
        for method in Method::all() {
            for schedule in SCHEDULES {
                self.check_method::<P>(ranks, method, schedule);
            }
            if method.solver::<P>().takes_all_neighbours {
                let all = Self { neighbours: Neighbours::All, ..self.clone() };
                all.check_method::<P>(ranks, method, Schedule::Front);
            }
        }
    }

    fn check_method<P: Precision>(&self, ranks: &[usize], method: Method, schedule: Schedule) {
        let expected = self.on::<P>(1, 1, method, schedule);
        for &ranks in ranks {
            let found = self.on::<P>(ranks, 2, method, schedule);
            let (name, edge, geometry, neighbours) = (method.name(), self.edge, &self.geometry, self.neighbours);
            let what = format!("{name}, {schedule:?}, {neighbours:?}, {ranks} ranks, bricks of {edge}, {geometry:?}");
            assert_eq!(found.bricks, expected.bricks, "{what}: bricks computed");
            assert!(found == expected, "{what}");
        }
    }
}

/// Points anywhere in the domain or a little outside.
fn random_cloud(geometry: &Geometry, count: usize, seed: u64) -> Vec<[f64; 3]> {
    let mut random = Random(seed);
    let mut place =
        |a: usize| geometry.origin[a] + geometry.spacing[a] * (random.unit() * (geometry.shape[a] as f64 + 1.0) - 1.0);
    (0..count).map(|_| std::array::from_fn(&mut place)).collect()
}

fn case(shape: [i64; 3], spacing: [f64; 3], edge: i64, count: usize, seed: u64) -> Case {
    let geometry = Geometry { shape, spacing, origin: [-1.25, 0.5, 30.1], unit: None };
    let cloud = random_cloud(&geometry, count, seed);
    Case { geometry, cloud, edge, farthest: f64::INFINITY, neighbours: Neighbours::Faces }
}

/// Odd shapes, thin domains along each axis, more ranks than bricks.
#[test]
#[ignore = "long; .ci/run has it"]
fn any_number_of_ranks_gives_the_bits_of_one() {
    let shapes = [[33, 29, 21], [1, 40, 37], [70, 1, 1], [38, 23, 1], [1, 1, 50], [16, 16, 16], [1, 1, 1]];
    for (seed, shape) in shapes.into_iter().enumerate() {
        for (edge, ranks) in [(8, &[2, 3][..]), (16, &[3]), (32, &[2])] {
            case(shape, [0.3, 0.17, 0.9], edge, 9, seed as u64).check::<f32>(ranks);
        }
    }
    case([40, 33, 50], [0.1; 3], 8, 3, 7).check::<f64>(&[3, 5, 64]);
    case([20, 33, 41], [0.5; 3], 8, 30, 8).check::<f16>(&[2, 3]);
}

#[test]
#[ignore = "long; .ci/run has it"]
fn the_sponge_is_the_same_on_any_number_of_ranks() {
    let cloud = sponge();
    Case {
        geometry: grid_around(&cloud, 0.05),
        cloud,
        edge: 16,
        farthest: f64::INFINITY,
        neighbours: Neighbours::Faces,
    }
    .check::<f32>(&[2, 3]);
}

/// All sources in one corner: ranks start without a source, and are told of one by their neighbours only.
#[test]
fn a_rank_without_sources_hears_of_them() {
    let geometry = Geometry { shape: [20, 20, 90], spacing: [0.5; 3], origin: [0.0; 3], unit: None };
    let cloud = vec![[1.3, 2.2, 0.7], [8.1, 3.4, 1.9]];
    let case = Case { geometry, cloud, edge: 8, farthest: f64::INFINITY, neighbours: Neighbours::Faces };
    case.check::<f32>(&[2, 3, 6]);
    let far = case.on::<f32>(3, 1, Method::VDT, Schedule::Front);
    // The last voxel, at (9.5, 9.5, 44.5), is nearer to the second point.
    let expected = (1.4_f64.powi(2) + 6.1_f64.powi(2) + 42.6_f64.powi(2)).sqrt();
    assert_eq!(far.sources.last(), Some(&1));
    assert!((f64::from(far.distances[far.distances.len() - 1]) - expected).abs() < 1e-5 * expected);
}

/// A band around the cloud ends in the same rounds on all ranks, also where some never take part.
#[test]
fn bands_are_the_same() {
    let mut case = case([50, 44, 90], [0.4, 0.4, 0.7], 8, 4, 3);
    case.farthest = 3.0;
    for method in Method::all() {
        let expected = case.on::<f32>(1, 1, method, Schedule::Front);
        assert!(expected.distances.contains(&3.0));
        for ranks in [2, 3, 7] {
            assert!(case.on::<f32>(ranks, 1, method, Schedule::Front) == expected, "{} on {ranks}", method.name());
        }
    }
}

/// Also where bricks go through the disk: a window of one segment holds next to nothing.
#[test]
fn ranks_share_a_window_that_holds_little() {
    let case = case([90, 80, 70], [0.4; 3], 16, 20, 5);
    let expected = case.on::<f32>(1, 1, Method::VDT, Schedule::Front);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let place = Place { folder: folder.path(), window: 1, threads: 2, ranks: 3 };
    let (quiet, by) = (silent(), (Method::VDT, Schedule::Front));
    let (found, report) = case.solve::<f32>(&place, by, (&Cancel::default(), &quiet)).expect("room in scratch");
    assert!(found == expected);
    assert!(report.brick_loads >= 3 && report.bytes_read > 0 && report.bytes_written > 0, "{report:?}");
}

/// Counts steps and sends a signal at one of them.
struct SignalAt {
    steps: AtomicU64,
    at: u64,
    cancel: Cancel,
}

impl Progress for SignalAt {
    fn begin(&self, _name: &str, _total: u64) {}
    fn advance(&self, steps: u64) {
        if self.steps.fetch_add(steps, Relaxed) + steps >= self.at {
            self.cancel.flag().store(2, Relaxed);
        }
    }
    fn note(&self, _line: &str) {}
    fn end(&self) {}
}

#[test]
fn a_signal_ends_all_ranks() {
    let case = case([40, 40, 40], [0.4; 3], 8, 5, 1);
    let folder = tempfile::tempdir().expect("a temporary folder");
    for schedule in SCHEDULES {
        for at in [1, 20, 60, 130] {
            let cancel = Cancel::default();
            let progress: Arc<dyn Progress> =
                Arc::new(SignalAt { steps: AtomicU64::new(0), at, cancel: cancel.clone() });
            let place = Place { folder: folder.path(), window: 1 << 30, threads: 3, ranks: 3 };
            let error = case.solve::<f32>(&place, (Method::FSM, schedule), (&cancel, &progress));
            let error = error.expect_err("a signal came");
            assert_eq!(error.kind(), ErrorKind::Interrupted { signal: 2 }, "{schedule:?} after {at} bricks: {error}");
        }
    }
}

#[test]
fn scratch_that_cannot_be_made_ends_all_ranks() {
    let case = case([40, 40, 40], [0.4; 3], 8, 5, 1);
    let place = Place { folder: Path::new("/nowhere/at/all"), window: 0, threads: 1, ranks: 3 };
    let by = (Method::VDT, Schedule::Front);
    let error = case.solve::<f32>(&place, by, (&Cancel::default(), &silent())).expect_err("there is no such folder");
    assert_eq!(error.exit_code(), 1);
    assert!(error.to_string().contains("--scratch"), "{error}");
}

/// One rank fails while the others already wait for it in the middle of a solve.
#[test]
fn one_rank_that_fails_ends_those_that_solve() {
    let case = case([40, 40, 40], [0.4; 3], 8, 5, 1);
    let grid = BrickGrid::new(case.geometry.shape, case.edge);
    let bins = PointBins::new(grid, &case.geometry, &case.cloud);
    let sources = Sources::cloud(&case.geometry, &case.cloud, &bins);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let place = Place { folder: folder.path(), window: 1 << 30, threads: 1, ranks: 3 };
    let solver = Method::FSM.solver::<f32>();
    let failed = as_threads(place.ranks, |comm| {
        let engine = place.engine(comm, &Cancel::default(), &silent());
        let stage = engine.stage("distance", 0);
        if engine.comm().rank() == 1 {
            return Err(Error::failed("the disk of rank 1 is full"));
        }
        let plan = strandline::exec::HaloPlan::new(grid, strandline::exec::Reach::Faces);
        let ownership = strandline::exec::Ownership::balanced(&BrickSet::dense(grid), 3);
        let own = Arc::new(ownership.part(&BrickSet::dense(grid), engine.comm().rank(), &plan));
        (solver.solve)(&Solving::new(&stage, &engine, &sources, &own, case.options()), Schedule::Front)
            .map(|solved| solved.fixed_voxels)
    });
    assert_eq!(failed.expect_err("rank 1 failed").to_string(), "the disk of rank 1 is full");
}

prop_compose! {
    /// A random cloud on a random grid, and a number of ranks.
    fn random_case()(
        shape in prop::array::uniform3(1_i64..45),
        spacing in prop::sample::select(vec![[1.0; 3], [0.25, 0.5, 1.0], [0.31, 0.7, 0.113]]),
        edge in prop::sample::select(vec![8, 16, 32]),
        count in 1_usize..20,
        ranks in 2_usize..6,
        seed: u64,
    ) -> (Case, usize) {
        (case(shape, spacing, edge, count, seed), ranks)
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(6))]

    #[test]
    fn a_few_random_clouds_are_the_same_on_any_number_of_ranks((case, ranks) in random_case()) {
        case.check::<f32>(&[ranks]);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(25))]

    #[test]
    #[ignore = "long; .ci/run has it"]
    fn random_clouds_are_the_same_on_any_number_of_ranks((case, ranks) in random_case()) {
        case.check::<f32>(&[ranks]);
    }
}

fn strandline(arguments: &[&str]) -> Output {
    patience::run(Command::new(env!("CARGO_BIN_EXE_strandline")).args(arguments))
}

/// All files under a folder, with their contents, sorted; the report left out.
fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(next) = folders.pop() {
        for entry in std::fs::read_dir(next).expect("the store is readable") {
            let path = entry.expect("the store is readable").path();
            if path.is_dir() {
                folders.push(path);
            } else if path
                .file_name()
                .is_some_and(|name| name != "report.json" && name != "report.html" && name != "checksums.txt")
            {
                let name = path.strip_prefix(folder).expect("inside the folder").display().to_string();
                found.push((name, std::fs::read(path).expect("the store is readable")));
            }
        }
    }
    found.sort();
    found
}

/// The whole command, with everything it can write: the store holds the same bytes, the report says how many ranks.
#[test]
fn the_command_writes_the_same_bytes_on_any_number_of_ranks() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let box_ = "v 0 0 0\nv 4 0 0\nv 4 3 0\nv 0 3 0\nv 0 0 2\nv 4 0 2\nv 4 3 2\nv 0 3 2\n\
                f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
    std::fs::write(path("box.obj"), box_).expect("a file is written");
    std::fs::write(path("far.obj"), box_.replace("v ", "v 5")).expect("a file is written");
    for schedule in ["front", "sweep"] {
        let write = |ranks: &str| {
            let out = path(&format!("{schedule}-{ranks}.zarr"));
            let (a, b) = (path("box.obj"), path("far.obj"));
            let done = strandline(&[
                "distance",
                &a,
                &b,
                "-o",
                &out,
                "--spacing",
                "0.9,1.1,0.7",
                "--schedule",
                schedule,
                "--brick",
                "16",
                "--signed",
                "--labels",
                "--closest-point",
                "--ranks",
                ranks,
                "--memory",
                "512MiB",
                "--quiet",
            ]);
            assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
            let report = std::fs::read_to_string(Path::new(&out).join("report.json")).expect("a report");
            let report: serde_json::Value = serde_json::from_str(&report).expect("JSON");
            assert_eq!(report["ranks"].to_string(), ranks);
            let solved = report["stages"].as_array().expect("stages").iter().find(|s| s["name"] == "distance");
            (files(Path::new(&out)), solved.expect("a stage of that name")["bricks"].clone(), report["result"].clone())
        };
        let expected = write("1");
        assert!(expected.0.len() > 10);
        for ranks in ["2", "3"] {
            assert!(write(ranks) == expected, "{schedule} on {ranks} ranks");
        }
    }
}

/// Shards of all levels that lie over the parts of several ranks, more ranks than shards, both versions of OME-Zarr.
#[test]
fn shards_are_whole_whoever_writes_them() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    std::fs::write(path("a.xyz"), "0 0 0\n1 0.3 0.2\n2.6 1.2 0.1\n0.4 1.4 0.3\n").expect("a file is written");
    std::fs::write(path("b.xyz"), "2.1 0.2 0.2\n1.3 1.1 0\n").expect("a file is written");
    for flags in [&["--ome", "0.5"][..], &["--ome", "0.4"], &["--max-distance", "0.2", "--method", "fsm"]] {
        let write = |ranks: &str| {
            let out = path(&format!("{ranks}.zarr"));
            let (a, b) = (path("a.xyz"), path("b.xyz"));
            let grid = ["--origin=0,0,0", "--shape", "290,150,34", "--spacing", "0.01", "--brick", "32"];
            let all = ["distance", &a, &b, "-o", &out, "--labels", "--quiet", "--overwrite", "--ranks", ranks];
            let done = strandline(&[&all[..], &grid, flags].concat());
            assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
            let verified = strandline(&["verify", &out]);
            assert!(verified.status.success(), "{}", String::from_utf8_lossy(&verified.stdout));
            files(Path::new(&out))
        };
        let expected = write("1");
        for ranks in ["2", "3", "5", "8"] {
            assert!(write(ranks) == expected, "{flags:?} on {ranks} ranks");
        }
    }
}

/// Processes that a launcher has started together would each do all of the work, where they cannot share it.
#[test]
fn a_launcher_of_several_processes_is_noticed() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let cloud = folder.path().join("cloud.xyz");
    std::fs::write(&cloud, "0 0 0\n1 2 3\n").expect("a file is written");
    let run = |command: &str, variable: &str, processes: &str| {
        let mut strandline = Command::new(env!("CARGO_BIN_EXE_strandline"));
        let done = patience::run(
            strandline.args([command, &cloud.display().to_string(), "-o", "none"]).env(variable, processes),
        );
        (done.status.code(), String::from_utf8_lossy(&done.stderr).into_owned())
    };
    for variable in ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE"] {
        let (code, said) = run("batch", variable, "4");
        assert!(code == Some(2) && said.contains("4 processes") && said.contains(variable), "{code:?} {said}");
    }
    #[cfg(not(feature = "mpi"))]
    {
        let (code, said) = run("distance", "PMI_SIZE", "2");
        assert!(code == Some(2) && said.contains("--features mpi"), "{code:?} {said}");
        let (_, said) = run("distance", "PMI_SIZE", "1");
        assert!(!said.contains("processes"), "{said}");
    }
}

#[test]
fn numbers_of_ranks_that_make_no_sense_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let cloud = folder.path().join("cloud.xyz");
    std::fs::write(&cloud, "0 0 0\n1 2 3\n").expect("a file is written");
    let cloud = cloud.display().to_string();
    for ranks in ["0", "65"] {
        let done = strandline(&["distance", &cloud, "-o", "none", "--ranks", ranks]);
        assert_eq!(done.status.code(), Some(2));
        let said = String::from_utf8_lossy(&done.stderr);
        assert!(said.contains(&format!("--ranks is {ranks}; give 1 to 64")), "{said}");
    }
    let help = strandline(&["distance", "--help"]);
    assert!(!String::from_utf8_lossy(&help.stdout).contains("--ranks"), "a flag for tests stays out of the help");
}
