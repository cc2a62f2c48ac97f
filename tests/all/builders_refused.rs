//! What the builders of the library refuse before anything is computed, each in one sentence in their own words.

#![allow(clippy::unwrap_used)]

use std::error::Error as _;

use strandline::{
    Cancel, DistanceField, Error, ErrorKind, FillGaps, Geometry, Method, MiddleSurface, Neighbours, Reconstruction,
    Schedule, Segmentation, SolvedDistance, SolvedMiddle, SolvedReconstruction, SolvedSegmentation, Stop, SurfaceKind,
    TriangleMesh, Volume,
};

use crate::common::clouds::sphere;
use crate::common::meshes::cuboid;

const POINTS: [[f64; 3]; 2] = [[0.0; 3], [1.0; 3]];

/// Refused for a reason that names `what`, without a flag of the command line.
fn refused<T>(result: Result<T, Error>, what: &str) {
    let error = result.err().unwrap_or_else(|| panic!("not refused: {what}"));
    let told = error.to_string();
    assert!(told.contains(what) && !told.contains("--"), "{told:?} does not tell {what:?}");
    assert!(matches!(error.kind(), ErrorKind::Usage | ErrorKind::Input), "{told}");
}

#[test]
fn distances_that_make_no_sense() {
    let sweep = Schedule::Sweep { iterations: 1 };
    let job = || DistanceField::new().points(&POINTS).spacing([0.1; 3]);
    let cases: [(DistanceField<'_>, &str); 20] = [
        (job().schedule(sweep).neighbours(Neighbours::All), "sweeps by bricks cannot keep the order of 26 neighbours"),
        (job().method(Method::FSM).neighbours(Neighbours::All), "`method` fsm looks at 6 neighbours"),
        (job().schedule(sweep).max_distance(1.0), "`max_distance` needs `schedule` front"),
        (job().schedule(Schedule::Sweep { iterations: 0 }), "`iterations` is 0"),
        (job().max_distance(0.0), "`max_distance` is 0"),
        (job().max_distance(f64::NAN), "`max_distance` is NaN"),
        (job().brick(24), "`brick` is 24; give a multiple of 16"),
        (job().spacing([0.1, 0.0, 0.1]), "`spacing` is 0.1,0,0.1"),
        (job().padding(-1.0), "`padding` is -1"),
        (job().spacing([1e-12; 3]), "give a larger `spacing`"),
        (job().grid(Geometry::new([4; 3], [1.0; 3], [0.0; 3])), "`grid` says all of the grid"),
        (DistanceField::new().points(&POINTS).grid(Geometry::new([4, 0, 4], [1.0; 3], [0.0; 3])), "`shape` is 4,0,4"),
        (DistanceField::new().points(&POINTS).grid(Geometry::new([4; 3], [-1.0; 3], [0.0; 3])), "the grid's spacing"),
        (job().threads(0), "`threads` is 0"),
        (job().memory(1 << 20), "give `memory` of"),
        (job().memory(u64::MAX), "`memory` is"),
        (job().scratch("/there is no such folder"), "name another with `scratch`"),
        (job().signed(), "data set 1 holds points, which have no inside here; `signed` needs triangle meshes"),
        (DistanceField::new(), "there is no source"),
        (DistanceField::new().points(&POINTS[..1]), "all sources lie in one point"),
    ];
    for (job, what) in cases {
        refused(job.solve(), what);
    }
    let wide = Geometry::new([100; 3], [1000.0; 3], [0.0; 3]);
    refused(DistanceField::new().points(&POINTS).grid(wide).solve_as::<half::f16>(), "`precision` float16");
}

#[test]
fn sources_that_are_none() {
    let job = DistanceField::new;
    refused(job().points(Vec::new()).solve(), "data set 1 holds no point");
    refused(
        job().points(&POINTS).points(&[[0.0, f64::NAN, 0.0]]).solve(),
        "data set 2 has a coordinate that is not finite",
    );
    refused(
        job().labelled(5, &POINTS).labelled(5, &POINTS).solve(),
        "data set 2 has the label 5 after one with the label 5",
    );
    refused(job().labelled(0, &POINTS).solve(), "has the label 0");
    refused(job().labelled(u32::MAX, &POINTS).solve(), "has the label 4294967295");
    refused(job().mesh(TriangleMesh::default()).solve(), "data set 1 holds no triangle");
    let torn = TriangleMesh { vertices: POINTS.to_vec(), triangles: vec![[0, 1, 2]] };
    refused(job().mesh(&torn).solve(), "names the vertices [0, 1, 2] of 2");
    let grid = Geometry::new([2; 3], [1.0; 3], [0.0; 3]);
    let flat = Volume::new([2; 3], vec![3_u32; 8]).unwrap();
    refused(job().label_volume(&flat, grid.clone()).solve(), "holds no border of a label");
    refused(job().label_volume(&flat, Geometry { shape: [2, 2, 3], ..grid.clone() }).solve(), "give the same shape");
    refused(job().label_volume(&flat, grid).signed().solve(), "holds labels, which have no inside");
    refused(Volume::new([2; 3], vec![0_u8; 7]), "2 x 2 x 2 voxels (x, y, z) cannot hold 7 values");
    refused(Volume::new([0, 2, 2], Vec::<u8>::new()), "give as many values as voxels");
}

/// An open mesh can be signed all the same, with a note.
#[test]
fn what_is_odd_is_told() {
    let mut mesh = cuboid([0.0; 3], [1.0; 3]);
    mesh.triangles.pop();
    let found = DistanceField::new().mesh(mesh).spacing([0.25; 3]).signed().solve().unwrap();
    assert!(found.notes()[0].contains("3 boundary edges"), "{:?}", found.notes());
    let grid = Geometry::new([4; 3], [0.1; 3], [5.0; 3]);
    let away = DistanceField::new().points(&POINTS).grid(grid).solve().unwrap();
    assert!(away.notes()[0].contains("all 2 sources lie outside of the grid") && !away.notes()[0].contains("--"));
}

#[test]
fn middle_surfaces_that_make_no_sense() {
    let job = || MiddleSurface::new().points(&POINTS).spacing([0.2; 3]);
    refused(job().solve(), "a middle surface lies between data sets");
    let three = job().points(&[[0.0, 2.0, 0.0]]).points(&[[2.0, 0.0, 0.0]]).surface(SurfaceKind::Labels);
    refused(three.solve(), "`surface` labels draws the border of two data sets, but 3 were given");
    let sweep = Schedule::Sweep { iterations: 1 };
    refused(job().points(&POINTS).schedule(sweep).neighbours(Neighbours::All).solve(), "26 neighbours");
}

#[test]
fn reconstructions_that_make_no_sense() {
    let cloud = sphere([0.0; 3], 1.0, 300, |_| true);
    let job = || Reconstruction::of(&cloud);
    let grid = Geometry::new([4; 3], [0.1; 3], [0.0; 3]);
    for (job, what) in [
        (job().beta(0.0), "`beta` is 0; it must be a number, more than 0"),
        (job().noise(-0.1), "`noise` is -0.1; it must be a number, 0 or more"),
        (job().theta(-1.0), "`theta` is -1"),
        (job().delta(f64::NAN), "`delta` is NaN"),
        (job().tau(0.0), "`tau` is 0"),
        (job().epsilon(0.0), "`epsilon` is 0"),
        (job().omega(2.0), "`omega` is 2; it must be a number, between 0 and 2"),
        (job().stop(Stop::L2(0.0)), "`tol` is 0"),
        (job().drop_isolated(0.0), "`drop_isolated` is 0"),
        (job().spacing([0.0; 3]), "`spacing` is 0,0,0"),
        (job().spacing([1e-5; 3]), "give a larger `spacing`"),
        (job().spacing([0.1; 3]).grid(grid.clone()), "`grid` says all of the grid"),
        (job().grid(Geometry { shape: [0; 3], ..grid.clone() }), "`shape` is 0,0,0"),
        (job().memory(1 << 20), "`memory`"),
        (Reconstruction::of(Vec::new()), "the cloud holds no point"),
        (Reconstruction::of(vec![[1.0; 3]; 9]), "all points lie in one place"),
        (Reconstruction::of(vec![[f64::INFINITY; 3]]), "is not finite at point 0"),
        (Reconstruction::of(&cloud[..150]).beta(0.01), "`beta`"),
    ] {
        refused(job.solve(), what);
    }
}

#[test]
fn segmentations_that_make_no_sense() {
    let shape = [16, 16, 8];
    let image = Volume::new(shape, (0..2048).map(|n| (n % 251) as u8).collect::<Vec<_>>()).unwrap();
    let grid = Geometry::new(shape, [1.0; 3], [0.0; 3]);
    let empty = || Segmentation::of(&image, grid.clone());
    let ball = sphere([8.0, 8.0, 4.0], 3.0, 100, |_| true);
    let job = || empty().points(1, &ball);
    for (job, what) in [
        (empty(), "no object is marked"),
        (empty().points(0, &ball), "object 0 is what has no label"),
        (job().seed(1, [8.0; 3], 2.0), "object 1 is marked in two ways"),
        (job().outline(1, &ball), "object 1 is marked in two ways"),
        (empty().points(3, vec![[f64::NAN; 3]]), "a mark of object 3 has a coordinate that is not finite"),
        (empty().points(2, &ball[..2]), "object 2"),
        (empty().seed(1, [80.0; 3], 2.0), "`seed` 80,80,80,2 holds no voxel"),
        (empty().seed(1, [8.0; 3], 0.0), "`seed` needs"),
        (job().rho(f64::INFINITY), "`rho` is inf"),
        (job().theta(-1.0), "`theta` is -1"),
        (job().k(-1.0), "`k` is -1"),
        (job().sigma(-1.0), "`sigma` is -1"),
        (job().sigma(1e3), "`sigma` 1000"),
        (job().beta(1e3), "`beta` is 1000, and the image no longer than"),
        (job().percentiles(99.0, 1.0), "`percentiles` is 99,1"),
        (job().fill_gaps(FillGaps::Width(0.0)), "`fill_gaps` is 0"),
        (job().brick(8), "`brick` is 8"),
        (job().memory(1 << 20), "`memory`"),
        (
            Segmentation::of(&image, Geometry { shape: [16, 8, 16], ..grid.clone() }).points(1, &ball),
            "give the same shape",
        ),
        (Segmentation::of(&image, Geometry { spacing: [0.0; 3], ..grid.clone() }).points(1, &ball), "spacing"),
    ] {
        refused(job.solve(), what);
    }
}

/// Jobs and results go from one thread to another.
#[test]
fn jobs_and_results_are_sent() {
    fn is_sent<T: Send + Sync>() {}
    is_sent::<DistanceField<'_>>();
    is_sent::<MiddleSurface<'_>>();
    is_sent::<Reconstruction<'_>>();
    is_sent::<Segmentation<'_>>();
    is_sent::<SolvedDistance<f32>>();
    is_sent::<SolvedMiddle<f64>>();
    is_sent::<SolvedReconstruction>();
    is_sent::<SolvedSegmentation>();
    is_sent::<Error>();
}

/// A run that is cancelled ends with an error of its own kind, and writes no store.
#[test]
fn runs_can_be_ended() {
    let folder = tempfile::tempdir().unwrap();
    let cancel = Cancel::default();
    cancel.flag().store(2, std::sync::atomic::Ordering::Relaxed);
    let store = folder.path().join("never.zarr");
    let job = DistanceField::new().points(&POINTS).spacing([0.1; 3]).cancel(&cancel).store(&store);
    let error = job.solve().err().unwrap();
    assert!(matches!(error.kind(), ErrorKind::Interrupted { signal: 2 }), "{error}");
    assert!(std::fs::read_dir(folder.path()).unwrap().next().is_none());
}

#[test]
fn errors_keep_their_source() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path().join("no such folder").join("out.zarr");
    let error = DistanceField::new().points(&POINTS).spacing([0.1; 3]).scratch(folder.path()).store(&store);
    let error = error.solve().err().unwrap();
    let source = error.source().and_then(|source| source.downcast_ref::<std::io::Error>());
    assert!(source.is_none_or(|source| source.kind() == std::io::ErrorKind::NotFound), "{error}: {source:?}");
    let missing = strandline::io::geometry::read::sources::read_source(&folder.path().join("no.xyz")).unwrap_err();
    let source = missing.source().and_then(|source| source.downcast_ref::<std::io::Error>()).unwrap();
    assert_eq!(source.kind(), std::io::ErrorKind::NotFound);
    assert!(missing.to_string().ends_with(&source.to_string()), "{missing}");
}

/// More temporary fields than any disk has free, though memory would do: of the solved field and of what stays readable.
#[test]
fn runs_that_no_disk_holds() {
    let folder = tempfile::tempdir().unwrap();
    let wide = Geometry::new([16_000; 3], [1.0; 3], [0.0; 3]);
    let job = || DistanceField::new().points(&POINTS).grid(wide.clone()).brick(128).threads(1).memory(2 << 30);
    let job = |labels: bool| if labels { job().labels() } else { job() };
    let told = |labels| {
        let error = job(labels).scratch(folder.path()).store(folder.path().join("out.zarr")).solve().err().unwrap();
        assert_eq!(error.kind(), ErrorKind::Failed, "{error}");
        error.to_string()
    };
    for told in [told(false), told(true)] {
        assert!(told.contains("a grid of 4 096 000 000 000 voxels needs "), "{told}");
        assert!(told.contains("`scratch`") && told.contains("`spacing`") && !told.contains("--"), "{told}");
    }
    // Numbers of sources stay readable too: 4 bytes a voxel in bricks of 64^3.
    let tib = |told: String| told.split("needs ").nth(1).unwrap().split(' ').next().unwrap().parse::<f64>().unwrap();
    let more = 4.0 * 16_000_f64.powi(3) / 1024_f64.powi(4);
    assert!((tib(told(true)) - tib(told(false)) - more).abs() < 0.2, "{} {}", told(true), told(false));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "nothing was begun");
}
